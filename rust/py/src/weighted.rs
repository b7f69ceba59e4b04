//! The terms of a training step, reduced: their weighted total, or each of them.

use crate::array::{Vertices, flat, triples, unwritten, written};
use crate::bodies::{Grounds, on_batch};
use crate::error::{detached, python_error};
use crate::template::Template;
use ipman::Batch;
use ipman::error::Error;
use ipman::losses::terms::{NUM_TERMS, Terms};
use ipman::memory;
use ipman::number::Data;
use ipman::quantity::Quantity;
use ipman::reduction::{Pool, Pooled, Reduction, terms_backward as gradient_of_terms};
use ipman::registry::{Visitor, named};
use numpy::{
    Element, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// (totals, terms, shares, gradient): Σ λ·term as one number in an array, or (B,) where nothing is reduced; the unweighted
/// terms (K,) or (B, K); what each body counts for (B,); the gradient of the totals' sum (B, V, 3).
#[pyfunction]
pub fn weighted<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    weights: Vec<f64>,
    valid: Option<PyReadonlyArray1<'py, bool>>,
    reduction: &str,
) -> PyResult<Bound<'py, PyTuple>> {
    let reduction = Reduction::named(reduction).map_err(python_error)?;
    let question =
        Question { py, template, quantity, options, grounds: Grounds::new(normal, height), valid, reduction };
    match vertices {
        Vertices::Single(vertices) => question.answer(&vertices, Some(&weights)),
        Vertices::Double(vertices) => question.answer(&vertices, Some(&weights)),
    }
}

/// (terms, shares, jacobian): the first two as in `weighted`; for each body the gradient of the first term by the
/// vertices, V·3 numbers, then those of pull and of push by the vertices' heights: (B, 5·V).
#[pyfunction]
pub fn terms<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    valid: Option<PyReadonlyArray1<'py, bool>>,
    reduction: &str,
) -> PyResult<Bound<'py, PyTuple>> {
    let reduction = Reduction::named(reduction).map_err(python_error)?;
    let question =
        Question { py, template, quantity, options, grounds: Grounds::new(normal, height), valid, reduction };
    match vertices {
        Vertices::Single(vertices) => question.answer(&vertices, None),
        Vertices::Double(vertices) => question.answer(&vertices, None),
    }
}

/// A backward of `terms`: the gradient (B, V, 3) of terms put together by their upstream d_terms, (K,) or (B, K).
#[pyfunction]
pub fn terms_backward<'py>(
    py: Python<'py>,
    jacobian: Bound<'py, PyAny>,
    shares: Bound<'py, PyAny>,
    d_terms: Bound<'py, PyAny>,
    normal: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    if jacobian.cast::<PyArray2<f32>>().is_ok() {
        return put_together::<f32>(py, jacobian.extract()?, shares.extract()?, d_terms.extract()?, &normal);
    }
    put_together::<f64>(py, jacobian.extract()?, shares.extract()?, d_terms.extract()?, &normal)
}

fn put_together<'py, T: Data + Element>(
    py: Python<'py>,
    jacobian: PyReadonlyArray2<'py, T>,
    shares: PyReadonlyArray1<'py, T>,
    d_terms: PyReadonlyArrayDyn<'py, T>,
    normal: &PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (bodies, vertices) = (jacobian.shape()[0], jacobian.shape()[1] / 5);
    let normals = triples(normal, "normal")?.iter().map(|normal| normal.map(T::of));
    let normals = memory::guarded(|| Ok(memory::collect(normals))).map_err(python_error)?;
    let d_terms = flat(&d_terms, "d_terms")?;
    let one_or_all = |count| count == 1 || count == bodies;
    if shares.len() != bodies || !one_or_all(normals.len()) || ![NUM_TERMS, NUM_TERMS * bodies].contains(&d_terms.len())
    {
        let got = format!("{} shares, {} normals and {} d_terms", shares.len(), normals.len(), d_terms.len());
        return Err(PyValueError::new_err(format!("jacobian: of {bodies} bodies, but there are {got}")));
    }
    let gradient = unwritten::<T>(py, &[bodies, vertices, 3])?;
    let mut filled = gradient.readwrite();
    let (filled, jacobian, shares) = (filled.as_slice_mut()?, jacobian.as_slice()?, shares.as_slice()?);
    detached(py, |interrupted| gradient_of_terms(jacobian, shares, d_terms, &normals, filled, interrupted))?;
    Ok(gradient.into_any())
}

struct Question<'a, 'py> {
    py: Python<'py>,
    template: &'a Template,
    quantity: &'a str,
    options: Vec<f64>,
    grounds: Grounds<'py>,
    valid: Option<PyReadonlyArray1<'py, bool>>,
    reduction: Reduction,
}

impl<'py> Question<'_, 'py> {
    /// The total by the weights, with its gradient; without weights, the terms with their Jacobian.
    fn answer<T: Data + Element>(
        &self,
        vertices: &PyReadonlyArray3<'py, T>,
        weights: Option<&[f64]>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (py, bodies) = (self.py, vertices.shape()[0]);
        let valid = self.valid.as_ref().map(|valid| valid.as_slice()).transpose()?;
        if let Some(valid) = valid.filter(|valid| valid.len() != bodies) {
            let message = format!("valid: expected {bodies} bools, one a body, got {}", valid.len());
            return Err(PyValueError::new_err(message));
        }
        let pool = &Pool { valid, reduction: self.reduction };
        let derivative = match weights {
            Some(_) => unwritten::<T>(py, vertices.shape())?,
            None => unwritten::<T>(py, &[bodies, 5 * vertices.shape()[1]])?,
        };
        let mut filled = derivative.readwrite();
        let filled = filled.as_slice_mut()?;
        let (quantity, options) = (self.quantity, &self.options);
        let (totals, Pooled { terms, shares }) = on_batch(py, self.template, vertices, &self.grounds, |batch| {
            named(&self.template.inner, quantity, options, Run { batch, pool, weights, derivative: filled })?
        })?;
        let array = |shape: &[usize], numbers: Vec<f64>| written(py, shape, numbers.into_iter().map(T::of));
        let batch: &[usize] = if self.reduction == Reduction::None { &[bodies] } else { &[] };
        let terms = array(&[batch, &[weights.map_or(NUM_TERMS, <[f64]>::len)]].concat(), terms)?;
        let shares = array(&[bodies], shares)?;
        match weights {
            Some(_) => (array(batch, totals)?, terms, shares, derivative).into_pyobject(py),
            None => (terms, shares, derivative).into_pyobject(py),
        }
    }
}

struct Run<'a, T> {
    batch: &'a Batch<'a, T>,
    pool: &'a Pool<'a>,
    weights: Option<&'a [f64]>,
    /// The gradient, or the Jacobian.
    derivative: &'a mut [T],
}

impl<T: Data> Visitor for Run<'_, T> {
    type Output = ipman::Result<(Vec<f64>, Pooled)>;

    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        match self.weights {
            Some(weights) => self.pool.weighted(self.batch, &quantity, weights, self.derivative),
            None => {
                let (expected, got) = ("loss terms".into(), "another".into());
                Err(Error::Argument { name: "quantity", expected, got })
            }
        }
    }

    fn visit_terms<Q: Terms>(self, quantity: Q) -> Self::Output {
        match self.weights {
            Some(_) => self.visit(quantity),
            None => Ok((Vec::new(), self.pool.terms(self.batch, &quantity, self.derivative)?)),
        }
    }
}
