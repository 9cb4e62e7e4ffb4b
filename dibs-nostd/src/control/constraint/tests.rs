//! The forces: their laws, their bounds, and their output for invalid input.

// Requirement: C-02

extern crate std;

use proptest::prelude::*;

use super::*;
use crate::query::Contact;
use crate::surface::Millis;
use crate::unavailable::QueryError;
use crate::{Coverage, NoSide, Side, TriangleRow};

const QUERY: QueryError = QueryError::Corrupt { row: 7 };

const SPRING: SpringDamper = SpringDamper::stiffness(2.0).damping(0.01).max_force(5.0);
const RADIUS: f32 = 2.5;

/// A tool of this radius whose axis is `gap + RADIUS` from a point of the surface.
fn pair(gap: f32, direction: Vec3) -> Proximity {
    let point_on_surface = Vec3::new(1.0, -2.0, 3.0);
    Proximity {
        separation: gap,
        lower: gap,
        side: Side::Outside,
        coverage: Coverage::Measured,
        accuracy: 0.0,
        axis_distance: gap + RADIUS,
        point_on_surface,
        point_on_tool: point_on_surface + direction * gap,
        direction,
        axis_parameter: 0.0,
        triangle: Some(TriangleRow(0)),
        corners: [0, 1, 2],
        barycentric: [1.0, 0.0, 0.0],
        node_tests: 0,
        triangle_tests: 0,
    }
}

fn wall() -> ForbiddenRegion {
    ForbiddenRegion::new(SPRING, 3.0).unwrap()
}

fn guide() -> Guidance {
    Guidance::new(SPRING, 10.0).unwrap().dead_band(1.0).unwrap()
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1.0e-5
}

#[test]
fn the_wall_is_a_spring_and_a_damper() {
    let at = |gap, speed| wall().force(&Ok(pair(gap, Vec3::Y)), Vec3::new(9.0, speed, 7.0));
    assert_eq!(at(3.0, -100.0), ConstraintForce::NONE);
    assert_eq!(at(50.0, -100.0), ConstraintForce::NONE);
    // 2 N/mm over 1 mm, and 0.01 N s/mm at 100 mm/s of approach; nothing sideways.
    assert!(close(at(2.0, 0.0).force, Vec3::Y * 2.0));
    assert!(close(at(2.0, -100.0).force, Vec3::Y * 3.0));
    assert_eq!(at(2.0, -100.0).state, ConstraintState::Active);
    // Moving away fast, the damper exceeds the spring: no force instead of a pull.
    assert_eq!(at(2.0, 1000.0).force, Vec3::ZERO);
    assert_eq!(at(2.0, 1000.0).state, ConstraintState::Active);
    assert!(close(at(0.0, 300.0).force, Vec3::Y * 3.0));
    assert_eq!(at(0.0, 0.0).force, Vec3::Y * 5.0);
    assert_eq!(at(0.0, 0.0).state, ConstraintState::Saturated);
}

#[test]
fn the_spring_goes_on_below_the_surface() {
    let soft = SpringDamper::stiffness(0.5).max_force(5.0);
    let wall = ForbiddenRegion::new(soft, 3.0).unwrap();
    for (gap, force) in [(1.0, 1.0), (0.0, 1.5), (-1.0, 2.0), (-2.0, 2.5)] {
        let answer = wall.force(&Ok(pair(gap, Vec3::X)), Vec3::ZERO);
        assert!(close(answer.force, Vec3::X * force), "{gap}: {answer:?}");
    }
}

#[test]
fn the_interval_counts_from_its_lower_end() {
    let mut cut = pair(8.0, Vec3::X);
    cut.lower = 2.0;
    cut.accuracy = 0.5;
    assert!(close(wall().force(&Ok(cut), Vec3::ZERO).force, Vec3::X * 3.0));
    // The guide sees the tool 8.5 mm too near, not 2 mm.
    assert!(close(guide().force(&Ok(cut), Vec3::ZERO).force, Vec3::X * 5.0));
}

#[test]
fn the_guide_pulls_and_pushes() {
    let at = |gap, speed| guide().force(&Ok(pair(gap, Vec3::Z)), Vec3::new(1.0, 2.0, speed));
    for gap in [9.0, 9.5, 10.0, 11.0] {
        assert_eq!(at(gap, 500.0), ConstraintForce::NONE, "{gap}");
    }
    assert!(close(at(12.0, 0.0).force, Vec3::Z * -2.0));
    assert!(close(at(8.0, 0.0).force, Vec3::Z * 2.0));
    assert!(close(at(12.0, 50.0).force, Vec3::Z * -2.5), "the damper slows leaving down");
    assert!(close(at(12.0, -50.0).force, Vec3::Z * -1.5), "and coming near");
    assert_eq!(at(90.0, 0.0).force, Vec3::Z * -5.0);
    assert_eq!(at(90.0, 0.0).state, ConstraintState::Saturated);
    assert_eq!(at(0.0, 0.0).force, Vec3::Z * 5.0);
}

