//! Errors and panics of the core as Python exceptions, and Ctrl-C as an interruption of the core.

use ipman::memory;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;

/// Runs `work` without the GIL. A panic becomes a RuntimeError: pyo3's own PanicException is no Exception and would
/// pass through every `except Exception`. Signals are looked at whenever the core asks.
pub fn detached<O: Send>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> ipman::Result<O> + Send,
) -> PyResult<O> {
    let signal: Mutex<Option<PyErr>> = Mutex::new(None);
    let interrupted = || match Python::attach(|py| py.check_signals()) {
        Ok(()) => false,
        Err(error) => {
            *signal.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(error);
            true
        }
    };
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(|| memory::guarded(|| work(&interrupted)))));
    let signal = signal.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    match result {
        Ok(Ok(output)) => Ok(output),
        Ok(Err(ipman::Error::Interrupted)) => Err(signal.unwrap_or_else(|| PyKeyboardInterrupt::new_err(()))),
        Ok(Err(error)) => Err(python_error(error)),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string()));
            let text = text.unwrap_or_default();
            Err(PyRuntimeError::new_err(format!("ipman_rs failed internally ({text}); please report this as a bug")))
        }
    }
}

/// MemoryError where memory lacks, else ValueError.
pub fn python_error(error: ipman::Error) -> PyErr {
    match error {
        ipman::Error::OutOfMemory { .. } => PyMemoryError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}
