//! Bodies that touch or penetrate themselves.

use crate::array::{Vertices, triples, unwritten};
use crate::error::{detached, python_error};
use crate::template::Template;
use ipman::collision::{self, contact::SelfContact};
use ipman::number::Data;
use numpy::{Element, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// All that is known of a template's collisions before a pose.
#[pyclass(frozen, module = "ipman_rs._core")]
pub struct Collision {
    inner: collision::Collision,
}

#[pymethods]
impl Collision {
    /// The rest shape (V, 3) of a template; surface within `geodesic` metres of a vertex is not opposite to it.
    #[new]
    fn new(py: Python<'_>, template: &Template, vertices: PyReadonlyArray2<'_, f64>, geodesic: f64) -> PyResult<Self> {
        let vertices = triples(&vertices, "vertices")?;
        let mesh = &template.inner.mesh;
        let inner = detached(py, |interrupted| collision::Collision::new(mesh, vertices, geodesic, interrupted))?;
        Ok(Collision { inner })
    }

    /// The winding number of each body at its vertices: (B, V, 3) -> (B, V).
    fn windings<'py>(&self, py: Python<'py>, vertices: Vertices<'py>) -> PyResult<Bound<'py, PyAny>> {
        match vertices {
            Vertices::Single(vertices) => self.of_vertices(py, &vertices, collision::Collision::windings_into),
            Vertices::Double(vertices) => self.of_vertices(py, &vertices, collision::Collision::windings_into),
        }
    }

    /// How deep each vertex is inside another part of its body, m, 0 outside: (B, V, 3) -> (B, V).
    fn depths<'py>(&self, py: Python<'py>, vertices: Vertices<'py>) -> PyResult<Bound<'py, PyAny>> {
        match vertices {
            Vertices::Single(vertices) => self.of_vertices(py, &vertices, collision::Collision::depths_into),
            Vertices::Double(vertices) => self.of_vertices(py, &vertices, collision::Collision::depths_into),
        }
    }

    /// How far each vertex is from the nearest opposite surface, m, negative inside another part, infinite where none is
    /// less than `near` away: (B, V, 3) -> (B, V).
    fn distances<'py>(&self, py: Python<'py>, vertices: Vertices<'py>, near: f64) -> PyResult<Bound<'py, PyAny>> {
        if !(near >= 0.0 && near.is_finite()) {
            return Err(PyValueError::new_err(format!("near: expected zero metres or more, got {near}")));
        }
        match vertices {
            Vertices::Single(vertices) => self.of_vertices(py, &vertices, |collision, numbers, out, interrupted| {
                collision.distances_into(near, numbers, out, interrupted)
            }),
            Vertices::Double(vertices) => self.of_vertices(py, &vertices, |collision, numbers, out, interrupted| {
                collision.distances_into(near, numbers, out, interrupted)
            }),
        }
    }

    /// push and pull (B, 2), and their gradients (B, 2, V, 3). options: push_width, pull_width, pull_weight, near.
    fn self_contact<'py>(
        &self,
        py: Python<'py>,
        vertices: Vertices<'py>,
        options: [f64; 4],
    ) -> PyResult<Bound<'py, PyTuple>> {
        let contact = SelfContact::new(options).map_err(python_error)?;
        match vertices {
            Vertices::Single(vertices) => self.costs(py, &vertices, &contact),
            Vertices::Double(vertices) => self.costs(py, &vertices, &contact),
        }
    }
}

type Interrupted<'a> = &'a (dyn Fn() -> bool + Sync);

impl Collision {
    fn numbers<'a, T: Element>(&self, vertices: &'a PyReadonlyArray3<'_, T>) -> PyResult<&'a [T]> {
        let (shape, expected) = (vertices.shape(), self.inner.num_vertices());
        match vertices.as_slice() {
            Ok(numbers) if shape[1..] == [expected, 3] => Ok(numbers),
            _ => {
                let message = format!("vertices: expected a C-contiguous (B, {expected}, 3) array, got {shape:?}");
                Err(PyValueError::new_err(message))
            }
        }
    }

    fn of_vertices<'py, T: Data + Element>(
        &self,
        py: Python<'py>,
        vertices: &PyReadonlyArray3<'py, T>,
        into: impl Fn(&collision::Collision, &[T], &mut [T], Interrupted<'_>) -> ipman::Result<()> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let numbers = self.numbers(vertices)?;
        let out = unwritten::<T>(py, &vertices.shape()[..2])?;
        let mut written = out.readwrite();
        let written = written.as_slice_mut()?;
        detached(py, |interrupted| into(&self.inner, numbers, written, interrupted))?;
        Ok(out.into_any())
    }

    fn costs<'py, T: Data + Element>(
        &self,
        py: Python<'py>,
        vertices: &PyReadonlyArray3<'py, T>,
        contact: &SelfContact,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (numbers, shape) = (self.numbers(vertices)?, vertices.shape());
        let out = unwritten::<T>(py, &[shape[0], 2])?;
        let jacobian = unwritten::<T>(py, &[shape[0], 2, shape[1], 3])?;
        let (mut out_written, mut jacobian_written) = (out.readwrite(), jacobian.readwrite());
        let (out_written, jacobian_written) = (out_written.as_slice_mut()?, jacobian_written.as_slice_mut()?);
        detached(py, |interrupted| {
            self.inner.self_contact_into(contact, numbers, out_written, jacobian_written, interrupted)
        })?;
        (out, jacobian).into_pyobject(py)
    }
}
