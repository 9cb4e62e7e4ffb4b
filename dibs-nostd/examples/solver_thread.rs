//! A solver in a thread of its own moves the surface, and the control loop asks: no bus, and no lock.
//! `cargo run -p dibs-nostd --example solver_thread`.

use std::error::Error;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::{Builder, generate};
use dibs_nostd::guard::{GuardLimits, Surface};
use dibs_nostd::{Advance, Millis, Sphere, TreeBytes, glam::Vec3};

/// Vertices of a heart of 320 triangles.
const VERTICES: usize = 162;

static HEART: Surface<VERTICES> = Surface::new();

/// The one clock of both threads.
fn now() -> Millis {
    static START: OnceLock<Instant> = OnceLock::new();
    Millis(START.get_or_init(Instant::now).elapsed().as_millis() as u32)
}

fn main() -> Result<(), Box<dyn Error>> {
    let generate::MovingMesh { mesh, motion } = generate::heart(320)?;
    let tree: &'static [u8] = Builder::new().stretch(1.5).build(&mesh)?.blob().to_vec().leak();
    // Tissue of at most 2,000 mm/s: here the beat is played fast.
    let limits = GuardLimits::new(2_000.0, Millis(100)).automatic();
    let (mut bus, mut guard) = HEART.start::<u16, 64, 96>(TreeBytes::new(tree), limits)?;

    let solver = thread::spawn(move || {
        for positions in motion.frames.iter().cycle().take(150) {
            let captured = now();
            // The solver's own order and time. An error says what is wrong with the frame; the last good one stays.
            if let Err(error) = bus.frame(positions, captured, now()) {
                eprintln!("{error}");
            }
            while matches!(bus.work(1_000), Ok(Advance::Pending | Advance::Held { .. })) {}
            thread::sleep(Duration::from_millis(10));
        }
        *bus.counters()
    });
    let tool = Sphere::new(Vec3::new(78.0, 0.0, 10.0), 2.0)?;
    let mut nearest = f32::INFINITY;
    while !solver.is_finished() {
        if let Ok(closest) = guard.closest(&tool, now()).closest {
            nearest = nearest.min(closest.separation);
        }
        thread::sleep(Duration::from_millis(1));
    }
    println!("{}", solver.join().map_err(|_| "the solver panicked")?);
    println!("the heart came as near as {nearest:.2} mm");
    assert!(nearest.is_finite());
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
