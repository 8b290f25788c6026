//! The one place where the loop is closed.

use std::ops::ControlFlow;

use crate::MAX_ORDER;
use crate::actuator::Actuator;
use crate::plant::Plant;
use crate::port::{ControllerPort, PortError};
use crate::sensor::Sensor;
use crate::solver::{self, SolverError};
use crate::trace::{Ending, Row, Trace};

/// Everything between two ticks of the clock.
pub struct Loop<'a> {
    /// The true plant.
    pub plant: &'a dyn Plant,
    /// Measuring chain.
    pub sensor: &'a mut dyn Sensor,
    /// The controller.
    pub port: &'a mut dyn ControllerPort,
    /// Actuating chain.
    pub actuator: &'a mut dyn Actuator,
    /// Is the controller told what the actuator holds?
    pub report: bool,
    /// True state at t = 0, length n.
    pub x0: &'a [f64],
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods K; ticks are k = 0..=K.
    pub periods: usize,
}

/// Why a run broke off; what was recorded until then is kept.
#[derive(Debug)]
pub enum LoopError {
    /// The plant could not be integrated.
    Solver(SolverError),
    /// The controller could not be reached.
    Port(PortError),
}

/// Runs the loop. `watch` sees every row as it is made and may break off (progress, Ctrl-C).
///
/// The trace is returned in any case; the error says why it is shorter than asked.
pub fn close_loop(setup: Loop<'_>, watch: &mut dyn FnMut(&Row) -> ControlFlow<()>) -> (Trace, Option<LoopError>) {
    let Loop { plant, sensor, port, actuator, report, x0, period_s, periods } = setup;
    let n = plant.order();
    let mut trace = Trace {
        order: n,
        observed: port.observed().to_vec(),
        period_s,
        rows: Vec::with_capacity(periods + 1),
        ending: Ending::Finished,
    };
    let mut x = [0.0; MAX_ORDER];
    x[..n].copy_from_slice(x0);
    for k in 0..=periods {
        let t_s = k as f64 * period_s;
        if x[..n].iter().any(|value| !value.is_finite() || value.abs() > solver::RUNAWAY) {
            trace.ending = Ending::Diverged { t_s };
            break;
        }
        let mut sample = [0.0; MAX_ORDER];
        sensor.measure(&x[..n], &mut sample[..n]);
        let tick = match port.tick(&sample[..n]) {
            Ok(tick) => tick,
            Err(error) => {
                trace.ending = Ending::BrokenOff { t_s };
                return (trace, Some(LoopError::Port(error)));
            }
        };
        let u_held = actuator.drive(tick.u);
        if report {
            port.applied(u_held);
        }
        let mut d = [0.0; MAX_ORDER];
        plant.lumped(t_s, &x[..n], u_held, &mut d[..n]);
        let row = Row {
            t_s,
            x,
            u: tick.u,
            u_held,
            sigma: tick.sigma,
            sigma_star: tick.sigma_star,
            d,
            d_hat: tick.d_hat(),
            health: tick.health,
        };
        trace.rows.push(row);
        if watch(&row).is_break() {
            trace.ending = Ending::Interrupted { t_s };
            break;
        }
        if k < periods
            && let Err(error) = solver::advance(plant, t_s, (k + 1) as f64 * period_s, u_held, &mut x[..n])
        {
            trace.ending = Ending::BrokenOff { t_s };
            return (trace, Some(LoopError::Solver(error)));
        }
    }
    (trace, None)
}
