//! Files as other programs write them: `../fixtures/make.py` says which.

// Requirement: M-03

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::{Path, PathBuf};

use dibs_build::glam::Vec3;
use dibs_build::{Format, Import, Motion, ReadError, ReadErrorKind, ReadOptions};

use crate::program::{fails, json, succeeds};

const POINTS: [[f32; 3]; 6] = [
    [10.5, 0.0, 0.25],
    [-10.0, 0.0, 0.0],
    [0.0, 20.0, -0.125],
    [0.0, -20.0, 0.0],
    [0.0, 0.0, 30.0],
    [0.1, 0.0, -31.0],
];

const TRIANGLES: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

const MESHES: [(&str, Format); 24] = [
    ("vtk_42_ascii.vtk", Format::Vtk),
    ("vtk_42_binary.vtk", Format::Vtk),
    ("vtk_51_ascii.vtk", Format::Vtk),
    ("vtk_51_binary.vtk", Format::Vtk),
    ("meshio.vtk", Format::Vtk),
    ("vtk_strips.vtk", Format::Vtk),
    ("vtk_default.vtp", Format::Vtp),
    ("vtk_ascii.vtp", Format::Vtp),
    ("vtk_inline.vtp", Format::Vtp),
    ("vtk_inline_zlib.vtp", Format::Vtp),
    ("vtk_raw.vtp", Format::Vtp),
    ("vtk_raw_zlib.vtp", Format::Vtp),
    ("vtk_strips.vtp", Format::Vtp),
    ("gmsh_22.msh", Format::Gmsh),
    ("gmsh_22_binary.msh", Format::Gmsh),
    ("gmsh_41.msh", Format::Gmsh),
    ("gmsh_41_binary.msh", Format::Gmsh),
    ("meshio_22.msh", Format::Gmsh),
    ("meshio_22_binary.msh", Format::Gmsh),
    ("meshio_41_binary.msh", Format::Gmsh),
    ("trimesh.glb", Format::Gltf),
    ("trimesh.3mf", Format::ThreeMf),
    ("series_001.vtp", Format::Vtp),
    ("meshio.vtu", Format::Vtp),
];

/// Scaled and moved by a scene.
const SCENES: [&str; 3] = ["scene.gltf", "scene.glb", "scene.3mf"];

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../dibs-build/tests/fixtures").join(name)
}

fn read(path: impl AsRef<Path>) -> Result<Import, ReadError> {
    ReadOptions { largest_component: true, ..Import::options() }.read(path)
}

/// Millimetres of a number in a file: glTF is in metres.
fn scale(name: &str) -> f32 {
    if name.ends_with(".gltf") || name.ends_with(".glb") { 1000.0 } else { 1.0 }
}

