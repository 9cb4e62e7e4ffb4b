//! The flow facts: bounds on how often parts of the search's code are executed, each with its reason. All other
//! information is read from the program.
//!
//! A fact is an inequality. It counts calls, which a compiler does not move or invent, loop headers, and the branches
//! of a line in the innermost loop that contains any part of the line: loop-invariant parts are moved out, but the
//! branch on a loop-variant value stays. A part that no longer exists is an error. Traces check that a fact holds in
//! the compiled program, if they execute what it limits; the page names the others.

// Requirement: A-06

use super::lines::Within::{self, Function, Line};

/// Something whose executions are counted.
#[derive(Clone, Copy, Debug)]
pub enum Count {
    /// The first blocks in these frames, in the innermost loop that contains any.
    Passes(&'static [Within]),
    /// Calls, in these frames, of a function whose name contains this.
    Calls(&'static [Within], &'static str),
    /// Headers of loops in these frames: one for each iteration. For loops within such a loop, the back edges: the
    /// compiler makes a separate loop of the iterations that end early.
    Heads(&'static [Within]),
    /// Entries to these loops.
    Entries(&'static [Within]),
    /// Bytes copied or cleared, by the constant in this register at each call of a function whose name contains this.
    Bytes(&'static str, u32),
}

/// The right side of an inequality: a constant, plus so much for each of a query's counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Most {
    pub base: i64,
    /// For each root besides the first.
    pub roots: i64,
    /// For each node test that the budget counts.
    pub nodes: i64,
    /// For each triangle test.
    pub triangles: i64,
}

impl Most {
    pub(super) const fn base(base: i64) -> Self {
        Self { base, roots: 0, nodes: 0, triangles: 0 }
    }

    /// The right side for a query with this many further roots, node tests and triangle tests.
    pub const fn of(&self, [roots, nodes, triangles]: [i64; 3]) -> i64 {
        self.base + self.roots * roots + self.nodes * nodes + self.triangles * triangles
    }

    pub const fn each(&self) -> [i64; 4] {
        [self.base, self.roots, self.nodes, self.triangles]
    }
}

pub struct Fact {
    pub name: &'static str,
    pub terms: &'static [(i64, Count)],
    pub most: Most,
    pub because: &'static str,
}

/// A call that is never made: the end of the caller's name, a part of the callee's name, and the reason.
pub type Never = (&'static str, &'static str, &'static str);

/// The facts of a kind of query.
pub struct Facts {
    pub groups: &'static [&'static [Fact]],
    pub never: &'static [Never],
}

impl Facts {
    pub fn rows(&self) -> impl Iterator<Item = &'static Fact> {
        self.groups.iter().copied().flatten()
    }
}

pub(super) const NO_SIDE: Never = ("query::separation::signed", "", "the query asks for no side");
pub(super) const NO_TIES: Never = (
    "",
    "Ties::drop_farther",
    "without a side `tie_squared` is not a number, and no triangle is collected",
);

/// For a plain query: unsigned.
pub const PLAIN: Facts = Facts { groups: &[ROWS, COPIES], never: &[NO_SIDE, NO_TIES] };

/// The same on a surface between two frames.
pub const MOVING: Facts = Facts { groups: &[ROWS, COPIES, KEPT], never: &[NO_SIDE, NO_TIES] };

/// The same on a surface that nodes move.
pub const EMBEDDED: Facts =
    Facts { groups: &[ROWS, COPIES, KEPT, NAMED], never: &[NO_SIDE, NO_TIES] };

/// The same on a surface that [`MODES`] modes move.
pub const MODAL: Facts =
    Facts { groups: &[ROWS, COPIES, KEPT, NAMED, BLENDED], never: &[NO_SIDE, NO_TIES] };

/// The same with a wrong fact, which a trace must refute.
pub const WITHOUT_EDGES: Facts =
    Facts { groups: &[ROWS, COPIES], never: &[NO_SIDE, NO_TIES, WITHOUT_EDGE] };

pub(super) const WITHOUT_EDGE: Never = ("", "edge::edge_to_segment", "wrong");

/// Functions that a program must only call from these callers, because the facts about them are about those calls.
pub const ONLY_FROM: &[(&str, &str)] = &[("mem::memcpy", "__aeabi_memcpy4")];

pub(super) const NODE: &str = "dibs-nostd/src/query/search/node.rs";
const LEAF: &str = "dibs-nostd/src/query/search/leaf.rs";
const ROOTS: &str = "dibs-nostd/src/query/search/roots.rs";
pub(super) const PLANE: &str = "dibs-nostd/src/query/plane.rs";
const SURFACE: &str = "dibs-nostd/src/modes/surface.rs";
pub(super) const SEARCH: &str = "dibs-nostd/src/query/search.rs";

pub(super) const CHILD_LINE: Within = Line(NODE, "if squared > far * far {");
pub(super) const TRIANGLE_LINE: Within = Line(LEAF, "if patch_plane.has_beyond(a) &&");

pub(super) const CHILD: Count = Count::Passes(&[CHILD_LINE]);
pub(super) const LEAF_PLANE: Count =
    Count::Calls(&[Function("run"), Function("expand")], "Plane::beyond");
pub(super) const VISIT: Count = Count::Calls(&[Function("run"), Function("leaf")], "Plane::beyond");
pub(super) const TRIANGLE: Count = Count::Passes(&[Function("run"), TRIANGLE_LINE]);
pub(super) const TURN: Count =
    Count::Passes(&[Function("run"), Line(LEAF, "if triangle == self.best_triangle {")]);
pub(super) const TEST: Count =
    Count::Calls(&[Function("leaf"), Function("test_triangle")], "closest_to_");
pub(super) const WARM: Count =
    Count::Calls(&[Function("start"), Function("test_triangle")], "closest_to_");
const POP: Count =
    Count::Heads(&[Line(SEARCH, "while let Some(WaitingNode { lower, link }) = self.pop() {")]);
pub(super) const PUSH: Count = Count::Passes(&[
    Line(NODE, "self.push(base, WaitingNode { lower, link: node.link }).ok_or(corrupt)?;"),
    Line(NODE, "*self.stack.get_mut(at)? = subtree;"),
]);
const SHIFT: Count = Count::Passes(&[
    Line(NODE, "self.push(base, WaitingNode { lower, link: node.link }).ok_or(corrupt)?;"),
    Line(NODE, "*self.stack.get_mut(at)? = below;"),
]);
pub(super) const OTHERS: Count = Count::Calls(&[], "Roots::with_others");
pub(super) const ROOT_TURN: Count = Count::Heads(&[Line(ROOTS, "for row in others.filter(")]);
pub(super) const ROOT_MOVE: Count = Count::Passes(&[Line(ROOTS, "*stack.get_mut(at)? = nearer;")]);
const FOR_EACH_ROOT: Most = Most { base: 0, roots: 1, nodes: 0, triangles: 0 };
const BLEND: &[Within] = &[Line(SURFACE, "for (&gain, mode) in self.gains")];
const SCAN: &[Within] = &[Line(PLANE, "for (before, [_, _, corner]) in (1..).zip(triangles)")];
const EXPANSION: Count = Count::Entries(&[Line(NODE, "let position = self.position(node.pin)?;")]);

pub(super) const EIGHT_CHILDREN: Fact = Fact {
    name: "eight children",
    terms: &[(1, CHILD), (-8, EXPANSION)],
    most: Most::base(0),
    because: "a link has three bits for the number of children, less one",
};

pub(super) const MOVES_FOR_EACH_ENTRY: Fact = Fact {
    name: "moves for each entry",
    terms: &[(2, SHIFT), (-7, PUSH)],
    most: Most::base(0),
    because: "a node's entries are sorted among themselves: k of them take at most k (k - 1) / 2 moves, and k is at most 8",
};

pub(super) const WAITING_ENTRIES: Fact = Fact {
    name: "waiting entries",
    terms: &[(1, Count::Heads(&[Function("least_waiting")])), (1, POP), (-1, PUSH)],
    most: Most { base: 3, roots: 1, nodes: 0, triangles: 0 },
    because: "what waits was pushed and not popped; the roots are pushed before; each loop has a turn more where it ends",
};

pub(super) const TURNS_OF_A_LEAF: Fact = Fact {
    name: "turns of a leaf",
    terms: &[(1, TURN), (-1, TRIANGLE), (-1, VISIT)],
    most: Most::base(1),
    because: "only the best triangle is passed over without a count, at most once a visit; out of budget the search ends",
};

pub(super) const VISITS_OF_LEAVES: Fact = Fact {
    name: "visits of leaves",
    terms: &[(1, VISIT), (-1, LEAF_PLANE)],
    most: Most { base: 1, roots: 1, nodes: 0, triangles: 0 },
    because: "a leaf waits once its plane did not reject it, except a root, and where the budget cannot cover its visit \
              either",
};

const ROWS: &[Fact] = &[
    Fact {
        name: "node tests",
        terms: &[(1, CHILD), (1, LEAF_PLANE), (1, VISIT), (1, TRIANGLE)],
        most: Most { base: 0, roots: 0, nodes: 1, triangles: 0 },
        because: "the meter counts a node's children before the first of them, and each plane before its call",
    },
    Fact {
        name: "triangle tests",
        terms: &[(1, TEST), (1, WARM)],
        most: Most { base: 0, roots: 0, nodes: 0, triangles: 1 },
        because: "the meter counts each exact test before its call, the warm one too",
    },
    EIGHT_CHILDREN,
    MOVES_FOR_EACH_ENTRY,
    WAITING_ENTRIES,
    TURNS_OF_A_LEAF,
    VISITS_OF_LEAVES,
    Fact {
        name: "the first entry",
        terms: &[(1, Count::Heads(&[Line(SEARCH, "search.push(0, subtree)"), Function("push")]))],
        most: Most { base: 1, roots: 1, nodes: 0, triangles: 0 },
        because: "the roots are pushed upon each other, and the first upon the others",
    },
    Fact {
        name: "trees of several roots",
        terms: &[(1, OTHERS)],
        most: FOR_EACH_ROOT,
        because: "the further roots have a call, if there are any",
    },
    Fact {
        name: "turns of the roots",
        terms: &[(1, ROOT_TURN), (-1, OTHERS)],
        most: FOR_EACH_ROOT,
        because: "one for each further root, and one where they end",
    },
    Fact {
        name: "moves of roots",
        terms: &[(1, ROOT_MOVE)],
        most: Most { base: 0, roots: 31, nodes: 0, triangles: 0 },
        because: "the k-th moves at most the k - 1 before it, and a tree has at most 63 of them",
    },
];

/// Of copies: the same for every kind of query.
pub(super) const COPIES: &[Fact] = &[
    Fact {
        name: "copied words",
        terms: &[
            (16, Count::Heads(&[Function("__aeabi_memcpy4")])),
            (-1, Count::Bytes("__aeabi_memcpy4", 2)),
        ],
        most: Most::base(0),
        because: "each turn copies four words; the lengths are constants at the calls",
    },
    Fact {
        name: "copied bytes",
        terms: &[
            (1, Count::Heads(&[Function("copy_forward_bytes")])),
            (-3, Count::Calls(&[Function("__aeabi_memcpy4")], "memcpy")),
        ],
        most: Most::base(0),
        because: "memcpy4 leaves at most three bytes to memcpy",
    },
    Fact {
        name: "no words left",
        terms: &[(1, Count::Heads(&[Function("copy_forward_aligned_words")]))],
        most: Most::base(0),
        because: "memcpy4 leaves at most three bytes to memcpy",
    },
    Fact {
        name: "no words left to shift",
        terms: &[(1, Count::Heads(&[Function("copy_forward_misaligned_words")]))],
        most: Most::base(0),
        because: "memcpy4 leaves at most three bytes to memcpy",
    },
];

/// Of memory that is cleared.
pub(super) const CLEARS: &[Fact] = &[
    Fact {
        name: "cleared words",
        terms: &[
            (16, Count::Heads(&[Function("__aeabi_memset4")])),
            (4, Count::Heads(&[Function("set_bytes_words")])),
            (-1, Count::Bytes("__aeabi_memclr", 1)),
        ],
        most: Most::base(0),
        because: "each turn clears four words, or one or more; the lengths are constants at the calls",
    },
    Fact {
        name: "no bytes left to clear",
        terms: &[(1, Count::Heads(&[Function("set_bytes_bytes")]))],
        most: Most::base(0),
        because: "at most three bytes are no word; a turn clears four",
    },
];

/// Modes of a surface that they move.
pub const MODES: usize = 8;

const BLENDED: &[Fact] = &[Fact {
    name: "modes of a position",
    terms: &[(1, Count::Heads(BLEND)), (-(MODES as i64 + 1), Count::Entries(BLEND))],
    most: Most::base(0),
    because: "one turn for each mode, and one where they end",
}];

/// If a position takes more than a load, the compiler keeps this loop, which it otherwise unrolls.
pub(super) const KEPT: &[Fact] = &[Fact {
    name: "triangles of a plane",
    terms: &[(1, Count::Heads(SCAN)), (-8, Count::Entries(SCAN))],
    most: Most::base(0),
    because: "a leaf has at most eight triangles, of which the first is before the loop; one turn where they end",
}];

/// The same holds for this loop, unless computing the position is short.
const NAMED: &[Fact] = &[Fact {
    name: "corners that are not finite",
    terms: &[(1, Count::Heads(&[Function("not_finite")])), (-4, Count::Calls(&[], "not_finite"))],
    most: Most::base(0),
    because: "a triangle has three corners; one turn where they end",
}];
