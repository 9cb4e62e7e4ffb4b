//! Units of length of mesh files.

// Requirement: M-06

use core::fmt;

/// The unit of the lengths in a mesh's file. The tree's own lengths are in millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Unit {
    /// Millimetres: lengths stay as they are.
    #[default]
    Millimetre,
    /// Centimetres.
    Centimetre,
    /// Metres.
    Metre,
    /// Inches.
    Inch,
    /// Micrometres.
    Micrometre,
}

impl Unit {
    /// All units.
    pub const ALL: [Self; 5] =
        [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch, Self::Micrometre];

    /// The number of millimetres in one unit.
    #[must_use]
    pub const fn millimetres(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1000.0,
            Self::Inch => 25.4,
            Self::Micrometre => 0.001,
        }
    }

    /// The name on a command line: `mm`, `cm`, `m`, `in` or `um`.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
            Self::Micrometre => "um",
        }
    }

    /// The code of this unit in a tree's header, 1 to 5; 0 is an unknown unit.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Millimetre => 1,
            Self::Centimetre => 2,
            Self::Metre => 3,
            Self::Inch => 4,
            Self::Micrometre => 5,
        }
    }

    /// The inverse of [`code`](Self::code).
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            1 => Some(Self::Millimetre),
            2 => Some(Self::Centimetre),
            3 => Some(Self::Metre),
            4 => Some(Self::Inch),
            5 => Some(Self::Micrometre),
            _ => None,
        }
    }
}

/// Writes the [symbol](Unit::symbol).
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}
