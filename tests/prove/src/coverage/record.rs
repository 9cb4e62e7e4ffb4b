//! The record of a run: sums of each file, and the places that no test executes.

// Requirement: E-06

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::export::{Counts, Export};
use super::{measure, own_tests};
use crate::harness::run::Run;

#[derive(Serialize, Deserialize)]
pub struct Record {
    pub run: Run,
    pub files: Vec<Sums>,
    pub open: Vec<Open>,
}

/// Executed and all of a file's statements, branches and regions.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Sums {
    pub file: String,
    pub statements: [usize; 2],
    pub branches: [usize; 2],
    pub regions: [usize; 2],
}

/// A statement that no test executes, or a condition that in no test has one of its outcomes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Open {
    /// Below `dibs-nostd/src`.
    pub file: String,
    pub number: u32,
    /// The source line.
    pub line: String,
    /// The function around it.
    pub function: String,
    /// The condition and its outcome; nothing for a statement.
    pub condition: Option<(String, bool)>,
}

impl Record {
    pub fn read(file: &Path) -> Result<Self> {
        let text =
            fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is no record", file.display()))
    }

    pub const fn new(run: Run) -> Self {
        Self { run, files: Vec::new(), open: Vec::new() }
    }

    /// The record of what each program counted.
    pub fn of(run: Run, exports: &[Export]) -> Result<Self> {
        let mut record = Self::new(run);
        let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
        for file in exports.iter().flat_map(|export| &export.data).flat_map(|data| &data.files) {
            counts.entry(&file.filename).or_default().add(file);
        }
        let core = measure::core();
        for (path, counts) in counts {
            let path = Path::new(path);
            let Ok(name) = path.strip_prefix(&core) else { continue };
            if !own_tests::is_test(path)? {
                let source = fs::read_to_string(path)
                    .with_context(|| format!("cannot read {}", path.display()))?;
                record.add(&name.to_string_lossy(), &counts, &source);
            }
        }
        record.files.sort_by(|one, other| one.file.cmp(&other.file));
        record.open.sort_by(|one, other| {
            (&one.file, one.number, &one.condition).cmp(&(
                &other.file,
                other.number,
                &other.condition,
            ))
        });
        Ok(record)
    }

    /// Adds a file, by its name below `dibs-nostd/src`.
    pub fn add(&mut self, name: &str, counts: &Counts, source: &str) {
        let text: Vec<&str> = source.lines().collect();
        let tests = own_tests::lines(source);
        let line = |number: u32| text.get(number as usize - 1).copied().unwrap_or_default();
        let mut sums = Sums { file: name.to_owned(), ..Sums::default() };
        let open = |number: u32, condition| Open {
            file: name.to_owned(),
            number,
            line: line(number).trim().to_owned(),
            function: function(&text, number as usize).to_owned(),
            condition,
        };
        let lines = &counts.lines;
        // A line that only closes what others opened is no statement.
        let says = |number: u32| line(number).contains(|one: char| one.is_alphanumeric());
        let is_own = |number: u32| says(number) && !tests.contains(&number);
        for (&number, &count) in lines.iter().filter(|(number, _)| is_own(**number)) {
            sums.statements[1] += 1;
            sums.statements[0] += usize::from(count > 0);
            if count == 0 {
                self.open.push(open(number, None));
            }
        }
        for (place, outcomes) in &counts.branches {
            let [number, column, last, last_column] = *place;
            if tests.contains(&number) {
                continue;
            }
            let is_executed = lines.get(&number).is_none_or(|&count| count > 0);
            let end = if number == last { last_column as usize - 1 } else { usize::MAX };
            let whole: Vec<char> = line(number).chars().collect();
            let part = &whole[(column as usize - 1).min(whole.len())..end.min(whole.len())];
            let part: String = part.iter().collect();
            for (outcome, count) in [(true, outcomes[0]), (false, outcomes[1])] {
                sums.branches[1] += 1;
                sums.branches[0] += usize::from(count > 0);
                // A statement that is not executed says the same of its conditions.
                if count == 0 && is_executed {
                    self.open.push(open(number, Some((part.clone(), outcome))));
                }
            }
        }
        for (_, count) in counts.regions.iter().filter(|((number, _), _)| !tests.contains(number)) {
            sums.regions[1] += 1;
            sums.regions[0] += usize::from(*count > 0);
        }
        if sums.regions[1] > 0 {
            self.files.push(sums);
        }
    }

    /// The sums of all files.
    pub fn sums(&self) -> Sums {
        let mut all = Sums::default();
        for sums in &self.files {
            for part in 0..2 {
                all.statements[part] += sums.statements[part];
                all.branches[part] += sums.branches[part];
                all.regions[part] += sums.regions[part];
            }
        }
        all
    }
}

/// The name of the function around a line, from 1: of the last one before it that is indented less.
fn function<'a>(lines: &[&'a str], number: usize) -> &'a str {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let own = lines.get(number - 1).map_or(0, |line| indent(line));
    let before = lines.iter().take(number).enumerate().rev();
    let named = before.filter(|&(at, line)| at + 1 == number || indent(line) < own);
    let mut names = named.filter_map(|(_, line)| {
        let (before, rest) = line.trim_start().split_once("fn ")?;
        let is_head = before.chars().all(|one| one.is_alphanumeric() || " ()_:\"".contains(one));
        let end = rest.find(|one: char| !one.is_alphanumeric() && one != '_')?;
        is_head.then(|| &rest[..end])
    });
    names.next().unwrap_or_default()
}
