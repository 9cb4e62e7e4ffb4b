//! parry3d 0.31's `Bvh`, used directly: its tree and refit, exact bounds and kernels.

use std::cell::Cell;

use dibs_build::Mesh;
use dibs_tests::baselines::bounds::Axis;
use dibs_tests::method::{Found, Method, Probe};
use glam::{Vec3, Vec3A};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

use super::parry_trimesh::to_parry;

pub struct ParryBvh {
    tree: Bvh,
    triangles: Vec<[u32; 3]>,
    positions: Vec<Vec3>,
}

impl ParryBvh {
    pub fn new(mesh: &Mesh) -> Self {
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(|&t| bounds(&mesh.positions, t)).collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            triangles: mesh.triangles.clone(),
            positions: mesh.positions.clone(),
        }
    }

    fn closest<A: Axis>(&self, tool: &A) -> Found {
        let axis = tool.prepare();
        let [node_tests, triangle_tests] = [Cell::new(0), Cell::new(0)];
        let found = self.tree.find_best(
            f32::MAX,
            |node, best| {
                node_tests.set(node_tests.get() + 1);
                A::bound(&axis, from_parry(node.mins()), from_parry(node.maxs()), best)
            },
            |triangle, best| {
                triangle_tests.set(triangle_tests.get() + 1);
                let corners = self.triangles[triangle as usize].map(|v| self.positions[v as usize]);
                tool.closest_on_triangle(&corners, best).map(|pair| pair.distance_squared)
            },
        );
        let squared = found.map_or(f32::INFINITY, |(_, squared)| squared);
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
