//! Linear blend skinning: numpy's parameters to posed bodies, and the derivatives.

use crate::array::flat;
use crate::error::detached;
use ipman::number::Data;
use ipman::skinning::batch::{Bodies, Gradients, PosedBatch, Rows, TILE, Upstream};
use ipman::skinning::{self, Model};
use numpy::{Element, PyReadonlyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

type Given<'py> = Option<Bound<'py, PyAny>>;
/// Pose, betas, expression and translation, None where there is none.
type Four<'py> = (Given<'py>, Given<'py>, Given<'py>, Given<'py>);

/// A body model ready for skinning, in one of the two precisions.
#[pyclass(frozen, module = "ipman_rs._core")]
pub struct Skin {
    tables: Tables,
}

enum Tables {
    Single(skinning::Skin<f32, TILE>),
    Double(skinning::Skin<f64, TILE>),
}

#[pymethods]
impl Skin {
    /// A body model's arrays, float64 (parents int64); posedirs may be empty. `single` keeps the large ones in float32.
    #[new]
    fn new(
        py: Python<'_>,
        v_template: PyReadonlyArrayDyn<'_, f64>,
        shapedirs: PyReadonlyArrayDyn<'_, f64>,
        expressiondirs: PyReadonlyArrayDyn<'_, f64>,
        posedirs: PyReadonlyArrayDyn<'_, f64>,
        joints: PyReadonlyArrayDyn<'_, f64>,
        joint_shapes: PyReadonlyArrayDyn<'_, f64>,
        joint_expressions: PyReadonlyArrayDyn<'_, f64>,
        rest_rotation: PyReadonlyArrayDyn<'_, f64>,
        pose_mean: PyReadonlyArrayDyn<'_, f64>,
        weights: PyReadonlyArrayDyn<'_, f64>,
        parents: PyReadonlyArray1<'_, i64>,
        single: bool,
    ) -> PyResult<Self> {
        let model = Model {
            v_template: flat(&v_template, "v_template")?,
            shapedirs: flat(&shapedirs, "shapedirs")?,
            expressiondirs: flat(&expressiondirs, "expressiondirs")?,
            posedirs: flat(&posedirs, "posedirs")?,
            joints: flat(&joints, "J_template")?,
            joint_shapes: flat(&joint_shapes, "J_shapedirs")?,
            joint_expressions: flat(&joint_expressions, "J_expressiondirs")?,
            rest_rotation: flat(&rest_rotation, "rest_rotation")?,
            pose_mean: flat(&pose_mean, "pose_mean")?,
            weights: flat(&weights, "weights")?,
            parents: parents.as_slice()?,
        };
        let tables = detached(py, |_| match single {
            true => skinning::Skin::new(&model).map(Tables::Single),
            false => skinning::Skin::new(&model).map(Tables::Double),
        })?;
        Ok(Skin { tables })
    }

    /// Fills vertices (batch, V, 3) and joints (batch, J, 3).
    fn forward(
        &self,
        py: Python<'_>,
        batch: usize,
        parameters: Four<'_>,
        vertices: Bound<'_, PyAny>,
        joints: Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.answer(Call { py, batch, parameters, along: None, filled: Filled::Bodies { vertices, joints } })
    }

    /// Fills the gradients by the parameters that are asked for, given those by vertices and joints (None: zero).
    fn vjp(
        &self,
        py: Python<'_>,
        batch: usize,
        parameters: Four<'_>,
        d_vertices: Given<'_>,
        d_joints: Given<'_>,
        gradients: Four<'_>,
    ) -> PyResult<()> {
        let filled = Filled::Gradients { d_vertices, d_joints, gradients };
        self.answer(Call { py, batch, parameters, along: None, filled })
    }

    /// Fills vertices and joints with their derivatives along a direction of the parameters (None: no movement).
    fn jvp(
        &self,
        py: Python<'_>,
        batch: usize,
        parameters: Four<'_>,
        along: Four<'_>,
        vertices: Bound<'_, PyAny>,
        joints: Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.answer(Call { py, batch, parameters, along: Some(along), filled: Filled::Bodies { vertices, joints } })
    }

    /// Fills the derivatives (batch, P, V + J, 3) of vertices and joints by pose (rotation vectors) and betas, P of them.
    fn jacobian(&self, py: Python<'_>, batch: usize, parameters: Four<'_>, jacobian: Bound<'_, PyAny>) -> PyResult<()> {
        self.answer(Call { py, batch, parameters, along: None, filled: Filled::Jacobian(jacobian) })
    }

    /// Fills the gradients' derivatives along a direction of the parameters.
    fn vjp_jvp(
        &self,
        py: Python<'_>,
        batch: usize,
        parameters: Four<'_>,
        d_vertices: Given<'_>,
        d_joints: Given<'_>,
        along: Four<'_>,
        gradients: Four<'_>,
    ) -> PyResult<()> {
        let filled = Filled::Gradients { d_vertices, d_joints, gradients };
        self.answer(Call { py, batch, parameters, along: Some(along), filled })
    }
}

impl Skin {
    fn answer(&self, call: Call<'_>) -> PyResult<()> {
        match &self.tables {
            Tables::Single(skin) => call.run(skin),
            Tables::Double(skin) => call.run(skin),
        }
    }
}

/// The parameters of a batch and what they are to fill, with a direction: its derivatives along that one.
struct Call<'py> {
    py: Python<'py>,
    batch: usize,
    parameters: Four<'py>,
    along: Option<Four<'py>>,
    filled: Filled<'py>,
}

