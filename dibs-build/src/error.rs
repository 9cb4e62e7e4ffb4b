//! Why a tree cannot be built or written.

use dibs_nostd::format::MAX_ROOTS;

/// Why a tree cannot be built or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The mesh has no triangle.
    #[error("the mesh has no triangles: there is no surface to measure a distance to")]
    NoTriangles,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {vertex}, the mesh has {vertices} vertices")]
    Corner {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A triangle without area: its corners are collinear or coincide.
    #[error(
        "triangle {triangle}, with the vertices {corners:?}, has no area: remove it, or weld its \
         corners (`dibs_build::read` drops such triangles)"
    )]
    NoArea {
        /// The triangle.
        triangle: usize,
        /// Its vertices.
        corners: [u32; 3],
    },
    /// A vertex has a coordinate that is not finite.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    Coordinate {
        /// The vertex.
        vertex: usize,
    },
    /// The mesh's origin is not a point.
    #[error("the mesh's origin, {origin}, has a coordinate that is not a finite number")]
    Origin {
        /// The origin.
        origin: glam::DVec3,
    },
    /// The mesh has more vertices than the index width can number.
    #[error(
        "the mesh has {vertices} vertices, {bits}-bit indices number at most {most}: \
         use 32-bit indices or a coarser mesh"
    )]
    TooManyVertices {
        /// Vertices of the mesh.
        vertices: usize,
        /// Most vertices of this width.
        most: u32,
        /// Bits of an index.
        bits: usize,
    },
    /// The mesh has more triangles than a tree of 16-bit indices stores the neighbours of.
    #[error(
        "the mesh has {triangles} triangles, with 16-bit indices the neighbours of at most {most} are stored: \
         use 32-bit indices or a coarser mesh"
    )]
    TooManyTriangles {
        /// Triangles of the mesh.
        triangles: usize,
        /// Most triangles.
        most: usize,
    },
    /// A stretch limit that is not a number of at least 1.
    #[error(
        "a stretch limit of {stretch} makes no sense: it is a factor of at least 1 (at most 1e6)"
    )]
    Stretch {
        /// The limit given.
        stretch: f32,
    },
    /// The number of limits differs from the number of triangles or tetrahedra.
    #[error(
        "{limits} stretch limits, and there are {elements} of {of}: there must be one for each"
    )]
    Limits {
        /// Limits given.
        limits: usize,
        /// Triangles of the mesh, or tetrahedra of the volume.
        elements: usize,
        /// `triangles` or `tetrahedra`.
        of: &'static str,
    },
    /// The number of labels differs from the number of triangles.
    #[error("{labels} labels for a mesh of {triangles} triangles: there must be one for each")]
    Labels {
        /// Labels given.
        labels: usize,
        /// Triangles of the mesh.
        triangles: usize,
    },
    /// A triangle's stretch limit that is not a number of at least 1.
    #[error(
        "{of} {element} has a stretch limit of {limit}: it is a factor of at least 1 (at most 1e6)"
    )]
    Limit {
        /// `triangle`, or `tetrahedron` of a volume.
        of: &'static str,
        /// Its index.
        element: usize,
        /// Its limit.
        limit: f32,
    },
    /// A leaf size outside 1 to 8.
    #[error("leaves of {triangles} triangles cannot be stored: 1 to 8 are possible")]
    LeafSize {
        /// The size asked for.
        triangles: usize,
    },
    /// The mesh has more components than a tree has roots.
    #[error(
        "the mesh has {components} surfaces that share no vertex, and a tree holds {MAX_ROOTS} at most: drop the smallest"
    )]
    Components {
        /// Their number.
        components: usize,
    },
    /// The triangles are connected in so many ways that a search for paths between them would take too long.
    #[error(
        "the {triangles} triangles are connected at random, or by edges of very many triangles, and not as a surface: check \
         the vertex numbers of its faces"
    )]
    Tangled {
        /// Triangles of the mesh.
        triangles: usize,
    },
    /// The volume cannot carry the surface.
    #[error(transparent)]
    Volume(#[from] crate::VolumeError),
    /// The nodes fail their validation: a defect of the builder.
    #[error("the builder made nodes that its own checker rejects ({0}); please report this mesh")]
    InvalidNodes(#[from] dibs_nostd::nodes::NodesError),
    /// The tree fails its validation: a defect of the builder.
    #[error("the builder made a tree that its own checker rejects ({0}); please report this mesh")]
    Invalid(#[from] dibs_nostd::FormatError),
    /// The tree would not fit the format's 32-bit offsets.
    #[error("the tree takes {bytes} bytes, the format ends at 4 GiB: use a coarser mesh")]
    TooLarge {
        /// Bytes of the tree.
        bytes: u64,
    },
    /// A name that cannot name a Rust module.
    #[error(
        "{name:?} is not a name for a Rust module: use lower-case letters, digits and underscores, \
         a letter first, and no keyword"
    )]
    Name {
        /// The name asked for.
        name: String,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] crate::WriteError),
}
