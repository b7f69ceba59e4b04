//! The five verbs that every quantity has: value, vjp, jvp, vjp_jvp, value_and_vjp.

use crate::array::{Vertices, flat};
use crate::error::detached;
use crate::template::Template;
use ipman::Batch;
use ipman::number::Scalar;
use ipman::quantity::{Quantity, Visitor, named};
use numpy::{Element, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn};
use numpy::{IntoPyArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// What to compute.
enum Verb<'a, T> {
    Value,
    Vjp(&'a [T]),
    Jvp(&'a [T]),
    VjpJvp(&'a [T], &'a [T]),
    ValueAndVjp(&'a [T]),
}

struct Run<'a, T> {
    batch: Batch<'a, T>,
    verb: Verb<'a, T>,
    size: usize,
}

/// One result, and the gradient where the verb has both.
type Results<T> = (Vec<T>, Vec<T>);

impl<T: Scalar> Run<'_, T> {
    fn check(&self, template: &Template) -> ipman::Result<()> {
        let (out, row) = (self.batch.len() * self.size, self.batch.len() * 3 * template.inner.mesh.num_vertices);
        let check = |name, expected: usize, got: usize| {
            let (expected, got) = (format!("{expected} numbers"), got.to_string());
            if expected == format!("{got} numbers") {
                Ok(())
            } else {
                Err(ipman::Error::Argument { name, expected, got })
            }
        };
        match self.verb {
            Verb::Value => Ok(()),
            Verb::Vjp(d_out) | Verb::ValueAndVjp(d_out) => check("d_out", out, d_out.len()),
            Verb::Jvp(d_vertices) => check("d_vertices", row, d_vertices.len()),
            Verb::VjpJvp(d_out, d_vertices) => {
                check("d_out", out, d_out.len())?;
                check("d_vertices", row, d_vertices.len())
            }
        }
    }
}

impl<T: Scalar> Visitor for Run<'_, T> {
    type Output = ipman::Result<Results<T>>;

    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        let alone = |result| (result, Vec::new());
        match self.verb {
            Verb::Value => self.batch.value(&quantity).map(alone),
            Verb::Vjp(d_out) => self.batch.vjp(&quantity, d_out).map(alone),
            Verb::Jvp(d_vertices) => self.batch.jvp(&quantity, d_vertices).map(alone),
            Verb::VjpJvp(d_out, d_vertices) => self.batch.vjp_jvp(&quantity, d_out, d_vertices).map(alone),
            Verb::ValueAndVjp(d_out) => self.batch.value_and_vjp(&quantity, d_out),
        }
    }
}

struct Size<'a>(&'a Template);

impl Visitor for Size<'_> {
    type Output = usize;
    fn visit<Q: Quantity>(self, quantity: Q) -> usize {
        quantity.len(&self.0.inner)
    }
}

/// Where the bodies stand: the ground's normals (B, 3) and heights (B,).
pub struct Grounds<'py> {
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
}

impl<'py> Grounds<'py> {
    pub fn new(normal: PyReadonlyArray2<'py, f64>, height: PyReadonlyArray1<'py, f64>) -> Self {
        Grounds { normal, height }
    }

    pub fn slices(&self) -> PyResult<(&[f64], &[f64])> {
        Ok((self.normal.as_slice()?, self.height.as_slice()?))
    }
}

/// Checks (B, V, 3) against the template and the grounds; the core only knows flat lengths.
pub fn check_vertices(shape: &[usize], template: &Template, num_grounds: usize) -> PyResult<()> {
    let num_vertices = template.inner.mesh.num_vertices;
    if shape == [num_grounds, num_vertices, 3] {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("vertices: expected ({num_grounds}, {num_vertices}, 3), got {shape:?}")))
}

/// Evaluates in the precision of the vertices; `verb` turns the two upstream arrays into what to compute.
fn evaluate<'py, T: Scalar + Element>(
    py: Python<'py>,
    template: &Template,
    (quantity, options): (&str, &[f64]),
    vertices: &PyReadonlyArray3<'py, T>,
    grounds: &Grounds<'py>,
    verb: Verb<'_, T>,
) -> PyResult<([Bound<'py, PyArray1<T>>; 2], usize)> {
    let (normals, heights) = grounds.slices()?;
    check_vertices(vertices.shape(), template, heights.len())?;
    let vertices = vertices.as_slice()?;
    let (results, size) = detached(py, |interrupted| {
        let size = named(&template.inner, quantity, options, Size(template))?;
        let batch = Batch::new(&template.inner, vertices, normals, heights, interrupted)?;
        let run = Run { batch, verb, size };
        run.check(template)?;
        Ok((named(&template.inner, quantity, options, run)??, size))
    })?;
    Ok(([results.0.into_pyarray(py), results.1.into_pyarray(py)], size))
}

/// Upstream arrays must have the vertices' precision.
fn upstream<'py, T: Element>(array: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    array.extract().map_err(|_| PyTypeError::new_err(format!("{name}: expected an array of the vertices' dtype")))
}

