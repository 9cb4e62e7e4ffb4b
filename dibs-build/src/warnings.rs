//! What is unusual in a mesh, for every way to build a tree.

use crate::crossing::crossing_parts;
use crate::{Mesh, check_winding};

impl Mesh {
    /// What makes a side of the surface wrong or uncertain, each in a sentence: its winding ([`check_winding`]), and closed
    /// parts that cross or touch at rest.
    ///
    /// Cost: that of `check_winding`, and the comparison of up to four million pairs of triangles.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let winding = check_winding(self).err().map(|error| error.to_string());
        let crossing = crossing_parts(self).into_iter().map(|parts| parts.to_string());
        winding.into_iter().chain(crossing).collect()
    }
}
