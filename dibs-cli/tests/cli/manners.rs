//! What shells, scripts and `man` ask of a program.

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
