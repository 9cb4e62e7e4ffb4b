//! A controller's loop on the board in which a volume's nodes move a surface of 50,000 triangles: the same bits as on
//! the host, memory, and the instructions of a tick, of an element's check and of a vertex.

// Requirements: F-07, F-09

use anyhow::{Context, Result, anyhow, ensure};
use dibs_build::{Builder, BuiltTree, IndexWidth, Motion, Volume, generate};
use dibs_nostd::Tool;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, QuantisedBox};
use dibs_tests::bus::collect;
use dibs_tests::method::Probe;
use dibs_tests::streams::{Beat, Pulse};
use glam::{DVec3, Vec3};
use probe::nodes::{
    ANSWER_WORDS, FRAME_WORDS, HEAD_WORDS, HEART, Memory, NODES, OPENED, TREE_BYTES, command, run,
};
use probe::{Fault, Machine};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{RESOURCES, TIMING},
    golden, note,
};
use crate::harness::{Check, Effort};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

pub const CHECK: Check = Check {
    name: "an organ that nodes carry on the board",
    run: check,
    promises: &[
        Promise {
            id: "m7.nodes.tick",
            says: "The mean tick of a guard on a surface of 50,000 triangles that 720 nodes carry, with the side, and any depth where \
                   the axis crosses",
            criterion: TIMING,
            bound: Bound::AtMost(25_000.0),
            unit: "instructions; 99 % below {m7.nodes.tick.99}, at most {m7.nodes.tick.largest}; {m7.nodes.node-tests} node \
                   and {m7.nodes.triangle-tests} triangle tests",
            limits: "The generated brain with pulsing waves in a lattice, frames at 30 Hz, extrapolated; a capsule on table \
                     3's path, {m7.nodes.ticks} ticks in a row after the first second. Emulated Cortex-M7; instructions, not \
                     cycles.",
        },
        note("m7.nodes.tick.99"),
        golden("m7.nodes.tick.largest"),
        note("m7.nodes.node-tests"),
        note("m7.nodes.triangle-tests"),
        note("m7.nodes.ticks"),
        Promise {
            id: "m7.nodes.ram",
            says: "RAM of that loop's objects: three frames, bus and guard",
            criterion: RESOURCES,
            bound: Bound::AtMost(384.0 * 1_024.0 - 65_536.0),
            unit: "bytes",
            limits: "64 KB beside it, of 384, are left for a stack. {m7.nodes.places} opened nodes.",
        },
        note("m7.nodes.places"),
        Promise {
            id: "m7.nodes.flash",
            says: "Flash of that tree, its nodes included",
            criterion: RESOURCES,
            bound: Bound::AtMost(24.0),
            unit: "bytes a triangle",
            limits: "With adjacency for the side.",
        },
        Promise {
            id: "m7.nodes.element.quantised",
            says: "The check of a tetrahedron",
            criterion: TIMING,
            bound: Bound::AtMost(240.0),
            unit: "instructions of quantised nodes, {m7.nodes.element} of floats; a frame's whole check, with the end of its \
                   extrapolation, {m7.nodes.frame} a tetrahedron",
            limits: "All {m7.nodes.elements} of them at once.",
        },
        golden("m7.nodes.element"),
        golden("m7.nodes.frame"),
        note("m7.nodes.elements"),
        Promise {
            id: "m7.nodes.vertex",
            says: "A vertex read, of a frame that is held",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; {m7.nodes.vertex.between} between frames",
            limits: "All vertices in a row, added up. The goal was 65 and 115: docs/decisions.md says what was tried.",
        },
        golden("m7.nodes.vertex.between"),
        Promise {
            id: "m7.nodes.bits",
            says: "Answers of that loop whose bits are others than on this computer",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "words",
            limits: "Stretch, vertices, pairs, sides, tests and velocities.",
        },
    ],
};

/// Duration of the run in ms, and of its start, which is not counted.
const TICKS: u32 = 4_000;
const START: u32 = 1_200;

/// Time between two frames, in ms.
const PERIOD: u32 = 33;

/// The script as words, each with whether it has an answer.
fn script(built: &BuiltTree, volume: &Volume, rest: &[Vec3]) -> Result<Vec<u8>> {
    let nodes: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
    let pulse = Pulse::new(&nodes, 41);
    let motion =
        Motion { frames: vec![rest.to_vec()], rate: 25.0, origin: DVec3::ZERO, faces: Vec::new() };
    let beat = Beat::new(&motion);
    let mut bytes = Vec::new();
    let put = |bytes: &mut Vec<u8>, words: &[u32]| {
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    let pad = |bytes: &mut Vec<u8>| bytes.resize(bytes.len().next_multiple_of(4), 0);
    put(&mut bytes, &[built.blob().len() as u32]);
    bytes.extend(built.blob());
    pad(&mut bytes);
    let mut frame = Vec::new();
    for tick in 0..TICKS {
        if tick % PERIOD == 0 {
            pulse.deform(tick as f32 * 1e-3, &mut frame);
            let id = FrameId { mesh_id: built.summary().mesh_id, session: 1, epoch: tick + 1 };
            let grid = QuantisedBox::covering(&frame).context("finite nodes")?;
            let sender =
                FrameEncoder::<_, 1_024>::new(id, Encoding::Quantised(grid), frame.as_slice())?;
            for packet in collect(sender) {
                put(&mut bytes, &[command::PACKET, tick, packet.len() as u32]);
                bytes.extend(packet);
                pad(&mut bytes);
            }
            put(&mut bytes, &[command::WORK]);
        }
        let Probe::Capsule(tool) = beat.tool(tick) else { anyhow::bail!("no capsule") };
        put(&mut bytes, &[command::TICK, tick]);
        let ends = [tool.start(), tool.end()].map(|end| end.to_array().map(f32::to_bits));
        put(&mut bytes, ends.as_flattened());
        put(&mut bytes, &[Tool::radius(&tool).to_bits()]);
    }
    put(&mut bytes, &[command::END]);
    Ok(bytes)
}

/// The host, without a clock.
struct Host<'s> {
    script: &'s [u8],
    answers: Vec<u8>,
}

