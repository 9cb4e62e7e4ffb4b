//! The work of a construction, counted in arcs that its searches look at, on meshes made to cost much.

use glam::Vec3;

use super::{Construction, Constructor, Surface};
use crate::geodesic::{Graph, Topology};
use crate::rest::{Paths, Shares};
use crate::{Mesh, generate};

/// Arcs seen for each triangle, by searches and in the graph.
fn work(mesh: &Mesh) -> usize {
    let topology = Topology::new(mesh);
    let graph = Graph::new(mesh, &topology, Paths::default(), &Shares::default());
    let arcs: usize = (0..mesh.positions.len() as u32).map(|vertex| graph.arcs(vertex).len()).sum();
    let surface = Surface { mesh, graph: &graph, restricted: false };
    let constructor = Constructor::new(surface, Construction::Geodesic, 8, &|_| ());
    constructor.run().expect("a tree");
    let idle = constructor.idle.into_inner().expect("no panic");
    let seen: usize = idle.iter().map(super::Searches::arcs_seen).sum();
    (seen + arcs) / mesh.triangles.len()
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

/// Two hubs that all triangles have one of.
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

#[test]
fn no_mesh_costs_ten_times_the_work_of_a_well_formed_one() {
    let well_formed = work(&generate::heart(8_000).expect("a valid size").mesh);
    for (name, mesh) in [
        ("book", book(8_000)),
        ("ring", around(8_000, true)),
        ("star", around(8_000, false)),
        ("bipyramid", bipyramid(8_000)),
        ("strip", strip(8_000)),
        ("dense", dense(36)),
    ] {
        let found = work(&mesh);
        println!("{name}: {found} arcs a triangle, {well_formed} of a heart");
        assert!(
            found < 10 * well_formed,
            "{name}: {found} arcs a triangle, {well_formed} of a heart"
        );
    }
}
