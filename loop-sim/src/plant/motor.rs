//! True motor with a rigid load.
//!
//! $$ J \dot\omega = K_t i \thinspace (1 + r \sin n_r \theta) + c \sin n_c \theta - B \omega - F(\omega)
//!    - \text{load}(t), \qquad \tau \thinspace \dot i = u - i $$
//!
//! $$ F(\omega) = \left(F_c + (F_s - F_c) e^{-(\omega/\omega_s)^2}\right) \tanh(\omega/\omega_t) $$
//!
//! The states are the angle θ (rad), the speed ω (rad/s) and, with a lag τ, the current i (A). Without a lag i is u.
//! All torques act at the shaft with angle θ. A load is positive against positive motion.
//!
//! Friction is Coulomb's and Stribeck's. With ω_t = 0 friction holds: tanh becomes the sign, and a shaft whose speed
//! reaches 0 stands until the torque on it exceeds F_s. The solver steps to these events. With ω_t > 0 friction fades
//! below that speed, and the shaft creeps where a real shaft sticks.
//!
//! With a [`Supply`] of V volt and a winding of R ohm the speed limits u at each instant. K_e is K_t:
//!
//! $$ \frac{-V - K_t \omega}{R} \le u \le \frac{V - K_t \omega}{R} $$
//!
//! The inductance acts only through the lag. The ripple of K_t is not included.
//!
//! The model of the controller is $\dot\omega = (K_t u - B \omega)/J$ with its own J, K_t, B. The remainder is the
//! lumped disturbance d_2 (rad/s²). It is taken with the flowing current, since the lag of a current loop is not a
//! torque.

use super::shafts::{self, Numbers};
use super::{Parts, Plant, Regime, fastest_signal_rad_s, merged_jumps_s};
use crate::MAX_ORDER;
use crate::exact::{Exact, LinearPart};
use crate::signal::Signal;
use crate::sine;
use crate::solver::STEP_ANGLE;

/// Rate of the cogging above which the solver does not resolve the rotation, rad/s.
const SPINNING_RAD_S: f64 = 1e5;

/// Argument above which tanh is 1 in f64, except for 1e-16.
const LEVEL: f64 = 19.0;

/// Parameters J, K_t and B of a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Inertia J, kg m².
    pub inertia_kg_m2: f64,
    /// Torque constant K_t, N m per A.
    pub torque_n_m_per_a: f64,
    /// Viscous damping B, N m s/rad.
    pub damping_n_m_s: f64,
}

/// Converts data-sheet parameters.
impl From<&controller_core::drive::Motor> for Shaft {
    fn from(sheet: &controller_core::drive::Motor) -> Self {
        Self {
            inertia_kg_m2: sheet.inertia_kg_m2,
            torque_n_m_per_a: sheet.torque_n_m_per_a,
            damping_n_m_s: sheet.damping_n_m_s,
        }
    }
}

/// Friction F(ω) of the module documentation, N m. The default is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Static friction F_s just above rest, N m.
    pub static_n_m: f64,
    /// Coulomb friction F_c, N m.
    pub coulomb_n_m: f64,
    /// Stribeck speed ω_s of the transition from F_s to F_c, rad/s.
    pub stribeck_rad_s: f64,
    /// Speed ω_t below which friction fades, rad/s. 0 for friction that holds.
    pub smooth_rad_s: f64,
}

impl Default for Friction {
    fn default() -> Self {
        Self { static_n_m: 0.0, coulomb_n_m: 0.0, stribeck_rad_s: 0.1, smooth_rad_s: 0.005 }
    }
}

impl Friction {
    /// Returns the torque against a shaft with this speed, N m.
    pub fn torque_n_m(&self, speed_rad_s: f64) -> f64 {
        if self.static_n_m == 0.0 && self.coulomb_n_m == 0.0 {
            return 0.0;
        }
        if self.holds() {
            return if speed_rad_s == 0.0 { 0.0 } else { self.sliding_n_m(1.0_f64.copysign(speed_rad_s), speed_rad_s) };
        }
        // Above this speed the formula below gives F_c to the bit: tanh is 1, and the bell vanishes next to F_c.
        if speed_rad_s.abs() > (7.0 * self.stribeck_rad_s).max(22.0 * self.smooth_rad_s)
            && self.coulomb_n_m > 1e-3 * self.static_n_m
        {
            return self.coulomb_n_m.copysign(speed_rad_s);
        }
        shafts::friction(self.numbers(), speed_rad_s)
    }

    /// Returns true if a shaft that comes to rest sticks.
    pub fn holds(&self) -> bool {
        self.smooth_rad_s == 0.0 && self.largest_n_m() > 0.0
    }

