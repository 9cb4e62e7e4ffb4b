//! A sender and a controller's loop over UDP, in one program: `cargo run -p dibs-stream --example udp_loop`.

use std::error::Error;
use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::{Builder, Mesh};
use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Assembler, Capsule, Frames, Millis, Options, SurfaceLimits, Tracker, Tree};
use dibs_stream::transport::Target;
use dibs_stream::{Sender, Settings, SurfaceOrder};

/// An octahedron of 30 mm.
fn octahedron() -> Mesh {
    let (x, y, z) = (Vec3::X * 30.0, Vec3::Y * 30.0, Vec3::Z * 30.0);
    let triangles = vec![
        [0, 1, 4],
        [1, 2, 4],
        [2, 3, 4],
        [3, 0, 4],
        [1, 0, 5],
        [2, 1, 5],
        [3, 2, 5],
        [0, 3, 5],
    ];
    Mesh { positions: vec![x, y, -x, -y, z, -z], triangles, ..Mesh::default() }
}

fn main() -> Result<(), Box<dyn Error>> {
    static FRAMES: Frames<6> = Frames::new();
    let mesh = octahedron();
    let built = Builder::new().stretch(1.5).build(&mesh)?;
    let tree = Tree::<u16>::from_bytes(built.blob())?;

    // The imaging side: 50 frames a second of a surface that breathes.
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let target: Target = format!("udp:{}", socket.local_addr()?).parse()?;
    let order = SurfaceOrder::of(&tree);
    let mut sender = Sender::<_, 1024>::new(target.open()?, order, Settings::default());
    let sending = thread::spawn(move || {
        for frame in 0..40 {
            let size = 1.0 + 0.1 * (0.3 * frame as f32).sin();
            let positions: Vec<Vec3> = mesh.positions.iter().map(|&p| p * size).collect();
            sender.send(&positions).expect("sent");
            sender.poll().expect("an open line");
            thread::sleep(Duration::from_millis(20));
        }
    });

    // The controller: packets, checks in slices, and the force.
    let (writer, mut reader) = FRAMES.split()?;
    let limits = SurfaceLimits::reach_mm(100.0).speed(0.5);
    let mut assembler = Assembler::for_tree(writer, &tree, limits)?;
    let mut tracker = Tracker::<_, 32, 64>::new(&tree)?;
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let wall = ForbiddenRegion::new(spring, 5.0)?;
    let tool = Capsule::new(Vec3::new(0.0, 0.0, 35.0), Vec3::new(0.0, 0.0, 90.0), 2.5)?;
    socket.set_read_timeout(Some(Duration::from_millis(1)))?;
    let (start, mut packet, mut pushed) = (Instant::now(), [0; 1472], 0);
    while !sending.is_finished() {
        let now = Millis(start.elapsed().as_millis() as u32);
        if let Ok(length) = socket.recv(&mut packet) {
            // An error says what was wrong with the packet; `counters` counts it by cause.
            let _counted = assembler.accept(&packet[..length], now);
        }
        let _pending = assembler.advance(100);
        let surface = reader.latest(now).within(Millis(100));
        let answer = surface
            .and_then(|surface| Ok(tracker.closest(&surface, &tool, &Options::new())?.closest));
        pushed += u32::from(wall.force(&answer, Vec3::ZERO).force.z > 0.0);
    }
    println!("{}", assembler.counters());
    println!("the wall pushed in {pushed} ticks");
    assert!(pushed > 0);
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
