//! Flexible joint in the tick of the coupled design: both shafts and the spring between them as one plant.
//!
//! The blocks of link and motor hold the numbers of each shaft alone. [`Whole`] holds the coupling: the effect of one
//! shaft on the other within a tick, and the cross gains of the observer. It also holds the law terms outside the chain
//! of integrators: the current that lags behind its command, and d of the motor (module `coupled`, whose symbols are
//! used here).
//!
//! # The chain
//! With $x = (q_l, v_l, \tau, v_m)$, $s = g \sin q_l$, $c = g \cos q_l$:
//!
//! $$ z_3 = k_1 \tau - b_1 v_l - s, \qquad z_4 = k_1 (v_m - v_l) - c\thinspace v_l - b_1 z_3, $$
//! $$ a_z = s v_l^2 - (k_1 + c) z_3 - b_1 z_4 - k_1 (k_2 \tau + b_2 v_m) $$
//!
//! so that $\dot z_4 = a_z + k_1 b\thinspace u$ except for disturbances. The regulator ignores the weight and works on
//!
//! $$ \varepsilon = (e_1,\ e_2,\ e_3 + c e_1,\ e_4 + c (e_2 - b_1 e_1)) $$
//!
//! which are, to first order, the errors of the joint without its weight.
//! $K_\varepsilon = (K_1 + K_3,\ K_2 + K_4 + K_3 b_1/k_1,\ (K_3 + K_4 b_1)/k_1,\ K_4/k_1)$ is K of the joint for these
//! errors.

use core::marker::PhantomData;

use super::block::Block;
use super::chain::ChainModel;
use super::coupled::{JointRatios, JointTick, Regulator, innovations};
use super::error::DriveError;
use super::fields::fields;
use super::joint::{Coupled, JointBandwidths, JointDesign};
use super::law::{AcceptanceRules, BRAKING, EncoderForm, FastGains, QUARTER_TURN, Row};
use super::motor::{Switching, decay};
use super::target::{Aim, Position};
use super::trigonometry::sin_cos;
use crate::config::{Fallback, INPUT_LIMIT};
use crate::design;
use crate::real::{Count as _, Real};
use crate::running::{Words, each_word, next};

fields! {
    /// Numbers of the joint beyond the two blocks (see the module).
    pub struct Whole<T, const E, const S> {
        /// Acceleration of link and motor per rad of twist: k_1, -k_2.
        spring: [T; E],
        /// Cross terms in a tick: speed into speed, speed into position, acceleration into position of the other shaft.
        phi_across: [T; E],
        g2_across: [T; E],
        g1_across: [T; E],
        /// Effect of the current error i - u on speed and position, and the share of it that remains after a tick.
        current_v: [T; E],
        current_q: [T; E],
        keeps: T,
        /// Gains of each block for the innovation of the other block.
        link_across: [T; S],
        motor_across: [T; S],
        /// Additions of the high gain set to these gains.
        link_more: [T; S],
        motor_more: [T; S],
        /// Weights of sigma and the law on the current minus the reference current, and of sigma on d of the motor.
        c_current: T,
        k_current: T,
        c_motor: T,
        /// a_z/(k_1 b) on the errors from the second on: its part that does not come from the reference.
        ahead: [T; S],
        /// Longest use of the high gain set, and the calm time before its next use, in ticks.
        burst: T,
        rest: T,
        /// Factors from both counts to a common unit, and the twist per unit. 0 without a common unit.
        times_link: i32,
        times_motor: i32,
        twist_unit: T,
    }
}

impl<T: Real> Whole<T, 2, 3> {
    /// Returns the twist q_m - q_l, rad, from two counts relative to the base. Integers lose no digit.
    #[inline(always)]
    pub(crate) fn twist(&self, at: &[T::Count; 2]) -> T {
        self.twist_unit * T::from_count(at[1].whole(1, self.times_motor).since(at[0].whole(1, self.times_link)))
    }
}

/// Half the acceleration from the weight, and the currents.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPush<T> {
    half: T,
    current: T,
    asked: T,
}

impl<T: Real> Words for JointPush<T> {
    fn words(&self) -> impl Iterator<Item = u32> {
        [self.half, self.current, self.asked].into_iter().flat_map(|number| each_word(&number))
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(Self { half: next(words)?, current: next(words)?, asked: next(words)? })
    }
}

/// Model of the joint in the tick of the coupled design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoMass<T> {
    pub(crate) whole: Whole<T, 2, 3>,
    k1: T,
    k2: T,
    b1: T,
    b2: T,
    gravity: T,
    /// Motor acceleration per A, K_t/J_m.
    b: T,
    /// Effect of d of the motor in the chain, as the law uses it.
    d_motor: T,
}

