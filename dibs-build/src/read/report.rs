//! The counts and warnings of an import.

use super::ReadErrorKind;
use dibs_nostd::format::Unit;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::path::Path;

/// The format of a mesh file; or none, for a mesh in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// STL written as text.
    StlAscii,
    /// STL in binary.
    StlBinary,
    /// Stanford PLY: ASCII, little- or big-endian.
    Ply,
    /// Object File Format, as text.
    Off,
    /// VTK's legacy format: PolyData, or an unstructured grid.
    Vtk,
    /// VTK's XML: PolyData (`.vtp`), or an unstructured grid (`.vtu`).
    Vtp,
    /// glTF 2.0, as JSON or as GLB.
    Gltf,
    /// Gmsh's mesh, version 1, 2 or 4.1.
    Gmsh,
    /// 3D Manufacturing Format.
    ThreeMf,
    /// No file: arrays of positions and triangles.
    Memory,
}

impl Format {
    /// The format of a mesh file: by its content, or where that does not decide by its extension.
    ///
    /// # Errors
    /// [`ReadErrorKind::Foreign`] for a known kind of file that is not read, otherwise
    /// [`ReadErrorKind::UnknownFormat`].
    pub fn of(bytes: &[u8], path: impl AsRef<Path>) -> Result<Self, ReadErrorKind> {
        super::sniff::format(bytes, path.as_ref(), super::ReadTarget::Surface)
    }

    /// Whether an extension, in any case, is one of the format's.
    pub(super) fn has_extension(self, extension: &str) -> bool {
        let other = match self {
            Self::Gltf => "glb",
            Self::Vtp => "vtu",
            _ => self.extension(),
        };
        extension.eq_ignore_ascii_case(other) || extension.eq_ignore_ascii_case(self.extension())
    }

    /// The usual file name extension, in lower case; none in memory.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::StlAscii | Self::StlBinary => "stl",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::Vtk => "vtk",
            Self::Vtp => "vtp",
            Self::Gltf => "gltf",
            Self::Gmsh => "msh",
            Self::ThreeMf => "3mf",
            Self::Memory => "",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::StlAscii => "ASCII STL",
            Self::StlBinary => "binary STL",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Vtk => "legacy VTK",
            Self::Vtp => "VTK XML",
            Self::Gltf => "glTF",
            Self::Gmsh => "Gmsh",
            Self::ThreeMf => "3MF",
            Self::Memory => "mesh in memory",
        })
    }
}

/// Counts of the elements read, welded, dropped and found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The format of the content.
    pub format: Format,
    /// The unit of the file's lengths, which were converted to millimetres.
    #[serde(serialize_with = "symbol", deserialize_with = "unit")]
    pub unit: Unit,
    /// Whether the file name's extension names another format.
    pub extension_disagrees: bool,
    /// Rows of the mesh's vertex table.
    pub vertices: usize,
    /// Rows that no triangle uses, in the file or after repairs.
    pub unreferenced_vertices: usize,
    /// Faces of the file.
    pub faces: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Triangles of the file, including those that were dropped; a polygon counts as the triangles that it was cut
    /// into.
    pub file_triangles: usize,
    /// Faces with more than three corners, cut into triangles.
    pub polygons_triangulated: usize,
    /// Faces among these that touch or cross themselves in their plane, or have no area: cut into a fan.
    pub polygons_not_simple: usize,
    /// Vertices merged into another one.
    pub welded: usize,
    /// Vertices that coincide with another one but were not welded, because the file is indexed.
    pub coincident: usize,
    /// Degenerate triangles (and faces of fewer than three corners) that were dropped.
    pub dropped_degenerate: usize,
    /// Triangles dropped because an earlier one has the same three vertices.
    pub dropped_duplicates: usize,
    /// Triangles of each connected component, largest first; with `largest_component` only the first is in the mesh.
    pub components: Vec<usize>,
    /// Edges of exactly one triangle: the surface is open there.
    pub border_edges: usize,
    /// Edges of three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles run along them in the same direction, so that their normals disagree.
    pub inconsistent_edges: usize,
    /// The surface's largest extent along an axis, in mm.
    pub extent: f64,
    /// The point of the file (mm) that the mesh's positions are relative to.
    pub origin: [f64; 3],
    /// Whether the reader chose that point, because f32 cannot represent the shape so far from the file's origin.
    pub recentred: bool,
    /// Largest distance of the file's surface from the mesh (mm): caused by rounding vertices to f32 (0 for files that
    /// hold f32), by welding, and by dropping triangles too thin for f32. The tree adds it to the error of every
    /// answer.
    pub position_error: f64,
    /// Elements of the file that were left out or interpreted, one sentence each; they are warnings as well.
    pub remarks: Vec<String>,
}

