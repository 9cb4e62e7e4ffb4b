//! Applies a fault to one packet.

use std::collections::VecDeque;

use dibs_nostd::format::CRC;
use dibs_nostd::wire::{
    Body, CHECKSUM_BYTES, Content, Encoding, HEADER_BYTES, NoMac, Packet, PacketRows, TAG_BYTES,
};
use fastrand::Rng;

use super::Fault;

/// Number of frames that a replay may choose from.
const REMEMBERED: usize = 8;

/// Turns packets into faulty packets. The same seed and the same packets give the same faults.
#[derive(Debug)]
pub struct Injector {
    rng: Rng,
    /// Packets of the last frames; the present frame is last.
    frames: VecDeque<Vec<Vec<u8>>>,
    /// Delayed packets, each with the number of packets that are delivered before it.
    late: Vec<(usize, Vec<u8>)>,
    /// Rows of the surface, from the last begin packet.
    rows: u32,
    /// Difference of the altered frame's digest from the sent one's.
    digest: u32,
}

impl Injector {
    /// An injector that has not seen any packet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            rng: Rng::with_seed(seed),
            frames: VecDeque::new(),
            late: Vec::new(),
            rows: 0,
            digest: 0,
        }
    }

    /// Passes a packet unchanged. Returns the packets that the receiver gets: this packet, and delayed ones that are
    /// due.
    pub fn pass(&mut self, packet: &[u8]) -> Vec<Vec<u8>> {
        self.watch(packet);
        let packet = self.corrected(packet);
        self.with_late(vec![packet])
    }

    /// Applies a fault to a packet. Returns the packets that the receiver gets. If the fault does not apply to this
    /// packet (say, a NaN position to a packet without positions), it returns `None` and has no effect.
    pub fn inject(&mut self, fault: Fault, packet: &[u8]) -> Option<Vec<Vec<u8>>> {
        let faulty = match fault {
            Fault::Drop => Vec::new(),
            Fault::Duplicate => vec![packet.to_vec(), packet.to_vec()],
            Fault::Reorder => {
                self.watch(packet);
                let others = self.with_late(Vec::new());
                self.late.push((self.rng.usize(1..=4), packet.to_vec()));
                return Some(others);
            }
            Fault::Replay => self.replay(packet)?,
            _ if fault.is_damage() => {
                let mut damaged = packet.to_vec();
                self.damage(fault, &mut damaged);
                vec![damaged]
            }
            _ => vec![self.altered(fault, packet)?],
        };
        self.watch(packet);
        Some(self.with_late(faulty))
    }

    /// Damages at least one of a packet's bytes in place, framed or not.
    ///
    /// Truncation and overrun shorten; an empty slice stays as it is.
    pub fn damage(&mut self, fault: Fault, bytes: &mut Vec<u8>) {
        let rng = &mut self.rng;
        if bytes.is_empty() {
            return;
        }
        let bits = bytes.len() * 8;
        let flip = |bytes: &mut [u8], bit: usize| bytes[bit / 8] ^= 1 << (bit % 8);
        match fault {
            Fault::FlipOne => flip(bytes, rng.usize(..bits)),
            Fault::FlipTwo => {
                let first = rng.usize(..bits);
                let second = (first + rng.usize(1..bits)) % bits;
                flip(bytes, first);
                flip(bytes, second);
            }
            Fault::Burst => {
                let length = rng.usize(2..=64.min(bits));
                let first = rng.usize(..=bits - length);
                // The first and last bit of a burst are always flipped, the bits between them at random.
                for bit in 0..length {
                    if bit == 0 || bit + 1 == length || rng.bool() {
                        flip(bytes, first + bit);
                    }
                }
            }
            Fault::Truncate => bytes.truncate(rng.usize(..bytes.len())),
            _ => {
                let lost = rng.usize(1..=16.min(bytes.len()));
                let first = rng.usize(..=bytes.len() - lost);
                bytes.drain(first..first + lost);
            }
        }
    }

    /// Records a packet that was sent.
    fn watch(&mut self, packet: &[u8]) {
        let Ok(Packet { body, .. }) = Packet::decode(packet) else { return };
        if let Body::Begin(begin) = body {
            self.digest = 0;
            if begin.content != Content::Modal {
                self.rows = begin.rows;
            }
            self.frames.push_back(Vec::new());
            if self.frames.len() > REMEMBERED {
                self.frames.pop_front();
            }
        }
        if let Some(frame) = self.frames.back_mut() {
            frame.push(packet.to_vec());
        }
    }

    /// Adds the delayed packets that are due.
    fn with_late(&mut self, mut packets: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        for (after, _) in &mut self.late {
            *after -= 1;
        }
        packets
            .extend(self.late.extract_if(.., |(after, _)| *after == 0).map(|(_, packet)| packet));
        packets
    }

    /// Alters a commit so that it confirms its altered frame; returns any other packet unchanged.
    fn corrected(&mut self, packet: &[u8]) -> Vec<u8> {
        let mut packet = packet.to_vec();
        let commit = match Packet::decode(&packet) {
            Ok(Packet { body: Body::Commit(commit), .. }) if self.digest != 0 => commit,
            _ => return packet,
        };
        let digest = commit.digest.wrapping_add(self.digest);
        packet[HEADER_BYTES..HEADER_BYTES + 4].copy_from_slice(&digest.to_le_bytes());
        self.digest = 0;
        seal(&mut packet);
        packet
    }

    fn replay(&mut self, packet: &[u8]) -> Option<Vec<Vec<u8>>> {
        // Packets of the present frame would be duplicates instead.
        let is_begin = matches!(Packet::decode(packet).ok()?.body, Body::Begin(_));
        let earlier = self.frames.len() - usize::from(!is_begin && !self.frames.is_empty());
        if earlier == 0 {
            return None;
        }
        let frame = &self.frames[self.rng.usize(..earlier)];
        let mut packets = if self.rng.bool() {
            frame.clone()
        } else {
            vec![frame[self.rng.usize(..frame.len())].clone()]
        };
        packets.push(packet.to_vec());
        Some(packets)
    }

    /// A packet with one field changed, and a checksum that matches.
    fn altered(&mut self, fault: Fault, packet: &[u8]) -> Option<Vec<u8>> {
        let decoded = Packet::decode(packet).ok()?;
        let is_tagged = packet[1] & 0x80 != 0;
        let mut altered = packet.to_vec();
        let mut put =
            |at: usize, bytes: &[u8]| altered[at..at + bytes.len()].copy_from_slice(bytes);
        let rng = &mut self.rng;
        match (fault, decoded.body) {
            (Fault::StaleEpoch, _) => {
                let epoch = decoded.epoch.wrapping_sub(rng.u32(1..1 << 31));
                put(8, &epoch.to_le_bytes());
            }
            (Fault::WrongMesh, _) => {
                put(4, &(decoded.mesh_id ^ rng.u32(1..)).to_le_bytes());
            }
            (Fault::OutOfRange, Body::Vertices(vertices)) => {
                let least = (self.rows + 1).saturating_sub(vertices.rows.len() as u32);
                let first = rng.u32(least..1 << 24).to_le_bytes();
                put(15, &first[..3]);
            }
            (Fault::NotFinite | Fault::TooFar, Body::Vertices(vertices)) => {
                let PacketRows::Float(rows) = vertices.rows else { return None };
                let coordinate = HEADER_BYTES + 4 * rng.usize(..3 * rows.len());
                put(coordinate, &bad_number(fault, rng).to_le_bytes());
            }
            (Fault::NotFinite | Fault::TooFar, Body::Weights(weights)) => {
                let weight = HEADER_BYTES + 4 * rng.usize(..weights.values.len());
                put(weight, &bad_number(fault, rng).to_le_bytes());
            }
            (Fault::NotFinite | Fault::TooFar, Body::Begin(begin)) => {
                let Encoding::Quantised(_) = begin.encoding else { return None };
                // One of the origin's three coordinates.
                let number = HEADER_BYTES + 12 + 4 * rng.usize(..3);
                put(number, &bad_number(fault, rng).to_le_bytes());
            }
            (Fault::Stretch, Body::Vertices(vertices)) => match vertices.rows {
                PacketRows::Quantised(rows) => {
                    // Half of the box's extent away.
                    let at = HEADER_BYTES + 2 * rng.usize(..3 * rows.len()) + 1;
                    put(at, &[packet[at] ^ 0x80]);
                }
                PacketRows::Float(rows) => {
                    let at = HEADER_BYTES + 4 * rng.usize(..3 * rows.len());
                    // Mirrored and doubled, or moved away from zero: still a possible position.
                    let value = float_at(packet, at);
                    let moved = if value < 0.0 { value + FAR } else { value - FAR };
                    put(at, &moved.to_le_bytes());
                }
                _ => return None,
            },
            (Fault::Pose, Body::Pose(_)) => {
                // One of the four numbers of the rotation, or of the three of the shift.
                let at = HEADER_BYTES + 4 * rng.usize(..7);
                let value = float_at(packet, at);
                let change = [value + 1.0, -value - 1.0, value + 0.001, f32::NAN, 3e30];
                put(at, &change[rng.usize(..change.len())].to_le_bytes());
            }
            (Fault::Forgery, _) if is_tagged => {
                let tag = packet.len() - CHECKSUM_BYTES - TAG_BYTES;
                let at = match decoded.body {
                    // Other content under the same tag; changed padding would be malformed.
                    Body::Vertices(_) | Body::Pose(_) | Body::Commit(_) if rng.bool() => {
                        HEADER_BYTES
                    }
                    _ => tag + rng.usize(..TAG_BYTES),
                };
                put(at, &[packet[at] ^ rng.u8(1..)]);
            }
            _ => return None,
        }
        seal(&mut altered);
        if fault == Fault::Stretch {
            let change = contribution(&altered).wrapping_sub(contribution(packet));
            self.digest = self.digest.wrapping_add(change);
        }
        Some(altered)
    }
}

/// Distance (mm) that a float position is moved by to violate the stretch limit: longer than any triangle, shorter than
/// any limit on coordinates.
const FAR: f32 = 100.0;

fn bad_number(fault: Fault, rng: &mut Rng) -> f32 {
    let values: &[f32] = if fault == Fault::NotFinite {
        &[f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY]
    } else {
        &[1e9, -1e9, 3e30, f32::MAX, f32::MIN]
    };
    values[rng.usize(..values.len())]
}

/// The number in these four bytes.
fn float_at(packet: &[u8], at: usize) -> f32 {
    f32::from_le_bytes([packet[at], packet[at + 1], packet[at + 2], packet[at + 3]])
}

/// Corrects a packet's checksum.
fn seal(packet: &mut [u8]) {
    if let Some((content, checksum)) = packet.split_last_chunk_mut::<CHECKSUM_BYTES>() {
        *checksum = CRC.checksum(content).to_le_bytes();
    }
}

/// The contribution of an untagged packet to its frame's digest.
fn contribution(packet: &[u8]) -> u32 {
    Packet::decode(packet).ok().and_then(|packet| packet.verify(&NoMac, 0)).unwrap_or(0)
}
