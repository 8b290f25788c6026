//! Chain of integrators of any order with a linear last channel: a plant without writing Rust.
//!
//! $$ \dot x_i = x_{i+1} + w_i(t)\ (i < n), \qquad \dot x_n = a^{true} \cdot x + b^{true} u + w_n(t) $$
//!
//! The model of the controller is $a^{nom}, b^{nom}$. The rest of the last channel is a disturbance, Eq. (39):
//! $d_i = w_i$ and $d_n = w_n + (a^{true} - a^{nom}) \cdot x + (b^{true} - b^{nom}) u$.

use core::fmt;

use super::{Plant, companion, fastest_signal_rad_s, merged_jumps_s, spectral_bound};
use crate::MAX_ORDER;
use crate::exact::{Exact, LinearPart, Lumped};
use crate::signal::Signal;

/// Linear last channel a . x + b u.
#[derive(Clone, Debug, PartialEq)]
pub struct LastChannel {
    /// Coefficients of x_1..x_n. a_j is in s^-(n-j+1).
    pub a: Vec<f64>,
    /// Input gain b of the last channel.
    pub b: f64,
}

/// Reason why a chain cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChainError {
    /// The order is not 2..=6.
    Order {
        /// Requested order.
        order: usize,
    },
    /// The true and the nominal plant differ in order.
    NominalOrder {
        /// Order of the true plant.
        order: usize,
        /// Order of the nominal plant.
        nominal: usize,
    },
    /// The number of disturbances differs from the number of channels.
    Disturbances {
        /// Order n of the plant.
        order: usize,
        /// Number of disturbances given.
        given: usize,
    },
}

impl fmt::Display for ChainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Order { order } => write!(f, "the order of a plant must be 2 to {MAX_ORDER}, not {order}"),
            Self::NominalOrder { order, nominal } => {
                write!(
                    f,
                    "the true plant has {order} coefficients and the nominal plant {nominal}: both need the same number"
                )
            }
            Self::Disturbances { order, given } => {
                write!(f, "a plant of order {order} needs {order} disturbances, not {given}")
            }
        }
    }
}

impl std::error::Error for ChainError {}

/// Chain of integrators as a true plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    truth: LastChannel,
    lumped: Lumped,
    disturbances: Vec<Signal>,
    fastest_rad_s: f64,
    jumps_s: Vec<f64>,
    exact: Option<Exact>,
}

impl Chain {
    /// Builds the plant from the true last channel, the nominal last channel and the disturbances w_1..w_n.
    ///
    /// # Errors
    /// Fails if the order is not 2..=6 or the lengths differ.
    pub fn new(truth: LastChannel, nominal: LastChannel, disturbances: Vec<Signal>) -> Result<Self, ChainError> {
        let order = truth.a.len();
        if !(2..=MAX_ORDER).contains(&order) {
            return Err(ChainError::Order { order });
        }
        let LastChannel { a: nominal_a, b: nominal_b } = nominal;
        if nominal_a.len() != order {
            return Err(ChainError::NominalOrder { order, nominal: nominal_a.len() });
        }
        if disturbances.len() != order {
            return Err(ChainError::Disturbances { order, given: disturbances.len() });
        }
        let fastest_rad_s = spectral_bound(companion(&truth.a)).max(fastest_signal_rad_s(&disturbances));
        let jumps_s = merged_jumps_s(&disturbances);
        let mut lumped = Lumped::default();
        for j in 0..order {
            lumped.rows[order - 1][j] = truth.a[j] - nominal_a[j];
        }
        lumped.of_u[order - 1] = truth.b - nominal_b;
        lumped.signals = disturbances.iter().enumerate().map(|(i, signal)| (i, 1.0, signal.clone())).collect();
        Ok(Self { truth, lumped, disturbances, fastest_rad_s, jumps_s, exact: None })
    }

    /// Adds the plant's own step from tick to tick.
    #[must_use]
    pub fn sampled(self, period_s: f64) -> Self {
        let part = LinearPart {
            a: companion(&self.truth.a),
            order: self.truth.a.len(),
            b: self.truth.b,
            signals: &self.lumped.signals,
            sine: 0.0,
            fastest_rad_s: self.fastest_rad_s,
        };
        let exact = Exact::new(&part, period_s);
        Self { exact, ..self }
    }
}

