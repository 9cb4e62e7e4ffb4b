//! parry3d 0.31 as shipped: `TriMesh::set_vertices`, which refits, and `query::distance`.

use dibs_build::Mesh;
use dibs_nostd::Tool;
use dibs_tests::method::{Found, Layout, Method, Probe};
use glam::Vec3;
use parry3d::math::{Pose, Vector};
use parry3d::query::distance;
use parry3d::shape::{Ball, Capsule, TriMesh};

pub struct ParryTriMesh {
    mesh: TriMesh,
    positions: Vec<Vector>,
}

impl ParryTriMesh {
    pub fn new(mesh: &Mesh) -> Self {
        let positions: Vec<Vector> = mesh.positions.iter().copied().map(to_parry).collect();
        let mesh = TriMesh::new(positions.clone(), mesh.triangles.clone()).expect("has triangles");
        Self { mesh, positions }
    }
}

pub fn to_parry(point: Vec3) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

impl Method for ParryTriMesh {
    fn load(&mut self, positions: &[Vec3]) {
        self.positions.clear();
        self.positions.extend(positions.iter().copied().map(to_parry));
    }

    fn update(&mut self) {
        self.mesh.set_vertices(&self.positions);
    }

    fn find(&mut self, tool: &Probe) -> Found {
        let still = Pose::IDENTITY;
        let found = match tool {
            Probe::Sphere(sphere) => {
                let at = Pose::from_translation(to_parry(sphere.centre()));
                distance(&still, &self.mesh, &at, &Ball::new(sphere.radius()))
            }
            Probe::Capsule(capsule) => {
                let (start, end) = (to_parry(capsule.start()), to_parry(capsule.end()));
                let shape = Capsule::new(start, end, capsule.radius());
                distance(&still, &self.mesh, &still, &shape)
            }
        };
        Found { separation: found.expect("supported shapes").distance, tests: None }
    }
}

impl Layout for ParryTriMesh {
    type Position = Vector;

    fn positions_mut(&mut self) -> &mut [Vector] {
        &mut self.positions
    }

    fn vertex(&self, row: usize) -> u32 {
        row as u32
    }
}
