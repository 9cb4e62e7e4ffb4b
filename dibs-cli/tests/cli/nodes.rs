//! The `dibs` program and surfaces that the nodes of a volume move.

// Requirements: F-07, P-08

use std::fmt::Write as _;
use std::net::UdpSocket;
use std::path::Path;
use std::time::Duration;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Motion, Volume};
use dibs_nostd::nodes::{NodeMonitor, Nodes};
use dibs_nostd::{Advance, Assembler, Frames, Millis, SurfaceLimits, Tree, VertexTable};

use crate::program::{dibs, fails, json, succeeds};

/// Nodes of the lattice below.
const NODES: usize = 36;

/// A volume as a legacy VTK file.
pub fn vtk(nodes: &[DVec3], tetrahedra: &[[u32; 4]]) -> String {
    let mut text =
        "# vtk DataFile Version 3.0\nvolume\nASCII\nDATASET UNSTRUCTURED_GRID\n".to_owned();
    let _ = writeln!(text, "POINTS {} double", nodes.len());
    for at in nodes {
        let _ = writeln!(text, "{} {} {}", at.x, at.y, at.z);
    }
    let _ = writeln!(text, "CELLS {} {}", tetrahedra.len(), 5 * tetrahedra.len());
    for [a, b, c, d] in tetrahedra {
        let _ = writeln!(text, "4 {a} {b} {c} {d}");
    }
    let _ = writeln!(text, "CELL_TYPES {}", tetrahedra.len());
    tetrahedra.iter().for_each(|_| text.push_str("10\n"));
    text
}

/// The same as a Gmsh file of version 2.2.
pub fn msh(nodes: &[DVec3], tetrahedra: &[[u32; 4]]) -> String {
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n".to_owned();
    let _ = writeln!(text, "{}", nodes.len());
    for (number, at) in (1..).zip(nodes) {
        let _ = writeln!(text, "{number} {} {} {}", at.x, at.y, at.z);
    }
    let _ = writeln!(text, "$EndNodes\n$Elements\n{}", tetrahedra.len());
    for (number, [a, b, c, d]) in (1..).zip(tetrahedra) {
        let _ = writeln!(text, "{number} 4 2 0 1 {} {} {} {}", a + 1, b + 1, c + 1, d + 1);
    }
    text + "$EndElements\n"
}

/// The same as a VTK file in XML.
pub fn vtu(nodes: &[DVec3], tetrahedra: &[[u32; 4]]) -> String {
    let numbers = |numbers: &mut dyn Iterator<Item = String>| numbers.collect::<Vec<_>>().join(" ");
    let array = |name: &str, kind: &str, values: String| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"1\" format=\"ascii\">{values}</DataArray>"
        )
    };
    let points = numbers(&mut nodes.iter().map(|at| format!("{} {} {}", at.x, at.y, at.z)));
    let points = array("Points", "Float64", points).replace("\"1\"", "\"3\"");
    let corners = numbers(&mut tetrahedra.iter().flatten().map(u32::to_string));
    let ends = numbers(&mut (1..=tetrahedra.len()).map(|count| (4 * count).to_string()));
    let kinds = numbers(&mut tetrahedra.iter().map(|_| "10".to_owned()));
    let cells = array("connectivity", "Int64", corners)
        + &array("offsets", "Int64", ends)
        + &array("types", "UInt8", kinds);
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\"><Points>{points}</Points><Cells>{cells}</Cells></Piece>\
         </UnstructuredGrid></VTKFile>",
        nodes.len(),
        tetrahedra.len()
    )
}

/// A legacy VTK file with one tetrahedron of second order.
pub fn curved(nodes: &[DVec3]) -> String {
    let cell = "CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9";
    vtk(nodes, &[[0, 1, 2, 3]]).replace("CELLS 1 5\n4 0 1 2 3", cell).replace("\n10\n", "\n24\n")
}

