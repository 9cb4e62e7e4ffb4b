//! Skins: each vertex follows a few joints, which are nodes of the scene, in their default pose.

use super::accessor::{Use, numbers};
use super::buffers::Buffers;
use super::document::{Document, Primitive, Skin};
use super::{Result, get, malformed};
use glam::{DMat4, DVec3};

/// The transform of each node to the world; `None` for nodes that are their own ancestors.
pub fn worlds(document: &Document) -> Vec<Option<DMat4>> {
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(is_child) = is_child.get_mut(child) {
            *is_child = true;
        }
    }
    let mut worlds = vec![None; document.nodes.len()];
    let roots = (0..is_child.len()).filter(|&node| !is_child[node]);
    let mut waiting: Vec<_> = roots.map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((number, above)) = waiting.pop() {
        let (Some(node), Some(world @ None)) = (document.nodes.get(number), worlds.get_mut(number))
        else {
            continue;
        };
        let place = above * node.place();
        *world = Some(place);
        waiting.extend(node.children.iter().map(|&child| (child, place)));
    }
    worlds
}

/// For each joint of a skin, the transform from the mesh's own coordinates to the world.
pub fn joints(
    document: &Document,
    buffers: &mut Buffers<'_>,
    worlds: &[Option<DMat4>],
    skin: &Skin,
    most: usize,
) -> Result<Vec<DMat4>> {
    let inverse = match skin.inverse_bind_matrices {
        Some(number) => numbers(document, buffers, number, Use::Matrices, most)?,
        None => Vec::new(),
    };
    let inverse = inverse.as_chunks::<16>().0;
    let joint = |(number, &node): (usize, &usize)| {
        let world = get(worlds, node, "node")?.ok_or_else(|| malformed("a joint in a cycle"))?;
        let bind = inverse.get(number).map_or(DMat4::IDENTITY, DMat4::from_cols_array);
        Ok(world * bind)
    };
    skin.joints.iter().enumerate().map(joint).collect()
}

/// Moves the vertices of a part by the transforms of their joints, by their weights.
pub fn pose(
    document: &Document,
    buffers: &mut Buffers<'_>,
    primitive: &Primitive,
    joints: &[DMat4],
    most: usize,
    points: &mut [DVec3],
) -> Result<()> {
    let mut sums = vec![(DVec3::ZERO, 0.0); points.len()];
    for set in 0.. {
        let find = |name: &str| primitive.attributes.get(&format!("{name}_{set}")).copied();
        let (Some(of), Some(weights)) = (find("JOINTS"), find("WEIGHTS")) else { break };
        let of = numbers(document, buffers, of, Use::Joints, most)?;
        let weights = numbers(document, buffers, weights, Use::Weights, most)?;
        if of.len() != 4 * points.len() || weights.len() != of.len() {
            return Err(malformed("a skin with another number of vertices than its mesh"));
        }
        for (at, (&joint, &weight)) in of.iter().zip(&weights).enumerate() {
            if weight != 0.0 {
                let place = get(joints, joint as usize, "joint")?;
                let (sum, total) = &mut sums[at / 4];
                *sum += weight * place.transform_point3(points[at / 4]);
                *total += weight;
            }
        }
    }
    for (point, (sum, total)) in points.iter_mut().zip(sums) {
        if total > 0.0 {
            *point = sum / total;
        }
    }
    Ok(())
}
