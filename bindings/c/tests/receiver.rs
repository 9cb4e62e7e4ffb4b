//! `examples/cpp/receiver.cpp` receives frames by UDP, waits for its acknowledgement, and then answers.

// Requirement: P-06

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Options, Query};
use dibs_stream::transport::Target;
use dibs_stream::{Sender, Settings, SurfaceOrder};
use xtask::workspace;

use crate::programs::{include, library, run, tool};

/// For a whole conversation.
const PATIENCE: Duration = Duration::from_secs(60);

/// The tool of the program.
const AXIS: [Vec3; 2] = [Vec3::new(0.0, 0.0, 90.0), Vec3::new(0.0, 0.0, 150.0)];

#[test]
fn the_receiver_in_cpp_answers_once_it_is_acknowledged() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = compiled(folder.path());
    let heart = generate::heart(1_000).expect("a size").mesh;
    let built = Builder::new().stretch(1.5).build(&heart).expect("a tree");
    let [start, end] = AXIS;
    let capsule = Capsule::new(start, end, 2.5).expect("a tool");
    let rows = built.to_rows(&heart.positions);
    let tree = built.tree::<u16>().expect("a tree");
    let mut query = Query::<u16, 512>::new(&tree).expect("a stack");
    let found = query.closest(rows.as_slice(), &capsule, &Options::new()).expect("an answer");
    let expected = format!("{:.3} mm, in truth at least ", found.separation);

    let said = conversation(&program, &heart, |line| line.starts_with(&expected));
    let [first, .., last] = &said[..] else { panic!("{said:?}") };
    assert!(first.starts_with("held: "), "{said:?}");
    assert!(last.starts_with(&expected) && last.ends_with(" N"), "{said:?}");
    let waits = "held: the safe state was not acknowledged";
    assert!(said.iter().any(|line| line == waits), "{said:?}");

    // A strip whose rim is the closest: there is an answer, and its wall does not act.
    let said = conversation(&program, &strip(), |line| line.starts_with("3.500 mm, "));
    let last = said.last().expect("lines");
    assert!(last.ends_with(": held: the tool's side is not known"), "{said:?}");

    // Arguments that are no numbers.
    for [port, age] in [["5000", "8O"], ["5000", "-1"], ["70000", "80"], ["", "80"]] {
        let mut receiver = Command::new(&program);
        receiver.arg(folder.path().join("tree")).args([port, age]);
        let output = receiver.output().expect("it starts");
        let error = String::from_utf8_lossy(&output.stderr);
        let is_told = error.contains("give a whole number of at most ");
        assert!(output.status.code() == Some(1) && is_told, "{port} {age}: {error}");
    }
}

/// An open surface, 6 mm beside the tool's axis and away from it.
fn strip() -> Mesh {
    let rungs = (0..20).map(|rung| 70.0 + 5.0 * rung as f32);
    let positions = rungs.flat_map(|z| [6.0, 16.0].map(|x| Vec3::new(x, 0.0, z))).collect();
    let triangles = (0..19).map(|rung| 2 * rung);
    let triangles = triangles.flat_map(|at| [[at, at + 1, at + 2], [at + 1, at + 3, at + 2]]);
    Mesh { origin: Default::default(), positions, triangles: triangles.collect() }
}

/// The example's program.
fn compiled(folder: &Path) -> PathBuf {
    let program = folder.join("receiver");
    let mut compiler = tool("g++", "g++");
    compiler.args(["-std=c++17", "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    compiler.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]);
    compiler.arg(include()).arg(workspace::root().join("examples/cpp/receiver.cpp"));
    run(compiler.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    program
}

/// Sends a surface at rest to the program, and acknowledges. What it says, until a line is the expected one.
fn conversation(program: &Path, mesh: &Mesh, is_last: impl Fn(&str) -> bool) -> Vec<String> {
    let built = Builder::new().stretch(1.5).build(mesh).expect("a tree");
    let file = program.with_file_name("tree");
    fs::write(&file, built.blob()).expect("writable");
    let tree = built.tree::<u16>().expect("a tree");
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    let to = free.expect("a free port");
    let mut receiver = Command::new(program);
    // A computer that runs other tests beside this one is late.
    receiver.arg(&file).arg(to.port().to_string()).arg("2000");
    receiver.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut receiver = receiver.spawn().expect("it starts");
    let mut keys = receiver.stdin.take().expect("piped");
    let mut lines = BufReader::new(receiver.stdout.take().expect("piped")).lines();
    let (start, is_over) = (Instant::now(), AtomicBool::new(false));
    let said = thread::scope(|scope| {
        scope.spawn(|| {
            let target: Target = format!("udp:{to}").parse().expect("an address");
            let order = SurfaceOrder::of(&tree);
            let line = target.open().expect("a socket");
            let mut sender = Sender::<_, 1024>::new(line, order, Settings::default());
            while !is_over.load(Ordering::Relaxed) && start.elapsed() < PATIENCE {
                // Of now, although it is at rest: otherwise its age is its time at rest. Refused while the program has no
                // socket yet.
                let sent = sender.send_captured(&mesh.positions, Duration::ZERO);
                let _ = sent.and_then(|_| sender.poll());
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
            if said.last().is_some_and(|line| is_last(line)) || start.elapsed() > PATIENCE {
                break;
            }
        }
        drop(keys);
        is_over.store(true, Ordering::Relaxed);
        said
    });
    assert!(receiver.wait().expect("it ends").success());
    said
}