/// A heart, a volume around it in three formats, and a motion of its nodes.
pub fn heart(folder: &Path) -> Volume {
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply");
    let mesh = dibs_build::read(folder.join("heart.ply")).unwrap().mesh;
    let volume = Volume::lattice(&mesh, [2, 2, 3]).unwrap();
    let (nodes, tetrahedra) = (volume.nodes(), volume.tetrahedra());
    std::fs::write(folder.join("volume.vtk"), vtk(nodes, tetrahedra)).unwrap();
    std::fs::write(folder.join("volume.msh"), msh(nodes, tetrahedra)).unwrap();
    std::fs::write(folder.join("volume.vtu"), vtu(nodes, tetrahedra)).unwrap();
    let frame = |number: usize| {
        let by = 4.0 * (number as f64 * 0.4).sin();
        let at = |node: &DVec3| (*node + DVec3::Z * by * node.x / 60.0).as_vec3();
        nodes.iter().map(at).collect::<Vec<Vec3>>()
    };
    let motion = Motion { frames: (0..12).map(frame).collect(), rate: 30.0, ..Motion::default() };
    motion.write_pc2(folder.join("nodes.pc2")).unwrap();
    volume
}

#[test]
fn trees_with_nodes_are_built_asked_and_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    let mut answers = Vec::new();
    for nodes in ["volume.vtk", "volume.msh", "volume.vtu", "lattice:2,2,3"] {
        let line =
            format!("build heart.ply -o heart.dibs --nodes {nodes} --motion nodes.pc2 --json");
        let built = json(folder, &line);
        assert_eq!(built["tree"]["volume"]["nodes"], NODES);
        assert_eq!(built["tree"]["volume"]["tetrahedra"], 72);
        assert_eq!(json(folder, "inspect heart.dibs --json"), built["tree"]);
        assert!(succeeds(folder, "inspect heart.dibs").contains("nodes    36 of 72 tetrahedra"));
        let ask = "query heart.dibs --tool sphere:0,0,150,5 --json";
        let at_rest = json(folder, ask);
        let moved = json(folder, &format!("{ask} --vertices nodes.pc2 --frame 4"));
        assert_eq!(
            (&at_rest["coverage"], &moved["coverage"]),
            (&"measured".into(), &"measured".into())
        );
        assert!(at_rest["stretch"].as_f64().unwrap() < 1.001);
        assert!(moved["stretch"].as_f64().unwrap() > 1.01);
        // The volume's own file is a frame, too.
        let file = json(folder, &format!("{ask} --vertices volume.vtk"));
        assert_eq!(file["separation"], at_rest["separation"]);
        answers.push((at_rest["separation"].clone(), moved["separation"].clone()));
    }
    assert!(answers.iter().all(|answer| *answer == answers[0]), "{answers:?}");
    // Another hierarchy over the same surface.
    succeeds(folder, "build heart.ply -o paper.dibs --nodes volume.vtu --construction paper");
    let ask = "query paper.dibs --tool sphere:0,0,150,5 --json";
    let moved = json(folder, &format!("{ask} --vertices nodes.pc2 --frame 4"));
    for (asked, answer) in [(json(folder, ask), &answers[0].0), (moved, &answers[0].1)] {
        let [asked, answer] = [&asked["separation"], answer].map(|of| of.as_f64().unwrap());
        assert!((asked - answer).abs() < 1e-3, "{asked} {answer}");
    }

    // Limits of each tetrahedron.
    let line = "stretch heart.ply --nodes volume.msh --motion nodes.pc2 --margin 0.05 --limits heart.limits";
    let told = succeeds(folder, line);
    assert!(told.contains("written  heart.limits: a limit for each tetrahedron"), "{told}");
    let learned = json(folder, &format!("{line} --json"));
    assert_eq!(learned["worst"][0]["nodes"].as_array().unwrap().len(), 4);
    let line =
        "build heart.ply -o learned.dibs --limits heart.limits --motion nodes.pc2 --json --nodes";
    let tree = json(folder, &format!("{line} volume.msh"));
    let stated = |limit: &serde_json::Value| limit.as_f64().unwrap();
    assert_eq!(stated(&tree["tree"]["stretch"]), stated(&learned["uniform_limit"]));
    let error = fails(folder, &format!("{line} lattice:2,2,2"));
    assert!(error.contains("heart.limits: is of mesh"), "{error}");
    let told = succeeds(folder, "inspect learned.dibs");
    let [least, most] =
        ["least_stretch_limit", "stretch"].map(|name| stated(&tree["tree"][name]) as f32);
    assert!(told.contains(&format!("limits {least} to {most} of tetrahedra")), "{told}");
    assert!(least < most, "{least} {most}");
    let uniform = json(folder, "inspect heart.dibs --json");
    assert_eq!(uniform["least_stretch_limit"], uniform["stretch"]);

    // A volume that vertices stick out of.
    let smaller: Vec<DVec3> = volume.nodes().iter().map(|at| *at * 0.97).collect();
    std::fs::write(folder.join("smaller.vtk"), vtk(&smaller, volume.tetrahedra())).unwrap();
    let bound = "build heart.ply -o bound.dibs --nodes smaller.vtk --bind-within";
    assert!(
        fails(folder, &format!("{bound} 0.01")).contains("within that distance (--bind-within)")
    );
    let bound = json(folder, &format!("{bound} 3 --json"));
    assert!(bound["tree"]["volume"]["amplification"].as_f64().unwrap() > 1.01);
    assert!(succeeds(folder, "inspect bound.dibs").contains("outside  vertices move up to 1."));
    let ask = "query bound.dibs --tool sphere:0,0,150,5 --json --vertices smaller.vtk";
    let apart = json(folder, ask)["separation"].as_f64().unwrap() - answers[0].0.as_f64().unwrap();
    assert!(apart.abs() < 1e-2, "{apart}");

    std::fs::write(folder.join("tools.csv"), "sphere:0,0,120,5\n".repeat(200)).unwrap();
    for surface in ["held", "interpolated", "extrapolated"] {
        let line =
            format!("track heart.dibs --motion nodes.pc2 --path tools.csv --surface {surface}");
        let kept = succeeds(folder, &line);
        let full = succeeds(folder, &format!("{line} --full"));
        let separations = |text: &str| -> Vec<f64> {
            text.lines()
                .map(|line| line.split_whitespace().nth(1).unwrap().parse().unwrap())
                .collect()
        };
        let (kept, full) = (separations(&kept), separations(&full));
        assert!(kept.len() == 200 && kept.iter().any(|at| (at - kept[0]).abs() > 0.1));
        assert!(kept.iter().zip(&full).all(|(a, b)| (a - b).abs() < 1e-3), "{surface}");
    }

    // What does not fit is refused in one sentence, and the tree stays as it was.
    let before = std::fs::read(folder.join("heart.dibs")).unwrap();
    let shifted: Vec<DVec3> = volume.nodes().iter().map(|at| *at + DVec3::X * 30.0).collect();
    std::fs::write(folder.join("shifted.vtk"), vtk(&shifted, volume.tetrahedra())).unwrap();
    let mut inverted = volume.tetrahedra().to_vec();
    inverted[5].swap(0, 1);
    std::fs::write(folder.join("inverted.msh"), msh(volume.nodes(), &inverted)).unwrap();
    for (nodes, part) in [
        ("shifted.vtk", "(counted from 0) of the surface is outside the volume, and so are "),
        (
            "inverted.msh",
            "inverted.msh: tetrahedron 5 (counted from 0) is inverted at rest: exchange two nodes of it",
        ),
        ("heart.ply", "with 0 tetrahedra and 0 other volume cells"),
        ("absent.msh", "absent.msh: cannot be read"),
        ("lattice:0,1,1", "a lattice of 0 x 1 x 1 cells cannot be stored"),
        (
            "lattice:2,2,3 --stretch 1.01 --motion nodes.pc2",
            "nodes.pc2, frame 1: the element of the nodes",
        ),
        ("lattice:3,2,3 --motion nodes.pc2", "frame 0: has 36 points and the tree has 48 nodes"),
    ] {
        let error = fails(folder, &format!("build heart.ply -o heart.dibs --nodes {nodes}"));
        assert!(error.contains(part), "{nodes}: {error}");
    }
    let ask = "query heart.dibs --tool sphere:0,0,150,5 --vertices";
    for (vertices, part) in [
        ("heart.ply", "has 502 points and the tree has 36 nodes"),
        ("nodes.pc2 --frame 12", "no frame 12, the motion has 12"),
    ] {
        let error = fails(folder, &format!("{ask} {vertices}"));
        assert!(error.contains(part), "{vertices}: {error}");
    }
    std::fs::write(folder.join("page.html"), "<!--data-->").unwrap();
    for motion in ["", "--motion nodes.pc2"] {
        let view = format!("view heart.dibs -o heart.html --page page.html {motion}");
        assert!(succeeds(folder, &view).starts_with("written  heart.html"));
    }
    let error = fails(folder, "view bound.dibs --motion heart.ply -o heart.html --page page.html");
    assert!(error.contains("heart.ply"), "{error}");
    assert_eq!(std::fs::read(folder.join("heart.dibs")).unwrap(), before);
}

