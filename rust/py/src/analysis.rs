//! All figures of bodies at one look.

use crate::array::{Vertices, unwritten, written};
use crate::bodies::{Grounds, on_batch};
use crate::error::python_error;
use crate::template::Template;
use ipman::analysis::{Analysis, Polygon};
use ipman::number::Data;
use numpy::PyUntypedArrayMethods;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

type Figures<'py> = (Bound<'py, PyAny>, Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<i64>>);

/// Rows of figures (B, K) in the vertices' precision, the corners (N, 3) of all bases of support, and how many each has.
#[pyfunction]
pub fn analysis<'py>(
    py: Python<'py>,
    template: &Template,
    method: &str,
    contact_rule: &str,
    options: Vec<f64>,
    densities: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Figures<'py>> {
    let analysis = Analysis::new(method, contact_rule, &options, &densities).map_err(python_error)?;
    let grounds = Grounds::new(normal, height);
    match vertices {
        Vertices::Single(vertices) => run(py, template, &analysis, &vertices, &grounds),
        Vertices::Double(vertices) => run(py, template, &analysis, &vertices, &grounds),
    }
}

fn run<'py, T: Data + Element>(
    py: Python<'py>,
    template: &Template,
    analysis: &Analysis,
    vertices: &PyReadonlyArray3<'py, T>,
    grounds: &Grounds<'py>,
) -> PyResult<Figures<'py>> {
    let rows = unwritten::<T>(py, &[vertices.shape()[0], analysis.size(&template.inner)])?;
    let mut filled = rows.readwrite();
    let out = filled.as_slice_mut()?;
    let polygons = on_batch(py, template, vertices, grounds, |batch| batch.analysis_into(analysis, out))?;
    drop(filled);
    let (corners, counts) = polygon_arrays(py, polygons.iter())?;
    Ok((rows.into_any(), corners, counts))
}

pub type PolygonArrays<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<i64>>);

/// The corners (N, 3) of all polygons one after the other, and how many each has.
pub fn polygon_arrays<'a, 'py>(
    py: Python<'py>,
    polygons: impl ExactSizeIterator<Item = &'a Polygon> + Clone,
) -> PyResult<PolygonArrays<'py>> {
    let count = polygons.clone().map(Vec::len).sum();
    let corners = written(py, &[count, 3], polygons.clone().flatten().flatten().copied())?;
    Ok((corners, written(py, &[polygons.len()], polygons.map(|polygon| polygon.len() as i64))?))
}