enum Filled<'py> {
    Bodies { vertices: Bound<'py, PyAny>, joints: Bound<'py, PyAny> },
    Gradients { d_vertices: Given<'py>, d_joints: Given<'py>, gradients: Four<'py> },
    Jacobian(Bound<'py, PyAny>),
}

impl<'py> Call<'py> {
    fn run<T: Data + Element>(&self, skin: &skinning::Skin<T, TILE>) -> PyResult<()> {
        let (py, batch) = (self.py, self.batch);
        let parameters = Inputs::new(["pose", "betas", "expression", "transl"], &self.parameters)?;
        let parameters = parameters.bodies(batch)?;
        let names = ["along_pose", "along_betas", "along_expression", "along_transl"];
        let along = self.along.as_ref().map(|along| Inputs::new(names, along)).transpose()?;
        let along = along.as_ref().map(|along| along.bodies(batch)).transpose()?;
        match &self.filled {
            Filled::Bodies { vertices, joints } => {
                let (mut vertices, mut joints) = (output(vertices, "vertices")?, output(joints, "joints")?);
                let (vertices, joints) = (slice(&mut vertices, "vertices")?, slice(&mut joints, "joints")?);
                detached(py, |interrupted| {
                    let batch = PosedBatch::new(skin, batch, parameters, interrupted)?;
                    match &along {
                        None => batch.forward(vertices, joints),
                        Some(along) => batch.jvp(along, vertices, joints),
                    }
                })
            }
            Filled::Jacobian(jacobian) => {
                let mut jacobian = output(jacobian, "jacobian")?;
                let jacobian = slice(&mut jacobian, "jacobian")?;
                detached(py, |interrupted| PosedBatch::new(skin, batch, parameters, interrupted)?.jacobian(jacobian))
            }
            Filled::Gradients { d_vertices, d_joints, gradients } => {
                let (d_vertices, d_joints) = (input(d_vertices, "d_vertices")?, input(d_joints, "d_joints")?);
                let (vertices, joints) = (numbers(&d_vertices, "d_vertices")?, numbers(&d_joints, "d_joints")?);
                let upstream = Upstream { vertices, joints };
                let mut gradients = Outputs::new(["d_pose", "d_betas", "d_expression", "d_transl"], gradients)?;
                let gradients = gradients.slices()?;
                detached(py, |interrupted| {
                    let batch = PosedBatch::new(skin, batch, parameters, interrupted)?;
                    match &along {
                        None => batch.vjp(upstream, gradients),
                        Some(along) => batch.vjp_jvp(upstream, along, gradients),
                    }
                })
            }
        }
    }
}

type Names = [&'static str; 4];

/// Four arrays of parameters, or of a direction in their space.
struct Inputs<'py, T: Element> {
    names: Names,
    arrays: [Option<PyReadonlyArrayDyn<'py, T>>; 4],
}

impl<'py, T: Data + Element> Inputs<'py, T> {
    fn new(names: Names, given: &Four<'py>) -> PyResult<Self> {
        let (pose, betas, expression, transl) = given;
        let arrays =
            [input(pose, names[0])?, input(betas, names[1])?, input(expression, names[2])?, input(transl, names[3])?];
        Ok(Inputs { names, arrays })
    }

    fn bodies(&self, batch: usize) -> PyResult<Bodies<'_, T>> {
        Ok(Bodies {
            pose: self.rows(0, batch)?,
            betas: self.rows(1, batch)?,
            expression: self.rows(2, batch)?,
            transl: self.rows(3, batch)?,
        })
    }

    /// An array has a row a body, or a single one for all.
    fn rows(&self, at: usize, batch: usize) -> PyResult<Rows<'_, T>> {
        let Some(array) = &self.arrays[at] else {
            return Ok(Rows { numbers: &[], width: 0, shared: true });
        };
        let (name, shape) = (self.names[at], array.shape());
        match shape.first() {
            Some(&rows) if rows == batch || rows == 1 => {
                let width = shape[1..].iter().product();
                Ok(Rows { numbers: flat(array, name)?, width, shared: rows != batch })
            }
            _ => Err(PyValueError::new_err(format!("{name}: expected {batch} rows or one, got shape {shape:?}"))),
        }
    }
}

