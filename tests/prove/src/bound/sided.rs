//! The flow facts of a query with side, on a table of vertices and a tree of one root: for the searches, and for the side
//! of a point.

// Requirement: A-06

use super::facts::{
    CHILD, COPIES, Count, EIGHT_CHILDREN, Fact, Facts, LEAF_PLANE, MOVES_FOR_EACH_ENTRY, Most,
    Never, PUSH, SEARCH, TEST, TRIANGLE, TURN, VISIT, WARM, WITHOUT_EDGE,
};
use super::lines::Within::{self, Function, Line, Of};

/// Most triangles around a vertex of a surface with a bound. (The walks themselves end after 256.)
pub const RING: u32 = 16;

/// For a sphere, whose axis is a point: it has no depth.
pub const SIDED_SPHERE: Facts = Facts {
    groups: &[COUNTED, SEARCHES, SIDE_OF_POINT, IN_F32, IN_F64, COPIES],
    never: &[ONE_SOLID, ONE_ROOT, CLOSED],
};

/// For a capsule whose axis is outside: no depth is searched.
pub const SIDED_CAPSULE: Facts = Facts {
    groups: &[COUNTED, SEARCHES, SIDE_OF_POINT, IN_F32, IN_F64, COPIES],
    never: &[ONE_SOLID, ONE_ROOT, CLOSED, NO_DEPTH, NO_MEMORY, NO_TOUCHES],
};

/// The same with a wrong fact, which a trace must refute.
pub const SIDED_WITHOUT_EDGES: Facts = Facts {
    groups: &[COUNTED, SEARCHES, SIDE_OF_POINT, IN_F32, IN_F64, COPIES],
    never: &[ONE_SOLID, ONE_ROOT, CLOSED, NO_DEPTH, NO_MEMORY, NO_TOUCHES, WITHOUT_EDGE],
};

pub(super) const ONE_SOLID: Never =
    ("query::separation::signed", "solids::signed", "the tree has one root");
pub(super) const ONE_ROOT: Never = ("", "Roots::with_others", "the tree has one root");

pub(super) const CLOSED: Never = ("side::of_point", "is_crowded", "the surface is closed");

const NO_DEPTH: Never = (
    "query::separation::signed",
    "Depth<I,V,T>::run",
    "the axis neither crosses the surface nor is inside",
);

const NO_MEMORY: Never =
    ("query::separation::signed", "KnownDepthMut::now", "a query remembers no earlier tick");

const NO_TOUCHES: Never = (
    "query::separation::signed",
    "__aeabi_memclr",
    "it clears the memory for a depth, of an axis that crosses the surface or is inside",
);

const TIES: &str = "dibs-nostd/src/query/search/ties.rs";
const SIDE: &str = "dibs-nostd/src/query/side.rs";
const EXACT: &str = "dibs-nostd/src/query/exact.rs";
const NORMAL: &str = "dibs-nostd/src/query/normal.rs";

pub(super) const POPS: &str = "while let Some(WaitingNode { lower, link }) = self.pop() {";
pub(super) const SEARCH_POPS: &[Within] = &[Line(SEARCH, POPS)];
pub(super) const TIE_POPS: &[Within] = &[Line(TIES, POPS)];
const SEARCHED: Count = Count::Entries(SEARCH_POPS);
pub(super) const TIE_TEST: Count = Count::Calls(&[Function("each_tie")], "closest_to_");
const TIE_TURNS: &[Within] = &[Line(TIES, "if self.meter.triangle().is_none() {")];
const FIRST_PUSH: &[Within] = &[Line(SEARCH, "search.push(0, subtree)"), Function("push")];

const ACROSS: &[Within] = &[Function("across")];
const EDGE: Within = Line(EXACT, "for (edge, along, from, to) in [(0, ab, a, b)");
const AROUND: &[Within] = &[Line(
    EXACT,
    "(at, corner) = self.tree.next_around(at, corner).ok_or(NoSide::OpenBoundary)?;",
)];
const RING_LINE: Within =
    Line(EXACT, "let Some((next, next_corner)) = self.tree.next_around(row, corner) else {");
