//! Tables of positions: by value, by reference, as arrays and quantised, each says how many rows it has.

// Requirement: F-04

use dibs_build::{Builder, generate};
use dibs_nostd::modes::Memo;
use dibs_nostd::{MovingSurface, Odometer, QuantisedVertices, Tree, VertexTable};
use glam::Vec3;

/// What a table says, through the trait alone.
fn says<V: VertexTable + ?Sized>(table: &V) -> (usize, bool, Option<Vec3>, Option<Vec3>) {
    let last = (table.len() as u32).wrapping_sub(1);
    (table.len(), table.is_empty(), table.position(last), table.position(table.len() as u32))
}

#[test]
fn every_table_ends_after_its_last_row() {
    let rows = [Vec3::X, Vec3::Y * 2.0, Vec3::Z * 3.0];
    let expected = (3, false, Some(Vec3::Z * 3.0), None);
    assert_eq!(says(&rows), expected);
    assert_eq!(says(&rows[..]), expected);
    assert_eq!(says(&&rows[..]), expected);
    assert_eq!(says(&&&rows), expected);
    assert_eq!(says::<[Vec3]>(&[]), (0, true, None, None));
    let quantised = [[1, 0, 0], [0, 2, 0], [0, 0, 3]];
    let table = QuantisedVertices::new(&quantised, Vec3::ZERO, Vec3::ONE);
    assert_eq!(says(&table), expected);
    assert_eq!(says(&&table), expected);
    assert_eq!(says(&Memo::<_, 2>::new(&rows)), expected);
    assert_eq!(says(&Memo::<_, 0>::new(&rows)), expected);
    // An empty slot has the number that is asked for here.
    let none: [Vec3; 0] = [];
    assert_eq!(says(&Memo::<_, 2>::new(&none)), (0, true, None, None));
}

/// A surface that is borrowed has the surface's motion, from frame to frame another.
#[test]
fn a_borrowed_surface_has_its_motion() {
    fn motion<S: MovingSurface>(surface: &S) -> String {
        format!("{:?}", surface.motion().expect("it moves"))
    }
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let tree: Tree<'_, u16> = built.tree().expect("valid");
    let rows = built.to_rows(&heart.positions);
    let later: Vec<Vec3> = rows.iter().map(|&row| row + Vec3::X).collect();
    let mut odometer = Odometer::new(&tree);
    let first = odometer.start(rows.as_slice());
    let second = odometer.step(rows.as_slice(), later.as_slice()).after();
    assert_eq!([motion(&&first), motion(&&second)], [motion(&first), motion(&second)]);
    assert_ne!(motion(&first), motion(&second));
}
