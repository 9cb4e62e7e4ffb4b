//! The measurement of all elements, in slices of bounded work.

use glam::{Vec3, Vec4};

use super::Nodes;
use super::kernel::CurrentElement;
use super::layout::{self, ELEMENT_BYTES, Element, RestElement};
use crate::math::vec3x4::Vec3x4;
use crate::stretch::{LEAST, StretchError, root_up, squared_limit};
use crate::surface::{MeasuredStretch, REGIONS, VertexTable};

#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    next: u32,
    /// The largest squared stretch so far, and its element.
    squared: f32,
    worst: u32,
    /// The sums of the squared edges in this range of elements, current and at rest.
    sizes: [f32; 2],
}

impl Pass {
    pub const fn new() -> Self {
        Self { next: 0, squared: LEAST, worst: 0, sizes: [0.0; 2] }
    }

    /// Starts with the stretch of one element, usually the most stretched of the last frame: then few others exceed it,
    /// and each that exceeds all before it takes twenty times as long as the rest.
    pub fn start_with<V: VertexTable + ?Sized>(&mut self, nodes: &Nodes<'_>, table: &V, row: u32) {
        let Some(record) = nodes.parts.elements.get(row as usize) else { return };
        let Element { corners, rest } = layout::element(record);
        if let Ok(now) = now_of(table, corners) {
            // One beyond the limit is an error when its turn comes.
            let _ = self.compare(nodes, row, &now, &rest, squared_limit(nodes.limit));
        }
    }

    /// Compares an element's stretch with the largest so far and the squared limit.
    #[inline(always)]
    fn compare(
        &mut self,
        nodes: &Nodes<'_>,
        row: u32,
        now: &CurrentElement<f32>,
        rest: &RestElement<f32>,
        limit: f32,
    ) -> Result<(), StretchError> {
        if now.is_within(rest, self.squared) {
            return Ok(());
        }
        if !now.is_within(rest, limit) {
            let stretch = now.stretch_beyond(rest, limit);
            return Err(StretchError::ElementExceeded {
                element: row,
                stretch,
                limit: nodes.limit,
            });
        }
        self.squared = now.squared_stretch(rest, self.squared, limit);
        self.worst = row;
        Ok(())
    }

    /// Measures at most `work` elements whose nodes are below row `ready`. Returns the work left. A range of elements
    /// must not shrink below `shrinkage` of its size at rest.
    pub fn advance<V: VertexTable + ?Sized>(
        &mut self,
        nodes: &Nodes<'_>,
        table: &V,
        ready: u32,
        shrinkage: f32,
        mut work: u32,
    ) -> Result<u32, StretchError> {
        let elements = nodes.parts.elements;
        let (run, end) = (nodes.run(), elements.len() as u32);
        while self.next < end && work > 0 {
            let first = self.next - self.next.checked_rem(run).unwrap_or(0);
            let run_end = first.saturating_add(run).min(end);
            let stop = self.next.saturating_add(work).min(run_end);
            let rows = elements.get(self.next as usize..stop as usize).unwrap_or_default();
            let start = self.next;
            self.measure_rows(nodes, rows, table, ready)?;
            work -= self.next - start;
            if self.next < stop {
                break;
            }
            if stop == run_end {
                let [now, rest] = self.sizes;
                self.sizes = [0.0; 2];
                if !(now >= shrinkage * shrinkage * rest) {
                    return Err(StretchError::ElementsShrunk { element: first, limit: shrinkage });
                }
            }
        }
        Ok(work)
    }

    /// Measures the next elements, up to one with a node that is not ready.
    fn measure_rows<V: VertexTable + ?Sized>(
        &mut self,
        nodes: &Nodes<'_>,
        mut rows: &[[u8; ELEMENT_BYTES]],
        table: &V,
        ready: u32,
    ) -> Result<(), StretchError> {
        let limit = squared_limit(nodes.limit);
        while !rows.is_empty() {
            // On other processors it takes more instructions, not fewer.
            if cfg!(any(target_arch = "x86_64", target_arch = "aarch64")) {
                let passed = self.fours(rows, table, ready);
                rows = rows.get(passed..).unwrap_or_default();
            }
            let (some, others) = rows.split_at_checked(4).unwrap_or((rows, &[]));
            for record in some {
                if !self.measure(nodes, record, table, ready, limit)? {
                    return Ok(());
                }
                self.next += 1;
            }
            rows = others;
        }
        Ok(())
    }

