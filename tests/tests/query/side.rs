//! Sides and signed separations compared with f64: generalised winding numbers, exhaustive search, dense sampling.
//!
//! `DIBS_POSES` sets the number of poses.
//!
//! One file, because all tests compare with the same oracle.

// Requirement: S-01

use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, FormatError, NoSide, Options, Proximity, Query, Side, Sphere, Tool, Tree,
    TriangleRow,
};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::side_poses::{POSES_OF_A_FRAME, Tally, bent, closed, judge, point};
use dibs_tests::surfaces::{self, ball, cuboid, slivers};
use dibs_tests::tree_bytes::{reseal, section};
use dibs_tests::{is_whole, sample, sides};
use fastrand::Rng;
use glam::{DVec3, Vec3};

/// The total number of poses on all surfaces.
fn poses() -> usize {
    let asked = std::env::var("DIBS_POSES").ok().map(|n| n.parse().expect("a number of poses"));
    asked.unwrap_or(if cfg!(debug_assertions) { 400 } else { sample(10_000) })
}

#[test]
fn no_side_is_wrong_and_few_are_undefined() {
    let surfaces = closed();
    let shares: usize = surfaces.iter().map(|surface| surface.share).sum();
    let mut all = Tally::default();
    for surface in &surfaces {
        let mut tally = Tally::default();
        let count = poses() * surface.share / shares;
        for seed in 0..count.div_ceil(POSES_OF_A_FRAME) {
            tally += judge(surface, seed as u64);
        }
        println!("{:24} {tally:?}", surface.name);
        all += tally;
    }
    println!("{all:?}");
    assert_eq!(all.wrong, 0, "{all:?}");
    assert!(all.undefined_away * 1000 < all.away, "{all:?}");
    assert!(all.self_cut * 100 < all.poses, "{all:?}");
}

#[test]
fn depths_are_those_of_dense_sampling() {
    const POINTS: u32 = 120;
    let surfaces = closed();
    let count = poses() / 60;
    let (mut crossing, mut inside, mut wide, mut cut, mut searches) = (0, 0, 0, 0, 0_u64);
    let mut slow = 0;
    for (seed, surface) in (1..).zip(surfaces.iter().filter(|s| s.mesh.triangles.len() < 1_000)) {
        let mut rng = Rng::with_seed(seed);
        let tree = surface.built.tree::<u16>().expect("valid");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for _ in 0..count {
            // Far from the origin the rounding of a point of the axis exceeds its distance from the surface.
            let shift = unit(&mut rng) * [0.0, 0.0, 3e4][rng.usize(..3)];
            let bent = bent(&surface.mesh, &mut rng);
            let rows = surface.built.to_rows(&bent.iter().map(|&p| p + shift).collect::<Vec<_>>());
            let at = point(&rows, &triangles, &mut rng);
            let most = if rng.bool() { 60.0 } else { 5.0 };
            let far = at + unit(&mut rng) * most * rng.f32();
            let radius = 2.0 * rng.f32();
            let capsule = Capsule::new(at, far, radius).expect("valid");
            let tool = Instrument::capsule(at, far, radius);
            let found = query.closest(rows.as_slice(), &capsule, &Options::cold());
            let found = found.expect("an answer");
            if !matches!(found.side, Side::Crossing | Side::Inside) {
                continue;
            }
            let truth = sides::deepest_separation(&rows, &triangles, &tool, POINTS);
            let Some((low, high)) = truth else { continue };
            let accuracy = f64::from(found.accuracy);
            let (lower, upper) = (f64::from(found.lower), f64::from(found.separation));
            let holds = lower <= high + accuracy && upper >= low - accuracy;
            if !holds && sides::is_cut_along(&rows, &triangles, &tool, POINTS) {
                cut += 1;
                continue;
            }
            assert!(holds, "{}: {tool:?} {found:?} {low} {high}", surface.name);
            if found.side == Side::Inside {
                inside += 1;
            } else {
                crossing += 1;
            }
            // The side alone costs the closest pair, and gives an interval for the depth.
            let [side, plain] =
                [Options::cold().depth_tolerance(f32::INFINITY), Options::cold().unsigned()].map(
                    |options| {
                        query.closest(rows.as_slice(), &capsule, &options).expect("an answer")
                    },
                );
            let touches = Side::Undefined(NoSide::BelowAccuracy);
            assert!(side.side == found.side || side.side == touches, "{side:?}");
            // Ties that f32 cannot resolve use up node tests for their work in f64.
            assert!(side.node_tests >= plain.node_tests, "{side:?} {plain:?}");
            assert_eq!(side.triangle_tests, plain.triangle_tests, "{side:?} {plain:?}");
            slow += u64::from(side.node_tests > plain.node_tests);
            let (lower, upper) = (f64::from(side.lower), f64::from(side.separation));
            assert!(lower <= low + accuracy && upper >= low - accuracy, "{side:?} {low} {high}");
            searches += u64::from(found.node_tests);
            // The stated depth is the depth of the stated point.
            let deepest = capsule.axis_point(found.axis_parameter);
            let depth = sides::depth(&rows, &triangles, deepest);
            let stated = -f64::from(found.separation) - f64::from(radius);
            let off = depth.map(|depth| (depth.max(0.0) - stated).abs());
            assert!(off.is_some() || shift != Vec3::ZERO, "a clear side");
            let is_off = off.is_some_and(|off| off > accuracy);
            assert!(stated == 0.0 || !is_off, "{}: off {off:?} {found:?}", surface.name);
            let tolerance = (capsule.axis_length() / 512.0).max(32.0 * found.accuracy);
            if found.separation - found.lower > tolerance {
                wide += 1;
                println!("{}: {tool:?} {found:?}", surface.name);
            }
        }
    }
    println!(
        "{crossing} axes cross, {inside} are inside, {wide} depths wider than the tolerance, {cut} along a surface that cuts itself, \
         {slow} sides by f64, {} node tests in the mean",
        searches / (crossing + inside).max(1)
    );
    assert!(inside as usize > count / 6);
    assert!(slow * 10 < crossing + inside, "{slow} of {crossing} and {inside}");
    assert!(crossing as usize > count / 10 && wide * 50 < crossing as usize);
}

