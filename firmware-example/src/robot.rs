//! Interface to the robot that moves the instrument: encoders and drives on a real robot, here a script or a simulated
//! hand.

use dibs_nostd::constraint::ConstraintForce;
use dibs_nostd::filter::{AdmittedMotion, FilterError, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::Answer;
use dibs_nostd::{Capsule, ToolError};

use crate::instrument;
use crate::pushed::PushedRobot;
use crate::telemetry::Push;

/// An instrument's robot. To use your own, read the encoders and write to the drives here.
pub trait Robot {
    /// The instrument at this tick.
    ///
    /// # Errors
    /// [`ToolError`] if the pose is not finite.
    fn instrument(&self, tick: u32) -> Result<Capsule, ToolError>;

    /// The motion commanded until the next tick; `None` for a robot that a hand moves against a force.
    fn command(&self) -> Option<RigidMotion>;

    /// Applies the force of a wall, within the limits of the drives. Returns the applied force, in N.
    fn apply(&mut self, answer: &Answer, force: &ConstraintForce) -> Vec3;

    /// Executes the admitted motion. After an error the instrument must rest.
    fn execute(&mut self, answer: &Answer, admitted: &Result<AdmittedMotion, FilterError>);

    /// The record of a simulated hand that pushes.
    fn push(&self) -> Option<Push>;
}

/// The script of [`instrument`]: nothing stops it, so that the wall is tested from inside as well.
pub struct Script;

impl Robot for Script {
    fn instrument(&self, tick: u32) -> Result<Capsule, ToolError> {
        instrument(tick)
    }

    fn command(&self) -> Option<RigidMotion> {
        None
    }

    fn apply(&mut self, _: &Answer, force: &ConstraintForce) -> Vec3 {
        force.force
    }

    fn execute(&mut self, _: &Answer, _: &Result<AdmittedMotion, FilterError>) {}

    fn push(&self) -> Option<Push> {
        None
    }
}

/// The demo's robot, chosen when it starts.
pub enum Either {
    /// The script.
    Script(Script),
    /// The hand.
    Pushed(PushedRobot),
}

impl Either {
    /// The script, or an instrument that a simulated hand pushes.
    #[must_use]
    pub fn new(is_pushed: bool) -> Self {
        if is_pushed { Self::Pushed(PushedRobot::new()) } else { Self::Script(Script) }
    }
}

impl Robot for Either {
    fn instrument(&self, tick: u32) -> Result<Capsule, ToolError> {
        match self {
            Self::Script(robot) => robot.instrument(tick),
            Self::Pushed(robot) => robot.instrument(tick),
        }
    }

    fn command(&self) -> Option<RigidMotion> {
        match self {
            Self::Script(robot) => robot.command(),
            Self::Pushed(robot) => robot.command(),
        }
    }

    fn apply(&mut self, answer: &Answer, force: &ConstraintForce) -> Vec3 {
        match self {
            Self::Script(robot) => robot.apply(answer, force),
            Self::Pushed(robot) => robot.apply(answer, force),
        }
    }

    fn execute(&mut self, answer: &Answer, admitted: &Result<AdmittedMotion, FilterError>) {
        match self {
            Self::Script(robot) => robot.execute(answer, admitted),
            Self::Pushed(robot) => robot.execute(answer, admitted),
        }
    }

    fn push(&self) -> Option<Push> {
        match self {
            Self::Script(robot) => robot.push(),
            Self::Pushed(robot) => robot.push(),
        }
    }
}
