//! Contacts as inequalities on the tool's velocity.

// Requirement: S-06

use glam::Vec3;

use crate::math::round::sum_down;
use crate::query::Contact;

/// One inequality on the tool's velocity: `linear . v + angular . w >= least`, with `v`, the velocity of a point of
/// the tool (mm/s), and `w`, the tool's angular velocity (1/s).
///
/// A vector field inequality (Marinho et al., IEEE T-RO 2019) that includes the surface's velocity. Under it a
/// contact's separation falls towards [`stand_off`](Self::stand_off) no faster than exponentially, at a rate of
/// [`gain`](Self::gain); below the stand-off it must grow. It has plain arrays, for any solver of quadratic programs.
///
/// If a tool crosses the surface or is inside, and its deepest point is in the interior of the axis, two triangles
/// bound the depth, one on each side. The row is then the mean of both triangles' rows, with the weights that cancel
/// the motion along the axis: the rate of the separation. The deepest point is known within the depth's tolerance
/// ([`Options::depth_tolerance`](crate::Options::depth_tolerance)); of triangles that tie within it, the row has two.
/// Between opposite walls its factors are small, and 0 between parallel ones: no small motion reduces the depth, so a
/// row below its stand-off has no solution unless the solver may relax it. If the budget ended before the second
/// triangle was found, the row is that of the closest triangle. If the second triangle is parallel to the axis, the row is
/// of one triangle alone. Rounding decides which one, so it may be the second triangle at one tick and the closest one at
/// the next.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::constraint::VelocityRow;
/// use dibs_nostd::{Contacts, Options, Query, Sphere, Tree, glam::Vec3};
///
/// let heart = generate::heart(1_000)?.mesh;
/// let built = Builder::new().build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let rows = built.to_rows(&heart.positions);
/// let mut query = Query::<_, 32>::new(&tree)?;
/// let mut contacts = Contacts::<8>::new();
/// let tool = Sphere::new(Vec3::new(-60.0, 0.0, 20.0), 2.5)?;
/// query.contacts(rows.as_slice(), &tool, 50.0, &Options::new(), &mut contacts)?;
/// for contact in contacts.iter() {
///     let row = VelocityRow::new(contact, contacts.accuracy(), tool.centre()).stand_off(1.0).gain(20.0);
///     let along = |speed: f32| Vec3::from(row.linear) * speed;
///     assert!(row.allows(along(row.least + 0.01), Vec3::ZERO));
///     assert!(!row.allows(along(row.least - 0.01), Vec3::ZERO));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct VelocityRow {
    /// Factors of the linear velocity: the contact's normal, or the mean of two.
    pub linear: [f32; 3],
    /// Factors of the angular velocity (mm): the cross product of the lever arm with `linear`.
    pub angular: [f32; 3],
    /// The smallest allowed sum (mm/s).
    pub least: f32,
    /// The surface's velocity along the normal (mm/s).
    surface: f32,
    /// Separation less its accuracy (mm).
    separation: f32,
    /// mm.
    stand_off: f32,
    /// 1/s.
    gain: f32,
}

impl VelocityRow {
    /// The row of a contact whose separation is within `accuracy` (mm), for the velocity of the tool at `origin`.
    /// Without a [gain](Self::gain) the tool may not approach at all.
    ///
    /// Cost: some tens of f32 operations.
    #[must_use]
    pub fn new(contact: &Contact, accuracy: f32, origin: Vec3) -> Self {
        let (mut linear, mut point) = (contact.normal, contact.point_on_tool);
        let mut surface = linear.dot(contact.velocity);
        let across = &contact.across;
        if across.weight > 0.0 {
            let own = 1.0 - across.weight;
            linear = linear * own + across.normal * across.weight;
            surface = surface * own + across.speed * across.weight;
            point = across.on_axis;
        }
        Self {
            linear: linear.to_array(),
            angular: (point - origin).cross(linear).to_array(),
            least: surface,
            surface,
            separation: sum_down(contact.separation, -accuracy),
            stand_off: 0.0,
            gain: 0.0,
        }
    }

    /// The same for a stand-off (mm); 0 by default.
    #[must_use]
    pub fn stand_off(self, stand_off: f32) -> Self {
        Self { stand_off, ..self }.with_least()
    }

    /// The same for a gain (1/s), at least 0.
    #[must_use]
    pub fn gain(self, gain: f32) -> Self {
        Self { gain, ..self }.with_least()
    }

    fn with_least(self) -> Self {
        let left = self.separation - self.stand_off;
        Self { least: self.surface - self.gain * left, ..self }
    }

    /// Whether a velocity satisfies the inequality.
    #[must_use]
    pub fn allows(&self, linear: Vec3, angular: Vec3) -> bool {
        Vec3::from_array(self.linear).dot(linear) + Vec3::from_array(self.angular).dot(angular)
            >= self.least
    }
}
