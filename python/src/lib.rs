//! Extension module of the Python package `edo-smc`: it translates between Python and the crates of edo-smc.
//!
//! | module | content |
//! |---|---|
//! | `scenario` | text of a scenario, and the studies of it |
//! | `controller` | the tick, alone |
//! | `trace` | result of a run as arrays |
//! | `array` | arrays of numpy |
//! | `task` | a computation without the lock of the interpreter, which Ctrl-C stops |
//! | `error` | exceptions |
//!
//! Structs of the crates go to Python as JSON, which the package turns into dictionaries. Arrays go as numpy arrays.

use pyo3::prelude::*;

mod array;
mod controller;
mod error;
mod scenario;
mod studies;
mod task;
mod trace;

#[pymodule]
fn _edo_smc(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<scenario::Core>()?;
    module.add_class::<controller::Controller>()?;
    module.add_class::<trace::Run>()?;
    module.add_function(wrap_pyfunction!(scenario::rewritten, module)?)?;
    module.add_function(wrap_pyfunction!(scenario::template, module)?)?;
    module.add_function(wrap_pyfunction!(scenario::schema, module)?)?;
    module.add_function(wrap_pyfunction!(studies::compare, module)?)?;
    module.add_function(wrap_pyfunction!(studies::compared, module)?)?;
    module.add_function(wrap_pyfunction!(studies::tune, module)?)?;
    module.add_function(wrap_pyfunction!(studies::map, module)?)?;
    module.add_function(wrap_pyfunction!(studies::monte_carlo, module)?)?;
    module.add_function(wrap_pyfunction!(studies::identify, module)?)?;
    module.add("ScenarioError", module.py().get_type::<error::ScenarioError>())?;
    module.add("Refused", module.py().get_type::<error::Refused>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
