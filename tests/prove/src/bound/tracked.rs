//! The flow facts of a tracker's tick within a budget: the closest pair, unsigned, on a surface that moves.

// Requirement: A-06

use super::facts::{
    CHILD_LINE, COPIES, Count, EIGHT_CHILDREN, Fact, Facts, KEPT, MOVES_FOR_EACH_ENTRY, Most,
    NO_SIDE, NO_TIES, Never, OTHERS, ROOT_MOVE, ROOT_TURN, SEARCH, TEST, TRIANGLE_LINE,
    TURNS_OF_A_LEAF, VISITS_OF_LEAVES, WAITING_ENTRIES, WARM, WITHOUT_EDGE,
};
use super::lines::Within::{self, Function, Line, Of};

/// Places of the front.
pub const SLOTS: i64 = probe::track::OPENED as i64;

/// For a tracker that was never asked for a side.
pub const TRACKED: Facts = Facts {
    groups: &[COUNTED, TICK, WHOLE, COPIES, KEPT],
    never: &[NO_SIDE, NO_TIES, NOTHING_CERTAIN, NO_DIRECTION],
};

/// The same with a wrong fact, which a trace must refute.
pub const TRACKED_WITHOUT_EDGES: Facts = Facts {
    groups: &[COUNTED, TICK, WHOLE, COPIES, KEPT],
    never: &[NO_SIDE, NO_TIES, NOTHING_CERTAIN, NO_DIRECTION, WITHOUT_EDGE],
};

const NOTHING_CERTAIN: Never = (
    "keep_certain",
    "",
    "an answer without a side leaves no certain interval of a signed distance",
);

const NO_DIRECTION: Never =
    ("track::closest", "take_tied", "no tick had a side, so none left its direction");

const FILE: &str = "dibs-nostd/src/query/search/tick.rs";
const FRONT: &str = "dibs-nostd/src/query/memory/front.rs";

pub(super) const SEEN: Count =
    Count::Passes(&[Line(FILE, "if self.is_priced && self.search.meter.nodes(VISIT).is_none() {")]);
const DUE: Count =
    Count::Calls(&[Line(FILE, "if let Expansion::OutOfBudget = self.test_due(at)? {")], "test_due");
const OPENED: Count = Count::Calls(
    &[Line(FILE, "if let Expansion::OutOfBudget = self.test_due(opened)? {")],
    "test_due",
);
pub(super) const DUE_CHILD: Count = Count::Passes(&[Line(FILE, "if own > search.cutoff {")]);
pub(super) const DUE_PLANE: Count = Count::Calls(&[Function("test_children")], "Plane::excess");
pub(super) const DUE_TURN: Count =
    Count::Passes(&[Line(FILE, "if triangle == self.search.best_triangle {")]);
pub(super) const DUE_TRIANGLE: Count =
    Count::Passes(&[Line(FILE, "if facing > self.facing.within {")]);
pub(super) const DUE_TEST: Count = Count::Calls(&[Function("test_triangles")], "closest_to_");
const DUE_PUSH: Count = Count::Passes(&[
    Line(FILE, "search.push(base, WaitingNode { lower: own, link }).ok_or(corrupt)?;"),
    Line(super::facts::NODE, "*self.stack.get_mut(at)? = subtree;"),
]);
const DUE_SHIFT: Count = Count::Passes(&[
    Line(FILE, "search.push(base, WaitingNode { lower: own, link }).ok_or(corrupt)?;"),
    Line(super::facts::NODE, "*self.stack.get_mut(at)? = below;"),
]);
pub(super) const CLOSED_SLOT: Count = Count::Passes(&[Line(
    FILE,
    "if own.units_after(self.threshold()).saturating_mul(2) >= left {",
)]);
pub(super) const WHOLE_CHILD: Count = Count::Passes(&[Of("expand", "Capsule"), CHILD_LINE]);
pub(super) const WHOLE_LEAF_PLANE: Count =
    Count::Calls(&[Of("run", "Capsule"), Function("expand")], "Plane::beyond");
pub(super) const WHOLE_VISIT: Count =
    Count::Calls(&[Of("run", "Capsule"), Function("leaf")], "Plane::beyond");
pub(super) const WHOLE_TRIANGLE: Count = Count::Passes(&[Of("run", "Capsule"), TRIANGLE_LINE]);
const WAITING: &[Within] = &[
    Function("visit"),
    Line(
        FILE,
        "let &WaitingNode { lower, link: word } = self.search.stack.get(top).ok_or(corrupt)?;",
    ),
];
const EIGHTS: &[Within] =
    &[Line(FRONT, "let passed = 8 * eights.iter().take_while(waits).count();")];
const ONES: &[Within] = &[Line(
    FRONT,
    "let at = due.get(passed..)?.iter().position(|&due| !threshold.is_before(due))?;",
)];
const EXCESS: &[Within] = &[Function("excess")];
const ROOTS: &[Within] = &[Line(FILE, "for row in 0..=self.search.tree.header().other_roots {")];

/// What the budget of a tick counts, twice: of the front, of a whole query where that is full, and by more terms.
macro_rules! node_tests {
    ($($more:expr),* $(,)?) => {
        &[
            (6, SEEN),
            (2, DUE_CHILD),
            (6, DUE_PLANE),
            (2, DUE_TURN),
            (2, DUE_TRIANGLE),
            (2, CLOSED_SLOT),
            (3, WHOLE_CHILD),
            (3, WHOLE_LEAF_PLANE),
            (3, WHOLE_VISIT),
            (3, WHOLE_TRIANGLE),
            $($more),*
        ]
    };
}
pub(super) use node_tests;

