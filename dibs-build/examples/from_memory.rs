//! A tree from vertices in memory, and the bytes that a controller takes: `cargo run -p dibs-build --example from_memory`.

use std::error::Error;

use dibs_build::glam::Vec3;
use dibs_build::{Builder, Mesh, orient};
use dibs_nostd::{Options, Query, Sphere, Tree};

fn main() -> Result<(), Box<dyn Error>> {
    // A pyramid of 20 mm; one of its triangles is wound the wrong way.
    let mut mesh = Mesh {
        positions: vec![
            Vec3::new(-10.0, -10.0, 0.0),
            Vec3::new(10.0, -10.0, 0.0),
            Vec3::new(0.0, 10.0, 0.0),
            Vec3::new(0.0, 0.0, 20.0),
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 2, 3]],
        ..Mesh::default()
    };
    println!("triangles turned: {}", orient(&mut mesh)?);
    let built = Builder::new().stretch(1.5).build(&mesh)?;
    println!("a tree of {} bytes", built.blob().len());

    // On the target: the bytes are validated, and vertices are in the tree's order.
    let tree = Tree::<u16>::from_bytes(built.blob())?;
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<_, 32>::new(&tree)?;
    let tool = Sphere::new(Vec3::new(0.0, 0.0, 30.0), 2.5)?;
    let closest = query.closest(rows.as_slice(), &tool, &Options::new())?;
    println!("{:.3} mm, {:?}", closest.separation, closest.side);
    assert!((closest.separation - 7.5).abs() < 1e-4);
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
