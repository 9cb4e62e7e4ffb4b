//! The surface at one moment, and queries on it.

use std::sync::Arc;

use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::{Capsule, Contacts, Index, MeasuredStretch, Options, Query, Sphere, Tool, Tree};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use rayon::prelude::*;

use crate::record::{push_answer, push_contact};
use crate::tree::{Owned, of_any_width};
use crate::{bytes, invalid};

/// As much as any tree needs, and more than one: batches of subtrees take 128 more entries.
const STACK: usize = dibs_nostd::format::MAX_STACK;

/// Contacts of a pose that are listed.
pub const MOST_CONTACTS: usize = 64;

/// Poses that one query object answers.
const CHUNK: usize = 128;

/// Poses between two looks for an interrupt.
const BLOCK: usize = 1 << 16;

/// A tree, and where its vertices are.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Surface {
    pub tree: Arc<Owned>,
    pub rows: Vec<Vec3>,
    /// `None` where the tree has no rest metric to measure with.
    pub stretch: Option<MeasuredStretch>,
}

/// Bytes of records for each pose of a chunk, or the first pose that is wrong.
type Answered = Result<Vec<u8>, String>;

#[pymethods]
impl Surface {
    fn stretch(&self) -> Option<f32> {
        self.stretch.map(|measured| measured.sigma())
    }

    /// The closest pair of each tool, of four or seven numbers.
    fn query<'py>(
        &self,
        py: Python<'py>,
        tools: &[u8],
        numbers: usize,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let found = self.in_blocks(
            py,
            tools,
            numbers,
            |first, chunk| of_any_width!(self.tree.view(), tree => self.answer(tree, first, chunk)),
        )?;
        Ok(PyByteArray::new(py, &found.concat()))
    }

    /// The contacts of each tool, and for each tool the bound below which all are listed.
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        tools: &[u8],
        numbers: usize,
        margin: f32,
    ) -> PyResult<[Bound<'py, PyByteArray>; 2]> {
        let found = self.in_blocks(py, tools, numbers, |first, chunk| {
            of_any_width!(self.tree.view(), tree => self.touch(tree, first, chunk, margin))
        })?;
        let (records, bounds): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        Ok([records, bounds].map(|bytes| PyByteArray::new(py, &bytes.concat())))
    }
}

impl Surface {
    /// Answers chunks of tools on all cores, without Python's lock.
    fn in_blocks<T: Send>(
        &self,
        py: Python<'_>,
        tools: &[u8],
        numbers: usize,
        answer: impl Fn(usize, &[AnyTool]) -> Result<T, String> + Sync,
    ) -> PyResult<Vec<T>> {
        let mut found = Vec::new();
        for (block, tools) in tools.chunks(8 * numbers * BLOCK).enumerate() {
            let first = block * BLOCK;
            let answers = py.detach(|| {
                let tools = self.tools(first, tools, numbers)?;
                // A single chunk needs no other core, and should not wait for one.
                if tools.len() <= CHUNK {
                    return Ok(vec![answer(first, &tools)?]);
                }
                let chunks = tools.par_chunks(CHUNK).enumerate();
                chunks.map(|(number, chunk)| answer(first + number * CHUNK, chunk)).collect()
            });
            found.extend(answers.map_err(|error: String| invalid(error))?);
            py.check_signals()?;
        }
        Ok(found)
    }

    fn tools(&self, first: usize, bytes: &[u8], numbers: usize) -> Result<Vec<AnyTool>, String> {
        let numbers_of_all = bytes::doubles(bytes);
        let tool = |(number, numbers): (usize, &[f64])| {
            AnyTool::of(numbers, self.tree.origin)
                .map_err(|error| format!("tools: row {number}: {error}"))
        };
        (first..).zip(numbers_of_all.chunks_exact(numbers)).map(tool).collect()
    }

    fn options(&self) -> Options {
        match self.stretch {
            Some(measured) => Options::cold().stretch(measured),
            None => Options::cold(),
        }
    }

    fn answer<I: Index>(&self, tree: &Tree<'_, I>, first: usize, tools: &[AnyTool]) -> Answered {
        let mut query = Query::<I, STACK>::new(tree).map_err(|error| error.to_string())?;
        let (rows, options) = (self.rows.as_slice(), self.options());
        let mut records = Vec::new();
        for (number, tool) in (first..).zip(tools) {
            let found = match tool {
                AnyTool::Sphere(sphere) => query.closest_wide(rows, sphere, &options),
                AnyTool::Capsule(capsule) => query.closest_wide(rows, capsule, &options),
            };
            let found = found.map_err(|error| format!("tools: row {number}: {error}"))?;
            push_answer(&mut records, &found, &self.tree);
        }
        Ok(records)
    }

    fn touch<I: Index>(
        &self,
        tree: &Tree<'_, I>,
        first: usize,
        tools: &[AnyTool],
        margin: f32,
    ) -> Result<(Vec<u8>, Vec<u8>), String> {
        let mut query = Query::<I, STACK>::new(tree).map_err(|error| error.to_string())?;
        let mut contacts = Box::new(Contacts::<MOST_CONTACTS, 16_384>::new());
        let (mut records, mut bounds) = (Vec::new(), Vec::new());
        for (number, tool) in (first..).zip(tools) {
            match tool {
                AnyTool::Sphere(tool) => self.touch_one(&mut query, tool, margin, &mut contacts),
                AnyTool::Capsule(tool) => self.touch_one(&mut query, tool, margin, &mut contacts),
            }
            .map_err(|error| format!("tools: row {number}: {error}"))?;
            for contact in contacts.iter() {
                push_contact(&mut records, number as u32, contact, &self.tree);
            }
            bounds.extend(contacts.bound().to_le_bytes());
        }
        Ok((records, bounds))
    }

    fn touch_one<I: Index>(
        &self,
        query: &mut Query<'_, I, STACK>,
        tool: &impl Tool,
        margin: f32,
        contacts: &mut Contacts<MOST_CONTACTS, 16_384>,
    ) -> Result<(), dibs_nostd::QueryError> {
        query.contacts(self.rows.as_slice(), tool, margin, &self.options(), contacts).map(drop)
    }
}

/// A tool in the coordinates of a tree.
enum AnyTool {
    Sphere(Sphere),
    Capsule(Capsule),
}

impl AnyTool {
    /// Four numbers are a sphere, seven a capsule, in the coordinates of the mesh's file.
    fn of(numbers: &[f64], origin: DVec3) -> Result<Self, String> {
        let local = |at: usize| (DVec3::from_slice(&numbers[at..]) - origin).as_vec3();
        let tool = match numbers.len() {
            4 => Sphere::new(local(0), numbers[3] as f32).map(Self::Sphere),
            7 => Capsule::new(local(0), local(3), numbers[6] as f32).map(Self::Capsule),
            count => return Err(format!("{count} numbers are no tool")),
        };
        tool.map_err(|error| error.to_string())
    }
}
