//! The version of the header, and whether the library has the same.

use crate::code::dibs_code;

/// The header's version: a million times the major number, plus a thousand times the minor number, plus the patch
/// number.
pub const DIBS_VERSION: u32 = 1_000;

const _: () = {
    let [major, minor, patch] = [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ];
    assert!(DIBS_VERSION == major * 1_000_000 + minor * 1_000 + patch);
};

const fn number(text: &str) -> u32 {
    match u32::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => u32::MAX,
    }
}

/// Checks that a program was compiled with this library's header, because sizes of objects may differ between versions.
/// A program that is linked with a shared library calls this before it makes an object.
///
/// @param version  `DIBS_VERSION`.
/// @return `DIBS_CODE_OK`, or `DIBS_CODE_VERSION`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_check_version(version: u32) -> dibs_code {
    if version == DIBS_VERSION { dibs_code::Ok } else { dibs_code::Version }
}
