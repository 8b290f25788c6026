//! Comparison of edo-smc with baseline controllers on equal plants, encoders, references and limits, with equal tuning
//! effort.
//!
//! | module | content |
//! |---|---|
//! | [`bench`](Bench) | test runs, metrics, cost |
//! | `rival` | textbook controllers |
//! | `cascade` | the cascades among them, and the notch |
//! | `ours` | edo-smc as a contender |
//! | `linear` | stability of the exact sampled loop |
//! | `tune` | random and local search, one seed |
//!
//! A custom controller implements [`ControllerPort`] and is built from a [`Task`] for every run:
//!
//! ```
//! use study::compare::{Bench, Own, Task};
//! # use loop_sim::port::{ControllerPort, PortError, Tick};
//! # struct Mine(Task);
//! # impl ControllerPort for Mine {
//! #     fn tick(&mut self, _: &[f64]) -> Result<Tick, PortError> {
//! #         Ok(Tick { u: 0.0, sigma: 0.0, sigma_star: 0.0, estimates: [[0.0; 3]; 6], health:
//! controller_core::Health::OK })
//! #     }
//! #     fn report_applied(&mut self, _: f64) {}
//! #     fn reset(&mut self) -> Result<(), PortError> { Ok(()) }
//! #     fn observed(&self) -> &[usize] { &[] }
//! # }
//! let bench = Bench::new("joint.toml", scenario::JOINT, &[])?;
//! let figures = bench.figures(&Own(|task: &Task| Box::new(Mine(task.clone())) as Box<dyn ControllerPort>));
//! # assert!(figures.move_rad > 0.5);
//! # Ok::<(), study::Error>(())
//! ```

use std::sync::Arc;

use loop_sim::port::ControllerPort;
use loop_sim::port::drive::DriveDesign;

mod bench;
mod cascade;
pub(crate) mod corners;
mod linear;
pub(crate) mod matrix;
mod ours;
mod rival;
mod task;
mod tune;

pub use bench::{Bench, Figures, LOST, Lost, Worst};
pub use linear::{Linear, Sampled};
pub use task::{Aim, Angles, Model, Task};
pub use tune::{Comparison, Entry, Settings, compare};

/// Tuning parameter; the search varies its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// Name with its unit.
    pub name: &'static str,
    /// Lower limit, above 0.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
    /// Initial value of the search.
    pub guess: f64,
}

/// Controller with tuning parameters.
pub trait Contender: Sync {
    /// Returns the name.
    fn name(&self) -> &'static str;

    /// Returns the tuning parameters.
    fn knobs(&self) -> Vec<Knob>;

    /// Returns the controller with these values; `None` if no design exists.
    fn design(&self, knobs: &[f64]) -> Option<Box<dyn Design>>;
}

/// Controller with fixed parameters.
pub trait Design: Sync {
    /// Returns the controller for a run, before its first tick; `None` if it does not support these encoders.
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>>;

    /// Returns the linear models near rest, each with the plant error (0.5 or 0.2) up to which it must be stable. A
    /// nonlinear controller has none; its corners are checked by simulation.
    fn linear(&self) -> Vec<(Linear, f64)> {
        Vec::new()
    }
}

/// Custom controller: the function that builds its port.
pub struct Own<F>(pub F);

impl<F: Fn(&Task) -> Box<dyn ControllerPort> + Sync> Design for Own<F> {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        Some((self.0)(task))
    }
}

/// Baseline controller for a scenario.
struct Rival {
    kind: rival::BaselineKind,
    task: Task,
}

struct RivalDesign {
    law: Arc<rival::Law>,
    linear: Option<Linear>,
}

impl Contender for Rival {
    fn name(&self) -> &'static str {
        self.kind.name()
    }

    fn knobs(&self) -> Vec<Knob> {
        self.kind.knobs(&self.task)
    }

    fn design(&self, knobs: &[f64]) -> Option<Box<dyn Design>> {
        let law = self.kind.law(&self.task, knobs)?;
        let linear = Linear::of_rival(&law, self.task.model.encoders(), self.task.delay_ticks());
        Some(Box::new(RivalDesign { law: Arc::new(law), linear }))
    }
}

impl Design for RivalDesign {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        Some(Box::new(rival::Port::new(self.law.clone(), task)))
    }

    fn linear(&self) -> Vec<(Linear, f64)> {
        self.linear.iter().map(|linear| (linear.clone(), 0.5)).collect()
    }
}

/// edo-smc drive with a number of gain sets: its tuning parameters and the resulting drive.
pub struct Tuned(ours::Ours);

impl Tuned {
    /// Builds the tuner of a scenario.
    pub const fn new(bench: &Bench, gain_sets: usize) -> Self {
        Self(ours::Ours { designed: bench.designed, gain_sets })
    }

    /// Returns the tuning parameters.
    pub fn knobs(&self) -> Vec<Knob> {
        self.0.knobs()
    }

    /// Returns the drive with these values; `None` if no design exists.
    pub fn designed(&self, knobs: &[f64]) -> Option<DriveDesign> {
        self.0.designed(knobs)
    }
}

/// Returns an edo-smc drive as a design for a [`Bench`]; `None` if it is invalid.
pub fn of_ours(designed: &DriveDesign) -> Option<impl Design + use<>> {
    ours::Chosen::new(designed)
}

/// Returns edo-smc with two gain sets and with one, and the baseline controllers.
pub fn contenders(bench: &Bench) -> Vec<Box<dyn Contender>> {
    let designed = bench.designed;
    let ours = [2, 1].map(|gain_sets| Box::new(ours::Ours { designed, gain_sets }) as Box<dyn Contender>);
    let rival = |kind| Box::new(Rival { kind, task: bench.task().clone() }) as Box<dyn Contender>;
    ours.into_iter().chain(rival::BaselineKind::all(bench.task().model.encoders()).map(rival)).collect()
}
