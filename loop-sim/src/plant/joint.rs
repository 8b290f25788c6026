//! True flexible joint with custom parameters: two inertias on a spring, in SI units.
//!
//! $$ J_l \ddot q = K (q_m - q) + D (\dot q_m - \dot q) - B_l \dot q - W \sin q - \text{load}(t) $$
//! $$ J_m \ddot q_m = K (q - q_m) + D (\dot q - \dot q_m) - B_m \dot q_m - F(\dot q_m) + K_t i \thinspace (1 + \ldots)
//!    + \ldots, \qquad \tau \thinspace \dot i = u - i $$
//!
//! The states are the angle and speed of the link, then of the motor, both on the link side of a gear (rad, rad/s).
//! With a lag the current (A) follows. Friction, cogging and ripple of the motor are as in [`Motor`](super::Motor). A
//! load is positive against positive motion of the link. W is the torque of the link's weight when the link is level,
//! and at angle 0 the link hangs down. As in `Motor`, a supply limits u by the speed of the motor.
//!
//! The model of the controller is the same with its own parameters, without D and F. The lumped disturbances d_2 and
//! d_4 (rad/s²) are the parts that the model lacks at each shaft. As for the motor they are taken with the flowing
//! current.

use super::motor::{Imperfections, Shaft};
use super::shafts::{self, Numbers};
use super::{Parts, Plant, Regime, fastest_signal_rad_s, merged_jumps_s, spectral_bound};
use crate::MAX_ORDER;
use crate::exact::{Exact, LinearPart};
use crate::signal::Signal;
use crate::sine;
use crate::solver::STEP_ANGLE;

/// Link speed above which the solver does not resolve sin q, rad/s.
const SPINNING_RAD_S: f64 = 1e4;

/// Parameters of link, spring and motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointBody {
    /// Inertia of the link J_l, kg m².
    pub link_inertia_kg_m2: f64,
    /// Viscous damping of the link B_l, N m s/rad.
    pub link_damping_n_m_s: f64,
    /// Weight torque W of the level link, N m.
    pub weight_n_m: f64,
    /// Stiffness of the spring K, N m/rad.
    pub stiffness_n_m: f64,
    /// Damping of the spring D, N m s/rad.
    pub spring_damping_n_m_s: f64,
    /// Motor parameters J_m, B_m and K_t, on the link side of the gear.
    pub motor: Shaft,
}

/// Converts data-sheet parameters, which have no damping in the spring.
impl From<&controller_core::drive::Joint> for JointBody {
    fn from(sheet: &controller_core::drive::Joint) -> Self {
        Self {
            link_inertia_kg_m2: sheet.link_inertia_kg_m2,
            link_damping_n_m_s: sheet.link_damping_n_m_s,
            weight_n_m: sheet.weight_n_m,
            stiffness_n_m: sheet.stiffness_n_m,
            spring_damping_n_m_s: 0.0,
            motor: Shaft {
                inertia_kg_m2: sheet.motor_inertia_kg_m2,
                torque_n_m_per_a: sheet.torque_n_m_per_a,
                damping_n_m_s: sheet.motor_damping_n_m_s,
            },
        }
    }
}

impl JointBody {
    /// Returns the Jacobian at a link that hangs still, with this friction slope on the motor and without the weight.
    fn jacobian(&self, friction_n_m_s: f64) -> [[f64; MAX_ORDER]; MAX_ORDER] {
        let (k, d) = (self.stiffness_n_m, self.spring_damping_n_m_s);
        let held = self.motor.damping_n_m_s + friction_n_m_s;
        let mut a = [[0.0; MAX_ORDER]; MAX_ORDER];
        (a[0][1], a[2][3]) = (1.0, 1.0);
        let of_link = [-k, -d - self.link_damping_n_m_s, k, d];
        let of_motor = [k, d, -k, -d - held];
        for j in 0..4 {
            a[1][j] = of_link[j] / self.link_inertia_kg_m2;
            a[3][j] = of_motor[j] / self.motor.inertia_kg_m2;
        }
        a
    }

    /// Returns the coefficients of the right-hand side.
    fn numbers(&self, imperfections: &Imperfections) -> Numbers<5> {
        let [shaft, waves, friction] = shafts::of_motor(&self.motor, imperfections);
        let link = [1.0 / self.link_inertia_kg_m2, self.link_damping_n_m_s, self.weight_n_m, self.stiffness_n_m];
        [shaft, waves, friction, link, [self.spring_damping_n_m_s, 0.0, 0.0, 0.0]]
    }

