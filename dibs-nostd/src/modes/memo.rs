//! A cache of computed positions.

use core::cell::Cell;

use glam::Vec3;

use crate::surface::{MeasuredStretch, VertexTable};

/// A vertex table that caches positions of another one, such as a [`ModalSurface`](super::ModalSurface): a query reads
/// the same vertices a few times, as pins and as corners of several triangles.
///
/// `N` slots of 16 bytes, a power of two for speed. A slot serves every `N`th row, so neighbouring rows, which are
/// close on the surface, do not evict each other. Make one for each query, on the stack; it does not change the answer.
///
/// ```
/// use dibs_nostd::{VertexTable, glam::Vec3, modes::Memo};
/// let table = [Vec3::X, Vec3::Y];
/// let memo = Memo::<_, 16>::new(&table);
/// assert_eq!(memo.position(1), Some(Vec3::Y));
/// assert_eq!(memo.position(1), Some(Vec3::Y)); // without asking the table again
/// assert_eq!(memo.position(2), None);
/// ```
#[derive(Debug)]
pub struct Memo<'t, T: ?Sized, const N: usize> {
    table: &'t T,
    slots: [Cell<Slot>; N],
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    vertex: u32,
    position: Vec3,
}

/// No row has this number, since a table's length is at most this.
const NO_VERTEX: u32 = u32::MAX;

impl<'t, T: VertexTable + ?Sized, const N: usize> Memo<'t, T, N> {
    /// An empty cache of this table. Cost: `N` slots are written.
    #[must_use]
    pub const fn new(table: &'t T) -> Self {
        const EMPTY: Slot = Slot { vertex: NO_VERTEX, position: Vec3::ZERO };
        Self { table, slots: [const { Cell::new(EMPTY) }; N] }
    }
}

impl<T: VertexTable + ?Sized, const N: usize> VertexTable for Memo<'_, T, N> {
    fn len(&self) -> usize {
        self.table.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let slot = (vertex as usize).checked_rem(N).and_then(|at| self.slots.get(at));
        let Some(slot) = slot else { return self.table.position(vertex) };
        let known = slot.get();
        if known.vertex == vertex && vertex != NO_VERTEX {
            return Some(known.position);
        }
        let position = self.table.position(vertex)?;
        slot.set(Slot { vertex, position });
        Some(position)
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
