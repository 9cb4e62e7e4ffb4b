//! A surface carries its stretch and its error, and a query its last answer: the caller does not pass them.

// Requirement: F-04

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Contacts, FrameLabel, FrameReader, Frames, MeasuredStretch, Millis, MovingSurface,
    Odometer, Options, Proximity, Query, QueryError, Tracker, Tree, VertexTable, measure_stretch,
};
use glam::Vec3;

/// Vertices of the heart below.
const N: usize = 502;

/// The position error in its label, in mm.
const ERROR: f32 = 0.25;

struct Heart {
    built: BuiltTree,
    mesh: Mesh,
    moved: Vec<Vec3>,
}

fn heart() -> Heart {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let moved = built.to_rows(&motion.frames[9]);
    Heart { built, mesh, moved }
}

fn query<'t>(tree: &Tree<'t, u16>) -> Query<'t, u16, { MAX_STACK + 128 }> {
    Query::new(tree).expect("enough for any tree")
}

/// A capsule beside the heart, and one through it.
fn tools() -> [Capsule; 2] {
    let through = |x| Capsule::new(Vec3::new(x, 0.0, 20.0), Vec3::new(120.0, 0.0, 60.0), 2.5);
    [through(70.0).expect("valid"), through(10.0).expect("valid")]
}

/// Publishes rows as the only frame.
fn publish<'f>(
    frames: &'f Frames<N>,
    rows: &[Vec3],
    stretch: Option<MeasuredStretch>,
) -> FrameReader<'f> {
    let (mut writer, reader) = frames.split().expect("new");
    writer.begin();
    for &row in rows {
        writer.push(row).expect("room");
    }
    let label = FrameLabel { epoch: 7, received: Millis(0), position_error: ERROR, stretch };
    writer.publish(label).expect("complete");
    reader
}

fn same(one: &Proximity, other: &Proximity) -> bool {
    format!("{one:?}") == format!("{other:?}")
}

#[test]
fn a_frame_is_searched_with_its_own_stretch_and_error() {
    let heart = heart();
    let tree = heart.built.tree::<u16>().expect("valid");
    let measured = measure_stretch(&tree, heart.moved.as_slice()).expect("within the limit");
    let rest = heart.built.to_rows(&heart.mesh.positions);
    let less = measure_stretch(&tree, rest.as_slice()).expect("at rest");
    assert!(less.sigma() < measured.sigma() && measured.sigma() < tree.stretch());
    let frames = [const { Frames::<N>::new() }; 2];
    let mut known = publish(&frames[0], &heart.moved, Some(measured));
    let mut unknown = publish(&frames[1], &heart.moved, None);
    let (known, unknown) = (known.read().expect("published"), unknown.read().expect("published"));
    let rows = heart.moved.as_slice();
    let mut query = query(&tree);
    let mut fewer = 0;
    for tool in tools() {
        let cold = Options::cold();
        for options in [cold, cold.unsigned()] {
            let mut ask = |surface: &dyn VertexTable, options: &Options| {
                let found = query.closest(surface, &tool, options).expect("an answer");
                let batched = query.closest_batched(surface, &tool, options).expect("an answer");
                assert_eq!(
                    (found.separation, found.accuracy),
                    (batched.separation, batched.accuracy)
                );
                found
            };
            let by_hand = ask(&rows, &options.stretch(measured)).widened(ERROR);
            let limit = ask(&rows, &options).widened(ERROR);
            assert!(same(&ask(&known, &options), &by_hand));
            assert!(same(&ask(&unknown, &options), &limit));
            // A stretch that the caller passes takes precedence.
            let stated = ask(&rows, &options.stretch(less)).widened(ERROR);
            assert!(same(&ask(&known, &options.stretch(less)), &stated));
            assert!(stated.node_tests <= by_hand.node_tests);
            fewer += i64::from(limit.node_tests) - i64::from(by_hand.node_tests);
        }
    }
    assert!(fewer > 0, "the stretch made no difference");
}

/// A frame that is being written has nothing of the label that its buffer had before.
#[test]
fn a_frame_has_no_label_before_it_is_published() {
    let Heart { built, moved, .. } = heart();
    let tree = built.tree::<u16>().expect("valid");
    let measured = measure_stretch(&tree, moved.as_slice()).expect("within the limit");
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().expect("new");
    for epoch in 1..=4 {
        writer.begin();
        writer.push(Vec3::ZERO).expect("room");
        let back = writer.back();
        assert_eq!((back.epoch(), back.position_error()), (None, 0.0), "{epoch}");
        assert!(back.stretch().is_none(), "{epoch}");
        let label = FrameLabel {
            epoch,
            received: Millis(0),
            position_error: ERROR,
            stretch: Some(measured),
        };
        writer.publish(label).expect("complete");
        let front = reader.read().expect("published");
        assert_eq!((front.epoch(), front.position_error()), (Some(epoch), ERROR));
        assert_eq!(front.stretch().map(|stretch| stretch.sigma()), Some(measured.sigma()));
    }
}

