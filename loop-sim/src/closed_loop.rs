//! The one place where the loop is closed.
//!
//! Tick k of K + 1, at t = k T, with T the period:
//!
//! ```text
//! sample = sensor(x)    u = port(sample)    u_held = actuator(u)    row -> recorder    x = x(t + T) under u_held
//! ```
//!
//! Where a plant's supply drives only a part of u at x, u_held is that part, and the port is told of it.
//!
//! All memory is made before: with a [`Recorder`] that keeps nothing, `()`, a run allocates nothing.

use std::fmt;
use std::ops::Range;

use crate::MAX_ORDER;
use crate::actuator::Actuator;
use crate::plant::Plant;
use crate::port::{ControllerPort, PortError, Tick};
use crate::sensor::Sensor;
use crate::solver::{self, SolverError};
use crate::trace::{Ending, Recorder, Row, Trace};

/// Everything between two ticks of the clock.
pub struct Loop<'a> {
    /// The true plant.
    pub plant: &'a dyn Plant,
    /// What lies between the state and the sample.
    pub sensor: &'a mut dyn Sensor,
    /// The controller, wherever it runs.
    pub port: &'a mut dyn ControllerPort,
    /// What lies between the u demanded and the u held.
    pub actuator: &'a mut dyn Actuator,
    /// Is the controller told what the actuator holds?
    pub report: bool,
    /// Ticks, from 1, whose interrupt does not come: u stays, and nobody tells the controller.
    pub missed: &'a [Range<usize>],
    /// True state at t = 0, length n.
    pub x0: &'a [f64],
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods K; ticks are k = 0..=K.
    pub periods: usize,
}

impl Loop<'_> {
    /// A trace of this run before its first row, with room for all of them.
    pub fn trace(&self) -> Trace {
        Trace {
            order: self.plant.order(),
            observed: self.port.observed().to_vec(),
            follows: self.port.follows(),
            period_s: self.period_s,
            rows: Vec::with_capacity(self.periods + 1),
            ending: Ending::Finished,
        }
    }
}

/// Why a run broke off; what was recorded until then stays recorded.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoopError {
    /// The plant could not be integrated.
    Solver(SolverError),
    /// The controller could not be reached.
    Port(PortError),
}

impl fmt::Display for LoopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(error) => error.fmt(f),
            Self::Port(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for LoopError {}

/// Runs the loop; the recorder gets every row as it is made, may end the run, and is told how it ended.
///
/// # Errors
/// When the plant could not be integrated or the controller not be reached; the ending is then
/// [`BrokenOff`](Ending::BrokenOff), and never otherwise.
pub fn close_loop<R: Recorder + ?Sized>(setup: Loop<'_>, recorder: &mut R) -> Result<Ending, LoopError> {
    let (ending, error) = run(setup, recorder);
    recorder.end(ending);
    error.map_or(Ok(ending), Err)
}

fn run<R: Recorder + ?Sized>(setup: Loop<'_>, recorder: &mut R) -> Ended {
    let mut running = Running::new(setup);
    loop {
        let u_held = match running.tick(recorder) {
            Ok(u_held) => u_held,
            Err(ended) => return ended,
        };
        let ([from_s, to_s], n) = (running.interval(), running.setup.plant.order());
        let Running { setup: Loop { plant, .. }, x, k, .. } = &mut running;
        if !plant.exact().is_some_and(|exact| exact.advance(from_s, to_s, u_held, &mut x[..n]))
            && let Err(error) = solver::advance(*plant, from_s, to_s, u_held, &mut x[..n])
        {
            return running.broken_off(error);
        }
        *k += 1;
    }
}

/// How a run ended, and why if it broke off.
pub(crate) type Ended = (Ending, Option<LoopError>);

/// A loop at a tick.
pub(crate) struct Running<'a> {
    pub(crate) setup: Loop<'a>,
    /// The true state there, filled up to the plant's order.
    pub(crate) x: [f64; MAX_ORDER],
    pub(crate) k: usize,
    /// What the controller said last.
    last: Option<Tick>,
}

impl<'a> Running<'a> {
    pub(crate) fn new(setup: Loop<'a>) -> Self {
        let mut x = [0.0; MAX_ORDER];
        x[..setup.plant.order()].copy_from_slice(setup.x0);
        Self { setup, x, k: 0, last: None }
    }

    /// From this tick to the next, s.
    pub(crate) fn interval(&self) -> [f64; 2] {
        [self.k, self.k + 1].map(|k| k as f64 * self.setup.period_s)
    }

    /// All of a tick but the plant: the u that is held from here on; or how the run has ended.
    pub(crate) fn tick<R: Recorder + ?Sized>(&mut self, recorder: &mut R) -> Result<f64, Ended> {
        let [t_s, _] = self.interval();
        let Self { setup: Loop { plant, sensor, port, actuator, report, missed, periods, .. }, x, k, last } = self;
        let n = plant.order();
        if x[..n].iter().any(|value| !value.is_finite() || value.abs() > solver::RUNAWAY) {
            return Err((Ending::Diverged { t_s }, None));
        }
        let mut sample = [0.0; MAX_ORDER];
        sensor.measure(&x[..n], &mut sample[..n]);
        let is_missed = missed.iter().any(|ticks| ticks.contains(k));
        let tick = match last {
            Some(tick) if is_missed => *tick,
            _ => match port.tick(&sample[..n]) {
                Ok(tick) => tick,
                Err(error) => return Err((Ending::BrokenOff { t_s }, Some(LoopError::Port(error)))),
            },
        };
        if !missed.is_empty() {
            *last = Some(tick);
        }
        let u_held = plant.driven(&x[..n], actuator.drive(tick.u));
        if *report && !is_missed {
            port.report_applied(u_held);
        }
        let mut d = [0.0; MAX_ORDER];
        plant.lumped(t_s, &x[..n], u_held, &mut d[..n]);
        let row = Row {
            t_s,
            x: *x,
            r: port.reference(),
            u: tick.u,
            u_held,
            sigma: tick.sigma,
            sigma_star: tick.sigma_star,
            d,
            d_hat: tick.d_hat(),
            health: tick.health,
        };
        if recorder.record(&row).is_break() {
            return Err((Ending::Interrupted { t_s }, None));
        }
        if k == periods { Err((Ending::Finished, None)) } else { Ok(u_held) }
    }

    /// The plant could not be moved from here.
    pub(crate) fn broken_off(&self, error: SolverError) -> Ended {
        (Ending::BrokenOff { t_s: self.interval()[0] }, Some(LoopError::Solver(error)))
    }
}
