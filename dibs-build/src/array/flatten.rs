//! From a tree of sections to the flat array: order, round up, write.

use dibs_nostd::format::{
    CHECKSUM_AT, CRC, HEADER_BYTES, Link, MAGIC, METRIC_BYTES, PathKind, SECTION_ALIGN,
    SECTION_BYTES, VERSION, section,
};
use dibs_nostd::{Index, Tree};

use super::fans::{Placed, arrange};
use super::metric::metric;
use crate::Mesh;
use crate::construct::{Cluster, Content};
use crate::error::BuildError;
use crate::stretch::Shares;

/// A tree in the order of its array.
#[derive(Debug, Default)]
struct Flat {
    /// Pins, radii and links of both children, a node.
    nodes: Vec<[(u32, f64, Link); 2]>,
    /// Triangles, leaf by leaf.
    triangles: Vec<Placed>,
    depth: u32,
}

impl Flat {
    /// Depth first, so that children follow their parents and the triangles of a section are one run.
    fn add(&mut self, mesh: &Mesh, cluster: &Cluster, above: u32) -> Link {
        match &cluster.content {
            Content::Leaf(triangles) => {
                let first = self.triangles.len() as u32;
                let before = self.triangles.last().copied();
                self.triangles.extend(arrange(mesh, triangles, before));
                Link::Leaf { first, count: triangles.len() as u32 }
            }
            Content::Inner(children) => {
                self.depth = self.depth.max(above + 1);
                let row = self.nodes.len();
                let mut record = children.each_ref().map(|c| (c.pin, c.radius, Link::Node(0)));
                self.nodes.push(record);
                for (entry, child) in record.iter_mut().zip(children.iter()) {
                    entry.2 = self.add(mesh, child, above + 1);
                }
                self.nodes[row] = record;
                Link::Node(row as u32)
            }
        }
    }
}

/// What goes into the header besides the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts<'a> {
    pub paths: PathKind,
    pub stretch: f32,
    pub shares: &'a Shares,
    pub with_order: bool,
    pub with_rest: bool,
    pub with_metric: bool,
}

/// The bytes of a tree, and the mesh vertex of each row.
pub(crate) fn flatten<I: Index>(
    mesh: &Mesh,
    root: &Cluster,
    facts: Facts<'_>,
) -> Result<(Vec<u8>, Vec<u32>), BuildError> {
    let mut flat = Flat::default();
    let root_link = flat.add(mesh, root, 0);
    let order = vertex_order(mesh, &flat.triangles);
    let mut row_of = vec![u32::MAX; mesh.positions.len()];
    for (row, &vertex) in order.iter().enumerate() {
        row_of[vertex as usize] = row as u32;
    }
    let unit = radius_unit::<I>(root, &flat);

    let mut nodes = Vec::new();
    for children in &flat.nodes {
        children.iter().for_each(|&(pin, ..)| put::<I>(&mut nodes, row_of[pin as usize]));
        children.iter().for_each(|&(_, radius, _)| put::<I>(&mut nodes, code(radius, unit)));
        children.iter().for_each(|(.., link)| nodes.extend(link.encode().to_le_bytes()));
    }
    let mut triangles = Vec::new();
    for triangle in &flat.triangles {
        for corner in triangle.corners {
            put::<I>(&mut triangles, row_of[corner as usize]);
        }
    }
    let mut rest = Vec::new();
    for &vertex in &order {
        let position = mesh.positions[vertex as usize];
        position.to_array().into_iter().for_each(|x| rest.extend(x.to_le_bytes()));
    }
    let mut numbers = Vec::new();
    order.iter().for_each(|&vertex| put::<I>(&mut numbers, vertex));

    let mut identity = CRC.digest();
    identity.update(&triangles);
    identity.update(&rest);
    let mut sections = vec![(section::NODES, nodes), (section::TRIANGLES, triangles)];
    if facts.with_order {
        sections.push((section::VERTEX_ORDER, numbers));
    }
    if facts.with_rest {
        sections.push((section::REST, rest));
    }
    if facts.with_metric {
        sections.push((section::METRIC, metrics(mesh, &flat.triangles, facts)));
    }
    if !facts.shares.is_uniform() {
        let codes = flat.triangles.iter().map(|placed| facts.shares.code(placed.triangle));
        sections.push((section::LIMITS, codes.flat_map(u16::to_le_bytes).collect()));
    }
    let header = [
        identity.finalize(),
        order.len() as u32,
        flat.triangles.len() as u32,
        flat.nodes.len() as u32,
        root_link.encode(),
        flat.depth,
        facts.stretch.to_bits(),
        unit.to_bits(),
        row_of[root.pin as usize],
        code(root.radius, unit),
    ];
    let bytes = assemble::<I>(facts.paths, header, &sections)?;
    Tree::<I>::from_bytes(&bytes)?;
    Ok((bytes, order))
}