/// From far outside a ball to near its middle, the separation decreases steadily, and the direction points out.
#[test]
fn the_way_out_of_a_ball_never_turns() {
    let mesh = ball(4);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let direction = Vec3::new(0.3, 0.2, 0.9).normalize();
    let mut before: Option<Proximity> = None;
    for step in 0..6_000 {
        let out = 60.0 - 0.01 * step as f32;
        for length in [0.0, 10.0] {
            let (tip, end) = (direction * out, direction * (out + length));
            let found = if length > 0.0 {
                let capsule = Capsule::new(tip, end, 2.0).expect("valid");
                query.closest(rows.as_slice(), &capsule, &Options::cold())
            } else {
                query.closest(
                    rows.as_slice(),
                    &Sphere::new(tip, 2.0).expect("valid"),
                    &Options::cold(),
                )
            };
            let found = found.expect("an answer");
            if out > 3.0 && (length == 0.0 || out > 32.0) {
                assert!(found.direction.dot(direction) > 0.8, "{out}: {found:?}");
            }
            if length == 0.0 {
                if let Some(before) = before {
                    let change = before.separation - found.separation;
                    assert!((0.0..0.011).contains(&change) || out < 1.0, "{out}: {change}");
                }
                before = Some(found);
            }
        }
    }
}

/// Axes above a face, at its edge and across it, closer than a side needs: the interval still contains the distance.
#[test]
fn next_to_a_face_the_interval_holds_the_distance() {
    const TOP: f32 = 20.0;
    let (positions, triangles) = cuboid(Vec3::ZERO, Vec3::splat(TOP));
    let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let axes = [
        [Vec3::new(5.0, 6.0, 0.0), Vec3::new(15.0, 9.0, 0.0)],
        [Vec3::new(-5.0, 6.0, 0.0), Vec3::new(30.0, 9.0, 0.0)],
        [Vec3::new(5.0, 6.0, 0.0), Vec3::new(15.0, 9.0, 10.0)],
    ];
    let mut undefined = 0;
    for [start, end] in axes {
        let mut ask = |height: f32| {
            let up = Vec3::Z * (TOP + height);
            let capsule = Capsule::new(start + up, end + up, 2.5).expect("valid");
            query.closest(rows.as_slice(), &capsule, &Options::cold()).expect("an answer")
        };
        let accuracy = ask(1.0).accuracy;
        for step in 0..=40 {
            let height = TOP + accuracy * step as f32 / 10.0 - TOP;
            let found = ask(height);
            let truth = f64::from(height) - 2.5;
            let (lower, upper) = (f64::from(found.lower), f64::from(found.separation));
            let accuracy = f64::from(found.accuracy);
            let holds = lower - accuracy <= truth && truth <= upper + accuracy;
            assert!(holds, "{height}: {found:?}");
            undefined += u32::from(found.side == Side::Undefined(NoSide::BelowAccuracy));
        }
    }
    assert!(undefined > 40, "{undefined}");
}

