//! Sides at ties between sheets, compared with winding numbers: touching or collapsed walls, blades, spikes, lattices.
//!
//! `DIBS_CLIMBS` sets the number of hill climbs towards ties.
//!
//! One file, because all tests compare with the same oracle.

// Requirement: S-01

use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, WindingError, check_winding, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, NoSide, Odometer, Options, Proximity, Query, Side, Sphere, Tool, Tracker, Tree,
};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::sample;
use dibs_tests::sides::{is_inside, winding_number};
use dibs_tests::surfaces::{ball, cuboid, joined, triangles};
use fastrand::Rng;
use glam::{DVec3, Vec3};

fn mesh(positions: impl Into<Vec<Vec3>>, triangles: impl Into<Vec<[u32; 3]>>) -> Mesh {
    Mesh { positions: positions.into(), triangles: triangles.into(), ..Mesh::default() }
}

fn block(low: Vec3, high: Vec3) -> Mesh {
    let (positions, triangles) = cuboid(low, high);
    mesh(positions, triangles)
}

fn tetrahedron() -> Mesh {
    let corners = [[20.0; 3], [-20.0, -20.0, 20.0], [-20.0, 20.0, -20.0], [20.0, -20.0, -20.0]];
    mesh(corners.map(Vec3::from), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// A wedge 90 mm long, with a back this thick.
fn blade(thickness: f32) -> Mesh {
    let section = [Vec3::ZERO, Vec3::new(90.0, 0.0, thickness * 0.5), Vec3::Z * thickness];
    let turn = glam::Quat::from_rotation_y(0.6) * glam::Quat::from_rotation_x(0.2);
    let ends = [0.0, 120.0].map(|y| section.map(|at| turn * (at + Vec3::Y * y)));
    let mut all = vec![[0, 1, 2], [3, 5, 4]];
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        all.extend([[a, a + 3, b], [b, a + 3, b + 3]]);
    }
    mesh(ends.as_flattened(), all)
}

/// A plate of 8 by 8 squares, whose two walls are flat grids.
fn plate(thickness: f32) -> Mesh {
    const N: u32 = 8;
    let (mut positions, mut all) = (Vec::new(), Vec::new());
    let row = |x: u32, y: u32, top: u32| 2 * (y * (N + 1) + x) + top;
    let place = |n: u32| (n as f32 / N as f32 - 0.5) * 60.0;
    for y in 0..=N {
        for x in 0..=N {
            positions.push(Vec3::new(place(x), place(y), 0.0));
            positions.push(Vec3::new(place(x), place(y), thickness));
            if x < N && y < N {
                let at =
                    |top| [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| row(x + i, y + j, top));
                let ([a, b, c, d], [e, f, g, h]) = (at(0), at(1));
                all.extend([[a, c, b], [a, d, c], [e, f, g], [e, g, h]]);
            }
        }
    }
    for n in 0..N {
        for [from, to] in
            [[(n, 0), (n + 1, 0)], [(N, n), (N, n + 1)], [(n + 1, N), (n, N)], [(0, n + 1), (0, n)]]
        {
            let [a, b] = [from, to].map(|(x, y)| row(x, y, 0));
            all.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    mesh(positions, all)
}

/// A cone with this many triangles at its apex, twice as high as wide.
fn cone(sides: u32) -> Mesh {
    let mut positions = vec![Vec3::Z * 40.0, Vec3::ZERO];
    let mut all = Vec::new();
    for n in 0..sides {
        let angle = n as f32 * std::f32::consts::TAU / sides as f32;
        positions.push(Vec3::new(10.0 * angle.cos(), 10.0 * angle.sin(), 0.0));
        let (a, b) = (2 + n, 2 + (n + 1) % sides);
        all.extend([[0, a, b], [1, b, a]]);
    }
    mesh(positions, all)
}

/// A ball with spikes and dents.
fn star() -> Mesh {
    let mut star = ball(2);
    for (number, position) in star.positions.iter_mut().enumerate() {
        *position *= [0.4, 1.5, 0.9, 1.0, 0.7][number % 5];
    }
    star
}

/// Two cubes that share the vertices of an edge.
fn pinched() -> Mesh {
    let low = block(Vec3::ZERO, Vec3::splat(10.0));
    let mut all = joined(&[low, block(Vec3::new(10.0, 10.0, 0.0), Vec3::new(20.0, 20.0, 10.0))]);
    let positions = all.positions.clone();
    let first = |at: u32| positions.iter().position(|p| *p == positions[at as usize]);
    for corners in &mut all.triangles {
        *corners = corners.map(|v| first(v).expect("in the list") as u32);
    }
    let used = |v: u32| all.triangles.iter().any(|corners| corners.contains(&v));
    let kept: Vec<u32> = (0..positions.len() as u32).filter(|&v| used(v)).collect();
    let row = |v: u32| kept.iter().position(|&k| k == v).expect("kept") as u32;
    let renamed = all.triangles.iter().map(|corners| corners.map(row)).collect::<Vec<_>>();
    mesh(kept.iter().map(|&v| positions[v as usize]).collect::<Vec<_>>(), renamed)
}

fn build(mesh: &Mesh) -> BuiltTree {
    let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5);
    builder.build(mesh).expect("a valid mesh")
}

/// A surface at rest, and its frame.
struct Subject {
    name: &'static str,
    rest: Mesh,
    frame: Vec<Vec3>,
}

fn subjects() -> Vec<Subject> {
    let rest = |name, rest: Mesh| Subject { name, frame: rest.positions.clone(), rest };
    let low = Vec3::new(-20.0, -20.0, -20.0);
    let halves = |gap: f32| {
        joined(&[block(low, Vec3::new(20.0, 20.0, 0.0)), block(Vec3::new(-20.0, -20.0, gap), -low)])
    };
    let mut all = vec![
        rest("tetrahedron", tetrahedron()),
        rest("block", block(low, -low)),
        rest("octahedron", ball(0)),
        rest("star", star()),
        rest("cone", cone(24)),
        rest("blade", blade(0.1)),
        rest("razor", blade(0.002)),
        rest("pinched", pinched()),
        rest("halves apart", halves(1e-4)),
        rest("halves that touch", halves(0.0)),
        rest("heart", generate::heart(320).expect("a valid size").mesh),
    ];
    for thickness in [0.3, 2e-3, 5e-4, 1e-5, 0.0] {
        let flat = plate(thickness);
        all.push(Subject { name: "plate", rest: plate(1.0), frame: flat.positions });
    }
    // The walls have collapsed except at the rim.
    let mut vessel = Subject { name: "vessel", rest: plate(1.0), frame: plate(1.0).positions };
    for position in &mut vessel.frame {
        if position.x.abs() < 25.0 && position.y.abs() < 25.0 {
            position.z = 0.5;
        }
    }
    all.push(vessel);
    all
}

#[derive(Default, Debug)]
struct Tally {
    asked: usize,
    wrong: usize,
    /// Undefined sides, although no two sheets tie within 1e-6 of the distance.
    undefined: usize,
    ties: usize,
}

/// A surface with all kinds of queries.
struct Asked<'t> {
    tree: &'t Tree<'t, u16>,
    rows: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    query: Query<'t, u16, 512>,
    tracker: Tracker<'t, u16, MAX_STACK, 256>,
    /// Units a millimetre.
    unit: f32,
    tally: Tally,
}

impl<'t> Asked<'t> {
    fn new(tree: &'t Tree<'t, u16>, rows: Vec<Vec3>, unit: f32) -> Self {
        Self {
            unit,
            triangles: triangles(tree),
            rows,
            query: Query::new(tree).expect("deep enough"),
            tracker: Tracker::new(tree).expect("deep enough"),
            tree,
            tally: Tally::default(),
        }
    }

    /// By how much a sheet with the wrong side is farther than the closest, relative to the distance: the least value.
    fn lead(&self, at: DVec3, inside: bool) -> f64 {
        let (mut closest, mut wrong) = (f64::INFINITY, f64::INFINITY);
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|v| self.rows[v as usize].as_dvec3());
            let pair = dibs_tests::oracle::closest_pair(at, at, [a, b, c]);
            let is_above = (b - a).cross(c - a).dot(at - a) > 0.0;
            closest = closest.min(pair.distance);
            if is_above == inside {
                wrong = wrong.min(pair.distance);
            }
        }
        (wrong - closest) / closest
    }

    fn note(&mut self, name: &str, found: &Proximity, inside: bool, lead: f64) {
        let says = match found.side {
            Side::Outside => Some(false),
            Side::Inside => Some(true),
            _ => None,
        };
        self.tally.asked += 1;
        let is_wrong = says.is_some_and(|says| says != inside);
        self.tally.wrong += usize::from(is_wrong);
        if is_wrong && self.tally.wrong < 4 {
            println!("{name}: inside: {inside}, lead {lead:e}, {found:?}");
        }
        self.tally.ties += usize::from(lead < 1e-6);
        if says.is_none() && lead > 1e-6 && self.tally.undefined < 4 {
            println!("{name}: lead {lead:e}, {found:?}");
        }
        self.tally.undefined += usize::from(says.is_none() && lead > 1e-6);
    }

    fn each<T: Tool>(&mut self, tool: &T, instrument: Instrument, at: Vec3) -> Option<f64> {
        let pair = exhaustive(&self.rows, &self.triangles, &instrument)?;
        let options = Options::cold();
        let query = self.query.closest(self.rows.as_slice(), tool, &options).expect("an answer");
        if pair.axis_distance < 4.0 * f64::from(query.accuracy) {
            return None;
        }
        let inside = is_inside(&self.rows, &self.triangles, at.as_dvec3())?;
        let lead = self.lead(pair.on_axis, inside);
        let batched = self.query.closest_batched(self.rows.as_slice(), tool, &options);
        let mut odometer = Odometer::new(self.tree);
        let surface = odometer.start(self.rows.as_slice());
        let tracked = self.tracker.closest(&surface, tool, &Options::new()).expect("an answer");
        self.note("query", &query, inside, lead);
        self.note("batched", &batched.expect("an answer"), inside, lead);
        self.note("tracker", &tracked.closest, inside, lead);
        Some(lead)
    }

    /// Climbs from a random point to a tie between the closest sheet and one with the wrong side.
    fn climb(&mut self, rng: &mut Rng, steps: usize) {
        let corners = self.triangles[rng.usize(..self.triangles.len())];
        let [a, b, c] = corners.map(|v| self.rows[v as usize]);
        let across = (b - a).cross(c - a).normalize_or(Vec3::Z);
        let off = self.unit * 10_f32.powf(rng.f32() * 4.0 - 2.5);
        let lattice = 2.0 / self.unit;
        let mut at = match rng.u32(..4) {
            0 => a + unit(rng) * off,
            1 => a.lerp(b, rng.f32()) + unit(rng) * off,
            2 => a.lerp(b, rng.f32()).lerp(c, rng.f32()) + across * off * (rng.f32() - 0.5) * 4.0,
            // In the plane of the triangle, on a lattice.
            _ => {
                ((a + (b - a) * 2.0 * rng.f32() + (a - c) * rng.f32()) * lattice).round() / lattice
            }
        };
        let span = (rng.bool()).then(|| unit(rng) * self.unit * 30.0 * rng.f32());
        let mut best = f64::INFINITY;
        for _ in 0..steps {
            let step = unit(rng) * off * 10_f32.powf(-5.0 * rng.f32());
            let next = if best < f64::INFINITY { at + step } else { at };
            let lead = match span {
                None => {
                    let tool = Sphere::new(next, 0.0).expect("valid");
                    self.each(&tool, Instrument::sphere(next, 0.0), next)
                }
                Some(span) => {
                    let tool = Capsule::new(next, next + span, 0.0).expect("valid");
                    self.each(&tool, Instrument::capsule(next, next + span, 0.0), next)
                }
            };
            match lead {
                Some(lead) if lead <= best => (at, best) = (next, lead),
                Some(_) => (),
                None if best < f64::INFINITY => (),
                None => return,
            }
        }
    }
}

