//! The template of a body's surface.

use crate::array::{triples, written};
use crate::error::detached;
use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// Topology, closing and samples of one body surface, computed once.
#[pyclass(frozen, module = "ipman_rs._core")]
pub struct Template {
    pub inner: ipman::Template,
}

#[pymethods]
impl Template {
    /// vertices (V, 3) float64, faces (F, 3) int64, face_parts (F,) int64 or empty for one part.
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
        face_parts: PyReadonlyArray1<'_, i64>,
        num_samples: usize,
        seed: u64,
    ) -> PyResult<Self> {
        let (vertices, faces) = (triples(&vertices, "vertices")?, triples(&faces, "faces")?);
        let parts = face_parts.as_slice()?;
        let inner = detached(py, |_| ipman::Template::new(vertices, faces, parts, num_samples, seed))?;
        Ok(Template { inner })
    }

    #[getter]
    fn num_vertices(&self) -> usize {
        self.inner.mesh.num_vertices
    }

    #[getter]
    fn num_parts(&self) -> usize {
        self.inner.mesh.num_parts
    }

    #[getter]
    fn num_samples(&self) -> usize {
        self.inner.samples.len()
    }

    #[getter]
    fn watertight(&self) -> bool {
        self.inner.mesh.watertight
    }

    /// The face of each sample, (S,), ascending.
    #[getter]
    fn sample_faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        written(py, &[self.num_samples()], self.inner.samples.faces.iter().map(|&face| face.into()))
    }

    /// The part of each sample, (S,).
    #[getter]
    fn sample_parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        written(py, &[self.num_samples()], self.inner.samples.parts.iter().map(|&part| part.into()))
    }

    /// The weights of each sample on its face's vertices, (S, 3).
    #[getter]
    fn sample_barycentric<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        written(py, &[self.num_samples(), 3], self.inner.samples.barycentric.as_flattened().iter().copied())
    }
}
