//! The tool kernels compared with the f64 oracle, within the core's stated accuracy: every shape of triangle with every
//! kind of axis, at every scale.
//!
//! One file, because all tests draw from the same cases.

// Requirement: A-01

use dibs_nostd::{ACCURACY, AxisPair, Capsule, Sphere, Tool, ToolError};
use dibs_tests::oracle::{Instrument, closest_pair, exhaustive};
use dibs_tests::sample;
use glam::{DVec3, Vec3};
use proptest::prelude::*;

/// Half a unit in the last place of 1.
const U: f64 = 1.0 / 16_777_216.0;
/// Lengths below 1e-15 count as zero, and several of them may add up.
const FLOOR: f64 = 5e-15;
/// Cases for each combination of shape, axis and frame.
const CASES: usize = if cfg!(debug_assertions) { 300 } else { 5000 };

type Triangle = [Vec3; 3];
type Segment = [Vec3; 2];

fn vector(rng: &mut fastrand::Rng) -> Vec3 {
    let mut next = || rng.f32() * 2.0 - 1.0;
    Vec3::new(next(), next(), next())
}

/// A number between 10^low and 10^high, with all decades equally likely.
fn decades(rng: &mut fastrand::Rng, low: f32, high: f32) -> f32 {
    10f32.powf(low + (high - low) * rng.f32())
}

const SHAPES: [&str; 9] = [
    "regular",
    "small",
    "sliver",
    "needle",
    "coincident corners",
    "collinear corners",
    "grid",
    "one point",
    "obtuse",
];

/// A triangle of about unit size.
fn shape(kind: &str, rng: &mut fastrand::Rng) -> Triangle {
    let [a, b, c] = [vector(rng), vector(rng), vector(rng)];
    let mut corners = match kind {
        "regular" => [a, b, c],
        "small" => {
            let size = decades(rng, -7.0, 0.0);
            [a, a + size * b, a + size * c]
        }
        "sliver" => [a, b, a + (b - a) * (rng.f32() * 1.5 - 0.25) + c * decades(rng, -9.0, -0.5)],
        "needle" => [a, b, b + c * decades(rng, -9.0, -0.5)],
        "coincident corners" => [a, b, b],
        "collinear corners" => [a, b, a + (b - a) * (rng.f32() * 3.0 - 1.0)],
        "grid" => [a, b, c].map(|v| (v * 2.0).round()),
        "one point" => [a; 3],
        "obtuse" => [a, b, a + (b - a) * (1.0 + rng.f32()) + c * decades(rng, -4.0, 0.0)],
        other => unreachable!("{other}"),
    };
    rng.shuffle(&mut corners);
    corners
}

const AXES: [&str; 11] = [
    "anywhere",
    "parallel to the plane",
    "parallel to an edge",
    "through the inside",
    "through an edge",
    "through a corner",
    "end touches",
    "length zero",
    "long and close",
    "grazing",
    "grid",
];

