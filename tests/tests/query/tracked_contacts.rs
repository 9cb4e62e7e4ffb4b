//! A tracker's contacts compared with those of complete queries.

// Requirement: T-01

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contact, Contacts, MovingSurface, Odometer, Options, Proximity, Query,
    QueryError, Side, Sphere, Tool, Tracker,
};
use fastrand::Rng;
use glam::Vec3;

use dibs_tests::wanderer::Wanderer;

/// Least separation of a tool whose axis does not cross, with an allowance for rounding.
const LEAST_OUTSIDE: f32 = -1.999;

/// Margin of the contacts, in mm.
const MARGIN: f32 = 8.0;

type Tracked<'t> = Tracker<'t, u16, MAX_STACK, 256, 256>;

#[test]
fn contacts_of_a_tracker_are_those_of_a_query() {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut tracker = Tracked::with_range(&tree).expect("deep enough");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut chain = Wanderer::new(2);
    let frames: Vec<_> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let mut odometer = Odometer::new(&tree);
    let (mut own, mut whole) = (Contacts::<64, 2048>::new(), Contacts::<64, 2048>::new());
    let mut step = None;
    let (mut compared, mut fronts, mut restarts) = (0, 0, 0);
    for tick in 0..if cfg!(debug_assertions) { 100 } else { 3_000 } {
        let tool = chain.step()[0];
        let frame = tick / 30 % frames.len();
        let next = (frame + 1) % frames.len();
        if tick % 30 == 0 {
            step = Some(odometer.step(frames[frame].as_slice(), frames[next].as_slice()));
        }
        let step = step.as_ref().expect("the first tick has a frame");
        let surface = step.at((tick % 30) as f32 / 30.0);
        let options = Options::new();
        let opened = tracker.opened_in_range();
        let found = tracker.contacts(&surface, &tool, MARGIN, &options, &mut own);
        // As long as a front is kept, it only grows.
        restarts += usize::from(tracker.opened_in_range() < opened);
        let found = found.expect("an answer");
        let closest = query.contacts(&surface, &tool, MARGIN, &Options::cold(), &mut whole);
        let closest = closest.expect("an answer");
        assert_eq!(found.closest.side, closest.side, "{tick}");
        assert_eq!(own.len(), whole.len(), "{tick}: {own:?} {whole:?}");
        for (one, other) in own.iter().zip(whole.iter()) {
            assert!((one.separation - other.separation).abs() < 0.05, "{tick}: {one:?} {other:?}");
        }
        compared += own.len();
        fronts += usize::from(found.fallback.is_none());
    }
    println!("{compared} contacts, {fronts} ticks by the front, {restarts} of the range anew");
    if !cfg!(debug_assertions) {
        assert!(compared > 400 && fronts > 2_000, "{compared} {fronts}");
        assert!(
            tracker.opened_in_range() > 0 && restarts < 30,
            "{} {restarts}",
            tracker.opened_in_range()
        );
    }
    let refused = {
        let surface = odometer.start(frames[0].as_slice());
        let tool = chain.step()[0];
        tracker.contacts(&surface, &tool, -1.0, &Options::new(), &mut own)
    };
    assert!(matches!(refused, Err(QueryError::Margin { .. })), "{refused:?}");
    assert!(own.is_empty());
}

/// Contacts of one list that another lacks, among those with a separation less than `bound`. The pair of a crossing
/// axis, which is found to a tolerance, is not compared. A part of a wall is not a separate contact, but may be in a
/// list with too little room.
fn missing<'c>(
    from: impl Iterator<Item = &'c Contact>,
    list: &(impl Iterator<Item = &'c Contact> + Clone),
    bound: f32,
    may_be_part: bool,
) -> usize {
    let is_part = |one: &Contact, other: &Contact| {
        may_be_part
            && other.separation < one.separation + 1e-3
            && other.normal.distance(one.normal) < 0.15
    };
    let is_same = |one: &Contact, other: &Contact| {
        (one.separation - other.separation).abs() < 1e-3
            && one.point_on_surface.distance(other.point_on_surface) < 0.5
    };
    let below = from.filter(|one| one.separation > LEAST_OUTSIDE && one.separation < bound);
    below
        .filter(|one| !list.clone().any(|other| is_same(one, other) || is_part(one, other)))
        .count()
}

