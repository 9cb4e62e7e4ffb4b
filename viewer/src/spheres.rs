//! Spheres to draw: of a level, of a query, of a tracker's front.

use std::cell::RefCell;
use std::collections::HashMap;

use dibs_nostd::format::NodeLink;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Index, MeasuredStretch, Tree, TriangleRow, VertexTable};

/// A table that notes which rows a query reads, in their order.
pub struct Recorder<'v, V: ?Sized> {
    table: &'v V,
    reads: RefCell<Vec<u32>>,
}

impl<'v, V: VertexTable + ?Sized> Recorder<'v, V> {
    pub fn new(table: &'v V) -> Self {
        Self { table, reads: RefCell::default() }
    }

    pub fn into_reads(self) -> Vec<u32> {
        self.reads.into_inner()
    }
}

impl<V: VertexTable + ?Sized> VertexTable for Recorder<'_, V> {
    fn len(&self) -> usize {
        self.table.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.reads.borrow_mut().push(vertex);
        self.table.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        self.table.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.table.stretch()
    }

    fn position_error(&self) -> f32 {
        self.table.position_error()
    }
}

/// The nodes of a level, and the leaves above it: together they cover the surface.
pub fn level<I: Index>(tree: &Tree<'_, I>, level: u32) -> Vec<u32> {
    let mut rows = vec![0];
    for _ in 0..level {
        rows =
            rows.into_iter().flat_map(|row| children(tree, row).unwrap_or(row..row + 1)).collect();
    }
    rows
}

/// Levels of the tree, the root's included.
pub fn levels<I: Index>(tree: &Tree<'_, I>) -> u32 {
    let (mut rows, mut levels) = (vec![0], 0);
    while !rows.is_empty() {
        rows = rows.into_iter().filter_map(|row| children(tree, row)).flatten().collect();
        levels += 1;
    }
    levels
}

fn children<I: Index>(tree: &Tree<'_, I>, row: u32) -> Option<std::ops::Range<u32>> {
    match tree.node(row)? {
        (_, _, NodeLink::Children { first, count }) => Some(first..first + count),
        _ => None,
    }
}

/// The nodes whose spheres a query tested, from the rows that it read.
///
/// A query that opens a node reads the pins of all its children, one after the other; between two pins it reads at most
/// the vertices of the leaf just tested. So a node was opened if that sequence is in the record.
pub fn tested<I: Index>(tree: &Tree<'_, I>, reads: &[u32]) -> Vec<u32> {
    let mut places: HashMap<u32, Vec<usize>> = HashMap::new();
    for (place, &row) in reads.iter().enumerate() {
        places.entry(row).or_default().push(place);
    }
    let mut tested = vec![0];
    let mut next = 0;
    while let Some(&row) = tested.get(next) {
        next += 1;
        let Some(children) = children(tree, row) else { continue };
        let pin = tree.node(children.start).map_or(u32::MAX, |(pin, ..)| pin);
        let mut starts = places.get(&pin).into_iter().flatten();
        if starts.any(|&start| is_opening(tree, children.clone(), &reads[start..])) {
            tested.extend(children);
        }
    }
    tested
}

/// Whether the reads begin with the tests of these siblings.
fn is_opening<I: Index>(
    tree: &Tree<'_, I>,
    mut siblings: std::ops::Range<u32>,
    reads: &[u32],
) -> bool {
    let Some(row) = siblings.next() else { return true };
    let Some((pin, _, link)) = tree.node(row) else { return false };
    let Some((&read, mut rest)) = reads.split_first() else { return false };
    if read != pin {
        return false;
    }
    if is_opening(tree, siblings.clone(), rest) {
        return true;
    }
    // The leaf's plane was tested: its vertices follow, in the leaf's order, some or all.
    let NodeLink::Leaf { first, count } = link else { return false };
    let corners = (first..first + count).filter_map(|row| tree.corners(TriangleRow(row)));
    let vertices = corners
        .enumerate()
        .flat_map(|(number, corners)| corners.into_iter().skip(if number == 0 { 0 } else { 2 }));
    for vertex in vertices {
        match rest.split_first() {
            Some((&read, after)) if read == vertex => rest = after,
            _ => return false,
        }
        if is_opening(tree, siblings.clone(), rest) {
            return true;
        }
    }
    false
}