    /// Returns the friction of a shaft that slides in this direction, regardless of the sign of its speed, N m.
    fn sliding_n_m(&self, sign: f64, speed_rad_s: f64) -> f64 {
        // Equal to the bit, as above.
        if speed_rad_s.abs() > 7.0 * self.stribeck_rad_s && self.coulomb_n_m > 1e-3 * self.static_n_m {
            return self.coulomb_n_m * sign;
        }
        shafts::sliding(self.numbers(), sign, speed_rad_s)
    }

    /// Returns F_c, F_s - F_c, 1/ω_s and 1/ω_t.
    pub(super) fn numbers(&self) -> [f64; 4] {
        let Self { static_n_m, coulomb_n_m, stribeck_rad_s, smooth_rad_s } = *self;
        [coulomb_n_m, static_n_m - coulomb_n_m, 1.0 / stribeck_rad_s, 1.0 / smooth_rad_s]
    }

    fn largest_n_m(&self) -> f64 {
        self.static_n_m.max(self.coulomb_n_m)
    }

    /// Returns the largest slope of the friction, at rest, N m s/rad. For friction that holds it is the slope of the
    /// bell: e^-x² falls by less than 0.86 per unit of x.
    fn steepest_n_m_s(&self) -> f64 {
        if self.holds() {
            0.86 * (self.static_n_m - self.coulomb_n_m).abs() / self.stribeck_rad_s
        } else {
            self.largest_n_m() / self.smooth_rad_s
        }
    }

    /// Returns the speed above which friction is F_c in f64, rad/s: 1 - tanh 19 and e^(-6.1²) are below 1e-16.
    fn level_rad_s(&self) -> f64 {
        let bell = if self.static_n_m == self.coulomb_n_m { 0.0 } else { 6.1 * self.stribeck_rad_s };
        bell.max(LEVEL * self.smooth_rad_s)
    }

    /// Returns the rate of a shaft with the rates `free_rad_s` without friction and `steep_rad_s` at the steepest
    /// friction.
    ///
    /// Above the steep range the shaft has constant friction. The rate then gives a step in which the speed does not
    /// drop into the steep range at the given acceleration. Inside the steep range the step changes the speed by at
    /// most half of the width of the crossed feature. `pushed` returns the acceleration there and its rate of growth.
    pub(super) fn fastest_rad_s(
        &self,
        [free_rad_s, steep_rad_s]: [f64; 2],
        speed: f64,
        acceleration: f64,
        pushed: impl FnOnce() -> [f64; 2],
    ) -> f64 {
        if self.largest_n_m() == 0.0 || (self.holds() && self.static_n_m == self.coulomb_n_m) {
            return free_rad_s;
        }
        let above = speed.abs() - self.level_rad_s();
        // Width of tanh, and above it of the bell.
        let beyond = (speed.abs() - LEVEL * self.smooth_rad_s).max(0.0);
        let width = if self.holds() {
            STEP_ANGLE * self.stribeck_rad_s
        } else {
            self.smooth_rad_s + (STEP_ANGLE * beyond).min(self.stribeck_rad_s)
        };
        if above > 0.0 {
            let at_the_corner = steep_rad_s.max(acceleration / width);
            return free_rad_s.max((STEP_ANGLE * acceleration / above).min(at_the_corner));
        }
        let [now, growth] = pushed();
        steep_rad_s.max(now.abs() / width + libm::sqrt(0.5 * growth.abs() / width))
    }
}

/// Supply voltage and winding resistance, which limit the current of a turning shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Voltage V, volt.
    pub volt: f64,
    /// Resistance R, ohm, above 0.
    pub ohm: f64,
}

impl Supply {
    /// Returns the part of a current u that the supply drives against this back-EMF (V).
    pub fn driven(&self, back_emf_v: f64, u: f64) -> f64 {
        u.max((-self.volt - back_emf_v) / self.ohm).min((self.volt - back_emf_v) / self.ohm)
    }

    /// Returns the signed voltage that a current needs against this back-EMF, V.
    pub fn asked_v(&self, back_emf_v: f64, u: f64) -> f64 {
        self.ohm * u + back_emf_v
    }
}

/// Returns the coefficients with another 1/J.
fn with_per_inertia<const G: usize>(numbers: &Numbers<G>, per_inertia: f64) -> Numbers<G> {
    let mut numbers = *numbers;
    numbers[0][0] = per_inertia;
    numbers
}

/// Effects that a data sheet of a motor omits. The default is none of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Imperfections {
    /// Friction F.
    pub friction: Friction,
    /// Cogging torque c, N m.
    pub cogging_n_m: f64,
    /// Periods of the cogging per revolution of the shaft.
    pub cogging_per_turn: f64,
    /// Torque ripple r, as a share of the torque.
    pub ripple: f64,
    /// Periods of the ripple per revolution of the shaft.
    pub ripple_per_turn: f64,
    /// Lag τ of the current loop, s. 0 for none.
    pub lag_s: f64,
    /// Supply V and R. With `None` every current is driven at every speed.
    pub supply: Option<Supply>,
}

