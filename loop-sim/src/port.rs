//! Controller ports: the controller in this process, the baseline of reference \[1\], or a controller on a target.
//! Other crates implement [`ControllerPort`] for a target behind a serial link. [`drive`] is the controller that reads
//! encoders and follows a reference.

use std::fmt;
use std::time::Duration;

use crate::MAX_ORDER;
use controller_core::{Health, MAX_R};

pub mod baseline;
pub mod compared;
pub mod drive;
pub mod finer;
pub mod in_process;
pub(crate) mod numbers;

/// Output of one tick. Every `f32` of a controller is exact in these `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Demanded control u.
    pub u: f64,
    /// Sliding variable σ, Eq. (44).
    pub sigma: f64,
    /// Sliding variable without its offset σ*, Eq. (17).
    pub sigma_star: f64,
    /// Estimates [d_hat, d_hat', d_hat''] of channels 1..n. 0 where there is no observer, or beyond its order.
    pub estimates: [[f64; MAX_R]; MAX_ORDER],
    /// Status flags.
    pub health: Health,
}

impl Tick {
    /// Returns d_hat_1..d_hat_n.
    pub fn d_hat(&self) -> [f64; MAX_ORDER] {
        self.estimates.map(|[d_hat, ..]| d_hat)
    }
}

/// Cause of a failed tick. A controller in this process never fails. A controller behind a serial link can fail.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PortError {
    /// The link broke. Contains a message.
    Broken(String),
    /// No answer in time.
    Silent {
        /// Request without an answer.
        asked: String,
        /// Number of received bytes that are not an answer.
        heard: u64,
        /// Waiting time.
        within: Duration,
    },
    /// The target refused the request. Contains the reason.
    Refused(String),
    /// Two controllers that must be bit-identical differ.
    Differs(Difference),
}

impl fmt::Display for PortError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Broken(why) | Self::Refused(why) => f.write_str(why),
            Self::Silent { asked, heard, within } => {
                write!(f, "no answer to {asked} within {} s", within.as_secs_f64())?;
                if *heard > 0 { write!(f, ", but {heard} other bytes") } else { Ok(()) }
            }
            Self::Differs(difference) => difference.fmt(f),
        }
    }
}

impl std::error::Error for PortError {}

/// Output of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Demanded control u.
    U,
    /// Sliding variable σ.
    Sigma,
    /// Sliding variable σ* without its offset.
    SigmaStar,
    /// Status flags.
    Health,
    /// Disturbance estimate or one of its derivatives.
    Estimate {
        /// Index of the channel, from 1.
        channel: usize,
        /// Order of the derivative, 0 for d_hat itself.
        derivative: usize,
    },
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::U => f.write_str("u"),
            Self::Sigma => f.write_str("sigma"),
            Self::SigmaStar => f.write_str("sigma*"),
            Self::Health => f.write_str("health"),
            Self::Estimate { channel, derivative } => write!(f, "d_hat_{channel}{}", "'".repeat(*derivative)),
        }
    }
}

/// First output in which two controllers differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Index of the tick, from 0.
    pub tick: u64,
    /// Output that differs.
    pub field: Field,
    /// Value on the target as f32 bits, or the flags for `Health`.
    pub there: u32,
    /// Value in this process as f32 bits, or the flags for `Health`.
    pub here: u32,
}

impl Difference {
    /// Returns the number of bits that differ.
    pub const fn bits(&self) -> u32 {
        (self.there ^ self.here).count_ones()
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, field, there, here } = *self;
        let value =
            |bits| if field == Field::Health { String::new() } else { format!(" ({:e})", f32::from_bits(bits)) };
        write!(f, "tick {tick}: {field} differs: {there:#010x}{} on the target", value(there))?;
        write!(f, ", {here:#010x}{} here", value(here))
    }
}

/// Controller in this process or on a target.
pub trait ControllerPort: Send {
    /// Runs one tick: one sample in, one control out. The first valid sample starts the controller.
    ///
    /// # Errors
    /// Fails if the controller cannot be reached.
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError>;

    /// Reports the value that the actuator has held since the last tick.
    fn report_applied(&mut self, u: f64);

    /// Reports that `periods` periods have passed without a tick. A controller without a plant model has nothing to do.
    fn missed(&mut self, periods: u32) {
        let _ = periods;
    }

    /// Clears the state. The next valid sample starts the controller again.
    ///
    /// # Errors
    /// Fails if the controller cannot be reached.
    fn reset(&mut self) -> Result<(), PortError>;

    /// Returns the state as numbers, exact to the bit and of one length. Empty for a controller that does not show it.
    fn state(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Restores a [`state`](Self::state). Returns `false` for numbers that are not a state of this controller.
    fn set_state(&mut self, numbers: &[f64]) -> bool {
        numbers.is_empty()
    }

    /// Returns the indices, from 0, of the channels with an observer.
    fn observed(&self) -> &[usize];

    /// Returns the index, from 0, of the state that follows a reference. `None` for a controller that regulates to
    /// rest.
    fn follows(&self) -> Option<usize> {
        None
    }

    /// Returns the reference of that state at the last tick. NaN before there is a plan, 0 without a reference.
    fn reference(&self) -> f64 {
        0.0
    }

    /// Returns the fingerprint of the design. It covers everything that changes an exported controller, its monitors,
    /// its gate or its encoders. `None` for a controller without a fingerprint.
    fn fingerprint(&self) -> Option<u32> {
        None
    }
}
