//! A section: the triangles below one node, and the searches that measure it.

use crate::Mesh;
use crate::geodesic::{Distances, Farthest, Graph};

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

/// What all sections of one build share.
#[derive(Debug)]
pub(crate) struct Surface<'a> {
    pub mesh: &'a Mesh,
    pub graph: &'a Graph,
    /// Whether paths must stay inside the section (the paper) or may use the whole mesh.
    pub restricted: bool,
}

/// Memory of one thread's searches.
#[derive(Debug)]
pub(crate) struct Searches {
    member: Vec<u32>,
    stamp: u32,
    /// Distances from the two far seeds.
    pub seeds: [Distances; 2],
    /// Distances from whatever else is asked.
    pub other: Distances,
}

impl Searches {
    pub fn new(vertices: usize) -> Self {
        Self {
            member: vec![0; vertices],
            stamp: 0,
            seeds: [Distances::new(vertices), Distances::new(vertices)],
            other: Distances::new(vertices),
        }
    }

    /// Makes `section` the one that searches are for.
    pub fn enter(&mut self, section: &Section) {
        self.stamp += 1;
        for &v in &section.vertices {
            self.member[v as usize] = self.stamp;
        }
    }

    /// Distances from `source` to every vertex of the section that was entered, into one of `seeds`.
    pub fn search_seed(
        &mut self,
        seed: usize,
        surface: &Surface<'_>,
        section: &Section,
        source: u32,
    ) -> Farthest {
        let (member, stamp) = (&self.member, self.stamp);
        search(&mut self.seeds[seed], surface, section, source, |v| member[v as usize] == stamp)
    }

    /// Distances from `source` to every vertex of the section that was entered, into `other`.
    pub fn search_other(
        &mut self,
        surface: &Surface<'_>,
        section: &Section,
        source: u32,
    ) -> Farthest {
        let (member, stamp) = (&self.member, self.stamp);
        search(&mut self.other, surface, section, source, |v| member[v as usize] == stamp)
    }
}

fn search(
    distances: &mut Distances,
    surface: &Surface<'_>,
    section: &Section,
    source: u32,
    is_member: impl Fn(u32) -> bool,
) -> Farthest {
    let allowed = |v| !surface.restricted || is_member(v);
    distances.search(surface.graph, source, section.vertices.len(), &is_member, allowed)
}
