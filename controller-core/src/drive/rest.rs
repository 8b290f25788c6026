//! Shaft at rest in friction: a rest band around a resting target, within which the position error does not count.
//!
//! Friction holds a shaft at an error $e \ne 0$. The observer sees no speed and takes the current command as a
//! disturbance, so u grows by $K \int e$ until the shaft breaks away. Static friction exceeds Coulomb friction: the
//! shaft slips past its target, sticks on the other side, and so on (stick-slip, hunting). A current that holds a stuck
//! shaft need not change: with $e = 0$ in the surface, u stays constant.
//!
//! So [`RestBand::place`] moves a resting target to the position of the shaft, by at most the width ε of the band:
//!
//! $$ r \leftarrow r + h \thinspace \mathrm{band}(p - r), \qquad h \leftarrow h + (1 - e^{-w_o T}) (1 - h) $$
//!
//! $\mathrm{band}(e)$ is e within the band. Outside of the band it decreases to 0, as
//! $\pm(\varepsilon - (|e| - \varepsilon)/4)$, and is 0 from 5 ε on. So the drive reacts to a load as without a band.
//!
//! Only the target of the tick changes: limits, observers and recovery work as for any target. A moving target passes
//! through bit for bit, and the band restarts. At that moment u may step by the effect of an error of the band's width.
//! The observer sees a load as before.
//!
//! * ε starts at the effect of one count or of 0.1 % of the torque on the error, whichever is larger:
//!   $\varepsilon_0 = \max(\mathrm{count}, \thinspace 0.001 \thinspace b u_{max}/w_o^2)$.
//! * The band learns from slips. A slip means that the shaft stands outside the band, moves faster than the standstill
//!   speed, and then stands on the other side. The band widens to 5/4 of the error at which the shaft stands, by half
//!   at least. The largest width is the larger of two limits: 2 % of the torque, and six counts (limited to 5 % of the
//!   torque). The band reaches it in at most eight increments.
//! * The band resets when the error exceeds three times the widest band plus a count: the cause is a load, not a slip.
//!
//! A shaft within the backlash of a gear never stands. If it swings instead, lower gains apply while the target rests
//! (module `lower`). Call [`RestBand::calm`] after a tick: it gives the output u for this case.
//!
//! # Limitations
//! From a stuck shaft, friction and a load that changes its direction look alike. So the band also widens under such a
//! load, and the shaft yields by at most the widest band.
//!
//! ```
//! use controller_core::Limits;
//! use controller_core::drive::{Encoder, Motor, MotorDesign, Resting, RestLearning, Target};
//! # use controller_core::drive::DriveEstimates;
//!
//! const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
//! const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
//! let band = DESIGN.rest_band(RestLearning::On);
//! let mut resting = Resting::START;
//! # let known = |p| DriveEstimates { turn: 0, position: [p], speed: [0.0], disturbance: [0.0], load: [0.0] };
//! let at = |angle| Target { turn: 0, jet: [angle, 0.0] };
//! for _ in 0..100 {
//!     // Half a count from its target, and the target comes to it.
//!     let (mut begin, mut end) = (at(1.0), at(1.0));
//!     band.place(&mut resting, Some(&known(1.0002)), &mut begin, &mut end);
//! #   if resting.share() > 0.999 { assert!((begin.jet[0] - 1.0002).abs() < 1e-6 && begin == end); }
//! }
//! // A target that moves is let be.
//! let (mut begin, mut end) = (at(1.0), at(1.1));
//! band.place(&mut resting, Some(&known(1.0002)), &mut begin, &mut end);
//! assert_eq!((begin, end), (at(1.0), at(1.1)));
//! ```

use core::f32::consts::TAU;

use super::law::DriveEstimates;
use super::lower::{LowerGains, Swing};
use super::monitor::{Monitored, Watched};
use super::motor::decay;
use super::target::Target;
use crate::controller::Output;
use crate::health::Health;
use crate::running::{ControlLaw, Running, Words, next};

/// Learning of a rest band: may the band widen when the shaft slips, and may the gains sink when it swings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RestLearning {
    /// The band keeps its first width and its gains.
    Off,
    /// The band may widen to 2 % of the torque, or to six counts (limited to 5 % of the torque) if these are more. The
    /// gains may sink to an eighth of the bandwidth.
    On,
}

/// Rest band of a drive, computed by rule from its design ([`MotorDesign::rest_band`](super::MotorDesign::rest_band)).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RestBand {
    /// Encoder resolution, rad per count.
    count: f32,
    /// Initial and largest width, to either side, rad.
    least: f32,
    most: f32,
    /// Rise of the share per tick, 1 - e^(-w_o T).
    rise: f32,
    /// Standstill speed, rad/s, and number of ticks below it until the shaft counts as standing.
    slow: f32,
    stands: f32,
    lower: Option<LowerGains>,
}

