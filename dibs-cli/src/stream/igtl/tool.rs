//! `--tool TOOL --tool-device NAME`: how far a tracked tool is from the surface that was sent last.
//!
//! Each message of the device is answered by a JSON object on a line, and by a STRING for the peer. Without a surface and a
//! tool that are recent enough the separation is null, with the reason: an old answer never looks like a new one.

use super::super::coordinates::SourceCoordinates;
use super::super::part::Part;
use super::exchange::{Cause, now};
use super::message::{self, Header};
use super::pose::Pose;
use crate::query::{Answer, Record, Room, Surface, ask, side_name};
use crate::tool::ToolSpec;
use crate::tree_file::{self, AnyTree};
use anyhow::Result;
use dibs_build::glam::Vec3;
use dibs_nostd::RigidPose;
use serde::Serialize;
use std::path::Path;
use std::slice;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A frame that was sent.
pub struct SentSurface {
    /// In the mesh's order.
    pub positions: Vec<Vec3>,
    pub pose: Option<RigidPose>,
    pub at: Instant,
    /// Its age then.
    pub ago: Duration,
}

/// A tracked tool.
pub struct TrackedTool {
    pub device: String,
    /// In its own frame.
    tool: ToolSpec,
    /// The greatest age of a surface, and of a pose, that are answered about.
    most: Duration,
    tree: AnyTree<'static>,
    name: String,
    pose: Option<Part<Pose>>,
    /// The frame of the last answer, and its surface, or why that cannot be searched.
    surface: Option<(Arc<SentSurface>, Result<Surface<'static>, String>)>,
}

/// The message of a tool, as far as it could be read.
pub struct Reading<'a> {
    pub header: &'a Header,
    pub came: Instant,
    /// Its age when it came.
    pub delay: Duration,
    pub pose: Result<Pose, String>,
    /// Why the last message with a surface was refused, if it was.
    pub refused: Option<Cause>,
}

#[derive(Serialize)]
struct Line<'a> {
    device: &'a str,
    /// In the message's header: seconds of the peer's clock, 0 without one.
    time: f64,
    tool_age_ms: Option<f64>,
    /// The age of the surface that was sent last.
    age_ms: Option<f64>,
    /// Why the last message with a surface was refused: this is the one before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<&'static str>,
    #[serde(flatten)]
    found: ToolAnswer<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum ToolAnswer<'a> {
    Pair(Box<Record<'a>>),
    None { separation: Option<f64>, reason: String },
}

impl TrackedTool {
    /// A tool for the tree of this file, whose bytes are kept for as long as the program runs.
    pub fn new(
        tool: ToolSpec,
        device: String,
        most: Duration,
        (bytes, path): (Vec<u8>, &Path),
    ) -> Result<Self> {
        let (tree, name) = (tree_file::validate(bytes.leak(), path)?, path.display().to_string());
        Ok(Self { device, tool, most, tree, name, pose: None, surface: None })
    }

    /// Prints the answer to a message. Returns that for the peer.
    pub fn answer(
        &mut self,
        reading: Reading<'_>,
        sent: Option<Arc<SentSurface>>,
        place: &SourceCoordinates,
    ) -> Vec<u8> {
        let Reading { header, came, delay, pose, refused } = reading;
        let age = sent.as_ref().map(|sent| sent.at.elapsed() + sent.ago);
        let (tool, mut tool_age) = (pose, None);
        if let Ok(value) = tool {
            let part = Part { value, time: header.time, came, delay };
            tool_age = Some(Part::replace(&mut self.pose, part).age(Instant::now()));
        }
        let device = self.device.clone();
        let found = tool.and_then(|pose| {
            self.check("the tool's pose", tool_age)?;
            self.check("the surface", age)?;
            let sent = sent.ok_or("no surface was sent yet")?;
            self.closest(&pose, &sent, place)
        });
        let ms = |age: Duration| age.as_secs_f64() * 1e3;
        let text = match &found {
            Ok(found) => {
                let (side, _) = side_name(found.proximity.side);
                let age = age.map_or(0.0, ms);
                format!("{:.2} mm, {side}, surface {age:.0} ms old", found.proximity.separation)
            }
            Err(reason) => reason.clone(),
        };
        let found = match &found {
            Ok(found) => ToolAnswer::Pair(Box::new(found.record(None))),
            Err(reason) => ToolAnswer::None { separation: None, reason: reason.clone() },
        };
        let (tool_age_ms, age_ms) = (tool_age.map(ms), age.map(ms));
        let (time, refused) = (header.time, refused.map(Cause::name));
        let line = Line { device: &device, time, tool_age_ms, age_ms, refused, found };
        match serde_json::to_string(&line) {
            Ok(line) => println!("{line}"),
            Err(error) => eprintln!("warning: an answer cannot be printed ({error})"),
        }
        string(&device, &text)
    }

    fn check(&self, what: &str, age: Option<Duration>) -> Result<(), String> {
        match age.filter(|age| *age > self.most) {
            Some(age) => Err(format!(
                "{what} is {} ms old, and --tool-age allows {} ms",
                age.as_millis(),
                self.most.as_millis()
            )),
            None => Ok(()),
        }
    }

    /// The closest pair, in the coordinates of the mesh's file, or of the world if the surface has a pose.
    fn closest(
        &mut self,
        pose: &Pose,
        sent: &Arc<SentSurface>,
        place: &SourceCoordinates,
    ) -> Result<Answer<'_>, String> {
        if !self.surface.as_ref().is_some_and(|(last, _)| Arc::ptr_eq(last, sent)) {
            let surface = Surface::of_frame(self.tree, &self.name, &sent.positions);
            self.surface = Some((Arc::clone(sent), surface.map_err(|error| error.to_string())));
        }
        let surface = self.surface.as_ref().map(|(_, surface)| surface.as_ref());
        let surface = surface.ok_or("no surface was sent yet")?.map_err(Clone::clone)?;
        let at = sent.pose.unwrap_or(RigidPose::IDENTITY);
        let (turn, shift) = (at.rotation().as_dquat().normalize(), at.shift().as_dvec3());
        let origin = place.origin;
        let tool = self.tool.moved(|point| {
            let point = place.of_tool(&pose.rotation, pose.shift, point);
            match sent.pose {
                Some(_) => turn.inverse() * (point - origin - shift) + origin,
                None => point,
            }
        });
        let found = ask(slice::from_ref(surface), &[tool], None, &mut Room::default());
        let mut found = found.map_err(|error| error.to_string())?;
        if sent.pose.is_some() {
            let pair = &mut found.proximity;
            pair.point_on_surface = at.apply(pair.point_on_surface);
            pair.point_on_tool = at.apply(pair.point_on_tool);
            pair.direction = at.rotate(pair.direction);
        }
        Ok(found)
    }
}

/// A STRING message.
fn string(device: &str, text: &str) -> Vec<u8> {
    /// Encodings by their numbers in IANA's list.
    const ASCII: u16 = 3;
    const UTF_8: u16 = 106;
    let text = &text[..text.floor_char_boundary(usize::from(u16::MAX))];
    let encoding = if text.is_ascii() { ASCII } else { UTF_8 };
    let mut body = encoding.to_be_bytes().to_vec();
    body.extend((text.len() as u16).to_be_bytes());
    body.extend(text.bytes());
    message::pack("STRING", device, now(), &body)
}
