//! A surface's share of a controller's memory: two or three buffers of positions, and some bytes for both of their ends,
//! the assembler, and the stretch of every region.

use dibs_nostd::wire::NoMac;
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
fn a_surface_takes_1550_bytes_besides_its_positions() {
    let all = [besides::<162>(), besides::<5_138>(), besides::<65_536>()];
    println!("{all:?} bytes besides 24 a vertex");
    assert!(all.iter().all(|&bytes| bytes == all[0] && bytes <= 1_550), "{all:?}");
}

/// Besides its gate and the ends of the buffers.
#[test]
fn an_assembler_takes_less_than_600_bytes() {
    type Monitor = StretchMonitor<'static, u16>;
    let besides = size_of::<Assembler<'static, Monitor, 162>>() - size_of::<Monitor>();
    println!("{besides} bytes, and {} for the monitor", size_of::<Monitor>());
    assert!(besides < 600, "{besides}");
}

/// A surface that moves between frames has a third buffer, and the stretch of its extrapolation.
#[test]
fn a_continuous_surface_takes_36_bytes_a_vertex_and_1900() {
    type Continuous = Frames<5_138, 3>;
    type Monitor = StretchMonitor<'static, u16, 2>;
    let all = size_of::<Continuous>()
        + size_of::<FrameReader<'static, 5_138, Continuous>>()
        + size_of::<Assembler<'static, Monitor, 5_138, NoMac, Continuous>>();
    let besides = all - 3 * 12 * 5_138;
    println!("{besides} bytes besides 36 a vertex");
    assert!(besides <= 1_900, "{besides}");
}
