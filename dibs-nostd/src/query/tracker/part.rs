//! The closest point of a label's part of the surface.

// Requirement: C-05

use super::Tracker;
use crate::math::round::sum_down;
use crate::query::Options;
use crate::query::search::{LabelDistance, Search};
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool};

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// How far a label's triangles are from the axis of a tool outside, or that they are farther than `limit` (mm). Nothing
    /// is remembered for the next tick.
    #[cold]
    pub(crate) fn closest_of_label<S: MovingSurface + ?Sized, T: Tool>(
        &mut self,
        surface: &S,
        tool: &T,
        within: (u8, f32),
        options: &Options,
    ) -> Result<LabelDistance, QueryError> {
        let (tree, stack) = (&self.tree, &mut self.stack);
        let all = RootSet::ALL;
        let search = Search::start(all, tree, stack, surface, tool, options, None, None)?;
        let mut found = search.over_range(options).closest_of_label(within, options)?;
        found.distance = sum_down(found.distance, -surface.position_error());
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use dibs_build::{Builder, generate};
    use fastrand::Rng;
    use glam::Vec3;

    use super::super::Tracker;
    use crate::format::MAX_STACK;
    use crate::{Budget, Capsule, Odometer, Options, Tool, Tree, TriangleRow};

    #[test]
    fn no_triangle_of_a_label_is_nearer_than_any_budget_says() {
        let mesh = generate::heart(1_280).expect("a valid size").mesh;
        let label = |rows: &[u32; 3]| {
            let centre = rows.map(|row| mesh.positions[row as usize]).iter().sum::<Vec3>() / 3.0;
            (centre.dot(Vec3::new(0.3, 0.5, 0.2)).sin() * 1.5).round() as i8 as u8
        };
        let labels = mesh.triangles.iter().map(label).collect();
        let built = Builder::new().labels(labels).build(&mesh).expect("builds");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        let mut tracker = Tracker::<_, MAX_STACK, 64>::new(&tree).expect("deep enough");
        let mut rng = Rng::with_seed(37);
        let mut vector = |size: f32| Vec3::from([(); 3].map(|()| (rng.f32() - 0.5) * size));
        let (mut known, mut cut) = (0, 0);
        for _ in 0..200 {
            let corner = rows[(vector(1.0).x.abs() * 1_200.0) as usize];
            let tip = corner * 1.1 + vector(8.0);
            let tool = Capsule::new(tip, tip + corner + vector(30.0), 1.0).expect("finite");
            let mut truth = f32::INFINITY;
            for row in (0..mesh.triangles.len() as u32).map(TriangleRow) {
                if tree.label(row) == Some(1) {
                    let corners = tree.triangle(row.0).expect("a row").map(|at| rows[at as usize]);
                    let pair = tool.closest_on_triangle(&corners, f32::INFINITY);
                    truth = truth.min(pair.expect("finite").distance_squared.sqrt());
                }
            }
            for (budget, limit) in (0..60).flat_map(|at| [(at * 8, 12.0), (at * 40, 40.0)]) {
                let options = Options::new().budget(Budget::new(budget));
                let found = tracker.closest_of_label(&surface, &tool, (1, limit), &options);
                let found = found.expect("an answer");
                assert!(found.distance <= truth, "{budget} {limit}: {found:?} {truth}");
                let is_known = found.distance > truth.min(limit) - 1e-3;
                known += u32::from(is_known);
                cut += u32::from(!is_known);
                assert!(is_known || budget < 2_000, "{budget} {limit}: {found:?} {truth}");
            }
        }
        std::println!("{known} known, {cut} cut");
        assert!(known > 2_000 && cut > 2_000);
    }
}
