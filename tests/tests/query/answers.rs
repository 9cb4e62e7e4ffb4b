//! The answers of every kind of query, to the bit: a restructuring may not change them.
//!
//! `answers.txt` has one line for each kind: a hash of all answers, and the sums of node and triangle tests. An
//! intended change of the answers is recorded with `DIBS_WRITE=1`, and its commit states the reason.

// Requirements

use std::fmt::Write;

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::constraint::{Proxy, SpringDamper, VelocityRow};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::modes::Modes;
use dibs_nostd::{
    Budget, Capsule, Contacts, Odometer, Options, Proximity, Query, Step, SurfaceBlend, Sweep,
    Tracker, measure_stretch,
};
use dibs_tests::modal::{anywhere, small};
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use dibs_tests::wanderer::Wanderer;
use fastrand::Rng;
use glam::Vec3;

/// Poses of each surface, and ticks of each walk.
const POSES: usize = 200;
const TICKS: usize = 240;
/// Margin of the contacts, in mm.
const MARGIN: f32 = 6.0;

/// The answers of one kind so far.
struct Answers {
    hash: u64,
    answers: u64,
    node_tests: u64,
    triangle_tests: u64,
}

impl Answers {
    const fn new() -> Self {
        Self { hash: 0xCBF2_9CE4_8422_2325, answers: 0, node_tests: 0, triangle_tests: 0 }
    }

    fn word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    fn floats(&mut self, floats: impl IntoIterator<Item = f32>) {
        floats.into_iter().for_each(|float| self.word(float.to_bits()));
    }

    fn text(&mut self, text: &str) {
        text.bytes().for_each(|byte| self.word(byte.into()));
    }

    fn pair(&mut self, found: &Proximity) {
        self.floats([found.separation, found.lower, found.accuracy, found.axis_distance]);
        self.floats([found.axis_parameter]);
        for vector in [found.point_on_surface, found.point_on_tool, found.direction] {
            self.floats(vector.to_array());
        }
        self.floats(found.barycentric);
        self.text(&format!("{:?} {:?}", found.side, found.coverage));
        self.word(found.triangle.map_or(u32::MAX, |row| row.0));
        found.corners.into_iter().for_each(|row| self.word(row));
        self.answers += 1;
        self.node_tests += u64::from(found.node_tests);
        self.triangle_tests += u64::from(found.triangle_tests);
    }

    /// Adds the list, its bound and forces.
    fn list<const N: usize, const NEAR: usize>(&mut self, list: &Contacts<N, NEAR>, at: Vec3) {
        self.floats([list.bound(), list.accuracy()]);
        for contact in list.iter() {
            self.floats([contact.separation, contact.axis_parameter]);
            self.floats(contact.point_on_surface.to_array());
            self.floats(contact.normal.to_array());
            self.floats(contact.barycentric);
            self.word(contact.triangle.0);
            self.word((contact.surface << 16 | contact.tool) as u32);
            let row = VelocityRow::new(contact, list.accuracy(), at);
            self.floats(row.linear);
            self.floats(row.angular);
            self.floats([row.least]);
        }
        let proxy = Proxy::new(SpringDamper::stiffness(1.0).max_force(9.0), MARGIN / 2.0)
            .expect("a valid margin");
        let within = list.within(MARGIN);
        let wrench = proxy.wrench(within, list.accuracy(), at, Vec3::X, Vec3::Y);
        self.floats(wrench.force.to_array());
        self.floats(wrench.torque.to_array());
    }
}

/// The text so far.
struct Script(String);

impl Script {
    fn add(&mut self, kind: &str, ask: impl FnOnce(&mut Answers)) {
        let mut all = Answers::new();
        ask(&mut all);
        let Answers { hash, answers, node_tests, triangle_tests } = all;
        assert!(answers > 0, "{kind} has no answers");
        writeln!(self.0, "{kind:<24} {hash:016x} {answers:>6} {node_tests:>9} {triangle_tests:>8}")
            .expect("a string takes all");
    }
}

