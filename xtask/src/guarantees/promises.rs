//! What every figure promises, and what bounds it.

use std::fmt;

/// One promise, of one figure.
pub struct Promise {
    /// The figure's name.
    pub id: &'static str,
    /// One sentence; empty for a figure that another one's text, or the table of instructions, shows.
    pub promise: &'static str,
    /// Criterion of IEC 62304, 5.5.4.
    pub criterion: &'static str,
    /// The command that checks it.
    pub check: &'static str,
    pub bound: Bound,
    /// `{id}` stands for the figure of that name, here and below.
    pub unit: &'static str,
    pub limits: &'static str,
}

/// What a figure must be.
pub enum Bound {
    /// It informs.
    Informs,
    Is(f64),
    AtMost(f64),
    AtLeast(f64),
    /// Not above another figure.
    NotAbove(&'static str),
    /// Not above the committed figure by more than this many per cent.
    Golden(f64),
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Informs => write!(f, "–"),
            Self::Is(value) => write!(f, "{value}"),
            Self::AtMost(value) => write!(f, "at most {value}"),
            Self::AtLeast(value) => write!(f, "at least {value}"),
            Self::NotAbove(other) => write!(f, "not above `{other}`"),
            Self::Golden(percent) => write!(f, "committed figure + {percent} %"),
        }
    }
}

const HOST: &str = "`cargo bench -p dibs-tests --bench guarantees`";
const XTASK: &str = "`cargo xtask guarantees`";
const TEST: &str = "`cargo xtask test`";
const FUZZ: &str = "`cargo xtask fuzz`";
const SANITIZE: &str = "`cargo xtask sanitize`";

const TIMING: &str = "event sequence; planned resources";
const FLOW: &str = "data and control flow";
const FAULTS: &str = "fault handling";
const MEMORY: &str = "memory overflow";
const EDGES: &str = "boundary conditions";
const DIAGNOSTICS: &str = "self-diagnostics";

const fn promise(
    id: &'static str,
    promise: &'static str,
    criterion: &'static str,
    check: &'static str,
    bound: Bound,
    unit: &'static str,
    limits: &'static str,
) -> Promise {
    Promise { id, promise, criterion, check, bound, unit, limits }
}

/// A figure without a row of its own.
const fn note(id: &'static str) -> Promise {
    promise(id, "", "", XTASK, Bound::Informs, "", "")
}

/// A number of instructions that no commit may raise.
const fn golden(id: &'static str, percent: f64) -> Promise {
    promise(id, "", "", TEST, Bound::Golden(percent), "instructions", "")
}

