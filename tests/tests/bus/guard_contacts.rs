//! A guard's contacts: those of a tracker on the same surface, within the guard's one budget.

// Requirement: C-08

use dibs_build::{Builder, generate};
use dibs_nostd::constraint::{ConstraintState, Proxy, SpringDamper, VelocityRow};
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{Answer, Bus, Guard, GuardLimits, PosedRows, Surface, Vertices};
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, Freshness, NoMac};
use dibs_nostd::{
    Advance, Assembler, Budget, Capsule, Contact, Contacts, Frames, Millis, Options, QueryError,
    Side, SurfaceLimits, Tool, Tracker, Tree, TreeBytes, Unavailable, VertexTable,
};
use dibs_tests::bus::collect;

const ROWS: usize = 642;

/// Ticks between two frames.
const PERIOD: u32 = 33;

/// Margin of the contacts, in mm.
const MARGIN: f32 = 6.0;

/// Room for opened nodes in the search for the pair, and in that for the contacts.
const OPENED: usize = 128;
const RANGE: usize = 128;

/// Work that no budget counts: the first root's test, and the triangle of a warm start.
const BESIDES: u32 = 1 + Budget::TRIANGLE;

type List = Contacts<32, 512>;
type Ends = (Bus<'static, 'static, u16>, Guard<'static, 'static, u16, 64, OPENED, Vertices, RANGE>);

/// Largest rounding (mm) of a query's answer.
const ROUNDING: f32 = 1e-3;

fn sum_up(a: f32, b: f32) -> f32 {
    let sum = f64::from(a) + f64::from(b);
    let nearest = sum as f32;
    if f64::from(nearest) < sum { nearest.next_up() } else { nearest }
}

/// A point inside the generated heart.
const MIDDLE: Vec3 = Vec3::new(12.0, -4.0, 38.0);

/// The instrument at a tick: it dips into the surface, and rotates.
fn tool(tick: u32) -> Capsule {
    let time = tick as f32 * 1e-3;
    let out = Vec3::new((0.7 * time).cos(), (0.7 * time).sin(), 0.2 * (1.3 * time).sin());
    let at = MIDDLE + out * (45.0 + 25.0 * (3.0 * time).sin());
    let along = (out + 0.8 * out.any_orthonormal_vector()).normalize();
    Capsule::new(at, at + along * 60.0, 2.5).expect("finite")
}

/// The numbers of a contact except its velocity, to the bit.
fn bits(contact: &Contact) -> (u32, [[f32; 3]; 4], f32, u32) {
    let points = [
        contact.normal.to_array(),
        contact.point_on_surface.to_array(),
        contact.point_on_tool.to_array(),
        contact.barycentric,
    ];
    (contact.separation.to_bits(), points, contact.axis_parameter, contact.triangle.0)
}

