//! Surfaces that share no vertex, in one tree: its answers equal those of exhaustive search, however they move apart.

// Requirement: A-08

use dibs_build::{BuildError, Builder, BuiltTree, Mesh, check_winding, generate, orient};
use dibs_nostd::format::{MAX_ROOTS, MAX_STACK, PathKind, field};
use dibs_nostd::{
    Budget, Capsule, Contacts, Fallback, FormatError, Odometer, Options, Query, QueryError, Side,
    Sphere, Tracker, Tree, TriangleRow,
};
use dibs_tests::ask::{closest, closest_batched};
use dibs_tests::deform::{Deformation, unit};
use dibs_tests::oracle::exhaustive;
use dibs_tests::poses::pose;
use dibs_tests::surfaces::{self, ball, joined, moved, sheet, slivers};
use dibs_tests::tree_bytes::reseal;
use fastrand::Rng;
use glam::Vec3;

/// A tiny part of four triangles, facing outwards.
fn crumb() -> Mesh {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 2.0).to_vec();
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Each part deformed and moved independently.
fn frame(parts: &[Mesh], rng: &mut Rng) -> Vec<Vec3> {
    let mut all = Vec::new();
    for part in parts {
        let kind = Deformation::ALL[rng.usize(..Deformation::ALL.len())];
        let by = unit(rng) * rng.f32() * 200.0;
        all.extend(kind.apply(part, PathKind::Surface, 1.4, rng).into_iter().map(|p| p + by));
    }
    all
}

/// Some parts of all sizes, and this many tiny ones.
fn parts(crumbs: usize) -> Vec<Mesh> {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let mut parts = vec![ball(2), heart, slivers(12)];
    parts.extend((0..crumbs).map(|_| crumb()));
    parts
}

fn build(mesh: &Mesh) -> BuiltTree {
    Builder::new().stretch(1.5).build(mesh).expect("a valid mesh")
}

#[test]
fn the_answer_is_that_of_exhaustive_search() {
    let mut rng = Rng::with_seed(1);
    for crumbs in [1, 40] {
        let parts = parts(crumbs);
        let mesh = joined(&parts);
        let built = build(&mesh);
        let tree = built.tree::<u16>().expect("16-bit indices");
        assert_eq!(built.summary().roots as usize, 3 + crumbs);
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut limited = 0;
        let mut nearest = vec![0; 3 + crumbs];
        for _ in 0..12 {
            let rows = built.to_rows(&frame(&parts, &mut rng));
            for _ in 0..50 {
                let tool = pose(&rows, &triangles, &mut rng);
                let truth = exhaustive(&rows, &triangles, &tool).expect("a triangle").separation;
                let budget = Budget::new(rng.u32(..162));
                let cold = Options::cold();
                let answers = [
                    closest(&mut query, &rows[..], &tool, &cold),
                    closest(&mut query, &rows[..], &tool, &Options::new()),
                    closest_batched(&mut query, &rows[..], &tool, &cold),
                    closest(&mut query, &rows[..], &tool, &cold.budget(budget)),
                ];
                for (at, found) in answers.into_iter().enumerate() {
                    let found = found.expect("an answer");
                    let (low, high) = (f64::from(found.lower), f64::from(found.separation));
                    let accuracy = f64::from(found.accuracy);
                    assert!(low - accuracy <= truth && truth <= high + accuracy, "{at}: {found:?}");
                    let is_cut_short = found.lower < found.separation;
                    assert!(at == 3 || !is_cut_short, "{at}: {found:?}");
                    limited += usize::from(is_cut_short);
                    let corner = found.triangle.map(|TriangleRow(row)| triangles[row as usize][0]);
                    let vertex = corner.map(|row| built.vertex_order()[row as usize] as usize);
                    let mut first = 0;
                    for (part, mesh) in parts.iter().enumerate() {
                        let vertices = first..first + mesh.positions.len();
                        nearest[part] += usize::from(vertex.is_some_and(|v| vertices.contains(&v)));
                        first = vertices.end;
                    }
                }
            }
        }
        println!("{limited} cut short, nearest parts {nearest:?}");
        assert!(limited > 100 && nearest[..4].iter().all(|&count| count > 0), "{nearest:?}");
    }
}

