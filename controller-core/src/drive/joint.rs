//! Flexible joint: a motor drives a link through a spring, with an encoder on each side.
//!
//! $$ \ddot q = k_1 (q_m - q) - b_1 \dot q - g \sin q + d_l, \qquad
//!    \ddot q_m = k_2 (q - q_m) - b_2 \dot q_m + \frac{K_t}{J_m} u + d_m $$
//!
//! with $k_1 = K_s/J_l$, $k_2 = K_s/J_m$ and all angles on the link side of a gear. In
//! $x = (q, \dot q, k_1 q_m, k_1 \dot q_m)$ the input gain is $b = k_1 K_t/J_m$. Each shaft is one block. The link has
//! $\kappa = k_1 + g$, $\lambda = b_1$, $w = x_3 + g (x_1 - \sin x_1)$. The motor has $\kappa = k_2$, $\lambda = b_2$,
//! $w = k_1 k_2 x_1 + b u$. The chain, with $s = g \sin x_1$, $f_1 = -k_1 - g \cos x_1$, $f_2 = -b_1$:
//!
//! $$ z_3 = x_3 - k_1 x_1 - b_1 x_2 - s, \qquad z_4 = x_4 + f_1 x_2 + f_2 z_3, $$
//! $$ a_z = k_1 k_2 x_1 - k_2 x_3 - b_2 x_4 + s x_2^2 + f_1 z_3 + f_2 z_4 $$
//! $$ d^z_2 = d_l, \qquad d^z_3 = f_2 d_l, \qquad d^z_4 = d_m + (f_1 + f_2^2) d_l $$
//!
//! and the gradient of $a_z$ at 0, with $K = k_1 + g$:
//! $(k_1 k_2 - k_2 K,\ -k_2 b_1 - b_2 K,\ -k_2 - b_1 b_2 - K,\ -b_1 - b_2)$.
//!
//! # Bandwidths
//! Three sets are measured: [`JointBandwidths::DEFAULT`], `FIRM`, and `QUIET` for encoders of 12 bits. Sets of your own
//! must stay within the measured range:
//! * The link observer is at least 3 times as fast as the surface.
//! * The motor observer is at least 3.5 times as fast as the link observer.
//! * k_l is 2 to 8 times w_c.
//! * Times the period, the link observer is at most 0.25, and k_l at most 0.3.
//! * Times the period, the motor observer is at most 0.8, or 0.5 with one or two ticks of delay, or 0.4 with three
//!   ([`JointDesign::motor_observer_limit`]).
//!
//! With one gain set the loop was stable within these limits in every corner of the parameter box, ±50 % of all
//! parameters. With a tick of delay, and at 2 ms (motor observer at 300 rad/s), it was stable within ±20 %. At ±50 % it
//! is unstable in four of 32 corners: K_t/J_m -50 % with K/J_l and the motor damping +50 %. The growth is slow (radius
//! 1.001 and 1.01 per tick; test `drive_joint::corners_of_the_joint_are_stable`).
//!
//! With two and three ticks the default set, slowed for them, is stable within ±20 % too (radius 0.991 and 0.993 at 1
//! ms). At ±50 % it is unstable in 8 and 9 of 32 corners (radius 1.005 and 1.012; test
//! `drive_joint::with_two_and_three_ticks_of_delay_a_joint_is_stable_within_20_percent`).
//!
//! ```
//! use controller_core::drive::{Encoder, Joint, JointDesign, JointDrive, Position};
//! use controller_core::{Limits, Running};
//!
//! const DESIGN: JointDesign =
//!     JointDesign::new(1e-3, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
//! type Drive = JointDrive<f32, Position, 1>;
//! static DRIVE: Drive = Drive::design(&DESIGN);
//! let running = Running::new(&DRIVE);
//! # assert!(running.estimates().is_none());
//! ```

use core::f64::consts::TAU;
use core::marker::PhantomData;

use super::block::Block;
use super::chain::ChainModel;
use super::encoder::Encoder;
use super::error::DriveError;
use super::fence::Slowing;
use super::law::{AcceptanceRules, BRAKING, EncoderForm, MOST_DELAY_TICKS, QUARTER_TURN, Row};
use super::monitor::{Bounds, misjudged};
use super::motor::{OBSERVED, POSITIVE, Switching, check_delay, ticks_to_slow};
use super::target::{Aim, Position};
use super::trigonometry::sin_cos;
use crate::config::{Config, Fallback, INPUT_LIMIT, Options};
use crate::design;
use crate::law::{Limits, ReachingLaw};
use crate::model::Nominal;
use crate::models::JointParameters;
use crate::real::Real;
use crate::surface::Surface;

/// Data sheet of a flexible joint, with all numbers on the link side of a gear.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Joint {
    /// Link inertia J_l, kg m².
    pub link_inertia_kg_m2: f64,
    /// Viscous friction of the link, N m s/rad.
    pub link_damping_n_m_s: f64,
    /// Torque of the link's weight in the level position, N m. 0 for a vertical axis.
    pub weight_n_m: f64,
    /// Stiffness K_s of the spring, N m/rad.
    pub stiffness_n_m: f64,
    /// Motor inertia J_m, kg m², times the square of the gear ratio.
    pub motor_inertia_kg_m2: f64,
    /// Viscous friction of the motor, N m s/rad.
    pub motor_damping_n_m_s: f64,
    /// Torque constant K_t, N m per unit of u (A), times the gear ratio.
    pub torque_n_m_per_a: f64,
}

