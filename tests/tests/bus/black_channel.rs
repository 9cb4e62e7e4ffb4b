//! Checks `docs/black-channel.md`: the tests that it names exist, and its arithmetic is correct.

// Requirement: B-06

use std::fmt::Write;
use std::fs;
use std::path::Path;

use dibs_nostd::BusHealth;
use dibs_nostd::format::CRC;

/// The page's assumptions: vertices of the heart, rows of a packet of 1,024 bytes without and with a tag, and rates.
const VERTICES: u32 = 5_138;
const ROWS: [u32; 2] = [(1024 - 22) / 6, (1024 - 28) / 6];
const FRAMES_A_SECOND: f64 = 40.0;
const HEARTBEATS_A_SECOND: f64 = 10.0;
const FORGERIES_A_SECOND: f64 = 10_000.0;
const HOUR: f64 = 3_600.0;
/// 1 % of the failure rate allowed for a SIL 3 function (1/h).
const ALLOWANCE_AN_HOUR: f64 = 1e-9;

/// A number between 1,000 and 999,999, with a comma.
fn grouped(number: u32) -> String {
    format!("{},{:03}", number / 1_000, number % 1_000)
}

/// The arithmetic, as the page shows it.
fn arithmetic() -> String {
    let [crc, digest, tag] = [32, 32, 48].map(|bits| 0.5_f64.powi(bits));
    assert_eq!(ROWS.map(|rows| VERTICES.div_ceil(rows)), [31, 31], "packets of rows");
    // The begin and the rows: damage to a commit can only make the digest wrong.
    let packets = f64::from(VERTICES.div_ceil(ROWS[0]) + 1) * FRAMES_A_SECOND * HOUR;
    let heartbeats = HEARTBEATS_A_SECOND * HOUR;
    let forgeries = FORGERIES_A_SECOND * HOUR;
    // At this rate the receiver forgets as many forgeries as arrive; no limit may exceed the number that it remembers.
    let slow = f64::from(BusHealth::FORGERIES_A_SECOND) * HOUR;
    let most = f64::from(BusHealth::MOST_FORGERIES);
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
        ("with a key, forgeries that never trip the watch: a row", slow * tag * digest, " an hour"),
        ("with a key, forgeries that never trip the watch: heartbeat", slow * tag, " an hour"),
        ("with a key, the most that a watch lets by at once: the same", most * tag, " a trip"),
    ] {
        writeln!(text, "{name:<62}{value:.2e}{unit}").unwrap();
    }
    let trip = most / (FORGERIES_A_SECOND - f64::from(BusHealth::FORGERIES_A_SECOND));
    writeln!(text, "with a key, 10,000 forgeries a second: safe after at most     {trip:.2} s")
        .unwrap();
    let one_in = ALLOWANCE_AN_HOUR.recip() * heartbeats * crc;
    let damaged = grouped(one_in.ceil() as u32);
    writeln!(text, "without a key, 1e-9 an hour: at most one heartbeat damaged in {damaged}")
        .unwrap();
    text
}

/// The page compares each rate with the allowance.
#[test]
fn the_rates_compare_with_the_allowance_as_the_page_says() {
    let text = arithmetic();
    let is_below = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name)).expect("a line");
        let rate: f64 = line[62..].split(' ').next().unwrap().parse().unwrap();
        rate < ALLOWANCE_AN_HOUR
    };
    assert!(is_below("without a key, damage: a row is wrong"));
    assert!(is_below("with a key, damage: a row is wrong"));
    assert!(is_below("with a key, 10,000 forgeries a second: a row is wrong"));
    assert!(is_below("with a key, damage: a heartbeat that was none"));
    assert!(!is_below("without a key, damage: a heartbeat that was none"));
    assert!(!is_below("with a key, 10,000 forgeries a second: a false heartbeat"));
    assert!(is_below("with a key, forgeries that never trip the watch: a row"));
    assert!(is_below("with a key, forgeries that never trip the watch: heartbeat"));
    assert!(is_below("with a key, the most that a watch lets by at once: the same"));
}

/// The syndrome of each single flipped bit of a packet: how it changes the checksum's remainder.
fn syndromes(bytes: usize) -> Vec<u32> {
    let mut packet = vec![0; bytes - 4];
    let undamaged = CRC.checksum(&packet);
    let mut syndromes: Vec<u32> = (0..32).map(|bit| 1 << bit).collect();
    for bit in 0..8 * packet.len() {
        packet[bit / 8] ^= 1 << (bit % 8);
        syndromes.push(CRC.checksum(&packet) ^ undamaged);
        packet[bit / 8] ^= 1 << (bit % 8);
    }
    syndromes
}

/// Damage is undetected if the syndromes of its bits cancel. No two or three cancel in a packet of 1,024 bytes, and no
/// four in one of 375.
#[test]
fn the_checksum_finds_as_many_flips_as_the_page_says() {
    let mut singles = syndromes(1024);
    singles.sort_unstable();
    assert!(singles[0] != 0 && singles.windows(2).all(|two| two[0] != two[1]));
    let mut is_single = vec![false; 1 << 20];
    let slot = |syndrome: u32| (syndrome >> 12) as usize;
    singles.iter().for_each(|&syndrome| is_single[slot(syndrome)] = true);
    for (i, a) in singles.iter().enumerate() {
        for b in &singles[..i] {
            let both = a ^ b;
            assert!(!is_single[slot(both)] || singles.binary_search(&both).is_err(), "three bits");
        }
    }
    let short = syndromes(375);
    let pairs = short.iter().enumerate().flat_map(|(i, a)| short[..i].iter().map(move |b| a ^ b));
    let mut pairs: Vec<u32> = pairs.collect();
    pairs.sort_unstable();
    assert!(pairs.windows(2).all(|two| two[0] != two[1]), "four bits");
}

#[test]
fn the_black_channel_page_is_true() {
    let page = include_str!("../../../docs/black-channel.md");
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
