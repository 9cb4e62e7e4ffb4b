//! The surfaces of a query with their positions, and the closest pair between them and a chain of tools.

use super::answer::{Answer, Touch};
use crate::mesh_file::Lengths;
use crate::tool::{LocalTool, ToolSpec};
use crate::tree_file::{self, AnyTree};
use anyhow::{Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_build::{FrameCheck, SurfaceRows, largest_stretch};
use dibs_nostd::{
    Contact, Contacts, Coverage, Index, MeasuredStretch, Options, Proximity, Query, StretchError,
    Tool, Tree,
};
use std::path::{Path, PathBuf};

/// Enough for any tree.
pub const STACK: usize = dibs_nostd::format::MAX_STACK;

/// What to do about a frame that is stretched beyond the tree's limit.
pub const ALLOW: &str = "build the tree with a larger --stretch, or with --limits that allow it";

/// A tree, and the positions of its vertices.
pub struct Surface<'a> {
    pub name: String,
    tree: AnyTree<'a>,
    /// Rows in the tree's order.
    rows: SurfaceRows,
    /// `None` if the tree has no rest metric to measure it with.
    stretch: Option<f64>,
    options: Options,
}

impl<'a> Surface<'a> {
    /// The surface of a tree file, at rest if no `vertices` are given, stretched by at most `limit`.
    pub fn new(
        bytes: &'a [u8],
        path: &'a Path,
        vertices: Option<&PathBuf>,
        frame: Option<usize>,
        lengths: &Lengths,
        limit: Option<f32>,
    ) -> Result<Self> {
        let tree = tree_file::validate(bytes, path)?;
        let name = path.display();
        // What a refused surface is called: the tree's file at rest, otherwise the file of its positions.
        let shown = match (vertices, frame) {
            (None, _) => name.to_string(),
            (Some(path), None) => path.display().to_string(),
            (Some(path), Some(frame)) => format!("{}, frame {frame}", path.display()),
        };
        let (rows, measured) = match &tree {
            AnyTree::Narrow(tree) => measured(tree, path, vertices, frame, lengths, &shown)?,
            AnyTree::Wide(tree) => measured(tree, path, vertices, frame, lengths, &shown)?,
        };
        let largest = match &tree {
            AnyTree::Narrow(tree) => largest_stretch(tree, rows.frame()),
            AnyTree::Wide(tree) => largest_stretch(tree, rows.frame()),
        };
        // Without a rest shape only the factor for radii is known, which is at least as large.
        let stretch = measured.map(|measured| largest.unwrap_or(measured.sigma().into()));
        let mut options = Options::cold();
        if let Some(limit) = limit {
            let (Some(measured), Some(sigma)) = (measured, stretch) else {
                bail!("{name}: no rest metric to measure a stretch with");
            };
            // The measurement's own rounding is allowed.
            if sigma > f64::from(limit) * (1.0 + 1e-5) || limit.is_nan() {
                bail!(
                    "{shown}: the surface is stretched by {sigma}, more than the {limit} of --stretch"
                );
            }
            options = options.stretch(measured);
        }
        Ok(Self { name: name.to_string(), tree, rows, stretch, options })
    }

    /// The surface of a tree at a frame in the mesh's order, or of its nodes.
    pub fn of_frame(tree: AnyTree<'a>, name: &str, frame: &[Vec3]) -> Result<Self> {
        let of = |error| anyhow!("{name}: {error}");
        let (rows, largest, measured) = match &tree {
            AnyTree::Narrow(tree) => framed(tree, frame).map_err(of)?,
            AnyTree::Wide(tree) => framed(tree, frame).map_err(of)?,
        };
        let stretch = measured.map(|measured| largest.unwrap_or(measured.sigma().into()));
        Ok(Self { name: name.to_owned(), tree, rows, stretch, options: Options::cold() })
    }

    fn ask(&self, tool: &ToolSpec, margin: Option<f32>, room: &mut Room) -> Result<ToolResult> {
        let tool = tool.local(self.tree.origin());
        tool.and_then(|tool| match &self.tree {
            AnyTree::Narrow(tree) => self.ask_tree(tree, tool, margin, room),
            AnyTree::Wide(tree) => self.ask_tree(tree, tool, margin, room),
        })
        .map_err(|error| anyhow!("{}: {error}", self.name))
    }

