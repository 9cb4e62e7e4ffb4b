//! Tags on packets: a receiver's key, for every kind of receiver.

use core::ffi::c_void;

use dibs_nostd::wire::AesCmac;

use crate::border::{Input, Kind, Storage};
use crate::code::dibs_code;

/// Bytes of the storage of a receiver's tags.
pub const DIBS_TAGS_SIZE: usize = 1_792;

/// Bytes of a key.
pub const DIBS_KEY: usize = 16;

/// The tags that a receiver demands of every packet, and writes into every status: AES-128-CMAC under a key that both
/// ends have. `docs/wire.md` says what they protect against.
///
/// Any number of contexts may use it at once.
pub struct dibs_tags(AesCmac);

impl dibs_tags {
    /// What computes them.
    pub(crate) const fn mac(&'static self) -> &'static AesCmac {
        &self.0
    }
}

impl Kind for dibs_tags {
    const MARK: u32 = 0x6462_671C;
    const SIZE: usize = DIBS_TAGS_SIZE;
}

/// A key of `DIBS_KEY` bytes.
pub(crate) fn key(bytes: *const u8) -> Result<[u8; DIBS_KEY], dibs_code> {
    bytes.slice(DIBS_KEY)?.try_into().map_err(|_| dibs_code::Argument)
}

/// Makes the tags of one receiver, for `dibs_start_with_tags`, `dibs_bus_init_with_tags` or
/// `dibs_receiver_init_with_tags`.
///
/// @param storage    `DIBS_TAGS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`, for as long as the receiver is used. They hold
///                   the key in another form.
/// @param size       Bytes of the storage.
/// @param key        `DIBS_KEY` bytes that the sender has, too. Not used after the call.
/// @param receiver   The receiver's number: no two receivers under one key may have the same.
/// @param challenge  Drawn anew at each start: a random number, or a counter that survives a restart. The sender reads it
///                   from the answer to its hello. With 0, recordings of an earlier run are accepted until a later session
///                   has published.
/// @param tags       Receives the tags' address.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tags_init(
    storage: *mut c_void,
    size: usize,
    key: *const u8,
    receiver: u32,
    challenge: u64,
    tags: *mut *mut dibs_tags,
) -> dibs_code {
    dibs_code::of(|| {
        storage
            .make(size, tags, || Ok(dibs_tags(AesCmac::new(&self::key(key)?, receiver, challenge))))
    })
}
