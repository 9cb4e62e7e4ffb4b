//! OpenIGTLink messages, written from the protocol's specification.

use dibs_build::glam::Vec3;

/// ECMA-182's, bit by bit.
pub fn crc(bytes: &[u8]) -> u64 {
    let step = |crc: u64, _| crc << 1 ^ if crc >> 63 == 1 { 0x42F0_E1EB_A9EA_3693 } else { 0 };
    bytes.iter().fold(0, |crc, &byte| (0..8).fold(crc ^ u64::from(byte) << 56, step))
}

/// A message of version 1 or 2; the latter has an extended header and metadata.
pub fn message(version: u16, kind: &str, device: &str, content: &[u8]) -> Vec<u8> {
    let mut body = content.to_vec();
    if version == 2 {
        let head = [[0, 12], [0, 10], [0, 0], [0, 4], [0, 0], [0, 7]].concat();
        let (index, text) = ([[0, 1], [0, 2], [0, 3], [0, 0], [0, 2]].concat(), b"keok");
        body = [&head[..], content, &index, text].concat();
    }
    let mut message = version.to_be_bytes().to_vec();
    message.extend(kind.bytes().chain([0; 12]).take(12));
    message.extend(device.bytes().chain([0; 20]).take(20));
    message.extend([0; 8]);
    message.extend((body.len() as u64).to_be_bytes());
    message.extend(crc(&body).to_be_bytes());
    message.extend(body);
    message
}

/// The message, with this time (s) in its header, which no checksum covers.
pub fn timed(mut message: Vec<u8>, time: f64) -> Vec<u8> {
    let fraction = (time.fract() * 4_294_967_296.0) as u32;
    message[34..38].copy_from_slice(&(time as u32).to_be_bytes());
    message[38..42].copy_from_slice(&fraction.to_be_bytes());
    message
}

fn floats(points: &[Vec3]) -> Vec<u8> {
    points.iter().flat_map(Vec3::to_array).flat_map(f32::to_be_bytes).collect()
}

pub fn poly_data(points: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let polygons = triangles.iter().flat_map(|&[a, b, c]| [3, a, b, c]).flat_map(u32::to_be_bytes);
    // A cell of one point before them, as a source may draw a mark.
    let mark = [1_u32, 0].map(u32::to_be_bytes).concat();
    let count = triangles.len() as u32;
    let head = [points.len() as u32, 1, 8, 0, 0, count, 16 * count, 0, 0, 0];
    let head = head.into_iter().flat_map(u32::to_be_bytes);
    head.chain(floats(points)).chain(mark).chain(polygons).collect()
}

pub fn point_list(points: &[Vec3]) -> Vec<u8> {
    let element =
        |point: &Vec3| [&[b'n'; 64][..], &[0; 32], &[9; 4], &floats(&[*point]), &[0; 24]].concat();
    points.iter().flat_map(element).collect()
}

/// f64 numbers: millimetres as metres, which lose nothing.
pub fn array_in_metres(points: &[Vec3]) -> Vec<u8> {
    let numbers = points.iter().flat_map(Vec3::to_array).map(|x| f64::from(x) / 1000.0);
    let count = (points.len() as u16).to_be_bytes();
    [11, 2, count[0], count[1], 0, 3]
        .into_iter()
        .chain(numbers.flat_map(f64::to_be_bytes))
        .collect()
}

pub fn array(points: &[Vec3]) -> Vec<u8> {
    let count = (points.len() as u16).to_be_bytes();
    [10, 2, count[0], count[1], 0, 3].into_iter().chain(floats(points)).collect()
}