fn symbol<S: Serializer>(unit: &Unit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.symbol())
}

fn unit<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Unit, D::Error> {
    let symbol = String::deserialize(deserializer)?;
    let unit = Unit::ALL.into_iter().find(|unit| unit.symbol() == symbol);
    unit.ok_or_else(|| D::Error::custom(format_args!("'{symbol}' is no unit")))
}

impl Report {
    /// Warnings for a user: one sentence for each repair and each oddity.
    pub fn warnings(&self) -> impl Iterator<Item = String> + use<> {
        let mut warnings = self.remarks.clone();
        let mut warn = |count: usize, one: &str, several: &str| match count {
            0 => (),
            1 => warnings.push(format!("1 {one}")),
            count => warnings.push(format!("{count} {several}")),
        };
        warn(
            self.polygons_not_simple,
            "polygon touches or crosses itself or has no area; cut as a fan",
            "polygons touch or cross themselves or have no area; cut as fans",
        );
        warn(
            self.coincident,
            "vertex coincides with another and was left apart; --weld 0 joins it",
            "vertices coincide with another and were left apart; --weld 0 joins them",
        );
        warn(
            self.dropped_degenerate,
            "degenerate triangle dropped",
            "degenerate triangles dropped",
        );
        warn(self.dropped_duplicates, "duplicate triangle dropped", "duplicate triangles dropped");
        let others = self.components.get(1..).unwrap_or_default();
        let triangles: usize = others.iter().sum();
        let is_kept = self.components.first() != Some(&self.triangles);
        let fate = if is_kept { "kept: each has a root of its own" } else { "dropped" };
        let fate = format!("{fate}, {}", counted(triangles, "triangle"));
        warn(others.len(), &format!("smaller surface {fate}"), &format!("smaller surfaces {fate}"));
        warn(
            self.unreferenced_vertices - self.welded_rows(),
            "vertex belongs to no triangle",
            "vertices belong to no triangle",
        );
        warn(self.border_edges, "open border edge", "open border edges");
        warn(
            self.non_manifold_edges,
            "edge of more than two triangles",
            "edges of more than two triangles",
        );
        warn(
            self.inconsistent_edges,
            "edge between triangles of opposite orientation",
            "edges between triangles of opposite orientation",
        );
        if self.recentred {
            let [x, y, z] = self.origin;
            warnings.push(format!(
                "so far from the origin f32 would lose digits, so coordinates count from {x},{y},{z} mm: on the \
                 controller those of tools and frames do too"
            ));
        }
        if self.extension_disagrees {
            warnings.insert(0, format!("read as {}, not as its extension says", self.format));
        }
        warnings.into_iter()
    }

    /// Rows of the vertex table that no triangle uses because their vertex was welded to another.
    fn welded_rows(&self) -> usize {
        match self.format {
            // Welded rows of these formats were removed.
            Format::StlAscii | Format::StlBinary => 0,
            _ => self.welded.min(self.unreferenced_vertices),
        }
    }
}

/// A count and a noun whose plural ends in "s".
fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let surface_vertices = self.vertices - self.unreferenced_vertices;
        let triangles = counted(self.triangles, "triangle");
        write!(f, "{}: {surface_vertices} vertices, {triangles}", self.format)?;
        if self.polygons_triangulated > 0 {
            write!(f, ", {} triangulated", counted(self.polygons_triangulated, "polygon"))?;
        }
        if self.welded > 0 {
            let vertices = if self.welded == 1 { "vertex" } else { "vertices" };
            write!(f, ", {} {vertices} welded to others", self.welded)?;
        }
        Ok(())
    }
}
