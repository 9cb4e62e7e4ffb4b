//! Mesh files, recognised by their contents.

// Requirement: M-03

#[cfg(feature = "formats")]
mod base64;
mod check;
mod coordinates;
mod cursor;
mod error;
pub(crate) mod file;
mod foreign;
#[cfg(feature = "formats")]
mod gltf;
mod gmsh;
mod groups;
#[cfg(feature = "formats")]
mod inflate;
mod obj;
mod off;
mod ply;
mod polygon;
mod raw;
mod report;
mod scalar;
mod sniff;
mod stl;
mod text;
#[cfg(feature = "formats")]
mod three_mf;
mod volume;
mod vtk;
mod vtk_cells;
mod vtk_data;
#[cfg(feature = "formats")]
mod vtp;
mod weld;

pub use error::{ReadError, ReadErrorKind};
pub use groups::{Group, Groups};
pub use report::{Format, Report};

use crate::mesh::{Mesh, RestSurface};
use crate::rounding::round_up;
pub(crate) use coordinates::FileCoordinates;
use dibs_nostd::format::Unit;
use glam::{DVec3, Vec3};
use raw::Raw;
pub(crate) use raw::excerpt;
pub(crate) use scalar::{Endian, Scalar};
use std::path::Path;

/// A mesh that passed every check, and the report on findings and repairs.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The surface: at most 64 connected components without degenerate or duplicate triangles.
    pub mesh: Mesh,
    /// Counts of the elements read, welded, dropped and found.
    pub report: Report,
    /// The labels that the file's groups give its triangles, if [`ReadOptions::groups`] is set.
    pub groups: Option<Groups>,
    /// The face of the file, counted from 0, that each triangle of the mesh comes from.
    pub faces: Vec<u32>,
}

/// How to read a mesh file. [`read`] uses the defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Weld vertices that are at most this far apart, in mm; 0 welds those with
    /// exactly equal f32 coordinates (`-0.0` equals `0.0`).
    ///
    /// `None` decides by the file: triangle soup (STL, and an indexed file in which no two faces share a vertex) is
    /// welded exactly. Other indexed files are not welded, because two sheets of tissue that touch in the rest shape
    /// may separate later. The [`Report`] counts coincident vertices that were not welded.
    pub weld_tolerance: Option<f32>,
    /// Make degenerate and duplicate triangles an error, instead of dropping and counting them.
    pub strict: bool,
    /// Keep only the connected component with the most triangles.
    pub largest_component: bool,
    /// The unit of the file's lengths, which are converted to millimetres. `None` takes the unit that the file states,
    /// as glTF (always metres) and 3MF do, or millimetres if it states none. A unit other than the stated one is an
    /// error.
    pub unit: Option<Unit>,
    /// The point of the file, in millimetres, that the mesh's positions are relative to: [`Mesh::origin`].
    ///
    /// `None` decides by the file. The origin is zero, unless f32 would round the mesh by more than 2^-20 of its
    /// extent: then it is the centre of its bounding box, rounded to a number of few bits. A mesh of 100 mm in double
    /// precision is recentred from a coordinate of about 2 m on.
    pub origin: Option<DVec3>,
    /// Make labels of the file's groups ([`Import::groups`]), or fail where it has none: the names of OBJ's `g` and
    /// `usemtl`, numbered from 0 in the order of their first face; the numbers of Gmsh's physical groups, 0 for none;
    /// the values of VTK's cell data named `label`, `labels` or `RegionId`.
    pub groups: bool,
}

impl RestSurface for Import {
    fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    fn position_error(&self) -> f32 {
        round_up(self.report.position_error)
    }

    fn unit(&self) -> Option<Unit> {
        Some(self.report.unit)
    }

    fn file_triangles(&self) -> usize {
        self.report.file_triangles
    }

    fn file_faces(&self) -> Option<(&[u32], usize)> {
        Some((&self.faces, self.report.faces))
    }
}

impl Import {
    /// The default options, for [`ReadOptions::read`].
    #[must_use]
    pub fn options() -> ReadOptions {
        ReadOptions::default()
    }
}