impl Joint {
    /// Joint of the paper, in the only reading that is a joint: x_3 is k_1 times the motor angle.
    pub const TABLE_I: Self = {
        let JointParameters { kt, j11, j12, b12, ks, .. } = JointParameters::TABLE_I;
        Self {
            link_inertia_kg_m2: j12,
            link_damping_n_m_s: b12,
            weight_n_m: j12,
            stiffness_n_m: ks,
            motor_inertia_kg_m2: j11,
            motor_damping_n_m_s: b12,
            torque_n_m_per_a: kt,
        }
    };

    /// Returns the u of a trajectory point r .. r^(4) for the nominal joint, by the inverse of the map.
    ///
    /// Use it for planning: the law does not use it.
    pub fn feed_forward(&self, [r, r_1, r_2, r_3, r_4]: &[f64; 5]) -> f64 {
        let m = self.model();
        // The base of an encoder keeps a drive within a revolution, but a plan has any angle.
        let turns = r / TAU;
        let whole = (if turns < 0.0 { turns - 0.5 } else { turns + 0.5 }) as i64;
        let r = r - TAU * whole as f64;
        let [s, c] = m.seen(&[r, 0.0]);
        let (f_1, f_2) = (-m.k1 - c, -m.b1);
        let x_3 = r_2 + m.k1 * r + m.b1 * r_1 + s;
        let x_4 = r_3 - f_1 * r_1 - f_2 * r_2;
        let (_, drift) = m.chain(&[r, *r_1, x_3, x_4], &[s, c]);
        (r_4 - drift) / m.b
    }

    /// Returns the model: k_1, b_1, g, k_2, b_2, b of the module documentation.
    pub const fn model(&self) -> JointModel<f64> {
        let (link, motor) = (self.link_inertia_kg_m2, self.motor_inertia_kg_m2);
        let (k1, k2) = (self.stiffness_n_m / link, self.stiffness_n_m / motor);
        JointModel::new(
            k1,
            self.link_damping_n_m_s / link,
            self.weight_n_m / link,
            k2,
            self.motor_damping_n_m_s / motor,
            k1 * self.torque_n_m_per_a / motor,
        )
    }
}

/// Model of the joint in the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointModel<T> {
    k1: T,
    b1: T,
    gravity: T,
    /// Coupling k_1 k_2/2.
    half_spring: T,
    b: T,
    b2: T,
    /// Restoring terms κ of the blocks: k_1 + g, k_2.
    kappa: [T; 2],
    /// Constant part of f_1 + f_2²: f_2² - k_1.
    cross: T,
}

impl JointModel<f64> {
    /// Builds the model from the numbers of the module documentation.
    const fn new(k1: f64, b1: f64, gravity: f64, k2: f64, b2: f64, b: f64) -> Self {
        Self { k1, b1, gravity, half_spring: 0.5 * k1 * k2, b, b2, kappa: [k1 + gravity, k2], cross: b1 * b1 - k1 }
    }

    /// Returns the restoring terms κ of the blocks, 1/s².
    pub const fn kappas(&self) -> [f64; 2] {
        self.kappa
    }

    /// Returns the damping terms λ of the blocks, 1/s.
    pub const fn lambda(&self) -> [f64; 2] {
        [self.b1, self.b2]
    }

    /// Returns the gradient of a_z at 0.
    const fn gradient(&self) -> [f64; 4] {
        let ([k, k2], [b1, b2]) = (self.kappa, self.lambda());
        [2.0 * self.half_spring - k2 * k, -k2 * b1 - b2 * k, -k2 - b1 * b2 - k, -b2 - b1]
    }

    /// Returns the shares of d_l in channels 2 and 3: 1, f_2.
    const fn shares(&self) -> [[f64; 2]; 4] {
        [[0.0; 2], [1.0, 0.0], [-self.b1, 0.0], [0.0; 2]]
    }

    /// Returns the gradient of a_z at 0, and b, for a [`Config`].
    pub const fn nominal(&self) -> Nominal<4> {
        Nominal { gradient: self.gradient(), input_gain: self.b }
    }

    /// Rounds every number to the nearest f32.
    pub const fn in_f32(&self) -> JointModel<f32> {
        JointModel {
            k1: self.k1 as f32,
            b1: self.b1 as f32,
            gravity: self.gravity as f32,
            half_spring: self.half_spring as f32,
            b: self.b as f32,
            b2: self.b2 as f32,
            kappa: crate::real::row_f32(&self.kappa),
            cross: self.cross as f32,
        }
    }
}

impl<T: Real> JointModel<T> {
    /// Converts every number to another scalar, by name.
    #[doc(hidden)]
    pub fn converted<U: Real>(&self, to: &mut dyn FnMut(&'static str, T) -> U) -> JointModel<U> {
        let Self { k1, b1, gravity, half_spring, b, b2, kappa: [link, motor], cross } = *self;
        JointModel {
            k1: to("k1", k1),
            b1: to("b1", b1),
            gravity: to("gravity", gravity),
            half_spring: to("half_spring", half_spring),
            b: to("b", b),
            b2: to("b2", b2),
            kappa: [to("kappa_link", link), to("kappa_motor", motor)],
            cross: to("cross", cross),
        }
    }
}

impl<T: Real> ChainModel<T, 2, 4> for JointModel<T> {
    type Push = [T; 2];
    /// Values g sin x_1, g cos x_1.
    type Seen = [T; 2];
    const HAS_GRADIENT: bool = true;

