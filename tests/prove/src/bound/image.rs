//! The linked program: its functions by address, and which bytes are code.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

pub struct Symbol {
    /// Demangled, without its hash.
    pub name: String,
    pub end: u32,
}

/// The code of a linked program.
pub struct Image {
    sections: Vec<(u32, Vec<u8>)>,
    /// Starts of code and of data, from the linker's mapping symbols.
    marks: BTreeMap<u32, bool>,
    symbols: BTreeMap<u32, Symbol>,
}

impl Image {
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        let mut sections = Vec::new();
        let mut symbols = BTreeMap::new();
        for section in file.sections().filter(|section| section.address() > 0) {
            sections.push((section.address() as u32, section.data()?.to_vec()));
        }
        // Not every section starts above zero: the vector table is at the start of flash.
        for section in file.sections().filter(|section| section.address() == 0) {
            if section.kind() == object::SectionKind::Text {
                sections.push((0, section.data()?.to_vec()));
            }
        }
        let mut marks = BTreeMap::new();
        for symbol in file.symbols() {
            let (name, at) = (symbol.name()?, symbol.address() as u32);
            if name.starts_with("$t") || name.starts_with("$d") {
                marks.insert(at, name.starts_with("$t"));
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                let start = at & !1;
                let end = start + symbol.size() as u32;
                let name = format!("{:#}", rustc_demangle::demangle(name));
                let known = symbols.entry(start).or_insert(Symbol { name: String::new(), end: 0 });
                if end > known.end {
                    *known = Symbol { name, end };
                }
            }
        }
        Ok(Self { sections, marks, symbols })
    }

    /// A single function at address zero, for tests.
    pub fn of_halves(halves: &[u16]) -> Self {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let symbol = Symbol { name: "function".to_owned(), end: code.len() as u32 };
        Self {
            sections: vec![(0, code)],
            marks: BTreeMap::from([(0, true)]),
            symbols: BTreeMap::from([(0, symbol)]),
        }
    }

    /// The same, where these bytes are data.
    pub fn with_data(mut self, bytes: Range<u32>) -> Self {
        self.marks.extend([(bytes.start, false), (bytes.end, true)]);
        self
    }

    /// Functions, by address.
    pub fn symbols(&self) -> impl Iterator<Item = (u32, &Symbol)> {
        self.symbols.iter().map(|(&at, symbol)| (at, symbol))
    }

    /// The function at an address.
    pub fn symbol(&self, at: u32) -> Result<&Symbol> {
        self.symbols.get(&at).with_context(|| format!("no function starts at {at:#x}"))
    }

    /// The end of the region of code or data that contains an address.
    pub fn end_of_data(&self, at: u32) -> u32 {
        self.marks.range(at + 1..).next().map_or(u32::MAX, |(&mark, _)| mark)
    }

    /// A half word of code.
    pub fn code(&self, at: u32) -> Result<u32> {
        let is_code = self.marks.range(..=at).next_back().is_some_and(|(_, &is_code)| is_code);
        ensure!(is_code, "a path leads to {at:#x}, which is data");
        let bytes = self.bytes(at, 2)?;
        Ok(u32::from(bytes[0]) | u32::from(bytes[1]) << 8)
    }

    /// So many bytes.
    pub fn bytes(&self, at: u32, count: u32) -> Result<&[u8]> {
        let found = self.sections.iter().find_map(|(base, data)| {
            let from = at.checked_sub(*base)? as usize;
            data.get(from..from + count as usize)
        });
        found.with_context(|| format!("no bytes at {at:#x}"))
    }
}
