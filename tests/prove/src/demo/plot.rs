//! The pictures of a run.

use std::ops::Range;
use std::path::Path;

use anyhow::{Result, anyhow};
use controller::TICK_RATE;
use controller::telemetry::Tick;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use xtask::qemu;

use super::contacts::{Touch, Touches};
use super::report::force;
use super::session::Outcome;

/// Points of a curve; more would not be visible.
const POINTS: usize = 1_500;

/// Seconds without a value that interrupt a curve.
const GAP: f64 = 0.1;

/// Margin around a chart, and for the labels on its left, in pixels.
const MARGIN: i32 = 12;
const LABELS: i32 = 70;

/// Bars of a histogram.
const BINS: usize = 80;

pub const BLUE_INK: RGBColor = RGBColor(31, 90, 160);
pub const RED_INK: RGBColor = RGBColor(190, 50, 40);
pub const GREEN_INK: RGBColor = RGBColor(0, 120, 90);
pub const ORANGE_INK: RGBColor = RGBColor(230, 140, 0);

/// Draws `separation.svg` (with contacts and forces below it) and, if instructions were counted, `instructions.svg`.
pub fn draw(outcome: &Outcome, folder: &Path) -> Result<()> {
    let answered: Vec<&Tick> = outcome.ticks.iter().filter(|tick| tick.is_answered()).collect();
    let (Some(first), Some(last)) = (answered.first(), answered.last()) else { return Ok(()) };
    // The duration is positive even without a point, because drawing a chart of length zero never ends.
    let time = at(first.tick, 0.0).0..at(last.tick + 1, 0.0).0;
    if let Some((_, touches)) = &outcome.path {
        separation(&answered, touches, &time, folder)?;
    }
    instructions(&answered, &time, folder)
}

fn separation(
    answered: &[&Tick],
    touches: &Touches,
    time: &Range<f64>,
    folder: &Path,
) -> Result<()> {
    let picture = folder.join("separation.svg");
    let root = SVGBackend::new(&picture, (900, 760)).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let (upper, rest) = root.split_vertically(280);
    let (middle, lower) = rest.split_vertically(200);
    // They differ if the budget ended before a depth was known.
    let interval = [
        Curve::new("certainly at most", ORANGE_INK, answered, |tick| {
            at(tick.tick, tick.separation.into())
        }),
        Curve::new("at least, which the force is for", BLUE_INK, answered, |tick| {
            at(tick.tick, tick.lower.into())
        }),
    ];
    curves(&upper, time, "separation (mm)", &interval)?;
    let touches: Vec<&Touch> = touches.all.iter().collect();
    let contacts =
        Curve::new("", GREEN_INK, &touches, |touch| at(touch.tick, touch.contacts as f64));
    curves(&middle, time, "contacts", &[contacts])?;
    let forces = [
        Curve::new("of all contacts, by the proxy", ORANGE_INK, &touches, |touch| {
            at(touch.tick, touch.force.into())
        }),
        Curve::new("the controller's, of the closest pair", BLUE_INK, answered, |tick| {
            at(tick.tick, force(tick).into())
        }),
    ];
    curves(&lower, time, "force (N)", &forces)?;
    root.present().map_err(failed)
}

fn instructions(answered: &[&Tick], time: &Range<f64>, folder: &Path) -> Result<()> {
    let instructions = |tick: &Tick| f64::from(tick.query_counts * qemu::INSTRUCTIONS_A_COUNT);
    if answered.iter().any(|tick| tick.query_counts > 0) {
        let picture = folder.join("instructions.svg");
        let root = SVGBackend::new(&picture, (900, 560)).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let (upper, lower) = root.split_vertically(280);
        let curve = Curve::new("", BLUE_INK, answered, |tick| at(tick.tick, instructions(tick)));
        curves(&upper, time, "instructions a query", &[curve])?;
        let values: Vec<f64> = answered.iter().map(|tick| instructions(tick)).collect();
        histogram(&lower, "instructions a query", &values)?;
        root.present().map_err(failed)?;
    }
    Ok(())
}

/// A value at a tick's time, in s.
pub fn at(tick: u32, value: f64) -> (f64, f64) {
    (f64::from(tick) / f64::from(TICK_RATE), value)
}

