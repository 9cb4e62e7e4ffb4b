//! A validated tree.

use core::ffi::c_void;

use dibs_nostd::format::Unit;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{PathKind, Scrub, Tree, TriangleRow};

use crate::border::{Handle, Input, Kind, Output, Storage};
use crate::code::dibs_code;
use crate::frame::rows;
use crate::tool::dibs_vec3;

/// Bytes of a tree's storage.
pub const DIBS_TREE_SIZE: usize = 640;

/// The type of a row's number in a tree's bytes: the library takes trees of one width.
#[cfg(not(feature = "large"))]
pub(crate) type Row = u16;
/// The same, for trees with more than 65,536 vertices.
#[cfg(feature = "large")]
pub(crate) type Row = u32;

/// A validated tree, such as `heart.dibs` from `dibs build heart.ply -o heart.dibs`. At most 65,536 vertices; the
/// library that `cargo build -p dibs-c --features large` makes takes larger trees instead.
///
/// Any number of contexts may use it at once.
pub struct dibs_tree {
    /// The view of the bytes.
    pub(crate) tree: Tree<'static, Row>,
    /// The nodes that move the surface, if any.
    pub(crate) nodes: Option<Nodes<'static>>,
    pub(crate) bytes: &'static [u8],
}

impl dibs_tree {
    /// Number of rows in a frame.
    pub(crate) fn rows(&self) -> u32 {
        self.nodes.map_or(self.tree.vertex_count(), |nodes| nodes.count())
    }
}

impl Kind for dibs_tree {
    const MARK: u32 = 0x6462_7402;
    const SIZE: usize = DIBS_TREE_SIZE;
}

/// Properties of a tree.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_tree_facts {
    /// Vertices.
    pub vertices: u32,
    /// Rows of a frame: the nodes that move the surface if the tree has any (`dibs build --nodes`), else its vertices.
    pub rows: u32,
    /// Triangles.
    pub triangles: u32,
    /// Nodes of the tree of spheres.
    pub nodes: u32,
    /// Identity of the mesh, which packets carry.
    pub mesh_id: u32,
    /// Checksum of the tree's bytes.
    pub checksum: u32,
    /// The stretch limit that the tree was built for; 1 for no stretch.
    pub stretch: f32,
    /// Largest distance (mm) of a vertex from its position in the mesh's file.
    pub position_error: f32,
    /// Vertices of the mesh's file, including those of no triangle: positions of a frame in the file's order.
    pub file_vertices: u32,
    /// Triangles of the mesh's file, including those that the builder dropped.
    pub file_triangles: u32,
    /// Unit of the mesh's file: 0 unknown, 1 mm, 2 cm, 3 m, 4 inch, 5 micrometre. All lengths of the tree are in mm.
    pub unit: u8,
}

/// Validates the bytes of a tree, and makes the tree that all other objects need.
///
/// Cost: linear in the bytes; once, at start-up.
///
/// @param storage  `DIBS_TREE_SIZE` bytes, aligned to `DIBS_ALIGNMENT`, for as long as the tree is used.
/// @param size     Bytes of the storage.
/// @param bytes    The tree, in flash or in memory. Not copied: it must not change for as long as the tree, or any
///                 object made with it, is used. It is read faster if aligned to 4.
/// @param length   Bytes of the tree.
/// @param tree     Receives the tree's address.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_TREE_LENGTH` to `DIBS_CODE_TREE_FORM`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_init(
    storage: *mut c_void,
    size: usize,
    bytes: *const u8,
    length: usize,
    tree: *mut *mut dibs_tree,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, tree, || {
            let bytes = bytes.slice(length)?;
            let tree = Tree::from_bytes(bytes)?;
            let nodes = match tree.paths() {
                PathKind::Volume => Some(Nodes::of(&tree).map_err(|_| dibs_code::TreeForm)?),
                _ => None,
            };
            Ok(dibs_tree { tree, nodes, bytes })
        })
    })
}

/// Reads the properties of the tree.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_get_facts(
    tree: *mut dibs_tree,
    facts: *mut dibs_tree_facts,
) -> dibs_code {
    dibs_code::of(|| {
        let (facts, tree) = (facts.check()?, tree.share()?);
        let (rows, tree) = (tree.rows(), &tree.tree);
        facts.set(dibs_tree_facts {
            vertices: tree.vertex_count(),
            rows,
            triangles: tree.triangle_count(),
            nodes: tree.node_count(),
            mesh_id: tree.mesh_id(),
            checksum: tree.checksum(),
            stretch: tree.stretch(),
            position_error: tree.position_error(),
            file_vertices: tree.file_vertex_count(),
            file_triangles: tree.file_triangle_count(),
            unit: tree.unit().map_or(0, Unit::code),
        });
        Ok(())
    })
}

/// Rest position (mm) of the vertex in a row.
///
/// @return `DIBS_CODE_OK`, or `DIBS_CODE_TREE_NO_REST_SHAPE` outside the table or if the tree was built without it.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_rest_position(
    tree: *mut dibs_tree,
    row: u32,
    position: *mut dibs_vec3,
) -> dibs_code {
    dibs_code::of(|| {
        let (position, tree) = (position.check()?, &tree.share()?.tree);
        position.set(tree.rest_position(row).ok_or(dibs_code::TreeNoRestShape)?.into());
        Ok(())
    })
}

