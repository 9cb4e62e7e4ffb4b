//! Errors say in one sentence what is wrong, with the offending values.

// Requirement: A-07

use std::fmt::Display;

use dibs_nostd::failsafe::LimitError;
use dibs_nostd::filter::FilterError;
use dibs_nostd::modes::{ModesError, WeightsError};
use dibs_nostd::nodes::NodesError;
use dibs_nostd::wire::{EncodeError, StreamError};
use dibs_nostd::{
    Error, FormatError, Millis, PoseError, PublishError, QueryError, ReceiveError, SplitError,
    StretchError, ToolError, TriangleRow, Unavailable,
};

/// Checks sentences, each with the values that it must have; those of one type are different.
fn check<E: Display + Copy + Into<Error>>(errors: &[(E, &[&str])]) {
    let mut all = Vec::new();
    for (error, values) in errors {
        let text = error.to_string();
        assert!(text.len() > 10 && !text.ends_with('.') && !text.contains('\n'), "{text}");
        for value in *values {
            assert!(text.contains(value), "{text}: without {value}");
        }
        assert_eq!(Into::<Error>::into(*error).to_string(), text);
        all.push(text);
    }
    all.sort();
    all.dedup();
    assert_eq!(all.len(), errors.len(), "two errors of a type say the same");
}

#[test]
fn of_trees() {
    check(&[
        (FormatError::Length { expected: 701, found: 702 }, &["701", "702"]),
        (FormatError::Magic { found: *b"ABCD" }, &["41, 42, 43, 44"]),
        (FormatError::Version { found: 701 }, &["701"]),
        (FormatError::Width { expected: 2, found: 4 }, &["2", "4"]),
        (FormatError::Checksum { stated: 0x701, computed: 0x702 }, &["701", "702"]),
        (FormatError::Field { offset: 71, value: 0x702 }, &["71", "0x702"]),
        (FormatError::Section { kind: 701 }, &["701"]),
        (FormatError::Kind { kind: 701 }, &["701"]),
        (FormatError::NodeOrder { node: 701 }, &["701"]),
        (FormatError::Pin { node: 701, pin: 702 }, &["701", "702"]),
        (FormatError::Radius { node: 701, code: 702 }, &["701", "702"]),
        (FormatError::Leaf { first: 701 }, &["701"]),
        (FormatError::Patch { triangle: 701, vertex: 702 }, &["701", "702"]),
        (FormatError::Corner { triangle: 701, vertex: 702 }, &["701", "702"]),
        (FormatError::Order { row: 701 }, &["701"]),
        (FormatError::Metric { triangle: 701 }, &["701"]),
        (FormatError::Limit { triangle: 701 }, &["701"]),
        (FormatError::Neighbour { triangle: 701, edge: 2 }, &["701", "2"]),
        (FormatError::Origin { axis: 2 }, &["2"]),
        (FormatError::Stack { stated: 701, found: 702 }, &["701", "702"]),
    ]);
    check(&[
        (ModesError::Absent, &[]),
        (ModesError::NoRestShape, &[]),
        (ModesError::Length { expected: 701, found: 702 }, &["701", "702"]),
        (ModesError::Field { offset: 71, value: 0x702 }, &["71", "0x702"]),
        (ModesError::Mode { mode: 701 }, &["701"]),
        (ModesError::Anchor { anchor: 701 }, &["701"]),
    ]);
    check(&[
        (NodesError::Absent, &[]),
        (NodesError::Length { expected: 701, found: 702 }, &["701", "702"]),
        (NodesError::Field { offset: 71, value: 0x702 }, &["71", "0x702"]),
        (NodesError::Node { node: 701 }, &["701"]),
        (NodesError::Corner { element: 701, node: 702, nodes: 703 }, &["701", "702", "703"]),
        (NodesError::Element { element: 701 }, &["701"]),
        (NodesError::Inverted { element: 701 }, &["701"]),
        (NodesError::Binding { vertex: 701, element: 702, elements: 703 }, &["701", "702", "703"]),
        (NodesError::Weights { vertex: 701, sum: 702 }, &["701", "702"]),
        (NodesError::Unmarked { vertex: 701, node: 702 }, &["701", "702"]),
        (NodesError::Marked { node: 701, nodes: 702 }, &["701", "702"]),
    ]);
}

