//! A promise: a figure and its bound.

use std::fmt;

/// One promise, of one figure.
pub struct Promise {
    /// The figure's name.
    pub id: &'static str,
    /// One sentence; empty for a figure that another one's text, or the table of instructions, contains.
    pub says: &'static str,
    /// Criterion of IEC 62304, 5.5.4.
    pub criterion: &'static str,
    pub bound: Bound,
    /// `{id}` stands for the figure of that name, here and below.
    pub unit: &'static str,
    pub limits: &'static str,
}

/// The bound of a figure.
#[derive(Clone, Copy)]
pub enum Bound {
    /// No bound: the figure is information only.
    Informs,
    Is(f64),
    AtMost(f64),
    AtLeast(f64),
    /// At most another figure.
    NotAbove(&'static str),
    /// At most [`TOLERANCE`] per cent above the lowest figure ever recorded, unless it was raised for a reason.
    Golden,
}

/// Per cent by which a golden figure may exceed its floor.
pub const TOLERANCE: f64 = 5.0;

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Informs => write!(f, "–"),
            Self::Is(value) => write!(f, "{value}"),
            Self::AtMost(value) => write!(f, "at most {value}"),
            Self::AtLeast(value) => write!(f, "at least {value}"),
            Self::NotAbove(other) => write!(f, "not above `{other}`"),
            Self::Golden => write!(f, "lowest recorded + {TOLERANCE} %"),
        }
    }
}

impl Bound {
    /// Whether a figure satisfies the bound; `other` returns other figures. Golden bounds are checked with the records.
    pub fn holds(self, figure: f64, other: impl Fn(&str) -> Option<f64>) -> bool {
        match self {
            Self::Informs | Self::Golden => true,
            Self::Is(value) => figure == value,
            Self::AtMost(value) => figure <= value,
            Self::AtLeast(value) => figure >= value,
            Self::NotAbove(name) => other(name).is_none_or(|most| figure <= most),
        }
    }
}

/// A figure without a separate row.
pub const fn note(id: &'static str) -> Promise {
    Promise { id, says: "", criterion: "", bound: Bound::Informs, unit: "", limits: "" }
}

/// A number of instructions that no commit may raise.
pub const fn golden(id: &'static str) -> Promise {
    Promise { bound: Bound::Golden, unit: "instructions", ..note(id) }
}

/// Criteria of IEC 62304, 5.5.4.
pub mod criteria {
    pub const TIMING: &str = "event sequence; planned resources";
    pub const RESOURCES: &str = "planned resources";
    pub const FLOW: &str = "data and control flow";
    pub const FAULTS: &str = "fault handling";
    pub const MEMORY: &str = "memory overflow";
    pub const EDGES: &str = "boundary conditions";
    pub const DIAGNOSTICS: &str = "self-diagnostics";
}
