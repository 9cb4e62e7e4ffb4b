//! A surface that a coarse model moves: a frame carries nodes, and all work from there to the answers counts.
//!
//! This library checks the elements, and computes the vertices that a query reads. Peers know vertices: they move all of
//! them, in their own order and layout, and refit. Each method receives a frame's nodes in packets, all by this library's
//! receiver; from there they reach it at no cost.

mod moved;
mod ours;
mod received;
mod table;

use std::time::Instant;

use anyhow::{Context, Result};
use dibs_build::{Builder, BuiltTree, Mesh, Motion, Volume};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, Sphere, StretchMonitor, Tree, VertexTable};
use dibs_tests::baselines::{AabbTree, Blend, Hybrid, Lazy, Refit, Swept};
use dibs_tests::method::{Layout, Probe};
use dibs_tests::streams::{Beat, Pulse, SPHERE_RADIUS};
use glam::Vec3;

use super::brain::STRETCH;
use super::facts;
use super::imaging::controller::Controller;
use super::imaging::course::{Course, TICK_RATE};
use super::imaging::ours::{Surface, measured};
use super::imaging::race::Contender;
use super::imaging::record;
use super::measure::microseconds;
use super::names::*;
use super::peers::{Obvhs, ParryBvh};
use super::plan::{Options, Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::{Paired, Summary};
use super::subjects;
use moved::{Moved, MovedSwept, Unmoved, Weighed};
use ours::{Tracking, Whole};
use received::{Line, Received};
pub use table::table;

/// The experiment, and its facts.
pub const EXPERIMENT: &str = "embedded";
pub const RUN: &str = "embedded-run";
/// Where what is true of every condition is recorded.
const FRAME: &str = "a frame";

/// The cells of the lattice around a brain of so many triangles: about 250, 700 and 2,100 nodes.
const fn lattice(triangles: u32) -> [u32; 3] {
    match triangles {
        ..10_000 => [6, 5, 5],
        10_000..100_000 => [9, 8, 7],
        _ => [10, 14, 12],
    }
}

/// What is asked, how many frames come a second, and what the surface does between two.
pub const CONDITIONS: [(&str, u32, Surface); 3] = [
    ("a sphere, one query a frame", TICK_RATE, Surface::Held),
    ("a capsule, 30 Hz, held", 30, Surface::Held),
    ("a capsule, 30 Hz, continuous", 30, Surface::Continuous),
];

/// Methods of this library that take part.
const OURS: [&str; 2] = [NODES_TRACKER, NODES_QUERY];

/// The motion's seed.
const SEED: u64 = 3_100;
/// Frames that are checked both ways.
const CHECKS: u32 = 40;

/// Runs this experiment anew, whatever the records have of it.
pub fn run(plan: &Plan, options: &Options, records: &mut Records) -> Result<()> {
    records.0.retain(|r| ![EXPERIMENT, RUN].contains(&r.experiment.as_str()));
    facts::of(RUN, plan, options, records);
    for &triangles in &plan.imaging_brains {
        let subject = subjects::brain(triangles)?;
        let progress = Progress::start(&format!("{triangles} triangles in a lattice: building"), 0);
        let volume = Volume::lattice(&subject.mesh, lattice(triangles))?;
        let builder = Builder::new().stretch(STRETCH);
        let built = builder.clone().nodes(&volume).build(&subject.mesh)?;
        let plain = builder.build(&subject.mesh)?;
        progress.finish();
        let of = Scene { name: subject.name, mesh: subject.mesh, ticks: plan.imaging_ticks };
        match built.index_bits() {
            16 => of.run(&built.tree::<u16>()?, &plain.tree::<u16>()?, &built, &plain, records)?,
            _ => of.run(&built.tree::<u32>()?, &plain.tree::<u32>()?, &built, &plain, records)?,
        }
    }
    Ok(())
}

/// A method that receives frames of these nodes.
fn received<'a>(
    name: &'static str,
    surface: Surface,
    method: impl Controller + 'a,
    nodes: &Nodes<'_>,
) -> Contender<'a> {
    Contender::new(name, surface, Received::new(method, nodes))
}

