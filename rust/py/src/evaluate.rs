//! The five verbs that every quantity has: value, vjp, jvp, vjp_jvp, value_and_vjp.

use crate::array::{Vertices, flat, unwritten};
use crate::bodies::{Grounds, on_batch};
use crate::error::python_error;
use crate::template::Template;
use ipman::Batch;
use ipman::number::Data;
use ipman::quantity::Quantity;
use ipman::registry::{Visitor, named};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

type Reply<'py> = PyResult<Bound<'py, PyAny>>;

/// What to compute, and which upstream arrays (d_out as the values, d_vertices as the vertices) it takes.
#[derive(Clone, Copy, PartialEq)]
enum Verb {
    Value,
    Vjp,
    Jvp,
    VjpJvp,
    ValueAndVjp,
}

impl Verb {
    fn takes(self) -> &'static [&'static str] {
        match self {
            Verb::Value => &[],
            Verb::Vjp | Verb::ValueAndVjp => &["d_out"],
            Verb::Jvp => &["d_vertices"],
            Verb::VjpJvp => &["d_out", "d_vertices"],
        }
    }
}

struct Run<'a, T> {
    batch: &'a Batch<'a, T>,
    verb: Verb,
    /// As many as the verb takes, in its order.
    upstream: Vec<&'a [T]>,
    /// As many as the verb gives, in its order.
    outputs: Vec<&'a mut [T]>,
}

impl<T: Data> Visitor for Run<'_, T> {
    type Output = ipman::Result<()>;

    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        let Run { batch, verb, upstream, mut outputs } = self;
        let mut outputs = outputs.iter_mut();
        let mut next = || outputs.next().expect("as many as the verb gives");
        match verb {
            Verb::Value => batch.value_into(&quantity, next()),
            Verb::Vjp => batch.vjp_into(&quantity, upstream[0], next()),
            Verb::Jvp => batch.jvp_into(&quantity, upstream[0], next()),
            Verb::VjpJvp => batch.vjp_jvp_into(&quantity, upstream[0], upstream[1], next()),
            Verb::ValueAndVjp => batch.value_and_vjp_into(&quantity, upstream[0], next(), next()),
        }
    }
}

struct Size<'a>(&'a Template);

impl Visitor for Size<'_> {
    type Output = usize;
    fn visit<Q: Quantity>(self, quantity: Q) -> usize {
        quantity.num_outputs(&self.0.inner)
    }
}

/// A quantity by its name and options, over bodies on their grounds.
struct Question<'a, 'py> {
    py: Python<'py>,
    template: &'a Template,
    quantity: &'a str,
    options: Vec<f64>,
    grounds: Grounds<'py>,
}

impl<'py> Question<'_, 'py> {
    /// Answers in the precision of the vertices.
    fn answer(&self, verb: Verb, vertices: Vertices<'py>, upstream: &[Bound<'py, PyAny>]) -> Reply<'py> {
        match vertices {
            Vertices::Single(vertices) => self.evaluate(verb, &vertices, upstream),
            Vertices::Double(vertices) => self.evaluate(verb, &vertices, upstream),
        }
    }

    fn evaluate<T: Data + Element>(
        &self,
        verb: Verb,
        vertices: &PyReadonlyArray3<'py, T>,
        upstream: &[Bound<'py, PyAny>],
    ) -> Reply<'py> {
        let shape = vertices.shape();
        let template = &self.template.inner;
        let (quantity, options) = (self.quantity, &self.options);
        let size = named(template, quantity, options, Size(self.template)).map_err(python_error)?;

        let arrays = verb.takes().iter().zip(upstream).map(|(name, array)| same_dtype::<T>(array, name));
        let arrays = arrays.collect::<PyResult<Vec<_>>>()?;
        let mut slices = Vec::new();
        for (name, array) in verb.takes().iter().zip(&arrays) {
            let expected = if *name == "d_out" { shape[0] * size } else { vertices.len() };
            slices.push(checked(flat(array, name)?, name, expected)?);
        }

        let (rows, gradient) = ([shape[0], size], [shape[0], shape[1], 3]);
        // Every verb writes all of its output.
        let outputs: Vec<Bound<'py, PyArrayDyn<T>>> = match verb {
            Verb::Value | Verb::Jvp => vec![unwritten(self.py, &rows)?],
            Verb::Vjp | Verb::VjpJvp => vec![unwritten(self.py, &gradient)?],
            Verb::ValueAndVjp => vec![unwritten(self.py, &rows)?, unwritten(self.py, &gradient)?],
        };
        let mut written: Vec<_> = outputs.iter().map(|array| array.readwrite()).collect();
        let written = written.iter_mut().map(|array| array.as_slice_mut()).collect::<Result<Vec<_>, _>>()?;
        on_batch(self.py, self.template, vertices, &self.grounds, |batch| {
            named(template, quantity, options, Run { batch, verb, upstream: slices, outputs: written })?
        })?;
        Ok(match <[_; 1]>::try_from(outputs) {
            Ok([one]) => one.into_any(),
            Err(both) => PyTuple::new(self.py, both)?.into_any(),
        })
    }
}

/// Upstream arrays must have the vertices' precision.
fn same_dtype<'py, T: Element>(array: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    array.extract().map_err(|_| PyTypeError::new_err(format!("{name}: expected an array of the vertices' dtype")))
}

fn checked<'a, T>(numbers: &'a [T], name: &str, expected: usize) -> PyResult<&'a [T]> {
    if numbers.len() == expected {
        return Ok(numbers);
    }
    Err(PyValueError::new_err(format!("{name}: expected {expected} numbers, got {}", numbers.len())))
}

/// The quantity of each body, (B, K).
#[pyfunction]
pub fn value<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> Reply<'py> {
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    question.answer(Verb::Value, vertices, &[])
}

/// The gradient of Σ d_out · value by the vertices, (B, V, 3); d_out (B, K).
#[pyfunction]
pub fn vjp<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    d_out: Bound<'py, PyAny>,
) -> Reply<'py> {
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    question.answer(Verb::Vjp, vertices, &[d_out])
}

/// The derivative of the value along d_vertices (B, V, 3), (B, K).
#[pyfunction]
pub fn jvp<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    d_vertices: Bound<'py, PyAny>,
) -> Reply<'py> {
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    question.answer(Verb::Jvp, vertices, &[d_vertices])
}

/// The derivative of vjp(d_out) along d_vertices, a Hessian-vector product, (B, V, 3).
#[pyfunction]
pub fn vjp_jvp<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    d_out: Bound<'py, PyAny>,
    d_vertices: Bound<'py, PyAny>,
) -> Reply<'py> {
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    question.answer(Verb::VjpJvp, vertices, &[d_out, d_vertices])
}

/// The value (B, K) and the gradient of Σ d_out · value (B, V, 3), in one pass.
#[pyfunction]
pub fn value_and_vjp<'py>(
    py: Python<'py>,
    template: &Template,
    quantity: &str,
    options: Vec<f64>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
    d_out: Bound<'py, PyAny>,
) -> Reply<'py> {
    let question = Question { py, template, quantity, options, grounds: Grounds::new(normal, height) };
    question.answer(Verb::ValueAndVjp, vertices, &[d_out])
}

/// How many numbers the quantity has for one body.
#[pyfunction]
pub fn output_size(template: &Template, quantity: &str, options: Vec<f64>) -> PyResult<usize> {
    named(&template.inner, quantity, &options, Size(template)).map_err(python_error)
}
