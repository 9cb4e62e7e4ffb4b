//! All contacts of every tick, and the force of a proxy that they keep outside: computed on the host after the run,
//! beside the controller's own list, which a budget may cut, and its wall, which acts on the closest pair.

use anyhow::Result;
use controller::telemetry::Tick;
use controller::{DAMPING, MARGIN, MAX_FORCE, SPRING, STIFFNESS, TICK_RATE};
use dibs_nostd::constraint::Proxy;
use dibs_nostd::failsafe::State;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Contact, Contacts, Index, Options, Query, Tree, Unavailable};
use dibs_tests::surfaces::Inexact;
use glam::Vec3;
use serde::Serialize;

use super::report::force;
use super::scene::Scene;
use super::sender::Link;
use super::steps::tool;
use super::surface::rows;

/// Most contacts that are kept.
const MOST: usize = 16;

/// The contacts of a tick and the proxy's force.
#[derive(Clone, Copy)]
pub struct Touch {
    pub tick: u32,
    pub contacts: usize,
    /// Size of the proxy's force, in N.
    pub force: f32,
}

/// The contacts of a run.
#[derive(Clone, Default, Serialize)]
pub struct Touches {
    #[serde(skip)]
    pub all: Vec<Touch>,
    contacts_mean: f64,
    contacts_max: usize,
    /// Ticks with more contacts than the buffer holds.
    contacts_cut: usize,
    /// Contacts in the controller's list, and ticks whose list was complete within the margin.
    controller_contacts_mean: f64,
    controller_contacts_complete: usize,
    /// Ticks in which the controller's list has fewer contacts than there are below the list's bound.
    pub ticks_contacts_missing: usize,
    proxy_force_max_n: f32,
    /// Largest change in a force's magnitude between two ticks on the same frame: the controller's, and the proxy's.
    force_step_max_n: f32,
    proxy_force_step_max_n: f32,
    /// Ticks with the instrument in the surface, and the number of these in which a force was below that of the wall's
    /// spring at first contact, apart from the damper's part: the controller's, and the proxy's.
    pub ticks_inside: usize,
    pub ticks_too_weak: usize,
    pub ticks_proxy_too_weak: usize,
    /// Ticks at which the proxy's force pointed into the surface at the deepest contact.
    pub ticks_proxy_inward: usize,
}

impl Touches {
    /// The contacts of a run.
    pub fn of(scene: &Scene, link: &Link, ticks: &[Tick]) -> Result<Self> {
        match scene.tree.index_bits() {
            16 => Self::on(&scene.tree.tree::<u16>()?, scene, link, ticks),
            _ => Self::on(&scene.tree.tree::<u32>()?, scene, link, ticks),
        }
    }

    fn on<I: Index>(
        tree: &Tree<'_, I>,
        scene: &Scene,
        link: &Link,
        ticks: &[Tick],
    ) -> Result<Self> {
        let proxy = Proxy::new(SPRING, MARGIN)?;
        let mut query = Query::<I, MAX_STACK>::new(tree)?;
        let mut list = Contacts::<MOST>::new();
        let mut touches = Self::default();
        for pair in ticks.windows(2) {
            let [before, tick] = pair else { continue };
            let is_acting = |tick: &Tick| tick.is_answered() && tick.state != State::Safe as u32;
            if !is_acting(before) || !is_acting(tick) {
                continue;
            }
            let rows = rows(link, tick)?;
            let rows = scene.vertices(&rows);
            let (was, now) = (tool(before)?, tool(tick)?);
            // As the controller searched it: another margin parts other ridges.
            let searched = Inexact(&rows, tick.position_error);
            let margin = MARGIN + (tick.position_error + tick.margin);
            query.contacts(&searched, &now, margin, &Options::new(), &mut list)?;
            let velocity = (now.start() - was.start()) * TICK_RATE as f32;
            let axis = (now.end() - now.start(), was.end() - was.start());
            let angular = axis.1.cross(axis.0) / axis.0.length_squared() * TICK_RATE as f32;
            let wrench = proxy.wrench(
                Ok::<_, Unavailable>(list.iter()),
                list.accuracy() + tick.margin,
                now.start(),
                velocity,
                angular,
            );
            touches.add(before, tick, wrench.force, &list);
        }
        let count = touches.all.len().max(1) as f64;
        touches.contacts_mean /= count;
        touches.controller_contacts_mean /= count;
        Ok(touches)
    }

    /// Adds a tick and the proxy's force.
    fn add<const N: usize>(
        &mut self,
        before: &Tick,
        tick: &Tick,
        pushed: Vec3,
        list: &Contacts<N>,
    ) {
        let touch = Touch { tick: tick.tick, contacts: list.len(), force: pushed.length() };
        self.contacts_mean += list.len() as f64;
        self.contacts_max = self.contacts_max.max(list.len());
        self.contacts_cut += usize::from(list.is_full());
        self.controller_contacts_mean += f64::from(tick.contacts);
        self.controller_contacts_complete += usize::from(tick.contacts_bound >= MARGIN);
        // A tool that crosses has a list of other points wherever a budget ended the search for its depth.
        let is_certain = |contact: &&Contact| contact.separation < tick.contacts_bound;
        let certain = list.iter().filter(is_certain).count();
        let is_missing = tick.lower > 0.0 && (tick.contacts as usize) < certain;
        self.ticks_contacts_missing += usize::from(is_missing);
        self.proxy_force_max_n = self.proxy_force_max_n.max(touch.force);
        if let Some(last) = self.all.last()
            && last.tick + 1 == tick.tick
            && before.epoch == tick.epoch
        {
            let step = (touch.force - last.force).abs();
            self.proxy_force_step_max_n = self.proxy_force_step_max_n.max(step);
            let step = (force(tick) - force(before)).abs();
            self.force_step_max_n = self.force_step_max_n.max(step);
        }
        let deepest = list.iter().next();
        let is_inward = deepest.is_some_and(|deepest| deepest.normal.dot(pushed) < 0.0);
        self.ticks_proxy_inward += usize::from(is_inward);
        if tick.separation < 0.0 {
            let ends = [(tick.tool_start, before.tool_start), (tick.tool_end, before.tool_end)];
            let moved = ends.map(|(now, was)| Vec3::from(now).distance(Vec3::from(was)));
            let flow = Vec3::from(tick.surface_velocity).length();
            let speed = moved[0].max(moved[1]) * TICK_RATE as f32 + flow;
            let first = (STIFFNESS * MARGIN).min(MAX_FORCE) - DAMPING * speed - 1e-3;
            self.ticks_inside += 1;
            self.ticks_too_weak += usize::from(force(tick) < first);
            self.ticks_proxy_too_weak += usize::from(touch.force < first);
        }
        self.all.push(touch);
    }

    /// Lines for the user.
    pub fn rows(&self) -> [(&'static str, String); 2] {
        let contacts = format!(
            "{:.1} within the margin in the mean, {} at most, {:.1} in the controller's list, which is complete at {} of {} ticks; a \
             proxy that all hold: {:.2} N at most",
            self.contacts_mean,
            self.contacts_max,
            self.controller_contacts_mean,
            self.controller_contacts_complete,
            self.all.len(),
            self.proxy_force_max_n
        );
        let inside = format!(
            "{} ticks; too weak at {}, the proxy at {}; steps of one frame {:.2} N at most, the proxy's {:.2}",
            self.ticks_inside,
            self.ticks_too_weak,
            self.ticks_proxy_too_weak,
            self.force_step_max_n,
            self.proxy_force_step_max_n
        );
        [("contacts", contacts), ("inside", inside)]
    }
}
