//! The protocol between the program `receive` and the writer of its script.

/// Vertices of the surface: the heart of 10,272 triangles.
pub const VERTICES: usize = 5_138;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 1 << 19;
/// A frame without tags.
pub const UNTAGGED: u32 = 1;
/// A frame with tags, under [`KEY`] and the challenge 0.
pub const TAGGED: u32 = 2;
/// The key.
pub const KEY: [u8; 16] = *b"a key for a test";
/// Words of an answer: the number of packets; the clock's counts for accepting them, their sum and the largest for one
/// packet; the counts for checking and publishing, their sum and the largest for one slice.
pub const ANSWER_WORDS: usize = 5;
