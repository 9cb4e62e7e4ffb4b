//! `dibs bridge` beside other programs' messages, on request: of `pyigtl`, and of the C++ library OpenIGTLink.

// Requirement: B-10

use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use dibs_build::glam::Vec3;
use serde_json::Value;

use super::igtl::{bridged, organ};
use super::igtl_tool::{queried, text};
use super::receiver::Seen;
use super::{FRAMES, assert_all, heart, totals};

/// A server of frames that a file has: big-endian f32, and the triangles as u32. For TRANSFORM a tool's pose comes before
/// each, and the answers are printed.
const SERVER: &str = "
import sys, time
import numpy as np, pyigtl
port, count, triangles, kind = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
data = sys.stdin.buffer.read()
faces = np.frombuffer(data, '>u4', 3 * triangles).reshape(-1, 3)
frames = np.frombuffer(data, '>f4', offset=12 * triangles).reshape(count, -1, 3)
polygons = np.insert(faces, 0, 3, axis=1).reshape(-1)
server = pyigtl.OpenIGTLinkServer(port=port)
while not server.is_connected():
    time.sleep(0.01)
pose = np.array([[0, -1, 0, 100], [1, 0, 0, -20], [0, 0, 1, 30], [0, 0, 0, 1]])
for frame in frames:
    if kind == 'TRANSFORM':
        server.send_message(pyigtl.TransformMessage(matrix=pose, device_name='pointer'), wait=True)
        print(server.wait_for_message('pointer').string, flush=True)
    if kind == 'POINT':
        message = pyigtl.PointMessage(positions=frame, device_name='heart')
    else:
        message = pyigtl.PolyDataMessage(points=frame, polygons=polygons, device_name='heart')
    message.header_version = 1 if kind == 'POINT' else 2
    server.send_message(message, wait=True)
time.sleep(60)
";

#[test]
#[ignore = "needs DIBS_PYIGTL, a Python with pyigtl 0.3.4 and numpy"]
fn frames_of_pyigtl_arrive() {
    pyigtl();
}

#[test]
#[ignore = "needs g++ and Debian's libopenigtlink-dev 1.11"]
fn frames_of_the_cpp_library_arrive() {
    cpp_library();
}

#[test]
#[ignore = "needs the registry of crates, to build a program of the crate openigtlink-rust"]
fn frames_of_the_rust_crate_arrive() {
    rust_crate();
}

/// A library whose frames arrived.
pub struct Peer {
    pub name: &'static str,
    pub version: String,
    /// The types of its messages.
    pub kinds: &'static [&'static str],
}

pub fn pyigtl() -> Peer {
    let python = std::env::var("DIBS_PYIGTL").expect("DIBS_PYIGTL: a Python with pyigtl");
    let server = || {
        let mut server = Command::new(&python);
        server.args(["-c", SERVER]);
        server
    };
    ["POLYDATA", "POINT"].iter().for_each(|kind| arrive(&mut server(), kind));
    answered(&mut server(), "TRANSFORM", "100,-20,30,100,20.5,80,2.5");
    let version = "import importlib.metadata as found; print(found.version('pyigtl'))";
    let version = said(Command::new(&python).args(["-c", version]));
    Peer { name: "pyigtl", version, kinds: &["POLYDATA", "POINT", "TRANSFORM"] }
}

pub fn cpp_library() -> Peer {
    let folder = tempfile::tempdir().unwrap();
    let server = folder.path().join("server");
    let mut compiler = Command::new("g++");
    compiler.args(["-std=c++17", "-I/usr/include/openigtlink", "-o"]);
    compiler.args([&server, &own("igtl_server.cpp")]);
    assert!(compiler.arg("-lOpenIGTLink").status().unwrap().success());
    ["POLYDATA", "POINT", "NDARRAY"]
        .iter()
        .for_each(|kind| arrive(&mut Command::new(&server), kind));
    let turned = "100,-20,30,59.5,-20,80,2.5";
    ["TRANSFORM", "TDATA", "QTDATA"]
        .iter()
        .for_each(|kind| answered(&mut Command::new(&server), kind, turned));
    let kinds = &["POLYDATA", "POINT", "NDARRAY", "TRANSFORM", "TDATA", "QTDATA"];
    let version =
        said(Command::new("dpkg-query").args(["-W", "-f", "${Version}", "libopenigtlink-dev"]));
    Peer { name: "Debian's libopenigtlink", version, kinds }
}

