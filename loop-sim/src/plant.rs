//! True plants of a simulation. They are separate from the nominal models of `controller-core` on purpose. The
//! controller's model and the true plant meet only in the loop.
//!
//! | plant | equation |
//! |---|---|
//! | [`FlexibleJoint`] | Example 2, Eq. (63)-(64): a link on a motor through a spring, an error per parameter |
//! | [`Benchmark`] | Example 1, Eq. (59)-(61): the nonlinear system of order 2 |
//! | [`Chain`] | Eq. (39) with a linear last channel, order 2 to 6: a plant without writing Rust |
//! | [`Own`] | any right-hand side by its formulas, order 2 to 6 |
//! | [`Motor`] | a motor with a rigid load: friction, cogging, ripple, current loop |
//! | [`Joint`] | a flexible joint with custom parameters: two inertias on a spring, the same motor |
//! | [`Loose`] | a motor whose load hangs on a gear with play |
//!
//! Each plant except [`Own`] has two independent formulas: [`Plant::rhs`] from the true coefficients, and
//! [`Plant::lumped`] from the nominal coefficients and the errors. The tests compare them.

pub(crate) mod benchmark;
mod chain;
mod flexible_joint;
mod joint;
mod loose;
mod motor;
mod own;
pub(crate) mod shafts;
#[cfg(test)]
mod stick;

pub use benchmark::Benchmark;
pub use chain::{Chain, ChainError, LastChannel};
pub use flexible_joint::{FlexibleJoint, JointErrors};
pub use joint::{Joint, JointBody};
pub use loose::Loose;
pub use motor::{Friction, Imperfections, Motor, Shaft, Supply};
pub use own::Own;

use crate::MAX_ORDER;
use crate::exact::{Exact, Lumped};
use crate::signal::Signal;

/// True plant: a chain of integrators with disturbances, Eq. (39).
pub trait Plant: Send + Sync {
    /// Returns the order n, 2..=6.
    fn order(&self) -> usize;

    /// Computes dx/dt at time `t_s` in state `x` under the held input `u`. `x` and `dx` have length n.
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]);

    /// Computes the true lumped disturbances d_1..d_n of Eq. (39): the difference between `rhs` and the *nominal*
    /// chain.
    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]);

    /// Returns an upper estimate of the fastest rate of the dynamics around `x` under `u`, rad/s. It sets the solver's
    /// step.
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64;

    /// Returns the regime from this instant to the next event. Between events the right-hand side is smooth.
    fn regime(&self, _t_s: f64, _x: &[f64], _u: f64) -> Regime {
        Regime::Smooth
    }

    /// Computes [`rhs`](Self::rhs) in a regime, continued beyond its end.
    fn rhs_in(&self, _regime: Regime, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.rhs(t_s, x, u, dx);
    }

    /// Returns the distance of a regime from its end. A negative value means that it has ended.
    fn margin(&self, _regime: Regime, _t_s: f64, _x: &[f64], _u: f64) -> f64 {
        f64::INFINITY
    }

    /// Returns true if the fastest rate holds for this instant only. The solver then checks each step and halves it if
    /// needed.
    fn is_checked(&self) -> bool {
        false
    }

    /// Returns the instants at which the right-hand side jumps, ascending, s. No solver step straddles a jump.
    fn jumps_s(&self) -> &[f64];

    /// Returns the part of a held input `u` that the supply can drive in state `x`.
    fn driven(&self, _x: &[f64], u: f64) -> f64 {
        u
    }

    /// Returns the plant's own step from tick to tick, if it has one. The solver takes the ticks that it does not
    /// cross.
    fn exact(&self) -> Option<&Exact> {
        None
    }

    /// Returns the parts of the right-hand side for vector code, if they are available.
    fn parts(&self) -> Option<Parts<'_>> {
        None
    }

    /// Returns [`lumped`](Self::lumped) as coefficients, if it has that form.
    fn lumped_part(&self) -> Option<&Lumped> {
        None
    }
}

/// Regime between two events of a plant with friction that holds. Other plants have no events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Regime {
    /// No events.
    Smooth,
    /// The motor shaft stands: its speed is 0 as long as static friction holds it.
    Held,
    /// The shaft slides until its speed is 0.
    Sliding {
        /// Index of the speed in the state.
        speed: u8,
        /// Direction, 1 or -1.
        sign: i8,
    },
}