/// Compares a tracker's contacts with a complete query's. Adds the numbers of compared, missing and invalid contacts.
fn compare<S: MovingSurface, T: Tool, const NEAR: usize, const RANGE: usize>(
    tracker: &mut Tracker<'_, u16, MAX_STACK, 256, RANGE>,
    surface: &S,
    tool: &T,
    options: &Options,
    list: &mut Contacts<64, NEAR>,
    [compared, wrong]: &mut [usize; 2],
) {
    let mut query = Query::<u16, MAX_STACK>::new(tracker.tree()).expect("deep enough");
    let mut whole = Contacts::<64, 2048>::new();
    let expected = query.contacts(surface, tool, MARGIN, &Options::cold(), &mut whole);
    expected.expect("an answer");
    let tracked = tracker.contacts(surface, tool, MARGIN, options, list).expect("an answer");
    let certain = tracked.closest.interval().lower;
    assert!(list.bound() >= certain.min(MARGIN), "{} {tracked:?}", list.bound());
    let bound = list.bound() - 2.0 * list.accuracy();
    *compared += whole.iter().filter(|one| one.separation < bound).count();
    // A closest pair that the budget left uncertain has the least separation.
    let first = list.iter().next().map_or(MARGIN, |first| first.separation);
    let width = tracked.closest.separation - tracked.closest.lower;
    let is_uncertain = width > list.accuracy() && first <= certain + 2.0 * list.accuracy();
    let certain = list.iter().skip(usize::from(is_uncertain));
    *wrong += missing(whole.iter(), &list.iter(), bound, false)
        + missing(certain, &whole.iter(), whole.bound(), true);
}

#[test]
fn contacts_survive_leaps_rests_budgets_and_other_trackers() {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let heart = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    // The same surface in another tree: a list may be used with both.
    let other = Builder::new().stretch(1.8).build(&mesh).expect("a valid mesh");
    let trees = [&heart, &other].map(|built| built.tree::<u16>().expect("16-bit indices"));
    let frames = [&heart, &other].map(|built| -> Vec<_> {
        motion.frames.iter().map(|frame| built.to_rows(frame)).collect()
    });
    let [mut one, mut two] = [0, 1].map(|at| Tracked::with_range(&trees[at]).expect("deep enough"));
    let mut odometers = [0, 1].map(|at| Odometer::new(&trees[at]));
    // One budget is too small for any front, one for most, and one is sufficient.
    let (mut short, mut middle, mut long) =
        (Contacts::<64, 24>::new(), Contacts::<64, 96>::new(), Contacts::<64, 2048>::new());
    let (mut chain, mut rng) = (Wanderer::new(5), Rng::with_seed(16));
    let mut found = [0; 2];
    for frame in 0..if cfg!(debug_assertions) { 4 } else { 300 } {
        let now = [0, 1].map(|at| frames[at][frame % frames[at].len()].as_slice());
        let next = [0, 1].map(|at| frames[at][(frame + 1) % frames[at].len()].as_slice());
        // Sometimes the odometer starts again.
        if rng.u32(..20) == 0 {
            odometers[0].start(frames[0][0].as_slice());
        }
        let steps = [0, 1].map(|at| odometers[at].step(now[at], next[at]));
        for tick in 0..30 {
            let tool = chain.step()[rng.u32(..40) as usize / 39];
            // Not asked at every tick.
            if rng.u32(..4) == 0 {
                continue;
            }
            let share = tick as f32 / 30.0;
            let options = match rng.u32(..8) {
                0 => Options::new().budget(Budget::new(rng.u32(..1_600))),
                _ => Options::new(),
            };
            let (tracker, step) =
                if rng.u32(..12) == 0 { (&mut two, &steps[1]) } else { (&mut one, &steps[0]) };
            let surface = step.at(share);
            let tip = Sphere::new(tool.start(), 2.0).expect("a valid sphere");
            match rng.u32(..30) {
                0..3 => compare(tracker, &surface, &tip, &options, &mut long, &mut found),
                3..10 => compare(tracker, &surface, &tool, &options, &mut short, &mut found),
                10..20 => compare(tracker, &surface, &tool, &options, &mut middle, &mut found),
                _ => compare(tracker, &surface, &tool, &options, &mut long, &mut found),
            }
        }
    }
    let [compared, wrong] = found;
    println!("{compared} contacts");
    assert_eq!(wrong, 0, "contacts missing or of nothing, of {compared}");
    assert!(cfg!(debug_assertions) || compared > 500, "{compared}");
}

/// Compares the contacts of ticks within many budgets, with this many places for opened nodes.
fn compare_budgets<const RANGE: usize>(found: &mut [usize; 2]) {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let tracker = Tracker::<u16, MAX_STACK, 256, RANGE>::with_range(&tree);
    let mut tracker = tracker.expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let mut list = Contacts::<64, 4>::new();
    for row in (0..tree.vertex_count()).step_by(97) {
        let at = rows[row as usize] * 1.05;
        let tool = Sphere::new(at, 2.0).expect("a valid sphere");
        for node_tests in (0..600).step_by(3) {
            let options = Options::new().budget(Budget::new(node_tests));
            compare(&mut tracker, &surface, &tool, &options, &mut list, found);
        }
    }
}