impl TwoMass<f64> {
    pub(crate) const fn new(r: &JointRatios, gravity: f64, whole: &Whole<f64, 2, 3>, d_motor: f64) -> Self {
        Self { whole: *whole, k1: r.k1, k2: r.k2, b1: r.b1, b2: r.b2, gravity, b: r.b, d_motor }
    }

    /// Rounds every number to the nearest f32.
    pub const fn in_f32(&self) -> TwoMass<f32> {
        TwoMass {
            whole: self.whole.in_f32(),
            k1: self.k1 as f32,
            k2: self.k2 as f32,
            b1: self.b1 as f32,
            b2: self.b2 as f32,
            gravity: self.gravity as f32,
            b: self.b as f32,
            d_motor: self.d_motor as f32,
        }
    }
}

/// Returns K of the errors of the chain, from K of (q_l, v_l, q_m, v_m).
pub(crate) const fn of_chain(k: &[f64; 5], r: &JointRatios) -> [f64; 4] {
    [k[0] + k[2], k[1] + k[3] + k[2] * r.b1 / r.k1, (k[2] + k[3] * r.b1) / r.k1, k[3] / r.k1]
}

/// Rows of the regulator law, in the coordinates of the chain.
pub(crate) struct ChainLaw {
    /// Surface weights: c with c_4 = 1, on d of the link and of the motor, and on the current.
    pub(crate) c: [f64; 4],
    pub(crate) c_d: [f64; 2],
    pub(crate) c_current: f64,
    /// Weights of u without σ: on the errors, on d, on the current.
    pub(crate) k: [f64; 4],
    pub(crate) k_d: [f64; 2],
    pub(crate) k_current: f64,
    /// Weights of u on σ and on W.
    pub(crate) us: f64,
    pub(crate) kw: f64,
    /// a_z/(k_1 b) on the errors.
    pub(crate) ahead: [f64; 4],
    /// Feedforward on Δr, Δr', ..
    pub(crate) feed: [f64; 4],
}

impl ChainLaw {
    /// Returns the rows of a regulator. `decay` is the decay of W per tick.
    pub(crate) const fn of(law: &Regulator, r: &JointRatios, period_s: f64, decay: f64) -> Self {
        let (feedback, surface) = (of_chain(&law.feedback, r), of_chain(&law.surface, r));
        let (scale, input) = (surface[3], r.k1 * r.b);
        let us = -(1.0 - law.reaching) * scale;
        // Gradient of a_z without the weight, on the chain.
        let gradient = [0.0, -r.k2 * r.b1 - r.b2 * r.k1, -r.k2 - r.b2 * r.b1 - r.k1, -r.b2 - r.b1];
        let ([mut c, mut k], [mut ahead, mut feed]) = ([[0.0; 4]; 2], [[0.0; 4]; 2]);
        let mut j = 0;
        while j < 4 {
            c[j] = surface[j] / scale;
            k[j] = -feedback[j] - us * c[j];
            ahead[j] = gradient[j] / input;
            feed[j] = -0.5 * gradient[j] / input;
            j += 1;
        }
        feed[3] += 1.0 / (period_s * input);
        let (c_current, mut c_d, mut k_d) = (law.surface[4] / scale, [0.0; 2], [0.0; 2]);
        let mut i = 0;
        while i < 2 {
            c_d[i] = law.known[i] / scale;
            k_d[i] = law.disturbance[i] - us * c_d[i];
            i += 1;
        }
        let k_current = -law.feedback[4] - us * c_current;
        Self { c, c_d, c_current, k, k_d, k_current, us, kw: -decay * scale, ahead, feed }
    }
}

impl Whole<f64, 2, 3> {
    /// Returns the numbers of a tick and its law. The design adds gains, the high gain set and the counts.
    pub(crate) const fn of(r: &JointRatios, tick: &JointTick, law: &ChainLaw) -> Self {
        let JointTick { phi, g2, g1, current_q, current_v, keeps } = *tick;
        Self {
            spring: [r.k1, -r.k2],
            phi_across: [phi[0][1], phi[1][0]],
            g2_across: [g2[0][1], g2[1][0]],
            g1_across: [g1[0][1], g1[1][0]],
            current_v,
            current_q,
            keeps,
            link_across: [0.0; 3],
            motor_across: [0.0; 3],
            link_more: [0.0; 3],
            motor_more: [0.0; 3],
            c_current: law.c_current,
            k_current: law.k_current,
            c_motor: law.c_d[1],
            ahead: [law.ahead[1], law.ahead[2], law.ahead[3]],
            burst: 0.0,
            rest: 0.0,
            times_link: 1,
            times_motor: 1,
            twist_unit: 0.0,
        }
    }
}

