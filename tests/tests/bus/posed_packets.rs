//! Frames with rigid poses, in packets: published with their own pose, or not at all.

// Requirements: F-08, B-01

use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{GuardLimits, PosedRows, Surface};
use dibs_nostd::wire::{AesCmac, Content, Encoding, Event, FrameEncoder, FrameId, NoMac};
use dibs_nostd::{
    Advance, Millis, PoseError, Progress, ReceiveError, RigidPose, Sphere, StretchError, TreeBytes,
};
use dibs_stream::{Sender, Settings, SurfaceOrder};
use dibs_tests::bus::{collect, contribution, reseal};
use dibs_tests::posed::Heart;
use fastrand::Rng;

use crate::guard_posed::{PERIOD, ROWS, TheBus, TheGuard, limits, work};

/// Offsets of a packet's fields.
const SEQUENCE: usize = 12;
const BODY: usize = 18;

/// A quarter turn, and a shift.
fn pose(x: f32) -> RigidPose {
    let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    RigidPose::new(quarter, Vec3::X * x).expect("a rotation")
}

/// A receiver of a heart's frames, and its control tick.
struct Line<'h, 's> {
    heart: &'h Heart,
    bus: TheBus<'s, 'h>,
    guard: TheGuard<'s, 'h>,
}

impl<'h, 's> Line<'h, 's> {
    fn new(heart: &'h Heart, surface: &'s Surface<ROWS, PosedRows>, limits: GuardLimits) -> Self {
        let tree = TreeBytes::<u16>::new(heart.built.blob());
        let (bus, guard) = surface.start(tree, limits).expect("valid");
        Self { heart, bus, guard }
    }

    /// The packets of a frame at rest: begin, pose, vertices, commit.
    fn packets(&self, epoch: u32, pose: Option<RigidPose>) -> Vec<Vec<u8>> {
        let rows = self.heart.built.to_rows(&self.heart.mesh.positions);
        let frame = FrameEncoder::<_, 256>::new(self.id(epoch), Encoding::Float, &rows[..]);
        let frame = frame.expect("valid");
        collect(match pose {
            Some(pose) => frame.with_pose(pose).expect("few packets"),
            None => frame,
        })
    }

    fn id(&self, epoch: u32) -> FrameId {
        FrameId { mesh_id: self.heart.built.summary().mesh_id, session: 1, epoch }
    }

