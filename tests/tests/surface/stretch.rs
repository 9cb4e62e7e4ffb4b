//! The measured stretch compared with f64, and its use as an admission check.

// Requirement: F-02

use dibs_build::{Builder, Mesh, Motion, MotionStretch, Paths, generate};
use dibs_nostd::format::{Join, MAX_STACK};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use dibs_nostd::{
    AdmissionCheck, Assembler, FrameExtent, Frames, IncomingSurface, MeasuredStretch, Options,
    Query, QueryError, REGIONS, ReceiveError, Sphere, StretchError, StretchMonitor, Tree,
    TriangleRow, measure_stretch,
};
use dibs_tests::bus::give;
use dibs_tests::deform::{Deformation, deformed, unit};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::tree_bytes::section;
use dibs_tests::{sample, stretch};
use fastrand::Rng;

/// The measured stretch is never below the true one, and exceeds it by at most the added rounding.
#[test]
fn the_measured_stretch_is_the_true_one_rounded_up() {
    let mesh = generate::heart(600).expect("a valid size").mesh;
    let mut rng = Rng::with_seed(21);
    for paths in [Paths::Edges, Paths::Surface { crossings: 2 }] {
        let built = Builder::new().stretch(4.0).paths(paths).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        for round in 0..200 {
            let deformation = Deformation::ALL[round % Deformation::ALL.len()];
            let limit = 1.0 + 2.9 * rng.f32();
            let moved = deformation.apply(&mesh, tree.paths(), limit, &mut rng);
            let truth = stretch::largest(&mesh, &moved, tree.paths());
            let rows = built.to_rows(&moved);
            let measured = measure_stretch(&tree, rows.as_slice()).expect("below 4");
            let sigma = f64::from(measured.sigma());
            assert!(sigma >= truth, "{deformation:?}: {sigma} is below {truth}");
            let most = truth.max(0.5) * 1.00002;
            assert!(sigma <= most, "{deformation:?}: {sigma} for {truth}");
        }
    }
}

/// A nearly flat triangle is measured less precisely; its neighbours are not. At rest, all of them satisfy a limit with
/// room for that.
#[test]
fn a_flat_triangle_does_not_spoil_its_neighbours() {
    let mut rng = Rng::with_seed(37);
    for round in 0..sample(60) {
        let mut mesh = generate::heart(320).expect("a valid size").mesh;
        // One corner moves nearly onto the opposite edge.
        let [a, b, c] = mesh.triangles[rng.usize(..mesh.triangles.len())].map(|v| v as usize);
        let [start, end] = [mesh.positions[b], mesh.positions[c]];
        let foot = start + (end - start) * (0.3 + 0.4 * rng.f32());
        let off = (mesh.positions[a] - foot).normalize() * (end - start).length();
        let flat = 10f32.powf(-1.0 - 1.5 * rng.f32());
        mesh.positions[a] = foot + off * flat * 0.5;
        let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        assert_eq!(built.summary().unmeasurable, 0, "round {round}, {flat}");
        let measured = measure_stretch(&tree, built.to_rows(&mesh.positions).as_slice());
        assert!(measured.is_ok(), "round {round}, {flat}: {measured:?}");
        for row in 0..tree.triangle_count() {
            let at = |v| tree.rest_position(v).expect("a row").as_dvec3();
            let metric = tree.metric(row).expect("a row");
            let [a, b, c] =
                metric.centre_first(tree.corners(TriangleRow(row)).expect("a row").map(at));
            let (e1, e2) = (b - a, c - a);
            let squares = [e1.length_squared(), e1.dot(e2), e2.length_squared()];
            if e1.angle_between(e2).sin() > 0.35 {
                // Each stored number has an error of only a few roundings.
                let scale = squares[0].max(squares[2]);
                for (stored, exact) in metric.squares.into_iter().zip(squares) {
                    let off = (f64::from(stored) - exact).abs();
                    assert!(off <= 1.5e-4 * scale, "round {round}, {flat}: {stored} for {exact}");
                }
            }
        }
    }
}

