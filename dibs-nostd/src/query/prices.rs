//! What a tracker's tick pays for work besides its tests, in node tests.
//!
//! A budget bounds a tick's time, so a tick within a budget counts this work, too. A tick without one counts tests alone,
//! and so do one with contacts, whose list has no prices, and a query, whose cost is fitted to its tests.
//!
//! Each price is a slope of the instructions of 60,000 ticks on an emulated Cortex-M7 over the counts of each kind of work
//! (least squares, R² 0.998), in hundreds of instructions: a test of a node's sphere takes 105.

// Requirement: T-02

/// A visit to an opened node of the front: its due children and its next deadline (285 instructions).
pub(super) const VISIT: u32 = 3;

/// The plane of a child that is a leaf (311), besides the node test that it counts as.
pub(super) const CHILD_PLANE: u32 = 2;

/// A triangle below an opened leaf: its corners, and the closest pair's plane (187), besides the node test.
pub(super) const TRIANGLE: u32 = 1;

/// The plane of a leaf around a point (407), besides the node test.
pub(super) const LEAF_PLANE: u32 = 3;

/// A remembered point of an axis: read, and kept for the next tick (177).
pub(super) const POINT: u32 = 2;

/// A turn of the division of an axis (403).
pub(super) const TURN: u32 = 4;

/// A neighbour's triangle: its distance with its corners (390), besides what a distance counts as.
pub(super) const STEP: u32 = 1;

/// A triangle that may be the closest to a point, whose plane decides the side (211).
pub(super) const TIE: u32 = 2;
