//! Nonlinear benchmark of Example 1, dimensionless.
//!
//! $$ \dot x_1 = x_2 + d_1(x, t), \qquad \dot x_2 = -2 x_1 - x_2 + e^{x_1} + u + d_2(t) \qquad \text{(Eq. (59))} $$
//!
//! In part 1 of the example $d_1$ is a step of 0.5 at 2 s. In part 2, Eq. (60)-(61),
//!
//! $$ d_1 = \tfrac12 x_1^2 + x_1 \sin 2t + 0.2 x_2 + \tfrac t6 + \sin^2 2t - \cos 2t + 1(t \ge 2). $$
//!
//! The nominal model is exact in channel 2, so $d_2$ is only the signal that is added here. The paper adds none.

use super::{Parts, Plant, fastest_signal_rad_s, merged_jumps_s};
use crate::signal::{Signal, Term};

/// Plant of Eq. (59) with its disturbances.
#[derive(Clone, Debug, PartialEq)]
pub struct Benchmark {
    disturbances: [Signal; 2],
    state_dependent: bool,
    fastest_signal_rad_s: f64,
    jumps_s: Vec<f64>,
}

impl Benchmark {
    /// Builds Eq. (59) with a disturbance signal per channel. `state_dependent` adds x_1^2/2 + x_1 sin 2t + 0.2 x_2 to
    /// d_1.
    pub fn new(disturbances: [Signal; 2], state_dependent: bool) -> Self {
        let fastest_signal_rad_s = fastest_signal_rad_s(&disturbances);
        let jumps_s = merged_jumps_s(&disturbances);
        Self { disturbances, state_dependent, fastest_signal_rad_s, jumps_s }
    }

    /// Returns d_1 and d_2 without the part that depends on x.
    #[cfg(feature = "lanes")]
    pub(crate) const fn disturbances(&self) -> &[Signal; 2] {
        &self.disturbances
    }

    /// Returns true if d_1 depends on x.
    #[cfg(feature = "lanes")]
    pub(crate) const fn is_state_dependent(&self) -> bool {
        self.state_dependent
    }

    /// Returns the fastest oscillation of the disturbances, rad/s.
    #[cfg(feature = "lanes")]
    pub(crate) const fn fastest_signal_rad_s(&self) -> f64 {
        self.fastest_signal_rad_s
    }

    /// Builds part 1: d_1 steps to 0.5 at 2 s.
    pub fn part_1() -> Self {
        let step = Signal::new(vec![Term::Step { amplitude: 0.5, t0_s: 2.0 }]);
        Self::new([step, Signal::default()], false)
    }

    /// Builds part 2, Eq. (60)-(61).
    pub fn part_2() -> Self {
        let cos = |amplitude, omega_rad_s| Term::Cos { amplitude, omega_rad_s, phase_rad: 0.0 };
        let d1 = Signal::new(vec![
            Term::Ramp { slope: 1.0 / 6.0 },
            // sin^2 2t = 1/2 - cos(4t)/2
            Term::Const { amplitude: 0.5 },
            cos(-0.5, 4.0),
            cos(-1.0, 2.0),
            Term::Step { amplitude: 1.0, t0_s: 2.0 },
        ]);
        Self::new([d1, Signal::default()], true)
    }
}

/// Returns the slopes of x in Eq. (59) from d, u and e^x_1.
#[inline(always)]
pub(crate) fn rates(d: [f64; 2], x: [f64; 2], u: f64, exp_x1: f64) -> [f64; 2] {
    [d[0] + x[1], d[1] + (-2.0 * x[0] - x[1] + exp_x1 + u)]
}

/// Returns the part of d_1 that depends on x, Eq. (60).
#[inline(always)]
pub(crate) fn d1_of_state(x: [f64; 2], sin_2t: f64) -> f64 {
    0.5 * x[0] * x[0] + x[0] * sin_2t + 0.2 * x[1]
}

/// Returns the fastest rate, rad/s: the row sum of the Jacobian [[x_1 + sin 2t, 1.2], [e^x1 - 2, -1]] after balancing
/// its two off-diagonal entries. It is at least the rate of x_1, since e^x1 and x_1^2 vary at that rate.
#[inline(always)]
pub(crate) fn fastest_rad_s(state_dependent: bool, x: [f64; 2], exp_x1: f64, of_signals_rad_s: f64) -> f64 {
    let (diagonal, coupling) = if state_dependent { (x[0].abs() + 1.0, 1.2) } else { (0.0, 1.0) };
    // A square root is correctly rounded on every machine, like a quotient.
    let linear = diagonal.max(1.0) + (coupling * (exp_x1 - 2.0).abs()).sqrt();
    linear.max(x[1].abs()).max(of_signals_rad_s)
}

