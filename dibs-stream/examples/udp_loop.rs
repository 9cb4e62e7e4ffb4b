//! A sender and a controller's loop over UDP, in one program: `cargo run -p dibs-stream --example udp_loop`.

use std::error::Error;
use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::{Builder, Mesh};
use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{GuardLimits, Surface};
use dibs_nostd::{Capsule, Millis, Tree, TreeBytes};
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
    static OCTAHEDRON: Surface<6> = Surface::new();
    let mesh = octahedron();
    let built = Builder::new().stretch(1.5).build(&mesh)?;
    let tree = Tree::<u16>::from_bytes(built.blob())?;

    // The imaging side: 50 frames a second of a surface that breathes.
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let target: Target = format!("udp:{}", socket.local_addr()?).parse()?;
    let order = SurfaceOrder::of(&tree);
    let mut sender = Sender::<_, 1024>::new(target.open()?, order, Settings::default());
    let sending = thread::spawn(move || {
        for frame in 0..100 {
            let size = 1.0 + 0.1 * (0.3 * frame as f32).sin();
            let positions: Vec<Vec3> = mesh.positions.iter().map(|&p| p * size).collect();
            sender.send(&positions).expect("sent");
            sender.poll().expect("an open line");
            thread::sleep(Duration::from_millis(20));
        }
    });

    // The controller: packets, checks in slices, statuses, and the force. Nobody is there to acknowledge.
    let limits = GuardLimits::new(500.0, Millis(100)).automatic();
    let stored = TreeBytes::<u16>::new(built.blob());
    let (mut bus, mut guard) = OCTAHEDRON.start::<_, 32, 64>(stored, limits)?;
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let wall = ForbiddenRegion::new(spring, 5.0)?;
    let tool = Capsule::new(Vec3::new(0.0, 0.0, 35.0), Vec3::new(0.0, 0.0, 90.0), 2.5)?;
    socket.set_read_timeout(Some(Duration::from_millis(1)))?;
    let (start, mut packet, mut status) = (Instant::now(), [0; 1472], [0; 96]);
    let mut pushed = 0;
    while !sending.is_finished() {
        let now = Millis(start.elapsed().as_millis() as u32);
        if let Ok((length, sender)) = socket.recv_from(&mut packet) {
            // An error says what was wrong with the packet; `counters` counts it by cause.
            let _counted = bus.packet(&packet[..length], now);
            if let Some(status) = bus.status(now, &mut status) {
                socket.send_to(status, sender)?;
            }
        }
        let _counted = bus.work(100);
        pushed += u32::from(guard.closest(&tool, now).force(&wall).force.z > 0.0);
    }
    println!("{}", bus.counters());
    println!("the wall pushed in {pushed} ticks");
    assert!(pushed > 0);
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap();
}
