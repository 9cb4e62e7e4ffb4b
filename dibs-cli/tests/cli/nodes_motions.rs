//! The `dibs` program and motions of nodes, in each file format, and its errors for frames that do not fit the tree.

// Requirements: F-07, P-08

use std::net::UdpSocket;
use std::path::Path;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Motion, MotionStretch, Volume};

use crate::nodes::{curved, heart, msh, vtk, vtu};
use crate::program::{dibs, fails, json, succeeds};

/// A frame of the motion as nodes of a volume's file.
fn nodes(motion: &Motion, frame: usize) -> Vec<DVec3> {
    motion.frames[frame].iter().map(|at| at.as_dvec3()).collect()
}

#[test]
fn a_series_of_volumes_is_a_motion_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    let motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    let tetrahedra = volume.tetrahedra();
    for frame in 0..motion.frames.len() {
        let nodes = nodes(&motion, frame);
        for (format, text) in [
            ("vtk", vtk(&nodes, tetrahedra)),
            ("msh", msh(&nodes, tetrahedra)),
            ("vtu", vtu(&nodes, tetrahedra)),
        ] {
            std::fs::write(folder.join(format!("n_{frame:02}.{format}")), text).unwrap();
        }
    }
    std::fs::write(folder.join("tools.csv"), "sphere:0,0,120,5\n".repeat(200)).unwrap();
    let stretch = |motion: &str| {
        let line = format!("stretch heart.ply --nodes volume.vtk --motion {motion} --json");
        let told = json(folder, &line);
        (told["percentiles"].clone(), told["worst"].clone(), told["uniform_limit"].clone())
    };
    let build = |motion: &str| {
        let line = format!("build heart.ply -o h.dibs --nodes volume.vtk --motion {motion} --json");
        json(folder, &line)["tree"].clone()
    };
    let (needed, built) = (stretch("nodes.pc2"), build("nodes.pc2"));
    let track = |motion: &str| {
        succeeds(
            folder,
            &format!("track h.dibs --motion {motion} --motion-rate 30 --path tools.csv"),
        )
    };
    let tracked = track("nodes.pc2");
    for format in ["vtk", "msh", "vtu"] {
        let series = format!("n_%02d.{format}");
        assert_eq!(stretch(&series), needed, "{format}");
        assert_eq!(build(&series), built, "{format}");
        assert_eq!(track(&series), tracked, "{format}");
    }
}

/// Curved cells are refused. The remedy in the error is linear tetrahedra where the files are read as volumes, and flat
/// cells where they are read as surfaces.
#[test]
fn a_series_of_curved_cells_has_its_own_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    succeeds(folder, "build heart.ply -o h.dibs --nodes volume.vtk");
    std::fs::write(folder.join("tools.csv"), "sphere:0,0,120,5\n").unwrap();
    std::fs::write(folder.join("q_00.vtk"), curved(volume.nodes())).unwrap();
    let of_volume = "linear tetrahedra: in ParaView, the filter Tetrahedralize";
    for (line, part) in [
        ("stretch heart.ply --nodes volume.vtk --motion q_%02d.vtk", of_volume),
        ("build heart.ply -o i.dibs --nodes volume.vtk --motion q_%02d.vtk", of_volume),
        ("track h.dibs --motion q_%02d.vtk --motion-rate 30 --path tools.csv", of_volume),
        ("stream h.dibs --motion q_%02d.vtk --motion-rate 30 --to udp:127.0.0.1:9", of_volume),
        ("stretch heart.ply --motion q_%02d.vtk", "flat cells: in ParaView, the filter Extract"),
    ] {
        let error = fails(folder, line);
        assert!(error.starts_with("q_00.vtk: ") && error.contains(part), "{line}: {error}");
    }
}

/// Every format of a motion is a frame of a query.
#[test]
fn a_query_takes_a_frame_of_every_motion() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    succeeds(folder, "build heart.ply -o h.dibs --nodes volume.vtk");
    let motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    let numbers = motion.frames.iter().flatten().flat_map(Vec3::to_array);
    let numbers: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    let shape = format!("({}, {}, 3)", motion.frames.len(), volume.nodes().len());
    write_npy(&folder.join("nodes.npy"), &shape, &numbers);
    for frame in 0..motion.frames.len() {
        let text = vtu(&nodes(&motion, frame), volume.tetrahedra());
        std::fs::write(folder.join(format!("n_{frame:02}.vtu")), text).unwrap();
    }
    let ask = "query h.dibs --tool sphere:0,0,150,5 --json --frame 4 --vertices";
    let asked = json(folder, &format!("{ask} nodes.pc2"));
    assert!(asked["stretch"].as_f64().unwrap() > 1.01);
    for motion in ["nodes.npy", "n_%02d.vtu"] {
        assert_eq!(json(folder, &format!("{ask} {motion}")), asked, "{motion}");
    }

    // What is no motion of nodes is said of nodes.
    write_npy(&folder.join("flat.npy"), "(432, 3)", &numbers);
    let nan = [&f32::NAN.to_le_bytes()[..], &numbers[4..]].concat();
    write_npy(&folder.join("nan.npy"), &shape, &nan);
    let mut others = volume.tetrahedra().to_vec();
    others.reverse();
    let text = vtu(&nodes(&motion, 1), &others);
    std::fs::write(folder.join("n_01.vtu"), text).unwrap();
    for (motion, part) in [
        ("flat.npy", "of frames x vertices (or nodes) x 3"),
        ("nan.npy", "which is not a finite number; repair it, or export the file again"),
        ("n_%02d.vtu", "n_01.vtu: its triangles or tetrahedra are not those"),
    ] {
        let error = fails(folder, &format!("{ask} {motion}"));
        assert!(error.contains(part), "{motion}: {error}");
    }
}

