//! A quantity of a template, with its five verbs: value, vjp, jvp, hvp and value_and_vjp.

use crate::array::{Vertices, flat, unwritten};
use crate::bodies::{Grounds, on_batch};
use crate::error::python_error;
use crate::template::Template;
use crate::weighted::{self, Counted};
use ipman::Batch;
use ipman::batch::Evaluate;
use ipman::losses::terms::Terms;
use ipman::number::Data;
use ipman::quantity;
use ipman::registry::{Visitor, named};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::Arc;

/// A quantity in either precision.
trait InBoth: Evaluate<f32> + Evaluate<f64> {}
impl<Q: Evaluate<f32> + Evaluate<f64>> InBoth for Q {}

/// A quantity of one template. Its name and its options are read and checked here, once.
#[pyclass(frozen, module = "ipman_rs._core")]
pub struct Quantity {
    template: Py<Template>,
    num_outputs: usize,
    quantity: Arc<dyn InBoth>,
    /// The same object, if it is loss terms.
    terms: Option<Arc<Terms>>,
}

/// Makes the object of a quantity.
struct Checked<'a, 'py>(&'a Bound<'py, Template>);

impl Checked<'_, '_> {
    fn handle<Q: quantity::Quantity>(self, quantity: Arc<Q>, terms: Option<Arc<Terms>>) -> ipman::Result<Quantity> {
        let template = &self.0.get().inner;
        quantity.check(template)?;
        let num_outputs = quantity.num_outputs(template);
        Ok(Quantity { template: self.0.clone().unbind(), num_outputs, quantity, terms })
    }
}

impl Visitor for Checked<'_, '_> {
    type Output = ipman::Result<Quantity>;

    fn visit<Q: quantity::Quantity>(self, quantity: Q) -> Self::Output {
        self.handle(Arc::new(quantity), None)
    }

    fn visit_terms(self, terms: Terms) -> Self::Output {
        let terms = Arc::new(terms);
        self.handle(terms.clone(), Some(terms))
    }
}

/// Runs an expression on the bodies of a call, in the precision of their vertices.
macro_rules! in_precision {
    ($self:ident, $vertices:ident, $normal:ident, $height:ident, |$over:ident| $run:expr) => {{
        let grounds = Grounds::new($normal, $height);
        match $vertices {
            Vertices::Single(vertices) => {
                let quantity: &dyn Evaluate<f32> = &*$self.quantity;
                let $over = Over { of: $self, quantity, vertices, grounds };
                $run
            }
            Vertices::Double(vertices) => {
                let quantity: &dyn Evaluate<f64> = &*$self.quantity;
                let $over = Over { of: $self, quantity, vertices, grounds };
                $run
            }
        }
    }};
}

type Normals<'py> = PyReadonlyArray2<'py, f64>;
type Heights<'py> = PyReadonlyArray1<'py, f64>;
type Reply<'py> = PyResult<Bound<'py, PyAny>>;

#[pymethods]
impl Quantity {
    /// A quantity by its name and its options in their order.
    #[new]
    fn new(template: &Bound<'_, Template>, name: &str, options: Vec<f64>) -> PyResult<Self> {
        named(&template.get().inner, name, &options, Checked(template)).flatten().map_err(python_error)
    }

    /// K: how many numbers the quantity has for one body.
    #[getter]
    fn num_outputs(&self) -> usize {
        self.num_outputs
    }

