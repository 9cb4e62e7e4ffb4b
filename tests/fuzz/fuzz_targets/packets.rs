//! Sends any bytes over the bus. Every packet is taken or refused; a published frame is whole and finite. The input
//! is a sequence of packets, each after its length; packets of odd length get a right checksum.
#![no_main]

use dibs_nostd::{Millis, Assembler, Frames, NoAdmissionCheck, VertexTable};
use dibs_nostd::wire::Deframer;
use dibs_tests::bus::{MESH, N, reseal};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let frames = Frames::<N>::new();
    let (writer, mut reader) = frames.split().expect("split once");
    let mut assembler = Assembler::new(writer, NoAdmissionCheck, MESH, 100.0);
    let mut deframer = Deframer::<1024>::new();
    let mut rest = input;
    let mut now = 0;
    while let Some((&length, after)) = rest.split_first() {
        let (packet, after) = after.split_at(after.len().min(usize::from(length)));
        rest = after;
        now += 1;
        let sealed = if length % 2 == 1 && packet.len() > 4 {
            reseal(packet.to_vec())
        } else {
            packet.to_vec()
        };
        // Any outcome is right, except a panic.
        let _ = assembler.accept(&sealed, Millis(now));
        for &byte in packet {
            if let Some(Ok(framed)) = deframer.push(byte) {
                let _ = assembler.accept(framed, Millis(now));
            }
        }
        if let Some(frame) = reader.read() {
            for vertex in 0..N as u32 {
                let position = frame.position(vertex).expect("a published frame is whole");
                assert!(position.is_finite() && position.abs().max_element() <= 100.0);
            }
        }
    }
});
