//! Disturbance signals with exact derivatives.
//!
//! A signal is a sum of [`Term`]s. Every derivative is again such a sum, without numerical differences. This gives the
//! $\mu$ of Eq. (2) and Eq. (40), $|d^{(r)}| \le \mu$, as a computed number ([`Signal::bound`]).
//!
//! # Deviation
//! Eq. (2) requires a bounded derivative, which a step does not have. Here the derivative of a step is 0. So bounds
//! hold between the jumps, and the estimators start again at each jump.
//!
//! Elementary functions come from `libm`, with the same bits on every machine.

/// Term of a [`Signal`], with t in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Term {
    /// Constant A.
    Const {
        /// Constant A, in the unit of the signal.
        amplitude: f64,
    },
    /// Ramp s t from 0.
    Ramp {
        /// Slope s, in the unit of the signal per second.
        slope: f64,
    },
    /// Sinusoid A sin(ω t + φ).
    Sin {
        /// Amplitude A, in the unit of the signal.
        amplitude: f64,
        /// Angular frequency ω, rad/s.
        omega_rad_s: f64,
        /// Phase φ at t = 0, rad.
        phase_rad: f64,
    },
    /// Sinusoid A cos(ω t + φ).
    Cos {
        /// Amplitude A, in the unit of the signal.
        amplitude: f64,
        /// Angular frequency ω, rad/s.
        omega_rad_s: f64,
        /// Phase φ at t = 0, rad.
        phase_rad: f64,
    },
    /// Step: 0 for t < t0, A for t >= t0.
    Step {
        /// Amplitude A, in the unit of the signal.
        amplitude: f64,
        /// Time t0 of the step, s.
        t0_s: f64,
    },
}

/// Returns x^k by repeated multiplication. The rounding of `powi` depends on the platform.
fn power(x: f64, k: u32) -> f64 {
    (0..k).fold(1.0, |product, _| product * x)
}

impl Term {
    /// Returns d^k/dt^k, k = `order`. The derivative of a step is 0, also at its jump.
    fn derivative(&self, t_s: f64, order: u32) -> f64 {
        match (*self, order) {
            (Self::Const { amplitude }, 0) => amplitude,
            (Self::Ramp { slope }, 0) => slope * t_s,
            (Self::Ramp { slope }, 1) => slope,
            (Self::Step { amplitude, t0_s }, 0) if t_s >= t0_s => amplitude,
            (Self::Const { .. } | Self::Ramp { .. } | Self::Step { .. }, _) => 0.0,
            (Self::Sin { amplitude, omega_rad_s, phase_rad }, k) => {
                amplitude * power(omega_rad_s, k) * quarter_turns(omega_rad_s * t_s + phase_rad, k)
            }
            (Self::Cos { amplitude, omega_rad_s, phase_rad }, k) => {
                amplitude * power(omega_rad_s, k) * quarter_turns(omega_rad_s * t_s + phase_rad, k + 1)
            }
        }
    }

    /// Returns the amplitude or slope, and the term with 1 in its place. Their product is the term, to the bit.
    #[cfg(feature = "lanes")]
    pub(crate) fn parted(self) -> (f64, Self) {
        let mut unit = self;
        let (Self::Const { amplitude }
        | Self::Ramp { slope: amplitude }
        | Self::Sin { amplitude, .. }
        | Self::Cos { amplitude, .. }
        | Self::Step { amplitude, .. }) = &mut unit;
        (std::mem::replace(amplitude, 1.0), unit)
    }

    /// Returns the value at `t_s`.
    #[cfg(feature = "lanes")]
    pub(crate) fn value(&self, t_s: f64) -> f64 {
        self.derivative(t_s, 0)
    }

    /// Returns sup |d^k/dt^k| over [0, span] without jumps. It is exact except for a sinusoid that is shorter than its
    /// crest.
    fn bound(&self, order: u32, span_s: f64) -> f64 {
        match (*self, order) {
            (Self::Const { amplitude }, 0) => amplitude.abs(),
            (Self::Ramp { slope }, 0) => (slope * span_s).abs(),
            (Self::Ramp { slope }, 1) => slope.abs(),
            (Self::Step { amplitude, t0_s }, 0) if t0_s <= span_s => amplitude.abs(),
            (Self::Const { .. } | Self::Ramp { .. } | Self::Step { .. }, _) => 0.0,
            (Self::Sin { amplitude, omega_rad_s, .. } | Self::Cos { amplitude, omega_rad_s, .. }, k) => {
                (amplitude * power(omega_rad_s, k)).abs()
            }
        }
    }
}