impl<T: Real> TwoMass<T> {
    /// Converts every number to another scalar, by name.
    #[doc(hidden)]
    pub fn converted<U: Real>(&self, to: &mut dyn FnMut(super::NumberName, T) -> U) -> TwoMass<U> {
        let whole = self.whole.converted(0, to);
        let mut of = |name, number| to(super::NumberName { name, encoder: 0, entry: 0 }, number);
        TwoMass {
            whole,
            k1: of("k_link", self.k1),
            k2: of("k_motor", self.k2),
            b1: of("b_link", self.b1),
            b2: of("b_motor", self.b2),
            gravity: of("gravity", self.gravity),
            b: of("b_current", self.b),
            d_motor: of("d_in_chain", self.d_motor),
        }
    }
}

impl<T: Real> ChainModel<T, 2, 4> for TwoMass<T> {
    type Push = JointPush<T>;
    /// Values g sin q_l, g cos q_l.
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
    fn push(&self, _: &[T; 2], [s, _]: &[T; 2]) -> JointPush<T> {
        JointPush { half: -(T::HALF * *s), current: T::ZERO, asked: T::ZERO }
    }

    #[inline(always)]
    fn of_block(push: &JointPush<T>, block: usize) -> Option<T> {
        (block == 0).then_some(push.half)
    }

    #[inline(always)]
    fn per_block([half, _]: [T; 2]) -> JointPush<T> {
        JointPush { half, current: T::ZERO, asked: T::ZERO }
    }

    #[inline(always)]
    fn kappa(&self, _: usize) -> T {
        T::ZERO
    }

    #[inline(always)]
    fn input_gain(&self) -> T {
        self.b
    }

    /// Returns z and a_z. Here x_3 is the twist.
    #[inline(always)]
    fn chain(&self, x: &[T; 4], [s, c]: &[T; 2]) -> ([T; 4], T) {
        let (speed, stiffer) = (x[1], self.k1 + *c);
        let z_3 = self.k1 * x[2] - self.b1 * speed - *s;
        let z_4 = self.k1 * x[3] - stiffer * speed - self.b1 * z_3;
        let motor = self.k1 * (self.k2 * x[2] + self.b2 * x[3]);
        ([x[0], speed, z_3, z_4], *s * speed * speed - stiffer * z_3 - self.b1 * z_4 - motor)
    }

    #[inline(always)]
    fn last(&self, _: &[T; 2], d: &[T; 2]) -> T {
        self.d_motor * d[1]
    }

    #[inline(always)]
    fn per_rad(&self, _: usize) -> T {
        T::from_f64(1.0)
    }

    fn may_stand(&self, position: &[T; 2], u_max: T) -> bool {
        (self.k2 * (position[1] - position[0])).abs() <= T::from_f64(2.0) * self.b * u_max
    }

    fn numbers(&self) -> impl Iterator<Item = T> {
        let Whole { times_link, times_motor, .. } = self.whole;
        let counts = [times_link, times_motor].into_iter().map(|times| T::from_f64(f64::from(times)));
        let own = [self.k1, self.k2, self.b1, self.b2, self.gravity, self.b, self.d_motor];
        own.into_iter().chain(self.whole.numbers()).chain(counts)
    }

    #[inline(always)]
    fn whole(&self) -> Option<&Whole<T, 2, 3>> {
        Some(&self.whole)
    }

    #[inline(always)]
    fn currents(push: &JointPush<T>) -> [T; 2] {
        [push.current, push.asked]
    }

    #[inline(always)]
    fn with_currents(push: JointPush<T>, [current, asked]: [T; 2]) -> JointPush<T> {
        JointPush { current, asked, ..push }
    }

    #[inline(always)]
    fn weightless(&self, e: &[T; 4], [_, c]: &[T; 2]) -> [T; 4] {
        [e[0], e[1], e[2] + *c * e[0], e[3] + *c * (e[1] - self.b1 * e[0])]
    }
}

const REACHING: &str = "k_l is at least w_c, and times the period at most 2";
const RATIO: &str = "the high gains are 0.5 to 5 times as fast as the base gains";
const CALM: &str = "the high gains begin at 1e-3 to 1e6 counts of innovation";
const RESOLUTION: &str = "an encoder resolves 1e-9 to 1 rad";

