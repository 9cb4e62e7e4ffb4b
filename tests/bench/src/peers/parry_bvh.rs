//! parry3d 0.31's `Bvh`, used directly: its tree and refit, exact bounds and kernels.

use std::cell::Cell;

use dibs_build::Mesh;
use dibs_tests::baselines::bounds::Axis;
use dibs_tests::baselines::boxes::Start;
use dibs_tests::method::{Found, Layout, Method, Probe};
use glam::{Vec3, Vec3A};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

use super::parry_trimesh::to_parry;

pub struct ParryBvh {
    tree: Bvh,
    triangles: Vec<[u32; 3]>,
    positions: Vec<Vec3>,
    start: Start,
}

impl ParryBvh {
    pub fn new(mesh: &Mesh) -> Self {
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(|&t| bounds(&mesh.positions, t)).collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            triangles: mesh.triangles.clone(),
            positions: mesh.positions.clone(),
            start: Start::Cold,
        }
    }

    /// The same, with every search started from the last answer's triangle.
    pub fn warm(self) -> Self {
        Self { start: Start::Last(None), ..self }
    }

    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    fn closest<A: Axis>(&mut self, tool: &A) -> Found {
        let axis = tool.prepare();
        let first = match self.start {
            Start::Last(Some(triangle)) => {
                tool.closest_on_triangle(&self.corners(triangle as u32), f32::INFINITY)
            }
            _ => None,
        };
        let first = first.map(|pair| pair.distance_squared);
        let [node_tests, triangle_tests] = [Cell::new(0), Cell::new(0)];
        let found = self.tree.find_best(
            first.unwrap_or(f32::MAX),
            |node, best| {
                node_tests.set(node_tests.get() + 1);
                A::bound(&axis, from_parry(node.mins()), from_parry(node.maxs()), best)
            },
            |triangle, best| {
                triangle_tests.set(triangle_tests.get() + 1);
                tool.closest_on_triangle(&self.corners(triangle), best)
                    .map(|pair| pair.distance_squared)
            },
        );
        if let (Start::Last(last), Some((triangle, _))) = (&mut self.start, found) {
            *last = Some(triangle as usize);
        }
        triangle_tests.set(triangle_tests.get() + u32::from(first.is_some()));
        let squared = found.map(|(_, squared)| squared).or(first).unwrap_or(f32::INFINITY);
        let separation = (squared.sqrt() - tool.radius()).max(0.0);
        Found { separation, tests: Some([node_tests.get(), triangle_tests.get()]) }
    }
}

fn from_parry(v: Vector) -> Vec3A {
    Vec3A::new(v.x, v.y, v.z)
}

#[inline(always)]
fn bounds(positions: &[Vec3], triangle: [u32; 3]) -> Aabb {
    let [a, b, c] = triangle.map(|v| positions[v as usize]);
    Aabb::new(to_parry(a.min(b).min(c)), to_parry(a.max(b).max(c)))
}

impl Method for ParryBvh {
    fn load(&mut self, positions: &[Vec3]) {
        self.positions.copy_from_slice(positions);
    }

    fn update(&mut self) {
        for (number, &triangle) in (0..).zip(&self.triangles) {
            let bounds = bounds(&self.positions, triangle);
            let _ = self.tree.insert_or_update_partially(bounds, number, 0.0);
        }
        self.tree.refit_without_opt();
    }

    fn find(&mut self, tool: &Probe) -> Found {
        match tool {
            Probe::Sphere(sphere) => self.closest(sphere),
            Probe::Capsule(capsule) => self.closest(capsule),
        }
    }
}

impl Layout for ParryBvh {
    type Position = Vec3;

    fn positions_mut(&mut self) -> &mut [Vec3] {
        &mut self.positions
    }

    fn vertex(&self, row: usize) -> u32 {
        row as u32
    }
}