/// Triangles that begin with their least corner, sorted.
fn sorted(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let turned = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let mut triangles: Vec<_> = triangles.iter().filter_map(turned).collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn meshes_of_other_programs_are_read() {
    for (name, format) in MESHES {
        let Import { mesh, report, .. } = dibs_build::read(fixture(name)).unwrap();
        assert_eq!(report.format, format, "{name}");
        let points = POINTS.map(|point| scale(name) * Vec3::from_array(point));
        assert_eq!(mesh.positions, points, "{name}");
        assert_eq!(report.warnings().collect::<Vec<_>>(), [""; 0], "{name}");
        if name.contains("strips") {
            assert_eq!(sorted(&mesh.triangles), sorted(&TRIANGLES), "{name}");
        } else {
            assert_eq!(mesh.triangles, TRIANGLES, "{name}");
        }
    }
    for name in SCENES {
        let mesh = dibs_build::read(fixture(name)).unwrap().mesh;
        let placed = POINTS.map(|[x, y, z]| scale(name) * Vec3::new(2.0 * x + 100.0, y, z));
        assert_eq!(mesh.positions, placed, "{name}");
        assert_eq!(mesh.triangles, TRIANGLES, "{name}");
    }
}

/// What content a file has, not what it is called.
#[test]
fn what_is_not_read_is_named_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let says = |path: &Path| read(path).unwrap_err().to_string();
    for (name, what, remedy) in [
        ("meshio.inp", "this is an Abaqus input file", "`meshio convert"),
        ("vtk_lz4.vtp", "vtkLZ4DataCompressor", "save it with ZLib"),
        ("frames.npy", "a motion (NumPy)", "where a motion is asked for"),
    ] {
        let message = says(&fixture(name));
        assert!(message.contains(what) && message.contains(remedy), "{message}");
    }
    let mut dicom = [0; 200];
    dicom[128..132].copy_from_slice(b"DICM");
    for (content, what, remedy) in [
        (&b"ISO-10303-21;\nHEADER;"[..], "a STEP file", "gmsh HERE/x.bin -2 -o HERE/x.msh"),
        (b"** made by\n*NODE\n1, 0, 0, 0\n", "Abaqus", "meshio convert HERE/x.bin HERE/x.ply"),
        (b"<?xml version=\"1.0\"?>\n<COLLADA>", "a COLLADA scene", "assimp export"),
        (b"Kaydara FBX Binary  \0", "an FBX scene", "assimp export"),
        (b"\xff\xff\xfecreated by", "a FreeSurfer surface", "mris_convert"),
        (&dicom, "a DICOM image", "segment it"),
        (b"PK\x03\x04 holiday.jpg", "a compressed file (ZIP)", "unpack it"),
        (
            b"# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n",
            "STRUCTURED_POINTS",
            "PolyData",
        ),
        (b"$MeshFormat\n4 0 8\n$EndMeshFormat\n", "version 4", "-format msh41"),
    ] {
        let path = folder.path().join("x.bin");
        std::fs::write(&path, content).unwrap();
        let message = says(&path);
        let remedy = remedy.replace("HERE", &folder.path().display().to_string());
        assert!(message.contains(what) && message.contains(&remedy), "{message}");
    }
    // Text that begins as one of them may still be a mesh.
    let path = folder.path().join("x.obj");
    std::fs::write(&path, "#VRML it is not\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert!(read(&path).is_ok());
}

#[test]
fn a_document_reads_only_files_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.gltf");
    let document = std::fs::read_to_string(fixture("scene.gltf")).unwrap();
    std::fs::write(&path, &document).unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains(".bin' cannot be read"), "{message}");
    for elsewhere in ["../gltf_buffer", "/etc/hostname", "http://host/gltf_buffer"] {
        std::fs::write(&path, document.replace("gltf_buffer", elsewhere)).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("cannot be read") || message.contains("no file beside it"),
            "{message}"
        );
        assert!(
            elsewhere.starts_with("http") || message.contains("no file beside it"),
            "{message}"
        );
    }
}

#[test]
fn what_was_made_to_fill_the_memory_does_not() {
    let message = read(fixture("bomb.3mf")).unwrap_err().to_string();
    assert!(message.contains("compressed bytes become more than"), "{message}");
}

fn frame(number: usize) -> Vec<Vec3> {
    // As f64, rounded once.
    let factor = 1.0 + number as f64 / 10.0;
    let wide = POINTS.map(|point| point.map(|x| (f64::from(x) * 1e6).round() / 1e6 * factor));
    wide.map(|point| Vec3::from(point.map(|x| x as f32))).to_vec()
}

#[test]
fn motions_of_other_programs_are_read() {
    for name in ["frames.npy", "fortran.npy", "series_%03d.vtp"] {
        let motion = Motion::read(fixture(name)).unwrap();
        assert_eq!(motion.frames, [frame(0), frame(1), frame(2)], "{name}");
        assert_eq!(motion.rate, 0.0);
    }
    let message = Motion::read(fixture("flat.npy")).unwrap_err().to_string();
    assert!(message.contains("shape (3, 18)") && message.contains("numpy.save"), "{message}");
    let kind = Motion::read(fixture("meshio.inp")).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::UnknownMotion), "{kind}");
}

