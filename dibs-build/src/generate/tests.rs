//! Properties of every generated surface, for any number of triangles.

// Requirement: M-03

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use super::{GenerateError, MovingMesh, brain, heart};
use crate::Mesh;

const HEARTS: [u32; 6] = [320, 322, 500, 1000, 2222, 10272];
const BRAINS: [u32; 4] = [500, 502, 1000, 5000];

fn corners(positions: &[Vec3], triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|vertex| positions[vertex as usize].as_dvec3())
}

/// Asserts that the mesh is closed, manifold, consistently oriented, of one component and genus 0, and faces outwards.
fn assert_sound(mesh: &Mesh, triangles: u32) {
    assert_eq!(mesh.triangles.len(), triangles as usize);
    assert!(mesh.positions.iter().all(|position| position.is_finite()));

    let mut facing = HashMap::new();
    let mut component: Vec<usize> = (0..mesh.positions.len()).collect();
    fn root(component: &[usize], mut vertex: usize) -> usize {
        while component[vertex] != vertex {
            vertex = component[vertex];
        }
        vertex
    }
    for &[a, b, c] in &mesh.triangles {
        for (from, to, opposite) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert_ne!(from, to);
            assert_eq!(facing.insert((from, to), opposite), None, "edge {from}-{to} used twice");
            let (one, other) = (root(&component, from as usize), root(&component, to as usize));
            component[one.max(other)] = one.min(other);
        }
    }
    assert!(facing.keys().all(|&(from, to)| facing.contains_key(&(to, from))), "open border");
    // This also fails for vertices that no triangle uses.
    assert!((0..component.len()).all(|vertex| root(&component, vertex) == 0), "not connected");
    let edges = facing.len() / 2;
    assert_eq!(mesh.positions.len() + mesh.triangles.len() - edges, 2, "Euler characteristic");

    // Each vertex has a single fan: walking around it meets all of its triangles.
    let mut degree = vec![0; mesh.positions.len()];
    let mut first = vec![0; mesh.positions.len()];
    for &(from, to) in facing.keys() {
        degree[from as usize] += 1;
        first[from as usize] = to;
    }
    for vertex in 0..mesh.positions.len() as u32 {
        let start = first[vertex as usize];
        let (mut other, mut steps) = (facing[&(vertex, start)], 1);
        while other != start {
            other = facing[&(vertex, other)];
            steps += 1;
        }
        assert_eq!(steps, degree[vertex as usize], "two fans at vertex {vertex}");
    }
    assert!(volume(&mesh.positions, &mesh.triangles) > 0.0, "inside out");
}

fn volume(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let parts = triangles.iter().map(|&triangle| {
        let [a, b, c] = corners(positions, triangle);
        a.dot(b.cross(c)) / 6.0
    });
    parts.sum()
}

/// The smallest angle of every triangle in degrees, smallest first.
fn smallest_angles(mesh: &Mesh) -> Vec<f64> {
    let mut angles: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|&triangle| {
            let [a, b, c] = corners(&mesh.positions, triangle);
            let angle = |at: DVec3, to: DVec3, and: DVec3| (to - at).angle_between(and - at);
            angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b)).to_degrees()
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    angles
}

/// Largest edge stretch, and largest and smallest principal stretch, of `now` against `rest`.
fn stretches(rest: &[Vec3], now: &[Vec3], triangles: &[[u32; 3]]) -> (f64, f64, f64) {
    let (mut edge, mut largest, mut smallest) = (0f64, 0f64, f64::INFINITY);
    for &triangle in triangles {
        let (before, after) = (corners(rest, triangle), corners(now, triangle));
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            edge = edge.max(after[i].distance(after[j]) / before[i].distance(before[j]));
        }
        // The deformation gradient's columns, along the first edge and across it.
        let (along, side) = (before[1] - before[0], before[2] - before[0]);
        let axis = along.normalize();
        let flat = DVec2::new(side.dot(axis), side.reject_from_normalized(axis).length());
        let first = (after[1] - after[0]) / along.length();
        let second = (after[2] - after[0] - first * flat.x) / flat.y;
        let (p, q, r) = (first.dot(first), first.dot(second), second.dot(second));
        let spread = ((p - r) * (p - r) / 4.0 + q * q).sqrt();
        largest = largest.max(((p + r) / 2.0 + spread).sqrt());
        smallest = smallest.min(((p + r) / 2.0 - spread).max(0.0).sqrt());
    }
    (edge, largest, smallest)
}

/// Pairs of triangles without a common vertex, where an edge of one pierces the other.
fn self_intersections(positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
    let boxed: Vec<_> = triangles
        .iter()
        .map(|&triangle| {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            (a.min(b).min(c), a.max(b).max(c), triangle)
        })
        .collect();
    let signed = |[a, b, c]: [DVec3; 3], d: DVec3| (b - a).cross(c - a).dot(d - a);
    let pierces = |from: DVec3, to: DVec3, target: [DVec3; 3]| {
        let [a, b, c] = target;
        let sides = [[a, b], [b, c], [c, a]].map(|[p, q]| signed([from, to, p], q));
        signed(target, from) * signed(target, to) < 0.0
            && (sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0))
    };
    let mut found = 0;
    for (index, &(low, high, one)) in boxed.iter().enumerate() {
        for &(other_low, other_high, other) in &boxed[index + 1..] {
            if low.cmpgt(other_high).any()
                || other_low.cmpgt(high).any()
                || one.iter().any(|vertex| other.contains(vertex))
            {
                continue;
            }
            let (p, q) = (corners(positions, one), corners(positions, other));
            let hit = [(0, 1), (1, 2), (2, 0)]
                .iter()
                .any(|&(i, j)| pierces(p[i], p[j], q) || pierces(q[i], q[j], p));
            found += usize::from(hit);
        }
    }
    found
}

