//! A tool, with one grammar for all commands: `--tool`, `--poses`, `--path`.

mod grammar;
mod lines;

pub use grammar::{chain, one};
pub use lines::{Lines, path};

use anyhow::{Result, bail};
use dibs_build::glam::DVec3;
use dibs_nostd::{Capsule, Sphere};

/// Largest number of tools in a chain.
const MOST: usize = 8;

const REMEDY: &str = "give X,Y,Z,R for a sphere or X1,Y1,Z1,X2,Y2,Z2,R for a capsule";

/// A tool in the coordinates of the mesh's file, which may be too large for f32.
#[derive(Clone, Copy, Debug)]
pub enum ToolSpec {
    Sphere { centre: DVec3, radius: f32 },
    Capsule { start: DVec3, end: DVec3, radius: f32 },
}

/// A tool in the coordinates of a tree.
#[derive(Clone, Copy, Debug)]
pub enum LocalTool {
    Sphere(Sphere),
    Capsule(Capsule),
}

impl ToolSpec {
    /// Converts the tool to the coordinates of a tree with this origin, which is subtracted in f64.
    pub fn local(&self, origin: DVec3) -> Result<LocalTool> {
        let local = |point: DVec3| (point - origin).as_vec3();
        Ok(match *self {
            Self::Sphere { centre, radius } => {
                LocalTool::Sphere(Sphere::new(local(centre), radius)?)
            }
            Self::Capsule { start, end, radius } => {
                LocalTool::Capsule(Capsule::new(local(start), local(end), radius)?)
            }
        })
    }

    /// The tool with its points moved so.
    pub fn moved(&self, to: impl Fn(DVec3) -> DVec3) -> Self {
        match *self {
            Self::Sphere { centre, radius } => Self::Sphere { centre: to(centre), radius },
            Self::Capsule { start, end, radius } => {
                Self::Capsule { start: to(start), end: to(end), radius }
            }
        }
    }

    /// The numbers of the tool for a tree with this origin: four for a sphere, seven for a capsule.
    pub fn numbers(&self, origin: DVec3) -> Result<Vec<f32>> {
        self.local(origin)?;
        let local = |point: DVec3| (point - origin).as_vec3().to_array();
        Ok(match *self {
            Self::Sphere { centre, radius } => [&local(centre)[..], &[radius]].concat(),
            Self::Capsule { start, end, radius } => {
                [&local(start)[..], &local(end), &[radius]].concat()
            }
        })
    }

    /// A point on the tool's axis.
    fn start(&self) -> DVec3 {
        match *self {
            Self::Sphere { centre, .. } => centre,
            Self::Capsule { start, .. } => start,
        }
    }
}

/// Four numbers define a sphere, seven a capsule.
fn of_numbers(numbers: &[f64]) -> Result<ToolSpec> {
    let tool = match *numbers {
        [x, y, z, radius] => {
            ToolSpec::Sphere { centre: DVec3::new(x, y, z), radius: radius as f32 }
        }
        [x1, y1, z1, x2, y2, z2, radius] => {
            let (start, end) = (DVec3::new(x1, y1, z1), DVec3::new(x2, y2, z2));
            ToolSpec::Capsule { start, end, radius: radius as f32 }
        }
        _ => bail!("{} numbers are no tool: {REMEDY}", numbers.len()),
    };
    // Whatever the tree's origin, the numbers must be finite, and radius and length valid.
    tool.local(if tool.start().is_finite() { tool.start() } else { DVec3::ZERO })?;
    Ok(tool)
}

/// Fails if there are too many tools.
pub fn check_chain(tools: &[ToolSpec]) -> Result<()> {
    if tools.len() > MOST {
        bail!("{} tools are no chain of at most {MOST}", tools.len());
    }
    Ok(())
}