/// Climbs to ties on every kind of surface: no side is wrong there, with a query, a batched one, or a tracker.
#[test]
fn no_side_is_wrong_where_sheets_tie() {
    climb_everywhere(1.0);
}

/// The same in long and in short units, where squares of areas leave the range of f32.
#[test]
fn no_side_is_wrong_in_any_unit() {
    for unit in [1e-9, 1e-6, 1e5, 1e6] {
        climb_everywhere(unit);
    }
}

/// With this many units a millimetre.
fn climb_everywhere(unit: f32) {
    let climbs = std::env::var("DIBS_CLIMBS").map_or(sample(12), |n| n.parse().expect("a number"));
    let (mut ties, mut asked) = (0, 0);
    for (seed, mut subject) in (1..).zip(subjects()) {
        let mut rng = Rng::with_seed(seed);
        for position in subject.rest.positions.iter_mut().chain(&mut subject.frame) {
            *position *= unit;
        }
        let built = build(&subject.rest);
        let tree = built.tree::<u16>().expect("valid");
        let mut all = Asked::new(&tree, built.to_rows(&subject.frame), unit);
        for _ in 0..climbs {
            all.climb(&mut rng, 40);
        }
        let Subject { name, .. } = subject;
        println!("{unit:e} {name:20} {:?}", all.tally);
        assert_eq!(all.tally.wrong, 0, "{unit:e} {name}: {:?}", all.tally);
        assert!(all.tally.undefined * 100 <= all.tally.asked, "{unit:e} {name}: {:?}", all.tally);
        (ties, asked) = (ties + all.tally.ties, asked + all.tally.asked);
    }
    assert!(ties * 20 > asked, "{ties} ties of {asked}");
}

