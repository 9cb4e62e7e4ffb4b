//! Queries on one or several surfaces.

use std::sync::Arc;

use dibs_nostd::{Budget, Contact, NoSide, Proximity, Side};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use rayon::prelude::*;

use crate::invalid;
use crate::record::{push_answer, push_contact};
use crate::surface::Surface;
use crate::tool::{Chunk, Poses};

/// Poses that one query object answers.
const CHUNK: usize = 128;

/// Poses between two checks for an interrupt.
const BLOCK: usize = 1 << 16;

/// The bytes of all tools, the numbers per tool, and the tools per pose.
type Tools<'a> = (&'a [u8], usize, usize);

/// The closest pair of each pose.
#[pyfunction]
pub fn query<'py>(
    py: Python<'py>,
    surfaces: Vec<Py<Surface>>,
    tools: Tools<'_>,
    budget: u32,
    is_signed: bool,
) -> PyResult<Bound<'py, PyByteArray>> {
    let scene = Scene::new(surfaces, budget);
    let found = in_blocks(py, tools, |chunk| scene.answer(chunk, is_signed))?;
    Ok(PyByteArray::new(py, &found.concat()))
}

/// The contacts of each pose, and for each pose the bound below which the list is complete, and the list's accuracy.
#[pyfunction]
pub fn contacts<'py>(
    py: Python<'py>,
    surfaces: Vec<Py<Surface>>,
    tools: Tools<'_>,
    margin: f32,
    budget: u32,
    label: Option<u8>,
) -> PyResult<[Bound<'py, PyByteArray>; 3]> {
    let scene = Scene::new(surfaces, budget);
    let found = in_blocks(py, tools, |chunk| scene.touch(chunk, (margin, label)))?;
    let of_all =
        |part: usize| found.iter().flat_map(|chunk| &chunk[part]).copied().collect::<Vec<_>>();
    Ok([0, 1, 2].map(|part| PyByteArray::new(py, &of_all(part))))
}

/// Answers chunks of poses on all cores, without holding Python's lock.
fn in_blocks<T: Send>(
    py: Python<'_>,
    (bytes, width, chain): Tools<'_>,
    answer: impl Fn(Chunk<'_>) -> Result<T, String> + Sync,
) -> PyResult<Vec<T>> {
    let mut found = Vec::new();
    for (block, bytes) in bytes.chunks(8 * width * chain * BLOCK).enumerate() {
        let poses = Poses::new(bytes, width, chain, block * BLOCK);
        let answers = py.detach(|| {
            let chunks = poses.chunks(CHUNK);
            // A single chunk needs no other core, and should not wait for one.
            match chunks.as_slice() {
                [chunk] => answer(*chunk).map(|answer| vec![answer]),
                chunks => chunks.par_iter().map(|chunk| answer(*chunk)).collect(),
            }
        });
        found.extend(answers.map_err(invalid)?);
        py.check_signals()?;
    }
    Ok(found)
}

/// Surfaces, and the budget of each pair of a tool and a surface.
///
/// The pairs are searched one by one: `Query::closest_in_scene` may skip a far tool only if the tools of a chain touch
/// each other, and requires that all surfaces have one index width and one origin.
struct Scene {
    surfaces: Vec<Py<Surface>>,
    budget: Budget,
}

impl Scene {
    fn new(surfaces: Vec<Py<Surface>>, tests: u32) -> Self {
        Self { surfaces, budget: Budget::new(tests) }
    }

    /// The surfaces with their indices.
    fn surfaces(&self) -> impl Iterator<Item = (usize, &Surface)> {
        self.surfaces.iter().map(Py::get).enumerate()
    }

    /// The record of each pose's closest pair.
    fn answer(&self, chunk: Chunk<'_>, is_signed: bool) -> Result<Vec<u8>, String> {
        let mut closest: Vec<Option<Closest>> = vec![None; chunk.len()];
        for (number, surface) in self.surfaces() {
            surface.closest(chunk, (self.budget, is_signed), |pose, tool, found| {
                let other = Closest { surface: number, tool, found };
                closest[pose] = Some(closest[pose].map_or(other, |best| best.or_closer(other)));
            })?;
        }
        let mut records = Vec::new();
        for Closest { surface, tool, found } in closest.into_iter().flatten() {
            let tree = &self.surfaces[surface].get().tree;
            push_answer(&mut records, &found, tree, [surface, tool]);
        }
        Ok(records)
    }

    /// The records of each pose's contacts, deepest first, its bound, and its accuracy.
    fn touch(
        &self,
        chunk: Chunk<'_>,
        (margin, label): (f32, Option<u8>),
    ) -> Result<[Vec<u8>; 3], String> {
        let mut all: Vec<(Vec<Contact>, f32, f32)> = vec![(Vec::new(), margin, 0.0); chunk.len()];
        for (number, surface) in self.surfaces() {
            surface.contacts(chunk, self.budget, (margin, label), |pose, tool, found| {
                let (contacts, bound, accuracy) = &mut all[pose];
                for contact in found.iter() {
                    let mut contact = *contact;
                    (contact.surface, contact.tool) = (number, tool);
                    contacts.push(contact);
                }
                *bound = bound.min(found.bound());
                *accuracy = accuracy.max(found.accuracy());
            })?;
        }
        let [mut records, mut bounds, mut accuracies] = [const { Vec::new() }; 3];
        for (pose, (mut contacts, bound, accuracy)) in (chunk.first()..).zip(all) {
            contacts.sort_by(|one, other| one.separation.total_cmp(&other.separation));
            for contact in &contacts {
                let tree = Arc::as_ref(&self.surfaces[contact.surface].get().tree);
                push_contact(&mut records, pose as u32, contact, tree);
            }
            bounds.extend(bound.to_le_bytes());
            accuracies.extend(accuracy.to_le_bytes());
        }
        Ok([records, bounds, accuracies])
    }
}

/// The closest pair of a pose so far. Interval, accuracy and tests cover all of its pairs.
#[derive(Clone, Copy)]
struct Closest {
    surface: usize,
    tool: usize,
    found: Proximity,
}

impl Closest {
    /// The closer of two pairs, or the first of equally close ones.
    fn or_closer(self, other: Self) -> Self {
        let (one, two) = (self.found, other.found);
        let mut closer = if two.separation < one.separation { other } else { self };
        closer.found.lower = one.lower.min(two.lower);
        closer.found.accuracy = one.accuracy.max(two.accuracy);
        closer.found.coverage = one.coverage.or_weaker(two.coverage);
        closer.found.node_tests = one.node_tests.saturating_add(two.node_tests);
        closer.found.triangle_tests = one.triangle_tests.saturating_add(two.triangle_tests);
        // If a budget ended before the side of one pair was known, that pair may be the deepest.
        let cut_short = Side::Undefined(NoSide::CutShort);
        if [one.side, two.side].contains(&cut_short) {
            closer.found.side = cut_short;
        }
        closer
    }
}