/// Drive of a flexible joint with a coupled design of both shafts: stable in cases in which one observer per encoder is
/// not.
///
/// `CoupledDrive` without parameters is in f32, follows a position, has one gain set and no delay. The parameters are
/// those in [`JointDrive`](super::JointDrive). Its [`JointDesign`] has [`Coupled`] numbers
/// ([`coupled`](JointDesign::coupled_by)).
///
/// ```
/// use controller_core::drive::{Coupled, CoupledDrive, Encoder, Joint, JointBandwidths, JointDesign};
/// use controller_core::{Limits, Running};
///
/// // A harmonic drive, 100 : 1, everything behind the gear: 127 rad/s of resonance over 1.2 kg m².
/// const JOINT: Joint = Joint {
///     link_inertia_kg_m2: 0.4,
///     link_damping_n_m_s: 0.5,
///     weight_n_m: 10.0,
///     stiffness_n_m: 8000.0,
///     motor_inertia_kg_m2: 1.2,
///     motor_damping_n_m_s: 2.0,
///     torque_n_m_per_a: 8.0,
/// };
/// const ENCODERS: [Encoder; 2] = [Encoder::absolute(19), Encoder::incremental(24, 1 << 14).geared(100, 1)];
/// const BANDWIDTHS: JointBandwidths = JointBandwidths {
///     surface_rad_s: 20.0,
///     reaching_per_s: 60.0,
///     link_rad_s: 60.0,
///     motor_rad_s: 200.0,
///     offset_per_s: 10.0,
/// };
/// const COUPLED: Coupled = Coupled::behind(&ENCODERS, 2e-4);
/// const DESIGN: JointDesign =
///     JointDesign::new(1e-3, JOINT, ENCODERS, Limits::symmetric(8.0), 10.0).coupled_by(COUPLED, BANDWIDTHS, 10.0);
/// type Drive = CoupledDrive;
/// static DRIVE: Drive = Drive::design(&DESIGN);
/// let running = Running::new(&DRIVE);
/// # assert!(running.estimates().is_none());
/// ```
pub type CoupledDrive<T = f32, A = Position, const FAST: usize = 0, const LATE: usize = 0> =
    EncoderForm<T, TwoMass<T>, A, 2, 4, 3, FAST, LATE>;

/// Time to the peak of an innovation after a step, at most, in time constants of the link observer.
const TO_PEAK: f64 = 8.0;
/// Largest number of ticks to the peak that the design computes.
const MOST_TO_PEAK: usize = 2000;
/// Longest use of the high gain set, in time constants of the link observer.
const BURST: f64 = 2.5;
/// Calm time before the next use of the high gain set, in time constants of the link observer.
const REST: f64 = 10.0;
/// Smoothing of the innovation, in time constants of the link observer.
const SMOOTHING: f64 = 0.16;
/// Fade-out of the high gain set, in time constants of the link observer.
const KEEP: f64 = 1.1;
/// Innovation at which the high gain set is fully in use, relative to the innovation at which its use begins.
const ALL_IN: f64 = 2.67;

impl JointDesign {
    /// Returns this design as a coupled design of the whole joint.
    ///
    /// The bandwidths w_c and k_l are the poles that the regulator gives a rigid shaft (module `coupled` of the
    /// source). The other bandwidths belong to the observer of each encoder. The innovation gates allow a sudden load
    /// of `load_n_m` N m on the link and 1.2 times the current limit on the motor. The gain scheduling follows the link
    /// observer.
    #[must_use]
    pub const fn coupled_by(mut self, coupled: Coupled, bandwidths: JointBandwidths, load_n_m: f64) -> Self {
        self.coupled = Some(coupled);
        self.with_coupled_bandwidths(bandwidths, load_n_m)
    }

    pub(super) const fn with_coupled_bandwidths(mut self, bandwidths: JointBandwidths, load_n_m: f64) -> Self {
        self.bandwidths = bandwidths;
        (self.switching.smoothing_s, self.switching.keep_s) =
            (SMOOTHING / bandwidths.link_rad_s, KEEP / bandwidths.link_rad_s);
        self.gate_steps = [f64::INFINITY; 2];
        if self.check_coupled().is_err() || self.period_s <= 0.0 || self.period_s.is_nan() {
            return self;
        }
        let (ratios, tick) = self.tick();
        let ticks = TO_PEAK / (bandwidths.link_rad_s * self.period_s);
        let ticks = if ticks < MOST_TO_PEAK as f64 { ticks as usize + 1 } else { MOST_TO_PEAK };
        let gains = tick.observer_gains(&ratios, self.period_s, self.resolution_rad(), self.observers([1.0; 2]));
        let peaks = innovations(&ratios, &tick, &gains, ticks);
        let step = [
            load_n_m / self.joint.link_inertia_kg_m2,
            1.2 * self.largest_current() * self.joint.torque_n_m_per_a / self.joint.motor_inertia_kg_m2,
        ];
        let mut i = 0;
        while i < 2 {
            let steps = (peaks[0][i] * step[0] + peaks[1][i] * step[1]) / self.encoders[i].unit_rad();
            self.gate_steps[i] = 1.0 + if steps > 7.0 { steps } else { 7.0 };
            i += 1;
        }
        self
    }

    const fn tick(&self) -> (JointRatios, JointTick) {
        let lag_s = match self.coupled {
            Some(Coupled { lag_s, .. }) => lag_s,
            None => 0.0,
        };
        let ratios = JointRatios::of(&self.joint, lag_s);
        (ratios, JointTick::of(&ratios, self.period_s))
    }

