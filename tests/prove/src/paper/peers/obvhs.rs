//! obvhs 0.4: its tree, its `refit_all`, and an exact closest-point traversal of its nodes (it has
//! none itself), with the kernels and bounds that our own baselines use.

use std::time::Duration;

use dibs_build::Mesh;
use dibs_tests::baselines::bounds::Axis;
use dibs_tests::method::{Found, Method, Probe};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;

/// Deeper than any tree of the meshes used; checked.
const STACK: usize = 128;

pub struct Obvhs {
    tree: Bvh2,
    /// In the order of the tree's primitives, by rows of `positions`.
    triangles: Vec<[u32; 3]>,
    order: Vec<u32>,
    positions: Vec<Vec3A>,
    leaves: Vec<u32>,
    /// The vertices of each leaf, each once, and where each leaf's end.
    leaf_vertices: Vec<u32>,
    leaf_end: Vec<u32>,
}

impl Obvhs {
    pub fn new(mesh: &Mesh) -> Self {
        let at = |v: u32| Vec3A::from(mesh.positions[v as usize]);
        let soup: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: at(a), v1: at(b), v2: at(c) })
            .collect();
        // Splitting triangles is for rays: it puts one triangle into several leaves.
        let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() };
        let mut tree = build_bvh2_from_tris(&soup, parameters, &mut Duration::default());
        tree.reorder_in_stack_traversal_order();
        assert!(tree.children_are_ordered_after_parents && tree.max_depth <= STACK);

        let mut row = vec![u32::MAX; mesh.positions.len()];
        let mut order = Vec::new();
        let triangles = tree.primitive_indices.iter().map(|&primitive| {
            mesh.triangles[primitive as usize].map(|vertex| {
                let row = &mut row[vertex as usize];
                if *row == u32::MAX {
                    *row = order.len() as u32;
                    order.push(vertex);
                }
                *row
            })
        });
        let triangles: Vec<[u32; 3]> = triangles.collect();
        let leaves = (0..tree.nodes.len() as u32).filter(|&n| tree.nodes[n as usize].is_leaf());
        let leaves: Vec<u32> = leaves.collect();
        let (mut leaf_vertices, mut leaf_end) = (Vec::new(), Vec::new());
        for &leaf in &leaves {
            let node = &tree.nodes[leaf as usize];
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let mut vertices: Vec<u32> = triangles[range].iter().flatten().copied().collect();
            vertices.sort_unstable();
            vertices.dedup();
            leaf_vertices.extend(vertices);
            leaf_end.push(leaf_vertices.len() as u32);
        }
        let positions = Vec::new();
        Self { tree, triangles, order, positions, leaves, leaf_vertices, leaf_end }
    }

    fn closest<A: Axis>(&self, tool: &A) -> Found {
        let axis = tool.prepare();
        let nodes = &self.tree.nodes;
        let mut best = f32::INFINITY;
        let (mut node_tests, mut triangle_tests) = (1, 0);
        let mut stack = [(0.0_f32, 0_u32); STACK];
        let mut waiting = 0;
        let mut node = 0_u32;
        loop {
            let current = &nodes[node as usize];
            let first = current.first_index;
            if current.is_leaf() {
                let range = first as usize..(first + current.prim_count) as usize;
                for triangle in &self.triangles[range] {
                    let corners = triangle.map(|v| Vec3::from(self.positions[v as usize]));
                    triangle_tests += 1;
                    if let Some(pair) = tool.closest_on_triangle(&corners, best) {
                        best = pair.distance_squared;
                    }
                }
            } else {
                node_tests += 2;
                let [left, right] = [first, first + 1].map(|child| {
                    let Aabb { min, max } = *nodes[child as usize].aabb();
                    A::bound(&axis, min, max, best)
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
}

impl Method for Obvhs {
    fn load(&mut self, positions: &[Vec3]) {
        self.positions.clear();
        self.positions.extend(self.order.iter().map(|&v| Vec3A::from(positions[v as usize])));
    }

    fn update(&mut self) {
        let mut start = 0;
        for (&leaf, &end) in self.leaves.iter().zip(&self.leaf_end) {
            let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
            for &vertex in &self.leaf_vertices[start..end as usize] {
                let position = self.positions[vertex as usize];
                min = min.min(position);
                max = max.max(position);
            }
            self.tree.nodes[leaf as usize].set_aabb(Aabb::new(min, max));
            start = end as usize;
        }
        self.tree.refit_all();
    }

    fn find(&mut self, tool: &Probe) -> Found {
        match tool {
            Probe::Sphere(sphere) => self.closest(sphere),
            Probe::Capsule(capsule) => self.closest(capsule),
        }
    }
}
