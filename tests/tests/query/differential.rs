//! Complete queries compared with exhaustive search in f64: every construction, both index widths, spheres and
//! capsules, deformations up to the limit. The error of a separation may not exceed the stated accuracy.

// Requirement: A-01

use dibs_build::{Builder, BuiltTree, Construction, IndexWidth, Mesh, Paths, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Index, Options, Proximity, Query, Tree, TriangleRow, measure_stretch};
use dibs_tests::deform::Deformation;
use dibs_tests::oracle::{Instrument, OraclePair, exhaustive};
use dibs_tests::poses::pose;
use dibs_tests::{ask, sample, surfaces};
use fastrand::Rng;
use glam::Vec3;

/// Least number of queries of a case, which ends after a round of all kinds of deformation.
const QUERIES: usize = if cfg!(debug_assertions) { 90 } else { 4_500 };

/// Poses tried on each deformation.
const POSES: usize = 25;

struct Case<'m> {
    name: String,
    mesh: &'m Mesh,
    tree: BuiltTree,
    queries: usize,
}

/// The outcome of a case.
#[derive(Default)]
struct Tally {
    queries: usize,
    /// Largest error of a separation, in units of the accuracy stated for it.
    worst: f64,
}

fn run(case: &Case<'_>, seed: u64) -> Tally {
    if case.tree.index_bits() == 16 {
        run_with(case, &case.tree.tree::<u16>().expect("valid"), seed)
    } else {
        run_with(case, &case.tree.tree::<u32>().expect("valid"), seed)
    }
}

fn run_with<I: Index>(case: &Case<'_>, tree: &Tree<'_, I>, seed: u64) -> Tally {
    let mut rng = Rng::with_seed(seed);
    let mut query = Query::<I, MAX_STACK>::new(tree).expect("enough for any tree");
    let mut tally = Tally::default();
    let triangles = surfaces::triangles(tree);
    while tally.queries < case.queries {
        for deformation in Deformation::ALL {
            let moved = deformation.apply(case.mesh, tree.paths(), tree.stretch(), &mut rng);
            let rows = case.tree.to_rows(&moved);
            let measured = measure_stretch(tree, rows.as_slice())
                .unwrap_or_else(|e| panic!("{}: {deformation:?}: {e}", case.name));
            let mut last = None;
            for _ in 0..POSES {
                let tool = pose(&rows, &triangles, &mut rng);
                let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles");
                let all = [
                    Options::cold(),
                    Options::cold().stretch(measured),
                    Options::cold().stretch(measured).warm_start(last),
                    Options::cold().warm_start(Some(TriangleRow(rng.u32(..)))),
                ];
                for options in &all[rng.usize(..2)..] {
                    let both = [
                        ask::closest(&mut query, rows.as_slice(), &tool, options),
                        ask::closest_batched(&mut query, rows.as_slice(), &tool, options),
                    ];
                    for found in both {
                        let found = found.unwrap_or_else(|e| {
                            panic!("{}: {deformation:?}: {tool:?} {options:?}: {e}", case.name)
                        });
                        let error = check(&rows, &tool, &truth, &found);
                        assert!(
                            error <= 1.0 && found.lower == found.separation,
                            "{}: {deformation:?}: {tool:?}\n  found {found:?}\n  truth {truth:?}",
                            case.name
                        );
                        tally.worst = tally.worst.max(error);
                        tally.queries += 1;
                        last = found.triangle;
                    }
                }
                let budget = Budget::new(rng.u32(..360));
                let options = Options::cold().budget(budget);
                let both = [
                    ask::closest(&mut query, rows.as_slice(), &tool, &options),
                    ask::closest_batched(&mut query, rows.as_slice(), &tool, &options),
                ];
                for cut in both {
                    check_interval(&truth, &cut.expect("a short budget is no error"), budget);
                    tally.queries += 1;
                }
            }
        }
    }
    tally
}

/// The error of an answer's separation in units of its accuracy; asserts that the parts of the answer agree.
fn check(rows: &[Vec3], tool: &Instrument, truth: &OraclePair, found: &Proximity) -> f64 {
    let accuracy = f64::from(found.accuracy);
    let corners = found.corners.map(|v| rows[v as usize]);
    let [a, b, c] = found.barycentric;
    assert!(a >= 0.0 && b >= 0.0 && c >= 0.0 && (a + b + c - 1.0).abs() < 1e-5, "{found:?}");
    let size = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let from_weights = corners[0] * a + corners[1] * b + corners[2] * c;
    let rounding = 1e-5 * size + found.accuracy;
    assert!(from_weights.distance(found.point_on_surface) <= rounding, "{found:?}");
    let axis_point = tool.start + (tool.end - tool.start) * found.axis_parameter;
    let reach = axis_point.distance(found.point_on_surface);
    let rounding = rounding + 1e-5 * axis_point.abs().max_element();
    assert!((reach - found.axis_distance).abs() <= rounding, "{found:?}");
    (truth.separation - f64::from(found.separation)).abs() / accuracy
}

