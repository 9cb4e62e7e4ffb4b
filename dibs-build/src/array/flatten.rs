//! From a tree of sections to the flat array: order, upward rounding, bytes.

// Requirement: A-02

use dibs_nostd::format::{
    CRC, HEADER_BYTES, Join, MAGIC, NodeLink, PathKind, Unit, VERSION, field, section,
};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, Tree};
use glam::DVec3;

use super::adjacency::adjacency;
use super::metric::{metric, with_lowest_bit};
use super::sections::{put_word, write};
use super::solids::solids;
use crate::Mesh;
use crate::construct::{Cluster, Content};
use crate::error::BuildError;
use crate::leaf::{self, StoredTriangle};
use crate::nodes::{Embedding, encode};
use crate::rest::LimitRatios;

/// A tree in array order.
#[derive(Debug)]
struct Flat {
    /// Pin, radius and link of each node.
    nodes: Vec<(u32, f64, NodeLink)>,
    /// Triangles, leaf by leaf.
    triangles: Vec<StoredTriangle>,
    /// Entries that a traversal's stack needs.
    stack: u32,
}

impl Flat {
    /// Nodes are breadth first, so that children follow their parents and siblings are contiguous; leaves are depth
    /// first, so that neighbours on the surface are neighbours in the tables.
    fn new(mesh: &Mesh, roots: &[Cluster]) -> Self {
        let mut flat = Self { nodes: Vec::new(), triangles: Vec::new(), stack: 1 };
        let mut leaves = Vec::new();
        let mut level = Vec::new();
        let mut triangle = 0;
        for root in roots {
            level.push((root, triangle));
            triangle += root.triangles();
        }
        let mut placed = roots.len() as u32;
        let mut most_siblings = placed;
        while !level.is_empty() {
            flat.stack += most_siblings - 1;
            most_siblings = 1;
            let mut below = Vec::new();
            for (cluster, mut triangle) in level {
                let link = match &cluster.content {
                    Content::Leaf(triangles) => {
                        leaves.push((triangle, triangles));
                        NodeLink::Leaf { first: triangle, count: triangles.len() as u32 }
                    }
                    Content::Inner(children) => {
                        let (first, count) = (placed, children.len() as u32);
                        placed += count;
                        most_siblings = most_siblings.max(count);
                        for child in children {
                            below.push((child, triangle));
                            triangle += child.triangles();
                        }
                        NodeLink::Children { first, count }
                    }
                };
                flat.nodes.push((cluster.pin, cluster.radius, link));
            }
            level = below;
        }
        leaves.sort_unstable_by_key(|&(first, _)| first);
        flat.triangles = leaf::order(mesh, leaves.into_iter().map(|(_, leaf)| &leaf[..]));
        flat
    }
}

/// Options and data that are stored in the tree beside its nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts<'a> {
    pub paths: PathKind,
    pub stretch: f32,
    pub ratios: &'a LimitRatios,
    pub position_error: f32,
    pub unit: Option<Unit>,
    pub file_triangles: usize,
    pub with_order: bool,
    pub with_rest: bool,
    pub with_metric: bool,
    pub with_adjacency: bool,
    /// One for each triangle of the mesh.
    pub labels: Option<&'a [u8]>,
    /// The volume that carries the surface.
    pub embedding: Option<&'a Embedding>,
}

