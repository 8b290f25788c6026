//! Baseline controller of the paper's reference \[1\], for comparison (Fig. 1 and 2).
//!
//! For n = 2: surface $\sigma = x_2 + c_1 x_1 + \hat d_1$ without offset, first-order observer, and the switching law
//!
//! $$ u = -\frac{1}{b}\big[a(x) + c_1(x_2 + \hat d_1) + k\thinspace \mathrm{sgn}\thinspace \sigma\big], \qquad
//!    \hat d_1 = p + l x_1, \quad \dot p = -l (x_2 + \hat d_1) $$
//!
//! The law is designed for continuous time. Sampled with period T (held u, explicit Euler observer) its sign function
//! chatters with an amplitude of k, and its total variation grows as 1/T. So quote T with every result.

use controller_core::{Benchmark, Health, Libm, MAX_R, NominalModel};

use crate::MAX_ORDER;
use crate::port::{ControllerPort, PortError, Tick};

/// Settings of the baseline on the benchmark plant, Eq. (59).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaselineSpec {
    /// Period T, s.
    pub period_s: f64,
    /// Surface coefficient c_1, 1/s.
    pub c1: f64,
    /// Observer gain l, 1/s: its pole is -l.
    pub l: f64,
    /// Observer gain l, 1/s. The pole is -l.
    pub k: f64,
}

/// Running baseline in f64.
#[derive(Clone, Debug)]
pub struct Baseline {
    spec: BaselineSpec,
    model: Benchmark<Libm>,
    /// d_hat at the present tick and the sample of the last tick. `None` before the first.
    last: Option<(f64, [f64; 2])>,
}

impl Baseline {
    /// Returns the baseline with its estimate at 0.
    pub fn new(spec: BaselineSpec) -> Self {
        Self { spec, model: Benchmark::new(), last: None }
    }
}

impl ControllerPort for Baseline {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let BaselineSpec { period_s, c1, l, k } = self.spec;
        let x = [sample[0], sample[1]];
        // d_hat = p + l x_1 with an Euler step for p, written for d_hat itself.
        let d_hat = match self.last {
            None => 0.0,
            Some((d_hat, x_prev)) => d_hat + l * (x[0] - x_prev[0]) - period_s * l * (x_prev[1] + d_hat),
        };
        self.last = Some((d_hat, x));
        let sigma = x[1] + c1 * x[0] + d_hat;
        let sign = if sigma == 0.0 { 0.0 } else { sigma.signum() };
        let u = -(self.model.drift(&x) + c1 * (x[1] + d_hat) + k * sign);
        let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
        estimates[0][0] = d_hat;
        Ok(Tick { u, sigma, sigma_star: sigma, estimates, health: Health::OK })
    }

    fn report_applied(&mut self, _u: f64) {}

    fn reset(&mut self) -> Result<(), PortError> {
        self.last = None;
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &[0]
    }
}
