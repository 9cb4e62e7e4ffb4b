//! Exhaustive search without a tree, with the kernels' early rejection.

use dibs_build::Mesh;
use dibs_nostd::Tool;
use glam::Vec3;

use crate::method::{Found, Method, Probe};

/// Searches every triangle at every query.
pub struct Exhaustive {
    triangles: Vec<[u32; 3]>,
    positions: Vec<Vec3>,
}

impl Exhaustive {
    /// Uses the mesh's triangles in the mesh's order.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        Self { triangles: mesh.triangles.clone(), positions: mesh.positions.clone() }
    }

    fn closest(&self, tool: &impl Tool) -> Found {
        let mut best = f32::INFINITY;
        for triangle in &self.triangles {
            let corners = triangle.map(|v| self.positions[v as usize]);
            if let Some(pair) = tool.closest_on_triangle(&corners, best) {
                best = pair.distance_squared;
            }
        }
        let separation = (best.sqrt() - tool.radius()).max(0.0);
        Found { separation, tests: Some([0, self.triangles.len() as u32]) }
    }
}

impl Method for Exhaustive {
    fn load(&mut self, positions: &[Vec3]) {
        self.positions.copy_from_slice(positions);
    }

    fn update(&mut self) {}

    fn find(&mut self, tool: &Probe) -> Found {
        match tool {
            Probe::Sphere(sphere) => self.closest(sphere),
            Probe::Capsule(capsule) => self.closest(capsule),
        }
    }
}
