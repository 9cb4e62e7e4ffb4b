//! The failures of each public call of `guard`: what the caller gets, and what stays.

pub struct Call {
    pub name: &'static str,
    pub goes_wrong: &'static str,
    /// Variants that the caller gets, by their enums.
    pub gives: &'static [Gives],
    pub stays: &'static str,
}

/// Variants of an enum.
pub type Gives = (&'static str, Variants);

pub enum Variants {
    All,
    Only(&'static [&'static str]),
    But(&'static [&'static str]),
}
use Variants::{All, But, Only};

const fn call(
    name: &'static str,
    goes_wrong: &'static str,
    gives: &'static [Gives],
    stays: &'static str,
) -> Call {
    Call { name, goes_wrong, gives, stays }
}

const START: &[Gives] = &[
    ("Error", Only(&["Format", "Nodes", "Query", "Limit", "Split", "Stretch"])),
    ("FormatError", All),
    ("NodesError", All),
    ("QueryError", Only(&["VertexCount", "Stack"])),
    ("LimitError", Only(&["TooLong", "Speed", "Rate", "NoReach"])),
    ("SplitError", All),
    ("StretchError", Only(&["NoMetric", "Corrupt"])),
];
/// For a packet, and for bytes that contain packets.
const PACKET: &[Gives] =
    &[("ReceiveError", But(&["Stretch"])), ("PacketError", All), ("PoseError", All)];
const BYTES: &[Gives] = &[
    ("ReceiveError", But(&["Stretch"])),
    ("PacketError", All),
    ("PoseError", All),
    ("StreamError", All),
];
/// For a frame from this process: the other variants are defects of packets.
const FRAME: &[Gives] =
    &[("ReceiveError", Only(&["RowCount", "NotFinite", "TooFar", "TooOld", "Earlier", "Busy"]))];
const POSED: &[Gives] = &[
    (
        "ReceiveError",
        Only(&["RowCount", "NotFinite", "TooFar", "TooOld", "Earlier", "Busy", "Pose"]),
    ),
    ("PoseError", All),
];
const WEIGHTS: &[Gives] = &[(
    "ReceiveError",
    Only(&["RowCount", "NotFinite", "TooFar", "TooOld", "Earlier", "Busy", "WrongMesh"]),
)];
const POSED_WEIGHTS: &[Gives] = &[
    (
        "ReceiveError",
        Only(&[
            "RowCount",
            "NotFinite",
            "TooFar",
            "TooOld",
            "Earlier",
            "Busy",
            "WrongMesh",
            "Pose",
        ]),
    ),
    ("PoseError", All),
];
const WORK: &[Gives] =
    &[("ReceiveError", Only(&["Stretch"])), ("StretchError", But(&["NoMetric", "VertexCount"]))];
/// For the surface, the bus and the tree.
const TRUST: Variants = But(&["NoPose", "NoDirection", "NoSide", "CutShort", "NotFinite"]);
const TICK: &[Gives] = &[
    ("Unavailable", TRUST),
    ("QueryError", Only(&["Position", "Uncovered", "Corrupt", "OtherTree", "OtherFrame"])),
];
/// Where a tick or its answer is made.
const NO_TICK: &[&str] = &["Stack", "VertexCount", "BlendTime", "NoVertexOrder"];
const CONTACTS: &[Gives] = &[("Unavailable", TRUST), ("QueryError", But(NO_TICK))];
const ADMIT: &[Gives] = &[
    ("Unavailable", TRUST),
    ("QueryError", Only(&["Position", "Uncovered", "Corrupt", "OtherTree", "OtherFrame"])),
    ("FilterError", Only(&["Parameter", "Command", "Pairs", "Unlabelled", "Query", "Untrusted"])),
];
/// For a constraint whose state is safe with this cause.
const FORCE: &[Gives] = &[("Unavailable", All)];
const NOTHING: &[Gives] = &[];

const SPLIT: &str = "A damaged tree, another number of rows, an age, a speed or a rate that is refused: nothing was taken, call it \
                     again. A stack, metric or reach that is missing: the ends are gone, and a later call gives `SplitError`; \
                     these follow from tree and types, so the first start of a build shows them.";
