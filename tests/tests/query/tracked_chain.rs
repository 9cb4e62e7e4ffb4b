//! Several trackers compared with complete queries: the same answers, but most pairs are not searched.

// Requirement: T-01

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, MovingTable, NoSide, Odometer, Options, Query, Side, Sphere, Tracker,
};
use dibs_tests::surfaces::{ball, sheet};
use glam::Vec3;

use dibs_tests::wanderer::Wanderer;

type Tracked<'t> = Tracker<'t, u16, MAX_STACK, 256>;

#[test]
fn the_closest_of_tracked_pairs_is_that_of_whole_queries() {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let ticks = if cfg!(debug_assertions) { 200 } else { 6_000 };
    for is_signed in [false, true] {
        let options = Options::new();
        let options = if is_signed { options } else { options.unsigned() };
        let mut trackers: Vec<Tracked> =
            (0..16).map(|_| Tracked::new(&tree).expect("deep enough")).collect();
        let mut single = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut chain = Wanderer::new(1);
        let mut odometers = [Odometer::new(&tree), Odometer::new(&tree)];
        let one: Vec<_> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
        let beside = |rows: &Vec<Vec3>| rows.iter().map(|&row| row + Vec3::X * 170.0).collect();
        let other: Vec<Vec<Vec3>> = one.iter().map(beside).collect();
        let mut steps = None;
        let (mut searched, mut inside, mut cut_short, mut undefined) = (0_u64, 0, 0, 0);
        for tick in 0..ticks {
            let capsules = chain.step();
            let frame = tick / 30 % one.len();
            let next = (frame + 1) % one.len();
            if tick % 600 == 599 {
                // Its next step starts again.
                odometers[1].start(one[next].as_slice());
            }
            if tick % 30 == 0 {
                let [first, second] = &mut odometers;
                steps = Some([
                    first.step(one[frame].as_slice(), one[next].as_slice()),
                    second.step(other[frame].as_slice(), other[next].as_slice()),
                ]);
            }
            let steps = steps.as_ref().expect("the first tick has a frame");
            let share = (tick % 30) as f32 / 30.0;
            let surfaces = steps.each_ref().map(|step| step.at(share));
            let mut pairs: Vec<_> = trackers
                .iter_mut()
                .enumerate()
                .map(|(at, tracker)| (tracker, &surfaces[at / 8], &capsules[at % 8]))
                .collect();
            let budget = (tick % 11 == 10).then_some(Budget::new(100));
            let asked = budget.map_or(options, |budget| options.budget(budget));
            let found = Tracker::closest_of(&mut pairs, &asked).expect("an answer");
            let found = found.expect("sixteen pairs");
            searched += u64::from(found.searched);
            let whole = |at: usize, single: &mut Query<'_, u16, MAX_STACK>| {
                let closest = single.closest(&surfaces[at / 8], &capsules[at % 8], &options);
                closest.expect("an answer")
            };
            let least =
                (0..16).map(|at| whole(at, &mut single).separation).fold(f32::INFINITY, f32::min);
            // The depth of a crossing axis is found to a 512th of its length.
            let off = 2.0 * found.closest.accuracy + if least < 0.0 { 0.06 } else { 0.0 };
            let is_open = found.closest.side == Side::Undefined(NoSide::CutShort);
            if budget.is_some() && is_open {
                undefined += 1;
                continue;
            }
            if budget.is_some() {
                assert!(found.closest.lower <= least + off, "{tick}: {least} {found:?}");
                let upper = found.closest.separation;
                assert!(least <= upper + off, "{tick}: {least} {found:?}");
                assert!(found.closest.work() <= 100 + 16 + Budget::TRIANGLE, "{found:?}");
                cut_short += usize::from(found.closest.lower < found.closest.separation);
                continue;
            }
            assert!((found.closest.separation - least).abs() <= off, "{tick}: {least} {found:?}");
            let own = whole(found.pair, &mut single).separation;
            assert!((own - found.closest.separation).abs() <= off, "{tick}: {own} {found:?}");
            inside += usize::from(matches!(found.closest.side, Side::Inside | Side::Crossing));
        }
        let mean = searched as f64 / ticks as f64;
        println!(
            "{mean:.2} of 16 pairs searched, {inside} ticks inside or crossing, {cut_short} cut short"
        );
        if !cfg!(debug_assertions) {
            assert!(mean < 8.0 && cut_short + undefined > 100, "{mean} {cut_short}");
            // A tick that a budget ended keeps the last side.
            assert!(!is_signed || (inside > 500 && undefined < 10), "{inside} {undefined}");
        }
    }
}