impl Plant for Benchmark {
    fn order(&self) -> usize {
        2
    }

    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.lumped(t_s, x, u, dx);
        dx.copy_from_slice(&rates([dx[0], dx[1]], [x[0], x[1]], u, libm::exp(x[0])));
    }

    fn lumped(&self, t_s: f64, x: &[f64], _u: f64, d: &mut [f64]) {
        d[0] = self.disturbances[0].value(t_s);
        d[1] = self.disturbances[1].value(t_s);
        if self.state_dependent {
            d[0] += d1_of_state([x[0], x[1]], libm::sin(2.0 * t_s));
        }
    }

    fn fastest_rad_s(&self, _: f64, x: &[f64], _: f64) -> f64 {
        fastest_rad_s(self.state_dependent, [x[0], x[1]], libm::exp(x[0]), self.fastest_signal_rad_s)
    }

    fn parts(&self) -> Option<Parts<'_>> {
        Some(Parts::Benchmark(self))
    }

    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows t, x1, x2, d1 of a trajectory of part 2, on which two independent solvers agree.
    const REFERENCE: [[f64; 4]; 9] = [
        [0.0, 1.0, 0.0, -0.5],
        [0.005, 0.997_506_397, 0.003_349_923_35, -0.490_862_282],
        [0.01, 0.995_189_156, 0.039_092_892_8, -0.474_811_63],
        [1.0, 0.463_523_69, -2.023_666_4, 1.533_810_04],
        [1.995, 0.171_401_625, -1.338_519_47, 1.174_916_39],
        [2.0, 0.170_584_612, -1.340_318_06, 2.177_114_05],
        [2.005, 0.174_642_945, -1.398_100_19, 2.165_163_01],
        [2.995, 0.050_142_889_8, -0.545_038_471, 0.503_119_283],
        [3.005, 0.049_734_388_5, -0.531_927_275, 0.492_141_94],
    ];

    #[test]
    fn eq_60_and_61_give_the_reference_disturbance() {
        for [t, x1, x2, d1] in REFERENCE {
            let mut d = [0.0; 2];
            Benchmark::part_2().lumped(t, &[x1, x2], 0.0, &mut d);
            // The rows carry nine digits.
            assert!((d[0] - d1).abs() < 5e-9, "t = {t}: {} {d1}", d[0]);
            assert_eq!(d[1], 0.0);
        }
    }

    #[test]
    fn rhs_is_the_slope_of_the_reference() {
        // Central difference of two rows 10 ms apart around the row at 3 s, which is below with its u.
        let [a, b] = [REFERENCE[7], REFERENCE[8]];
        let slope = (b[1] - a[1]) / (b[0] - a[0]);
        let mut dx = [0.0; 2];
        Benchmark::part_2().rhs(3.0, &[0.049_935_971_8, -0.538_371_427], -0.178_507_002, &mut dx);
        // h^2/6 = 4e-6 times the third derivative, which is of order 1 in x1 and 20 in x2, because u changes its slope.
        assert!((dx[0] - slope).abs() < 4e-6, "{} {slope}", dx[0]);
        let slope = (b[2] - a[2]) / (b[0] - a[0]);
        assert!((dx[1] - slope).abs() < 1e-4, "{} {slope}", dx[1]);
    }

    #[test]
    fn rhs_is_eq_59_plus_the_disturbance() {
        let plant = Benchmark::part_1();
        let mut dx = [0.0; 2];
        plant.rhs(1.0, &[0.0, 0.3], 2.0, &mut dx);
        assert_eq!(dx, [0.3, 1.0 - 0.3 + 2.0]);
        plant.rhs(2.0, &[1.0, 0.3], 2.0, &mut dx);
        assert!((dx[0] - 0.8).abs() < 1e-15 && (dx[1] - (core::f64::consts::E - 0.3)).abs() < 1e-15, "{dx:?}");
        assert_eq!(plant.jumps_s(), [2.0]);
    }

    #[test]
    fn matched_disturbance_reaches_channel_2_alone() {
        let two = Signal::new(vec![Term::Const { amplitude: 2.0 }]);
        let mut d = [9.0; 2];
        Benchmark::new([Signal::default(), two], false).lumped(0.0, &[1.0, 1.0], 0.0, &mut d);
        assert_eq!(d, [0.0, 2.0]);
    }
}
