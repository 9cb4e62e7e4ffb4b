//! Bus reception: bytes in, published frames out.

use dibs_nostd::wire::{Deframer, Event};
use dibs_nostd::{Assembler, FrameWriter};

use crate::BusStatus;
use crate::surface::{SURFACE, SURFACE_CENTER, SURFACE_REACH, SURFACE_VERTICES, SurfaceAssembler};

/// Largest packet on the serial bus, in bytes: 167 quantised vertices.
pub const MTU: usize = 1024;

/// No vertex may be farther out on any axis than this many times the size of the rest shape.
const ROOM: f32 = 4.0;

/// The receiving end of the serial bus.
///
/// Cost of a byte: O(1), except the last of a packet, which pays for the packet's vertices, and the
/// last of a frame, which pays for the stretch check of the whole surface. All of it happens below
/// the control tick's priority.
pub struct Receiver {
    deframer: Deframer<MTU>,
    assembler: SurfaceAssembler,
    status: &'static BusStatus,
    packets: u32,
    damaged: u32,
}

impl Receiver {
    /// A receiver that publishes through `writer`.
    #[must_use]
    pub fn new(writer: FrameWriter<'static, SURFACE_VERTICES>, status: &'static BusStatus) -> Self {
        let limit = SURFACE_CENTER.abs().max_element() + ROOM * SURFACE_REACH;
        let assembler = Assembler::new(writer, &SURFACE, SURFACE.mesh_id(), limit);
        Self { deframer: Deframer::new(), assembler, status, packets: 0, damaged: 0 }
    }

    /// Takes one byte. `tick` is the present control tick: the age of a surface counts from it.
    pub fn byte(&mut self, byte: u8, tick: u32) {
        match self.deframer.push(byte) {
            None => return,
            // Rejections are counted by cause in the assembler.
            Some(Ok(packet)) => {
                self.status.link.note(&self.assembler.accept(packet, tick), tick);
                self.status.link.note_check(&self.assembler.advance(u32::MAX));
            }
            Some(Err(_)) => {
                self.damaged = self.damaged.saturating_add(1);
                self.status.link.damaged();
            }
        }
        self.packets = self.packets.wrapping_add(1);
        let counters = self.assembler.counters();
        let rejected = counters.rejected().saturating_add(self.damaged);
        self.status.set(self.packets, counters.of(Event::Published), rejected);
    }
}
