//! `dibs filter`: admitted poses keep the stand-off, and bad input is named.

// Requirements: C-05, P-08

use std::fs::write;
use std::iter;
use std::path::Path;

use serde_json::Value;

use crate::program::{dibs, fails, succeeds};

fn heart(folder: &Path) {
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 1.5");
}

/// A shaft that is pushed at 100 mm/s into the side of the heart and out again.
fn push(ticks: u32) -> String {
    let far = |tick: u32| 0.1 * f64::from(tick.min(ticks - tick));
    (0..ticks).map(|tick| format!("capsule:{0},3,60,{0},80,90,2.5\n", 95.0 - far(tick))).collect()
}

fn lines(folder: &Path, options: &str) -> Vec<Value> {
    let line = format!(
        "filter heart.dibs --motion heart.pc2 --path commands.csv --stand-off 1 --json {options}"
    );
    let text = succeeds(folder, &line);
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn admitted_poses_keep_the_stand_off() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    write(folder.join("commands.csv"), push(1_600)).unwrap();
    let commands: Vec<String> = push(1_600).lines().map(str::to_owned).collect();
    let filtered = lines(folder, "");
    assert_eq!(filtered.len(), commands.len());
    let mut reasons = [0; 2];
    for (tick, (line, command)) in filtered.iter().zip(&commands).enumerate() {
        assert_eq!(line["tick"], tick);
        assert!(line["least_separation"].as_f64().unwrap() > 0.98, "{line}");
        assert!(line["instructions"].as_u64().unwrap() <= 200_000);
        let is_commanded = line["reason"] == "commanded";
        reasons[usize::from(is_commanded)] += 1;
        assert!(
            is_commanded || line["reason"] == "nearest" || line["reason"] == "retreating",
            "{line}"
        );
        let is_whole = line["admitted"].as_str().unwrap() == command;
        assert!(!is_commanded || is_whole, "{line} {command}");
    }
    assert!(reasons.into_iter().all(|count| count > 200), "{reasons:?}");
    // Eased, it is slowed sooner.
    let eased = lines(folder, "--approach 20");
    let commanded = eased.iter().filter(|line| line["reason"] == "commanded").count();
    assert!(commanded > 200 && commanded < reasons[1], "{commanded} of {}", reasons[1]);
    // The pose at the end of a tick begins the next: the tracker sees the tissue there, late by a frame.
    let lowers = |poses: &[&str], options: &str| -> Vec<f64> {
        write(folder.join("poses.csv"), poses.join("\n")).unwrap();
        let line = format!("track heart.dibs --motion heart.pc2 --path poses.csv --json {options}");
        let text = succeeds(folder, &line);
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        lines.map(|line| line["lower"].as_f64().unwrap()).collect()
    };
    let least = |lowers: Vec<f64>| lowers.into_iter().fold(f64::INFINITY, f64::min);
    let whole: Vec<&str> = commands.iter().map(String::as_str).collect();
    assert!(least(lowers(&whole, "--surface interpolated")) < -5.0);
    let admitted = |lines: &[Value], late: usize| -> Vec<String> {
        let start = iter::repeat_n(commands[0].clone(), late + 1);
        start
            .chain(lines.iter().map(|line| line["admitted"].as_str().unwrap().to_owned()))
            .collect()
    };
    // A motion of 30 frames a second is late by 33 1/3 ticks; the third is less than the age that the filter allows. And one whose
    // frames are ticks: its tissue may move by 3.1 mm in a tick and in the one that the surface is old.
    let quick = lines(folder, "--motion-rate 1000");
    assert!(quick.iter().all(|line| line["reason"] != "no safe motion"));
    for (filtered, late, options) in [(&filtered, 33, ""), (&quick, 1, "--motion-rate 1000")] {
        let poses = admitted(filtered, late);
        let poses: Vec<&str> = poses.iter().map(String::as_str).collect();
        let lowers = lowers(&poses, options);
        let near = lowers.iter().filter(|&&lower| lower < 5.0).count();
        assert!(near > 100, "{near} {options}");
        let least = least(lowers);
        assert!(least > 0.97, "{least}, a frame in {late} ticks");
    }
}

