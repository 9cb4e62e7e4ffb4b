//! A surface embedded in moving nodes: each vertex is computed when it is read.

use glam::Vec3;

use super::Nodes;
use super::layout::Scale;
use crate::surface::motion::sealed::Sealed;
use crate::surface::{MeasuredStretch, MotionReading, MovingSurface, Odometer, Step, VertexTable};

/// The surface at a table of nodes: [`Nodes::surface`] makes one.
///
/// It has the nodes' time (between frames if they are interpolated, beyond the last if extrapolated), stretch and
/// motion. A vertex moves at most [`amplification`](Nodes::amplification) times as far as the farthest node of its
/// element: 1 inside, where weights are not negative and sum up to one.
///
/// A vertex is computed as the fourth node of its element plus weighted edges from there to the other three, which has
/// less rounding than a sum of weighted positions.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedSurface<'n, 'a, V: ?Sized> {
    nodes: &'n Nodes<'a>,
    table: &'n V,
}

impl<'n, 'a, V: VertexTable + ?Sized> EmbeddedSurface<'n, 'a, V> {
    pub(super) const fn new(nodes: &'n Nodes<'a>, table: &'n V) -> Self {
        Self { nodes, table }
    }

    /// The positions of the nodes.
    #[must_use]
    pub const fn table(&self) -> &'n V {
        self.table
    }

    /// The step from this surface to a later one, for a [`Sweep`](crate::Sweep) and a [`Tracker`](crate::Tracker), by the
    /// motion of the nodes that carry a vertex. `odometer` is from [`Nodes::odometer`]; one that counts otherwise is
    /// replaced by that. Between the two surfaces a vertex is computed from both.
    ///
    /// Cost: one pass over the nodes of both.
    pub fn step<'s, W: VertexTable + ?Sized>(
        &'s self,
        after: &'s EmbeddedSurface<'n, 'a, W>,
        odometer: &mut Odometer,
    ) -> Step<'s, Self, EmbeddedSurface<'n, 'a, W>> {
        if !odometer.counts(self.nodes.count() as usize, self.nodes.motion) {
            *odometer = self.nodes.odometer();
        }
        let carries = |node| self.nodes.carries(node);
        let step = odometer.step_of(self.table, after.table, carries);
        step.carried(self, after, self.nodes.parts.amplification)
    }

    /// Upper bound (mm) on the f32 error of a pin's and a vertex's position relative to each other and to their
    /// triangle.
    fn rounding(&self) -> f32 {
        let stretch = self.nodes.limit;
        let [node, ..] = self.nodes.element(0).unwrap_or_default();
        let size = self.table.position(node).unwrap_or(Vec3::NAN).length();
        let coordinates = size + stretch * self.nodes.parts.extent;
        let sum = 3.0 * coordinates + 16.0 * stretch * self.nodes.parts.edge;
        sum * (self.nodes.parts.amplification * ROUNDING)
    }
}

/// Half a unit in the last place of 1, plus a hundredth of it for the rounding of the bound itself.
const ROUNDING: f32 = 1.01 / 16_777_216.0;

impl<V: VertexTable + ?Sized> VertexTable for EmbeddedSurface<'_, '_, V> {
    /// The tree's vertices; 0 if the table has another number of nodes.
    fn len(&self) -> usize {
        let is_whole = self.table.len() == self.nodes.parts.nodes.len();
        if is_whole { self.nodes.parts.bindings.len() } else { 0 }
    }

    /// Cost: 16 bytes of flash, four nodes and some 30 floating point operations.
    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let ([a, b, c, d], weights) = self.nodes.binding(vertex)?;
        let d = self.table.position(d)?;
        let Scale { unit, .. } = self.nodes.parts.scale;
        let [u, v, w] = weights.map(|weight| self.nodes.parts.scale.weight(weight) as f32);
        let sum = (self.table.position(a)? - d) * u
            + (self.table.position(b)? - d) * v
            + (self.table.position(c)? - d) * w;
        Some(d + sum * unit)
    }

    fn epoch(&self) -> Option<u32> {
        self.table.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.table.stretch()
    }

    /// The nodes' error, and the rounding of f32.
    fn position_error(&self) -> f32 {
        self.table.position_error() * self.nodes.parts.amplification + self.rounding()
    }
}

