//! Result of a run: one [`Row`] per tick, and its ending.
//!
//! A [`Recorder`] takes the rows as they are computed. `()` keeps nothing, and a [`Trace`] keeps all rows. A closure
//! gets each row and may end the run. A pair `(&mut a, &mut b)` passes each row to both.

use std::ops::ControlFlow;

use crate::MAX_ORDER;
use controller_core::Health;

/// Receiver of the rows of a run as they are computed.
pub trait Recorder {
    /// Records a row, once per tick. `Break` ends the run after this row.
    fn record(&mut self, row: &Row) -> ControlFlow<()>;

    /// Receives the ending, once after the last row.
    fn end(&mut self, _ending: Ending) {}
}

/// Recorder that keeps nothing.
impl Recorder for () {
    fn record(&mut self, _row: &Row) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Closure as a recorder: progress, Ctrl-C, or a metric computed during the run.
impl<F: FnMut(&Row) -> ControlFlow<()> + ?Sized> Recorder for F {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        self(row)
    }
}

/// Pair of recorders. Both get every row, and either may end the run.
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

/// Values of one tick. Arrays are padded from the order of the plant to [`MAX_ORDER`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time of the tick, s.
    pub t_s: f64,
    /// True state of the plant.
    pub x: [f64; MAX_ORDER],
    /// Reference of the output, or 0 without a reference.
    pub r: f64,
    /// Control demanded by the controller.
    pub u: f64,
    /// Control u held until the next tick.
    pub u_held: f64,
    /// Sliding variable σ.
    pub sigma: f64,
    /// Sliding variable σ* without its offset.
    pub sigma_star: f64,
    /// True lumped disturbances, with `u_held`.
    pub d: [f64; MAX_ORDER],
    /// Disturbance estimates, 0 in channels without observer.
    pub d_hat: [f64; MAX_ORDER],
    /// Status flags.
    pub health: Health,
}

/// Ending of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// The run reached its end.
    Finished,
    /// The state diverged at this time.
    Diverged {
        /// Time, s.
        t_s: f64,
    },
    /// The run was interrupted at this time.
    Interrupted {
        /// Time, s.
        t_s: f64,
    },
    /// From this time on the plant could not be integrated or the controller could not be reached.
    BrokenOff {
        /// Time, s.
        t_s: f64,
    },
}

impl Ending {
    /// Returns the word of the ending in JSON.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Diverged { .. } => "diverged",
            Self::Interrupted { .. } => "interrupted",
            Self::BrokenOff { .. } => "broken off",
        }
    }

    /// Returns the time of the ending, s; `None` at the end of the run.
    pub const fn at_s(self) -> Option<f64> {
        match self {
            Self::Finished => None,
            Self::Diverged { t_s } | Self::Interrupted { t_s } | Self::BrokenOff { t_s } => Some(t_s),
        }
    }
}

/// All rows of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Plant order n.
    pub order: usize,
    /// Observed channels, from 0.
    pub observed: Vec<usize>,
    /// Index of the state that follows a reference, from 0. `None` for a controller that regulates to rest.
    pub follows: Option<usize>,
    /// Period, s.
    pub period_s: f64,
    /// Rows, one per tick, k = 0..=K.
    pub rows: Vec<Row>,
    /// Ending of the run. `Finished` before it begins.
    pub ending: Ending,
}

impl Trace {
    /// Returns the tracking error y - r of a row, or y without a reference.
    pub fn error(&self, row: &Row) -> f64 {
        row.x[self.follows.unwrap_or(0)] - row.r
    }

    /// Returns the names of the columns of the trace as a table: the numbers of a row, then `health`. States with a
    /// name and a unit have them in place of `x1`, `x2`, ..
    pub fn columns(&self, states: &[(&str, &str)]) -> Vec<String> {
        let per_channel = |name: &'static str| (1..=self.states()).map(move |i| format!("{name}{i}"));
        let mut names = vec!["t_s".to_owned()];
        let column = |&(name, unit): &(&str, &str)| format!("{name}_{unit}").replace([' ', '/'], "_").to_lowercase();
        names.extend(states.iter().take(self.states()).map(column));
        names.extend(per_channel("x").skip(states.len()));
        if self.follows.is_some() {
            names.extend(["r", "error"].map(str::to_owned));
        }
        names.extend(["u", "u_held", "sigma", "sigma_star"].map(str::to_owned));
        names.extend(per_channel("d"));
        names.extend(self.estimated().map(|i| format!("d_hat{}", i + 1)));
        names.push("health".to_owned());
        names
    }

    /// Returns the numbers of a row in the order of the [`columns`](Self::columns), without `health`.
    pub fn values<'a>(&'a self, row: &'a Row) -> impl Iterator<Item = f64> + 'a {
        let n = self.states();
        std::iter::once(row.t_s)
            .chain(row.x[..n].iter().copied())
            .chain(self.follows.map(|_| [row.r, self.error(row)]).into_iter().flatten())
            .chain([row.u, row.u_held, row.sigma, row.sigma_star])
            .chain(row.d[..n].iter().copied())
            .chain(self.estimated().map(|i| row.d_hat[i]))
    }

    fn states(&self) -> usize {
        self.order.min(MAX_ORDER)
    }

    fn estimated(&self) -> impl Iterator<Item = usize> + '_ {
        self.observed.iter().copied().filter(|&i| i < self.states())
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
