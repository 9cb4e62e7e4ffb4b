//! The native half of the Python package `dibs`: bytes in, bytes out. `dibs/__init__.py` makes arrays of them, and
//! checks shapes and types before.

// Requirement: P-07

mod bytes;
mod error;
mod guard;
mod mesh;
mod motion;
mod pose;
mod record;
mod scene;
mod sender;
mod surface;
mod tool;
mod tracker;
mod tree;
mod wall;

use pyo3::prelude::*;

/// The module that `dibs/__init__.py` imports.
#[pymodule]
mod _dibs {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::guard::{Answer, Guard};
    #[pymodule_export]
    use crate::mesh::Mesh;
    #[pymodule_export]
    use crate::motion::{MotionStretch, generate, read_motion};
    #[pymodule_export]
    use crate::scene::{contacts, query};
    #[pymodule_export]
    use crate::sender::Sender;
    #[pymodule_export]
    use crate::surface::Surface;
    #[pymodule_export]
    use crate::tracker::{Filter, Tracker, TrackerAnswer, after, stand_off};
    #[pymodule_export]
    use crate::tree::Tree;
    #[pymodule_export]
    use crate::wall::{EnergyAccount, ForbiddenRegion, Proxy};

    use crate::record;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("ANSWER", record::ANSWER)?;
        module.add("CONTACT", record::CONTACT)?;
        module.add("REASONS", record::reasons())?;
        module.add("MOST_CONTACTS", crate::surface::MOST_CONTACTS)
    }
}

/// A sentence of the library, as a `ValueError`.
fn invalid(error: impl std::fmt::Display) -> PyErr {
    error::value(&error.to_string())
}