/// Four arrays that are written, None for what is not asked for.
struct Outputs<'py, T: Element> {
    names: Names,
    arrays: [Option<PyReadwriteArrayDyn<'py, T>>; 4],
}

impl<'py, T: Element> Outputs<'py, T> {
    fn new(names: Names, given: &Four<'py>) -> PyResult<Self> {
        let (pose, betas, expression, transl) = given;
        let mut arrays = [const { None }; 4];
        for ((place, array), name) in arrays.iter_mut().zip([pose, betas, expression, transl]).zip(names) {
            *place = array.as_ref().map(|array| output(array, name)).transpose()?;
        }
        Ok(Outputs { names, arrays })
    }

    fn slices(&mut self) -> PyResult<Gradients<'_, T>> {
        let mut slices = Gradients::default();
        for ((place, array), name) in slices.iter_mut().zip(&mut self.arrays).zip(self.names) {
            if let Some(array) = array {
                *place = slice(array, name)?;
            }
        }
        Ok(slices)
    }
}

fn dtype_error(name: &str) -> PyErr {
    PyTypeError::new_err(format!("{name}: expected an array of the skin's dtype"))
}

fn input<'py, T: Element>(array: &Given<'py>, name: &str) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    array.as_ref().map(|array| array.extract().map_err(|_| dtype_error(name))).transpose()
}

fn output<'py, T: Element>(array: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    array.extract().map_err(|_| dtype_error(name))
}

fn numbers<'a, T: Element>(array: &'a Option<PyReadonlyArrayDyn<'_, T>>, name: &str) -> PyResult<&'a [T]> {
    array.as_ref().map_or(Ok(&[]), |array| flat(array, name))
}

fn slice<'a, T: Element>(array: &'a mut PyReadwriteArrayDyn<'_, T>, name: &str) -> PyResult<&'a mut [T]> {
    array.as_slice_mut().map_err(|_| PyValueError::new_err(format!("{name}: expected a C-contiguous array")))
}