const TURNED: Within = Line(EXACT, "let cosine = -P::dot(to_centre, edge);");
pub(super) const TURNED_F32: Count = Count::Passes(&[Of("add", "f32>"), TURNED]);
pub(super) const TURNED_F64: Count = Count::Passes(&[Of("add", "f64>"), TURNED]);
const OTHER: Within = Line(EXACT, "Ok(seen.above_edge(&self.see(other)?))");
pub(super) const ACROSS_F32: Count = Count::Passes(&[Of("add", "f32>"), OTHER]);
pub(super) const ACROSS_F64: Count = Count::Passes(&[Of("add", "f64>"), OTHER]);
pub(super) const ADDED_F32: Count = Count::Calls(&[Of("add", "f32>")], "::closest");
pub(super) const ADDED_F64: Count = Count::Calls(&[Of("add", "f64>")], "::closest");
pub(super) const NORMALS: &[Within] = &[Line(NORMAL, "for _ in 0..MAX_RING {")];
const PLANES: &[Within] = &[Line(SIDE, "for row in rows {")];
pub(super) const OUTWARD: Count = Count::Calls(&[Function("outward")], "pseudonormal");
pub(super) const ROUGH: &[Within] = &[Line(SIDE, "let above = rough.of(rows)?;")];
pub(super) const FINE: &[Within] = &[Line(SIDE, "let above = fine.of(again)?;")];
const DROP: &[Within] = &[Line(TIES, "self.rows.retain(|tie| tie.square <= self.limit);")];

/// What waits in searches with a side, the query's own and those for ties, and more terms for other searches: each entry
/// that was pushed is taken once.
macro_rules! waiting_entries {
    ($($more:expr),* $(,)?) => {
        &[
            (1, Count::Heads(&[Function("least_waiting")])),
            (1, Count::Heads(SEARCH_POPS)),
            (1, Count::Heads(TIE_POPS)),
            (-1, PUSH),
            (-3, Count::Entries(SEARCH_POPS)),
            (-3, Count::Entries(TIE_POPS)),
            $($more),*
        ]
    };
}
pub(super) use waiting_entries;

/// What a query counts, and what waits in its searches: its own, and those for ties.
const COUNTED: &[Fact] = &[
    Fact {
        name: "node tests",
        terms: &[
            (1, CHILD),
            (1, LEAF_PLANE),
            (1, VISIT),
            (1, TRIANGLE),
            (1, TIE_TEST),
            (4, ADDED_F32),
            (136, ADDED_F64),
            (3, TURNED_F32),
            (68, TURNED_F64),
            (3, ACROSS_F32),
            (68, ACROSS_F64),
        ],
        most: Most { base: 0, roots: 0, nodes: 1, triangles: 0 },
        because: "counted by the meter as in a plain query; the side's work is counted before it is done, as 4 for a triangle and 3 \
                  for one across an edge or around a vertex, in f64 136 and 68",
    },
    Fact {
        name: "triangle tests",
        terms: &[(1, TEST), (1, WARM), (1, TIE_TEST)],
        most: Most { base: 0, roots: 0, nodes: 0, triangles: 1 },
        because: "the meter counts each exact test before its call, the warm ones and those of ties too",
    },
    Fact {
        name: "waiting entries",
        terms: waiting_entries!(),
        most: Most::base(0),
        because: "what waits was pushed and not popped; each search pushes the root before; each loop has a turn more where it ends",
    },
];

/// Of all searches.
pub(super) const SEARCHES: &[Fact] = &[
    EIGHT_CHILDREN,
    MOVES_FOR_EACH_ENTRY,
    Fact {
        name: "turns of a leaf",
        terms: &[(1, TURN), (-1, TRIANGLE), (-1, VISIT), (-1, SEARCHED)],
        most: Most::base(0),
        because: "only the best triangle is passed over without a count, at most once a visit; out of budget the search ends",
    },
    Fact {
        name: "turns of a leaf of ties",
        terms: &[(1, Count::Heads(TIE_TURNS)), (-1, TIE_TEST), (-1, Count::Entries(TIE_TURNS))],
        most: Most::base(0),
        because: "each turn tests a triangle, unless the budget ends the search",
    },
    Fact {
        name: "visits of leaves",
        terms: &[(1, VISIT), (-1, LEAF_PLANE), (-1, SEARCHED)],
        most: Most::base(0),
        because: "a leaf waits once its plane did not reject it, except a root, and where the budget cannot cover its visit \
                  either",
    },
    Fact {
        name: "the first entry",
        terms: &[(1, Count::Heads(FIRST_PUSH)), (-1, Count::Entries(FIRST_PUSH))],
        most: Most::base(0),
        because: "a search's stack is empty when the root is pushed",
    },
    Fact {
        name: "ties that make room",
        terms: &[(1, Count::Heads(DROP)), (-34, Count::Calls(&[], "Ties::drop_farther"))],
        most: Most::base(0),
        because: "a list has at most 32 ties, which two loops share; each loop has a turn more where it ends",
    },
];

