//! The facts by which both ends of a bus check that they have the same surface.

// Requirement: M-06

use core::fmt;

use super::Unit;

/// A surface's unit and size, as stated by one end of a bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SurfaceFacts {
    /// Unit of the mesh's file; `None` if unknown.
    pub unit: Option<Unit>,
    /// Number of vertices; 0 if unknown.
    pub vertices: u32,
    /// Number of triangles; 0 if unknown.
    pub triangles: u32,
}

impl SurfaceFacts {
    /// Whether all facts that both sides state are equal.
    ///
    /// ```
    /// use dibs_nostd::{SurfaceFacts, format::Unit};
    /// let here = SurfaceFacts { unit: Some(Unit::Millimetre), vertices: 4, triangles: 4 };
    /// assert!(here.agrees_with(&SurfaceFacts { unit: None, ..here }));
    /// assert!(!here.agrees_with(&SurfaceFacts { unit: Some(Unit::Metre), ..here }));
    /// ```
    #[must_use]
    pub fn agrees_with(&self, other: &Self) -> bool {
        let agree = |here: u32, there: u32| here == 0 || there == 0 || here == there;
        let units =
            [self.unit, other.unit].map(|unit| unit.map_or(0, |unit| u32::from(unit.code())));
        let [here, there] = units;
        agree(here, there)
            && agree(self.vertices, other.vertices)
            && agree(self.triangles, other.triangles)
    }
}

impl fmt::Display for SurfaceFacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { unit, vertices, triangles } = self;
        match vertices {
            0 => write!(f, "an unknown number of vertices")?,
            _ => write!(f, "{vertices} vertices")?,
        }
        if *triangles != 0 {
            write!(f, ", {triangles} triangles")?;
        }
        unit.map_or(Ok(()), |unit| write!(f, ", from a file in {unit}"))
    }
}
