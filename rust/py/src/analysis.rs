//! All figures of bodies at one look.

use crate::array::Vertices;
use crate::bodies::{Grounds, on_batch};
use crate::error::value_error;
use crate::evaluate::unwritten;
use crate::template::Template;
use ipman::analysis::Analysis;
use ipman::number::Data;
use numpy::{Element, IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

type Figures<'py> = (Bound<'py, PyAny>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>);

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
    let analysis = Analysis::new(method, contact_rule, &options, &densities).map_err(value_error)?;
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
    let rows = unwritten::<T>(py, &[vertices.shape()[0], analysis.size(&template.inner)]);
    let mut written = rows.readwrite();
    let out = written.as_slice_mut()?;
    let polygons = on_batch(py, template, vertices, grounds, |batch| batch.analysis_into(analysis, out))?;
    drop(written);
    let counts: Vec<i64> = polygons.iter().map(|polygon| polygon.len() as i64).collect();
    let corners: Vec<f64> = polygons.concat().into_flattened();
    let count = corners.len() / 3;
    Ok((rows.into_any(), corners.into_pyarray(py).reshape([count, 3])?, counts.into_pyarray(py)))
}
