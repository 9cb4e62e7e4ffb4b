//! Contacts: all locally closest pairs within a margin.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::constraint::VelocityRow;
use dibs_nostd::{Contact, Contacts, Proximity, TriangleRow};

use crate::border::{Handle, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::frame::{Vertices, ask, dibs_frame, rows};
use crate::query::{dibs_options, dibs_proximity, dibs_query};
use crate::tool::{Shape, dibs_tool, dibs_vec3};

/// Bytes of a list's storage.
pub const DIBS_CONTACTS_SIZE: usize = 13_056;

/// Contacts that a list holds; if there are more, the deepest.
pub const DIBS_CONTACTS: usize = 16;

/// Triangles that a search for contacts considers at once; if there are more, the nearest.
pub const DIBS_NEAR: usize = 512;

/// A list of contacts.
///
/// One context at a time.
pub struct dibs_contacts(pub(crate) List);

type List = Contacts<DIBS_CONTACTS, DIBS_NEAR>;

impl dibs_contacts {
    /// Fills the list. After an error it is empty: the contacts of the last pose do not apply to this one.
    pub(crate) fn fill<R>(
        &mut self,
        call: impl FnOnce(&mut List) -> Result<R, dibs_code>,
    ) -> Result<R, dibs_code> {
        let filled = call(&mut self.0);
        if filled.is_err() {
            self.0 = List::new();
        }
        filled
    }
}

impl Kind for dibs_contacts {
    const MARK: u32 = 0x6462_630A;
    const SIZE: usize = DIBS_CONTACTS_SIZE;
}

/// A locally closest pair of tool and surface.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_contact {
    /// Signed separation (mm): the lower bound of the pair's interval, as `lower` of `dibs_proximity`.
    pub separation: f32,
    /// Unit vector that points out of the surface.
    pub normal: dibs_vec3,
    /// The surface's point (mm).
    pub point_on_surface: dibs_vec3,
    /// The tool's point (mm).
    pub point_on_tool: dibs_vec3,
    /// Position of the pair along the tool's axis: 0 at its start, 1 at its end.
    pub axis_parameter: f32,
    /// Index of the surface in a scene; 0 for a single surface.
    pub surface: u32,
    /// Index of the tool in a chain; 0 for a single tool.
    pub tool: u32,
    /// Row of the triangle.
    pub triangle: u32,
    /// That triangle's corners: rows of vertices, for `dibs_tree_vertex_number`.
    pub corners: [u32; 3],
    /// Weights of the corners at `point_on_surface`.
    pub barycentric: [f32; 3],
    /// Velocity (mm/s) of the surface at the contact: zero until `dibs_contacts_set_velocities`; a guard's list has it.
    pub velocity: dibs_vec3,
}

impl From<&Contact> for dibs_contact {
    fn from(found: &Contact) -> Self {
        let TriangleRow(triangle) = found.triangle;
        Self {
            separation: found.separation,
            normal: found.normal.into(),
            point_on_surface: found.point_on_surface.into(),
            point_on_tool: found.point_on_tool.into(),
            axis_parameter: found.axis_parameter,
            surface: found.surface as u32,
            tool: found.tool as u32,
            triangle,
            corners: found.corners,
            barycentric: found.barycentric,
            velocity: found.velocity.into(),
        }
    }
}

/// Properties of a list.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_contacts_facts {
    /// Contacts in the list.
    pub count: u32,
    /// Every contact with a separation below this (mm) is in the list.
    pub bound: f32,
    /// No separation is too high by more than this (mm).
    pub accuracy: f32,
    /// 1 if contacts within the margin were left out because the list is full; else 0.
    pub is_full: u32,
}

/// Makes an empty list of contacts.
///
/// @param storage   `DIBS_CONTACTS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size      Bytes of the storage.
/// @param contacts  Receives the list's address.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_contacts_init(
    storage: *mut c_void,
    size: usize,
    contacts: *mut *mut dibs_contacts,
) -> dibs_code {
    dibs_code::of(|| storage.make(size, contacts, || Ok(dibs_contacts(Contacts::new()))))
}