/// Shares of the torque for the initial and the widest band, and the standstill speed relative to $w_o$.
const LEAST: f64 = 0.001;
const MOST: f64 = 0.02;
const SLOW: f64 = 0.00125;
/// Counts that the widest band has at least, limited to this share of the torque.
const MOST_COUNTS: f64 = 6.0;
const COARSE: f64 = 0.05;
/// Time until a shaft counts as standing, in time constants of the observer.
const STANDS: f64 = 3.0;
/// Smallest growth of the band per slip.
const GROWTH: f32 = 1.5;
/// Ratio of the new width to the error at standstill: the next slip may be longer.
const SPARE: f32 = 1.25;
/// Error that counts as a load, in widths of the widest band.
const LOAD: f32 = 3.0;

/// State of a rest band from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resting {
    share: f32,
    /// Width to either side, rad. 0 means the initial width.
    width: f32,
    /// Side on which the shaft last stood outside the band: -1, 1, or 0 for neither.
    side: f32,
    stood: f32,
    /// Error at the last standstill, rad.
    anchor: f32,
    /// 1 if the shaft has moved faster than the standstill speed since it last stood outside the band, else 0.
    slipped: f32,
    /// Revolution and angle of the last target.
    turn: i32,
    angle: f32,
    swing: Swing,
}

/// Flags that suspend lower gains: the drive brakes, or the position of its shaft is uncertain.
const OUT_OF_USE: Health = Health::BRAKES.union(Health::WAITS).union(Health::INPUT_REJECTED);

impl Resting {
    /// State for a moving target, and before the drive starts.
    pub const START: Self = Self {
        share: 0.0,
        width: 0.0,
        side: 0.0,
        stood: 0.0,
        anchor: 0.0,
        slipped: 0.0,
        turn: 0,
        angle: 0.0,
        swing: Swing::NONE,
    };

    /// Returns the share h of the band in use, 0 to 1.
    pub const fn share(&self) -> f32 {
        self.share
    }

    /// Returns the error of the shaft from its resting target, rad.
    fn error<const E: usize>(&self, known: &DriveEstimates<f32, i32, E>) -> f32 {
        known.position[0] - (self.turn.wrapping_sub(known.turn) as f32 * TAU + self.angle)
    }

    /// Returns true if lower gains are in use because the shaft swung.
    pub const fn is_lowered(&self) -> bool {
        self.swing.is_lowered()
    }

    /// Returns the state as words, for logs.
    ///
    /// The words of the band are h, the width (0 is the initial width), the side, ticks and error at the last
    /// standstill. Then follow the slip flag, and the revolution and the angle of the target. The words of the swing
    /// are the mean of u, the side of u relative to the mean, and the reversals. The last words are the lower gain set
    /// in use, its ticks, returns, and its q, v, d and u.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let Self { share, width, side, stood, anchor, slipped, turn, angle, swing } = *self;
        let rest = [share, width, side, stood, anchor, slipped].map(f32::to_bits);
        rest.into_iter().chain([turn as u32, angle.to_bits()]).chain(swing.words())
    }

    /// Returns the state of these [`words`](Self::words), or `None` if there are too few or a number is not finite.
    pub fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let [share, width, side, stood, anchor, slipped] = Words::from_words(words)?;
        let turn = words.next()? as i32;
        Some(Self {
            share,
            width,
            side,
            stood,
            anchor,
            slipped,
            turn,
            angle: next(words)?,
            swing: Swing::from_words(words)?,
        })
    }
}

impl RestBand {
    /// Builds the band from the count in rad, b, the largest u, and the observer bandwidth.
    pub(crate) const fn of(
        count: f64,
        [gain, u_max]: [f64; 2],
        omega: f64,
        period_s: f64,
        learning: RestLearning,
    ) -> Self {
        let largest = gain.abs() * u_max;
        let error = largest / (omega * omega);
        let least = if LEAST * error > count { LEAST * error } else { count };
        let counts = if MOST_COUNTS * count < COARSE * error { MOST_COUNTS * count } else { COARSE * error };
        let widest = if MOST * error > counts { MOST * error } else { counts };
        let most = match learning {
            RestLearning::On if widest > least => widest,
            _ => least,
        };
        // Rounded up. The value has no meaning for a bandwidth that every design rejects.
        let constants = STANDS / (omega * period_s);
        let whole = constants as u32 as f64;
        let stands = if whole < constants { whole + 1.0 } else { whole };
        Self {
            count: count as f32,
            least: least as f32,
            most: most as f32,
            rise: decay(omega * period_s) as f32,
            slow: (SLOW * largest / omega) as f32,
            stands: stands as f32,
            lower: match learning {
                RestLearning::On => Some(LowerGains::of(gain, u_max, omega, period_s, most as f32)),
                RestLearning::Off => None,
            },
        }
    }

    /// Returns the thresholds of a tick.
    ///
    /// They are: one count, initial and largest width, rise of the share, speed and ticks of standstill, the error of a
    /// load, half a count.
    pub const fn thresholds(&self) -> [f32; 8] {
        let Self { count, least, most, rise, slow, stands, .. } = *self;
        [count, least, most, rise, slow, stands, LOAD * most + count, 0.5 * count]
    }