/// Nodes for which the front has no place are searched from the stack; without any place, all are.
#[test]
fn no_budget_hides_contacts_for_which_the_front_has_no_place() {
    let mut found = [0; 2];
    compare_budgets::<256>(&mut found);
    compare_budgets::<8>(&mut found);
    compare_budgets::<0>(&mut found);
    let [compared, wrong] = found;
    println!("{compared} contacts below the lists' bounds");
    assert_eq!(wrong, 0, "contacts missing or of nothing, of {compared}");
    assert!(compared > 500, "{compared}");
}

/// A search that its budget ended leaves opened nodes that their parents do not record: a front kept from it would find
/// their contacts twice.
#[test]
fn a_search_that_was_cut_short_doubles_no_contact() {
    let mesh = generate::brain(2_000).expect("a valid size");
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut tracker = Tracked::with_range(&tree).expect("deep enough");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let (mut list, mut whole) = (Contacts::<64, 1024>::new(), Contacts::<64, 1024>::new());
    let mut compared = 0;
    for row in (0..tree.vertex_count()).step_by(53) {
        let tool = Sphere::new(rows[row as usize] * 1.05, 2.0).expect("a valid sphere");
        query.contacts(&surface, &tool, MARGIN, &Options::cold(), &mut whole).expect("an answer");
        for node_tests in (20..900).step_by(40) {
            let budget = Budget::new(node_tests);
            let options = Options::new().budget(budget);
            tracker.contacts(&surface, &tool, MARGIN, &options, &mut list).expect("an answer");
            tracker
                .contacts(&surface, &tool, MARGIN, &Options::new(), &mut list)
                .expect("an answer");
            assert_eq!(list.len(), whole.len(), "{row} {node_tests}: {list:?} {whole:?}");
            compared += list.len();
        }
    }
    assert!(compared > 500, "{compared}");
}

/// A jump of many times the surface's size exceeds what the bounds of a front can represent.
#[test]
fn a_jump_far_away_starts_the_range_anew() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rest = built.to_rows(&mesh.positions);
    let tip = rest.iter().copied().max_by(|p, q| p.length().total_cmp(&q.length()));
    let tip = tip.expect("a vertex");
    let size = tip.length();
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut compared = 0;
    for jump in [64.0, 128.0, 160.0, 200.0, 256.0, 300.0] {
        let shift = Vec3::X * (jump * size);
        let far: Vec<Vec3> = rest.iter().map(|&p| p + shift).collect();
        let mut odometer = Odometer::new(&tree);
        let mut tracker = Tracked::with_range(&tree).expect("deep enough");
        let (mut own, mut whole) = (Contacts::<64, 2048>::new(), Contacts::<64, 2048>::new());
        let options = Options::new();
        let out = |row: usize| rest[row] + rest[row].normalize() * 3.0;
        let near = Sphere::new(tip + tip / size * 3.0, 1.0).expect("valid");
        let surface = odometer.start(rest.as_slice());
        tracker.contacts(&surface, &near, MARGIN, &options, &mut own).expect("an answer");
        assert!(tracker.opened_in_range() > 0);
        let step = odometer.step(rest.as_slice(), far.as_slice());
        let surface = step.at(1.0);
        for row in (1..rest.len()).step_by(97) {
            let mut own = own.clone();
            let tool = Sphere::new(out(row) + shift, 1.0).expect("valid");
            let mut tracker = tracker.clone();
            tracker.contacts(&surface, &tool, MARGIN, &options, &mut own).expect("an answer");
            query
                .contacts(&surface, &tool, MARGIN, &Options::cold(), &mut whole)
                .expect("an answer");
            assert_eq!(own.len(), whole.len(), "{jump} {row}: {own:?} {whole:?}");
            compared += own.len();
        }
    }
    assert!(compared > 60, "{compared}");
}