/// On a lattice through vertices, edges and planes, every point that is not on the surface has a side, and outside it
/// the direction points away from the closest point.
#[test]
fn lattice_points_have_a_side() {
    for rest in [tetrahedron(), ball(0), block(Vec3::splat(-20.0), Vec3::splat(20.0)), pinched()] {
        let built = build(&rest);
        let tree = built.tree::<u16>().expect("valid");
        let mut all = Asked::new(&tree, built.to_rows(&rest.positions), 1.0);
        let mut sides = [0; 2];
        for number in 0..17_i32.pow(3) {
            let place = |n: i32| (n % 17 - 8) as f32 * 5.0;
            let at = Vec3::new(place(number), place(number / 17), place(number / 289));
            let tool = Sphere::new(at, 0.5).expect("valid");
            let found = all.query.closest(all.rows.as_slice(), &tool, &Options::cold());
            let found = found.expect("an answer");
            if found.axis_distance < 1e-3 {
                continue;
            }
            let inside = winding_number(&all.rows, &all.triangles, at.as_dvec3()) > 0.5;
            let expected = if inside { Side::Inside } else { Side::Outside };
            assert_eq!(found.side, expected, "{at} {found:?}");
            let out = (at - found.point_on_surface).normalize() * if inside { -1.0 } else { 1.0 };
            assert!(out.dot(found.direction) > 0.999, "{at} {found:?}");
            sides[usize::from(inside)] += 1;
        }
        assert!(sides[0] > 100 && sides[1] > 0, "{sides:?}");
    }
}

