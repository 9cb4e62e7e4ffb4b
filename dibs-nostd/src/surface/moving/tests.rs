//! The position error of a surface between its frames, or beyond them.

// Requirement: F-05

extern crate std;

use std::prelude::rust_2024::*;

use dibs_build::{Builder, generate};
use glam::Vec3;

use crate::{Odometer, QuantisedVertices, StretchError, Tree, VertexTable, measure_stretch};

/// Positions with an error.
struct Inexact(Vec<Vec3>, f32);

impl VertexTable for Inexact {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.0.get(vertex as usize).copied()
    }

    fn position_error(&self) -> f32 {
        self.1
    }
}

/// A position `a + s (b - a)` has `|1 - s|` times the error of `a` plus `s` times that of `b`, whichever is larger,
/// also beyond `b`, where `1 - s` is negative.
#[test]
fn a_blend_is_off_by_the_errors_of_both_frames() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    for (first, second) in [(0.5, 0.1), (0.1, 0.5), (1.0, 0.0)] {
        let moved = rows.iter().map(|row| *row + Vec3::X).collect();
        let (before, after) = (Inexact(rows.clone(), first), Inexact(moved, second));
        let mut odometer = Odometer::new(&tree);
        odometer.start(&before);
        let step = odometer.step(&before, &after);
        for part in [0.0, 0.25, 1.0] {
            let error = step.at(part).position_error();
            assert!((error - ((1.0 - part) * first + part * second)).abs() < 1e-6, "{error}");
        }
        for part in [0.0, 0.5, 2.0] {
            let error = step.beyond(part).position_error();
            assert!((error - (part * first + (1.0 + part) * second)).abs() < 1e-6, "{error}");
        }
    }
}

/// No position rounded to the grid is farther from its row than the stated error, and the farthest is nearly that far.
#[test]
fn a_quantised_table_states_its_error() {
    let mut rng = fastrand::Rng::with_seed(4);
    for scale in [1e-3, 1.0, 500.0] {
        let step = Vec3::new(0.010, 0.021, 0.003) * scale;
        let origin = Vec3::new(-310.0, 40.0, 7.0) * scale;
        let mut worst = 0.0_f64;
        let mut stated = 0.0;
        for _ in 0..20_000 {
            let row: [u16; 3] = core::array::from_fn(|_| rng.u16(..));
            let part = glam::DVec3::from_array(core::array::from_fn(|axis| {
                f64::from(row[axis]) + if rng.bool() { 0.4999 } else { -0.4999 }
            }));
            let rows = [row];
            let table = QuantisedVertices::new(&rows, origin, step);
            let sent = origin.as_dvec3() + step.as_dvec3() * part;
            let off = sent.distance(table.position(0).unwrap().as_dvec3());
            stated = f64::from(table.position_error());
            assert!(off <= stated, "{off} {stated}");
            worst = worst.max(off);
        }
        assert!(stated < worst * 1.05, "{worst} {stated}");
    }
}

/// Between tables of two lengths there are no rows, so that nothing is measured there.
#[test]
fn tables_of_two_lengths_have_no_rows_between_them() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    let (whole, short) = (&rows[..], &rows[1..]);
    let mut odometer = Odometer::new(&tree);
    for (before, after) in [(whole, short), (short, whole), (whole, whole)] {
        let step = odometer.step(before, after);
        let found = if before.len() == after.len() { rows.len() } else { 0 };
        for blend in [step.at(0.5), step.beyond(0.5)] {
            assert_eq!(blend.len(), found);
            let measured = measure_stretch(&tree, &blend).map(|_| ());
            let refused = StretchError::VertexCount { expected: tree.vertex_count(), found: 0 };
            assert_eq!(measured, if found == 0 { Err(refused) } else { Ok(()) });
        }
    }
}
