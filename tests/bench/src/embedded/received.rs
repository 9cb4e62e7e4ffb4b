//! Frames as packets, which each method receives in its own time.

use dibs_nostd::nodes::Nodes;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, QuantisedBox};
use dibs_nostd::{
    Advance, Assembler, Buffer, Buffers, FrameReader, Head, Millis, NoAdmissionCheck, Position,
    VertexTable,
};
use glam::Vec3;

use super::super::imaging::controller::{Controller, Tick, Times};

/// Bytes of a packet's rows, as on Ethernet.
const PACKET: usize = 1_400;
/// Farther than any node (mm).
const REACH: f32 = 1_000.0;
/// Time between two frames on the receiver's clock (ms).
const INTERVAL: u32 = 10;

/// A line on which frames of nodes come, quantised in a box around each frame.
pub struct Line {
    mesh_id: u32,
    epoch: u32,
    waiting: Vec<Vec<u8>>,
    assembler: Assembler<'static, NoAdmissionCheck>,
    reader: FrameReader<'static>,
}

impl Line {
    /// Its buffers are kept until the program ends.
    pub fn new(nodes: &Nodes<'_>) -> Self {
        let buffer = || Buffer {
            head: Box::leak(Box::new(Head::new())),
            rows: Box::leak((0..nodes.count()).map(|_| Position::new()).collect()),
        };
        let state = Box::leak(Box::default());
        let (writer, reader) = Buffers::new(state, [buffer(), buffer()], None).ends();
        let mesh_id = nodes.mesh_id();
        let assembler = Assembler::new(writer, NoAdmissionCheck, mesh_id, REACH);
        Self { mesh_id, epoch: 0, waiting: Vec::new(), assembler, reader }
    }

    /// Cuts a frame into packets, and returns their bytes.
    pub fn send(&mut self, frame: &[Vec3]) -> usize {
        self.epoch += 1;
        let id = FrameId { mesh_id: self.mesh_id, session: 1, epoch: self.epoch };
        let grid = QuantisedBox::covering(frame).expect("finite nodes");
        let encoder = FrameEncoder::<_, PACKET>::new(id, Encoding::Quantised(grid), frame);
        self.waiting = dibs_tests::bus::collect(encoder.expect("nodes for a frame"));
        self.waiting.iter().map(Vec::len).sum()
    }

    /// Checks, decodes and publishes what was sent last. The check of the elements is each method's own.
    pub fn receive(&mut self) {
        for packet in &self.waiting {
            self.assembler.accept(packet, Millis(INTERVAL * self.epoch)).expect("a good packet");
        }
        let advance = self.assembler.advance(u32::MAX).expect("a good frame");
        assert!(matches!(advance, Advance::Published { .. }), "{advance:?}");
    }
}

/// A method behind a line.
pub struct Received<C> {
    method: C,
    line: Line,
    nodes: Vec<Vec3>,
    is_waiting: bool,
}

impl<C: Controller> Received<C> {
    pub fn new(method: C, nodes: &Nodes<'_>) -> Self {
        Self { method, line: Line::new(nodes), nodes: Vec::new(), is_waiting: false }
    }

    /// Hands the published frame to the method.
    fn hand_over(&mut self) {
        let frame = self.line.reader.read().expect("published");
        self.nodes.clear();
        self.nodes.extend((0..frame.len() as u32).filter_map(|row| frame.position(row)));
        self.method.receive(&self.nodes);
        self.is_waiting = false;
    }
}

impl<C: Controller> Controller for Received<C> {
    /// Sends the frame.
    fn receive(&mut self, frame: &[Vec3]) {
        if self.is_waiting {
            self.line.receive();
            self.hand_over();
        }
        self.line.send(frame);
        self.is_waiting = true;
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| self.line.receive());
        self.hand_over();
        self.method.run(ticks, times);
    }
}