    /// Measures four elements at a time, up to the first four that do not all pass the quick check. Returns how many
    /// passed. Values are rounded and added in the same order as in [`measure`](Self::measure), so the bits are the
    /// same.
    // By itself, so that its state stays in registers.
    #[inline(never)]
    fn fours<V: VertexTable + ?Sized>(
        &mut self,
        rows: &[[u8; ELEMENT_BYTES]],
        table: &V,
        ready: u32,
    ) -> usize {
        let [mut sum, mut at_rest] = self.sizes;
        let mut passed = 0;
        for records in rows.as_chunks::<4>().0 {
            // The last of them has the latest node.
            let [.., last] = records;
            let [a, b, c, d] = layout::corners(last);
            if (a >= ready) | (b >= ready) | (c >= ready) | (d >= ready) {
                break;
            }
            let (corners, rest) = layout::four(records);
            let Some(now) = four_of(table, corners) else { break };
            if now.is_within(&rest, self.squared) & now.is_upright(&rest) != 0b1111 {
                break;
            }
            let [size, rest] = now.sizes(&rest);
            for (size, rest) in size.to_array().into_iter().zip(rest.to_array()) {
                sum += size;
                at_rest += rest;
            }
            passed += 4;
        }
        self.sizes = [sum, at_rest];
        self.next += passed as u32;
        passed
    }

    /// Measures the next element; false if one of its nodes is not ready.
    #[inline(always)]
    fn measure<V: VertexTable + ?Sized>(
        &mut self,
        nodes: &Nodes<'_>,
        record: &[u8; ELEMENT_BYTES],
        table: &V,
        ready: u32,
        limit: f32,
    ) -> Result<bool, StretchError> {
        let Element { corners, rest } = layout::element(record);
        let [a, b, c, d] = corners;
        if (a >= ready) | (b >= ready) | (c >= ready) | (d >= ready) {
            return Ok(false);
        }
        let now = now_of(table, corners)?;
        self.compare(nodes, self.next, &now, &rest, limit)?;
        if !now.is_upright(&rest) {
            return Err(StretchError::Inverted { element: self.next });
        }
        let [size, rest] = now.sizes(&rest);
        let [sizes, at_rest] = self.sizes;
        self.sizes = [sizes + size, at_rest + rest];
        Ok(true)
    }

    /// Whether all elements are measured.
    pub fn is_done(&self, nodes: &Nodes<'_>) -> bool {
        self.next as usize >= nodes.parts.elements.len()
    }

    /// The stretch, once all elements are measured.
    pub fn measured(&self, nodes: &Nodes<'_>, epoch: Option<u32>) -> MeasuredStretch {
        let sigma = root_up(self.squared);
        let regions = [u8::MAX; REGIONS];
        MeasuredStretch::new(sigma, nodes.motion.tree, self.worst, epoch, regions)
    }
}

/// A current element; an error if a node is outside of the table.
#[inline(always)]
fn now_of<V: VertexTable + ?Sized>(
    table: &V,
    [a, b, c, d]: [u32; 4],
) -> Result<CurrentElement<f32>, StretchError> {
    let at = |row| table.position(row).map(Vec3::into).ok_or(StretchError::Corrupt { row });
    Ok(CurrentElement::of([at(a)?, at(b)?, at(c)?, at(d)?]))
}