#[test]
fn a_measurement_with_another_tree_is_refused_with_its_frame() {
    let heart = heart();
    let tree = heart.built.tree::<u16>().expect("valid");
    let other = Builder::new().stretch(1.7).build(&heart.mesh).expect("a valid mesh");
    let other = other.tree::<u16>().expect("valid");
    let measured = measure_stretch(&other, heart.moved.as_slice()).expect("within the limit");
    let frames = Frames::new();
    let mut reader = publish(&frames, &heart.moved, Some(measured));
    let surface = reader.read().expect("published");
    let (expected, found) = (tree.checksum(), other.checksum());
    let refused = Err(QueryError::OtherTree { expected, found });
    let [tool, _] = tools();
    assert_eq!(query(&tree).closest(&surface, &tool, &Options::new()), refused);
    let measured = measure_stretch(&tree, &surface).expect("within the limit");
    assert!(query(&tree).closest(&surface, &tool, &Options::new().stretch(measured)).is_ok());
}

/// Trackers and contacts read stretch and error from the surface as queries do, also through an odometer's surface.
#[test]
fn tracker_and_contacts_read_the_same_facts() {
    let heart = heart();
    let tree = heart.built.tree::<u16>().expect("valid");
    let measured = measure_stretch(&tree, heart.moved.as_slice()).expect("within the limit");
    let frames = Frames::new();
    let mut reader = publish(&frames, &heart.moved, Some(measured));
    let surface = reader.read().expect("published");
    let [tool, _] = tools();
    let options = Options::cold();
    let closest = query(&tree).closest(&surface, &tool, &options).expect("an answer");

    let mut odometer = Odometer::new(&tree);
    let moved = odometer.start(&surface);
    let tracker = || Tracker::<_, { MAX_STACK }, 1_024>::new(&tree).expect("deep enough");
    let tracked = tracker().closest(&moved, &tool, &options).expect("an answer").closest;
    let rows = heart.moved.as_slice();
    let by_hand = tracker().closest(&odometer.start(rows), &tool, &options.stretch(measured));
    assert!(same(&tracked, &by_hand.expect("an answer").closest.widened(ERROR)));
    assert_eq!(tracked.separation, closest.separation);

    let mut contacts = Contacts::<8>::new();
    let margin = closest.separation + 1.0;
    let found = query(&tree).contacts(&surface, &tool, margin, &options, &mut contacts);
    assert!(same(&found.expect("an answer"), &closest));
    assert_eq!(contacts.accuracy(), closest.accuracy);
    // The error widens the interval, but not the contacts, which refer to the positions as published.
    let mut exact = Contacts::<8>::new();
    query(&tree).contacts(rows, &tool, margin, &options, &mut exact).expect("an answer");
    assert!(!exact.is_empty() && exact.iter().eq(contacts.iter()));
}

#[test]
fn a_surface_between_two_frames_and_beyond_them_has_a_stretch_of_both() {
    let heart = heart();
    let tree = heart.built.tree::<u16>().expect("valid");
    let rest = heart.built.to_rows(&heart.mesh.positions);
    let of = |rows: &[Vec3]| measure_stretch(&tree, rows).expect("within the limit");
    let (less, more) = (of(&rest), of(&heart.moved));
    let frames = [const { Frames::<N>::new() }; 2];
    let mut before = publish(&frames[0], &rest, Some(less));
    let mut after = publish(&frames[1], &heart.moved, Some(more));
    let (before, after) = (before.read().expect("published"), after.read().expect("published"));
    let mut odometer = Odometer::new(&tree);
    odometer.start(&before);
    let step = odometer.step(&before, &after);
    for share in [0.0, 0.25, 0.5, 1.0] {
        let surface = step.at(share);
        assert!(surface.motion().is_some());
        let stated = surface.stretch().expect("both are known").sigma();
        let mean = (1.0 - share) * less.sigma() + share * more.sigma();
        assert!((stated - mean).abs() < 1e-6, "{share}: {stated} for {mean}");
        assert!(measure_stretch(&tree, &surface).expect("between").sigma() <= stated);
        assert!((surface.position_error() - ERROR).abs() < 1e-6);
    }
    let beyond = step.beyond(0.5);
    let stated = beyond.stretch().expect("both are known").sigma();
    assert!((stated - (1.5 * more.sigma() + 0.5 * less.sigma())).abs() < 1e-6);
    assert!(measure_stretch(&tree, &beyond).map_or(1.5, |measured| measured.sigma()) <= stated);
    // Half an interval beyond the later frame: one and a half of its errors, plus half an error of the earlier.
    assert!((beyond.position_error() - 2.0 * ERROR).abs() < 1e-6);
}

#[test]
fn a_query_starts_from_its_last_answer_unless_it_is_told_not_to() {
    let heart = heart();
    let tree = heart.built.tree::<u16>().expect("valid");
    let rows = heart.moved.as_slice();
    let mut saved = 0;
    for tool in tools() {
        let mut query = query(&tree);
        let ask = Options::new().unsigned();
        let first = query.closest(rows, &tool, &ask).expect("an answer");
        let second = query.closest(rows, &tool, &ask).expect("an answer");
        let batched = query.closest_batched(rows, &tool, &ask).expect("an answer");
        let cold = query.closest(rows, &tool, &ask.warm_start(None)).expect("an answer");
        let stated = ask.warm_start(first.triangle);
        let stated_batched = query.closest_batched(rows, &tool, &stated).expect("an answer");
        let stated = query.closest(rows, &tool, &stated).expect("an answer");
        assert!(same(&first, &cold), "{first:?} {cold:?}");
        assert!(same(&second, &stated), "{second:?} {stated:?}");
        assert!(same(&batched, &stated_batched), "{batched:?} {stated_batched:?}");
        assert_eq!(second.separation, first.separation);
        saved += i64::from(first.node_tests) - i64::from(second.node_tests);
    }
    assert!(saved > 0, "the last answer saved nothing");
}
