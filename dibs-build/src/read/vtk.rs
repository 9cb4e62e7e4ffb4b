//! VTK's legacy format, text or binary: polygons and strips of PolyData, and the cells of an unstructured grid.
//!
//! Our own reader, although `vtkio` exists: it is a release candidate that panics on files of VTK's own writers
//! (compressed XML), does not read raw appended data, and reports no line. With our own reader for one of the two
//! formats, the other shares most of it.

use super::cursor::Cursor;
use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::vtk_cells::{LabelledFaces, clamped, not_a_surface, split};
use super::vtk_data::{self, field, skip_metadata};
use super::{Format, ReadErrorKind, ReadTarget};

type Result<T> = std::result::Result<T, ReadErrorKind>;

pub(super) fn read(bytes: &[u8], wanted: ReadTarget) -> Result<Raw> {
    let mut file = Cursor::new(bytes, Format::Vtk);
    let version = file.line();
    if !version.to_ascii_lowercase().starts_with("# vtk datafile") {
        return Err(file.malformed("no '# vtk DataFile Version' in its first line".to_owned()));
    }
    let version = version.rsplit(' ').next().and_then(|v| v.split('.').next());
    let has_offsets =
        version.and_then(|major| major.parse().ok()).is_some_and(|major: u32| major >= 5);
    let _title = file.line();
    let encoding = file.needed("'ASCII' or 'BINARY'")?;
    match encoding.to_ascii_uppercase().as_str() {
        "ASCII" => {}
        "BINARY" => file.binary = Some(Endian::Big),
        _ => {
            let what = format!("'{}' is neither ASCII nor BINARY", excerpt(encoding));
            return Err(file.malformed(what));
        }
    }
    let mut raw = Raw::new(0);
    let (mut cells, mut types) = (Vec::new(), Vec::new());
    // A file may have these in any order, but its cell data are in the order lines, polygons, strips.
    let (mut lines, mut polygons, mut bands) = (0, Vec::new(), Vec::new());
    let mut labels = None;
    while let Some(keyword) = file.keyword() {
        match keyword.as_str() {
            "DATASET" => {
                let kind = file.needed("kind of data")?.to_ascii_uppercase();
                if !matches!(kind.as_str(), "POLYDATA" | "UNSTRUCTURED_GRID") {
                    return Err(not_a_surface(&kind, wanted));
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
            // Metadata end with an empty line.
            "METADATA" => skip_metadata(&mut file),
            "FIELD" => drop(field(&mut file, |_| false)?),
            // Data at points and cells follow the surface.
            "POINT_DATA" | "CELL_DATA" if wanted == ReadTarget::Groups => {
                labels = vtk_data::labels(&mut file, &keyword)?;
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
    let malformed = |what| file.malformed(what);
    let mut labelled = LabelledFaces::of(wanted);
    labelled.raw = raw;
    labelled.begin(labels);
    labelled.skip(lines);
    labelled.faces(&polygons);
    labelled.strips(&bands);
    for (cell, kind) in cells.into_iter().zip(types) {
        labelled.grid_cell(file.whole(kind)?, cell, malformed)?;
    }
    labelled.end_piece().map_err(malformed)?;
    labelled.end()
}

/// The type of numbers that ends a line.
fn scalar(file: &mut Cursor<'_>) -> Result<Scalar> {
    let name = file.needed("type of numbers")?;
    let scalar = vtk_data::scalar_named(name);
    file.line();
    scalar.ok_or_else(|| file.malformed(format!("'{}' is no type of numbers", excerpt(name))))
}

/// The points of each cell.
fn read_cells(file: &mut Cursor<'_>, has_offsets: bool) -> Result<Vec<Vec<u32>>> {
    let (first, second) = (file.text_index()?, file.text_index()?);
    file.line();
    if has_offsets {
        let mut array = |name: &str, count| {
            let word = file.needed(name)?;
            if !word.eq_ignore_ascii_case(name) {
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
    // For each cell its number of points, and the points.
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
