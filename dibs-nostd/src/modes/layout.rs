//! The modes' bytes: section 7 of `docs/format.md`, and its validation.

// Requirements: F-06, M-01

use super::{MAX_GAIN, MAX_MODES, ModesError};
use crate::math::order::larger;
use crate::tree::format::{range, u32_at};

/// Bytes of the section's header.
pub const HEADER_BYTES: usize = 32;
/// Bytes of one mode's record.
pub const MODE_BYTES: usize = 16;
/// Bytes of one mode's displacement of one vertex.
pub const VERTEX_MODE_BYTES: usize = 6;
/// Bytes of an anchor besides its weights.
pub const ANCHOR_TAIL_BYTES: usize = 8;
/// Most anchors.
pub const MAX_ANCHORS: usize = 65;

#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub modes: u32,
    pub anchors: u32,
    /// Size of one unit of a displacement sum (mm).
    pub unit: f32,
    pub position_error: f32,
    pub rms_error: f32,
    /// Allowance of the stretch bound for rounding.
    pub slack: f32,
    pub margin: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub low: f32,
    pub high: f32,
    /// Units of a displacement sum, times 2^16, for one step of a displacement at weight 1.
    pub gain: f32,
    /// Upper bound on a triangle's stretch added by a weight of 1.
    pub growth: f32,
}

/// The header, the mode records, the anchors and the rows.
pub(super) const fn parts(
    bytes: &[u8],
    vertices: u32,
    triangles: u32,
) -> Result<(Header, [&[u8]; 3]), ModesError> {
    let Some((first, _)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        let (expected, found) = (HEADER_BYTES as u64, bytes.len() as u64);
        return Err(ModesError::Length { expected, found });
    };
    let header = Header {
        modes: u16::from_le_bytes([first[0], first[1]]) as u32,
        anchors: u16::from_le_bytes([first[2], first[3]]) as u32,
        unit: f32_at(bytes, 4),
        position_error: f32_at(bytes, 8),
        rms_error: f32_at(bytes, 12),
        slack: f32_at(bytes, 16),
        margin: f32_at(bytes, 20),
    };
    let wrong = if header.modes == 0 || header.modes > MAX_MODES as u32 {
        Some((0, header.modes))
    } else if header.anchors == 0 || header.anchors > MAX_ANCHORS as u32 {
        Some((2, header.anchors))
    } else if !is_length(header.unit) {
        Some((4, header.unit.to_bits()))
    } else if !is_length(header.position_error) {
        Some((8, header.position_error.to_bits()))
    } else if !is_length(header.rms_error) {
        Some((12, header.rms_error.to_bits()))
    } else if !is_length(header.slack) {
        Some((16, header.slack.to_bits()))
    } else if !is_length(header.margin) {
        Some((20, header.margin.to_bits()))
    } else if first[24] | first[25] | first[26] | first[27] != 0 {
        Some((24, u32::from_le_bytes([first[24], first[25], first[26], first[27]])))
    } else if first[28] | first[29] | first[30] | first[31] != 0 {
        Some((28, u32::from_le_bytes([first[28], first[29], first[30], first[31]])))
    } else {
        None
    };
    if let Some((offset, value)) = wrong {
        return Err(ModesError::Field { offset, value });
    }
    let records_at = HEADER_BYTES as u64;
    let anchors_at = records_at + header.modes as u64 * MODE_BYTES as u64;
    let rows_at =
        anchors_at + header.anchors as u64 * (4 * header.modes as u64 + ANCHOR_TAIL_BYTES as u64);
    let end = rows_at + vertices as u64 * header.modes as u64 * VERTEX_MODE_BYTES as u64;
    if end != bytes.len() as u64 {
        return Err(ModesError::Length { expected: end, found: bytes.len() as u64 });
    }
    // All offsets are at most the section's length, which is a 32-bit number in a tree's header.
    let (Some(records), Some(anchors), Some(rows)) = (
        range(bytes, records_at as u32, (anchors_at - records_at) as u32),
        range(bytes, anchors_at as u32, (rows_at - anchors_at) as u32),
        range(bytes, rows_at as u32, (end - rows_at) as u32),
    ) else {
        return Err(ModesError::Length { expected: end, found: bytes.len() as u64 });
    };
    match check_modes(records, header.modes) {
        Ok(()) => (),
        Err(error) => return Err(error),
    }
    match check_anchors(anchors, &header, triangles) {
        Ok(()) => Ok((header, [records, anchors, rows])),
        Err(error) => Err(error),
    }
}