/// A segment of this kind relative to the triangle.
fn axis(kind: &str, [a, b, c]: Triangle, rng: &mut fastrand::Rng) -> Segment {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let (v, w) = {
        let (v, w) = (rng.f32(), rng.f32());
        if v + w > 1.0 { (1.0 - v, 1.0 - w) } else { (v, w) }
    };
    let inside = a + v * (b - a) + w * (c - a);
    let on_edge = a + v * (b - a);
    let around = |middle: Vec3, along: Vec3, rng: &mut fastrand::Rng| {
        let part = rng.f32();
        [middle - part * along, middle + (1.0 - part) * along]
    };
    let far = decades(rng, -7.0, 0.5);
    match kind {
        "anywhere" => [2.0 * vector(rng), 2.0 * vector(rng)],
        "parallel to the plane" => {
            let slope = if rng.bool() { 0.0 } else { decades(rng, -8.0, -1.0) };
            let along = (rng.f32() * 4.0 - 2.0) * (b - a) + (rng.f32() * 4.0 - 2.0) * (c - a);
            let start = a + 2.0 * (rng.f32() - 0.5) * (b - a) + 2.0 * (rng.f32() - 0.5) * (c - a);
            [start + far * normal, start + along + (far + slope) * normal]
        }
        "parallel to an edge" => {
            let slope = if rng.bool() { 0.0 } else { decades(rng, -8.0, -1.0) };
            let start = a + 2.0 * (rng.f32() - 0.5) * (b - a) + far * vector(rng);
            let along = (rng.f32() * 3.0) * (b - a) + slope * vector(rng);
            if rng.bool() { [start, start + along] } else { [start + along, start] }
        }
        "through the inside" => around(inside, vector(rng), rng),
        "through an edge" => around(on_edge, vector(rng), rng),
        "through a corner" => around(c, vector(rng), rng),
        "end touches" => {
            let point = *rng.choice(&[inside, on_edge, c]).expect("not empty");
            [point, point + vector(rng)]
        }
        "length zero" => [inside + far * vector(rng); 2],
        "long and close" => {
            let along = vector(rng) * decades(rng, 0.0, 3.0);
            around(inside + far * vector(rng), along, rng)
        }
        "grazing" => {
            let along = (c - a) * (rng.f32() * 4.0 - 2.0) + normal * decades(rng, -8.0, -1.0);
            around(inside + (rng.f32() - 0.5) * (b - a), along, rng)
        }
        "grid" => [(vector(rng) * 2.0).round(), (vector(rng) * 2.0).round()],
        other => unreachable!("{other}"),
    }
}

const FRAMES: [&str; 6] = ["unit", "any size", "far from the origin", "huge", "tiny", "denormal"];

/// Scale and offset of triangle and axis.
fn frame(kind: &str, rng: &mut fastrand::Rng) -> (f32, Vec3) {
    match kind {
        "unit" => (1.0, Vec3::ZERO),
        "any size" => (decades(rng, -4.0, 4.0), Vec3::ZERO),
        "far from the origin" => (decades(rng, -2.0, 2.0), 1e4 * vector(rng)),
        "huge" => (decades(rng, 4.0, 5.0), Vec3::ZERO),
        "tiny" => (decades(rng, -14.0, -4.0), Vec3::ZERO),
        "denormal" => (decades(rng, -44.0, -14.0), Vec3::ZERO),
        other => unreachable!("{other}"),
    }
}

struct Case {
    start: Vec3,
    end: Vec3,
    corners: Triangle,
}

impl Case {
    /// The size `S` that the stated accuracy is relative to.
    fn size(&self) -> f64 {
        let start = self.start.as_dvec3();
        let reach = self.corners.map(|c| c.as_dvec3().distance(start)).into_iter();
        reach.fold(0.0, f64::max) + self.end.as_dvec3().distance(start)
    }

    fn allowed(&self) -> f64 {
        f64::from(ACCURACY) * self.size() + FLOOR
    }

    /// The true distance, certified from both sides.
    fn truth(&self) -> f64 {
        let start = self.start.as_dvec3();
        let end = self.end.as_dvec3() - start;
        let corners = self.corners.map(|c| c.as_dvec3() - start);
        let pair = closest_pair(DVec3::ZERO, end, corners);
        // The rounding of a short pair's direction grows with the size: only long pairs can be certified from below.
        let size = self.size();
        if pair.distance > 1e-6 * size {
            let doubt = 1e-3 * U * size + 1e-14 * size * size / pair.distance;
            assert!(pair.distance - pair.lower <= doubt, "the oracle is in doubt: {pair:?}");
        }
        pair.distance
    }

