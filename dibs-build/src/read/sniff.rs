//! Finds a file's format by its content, and by its extension only if the content does not decide.

use super::raw::{coordinate, lines};
use super::text::trimmed;
use super::{Format, ReadErrorKind, ReadTarget, foreign, off, stl};
use std::path::Path;

pub(super) fn format(
    bytes: &[u8],
    path: &Path,
    wanted: ReadTarget,
) -> Result<Format, ReadErrorKind> {
    if bytes.is_empty() {
        return Err(ReadErrorKind::Empty);
    }
    if let Some(format) = marked(bytes) {
        return Ok(format);
    }
    let first_line = lines(bytes)
        .map(|(_, line)| line.trim().to_owned())
        .find(|line| !line.is_empty() && !line.starts_with('#'))
        .unwrap_or_default();
    let first_word = first_line.split_whitespace().next().unwrap_or_default();
    if first_line.eq_ignore_ascii_case("ply") {
        return Ok(Format::Ply);
    }
    if off::is_header(first_word) {
        return Ok(Format::Off);
    }
    // Checked before "solid", because many binary files begin with that word.
    if stl::size_fits_count(bytes) {
        return Ok(Format::StlBinary);
    }
    let is_text = !trimmed(bytes).contains(&0);
    if first_word.eq_ignore_ascii_case("solid") && is_text {
        return Ok(Format::StlAscii);
    }
    if is_text && lines(bytes).any(|(_, line)| is_obj_line(&line)) {
        return Ok(Format::Obj);
    }
    let named = path.extension().and_then(|extension| extension.to_str()).and_then(named);
    // A damaged package is not reported as another archive.
    if named == Some(Format::ThreeMf) {
        return Ok(Format::ThreeMf);
    }
    if let Some(foreign) = foreign::named(bytes, path, wanted) {
        return Err(foreign);
    }
    match named {
        // Text STL begins with "solid" as well; a zero means that this is a binary file, cut off in its header.
        Some(Format::StlAscii) if bytes.contains(&0) => Ok(Format::StlBinary),
        // The error is then that of this format's reader.
        Some(format) => Ok(format),
        None => Err(ReadErrorKind::UnknownFormat),
    }
}

/// The format of a file name extension.
fn named(extension: &str) -> Option<Format> {
    use Format::{Gltf, Gmsh, Obj, Off, Ply, StlAscii, ThreeMf, Vtk, Vtp};
    let all = [Obj, StlAscii, Ply, Off, Vtk, Vtp, Gltf, Gmsh, ThreeMf];
    all.into_iter().find(|format| format.has_extension(extension))
}

/// The format of a file that begins with a format's own mark.
fn marked(bytes: &[u8]) -> Option<Format> {
    let beginning = &bytes[..bytes.len().min(1024)];
    let has = |bytes: &[u8], mark: &[u8]| {
        bytes.windows(mark.len()).any(|window| window.eq_ignore_ascii_case(mark))
    };
    match beginning.trim_ascii_start() {
        [b'#', ..] if has(&beginning[..beginning.len().min(16)], b"# vtk DataFile") => {
            Some(Format::Vtk)
        }
        [b'<', ..] if has(beginning, b"<VTKFile") => Some(Format::Vtp),
        [b'g', b'l', b'T', b'F', ..] => Some(Format::Gltf),
        [b'{', ..] if has(bytes, b"\"asset\"") => Some(Format::Gltf),
        [b'$', ..] if has(beginning, b"$MeshFormat") || has(beginning, b"$NOD") => {
            Some(Format::Gmsh)
        }
        // A package contains the names of its files uncompressed.
        [b'P', b'K', 3, 4, ..] if has(bytes, b"3D/") && has(bytes, b".model") => {
            Some(Format::ThreeMf)
        }
        _ => None,
    }
}

/// Whether a line is an OBJ vertex or face: prose may begin with "v" or "f", but is not followed by numbers.
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
