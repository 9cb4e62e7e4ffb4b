//! Known anomalies: where the library is worse than it should be, or where its promise has a surprising limit.

pub struct Anomaly {
    /// It is never reused for another anomaly.
    pub id: &'static str,
    /// `{id}` stands for the recorded figure of that name.
    pub says: &'static str,
    pub remedy: &'static str,
    /// The file that contains it.
    pub file: &'static str,
}

const fn anomaly(
    id: &'static str,
    says: &'static str,
    remedy: &'static str,
    file: &'static str,
) -> Anomaly {
    Anomaly { id, says, remedy, file }
}

pub const ANOMALIES: &[Anomaly] = &[
    anomaly(
        "K-01",
        "Until the scrub comes by, a bit that flipped in the tree can make a distance too great: {corruption.undetected} % of \
         damages did.",
        "Flash with error correction; idle time for `Bus::work`.",
        "dibs-nostd/src/tree/scrub.rs",
    ),
    anomaly(
        "K-02",
        "After a start that fails for a stack, a metric or a reach, the ends are gone: the next start gives `SplitError`.",
        "None is needed: tree and types decide it, so it shows at a build's first start.",
        "dibs-nostd/src/guard/surface.rs",
    ),
    anomaly(
        "K-03",
        "The proven bound covers plain queries, and a tracker's tick with side and depth. Contacts, forces, filter, `Guard`, `Bus` and the firmware in C have no proof: their flow facts are \
         not written. The longest tick measured was {ticks.longest} instructions.",
        "Leave room in the tick; measure your own.",
        "tests/prove/src/bound/mod.rs",
    ),
    anomaly(
        "K-04",
        "A proven node test of a sphere costs {bound.sphere.ratio} times the typical one, where a capsule's constants keep the goal of \
         1.6: {bound.sphere.node-test} instructions where two planes scan a leaf in vain. No other scan was tried.",
        "Budgets of spheres by proven constants do less.",
        "dibs-nostd/src/query/plane.rs",
    ),
    anomaly(
        "K-05",
        "Flow facts of the proof that limit code that no trace executes are not tried: among them those of ties, vertices and f64 in \
         ticks with side and depth, and of further roots where nodes carry the surface.",
        "docs/evidence/bound.md names them.",
        "tests/prove/src/bound/facts.rs",
    ),
    anomaly(
        "K-06",
        "All contacts within 5 mm cost {m7.track.contacts.mean} instructions in the mean tick, {m7.track.contacts.largest} at most: \
         a budget below that leaves the list open.",
        "A smaller margin; the closest pair alone.",
        "dibs-nostd/src/query/tracker/contacts.rs",
    ),
    anomaly(
        "K-07",
        "Of the list of a query or a tracker, `ContactIter::is_complete` compares the margin alone, without the answer's accuracy: a \
         wall that is farther than the margin by less than the accuracy may be missing from a complete list. A guard's list counts \
         how far its surface may be off.",
        "Ask with a margin larger by the accuracy.",
        "dibs-nostd/src/query/contacts/mod.rs",
    ),
    anomaly(
        "K-13",
        "`Bus::send_status_to` loses the status where the stream fails or takes a part.",
        "The next is due after 100 ms.",
        "dibs-nostd/src/guard/line.rs",
    ),
    anomaly(
        "K-14",
        "On a flooded network packets that meet a full buffer are lost, and their frame with them: {flood.rate} frames a second \
         came through.",
        "A network of its own.",
        "firmware-example/src/bin/board/network.rs",
    ),
    anomaly(
        "K-15",
        "Without a key, a line that damages every packet may give a false heartbeat more often than 1e-9 an hour.",
        "A key, or the age alone: docs/black-channel.md.",
        "dibs-nostd/src/receive/collector/heartbeats.rs",
    ),
    anomaly(
        "K-16",
        "The side is undefined at {sides.undefined} % of the poses away from contact; open surfaces, and shells that cut \
         themselves, have the sign of the closest sheet, which can change without contact.",
        "Close the mesh.",
        "dibs-nostd/src/query/side.rs",
    ),
    anomaly(
        "K-17",
        "The direction leaps where two points are equally near or deep, to and fro if noise exceeds the accuracy.",
        "The force of all contacts, `Proxy`.",
        "dibs-nostd/src/control/constraint/forbidden.rs",
    ),
    anomaly(
        "K-18",
        "The controller for an STM32H743 was linked and checked by its binary; it never ran on silicon.",
        "docs/boards.md says what to check first.",
        "examples/stm32h743/src/main.rs",
    ),
    anomaly(
        "K-19",
        "`dibs view --path - --ticks -` reads its input twice, and a commanded push with an unknown outcome is drawn as one by \
         force.",
        "A file for one of them.",
        "dibs-cli/src/view/ticks.rs",
    ),
    anomaly(
        "K-23",
        "`cargo xtask rounding` proves by machine, for spheres as tools: BOUND, DOT, PLANE and COORDINATES of slack.rs, and the \
         rounding of a vertex that nodes carry. The other constants, a capsule's axis, the distances to triangles and the check of \
         an element are derived by hand, and compared with exact answers.",
        "None is needed: no search has found a larger error.",
        "dibs-nostd/src/query/search/slack.rs",
    ),
    anomaly(
        "K-21",
        "A source of OpenIGTLink that repeats an image under new times is taken for fresh: its times must be those of \
         the measurement.",
        "Let the source send the time of its measurement, or none.",
        "dibs-cli/src/stream/part.rs",
    ),
    anomaly(
        "K-22",
        "A vertex that nodes carry costs {m7.nodes.vertex} to {m7.nodes.vertex.between} instructions. On 50,000 triangles a filter \
         with 200,000 shortens many motions: {demo.nodes.hand.shortened} of {demo.nodes.hand.commanded.ticks} in the demo.",
        "A larger budget, or a coarser surface: the tool is slower, and stays outside.",
        "firmware-example/src/control.rs",
    ),
];
