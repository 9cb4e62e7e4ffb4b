//! STL, ASCII and binary: soups of triangles.
//!
//! Our own reader, because `stl_io` takes a file for ASCII by the word "solid" alone, trusts the triangle count, stops
//! after the first solid, knows keywords in lower case only, rejects normals that are not finite (which are not used
//! here) and reports no line. Tests compare the two.

use super::raw::{Raw, excerpt, lines, position};
use super::{Format, ReadErrorKind};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// The number of triangles that a binary file claims, and how many whole records follow.
fn counts(bytes: &[u8]) -> Option<(u64, u64)> {
    let claimed = bytes.get(80..HEADER)?.try_into().ok().map(u32::from_le_bytes)?;
    Some((u64::from(claimed), ((bytes.len() - HEADER) / RECORD) as u64))
}

/// Whether this is certainly binary STL: its length is exactly that of its triangle count.
pub(super) fn size_fits_count(bytes: &[u8]) -> bool {
    counts(bytes).is_some_and(|(claimed, found)| {
        claimed == found && (bytes.len() - HEADER).is_multiple_of(RECORD)
    })
}

/// A count that contradicts the size is an error: if it is too large, the file was cut off; if it is too small (never
/// filled in, or data appended), the surface is ambiguous. A few bytes after the last triangle are ignored.
pub(super) fn read_binary(bytes: &[u8]) -> Result<Raw, ReadErrorKind> {
    let Some((claimed, found)) = counts(bytes) else {
        return Err(ReadErrorKind::Truncated {
            format: Format::StlBinary,
            missing: format!("{} bytes are less than the {HEADER} of its header", bytes.len()),
        });
    };
    if claimed != found {
        return Err(ReadErrorKind::Count {
            element: "triangles".to_owned(),
            claimed,
            found,
            at_most: false,
        });
    }
    let mut raw = Raw::new(0);
    for record in bytes[HEADER..].chunks_exact(RECORD) {
        // Normal (12 bytes), three corners, attribute (2 bytes).
        let (coordinates, _) = record[12..48].as_chunks::<4>();
        let (corners, _) = coordinates.as_chunks::<3>();
        for corner in corners {
            push_corner(&mut raw, corner.map(|c| f64::from(f32::from_le_bytes(c))))?;
        }
        raw.end_face();
    }
    Ok(raw)
}

/// Reads any number of solids, in upper or lower case. A missing end of a solid means that the file was cut off.
pub(super) fn read_ascii(bytes: &[u8]) -> Result<Raw, ReadErrorKind> {
    let format = Format::StlAscii;
    let mut raw = Raw::new(0);
    let mut in_facet = false;
    let mut in_solid = false;
    for (number, line) in lines(bytes) {
        let malformed = |what| ReadErrorKind::Malformed { format, line: Some(number), what };
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        match (word.to_ascii_lowercase().as_str(), in_facet) {
            ("solid", false) => in_solid = true,
            ("endsolid", false) => in_solid = false,
            ("facet", false) if in_solid => in_facet = true,
            ("outer" | "endloop", true) => {}
            ("vertex", true) => {
                let corner = position(&mut words, format, number)?;
                let finite = corner.iter().all(|c| c.is_finite());
                if finite && words.next().is_some() {
                    return Err(malformed("a vertex has more than three coordinates".to_owned()));
                }
                push_corner(&mut raw, corner)?;
            }
            ("endfacet", true) => {
                raw.end_face();
                in_facet = false;
                if raw.corners.len() != 3 * raw.ends.len() {
                    return Err(malformed("a facet without exactly three vertices".to_owned()));
                }
            }
            _ => return Err(malformed(format!("'{}' was not expected", excerpt(&line)))),
        }
    }
    if in_solid {
        let missing = if in_facet { "endfacet" } else { "endsolid" };
        return Err(ReadErrorKind::Truncated { format, missing: format!("no '{missing}'") });
    }
    Ok(raw)
}

fn push_corner(raw: &mut Raw, position: [f64; 3]) -> Result<(), ReadErrorKind> {
    let row = raw.positions.len();
    raw.corners.push(u32::try_from(row).map_err(|_| raw.bad_index(row as i64))?);
    raw.positions.push(position);
    Ok(())
}