/// Each error about a volume names its file, the element and a remedy for tetrahedra.
#[test]
fn what_is_wrong_with_a_volume_is_said_of_the_volume() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    let put = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let (nodes, all) = (volume.nodes(), volume.tetrahedra());
    let ten = "0 1 2 3 4 5 6 7 8 9";
    for (name, element) in [("ten.msh", "1 11 2 0 1"), ("six.msh", "1 9 2 0 1")] {
        let elements = format!("$Elements\n1\n{element} 1 2 3 4 5 6 7 8 9 10\n$EndElements\n");
        put(name, &(msh(nodes, &[]).split("$Elements").next().unwrap().to_owned() + &elements));
    }
    put("ten.vtk", &curved(nodes));
    let one = vtu(nodes, &[[0, 1, 2, 3]]);
    let ten = one.replace(">0 1 2 3<", &format!(">{ten}<")).replace(">4<", ">10<");
    put(
        "ten.vtu",
        &ten.replace("\"ascii\">10</DataArray></Cells>", "\"ascii\">24</DataArray></Cells>"),
    );
    put("pieces.vtu", &vtu(nodes, all).replace("</Piece>", "</Piece><Piece/>"));
    put("image.vtk", "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n");
    put("model.step", "ISO-10303-21;\nHEADER;");
    let with = |more: [u32; 4]| [all, &[more]].concat();
    put("flat.vtk", &vtk(nodes, &with([0, 1, 4, 4])));
    put("range.vtk", &vtk(nodes, &with([0, 1, 2, 99])));
    put("range.msh", &msh(nodes, &with([0, 1, 2, 99])));
    let two: Vec<[u32; 4]> = all
        .iter()
        .enumerate()
        .map(|(at, &[a, b, c, d])| if at % 9 == 5 { [b, a, c, d] } else { [a, b, c, d] })
        .collect();
    put("inverted.vtk", &vtk(nodes, &two));
    let moved = |by: f64| nodes.iter().map(|at| *at + DVec3::X * by).collect::<Vec<_>>();
    put("far.vtk", &vtk(&moved(1_000.0), all));
    let mut unknown = nodes.to_vec();
    unknown[8].y = f64::NAN;
    put("unknown.vtk", &vtk(&unknown, all));
    put("unknown.msh", &msh(&unknown, all));
    succeeds(folder, "generate heart --triangles 1000 -o h.ply --motion heart.pc2");
    succeeds(folder, "stretch heart.ply --motion heart.pc2 --limits triangles.limits");
    let line = "stretch heart.ply --nodes volume.vtk --motion nodes.pc2 --limits nodes.limits";
    succeeds(folder, line);
    for (given, start, part) in [
        ("--nodes ten.msh", "ten.msh: ", "`gmsh MODEL.geo -3 -order 1 -o NEW.msh`"),
        ("--nodes six.msh", "six.msh: ", "`gmsh MODEL.geo -3 -order 1 -o NEW.msh`"),
        (
            "--nodes ten.vtk",
            "ten.vtk: ",
            "linear tetrahedra: in ParaView, the filter Tetrahedralize",
        ),
        (
            "--nodes ten.vtu",
            "ten.vtu: ",
            "linear tetrahedra: in ParaView, the filter Tetrahedralize",
        ),
        ("--nodes image.vtk", "image.vtk: ", "which is no tetrahedra; save it with linear"),
        ("--nodes pieces.vtu", "pieces.vtu: ", "the filter Merge Blocks and then Save Data"),
        (
            "--nodes model.step",
            "model.step: ",
            "mesh its volume: `gmsh model.step -3 -o model.msh`",
        ),
        ("--nodes nodes.pc2", "nodes.pc2: ", "give the volume here"),
        ("--nodes flat.vtk", "flat.vtk: no tree can be built: tetrahedron 72 (counted from 0)", ""),
        (
            "--nodes far.vtk",
            "far.vtk: no tree can be built: vertex 0 (counted from 0) of",
            "(--bind-within)",
        ),
        (
            "--nodes far.vtk --bind-within 1e30",
            "far.vtk: no tree",
            "too far to bind it (--bind-within)",
        ),
        (
            "--nodes lattice:10000,1,1",
            "--nodes lattice:10000,1,1: no tree",
            "give fewer of them, or the unit",
        ),
        (
            "--nodes range.vtk",
            "range.vtk: tetrahedron 72 (counted from 0) refers to node 99",
            "export it again",
        ),
        ("--nodes range.msh", "range.msh: ", "element 73 has node 100 (Gmsh's numbers)"),
        (
            "--nodes inverted.vtk",
            "inverted.vtk: tetrahedron 5 (counted from 0)",
            ", and so are 7 others: exchange two nodes of each",
        ),
        ("--nodes unknown.vtk", "unknown.vtk: node 8 (counted from 0) has", "repair the volume"),
        ("--nodes unknown.msh", "unknown.msh: node 8 (counted from 0) has", "repair the volume"),
        (
            "--nodes volume.vtk --limits triangles.limits",
            "triangles.limits: has limits of triangles",
            "leave --nodes out, or give the file of `dibs stretch MESH --nodes VOLUME --motion",
        ),
        (
            "--limits nodes.limits",
            "nodes.limits: has limits of tetrahedra",
            "give the volume as well (--nodes VOLUME)",
        ),
    ] {
        let error = fails(folder, &format!("build heart.ply -o heart.dibs {given}"));
        assert!(error.starts_with(start) && error.contains(part), "{given}: {error}");
    }
    for (given, part) in [
        ("--nodes volume.vtk --bind-within -1", "a distance of at least 0"),
        ("--nodes volume.vtk --bind-within nan", "a distance of at least 0"),
        ("--nodes=", "a file of tetrahedra, or lattice:NX,NY,NZ"),
    ] {
        let output = dibs(folder, &format!("build heart.ply -o heart.dibs {given}"));
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(part), "{given}: {error}");
    }
    assert!(!folder.join("heart.dibs").exists());
}

