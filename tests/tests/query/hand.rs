//! A hand pushes an instrument into surfaces: the force of all contacts keeps it out everywhere, but the force of the
//! closest pair does not.

// Requirement: C-03

use dibs_tests::hand::scenes;

#[test]
fn a_hand_does_not_get_through() {
    let mut alone_failed = Vec::new();
    for scene in scenes() {
        let name = scene.name;
        for by_all in [true, false] {
            let pushed = scene.push(by_all);
            let which = if by_all { "all contacts" } else { "closest pair" };
            println!("{name:13} {which}: {pushed:?}");
            assert!(!by_all || pushed.step <= 0.5 && pushed.given <= 1.0, "{name}: {pushed:?}");
            assert!(!by_all || !pushed.is_through(), "{name}: the centre went through, {pushed:?}");
            if !by_all && pushed.is_through() {
                alone_failed.push(name);
            }
        }
    }
    assert_eq!(alone_failed, ["corner", "groove"]);
}

/// Filtered commands do not penetrate.
#[test]
fn a_hand_s_commands_do_not_get_through() {
    for scene in scenes() {
        let pushed = scene.command(true);
        // The stand-off is 0: the instrument comes close, but does not penetrate.
        assert!((-0.011..0.1).contains(&pushed.least), "{}: {pushed:?}", scene.name);
    }
}
