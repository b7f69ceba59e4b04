//! Numpy's bodies on their grounds, as a batch of the core.

use crate::error::detached;
use crate::template::Template;
use ipman::Batch;
use ipman::memory;
use ipman::number::Data;
use numpy::{Element, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Where the bodies stand: the ground's normals (B, 3) and heights (B,), or one of each.
pub struct Grounds<'py> {
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
}

impl<'py> Grounds<'py> {
    pub fn new(normal: PyReadonlyArray2<'py, f64>, height: PyReadonlyArray1<'py, f64>) -> Self {
        Grounds { normal, height }
    }
}

/// Checks the vertices (B, V, 3) against the template and the grounds, for the core only knows flat lengths, and runs
/// `work` on the batch without the GIL.
pub fn on_batch<T: Data + Element, O: Send>(
    py: Python<'_>,
    template: &Template,
    vertices: &PyReadonlyArray3<'_, T>,
    grounds: &Grounds<'_>,
    work: impl FnOnce(&Batch<'_, T>) -> ipman::Result<O> + Send,
) -> PyResult<O> {
    let shape = vertices.shape();
    let (normals, heights) = (grounds.normal.as_slice()?, grounds.height.as_slice()?);
    // One ground may stand for all bodies.
    let copies = if heights.len() == 1 && normals.len() == 3 { shape[0] } else { 1 };
    let (num_bodies, num_vertices) = (copies * heights.len(), template.inner.mesh.num_vertices);
    if shape != [num_bodies, num_vertices, 3] {
        let message = format!("vertices: expected ({num_bodies}, {num_vertices}, 3), got {shape:?}");
        return Err(PyValueError::new_err(message));
    }
    let (vertices, template) = (vertices.as_slice()?, &template.inner);
    detached(py, |interrupted| {
        let repeated = |numbers: &[f64]| memory::collect((0..copies).flat_map(|_| numbers.iter().copied()));
        work(&Batch::new(template, vertices, &repeated(normals), &repeated(heights), interrupted)?)
    })
}
