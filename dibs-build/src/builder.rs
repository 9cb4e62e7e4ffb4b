//! The builder, for a `build.rs` and the `dibs` program.
//!
//! One file, because it is the builder's whole interface.

use dibs_nostd::Index;
use std::sync::Arc;

use dibs_nostd::format::{MAX_CHILDREN, MAX_LEAF_TRIANGLES, PathKind, Unit};

use crate::array::{BuiltTree, Facts, flatten};
use crate::construct::{Cluster, Construction, Constructor, Surface, widen};
use crate::error::BuildError;
use crate::geodesic::{Graph, Topology};
use crate::mesh::{Mesh, RestSurface};
use crate::nodes::{Embedding, Volume};
use crate::rest::{LimitRatios, Paths, SHARED, has_area, least_limits};
use crate::rounding::round_up;

/// Width of the vertex indices in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum IndexWidth {
    /// 16 bits up to 65,536 vertices and, with neighbours, 262,144 triangles; 32 above.
    #[default]
    Fitting,
    /// 16 bits; a larger mesh is an error.
    Bits16,
    /// 32 bits.
    Bits32,
}

/// Builds trees.
///
/// ```
/// use dibs_build::{Builder, generate};
/// let mesh = generate::heart(1_000)?.mesh;
/// let tree = Builder::new().stretch(1.5).build(&mesh)?;
/// assert_eq!(tree.summary().triangles, 1_000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Builder<'p> {
    stretch: f32,
    limits: Option<Vec<f32>>,
    nodes: Option<Arc<Volume>>,
    labels: Option<Vec<u8>>,
    unit: Option<Unit>,
    construction: Construction,
    paths: Option<Paths>,
    leaf_triangles: Option<usize>,
    index: IndexWidth,
    with_order: bool,
    with_rest: bool,
    with_metric: bool,
    with_adjacency: bool,
    progress: &'p (dyn Fn(usize) + Sync),
}

impl std::fmt::Debug for Builder<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Builder")
            .field("stretch", &self.stretch)
            .field("construction", &self.construction)
            .field("paths", &self.paths)
            .field("leaf_triangles", &self.leaf_triangles)
            .field("index", &self.index)
            .finish_non_exhaustive()
    }
}

impl Default for Builder<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'p> Builder<'p> {
    /// The default construction, for a stretch limit of 1.5.
    #[must_use]
    pub fn new() -> Self {
        Self {
            stretch: 1.5,
            limits: None,
            nodes: None,
            labels: None,
            unit: None,
            construction: Construction::Geodesic,
            paths: None,
            leaf_triangles: None,
            index: IndexWidth::Fitting,
            with_order: true,
            with_rest: true,
            with_metric: true,
            with_adjacency: true,
            progress: &|_| (),
        }
    }

    /// The largest stretch that the tree must cover: a factor of at least 1.
    ///
    /// A limit that the controller's arithmetic cannot tell from the rest shape is raised to the least one that it can:
    /// 1.0006, and up to 1.016 where triangles have corners sharper than 10 degrees. So for rigid tissue give 1.
    #[must_use]
    pub fn stretch(mut self, limit: f32) -> Self {
        self.stretch = limit;
        self
    }

    /// A stretch limit for each of the mesh's triangles, or of the tetrahedra of a [volume](Self::nodes), each at least 1,
    /// instead of one for all.
    ///
    /// Tissue stretches much in few places, so limits for each triangle make spheres smaller everywhere else.
    /// [`MotionStretch::limits`](crate::MotionStretch::limits) derives them from a recorded motion. Along-surface
    /// distances are weighted by the limits, and the tree's own limit is the largest. A limit that the controller
    /// cannot tell from the rest shape is raised as in [`stretch`](Self::stretch).
    #[must_use]
    pub fn limits(mut self, limits: Vec<f32>) -> Self {
        self.limits = Some(limits);
        self
    }

