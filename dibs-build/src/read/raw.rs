//! A file's vertices and polygons as written; and parsing of lines and numbers in the text formats.

use super::groups::FaceGroups;
use super::{Format, ReadErrorKind};
use crate::Unit;
use std::borrow::Cow;

/// The contents of a file, before the checks that need all of it.
#[derive(Default)]
pub(crate) struct Raw {
    /// In f64: so the rounding to f32 can be measured, and a coordinate too large for f32 differs from an infinite one.
    pub positions: Vec<[f64; 3]>,
    /// The corners of all polygons, one after the other.
    pub corners: Vec<u32>,
    /// End of each polygon in `corners`.
    pub ends: Vec<usize>,
    /// The number that the file gives to its first vertex.
    pub first_vertex: u32,
    /// The group of each polygon, if groups are requested and the file has them.
    pub groups: Option<FaceGroups>,
    /// The unit of its lengths, where the file states it.
    pub unit: Option<Unit>,
    /// Corners of the tetrahedra among the volume cells, and the number of other cells.
    pub tetrahedra: Vec<[u32; 4]>,
    pub other_cells: usize,
    /// Warnings: elements that were left out or interpreted.
    pub remarks: Vec<String>,
}

impl Raw {
    pub fn new(first_vertex: u32) -> Self {
        Self { first_vertex, ..Self::default() }
    }

    /// Adds a warning if `count` is not 0.
    pub fn remark(&mut self, count: usize, one: &str, several: &str) {
        match count {
            0 => (),
            1 => self.remarks.push(format!("1 {one}")),
            count => self.remarks.push(format!("{count} {several}")),
        }
    }

    /// Ends a polygon whose corners were pushed.
    pub fn end_face(&mut self) {
        self.ends.push(self.corners.len());
    }

    /// The error for a face's vertex number out of range.
    pub fn bad_index(&self, index: i64) -> ReadErrorKind {
        ReadErrorKind::IndexOutOfRange {
            face: self.ends.len() + 1,
            index,
            vertices: self.positions.len(),
            first: self.first_vertex,
        }
    }

    /// The position of each corner of each polygon. Corners that refer to no vertex are skipped; another check reports
    /// them.
    pub fn corner_positions(&self) -> impl Iterator<Item = [f64; 3]> {
        self.corners.iter().filter_map(|&corner| self.positions.get(corner as usize).copied())
    }

    pub fn faces(&self) -> impl Iterator<Item = &[u32]> {
        self.ends.iter().scan(0, |start, &end| {
            let face = &self.corners[*start..end];
            *start = end;
            Some(face)
        })
    }
}

/// The lines of a text, counted from 1. Old exporters write names in any encoding, so bytes that
/// are not UTF-8 are replaced instead of rejected.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let bytes = super::text::trimmed(bytes);
    let separator = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    bytes
        .split(move |&byte| byte == separator)
        .map(String::from_utf8_lossy)
        .enumerate()
        .map(|(i, line)| (i + 1, line))
}

/// Parses a coordinate. Its rounding to f32 is the f32 nearest to the text's number.
pub(crate) fn coordinate(token: &str) -> Option<f64> {
    let (narrow, wide) = (token.parse::<f32>().ok()?, token.parse::<f64>().ok()?);
    if narrow.is_finite() {
        // Rounding to f64 and then to f32 could give another f32 if the f64 lies midway between two f32.
        return Some(match f64::from(narrow) {
            _ if wide as f32 == narrow => wide,
            nearest if nearest > wide => wide.next_up(),
            _ => wide.next_down(),
        });
    }
    // "1e400" overflows even f64, and is not "inf".
    let overflow = wide.is_infinite() && token.contains(|c: char| c.is_ascii_digit());
    Some(if overflow { f64::MAX.copysign(wide) } else { wide })
}

/// The next three coordinates of a line.
pub(crate) fn position<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    format: Format,
    line: usize,
) -> Result<[f64; 3], ReadErrorKind> {
    let mut position = [0.0; 3];
    for value in &mut position {
        let what = match words.next() {
            None => "a vertex needs three coordinates".to_owned(),
            Some(word) => match coordinate(word) {
                Some(number) => {
                    *value = number;
                    continue;
                }
                None => format!("'{}' is not a number", excerpt(word)),
            },
        };
        return Err(ReadErrorKind::Malformed { format, line: Some(line), what });
    }
    Ok(position)
}

/// The beginning of a text, short enough for a message.
pub(crate) fn excerpt(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(40).collect()
}
