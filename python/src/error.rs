//! The one exception of the package: palpate's own sentence.

use pyo3::exceptions::PyException;
use pyo3::prelude::*;

pyo3::create_exception!(
    palpate,
    PalpateError,
    PyException,
    "Something that palpate cannot do; the text says what is wrong and what to do."
);

/// An error of palpate in Python.
pub fn refused(sentence: impl ToString) -> PyErr {
    PalpateError::new_err(sentence.to_string())
}
