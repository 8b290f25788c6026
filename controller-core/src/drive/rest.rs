//! A shaft at rest in friction: within a band around a target that rests, its position error does not count.
//!
//! Friction holds a shaft at an error $e \ne 0$. The observer sees no speed and takes what u asks for as a disturbance,
//! so u grows by $K \int e$ until the shaft breaks away. Static friction is above Coulomb friction: it slips past
//! its target, sticks on the other side, and so on (stick-slip, hunting). A current that holds a stuck shaft need not
//! change: with $e = 0$ in the surface u stays what it is.
//!
//! So [`RestBand::place`] moves a target that rests to where the shaft is, by at most the width ε of the band:
//!
//! $$ r \leftarrow r + h \thinspace \mathrm{band}(p - r), \qquad h \leftarrow h + (1 - e^{-w_o T}) (1 - h) $$
//!
//! $\mathrm{band}(e)$ is e within the band. Outside it goes back to 0, as $\pm(\varepsilon - (|e| - \varepsilon)/4)$,
//! and is 0 from 5 ε on: a load is answered as without a band.
//!
//! The tick then has another target and nothing else: limits, observers and recovery are what they are for any target.
//! A target that moves is handed on as it is, bit for bit, and the band begins anew: there u may step by as much as an
//! error of the width makes. The observer sees a load as before.
//!
//! * ε begins with what one count or 0.1 % of the torque does to the error, whichever is more:
//!   $\varepsilon_0 = \max(\mathrm{count}, \thinspace 0.001 \thinspace b u_{max}/w_o^2)$.
//! * It learns from slips: the shaft stands outside the band, moves faster than one that stands, and stands on the
//!   other side. The band then widens to 5/4 of where it stands, by half at least, up to 2 % of the torque or six
//!   counts (if these are no more than 5 % of the torque), whichever is more. That takes eight steps at most.
//! * It forgets as soon as the error is more than three times the widest band and a count: that is a load, and no slip.
//!
//! A shaft in the play of a gear never stands. Where it swings instead, lower gains take over while the target rests
//! (module `lower`): [`RestBand::calm`] after a tick says which u goes out then.
//!
//! A shaft that is stuck cannot tell friction from a load that changes its direction: under one the band widens too,
//! and the shaft gives way by at most the widest band.
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
use crate::running::{ControlLaw, Running};

/// May a drive become slacker at rest: its band widen where a shaft slips from one side of its target to the other, its
/// gains sink where it swings around it?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RestLearning {
    /// It keeps its first width and its gains.
    Off,
    /// To 2 % of the torque, or six counts if these are at most 5 %; and gains for an eighth of the bandwidth.
    On,
}

/// The band of a drive, by rule from its design ([`MotorDesign::rest_band`](super::MotorDesign::rest_band)).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RestBand {
    /// One step of the encoder, rad.
    count: f32,
    /// Width at the beginning and at most, to either side, rad.
    least: f32,
    most: f32,
    /// 1 - e^(-w_o T).
    rise: f32,
    /// Below this speed it stands, rad/s, and it stands after so many ticks.
    slow: f32,
    stands: f32,
    lower: Option<LowerGains>,
}

/// Of the torque: what the error may be within the band, and within the widest one; and the speed of a shaft that
/// stands, over $w_o$.
const LEAST: f64 = 0.001;
const MOST: f64 = 0.02;
const SLOW: f64 = 0.00125;
/// The widest band is at least so many counts, where these are no more than this part of the torque.
const MOST_COUNTS: f64 = 6.0;
const COARSE: f64 = 0.05;
/// Time constants of the observer until a shaft stands.
const STANDS: f64 = 3.0;
/// A band widens by this at least.
const GROWTH: f32 = 1.5;
/// And to so much of where the shaft stands: the next slip may be longer.
const SPARE: f32 = 1.25;
/// An error of so many of the widest bands is a load.
const LOAD: f32 = 3.0;

