//! The tree: a validated view of bytes in flash or in a file.
//!
//! One file, because it is the view's whole interface.

// Requirement: M-01

mod adjacency;
mod error;
mod facts;
pub mod format;
mod header;
mod index;
mod labels;
mod order;
mod row;
mod scrub;
pub(crate) mod sections;
mod shells;
mod stored;
mod unit;
mod valid;
mod validate;

pub(crate) use adjacency::{MAX_RING, after, before};
pub use error::FormatError;
pub use facts::SurfaceFacts;
pub use format::PathKind;
pub use index::Index;
pub(crate) use labels::LabelSet;
#[cfg(feature = "control")]
pub(crate) use order::VertexOrder;
pub use row::{TriangleRow, VertexNumber};
pub use scrub::{CorruptTreeError, Scrub};
pub(crate) use shells::RootSet;
pub use stored::TreeBytes;
pub(crate) use unit::Unit;
pub use valid::ValidTree;

use core::iter;
use core::marker::PhantomData;

use glam::Vec3;

#[cfg(feature = "batched")]
use format::several;
use format::{Metric, Node, NodeLink, section};
use header::Header;
use sections::Sections;

/// A deformation invariant bounding sphere tree with its triangles.
///
/// `I` is the index width, `u16` for up to 65,536 vertices or `u32`. The tree borrows its bytes, holds no positions
/// (only the vertex to which each sphere is pinned) and never changes: see `docs/format.md`.
#[derive(Clone, Copy, Debug)]
pub struct Tree<'a, I> {
    sections: Sections<'a>,
    header: Header,
    /// The checksum if no edge of the surface is a border, else its complement. After a memory fault it is neither, and
    /// the tree counts as open: then a depth takes longer, but is correct.
    closed: u32,
    width: PhantomData<I>,
}

impl<'a, I: Index> Tree<'a, I> {
    /// Validates the bytes of a tree, and returns a view of them.
    ///
    /// Call it once, at start-up; for a generated tree [`TreeBytes::validate`] does so. It checks the layout, the
    /// CRC-32, and that the tree is well formed: children after parents, every index inside its table, every triangle
    /// in exactly one leaf, depth as stated. It cannot check that the radii cover this mesh: the builder proves that.
    /// (It is `const`, but slow in a constant: the compiler takes a second or two for every thousand triangles.)
    ///
    /// Cost: linear in the bytes, no memory besides a fixed stack of [`format::MAX_STACK`] words.
    ///
    /// # Errors
    /// [`FormatError`] names the first defect and its value.
    pub const fn from_bytes(bytes: &'a [u8]) -> Result<Self, FormatError> {
        let header = tri!(header::read::<I>(bytes));
        let sections = tri!(sections::find::<I>(bytes, &header));
        tri!(validate::well_formed::<I>(&header, &sections));
        let mut tree = Self { sections, header, closed: !header.checksum, width: PhantomData };
        if tri!(adjacency::check(&tree)) {
            tree.closed = header.checksum;
        }
        tri!(shells::check(&tree));
        Ok(tree)
    }

    /// Checks this view (the decoded header and the section offsets) against the bytes. The view is in RAM, which a
    /// [`Scrub`] does not read: check the view of a [`Query`](crate::Query), `query.tree()`, once a tick or once a
    /// round of the scrub.
    ///
    /// Cost: some hundred instructions for any size of tree.
    ///
    /// # Errors
    /// [`FormatError::Field`] or [`FormatError::Section`] name the change.
    pub fn check(&self, bytes: &[u8]) -> Result<(), FormatError> {
        self.header.check(bytes)?;
        self.sections.check::<I>(bytes, &self.header)
    }

