//! `dibs bridge --tool … --tool-device …`: each message of a tracked tool is answered on the surface that was sent last.

// Requirement: P-08

use std::io::{Read, Write, copy, sink};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::glam::{Quat, Vec3};
use serde_json::Value;

use super::igtl::{accepted, organ};
use super::igtl_messages::{array, array_in_metres, message};
use super::igtl_pose::{as_given, pose_message};
use super::{PATIENCE, heart, program, spawn};

const KINDS: [&str; 3] = ["TRANSFORM", "TDATA", "QTDATA"];

/// A bridge's peer.
struct Peer(TcpStream);

impl Peer {
    fn send(&mut self, messages: &[Vec<u8>]) {
        self.0.write_all(&messages.concat()).unwrap();
    }

    /// The next STRING of the tool.
    fn said(&mut self) -> String {
        loop {
            let mut header = [0; 58];
            self.0.read_exact(&mut header).unwrap();
            let mut body = vec![0; u64::from_be_bytes(header[42..50].try_into().unwrap()) as usize];
            self.0.read_exact(&mut body).unwrap();
            if header[2..14] == *b"STRING\0\0\0\0\0\0" {
                assert_eq!(header[14..34], *b"pointer\0\0\0\0\0\0\0\0\0\0\0\0\0");
                assert_eq!(body[..4], [[0, 3], (body.len() as u16 - 4).to_be_bytes()].concat());
                return String::from_utf8(body[4..].to_vec()).unwrap();
            }
        }
    }