    #[inline(always)]
    fn seen(&self, position: &[T; 2]) -> [T; 2] {
        let (s, c) = sin_cos(position[0], self.gravity);
        [s, c]
    }

    #[inline(always)]
    fn seen_ahead(&self, [s, c]: [T; 2], moved: T) -> [T; 2] {
        let less = moved * s;
        [s + moved * (c - T::HALF * less), c - less]
    }

    #[inline(always)]
    fn push(&self, position: &[T; 2], [s, _]: &[T; 2]) -> [T; 2] {
        [T::HALF * (position[1] + (self.gravity * position[0] - *s)), self.half_spring * position[0]]
    }

    #[inline(always)]
    fn of_block(push: &[T; 2], block: usize) -> Option<T> {
        Some(push[block])
    }

    #[inline(always)]
    fn per_block(numbers: [T; 2]) -> [T; 2] {
        numbers
    }

    #[inline(always)]
    fn kappa(&self, block: usize) -> T {
        self.kappa[block]
    }

    #[inline(always)]
    fn input_gain(&self) -> T {
        self.b
    }

    #[inline(always)]
    fn chain(&self, x: &[T; 4], [s, c]: &[T; 2]) -> ([T; 4], T) {
        let f_1 = -(self.k1 + *c);
        // Twist of the spring. The restoring acceleration of the motor is k_2 times it.
        let wound = x[2] - self.k1 * x[0];
        let z_3 = wound - self.b1 * x[1] - *s;
        let z_4 = x[3] + f_1 * x[1] - self.b1 * z_3;
        let drift = *s * x[1] * x[1] - self.kappa[1] * wound - self.b2 * x[3] + f_1 * z_3 - self.b1 * z_4;
        ([x[0], x[1], z_3, z_4], drift)
    }

    #[inline(always)]
    fn last(&self, [_, c]: &[T; 2], d: &[T; 2]) -> T {
        d[1] + (self.cross - *c) * d[0]
    }

    #[inline(always)]
    fn per_rad(&self, block: usize) -> T {
        if block == 0 { T::from_f64(1.0) } else { self.k1 }
    }

    fn may_stand(&self, position: &[T; 2], u_max: T) -> bool {
        let pull = self.kappa[1] * (position[1] - self.k1 * position[0]);
        pull.abs() <= T::from_f64(2.0) * self.b * u_max
    }

    fn numbers(&self) -> impl Iterator<Item = T> {
        [self.k1, self.b1, self.gravity, self.b, self.b2].into_iter().chain(self.kappa)
    }
}

/// Bandwidths of the drive of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointBandwidths {
    /// Position bandwidth w_c, rad/s: the surface is (s + w_c)³.
    pub surface_rad_s: f64,
    /// Bandwidth of the link observer, rad/s.
    pub link_rad_s: f64,
    /// Bandwidth of the motor observer, rad/s.
    pub motor_rad_s: f64,
    /// Reaching gain k_l, 1/s.
    pub reaching_per_s: f64,
    /// Offset decay rate α, 1/s.
    pub offset_per_s: f64,
}

impl JointBandwidths {
    /// Set for encoders of 16 bits and more. The current noise is 0.01 A on the joint of the paper with 20 bits.
    pub const DEFAULT: Self = Self::of([20.0, 80.0, 500.0, 100.0]);
    /// Set for 20 bits and more: 1.7 times as stiff against a load, current noise 0.024 A.
    pub const FIRM: Self = Self::of([26.0, 85.0, 800.0, 150.0]);
    /// Set for encoders of 12 to 14 bits.
    pub const QUIET: Self = Self::of([12.0, 50.0, 300.0, 40.0]);

    /// Returns the set with a motor observer slowed to the limit of period and delay, at most 3.75 times the link
    /// observer.
    #[must_use]
    pub const fn within(self, period_s: f64, delay_ticks: usize) -> Self {
        let most = match delay_ticks {
            0 => 0.6,
            1 => 0.5,
            2 => 0.4,
            _ => 0.35,
        } / period_s;
        let least = 3.75 * self.link_rad_s;
        let most = if most > least { most } else { least };
        Self { motor_rad_s: if self.motor_rad_s < most { self.motor_rad_s } else { most }, ..self }
    }

    /// Returns the set in its proportions, slowed for two or three ticks of delay: the surface is 0.048 over the delay.
    ///
    /// With this function and [`within`](Self::within) the default set is stable with inertias, stiffness and torque
    /// constant within ±20 % each. This holds with a current loop of 0.2 ms at 1 ms. `FIRM` is not stable from 1 ms of
    /// delay on.
    #[must_use]
    pub const fn slowed_for(self, period_s: f64, delay_ticks: usize) -> Self {
        if delay_ticks < 2 {
            return self;
        }
        let most = 0.048 / (delay_ticks as f64 * period_s);
        if self.surface_rad_s > most { self.with_surface(most) } else { self }
    }

