//! Packs data into a page, without loss.

use anyhow::Result;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use dibs_build::glam::Vec3;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::Write;

/// Rearranges a motion's words for the compressor. Each word becomes its difference from the frame before, with the
/// sign in the lowest bit. The lowest bytes of all words come first, then the next bytes. `viewer/src/motion.rs`
/// reverses it.
pub fn words(frames: &[Vec<Vec3>]) -> Vec<u8> {
    let zero = vec![Vec3::ZERO; frames.first().map_or(0, Vec::len)];
    let befores = std::iter::once(&zero).chain(frames);
    let codes: Vec<[u8; 4]> = befores
        .zip(frames)
        .flat_map(|(before, frame)| before.iter().zip(frame))
        .flat_map(|(before, now)| {
            [0, 1, 2].map(|axis| (before[axis].to_bits(), now[axis].to_bits()))
        })
        .map(|(before, now)| {
            let change = now.wrapping_sub(before).cast_signed();
            ((change << 1) ^ (change >> 31)).to_le_bytes()
        })
        .collect();
    (0..4).flat_map(|plane| codes.iter().map(move |code| code[plane])).collect()
}

/// The tools of a path, or the record of its ticks, as little-endian f32: how many numbers a tool has, which differs
/// between spheres and capsules, and the numbers. `viewer/page/path.js` reads it.
pub fn path(tools: &[Vec<f32>]) -> Vec<u8> {
    let counted = |tool: &Vec<f32>| [&[tool.len() as f32][..], tool].concat();
    tools.iter().flat_map(counted).flat_map(f32::to_le_bytes).collect()
}

/// Compressed bytes as text.
pub fn text(bytes: &[u8]) -> Result<String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(STANDARD.encode(encoder.finish()?))
}
