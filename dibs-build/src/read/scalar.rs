//! Numbers as files hold them: as text, or as bytes of a type and a byte order.

/// The type of an array's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

/// Byte order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Endian {
    Little,
    Big,
}

impl Scalar {
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in these bytes, at most 8. Integers beyond 2^53 are rounded; no count or index in a file is so large.
    pub fn read(self, bytes: &[u8], order: Endian) -> f64 {
        let mut little = [0; 8];
        for (place, byte) in little.iter_mut().zip(bytes) {
            *place = *byte;
        }
        if order == Endian::Big {
            little[..self.bytes()].reverse();
        }
        let word = u64::from_le_bytes(little);
        match self {
            Self::I8 => f64::from(word as i8),
            Self::U8 => f64::from(word as u8),
            Self::I16 => f64::from(word as i16),
            Self::U16 => f64::from(word as u16),
            Self::I32 => f64::from(word as i32),
            Self::U32 => f64::from(word as u32),
            Self::I64 => word as i64 as f64,
            Self::U64 => word as f64,
            Self::F16 => half(word as u16),
            Self::F32 => f64::from(f32::from_bits(word as u32)),
            Self::F64 => f64::from_bits(word),
        }
    }

    /// All whole numbers in these bytes.
    pub fn read_all(self, bytes: &[u8], order: Endian) -> Vec<f64> {
        bytes.chunks_exact(self.bytes()).map(|bytes| self.read(bytes, order)).collect()
    }
}

/// The value of a 16-bit float: sign, five bits of exponent, ten of fraction.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (1.0 + fraction) * 2_f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The number as a count or an index; `None` if it is not a whole number.
pub(crate) fn index(number: f64) -> Option<u64> {
    (number >= 0.0 && number < 2_f64.powi(53) && number.trunc() == number).then_some(number as u64)
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn half_precision_is_exact() {
        for (bits, number) in [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_953_125),
            (0x7bff, 65_504.0),
            (0x0400, 2_f64.powi(-14)),
            (0x8001, -(2_f64.powi(-24))),
            (0xfc00, f64::NEG_INFINITY),
        ] {
            assert_eq!(half(bits), number, "{bits:04x}");
        }
        assert!(half(0x7e00).is_nan());
    }
}