/// More triangles tie than are stored: at a spike, on the axis of a cylinder, and in the middle of a ball.
#[test]
fn many_ties_have_a_side() {
    let mut drum = Mesh::default();
    for n in 0..60 {
        let angle = n as f32 * std::f32::consts::TAU / 60.0;
        let at = |z: f32| Vec3::new(10.0 * angle.cos(), 10.0 * angle.sin(), z);
        drum.positions.extend([at(-30.0), at(30.0)]);
        let (a, b) = (2 * n, 2 * (n + 1) % 120);
        drum.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1], [121, b, a], [120, a + 1, b + 1]]);
    }
    drum.positions.extend([Vec3::Z * 30.0, Vec3::Z * -30.0]);
    let spike = cone(100);
    let leaning = Vec3::new(3.0, 1.0, 46.0);
    for (mesh, at, side) in [
        (&spike, leaning, Side::Outside),
        (&spike, Vec3::Z * 45.0, Side::Outside),
        (&drum, Vec3::Z * 5.0, Side::Inside),
        (&drum, Vec3::ZERO, Side::Inside),
        (&ball(3), Vec3::ZERO, Side::Inside),
    ] {
        let built = build(mesh);
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let ask = |query: &mut Query<u16, MAX_STACK>, tests: u32| {
            let tool = Sphere::new(at, 1.0).expect("valid");
            let budget = Budget::new(tests);
            let options = Options::cold().budget(budget);
            query.closest(rows.as_slice(), &tool, &options).expect("an answer")
        };
        let found = ask(&mut query, u32::MAX);
        assert_eq!(found.side, side, "{at} {found:?}");
        // Whatever the budget, the side is correct or unknown, and the budget is not exceeded.
        for tests in (0..found.work() + 10).step_by(7) {
            let cut = ask(&mut query, tests);
            assert!(cut.side == side || cut.side == Side::Undefined(NoSide::CutShort), "{cut:?}");
            assert!(cut.work() <= tests + 1 + Budget::TRIANGLE, "{tests} {cut:?}");
        }
    }
    // The deepest point of a capsule is on the axis of the drum.
    let built = build(&drum);
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&drum.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Capsule::new(Vec3::ZERO, Vec3::Z * 60.0, 1.0).expect("valid");
    let found = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
    assert_eq!(found.side, Side::Crossing);
    assert!(found.separation < -10.9 && found.lower > -11.2, "{found:?}");
}

