//! Every order in which one writer and one reader can see each other's steps, by the model checker loom:
//! no frame is torn, none is lost, and nobody waits.
#![cfg(loom)]

use dibs_nostd::glam::Vec3;
use dibs_nostd::{FrameLabel, Frames, PublishError, VertexTable};
use loom::thread;

const VERTICES: usize = 1;

/// A frame that carries its epoch everywhere.
fn label(epoch: u32) -> FrameLabel {
    FrameLabel { epoch, received: epoch + 100, position_error: 0.0, stretch: None }
}

fn position(epoch: u32) -> Vec3 {
    Vec3::new(epoch as f32, epoch as f32 + 0.25, epoch as f32 + 0.5)
}

/// The writer publishes three frames, giving up a frame when the reader is in the way; the reader reads
/// three times. Loom runs this in every order.
#[test]
fn no_order_of_steps_tears_a_frame() {
    let orders = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let counter = orders.clone();
    loom::model(move || {
        counter.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let frames: &'static Frames<VERTICES> = Box::leak(Box::new(Frames::new()));
        let (mut writer, mut reader) = frames.split().expect("split once");
        let sender = thread::spawn(move || {
            let mut published = 0;
            for epoch in 1..=3 {
                writer.begin();
                writer.push(position(epoch)).expect("inside the table");
                match writer.publish(label(epoch)) {
                    Ok(()) => published = epoch,
                    Err(PublishError::Busy) => {}
                    Err(other) => panic!("{other}"),
                }
            }
            published
        });
        let mut newest = 0;
        for _ in 0..3 {
            if let Some(frame) = reader.read() {
                let epoch = frame.label().epoch;
                assert_eq!(frame.label(), label(epoch), "the label is of one epoch");
                assert_eq!(frame.position(0), Some(position(epoch)), "as is the position");
                assert!(epoch >= newest, "no frame is older than one that was read");
                newest = epoch;
            }
        }
        let published = sender.join().expect("no panic");
        let last = reader.read().map_or(0, |frame| frame.label().epoch);
        assert_eq!(last, published, "what was published last is what is read");
    });
    let orders = orders.load(std::sync::atomic::Ordering::Relaxed);
    println!("interleavings: {orders}");
    assert!(orders > 100, "{orders}");
}

/// The same check on a buffer without the protocol finds the torn read: it can fail.
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
