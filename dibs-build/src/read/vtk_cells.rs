//! Cells of VTK's formats: faces, strips, and volumes, whose boundary is extracted.

use super::raw::{Raw, excerpt};
use super::volume::{Shape, Volumes};
use super::{ReadErrorKind, ReadTarget};

/// The remedy for curved cells.
const fn flatten(wanted: ReadTarget) -> &'static str {
    match wanted {
        ReadTarget::Volume => {
            "save it with linear tetrahedra: in ParaView, the filter Tetrahedralize and then Save Data"
        }
        _ => {
            "save it with flat cells: in ParaView, the filter Extract Surface, then Triangulate and Save Data"
        }
    }
}

/// Cuts a list of points at each cell's end. The first offset may be the start of the first cell.
pub(super) fn split(offsets: &[u64], points: &[u64]) -> Result<Vec<Vec<u32>>, String> {
    let ends = match offsets {
        [0, ends @ ..] => ends,
        ends => ends,
    };
    let mut start = 0;
    let mut cell = |&end: &u64| {
        let range = start..usize::try_from(end).unwrap_or(usize::MAX);
        start = range.end;
        let cell = points
            .get(range)
            .ok_or_else(|| format!("a cell ends after {end} of {} points", points.len()))?;
        Ok(cell.iter().map(|&point| clamped(point)).collect())
    };
    ends.iter().map(&mut cell).collect()
}

/// A point's number as u32; a number too large for u32 becomes the largest one, which is out of range as well.
pub(super) fn clamped(point: u64) -> u32 {
    u32::try_from(point).unwrap_or(u32::MAX)
}

/// Faces, with a label for each cell if there are labels.
#[derive(Default)]
pub(super) struct LabelledFaces {
    pub raw: Raw,
    pub wanted: ReadTarget,
    /// A label for each cell of the piece.
    labels: Option<Vec<f64>>,
    /// Cells of the piece so far.
    cell: usize,
    /// Points and lines, which are left out.
    others: usize,
    volumes: Volumes,
}

impl LabelledFaces {
    pub fn of(wanted: ReadTarget) -> Self {
        Self { wanted, ..Self::default() }
    }

    /// Begins a piece of the file.
    pub fn begin(&mut self, labels: Option<Vec<f64>>) {
        (self.labels, self.cell) = (labels, 0);
    }

    /// Ends a piece: the number of labels must be that of the cells.
    pub fn end_piece(&self) -> Result<(), String> {
        match &self.labels {
            Some(labels) if labels.len() != self.cell => {
                Err(format!("{} labels for {} cells", labels.len(), self.cell))
            }
            _ => Ok(()),
        }
    }

    #[cfg(feature = "formats")]
    pub fn has_volumes(&self) -> bool {
        !self.volumes.is_empty()
    }

    /// Skips cells that are points and lines.
    pub fn skip(&mut self, cells: usize) {
        self.cell = self.cell.saturating_add(cells);
        self.others = self.others.saturating_add(cells);
    }

    pub fn faces(&mut self, cells: &[Vec<u32>]) {
        for cell in cells {
            self.raw.corners.extend(cell);
            self.end_face();
            self.cell += 1;
        }
    }

    /// Adds strips of triangles: every second triangle is wound the other way.
    pub fn strips(&mut self, cells: &[Vec<u32>]) {
        for cell in cells {
            for (number, corners) in cell.windows(3).enumerate() {
                let [a, b, c] = [corners[0], corners[1], corners[2]];
                self.raw.corners.extend(if number % 2 == 0 { [a, b, c] } else { [b, a, c] });
                self.end_face();
            }
            self.cell += 1;
        }
    }