fn checksum(mesh: &Mesh, frames: &[Vec<Vec3>]) -> u32 {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    for value in mesh.triangles.as_flattened() {
        digest.update(&value.to_le_bytes());
    }
    for position in mesh.positions.iter().chain(frames.iter().flatten()) {
        for value in position.to_array() {
            digest.update(&value.to_le_bytes());
        }
    }
    digest.finalize()
}

#[test]
fn a_heart_is_sound_and_well_shaped() {
    for triangles in HEARTS {
        let mesh = heart(triangles).unwrap().mesh;
        assert_sound(&mesh, triangles);
        let angles = smallest_angles(&mesh);
        let (least, most) = if triangles < 1000 { (3.0, 10.0) } else { (15.0, 25.0) };
        assert!(angles[0] > least, "{triangles}: {}", angles[0]);
        assert!(angles[angles.len() / 50] > most, "{triangles}: {}", angles[angles.len() / 50]);
    }
}

#[test]
fn a_heart_is_of_human_size_and_ejects_blood() {
    let MovingMesh { mesh, motion } = heart(10_272).unwrap();
    let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
    let high = mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
    assert!((80.0..110.0).contains(&(high - low).z), "{}", high - low);
    // The muscle keeps its volume to within a quarter, while the cavities shrink.
    let muscle = |frame: &[Vec3]| volume(frame, &mesh.triangles);
    let share = muscle(&motion.frames[12]) / muscle(&mesh.positions);
    assert!((0.75..1.25).contains(&share), "{share}");
}

#[test]
fn a_heart_beats_within_its_stretch_limit() {
    for triangles in HEARTS {
        let MovingMesh { mesh, motion } = heart(triangles).unwrap();
        assert_eq!(motion.frames.len(), 25);
        assert!((motion.rate / 25.0 * 60.0 - 72.0).abs() < 1e-3);
        assert_eq!(motion.frames[0], mesh.positions);
        let mut moved = 0f32;
        for (index, frame) in motion.frames.iter().enumerate() {
            // Each frame, and the midpoint to the next one, around the cycle.
            let next = &motion.frames[(index + 1) % motion.frames.len()];
            let between: Vec<Vec3> = frame.iter().zip(next).map(|(a, b)| a.midpoint(*b)).collect();
            for now in [frame, &between] {
                let (edge, largest, smallest) = stretches(&mesh.positions, now, &mesh.triangles);
                assert!(edge <= 1.45 && largest <= 1.45, "{triangles}: {edge} {largest}");
                assert!(smallest > 0.5, "{triangles}: {smallest}");
            }
            for (a, b) in frame.iter().zip(&mesh.positions) {
                moved = moved.max(a.distance(*b));
            }
        }
        assert!(moved > 10.0, "{triangles}: moves only {moved} mm");
    }
}

#[test]
fn a_heart_never_cuts_itself() {
    for triangles in [320, 500, 1000, 2222] {
        let MovingMesh { mesh, motion } = heart(triangles).unwrap();
        for frame in [0, 4, 8, 12, 20] {
            let found = self_intersections(&motion.frames[frame], &mesh.triangles);
            assert_eq!(found, 0, "{triangles} triangles, frame {frame}");
        }
    }
}

#[test]
fn a_brain_is_sound_and_well_shaped() {
    for triangles in BRAINS {
        let mesh = brain(triangles).unwrap();
        assert_sound(&mesh, triangles);
        assert_eq!(self_intersections(&mesh.positions, &mesh.triangles), 0);
        let angles = smallest_angles(&mesh);
        assert!(angles[0] > 10.0, "{triangles}: {}", angles[0]);
    }
}

#[test]
fn a_brain_is_folded() {
    let mesh = brain(5000).unwrap();
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|&triangle| {
            let [a, b, c] = corners(&mesh.positions, triangle);
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    // A body of volume V has at least the area of a ball, the cube root of 36 pi V^2; an ellipsoid of these axes has
    // little more.
    let volume = volume(&mesh.positions, &mesh.triangles);
    let smooth = (36.0 * std::f64::consts::PI * volume * volume).cbrt();
    assert!(area > 1.25 * smooth, "{area} {smooth}");
}

#[test]
fn invalid_counts_name_the_nearest_valid_one() {
    for (asked, expected) in [(0, 320), (319, 320), (1001, 1000), (u32::MAX, 1_000_000)] {
        match heart(asked).unwrap_err() {
            GenerateError::TriangleCount { nearest, .. } => assert_eq!(nearest, expected),
            other => panic!("{other}"),
        }
    }
    assert_eq!(
        brain(501).unwrap_err().to_string(),
        "a generated brain cannot have 501 triangles: \
         ask for an even number from 500 to 500000, the nearest is 500"
    );
}

/// Detects a change of the shapes, or a machine whose arithmetic gives other bits.
#[test]
fn the_shapes_are_these_to_the_last_bit() {
    let MovingMesh { mesh, motion } = heart(1000).unwrap();
    assert_eq!(checksum(&mesh, &motion.frames), 0xab0f_02f4);
    assert_eq!(checksum(&brain(1000).unwrap(), &[]), 0x80d1_e039);
}
