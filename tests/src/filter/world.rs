//! Surfaces that move at their speed limit.

use std::f64::consts::TAU;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::TriangleRow;
use fastrand::Rng;
use glam::{DVec3, Vec3};

use crate::surfaces::{self, ball, cuboid, sheet};

/// A surface, and a point near it.
pub struct Scene {
    /// Its name.
    pub name: &'static str,
    /// Its tree.
    pub tree: BuiltTree,
    /// Its vertices at rest, in the tree's order.
    pub rest: Vec<Vec3>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Their labels, if it has some.
    pub labels: Vec<u8>,
    /// Where tools start: outside the surface.
    pub from: Vec3,
    /// Middle of the region to walk in.
    pub middle: Vec3,
    /// Whether the walls may close on the tool.
    pub closes: bool,
    /// Whether there is always a way out.
    pub is_convex: bool,
}

/// Stretch that the trees are built for.
const STRETCH: f32 = 2.0;

fn scene(
    name: &'static str,
    mesh: &Mesh,
    [from, middle]: [Vec3; 2],
    label: Option<fn(Vec3) -> u8>,
) -> Scene {
    let builder = Builder::new().stretch(STRETCH);
    let builder = match label {
        None => builder,
        Some(label) => {
            let corners = |rows: &[u32; 3]| rows.map(|row| mesh.positions[row as usize]);
            let centre = |rows| corners(rows).iter().sum::<Vec3>() / 3.0 - middle;
            builder.labels(mesh.triangles.iter().map(|rows| label(centre(rows))).collect())
        }
    };
    let tree = builder.build(mesh).expect("a valid mesh");
    let rest = tree.to_rows(&mesh.positions);
    let view = tree.tree::<u16>().expect("16-bit indices");
    let triangles = surfaces::triangles(&view);
    let labels = (0..).map_while(|row| view.label(TriangleRow(row))).collect();
    let (closes, is_convex) = (false, false);
    Scene { name, tree, rest, triangles, labels, from, middle, closes, is_convex }
}

/// A wall, a corner, a groove, a gap, a gap that closes, a spike, a plate thinner than the stand-off, a ball, a heart and a folded brain.
///
/// # Panics
/// Never: the meshes are valid.
#[must_use]
pub fn scenes() -> Vec<Scene> {
    scenes_of(None)
}

/// The same, with a label for each triangle, by its middle as seen from the region's.
///
/// # Panics
/// Never: the meshes are valid.
#[must_use]
pub fn labelled_scenes(label: fn(Vec3) -> u8) -> Vec<Scene> {
    scenes_of(Some(label))
}

fn scenes_of(label: Option<fn(Vec3) -> u8>) -> Vec<Scene> {
    let scene = |name, mesh: &Mesh, from, middle| scene(name, mesh, [from, middle], label);
    let gap = || sheet(12, 40.0, |x, _| 30.0 * ((x.abs() - 3.5) / 3.0).clamp(0.0, 1.0));
    let plate = || {
        let (positions, triangles) =
            cuboid(Vec3::new(-20.0, -20.0, -0.1), Vec3::new(20.0, 20.0, 0.1));
        Mesh { positions: positions.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() }
    };
    let spike = || {
        let place = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 25.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        Mesh { positions: place.map(Vec3::from).to_vec(), triangles, ..Mesh::default() }
    };
    let heart = generate::heart(320).expect("a valid size").mesh;
    let side = heart.positions.iter().copied().min_by(|a, b| a.x.total_cmp(&b.x));
    let side = side.expect("has vertices");
    let brain = generate::brain(500).expect("a valid size");
    let top = brain.positions.iter().copied().max_by(|a, b| a.z.total_cmp(&b.z));
    let top = top.expect("has vertices");
    let up = |z: f32| Vec3::new(0.4, 0.3, z);
    let convex = |scene| Scene { is_convex: true, ..scene };
    vec![
        scene("wall", &sheet(6, 60.0, |_, _| 0.0), up(9.0), Vec3::ZERO),
        scene("corner", &sheet(10, 40.0, |x, y| x.abs() + y.abs()), up(14.0), Vec3::Z * 4.0),
        scene("groove", &sheet(10, 40.0, |x, _| 4.7 * x.abs()), up(40.0), Vec3::Z * 15.0),
        scene("gap", &gap(), up(14.0), Vec3::Z * 6.0),
        Scene { closes: true, ..scene("closing gap", &gap(), up(14.0), Vec3::Z * 6.0) },
        convex(scene("spike", &spike(), up(34.0), Vec3::Z * 22.0)),
        convex(scene("plate", &plate(), up(9.0), Vec3::ZERO)),
        convex(scene("ball", &ball(2), up(49.0), Vec3::Z * 38.0)),
        scene("heart", &heart, side - Vec3::X * 9.0, side),
        scene("brain", &brain, top + Vec3::Z * 9.0, top),
    ]
}

/// A motion of a surface in which no point exceeds its speed limit.
#[derive(Clone, Copy, Debug)]
pub enum Course {
    /// It does not move.
    Rests,
    /// It oscillates rigidly.
    Swings(Vec3, f64),
    /// A wave travels over it.
    Waves(Vec3, Vec3, f64),
    /// Its walls move towards the plane x = 0 and back.
    Squeezes(f64),
    /// It drifts rigidly.
    Drifts(Vec3),
}

impl Course {
    /// A random one of these, with a speed limit (mm/s).
    #[must_use]
    pub fn any(scene: &Scene, speed: f64, rng: &mut Rng) -> Self {
        let unit = crate::deform::unit(rng);
        let rate = TAU * (0.5 + 12.0 * rng.f64());
        let size = (speed / rate) as f32 * 0.999;
        match rng.u32(..5) {
            _ if speed == 0.0 => Self::Rests,
            _ if scene.closes => Self::Squeezes(speed * 0.999),
            0 => Self::Rests,
            1 | 2 => Self::Swings(unit * size, rate),
            3 => {
                // The wave stretches by at most a tenth.
                let wave = crate::deform::unit(rng) * (0.1 / size).min(0.3);
                Self::Waves(unit * size, wave, rate)
            }
            _ => Self::Drifts(unit * speed as f32 * 0.999),
        }
    }

    /// A vertex at a time (s).
    #[must_use]
    pub fn at(&self, rest: Vec3, time: f64) -> DVec3 {
        let rest64 = rest.as_dvec3();
        match *self {
            Self::Rests => rest64,
            Self::Swings(size, rate) => rest64 + size.as_dvec3() * (rate * time).sin(),
            Self::Waves(size, wave, rate) => {
                let phase = f64::from(wave.dot(rest));
                rest64 + size.as_dvec3() * ((phase + rate * time).sin() - phase.sin())
            }
            Self::Squeezes(speed) => {
                // Speed grows with the distance from the plane; the farthest points have the full speed.
                let rate = speed / 20.0 / 0.5;
                rest64 * DVec3::new(1.0 - 0.5 * (rate * time).sin().abs(), 1.0, 1.0)
            }
            Self::Drifts(velocity) => rest64 + velocity.as_dvec3() * (0.1 * (time / 0.1).sin()),
        }
    }
}