impl Machine for Host<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<(), Fault> {
        let (read, rest) = self.script.split_at_checked(buffer.len()).ok_or(Fault)?;
        buffer.copy_from_slice(read);
        self.script = rest;
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        self.answers.extend(bytes);
        Ok(())
    }

    fn clock(&self) -> u32 {
        0
    }
}

/// The answers of a script: its head, its frames, and its ticks.
struct Answers {
    head: [u32; HEAD_WORDS],
    frames: Vec<[u32; FRAME_WORDS]>,
    ticks: Vec<[u32; ANSWER_WORDS]>,
}

impl Answers {
    fn of(words: &[u32]) -> Result<Self> {
        let short = || anyhow!("not every question is answered");
        let (&head, mut rest) = words.split_first_chunk().ok_or_else(short)?;
        let (mut frames, mut ticks) = (Vec::new(), Vec::new());
        for tick in 0..TICKS {
            if tick % PERIOD == 0 {
                let (&frame, after) = rest.split_first_chunk().ok_or_else(short)?;
                frames.push(frame);
                rest = after;
            }
            let (&answer, after) = rest.split_first_chunk().ok_or_else(short)?;
            ticks.push(answer);
            rest = after;
        }
        ensure!(rest.is_empty(), "more answers than questions");
        Ok(Self { head, frames, ticks })
    }

    /// The words that must be the same on every machine.
    fn bits(&self) -> impl Iterator<Item = u32> {
        let head = self.head[5..].iter();
        let frames = self.frames.iter().flat_map(|frame| &frame[1..]);
        head.chain(frames).chain(self.ticks.iter().flat_map(|tick| &tick[1..])).copied()
    }
}

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let mesh = generate::brain(50_000)?;
    let volume = Volume::lattice(&mesh, [9, 8, 7])?;
    ensure!(volume.nodes().len() == NODES, "{} nodes", volume.nodes().len());
    let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5).with_rest_shape(false);
    let built = builder.nodes(&volume).build(&mesh)?;
    let script = script(&built, &volume, &mesh.positions)?;
    let program = build_for_board(&board()?, "nodes")?;
    let answers = Answers::of(&run_on_board(&program, &script, COUNTING)?)?;
    let mut host = Host { script: &script, answers: Vec::new() };
    let (tree, memory) = (Box::leak(Box::new([0; TREE_BYTES])), &mut Box::new(Memory::new()));
    run(tree, &HEART, memory, &mut host).map_err(|_| anyhow!("no answer on this computer"))?;
    let words: Vec<u32> =
        host.answers.as_chunks().0.iter().copied().map(u32::from_le_bytes).collect();
    let ours = Answers::of(&words)?;
    let others = answers.bits().zip(ours.bits()).filter(|(board, host)| board != host).count();
    figures.note("m7.nodes.bits", others as f64);
    ensure!(answers.frames.iter().all(|frame| frame[1] == 1), "a frame was refused");

    // The board's clock counts 1.6 for each instruction.
    let instructions = |clock: u32| f64::from(clock) * 0.625;
    let elements = volume.tetrahedra().len() as f64;
    let vertices = mesh.positions.len() as f64;
    let [ram, floats, quantised, held, between, ..] = answers.head;
    let each = |clock: u32, count: f64| (instructions(clock) / count * 10.0).round() / 10.0;
    figures.note("m7.nodes.ram", f64::from(ram));
    figures.note("m7.nodes.places", OPENED as f64);
    let flash = built.blob().len() as f64 / mesh.triangles.len() as f64;
    figures.note("m7.nodes.flash", (flash * 100.0).round() / 100.0);
    figures.note("m7.nodes.elements", elements);
    figures.note("m7.nodes.element", each(floats, elements));
    figures.note("m7.nodes.element.quantised", each(quantised, elements));
    figures.note("m7.nodes.vertex", each(held, vertices));
    figures.note("m7.nodes.vertex.between", each(between, vertices));
    let checks: Vec<u32> = answers.frames[3..].iter().map(|frame| frame[0]).collect();
    let mean = checks.iter().map(|&clock| instructions(clock)).sum::<f64>() / checks.len() as f64;
    figures.note("m7.nodes.frame", (mean / elements).round());

    let ticks = &answers.ticks[START as usize..];
    let mut taken: Vec<u32> = ticks.iter().map(|tick| tick[0]).collect();
    taken.sort_unstable();
    let at = |part: f64| instructions(taken[((taken.len() - 1) as f64 * part) as usize]).round();
    let mean = |of: &dyn Fn(&[u32; ANSWER_WORDS]) -> f64| {
        ticks.iter().map(of).sum::<f64>() / ticks.len() as f64
    };
    figures.note("m7.nodes.tick", mean(&|tick| instructions(tick[0])).round());
    figures.note("m7.nodes.tick.99", at(0.99));
    figures.note("m7.nodes.tick.largest", at(1.0));
    figures.note("m7.nodes.node-tests", (mean(&|tick| tick[5].into()) * 10.0).round() / 10.0);
    figures.note("m7.nodes.triangle-tests", (mean(&|tick| tick[6].into()) * 10.0).round() / 10.0);
    figures.note("m7.nodes.ticks", ticks.len() as f64);
    Ok(Outcome::Passed)
}
