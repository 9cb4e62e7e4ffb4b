//! The flow facts of a tracker's tick with side and depth, within a budget, on a surface that moves and a tree of one root.
//! Facts of the closest pair are in [`tracked`](super::tracked), facts of a point's side in [`sided`](super::sided).
//! Here are those of the depth, which is searched among points of the tool's axis.

// Requirement: A-06

use super::facts::{
    CHILD_LINE, CLEARS, COPIES, Count, Fact, Facts, KEPT, Most, PUSH, TEST, TRIANGLE_LINE, WARM,
    WITHOUT_EDGE,
};
use super::lines::Within::{self, Function, Line, Of};
use super::sided::{
    ACROSS_F32, ACROSS_F64, ADDED_F32, ADDED_F64, CLOSED, FINE, IN_F32, IN_F64, NORMALS, ONE_ROOT,
    ONE_SOLID, OUTWARD, POPS, RING, ROUGH, SEARCH_POPS, SEARCHES, SIDE_OF_POINT, TIE_POPS,
    TIE_TEST, TURNED_F32, TURNED_F64, waiting_entries,
};
use super::tracked::{
    CLOSED_SLOT, DUE_CHILD, DUE_PLANE, DUE_TEST, DUE_TRIANGLE, DUE_TURN, SEEN, TICK, WHOLE_CHILD,
    WHOLE_LEAF_PLANE, WHOLE_TRIANGLE, WHOLE_VISIT, node_tests,
};

const GROUPS: &[&[Fact]] =
    &[COUNTED, TICK, SEARCHES, SIDE_OF_POINT, IN_F32, IN_F64, DEPTH, COPIES, CLEARS, KEPT];

/// For a closed surface.
pub const TRACKED_DEPTH: Facts = Facts { groups: GROUPS, never: &[ONE_SOLID, ONE_ROOT, CLOSED] };

/// The same with a wrong fact, which a trace must refute.
pub const TRACKED_DEPTH_WITHOUT_EDGES: Facts =
    Facts { groups: GROUPS, never: &[ONE_SOLID, ONE_ROOT, CLOSED, WITHOUT_EDGE] };

/// Entries of a search's stack, and of the subtrees that wait from tick to tick.
const STACK: i64 = probe::track::STACK as i64;
/// Most points of an axis, and of those that are remembered.
const POINTS: i64 = 28;
const REMEMBERED: i64 = 20;
/// Most touches, where an axis meets the surface.
const MOST_TOUCHES: i64 = 8;
/// Most leaves around a point.
const LEAVES: i64 = 48;

const DIVISION: &str = "dibs-nostd/src/query/depth/mod.rs";
const SAMPLE: &str = "dibs-nostd/src/query/depth/sample.rs";
const PART: &str = "dibs-nostd/src/query/depth/part.rs";
const START: &str = "dibs-nostd/src/query/depth/start.rs";
const TOUCHES: &str = "dibs-nostd/src/query/depth/touches.rs";
const WALK: &str = "dibs-nostd/src/query/depth/walk.rs";
const AROUND: &str = "dibs-nostd/src/query/search/leaves.rs";
const KNOWN: &str = "dibs-nostd/src/query/memory/depth.rs";

const CHILD: Count = Count::Passes(&[Of("expand", "AxisPoint"), CHILD_LINE]);
const LEAF_PLANE: Count =
    Count::Calls(&[Of("run", "AxisPoint"), Function("expand")], "Plane::beyond");
const VISIT: Count = Count::Calls(&[Of("run", "AxisPoint"), Function("leaf")], "Plane::beyond");
const TRIANGLE: Count = Count::Passes(&[Of("run", "AxisPoint"), TRIANGLE_LINE]);
const BOUNDED_PLANE: Count = Count::Calls(&[Function("leaf_bound")], "Plane::excess");
const BOUNDED_TRIANGLE: Count = Count::Passes(&[Line(
    AROUND,
    "let from_leaf = least(corners.map(|at| plane.normal.dot(at))) - plane.limit;",
)]);
const BOUNDED_TEST: Count = Count::Calls(&[Function("leaf_bound")], "closest_to_");
const KEPT_TEST: Count = Count::Calls(&[Function("take_tied")], "closest_to_");
const LAST_TEST: Count = Count::Calls(&[Function("take_pair")], "closest_to_");