    /// A volume whose nodes move the surface: a frame then holds the nodes' positions, and the stretch limit is that of
    /// each tetrahedron. Radii are lengths of paths through the volume, and the tree carries no metric of triangles.
    /// [`construction`](Self::construction) and [`paths`](Self::paths) have no effect, except that the paper's construction
    /// has one triangle a leaf, and two children a node.
    ///
    /// A vertex is bound to the tetrahedron around it by weights of 16 bits; the tree's rest shape is computed from
    /// these. Its distance from the mesh, times the stretch limit, is added to the error of every answer.
    #[must_use]
    pub fn nodes(mut self, volume: &Volume) -> Self {
        self.nodes = Some(Arc::new(volume.clone()));
        self
    }

    pub(crate) fn volume(&self) -> Option<&Volume> {
        self.nodes.as_deref()
    }

    /// A label for each of the mesh's triangles, say of its tissue: [`Tree::label`](dibs_nostd::Tree::label).
    ///
    /// [`read_labels`](crate::read_labels) reads them from a file. They take a byte a triangle of flash.
    #[must_use]
    pub fn labels(mut self, labels: Vec<u8>) -> Self {
        self.labels = Some(labels);
        self
    }

    /// The unit of the mesh's file, which the tree keeps so that a frame in another one is refused. It scales nothing:
    /// a mesh is in millimetres. An [`Import`](crate::Import) states the unit of its file itself.
    #[must_use]
    pub fn unit(mut self, unit: Unit) -> Self {
        self.unit = Some(unit);
        self
    }

    /// How sections are pinned and split, and their radii measured.
    #[must_use]
    pub fn construction(mut self, construction: Construction) -> Self {
        self.construction = construction;
        self
    }

    /// The paths that along-surface distances are measured on, which also decide which stretch is limited.
    #[must_use]
    pub fn paths(mut self, paths: Paths) -> Self {
        self.paths = Some(paths);
        self
    }

    /// Most triangles in a leaf, 1 to 8.
    #[must_use]
    pub fn leaf_triangles(mut self, most: usize) -> Self {
        self.leaf_triangles = Some(most);
        self
    }

    /// Width of the vertex indices.
    #[must_use]
    pub fn index(mut self, width: IndexWidth) -> Self {
        self.index = width;
        self
    }

    /// Whether the tree carries the mesh's vertex numbers (2 or 4 bytes a vertex).
    #[must_use]
    pub fn with_vertex_order(mut self, with: bool) -> Self {
        self.with_order = with;
        self
    }

    /// Whether the tree carries the rest shape (12 bytes a vertex).
    #[must_use]
    pub fn with_rest_shape(mut self, with: bool) -> Self {
        self.with_rest = with;
        self
    }

    /// Whether the tree has the triangles' rest metric (12 bytes a triangle), for the stretch measurement needs.
    #[must_use]
    pub fn with_metric(mut self, with: bool) -> Self {
        self.with_metric = with;
        self
    }

    /// Whether the tree carries its triangles' neighbours (6 or 12 bytes a triangle), from which a query finds a tool's
    /// side. A surface without sides (with an edge of more than two triangles, or of two that are wound against each
    /// other) has none in any case.
    #[must_use]
    pub fn with_adjacency(mut self, with: bool) -> Self {
        self.with_adjacency = with;
        self
    }

