//! Steps of the force from tick to tick that a budget causes: those of a tracker's ticks, less those of whole queries on the
//! same poses.

use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use glam::Vec3;

use super::MARGIN;
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING};

/// The step (N) that the demo's energy account lets through in a tick.
const LARGE: f32 = 0.5;

/// The demo's wall.
pub fn wall() -> ForbiddenRegion {
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    ForbiddenRegion::new(spring, MARGIN).expect("a valid margin")
}

/// The steps of the ticks near the wall.
#[derive(Default)]
pub struct Steps {
    /// The last tick's number, its force, and that of a whole query.
    last: Option<(usize, [Vec3; 2])>,
    count: u32,
    /// The largest step of the force's size, and of the force, beyond those of whole queries (N).
    size: f32,
    force: f32,
    /// Steps of the force larger than those of whole queries by more than [`LARGE`].
    large: u32,
}

impl Steps {
    /// Adds the force (N) of a tick, and that of a whole query.
    pub fn add(&mut self, tick: usize, force: Vec3, whole: Vec3) {
        let last = self.last.replace((tick, [force, whole]));
        let Some((before, [force_before, whole_before])) = last else { return };
        if before + 1 != tick {
            return;
        }
        let size = |now: Vec3, before: Vec3| (now.length() - before.length()).abs();
        let step = force.distance(force_before) - whole.distance(whole_before);
        self.count += 1;
        self.size = self.size.max(size(force, force_before) - size(whole, whole_before));
        self.force = self.force.max(step);
        self.large += u32::from(step > LARGE);
    }

    /// Notes the largest step of the size under a name that starts with `name`.
    pub fn note_size(&self, name: &str, figures: &mut Figures) {
        figures.note(&format!("{name}.size"), hundredths(self.size.into()));
    }

    /// Notes the largest step of the force, and the share of large ones in per cent.
    pub fn note_force(&self, name: &str, figures: &mut Figures) {
        figures.note(&format!("{name}.step"), hundredths(self.force.into()));
        let share = f64::from(self.large) / f64::from(self.count.max(1)) * 100.0;
        figures.note(&format!("{name}.steps"), hundredths(share));
    }
}

fn hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

/// The steps within a row's budget.
pub const fn steps(id: &'static str, unit: &'static str) -> Promise {
    Promise {
        id,
        says: "The largest change of the force's size from one of these ticks to the next that the budget causes",
        criterion: TIMING,
        bound: Bound::Informs,
        unit,
        limits: "Beyond the change of whole queries on the same poses. The demo's wall, 1 N/mm within 5 mm and at most 5 N, without \
                 damping. Where two deepest points tie, the force turns at other ticks than that of whole queries, by up to \
                 twice its largest size; so it does without a budget.",
    }
}
