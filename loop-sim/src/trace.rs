//! What a run tells: one [`Row`] per tick, and how it ended.
//!
//! A [`Recorder`] takes the rows as they are made. `()` keeps nothing, a [`Trace`] keeps all of them, a closure sees
//! each and may end the run, and a pair `(&mut a, &mut b)` is both of its halves.

use std::ops::ControlFlow;

use crate::MAX_ORDER;
use controller_core::Health;

/// Takes the rows of a run as they are made.
pub trait Recorder {
    /// Called once per tick; `Break` ends the run after this row.
    fn record(&mut self, row: &Row) -> ControlFlow<()>;

    /// Called once, after the last row.
    fn end(&mut self, _ending: Ending) {}
}

/// A recorder that keeps nothing.
impl Recorder for () {
    fn record(&mut self, _row: &Row) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// A closure: progress, Ctrl-C, a figure computed on the way.
impl<F: FnMut(&Row) -> ControlFlow<()> + ?Sized> Recorder for F {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        self(row)
    }
}

/// Both see every row; either may end the run.
impl<A: Recorder + ?Sized, B: Recorder + ?Sized> Recorder for (&mut A, &mut B) {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        let [one, other] = [self.0.record(row), self.1.record(row)];
        if one.is_break() { one } else { other }
    }

    fn end(&mut self, ending: Ending) {
        self.0.end(ending);
        self.1.end(ending);
    }
}

/// Everything of one tick. Arrays are filled up to the plant order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time of the tick, s.
    pub t_s: f64,
    /// True state of the plant.
    pub x: [f64; MAX_ORDER],
    /// Where the output should be; 0 for a law that follows nothing.
    pub r: f64,
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
    /// The state that follows a reference, from 0; none for a law that holds rest.
    pub follows: Option<usize>,
    /// Period, s.
    pub period_s: f64,
    /// One per tick, k = 0..=K.
    pub rows: Vec<Row>,
    /// How it ended; `Finished` before it began.
    pub ending: Ending,
}

impl Trace {
    /// y - r of a row: what is left of the reference, or of rest.
    pub fn error(&self, row: &Row) -> f64 {
        row.x[self.follows.unwrap_or(0)] - row.r
    }
}

/// Keeps every row.
impl Recorder for Trace {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        self.rows.push(*row);
        ControlFlow::Continue(())
    }

    fn end(&mut self, ending: Ending) {
        self.ending = ending;
    }
}
