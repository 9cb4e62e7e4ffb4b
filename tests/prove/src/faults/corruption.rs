//! Age of the surface and throughput of frames on a line that damages packets.

use std::fmt;
use std::mem::take;

use anyhow::{Result, anyhow};
use dibs_nostd::Frames;
use dibs_nostd::guard::{Poses, SharedState};
use dibs_nostd::wire::NoMac;
use dibs_stream::faults::{Fault, Injector};
use fastrand::Rng;
use plotters::prelude::*;
use serde::Serialize;

use super::subject::{Case, Controller, Log, N, Receiver, TREE, framed, source};

/// Frames a second.
const RATE: u32 = 50;
/// Seconds of a run.
const SECONDS: u32 = 200;
/// Probabilities of damage to a packet.
const PROBABILITIES: [f64; 8] = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3];

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// `whole`; or `partial`: only moved vertices, and a whole frame when the receiver requests one.
    pub frames: &'static str,
    /// Fraction of the packets that are damaged.
    pub packets_damaged: f64,
    pub frames_sent: u32,
    pub frames_published: u32,
    /// Published frames a second.
    pub throughput: f64,
    /// Age of the published surface, at the times when a frame has been sent, in ms.
    pub age_mean_ms: f64,
    pub age_p99_ms: f64,
    pub age_max_ms: f64,
    pub bytes_per_frame: f64,
    pub published_wrong: u64,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<8} {:>5.1} % of packets damaged: {:>5.1} of {RATE} frames a second published, age \
             {:.0} ms in the mean, 99 % below {:.0}, {:.0} at most; {:.0} bytes a frame",
            self.frames,
            self.packets_damaged * 100.0,
            self.throughput,
            self.age_mean_ms,
            self.age_p99_ms,
            self.age_max_ms,
            self.bytes_per_frame
        )
    }
}

/// Every probability, for whole and for partial frames.
pub fn run(seed: u64) -> Result<Vec<Row>> {
    let all = [false, true].into_iter().flat_map(|partial| PROBABILITIES.map(|p| (partial, p)));
    all.map(|(partial, probability)| one(partial, probability, RATE * SECONDS, seed)).collect()
}

/// Two short runs.
pub fn smoke(seed: u64) -> Result<Vec<Row>> {
    [false, true].into_iter().map(|partial| one(partial, 0.03, 500, seed)).collect()
}

fn one(partial: bool, probability: f64, frames: u32, seed: u64) -> Result<Row> {
    let (buffers, poses) = (Frames::<N, 3>::new(), Poses::NEW);
    let tree = TREE.tree::<u16>()?;
    let mut controller = Controller::new(&buffers, &poses, &tree, NoMac);
    let case = Case { quantised: true, partial, posed: false };
    let mut source = source(case, 1, |_| NoMac);
    source.challenge(0);
    let (mut injector, mut rng, mut log) =
        (Injector::new(seed), Rng::with_seed(seed), Log::default());
    let interval = 1_000.0 / f64::from(RATE);
    let (mut ages, mut bytes, mut newest) = (Vec::new(), 0, None);
    for moment in 0..frames {
        // The status is as old as a frame.
        source.transport().inbox.push_back(controller.status());
        source.poll()?;
        let frame = case.prepare(&mut source, moment);
        log.note(&source, case, moment);
        bytes += frame.sent().bytes;
        source.transmit(frame)?;
        let published = controller.published();
        for packet in take(&mut source.transport().sent) {
            let mut line = framed(&packet);
            if rng.f64() < probability {
                injector.damage(Fault::Burst, &mut line);
            }
            controller.bytes(&line, &log);
        }
        if controller.published() > published {
            newest = Some(moment);
        }
        // Before the first frame there is no surface and no age.
        ages.extend(newest.map(|newest| f64::from(moment - newest) * interval));
    }
    ages.sort_by(f64::total_cmp);
    let count = ages.len().max(1);
    Ok(Row {
        frames: if partial { "partial" } else { "whole" },
        packets_damaged: probability,
        frames_sent: frames,
        frames_published: controller.published(),
        throughput: f64::from(controller.published()) / f64::from(frames) * f64::from(RATE),
        age_mean_ms: ages.iter().sum::<f64>() / count as f64,
        age_p99_ms: ages.get(count * 99 / 100).copied().unwrap_or(f64::NAN),
        age_max_ms: ages.last().copied().unwrap_or(f64::NAN),
        bytes_per_frame: bytes as f64 / f64::from(frames),
        published_wrong: controller.wrong(),
    })
}

/// Throughput and age by the fraction of damaged packets.
pub fn figure(rows: &[Row]) -> Result<String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (900, 360)).into_drawing_area();
        root.fill(&WHITE).map_err(|e| anyhow!("{e}"))?;
        let (left, right) = root.split_horizontally(450);
        let oldest = rows.iter().map(|row| row.age_p99_ms).fold(1.0, f64::max);
        draw(&left, rows, "frames published a second", f64::from(RATE), |row| row.throughput)?;
        draw(&right, rows, "age, 99 % below (ms)", oldest, |row| row.age_p99_ms)?;
        root.present().map_err(|e| anyhow!("{e}"))?;
    }
    Ok(svg)
}

fn draw(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    rows: &[Row],
    name: &str,
    top: f64,
    value: impl Fn(&Row) -> f64,
) -> Result<()> {
    let failed = |error: DrawingAreaErrorKind<_>| anyhow!("{error}");
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(0.0..30.0, 0.0..top * 1.05)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("packets damaged (%)")
        .y_desc(name)
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;
    for (frames, ink) in [("whole", RGBColor(0, 114, 178)), ("partial", RGBColor(213, 94, 0))] {
        let of_kind = rows.iter().filter(|row| row.frames == frames);
        let points: Vec<_> = of_kind.map(|row| (row.packets_damaged * 100.0, value(row))).collect();
        chart
            .draw_series(LineSeries::new(points, ink.stroke_width(2)))
            .map_err(failed)?
            .label(frames)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], ink));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .border_style(TRANSPARENT)
        .background_style(WHITE)
        .draw()
        .map_err(failed)?;
    Ok(())
}
