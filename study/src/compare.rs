//! Our drive beside its rivals, on the same plants, encoders, references and limits, each tuned with the same effort.
//!
//! | module | what |
//! |---|---|
//! | [`bench`](Bench) | the runs, the figures, the cost |
//! | `rival` | the laws of the books |
//! | `cascade` | of these the cascades, and the notch |
//! | `ours` | our drive as one of them |
//! | `linear` | is the exact sampled loop stable? |
//! | `tune` | random and local search, one seed |
//!
//! A controller of one's own needs [`ControllerPort`], and is built from a [`Task`] for every run:
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

/// Something to be chosen; the search moves its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// With its unit.
    pub name: &'static str,
    /// Lower end, above 0.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Where the search begins.
    pub guess: f64,
}

/// A law with knobs.
pub trait Contender: Sync {
    /// What it is called.
    fn name(&self) -> &'static str;

    /// What may be chosen.
    fn knobs(&self) -> Vec<Knob>;

    /// The law with these values; `None` where there is none.
    fn design(&self, knobs: &[f64]) -> Option<Box<dyn Design>>;
}

/// A law with its knobs set.
pub trait Design: Sync {
    /// The controller for a run, before its first tick; `None` if there is none for these encoders.
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>>;

    /// What is linear of it near rest, and up to which error of the plant (0.5, or 0.2) that must be stable; nothing
    /// for a law that is not linear: its corners are told by simulation.
    fn linear(&self) -> Vec<(Linear, f64)> {
        Vec::new()
    }
}

/// A controller of one's own: what makes its port.
pub struct Own<F>(pub F);

impl<F: Fn(&Task) -> Box<dyn ControllerPort> + Sync> Design for Own<F> {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        Some((self.0)(task))
    }
}

/// A law of the books for a scenario.
struct Rival {
    kind: rival::Kind,
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

/// Our drive with so many gain sets: its knobs, and the drive that they make.
pub struct Tuned(ours::Ours);

impl Tuned {
    /// Of a scenario.
    pub const fn new(bench: &Bench, gain_sets: usize) -> Self {
        Self(ours::Ours { designed: bench.designed, gain_sets })
    }

    /// What may be chosen.
    pub fn knobs(&self) -> Vec<Knob> {
        self.0.knobs()
    }

    /// The drive with these values; none where there is none.
    pub fn designed(&self, knobs: &[f64]) -> Option<DriveDesign> {
        self.0.designed(knobs)
    }
}

/// A drive of ours as something that a [`Bench`] runs; none if it is refused.
pub fn of_ours(designed: &DriveDesign) -> Option<impl Design + use<>> {
    ours::Chosen::new(designed)
}

/// Ours with two gain sets and with one, and the rivals.
pub fn contenders(bench: &Bench) -> Vec<Box<dyn Contender>> {
    let designed = bench.designed;
    let ours = [2, 1].map(|gain_sets| Box::new(ours::Ours { designed, gain_sets }) as Box<dyn Contender>);
    let rival = |kind| Box::new(Rival { kind, task: bench.task().clone() }) as Box<dyn Contender>;
    ours.into_iter().chain(rival::Kind::all(bench.task().model.encoders()).map(rival)).collect()
}