/// Fills the list with all locally closest pairs whose separation is at most `margin`, deepest first.
///
/// Cost: that of `dibs_query_closest`, a range search, and some hundred instructions a triangle within the margin.
///
/// @param query      The query.
/// @param frame      The surface.
/// @param tool       The tool.
/// @param margin     In mm, at least 0.
/// @param options    Options, or null. A budget that runs out lowers the list's bound.
/// @param contacts   The list; empty after an error.
/// @param proximity  Receives the closest pair, or null.
/// @return As `dibs_query_closest`, `DIBS_CODE_MARGIN`, or `DIBS_CODE_TREE_NO_ADJACENCY`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_query_contacts(
    query: *mut dibs_query,
    frame: *mut dibs_frame,
    tool: *const dibs_tool,
    margin: f32,
    options: *const dibs_options,
    contacts: *mut dibs_contacts,
    proximity: *mut dibs_proximity,
) -> dibs_code {
    dibs_code::of(|| {
        let proximity = proximity.check_if_any()?;
        let found: Proximity = contacts.open()?.fill(|list| {
            let (shape, options) = (Shape::try_from(tool.get()?)?, dibs_options::of(options)?);
            let (mut query, frame) = (query.open()?, frame.open()?);
            ask!(frame, shape, |table, tool| query.0.contacts(table, tool, margin, &options, list))
        })?;
        Out::set_if_any(proximity, found.into());
        Ok(())
    })
}

/// Reads the properties of the list.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_contacts_get_facts(
    contacts: *mut dibs_contacts,
    facts: *mut dibs_contacts_facts,
) -> dibs_code {
    dibs_code::of(|| {
        let (facts, list) = (facts.check()?, contacts.open()?);
        facts.set(dibs_contacts_facts {
            count: list.0.len() as u32,
            bound: list.0.bound(),
            accuracy: list.0.accuracy(),
            is_full: list.0.is_full().into(),
        });
        Ok(())
    })
}

/// One contact of the list; number 0 is the deepest.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` if there are fewer contacts, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_contacts_get(
    contacts: *mut dibs_contacts,
    number: u32,
    contact: *mut dibs_contact,
) -> dibs_code {
    dibs_code::of(|| {
        let (contact, list) = (contact.check()?, contacts.open()?);
        let found = list.0.iter().nth(number as usize).ok_or(dibs_code::Argument)?;
        contact.set(found.into());
        Ok(())
    })
}

/// Sets each contact's velocity to that of the surface at the contact.
///
/// @param velocities  x, y and z (mm/s) of each vertex, in the tree's order of rows; only read during the call.
/// @param vertices    Their number.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_VERTEX_COUNT` if a contact's corner has no row, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_contacts_set_velocities(
    contacts: *mut dibs_contacts,
    velocities: *const f32,
    vertices: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (mut list, rows) = (contacts.open()?, rows(velocities, vertices)?);
        list.0.move_with(&Vertices::new(rows, 0.0))?;
        Ok(())
    })
}

/// One inequality on the tool's velocity: `linear . v + angular . w >= least`, with the velocity `v` (mm/s) of a point of
/// the tool and the tool's angular velocity `w` (1/s). For any solver of quadratic programs.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_row {
    /// Factors of the linear velocity: the contact's normal; if the deepest point is inside the tool's axis, the mean
    /// of two triangles' normals.
    pub linear: [f32; 3],
    /// Factors (mm) of the angular velocity.
    pub angular: [f32; 3],
    /// Lower bound of the sum (mm/s).
    pub least: f32,
}

/// The rows of all contacts in the list, deepest first.
///
/// By its row, a contact's separation decreases towards `stand_off` no faster than exponentially, at a rate of `gain`;
/// below `stand_off` it must increase.
///
/// @param contacts   The list.
/// @param origin     The tool's point (mm) that the rows' velocity refers to.
/// @param stand_off  In mm.
/// @param gain       In 1/s.
/// @param capacity   Number of rows that fit in `rows`.
/// @param rows       Receives them.
/// @param count      Receives their number.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY` if not all rows fit, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_contacts_rows(
    contacts: *mut dibs_contacts,
    origin: dibs_vec3,
    stand_off: f32,
    gain: f32,
    capacity: usize,
    rows: *mut dibs_row,
    count: *mut usize,
) -> dibs_code {
    dibs_code::of(|| {
        let (count, list) = (count.check()?, contacts.open()?);
        let mut places = rows.places(capacity)?;
        let accuracy = list.0.accuracy();
        for contact in list.0.iter() {
            let row =
                VelocityRow::new(contact, accuracy, origin.into()).stand_off(stand_off).gain(gain);
            let (linear, angular) = (row.linear, row.angular);
            places.push(dibs_row { linear, angular, least: row.least })?;
        }
        count.set(list.0.len());
        Ok(())
    })
}
