//! `dibs bridge` beside other programs' messages, on request: of `pyigtl`, and of the C++ library OpenIGTLink.

// Requirement: B-10

use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};

use dibs_build::glam::Vec3;

use super::igtl::{bridged, organ};
use super::{FRAMES, assert_all, heart, totals};

/// A server of frames that a file has: big-endian f32, and the triangles as u32.
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
for frame in frames:
    if kind == 'POLYDATA':
        message = pyigtl.PolyDataMessage(points=frame, polygons=polygons, device_name='heart')
    else:
        message = pyigtl.PointMessage(positions=frame, device_name='heart')
    message.header_version = 2 if kind == 'POLYDATA' else 1
    server.send_message(message, wait=True)
time.sleep(60)
";

#[test]
#[ignore = "needs DIBS_PYIGTL, a Python with pyigtl 0.3.4 and numpy"]
fn frames_of_pyigtl_arrive() {
    let python = std::env::var("DIBS_PYIGTL").expect("DIBS_PYIGTL: a Python with pyigtl");
    for kind in ["POLYDATA", "POINT"] {
        arrive(Command::new(&python).args(["-c", SERVER]), kind);
    }
}

#[test]
#[ignore = "needs g++ and Debian's libopenigtlink-dev 1.11"]
fn frames_of_the_cpp_library_arrive() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/stream/igtl_server.cpp");
    let folder = tempfile::tempdir().unwrap();
    let server = folder.path().join("server");
    let mut compiler = Command::new("g++");
    compiler.args(["-std=c++17", "-I/usr/include/openigtlink", "-o"]).args([&server, &source]);
    assert!(compiler.arg("-lOpenIGTLink").status().unwrap().success());
    for kind in ["POLYDATA", "POINT", "NDARRAY"] {
        arrive(&mut Command::new(&server), kind);
    }
}

/// Every frame of a server's messages reaches the receiver as it was.
fn arrive(server: &mut Command, kind: &str) {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let mut data: Vec<u8> = triangles.iter().flatten().flat_map(|x| x.to_be_bytes()).collect();
    data.extend(frames.iter().flatten().flat_map(Vec3::to_array).flat_map(f32::to_be_bytes));
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (count, corners) = (FRAMES.to_string(), triangles.len().to_string());
    server.args([&port.to_string(), &count, &corners, kind]);
    let mut server = server.stdin(Stdio::piped()).spawn().unwrap();
    server.stdin.take().unwrap().write_all(&data).unwrap();
    let (seen, output, ()) = bridged(folder, &format!("--from igtl:127.0.0.1:{port}"), || ());
    server.kill().unwrap();
    server.wait().unwrap();
    assert_all(&seen, &totals(&output));
    assert_eq!(seen.error, 0.0, "{kind}");
}
