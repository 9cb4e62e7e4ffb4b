//! Peers on a surface that nodes move: they know vertices, so they move all of them themselves, as they are laid out.

use std::ops::{Add, Mul, Sub};

use dibs_tests::baselines::{Blend, Lazy, Swept};
use dibs_tests::method::Layout;
use glam::{Vec3, Vec3A};

use super::super::imaging::controller::{Controller, Tick, Times};
use super::super::imaging::ours::Surface;

/// A tree of boxes whose vertices are moved, and which is refitted, once a frame or at every tick.
pub struct Moved<M: Layout> {
    method: M,
    surface: Surface,
    /// What each position is bound to, in the method's order.
    blends: Vec<Blend>,
    frames: Frames<M::Position>,
    now: Vec<M::Position>,
}

impl<M: Layout> Moved<M>
where
    M::Position: Weighed,
{
    /// With what each vertex of the mesh is bound to, and positions of the vertices.
    pub fn new(mut method: M, surface: Surface, blends: &[Blend], rest: &[Vec3]) -> Self {
        method.load(rest);
        let rows = method.positions_mut().len();
        let blends = (0..rows).map(|row| blends[method.vertex(row) as usize]).collect();
        Self { method, surface, blends, frames: Frames::new(), now: Vec::new() }
    }

    fn update(&mut self, share: f32) {
        self.now.clear();
        self.now.extend(self.frames.between(share));
        for (position, blend) in self.method.positions_mut().iter_mut().zip(&self.blends) {
            *position = at(blend, &self.now);
        }
        self.method.update();
    }
}

/// A position as a method stores it.
pub trait Weighed:
    Copy + From<Vec3> + Add<Output = Self> + Sub<Output = Self> + Mul<f32, Output = Self>
{
}

impl Weighed for Vec3 {}
impl Weighed for Vec3A {}

#[inline(always)]
fn at<P: Weighed>(blend: &Blend, nodes: &[P]) -> P {
    let [a, b, c, d] = blend.nodes.map(|node| nodes[node as usize]);
    let [u, v, w, _] = blend.weights;
    d + (a - d) * u + (b - d) * v + (c - d) * w
}

/// The last two frames of nodes.
struct Frames<P> {
    before: Vec<P>,
    after: Vec<P>,
    arrived: Vec<Vec3>,
}

impl<P: Weighed> Frames<P> {
    fn new() -> Self {
        Self { before: Vec::new(), after: Vec::new(), arrived: Vec::new() }
    }

    fn receive(&mut self, frame: &[Vec3]) {
        if !self.arrived.is_empty() {
            self.take();
        }
        self.arrived.extend_from_slice(frame);
    }

    fn take(&mut self) {
        std::mem::swap(&mut self.before, &mut self.after);
        self.after.clear();
        self.after.extend(self.arrived.drain(..).map(P::from));
    }

    /// Every node some way from one frame to the other.
    fn between(&self, share: f32) -> impl Iterator<Item = P> {
        let ends = self.before.iter().zip(&self.after);
        ends.map(move |(&before, &after)| before + (after - before) * share)
    }
}

impl<M: Layout> Controller for Moved<M>
where
    M::Position: Weighed,
{
    fn receive(&mut self, frame: &[Vec3]) {
        self.frames.receive(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| {
            self.frames.take();
            if self.surface == Surface::Held {
                self.update(1.0);
            }
        });
        for tick in ticks {
            if self.surface == Surface::Continuous {
                times.update(|| self.update(tick.share));
            }
            times.query(|| self.method.find(&tick.tool));
        }
    }
}

/// Boxes over both frames: the vertices are moved, and the boxes refitted, once a frame.
pub struct MovedSwept {
    swept: Swept,
    blends: Vec<Blend>,
    nodes: Vec<Vec3A>,
    arrived: Vec<Vec3>,
}

impl MovedSwept {
    pub fn new(mut swept: Swept, blends: &[Blend]) -> Self {
        let rows = swept.arriving().len();
        let blends = (0..rows).map(|row| blends[swept.vertex(row) as usize]).collect();
        Self { swept, blends, nodes: Vec::new(), arrived: Vec::new() }
    }
}

impl Controller for MovedSwept {
    fn receive(&mut self, frame: &[Vec3]) {
        // The boxes hold the way from the frame before, timed or not.
        self.move_all();
        frame.clone_into(&mut self.arrived);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| {
            self.move_all();
            self.swept.update();
        });
        for tick in ticks {
            times.query(|| self.swept.find(&tick.tool, tick.share));
        }
    }
}

impl MovedSwept {
    fn move_all(&mut self) {
        let Self { swept, blends, nodes, arrived } = self;
        if arrived.is_empty() {
            return;
        }
        nodes.clear();
        nodes.extend(arrived.drain(..).map(Vec3A::from));
        for (position, blend) in swept.arriving().iter_mut().zip(blends) {
            *position = blend.of(nodes);
        }
    }
}

/// Boxes over the elements: no vertex is moved before a query reads it.
pub struct Unmoved {
    lazy: Lazy,
    surface: Surface,
    frames: Frames<Vec3A>,
}

impl Unmoved {
    pub fn new(lazy: Lazy, surface: Surface) -> Self {
        Self { lazy, surface, frames: Frames::new() }
    }

    fn update(&mut self, share: f32) {
        for (node, now) in self.lazy.nodes_mut().iter_mut().zip(self.frames.between(share)) {
            *node = now;
        }
        self.lazy.update();
    }
}

impl Controller for Unmoved {
    fn receive(&mut self, frame: &[Vec3]) {
        self.frames.receive(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| {
            self.frames.take();
            if self.surface == Surface::Held {
                self.update(1.0);
            }
        });
        for tick in ticks {
            if self.surface == Surface::Continuous {
                times.update(|| self.update(tick.share));
            }
            times.query(|| self.lazy.find(&tick.tool));
        }
    }
}
