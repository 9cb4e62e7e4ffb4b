//! One fault at a time, followed by undisturbed frames until recovery.

use std::mem::take;
use std::path::Path;

use anyhow::{Result, ensure};
use dibs_nostd::Frames;
use dibs_nostd::guard::{Poses, SharedState};
use dibs_nostd::wire::{Event, Mac, NoMac};
use dibs_stream::faults::{Fault, Injector};
use fastrand::Rng;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::board::Board;
use super::row::Row;
use super::subject::{
    Case, Controller, Log, N, Receiver, Source, TREE, framed, mac_under, noticed, source,
};

/// Number of faults for one pair of sender and receiver.
const CHUNK: u64 = 500;

/// Ways of sending: floats or quantised, whole or partial frames, with tags or without, with poses or without.
const WAYS: u64 = 16;

/// Undisturbed frames after which a receiver that publishes nothing has failed.
const PATIENCE: u32 = 20;

/// Where the receivers run.
#[derive(Clone, Copy)]
pub enum Machine<'p> {
    /// In this process.
    Here,
    /// On the emulated board, in this program.
    Board(&'p Path),
}

impl Machine<'_> {
    /// Starts a receiver, and calls `work` with it.
    fn with<M: Mac>(self, mac: M, work: impl FnOnce(&mut dyn Receiver)) {
        match self {
            Self::Here => {
                let (frames, poses) = (Frames::<N, 3>::new(), Poses::NEW);
                let tree = TREE.tree::<u16>().expect("16-bit indices");
                work(&mut Controller::new(&frames, &poses, &tree, mac));
            }
            Self::Board(program) => work(&mut Board::boot(program, &mac).expect("a board")),
        }
    }
}

/// Runs all kinds of faults.
pub fn run(per_fault: u64, seed: u64, place: Machine<'_>) -> Result<Vec<Row>> {
    // Covers every way to send, even with few faults.
    let of_one = match place {
        Machine::Here => CHUNK.min(per_fault.div_ceil(WAYS)),
        Machine::Board(_) => per_fault.div_ceil(WAYS),
    };
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} faults  {msg}")?;
    let bar = ProgressBar::new(per_fault * Fault::ALL.len() as u64).with_style(style);
    let rows = Fault::ALL
        .into_iter()
        .map(|fault| {
            bar.set_message(fault.name());
            let chunks = per_fault.div_ceil(of_one);
            let total = (0..chunks)
                .into_par_iter()
                .map(|chunk| {
                    let count = of_one.min(per_fault - chunk * of_one);
                    let row = life(fault, count, chunk, seed, place);
                    bar.inc(count);
                    row
                })
                .reduce(Row::default, Row::plus);
            total.finished(fault)
        })
        .collect::<Vec<_>>();
    bar.finish_and_clear();
    ensure!(rows.iter().all(|row| row.injected == per_fault), "a fault found no packet");
    Ok(rows)
}

/// Some faults of one kind, with each way of sending in turn.
fn life(fault: Fault, count: u64, chunk: u64, seed: u64, place: Machine<'_>) -> Row {
    let case = Case {
        quantised: chunk & 1 == 0,
        partial: chunk & 2 == 0,
        posed: chunk & 8 != 0 || fault == Fault::Pose,
    };
    // Tags would reveal sealed faults before the layers that they are meant for. So tags are only used for forgeries,
    // and in every second run of faults that are not sealed.
    let is_sealed = matches!(
        fault,
        Fault::StaleEpoch
            | Fault::WrongMesh
            | Fault::OutOfRange
            | Fault::NotFinite
            | Fault::TooFar
            | Fault::Stretch
            | Fault::Pose
    );
    let seed = seed ^ (chunk << 8 | fault as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    if fault == Fault::Forgery || (!is_sealed && chunk & 4 != 0) {
        Life::run(fault, count, case, seed, mac_under, place)
    } else {
        Life::run(fault, count, case, seed, |_| NoMac, place)
    }
}

/// One sender, and its receivers.
struct Life<'p, M> {
    place: Machine<'p>,
    source: Source<M>,
    keyed_mac: fn(u64) -> M,
    log: Log,
    injector: Injector,
    rng: Rng,
    case: Case,
    session: u32,
    moment: u32,
    is_stream: bool,
    row: Row,
}

