//! Converts between numbers and the bytes of an array.

use dibs_build::glam::DVec3;

/// Reads points of f64.
pub fn points(bytes: &[u8]) -> Vec<DVec3> {
    let (numbers, _) = bytes.as_chunks::<8>();
    let (points, _) = numbers.as_chunks::<3>();
    points.iter().map(|point| DVec3::from_array(point.map(f64::from_le_bytes))).collect()
}

/// Reads numbers of f64.
pub fn doubles(bytes: &[u8]) -> Vec<f64> {
    let (numbers, _) = bytes.as_chunks::<8>();
    numbers.iter().copied().map(f64::from_le_bytes).collect()
}

/// Reads numbers of f32.
pub fn floats(bytes: &[u8]) -> Vec<f32> {
    let (numbers, _) = bytes.as_chunks::<4>();
    numbers.iter().copied().map(f32::from_le_bytes).collect()
}

/// Reads triangles of u32, or cells with another number of corners.
pub fn cells<const CORNERS: usize>(bytes: &[u8]) -> Vec<[u32; CORNERS]> {
    let (numbers, _) = bytes.as_chunks::<4>();
    let (cells, _) = numbers.as_chunks::<CORNERS>();
    cells.iter().map(|corners| corners.map(u32::from_le_bytes)).collect()
}

/// The bytes of points.
pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Vec<u8> {
    points.into_iter().flat_map(|point| point.to_array()).flat_map(f64::to_le_bytes).collect()
}
