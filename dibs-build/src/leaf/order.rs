//! The order of a leaf's triangles and of their corners, for the controller's stretch check.
//!
//! A triangle is measured along two of its edges, from one of its first two corners, its centre. If the first of these
//! edges is the second edge of the previous triangle, in either direction ([`Join`]), the controller has already loaded
//! two corners and one edge. The order with the fewest starts is chosen.
//!
//! The first triangle's corners and the others' third corners are all of the leaf's vertices: a query tests only
//! these to reject the leaf.

use dibs_nostd::format::{Join, MAX_LEAF_TRIANGLES, PathKind};

use crate::Mesh;
use crate::rest::{RestShape, openness};

/// A triangle of the mesh, and its corners in stored order: a rotation of the mesh's, which keeps the orientation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredTriangle {
    pub triangle: u32,
    pub corners: [u32; 3],
    /// Whether the centre is the second corner instead of the first. Always false for a start.
    pub is_reversed: bool,
}

impl StoredTriangle {
    /// How it joins the previous triangle; `None` if it cannot follow it.
    pub fn join(self, before: Option<Self>) -> Option<Join> {
        let joins = |join: &Join| {
            before.is_some_and(|before| join.is_between(before.centre_first(), self.centre_first()))
        };
        let start = (!self.is_reversed).then_some(Join::Start);
        [Join::Fan, Join::Flip].into_iter().find(joins).or(start)
    }

    /// Its corners, the centre first.
    pub const fn centre_first(self) -> [u32; 3] {
        let [a, b, c] = self.corners;
        if self.is_reversed { [b, a, c] } else { [a, b, c] }
    }
}

/// Orders the triangles of each leaf. A leaf's first triangle may join the last one of the previous leaf.
pub(crate) fn order<'a>(
    mesh: &Mesh,
    leaves: impl IntoIterator<Item = &'a [u32]>,
) -> Vec<StoredTriangle> {
    let mut leaves = leaves.into_iter().map(|leaf| choices(mesh, leaf));
    let (mut stored, mut orders) = (Vec::new(), Orders::new());
    let mut this = leaves.next();
    while let Some(leaf) = this {
        let next = leaves.next();
        let before = stored.last().copied();
        let order = orders.best(&leaf, before, next.as_deref().unwrap_or_default());
        stored.extend(order.iter().map(|choice| choice.stored));
        this = next;
    }
    stored
}

/// The triangles of a leaf that even its best order measures from a corner below 3 degrees, although they have a wider
/// corner. Alone in a leaf they are measured from the wider corner.
pub(crate) fn ill_conditioned(mesh: &Mesh, leaf: &[u32]) -> Vec<u32> {
    let choices = choices(mesh, leaf);
    if !choices.iter().any(Choice::is_ill_conditioned) {
        return Vec::new();
    }
    let order = Orders::new().best(&choices, None, &[]);
    let bad = order.iter().filter(|choice| choice.is_ill_conditioned());
    bad.map(|choice| choice.stored.triangle).collect()
}

/// The cost of storing a triangle in one way; the cost of an order is the sum.
type Cost = u32;

/// The costs of a start and of a flip: approximately the instructions that the check takes beyond those for a triangle
/// in a fan.
const START: Cost = 4 << 8;
const FLIP: Cost = 1 << 8;
/// Largest cost of a sharp corner. Eight of them cost less than a flip, so that openness decides only between orders
/// with equal joins.
const POINTED_MOST: f64 = 31.0;
/// The cost of a measurement from a corner below 18 degrees, if there is a wider one: more than all joins of a leaf.
const UNFIT: Cost = 1 << 16;
/// The cost of a measurement from a corner below 3 degrees, where the stretch has an error of a thousandth.
const ILL_CONDITIONED: Cost = 1 << 24;

/// A way to store one of a leaf's triangles.
#[derive(Clone, Copy, Debug)]
struct Choice {
    stored: StoredTriangle,
    /// The cost of measuring from its centre.
    cost: Cost,
    /// The triangle's bit in a set of the leaf's triangles.
    bit: usize,
    /// Bits of the triangles that contain its first corner, and of those that contain its second.
    with_first: usize,
    with_second: usize,
}

impl Choice {
    const fn is_ill_conditioned(&self) -> bool {
        self.cost >= ILL_CONDITIONED
    }

    /// Its cost after the triangle `before`; `None` if it cannot follow that triangle.
    fn after(&self, before: Option<StoredTriangle>) -> Option<Cost> {
        Some(match self.stored.join(before)? {
            Join::Fan => self.cost,
            Join::Flip => self.cost + FLIP,
            Join::Start => self.cost + START,
        })
    }
}

