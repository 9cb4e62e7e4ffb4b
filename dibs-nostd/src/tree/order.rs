//! Positions in the order of the mesh's file, read in the order of the rows.

use core::marker::PhantomData;

use glam::Vec3;

use super::{Index, Tree, format};

/// The number in the mesh's file of each row, unless rows have the file's order.
#[derive(Clone, Copy, Debug)]
pub struct VertexOrder<'t, I> {
    numbers: &'t [u8],
    rows: u32,
    /// Number of positions of a frame in the file's order.
    positions: u32,
    width: PhantomData<I>,
}

impl<'t, I: Index> VertexOrder<'t, I> {
    /// The order of a tree's vertices; the row order if the tree was emitted without its vertex order.
    pub const fn of(tree: &Tree<'t, I>) -> Self {
        let (numbers, rows) = (tree.sections.order, tree.vertex_count());
        let positions = if numbers.is_empty() { rows } else { tree.file_vertex_count() };
        Self { numbers, rows, positions, width: PhantomData }
    }

    /// Rows in the file's order.
    #[cfg(feature = "nodes")]
    pub const fn of_rows(rows: u32) -> Self {
        Self { numbers: &[], rows, positions: rows, width: PhantomData }
    }

    /// Positions in the file's order, read by row; `None` if their number is not the file's. A number beyond them has
    /// no position.
    pub fn rows<'p, P: Copy + Into<Vec3>>(
        &self,
        positions: &'p [P],
    ) -> Option<impl ExactSizeIterator<Item = Vec3> + Clone + use<'p, 't, I, P>> {
        if positions.len() != self.positions as usize {
            return None;
        }
        let Self { numbers, .. } = *self;
        Some((0..self.rows).map(move |row| {
            let number = if numbers.is_empty() {
                Some(row)
            } else {
                format::vertex_number::<I>(numbers, row)
            };
            let position = number.and_then(|number| positions.get(number as usize));
            position.map_or(Vec3::NAN, |&position| position.into())
        }))
    }
}