/// A chain that rotates around a heart, so that each of its links is the closest for a while: no tick must catch up on
/// a link that was skipped for long, because some tests are made in advance.
#[test]
fn no_tick_pays_for_a_long_rest() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    for options in [Options::new(), Options::new().unsigned()] {
        let mut trackers: Vec<Tracked> =
            (0..8).map(|_| Tracked::new(&tree).expect("deep enough")).collect();
        let (mut most, mut falls, mut links) = (0, 0, [0; 8]);
        for tick in 0..20_000 {
            let turn = 0.0007 * tick as f32;
            let (sin, cos) = turn.sin_cos();
            let (middle, along) = (90.0 * Vec3::new(cos, sin, 0.3), Vec3::new(-sin, cos, 0.2));
            let slide = 60.0 * (0.37 * turn).sin();
            let joint = |at: usize| middle + along * (20.0 * at as f32 - 80.0 + slide);
            let capsules: [Capsule; 8] = [0, 1, 2, 3, 4, 5, 6, 7]
                .map(|at| Capsule::new(joint(at), joint(at + 1), 2.0).expect("finite"));
            let mut pairs: Vec<_> = trackers
                .iter_mut()
                .zip(&capsules)
                .map(|(tracker, capsule)| (tracker, &surface, capsule))
                .collect();
            let found = Tracker::closest_of(&mut pairs, &options).expect("an answer");
            let found = found.expect("eight pairs");
            links[found.pair] += 1;
            if tick > 0 {
                most = most.max(found.closest.node_tests);
                falls += u32::from(found.fallback.is_some());
            }
        }
        println!("{most} node tests, {falls} whole queries, {links:?} ticks");
        assert!(links.iter().filter(|&&ticks| ticks > 50).count() >= 3, "{links:?}");
        assert!(falls == 0 && most < 250, "{falls} {most}");
    }
}

/// The tracked answer for two pairs, and the separations of complete queries.
fn closest_of_two(
    pairs: &mut [(&mut Tracked<'_>, &MovingTable<'_, [Vec3]>, &Sphere); 2],
    single: &mut Query<'_, u16, MAX_STACK>,
) -> (dibs_nostd::TrackerAnswer, [f32; 2]) {
    let options = Options::new();
    let whole = [0, 1].map(|at| {
        let (_, surface, tool) = &pairs[at];
        single.closest(*surface, *tool, &options).expect("an answer").separation
    });
    let found = Tracker::closest_of(pairs, &options).expect("an answer").expect("two pairs");
    (found, whole)
}

/// Around the border of a sheet a tool reaches its other side without touching it, and is the deepest of all there.
#[test]
fn a_resting_link_is_seen_to_pass_around_a_border() {
    let mesh = sheet(20, 80.0, |_, _| 0.0);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let [mut still, mut moving] = [(); 2].map(|()| Tracked::new(&tree).expect("deep enough"));
    let mut single = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let near = Sphere::new(Vec3::new(0.0, 0.0, 3.0), 1.0).expect("finite");
    let mut behind = 0;
    for tick in 0..4_000 {
        // Half a circle around the border at y = 40, from above to below.
        let (sin, cos) = (std::f32::consts::PI * tick as f32 / 4_000.0).sin_cos();
        let far = Sphere::new(Vec3::new(1.0, 15.0 + 60.0 * sin, 20.0 * cos), 1.0).expect("finite");
        let mut pairs = [(&mut still, &surface, &near), (&mut moving, &surface, &far)];
        let (found, whole) = closest_of_two(&mut pairs, &mut single);
        let least = whole[0].min(whole[1]);
        // A skipped pair's bound is valid until the motion since has used it up.
        behind += u32::from(least < 0.0 && found.closest.separation > 0.0);
        assert!(least < 0.0 || (found.closest.separation - least).abs() < 0.01, "{tick}");
    }
    println!("{behind} ticks until the other side is seen");
    assert!(behind < 400, "{behind}");
}

