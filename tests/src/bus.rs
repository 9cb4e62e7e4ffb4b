//! A small surface on a bus, for tests of the bus.

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{CHECKSUM_BYTES, Encoding, FrameEncoder, FrameId, Mac, QuantisedBox};
use dibs_nostd::{
    AdmissionCheck, Advance, Assembler, FrameReader, Frames, Millis, NoAdmissionCheck,
    ReceiveError, VertexTable,
};

/// Mesh id of the packets.
pub const MESH: u32 = 0xD1B5_0001;
/// Vertices of the surface.
pub const N: usize = 40;
/// An assembler without an admission check, and the reader of its frames.
pub type Bus = (Assembler<'static, NoAdmissionCheck>, FrameReader<'static>);

/// A new bus without an admission check.
pub fn bus() -> Bus {
    bus_with(NoAdmissionCheck)
}

/// A new bus with an admission check.
///
/// # Panics
/// Never: the frames are new.
pub fn bus_with<G: AdmissionCheck>(
    admission_check: G,
) -> (Assembler<'static, G>, FrameReader<'static>) {
    let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    (Assembler::new(writer, admission_check, MESH, 100.0), reader)
}

/// A surface that differs in every epoch.
pub fn surface(epoch: u32) -> Vec<Vec3> {
    (0..N)
        .map(|i| {
            let t = i as f32 + (epoch % 1000) as f32 * 0.01;
            Vec3::new((t * 0.7).sin() * 40.0, (t * 1.3).cos() * 30.0, t * 0.9 - 20.0)
        })
        .collect()
}

/// The encoding of a surface: quantised in a box around it, or floats.
///
/// # Panics
/// If no box covers the positions.
pub fn encoding(quantised: bool, positions: &[Vec3]) -> Encoding {
    if quantised {
        Encoding::Quantised(QuantisedBox::covering(positions).unwrap())
    } else {
        Encoding::Float
    }
}

/// A frame cut into packets.
///
/// # Panics
/// If the frame cannot be sent.
pub fn packets<const MTU: usize>(
    epoch: u32,
    encoding: Encoding,
    positions: &[Vec3],
) -> Vec<Vec<u8>> {
    collect(FrameEncoder::<_, MTU>::new(id(epoch), encoding, positions).unwrap())
}

/// All packets of an encoder.
pub fn collect<T: VertexTable + ?Sized, M: Mac, const MTU: usize>(
    mut encoder: FrameEncoder<'_, T, MTU, M>,
) -> Vec<Vec<u8>> {
    let mut buffer = [0; MTU];
    let mut packets = Vec::new();
    while let Some(packet) = encoder.next_packet(&mut buffer) {
        packets.push(packet.to_vec());
    }
    packets
}

/// A frame of session 1.
pub const fn id(epoch: u32) -> FrameId {
    FrameId { mesh_id: MESH, session: 1, epoch }
}

/// The packets of [`surface`] in an epoch, for CAN-FD.
pub fn frame(epoch: u32, quantised: bool) -> Vec<Vec<u8>> {
    let positions = surface(epoch);
    packets::<64>(epoch, encoding(quantised, &positions), &positions)
}

/// Gives a packet to the assembler, and lets it do all pending work, in slices. Returns the epoch of the frame that
/// this publishes, if any.
///
/// # Errors
/// The assembler's rejection.
pub fn give<G: AdmissionCheck, M: Mac>(
    assembler: &mut Assembler<'_, G, M>,
    packet: &[u8],
) -> Result<Option<u32>, ReceiveError> {
    give_at(assembler, packet, 0)
}

/// The same, at a time on the receiver's clock.
///
/// # Errors
/// The assembler's rejection.
pub fn give_at<G: AdmissionCheck, M: Mac>(
    assembler: &mut Assembler<'_, G, M>,
    packet: &[u8],
    now: u32,
) -> Result<Option<u32>, ReceiveError> {
    assembler.accept(packet, Millis(now))?;
    for _ in 0..1000 {
        match assembler.advance(7)? {
            Advance::Published { epoch } => return Ok(Some(epoch)),
            Advance::Pending => {}
            // A few more slices, which copy rows in advance.
            _ => {
                let rows = assembler.surface().map_or(0, |surface| surface.len());
                for _ in 0..rows / 7 + 1 {
                    assembler.advance(7)?;
                }
                return Ok(None);
            }
        }
    }
    Ok(None)
}

/// A packet with padding and checksum, written only by the specification.
pub fn raw(
    kind: u8,
    session: u32,
    epoch: u32,
    [sequence, count]: [u16; 2],
    first: u32,
    body: &[u8],
) -> Vec<u8> {
    let mut packet = vec![4, kind];
    packet.extend((session as u16).to_le_bytes());
    packet.extend(MESH.to_le_bytes());
    packet.extend(epoch.to_le_bytes());
    packet.extend(sequence.to_le_bytes());
    packet.push(count as u8);
    packet.extend(&first.to_le_bytes()[..3]);
    packet.extend(body);
    let bytes = packet.len() + CHECKSUM_BYTES;
    let padded = [24, 32, 48, 64].into_iter().find(|&length| bytes <= length).unwrap_or(bytes);
    packet.resize(padded, 0);
    reseal(packet)
}

/// A begin packet of a float frame, written only by the specification.
pub fn raw_begin(session: u32, epoch: u32, content: u8, rows: u32, base: u32) -> Vec<u8> {
    let mut body = ((session >> 16) as u16).to_le_bytes().to_vec();
    let rows = &rows.to_le_bytes()[..3];
    body.extend([0, 0, content, 0]);
    body.extend(if content == 2 { &[0; 3] } else { rows });
    body.extend([0; 3]);
    body.extend(if content == 2 { rows } else { &[0; 3] });
    body.extend([0; 21]);
    let back = if content == 1 { epoch.wrapping_sub(base) as u16 } else { 0 };
    raw(1, session, epoch, [back, 0], 0, &body)
}

/// The checksum in a packet.
///
/// # Panics
/// For a packet that is too short for a checksum.
pub fn checksum(packet: &[u8]) -> u32 {
    u32::from_le_bytes(packet[packet.len() - CHECKSUM_BYTES..].try_into().unwrap())
}

/// Epoch and positions (as bits) of the published frame.
///
/// # Panics
/// If a vertex is missing.
pub fn published(reader: &mut FrameReader<'_>) -> Option<(u32, Vec<[u32; 3]>)> {
    let frame = reader.read()?;
    let positions = (0..N as u32).map(|v| frame.position(v).unwrap().to_array().map(f32::to_bits));
    Some((frame.label().epoch, positions.collect()))
}

/// A packet's contribution to its frame's digest, computed only by the specification.
pub fn contribution(packet: &[u8]) -> u32 {
    let mut contribution = checksum(packet);
    for (shift, factor) in [(16, 0x85EB_CA6B_u32), (13, 0xC2B2_AE35)] {
        contribution = (contribution ^ (contribution >> shift)).wrapping_mul(factor);
    }
    contribution ^ (contribution >> 16)
}

/// CRC-32 by its definition, one bit at a time: it shares no code with the core's checksum.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 * (crc & 1)))
    })
}

/// Corrects the checksum of a changed packet.
pub fn reseal(mut packet: Vec<u8>) -> Vec<u8> {
    packet.truncate(packet.len() - CHECKSUM_BYTES);
    let checksum = crc32(&packet);
    packet.extend(checksum.to_le_bytes());
    packet
}
