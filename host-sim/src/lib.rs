//! The program around [`loop_sim`]: the paper's figures, reports, targets, exported designs and the command line.
//!
//! ```text
//! scenario.toml -> Plant -> Sensor -> ControllerPort -> Actuator -> (back to Plant)
//!                    `-> Trace -> Metrics -> report (table, csv, svg, png, json)
//! ```
//!
//! A [`scenario`] says what runs, [`loop_sim`] runs it. The controller runs in this process, or beside it on a target
//! over a [`link`], compared bit for bit. A scenario file with its seed reproduces a run bit for bit.

pub mod cli;
pub mod feature;
pub mod figures;
pub mod report;
pub mod store;
