//! `docs/black-channel.md` against the tests that it names and the arithmetic that it shows.

use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Vertices of the heart, rows of a packet of 1,024 bytes without and with a tag, and the rates.
const VERTICES: u32 = 5_138;
const ROWS: [u32; 2] = [(1024 - 22) / 6, (1024 - 28) / 6];
const FRAMES_A_SECOND: f64 = 40.0;
const HEARTBEATS_A_SECOND: f64 = 10.0;
const FORGERIES_A_SECOND: f64 = 10_000.0;
const HOUR: f64 = 3_600.0;

/// The arithmetic, as the page shows it.
fn arithmetic() -> String {
    let [crc, digest, tag] = [32, 32, 48].map(|bits| 0.5_f64.powi(bits));
    assert_eq!(ROWS.map(|rows| VERTICES.div_ceil(rows)), [31, 31], "packets of rows");
    // The begin and the rows: damage to a commit can only make the digest wrong.
    let packets = f64::from(VERTICES.div_ceil(ROWS[0]) + 1) * FRAMES_A_SECOND * HOUR;
    let heartbeats = HEARTBEATS_A_SECOND * HOUR;
    let forgeries = FORGERIES_A_SECOND * HOUR;
    let mut text = String::new();
    for (name, value, unit) in [
        ("chances an hour: packets of a frame", packets, ""),
        ("chances an hour: heartbeats", heartbeats, ""),
        ("without a key, damage: a row is wrong", packets * crc * digest, " an hour"),
        ("without a key, damage: a heartbeat that was none", heartbeats * crc, " an hour"),
        ("with a key, damage: a row is wrong", packets * crc * digest * tag, " an hour"),
        ("with a key, damage: a heartbeat that was none", heartbeats * crc * tag, " an hour"),
        (
            "with a key, 10,000 forgeries a second: a row is wrong",
            forgeries * tag * digest,
            " an hour",
        ),
        ("with a key, 10,000 forgeries a second: a false heartbeat", forgeries * tag, " an hour"),
        ("with a key, until 500 forgeries trip the watch: the same", 500.0 * tag, " a trip"),
    ] {
        writeln!(text, "{name:<59}{value:.2e}{unit}").unwrap();
    }
    text
}

#[test]
fn the_black_channel_page_is_true() {
    let page = include_str!("../../docs/black-channel.md");
    let shown = page.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    assert!(shown == arithmetic(), "docs/black-channel.md must show\n{}", arithmetic());
    let mut named = 0;
    for quoted in page.split('`').skip(1).step_by(2) {
        let Some((file, test)) =
            quoted.split_once("::").filter(|(file, _)| file.starts_with("bus"))
        else {
            continue;
        };
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(file).with_extension("rs");
        let source = fs::read_to_string(&path).unwrap();
        assert!(source.contains(&format!("fn {test}(")), "{file} has no test {test}");
        named += 1;
    }
    assert!(named >= 16, "{named} tests are named");
    // Every kind of error of IEC 61784-3 has a row with a test in it.
    for error in [
        "corruption",
        "unintended repetition",
        "incorrect sequence",
        "loss",
        "unacceptable delay",
        "insertion",
        "masquerade",
        "addressing",
    ] {
        let row = page.lines().find(|line| line.starts_with(&format!("| {error} |")));
        assert!(row.is_some_and(|row| row.contains("`bus")), "{error}");
    }
}