    /// Compares a tool's kernel with the true distance. Returns the error in units of `2^-24 S`.
    fn check(&self, tool: &impl Tool) -> f64 {
        let truth = self.truth();
        let allowed = self.allowed();
        let describe = || format!("{:?} {:?} {:?}", self.start, self.end, self.corners);

        let pair = tool
            .closest_on_triangle(&self.corners, f32::INFINITY)
            .unwrap_or_else(|| panic!("no pair without a limit: {}", describe()));
        let distance = f64::from(pair.distance_squared).sqrt();
        let error = (distance - truth).abs();
        assert!(error <= allowed, "{distance:e}, not {truth:e}: {}", describe());
        self.check_points(tool, &pair);

        // With a limit, no pair below it is dropped, and no pair above it is kept.
        let square = |x: f64| (x * x) as f32;
        let above = tool
            .closest_on_triangle(&self.corners, square((truth + allowed) * (1.0 + 2.0 * U) + FLOOR))
            .unwrap_or_else(|| panic!("dropped below the limit: {}", describe()));
        let error_above = (f64::from(above.distance_squared).sqrt() - truth).abs();
        assert!(error_above <= allowed, "with a limit: {error_above:e}: {}", describe());
        if truth > allowed {
            let limit = square((truth - allowed) * (1.0 - 2.0 * U));
            let below = tool.closest_on_triangle(&self.corners, limit);
            assert!(below.is_none(), "kept above the limit: {}", describe());
        }
        let same = tool.closest_on_triangle(&self.corners, pair.distance_squared);
        assert!(same.is_none_or(|p| p.distance_squared < pair.distance_squared));

        let size = self.size();
        if size > 1e-6 { error.max(error_above) / (U * size) } else { 0.0 }
    }

    /// Checks that the pair's points, weights and distance agree.
    fn check_points(&self, tool: &impl Tool, pair: &AxisPair) {
        let corners = self.corners.map(Vec3::as_dvec3);
        let (start, end) = (self.start.as_dvec3(), self.end.as_dvec3());
        let weights = pair.barycentric.map(f64::from);
        assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "{pair:?}");
        assert!((weights.iter().sum::<f64>() - 1.0).abs() <= 4.0 * U, "{pair:?}");

        // Points are rounded relative to the coordinates; the distance is not.
        let coordinates =
            corners.iter().chain([&start, &end]).map(|p| p.length()).fold(0.0, f64::max);
        let rounding = 8.0 * U * coordinates + FLOOR;
        let surface: DVec3 = (0..3).map(|i| corners[i] * weights[i]).sum();
        assert!(surface.distance(pair.on_surface.as_dvec3()) <= rounding, "{pair:?}");
        let axis = start.lerp(end, f64::from(pair.axis_parameter));
        assert!((0.0..=1.0).contains(&pair.axis_parameter), "{pair:?}");
        assert!(axis.distance(pair.on_axis.as_dvec3()) <= rounding, "{pair:?}");
        let apart = pair.on_axis.as_dvec3().distance(pair.on_surface.as_dvec3());
        let distance = f64::from(pair.distance_squared).sqrt();
        assert!((apart - distance).abs() <= 2.0 * rounding + self.allowed(), "{pair:?}");
        assert!(f64::from(tool.axis_length()) >= start.distance(end) - FLOOR);
    }

    /// Compares the node test with the true distance at the triangle's corners. Returns the error in units of `2^-24
    /// S`.
    fn check_node(&self, tool: &impl Tool) -> f64 {
        let (start, end) = (self.start.as_dvec3(), self.end.as_dvec3());
        let mut worst = 0.0_f64;
        for corner in self.corners {
            let truth = closest_pair(start, end, [corner.as_dvec3(); 3]).distance;
            let size = corner.as_dvec3().distance(start) + start.distance(end);
            let distance = f64::from(tool.axis_distance_squared(corner)).sqrt();
            let error = (distance - truth).abs();
            assert!(error <= 8.0 * U * size + FLOOR, "{distance:e}, not {truth:e}: {corner:?}");
            if size > 1e-6 {
                worst = worst.max(error / (U * size));
            }
        }
        worst
    }
}

