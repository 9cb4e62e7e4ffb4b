//! Words for people that are no sentence of an error enum: values by their names, and errors that are structs.

// Requirement: A-07

use std::fmt::Display;

use dibs_build::{Builder, generate};
use dibs_nostd::constraint::{EnergyAccount, SpringDamper};
use dibs_nostd::failsafe::{FailSafe, Limits, ThresholdPair};
use dibs_nostd::filter::Reason;
use dibs_nostd::format::Unit;
use dibs_nostd::wire::{AesCmac, Counters, Event, QuantisedBox, Status, StatusReport};
use dibs_nostd::{
    Assembler, Error, Frames, Millis, NoAdmissionCheck, NoSide, OutOfTableError, ReceiveError,
    Scrub, SurfaceFacts, TriangleRow, VertexNumber,
};
use glam::Vec3;

/// Checks the words of all values of a type, which differ.
fn says<T: Display>(values: &[(T, &str)]) {
    let mut all: Vec<String> = values.iter().map(|(value, _)| value.to_string()).collect();
    for (said, (_, expected)) in all.iter().zip(values) {
        assert_eq!(said, expected);
    }
    all.sort();
    all.dedup();
    assert_eq!(all.len(), values.len(), "two values say the same");
}

/// Checks the sentence of an error that is a struct, which the common error repeats.
fn states<E: Display + Copy + Into<Error>>(error: E, expected: &str) {
    assert_eq!(error.to_string(), expected);
    assert_eq!(Into::<Error>::into(error).to_string(), expected);
}

#[test]
fn values_have_their_names() {
    says(&[
        (Reason::Commanded, "commanded"),
        (Reason::Nearest, "nearest"),
        (Reason::Shortened, "shortened"),
        (Reason::Stopped, "stopped"),
        (Reason::Retreating, "retreating"),
        (Reason::NoSafeMotion, "no safe motion"),
    ]);
    says(&Unit::ALL.into_iter().zip(["mm", "cm", "m", "in", "um"]).collect::<Vec<_>>());
    says(&[(TriangleRow(701), "701")]);
    says(&[(VertexNumber(702), "702")]);
    says(&[
        (SurfaceFacts::default(), "an unknown number of vertices"),
        (SurfaceFacts { vertices: 701, ..SurfaceFacts::default() }, "701 vertices"),
        (
            SurfaceFacts { vertices: 701, triangles: 702, unit: Some(Unit::Inch) },
            "701 vertices, 702 triangles, from a file in in",
        ),
    ]);
    says(&[(Event::Published, "published"), (Event::NotReady, "not ready")]);
    says(&Event::ALL.map(|event| (event, event.name())));
}

#[test]
fn a_missing_side_says_why() {
    says(&[
        (NoSide::NotAsked, "no side was asked for"),
        (
            NoSide::NoAdjacency,
            "the tree has no adjacency: its triangles are wound against each other (`dibs build --orient` turns them), or it \
             was built without",
        ),
        (NoSide::OpenBoundary, "the closest point is on an open boundary"),
        (NoSide::BelowAccuracy, "the sides are closer than the accuracy"),
        (
            NoSide::NonManifold,
            "the closest point is on an edge of more than two triangles: cut the mesh open there",
        ),
        (NoSide::Degenerate, "the triangles at the closest point have no clear normal"),
        (NoSide::CutShort, "the budget ran out"),
    ]);
}

#[test]
fn a_unit_has_its_millimetres() {
    let lengths = Unit::ALL.map(Unit::millimetres);
    assert_eq!(lengths, [1.0, 10.0, 1000.0, 25.4, 0.001]);
}

#[test]
fn errors_that_are_structs_say_their_values() {
    let spring = SpringDamper::stiffness(1.0).max_force(5.0);
    let account = EnergyAccount::new(1.0, -2.5, &spring, 300.0);
    states(account.expect_err("negative"), "step cannot be -2.5");
    let corner = QuantisedBox::new(Vec3::new(701.0, 0.0, 0.0), Vec3::new(1.0, -2.5, 1.0));
    states(
        corner.expect_err("a negative step"),
        "a box from [701, 0, 0] in steps of [1, -2.5, 1] is not finite or has no size",
    );
    let frames = Frames::<1>::new();
    let (mut writer, _reader) = frames.split().expect("the first");
    writer.push(Vec3::ZERO).expect("one has a place");
    let full: OutOfTableError = writer.push(Vec3::ZERO).expect_err("two have none");
    states(full, "vertex 1 is outside a table of 1");
    let watch = ThresholdPair::new(Millis(50), Millis(200)).expect("in order");
    let limits = Limits::new(watch, 0.1).expect("a speed").recovery(3).expect("not none");
    let mut machine = FailSafe::new(limits);
    // It starts safe, and waits for frames.
    let early = machine.acknowledge().expect_err("no frame yet");
    assert_eq!(early.frames, 3);
    let steps = early.steps;
    states(
        early,
        &format!("3 good frames and {steps} clear steps are missing before an acknowledgement"),
    );
}

#[test]
fn a_trees_changed_bytes_show_both_checksums() {
    let built = Builder::new().build(&generate::heart(320).expect("a size").mesh).expect("valid");
    let mut bytes = built.blob().to_vec();
    bytes[200] ^= 1;
    let mut scrub = Scrub::new(&bytes);
    let _ = scrub.step(100);
    let at = format!("Scrub {{ at: 100 of {} bytes, rounds: 0 }}", bytes.len());
    assert_eq!(format!("{scrub:?}"), at);
    let changed = scrub.step(bytes.len()).expect_err("a flipped bit");
    let (stated, computed) = (changed.stated, changed.computed);
    assert_ne!(stated, computed);
    states(
        changed,
        &format!(
            "the tree's bytes changed: checksum {computed:08x}, the header states {stated:08x}"
        ),
    );
}

#[test]
fn an_end_of_a_bus_says_what_it_saw() {
    let here = SurfaceFacts { vertices: 701, ..SurfaceFacts::default() };
    let sent = SurfaceFacts { vertices: 702, ..SurfaceFacts::default() };
    states(
        ReceiveError::OtherSurface { sent, here },
        "the sender's surface has 702 vertices; the receiver's has 701 vertices",
    );
    states(
        ReceiveError::Unverifiable { epoch: 701, cause: Some(Event::Forged) },
        "frame 701 was refused before: forged",
    );
    // Keys are not printed.
    let mac = AesCmac::new(b"sixteen letters.", 701, 702);
    assert_eq!(format!("{mac:?}"), "AesCmac { challenge: 702, .. }");
    let frames = Frames::<3>::new();
    let (writer, _reader) = frames.split().expect("the first");
    let mut assembler = Assembler::new(writer, NoAdmissionCheck, 7, 1e3);
    assert_eq!(assembler.counters().to_string(), "no events");
    for bytes in [&[1_u8, 2, 3][..], &[4, 5, 6]] {
        assembler.accept(bytes, Millis(0)).expect_err("no packet");
    }
    let mut counters = *assembler.counters();
    assert_eq!(counters.to_string(), "damaged 2");
    let status = Status {
        published: None,
        wants_whole: false,
        safety: 0,
        number: 0,
        clock: 0,
        answer: None,
    };
    let report = StatusReport { status, first_counter: 0, counters: &[701_u32.to_le_bytes()] };
    counters.update(&report);
    assert_eq!(counters.to_string(), "published 701, damaged 2");
    assert_eq!(format!("{counters:?}"), r#"{"published": 701, "damaged": 2}"#);
    assert_eq!(Counters::default(), Counters::new());
}