/// Returns sin(angle + k pi/2), exactly by symmetry.
fn quarter_turns(angle_rad: f64, k: u32) -> f64 {
    match k % 4 {
        0 => libm::sin(angle_rad),
        1 => libm::cos(angle_rad),
        2 => -libm::sin(angle_rad),
        _ => -libm::cos(angle_rad),
    }
}

/// Sum of terms. The default has none: the signal 0.
///
/// ```
/// use loop_sim::signal::{Signal, Term};
/// // v = 1 + sin 2t, the input disturbance of Example 2.
/// let v = Signal::new(vec![
///     Term::Const { amplitude: 1.0 },
///     Term::Sin { amplitude: 1.0, omega_rad_s: 2.0, phase_rad: 0.0 },
/// ]);
/// assert_eq!(v.value(0.0), 1.0);
/// assert_eq!(v.derivative(0.0, 1), 2.0);
/// assert_eq!(v.bound(2, 20.0), 4.0); // the mu of an observer of order 2
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    terms: Vec<Term>,
    jumps_s: Vec<f64>,
}

impl Signal {
    /// Returns the sum of `terms`.
    pub fn new(terms: Vec<Term>) -> Self {
        let mut jumps_s: Vec<f64> = terms
            .iter()
            .filter_map(|term| match *term {
                Term::Step { t0_s, .. } if t0_s.is_finite() => Some(t0_s),
                _ => None,
            })
            .collect();
        jumps_s.sort_by(f64::total_cmp);
        jumps_s.dedup();
        Self { terms, jumps_s }
    }

