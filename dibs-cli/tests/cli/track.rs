//! `dibs track --budget` and `--contacts`: the interval stays certain, and a tick says what its budget left open.

// Requirements: P-08, T-02

use std::fs::write;
use std::path::Path;

use serde_json::Value;

use crate::program::{fails, succeeds};

/// A shaft that is pushed through the side of the heart and out again, past its rim.
fn path(ticks: u32) -> String {
    let depth = |tick: u32| 60.0 - 0.2 * f64::from(tick.min(ticks - tick));
    (0..ticks).map(|tick| format!("capsule:{0},3,60,{0},80,90,2.5\n", 45.0 + depth(tick))).collect()
}

fn lines(folder: &Path, options: &str) -> Vec<Value> {
    let line = format!("track heart.dibs --motion heart.pc2 --path path.csv --json {options}");
    let text = succeeds(folder, &line);
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or(f64::NEG_INFINITY)
}

#[test]
fn a_budget_widens_the_interval_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 2000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 1.5");
    write(folder.join("path.csv"), path(600)).unwrap();
    let whole = lines(folder, "--contacts 6");
    assert!(whole.iter().all(|line| line["is_cut"] == false && line["is_kept"] == false));
    for side in ["outside", "crossing"] {
        assert!(whole.iter().filter(|line| line["side"] == side).count() > 50, "{side}");
    }
    let mut cut_before = usize::MAX;
    for budget in [20_000, 60_000, 2_000_000] {
        let ticks = lines(folder, &format!("--budget {budget} --contacts 6"));
        assert_eq!(ticks.len(), whole.len());
        let (mut cut, mut late, mut begun) = (0, 0, 0);
        for (tick, (line, exact)) in ticks.iter().zip(&whole).enumerate() {
            // The exact separation is within [lower, separation] of its own, and both intervals hold the truth.
            let truth = [0, 1].map(|end| exact["interval"][end].as_f64().unwrap());
            let least = line["interval"][0].as_f64().unwrap_or(f64::NEG_INFINITY);
            let most = line["interval"][1].as_f64().unwrap();
            assert!(least <= truth[1] && most >= truth[0], "{line} {exact}");
            // A start says that it is one, and which of its ticks are cut.
            assert_eq!(line["fallback"] == "start", tick == 0, "{line}");
            assert!(line["side"] != "undefined" || line["is_cut"] == true, "{line}");
            late += u32::from(line["side"] == "undefined");
            // After the first ticks no side is lost: a constraint always has something to act on.
            if tick >= 100 {
                assert_ne!(line["side"], "undefined", "{line}");
                let length: f64 = (0..3)
                    .map(|axis| line["direction"][axis].as_f64().unwrap().powi(2))
                    .sum::<f64>();
                assert!((length - 1.0).abs() < 1e-3, "{line}");
            }
            let width = number(line, "separation") - number(line, "lower");
            if line["is_cut"] == false {
                let own = number(exact, "separation") - number(exact, "lower");
                assert!(width <= own.max(0.17), "{line} {exact}");
            } else {
                cut += 1;
            }
            // Every contact below the bound is there.
            let bound = number(line, "contacts_bound");
            let listed = line["contacts"].as_array().unwrap();
            let all = exact["contacts"].as_array().unwrap();
            let below = |contact: &&Value| number(contact, "separation") < bound - 0.2;
            assert!(listed.len() >= all.iter().filter(below).count(), "{line} {exact}");
            // None is deeper than the first.
            if let Some(first) = listed.first() {
                begun += u32::from(line["is_cut"] == true);
                assert!(number(first, "separation") <= truth[1] + 0.01, "{line} {exact}");
            }
            assert!(
                bound <= 6.0 && listed.iter().all(|contact| number(contact, "separation") <= 6.0)
            );
        }
        assert!(begun > 20 || budget > 20_000, "{begun} lists of cut ticks at {budget}");
        assert!(late > 1 || budget > 20_000, "a start within {budget} has its side at once");
        assert!(cut <= cut_before && (budget > 20_000 || cut > 20), "{cut} at {budget}");
        cut_before = cut;
    }
    assert_eq!(cut_before, 0);
    // Without a memory the same budget loses the side: the flag says that the answer is cut.
    let single = lines(folder, "--budget 20000 --full");
    assert!(single.iter().any(|line| line["side"] == "undefined" && line["is_cut"] == true));
    assert!(single.iter().all(|line| line.get("contacts").is_none()));

    for (options, named) in [
        ("--contacts -1", "--contacts is -1: give a margin of at least 0"),
        ("--contacts nan", "--contacts is NaN"),
        ("--rate -3", "--rate is -3"),
    ] {
        let line = format!("track heart.dibs --motion heart.pc2 --path path.csv {options}");
        let error = fails(folder, &line);
        assert!(error.contains(named), "{options}: {error}");
    }
}