#[test]
fn a_tracker_follows_several_surfaces() {
    let mut rng = Rng::with_seed(2);
    for crumbs in [2, 30] {
        let parts = parts(crumbs);
        let built = build(&joined(&parts));
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut wide = Tracker::<u16, MAX_STACK, 128>::new(&tree).expect("deep enough");
        let mut narrow = Tracker::<u16, MAX_STACK, 5>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let (mut full, mut kept, mut tests) = ([0, 0], 0, [0_u64; 2]);
        for _ in 0..6 {
            let mut before = built.to_rows(&frame(&parts, &mut rng));
            odometer.start(before.as_slice());
            let mut middle = pose(&before, &triangles, &mut rng).start;
            for _ in 0..60 {
                let by = unit(&mut rng) * 0.2;
                let after: Vec<Vec3> = before.iter().map(|&p| p + by).collect();
                let surface = odometer.step(before.as_slice(), after.as_slice()).after();
                middle += unit(&mut rng) * 0.5;
                let tool = Sphere::new(middle, 1.0).expect("valid");
                let options = Options::cold().unsigned();
                let whole = query.closest(&after[..], &tool, &options).expect("an answer");
                let found = [
                    wide.closest(&surface, &tool, &options).expect("an answer"),
                    narrow.closest(&surface, &tool, &options).expect("an answer"),
                ];
                for (at, tracked) in found.iter().enumerate() {
                    let one = &tracked.closest;
                    let apart = (one.separation - whole.separation).abs();
                    assert!(apart <= one.accuracy + whole.accuracy, "{tracked:?} {whole:?}");
                    assert_eq!(one.lower, one.separation, "{tracked:?}");
                    full[at] += usize::from(tracked.fallback == Some(Fallback::Full));
                }
                kept += usize::from(found[0].fallback.is_none());
                tests[0] += u64::from(found[0].closest.node_tests);
                tests[1] += u64::from(whole.node_tests);
                before = after.clone();
            }
        }
        println!("{crumbs} crumbs: full {full:?}, {kept} kept, node tests {tests:?}");
        assert!(full[0] == 0 && full[1] > 0 && kept > 300, "{full:?} {kept}");
        assert!(tests[0] < tests[1], "{tests:?}");
    }
}

/// The accuracy covers the rounding of the farthest part, whose pins are compared with the nearest part's triangles.
#[test]
fn the_accuracy_is_that_of_the_farthest_part() {
    let away = Vec3::X * 10_000.0;
    let both = joined(&[ball(2), moved(&crumb(), away)]);
    let accuracy = |mesh: &Mesh| {
        let built = build(mesh);
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let tool = Sphere::new(Vec3::Z * 45.0, 1.0).expect("valid");
        let rows = built.to_rows(&mesh.positions);
        query.closest(&rows[..], &tool, &Options::cold()).expect("an answer").accuracy
    };
    let (near, far) = (accuracy(&ball(2)), accuracy(&moved(&crumb(), away)));
    assert!(near < far / 40.0, "{near} {far}");
    assert!(accuracy(&both) >= far, "{far}");
}

#[test]
fn sides_and_contacts_are_those_of_every_part() {
    let floor = sheet(8, 40.0, |_, _| 0.0);
    let mut ceiling = moved(&floor, Vec3::Z * 10.0);
    ceiling.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    let aside = moved(&ball(2), Vec3::X * 200.0);
    let mesh = joined(&[floor, ceiling, aside]);
    let built = build(&mesh);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let between = Capsule::new(Vec3::new(-3.0, 0.0, 5.0), Vec3::new(3.0, 0.0, 5.0), 1.0);
    let between = between.expect("valid");
    let mut contacts = Contacts::<8>::new();
    query.contacts(&rows[..], &between, 5.0, &Options::new(), &mut contacts).expect("an answer");
    let mut heights: Vec<f32> = contacts.iter().map(|contact| contact.normal.z).collect();
    heights.sort_by(f32::total_cmp);
    heights.dedup();
    assert_eq!(heights, [-1.0, 1.0], "{contacts:?}");
    let sides = [(Vec3::Z * 5.0, Side::Outside), (Vec3::X * 200.0, Side::Inside)];
    for (centre, side) in sides {
        let tool = Sphere::new(centre, 1.0).expect("valid");
        let found = query.closest(&rows[..], &tool, &Options::new()).expect("an answer");
        assert_eq!(found.side, side, "{found:?}");
    }
}

