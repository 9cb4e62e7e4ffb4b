//! Kernels beside those of another library.

// Requirement: A-01

use dibs_nostd::{Sphere, Tool};
use fastrand::Rng;
use glam::Vec3;
use parry3d::query::PointQuery;
use parry3d::shape::Triangle;

fn vector(rng: &mut Rng) -> Vec3 {
    let mut next = || rng.f32() * 2.0 - 1.0;
    Vec3::new(next(), next(), next())
}

/// parry3d's projection onto a triangle is exact up to rounding for well-shaped triangles.
#[test]
fn spheres_agree_with_parry() {
    let to_parry = |v: Vec3| parry3d::math::Vector::new(v.x, v.y, v.z);
    let mut rng = Rng::with_seed(11);
    let (mut compared, mut worst, mut worst_point) = (0, 0.0_f64, 0.0_f32);
    for _ in 0..200_000 {
        let corners @ [a, b, c] = [(); 3].map(|()| vector(&mut rng));
        let area = (b - a).cross(c - a).length();
        if area < 0.2 * (b - a).length() * (c - a).length() {
            continue;
        }
        let center = 3.0 * vector(&mut rng);
        let [pa, pb, pc] = corners.map(to_parry);
        let theirs = Triangle::new(pa, pb, pc).project_local_point(to_parry(center), false).point;
        let theirs = Vec3::new(theirs.x, theirs.y, theirs.z);
        let sphere = Sphere::new(center, 0.25).expect("finite");
        let ours = sphere.closest_on_triangle(&corners, f32::INFINITY).expect("a pair");
        let distance = center.as_dvec3().distance(theirs.as_dvec3());
        let difference = (distance - f64::from(ours.distance_squared).sqrt()).abs();
        worst = worst.max(difference);
        // The distance hardly changes around its minimum, so the points differ more than the distances.
        worst_point = worst_point.max(theirs.distance(ours.on_surface));
        compared += 1;
    }
    println!("{compared} cases; worst difference from parry: {worst:e}, points {worst_point:e}");
    assert!(compared > 50_000);
    assert!(worst < 2e-6 && worst_point < 3e-3);
}
