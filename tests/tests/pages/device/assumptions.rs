//! Assumptions of use, and where they are checked.

pub struct Assumption {
    /// It is never reused for another assumption.
    pub id: &'static str,
    pub says: &'static str,
    pub check: Check,
}

/// Where an assumption is checked at run time.
pub enum Check {
    /// By a function in a file of the core, with this outcome.
    By { file: &'static str, function: &'static str, outcome: &'static str },
    /// Not checked: what the user can do.
    Yours(&'static str),
}
use Check::{By, Yours};

const fn by(
    id: &'static str,
    says: &'static str,
    file: &'static str,
    function: &'static str,
    outcome: &'static str,
) -> Assumption {
    Assumption { id, says, check: By { file, function, outcome } }
}

const fn yours(id: &'static str, says: &'static str, hint: &'static str) -> Assumption {
    Assumption { id, says, check: Yours(hint) }
}

pub const ASSUMPTIONS: &[Assumption] = &[
    by(
        "U-01",
        "The surface keeps to the stretch limit of its tree.",
        "stretch/rows.rs",
        "exceeded",
        "StretchError::Exceeded",
    ),
    by(
        "U-02",
        "Elements that carry a surface are not inverted.",
        "nodes/measure.rs",
        "measure",
        "StretchError::Inverted",
    ),
    by(
        "U-03",
        "Tissue moves at most at the speed that is stated, from one frame to the next.",
        "stretch/motion.rs",
        "too_fast",
        "StretchError::TooFast",
    ),
    yours(
        "U-04",
        "Between two frames and after the last it moves at most at that speed, too.",
        "Choose the speed for the fastest part of a beat. The margin of trust follows from it.",
    ),
    yours(
        "U-05",
        "An extrapolated surface goes on as its last frames did: its error is an estimate, not a bound.",
        "Hold the surface where a promise must rest on limits alone.",
    ),
    by(
        "U-06",
        "A surface is not older than allowed.",
        "control/failsafe/mod.rs",
        "step",
        "Unavailable::Stale",
    ),
    by(
        "U-07",
        "Frames arrive within the limit on transit, and echo a status.",
        "control/failsafe/freshness.rs",
        "levels",
        "Unavailable::Delayed",
    ),
    yours(
        "U-08",
        "The source does not repeat old images with noise, and states no age below the true one.",
        "ThresholdPair the age when sent (`failsafe::Limits::source_age`): it shows a source that stands still.",
    ),
    by(
        "U-09",
        "Sender and receiver mean the same mesh, in the same unit and of the same size.",
        "receive/packets.rs",
        "begin_frame",
        "ReceiveError::OtherSurface",
    ),
    by(
        "U-10",
        "Lengths are millimetres: a surface in another unit is shrunk or stretched.",
        "stretch/pass.rs",
        "advance",
        "StretchError::Shrunk",
    ),
    yours(
        "U-11",
        "Mesh, frames and tool poses are in one coordinate frame, and the registration is as exact as is stated.",
        "State its error (`filter::Uncertainty::error`, with a guard a larger stand-off, `Proximity::widened`), and compare a touched landmark.",
    ),
    yours(
        "U-12",
        "The mesh is the anatomy: it is not cut, joined or segmented wrongly.",
        "Stretch is checked, topology is not. A cut organ needs a new tree.",
    ),
    by(
        "U-13",
        "The surface has sides: its triangles are wound one way. Without them there are no contacts, and walls take the tool to be \
         outside.",
        "query/contacts/add.rs",
        "begin",
        "QueryError::NoAdjacency",
    ),
    by(
        "U-14",
        "The tool's coordinates and radius are finite and in range.",
        "tool/mod.rs",
        "check_point",
        "ToolError::Coordinate",
    ),
    yours(
        "U-15",
        "The tool is rigid, within a sphere or capsule of the radius that is stated, and its pose is that of this tick.",
        "Take the radius of the widest part, bending and pose error included. Without a pose call `Guard::without_pose`.",
    ),
    by(
        "U-16",
        "The tree's bytes stay what they were at the start.",
        "tree/scrub.rs",
        "step",
        "Unavailable::CorruptTree",
    ),
    yours(
        "U-17",
        "Memory, registers and buses of the processor are sound: no check of this library outlives them.",
        "Memory with error correction, a processor in lock step, or a second channel.",
    ),
    yours(
        "U-18",
        "The processor rounds to nearest and keeps subnormal numbers, as after reset.",
        "Leave FPSCR as it is. `cargo xtask guarantees --only \"the same bits everywhere\"` is the test of a port.",
    ),
    by(
        "U-19",
        "The two ends of a surface are taken once.",
        "surface/frames.rs",
        "split",
        "SplitError",
    ),
    yours(
        "U-20",
        "The bus's end runs below the control tick's priority, and `Bus::work` often enough.",
        "Read `Bus::counters`: `busy` counts frames that were dropped.",
    ),
    by(
        "U-21",
        "The receiver's clock goes on, with any start; one that goes back makes a surface old.",
        "surface/latest.rs",
        "within",
        "Unavailable::Stale",
    ),
    yours(
        "U-22",
        "The control tick runs at the stated rate, and its output is applied in the same period.",
        "A watchdog in the drive. Ticks left out make velocities as slow as the clock shows.",
    ),
    yours(
        "U-23",
        "A budget of instructions fits the tick: `Cost` counts instructions, not cycles.",
        "Measure with `firmware-example/src/bin/cycles.rs` on your board, and the longest tick there.",
    ),
    yours(
        "U-24",
        "The stack has room for the deepest path.",
        "The example's is bounded from its binary (P-02); do the same with yours.",
    ),
    by(
        "U-25",
        "A command to a filter is finite.",
        "control/filter/mod.rs",
        "admit",
        "FilterError::Command",
    ),
    yours(
        "U-26",
        "The robot executes the admitted motion, and rests after an error.",
        "Compare the encoders with it.",
    ),
    yours(
        "U-27",
        "The device damps more than `SpringDamper::device_damping` says, or the wall has an `EnergyAccount` for the tool's largest speed.",
        "Measure the damping of the hand's axis.",
    ),
    yours(
        "U-28",
        "A hand pushes with less than the largest force.",
        "A filter of commands has no such limit.",
    ),
    yours(
        "U-29",
        "An operator acknowledges and registers anew only after looking.",
        "`GuardLimits::automatic` leaves the operator out.",
    ),
    yours(
        "U-30",
        "Where strangers reach the bus, both sides have a key, it stays secret, and a challenge is random.",
        "SECURITY.md and docs/wire.md list what a key does and does not protect.",
    ),
];