impl<V: MovingSurface + ?Sized> Sealed for EmbeddedSurface<'_, '_, V> {}

impl<V: MovingSurface + ?Sized> MovingSurface for EmbeddedSurface<'_, '_, V> {
    fn motion(&self) -> Option<MotionReading> {
        self.table.motion()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use dibs_build::{Builder, Unit, Volume, generate};

    use super::*;
    use crate::surface::MotionUnit;
    use crate::tree::Tree;

    /// The odometer of a surface counts all of a vertex's motion, also of a vertex outside of its element.
    #[test]
    fn motion_counts_the_lever() {
        let mesh = generate::heart(600).expect("a valid size").mesh;
        let lattice = Volume::lattice(&mesh, [3, 3, 3]).expect("a lattice");
        let nodes = lattice.nodes().iter().map(|at| *at * 0.8).collect();
        let smaller = Volume::new(nodes, lattice.tetrahedra().to_vec()).expect("valid");
        let built = Builder::new().nodes(&smaller.bind_within(40.0)).build(&mesh).expect("bound");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let unit = MotionUnit::of(&tree);
        let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        let (mut odometer, mut longest) = (nodes.odometer(), 0.0_f32);
        for vertex in 0..nodes.vertex_count() {
            let mut next = rest.clone();
            for (node, weight) in nodes.weights(vertex).expect("in the table") {
                next[node as usize].x += if weight < 0 { -1.0 } else { 1.0 };
            }
            let before = odometer.start(rest.as_slice()).motion().expect("measured");
            let step = odometer.step(rest.as_slice(), next.as_slice());
            let after = step.after();
            let counted = nodes.surface(&after).motion().expect("measured");
            let at = |frame: &[Vec3]| nodes.surface(frame).position(vertex).expect("a vertex");
            let distance = at(&next).distance(at(&rest));
            let counted = counted.since(&before).expect("one run");
            assert!(
                counted >= unit.units_of(distance - 1e-4) && distance > 0.99,
                "{vertex}: {distance}"
            );
            longest = longest.max(distance);
        }
        assert!(longest > 1.5 && (longest - nodes.amplification()).abs() < 1e-3, "{longest}");
    }

    /// An odometer of the same nodes in another tree is replaced: its readings are no earlier ones of this tree.
    #[test]
    fn an_odometer_of_another_tree_is_replaced() {
        let mesh = generate::heart(600).expect("a valid size").mesh;
        let lattice = Volume::lattice(&mesh, [3, 3, 3]).expect("a lattice");
        let builder = Builder::new().nodes(&lattice);
        let built = builder.build(&mesh).expect("held");
        let other = builder.unit(Unit::Metre).build(&mesh).expect("held");
        let [tree, other] =
            [&built, &other].map(|built| Tree::<u16>::from_bytes(built.blob()).expect("valid"));
        let [nodes, others] = [&tree, &other].map(|tree| Nodes::of(tree).expect("valid"));
        assert!(nodes.count() == others.count() && tree.checksum() != other.checksum());
        let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        let next: Vec<Vec3> = rest.iter().map(|at| *at + Vec3::X).collect();
        let (from, to) = (nodes.surface(&rest[..]), nodes.surface(&next[..]));
        for (mut odometer, is_kept) in [(nodes.odometer(), true), (others.odometer(), false)] {
            let before = odometer.start(rest.as_slice()).motion().expect("measured");
            let step = from.step(&to, &mut odometer);
            let after = step.after().motion().expect("measured");
            assert!(step.length() >= 0.999, "{}", step.length());
            assert_eq!(after.since(&before).is_some(), is_kept);
        }
    }
}
