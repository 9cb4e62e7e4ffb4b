//! The double buffer: one writer, one reader, complete frames, no torn read.

// Requirement: F-01

use std::sync::atomic::{AtomicU32, Ordering};

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    FrameAge, FrameLabel, FrameReader, Frames, Millis, PublishError, SplitError, Unavailable,
    VertexTable,
};

fn label(epoch: u32) -> FrameLabel {
    FrameLabel {
        epoch,
        received: Millis(epoch.wrapping_mul(3)),
        position_error: 0.5,
        stretch: None,
    }
}

/// A vertex that encodes the epoch and its own number.
fn vertex_of(epoch: u32, vertex: u32) -> Vec3 {
    Vec3::new(f32::from_bits(epoch), vertex as f32, f32::from_bits(!epoch))
}

#[test]
fn there_is_one_writer_and_one_reader() {
    let frames = Frames::<1>::new();
    assert!(frames.split().is_ok());
    assert_eq!(frames.split().map(|_| ()), Err(SplitError));
}

#[test]
fn nothing_is_read_before_the_first_frame() {
    let frames = Frames::<2>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    assert!(reader.read().is_none());
    assert!(writer.front().is_none());
    assert_eq!(writer.publish(label(1)), Err(PublishError::Incomplete { missing: 2 }));
    // A read without a frame does not delay the publication.
    writer.push(Vec3::ONE).unwrap();
    assert_eq!(writer.publish(label(1)), Err(PublishError::Incomplete { missing: 1 }));
    // A frame that is begun again has no vertices.
    writer.begin();
    assert_eq!(writer.missing(), 2);
    writer.push(Vec3::ONE).unwrap();
    assert_eq!(writer.publish(label(1)), Err(PublishError::Incomplete { missing: 1 }));
    writer.push(Vec3::ONE).unwrap();
    assert_eq!(writer.publish(label(1)), Ok(()));
    assert_eq!(reader.read().unwrap().label(), label(1));
}

#[test]
fn a_frame_is_published_once_and_begun_anew() {
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    writer.begin();
    writer.push(Vec3::X).unwrap();
    writer.publish(label(1)).unwrap();
    assert_eq!(writer.publish(label(2)), Err(PublishError::Incomplete { missing: 1 }));
    writer.push(Vec3::Y).unwrap();
    assert_eq!(reader.read().unwrap().position(0), Some(Vec3::X), "writes go to the back");
    writer.begin();
    writer.push(Vec3::Y).unwrap();
    assert_eq!(writer.back().position(0), Some(Vec3::Y));
    writer.publish(label(2)).unwrap();
    assert_eq!(reader.read().unwrap().position(0), Some(Vec3::Y));
    assert_eq!(writer.front().unwrap().position(0), Some(Vec3::Y));
}

#[test]
fn a_read_in_progress_holds_the_publication_back() {
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    for epoch in 1..=2 {
        writer.begin();
        writer.push(vertex_of(epoch, 0)).unwrap();
        if epoch == 1 {
            writer.publish(label(1)).unwrap();
        }
    }
    let guard = reader.read().unwrap();
    assert_eq!(writer.publish(label(2)), Err(PublishError::Busy));
    assert_eq!(guard.label(), label(1));
    assert_eq!(guard.position(0).map(|p| p.x.to_bits()), Some(1));
    drop(guard);
    assert_eq!(writer.publish(label(2)), Ok(()));
    assert_eq!(reader.read().unwrap().label(), label(2));
}

#[test]
fn the_table_ends_where_it_ends() {
    let frames = Frames::<3>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    writer.begin();
    for vertex in 0..3 {
        writer.push(vertex_of(9, vertex)).unwrap();
    }
    let error = writer.push(Vec3::ZERO).unwrap_err();
    assert_eq!((error.vertex, error.vertices), (3, 3));
    writer.publish(label(9)).unwrap();
    let frame = reader.read().unwrap();
    assert_eq!(frame.len(), 3);
    assert!(frame.position(2).is_some());
    assert_eq!(frame.position(3), None);
}

#[test]
fn age_is_right_over_a_wrap_of_the_clock() {
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    writer.begin();
    writer.push(Vec3::ZERO).unwrap();
    writer.publish(FrameLabel { received: Millis(u32::MAX - 4), ..label(1) }).unwrap();
    assert_eq!(
        reader.latest(Millis(5)).frame(),
        Some(FrameAge { epoch: 1, received: Millis(u32::MAX - 4), age: Millis(10) })
    );
    assert!(reader.latest(Millis(5)).within(Millis(10)).is_ok());
    assert_eq!(
        reader.latest(Millis(5)).within(Millis(9)).err(),
        Some(Unavailable::Stale { age: Millis(10) })
    );
}

