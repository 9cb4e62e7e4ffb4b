//! Scenes: a chain of tools and several surfaces.

use dibs_nostd::{Capsule, Closest, Query};
use heapless::Vec;

use crate::border::{AnyBits, Handle, Handles, Input, Open, Out, Output};
use crate::code::dibs_code;
use crate::contacts::dibs_contacts;
use crate::frame::{Table, dibs_frame};
use crate::query::{STACK, dibs_options, dibs_proximity, dibs_query};
use crate::tool::{DIBS_TOOLS, chain, dibs_tool};
use crate::tree::Row;

/// Largest number of surfaces in a scene.
pub const DIBS_SURFACES: usize = 8;

/// A chain of tools whose axes touch each other, and the surfaces around it. A chain and one surface are a scene as
/// well.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_scene {
    /// Addresses of queries, one for each surface, on the surface's tree. No query may be listed twice.
    pub queries: *const *mut dibs_query,
    /// Addresses of the surfaces' frames, in the same order. No frame may be listed twice.
    pub frames: *const *mut dibs_frame,
    /// Number of surfaces: 1 to `DIBS_SURFACES`.
    pub surface_count: u32,
    /// The chain's tools.
    pub tools: *const dibs_tool,
    /// Number of tools: 1 to `DIBS_TOOLS`.
    pub tool_count: u32,
}

// SAFETY: the fields are pointers and numbers.
unsafe impl AnyBits for dibs_scene {}

/// The closest pair of a scene.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_closest {
    /// Index of the surface in the scene.
    pub surface: u32,
    /// Index of the tool in the chain.
    pub tool: u32,
    /// The pair. Its interval starts at the least lower bound of all pairs, its accuracy is the worst, and its tests
    /// are those of all pairs. Its side is `DIBS_SIDE_CUT_SHORT` if the budget ended before the side of any pair was
    /// known.
    pub proximity: dibs_proximity,
}

impl dibs_closest {
    /// A scene has a surface and a tool, so there is a pair.
    fn of(found: Option<Closest>) -> Result<Self, dibs_code> {
        let found = found.ok_or(dibs_code::Argument)?;
        let (surface, tool) = (found.surface as u32, found.tool as u32);
        Ok(Self { surface, tool, proximity: found.proximity.into() })
    }
}

/// The scene's objects, opened for exclusive use by this call.
struct Scene {
    queries: Vec<Open<dibs_query>, DIBS_SURFACES>,
    frames: Vec<Open<dibs_frame>, DIBS_SURFACES>,
    tools: Vec<Capsule, DIBS_TOOLS>,
}

type Surface<'s> = (&'s mut Query<'static, Row, STACK>, &'s Table);

impl Scene {
    fn of(scene: *const dibs_scene) -> Result<Self, dibs_code> {
        let given = scene.get()?;
        Ok(Self {
            tools: chain(given.tools, given.tool_count)?,
            queries: given.queries.open_all(given.surface_count)?,
            frames: given.frames.open_all(given.surface_count)?,
        })
    }

    /// The surfaces with their queries, and the tools.
    fn parts(&mut self) -> Result<(Vec<Surface<'_>, DIBS_SURFACES>, &[Capsule]), dibs_code> {
        let mut surfaces = Vec::new();
        for (query, frame) in self.queries.iter_mut().zip(&self.frames) {
            if let Table::Empty = frame.table {
                return Err(dibs_code::NoSurface);
            }
            surfaces.push((&mut query.0, &frame.table)).map_err(|_| dibs_code::Argument)?;
        }
        Ok((surfaces, &self.tools))
    }
}

/// The closest pair of a chain of tools and the surfaces of a scene.
///
/// Exact within its accuracy, as `dibs_query_closest`. Tools whose axes do not touch each other must be queried one by
/// one: otherwise one deep inside a surface may be missed.
///
/// Cost: at most the budget, for all pairs together, and a node test a pair.
///
/// @param scene    The scene.
/// @param options  Options, or null.
/// @param closest  Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
/// @return As `dibs_query_closest`, for any surface; `DIBS_CODE_ARGUMENT` for no surface, no tool, or too many.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_scene_closest(
    scene: *const dibs_scene,
    options: *const dibs_options,
    closest: *mut dibs_closest,
) -> dibs_code {
    dibs_code::of(|| {
        let (closest, options) = (closest.check()?, dibs_options::of(options)?);
        let mut scene = Scene::of(scene)?;
        let (mut surfaces, tools) = scene.parts()?;
        let found = Query::closest_in_scene(&mut surfaces, tools, &options)?;
        closest.set(dibs_closest::of(found)?);
        Ok(())
    })
}

/// Fills the list with the contacts of all pairs of a tool and a surface, deepest first, and finds the closest pair:
/// `surface` and `tool` of a `dibs_contact` tell the pairs apart.
///
/// Cost: that of `dibs_scene_closest`, and for each pair within the margin that of `dibs_query_contacts`.
///
/// @param scene     The scene.
/// @param margin    In mm, at least 0.
/// @param options   Options, or null. A budget that runs out lowers the list's bound, which holds for all pairs.
/// @param contacts  The list; empty after an error.
/// @param closest   Receives the closest pair, or null.
/// @return As `dibs_scene_closest`, `DIBS_CODE_MARGIN`, or `DIBS_CODE_TREE_NO_ADJACENCY`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_scene_contacts(
    scene: *const dibs_scene,
    margin: f32,
    options: *const dibs_options,
    contacts: *mut dibs_contacts,
    closest: *mut dibs_closest,
) -> dibs_code {
    dibs_code::of(|| {
        let closest = closest.check_if_any()?;
        let found = contacts.open()?.fill(|list| {
            let (mut scene, options) = (Scene::of(scene)?, dibs_options::of(options)?);
            let (mut surfaces, tools) = scene.parts()?;
            let found = Query::contacts_in_scene(&mut surfaces, tools, margin, &options, list)?;
            dibs_closest::of(found)
        })?;
        Out::set_if_any(closest, found);
        Ok(())
    })
}
