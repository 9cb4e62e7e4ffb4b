//! Errors of reading a file: one sentence that names the file, the element and the remedy.

use super::Format;
use crate::Unit;
use dibs_nostd::format::MAX_ROOTS;
use std::path::PathBuf;
use thiserror::Error;

/// A file that is not a valid mesh or motion, and its defect.
#[derive(Debug, Error)]
#[error("{}: {kind}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// The defect.
    pub kind: ReadErrorKind,
}

/// A defect of a file. Faces are counted from 1; vertices are named as the file numbers
/// them: from 1 in OBJ, from 0 elsewhere.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadErrorKind {
    /// The file is not a frame of the tree.
    #[error(transparent)]
    Frame(#[from] crate::FrameError),
    /// The operating system could not read it.
    #[error("cannot be read ({0}); check the path and its permissions")]
    Io(#[from] std::io::Error),
    /// It is empty.
    #[error("the file is empty; export the mesh again")]
    Empty,
    /// Its content is of no known format.
    #[error(
        "neither content nor extension is that of a format that is read (OBJ, STL, PLY, OFF, VTK, glTF, Gmsh, 3MF); convert it to one of them"
    )]
    UnknownFormat,
    /// A known kind of file that cannot be read.
    #[error("this is {what}; {remedy}")]
    Foreign {
        /// The kind of file.
        what: String,
        /// How to convert it to one that can be read.
        remedy: String,
    },
    /// A format whose reader was left out of this program.
    #[error(
        "this is {format}, whose reader was left out: build dibs-build with its feature `formats`, or convert the mesh to PLY"
    )]
    LeftOut {
        /// The format.
        format: Format,
    },
    /// A motion file that is not PC2.
    #[error("not a PC2 file of version 1 with at least one frame; export the motion as PC2")]
    NotPc2,
    /// A motion file of another kind.
    #[error(
        "neither PC2 nor a NumPy array (.npy), nor a series of meshes (heart_%03d.ply); export the motion as one of them"
    )]
    UnknownMotion,
    /// A NumPy archive.
    #[error(
        "an archive (.npz) and not one array; save the frames alone by `numpy.save(name, frames)`"
    )]
    NumPyArchive,
    /// A NumPy array that is not a motion.
    #[error(
        "no motion: {what}; save it by `numpy.save(name, frames)`, of frames x vertices (or nodes) x 3"
    )]
    NumPy {
        /// What is wrong with it.
        what: String,
    },
    /// A NumPy array of something other than real numbers.
    #[error(
        "no motion: numbers of the type '{descr}'; save it by `numpy.save(name, frames.astype('float32'))`"
    )]
    NumPyType {
        /// NumPy's name of the type.
        descr: String,
    },
    /// Two files of a series have one number.
    #[error(
        "has the number of another file of its series; name the series with its digits, as heart_%03d.ply, or remove one"
    )]
    Twice,
    /// A series without a file.
    #[error(
        "no file has this name with a number in the place of %d; give the series as heart_%03d.ply"
    )]
    NoSeries,
    /// A number is missing in a series.
    #[error(
        "missing in its series, which goes on with number {next}; add it, or number the files anew"
    )]
    Gap {
        /// The next number that exists.
        next: u64,
    },
    /// A frame of a series is STL.
    #[error(
        "STL has no vertex numbers, so its vertices are not those of other frames; export the series as PLY"
    )]
    UnnumberedFrame,
    /// A frame of a series has other triangles than the first, or is of other tetrahedra.
    #[error(
        "its triangles or tetrahedra are not those of the series' first file; export every frame of one mesh or volume, with vertices in the same order"
    )]
    OtherTriangles,
    /// It violates its format.
    #[error("not valid {format}{}: {what}; repair it or export the mesh again", at(*.line))]
    Malformed {
        /// The format that it was read as.
        format: Format,
        /// The line, counted from 1, where the format has lines.
        line: Option<usize>,
        /// The text found there.
        what: String,
    },
    /// It ends too early.
    #[error(
        "the {format} data ends early: {missing}; the file was cut off, copy or export it again"
    )]
    Truncated {
        /// The format that it was read as.
        format: Format,
        /// The missing part.
        missing: String,
    },
    /// A count that the file claims contradicts its size.
    #[error(
        "the file claims {claimed} {element}, but has {}{found}; it was cut off or written wrongly, export it again",
        if *.at_most { "room for at most " } else { "" }
    )]
    Count {
        /// The counted element.
        element: String,
        /// The claimed number.
        claimed: u64,
        /// The number in the file.
        found: u64,
        /// Whether `found` is an upper bound taken from the file's size.
        at_most: bool,
    },
    /// It has no surface.
    #[error("no triangles{}{}; export the mesh with its faces", dropped(*.degenerate), others(.remarks))]
    NoTriangles {
        /// Degenerate triangles in it.
        degenerate: usize,
        /// Elements of the file that were left out.
        remarks: Vec<String>,
    },
    /// A face refers to a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {index}, but the file has {vertices} vertices numbered from {first}; export the mesh again"
    )]
    IndexOutOfRange {
        /// The face, counted from 1.
        face: usize,
        /// The vertex number as the file writes it.
        index: i64,
        /// Vertices in the file.
        vertices: usize,
        /// The number of the file's first vertex.
        first: u32,
    },
    /// A face has too many corners to be cut into triangles in reasonable time.
    #[error(
        "face {face} has {corners} corners and at most {most} are accepted; export the mesh as triangles"
    )]
    LargePolygon {
        /// The face, counted from 1.
        face: usize,
        /// Its corners.
        corners: usize,
        /// The most that are accepted.
        most: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error(
        "{vertex} has the coordinate {value}, which is not a finite number; repair it, or export the file again"
    )]
    NonFinite {
        /// The vertex, in the file's own terms.
        vertex: String,
        /// The coordinate.
        value: f64,
    },
    /// A coordinate is a number, but too large for f32.
    #[error(
        "{vertex} has the coordinate {value:e}, which overflows f32; scale the mesh to millimetres"
    )]
    Overflow {
        /// The vertex, in the file's own terms.
        vertex: String,
        /// The coordinate.
        value: f64,
    },
    /// The mesh is so small that products of squared lengths underflow f32.
    #[error(
        "the mesh is only {extent:e} across, where squared lengths underflow f32 (the least is {least:e}); scale it to millimetres"
    )]
    TooSmall {
        /// Diagonal of the bounding box.
        extent: f64,
        /// The smallest extent that is accepted.
        least: f64,
    },
    /// The mesh is so large that products of squared lengths overflow f32.
    #[error(
        "{vertex} has the coordinate {value:e}, where squared lengths overflow f32 (the most is {most:e}); scale the mesh to millimetres"
    )]
    TooLarge {
        /// The vertex, in the file's own terms.
        vertex: String,
        /// The coordinate.
        value: f64,
        /// The largest magnitude that is accepted.
        most: f64,
    },
    /// The surface lies so far from the file's origin that the file's numbers cannot represent its shape.
    #[error(
        "the surface is {extent:e} across and has coordinates up to {largest:e}, where the file's numbers are {resolution:e} apart, so that its shape is lost; export it in double precision, or nearer to the origin"
    )]
    TooFar {
        /// The largest magnitude of a coordinate (mm).
        largest: f64,
        /// Distance between neighbouring numbers of the file of that size.
        resolution: f64,
        /// The surface's largest extent along an axis.
        extent: f64,
    },
    /// The surface lies so far from the given origin that f32 coordinates cannot represent its shape.
    #[error(
        "{what} is {extent:e} across and up to {largest:e} from the origin of the mesh, where f32 numbers are {resolution:e} apart; give a file of the same mesh, or an origin near it"
    )]
    Elsewhere {
        /// The mesh, or a frame.
        what: String,
        /// The largest magnitude of a coordinate (mm), from the origin.
        largest: f64,
        /// Distance between neighbouring f32 numbers of that size.
        resolution: f64,
        /// The surface's largest extent along an axis.
        extent: f64,
    },
    /// The given unit differs from the one that the file states.
    #[error(
        "its lengths are in {}, as {format} files say, and not in {}: leave the unit out (--unit), or export the mesh as PLY, which states none",
        name(*.stated), name(*.given)
    )]
    OtherUnit {
        /// The format.
        format: Format,
        /// The file's unit.
        stated: Unit,
        /// The given one.
        given: Unit,
    },
    /// The given origin is not a point.
    #[error("the origin is {origin}; give three finite numbers")]
    Origin {
        /// The origin given.
        origin: glam::DVec3,
    },
    /// Triangles without area, under `strict`.
    #[error(
        "{count} degenerate triangles, the first in face {face}; repair the mesh, or read it without --strict to drop them"
    )]
    Degenerate {
        /// Their number.
        count: usize,
        /// The face of the first, counted from 1.
        face: usize,
    },
    /// Triangles with the same three vertices as an earlier one, under `strict`.
    #[error(
        "{count} duplicate triangles, the first in face {face}; repair the mesh, or read it without --strict to drop them"
    )]
    Duplicate {
        /// Their number.
        count: usize,
        /// The face of the first, counted from 1.
        face: usize,
    },
    /// More connected components than a tree has roots.
    #[error(
        "{} surfaces that share no vertex ({} triangles), and a tree holds {MAX_ROOTS} at most; keep the largest with --largest-component{}",
        .sizes.len(), list(.sizes), weld_hint(*.coincident)
    )]
    Components {
        /// Triangles of each component, largest first.
        sizes: Vec<usize>,
        /// Vertices that coincide with another one and were not welded.
        coincident: usize,
    },
    /// The file has no groups to make labels of.
    #[error("no groups of triangles: {}; give labels in a file of their own", super::groups::expected(*.format))]
    NoGroups {
        /// The format.
        format: Format,
    },
    /// A face's group is not a number from 0 to 255.
    #[error("face {face} has {}, and labels are whole numbers from 0 to 255; number the groups so", group(*.value))]
    Label {
        /// The face, counted from 1.
        face: usize,
        /// Its group's number; NaN if it has no group.
        value: f64,
    },
    /// More groups than labels.
    #[error(
        "{groups} groups, and there are {most} labels; join some, or give labels in a file of their own"
    )]
    ManyGroups {
        /// Groups in the file.
        groups: usize,
        /// The number of possible labels.
        most: usize,
    },
    /// A file that should hold a volume of tetrahedra holds none, or other cells as well.
    #[error(
        "{format} with {tetrahedra} tetrahedra and {others} other volume cells, where a volume of tetrahedra is needed: \
         give a Gmsh (.msh) or VTK (.vtk, .vtu) file of straight tetrahedra alone, or --nodes lattice:NX,NY,NZ"
    )]
    NoVolume {
        /// The file's format.
        format: Format,
        /// Its tetrahedra.
        tetrahedra: usize,
        /// Its other volume cells.
        others: usize,
    },
    /// A volume that cannot move a surface.
    #[error(transparent)]
    Volume(#[from] crate::nodes::VolumeError),
    /// The weld tolerance is not a length.
    #[error("the weld tolerance is {tolerance}; give a finite length of at least 0")]
    Tolerance {
        /// The tolerance given.
        tolerance: f32,
    },
}

fn name(unit: Unit) -> String {
    format!("{unit:?}s").to_lowercase().replace("inchs", "inches")
}

fn group(value: f64) -> String {
    if value.is_nan() { "no group".to_owned() } else { format!("the group {value}") }
}

fn at(line: Option<usize>) -> String {
    line.map(|line| format!(", line {line}")).unwrap_or_default()
}

fn dropped(degenerate: usize) -> String {
    if degenerate == 0 { String::new() } else { format!(" but {degenerate} degenerate ones") }
}

fn others(remarks: &[String]) -> String {
    if remarks.is_empty() { String::new() } else { format!(" ({})", remarks.join("; ")) }
}

/// The largest few sizes, and the number of others.
fn list(sizes: &[usize]) -> String {
    const SHOWN: usize = 8;
    let mut text = sizes.iter().take(SHOWN).map(usize::to_string).collect::<Vec<_>>().join(", ");
    if sizes.len() > SHOWN {
        text += &format!(" and {} smaller ones", sizes.len() - SHOWN);
    }
    text
}

fn weld_hint(coincident: usize) -> String {
    if coincident == 0 {
        String::new()
    } else {
        format!("; or join them with --weld 0, as {coincident} vertices coincide with another")
    }
}