/// Triangles of every shape and size, including needles and caps, compressed and stretched in every direction.
#[test]
fn no_triangle_is_taken_for_less_stretched_than_it_is() {
    let mut rng = Rng::with_seed(22);
    let mut excess: Vec<f64> = Vec::new();
    for round in 0..20_000 {
        let size = 10f32.powf(rng.f32() * 8.0 - 3.0);
        let thin = 10f32.powf(-4.0 * rng.f32());
        let far = unit(&mut rng) * size * 10f32.powf(rng.f32() * 3.0);
        let along = rng.f32() * 1.2 - 0.1;
        let (x, y) = (unit(&mut rng), unit(&mut rng));
        let mut corners = [
            far,
            far + x * size,
            far + x * size * along + x.any_orthonormal_vector() * size * thin,
        ];
        corners.rotate_left(rng.usize(..3));
        let mesh =
            Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        // Stretch along or across the triangle, and noise from a millionth of its size to all of it.
        let (axis, pull) = (if rng.bool() { x } else { y }, rng.f32() * 3.0);
        let noise = size * 10f32.powf(-6.0 * rng.f32());
        let moved = corners.map(|p| {
            let p = p - middle;
            p + axis * axis.dot(p) * (pull - 1.0) + unit(&mut rng) * noise
        });
        let paths = if round % 4 == 0 { Paths::Edges } else { Paths::Surface { crossings: 2 } };
        let built = Builder::new().stretch(1e3).paths(paths).build(&mesh).expect("one triangle");
        let tree = built.tree::<u16>().expect("valid");
        let truth = stretch::of_triangle(&mesh, &moved, 0, tree.paths());
        if truth > 900.0 {
            continue;
        }
        let rows = built.to_rows(&moved);
        match measure_stretch(&tree, rows.as_slice()) {
            Ok(measured) => {
                let sigma = f64::from(measured.sigma());
                assert!(sigma >= truth * (1.0 - 1e-11), "{mesh:?} {moved:?}: {sigma} < {truth}");
                let above = sigma / truth.max(0.5) - 1.0;
                let (rounding, openness) = (f64::from(f32::EPSILON) / 2.0, openness(corners));
                let most = 2f64.powi(-17) + 1e-6 + 21.0 * rounding / openness;
                assert!(
                    openness < 1e-5 || above <= most,
                    "{mesh:?} {moved:?}: {above:.1e} above, {most:.1e} allowed"
                );
                excess.push(above);
            }
            // A triangle too flat for f32 may be refused, but must not be accepted with too small a stretch.
            Err(StretchError::Exceeded { .. }) => excess.push(f64::INFINITY),
            Err(error) => panic!("{error}"),
        }
    }
    excess.sort_by(f64::total_cmp);
    let at = |share: f64| excess[(share * (excess.len() - 1) as f64) as usize];
    let refused = excess.iter().filter(|e| e.is_infinite()).count();
    let ([median, p90, p99], all) = ([0.5, 0.9, 0.99].map(at), excess.len());
    println!(
        "above the truth: median {median:.1e}, 90 % {p90:.1e}, 99 % {p99:.1e}; {refused} of {all} refused"
    );
    assert!(median < 1.2e-5);
}

/// The largest `1 - |cos|` of the three angles, computed without cancellation.
fn openness(corners: [Vec3; 3]) -> f64 {
    let at = corners.map(Vec3::as_dvec3);
    let of = |i: usize| {
        let (e, f) = (at[(i + 1) % 3] - at[i], at[(i + 2) % 3] - at[i]);
        let lengths = e.length() * f.length();
        (e.cross(f).length() / lengths).powi(2) / (1.0 + (e.dot(f) / lengths).abs())
    };
    (0..3).map(of).fold(0.0, f64::max)
}

