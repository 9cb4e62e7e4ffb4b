//! Meshes far from the origin, where f32 coordinates are coarse.

// Requirements: A-01, M-05

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{
    Builder, Import, Mesh, Motion, MotionMismatchError, ReadErrorKind, ReadOptions, Unit,
};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Options, Query, Sphere};
use dibs_tests::deform::unit;
use dibs_tests::oracle::least_distance;
use dibs_tests::surfaces::ball;
use fastrand::Rng;
use tempfile::TempDir;

/// The text of a mesh with these positions.
fn obj(positions: &[DVec3], mesh: &Mesh) -> String {
    let vertices = positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = mesh.triangles.iter().map(|t| t.map(|v| v + 1));
    let faces = faces.map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    vertices.chain(faces).collect()
}

/// A ball at this distance from the origin: its exact positions.
fn far_ball(away: f64) -> (Mesh, Vec<DVec3>) {
    let mesh = ball(2);
    let centre = DVec3::new(away, -away / 3.0, away / 7.0);
    let exact = mesh.positions.iter().map(|p| p.as_dvec3() + centre).collect();
    (mesh, exact)
}

fn read(folder: &TempDir, text: &str, options: &ReadOptions) -> Result<Import, ReadErrorKind> {
    let path = folder.path().join("far.obj");
    std::fs::write(&path, text).unwrap();
    options.read(path).map_err(|error| error.kind)
}

/// The largest error of 300 answers relative to their accuracy, and the largest accuracy. The true separation is that
/// of an exhaustive search in f64, in the file's coordinates.
fn worst_answer(import: &Import, exact: &[DVec3]) -> (f64, f64) {
    let built = Builder::new().build(import).unwrap();
    let tree = built.tree::<u16>().unwrap();
    assert_eq!(DVec3::from(tree.origin()), import.mesh.origin);
    assert!(f64::from(tree.position_error()) >= import.report.position_error);
    let rows = built.local_rows(exact);
    assert_eq!(rows, built.to_rows(&import.mesh.positions));
    assert_eq!(rows, built.to_rows(&import.mesh.local(exact)));
    let mut query = Query::<u16, MAX_STACK>::new(&tree).unwrap();
    let (mut worst, mut accuracy, mut rng) = (0.0_f64, 0.0_f64, Rng::with_seed(3));
    for _ in 0..300 {
        let out = unit(&mut rng).as_dvec3() * 30.0 * rng.f64();
        let wanted = exact[rng.usize(..exact.len())] + out;
        let local = tree.local(wanted.to_array());
        let centre = import.mesh.origin + local.as_dvec3();
        assert!(centre.distance(wanted) < 1e-7 * (100.0 + f64::from(local.length())), "{wanted}");
        let tool = Sphere::new(local, 0.5).unwrap();
        let options = Options::cold().unsigned();
        let found = query.closest(rows.as_slice(), &tool, &options).unwrap();
        let triangles = import.mesh.triangles.iter().map(|t| t.map(|v| exact[v as usize]));
        let truth = least_distance(centre, centre, triangles);
        let error = (f64::from(found.separation) - (truth - 0.5)).abs();
        worst = worst.max(error / f64::from(found.accuracy));
        accuracy = accuracy.max(found.accuracy.into());
    }
    (worst, accuracy)
}

/// A mesh far from the origin is as accurate as near it; if nothing would be lost it keeps its coordinates.
#[test]
fn no_distance_from_the_origin_costs_accuracy() {
    let folder = tempfile::tempdir().unwrap();
    let mut near = 0.0;
    for away in [0.0, 100.0, 500.0, 1e4, 5e4, 4e6, 4e9] {
        let (mesh, exact) = far_ball(away);
        let import = read(&folder, &obj(&exact, &mesh), &Import::options()).unwrap();
        let origin = import.mesh.origin;
        let local = import.mesh.positions.iter().map(|p| p.as_dvec3() + origin);
        let off = local.zip(&exact).map(|(p, exact)| p.distance(*exact)).fold(0.0, f64::max);
        assert!(off <= import.report.position_error, "{away}: off by {off}");
        let is_far = away >= 1e4;
        assert_eq!(import.report.recentred, is_far, "{away}");
        assert_eq!(origin != DVec3::ZERO, is_far, "{away}");
        assert_eq!(import.report.warnings().any(|warning| warning.contains("count from")), is_far);
        let (worst, accuracy) = worst_answer(&import, &exact);
        assert!(worst <= 1.0, "{away} away: off by {worst} accuracies");
        if away == 0.0 {
            near = accuracy;
        }
        assert!(accuracy <= 1.5 * near, "{away} away: within {accuracy}, near within {near}");
        println!(
            "{away} away: rounded by {off:.1e}, within {accuracy:.1e}, off by {worst:.2} of it"
        );
    }
}

/// A given origin is used; one so far away that f32 cannot represent the mesh is refused.
#[test]
fn an_origin_may_be_given() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, exact) = far_ball(4e6);
    let text = obj(&exact, &mesh);
    let with = |origin| ReadOptions { origin: Some(origin), ..Import::options() };
    let origin = DVec3::new(4e6, -4e6 / 3.0, 4e6 / 7.0);
    let import = read(&folder, &text, &with(origin)).unwrap();
    assert_eq!((import.mesh.origin, import.report.recentred), (origin, false));
    assert!(worst_answer(&import, &exact).0 <= 1.0);
    let kind = read(&folder, &text, &with(DVec3::ZERO)).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Elsewhere { largest, .. } if largest > 3.9e6), "{kind}");
    let kind = read(&folder, &text, &with(DVec3::NAN)).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Origin { .. }), "{kind}");
    // A mesh near the origin keeps its coordinates unless an origin is given.
    let (mesh, exact) = far_ball(0.0);
    let import = read(&folder, &obj(&exact, &mesh), &with(DVec3::X)).unwrap();
    assert_eq!(import.mesh.positions[0], mesh.positions[0] - Vec3::X);
}

