//! A tree in flash, before its validation.

use core::marker::PhantomData;

use crate::tree::format::{field, u32_at};
use crate::{FormatError, Index, Scrub, Tree};

/// The bytes of a tree in flash, not validated yet.
///
/// No query takes these bytes: [`validate`](Self::validate), called once at start-up, gives a [`Tree`]. Sizes of
/// buffers and stacks are available as constants before that, so that a `static` can be declared with them.
///
/// The module included by [`include_tree!`](crate::include_tree) has one as `TREE`.
///
/// ```
/// use dibs_nostd::{Query, TreeBytes};
///
/// # let mesh = dibs_build::generate::heart(320).unwrap().mesh;
/// # let built = dibs_build::Builder::new().build(&mesh).unwrap();
/// let stored = TreeBytes::<u16>::new(built.blob());
/// let tree = stored.validate()?;
/// let query = Query::<_, 32>::new(&tree)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TreeBytes<'a, I> {
    bytes: &'a [u8],
    width: PhantomData<I>,
}

impl<'a, I: Index> TreeBytes<'a, I> {
    /// The bytes of a tree with indices of type `I`.
    #[must_use]
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, width: PhantomData }
    }

    /// Validates the bytes, as [`Tree::from_bytes`] does.
    ///
    /// Cost: linear in the bytes, some ten instructions each on a Cortex-M7.
    ///
    /// # Errors
    /// [`FormatError`] names the first defect and its value.
    pub const fn validate(&self) -> Result<Tree<'a, I>, FormatError> {
        Tree::from_bytes(self.bytes)
    }

    /// A background check of these bytes.
    #[must_use]
    pub fn scrub(&self) -> Scrub<'a> {
        Scrub::new(self.bytes)
    }

    /// The bytes.
    #[must_use]
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Number of vertices in the header, which is the number of rows of a vertex table. 0 if there is no header.
    #[must_use]
    pub const fn vertex_count(&self) -> usize {
        self.word(field::VERTICES)
    }

    /// Stack entries of a query, from the header. 0 if there is no header.
    #[must_use]
    pub const fn stack(&self) -> usize {
        self.word(field::STACK)
    }

    const fn word(&self, at: usize) -> usize {
        match u32_at(self.bytes, at) {
            Some(word) => word as usize,
            None => 0,
        }
    }
}
