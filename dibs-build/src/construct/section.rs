//! A section: the triangles below one node, and the searches that measure it.

// Requirement: A-02

use crate::Mesh;
use crate::geodesic::{Distances, Farthest, Graph};
use crate::nodes::VolumePaths;

/// The triangles below one node, and their vertices in ascending order.
#[derive(Debug)]
pub(crate) struct Section {
    pub triangles: Vec<u32>,
    pub vertices: Vec<u32>,
}

impl Section {
    pub fn new(mesh: &Mesh, triangles: Vec<u32>) -> Self {
        let corners = triangles.iter().flat_map(|&t| mesh.triangles[t as usize]);
        let mut vertices: Vec<u32> = corners.collect();
        vertices.sort_unstable();
        vertices.dedup();
        Self { triangles, vertices }
    }
}

/// The surface, shared by all sections of one build.
pub(crate) struct Surface<'a> {
    pub mesh: &'a Mesh,
    pub graph: &'a Graph,
    /// Whether paths must stay inside the section (the paper) or may leave it.
    pub restricted: bool,
    /// The paths through the volume that moves the surface, used instead of those along it.
    pub volume: Option<&'a VolumePaths<'a>>,
}

/// Most arcs, for each vertex of a section, that a search may look at for paths outside the parent section. A section
/// whose parts only meet farther off keeps its parent's sphere: where triangles are connected at random, most sections
/// are of that kind, and each would search the whole mesh.
const ROUNDABOUT: usize = 256;
const ROUNDABOUT_LEAST: usize = 4096;

/// Memory of one thread's searches.
#[derive(Debug)]
pub(crate) struct Searches {
    members: Members,
    /// Distances from the two far seeds of a split.
    pub seeds: [Distances; 2],
    /// Distances from any other source.
    pub other: Distances,
}

/// The section that is searched, and its parent.
#[derive(Debug)]
struct Members {
    /// The latest section or parent, by number, in which each vertex was found.
    latest: Vec<u32>,
    section: u32,
    /// The parent's number; zero for the whole mesh.
    around: u32,
    /// The vertices of the section and of its parent, in ascending order.
    lists: [Vec<u32>; 2],
    /// Whether a search may leave the parent section.
    may_leave: bool,
}

impl Searches {
    pub fn new(vertices: usize) -> Self {
        Self {
            members: Members {
                latest: vec![0; vertices],
                section: 0,
                around: 0,
                lists: Default::default(),
                may_leave: true,
            },
            seeds: [Distances::new(vertices), Distances::new(vertices)],
            other: Distances::new(vertices),
        }
    }

    /// Arcs that the searches with this memory looked at since the last call.
    pub fn take_arcs_seen(&mut self) -> usize {
        self.seeds.iter_mut().chain([&mut self.other]).map(Distances::take_arcs_seen).sum()
    }

    /// Makes `section` the target of searches. Paths stay in the parent section `around` if that is connected: paths
    /// outside it are hardly ever shorter, and take more than half of a search's time.
    pub fn enter(&mut self, section: &Section, around: Option<&Section>) {
        let members = &mut self.members;
        members.may_leave = true;
        members.section += 2;
        members.around = if around.is_some() { members.section - 1 } else { 0 };
        let [inside, outside] = &mut members.lists;
        inside.clone_from(&section.vertices);
        outside.clear();
        outside.extend(around.iter().flat_map(|around| &around.vertices));
        for &v in around.iter().flat_map(|around| &around.vertices) {
            members.latest[v as usize] = members.around;
        }
        for &v in &section.vertices {
            members.latest[v as usize] = members.section;
        }
    }

    /// From now on searches of the entered section stay in its parent.
    pub fn stay(&mut self) {
        self.members.may_leave = false;
    }

    /// Writes the distances from `source` to every vertex of the entered section to one of `seeds`.
    pub fn search_seed(
        &mut self,
        seed: usize,
        surface: &Surface<'_>,
        section: &Section,
        source: u32,
    ) -> Farthest {
        self.members.search(&mut self.seeds[seed], surface, section, source)
    }

    /// Writes the distances from `source` to every vertex of the entered section to `other`.
    pub fn search_other(
        &mut self,
        surface: &Surface<'_>,
        section: &Section,
        source: u32,
    ) -> Farthest {
        self.members.search(&mut self.other, surface, section, source)
    }
}

impl Members {
    fn search(
        &self,
        distances: &mut Distances,
        surface: &Surface<'_>,
        section: &Section,
        source: u32,
    ) -> Farthest {
        let latest = |v: u32| self.latest[v as usize];
        let wanted = section.vertices.len();
        let mut search = |least: u32, only: Option<&[u32]>, most| {
            let graph = surface.graph;
            let is_wanted = |v| latest(v) == self.section;
            distances.search(graph, source, wanted, is_wanted, |v| latest(v) >= least, only, most)
        };
        if surface.restricted {
            return search(self.section, Some(&self.lists[0]), usize::MAX);
        }
        if self.around == 0 {
            return search(0, None, usize::MAX);
        }
        let farthest = search(self.around, Some(&self.lists[1]), usize::MAX);
        if farthest.reached == wanted || !self.may_leave {
            return farthest;
        }
        search(0, None, ROUNDABOUT * wanted + ROUNDABOUT_LEAST)
    }
}