const SEARCH: &str = "Depth<I,V,T>>::search";
const MEASURED: Count = Count::Calls(
    &[Line(SAMPLE, "let Some(mut found) = self.search(&sample, &options, enough)?")],
    SEARCH,
);
const SEARCHED: Count = Count::Calls(&[Function("measure")], SEARCH);
const FOUND: Count =
    Count::Passes(&[Function("measure"), Line(SAMPLE, "self.answer.add_tests(found.tests());")]);
const FOUND_AGAIN: Count = Count::Passes(&[Line(SAMPLE, "found.add_tests(first);")]);
const TIE: Count = Count::Passes(&[Function("clearly_above"), Function("is_above_plane")]);
const TURN: Count = Count::Heads(&[Line(DIVISION, "let row = parts.highest();")]);
const BOUND_DISTANCE: Count = Count::Calls(
    &[Line(
        PART,
        "let squares = |along: f32| [from.square(point(along)), to.square(point(along))];",
    )],
    "closest_to_point",
);
const PASS_DISTANCE: Count = Count::Calls(&[Function("passes")], "closest_to_point");
const TOUCH_DISTANCE: Count = Count::Calls(&[Function("find_touches")], "closest_to_segment");
const HALVING_DISTANCE: Count = Count::Calls(
    &[Line(TOUCHES, "let pair = point.closest_on_triangle(corners, f32::INFINITY);")],
    "closest_to_point",
);
const WALK_DISTANCE: Count = Count::Calls(&[Function("descend")], "closest_to_point");

const GATHER_POPS: &[Within] = &[Line(AROUND, POPS)];
const RESUMED: &[Within] = &[Line(AROUND, "self.push(self.waiting, WaitingNode { lower, link })")];
const LEFT: &[Within] = &[Function("leave")];
const STEPS: &[Within] = &[Line(WALK, "for _ in 0..walk.steps {")];
const NEIGHBOURS: &[Within] = &[Line(WALK, "for row in neighbours.filter(")];
const SWAPPED: &[Within] = &[Function("swap_nonoverlapping_chunks")];
const TOUCHED: &[Within] = &[Function("touched_from")];
const ROOM: Count = Count::Calls(&[], "Leaves::keep_within");

/// A fact about loops of which each has at most so many turns, and one more where they end.
macro_rules! turns {
    ($name:literal, $within:expr, $most:expr, $because:literal) => {
        Fact {
            name: $name,
            terms: &[(1, Count::Heads($within)), (-($most + 1), Count::Entries($within))],
            most: Most::base(0),
            because: concat!($because, "; one turn where they end"),
        }
    };
}