#[test]
fn a_series_has_no_gap_and_one_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = dibs_build::generate::heart(320).unwrap().mesh;
    let series = |pattern: &str| Motion::read(folder.join(pattern));
    for number in [8, 9, 10, 11] {
        mesh.write_ply(folder.join(format!("a{number}.ply"))).unwrap();
        mesh.write(folder.join(format!("b{number:02}.obj")), Format::Obj).unwrap();
        mesh.write(folder.join(format!("c{number}.stl")), Format::StlBinary).unwrap();
    }
    for pattern in ["a%d.ply", "b%02d.obj"] {
        assert_eq!(series(pattern).unwrap().frames, vec![mesh.positions.clone(); 4], "{pattern}");
    }
    let fails = |pattern: &str| series(pattern).unwrap_err().to_string();
    assert!(fails("c%d.stl").contains("c8.stl: STL has no vertex numbers"));
    assert!(fails("b%03d.obj").contains("b%03d.obj: no file has this name"));
    let mut other = mesh.clone();
    other.triangles.swap(0, 1);
    other.write_ply(folder.join("a10.ply")).unwrap();
    assert!(fails("a%d.ply").contains("a10.ply: its triangles or tetrahedra are not those"));
    std::fs::remove_file(folder.join("a10.ply")).unwrap();
    assert!(
        fails("a%d.ply").contains("a10.ply: missing in its series, which goes on with number 11")
    );
    std::fs::write(folder.join("a10.ply"), "ply").unwrap();
    assert!(fails("a%d.ply").contains("a10.ply"));
}

/// The program takes them wherever it takes a mesh or a motion.
#[test]
fn the_program_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| fixture(name).display().to_string();
    let folder = folder.path();
    let mesh = at("vtk_default.vtp");
    succeeds(
        folder,
        &format!("build {mesh} -o o.dibs --stretch 1.3 --motion {}", at("frames.npy")),
    );
    let asked = |motion: &str| {
        json(
            folder,
            &format!(
                "query o.dibs --tool sphere:0,0,60,1 --vertices {} --frame 2 --json",
                at(motion)
            ),
        )
    };
    assert_eq!(asked("series_%03d.vtp"), asked("frames.npy"));
    assert!((asked("frames.npy")["separation"].as_f64().unwrap() - 23.0).abs() < 1e-3);
    let error = fails(
        folder,
        &format!("query o.dibs --tool sphere:0,0,60,1 --vertices {}", at("frames.npy")),
    );
    assert!(error.contains("--frame"), "{error}");
    std::fs::write(folder.join("tools.csv"), "sphere:0,0,60,1\nsphere:0,0,61,1\n").unwrap();
    let track = format!("track o.dibs --motion {} --path tools.csv", at("frames.npy"));
    assert!(fails(folder, &track).contains("--motion-rate"));
    assert_eq!(succeeds(folder, &format!("{track} --motion-rate 30 --json")).lines().count(), 2);
    let error = fails(folder, &format!("build {} -o o.dibs", at("meshio.inp")));
    assert!(error.contains("this is an Abaqus input file"), "{error}");
}

