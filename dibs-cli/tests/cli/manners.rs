//! What shells, scripts and `man` ask of a program.

// Requirement: P-08

use std::process::Command;

use crate::program::{dibs, fails, json, succeeds};

const COMMANDS: [&str; 11] = [
    "build",
    "stretch",
    "inspect",
    "query",
    "track",
    "filter",
    "view",
    "stream",
    "generate",
    "completions",
    "man",
];

#[test]
fn shells_complete_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeeds(folder, &format!("completions {shell}"));
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(script.contains("poses") && script.contains("largest-component"), "{shell}");
        std::fs::write(folder.join(shell), script).unwrap();
    }
    // Where there is a bash, its script is a script.
    if let Ok(output) = Command::new("bash").current_dir(folder).args(["-n", "bash"]).output() {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(!dibs(folder, "completions cmd.exe").status.success());
}

#[test]
fn every_command_has_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let page = succeeds(folder, "man");
    assert!(page.contains(".TH dibs 1") && page.contains("dibs\\-query(1)"), "{page}");
    succeeds(folder, "man -o share/man1");
    for command in COMMANDS {
        let page = std::fs::read_to_string(folder.join(format!("share/man1/dibs-{command}.1")));
        assert!(page.unwrap().contains("Examples:"), "{command}");
    }
    std::fs::write(folder.join("file"), "").unwrap();
    assert!(fails(folder, "man -o file/man1").contains("file/man1: cannot be made"));
}

/// Every command that has results has them as JSON, too.
#[test]
fn results_are_json_where_a_script_asks() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = json(folder, "generate heart --triangles 320 -o h.stl --motion h.pc2 --json");
    assert_eq!((&made["triangles"], &made["vertices"]), (&320.into(), &162.into()));
    assert_eq!((&made["output"], &made["motion"]["frames"]), (&"h.stl".into(), &25.into()));
    let brain = json(folder, "generate --json brain --triangles 500 -o b.ply");
    assert!(brain["motion"].is_null() && brain["triangles"] == 500, "{brain}");
    for command in COMMANDS.iter().filter(|command| !["completions", "man"].contains(command)) {
        let help = succeeds(folder, &format!("{command} --help"));
        assert!(help.contains("--json"), "{command}");
    }
}

/// Coloured as clap's own errors, and for eyes alone.
#[test]
fn errors_are_coloured_where_colours_are_wanted() {
    let says = |name: &str, value: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dibs"));
        command.args(["inspect", "absent.dibs"]).env_remove("NO_COLOR").env(name, value);
        String::from_utf8(command.output().unwrap().stderr).unwrap()
    };
    let painted = says("CLICOLOR_FORCE", "1");
    assert!(painted.starts_with("\u{1b}[") && painted.contains("error:\u{1b}["), "{painted:?}");
    for (name, value) in [("NO_COLOR", "1"), ("TERM", "xterm-256color")] {
        let plain = says(name, value);
        assert!(plain.starts_with("error: absent.dibs: "), "{plain:?}");
    }
}

/// A negative number is not taken for an option, with a tip that helps nobody.
#[test]
fn a_negative_number_is_a_wrong_value() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o h.ply --motion h.pc2");
    assert!(
        fails(folder, "stretch h.ply --motion h.pc2 --margin -0.1")
            .contains("a margin of -0.1 makes no sense")
    );
    let to = "--to udp:127.0.0.1:9";
    assert!(
        fails(folder, &format!("stream h.ply --motion h.pc2 {to} --motion-rate -1"))
            .contains("-1 frames a second; give a --motion-rate")
    );
    let output = dibs(folder, &format!("stream h.ply --motion h.pc2 {to} --frames -3"));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(
        error.contains("invalid value '-3' for '--frames") && !error.contains("tip:"),
        "{error}"
    );
}