/// A surface in a lattice.
struct Scene {
    name: String,
    mesh: Mesh,
    ticks: u32,
}

impl Scene {
    fn run<I: Index>(
        &self,
        tree: &Tree<'_, I>,
        plain: &Tree<'_, I>,
        built: &BuiltTree,
        of_vertices: &BuiltTree,
        records: &mut Records,
    ) -> Result<()> {
        let nodes = Nodes::of(tree)?;
        let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        let pulse = Pulse::new(&rest, SEED);
        let frame = |seconds: f32, positions: &mut Vec<Vec3>| pulse.deform(seconds, positions);
        let blends = self.blends(&nodes, built);
        let vertices = self.vertices(&nodes, &rest, built);
        self.checks(&nodes, plain, of_vertices, built, &frame, records)?;

        let at_rest = Motion { frames: vec![vertices.clone()], ..Motion::default() };
        let beat = Beat::new(&at_rest);
        let capsule = |tick| beat.tool(tick);
        let sphere = |tick| match beat.tool(tick) {
            Probe::Capsule(capsule) => {
                let sphere = Sphere::new(capsule.start(), SPHERE_RADIUS);
                Probe::Sphere(sphere.expect("a valid sphere"))
            }
            other @ Probe::Sphere(_) => other,
        };
        let rested = Mesh { positions: vertices.clone(), ..self.mesh.clone() };
        let boxes = AabbTree::new(&rested);
        for (condition, rate, surface) in CONDITIONS {
            let tool: &dyn Fn(u32) -> Probe = if rate == TICK_RATE { &sphere } else { &capsule };
            let course = Course { frame: &frame, tool };
            let hybrid = |level| {
                let method = Hybrid::new(boxes.clone(), level).warm();
                self.moved(HYBRID, method, surface, &blends, &vertices, &nodes)
            };
            let lazy = |level| {
                let method = Hybrid::new(boxes.clone(), level).warm();
                let method = Lazy::new(method, &blends, &vertices, &rest);
                received(LAZY, surface, Unmoved::new(method, surface), &nodes)
            };
            let size = self.mesh.triangles.len();
            let level = course.split_level(size, rate, hybrid)?;
            let lazy_level = course.split_level(size, rate, lazy)?;
            let of =
                |name, method: Refit| self.moved(name, method, surface, &blends, &vertices, &nodes);
            let mut contenders = vec![
                received(NODES_TRACKER, surface, Tracking::new(tree, nodes, surface), &nodes),
                received(NODES_QUERY, surface, Whole::new(tree, nodes, surface), &nodes),
                of(REFIT, Refit::new(boxes.clone()).warm()),
                hybrid(level),
                self.moved(OBVHS, Obvhs::new(&rested).warm(), surface, &blends, &vertices, &nodes),
            ];
            let parry = ParryBvh::new(&rested).warm();
            let parry = self.moved(PARRY_BVH, parry, surface, &blends, &vertices, &nodes);
            contenders.push(Contender { every: super::imaging::rarely(size), ..parry });
            contenders.push(lazy(lazy_level));
            if surface == Surface::Continuous {
                let swept = MovedSwept::new(Swept::new(boxes.clone()), &blends);
                contenders.push(received(SWEPT, surface, swept, &nodes));
            }
            let title = format!("{} of {size} triangles, {condition}", self.name);
            let periods = self.ticks * rate / TICK_RATE;
            let contenders = course.run(&title, rate, periods, contenders)?;
            let cell = self.cell(condition);
            record(&cell, &contenders.iter().collect::<Vec<_>>(), &OURS, records);
            for (name, level) in [(HYBRID, level), (LAZY, lazy_level)] {
                let level = f64::from(level);
                records.push(Record::number(&cell, name, "split_level", level, "levels"));
            }
        }
        Ok(())
    }