    /// The quantity of each body: vertices (B, V, 3) -> (B, K).
    fn value<'py>(&self, vertices: Vertices<'py>, normal: Normals<'py>, height: Heights<'py>) -> Reply<'py> {
        in_precision!(self, vertices, normal, height, |over| {
            let (values, ()) = over.filled(&over.rows(), |quantity, batch, out| quantity.value_into(batch, out))?;
            Ok(values.into_any())
        })
    }

    /// The gradient of Σ d_out · value by the vertices: d_out (B, K) -> (B, V, 3).
    fn vjp<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        d_out: Bound<'py, PyAny>,
    ) -> Reply<'py> {
        in_precision!(self, vertices, normal, height, |over| {
            let d_out = over.d_out(&d_out)?;
            let d_out = d_out.as_slice()?;
            let (gradient, ()) =
                over.filled(over.vertices.shape(), |quantity, batch, out| quantity.vjp_into(batch, d_out, out))?;
            Ok(gradient.into_any())
        })
    }

    /// The derivative of the value along d_vertices: (B, V, 3) -> (B, K).
    fn jvp<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        d_vertices: Bound<'py, PyAny>,
    ) -> Reply<'py> {
        in_precision!(self, vertices, normal, height, |over| {
            let d_vertices = over.d_vertices(&d_vertices)?;
            let d_vertices = d_vertices.as_slice()?;
            let (slopes, ()) =
                over.filled(&over.rows(), |quantity, batch, out| quantity.jvp_into(batch, d_vertices, out))?;
            Ok(slopes.into_any())
        })
    }

    /// The derivative of vjp(d_out) along d_vertices, a Hessian-vector product: (B, V, 3).
    fn hvp<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        d_out: Bound<'py, PyAny>,
        d_vertices: Bound<'py, PyAny>,
    ) -> Reply<'py> {
        in_precision!(self, vertices, normal, height, |over| {
            let (d_out, d_vertices) = (over.d_out(&d_out)?, over.d_vertices(&d_vertices)?);
            let (d_out, d_vertices) = (d_out.as_slice()?, d_vertices.as_slice()?);
            let (product, ()) = over.filled(over.vertices.shape(), |quantity, batch, out| {
                quantity.hvp_into(batch, d_out, d_vertices, out)
            })?;
            Ok(product.into_any())
        })
    }

    /// The value (B, K) and the gradient of Σ d_out · value (B, V, 3), in one pass.
    fn value_and_vjp<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        d_out: Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        in_precision!(self, vertices, normal, height, |over| {
            let d_out = over.d_out(&d_out)?;
            let d_out = d_out.as_slice()?;
            let values = unwritten(over.py(), &over.rows())?;
            let mut written = values.readwrite();
            let out = written.as_slice_mut()?;
            let (gradient, ()) = over.filled(over.vertices.shape(), |quantity, batch, d_vertices| {
                quantity.value_and_vjp_into(batch, d_out, out, d_vertices)
            })?;
            (values, gradient).into_pyobject(over.py())
        })
    }

    /// (totals, terms, shares, gradient): Σ weight · value, one number or (B,) where the reduction is "none"; the
    /// unweighted values (K,) or (B, K); what each body counts for (B,); the gradient of the totals' sum (B, V, 3).
    fn weighted<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        weights: Vec<f64>,
        valid: Option<PyReadonlyArray1<'py, bool>>,
        reduction: &str,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let counted = Counted::new(valid, reduction)?;
        in_precision!(self, vertices, normal, height, |over| weighted::weighted(&over, &weights, &counted))
    }

    /// (terms, shares, jacobian) of loss terms: the first two as in `weighted`; for each body the gradients of its
    /// numbers one after the other, V·3 numbers by the vertices, or V by their heights: (B, J).
    fn terms<'py>(
        &self,
        vertices: Vertices<'py>,
        normal: Normals<'py>,
        height: Heights<'py>,
        valid: Option<PyReadonlyArray1<'py, bool>>,
        reduction: &str,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let counted = Counted::new(valid, reduction)?;
        let terms = self.loss_terms()?;
        in_precision!(self, vertices, normal, height, |over| weighted::terms(&over, terms, &counted))
    }

    /// The gradient (B, V, 3) of what `terms` gave, for its terms' upstream d_terms, (K,) or (B, K).
    fn terms_backward<'py>(
        &self,
        jacobian: Bound<'py, PyAny>,
        shares: Bound<'py, PyAny>,
        d_terms: Bound<'py, PyAny>,
        normal: Normals<'py>,
    ) -> Reply<'py> {
        let widths = self.loss_terms()?.widths();
        weighted::terms_backward(&widths, jacobian, shares, d_terms, &normal)
    }
}

impl Quantity {
    fn loss_terms(&self) -> PyResult<&Terms> {
        self.terms.as_deref().ok_or_else(|| PyValueError::new_err("quantity: expected loss terms"))
    }
}

/// The bodies of a call, in one precision.
pub struct Over<'a, 'py, T: Element> {
    of: &'a Quantity,
    quantity: &'a dyn Evaluate<T>,
    pub vertices: PyReadonlyArray3<'py, T>,
    grounds: Grounds<'py>,
}

impl<'py, T: Data + Element> Over<'_, 'py, T> {
    pub fn py(&self) -> Python<'py> {
        self.vertices.py()
    }

    pub fn template(&self) -> &ipman::Template {
        &self.of.template.get().inner
    }

    /// The shape of the values.
    fn rows(&self) -> [usize; 2] {
        [self.vertices.shape()[0], self.of.num_outputs]
    }

    /// A new array of this shape, all of which `write` writes without the GIL, and what it returns.
    pub fn filled<O: Send>(
        &self,
        shape: &[usize],
        write: impl FnOnce(&dyn Evaluate<T>, &Batch<'_, T>, &mut [T]) -> ipman::Result<O> + Send,
    ) -> PyResult<(Bound<'py, PyArrayDyn<T>>, O)> {
        let array = unwritten::<T>(self.py(), shape)?;
        let mut written = array.readwrite();
        let (quantity, out) = (self.quantity, written.as_slice_mut()?);
        let output = on_batch(self.py(), self.of.template.get(), &self.vertices, &self.grounds, |batch| {
            write(quantity, batch, out)
        })?;
        drop(written);
        Ok((array, output))
    }

    fn d_out(&self, array: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
        upstream("d_out", array, self.rows().iter().product())
    }

    fn d_vertices(&self, array: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
        upstream("d_vertices", array, self.vertices.len())
    }
}

/// An array of the vertices' precision with so many numbers, in C order.
fn upstream<'py, T: Element>(
    name: &str,
    array: &Bound<'py, PyAny>,
    expected: usize,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let wrong_dtype = |_| PyTypeError::new_err(format!("{name}: expected an array of the vertices' dtype"));
    let array: PyReadonlyArrayDyn<'py, T> = array.extract().map_err(wrong_dtype)?;
    let got = flat(&array, name)?.len();
    if got == expected {
        return Ok(array);
    }
    Err(PyValueError::new_err(format!("{name}: expected {expected} numbers, got {got}")))
}