#[test]
fn a_side_that_is_not_there_says_why() {
    let ask = |built: &BuiltTree, mesh: &Mesh, at: Vec3, options: Options| {
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let tool = Sphere::new(at, 1.0).expect("valid");
        query.closest(rows.as_slice(), &tool, &options).expect("an answer")
    };
    let is = |found: Proximity, reason| {
        assert_eq!(found.side, Side::Undefined(reason));
        assert!((found.separation - (found.axis_distance - 1.0)).abs() < 1e-6);
    };
    let open = slivers(20);
    let built = Builder::new().build(&open).expect("a valid mesh");
    is(ask(&built, &open, Vec3::new(-5.0, 0.0, 1.0), Options::cold()), NoSide::OpenBoundary);
    let over = ask(&built, &open, Vec3::new(40.0, 2.0, 3.0), Options::cold());
    assert_eq!(over.side, Side::Outside);
    let under = ask(&built, &open, Vec3::new(40.0, 2.0, -3.0), Options::cold());
    assert_eq!(under.side, Side::Inside);
    let round = ball(2);
    let at = Vec3::new(10.0, 9.0, 8.0);
    let bare = Builder::new().with_adjacency(false).build(&round).expect("a valid mesh");
    is(ask(&bare, &round, at, Options::cold()), NoSide::NoAdjacency);
    let built = Builder::new().build(&round).expect("a valid mesh");
    is(ask(&built, &round, at, Options::cold().unsigned()), NoSide::NotAsked);
    let short = Budget::new(17);
    let cut = ask(&built, &round, at, Options::cold().budget(short));
    assert_eq!(cut.side, Side::Undefined(NoSide::CutShort));
    assert_eq!(ask(&built, &round, at, Options::cold()).side, Side::Inside);
    is(ask(&built, &round, round.positions[0], Options::cold()), NoSide::BelowAccuracy);
    // One triangle is wound against its neighbours: the surface has no sides, and the tree no adjacency.
    let mut twisted = round.clone();
    twisted.triangles[7].swap(0, 1);
    let built = Builder::new().build(&twisted).expect("a valid mesh");
    is(ask(&built, &twisted, at, Options::cold()), NoSide::NoAdjacency);
}

/// A budget that ends the search for the depth leaves an interval that contains the depth.
#[test]
fn a_depth_that_was_cut_short_is_certified() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Capsule::new(Vec3::new(5.0, 3.0, 1.0), Vec3::new(60.0, 20.0, -9.0), 2.0);
    let tool = tool.expect("valid");
    let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
    assert_eq!(whole.side, Side::Crossing);
    let mut cut_short = 0;
    for node_tests in (0..whole.work() + 40).step_by(5) {
        let budget = Budget::new(node_tests);
        let cut = query.closest(rows.as_slice(), &tool, &Options::cold().budget(budget));
        let cut = cut.expect("a short budget is no error");
        assert!(cut.work() <= node_tests + 1 + Budget::TRIANGLE, "{budget:?} {cut:?}");
        if cut.side == Side::Crossing {
            assert!(cut.lower <= whole.separation && cut.separation >= whole.lower, "{cut:?}");
            cut_short += usize::from(cut.separation > whole.separation + 1.0);
        } else {
            assert_eq!(cut.side, Side::Undefined(NoSide::CutShort));
        }
    }
    assert!(cut_short > 3, "{cut_short}");
}

#[test]
fn neighbours_share_their_edges_and_wrong_ones_are_refused() {
    for (index, width) in [(IndexWidth::Bits16, 2), (IndexWidth::Bits32, 4)] {
        let mesh = ball(2);
        let built = Builder::new().index(index).build(&mesh).expect("a valid mesh");
        let (at, _) = section(built.blob(), 8);
        for place in 0..3 * mesh.triangles.len() {
            let mut bytes = built.blob().to_vec();
            let code = &mut bytes[at + place * width..][..width];
            code[0] ^= 1 << (place % 8);
            reseal(&mut bytes);
            let error = match width {
                2 => Tree::<u16>::from_bytes(&bytes).err(),
                _ => Tree::<u32>::from_bytes(&bytes).err(),
            };
            let is_named = matches!(error, Some(FormatError::Neighbour { .. }));
            assert!(is_named, "neighbour {place}: {error:?}");
        }
    }
}