    fn ask_tree<I: Index>(
        &self,
        tree: &Tree<'_, I>,
        tool: LocalTool,
        margin: Option<f32>,
        room: &mut Room,
    ) -> Result<ToolResult> {
        let mut found = match tool {
            LocalTool::Sphere(sphere) => self.closest(tree, &sphere, margin, room)?,
            LocalTool::Capsule(capsule) => self.closest(tree, &capsule, margin, room)?,
        };
        // The stretch is within the limit: otherwise the surface was refused before.
        if self.stretch.is_some() {
            found.proximity.coverage = Coverage::Measured;
        }
        let vertex = |row| tree.vertex_number(row).map_or(row, |vertex| vertex.0);
        found.triangle = found.proximity.corners.map(vertex);
        found.triangles =
            found.contacts.iter().map(|contact| contact.corners.map(vertex)).collect();
        Ok(found)
    }

    fn closest<I: Index>(
        &self,
        tree: &Tree<'_, I>,
        tool: &impl Tool,
        margin: Option<f32>,
        room: &mut Room,
    ) -> Result<ToolResult> {
        let positions = &self.rows;
        let mut query = Query::<I, STACK>::new(tree)?;
        let Some(margin) = margin else {
            return Ok(ToolResult::new(query.closest(positions, tool, &self.options)?));
        };
        let contacts = room.list();
        let closest = query.contacts(positions, tool, margin, &self.options, contacts)?;
        let bound = contacts.bound();
        Ok(ToolResult {
            contacts: contacts.iter().copied().collect(),
            bound,
            ..ToolResult::new(closest)
        })
    }
}

type List = Contacts<64, 16_384>;

/// Memory for the contacts of a pair, allocated when first needed: half a megabyte, for any number of poses.
#[derive(Default)]
pub struct Room(Option<Box<List>>);

impl Room {
    fn list(&mut self) -> &mut List {
        /// A separate function, since the list is built on the stack: the caller's frame must not keep room for it when
        /// work is split.
        #[inline(never)]
        fn empty() -> Box<List> {
            Box::new(List::new())
        }
        self.0.get_or_insert_with(empty)
    }
}

/// The result for one tool and one surface.
struct ToolResult {
    proximity: Proximity,
    /// Corners of its triangle, numbered as in the mesh file.
    triangle: [u32; 3],
    contacts: Vec<Contact>,
    /// The triangle of each contact.
    triangles: Vec<[u32; 3]>,
    /// Every contact with a separation below this is listed.
    bound: f32,
}

impl ToolResult {
    fn new(proximity: Proximity) -> Self {
        let (contacts, triangles) = (Vec::new(), Vec::new());
        Self { proximity, triangle: [0; 3], contacts, triangles, bound: f32::INFINITY }
    }
}

/// The closest of all pairs of a tool and a surface; with a margin also all contacts, nearest first.
///
/// The pairs are searched one by one: `Query::closest_in_scene` may skip a far tool only if the tools of a chain touch
/// each other, and requires that all surfaces have one index width and one origin.
pub fn ask<'a>(
    surfaces: &'a [Surface<'a>],
    tools: &[ToolSpec],
    margin: Option<f32>,
    room: &mut Room,
) -> Result<Answer<'a>> {
    let mut best: Option<Answer<'a>> = None;
    let (mut touches, mut bound) = (Vec::new(), f32::INFINITY);
    // Interval, accuracy, coverage and tests cover all pairs.
    let mut coverage = Coverage::Measured;
    let (mut lower, mut accuracy, mut node_tests, mut triangle_tests) =
        (f32::INFINITY, 0_f32, 0, 0);
    for surface in surfaces {
        for (number, tool) in tools.iter().enumerate() {
            let found = surface.ask(tool, margin, room)?;
            bound = bound.min(found.bound);
            let contacts = found.contacts.into_iter().zip(found.triangles);
            touches.extend(contacts.map(|(contact, triangle)| Touch {
                contact,
                triangle,
                label: surface.tree.label(contact.triangle),
                origin: surface.tree.origin(),
                tree: &surface.name,
                tool: number,
            }));
            let Proximity { separation, .. } = found.proximity;
            lower = lower.min(found.proximity.lower);
            accuracy = accuracy.max(found.proximity.accuracy);
            coverage = coverage.or_weaker(found.proximity.coverage);
            node_tests += found.proximity.node_tests;
            triangle_tests += found.proximity.triangle_tests;
            if best.as_ref().is_none_or(|best| separation < best.proximity.separation) {
                let label = found.proximity.triangle.and_then(|row| surface.tree.label(row));
                best = Some(Answer {
                    proximity: found.proximity,
                    triangle: found.triangle,
                    label,
                    origin: surface.tree.origin(),
                    tree: &surface.name,
                    tool: number,
                    stretch: surface.stretch,
                    contacts: None,
                    bound,
                });
            }
        }
    }
    let mut answer = best.ok_or_else(|| anyhow!("no tool"))?;
    let closest = &mut answer.proximity;
    (closest.lower, closest.accuracy, closest.coverage) = (lower, accuracy, coverage);
    (closest.node_tests, closest.triangle_tests) = (node_tests, triangle_tests);
    if margin.is_some() {
        touches.sort_by(|a, b| a.contact.separation.total_cmp(&b.contact.separation));
        (answer.contacts, answer.bound) = (Some(touches), bound);
    }
    Ok(answer)
}

