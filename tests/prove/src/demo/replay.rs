//! The demo's surface, motion and instrument in the viewer: `replay.html`.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result};
use controller::telemetry::Tick;
use dibs_build::glam::DVec3;
use dibs_build::write_atomically;
use serde_json::json;
use xtask::process::quiet;
use xtask::workspace;

use super::hand::Hand;
use super::scene::Scene;

/// Writes the page, with the instrument of every tick, the response of the filter or the wall, and its input files.
/// Without `dibs` or its page, it prints how to make them.
pub fn write(scene: &Scene, ticks: &[Tick], hand: Option<&Hand>, folder: &Path) -> Result<()> {
    let dibs = workspace::target().join("release/dibs");
    let page = workspace::target().join("viewer/dibs-viewer.html");
    if !dibs.exists() || !page.exists() {
        println!(
            "no replay: `cargo build --release --bin dibs` and `cargo xtask viewer` make what writes it"
        );
        return Ok(());
    }
    if scene.motion.origin != DVec3::ZERO {
        println!("no replay: the surface lies too far from the origin for its files");
        return Ok(());
    }
    let mut tools = String::new();
    for Tick { tool_start: [a, b, c], tool_end: [x, y, z], tool_radius, .. } in ticks {
        writeln!(tools, "capsule:{a},{b},{c},{x},{y},{z},{tool_radius}")?;
    }
    write_atomically(folder.join("tools.csv"), |out| out.write_all(tools.as_bytes()))?;
    write_atomically(folder.join("heart.dibs"), |out| out.write_all(scene.tree.blob()))?;
    scene.motion.write_pc2(folder.join("heart.pc2"))?;
    let rate = scene.rate.to_string();
    let mut view = Command::new(&dibs);
    view.args(["view", "heart.dibs", "--motion", "heart.pc2", "--path", "tools.csv"]);
    view.args(["-o", "replay.html", "--motion-rate", &rate, "--page"]).arg(&page);
    if let Some(hand) = hand {
        let record = record(ticks, hand)?;
        write_atomically(folder.join("ticks.jsonl"), |out| out.write_all(record.as_bytes()))?;
        view.args(["--ticks", "ticks.jsonl"]);
    }
    view.current_dir(folder);
    let said = quiet(&mut view, Duration::from_mins(1)).context("the replay was not written")?;
    print!("{said}");
    Ok(())
}

/// A line for each tick: for a push by commands the filter's reason and the certified separation, for a push by force
/// the wall's remaining energy.
fn record(ticks: &[Tick], hand: &Hand) -> Result<String> {
    let mut moments = hand.moments.iter().peekable();
    let mut record = String::new();
    for (number, tick) in ticks.iter().enumerate() {
        let moment = moments.next_if(|moment| moment.tick.tick == tick.tick);
        let line = match moment.map(|moment| (moment.reason(), moment.push)) {
            None => json!({ "tick": number }),
            Some((None, push)) => json!({ "tick": number, "energy": push.balance }),
            Some((reason, push)) => json!({
                "tick": number, "reason": reason, "least_separation": push.least_separation,
            }),
        };
        writeln!(record, "{line}")?;
    }
    Ok(record)
}
