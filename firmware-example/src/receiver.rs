//! Bus reception: from bytes to published frames and statuses.

use dibs_nostd::wire::{Counters, framed_bytes};
use dibs_nostd::{Advance, Millis};

use crate::BusStatus;
use crate::fingerprint::Fingerprint;
use crate::surface;

/// Largest packet on the bus, in bytes: 167 quantised vertices.
pub const MTU: usize = 1024;

/// Largest status, in bytes.
pub const STATUS_MTU: usize = surface::Bus::STATUS_BYTES;

/// Largest status on a serial line.
pub const STATUS_FRAMED: usize = framed_bytes(STATUS_MTU);

/// Rows and triangles checked, or rows copied, in one slice.
const WORK: u32 = 32;

/// Rows of the published frame that are read in one slice.
const ROWS: u32 = 32;

/// The receiving end of the bus, with the data that the demo's records need.
///
/// Two contexts use it, one at a time. A serial line's interrupt calls [`bytes`](Self::bytes); a network's driver calls
/// [`packet`](Self::packet). The idle loop calls [`work`](Self::work), and [`report`](Self::report). Both are below the
/// control tick's priority.
pub struct Receiver {
    bus: surface::Bus,
    fingerprint: Fingerprint,
    status: &'static BusStatus,
}

impl Receiver {
    pub(crate) const fn new(bus: surface::Bus, status: &'static BusStatus) -> Self {
        Self { bus, fingerprint: Fingerprint::new(), status }
    }

    /// Receives bytes of the serial line. `now` is the time of the present control tick, from which a surface's age is
    /// counted.
    pub fn bytes(&mut self, bytes: &[u8], now: Millis) {
        self.status.count_bytes(bytes.len());
        self.bus.receive(bytes, now);
        self.status.set(self.bus.counters());
    }

    /// Receives one packet, from a bus that preserves packet boundaries. Returns whether it was a good packet of this
    /// surface.
    pub fn packet(&mut self, packet: &[u8], now: Millis) -> bool {
        self.status.count_bytes(packet.len());
        let outcome = self.bus.packet(packet, now);
        self.status.set(self.bus.counters());
        outcome.is_ok()
    }

    /// Does one slice of checking, copying and publishing. Returns whether more work is due at once.
    // Not inlined: in a large loop its branches would become jumps through a register, whose targets the check of the
    // binary cannot determine.
    #[inline(never)]
    pub fn work(&mut self) -> bool {
        match self.bus.work(WORK) {
            Ok(Advance::Pending) => return true,
            Ok(Advance::Published { epoch }) => self.fingerprint.begin(epoch),
            // The published frame is read completely while the next one arrives.
            Ok(_) => {
                if let Some(surface) = self.bus.surface() {
                    self.fingerprint.step(&surface, ROWS, self.status);
                }
            }
            Err(_) => (),
        }
        self.status.set(self.bus.counters());
        false
    }

    /// Registers the surface again: the next whole frame may be anywhere within reach. Only an operator may decide
    /// this.
    pub const fn register(&mut self) {
        self.bus.register();
    }

    /// The events on the bus since the start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.bus.counters()
    }

    /// Completed rounds of the check of the tree in flash; wraps.
    #[must_use]
    pub const fn rounds(&self) -> u32 {
        self.bus.rounds()
    }

    /// The status for the sender; `None` unless one is due. `now` is the time of the present control tick.
    pub fn status<'b, const N: usize>(
        &mut self,
        now: Millis,
        packet: &'b mut [u8; N],
    ) -> Option<&'b [u8]> {
        self.bus.status(now, packet)
    }

    /// The same, framed for a serial line.
    pub fn report<'b>(
        &mut self,
        now: Millis,
        line: &'b mut [u8; STATUS_FRAMED],
    ) -> Option<&'b [u8]> {
        self.bus.status_framed(now, line)
    }
}