/// A NumPy array of f32.
fn write_npy(path: &Path, shape: &str, numbers: &[u8]) {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(numbers);
    std::fs::write(path, bytes).unwrap();
}

/// The warnings of a command that succeeds.
fn warnings(folder: &Path, line: &str) -> Vec<String> {
    let output = dibs(folder, line);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{line}: {said}");
    said.lines().filter_map(|line| line.strip_prefix("warning: ")).map(str::to_owned).collect()
}

/// Limits are learned for a volume that does not hold the surface, with a warning in the words of `dibs build`.
#[test]
fn a_volume_far_from_its_surface_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    let far: Vec<DVec3> = volume.nodes().iter().map(|at| *at + DVec3::X * 1_000.0).collect();
    std::fs::write(folder.join("far.vtk"), vtk(&far, volume.tetrahedra())).unwrap();
    let refused = fails(folder, "build heart.ply -o h.dibs --nodes far.vtk");
    let warning = refused.replace("no tree can be built: ", "");
    assert!(warning.starts_with("far.vtk: vertex 0 (counted from 0) of the surface is outside"));
    for (nodes, expected) in [("volume.vtk", vec![]), ("far.vtk", vec![warning])] {
        let line = format!("stretch heart.ply --nodes {nodes} --motion nodes.pc2 --limits l");
        assert_eq!(warnings(folder, &line), expected, "{nodes}");
    }
}

/// The nodes that an error names, by their numbers in the volume's file.
fn named(error: &str) -> Vec<u32> {
    let part = error.split_once("the element of the nodes ");
    let part = part.and_then(|(_, rest)| rest.split_once(" (counted from 0) is "));
    let numbers = part.unwrap_or_else(|| panic!("{error}")).0.split(", ");
    let mut numbers: Vec<u32> = numbers.map(|node| node.parse().unwrap()).collect();
    numbers.sort_unstable();
    numbers
}

/// In a tree with a limit for each tetrahedron, `dibs query` tells the largest stretch of a tetrahedron, not its ratio to
/// the limit. It refuses a frame beyond a limit with the tetrahedron's nodes, its stretch and its limit.
#[test]
fn an_elements_own_stretch_and_limit_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    // A frame stretches one end by much, or the other.
    let write = |name: &str, stretched: fn(f64) -> f64| {
        let at = |at: &DVec3| (*at + DVec3::X * stretched(at.x)).as_vec3();
        let frames = vec![volume.nodes().iter().map(at).collect()];
        let motion = Motion { frames, rate: 30.0, ..Motion::default() };
        motion.write_pc2(folder.join(name)).unwrap();
        MotionStretch::of_nodes(&volume, &motion, &|_| ()).unwrap()
    };
    let learned = write("learned.pc2", |x| 0.4 * x.max(0.0));
    let beyond = write("beyond.pc2", |x| 0.6 * x.min(0.0));
    let line = "stretch heart.ply --nodes volume.vtk --motion learned.pc2 --limits h.limits";
    succeeds(folder, line);
    succeeds(folder, "build heart.ply -o h.dibs --nodes volume.vtk --limits h.limits");
    let limits = volume.read_limits(folder.join("h.limits")).unwrap();
    let ask = "query h.dibs --tool sphere:0,0,150,5";
    for (vertices, largest) in
        [("", 1.0), ("--vertices learned.pc2 --frame 0", learned.worst().stretch)]
    {
        let answer = json(folder, &format!("{ask} --json {vertices}"));
        let stretch = answer["stretch"].as_f64().unwrap();
        assert!((stretch - largest).abs() < 1e-5, "{vertices}: {stretch} {largest}");
    }

    let error = fails(folder, &format!("{ask} --vertices beyond.pc2 --frame 0"));
    let nodes = named(&error);
    let is_named = |corners: &[u32; 4]| {
        let mut corners = *corners;
        corners.sort_unstable();
        corners[..] == nodes
    };
    let element = volume.tetrahedra().iter().position(is_named).unwrap();
    let (needed, limit) = (beyond.triangles()[element].stretch, f64::from(limits[element]));
    assert!(limit < learned.worst().stretch, "{limit}");
    let told = error.split_once("is stretched by ").and_then(|(_, rest)| rest.split_once("; "));
    let (told, allowed) = told.unwrap().0.split_once(", the tree allows ").unwrap();
    let [told, allowed] = [told, allowed].map(|number| number.parse::<f64>().unwrap());
    assert!(
        (told - needed).abs() < 1e-4 && (allowed - limit).abs() < 2e-5,
        "{error}: {needed} {limit}"
    );
}

