//! True plant from its equations, without Rust.
//!
//! $$ \dot x_i = f_i(x_1, .., x_n, u, t) + w_i(t) $$
//!
//! Any right-hand side is allowed. It may contain disturbances without jumps. Disturbances with jumps are the signals
//! w. The model of the controller is a chain of integrators that ends in a(x) + b(x) u, Eq. (39). The remainder is a
//! disturbance: $d_i = f_i + w_i - x_{i+1}$ for i < n, and $d_n = f_n + w_n - a(x) - b(x) u$.
//!
//! The fastest rate comes from the plant linearised at the current state, with exact derivatives. It misses the change
//! on the way, of sin(300 t) or of a cube. So the solver checks each step ([`Plant::is_checked`]).

use super::{ChainError, Parts, Plant, fastest_signal_rad_s, merged_jumps_s, spectral_bound};
use crate::MAX_ORDER;
use crate::expression::Expression;
use crate::signal::Signal;

/// Plant whose right-hand side is given by formulas.
#[derive(Clone, Debug, PartialEq)]
pub struct Own {
    rates: Vec<Expression>,
    drift: Expression,
    gain: Expression,
    disturbances: Vec<Signal>,
    fastest_signal_rad_s: f64,
    jumps_s: Vec<f64>,
}

impl Own {
    /// Builds the plant. f_1..f_n are formulas of x_1..x_n, u, t. The nominal a and b are formulas of x_1..x_n. The
    /// disturbances are w_1..w_n.
    ///
    /// # Errors
    /// Fails if the order is not 2..=6 or the number of disturbances differs from it.
    pub fn new(
        rates: Vec<Expression>,
        drift: Expression,
        gain: Expression,
        disturbances: Vec<Signal>,
    ) -> Result<Self, ChainError> {
        let order = rates.len();
        if !(2..=MAX_ORDER).contains(&order) {
            return Err(ChainError::Order { order });
        }
        if disturbances.len() != order {
            return Err(ChainError::Disturbances { order, given: disturbances.len() });
        }
        let fastest_signal_rad_s = fastest_signal_rad_s(&disturbances);
        let jumps_s = merged_jumps_s(&disturbances);
        Ok(Self { rates, drift, gain, disturbances, fastest_signal_rad_s, jumps_s })
    }

    /// Returns x_1..x_n, u and t in one row.
    fn inputs(&self, t_s: f64, x: &[f64], u: f64) -> [f64; MAX_ORDER + 2] {
        let (n, mut inputs) = (self.order(), [0.0; MAX_ORDER + 2]);
        inputs[..n].copy_from_slice(x);
        (inputs[n], inputs[n + 1]) = (u, t_s);
        inputs
    }

    fn fastest_mode_rad_s<const N: usize>(&self, inputs: &[f64]) -> f64 {
        let mut jacobian = [[0.0; N]; N];
        for (row, rate) in jacobian.iter_mut().zip(&self.rates) {
            *row = rate.slopes(inputs, 0);
        }
        spectral_bound(jacobian)
    }

    /// Returns f_1..f_n.
    #[cfg(feature = "lanes")]
    pub(crate) fn rates(&self) -> &[Expression] {
        &self.rates
    }

    /// Returns w_1..w_n.
    #[cfg(feature = "lanes")]
    pub(crate) fn disturbances(&self) -> &[Signal] {
        &self.disturbances
    }
}

