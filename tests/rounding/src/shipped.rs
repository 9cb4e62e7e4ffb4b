//! The shipped functions, compiled for recorded numbers, and stand-ins for what they call.
//!
//! A stand-in has the name of what it replaces, and only as much as the functions use.

// The shipped text names fields and variants that a stand-in has no use for, and is linted where it is shipped.
#![allow(dead_code, non_camel_case_types, unused_variables, clippy::all)]

use crate::constants::{AROUND, CLOSEST, RANGE, ROUNDING};
use crate::tape::Traced as f32;
use crate::vector::Vec3;

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

pub fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// A tool, as far as a plane and a node's bound need it.
pub trait Axis {
    fn axis_to(&self, point: Vec3) -> Vec3;
}

pub struct Sphere {
    pub centre: Vec3,
}

/// Any tool: the shortest vector from its axis to the point that is asked for is given.
pub struct Given {
    pub to: Vec3,
}

impl Axis for Given {
    fn axis_to(&self, _: Vec3) -> Vec3 {
        self.to
    }
}

pub struct Search<T> {
    pub tool: T,
    pub tree: Tree,
    pub vertices: (),
    pub meter: Meter,
    pub waiting: usize,
    pub radius_scale: f32,
    pub cutoff: f32,
    pub cutoff_squared: f32,
    pub coordinate_slack: f32,
    pub tilt_slack: f32,
    /// The bound of the child that is not rejected.
    pub pushed: Option<f32>,
}

impl<T> Search<T> {
    fn position(&self, pin: Vec3) -> Result<Vec3, QueryError> {
        Ok(pin)
    }

    fn lower_cutoff_to_pin(&mut self, _: Vec3, _: f32) {}

    fn push(&mut self, _: usize, subtree: WaitingNode) -> Option<()> {
        self.pushed = Some(subtree.lower);
        Some(())
    }
}

#[derive(Clone, Copy)]
struct WaitingNode {
    lower: f32,
    link: u32,
}

#[derive(Clone, Copy, Debug)]
pub enum QueryError {
    Corrupt { row: u32 },
}

pub struct Meter;

impl Meter {
    fn node(&mut self) -> Option<()> {
        Some(())
    }
}

/// A tree of one node.
#[derive(Clone, Copy)]
pub struct Tree {
    pub node: Node,
}

impl Tree {
    fn records(&self, _: u32, _: u32) -> Option<[Node; 1]> {
        Some([self.node])
    }
}

/// A node with its pin's position in place of its row.
#[derive(Clone, Copy)]
pub struct Node {
    pub pin: Vec3,
    pub radius_code: f32,
    pub link: u32,
}

enum NodeLink {
    Children,
    Leaf { first: u32, count: u32 },
}

impl NodeLink {
    /// A leaf's node is tested against a plane besides: that is a kernel of its own.
    fn decode(_: u32) -> Self {
        Self::Children
    }
}

/// As shipped.
pub struct Plane {
    pub normal: Vec3,
    pub limit: f32,
}

impl Plane {
    fn beyond(&self, _: Tree, (): (), _: u32, _: u32) -> Option<u32> {
        None
    }
}

pub struct EmbeddedSurface {
    pub nodes: Nodes,
    pub table: Table,
}

pub struct Nodes {
    pub limit: f32,
    pub parts: Parts,
}

pub struct Parts {
    pub scale: Scale,
    pub extent: f32,
    pub edge: f32,
    pub amplification: f32,
}

impl Nodes {
    fn binding(&self, _: u32) -> Option<([u32; 4], [f32; 3])> {
        Some(([0, 1, 2, 3], self.parts.scale.weights))
    }

    fn element(&self, _: u32) -> Option<[u32; 4]> {
        Some([4; 4])
    }
}

#[derive(Clone, Copy)]
pub struct Scale {
    pub unit: f32,
    pub weights: [f32; 3],
}

impl Scale {
    fn weight(&self, stored: f32) -> f32 {
        stored
    }
}

/// The nodes of a vertex' element, and the first node of the first element.
pub struct Table(pub [Vec3; 5]);

impl Table {
    fn position(&self, node: u32) -> Option<Vec3> {
        self.0.get(node as usize).copied()
    }
}
