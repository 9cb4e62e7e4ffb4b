//! obvhs 0.4: its tree, its `refit_all`, and an exact closest-point traversal of its nodes (it has none itself), with
//! the kernels and bounds of our baselines.

use std::time::Duration;

use dibs_build::Mesh;
use dibs_tests::baselines::boxes::{BoxTree, Node, Rows, Start, closest_to};
use dibs_tests::method::{Found, Layout, Method, Probe};
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
    /// In the order of the tree's primitives.
    rows: Rows,
    leaves: Vec<u32>,
    /// The vertices of each leaf, each once, and the end of each leaf's.
    leaf_vertices: Vec<u32>,
    leaf_end: Vec<u32>,
    start: Start,
}

impl Obvhs {
    pub fn new(mesh: &Mesh) -> Self {
        let at = |v: u32| Vec3A::from(mesh.positions[v as usize]);
        let soup: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: at(a), v1: at(b), v2: at(c) })
            .collect();
        // Splitting is for rays: it puts one triangle into several leaves.
        let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() };
        let mut tree = build_bvh2_from_tris(&soup, parameters, &mut Duration::default());
        tree.reorder_in_stack_traversal_order();
        assert!(tree.children_are_ordered_after_parents && tree.max_depth <= STACK);

        let rows = Rows::new(mesh, &tree.primitive_indices);
        let leaves = (0..tree.nodes.len() as u32).filter(|&n| tree.nodes[n as usize].is_leaf());
        let leaves: Vec<u32> = leaves.collect();
        let (mut leaf_vertices, mut leaf_end) = (Vec::new(), Vec::new());
        for &leaf in &leaves {
            let node = &tree.nodes[leaf as usize];
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            leaf_vertices.extend(rows.vertices(range));
            leaf_end.push(leaf_vertices.len() as u32);
        }
        Self { tree, rows, leaves, leaf_vertices, leaf_end, start: Start::Cold }
    }

    /// The same, with every search started from the last answer's triangle.
    pub fn warm(self) -> Self {
        Self { start: Start::Last(None), ..self }
    }
}

impl BoxTree for Obvhs {
    #[inline(always)]
    fn node(&mut self, node: u32) -> Node {
        let node = &self.tree.nodes[node as usize];
        let first = node.first_index;
        match node.is_leaf() {
            true => Node::Leaf(first as usize..(first + node.prim_count) as usize),
            false => Node::Inner(first),
        }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> [Vec3A; 2] {
        let Aabb { min, max } = *self.tree.nodes[node as usize].aabb();
        [min, max]
    }

    #[inline(always)]
    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.rows.corners(triangle)
    }
}

impl Method for Obvhs {
    fn load(&mut self, positions: &[Vec3]) {
        self.rows.load(positions);
    }

    fn update(&mut self) {
        let mut start = 0;
        for (&leaf, &end) in self.leaves.iter().zip(&self.leaf_end) {
            let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
            for &vertex in &self.leaf_vertices[start..end as usize] {
                let position = self.rows.positions()[vertex as usize];
                min = min.min(position);
                max = max.max(position);
            }
            self.tree.nodes[leaf as usize].set_aabb(Aabb::new(min, max));
            start = end as usize;
        }
        self.tree.refit_all();
    }

    fn find(&mut self, tool: &Probe) -> Found {
        let found;
        (found, self.start) = closest_to::<_, STACK>(self, tool, self.start);
        found
    }
}

impl Layout for Obvhs {
    type Position = Vec3A;

    fn positions_mut(&mut self) -> &mut [Vec3A] {
        self.rows.positions_mut()
    }

    fn vertex(&self, row: usize) -> u32 {
        self.rows.vertex(row)
    }
}
