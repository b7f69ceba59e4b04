//! The weighted total of a training step.

use crate::array::Vertices;
use crate::bodies::{Grounds, on_batch};
use crate::error::value_error;
use crate::evaluate::{output_size, unwritten};
use crate::template::Template;
use ipman::Batch;
use ipman::number::Data;
use ipman::quantity::{Quantity, Visitor, named};
use ipman::weighted::{Reduction, Totals, Weighted};
use numpy::{
    Element, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods, ToPyArray,
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
    let reduction = Reduction::named(reduction).map_err(value_error)?;
    let valid = valid.as_ref().map(|valid| valid.as_slice()).transpose()?;
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    let weighted = Weighted { weights: &weights, valid, reduction };
    match vertices {
        Vertices::Single(vertices) => question.answer(&vertices, &weighted),
        Vertices::Double(vertices) => question.answer(&vertices, &weighted),
    }
}

/// (terms, shares) of `weighted`, without a gradient.
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
    let reduction = Reduction::named(reduction).map_err(value_error)?;
    let valid = valid.as_ref().map(|valid| valid.as_slice()).transpose()?;
    let size = output_size(template, quantity, options.clone())?;
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    let weighted = Weighted { weights: &vec![0.0; size], valid, reduction };
    match vertices {
        Vertices::Single(vertices) => question.answer_alone(&vertices, &weighted),
        Vertices::Double(vertices) => question.answer_alone(&vertices, &weighted),
    }
}

struct Question<'a, 'py> {
    py: Python<'py>,
    template: &'a Template,
    quantity: &'a str,
    options: Vec<f64>,
    grounds: Grounds<'py>,
}

impl<'py> Question<'_, 'py> {
    fn answer<T: Data + Element>(
        &self,
        vertices: &PyReadonlyArray3<'py, T>,
        weighted: &Weighted<'_>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (py, template, bodies) = (self.py, &self.template.inner, vertices.shape()[0]);
        check_valid(weighted, bodies)?;
        let gradient = unwritten::<T>(py, vertices.shape());
        let mut written = gradient.readwrite();
        let written = written.as_slice_mut()?;
        let (quantity, options) = (self.quantity, &self.options);
        let Totals { totals, terms, shares } = on_batch(py, self.template, vertices, &self.grounds, |batch| {
            named(template, quantity, options, Run { batch, weighted, gradient: Some(written) })?
        })?;
        let (totals, terms, shares) = (totals.to_pyarray(py), terms.to_pyarray(py), shares.to_pyarray(py));
        if weighted.reduction == Reduction::None {
            let terms = terms.reshape([bodies, weighted.weights.len()])?;
            return (totals, terms, shares, gradient).into_pyobject(py);
        }
        (totals.reshape(())?, terms, shares, gradient).into_pyobject(py)
    }

    fn answer_alone<T: Data + Element>(
        &self,
        vertices: &PyReadonlyArray3<'py, T>,
        weighted: &Weighted<'_>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (py, template, bodies) = (self.py, &self.template.inner, vertices.shape()[0]);
        check_valid(weighted, bodies)?;
        let (quantity, options) = (self.quantity, &self.options);
        let Totals { terms, shares, .. } = on_batch(py, self.template, vertices, &self.grounds, |batch| {
            named(template, quantity, options, Run { batch, weighted, gradient: None })?
        })?;
        let (terms, shares) = (terms.to_pyarray(py), shares.to_pyarray(py));
        if weighted.reduction == Reduction::None {
            return (terms.reshape([bodies, weighted.weights.len()])?, shares).into_pyobject(py);
        }
        (terms, shares).into_pyobject(py)
    }
}

fn check_valid(weighted: &Weighted<'_>, bodies: usize) -> PyResult<()> {
    match weighted.valid {
        Some(valid) if valid.len() != bodies => {
            Err(PyValueError::new_err(format!("valid: expected {bodies} bools, one a body, got {}", valid.len())))
        }
        _ => Ok(()),
    }
}

struct Run<'a, T> {
    batch: &'a Batch<'a, T>,
    weighted: &'a Weighted<'a>,
    /// None: not asked for.
    gradient: Option<&'a mut [T]>,
}

impl<T: Data> Visitor for Run<'_, T> {
    type Output = ipman::Result<Totals<T>>;

    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        match self.gradient {
            Some(gradient) => self.weighted.evaluate(self.batch, &quantity, gradient),
            None => self.weighted.evaluate_alone(self.batch, &quantity),
        }
    }
}