#[test]
fn of_queries() {
    let query = [
        (QueryError::Stack { needed: 701, available: 702 }, &["701", "702"][..]),
        (QueryError::VertexCount { expected: 701, found: 702 }, &["701", "702"]),
        (QueryError::Position { vertex: 701 }, &["701"]),
        (QueryError::OtherTree { expected: 0x701, found: 0x702 }, &["701", "702"]),
        (QueryError::OtherFrame { expected: 701, found: 702 }, &["701", "702"]),
        (QueryError::Uncovered { pin: 701 }, &["701"]),
        (QueryError::NoAdjacency, &["--orient"]),
        (QueryError::NoVertexOrder, &["with_vertex_order"]),
        (QueryError::Contacts { capacity: 701, near: 702 }, &["701", "702"]),
        (QueryError::Margin { bits: 1.5f32.to_bits() }, &["1.5"]),
        (QueryError::BlendTime { bits: 1.5f32.to_bits() }, &["1.5"]),
        (QueryError::Corrupt { row: 701 }, &["701"]),
    ];
    check(&query);
    let coordinate = (ToolError::Coordinate { value: 1.5 }, &["1.5"][..]);
    check(&[coordinate, (ToolError::Radius { value: 1.5 }, &["1.5"])]);
    check(&[
        (FilterError::Parameter { parameter: "speed", value: 1.5 }, &["speed", "1.5"]),
        (FilterError::Command, &[]),
        (FilterError::Row { row: 701 }, &["701"]),
        (FilterError::Rows { found: 701, most: 702 }, &["701", "702"]),
        (FilterError::Pairs { found: 701, most: 702 }, &["701", "702"]),
        (FilterError::Pairs { found: 0, most: 702 }, &[]),
        (FilterError::Unlabelled { label: 71 }, &["71"]),
        (FilterError::Query(QueryError::Corrupt { row: 701 }), &["701"]),
        (FilterError::Untrusted(Unavailable::NoPose), &["pose"]),
    ]);
    check(&[
        (Unavailable::NoSurface, &[]),
        (Unavailable::Unacknowledged, &[]),
        (Unavailable::Stale { age: Millis(701) }, &["701 ms"]),
        (Unavailable::Query(QueryError::Corrupt { row: 701 }), &["701"]),
        (Unavailable::CorruptTree, &[]),
        (Unavailable::LinkLost { silence: Millis(701) }, &["701 ms"]),
        (Unavailable::HeartbeatLost { silence: Millis(701) }, &["701 ms"]),
        (Unavailable::Rejections { streak: 701 }, &["701"]),
        (Unavailable::Delayed { transit: Millis(701) }, &["701 ms"]),
        (Unavailable::SourceStale { age: Millis(701) }, &["701 ms"]),
        (Unavailable::Forgeries { count: 701 }, &["701"]),
        (Unavailable::NoPose, &[]),
        (Unavailable::NoDirection, &[]),
        (Unavailable::NoSide, &[]),
        (Unavailable::CutShort, &[]),
        (Unavailable::NotFinite, &[]),
    ]);
}

#[test]
fn of_surfaces() {
    check(&[
        (StretchError::NoMetric, &[]),
        (StretchError::VertexCount { expected: 701, found: 702 }, &["701", "702"]),
        (
            StretchError::Exceeded { triangle: TriangleRow(701), stretch: 2.5, limit: 1.5 },
            &["701", "2.5", "1.5"],
        ),
        (
            StretchError::ElementExceeded { element: 701, stretch: 2.5, limit: 1.5 },
            &["701", "2.5", "1.5"],
        ),
        (StretchError::Inverted { element: 701 }, &["701"]),
        (StretchError::ElementsShrunk { element: 701, limit: 1.5 }, &["701", "1.5"]),
        (StretchError::Shrunk { triangle: TriangleRow(701), limit: 1.5 }, &["701", "1.5"]),
        (StretchError::InsideOut { volume: 2.5, reference: 1.5 }, &["2.5", "1.5"]),
        (StretchError::TooFast { vertex: 701, step: 2.5, limit: 1.5 }, &["701", "2.5", "1.5"]),
        (StretchError::Corrupt { row: 701 }, &["701"]),
    ]);
    check(&[
        (WeightsError::Count { expected: 701, found: 702 }, &["701", "702"]),
        (WeightsError::NotFinite { mode: 701 }, &["701"]),
        (WeightsError::OutOfRange { mode: 701, weight: 1.5 }, &["701", "1.5"]),
        (WeightsError::Capacity { needed: 701, available: 702 }, &["701", "702"]),
    ]);
    check(&[(SplitError, &[])]);
    check(&[(PublishError::Incomplete { missing: 701 }, &["701"]), (PublishError::Busy, &[])]);
    check(&[
        (LimitError::Order { degraded: 702, safe: 701 }, &["701", "702"]),
        (LimitError::TooLong { safe: 701 }, &["701"]),
        (LimitError::Untrippable { safe: 701 }, &["701"]),
        (LimitError::Speed { tissue_speed: 1.5 }, &["1.5"]),
        (LimitError::Rate, &[]),
        (LimitError::NoReach, &[]),
        (LimitError::Recovery { frames: 701 }, &["701"]),
    ]);
}

#[test]
fn of_the_bus() {
    check(&[
        (EncodeError::Rows { rows: 701 }, &["701"]),
        (EncodeError::Packets { packets: 701 }, &["701"]),
        (EncodeError::Base { rows: 701 }, &["701"]),
        (EncodeError::BaseEpoch { epoch: 701 }, &["701"]),
        (EncodeError::NotFinite { row: 701 }, &["701"]),
        (EncodeError::OutOfBox { row: 701 }, &["701"]),
    ]);
    let long = (StreamError::TooLong { bytes: 701, limit: 702 }, &["701", "702"][..]);
    check(&[long, (StreamError::Cut { bytes: 701 }, &["701"])]);
    check(&[
        (ReceiveError::Stale { epoch: 701 }, &["701"]),
        (ReceiveError::Earlier { by: Millis(701) }, &["701 ms"]),
        (ReceiveError::TooOld, &[]),
        (ReceiveError::Unverifiable { epoch: 701, cause: None }, &["701"]),
        (ReceiveError::Throttled { after: Millis(701) }, &["701 ms"]),
        (ReceiveError::Busy { epoch: 701 }, &["701"]),
        (ReceiveError::NotReady { first: 701 }, &["701"]),
        (ReceiveError::Gaps { sequence: 701 }, &["701"]),
        (ReceiveError::Digest { stated: 0x701, computed: 0x702 }, &["701", "702"]),
        (ReceiveError::Pose(PoseError::NotFinite), &[]),
        (ReceiveError::Pose(PoseError::NoRotation { squared: 1.5 }), &["1.5"]),
        (ReceiveError::Pose(PoseError::TooFar { value: 1.5 }), &["1.5"]),
        (ReceiveError::Stretch(StretchError::Corrupt { row: 701 }), &["701"]),
    ]);
}
