//! The template of a body's surface.

use crate::array::triples;
use crate::error::detached;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
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
    fn sample_faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.samples.faces.iter().map(|&face| face as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The part of each sample, (S,).
    #[getter]
    fn sample_parts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.samples.parts.iter().map(|&part| part as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The weights of each sample on its face's vertices, (S, 3).
    #[getter]
    fn sample_barycentric<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        PyArray2::from_vec2(py, &self.inner.samples.barycentric.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
            .expect("every row has three weights")
    }
}