/// Whether it is a number of at least 0 for which lengths do not overflow.
const fn is_length(x: f32) -> bool {
    x >= 0.0 && x <= 1e18
}

const fn check_modes(records: &[u8], count: u32) -> Result<(), ModesError> {
    let mut reach = 0.0;
    let mut row = 0;
    while row < count {
        let wrong = ModesError::Mode { mode: row };
        let Some(mode) = mode(records, row as usize) else { return Err(wrong) };
        let sound = is_length(-mode.low)
            && is_length(mode.high)
            && is_length(mode.gain)
            && is_length(mode.growth);
        reach += mode.gain * larger(mode.high, -mode.low);
        // Written so that NaN is rejected.
        if !(sound && reach <= MAX_GAIN) {
            return Err(wrong);
        }
        row += 1;
    }
    Ok(())
}

const fn check_anchors(anchors: &[u8], header: &Header, triangles: u32) -> Result<(), ModesError> {
    let stride = anchor_bytes(header.modes as usize);
    let mut row = 0;
    while row < header.anchors {
        let wrong = ModesError::Anchor { anchor: row };
        let at = row as usize * stride;
        let mut mode = 0;
        while mode < header.modes as usize {
            if !(f32_at(anchors, at + 4 * mode).abs() <= 1e18) {
                return Err(wrong);
            }
            mode += 1;
        }
        let tail = at + 4 * header.modes as usize;
        let triangle = u32_at(anchors, tail + 4);
        match triangle {
            Some(triangle) if triangle < triangles && is_length(f32_at(anchors, tail)) => row += 1,
            _ => return Err(wrong),
        }
    }
    Ok(())
}

pub(super) const fn anchor_bytes(modes: usize) -> usize {
    4 * modes + ANCHOR_TAIL_BYTES
}

/// The `f32` at an offset; NaN outside the bytes, which every check refuses.
const fn f32_at(bytes: &[u8], at: usize) -> f32 {
    match u32_at(bytes, at) {
        Some(bits) => f32::from_bits(bits),
        None => f32::NAN,
    }
}

pub(super) const fn mode(records: &[u8], mode: usize) -> Option<Mode> {
    let Some(at) = mode.checked_mul(MODE_BYTES) else { return None };
    match records.split_at_checked(at) {
        Some((_, tail)) => match tail.first_chunk::<MODE_BYTES>() {
            Some(record) => Some(decode(record)),
            None => None,
        },
        None => None,
    }
}

pub(super) const fn decode(r: &[u8; MODE_BYTES]) -> Mode {
    Mode {
        low: f32::from_le_bytes([r[0], r[1], r[2], r[3]]),
        high: f32::from_le_bytes([r[4], r[5], r[6], r[7]]),
        gain: f32::from_le_bytes([r[8], r[9], r[10], r[11]]),
        growth: f32::from_le_bytes([r[12], r[13], r[14], r[15]]),
    }
}

#[inline(always)]
pub(super) fn row(rows: &[u8], vertex: u32, modes: usize) -> Option<&[[u8; VERTEX_MODE_BYTES]]> {
    let stride = modes * VERTEX_MODE_BYTES;
    let at = (vertex as usize).checked_mul(stride)?;
    let (row, _) = rows.split_at_checked(at)?.1.split_at_checked(stride)?;
    Some(row.as_chunks().0)
}

/// One anchor: a shape whose stretch was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor<'a> {
    pub weights: &'a [[u8; 4]],
    pub sigma: f32,
    pub triangle: u32,
}

pub(super) fn anchor(anchors: &[u8], row: usize, modes: usize) -> Option<Anchor<'_>> {
    let at = row.checked_mul(anchor_bytes(modes))?;
    let (weights, tail) = anchors.split_at_checked(at)?.1.split_at_checked(4 * modes)?;
    let &[s0, s1, s2, s3, t0, t1, t2, t3] = tail.first_chunk::<ANCHOR_TAIL_BYTES>()?;
    Some(Anchor {
        weights: weights.as_chunks().0,
        sigma: f32::from_le_bytes([s0, s1, s2, s3]),
        triangle: u32::from_le_bytes([t0, t1, t2, t3]),
    })
}