/// A tick that has no list to search, because the tool is beyond the margin or the budget is used up, leaves the front of
/// the range as it was.
#[test]
fn a_tick_without_a_search_keeps_the_range() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut own, mut whole) = (Contacts::<64, 1024>::new(), Contacts::<64, 1024>::new());
    let (mut warm, mut after, mut anew, mut without) = (0, 0, 0, 0);
    for row in (0..rows.len()).step_by(61) {
        let surface = Odometer::new(&tree).start(rows.as_slice());
        let start = Sphere::new(rows[row] * 1.2, 1.0).expect("a valid sphere");
        let pair = query.closest(&surface, &start, &Options::cold()).expect("an answer");
        let at = |separation: f32| {
            let centre = pair.point_on_surface + pair.direction * (1.0 + separation);
            Sphere::new(centre, 1.0).expect("a valid sphere")
        };
        let [near, far] = [at(MARGIN - 0.01), at(MARGIN + 0.05)];
        let mut tick = |tracker: &mut Tracked<'_>, tool: &Sphere, budget| {
            let options = Options::new().budget(budget);
            let found = tracker.contacts(&surface, tool, MARGIN, &options, &mut own);
            (found.expect("an answer").closest.node_tests, own.len())
        };
        for (tool, budget) in [(far, Budget::UNLIMITED), (near, Budget::new(0))] {
            let mut tracker = Tracked::with_range(&tree).expect("deep enough");
            tick(&mut tracker, &near, Budget::UNLIMITED);
            warm += tick(&mut tracker, &near, Budget::UNLIMITED).0;
            without += usize::from(tick(&mut tracker, &tool, budget).1 == 0);
            let (tests, contacts) = tick(&mut tracker, &near, Budget::UNLIMITED);
            after += tests;
            query.contacts(&surface, &near, MARGIN, &Options::cold(), &mut whole).expect("one");
            assert_eq!(contacts, whole.len(), "{row}");
            // Another label's part is another range.
            let options = Options::new().contacts_of(1);
            tracker.contacts(&surface, &near, MARGIN, &options, &mut whole).expect("an answer");
            anew += tick(&mut tracker, &near, Budget::UNLIMITED).0;
        }
    }
    println!("{warm} tests with a range, {after} after a tick without a search, {anew} anew");
    assert!(without > 20 && after < warm + (anew - warm) / 10, "{warm} {after} {anew} {without}");
}

/// The list is searched within the rest of the budget after the closest pair, and pays for its start, too.
#[test]
fn a_tick_with_contacts_takes_no_more_than_its_budget() {
    const START: u32 = 80;
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let (mut without, mut started, mut complete) = (0, 0, 0);
    for row in (0..rows.len()).step_by(41) {
        let tip = rows[row] * 1.05;
        let tool = Capsule::new(tip, tip + rows[row] + Vec3::X * 20.0, 1.0).expect("valid");
        let first = |budget| {
            let mut tracker = Tracked::with_range(&tree).expect("deep enough");
            let mut list = Contacts::<8>::new();
            let options = Options::cold().budget(budget);
            let pair = tracker.closest(&surface, &tool, &options).expect("an answer").closest;
            let mut tracker = Tracked::with_range(&tree).expect("deep enough");
            let found = tracker.contacts(&surface, &tool, MARGIN, &options, &mut list);
            (pair, found.expect("an answer").closest, list)
        };
        let [unlimited, whole] = [Budget::UNLIMITED, Budget::new(1_000_000)].map(first);
        let separations =
            |list: &Contacts<8>| list.iter().map(|at| at.separation).collect::<Vec<_>>();
        assert_eq!(separations(&whole.2), separations(&unlimited.2));
        assert!(!whole.2.is_empty() && whole.2.bound() == unlimited.2.bound());
        // The list's work counts, too.
        let extra = |one: &Proximity, other: &Proximity| one.node_tests - other.node_tests;
        let [of_pair, of_both] = [extra(&whole.0, &unlimited.0), extra(&whole.1, &unlimited.1)];
        assert!(of_both > of_pair + START, "{of_both} {of_pair}");
        for tests in (0..whole.1.work() + 20).step_by(7) {
            let (pair, found, list) = first(Budget::new(tests));
            assert!(found.work() <= tests + 1 + Budget::TRIANGLE, "{tests} {found:?}");
            assert_eq!(found.interval(), pair.interval(), "{tests}");
            let is_known = !matches!(pair.side, Side::Undefined(_));
            assert_eq!(list.within(MARGIN).is_ok(), is_known, "{tests} {pair:?} {list:?}");
            without += u32::from(!is_known);
            started += u32::from(found.work() >= pair.work() + START);
            complete += u32::from(list.within(MARGIN).is_ok_and(|list| list.is_complete()));
            // Without the start of its search a list has the closest pair alone.
            let is_started = found.work() > pair.work();
            assert!(is_started || list.len() <= 1 && list.bound() < MARGIN, "{list:?}");
        }
    }
    println!(
        "{without} ticks without a list, {started} with more than the pair, {complete} complete"
    );
    assert!(without > 50 && started > 200 && complete > 20, "{without} {started} {complete}");
}
