//! The paper's path of table 3, as the firmware has it.

// Requirement: E-05

use dibs_nostd::Tool;
use dibs_tests::method::Probe;
use dibs_tests::streams::Beat;

/// So that the board's row of table 3 is of the same path as the others.
#[test]
fn the_tool_about_the_heart_moves_as_the_firmware_s() {
    let motion = dibs_build::generate::heart(10_272).expect("a valid size").motion;
    let beat = Beat::new(&motion);
    for tick in (0..77_000).step_by(137) {
        let Probe::Capsule(ours) = beat.tool(tick) else { panic!("a capsule") };
        let theirs = controller::instrument(tick).expect("a valid tool");
        let off = ours.start().distance(theirs.start()).max(ours.end().distance(theirs.end()));
        assert!(off < 1e-3 && ours.radius() == theirs.radius(), "{tick}: {ours:?} {theirs:?}");
    }
}
