//! Checked views of numpy arrays. The Python layer converts what numpy users pass; here only exact types arrive.

use numpy::{Element, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An array of one of the two precisions.
#[derive(FromPyObject)]
pub enum Vertices<'py> {
    Single(PyReadonlyArray3<'py, f32>),
    Double(PyReadonlyArray3<'py, f64>),
}

/// The array's numbers, in C order.
pub fn flat<'a, T: Element>(array: &'a PyReadonlyArrayDyn<'_, T>, name: &str) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| PyValueError::new_err(format!("{name}: expected a C-contiguous array")))
}

/// The rows of an (n, 3) array.
pub fn triples<'a, T: Element>(array: &'a PyReadonlyArray2<'_, T>, name: &str) -> PyResult<&'a [[T; 3]]> {
    let shape = array.shape();
    let numbers = array.as_slice().ok().filter(|_| shape[1] == 3);
    let Some(numbers) = numbers else {
        return Err(PyValueError::new_err(format!("{name}: expected a C-contiguous (n, 3) array, got {shape:?}")));
    };
    Ok(numbers.as_chunks().0)
}