    /// The same tree on a copy of its bytes, for example in tightly coupled memory, without another validation. The
    /// header's values stay the validated ones.
    ///
    /// # Errors
    /// [`FormatError`] if the copy's sections are not where this tree's layout has them.
    pub const fn moved_to<'b>(&self, copy: &'b [u8]) -> Result<Tree<'b, I>, FormatError> {
        match sections::find::<I>(copy, &self.header) {
            Ok(sections) if self.sections.matches(&sections) => Ok(Tree { sections, ..*self }),
            Ok(_) => Err(FormatError::Section { kind: section::NODES }),
            Err(error) => Err(error),
        }
    }

    /// Checksum of all bytes of the tree; it differs between two trees of one mesh.
    #[must_use]
    pub const fn checksum(&self) -> u32 {
        self.header.checksum
    }

    /// Identity of the mesh: CRC-32 of its triangles and rest positions. Every packet carries it, so that a frame of
    /// another mesh is refused.
    #[must_use]
    pub const fn mesh_id(&self) -> u32 {
        self.header.mesh_id
    }

    /// Number of vertices, which is the number of rows of a vertex table for this tree.
    #[must_use]
    pub const fn vertex_count(&self) -> u32 {
        self.header.vertices
    }

    /// Number of triangles.
    #[must_use]
    pub const fn triangle_count(&self) -> u32 {
        self.header.triangles
    }

    /// Number of vertices in the mesh's file, including those without a triangle: a frame in the file's order has this
    /// many positions. For STL, which does not number vertices, its distinct positions.
    #[must_use]
    pub const fn file_vertex_count(&self) -> u32 {
        self.header.file_vertices
    }

    /// Number of triangles in the mesh's file, including those that the builder dropped; polygons count as the
    /// triangles into which they were cut.
    #[must_use]
    pub const fn file_triangle_count(&self) -> u32 {
        self.header.file_triangles
    }

    /// The unit of the mesh's file; `None` if the builder was not told. The tree's lengths are in millimetres.
    #[must_use]
    pub const fn unit(&self) -> Option<Unit> {
        Unit::from_code(self.header.unit as u8)
    }

    /// The facts by which the ends of a bus compare their surfaces.
    #[must_use]
    pub const fn surface_facts(&self) -> SurfaceFacts {
        let Header { vertices, triangles, .. } = self.header;
        SurfaceFacts { unit: self.unit(), vertices, triangles }
    }

    /// Number of nodes: inner nodes, leaves and roots.
    #[must_use]
    pub const fn node_count(&self) -> u32 {
        self.header.nodes
    }

    /// Number of roots, 1 to 64: one for each of the surfaces that share no vertex. They are the first nodes.
    #[must_use]
    #[doc(hidden)]
    pub const fn roots(&self) -> u32 {
        self.header.other_roots + 1
    }

    /// Stack entries that a traversal needs: one, plus for every level of the tree the largest number of siblings there
    /// less one.
    #[must_use]
    pub const fn stack(&self) -> u32 {
        self.header.stack
    }

    /// Largest distance of a vertex from its position in the mesh's file, by rounding to f32; 0 if the file holds f32.
    /// Part of the accuracy of every answer.
    #[must_use]
    pub const fn position_error(&self) -> f32 {
        self.header.position_error
    }

    /// The point of the mesh's file, in millimetres, that is the origin of the tree's coordinates: those of vertices,
    /// tools and answers. Zero unless the file's coordinates are so far from their own origin that f32 would lose
    /// precision.
    #[must_use]
    pub const fn origin(&self) -> [f64; 3] {
        format::origin(self.sections.origin)
    }

    /// A point of the mesh's file (mm) in the tree's coordinates: less the [origin](Self::origin), in f64, then
    /// rounded.
    ///
    /// Cost: three subtractions in f64, some hundred instructions on a processor without f64.
    #[must_use]
    pub const fn local(&self, point: [f64; 3]) -> Vec3 {
        let ([x, y, z], [x0, y0, z0]) = (point, self.origin());
        Vec3::new((x - x0) as f32, (y - y0) as f32, (z - z0) as f32)
    }

    /// The stretch limit `s` that the tree was built for (1 = no stretch).
    #[must_use]
    pub const fn stretch(&self) -> f32 {
        self.header.stretch
    }

    /// The measure of stretch to which the limit applies.
    #[must_use]
    pub const fn paths(&self) -> PathKind {
        self.header.paths
    }

    /// Bytes of nodes and triangles, which a query reads besides the vertex table.
    #[must_use]
    pub const fn query_bytes(&self) -> usize {
        self.sections.nodes.len() + self.sections.triangles.len()
    }

    /// Bytes of the adjacency; 0 if the tree has none.
    #[must_use]
    pub const fn adjacency_bytes(&self) -> usize {
        self.sections.adjacency.len()
    }

    /// Vertex rows of the three corners of a triangle, or `None` outside the table.
    #[must_use]
    pub const fn corners(&self, triangle: TriangleRow) -> Option<[u32; 3]> {
        self.triangle(triangle.0)
    }

    #[inline(always)]
    pub(crate) const fn triangle(&self, row: u32) -> Option<[u32; 3]> {
        format::triangle::<I>(self.sections.triangles, row)
    }

    /// The mesh's number of the vertex in `row`; `None` outside the table or if the tree was emitted without its vertex
    /// order.
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Tree, VertexNumber};
    ///
    /// let built = Builder::new().build(&generate::heart(320)?.mesh)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// assert_eq!(tree.vertex_number(5), Some(VertexNumber(built.vertex_order()[5])));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn vertex_number(&self, row: u32) -> Option<VertexNumber> {
        match format::vertex_number::<I>(self.sections.order, row) {
            Some(number) => Some(VertexNumber(number)),
            None => None,
        }
    }

    /// Rest position of the vertex in `row` (mm); `None` outside the table or if the tree was emitted without its rest
    /// shape.
    #[must_use]
    pub const fn rest_position(&self, row: u32) -> Option<Vec3> {
        format::rest_position(self.sections.rest, row)
    }

    /// Rest metric of a triangle (`docs/format.md`); `None` outside the table or if the tree was emitted without its
    /// metric.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub const fn metric(&self, row: u32) -> Option<Metric> {
        format::metric(self.sections.metric, row)
    }

    /// Stretch limit of a triangle: the tree's, or less if the tree was built with limits for each triangle. `None`
    /// outside the table.
    #[must_use]
    pub const fn stretch_limit(&self, TriangleRow(row): TriangleRow) -> Option<f32> {
        if self.sections.limits.is_empty() {
            return if row < self.header.triangles { Some(self.header.stretch) } else { None };
        }
        match format::limit_code(self.sections.limits, row) {
            Some(code) => Some(self.header.stretch * (code as f32 / format::MAX_LIMIT_CODE as f32)),
            None => None,
        }
    }

    /// Label of a triangle's tissue, for a margin and a stiffness of its own. Query the contacts of each label with
    /// [`Options::contacts_of`](crate::Options::contacts_of): the contacts of the whole surface may include none on a
    /// part that is within its margin but next to a nearer part. `None` outside the table or if the tree was built
    /// without labels.
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::constraint::{Proxy, SpringDamper};
    /// use dibs_nostd::{Contacts, Options, Query, Sphere, Tree, glam::Vec3};
    ///
    /// const MUSCLE: u8 = 1;
    /// const ARTERY: u8 = 2;
    /// let heart = generate::heart(1_000)?.mesh;
    /// let is_right = |corners: &[u32; 3]| heart.positions[corners[0] as usize].x > 0.0;
    /// let label = |corners| if is_right(corners) { ARTERY } else { MUSCLE };
    /// let labels = heart.triangles.iter().map(label).collect();
    /// let built = Builder::new().labels(labels).build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let rows = built.to_rows(&heart.positions);
    ///
    /// let soft = Proxy::new(SpringDamper::stiffness(0.5).max_force(2.0), 1.0)?;
    /// let hard = Proxy::new(SpringDamper::stiffness(2.0).max_force(8.0), 5.0)?;
    /// let mut query = Query::<_, 32>::new(&tree)?;
    /// let mut contacts = Contacts::<8>::new();
    /// let tool = Sphere::new(Vec3::new(65.0, 0.0, 20.0), 2.5)?;
    /// let mut force = Vec3::ZERO;
    /// for (label, margin, wall) in [(MUSCLE, 1.0, soft), (ARTERY, 5.0, hard)] {
    ///     let options = Options::new().contacts_of(label);
    ///     query.contacts(rows.as_slice(), &tool, margin, &options, &mut contacts)?;
    ///     let (found, accuracy) = (contacts.within(margin), contacts.accuracy());
    ///     force += wall.wrench(found, accuracy, tool.centre(), Vec3::ZERO, Vec3::ZERO).force;
    /// }
    /// # let _ = force;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn label(&self, TriangleRow(row): TriangleRow) -> Option<u8> {
        match format::range(self.sections.labels, row, 1) {
            Some([label]) => Some(*label),
            _ => None,
        }
    }

    /// Whether a triangle has this label.
    ///
    /// Cost: linear in the triangles: ask at start-up.
    #[must_use]
    pub const fn has_label(&self, label: u8) -> bool {
        self.labels().contains(label)
    }

    /// The labels that triangles have.
    pub(crate) const fn labels(&self) -> LabelSet {
        LabelSet::of(self.sections.labels)
    }

    /// Pin, geodesic radius (mm, rounded up) and link of a node, for programs that walk the tree; `None` outside the
    /// table. Row 0 is the root.
    #[must_use]
    pub const fn node(&self, row: u32) -> Option<(u32, f32, NodeLink)> {
        match self.record(row) {
            Some(node) => {
                let radius = node.radius_code as f32 * self.header.radius_unit;
                Some((node.pin, radius, NodeLink::decode(node.link)))
            }
            None => None,
        }
    }

    #[inline(always)]
    pub(crate) const fn record(&self, row: u32) -> Option<Node> {
        format::node::<I>(self.sections.nodes, row)
    }

    /// As [`Self::record`], but faster at run time.
    #[inline(always)]
    pub(crate) fn whole_record(&self, row: u32) -> Option<Node> {
        format::whole_node::<I>(self.sections.nodes, row)
    }

    #[cfg(feature = "batched")]
    #[inline(always)]
    pub(crate) fn copy_nodes(&self, first: u32, count: u32, to: &mut [u8]) -> Option<()> {
        several::copy_nodes::<I>(self.sections.nodes, first, count, to)
    }

    #[cfg(feature = "batched")]
    #[inline(always)]
    pub(crate) fn leaf_vertices(&self, first: u32, count: u32) -> Option<[u32; 12]> {
        several::leaf_vertices::<I>(self.sections.triangles, first, count)
    }

    #[cfg(feature = "batched")]
    #[inline(always)]
    pub(crate) fn four_triangles(&self, first: u32, count: u32) -> Option<[[u32; 4]; 3]> {
        several::four_triangles::<I>(self.sections.triangles, first, count)
    }

    /// The nodes in a range of rows; `None` unless all exist.
    #[inline(always)]
    pub(crate) fn records(&self, first: u32, count: u32) -> Option<impl Iterator<Item = Node>> {
        let mut rows = format::run(self.sections.nodes, first, count, format::node_bytes::<I>())?;
        Some(iter::from_fn(move || {
            let (node, rest) = format::split_node::<I>(rows)?;
            rows = rest;
            Some(node)
        }))
    }

    /// The corners of a range of triangles; `None` unless all exist.
    #[inline(always)]
    pub(crate) fn triangles(
        &self,
        first: u32,
        count: u32,
    ) -> Option<impl Iterator<Item = [u32; 3]>> {
        let stride = format::triangle_bytes::<I>();
        let mut rows = format::run(self.sections.triangles, first, count, stride)?;
        Some(iter::from_fn(move || {
            let (corners, rest) = format::split_triangle::<I>(rows)?;
            rows = rest;
            Some(corners)
        }))
    }

    pub(crate) const fn header(&self) -> &Header {
        &self.header
    }

    pub(crate) const fn sections(&self) -> &Sections<'a> {
        &self.sections
    }
}
