//! The builder: coverage compared with independently computed distances, determinism, cost, refusals.

// Requirements: A-02, M-04

use std::collections::HashMap;

use dibs_build::{BuildError, Builder, BuiltTree, Construction, IndexWidth, Mesh, Paths, generate};
use dibs_nostd::format::{MAX_STACK, NodeLink, PathKind};
use dibs_nostd::{Index, Options, Query, Sphere, Tree, TriangleRow, measure_stretch};
use dibs_tests::deform::{Deformation, unit};
use dibs_tests::{stretch, surfaces};
use fastrand::Rng;
use glam::Vec3;

const STACK: usize = MAX_STACK;

fn heart(triangles: u32) -> Mesh {
    generate::heart(triangles).expect("a valid size").mesh
}

/// Shortest edge paths between all pairs of vertices (Floyd and Warshall).
fn all_pairs(mesh: &Mesh) -> Vec<Vec<f64>> {
    let count = mesh.positions.len();
    let mut distance = vec![vec![f64::INFINITY; count]; count];
    for [a, b, c] in &mesh.triangles {
        for (u, v) in
            [(*a as usize, *b as usize), (*b as usize, *c as usize), (*c as usize, *a as usize)]
        {
            let length = mesh.positions[u].as_dvec3().distance(mesh.positions[v].as_dvec3());
            distance[u][v] = length;
            distance[v][u] = length;
        }
    }
    for (v, row) in distance.iter_mut().enumerate() {
        row[v] = 0.0;
    }
    for through in 0..count {
        let via = distance[through].clone();
        for row in &mut distance {
            let to_via = row[through];
            for (d, onward) in row.iter_mut().zip(&via) {
                *d = d.min(to_via + onward);
            }
        }
    }
    distance
}

/// Calls `visit` with every node's pin, radius and vertices; vertices by their numbers in the mesh.
fn each_node<I: Index>(tree: &Tree<'_, I>, visit: &mut impl FnMut(u32, f64, &[u32])) {
    let number = |row: u32| tree.vertex_number(row).expect("in the tree").0;
    for row in 0..tree.node_count() {
        let (pin, radius, _) = tree.node(row).expect("in the tree");
        let mut vertices = Vec::new();
        let mut below = vec![row];
        while let Some(row) = below.pop() {
            match tree.node(row).expect("in the tree").2 {
                NodeLink::Leaf { first, count } => {
                    let rows = (first..first + count).filter_map(|t| tree.corners(TriangleRow(t)));
                    vertices.extend(rows.flatten().map(number));
                }
                NodeLink::Children { first, count } => below.extend(first..first + count),
            }
        }
        visit(number(pin), f64::from(radius), &vertices);
    }
}

#[test]
fn edge_path_radii_are_the_geodesic_ones_rounded_up() {
    let mesh = heart(600);
    let truth = all_pairs(&mesh);
    let built = Builder::new().paths(Paths::Edges).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let unit = f64::from(f32::from_bits(u32::from_le_bytes(
        built.blob()[32..36].try_into().expect("four bytes"),
    )));
    let mut nodes = 0;
    each_node(&tree, &mut |pin, radius, vertices| {
        let needed = vertices.iter().map(|&v| truth[pin as usize][v as usize]).fold(0.0, f64::max);
        assert!(radius >= needed, "node pinned to {pin}: {radius} covers {needed}");
        // Arcs are rounded up to f32, and the radius to a multiple of the unit.
        assert!(radius <= needed * (1.0 + 1e-6) + 1.01 * unit, "{radius} for {needed}");
        nodes += 1;
    });
    assert_eq!(nodes, tree.node_count());
}

#[test]
fn surface_radii_lie_between_straight_lines_and_edge_paths() {
    let mesh = heart(600);
    let edges = all_pairs(&mesh);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let at = |v: u32| mesh.positions[v as usize].as_dvec3();
    let mut shorter = 0;
    each_node(&built.tree::<u16>().expect("valid"), &mut |pin, radius, vertices| {
        let farthest = |d: &dyn Fn(u32) -> f64| vertices.iter().map(|&v| d(v)).fold(0.0, f64::max);
        let straight = farthest(&|v| at(pin).distance(at(v)));
        let along_edges = farthest(&|v| edges[pin as usize][v as usize]);
        assert!(radius >= straight, "{radius} below the straight line {straight}");
        assert!(radius <= along_edges * 1.001 + 0.01, "{radius} above the edge path {along_edges}");
        shorter += u32::from(radius < 0.97 * along_edges);
    });
    assert!(shorter > 50, "chords shorten paths: {shorter}");
}

