//! The work of a construction, counted in arcs that its searches look at, on meshes chosen to be expensive.

// Requirement: M-04

use glam::Vec3;

use super::{Construction, Constructor, Surface};
use crate::error::BuildError;
use crate::geodesic::{Graph, Topology};
use crate::rest::{LimitRatios, Paths};
use crate::{Mesh, generate};

/// Arcs seen for each triangle, by searches and in the graph; and whether the mesh was refused because of them.
fn work(mesh: &Mesh, construction: Construction) -> (usize, bool) {
    let topology = Topology::new(mesh);
    let is_paper = construction == Construction::Paper;
    let (paths, leaf) = if is_paper { (Paths::Edges, 1) } else { (Paths::default(), 8) };
    let graph = Graph::new(mesh, &topology, paths, &LimitRatios::default());
    let arcs: usize = (0..mesh.positions.len() as u32).map(|vertex| graph.arcs(vertex).len()).sum();
    let surface = Surface { mesh, graph: &graph, restricted: is_paper, volume: None };
    let constructor = Constructor::new(surface, construction, leaf, &|_| ());
    let is_refused = match constructor.run() {
        Ok(_) => false,
        Err(BuildError::Tangled { triangles }) => triangles == mesh.triangles.len(),
        Err(error) => panic!("{error}"),
    };
    ((constructor.work.into_inner() + arcs) / mesh.triangles.len(), is_refused)
}

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh { positions, triangles, ..Mesh::default() }
}

fn circle(count: u32, radius: f32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |at| {
        let angle = at as f32 * std::f32::consts::TAU / count as f32;
        Vec3::new(angle.cos(), angle.sin(), 0.0) * radius
    })
}

/// All triangles at one edge.
fn book(count: u32) -> Mesh {
    let ends = [Vec3::ZERO, Vec3::Z * 50.0];
    let tips = circle(count, 40.0).map(|tip| tip + Vec3::Z * 20.0);
    mesh(ends.into_iter().chain(tips).collect(), (2..count + 2).map(|tip| [0, 1, tip]).collect())
}

/// All triangles around one vertex, in a ring or apart.
fn around(count: u32, is_ring: bool) -> Mesh {
    let rim = if is_ring { count } else { 2 * count };
    let positions = std::iter::once(Vec3::Z * 30.0).chain(circle(rim, 400.0)).collect();
    let corners = |at: u32| {
        if is_ring { [0, 1 + at, 1 + (at + 1) % rim] } else { [0, 1 + 2 * at, 2 + 2 * at] }
    };
    mesh(positions, (0..count).map(corners).collect())
}

/// Two hub vertices; every triangle has one of them as a corner.
fn bipyramid(count: u32) -> Mesh {
    let rim = count / 2;
    let hubs = [Vec3::Z * 30.0, Vec3::Z * -30.0];
    let corners = |at: u32| {
        let side = [2 + at / 2, 2 + (at / 2 + 1) % rim];
        if at.is_multiple_of(2) { [0, side[0], side[1]] } else { [1, side[1], side[0]] }
    };
    mesh(hubs.into_iter().chain(circle(rim, 90.0)).collect(), (0..2 * rim).map(corners).collect())
}

fn strip(count: u32) -> Mesh {
    let positions = (0..count + 2).map(|at| Vec3::new(at as f32, (at % 2) as f32, 0.0));
    mesh(positions.collect(), (0..count).map(|at| [at, at + 1, at + 2]).collect())
}

/// Every edge between few vertices has many triangles.
fn dense(vertices: u32) -> Mesh {
    let positions =
        circle(vertices, 50.0).enumerate().map(|(at, p)| p + Vec3::Z * (at * at % 17) as f32);
    let triples = (0..vertices).flat_map(|a| {
        (a + 1..vertices).flat_map(move |b| (b + 1..vertices).map(move |c| [a, b, c]))
    });
    mesh(positions.collect(), triples.collect())
}

/// Triangles between vertices drawn at random.
fn random(vertices: u32, count: u32) -> Mesh {
    let mut state = 1_u32;
    let mut draw = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(state) * u64::from(below)) >> 32) as u32
    };
    let positions: Vec<Vec3> =
        (0..vertices).map(|_| Vec3::from([0; 3].map(|_| draw(1 << 20) as f32 / 1e4))).collect();
    // Three different steps around the circle of all vertices.
    let third = vertices / 3;
    let corners = |_| {
        let first = draw(vertices);
        let second = first + 1 + draw(third);
        [first, second % vertices, (second + 1 + draw(third)) % vertices]
    };
    mesh(positions, (0..count).map(corners).collect())
}

/// A ribbon of triangles, each larger than the previous by a factor: a plane through its middle cuts off its end.
fn growing(count: u32) -> Mesh {
    let at = |row: u32| 1e-9 * 1e17_f32.powf(row as f32 / (count / 2) as f32);
    let sides = |row| [1.0, -1.0].map(|side| Vec3::new(1.0, 0.01 * side, 0.0) * at(row));
    let corners = |at: u32| {
        let low = at / 2 * 2;
        if at.is_multiple_of(2) { [low, low + 1, low + 2] } else { [low + 1, low + 3, low + 2] }
    };
    mesh((0..=count / 2).flat_map(sides).collect(), (0..count).map(corners).collect())
}

#[test]
fn no_mesh_costs_ten_times_the_work_of_a_well_formed_one() {
    let heart = generate::heart(8_000).expect("a valid size").mesh;
    let (well_formed, is_refused) = work(&heart, Construction::Geodesic);
    assert!(!is_refused);
    for (name, mesh, is_surface) in [
        ("book", book(8_000), true),
        ("ring", around(8_000, true), true),
        ("star", around(8_000, false), true),
        ("bipyramid", bipyramid(8_000), true),
        ("strip", strip(8_000), true),
        ("growing", growing(8_000), true),
        ("dense", dense(36), true),
        ("loosely random", random(8_000, 8_000), false),
        ("random", random(2_000, 16_000), false),
        ("densely random", random(500, 24_000), false),
    ] {
        // The paper's construction takes a third of the time.
        for (construction, most) in [(Construction::Geodesic, 10), (Construction::Paper, 3)] {
            let (found, is_refused) = work(&mesh, construction);
            println!(
                "{name}, {construction:?}: {found} arcs a triangle, {well_formed} of a heart{}",
                if is_refused { ", then refused" } else { "" }
            );
            assert!(found < most * well_formed, "{name}: {found} of {most} times {well_formed}");
            assert!(!(is_surface && is_refused), "{name}");
        }
    }
}