/// The ways to store the triangles of a leaf.
fn choices(mesh: &Mesh, leaf: &[u32]) -> Vec<Choice> {
    let corners = |triangle: u32| mesh.triangles[triangle as usize];
    let with = |vertex: u32| {
        let bits =
            leaf.iter().zip(0..).map(|(&t, i)| usize::from(corners(t).contains(&vertex)) << i);
        bits.sum()
    };
    let mut choices = Vec::with_capacity(6 * leaf.len());
    for (&triangle, i) in leaf.iter().zip(0..) {
        let [a, b, c] = corners(triangle);
        let bits = [a, b, c].map(with);
        let rotations = [[a, b, c], [b, c, a], [c, a, b]];
        let openness = rotations.map(|corners| {
            let shape = RestShape::new(mesh.corners(corners), PathKind::Surface);
            let [a, b, c] = shape.corners;
            openness(b - a, c - a)
        });
        let best = openness.into_iter().fold(0.0, f64::max);
        let costs = openness.map(|openness| match () {
            () if openness < POINTED.min(best) => ILL_CONDITIONED,
            () if openness < OPEN.min(best) => UNFIT,
            () => (POINTED_MOST * (1.0 - openness)) as Cost,
        });
        for (first, corners) in rotations.into_iter().enumerate() {
            let second = (first + 1) % 3;
            for (is_reversed, centre) in [(false, first), (true, second)] {
                // `share_edge` may refuse the join; the first corner, its fallback, must then be fit.
                if is_reversed && costs[first] >= UNFIT {
                    continue;
                }
                choices.push(Choice {
                    stored: StoredTriangle { triangle, corners, is_reversed },
                    cost: costs[centre],
                    bit: 1 << i,
                    with_first: bits[first],
                    with_second: bits[second],
                });
            }
        }
    }
    choices
}

/// Largest number of ways to store the triangles of one leaf.
const CHOICES: usize = 6 * MAX_LEAF_TRIANGLES as usize;

/// The cheapest order of a set of triangles that ends with a given choice: its cost, and its last choice but one.
#[derive(Clone, Copy)]
struct Best {
    cost: Cost,
    before: u32,
}

/// For a set that has no such order.
const NONE: Best = Best { cost: Cost::MAX, before: 0 };

/// The best order for each set of a leaf's triangles and each last choice, by Held and Karp's dynamic programming: it
/// extends the best order of one triangle less.
struct Orders(Vec<[Best; CHOICES]>);

impl Orders {
    fn new() -> Self {
        Self(vec![[NONE; CHOICES]; 1 << MAX_LEAF_TRIANGLES])
    }

    /// The cheapest order of a leaf, after the triangle `before` and ahead of a leaf with the choices `next`.
    fn best(
        &mut self,
        leaf: &[Choice],
        before: Option<StoredTriangle>,
        next: &[Choice],
    ) -> Vec<Choice> {
        let all = leaf.iter().fold(0, |bits, choice| bits | choice.bit);
        self.0[..=all].fill([NONE; CHOICES]);
        for (at, choice) in leaf.iter().enumerate() {
            if let Some(cost) = choice.after(before) {
                self.offer(choice.bit, at, cost, at);
            }
        }
        // Pairs of choices that may follow each other without a start, with their cost.
        let mut joins = Vec::new();
        for (last, before) in leaf.iter().enumerate() {
            for (at, choice) in leaf.iter().enumerate() {
                match choice.after(Some(before.stored)) {
                    Some(cost) if cost < choice.cost + START => joins.push((last, at, cost)),
                    _ => (),
                }
            }
        }
        for set in 1..all {
            let lasts = self.0[set];
            let Some((last, cheapest)) = cheapest(&lasts, |_| 0) else { continue };
            // After a leaf's first triangle, only a third corner may be new to the leaf.
            for (at, choice) in leaf.iter().enumerate() {
                let is_known = set & choice.with_first != 0 && set & choice.with_second != 0;
                if set & choice.bit == 0 && is_known && !choice.stored.is_reversed {
                    self.offer(set | choice.bit, at, cheapest + choice.cost + START, last);
                }
            }
            for &(last, at, cost) in &joins {
                if lasts[last].cost != Cost::MAX && set & leaf[at].bit == 0 {
                    self.offer(set | leaf[at].bit, at, lasts[last].cost + cost, last);
                }
            }
        }
        let way_out = |at: usize| {
            let costs = next.iter().filter_map(|choice| choice.after(Some(leaf[at].stored)));
            costs.min().unwrap_or_default()
        };
        let mut order = Vec::new();
        let mut last = cheapest(&self.0[all], way_out).map(|(at, _)| at);
        let mut set = all;
        while let Some(at) = last {
            order.push(leaf[at]);
            let before = self.0[set][at].before as usize;
            set &= !leaf[at].bit;
            last = (set != 0).then_some(before);
        }
        order.reverse();
        order
    }

    /// Records an order of this set that ends with the choice `at`, after `before`, if it is cheaper.
    fn offer(&mut self, set: usize, at: usize, cost: Cost, before: usize) {
        let best = &mut self.0[set][at];
        if cost < best.cost {
            *best = Best { cost, before: before as u32 };
        }
    }
}

/// The last choice of the cheapest order, where `to_come` is the cost after it.
fn cheapest(lasts: &[Best], to_come: impl Fn(usize) -> Cost) -> Option<(usize, Cost)> {
    let possible = lasts.iter().enumerate().filter(|(_, best)| best.cost != Cost::MAX);
    possible.map(|(at, best)| (at, best.cost + to_come(at))).min_by_key(|&(_, cost)| cost)
}

/// Openness of a corner of 18 degrees.
const OPEN: f64 = 0.05;

/// Openness of a corner of 3 degrees.
const POINTED: f64 = 0.0014;
