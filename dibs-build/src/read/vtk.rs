//! VTK's legacy format, text or binary: polygons and strips of PolyData, and the flat cells of an unstructured grid.
//!
//! Our own reader, although `vtkio` exists: that is a release candidate that panics on files which VTK's own writers
//! make (compressed XML), knows no raw appended data, and reports no line; with one of the two formats our own, the
//! other shares most of it.

use super::cursor::Cursor;
use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::{Format, ReadErrorKind};

type Result<T> = std::result::Result<T, ReadErrorKind>;

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
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
            "POLYGONS" => faces(&read_cells(&mut file, has_offsets)?, &mut raw),
            "TRIANGLE_STRIPS" => strips(&read_cells(&mut file, has_offsets)?, &mut raw),
            "VERTICES" | "LINES" => drop(read_cells(&mut file, has_offsets)?),
            "CELLS" => cells = read_cells(&mut file, has_offsets)?,
            "CELL_TYPES" => {
                let count = file.text_index()?;
                file.line();
                types = file.numbers(count, Scalar::I32, "cell types")?;
            }
            // Ends with an empty line.
            "METADATA" => {
                file.line();
                while !file.line().is_empty() {}
            }
            "FIELD" => skip_field(&mut file)?,
            // Values at points and cells, after the surface.
            "POINT_DATA" | "CELL_DATA" => break,
            other => return Err(file.malformed(format!("'{}' was not expected", excerpt(other)))),
        }
    }
    if cells.len() != types.len() {
        let (cells, types) = (cells.len(), types.len());
        return Err(file.malformed(format!("{cells} cells and {types} cell types")));
    }
    for (cell, kind) in cells.into_iter().zip(types) {
        match kind as u32 {
            // Points and lines.
            0..=4 => {}
            // Triangle, polygon, quad.
            5 | 7 | 9 => faces(&[cell], &mut raw),
            6 => strips(&[cell], &mut raw),
            _ => return Err(not_a_surface("UNSTRUCTURED_GRID")),
        }
    }
    Ok(raw)
}

pub(super) fn not_a_surface(kind: &str) -> ReadErrorKind {
    ReadErrorKind::Foreign {
        what: format!("VTK data of the kind {}, which is no surface", excerpt(kind)),
        remedy: "save it as PolyData: in ParaView, the filter Extract Surface and then Save Data"
            .to_owned(),
    }
}

fn scalar(file: &mut Cursor<'_>) -> Result<Scalar> {
    let name = file.needed("type of numbers")?;
    let scalar = match name.to_ascii_lowercase().as_str() {
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
    };
    file.line();
    Ok(scalar)
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

pub(super) fn faces(cells: &[Vec<u32>], raw: &mut Raw) {
    for cell in cells {
        raw.corners.extend(cell);
        raw.end_face();
    }
}

/// Strips of triangles: every second one is wound the other way.
pub(super) fn strips(cells: &[Vec<u32>], raw: &mut Raw) {
    for cell in cells {
        for (number, corners) in cell.windows(3).enumerate() {
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            raw.corners.extend(if number % 2 == 0 { [a, b, c] } else { [b, a, c] });
            raw.end_face();
        }
    }
}

/// Arrays that belong to the file as a whole.
fn skip_field(file: &mut Cursor<'_>) -> Result<()> {
    let _name = file.needed("name of a field")?;
    for _ in 0..file.text_index()? {
        let _name = file.needed("name of an array")?;
        let count = file.text_index()?.saturating_mul(file.text_index()?);
        let scalar = scalar(file)?;
        file.numbers(count, scalar, "values of a field")?;
    }
    Ok(())
}