    /// Returns the observer bandwidths of link and motor, times these factors.
    const fn observers(&self, [link, motor]: [f64; 2]) -> [f64; 2] {
        [link * self.bandwidths.link_rad_s, motor * self.bandwidths.motor_rad_s]
    }

    const fn resolution_rad(&self) -> [f64; 2] {
        match self.coupled {
            Some(Coupled { resolution_rad, .. }) => resolution_rad,
            None => [0.0; 2],
        }
    }

    /// Returns the gain scheduling on the innovation of an encoder.
    const fn switching_at(&self, encoder: usize) -> Switching {
        let calm_steps = match self.coupled {
            Some(Coupled { calm_steps, .. }) => calm_steps[encoder],
            None => self.switching.calm_steps,
        };
        Switching { calm_steps, alert_steps: ALL_IN * calm_steps, ..self.switching }
    }

    /// Returns the real pole z of the regulator: σ\* decays by this factor per tick. `None` without a coupled design
    /// or without a real pole.
    pub fn reaching_pole(&self) -> Option<f64> {
        self.coupled?;
        let JointDesign { period_s, bandwidths: w, .. } = self;
        let (ratios, tick) = self.tick();
        Some(Regulator::of(&ratios, &tick, *period_s, [w.surface_rad_s, w.reaching_per_s])?.reaching)
    }

    /// Checks the numbers and bandwidths of a coupled design.
    pub(super) const fn check_coupled(&self) -> Result<(), DriveError> {
        let (t, w) = (self.period_s, &self.bandwidths);
        let Some(Coupled { lag_s, resolution_rad, calm_steps }) = self.coupled else { return Ok(()) };
        let rules = [
            ("coupled.lag_s", lag_s, 0.0, 0.1, "the lag of the current loop is 0 to 0.1 s"),
            ("coupled.resolution_rad[0]", resolution_rad[0], 1e-9, 1.0, RESOLUTION),
            ("coupled.resolution_rad[1]", resolution_rad[1], 1e-9, 1.0, RESOLUTION),
            ("coupled.calm_steps[0]", calm_steps[0], 1e-3, 1e6, CALM),
            ("coupled.calm_steps[1]", calm_steps[1], 1e-3, 1e6, CALM),
            ("bandwidths.surface_rad_s", w.surface_rad_s * t, 1e-6, 1.0, "w_c times the period is up to 1"),
            ("bandwidths.reaching_per_s", w.reaching_per_s * t, w.surface_rad_s * t, 2.0, REACHING),
            ("bandwidths.link_rad_s", w.link_rad_s * t, 1e-5, 2.0, "the link's observer times period is up to 2"),
            ("bandwidths.motor_rad_s", w.motor_rad_s * t, 1e-5, 4.0, "the motor's observer times period is up to 4"),
            ("fast_ratios[0]", self.fast_ratios[0], 0.5, 5.0, RATIO),
            ("fast_ratios[1]", self.fast_ratios[1], 0.5, 5.0, RATIO),
        ];
        DriveError::within_all(&rules)
    }

    /// Returns the factors from both counts to a common unit, and the number of these units per revolution. The factors
    /// are 0 if the common unit is too fine.
    const fn common_measure(&self) -> ([i32; 2], u64) {
        let ((_, link), (_, motor)) = (self.encoders[0].base(), self.encoders[1].base());
        let (mut a, mut b) = (link, motor);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        let a = if a == 0 { 1 } else { a };
        let measure = link / a * motor;
        if measure > MOST_MEASURE { ([0; 2], 1) } else { ([(motor / a) as i32, (link / a) as i32], measure) }
    }
}

/// Largest number of common units per revolution of the link: two revolutions of twist are at most 2^31 units. Above
/// it, the twist is computed in floating point, to some 1e-7 rad in f32.
const MOST_MEASURE: u64 = 1 << 30;

