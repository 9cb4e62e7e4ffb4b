//! Checks an answer by exhaustive search in f64 on the vertices of the same surface.

use anyhow::{Context, Result};
use controller::fingerprint;
use controller::telemetry::Tick;
use dibs_nostd::{Index, TriangleRow};
use dibs_tests::oracle::{Instrument, closest_pair, exhaustive};
use dibs_tests::sides;
use glam::Vec3;

use super::scene::Scene;
use super::sender::Link;
use super::surface::rows;

/// The result of checking one answer.
#[derive(Clone, Copy, Debug)]
pub struct Checked {
    pub tick: u32,
    /// Error of the answer in units of its [`accuracy_of`] plus the embedded vertices' rounding: at most 1 is correct.
    pub error: f64,
    /// The true separation from the answer's surface, in mm; if the answer is an interval, its lower bound.
    pub separation: f64,
}

impl Checked {
    /// Whether the error exceeds the stated accuracy, or is NaN.
    pub fn is_wrong(&self) -> bool {
        self.error > 1.0 || self.error.is_nan()
    }
}

/// The accuracy of an answer on the decoded vertices that both sides use: that stated, without the bus's quantisation.
pub fn accuracy_of(tick: &Tick) -> f64 {
    without(tick.accuracy, tick.position_error)
}

/// Upper bound of what was added to a position error, because the sum was rounded to f32. On a surface as small as a
/// step of the bus, the difference alone is zero.
pub fn without(accuracy: f32, position_error: f32) -> f64 {
    let rounding = f64::from(accuracy) * f64::from(f32::EPSILON) / 2.0;
    f64::from(accuracy) - f64::from(position_error) + rounding
}

/// Checks one answer: its separation, its interval, and its point. The error is the largest of the
/// three.
pub fn check(scene: &Scene, link: &Link, tick: &Tick) -> Result<Checked> {
    let rows = rows(link, tick)?;
    let positions = scene.vertices(&rows);
    let tool = Instrument::capsule(
        Vec3::from(tick.tool_start),
        Vec3::from(tick.tool_end),
        tick.tool_radius,
    );
    let truth = exhaustive(&positions, &scene.triangles, &tool).context("no triangles")?;

    let accuracy = accuracy_of(tick) + scene.rounding(&rows)?;
    let (low, high) =
        sides::signed_separation(&positions, &scene.triangles, &tool, &truth, accuracy);
    let separation = (low - f64::from(tick.separation)).max(0.0);
    let interval = (f64::from(tick.lower) - high).max(0.0);
    let point = Vec3::from(tick.point_on_surface).as_dvec3();
    let off_surface = match corners(scene, tick.triangle) {
        Some(rows) => {
            let corners = rows.map(|row| positions[row as usize].as_dvec3());
            closest_pair(point, point, corners).distance
        }
        // A search that was cut short may have been nearer to a vertex than to any triangle that it tested.
        None if tick.triangle == u32::MAX => {
            let apart = positions.iter().map(|vertex| vertex.as_dvec3().distance(point));
            apart.fold(f64::INFINITY, f64::min)
        }
        None => f64::INFINITY,
    };
    let largest = separation.max(interval).max(off_surface);
    Ok(Checked { tick: tick.tick, error: largest / accuracy, separation: low })
}

/// A published frame, compared as a whole with the frame sent.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    pub epoch: u32,
    /// Whether every vertex equals the sent one, to the bit.
    pub is_same: bool,
}

/// Compares each frame that the controller has read completely, once.
pub fn compare(link: &Link, tick: &Tick, compared: &mut Vec<Compared>) {
    let epoch = tick.read_epoch;
    if epoch == 0 || compared.last().is_some_and(|last| last.epoch == epoch) {
        return;
    }
    let is_same = link.frame(epoch).is_some_and(|sent| fingerprint(&sent) == tick.read_digest);
    compared.push(Compared { epoch, is_same });
}

fn corners(scene: &Scene, triangle: u32) -> Option<[u32; 3]> {
    fn of<I: Index>(scene: &Scene, triangle: u32) -> Option<[u32; 3]> {
        scene.tree.tree::<I>().ok()?.corners(TriangleRow(triangle))
    }
    match scene.tree.index_bits() {
        16 => of::<u16>(scene, triangle),
        _ => of::<u32>(scene, triangle),
    }
}
