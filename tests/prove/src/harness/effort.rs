//! How much is tried.

/// Sizes of the checks.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Cases on this computer.
    pub cases: usize,
    /// Queries that must give the same bits.
    pub bits: usize,
    /// Queries that must keep to their bound.
    pub costs: usize,
    /// The same on this computer, under callgrind.
    pub host_costs: usize,
    /// Ticks of table 3's path on the board.
    pub ticks: u32,
    /// Adversarial poses on the board.
    pub poses: usize,
    /// Queries under which frames are published.
    pub torn: u32,
    /// Faults of each kind on the bus of this computer.
    pub faults: u64,
    /// Faults of each kind on the board's bus.
    pub board_faults: u64,
    /// Seconds of the controller's time.
    pub demo_seconds: u32,
    /// The same, with faults on the bus.
    pub fault_seconds: u32,
    /// Seconds of each fuzz target.
    pub fuzz_seconds: u32,
    /// Whether the records are for the documents: those of a run of the tests are not.
    pub is_record: bool,
}

impl Effort {
    /// The sizes that the documents state.
    pub const FULL: Self = Self {
        cases: 1_000_000,
        bits: 100_000,
        costs: 100_000,
        host_costs: 100_000,
        ticks: 2_000,
        poses: 10_000,
        torn: 100_000,
        faults: 100_000,
        board_faults: 100,
        demo_seconds: 20,
        fault_seconds: 60,
        fuzz_seconds: 60,
        is_record: true,
    };
    /// The sizes that every run of the tests can afford.
    pub const TEST: Self = Self {
        cases: 100_000,
        bits: 10_000,
        costs: 10_000,
        host_costs: 5_000,
        ticks: 250,
        poses: 1_000,
        torn: 8_000,
        faults: 300,
        board_faults: 1,
        demo_seconds: 5,
        fault_seconds: 20,
        fuzz_seconds: 60,
        is_record: false,
    };
}
