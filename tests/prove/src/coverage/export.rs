//! What `llvm-cov export` writes: counts of regions, and of the two outcomes of conditions.

// Requirement: E-06

use std::collections::BTreeMap;

use serde::Deserialize;

#[derive(Deserialize)]
pub struct Export {
    pub data: Vec<Data>,
}

#[derive(Deserialize)]
pub struct Data {
    pub files: Vec<File>,
}

#[derive(Deserialize)]
pub struct File {
    pub filename: String,
    segments: Vec<Segment>,
    branches: Vec<[u64; 9]>,
}

/// A place from which on another count holds: line, column, count, whether there is a count, whether a region begins,
/// and whether it is only a gap between regions.
type Segment = (u32, u32, u64, bool, bool, bool);

fn begins(&(.., has_count, is_entry, is_gap): &Segment) -> bool {
    has_count && is_entry && !is_gap
}

/// Line, column, last line and last column of a condition.
pub type Place = [u32; 4];

impl File {
    /// The lines with code, each with how often it was executed: a line counts as its most executed part.
    fn lines(&self) -> BTreeMap<u32, u64> {
        let mut of_line: BTreeMap<u32, Vec<Segment>> = BTreeMap::new();
        for &segment in &self.segments {
            of_line.entry(segment.0).or_default().push(segment);
        }
        let (Some(&first), Some(&last)) = (of_line.keys().next(), of_line.keys().last()) else {
            return BTreeMap::new();
        };
        let mut lines = BTreeMap::new();
        // The segment that holds where a line begins.
        let mut before: Option<Segment> = None;
        for line in first..=last {
            let here = of_line.get(&line).map(Vec::as_slice).unwrap_or_default();
            let begun = here.iter().filter(|segment| begins(segment)).map(|segment| segment.2);
            let held = before.filter(|segment| segment.3).map(|segment| segment.2);
            let is_skipped = here.first().is_some_and(|segment| !segment.3 && segment.4);
            if let Some(count) = begun.chain(held).max()
                && !is_skipped
            {
                lines.insert(line, count);
            }
            before = here.last().copied().or(before);
        }
        lines
    }
}

/// What several programs counted in a file.
#[derive(Default)]
pub struct Counts {
    pub lines: BTreeMap<u32, u64>,
    /// By line and column.
    pub regions: BTreeMap<(u32, u32), u64>,
    /// How often each condition was true and false.
    pub branches: BTreeMap<Place, [u64; 2]>,
}

impl Counts {
    /// Adds what a program counted, in all instances of the file's functions.
    pub fn add(&mut self, file: &File) {
        for (line, count) in file.lines() {
            *self.lines.entry(line).or_default() += count;
        }
        for segment in file.segments.iter().filter(|segment| begins(segment)) {
            *self.regions.entry((segment.0, segment.1)).or_default() += segment.2;
        }
        for &[line, column, last_line, last_column, is_true, is_false, ..] in &file.branches {
            let place = [line, column, last_line, last_column].map(|number| number as u32);
            let sum = self.branches.entry(place).or_default();
            sum[0] += is_true;
            sum[1] += is_false;
        }
    }
}
