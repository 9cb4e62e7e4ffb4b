//! What the program `tick` and whoever writes its script agree on.

/// End of the script.
pub const END: u32 = 0;
/// Ticks to leave out: how many.
pub const SKIP: u32 = 1;
/// Bytes that come over the bus: how many, and they, padded to a word.
pub const BYTES: u32 = 2;
/// Ticks to run: how many. Each is answered by [`ANSWER_WORDS`].
pub const TICK: u32 = 3;
/// Words of an answer: what the tick took on the clock, its query's node and triangle tests, and the frame that it
/// was about; 0 where there was no answer.
pub const ANSWER_WORDS: usize = 4;