/// Mesh vertices in the order in which the leaves come to them, so that what is near on the surface
/// is near in memory.
fn vertex_order(mesh: &Mesh, triangles: &[Placed]) -> Vec<u32> {
    let mut seen = vec![false; mesh.positions.len()];
    let corners = triangles.iter().flat_map(|t| t.corners);
    corners.filter(|&v| !std::mem::replace(&mut seen[v as usize], true)).collect()
}

/// The metric of each triangle, marked where it continues the fan of the triangle before.
fn metrics(mesh: &Mesh, triangles: &[Placed], facts: Facts<'_>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(METRIC_BYTES * triangles.len());
    let mut last = None;
    for placed in triangles {
        let corners = placed.corners.map(|v| mesh.positions[v as usize]);
        let mut row = metric(
            corners,
            facts.shares.share(placed.triangle),
            f64::from(facts.stretch),
            facts.paths,
        );
        let [a, b, c] = placed.corners;
        if last == Some((a, b)) {
            row[0] = -row[0];
        }
        last = Some((a, c));
        row.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    bytes
}

/// The length of one radius code: the largest radius takes nearly the largest code.
fn radius_unit<I: Index>(root: &Cluster, flat: &Flat) -> f32 {
    let radii = flat.nodes.iter().flatten().map(|&(_, radius, _)| radius);
    let largest = radii.fold(root.radius, f64::max);
    // One part in a million covers the rounding of the unit to f32.
    (largest / f64::from(I::MAX_RADIUS_CODE) * (1.0 + 1e-6)) as f32
}

/// The least code whose radius, as the controller computes it, is not below `radius`.
fn code(radius: f64, unit: f32) -> u32 {
    if radius == 0.0 {
        return 0;
    }
    let code = (radius / f64::from(unit)).ceil() as u32;
    let stored = f64::from(code as f32 * unit);
    if stored < radius { code + 1 } else { code }
}

fn put<I: Index>(bytes: &mut Vec<u8>, value: u32) {
    bytes.extend(&value.to_le_bytes()[..I::BYTES]);
}

fn assemble<I: Index>(
    paths: PathKind,
    header: [u32; 10],
    sections: &[(u32, Vec<u8>)],
) -> Result<Vec<u8>, BuildError> {
    let mut offset = (HEADER_BYTES + sections.len() * SECTION_BYTES) as u64;
    let mut table = Vec::new();
    for (kind, content) in sections {
        offset = offset.next_multiple_of(SECTION_ALIGN as u64);
        table.push((*kind, offset, content.len() as u64));
        offset += content.len() as u64;
    }
    let too_large = |_| BuildError::TooLarge { bytes: offset };
    let length = u32::try_from(offset).map_err(too_large)?;

    let mut bytes = Vec::with_capacity(length as usize);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend([I::BYTES as u8, paths.code()]);
    header.into_iter().for_each(|field| bytes.extend(field.to_le_bytes()));
    for field in [sections.len() as u32, length, 0, 0] {
        bytes.extend(field.to_le_bytes());
    }
    for &(kind, offset, length) in &table {
        for field in [kind, offset as u32, length as u32] {
            bytes.extend(field.to_le_bytes());
        }
    }
    for ((_, content), (_, offset, _)) in sections.iter().zip(table) {
        bytes.resize(offset as usize, 0);
        bytes.extend(content);
    }
    let mut digest = CRC.digest();
    digest.update(&bytes[..CHECKSUM_AT]);
    digest.update(&bytes[CHECKSUM_AT + 4..]);
    bytes[CHECKSUM_AT..CHECKSUM_AT + 4].copy_from_slice(&digest.finalize().to_le_bytes());
    Ok(bytes)
}
