//! Bus reception: bytes in, published frames and statuses out.

use dibs_nostd::wire::{Counters, Deframer, encode_status, enframe, framed_bytes};
use dibs_nostd::{Advance, Millis, Progress, StretchError, SurfaceLimits};

use crate::BusStatus;
use crate::fingerprint::Fingerprint;
use crate::surface::{self, CENTRE, REACH};

/// Largest packet on the bus, in bytes: 167 quantised vertices.
pub const MTU: usize = 1024;

/// Largest status, in bytes: 13 counters, so that three statuses carry all.
pub const STATUS_MTU: usize = 96;

/// Largest status on a serial line.
pub const STATUS_FRAMED: usize = framed_bytes(STATUS_MTU);

/// Time between two statuses to the sender, unless a frame was published or refused before.
const REPORT_INTERVAL: Millis = Millis(100);

/// Limit on the coordinates, as a multiple of the rest shape's size.
const ROOM: f32 = 4.0;

/// Limit on a vertex's speed, in mm a millisecond: twice the generated heart's top speed in real time, 1.57 mm in a thirtieth
/// of a second. Over the emulated serial line it beats in slow motion, over Ethernet in real time.
const SPEED: f32 = 0.1;

/// Rows and triangles checked, or rows copied, in one slice.
const WORK: u32 = 32;

/// Rows of the published frame read through in one slice.
const ROWS: u32 = 32;

/// The receiving end of the bus.
///
/// Two contexts use it, one at a time. A serial line's interrupt calls [`byte`](Self::byte), which takes O(1), and
/// O(bytes) for the last byte of a packet; a network's driver calls [`packet`](Self::packet). The idle loop calls
/// [`work`](Self::work), which checks and publishes in slices, and [`report`](Self::report). Both are below the control
/// tick's priority.
pub struct Receiver {
    deframer: Deframer<MTU>,
    assembler: surface::continuous::Receiver<'static>,
    fingerprint: Fingerprint,
    status: &'static BusStatus,
    /// Time of the last status.
    reported: Millis,
    /// A frame was published or refused since.
    has_news: bool,
}

impl Receiver {
    /// A receiver that publishes surfaces of `tree` through `writer`.
    ///
    /// # Errors
    /// [`StretchError`] when the tree lacks its metric.
    pub fn new(
        tree: &'static surface::Tree,
        writer: surface::continuous::Writer,
        status: &'static BusStatus,
    ) -> Result<Self, StretchError> {
        let reach = CENTRE.abs().max_element() + ROOM * REACH;
        let limits = SurfaceLimits::reach_mm(reach).speed(SPEED);
        Ok(Self {
            deframer: Deframer::new(),
            assembler: surface::continuous::receiver(tree, writer, limits)?,
            fingerprint: Fingerprint::new(),
            status,
            reported: Millis(0),
            has_news: false,
        })
    }

    /// Takes one byte. `now` is the time of the present control tick, from which a surface's age counts.
    pub fn byte(&mut self, byte: u8, now: Millis) {
        self.status.count_bytes(1);
        match self.deframer.push(byte) {
            None => return,
            // Rejections are counted by cause in the assembler.
            Some(Ok(packet)) => {
                let outcome = self.assembler.accept(packet, now);
                self.has_news |= outcome == Ok(Progress::Hello);
            }
            Some(Err(error)) => self.assembler.count_framing(&error),
        }
        self.share();
    }

    /// Takes one packet, from a bus that keeps packets apart. Returns whether it was a good one of this surface.
    pub fn packet(&mut self, packet: &[u8], now: Millis) -> bool {
        self.status.count_bytes(u32::try_from(packet.len()).unwrap_or(u32::MAX));
        let outcome = self.assembler.accept(packet, now);
        self.has_news |= outcome == Ok(Progress::Hello);
        self.share();
        outcome.is_ok()
    }

    /// Tells the control tick.
    fn share(&self) {
        self.status.link.set(&self.assembler.health());
        self.status.set(self.assembler.counters());
    }

    /// Does one slice of checking, copying and publishing. Returns whether more work is due at once.
    // Not inlined: in a large loop its branches would become jumps through a register, whose targets the binary check
    // cannot see.
    #[inline(never)]
    pub fn work(&mut self) -> bool {
        let outcome = self.assembler.advance(WORK);
        self.status.link.set(&self.assembler.health());
        match outcome {
            Ok(Advance::Pending) => return true,
            Ok(Advance::Published { epoch }) => self.fingerprint.begin(epoch),
            // The published frame is read in full while the next one arrives.
            Ok(_) => {
                if let Some(surface) = self.assembler.surface() {
                    self.fingerprint.step(&surface, ROWS, self.status);
                }
                return false;
            }
            Err(_) => (),
        }
        self.has_news = true;
        self.status.set(self.assembler.counters());
        false
    }

    /// Registers the surface anew: the next whole frame may be anywhere within reach. Only an operator decides that.
    pub const fn register(&mut self) {
        self.assembler.register();
    }

    /// The events on the bus since the start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.assembler.counters()
    }

    const fn mesh_id(&self) -> u32 {
        self.assembler.gate().tree().mesh_id()
    }

    /// The status for the sender, of at most `N` bytes; `None` unless due. `now` is the time of the present control tick.
    pub fn status<'b, const N: usize>(
        &mut self,
        now: Millis,
        packet: &'b mut [u8; N],
    ) -> Option<&'b [u8]> {
        if !self.has_news && now.since(self.reported) < REPORT_INTERVAL {
            return None;
        }
        (self.reported, self.has_news) = (now, false);
        let status = self.assembler.status(now, self.status.safety());
        let (counters, mac) = (self.assembler.counters(), self.assembler.mac());
        Some(encode_status(self.mesh_id(), &status, counters, mac, packet))
    }

    /// The same, framed for a serial line.
    pub fn report<'b>(
        &mut self,
        now: Millis,
        line: &'b mut [u8; STATUS_FRAMED],
    ) -> Option<&'b [u8]> {
        let mut packet = [0; STATUS_MTU];
        enframe(self.status(now, &mut packet)?, line)
    }
}
