//! Instructions of every hot function on this computer, counted by callgrind: the same at every run.
//! `cargo xtask test` compares them with docs/evidence/guarantees.json.

// The macros make public items without documentation.
#![allow(missing_docs)]

use std::hint::black_box;

use dibs_nostd::constraint::{ForbiddenRegion, GainError, SpringDamper};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Assembler, Budget, Capsule, Frames, Millis, NoAdmissionCheck, Options, Proximity,
    QuantisedVertices, Query, Scrub, Sphere, Tool, Tree, Unavailable, VertexTable, measure_stretch,
};
use dibs_tests::bus::{MESH, N, frame};
use gungraun::prelude::*;

dibs_nostd::include_tree!("heart");

/// As the batched search wants it.
const STACK: usize = heart::STACK + 128;

fn tree() -> heart::Tree {
    heart::TREE.validate().expect("valid")
}

/// A query on the heart at rest.
struct Scene {
    query: Query<'static, u16, STACK>,
    rows: Vec<Vec3>,
    options: Options,
}

fn scene(options: Options) -> Scene {
    let tree = tree();
    let rows = (0..tree.vertex_count()).map(|row| tree.rest_position(row));
    let rows = rows.collect::<Option<_>>().expect("the tree has its rest shape");
    Scene { query: Query::new(&tree).expect("deep enough"), rows, options }
}

fn cold() -> Scene {
    scene(Options::cold().unsigned())
}

fn warm() -> Scene {
    let mut scene = cold();
    let found = capsule_query(&mut scene);
    scene.options = scene.options.warm_start(found.triangle);
    scene
}

fn few_tests() -> Scene {
    scene(Options::cold().unsigned().budget(Budget::new(64)))
}

fn sphere() -> Sphere {
    Sphere::new(Vec3::new(55.0, 12.0, 8.0), 2.5).expect("a valid sphere")
}

fn capsule() -> Capsule {
    let (start, end) = (Vec3::new(55.0, 12.0, 8.0), Vec3::new(90.0, 40.0, 30.0));
    Capsule::new(start, end, 2.5).expect("a valid capsule")
}

fn capsule_query(scene: &mut Scene) -> Proximity {
    let Scene { query, rows, options } = scene;
    query.closest(rows.as_slice(), &capsule(), options).expect("a sound tree")
}

#[library_benchmark]
#[bench::whole(setup = cold)]
#[bench::few(setup = few_tests)]
fn sphere_closest(mut scene: Scene) -> Proximity {
    let Scene { query, rows, options } = &mut scene;
    black_box(query.closest(rows.as_slice(), &sphere(), options).expect("a sound tree"))
}

#[library_benchmark]
#[bench::whole(setup = cold)]
#[bench::warm(setup = warm)]
#[bench::few(setup = few_tests)]
fn capsule_closest(mut scene: Scene) -> Proximity {
    black_box(capsule_query(&mut scene))
}

#[library_benchmark]
#[bench::whole(setup = cold)]
fn sphere_closest_batched(mut scene: Scene) -> Proximity {
    let Scene { query, rows, options } = &mut scene;
    black_box(query.closest_batched(rows.as_slice(), &sphere(), options).expect("a sound tree"))
}

#[library_benchmark]
#[bench::whole(setup = cold)]
fn capsule_closest_batched(mut scene: Scene) -> Proximity {
    let Scene { query, rows, options } = &mut scene;
    black_box(query.closest_batched(rows.as_slice(), &capsule(), options).expect("a sound tree"))
}

fn beside() -> [Vec3; 3] {
    [Vec3::new(50.0, 0.0, 0.0), Vec3::new(52.0, 1.0, 0.0), Vec3::new(50.5, 2.0, 0.3)]
}

/// All but a line, and parallel to nothing.
fn sliver() -> [Vec3; 3] {
    [Vec3::new(50.0, 0.0, 0.0), Vec3::new(60.0, 1.0, 0.0), Vec3::new(55.0, 0.5001, 0.0)]
}

#[library_benchmark]
#[bench::ordinary(beside())]
#[bench::sliver(sliver())]
fn sphere_triangle(corners: [Vec3; 3]) -> bool {
    black_box(sphere().closest_on_triangle(black_box(&corners), f32::INFINITY)).is_some()
}

#[library_benchmark]
#[bench::ordinary(beside())]
#[bench::sliver(sliver())]
fn capsule_triangle(corners: [Vec3; 3]) -> bool {
    black_box(capsule().closest_on_triangle(black_box(&corners), f32::INFINITY)).is_some()
}

#[library_benchmark]
#[bench::heart(setup = cold)]
fn stretch_of_a_thousand_triangles(scene: Scene) -> f32 {
    black_box(measure_stretch(scene.query.tree(), scene.rows.as_slice()).expect("at rest").sigma())
}

/// A bus, and the packets of two frames.
type Bus = (Assembler<'static, NoAdmissionCheck>, Vec<Vec<u8>>);

fn bus(quantised: bool) -> Bus {
    let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
    let (writer, _reader) = frames.split().expect("split once");
    (Assembler::new(writer, NoAdmissionCheck, MESH, 100.0), frame(1, quantised))
}

#[library_benchmark]
#[bench::float(args = (false,), setup = bus)]
#[bench::quantised(args = (true,), setup = bus)]
fn accept_forty_vertices((mut assembler, packets): Bus) -> usize {
    packets.iter().filter(|packet| black_box(assembler.accept(packet, Millis(0))).is_ok()).count()
}

fn quantised() -> Vec<[u16; 3]> {
    (0..100).map(|row| [row, 7 * row, 65_535 - row]).collect()
}

#[library_benchmark]
#[bench::hundred(setup = quantised)]
fn quantised_positions(rows: Vec<[u16; 3]>) -> Vec3 {
    let table = QuantisedVertices::new(&rows, Vec3::NEG_ONE, Vec3::splat(0.01));
    (0..100).filter_map(|row| table.position(black_box(row))).sum()
}

const SPRING: SpringDamper = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
const WALL: Result<ForbiddenRegion, GainError> = ForbiddenRegion::new(SPRING, 50.0);

fn found() -> Result<Proximity, Unavailable> {
    Ok(capsule_query(&mut cold()))
}

#[library_benchmark]
#[bench::wall(setup = found)]
fn force(found: Result<Proximity, Unavailable>) -> Vec3 {
    let wall = const { WALL }.expect("valid gains");
    black_box(wall.force(black_box(&found), Vec3::X)).force
}

#[library_benchmark]
#[bench::kilobyte(vec![0x5A; 1024])]
fn scrub(bytes: Vec<u8>) -> bool {
    black_box(Scrub::new(&bytes).step(1024)).is_ok()
}

library_benchmark_group!(
    name = hot,
    benchmarks = [
        sphere_closest,
        capsule_closest,
        sphere_closest_batched,
        capsule_closest_batched,
        sphere_triangle,
        capsule_triangle,
        stretch_of_a_thousand_triangles,
        accept_forty_vertices,
        quantised_positions,
        force,
        scrub
    ]
);
main!(library_benchmark_groups = hot);
