//! Closes the loop of [`controller_core`] against simulated plants.
//!
//! ```text
//! scenario.toml -> Plant -> Sensor -> ControllerPort -> Actuator -> (back to Plant)
//!                    `-> Trace -> Metrics -> report (table, csv, svg, png, json)
//! ```
//!
//! The controller runs in this process, or beside it on a target over a [`transport`], compared bit for bit.
//!
//! Every stage is a value-in, value-out step behind a small trait; [`closed_loop::close_loop`] is the one function that
//! closes the loop. A scenario file with its seed reproduces a run bit for bit: elementary functions come from `libm`,
//! random numbers from ChaCha8.

pub mod actuator;
pub mod cli;
pub mod closed_loop;
pub mod export;
pub mod figures;
pub mod metrics;
pub mod plant;
pub mod port;
pub mod report;
pub mod scenario;
pub mod sensor;
pub mod signal;
pub mod solver;
pub mod trace;
pub mod transport;

/// Highest plant order.
pub const MAX_ORDER: usize = 6;
