//! The session as the page's JavaScript sees it. Numbers are f64, which holds every f32.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Contact, Coverage, Side};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsError, throw_str};

use crate::{Interpolation, Search, Session};

/// A page's session.
#[wasm_bindgen(js_name = Session)]
pub struct Page {
    session: Box<dyn Session>,
}

#[wasm_bindgen(js_class = Session)]
impl Page {
    /// A session on a tree's bytes and a packed motion, which may be empty.
    ///
    /// # Errors
    /// One sentence with the remedy.
    #[wasm_bindgen(constructor)]
    pub fn new(tree: Vec<u8>, motion: &[u8], rate: f64) -> Result<Page, JsError> {
        Ok(Self { session: crate::open(tree, motion, rate)? })
    }

    /// Sets the largest admitted stretch, the margin (mm), the budget (tests), and the numbers of the choices.
    pub fn set(&mut self, limit: f32, margin: f32, budget: u32, choices: &[u8]) {
        let &[between, search, measured] = choices else { throw_str("three choices") };
        let settings = self.session.settings();
        (settings.limit, settings.margin, settings.budget) = (limit, margin, budget);
        settings.between = match between {
            0 => Interpolation::Held,
            1 => Interpolation::Interpolated,
            _ => Interpolation::Extrapolated,
        };
        settings.search = match search {
            0 => Search::Tracker,
            1 => Search::Warm,
            _ => Search::Cold,
        };
        settings.is_measured = measured != 0;
    }

    /// Ticks from one pose and time to another. Returns ticks, node tests, triangle tests and fallbacks.
    ///
    /// # Errors
    /// An instrument that is none, or a query without an answer.
    pub fn advance(
        &mut self,
        from: &[f32],
        to: &[f32],
        start: f64,
        end: f64,
        ticks: u32,
    ) -> Result<Vec<u32>, JsError> {
        let counts = self.session.advance(from, to, [start, end], ticks)?;
        Ok(vec![counts.ticks, counts.node_tests, counts.triangle_tests, counts.fallbacks])
    }

    /// Back to the first frame, as if nothing had been asked.
    pub fn restart(&mut self) {
        self.session.restart();
    }

    /// The last answer, in this order: separation, lower, accuracy, the interval's ends, coverage (1 proven, 0
    /// measured: every frame was), side (0 outside, 1 inside, 2 crossing, 3 undefined, 4 either),
    /// axis distance, point on surface, point on tool, direction, axis parameter, triangle, barycentric, stretch, node
    /// tests, triangle tests.
    #[must_use]
    pub fn answer(&self) -> Vec<f64> {
        let Some(found) = self.session.answer() else { return Vec::new() };
        let mut numbers: Vec<f64> =
            [found.separation, found.lower, found.accuracy].map(f64::from).to_vec();
        let interval = found.interval();
        numbers.extend([interval.lower, interval.upper].map(f64::from));
        numbers.push(f64::from(u8::from(found.coverage == Coverage::Proven)));
        numbers.push(match found.side {
            Side::Outside => 0.0,
            Side::Inside => 1.0,
            Side::Crossing => 2.0,
            Side::Either => 4.0,
            _ => 3.0,
        });
        numbers.push(found.axis_distance.into());
        let origin = self.session.origin();
        numbers.extend(point(found.point_on_surface, origin));
        numbers.extend(point(found.point_on_tool, origin));
        numbers.extend(found.direction.to_array().map(f64::from));
        numbers.push(found.axis_parameter.into());
        numbers.extend(self.session.corner_numbers(found.corners).map(f64::from));
        numbers.extend(found.barycentric.map(f64::from));
        numbers.push(self.session.stretch().into());
        numbers.extend([found.node_tests, found.triangle_tests].map(f64::from));
        numbers
    }

    /// The reason for an undefined side, or nothing.
    #[must_use]
    pub fn side_reason(&self) -> String {
        match self.session.answer().map(|found| found.side) {
            Some(Side::Undefined(reason)) => reason.to_string(),
            _ => String::new(),
        }
    }

    /// The force, whether it is saturated, whether the wall only damps, the bound on contacts; then of each contact
    /// separation, point on surface, point on tool, normal, and the surface's velocity there (mm/s). Points are in the tree's coordinates.
    ///
    /// # Errors
    /// A query without an answer.
    pub fn touching(&mut self) -> Result<Vec<f64>, JsError> {
        let touching = self.session.touching()?;
        let mut numbers: Vec<f64> = touching.force.to_array().map(f64::from).to_vec();
        numbers.extend(
            [touching.is_saturated, touching.is_safe].map(|flag| f64::from(u8::from(flag))),
        );
        numbers.push(touching.bound.into());
        for contact in &touching.contacts {
            let Contact { point_on_surface, point_on_tool, normal, velocity, .. } = *contact;
            numbers.push(contact.separation.into());
            for vector in [point_on_surface, point_on_tool, normal, velocity] {
                numbers.extend(vector.to_array().map(f64::from));
            }
        }
        Ok(numbers)
    }

    /// The tree's stretch limit.
    #[must_use]
    pub fn limit(&self) -> f32 {
        self.session.limit()
    }

    /// The stretch of the refused frame for which the surface is held, or 0.
    #[must_use]
    pub fn refused(&self) -> f32 {
        self.session.refused().unwrap_or(0.0)
    }

    /// Levels of the tree.
    #[must_use]
    pub fn levels(&self) -> u32 {
        self.session.levels()
    }

    /// Frames of the motion.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.session.frames() as u32
    }

    /// The point that the tree's coordinates count from.
    #[must_use]
    pub fn origin(&self) -> Vec<f64> {
        self.session.origin().to_vec()
    }

    /// Corners of all triangles.
    #[must_use]
    pub fn triangles(&self) -> Vec<u32> {
        self.session.triangles()
    }

    /// Positions of the surface as it is now.
    #[must_use]
    pub fn positions(&self) -> Vec<f32> {
        self.session.positions()
    }

    /// Positions of the nodes that move the surface, as they are now.
    #[must_use]
    pub fn nodes(&self) -> Vec<f32> {
        self.session.nodes()
    }

    /// Spheres of a level.
    #[must_use]
    pub fn level(&self, level: u32) -> Vec<f32> {
        self.session.level(level)
    }

    /// Spheres that a whole query tests.
    ///
    /// # Errors
    /// A query without an answer.
    pub fn tested(&mut self) -> Result<Vec<f32>, JsError> {
        Ok(self.session.tested()?)
    }

    /// Spheres of the tracker's front.
    #[must_use]
    pub fn front(&self) -> Vec<f32> {
        self.session.front()
    }
}

/// A point in the coordinates of the mesh's file, as `dibs query` prints it.
fn point(point: Vec3, origin: [f64; 3]) -> [f64; 3] {
    let local = point.to_array().map(f64::from);
    // A sum with zero would lose the sign of -0.
    if origin == [0.0; 3] { local } else { std::array::from_fn(|axis| origin[axis] + local[axis]) }
}
