//! A surface's share of a controller's memory: two buffers of positions, and at most 1,100 bytes for both of their
//! ends, the assembler, and the stretch of every region.

use dibs_nostd::{Assembler, FrameReader, Frames, StretchMonitor};

/// Bytes besides the positions, of a surface of `N` vertices.
const fn besides<const N: usize>() -> usize {
    size_of::<Frames<N>>()
        + size_of::<FrameReader<'static, N>>()
        + size_of::<Assembler<'static, StretchMonitor<'static, u16>, N>>()
        - 2 * 12 * N
}

/// References on this computer are at least as long as the board's, so the board takes no more.
#[test]
fn a_surface_takes_1100_bytes_besides_its_positions() {
    let all = [besides::<162>(), besides::<5_138>(), besides::<65_536>()];
    println!("{all:?} bytes besides 24 a vertex");
    assert!(all.iter().all(|&bytes| bytes == all[0] && bytes <= 1_100), "{all:?}");
}
