//! VTK's legacy format, text or binary: polygons and strips of PolyData, and the flat cells of an unstructured grid.
//!
//! Our own reader, although `vtkio` exists: that is a release candidate that panics on files which VTK's own writers
//! make (compressed XML), knows no raw appended data, and reports no line; with one of the two formats our own, the
//! other shares most of it.

use super::cursor::Cursor;
use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::{Format, ReadErrorKind, vtk_data};

type Result<T> = std::result::Result<T, ReadErrorKind>;

pub(super) fn read(bytes: &[u8], groups: bool) -> Result<Raw> {
    let mut file = Cursor::new(bytes, Format::Vtk);
    let version = file.line();
    let version = version.rsplit(' ').next().and_then(|v| v.split('.').next());
    let has_offsets =
        version.and_then(|major| major.parse().ok()).is_some_and(|major: u32| major >= 5);
    let _title = file.line();
    match file.needed("'ASCII' or 'BINARY'")? {
        "ASCII" => {}
        "BINARY" => file.binary = Some(Endian::Big),
        other => {
            return Err(file.malformed(format!("'{}' is neither ASCII nor BINARY", excerpt(other))));
        }
    }
    let mut raw = Raw::new(0);
    let (mut cells, mut types) = (Vec::new(), Vec::new());
    // A file may have these in any order; its cells' values count lines, polygons and bands in this one.
    let (mut lines, mut polygons, mut bands) = (0, Vec::new(), Vec::new());
    let mut labels = None;
    while let Some(keyword) = file.word() {
        match keyword {
            "DATASET" => {
                let kind = file.needed("kind of data")?;
                if !matches!(kind, "POLYDATA" | "UNSTRUCTURED_GRID") {
                    return Err(not_a_surface(kind));
                }
            }
            "POINTS" => {
                let count = file.text_index()?;
                let scalar = scalar(&mut file)?;
                let numbers = file.numbers(count.saturating_mul(3), scalar, "coordinates")?;
                raw.positions.extend(numbers.as_chunks::<3>().0);
            }
            "POLYGONS" => polygons = read_cells(&mut file, has_offsets)?,
            "TRIANGLE_STRIPS" => bands = read_cells(&mut file, has_offsets)?,
            "VERTICES" | "LINES" => lines += read_cells(&mut file, has_offsets)?.len(),
            "CELLS" => cells = read_cells(&mut file, has_offsets)?,
            "CELL_TYPES" => {
                let count = file.text_index()?;
                file.line();
                types = file.numbers(count, Scalar::I32, "cell types")?;
            }
            // Ends with an empty line.
            "METADATA" => skip_metadata(&mut file),
            "FIELD" => drop(field(&mut file, |_| false)?),
            // Values at points and cells, after the surface.
            "POINT_DATA" | "CELL_DATA" if groups => {
                labels = vtk_data::labels(&mut file, keyword)?;
                break;
            }
            "POINT_DATA" | "CELL_DATA" => break,
            other => return Err(file.malformed(format!("'{}' was not expected", excerpt(other)))),
        }
    }
    if cells.len() != types.len() {
        let (cells, types) = (cells.len(), types.len());
        return Err(file.malformed(format!("{cells} cells and {types} cell types")));
    }
    let mut labelled = Labelled { raw, labels, cell: 0 };
    labelled.skip(lines);
    labelled.faces(&polygons);
    labelled.strips(&bands);
    for (cell, kind) in cells.into_iter().zip(types) {
        match kind as u32 {
            // Points and lines.
            0..=4 => labelled.skip(1),
            // Triangle, polygon, quad.
            5 | 7 | 9 => labelled.faces(&[cell]),
            6 => labelled.strips(&[cell]),
            _ => return Err(not_a_surface("UNSTRUCTURED_GRID")),
        }
    }
    labelled.end().map_err(|what| file.malformed(what))
}

pub(super) fn not_a_surface(kind: &str) -> ReadErrorKind {
    ReadErrorKind::Foreign {
        what: format!("VTK data of the kind {}, which is no surface", excerpt(kind)),
        remedy: "save it as PolyData: in ParaView, the filter Extract Surface and then Save Data"
            .to_owned(),
    }
}

/// The type of numbers that ends a line.
pub(super) fn scalar(file: &mut Cursor<'_>) -> Result<Scalar> {
    let name = file.needed("type of numbers")?;
    let scalar = scalar_named(name, file)?;
    file.line();
    Ok(scalar)
}