impl<A: Aim<f64, 4>, const FAST: usize, const LATE: usize> EncoderForm<f64, TwoMass<f64>, A, 2, 4, 3, FAST, LATE> {
    const fn of_joint(design: &JointDesign) -> Result<Self, DriveError> {
        if design.coupled.is_none() {
            return Err(DriveError::new("coupled", f64::NAN, 0.0, 0.0, "a design as a whole has its numbers"));
        }
        if let Err(error) = design.validate(LATE) {
            return Err(error);
        }
        let JointDesign { period_s: t, joint, encoders, limits, bandwidths: w, .. } = design;
        let (t, (ratios, tick)) = (*t, design.tick());
        let (times, measure) = design.common_measure();
        let Some(regulator) = Regulator::of(&ratios, &tick, t, [w.surface_rad_s, w.reaching_per_s]) else {
            let why = "the regulator of this joint has no real pole to reach with: ask for a slower one";
            return Err(DriveError::new("bandwidths.surface_rad_s", w.surface_rad_s, 0.0, 0.5 * w.surface_rad_s, why));
        };
        let offset_decay = decay(w.offset_per_s * t);
        let law = ChainLaw::of(&regulator, &ratios, t, offset_decay);
        let quiet = tick.observer_gains(&ratios, t, design.resolution_rad(), design.observers([1.0; 2]));
        let quick = tick.observer_gains(&ratios, t, design.resolution_rad(), design.observers(design.fast_ratios));
        let sensors = [encoders[0].sensor(), encoders[1].sensor()];
        let mut whole = Whole::of(&ratios, &tick, &law);
        (whole.link_across, whole.motor_across) = (quiet[0][1], quiet[1][0]);
        (whole.link_more, whole.motor_more) = (less(&quick[0][1], &quiet[0][1]), less(&quick[1][0], &quiet[1][0]));
        (whole.burst, whole.rest) = (BURST / (w.link_rad_s * t), REST / (w.link_rad_s * t));
        (whole.times_link, whole.times_motor) = (times[0], times[1]);
        whole.twist_unit = core::f64::consts::TAU / measure as f64;
        let mut blocks = [Block { lambda: 0.0, phi: 0.0, g2: 0.0, g1: 0.0, h1: 0.0, gains: [0.0; 3] }; 2];
        let lambda = [ratios.b1, ratios.b2];
        let mut fast = [FastGains { more: [0.0; 3], calm: 0.0, rate: 0.0, smoothing: 0.0, keep: 0.0 }; 2];
        let mut gate = [0.0; 2];
        let mut i = 0;
        while i < 2 {
            let (phi, g2, g1) = (tick.phi[i][i], tick.g2[i][i], tick.g1[i][i]);
            blocks[i] = Block { lambda: lambda[i], phi, g2, g1, h1: 0.0, gains: quiet[i][i] };
            fast[i] = design.switching_at(i).gains(&quiet[i][i], quick[i][i], sensors[i].unit, t);
            gate[i] = design.gate_steps[i] * sensors[i].unit;
            i += 1;
        }
        // Along σ = 0 a rigid shaft brakes with w_c² e.
        let inertia = joint.link_inertia_kg_m2 + joint.motor_inertia_kg_m2;
        let torque = joint.torque_n_m_per_a.abs() * limits.weaker() - joint.weight_n_m.abs();
        let far = BRAKING * torque / (inertia * w.surface_rad_s * w.surface_rad_s);
        let far = if far > 0.0 && far < INPUT_LIMIT { far } else { INPUT_LIMIT };
        Ok(Self {
            model: TwoMass::new(
                &ratios,
                joint.weight_n_m / joint.link_inertia_kg_m2,
                &whole,
                -law.k_d[1] * ratios.k1 * ratios.b,
            ),
            blocks,
            sensors,
            fast: [fast; FAST],
            row: law.row(t, &ratios, design, far, offset_decay),
            belief: AcceptanceRules::of(gate, &sensors, [QUARTER_TURN; 2], 0.2 * w.link_rad_s, design.lost_ticks, t),
            inertia: [joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2],
            at_rest: false,
            of: PhantomData,
        })
    }
}

