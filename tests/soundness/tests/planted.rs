//! Planted faults, one for each sanitizer. `cargo xtask sanitize` runs them first, and fails unless they are found.
//! They are undefined behaviour: nothing else may run them.
#![cfg(not(loom))]

use std::cell::UnsafeCell;
use std::hint::black_box;

struct Shared(UnsafeCell<u32>);

// SAFETY: none. This is the fault.
unsafe impl Sync for Shared {}

#[test]
#[ignore = "a data race on purpose, for the thread sanitizer"]
fn a_race() {
    static SHARED: Shared = Shared(UnsafeCell::new(0));
    let count = || {
        for _ in 0..1_000 {
            // SAFETY: none. The other thread writes here at the same time.
            unsafe { *black_box(SHARED.0.get()) += 1 };
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(count);
        count();
    });
}

#[test]
#[ignore = "an access out of bounds on purpose, for the address sanitizer"]
fn an_access_out_of_bounds() {
    let bytes = black_box(vec![1_u8; 16]);
    // SAFETY: none. Index 16 is the first behind the end.
    let behind = unsafe { *black_box(bytes.as_ptr()).add(16) };
    black_box(behind);
}
