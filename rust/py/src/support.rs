//! What is known of a body's base of support and its state: results without a gradient.

use crate::analysis::polygon_arrays;
use crate::array::{Vertices, written};
use crate::bodies::{Grounds, on_batch};
use crate::error::python_error;
use crate::template::Template;
use ipman::Batch;
use ipman::mass::Method;
use ipman::support::{Contact, ContactRule};
use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// The bodies and the rule of contact, in the words of Python.
struct Question<'a, 'py> {
    py: Python<'py>,
    template: &'a Template,
    grounds: Grounds<'py>,
}

impl Question<'_, '_> {
    fn ask<O: Send>(
        &self,
        vertices: Vertices<'_>,
        single: impl FnOnce(&Batch<'_, f32>) -> ipman::Result<O> + Send,
        double: impl FnOnce(&Batch<'_, f64>) -> ipman::Result<O> + Send,
    ) -> PyResult<O> {
        match vertices {
            Vertices::Single(vertices) => on_batch(self.py, self.template, &vertices, &self.grounds, single),
            Vertices::Double(vertices) => on_batch(self.py, self.template, &vertices, &self.grounds, double),
        }
    }
}

fn contact(rule: &str, threshold: f64) -> PyResult<Contact> {
    Ok(Contact { rule: ContactRule::named(rule).map_err(python_error)?, threshold })
}

fn method(name: &str) -> PyResult<Method> {
    Method::named(name).map_err(python_error)
}

type Numbers<'py, T> = Bound<'py, PyArrayDyn<T>>;
type Supports<'py> = (Numbers<'py, f64>, Numbers<'py, i64>, Numbers<'py, f64>, Numbers<'py, f64>, Numbers<'py, i64>);

/// The corners (N, 3) of all polygons, and how many each has (B,); areas, margins and numbers of contacts, (B,) each.
#[pyfunction]
pub fn base_of_support<'py>(
    py: Python<'py>,
    template: &Template,
    contact_rule: &str,
    method_name: &str,
    threshold: f64,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Supports<'py>> {
    let (contact, method) = (contact(contact_rule, threshold)?, method(method_name)?);
    let question = Question { py, template, grounds: Grounds::new(normal, height) };
    let supports = question.ask(
        vertices,
        |batch| batch.base_of_support(&contact, method),
        |batch| batch.base_of_support(&contact, method),
    )?;
    let bodies = [supports.len()];
    let areas = written(py, &bodies, supports.iter().map(|support| support.area))?;
    let margins = written(py, &bodies, supports.iter().map(|support| support.margin))?;
    let contacts = written(py, &bodies, supports.iter().map(|support| support.num_contacts as i64))?;
    let (corners, counts) = polygon_arrays(py, supports.iter().map(|support| &support.polygon))?;
    Ok((corners, counts, areas, margins, contacts))
}

/// BoSE by the paper's linear programme, (B,).
#[pyfunction]
pub fn bose_lp<'py>(
    py: Python<'py>,
    template: &Template,
    contact_rule: &str,
    method_name: &str,
    threshold: f64,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Numbers<'py, bool>> {
    let (contact, method) = (contact(contact_rule, threshold)?, method(method_name)?);
    let question = Question { py, template, grounds: Grounds::new(normal, height) };
    let inside = question.ask(
        vertices,
        |batch| batch.is_supported_lp(&contact, method),
        |batch| batch.is_supported_lp(&contact, method),
    )?;
    written(py, &[inside.len()], inside)
}

/// The bits of ipman_rs.Status for each body, (B,).
#[pyfunction]
pub fn status<'py>(
    py: Python<'py>,
    template: &Template,
    contact_rule: &str,
    threshold: f64,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Numbers<'py, i64>> {
    let contact = contact(contact_rule, threshold)?;
    let question = Question { py, template, grounds: Grounds::new(normal, height) };
    let bits = question.ask(vertices, |batch| batch.status(&contact), |batch| batch.status(&contact))?;
    written(py, &[bits.len()], bits.into_iter().map(i64::from))
}
