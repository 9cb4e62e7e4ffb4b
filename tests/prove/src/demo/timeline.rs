//! The picture of a run with faults: the surface's age and the controller's state.

use std::path::Path;

use anyhow::{Result, anyhow};
use controller::TICK_RATE;
use controller::telemetry::Tick;
use dibs_nostd::failsafe::State;
use plotters::prelude::*;

use super::session::Outcome;

const INK: RGBColor = RGBColor(31, 90, 160);
const DEGRADED: RGBColor = RGBColor(252, 226, 160);
const SAFE: RGBColor = RGBColor(240, 170, 160);
const NOMINAL: RGBColor = RGBColor(214, 236, 208);

/// Draws `states.svg`: the surface's age over the states, and below it the number of rejections so far.
pub fn draw(outcome: &Outcome, folder: &Path) -> Result<()> {
    let picture = folder.join("states.svg");
    let root = SVGBackend::new(&picture, (900, 560)).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let (upper, lower) = root.split_vertically(280);
    let oldest = outcome.ticks.iter().map(|tick| tick.age).max().unwrap_or(0);
    let age = |tick: &Tick| f64::from(tick.age) / f64::from(TICK_RATE);
    let top = f64::from(oldest.max(outcome.bus.trust().age.1)) / f64::from(TICK_RATE);
    curve(&upper, &outcome.ticks, "age of the surface (s)", top, age)?;
    let rejected = outcome.ticks.last().map_or(1, |tick| tick.rejected.max(1));
    let name = "packets and frames rejected";
    curve(&lower, &outcome.ticks, name, rejected.into(), |tick| tick.rejected.into())?;
    root.present().map_err(failed)?;
    Ok(())
}

fn curve(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    ticks: &[Tick],
    name: &str,
    top: f64,
    value: impl Fn(&Tick) -> f64,
) -> Result<()> {
    let time = |tick: u32| f64::from(tick) / f64::from(TICK_RATE);
    let (Some(first), Some(last)) = (ticks.first(), ticks.last()) else { return Ok(()) };
    let top = top * 1.05;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(70)
        .build_cartesian_2d(time(first.tick)..time(last.tick), 0.0..top)
        .map_err(failed)?;
    for (state, ink, label) in [
        (State::Nominal, NOMINAL, "nominal"),
        (State::Degraded, DEGRADED, "degraded"),
        (State::Safe, SAFE, "safe"),
    ] {
        let runs = ticks.chunk_by(|a, b| a.state == b.state);
        let bands = runs.filter(|run| run[0].state == state as u32).map(|run| {
            let end = run.last().map_or(run[0].tick, |last| last.tick + 1);
            Rectangle::new([(time(run[0].tick), 0.0), (time(end), top)], ink.filled())
        });
        chart
            .draw_series(bands)
            .map_err(failed)?
            .label(label)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], ink.filled()));
    }
    chart.configure_mesh().disable_mesh().x_desc("time (s)").y_desc(name).draw().map_err(failed)?;
    let points = ticks.iter().step_by(10).map(|tick| (time(tick.tick), value(tick)));
    chart.draw_series(LineSeries::new(points, INK)).map_err(failed)?;
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .draw()
        .map_err(failed)?;
    Ok(())
}

fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}