/// The side that the shaft is pushed into is a vessel: it stops 2 mm farther from there.
#[test]
fn a_label_has_a_larger_stand_off() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    let mesh = dibs_build::read(folder.join("heart.ply")).unwrap().mesh;
    let is_right = |rows: &[u32; 3]| rows.iter().all(|&row| mesh.positions[row as usize].x > 0.0);
    let labels: Vec<u8> = mesh.triangles.iter().map(|rows| 2 * u8::from(is_right(rows))).collect();
    let text: String = labels.iter().map(|label| format!("{label}\n")).collect();
    write(folder.join("tissues.txt"), text).unwrap();
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 1.5 --labels tissues.txt");
    write(folder.join("commands.csv"), push(800)).unwrap();
    let least = |options: &str| {
        let separations = lines(folder, options).into_iter().map(|line| {
            assert_ne!(line["reason"], "no safe motion", "{line}");
            line["least_separation"].as_f64().unwrap()
        });
        separations.fold(f64::INFINITY, f64::min)
    };
    let (bare, vessel, other) = (least(""), least("--stand-off 2=3"), least("--stand-off 0=3"));
    assert_eq!(bare.to_bits(), other.to_bits());
    assert!((0.98..1.1).contains(&bare), "{bare}");
    // What is certain of the whole surface, farther than its own stand-off, is less by a tick's step of 0.1 mm at most.
    assert!((1.85..2.1).contains(&(vessel - bare)), "{bare} {vessel}");
}

#[test]
fn a_start_inside_is_no_pass() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    write(folder.join("commands.csv"), "sphere:56,3,60,2\n".repeat(50)).unwrap();
    let inside = lines(folder, "");
    let least = |line: &Value| line["least_separation"].as_f64().unwrap();
    assert!(least(&inside[0]) < -1.0, "{}", inside[0]);
    for line in &inside {
        assert!(line["reason"] == "no safe motion" || least(line) > 0.98, "{line}");
    }
    // It leaves, and comes no nearer to its command.
    assert!(least(&inside[49]) > 0.98 && inside[49]["reason"] == "nearest", "{}", inside[49]);
}

#[test]
fn bad_input_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart(folder);
    write(folder.join("commands.csv"), push(10)).unwrap();
    let line = "filter heart.dibs --motion heart.pc2 --path commands.csv";
    for (options, named) in [
        ("--stand-off -1", "--stand-off is -1"),
        ("--stand-off nan", "--stand-off is NaN"),
        ("--stand-off 1 --stand-off 2", "give exactly one without a label; there are 2"),
        ("--stand-off 2=3", "give exactly one without a label; there are 0"),
        ("--stand-off 1 --stand-off 2=3", "no triangle of heart.dibs has this label"),
        ("--stand-off 1 --stand-off 2=0.5", "--stand-off is 2=0.5: give at least 1"),
        ("--stand-off 1 --stand-off 2=nan", "--stand-off is 2=NaN: give at least 1"),
        ("--stand-off 1 --rate 0", "--rate is 0"),
        ("--stand-off 1 --rate nan", "--rate is NaN"),
        ("--stand-off 1 --rate -5", "--rate is -5"),
        ("--stand-off 1 --robot-speed 0", "--robot-speed is 0"),
        ("--stand-off 1 --tissue-speed inf", "--tissue-speed is inf"),
        ("--stand-off 1 --age -1", "--age is -1"),
        ("--stand-off 1 --approach -1", "--approach is -1"),
        ("--stand-off 1 --registration nan", "--registration is NaN"),
    ] {
        let error = fails(folder, &format!("{line} {options}"));
        assert!(error.contains(named), "{options}: {error}");
    }
    // What is no stand-off at all is a mistake of the line, as with every option.
    for (of_label, named) in [("256=3", "256: no label from 0 to 255"), ("2=x", "x: no number")] {
        let output = dibs(folder, &format!("{line} --stand-off 1 --stand-off {of_label}"));
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(named), "{of_label}: {error}");
    }
    for (second, named) in [
        ("capsule:0,0,90,0,0,95,2", "tool 2: is another tool"),
        ("sphere:95,3,60,2.5", "tool 2: is another tool"),
        ("capsule:95,3,60,95,80,90,2", "tool 2: is another tool"),
        ("capsule:nan,3,60,95,80,90,2.5", "commands.csv, line 2: "),
    ] {
        let text = format!("capsule:95,3,60,95,80,90,2.5\n{second}\n");
        write(folder.join("commands.csv"), text).unwrap();
        let error = fails(folder, &format!("{line} --stand-off 1"));
        assert!(error.contains(named), "{second}: {error}");
    }
    // A stand-off that no place has: nothing passes.
    write(folder.join("commands.csv"), push(10)).unwrap();
    let output = dibs(folder, &format!("{line} --stand-off 1e6 --json"));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.lines().count() == 10 && text.lines().all(|line| line.contains("no safe motion")));
}
