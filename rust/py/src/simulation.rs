//! Stiff bodies: how firmly they stand, and what becomes of them when they are let go.

use crate::analysis::{PolygonArrays, polygon_arrays};
use crate::array::{Vertices, written};
use crate::bodies::{Grounds, on_batch};
use crate::error::python_error;
use crate::template::Template;
use ipman::mass_properties::MassProperties;
use ipman::memory;
use ipman::simulation::contact::Shape;
use ipman::simulation::{Placement, Simulation};
use ipman::tipping::TipTest;
use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Runs `$work` on the batch of either precision.
macro_rules! on_either {
    ($py:ident, $template:ident, $vertices:ident, $grounds:expr, $work:expr) => {
        match $vertices {
            Vertices::Single(vertices) => on_batch($py, $template, &vertices, &$grounds, $work),
            Vertices::Double(vertices) => on_batch($py, $template, &vertices, &$grounds, $work),
        }
    };
}

fn rows<'py, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [f64; N]>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    written(py, &[rows.len(), N], rows.flatten())
}

/// Each body as one solid, (B, 15): status, mass, centre, inertia row by row, height of the lowest vertex.
#[pyfunction]
pub fn solids<'py>(
    py: Python<'py>,
    template: &Template,
    densities: Vec<f64>,
    contact: f64,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let densities = MassProperties { densities };
    let solids =
        on_either!(py, template, vertices, Grounds::new(normal, height), |batch| batch.solids(&densities, contact))?;
    rows(py, solids.iter().map(|solid| solid.row()))
}

/// The tip test, (B, 26): the solid's 15; height, margin, barrier, push, rate; tilt, drop, nudged tilt; at rest the
/// margin, barrier and push. options: contact, tolerance, nudge, fallen.
#[pyfunction]
pub fn tip_test<'py>(
    py: Python<'py>,
    template: &Template,
    densities: Vec<f64>,
    options: [f64; 4],
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let [contact, tolerance, nudge, fallen] = options;
    let test = TipTest::new(&densities, contact, tolerance, nudge, fallen).map_err(python_error)?;
    let found = on_either!(py, template, vertices, Grounds::new(normal, height), |batch| batch.tip_test(&test))?;
    rows(py, found.iter().map(|tipping| tipping.row()))
}

fn faces(template: &Template) -> PyResult<Vec<[u32; 3]>> {
    memory::guarded(|| Ok(memory::copied(&template.inner.mesh.faces))).map_err(python_error)
}

fn shape(template: &Template, name: &str, resolution: u32) -> PyResult<Shape> {
    match name {
        "hull" => Ok(Shape::Hull),
        "vhacd" => Ok(Shape::Decomposition { resolution, faces: faces(template)? }),
        _ => Err(PyValueError::new_err(format!("shape: expected hull or vhacd, got {name:?}"))),
    }
}

/// The points (N, 3) of all bodies that can touch a plane, and how many each has; none for a body that is no solid, or
/// has no hull.
#[pyfunction]
pub fn touching<'py>(
    py: Python<'py>,
    template: &Template,
    shape_name: &str,
    resolution: u32,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<PolygonArrays<'py>> {
    let shape = shape(template, shape_name, resolution)?;
    let found = on_either!(py, template, vertices, Grounds::new(normal, height), |batch| batch.touching(&shape))?;
    polygon_arrays(py, found.iter())
}

type Motions<'py> = (Bound<'py, PyArrayDyn<i64>>, Bound<'py, PyArrayDyn<f64>>);

/// status (B,), and places (B, 1 + T, 12) at the start and at each look: centre of mass, rotation row by row.
///
/// looks: in steps, ascending. snap: put the lowest point on the ground first.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    template: &Template,
    shape_name: &str,
    resolution: u32,
    densities: Vec<f64>,
    contact: f64,
    snap: bool,
    step: f64,
    friction: f64,
    looks: Vec<usize>,
    vertices: Vertices<'py>,
    normal: PyReadonlyArray2<'py, f64>,
    height: PyReadonlyArray1<'py, f64>,
) -> PyResult<Motions<'py>> {
    let (shape, densities) = (shape(template, shape_name, resolution)?, MassProperties { densities });
    let count = 1 + looks.len();
    let simulation = Simulation { densities, contact, shape, snap, step, friction, looks };
    let motions =
        on_either!(py, template, vertices, Grounds::new(normal, height), |batch| batch.simulate(&simulation))?;
    let status = written(py, &[motions.len()], motions.iter().map(|motion| i64::from(motion.status)))?;
    let places = motions.iter().flat_map(|motion| &motion.places).flat_map(numbers);
    Ok((status, written(py, &[motions.len(), count, 12], places)?))
}

fn numbers(place: &Placement) -> [f64; 12] {
    let ([x, y, z], [[a, b, c], [d, e, f], [g, h, i]]) = (place.centre, place.rotation);
    [x, y, z, a, b, c, d, e, f, g, h, i]
}