    /// Returns the gains that apply when the shaft swings.
    pub const fn lower_gains(&self) -> Option<&LowerGains> {
        self.lower.as_ref()
    }

    /// Returns the thresholds and gains of a tick, as words for a fingerprint.
    pub(super) fn words(&self) -> impl Iterator<Item = u32> {
        let lower = self.lower.iter().flat_map(|lower| {
            let (numbers, [first, second]) = lower.numbers();
            numbers.into_iter().chain(first).chain(second)
        });
        self.thresholds().into_iter().chain(lower).map(f32::to_bits)
    }

    /// Returns the present width to either side of the target, rad.
    pub fn width(&self, state: &Resting) -> f32 {
        if state.width > self.least { state.width } else { self.least }
    }

    /// Moves a resting target to the shaft, within the band. Sets [`Health::HUNTS`] if the band has widened.
    ///
    /// Call it before a tick, with the estimates after the last tick, or `None` before the drive has started.
    #[inline]
    pub fn place<const E: usize, const N: usize>(
        &self,
        state: &mut Resting,
        known: Option<&DriveEstimates<f32, i32, E>>,
        begin: &mut Target<f32, i32, N>,
        end: &mut Target<f32, i32, N>,
    ) -> Health {
        let stays = *begin == *end && (begin.turn, begin.jet[0]) == (state.turn, state.angle);
        let rests = stays && begin.jet[1..].iter().all(|&derivative| derivative == 0.0);
        let Some(known) = known.filter(|_| rests) else {
            if state.share > 0.0 {
                *state = Resting::START;
            }
            (state.turn, state.angle) = (end.turn, end.jet[0]);
            return Health::OK;
        };
        let error = state.error(known);
        if state.is_lowered() {
            // With lower gains the law must stay idle: it sees the shaft at its target.
            begin.jet[0] += error;
            if N > 1 {
                begin.jet[1] = known.speed[0];
            }
            *end = *begin;
            return Health::HUNTS;
        }
        let shift = self.shift(state, error, known.speed[0]);
        begin.jet[0] += shift;
        end.jet[0] = begin.jet[0];
        Health::HUNTS.when(state.width > self.least)
    }

    /// Replaces the output by lower gains if the shaft swings at rest. Sets [`Health::HUNTS`] in this case.
    ///
    /// Call it after the tick of a drive whose target this band has [placed](Self::place).
    pub fn calm<L, const E: usize>(
        &self,
        state: &mut Resting,
        running: &mut Running<Monitored<L, E>>,
        output: &mut Output<f32>,
    ) where
        L: Watched<E> + ControlLaw<Scalar = f32, Estimates = DriveEstimates<f32, i32, E>>,
    {
        let Some(lower) = &self.lower else { return };
        // A share of 0 means a moving target.
        if state.share == 0.0 || output.health.contains(Health::STOPPED) {
            return;
        }
        let Some(known) = running.estimates().filter(|_| !output.health.intersects(OUT_OF_USE)) else {
            state.swing = Swing::NONE;
            return;
        };
        let seen = [state.error(&known), known.speed[0]];
        let Some(asked) = lower.answer(&mut state.swing, seen, output.u) else { return };
        let u = running.put_instead(asked);
        state.swing.went_out(u);
        output.u = u;
        output.health = output.health.without(Health::SATURATED).union(Health::SATURATED.when(u != asked));
        output.health |= Health::HUNTS;
    }

    /// Returns the shift of the target at this error, rad. An error that is not a number shifts nothing.
    fn shift(&self, state: &mut Resting, error: f32, speed: f32) -> f32 {
        let [count, least, most, rise, slow, stands, load, half] = self.thresholds();
        let (mut width, is_slow) = (self.width(state), speed.abs() < slow);
        let (away, is_near) = (error.abs(), (error - state.anchor).abs() <= count);
        state.share += rise * (1.0 - state.share);
        if !(is_slow || is_near) {
            (state.stood, state.slipped) = (0.0, 1.0);
        } else if state.stood < stands {
            state.stood += 1.0;
        } else {
            state.stood = stands;
        }
        if is_slow || !is_near {
            state.anchor = error;
        }
        if away > load {
            (width, state.side) = (least, 0.0);
        }
        let stands_at = state.anchor.abs();
        if state.stood >= stands && stands_at > width {
            let side = if state.anchor > 0.0 { 1.0 } else { -1.0 };
            if side * state.side * state.slipped < 0.0 {
                let (grown, here) = (GROWTH * width, SPARE * stands_at + half);
                let wanted = if here > grown { here } else { grown };
                width = if wanted < most { wanted } else { most };
            }
            (state.side, state.slipped) = (side, 0.0);
        }
        state.width = width;
        // Further out the shift decreases: the drive reacts to a load as without a band.
        let left = width - 0.25 * (away - width);
        let within = if away <= width {
            error
        } else if left > 0.0 {
            if error > 0.0 { left } else { -left }
        } else {
            0.0
        };
        state.share * within
    }
}
