//! What a tracker's tick pays for work besides its tests, in node tests.
//!
//! A budget bounds a tick's time, so a tick within a budget counts this work, too. A tick without one counts tests alone,
//! and so does a query, whose cost is fitted to its tests.
//!
//! Each price is a slope of the instructions of 60,000 ticks on an emulated Cortex-M7 over the counts of each kind of work
//! (least squares, R² 0.998, of ticks with contacts 0.999), in hundreds of instructions: a test of a node's sphere takes 105.

// Requirement: T-02

/// A visit to an opened node of the front: its due children and its next deadline (285 instructions).
pub(super) const VISIT: u32 = 3;

/// The plane of a child that is a leaf (311), besides the node test that it counts as.
pub(super) const CHILD_PLANE: u32 = 2;

/// A triangle below an opened leaf: its corners, and the closest pair's plane (187), besides the node test.
pub(super) const TRIANGLE: u32 = 1;

/// The tests of a whole query, in a tick whose front is full, for which it pays one more: its other work has no prices. A
/// test of a query takes 159 instructions.
pub(super) const QUERY: u32 = 2;

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

/// A list of contacts: an empty cache of vertices, the start and the end of its search, and an empty table of basins (8,407).
pub(super) const LIST: u32 = 80;

/// This many opened nodes of a list's front are passed over for a node test: 10 each, at most 15 more for a node and 50
/// for a leaf within the range where the budget ends.
pub(super) const PASSED: u32 = 2;

/// A leaf within the range of a list (123), besides a node test for each triangle.
pub(super) const LEAF: u32 = 1;

/// A triangle of such a leaf: its corners compared (210), besides the node test.
pub(super) const SEEN: u32 = 1;

/// A child of a node without a slot of the list's front (up to 359), besides the node test.
pub(super) const CHILD: u32 = 1;

/// A triangle's side (320), besides the node test.
pub(super) const FACING: u32 = 2;

/// Whether a triangle is lowest on its edge (322).
pub(super) const ON_EDGE: u32 = 3;

/// A triangle that may represent its lowest corner (347), besides a node test for each triangle around that.
pub(super) const CANDIDATE: u32 = 3;

/// An entry of a basin (109).
pub(super) const ENTRY: u32 = 1;

/// An edge over which a basin may grow (132), besides the test of the triangle beyond.
pub(super) const EDGE: u32 = 1;

/// A basin: its pair, its side, and its slot in the list (1,400).
pub(super) const BASIN: u32 = 14;

/// The start of a contact's activation: its empty paths (889).
pub(super) const ACTIVATION: u32 = 9;