pub fn rust_crate() -> Peer {
    const VERSION: &str = "0.4.1";
    // A package of its own: none of the product's depends on the crate, or on what that depends on.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("igtl-rust");
    let manifest = format!(
        "[package]\nname = \"igtl-server\"\nversion = \"0.0.0\"\nedition = \"2021\"\n[dependencies]\n\
         openigtlink-rust = \"={VERSION}\"\n[workspace]\n"
    );
    fs::create_dir_all(folder.join("src")).unwrap();
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    fs::copy(own("igtl_server.rs"), folder.join("src/main.rs")).unwrap();
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--quiet", "--target-dir", "target"]).current_dir(&folder);
    assert!(cargo.status().unwrap().success());
    let server = folder.join("target/debug/igtl-server");
    // Its POLYDATA is not the protocol's.
    let kinds = &["POINT", "NDARRAY"];
    kinds.iter().for_each(|kind| arrive(&mut Command::new(&server), kind));
    Peer { name: "crate openigtlink-rust", version: VERSION.to_owned(), kinds }
}

/// A file beside this one.
fn own(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/stream").join(name)
}

/// What a command says.
pub fn said(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Every frame of a server's messages reaches the receiver as it was.
fn arrive(server: &mut Command, kind: &str) {
    let folder = heart();
    let (seen, output, _) = served(folder.path(), "", server, kind);
    assert_all(&seen, &totals(&output));
    assert_eq!(seen.error, 0.0, "{kind}");
}

/// Each pose of a tool, a turn about z and a shift, is answered as `dibs query` does about a frame with the tool `turned`, and
/// the server reads that.
fn answered(server: &mut Command, kind: &str, turned: &str) {
    let folder = heart();
    let folder = folder.path();
    let asked = |frame| queried(folder, turned, frame);
    let asked: Vec<Value> = (0..FRAMES).map(asked).collect();
    let line = "--tool 0,0,0,40.5,0,50,2.5 --tool-device pointer --tool-age 60000";
    let (seen, output, said) = served(folder, line, server, kind);
    assert_eq!((seen.published, seen.error), (FRAMES as u32, 0.0));
    let lines = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((lines.len(), said.lines().count()), (FRAMES, FRAMES), "{said}");
    let mut found = 0;
    for (line, said) in lines.iter().zip(said.lines()) {
        if line["separation"].is_null() {
            assert_eq!(line["reason"], said);
            continue;
        }
        let asked = asked.iter().find(|asked| asked["separation"] == line["separation"]);
        let asked = asked.unwrap_or_else(|| panic!("of no frame: {line}"));
        for (field, value) in asked.as_object().unwrap() {
            assert_eq!(line[field], *value, "{field}");
        }
        assert!(said.starts_with(&text(asked)), "{said}: {line}");
        found += 1;
    }
    // Those before the first surface have none.
    assert!(found > FRAMES / 2, "{found}: {said}");
}

/// Runs a bridge with the options `line`, connected to an OpenIGTLink server that sends messages of this kind. Returns what
/// the bridge's receiver saw, the bridge's output, and what the server printed.
fn served(folder: &Path, line: &str, server: &mut Command, kind: &str) -> (Seen, Output, String) {
    let (frames, triangles) = organ(folder);
    let mut data: Vec<u8> = triangles.iter().flatten().flat_map(|x| x.to_be_bytes()).collect();
    data.extend(frames.iter().flatten().flat_map(Vec3::to_array).flat_map(f32::to_be_bytes));
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (count, corners) = (FRAMES.to_string(), triangles.len().to_string());
    server.args([&port.to_string(), &count, &corners, kind]);
    let mut server = server.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    server.stdin.take().unwrap().write_all(&data).unwrap();
    let line = format!("--from igtl:127.0.0.1:{port} {line}");
    let (seen, output, ()) = bridged(folder, &line, || ());
    server.kill().unwrap();
    let said = server.wait_with_output().unwrap().stdout;
    (seen, output, String::from_utf8(said).unwrap())
}