#[test]
fn each_region_is_measured_on_its_own() {
    let (mesh, built, frames) = deformed(36, 23);
    let tree = built.tree::<u16>().expect("valid");
    let mut of_row = Vec::new();
    for row in 0..tree.triangle_count() {
        let mut corners = tree
            .corners(TriangleRow(row))
            .expect("in the table")
            .map(|r| built.vertex_order()[r as usize]);
        corners.sort_unstable();
        let same = |t: &[u32; 3]| {
            let mut t = *t;
            t.sort_unstable();
            t == corners
        };
        of_row.push(mesh.triangles.iter().position(same).expect("a triangle of the mesh"));
    }
    for moved in &frames {
        let measured = measure_stretch(&tree, built.to_rows(moved).as_slice()).expect("within 1.5");
        let sigma = f64::from(measured.sigma());
        let regions = of_row.chunks(of_row.len().div_ceil(REGIONS));
        for (region, rows) in measured.regions().into_iter().zip(regions) {
            let truth = |&t: &usize| stretch::of_triangle(&mesh, moved, t, tree.paths());
            let truth = rows.iter().map(truth).fold(0.0, f64::max);
            let region = f64::from(region);
            assert!(region >= truth, "{region} is below {truth}");
            assert!(region <= truth.max(0.5) + sigma * 1.01 / 256.0, "{region} for {truth}");
        }
        let named = stretch::of_triangle(
            &mesh,
            moved,
            of_row[measured.triangle().0 as usize],
            tree.paths(),
        );
        assert!(named * 1.00002 >= sigma || sigma < 0.500_001, "{named} named for {sigma}");
    }
}

/// A region may begin within a fan. The edge that its first triangle shares with the previous region belongs to both.
#[test]
fn an_edge_between_two_regions_counts_for_both() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    for paths in [Paths::Edges, Paths::Surface { crossings: 2 }] {
        let built = Builder::new().stretch(3.0).paths(paths).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let rest = built.to_rows(&mesh.positions);
        let rows = tree.triangle_count().div_ceil(REGIONS as u32);
        let mut checked = [0; 2];
        for region in 1..tree.triangle_count().div_ceil(rows) {
            let first = region * rows;
            let join = tree.metric(first).expect("a row").join;
            if join == Join::Start {
                continue;
            }
            // All edges shrink, this one the least, and the third corner moves into its middle.
            let [a, b, c] =
                tree.corners(TriangleRow(first)).expect("a row").map(|row| row as usize);
            let mut moved: Vec<Vec3> = rest.iter().map(|position| *position * 0.3).collect();
            moved[b] = moved[a] + (rest[b] - rest[a]) * 0.6;
            moved[c] = (moved[a] + moved[b]) * 0.5;
            let measured = measure_stretch(&tree, moved.as_slice()).expect("within 3");
            let found = measured.regions()[region as usize];
            assert!(found >= 0.6, "{paths:?}, {region}: {found}");
            checked[usize::from(join == Join::Flip)] += 1;
        }
        assert!(checked[0] > 5 && checked[1] > 1, "{checked:?} regions begin in a fan or flip");
    }
}

#[test]
fn a_query_takes_no_stretch_of_another_tree() {
    let (mesh, built, _) = deformed(0, 0);
    let tree = built.tree::<u16>().expect("valid");
    let other = Builder::new().stretch(1.6).build(&mesh).expect("a valid mesh");
    let other = other.tree::<u16>().expect("valid");
    assert_eq!(tree.mesh_id(), other.mesh_id());
    let rows = built.to_rows(&mesh.positions);
    let measured = measure_stretch(&tree, rows.as_slice()).expect("at rest");
    let tool = Sphere::new(Vec3::new(0.0, 0.0, 90.0), 2.0).expect("valid");
    let options = Options::cold().stretch(measured);
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("deep enough");
    assert!(query.closest(rows.as_slice(), &tool, &options).is_ok());
    let mut query = Query::<_, MAX_STACK>::new(&other).expect("deep enough");
    let refused = query.closest(rows.as_slice(), &tool, &options).expect_err("another tree's");
    assert!(matches!(refused, QueryError::OtherTree { .. }), "{refused}");
}

