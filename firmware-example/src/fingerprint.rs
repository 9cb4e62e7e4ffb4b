//! A checksum of the whole published surface, to be compared with that of the sent one.

use dibs_nostd::VertexTable;
use dibs_nostd::format::CRC;
use dibs_nostd::glam::Vec3;

use crate::BusStatus;

/// Reads the published frame in slices.
pub struct Fingerprint {
    epoch: u32,
    digest: crc::Digest<'static, u32>,
    /// The next row; `None` once all rows have been read.
    next: Option<u32>,
}

impl Fingerprint {
    pub const fn new() -> Self {
        Self { epoch: 0, digest: CRC.digest(), next: None }
    }

    /// Starts with the latest published frame.
    pub fn begin(&mut self, epoch: u32) {
        *self = Self { epoch, digest: CRC.digest(), next: Some(0) };
    }

    /// Reads up to `rows` rows, and after the last row reports the checksum.
    pub fn step(&mut self, surface: &impl VertexTable, rows: u32, status: &BusStatus) {
        let Some(first) = self.next else { return };
        for row in first..first.saturating_add(rows) {
            let Some(position) = surface.position(row) else {
                let digest = core::mem::replace(&mut self.digest, CRC.digest());
                status.set_fingerprint(self.epoch, digest.finalize());
                self.next = None;
                return;
            };
            take(&mut self.digest, position);
        }
        self.next = Some(first.saturating_add(rows));
    }
}

fn take(digest: &mut crc::Digest<'_, u32>, position: Vec3) {
    for coordinate in position.to_array() {
        digest.update(&coordinate.to_bits().to_le_bytes());
    }
}

/// The expected [`BusStatus::fingerprint`] of a frame with these positions.
#[must_use]
pub fn fingerprint(positions: &[Vec3]) -> u32 {
    let mut digest = CRC.digest();
    for &position in positions {
        take(&mut digest, position);
    }
    digest.finalize()
}
