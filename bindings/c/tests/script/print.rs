//! A line of an answer, in the format of the program in `tests/programs/layers`.

use std::fmt::Write;

use dibs_nostd::constraint::{ConstraintState, Wrench};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Contacts, NoSide, Proximity, Side, Unavailable};

pub struct Line(String);

impl Line {
    pub fn new(start: &str) -> Self {
        Self(start.to_owned())
    }

    pub fn word(&mut self, word: &str) {
        self.0.push_str(word);
    }

    pub fn end(self) -> String {
        self.0
    }

    pub fn floats(&mut self, values: &[f32]) {
        for value in values {
            write!(self.0, " {:08x}", value.to_bits()).expect("a string");
        }
    }

    pub fn numbers(&mut self, values: &[u32]) {
        for value in values {
            write!(self.0, " {value}").expect("a string");
        }
    }

    fn vec3(&mut self, value: Vec3) {
        self.floats(&value.to_array());
    }

    pub fn proximity(&mut self, found: &Proximity) {
        self.numbers(&[side(found.side)]);
        self.floats(&[found.separation, found.lower, found.accuracy, found.axis_distance]);
        self.vec3(found.point_on_surface);
        self.vec3(found.point_on_tool);
        self.vec3(found.direction);
        self.floats(&[found.axis_parameter]);
        self.floats(&found.barycentric);
        self.numbers(&[found.triangle.map_or(u32::MAX, |triangle| triangle.0)]);
        self.numbers(&found.corners);
        self.numbers(&[found.node_tests, found.triangle_tests]);
    }

    pub fn force(&mut self, wrench: &Wrench) {
        let state = match wrench.state {
            ConstraintState::Inactive => [0, 0],
            ConstraintState::Active => [1, 0],
            ConstraintState::Saturated => [2, 0],
            ConstraintState::Safe(Unavailable::CutShort) => [3, 309],
            ConstraintState::Safe(Unavailable::NoDirection) => [3, 308],
            ConstraintState::Safe(Unavailable::NoSide) => [3, 315],
            other => panic!("{other:?}"),
        };
        self.numbers(&state);
        self.vec3(wrench.force);
        self.vec3(wrench.torque);
    }

    /// The force of a hold whose cause has this code.
    pub fn hold(&mut self, wrench: &Wrench, cause: u32) {
        self.numbers(&[3, cause]);
        self.vec3(wrench.force);
        self.vec3(wrench.torque);
    }

    pub fn contacts(&mut self, contacts: &Contacts<16>) {
        self.numbers(&[contacts.len() as u32, contacts.is_full().into()]);
        self.floats(&[contacts.bound(), contacts.accuracy()]);
        for contact in contacts.iter() {
            self.numbers(&[contact.surface as u32, contact.tool as u32]);
            self.floats(&[contact.separation]);
            self.vec3(contact.normal);
            self.vec3(contact.point_on_tool);
        }
    }
}

fn side(side: Side) -> u32 {
    match side {
        Side::Outside => 0,
        Side::Inside => 1,
        Side::Crossing => 2,
        Side::Either => 10,
        Side::Undefined(NoSide::OpenBoundary) => 5,
        Side::Undefined(NoSide::BelowAccuracy) => 6,
        Side::Undefined(NoSide::Degenerate) => 7,
        Side::Undefined(NoSide::CutShort) => 8,
        Side::Undefined(NoSide::NonManifold) => 9,
        other => panic!("{other:?}"),
    }
}
