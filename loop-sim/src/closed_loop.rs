//! Closed loop of plant, sensor, controller port and actuator.
//!
//! Tick k of K + 1 is at t = k T, with the period T:
//!
//! ```text
//! sample = sensor(x)    u = port(sample)    u_held = actuator(u)    row -> recorder    x = x(t + T) under u_held
//! ```
//!
//! If the supply of a plant drives only a part of u at x, u_held is that part. The port receives u_held.
//!
//! All memory is allocated before the run. With the [`Recorder`] `()`, which keeps nothing, a run allocates nothing.

use std::fmt;
use std::ops::Range;

use crate::MAX_ORDER;
use crate::actuator::Actuator;
use crate::plant::Plant;
use crate::port::{ControllerPort, PortError, Tick};
use crate::sensor::Sensor;
use crate::solver::{self, SolverError};
use crate::trace::{Ending, Recorder, Row, Trace};

/// Setup of a closed loop: its four parts, the initial state and the duration.
pub struct Loop<'a> {
    /// The true plant.
    pub plant: &'a dyn Plant,
    /// Sensor between the state and the sample.
    pub sensor: &'a mut dyn Sensor,
    /// Controller, on the host or on a target.
    pub port: &'a mut dyn ControllerPort,
    /// Actuator between the demanded u and the held u.
    pub actuator: &'a mut dyn Actuator,
    /// True if the controller receives the held u after each tick.
    pub report: bool,
    /// Ticks, from 1, whose interrupt is missed. u stays, and the controller gets no notice.
    pub missed: &'a [Range<usize>],
    /// True state at t = 0, length n.
    pub x0: &'a [f64],
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods K; ticks are k = 0..=K.
    pub periods: usize,
}

impl Loop<'_> {
    /// Returns an empty trace of this run with room for all rows.
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

/// Cause of a run that broke off. The rows up to then stay recorded.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoopError {
    /// The plant cannot be integrated.
    Solver(SolverError),
    /// The controller cannot be reached.
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

/// Runs the loop. The recorder gets every row as it is computed, may end the run, and receives the ending.
///
/// # Errors
/// Fails if the plant cannot be integrated or the controller cannot be reached. The ending is then
/// [`BrokenOff`](Ending::BrokenOff), and in no other case.
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

/// Ending of a run, with the error if it broke off.
pub(crate) type Ended = (Ending, Option<LoopError>);

/// Closed loop at a tick.
pub(crate) struct Running<'a> {
    pub(crate) setup: Loop<'a>,
    /// True state at this tick, padded to [`MAX_ORDER`] entries.
    pub(crate) x: [f64; MAX_ORDER],
    pub(crate) k: usize,
    /// Last output of the controller, for missed ticks.
    last: Option<Tick>,
}

impl<'a> Running<'a> {
    pub(crate) fn new(setup: Loop<'a>) -> Self {
        let mut x = [0.0; MAX_ORDER];
        x[..setup.plant.order()].copy_from_slice(setup.x0);
        Self { setup, x, k: 0, last: None }
    }

    /// Returns the times of this tick and of the next one, s.
    pub(crate) fn interval(&self) -> [f64; 2] {
        [self.k, self.k + 1].map(|k| k as f64 * self.setup.period_s)
    }

    /// Computes everything of a tick except the plant. Returns the u that is held from here on, or the ending of the
    /// run.
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

    /// Returns the ending of a run whose plant cannot be integrated from this tick.
    pub(crate) fn broken_off(&self, error: SolverError) -> Ended {
        (Ending::BrokenOff { t_s: self.interval()[0] }, Some(LoopError::Solver(error)))
    }
}
