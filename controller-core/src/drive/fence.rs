//! A fence around a shaft: end stops in software, a top speed, a following error.
//!
//! It looks at the estimates after a tick. What a brake needs to come to rest from the speed $v$ is
//! $v^2/(2 a) + |v| \thinspace (1/k_v + 2 T)$ at most, for the deceleration $a$ that is sure at the limit, the gain
//! $k_v$ of the brake ([`Bounds::brake_per_s`](super::Bounds)) and two ticks until it acts: where less is left to an
//! end, the drive is to [trip](crate::Running::trip) now. A shaft that follows its target is let be as long as the
//! target itself can come to rest before the end, by $v_r^2/(2 a)$: it then goes up to the end, and rests there.
//!
//! ```
//! use controller_core::drive::{Encoder, Fence, FenceLimits, Motor, MotorDesign, Position, MotorDrive};
//! use controller_core::{Health, Limits};
//! # use controller_core::drive::{DriveEstimates, Target};
//!
//! const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
//! const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
//! const WITHIN: FenceLimits = FenceLimits { low_rad: -1.0, high_rad: 20.0, ..FenceLimits::NONE };
//! let fence = Fence::new(&WITHIN, DESIGN.slowing(0));
//! # let known = |speed| DriveEstimates { turn: 3, position: [0.5], speed: [speed], disturbance: [0.0], load: [0.0] };
//! # let target = Target { turn: 3, jet: [0.0, 0.0] };
//! // 0.65 rad before the end, thrown off its target: at 20 rad/s it can still come to rest, at 40 it is time to brake.
//! assert_eq!(fence.check(&known(20.0), &target), Health::OK);
//! assert_eq!(fence.check(&known(40.0), &target), Health::END_OF_RANGE);
//! ```

use core::f64::consts::TAU;

use super::law::{DriveEstimates, DriveLaw};
use super::monitor::{Monitored, Watched};
use super::reference::FARTHEST_RAD;
use super::target::Target;
use crate::controller::Output;
use crate::health::Health;
use crate::running::{ControlLaw, Running};

/// What a fence tells; each of them is an alarm.
pub const FENCED: Health = Health::OVERSPEED.union(Health::FOLLOWING_ERROR).union(Health::END_OF_RANGE);

/// Where a shaft may be, how fast it may turn, and how far it may be from its target; infinite for no limit. Of a joint
/// it is the link.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FenceLimits {
    /// Ends of its range, rad from angle 0.
    pub low_rad: f64,
    /// The upper one.
    pub high_rad: f64,
    /// Top speed, rad/s.
    pub max_speed_rad_s: f64,
    /// Largest distance from the target, rad.
    pub following_rad: f64,
}

impl FenceLimits {
    /// No limit at all.
    pub const NONE: Self = Self {
        low_rad: f64::NEG_INFINITY,
        high_rad: f64::INFINITY,
        max_speed_rad_s: f64::INFINITY,
        following_rad: f64::INFINITY,
    };
}

/// How a drive slows down; by rule [`MotorDesign::slowing`](super::MotorDesign::slowing),
/// [`JointDesign::slowing`](super::JointDesign::slowing).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Slowing {
    /// Deceleration that is sure at the limit of u, rad/s².
    pub deceleration_rad_s2: f64,
    /// Time constant within the limits, and the ticks until a current acts, two at least, s.
    pub constant_s: f64,
    /// What the encoder may be off at rest, rad: the ends are so much further out.
    pub tolerance_rad: f64,
}

/// The limits as a tick compares them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    ends: [(i32, f32); 2],
    max_speed: f32,
    following: f32,
    /// Way to rest over the speed, and over its square.
    constant: f32,
    per_square: f32,
    /// What a shaft that follows its target may be ahead of it.
    slack: f32,
}

/// For no limit: further than any shaft goes.
const NO_LIMIT: f32 = 1e30;