    /// Returns the set in its proportions, for another w_c, rad/s.
    ///
    /// ```
    /// # use controller_core::drive::JointBandwidths;
    /// let halved = JointBandwidths::DEFAULT.with_surface(10.0);
    /// assert_eq!((halved.surface_rad_s, halved.link_rad_s, halved.reaching_per_s), (10.0, 40.0, 50.0));
    /// ```
    #[must_use]
    pub const fn with_surface(self, surface_rad_s: f64) -> Self {
        let faster = surface_rad_s / self.surface_rad_s;
        Self {
            surface_rad_s,
            link_rad_s: faster * self.link_rad_s,
            motor_rad_s: faster * self.motor_rad_s,
            reaching_per_s: faster * self.reaching_per_s,
            offset_per_s: faster * self.offset_per_s,
        }
    }

    const fn of([surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s]: [f64; 4]) -> Self {
        Self { surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s: 0.5 * surface_rad_s }
    }
}

/// Design of the drive of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JointDesign {
    /// Sampling period T, s.
    pub period_s: f64,
    /// Data sheet of the joint.
    pub joint: Joint,
    /// Encoders of link and motor. The motor counts per revolution of the link must be whole.
    pub encoders: [Encoder; 2],
    /// Limits of u.
    pub limits: Limits,
    /// Output of a drive that has not started, has stopped, or has lost its samples.
    pub fallback: Fallback,
    /// Bandwidths of the drive.
    pub bandwidths: JointBandwidths,
    /// Ratios of the high observer bandwidths to the base ones, link and motor. Read only with two gain sets.
    pub fast_ratios: [f64; 2],
    /// Gain scheduling. Read only with two gain sets.
    pub switching: Switching,
    /// Innovation gates of link and motor, in counts: a count with a larger innovation is rejected. Infinite for no
    /// gate.
    pub gate_steps: [f64; 2],
    /// Consecutive lost samples of an encoder that the observers bridge. After more, the fallback is the output and the
    /// observers restart.
    pub lost_ticks: u32,
    /// Numbers of a coupled design, for a [`CoupledDrive`](super::CoupledDrive). It gives the bandwidths another
    /// meaning. `None` for one observer per encoder.
    pub coupled: Option<Coupled>,
}

/// Additional numbers of a coupled design of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coupled {
    /// Time constant of the current loop, s.
    pub lag_s: f64,
    /// Resolution of link and motor encoder, rad behind the gear: one count. With white noise of a standard deviation
    /// σ, $\sqrt{\text{step}^2 + 18 \sigma^2}$.
    pub resolution_rad: [f64; 2],
    /// Smoothed innovation, in counts, at which the high gains of link and motor begin. At 2.67 times this number they
    /// are fully in use. Read only with two gain sets.
    pub calm_steps: [f64; 2],
}

impl Coupled {
    /// Returns the numbers for these encoders without noise. The high gains begin at 1.5 counts.
    pub const fn behind(encoders: &[Encoder; 2], lag_s: f64) -> Self {
        Self { lag_s, resolution_rad: [encoders[0].unit_rad(), encoders[1].unit_rad()], calm_steps: [1.5; 2] }
    }
}

impl JointDesign {
    /// Returns the largest product of motor observer bandwidth and period. More than three ticks of delay count as
    /// three.
    pub const fn motor_observer_limit(delay_ticks: usize) -> f64 {
        match delay_ticks {
            0 => 0.8,
            1 | 2 => 0.5,
            _ => 0.4,
        }
    }

    /// Designs with default bandwidths, and gates for a sudden load of `load_n_m` N m on the link and 1.2 times the
    /// current limit.
    pub const fn new(period_s: f64, joint: Joint, encoders: [Encoder; 2], limits: Limits, load_n_m: f64) -> Self {
        Self {
            period_s,
            joint,
            encoders,
            limits,
            fallback: Fallback::HoldLast,
            bandwidths: JointBandwidths::DEFAULT,
            fast_ratios: [3.0, 1.5],
            switching: Switching::DEFAULT,
            gate_steps: [f64::INFINITY; 2],
            lost_ticks: 50,
            coupled: None,
        }
        .with_bandwidths(JointBandwidths::DEFAULT, load_n_m)
    }

    /// Returns the design with other bandwidths and the innovation gates for them.
    #[must_use]
    pub const fn with_bandwidths(mut self, bandwidths: JointBandwidths, load_n_m: f64) -> Self {
        if self.coupled.is_some() {
            return self.with_coupled_bandwidths(bandwidths, load_n_m);
        }
        let link = load_n_m / self.joint.link_inertia_kg_m2;
        let motor = 1.2 * self.largest_current() * self.joint.torque_n_m_per_a / self.joint.motor_inertia_kg_m2;
        self.bandwidths = bandwidths;
        self.gate_steps = [
            steps(link, bandwidths.link_rad_s, &self.encoders[0]),
            steps(motor, bandwidths.motor_rad_s, &self.encoders[1]),
        ];
        self
    }

