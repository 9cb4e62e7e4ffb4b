//! A modal frame as packets.

use super::{PacketWriter, begin_packet, capacity};
use crate::tree::SurfaceFacts;
use crate::wire::{
    Begin, Content, EncodeError, Encoding, FrameId, Freshness, HEADER_BYTES, MAX_WEIGHTS, Mac,
    NoMac, kind,
};

/// Splits the weights of one modal frame into packets of at most `MTU` bytes: begin, weights, commit.
///
/// ```
/// use dibs_nostd::wire::{FrameId, WeightsEncoder};
/// let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch: 1 };
/// let mut frame = WeightsEncoder::<64>::new(id, &[0.5; 16])?;
/// let mut buffer = [0; 64];
/// let mut packets = 0;
/// while frame.next_packet(&mut buffer).is_some() {
///     packets += 1;
/// }
/// assert_eq!(packets, 4); // begin, ten weights, six weights, commit
/// # Ok::<(), dibs_nostd::wire::EncodeError>(())
/// ```
#[derive(Debug)]
pub struct WeightsEncoder<'a, const MTU: usize, M = NoMac> {
    id: FrameId,
    weights: &'a [f32],
    freshness: Freshness,
    surface: SurfaceFacts,
    mac: M,
    /// Number of weights sent; `None` before the begin.
    sent: Option<u32>,
    is_done: bool,
    sequence: u16,
    digest: u32,
}

impl<'a, const MTU: usize> WeightsEncoder<'a, MTU> {
    /// A modal frame.
    ///
    /// # Errors
    /// [`EncodeError`]: the first weight that is not finite, or the number of weights if there are none or too many.
    pub fn new(id: FrameId, weights: &'a [f32]) -> Result<Self, EncodeError> {
        if weights.is_empty() || weights.len() > MAX_WEIGHTS as usize {
            return Err(EncodeError::Rows { rows: weights.len() });
        }
        match (0..).zip(weights).find(|(_, weight)| !weight.is_finite()) {
            Some((row, _)) => Err(EncodeError::NotFinite { row }),
            None => Ok(Self {
                id,
                weights,
                freshness: Freshness::default(),
                surface: SurfaceFacts::default(),
                mac: NoMac,
                sent: None,
                is_done: false,
                sequence: 0,
                digest: 0,
            }),
        }
    }

    /// The same frame, with a tag on every packet.
    #[must_use]
    pub fn with_mac<M: Mac>(self, mac: M) -> WeightsEncoder<'a, MTU, M> {
        let Self { id, weights, freshness, surface, sent, is_done, sequence, digest, .. } = self;
        WeightsEncoder { id, weights, freshness, surface, mac, sent, is_done, sequence, digest }
    }
}

impl<M: Mac, const MTU: usize> WeightsEncoder<'_, MTU, M> {
    const CAPACITY: u32 = capacity::<M>(MTU, HEADER_BYTES, 4);

    /// The same frame, with this freshness.
    #[must_use]
    pub fn with_freshness(self, freshness: Freshness) -> Self {
        Self { freshness, ..self }
    }

    /// The same frame, of this surface.
    #[must_use]
    pub fn with_surface(self, surface: SurfaceFacts) -> Self {
        Self { surface, ..self }
    }

    /// Writes the next packet to the buffer; `None` after the commit.
    pub fn next_packet<'b>(&mut self, buffer: &'b mut [u8; MTU]) -> Option<&'b [u8]> {
        if self.is_done {
            return None;
        }
        let Some(first) = self.sent else {
            let begin = Begin {
                session: self.id.session,
                content: Content::Modal,
                encoding: Encoding::Float,
                rows: self.weights.len() as u32,
                surface: self.surface,
                freshness: self.freshness,
                is_posed: false,
            };
            let packet = begin_packet::<M>(buffer, &self.id, &begin);
            let (packet, contribution) = packet.finish(&self.mac, self.id.session);
            self.digest = contribution;
            self.sent = Some(0);
            return Some(packet);
        };
        self.sequence = self.sequence.wrapping_add(1);
        let rest = self.weights.get(first as usize..).unwrap_or_default();
        let run = rest.get(..Self::CAPACITY as usize).unwrap_or(rest);
        if run.is_empty() {
            self.is_done = true;
            let (id, sequence) = (&self.id, self.sequence);
            let mut packet = PacketWriter::<M>::new(buffer, kind::COMMIT, id, sequence, 0, 0);
            packet.put(&self.digest.to_le_bytes());
            return Some(packet.finish(&self.mac, self.id.session).0);
        }
        let count = run.len() as u8;
        let mut packet =
            PacketWriter::<M>::new(buffer, kind::WEIGHTS, &self.id, self.sequence, count, first);
        for weight in run {
            packet.put(&weight.to_le_bytes());
        }
        let (packet, contribution) = packet.finish(&self.mac, self.id.session);
        self.digest = self.digest.wrapping_add(contribution);
        self.sent = Some(first + u32::from(count));
        Some(packet)
    }
}
