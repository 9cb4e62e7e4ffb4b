//! Meshes far from the origin, where f32 coordinates are coarse.

use dibs_build::{Builder, ReadErrorKind};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Options, Query, Sphere};
use dibs_tests::deform::unit;
use dibs_tests::oracle::closest_pair;
use dibs_tests::surfaces::ball;
use fastrand::Rng;
use glam::DVec3;

/// The text of a ball's mesh file, this far from the origin, and its exact positions.
fn far_ball(away: f64) -> (String, Vec<DVec3>) {
    let mesh = ball(2);
    let centre = DVec3::new(away, -away / 3.0, away / 7.0);
    let exact: Vec<_> = mesh.positions.iter().map(|p| p.as_dvec3() + centre).collect();
    let vertices = exact.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = mesh.triangles.iter().map(|t| t.map(|v| v + 1));
    let faces = faces.map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    (vertices.chain(faces).collect(), exact)
}

/// The rounding of a mesh to f32, far from the origin, counts in the accuracy of its answers. Where it would spoil the
/// shape, the mesh is refused.
#[test]
fn coordinates_far_from_the_origin_are_refused_or_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.obj");
    for away in [0.0, 100.0, 1e4, 5e4] {
        let (text, exact) = far_ball(away);
        std::fs::write(&path, text).unwrap();
        let import = dibs_build::read(&path).unwrap();
        let rounded = import.mesh.positions.iter().zip(&exact);
        let off = rounded.map(|(p, exact)| p.as_dvec3().distance(*exact)).fold(0.0, f64::max);
        let stated = import.report.position_error;
        assert!((stated - off).abs() <= 1e-12 * stated, "{away}: {stated} for {off}");
        let warned = import.report.warnings().any(|warning| warning.contains("rounding to f32"));
        assert_eq!(warned, away >= 1e4, "{away}");

        let built = Builder::new().build(&import).unwrap();
        let tree = built.tree::<u16>().unwrap();
        assert!(f64::from(tree.position_error()) >= stated, "{away}");
        let rows = built.to_rows(&import.mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).unwrap();
        let (mut worst, mut rng) = (0.0_f64, Rng::with_seed(3));
        for _ in 0..300 {
            let vertex = rng.usize(..exact.len());
            let out = unit(&mut rng) * 30.0 * rng.f32();
            let centre = (exact[vertex].as_vec3() + out).as_dvec3();
            let tool = Sphere::new(centre.as_vec3(), 0.5).unwrap();
            let options = Options::cold().unsigned();
            let found = query.closest(rows.as_slice(), &tool, &options).unwrap();
            let distance = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| exact[v as usize]);
                closest_pair(centre, centre, [a, b, c]).distance
            };
            let truth = import.mesh.triangles.iter().map(distance).fold(f64::INFINITY, f64::min);
            let error = (f64::from(found.separation) - (truth - 0.5)).abs();
            worst = worst.max(error / f64::from(found.accuracy));
        }
        assert!(worst <= 1.0, "{away} away: off by {worst} accuracies");
        println!("{away} away: rounded by {off:.1e}, off by at most {worst:.2} accuracies");
    }
    let (text, _) = far_ball(4e6);
    std::fs::write(&path, text).unwrap();
    let kind = dibs_build::read(&path).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::TooFar { .. }), "{kind}");
}
