//! The part of a script that concerns scenes: a chain of tools and two surfaces.

use std::fmt::Write;

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Budget, Capsule, Closest, Contacts, Options, Query};

use super::print::Line;
use super::{FRAMES, MARGIN, Surface};

/// A chain, at the surface of the frame that the script is at and at another one.
pub struct Scene {
    /// Number of the other frame.
    pub other: usize,
    joints: Vec<Vec3>,
    radius: f32,
    budget: Budget,
}

impl Scene {
    /// A chain of one to four tools that begins near a vertex. One tool in four has no length, one chain in four a small
    /// budget.
    pub fn new(rows: &[Vec3], random: &mut fastrand::Rng) -> Self {
        let within = |random: &mut fastrand::Rng, size: f32| {
            let mut axis = || (random.f32() - 0.5) * 2.0 * size;
            Vec3::new(axis(), axis(), axis())
        };
        let mut joints = vec![rows[random.usize(..rows.len())] + within(random, 12.0)];
        for _ in 0..random.usize(1..=4) {
            let span = if random.u8(..4) == 0 { Vec3::ZERO } else { within(random, 40.0) };
            joints.push(joints[joints.len() - 1] + span);
        }
        let budget = match random.u8(..4) {
            0 => Budget::new(random.u32(..720)),
            _ => Budget::UNLIMITED,
        };
        Self { other: random.usize(..FRAMES), joints, radius: random.f32() * 3.0, budget }
    }

    pub fn write(&self, lines: &mut String) {
        write!(lines, "scene {} {} 0", self.other, self.budget.tests()).expect("a string");
        for ends in self.joints.windows(2) {
            for number in ends.iter().flat_map(Vec3::to_array).chain([self.radius]) {
                write!(lines, " {number}").expect("a string");
            }
        }
        lines.push('\n');
    }

    /// The closest pair; the contacts, with the closest pair again.
    pub fn answer(
        &self,
        surfaces: &mut [(&mut Query<'_, u16, 512>, &Surface<'_>)],
        contacts: &mut Contacts<16>,
    ) -> String {
        let options = Options::new().budget(self.budget);
        let tool = |ends: &[Vec3]| Capsule::new(ends[0], ends[1], self.radius).expect("a tool");
        let tools: Vec<_> = self.joints.windows(2).map(tool).collect();
        let mut line = Line::new("scene 0");
        let found = Query::closest_in_scene(surfaces, &tools, &options).expect("an answer");
        closest(&mut line, &found.expect("a pair"));
        let found = Query::contacts_in_scene(surfaces, &tools, MARGIN, &options, contacts);
        line.word(" contacts 0");
        closest(&mut line, &found.expect("contacts").expect("a pair"));
        line.contacts(contacts);
        line.end()
    }
}

fn closest(line: &mut Line, found: &Closest) {
    line.numbers(&[found.surface as u32, found.tool as u32]);
    line.proximity(&found.proximity);
}