    /// Returns the alarm thresholds of the monitors if the data sheet is known to within the share p = `uncertain`
    /// (0.2, 0.5).
    ///
    /// `load_n_m` is the largest sudden load, N m. With q = p/(1 - p) the thresholds are:
    /// * Link disturbance: the load, plus 1.25 q of the acceleration of both shafts together at the limit of u.
    /// * Motor disturbance: 0.25 + 1.75 q of the acceleration of the motor alone at the limit. The spring adds its own
    ///   errors.
    /// * Innovations: q times the innovation gates.
    /// * u at a limit: 0.2 s.
    ///
    /// The estimate of a load step overshoots by half of it for some ms. If the largest load comes at once and must
    /// raise no alarm, declare one and a half times the load. A wider bound detects a frozen count later.
    pub fn bounds<T, M, A, const S: usize, const FAST: usize, const LATE: usize>(
        &self,
        law: &EncoderForm<T, M, A, 2, 4, S, FAST, LATE>,
        load_n_m: f64,
        uncertain: f64,
    ) -> Bounds<2>
    where
        T: Real,
        M: ChainModel<T, 2, 4>,
        A: Aim<T, 4>,
    {
        let Joint { link_inertia_kg_m2: link, motor_inertia_kg_m2: motor, torque_n_m_per_a, .. } = self.joint;
        let (torque, q) = (self.largest_current() * torque_n_m_per_a, misjudged(uncertain));
        let fastest = torque / motor;
        let disturbance = [load_n_m / link + 1.25 * q * torque / (link + motor), (0.25 + 1.75 * q) * fastest];
        Bounds::of(law, disturbance, self.gate_steps, uncertain, fastest, self.brake(LATE), self.period_s)
    }

    /// Returns the gain of the brake on the motor, 1/s, and the time constant of both shafts under it, s.
    ///
    /// The brake is a damper that absorbs the motion of the spring. Its gain is limited by the delay (a tick at least)
    /// and half of the inertia: v⁺ = v - k T v, with L ticks of delay, is stable for k T below 2 sin(π/(4 L + 2)).
    fn brake(&self, delay_ticks: usize) -> [f64; 2] {
        const MOST: [f64; MOST_DELAY_TICKS + 1] = [0.5, 0.5, 0.3, 0.22];
        let Joint { link_inertia_kg_m2: link, motor_inertia_kg_m2: motor, stiffness_n_m, .. } = self.joint;
        let most = MOST[delay_ticks.min(MOST_DELAY_TICKS)] / self.period_s;
        let matched = libm::sqrt(stiffness_n_m * link) / motor;
        let gain_per_s = if matched < most { matched } else { most };
        [gain_per_s, (1.0 + link / motor) / gain_per_s]
    }

    /// Returns the braking model of the link, for `delay_ticks` ticks of delay.
    ///
    /// The deceleration towards a far target leaves a share of the limit for load and friction. The time constant comes
    /// from the brake on the motor. Beyond the end the link swings by the twist of the spring.
    pub fn slowing(&self, delay_ticks: usize) -> Slowing {
        let Joint { link_inertia_kg_m2: link, motor_inertia_kg_m2: motor, torque_n_m_per_a, .. } = self.joint;
        let [_, constant_s] = self.brake(delay_ticks);
        Slowing {
            deceleration_rad_s2: BRAKING * self.largest_current() * torque_n_m_per_a / (link + motor),
            constant_s: constant_s + ticks_to_slow(delay_ticks) * self.period_s,
            tolerance_rad: 2.0 * self.encoders[0].unit_rad(),
        }
    }

    pub(crate) const fn largest_current(&self) -> f64 {
        let Limits { min, max } = self.limits;
        if max > -min { max } else { -min }
    }

    pub(crate) const fn check_encoders(&self) -> Result<(), DriveError> {
        const WHOLE: &str = "a turn of the link must be a whole number of counts: sin and cos need a base of one turn";
        let fields = ["encoders[0]", "encoders[1]"];
        let mut i = 0;
        while i < 2 {
            if let Err(error) = self.encoders[i].check(fields[i]) {
                return Err(error);
            }
            let (turns, _) = self.encoders[i].base();
            if let Err(error) = DriveError::within(fields[i], turns as f64, 1.0, 1.0, WHOLE) {
                return Err(error);
            }
            i += 1;
        }
        Ok(())
    }

    /// Checks every number, for a drive with `late` ticks of delay.
    ///
    /// # Errors
    /// Returns the first number that is out of its range, with the range.
    pub const fn validate(&self, late: usize) -> Result<(), DriveError> {
        if let Err(error) = check_delay(late) {
            return Err(error);
        }
        if let Err(error) = self.check_encoders() {
            return Err(error);
        }
        if let Err(error) = self.switching.check() {
            return Err(error);
        }
        if let Err(error) = self.check_sheet() {
            return Err(error);
        }
        if self.coupled.is_some() { self.check_coupled() } else { self.check_apart(late) }
    }

    /// Checks the numbers that do not depend on the kind of observer.
    const fn check_sheet(&self) -> Result<(), DriveError> {
        let Self { period_s: t, joint, limits, bandwidths: w, .. } = self;
        let t = *t;
        let u_safe = match self.fallback {
            Fallback::HoldLast => limits.min,
            Fallback::Safe(u) => u,
        };
        let limit = "0 is not within the limits, or one is beyond 1e12";
        let damping = "a damping times period over its inertia is 0 to 1";
        let [b1, b2] = joint.model().lambda();
        let rules = [
            ("period_s", t, 2e-5, 1e-2, "the period of a drive is 20 us to 10 ms"),
            ("joint.link_inertia_kg_m2", joint.link_inertia_kg_m2, 1e-12, 1e9, POSITIVE),
            ("joint.motor_inertia_kg_m2", joint.motor_inertia_kg_m2, 1e-12, 1e9, POSITIVE),
            ("joint.stiffness_n_m", joint.stiffness_n_m, 1e-9, 1e9, POSITIVE),
            ("joint.torque_n_m_per_a", joint.torque_n_m_per_a, 1e-9, 1e9, POSITIVE),
            ("joint.weight_n_m", joint.weight_n_m, 0.0, 1e9, "the weight is not below 0"),
            ("joint.link_damping_n_m_s", b1 * t, 0.0, 1.0, damping),
            ("joint.motor_damping_n_m_s", b2 * t, 0.0, 1.0, damping),
            ("limits.max", limits.max, 0.0, 1e12, limit),
            ("limits.min", limits.min, -1e12, 0.0, limit),
            ("fallback", u_safe, limits.min, limits.max, "the safe u lies outside the limits"),
            ("bandwidths.offset_per_s", w.offset_per_s * t, 1e-7, 1.0, "alpha times period is 1e-7 to 1"),
            ("gate_steps[0]", self.gate_steps[0], 2.0, f64::INFINITY, GATE),
            ("gate_steps[1]", self.gate_steps[1], 2.0, f64::INFINITY, GATE),
            ("lost_ticks", self.lost_ticks as f64, 1.0, 1e6, "1 to 1e6 samples may be missing"),
        ];
        DriveError::within_all(&rules)
    }

