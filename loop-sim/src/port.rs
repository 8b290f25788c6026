//! The controller, wherever it runs: in this process, as the baseline of reference \[1\], or, by a [`ControllerPort`]
//! of another crate, at the far end of a wire. [`drive`] is another law, which reads encoders and plays a reference.

use std::fmt;
use std::time::Duration;

use crate::MAX_ORDER;
use controller_core::{Health, MAX_R};

pub mod baseline;
pub mod compared;
pub mod drive;
pub mod finer;
pub mod in_process;

/// What one tick returns; every `f32` of a controller is exact in these `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Control demanded.
    pub u: f64,
    /// σ, Eq. (44).
    pub sigma: f64,
    /// σ*, Eq. (17).
    pub sigma_star: f64,
    /// Estimates [d_hat, d_hat', d_hat''] of channels 1..n; 0 where there is no observer, or beyond its order.
    pub estimates: [[f64; MAX_R]; MAX_ORDER],
    /// Trouble, if any.
    pub health: Health,
}

impl Tick {
    /// d_hat_1..d_hat_n.
    pub fn d_hat(&self) -> [f64; MAX_ORDER] {
        self.estimates.map(|[d_hat, ..]| d_hat)
    }
}

/// Why a port could not tick. A controller in process never fails; one behind a wire may.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PortError {
    /// The wire broke.
    Broken(String),
    /// No answer in time.
    Silent {
        /// What was asked.
        asked: String,
        /// Bytes that came meanwhile and were no answer.
        heard: u64,
        /// How long it was waited for.
        within: Duration,
    },
    /// The target said no; in words.
    Refused(String),
    /// Two controllers that should agree to the last bit do not.
    Differs(Difference),
}

impl fmt::Display for PortError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Broken(why) | Self::Refused(why) => f.write_str(why),
            Self::Silent { asked, heard, within } => {
                write!(f, "no answer to {asked} within {} s", within.as_secs_f64())?;
                if *heard > 0 { write!(f, ", but {heard} bytes that are none") } else { Ok(()) }
            }
            Self::Differs(difference) => difference.fmt(f),
        }
    }
}

impl std::error::Error for PortError {}

/// An output of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// u.
    U,
    /// The sliding variable σ.
    Sigma,
    /// σ without its offset, σ*.
    SigmaStar,
    /// The flags of trouble.
    Health,
    /// An estimate, or a derivative of it.
    Estimate {
        /// Channel, from 1.
        channel: usize,
        /// 0 for d_hat itself.
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

/// The first output that is not the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Tick, from 0.
    pub tick: u64,
    /// Which output differs.
    pub field: Field,
    /// Its f32 bits elsewhere (health: its flags).
    pub there: u32,
    /// Its f32 bits in this process.
    pub here: u32,
}

impl Difference {
    /// How many bits differ.
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

/// A controller at the end of a wire of any length.
pub trait ControllerPort: Send {
    /// One sample in, one control out. The first good sample starts the controller.
    ///
    /// # Errors
    /// When the controller could not be reached.
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError>;

    /// What the actuator really holds since the last tick.
    fn report_applied(&mut self, u: f64);

    /// Forgets every sample: the next good one starts the controller anew.
    ///
    /// # Errors
    /// When the controller could not be reached.
    fn reset(&mut self) -> Result<(), PortError>;

    /// Numbers (from 0) of the channels that carry an observer.
    fn observed(&self) -> &[usize];

    /// The state (from 0) that follows a reference; none for a law that holds rest.
    fn follows(&self) -> Option<usize> {
        None
    }

    /// Where that state should have been at the last tick; NaN before there is a plan, 0 without a reference.
    fn reference(&self) -> f64 {
        0.0
    }

    /// Tells one design from another: over everything that changes what an exported controller, its monitors, its gate
    /// or its encoders do. None for a controller that has no such number.
    fn fingerprint(&self) -> Option<u32> {
        None
    }
}