    /// Returns the accelerations of link and motor without friction and load, under this torque on the motor.
    fn accelerations(&self, x: &[f64], torque: f64) -> [f64; 2] {
        let spring = self.stiffness_n_m * (x[2] - x[0]) + self.spring_damping_n_m_s * (x[3] - x[1]);
        let link = spring - self.link_damping_n_m_s * x[1] - self.weight_n_m * sine::sin(x[0]);
        let motor = torque - spring - self.motor.damping_n_m_s * x[3];
        [link / self.link_inertia_kg_m2, motor / self.motor.inertia_kg_m2]
    }
}

/// Flexible joint with its load.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    truth: JointBody,
    nominal: JointBody,
    imperfections: Imperfections,
    load: Signal,
    /// Fastest rates without friction and at the steepest friction, rad/s.
    rates_rad_s: [f64; 2],
    jumps_s: Vec<f64>,
    numbers: Numbers<5>,
    /// Half of the play between flanks, rad, if the joint has flanks instead of a spring. Then `numbers` has no spring.
    half_play: Option<f64>,
    exact: Option<Exact>,
}

impl Joint {
    /// Builds a joint with the true parameters `truth` and the model `nominal` of the controller. `load` acts on the
    /// link, N m.
    pub fn new(truth: JointBody, nominal: JointBody, imperfections: Imperfections, load: Signal) -> Self {
        let rates_rad_s = [0.0, imperfections.damping_n_m_s()].map(|friction| {
            let mut jacobian = truth.jacobian(friction + imperfections.braking_n_m_s(truth.motor.torque_n_m_per_a));
            jacobian[1][0] = (-truth.stiffness_n_m - truth.weight_n_m) / truth.link_inertia_kg_m2;
            spectral_bound(jacobian).max(fastest_signal_rad_s([&load]))
        });
        let jumps_s = merged_jumps_s([&load]);
        let numbers = truth.numbers(&imperfections);
        Self { truth, nominal, imperfections, load, rates_rad_s, jumps_s, numbers, half_play: None, exact: None }
    }

    /// Replaces the spring by flanks with this play, which push and never pull.
    #[must_use]
    pub(super) fn with_play(mut self, play_rad: f64) -> Self {
        self.half_play = Some(0.5 * play_rad);
        self.numbers[3][3] = 0.0;
        self.numbers[4][0] = 0.0;
        self
    }

    /// Returns the torque of the flanks on the link, N m. The opposite torque acts on the motor.
    fn flank_n_m(&self, x: &[f64]) -> f64 {
        let Some(half_play) = self.half_play else { return 0.0 };
        let JointBody { stiffness_n_m, spring_damping_n_m_s, .. } = self.truth;
        let twist = x[2] - x[0];
        let over = twist - twist.max(-half_play).min(half_play);
        let pushed = stiffness_n_m * over + spring_damping_n_m_s * (x[3] - x[1]);
        if over * pushed > 0.0 { pushed } else { 0.0 }
    }

    /// Returns the flowing current, A.
    pub(super) fn current(&self, x: &[f64], u: f64) -> f64 {
        self.imperfections.current(x, self.driven(x, u))
    }

    /// Adds the joint's own step from tick to tick, if only the weight is nonlinear. It requires no friction, cogging,
    /// ripple, supply and spring damping.
    #[must_use]
    pub fn sampled(self, period_s: f64) -> Self {
        let JointBody { link_inertia_kg_m2: link, weight_n_m, motor, .. } = self.truth;
        let (mut a, order) = (self.truth.jacobian(0.0), self.order());
        let b = self.imperfections.lagged(order, motor.torque_n_m_per_a / motor.inertia_kg_m2, &mut a);
        let signals = [(1, -1.0 / link, self.load.clone())];
        let fastest_rad_s = self.rates_rad_s[0];
        let part = LinearPart { a, order, b, signals: &signals, sine: weight_n_m / link, fastest_rad_s };
        let exact =
            if self.imperfections.is_linear() && self.half_play.is_none() { Exact::new(&part, period_s) } else { None };
        Self { exact, ..self }
    }

    /// Returns the torque on the motor shaft at standstill, N m.
    fn push_n_m(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        let load = self.load.value(t_s);
        let push = match *x {
            [a, b, c, d] => self.imperfections.push_n_m(&self.numbers, &[a, b, c, d], u, load),
            [a, b, c, d, e] => self.imperfections.push_n_m(&self.numbers, &[a, b, c, d, e], u, load),
            _ => unreachable!("a joint of order {}", x.len()),
        };
        push - self.flank_n_m(x)
    }
}

