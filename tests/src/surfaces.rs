//! Small surfaces of several kinds, on which exhaustive search is cheap enough for a million cases.

use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, generate};
use dibs_nostd::{Index, Tree, TriangleRow, VertexTable};
use glam::Vec3;

/// A mesh and its tree.
pub struct Surface {
    /// The mesh at rest.
    pub mesh: Mesh,
    /// Its tree, with 16-bit indices.
    pub tree: BuiltTree,
}

/// Positions, and their stated error (mm).
pub struct Inexact<'s>(pub &'s [Vec3], pub f32);

impl VertexTable for Inexact<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.0.position(vertex)
    }

    fn position_error(&self) -> f32 {
        self.1
    }
}

/// A heart with small and with large leaves, a folded brain, a ball whose centre is equally far from all vertices, and
/// an open band of slivers. Lean trees have neither rest shape nor vertex order.
///
/// # Panics
/// Never: the sizes are valid.
#[must_use]
pub fn all(lean: bool) -> Vec<Surface> {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let brain = generate::brain(500).expect("a valid size");
    let build = |(mesh, leaf): (Mesh, usize)| {
        let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5).leaf_triangles(leaf);
        let builder = builder.with_rest_shape(!lean).with_vertex_order(!lean);
        Surface { tree: builder.build(&mesh).expect("a valid mesh"), mesh }
    };
    [(heart.clone(), 1), (heart, 4), (brain, 2), (ball(2), 1), (slivers(20), 1)].map(build).into()
}

/// The corners of every triangle, as rows.
///
/// # Panics
/// Never: every row is inside the table.
#[must_use]
pub fn triangles<I: Index>(tree: &Tree<'_, I>) -> Vec<[u32; 3]> {
    (0..tree.triangle_count())
        .map(|row| tree.corners(TriangleRow(row)).expect("inside the table"))
        .collect()
}

/// A ball of 40 mm radius around the origin: an octahedron whose triangles are split into four, this many times.
#[must_use]
pub fn ball(splits: u32) -> Mesh {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let mut positions = vec![x, y, -x, -y, z, -z];
    let mut triangles = Vec::new();
    for side in 0..4_u32 {
        let next = (side + 1) % 4;
        triangles.extend([[side, next, 4], [next, side, 5]]);
    }
    for _ in 0..splits {
        let mut middles = std::collections::BTreeMap::new();
        let mut split = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |p: u32, q: u32| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    positions.push((positions[p as usize] + positions[q as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        triangles = split;
    }
    Mesh {
        positions: positions.into_iter().map(|p| p * 40.0).collect(),
        triangles,
        ..Mesh::default()
    }
}

/// A box with outward triangles.
///
/// # Panics
/// Never.
#[must_use]
pub fn cuboid(low: Vec3, high: Vec3) -> ([Vec3; 8], [[u32; 3]; 12]) {
    let corner = |n: u32| {
        let pick = |bit: u32, low: f32, high: f32| if n >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    };
    let faces =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.as_flattened().as_chunks::<4>().0.iter();
    let triangles = triangles.flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect::<Vec<_>>();
    (core::array::from_fn(|n| corner(n as u32)), triangles.try_into().expect("twelve"))
}

/// A band of triangles a hundred times longer than wide.
#[must_use]
pub fn slivers(rows: u32) -> Mesh {
    let columns = 4_u32;
    let at = |row: u32, column: u32| row * (columns + 1) + column;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let wave = (column as f32 * 1.3 + row as f32 * 0.2).sin();
            positions.push(Vec3::new(column as f32 * 25.0, row as f32 * 0.25, wave * 0.02));
            if row < rows && column < columns {
                let (a, b) = (at(row, column), at(row, column + 1));
                let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// A square grid around the origin, whose squares are cut in two, raised by a height function of x and y.
#[must_use]
pub fn sheet(cells: u32, size: f32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let at = |x: u32, y: u32| y * (cells + 1) + x;
    let mut mesh = Mesh::default();
    for y in 0..=cells {
        for x in 0..=cells {
            let place = |n: u32| (n as f32 / cells as f32 - 0.5) * size;
            let (px, py) = (place(x), place(y));
            mesh.positions.push(Vec3::new(px, py, height(px, py)));
            if x < cells && y < cells {
                let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    mesh
}

/// Meshes as parts of one, in this order.
#[must_use]
pub fn joined(parts: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for part in parts {
        let first = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }
    all
}

/// A mesh at another place.
#[must_use]
pub fn moved(part: &Mesh, by: Vec3) -> Mesh {
    let positions = part.positions.iter().map(|&p| p + by).collect();
    Mesh { positions, ..part.clone() }
}
