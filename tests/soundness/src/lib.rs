//! Holds only tests: every interleaving of the frames' two ends (`tests/interleavings.rs`, with `--cfg loom`), and the
//! tests that the sanitizers run.