const COUNTED: &[Fact] = &[
    Fact {
        name: "node tests",
        terms: node_tests!(
            (2, CHILD),
            (2, LEAF_PLANE),
            (2, VISIT),
            (2, TRIANGLE),
            (2, TIE_TEST),
            (8, ADDED_F32),
            (272, ADDED_F64),
            (6, TURNED_F32),
            (136, TURNED_F64),
            (6, ACROSS_F32),
            (136, ACROSS_F64),
            (8, BOUNDED_PLANE),
            (2, BOUNDED_TRIANGLE),
            (32, MEASURED),
            (4, TIE),
            (8, TURN),
            (6, BOUND_DISTANCE),
            (6, PASS_DISTANCE),
            (6, TOUCH_DISTANCE),
            (6, HALVING_DISTANCE),
            (8, WALK_DISTANCE),
        ),
        most: Most { base: 242, roots: 0, nodes: 2, triangles: 0 },
        because: "twice what the meter counts: of the closest pair as without a side, of a side as in a query, of a point's search \
                  as in a plain query; a leaf around a point as 4, a point of the axis as 16, a turn of its division as 4, a \
                  distance as 3, in a walk as 4, a triangle whose plane decides a side as 2. Beyond the budget may be the last \
                  slot, the last turn, and 50 for the last triangle that the axis touches; the closest pair's 32 planes are not \
                  counted",
    },
    Fact {
        name: "triangle tests",
        terms: &[
            (1, TEST),
            (1, WARM),
            (1, DUE_TEST),
            (1, TIE_TEST),
            (1, BOUNDED_TEST),
            (1, KEPT_TEST),
            (1, LAST_TEST),
            (1, FOUND),
            (1, FOUND_AGAIN),
            (-1, SEARCHED),
        ],
        most: Most { base: 0, roots: 0, nodes: 0, triangles: 1 },
        because: "the meter counts each exact test before its call, the warm ones too; a point's search that must wait for another \
                  one has only tested its warm triangle, which counts as a part of the point",
    },
    Fact {
        name: "waiting entries",
        terms: waiting_entries!(
            (1, Count::Heads(GATHER_POPS)),
            (-1, Count::Heads(RESUMED)),
            (-3, Count::Entries(GATHER_POPS)),
        ),
        most: Most::base(0),
        because: "what waits was pushed, in this tick or an earlier one, and not popped; each search pushes the root before; each \
                  loop has a turn more where it ends",
    },
];

