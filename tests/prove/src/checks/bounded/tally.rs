//! How wide a tracker's intervals are over a path within a budget, and whether whole queries agree with them.

use anyhow::{Result, ensure};
use dibs_nostd::constraint::ConstraintState;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Options, Proximity, Query, Sphere, SurfaceBlend, Tool, Tracker};
use glam::Vec3;
use probe::track::{OPENED, STACK};
use rayon::prelude::*;

use super::force::{Steps, wall};
use super::rows::{DEAREST, Row};
use super::scene::{Scene, Truth};
use super::{MARGIN, Settling};
use crate::harness::figures::Figures;

/// Results of the ticks with one budget.
#[derive(Default)]
pub struct Tally {
    wrong: usize,
    damped: usize,
    turned: usize,
    /// Ticks that left a part of the budget, and an interval wider than a depth's tolerance.
    idle: usize,
    /// Widths of the intervals near the wall, in order.
    widths: Vec<f32>,
    /// Those of an axis that crosses the surface or is inside.
    inner: Vec<f32>,
    /// Steps of the force near the wall.
    steps: Steps,
    /// Work of each tick, in node tests, and of those near the wall.
    work: Vec<u32>,
    near_work: Vec<u32>,
}

impl Tally {
    /// The width that this part of the intervals near the wall does not exceed.
    pub fn width(&self, part: f64) -> f64 {
        hundredths(quantile(&self.widths, part))
    }

    /// Notes steps and turned pairs of ticks without a budget.
    pub fn note_uncut(&self, name: &str, figures: &mut Figures) {
        self.steps.note_force(&format!("{name}.uncut"), figures);
        figures.note(&format!("{name}.uncut.turned"), self.share_of_turned());
    }

    /// The work, in node tests, that 95 % of the ticks near the wall do not exceed.
    pub fn usual_tests(&self) -> f64 {
        quantile(&self.near_work, 0.95).into()
    }

    /// In per cent.
    fn share_of_turned(&self) -> f64 {
        let turned = self.turned as f64 / self.widths.len().max(1) as f64 * 100.0;
        (turned * 100.0).round() / 100.0
    }

    /// Notes the widths, how often the pair was off the deepest, and steps of the force, under names that start with
    /// `name`.
    pub fn note(&self, name: &str, figures: &mut Figures) {
        for (end, part) in [("95", 0.95), ("99", 0.99), ("largest", 1.0)] {
            figures.note(&format!("{name}.{end}"), self.width(part));
        }
        figures.note(&format!("{name}.inner"), hundredths(quantile(&self.inner, 0.95)));
        figures.note(&format!("{name}.turned"), self.share_of_turned());
        self.steps.note_size(name, figures);
        self.steps.note_force(name, figures);
    }
}

/// The value that this part of sorted ones does not exceed.
fn quantile<T: Copy + Default>(sorted: &[T], part: f64) -> T {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((last * part) as usize).copied().unwrap_or_default()
}

/// To a hundredth of a millimetre.
fn hundredths(width: f32) -> f64 {
    (f64::from(width) * 100.0).round() / 100.0
}

/// Sums over rows, each with both of its budgets.
#[derive(Default)]
pub struct Sums {
    wrong: usize,
    damped: usize,
    idle: usize,
    near: usize,
}