const fn less(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

impl ChainLaw {
    const fn row(&self, period: f64, r: &JointRatios, design: &JointDesign, far: f64, decay: f64) -> Row<f64, 2, 4> {
        let limits = design.limits;
        let (hold, fallback) = match design.fallback {
            Fallback::HoldLast => (1.0, 0.0),
            Fallback::Safe(u) => (0.0, u),
        };
        Row {
            c: self.c,
            far,
            far_per_u: far / limits.stronger(),
            kx: self.k,
            feed: self.feed,
            c_d: self.c_d,
            c_growth: [0.0; 2],
            k_d: self.k_d,
            k_growth: [0.0; 2],
            k_last: 0.0,
            kw: self.kw,
            us: self.us,
            k_offset: self.kw - self.us,
            decay,
            per_b: 1.0 / (r.k1 * r.b),
            period,
            turn: core::f64::consts::TAU,
            u_min: limits.min,
            u_max: limits.max,
            most: limits.stronger(),
            plausible: design::plausible(limits),
            hold,
            fallback,
        }
    }
}

macro_rules! designs {
    ($t:ty, $drive:ident => $converted:expr) => {
        impl<A: Aim<f64, 4> + Aim<$t, 4>, const FAST: usize, const LATE: usize>
            EncoderForm<$t, TwoMass<$t>, A, 2, 4, 3, FAST, LATE>
        {
            /// Designs the drive. The compiler and the program compute equal numbers.
            ///
            /// # Errors
            /// Returns the first number that is out of its range, with the range.
            pub const fn try_design(design: &JointDesign) -> Result<Self, DriveError> {
                match EncoderForm::<f64, TwoMass<f64>, A, 2, 4, 3, FAST, LATE>::of_joint(design) {
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

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::Limits;
    use crate::drive::{Encoder, Joint, Sample, Target};
    use crate::running::ControlLaw as _;
    use std::collections::VecDeque;

    const JOINT: Joint = Joint {
        link_inertia_kg_m2: 0.4,
        link_damping_n_m_s: 0.5,
        weight_n_m: 0.0,
        stiffness_n_m: 8000.0,
        motor_inertia_kg_m2: 1.2,
        motor_damping_n_m_s: 2.0,
        torque_n_m_per_a: 8.0,
    };
    const ENCODERS: [Encoder; 2] = [Encoder::absolute(19), Encoder::incremental(24, 1 << 14).geared(100, 1)];
    const BANDWIDTHS: JointBandwidths = JointBandwidths {
        surface_rad_s: 20.0,
        reaching_per_s: 60.0,
        link_rad_s: 60.0,
        motor_rad_s: 200.0,
        offset_per_s: 10.0,
    };

    fn design(joint: Joint) -> JointDesign {
        let coupled = Coupled::behind(&ENCODERS, 2e-4);
        let design = JointDesign::new(1e-3, joint, ENCODERS, Limits::symmetric(8.0), 10.0);
        design.coupled_by(coupled, BANDWIDTHS, 10.0)
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Law from its matrices, independent of the tick: an observer of (q, v, d) of both shafts with the current, and
    /// the regulator on the state of the reference.
    struct ByMatrices {
        ratios: JointRatios,
        tick: JointTick,
        phi: [[f64; 5]; 5],
        gamma: [f64; 5],
        gains: [[[f64; 3]; 2]; 2],
        law: Regulator,
        x: [f64; 5],
        d: [f64; 2],
        asked: f64,
    }

    impl ByMatrices {
        fn of(design: &JointDesign) -> Self {
            let (ratios, tick) = design.tick();
            let (phi, gamma) = tick.matrices(&ratios);
            let steps = design.encoders.map(|encoder| encoder.unit_rad());
            let w = &design.bandwidths;
            let gains = tick.observer_gains(&ratios, design.period_s, steps, [w.link_rad_s, w.motor_rad_s]);
            let poles = [w.surface_rad_s, w.reaching_per_s];
            let law = Regulator::of(&ratios, &tick, design.period_s, poles).expect("a real pole");
            Self { ratios, tick, phi, gamma, gains, law, x: [0.0; 5], d: [0.0; 2], asked: 0.0 }
        }

        fn next(&self, x: [f64; 5], u: f64) -> [f64; 5] {
            core::array::from_fn(|i| {
                let push = [self.tick.g1, self.tick.g2][i % 2];
                let by_d = if i < 4 { dot(&push[i / 2], &self.d) } else { 0.0 };
                dot(&self.phi[i], &x) + self.gamma[i] * u + by_d
            })
        }

        fn observe(&mut self, held: f64, positions: [f64; 2]) {
            self.x = self.next(self.x, held);
            let e = [positions[0] - self.x[0], positions[1] - self.x[2]];
            for shaft in 0..2 {
                let gain = |s: usize| self.gains[shaft][0][s] * e[0] + self.gains[shaft][1][s] * e[1];
                self.x[2 * shaft] += gain(0);
                self.x[2 * shaft + 1] += gain(1);
                self.d[shaft] += gain(2);
            }
        }

        /// Returns u for the tick from one trajectory point to the next. The queued values are held before.
        fn asked(&mut self, queued: &VecDeque<f64>, jets: [[f64; 4]; 2], period_s: f64) -> f64 {
            let r = &self.ratios;
            let x = queued.iter().fold(self.x, |x, &u| self.next(x, u));
            let state = |[r_0, r_1, r_2, r_3]: [f64; 4]| {
                [r_0, r_1, r_0 + (r_2 + r.b1 * r_1) / r.k1, r_1 + (r_3 + r.b1 * r_2) / r.k1]
            };
            let holding = |x: [f64; 4]| r.k2 * (x[2] - x[0]) + r.b2 * x[3];
            // Mean acceleration of the motor, with r'' and r''' linear within the tick.
            let mean = |k: usize| 0.5 * (jets[0][k] + jets[1][k]);
            let faster = mean(2) + ((jets[1][3] - jets[0][3]) / period_s + r.b1 * mean(3)) / r.k1;
            let [begin, end] = jets.map(state);
            let ahead = (faster + 0.5 * (holding(begin) + holding(end))) / r.b;
            let away: [f64; 5] = core::array::from_fn(|i| x[i] - if i < 4 { begin[i] } else { self.asked });
            self.asked = ahead + self.tick.keeps * (self.asked - ahead);
            ahead + dot(&self.law.disturbance, &self.d) - dot(&self.law.feedback, &away)
        }
    }

    /// Returns the largest difference to the matrices for a sine of the link. The counts come from outside, so the loop
    /// is open.
    fn off_by<const LATE: usize>() -> f64 {
        // In the open loop every u must be visible, so the limits are wide.
        let design = JointDesign { limits: Limits::symmetric(800.0), gate_steps: [f64::INFINITY; 2], ..design(JOINT) };
        let law = CoupledDrive::<f64, Position, 0, LATE>::design(&design);
        let (t, mut seed) = (design.period_s, 1_u64);
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let jet = |tick: i32| {
            let (a, w) = (0.4, 9.0);
            let (sin, cos) = (libm::sin(w * t * f64::from(tick)), libm::cos(w * t * f64::from(tick)));
            [a * sin, a * w * cos, -a * w * w * sin, -a * w * w * w * cos]
        };
        let mut matrices = ByMatrices::of(&design);
        let (mut state, mut queued, mut worst) = (None, VecDeque::from(std::vec![0.0; LATE]), 0.0_f64);
        let mut held = 0.0;
        for tick in 0..3000 {
            let angle = 0.4 * libm::sin(9.0 * t * f64::from(tick)) + 1e-5 * noise();
            let twist = 1e-3 * libm::sin(40.0 * t * f64::from(tick));
            let units = ENCODERS.map(|encoder| encoder.unit_rad());
            let counts = [angle / units[0], (angle + twist) / units[1]].map(|count| libm::round(count) as i32);
            let positions = [f64::from(counts[0]) * units[0], f64::from(counts[1]) * units[1]];
            let target = |tick: i32| Target { turn: 0, jet: jet(tick) };
            let late = LATE as i32;
            let sample = Sample { counts: counts.map(Some), begin: target(tick + late), end: target(tick + late + 1) };
            if let Some(state) = state.as_mut() {
                matrices.observe(held, positions);
                let output = law.tick(state, &sample);
                let jets = [jet(tick + late), jet(tick + late + 1)];
                let u = matrices.asked(&queued, jets, t);
                assert!(output.u.abs() < 800.0, "nothing is limited: {}", output.u);
                if tick > 1000 {
                    worst = worst.max((output.u - u).abs());
                }
                queued.push_back(output.u);
            } else {
                matrices.x = [positions[0], 0.0, positions[1], 0.0, 0.0];
                let mut started = law.start(&sample).expect("good counts");
                // As after a long run: no offset, no wait.
                (started.offset, started.fresh) = (0.0, false);
                state = Some(started);
                queued.push_back(0.0);
            }
            held = queued.pop_front().expect("one at least");
        }
        worst
    }

    #[test]
    fn the_tick_is_what_the_design_says() {
        let found = [off_by::<0>(), off_by::<1>(), off_by::<3>()];
        std::println!("u off by {found:?} A");
        assert!(found.iter().all(|off| *off < 1e-8), "{found:?}");
    }

    /// Checks L z_i = z_{i+1}, L z_n = a_z + b u, for positions of the motor instead of the twist.
    #[test]
    fn the_map_is_what_the_definition_of_a_chain_says() {
        let joint = Joint { weight_n_m: 10.0, ..JOINT };
        let law = CoupledDrive::<f64>::design(&design(joint));
        let m = law.model();
        let rate = |x: &[f64; 4], u: f64| {
            let pull = m.k1 * x[2] - m.b1 * x[1] - m.gravity * libm::sin(x[0]);
            [x[1], pull, x[3] - x[1], -m.k2 * x[2] - m.b2 * x[3] + m.b * u]
        };
        let (x, u, h) = ([0.7, 3.0, 2e-3, 3.5], 2.0, 1e-6);
        let chain = |by: f64| {
            let flow = rate(&x, u);
            let x: [f64; 4] = core::array::from_fn(|i| x[i] + by * flow[i]);
            m.chain(&x, &m.seen(&[x[0], 0.0]))
        };
        let ((z, drift), (later, _), (before, _)) = (chain(0.0), chain(h), chain(-h));
        for i in 0..4 {
            let expected = if i < 3 { z[i + 1] } else { drift + m.k1 * m.b * u };
            let found = (later[i] - before[i]) / (2.0 * h);
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{i}: {found} for {expected}");
        }
    }

    /// Checks that counts of both encoders in their common unit resolve a twist to one count, for any distance moved.
    #[test]
    fn a_twist_is_of_integers() {
        let law = CoupledDrive::<f32>::design(&design(JOINT));
        let turn = [1 << 19, 100 << 14];
        for turns in [0, 1, 2] {
            let at = [turn[0] * turns + 1000, turn[1] * turns + 3125 + 7];
            let expected = 7.0 * ENCODERS[1].unit_rad() as f32;
            let found = law.model().whole.twist(&at);
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected} after {turns} turns");
        }
    }
}