/// Deforms the mesh up to its limit, and compares every vertex of every node with the node's sphere.
#[test]
fn spheres_cover_their_sections_up_to_the_limit() {
    let mesh = heart(320);
    let mut rng = Rng::with_seed(11);
    for construction in [Construction::Geodesic, Construction::Paper] {
        let built = Builder::new().stretch(1.5).construction(construction).build(&mesh);
        let built = built.expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        for deformation in Deformation::ALL {
            let moved = deformation.apply(&mesh, tree.paths(), tree.stretch(), &mut rng);
            let sigma = measure_stretch(&tree, built.to_rows(&moved).as_slice());
            let sigma = f64::from(sigma.expect("within the limit").sigma());
            each_node(&tree, &mut |pin, radius, vertices| {
                for &v in vertices {
                    let reach =
                        moved[pin as usize].as_dvec3().distance(moved[v as usize].as_dvec3());
                    // Positions are rounded to f32 after the deformation.
                    assert!(reach <= sigma * radius + 1e-4, "{deformation:?}: {reach}");
                }
            });
        }
    }
}

/// The same with a limit for each triangle: random limits, and the least limits of one deformation, which then
/// stretches every triangle to its limit.
#[test]
fn spheres_cover_their_sections_up_to_each_triangles_limit() {
    /// The builder raises lower limits to what the check can tell from the rest shape.
    const LEAST: f32 = 1.02;
    let mesh = heart(320);
    let mut rng = Rng::with_seed(12);
    let mut narrowest = f64::INFINITY;
    let kinds = [Paths::Edges, Paths::Surface { crossings: 1 }, Paths::Surface { crossings: 3 }];
    for (paths, deformation) in kinds.into_iter().flat_map(|p| Deformation::ALL.map(|d| (p, d))) {
        let kind = if paths == Paths::Edges { PathKind::EdgePath } else { PathKind::Surface };
        let of = |moved: &[Vec3], t: usize| stretch::of_triangle(&mesh, moved, t, kind);
        let triangles = 0..mesh.triangles.len();
        let full = deformation.apply(&mesh, kind, 2.5, &mut rng);
        let needed = triangles.clone().map(|t| (of(&full, t) as f32 * 1.0001).max(LEAST)).collect();
        let random = triangles.clone().map(|_| 1.05 + rng.f32() * rng.f32() * 2.0).collect();
        for limits in [needed, random] {
            let limits: Vec<f32> = limits;
            // Slightly within the limits, because of the f32 rounding of the measurement.
            let fits = |moved: &[Vec3]| {
                triangles.clone().all(|t| of(moved, t) <= f64::from(limits[t]) * 0.99998)
            };
            let mut shapes: Vec<Vec<Vec3>> = Vec::new();
            if fits(&full) {
                shapes.push(full.clone());
            }
            for other in Deformation::ALL {
                shapes.push(other.apply_while(&mesh, fits, &mut rng));
            }
            let built = Builder::new().paths(paths).limits(limits.clone()).build(&mesh);
            let built = built.expect("a valid mesh");
            let tree = built.tree::<u16>().expect("valid");
            for moved in shapes {
                let sigma = measure_stretch(&tree, built.to_rows(&moved).as_slice());
                let sigma = f64::from(sigma.expect("within the limits").sigma());
                let share = |t: usize| of(&moved, t) / f64::from(limits[t]);
                let largest = triangles.clone().map(share).fold(0.0, f64::max);
                let truth = largest * f64::from(tree.stretch());
                assert!(sigma >= truth * (1.0 - 1e-4), "{sigma} for {truth}");
                assert!(sigma <= truth.max(0.5) * 1.0001, "{sigma} for {truth}");
                each_node(&tree, &mut |pin, radius, vertices| {
                    for &v in vertices {
                        let reach =
                            moved[pin as usize].as_dvec3().distance(moved[v as usize].as_dvec3());
                        // Positions are rounded to f32 after the deformation.
                        assert!(reach <= sigma * radius + 1e-4, "{deformation:?}: {reach}");
                        if reach > 5.0 {
                            narrowest = narrowest.min(sigma * radius / reach);
                        }
                    }
                });
            }
        }
    }
    println!("the narrowest sphere is {narrowest:.6} times what it covers");
    assert!(narrowest < 1.01, "no case comes near the limit: {narrowest}");
}