impl ReadOptions {
    /// Reads and checks a mesh file. See [`read`].
    ///
    /// # Errors
    /// As [`read`]; with `strict` also for degenerate and duplicate triangles.
    pub fn read(&self, path: impl AsRef<Path>) -> Result<Import, ReadError> {
        let path = path.as_ref();
        let fail = |kind| ReadError { path: path.to_path_buf(), kind };
        let bytes = file::whole(path).map_err(|error| fail(error.into()))?;
        self.read_bytes(bytes, path).map_err(fail)
    }

    fn read_bytes(&self, bytes: Vec<u8>, path: &Path) -> Result<Import, ReadErrorKind> {
        self.check_options()?;
        let wanted = if self.groups { ReadTarget::Groups } else { ReadTarget::Surface };
        let (format, raw) = elements(bytes, path, wanted)?;
        let mut import = self.import(format, raw)?;
        let extension = path.extension().and_then(|extension| extension.to_str());
        import.report.extension_disagrees = extension.is_some_and(|e| !format.has_extension(e));
        Ok(import)
    }

    /// Checks a mesh in memory as [`read`](Self::read) checks a file's: with the same repairs, and the same report.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    ///
    /// ```
    /// use dibs_build::{Import, glam::DVec3};
    /// let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    /// let import = Import::options().check(&corners, &[[0, 1, 2]])?;
    /// assert_eq!(import.report.border_edges, 3);
    /// assert!(Import::options().check(&corners, &[[0, 1, 3]]).is_err());
    /// # Ok::<(), dibs_build::ReadErrorKind>(())
    /// ```
    pub fn check(
        &self,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
    ) -> Result<Import, ReadErrorKind> {
        self.check_options()?;
        let mut raw = Raw::new(0);
        raw.positions = positions.iter().map(DVec3::to_array).collect();
        for corners in triangles {
            raw.corners.extend(corners);
            raw.end_face();
        }
        self.import(Format::Memory, raw)
    }

    fn check_options(&self) -> Result<(), ReadErrorKind> {
        if let Some(tolerance) = self.weld_tolerance
            && !(tolerance.is_finite() && tolerance >= 0.0)
        {
            return Err(ReadErrorKind::Tolerance { tolerance });
        }
        if let Some(origin) = self.origin
            && !origin.is_finite()
        {
            return Err(ReadErrorKind::Origin { origin });
        }
        Ok(())
    }

    fn import(&self, format: Format, mut raw: Raw) -> Result<Import, ReadErrorKind> {
        if self.groups && raw.groups.is_none() {
            return Err(ReadErrorKind::NoGroups { format });
        }
        let unit = unit_of(format, raw.unit, self.unit)?;
        let place = FileCoordinates::of_mesh(&raw, unit, self.origin)?;
        for position in &mut raw.positions {
            *position = place.of(*position).to_array();
        }
        check::import(&raw, format, self, place)
    }
}

/// What is read from a file: the remedies in errors depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ReadTarget {
    #[default]
    Surface,
    /// A surface, and the groups of its faces.
    Groups,
    /// The nodes of a volume of tetrahedra.
    Volume,
}

/// The unit of a file's lengths: the one that it states, or else the given one, or millimetres.
///
/// # Errors
/// [`ReadErrorKind::OtherUnit`] if both are given and differ: lengths are converted only once.
pub(crate) fn unit_of(
    format: Format,
    stated: Option<Unit>,
    given: Option<Unit>,
) -> Result<Unit, ReadErrorKind> {
    match (stated, given) {
        (Some(stated), Some(given)) if stated != given => {
            Err(ReadErrorKind::OtherUnit { format, stated, given })
        }
        (stated, given) => Ok(stated.or(given).unwrap_or_default()),
    }
}

/// The positions of a mesh file that is a frame (mm, relative to `origin`), and its faces.
///
/// # Errors
/// [`ReadErrorKind::UnnumberedFrame`] for STL, whose vertices may be numbered otherwise than the tree's.
pub(crate) fn frame(
    path: &Path,
    wanted: ReadTarget,
    number: usize,
    unit: Option<Unit>,
    origin: DVec3,
) -> Result<(Vec<Vec3>, Vec<Vec<u32>>), ReadErrorKind> {
    let (format, raw) = elements(file::whole(path)?, path, wanted)?;
    if matches!(format, Format::StlAscii | Format::StlBinary) {
        return Err(ReadErrorKind::UnnumberedFrame);
    }
    let place = FileCoordinates { unit: unit_of(format, raw.unit, unit)?, origin };
    let positions = place.frame_of(&raw.positions, number)?;
    Ok((positions, raw.faces().map(<[u32]>::to_vec).collect()))
}

