//! The library's errors as Python's exceptions.

use dibs_build::{BuildError, ReadError, ReadErrorKind};
use dibs_stream::SendError;
use dibs_stream::transport::TargetError;
use pyo3::PyErr;
use pyo3::exceptions::{PyConnectionError, PyFileNotFoundError, PyOSError, PyValueError};
use std::fmt::Display;
use std::io::ErrorKind;

/// Options of the command line that its sentences advise, and their names here.
const OPTIONS: [(&str, &str); 8] = [
    ("`dibs build --orient` turns them", "orient=True turns them"),
    ("without --strict", "with strict=False"),
    ("--largest-component", "largest_component=True"),
    ("--weld 0", "weld=0"),
    ("--unit m", "unit='m'"),
    ("--unit um", "unit='um'"),
    ("--stretch", "stretch"),
    ("--limits", "limits"),
];

/// A sentence of the library with the names that things have here.
pub fn sentence(of_library: impl Display) -> String {
    let mut sentence = of_library.to_string();
    for (option, here) in OPTIONS {
        sentence = sentence.replace(option, here);
    }
    sentence
}

/// A `ValueError`.
pub fn value(sentence: &str) -> PyErr {
    PyValueError::new_err(self::sentence(sentence))
}

/// A file that cannot be read is an `OSError`; one that is wrong is a `ValueError`.
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

/// A line that does not open is an `OSError`.
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