/// While one tool is deep inside, another one moves in and is skipped, because it is less deep. Once the first has
/// left, the other is the deepest.
#[test]
fn a_resting_link_that_sinks_in_is_inside() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let [mut leaving, mut sinking] = [(); 2].map(|()| Tracked::new(&tree).expect("deep enough"));
    let mut single = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let centre = rows.iter().sum::<Vec3>() / rows.len() as f32;
    let size = rows[0].distance(centre);
    let mut passed_over = 0;
    for tick in 0..1_200 {
        let time = tick as f32 / 1_000.0;
        let depths =
            [if time < 1.0 { 0.7 } else { 0.7 - 4.0 * (time - 1.0) }, time.min(1.0) * 0.4 - 0.05];
        let at = |along, depth| Sphere::new(centre + along * size * (1.0 - depth), 0.02 * size);
        let tools =
            [at(Vec3::X, depths[0]), at(Vec3::Y, depths[1])].map(|tool| tool.expect("finite"));
        let mut pairs = [(&mut leaving, &surface, &tools[0]), (&mut sinking, &surface, &tools[1])];
        let (found, whole) = closest_of_two(&mut pairs, &mut single);
        let least = whole[0].min(whole[1]);
        assert!(
            (found.closest.separation - least).abs() < 1e-3 * size,
            "{tick}: {found:?} {whole:?}"
        );
        passed_over += u32::from(whole[1] < 0.0 && found.searched == 1);
    }
    assert!(passed_over > 100, "{passed_over}");
}

#[test]
fn no_pairs_have_no_closest() {
    let none = Tracked::closest_of::<MovingTable<'_, [Vec3]>, Capsule>(&mut [], &Options::new());
    assert_eq!(none, Ok(None));
}

/// A pair that was searched without its side may be inside: if sides are requested it is searched again.
#[test]
fn a_pair_whose_side_was_not_asked_for_is_not_passed_over() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let centre = rows.iter().sum::<Vec3>() / rows.len() as f32;
    let capsule = |from: Vec3| Capsule::new(from, from + Vec3::X, 1.0).expect("finite");
    let outside = rows.iter().copied().max_by(|a, b| a.x.total_cmp(&b.x)).expect("rows");
    let tools = [capsule(outside + Vec3::X * 4.0), capsule(centre)];
    let mut trackers = [0, 1].map(|_| Tracked::new(&tree).expect("deep enough"));
    let mut ask = |options: &Options| {
        let [one, other] = &mut trackers;
        let mut pairs = [(one, &surface, &tools[0]), (other, &surface, &tools[1])];
        Tracker::closest_of(&mut pairs, options).expect("an answer").expect("two pairs")
    };
    assert_eq!(ask(&Options::new().unsigned()).pair, 0);
    assert_eq!(ask(&Options::new().unsigned()).searched, 1);
    let found = ask(&Options::new());
    assert_eq!((found.pair, found.closest.side), (1, Side::Inside), "{found:?}");
    // Inside, it is searched at every tick.
    assert_eq!(ask(&Options::new()).pair, 1);
}

/// Without adjacency there is no side that could change unseen, so a far pair is passed over. A single pair states its
/// motion.
#[test]
fn a_far_pair_at_a_surface_without_sides_rests() {
    let mesh = ball(3);
    let built = Builder::new().with_adjacency(false).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let tools = [43.0, 90.0].map(|x| Sphere::new(Vec3::X * x, 1.0).expect("finite"));
    let [mut near, mut far, mut alone] =
        [(); 3].map(|()| Tracked::new(&tree).expect("deep enough"));
    for (searched, moved) in [(2, None), (1, Some(0.0))] {
        let mut pairs = [(&mut near, &surface, &tools[0]), (&mut far, &surface, &tools[1])];
        let found = Tracker::closest_of(&mut pairs, &Options::new());
        let found = found.expect("an answer").expect("two pairs");
        assert_eq!((found.pair, found.searched, found.moved), (0, searched, None));
        assert_eq!(found.closest.side, Side::Undefined(NoSide::NoAdjacency));
        let mut pair = [(&mut alone, &surface, &tools[0])];
        let single = Tracker::closest_of(&mut pair, &Options::new());
        let single = single.expect("an answer").expect("one pair");
        assert_eq!((single.pair, single.searched, single.moved), (0, 1, moved));
        assert_eq!(single.closest.separation, found.closest.separation);
    }
}