impl Fence {
    /// For a drive that slows down like that.
    pub fn new(limits: &FenceLimits, slowing: Slowing) -> Self {
        let FenceLimits { low_rad, high_rad, max_speed_rad_s, following_rad } = *limits;
        let Slowing { deceleration_rad_s2, constant_s, tolerance_rad } = slowing;
        let end = |angle_rad: f64| {
            if angle_rad.abs() > FARTHEST_RAD {
                return (0, if angle_rad > 0.0 { NO_LIMIT } else { -NO_LIMIT });
            }
            let turn = libm::round(angle_rad / TAU);
            (turn as i32, (angle_rad - turn * TAU) as f32)
        };
        let most = |number: f64| if number < f64::from(NO_LIMIT) { number as f32 } else { NO_LIMIT };
        Self {
            ends: [end(low_rad - tolerance_rad), end(high_rad + tolerance_rad)],
            max_speed: most(max_speed_rad_s),
            following: most(following_rad),
            constant: constant_s as f32,
            per_square: (0.5 / deceleration_rad_s2) as f32,
            slack: (8.0 * tolerance_rad) as f32,
        }
    }

    /// Ends as turns and rest, top speed, following error, way to rest over the speed and over its square, and what a
    /// shaft that follows may be ahead: what a tick compares with.
    pub const fn thresholds(&self) -> ([(i32, f32); 2], [f32; 5]) {
        (self.ends, [self.max_speed, self.following, self.constant, self.per_square, self.slack])
    }

    /// What they are compared with as words, for a fingerprint.
    pub(super) fn words(&self) -> impl Iterator<Item = u32> {
        let [low, high] = self.ends;
        let numbers = [low.1, high.1, self.max_speed, self.following, self.constant, self.per_square, self.slack];
        [low.0 as u32, high.0 as u32].into_iter().chain(numbers.map(f32::to_bits))
    }

    /// Looks at a tick that was made, with the target of its beginning, and [trips](Running::trip) the drive where a
    /// limit is broken. A drive that waits or has stopped is let be.
    pub fn guard<L, const E: usize, const N: usize>(
        &self,
        running: &mut Running<Monitored<L, E>>,
        output: &mut Output<f32>,
        target: &Target<f32, i32, N>,
    ) where
        L: Watched<E> + DriveLaw<E, N>,
    {
        if let Some(state) = &mut running.state {
            self.guard_state(&running.design, state, output, target);
        }
    }

    /// The same of a law and its state, for whoever holds the two apart.
    #[doc(hidden)]
    #[inline]
    pub fn guard_state<L, const E: usize, const N: usize>(
        &self,
        law: &Monitored<L, E>,
        state: &mut <Monitored<L, E> as ControlLaw>::State,
        output: &mut Output<f32>,
        target: &Target<f32, i32, N>,
    ) where
        L: Watched<E> + DriveLaw<E, N>,
    {
        if output.health.intersects(Health::WAITS.union(Health::STOPPED)) {
            return;
        }
        let known = law.estimates(state);
        let mut target = *target;
        if !L::POSITION {
            // A speed is no place: the shaft is where it is.
            (target.turn, target.jet[0]) = (known.turn, known.position[0]);
        }
        let broken = self.check(&known, &target);
        output.health |= broken;
        if !broken.is_ok() {
            law.trip(state);
        }
    }

    /// Which of the limits the estimates break, with the target of their tick; estimates that are no numbers break all.
    #[inline]
    pub fn check<const E: usize, const N: usize>(
        &self,
        known: &DriveEstimates<f32, i32, E>,
        target: &Target<f32, i32, N>,
    ) -> Health {
        let (y, v) = (known.position[0], known.speed[0]);
        let from_here = |turn: i32, rest: f32| turn.wrapping_sub(known.turn) as f32 * TAU as f32 + (rest - y);
        let speed = v.abs();
        let way = speed * (self.constant + self.per_square * speed);
        let error = from_here(target.turn, target.jet[0]);
        let [low, high] = self.ends;
        // Only where it moves to an end that end counts: how far it is, and the target, and how fast that goes there.
        let (left, ahead, target_speed) = if v < 0.0 {
            (-from_here(low.0, low.1), -error, -target.jet[1])
        } else {
            (from_here(high.0, high.1), error, target.jet[1])
        };
        // A plan may take more of the current than a brake is sure of.
        let square = 0.75 * self.per_square * (target_speed * target_speed);
        let target_way = if target_speed > 0.0 { square } else { 0.0 };
        let slack = self.slack + 0.25 * way;
        let follows_within = left - ahead >= target_way && (way <= slack || ahead >= -slack);
        let has_room = left >= way || follows_within;
        let [is_slow, follows] = [speed <= self.max_speed, error.abs() <= self.following];
        Health::OVERSPEED
            .when(!is_slow)
            .union(Health::FOLLOWING_ERROR.when(!follows))
            .union(Health::END_OF_RANGE.when(!has_room))
    }
}
