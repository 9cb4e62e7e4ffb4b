//! Top-down construction: the triangles of each component become a tree of sections.

// Requirement: M-04

mod embedded;
mod paper;
mod pin;
mod section;
mod split;
#[cfg(test)]
mod tests;
mod widen;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use dibs_nostd::format::MAX_ROOTS;

use crate::components::connected_by_vertices;
use crate::error::BuildError;
use crate::leaf;
use pin::Pin;
pub(crate) use section::Surface;
use section::{Searches, Section};
pub(crate) use widen::widen;

/// How sections are pinned and split, and their radii measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Construction {
    /// Pin at the geodesic centre, paths over edges and chords inside the parent section, split by two far seeds.
    #[default]
    Geodesic,
    /// The paper's: mid-range pin, edge paths inside the section, split by a plane, orphans swapped,
    /// one triangle a leaf.
    Paper,
    /// The default, but with the paper's pin: for comparison.
    MidRangePin,
    /// The default, but split by the paper's plane: for comparison.
    PlaneSplit,
}

/// A node before it is flattened.
#[derive(Debug)]
pub(crate) struct Cluster {
    pub pin: u32,
    pub radius: f64,
    pub content: Content,
}

impl Cluster {
    /// Number of triangles below.
    pub fn triangles(&self) -> u32 {
        match &self.content {
            Content::Leaf(triangles) => triangles.len() as u32,
            Content::Inner(children) => children.iter().map(Self::triangles).sum(),
        }
    }
}

#[derive(Debug)]
pub(crate) enum Content {
    /// A binary tree after construction, except above the parts of a split leaf; more children after widening.
    Inner(Vec<Cluster>),
    /// Triangles that are connected by edges.
    Leaf(Vec<u32>),
}

/// The state shared by all steps of one construction.
pub(crate) struct Constructor<'a> {
    pub surface: Surface<'a>,
    pub construction: Construction,
    pub leaf_triangles: usize,
    /// Called with the number of triangles that reached their leaf.
    pub progress: &'a (dyn Fn(usize) + Sync),
    done: AtomicUsize,
    /// Arcs that searches looked at: the work done.
    work: AtomicUsize,
    /// Search memory that no thread is using.
    idle: Mutex<Vec<Searches>>,
}

/// From this depth on sections are halved, so that the tree is not deeper.
const MAX_DEPTH: u32 = 64;

/// Most arcs that searches may look at, for each triangle and level of a balanced tree: three times the number of a
/// closed surface. Only triangles that are connected at random, or share edges by the hundred, need more.
const MOST_ARCS: usize = 768;

/// The same where paths stay in their section: a closed surface needs a twentieth of this.
const MOST_ARCS_RESTRICTED: usize = 256;

/// Added to these limits, so that no small mesh is refused.
const MOST_ARCS_LEAST: usize = 4_000_000;

/// Sections of fewer triangles stay on one thread.
const PARALLEL_ABOVE: usize = 512;

impl<'a> Constructor<'a> {
    pub fn new(
        surface: Surface<'a>,
        construction: Construction,
        leaf_triangles: usize,
        progress: &'a (dyn Fn(usize) + Sync),
    ) -> Self {
        let (done, work) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let idle = Mutex::new(Vec::new());
        Self { surface, construction, leaf_triangles, progress, done, work, idle }
    }

    /// A tree for each component of the mesh, the largest first.
    pub fn run(&self) -> Result<Vec<Cluster>, BuildError> {
        let mesh = self.surface.mesh;
        let components = connected_by_vertices(&mesh.triangles);
        if components.len() > MAX_ROOTS as usize {
            return Err(BuildError::Components { components: components.len() });
        }
        let tree = |component: Vec<usize>| {
            let triangles = component.into_iter().map(|triangle| triangle as u32).collect();
            let section = Section::new(mesh, triangles);
            self.cluster(&section, None, section.vertices[0], 0)
        };
        let roots = components.into_iter().map(tree).collect::<Result<_, _>>()?;
        self.check_work().map(|()| roots)
    }