pub(super) fn scalar_named(name: &str, file: &Cursor<'_>) -> Result<Scalar> {
    Ok(match name.to_ascii_lowercase().as_str() {
        "char" | "signed_char" | "vtktypeint8" => Scalar::I8,
        "unsigned_char" | "vtktypeuint8" => Scalar::U8,
        "short" | "vtktypeint16" => Scalar::I16,
        "unsigned_short" | "vtktypeuint16" => Scalar::U16,
        "int" | "vtktypeint32" => Scalar::I32,
        "unsigned_int" | "vtktypeuint32" => Scalar::U32,
        "long" | "vtkidtype" | "vtktypeint64" => Scalar::I64,
        "unsigned_long" | "vtktypeuint64" => Scalar::U64,
        "float" | "vtktypefloat32" => Scalar::F32,
        "double" | "vtktypefloat64" => Scalar::F64,
        _ => return Err(file.malformed(format!("'{}' is no type of numbers", excerpt(name)))),
    })
}

/// The points of each cell.
fn read_cells(file: &mut Cursor<'_>, has_offsets: bool) -> Result<Vec<Vec<u32>>> {
    let (first, second) = (file.text_index()?, file.text_index()?);
    file.line();
    if has_offsets {
        let mut array = |name: &str, count| {
            let word = file.needed(name)?;
            if word != name {
                return Err(file.malformed(format!("'{}' instead of {name}", excerpt(word))));
            }
            let scalar = scalar(file)?;
            let numbers = file.numbers(count, scalar, "numbers of points")?;
            numbers.into_iter().map(|number| file.whole(number)).collect::<Result<Vec<u64>>>()
        };
        let offsets = array("OFFSETS", first)?;
        let points = array("CONNECTIVITY", second)?;
        return split(&offsets, &points).map_err(|what| file.malformed(what));
    }
    // A count and as many points, for each cell.
    let numbers = file.numbers(second, Scalar::I32, "numbers of points")?;
    let numbers = numbers.into_iter().map(|number| file.whole(number));
    let numbers = numbers.collect::<Result<Vec<u64>>>()?;
    let (mut rest, mut cells) = (&numbers[..], Vec::new());
    while let Some((&count, after)) = rest.split_first() {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let Some((cell, after)) = after.split_at_checked(count) else {
            return Err(
                file.malformed(format!("a cell of {count} points, of which some are missing"))
            );
        };
        cells.push(cell.iter().map(|&point| clamped(point)).collect());
        rest = after;
    }
    Ok(cells)
}

/// Cuts a list of points where each cell ends. The first offset may be the start of the first cell.
pub(super) fn split(offsets: &[u64], points: &[u64]) -> std::result::Result<Vec<Vec<u32>>, String> {
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

/// A point's number; one that no u32 holds is as wrong as the largest that it does.
fn clamped(point: u64) -> u32 {
    u32::try_from(point).unwrap_or(u32::MAX)
}

/// Faces, with a label for each cell where there are labels.
pub(super) struct Labelled {
    pub raw: Raw,
    /// One for each cell.
    pub labels: Option<Vec<f64>>,
    /// Cells so far.
    pub cell: usize,
}

impl Labelled {
    /// Cells that are no surface.
    pub fn skip(&mut self, cells: usize) {
        self.cell += cells;
    }

    pub fn faces(&mut self, cells: &[Vec<u32>]) {
        for cell in cells {
            self.raw.corners.extend(cell);
            self.end_face();
            self.cell += 1;
        }
    }

    /// Strips of triangles: every second one is wound the other way.
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

    fn end_face(&mut self) {
        self.raw.end_face();
        if let Some(labels) = &self.labels {
            let label = labels.get(self.cell).copied().unwrap_or(f64::NAN);
            let groups = self.raw.groups.get_or_insert_default();
            // Faces of an earlier piece may have none.
            groups.of_face.resize(self.raw.ends.len() - 1, f64::NAN);
            groups.of_face.push(label);
        }
    }

    /// The faces, if there is a label for each cell.
    pub fn end(self) -> std::result::Result<Raw, String> {
        match self.labels {
            Some(labels) if labels.len() != self.cell => {
                Err(format!("{} labels for {} cells", labels.len(), self.cell))
            }
            _ => Ok(self.raw),
        }
    }
}

/// Ends with an empty line.
pub(super) fn skip_metadata(file: &mut Cursor<'_>) {
    file.line();
    while !file.line().is_empty() {}
}

/// A field's arrays: returns the last whose name is wanted.
pub(super) fn field(
    file: &mut Cursor<'_>,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<Option<Vec<f64>>> {
    let _name = file.needed("name of a field")?;
    let mut found = None;
    for _ in 0..file.text_index()? {
        let mut name = file.needed("name of an array")?;
        // Information about the array before.
        if name == "METADATA" {
            skip_metadata(file);
            name = file.needed("name of an array")?;
        }
        let (components, count) = (file.text_index()?, file.text_index()?);
        let scalar = scalar(file)?;
        let values = file.numbers(components.saturating_mul(count), scalar, "values of a field")?;
        if components == 1 && is_wanted(name) {
            found = Some(values);
        }
    }
    Ok(found)
}
