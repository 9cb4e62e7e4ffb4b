//! The quick check of four triangles at a time, for processors with vector registers.
//!
//! If one of the four fails, the row-by-row check goes over them, from the state that it would have had. Values are
//! rounded and added in the same order, so the bits are the same.

use glam::Vec4;

use super::{Measure, MetricBits, PreviousTriangle, Table};
use crate::math::vec3x4::Vec3x4;
use crate::stretch::kernel::Worst;
use crate::surface::VertexTable;
use crate::tree::Index;
use crate::tree::format::{self, Join, Metric};

/// The edge from a triangle's centre to its third corner: their rows, and its square at rest.
#[derive(Clone, Copy)]
struct LastEdge {
    centre: u32,
    third: u32,
    rest: f32,
}

/// Four triangles: the rows of their corners, and the squares at rest.
#[derive(Default)]
struct FourTriangles {
    centre: [u32; 4],
    other: [u32; 4],
    third: [u32; 4],
    first: [f32; 4],
    between: [f32; 4],
    second: [f32; 4],
}

impl LastEdge {
    /// The edge before the first triangle of a range: see [`Table::before`].
    #[inline(always)]
    fn before<I: Index>(metric: &impl MetricBits, corners: &I::Corners) -> Option<Self> {
        let metric = Metric::new(metric.bits().map(f32::from_bits));
        let a = format::vertex_number::<I>(corners.as_ref(), 0)?;
        let b = format::vertex_number::<I>(corners.as_ref(), 1)?;
        let [centre, other, _] = metric.centre_first([a, b, b]);
        let [rest, ..] = metric.squares;
        Some(match metric.join {
            Join::Flip => Self { centre: other, third: centre, rest },
            Join::Start | Join::Fan => Self { centre, third: other, rest },
        })
    }

    /// The next four triangles, and the edge after them.
    #[inline(always)]
    fn next<I: Index>(
        mut self,
        metrics: &[impl MetricBits; 4],
        triangles: &[I::Corners; 4],
    ) -> Option<(FourTriangles, Self)> {
        let mut four = FourTriangles::default();
        for lane in 0..4 {
            let corners = &triangles[lane];
            let [mark, between, second] = metrics[lane].bits();
            let a = format::vertex_number::<I>(corners.as_ref(), 0)?;
            let b = format::vertex_number::<I>(corners.as_ref(), 1)?;
            let c = format::vertex_number::<I>(corners.as_ref(), 2)?;
            // The codes of `Join`, without branches: their order cannot be predicted.
            let is_fan = mark >> 31 != 0;
            let is_start = !is_fan && mark & 1 == 0;
            let joined = if is_fan { (self.centre, self.third) } else { (self.third, self.centre) };
            let (centre, other) = if is_start { (a, b) } else { joined };
            four.centre[lane] = centre;
            four.other[lane] = other;
            four.third[lane] = c;
            four.first[lane] = if is_start { f32::from_bits(mark) } else { self.rest };
            four.between[lane] = f32::from_bits(between);
            four.second[lane] = f32::from_bits(second);
            self = Self { centre, third: c, rest: f32::from_bits(second) };
        }
        Some((four, self))
    }
}

