//! Data at points and cells in VTK's legacy format, of which cell labels are kept.

use super::ReadErrorKind;
use super::cursor::Cursor;
use super::groups::is_name;
use super::raw::excerpt;
use super::scalar::Scalar;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// The array of cell labels, from the keyword `POINT_DATA` or `CELL_DATA` on.
pub(super) fn labels(file: &mut Cursor<'_>, keyword: &str) -> Result<Option<Vec<f64>>> {
    let mut is_cells = keyword == "CELL_DATA";
    let mut count = file.text_index()?;
    let mut labels = None;
    while let Some(keyword) = file.keyword() {
        match keyword.as_str() {
            keyword @ ("POINT_DATA" | "CELL_DATA") => {
                (is_cells, count) = (keyword == "CELL_DATA", file.text_index()?);
            }
            "METADATA" => skip_metadata(file),
            "FIELD" => labels = field(file, |name| is_cells && is_name(name))?.or(labels),
            "SCALARS" => {
                let name = file.needed("name of an array")?;
                labels = scalars(file, count, is_cells && is_name(name))?.or(labels);
            }
            "VECTORS" | "NORMALS" => skip(file, count, 3)?,
            "TENSORS" => skip(file, count, 9)?,
            "TENSORS6" => skip(file, count, 6)?,
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => skip(file, count, 1)?,
            "TEXTURE_COORDINATES" => {
                let _name = file.needed("name of an array")?;
                let components = file.text_index()?;
                let kind = file.line();
                values(file, count, components, &kind, false)?;
            }
            // Colours are bytes in a binary file, and numbers from 0 to 1 in text.
            "COLOR_SCALARS" => {
                let _name = file.needed("name of an array")?;
                let components = file.text_index()?;
                file.line();
                values(file, count, components, "unsigned_char", false)?;
            }
            "LOOKUP_TABLE" => {
                let _name = file.needed("name of a table")?;
                let colours = file.text_index()?;
                file.line();
                values(file, colours, 4, "unsigned_char", false)?;
            }
            other => return Err(file.malformed(format!("'{}' was not expected", excerpt(other)))),
        }
    }
    Ok(labels)
}

/// The values of `SCALARS` after its name, if they are wanted and there is one for each cell.
fn scalars(file: &mut Cursor<'_>, count: u64, is_wanted: bool) -> Result<Option<Vec<f64>>> {
    let line = file.line();
    let mut words = line.split_whitespace();
    let kind = words.next().unwrap_or_default();
    let components = words.next().map_or(Ok(1), str::parse);
    let components: u64 = components
        .map_err(|_| file.malformed(format!("'{}' ends in no number", excerpt(&line))))?;
    // The line LOOKUP_TABLE may be missing.
    let before = file.clone();
    if file.keyword().as_deref() == Some("LOOKUP_TABLE") {
        file.line();
    } else {
        *file = before;
    }
    values(file, count, components, kind, is_wanted && components == 1)
}

fn skip(file: &mut Cursor<'_>, count: u64, components: u64) -> Result<()> {
    let _name = file.needed("name of an array")?;
    let kind = file.line();
    values(file, count, components, &kind, false).map(drop)
}

/// Skips values of a type, from the start of their line on. Returns them if they are wanted and are numbers: VTK also
/// has arrays of bits and strings.
fn values(
    file: &mut Cursor<'_>,
    count: u64,
    components: u64,
    kind: &str,
    is_wanted: bool,
) -> Result<Option<Vec<f64>>> {
    let count = count.saturating_mul(components);
    if let Some(scalar) = scalar_named(kind) {
        return file.numbers_or_words(count, scalar, is_wanted);
    }
    match kind.to_ascii_lowercase().as_str() {
        "bit" if file.binary.is_none() => file.numbers_or_words(count, Scalar::U8, is_wanted),
        "bit" => {
            let bytes = file.skip(usize::try_from(count.div_ceil(8)).unwrap_or(usize::MAX))?;
            let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1));
            Ok(is_wanted.then(|| bits.take(count as usize).map(f64::from).collect()))
        }
        "string" | "utf8_string" | "variant" => {
            for _ in 0..file.check_room(count, 1, "texts")? {
                if file.binary.is_none() || kind.eq_ignore_ascii_case("variant") {
                    file.line();
                } else {
                    skip_text(file)?;
                }
            }
            Ok(None)
        }
        _ => Err(file.malformed(format!("'{}' is no type of values", excerpt(kind)))),
    }
}

/// Skips a string in a binary file: the top bits of its first byte state how many bytes its length takes.
fn skip_text(file: &mut Cursor<'_>) -> Result<()> {
    let &[first] = file.skip(1)? else { return Ok(()) };
    let more = match first >> 6 {
        3 => 0,
        2 => 1,
        1 => 3,
        _ => 7,
    };
    let start = usize::from(first & 0x3f);
    let length = file.skip(more)?.iter().fold(start, |n, &byte| n << 8 | usize::from(byte));
    file.skip(length).map(drop)
}

/// The type of this name. In a binary file `vtkIdType` has 32 bits, whatever its size in memory.
pub(super) fn scalar_named(name: &str) -> Option<Scalar> {
    Some(match name.to_ascii_lowercase().as_str() {
        "char" | "signed_char" | "vtktypeint8" => Scalar::I8,
        "unsigned_char" | "vtktypeuint8" => Scalar::U8,
        "short" | "vtktypeint16" => Scalar::I16,
        "unsigned_short" | "vtktypeuint16" => Scalar::U16,
        "int" | "vtktypeint32" | "vtkidtype" => Scalar::I32,
        "unsigned_int" | "vtktypeuint32" => Scalar::U32,
        "long" | "long_long" | "vtktypeint64" => Scalar::I64,
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Scalar::U64,
        "float" | "vtktypefloat32" => Scalar::F32,
        "double" | "vtktypefloat64" => Scalar::F64,
        _ => return None,
    })
}

/// Metadata end with an empty line.
pub(super) fn skip_metadata(file: &mut Cursor<'_>) {
    file.line();
    while !file.line().is_empty() {}
}

/// Reads a field's arrays; returns the last one whose name is wanted.
pub(super) fn field(
    file: &mut Cursor<'_>,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<Option<Vec<f64>>> {
    let _name = file.needed("name of a field")?;
    let mut found = None;
    for _ in 0..file.text_index()? {
        let mut name = file.needed("name of an array")?;
        // Metadata of the previous array.
        if name.eq_ignore_ascii_case("METADATA") {
            skip_metadata(file);
            name = file.needed("name of an array")?;
        }
        // A placeholder for no array.
        if name == "NULL_ARRAY" {
            continue;
        }
        let (components, count) = (file.text_index()?, file.text_index()?);
        let kind = file.line();
        let array = values(file, count, components, &kind, components == 1 && is_wanted(name))?;
        found = array.or(found);
    }
    Ok(found)
}
