//! The memory of a surface on a controller: two or three buffers of positions, and some bytes for both of their ends,
//! the assembler, and the stretch of every region.

// Requirement: F-09

use dibs_nostd::guard::{Bus, Guard, Surface};
use dibs_nostd::{Assembler, FrameReader, Frames, StretchMonitor, Tracker};

/// Bytes of a surface of `N` vertices in addition to the positions.
const fn besides<const N: usize>() -> usize {
    size_of::<Frames<N>>()
        + size_of::<FrameReader<'static>>()
        + size_of::<Assembler<'static, StretchMonitor<'static, u16>>>()
        - 2 * 12 * N
}

/// References on the host are at least as long as the board's, so the board needs no more.
#[test]
fn a_surface_takes_1750_bytes_besides_its_positions() {
    let all = [besides::<162>(), besides::<5_138>(), besides::<65_536>()];
    println!("{all:?} bytes besides 24 a vertex");
    assert!(all.iter().all(|&bytes| bytes == all[0] && bytes <= 1_750), "{all:?}");
}

/// The two ends of a guarded surface, and what they share.
#[test]
fn a_guard_takes_as_much_as_its_pages_say() {
    type Ends = (Bus<'static, 'static, u16>, Guard<'static, 'static, u16, 64, 256>);
    let notes = size_of::<Surface<5_138>>() - 36 * 5_138;
    let bus = size_of::<Bus<'static, 'static, u16>>();
    let guard = size_of::<Ends>() - bus - size_of::<Tracker<'static, u16, 64, 256>>();
    println!("{notes} bytes shared, {bus} of the bus, {guard} of the guard besides its tracker");
    assert!(notes < 400 && bus < 3_000 && guard < 500, "{notes} {bus} {guard}");
}

/// Without its admission check and the ends of the buffers.
#[test]
fn an_assembler_takes_less_than_700_bytes() {
    type Monitor = StretchMonitor<'static, u16>;
    let besides = size_of::<Assembler<'static, Monitor>>() - size_of::<Monitor>();
    println!("{besides} bytes, and {} for the monitor", size_of::<Monitor>());
    assert!(besides < 700, "{besides}");
}

/// A surface that is extrapolated has a third buffer, and the stretch of its extrapolation.
#[test]
fn a_continuous_surface_takes_36_bytes_a_vertex_and_2050() {
    type Continuous = Frames<5_138, 3>;
    type Monitor = StretchMonitor<'static, u16, 2>;
    let all = size_of::<Continuous>()
        + size_of::<FrameReader<'static>>()
        + size_of::<Assembler<'static, Monitor>>();
    let besides = all - 3 * 12 * 5_138;
    println!("{besides} bytes besides 36 a vertex");
    assert!(besides <= 2_050, "{besides}");
}
