//! From two children a node to up to eight.
//!
//! A query that expands a node tests all of its children. The test of a child that mostly passes is wasted: its own
//! children should be tested at once. How often it passes goes with its radius
//! as a share of its parent's (about 0.4 of the time at a share of 0.5, 0.6 at 0.7, 0.85 at 0.9 on
//! brains and hearts). With two children the break-even is one half, and less as looking at a node costs
//! as much again as testing one child: fewest tests take a share of 0.7, fewest instructions one of 0.6.

use super::{Cluster, Content};

/// A child whose radius is at least this share of its parent's gives way to its own children.
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
        // The largest first; of equals the last.
        let Some((_, at)) = fitting.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else {
            break;
        };
        let Content::Inner(own) = children.remove(at).content else { break };
        children.splice(at..at, own);
    }
    let children = children.into_iter().map(|child| widen(child, most)).collect();
    Cluster { content: Content::Inner(children), ..cluster }
}
