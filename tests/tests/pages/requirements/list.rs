//! The requirements: the library's promises, each with an id that sources refer to.
//!
//! One file, because it is one list.

/// What the library must do.
pub struct Requirement {
    /// A letter for the area, and a number. It is never reused for another requirement.
    pub id: &'static str,
    pub says: &'static str,
    /// Ids of the figures in `guarantees.json` whose bounds this requirement states; empty if it holds without
    /// exception.
    pub figures: &'static [&'static str],
}

const fn requirement(
    id: &'static str,
    says: &'static str,
    figures: &'static [&'static str],
) -> Requirement {
    Requirement { id, says, figures }
}

/// Letters and titles of the areas.
pub const AREAS: [(char, &str); 9] = [
    ('A', "Answers"),
    ('S', "Sides, depths and contacts"),
    ('T', "From tick to tick"),
    ('F', "Frames and surfaces"),
    ('B', "The bus"),
    ('C', "Control"),
    ('M', "Meshes and trees"),
    ('P', "Programs and platforms"),
    ('E', "Evidence"),
];

pub const REQUIREMENTS: &[Requirement] = &[
    requirement(
        "A-01",
        "A separation is off by at most its stated accuracy, on every surface within its stretch limit.",
        &["anytime.worst-error", "demo.mismatches"],
    ),
    requirement(
        "A-02",
        "The sphere of a node holds every vertex of its section, in every frame that is admitted.",
        &[],
    ),
    requirement(
        "A-03",
        "The interval of a query that its budget cuts short holds the true separation, for every budget.",
        &["anytime.outside"],
    ),
    requirement(
        "A-04",
        "For the same query a larger budget never gives a wider interval.",
        &["anytime.grown", "anytime.unfinished"],
    ),
    requirement(
        "A-05",
        "A query takes at most the node and triangle tests of its budget; a budget for a number of instructions ends within \
         that number.",
        &["cost.beyond", "cost.late", "cost.host.beyond", "cost.host.late"],
    ),
    requirement(
        "A-06",
        "The instructions of a plain query, and of a tracker's tick with side and depth, have a bound that is proven from the \
         linked program.",
        &[
            "bound.above",
            "bound.broken",
            "bound.unnoticed",
            "bound.sphere.ratio",
            "bound.capsule.ratio",
        ],
    ),
    requirement(
        "A-07",
        "A query without an answer names the cause. A position that is not finite is named, or the answer is finite.",
        &[],
    ),
    requirement(
        "A-08",
        "A tree over several surfaces that share no vertex has the answers of exhaustive search, however they move apart.",
        &[],
    ),
    requirement(
        "A-09",
        "Chains of tools and scenes of surfaces have the answers of single queries.",
        &[],
    ),
    requirement("A-10", "A sweep passes over no contact between two ticks.", &[]),
    requirement(
        "A-11",
        "Answers have the same bits on every processor, in every build.",
        &["bits.different", "processors.m55.different", "processors.riscv.different"],
    ),
    requirement("A-12", "An answer names its triangle, and that triangle's label.", &[]),
    requirement(
        "S-01",
        "A side is right, or undefined with its reason.",
        &["sides.wrong", "sides.undefined"],
    ),
    requirement(
        "S-02",
        "The separation is the least signed distance of the tool's axis to any solid, and changes by at most what tool and \
         surface move.",
        &[],
    ),
    requirement(
        "S-03",
        "The depth of a crossing axis is that of its deepest point. Where a limit on work ends the search, the interval holds \
         it.",
        &[],
    ),
    requirement(
        "S-04",
        "A list of contacts lacks no wall within its margin, and has none twice.",
        &[],
    ),
    requirement(
        "S-05",
        "A list that is too short for all contacts states how far it is complete.",
        &[
            "listed.40k.without",
            "listed.60k.without",
            "listed.100k.without",
            "listed.shaft.without",
        ],
    ),
    requirement("S-06", "A contact's velocity row is the rate of its separation.", &[]),
    requirement(
        "T-01",
        "A tracker answers every tick as a whole query does: separation, side, depth and contacts.",
        &["m7.track.apart", "m7.track.fallbacks", "m7.track.modes.apart"],
    ),
    requirement(
        "T-02",
        "A tick within any budget has an interval that holds the true separation, and keeps what was certain, less the motion \
         since.",
        &[
            "bounded.wrong",
            "bounded.damped",
            "bounded.idle",
            "bounded.60k.95",
            "bounded.100k.95",
            "dearer.wrong",
            "dearer.damped",
            "dearer.idle",
            "dearer.human.wrong",
            "dearer.human.damped",
            "dearer.human.idle",
            "shaft.wrong",
            "shaft.damped",
            "shaft.idle",
            "listed.wrong",
            "listed.40k.idle",
            "listed.60k.idle",
            "listed.100k.idle",
        ],
    ),
    requirement("T-03", "Where triangles tie, the direction does not turn to and fro.", &[]),
    requirement("T-04", "The motion by which bounds run out is never understated.", &[]),
    requirement(
        "F-01",
        "A query reads one whole frame, whatever is written meanwhile; neither end waits for the other.",
        &["torn.mixed", "frames.interleavings"],
    ),
    requirement(
        "F-02",
        "The measured stretch is never below the true one, and no frame beyond the limit is published.",
        &[],
    ),
    requirement(
        "F-03",
        "A collapsed, mirrored, leaping or wrongly scaled surface is refused by its cause.",
        &[],
    ),
    requirement("F-04", "A surface carries its stretch and its error into every answer.", &[]),
    requirement(
        "F-05",
        "A surface between two frames and beyond the last has a place, a stretch and an error; where it cannot go on it is \
         held, and its lag is stated.",
        &[],
    ),
    requirement("F-06", "A modal surface keeps its bounds on place, stretch and speed.", &[]),
    requirement(
        "F-07",
        "A surface that nodes carry has the answers of the moved mesh. Stretched and inverted elements are refused.",
        &[
            "carried.wrong",
            "carried.uncovered",
            "carried.beyond",
            "m7.nodes.bits",
            "demo.nodes.mismatches",
            "demo.nodes.wrong",
        ],
    ),
    requirement(
        "F-08",
        "A frame with a rigid pose has the answers of the moved mesh. Numbers that are no pose, and poses that leap, are refused.",
        &[],
    ),
    requirement(
        "F-09",
        "The memory of a surface is as documented.",
        &["m7.nodes.ram", "m7.nodes.flash"],
    ),
    requirement(
        "B-01",
        "Only complete and right frames are published, under every loss, order and damage.",
        &[
            "faults.wrong",
            "faults.not-recovered",
            "board.faults.wrong",
            "board.faults.not-recovered",
            "demo.wrong",
        ],
    ),
    requirement("B-02", "A rejection is named by its cause, and counted once.", &[]),
    requirement(
        "B-03",
        "With a key, forged, changed, replayed and misdirected packets are refused.",
        &[],
    ),
    requirement("B-04", "Without the key, strangers steer neither counts nor states.", &[]),
    requirement(
        "B-05",
        "Age, transit and silence are never understated by the receiver's own clock.",
        &[],
    ),
    requirement(
        "B-06",
        "Each error that IEC 61784-3 lists has a measure, and the remaining errors a rate.",
        &[],
    ),
    requirement("B-07", "The bytes on the bus are as specified.", &[]),
    requirement("B-08", "Frames of the same process meet the checks of frames in packets.", &[]),
    requirement(
        "B-09",
        "What a sender sends becomes the receiver's surface over every transport, to the bit or within the stated step.",
        &[],
    ),
    requirement("B-10", "No message of a live source puts a vertex where another one is.", &[]),
    requirement(
        "B-11",
        "Receiving and checking take bounded work for each row and triangle.",
        &["receive.quantised.1024.sum", "m7.nodes.element.quantised"],
    ),
    requirement(
        "C-01",
        "The output is safe before the first acknowledgement, and within the limits after the bus falls silent, the surface \
         ages or the tree changes.",
        &["demo.faults.safe-after-packet", "demo.rot"],
    ),
    requirement(
        "C-02",
        "A force is finite and at most the largest one; without an answer it only damps.",
        &["anytime.too-weak"],
    ),
    requirement(
        "C-03",
        "A wall's force keeps a hand out that pushes with less than the largest force, that of all contacts also in a corner.",
        &["hand.through", "demo.hand.pushed"],
    ),
    requirement(
        "C-04",
        "A wall gives a hand no more energy than its account, and its force does not leap.",
        &[
            "hand.given",
            "hand.step",
            "demo.hand.given",
            "demo.hand.step",
            "demo.nodes.hand.given",
            "demo.nodes.hand.step",
        ],
    ),
    requirement(
        "C-05",
        "No admitted motion comes nearer than the stand-off, unless the reason says that none is safe.",
        &[
            "filter.violations",
            "filter.uncertain",
            "filter.cries",
            "filter.deepest",
            "filter.board.violations",
            "demo.hand.near",
            "demo.hand.commanded",
        ],
    ),
    requirement(
        "C-06",
        "A filter does not brake along a wall or in free space, takes no more than its budget, names bad input, and keeps the caller's rows.",
        &[
            "filter.along",
            "filter.free",
            "filter.mean",
            "filter.over",
            "filter.board.mean",
            "filter.board.most",
            "filter.board.over",
        ],
    ),
    requirement(
        "C-07",
        "A guard answers each tick with the closest pair on the surface as it is now, the velocity between tool and tissue, \
         and the trust in it; a wrong start is named.",
        &[],
    ),
    requirement(
        "C-08",
        "A guard's contacts are a tracker's, within the one budget, and none is acted on without trust.",
        &[],
    ),
    requirement(
        "M-01",
        "A tree's bytes are as specified, and corrupt ones are refused.",
        &["corruption.endless"],
    ),
    requirement(
        "M-02",
        "A tree that changes after its validation causes no panic and no hang, and is found.",
        &["corruption.endless", "corruption.unscrubbed", "demo.rot"],
    ),
    requirement(
        "M-03",
        "A mesh file is read as its program meant it, or refused with its name, the element and the remedy.",
        &["fuzz.findings"],
    ),
    requirement(
        "M-04",
        "The same mesh gives the same bytes, on every machine and number of threads.",
        &[],
    ),
    requirement("M-05", "A mesh far from the origin has the answers of one near it.", &[]),
    requirement("M-06", "Frames of another mesh or in another unit are refused.", &[]),
    requirement(
        "P-01",
        "The firmware has no panic path and no allocator, and the core no unsafe code but the square root.",
        &["panics", "allocators", "h743.tick.panics", "h743.allocators"],
    ),
    requirement(
        "P-02",
        "The stack is bounded by the binary; an overflow stops.",
        &["stack.bound", "stack.overflow-unnoticed", "stack.indirect", "h743.stack"],
    ),
    requirement(
        "P-03",
        "No control tick is missed or late, with the bus busy, faulty or flooded.",
        &[
            "demo.misses",
            "demo.faults.misses",
            "flood.misses",
            "demo.hand.misses",
            "demo.nodes.misses",
            "ticks.longest",
        ],
    ),
    requirement(
        "P-04",
        "No access is out of bounds, and no data race exists.",
        &["sanitizer.address", "sanitizer.thread", "fuzz.findings"],
    ),
    requirement(
        "P-05",
        "The controller does on the host what it does on the board.",
        &["examples.different"],
    ),
    requirement(
        "P-06",
        "The interface in C has the bits of the library, and takes no misuse for use.",
        &["demo.c.mismatches", "demo.c.wrong", "demo.c.misses"],
    ),
    requirement(
        "P-07",
        "The package for Python answers as the library, names wrong input, and leaves Python running.",
        &[],
    ),
    requirement(
        "P-08",
        "The program `dibs` does as it says, names file, element and remedy where it cannot, and replaces no input.",
        &[],
    ),
    requirement("P-09", "The page of a recording shows the bits of `dibs query`.", &[]),
    requirement(
        "P-10",
        "On an STM32H743 code and data of the control tick lie in tightly coupled memory.",
        &["h743.tick.outside", "h743.misplaced"],
    ),
    requirement(
        "P-11",
        "Guide, README and examples are true: a new user comes to an answer by them alone.",
        &["examples.run"],
    ),
    requirement(
        "P-12",
        "The bytes that a board loads are the same wherever the checkout is that they were built in.",
        &[],
    ),
    requirement(
        "E-01",
        "No figure of instructions rises unnoticed.",
        &["m7.warm.mean", "m7.track.mean", "m7.capsule.mean"],
    ),
    requirement(
        "E-02",
        "A record says of which commit and date it is, and a page shows its record.",
        &[],
    ),
    requirement(
        "E-03",
        "Every check and every file of tests has a row in the page of proofs, and a requirement, which every file of the core has, too; \
         each public call of a guard has its failures listed, each assumption of use its check, each known anomaly its place.",
        &[],
    ),
    requirement(
        "E-04",
        "Folders depend one way; public items, sizes and files of packages are those listed.",
        &[],
    ),
    requirement(
        "E-05",
        "The comparison with other libraries has methods that agree, and statistics as in textbooks.",
        &[],
    ),
    requirement(
        "E-06",
        "Statements and branches of the core that no test executes are counted and listed.",
        &[],
    ),
];