fn check_interval(truth: &OraclePair, cut: &Proximity, budget: Budget) {
    let accuracy = f64::from(cut.accuracy);
    assert!(cut.work() <= budget.tests() + 1 + Budget::TRIANGLE, "{budget:?} {cut:?}");
    assert!(cut.lower <= cut.separation, "{budget:?} {cut:?}");
    let inside = f64::from(cut.lower) - accuracy <= truth.separation
        && truth.separation <= f64::from(cut.separation) + accuracy;
    assert!(inside, "{budget:?} {cut:?} {truth:?}");
}

/// Runs cases on all cores and prints the result of each. Returns the number of queries.
fn run_all(cases: &[Case<'_>]) -> usize {
    let next = std::sync::atomic::AtomicUsize::new(0);
    let total = std::sync::atomic::AtomicUsize::new(0);
    let work = || {
        loop {
            let number = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            let Some(case) = cases.get(number) else { break };
            let tally = run(case, number as u64);
            total.fetch_add(tally.queries, std::sync::atomic::Ordering::Relaxed);
            let Tally { queries, worst } = tally;
            println!("{:40} {queries:6} queries, worst error {worst:.3} of accuracy", case.name);
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    total.into_inner()
}

/// Kinds of trees of one mesh.
const KINDS: usize = 8;

/// Trees of one mesh in every construction, and with several kinds of paths, sizes of leaves and index widths: the first
/// `kinds` of them.
fn cases_of<'m>(name: &str, mesh: &'m Mesh, kinds: usize, queries: usize) -> Vec<Case<'m>> {
    let geodesic = Builder::new().stretch(1.5);
    let builders: [_; KINDS] = [
        ("default", geodesic.clone()),
        ("default, 32 bit", geodesic.clone().index(IndexWidth::Bits32).stretch(2.0)),
        ("edge paths", geodesic.clone().paths(Paths::Edges)),
        ("one triangle a leaf", geodesic.clone().leaf_triangles(1).stretch(1.1)),
        ("eight triangles a leaf", geodesic.leaf_triangles(8)),
        ("paper", Builder::new().construction(Construction::Paper).stretch(2.0)),
        ("the paper's pin", Builder::new().construction(Construction::MidRangePin)),
        ("the paper's split", Builder::new().construction(Construction::PlaneSplit)),
    ];
    let case = |(kind, builder): (&str, Builder<'_>)| Case {
        name: format!("{name}, {kind}"),
        mesh,
        tree: builder.build(mesh).unwrap_or_else(|e| panic!("{name}, {kind}: {e}")),
        queries,
    };
    builders.into_iter().take(kinds).map(case).collect()
}

#[test]
fn procedural_meshes_agree_with_exhaustive_search() {
    let heart = generate::heart(600).expect("a valid size").mesh;
    let brain = generate::brain(1_200).expect("a valid size");
    let sheet = sheet(12);
    let one = Mesh {
        positions: sheet.positions[..3].to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let mut cases = cases_of("heart 600", &heart, KINDS, QUERIES);
    cases.extend(cases_of("brain 1,200", &brain, KINDS, QUERIES));
    cases.extend(cases_of("irregular sheet", &sheet, KINDS, QUERIES));
    cases.extend(cases_of("one triangle", &one, KINDS, QUERIES / 4));
    let total = run_all(&cases);
    println!("{total} queries on procedural meshes, none beyond its accuracy");
    assert!(cfg!(debug_assertions) || total >= 80_000, "{total}");
}

#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn real_meshes_agree_with_exhaustive_search() {
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let names = ["brain_500", "brain_5k", "heart_10272", "brain_50k"];
    let read = |name: &str| dibs_build::read(data.join(name).with_extension("ply"));
    let meshes = names.map(|name| read(name).unwrap_or_else(|e| panic!("{e}")).mesh);
    let (queries, mut cases) = (sample(QUERIES), Vec::new());
    for (name, mesh) in names.iter().zip(&meshes) {
        // Building the largest mesh's trees takes most of the test's time: the first two are its sample.
        let kinds = if *name == "brain_50k" { sample(KINDS) } else { KINDS };
        let queries = queries * 1_000 / mesh.triangles.len().max(1_000);
        cases.extend(cases_of(name, mesh, kinds, queries));
    }
    let total = run_all(&cases);
    println!("{total} queries on real meshes, none beyond its accuracy");
    assert!(cfg!(debug_assertions) || total >= sample(20_000), "{total}");
}

/// An open sheet with triangles of very different sizes and shapes, including slivers.
fn sheet(cells: u32) -> Mesh {
    let mut rng = Rng::with_seed(7);
    let side = cells + 1;
    let place = |i: u32| (i as f32 / cells as f32).powi(3) * 100.0;
    let mut positions = Vec::new();
    for row in 0..side {
        for column in 0..side {
            positions.push(Vec3::new(place(row), place(column), rng.f32() * 5.0));
        }
    }
    let mut triangles = Vec::new();
    for row in 0..cells {
        for column in 0..cells {
            let a = row * side + column;
            triangles.extend([[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]);
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}
