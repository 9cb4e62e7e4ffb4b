//! The ZIP archive of a 3MF file.

use super::{Result, inflate, malformed};
use crate::read::raw::excerpt;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::io::Cursor;
use zip::ZipArchive;
use zip::result::ZipError;

pub struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    compressed: usize,
    /// Bytes that all its files together may still decompress to.
    room: u64,
}

impl<'a> Package<'a> {
    pub fn new(bytes: &'a [u8]) -> Result<Self> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| fail(&error))?;
        Ok(Self { archive, compressed: bytes.len(), room: inflate::most(bytes.len()) })
    }

    /// The path of the model with the build: the only one, or the one that the package's relations name.
    pub fn root(&mut self) -> Result<String> {
        let is_model = |path: &String| path.ends_with(".model");
        let models: Vec<String> = self.paths().map(|(_, path)| path).filter(is_model).collect();
        if let [only] = &models[..] {
            return Ok(only.clone());
        }
        let mut root = None;
        if self.paths().any(|(_, path)| path == "_rels/.rels") {
            tags(&self.text("_rels/.rels")?, |tag| {
                let value =
                    |name| tag.try_get_attribute(name).ok().flatten().map(|found| found.value);
                if value("Type").is_some_and(|kind| kind.ends_with("/3dmodel")) {
                    root = value("Target").map(|path| path.trim_start_matches('/').to_owned());
                }
                Ok(())
            })?;
        }
        root.ok_or_else(|| {
            malformed(format!("{} models, of which no relation names the first", models.len()))
        })
    }

    /// The index and the path of each file, without a leading slash.
    fn paths(&self) -> impl Iterator<Item = (usize, String)> {
        (0..self.archive.len()).filter_map(|number| {
            let name = self.archive.name_for_index(number)?.ok()?;
            Some((number, name.trim_start_matches('/').to_owned()))
        })
    }

    pub fn has(&self, path: &str) -> bool {
        self.paths().any(|(_, other)| other.eq_ignore_ascii_case(path))
    }

    /// The text of a file in the package.
    pub fn text(&mut self, path: &str) -> Result<String> {
        let number = self.paths().find(|(_, other)| other.eq_ignore_ascii_case(path));
        let missing = || malformed(format!("the part '{}' is not in the package", excerpt(path)));
        let entry = self.archive.by_index(number.ok_or_else(missing)?.0);
        let entry = entry.map_err(|error| fail(&error))?;
        let text = inflate::read_some(entry, self.compressed, self.room)
            .map_err(|error| malformed(error.to_string()))?;
        self.room -= text.len() as u64;
        let text = crate::read::text::normal(text);
        String::from_utf8(text).map_err(|_| malformed("a model that is no UTF-8"))
    }
}

fn fail(error: &ZipError) -> crate::ReadErrorKind {
    malformed(error.to_string())
}

/// Calls `each` with the start tag of every element.
pub fn tags(text: &str, mut each: impl FnMut(&BytesStart<'_>) -> Result<()>) -> Result<()> {
    let mut xml = Reader::from_str(text);
    loop {
        match xml.read_event().map_err(|error| malformed(error.to_string()))? {
            Event::Start(tag) | Event::Empty(tag) => each(&tag)?,
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}