/// A motion whose frame 2 has an element inside out: one node of it is moved through the opposite face.
fn inverted(folder: &Path, volume: &Volume) -> [u32; 4] {
    let mut motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    motion.frames.truncate(4);
    let corners = volume.tetrahedra()[0];
    let [a, b, c, d] = corners.map(|node| motion.frames[2][node as usize]);
    motion.frames[2][corners[0] as usize] = a + 1.6 * ((b + c + d) / 3.0 - a);
    motion.write_pc2(folder.join("inverted.pc2")).unwrap();
    corners
}

#[test]
fn a_frame_that_turns_an_element_inside_out_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    succeeds(folder, "build heart.ply -o h.dibs --nodes volume.vtk --stretch 9");
    let corners = inverted(folder, &volume);
    std::fs::write(folder.join("tools.csv"), "sphere:0,0,120,5\n".repeat(200)).unwrap();
    std::fs::write(folder.join("page.html"), "<!--data-->").unwrap();
    let ask = "query h.dibs --tool sphere:0,0,150,5 --vertices";
    for line in [
        format!("{ask} inverted.pc2 --frame 2"),
        "track h.dibs --motion inverted.pc2 --path tools.csv".to_owned(),
        "view h.dibs --motion inverted.pc2 -o h.html --page page.html".to_owned(),
        "build heart.ply -o i.dibs --nodes volume.vtk --stretch 9 --motion inverted.pc2".to_owned(),
    ] {
        let error = fails(folder, &line);
        assert!(error.starts_with("inverted.pc2, frame 2: the element of "), "{line}: {error}");
        let part = "inverted or flat: no stretch limit admits that, mend the frame";
        assert!(error.contains(part) && !error.contains("--"), "{line}: {error}");
        // Its nodes have the numbers of the volume's file.
        let named = named(&error);
        assert!(named.len() == 4 && named.contains(&corners[0]), "{error}");
    }
    // It is sent with a warning: the receiver refuses it alone.
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = socket.local_addr().unwrap();
    let line = "build heart.ply -o i.dibs --nodes volume.vtk --stretch 9 --motion inverted.pc2";
    let refused = fails(folder, line);
    for (motion, expected) in [("nodes.pc2", vec![]), ("inverted.pc2", vec![refused])] {
        let line = format!("stream h.dibs --motion {motion} --motion-rate 500 --to udp:{to}");
        assert_eq!(warnings(folder, &line), expected, "{motion}");
    }
    // As a file of its own.
    let frame = nodes(&Motion::read(folder.join("inverted.pc2")).unwrap(), 2);
    std::fs::write(folder.join("inverted.vtk"), vtk(&frame, volume.tetrahedra())).unwrap();
    let error = fails(folder, &format!("{ask} inverted.vtk"));
    assert!(error.starts_with("inverted.vtk: the element of "), "{error}");

    // No limits are learned from it.
    let line = "stretch heart.ply --nodes volume.vtk --motion inverted.pc2 --limits i.limits";
    let error = fails(folder, line);
    let part = "inverted.pc2: frame 2 of the motion: turns the tetrahedron";
    assert!(error.starts_with(part) && error.contains("no stretch limit admits that"), "{error}");
    assert!(error.contains("all counted from 0"), "{error}");
    assert!(!folder.join("i.limits").exists());

    // Beyond the limit, a larger one is what helps, and the file is named too.
    succeeds(folder, "build heart.ply -o narrow.dibs --nodes volume.vtk --stretch 1.005");
    let ask = "query narrow.dibs --tool sphere:0,0,150,5 --vertices nodes.pc2 --frame 4";
    let error = fails(folder, ask);
    assert!(error.starts_with("nodes.pc2, frame 4: the element of "), "{error}");
    assert_eq!(named(&error).len(), 4);
    assert!(error.contains("a larger --stretch"), "{error}");
}

#[test]
fn another_count_of_nodes_is_said_of_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    succeeds(folder, "build heart.ply -o h.dibs --nodes volume.vtk");
    let mut motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    motion.frames.iter_mut().for_each(|frame| frame.truncate(30));
    motion.write_pc2(folder.join("fewer.pc2")).unwrap();
    let error = fails(folder, "stream h.dibs --motion fewer.pc2 --to udp:127.0.0.1:9");
    assert!(
        error.contains("fewer.pc2, frame 0: the frame has 30 points and the tree has 36 nodes"),
        "{error}"
    );
    let error = fails(folder, "stretch heart.ply --nodes volume.vtk --motion fewer.pc2");
    let part = "fewer.pc2: frame 0 of the motion has 30 points and the volume has 36 nodes";
    assert!(error.contains(part), "{error}");
}
