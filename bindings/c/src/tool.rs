//! Points, tools and chains of tools.

use bytemuck::AnyBitPattern;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Sphere};
use heapless::Vec;

use crate::border::{Input, some_of};
use crate::code::dibs_code;

/// A point, a direction, a force or a velocity.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_vec3 {
    /// Along x.
    pub x: f32,
    /// Along y.
    pub y: f32,
    /// Along z.
    pub z: f32,
}

impl From<Vec3> for dibs_vec3 {
    fn from(Vec3 { x, y, z }: Vec3) -> Self {
        Self { x, y, z }
    }
}

impl From<dibs_vec3> for Vec3 {
    fn from(dibs_vec3 { x, y, z }: dibs_vec3) -> Self {
        Self::new(x, y, z)
    }
}

/// A rigid instrument: all points within `radius` of the segment from `start` to `end`, in the mesh's coordinates (mm).
/// A capsule; a sphere if both ends are equal.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_tool {
    /// One end of the axis (mm): at most 2^29 on each axis.
    pub start: dibs_vec3,
    /// The other end (mm).
    pub end: dibs_vec3,
    /// Radius (mm): 0 to 2^29.
    pub radius: f32,
}

/// The core's tool.
pub enum Shape {
    Sphere(Sphere),
    Capsule(Capsule),
}

impl TryFrom<dibs_tool> for Shape {
    type Error = dibs_code;

    fn try_from(tool: dibs_tool) -> Result<Self, dibs_code> {
        let (start, end) = (Vec3::from(tool.start), Vec3::from(tool.end));
        Ok(if start == end {
            Self::Sphere(Sphere::new(start, tool.radius)?)
        } else {
            Self::Capsule(Capsule::new(start, end, tool.radius)?)
        })
    }
}

/// Largest number of tools in a chain.
pub const DIBS_TOOLS: usize = 16;

/// A chain of tools of one type: a sphere is a capsule of length zero.
pub(crate) fn chain(
    tools: *const dibs_tool,
    count: u32,
) -> Result<Vec<Capsule, DIBS_TOOLS>, dibs_code> {
    let mut chain = Vec::new();
    for tool in tools.slice(some_of::<DIBS_TOOLS>(count)?)? {
        let tool = Capsule::new(tool.start.into(), tool.end.into(), tool.radius)?;
        chain.push(tool).map_err(|_| dibs_code::Argument)?;
    }
    Ok(chain)
}
