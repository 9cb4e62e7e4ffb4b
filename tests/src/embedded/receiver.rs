//! A receiver of frames of nodes, with buffers of any size.

use std::sync::atomic::AtomicU32;

use dibs_nostd::nodes::{NodeMonitor, Nodes};
use dibs_nostd::wire::{FrameEncoder, FrameId};
use dibs_nostd::{
    Advance, Assembler, Buffer, Buffers, FrameReader, Head, Millis, Position, ReceiveError,
    SurfaceLimits, VertexTable,
};
use fastrand::Rng;
use glam::Vec3;

use crate::bus::{collect, encoding};

/// The buffers of a receiver.
pub struct Memory {
    state: AtomicU32,
    heads: [Head; 2],
    rows: [Vec<Position>; 2],
}

impl Memory {
    /// For the nodes of a surface.
    pub fn new(nodes: &Nodes<'_>) -> Self {
        let rows = || (0..nodes.count()).map(|_| Position::new()).collect();
        Self { state: AtomicU32::new(0), heads: [const { Head::new() }; 2], rows: [rows(), rows()] }
    }
}

/// The end of a bus at which frames of nodes arrive: checked in slices, and published.
pub struct Receiver<'m> {
    assembler: Assembler<'m, NodeMonitor<'m>>,
    reader: FrameReader<'m>,
    mesh_id: u32,
    epoch: u32,
}

impl<'m> Receiver<'m> {
    /// Without limits on speed and size.
    pub fn new(memory: &'m Memory, nodes: &Nodes<'m>) -> Self {
        let [first, second] = &memory.rows;
        let buffer = |at: usize, rows: &'m [Position]| Buffer { head: &memory.heads[at], rows };
        let both = [buffer(0, first), buffer(1, second)];
        let (writer, reader) = Buffers::new(&memory.state, both, None).ends();
        let limits = SurfaceLimits::reach_mm(5_000.0).recovery_mm(f32::INFINITY).shrinkage(0.0);
        let admission_check = NodeMonitor::new(nodes).limits(limits);
        let mesh_id = nodes.mesh_id();
        let assembler = Assembler::new(writer, admission_check, mesh_id, 5_000.0);
        Self { assembler, reader, mesh_id, epoch: 0 }
    }

    /// Sends a frame, quantised or in floats. Returns the nodes that the receiver then has, and their stretch.
    ///
    /// # Errors
    /// Why the receiver refuses it.
    pub fn receive(
        &mut self,
        frame: &[Vec3],
        rng: &mut Rng,
    ) -> Result<(Vec<Vec3>, f32), ReceiveError> {
        self.epoch += 1;
        let id = FrameId { mesh_id: self.mesh_id, session: 1, epoch: self.epoch };
        let encoding = encoding(rng.u8(..4) > 0, frame);
        let sender = FrameEncoder::<_, 1_024>::new(id, encoding, frame).expect("valid");
        let work = rng.u32(20..200);
        for packet in collect(sender) {
            let _ = self.assembler.accept(&packet, Millis(40 * self.epoch))?;
            self.assembler.advance(work)?;
        }
        while self.assembler.published().is_none_or(|published| published.epoch != self.epoch) {
            let advanced = self.assembler.advance(work)?;
            assert!(advanced != Advance::Idle, "neither published nor refused");
        }
        let published = self.reader.read().expect("published");
        let sigma = published.label().stretch.expect("measured").sigma();
        let rows = (0..frame.len() as u32).filter_map(|row| published.position(row)).collect();
        Ok((rows, sigma))
    }
}
