//! The extension module `asobench._native`: the identification library for Python's arrays.
//!
//! It knows no estimator by name: names, options and their descriptions come from the registry. Signals are read where
//! NumPy has them if they are contiguous and of doubles; everything else is made so, or refused, by `asobench._arrays`.
//! The interpreter is released while something is computed.

mod arrays;
mod compare;
mod estimate;
mod model;
mod registry;

/// The module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::compare::compare_orders;
    #[pymodule_export]
    use super::estimate::estimate;
    #[pymodule_export]
    use super::model::{Native, NativeObserver, measured};
    #[pymodule_export]
    use super::registry::{check_gain, describe, estimators};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
