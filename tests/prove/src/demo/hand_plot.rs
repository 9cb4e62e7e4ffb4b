//! The picture of a hand that pushes.

use std::path::Path;

use anyhow::Result;
use glam::Vec3;
use plotters::prelude::*;

use super::hand::Moment;
use super::plot::{BLUE_INK, Curve, GREEN_INK, ORANGE_INK, at, curves, failed};
use super::report::force;
use super::session::Outcome;

/// Draws `hand.svg`: the separation, the forces, the speeds, and the instructions.
pub fn draw(outcome: &Outcome, folder: &Path) -> Result<()> {
    let Some(hand) = &outcome.hand else { return Ok(()) };
    let moments: Vec<&Moment> = hand.moments.iter().collect();
    let (Some(first), Some(last)) = (moments.first(), moments.last()) else { return Ok(()) };
    let time = at(first.tick.tick, 0.0).0..at(last.tick.tick + 1, 0.0).0;
    let (commanded, pushed): (Vec<&Moment>, Vec<&Moment>) =
        moments.iter().partition(|moment| moment.is_commanded());
    let of = |name, ink, moments: &[&Moment], value: fn(&Moment) -> f32| {
        Curve::new(name, ink, moments, |moment| at(moment.tick.tick, value(moment).into()))
    };
    let push = |moment: &Moment| Vec3::from(moment.push.push).length();
    let mut rows = vec![
        (
            "separation (mm)",
            vec![
                of("against the wall's force", BLUE_INK, &pushed, |m| m.tick.separation),
                of("by commands", ORANGE_INK, &commanded, |m| m.tick.separation),
            ],
        ),
        (
            "force (N)",
            vec![
                of("the hand's", GREEN_INK, &moments, push),
                of("the wall's", BLUE_INK, &pushed, |m| force(&m.tick)),
            ],
        ),
        (
            "speed (mm/s)",
            vec![
                of("that the hand wants", GREEN_INK, &moments, |m| m.speeds()[0]),
                of("against the wall's force", BLUE_INK, &pushed, |m| m.speeds()[1]),
                of("admitted", ORANGE_INK, &commanded, |m| m.speeds()[1]),
            ],
        ),
    ];
    // They are only counted in the emulator.
    if moments.iter().any(|moment| moment.instructions() > 0) {
        let curves = vec![
            of("of the closest pair", BLUE_INK, &pushed, |m| m.instructions() as f32),
            of("with the filter", ORANGE_INK, &commanded, |m| m.instructions() as f32),
        ];
        rows.push(("instructions", curves));
    }
    let picture = folder.join("hand.svg");
    let root = SVGBackend::new(&picture, (900, 240 * rows.len() as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let areas = root.split_evenly((rows.len(), 1));
    for (area, (name, rows)) in areas.iter().zip(&rows) {
        curves(area, &time, name, rows)?;
    }
    root.present().map_err(failed)
}
