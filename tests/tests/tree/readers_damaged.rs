//! Damaged mesh files are refused with a message, or give a valid mesh; no reader panics.

// Requirement: M-03

use std::fmt::Write;

use dibs_build::{Import, ReadErrorKind, ReadOptions};
use proptest::prelude::*;

use crate::mesh_files::{Folder, samples};

/// Checks the guarantees of every accepted mesh.
fn check_promises(import: &Import) {
    let mesh = &import.mesh;
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    for t in &mesh.triangles {
        assert!(t.iter().all(|&v| (v as usize) < mesh.positions.len()));
        assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    }
}

/// Bytes with a meaning in some format.
const TELLING: &[u8] = b"0123456789-+.eE/\\# \n\rvfnaif\0\xff";

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bits are flipped, bytes are overwritten with bytes of such files, cut out or doubled, and the end is cut off.
    #[test]
    fn damaged_files_never_panic(
        which in 0_usize..7,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..5, any::<u8>(), 1_usize..9), 1..6),
        largest_component: bool,
        weld in prop::option::of(0.0_f32..20.0),
    ) {
        let (name, _, mut bytes) = samples().swap_remove(which);
        for (at, kind, value, length) in changes {
            if bytes.is_empty() { break; }
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes[at] ^= 1 << (value % 8),
                1 => bytes[at] = TELLING[usize::from(value) % TELLING.len()],
                2 => drop(bytes.drain(at..end)),
                3 => { let copy = bytes[at..end].to_vec(); bytes.splice(at..at, copy); }
                _ => bytes.truncate(at),
            }
        }
        let folder = Folder::new();
        let path = folder.put(name, bytes);
        let options = ReadOptions { largest_component, weld_tolerance: weld, ..Import::options() };
        match options.read(path) {
            Ok(import) => check_promises(&import),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{}", error),
        }
    }

    /// Polygons of any shape, flat or not, simple or not, are cut without panic: n corners give up to n - 2 triangles.
    #[test]
    fn polygons_of_any_shape_are_cut(
        points in prop::collection::vec((-5_i8..5, -5_i8..5, -1_i8..2), 3..40)
    ) {
        let mut text = String::new();
        for (x, y, z) in &points {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        text += "f";
        for i in 1..=points.len() {
            write!(text, " {i}").unwrap();
        }
        let options = ReadOptions { largest_component: true, ..Import::options() };
        match Folder::new().read_with(options, &text) {
            Ok(import) => {
                check_promises(&import);
                let report = &import.report;
                let triangles: usize = report.components.iter().sum();
                let cut = triangles + report.dropped_degenerate + report.dropped_duplicates;
                prop_assert!(cut <= points.len() - 2, "{} triangles", cut);
            }
            Err(kind) => prop_assert!(matches!(kind, ReadErrorKind::NoTriangles { .. }), "{}", kind),
        }
    }
}
