//! NumPy arrays of frames x vertices (or nodes) x 3, as `numpy.save` writes them.
//!
//! Our own reader, although `npyz` and `ndarray-npy` exist: both depend on a parser generator and big integers to read
//! one line of three keys.

use crate::Motion;
use crate::read::{Endian, FileCoordinates, ReadErrorKind, Scalar, excerpt};

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

fn wrong(what: String) -> ReadErrorKind {
    ReadErrorKind::NumPy { what }
}

pub(super) fn parse(bytes: &[u8], place: &FileCoordinates) -> Result<Motion, ReadErrorKind> {
    let cut_off = || wrong("its header is cut off".to_owned());
    let version = *bytes.get(MAGIC.len()).ok_or_else(cut_off)?;
    // From the second version on the header may be long.
    let width = if version == 1 { 2 } else { 4 };
    let start = MAGIC.len() + 2;
    let length = bytes.get(start..start + width).ok_or_else(cut_off)?;
    let length = length.iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte));
    let (header, data) = bytes[start + width..].split_at_checked(length).ok_or_else(cut_off)?;
    let header = String::from_utf8_lossy(header);
    let (scalar, order) = kind(value(&header, "descr")?)?;
    let is_fortran = value(&header, "fortran_order")?.starts_with("True");
    let [frames, vertices] = shape(value(&header, "shape")?)?;
    let size = frames.checked_mul(vertices).and_then(|size| size.checked_mul(3));
    let claimed = size.and_then(|size| size.checked_mul(scalar.bytes()));
    if frames == 0 || vertices == 0 || claimed != Some(data.len()) {
        return Err(wrong(format!(
            "{frames} x {vertices} x 3 numbers of {} bytes, and {} bytes of data",
            scalar.bytes(),
            data.len()
        )));
    }
    let numbers = scalar.read_all(data, order);
    // In Fortran order the first index varies fastest.
    let index = |frame: usize, vertex: usize, axis: usize| {
        if is_fortran {
            frame + frames * (vertex + vertices * axis)
        } else {
            (frame * vertices + vertex) * 3 + axis
        }
    };
    let point = |frame, vertex| [0, 1, 2].map(|axis| numbers[index(frame, vertex, axis)]);
    let frame = |frame| {
        let points: Vec<[f64; 3]> = (0..vertices).map(|vertex| point(frame, vertex)).collect();
        place.frame_of(&points, frame)
    };
    let frames = (0..frames).map(frame).collect::<Result<_, _>>()?;
    Ok(Motion { frames, rate: 0.0, origin: place.origin, faces: Vec::new() })
}

/// The text after a key of the header, which is a Python dictionary.
fn value<'a>(header: &'a str, key: &str) -> Result<&'a str, ReadErrorKind> {
    let after = header.split_once(&format!("'{key}'")).map(|(_, after)| after.trim_start());
    let value = after.and_then(|after| after.strip_prefix(':')).map(str::trim_start);
    value.ok_or_else(|| wrong(format!("its header has no '{key}'")))
}

/// The type of the numbers, such as `'<f8'`: byte order, kind of number, and its size in bytes.
fn kind(value: &str) -> Result<(Scalar, Endian), ReadErrorKind> {
    let descr = value.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let order = if descr.starts_with('>') { Endian::Big } else { Endian::Little };
    let scalar = match descr.trim_start_matches(['<', '>', '|', '=']) {
        "f2" => Scalar::F16,
        "f4" => Scalar::F32,
        "f8" => Scalar::F64,
        "i1" => Scalar::I8,
        "i2" => Scalar::I16,
        "i4" => Scalar::I32,
        "i8" => Scalar::I64,
        "u1" => Scalar::U8,
        "u2" => Scalar::U16,
        "u4" => Scalar::U32,
        "u8" => Scalar::U64,
        _ => return Err(ReadErrorKind::NumPyType { descr: excerpt(descr) }),
    };
    Ok((scalar, order))
}

/// The number of frames, and of vertices in each, from a shape such as `(25, 5138, 3)`.
fn shape(value: &str) -> Result<[usize; 2], ReadErrorKind> {
    let inner = value.strip_prefix('(').and_then(|value| value.split_once(')'));
    let (inner, _) = inner.ok_or_else(|| wrong("its header has no shape".to_owned()))?;
    let numbers: Option<Vec<usize>> =
        inner.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[frames, vertices, 3]) => Ok([frames, vertices]),
        _ => Err(wrong(format!("an array of the shape ({})", excerpt(inner)))),
    }
}