/// Values over time, thinned out such that the least and largest values of every interval are kept.
fn extremes<T>(ticks: &[&T], point: impl Fn(&T) -> (f64, f64)) -> Vec<(f64, f64)> {
    let of_chunk = |chunk: &[&T]| {
        let by_value = |a: &(f64, f64), b: &(f64, f64)| a.1.total_cmp(&b.1);
        let points = || chunk.iter().map(|tick| point(tick));
        let (least, most) = (points().min_by(by_value), points().max_by(by_value));
        let mut both: Vec<_> = least.into_iter().chain(most).collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        both
    };
    ticks.chunks((2 * ticks.len()).div_ceil(POINTS).max(1)).flat_map(of_chunk).collect()
}

/// A value over time, in s.
pub struct Curve {
    /// Its name, if there are several.
    name: &'static str,
    ink: RGBColor,
    points: Vec<(f64, f64)>,
}

impl Curve {
    pub fn new<T>(
        name: &'static str,
        ink: RGBColor,
        ticks: &[&T],
        point: impl Fn(&T) -> (f64, f64),
    ) -> Self {
        Self { name, ink, points: extremes(ticks, point) }
    }
}

/// Curves over the same time.
pub fn curves(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    time: &Range<f64>,
    name: &str,
    curves: &[Curve],
) -> Result<()> {
    let values = curves.iter().flat_map(|curve| &curve.points).map(|point| point.1);
    let (low, top) = values.fold((0.0, 0.0), |(low, top): (f64, f64), v| (low.min(v), top.max(v)));
    let room = if top > low { (top - low) * 0.05 } else { 1.0 };
    let low = if low < 0.0 { low - room } else { 0.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .margin_top(if curves.len() > 1 { 2 * MARGIN } else { MARGIN })
        .x_label_area_size(36)
        .y_label_area_size(LABELS)
        .build_cartesian_2d(time.clone(), low..top + room)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("time (s)")
        .y_desc(name)
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;
    if low < 0.0 {
        let zero = [(time.start, 0.0), (time.end, 0.0)];
        chart.draw_series(LineSeries::new(zero, RED_INK)).map_err(failed)?;
    }
    for &Curve { ink, ref points, .. } in curves {
        // A period without a value is a gap.
        let runs = points.chunk_by(|before, after| after.0 - before.0 < GAP);
        let paths = runs.map(|run| PathElement::new(run, ink));
        chart.draw_series(paths).map_err(failed)?;
    }
    if curves.len() > 1 {
        names(area, curves)?;
    }
    Ok(())
}

/// The curves' names, in a row above their chart, so that they hide nothing.
fn names(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    curves: &[Curve],
) -> Result<()> {
    const DASH: i32 = 16;
    let style = TextStyle::from(("sans-serif", 12)).pos(Pos::new(HPos::Left, VPos::Center));
    let (mut x, y) = (MARGIN + LABELS, MARGIN);
    for Curve { name, ink, .. } in curves {
        let dash = PathElement::new([(x, y), (x + DASH, y)], ink.stroke_width(2));
        area.draw(&dash).map_err(failed)?;
        x += DASH + 6;
        area.draw_text(name, &style, (x, y)).map_err(failed)?;
        let (width, _) = area.estimate_text_size(name, &style).map_err(failed)?;
        x += width as i32 + 24;
    }
    Ok(())
}

/// The frequency of each value, with the worst one marked.
fn histogram(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    name: &str,
    values: &[f64],
) -> Result<()> {
    let worst = values.iter().copied().fold(1.0, f64::max);
    let width = worst / BINS as f64;
    let mut bins = [0u32; BINS];
    for value in values {
        bins[((value / width) as usize).min(BINS - 1)] += 1;
    }
    let most = f64::from(bins.iter().copied().max().unwrap_or(1));
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..worst * 1.05, 0.0..most * 1.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc(name)
        .y_desc("queries")
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;
    let bar = |(bin, &count): (usize, &u32)| {
        let left = bin as f64 * width;
        Rectangle::new([(left, 0.0), (left + width, f64::from(count))], BLUE_INK.filled())
    };
    chart.draw_series(bins.iter().enumerate().map(bar)).map_err(failed)?;
    let mark = [(worst, 0.0), (worst, most)];
    chart.draw_series(LineSeries::new(mark, RED_INK.stroke_width(2))).map_err(failed)?;
    let right = Pos::new(HPos::Right, VPos::Bottom);
    let font = ("sans-serif", 13).into_font().color(&RED_INK).pos(right);
    let text = Text::new(format!("worst {worst:.0}"), (worst, most * 1.01), font);
    chart.draw_series([text]).map_err(failed)?;
    Ok(())
}

pub fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}
