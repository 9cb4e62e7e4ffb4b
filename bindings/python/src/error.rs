//! The library's errors as Python's exceptions.

use dibs_build::{BuildError, ReadError, ReadErrorKind};
use dibs_stream::SendError;
use dibs_stream::transport::TargetError;
use pyo3::PyErr;
use pyo3::exceptions::{PyConnectionError, PyFileNotFoundError, PyOSError, PyValueError};
use std::fmt::Display;
use std::io::ErrorKind;

/// Advice for the command line in the library's errors, and the same for Python.
const ADVICE: [(&str, &str); 15] = [
    ("`dibs build --orient` turns them", "orient=True turns them"),
    ("with --orient", "with orient=True"),
    ("--orient, unless", "orient=True, unless"),
    ("without --strict", "with strict=False"),
    ("--largest-component", "largest_component=True"),
    ("--weld 0", "weld=0"),
    ("--unit mm", "unit='mm'"),
    ("--unit cm", "unit='cm'"),
    ("--unit in", "unit='in'"),
    ("--unit um", "unit='um'"),
    ("--unit m", "unit='m'"),
    ("(--unit states", "(unit states"),
    ("(--unit)", "(unit)"),
    ("(--bind-within)", "(bind_within)"),
    (
        "`dibs stretch MESH --motion MOTION --limits FILE` writes one",
        "`MotionStretch.limits` makes one",
    ),
];

/// A sentence of the library with Python's names of the options.
pub fn sentence(of_library: impl Display) -> String {
    let mut sentence = of_library.to_string();
    for (there, here) in ADVICE {
        sentence = sentence.replace(there, here);
    }
    sentence
}

/// A `ValueError`.
pub fn value(sentence: &str) -> PyErr {
    PyValueError::new_err(self::sentence(sentence))
}

/// A file that cannot be read is an `OSError`; a file with wrong content is a `ValueError`.
pub fn read(error: &ReadError) -> PyErr {
    let text = error.to_string();
    match &error.kind {
        ReadErrorKind::Io(error) if error.kind() == ErrorKind::NotFound => {
            PyFileNotFoundError::new_err(text)
        }
        ReadErrorKind::Io(_) => PyOSError::new_err(text),
        _ => value(&text),
    }
}

/// A file that cannot be written is an `OSError`.
pub fn build(error: &BuildError) -> PyErr {
    match error {
        BuildError::Write(_) => PyOSError::new_err(error.to_string()),
        _ => value(&error.to_string()),
    }
}

/// A line that cannot be opened is an `OSError`.
pub fn target(error: &TargetError) -> PyErr {
    match error {
        TargetError::Open { .. } => PyOSError::new_err(error.to_string()),
        _ => value(&error.to_string()),
    }
}

/// A line that breaks is a `ConnectionError`.
pub fn send(error: &SendError) -> PyErr {
    match error {
        SendError::Line(_) | SendError::Superseded { .. } | SendError::NoChallenge => {
            PyConnectionError::new_err(error.to_string())
        }
        _ => value(&error.to_string()),
    }
}
