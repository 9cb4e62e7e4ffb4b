//! The fault matrix on the emulated board, every byte through its UART.

// Requirement: B-01

use anyhow::Result;
use xtask::steps::Outcome;

use super::host_faults::tell;
use crate::faults::{Machine, Record};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FAULTS, note};
use crate::harness::{Check, Effort};
use crate::probe::{board, build_for_board};

pub const CHECK: Check = Check {
    name: "faults on the board",
    run: check,
    promises: &[
        note("board.faults.kinds"),
        note("board.faults.injected"),
        Promise {
            id: "board.faults.wrong",
            says: "Of the faults of the matrix, sent to the board through its UART, none is published",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {board.faults.injected} faults of {board.faults.kinds} kinds",
            limits: "Each published frame held as a whole, by a CRC-32 made on the board, against what was sent. The UART \
         is polled; the demo takes it by interrupt.",
        },
        Promise {
            id: "board.faults.not-recovered",
            says: "After each of them the board publishes again",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "did not; {board.faults.recovered-within} undisturbed frames at most until it did",
            limits: "",
        },
        note("board.faults.recovered-within"),
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "bus")?;
    let record = Record::measure(
        effort.board_faults,
        Machine::Board(&program),
        effort.is_record,
        effort.size(),
    )?;
    tell(&record, "board.faults", "faults-board.json", effort, figures)
}