    /// Gives packets, and does all pending work. Returns the first refusal, and whether a frame was published.
    fn give(&mut self, packets: &[Vec<u8>], now: u32) -> (Option<ReceiveError>, bool) {
        let (mut refused, mut is_published) = (None, false);
        for packet in packets {
            if let Err(error) = self.bus.packet(packet, Millis(now)) {
                refused = refused.or(Some(error));
            }
            match work(&mut self.bus) {
                Ok(outcome) => is_published |= matches!(outcome, Advance::Published { .. }),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        (refused, is_published)
    }

    /// The surface's point nearest to a point far away.
    fn nearest(&mut self, now: u32) -> Option<Vec3> {
        let tool = Sphere::new(Vec3::new(30.0, 2_000.0, 10.0), 1.0).expect("valid");
        let tracked = self.guard.closest(&tool, Millis(now)).tracked.ok()?;
        Some(tracked.closest.point_on_surface)
    }

    fn count(&self, event: Event) -> u32 {
        self.bus.counters().of(event)
    }
}

/// The frame with another pose packet, and a commit that agrees with it.
fn with_pose_packet(packets: &[Vec<u8>], changed: Vec<u8>) -> Vec<Vec<u8>> {
    let mut packets = packets.to_vec();
    let more = contribution(&changed).wrapping_sub(contribution(&packets[1]));
    packets[1] = changed;
    let commit = packets.last_mut().expect("has packets");
    let digest = u32::from_le_bytes(commit[BODY..BODY + 4].try_into().expect("four bytes"));
    commit[BODY..BODY + 4].copy_from_slice(&digest.wrapping_add(more).to_le_bytes());
    *commit = reseal(commit.clone());
    packets
}

fn edited(packet: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut packet = packet.to_vec();
    packet[at..at + bytes.len()].copy_from_slice(bytes);
    reseal(packet)
}

/// A frame in packets equals one of this process with its pose, whole or partial; the pose may arrive late, in any
/// order, and twice.
#[test]
fn a_pose_comes_with_its_frame() {
    let heart = Heart::new(Vec3::ZERO);
    let (surface, local) = (Surface::new(), Surface::new());
    let mut line = Line::new(&heart, &surface, limits());
    let mut other = Line::new(&heart, &local, limits());
    let mut rng = Rng::with_seed(1);
    for epoch in 1..=40 {
        let now = epoch * PERIOD;
        let pose = pose(100.0 + epoch as f32);
        let mut packets = line.packets(epoch, Some(pose));
        let body = &packets[1][BODY..BODY + 28];
        let numbers: Vec<f32> = body.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let sent = [&pose.rotation().to_array()[..], &pose.shift().to_array()].concat();
        assert_eq!((packets[1][1], packets[1].len(), numbers), (10, 64, sent));
        match epoch % 4 {
            // After all other packets.
            0 => {
                let late = packets.remove(1);
                packets.push(late);
            }
            // Twice.
            1 => packets.insert(4, packets[1].clone()),
            // Anywhere after the begin, as far as gaps can be recorded.
            2 => {
                let late = packets.remove(1);
                packets.insert(rng.usize(1..=packets.len()), late);
            }
            _ => (),
        }
        let doubles = line.count(Event::Duplicate);
        assert_eq!(line.give(&packets, now), (None, true), "{epoch}");
        assert_eq!(line.count(Event::Duplicate), doubles + u32::from(epoch % 4 == 1));
        let sent = (pose.rotation(), pose.shift());
        let frame = heart.mesh.positions.as_slice();
        other.bus.frame_at(frame, sent, Millis(now), Millis(now)).expect("a good frame");
        work(&mut other.bus).expect("admitted");
        let found = line.nearest(now + 7).expect("a surface");
        assert_eq!(Some(found), other.nearest(now + 7));
        assert!(found.x > 20.0 && found.y > 20.0, "{found}");
    }
}

/// A frame that announces a pose is not published without it: if it is lost, damaged, from another frame, or replaced.
#[test]
fn no_frame_is_published_without_its_pose() {
    let heart = Heart::new(Vec3::ZERO);
    let surface = Surface::new();
    let mut line = Line::new(&heart, &surface, limits());
    let first = line.packets(1, Some(pose(50.0)));
    assert_eq!(line.give(&first, PERIOD), (None, true));
    let before = line.nearest(PERIOD).expect("a surface");
    let sound = line.packets(2, Some(pose(60.0)));
    let plain = line.packets(2, None);
    let sound_pose = &sound[1];
    let without = [&sound[..1], &sound[2..]].concat();
    let of_other = line.packets(3, Some(pose(60.0))).swap_remove(1);
    let flipped = {
        let mut packet = sound_pose.clone();
        packet[BODY + 17] ^= 4;
        packet
    };
    // Rows in its place, as in the frame without a pose.
    let rows_first = [&sound[..1], &plain[1..]].concat();
    // Both the other rows and its own.
    let both = [&sound[..1], &plain[1..2], &sound[1..]].concat();
    let misplaced = edited(sound_pose, SEQUENCE, &[2, 0]);
    let unannounced = [&plain[..1], &sound[1..2], &plain[1..]].concat();
    let cases: [(Vec<Vec<u8>>, Option<Event>, bool); 8] = [
        (without.clone(), None, false),
        ([&without[..], &[of_other]].concat(), Some(Event::Unexpected), false),
        (with_replaced(&sound, flipped), Some(Event::Damaged), false),
        (rows_first, Some(Event::Order), false),
        (both, Some(Event::Order), true),
        (with_pose_packet(&sound, misplaced), Some(Event::Malformed), false),
        // A pose that differs from the one in the commit's digest.
        (
            with_replaced(&sound, line.packets(2, Some(pose(61.0))).swap_remove(1)),
            Some(Event::Digest),
            false,
        ),
        // The frame has no pose, but its rows are valid.
        (unannounced, Some(Event::Encoding), true),
    ];
    for (number, (packets, event, is_published)) in cases.into_iter().enumerate() {
        let surface = Surface::new();
        let mut line = Line::new(&heart, &surface, limits());
        assert_eq!(line.give(&first, PERIOD), (None, true));
        let counted = event.map(|event| line.count(event));
        let (refused, found) = line.give(&packets, 2 * PERIOD);
        assert_eq!(refused.map(|error| error.event()), event, "{number}: {refused:?}");
        assert_eq!(found, is_published, "{number}");
        assert_eq!(event.map(|event| line.count(event)), counted.map(|count| count + 1));
        if !found {
            assert_eq!(line.nearest(PERIOD), Some(before), "{number}");
            // The next frame is accepted.
            let next = line.packets(7, Some(pose(70.0)));
            assert_eq!(line.give(&next, 3 * PERIOD), (None, true), "{number}");
        }
    }
}

fn with_replaced(packets: &[Vec<u8>], pose: Vec<u8>) -> Vec<Vec<u8>> {
    let mut packets = packets.to_vec();
    packets[1] = pose;
    packets
}

/// Invalid poses are refused by their cause, even if checksum and digest match, and their frame with them.
#[test]
fn what_is_no_pose_is_refused() {
    let heart = Heart::new(Vec3::ZERO);
    let surface = Surface::new();
    let mut line = Line::new(&heart, &surface, limits());
    assert_eq!(line.give(&line.packets(1, Some(pose(50.0))), PERIOD), (None, true));
    let before = line.nearest(PERIOD);
    let mut epoch = 1;
    for (place, number, error) in [
        (0, f32::NAN, PoseError::NotFinite),
        (3, f32::INFINITY, PoseError::NotFinite),
        (6, f32::NEG_INFINITY, PoseError::NotFinite),
        (4, 2e8, PoseError::TooFar { value: 2e8 }),
        (1, 1.0, PoseError::NoRotation { squared: 2.0 }),
    ] {
        epoch += 1;
        let sound = line.packets(epoch, Some(pose(50.0)));
        let changed = edited(&sound[1], BODY + 4 * place, &number.to_le_bytes());
        let event = ReceiveError::Pose(error).event();
        let counted = line.count(event);
        let outcome = line.give(&with_pose_packet(&sound, changed), epoch * PERIOD);
        assert_eq!(outcome, (Some(ReceiveError::Pose(error)), false));
        assert_eq!(line.count(event), counted + 1);
        assert_eq!(line.nearest(PERIOD), before);
    }
}

/// A pose beyond the speed limit is refused, as in a frame of this process. A partial frame without a pose keeps that
/// of its base, and one with a pose may change no row.
#[test]
fn partial_frames_and_fast_ones() {
    let heart = Heart::new(Vec3::ZERO);
    let surface = Surface::new();
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let mut line = Line::new(&heart, &surface, limits);
    assert_eq!(line.give(&line.packets(1, Some(pose(50.0))), PERIOD), (None, true));
    let first = line.nearest(PERIOD).expect("a surface");
    let (refused, is_published) = line.give(&line.packets(2, Some(pose(70.0))), 2 * PERIOD);
    assert!(
        matches!(refused, Some(ReceiveError::Stretch(StretchError::TooFast { .. }))),
        "{refused:?}"
    );
    assert!(!is_published);
    let rows = heart.built.to_rows(&heart.mesh.positions);
    let partial = |line: &Line<'_, '_>, epoch: u32, base: u32, pose: Option<RigidPose>| {
        let (id, rows) = (line.id(epoch), &rows[..]);
        let frame = FrameEncoder::<_, 256>::partial(id, Encoding::Float, rows, base, rows);
        let frame = frame.expect("valid");
        let packets = collect(match pose {
            Some(pose) => frame.with_pose(pose).expect("few packets"),
            None => frame,
        });
        assert_eq!(packets.len(), 2 + usize::from(pose.is_some()));
        packets
    };
    // The first partial frame makes the receiver copy what it has published.
    line.give(&partial(&line, 3, 1, None), 3 * PERIOD);
    assert_eq!(line.give(&line.packets(4, Some(pose(50.0))), 4 * PERIOD), (None, true));
    work(&mut line.bus).expect("copies");
    while line.bus.work(1_000) == Ok(Advance::Pending) {}
    assert_eq!(line.give(&partial(&line, 5, 4, None), 5 * PERIOD), (None, true));
    assert_eq!(line.nearest(5 * PERIOD), Some(first));
    let moved = partial(&line, 6, 5, Some(pose(53.0)));
    assert_eq!(line.give(&moved, 6 * PERIOD), (None, true));
    let there = line.nearest(6 * PERIOD).expect("a surface");
    assert!((there - first - Vec3::X * 3.0).length() < 1.0, "{there} {first}");
    // Its pose is lost.
    let mut without = partial(&line, 7, 6, Some(pose(54.0)));
    without.remove(1);
    assert_eq!(line.give(&without, 7 * PERIOD), (None, false));
    // A commit in the pose's place, whose digest covers only the begin.
    let [begin, _, commit] = &partial(&line, 8, 6, Some(pose(54.0)))[..] else { panic!("three") };
    let early = edited(commit, SEQUENCE, &[1, 0]);
    let early = edited(&early, BODY, &contribution(begin).to_le_bytes());
    let refused = line.give(&[begin.clone(), early], 8 * PERIOD);
    assert_eq!(refused, (Some(ReceiveError::Order { sequence: 1 }), false));
}

/// A receiver whose surface has no poses refuses such a frame at its begin. A receiver with a key accepts no pose
/// without its tag.
#[test]
fn a_pose_is_refused_where_none_is_taken_and_without_its_tag() {
    let heart = Heart::new(Vec3::ZERO);
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let surface: Surface<ROWS> = Surface::new();
    let (mut bus, _guard) = surface.start::<_, 64, 96>(tree, limits()).expect("valid");
    let posed = Surface::new();
    let line = Line::new(&heart, &posed, limits());
    let packets = line.packets(1, Some(pose(50.0)));
    assert_eq!(bus.packet(&packets[0], Millis(1)), Err(ReceiveError::Encoding));
    let cause = Event::Encoding;
    for packet in &packets[1..] {
        assert_eq!(bus.packet(packet, Millis(1)), Err(ReceiveError::Refused { epoch: 1, cause }));
    }

    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let mac = || AesCmac::new(&[7; 16], 3, 0);
    let (mut bus, _guard) =
        surface.start_with_mac::<_, _, 64, 96>(tree, limits(), mac()).expect("valid");
    let rows = heart.built.to_rows(&heart.mesh.positions);
    let tagged = |epoch: u32, pose: RigidPose| {
        let frame = FrameEncoder::<_, 256>::new(line.id(epoch), Encoding::Float, &rows[..]);
        let frame = frame.expect("valid").with_pose(pose).expect("few packets");
        collect(frame.with_mac(mac()).expect("few packets"))
    };
    let frame = tagged(1, pose(50.0));
    assert_eq!(frame[1].len(), 64);
    assert_eq!(bus.packet(&frame[0], Millis(1)), Ok(Progress::Begun { epoch: 1 }));
    // Without a tag, with a shift that the tag does not cover, and with another frame's tag.
    let forged = Err(ReceiveError::Forged { epoch: 1 });
    assert_eq!(bus.packet(&packets[1], Millis(1)), forged);
    assert_eq!(bus.packet(&edited(&frame[1], BODY + 18, &[3]), Millis(1)), forged);
    let mut mixed = tagged(2, pose(50.0)).swap_remove(1);
    mixed[8] = 1;
    assert_eq!(bus.packet(&reseal(mixed), Millis(1)), forged);
    for packet in &frame[1..] {
        bus.packet(packet, Millis(1)).expect("genuine");
    }
    let mut outcome = Ok(Advance::Pending);
    while outcome == Ok(Advance::Pending) {
        outcome = bus.work(50);
    }
    assert_eq!(outcome, Ok(Advance::Published { epoch: 1 }));
}

/// A sender's frames with poses arrive with them, whole and partial.
#[test]
fn a_sender_sends_poses() {
    let heart = Heart::new(Vec3::ZERO);
    let (surface, local) = (Surface::new(), Surface::new());
    let mut line = Line::new(&heart, &surface, limits());
    let mut other = Line::new(&heart, &local, limits());
    let order = SurfaceOrder::of(&heart.built.tree::<u16>().expect("16-bit indices"));
    let settings = Settings { partial: Some(0.0), quantised: false, ..Settings::default() };
    let mut sender = Sender::<_, 256, NoMac>::new(Vec::new(), order, settings);
    let mut partial = 0;
    for frame in 1..=20_u32 {
        let now = frame * PERIOD;
        let pose = pose(20.0 + frame as f32);
        // A part of the heart moves.
        let mut positions = heart.mesh.positions.clone();
        positions[3] += Vec3::X * (0.01 * frame as f32);
        sender.send_at(&positions, pose, std::time::Duration::ZERO).expect("sent");
        let packets = std::mem::take(sender.transport());
        let (_, is_published) = line.give(&packets, now);
        assert!(is_published || frame == 2, "{frame}");
        let status = line.bus.status(Millis(now), &mut [0; 96]).map(<[u8]>::to_vec);
        drop(status);
        while line.bus.work(1_000) == Ok(Advance::Pending) {}
        line.bus.work(1_000).expect("copies");
        if is_published {
            partial += u32::from(packets.len() < 10);
            let sent = (pose.rotation(), pose.shift());
            let now = Millis(now);
            other.bus.frame_at(&positions, sent, now, now).expect("a good frame");
            work(&mut other.bus).expect("admitted");
            assert_eq!(line.nearest(now.0), other.nearest(now.0), "{frame}");
        } else {
            sender.want_whole();
        }
    }
    assert!(partial > 5, "{partial}");
    // A frame without a pose is at the mesh's own coordinates, not at the pose of the previous frame.
    let sent = sender.send(&heart.mesh.positions).expect("sent");
    assert_eq!(sent.content, Content::Whole);
    let sent = sender.send(&heart.mesh.positions).expect("sent");
    assert!(matches!(sent.content, Content::Partial { .. }), "{:?}", sent.content);
}
