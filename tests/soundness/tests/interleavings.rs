//! Runs one writer and one reader in every order of their steps, by the model checker loom: no frame is torn, the
//! last published frame is read, and neither end waits.

// Requirement: F-01

#![cfg(loom)]

use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{Poses, SharedState};
use dibs_nostd::{FrameLabel, Frames, Millis, PublishError, RigidPose, VertexTable};
use loom::cell::UnsafeCell;
use loom::thread;

const VERTICES: usize = 1;

/// A cell beside each buffer, touched together with it. Positions are relaxed atomics: to loom, a read during a write
/// is no data race, and no load sees a later store. A cell's accesses must be ordered: loom reports an unordered read
/// and write as a causality violation.
struct Beside([UnsafeCell<()>; 2]);

impl Beside {
    fn written(&self, buffer: usize) {
        self.0[buffer].with_mut(|_| ());
    }

    fn read(&self, buffer: usize) {
        self.0[buffer].with(|_| ());
    }
}

/// A label whose fields carry the frame's epoch and the number of its buffer.
fn label(epoch: u32, buffer: usize) -> FrameLabel {
    let position_error = buffer as f32;
    FrameLabel { epoch, received: Millis(epoch + 100), position_error, stretch: None }
}

fn position(epoch: u32) -> Vec3 {
    Vec3::new(epoch as f32, epoch as f32 + 0.25, epoch as f32 + 0.5)
}

/// The writer publishes three frames, and gives up a frame that a read holds back; the reader reads three times. Loom
/// runs this in every order. Every read is ordered against every write of its buffer: with a weaker ordering in
/// `Frames`, loom finds one that is not.
#[test]
fn no_order_of_steps_tears_a_frame() {
    let orders = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let counter = orders.clone();
    loom::model(move || {
        counter.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let frames: &'static Frames<VERTICES> = Box::leak(Box::new(Frames::new()));
        let beside: &'static Beside =
            Box::leak(Box::new(Beside([UnsafeCell::new(()), UnsafeCell::new(())])));
        let (mut writer, mut reader) = frames.split().expect("split once");
        let sender = thread::spawn(move || {
            let (mut published, mut buffer) = (0, 1);
            for epoch in 1..=3 {
                writer.begin();
                beside.written(buffer);
                writer.push(position(epoch)).expect("inside the table");
                match writer.publish(label(epoch, buffer)) {
                    Ok(()) => (published, buffer) = (epoch, 1 - buffer),
                    Err(PublishError::Busy) => {}
                    Err(other) => panic!("{other}"),
                }
            }
            published
        });
        let mut newest = 0;
        for _ in 0..3 {
            if let Some(frame) = reader.read() {
                let FrameLabel { epoch, position_error, .. } = frame.label();
                let buffer = usize::from(position_error == 1.0);
                assert_eq!(frame.label(), label(epoch, buffer), "the label is of one epoch");
                beside.read(buffer);
                assert_eq!(frame.position(0), Some(position(epoch)), "so is the position");
                assert!(epoch >= newest, "no frame is older than one that was read");
                newest = epoch;
            }
        }
        let published = sender.join().expect("no panic");
        let last = reader.read().map_or(0, |frame| frame.label().epoch);
        assert_eq!(last, published, "the frame published last is read");
    });
    let orders = orders.load(std::sync::atomic::Ordering::Relaxed);
    println!("interleavings: {orders}");
    assert!(orders > 100, "{orders}");
}