#[test]
fn what_cannot_be_measured_is_named() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let mut rows = built.to_rows(&mesh.positions);
    assert!(measure_stretch(&tree, rows.as_slice()).is_ok());
    let short = measure_stretch(&tree, &rows[1..]);
    assert!(matches!(short, Err(StretchError::VertexCount { expected: 162, found: 161 })));
    for wrong in [f32::NAN, f32::INFINITY, 1e30] {
        let right = std::mem::replace(&mut rows[40].z, wrong);
        let refused = measure_stretch(&tree, rows.as_slice()).expect_err("is wrong");
        let StretchError::Exceeded { triangle, .. } = refused else { panic!("{refused}") };
        assert!(tree.corners(triangle).expect("named").contains(&40), "{refused}");
        rows[40].z = right;
    }
    let without = Builder::new().with_metric(false).build(&mesh).expect("a valid mesh");
    let tree = without.tree::<u16>().expect("valid");
    let refused = measure_stretch(&tree, rows.as_slice());
    assert!(matches!(refused, Err(StretchError::NoMetric)));
}

/// A triangle whose corner changed in flash, after the tree was validated, to a row outside the table: every
/// measurement names that row, and no frame is admitted.
#[test]
fn a_corner_outside_the_table_is_corrupt() {
    let (mesh, built, _) = deformed(0, 0);
    let tree = built.tree::<u16>().expect("valid");
    let (rows, vertices) = (built.to_rows(&mesh.positions), tree.vertex_count());
    let (at, _) = section(built.blob(), 2);
    let with_corner = |triangle: u32, row: u32| {
        let mut bytes = built.blob().to_vec();
        let third = at + 6 * triangle as usize + 4;
        bytes[third..third + 2].copy_from_slice(&(row as u16).to_le_bytes());
        bytes
    };
    let corrupt = |row| Err(StretchError::Corrupt { row });
    // A region begins with its first triangle until another one is the worst of a frame.
    let region = tree.triangle_count().div_ceil(REGIONS as u32);
    for triangle in [0, 1, 3 * region, 3 * region + 5, tree.triangle_count() - 1] {
        for row in [vertices, 0xFFFF] {
            let bytes = with_corner(triangle, row);
            let damaged = tree.moved_to(&bytes).expect("the same layout");
            assert_eq!(measure_stretch(&damaged, rows.as_slice()).map(|_| ()), corrupt(row));
        }
        let bytes = with_corner(triangle, vertices);
        let damaged = tree.moved_to(&bytes).expect("the same layout");
        let mut monitor = StretchMonitor::new(&damaged).expect("a block has the row");
        for _ in 0..2 {
            monitor.begin(FrameExtent::Whole);
            let incoming = IncomingSurface::new(rows.as_slice(), vertices);
            assert_eq!(monitor.advance(incoming, u32::MAX).map(|_| ()), corrupt(vertices));
        }
        let bytes = with_corner(triangle, 0xFFFF);
        let damaged = tree.moved_to(&bytes).expect("the same layout");
        let refused = StretchMonitor::new(&damaged).map(|_| ());
        assert_eq!(refused, corrupt(triangle), "no block has the row");
    }
}

/// With a tree as the admission check, a frame beyond the stretch limit is refused, and the earlier one stays.
#[test]
fn a_surface_beyond_the_stretch_limit_is_refused() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(bytes).expect("valid")));
    let rest = built.to_rows(&mesh.positions);
    const VERTICES: usize = 162;
    let frames: &'static Frames<VERTICES> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("new");
    let mut assembler = Assembler::new(writer, tree, tree.mesh_id(), 1e4);
    let mut send = |epoch: u32, scale: f32| {
        let moved: Vec<Vec3> = rest.iter().map(|p| *p * scale).collect();
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let mut encoder =
            FrameEncoder::<_, 512>::new(id, Encoding::Float, &moved[..]).expect("can be sent");
        let mut buffer = [0; 512];
        while let Some(packet) = encoder.next_packet(&mut buffer) {
            if let Some(epoch) = give(&mut assembler, packet)? {
                return Ok(epoch);
            }
        }
        panic!("frame {epoch} was neither published nor refused");
    };
    assert_eq!(send(1, 1.15), Ok(1));
    let refused = send(2, 1.25).expect_err("beyond 1.2");
    assert!(matches!(refused, ReceiveError::Stretch(_)), "{refused:?}");
    let frame = reader.read().expect("the good one stays");
    assert_eq!(frame.label().epoch, 1);
    let sigma = frame.label().stretch.expect("measured").sigma();
    assert!((1.15..1.1501).contains(&sigma), "{sigma}");
}

