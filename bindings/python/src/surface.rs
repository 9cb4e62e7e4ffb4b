//! The surface at one moment, and queries on it.

use std::sync::Arc;

use dibs_build::glam::Vec3;
use dibs_build::{SurfaceRows, largest_stretch};
use dibs_nostd::{
    Budget, Contacts, Index, MeasuredStretch, Options, Proximity, Query, QueryError, Tree,
};
use pyo3::prelude::*;

use crate::tool::{AnyTool, Chunk};
use crate::tree::{Owned, of_any_width};

/// Enough for any tree, including the 128 more entries of a batched search.
const STACK: usize = dibs_nostd::format::MAX_STACK;

/// Largest number of contacts of a tool and a surface.
pub const MOST_CONTACTS: usize = 64;

/// A list of contacts of a tool and a surface.
pub type List = Contacts<MOST_CONTACTS, 16_384>;

/// The same contacts, kept beside an answer.
pub type KeptContacts = Contacts<MOST_CONTACTS, 1>;

/// A tree with the positions and velocities of its vertices.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Surface {
    pub tree: Arc<Owned>,
    pub rows: SurfaceRows,
    pub velocities: Option<Vec<Vec3>>,
    /// `None` if the tree has no rest metric to measure it with.
    pub stretch: Option<MeasuredStretch>,
}

#[pymethods]
impl Surface {
    fn stretch(&self) -> Option<f64> {
        let measured = self.stretch?;
        let largest =
            of_any_width!(self.tree.view(), tree => largest_stretch(tree, self.rows.frame()));
        Some(largest.unwrap_or(measured.sigma().into()))
    }
}

impl Surface {
    fn options(&self, budget: Budget) -> Options {
        let options = Options::cold().budget(budget);
        match self.stretch {
            Some(measured) => options.stretch(measured),
            None => options,
        }
    }

    /// Finds the closest pair of each tool, with its side if it is signed. `found` receives it with the pose and the tool's index.
    pub fn closest(
        &self,
        chunk: Chunk<'_>,
        (budget, is_signed): (Budget, bool),
        mut found: impl FnMut(usize, usize, Proximity),
    ) -> Result<(), String> {
        let (rows, mut options) = (&self.rows, self.options(budget));
        if !is_signed {
            options = options.unsigned();
        }
        of_any_width!(self.tree.view(), tree => {
            let mut query = query_of(tree)?;
            for (pose, number, numbers) in chunk.tools() {
                let wrong = |error: String| chunk.wrong(pose, number, error);
                let closest = match AnyTool::of(numbers, self.tree.origin).map_err(wrong)? {
                    AnyTool::Sphere(sphere) => query.closest_batched(rows, &sphere, &options),
                    AnyTool::Capsule(capsule) => query.closest_batched(rows, &capsule, &options),
                };
                found(pose, number, closest.map_err(|error| wrong(error.to_string()))?);
            }
        });
        Ok(())
    }

    /// Finds the contacts of each tool, or only those of a label. `found` receives their list with the tool's pose and index.
    pub fn contacts(
        &self,
        chunk: Chunk<'_>,
        budget: Budget,
        (margin, label): (f32, Option<u8>),
        mut found: impl FnMut(usize, usize, &List),
    ) -> Result<(), String> {
        let (rows, mut options) = (&self.rows, self.options(budget));
        if let Some(label) = label {
            options = options.contacts_of(label);
        }
        let mut contacts = Box::new(List::new());
        of_any_width!(self.tree.view(), tree => {
            let mut query = query_of(tree)?;
            for (pose, number, numbers) in chunk.tools() {
                let wrong = |error: String| chunk.wrong(pose, number, error);
                let of_rows = |error: QueryError| wrong(error.to_string());
                match AnyTool::of(numbers, self.tree.origin).map_err(wrong)? {
                    AnyTool::Sphere(sphere) => {
                        query.contacts(rows, &sphere, margin, &options, &mut contacts)
                    }
                    AnyTool::Capsule(capsule) => {
                        query.contacts(rows, &capsule, margin, &options, &mut contacts)
                    }
                }
                .map_err(of_rows)?;
                if let Some(velocities) = &self.velocities {
                    contacts.move_with(velocities.as_slice()).map_err(of_rows)?;
                }
                found(pose, number, &contacts);
            }
        });
        Ok(())
    }
}

fn query_of<'t, I: Index>(tree: &Tree<'t, I>) -> Result<Query<'t, I, STACK>, String> {
    Query::new(tree).map_err(|error| error.to_string())
}
