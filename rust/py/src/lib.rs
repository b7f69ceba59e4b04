//! `ipman_rs._core`: the crate `ipman` for Python. It translates arrays and errors and knows no formula.

mod analysis;
mod array;
mod bodies;
mod collision;
mod error;
mod quantity;
mod simulation;
mod skinning;
mod support;
mod template;
mod weighted;

use pyo3::prelude::*;

/// The Rust engine behind ipman_rs.
#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::analysis::analysis;
    #[pymodule_export]
    use crate::collision::Collision;
    #[pymodule_export]
    use crate::quantity::Quantity;
    #[pymodule_export]
    use crate::simulation::{simulate, solids, tip_test, touching};
    #[pymodule_export]
    use crate::skinning::Skin;
    #[pymodule_export]
    use crate::support::{base_of_support, bose_lp, status};
    #[pymodule_export]
    use crate::template::Template;
    #[pymodule_export]
    use crate::threads::{follow_threads, get_num_threads, set_num_threads, simd_level, simd_levels};

    use ipman::losses::AnyTerm;
    use pyo3::prelude::*;
    use pyo3::types::{IntoPyDict, PyDict, PyTuple};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("ANALYSIS_COLUMNS", ipman::analysis::COLUMNS.into_py_dict(module.py())?)?;
        module.add("GRAVITY", ipman::solid::GRAVITY)?;
        module.add("TERMS", terms(module.py())?)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// (numbers, modes, options) of each term by its name.
    fn terms(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let terms = PyDict::new(py);
        for term in AnyTerm::DESCRIPTIONS {
            let names = |names: &[&str]| PyTuple::new(py, names);
            terms.set_item(term.name, (names(term.numbers)?, names(term.modes)?, names(term.options)?))?;
        }
        Ok(terms)
    }
}

mod threads {
    use crate::error::python_error;
    use ipman::number::simd_level::Level;
    use pyo3::exceptions::PyValueError;
    use pyo3::prelude::*;

    /// The CPU level that batches run on: avx512, avx2, neon or scalar. IPMAN_SIMD forces one.
    #[pyfunction]
    pub fn simd_level() -> PyResult<&'static str> {
        Ok(Level::current().map_err(python_error)?.name())
    }

    /// The CPU levels that this machine has, best first.
    #[pyfunction]
    pub fn simd_levels() -> Vec<&'static str> {
        Level::available().into_iter().map(Level::name).collect()
    }

    /// The number of threads that batches use.
    #[pyfunction]
    pub fn get_num_threads() -> usize {
        ipman::threads::num_threads()
    }

    /// Sets the number of threads that batches use, 1 to 1024.
    ///
    /// None: as RAYON_NUM_THREADS says, else as many as torch once ipman_rs.torch has been used, else one a core.
    #[pyfunction]
    pub fn set_num_threads(threads: Bound<'_, PyAny>) -> PyResult<()> {
        match threads.extract() {
            Ok(number @ (None | Some(1..=1024))) => {
                ipman::threads::set_num_threads(number);
                Ok(())
            }
            _ => Err(PyValueError::new_err(format!("threads: expected 1 to 1024 or None, got {threads}"))),
        }
    }

    /// Uses as many threads as torch, unless `set_num_threads` or RAYON_NUM_THREADS say otherwise.
    #[pyfunction]
    pub fn follow_threads(threads: usize) {
        ipman::threads::follow(threads);
    }
}