impl Plant for Joint {
    /// Returns 4, or 5 with a lag.
    fn order(&self) -> usize {
        if self.imperfections.lag_s > 0.0 { 5 } else { 4 }
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
            4 => of.put_rates::<4, 5>(regime, &self.numbers, (x, u, load), dx),
            5 => of.put_rates::<5, 5>(regime, &self.numbers, (x, u, load), dx),
            order => unreachable!("a joint of order {order}"),
        }
        if self.half_play.is_some() {
            let flank = self.flank_n_m(x);
            dx[1] += flank / self.truth.link_inertia_kg_m2;
            if regime != Regime::Held {
                dx[3] -= flank / self.truth.motor.inertia_kg_m2;
            }
        }
    }

    fn margin(&self, regime: Regime, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.imperfections.margin(regime, x, || self.push_n_m(t_s, x, u))
    }

    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        let current = self.current(x, u);
        self.rhs(t_s, x, u, d);
        let truth = [d[1], d[3]];
        let believed = JointBody { spring_damping_n_m_s: 0.0, ..self.nominal };
        let believed = believed.accelerations(x, self.nominal.motor.torque_n_m_per_a * current);
        d.fill(0.0);
        (d[1], d[3]) = (truth[0] - believed[0], truth[1] - believed[1]);
    }

    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        let JointBody { stiffness_n_m, spring_damping_n_m_s, motor, .. } = self.truth;
        let u = self.driven(x, u);
        let current = self.imperfections.current(x, u).abs().max(u.abs());
        // The shafts wind the spring up further during a step.
        let wound = (x[2] - x[0]).abs() + STEP_ANGLE * (x[1].abs() + x[3].abs()) / self.rates_rad_s[0];
        let torque = self.imperfections.largest_n_m(motor.torque_n_m_per_a, current)
            + stiffness_n_m * wound
            + spring_damping_n_m_s * (x[3] - x[1]).abs()
            + (motor.damping_n_m_s * x[3]).abs();
        let others = self.imperfections.fastest_rad_s(motor.inertia_kg_m2, x[3]).max(x[1].abs().min(SPINNING_RAD_S));
        if x[3] == 0.0 && self.regime(t_s, x, u) == Regime::Held {
            return self.rates_rad_s[0].max(others);
        }
        // Factor 2, because the torque grows within the step.
        let acceleration = 2.0 * torque / motor.inertia_kg_m2;
        let pushed = || {
            let mut dx = [0.0; 5];
            self.rhs(t_s, x, u, &mut dx[..x.len()]);
            let growth = motor.torque_n_m_per_a * dx[4] + stiffness_n_m * (x[1] - x[3]);
            [dx[3], growth / motor.inertia_kg_m2]
        };
        self.imperfections.friction.fastest_rad_s(self.rates_rad_s, x[3], acceleration, pushed).max(others)
    }

    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }

    fn exact(&self) -> Option<&Exact> {
        self.exact.as_ref()
    }

    fn driven(&self, x: &[f64], u: f64) -> f64 {
        self.imperfections.driven(self.truth.motor.torque_n_m_per_a, x[3], u)
    }

    /// Returns `None` with a supply, which the coefficients do not include.
    fn parts(&self) -> Option<Parts<'_>> {
        let shafts = Parts::Shafts { numbers: &self.numbers, load: &self.load };
        (self.imperfections.supply.is_none() && self.half_play.is_none()).then_some(shafts)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FlexibleJoint, JointErrors};
    use super::*;
    use crate::plant::motor::Friction;
    use crate::signal::Term;
    use crate::solver;
    use controller_core::{JointParameters, Reading};

    /// Returns the joint of the paper: gravity is 1 rad/s² of the link.
    fn table_i() -> JointBody {
        let JointParameters { kt, j11, j12, b12, ks, .. } = JointParameters::TABLE_I;
        let motor = Shaft { inertia_kg_m2: j11, torque_n_m_per_a: kt, damping_n_m_s: b12 };
        JointBody {
            link_inertia_kg_m2: j12,
            link_damping_n_m_s: b12,
            weight_n_m: j12,
            stiffness_n_m: ks,
            spring_damping_n_m_s: 0.0,
            motor,
        }
    }

    /// Compares it with [`FlexibleJoint`](super::super::FlexibleJoint) in chain coordinates, which has its own
    /// reference.
    #[test]
    fn the_joint_of_the_paper_is_its_physical_reading() {
        let chain = JointParameters::TABLE_I.chain(Reading::Physical);
        let paper = FlexibleJoint::new(chain, JointErrors::default(), Signal::default(), <[Signal; 4]>::default());
        let joint = Joint::new(table_i(), table_i(), Imperfections::default(), Signal::default());
        let (q, w, motor, speed, u) = (0.4, -0.3, 0.5, 2.0, 1.7);
        let (mut found, mut expected) = ([0.0; 4], [0.0; 4]);
        joint.rhs(0.0, &[q, w, motor, speed], u, &mut found);
        paper.rhs(0.0, &[q, w, chain.k1 * motor, chain.k1 * speed], u, &mut expected);
        let scale = [1.0, 1.0, chain.k1, chain.k1];
        for i in 0..4 {
            let difference = found[i] * scale[i] - expected[i];
            assert!(difference.abs() < 1e-12 * (1.0 + expected[i].abs()), "channel {}: {difference}", i + 1);
        }
    }

    /// Balances kinetic energy, spring and weight against the losses of dampers and friction and the work of current
    /// and load.
    #[test]
    fn energy_goes_nowhere_else() {
        let body = JointBody { spring_damping_n_m_s: 0.05, weight_n_m: 1.5, ..table_i() };
        let friction = Friction { static_n_m: 0.02, coulomb_n_m: 0.01, stribeck_rad_s: 0.5, smooth_rad_s: 0.1 };
        let imperfections = Imperfections { friction, ..Imperfections::default() };
        let load = 0.3;
        let joint = Joint::new(body, body, imperfections, Signal::new(vec![Term::Const { amplitude: load }]));
        let (mut x, step_s) = ([0.3, 0.0, 0.35, 0.0], 2e-5);
        let stored = |x: &[f64; 4]| {
            let kinetic = body.link_inertia_kg_m2 * x[1] * x[1] + body.motor.inertia_kg_m2 * x[3] * x[3];
            let twist = x[2] - x[0];
            0.5 * (kinetic + body.stiffness_n_m * twist * twist) + body.weight_n_m * (1.0 - x[0].cos())
        };
        let (before, start, mut flowed, mut turned_over) = (stored(&x), x[0], 0.0, 0.0);
        for k in 0..20_000_u32 {
            let u = if k / 4000 % 2 == 0 { 4.0 } else { -6.0 };
            let power = |x: &[f64; 4]| {
                let twisting = x[3] - x[1];
                let heat = 0.05 * twisting * twisting + 0.07 * (x[1] * x[1] + x[3] * x[3]);
                body.motor.torque_n_m_per_a * u * x[3] - heat - friction.torque_n_m(x[3]) * x[3]
            };
            let first = power(&x);
            solver::advance(&joint, f64::from(k) * step_s, f64::from(k + 1) * step_s, u, &mut x).expect("slow");
            flowed += 0.5 * step_s * (first + power(&x));
            turned_over += step_s * first.abs();
        }
        let balance = stored(&x) - before - flowed + load * (x[0] - start);
        // Trapezoid rule over 20 us for a spring with 98 rad/s.
        assert!(turned_over > 0.1 && balance.abs() < 1e-5 * turned_over, "{balance:e} J of {turned_over} J");
    }

    #[test]
    fn the_lumped_disturbances_are_what_the_nominal_joint_does_not_explain() {
        let truth = JointBody { spring_damping_n_m_s: 0.05, weight_n_m: 0.5, ..table_i() };
        let load = Signal::new(vec![Term::Const { amplitude: 0.1 }]);
        let imperfections = Imperfections { lag_s: 1e-3, ..Imperfections::default() };
        let [joint, believed] = [truth, table_i()].map(|body| {
            Joint::new(body, table_i(), imperfections, if body == truth { load.clone() } else { Signal::default() })
        });
        let (x, mut d, mut dx, mut nominal) = ([0.3, 1.0, 0.2, -2.0, 3.0], [1.0; 5], [0.0; 5], [0.0; 5]);
        joint.lumped(0.0, &x, 8.0, &mut d);
        joint.rhs(0.0, &x, 8.0, &mut dx);
        believed.rhs(0.0, &x, 8.0, &mut nominal);
        assert!((dx[1] - nominal[1] - d[1]).abs() < 1e-9 && (dx[3] - nominal[3] - d[3]).abs() < 1e-9, "{d:?}");
        // Expected by hand: the damper pulls the link back by 0.05 * 3, the weight by 0.27 sin 0.3, the load by 0.1.
        let link = (-0.15 - 0.27 * 0.3_f64.sin() - 0.1) / 0.23;
        assert!((d[1] - link).abs() < 1e-12 && (d[3] - 0.15 / 931e-6).abs() < 1e-9, "{d:?}");
        assert_eq!([d[0], d[2], d[4]], [0.0; 3]);
    }
}