/// A mesh and a motion in metres are those in millimetres, a thousand times smaller.
#[test]
fn units_scale_and_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = dibs_build::read(fixture("vtk_ascii.vtp")).unwrap().mesh;
    let write = |name: &str, factor: f32| {
        let positions = mesh.positions.iter().map(|&p| p * factor).collect::<Vec<_>>();
        let moved = Motion {
            frames: vec![positions.iter().map(|&p| 1.1 * p).collect()],
            rate: 30.0,
            ..Motion::default()
        };
        moved.write_pc2(folder.join(format!("{name}.pc2"))).unwrap();
        let scaled = dibs_build::Mesh { positions, ..mesh.clone() };
        scaled.write_ply(folder.join(format!("{name}.ply"))).unwrap();
    };
    for (unit, factor) in [("mm", 1.0), ("cm", 0.1), ("m", 1e-3), ("in", 1.0 / 25.4)] {
        write(unit, factor);
        let line = format!("--unit {unit} --stretch 1.2 --motion {unit}.pc2 --json");
        let built = json(folder, &format!("build {unit}.ply -o {unit}.dibs {line}"));
        let inspected = json(folder, &format!("inspect {unit}.dibs --json"));
        assert_eq!(built["tree"], inspected);
        assert!(!built["warnings"].to_string().contains("an organ"), "{built}");
        let bounds: [[f64; 3]; 2] =
            serde_json::from_value(inspected["bounding_box"].clone()).unwrap();
        for (bound, expected) in
            bounds.as_flattened().iter().zip([-10.0, -20.0, -31.0, 10.5, 20.0, 30.0])
        {
            assert!((bound - expected).abs() < 1e-4, "{unit}: {bounds:?}");
        }
        let sides = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let lengths =
            sides.map(|(a, b)| mesh.positions[a as usize].distance(mesh.positions[b as usize]));
        let mean = f64::from(lengths.sum::<f32>()) / 24.0;
        assert!((inspected["mean_edge"].as_f64().unwrap() - mean).abs() < 1e-4, "{unit}");
        let text = succeeds(folder, &format!("inspect {unit}.dibs"));
        let shown = format!("61.0000]; mean edge {:.2}", (mean * 100.0).floor() / 100.0);
        assert!(
            text.contains(&shown) && text.contains(&format!("8 triangles in {unit}\n")),
            "{text}"
        );
        let ask =
            format!("query {unit}.dibs --tool sphere:0,0,60,1 --vertices {unit}.pc2 --frame 0");
        let separation =
            json(folder, &format!("{ask} --unit {unit} --json"))["separation"].as_f64();
        assert!((separation.unwrap() - 26.0).abs() < 1e-3, "{unit}: {separation:?}");
        let measured =
            json(folder, &format!("stretch {unit}.ply --motion {unit}.pc2 --unit {unit} --json"));
        assert!((measured["uniform_limit"].as_f64().unwrap() - 1.21).abs() < 1e-3, "{measured}");
    }
    // In another unit than it is read in, no organ has its size.
    write("um", 1e3);
    for (name, warning) in [
        (
            "m.ply",
            "the surface is 0.061 mm across, too small for an organ, with lengths taken to be in mm: give their",
        ),
        (
            "um.ply",
            "the surface is 61000.000 mm across, too large for an organ, with lengths taken to be in mm: give",
        ),
    ] {
        let built = json(folder, &format!("build {name} -o wrong.dibs --json"));
        let unit = name.trim_end_matches(".ply");
        let said = built["warnings"].to_string();
        assert!(said.contains(warning) && said.contains(&format!("--unit {unit},")), "{said}");
        let right = json(folder, &format!("build {name} -o right.dibs --unit {unit} --json"));
        assert!(!right["warnings"].to_string().contains("an organ"), "{right}");
    }
}

thread_local! {
    /// The largest piece of memory that this thread has asked for.
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

struct Watched;

// SAFETY: the system's allocator does the work.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.set(LARGEST.get().max(layout.size()));
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Watched = Watched;

/// No damage makes a reader panic, hang or take memory that the file has not: a byte changed, and the file cut off, at
/// every seventh place; `DIBS_DAMAGE_EVERY=1` tries all.
#[test]
fn damaged_files_end_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let every =
        std::env::var("DIBS_DAMAGE_EVERY").map_or(7, |places| places.parse().expect("a number"));
    let (mut errors, mut meshes) = (0, 0);
    let mut check = |path: &Path, is_motion: bool, bytes: &[u8]| {
        std::fs::write(path, bytes).unwrap();
        let outcome = if is_motion { Motion::read(path).map(drop) } else { read(path).map(drop) };
        match outcome {
            Ok(()) => meshes += 1,
            Err(error) => {
                errors += 1;
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
            }
        }
    };
    let names = MESHES.iter().map(|(name, _)| *name).chain(SCENES);
    for name in names.chain(["frames.npy", "fortran.npy"]) {
        let whole = std::fs::read(fixture(name)).unwrap();
        let is_motion = name.ends_with("npy");
        let path = folder.path().join(name);
        let changes = [1, 0x80, 0x10, b'0', b'9', 0xff, 2, 0x40];
        for at in (0..whole.len()).step_by(every) {
            let mut bytes = whole.clone();
            match at % 2 {
                0 => bytes[at] ^= changes[at / 2 % 8],
                _ => bytes[at] = changes[(at + at / 8) % 8],
            }
            check(&path, is_motion, &bytes);
            if at % 5 == 0 {
                check(&path, is_motion, &whole[..at]);
            }
        }
    }
    // Damage in a value is no error, and a change that changes nothing.
    assert!(errors > 10_000 / every && meshes > 5_000 / every, "{errors} {meshes}");
    let largest = LARGEST.get();
    assert!(largest < 4 << 20, "{largest} bytes at once");
}
