//! A tool in words, `sphere:0,0,150,5`, or as the numbers alone.

use anyhow::{Result, anyhow, bail};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Sphere};

#[derive(Clone, Copy, Debug)]
pub enum ToolSpec {
    Sphere(Sphere),
    Capsule(Capsule),
}

/// `sphere:X,Y,Z,R` or `capsule:X1,Y1,Z1,X2,Y2,Z2,R`.
pub fn parse_tool(text: &str) -> Result<ToolSpec> {
    let (shape, numbers) = text.split_once(':').ok_or_else(|| anyhow!("no ':' after the shape"))?;
    let numbers: Vec<f32> = numbers
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
pub fn tool(numbers: &[f32]) -> Result<ToolSpec> {
    match *numbers {
        [x, y, z, radius] => Ok(ToolSpec::Sphere(Sphere::new(Vec3::new(x, y, z), radius)?)),
        [x1, y1, z1, x2, y2, z2, radius] => {
            let (start, end) = (Vec3::new(x1, y1, z1), Vec3::new(x2, y2, z2));
            Ok(ToolSpec::Capsule(Capsule::new(start, end, radius)?))
        }
        _ => bail!(
            "{} numbers are no tool: give X,Y,Z,R for a sphere or X1,Y1,Z1,X2,Y2,Z2,R for a capsule",
            numbers.len()
        ),
    }
}