#[test]
fn the_hold_damps_and_says_why() {
    let reasons = [
        Unavailable::NoSurface,
        Unavailable::Stale { age: Millis(80) },
        Unavailable::Query(QUERY),
        Unavailable::NoDirection,
        Unavailable::NotFinite,
    ];
    for reason in reasons {
        let held = wall().force(&Err(reason), Vec3::new(0.0, 100.0, 0.0));
        assert_eq!(held.state, ConstraintState::Safe(reason));
        assert!(close(held.force, Vec3::new(0.0, -1.0, 0.0)));
        let fast = guide().force(&Err(reason), Vec3::new(3.0e5, 0.0, 4.0e5));
        assert!(close(fast.force, Vec3::new(-3.0, 0.0, -4.0)), "{fast:?}");
        assert_eq!(wall().force(&Err(reason), Vec3::splat(f32::NAN)).force, Vec3::ZERO);
        assert_eq!(wall().force(&Err(reason), Vec3::ZERO).force, Vec3::ZERO);
        let absurd = wall().force(&Err(reason), Vec3::Y * f32::MAX);
        assert_eq!(absurd.force, Vec3::Y * -5.0);
        let free = SPRING.hold_damping(0.0);
        let free = ForbiddenRegion::new(free, 3.0).unwrap();
        assert_eq!(free.force(&Err(reason), Vec3::ONE).force, Vec3::ZERO);
    }
    // A query's answer without a direction.
    let touching = wall().force(&Ok(pair(-RADIUS, Vec3::ZERO)), Vec3::X);
    assert_eq!(touching.state, ConstraintState::Safe(Unavailable::NoDirection));
}

const NO_SIDES: [(NoSide, Option<Unavailable>); 7] = [
    (NoSide::CutShort, Some(Unavailable::CutShort)),
    (NoSide::Degenerate, Some(Unavailable::NoSide)),
    (NoSide::OpenBoundary, Some(Unavailable::NoSide)),
    (NoSide::NonManifold, Some(Unavailable::NoSide)),
    (NoSide::BelowAccuracy, Some(Unavailable::NoSide)),
    (NoSide::NotAsked, None),
    (NoSide::NoAdjacency, None),
];

/// A pair without a side at this distance.
fn without_side(reason: NoSide, gap: f32) -> Proximity {
    Proximity { side: Side::Undefined(reason), accuracy: 1e-4, ..pair(gap, Vec3::X) }
}

/// Near or far, the tool may be inside, and the direction may lead inwards.
#[test]
fn a_tool_without_a_side_is_held_at_any_distance() {
    for (reason, held) in NO_SIDES {
        for gap in [-2.0, 1.0, 8.0, 500.0] {
            let pair = without_side(reason, gap);
            for force in [wall().force(&Ok(pair), Vec3::Y), guide().force(&Ok(pair), Vec3::Y)] {
                assert_eq!(held.map(ConstraintState::Safe).unwrap_or(force.state), force.state);
                assert_eq!(held.is_some(), close(force.force, Vec3::Y * -0.01), "{reason:?}");
            }
            assert_eq!(held.is_some(), pair.interval().lower == f32::NEG_INFINITY, "{reason:?}");
        }
    }
}

/// A tool whose axis is at the surface gets the same force on either side.
#[test]
fn a_tool_at_the_surface_is_pushed_out() {
    let soft = SpringDamper::stiffness(0.5).max_force(5.0);
    let wall = ForbiddenRegion::new(soft, 3.0).unwrap();
    let at_surface = without_side(NoSide::BelowAccuracy, -RADIUS + 1e-4);
    let force = wall.force(&Ok(at_surface), Vec3::ZERO).force;
    assert!((force - Vec3::X * 2.75).length() < 5e-4, "{force}");
    let mut beyond = at_surface;
    beyond.axis_distance = 1e-2;
    assert_eq!(
        wall.force(&Ok(beyond), Vec3::ZERO).state,
        ConstraintState::Safe(Unavailable::NoSide)
    );
}

/// A contact `gap` from a tool.
fn contact(gap: f32) -> Contact {
    Contact { separation: gap, normal: Vec3::X, ..Contact::NONE }
}

