//! Packets with tags in C: between C's sender and bus over UDP, and both ways between C and Rust.

// Requirements: B-03, F-08, P-06

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Bus, Guard, GuardLimits, PosedRows, Surface};
use dibs_nostd::wire::{AesCmac, Encoding, Event, FrameEncoder, FrameId, Mac, NoMac};
use dibs_nostd::{Millis, ReceiveError, TreeBytes, VertexTable};

use crate::programs::{include, library, run, tool};

const VERTICES: usize = 162;
const KEY: [u8; 16] = *b"a secret of ours";
const RECEIVER: u32 = 7;
const CHALLENGE: u64 = 0x89AB_CDEF_00C0_FFEE;
/// Largest frame speed (mm/s) and age, as in `tags.c`.
const LIMITS: GuardLimits = GuardLimits::new(100_000.0, Millis(1_000));

type TheBus<'s, 't> = Bus<'s, 't, u16, AesCmac, PosedRows>;
type Ends<'s, 't> = (TheBus<'s, 't>, Guard<'s, 't, u16, 512, 256, PosedRows>);

fn heart() -> (BuiltTree, Vec<Vec3>) {
    let mesh = generate::heart(320).expect("a size").mesh;
    (Builder::new().stretch(1.5).build(&mesh).expect("a tree"), mesh.positions)
}

fn with_bus<T>(tree: &[u8], use_it: impl FnOnce(&mut TheBus<'_, '_>) -> T) -> T {
    let surface: Surface<VERTICES, PosedRows> = Surface::new();
    let mac = AesCmac::new(&KEY, RECEIVER, CHALLENGE);
    let ends = surface.start_with_mac(TreeBytes::<u16>::new(tree), LIMITS, mac);
    let (mut bus, _): Ends<'_, '_> = ends.expect("valid");
    use_it(&mut bus)
}

fn take(bus: &mut TheBus<'_, '_>, packet: &[u8], now: u32) -> Result<u32, ReceiveError> {
    let outcome = bus.packet(packet, Millis(now));
    bus.work(10_000).expect("a good surface");
    outcome.map(|_| epoch(bus))
}

fn epoch(bus: &TheBus<'_, '_>) -> u32 {
    bus.surface().and_then(|surface| surface.epoch()).unwrap_or(0)
}

fn program(folder: &Path) -> PathBuf {
    let program = folder.join("tags");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=gnu11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/tags.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    program
}

fn frame<M: Mac>(tree: &BuiltTree, at: &[Vec3], epoch: u32, mac: M) -> Vec<Vec<u8>> {
    let mesh_id = tree.tree::<u16>().expect("a tree").mesh_id();
    let (rows, id) = (tree.to_rows(at), FrameId { mesh_id, session: 1, epoch });
    let frame = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("a frame");
    let (mut frame, mut buffer, mut packets) =
        (frame.with_mac(mac).expect("fits"), [0; 256], Vec::new());
    while let Some(packet) = frame.next_packet(&mut buffer) {
        packets.push(packet.to_vec());
    }
    packets
}