impl<'p, M: Mac + 'static> Life<'p, M> {
    fn run(
        fault: Fault,
        count: u64,
        case: Case,
        seed: u64,
        keyed_mac: fn(u64) -> M,
        place: Machine<'p>,
    ) -> Row {
        let mut rng = Rng::with_seed(seed);
        // Sessions wrap.
        let session = u32::MAX - rng.u32(..20);
        let mut life = Self {
            place,
            source: source(case, session, keyed_mac),
            keyed_mac,
            log: Log::default(),
            injector: Injector::new(seed),
            is_stream: rng.bool() || matches!(place, Machine::Board(_)),
            rng,
            case,
            session,
            moment: 0,
            row: Row { injected: count, ..Row::default() },
        };
        if fault == Fault::ReceiverRestart {
            for _ in 0..count {
                life.restart_of_receiver();
            }
            return life.row;
        }
        place.with(life.any_mac(), |controller| {
            life.recover(controller);
            for _ in 0..count {
                if fault == Fault::SenderRestart {
                    life.restart_of_sender(controller);
                } else {
                    life.disturb(fault, controller);
                }
            }
            life.take_counters(controller);
        });
        life.row
    }

    /// A challenge as a receiver would choose it at its start.
    fn any_mac(&mut self) -> M {
        (self.keyed_mac)(if M::TAGGED { u64::from(self.rng.u32(..)) } else { 0 })
    }

    fn next_frame(&mut self, controller: &mut dyn Receiver) -> Vec<Vec<u8>> {
        // A hello is answered at once.
        for _ in 0..3 {
            self.source.transport().inbox.push_back(controller.status());
            self.source.poll().expect("a mailbox does not fail");
            let hellos = take(&mut self.source.transport().sent);
            if hellos.is_empty() {
                break;
            }
            for packet in hellos {
                self.deliver(&packet, controller);
            }
        }
        self.moment += 1;
        let frame = self.case.prepare(&mut self.source, self.moment);
        self.log.note(&self.source, self.case, self.moment);
        self.source.transmit(frame).expect("a mailbox does not fail");
        take(&mut self.source.transport().sent)
    }

    fn deliver(&self, packet: &[u8], controller: &mut dyn Receiver) {
        if self.is_stream {
            controller.bytes(&framed(packet), &self.log);
        } else {
            controller.message(packet, &self.log);
        }
    }

    /// One fault, and the frames that it takes to recover.
    fn disturb(&mut self, fault: Fault, controller: &mut dyn Receiver) {
        let mut since = None;
        let (mut before, mut published) = (Vec::new(), 0);
        while since.is_none() {
            (before, published) = (noticed(controller.counters()), controller.published());
            let packets = self.next_frame(controller);
            // Some faults apply only to the begin packet.
            let first = if self.rng.bool() { 0 } else { self.rng.usize(..packets.len()) };
            for (place, packet) in packets.iter().enumerate() {
                let is_due = since.is_none() && place >= first;
                let faulty = if is_due && fault.is_damage() && self.is_stream {
                    let mut line = framed(packet);
                    self.injector.damage(fault, &mut line);
                    self.injector.pass(packet);
                    controller.bytes(&line, &self.log);
                    since = Some(0);
                    continue;
                } else if is_due {
                    self.injector.inject(fault, packet)
                } else {
                    None
                };
                since = since.map(|n| n + 1);
                let arriving = match faulty {
                    Some(packets) => {
                        since = Some(0);
                        packets
                    }
                    None => self.injector.pass(packet),
                };
                for packet in arriving {
                    self.deliver(&packet, controller);
                }
            }
            if since.is_none() {
                assert!(controller.published() > published, "an undisturbed frame is published");
            }
        }
        let is_published = controller.published() > published;
        let is_noticed = noticed(controller.counters()) != before || !is_published;
        self.judge(is_noticed, is_published, since.unwrap_or(0), controller);
    }

    /// Restarts the sender in the middle of a frame.
    fn restart_of_sender(&mut self, controller: &mut dyn Receiver) {
        let before = noticed(controller.counters());
        let packets = self.next_frame(controller);
        let cut = self.rng.usize(1..packets.len());
        for packet in &packets[..cut] {
            self.deliver(packet, controller);
        }
        self.log.forget_last();
        self.session = self.session.wrapping_add(1);
        self.source = source(self.case, self.session, self.keyed_mac);
        let (published, packets) = (controller.published(), self.next_frame(controller));
        for packet in &packets {
            self.deliver(packet, controller);
        }
        let is_noticed = noticed(controller.counters()) != before;
        let is_published = controller.published() > published;
        self.judge(is_noticed, is_published, packets.len() as u32, controller);
    }

    /// Restarts the receiver in the middle of a frame.
    fn restart_of_receiver(&mut self) {
        let (place, mut missed) = (self.place, Vec::new());
        place.with(self.any_mac(), |controller| {
            self.recover(controller);
            let mut packets = self.next_frame(controller);
            missed = packets.split_off(self.rng.usize(1..packets.len()));
            for packet in &packets {
                self.deliver(packet, controller);
            }
            self.row.published_wrong += controller.wrong();
        });
        place.with(self.any_mac(), |controller| {
            for packet in &missed {
                self.deliver(packet, controller);
            }
            let is_published = controller.published() > 0;
            let is_noticed = noticed(controller.counters()).iter().any(|&n| n > 0) || !is_published;
            self.judge(is_noticed, is_published, missed.len() as u32, controller);
            self.take_counters(controller);
        });
    }

    fn judge(
        &mut self,
        is_noticed: bool,
        is_published: bool,
        packets: u32,
        controller: &mut dyn Receiver,
    ) {
        self.row.detected += u64::from(is_noticed);
        self.row.harmless += u64::from(!is_noticed && is_published);
        let (frames, more) = if is_published { (0, 0) } else { self.recover(controller) };
        let packets = packets + more;
        self.row.sums[0] += u64::from(frames);
        self.row.sums[1] += u64::from(packets);
        self.row.recovered_frames_max = self.row.recovered_frames_max.max(frames);
        self.row.recovered_packets_max = self.row.recovered_packets_max.max(packets);
    }

    /// Sends undisturbed frames until one is published. Returns the numbers of frames and packets.
    fn recover(&mut self, controller: &mut dyn Receiver) -> (u32, u32) {
        let published = controller.published();
        let mut packets = 0;
        for frames in 1..=PATIENCE {
            for packet in self.next_frame(controller) {
                for packet in self.injector.pass(&packet) {
                    self.deliver(&packet, controller);
                }
                packets += 1;
            }
            if controller.published() > published {
                return (frames, packets);
            }
        }
        self.row.not_recovered += 1;
        (PATIENCE, packets)
    }

    fn take_counters(&mut self, controller: &dyn Receiver) {
        self.row.published_wrong += controller.wrong();
        for event in Event::ALL {
            let n = u64::from(controller.counters().of(event));
            if n > 0 && !matches!(event, Event::Published | Event::Heartbeat) {
                *self.row.rejected.entry(event.name()).or_default() += n;
            }
        }
    }
}