/// The number, from 0, that the vertex in a row has in the mesh's file. An answer's `corners` are rows.
///
/// @return `DIBS_CODE_OK`, or `DIBS_CODE_ARGUMENT` outside the table or if the tree was built without its vertex order.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_vertex_number(
    tree: *mut dibs_tree,
    row: u32,
    number: *mut u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (number, tree) = (number.check()?, &tree.share()?.tree);
        number.set(tree.vertex_number(row).ok_or(dibs_code::Argument)?.0);
        Ok(())
    })
}

/// Copies positions, or velocities, of the mesh file's vertices from that file's order into the tree's order of rows,
/// as a frame needs them. A frame in the file's order gives wrong distances without an error, unless it is measured.
/// Only the order changes. Positions are in mm, less the tree's origin, which is not zero for a mesh far from the origin
/// of its file; velocities are in mm/s.
///
/// Cost: linear in the vertices.
///
/// @param tree    The tree.
/// @param values  x, y and z of each vertex of the mesh's file, in that file's order.
/// @param count   Their number: `file_vertices` of the tree's facts.
/// @param rows    Receives x, y and z of each row. Must not overlap `values`.
/// @param room    The number of rows that fit there: at least `vertices` of the tree's facts.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` for another number than the file's; `DIBS_CODE_CAPACITY` for too
///         little room; `DIBS_CODE_ARGUMENT` if the tree was built without its vertex order, or if nodes move the
///         surface (their order is the volume's); or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_to_rows(
    tree: *mut dibs_tree,
    values: *const f32,
    count: u32,
    rows: *mut f32,
    room: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (tree, values) = (tree.share()?, self::rows(values, count)?);
        let mut places = rows.places((room as usize).checked_mul(3).ok_or(dibs_code::Argument)?)?;
        let dibs_tree { tree, nodes, .. } = tree;
        if nodes.is_some() {
            return Err(dibs_code::Argument);
        }
        if count != tree.file_vertex_count() {
            return Err(dibs_code::VertexCount);
        }
        if room < tree.vertex_count() {
            return Err(dibs_code::Capacity);
        }
        for row in 0..tree.vertex_count() {
            let number = tree.vertex_number(row).ok_or(dibs_code::Argument)?;
            let value = values.get(number.0 as usize).ok_or(dibs_code::VertexCount)?;
            value.iter().try_for_each(|&value| places.push(value))?;
        }
        Ok(())
    })
}

/// Label of the triangle in a row, for example of its tissue.
///
/// @return `DIBS_CODE_OK`, or `DIBS_CODE_ARGUMENT` outside the table or if the tree was built without labels.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_label(
    tree: *mut dibs_tree,
    triangle: u32,
    label: *mut u8,
) -> dibs_code {
    dibs_code::of(|| {
        let (label, tree) = (label.check()?, &tree.share()?.tree);
        label.set(tree.label(TriangleRow(triangle)).ok_or(dibs_code::Argument)?);
        Ok(())
    })
}

/// Compares the tree's header and section offsets, which are copied to memory, with its bytes. A scrub does not check
/// that copy: call this once a tick.
///
/// Cost: some hundred instructions.
///
/// @return `DIBS_CODE_OK`; `DIBS_CODE_TREE_CORRUPT` if the two differ: make the output safe; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_check(tree: *mut dibs_tree) -> dibs_code {
    dibs_code::of(|| {
        let tree = tree.share()?;
        tree.tree.check(tree.bytes).map_err(|_| dibs_code::TreeCorrupt)
    })
}

/// Bytes of a scrub's storage.
pub const DIBS_SCRUB_SIZE: usize = 128;

/// A background check of a tree's bytes: flash that is corrupted after start-up gives wrong answers without an error.
///
/// One context at a time.
pub struct dibs_scrub(Scrub<'static>);

impl Kind for dibs_scrub {
    const MARK: u32 = 0x6462_7304;
    const SIZE: usize = DIBS_SCRUB_SIZE;
}

/// Makes a check of the tree's bytes.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_scrub_init(
    storage: *mut c_void,
    size: usize,
    tree: *mut dibs_tree,
    scrub: *mut *mut dibs_scrub,
) -> dibs_code {
    dibs_code::of(|| storage.make(size, scrub, || Ok(dibs_scrub(Scrub::new(tree.share()?.bytes)))))
}

/// Checks the next `most` bytes, and at the end of a round compares the checksum.
///
/// @return `DIBS_CODE_OK`, or `DIBS_CODE_TREE_CORRUPT` at the end of a round in which the bytes did not match: make the
///         output safe.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_scrub_step(scrub: *mut dibs_scrub, most: usize) -> dibs_code {
    dibs_code::of(|| Ok(scrub.open()?.0.step(most)?))
}

/// A point of the mesh's file (mm), in double precision.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_point {
    /// Along the first axis.
    pub x: f64,
    /// Along the second axis.
    pub y: f64,
    /// Along the third axis.
    pub z: f64,
}

/// The point of the mesh's file that all coordinates of the tree are relative to: those of vertices, tools and answers.
/// Zero unless the file's coordinates are so far from their own origin that single precision would lose them; then
/// subtract it, in double precision, from each point in the file's coordinates.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tree_origin(tree: *mut dibs_tree, origin: *mut dibs_point) -> dibs_code {
    dibs_code::of(|| {
        let (origin, tree) = (origin.check()?, &tree.share()?.tree);
        let [x, y, z] = tree.origin();
        origin.set(dibs_point { x, y, z });
        Ok(())
    })
}
