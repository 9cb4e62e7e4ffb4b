//! Checks sides and signed separations of poses in f64, by generalised winding numbers and exhaustive search. Where a
//! surface is proven to intersect itself, the pseudonormal of the nearest sheet decides.

use std::ops::AddAssign;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, NoSide, Options, Proximity, Query, Side, Sphere};
use fastrand::Rng;
use glam::{DVec3, Vec3};

use crate::deform::unit;
use crate::oracle::{Instrument, OraclePair, exhaustive};
use crate::sides;
use crate::surfaces::{self, ball};

/// A closed surface and its tree.
pub struct Closed {
    /// Its name.
    pub name: &'static str,
    /// The mesh at rest.
    pub mesh: Mesh,
    /// Its tree.
    pub built: BuiltTree,
    /// Its weight when the poses are divided among the surfaces.
    pub share: usize,
}

/// Generated hearts and brains, a ball, and the real heart and brains if they are present.
///
/// # Panics
/// Never: the sizes are valid.
#[must_use]
pub fn closed() -> Vec<Closed> {
    let mut all = vec![
        ("generated heart", generate::heart(320).expect("a valid size").mesh, 6),
        ("generated heart, finer", generate::heart(2_000).expect("a valid size").mesh, 4),
        ("generated brain", generate::brain(500).expect("a valid size"), 6),
        ("ball", ball(2), 4),
    ];
    for name in ["heart_10272", "brain_500", "brain_5k"] {
        let path = format!("{}/../../shared/data/{name}.ply", env!("CARGO_MANIFEST_DIR"));
        match dibs_build::read(&path) {
            Ok(import) => all.push((name, import.mesh, 2)),
            Err(error) => println!("skipped {name}: {error}"),
        }
    }
    let build = |(name, mesh, share): (_, Mesh, _)| {
        let built = Builder::new().stretch(4.0).build(&mesh).expect("a valid mesh");
        Closed { name, mesh, built, share }
    };
    all.into_iter().map(build).collect()
}

/// Bends space, and a surface with it. Space does not fold, because the derivative of the bend stays below 1.
#[must_use]
pub fn bent(mesh: &Mesh, rng: &mut Rng) -> Vec<Vec3> {
    let mut number = |size: f32| (rng.f32() * 2.0 - 1.0) * size;
    let scale = Vec3::new(1.0 + number(0.3), 1.0 + number(0.3), 1.0 + number(0.3));
    let (waves, heights) = (
        [(); 3].map(|()| Vec3::new(number(0.04), number(0.04), number(0.04))),
        Vec3::new(number(5.0), number(5.0), number(5.0)),
    );
    let [x, y, z] = waves;
    let bend = |p: &Vec3| {
        let wave = Vec3::new(x.dot(*p).sin(), y.dot(*p).sin(), z.dot(*p).sin());
        (*p + heights * wave) * scale
    };
    mesh.positions.iter().map(bend).collect()
}

/// A random point near a vertex, an edge or a face of a random triangle, at distances of many scales.
///
/// # Panics
/// If there is no triangle.
pub fn point(rows: &[Vec3], triangles: &[[u32; 3]], rng: &mut Rng) -> Vec3 {
    let [a, b, c] = triangles[rng.usize(..triangles.len())].map(|v| rows[v as usize]);
    let on_surface = match rng.u32(..3) {
        0 => a,
        1 => a.lerp(b, rng.f32()),
        _ => a.lerp(b, rng.f32()).lerp(c, rng.f32()),
    };
    let off = 10_f32.powf(rng.f32() * 6.0 - 4.0);
    let across = (b - a).cross(c - a).normalize_or_zero() * (if rng.bool() { off } else { -off });
    match rng.u32(..4) {
        0 => on_surface + across,
        1 => on_surface + across + unit(rng) * off,
        2 => on_surface + unit(rng) * off,
        _ => on_surface + unit(rng) * 20.0 * rng.f32(),
    }
}

/// Counts of poses by outcome.
#[derive(Clone, Copy, Default, Debug)]
pub struct Tally {
    /// Poses.
    pub poses: usize,
    /// Poses whose axis is inside.
    pub inside: usize,
    /// Poses whose side is undefined.
    pub undefined: usize,
    /// Poses whose side is undefined, although the axis is more than a hundredth of a mm from the surface.
    pub undefined_away: usize,
    /// Poses whose axis is that far from the surface.
    pub away: usize,
    /// Poses where the surface is proven to intersect itself: the side is that of the nearest sheet, and the depth
    /// jumps along an axis inside.
    pub self_cut: usize,
    /// Poses whose side or separation is wrong.
    pub wrong: usize,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.poses += other.poses;
        self.inside += other.inside;
        self.undefined += other.undefined;
        self.undefined_away += other.undefined_away;
        self.away += other.away;
        self.self_cut += other.self_cut;
        self.wrong += other.wrong;
    }
}

/// Poses that are checked together on one shape of a surface.
pub const POSES_OF_A_FRAME: usize = 100;

/// Axes nearer to the surface than this cross it, up to the rounding of f64.
const RESOLVED: f64 = 1e-12;

/// Intervals of an axis at whose ends the depth is sampled.
const POINTS: u32 = 16;

/// Intervals of an axis at whose ends self-intersection is tested: if a sheet lies behind another one for less than the
/// distance between samples, the depth jumps between two samples.
const CUTS: u32 = 8 * POINTS;