    /// A cell of an unstructured grid, whose type is VTK's number.
    ///
    /// # Errors
    /// A sentence for a cell with another number of points than its type has; [`ReadErrorKind::Foreign`] for curved
    /// faces and types that are not read.
    pub fn grid_cell(
        &mut self,
        kind: u64,
        mut cell: Vec<u32>,
        malformed: impl Fn(String) -> ReadErrorKind,
    ) -> Result<(), ReadErrorKind> {
        let points = cell.len();
        let wrong = || malformed(format!("a cell of the type {kind} with {points} points"));
        let shape = match kind {
            // Points and lines, also curved ones.
            0..=4 | 21 | 35 | 68 | 75 => {
                self.skip(1);
                return Ok(());
            }
            5 if points != 3 => return Err(wrong()),
            8 | 9 if points != 4 => return Err(wrong()),
            5 | 7..=9 => {
                // In a pixel the third point is not next to the second, but opposite to it.
                if kind == 8 {
                    cell.swap(2, 3);
                }
                self.faces(&[cell]);
                return Ok(());
            }
            6 => {
                self.strips(&[cell]);
                return Ok(());
            }
            10 => Shape::Tetrahedron,
            11 if points == 8 => {
                cell.swap(2, 3);
                cell.swap(6, 7);
                Shape::Hexahedron
            }
            11 | 12 => Shape::Hexahedron,
            13 => Shape::Wedge,
            14 => Shape::Pyramid,
            15 => Shape::PentagonalPrism,
            16 => Shape::HexagonalPrism,
            24..=27 | 29 | 31..=33 | 37 | 71..=74 | 78..=81 => {
                self.volumes.curved += 1;
                self.cell += 1;
                return Ok(());
            }
            _ => {
                let what = match kind {
                    22 | 23 | 28 | 30 | 34 | 36 | 69 | 70 | 76 | 77 => "curved cells",
                    42 => "polyhedra",
                    _ => "cells",
                };
                return Err(ReadErrorKind::Foreign {
                    what: format!("a VTK grid with {what} of the type {kind}, which is not read"),
                    remedy: flatten(self.wanted).to_owned(),
                });
            }
        };
        let label = self.label();
        self.cell += 1;
        if self.volumes.push(shape, &cell, label) { Ok(()) } else { Err(wrong()) }
    }

    fn label(&self) -> f64 {
        let labels = self.labels.as_ref();
        labels.and_then(|labels| labels.get(self.cell)).copied().unwrap_or(f64::NAN)
    }

    fn end_face(&mut self) {
        self.raw.end_face();
        if self.labels.is_some() {
            let label = self.label();
            let groups = self.raw.groups.get_or_insert_default();
            // Faces of an earlier piece may have no labels.
            groups.of_face.resize(self.raw.ends.len() - 1, f64::NAN);
            groups.of_face.push(label);
        }
    }

    /// The faces; if there are none, the boundary of the volumes.
    pub fn end(mut self) -> Result<Raw, ReadErrorKind> {
        let has_labels = self.labels.is_some();
        self.volumes.finish(&mut self.raw, has_labels, flatten(self.wanted))?;
        self.raw.remark(
            self.others,
            "cell was left out: points and lines are no surface",
            "cells were left out: points and lines are no surface",
        );
        Ok(self.raw)
    }
}

pub(super) fn not_a_surface(kind: &str, wanted: ReadTarget) -> ReadErrorKind {
    let names_others = kind.starts_with('P') && kind != "PolyData" && kind.len() > 1
        || ["MultiBlock", "Collection", "Partitioned", "Composite", "AMR"]
            .iter()
            .any(|part| kind.contains(part));
    let (kind, is_upper) = (excerpt(kind), kind.chars().all(|c| !c.is_ascii_lowercase()));
    if names_others && !is_upper {
        return ReadErrorKind::Foreign {
            what: format!("VTK data of the kind {kind}, which names other files"),
            remedy: "give one of these, or save it as one: in ParaView, the filter Merge Blocks and then Save Data"
                .to_owned(),
        };
    }
    let (what, remedy) = match wanted {
        ReadTarget::Volume => ("tetrahedra", flatten(wanted)),
        _ => (
            "surface",
            "save it as PolyData: in ParaView, the filter Extract Surface and then Save Data",
        ),
    };
    ReadErrorKind::Foreign {
        what: format!("VTK data of the kind {kind}, which is no {what}"),
        remedy: remedy.to_owned(),
    }
}