    /// Calls back with the number of triangles done, from any thread.
    #[must_use]
    pub fn progress<'q>(self, report: &'q (dyn Fn(usize) + Sync)) -> Builder<'q>
    where
        'p: 'q,
    {
        Builder { progress: report, ..self }
    }

    /// Builds the tree of a [`Mesh`], or of an [`Import`](crate::Import), whose rounding to f32 is then added to the
    /// error of every answer. The same mesh and options give the same bytes with any number of threads.
    ///
    /// Cost: `O(n log^2 n)` for `n` triangles, on all cores.
    ///
    /// # Errors
    /// [`BuildError`] names the defect of the mesh or the options.
    pub fn build(&self, surface: &(impl RestSurface + ?Sized)) -> Result<BuiltTree, BuildError> {
        let mesh = surface.mesh();
        self.check(mesh)?;
        if self.is_narrow(mesh) {
            self.build_with::<u16>(surface)
        } else {
            self.build_with::<u32>(surface)
        }
    }

    /// Whether the tree's indices have 16 bits.
    fn is_narrow(&self, mesh: &Mesh) -> bool {
        match self.index {
            IndexWidth::Fitting => self.check_width::<u16>(mesh).is_ok(),
            IndexWidth::Bits16 => true,
            IndexWidth::Bits32 => false,
        }
    }

    /// An error unless indices of this width number the mesh's vertices and, for a tree with neighbours, its triangles.
    fn check_width<I: Index>(&self, mesh: &Mesh) -> Result<(), BuildError> {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        if vertices > I::MAX_VERTICES as usize {
            let (most, bits) = (I::MAX_VERTICES, 8 * I::BYTES);
            return Err(BuildError::TooManyVertices { vertices, most, bits });
        }
        let most = I::MAX_ADJACENT_TRIANGLES as usize;
        if self.with_adjacency && triangles > most {
            return Err(BuildError::TooManyTriangles { triangles, most });
        }
        Ok(())
    }

    fn build_with<I: Index>(
        &self,
        surface: &(impl RestSurface + ?Sized),
    ) -> Result<BuiltTree, BuildError> {
        let mesh = surface.mesh();
        self.check_width::<I>(mesh)?;
        if let Some(volume) = &self.nodes {
            return self.build_embedded::<I>(surface, volume);
        }
        let paths = self.paths.unwrap_or(match self.construction {
            Construction::Paper => Paths::Edges,
            _ => Paths::default(),
        });
        let (stretch, ratios) = match &self.limits {
            Some(limits) => {
                let least = least_limits(mesh, paths.kind()).map(round_up);
                let limits: Vec<f32> =
                    limits.iter().zip(least).map(|(&l, least)| l.max(least)).collect();
                LimitRatios::of(&limits)
            }
            None => (self.stretch, LimitRatios::default()),
        };
        // A limit of 1.02 or more admits every rest shape.
        let stretch = if ratios.is_uniform() && stretch < 1.02 {
            let least = least_limits(mesh, paths.kind()).fold(1.0, f64::max) * SHARED;
            stretch.max(round_up(least))
        } else {
            stretch
        };
        let roots = self.construct(mesh, paths, &ratios)?;
        let facts = Facts {
            paths: paths.kind(),
            stretch,
            ratios: &ratios,
            position_error: surface.position_error(),
            unit: self.unit.or(surface.unit()),
            file_triangles: surface.file_triangles(),
            with_order: self.with_order,
            with_rest: self.with_rest,
            with_metric: self.with_metric,
            with_adjacency: self.with_adjacency,
            labels: self.labels.as_deref(),
            embedding: None,
        };
        let (bytes, order) = flatten::<I>(mesh, &roots, facts)?;
        Ok(BuiltTree::new::<I>(bytes, order, mesh.origin))
    }

    fn build_embedded<I: Index>(
        &self,
        surface: &(impl RestSurface + ?Sized),
        volume: &Volume,
    ) -> Result<BuiltTree, BuildError> {
        let mut embedding = Embedding::new(volume, surface.mesh())?;
        let mesh = embedding.mesh(surface.mesh());
        let stretch = embedding.limit(self.stretch, self.limits.as_deref())?;
        let paths = embedding.paths();
        // Paths along the surface are not needed: an empty graph.
        let none = Mesh::default();
        let ratios = LimitRatios::default();
        let graph = Graph::new(&none, &Topology::new(&none), Paths::Edges, &ratios);
        let roots = self.clusters(Surface {
            mesh: &mesh,
            graph: &graph,
            restricted: false,
            volume: Some(&paths),
        })?;
        let facts = Facts {
            paths: PathKind::Volume,
            stretch,
            ratios: &ratios,
            position_error: round_up(
                f64::from(surface.position_error()) + embedding.error * f64::from(stretch),
            ),
            unit: self.unit.or(surface.unit()),
            file_triangles: surface.file_triangles(),
            with_order: self.with_order,
            with_rest: self.with_rest,
            with_metric: false,
            with_adjacency: self.with_adjacency,
            labels: self.labels.as_deref(),
            embedding: Some(&embedding),
        };
        let (bytes, order) = flatten::<I>(&mesh, &roots, facts)?;
        Ok(BuiltTree::new::<I>(bytes, order, mesh.origin))
    }

    fn construct(
        &self,
        mesh: &Mesh,
        paths: Paths,
        ratios: &LimitRatios,
    ) -> Result<Vec<Cluster>, BuildError> {
        let topology = Topology::new(mesh);
        let graph = Graph::new(mesh, &topology, paths, ratios);
        let restricted = self.construction == Construction::Paper;
        self.clusters(Surface { mesh, graph: &graph, restricted, volume: None })
    }

    fn clusters(&self, surface: Surface<'_>) -> Result<Vec<Cluster>, BuildError> {
        let leaf_triangles = self.leaf_triangles.unwrap_or(match self.construction {
            Construction::Paper => 1,
            _ => DEFAULT_LEAF,
        });
        let constructor =
            Constructor::new(surface, self.construction, leaf_triangles, self.progress);
        let children = match self.construction {
            Construction::Paper => 2,
            _ => MAX_CHILDREN as usize,
        };
        Ok(constructor.run()?.into_iter().map(|root| widen(root, children)).collect())
    }

    fn check_limits(&self, mesh: &Mesh) -> Result<(), BuildError> {
        let possible = 1.0..=1e6;
        let Some(limits) = &self.limits else {
            if possible.contains(&self.stretch) {
                return Ok(());
            }
            return Err(BuildError::Stretch { stretch: self.stretch });
        };
        let (elements, of, all) = match &self.nodes {
            Some(volume) => (volume.tetrahedra().len(), "tetrahedron", "tetrahedra"),
            None => (mesh.triangles.len(), "triangle", "triangles"),
        };
        if limits.len() != elements {
            return Err(BuildError::Limits { limits: limits.len(), elements, of: all });
        }
        match limits.iter().position(|limit| !possible.contains(limit)) {
            Some(element) => Err(BuildError::Limit { of, element, limit: limits[element] }),
            None => Ok(()),
        }
    }

    fn check(&self, mesh: &Mesh) -> Result<(), BuildError> {
        if mesh.triangles.is_empty() {
            return Err(BuildError::NoTriangles);
        }
        self.check_limits(mesh)?;
        let triangles = mesh.triangles.len();
        if let Some(labels) = self.labels.as_ref().map(Vec::len)
            && labels != triangles
        {
            return Err(BuildError::Labels { labels, triangles });
        }
        if let Some(triangles) = self.leaf_triangles
            && !(1..=MAX_LEAF_TRIANGLES as usize).contains(&triangles)
        {
            return Err(BuildError::LeafSize { triangles });
        }
        if !mesh.origin.is_finite() {
            return Err(BuildError::Origin { origin: mesh.origin });
        }
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(BuildError::Coordinate { vertex });
        }
        let vertices = mesh.positions.len();
        for (triangle, &corners) in mesh.triangles.iter().enumerate() {
            if let Some(vertex) = corners.into_iter().find(|&v| v as usize >= vertices) {
                return Err(BuildError::Corner { triangle, vertex, vertices });
            }
            if !has_area(mesh.corners(corners)) {
                return Err(BuildError::NoArea { triangle, corners });
            }
        }
        Ok(())
    }
}

/// Triangles a leaf of the default construction.
const DEFAULT_LEAF: usize = 8;

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// With neighbours, 16-bit indices end at 262,144 triangles; without, only the number of vertices counts.
    #[test]
    fn the_indices_suffice_for_the_neighbours() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = |triangles| Mesh {
            positions: positions.clone(),
            triangles: vec![[0, 1, 2]; triangles],
            ..Mesh::default()
        };
        let (most, more) = (mesh(262_144), mesh(262_145));
        let fitting = Builder::new();
        assert!(fitting.is_narrow(&most) && !fitting.is_narrow(&more));
        assert!(fitting.check_width::<u32>(&more).is_ok());
        assert!(fitting.with_adjacency(false).is_narrow(&more));
        let error = Builder::new().index(IndexWidth::Bits16).build(&more).unwrap_err();
        let expected = BuildError::TooManyTriangles { triangles: 262_145, most: 262_144 };
        assert_eq!(error.to_string(), expected.to_string());
    }
}
