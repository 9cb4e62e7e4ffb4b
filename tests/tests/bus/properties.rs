//! The bus against random packets, orders, losses and damage.

// Requirement: B-01

use std::collections::BTreeSet;

use dibs_nostd::glam::{DVec3, Vec3};
use dibs_nostd::wire::{Deframer, Encoding, Event, Packet, QuantisedBox, enframe, framed_bytes};
use dibs_nostd::{Millis, ReceiveError};
use dibs_tests::bus::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn order_and_repetition_do_not_matter(
        quantised: bool,
        order in Just((1..100_usize).collect::<Vec<_>>()).prop_shuffle(),
        repeated in prop::collection::vec(0..100_usize, 0..20),
    ) {
        let frame = frame(7, quantised);
        let (mut in_order, mut expected) = bus();
        for packet in &frame {
            give(&mut in_order, packet).unwrap();
        }
        let (mut assembler, mut reader) = bus();
        give(&mut assembler, &frame[0]).unwrap();
        let mut is_published = false;
        for &i in repeated.iter().chain(&order).filter(|&&i| i < frame.len()) {
            match give(&mut assembler, &frame[i]) {
                Ok(Some(7)) => is_published = true,
                // The frame is already published.
                Err(ReceiveError::Stale { epoch: 7 }) => prop_assert!(is_published),
                outcome => prop_assert!(outcome.is_ok(), "{outcome:?}"),
            }
        }
        prop_assert!(is_published);
        prop_assert_eq!(published(&mut reader), published(&mut expected));
    }

    /// Over a line that loses, repeats, reorders and damages packets, every published frame is one that was sent.
    #[test]
    fn only_what_was_sent_is_published(
        faults in prop::collection::vec((0..6_u8, any::<prop::sample::Index>(), 0..512_usize), 0..30),
        quantised: bool,
    ) {
        let mut line: Vec<Vec<u8>> = (1..=6).flat_map(|epoch| frame(epoch, quantised)).collect();
        for (fault, index, bit) in faults {
            let at = index.index(line.len());
            if line[at].is_empty() { continue; }
            match fault {
                0 => drop(line.remove(at)),
                1 => line.insert(at, line[at].clone()),
                2 => { let other = (at + bit % 9) % line.len(); line.swap(at, other); }
                3 => { let bits = line[at].len() * 8; line[at][bit % bits / 8] ^= 1 << (bit % 8); }
                4 => { let len = line[at].len(); line[at].truncate(bit % len); }
                _ => { let len = line[at].len(); for byte in &mut line[at][bit % len..] { *byte = 0xFF; } }
            }
        }
        let (mut assembler, mut reader) = bus();
        let mut taken = BTreeSet::new();
        for packet in &line {
            if let Ok(Some(epoch)) = give(&mut assembler, packet) {
                prop_assert!(taken.insert(epoch), "frame {} was published twice", epoch);
                let sent = surface(epoch);
                let expected: Vec<_> = match encoding(quantised, &sent) {
                    Encoding::Quantised(grid) => sent
                        .iter()
                        .map(|&p| grid.position(grid.quantise(p).unwrap()))
                        .collect(),
                    _ => sent,
                };
                let expected: Vec<_> =
                    expected.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
                prop_assert_eq!(published(&mut reader), Some((epoch, expected)));
            }
        }
        prop_assert_eq!(taken.len() as u32, assembler.counters().of(Event::Published));
    }

    #[test]
    fn bursts_are_always_detected(
        start in 0..480_usize, burst: u32, quantised: bool, which in any::<prop::sample::Index>(),
    ) {
        prop_assume!(burst != 0);
        let frame = frame(7, quantised);
        let mut packet = frame[which.index(frame.len())].clone();
        let mut changed = false;
        for bit in (0..32).filter(|bit| burst >> bit & 1 == 1) {
            if let Some(byte) = packet.get_mut((start + bit) / 8) {
                *byte ^= 1 << ((start + bit) % 8);
                changed = true;
            }
        }
        prop_assert_eq!(Packet::decode(&packet).is_err(), changed);
    }

    #[test]
    fn arbitrary_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = Packet::decode(&bytes);
        let (mut assembler, _reader) = bus();
        let _ = assembler.accept(&bytes, Millis(0));
        let mut deframer = Deframer::<64>::new();
        for &byte in &bytes {
            if let Some(Ok(packet)) = deframer.push(byte) {
                prop_assert!(packet.len() <= 64 && packet.len() <= bytes.len());
            }
        }
    }

    /// The same with correct checksums and plausible fields, which reach the checks after the checksum. A frame was
    /// begun before; without its other packets nothing is published.
    #[test]
    fn arbitrary_fields_are_survived(
        packets in prop::collection::vec((
            0..10_u8, 1..3_u32, 0..3_u32, 0..17_u16, 0..9_u16,
            prop_oneof![0..45_u32, any::<u32>()],
            prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..60),
            any::<bool>(),
        ), 1..20),
        quantised: bool,
    ) {
        let (mut assembler, mut reader) = bus();
        for packet in &frame(1, quantised)[..3] {
            give(&mut assembler, packet).unwrap();
        }
        for (kind, session, epoch, sequence, count, first, mut body, fit) in packets {
            if fit {
                let size = match kind {
                    1 => 36, 2 => 12 * count, 3 => 6 * count, 5 => 4 * count, 6 => 8,
                    7 => 20 + 4 * count, _ => 4,
                };
                body.resize(size.into(), 0);
            }
            let is_placed = !matches!(kind, 1 | 6 | 7);
            let sequence = if fit && !is_placed { 0 } else { sequence };
            let has_rows = matches!(kind, 2 | 3 | 5 | 7);
            let (count, first) = if fit && !has_rows { (0, 0) } else { (count, first) };
            let packet = raw(kind, session, epoch, [sequence, count], first, &body);
            let _ = give(&mut assembler, &packet);
            prop_assert!(published(&mut reader).is_none());
        }
    }

    #[test]
    fn quantisation_keeps_its_bound(
        corner in prop::array::uniform3(-1000.0_f32..1000.0),
        points in prop::collection::vec(prop::array::uniform3(0.0_f32..1.0), 1..30),
        size in prop_oneof![Just(0.0_f32), 0.001_f32..300.0],
    ) {
        let points: Vec<Vec3> =
            points.iter().map(|&p| Vec3::from(corner) + Vec3::from(p) * size).collect();
        let grid = QuantisedBox::covering(&points).unwrap();
        let (step, low, high) = (grid.step(), grid.origin(), grid.upper_corner());
        let rounding = low.abs().max(high.abs()).as_dvec3() / f64::from(1 << 22);
        for point in points {
            let row = grid.quantise(point).expect("the box covers its points");
            let decoded = grid.position(row);
            let off = (decoded.as_dvec3() - point.as_dvec3()).abs();
            prop_assert!(off.cmple(step.as_dvec3() * 0.5 + rounding).all(), "{off} of {step}");
            prop_assert!(off.length() <= f64::from(grid.error()));
            prop_assert!(decoded.cmpge(low).all() && decoded.cmple(high).all());
        }
    }

    /// This includes boxes close to the limits of f32, whose squares overflow it.
    #[test]
    fn boxes_of_any_size_keep_their_bound(
        exponents in prop::array::uniform3(-37.0_f32..37.0),
        origin in prop::array::uniform3(-3.0_f32..3.0),
        cells in prop::collection::vec(prop::array::uniform3(0.0_f64..65_535.0), 1..30),
    ) {
        let step = Vec3::from(exponents.map(|exponent| 10_f32.powf(exponent)));
        let Ok(grid) = QuantisedBox::new(step * Vec3::from(origin), step * 0.1) else {
            return Ok(());
        };
        for cell in cells {
            let (low, step) = (grid.origin().as_dvec3(), grid.step().as_dvec3());
            let point = (low + step * DVec3::from(cell)).as_vec3();
            if let Some(row) = grid.quantise(point) {
                let off = (grid.position(row).as_dvec3() - point.as_dvec3()).length();
                prop_assert!(off <= f64::from(grid.error()), "{off} of {}, {grid:?}", grid.error());
            }
        }
    }

    #[test]
    fn streams_carry_packets_and_recover_at_the_next(
        packets in prop::collection::vec(
            prop::collection::vec(prop_oneof![Just(0_u8), Just(1), Just(255), any::<u8>()], 1..600),
            1..6,
        ),
        damage: Option<(prop::sample::Index, u8)>,
    ) {
        let mut stream = Vec::new();
        let mut starts = Vec::new();
        for packet in &packets {
            let mut out = vec![0; framed_bytes(packet.len())];
            starts.push(stream.len());
            let framed = enframe(packet, &mut out).expect("framed_bytes is enough");
            prop_assert!(!framed[..framed.len() - 1].contains(&0));
            stream.extend_from_slice(framed);
        }
        // A damaged byte only destroys its own packet, or that one and its neighbour.
        let mut spoiled = None;
        if let Some((at, flip)) = damage && flip != 0 {
            let at = at.index(stream.len());
            stream[at] ^= flip;
            spoiled = Some(starts.partition_point(|&start| start <= at) - 1);
        }
        let mut deframer = Deframer::<600>::new();
        let mut arrived = Vec::new();
        for &byte in &stream {
            if let Some(Ok(packet)) = deframer.push(byte) {
                arrived.push(packet.to_vec());
            }
        }
        match spoiled {
            None => prop_assert_eq!(arrived, packets),
            Some(spoiled) => {
                let before = spoiled.min(packets.len());
                let after = packets.len().saturating_sub(spoiled + 2);
                prop_assert_eq!(&arrived[..before], &packets[..before]);
                prop_assert_eq!(
                    &arrived[arrived.len() - after..], &packets[packets.len() - after..]
                );
            }
        }
    }
}