#[test]
fn a_trackers_contacts_are_those_of_every_part_however_short_the_list() {
    let crumbs: Vec<Mesh> = (0..60).map(|at| moved(&crumb(), Vec3::X * 4.0 * at as f32)).collect();
    let mesh = joined(&crumbs);
    let built = build(&mesh);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    // One tracker has no room for the roots, the other has room for all.
    let mut low = Tracker::<u16, MAX_STACK, 64, 6>::with_range(&tree).expect("deep enough");
    let mut high = Tracker::<u16, MAX_STACK, 64, 64>::with_range(&tree).expect("deep enough");
    let (mut short, mut long) = (Contacts::<32, 6>::new(), Contacts::<32, 64>::new());
    for at in 0..60 {
        let tool = Sphere::new(Vec3::new(4.0 * at as f32 + 0.3, 0.4, 4.0), 1.0).expect("valid");
        low.contacts(&surface, &tool, 2.0, &Options::new(), &mut short).expect("an answer");
        high.contacts(&surface, &tool, 2.0, &Options::new(), &mut long).expect("an answer");
        assert_eq!((low.opened_in_range(), high.opened_in_range()), (6, 8));
        assert_eq!((short.len(), short.bound()), (1, 2.0), "{at}");
        let triangle = |list: &Contacts<32, 64>| list.iter().next().map(|contact| contact.triangle);
        assert_eq!(short.iter().next().map(|contact| contact.triangle), triangle(&long));
    }
}

#[test]
fn a_tree_holds_so_many_roots_and_no_more() {
    let crumbs = |count: u32| -> Vec<Mesh> {
        (0..count).map(|at| moved(&crumb(), Vec3::X * 5.0 * at as f32)).collect()
    };
    let refused = Builder::new().build(&joined(&crumbs(MAX_ROOTS + 1)));
    assert!(matches!(refused, Err(BuildError::Components { components: 65 })), "{refused:?}");
    let most = build(&joined(&crumbs(MAX_ROOTS)));
    assert_eq!(most.summary().roots, MAX_ROOTS);

    let built = build(&joined(&parts(3)));
    let sound = built.blob();
    assert_eq!(u32::from_le_bytes(sound[field::OTHER_ROOTS..][..4].try_into().expect("four")), 5);
    for wrong in [0, 4, 6, MAX_ROOTS, u32::MAX] {
        let mut bytes = sound.to_vec();
        bytes[field::OTHER_ROOTS..][..4].copy_from_slice(&wrong.to_le_bytes());
        reseal(&mut bytes);
        let refused = Tree::<u16>::from_bytes(&bytes).expect_err("not its roots");
        let is_range = matches!(refused, FormatError::Field { offset: 44, .. });
        assert_eq!(is_range, wrong >= MAX_ROOTS, "{wrong}: {refused}");
    }
}

#[test]
fn a_position_that_is_no_number_is_named_in_every_part() {
    let mesh = joined(&parts(3));
    let built = build(&mesh);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Sphere::new(Vec3::splat(300.0), 1.0).expect("valid");
    for root in 0..tree.roots() {
        let (pin, _, _) = tree.node(root).expect("a root");
        for wrong in [f32::NAN, f32::INFINITY, 1e30] {
            let mut rows = built.to_rows(&mesh.positions);
            rows[pin as usize].y = wrong;
            let refused = query.closest(&rows[..], &tool, &Options::new());
            assert_eq!(refused, Err(QueryError::Position { vertex: pin }), "{root} {wrong}");
        }
    }
}

#[test]
fn each_closed_part_faces_outwards_unless_another_encloses_it() {
    let inwards = |mesh: &Mesh| {
        let mut mesh = mesh.clone();
        mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        mesh
    };
    let (outer, inner) = (ball(1), moved(&crumb(), Vec3::ONE));
    let aside = moved(&crumb(), Vec3::X * 90.0);
    for part in [&inner, &inwards(&inner), &aside] {
        assert_eq!(check_winding(&joined(&[outer.clone(), part.clone()])), Ok(()));
    }
    let mut wrong = joined(&[outer.clone(), inwards(&aside)]);
    let first = outer.triangles.len();
    let error = check_winding(&wrong).expect_err("a crumb faces inwards");
    assert!(error.to_string().contains(&format!("triangle {first}")), "{error}");
    assert_eq!(orient(&mut wrong), Ok(4));
    assert_eq!(wrong, joined(&[outer, aside]));
}
