//! The benchmark itself: it runs, its methods agree, and its documents are those of its records.

// Requirement: E-05

use std::path::Path;

use dibs_bench::imaging::controller::{Controller, Tick, Times};
use dibs_bench::imaging::ours::Surface;
use dibs_bench::imaging::race::{Contender, Period, Race};
use dibs_bench::plan::{Options, Plan};
use dibs_bench::record::{Record, Records};
use dibs_bench::{contacts, documents, embedded, imaging, run, write};
use dibs_nostd::Sphere;
use dibs_nostd::glam::Vec3;
use dibs_tests::method::{Found, Probe};
use xtask::workspace;

#[test]
fn every_experiment_runs_and_all_methods_agree() {
    let records = run(&Plan::smoke(), &Options::default()).expect("methods agree");
    for experiment in ["brain", "heart", "ablation", "compare", "crossover", "histogram", "imaging"]
    {
        let count = records.0.iter().filter(|r| r.experiment == experiment).count();
        assert!(count > 10, "{experiment}: {count} records");
    }
    let contacts = records.0.iter().filter(|r| r.experiment == "contacts");
    // Two paths, a query and a tracker.
    assert_eq!(contacts.filter(|r| r.metric == "contacts" && r.mean > 0.1).count(), 4);
    let back: serde_json::Value =
        serde_json::from_str(&records.json().expect("numbers are finite")).expect("valid JSON");
    assert_eq!(back.as_array().map(Vec::len), Some(records.0.len()));
    let folder = tempfile::tempdir().expect("a folder");
    write(&records, folder.path()).expect("a writable folder");
    assert_eq!(Records::read(&folder.path().join("benchmarks.json")).expect("readable"), records);
    check(folder.path());
}

#[test]
fn the_committed_documents_are_what_the_committed_records_say() {
    check(&workspace::root().join("docs/evidence"));
}

/// Every document of a folder is the one that its records give.
fn check(folder: &Path) {
    let records = Records::read(&folder.join("benchmarks.json")).expect("readable");
    for (name, expected) in documents(&records).expect("drawable") {
        let path = folder.join(&name);
        let found = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(found == expected, "{name} is not made from benchmarks.json: run with --render");
    }
}

/// A part that is recorded by itself replaces its own records, and leaves the others as they are.
#[test]
fn a_part_is_recorded_apart_from_the_rest() {
    let mut records = Records(vec![
        Record::fact("run", "kind", "another run"),
        Record::fact("imaging", "an older run", "to be replaced"),
        Record::fact("embedded", "an older run", "to be replaced"),
        Record::fact("contacts", "an older run", "to be replaced"),
        Record::fact("brain", "total", "another run"),
    ]);
    let others = [records.0[0].clone(), records.0[4].clone()];
    imaging::run(&Plan::smoke(), &Options::default(), &mut records).expect("methods agree");
    embedded::run(&Plan::smoke(), &Options::default(), &mut records).expect("methods agree");
    contacts::run(&Plan::smoke(), &Options::default(), &mut records).expect("all are found");
    assert_eq!(records.0[..2], others);
    let of = |name: &str| records.0[2..].iter().filter(|r| r.experiment.starts_with(name)).count();
    let parts = ["imaging", "embedded", "contacts"].map(of);
    assert!(parts.iter().all(|&count| count > 10), "{parts:?}");
    assert_eq!(parts.iter().sum::<usize>() + 2, records.0.len());
    assert!(records.0.iter().all(|r| r.metric != "an older run"));
}

/// Answers the same to every tick.
struct Fixed(f32);

impl Controller for Fixed {
    fn receive(&mut self, _: &[Vec3]) {}

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        for _ in ticks {
            times.query(|| Found { separation: self.0, tests: None });
        }
    }
}

#[test]
fn a_control_loop_that_answers_otherwise_stops_the_run() {
    let run = |other: Surface, separation: f32| {
        let loops = vec![
            Contender::new("first", Surface::Held, Fixed(1.0)),
            Contender::new("other", other, Fixed(separation)),
        ];
        let tool = Probe::Sphere(Sphere::new(Vec3::ZERO, 1.0).expect("a sphere"));
        let period = || Period { frame: Vec::new(), ticks: vec![Tick { tool, share: 0.0 }; 3] };
        let mut race = Race::new(loops, Vec::new(), period());
        race.period(period()).and_then(|()| race.finish())
    };
    assert!(run(Surface::Held, 1.0005).is_ok());
    assert!(run(Surface::Held, 1.01).is_err());
    assert!(run(Surface::Held, f32::NAN).is_err());
    assert!(run(Surface::Continuous, 1.01).is_ok(), "answers on another surface");
}
