//! What the rows of a frame are: a surface's vertices, or the nodes that move it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::nodes::{EmbeddedSurface, Nodes};
use dibs_nostd::{MeasuredStretch, MovingSurface, Odometer, Tree, measure_stretch};

use crate::Fault;

/// The kind of rows in a script's frames.
pub trait Rows: Sized {
    /// The surface at a table of rows.
    type Surface<'a, V: MovingSurface + 'a>: MovingSurface
    where
        Self: 'a;
    /// Memory for it, if the rows are not the surface.
    type Room<'a, V: MovingSurface + 'a>: Default
    where
        Self: 'a;

    /// Reads a tree.
    ///
    /// # Errors
    /// [`Fault`] if the tree has no such rows.
    fn of(tree: &Tree<'static, u16>) -> Result<Self, Fault>;

    /// The number of a frame's rows.
    fn count(&self) -> u32;

    /// The odometer of such frames.
    fn odometer(&self) -> Odometer;

    /// The stretch of a frame.
    ///
    /// # Errors
    /// [`Fault`] for a frame that is stretched beyond the tree's limit.
    fn measure(&self, rows: &[Vec3]) -> Result<MeasuredStretch, Fault>;

    /// The surface at these rows.
    fn surface<'s, 'a: 's, V: MovingSurface>(
        &'a self,
        rows: &'a V,
        room: &'s mut Self::Room<'a, V>,
    ) -> &'s Self::Surface<'a, V>;
}

/// The vertices of a tree.
pub struct Vertices(Tree<'static, u16>);

impl Rows for Vertices {
    type Surface<'a, V: MovingSurface + 'a> = V;
    type Room<'a, V: MovingSurface + 'a> = ();

    fn of(tree: &Tree<'static, u16>) -> Result<Self, Fault> {
        Ok(Self(*tree))
    }

    fn count(&self) -> u32 {
        self.0.vertex_count()
    }

    fn odometer(&self) -> Odometer {
        Odometer::new(&self.0)
    }

    fn measure(&self, rows: &[Vec3]) -> Result<MeasuredStretch, Fault> {
        measure_stretch(&self.0, rows).map_err(|_| Fault)
    }

    fn surface<'s, 'a: 's, V: MovingSurface>(&'a self, rows: &'a V, (): &'s mut ()) -> &'s V {
        rows
    }
}

impl Rows for Nodes<'static> {
    type Surface<'a, V: MovingSurface + 'a> = EmbeddedSurface<'a, 'static, V>;
    type Room<'a, V: MovingSurface + 'a> = Option<EmbeddedSurface<'a, 'static, V>>;

    fn of(tree: &Tree<'static, u16>) -> Result<Self, Fault> {
        Self::of(tree).map_err(|_| Fault)
    }

    fn count(&self) -> u32 {
        Self::count(self)
    }

    fn odometer(&self) -> Odometer {
        Self::odometer(self)
    }

    fn measure(&self, rows: &[Vec3]) -> Result<MeasuredStretch, Fault> {
        Self::measure(self, rows).map_err(|_| Fault)
    }

    fn surface<'s, 'a: 's, V: MovingSurface>(
        &'a self,
        rows: &'a V,
        room: &'s mut Self::Room<'a, V>,
    ) -> &'s Self::Surface<'a, V> {
        room.insert(Self::surface(self, rows))
    }
}
