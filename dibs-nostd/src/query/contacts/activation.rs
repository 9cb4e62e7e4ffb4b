//! A contact's activation, so that its force neither starts nor ends with a step.
//!
//! A contact starts next to a lower one, while the path down to that one crosses no ridge. There its activation is 0.
//! It grows with the prominence, and is 1 once that is a 64th of the contact's distance: some 10 degrees, seen from the
//! axis. The closest contact has activation 1. So has one at the same distance, whatever the prominence, so that
//! nothing jumps when two contacts change their order; the activation falls with the difference in height.
//!
//! A change of all heights by `e` changes a prominence by at most `2 e` (persistence: Cohen-Steiner, Edelsbrunner &
//! Harer 2007). So an activation changes by at most `256 / distance` of the motion. Between flat walls it is at most
//! `45 / distance`, since a prominence there grows by the sine of the 10 degrees.

// Requirement: C-04

use super::add::Pair;
use super::basins::{Basins, NearTriangle};
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::query::made::Tests;
use crate::query::prices::ACTIVATION;
use crate::unavailable::QueryError;
use crate::{Budget, Index, Tool, Tree, VertexTable};

/// A contact has activation 0 up to a prominence of this fraction of its distance, and 1 from twice that on.
const PROMINENCE: f32 = 1.0 / 128.0;

/// Most paths at a time that lead out of the visited triangles.
const PATHS: usize = 48;

/// Most triangles visited.
const STEPS: usize = 128;

/// The prominence (mm) up to which a contact at this distance has activation 0.
pub(super) fn least_prominence(distance: f32, (most, error): (f32, f32)) -> f32 {
    let prominence = distance * PROMINENCE;
    smaller(most, prominence) + error
}

#[derive(Clone, Copy)]
struct Path {
    height: f32,
    entry: u16,
}

/// Tests triangles as long as the budget lasts.
pub(super) struct TriangleTester<'p, 'a, I, V: ?Sized, T> {
    pub pair: &'p Pair<'a, I, V, T>,
    /// Heights beyond this do not matter.
    pub limit: f32,
    pub accuracy: f32,
    /// Node tests left.
    pub left: u32,
    pub made: Tests,
    /// Whether [work besides tests](crate::query::prices) counts.
    pub is_priced: bool,
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> TriangleTester<'_, '_, I, V, T> {
    /// Pays for a triangle's test; `None` if the budget ran out.
    fn pay(&mut self) -> Option<()> {
        self.left = self.left.checked_sub(Budget::TRIANGLE)?;
        self.made.triangle_tests = self.made.triangle_tests.saturating_add(1);
        Some(())
    }

    /// Pays for work besides tests, if it has a price; `None` if the budget does not cover it.
    #[inline(always)]
    pub fn pay_for(&mut self, price: u32) -> Option<()> {
        if self.is_priced {
            self.left = self.left.checked_sub(price)?;
            self.made.node_tests = self.made.node_tests.saturating_add(price);
        }
        Some(())
    }

    /// A triangle; `None` if the budget ran out.
    pub fn triangle(&mut self, row: u32) -> Result<Option<NearTriangle>, QueryError> {
        let Some(()) = self.pay() else { return Ok(None) };
        self.pair.near(row, self.limit, self.accuracy).map(Some)
    }

    /// The distance of an edge; `None` if the budget ran out.
    pub fn edge(&mut self, row: u32, edge: u32) -> Result<Option<f32>, QueryError> {
        let Some(()) = self.pay() else { return Ok(None) };
        self.pair.edge_distance(row, edge, self.limit).map(Some)
    }
}

impl<const N: usize> Basins<N> {
    /// The activation of the contact at a triangle, from 0 to 1. It is 1 if memory or budget ran out.
    ///
    /// Follows the paths out of its basin, the lowest first. `most` limits the prominence below which the activation is
    /// 0, for a distant axis; `error` is that of two heights. Triangles that `is_left_out` are not crossed.
    pub fn activation<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        tree: &Tree<'_, I>,
        row: u32,
        prominences: (f32, f32),
        is_left_out: impl Fn(u32) -> bool,
        tester: &mut TriangleTester<'_, '_, I, V, T>,
    ) -> Result<f32, QueryError> {
        self.forget();
        let Some((entry, own)) =
            self.find(row).and_then(|entry| Some((entry, self.height(entry)?)))
        else {
            return Ok(1.0);
        };
        let Some(()) = tester.pay_for(ACTIVATION) else { return Ok(1.0) };
        let none = least_prominence(own, prominences);
        let full = 2.0 * none;
        let mut least = full;
        let mut paths = [Path { height: own, entry }; PATHS];
        let mut count = 1;
        for _ in 0..STEPS {
            let Some(Path { height, entry }) = take_lowest(&mut paths, &mut count) else { break };
            let prominence = height - own;
            if !(prominence < least) {
                break;
            }
            if self.is_marked(entry) {
                continue;
            }
            self.mark(entry);
            let (Some(near), Some(())) = (self.at(entry), tester.pay()) else { return Ok(1.0) };
            // Next to a point that is hardly lower, the prominence does not matter.
            let tied = full - (own - sqrt(near.square));
            let parted = larger(prominence, tied);
            if parted < least {
                least = parted;
            }
            for edge in 0..3 {
                let Some(across) = tree.row_across(near.row, edge) else { continue };
                if is_left_out(across) {
                    continue;
                }
                let Some(next) = self.entry(across, &mut |row| tester.triangle(row))? else {
                    return Ok(1.0);
                };
                let beyond = self.height(next).unwrap_or(f32::INFINITY);
                let mut over = larger(height, beyond);
                if self.is_marked(next) || !(over - own < least) {
                    continue;
                }
                if !near.point.is_on(edge) {
                    let Some(edge) = tester.edge(near.row, edge)? else { return Ok(1.0) };
                    over = larger(over, edge);
                }
                if over - own < least {
                    let Some(path) = paths.get_mut(count) else { return Ok(1.0) };
                    *path = Path { height: over, entry: next };
                    count += 1;
                }
            }
        }
        Ok(if least > none { (least - none) / none } else { 0.0 })
    }
}

