//! A tool in words, `sphere:0,0,150,5`, or as the numbers alone.

use anyhow::{Result, anyhow, bail};
use dibs_build::glam::DVec3;
use dibs_nostd::{Capsule, Sphere};

/// A tool in the coordinates of the mesh's file, which f32 may not hold.
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
    /// The tool for a tree with this origin, which f64 subtracts.
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

    /// The numbers of the tool for a tree with this origin: four of a sphere, seven of a capsule.
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

    /// A point of the tool.
    fn start(&self) -> DVec3 {
        match *self {
            Self::Sphere { centre, .. } => centre,
            Self::Capsule { start, .. } => start,
        }
    }
}

/// `sphere:X,Y,Z,R` or `capsule:X1,Y1,Z1,X2,Y2,Z2,R`.
pub fn parse_tool(text: &str) -> Result<ToolSpec> {
    let (shape, numbers) = text.split_once(':').ok_or_else(|| anyhow!("no ':' after the shape"))?;
    let numbers: Vec<f64> = numbers
        .split(',')
        .map(|n| n.trim().parse().map_err(|_| anyhow!("'{n}' is not a number")))
        .collect::<Result<_>>()?;
    match (shape, numbers.as_slice()) {
        ("sphere", numbers @ [_, _, _, _]) => tool(numbers),
        ("capsule", numbers @ [_, _, _, _, _, _, _]) => tool(numbers),
        _ => bail!("expected sphere:X,Y,Z,R or capsule:X1,Y1,Z1,X2,Y2,Z2,R"),
    }
}

/// Four numbers are a sphere, seven a capsule.
pub fn tool(numbers: &[f64]) -> Result<ToolSpec> {
    let tool = match *numbers {
        [x, y, z, radius] => {
            ToolSpec::Sphere { centre: DVec3::new(x, y, z), radius: radius as f32 }
        }
        [x1, y1, z1, x2, y2, z2, radius] => {
            let (start, end) = (DVec3::new(x1, y1, z1), DVec3::new(x2, y2, z2));
            ToolSpec::Capsule { start, end, radius: radius as f32 }
        }
        _ => bail!(
            "{} numbers are no tool: give X,Y,Z,R for a sphere or X1,Y1,Z1,X2,Y2,Z2,R for a capsule",
            numbers.len()
        ),
    };
    // Wherever the tree is, its numbers must be finite, and its radius and length possible.
    tool.local(if tool.start().is_finite() { tool.start() } else { DVec3::ZERO })?;
    Ok(tool)
}
