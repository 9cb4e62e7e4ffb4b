//! Positions in the order of the mesh's file, read in the order of the rows.

// Requirements: B-08, M-06

use core::marker::PhantomData;

use glam::Vec3;

use super::{Index, Tree, format};
use crate::QueryError;

impl<I: Index> Tree<'_, I> {
    /// Copies the vertices' positions, or velocities, from the order of the mesh's file into the order of the rows, which
    /// a vertex table has, and returns these rows. In the file's order a table gives wrong distances without an error.
    /// Values are not changed otherwise: positions are in mm, less the tree's [origin](Self::origin).
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Options, Query, Sphere, Tree, glam::Vec3};
    ///
    /// let heart = generate::heart(1_000)?.mesh; // its vertices have the file's order
    /// let built = Builder::new().build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let mut rows = [Vec3::ZERO; 1_000];
    /// let rows = tree.to_rows(&heart.positions, &mut rows)?;
    /// let tool = Sphere::new(Vec3::new(-80.0, 0.0, 20.0), 2.5)?;
    /// let found = Query::<u16, 64>::new(&tree)?.closest(rows, &tool, &Options::new())?;
    /// assert!(found.separation > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// Cost: linear in the vertices.
    ///
    /// # Errors
    /// [`QueryError::NoVertexOrder`] if the tree was built without its vertex order; [`QueryError::VertexCount`] for another
    /// number of values than [`Tree::file_vertex_count`], or if fewer rows than [`Tree::vertex_count`] fit into `rows`.
    /// Then nothing is copied.
    pub fn to_rows<'r, P: Copy + Into<Vec3>>(
        &self,
        values: &[P],
        rows: &'r mut [Vec3],
    ) -> Result<&'r [Vec3], QueryError> {
        let order = VertexOrder::of(self);
        if order.numbers.is_empty() {
            return Err(QueryError::NoVertexOrder);
        }
        let wrong =
            |expected, found: usize| QueryError::VertexCount { expected, found: found as u32 };
        let in_order = order.rows(values).ok_or(wrong(order.positions, values.len()))?;
        let room = rows.len();
        let rows = rows.get_mut(..order.rows as usize).ok_or(wrong(order.rows, room))?;
        for (row, value) in rows.iter_mut().zip(in_order) {
            *row = value;
        }
        Ok(rows)
    }
}

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

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec;

    use dibs_build::{Builder, generate};

    use super::*;

    #[test]
    fn values_in_the_files_order_become_rows_or_nothing_is_copied() {
        let mesh = generate::heart(320).expect("a heart").mesh;
        let built = Builder::new().build(&mesh).expect("builds");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
        let count = mesh.positions.len();
        let mut rows = vec![Vec3::ZERO; count + 1];
        assert_ne!(built.to_rows(&mesh.positions), mesh.positions);
        let found = tree.to_rows(&mesh.positions, &mut rows).map(<[Vec3]>::to_vec);
        assert_eq!(found, Ok(built.to_rows(&mesh.positions)));

        let error = |expected, found: usize| {
            Err(QueryError::VertexCount { expected: expected as u32, found: found as u32 })
        };
        let mut untouched = vec![Vec3::NEG_ONE; count - 1];
        let short = &mesh.positions[1..];
        assert_eq!(tree.to_rows(short, &mut untouched), error(count, count - 1));
        assert_eq!(tree.to_rows(&mesh.positions, &mut untouched), error(count, count - 1));
        assert!(untouched.iter().all(|&row| row == Vec3::NEG_ONE));

        let bare = Builder::new().with_vertex_order(false).build(&mesh).expect("builds");
        let bare = Tree::<u16>::from_bytes(bare.blob()).expect("a tree");
        let found = bare.to_rows(&mesh.positions, &mut rows).map(<[Vec3]>::to_vec);
        assert_eq!(found, Err(QueryError::NoVertexOrder));
    }
}