/// The clock may wrap any number of times: a frame's age never decreases.
#[test]
fn a_frame_does_not_grow_young_again() {
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    writer.push(Vec3::ZERO).unwrap();
    writer.publish(FrameLabel { received: Millis(1000), ..label(1) }).unwrap();
    let (mut clock, mut last) = (1000_u32, 0);
    for step in 0..50_u64 {
        let age = age(&mut reader, clock);
        let true_age = step * 0x3FFF_FFFF;
        assert_eq!(u64::from(age), true_age.min(u32::MAX.into()), "step {step}");
        assert!(age >= last);
        last = age;
        clock = clock.wrapping_add(0x3FFF_FFFF);
    }
    // The next frame has a small age.
    writer.push(Vec3::ZERO).unwrap();
    writer.publish(FrameLabel { received: Millis(clock), ..label(2) }).unwrap();
    assert_eq!(age(&mut reader, clock.wrapping_add(7)), 7);
}

fn age(reader: &mut FrameReader<'_>, now: u32) -> u32 {
    reader.latest(Millis(now)).frame().expect("published").age.0
}

/// Another core may have stamped the frame slightly later than this one read its clock: such a frame counts as new. A
/// frame from farther ahead counts as old: otherwise one flipped bit of the stamp would keep a frozen surface fresh for
/// days.
#[test]
fn a_frame_from_the_future_is_new_or_old_but_never_in_between() {
    let frames = Frames::<1>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    let mut publish = |received, epoch| {
        writer.begin();
        writer.push(Vec3::ZERO).unwrap();
        writer.publish(FrameLabel { received, ..label(epoch) }).unwrap();
    };
    for (epoch, ahead) in (1..).zip([1, 16, 17, 1 << 10, 1 << 25, 1 << 30, 1 << 31]) {
        publish(Millis(5_u32.wrapping_add(ahead)), epoch);
        let age = age(&mut reader, 5);
        assert!(if ahead <= 16 { age == 0 } else { age >= 1 << 31 }, "{ahead} ahead: {age}");
    }
}

/// For any number of vertices: two buffers of positions, and a fixed size for labels and state.
#[test]
fn a_double_buffer_takes_24_bytes_a_vertex() {
    assert_eq!(size_of::<Frames<1>>() - 24, size_of::<Frames<10_001>>() - 24 * 10_001);
    assert!(size_of::<Frames<1>>() <= 24 + 160, "{}", size_of::<Frames<1>>());
}

/// A writer and a reader run at full speed: every read sees one complete frame, and epochs never decrease. The test
/// ends when the reader has seen many frames, however the machine schedules the two threads.
#[test]
fn no_read_is_torn() {
    const N: usize = 97;
    // Unoptimised builds, such as the sanitizers', see fewer frames.
    const FRAMES_TO_SEE: u32 = if cfg!(debug_assertions) { 4_000 } else { 20_000 };
    static FRAMES: Frames<N> = Frames::new();
    static SEEN: AtomicU32 = AtomicU32::new(0);
    let (mut writer, mut reader) = FRAMES.split().unwrap();

    std::thread::scope(|scope| {
        let writing = scope.spawn(move || {
            let (mut epoch, mut busy) = (0, 0_u64);
            while SEEN.load(Ordering::Relaxed) < FRAMES_TO_SEE {
                epoch += 1;
                writer.begin();
                for vertex in 0..N as u32 {
                    writer.push(vertex_of(epoch, vertex)).unwrap();
                }
                while writer.publish(label(epoch)) == Err(PublishError::Busy) {
                    busy += 1;
                    std::thread::yield_now();
                }
            }
            (epoch, busy)
        });
        let (mut reads, mut last) = (0_u64, 0_u32);
        // After a failed assertion the writer must be stopped first, or the scope would wait for it forever.
        let verdict = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            while SEEN.load(Ordering::Relaxed) < FRAMES_TO_SEE {
                if let Some(frame) = reader.read() {
                    let epoch = frame.label().epoch;
                    assert!(epoch >= last, "frame {epoch} after {last}");
                    for vertex in 0..N as u32 {
                        let position = frame.position(vertex).unwrap().to_array();
                        assert_eq!(
                            position.map(f32::to_bits),
                            vertex_of(epoch, vertex).to_array().map(f32::to_bits),
                            "vertex {vertex} of frame {epoch} is torn"
                        );
                    }
                    assert_eq!(frame.label(), label(epoch));
                    reads += 1;
                    if epoch != last {
                        SEEN.fetch_add(1, Ordering::Relaxed);
                    }
                    last = epoch;
                }
                // Pauses of many lengths, so that publications occur at every point of a read.
                for _ in 0..reads % 61 {
                    std::hint::spin_loop();
                }
                if reads % 16 == 0 {
                    std::thread::yield_now();
                }
            }
        }));
        SEEN.store(FRAMES_TO_SEE, Ordering::Relaxed);
        let (written, busy) = writing.join().unwrap();
        println!("{reads} reads of {written} frames; {busy} attempts to publish had to wait");
        if let Err(torn) = verdict {
            std::panic::resume_unwind(torn);
        }
    });
}