/// A collapsed wall looks like a slit, so there is no side above it; the rim decides.
#[test]
fn a_collapsed_vessel_has_no_inside() {
    let built = build(&block(Vec3::ZERO, Vec3::new(100.0, 100.0, 2.0)));
    let tree = built.tree::<u16>().expect("valid");
    let ask = |thickness: f32, at: Vec3| {
        let flat = block(Vec3::ZERO, Vec3::new(100.0, 100.0, thickness));
        let rows = built.to_rows(&flat.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let tool = Sphere::new(at, 1.0).expect("valid");
        query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer")
    };
    for at in [Vec3::new(49.0, 30.0, 20.0), Vec3::new(49.0, 30.0, -20.0)] {
        let found = ask(0.0, at);
        assert_eq!(found.side, Side::Undefined(NoSide::BelowAccuracy));
        assert!((found.separation - 19.0).abs() < 1e-3, "{found:?}");
        assert!(found.direction.dot(Vec3::Z * at.z.signum()) > 0.999);
        assert_eq!(ask(1e-5, at).side, Side::Outside);
    }
}

/// A tracker that comes from a known side to a collapsed part may have moved far enough to be on either side: it says so,
/// and its interval holds both, on which a wall acts.
#[test]
fn a_kept_answer_above_a_collapsed_part_may_be_on_either_side() {
    const THICKNESS: f32 = 2.0;
    let mesh = plate(THICKNESS);
    let built = build(&mesh);
    let tree = built.tree::<u16>().expect("valid");
    let is_rim = |at: f32| at.abs() > 29.0;
    let collapsed = |at: &Vec3| if is_rim(at.x) || is_rim(at.y) { *at } else { at.with_z(0.0) };
    let positions: Vec<Vec3> = mesh.positions.iter().map(collapsed).collect();
    let rows = built.to_rows(&positions);
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let spring = SpringDamper::stiffness(1.0).max_force(50.0);
    let wall = ForbiddenRegion::new(spring, 5.0).expect("a valid margin");
    // A step too short to reach the inside keeps the side.
    for (x, height, side) in [(-20.0, 1.0, Side::Outside), (1.0, 20.0, Side::Either)] {
        let mut tracker = Tracker::<u16, MAX_STACK, 64>::new(&tree).expect("deep enough");
        let mut ask = |at: Vec3| {
            let tool = Sphere::new(at, 1.0).expect("valid");
            tracker.closest(&surface, &tool, &Options::new()).expect("an answer")
        };
        let above_rim = ask(Vec3::new(-23.0, 3.1, 3.0)).closest;
        assert_eq!(above_rim.side, Side::Outside, "{above_rim:?}");
        let found = ask(Vec3::new(x, 3.1, height));
        let at = found.closest;
        assert!(found.is_kept && at.side == side, "{x}: {at:?}");
        let lowest = if side == Side::Outside { height } else { -height };
        let [low, high] = [lowest, height].map(|on_axis| on_axis - 1.0);
        assert!((at.lower - low).abs() < 1e-3 && (at.separation - high).abs() < 1e-3, "{at:?}");
        let force = wall.force(&Ok(at), Vec3::ZERO);
        assert_eq!(force.state, ConstraintState::Active, "{at:?}");
        assert!((force.force.length() - (5.0 - low)).abs() < 0.01, "{force:?}");
    }
}

/// Solids that touch at an edge have a side everywhere but at the edge; a fin has none there, and the reason says so.
#[test]
fn an_edge_of_more_than_two_triangles_takes_no_side_from_the_rest() {
    let mesh = pinched();
    assert_eq!(check_winding(&mesh), Ok(()));
    let ask = |mesh: &Mesh, at: Vec3| {
        let built = build(mesh);
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let tool = Sphere::new(at, 1.0).expect("valid");
        query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer")
    };
    let above = ask(&mesh, Vec3::new(5.0, 5.0, 13.0));
    assert_eq!((above.side, above.separation), (Side::Outside, 2.0));
    assert_eq!(ask(&mesh, Vec3::splat(6.0)).side, Side::Inside);
    assert_eq!(ask(&mesh, Vec3::new(10.0, 10.0, 13.0)).side, Side::Outside);
    assert_eq!(ask(&mesh, Vec3::new(8.0, 12.0, 5.0)).side, Side::Outside);
    // A wall inside a block ends at one of its edges.
    let mut wall = block(Vec3::ZERO, Vec3::splat(10.0));
    let row = |at: Vec3| wall.positions.iter().position(|&p| p == at).expect("a corner") as u32;
    let [low, high] = [0.0, 10.0].map(|z| row(Vec3::new(10.0, 10.0, z)));
    wall.positions.push(Vec3::splat(5.0));
    wall.triangles.push([low, high, 8]);
    assert!(matches!(check_winding(&wall), Err(WindingError::NonManifold { triangles: 3, .. })));
    let at_edge = ask(&wall, Vec3::new(13.0, 12.0, 5.0));
    assert_eq!(at_edge.side, Side::Undefined(NoSide::NonManifold));
    let on_edge = ask(&wall, Vec3::new(10.0, 10.0, 5.0));
    assert_eq!(on_edge.side, Side::Undefined(NoSide::NonManifold));
    assert_eq!(ask(&wall, Vec3::new(2.0, 5.0, 5.0)).side, Side::Inside);
    assert_eq!(ask(&wall, Vec3::new(5.0, 5.0, 13.0)).side, Side::Outside);
    assert_eq!(ask(&wall, Vec3::new(12.0, 5.0, 5.0)).side, Side::Outside);
}