/// The same with three buffers: the frame before the published one is whole, too, while it is read.
#[test]
fn no_order_of_steps_tears_the_frame_before() {
    let orders = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let counter = orders.clone();
    loom::model(move || {
        counter.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let frames: &'static Frames<VERTICES, 3> = Box::leak(Box::new(Frames::new()));
        let beside: &'static [UnsafeCell<()>; 3] =
            Box::leak(Box::new([(); 3].map(|()| UnsafeCell::new(()))));
        let (mut writer, mut reader) = frames.split().expect("split once");
        let sender = thread::spawn(move || {
            let mut buffer = 1;
            for epoch in 1..=3 {
                writer.begin();
                beside[buffer].with_mut(|_| ());
                writer.push(position(epoch)).expect("inside the table");
                match writer.publish(label(epoch, buffer)) {
                    Ok(()) => buffer = (buffer + 1) % 3,
                    Err(PublishError::Busy) => {}
                    Err(other) => panic!("{other}"),
                }
            }
        });
        for _ in 0..3 {
            if let Some(frame) = reader.read() {
                let FrameLabel { epoch, position_error, .. } = frame.label();
                let buffer = position_error as usize;
                beside[buffer].with(|_| ());
                assert_eq!(frame.position(0), Some(position(epoch)), "the published frame");
                let before = frame.before();
                beside[(buffer + 2) % 3].with(|_| ());
                // Before the second frame there is none.
                let (epoch, row) = (before.epoch().expect("a label"), before.position(0));
                assert!(epoch == 0 || row == Some(position(epoch)), "the frame before: {row:?}");
            }
        }
        sender.join().expect("no panic");
    });
    let orders = orders.load(std::sync::atomic::Ordering::Relaxed);
    println!("interleavings: {orders}");
    assert!(orders > 100, "{orders}");
}

/// The same with a pose in each frame: that of the published frame and that of the frame before are whole while they are
/// read.
#[test]
fn no_order_of_steps_tears_a_pose() {
    let orders = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let counter = orders.clone();
    loom::model(move || {
        counter.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let frames: &'static Frames<VERTICES, 3> = Box::leak(Box::new(Frames::new()));
        let poses: &'static Poses = Box::leak(Box::new(Poses::new()));
        let beside: &'static [UnsafeCell<()>; 3] =
            Box::leak(Box::new([(); 3].map(|()| UnsafeCell::new(()))));
        let pose = |epoch: u32| {
            let turn = if epoch % 2 == 0 { Quat::IDENTITY } else { -Quat::IDENTITY };
            RigidPose::new(turn, position(epoch)).expect("a rotation")
        };
        let (mut writer, mut reader) = frames.split().expect("split once");
        let sender = thread::spawn(move || {
            let mut buffer = 1;
            for epoch in 1..=3 {
                writer.begin();
                writer.push(position(epoch)).expect("inside the table");
                beside[buffer].with_mut(|_| ());
                poses.set(buffer as u32, &pose(epoch), epoch as f32);
                match writer.publish(label(epoch, buffer)) {
                    Ok(()) => buffer = (buffer + 1) % 3,
                    Err(PublishError::Busy) => {}
                    Err(other) => panic!("{other}"),
                }
            }
        });
        for _ in 0..2 {
            if let Some(frame) = reader.read() {
                let FrameLabel { epoch, position_error, .. } = frame.label();
                let buffer = position_error as usize;
                beside[buffer].with(|_| ());
                beside[(buffer + 2) % 3].with(|_| ());
                let [(earlier, shown), last] = poses.of_frames(&frame);
                assert_eq!(last, (pose(epoch), epoch as f32), "the pose of the frame");
                let before = frame.before().epoch().expect("a label");
                assert!(before == 0 || (earlier, shown) == (pose(before), before as f32));
            }
        }
        sender.join().expect("no panic");
    });
    let orders = orders.load(std::sync::atomic::Ordering::Relaxed);
    println!("interleavings: {orders}");
    assert!(orders > 100, "{orders}");
}

/// The check can fail: on a buffer without the protocol it finds a torn read.
#[test]
#[should_panic(expected = "torn")]
fn a_buffer_without_the_protocol_is_torn() {
    use loom::sync::Arc;
    use loom::sync::atomic::{AtomicU32, Ordering};
    loom::model(|| {
        let plain = Arc::new([AtomicU32::new(0), AtomicU32::new(0)]);
        let other = Arc::clone(&plain);
        let sender = thread::spawn(move || {
            other.iter().for_each(|word| word.store(1, Ordering::Relaxed));
        });
        let words = [plain[0].load(Ordering::Relaxed), plain[1].load(Ordering::Relaxed)];
        assert!(words[0] == words[1], "torn");
        sender.join().expect("no panic");
    });
}
