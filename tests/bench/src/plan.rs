//! The size of a run, and its progress.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};

/// Runs the paper's experiments: DIBS, the paper's baselines and today's peers, on the same surfaces and
/// tools. Writes docs/evidence/benchmarks.json and everything that is made from it.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Options {
    /// A few minutes instead of half an hour: fewer queries. Writes to target/bench, not to docs.
    #[arg(long)]
    pub quick: bool,
    /// The size of `cargo xtask evidence`.
    #[arg(long, conflicts_with = "quick")]
    pub release: bool,
    /// At most this many queries of each brain and tool, instead of the paper's 10,000.
    #[arg(long)]
    pub queries: Option<usize>,
    /// Where to write instead.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Measures nothing: makes the documents and figures anew from benchmarks.json.
    #[arg(long)]
    pub render: bool,
    /// Only counts the paper's own search anew, into the folder's benchmarks.json.
    #[arg(long)]
    pub paper_search: bool,
    /// Measures only this part anew, into the folder's benchmarks.json; the other records stay as they are.
    #[arg(long, value_enum, conflicts_with_all = ["render", "paper_search"])]
    pub only: Option<Only>,
    /// Leaves out the emulated Cortex-M7.
    #[arg(long)]
    pub no_board: bool,
}

/// A part that is measured by itself.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// The paper's experiments themselves.
    Paper,
    /// The control loop at imaging rates: ten minutes on a quiet machine.
    Imaging,
    /// Surfaces that nodes move: ten minutes on a quiet machine.
    Embedded,
    /// Contacts within a margin: two minutes.
    Contacts,
    /// A tracker on the emulated Cortex-M7, on real surfaces where they are at hand.
    Tracker,
}

/// The size of a run.
#[derive(Clone, Debug)]
pub struct Plan {
    pub name: &'static str,
    /// Triangles of each brain, and queries of each of its cells.
    pub brains: Vec<(u32, usize)>,
    /// Queries of exhaustive search on the largest brain.
    exhaustive_most: usize,
    pub heart_triangles: u32,
    /// Ticks of the heart's experiment, and how often they are repeated.
    pub ticks: u32,
    pub repetitions: usize,
    /// Brains of the ablation, and queries of each of its cells.
    pub ablation_brains: Vec<u32>,
    pub ablation_queries: usize,
    /// Brains in the control loop at imaging rates, and its ticks.
    pub imaging_brains: Vec<u32>,
    pub imaging_ticks: u32,
    /// Ticks at which contacts are asked for, on the same brains.
    pub contact_ticks: u32,
    /// Ticks of a tracker on the emulated board, and triangles of its brain.
    pub board_ticks: u32,
    pub board_brain: u32,
}

impl Plan {
    /// 10,000 queries a cell, as in the paper.
    pub fn full() -> Self {
        Self {
            name: "full",
            brains: [500, 5_000, 50_000, 500_000].map(|t| (t, 10_000)).to_vec(),
            exhaustive_most: 500,
            heart_triangles: 10_272,
            ticks: 14_000,
            repetitions: 3,
            ablation_brains: vec![5_000, 50_000],
            ablation_queries: 1_000,
            imaging_brains: vec![5_000, 50_000, 500_000],
            imaging_ticks: 7_000,
            contact_ticks: 10_000,
            board_ticks: 77_000,
            board_brain: 50_000,
        }
    }

    /// The plan of these arguments.
    pub fn of(options: &Options) -> Self {
        let mut plan = match options {
            Options { quick: true, .. } => Self::quick(),
            Options { release: true, .. } => Self::release(),
            _ => Self::full(),
        };
        let most = options.queries.unwrap_or(usize::MAX);
        plan.brains.iter_mut().for_each(|(_, queries)| *queries = most.min(*queries));
        plan
    }

    /// Meant for twenty minutes for all parts.
    pub fn release() -> Self {
        Self {
            name: "release",
            brains: vec![(500, 2_000), (5_000, 2_000), (50_000, 2_000), (500_000, 500)],
            exhaustive_most: 50,
            ticks: 3_500,
            ablation_queries: 500,
            imaging_ticks: 2_000,
            contact_ticks: 3_000,
            board_ticks: 21_000,
            ..Self::full()
        }
    }

    /// Within ten minutes on two cores, compilation included.
    pub fn quick() -> Self {
        Self {
            name: "quick",
            brains: vec![(500, 2_000), (5_000, 2_000), (50_000, 500), (500_000, 100)],
            exhaustive_most: 20,
            ticks: 3_500,
            repetitions: 3,
            ablation_brains: vec![5_000],
            ablation_queries: 200,
            imaging_ticks: 1_000,
            contact_ticks: 1_000,
            board_ticks: 7_000,
            ..Self::full()
        }
    }

    /// Takes seconds: every experiment runs, but no figure is worth quoting.
    pub fn smoke() -> Self {
        Self {
            name: "smoke",
            brains: vec![(500, 25), (1_000, 10)],
            exhaustive_most: 5,
            heart_triangles: 1_000,
            ticks: 30,
            repetitions: 2,
            ablation_brains: vec![500],
            ablation_queries: 5,
            imaging_brains: vec![500],
            imaging_ticks: 200,
            contact_ticks: 2_000,
            board_ticks: 200,
            board_brain: 1_000,
        }
    }

    /// Exhaustive search takes part in each of this many steps.
    pub fn exhaustive_every(&self, triangles: usize) -> usize {
        let (_, queries) = self.brains.iter().max().copied().unwrap_or_default();
        match triangles {
            400_000.. => queries.div_ceil(self.exhaustive_most).max(1),
            _ => 1,
        }
    }

    /// Steps before anything is measured.
    pub fn warm_up(&self, triangles: usize) -> usize {
        if self.name == "smoke" { 1 } else { (100_000 / triangles).clamp(5, 100) }
    }
}

/// A progress bar on standard error, if that is a terminal.
pub struct Progress(ProgressBar);

impl Progress {
    /// A bar of `length` steps, or without a length a spinner.
    pub fn start(what: &str, length: u64) -> Self {
        let bar = if length == 0 {
            ProgressBar::new_spinner()
        } else {
            let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {eta:>5}  {msg}");
            ProgressBar::new(length).with_style(style.unwrap_or(ProgressStyle::default_bar()))
        };
        bar.set_message(what.to_owned());
        bar.tick();
        Self(bar)
    }

    pub fn one(&self) {
        self.0.inc(1);
    }

    pub fn finish(self) {
        self.0.finish_and_clear();
    }
}
