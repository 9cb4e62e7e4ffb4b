//! The two widths of vertex indices, chosen by a type parameter.

mod sealed {
    pub trait Sealed: Sized {
        /// The bytes of a triangle's three indices.
        type Corners: AsRef<[u8]>;

        /// The triangles of a section.
        fn corners(section: &[u8]) -> &[Self::Corners];
    }

    impl Sealed for u16 {
        type Corners = [u8; 6];

        #[inline(always)]
        fn corners(section: &[u8]) -> &[Self::Corners] {
            section.as_chunks().0
        }
    }

    impl Sealed for u32 {
        type Corners = [u8; 12];

        #[inline(always)]
        fn corners(section: &[u8]) -> &[Self::Corners] {
            section.as_chunks().0
        }
    }
}

/// Width of the vertex indices and radius codes of a tree: `u16` for up to 65,536 vertices, `u32`
/// for larger meshes. Sealed: the format knows these two.
pub trait Index: core::fmt::Debug + sealed::Sealed + Copy + 'static {
    /// Bytes an index takes in the tree.
    const BYTES: usize;
    /// Largest radius code. The code converts to `f32` without rounding in both widths.
    const MAX_RADIUS_CODE: u32;
    /// Vertices that this width can address.
    const MAX_VERTICES: u32;
    /// Most triangles of a tree of this width with adjacency. In 16 bits at most four rows then share their low bits.
    const MAX_ADJACENT_TRIANGLES: u32;
}

impl Index for u16 {
    const BYTES: usize = 2;
    const MAX_RADIUS_CODE: u32 = 0xFFFF;
    const MAX_VERTICES: u32 = 0x1_0000;
    const MAX_ADJACENT_TRIANGLES: u32 = 0x4_0000;
}

impl Index for u32 {
    const BYTES: usize = 4;
    const MAX_RADIUS_CODE: u32 = 0x100_0000;
    const MAX_VERTICES: u32 = 0x1000_0000;
    const MAX_ADJACENT_TRIANGLES: u32 = u32::MAX;
}