#[test]
fn proxy_and_rows_count_from_the_lower_end() {
    let soft = SpringDamper::stiffness(0.5).max_force(5.0);
    let proxy = Proxy::new(soft, 3.0).unwrap();
    let force = |gap, accuracy| {
        let contacts = [contact(gap)];
        proxy.wrench(Ok(contacts.iter()), accuracy, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO)
    };
    assert!((force(2.0, 0.5).force - Vec3::X * 0.75).length() < 1e-4);
    // Within the margin only because of its accuracy.
    assert_eq!(force(3.2, 0.1), Wrench::NONE);
    assert!((force(3.2, 0.4).force - Vec3::X * 0.1).length() < 1e-4);

    let row =
        |accuracy| VelocityRow::new(&contact(2.0), accuracy, Vec3::ZERO).stand_off(1.0).gain(20.0);
    assert!((row(0.0).least + 20.0).abs() < 1e-4 && (row(0.25).least + 15.0).abs() < 1e-4);
    assert!(row(0.25).allows(Vec3::X * -14.9, Vec3::ZERO));
    assert!(!row(0.25).allows(Vec3::X * -15.1, Vec3::ZERO));
}

/// A fine surface has many contacts at the edges of walls, with activation 0.
#[test]
fn a_contact_without_activation_takes_no_slot() {
    let proxy = Proxy::new(SpringDamper::stiffness(1.0).max_force(9.0), 3.0).unwrap();
    let force = |contacts: &[Contact]| {
        let held = proxy.wrench(Ok(contacts.iter()), 0.0, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        held.force
    };
    let (deepest, none) = (contact(1.0), Contact { activation: 0.0, ..contact(1.5) });
    let side = Contact { normal: Vec3::Y, ..contact(2.0) };
    let mut all = [none; 12];
    (all[0], all[11]) = (deepest, side);
    assert_eq!(force(&all), force(&[deepest, side]));
    assert!(force(&all).y > 0.9, "{}", force(&all));
}

#[test]
fn an_interval_is_rounded_outwards() {
    let mut pair = pair(1.0, Vec3::X);
    pair.accuracy = 1e-9;
    let interval = pair.interval();
    assert_eq!((interval.lower, interval.upper), (1.0_f32.next_down(), 1.0_f32.next_up()));
    pair.accuracy = 0.25;
    pair.lower = -0.5;
    assert_eq!((pair.interval().lower, pair.interval().upper), (-0.75, 1.25));
}

#[test]
fn what_is_not_finite_is_not_used() {
    let spoil: [fn(&mut Proximity, f32); 6] = [
        |pair, bad| pair.separation = bad,
        |pair, bad| pair.lower = bad,
        |pair, bad| pair.accuracy = bad,
        |pair, bad| pair.direction.y = bad,
        |pair, bad| pair.point_on_surface.x = bad,
        |pair, bad| pair.point_on_tool.z = bad,
    ];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for (which, spoil) in spoil.iter().enumerate() {
            let mut pair = pair(1.0, Vec3::X);
            spoil(&mut pair, bad);
            let safe = ConstraintState::Safe(Unavailable::NotFinite);
            assert_eq!(wall().force(&Ok(pair), Vec3::ONE).state, safe, "field {which}, {bad}");
            assert_eq!(guide().force(&Ok(pair), Vec3::ONE).state, safe, "field {which}, {bad}");
        }
        let moving = wall().force(&Ok(pair(1.0, Vec3::X)), Vec3::new(bad, 0.0, 0.0));
        assert_eq!(moving.state, ConstraintState::Safe(Unavailable::NotFinite));
        assert_eq!(moving.force, Vec3::ZERO);
    }
    let mut long = pair(1.0, Vec3::X);
    long.direction = Vec3::X * 1.5;
    assert!(matches!(wall().force(&Ok(long), Vec3::ZERO).state, ConstraintState::Safe(_)));
}

/// A contact that is not finite is not left out of a list: the tool is held.
#[test]
fn a_contact_that_is_not_finite_gives_the_hold() {
    let proxy = Proxy::new(SPRING, 3.0).unwrap();
    let good = contact(1.0);
    let askew = Contact { normal: Vec3::new(1.0, f32::NAN, 0.0), ..good };
    for bad in [contact(f32::NAN), contact(f32::NEG_INFINITY), askew] {
        for contacts in [[bad, good], [good, bad]] {
            let held = proxy.wrench(Ok(contacts.iter()), 0.0, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
            let safe = ConstraintState::Safe(Unavailable::NotFinite);
            assert_eq!(held, Wrench { state: safe, ..Wrench::NONE }, "{contacts:?}");
        }
    }
}

#[test]
fn gains_out_of_range_are_named() {
    let named = |spring| {
        let names = [
            ForbiddenRegion::new(spring, 3.0).unwrap_err().parameter,
            Guidance::new(spring, 10.0).unwrap_err().parameter,
            Proxy::new(spring, 3.0).unwrap_err().parameter,
        ];
        assert!(names.iter().all(|&name| name == names[0]), "{names:?}");
        names[0]
    };
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(named(SpringDamper::stiffness(bad).max_force(1.0)), "stiffness");
        assert_eq!(named(SPRING.damping(bad)), "damping");
        assert_eq!(named(SPRING.max_force(bad)), "max_force");
        assert_eq!(named(SPRING.hold_damping(bad)), "hold_damping");
        assert_eq!(ForbiddenRegion::new(SPRING, bad).unwrap_err().parameter, "margin");
        assert_eq!(Proxy::new(SPRING, bad).unwrap_err().parameter, "margin");
        assert_eq!(Guidance::new(SPRING, bad).unwrap_err().parameter, "stand_off");
        assert_eq!(guide().dead_band(bad).unwrap_err().parameter, "dead_band");
    }
    assert_eq!(named(SpringDamper::stiffness(0.0).max_force(1.0)), "stiffness");
    assert_eq!(named(SpringDamper::stiffness(1.0).max_force(0.0)), "max_force");
    // The largest force must be set.
    assert_eq!(named(SpringDamper::stiffness(1.0)), "max_force");
    assert_eq!(ForbiddenRegion::new(SPRING, 0.0).unwrap_err().parameter, "margin");
}

