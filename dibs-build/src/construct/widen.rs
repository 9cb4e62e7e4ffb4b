//! Collapses a binary tree into one whose nodes have up to eight children.
//!
//! A query that expands a node tests all of its children. If a child's test mostly passes, it is wasted: the child's
//! own children are tested at once instead. The test passes more often the larger the ratio of the child's radius to
//! its parent's (on brains and hearts 0.4 of the time at a ratio of 0.5, 0.6 at 0.7, 0.85 at 0.9). With two children
//! the break-even is at one half, and lower since a visit to a node costs as much as the test of one child. A ratio of
//! 0.7 takes the fewest tests, one of 0.6 the fewest instructions.

use super::{Cluster, Content};

/// A child whose radius is at least this fraction of its parent's is replaced by its own children.
const SHARE: f64 = 0.6;

/// Gives every node up to `most` children.
pub(crate) fn widen(cluster: Cluster, most: usize) -> Cluster {
    let Content::Inner(mut children) = cluster.content else { return cluster };
    let gives_way = |child: &Cluster| match child.content {
        Content::Inner(ref own) => {
            (child.radius >= SHARE * cluster.radius).then_some((child.radius, own.len()))
        }
        Content::Leaf(_) => None,
    };
    loop {
        let fitting = children.iter().enumerate().filter_map(|(at, child)| {
            let (radius, own) = gives_way(child)?;
            (children.len() - 1 + own <= most).then_some((radius, at))
        });
        // The largest child first; of equal ones the last.
        let Some((_, at)) = fitting.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else {
            break;
        };
        let Content::Inner(own) = children.remove(at).content else { break };
        children.splice(at..at, own);
    }
    let children = children.into_iter().map(|child| widen(child, most)).collect();
    Cluster { content: Content::Inner(children), ..cluster }
}