/// A surface whose digits are lost is refused; one whose coordinates have few digits is not.
#[test]
fn lost_digits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let far = |away: f64, digits: fn(DVec3) -> DVec3| {
        let (mesh, exact) = far_ball(away);
        let exact: Vec<_> = exact.into_iter().map(digits).collect();
        read(&folder, &obj(&exact, &mesh), &Import::options())
    };
    let single = |p: DVec3| p.as_vec3().as_dvec3();
    for (away, digits) in [(4e6, single as fn(DVec3) -> DVec3), (4e7, single), (1e15, |p| p)] {
        let kind = far(away, digits).unwrap_err();
        assert!(matches!(kind, ReadErrorKind::TooFar { .. }), "{away}: {kind}");
    }
    // Implausible sizes get the errors of the later checks.
    let of = |corners: [&str; 3]| {
        let [a, b, c] = corners;
        let text = format!("v {a} 0 0\nv {b} 0 0\nv {c} {c} 0\nf 1 2 3\n");
        read(&folder, &text, &Import::options()).unwrap_err()
    };
    let kind = of(["1e308", "1.1e308", "1.2e308"]);
    assert!(matches!(kind, ReadErrorKind::Overflow { .. }), "{kind}");
    let kind = of(["1e20", "1.1e20", "1.2e20"]);
    assert!(matches!(kind, ReadErrorKind::TooLarge { .. }), "{kind}");
    let kind = of(["0", "5e-324", "1e-323"]);
    assert!(matches!(kind, ReadErrorKind::NoTriangles { .. }), "{kind}");
    let kind = of(["0", "1e-30", "2e-30"]);
    assert!(matches!(kind, ReadErrorKind::TooSmall { .. }), "{kind}");
    // Whole numbers are exact in f32 as well.
    let import = far(4e6, DVec3::round).unwrap();
    assert!(import.report.recentred && import.report.position_error < 1e-8);
    // Vertices that no triangle uses may be anywhere.
    let (mesh, exact) = far_ball(4e9);
    let text = obj(&exact, &mesh) + "v 0 0 0\n";
    let import = read(&folder, &text, &Import::options()).unwrap();
    assert!(import.report.recentred && import.report.position_error < 1e-4);
}

/// The mesh's origin is subtracted from a motion before it is rounded.
#[test]
fn a_far_motion_keeps_its_digits() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, exact) = far_ball(4e6);
    // In metres, so that the mesh is 4,000 m away.
    let exact: Vec<DVec3> = exact.iter().map(|p| *p / 1e3).collect();
    let frames: Vec<Vec<DVec3>> = (0..3)
        .map(|n| exact.iter().map(|p| *p + DVec3::Z * 0.001 * f64::from(n)).collect())
        .collect();
    for (number, frame) in frames.iter().enumerate() {
        std::fs::write(folder.path().join(format!("f{number}.obj")), obj(frame, &mesh)).unwrap();
    }
    let numbers = frames.iter().flatten().flat_map(DVec3::to_array);
    let header =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': (3, {}, 3), }}\n", exact.len());
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.bytes().chain(numbers.flat_map(f64::to_le_bytes)));
    std::fs::write(folder.path().join("f.npy"), npy).unwrap();
    let options = ReadOptions { unit: Some(Unit::Metre), ..Import::options() };
    let import = read(&folder, &obj(&exact, &mesh), &options).unwrap();
    let origin = import.mesh.origin;
    assert!(origin.x > 3.9e6);
    for name in ["f%d.obj", "f.npy"] {
        let path = folder.path().join(name);
        let motion = Motion::read_around(&path, Unit::Metre, origin).unwrap();
        for (read, exact) in motion.frames.iter().zip(&frames) {
            let exact: Vec<DVec3> = exact.iter().map(|p| *p * 1e3).collect();
            assert_eq!(*read, import.mesh.local(&exact), "{name}");
        }
        motion.check_fits(&import.mesh).unwrap();
        assert!(motion.write_pc2(folder.path().join("far.pc2")).is_err());
        let elsewhere = Motion { origin: DVec3::ZERO, ..motion };
        let error = elsewhere.check_fits(&import.mesh).unwrap_err();
        assert!(matches!(error, MotionMismatchError::Origin { .. }), "{error}");
        let kind = Motion::read_around(&path, Unit::Metre, -1e6 * origin).unwrap_err().kind;
        assert!(matches!(kind, ReadErrorKind::Elsewhere { .. }), "{kind}");
    }
    // Single precision has already lost the digits.
    let rounded = |scale: f64| -> Vec<Vec<Vec3>> {
        frames.iter().map(|f| f.iter().map(|p| (*p * scale).as_vec3()).collect()).collect()
    };
    let path = folder.path().join("f.pc2");
    Motion { frames: rounded(1e3), rate: 1.0, ..Motion::default() }.write_pc2(&path).unwrap();
    let kind = Motion::read_around(&path, Unit::Millimetre, origin).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::TooFar { .. }), "{kind}");
}