/// Every triangle of a closed surface has a neighbour at each edge, even if 16 bits cannot number all triangles; and a
/// tree with adjacency and vertex order is small.
#[test]
fn a_tree_with_adjacency_takes_at_most_16_bytes_a_triangle() {
    // The largest has as many vertices as 16 bits can count.
    let sizes = [if cfg!(debug_assertions) { 2_000 } else { 10_272 }, 66_000];
    for &triangles in &sizes[..if is_whole() { 2 } else { 1 }] {
        let mesh = generate::brain(triangles).expect("a valid size");
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let summary = built.summary();
        let bytes = summary.query_bytes + summary.adjacency_bytes + 2 * mesh.positions.len();
        let each = bytes as f64 / f64::from(triangles);
        println!(
            "{triangles} triangles: {each:.2} bytes each, vertex order and adjacency among them"
        );
        assert!(each <= 16.0);
        for row in (0..tree.triangle_count()).map(TriangleRow) {
            let [a, b, c] = tree.corners(row).expect("in the table");
            for (edge, from, to) in [(0, a, b), (1, b, c), (2, c, a)] {
                let other = tree.neighbour(row, edge).expect("a closed surface");
                let [a, b, c] = tree.corners(other).expect("in the table");
                assert!([(a, b), (b, c), (c, a)].contains(&(to, from)), "{row} {edge}");
            }
        }
    }
}

/// A vertex whose triangles form a saddle is never the closest point, but nearly so, and its pseudonormal proves
/// nothing. Here a tooth hangs over a point, and the triangles around it face the other way.
#[test]
fn no_side_is_wrong_next_to_a_saddle() {
    let mut rng = Rng::with_seed(21);
    let (mut stated, mut undefined, mut wrong) = (0, 0, 0);
    for _ in 0..if cfg!(debug_assertions) { 20 } else { sample(4_000) } {
        let apex = Vec3::new(40.0, -17.0, 16.0);
        let mut between = |from: f32, to: f32| from + (to - from) * rng.f32();
        let flat = [between(-1e-3, 1e-3), between(-1e-3, 1e-3)];
        let steep = [between(-0.95, -0.2), between(-0.95, -0.2)];
        let tooth = -between(0.2, 1.0);
        let ring = [
            (0.0, flat[0]),
            (tooth, flat[1]),
            (between(1.5, 3.1), steep[0]),
            (between(-1.2, 0.2), steep[1]),
        ];
        let mut positions: Vec<Vec3> = ring
            .iter()
            .map(|&(angle, sine): &(f32, f32)| {
                let level = (1.0 - sine * sine).sqrt();
                let along = Vec3::new(level * angle.cos(), level * angle.sin(), sine);
                apex + between(3.0, 10.0) * along
            })
            .collect();
        positions.extend([apex, apex - 40.0 * Vec3::Z]);
        let around = [(0, 1), (1, 2), (2, 3), (3, 0)];
        let triangles: Vec<[u32; 3]> =
            around.iter().flat_map(|&(a, b)| [[4, a, b], [5, b, a]]).collect();
        let mesh = Mesh { positions, triangles, origin: DVec3::ZERO };
        let built = Builder::new().stretch(4.0).build(&mesh).expect("a valid mesh");
        let rows = built.to_rows(&mesh.positions);
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for _ in 0..20 {
            let distance = 10_f32.powf(-3.3 + 1.5 * rng.f32());
            let point = apex + distance * (Vec3::Z + 0.01 * unit(&mut rng));
            let sphere = Sphere::new(point, 0.0).expect("finite");
            let found = query.closest(rows.as_slice(), &sphere, &Options::cold());
            let pair = exhaustive(&rows, &triangles, &Instrument::sphere(point, 0.0));
            // Such a surface may intersect itself, so the nearest sheet decides.
            let inside = sides::is_below(&rows, &triangles, &pair.expect("it has triangles"));
            match found.expect("an answer").side {
                Side::Undefined(_) => undefined += 1,
                side => {
                    stated += 1;
                    wrong += usize::from((side == Side::Inside) != inside);
                }
            }
        }
    }
    println!("{stated} sides stated, {undefined} undefined, {wrong} wrong");
    assert_eq!(wrong, 0);
    assert!(cfg!(debug_assertions) || stated > sample(2_000), "{stated}");
}