/// The nodes (mm) and tetrahedra of a volume file.
pub(crate) fn volume(
    path: &Path,
    unit: Option<Unit>,
) -> Result<(Vec<DVec3>, Vec<[u32; 4]>), ReadErrorKind> {
    let (format, raw) = elements(file::whole(path)?, path, ReadTarget::Volume)?;
    if raw.other_cells > 0 || raw.tetrahedra.is_empty() {
        let (tetrahedra, others) = (raw.tetrahedra.len(), raw.other_cells);
        return Err(ReadErrorKind::NoVolume { format, tetrahedra, others });
    }
    let place = FileCoordinates { unit: unit_of(format, raw.unit, unit)?, origin: DVec3::ZERO };
    let nodes = raw.positions.iter().map(|&position| place.of(position)).collect();
    Ok((nodes, raw.tetrahedra))
}

/// The format of a file, and its vertices and polygons, with their groups if requested.
pub(crate) fn elements(
    bytes: Vec<u8>,
    path: &Path,
    wanted: ReadTarget,
) -> Result<(Format, Raw), ReadErrorKind> {
    // A binary STL may begin with any bytes.
    let bytes = if stl::size_fits_count(&bytes) { bytes } else { text::normal(bytes) };
    let format = sniff::format(&bytes, path, wanted)?;
    let raw = match format {
        Format::Obj => obj::read(&bytes, wanted == ReadTarget::Groups),
        Format::StlAscii => stl::read_ascii(&bytes),
        Format::StlBinary => stl::read_binary(&bytes),
        Format::Ply => ply::read(bytes),
        Format::Off => off::read(&bytes),
        Format::Vtk => vtk::read(&bytes, wanted),
        Format::Gmsh => gmsh::read(&bytes, wanted),
        // No file is recognised as this format.
        Format::Memory => Err(ReadErrorKind::UnknownFormat),
        #[cfg(feature = "formats")]
        Format::Vtp => vtp::read(&bytes, wanted),
        #[cfg(feature = "formats")]
        Format::Gltf => gltf::read(&bytes, path.parent().unwrap_or(Path::new(""))),
        #[cfg(feature = "formats")]
        Format::ThreeMf => three_mf::read(&bytes),
        #[cfg(not(feature = "formats"))]
        Format::Vtp | Format::Gltf | Format::ThreeMf => Err(ReadErrorKind::LeftOut { format }),
    }?;
    Ok((format, raw))
}

/// Reads and checks a mesh file in OBJ, STL (ASCII or binary), PLY (ASCII, little- or big-endian), OFF, legacy VTK or
/// Gmsh's format; with the feature `formats` also in VTK's XML, glTF or 3MF. Formats are recognised by content.
/// Polygons are triangulated, soup is welded, degenerate and duplicate triangles are dropped and counted.
///
/// Vertex numbers are those of the file, even after welding and dropping: an unused vertex keeps its row in
/// [`Mesh::positions`], so a recorded [`Motion`](crate::Motion) still fits. STL has no vertex numbers: distinct
/// positions are numbered in order of first appearance.
///
/// The whole file is held in memory. Memory is bounded by the size of the file and of regular files that it refers to,
/// not by a count that they claim. Pipes and devices are refused. Elements that are left out are listed in
/// [`Report::remarks`].
///
/// # Errors
/// [`ReadError`], one sentence that names the file, the offending element and the remedy.
///
/// ```
/// # let path = std::env::temp_dir().join(format!("dibs-doc-{}.obj", std::process::id()));
/// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
/// let import = dibs_build::read(&path)?;
/// assert_eq!(import.mesh.triangles.len(), 2);
/// assert_eq!(import.report.polygons_triangulated, 1);
/// # std::fs::remove_file(path).unwrap();
/// # Ok::<(), dibs_build::ReadError>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Import, ReadError> {
    ReadOptions::default().read(path)
}