/// Every shape with every axis in every frame.
#[test]
fn every_triangle_is_within_the_stated_accuracy() {
    let mut worst = [0.0_f64; 3];
    let mut cases = 0_u64;
    for (i, shape_kind) in SHAPES.into_iter().enumerate() {
        for (j, axis_kind) in AXES.into_iter().enumerate() {
            for (k, frame_kind) in FRAMES.into_iter().enumerate() {
                let mut rng = fastrand::Rng::with_seed((i * 10_000 + j * 100 + k) as u64);
                let mut here = [0.0_f64; 3];
                for _ in 0..sample(CASES) {
                    let unit = shape(shape_kind, &mut rng);
                    let [start, end] = axis(axis_kind, unit, &mut rng);
                    let (scale, offset) = frame(frame_kind, &mut rng);
                    let place = |p: Vec3| p * scale + offset;
                    let case =
                        Case { start: place(start), end: place(end), corners: unit.map(place) };
                    let capsule = Capsule::new(case.start, case.end, 1.0).expect("finite");
                    here[0] = here[0].max(case.check(&capsule));
                    here[2] = here[2].max(case.check_node(&capsule));
                    let point = Case { end: case.start, ..case };
                    let sphere = Sphere::new(case.start, 0.0).expect("finite");
                    here[1] = here[1].max(point.check(&sphere));
                    cases += 2;
                }
                if here[0] > worst[0] {
                    println!("capsule {:5.2}: {shape_kind}, {axis_kind}, {frame_kind}", here[0]);
                }
                for (worst, here) in worst.iter_mut().zip(here) {
                    *worst = worst.max(here);
                }
            }
        }
    }
    println!(
        "{cases} cases; worst error / (2^-24 S): capsule {:.2}, sphere {:.2} (stated: {}); \
         node test {:.2} (stated: 8)",
        worst[0],
        worst[1],
        f64::from(ACCURACY) / U,
        worst[2],
    );
    // At most half of the stated accuracy: a kernel with a larger error has lost one of its cases.
    assert!(worst[0] < 8.0 && worst[1] < 8.0 && worst[2] < 4.0, "{worst:?}");
}

/// A capsule of length zero is as accurate as a sphere.
#[test]
fn a_capsule_of_length_zero_answers_as_a_sphere() {
    let mut rng = fastrand::Rng::with_seed(7);
    for shape_kind in SHAPES {
        for _ in 0..CASES {
            let corners = shape(shape_kind, &mut rng);
            let center = 2.0 * vector(&mut rng);
            let sphere = Sphere::new(center, 0.5).expect("finite");
            let capsule = Capsule::new(center, center, 0.5).expect("finite");
            let case = Case { start: center, end: center, corners };
            case.check(&sphere);
            case.check(&capsule);
            assert_eq!(
                sphere.axis_distance_squared(corners[0]),
                capsule.axis_distance_squared(corners[0])
            );
            let pair = capsule.closest_on_triangle(&corners, f32::INFINITY).expect("a pair");
            assert_eq!(pair.axis_parameter, 0.0);
        }
    }
}

/// The oracle's search of a whole surface skips triangles, but never the closest one.
#[test]
fn exhaustive_search_finds_the_closest_triangle() {
    let mut rng = fastrand::Rng::with_seed(17);
    for _ in 0..CASES / 10 {
        let positions: Vec<Vec3> = (0..60).map(|_| vector(&mut rng)).collect();
        let triangles: Vec<[u32; 3]> = (0..100).map(|_| [(); 3].map(|()| rng.u32(0..60))).collect();
        let (start, end) = (3.0 * vector(&mut rng), 3.0 * vector(&mut rng));
        let found = exhaustive(&positions, &triangles, &Instrument::capsule(start, end, 0.5))
            .expect("there are triangles");
        let distances = triangles.iter().map(|t| {
            let corners = t.map(|v| positions[v as usize].as_dvec3());
            closest_pair(start.as_dvec3(), end.as_dvec3(), corners).distance
        });
        let closest = distances.fold(f64::INFINITY, f64::min);
        assert_eq!(found.axis_distance, closest);
        assert_eq!(found.separation, closest - 0.5);
    }
    assert!(exhaustive::<Vec3>(&[], &[], &Instrument::sphere(Vec3::ZERO, 1.0)).is_none());
}