    /// Checks the bandwidths of one observer per encoder.
    const fn check_apart(&self, late: usize) -> Result<(), DriveError> {
        let (t, w) = (self.period_s, &self.bandwidths);
        let rules = [
            ("bandwidths.surface_rad_s", w.surface_rad_s * t, 1e-6, 0.1, "w_c times period is up to 0.1"),
            (
                "bandwidths.link_rad_s",
                w.link_rad_s * t,
                3.0 * w.surface_rad_s * t,
                0.25,
                "the link's observer times period is 3 w_c T to 0.25",
            ),
            (
                "bandwidths.motor_rad_s",
                w.motor_rad_s * t,
                3.5 * w.link_rad_s * t,
                Self::motor_observer_limit(late),
                MOTOR_OBSERVER,
            ),
            (
                "bandwidths.reaching_per_s",
                w.reaching_per_s,
                2.0 * w.surface_rad_s,
                8.0 * w.surface_rad_s,
                "k_l is 2 to 8 times w_c",
            ),
            ("bandwidths.reaching_per_s", w.reaching_per_s * t, 1e-6, 0.3, "k_l times period is up to 0.3"),
            ("fast_ratios[0]", self.fast_ratios[0], 1.0, 4.0, RATIO),
            ("fast_ratios[1]", self.fast_ratios[1], 1.0, 4.0, RATIO),
        ];
        DriveError::within_all(&rules)
    }
}

const MOTOR_OBSERVER: &str = "the motor's observer times period is 3.5 times the link's to 0.8, and to 0.5, 0.5, 0.4 \
                              with 1, 2, 3 ticks of delay";
const RATIO: &str = "the high gains are 1 to 4 times as fast as the base gains";
const GATE: &str = "a gate below 2 steps refuses good counts";

/// Returns the innovation gate in counts. A step D of the disturbance causes an innovation of at most 0.131 D/w².
/// Coarse encoders add some counts.
const fn steps(disturbance: f64, bandwidth_rad_s: f64, encoder: &Encoder) -> f64 {
    let steps = 0.131 * disturbance / (bandwidth_rad_s * bandwidth_rad_s * encoder.unit_rad());
    1.0 + if steps > 7.0 { steps } else { 7.0 }
}

/// Drive of a flexible joint with an encoder on link and motor.
///
/// `JointDrive` without parameters is in f32, follows a position, has one gain set and no delay.
/// `JointDrive<f32, Position, 1>` has a high gain set too, for parameters known to 20 %.
/// `JointDrive<f32, Position, 0, 1>` applies u one tick after its computation (up to three).
pub type JointDrive<T = f32, A = Position, const FAST: usize = 0, const LATE: usize = 0> =
    EncoderForm<T, JointModel<T>, A, 2, 4, 4, FAST, LATE>;