/// What a band remembers from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resting {
    share: f32,
    /// To either side, rad; 0 is the least width.
    width: f32,
    /// On which side it last stood outside the band: -1, 1, or 0 for neither.
    side: f32,
    stood: f32,
    /// Its error where it last stood.
    anchor: f32,
    /// 1 once it has moved faster than a shaft that stands, since it last stood outside the band; else 0.
    slipped: f32,
    /// Where the target was.
    turn: i32,
    angle: f32,
    swing: Swing,
}

/// Nothing is calmed where the drive brakes, or is not sure where its shaft is.
const OUT_OF_USE: Health = Health::BRAKES.union(Health::WAITS).union(Health::INPUT_REJECTED);

impl Resting {
    /// While the target moves, and before the drive starts.
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

    /// h, 0 to 1: how much of the band is in use.
    pub const fn share(&self) -> f32 {
        self.share
    }

    /// Of a shaft whose target rests, rad.
    fn error<const E: usize>(&self, known: &DriveEstimates<f32, i32, E>) -> f32 {
        known.position[0] - (self.turn.wrapping_sub(known.turn) as f32 * TAU + self.angle)
    }

    /// Are lower gains in use, because the shaft swung?
    pub const fn is_lowered(&self) -> bool {
        self.swing.is_lowered()
    }

    /// All of it as words, for logs: h, the width (0 is the least), the side, ticks and error where it last stood,
    /// whether it has slipped since, and the turn and the angle of the target. Then mean of u, on which side of it u
    /// was, reversals, which of the lower sets is in use, its ticks, returns, and its q, v, d and u.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let Self { share, width, side, stood, anchor, slipped, turn, angle, swing } = *self;
        let rest = [share, width, side, stood, anchor, slipped].map(f32::to_bits);
        rest.into_iter().chain([turn as u32, angle.to_bits()]).chain(swing.words())
    }
}

impl RestBand {
    /// For an encoder of this step, rad, b, the largest u, and the bandwidth of the observer.
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
        // Rounded up; of a bandwidth that no design takes any number.
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

    /// What a tick compares with: a step of the encoder, least and largest width, rise of the share, speed and ticks of
    /// a shaft that stands, the error of a load, half a step.
    pub const fn thresholds(&self) -> [f32; 8] {
        let Self { count, least, most, rise, slow, stands, .. } = *self;
        [count, least, most, rise, slow, stands, LOAD * most + count, 0.5 * count]
    }

    /// The gains that take over where the shaft swings.
    pub const fn lower_gains(&self) -> Option<&LowerGains> {
        self.lower.as_ref()
    }

    /// What a tick compares with and multiplies by, as words for a fingerprint.
    pub(super) fn words(&self) -> impl Iterator<Item = u32> {
        let lower = self.lower.iter().flat_map(|lower| {
            let (numbers, [first, second]) = lower.numbers();
            numbers.into_iter().chain(first).chain(second)
        });
        self.thresholds().into_iter().chain(lower).map(f32::to_bits)
    }

    /// The present width to either side of the target, rad.
    pub fn width(&self, state: &Resting) -> f32 {
        if state.width > self.least { state.width } else { self.least }
    }

    /// Moves a target that rests to the shaft, within the band. Call it before a tick with what the drive knew after
    /// the last one, `None` before it has started. [`Health::HUNTS`] where the band has widened.
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
            // The law has nothing to do: it is at its target.
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

    /// After the tick of a drive in front of which this band has [placed](Self::place) its target: where the shaft
    /// swings at rest, lower gains say what goes out instead. [`Health::HUNTS`] then.
    pub fn calm<L, const E: usize>(
        &self,
        state: &mut Resting,
        running: &mut Running<Monitored<L, E>>,
        output: &mut Output<f32>,
    ) where
        L: Watched<E> + ControlLaw<Scalar = f32, Estimates = DriveEstimates<f32, i32, E>>,
    {
        let Some(lower) = &self.lower else { return };
        // A share of 0 is a target that moves.
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

    /// By how much a target at this error moves; an error that is no number moves nothing.
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
        // Further out less and less of it: a load is answered as without a band.
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