impl Plant for Own {
    fn order(&self) -> usize {
        self.rates.len()
    }

    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let inputs = self.inputs(t_s, x, u);
        for ((dx, rate), disturbance) in dx.iter_mut().zip(&self.rates).zip(&self.disturbances) {
            *dx = rate.value(&inputs) + disturbance.value(t_s);
        }
    }

    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        self.rhs(t_s, x, u, d);
        let n = self.order();
        for i in 1..n {
            d[i - 1] -= x[i];
        }
        d[n - 1] -= self.drift.value(x) + self.gain.value(x) * u;
    }

    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        let inputs = self.inputs(t_s, x, u);
        macro_rules! of_order {
            ($($n:literal)*) => {
                match self.order() {
                    $($n => self.fastest_mode_rad_s::<$n>(&inputs),)*
                    order => unreachable!("a plant of order {order}, beyond {MAX_ORDER}"),
                }
            };
        }
        of_order!(2 3 4 5 6).max(self.fastest_signal_rad_s)
    }

    fn is_checked(&self) -> bool {
        true
    }

    fn parts(&self) -> Option<Parts<'_>> {
        Some(Parts::Own(self))
    }

    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{FlexibleJoint, JointErrors};
    use crate::signal::Term;
    use crate::solver::{self, SolverError};
    use controller_core::{JointChain, JointParameters, Reading};
    use core::f64::consts::FRAC_PI_2;
    use std::collections::BTreeMap;

    fn own_with(rates: &[&str], constants: &[(&str, f64)], disturbances: Vec<Signal>) -> Own {
        let constants = constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let names = ["x1", "x2", "x3", "x4", "x5", "x6"];
        let inputs: Vec<&str> = names[..rates.len()].iter().copied().chain(["u", "t"]).collect();
        let read = |text: &&str| Expression::parse(text, &inputs, &constants).expect(text);
        let nothing = Expression::linear(&[]);
        Own::new(rates.iter().map(read).collect(), nothing.clone(), nothing, disturbances).expect("a plant")
    }

    fn own(rates: &[&str], constants: &[(&str, f64)]) -> Own {
        own_with(rates, constants, vec![Signal::default(); rates.len()])
    }

    /// Returns the state after `span_s`, in this number of ticks with u = 0.
    fn after<const N: usize>(plant: &Own, mut x: [f64; N], span_s: f64, ticks: u32) -> [f64; N] {
        for k in 0..ticks {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) * span_s / f64::from(ticks));
            solver::advance(plant, from, to, 0.0, &mut x).expect("a plant that can be moved");
        }
        x
    }

    #[test]
    fn the_joint_by_its_formulas_moves_as_the_built_in_one() {
        let chain = JointParameters::TABLE_I.chain(Reading::Physical);
        let JointChain { k1, b1, k2, b2, b, a1 } = chain;
        let rates = ["x2", "x3 - k1*x1 - b1*x2 - sin(x1)", "x4", "a1*x1 - k2*x3 - b2*x4 + b*(u + 1 + sin(2*t))"];
        let formulas = own(&rates, &[("k1", k1), ("b1", b1), ("k2", k2), ("b2", b2), ("b", b), ("a1", a1)]);
        let built_in =
            FlexibleJoint::new(chain, JointErrors::default(), FlexibleJoint::input_of_the_paper(), <_>::default());
        let mut states = [[0.1, 0.0, 0.0, 0.0]; 2];
        let mut largest = [0.0_f64; 4];
        for k in 0..3000_u32 {
            let u = if k / 70 % 2 == 0 { 3.0 } else { -2.0 };
            for (x, plant) in states.iter_mut().zip([&formulas as &dyn Plant, &built_in]) {
                solver::advance(plant, f64::from(k) * 1e-3, f64::from(k + 1) * 1e-3, u, x).expect("slow");
            }
            let [own, given] = states;
            for i in 0..4 {
                largest[i] = largest[i].max(given[i].abs());
                // Error of the solver: 4e-11 per unit of rate times time, and ω t is 300 at the end.
                assert!((own[i] - given[i]).abs() < 1e-8 * largest[i], "x{} at tick {k}: {own:?} {given:?}", i + 1);
            }
        }
        assert!(largest[0] > 0.1, "it has moved: {largest:?}");
    }

    #[test]
    fn a_pendulum_that_turns_over_keeps_its_energy() {
        let pendulum = own(&["x2", "-g/l*sin(x1)"], &[("g", 9.81), ("l", 0.5)]);
        let energy = |[angle, speed]: [f64; 2]| 0.5 * speed * speed - 9.81 / 0.5 * angle.cos();
        // Fast enough to turn over, and slow enough to stay near the top.
        for start in [[0.0, 8.9], [3.1, 0.0]] {
            let end = after(&pendulum, start, 10.0, 500);
            assert!((energy(end) - energy(start)).abs() < 1e-9 * 9.81 / 0.5, "{start:?} {end:?}");
        }
    }

    /// x'' = -x - x³ from rest at A has the period 4 K(m)/sqrt(1 + A²), m = A²/(2 (1 + A²)). K comes from the
    /// arithmetic-geometric mean.
    #[test]
    fn a_duffing_oscillator_is_back_after_the_period_of_the_elliptic_integral() {
        for start in [0.3_f64, 1.0, 5.0] {
            let m = start * start / (2.0 * (1.0 + start * start));
            let (mut a, mut g) = (1.0_f64, (1.0 - m).sqrt());
            for _ in 0..10 {
                (a, g) = (0.5 * (a + g), (a * g).sqrt());
            }
            let period_s = 4.0 * FRAC_PI_2 / a / (1.0 + start * start).sqrt();
            let [x, v] = after(&own(&["x2", "-x1 - x1^3"], &[]), [start, 0.0], period_s, 7);
            assert!((x - start).abs() < 1e-9 * start && v.abs() < 1e-8 * start * (1.0 + start), "{start}: {x} {v}");
        }
    }

    /// The limit cycle for μ = 1 has the period 6.6632868593 (Andersen and Geer, SIAM J. Appl. Math. 42, 1982).
    #[test]
    fn a_van_der_pol_oscillator_has_the_period_of_the_literature() {
        let oscillator = own(&["x2", "mu*(1 - x1^2)*x2 - x1"], &[("mu", 1.0)]);
        let start = after(&oscillator, [2.0, 0.0], 60.0, 600);
        let end = after(&oscillator, start, 6.663_286_859_3, 67);
        assert!((0..2).all(|i| (end[i] - start[i]).abs() < 1e-8), "{start:?} {end:?}");
    }

    /// x_2' = A cos(ω t) alone: the linearised plant has the rate 0, the function has not.
    #[test]
    fn a_disturbance_inside_the_formula_is_not_stepped_over() {
        let shaken = own(&["x2", "9e4*cos(300*t)"], &[]);
        // Ticks of 20 ms: six radians per tick.
        let [x, v] = after(&shaken, [0.0, 0.0], 0.2, 10);
        let phase = 60.0_f64;
        assert!((x - (1.0 - phase.cos())).abs() < 1e-7 && (v - 300.0 * phase.sin()).abs() < 1e-5, "{x} {v}");
    }

    #[test]
    fn what_the_controller_does_not_believe_is_the_lumped_disturbance() {
        let inputs = ["x1", "x2", "u", "t"];
        let read = |text: &str| Expression::parse(text, &inputs, &BTreeMap::new()).expect(text);
        let step = Signal::new(vec![Term::Step { amplitude: 0.5, t0_s: 2.0 }]);
        let rates = vec![read("x2 + 0.1*x1"), read("-9*sin(x1) + (2 + x1^2)*u + t")];
        let plant = Own::new(rates, read("-8*sin(x1)"), read("2 + x2"), vec![Signal::default(), step]).expect("one");
        let (x, u, mut d) = ([0.7_f64, -1.3], 0.9, [0.0; 2]);
        plant.lumped(3.0, &x, u, &mut d);
        let expected = [0.07, -x[0].sin() + (x[0] * x[0] - x[1]) * u + 3.0 + 0.5];
        assert!((0..2).all(|i| (d[i] - expected[i]).abs() < 1e-13), "{d:?} {expected:?}");
        assert_eq!(plant.jumps_s(), [2.0]);
        assert_eq!(Own::new(vec![read("u")], read("0"), read("1"), vec![]), Err(ChainError::Order { order: 1 }));
    }

    #[test]
    fn where_there_is_no_slope_the_solver_says_so() {
        let mut x = [0.0, 0.0];
        let told = solver::advance(&own(&["x2", "1/x1"], &[]), 0.0, 1e-3, 0.0, &mut x).expect_err("a pole");
        assert_eq!(told, SolverError::NoRate { t_s: 0.0, channel: 2, rate: f64::INFINITY });
        // A finite escape time, x' = x², gives a diverged state.
        let mut x = [1.0, 1.0];
        solver::advance(&own(&["x1^2", "x1"], &[]), 0.0, 2.0, 0.0, &mut x).expect("left where it was found");
        assert!(x[0].abs() > solver::RUNAWAY, "{x:?}");
    }
}
