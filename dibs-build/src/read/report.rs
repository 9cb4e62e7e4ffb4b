//! What reading a mesh found and did.

use serde::Serialize;
use std::fmt;

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
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
}

impl Format {
    /// The usual file name extension, in lower case.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::StlAscii | Self::StlBinary => "stl",
            Self::Ply => "ply",
            Self::Off => "off",
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
        })
    }
}

/// Counts of what was read, welded, dropped and found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// The format that the content has.
    pub format: Format,
    /// Whether the file name's extension says otherwise.
    pub extension_disagrees: bool,
    /// Rows of the mesh's vertex table.
    pub vertices: usize,
    /// Rows that no triangle uses: never used in the file, or not any more.
    pub unreferenced_vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Faces with more than three corners, cut into triangles.
    pub polygons_triangulated: usize,
    /// Of these, those that touch or cross themselves in their own plane, or have no area:
    /// cut into a plain fan.
    pub polygons_not_simple: usize,
    /// Vertices merged into another one.
    pub welded: usize,
    /// Vertices that coincide with another one but were left apart, because the file is indexed.
    pub coincident: usize,
    /// Degenerate triangles (and faces of fewer than three corners) that were dropped.
    pub dropped_degenerate: usize,
    /// Triangles dropped because an earlier one has the same three vertices.
    pub dropped_duplicates: usize,
    /// Triangles of each connected component, largest first; only the first is in the mesh.
    pub components: Vec<usize>,
    /// Edges of exactly one triangle: the surface is open there.
    pub border_edges: usize,
    /// Edges of three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles run the same way along them, so that their normals disagree.
    pub inconsistent_edges: usize,
}

impl Report {
    /// What a user should know: one sentence for each thing that was changed or is unusual.
    pub fn warnings(&self) -> impl Iterator<Item = String> + use<> {
        let dropped_components = self.components.get(1..).unwrap_or_default();
        [
            (
                self.extension_disagrees,
                format!("read as {}, not as its extension says", self.format),
            ),
            (
                self.polygons_not_simple > 0,
                format!(
                    "{} polygons touch or cross themselves or have no area; cut as fans",
                    self.polygons_not_simple
                ),
            ),
            (
                self.coincident > 0,
                format!("{} vertices coincide with another and were left apart", self.coincident),
            ),
            (
                self.dropped_degenerate > 0,
                format!("{} degenerate triangles dropped", self.dropped_degenerate),
            ),
            (
                self.dropped_duplicates > 0,
                format!("{} duplicate triangles dropped", self.dropped_duplicates),
            ),
            (
                !dropped_components.is_empty(),
                format!(
                    "{} smaller surfaces dropped, {} triangles",
                    dropped_components.len(),
                    dropped_components.iter().sum::<usize>()
                ),
            ),
            (
                self.unreferenced_vertices > 0,
                format!("{} vertices belong to no triangle", self.unreferenced_vertices),
            ),
            (self.border_edges > 0, format!("{} open border edges", self.border_edges)),
            (
                self.non_manifold_edges > 0,
                format!("{} edges of more than two triangles", self.non_manifold_edges),
            ),
            (
                self.inconsistent_edges > 0,
                format!(
                    "{} edges between triangles of opposite orientation",
                    self.inconsistent_edges
                ),
            ),
        ]
        .into_iter()
        .filter_map(|(applies, sentence)| applies.then_some(sentence))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let surface_vertices = self.vertices - self.unreferenced_vertices;
        write!(f, "{}: {surface_vertices} vertices, {} triangles", self.format, self.triangles)?;
        if self.polygons_triangulated > 0 {
            write!(f, ", {} polygons triangulated", self.polygons_triangulated)?;
        }
        if self.welded > 0 {
            write!(f, ", {} vertices welded", self.welded)?;
        }
        Ok(())
    }
}
