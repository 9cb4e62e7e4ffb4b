//! Finds places of the source in the program, by its debug information.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use addr2line::Loader;
use anyhow::{Context, Result, anyhow, ensure};

/// A function that an instruction belongs to, directly or by inlining.
pub struct Frame {
    /// With its generic arguments, without its path.
    pub name: String,
    file: String,
    line: u32,
}

impl Frame {
    pub fn describe(&self) -> String {
        let file = self.file.rsplit('/').next().unwrap_or_default();
        format!("{} {file}:{}", self.bare(), self.line)
    }

    /// The file below the folder of the language's `core`, the line and the name of a function of it. Lines of its macros in
    /// other functions are not of it; a closure is of the function around it.
    pub fn in_core(&self) -> Option<(&str, u32, &str)> {
        let (_, file) = self.file.split_once("/library/core/src/")?;
        let name = self.bare();
        let path = self.name.split('<').next().unwrap_or_default();
        let is_of_core = path.starts_with("core::") || !path.contains("::");
        (is_of_core && !name.is_empty() && !name.starts_with('{'))
            .then_some((file, self.line, name))
    }

    /// The name without path and generic arguments.
    pub fn bare(&self) -> &str {
        let name = self.name.split('<').next().unwrap_or_default();
        name.rsplit("::").next().unwrap_or_default()
    }
}

/// A condition on one of an instruction's frames.
#[derive(Clone, Copy, Debug)]
pub enum Within {
    /// A function with this name.
    Function(&'static str),
    /// A function with this name and this among its generic arguments.
    Of(&'static str, &'static str),
    /// The only line of a file that contains this text: the line is still found if it moves, but not if it changes.
    Line(&'static str, &'static str),
}

type Predicate = Box<dyn Fn(&Frame) -> bool>;

/// The debug information of a program, and its source.
pub struct Lines {
    frames: BTreeMap<u32, Vec<Frame>>,
    source: PathBuf,
}

impl Lines {
    /// Reads the information for these instructions. The lines of the facts are those of the files below `source`.
    pub fn read(program: &Path, source: &Path, places: impl Iterator<Item = u32>) -> Result<Self> {
        let loader = Loader::new(program).map_err(wrong)?;
        let mut frames = BTreeMap::new();
        for at in places {
            frames.insert(at, all_frames(&loader, at)?);
        }
        Ok(Self { frames, source: source.to_owned() })
    }

    /// The frames of an instruction, the innermost first.
    pub fn of(&self, at: u32) -> &[Frame] {
        self.frames.get(&at).map(Vec::as_slice).unwrap_or_default()
    }

    /// A description of an address, for messages.
    pub fn describe(&self, at: u32) -> String {
        let frames: Vec<String> = self.of(at).iter().rev().map(Frame::describe).collect();
        format!("{at:#x}: {}", frames.join(" > "))
    }

    /// A predicate that tells whether an instruction has all these frames.
    pub fn all(&self, wanted: &[Within]) -> Result<impl Fn(u32) -> bool> {
        let wanted: Vec<_> = wanted.iter().map(|one| self.wanted(one)).collect::<Result<_>>()?;
        Ok(move |at: u32| {
            let frames = self.of(at);
            wanted.iter().all(|wanted| frames.iter().any(wanted))
        })
    }

    fn wanted(&self, wanted: &Within) -> Result<Predicate> {
        Ok(match *wanted {
            Within::Function(name) => Box::new(move |frame| frame.bare() == name),
            Within::Of(name, argument) => {
                Box::new(move |frame| frame.bare() == name && frame.name.contains(argument))
            }
            Within::Line(file, text) => {
                let line = self.number(file, text)?;
                Box::new(move |frame| frame.line == line && frame.file.ends_with(file))
            }
        })
    }

    /// The number of the only line of a file that contains a text.
    fn number(&self, file: &str, text: &str) -> Result<u32> {
        let path = self.source.join(file);
        let source =
            fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut found = source.lines().zip(1..).filter(|(line, _)| line.contains(text));
        let (_, line) = found.next().with_context(|| format!("{file} has no `{text}`"))?;
        ensure!(found.next().is_none(), "{file} has `{text}` twice");
        Ok(line)
    }
}

/// The only function of a set whose own name contains a text.
pub fn function_named(
    program: &Path,
    text: &str,
    mut among: impl Iterator<Item = u32>,
) -> Result<u32> {
    let loader = Loader::new(program).map_err(wrong)?;
    let is_named = |at: &u32| {
        let frames = all_frames(&loader, *at).unwrap_or_default();
        frames.last().is_some_and(|frame| frame.name.contains(text))
    };
    let found = among.find(is_named).with_context(|| format!("no function is named `{text}`"))?;
    ensure!(!among.any(|at| is_named(&at)), "two functions are named `{text}`");
    Ok(found)
}

fn all_frames(loader: &Loader, at: u32) -> Result<Vec<Frame>> {
    let mut found = Vec::new();
    let mut frames = loader.find_frames(u64::from(at)).map_err(wrong)?;
    while let Some(frame) = frames.next().map_err(wrong)? {
        let name = match &frame.function {
            Some(function) => function.demangle().map_err(wrong)?.into_owned(),
            None => String::new(),
        };
        let location = frame.location.as_ref();
        let file = location.and_then(|place| place.file).unwrap_or_default().to_owned();
        let line = location.and_then(|place| place.line).unwrap_or_default();
        found.push(Frame { name, file, line });
    }
    Ok(found)
}

fn wrong(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("debug information: {error}")
}
