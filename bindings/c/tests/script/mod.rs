//! A script of surfaces and poses, and the Rust library's answers to it.

mod bus;
mod print;
mod scene;
mod track;

use std::fmt::Write;

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::constraint::{ForbiddenRegion, Proxy, SpringDamper, VelocityRow, Wrench};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, Capsule, Contacts, MeasuredStretch, Options, Query, Sphere, Tool, Tree, VertexTable,
    measure_stretch,
};
use print::Line;

/// Margin of contacts and wall, in mm.
const MARGIN: f32 = 8.0;
const POSES: usize = 100;
const SCENES: usize = 20;
const FRAMES: usize = 12;

/// A script, and the files that it refers to.
pub struct Script {
    built: BuiltTree,
    /// The tree's bytes.
    pub tree: Vec<u8>,
    /// The positions of all frames.
    pub frames: Vec<u8>,
    /// The script's lines.
    pub lines: String,
    surfaces: Vec<Vec<Vec3>>,
    poses: Vec<Pose>,
    scenes: Vec<scene::Scene>,
    events: Vec<bus::Event>,
}

struct Pose {
    start: Vec3,
    end: Vec3,
    radius: f32,
    budget: Budget,
    is_cold: bool,
}

impl Script {
    /// Makes a script of poses on, in and around a beating heart.
    pub fn new() -> Self {
        let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a size");
        let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
        let mut random = fastrand::Rng::with_seed(17);
        let (mut surfaces, mut poses, mut scenes) = (Vec::new(), Vec::new(), Vec::new());
        let (mut frames, mut lines) = (Vec::new(), String::new());
        for frame in 0..FRAMES {
            let rows = built.to_rows(&motion.frames[frame * 3 % motion.frames.len()]);
            frames.extend(rows.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
            writeln!(lines, "frame {frame}").expect("a string");
            for _ in 0..POSES {
                let pose = Pose::new(&rows, &mut random);
                pose.write(&mut lines);
                poses.push(pose);
            }
            for _ in 0..SCENES {
                let scene = scene::Scene::new(&rows, &mut random);
                scene.write(&mut lines);
                scenes.push(scene);
            }
            surfaces.push(rows);
        }
        let events = bus::events(&built, &surfaces, &mut lines);
        Self { tree: built.blob().to_vec(), built, frames, lines, surfaces, poses, scenes, events }
    }

    /// The answers that a program must give, line by line.
    pub fn answers(&self) -> Vec<String> {
        let tree = Tree::<u16>::from_bytes(self.built.blob()).expect("a tree");
        let query = || Query::<_, 512>::new(&tree).expect("a stack");
        let (mut query, mut other) = (query(), query());
        let mut contacts = Contacts::<16>::new();
        let mut answers = Vec::new();
        let surfaces = self.surfaces.iter().map(|rows| Surface::new(&tree, rows));
        let surfaces: Vec<_> = surfaces.collect();
        let poses = self.poses.chunks(POSES).zip(self.scenes.chunks(SCENES));
        for (surface, (poses, scenes)) in surfaces.iter().zip(poses) {
            answers.extend(poses.iter().map(|pose| {
                if pose.start == pose.end {
                    let tool = Sphere::new(pose.start, pose.radius).expect("a tool");
                    answer(&mut query, &mut contacts, surface, &tool, pose)
                } else {
                    let tool = Capsule::new(pose.start, pose.end, pose.radius).expect("a tool");
                    answer(&mut query, &mut contacts, surface, &tool, pose)
                }
            }));
            answers.extend(scenes.iter().map(|scene| {
                let mut both = [(&mut query, surface), (&mut other, &surfaces[scene.other])];
                scene.answer(&mut both, &mut contacts)
            }));
        }
        answers.extend(bus::answers(&self.built, &self.events));
        answers
    }
}

impl Pose {
    /// A sphere or a capsule that begins near a vertex, on either side of the surface. One in five has a small budget.
    fn new(rows: &[Vec3], random: &mut fastrand::Rng) -> Self {
        let mut within = |size: f32| {
            let mut axis = || (random.f32() - 0.5) * 2.0 * size;
            Vec3::new(axis(), axis(), axis())
        };
        let (near, span) = (within(12.0), within(40.0));
        let start = rows[random.usize(..rows.len())] + near;
        let end = if random.u8(..3) == 0 { start } else { start + span };
        let budget = match random.u8(..5) {
            0 => Budget::new(random.u32(..360)),
            _ => Budget::UNLIMITED,
        };
        let radius = random.f32() * 3.0;
        Self { start, end, radius, budget, is_cold: random.u8(..4) == 0 }
    }

    fn write(&self, lines: &mut String) {
        let Self { start, end, radius, budget, is_cold, .. } = self;
        let numbers = [start.x, start.y, start.z, end.x, end.y, end.z, *radius];
        let numbers = numbers.map(|number| number.to_string()).join(" ");
        let flags = u32::from(*is_cold);
        writeln!(lines, "pose {numbers} {} {flags}", budget.tests()).expect("a string");
    }

    fn options(&self) -> Options {
        let options = if self.is_cold { Options::cold() } else { Options::new() };
        options.budget(self.budget)
    }
}

/// A frame with its stretch.
struct Surface<'s> {
    rows: &'s [Vec3],
    stretch: MeasuredStretch,
}

impl<'s> Surface<'s> {
    fn new(tree: &Tree<'_, u16>, rows: &'s [Vec3]) -> Self {
        Self { rows, stretch: measure_stretch(tree, rows).expect("a surface within its limit") }
    }
}

impl VertexTable for Surface<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.rows.position(vertex)
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        Some(self.stretch)
    }
}

/// The line of a pose: the closest pair and its force; the contacts, their rows, and their force.
fn answer(
    query: &mut Query<'_, u16, 512>,
    contacts: &mut Contacts<16>,
    surface: &Surface<'_>,
    tool: &impl Tool,
    pose: &Pose,
) -> String {
    let options = pose.options();
    let (velocity, angular) = (Vec3::new(10.0, -20.0, 5.0), Vec3::new(0.0, 0.1, 0.0));
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let mut line = Line::new("closest 0");

    let found = query.closest(surface, tool, &options).expect("an answer");
    line.proximity(&found);
    let region = ForbiddenRegion::new(spring, MARGIN).expect("a margin");
    let force = region.force(&Ok(found), velocity);
    line.force(&Wrench { force: force.force, torque: Vec3::ZERO, state: force.state });

    query.contacts(surface, tool, MARGIN, &options, contacts).expect("contacts");
    line.word(" contacts 0");
    line.contacts(contacts);
    for contact in contacts.iter() {
        let row =
            VelocityRow::new(contact, contacts.accuracy(), pose.start).stand_off(1.0).gain(20.0);
        line.floats(&row.linear);
        line.floats(&row.angular);
        line.floats(&[row.least]);
    }
    let proxy = Proxy::new(spring, MARGIN).expect("a margin");
    let within = contacts.within(MARGIN);
    let wrench = proxy.wrench(within, contacts.accuracy(), pose.start, velocity, angular);
    line.force(&wrench);
    line.end()
}