/// A real heart stretches strongly in few places: with a limit for each triangle, queries need less than half the node
/// tests of one limit for all, and their answers are as accurate. Prints mean node and triangle tests.
#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn limits_of_single_triangles_spare_tests_on_a_real_heart() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/heart_10272");
    let mesh = dibs_build::read(format!("{data}.ply")).expect("a mesh").mesh;
    let motion = Motion::read_pc2(format!("{data}.pc2")).expect("its motion");
    let needed = MotionStretch::new(&mesh, &motion, Paths::default(), &|_| ()).expect("fits");
    let uniform = Builder::new().stretch(2.5).build(&mesh).expect("a valid mesh");
    let limits = needed.limits(0.02);
    let learned = Builder::new().limits(limits).build(&mesh).expect("a valid mesh");
    let built = [&uniform, &learned];
    let trees = built.map(|built| built.tree::<u16>().expect("valid"));
    let mut queries =
        trees.each_ref().map(|tree| Query::<_, MAX_STACK>::new(tree).expect("deep enough"));
    let mut rng = Rng::with_seed(27);
    let mut sums = [[[0u64; 2]; 2]; 2];
    const EACH: usize = 120;
    for frame in &motion.frames {
        let rows = built.map(|built| built.to_rows(frame));
        let measured: [MeasuredStretch; 2] = std::array::from_fn(|i| {
            measure_stretch(&trees[i], rows[i].as_slice()).expect("within the limits")
        });
        for round in 0..EACH {
            let from = frame[rng.usize(..frame.len())];
            let at = from + unit(&mut rng) * rng.f32() * 60.0;
            let tool = Sphere::new(at, 3.0).expect("valid");
            let mut found = Vec::new();
            for i in 0..2 {
                let known =
                    [Options::cold(), Options::cold().stretch(measured[i])].map(Options::unsigned);
                for (options, sums) in known.iter().zip(&mut sums[i]) {
                    let answer = queries[i].closest(rows[i].as_slice(), &tool, options);
                    let answer = answer.expect("finite positions");
                    sums[0] += u64::from(answer.node_tests);
                    sums[1] += u64::from(answer.triangle_tests);
                    found.push(answer);
                }
            }
            if round % 10 == 0 {
                let truth = exhaustive(frame, &mesh.triangles, &Instrument::sphere(at, 3.0));
                let truth = truth.expect("has triangles").separation;
                for answer in found {
                    let off = (f64::from(answer.separation) - truth).abs();
                    assert!(off <= f64::from(answer.accuracy), "{off} off at {at}");
                }
            }
        }
    }
    let mean = |sum: u64| sum as f64 / (EACH * motion.frames.len()) as f64;
    for (name, sums) in ["2.5 for all", "for each triangle"].into_iter().zip(sums) {
        let [[nodes, triangles], [known_nodes, known_triangles]] = sums.map(|s| s.map(mean));
        println!(
            "limit {name}: {nodes:.0} node and {triangles:.0} triangle tests, \
             measured stretch {known_nodes:.0} and {known_triangles:.0}"
        );
    }
    let [[[uniform, _], _], [[learned, _], _]] = sums;
    assert!(learned * 2 < uniform, "{learned} node tests, {uniform} with one limit");
}