#[test]
fn piercing_is_distance_zero() {
    let corners = [Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 3.0, 0.0)];
    let capsule = Capsule::new(Vec3::new(1.0, 1.0, -5.0), Vec3::new(1.0, 1.0, 15.0), 2.0).unwrap();
    let pair = capsule.closest_on_triangle(&corners, 1e-30).unwrap();
    assert_eq!(pair.distance_squared, 0.0);
    assert_eq!(pair.axis_parameter, 0.25);
    assert!(pair.on_surface.distance(Vec3::new(1.0, 1.0, 0.0)) < 1e-6);
    assert_eq!(capsule.closest_on_triangle(&corners, 0.0), None);
}

#[test]
fn corners_that_are_not_finite_are_never_closest() {
    let mut rng = fastrand::Rng::with_seed(13);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN] {
        for _ in 0..CASES {
            let mut corners = shape("regular", &mut rng);
            let corner = rng.usize(0..3);
            corners[corner][rng.usize(0..3)] = bad;
            let [start, end] = [vector(&mut rng), vector(&mut rng)];
            let capsule = Capsule::new(start, end, 1.0).unwrap();
            let sphere = Sphere::new(start, 1.0).unwrap();
            for limit in [f32::INFINITY, f32::MAX, 1.0] {
                assert_eq!(capsule.closest_on_triangle(&corners, limit), None, "{corners:?}");
                assert_eq!(sphere.closest_on_triangle(&corners, limit), None, "{corners:?}");
            }
            let below = |distance_squared: f32| distance_squared < f32::INFINITY;
            assert!(!below(capsule.axis_distance_squared(corners[corner])));
            assert!(!below(sphere.axis_distance_squared(corners[corner])));
        }
    }
}

#[test]
fn tools_name_the_value_that_they_refuse() {
    let origin = Vec3::ZERO;
    assert_eq!(Sphere::new(origin, -1.0), Err(ToolError::Radius { value: -1.0 }));
    assert_eq!(Capsule::new(origin, origin, 1e30), Err(ToolError::Radius { value: 1e30 }));
    let far = Vec3::new(0.0, 1e30, 0.0);
    assert_eq!(Sphere::new(far, 1.0), Err(ToolError::Coordinate { value: 1e30 }));
    assert_eq!(Capsule::new(origin, far, 1.0), Err(ToolError::Coordinate { value: 1e30 }));
    assert!(matches!(
        Capsule::new(Vec3::NAN, origin, 1.0),
        Err(ToolError::Coordinate { value }) if value.is_nan()
    ));
    assert!(matches!(
        Sphere::new(origin, f32::NAN),
        Err(ToolError::Radius { value }) if value.is_nan()
    ));
    assert!(Sphere::new(origin, 0.0).is_ok());
    assert_eq!(
        ToolError::Radius { value: -1.0 }.to_string(),
        "tool radius -1 is not within 0 to 536870900"
    );
}

fn any_point() -> impl Strategy<Value = Vec3> {
    // Few distinct values make exact coincidences frequent, and shrink well.
    let coordinate = prop_oneof![
        (-3_i8..=3).prop_map(f32::from),
        (-100.0_f32..100.0),
        (-1.0e-3_f32..1.0e-3),
        Just(1e4_f32),
    ];
    proptest::array::uniform3(coordinate).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 2_000 } else { 50_000 }))]

    #[test]
    fn coincidences_are_within_the_stated_accuracy(
        start in any_point(),
        end in any_point(),
        corners in proptest::array::uniform3(any_point()),
    ) {
        let case = Case { start, end, corners };
        case.check(&Capsule::new(start, end, 0.0).unwrap());
        case.check_node(&Capsule::new(start, end, 0.0).unwrap());
        Case { end: start, ..case }.check(&Sphere::new(start, 0.0).unwrap());
    }
}