    /// Sends these until the answer is as it should be.
    fn until(&mut self, messages: impl Fn(u32) -> Vec<Vec<u8>>, is_it: impl Fn(&str) -> bool) {
        let start = Instant::now();
        for number in 0.. {
            self.send(&messages(number));
            let said = self.said();
            if is_it(&said) {
                return;
            }
            assert!(start.elapsed() < PATIENCE / 3, "{said}");
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// The lines that a bridge prints, and the rest of its output, which are the totals of so many frames.
fn answered(
    folder: &Path,
    line: &str,
    source: impl FnOnce(&mut Peer) + Send,
) -> (Vec<Value>, Value, Output) {
    let [server, receiver] = [0; 2].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let [from, to] = [&server, &receiver].map(|socket| socket.local_addr().unwrap());
    let line = format!("--to tcp:{to} --from igtl:{from} --retry 2 --tool-device pointer {line}");
    let child = spawn(folder, &line);
    let (mut socket, _) = receiver.accept().unwrap();
    thread::scope(|scope| {
        // A source that fails takes the server with it, and the bridge ends.
        let source = scope.spawn(move || {
            let mut peer = Peer(accepted(&server));
            source(&mut peer);
            peer
        });
        scope.spawn(move || copy(&mut socket, &mut sink()));
        let output = child.wait_with_output().unwrap();
        drop(source.join().unwrap());
        let notes = String::from_utf8_lossy(&output.stderr);
        let totals = notes.find("\n{\n").map_or(0, |at| at + 1);
        let totals = serde_json::from_str(&notes[totals..]).expect(&notes);
        let lines = String::from_utf8_lossy(&output.stdout);
        let lines = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        (lines, totals, output)
    })
}

/// What `dibs query` answers about a frame.
pub fn queried(folder: &Path, tool: &str, frame: usize) -> Value {
    let line =
        format!("query heart.dibs --vertices heart.pc2 --frame {frame} --json --tool {tool}");
    let output = program(folder, &line).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// How an answer begins that has this separation.
pub fn text(answer: &Value) -> String {
    let side = answer["side"].as_str().unwrap();
    format!("{:.2} mm, {side}, surface ", answer["separation"].as_f64().unwrap())
}

/// Poses of all three types, on one frame after the other: to the bit what `dibs query` answers.
#[test]
fn a_tracked_tool_is_answered_like_a_query() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let asked = [4, 9, 14].map(|frame| queried(folder, "100,-20,30,140.5,-20,80,2.5", frame));
    let line = "--tool 0,0,0,40.5,0,50,2.5 --tool-age 60000 --frames 4";
    let (lines, totals, _) = answered(folder, line, |peer| {
        for ((frame, asked), kind) in [4, 9, 14].into_iter().zip(&asked).zip(KINDS) {
            let pose = as_given(kind, "pointer", Quat::IDENTITY, Vec3::new(100.0, -20.0, 30.0));
            peer.send(&[message(1, "NDARRAY", "heart", &array(&frames[frame]))]);
            peer.until(|_| vec![pose.clone()], |said| said.starts_with(&text(asked)));
        }
        // Neither another device's pose nor one that lacks the tool's is answered.
        let others = KINDS.map(|kind| as_given(kind, "probe", Quat::IDENTITY, Vec3::ZERO));
        peer.send(&others);
        peer.send(&[message(1, "NDARRAY", "heart", &array(&frames[0]))]);
    });
    for asked in &asked {
        let is_it = |line: &&Value| line["separation"] == asked["separation"];
        let line = lines.iter().find(is_it).expect("an answer");
        for (field, value) in asked.as_object().unwrap() {
            assert_eq!(line[field], *value, "{field}");
        }
        assert_eq!(line["device"], "pointer");
        assert!(line["age_ms"].as_f64().unwrap() > 0.0, "{line}");
        assert!(line["tool_age_ms"].as_f64().unwrap() >= 0.0 && line["refused"].is_null());
    }
    let source = &totals["source"];
    assert_eq!((&source["passed"], &source["poses"]), (&3.into(), &lines.len().into()), "{totals}");
    assert_eq!(totals["frames"], 4);
}

/// In metres and RAS, beside a surface with a pose in the same messages: the answer is in the world's coordinates.
#[test]
fn units_axes_and_the_surface_s_pose_count() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let turn = Quat::from_scaled_axis(Vec3::new(0.2, -0.5, 0.9));
    let shift = Vec3::new(30.0, -400.0, 12.0);
    // Where the tool is relative to the organ.
    let (inner, at) =
        (Quat::from_scaled_axis(Vec3::new(1.0, 0.3, 0.0)), Vec3::new(95.0, 10.0, 20.0));
    let world = |point: Vec3| turn * point + shift;
    // Half a turn about S leads from the tool's own frame, which no axes convert, to LPS.
    let [tip, end] = [Vec3::new(3.0, -4.0, 1.0), Vec3::new(3.0, -4.0, 90.0)]
        .map(|own| inner * Vec3::new(-own.x, -own.y, own.z) + at);
    let tool = format!("{},{},{},{},{},{},2", tip.x, tip.y, tip.z, end.x, end.y, end.z);
    let asked = queried(folder, &tool, 7);
    let line = "--tool 3,-4,1,3,-4,90,2 --tool-age 60000 --frames 2 --pose-device organ --unit m --axes RAS:LPS";
    let (lines, ..) = answered(folder, line, |peer| {
        let turned: Vec<Vec3> = frames[7].iter().map(|at| Vec3::new(-at.x, -at.y, at.z)).collect();
        let frame = message(1, "NDARRAY", "heart", &array_in_metres(&turned));
        let poses = |_| vec![pose_message("QTDATA", "pointer", turn * inner, world(at))];
        peer.send(&[pose_message("TDATA", "organ", turn, shift), frame.clone()]);
        peer.until(poses, |said| said.starts_with(&text(&asked)));
        peer.send(&[frame]);
    });
    let line = lines.iter().find(|line| !line["separation"].is_null()).expect("an answer");
    let vector = |line: &Value, field: &str| {
        Vec3::from_array([0, 1, 2].map(|axis| line[field][axis].as_f64().unwrap() as f32))
    };
    assert_eq!((&line["triangle"], &line["side"]), (&asked["triangle"], &asked["side"]));
    for field in ["point_on_surface", "point_on_tool"] {
        let off = vector(line, field).distance(world(vector(&asked, field)));
        assert!(off < 2e-3, "{field} {off}");
    }
    let direction = turn * vector(&asked, "direction");
    assert!(vector(line, "direction").abs_diff_eq(direction, 1e-4), "{line}");
}

/// Before the first surface, for a matrix that is no rotation, for a surface or a tool that is too old: no separation, and
/// why. After a refused surface the answer is about the one before it, and says so.
#[test]
fn an_old_answer_is_never_a_new_one() {
    const AGE: u64 = 1_500;
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let pose = |number: u32| {
        let shift = Vec3::new(100.0, 0.0, 30.0 + number as f32 * 1e-3);
        as_given("TRANSFORM", "pointer", Quat::IDENTITY, shift)
    };
    let frame = |number: usize| message(1, "NDARRAY", "heart", &array(&frames[number]));
    let line = format!("--tool sphere:0,0,0,2.5 --tool-age {AGE} --frames 3");
    let (lines, totals, output) = answered(folder, &line, |peer| {
        let said = |peer: &mut Peer, messages: &[Vec<u8>]| {
            peer.send(messages);
            peer.said()
        };
        assert_eq!(said(peer, &[pose(1_000)]), "no surface was sent yet");
        let mut mirrored = [0.0_f32; 12];
        (mirrored[0], mirrored[4], mirrored[8]) = (1.0, 1.0, -1.0);
        let mirrored: Vec<u8> = mirrored.iter().flat_map(|x| x.to_be_bytes()).collect();
        let mirrored = message(1, "TRANSFORM", "pointer", &mirrored);
        let mut damaged = pose(0);
        *damaged.last_mut().unwrap() ^= 1;
        peer.send(&[frame(0)]);
        peer.until(|number| vec![pose(number)], |said| said.contains(" mm, outside, surface "));
        assert!(said(peer, &[mirrored]).contains("no rotation"));
        assert!(said(peer, &[damaged]).contains("checksum"));
        // Too few points, and triangles of another mesh.
        let short = message(1, "NDARRAY", "heart", &array(&frames[1][..300]));
        assert!(said(peer, &[short, pose(2_000)]).contains(" mm, outside, surface "));
        thread::sleep(Duration::from_millis(AGE + 300));
        let stale = said(peer, &[pose(3_000)]);
        assert!(stale.starts_with("the surface is ") && stale.contains("--tool-age"), "{stale}");
        // The same pose once more, without a time of its own, is as old as it was.
        thread::sleep(Duration::from_millis(AGE + 300));
        peer.send(&[frame(2)]);
        let frozen = said(peer, &[pose(3_000)]);
        assert!(frozen.starts_with("the tool's pose is "), "{frozen}");
        // The next frame would replace this one if it were not sent yet, and the bridge would wait for a third.
        peer.until(
            |number| vec![pose(4_000 + number)],
            |said| said.contains(" mm, outside, surface "),
        );
        peer.send(&[frame(3)]);
    });
    let notes = String::from_utf8_lossy(&output.stderr);
    for line in &lines {
        assert!(line["separation"].is_null() == line["reason"].is_string(), "{line}");
        let is_far = line["age_ms"].as_f64().is_some_and(|age| age > AGE as f64);
        assert!(!is_far || line["separation"].is_null(), "{line}");
    }
    let refused = lines.iter().filter(|line| line["refused"] == "frame").count();
    assert!(refused >= 2, "{notes}");
    assert!(lines.iter().any(|line| line["refused"] == "frame" && !line["separation"].is_null()));
    let causes = &totals["source"]["refused"];
    assert_eq!(
        (&causes["pose"], &causes["checksum"], &causes["frame"]),
        (&1.into(), &1.into(), &1.into())
    );
}

/// A tool needs a device, and devices are OpenIGTLink's.
#[test]
fn a_tool_needs_its_device() {
    let folder = heart();
    for (line, why) in [
        ("--from igtl:127.0.0.1:1 --tool 0,0,0,1", "--tool-device"),
        ("--from igtl:127.0.0.1:1 --tool-device pointer", "--tool "),
        ("--from - --tool 0,0,0,1 --tool-device pointer", "only OpenIGTLink has devices"),
        ("--from igtl:127.0.0.1:1 --tool 0,0,1 --tool-device pointer", "3 numbers are no tool"),
    ] {
        let line = format!("bridge heart.dibs --to tcp:127.0.0.1:1 {line}");
        let output = program(folder.path(), &line).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(why), "{line}: {said}");
    }
}