impl<V: VertexTable + ?Sized> Table<'_, V> {
    /// The square of the second edge of each of four triangles, if all of them are certainly not stretched beyond `sqrt(largest)`.
    #[inline(always)]
    fn pass_four<M: Measure>(&self, four: &FourTriangles, largest: f32) -> Option<[f32; 4]> {
        let at = |row| self.surface.position(row);
        let centre = Vec3x4::of(at, four.centre)?;
        let first = Vec3x4::of(at, four.other)?.minus(centre);
        let second = Vec3x4::of(at, four.third)?.minus(centre);
        let (largest, rest) = (Vec4::splat(largest), Vec4::from_array(four.second));
        let square = second.dot(second);
        let left = largest * Vec4::from_array(four.first) - first.dot(first);
        let left_second = largest * rest - square;
        let between = largest * Vec4::from_array(four.between);
        let within = M::are_within(left, left_second, between, [first, second]);
        if within & left.cmpgt(Vec4::ZERO).bitmask() != 0b1111 {
            return None;
        }
        Some(square.to_array())
    }

    /// Checks four triangles at a time, up to the first four that do not all pass. Returns how many groups of four
    /// passed.
    // A separate function, so that its state stays in registers.
    #[inline(never)]
    fn fours<I: Index, M: Measure, R: MetricBits>(
        &self,
        metrics: &[R],
        triangles: &[I::Corners],
        largest: f32,
        last: &mut LastEdge,
        sum: &mut f32,
    ) -> usize {
        let ((metrics, _), (triangles, _)) = (metrics.as_chunks::<4>(), triangles.as_chunks::<4>());
        let (mut edge, mut total, mut passed) = (*last, *sum, 0);
        for (metrics, triangles) in metrics.iter().zip(triangles) {
            let Some((four, next)) = edge.next::<I>(metrics, triangles) else { break };
            let Some(squares) = self.pass_four::<M>(&four, largest) else { break };
            for square in squares {
                total += square;
            }
            edge = next;
            passed += 1;
        }
        (*last, *sum) = (edge, total);
        passed
    }

    /// The state of the row-by-row check after a triangle that passed.
    #[inline(always)]
    fn after(&self, last: LastEdge, largest: f32) -> Option<PreviousTriangle> {
        let centre = self.surface.position(last.centre)?;
        let third = self.surface.position(last.third)?;
        let edge = third - centre;
        let left = largest * last.rest - edge.length_squared();
        Some(PreviousTriangle { centre, third, edge, left, square: 0.0 })
    }
}

