//! Checked views of numpy arrays, and new ones. The Python layer converts what numpy users pass; here only exact types
//! arrive.

use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn};
use numpy::{PyUntypedArrayMethods, dtype};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

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

/// An array whose numbers are there but mean nothing yet, made by numpy itself: where memory lacks it raises MemoryError,
/// and the crate's own constructors panic.
pub fn unwritten<'py, T: Element>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let empty = EMPTY.import(py, "numpy", "empty")?;
    Ok(empty.call1((shape.to_vec(), dtype::<T>(py)))?.cast_into()?)
}

/// An array of these numbers, as many as its shape has.
pub fn written<'py, T: Element>(
    py: Python<'py>,
    shape: &[usize],
    numbers: impl IntoIterator<Item = T>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = unwritten(py, shape)?;
    for (own, number) in array.readwrite().as_slice_mut()?.iter_mut().zip(numbers) {
        *own = number;
    }
    Ok(array)
}
