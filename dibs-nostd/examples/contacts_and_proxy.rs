//! A hand that pushes an instrument into a corner, against the force of all contacts:
//! `cargo run -p dibs-nostd --example contacts_and_proxy`.

use std::error::Error;

use dibs_build::{Builder, Mesh};
use dibs_nostd::constraint::{Proxy, SpringDamper};
use dibs_nostd::{Contacts, Options, Query, Sphere, Tree, glam::Vec3};

/// Two slopes of 45 degrees that meet in a valley along y.
fn valley() -> Mesh {
    let positions = [-40.0, 0.0, 40.0]
        .into_iter()
        .flat_map(|x: f32| [-40.0, 40.0].map(|y| Vec3::new(x, y, x.abs())))
        .collect();
    let triangles = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
    Mesh { positions, triangles, ..Mesh::default() }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mesh = valley();
    let built = Builder::new().build(&mesh)?;
    let tree = Tree::<u16>::from_bytes(built.blob())?;
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<_, 32>::new(&tree)?;
    let mut contacts = Contacts::<8>::new();

    // 1 N/mm, 0.01 N s/mm, at most 5 N, from 3 mm on; a hand of 0.2 kg pushes with 2 N.
    let proxy = Proxy::new(SpringDamper::stiffness(1.0).damping(0.01).max_force(5.0), 3.0)?;
    let (push, mass, tick) = (Vec3::new(0.5, 0.0, -2.0), 2e-4, 1e-3);
    let (mut centre, mut velocity) = (Vec3::new(2.0, 0.0, 20.0), Vec3::ZERO);
    for number in 0..3_000 {
        let tool = Sphere::new(centre, 1.0)?;
        let options = Options::new();
        let closest = query.contacts(rows.as_slice(), &tool, 6.0, &options, &mut contacts)?;
        let within = contacts.within(6.0);
        let wrench = proxy.wrench(within, contacts.accuracy(), centre, velocity, Vec3::ZERO);
        if number % 500 == 0 {
            println!(
                "{:.2} mm, {} contacts, {:.2}",
                closest.separation,
                contacts.len(),
                wrench.force
            );
        }
        velocity += (wrench.force + push - velocity * 0.02) * (tick / mass);
        centre += velocity * tick;
    }
    println!("at rest at {centre:.2}");
    assert!(
        velocity.length() < 0.1 && centre.x.abs() < 2.0 && centre.z > 1.4,
        "{centre} {velocity}"
    );
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