    /// Returns this signal plus `factor` times another.
    #[must_use]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let scaled = other.terms.iter().map(|term| match *term {
            Term::Const { amplitude } => Term::Const { amplitude: factor * amplitude },
            Term::Ramp { slope } => Term::Ramp { slope: factor * slope },
            Term::Sin { amplitude, omega_rad_s, phase_rad } => {
                Term::Sin { amplitude: factor * amplitude, omega_rad_s, phase_rad }
            }
            Term::Cos { amplitude, omega_rad_s, phase_rad } => {
                Term::Cos { amplitude: factor * amplitude, omega_rad_s, phase_rad }
            }
            Term::Step { amplitude, t0_s } => Term::Step { amplitude: factor * amplitude, t0_s },
        });
        Self::new(self.terms.iter().copied().chain(scaled).collect())
    }

    /// Returns the terms of the sum.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Returns the value at `t_s`.
    pub fn value(&self, t_s: f64) -> f64 {
        self.derivative(t_s, 0)
    }

    /// Returns the exact derivative of this order at `t_s`. Order 0 is the value. The derivative of a step is 0.
    pub fn derivative(&self, t_s: f64, order: u32) -> f64 {
        // The sum starts from +0.0, because a sum of no terms is -0.0 and would appear as -0.0 in every trace.
        let mut sum = 0.0;
        for term in &self.terms {
            sum += term.derivative(t_s, order);
        }
        sum
    }

    /// Returns an upper bound of |d^(order)| over [0, `span_s`], the sum over the terms.
    ///
    /// So 1 + sin 2t has the bound 2, and sin t + cos t has the bound 2 (its supremum is 1.414). Jumps count in order 0
    /// only. In higher orders the bound holds between them.
    pub fn bound(&self, order: u32, span_s: f64) -> f64 {
        self.terms.iter().map(|term| term.bound(order, span_s)).sum()
    }

    /// Returns the instants of the jumps, ascending and without duplicates, s.
    pub fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }

    /// Returns true if the signal is not constant between its jumps.
    pub fn varies(&self) -> bool {
        self.terms.iter().any(|term| !matches!(term, Term::Const { .. } | Term::Step { .. }))
    }

    /// Returns the largest |ω| of the terms, rad/s, or 0 if none oscillates. A solver must resolve it even in a slow
    /// plant.
    pub fn fastest_rad_s(&self) -> f64 {
        let rates = self.terms.iter().map(|term| match *term {
            Term::Sin { omega_rad_s, .. } | Term::Cos { omega_rad_s, .. } => omega_rad_s.abs(),
            Term::Const { .. } | Term::Ramp { .. } | Term::Step { .. } => 0.0,
        });
        rates.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns one term of each kind, without round numbers.
    fn each_kind() -> Signal {
        Signal::new(vec![
            Term::Const { amplitude: -0.7 },
            Term::Ramp { slope: 0.31 },
            Term::Sin { amplitude: 1.3, omega_rad_s: 2.7, phase_rad: 0.4 },
            Term::Cos { amplitude: -0.9, omega_rad_s: 1.9, phase_rad: -1.1 },
            Term::Step { amplitude: 0.5, t0_s: 1.0 },
        ])
    }

    #[test]
    fn each_derivative_is_the_slope_of_the_one_below() {
        let signal = each_kind();
        let h = 1e-3;
        for order in 0..7 {
            for t in [0.1, 0.8, 1.7, 4.2] {
                let d = |steps: f64| signal.derivative(t + steps * h, order);
                let slope = (8.0 * (d(1.0) - d(-1.0)) - (d(2.0) - d(-2.0))) / (12.0 * h);
                let exact = signal.derivative(t, order + 1);
                // The stencil errs by h^4/30 times a derivative of at most 2.7^11, and by rounding over h.
                assert!((slope - exact).abs() < 1e-8 * (1.0 + exact.abs()), "order {order}, t {t}: {slope} {exact}");
            }
        }
    }

    #[test]
    fn sine_and_cosine_are_what_they_are_called() {
        let sin = Signal::new(vec![Term::Sin { amplitude: 3.0, omega_rad_s: 2.0, phase_rad: 0.5 }]);
        let cos = Signal::new(vec![Term::Cos { amplitude: 3.0, omega_rad_s: 2.0, phase_rad: 0.5 }]);
        for t in [0.0, 0.3, 11.0] {
            assert!((sin.value(t) - 3.0 * (2.0 * t + 0.5_f64).sin()).abs() < 1e-14);
            assert!((cos.value(t) - 3.0 * (2.0 * t + 0.5_f64).cos()).abs() < 1e-14);
        }
    }

    #[test]
    fn step_acts_from_its_instant_on_and_has_no_derivative() {
        let step = Signal::new(vec![Term::Step { amplitude: 0.5, t0_s: 2.0 }]);
        assert_eq!([1.999_999, 2.0, 3.0].map(|t| step.value(t)), [0.0, 0.5, 0.5]);
        assert_eq!([1.9, 2.0, 2.1].map(|t| step.derivative(t, 1)), [0.0; 3]);
    }

    #[test]
    fn bound_is_never_exceeded_between_jumps_and_is_reached_by_a_lone_term() {
        let signal = each_kind();
        let span_s = 9.0;
        for order in 0..4 {
            let reached = (0..=9000).map(|k| signal.derivative(f64::from(k) * 1e-3, order).abs()).fold(0.0, f64::max);
            assert!(reached <= signal.bound(order, span_s), "order {order}");
            for term in signal.terms() {
                let alone = Signal::new(vec![*term]);
                let reached =
                    (0..=9000).map(|k| alone.derivative(f64::from(k) * 1e-3, order).abs()).fold(0.0, f64::max);
                // The grid misses a crest by at most (2.7 * 0.5e-3)^2/2 = 1e-6 of it.
                assert!(reached >= (1.0 - 1e-6) * alone.bound(order, span_s), "order {order}, {term:?}");
            }
        }
    }

    #[test]
    fn step_after_the_span_does_not_count_in_the_bound() {
        let step = Signal::new(vec![Term::Step { amplitude: 0.5, t0_s: 2.0 }]);
        assert_eq!([1.0, 2.0, 3.0].map(|span| step.bound(0, span)), [0.0, 0.5, 0.5]);
    }

    #[test]
    fn jumps_are_ascending_and_listed_once() {
        let step = |t0_s| Term::Step { amplitude: 1.0, t0_s };
        let signal = Signal::new(vec![step(3.0), step(f64::NAN), step(1.0), step(3.0), Term::Ramp { slope: 1.0 }]);
        assert_eq!(signal.jumps_s(), [1.0, 3.0]);
    }

    #[test]
    fn fastest_is_the_largest_frequency_of_either_sign() {
        assert_eq!(each_kind().fastest_rad_s(), 2.7);
        let reversed = Signal::new(vec![Term::Cos { amplitude: 1.0, omega_rad_s: -8.0, phase_rad: 0.0 }]);
        assert_eq!(reversed.fastest_rad_s(), 8.0);
        assert_eq!(Signal::default().fastest_rad_s(), 0.0);
    }
}
