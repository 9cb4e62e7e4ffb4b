//! The protocol between the program `tick` and the writer of its script.

/// End of the script.
pub const END: u32 = 0;
/// Ticks to skip: their number.
pub const SKIP: u32 = 1;
/// Bytes from the bus: their number, then the bytes, padded to a word.
pub const BYTES: u32 = 2;
/// Ticks to run: their number. Each is answered by [`ANSWER_WORDS`].
pub const TICK: u32 = 3;
/// The next frame is a new registration of the surface.
pub const REGISTER: u32 = 4;
/// Words of an answer: the tick's counts on the clock, its query's node and triangle tests, and the epoch of the frame
/// searched, or 0 without an answer.
pub const ANSWER_WORDS: usize = 4;
