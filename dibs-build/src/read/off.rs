//! OFF: a stream of numbers after the word OFF.
//!
//! Our own reader, because `off-rs` accepts one spelling of the header and one colour format that is declared in
//! advance, and real files mix them.

use super::raw::{Raw, excerpt, lines, position};
use super::{Format, ReadErrorKind};

pub(super) fn read(bytes: &[u8]) -> Result<Raw, ReadErrorKind> {
    let mut lines = lines(bytes)
        .map(|(number, line)| {
            let content = line.split('#').next().unwrap_or_default().trim().to_owned();
            (number, content)
        })
        .filter(|(_, line)| !line.is_empty());
    let malformed =
        |line, what| ReadErrorKind::Malformed { format: Format::Off, line: Some(line), what };

    let (number, header) = lines.next().ok_or(ReadErrorKind::Empty)?;
    let (keyword, rest) = header.split_once(char::is_whitespace).unwrap_or((header.as_str(), ""));
    if rest.to_ascii_lowercase().contains("binary") {
        return Err(ReadErrorKind::Foreign {
            what: "a binary OFF".to_owned(),
            remedy: "save it as text, or as PLY".to_owned(),
        });
    }
    if !is_header(keyword) {
        let what = format!("'{}' is no header of an OFF in three dimensions", excerpt(keyword));
        return Err(malformed(number, what));
    }
    // The counts may be on the header's line. Normals, colours and texture coordinates, which prefixes of OFF declare,
    // follow the position on a vertex's line.
    let (number, counts) = match rest.trim() {
        "" => lines.next().ok_or_else(|| truncated("counts"))?,
        rest => (number, rest.to_owned()),
    };
    let mut words = counts.split_whitespace();
    let mut count = || words.next().and_then(|word| word.parse::<u64>().ok());
    let (Some(vertices), Some(faces)) = (count(), count()) else {
        return Err(malformed(number, format!("'{}' are not counts", excerpt(&counts))));
    };

    let mut raw = Raw::new(0);
    for found in 0..vertices {
        let lied = || lied("vertices", vertices, found);
        let (number, line) = lines.next().ok_or_else(lied)?;
        raw.positions.push(position(&mut line.split_whitespace(), Format::Off, number)?);
    }
    for found in 0..faces {
        let (number, line) = lines.next().ok_or_else(|| lied("faces", faces, found))?;
        let mut words = line.split_whitespace();
        let size = words.next().and_then(|word| word.parse::<u64>().ok());
        let Some(size) = size else {
            return Err(malformed(number, format!("'{}' is not a face", excerpt(&line))));
        };
        for _ in 0..size {
            let word = words.next().unwrap_or_default();
            let Ok(index) = word.parse::<i64>() else {
                return Err(malformed(number, format!("a face needs {size} vertex numbers")));
            };
            raw.corners.push(u32::try_from(index).map_err(|_| raw.bad_index(index))?);
        }
        raw.end_face();
    }
    raw.remark(
        lines.count(),
        "line was left out: it follows the faces that the file counts",
        "lines were left out: they follow the faces that the file counts",
    );
    Ok(raw)
}

/// Whether a word begins a file of points in three dimensions: OFF after prefixes for texture, colours and normals. The
/// prefixes `n` and `4` declare other dimensions.
pub(super) fn is_header(word: &str) -> bool {
    let letters = word.strip_suffix("OFF").map_or("STCNstcn", |_| "STCN");
    let prefix = word.len().checked_sub(3).and_then(|end| word.split_at_checked(end));
    prefix.is_some_and(|(prefix, off)| {
        off.eq_ignore_ascii_case("off") && prefix.chars().all(|letter| letters.contains(letter))
    })
}

fn truncated(missing: &str) -> ReadErrorKind {
    ReadErrorKind::Truncated { format: Format::Off, missing: format!("no {missing}") }
}

fn lied(element: &str, claimed: u64, found: u64) -> ReadErrorKind {
    ReadErrorKind::Count { element: element.to_owned(), claimed, found, at_most: true }
}