/// Of a depth: what the search for the deepest point of the axis does, and what the tracker keeps of it for the next tick.
const DEPTH: &[Fact] = &[
    Fact {
        name: "points of the axis",
        terms: &[(1, MEASURED)],
        most: Most::base(27),
        because: "after 27 the division ends",
    },
    Fact {
        name: "ties that are compared",
        terms: &[
            (1, Count::Calls(&[Function("decided")], "Exact<I,V,P>::add")),
            (-1, ADDED_F32),
            (-1, ADDED_F64),
            (-1, Count::Entries(ROUGH)),
            (-1, Count::Entries(FINE)),
        ],
        most: Most::base(0),
        because: "one that the budget does not cover ends the comparison",
    },
    Fact {
        name: "normals of a walked vertex, in a tick",
        terms: &[
            (1, Count::Heads(NORMALS)),
            (-1, TURNED_F32),
            (-1, TURNED_F64),
            (-(RING as i64), OUTWARD),
            (-(RING as i64), ADDED_F64),
        ],
        most: Most::base(RING as i64),
        because: "those of a direction, and those that confirm a vertex after the walk along its edges, which ends early only \
                  where the budget does: in f32 once, in f64 after a triangle",
    },
    turns!("resumed subtrees", RESUMED, STACK, "as many wait as a stack has entries"),
    Fact {
        name: "resumed searches",
        terms: &[(1, Count::Calls(&[], "Search<I,V,T>>::resume"))],
        most: Most::base(2),
        because: "only a search that the budget ended leaves subtrees to another: the last tick's, and one of this tick's",
    },
    turns!("subtrees left", LEFT, STACK + 1, "those on the stack and the unfinished one"),
    Fact {
        name: "searches left",
        terms: &[(1, Count::Calls(&[], "Search<I,V,T>>::leave"))],
        most: Most::base(2),
        because: "the budget ends a search once, and once more where the same point is searched again",
    },
    Fact {
        name: "lists of ties that make room",
        terms: &[
            (1, Count::Calls(&[], "Ties::drop_farther")),
            (-1, TEST),
            (-1, WARM),
            (-1, DUE_TEST),
            (-1, BOUNDED_TEST),
            (-2, SEARCHED),
        ],
        most: Most::base(4),
        because: "a full list that has made room is full of ties within the limit, until a triangle test lowers that; without room \
                  the list is lost: in each search twice, and once for each test",
    },
    turns!("leaves around a point", &[Function("among")], LEAVES, "a list has at most 48"),
    Fact {
        name: "triangles of a leaf around a point",
        terms: &[
            (1, Count::Heads(&[Function("leaf_bound")])),
            (-1, BOUNDED_TRIANGLE),
            (-3, Count::Entries(&[Function("leaf_bound")])),
        ],
        most: Most::base(0),
        because: "only the best triangle has no count; out of budget the leaf ends; one turn where they end",
    },
    Fact {
        name: "lists of leaves that make room",
        terms: &[(1, ROOM), (-1, BOUNDED_PLANE)],
        most: Most::base(0),
        because: "once for a leaf, which has a bound then",
    },
    Fact {
        name: "leaves that make room",
        terms: &[(1, Count::Heads(&[Function("keep_within")])), (-(LEAVES + 2), ROOM)],
        most: Most::base(0),
        because: "a list has at most 48 leaves, which two loops share; each loop has a turn more where it ends",
    },
    Fact {
        name: "parts of a list of leaves",
        terms: &[(1, Count::Heads(SWAPPED)), (-13, Count::Entries(SWAPPED))],
        most: Most::base(0),
        because: "a list has 412 bytes, of which each turn swaps 32",
    },
    turns!(
        "remembered points",
        &[Line(START, "let Point { parameter, depth, bound, triangle } = *point;")],
        REMEMBERED,
        "at most 20"
    ),
    turns!(
        "points that have moved",
        &[Line(KNOWN, "point.depth = raised(point.depth, moved);")],
        REMEMBERED,
        "at most 20 are remembered"
    ),
    turns!(
        "points to be remembered",
        &[Line(KNOWN, "for point in points.take(KEPT) {")],
        REMEMBERED,
        "at most 20"
    ),
    turns!(
        "points too many",
        &[Line(DIVISION, "while parts.count() > Points::MOST")],
        POINTS - REMEMBERED,
        "at most 28, of which 20 are kept"
    ),
    turns!("points by their parameter", &[Function("row_of")], POINTS, "at most 28"),
    turns!("parts that may be joined", &[Function("join")], POINTS, "at most 28"),
    turns!("ends of a part", &[Line(DIVISION, "for row in ends {")], 2, "two"),
    turns!(
        "rounds of a bound",
        &[Line(PART, "let is_between = equal > low.0 && equal < high.0;")],
        2,
        "at most two"
    ),
    Fact {
        name: "steps of a walk",
        terms: &[(1, Count::Heads(STEPS)), (-1, WALK_DISTANCE)],
        most: Most::base(0),
        because: "the first follows a distance, and each further one the distance of a closer neighbour",
    },
    Fact {
        name: "neighbours of a step",
        terms: &[(1, Count::Heads(NEIGHBOURS)), (-4, Count::Heads(STEPS))],
        most: Most::base(0),
        because: "a triangle has three; one turn where they end",
    },
    Fact {
        name: "touched triangles",
        terms: &[(1, Count::Heads(TOUCHED)), (-34, Count::Entries(TOUCHED))],
        most: Most::base(0),
        because: "a list has at most 32 ties, each passed over or taken; one turn for the closest triangle, and one where they end",
    },
    turns!("halvings", &[Line(TOUCHES, "let half = (inside + outside) * 0.5;")], 8, "eight"),
    Fact {
        name: "touches that are joined",
        terms: &[
            (1, Count::Heads(&[Function("insert"), Function("retain")])),
            (-(MOST_TOUCHES + 2), Count::Calls(&[], "Touches::insert")),
        ],
        most: Most::base(0),
        because: "a list has at most eight touches, which two loops share; each loop has a turn more where it ends",
    },
    turns!(
        "touches after a new one",
        &[Line(TOUCHES, "if other.first > touch.first {")],
        MOST_TOUCHES,
        "at most eight"
    ),
    turns!(
        "touches that begin a search",
        &[Line(START, "for touch in self.touches.touches() {")],
        MOST_TOUCHES,
        "at most eight"
    ),
    turns!(
        "touches beside a point outside",
        &[Function("add_outside")],
        MOST_TOUCHES,
        "at most eight"
    ),
    turns!("touches ahead", &[Function("ahead")], MOST_TOUCHES, "at most eight"),
    turns!("touches behind", &[Function("behind")], MOST_TOUCHES, "at most eight"),
    turns!("roots of a triangle", &[Function("root_of")], 0, "the tree has one root"),
];