    /// The tree of a section. `around` is its parent section, the parent's sphere, and whether the parent is connected.
    fn cluster(
        &self,
        section: &Section,
        around: Option<(&Section, Pin, bool)>,
        start: u32,
        depth: u32,
    ) -> Result<Cluster, BuildError> {
        if let Some(paths) = self.surface.volume {
            return self.embedded(paths, section, depth);
        }
        self.check_work()?;
        let mut searches = self.take_searches();
        searches.enter(section, around.map(|(around, ..)| around));
        if let Some((.., false)) = around {
            searches.stay();
        }
        let mut pin = self.pin(section, &mut searches, start);
        let is_connected = pin.radius.is_finite();
        if let Some((_, whole, _)) = around
            && !is_connected
        {
            pin = whole;
        }
        if section.triangles.len() <= self.leaf_triangles {
            self.give_back(searches);
            return self.leaves(section, pin, is_connected, depth);
        }
        let sides = self.split(section, &mut searches, depth);
        let [left, right] = sides.map(|triangles| Section::new(self.surface.mesh, triangles));
        // A child's search starts at its vertex that is farthest from the child's seed: at its border.
        let borders = [(&left, 0), (&right, 1)].map(|(side, seed)| {
            let seen_from = &searches.seeds[seed];
            let by_distance = |a: &&u32, b: &&u32| {
                seen_from.get(**a).total_cmp(&seen_from.get(**b)).then(b.cmp(a))
            };
            side.vertices.iter().copied().max_by(|a, b| by_distance(&a, &b)).unwrap_or(pin.vertex)
        });
        self.give_back(searches);
        let big = section.triangles.len() > PARALLEL_ABOVE;
        let build_left =
            || self.cluster(&left, Some((section, pin, is_connected)), borders[0], depth + 1);
        let build_right =
            || self.cluster(&right, Some((section, pin, is_connected)), borders[1], depth + 1);
        let (left, right) =
            if big { rayon::join(build_left, build_right) } else { (build_left(), build_right()) };
        let content = Content::Inner(vec![left?, right?]);
        Ok(Cluster { pin: pin.vertex, radius: pin.radius, content })
    }

    /// One leaf; or several: one for each part that edges connect, and one for each triangle whose stretch measurement
    /// would be ill-conditioned in a common leaf.
    fn leaves(
        &self,
        section: &Section,
        pin: Pin,
        is_connected: bool,
        depth: u32,
    ) -> Result<Cluster, BuildError> {
        let mesh = self.surface.mesh;
        let mut parts = leaf::connected_by_edges(&mesh.triangles, &section.triangles);
        if let [whole] = &mut parts[..] {
            let apart = leaf::ill_conditioned(mesh, whole);
            if whole.len() > 1 && !apart.is_empty() {
                whole.retain(|triangle| !apart.contains(triangle));
                parts.extend(apart.into_iter().map(|triangle| vec![triangle]));
                parts.retain(|part| !part.is_empty());
            }
        }
        let content = if parts.len() == 1 {
            let count = section.triangles.len();
            (self.progress)(self.done.fetch_add(count, Ordering::Relaxed) + count);
            Content::Leaf(parts.remove(0))
        } else {
            let leaves = parts.into_iter().map(|part| {
                let part = Section::new(mesh, part);
                self.cluster(&part, Some((section, pin, is_connected)), part.vertices[0], depth + 1)
            });
            Content::Inner(leaves.collect::<Result<_, _>>()?)
        };
        Ok(Cluster { pin: pin.vertex, radius: pin.radius, content })
    }

    fn pin(&self, section: &Section, searches: &mut Searches, start: u32) -> Pin {
        match self.construction {
            Construction::Paper => paper::mid_range_pin(&self.surface, section, searches),
            construction => {
                // This also leaves the distances from the split's seeds in `searches`.
                let centre = pin::geodesic_centre(&self.surface, section, searches, start);
                match construction {
                    Construction::MidRangePin => {
                        paper::mid_range_pin(&self.surface, section, searches)
                    }
                    _ => centre,
                }
            }
        }
    }

    fn split(&self, section: &Section, searches: &mut Searches, depth: u32) -> [Vec<u32>; 2] {
        let halvings = section.triangles.len().ilog2() + 1;
        let even = depth + halvings >= MAX_DEPTH - 1;
        match self.construction {
            Construction::Geodesic | Construction::MidRangePin => {
                split::by_geodesic(&self.surface, section, searches, even)
            }
            Construction::Paper | Construction::PlaneSplit => {
                paper::split(&self.surface, section, even)
            }
        }
    }

    /// Fails once all searches together have looked at too many arcs; when does not depend on the threads.
    fn check_work(&self) -> Result<(), BuildError> {
        let triangles = self.surface.mesh.triangles.len();
        let levels = triangles.max(2).ilog2() as usize + 1;
        let most = if self.surface.restricted { MOST_ARCS_RESTRICTED } else { MOST_ARCS };
        let most = triangles.saturating_mul(most * levels).saturating_add(MOST_ARCS_LEAST);
        if self.work.load(Ordering::Relaxed) > most {
            return Err(BuildError::Tangled { triangles });
        }
        Ok(())
    }

    fn take_searches(&self) -> Searches {
        let idle = self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner).pop();
        idle.unwrap_or_else(|| Searches::new(self.surface.graph.vertices()))
    }

    fn give_back(&self, mut searches: Searches) {
        self.work.fetch_add(searches.take_arcs_seen(), Ordering::Relaxed);
        self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(searches);
    }
}