/// Checks poses on one shape of a surface; prints the wrong ones.
///
/// # Panics
/// If a query fails, or a side is undefined for another reason than the accuracy.
#[must_use]
pub fn judge(surface: &Closed, seed: u64) -> Tally {
    let mut rng = Rng::with_seed(seed);
    let mut tally = Tally::default();
    let tree = surface.built.tree::<u16>().expect("valid");
    assert!(tree.has_adjacency(), "{}", surface.name);
    let triangles = surfaces::triangles(&tree);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    // One frame in eight is the rest shape.
    let moved = if seed.is_multiple_of(8) {
        surface.mesh.positions.clone()
    } else {
        bent(&surface.mesh, &mut rng)
    };
    let rows = surface.built.to_rows(&moved);
    for _ in 0..POSES_OF_A_FRAME {
        let at = point(&rows, &triangles, &mut rng);
        let radius = if rng.bool() { 0.0 } else { 3.0 * rng.f32() };
        let far = at + unit(&mut rng) * 10.0 * rng.f32();
        let (tool, found) = if rng.bool() {
            let sphere = Sphere::new(at, radius).expect("valid");
            let found = query.closest(rows.as_slice(), &sphere, &Options::cold());
            (Instrument::sphere(at, radius), found)
        } else {
            let capsule = Capsule::new(at, far, radius).expect("valid");
            let found = query.closest(rows.as_slice(), &capsule, &Options::cold());
            (Instrument::capsule(at, far, radius), found)
        };
        let found = found.expect("an answer");
        let pair = exhaustive(&rows, &triangles, &tool).expect("has triangles");
        let _ = tally.judge(surface.name, &rows, &triangles, &tool, &pair, &found);
    }
    tally
}

impl Tally {
    /// Judges an answer about a tool whose closest pair is known; prints it if it is wrong. Returns the error of an answer
    /// that has an interval, relative to its accuracy; infinity if the side is wrong.
    ///
    /// # Panics
    /// If a side is undefined for another reason than the accuracy.
    pub fn judge<P: Copy + Into<DVec3>>(
        &mut self,
        name: &str,
        rows: &[P],
        triangles: &[[u32; 3]],
        tool: &Instrument,
        pair: &OraclePair,
        found: &Proximity,
    ) -> Option<f64> {
        self.poses += 1;
        let is_crossing = pair.axis_distance < RESOLVED;
        // Depths of an axis that crosses are the subject of another test; a kept answer's interval is judged here.
        if is_crossing && found.side != Side::Either {
            assert!(
                matches!(found.side, Side::Crossing | Side::Undefined(NoSide::BelowAccuracy)),
                "{name}: {tool:?} {found:?}"
            );
            return None;
        }
        self.away += usize::from(pair.axis_distance > 0.01);
        let (accuracy, own) = (f64::from(found.accuracy), f64::from(found.axis_distance));
        let says = match found.side {
            Side::Outside => Some(false),
            Side::Inside => Some(true),
            Side::Either => None,
            Side::Crossing if pair.axis_distance <= accuracy => return None,
            // The answer's own distance is within its accuracy, so the true one may be a little above: then the whole
            // axis is inside, as deep as the answer says.
            Side::Crossing if own <= accuracy && pair.axis_distance <= own + accuracy => Some(true),
            Side::Crossing => {
                self.wrong += 1;
                println!("{name}: {tool:?} does not cross, {pair:?}, {found:?}");
                return Some(f64::INFINITY);
            }
            Side::Undefined(reason) => {
                assert_eq!(reason, NoSide::BelowAccuracy, "{name}: {tool:?}");
                self.undefined += 1;
                self.undefined_away += usize::from(pair.axis_distance > 0.01);
                return None;
            }
            other => panic!("{other:?}"),
        };
        let winds_around = sides::is_inside(rows, triangles, pair.on_axis);
        let mut inside = is_crossing || winds_around.unwrap_or_default();
        let agrees = |inside: bool| says.is_none_or(|says| says == inside);
        let is_doubtful = winds_around.is_none_or(|inside| !agrees(inside));
        if !is_crossing && is_doubtful && sides::is_cut(rows, triangles, pair) {
            inside = sides::is_below(rows, triangles, pair);
            self.self_cut += 1;
        }
        self.inside += usize::from(inside);
        let off = off(rows, triangles, tool, pair, inside, found);
        let is_off = off > accuracy;
        if agrees(inside) && inside && is_off && sides::is_cut_along(rows, triangles, tool, CUTS) {
            self.self_cut += 1;
            return None;
        }
        if !agrees(inside) || is_off {
            self.wrong += 1;
            println!("{name}: {tool:?} inside: {inside}, off {off}, {found:?}");
        }
        Some(if agrees(inside) { off / accuracy } else { f64::INFINITY })
    }
}

/// The distance of an answer's interval from the true separation of a tool on a known side.
fn off<P: Copy + Into<DVec3>>(
    rows: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
    pair: &OraclePair,
    inside: bool,
    found: &Proximity,
) -> f64 {
    let signed = if inside { -pair.axis_distance } else { pair.axis_distance };
    let high = signed - f64::from(tool.radius);
    // An axis inside is measured at its deepest point. If the surface intersects itself, a point may have no depth.
    let deepest = (inside && tool.start != tool.end)
        .then(|| sides::deepest_separation(rows, triangles, tool, POINTS));
    let (low, high) = match deepest {
        Some(Some((low, deepest))) => (low, deepest.min(high)),
        Some(None) => (f64::NEG_INFINITY, high),
        None => (high, high),
    };
    let (lower, upper) = (f64::from(found.lower), f64::from(found.separation));
    (lower - high).max(low - upper)
}
