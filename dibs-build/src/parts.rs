//! The files that a mesh or motion file refers to.

use crate::motion::series_files;
use std::path::{Path, PathBuf};

/// The files that reading a mesh or motion file reads: the file itself or the files of a series (`heart_%03d.vtp`), and
/// those that a glTF document refers to. Meant for programs that must not overwrite an input. A file that cannot be
/// read refers to no others.
#[must_use]
pub fn files_of(path: impl AsRef<Path>) -> Vec<PathBuf> {
    let path = path.as_ref();
    if let Some(files) = series_files(path) {
        return files;
    }
    let others = buffers(path).unwrap_or_default();
    [path.to_path_buf()].into_iter().chain(others).collect()
}

/// The buffer files that a glTF document refers to.
#[cfg(feature = "formats")]
fn buffers(path: &Path) -> Option<Vec<PathBuf>> {
    use std::io::Read;

    if !path.metadata().ok()?.is_file() {
        return None;
    }
    let mut file = std::fs::File::open(path).ok()?;
    let mut start = [0; 64];
    let length = file.read(&mut start).ok()?;
    let first = start[..length].iter().find(|byte| !b" \t\r\n\xEF\xBB\xBF".contains(byte));
    if first != Some(&b'{') && !start.starts_with(b"glTF") {
        return None;
    }
    let bytes = std::fs::read(path).ok()?;
    // In a binary file (GLB) the document is the first chunk.
    let document = if bytes.starts_with(b"glTF") {
        let length = bytes.get(12..16)?.try_into().ok().map(u32::from_le_bytes)?;
        bytes.get(20..20_usize.checked_add(length as usize)?)?
    } else {
        bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes)
    };
    let document: serde_json::Value = serde_json::from_slice(document).ok()?;
    let uris =
        document.get("buffers")?.as_array()?.iter().filter_map(|buffer| buffer["uri"].as_str());
    let beside = |uri: &str| path.with_file_name(uri);
    Some(uris.flat_map(|uri| [beside(uri), beside(&decoded(uri))]).collect())
}

#[cfg(not(feature = "formats"))]
fn buffers(_path: &Path) -> Option<Vec<PathBuf>> {
    None
}

/// The text after percent-decoding.
#[cfg(feature = "formats")]
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let code = after.get(..2).filter(|_| *first == b'%');
        let code = code.and_then(|digits| std::str::from_utf8(digits).ok());
        match code.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
