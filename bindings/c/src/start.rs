//! All objects of a control loop, in one piece of memory.

use core::ffi::c_void;
use core::ptr;

use crate::border::{Handle, Output};
use crate::bus::{DIBS_BUS_SIZE, dibs_bus, dibs_bus_init, dibs_bus_init_with_tags};
use crate::code::dibs_code;
use crate::guard::{DIBS_GUARD_SIZE, dibs_guard, dibs_guard_init};
use crate::limits::dibs_guard_limits;
use crate::surface::{dibs_surface, dibs_surface_init};
use crate::tags::dibs_tags;
use crate::tree::{DIBS_TREE_SIZE, dibs_tree, dibs_tree_init};

/// Bytes of the memory for a control loop's objects, except the surface.
pub const DIBS_START_BASE: usize = DIBS_TREE_SIZE + DIBS_BUS_SIZE + DIBS_GUARD_SIZE;

/// Makes all objects of a control loop in one piece of memory: validates the tree, and makes the surface and its two
/// ends. To make each object in memory of its own, use `dibs_tree_init`, `dibs_surface_init`, `dibs_bus_init` and
/// `dibs_guard_init`.
///
/// Cost: linear in the bytes; once, at start-up.
///
/// @param memory  `DIBS_START_SIZE(rows)` bytes, with the rows of the tree's facts (vertices, or nodes that move them),
///                aligned to `DIBS_ALIGNMENT`, for as long as an end is used. Needs no initial value.
/// @param size    Bytes of the memory.
/// @param bytes   The tree, in flash or in memory. Not copied: as for `dibs_tree_init`.
/// @param length  Bytes of the tree.
/// @param limits  The guard's limits.
/// @param bus     Receives the bus's address.
/// @param guard   Receives the guard's address.
/// @return As the four functions; `DIBS_CODE_STORAGE_SIZE` if the tree has more rows than fit.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_start(
    memory: *mut c_void,
    size: usize,
    bytes: *const u8,
    length: usize,
    limits: *const dibs_guard_limits,
    bus: *mut *mut dibs_bus,
    guard: *mut *mut dibs_guard,
) -> dibs_code {
    dibs_code::of(|| {
        let make_bus = |storage, surface, tree, bus| {
            dibs_bus_init(storage, DIBS_BUS_SIZE, surface, tree, limits, bus)
        };
        start((memory, size), (bytes, length), limits, make_bus, (bus, guard))
    })
}

/// The same, for a sender with a key: a packet without a genuine tag is refused and counted.
///
/// @param memory  As for `dibs_start`.
/// @param size    Bytes of the memory.
/// @param bytes   The tree.
/// @param length  Bytes of the tree.
/// @param limits  The guard's limits.
/// @param tags    The tags.
/// @param bus     Receives the bus's address.
/// @param guard   Receives the guard's address.
/// @return As `dibs_start`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_start_with_tags(
    memory: *mut c_void,
    size: usize,
    bytes: *const u8,
    length: usize,
    limits: *const dibs_guard_limits,
    tags: *mut dibs_tags,
    bus: *mut *mut dibs_bus,
    guard: *mut *mut dibs_guard,
) -> dibs_code {
    dibs_code::of(|| {
        let make_bus = |storage, surface, tree, bus| {
            dibs_bus_init_with_tags(storage, DIBS_BUS_SIZE, surface, tree, limits, tags, bus)
        };
        start((memory, size), (bytes, length), limits, make_bus, (bus, guard))
    })
}

fn start(
    (memory, size): (*mut c_void, usize),
    (bytes, length): (*const u8, usize),
    limits: *const dibs_guard_limits,
    make_bus: impl FnOnce(
        *mut c_void,
        *mut dibs_surface,
        *mut dibs_tree,
        *mut *mut dibs_bus,
    ) -> dibs_code,
    (bus, guard): (*mut *mut dibs_bus, *mut *mut dibs_guard),
) -> Result<(), dibs_code> {
    const BUS: usize = DIBS_TREE_SIZE;
    const GUARD: usize = BUS + DIBS_BUS_SIZE;
    let (bus_place, guard_place) = (bus.check()?, guard.check()?);
    let (mut tree, mut surface) = (ptr::null_mut(), ptr::null_mut());
    let (mut bus, mut guard) = (ptr::null_mut(), ptr::null_mut());
    dibs_tree_init(memory, size, bytes, length, &raw mut tree).done()?;
    let room = size.checked_sub(DIBS_START_BASE).ok_or(dibs_code::StorageSize)?;
    let rows = tree.share()?.rows();
    let at = |offset| memory.wrapping_byte_add(offset);
    dibs_surface_init(at(DIBS_START_BASE), room, rows, &raw mut surface).done()?;
    make_bus(at(BUS), surface, tree, &raw mut bus).done()?;
    dibs_guard_init(at(GUARD), DIBS_GUARD_SIZE, surface, tree, limits, &raw mut guard).done()?;
    bus_place.set(bus);
    guard_place.set(guard);
    Ok(())
}
