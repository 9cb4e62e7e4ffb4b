//! A line with faults.

use std::io;

use dibs_nostd::wire::{enframe, framed_bytes};
use fastrand::Rng;

use super::{Fault, Injector};
use crate::transport::{Line, Transport};

/// A line that injects faults.
#[derive(Debug)]
pub struct FaultyLine {
    line: Line,
    injector: Injector,
    rng: Rng,
    faults: Vec<Fault>,
    rate: f64,
    /// Count of each fault.
    counts: Vec<(Fault, u64)>,
    /// Set while the line is cut.
    is_cut: bool,
}

impl FaultyLine {
    /// A line that injects one of these faults into each packet with this probability. Restarts are not faults of a
    /// line and never happen.
    #[must_use]
    pub fn new(line: Line, seed: u64, faults: &[Fault], rate: f64) -> Self {
        let faults: Vec<Fault> = faults.iter().copied().filter(|f| !f.is_restart()).collect();
        Self {
            line,
            injector: Injector::new(seed),
            rng: Rng::with_seed(!seed),
            counts: faults.iter().map(|&fault| (fault, 0)).collect(),
            faults,
            rate,
            is_cut: false,
        }
    }

    /// Count of each fault.
    #[must_use]
    pub fn counts(&self) -> &[(Fault, u64)] {
        &self.counts
    }

    /// Sets the probability of a fault in a packet.
    pub fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
    }

    /// Cuts the line, or reconnects it.
    pub fn cut(&mut self, is_cut: bool) {
        self.is_cut = is_cut;
    }

    fn fault(&mut self) -> Option<Fault> {
        (self.rng.f64() < self.rate).then(|| self.rng.choice(self.faults.iter().copied()))?
    }

    fn count(&mut self, happened: Fault) {
        for (fault, count) in &mut self.counts {
            *count += u64::from(*fault == happened);
        }
    }
}

impl Transport for FaultyLine {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        if self.is_cut {
            return Ok(());
        }
        let fault = self.fault();
        if let Some(fault) = fault
            && fault.is_damage()
            && self.line.is_stream()
        {
            self.count(fault);
            let mut framed = vec![0; framed_bytes(packet.len())];
            let bytes = enframe(packet, &mut framed).map_or(0, <[u8]>::len);
            framed.truncate(bytes);
            self.injector.damage(fault, &mut framed);
            return self.line.send_raw(&framed);
        }
        let packets =
            match fault.and_then(|fault| Some((fault, self.injector.inject(fault, packet)?))) {
                Some((fault, packets)) => {
                    self.count(fault);
                    packets
                }
                None => self.injector.pass(packet),
            };
        packets.iter().try_for_each(|packet| self.line.send(packet))
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        self.line.receive()
    }
}