/// A stretch beyond the limit is refused, and the error names it. Without this check some answers would be wrong.
#[test]
fn a_violated_limit_is_reported_not_tolerated() {
    let mesh = heart(320);
    let built = Builder::new().stretch(1.1).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let doubled: Vec<Vec3> = built.to_rows(&mesh.positions).iter().map(|p| *p * 2.0).collect();
    let refused = measure_stretch(&tree, doubled.as_slice()).expect_err("twice is too much");
    assert!(refused.to_string().contains("stretched by 2"), "{refused}");
    let mut query = Query::<u16, STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(3);
    let wrong = (0..300).filter(|_| {
        let at = doubled[rng.usize(..doubled.len())] + unit(&mut rng) * 20.0;
        let tool = Sphere::new(at, 0.0).expect("valid");
        let nearest = doubled.iter().map(|p| p.distance(at)).fold(f32::INFINITY, f32::min);
        match query.closest(doubled.as_slice(), &tool, &Options::cold().unsigned()) {
            Ok(found) => found.separation > nearest + found.accuracy,
            Err(_) => false,
        }
    });
    assert!(wrong.count() > 0, "the limit matters: without it some answers are wrong");
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let mesh = generate::brain(4_000).expect("a valid size");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| Builder::new().build(&mesh).expect("a valid mesh"))
    };
    let one = with(1);
    for threads in [2, 7] {
        assert!(with(threads).blob() == one.blob(), "{threads} threads");
    }
}

/// With up to 65,535 triangles a neighbour's 16-bit code is its row; with more, up to four rows share one code.
#[test]
fn neighbours_share_an_edge() {
    let all = [surfaces::sheet(6, 1.0, |_, _| 0.0), heart(1_000), surfaces::ball(6)];
    for mesh in all.iter().chain([&generate::brain(68_000).expect("a valid size")]) {
        let built = Builder::new().index(IndexWidth::Bits16).build(mesh).expect("a valid mesh");
        let tree: Tree<'_, u16> = built.tree().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
        let rows = (0..).map(TriangleRow).zip(&triangles);
        let own = rows.flat_map(|(row, &corners)| edges(corners).map(|edge| (edge, row)));
        let own: HashMap<_, _> = own.collect();
        for (row, &corners) in (0..).map(TriangleRow).zip(&triangles) {
            for (edge, (from, to)) in (0..).zip(edges(corners)) {
                assert_eq!(tree.neighbour(row, edge), own.get(&(to, from)).copied(), "{row}");
            }
        }
    }
}

#[test]
fn the_heart_takes_at_most_22_bytes_a_triangle() {
    let mesh = generate::heart(10_272).expect("the default").mesh;
    let summary = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh").summary();
    println!("{:.2} bytes a triangle", summary.query_bytes_per_triangle);
    assert!(summary.query_bytes_per_triangle <= 22.0);
    assert_eq!(summary.query_bytes, 8 * summary.nodes as usize + 6 * 10_272);
}

/// The RAM in the builder's summary is the size of the firmware's buffers.
#[test]
fn the_stated_ram_is_that_of_the_frames() {
    let stated = |triangles: u32| {
        let summary = Builder::new().build(&heart(triangles)).expect("a valid mesh").summary();
        (summary.vertices, summary.ram_bytes)
    };
    assert_eq!(stated(1_000), (502, size_of::<dibs_nostd::Frames<502>>()));
    assert_eq!(stated(1_002), (503, size_of::<dibs_nostd::Frames<503>>()));
}