/// Parts of a right-hand side, from which the batch makes vector code.
#[derive(Clone, Copy, Debug)]
pub enum Parts<'a> {
    /// Right-hand side of a [`Motor`] or [`Joint`].
    Shafts {
        /// Coefficients: inertias, torques and rates.
        numbers: &'a [[f64; 4]],
        /// Load on the shaft or on the link, N m.
        load: &'a Signal,
    },
    /// Plant from formulas.
    Own(&'a Own),
    /// Example 1.
    Benchmark(&'a Benchmark),
}

/// Returns the instants of all jumps of the signals, ascending and without duplicates, s.
fn merged_jumps_s<'a>(signals: impl IntoIterator<Item = &'a Signal>) -> Vec<f64> {
    let mut jumps_s: Vec<f64> = signals.into_iter().flat_map(|signal| signal.jumps_s().iter().copied()).collect();
    jumps_s.sort_by(f64::total_cmp);
    jumps_s.dedup();
    jumps_s
}

/// Returns the fastest oscillation of the signals, rad/s.
fn fastest_signal_rad_s<'a>(signals: impl IntoIterator<Item = &'a Signal>) -> f64 {
    signals.into_iter().map(Signal::fastest_rad_s).fold(0.0, f64::max)
}

/// Returns the matrix of a chain of integrators with the last row `a`: x_i' = x_{i+1}, x_n' = a . x.
fn companion(a: &[f64]) -> [[f64; MAX_ORDER]; MAX_ORDER] {
    let n = a.len();
    let mut matrix = [[0.0; MAX_ORDER]; MAX_ORDER];
    for i in 1..n {
        matrix[i - 1][i] = 1.0;
    }
    matrix[n - 1][..n].copy_from_slice(a);
    matrix
}

/// Returns an upper bound of the magnitude of the fastest eigenvalue, mostly within 2 % of it. Infinite if an entry is
/// not finite.
///
/// The bound is Gelfand's: $\rho(A) \le \Vert A^m\Vert ^{1/m}$ in any norm, and it tightens with m. Here $m = 2^{10}$,
/// by ten squarings. After each squaring the matrix is scaled to norm 1, and the norm enters the result. Unlike a bound
/// from one row sum it does not depend on the units of the states.
fn spectral_bound<const N: usize>(mut matrix: [[f64; N]; N]) -> f64 {
    let row_sum = |row: &[f64; N]| row.iter().map(|entry| entry.abs()).sum::<f64>();
    // The solver rejects it. f64::max below would drop a NaN, and a row sum must not overflow.
    if !matrix.iter().flatten().all(|entry| entry.abs() < 1e300) {
        return f64::INFINITY;
    }
    let mut norms = [0.0; 11];
    for norm in &mut norms {
        *norm = matrix.iter().map(row_sum).fold(0.0, f64::max);
        if *norm == 0.0 {
            return 0.0; // nilpotent: a chain of integrators has no rate of its own
        }
        let unit = matrix.map(|row| row.map(|entry| entry / *norm));
        matrix = unit.map(|row| {
            let mut product = [0.0; N];
            for (factor, other) in row.iter().zip(&unit) {
                for (sum, entry) in product.iter_mut().zip(other) {
                    *sum += factor * entry;
                }
            }
            product
        });
    }
    // The k-th norm counts with its root of order 2^k.
    let [first, rest @ ..] = norms;
    first * rest.iter().rev().fold(1.0, |bound, norm| libm::sqrt(norm * bound))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectral_bound_is_above_known_roots_and_close_to_them() {
        // (s + 3)(s + 40); s^2 + 2 s + 1e4; (s + 1)^6; s^3 - 1e6: the printed order is a_1 .. a_n of the last row.
        let cases: [(&[f64], f64); 5] = [
            (&[-120.0, -43.0], 40.0),
            (&[-1e4, -2.0], 100.0),
            (&[-1.0, -6.0, -15.0, -20.0, -15.0, -6.0], 1.0),
            (&[1e6, 0.0, 0.0], 100.0),
            (&[1e12, 0.0, 0.0, 0.0, 0.0, 0.0], 100.0),
        ];
        for (a, fastest) in cases {
            let bound = spectral_bound(companion(a));
            // The powers of a matrix with six equal roots grow like m^5, and rounding moves such roots by eps^(1/6).
            let allowed = if a.len() == 6 && a[1] != 0.0 { 1.15 } else { 1.02 };
            assert!(bound >= fastest * (1.0 - 1e-9) && bound <= allowed * fastest, "{a:?}: {bound}");
        }
    }

    #[test]
    fn integrators_alone_have_no_rate() {
        assert_eq!(spectral_bound(companion(&[0.0; 4])), 0.0);
    }

    #[test]
    fn an_entry_that_is_not_finite_is_infinitely_fast() {
        for entry in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308] {
            assert_eq!(spectral_bound(companion(&[-1.0, entry])), f64::INFINITY);
        }
    }
}