impl Imperfections {
    /// Computes dx/dt of a motor or joint from its coefficients, in one regime.
    pub(super) fn rates_in<const N: usize, const G: usize>(
        &self,
        regime: Regime,
        numbers: &Numbers<G>,
        x: &[f64; N],
        u: f64,
        load: f64,
    ) -> [f64; N] {
        let speed = x[shafts::motor_at(N)[1]];
        match regime {
            Regime::Smooth => self.rates_with(numbers, x, u, load, self.friction.torque_n_m(speed)),
            // A standing shaft acts as an infinite inertia.
            Regime::Held => self.rates_with(&with_per_inertia(numbers, 0.0), x, u, load, 0.0),
            Regime::Sliding { sign, .. } => {
                self.rates_with(numbers, x, u, load, self.friction.sliding_n_m(f64::from(sign), speed))
            }
        }
    }

    /// Writes dx/dt of a plant of order N to the first N entries of `dx`. Neither slice may be shorter.
    pub(super) fn put_rates<const N: usize, const G: usize>(
        &self,
        regime: Regime,
        numbers: &Numbers<G>,
        (x, u, load): (&[f64], f64, f64),
        dx: &mut [f64],
    ) {
        let (Some(x), Some(dx)) = (x.first_chunk::<N>(), dx.first_chunk_mut::<N>()) else {
            unreachable!("fewer than {N} states");
        };
        *dx = self.rates_in(regime, numbers, x, u, load);
    }

    fn rates_with<const N: usize, const G: usize>(
        &self,
        numbers: &Numbers<G>,
        x: &[f64; N],
        u: f64,
        load: f64,
        friction: f64,
    ) -> [f64; N] {
        let [angle, speed] = shafts::motor_at(N);
        let (angle, speed) = (x[angle], x[speed]);
        let u = self.driven(numbers[0][1], speed, u);
        let waves = shafts::waves(numbers[1], angle, sine::sin);
        let sin_link = if N > 3 { sine::sin(x[0]) } else { 0.0 };
        shafts::rates(numbers, x, u, load, friction, waves, sin_link)
    }

    /// Returns the torque on a standing shaft, N m.
    pub(super) fn push_n_m<const N: usize, const G: usize>(
        &self,
        numbers: &Numbers<G>,
        x: &[f64; N],
        u: f64,
        load: f64,
    ) -> f64 {
        self.rates_with(&with_per_inertia(numbers, 1.0), x, u, load, 0.0)[shafts::motor_at(N)[1]]
    }

    /// Returns the regime in this state, from the torque on the shaft at standstill.
    pub(super) fn regime(&self, x: &[f64], push_n_m: impl FnOnce() -> f64) -> Regime {
        if !self.friction.holds() {
            return Regime::Smooth;
        }
        let at = shafts::motor_at(x.len())[1];
        let sliding = |way: f64| Regime::Sliding { speed: at as u8, sign: if way > 0.0 { 1 } else { -1 } };
        if x[at] != 0.0 {
            return sliding(x[at]);
        }
        let push = push_n_m();
        if push.abs() > self.friction.largest_n_m() { sliding(push) } else { Regime::Held }
    }

    /// Returns the distance of a regime from its end: the remaining static friction, N m, or the speed, rad/s.
    pub(super) fn margin(&self, regime: Regime, x: &[f64], push_n_m: impl FnOnce() -> f64) -> f64 {
        match regime {
            Regime::Smooth => f64::INFINITY,
            Regime::Held => self.friction.largest_n_m() - push_n_m().abs(),
            Regime::Sliding { speed, sign } => f64::from(sign) * x[usize::from(speed)],
        }
    }

    /// Returns the part of u that the supply drives through a motor with this K_t at this speed.
    pub(super) fn driven(&self, torque_n_m_per_a: f64, speed: f64, u: f64) -> f64 {
        self.supply.map_or(u, |supply| supply.driven(torque_n_m_per_a * speed, u))
    }

    /// Returns the back-EMF as a damping while the supply is the limit, N m s/rad.
    pub(super) fn braking_n_m_s(&self, torque_n_m_per_a: f64) -> f64 {
        self.supply.map_or(0.0, |supply| torque_n_m_per_a * torque_n_m_per_a / supply.ohm)
    }

    /// Returns the steepest slope of the friction as a damping, N m s/rad.
    pub(super) fn damping_n_m_s(&self) -> f64 {
        self.friction.steepest_n_m_s()
    }

    /// Returns the largest torque of this current plus ripple, cogging and friction, N m.
    pub(super) fn largest_n_m(&self, torque_n_m_per_a: f64, current: f64) -> f64 {
        (torque_n_m_per_a * current).abs() * (1.0 + self.ripple.abs())
            + self.cogging_n_m.abs()
            + self.friction.largest_n_m()
    }

