//! The hybrid on a surface that nodes move: no vertex is computed before a search reads it.
//!
//! The box of a subtree at the cut is around the nodes that its vertices are bound to: a box over the elements. When a
//! query first enters it, its vertices are computed, and the subtree is refitted. An alternative was measured and is
//! slower: boxes below the cut that are mapped by their element, and never refitted. Half of the triangles lie across
//! elements.

use glam::{Vec3, Vec3A};

use super::aabb_tree::AabbTree;
use super::blend::{Blend, around};
use super::boxes::{Start, each_once};
use super::hybrid::Hybrid;
use crate::method::{Found, Method, Probe};

/// A hybrid whose vertices are computed when they are read.
pub struct Lazy {
    hybrid: Hybrid,
    /// The binding of each row.
    blends: Vec<Blend>,
    /// The nodes of each subtree.
    of_cut: Vec<Vec<u32>>,
    nodes: Vec<Vec3A>,
}

impl Lazy {
    /// From the binding of each mesh vertex, and positions of the vertices and the nodes.
    #[must_use]
    pub fn new(mut hybrid: Hybrid, blends: &[Blend], rest: &[Vec3], nodes: &[Vec3]) -> Self {
        hybrid.load(rest);
        let rows = 0..hybrid.tree.rows.positions().len();
        let blends: Vec<Blend> =
            rows.map(|row| blends[hybrid.tree.rows.vertex(row) as usize]).collect();
        let of_cut = hybrid.cut.iter().map(|cut| {
            each_once(cut.vertices().flat_map(|row| blends[row as usize].nodes).collect())
        });
        let (of_cut, nodes) = (of_cut.collect(), nodes.iter().map(|&node| node.into()).collect());
        Self { hybrid, blends, of_cut, nodes }
    }

    /// The positions of the nodes, for writing.
    pub fn nodes_mut(&mut self) -> &mut [Vec3A] {
        &mut self.nodes
    }

    /// All work of a frame before its first query.
    pub fn update(&mut self) {
        let Self { hybrid, blends, of_cut, nodes } = self;
        hybrid.update_by(|tree, number, cut| {
            if !cut.is_leaf() {
                return around(nodes, &of_cut[number]);
            }
            moved(tree, blends, nodes, cut.vertices());
            cut.bounds(tree)
        });
    }

    /// The closest pair between the tool and the current surface.
    pub fn find(&mut self, tool: &Probe) -> Found {
        let Self { hybrid, blends, nodes, .. } = self;
        // The search starts with this triangle, whatever subtree it is in.
        if let Start::Last(Some(triangle)) = hybrid.start {
            let corners = hybrid.tree.rows.triangle(triangle);
            moved(&mut hybrid.tree, blends, nodes, corners.into_iter());
        }
        hybrid.find_by(tool, |tree, cut| moved(tree, blends, nodes, cut.vertices()))
    }
}

/// Computes vertices from the nodes.
#[inline(always)]
fn moved(tree: &mut AabbTree, blends: &[Blend], nodes: &[Vec3A], rows: impl Iterator<Item = u32>) {
    let positions = tree.rows.positions_mut();
    for row in rows {
        let row = row as usize;
        positions[row] = blends[row].of(nodes);
    }
}
