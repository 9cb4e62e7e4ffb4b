//! `dibs query --poses`: many poses at once.

// Requirement: P-08

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use serde_json::Value;

use crate::program::{dibs, fails, json, succeeds};

/// A pose in bulk, and the same as options of a single query.
const POSES: [(&str, &str); 8] = [
    ("60.1,-20,30,5", "--tool sphere:60.1,-20,30,5"),
    ("\t-70,5,20,-90,0.3,80,4\r", "--tool capsule:-70,5,20,-90,0.3,80,4"),
    (" sphere:0,0,0,1 ", "--tool sphere:0,0,0,1"),
    ("capsule:0,0,0,0,0,200,4", "--tool capsule:0,0,0,0,0,200,4"),
    (
        "sphere:9,1,150,5 capsule:9,1,150,0,0,99,2",
        "--tool sphere:9,1,150,5 --tool capsule:9,1,150,0,0,99,2",
    ),
    // The nearest f32 is not that of the nearest f64.
    (
        r#"{"sphere": [1.00000017881393432617187499, 0, 90, 5e0]}"#,
        "--tool sphere:1.00000017881393432617187499,0,90,5",
    ),
    (r#"{"capsule":[1,2,-90,4,5,-99,0]}"#, "--tool capsule:1,2,-90,4,5,-99,0"),
    (
        r#"[{"capsule":[1,2,-90,4,5,-99,0]}, {"sphere":[0,1,2,3]}]"#,
        "--tool capsule:1,2,-90,4,5,-99,0 --tool sphere:0,1,2,3",
    ),
];

fn heart(folder: &Path) {
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs");
}

#[test]
fn answers_are_those_of_single_queries() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    let lines: Vec<&str> = POSES.iter().map(|(line, _)| *line).collect();
    let text = format!("\u{feff}x, y, z, radius\n{}\n\n", lines.join("\n\n"));
    std::fs::write(folder.join("poses.csv"), &text).unwrap();
    for options in ["", "--contacts 30", "--vertices heart.pc2 --frame 9 --stretch 1.5"] {
        let line = format!("query heart.dibs {options} --poses poses.csv");
        let answers = succeeds(folder, &line);
        assert_eq!(answers.lines().count(), POSES.len());
        for (number, (answer, (pose, tools))) in answers.lines().zip(POSES).enumerate() {
            let mut answer: Value = serde_json::from_str(answer).unwrap();
            let line = answer.as_object_mut().unwrap().remove("line");
            assert_eq!(line, Some((2 + 2 * number).into()), "{pose}");
            let single = json(folder, &format!("query heart.dibs {options} {tools} --json"));
            assert_eq!(answer, single, "{pose}");
        }
        assert_eq!(succeeds(folder, &format!("{line} -o answers.jsonl")), "");
        assert_eq!(std::fs::read_to_string(folder.join("answers.jsonl")).unwrap(), answers);
    }
}

#[test]
fn a_wrong_line_is_named_and_earlier_answers_stand() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    std::fs::write(folder.join("old.jsonl"), "what was there before").unwrap();
    let long = format!("1,2,3,{}", "4".repeat(70_000));
    for (line, part) in [
        ("1,2,x,4", "value 3, 'x', is not a number; give X,Y,Z,R for a sphere"),
        ("1,2,3", "3 numbers are no tool: give X,Y,Z,R for a sphere"),
        ("1,2,3,-4", "radius"),
        ("1,2,nan,4", "NaN is not within"),
        ("cone:1,2,3,4", "expected sphere:X,Y,Z,R"),
        ("{\"sphere\": [1, 2, 3]}", "column 20: invalid length 3"),
        ("{\"cone\": [1, 2, 3, 4]}", "unknown variant `cone`"),
        ("{\"sphere\": [1, 2, 3, 4]", "give {\"sphere\": [X, Y, Z, R]}"),
        ("[]", "no tools"),
        ("x,y,z,r", "'x', is not a number"),
        (&long, "longer than 65536 bytes"),
        (&"sphere:1,2,3,4 ".repeat(9), "9 tools are no chain"),
    ] {
        let text = format!("0,0,150,5\n0,0,151,5\n{line}\n0,0,152,5\n");
        std::fs::write(folder.join("poses.csv"), text).unwrap();
        let output = dibs(folder, "query heart.dibs --poses poses.csv");
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.starts_with("error: poses.csv, line 3: ") && error.contains(part), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        let answers = String::from_utf8(output.stdout).unwrap();
        let read = |line| serde_json::from_str::<Value>(line).unwrap()["line"].clone();
        assert_eq!(answers.lines().map(read).collect::<Vec<_>>(), [1, 2], "{answers}");
        let same = fails(folder, "query heart.dibs --poses poses.csv -o old.jsonl");
        assert_eq!(error.trim_end(), format!("error: {same}"));
    }
    let old = std::fs::read_to_string(folder.join("old.jsonl")).unwrap();
    assert_eq!(old, "what was there before");
    assert!(fails(folder, "query heart.dibs --poses absent.csv").contains("absent.csv: cannot"));
}

/// Whoever writes a pose and waits for its answer gets it.
#[test]
fn a_conversation_does_not_wait_for_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    let mut program = Command::new(env!("CARGO_BIN_EXE_dibs"))
        .current_dir(folder)
        .args(["query", "heart.dibs", "--poses", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut ask, answers) = (program.stdin.take().unwrap(), program.stdout.take().unwrap());
    let (send, received) = mpsc::channel();
    std::thread::spawn(move || {
        BufReader::new(answers).lines().map_while(Result::ok).for_each(|line| {
            send.send(line).unwrap_or_default();
        });
    });
    for number in 1..4 {
        writeln!(ask, "0,0,{},5", 100 + number).unwrap();
        let answer = received.recv_timeout(Duration::from_secs(60));
        if answer.is_err() {
            program.kill().unwrap();
        }
        let answer: Value = serde_json::from_str(&answer.unwrap()).unwrap();
        assert_eq!(answer["line"], number);
    }
    drop(ask);
    assert!(program.wait().unwrap().success());
}