    /// Returns the rate of the other effects, rad/s: the current, the spring of the cogging, and cogging and ripple at
    /// this speed.
    pub(super) fn fastest_rad_s(&self, inertia_kg_m2: f64, speed: f64) -> f64 {
        let current = if self.lag_s > 0.0 { 1.0 / self.lag_s } else { 0.0 };
        let spring = libm::sqrt(self.cogging_n_m.abs() * self.cogging_per_turn / inertia_kg_m2);
        let periods = |size: f64, per_turn: f64| if size == 0.0 { 0.0 } else { per_turn };
        let waves = periods(self.cogging_n_m, self.cogging_per_turn).max(periods(self.ripple, self.ripple_per_turn));
        current.max(spring).max((waves * speed).abs().min(SPINNING_RAD_S))
    }

    /// Returns true without friction, cogging, ripple and supply. A lag is linear.
    pub(super) fn is_linear(&self) -> bool {
        self.friction.largest_n_m() == 0.0 && self.cogging_n_m == 0.0 && self.ripple == 0.0 && self.supply.is_none()
    }

    /// Writes the row of a lagging current into the last of `order` states. Returns the factor of u in the last row.
    /// `per_a` is the effect of the current without a lag.
    pub(super) fn lagged(&self, order: usize, per_a: f64, a: &mut [[f64; MAX_ORDER]; MAX_ORDER]) -> f64 {
        if self.lag_s > 0.0 {
            a[order - 2][order - 1] = per_a;
            a[order - 1][order - 1] = -1.0 / self.lag_s;
            1.0 / self.lag_s
        } else {
            per_a
        }
    }

    /// Returns the flowing current: the last state with a lag, u without.
    pub(super) fn current(&self, x: &[f64], u: f64) -> f64 {
        if self.lag_s > 0.0 { x.last().copied().unwrap_or(u) } else { u }
    }
}

/// Motor with its load.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    truth: Shaft,
    nominal: Shaft,
    imperfections: Imperfections,
    load: Signal,
    /// Fastest rates without friction and at the steepest friction, rad/s.
    rates_rad_s: [f64; 2],
    jumps_s: Vec<f64>,
    numbers: Numbers<3>,
    exact: Option<Exact>,
}

impl Motor {
    /// Builds a motor with the true parameters `truth` and the model `nominal` of the controller. `load` is in N m.
    pub fn new(truth: Shaft, nominal: Shaft, imperfections: Imperfections, load: Signal) -> Self {
        let rates_rad_s = [0.0, imperfections.damping_n_m_s()].map(|friction| {
            let braking = imperfections.braking_n_m_s(truth.torque_n_m_per_a);
            ((truth.damping_n_m_s + braking + friction) / truth.inertia_kg_m2).max(fastest_signal_rad_s([&load]))
        });
        let jumps_s = merged_jumps_s([&load]);
        let numbers = shafts::of_motor(&truth, &imperfections);
        Self { truth, nominal, imperfections, load, rates_rad_s, jumps_s, numbers, exact: None }
    }

    /// Adds the motor's own step from tick to tick, if it is linear: without friction, cogging, ripple and supply.
    #[must_use]
    pub fn sampled(self, period_s: f64) -> Self {
        let Shaft { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s } = self.truth;
        let (mut a, order) = ([[0.0; MAX_ORDER]; MAX_ORDER], self.order());
        a[0][1] = 1.0;
        a[1][1] = -damping_n_m_s / inertia_kg_m2;
        let b = self.imperfections.lagged(order, torque_n_m_per_a / inertia_kg_m2, &mut a);
        let signals = [(1, -1.0 / inertia_kg_m2, self.load.clone())];
        let part = LinearPart { a, order, b, signals: &signals, sine: 0.0, fastest_rad_s: self.rates_rad_s[0] };
        let exact = if self.imperfections.is_linear() { Exact::new(&part, period_s) } else { None };
        Self { exact, ..self }
    }

    /// Returns the torque on the shaft at standstill, N m.
    fn push_n_m(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        let load = self.load.value(t_s);
        match *x {
            [a, b] => self.imperfections.push_n_m(&self.numbers, &[a, b], u, load),
            [a, b, c] => self.imperfections.push_n_m(&self.numbers, &[a, b, c], u, load),
            _ => unreachable!("a motor of order {}", x.len()),
        }
    }
}

