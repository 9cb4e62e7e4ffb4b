//! The sizes of the checks.

/// Sizes of the checks.
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
pub struct Effort {
    /// Cases of checks on the host.
    pub cases: usize,
    /// Poses whose side must be right.
    pub sides: usize,
    /// Queries on surfaces that nodes carry.
    pub carried: usize,
    /// Walks of 400 ticks against a filter of commands.
    pub walks: u64,
    /// The same on the board, and glides near the heart with their number of ticks.
    pub board_walks: u64,
    pub board_glides: u64,
    pub board_glide_ticks: u32,
    /// Queries whose bits must be the same.
    pub bits: usize,
    /// Queries that must stay within their bound.
    pub costs: usize,
    /// The same on the host, under callgrind.
    pub host_costs: usize,
    /// Queries, and ticks of each kind, that are compared with the path bound; it counts 3.6 times as many in all.
    pub bounds: usize,
    /// Queries that are traced against it, and 8 times as many ticks of each kind; 19 times as many in all.
    pub bound_traces: usize,
    /// Ticks of table 3's path on the board.
    pub ticks: u32,
    /// Adversarial poses on the board.
    pub poses: usize,
    /// Frames chosen to make the firmware's tick long.
    pub tick_frames: usize,
    /// Queries during which frames are published.
    pub torn: u32,
    /// Faults of each kind on the host's bus.
    pub faults: u64,
    /// Faults of each kind on the board's bus.
    pub board_faults: u64,
    /// Duration of the demo, in seconds of the controller's time.
    pub demo_seconds: u32,
    /// The same with faults on the bus.
    pub fault_seconds: u32,
    /// The same on a flooded network.
    pub flood_seconds: u32,
    pub fuzz_seconds: u32,
    /// Whether the records are written to the documents; not for a run of the tests.
    pub is_record: bool,
    /// Whether the checks that run on request are included.
    pub is_whole: bool,
    /// Divisor of the full number of cases.
    pub share: u32,
}

/// In place of a divisor.
const RELEASED: u32 = u32::MAX;

impl Effort {
    /// The sizes that the documents state.
    pub const FULL: Self = Self {
        cases: 1_000_000,
        sides: 1_000_000,
        carried: 10_000_000,
        walks: 25_000,
        board_walks: 250,
        board_glides: 3,
        board_glide_ticks: 3_000,
        bits: 100_000,
        costs: 100_000,
        host_costs: 100_000,
        bounds: 280_000,
        bound_traces: 540,
        ticks: 2_000,
        poses: 10_000,
        tick_frames: 400,
        torn: 100_000,
        faults: 100_000,
        board_faults: 100,
        demo_seconds: 20,
        fault_seconds: 60,
        flood_seconds: 20,
        fuzz_seconds: 60,
        is_record: true,
        is_whole: true,
        share: 1,
    };
    /// The sizes for every run of the tests.
    pub const TEST: Self = Self {
        cases: 100_000,
        sides: 4_000,
        carried: 50_000,
        walks: 100,
        board_walks: 20,
        board_glides: 1,
        board_glide_ticks: 1_500,
        bits: 10_000,
        costs: 4_000,
        host_costs: 2_500,
        bounds: 400,
        bound_traces: 20,
        ticks: 250,
        poses: 1_000,
        tick_frames: 40,
        torn: 8_000,
        faults: 300,
        board_faults: 1,
        demo_seconds: 5,
        fault_seconds: 4,
        flood_seconds: 4,
        fuzz_seconds: 8,
        is_record: false,
        is_whole: false,
        share: 0,
    };

    /// The sizes of `cargo xtask evidence`.
    pub const RELEASE: Self = Self {
        cases: 100_000,
        sides: 100_000,
        carried: 1_000_000,
        walks: 500,
        board_walks: 50,
        board_glides: 3,
        board_glide_ticks: 3_000,
        bits: 10_000,
        costs: 10_000,
        host_costs: 10_000,
        bounds: 10_000,
        bound_traces: 54,
        ticks: 250,
        poses: 1_000,
        tick_frames: 40,
        torn: 10_000,
        faults: 1_000,
        board_faults: 1,
        demo_seconds: 10,
        fault_seconds: 20,
        flood_seconds: 5,
        fuzz_seconds: 60,
        is_record: true,
        is_whole: true,
        share: RELEASED,
    };

    /// A fraction 1 / `share` of the cases, but at least as many as in a run of the tests.
    pub fn divided(self, share: u32) -> Self {
        let wide = |full: usize, least: usize| (full / share as usize).max(least);
        let narrow = |full: u32, least: u32| (full / share).max(least);
        let least = Self::TEST;
        Self {
            cases: wide(self.cases, least.cases),
            sides: wide(self.sides, least.sides),
            carried: wide(self.carried, least.carried),
            walks: (self.walks / u64::from(share)).max(least.walks),
            board_walks: (self.board_walks / u64::from(share)).max(least.board_walks),
            board_glides: (self.board_glides / u64::from(share)).max(least.board_glides),
            board_glide_ticks: narrow(self.board_glide_ticks, least.board_glide_ticks),
            bits: wide(self.bits, least.bits),
            costs: wide(self.costs, least.costs),
            host_costs: wide(self.host_costs, least.host_costs),
            bounds: wide(self.bounds, least.bounds),
            bound_traces: wide(self.bound_traces, least.bound_traces),
            ticks: narrow(self.ticks, least.ticks),
            poses: wide(self.poses, least.poses),
            tick_frames: wide(self.tick_frames, least.tick_frames),
            torn: narrow(self.torn, least.torn),
            faults: (self.faults / u64::from(share)).max(least.faults),
            board_faults: (self.board_faults / u64::from(share)).max(least.board_faults),
            demo_seconds: narrow(self.demo_seconds, least.demo_seconds),
            fault_seconds: narrow(self.fault_seconds, least.fault_seconds),
            flood_seconds: narrow(self.flood_seconds, least.flood_seconds),
            share,
            ..self
        }
    }

    /// The size as the records state it: `full`, `1/4`, `release`, or `test`.
    pub fn size(&self) -> String {
        match self.share {
            0 => "test".to_owned(),
            1 => "full".to_owned(),
            RELEASED => "release".to_owned(),
            share => format!("1/{share}"),
        }
    }
}
