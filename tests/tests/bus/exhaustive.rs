//! The receiver on surfaces so small that every case can be tested.

// Requirement: B-01

use std::collections::BTreeMap;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder};
use dibs_nostd::{Advance, Assembler, FrameReader, Frames, Millis, NoAdmissionCheck, VertexTable};
use dibs_tests::bus::*;

/// Rows of the surface: three packets.
const ROWS: usize = 9;

fn receiver<const R: usize>(
    frames: &Frames<R>,
) -> (Assembler<'_, NoAdmissionCheck>, FrameReader<'_>) {
    let (writer, reader) = frames.split().unwrap();
    (Assembler::new(writer, NoAdmissionCheck, MESH, 1e3), reader)
}

/// A model of the specification for a line without damage: it stores which packets have arrived.
#[derive(Default)]
struct Model {
    published: Option<u32>,
    /// Epoch, the packets that have arrived, and the time of the last accepted one.
    frame: Option<(u32, [bool; 5], u32)>,
}

impl Model {
    /// Receives packet `which` of a frame: 0 is the begin, 1 to 3 rows, 4 the commit. Returns the published epoch.
    fn take(&mut self, epoch: u32, which: usize, now: u32) -> Option<u32> {
        if self.published.is_some_and(|published| epoch <= published) {
            return None;
        }
        match (&mut self.frame, which) {
            (Some((current, _, touched)), 0) if *current > epoch && now - *touched < 100 => {}
            (Some((current, ..)), 0) if *current == epoch => {}
            (frame, 0) => *frame = Some((epoch, [true, false, false, false, false], now)),
            (Some((current, come, touched)), _) if *current == epoch => {
                if !come[which] {
                    *touched = now;
                }
                come[which] = true;
                if *come == [true; 5] {
                    self.frame = None;
                    self.published = Some(epoch);
                    return Some(epoch);
                }
            }
            _ => {}
        }
        None
    }
}

/// Sends every sequence of six packets of two frames, then the later frame. The receiver publishes exactly the model's
/// frames, and only complete ones.
#[test]
fn every_sequence_of_packets_of_two_frames() {
    let positions = |epoch: u32| [Vec3::splat(epoch as f32); ROWS];
    let frames: Vec<Vec<Vec<u8>>> = (1..=2)
        .map(|epoch| {
            let positions = positions(epoch);
            collect(FrameEncoder::<_, 64>::new(id(epoch), Encoding::Float, &positions[..]).unwrap())
        })
        .collect();
    let (mut cases, mut publications) = (0, 0);
    for case in 0..10_u32.pow(6) {
        let buffers = Frames::<ROWS>::new();
        let (mut assembler, mut reader) = receiver(&buffers);
        let mut model = Model::default();
        let digits = (0..6).map(|place| case / 10_u32.pow(place) % 10);
        // The later frame follows: first without its begin, then complete.
        for (place, letter) in (0..).zip(digits.chain([6, 7, 8, 9, 5, 6, 7, 8, 9])) {
            // After three packets that are not accepted, an unfinished frame may be displaced (100 ms).
            let now = 40 * place;
            let (epoch, which) = (letter / 5 + 1, (letter % 5) as usize);
            let packet = &frames[letter as usize / 5][which];
            let _ = assembler.accept(packet, Millis(now));
            let advance = assembler.advance(1);
            let expected = model.take(epoch, which, now);
            let published = match advance {
                Ok(Advance::Published { epoch }) => Some(epoch),
                _ => None,
            };
            assert_eq!(published, expected, "case {case}, letter {letter}");
            if let Some(epoch) = published {
                let frame = reader.read().unwrap();
                for row in 0..ROWS as u32 {
                    assert_eq!(frame.position(row).unwrap().x, epoch as f32);
                }
                publications += 1;
            }
        }
        cases += 1;
        assert_eq!(reader.read().unwrap().label().epoch, 2);
    }
    println!("{cases} sequences, {publications} publications");
}

/// A sender invents first rows, counts and sequence numbers, with correct checksums and digests. Every published row
/// was sent exactly once.
#[test]
fn no_row_that_was_not_sent_is_published() {
    const SMALL: usize = 3;
    let begin = raw_begin(1, 1, 0, SMALL as u32, 0);
    // Sequence numbers 1 to 3, with every range of rows.
    let mut letters = Vec::new();
    for sequence in 1..=3_u16 {
        for first in 0..SMALL as u32 {
            for count in 1..=(SMALL as u16 - first as u16) {
                let mut body = Vec::new();
                for row in 0..count {
                    let value = 1.0 + f32::from(sequence) * 10.0 + first as f32 + f32::from(row);
                    (0..3).for_each(|_| body.extend(value.to_le_bytes()));
                }
                letters.push(raw(2, 1, 1, [sequence, count], first, &body));
            }
        }
    }
    let mut outcomes = BTreeMap::new();
    for length in 1..=4_u32 {
        for case in 0..(letters.len() as u32).pow(length) {
            for end in 2..=4_u16 {
                let buffers = Frames::<SMALL>::new();
                let (mut assembler, mut reader) = receiver(&buffers);
                assembler.accept(&begin, Millis(0)).unwrap();
                let mut digest = contribution(&begin);
                let mut sent = [const { Vec::new() }; SMALL];
                for place in 0..length {
                    let letter = case / (letters.len() as u32).pow(place) % letters.len() as u32;
                    let packet = &letters[letter as usize];
                    if assembler.accept(packet, Millis(0)) == Ok(dibs_nostd::Progress::Stored) {
                        digest = digest.wrapping_add(contribution(packet));
                        for row in 0..usize::from(packet[14]) {
                            let at = 18 + 12 * row;
                            let x = f32::from_le_bytes(packet[at..at + 4].try_into().unwrap());
                            sent[packet[15] as usize + row].push(x);
                        }
                    }
                }
                let commit = raw(4, 1, 1, [end, 0], 0, &digest.to_le_bytes());
                let _ = assembler.accept(&commit, Millis(0));
                let is_published = matches!(assembler.advance(1), Ok(Advance::Published { .. }));
                *outcomes.entry(is_published).or_insert(0_u32) += 1;
                if let Some(frame) = reader.read() {
                    for (row, sent) in (0..).zip(&sent) {
                        let position = frame.position(row).unwrap();
                        assert_eq!(sent, &[position.x], "each row was sent, and once");
                    }
                }
            }
        }
    }
    println!("published or not: {outcomes:?}");
    assert!(outcomes[&true] > 100 && outcomes[&false] > 100_000);
}