#[test]
fn a_guard_s_contacts_are_a_tracker_s_within_the_one_budget() {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_280).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(bytes).expect("valid")));
    let frames: Vec<_> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let proxy = Proxy::new(spring, MARGIN).expect("in range");
    let (mut listed, mut moving, mut cut, mut most, mut acted, mut opened) = (0, 0, 0, 0, 0, 0);
    let (mut widest, mut between) = (0.0_f32, 0);
    for budget in [100, 200, 300, 600, 1_200, u32::MAX] {
        let options = Options::new().budget(Budget::new(budget));
        let limits = GuardLimits::new(200.0, Millis(200)).options(options).automatic();
        let surface: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
        let ends: Ends =
            surface.start_with_contacts(TreeBytes::new(bytes), limits, NoMac).expect("valid");
        let (mut bus, mut guard) = ends;
        // A tracker gets the same packets through the layers below the guard.
        let buffers: &'static Frames<ROWS, 3> = Box::leak(Box::new(Frames::new()));
        let (writer, mut reader) = buffers.split().expect("once");
        let reach = SurfaceLimits::reach_mm(1_000.0);
        let mut assembler = Assembler::continuous(writer, tree, reach).expect("a metric");
        let mut tracker = Tracker::<u16, 64, OPENED, RANGE>::with_range(tree).expect("deep");
        let (mut own, mut expected) = (List::new(), List::new());
        for tick in 0..4_000 {
            let now = 1_000 + tick;
            if tick % PERIOD == 0 {
                let epoch = 1 + tick / PERIOD;
                let rows = &frames[epoch as usize % frames.len()];
                let id = FrameId { mesh_id: built.summary().mesh_id, session: 1, epoch };
                let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]);
                let fresh = Freshness { age_ms: 0, echo: Some(now) };
                for packet in collect(sender.expect("valid").with_freshness(fresh)) {
                    bus.packet(&packet, Millis(now)).expect("a good packet");
                    assembler.accept(&packet, Millis(now)).expect("a good packet");
                }
                while bus.work(1_000).expect("admitted") == Advance::Pending {}
                while assembler.advance(1_000).expect("admitted") == Advance::Pending {}
            }
            let tool = tool(tick);
            let answer = guard.contacts(&tool, MARGIN, Millis(now), &mut own);
            let latest = reader.latest(Millis(now));
            let frame = latest.of_any_age().expect("published");
            let blend = frame.extrapolated();
            // The distance at which a wall with this margin acts.
            let margin = answer.trust.margin;
            let off = sum_up(blend.position_error(), margin);
            let wider = sum_up(MARGIN, off);
            let found = tracker.contacts(&blend, &tool, wider, &options, &mut expected);
            let found = found.expect("an answer");
            assert_eq!(answer.tracked, Ok(found), "{budget} {tick}");
            // The bound for the true surface: lower by all errors of the searched one.
            let below = f64::from(expected.bound()) - f64::from(off);
            let [bound, next] = [own.bound(), own.bound().next_up()].map(f64::from);
            let is_next = bound <= below && (next > below || below == f64::NEG_INFINITY);
            assert!(is_next, "{budget} {tick}: {bound} {below}");
            assert_eq!(own.len(), expected.len(), "{budget} {tick}");
            for (one, other) in own.iter().zip(expected.iter()) {
                assert_eq!(bits(one), bits(other), "{budget} {tick}");
                let flow = blend.velocity(one.corners, one.barycentric);
                assert_eq!(one.velocity, flow, "{budget} {tick}");
                moving += usize::from(flow.length() > 1.0);
            }
            assert!(own.accuracy() >= expected.accuracy() + margin * 0.999_999, "{margin}");
            // A depth has an additional tolerance, far from where a wall begins.
            let is_outside = found.closest.side == Side::Outside;
            let reach = MARGIN + own.accuracy() - ROUNDING;
            assert!(!is_outside || own.is_empty() || wider > reach, "{wider} {reach}");
            widest = widest.max(wider);
            if let Ok(all) = own.within(MARGIN) {
                assert_eq!(all.is_complete(), expected.bound() >= wider, "{budget} {tick}");
                between += usize::from(expected.bound() >= MARGIN && expected.bound() < wider);
            }
            listed += own.len();
            cut += usize::from(own.bound() < MARGIN);
            let work = found.closest.work();
            if budget < u32::MAX {
                assert!(work <= budget + BESIDES, "{tick}: {work} of {budget}");
            }
            most = most.max(work);
            acted += u32::from(acts(&proxy, &answer, &own, &tool));
            opened = opened.max(guard.tracker().opened_in_range());
        }
    }
    println!("{listed} contacts, {moving} that move; {cut} lists cut; a tick of {most} at most");
    assert!(listed > 5_000 && moving > 3_000 && cut > 500, "{listed} {moving} {cut}");
    assert!(widest > MARGIN + 0.1 && between > 0, "{widest} {between}");
    assert!(most > 1_200 && acted > 3_000 && opened > 50, "{most} {acted} {opened}");
}

/// Whether a proxy pushes, with a guard's contacts.
fn acts(proxy: &Proxy, answer: &Answer, list: &List, tool: &Capsule) -> bool {
    let contacts = answer.contacts(list, MARGIN);
    let wrench = proxy.wrench(contacts, list.accuracy(), tool.axis_start(), Vec3::ZERO, Vec3::ZERO);
    if let Err(cause) = answer.closest {
        assert_eq!(wrench.state, ConstraintState::Safe(cause));
    }
    wrench.force.length() > 0.1
}

type PosedEnds = (
    Bus<'static, 'static, u16, NoMac, PosedRows>,
    Guard<'static, 'static, u16, 64, OPENED, PosedRows, RANGE>,
);