impl Plant for Motor {
    /// Returns 2, or 3 with a lag.
    fn order(&self) -> usize {
        if self.imperfections.lag_s > 0.0 { 3 } else { 2 }
    }

    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.rhs_in(self.regime(t_s, x, u), t_s, x, u, dx);
    }

    fn regime(&self, t_s: f64, x: &[f64], u: f64) -> Regime {
        self.imperfections.regime(x, || self.push_n_m(t_s, x, u))
    }

    fn rhs_in(&self, regime: Regime, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let load = self.load.value(t_s);
        let of = &self.imperfections;
        match x.len() {
            2 => of.put_rates::<2, 3>(regime, &self.numbers, (x, u, load), dx),
            3 => of.put_rates::<3, 3>(regime, &self.numbers, (x, u, load), dx),
            order => unreachable!("a motor of order {order}"),
        }
    }

    fn margin(&self, regime: Regime, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.imperfections.margin(regime, x, || self.push_n_m(t_s, x, u))
    }

    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        let Shaft { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s } = self.nominal;
        let current = self.imperfections.current(x, self.driven(x, u));
        self.rhs(t_s, x, u, d);
        let truth = d[1];
        d.fill(0.0);
        d[1] = truth - (torque_n_m_per_a * current - damping_n_m_s * x[1]) / inertia_kg_m2;
    }

    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        let Shaft { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s } = self.truth;
        let u = self.driven(x, u);
        // A lagging current stays between the flowing current and u.
        let current = self.imperfections.current(x, u).abs().max(u.abs());
        let torque = self.imperfections.largest_n_m(torque_n_m_per_a, current)
            + (damping_n_m_s * x[1]).abs()
            + self.load.value(t_s).abs();
        let others = self.imperfections.fastest_rad_s(inertia_kg_m2, x[1]);
        if x[1] == 0.0 && self.regime(t_s, x, u) == Regime::Held {
            return self.rates_rad_s[0].max(others);
        }
        // Factor 2, because load and speed grow within the step.
        let acceleration = 2.0 * torque / inertia_kg_m2;
        let pushed = || {
            let mut dx = [0.0; 3];
            self.rhs(t_s, x, u, &mut dx[..x.len()]);
            [dx[1], torque_n_m_per_a * dx[2] / inertia_kg_m2]
        };
        self.imperfections.friction.fastest_rad_s(self.rates_rad_s, x[1], acceleration, pushed).max(others)
    }

    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }

    fn exact(&self) -> Option<&Exact> {
        self.exact.as_ref()
    }

    fn driven(&self, x: &[f64], u: f64) -> f64 {
        self.imperfections.driven(self.truth.torque_n_m_per_a, x[1], u)
    }

    /// Returns `None` with a supply, which the coefficients do not include.
    fn parts(&self) -> Option<Parts<'_>> {
        let shafts = Parts::Shafts { numbers: &self.numbers, load: &self.load };
        self.imperfections.supply.is_none().then_some(shafts)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::signal::Term;
    use crate::solver;

    const SHAFT: Shaft = Shaft { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-3 };

    fn after(motor: &Motor, x: &[f64], u: f64, span_s: f64) -> Vec<f64> {
        let mut x = x.to_vec();
        let ticks = 100;
        for k in 0..ticks {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) * span_s / f64::from(ticks));
            solver::advance(motor, from, to, u, &mut x).expect("a slow plant");
        }
        x
    }

    const SUPPLY: Supply = Supply { volt: 12.0, ohm: 0.8 };

    /// Without a lag, 12 V limit the current to (V - K_t ω)/R all the way: ω = V/K_t (1 - e^(-t K_t²/(R J))).
    #[test]
    fn a_motor_at_its_supply_runs_up_to_the_no_load_speed() {
        let shaft = Shaft { damping_n_m_s: 0.0, ..SHAFT };
        for (torque, u) in [(0.05, 100.0), (0.05, -100.0), (-0.05, 100.0)] {
            let shaft = Shaft { torque_n_m_per_a: torque, ..shaft };
            let supplied = Imperfections { supply: Some(SUPPLY), ..Imperfections::default() };
            let motor = Motor::new(shaft, shaft, supplied, Signal::default());
            let (rate, end) = (0.05 * 0.05 / (0.8 * 2e-4), 12.0 / 0.05 * (torque * u).signum());
            for span_s in [0.02, 0.1, 2.0] {
                let found = after(&motor, &[0.0, 0.0], u, span_s);
                let speed = end * (1.0 - (-rate * span_s).exp());
                assert!((found[1] - speed).abs() < 1e-6 * end.abs(), "{span_s} s: {found:?}, {speed}");
                let flows = (12.0 * u.signum() - torque * speed) / 0.8;
                assert!((motor.driven(&found, u) - flows).abs() < 1e-4, "{span_s} s: {flows}");
            }
        }
    }

    /// Compares with (V - K_t ω)/R in 80 000 steps of Heun's method. The case has a current loop, friction of speed and
    /// a load. The motor drives, brakes, and turns faster than the supply allows under its load.
    #[test]
    fn a_supply_limits_a_current_that_lags_as_the_equations_say() {
        let lag_s = 1e-3;
        let imperfections = Imperfections { lag_s, supply: Some(SUPPLY), ..Imperfections::default() };
        let load = Signal::new(vec![Term::Step { amplitude: -0.8, t0_s: 0.06 }]);
        let motor = Motor::new(SHAFT, SHAFT, imperfections, load);
        let rates = |t_s: f64, [_, w, i]: [f64; 3], u: f64| {
            let most = (12.0 - 0.05 * w) / 0.8;
            let least = (-12.0 - 0.05 * w) / 0.8;
            let wanted = if u > most {
                most
            } else if u < least {
                least
            } else {
                u
            };
            let load = if t_s < 0.06 { 0.0 } else { -0.8 };
            [w, (0.05 * i - 1e-3 * w - load) / 2e-4, (wanted - i) / lag_s]
        };
        let (mut x, mut own, mut fastest, mut cut) = (vec![0.0; 3], [0.0; 3], 0.0_f64, 0);
        for k in 0..200 {
            let (from, u) = (f64::from(k) * 1e-3, if (40..60).contains(&k) { -14.0 } else { 14.0 });
            solver::advance(&motor, from, from + 1e-3, u, &mut x).expect("a slow plant");
            let h = 1e-3 / 400.0;
            for step in 0..400 {
                let t_s = from + (f64::from(step) + 0.5) * h;
                let first = rates(t_s, own, u);
                let then = rates(t_s, std::array::from_fn(|j| own[j] + h * first[j]), u);
                own = std::array::from_fn(|j| own[j] + 0.5 * h * (first[j] + then[j]));
            }
            fastest = fastest.max(x[1]);
            cut += u32::from(motor.driven(&x, u) != u);
            for (found, own) in x.iter().zip(own) {
                assert!((found - own).abs() < 1e-4 * (1.0 + own.abs()), "tick {k}: {x:?} {own:?}");
            }
        }
        // Beyond 240 rad/s only the load drives the shaft, and the current brakes at any demand.
        assert!(fastest > 250.0 && cut > 30, "{fastest} rad/s, {cut} ticks");
    }

    /// Expected: ω = (K_t u - load)/B (1 - e^(-t B/J)) without friction.
    #[test]
    fn a_motor_without_friction_runs_up_as_the_exponential() {
        let load = Signal::new(vec![Term::Const { amplitude: 0.02 }]);
        let motor = Motor::new(SHAFT, SHAFT, Imperfections::default(), load);
        let found = after(&motor, &[1.0, 0.0], 2.0, 0.5);
        let (end, rate) = ((0.1 - 0.02) / 1e-3, 1e-3 / 2e-4);
        let speed = end * (1.0 - (-rate * 0.5_f64).exp());
        let angle = 1.0 + end * 0.5 - speed / rate;
        assert!((found[1] - speed).abs() < 1e-9 * speed && (found[0] - angle).abs() < 1e-9 * angle, "{found:?}");
    }

    /// Expected: i = u (1 - e^(-t/τ)). With B = 0 the speed is K_t/J times its integral.
    #[test]
    fn the_current_lags_as_an_exponential() {
        let shaft = Shaft { damping_n_m_s: 0.0, ..SHAFT };
        let motor =
            Motor::new(shaft, shaft, Imperfections { lag_s: 2e-4, ..Imperfections::default() }, Signal::default());
        let found = after(&motor, &[0.0, 0.0, 0.0], 3.0, 1e-3);
        let left = (-5.0_f64).exp();
        assert!((found[2] - 3.0 * (1.0 - left)).abs() < 1e-9, "{found:?}");
        let speed = 250.0 * 3.0 * (1e-3 - 2e-4 * (1.0 - left));
        assert!((found[1] - speed).abs() < 1e-9 * speed, "{found:?}");
    }

    /// Above the level speed the shortcut is bit-identical to the formula.
    #[test]
    fn level_friction_has_the_bits_of_the_formula() {
        for (static_n_m, coulomb_n_m) in [(0.008, 0.005), (0.005, 0.005), (3.0, 0.0031), (1e-9, 2.0)] {
            for (stribeck_rad_s, smooth_rad_s) in [(0.1, 0.005), (0.02, 0.4), (1e-3, 1e-3)] {
                let friction = Friction { static_n_m, coulomb_n_m, stribeck_rad_s, smooth_rad_s };
                let level = (7.0 * stribeck_rad_s).max(22.0 * smooth_rad_s);
                for factor in [1.0_f64.next_up(), 1.01, 1.3, 2.0, 17.0, 1e6] {
                    for speed in [level * factor, -level * factor] {
                        let torque = shafts::friction(friction.numbers(), speed);
                        assert_eq!(friction.torque_n_m(speed).to_bits(), torque.to_bits(), "{friction:?} at {speed}");
                    }
                }
            }
        }
    }

    /// Compares with the formula of the module documentation, with the functions of `libm`.
    #[test]
    fn friction_is_that_of_its_formula() {
        let friction = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, stribeck_rad_s: 0.1, smooth_rad_s: 0.005 };
        for speed in (-3000..3000).map(|k| 1e-4 * f64::from(k) * f64::from(k).abs().sqrt()) {
            let bell = libm::exp(-(speed / 0.1) * (speed / 0.1));
            let torque = (0.005 + 0.003 * bell) * libm::tanh(speed / 0.005);
            assert!((friction.torque_n_m(speed) - torque).abs() <= 2e-15 * torque.abs(), "at {speed}");
        }
    }

    /// Balances the energy of the current against kinetic energy, heat of both frictions, work against the load and the
    /// potential of the cogging. The right-hand side is used only through F.
    #[test]
    fn energy_goes_nowhere_else() {
        let friction = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() };
        let imperfections = Imperfections {
            supply: None,
            friction,
            cogging_n_m: 0.003,
            cogging_per_turn: 7.0,
            ripple: 0.02,
            ripple_per_turn: 6.0,
            lag_s: 0.0,
        };
        let load = 0.01;
        let motor = Motor::new(SHAFT, SHAFT, imperfections, Signal::new(vec![Term::Const { amplitude: load }]));
        let (mut x, step_s) = ([0.2, 5.0], 1e-5);
        let stored = |x: &[f64; 2]| 0.5 * 2e-4 * x[1] * x[1] + 0.003 / 7.0 * (7.0 * x[0]).cos();
        let (before, start, mut flowed, mut put_in) = (stored(&x), x[0], 0.0, 0.0);
        for k in 0..20_000_u32 {
            let u = if k / 5000 % 2 == 0 { 0.9 } else { -0.6 };
            let power = |x: &[f64; 2]| {
                let gained = 0.05 * u * (1.0 + 0.02 * (6.0 * x[0]).sin()) * x[1];
                [gained, (1e-3 * x[1] + friction.torque_n_m(x[1])) * x[1]]
            };
            let first = power(&x);
            solver::advance(&motor, f64::from(k) * step_s, f64::from(k + 1) * step_s, u, &mut x).expect("slow");
            let last = power(&x);
            flowed += 0.5 * step_s * (first[0] + last[0] - first[1] - last[1]);
            put_in += 0.5 * step_s * (first[0] + last[0]).abs();
        }
        let balance = stored(&x) - before - flowed + load * (x[0] - start);
        // Trapezoid rule over 10 us.
        assert!(put_in > 0.03 && balance.abs() < 1e-7 * put_in, "{balance:e} J of {put_in} J");
    }

    #[test]
    fn the_lumped_disturbance_is_what_the_nominal_motor_does_not_explain() {
        let nominal = Shaft { inertia_kg_m2: 3e-4, torque_n_m_per_a: 0.04, damping_n_m_s: 0.0 };
        let imperfections = Imperfections {
            friction: Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() },
            lag_s: 1e-3,
            ..Imperfections::default()
        };
        let load = Signal::new(vec![Term::Step { amplitude: 0.1, t0_s: 0.3 }]);
        let motor = Motor::new(SHAFT, nominal, imperfections, load);
        let (mut dx, mut d, x) = ([0.0; 3], [7.0; 3], [0.4, 30.0, 2.0]);
        motor.rhs(0.5, &x, 9.0, &mut dx);
        motor.lumped(0.5, &x, 9.0, &mut d);
        assert!((dx[1] - d[1] - 0.04 * 2.0 / 3e-4).abs() < 1e-9 && [d[0], d[2]] == [0.0; 2], "{dx:?} {d:?}");
        // Far above ω_s friction is Coulomb's: (K_t i - B ω - F_c - load)/J.
        assert!((dx[1] - (0.1 - 0.03 - 0.005 - 0.1) / 2e-4).abs() < 1e-9, "{dx:?}");
        assert_eq!((motor.order(), motor.jumps_s()), (3, &[0.3][..]));
    }

    /// A torque below static friction makes a shaft creep at the speed at which the smoothed friction equals it.
    #[test]
    fn friction_holds_a_shaft_but_for_creep() {
        let friction = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() };
        let motor = Motor::new(SHAFT, SHAFT, Imperfections { friction, ..Imperfections::default() }, Signal::default());
        let found = after(&motor, &[0.0, 0.0], 0.08, 0.1);
        // 0.004 of 0.008 N m: tanh x = 1/2 at x = 0.549, less a small effect of ω_s and B.
        assert!((found[1] / (0.549 * 0.005) - 1.0).abs() < 0.01, "{found:?}");
    }

    /// Motor that is stepped with a given rate, with a count of the evaluations.
    struct Steep<'a>(&'a Motor, Option<f64>, AtomicUsize);

    impl Plant for Steep<'_> {
        fn order(&self) -> usize {
            self.0.order()
        }

        fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
            self.2.fetch_add(1, Ordering::Relaxed);
            self.0.rhs(t_s, x, u, dx);
        }

        fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
            self.0.lumped(t_s, x, u, d);
        }

        fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
            self.1.unwrap_or_else(|| self.0.fastest_rad_s(t_s, x, u))
        }

        fn jumps_s(&self) -> &[f64] {
            self.0.jumps_s()
        }
    }

    /// Moves a shaft through the corner of its friction, at once or through the lag of the current, in short and long
    /// ticks. No step is so long that the corner is underestimated. The reference takes 30 steps for each step of the
    /// plant. Half of the step that friction alone requires would err by up to 1 % of the speed.
    #[test]
    fn a_shaft_turns_round_the_corner_of_its_friction_as_in_finer_steps() {
        let bell = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() };
        let plain = Friction { static_n_m: 0.005, coulomb_n_m: 0.005, ..Friction::default() };
        for (friction, lag_s, period_s) in
            [(bell, 0.0, 1e-3), (plain, 0.0, 2e-3), (bell, 2e-4, 1e-3), (plain, 1e-3, 2e-3), (plain, 0.0, 2e-4)]
        {
            let motor =
                Motor::new(SHAFT, SHAFT, Imperfections { friction, lag_s, ..Default::default() }, Signal::default());
            let order = motor.order();
            let (mut found, mut finest) = (vec![0.0; order], vec![0.0; order]);
            let (mut apart, mut largest, mut turns) = (0.0_f64, 0.0_f64, 0);
            for k in 0..2000 {
                let from = f64::from(k) * period_s;
                // The demand is held over a tick, as with a controller.
                let u = 1.5 * libm::sin(19.0 * from);
                let before = found[1];
                solver::advance(&motor, from, from + period_s, u, &mut found).expect("a slow plant");
                for part in 0..30 {
                    let [from, to] = [part, part + 1].map(|part| from + f64::from(part) * period_s / 30.0);
                    let rate = motor.fastest_rad_s(from, &finest, u);
                    let finer = Steep(&motor, Some(30.0 * rate), AtomicUsize::new(0));
                    solver::advance(&finer, from, to, u, &mut finest).expect("a slow plant");
                }
                turns += usize::from(before * found[1] < 0.0);
                apart = apart.max((found[1] - finest[1]).abs());
                largest = largest.max(finest[1].abs());
                // Each tick starts from the reference, so that errors do not accumulate.
                found.clone_from(&finest);
            }
            println!("{friction:?} {lag_s} {period_s}: {:.1e} of {largest:.3}, {turns} turns", apart / largest);
            assert!(turns >= 2 && apart < 1e-9 * largest, "lag {lag_s} s, {period_s} s: {apart:.1e} of {largest}");
        }
    }

    /// A shaft that swings back and forth: the longer steps in motion cost no accuracy at the reversals.
    #[test]
    fn friction_is_stepped_finely_only_where_it_is_steep() {
        let friction = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() };
        let imperfections =
            Imperfections { friction, cogging_n_m: 0.003, cogging_per_turn: 7.0, lag_s: 5e-4, ..Default::default() };
        let load = Signal::new(vec![Term::Sin { amplitude: 0.004, omega_rad_s: 30.0, phase_rad: 0.3 }]);
        let motor = Motor::new(SHAFT, SHAFT, imperfections, load);
        let steep = motor.rates_rad_s[1];
        let [mut coarse, mut fine, mut finest] = [[0.1, 0.0, 0.0]; 3];
        let [saving, as_before, oracle] =
            [None, Some(steep), Some(8.0 * steep)].map(|rate| Steep(&motor, rate, AtomicUsize::new(0)));
        let (mut apart, mut before, mut largest) = ([0.0_f64; 3], [0.0_f64; 3], [0.0_f64; 3]);
        for k in 0..1000 {
            let (from, to) = (f64::from(k) * 1e-3, f64::from(k + 1) * 1e-3);
            let u = 0.4 * libm::sin(12.0 * from);
            for (plant, x) in [(&saving, &mut coarse), (&as_before, &mut fine), (&oracle, &mut finest)] {
                solver::advance(plant, from, to, u, x).expect("a slow plant");
            }
            for i in 0..3 {
                apart[i] = apart[i].max((coarse[i] - finest[i]).abs());
                before[i] = before[i].max((fine[i] - finest[i]).abs());
                largest[i] = largest[i].max(finest[i].abs());
            }
        }
        let [saved, all] = [saving.2, as_before.2].map(AtomicUsize::into_inner);
        // At a reversal the errors of all step lengths are alike.
        for i in 0..3 {
            assert!(apart[i] <= 1.01 * before[i] + 1e-12 * largest[i], "{apart:?} {before:?} {largest:?}");
        }
        assert!(5 * saved < 2 * all, "{saved} of {all} evaluations");
    }
}
