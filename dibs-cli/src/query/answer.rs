//! An answer, as JSON or as text.

use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::{Contact, Coverage, NoSide, Proximity, QueryError, Side};
use serde::Serialize;

/// The closest pair of a tool and a surface.
pub struct Answer<'a> {
    pub proximity: Proximity,
    /// Corners of the triangle, numbered as in the mesh file.
    pub triangle: [u32; 3],
    /// The triangle's label, if the tree has labels.
    pub label: Option<u8>,
    /// The point that the pair's coordinates are relative to.
    pub origin: DVec3,
    pub tree: &'a str,
    /// Index of the tool in its chain, from 0.
    pub tool: usize,
    /// `None` if the tree has no rest metric to measure it with.
    pub stretch: Option<f64>,
    /// All contacts, nearest first, if they were requested.
    pub contacts: Option<Vec<Touch<'a>>>,
    /// Every contact with a separation below this is listed.
    pub bound: f32,
}

/// A contact.
pub struct Touch<'a> {
    pub contact: Contact,
    pub triangle: [u32; 3],
    pub label: Option<u8>,
    pub origin: DVec3,
    pub tree: &'a str,
    pub tool: usize,
}

/// The side's name, or why there is none.
pub fn side_name(side: Side) -> (&'static str, Option<String>) {
    match side {
        Side::Outside => ("outside", None),
        Side::Inside => ("inside", None),
        Side::Crossing => ("crossing", None),
        Side::Either => ("either", None),
        // The text includes the remedy.
        Side::Undefined(NoSide::NoAdjacency) => {
            ("undefined", Some(QueryError::NoAdjacency.to_string()))
        }
        Side::Undefined(reason) => ("undefined", Some(reason.to_string())),
        _ => ("undefined", None),
    }
}

/// Whether the coverage was measured or assumed.
fn coverage_name(coverage: Coverage) -> &'static str {
    match coverage {
        Coverage::Measured => "measured",
        Coverage::Proven => "proven",
        _ => "assumed",
    }
}

/// An answer in JSON. Numbers are f64, which represents every f32: a reader that computes in f64 gets the same bits.
#[derive(Serialize)]
pub struct Record<'a> {
    /// Line number in a file of poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<usize>,
    separation: f64,
    lower: f64,
    accuracy: f64,
    /// Certified: the bounds include the accuracy. The first is null if the tool may be inside to any depth.
    interval: [f64; 2],
    /// Whether the stretch that the answer depends on was checked.
    coverage: &'static str,
    side: &'static str,
    side_reason: Option<String>,
    axis_distance: f64,
    point_on_surface: [f64; 3],
    point_on_tool: [f64; 3],
    direction: [f64; 3],
    axis_parameter: f64,
    tree: &'a str,
    tool: usize,
    triangle: [u32; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    label: Option<u8>,
    barycentric: [f64; 3],
    stretch: Option<f64>,
    node_tests: u32,
    triangle_tests: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<ContactRecord<'a>>>,
    /// Every contact with a separation below this is listed: the margin, unless there were too many contacts.
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts_bound: Option<f64>,
}

/// A contact in JSON.
#[derive(Serialize)]
pub struct ContactRecord<'a> {
    separation: f64,
    point_on_surface: [f64; 3],
    point_on_tool: [f64; 3],
    normal: [f64; 3],
    triangle: [u32; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    label: Option<u8>,
    tree: &'a str,
    tool: usize,
}

/// A vector in JSON.
pub fn vector(vector: Vec3) -> [f64; 3] {
    vector.as_dvec3().to_array()
}

/// A point in the coordinates of the mesh's file.
fn point(point: Vec3, origin: DVec3) -> [f64; 3] {
    // Adding zero would lose the sign of -0.
    if origin == DVec3::ZERO { vector(point) } else { (origin + point.as_dvec3()).to_array() }
}

/// The same as text.
fn point_text(point: Vec3, origin: DVec3) -> String {
    if origin == DVec3::ZERO {
        return point.to_string();
    }
    format!("{:.6}", origin + point.as_dvec3())
}

impl<'a> Answer<'a> {
    pub fn record(&self, line: Option<usize>) -> Record<'a> {
        let p = &self.proximity;
        let (side, side_reason) = side_name(p.side);
        let contacts = self.contacts.as_ref();
        let interval = p.interval();
        Record {
            line,
            separation: p.separation.into(),
            lower: p.lower.into(),
            accuracy: p.accuracy.into(),
            interval: [interval.lower.into(), interval.upper.into()],
            coverage: coverage_name(p.coverage),
            side,
            side_reason,
            axis_distance: p.axis_distance.into(),
            point_on_surface: point(p.point_on_surface, self.origin),
            point_on_tool: point(p.point_on_tool, self.origin),
            direction: vector(p.direction),
            axis_parameter: p.axis_parameter.into(),
            tree: self.tree,
            tool: self.tool,
            triangle: self.triangle,
            label: self.label,
            barycentric: p.barycentric.map(f64::from),
            stretch: self.stretch,
            node_tests: p.node_tests,
            triangle_tests: p.triangle_tests,
            contacts: contacts.map(|contacts| contacts.iter().map(Touch::record).collect()),
            contacts_bound: contacts.map(|_| self.bound.into()),
        }
    }

    pub fn print(&self, surfaces: usize, tools: usize) {
        let p = &self.proximity;
        println!("separation        {} (within {:.1e})", p.separation, p.accuracy);
        match side_name(p.side) {
            (side, Some(reason)) => println!("side              {side}: {reason}"),
            (side, None) => println!("side              {side}"),
        }
        if surfaces > 1 {
            println!("surface           {}", self.tree);
        }
        if tools > 1 {
            println!("tool              number {} from 0", self.tool);
        }
        println!("point on surface  {}", point_text(p.point_on_surface, self.origin));
        println!("point on tool     {}", point_text(p.point_on_tool, self.origin));
        println!("triangle          {:?}, weights {:?}", self.triangle, p.barycentric);
        if let Some(label) = self.label {
            println!("label             {label}");
        }
        if let Some(stretch) = self.stretch {
            println!("stretch           {}", stretch as f32);
        }
        if p.coverage == Coverage::Assumed {
            println!("coverage          assumed: the tree cannot measure the stretch");
        }
        println!("tests             {} nodes, {} triangles", p.node_tests, p.triangle_tests);
        for touch in self.contacts.iter().flatten() {
            let Contact { separation, point_on_surface, normal, .. } = touch.contact;
            let at = point_text(point_on_surface, touch.origin);
            println!("contact           {separation} at {at}, normal {normal}");
        }
    }
}

impl<'a> Touch<'a> {
    pub fn record(&self) -> ContactRecord<'a> {
        ContactRecord {
            separation: self.contact.separation.into(),
            point_on_surface: point(self.contact.point_on_surface, self.origin),
            point_on_tool: point(self.contact.point_on_tool, self.origin),
            normal: vector(self.contact.normal),
            triangle: self.triangle,
            label: self.label,
            tree: self.tree,
            tool: self.tool,
        }
    }
}