/// Four current elements; `None` if a node is outside of the table.
#[inline(always)]
fn four_of<V: VertexTable + ?Sized>(
    table: &V,
    corners: [[u32; 4]; 4],
) -> Option<CurrentElement<Vec4>> {
    let at = |nodes| {
        let Vec3x4 { x, y, z } = Vec3x4::of(|node| table.position(node), nodes)?;
        Some([x, y, z])
    };
    let [a, b, c, d] = corners;
    Some(CurrentElement::of([at(a)?, at(b)?, at(c)?, at(d)?]))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use dibs_build::{Builder, Volume, generate};

    use super::*;
    use crate::tree::Tree;

    /// Calls `each` with the nodes of a heart in a lattice and frames of them, some with elements beyond the limit, inverted
    /// or not finite.
    fn around_rest(seed: u64, mut each: impl FnMut(&Nodes<'_>, &[Vec3], &mut fastrand::Rng)) {
        let mesh = generate::heart(600).expect("a valid size").mesh;
        let lattice = Volume::lattice(&mesh, [5, 4, 3]).expect("a lattice");
        let built = Builder::new().stretch(2.0).nodes(&lattice).build(&mesh).expect("held");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        let mut rng = fastrand::Rng::with_seed(seed);
        each(&nodes, &rest, &mut rng);
        for round in 0..400 {
            let mut random = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5;
            let by = if round % 4 == 0 { 30.0 } else { 12.0 };
            let mut frame: Vec<Vec3> = rest.iter().map(|&at| at + by * random()).collect();
            if round % 10 == 1 {
                frame[rng.usize(..rest.len())] = Vec3::NAN;
            }
            each(&nodes, &frame, &mut rng);
        }
    }

    /// Measured four at a time in slices of any length, the bits and the refused element are the same as one at a time.
    #[test]
    fn four_at_a_time_are_measured_as_one_after_another() {
        let mut outcomes = [0; 4];
        around_rest(62, |nodes, frame, rng| {
            let ready = if rng.bool() { nodes.count() } else { rng.u32(..nodes.count()) };
            let shrinkage = if rng.bool() { 0.0 } else { 1.01 };
            let mut measured = |longest: u32| {
                let mut pass = Pass::new();
                let error = loop {
                    let (next, work) = (pass.next, rng.u32(1..=longest));
                    match pass.advance(nodes, frame, ready, shrinkage, work) {
                        Ok(_) if pass.next > next => (),
                        other => break other.err(),
                    }
                };
                let sizes = pass.sizes.map(f32::to_bits);
                (pass.next, pass.squared.to_bits(), pass.worst, sizes, std::format!("{error:?}"))
            };
            // Fewer than four at a time are measured one after another.
            let (one, four) = (measured(3), measured(60));
            assert_eq!(one, four);
            let error = &one.4;
            outcomes[["None", "Some(ElementE", "Some(I", "Some(ElementsS"]
                .iter()
                .position(|start| error.starts_with(start))
                .expect("a stretch error")] += 1;
        });
        assert!(outcomes.iter().all(|&count| count > 20), "{outcomes:?}");
    }

    /// A table without a position for one of its nodes.
    struct Gap<'f>(&'f [Vec3], u32);

    impl VertexTable for Gap<'_> {
        fn len(&self) -> usize {
            self.0.len()
        }

        fn position(&self, vertex: u32) -> Option<Vec3> {
            if vertex == self.1 { None } else { self.0.position(vertex) }
        }
    }

    /// A node without a position is named, and a last element that does not exist is no start.
    #[test]
    fn what_is_not_there_is_not_measured() {
        let mut frames = 0;
        around_rest(64, |nodes, frame, _| {
            frames += 1;
            // The first is at rest.
            if frames > 1 {
                return;
            }
            let whole = nodes.measure(frame);
            let last = whole.expect("at rest");
            let [start, ..] = nodes.element(last.triangle().0).expect("an element");
            for gap in [start, 0, nodes.count() - 1] {
                let missing = Err(StretchError::Corrupt { row: gap });
                assert_eq!(nodes.measure(&Gap(frame, gap)), missing);
                assert_eq!(nodes.measure_after(&Gap(frame, gap), &last), missing);
            }
            let none = [u8::MAX; REGIONS];
            for row in [nodes.element_count(), u32::MAX >> 1] {
                let other = MeasuredStretch::new(1.5, nodes.motion.tree, row, None, none);
                assert_eq!(nodes.element(other.triangle().0), None);
                assert_eq!(nodes.measure_after(frame, &other), whole);
            }
        });
    }

    /// Wherever a measurement starts, it gives the same stretch to its rounding, and the same refusals.
    #[test]
    fn a_start_from_the_last_frame_changes_a_measurement_by_its_rounding() {
        let (mut last, mut outcomes) = (None, [0; 2]);
        around_rest(63, |nodes, frame, _| {
            let from_none = nodes.measure(frame);
            let last = last.get_or_insert_with(|| from_none.expect("at rest"));
            let from_last = nodes.measure_after(frame, last);
            outcomes[usize::from(from_none.is_ok())] += 1;
            if let (Ok(one), Ok(other)) = (from_none, from_last) {
                let ratio = other.sigma() / one.sigma();
                assert!((ratio - 1.0).abs() < 1.0 / 65_536.0, "{one:?} {other:?}");
                *last = other;
            } else {
                assert_eq!(std::format!("{from_none:?}"), std::format!("{from_last:?}"));
            }
        });
        assert!(outcomes.iter().all(|&count| count > 50), "{outcomes:?}");
    }
}