impl<A: Aim<f64, 4>, const FAST: usize, const LATE: usize> EncoderForm<f64, JointModel<f64>, A, 2, 4, 4, FAST, LATE> {
    const fn of_joint(design: &JointDesign) -> Result<Self, DriveError> {
        if let Err(error) = design.validate(LATE) {
            return Err(error);
        }
        let JointDesign { period_s: t, joint, encoders, limits, bandwidths, .. } = design;
        let (t, model) = (*t, joint.model());
        let ([kappa, lambda], gradient) = ([model.kappa, model.lambda()], model.gradient());
        let config = Config {
            period_s: t,
            surface: Surface::from_bandwidth(bandwidths.surface_rad_s, bandwidths.offset_per_s),
            observers: [None, Some(OBSERVED), Some(OBSERVED), Some(OBSERVED)],
            reaching: ReachingLaw { k_l: bandwidths.reaching_per_s, k_s: 0.0, epsilon: 0.0 },
            nominal: Nominal { gradient, input_gain: model.b },
            options: Options::NEUTRAL.with_limits(*limits),
        };
        let Ok(rows) = design::coefficients::<4, 2, 3>(&config, &[1, 2, 3]) else {
            return Err(DriveError::new("joint", f64::NAN, 0.0, 0.0, "a coefficient overflows in f32"));
        };
        // w_c far/3 is the speed there. With three equal poles it brakes with at most 0.0902 w_c² far (τ²/6 e^-τ at 2).
        let (w_c, inertia) = (bandwidths.surface_rad_s, joint.link_inertia_kg_m2 + joint.motor_inertia_kg_m2);
        let torque = joint.torque_n_m_per_a.abs() * limits.weaker() - joint.weight_n_m.abs();
        let far = BRAKING * torque / (inertia * 0.0902 * w_c * w_c);
        let far = if far > 0.0 && far < INPUT_LIMIT { far } else { INPUT_LIMIT };
        let omega = [bandwidths.link_rad_s, bandwidths.motor_rad_s];
        let sensors = [encoders[0].sensor(), encoders[1].sensor().scaled(model.k1)];
        let mut blocks = [Block::<f64, 4>::design(kappa[0], lambda[0], t, omega[0]); 2];
        blocks[1] = Block::<f64, 4>::design(kappa[1], lambda[1], t, omega[1]);
        let mut fast = [design.switching.gains(&blocks[0].gains, blocks[0].gains, sensors[0].unit, t); 2];
        let (mut gate, quarters) = ([0.0; 2], [QUARTER_TURN, QUARTER_TURN * model.k1]);
        let mut i = 0;
        while i < 2 {
            let gains = Block::<f64, 4>::gains_at(kappa[i], lambda[i], t, omega[i] * design.fast_ratios[i]);
            fast[i] = design.switching.gains(&blocks[i].gains, gains, sensors[i].unit, t);
            gate[i] = design.gate_steps[i] * sensors[i].unit;
            i += 1;
        }
        Ok(Self {
            model,
            blocks,
            sensors,
            fast: [fast; FAST],
            row: Row::of(&rows, &gradient, &model.shares(), *limits, design.fallback, far),
            belief: AcceptanceRules::of(gate, &sensors, quarters, 0.2 * omega[0], design.lost_ticks, t),
            inertia: [joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2],
            at_rest: false,
            of: PhantomData,
        })
    }
}

macro_rules! designs {
    ($t:ty, $drive:ident => $converted:expr) => {
        impl<A: Aim<f64, 4> + Aim<$t, 4>, const FAST: usize, const LATE: usize>
            EncoderForm<$t, JointModel<$t>, A, 2, 4, 4, FAST, LATE>
        {
            /// Designs the drive. The compiler and the program compute equal numbers.
            ///
            /// # Errors
            /// Returns the first number that is out of its range, with the range.
            pub const fn try_design(design: &JointDesign) -> Result<Self, DriveError> {
                match EncoderForm::<f64, JointModel<f64>, A, 2, 4, 4, FAST, LATE>::of_joint(design) {
                    Ok($drive) => Ok($converted),
                    Err(error) => Err(error),
                }
            }

            /// Designs as [`try_design`](Self::try_design), in a `const`: an invalid design is a compile error with the
            /// reason.
            ///
            /// # Panics
            /// On an invalid design. Outside a `const` use [`try_design`](Self::try_design).
            pub const fn design(design: &JointDesign) -> Self {
                match Self::try_design(design) {
                    Ok(drive) => drive,
                    Err(error) => panic!("{}", error.text().as_str()),
                }
            }
        }
    };
}
designs!(f64, drive => drive);
designs!(f32, drive => drive.in_f32(drive.model.in_f32()));

