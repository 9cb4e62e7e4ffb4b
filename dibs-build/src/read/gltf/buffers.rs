//! The bytes of a document's buffers: each is read when it is first needed, and only once.

use super::document::Buffer;
use super::{Result, get, malformed};
use crate::read::raw::excerpt;
use crate::read::{base64, file};
use std::borrow::Cow;
use std::collections::HashSet;
use std::collections::hash_map::{Entry, HashMap};
use std::path::{Component, Path, PathBuf};

pub struct Buffers<'a> {
    folder: &'a Path,
    /// The binary part of a GLB file.
    binary: &'a [u8],
    buffers: &'a [Buffer],
    /// Contents of buffers by number, and of files by path.
    data: HashMap<usize, Vec<u8>>,
    files: HashMap<PathBuf, Vec<u8>>,
}

impl<'a> Buffers<'a> {
    pub fn new(folder: &'a Path, binary: &'a [u8], buffers: &'a [Buffer]) -> Self {
        Self { folder, binary, buffers, data: HashMap::new(), files: HashMap::new() }
    }

    /// Total size in bytes of the files that the document refers to.
    pub fn room(&self) -> usize {
        let uris = self.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
        let names: HashSet<_> = uris.filter(|uri| !uri.starts_with("data:")).map(decoded).collect();
        let length = |name: &Cow<'_, str>| {
            let path = file_beside(name).map(|path| self.folder.join(path)).unwrap_or_default();
            let metadata = std::fs::metadata(path);
            metadata.map_or(0, |metadata| usize::try_from(metadata.len()).unwrap_or(usize::MAX))
        };
        names.iter().map(length).fold(0, usize::saturating_add)
    }

    /// The bytes of a buffer, of the length that the document states: from the binary part, from the document, or from
    /// a file in the document's folder.
    pub fn bytes(&mut self, number: usize) -> Result<&[u8]> {
        let buffer = get(self.buffers, number, "buffer")?;
        let bytes = match &buffer.uri {
            None => self.binary,
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => self.inside(number, data)?,
                None => self.beside(uri)?,
            },
        };
        let cut_off = || {
            let (stated, found) = (buffer.byte_length, bytes.len());
            malformed(format!("buffer {number} has {found} bytes, and {stated} are stated"))
        };
        bytes.get(..buffer.byte_length).ok_or_else(cut_off)
    }

    fn inside(&mut self, number: usize, data: &str) -> Result<&[u8]> {
        match self.data.entry(number) {
            Entry::Occupied(read) => Ok(read.into_mut()),
            Entry::Vacant(place) => {
                let (kind, encoded) = data.split_once(',').unwrap_or((data, ""));
                let bytes = if kind.ends_with(";base64") {
                    base64::decode(encoded.as_bytes())
                        .ok_or_else(|| malformed("a buffer that is no base64"))?
                } else {
                    unescaped(encoded)
                };
                Ok(place.insert(bytes))
            }
        }
    }

    /// Reads a file up to the end of the longest buffer in it.
    fn beside(&mut self, uri: &str) -> Result<&[u8]> {
        let name = decoded(uri);
        let no_file = || malformed(format!("the buffer '{}' is no file beside it", excerpt(uri)));
        let path = file_beside(&name).ok_or_else(no_file)?;
        if !self.files.contains_key(path) {
            let is_same =
                |buffer: &&Buffer| buffer.uri.as_deref().map(decoded).as_ref() == Some(&name);
            let same = self.buffers.iter().filter(is_same);
            let most = same.map(|buffer| buffer.byte_length as u64).max().unwrap_or(0);
            // Some programs write the name without percent-encoding.
            let spellings = [self.folder.join(path), self.folder.join(uri)];
            let there = spellings.iter().find(|path| path.exists()).unwrap_or(&spellings[0]);
            let bytes = file::first(there, most).map_err(|error| {
                let uri = excerpt(uri);
                malformed(format!(
                    "its buffer '{uri}' cannot be read ({error}); keep both together"
                ))
            })?;
            self.files.insert(path.to_path_buf(), bytes);
        }
        Ok(self.files.get(path).map_or(&[], Vec::as_slice))
    }
}

/// A document may only refer to files in its own folder.
fn file_beside(name: &str) -> Option<&Path> {
    let path = Path::new(name);
    let is_beside = path.components().all(|part| matches!(part, Component::Normal(_)));
    (is_beside && !name.is_empty()).then_some(path)
}

/// The file name of a URI.
fn decoded(uri: &str) -> Cow<'_, str> {
    if !uri.contains('%') {
        return uri.into();
    }
    // Names that are not UTF-8 stay as they are.
    String::from_utf8(unescaped(uri)).map_or(uri.into(), Into::into)
}

/// The bytes of a part of a URI after percent-decoding: `%20` is a space.
fn unescaped(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| byte == b'%');
        let code = code.and_then(|code| std::str::from_utf8(code).ok());
        let code = code.filter(|code| code.bytes().all(|digit| digit.is_ascii_hexdigit()));
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(code) => {
                bytes.push(code);
                rest = &after[2..];
            }
            None => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::decoded;

    #[test]
    fn percent_signs_are_decoded_where_they_encode() {
        for (uri, name) in [
            ("left%20lung.bin", "left lung.bin"),
            ("%C3%a4.bin", "ä.bin"),
            ("100%.bin", "100%.bin"),
            ("50%of.bin", "50%of.bin"),
            ("%ff", "%ff"),
            ("%+1.bin", "%+1.bin"),
            ("a%2Fb", "a/b"),
        ] {
            assert_eq!(decoded(uri), name);
        }
    }
}