const COUNTED: &[Fact] = &[
    Fact {
        name: "node tests",
        terms: node_tests!(),
        most: Most { base: 6, roots: 0, nodes: 2, triangles: 0 },
        because: "twice what the meter counts: a visit of a slot as 3, the last of which may be beyond the budget, a child as 1, its \
                  plane as 3, a due triangle and its plane as 1 each; a test of a whole query as 1 and a half",
    },
    Fact {
        name: "triangle tests",
        terms: &[(1, TEST), (1, WARM), (1, DUE_TEST)],
        most: Most { base: 0, roots: 0, nodes: 0, triangles: 1 },
        because: "the meter counts each exact test before its call, the warm ones too",
    },
];

/// Of the front.
pub(super) const TICK: &[Fact] = &[
    Fact {
        name: "slots passed over, eight at a time",
        terms: &[(1, Count::Heads(EIGHTS)), (-1, DUE)],
        most: Most::base(SLOTS / 8 + 3),
        because: "a turn for each eight that wait, and one where a due slot or the end is; two ranges have an end",
    },
    Fact {
        name: "slots passed over, one at a time",
        terms: &[(1, Count::Heads(ONES)), (-9, DUE)],
        most: Most::base(27),
        because: "a due slot is one of eight, and fewer than eight are left at the end of a range",
    },
    Fact {
        name: "ends of a range",
        terms: &[(
            1,
            Count::Passes(&[Line(FILE, "let Some(next) = before.take() else { break };")]),
        )],
        most: Most::base(2),
        because: "the slots after the one where the last tick ended, then those before it",
    },
    Fact {
        name: "visits without a price",
        terms: &[(1, DUE), (1, OPENED), (-1, SEEN)],
        most: Most::base(1),
        because: "only a slot that does not exist has none, and that error ends the tick",
    },
    Fact {
        name: "children to be opened",
        terms: &[(1, Count::Heads(WAITING)), (-1, DUE_PUSH), (-1, DUE)],
        most: Most::base(1),
        because: "a turn for each child that was pushed",
    },
    Fact {
        name: "moves for each child",
        terms: &[(2, DUE_SHIFT), (-7, DUE_PUSH)],
        most: Most::base(0),
        because: "a node's entries are sorted among themselves: k of them take at most k (k - 1) / 2 moves, and k is at most 8",
    },
    Fact {
        name: "children put back",
        terms: &[(1, Count::Heads(&[Function("put_back_waiting")])), (-1, DUE_PUSH)],
        most: Most::base(1),
        because: "those that wait were pushed",
    },
    Fact {
        name: "slots counted",
        terms: &[(1, Count::Heads(&[Function("count_due")]))],
        most: Most::base(SLOTS + 1),
        because: "a turn for each slot, once in a tick",
    },
    Fact {
        name: "slots compared",
        terms: &[(1, Count::Heads(&[Function("first")]))],
        most: Most::base(SLOTS + 1),
        because: "a turn for each slot, once where the budget ends",
    },
    Fact {
        name: "triangles of a child's plane",
        terms: &[(1, Count::Heads(EXCESS)), (-8, Count::Entries(EXCESS))],
        most: Most::base(0),
        because: "a leaf has at most eight triangles, of which the first is before the loop; one turn where they end",
    },
    Fact {
        name: "opened roots",
        terms: &[(1, Count::Heads(ROOTS))],
        most: Most { base: 2, roots: 1, nodes: 0, triangles: 0 },
        because: "a turn for each root of an empty front, and one where they end",
    },
];

const TWICE_FOR_EACH_ROOT: Most = Most { base: 0, roots: 2, nodes: 0, triangles: 0 };

/// Of a whole query, in a tick whose front is full.
const WHOLE: &[Fact] = &[
    EIGHT_CHILDREN,
    MOVES_FOR_EACH_ENTRY,
    WAITING_ENTRIES,
    TURNS_OF_A_LEAF,
    VISITS_OF_LEAVES,
    Fact {
        name: "the first entries",
        terms: &[(1, Count::Heads(&[Line(SEARCH, "search.push(0, subtree)"), Function("push")]))],
        most: Most { base: 2, roots: 2, nodes: 0, triangles: 0 },
        because: "the roots are pushed upon each other, and the first upon the others, in the tick and in the whole query",
    },
    Fact {
        name: "trees of several roots",
        terms: &[(1, OTHERS)],
        most: TWICE_FOR_EACH_ROOT,
        because: "the further roots have a call, if there are any, in the tick and in the whole query",
    },
    Fact {
        name: "turns of the roots",
        terms: &[(1, ROOT_TURN), (-1, OTHERS)],
        most: TWICE_FOR_EACH_ROOT,
        because: "one for each further root, and one where they end",
    },
    Fact {
        name: "moves of roots",
        terms: &[(1, ROOT_MOVE)],
        most: Most { base: 0, roots: 62, nodes: 0, triangles: 0 },
        because: "the k-th moves at most the k - 1 before it, and a tree has at most 63 of them",
    },
];
