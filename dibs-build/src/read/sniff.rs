//! Finds a file's format by its content, and by its extension only if the content does not decide.

use super::raw::{coordinate, lines};
use super::{Format, ReadErrorKind, foreign, stl};
use std::path::Path;

pub(super) fn format(bytes: &[u8], path: &Path) -> Result<Format, ReadErrorKind> {
    if bytes.is_empty() {
        return Err(ReadErrorKind::Empty);
    }
    if let Some(format) = marked(bytes) {
        return Ok(format);
    }
    let first_line = lines(bytes)
        .map(|(_, line)| line.trim().to_ascii_lowercase())
        .find(|line| !line.is_empty() && !line.starts_with('#'))
        .unwrap_or_default();
    let first_word = first_line.split_whitespace().next().unwrap_or_default();
    if first_line == "ply" {
        return Ok(Format::Ply);
    }
    if matches!(first_word, "off" | "coff" | "noff" | "cnoff" | "stoff") {
        return Ok(Format::Off);
    }
    // Checked before "solid", because many binary files begin with that word.
    if stl::size_fits_count(bytes) {
        return Ok(Format::StlBinary);
    }
    let is_text = !bytes.contains(&0);
    if first_word == "solid" && is_text {
        return Ok(Format::StlAscii);
    }
    if is_text && lines(bytes).any(|(_, line)| is_obj_line(&line)) {
        return Ok(Format::Obj);
    }
    if let Some(foreign) = foreign::named(bytes, path) {
        return Err(foreign);
    }
    let extension = path.extension().and_then(|extension| extension.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("obj") if is_text => Ok(Format::Obj),
        Some("stl") => Ok(Format::StlBinary),
        _ => Err(ReadErrorKind::UnknownFormat),
    }
}

/// A format that begins with a mark of its own.
fn marked(bytes: &[u8]) -> Option<Format> {
    let beginning = &bytes[..bytes.len().min(1024)];
    let has = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).any(|window| window == mark);
    match beginning.trim_ascii_start() {
        [b'#', ..] if bytes.starts_with(b"# vtk DataFile") => Some(Format::Vtk),
        [b'<', ..] if has(beginning, b"<VTKFile") => Some(Format::Vtp),
        [b'g', b'l', b'T', b'F', ..] => Some(Format::Gltf),
        [b'{', ..] if has(bytes, b"\"asset\"") => Some(Format::Gltf),
        [b'$', ..] if has(beginning, b"$MeshFormat") => Some(Format::Gmsh),
        // Names of files stand in a package as they are.
        [b'P', b'K', 3, 4, ..] if has(bytes, b"3D/") && has(bytes, b".model") => {
            Some(Format::ThreeMf)
        }
        _ => None,
    }
}

/// Whether a line is an OBJ vertex or face: prose may begin with "v" or "f", but not so.
fn is_obj_line(line: &str) -> bool {
    let mut words = line.split_whitespace();
    match words.next() {
        Some("v") => words.next().is_some_and(|word| coordinate(word).is_some()),
        Some("f") => words
            .next()
            .is_some_and(|word| word.starts_with(|c: char| c == '-' || c.is_ascii_digit())),
        _ => false,
    }
}
