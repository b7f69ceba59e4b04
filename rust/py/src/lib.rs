//! `ipman_rs._core`: the crate `ipman` for Python. It translates arrays and errors and knows no formula.

mod analysis;
mod array;
mod bodies;
mod error;
mod evaluate;
mod skinning;
mod support;
mod template;

use pyo3::prelude::*;

/// The Rust engine behind ipman_rs.
#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::analysis::analysis;
    #[pymodule_export]
    use crate::evaluate::{jvp, output_size, value, value_and_vjp, vjp, vjp_jvp};
    #[pymodule_export]
    use crate::skinning::Skin;
    #[pymodule_export]
    use crate::support::{base_of_support, bose_lp, status};
    #[pymodule_export]
    use crate::template::Template;
    #[pymodule_export]
    use crate::threads::{get_num_threads, set_num_threads};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

mod threads {
    use pyo3::exceptions::PyValueError;
    use pyo3::prelude::*;

    /// The number of threads that batches use.
    #[pyfunction]
    pub fn get_num_threads() -> usize {
        ipman::threads::num_threads()
    }

    /// Sets the number of threads that batches use, 1 to 1024.
    #[pyfunction]
    pub fn set_num_threads(threads: Bound<'_, PyAny>) -> PyResult<()> {
        match threads.extract() {
            Ok(number @ 1..=1024) => {
                ipman::threads::set_num_threads(number);
                Ok(())
            }
            _ => Err(PyValueError::new_err(format!("threads: expected 1 to 1024, got {threads}"))),
        }
    }
}
