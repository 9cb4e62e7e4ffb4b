//! The paper's search, for the test counts of its tables 1 and 2.
//!
//! It is recursive and depth first, on a binary tree with one triangle a leaf. A node's bound is the separation of its
//! pin minus its radius; a leaf's radius is elastic: the largest present distance from its pin to its corners. The
//! nearer of two children is visited first, and a child is only entered while its bound is below the least separation
//! so far. The library's upper bounds from pins, planes, slack and warm starts are not used.

use dibs_build::BuiltTree;
use dibs_nostd::format::NodeLink;
use dibs_nostd::{Index, Tool, TriangleRow};
use glam::Vec3;

use crate::method::{Found, Method, Probe};

/// A node of the binary tree.
enum Node {
    /// Two children, and the radius at the stretch limit.
    Inner { pin: u32, radius: f32, children: [u32; 2] },
    /// One triangle; its first corner is the pin of the elastic sphere.
    Leaf { corners: [u32; 3] },
}

/// The paper's search on a tree of the paper's construction.
pub struct Paper<'t> {
    nodes: Vec<Node>,
    order: &'t [u32],
    rows: Vec<Vec3>,
}

impl<'t> Paper<'t> {
    /// Reads the nodes of a built tree.
    ///
    /// # Panics
    /// If the tree is not binary with one triangle a leaf, as trees of `Construction::Paper` are.
    #[must_use]
    pub fn new(built: &'t BuiltTree) -> Self {
        let nodes = match built.index_bits() {
            16 => nodes::<u16>(built),
            _ => nodes::<u32>(built),
        };
        Self { nodes, order: built.vertex_order(), rows: Vec::new() }
    }

    fn position(&self, row: u32) -> Vec3 {
        self.rows[row as usize]
    }

    /// The separation of a node's pin minus its radius.
    fn bound(&self, node: u32, tool: &impl Tool) -> f32 {
        let (pin, radius) = match self.nodes[node as usize] {
            Node::Inner { pin, radius, .. } => (pin, radius),
            Node::Leaf { corners: [pin, b, c] } => {
                let to = |corner| self.position(pin).distance(self.position(corner));
                (pin, to(b).max(to(c)))
            }
        };
        tool.axis_distance_squared(self.position(pin)).sqrt() - tool.radius() - radius
    }

    /// Lowers the separation found so far by searching a node's subtree.
    fn search(&self, node: u32, tool: &impl Tool, found: &mut Found, tests: &mut [u32; 2]) {
        match self.nodes[node as usize] {
            Node::Leaf { corners } => {
                tests[1] += 1;
                let corners = corners.map(|row| self.position(row));
                let pair = tool.closest_on_triangle(&corners, f32::INFINITY);
                let distance = pair.expect("positions are finite").distance_squared.sqrt();
                found.separation = found.separation.min((distance - tool.radius()).max(0.0));
            }
            Node::Inner { children, .. } => {
                tests[0] += 2;
                let mut bounds = children.map(|child| (self.bound(child, tool), child));
                bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
                for (bound, child) in bounds {
                    // At contact any intersection is a valid answer.
                    if bound < found.separation && found.separation > 0.0 {
                        self.search(child, tool, found, tests);
                    }
                }
            }
        }
    }

    fn closest(&self, tool: &impl Tool) -> Found {
        let (mut found, mut tests) = (Found { separation: f32::INFINITY, tests: None }, [0; 2]);
        self.search(0, tool, &mut found, &mut tests);
        Found { tests: Some(tests), ..found }
    }
}

fn nodes<I: Index>(built: &BuiltTree) -> Vec<Node> {
    let tree = built.tree::<I>().expect("valid");
    let of = |row| match tree.node(row).expect("inside the table") {
        (pin, radius, NodeLink::Children { first, count: 2 }) => {
            Node::Inner { pin, radius: radius * tree.stretch(), children: [first, first + 1] }
        }
        (pin, _, NodeLink::Leaf { first, count: 1 }) => {
            let [a, b, c] = tree.corners(TriangleRow(first)).expect("inside the table");
            let corners = if pin == b {
                [b, c, a]
            } else if pin == c {
                [c, a, b]
            } else {
                [a, b, c]
            };
            Node::Leaf { corners }
        }
        (.., link) => panic!("not a binary tree with one triangle a leaf: {link:?}"),
    };
    (0..tree.node_count()).map(of).collect()
}

impl Method for Paper<'_> {
    fn load(&mut self, positions: &[Vec3]) {
        self.rows.clear();
        self.rows.extend(self.order.iter().map(|&vertex| positions[vertex as usize]));
    }

    fn update(&mut self) {}

    fn find(&mut self, tool: &Probe) -> Found {
        match tool {
            Probe::Sphere(sphere) => self.closest(sphere),
            Probe::Capsule(capsule) => self.closest(capsule),
        }
    }
}
