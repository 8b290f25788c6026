//! What a run recorded: one row per tick.

use crate::MAX_ORDER;
use controller_core::Health;

/// Everything of one tick. Arrays are filled up to the plant order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time of the tick, s.
    pub t_s: f64,
    /// True state.
    pub x: [f64; MAX_ORDER],
    /// Control demanded by the controller.
    pub u: f64,
    /// Control the plant feels until the next tick.
    pub u_held: f64,
    /// σ.
    pub sigma: f64,
    /// σ*.
    pub sigma_star: f64,
    /// True lumped disturbances, with `u_held`.
    pub d: [f64; MAX_ORDER],
    /// Their estimates; 0 in channels without observer.
    pub d_hat: [f64; MAX_ORDER],
    /// Trouble, if any.
    pub health: Health,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// The whole span.
    Finished,
    /// The state left every reasonable range at this time.
    Diverged {
        /// Time, s.
        t_s: f64,
    },
    /// Someone asked to stop at this time.
    Interrupted {
        /// Time, s.
        t_s: f64,
    },
    /// The plant could not be integrated, or the controller not be reached, from this time on.
    BrokenOff {
        /// Time, s.
        t_s: f64,
    },
}

/// All rows of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Plant order n.
    pub order: usize,
    /// Observed channels, from 0.
    pub observed: Vec<usize>,
    /// Period, s.
    pub period_s: f64,
    /// One per tick, k = 0..=K.
    pub rows: Vec<Row>,
    /// How it ended.
    pub ending: Ending,
}
