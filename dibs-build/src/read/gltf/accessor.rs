//! The numbers of an accessor: of any type allowed for positions and vertex numbers, including sparse accessors.

use super::buffers::Buffers;
use super::document::{Document, Sparse};
use super::{Result, get, malformed, packed};
use crate::read::ReadErrorKind;
use crate::read::scalar::{Endian, Scalar, index};

/// What an accessor's numbers are used for.
#[derive(Clone, Copy, PartialEq)]
pub enum Use {
    /// Three numbers a vertex.
    Positions,
    /// One vertex number each.
    Indices,
    /// Sixteen numbers, column by column.
    Matrices,
    /// Four joint numbers a vertex.
    Joints,
    /// Four weights a vertex.
    Weights,
}

/// The numbers of accessor `number`. `most` bounds those of an accessor that has no bytes of its own.
pub fn numbers(
    document: &Document,
    buffers: &mut Buffers<'_>,
    number: usize,
    used: Use,
    most: usize,
) -> Result<Vec<f64>> {
    let accessor = get(&document.accessors, number, "accessor")?;
    let wrong = |what: &str| malformed(format!("accessor {number} {what}"));
    let scalar = scalar(accessor.component_type)
        .ok_or_else(|| wrong("has another type of numbers than its use asks for"))?;
    let is_integer = scalar != Scalar::F32;
    let is_unsigned = matches!(scalar, Scalar::U8 | Scalar::U16 | Scalar::U32);
    let is_share = accessor.normalized && is_unsigned;
    let (shape, width, fits) = match used {
        // Integers are allowed by the extension KHR_mesh_quantization.
        Use::Positions => ("VEC3", 3, scalar != Scalar::U32),
        Use::Indices => ("SCALAR", 1, is_unsigned),
        Use::Matrices => ("MAT4", 16, !is_integer),
        Use::Joints => ("VEC4", 4, is_unsigned),
        Use::Weights => ("VEC4", 4, !is_integer || is_share),
    };
    if accessor.shape != shape || !fits {
        return Err(wrong("has another type of numbers than its use asks for"));
    }
    let mut values = match accessor.buffer_view {
        Some(view) => {
            let at = BufferOffset { view, offset: accessor.byte_offset, strided: true };
            elements(document, buffers, &at, scalar, width, accessor.count)
                .map_err(|error| error.of(number))?
        }
        None if accessor.count > most => {
            return Err(ReadErrorKind::Count {
                element: format!("elements in accessor {number}"),
                claimed: accessor.count as u64,
                found: most as u64,
                at_most: true,
            });
        }
        None => vec![0.0; accessor.count * width],
    };
    if let Some(sparse) = &accessor.sparse {
        replace(document, buffers, sparse, scalar, width, &mut values)
            .map_err(|error| error.of(number))?;
    }
    if accessor.normalized && is_integer {
        let largest = match scalar {
            Scalar::I8 => 127.0,
            Scalar::U8 => 255.0,
            Scalar::I16 => 32_767.0,
            _ => 65_535.0,
        };
        values.iter_mut().for_each(|value| *value = (*value / largest).max(-1.0));
    }
    Ok(values)
}

fn scalar(component_type: u32) -> Option<Scalar> {
    Some(match component_type {
        5120 => Scalar::I8,
        5121 => Scalar::U8,
        5122 => Scalar::I16,
        5123 => Scalar::U16,
        5125 => Scalar::U32,
        5126 => Scalar::F32,
        _ => return None,
    })
}

/// Where in the buffers elements are.
struct BufferOffset {
    view: usize,
    offset: usize,
    /// Whether the view's stride applies.
    strided: bool,
}

/// A defect of an accessor whose number the caller adds.
enum Defect {
    Sentence(&'static str),
    Known(ReadErrorKind),
}

impl Defect {
    fn of(self, number: usize) -> ReadErrorKind {
        match self {
            Self::Sentence(what) => malformed(format!("accessor {number} {what}")),
            Self::Known(kind) => kind,
        }
    }
}

impl From<ReadErrorKind> for Defect {
    fn from(kind: ReadErrorKind) -> Self {
        Self::Known(kind)
    }
}

const BEYOND: Defect = Defect::Sentence("reaches beyond its buffer; the file was cut off");

fn elements(
    document: &Document,
    buffers: &mut Buffers<'_>,
    place: &BufferOffset,
    scalar: Scalar,
    width: usize,
    count: usize,
) -> std::result::Result<Vec<f64>, Defect> {
    let view = get(&document.buffer_views, place.view, "buffer view")?;
    if let Some(name) = view.extensions.keys().find(|name| name.contains("compression")) {
        return Err(packed(name).into());
    }
    let size = width * scalar.bytes();
    let stride = view.byte_stride.filter(|_| place.strided).unwrap_or(size);
    let bytes = buffers.bytes(view.buffer)?.get(view.byte_offset..);
    let bytes = bytes.and_then(|bytes| bytes.get(..view.byte_length.unwrap_or(bytes.len())));
    let bytes = bytes.and_then(|bytes| bytes.get(place.offset..)).ok_or(BEYOND)?;
    let Some(last) = count.checked_sub(1) else { return Ok(Vec::new()) };
    let end = last.checked_mul(stride).and_then(|last| last.checked_add(size));
    if stride < size || end.is_none_or(|end| end > bytes.len()) {
        return Err(BEYOND);
    }
    let elements = (0..count).map(|element| &bytes[element * stride..][..size]);
    Ok(elements.flat_map(|element| scalar.read_all(element, Endian::Little)).collect())
}

/// Overwrites elements with those of the accessor's sparse part.
fn replace(
    document: &Document,
    buffers: &mut Buffers<'_>,
    sparse: &Sparse,
    value_type: Scalar,
    width: usize,
    values: &mut [f64],
) -> std::result::Result<(), Defect> {
    let at = &sparse.indices;
    let place = BufferOffset { view: at.buffer_view, offset: at.byte_offset, strided: false };
    let index_type = scalar(at.component_type)
        .ok_or(Defect::Sentence("has a sparse part of another type of numbers"))?;
    let rows = elements(document, buffers, &place, index_type, 1, sparse.count)?;
    let at = &sparse.values;
    let place = BufferOffset { view: at.buffer_view, offset: at.byte_offset, strided: false };
    let others = elements(document, buffers, &place, value_type, width, sparse.count)?;
    for (row, other) in rows.into_iter().zip(others.chunks_exact(width)) {
        let start = index(row).and_then(|row| usize::try_from(row).ok()?.checked_mul(width));
        let place = start.and_then(|start| values.get_mut(start..)?.get_mut(..width));
        place.ok_or(Defect::Sentence("has a sparse part beyond its end"))?.copy_from_slice(other);
    }
    Ok(())
}
