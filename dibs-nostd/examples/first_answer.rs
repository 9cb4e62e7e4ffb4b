//! The closest pair of an instrument and a beating heart, from tick to tick: `cargo run -p dibs-nostd --example first_answer`.

use std::error::Error;

use dibs_build::{Builder, generate};
use dibs_nostd::{Capsule, Odometer, Options, Tracker, Tree, glam::Vec3};

fn main() -> Result<(), Box<dyn Error>> {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000)?;
    let built = Builder::new().stretch(1.5).build(&mesh)?;
    let tree = Tree::<u16>::from_bytes(built.blob())?;
    let mut tracker = Tracker::<_, 64, 256>::new(&tree)?;
    let mut odometer = Odometer::new(&tree);

    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let (mut tests, mut ticks) = (0, 0);
    for (before, after) in frames.iter().zip(frames.iter().skip(1)) {
        let step = odometer.step(before.as_slice(), after.as_slice());
        for tick in 0..10 {
            let tip = Vec3::new(75.0 - 0.02 * ticks as f32, 0.0, 20.0);
            let tool = Capsule::new(tip, tip + Vec3::new(50.0, 0.0, 40.0), 2.5)?;
            let found = tracker.closest(&step.at(tick as f32 / 10.0), &tool, &Options::new())?;
            (tests, ticks) = (tests + found.closest.node_tests, ticks + 1);
            if tick == 0 {
                let interval = found.closest.interval();
                println!(
                    "{:.3} to {:.3} mm, {:?}",
                    interval.lower, interval.upper, found.closest.side
                );
            }
        }
    }
    println!("{} node tests a tick, of {} nodes", tests / ticks, tree.node_count());
    assert!(tests / ticks < tree.node_count() / 4);
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