/// Contacts of frames with poses equal those of frames whose vertices were moved: the mesh is rotated and travels in a
/// straight line, so that both are extrapolated alike.
#[test]
fn contacts_on_a_mesh_with_a_pose_are_those_of_the_moved_mesh() {
    let generate::MovingMesh { mesh, .. } = generate::heart(1_280).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree = TreeBytes::new(bytes);
    let surfaces = SurfaceLimits::reach_mm(2_000.0).speed(f32::INFINITY).recovery_mm(f32::INFINITY);
    let limits = GuardLimits::new(300.0, Millis(200)).surfaces(surfaces).automatic();
    let posed: &'static Surface<ROWS, PosedRows> = Box::leak(Box::new(Surface::new()));
    let moved: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
    let (mut bus, mut guard): PosedEnds =
        posed.start_with_contacts(tree, limits, NoMac).expect("valid");
    let (mut other_bus, mut other): Ends =
        moved.start_with_contacts(tree, limits, NoMac).expect("valid");
    let turn = Quat::from_scaled_axis(Vec3::new(0.9, -0.6, 1.3)).normalize();
    let shift =
        |now: u32| Vec3::new(50.0, -80.0, 120.0) + Vec3::new(0.04, 0.02, -0.03) * now as f32;
    let (mut own, mut expected) = (List::new(), List::new());
    let (mut listed, mut inside, mut others) = (0, 0, 0);
    for now in 0..4_000 {
        if now % PERIOD == 0 {
            let frame = mesh.positions.as_slice();
            bus.frame_at(frame, (turn, shift(now)), Millis(now), Millis(now)).expect("good");
            while bus.work(1_000).expect("admitted") == Advance::Pending {}
            let frame: Vec<Vec3> = frame.iter().map(|&at| turn * at + shift(now)).collect();
            other_bus.frame(&frame, Millis(now), Millis(now)).expect("a good frame");
            while other_bus.work(1_000).expect("admitted") == Advance::Pending {}
        }
        let local = tool(now);
        let ends = [local.axis_start(), local.axis_point(1.0)].map(|at| turn * at + shift(now));
        let tool = Capsule::new(ends[0], ends[1], local.radius()).expect("finite");
        let answer = guard.contacts(&tool, MARGIN, Millis(now), &mut own);
        let found = other.contacts(&tool, MARGIN, Millis(now), &mut expected);
        if now < 4 * PERIOD {
            continue;
        }
        assert!(answer.tracked.is_ok() && found.tracked.is_ok(), "{now} {answer:?} {found:?}");
        assert!(own.accuracy() < 0.1, "{now} {} {}", own.accuracy(), expected.accuracy());
        for one in own.iter().filter(|one| one.separation < MARGIN - 0.1) {
            let near =
                |other: &&Contact| other.point_on_surface.distance(one.point_on_surface) < 0.5;
            let Some(same) = expected.iter().find(near) else { continue };
            // A depth has an additional tolerance.
            let tolerance = if one.separation < -2.4 { 0.25 } else { 0.0 };
            let slack = own.accuracy() + expected.accuracy() + tolerance;
            assert!((one.separation - same.separation).abs() <= slack, "{now} {one:?} {same:?}");
            let between = one.point_on_tool - one.point_on_surface;
            assert!(between.cross(one.normal).length() < 0.02, "{now} {one:?}");
            if one.normal.distance(same.normal) > 0.01 {
                continue;
            }
            listed += 1;
            assert!(one.velocity.distance(same.velocity) < 0.5, "{now} {one:?} {same:?}");
            assert!(one.velocity.length() > 10.0, "{now} {one:?}");
            // The same for the bound of a depth.
            if one.separation < -2.5 {
                let row = |of: &Contact| VelocityRow::new(of, 0.0, tool.axis_start());
                let (row, same) = (row(one), row(same));
                let off = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(Vec3::from(b));
                let is_same = off(row.linear, same.linear) < 0.02
                    && off(row.angular, same.angular) < 1.0
                    && (row.least - same.least).abs() < 0.5;
                inside += u32::from(is_same);
                others += u32::from(!is_same);
            }
        }
    }
    println!(
        "{listed} contacts; of {inside} with a depth its rate is the same, of {others} another"
    );
    assert!(listed > 1_000 && inside > 100 && others < inside / 20, "{listed} {inside} {others}");
}

#[test]
fn no_contacts_are_acted_on_without_a_surface_or_trust() {
    let generate::MovingMesh { mesh, .. } = generate::heart(1_280).expect("a valid size");
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let rows = built.to_rows(&mesh.positions);
    let surface: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
    let limits = GuardLimits::new(20.0, Millis(100)).without_transit();
    let (mut bus, mut guard): Ends =
        surface.start_with_contacts(TreeBytes::new(bytes), limits, NoMac).expect("valid");
    let mut list = List::new();
    let tool = tool(0);
    let none = guard.contacts(&tool, 60.0, Millis(1), &mut list);
    assert_eq!(none.contacts(&list, 60.0).err(), Some(Unavailable::NoSurface));
    bus.frame(&mesh.positions, Millis(2), Millis(2)).expect("a good frame");
    while bus.work(1_000).expect("admitted") == Advance::Pending {}
    assert_eq!(rows.len(), ROWS);
    let untrusted = guard.contacts(&tool, 60.0, Millis(3), &mut list);
    assert!(!list.is_empty() && list.within(60.0).is_ok(), "there are some");
    // Nobody has acknowledged.
    let cause = untrusted.closest.err();
    assert!(cause.is_some() && untrusted.contacts(&list, 60.0).err() == cause);
    // An invalid margin is an error of the query, and its list is empty.
    let refused = guard.contacts(&tool, f32::NAN, Millis(4), &mut list);
    let expected = Unavailable::Query(QueryError::Margin { bits: f32::NAN.to_bits() });
    assert_eq!((refused.tracked.err(), refused.closest.err()), (Some(expected), Some(expected)));
    assert!(list.is_empty() && list.within(1.0).is_err());
    // Contacts of an earlier tick do not remain without a pose or a surface.
    let other: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
    let (_, mut blind): Ends =
        other.start_with_contacts(TreeBytes::new(bytes), limits, NoMac).expect("valid");
    guard.contacts(&tool, 60.0, Millis(5), &mut list);
    assert!(!list.is_empty());
    blind.contacts(&tool, 60.0, Millis(5), &mut list);
    assert!(list.is_empty());
}
