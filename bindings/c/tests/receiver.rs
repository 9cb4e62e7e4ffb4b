//! `examples/cpp/receiver.cpp` receives frames by UDP, waits for its acknowledgement, and then answers.

// Requirement: P-06

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::{Builder, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Options, Query};
use dibs_stream::transport::Target;
use dibs_stream::{Sender, Settings, SurfaceOrder};
use xtask::workspace;

use crate::programs::{include, library, run, tool};

/// For the whole conversation.
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn the_receiver_in_cpp_answers_once_it_is_acknowledged() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, program] = ["tree", "receiver"].map(|name| folder.path().join(name));
    let mesh = generate::heart(1_000).expect("a size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    fs::write(&file, built.blob()).expect("writable");
    let tree = built.tree::<u16>().expect("a tree");
    let mut compiler = tool("g++", "g++");
    compiler.args(["-std=c++17", "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    compiler.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]);
    compiler.arg(include()).arg(workspace::root().join("examples/cpp/receiver.cpp"));
    run(compiler.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));

    // The tool of the program, and the surface at rest.
    let axis = [90.0, 150.0].map(|z| Vec3::new(0.0, 0.0, z));
    let capsule = Capsule::new(axis[0], axis[1], 2.5).expect("a tool");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, 512>::new(&tree).expect("a stack");
    let found = query.closest(rows.as_slice(), &capsule, &Options::new()).expect("an answer");
    let expected = format!("{:.3} mm, in truth at least ", found.separation);

    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    let to = free.expect("a free port");
    let mut receiver = Command::new(&program);
    // A computer that runs other tests beside this one is late.
    receiver.arg(&file).arg(to.port().to_string()).arg("2000");
    receiver.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut receiver = receiver.spawn().expect("it starts");
    let mut keys = receiver.stdin.take().expect("piped");
    let mut lines = BufReader::new(receiver.stdout.take().expect("piped")).lines();
    let (start, is_over) = (Instant::now(), AtomicBool::new(false));
    let said: Vec<String> = thread::scope(|scope| {
        scope.spawn(|| {
            let target: Target = format!("udp:{to}").parse().expect("an address");
            let order = SurfaceOrder::of(&tree);
            let line = target.open().expect("a socket");
            let mut sender = Sender::<_, 1024>::new(line, order, Settings::default());
            while !is_over.load(Ordering::Relaxed) && start.elapsed() < PATIENCE {
                // Refused while the program has no socket yet.
                let _ = sender.send(&mesh.positions).and_then(|_| sender.poll());
                thread::sleep(Duration::from_millis(20));
            }
        });
        let mut said: Vec<String> = Vec::new();
        // Its output stays open until it ends.
        for line in lines.by_ref().map_while(Result::ok) {
            if line.contains("not acknowledged") {
                keys.write_all(b"\n").expect("it listens");
            }
            said.push(line);
            if said.iter().any(|line| line.starts_with(&expected)) || start.elapsed() > PATIENCE {
                break;
            }
        }
        drop(keys);
        is_over.store(true, Ordering::Relaxed);
        said
    });
    assert!(receiver.wait().expect("it ends").success());
    let [first, .., last] = &said[..] else { panic!("{said:?}") };
    assert!(first.starts_with("held: "), "{said:?}");
    assert!(last.starts_with(&expected) && last.ends_with(" N"), "{said:?}");
    let waits = "held: the safe state was not acknowledged";
    assert!(said.iter().any(|line| line == waits), "{said:?}");
}