/// Removes the lowest of the first `count` paths.
fn take_lowest(paths: &mut [Path; PATHS], count: &mut usize) -> Option<Path> {
    let last = count.checked_sub(1)?;
    let (&lowest, _) = paths.split_first()?;
    let (mut at, mut lowest) = (0, lowest);
    for (index, &path) in paths.iter().enumerate().take(*count) {
        if path.height < lowest.height {
            (at, lowest) = (index, path);
        }
    }
    let moved = *paths.get(last)?;
    *paths.get_mut(at)? = moved;
    *count = last;
    Some(lowest)
}

#[cfg(test)]
mod tests {
    use dibs_build::{Builder, Mesh};
    use glam::Vec3;

    use crate::format::MAX_STACK;
    use crate::{Capsule, Contacts, Options, Query, Tree};

    /// Adds a strip of squares of half a millimetre, 40 mm long and 4 mm wide.
    fn add_strip(mesh: &mut Mesh, position: impl Fn(f32, f32) -> Vec3) {
        const LONG: u32 = 80;
        const WIDE: u32 = 8;
        let first = mesh.positions.len() as u32;
        for y in 0..=WIDE {
            for x in 0..=LONG {
                mesh.positions.push(position(0.5 * x as f32 - 20.0, 0.5 * y as f32 - 2.0));
                if x < LONG && y < WIDE {
                    let a = first + y * (LONG + 1) + x;
                    let (b, c, d) = (a + 1, a + LONG + 1, a + LONG + 2);
                    mesh.triangles.extend([[a, b, d], [a, d, c]]);
                }
            }
        }
    }

    /// Below the axis a whole row of squares is equally near, and a path leads out of each triangle.
    #[test]
    fn a_wall_with_more_paths_than_are_remembered_acts_fully() {
        let mut mesh = Mesh::default();
        add_strip(&mut mesh, |x, y| Vec3::new(x, y, 0.0));
        // A nearer wall beside the axis.
        add_strip(&mut mesh, |x, y| Vec3::new(x, 4.15, y + 4.0));
        let built = Builder::new().build(&mesh).expect("builds");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<_, MAX_STACK>::new(&tree).expect("deep enough");
        let [start, end] = [-18.0, 18.0].map(|x| Vec3::new(x, 0.25, 4.0));
        let tool = Capsule::new(start, end, 1.0).expect("finite");
        let mut contacts = Contacts::<8, 4096>::new();
        let options = Options::cold();
        query.contacts(rows.as_slice(), &tool, 6.0, &options, &mut contacts).expect("an answer");
        assert_eq!(contacts.len(), 2, "{contacts:?}");
        for (contact, separation) in contacts.iter().zip([2.9, 3.0]) {
            assert!((contact.separation - separation).abs() < 1e-3, "{contact:?}");
            assert_eq!(contact.activation, 1.0, "{contact:?}");
        }
    }
}