    fn cell(&self, condition: &str) -> Cell {
        Cell::new(EXPERIMENT, &self.name, self.mesh.triangles.len(), condition)
    }

    fn moved<'a, M: Layout + 'a>(
        &self,
        name: &'static str,
        method: M,
        surface: Surface,
        blends: &[Blend],
        rest: &[Vec3],
        nodes: &Nodes<'_>,
    ) -> Contender<'a>
    where
        M::Position: Weighed + 'a,
    {
        received(name, surface, Moved::new(method, surface, blends, rest), nodes)
    }

    /// What each vertex of the mesh is bound to.
    fn blends(&self, nodes: &Nodes<'_>, built: &BuiltTree) -> Vec<Blend> {
        let mut blends =
            vec![Blend { nodes: [0; 4], weights: [0.0; 4] }; self.mesh.positions.len()];
        for (row, &vertex) in (0..).zip(built.vertex_order()) {
            let weights = nodes.weights(row).expect("a row of the tree");
            blends[vertex as usize] = Blend {
                nodes: weights.map(|(node, _)| node),
                weights: weights.map(|(_, weight)| weight as f32 / 65_536.0),
            };
        }
        blends
    }

    /// The vertices at these nodes, in the mesh's order.
    fn vertices(&self, nodes: &Nodes<'_>, table: &[Vec3], built: &BuiltTree) -> Vec<Vec3> {
        let mut vertices = self.mesh.positions.clone();
        let surface = nodes.surface(table);
        for (row, &vertex) in (0..).zip(built.vertex_order()) {
            vertices[vertex as usize] = surface.position(row).expect("a row of the tree");
        }
        vertices
    }

    /// What a frame takes on the line and in memory, its packets' way to the buffers, and its check: of the elements, and of the surface's triangles, in
    /// turns on the same frames.
    fn checks<I: Index>(
        &self,
        nodes: &Nodes<'_>,
        plain: &Tree<'_, I>,
        of_vertices: &BuiltTree,
        built: &BuiltTree,
        frame: &dyn Fn(f32, &mut Vec<Vec3>),
        records: &mut Records,
    ) -> Result<()> {
        let cell = self.cell(FRAME);
        let mut monitor = StretchMonitor::new(plain).context("the tree has a metric")?;
        let (mut table, mut ours, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
        let (mut line, mut payload, mut received) = (Line::new(nodes), 0, Vec::new());
        for number in 0..CHECKS {
            frame(number as f32 * 0.1, &mut table);
            let vertices = of_vertices.to_rows(&self.vertices(nodes, &table, built));
            let start = Instant::now();
            let _ = measured(&mut monitor, vertices.as_slice());
            theirs.push(microseconds(start));
            let start = Instant::now();
            nodes.measure(table.as_slice()).context("within the limit")?;
            ours.push(microseconds(start));
            payload = line.send(&table);
            let start = Instant::now();
            line.receive();
            received.push(microseconds(start));
        }
        let rows = 2 * size_of_val(table.as_slice());
        let ratio = Paired::of(&theirs, &ours).ratio;
        let count = |value: u32| f64::from(value);
        for (metric, value, unit) in [
            ("nodes", count(nodes.count()), "nodes"),
            ("elements", count(nodes.element_count()), "tetrahedra"),
            ("payload", payload as f64, "bytes a frame, packets included"),
            ("memory", rows as f64, "bytes of two buffers' rows"),
            ("flash", built.blob().len() as f64, "bytes"),
        ] {
            records.push(Record::number(&cell, NODES_QUERY, metric, value, unit));
        }
        for (method, metric, summary, unit) in [
            (NODES_QUERY, "receive", Summary::of(&received), "us a frame"),
            (NODES_QUERY, "check", Summary::of(&ours), "us a frame"),
            (DIBS, "check", Summary::of(&theirs), "us a frame"),
            (NODES_QUERY, "check of triangles", ratio, "theirs / ours"),
        ] {
            records.push(Record::summary(&cell, method, metric, &summary, unit));
        }
        Ok(())
    }
}
