//! Values at the points and cells of VTK's legacy format, of which the labels of cells are kept.

use super::ReadErrorKind;
use super::cursor::Cursor;
use super::groups::is_name;
use super::raw::excerpt;
use super::scalar::Scalar;
use super::vtk::{field, scalar, scalar_named, skip_metadata};

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// The array of labels of cells, from the keyword `POINT_DATA` or `CELL_DATA` on.
pub(super) fn labels(file: &mut Cursor<'_>, keyword: &str) -> Result<Option<Vec<f64>>> {
    let mut is_cells = keyword == "CELL_DATA";
    let mut count = file.text_index()?;
    let mut labels = None;
    while let Some(keyword) = file.word() {
        match keyword.to_ascii_uppercase().as_str() {
            keyword @ ("POINT_DATA" | "CELL_DATA") => {
                (is_cells, count) = (keyword == "CELL_DATA", file.text_index()?);
            }
            "METADATA" => skip_metadata(file),
            "FIELD" => labels = field(file, |name| is_cells && is_name(name))?.or(labels),
            "SCALARS" => {
                let name = file.needed("name of an array")?;
                let (values, components) = scalars(file, count)?;
                if is_cells && components == 1 && is_name(name) {
                    labels = Some(values);
                }
            }
            "VECTORS" | "NORMALS" => skip(file, count, 3)?,
            "TENSORS" => skip(file, count, 9)?,
            "TENSORS6" => skip(file, count, 6)?,
            "GLOBAL_IDS" | "PEDIGREE_IDS" => skip(file, count, 1)?,
            "TEXTURE_COORDINATES" => {
                let _name = file.needed("name of an array")?;
                let components = file.text_index()?;
                let scalar = scalar(file)?;
                values(file, count, components, scalar)?;
            }
            // Colours are bytes in a binary file, and numbers up to 1 in a text.
            "COLOR_SCALARS" => {
                let _name = file.needed("name of an array")?;
                let components = file.text_index()?;
                file.line();
                values(file, count, components, Scalar::U8)?;
            }
            "LOOKUP_TABLE" => {
                let _name = file.needed("name of a table")?;
                let colours = file.text_index()?;
                file.line();
                values(file, colours, 4, Scalar::U8)?;
            }
            other => return Err(file.malformed(format!("'{}' was not expected", excerpt(other)))),
        }
    }
    Ok(labels)
}

/// The values of `SCALARS`, after their name, and the numbers of each.
fn scalars(file: &mut Cursor<'_>, count: u64) -> Result<(Vec<f64>, u64)> {
    let line = file.line();
    let mut words = line.split_whitespace();
    let scalar = scalar_named(words.next().unwrap_or_default(), file)?;
    let components = words.next().map_or(Ok(1), str::parse);
    let components: u64 = components
        .map_err(|_| file.malformed(format!("'{}' ends in no number", excerpt(&line))))?;
    // This line may be missing.
    let before = file.clone();
    if file.word() == Some("LOOKUP_TABLE") {
        file.line();
    } else {
        *file = before;
    }
    Ok((values(file, count, components, scalar)?, components))
}

fn skip(file: &mut Cursor<'_>, count: u64, components: u64) -> Result<()> {
    let _name = file.needed("name of an array")?;
    let scalar = scalar(file)?;
    values(file, count, components, scalar).map(drop)
}

fn values(file: &mut Cursor<'_>, count: u64, components: u64, scalar: Scalar) -> Result<Vec<f64>> {
    file.numbers(count.saturating_mul(components), scalar, "values")
}
