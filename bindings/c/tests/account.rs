//! The energy account in C: the same bits as in Rust, and its misuses.

// Requirement: P-06

use std::fmt::Write;
use std::fs;
use std::process::Command;

use dibs_nostd::constraint::{EnergyAccount, SpringDamper};
use dibs_nostd::glam::Vec3;

use crate::programs::{compile, run};

const TICKS: usize = 5_000;

/// A wall that jumps with its frames, and a hand that is pushed out; at times a number is not finite.
fn ticks() -> impl Iterator<Item = [Vec3; 2]> {
    (0..TICKS).map(|tick| {
        let frame = (tick / 33) as f32;
        let force = Vec3::new(2.5 + 2.5 * (frame * 1.7).sin(), (frame * 0.9).cos(), 0.25);
        let velocity = Vec3::new(120.0 * (tick as f32 * 0.013).sin(), 30.0, -5.0);
        match tick % 1_000 {
            700 => [Vec3::NAN, velocity],
            800 => [force, Vec3::INFINITY],
            _ => [force, velocity],
        }
    })
}

#[test]
fn an_account_gives_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let spring = SpringDamper::stiffness(1.0).max_force(5.0);
    let mut account = EnergyAccount::new(1.0, 0.5, &spring, 300.0).expect("in range");
    let (mut lines, mut expected, mut reduced) = (String::new(), Vec::new(), 0);
    for [force, velocity] in ticks() {
        let numbers = [force, velocity].map(|of| of.to_array());
        let numbers = numbers.as_flattened().iter().map(ToString::to_string);
        writeln!(lines, "{}", numbers.collect::<Vec<_>>().join(" ")).expect("a string");
        let passed = account.pass(force, velocity, 0.001);
        reduced += usize::from(passed != force);
        let words = [passed.x, passed.y, passed.z, account.balance()];
        expected.push(words.map(|word| format!("{:08x}", word.to_bits())).join(" "));
    }
    assert!(reduced > 500 && reduced < TICKS - 500, "{reduced}");
    let path = folder.path().join("forces");
    fs::write(&path, lines).expect("writable");
    let said = run(Command::new(compile("account", folder.path())).arg(path));
    for (number, (c, rust)) in said.lines().zip(&expected).enumerate() {
        assert_eq!(c, rust, "tick {number}");
    }
    assert_eq!(said.lines().count(), TICKS + 1);
    assert!(said.ends_with(" checks, 0 failures\n"), "{said}");
}
