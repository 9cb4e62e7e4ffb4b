//! A tool is written in one way for `--tool`, `--poses` and `--path`.

// Requirement: P-08

use std::fs::write;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::program::{dibs, fails, json, succeeds};

/// Ways to write a sphere, and a capsule.
const SPHERES: [&str; 5] = [
    "1,-2,90,5",
    "sphere:1,-2,90,5",
    "1, -2, 90, 5",
    "sphere: 1, -2, 90, 5",
    r#"{"sphere": [1, -2, 90, 5]}"#,
];
const CAPSULES: [&str; 4] = [
    "-1,0,90,9,0,150,2",
    "capsule:-1,0,90,9,0,150,2",
    " -1,0,90, 9,0,150, 2\r",
    r#"[{"capsule": [-1, 0, 90, 9, 0, 150, 2]}]"#,
];

fn heart(folder: &Path) {
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs");
    write(folder.join("page.html"), "<!--data-->").unwrap();
}

fn by_tool(folder: &Path, tool: &str) -> Value {
    let arguments = ["query", "heart.dibs", "--json", "--tool", tool];
    let program =
        Command::new(env!("CARGO_BIN_EXE_dibs")).current_dir(folder).args(arguments).output();
    serde_json::from_slice(&program.unwrap().stdout)
        .unwrap_or_else(|error| panic!("{tool}: {error}"))
}

#[test]
fn every_spelling_is_taken_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    let heads = ["", "\u{feff}x,y,z,r\n\n"];
    let follow = [
        "track heart.dibs --motion heart.pc2 --json --path path.csv",
        "filter heart.dibs --motion heart.pc2 --json --stand-off 1 --path path.csv",
    ];
    for spellings in [&SPHERES[..], &CAPSULES] {
        let single = by_tool(folder, spellings[0]);
        let mut followed = Vec::new();
        for (number, spelling) in spellings.iter().enumerate() {
            assert_eq!(by_tool(folder, spelling), single, "{spelling}");
            let text = format!("{}{spelling}\n\n{spelling}", heads[number % 2]);
            write(folder.join("path.csv"), text).unwrap();
            let poses = succeeds(folder, "query heart.dibs --poses path.csv");
            assert_eq!(poses.lines().count(), 2);
            for line in poses.lines() {
                let mut line: Value = serde_json::from_str(line).unwrap();
                line.as_object_mut().unwrap().remove("line");
                assert_eq!(line, single, "{spelling}");
            }
            let mut said = follow.map(|line| succeeds(folder, line)).to_vec();
            succeeds(folder, "view heart.dibs --path path.csv --page page.html -o view.html");
            said.push(std::fs::read_to_string(folder.join("view.html")).unwrap());
            followed.push(said);
        }
        assert!(followed.iter().all(|said| *said == followed[0]), "{followed:?}");
    }
}

/// What is no tool is named in the same words, with its line where it has one.
#[test]
fn what_is_no_tool_is_named_alike() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    for (tool, named) in [
        ("1,2,3", "3 numbers are no tool: give X,Y,Z,R for a sphere"),
        ("sphere:1,2,3", "'sphere' of 3 numbers is no tool: expected sphere:X,Y,Z,R"),
        ("capsule:1,2,3,4", "'capsule' of 4 numbers is no tool: expected"),
        ("cone:1,2,3,4", "'cone' of 4 numbers is no tool: expected"),
        ("sphere:1,x,3,4", "value 2, 'x', is not a number"),
        ("1,2,nan,4", "NaN is not within"),
    ] {
        let output = dibs(folder, &format!("query heart.dibs --tool {tool}"));
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(named), "{error}");
        write(folder.join("path.csv"), format!("0,0,90,5\n{tool}\n")).unwrap();
        for line in [
            "track heart.dibs --motion heart.pc2 --path path.csv",
            "filter heart.dibs --motion heart.pc2 --path path.csv --stand-off 1",
            "view heart.dibs --path path.csv --page page.html -o view.html",
        ] {
            let error = fails(folder, line);
            assert!(error.starts_with("path.csv, line 2: ") && error.contains(named), "{error}");
        }
    }
    write(folder.join("path.csv"), "sphere:0,0,90,5 sphere:0,0,99,5\n").unwrap();
    let error = fails(folder, "track heart.dibs --motion heart.pc2 --path path.csv");
    assert!(error.contains("line 1: 2 tools in place of one") && error.contains("one tool a line"));
}

/// `--path -` reads another program's poses, and earlier spellings still work.
#[test]
fn a_path_is_read_from_standard_input_and_earlier_words_hold() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    write(folder.join("path.csv"), "0,0,90,5\n0,0,91,5\n").unwrap();
    let line = "track heart.dibs --motion heart.pc2 --path";
    let mut child = Command::new(env!("CARGO_BIN_EXE_dibs"))
        .current_dir(folder)
        .args(line.split(' ').chain(["-"]))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"0,0,90,5\n0,0,91,5\n").unwrap();
    let read = String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap();
    assert_eq!(read, succeeds(folder, &format!("{line} path.csv")));

    for (earlier, today) in [
        ("heart.ply heart.pc2", "heart.ply --motion heart.pc2"),
        ("heart.ply heart.pc2 --edges", "heart.ply --motion heart.pc2 --construction paper"),
    ] {
        let [earlier, today] =
            [earlier, today].map(|words| json(folder, &format!("stretch {words} --json")));
        assert_eq!(earlier, today);
    }
    let view = "--page page.html -o view.html --motion-rate 9";
    let pages = ["heart.dibs heart.pc2", "heart.dibs --motion heart.pc2"].map(|words| {
        succeeds(folder, &format!("view {words} {view}"));
        std::fs::read_to_string(folder.join("view.html")).unwrap()
    });
    assert_eq!(pages[0], pages[1]);
}