/// The bytes of a tree, and the mesh vertex of each row of the vertex table.
pub(crate) fn flatten<I: Index>(
    mesh: &Mesh,
    roots: &[Cluster],
    facts: Facts<'_>,
) -> Result<(Vec<u8>, Vec<u32>), BuildError> {
    let flat = Flat::new(mesh, roots);
    let order = vertex_order(mesh, &flat.triangles);
    let mut row_of = vec![u32::MAX; mesh.positions.len()];
    for (row, &vertex) in order.iter().enumerate() {
        row_of[vertex as usize] = row as u32;
    }
    let unit = radius_unit::<I>(&flat);

    let mut nodes = Vec::new();
    for &(pin, radius, link) in &flat.nodes {
        put::<I>(&mut nodes, row_of[pin as usize]);
        put::<I>(&mut nodes, code(radius, unit));
        nodes.extend(link.encode().to_le_bytes());
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
    let has_origin = mesh.origin != DVec3::ZERO;
    let origin: Vec<u8> = mesh.origin.to_array().into_iter().flat_map(f64::to_le_bytes).collect();
    if has_origin {
        identity.update(&origin);
    }
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
    if !facts.ratios.is_uniform() {
        let codes = flat.triangles.iter().map(|placed| facts.ratios.code(placed.triangle));
        sections.push((section::LIMITS, codes.flat_map(u16::to_le_bytes).collect()));
    }
    if facts.with_adjacency
        && let Some(neighbours) = adjacency::<I>(mesh, &flat.triangles)
    {
        let counts = roots.iter().map(Cluster::triangles);
        let solids =
            (roots.len() > 1).then(|| solids::<I>(mesh, counts, &flat.triangles, &neighbours));
        sections.push((section::ADJACENCY, neighbours));
        sections.extend(solids.map(|solids| (section::SOLIDS, solids)));
    }
    if has_origin {
        sections.push((section::ORIGIN, origin));
    }
    if let Some(labels) = facts.labels {
        let labels = flat.triangles.iter().map(|placed| labels[placed.triangle as usize]);
        sections.push((section::LABELS, labels.collect()));
    }
    if let Some(embedding) = facts.embedding {
        sections.push((section::COARSE_NODES, encode(embedding, facts.stretch, &order)?));
    }
    let mut header = [0; HEADER_BYTES];
    header[..MAGIC.len()].copy_from_slice(&MAGIC);
    header[field::VERSION..][..2].copy_from_slice(&VERSION.to_le_bytes());
    header[field::WIDTH] = I::BYTES as u8;
    header[field::PATHS] = facts.paths.code();
    for (at, word) in [
        (field::MESH_ID, identity.finalize()),
        (field::VERTICES, order.len() as u32),
        (field::TRIANGLES, flat.triangles.len() as u32),
        (field::NODES, flat.nodes.len() as u32),
        (field::STACK, flat.stack),
        (field::STRETCH, facts.stretch.to_bits()),
        (field::RADIUS_UNIT, unit.to_bits()),
        (field::POSITION_ERROR, facts.position_error.to_bits()),
        (field::ORIGIN, has_origin.into()),
        (field::OTHER_ROOTS, roots.len() as u32 - 1),
        (field::UNIT, facts.unit.map_or(0, Unit::code).into()),
        (field::FILE_VERTICES, mesh.positions.len() as u32),
        (field::FILE_TRIANGLES, u32::try_from(facts.file_triangles).unwrap_or(u32::MAX)),
    ] {
        put_word(&mut header, at, word);
    }
    let sections: Vec<(u32, &[u8])> =
        sections.iter().map(|(kind, part)| (*kind, &part[..])).collect();
    let bytes = write(header, &sections)?;
    let tree = Tree::<I>::from_bytes(&bytes)?;
    if facts.embedding.is_some() {
        Nodes::of(&tree)?;
    }
    Ok((bytes, order))
}

/// Mesh vertices in the order of their first use by a leaf: neighbours on the surface are neighbours in memory.
fn vertex_order(mesh: &Mesh, triangles: &[StoredTriangle]) -> Vec<u32> {
    let mut seen = vec![false; mesh.positions.len()];
    let corners = triangles.iter().flat_map(|t| t.corners);
    corners.filter(|&v| !std::mem::replace(&mut seen[v as usize], true)).collect()
}

/// The metric of each triangle, with a mark if it shares an edge with the previous one.
fn metrics(mesh: &Mesh, triangles: &[StoredTriangle], facts: Facts<'_>) -> Vec<u8> {
    let of = |placed: StoredTriangle| {
        let corners = mesh.corners(placed.centre_first());
        let ratio = facts.ratios.ratio(placed.triangle);
        metric(corners, placed.is_reversed, ratio, f64::from(facts.stretch), facts.paths)
    };
    let mut rows: Vec<[f32; 3]> = Vec::with_capacity(triangles.len());
    let mut before: Option<StoredTriangle> = None;
    for &placed in triangles {
        let (mut placed, mut row) = (placed, of(placed));
        let join = placed.join(before).filter(|&join| match rows.last_mut() {
            Some(before) if join != Join::Start => share_edge(before, &mut row, join, facts.ratios),
            _ => false,
        });
        match join {
            Some(Join::Fan) => row[0] = -row[0],
            Some(Join::Flip) => (),
            _ => {
                placed.is_reversed = false;
                row = of(placed);
                row[0] = with_lowest_bit(row[0], false);
            }
        }
        rows.push(row);
        before = Some(placed);
    }
    rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Whether a triangle can join the previous one. Both then store the smaller of the two rounded squares of their shared
/// edge, which is safe for both. If that makes the computed stretch of a nearly flat triangle too large, the join is
/// refused.
fn share_edge(before: &mut [f32; 3], row: &mut [f32; 3], join: Join, ratios: &LimitRatios) -> bool {
    if row[0] == 0.0 || before[2] == 0.0 {
        return false;
    }
    let marked = |edge: f32| if join == Join::Flip { with_lowest_bit(edge, true) } else { edge };
    if !ratios.is_uniform() {
        row[0] = marked(row[0]);
        return true;
    }
    let shared = marked(row[0].min(before[2]));
    let spoilt = |row: [f32; 3], edge: f32| (1.0 - shared / edge) / openness_of(row);
    let most = spoilt(*row, row[0]).max(spoilt(*before, before[2]));
    if most > MOST_SPOILT {
        return false;
    }
    (row[0], before[2]) = (shared, shared);
    true
}

/// Largest relative error of a squared stretch that a join may cause.
const MOST_SPOILT: f32 = 5e-4;

/// `1 - |cos|` of the corner that a metric is measured from.
fn openness_of([first, between, second]: [f32; 3]) -> f32 {
    1.0 - between.abs() / (first.abs() * second).sqrt()
}

/// The radius that one code unit stands for: the largest radius takes nearly the largest code.
fn radius_unit<I: Index>(flat: &Flat) -> f32 {
    let largest = flat.nodes.iter().map(|&(_, radius, _)| radius).fold(0.0, f64::max);
    // One part in a million covers the rounding of this unit to f32.
    (largest / f64::from(I::MAX_RADIUS_CODE) * (1.0 + 1e-6)) as f32
}

/// The least code whose radius, as the controller computes it, is at least `radius`.
fn code(radius: f64, unit: f32) -> u32 {
    if radius == 0.0 {
        return 0;
    }
    let code = (radius / f64::from(unit)).ceil() as u32;
    let stored = f64::from(code as f32 * unit);
    if stored < radius { code + 1 } else { code }
}

pub(super) fn put<I: Index>(bytes: &mut Vec<u8>, value: u32) {
    bytes.extend(&value.to_le_bytes()[..I::BYTES]);
}