impl Plant for Chain {
    fn order(&self) -> usize {
        self.truth.a.len()
    }

    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let n = self.order();
        for i in 0..n - 1 {
            dx[i] = x[i + 1] + self.disturbances[i].value(t_s);
        }
        let drift: f64 = self.truth.a.iter().zip(x).map(|(a, x)| a * x).sum();
        dx[n - 1] = drift + self.truth.b * u + self.disturbances[n - 1].value(t_s);
    }

    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        self.lumped.value(t_s, x, u, d);
    }

    fn fastest_rad_s(&self, _: f64, _: &[f64], _: f64) -> f64 {
        self.fastest_rad_s
    }

    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }

    fn exact(&self) -> Option<&Exact> {
        self.exact.as_ref()
    }

    fn lumped_part(&self) -> Option<&Lumped> {
        Some(&self.lumped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Term;

    fn channel(a: &[f64], b: f64) -> LastChannel {
        LastChannel { a: a.to_vec(), b }
    }

    fn constant(amplitude: f64) -> Signal {
        Signal::new(vec![Term::Const { amplitude }])
    }

    fn example() -> Chain {
        let w = vec![constant(0.1), constant(-0.2), constant(0.3)];
        Chain::new(channel(&[-6.0, -11.0, -6.5], 2.2), channel(&[-5.0, -12.0, -6.0], 2.0), w).unwrap()
    }

    #[test]
    fn rhs_is_the_nominal_chain_plus_the_lumped_disturbance() {
        let (x, u) = ([0.7, -1.3, 2.1], 0.9);
        let (mut dx, mut d) = ([0.0; 3], [0.0; 3]);
        example().rhs(0.4, &x, u, &mut dx);
        example().lumped(0.4, &x, u, &mut d);
        let nominal = [x[1], x[2], -5.0 * x[0] - 12.0 * x[1] - 6.0 * x[2] + 2.0 * u];
        for i in 0..3 {
            assert!((dx[i] - nominal[i] - d[i]).abs() < 1e-14, "channel {}", i + 1);
        }
        // Expected by hand: w_3 + (-1, 1, -0.5) . x + 0.2 u.
        assert!((d[2] - (0.3 - 0.7 - 1.3 - 1.05 + 0.18)).abs() < 1e-14);
        assert_eq!(d[..2], [0.1, -0.2]);
    }

    #[test]
    fn lengths_that_do_not_agree_are_refused_with_the_numbers() {
        let two = || channel(&[1.0, 2.0], 1.0);
        let w = |n| vec![Signal::default(); n];
        assert_eq!(Chain::new(channel(&[1.0], 1.0), two(), w(2)), Err(ChainError::Order { order: 1 }));
        assert_eq!(Chain::new(channel(&[1.0; 7], 1.0), two(), w(2)), Err(ChainError::Order { order: 7 }));
        let unequal = Chain::new(two(), channel(&[1.0; 3], 1.0), w(2));
        assert_eq!(unequal, Err(ChainError::NominalOrder { order: 2, nominal: 3 }));
        assert_eq!(Chain::new(two(), two(), w(1)), Err(ChainError::Disturbances { order: 2, given: 1 }));
    }

    #[test]
    fn a_fast_disturbance_makes_a_slow_chain_fast() {
        let slow = || channel(&[-1.0, -2.0], 1.0);
        let fast = Signal::new(vec![Term::Sin { amplitude: 1.0, omega_rad_s: 300.0, phase_rad: 0.0 }]);
        let chain = Chain::new(slow(), slow(), vec![Signal::default(), fast]).unwrap();
        assert_eq!(chain.fastest_rad_s(0.0, &[0.0; 2], 0.0), 300.0);
    }

    #[test]
    fn jumps_of_all_channels_come_in_one_ascending_list() {
        let step = |t0_s| Signal::new(vec![Term::Step { amplitude: 1.0, t0_s }]);
        let still = || channel(&[0.0; 3], 1.0);
        let chain = Chain::new(still(), still(), vec![step(2.0), step(1.0), step(2.0)]).unwrap();
        assert_eq!(chain.jumps_s(), [1.0, 2.0]);
    }
}
