//! Command-line program around [`loop_sim`]: simulation, reports, targets, export, and the figures of the paper.
//!
//! ```text
//! scenario.toml -> Plant -> Sensor -> ControllerPort -> Actuator -> (back to Plant)
//!                    `-> Trace -> Metrics -> report (table, csv, svg, png, json)
//! ```
//!
//! A [`scenario`] defines a run, [`loop_sim`] simulates it. The controller runs in this process, and optionally also on
//! a target over a [`link`], compared bit for bit. A scenario file with its seed reproduces a run bit for bit.

pub mod cli;
pub mod feature;
pub mod figures;
pub mod report;
pub mod store;