/// [`measure`](super::measure) on a whole frame, of a tree that is `UNIFORM`.
#[inline(never)]
pub(super) fn measure<I: Index, V: VertexTable + ?Sized, M: Measure, R: MetricBits>(
    surface: &V,
    mut metrics: &[R],
    mut triangles: &[I::Corners],
    limit: f32,
    first: u32,
    mut worst: Worst,
    mut size: f32,
) -> (u32, Worst, f32) {
    let table = Table { surface, ready: surface.len() as u32, limit };
    let mut row = first;
    let start = metrics.first().zip(triangles.first()).and_then(|(metric, corners)| {
        let before = table.before::<I>(metric, corners, worst.squared)?;
        Some((before, LastEdge::before::<I>(metric, corners)?))
    });
    let Some((before, mut last)) = start else { return (row, worst, size) };
    // The state before `row` where the row-by-row check ended; elsewhere it follows from `last`.
    let mut before = Some(before);
    while !metrics.is_empty() {
        let passed =
            table.fours::<I, M, R>(metrics, triangles, worst.squared, &mut last, &mut size);
        if passed > 0 {
            before = None;
            let rows = passed.saturating_mul(4);
            row = row.wrapping_add(rows as u32);
            metrics = metrics.get(rows..).unwrap_or_default();
            triangles = triangles.get(rows..).unwrap_or_default();
        }
        let Some(mut state) = before.or_else(|| table.after(last, worst.squared)) else { break };
        for (metric, corners) in metrics.iter().zip(triangles).take(4) {
            let next = table.next::<I, M, true>(state, metric, corners, row, &mut worst);
            let Some(next) = next else { return (row, worst, size) };
            size += next.square;
            state = next;
            row = row.wrapping_add(1);
        }
        let (Some((four, rest)), Some((corners, others))) =
            (metrics.split_first_chunk::<4>(), triangles.split_first_chunk::<4>())
        else {
            break;
        };
        let Some((_, next)) = last.next::<I>(four, corners) else { break };
        (last, before) = (next, Some(state));
        (metrics, triangles) = (rest, others);
    }
    (row, worst, size)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use dibs_build::{Builder, IndexWidth, Paths, generate};
    use glam::Vec3;

    use super::*;
    use crate::stretch::kernel::{LEAST, LongestEdge, SingularValue, squared_limit};
    use crate::stretch::rows;
    use crate::tree::Tree;
    use crate::tree::format::PathKind;

    /// Ranges of triangles on moved surfaces give the same bits and the same row as the check of one after another,
    /// also with corners that are far off or not finite.
    #[test]
    fn four_at_a_time_are_measured_as_one_after_another() {
        let mesh = generate::heart(600).expect("a valid size").mesh;
        let mut rng = fastrand::Rng::with_seed(61);
        let mut stopped = 0;
        for (paths, width) in [
            (Paths::Edges, IndexWidth::Bits16),
            (Paths::Surface { crossings: 2 }, IndexWidth::Bits16),
            (Paths::Surface { crossings: 2 }, IndexWidth::Bits32),
        ] {
            let builder = Builder::new().stretch(3.0).paths(paths).index(width);
            let built = builder.build(&mesh).expect("a valid mesh");
            for round in 0..300 {
                let noise = if round % 3 == 0 { 0.0 } else { 2.0 * rng.f32() };
                let scale = 0.6 + rng.f32();
                let mut random = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5;
                let mut moved: Vec<Vec3> =
                    mesh.positions.iter().map(|p| *p * scale + random() * noise).collect();
                if round % 10 == 1 {
                    moved[rng.usize(..mesh.positions.len())] = Vec3::splat(f32::NAN);
                }
                let moved = built.to_rows(&moved);
                let start = rng.u32(..600);
                let range = start as usize..(start + rng.u32(..=600 - start)) as usize;
                let squared = if rng.bool() { LEAST } else { LEAST + 4.0 * rng.f32() };
                let worst = Worst { squared, triangle: start };
                let end = range.end as u32;
                let row = match width {
                    IndexWidth::Bits32 => same::<u32>(built.blob(), &moved, range, worst),
                    _ => same::<u16>(built.blob(), &moved, range, worst),
                };
                stopped += u32::from(row < end);
            }
        }
        assert!((10..800).contains(&stopped), "{stopped} runs ended early");
    }

    /// Measures a range in both ways, and returns the row where both ended.
    fn same<I: Index>(
        blob: &[u8],
        surface: &[Vec3],
        range: core::ops::Range<usize>,
        worst: Worst,
    ) -> u32 {
        let tree = Tree::<I>::from_bytes(blob).expect("valid");
        match tree.paths() {
            PathKind::Surface => same_by::<I, SingularValue>(&tree, surface, range, worst),
            PathKind::EdgePath => same_by::<I, LongestEdge>(&tree, surface, range, worst),
            PathKind::Volume => unreachable!("has no metric"),
        }
    }

    fn same_by<I: Index, M: Measure>(
        tree: &Tree<'_, I>,
        surface: &[Vec3],
        range: core::ops::Range<usize>,
        worst: Worst,
    ) -> u32 {
        let (metrics, _) = tree.sections().metric.as_chunks::<{ rows::METRIC_BYTES }>();
        let triangles = I::corners(tree.sections().triangles);
        let (metrics, triangles) = (&metrics[range.clone()], &triangles[range.clone()]);
        let (first, limit) = (range.start as u32, squared_limit(tree.stretch()));
        let size = 1.0;
        let batched =
            measure::<I, [Vec3], M, _>(surface, metrics, triangles, limit, first, worst, size);
        let ready = surface.len() as u32;
        let single = rows::measure::<I, [Vec3], M, _, true>(
            surface, metrics, triangles, ready, limit, first, worst, size,
        );
        let bits = |(row, worst, sum): (u32, Worst, f32)| {
            (row, worst.squared.to_bits(), worst.triangle, sum.to_bits())
        };
        assert_eq!(bits(batched), bits(single), "rows {range:?}");
        single.0
    }
}