#[test]
fn what_cannot_be_built_is_named() {
    let mesh = heart(320);
    let built = |m: &Mesh, b: Builder<'_>| b.build(m).map(|_: BuiltTree| ()).expect_err("refused");
    let new = Builder::new;
    let none = Mesh { triangles: vec![], ..mesh.clone() };
    assert!(matches!(built(&none, new()), BuildError::NoTriangles));
    for stretch in [0.99, f32::NAN, f32::INFINITY, -1.0] {
        assert!(matches!(built(&mesh, new().stretch(stretch)), BuildError::Stretch { .. }));
    }
    for leaf in [0, 9] {
        let error = built(&mesh, new().leaf_triangles(leaf));
        assert!(matches!(error, BuildError::LeafSize { triangles } if triangles == leaf));
    }
    let error = built(&mesh, new().limits(vec![1.5; 319]));
    assert!(
        matches!(error, BuildError::Limits { limits: 319, elements: 320, of: "triangles" }),
        "{error}"
    );
    let mut limits = vec![1.5; 320];
    limits[7] = 0.9;
    let error = built(&mesh, new().limits(limits));
    assert!(matches!(error, BuildError::Limit { element: 7, of: "triangle", .. }), "{error}");
    let mut broken = mesh.clone();
    broken.positions[7].y = f32::NAN;
    assert!(matches!(built(&broken, new()), BuildError::Coordinate { vertex: 7 }));
    let mut broken = mesh.clone();
    broken.triangles[5][1] = 9_999;
    let error = built(&broken, new());
    assert!(matches!(error, BuildError::Corner { triangle: 5, vertex: 9_999, .. }), "{error}");
    for corners in [[0, 1, 1], [4, 4, 4]] {
        let mut broken = mesh.clone();
        broken.triangles[5] = corners;
        let error = built(&broken, new());
        assert!(matches!(error, BuildError::NoArea { triangle: 5, .. }), "{error}");
    }
    let mut broken = mesh.clone();
    let [a, b, c] = broken.triangles[6].map(|vertex| vertex as usize);
    broken.positions[a] = Vec3::ZERO;
    broken.positions[b] = Vec3::new(1.0, 2.0, 3.0);
    broken.positions[c] = Vec3::new(2.0, 4.0, 6.0);
    let error = built(&broken, new());
    assert!(matches!(error, BuildError::NoArea { triangle: 6, .. }), "{error}");
    let mut two = mesh.clone();
    let first = two.positions.len() as u32;
    two.positions.extend([Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 500.0));
    two.triangles.push([first, first + 1, first + 2]);
    assert_eq!(new().build(&two).expect("two roots").summary().roots, 2);
    let mut many = mesh.clone();
    many.positions.resize(65_537, Vec3::ZERO);
    let error = built(&many, new().index(IndexWidth::Bits16));
    assert!(matches!(error, BuildError::TooManyVertices { vertices: 65_537, bits: 16, .. }));
    assert_eq!(new().build(&many).expect("32 bits").index_bits(), 32);
    let tree = new().build(&mesh).expect("a valid mesh");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("heart.rs");
    for name in ["", "HEART", "9heart", "heart murmur"] {
        let refused = tree.write_rust(&file, name);
        assert!(matches!(refused, Err(BuildError::Name { .. })), "{name:?}");
    }
    assert_eq!(folder.path().read_dir().expect("is there").count(), 0, "nothing is written");
    let shallow = Query::<u16, 3>::new(&tree.tree().expect("valid"));
    assert!(shallow.is_err(), "a stack of 3 is too small");
}

/// Repeated triangles unfold to chords of length zero, which cross no edge: the builder accepts them.
#[test]
fn limits_on_triangles_that_repeat_each_other_build() {
    let positions = [[3.0, 2.0, 1.0], [2.0, 2.0, 1.0], [2.0, 3.0, 0.0], [3.0, 1.0, 0.0]];
    let positions = positions.map(Vec3::from_array).to_vec();
    let triangles = vec![[1, 2, 0], [3, 1, 0], [3, 0, 1], [2, 0, 3], [1, 2, 0]];
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    Builder::new().limits(vec![1.85, 1.5, 1.65, 1.01, 1.0]).build(&mesh).expect("a valid mesh");
}

/// Counts are compared exactly: they reveal any change of the tree or of the traversal, which must be intended.
#[test]
fn counts_of_a_fixed_stream_are_what_they_were() {
    let mesh = heart(2_000);
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let measured = measure_stretch(&tree, rows.as_slice()).expect("at rest");
    let mut query = Query::<u16, STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(1);
    let mut counts = [(0, 0); 3];
    let mut last = None;
    for _ in 0..400 {
        let on_surface = mesh.positions[rng.usize(..mesh.positions.len())];
        let tool = Sphere::new(on_surface + unit(&mut rng) * 40.0 * rng.f32(), 2.0).expect("valid");
        let options = [
            Options::cold(),
            Options::cold().stretch(measured),
            Options::cold().stretch(measured).warm_start(last),
        ];
        for (count, options) in counts.iter_mut().zip(options) {
            let found = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
            *count = (count.0 + found.node_tests, count.1 + found.triangle_tests);
            last = found.triangle;
        }
    }
    assert_eq!(counts, GOLDEN, "node and triangle tests: limit, measured, measured and warm");
}

/// Node and triangle tests of the stream above.
const GOLDEN: [(u32, u32); 3] = [(87_955, 3_630), (53_633, 3_499), (53_434, 3_853)];