/// Frames of Rust: good, of another key, receiver or challenge, without tags, and repeated. C's bus and receiver
/// publish and count what Rust's bus does, and the bus's status has Rust's bits, its tag among them.
#[test]
fn packets_of_rust_have_the_same_outcomes_in_c() {
    let folder = tempfile::tempdir().expect("a folder");
    let (tree, at) = heart();
    let mac = |key, receiver, challenge| AesCmac::new(key, receiver, challenge);
    let good = || mac(&KEY, RECEIVER, CHALLENGE);
    let (first, second) = (frame(&tree, &at, 1, good()), frame(&tree, &at, 2, good()));
    let packets = [
        first.clone(),
        frame(&tree, &at, 3, mac(b"another's guess.", RECEIVER, CHALLENGE)),
        frame(&tree, &at, 4, mac(&KEY, RECEIVER + 1, CHALLENGE)),
        frame(&tree, &at, 5, mac(&KEY, RECEIVER, 1)),
        frame(&tree, &at, 6, NoMac),
        second.clone(),
        first,
        second,
    ]
    .concat();

    let (mut expected, mut script) = (Vec::new(), Vec::new());
    let [forged, stale] = with_bus(tree.blob(), |bus| {
        for (packet, now) in packets.iter().zip(1_000..) {
            let outcome = take(bus, packet, now);
            let is_forged = matches!(outcome, Err(ReceiveError::Forged { .. }));
            expected.push((outcome.is_ok(), is_forged, epoch(bus)));
            script.extend((packet.len() as u32).to_le_bytes());
            script.extend(now.to_le_bytes());
            script.extend(packet);
        }
        let mut status = [0; 96];
        let status = bus.status(Millis(10_000), &mut status).expect("it is due");
        let hex: String = status.iter().map(|byte| format!("{byte:02x}")).collect();
        [Event::Forged, Event::Stale]
            .map(|event| bus.counters().of(event))
            .map(|n| (n, hex.clone()))
    });
    let status = &forged.1;
    assert!(forged.0 > 0 && stale.0 > 0 && expected.last() == Some(&(false, false, 2)));

    let [blob, sent] = ["tree", "packets"].map(|name| folder.path().join(name));
    fs::write(&blob, tree.blob()).expect("writable");
    fs::write(&sent, script).expect("writable");
    let said = run(Command::new(program(folder.path())).arg("receive").args([blob, sent]));
    assert!(said.contains(" 0 failures"), "{said}");
    let lines: Vec<&str> = said.lines().collect();
    for (line, (is_ok, is_forged, epoch)) in lines.iter().zip(&expected) {
        let (code, found) = line.split_once(' ').expect("two numbers");
        assert_eq!((code == "0", code == "404", found), (*is_ok, *is_forged, &*epoch.to_string()));
    }
    assert_eq!(lines[expected.len()], format!("status {status}"));
    assert_eq!(lines[expected.len() + 1], format!("forged {}, stale {}", forged.0, stale.0));
}

/// C's sender sends nothing before the receiver's challenge, which it asks for. C's bus then publishes its frame, and
/// none of senders with another key, receiver or challenge, or without a key. Rust's bus does the same with the same packets.
#[test]
fn frames_go_from_c_with_tags() {
    let folder = tempfile::tempdir().expect("a folder");
    let (tree, at) = heart();
    let [blob, positions, recording] =
        ["tree", "frame", "sent"].map(|name| folder.path().join(name));
    fs::write(&blob, tree.blob()).expect("writable");
    let floats = at.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes);
    fs::write(&positions, floats.collect::<Vec<u8>>()).expect("writable");
    let mut command = Command::new(program(folder.path()));
    let said = run(command.arg("send").args([&blob, &positions, &recording]));
    assert!(said.contains(" 0 failures"), "{said}");

    let sent = fs::read(recording).expect("a recording");
    with_bus(tree.blob(), |bus| {
        let (mut left, mut taken) = (&sent[..], 0);
        while let Some((words, rest)) = left.split_first_chunk::<8>() {
            let [length, now] = [0, 4].map(|at| {
                u32::from_le_bytes([words[at], words[at + 1], words[at + 2], words[at + 3]])
            });
            let (packet, rest) = rest.split_at(length as usize);
            taken += u32::from(take(bus, packet, now).is_ok());
            left = rest;
        }
        assert!(taken > 3 && bus.counters().of(Event::Published) == 1);
        assert!(bus.counters().of(Event::Forged) > 4);
        let rows = tree.to_rows(&at);
        let surface = bus.surface().expect("published");
        let worst = (0..)
            .zip(&rows)
            .map(|(row, at)| surface.position(row).map_or(f32::NAN, |found| found.distance(*at)));
        assert!(worst.fold(0.0, f32::max) < 0.01);
    });
}
