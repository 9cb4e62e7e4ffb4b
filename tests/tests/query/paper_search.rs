//! The baseline of the paper's search agrees with exhaustive search, with fewer polygon tests.

// Requirement: E-05

use dibs_build::{Builder, Construction, IndexWidth, Mesh, generate};
use dibs_nostd::format::PathKind;
use dibs_nostd::{Capsule, Sphere};
use dibs_tests::baselines::Paper;
use dibs_tests::deform::Deformation;
use dibs_tests::method::{Method, Probe};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use fastrand::Rng;

const STRETCH: f32 = 1.5;

fn probe(tool: &Instrument) -> Probe {
    if tool.start == tool.end {
        Probe::Sphere(Sphere::new(tool.start, tool.radius).expect("valid"))
    } else {
        Probe::Capsule(Capsule::new(tool.start, tool.end, tool.radius).expect("valid"))
    }
}

/// Compares the paper's search with exhaustive search, around deformed surfaces. Returns its number of polygon tests.
fn agrees(mesh: &Mesh, width: IndexWidth, seed: u64) -> u64 {
    let builder = Builder::new().construction(Construction::Paper).stretch(STRETCH);
    let built = builder.index(width).build(mesh).expect("a valid mesh");
    let mut rng = Rng::with_seed(seed);
    let mut search = Paper::new(&built);
    let mut polygon_tests = 0;
    for deformation in Deformation::ALL.into_iter().cycle().take(18) {
        let moved = deformation.apply(mesh, PathKind::EdgePath, STRETCH, &mut rng);
        search.load(&moved);
        search.update();
        for _ in 0..10 {
            let tool = pose(&moved, &mesh.triangles, &mut rng);
            let truth = exhaustive(&moved, &mesh.triangles, &tool).expect("has triangles");
            let found = search.find(&probe(&tool));
            let size = moved.iter().map(|p| p.distance(tool.start)).fold(0.0, f32::max);
            let rounding = f64::from(1e-5 * (size + tool.start.distance(tool.end)));
            // The paper's separation has no sign.
            let off = (f64::from(found.separation) - truth.separation.max(0.0)).abs();
            assert!(off <= rounding, "{deformation:?} {tool:?}: {found:?}, not {truth:?}");
            polygon_tests += u64::from(found.tests.expect("counted")[1]);
        }
    }
    polygon_tests
}

#[test]
fn it_finds_what_exhaustive_search_finds() {
    let heart = generate::heart(600).expect("a valid size").mesh;
    let brain = generate::brain(1_200).expect("a valid size");
    // Long triangles, whose elastic spheres matter.
    let slivers = surfaces::slivers(60);
    let cases = [(&heart, IndexWidth::Bits16), (&brain, IndexWidth::Bits32)];
    for (mesh, width) in cases.into_iter().chain([(&slivers, IndexWidth::Bits16)]) {
        let tests = agrees(mesh, width, 5);
        let all = 180 * mesh.triangles.len() as u64;
        println!("{tests} polygon tests where exhaustive search takes {all}");
        // The limit is high because collapsed and flattened surfaces allow no pruning.
        assert!(tests < all / 2, "{tests} of {all}");
    }
}
