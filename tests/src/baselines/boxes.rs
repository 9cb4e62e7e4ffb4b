//! The common part of trees of boxes: rows in the order of the leaves, and one search that visits the near child first.

use std::ops::Range;

use dibs_build::Mesh;
use glam::{Vec3, Vec3A};

use super::bounds::Axis;
use crate::method::{Found, Probe};

/// A node of a tree of boxes, whose children are adjacent.
#[derive(Clone, Debug)]
pub enum Node {
    /// The first of two children.
    Inner(u32),
    /// The triangles of a leaf.
    Leaf(Range<usize>),
}

/// A tree of boxes.
pub trait BoxTree {
    /// A node whose children's boxes are up to date.
    fn node(&mut self, node: u32) -> Node;

    /// A node's box: its lowest and highest corner.
    fn bounds(&self, node: u32) -> [Vec3A; 2];

    /// The corners of a triangle.
    fn corners(&self, triangle: usize) -> [Vec3; 3];
}

/// The start of a search, updated with the triangle that it finds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// No earlier answer.
    #[default]
    Cold,
    /// A warm start from the triangle of the last answer, if there is one.
    Last(Option<usize>),
}

/// The closest pair of a tool of either kind; updates the start for the next search.
#[inline(always)]
pub fn closest_to<T: BoxTree, const STACK: usize>(
    tree: &mut T,
    tool: &Probe,
    mut start: Start,
) -> (Found, Start) {
    let found = match tool {
        Probe::Sphere(sphere) => closest::<_, _, STACK>(tree, sphere, &mut start),
        Probe::Capsule(capsule) => closest::<_, _, STACK>(tree, capsule, &mut start),
    };
    (found, start)
}

/// The closest pair. `STACK` must be at least the tree's depth.
#[inline(always)]
pub fn closest<A: Axis, T: BoxTree, const STACK: usize>(
    tree: &mut T,
    tool: &A,
    start: &mut Start,
) -> Found {
    let axis = tool.prepare();
    let mut best = f32::INFINITY;
    let (mut node_tests, mut triangle_tests) = (1, 0);
    if let Start::Last(Some(triangle)) = *start {
        triangle_tests += 1;
        if let Some(pair) = tool.closest_on_triangle(&tree.corners(triangle), best) {
            best = pair.distance_squared;
        }
    }
    let mut stack = [(0.0_f32, 0_u32); STACK];
    let mut waiting = 0;
    let mut node = 0_u32;
    loop {
        match tree.node(node) {
            Node::Inner(first) => {
                node_tests += 2;
                let [left, right] = [first, first + 1].map(|child| {
                    let [low, high] = tree.bounds(child);
                    A::bound(&axis, low, high, best)
                });
                let right_first = right < left;
                let (near, far) = if right_first { (right, left) } else { (left, right) };
                let side = u32::from(right_first);
                if far < best {
                    stack[waiting] = (far, first + (side ^ 1));
                    waiting += 1;
                }
                if near < best {
                    node = first + side;
                    continue;
                }
            }
            Node::Leaf(triangles) => {
                for triangle in triangles {
                    triangle_tests += 1;
                    if let Some(pair) = tool.closest_on_triangle(&tree.corners(triangle), best) {
                        best = pair.distance_squared;
                        if let Start::Last(last) = start {
                            *last = Some(triangle);
                        }
                    }
                }
            }
        }
        loop {
            if waiting == 0 {
                let separation = (best.sqrt() - tool.radius()).max(0.0);
                return Found { separation, tests: Some([node_tests, triangle_tests]) };
            }
            waiting -= 1;
            let (lower, next) = stack[waiting];
            if lower < best {
                node = next;
                break;
            }
        }
    }
}

/// Triangles in the order of the leaves, and vertices in the order of their first use there.
#[derive(Clone, Debug)]
pub struct Rows {
    triangles: Vec<[u32; 3]>,
    order: Vec<u32>,
    positions: Vec<Vec3A>,
}

impl Rows {
    /// The mesh's triangles in the order of `items`.
    #[must_use]
    pub fn new(mesh: &Mesh, items: &[u32]) -> Self {
        let mut row = vec![u32::MAX; mesh.positions.len()];
        let mut order = Vec::with_capacity(mesh.positions.len());
        let triangles = items.iter().map(|&item| {
            mesh.triangles[item as usize].map(|vertex| {
                let row = &mut row[vertex as usize];
                if *row == u32::MAX {
                    *row = order.len() as u32;
                    order.push(vertex);
                }
                *row
            })
        });
        Self { triangles: triangles.collect(), order, positions: Vec::new() }
    }

    /// Loads positions in the mesh's order.
    pub fn load(&mut self, positions: &[Vec3]) {
        self.positions.clear();
        self.positions.extend(self.order.iter().map(|&v| Vec3A::from(positions[v as usize])));
    }

    /// The positions by row.
    #[must_use]
    pub fn positions(&self) -> &[Vec3A] {
        &self.positions
    }

    /// The positions by row, for writing.
    pub fn positions_mut(&mut self) -> &mut [Vec3A] {
        &mut self.positions
    }

    /// The mesh vertex of a row.
    #[must_use]
    pub fn vertex(&self, row: usize) -> u32 {
        self.order[row]
    }

    /// Exchanges the positions by row for others; if those are of another mesh, for zeros.
    pub fn swap(&mut self, positions: &mut Vec<Vec3A>) {
        positions.resize(self.order.len(), Vec3A::ZERO);
        std::mem::swap(&mut self.positions, positions);
    }

    /// The rows of a triangle's corners.
    #[inline(always)]
    #[must_use]
    pub fn triangle(&self, triangle: usize) -> [u32; 3] {
        self.triangles[triangle]
    }

    /// The corners of a triangle.
    #[inline(always)]
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| Vec3::from(self.positions[v as usize]))
    }

    /// The vertices of some triangles, without duplicates, in ascending order.
    #[must_use]
    pub fn vertices(&self, triangles: Range<usize>) -> Vec<u32> {
        each_once(self.triangles[triangles].iter().flatten().copied().collect())
    }
}

/// Sorts the numbers, and removes duplicates.
#[must_use]
pub fn each_once(mut numbers: Vec<u32>) -> Vec<u32> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