/// A path may lead around an open surface: an axis without intersection may have points on both sides.
#[test]
fn a_depth_behind_an_open_sheet_is_found() {
    // Two sheets with a gap between them, and a wall that the axis meets.
    let sheet = |x: [f32; 2]| {
        let [left, right] = x;
        [[left, 0.0, 0.0], [right, 0.0, 0.0], [right, 10.0, 0.0], [left, 10.0, 0.0]]
    };
    let wall = [[9.0, 0.0, -5.0], [9.0, 0.0, 5.0], [9.0, 10.0, 5.0], [9.0, 10.0, -5.0]];
    let corners = [sheet([-10.0, -2.0]), sheet([2.0, 8.0]), wall];
    let positions = corners.concat().into_iter().map(Vec3::from).collect();
    let triangles =
        (0..3).flat_map(|part| [[0, 1, 2], [0, 2, 3]].map(|row| row.map(|c| 4 * part + c)));
    let mesh = Mesh { positions, triangles: triangles.collect(), ..Mesh::default() };
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");

    let (start, end) = (Vec3::new(-10.0, 5.0, 2.5), Vec3::new(9.5, 5.0, -2.375));
    let mut deepest = 0.0_f32;
    for share in 0..=2_000 {
        let point = Sphere::new(start.lerp(end, share as f32 / 2_000.0), 0.0).expect("finite");
        let found = query.closest(rows.as_slice(), &point, &Options::cold()).expect("an answer");
        if found.side == Side::Inside {
            deepest = deepest.max(found.axis_distance);
        }
    }
    assert!(deepest > 1.0, "{deepest}: no point is behind the sheet");
    let axis = Capsule::new(start, end, 0.5).expect("finite");
    let found = query.closest(rows.as_slice(), &axis, &Options::cold()).expect("an answer");
    assert_eq!(found.side, Side::Crossing);
    assert!(found.lower <= -0.5 - deepest + found.accuracy, "{deepest} deep: {found:?}");
}

/// Two bodies next to each other: the axis leaves one and enters the other within less than the accuracy.
#[test]
fn a_depth_behind_a_narrow_gap_is_found() {
    for gap in [0.0002, 0.001, 0.01] {
        let near = cuboid(Vec3::new(-20.0, -20.0, -20.0), Vec3::new(0.0, 20.0, 20.0));
        let far = cuboid(Vec3::new(gap, -20.0, -20.0), Vec3::new(40.0, 20.0, 20.0));
        let positions = [near.0, far.0].concat();
        let triangles = near.1.into_iter().chain(far.1.map(|row| row.map(|corner| corner + 8)));
        let mesh = Mesh { positions, triangles: triangles.collect(), ..Mesh::default() };
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        // In the middle of one body, and 2 mm or 18 mm behind the face of the other.
        for [start, end] in [[-2.0, 18.0], [18.0, -2.0], [-10.0, 2.0], [2.0, -10.0]] {
            for lean in 0..20 {
                let y = 0.1 * lean as f32 - 1.0;
                let (start, end) = (Vec3::new(start, y, 1.0), Vec3::new(end, 0.7 * y, 2.0));
                let axis = Capsule::new(start, end, 0.5).expect("finite");
                let found =
                    query.closest(rows.as_slice(), &axis, &Options::cold()).expect("an answer");
                let deepest = if start.x.max(end.x) > 10.0 { 18.0 - gap } else { 10.0 };
                let (most, least) = (-found.lower - 0.5, -found.separation - 0.5);
                let accuracy = 2.0 * found.accuracy;
                let is_right = most >= deepest - accuracy && least <= deepest + accuracy;
                assert!(is_right, "gap {gap}, {start} to {end}: {least} to {most} deep");
            }
        }
    }
}

/// An axis through more bodies than a search distinguishes, one of which is thick.
#[test]
fn a_depth_behind_many_bodies_is_found() {
    for (count, thick) in [2, 5, 12, 40].into_iter().flat_map(|n| (0..n).map(move |at| (n, at))) {
        let (mut positions, mut triangles, mut at) = (Vec::new(), Vec::new(), 0.0);
        for body in 0..count {
            let thickness = if body == thick { 30.0 } else { 1.0 };
            let low = Vec3::new(at, -20.0, -20.0);
            let (corners, faces) = cuboid(low, Vec3::new(at + thickness, 20.0, 20.0));
            let first = positions.len() as u32;
            positions.extend(corners);
            triangles.extend(faces.map(|row| row.map(|corner| first + corner)));
            at += thickness + 1.0;
        }
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let (start, end) = (Vec3::new(-1.0, 0.5, 1.0), Vec3::new(at, 1.5, 2.0));
        for [start, end] in [[start, end], [end, start]] {
            let axis = Capsule::new(start, end, 0.5).expect("finite");
            let found = query.closest(rows.as_slice(), &axis, &Options::cold()).expect("an answer");
            assert_eq!(found.side, Side::Crossing);
            // Half of the thickness.
            let (most, least) = (-found.lower - 0.5, -found.separation - 0.5);
            assert!(most >= 14.99 && least <= 15.01, "{thick} of {count}: {least} to {most} deep");
        }
    }
}
