//! Closes the loop of [`controller_core`] against simulated plants, in process and without a file, a clock or a C
//! compiler.
//!
//! ```text
//! Plant -> Sensor -> ControllerPort -> Actuator -> (back to Plant)
//!   `-> Recorder (Trace) -> Metrics
//! ```
//!
//! Every stage is a value-in, value-out step behind a small trait; [`closed_loop::close_loop`] is the one function that
//! closes the loop. A run with its seed is reproduced bit for bit: elementary functions come from `libm`, random numbers
//! from ChaCha8.

pub mod actuator;
pub mod closed_loop;
pub mod metrics;
pub mod plant;
pub mod port;
pub mod random;
pub mod sensor;
pub mod signal;
pub mod solver;
pub mod trace;

/// Highest plant order.
pub const MAX_ORDER: usize = 6;
