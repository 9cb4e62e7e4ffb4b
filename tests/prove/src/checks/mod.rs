//! Each file has one check with its promises. A new check is a new file, and a line here.

// Requirement: E-03

mod anytime;
pub mod bits;
mod board_faults;
pub mod boards;
mod bound;
mod bounded;
mod carried;
mod corruption;
pub mod cost;
mod dearer;
mod demo;
mod demo_c;
mod demo_faults;
mod demo_hand;
mod demo_nodes;
mod demo_nodes_hand;
mod examples;
mod filter;
mod filter_board;
mod flood;
mod fuzz;
mod hand;
mod host_faults;
pub mod instructions;
mod interleavings;
mod link;
mod listed;
mod miri;
mod modes;
mod nodes;
pub mod other_processors;
mod path;
mod python;
mod radii;
mod receive;
mod rot;
mod rounding;
mod sanitizers;
mod shaft;
mod sides;
mod signed;
mod stack;
mod tick_cost;
mod ticks;
mod torn;
mod tracked;
mod tracked_modes;

use anyhow::Result;

use crate::harness::Check;

/// All checks, in the order of the document.
pub const CHECKS: &[Check] = &[
    anytime::CHECK,
    bounded::CHECK,
    dearer::CHECK,
    shaft::CHECK,
    dearer::OF_HUMAN,
    listed::CHECK,
    sides::CHECK,
    hand::CHECK,
    filter::CHECK,
    filter_board::CHECK,
    cost::BOARD,
    cost::HOST,
    tick_cost::CHECK,
    bound::CHECK,
    path::CHECK,
    tracked::CHECK,
    ticks::CHECK,
    signed::CHECK,
    bits::CHECK,
    other_processors::CHECK,
    link::CHECK,
    stack::CHECK,
    demo::CHECK,
    demo_hand::CHECK,
    demo_nodes::CHECK,
    demo_nodes_hand::CHECK,
    demo_faults::CHECK,
    flood::CHECK,
    demo_c::CHECK,
    examples::CHECK,
    boards::CHECK,
    rot::CHECK,
    host_faults::CHECK,
    board_faults::CHECK,
    interleavings::CHECK,
    torn::CHECK,
    receive::CHECK,
    modes::CHECK,
    tracked_modes::CHECK,
    nodes::CHECK,
    carried::CHECK,
    radii::CHECK,
    rounding::CHECK,
    sanitizers::ADDRESS,
    sanitizers::THREAD,
    miri::CHECK,
    corruption::CHECK,
    fuzz::CHECK,
    instructions::CHECK,
    python::CHECK,
];

/// Checks that `cargo xtask test` runs only with `--whole`: each builds one more program, or takes half a minute in
/// addition to checks of the same parts, or runs the tests again under a sanitizer.
pub const ON_REQUEST: [&str; 15] = [
    dearer::CHECK.name,
    shaft::CHECK.name,
    dearer::OF_HUMAN.name,
    listed::CHECK.name,
    tick_cost::CHECK.name,
    demo_nodes::CHECK.name,
    demo_nodes_hand::CHECK.name,
    filter_board::CHECK.name,
    nodes::CHECK.name,
    flood::CHECK.name,
    tracked_modes::CHECK.name,
    other_processors::CHECK.name,
    sanitizers::ADDRESS.name,
    sanitizers::THREAD.name,
    fuzz::CHECK.name,
];

/// Checks that run in parallel on the other core: most need no emulator; also bound and cost model, the demo in C, the
/// other processors, and the boards, so that both take as long.
pub const BESIDE: [&str; 16] = [
    cost::BOARD.name,
    bound::CHECK.name,
    sanitizers::ADDRESS.name,
    sanitizers::THREAD.name,
    interleavings::CHECK.name,
    demo_c::CHECK.name,
    other_processors::CHECK.name,
    boards::CHECK.name,
    miri::CHECK.name,
    rounding::CHECK.name,
    fuzz::CHECK.name,
    cost::HOST.name,
    instructions::CHECK.name,
    host_faults::CHECK.name,
    corruption::CHECK.name,
    python::CHECK.name,
];

/// Checks of the interfaces for other languages.
pub const BINDINGS: [&str; 2] = [demo_c::CHECK.name, python::CHECK.name];

/// Checks that build no program and boot none: in `cargo xtask evidence` they run in the lane that is idle first.
pub const EITHER: [&str; 6] = [
    anytime::CHECK.name,
    sides::CHECK.name,
    hand::CHECK.name,
    filter::CHECK.name,
    carried::CHECK.name,
    radii::CHECK.name,
];

/// Fits all constants, or those whose names contain `only`.
pub fn fit(only: Option<&str>) -> Result<()> {
    cost::fit(only)?;
    bounded::rows::fit(only)?;
    tick_cost::fit(only)
}
