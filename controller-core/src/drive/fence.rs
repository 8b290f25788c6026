//! Fence around a shaft: software end stops, a speed limit, and a limit of the following error.
//!
//! The fence checks the estimates after a tick. A brake needs at most $v^2/(2 a) + |v| \thinspace (1/k_v + 2 T)$ to
//! come to rest from the speed $v$. Here $a$ is the guaranteed deceleration at the limit, $k_v$ is the gain of the
//! brake ([`Bounds::brake_per_s`](super::Bounds)), and the brake acts after two ticks. If the distance to an end is
//! smaller, the fence [trips](crate::Running::trip) the drive.
//!
//! A shaft that follows its target may come closer, as long as the target itself can come to rest before the end, by
//! $v_r^2/(2 a)$. Such a shaft can move up to the end, and rests there.
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

/// Flags that a fence sets. Each is an alarm.
pub const FENCED: Health = Health::OVERSPEED.union(Health::FOLLOWING_ERROR).union(Health::END_OF_RANGE);

/// Limits of a fence: range, speed, and distance from the target. Infinite for no limit. For a joint they apply to the
/// link.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FenceLimits {
    /// Lower end of the range, rad from angle 0.
    pub low_rad: f64,
    /// Upper end of the range, rad from angle 0.
    pub high_rad: f64,
    /// Largest speed, rad/s.
    pub max_speed_rad_s: f64,
    /// Largest distance from the target, rad.
    pub following_rad: f64,
}

impl FenceLimits {
    /// Limits of a fence without any limit.
    pub const NONE: Self = Self {
        low_rad: f64::NEG_INFINITY,
        high_rad: f64::INFINITY,
        max_speed_rad_s: f64::INFINITY,
        following_rad: f64::INFINITY,
    };
}

/// Braking model of a drive, by rule from [`MotorDesign::slowing`](super::MotorDesign::slowing) or
/// [`JointDesign::slowing`](super::JointDesign::slowing).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Slowing {
    /// Guaranteed deceleration at the limit of u, rad/s².
    pub deceleration_rad_s2: f64,
    /// Time constant of the brake within the limits plus the ticks until a current acts (at least two), s.
    pub constant_s: f64,
    /// Error of the encoder at rest, rad. The ends lie further out by this.
    pub tolerance_rad: f64,
}

/// Fence with its limits in the form that a tick compares.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    ends: [(i32, f32); 2],
    max_speed: f32,
    following: f32,
    /// Travel to rest per unit of speed, and per unit of its square.
    constant: f32,
    per_square: f32,
    /// Distance by which a following shaft may be ahead of its target.
    slack: f32,
}

/// Value for no limit, beyond the range of any shaft.
const NO_LIMIT: f32 = 1e30;

impl Fence {
    /// Returns the fence for a drive with this braking model.
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

    /// Returns the thresholds of a tick.
    ///
    /// They are the ends as revolutions and remainder, the largest speed, and the following error. Then follow the
    /// travel to rest per unit of speed and of its square, and the slack of a following shaft.
    pub const fn thresholds(&self) -> ([(i32, f32); 2], [f32; 5]) {
        (self.ends, [self.max_speed, self.following, self.constant, self.per_square, self.slack])
    }

    /// Returns the thresholds as words, for a fingerprint.
    pub(super) fn words(&self) -> impl Iterator<Item = u32> {
        let [low, high] = self.ends;
        let numbers = [low.1, high.1, self.max_speed, self.following, self.constant, self.per_square, self.slack];
        [low.0 as u32, high.0 as u32].into_iter().chain(numbers.map(f32::to_bits))
    }

    /// Checks a finished tick with the target of its start, and [trips](Running::trip) the drive if a limit is broken.
    /// A drive that waits or has stopped is not checked.
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

    /// Checks a law and its state as [`guard`](Self::guard), if the caller stores them separately.
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
            // A speed reference has no position: the position of the shaft replaces it.
            (target.turn, target.jet[0]) = (known.turn, known.position[0]);
        }
        let broken = self.check(&known, &target);
        output.health |= broken;
        if !broken.is_ok() {
            law.trip(state);
        }
    }

    /// Returns the limits that the estimates break, given the target of their tick. Estimates that are not numbers
    /// break all.
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
        // Only the end in the direction of motion counts: its distance, the lead over the target, the target speed
        // towards it.
        let (left, ahead, target_speed) = if v < 0.0 {
            (-from_here(low.0, low.1), -error, -target.jet[1])
        } else {
            (from_here(high.0, high.1), error, target.jet[1])
        };
        // A plan may use more current than the guaranteed current of a brake.
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
