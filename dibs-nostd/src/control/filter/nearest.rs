//! The point nearest to another one within half-spaces: the projection onto a polyhedron.
//!
//! The dual active set method of Goldfarb & Idnani (1983) for a quadratic whose matrix is the identity. It starts at
//! the wanted point with no active row, and makes the most violated row active, step by step; a row whose multiplier
//! would become negative on the way is dropped. Each active row keeps its dual vector, whose product is 1 with its own
//! factors and 0 with those of other active rows. So a row enters or leaves by a few products, and no system is solved.

use heapless::Vec;

/// Unknowns: three of a translation, three of a rotation.
pub(super) const UNKNOWNS: usize = 6;

/// A point or a direction.
pub(super) type Vector = [f32; UNKNOWNS];

/// Most steps, each of which adds or drops a row.
const STEPS: u32 = 64;

/// Products and sums of a step, and of each active row in it.
const STEP: u32 = 5;
const ACTIVE: u32 = 7;

/// Violation (mm) that is ignored.
const TOLERANCE: f32 = 1e-5;

/// Rows count as dependent below this square of the sine between one and the others.
const DEPENDENT: f32 = 1e-7;

/// The half-space `factors . x >= least`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpace {
    /// A unit vector, or zero.
    pub factors: Vector,
    pub least: f32,
}

impl HalfSpace {
    /// The distance by which a point is outside; negative inside.
    pub fn lacks(&self, point: &Vector) -> f32 {
        self.least - dot(&self.factors, point)
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub point: Vector,
    /// Whether it is in every half-space. If not, either no point is, or none was found in [`STEPS`] steps or the work.
    pub is_inside: bool,
    /// Products and sums of two vectors.
    pub work: u32,
}

struct Active {
    row: HalfSpace,
    dual: Vector,
    multiplier: f32,
}

/// The point nearest to `wanted` in all of `count` half-spaces, with at most this work.
pub(super) fn nearest(
    rows: &(impl Iterator<Item = HalfSpace> + Clone),
    count: u32,
    wanted: &Vector,
    most: u32,
) -> Nearest {
    let mut active: Vec<Active, UNKNOWNS> = Vec::new();
    let mut point = *wanted;
    let mut steps = 0..STEPS;
    let mut work = 0_u32;
    loop {
        // Written so that a sum never overflows.
        if most.saturating_sub(work) < count {
            return Nearest { point, is_inside: false, work };
        }
        work += count;
        let Some(row) = most_violated(rows.clone(), &point) else { break };
        let mut multiplier = 0.0;
        loop {
            let step = STEP + ACTIVE * active.len() as u32;
            if steps.next().is_none() || most.saturating_sub(work) < step {
                return Nearest { point, is_inside: false, work };
            }
            work += step;
            // The component of the row's factors that is orthogonal to all active rows.
            let mut free = row.factors;
            for one in &active {
                add(&mut free, &one.row.factors, -dot(&one.dual, &row.factors));
            }
            let squared = dot(&free, &free);
            let is_free = squared > DEPENDENT && !active.is_full();
            let whole = if is_free { row.lacks(&point) / squared } else { f32::INFINITY };
            let (mut step, mut dropped) = (whole, None);
            for (at, one) in active.iter().enumerate() {
                let rate = dot(&one.dual, &row.factors);
                if rate > 0.0 && one.multiplier / rate < step {
                    (step, dropped) = (one.multiplier / rate, Some(at));
                }
            }
            if !(step < f32::INFINITY) {
                return Nearest { point, is_inside: false, work };
            }
            for one in &mut active {
                one.multiplier -= step * dot(&one.dual, &row.factors);
            }
            multiplier += step;
            if is_free {
                add(&mut point, &free, step);
            }
            match dropped {
                Some(at) => drop_row(&mut active, at),
                None => {
                    let mut dual = free;
                    scale(&mut dual, 1.0 / squared);
                    for one in &mut active {
                        let rate = dot(&one.dual, &row.factors);
                        add(&mut one.dual, &dual, -rate);
                    }
                    let _ = active.push(Active { row, dual, multiplier });
                    break;
                }
            }
        }
    }
    Nearest { point, is_inside: true, work }
}

/// The row that a point violates most; `None` if it violates none, or is NaN.
fn most_violated(rows: impl Iterator<Item = HalfSpace>, point: &Vector) -> Option<HalfSpace> {
    let (mut worst, mut found) = (TOLERANCE, None);
    for row in rows {
        let lacks = row.lacks(point);
        if lacks > worst + TOLERANCE * row.least.abs() {
            (worst, found) = (lacks, Some(row));
        }
    }
    found
}

/// Drops an active row, and removes its component from the others' duals.
fn drop_row(active: &mut Vec<Active, UNKNOWNS>, at: usize) {
    let mut gone = None;
    let mut kept: Vec<Active, UNKNOWNS> = Vec::new();
    for (number, one) in core::mem::take(active).into_iter().enumerate() {
        if number == at {
            gone = Some(one.dual);
        } else {
            let _ = kept.push(one);
        }
    }
    if let Some(dual) = gone {
        let squared = dot(&dual, &dual);
        for one in &mut kept {
            let along = dot(&one.dual, &dual) / squared;
            add(&mut one.dual, &dual, -along);
        }
    }
    *active = kept;
}

pub(super) fn dot(a: &Vector, b: &Vector) -> f32 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

pub(super) fn add(a: &mut Vector, b: &Vector, factor: f32) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b * factor;
    }
}