/// From the program, over UDP, to the surface that a controller searches.
#[test]
fn nodes_are_streamed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    succeeds(folder, "build heart.ply -o heart.dibs --nodes volume.vtk");
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let to = format!("--to udp:{}", socket.local_addr().unwrap());
    let sent = json(
        folder,
        &format!("stream heart.dibs --motion nodes.pc2 {to} --motion-rate 500 --json"),
    );
    assert_eq!(sent["frames"], 12);

    let blob: &'static [u8] = std::fs::read(folder.join("heart.dibs")).unwrap().leak();
    let tree = Tree::<u16>::from_bytes(blob).unwrap();
    let nodes = Nodes::of(&tree).unwrap();
    let frames: &'static Frames<NODES> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().unwrap();
    let admission_check = NodeMonitor::new(&nodes).limits(SurfaceLimits::reach_mm(500.0));
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 500.0);
    let (mut published, mut packet) = (0, [0; 2048]);
    while let Ok(length) = socket.recv(&mut packet) {
        let _ = assembler.accept(&packet[..length], Millis(0));
        for _ in 0..4 {
            if let Ok(Advance::Published { .. }) = assembler.advance(1_000) {
                published += 1;
            }
        }
    }
    assert!(published > 6, "{published}");
    let motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    let frame = reader.read().unwrap();
    let last = &motion.frames[11];
    let error = frame.position_error();
    for (row, at) in (0..).zip(last) {
        assert!(frame.position(row).unwrap().distance(*at) <= error + 1e-4);
    }
    assert_eq!(nodes.surface(&frame).len(), tree.vertex_count() as usize);
}
