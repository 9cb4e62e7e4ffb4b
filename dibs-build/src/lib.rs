//! Builds trees.