fn scale(a: &mut Vector, by: f32) {
    for a in a {
        *a *= by;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// With all work that it takes.
    fn nearest(
        rows: &(impl ExactSizeIterator<Item = HalfSpace> + Clone),
        wanted: &Vector,
    ) -> Nearest {
        super::nearest(rows, rows.len() as u32, wanted, u32::MAX)
    }

    fn unit(factors: Vector) -> Option<Vector> {
        let length = dot(&factors, &factors).sqrt();
        (length > 0.1).then(|| factors.map(|x| x / length))
    }

    fn distance(a: &Vector, b: &Vector) -> f32 {
        let mut apart = *a;
        add(&mut apart, b, -1.0);
        dot(&apart, &apart).sqrt()
    }

    #[test]
    fn a_corner_holds_by_both_walls() {
        let row = |x: f32, y: f32, least| HalfSpace { factors: [x, y, 0.0, 0.0, 0.0, 0.0], least };
        let rows = [row(1.0, 0.0, 1.0), row(0.0, 1.0, 2.0), row(0.6, 0.8, -9.0)];
        let found = nearest(&rows.into_iter(), &[-3.0, -4.0, 5.0, 0.0, 0.0, 0.0]);
        assert!(found.is_inside);
        assert!(distance(&found.point, &[1.0, 2.0, 5.0, 0.0, 0.0, 0.0]) < 1e-5, "{found:?}");
    }

    #[test]
    fn opposite_walls_leave_no_point() {
        let row = |x: f32, least| HalfSpace { factors: [x, 0.0, 0.0, 0.0, 0.0, 0.0], least };
        assert!(!nearest(&[row(1.0, 1.0), row(-1.0, 0.5)].into_iter(), &[0.0; 6]).is_inside);
        assert!(nearest(&[row(1.0, 1.0), row(-1.0, -1.5)].into_iter(), &[0.0; 6]).is_inside);
        let none = HalfSpace { factors: [0.0; 6], least: 1.0 };
        assert!(!nearest(&[none].into_iter(), &[0.0; 6]).is_inside);
    }

    /// So far away that f32 is coarser than the tolerance, no point is inside, and the steps end.
    #[test]
    fn a_point_too_far_away_is_not_reached() {
        let row = HalfSpace { factors: [0.6, 0.8, 0.0, 0.0, 0.0, 0.0], least: 1.0 };
        let from = |x: f32, y: f32| nearest(&[row].into_iter(), &[x, y, 0.0, 0.0, 0.0, 0.0]);
        assert!(from(-1e6, -3e5).is_inside);
        assert!(!from(-1e9, -3e8).is_inside);
    }

    /// With less work than it takes, no point counts as inside, and none of the limit is exceeded.
    #[test]
    fn a_solution_ends_with_its_work() {
        let row = |x: f32, y: f32, least| HalfSpace { factors: [x, y, 0.0, 0.0, 0.0, 0.0], least };
        let rows = [row(1.0, 0.0, 1.0), row(0.0, 1.0, 2.0), row(0.6, 0.8, -9.0)].into_iter();
        let wanted = [-3.0, -4.0, 5.0, 0.0, 0.0, 0.0];
        let whole = nearest(&rows, &wanted);
        assert!(whole.is_inside && whole.work > 20, "{whole:?}");
        for most in 0..=whole.work {
            let found = super::nearest(&rows, 3, &wanted, most);
            assert!(found.work <= most, "{most}: {found:?}");
            assert_eq!(found.is_inside, most == whole.work, "{most}: {found:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4_000, failure_persistence: None, ..ProptestConfig::default() })]

        /// The point is in every half-space, and none is nearer: the residual of a projection is at an angle of at
        /// least 90 degrees to any step to another point inside.
        #[test]
        fn it_is_the_projection(
            factors in prop::collection::vec(prop::array::uniform6(-1.0_f32..1.0), 1..16),
            wanted in prop::array::uniform6(-2.0_f32..2.0),
            inside in prop::array::uniform6(-1.0_f32..1.0),
            slack in prop::array::uniform16(0.0_f32..0.5),
        ) {
            // Every half-space holds `inside`.
            let rows: Vec<HalfSpace, 16> = factors
                .into_iter()
                .filter_map(unit)
                .zip(slack)
                .map(|(factors, slack)| HalfSpace { factors, least: dot(&factors, &inside) - slack })
                .collect();
            let found = nearest(&rows.iter().copied(), &wanted);
            prop_assert!(found.is_inside, "{rows:?}");
            for row in &rows {
                prop_assert!(row.lacks(&found.point) < 1e-4, "{row:?} {found:?}");
            }
            let mut residual = wanted;
            add(&mut residual, &found.point, -1.0);
            let others = (0..60_u8).map(|step| {
                let mut other = inside;
                let (axis, shift) = (step % 6, f32::from(step / 6) * 0.2 - 1.0);
                if let Some(x) = other.get_mut(usize::from(axis)) {
                    *x += shift;
                }
                other
            });
            for other in others.filter(|other| rows.iter().all(|row| row.lacks(other) <= 0.0)) {
                let mut step = other;
                add(&mut step, &found.point, -1.0);
                prop_assert!(dot(&residual, &step) < 2e-3, "{found:?} {other:?}");
            }
        }
    }
}
