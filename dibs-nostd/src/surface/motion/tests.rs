//! The odometer continues from the last measured frame only.

// Requirement: T-04

extern crate std;

use std::prelude::rust_2024::*;

use dibs_build::{Builder, generate};
use fastrand::Rng;
use glam::Vec3;

use super::{MotionReading, Odometer, Unit};
use crate::tree::format::{CRC, field};
use crate::{MovingSurface, Tree};

/// A change of a frame.
type Change = fn(&mut [Vec3], &mut Rng);

/// Changes that a sum of products without a shift, or one over rows in any order, does not detect.
const CHANGES: [Change; 9] = [
    |rows, _| rows.iter_mut().for_each(|row| row.x = -row.x),
    |rows, _| rows.iter_mut().for_each(|row| *row = Vec3::new(-row.x, -row.y, row.z)),
    |rows, _| rows.iter_mut().for_each(|row| *row = -*row),
    |rows, _| rows.iter_mut().for_each(|row| *row = Vec3::new(row.y, row.x, row.z)),
    |rows, _| rows.reverse(),
    |rows, _| rows.rotate_right(1),
    // Two signs of neighbours.
    |rows, rng| {
        let row = rng.usize(1..rows.len());
        for row in [row - 1, row] {
            let axis = rng.usize(..3);
            rows[row][axis] = -rows[row][axis];
        }
    },
    |rows, rng| {
        let row = rng.usize(1..rows.len());
        rows.swap(row - 1, row);
    },
    |rows, rng| {
        let (row, axis) = (rng.usize(..rows.len()), rng.usize(..3));
        rows[row][axis] = f32::from_bits(rows[row][axis].to_bits() ^ 1 << rng.u32(..31));
    },
];

#[test]
fn an_odometer_starts_anew_with_any_other_frame() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    assert!(rows.len().is_multiple_of(2), "an even number of signs changes");
    let next: Vec<Vec3> = rows.iter().map(|row| *row + Vec3::Y * 1e-3).collect();
    let mut rng = Rng::with_seed(1);
    for trial in 0..200 {
        let mut odometer = Odometer::new(&tree);
        let first = odometer.start(rows.as_slice()).motion().unwrap();
        let mut other = rows.clone();
        CHANGES[trial % CHANGES.len()](&mut other, &mut rng);
        let step = odometer.step(other.as_slice(), next.as_slice());
        assert_eq!(step.after().motion().unwrap().since(&first), None, "change {trial}");
        // It continues with the last measured frame, at any address.
        let before = step.after().motion().unwrap();
        let copy = next.clone();
        let step = odometer.step(copy.as_slice(), rows.as_slice());
        assert!(step.after().motion().unwrap().since(&before).is_some_and(|units| units > 0));
    }
}

#[test]
fn tables_of_another_length_are_not_measured() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    let short = &rows[1..];
    for (before, after) in [(short, &rows[..]), (&rows[..], short), (short, short)] {
        let mut odometer = Odometer::new(&tree);
        let first = odometer.start(rows.as_slice()).motion().unwrap();
        let step = odometer.step(before, after);
        assert_eq!(step.length(), f32::INFINITY);
        assert_eq!(step.after().motion().unwrap().since(&first), None);
    }
}

#[test]
fn readings_of_other_trees_and_runs_have_no_difference() {
    let one = MotionReading::start(1);
    assert_eq!((one.since(&one), one.after(&one)), (Some(0), Some(0)));
    for other in [MotionReading::start(2), MotionReading::start(1)] {
        assert_eq!((one.since(&other), one.after(&other)), (None, None));
    }
}

/// The unit is a number for any radii, also those that no mesh has: it and its inverse are neither zero nor infinite.
#[test]
fn radii_of_any_size_have_a_unit() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
    // With this length of a radius code, and the checksum corrected.
    let unit = |code: f32| {
        let mut bytes = built.blob().to_vec();
        bytes[field::RADIUS_UNIT..][..4].copy_from_slice(&code.to_le_bytes());
        let mut digest = CRC.digest();
        digest.update(&bytes[..field::CHECKSUM]);
        digest.update(&bytes[field::CHECKSUM + 4..]);
        bytes[field::CHECKSUM..][..4].copy_from_slice(&digest.finalize().to_le_bytes());
        let Unit { length, inverse } = Unit::of(&Tree::<u16>::from_bytes(&bytes).unwrap());
        assert!(length.is_normal() && inverse.is_normal(), "{code}: {length} {inverse}");
        assert_eq!(length * inverse, 1.0, "{code}");
        length
    };
    assert!(unit(1e-3) < unit(1.0) && unit(1.0) < unit(1e3));
    assert!(unit(0.0) == unit(1e-30) && unit(0.0) < 1e-27);
    assert!(unit(1e17) == unit(1e18) && unit(1e18) > 1e12);
}