impl<M: ChainModel<f32, 2, 4>, A: Aim<f64, 4> + Aim<f32, 4>, const FAST: usize, const LATE: usize>
    EncoderForm<f32, M, A, 2, 4, 4, FAST, LATE>
{
    /// Designs the drive of a joint with a better known link: bandwidths and gates of a [`JointDesign`], a model of
    /// your own.
    ///
    /// Near 0 the model must agree with the design's joint, in its units, with a first position of period one
    /// revolution. Check it with [`map_error`](super::map_error), κ and λ of [`Joint::model`].
    ///
    /// # Errors
    /// Returns the first number of the design that is out of its range, with the range.
    pub const fn try_design_with(design: &JointDesign, model: M) -> Result<Self, DriveError> {
        match EncoderForm::<f64, JointModel<f64>, A, 2, 4, 4, FAST, LATE>::of_joint(design) {
            Ok(drive) => Ok(drive.in_f32(model)),
            Err(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::Running;
    use crate::drive::{Sample, Target, map_error};
    use crate::models::Reading;

    #[test]
    fn the_joint_of_the_paper_has_the_chain_of_the_physical_reading() {
        let (model, chain) = (Joint::TABLE_I.model(), JointParameters::TABLE_I.chain(Reading::Physical));
        let found =
            [model.k1, 2.0 * model.half_spring, model.b, model.b1, model.lambda()[1], model.kappa[1], model.gravity];
        let expected = [chain.k1, chain.a1, chain.b, chain.b1, chain.b2, chain.k2, 1.0];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found} for {expected}");
        }
    }

    /// Checks that whole revolutions change nothing, for any number of them.
    #[test]
    fn a_plan_may_lead_many_turns_away() {
        let joint = Joint::TABLE_I;
        for r in [0.3_f64, -2.0, 3.0] {
            let here = joint.feed_forward(&[r, 0.4, -3.0, 20.0, 500.0]);
            // By the formula of the module documentation with an independent sine: at rest the weight is the only term.
            let weight = joint.weight_n_m * libm::sin(r) / joint.torque_n_m_per_a;
            assert!((joint.feed_forward(&[r, 0.0, 0.0, 0.0, 0.0]) - weight).abs() < 1e-9 * (1.0 + weight.abs()));
            for turns in [-1000.0, -3.0, 2.0, 400.0] {
                let there = joint.feed_forward(&[r + TAU * turns, 0.4, -3.0, 20.0, 500.0]);
                assert!((there - here).abs() < 1e-6, "{turns} turns from {r}: {there} for {here}");
            }
        }
    }

    /// Checks an uncounted revolution of a motor behind a gear: the twist would exceed the torque of the motor.
    #[test]
    fn a_joint_does_not_start_on_a_spring_that_nothing_could_wind() {
        let joint = Joint { stiffness_n_m: 300.0, ..Joint::TABLE_I };
        let encoders = [Encoder::absolute(20), Encoder::incremental(18, 1 << 14).geared(10, 1)];
        let design = JointDesign::new(1e-3, joint, encoders, Limits::symmetric(30.0), 1.3);
        let law = JointDrive::<f32>::try_design(&design).expect("a good design");
        let still = Target { turn: 0, jet: [1.0, 0.0, 0.0, 0.0] };
        let count = |bits: u32, turns: f64| Some((turns * f64::from(1 << bits)) as i32);
        let start = |motor_turns: f64| {
            let counts = [count(20, 1.0 / TAU), count(14, motor_turns)];
            let (mut running, sample) = (Running::new(&law), Sample { counts, begin: still, end: still });
            running.start_at_once(&sample);
            running.tick(&sample)
        };
        // The motor has made 1.59 revolutions.
        let good = start(10.0 / TAU);
        assert!(good.u.abs() < 3.0 && good.health.is_ok(), "{good:?}");
        let bad = start(10.0 / TAU - 2.0);
        assert!(bad.u == 0.0 && bad.health.contains(crate::Health::INPUT_REJECTED), "{bad:?}");
    }

    /// Checks the constant current for an even rotation of a joint without damping and weight, also when the base moves
    /// by a revolution. The prediction of a tick must not take that for a motion.
    #[test]
    fn a_late_drive_does_not_feel_the_base_move_on() {
        let joint = Joint { link_damping_n_m_s: 0.0, motor_damping_n_m_s: 0.0, weight_n_m: 0.0, ..Joint::TABLE_I };
        let design = JointDesign::new(1e-3, joint, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
        let law = JointDrive::<f64, Position, 0, 1>::design(&design);
        let mut running = Running::new(&law);
        let target = |tick: i32| {
            let rate = TAU / 1024.0;
            Target { turn: tick / 1024, jet: [f64::from(tick % 1024) * rate, rate / design.period_s, 0.0, 0.0] }
        };
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for tick in 0..5 * 1024 {
            // The counts advance evenly for any u: as if no current had flowed.
            running.report_applied(0.0);
            let counts = [Some(tick * 1024); 2];
            let u = running.tick(&Sample { counts, begin: target(tick + 1), end: target(tick + 2) }).u;
            if tick >= 4 * 1024 {
                (least, most) = (least.min(u), most.max(u));
            }
        }
        assert_eq!(running.estimates().map(|known| known.turn), Some(5));
        assert!(most - least < 1e-8, "{least:e} A to {most:e} A");
    }

    /// Checks L z_i = z_{i+1}, L z_n = a_z + b u, for any state, weight and damping.
    #[test]
    fn the_map_is_what_the_definition_of_a_chain_says() {
        let mut worst = 0.0_f64;
        let mut seed = 1_u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        for weight_n_m in [0.0, 0.23, 2.0] {
            let model = Joint { weight_n_m, link_damping_n_m_s: 0.5, ..Joint::TABLE_I }.model();
            for _ in 0..100 {
                let x = [noise() * 2.0, noise() * 4.0, noise() * 80.0, noise() * 400.0];
                worst = worst.max(map_error(&model, &model.kappa, &model.lambda(), &x, noise() * 10.0));
            }
            // The check detects an error: another κ is another motion.
            let [link, motor] = model.kappa;
            assert!(map_error(&model, &[link + 1.0, motor], &model.lambda(), &[1.0, 1.0, 50.0, 3.0], 1.0) > 1e-3);
        }
        std::println!("map off by {worst:.1e}");
        assert!(worst <= 1e-6, "{worst:e}");
    }

    /// Checks ∂a_z/∂z at 0 by differences: x of a z near 0 by Newton's method on the map.
    #[test]
    fn the_gradient_is_that_of_the_map() {
        let model = Joint::TABLE_I.model();
        let chain = |x: &[f64; 4]| model.chain(x, &model.seen(&[x[0], x[2]]));
        // At 0 the map is triangular: columns of z and a_z on x.
        let h = 1e-5;
        let column = |j: usize| -> ([f64; 4], f64) {
            let mut x = [0.0; 4];
            x[j] = h;
            let (z, a) = chain(&x);
            x[j] = -h;
            let (less, b) = chain(&x);
            (core::array::from_fn::<f64, 4, _>(|i| (z[i] - less[i]) / (2.0 * h)), (a - b) / (2.0 * h))
        };
        // gradient . dz/dx = da/dx, solved from the last column.
        let mut gradient = [0.0; 4];
        for j in (0..4).rev() {
            let (dz, da) = column(j);
            let known: f64 = (j + 1..4).map(|i| gradient[i] * dz[i]).sum();
            gradient[j] = (da - known) / dz[j];
        }
        for (found, expected) in model.gradient().into_iter().zip(gradient) {
            assert!((found - expected).abs() <= 1e-6 * (1.0 + expected.abs()), "{found} for {expected}");
        }
    }
}