/// The positions of a tree's rows, and the measured stretch.
fn measured<I: Index>(
    tree: &Tree<'_, I>,
    path: &Path,
    vertices: Option<&PathBuf>,
    frame: Option<usize>,
    lengths: &Lengths,
    shown: &str,
) -> Result<(SurfaceRows, Option<MeasuredStretch>)> {
    let name = path.display();
    let frame = match vertices {
        None => SurfaceRows::rest_frame(tree)
            .ok_or_else(|| anyhow!("{name}: the tree has no rest shape, give --vertices"))?,
        Some(path) => current(tree, path, frame, lengths)?,
    };
    let rows = SurfaceRows::of(tree, frame).map_err(|error| anyhow!("{name}: {error}"))?;
    let measured = within_limit(tree, &rows).map_err(|error| anyhow!("{shown}: {error}"))?;
    Ok((rows, measured))
}

/// The measured stretch; `None` if the tree has no rest metric to measure it with. Beyond the stretch limit a distance
/// could be wrong, so the surface is refused.
fn within_limit<I: Index>(
    tree: &Tree<'_, I>,
    rows: &SurfaceRows,
) -> Result<Option<MeasuredStretch>> {
    match rows.stretch {
        Ok(measured) => Ok(Some(measured)),
        Err(StretchError::NoMetric) => Ok(None),
        Err(error) => bail!(SurfaceRows::refusal(tree, error, ALLOW)),
    }
}

/// The rows of a frame in the mesh's order, the largest stretch of a triangle, and the measured stretch.
fn framed<I: Index>(
    tree: &Tree<'_, I>,
    frame: &[Vec3],
) -> Result<(SurfaceRows, Option<f64>, Option<MeasuredStretch>)> {
    let rows = SurfaceRows::of(tree, FrameCheck::of(tree).to_rows(frame)?)?;
    let largest = largest_stretch(tree, rows.frame());
    let measured = within_limit(tree, &rows)?;
    Ok((rows, largest, measured))
}

/// Positions in the order of the tree's rows, relative to its origin.
fn current<I: Index>(
    tree: &Tree<'_, I>,
    path: &Path,
    frame: Option<usize>,
    lengths: &Lengths,
) -> Result<Vec<Vec3>> {
    let name = path.display();
    let origin = tree.origin().into();
    let is_motion = name.to_string().contains('%')
        || path
            .extension()
            .is_some_and(|e| ["pc2", "npy"].iter().any(|m| e.eq_ignore_ascii_case(m)));
    match (is_motion, frame) {
        (true, None) => bail!("{name}: choose a frame of the motion with --frame"),
        (true, Some(frame)) => {
            let mut frames = lengths.motion_of(tree, path)?.frames;
            if frame >= frames.len() {
                bail!("{name}: no frame {frame}, the motion has {}", frames.len());
            }
            rows(tree, path, frame, &frames.swap_remove(frame))
        }
        (false, Some(_)) => {
            bail!("{name}: --frame needs a motion: .pc2, .npy or a series heart_%03d.ply")
        }
        (false, None) => Ok(FrameCheck::of(tree).read(path, lengths.unit(), origin)?),
    }
}

/// Reorders the positions of a motion's frame into the tree's rows.
pub fn rows<I: Index>(
    tree: &Tree<'_, I>,
    path: &Path,
    frame: usize,
    of_mesh: &[Vec3],
) -> Result<Vec<Vec3>> {
    let rows = FrameCheck::of(tree).to_rows(of_mesh);
    rows.map_err(|error| anyhow!("{}, frame {frame}: {error}", path.display()))
}
