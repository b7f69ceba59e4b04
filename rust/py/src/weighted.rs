//! The terms of a training step, reduced: their weighted total, or each of them.

use crate::array::{flat, triples, unwritten, written};
use crate::error::{detached, python_error};
use crate::quantity::Over;
use ipman::losses::terms::Terms;
use ipman::memory;
use ipman::number::Data;
use ipman::reduction::{self, Pool, Pooled, Reduction};
use numpy::{
    Element, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Which bodies count, and how they are put together.
pub struct Counted<'py> {
    valid: Option<PyReadonlyArray1<'py, bool>>,
    reduction: Reduction,
}

impl<'py> Counted<'py> {
    pub fn new(valid: Option<PyReadonlyArray1<'py, bool>>, reduction: &str) -> PyResult<Self> {
        Ok(Counted { valid, reduction: Reduction::named(reduction).map_err(python_error)? })
    }

    fn pool(&self, bodies: usize) -> PyResult<Pool<'_>> {
        let valid = self.valid.as_ref().map(|valid| valid.as_slice()).transpose()?;
        if let Some(valid) = valid.filter(|valid| valid.len() != bodies) {
            let message = format!("valid: expected {bodies} bools, one a body, got {}", valid.len());
            return Err(PyValueError::new_err(message));
        }
        Ok(Pool { valid, reduction: self.reduction })
    }

    /// The batch's dimension, which a reduction removes.
    fn batch(&self, bodies: usize) -> Vec<usize> {
        if self.reduction == Reduction::None { vec![bodies] } else { vec![] }
    }
}

/// (totals, terms, shares, gradient) of `Quantity.weighted`.
pub fn weighted<'py, T: Data + Element>(
    over: &Over<'_, 'py, T>,
    weights: &[f64],
    counted: &Counted<'py>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (py, bodies) = (over.py(), over.vertices.shape()[0]);
    let pool = &counted.pool(bodies)?;
    let shape = over.vertices.shape();
    let (gradient, (totals, pooled)) =
        over.filled(shape, |quantity, batch, gradient| pool.weighted(batch, quantity, weights, gradient))?;
    let batch = counted.batch(bodies);
    let terms = rounded::<T>(py, &[&batch[..], &[weights.len()]].concat(), pooled.terms)?;
    let shares = rounded::<T>(py, &[bodies], pooled.shares)?;
    (rounded::<T>(py, &batch, totals)?, terms, shares, gradient).into_pyobject(py)
}

/// (terms, shares, jacobian) of `Quantity.terms`.
pub fn terms<'py, T: Data + Element>(
    over: &Over<'_, 'py, T>,
    terms: &Terms,
    counted: &Counted<'py>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (py, bodies) = (over.py(), over.vertices.shape()[0]);
    let pool = &counted.pool(bodies)?;
    let (jacobian, pooled) = over.filled(&[bodies, terms.jacobian_row(over.template())], |_, batch, jacobian| {
        pool.terms(batch, terms, jacobian)
    })?;
    let Pooled { terms: values, shares } = pooled;
    let terms = rounded::<T>(py, &[&counted.batch(bodies)[..], &[terms.widths().len()]].concat(), values)?;
    (terms, rounded::<T>(py, &[bodies], shares)?, jacobian).into_pyobject(py)
}

/// Numbers in the precision of the vertices.
fn rounded<'py, T: Data + Element>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    written(py, shape, numbers.into_iter().map(T::of))
}

/// The backward of `Quantity.terms`.
pub fn terms_backward<'py>(
    widths: &[usize],
    jacobian: Bound<'py, PyAny>,
    shares: Bound<'py, PyAny>,
    d_terms: Bound<'py, PyAny>,
    normal: &PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    if jacobian.cast::<PyArray2<f32>>().is_ok() {
        return gradient::<f32>(widths, jacobian.extract()?, shares.extract()?, d_terms.extract()?, normal);
    }
    gradient::<f64>(widths, jacobian.extract()?, shares.extract()?, d_terms.extract()?, normal)
}

fn gradient<'py, T: Data + Element>(
    widths: &[usize],
    jacobian: PyReadonlyArray2<'py, T>,
    shares: PyReadonlyArray1<'py, T>,
    d_terms: PyReadonlyArrayDyn<'py, T>,
    normal: &PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = jacobian.py();
    let (bodies, count) = (jacobian.shape()[0], widths.len());
    let vertices = jacobian.shape()[1] / widths.iter().sum::<usize>();
    let normals = triples(normal, "normal")?.iter().map(|normal| normal.map(T::of));
    let normals = memory::guarded(|| Ok(memory::collect(normals))).map_err(python_error)?;
    let d_terms = flat(&d_terms, "d_terms")?;
    let one_or_all = |count| count == 1 || count == bodies;
    if shares.len() != bodies || !one_or_all(normals.len()) || ![count, count * bodies].contains(&d_terms.len()) {
        let got = format!("{} shares, {} normals and {} d_terms", shares.len(), normals.len(), d_terms.len());
        return Err(PyValueError::new_err(format!("jacobian: of {bodies} bodies, but there are {got}")));
    }
    let gradient = unwritten::<T>(py, &[bodies, vertices, 3])?;
    let mut filled = gradient.readwrite();
    let (filled, jacobian, shares) = (filled.as_slice_mut()?, jacobian.as_slice()?, shares.as_slice()?);
    detached(py, |interrupted| {
        reduction::terms_backward(widths, jacobian, shares, d_terms, &normals, filled, interrupted)
    })?;
    Ok(gradient.into_any())
}