/// Searches from each pose on each surface.
fn poses(
    all: &mut Answers,
    mut ask: impl FnMut(&mut Answers, &mut Query<'_, u16, MAX_STACK>, &[Vec3], &Capsule),
) {
    for (seed, surface) in (0..).zip(surfaces::all(false)) {
        let tree = surface.tree.tree::<u16>().expect("16-bit indices");
        let rows = surface.tree.to_rows(&surface.mesh.positions);
        let mut query = Query::new(&tree).expect("deep enough");
        let mut rng = Rng::with_seed(seed);
        for _ in 0..POSES {
            let tool = pose(&surface.mesh.positions, &surface.mesh.triangles, &mut rng);
            let tool = Capsule::new(tool.start, tool.end, tool.radius).expect("a valid tool");
            ask(all, &mut query, &rows, &tool);
        }
    }
}

/// Walks a chain of tools past a beating heart whose surface is interpolated between frames or extrapolated.
fn walk(
    built: &BuiltTree,
    frames: &[Vec<Vec3>],
    is_ahead: bool,
    mut ask: impl FnMut(usize, &SurfaceBlend<'_, [Vec3], [Vec3]>, &[Capsule; 8]),
) {
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut odometer = Odometer::new(&tree);
    let mut chain = Wanderer::new(5);
    let mut step = None;
    for tick in 0..TICKS {
        let [before, after] = [0, 1].map(|add| &frames[(tick / 30 + add) % frames.len()]);
        if tick % 30 == 0 {
            step = Some(odometer.step(before.as_slice(), after.as_slice()));
        }
        let step: &Step<'_, [Vec3], [Vec3]> = step.as_ref().expect("the first tick has a frame");
        let share = (tick % 30) as f32 / 30.0;
        let surface = if is_ahead { step.beyond(share) } else { step.at(share) };
        ask(tick, &surface, &chain.step());
    }
}

#[test]
fn every_answer_is_the_recorded_one() {
    let mut script = Script(String::new());
    one_by_one(&mut script);
    scenes(&mut script);
    tracked(&mut script);
    modal(&mut script);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/query/answers.txt");
    if std::env::var_os("DIBS_WRITE").is_some() {
        std::fs::write(path, &script.0).expect("writable");
    }
    let recorded = std::fs::read_to_string(path).expect("in the repository");
    for (recorded, found) in recorded.lines().zip(script.0.lines()) {
        assert_eq!(recorded, found, "DIBS_WRITE=1 records a change on purpose");
    }
    assert_eq!(recorded.lines().count(), script.0.lines().count());
}

/// The kinds of a single query.
fn one_by_one(script: &mut Script) {
    let cold = Options::cold();
    let few = Budget::new(100);
    let one_by_one: [(&str, Options); 6] = [
        ("distance", cold.unsigned()),
        ("distance, warm", Options::new().unsigned()),
        ("distance, budget", cold.unsigned().budget(few)),
        ("side", cold.depth_tolerance(f32::INFINITY)),
        ("depth", cold),
        ("depth, budget", cold.budget(Budget::new(440))),
    ];
    for (kind, options) in one_by_one {
        script.add(kind, |all| {
            poses(all, |all, query, rows, tool| {
                all.pair(&query.closest(rows, tool, &options).expect("an answer"));
            });
        });
    }
    script.add("batched", |all| {
        poses(all, |all, query, rows, tool| {
            all.pair(&query.closest_batched(rows, tool, &cold).expect("an answer"));
        });
    });
    script.add("within", |all| {
        poses(all, |all, query, rows, tool| {
            all.pair(&query.closest_within(rows, tool, 4.0, &cold).expect("an answer"));
        });
    });
    for (kind, options) in [("contacts", cold), ("contacts, budget", cold.budget(Budget::new(440)))]
    {
        script.add(kind, |all| {
            let mut list = Contacts::<8, 128>::new();
            poses(all, |all, query, rows, tool| {
                let found = query.contacts(rows, tool, MARGIN, &options, &mut list);
                all.pair(&found.expect("an answer"));
                all.list(&list, Vec3::ZERO);
            });
        });
    }
}

/// A chain of tools and two surfaces.
fn scenes(script: &mut Script) {
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let one = built.to_rows(&mesh.positions);
    let other: Vec<Vec3> = one.iter().map(|row| *row + Vec3::X * 170.0).collect();
    let new = || Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut here, mut there) = (new(), new());
    let mut list = Contacts::<16, 256>::new();
    for kind in ["chain", "scene", "scene's contacts"] {
        script.add(kind, |all| {
            let mut chain = Wanderer::new(9);
            for _ in 0..TICKS {
                let tools = chain.step();
                let options = Options::cold();
                let mut surfaces = [(&mut here, one.as_slice()), (&mut there, other.as_slice())];
                let found = match kind {
                    "chain" => here.closest_of(one.as_slice(), &tools, &options),
                    "scene" => Query::closest_in_scene(&mut surfaces, &tools, &options),
                    _ => {
                        Query::contacts_in_scene(&mut surfaces, &tools, MARGIN, &options, &mut list)
                    }
                };
                let found = found.expect("an answer").expect("pairs");
                all.pair(&found.proximity);
                all.word((found.surface << 16 | found.tool) as u32);
                if kind == "scene's contacts" {
                    all.list(&list, Vec3::ZERO);
                }
            }
        });
    }
}

/// The kinds of a tracker.
fn tracked(script: &mut Script) {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<_> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let new = || Tracker::<u16, MAX_STACK, 256, 512>::with_range(&tree).expect("deep enough");
    let all_kinds = [
        ("tracked", Options::new().unsigned(), false),
        ("tracked, budget", Options::new().unsigned(), false),
        ("tracked side", Options::new(), false),
        ("tracked ahead", Options::new(), true),
    ];
    for (kind, options, is_ahead) in all_kinds {
        script.add(kind, |all| {
            let mut tracker = new();
            walk(&built, &frames, is_ahead, |tick, surface, tools| {
                let few = Budget::new(20 + tick as u32 % 60);
                let options = if kind.ends_with("budget") { options.budget(few) } else { options };
                let found = tracker.closest(surface, &tools[0], &options).expect("an answer");
                all.pair(&found.closest);
                all.text(&format!("{:?}", found.fallback));
            });
        });
    }
    script.add("tracked contacts", |all| {
        let (mut tracker, mut list) = (new(), Contacts::<8, 512>::new());
        walk(&built, &frames, false, |_, surface, tools| {
            let found = tracker.contacts(surface, &tools[0], MARGIN, &Options::new(), &mut list);
            all.pair(&found.expect("an answer").closest);
            all.list(&list, Vec3::ZERO);
        });
    });
    script.add("tracked chain", |all| {
        let mut trackers = [(); 8].map(|()| new());
        walk(&built, &frames, false, |_, surface, tools| {
            let pairs = trackers.iter_mut().zip(tools);
            let mut pairs: Vec<_> = pairs.map(|(own, tool)| (own, surface, tool)).collect();
            let found = Tracker::closest_of(&mut pairs, &Options::new()).expect("an answer");
            let found = found.expect("pairs");
            all.pair(&found.closest);
            all.word(found.pair as u32);
        });
    });
    script.add("sweep", |all| {
        let mut tracker = new();
        let mut odometer = Odometer::new(&tree);
        let mut chain = Wanderer::new(5);
        let mut last = chain.step()[0];
        for tick in 0..TICKS {
            let [before, after] = [0, 1].map(|add| frames[(tick + add) % frames.len()].as_slice());
            let step = odometer.step(before, after);
            let next = chain.step()[0];
            let sweep = Sweep { step: &step, t: [0.0, 1.0], tools: [last, next] };
            let swept = tracker.sweep(&sweep, 2.0, 8, &Options::new()).expect("an answer");
            all.pair(&swept.at_end);
            all.floats([swept.clear_until, swept.contact.unwrap_or(-1.0)]);
            all.word(swept.samples);
            last = next;
        }
    });
}

/// A modal surface, and its measured stretch.
fn modal(script: &mut Script) {
    let (built, _) = small(6);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let modes = Modes::of(&tree).expect("has modes");
    let mut rng = Rng::with_seed(3);
    script.add("modal", |all| {
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for _ in 0..TICKS {
            let surface = modes.surface::<6>(&anywhere(&modes, &mut rng)).expect("in range");
            let start = Vec3::from([(); 3].map(|()| 120.0 * (rng.f32() - 0.5)));
            let tool = Capsule::new(start, start + Vec3::X * 20.0, 2.0).expect("a valid tool");
            let stretch = measure_stretch(&tree, &surface).expect("within the limit");
            let options = Options::cold().stretch(stretch);
            all.floats([stretch.sigma()]);
            all.pair(&query.closest(&surface, &tool, &options).expect("an answer"));
        }
    });
}