/// All promises, in the order of the document.
pub const PROMISES: &[Promise] = &[
    note("anytime.cases"),
    note("anytime.cut-short"),
    promise(
        "anytime.outside",
        "A query cut short by any budget, none included, gives an interval that holds the true separation",
        EDGES,
        HOST,
        Bound::Is(0.0),
        "of {anytime.cases} budgets, {anytime.cut-short} of them cut short",
        "Surfaces within their stretch limit; truth by exhaustive search in f64.",
    ),
    promise(
        "anytime.worst-error",
        "An end of the interval is off by at most the stated accuracy",
        EDGES,
        HOST,
        Bound::AtMost(1.0),
        "of the accuracy, at the most",
        "Nine kinds of deformation, collapsed surfaces among them.",
    ),
    promise(
        "anytime.grown",
        "The interval never grows with the budget, nor from tick to tick under warm start",
        FLOW,
        HOST,
        Bound::Is(0.0),
        "of {anytime.cases} budgets",
        "Upper ends within the accuracy.",
    ),
    promise(
        "anytime.unfinished",
        "An unlimited query has an interval of one point",
        FLOW,
        HOST,
        Bound::Is(0.0),
        "of {anytime.cases} budgets",
        "",
    ),
    promise(
        "anytime.too-weak",
        "The force of a query cut short is at least that of the true separation",
        FAULTS,
        HOST,
        Bound::Is(0.0),
        "of {anytime.cases} budgets",
        "The size; the direction is that of the best pair found.",
    ),
    note("cost.queries"),
    promise(
        "cost.beyond",
        "No query costs more instructions than `Cost` says for its tests",
        TIMING,
        XTASK,
        Bound::Is(0.0),
        "of {cost.queries} adversarial queries on the emulated Cortex-M7",
        "A plane above measured queries, with a margin, not a proof; other queries than it was fitted \
         to. Vertex tables that are slices of `Vec3`; instructions, not cycles.",
    ),
    promise(
        "cost.late",
        "A query with `Budget::for_instructions` ends within them",
        TIMING,
        XTASK,
        Bound::Is(0.0),
        "of half of {cost.queries} queries",
        "Deadlines above `Cost::base`.",
    ),
    promise(
        "cost.sphere.mean-share",
        "Tightness, sphere: what a query takes of its bound",
        TIMING,
        XTASK,
        Bound::Informs,
        "% on average, {cost.sphere.largest-share} % at the most",
        "Constants: {cost.sphere.base} + {cost.sphere.node-test} n + {cost.sphere.triangle-test} t.",
    ),
    promise(
        "cost.capsule.mean-share",
        "Tightness, capsule",
        TIMING,
        XTASK,
        Bound::Informs,
        "% on average, {cost.capsule.largest-share} % at the most",
        "Constants: {cost.capsule.base} + {cost.capsule.node-test} n + {cost.capsule.triangle-test} t.",
    ),
    note("cost.sphere.largest-share"),
    note("cost.sphere.base"),
    note("cost.sphere.node-test"),
    note("cost.sphere.triangle-test"),
    note("cost.capsule.largest-share"),
    note("cost.capsule.base"),
    note("cost.capsule.node-test"),
    note("cost.capsule.triangle-test"),
    note("cost.host.queries"),
    promise(
        "cost.host.beyond",
        "The same on x86-64: no query costs more instructions than `Cost` says for its tests",
        TIMING,
        XTASK,
        Bound::Is(0.0),
        "of {cost.host.queries} adversarial queries under callgrind",
        "As above; instructions of the compiler in use.",
    ),
    promise(
        "cost.host.late",
        "A query with `Budget::for_instructions` ends within them, on x86-64",
        TIMING,
        XTASK,
        Bound::Is(0.0),
        "of half of {cost.host.queries} queries",
        "As above.",
    ),
    promise(
        "cost.host.sphere.mean-share",
        "Tightness on x86-64, sphere",
        TIMING,
        XTASK,
        Bound::Informs,
        "% on average, {cost.host.sphere.largest-share} % at the most",
        "Constants: {cost.host.sphere.base} + {cost.host.sphere.node-test} n + \
         {cost.host.sphere.triangle-test} t.",
    ),
    promise(
        "cost.host.capsule.mean-share",
        "Tightness on x86-64, capsule",
        TIMING,
        XTASK,
        Bound::Informs,
        "% on average, {cost.host.capsule.largest-share} % at the most",
        "Constants: {cost.host.capsule.base} + {cost.host.capsule.node-test} n + \
         {cost.host.capsule.triangle-test} t.",
    ),
    note("cost.host.sphere.largest-share"),
    note("cost.host.sphere.base"),
    note("cost.host.sphere.node-test"),
    note("cost.host.sphere.triangle-test"),
    note("cost.host.capsule.largest-share"),
    note("cost.host.capsule.base"),
    note("cost.host.capsule.node-test"),
    note("cost.host.capsule.triangle-test"),
    note("bits.queries"),
    note("bits.hash"),
    promise(
        "bits.different",
        "The same bits on the Cortex-M7 and on x86-64 in debug, release and native builds",
        FLOW,
        XTASK,
        Bound::Is(0.0),
        "of {bits.queries} answers (separation, points, triangle, counts); their hash is {bits.hash}",
        "An emulated processor; compilers as installed.",
    ),
    promise(
        "panics",
        "The firmware links, and so has no panic path; one put in on purpose breaks the link",
        FAULTS,
        TEST,
        Bound::Is(0.0),
        "panic paths",
        "The release build. Debug builds stop instead.",
    ),
    promise(
        "allocators",
        "No allocator in the firmware",
        "planned resources",
        TEST,
        Bound::Is(0.0),
        "allocator symbols",
        "",
    ),
    note("stack.idle"),
    note("stack.bus"),
    note("stack.control"),
    promise(
        "stack.measured",
        "Stack used in the demo, by the paint that is gone",
        MEMORY,
        XTASK,
        Bound::NotAbove("stack.bound"),
        "bytes",
        "One run's depth.",
    ),
    promise(
        "stack.bound",
        "Stack at the worst, from the binary: idle loop, bus and control tick on top of each other, and a fault",
        MEMORY,
        XTASK,
        Bound::NotAbove("stack.room"),
        "bytes: idle {stack.idle}, bus {stack.bus}, control {stack.control}, and what exceptions put between",
        "Frames by the compiler and by the instructions, calls by the branches; no recursion.",
    ),
    promise(
        "stack.room",
        "Stack that the linker gives",
        MEMORY,
        XTASK,
        Bound::Informs,
        "bytes",
        "At the bottom of RAM: below it is nothing.",
    ),
    promise(
        "stack.indirect",
        "Calls through a register",
        FLOW,
        XTASK,
        Bound::Is(0.0),
        "in the firmware",
        "",
    ),
    promise(
        "stack.overflow-unnoticed",
        "A stack that overflows stops the firmware, and overwrites nothing",
        MEMORY,
        XTASK,
        Bound::Is(0.0),
        "of one recursion put in on purpose",
        "Needs memory.x's layout: the address below the stack must be a fault on your part too.",
    ),
    note("demo.ticks"),
    promise(
        "demo.misses",
        "No control tick at 1 kHz is missed or late while the bus is busy throughout",
        TIMING,
        XTASK,
        Bound::Is(0.0),
        "of {demo.ticks} ticks on the emulated board",
        "500 million instructions a second, one a cycle.",
    ),
    promise(
        "demo.mismatches",
        "Every answer of the demo agrees with exhaustive search in f64",
        FLOW,
        XTASK,
        Bound::Is(0.0),
        "of {demo.ticks} ticks",
        "",
    ),
    promise(
        "demo.latency",
        "A control tick begins at once: the longest section with interrupts disabled is shorter than",
        TIMING,
        XTASK,
        Bound::AtMost(2.0),
        "µs",
        "From the moment that it is due to its first instruction, exception entry included.",
    ),
    promise(
        "demo.tick",
        "Longest control tick, from the moment that it is due to its end",
        TIMING,
        XTASK,
        Bound::AtMost(1_000.0),
        "µs",
        "At 500 million instructions a second.",
    ),
    promise(
        "interrupts.masking",
        "Functions in the firmware that mask interrupts",
        TIMING,
        XTASK,
        Bound::AtMost(2.0),
        "found by their instructions",
        "Start-up takes the peripherals; neither interrupt masks anything.",
    ),
    promise(
        "frames.interleavings",
        "No frame is torn or lost, in any order of a writer's and a reader's steps",
        FLOW,
        "`RUSTFLAGS=\"--cfg loom\" cargo test --release -p dibs-soundness`",
        Bound::AtLeast(100.0),
        "orders, all of them that three frames and three reads have",
        "loom's memory model, which lets no load see a later store.",
    ),
    promise(
        "receive.quantised.1024.sum",
        "Receiving a vertex and checking the stretch around it",
        TIMING,
        XTASK,
        Bound::Golden(5.0),
        "instructions a vertex on the emulated Cortex-M7: {receive.quantised.1024.receive} to receive it in \
         a quantised packet of 1,024 bytes, {receive.quantised.1024.check} to check its two triangles",
        "Whole frames of the generated heart of 10,272 triangles, slices of 512 triangles. As floats \
         {receive.float.1024.sum}, in CAN-FD's 64 bytes {receive.quantised.64.sum}. COBS is not in it.",
    ),
    promise(
        "receive.tag",
        "What a tag (AES-128-CMAC in software) adds to a packet of 64 bytes",
        TIMING,
        XTASK,
        Bound::Golden(5.0),
        "instructions a packet on the emulated Cortex-M7",
        "A board with a hardware cipher implements `Mac` with that.",
    ),
    note("torn.queries"),
    note("torn.published"),
    note("torn.put-off"),
    note("torn.mixed-without"),
    promise(
        "torn.mixed",
        "No query sees vertices of two frames, published in its midst",
        FLOW,
        XTASK,
        Bound::Is(0.0),
        "of {torn.queries} queries on the emulated board while {torn.published} frames were published and \
         {torn.put-off} put off; without the protocol {torn.mixed-without} queries do",
        "",
    ),
    note("sanitizer.address.tests"),
    promise(
        "sanitizer.address",
        "Frames, bus and corrupt trees under the address sanitizer",
        MEMORY,
        SANITIZE,
        Bound::Is(0.0),
        "findings in {sanitizer.address.tests} tests",
        "Nightly compiler; skipped without one. Miri: `cargo xtask miri`, where it is installed.",
    ),
    note("sanitizer.thread.tests"),
    promise(
        "sanitizer.thread",
        "Frames and bus under the thread sanitizer",
        FLOW,
        SANITIZE,
        Bound::Is(0.0),
        "findings in {sanitizer.thread.tests} tests",
        "As above. What looks like a race in the test harness itself is left out \
         (`tests/soundness/tsan.txt` says why); a race put in on purpose is found.",
    ),
    note("corruption.cases"),
    note("corruption.errors"),
    note("corruption.right"),
    note("corruption.cautious"),
    promise(
        "corruption.endless",
        "Bits that flip in a validated tree cause no panic, no hang and no access out of bounds",
        FAULTS,
        HOST,
        Bound::Is(0.0),
        "of {corruption.cases} damages, of one bit to a word",
        "{corruption.errors} % end in an error, {corruption.right} % in a right answer, \
         {corruption.cautious} % in one that is too near.",
    ),
    promise(
        "corruption.undetected",
        "NOT detected by a query: a wrong radius, pin or index gives too great a distance",
        DIAGNOSTICS,
        HOST,
        Bound::Informs,
        "% of them",
        "What the scrub is for.",
    ),
    promise(
        "corruption.unscrubbed",
        "`Scrub` finds every damage within two rounds",
        DIAGNOSTICS,
        HOST,
        Bound::Is(0.0),
        "of {corruption.cases} damages unnoticed",
        "A round takes the tree's bytes over the bytes a call. Of damages beyond what a CRC-32 detects for \
         certain, one in 2^32 passes.",
    ),
    note("fuzz.seconds"),
    note("fuzz.tree.inputs"),
    note("fuzz.packets.inputs"),
    note("fuzz.mesh.inputs"),
    note("fuzz.query.inputs"),
    promise(
        "fuzz.findings",
        "No input makes the readers of trees, packets and meshes, or a query, panic or hang",
        EDGES,
        FUZZ,
        Bound::Is(0.0),
        "findings in {fuzz.tree.inputs} trees, {fuzz.packets.inputs} rows of packets, {fuzz.mesh.inputs} \
         mesh files and {fuzz.query.inputs} queries, {fuzz.seconds} s each",
        "Nightly compiler; skipped without one.",
    ),
    golden("m7.sphere.mean", 5.0),
    golden("m7.sphere.largest", 5.0),
    golden("m7.capsule.mean", 5.0),
    golden("m7.capsule.largest", 5.0),
    golden("m7.stretch", 5.0),
    golden("receive.quantised.1024.receive", 5.0),
    golden("receive.quantised.1024.check", 5.0),
    golden("receive.float.1024.receive", 5.0),
    golden("receive.float.1024.check", 5.0),
    golden("receive.float.1024.sum", 5.0),
    golden("receive.quantised.64.receive", 5.0),
    golden("receive.quantised.64.check", 5.0),
    golden("receive.quantised.64.sum", 5.0),
    golden("receive.tagged.64.receive", 5.0),
    golden("receive.tagged.64.check", 5.0),
    golden("receive.tagged.64.sum", 5.0),
    golden("modes.8.vertex", 5.0),
    golden("modes.8.bound", 5.0),
    golden("modes.8.query.rows", 5.0),
    golden("modes.8.query.rows.largest", 5.0),
    golden("modes.8.query.weights", 5.0),
    golden("modes.8.query.weights.largest", 5.0),
    golden("modes.8.query.remembered", 5.0),
    golden("modes.8.query.remembered.largest", 5.0),
    golden("modes.16.vertex", 5.0),
    golden("modes.16.bound", 5.0),
    golden("modes.16.query.rows", 5.0),
    golden("modes.16.query.rows.largest", 5.0),
    golden("modes.16.query.weights", 5.0),
    golden("modes.16.query.weights.largest", 5.0),
    golden("modes.16.query.remembered", 5.0),
    golden("modes.16.query.remembered.largest", 5.0),
    golden("host.sphere_closest.whole", 5.0),
    golden("host.sphere_closest.nodes", 5.0),
    golden("host.capsule_closest.whole", 5.0),
    golden("host.capsule_closest.warm", 5.0),
    golden("host.capsule_closest.nodes", 5.0),
    golden("host.sphere_triangle.ordinary", 5.0),
    golden("host.sphere_triangle.sliver", 5.0),
    golden("host.capsule_triangle.ordinary", 5.0),
    golden("host.capsule_triangle.sliver", 5.0),
    golden("host.stretch_of_a_thousand_triangles.heart", 5.0),
    golden("host.accept_forty_vertices.float", 5.0),
    golden("host.accept_forty_vertices.quantised", 5.0),
    golden("host.quantised_positions.hundred", 5.0),
    golden("host.force.wall", 5.0),
    golden("host.scrub.kilobyte", 5.0),
];