/// Of the side of a point whose closest triangles are known.
pub(super) const SIDE_OF_POINT: &[Fact] = &[
    Fact {
        name: "rows of one code",
        terms: &[(1, Count::Heads(ACROSS)), (-5, Count::Entries(ACROSS))],
        most: Most::base(0),
        because: "at most four triangles of a tree of 16-bit indices share the low bits of their row; one turn where they end",
    },
    Fact {
        name: "planes of ties",
        terms: &[(1, Count::Heads(PLANES)), (-33, Count::Entries(PLANES))],
        most: Most::base(0),
        because: "a list has at most 32 ties; one turn where they end",
    },
    Fact {
        name: "the first around a vertex",
        terms: &[(1, Count::Heads(AROUND)), (-(RING as i64), Count::Entries(AROUND))],
        most: Most::base(0),
        because: "one turn for each triangle around the vertex",
    },
    Fact {
        name: "normals around a vertex",
        terms: &[(1, Count::Heads(NORMALS)), (-(RING as i64), Count::Entries(NORMALS))],
        most: Most::base(0),
        because: "one turn for each triangle around the vertex",
    },
    Fact {
        name: "normals of a walked vertex",
        terms: &[
            (1, Count::Heads(NORMALS)),
            (-1, TURNED_F32),
            (-1, TURNED_F64),
            (-(RING as i64), OUTWARD),
            (-(RING as i64), Count::Entries(ROUGH)),
            (-(RING as i64), Count::Entries(FINE)),
            (-(RING as i64), Count::Entries(TIE_POPS)),
        ],
        most: Most::base(0),
        because: "those of a direction, and those that confirm a vertex after the walk along its edges, which ends early only \
                  where the budget does: the ties end there",
    },
    Fact {
        name: "flat triangles",
        terms: &[(1, Count::Calls(&[], "normal::flat_normal"))],
        most: Most::base(0),
        because: "no triangle has a corner of a sine below 1 in 1,024, or an area whose square leaves f32",
    },
];

/// Facts of the side's exact comparison, in f32 or f64: how the names of its functions end, how those of the facts end, and
/// the loop over ties.
macro_rules! exact {
    ($of:literal, $in:literal, $start:ident) => {
        &[
            Fact {
                name: concat!("edges of a triangle", $in),
                terms: &[
                    (1, Count::Heads(&[Of("closest", $of), EDGE])),
                    (-4, Count::Entries(&[Of("closest", $of), EDGE])),
                ],
                most: Most::base(0),
                because: "a triangle has three; one turn where they end",
            },
            Fact {
                name: concat!("deciding ties", $in),
                terms: &[
                    (1, Count::Heads($start)),
                    (-33, Count::Entries($start)),
                ],
                most: Most::base(0),
                because: "a list has at most 32 ties, each passed over or added; one turn where they end",
            },
            Fact {
                name: concat!("edges around a vertex", $in),
                terms: &[
                    (1, Count::Heads(&[Of("add", $of), RING_LINE])),
                    (-(RING as i64), Count::Entries(&[Of("add", $of), RING_LINE])),
                ],
                most: Most::base(0),
                because: "one turn for each triangle around the vertex",
            },
        ]
    };
}

pub(super) const IN_F32: &[Fact] = exact!("f32>", "", ROUGH);
pub(super) const IN_F64: &[Fact] = exact!("f64>", ", in f64", FINE);