impl Sums {
    /// Runs the rows of a scene, each within its measured budget and within the one that a user gets, adds them up, and
    /// notes the figures of each.
    pub fn add(
        &mut self,
        rows: &[Row],
        scene: &Scene,
        truth: &[Truth],
        figures: &mut Figures,
    ) -> Result<()> {
        let tallies = rows
            .par_iter()
            .map(|row| Ok([row.budget()?, row.of_user()].map(|budget| run(scene, truth, budget))));
        let tallies: Vec<[Tally; 2]> = tallies.collect::<Result<_>>()?;
        let near = tallies.first().map_or(0, |[tally, _]| tally.widths.len());
        let is_same = tallies.as_flattened().iter().all(|tally| tally.widths.len() == near);
        ensure!(near > 0 && is_same, "a budget changes which ticks near the wall have settled");
        for (row, [tally, user]) in rows.iter().zip(&tallies) {
            for tally in [tally, user] {
                self.wrong += tally.wrong;
                self.damped += tally.damped;
                self.idle += tally.idle;
                self.near += tally.widths.len();
            }
            tally.note(row.name, figures);
            figures.note(&format!("{}.bought", row.name), row.of_user().tests().into());
            figures.note(&format!("{}.user", row.name), user.width(0.95));
            row.note_board(scene, &tally.work, figures)?;
        }
        Ok(())
    }

    /// Notes the sums under names that start with `name`.
    pub fn note(&self, name: &str, figures: &mut Figures) {
        for (end, sum) in [
            ("wrong", self.wrong),
            ("damped", self.damped),
            ("idle", self.idle),
            ("near", self.near),
        ] {
            figures.note(&format!("{name}.{end}"), sum as f64);
        }
    }
}

/// A budget that ends no tick. Unlike an unlimited one it counts all work.
pub const AMPLE: Budget = Budget::new(1_000_000);

/// Runs a tracker over the path within a budget.
pub fn run(scene: &Scene, truth: &[Truth], budget: Budget) -> Tally {
    let tree = scene.tree();
    // As on the board.
    let mut tracker =
        Tracker::<_, STACK, OPENED, OPENED>::with_range(&tree).expect("enough for the tree");
    let mut point = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    let wall = wall();
    let (mut tally, mut settling) = (Tally::default(), Settling::default());
    scene.each(&tree, |tick, surface, tool, options| {
        let options = options.budget(budget);
        let tracked = tracker.closest(surface, tool, &options).expect("an answer");
        let is_settled = settling.is_settled(tracked.moved);
        let (found, truth) = (tracked.closest, &truth[tick]);
        tally.work.push(found.work());
        tally.wrong += usize::from(truth.is_missed_by(&found));
        if truth.lower >= MARGIN || !is_settled {
            return;
        }
        let width = found.separation - found.lower;
        tally.widths.push(width);
        tally.near_work.push(found.work());
        if truth.upper < -tool.radius() {
            tally.inner.push(width);
        }
        let tolerance = Options::default_depth_tolerance(tool.axis_length(), found.accuracy);
        let is_idle =
            width > tolerance + 2.0 * found.accuracy && found.work() + DEAREST <= budget.tests();
        tally.idle += usize::from(is_idle);
        let force = wall.force(&Ok(found), Vec3::ZERO);
        tally.steps.add(tick, force.force, truth.force);
        let is_damped = matches!(force.state, ConstraintState::Safe(_));
        tally.damped += usize::from(is_damped);
        let is_turned = found.direction.dot(truth.direction) < std::f32::consts::FRAC_1_SQRT_2;
        tally.turned +=
            usize::from(is_turned && !is_deepest(&mut point, surface, tool, &found, truth));
    });
    tally.widths.sort_by(f32::total_cmp);
    tally.inner.sort_by(f32::total_cmp);
    tally.near_work.sort_unstable();
    tally
}

/// Whether an answer's pair is the deepest or the closest one, within half a millimetre.
fn is_deepest(
    point: &mut Query<'_, u16, MAX_STACK>,
    surface: &SurfaceBlend<'_, [Vec3], [Vec3]>,
    tool: &Capsule,
    found: &Proximity,
    truth: &Truth,
) -> bool {
    let at = tool.axis_point(found.axis_parameter);
    let sphere = Sphere::new(at, 0.0).expect("finite");
    let own = point.closest(surface, &sphere, &Options::new()).expect("an answer");
    own.separation <= truth.upper + tool.radius() + 0.5
        && found.point_on_surface.distance(at) <= own.separation.abs() + 0.5
}