/// Writes one verb as a Python function over both precisions. `$upstream` are its arrays besides the vertices,
/// `$result` picks and shapes what it returns.
macro_rules! verb {
    ($(#[$doc:meta])* $name:ident, $verb:ident, [$($upstream:ident),*], $result:expr) => {
        $(#[$doc])*
        #[pyfunction]
        pub fn $name<'py>(
            py: Python<'py>,
            template: &Template,
            quantity: &str,
            options: Vec<f64>,
            vertices: Vertices<'py>,
            normal: PyReadonlyArray2<'py, f64>,
            height: PyReadonlyArray1<'py, f64>,
            $($upstream: Bound<'py, PyAny>,)*
        ) -> PyResult<Bound<'py, PyAny>> {
            let grounds = Grounds::new(normal, height);
            verb!(@run f32, Single, py, template, quantity, options, vertices, grounds, $verb, [$($upstream),*], $result);
            verb!(@run f64, Double, py, template, quantity, options, vertices, grounds, $verb, [$($upstream),*], $result);
            unreachable!("vertices are single or double")
        }
    };
    (@run $T:ty, $kind:ident, $py:ident, $template:ident, $quantity:ident, $options:ident, $vertices:ident,
     $grounds:ident, $verb:ident, [$($upstream:ident),*], $result:expr) => {
        if let Vertices::$kind(vertices) = &$vertices {
            $(let $upstream = upstream::<$T>(&$upstream, stringify!($upstream))?;)*
            let verb = verb!(@make $verb, $($upstream),*);
            let shape = vertices.shape();
            let ([first, second], size) = evaluate($py, $template, ($quantity, &$options), vertices, &$grounds, verb)?;
            return $result(shape, size, first.into_any(), second.into_any());
        }
    };
    (@make Value,) => { Verb::Value };
    (@make $verb:ident, $($upstream:ident),*) => { Verb::$verb($(flat(&$upstream, stringify!($upstream))?),*) };
}

type Reply<'py> = PyResult<Bound<'py, PyAny>>;

/// (B, K): one row a body.
fn rows<'py>(shape: &[usize], size: usize, values: Bound<'py, PyAny>, _: Bound<'py, PyAny>) -> Reply<'py> {
    values.call_method1("reshape", (shape[0], size))
}

/// (B, V, 3)
fn gradient<'py>(shape: &[usize], _: usize, values: Bound<'py, PyAny>, _: Bound<'py, PyAny>) -> Reply<'py> {
    values.call_method1("reshape", (shape[0], shape[1], shape[2]))
}

/// (B, K) and (B, V, 3)
fn both<'py>(shape: &[usize], size: usize, values: Bound<'py, PyAny>, d_vertices: Bound<'py, PyAny>) -> Reply<'py> {
    let py = values.py();
    let d_vertices = gradient(shape, size, d_vertices, py.None().into_bound(py))?;
    Ok((rows(shape, size, values, py.None().into_bound(py))?, d_vertices).into_pyobject(py)?.into_any())
}

verb!(
    /// The quantity of each body, (B, K).
    value, Value, [], rows
);
verb!(
    /// The gradient of Σ d_out · value by the vertices, (B, V, 3); d_out (B, K).
    vjp, Vjp, [d_out], gradient
);
verb!(
    /// The derivative of the value along d_vertices (B, V, 3), (B, K).
    jvp, Jvp, [d_vertices], rows
);
verb!(
    /// The derivative of vjp(d_out) along d_vertices, a Hessian-vector product, (B, V, 3).
    vjp_jvp, VjpJvp, [d_out, d_vertices], gradient
);
verb!(
    /// The value (B, K) and the gradient of Σ d_out · value (B, V, 3), in one pass.
    value_and_vjp, ValueAndVjp, [d_out], both
);

/// How many numbers the quantity has for one body.
#[pyfunction]
pub fn output_size(template: &Template, quantity: &str, options: Vec<f64>) -> PyResult<usize> {
    let size = named(&template.inner, quantity, &options, Size(template));
    size.map_err(|error| PyValueError::new_err(error.to_string()))
}