const PUBLISHED: &str = "The published surface stays, and ages. The frame in work goes on, or is abandoned where its rows, its \
                         digest or its surface were refused. The event is counted by its cause, once.";
const LOCAL: &str = "On an error what was published and what is in work stay, and the event is counted. Otherwise a frame of packets \
                     in work is abandoned.";
const SAFE: &str = "The fail-safe machine is in its safe state at this tick, and leaves it by its conditions alone. The answer has \
                    the cause.";
const KEPT: &str = "The value is kept as given.";

pub const CALLS: &[Call] = &[
    call("Surface::new", "Nothing: it is a constant.", NOTHING, "No frame was published."),
    call(
        "Surface::start",
        "The tree's bytes are damaged, of another version, or of another number of rows than the surface. A limit is out of \
         range. The ends were taken before. The stack is too small, or the tree has no metric, no rest shape or no nodes.",
        START,
        SPLIT,
    ),
    call(
        "Surface::start_with_mac",
        "As `start`. A key that the sender does not have: every packet is forged.",
        START,
        SPLIT,
    ),
    call("Surface::start_with_contacts", "As `start`.", START, SPLIT),
    call(
        "Bus::receive",
        "Bytes are lost, damaged, forged, repeated, late, in another order, or of another surface; a pose is none. Nothing is returned: \
         `counters` has each cause.",
        BYTES,
        PUBLISHED,
    ),
    call(
        "Bus::receive_from",
        "As `receive`. The stream fails: its own error. It claims more bytes than it had room for: the room counts.",
        BYTES,
        "On the stream's error nothing was taken. Otherwise as `receive`.",
    ),
    call(
        "Bus::packet",
        "The packet is damaged, forged, repeated, late, in another order, or of another surface; its pose is none.",
        PACKET,
        PUBLISHED,
    ),
    call(
        "Bus::frame",
        "Another number of positions, one that is not finite or too far away, a capture that is too old, in the future or \
         before the published one's, or a frame that is still being checked.",
        FRAME,
        LOCAL,
    ),
    call("Bus::frame_at", "As `frame`, and numbers that are no rigid pose.", POSED, LOCAL),
    call(
        "Bus::frame_of_weights",
        "As `frame`, of another number of weights than modes, a weight that is not finite or out of its range, or another \
         tree's modes.",
        WEIGHTS,
        LOCAL,
    ),
    call(
        "Bus::frame_of_weights_at",
        "As `frame_of_weights`, and numbers that are no rigid pose.",
        POSED_WEIGHTS,
        LOCAL,
    ),
    call(
        "Bus::work",
        "The surface is stretched, shrunk, inverted, inside out or too fast. The tree's bytes changed: found by the scrub, \
         said by the guard. Called too seldom: a complete frame is dropped where the next one begins.",
        WORK,
        "The refused frame is abandoned and counted; the published surface stays, and ages.",
    ),
    call(
        "Bus::status",
        "Nothing is due: `None`. The status is lost on its way: the sender echoes an older one, and the transit counts as \
         longer.",
        NOTHING,
        "The next status is due after 100 ms, or with news.",
    ),
    call("Bus::status_framed", "As `status`.", NOTHING, "As `status`."),
    call(
        "Bus::send_status_to",
        "The stream fails: its own error. It takes a part of the status.",
        NOTHING,
        "That status is lost; the next is due after 100 ms, or with news.",
    ),
    call(
        "Bus::counters",
        "A counter stands at its largest number: it does not wrap.",
        NOTHING,
        "All of it.",
    ),
    call("Bus::surface", "No frame was published: `None`.", NOTHING, "All of it."),
    call("Bus::rounds", "The number wraps.", NOTHING, "All of it."),
    call(
        "Bus::register",
        "It is called although the tissue was not moved: the next whole frame is compared with no frame before, so a wrong \
         surface of good shape is published.",
        NOTHING,
        "The published surface stays until then.",
    ),
    call(
        "Guard::closest",
        "No surface, or one that is old, delayed, refused too often, forged or silent; a tree that changed; a query that \
         fails. The budget ends: the interval is wide, and the side may be unknown.",
        TICK,
        SAFE,
    ),
    call(
        "Guard::contacts",
        "As `closest`. A margin that is no number, a list without room, a tree without sides. The list is too short: it says \
         how far it is complete.",
        CONTACTS,
        "As `closest`; on an error the list is empty.",
    ),
    call(
        "Guard::admit",
        "As `closest`. A command or a stated speed that is not finite. No motion is safe: the reason says so, and the motion is \
         the best one known.",
        ADMIT,
        "As `closest`; on an error nothing is admitted, and the tool must stay at rest.",
    ),
    call(
        "Guard::without_pose",
        "The tool has no pose at this tick.",
        &[("Unavailable", Only(&["NoPose", "NoSurface"]))],
        "As `closest`. The next tick's velocity starts anew.",
    ),
    call(
        "Guard::acknowledge",
        "The state is not safe, or its conditions for recovery are not met yet.",
        &[("AcknowledgeError", All)],
        "The state stays; the error has the frames and steps that are missing.",
    ),
    call("Guard::tracker", "Nothing.", NOTHING, "All of it."),
    call(
        "Answer::force",
        "The answer has no pair to act on, no side or no direction, or a number is not finite: the constraint's state is safe, \
         with the cause, and its force only damps.",
        FORCE,
        "It has no state.",
    ),
    call("Answer::guide", "As `force`.", FORCE, "It has no state."),
    call(
        "Answer::contacts",
        "The answer has no pair to act on. The budget ended before the side or any pair was known, the tool may be inside, or the \
         margin is larger than the list's.",
        &[
            ("Unavailable", But(&["NoDirection", "NotFinite", "NoPose"])),
            ("QueryError", But(NO_TICK)),
        ],
        "It has no state.",
    ),
    call(
        "GuardLimits::new",
        "A speed that is negative or not finite, or an age of 2^31 ms or more: `start` refuses them. Numbers that are wrong for \
         the tissue are not noticed.",
        NOTHING,
        KEPT,
    ),
    call(
        "GuardLimits::ticks_a_second",
        "0: `start` refuses it. Another rate than the loop's: velocities are wrong.",
        NOTHING,
        KEPT,
    ),
    call(
        "GuardLimits::instructions",
        "Too few: intervals are wide, and walls damp. More than the processor has in a period: ticks are late.",
        NOTHING,
        KEPT,
    ),
    call("GuardLimits::budget", "The same, in tests.", NOTHING, KEPT),
    call(
        "GuardLimits::options",
        "A stretch of another tree or frame: each tick says so. A query without side: walls take the tool to be outside.",
        NOTHING,
        KEPT,
    ),
    call("GuardLimits::automatic", "The safe state ends without an operator.", NOTHING, KEPT),
    call(
        "GuardLimits::without_transit",
        "A delayed frame counts as a new one, and no margin covers the delay.",
        NOTHING,
        KEPT,
    ),
    call(
        "GuardLimits::trust",
        "Limits that are too wide for the tissue are not noticed.",
        NOTHING,
        KEPT,
    ),
    call(
        "GuardLimits::surfaces",
        "A reach that is too large: accuracy is lost. Without a limit on speed leaps are published.",
        NOTHING,
        KEPT,
    ),
];

/// Variants that no call gives, each with its reason.
pub const NEVER: &[(&str, &[&str], &str)] = &[
    (
        "Error",
        &[
            "CorruptTree",
            "OutOfTable",
            "Publish",
            "Tool",
            "Unavailable",
            "Receive",
            "Packet",
            "Encode",
            "Stream",
            "Box",
            "Gain",
            "Filter",
            "Acknowledge",
            "Modes",
            "Weights",
        ],
        "it collects the errors of all calls, for `?`; the calls of `guard` give the inner error",
    ),
    ("QueryError", &["BlendTime"], "a guard makes the time between frames itself"),
    ("QueryError", &["NoVertexOrder"], "a bus without the order takes rows"),
    (
        "LimitError",
        &["Order", "Untrippable", "Recovery"],
        "refused where a limit is made, before a guard has it",
    ),
    ("FilterError", &["Row", "Rows"], "a guard passes no rows"),
    ("StretchError", &["VertexCount"], "`start` compares the number of rows"),
];