#[test]
fn a_passive_wall_asks_for_damping_in_the_device() {
    // K T / 2 + B, or the hold's damping if larger.
    assert!((SPRING.device_damping(0.001) - 0.011).abs() < 1.0e-7);
    let held = SPRING.hold_damping(0.5);
    assert!((held.device_damping(0.001) - 0.5).abs() < 1.0e-7);
}

/// Any `f32`, most of them implausible.
fn any_bits() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -100.0_f32..100.0, Just(0.0)]
}

fn any_vec3() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(any_bits()).prop_map(Vec3::from)
}

fn unit() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0_f32..1.0)
        .prop_map(Vec3::from)
        .prop_filter("too short to be normalised", |v| v.length() > 0.1)
        .prop_map(|v| v / v.length())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// For any input the force is finite and at most the largest force.
    #[test]
    fn every_force_is_finite_and_bounded(
        gains in prop::array::uniform6(any_bits()),
        fields in prop::array::uniform4(any_bits()),
        points in prop::array::uniform3(any_vec3()),
        velocity in any_vec3(),
        proper in unit(),
        is_proper: bool,
    ) {
        let [stiffness, damping, max_force, hold, a, b] = gains.map(f32::abs);
        let spring = SpringDamper::stiffness(stiffness).damping(damping).max_force(max_force).hold_damping(hold);
        let mut any = pair(1.0, if is_proper { proper } else { points[2] });
        [any.separation, any.lower, any.accuracy, any.axis_distance] = fields;
        [any.point_on_surface, any.point_on_tool, _] = points;
        // Denormal forces round by more than a ratio.
        let largest = f64::from(max_force) * (1.0 + 1.0e-3) + 1.0e-44;
        let forces = [
            ForbiddenRegion::new(spring, a).map(|wall| wall.force(&Ok(any), velocity)),
            Guidance::new(spring, a).and_then(|guide| guide.dead_band(b)).map(|guide| guide.force(&Ok(any), velocity)),
            ForbiddenRegion::new(spring, a).map(|wall| wall.force(&Err(Unavailable::Query(QUERY)), velocity)),
        ];
        for answer in forces.into_iter().flatten() {
            prop_assert!(answer.force.is_finite(), "{answer:?}");
            let squares = answer.force.to_array().map(|axis| f64::from(axis) * f64::from(axis));
            let length = squares.iter().sum::<f64>().sqrt();
            prop_assert!(length <= largest, "{answer:?} of {max_force}");
        }
    }

    /// The wall never pulls, gives no force outside its margin, and its push never shrinks when the surface may be
    /// nearer.
    #[test]
    fn the_wall_only_pushes(
        direction in unit(), gap in -3.0_f32..10.0, slack in 0.0_f32..5.0, accuracy in 0.0_f32..0.1,
        velocity in prop::array::uniform3(-300.0_f32..300.0),
    ) {
        let velocity = Vec3::from(velocity);
        let exact = pair(gap, direction);
        let push = |pair: &Proximity| wall().force(&Ok(*pair), velocity).force.dot(direction);
        prop_assert!(push(&exact) >= 0.0);
        if gap >= 3.0 {
            prop_assert_eq!(wall().force(&Ok(exact), velocity), ConstraintForce::NONE);
        }
        let mut cut = exact;
        cut.lower = exact.lower - slack;
        cut.accuracy = accuracy;
        prop_assert!(push(&cut) >= push(&exact));
        // The push is at least that of an exact answer at the lower end.
        let nearest = pair(cut.lower - accuracy, direction);
        prop_assert!(push(&cut) >= push(&nearest) - 1.0e-4);
    }
}
