//! Continuous controller as printed: observers in the p-form, Eq. (45)-(50) (Eq. (3)-(6) for n = 2), surface Eq. (44),
//! (17), law Eq. (51) with sat(sigma*/eps).
//!
//! Runge-Kutta in small steps integrates it together with the plant. The sampled loop tends to this loop as T -> 0.

use crate::oracle::{Model, Spec};
use crate::truth::rk4;

/// dx/dt of a plant: (t, x, u, dx).
pub type Rhs<'a> = dyn Fn(f64, &[f64], f64, &mut [f64]) + 'a;

/// Continuous loop of a plant and the printed controller.
pub struct Printed<'a> {
    spec: &'a Spec,
    model: &'a dyn Fn(&[f64]) -> (f64, f64),
    sigma_0: f64,
    /// [x, p of each observed channel in turn].
    state: Vec<f64>,
    t_s: f64,
}

/// Signals of the continuous controller at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// Control u.
    pub u: f64,
    /// sigma, Eq. (44).
    pub sigma: f64,
    /// sigma*, Eq. (17).
    pub sigma_star: f64,
    /// d_hat^(m) of every channel; zeros without an observer.
    pub d_hat: Vec<[f64; 3]>,
}

/// Evaluates Eq. (44), (17) and (51) from a state and estimates.
pub fn law(spec: &Spec, (a, b): (f64, f64), x: &[f64], d_hat: &[[f64; 3]], offset: f64) -> Instant {
    let last = spec.order() - 1;
    let mut sigma: f64 = (0..=last).map(|i| spec.c[i] * x[i]).sum();
    for (i, gains) in spec.observed() {
        for j in i..last.min(i + gains.l.len()) {
            sigma += spec.c[j + 1] * d_hat[i][j - i];
        }
    }
    let sigma_star = sigma - offset;
    let switching = if spec.k_s > 0.0 { spec.k_s * (sigma_star / spec.epsilon).clamp(-1.0, 1.0) } else { 0.0 };
    let drift: f64 = (0..last).map(|i| spec.c[i] * (x[i + 1] + d_hat[i][0])).sum();
    let u = -(a + d_hat[last][0] + spec.alpha * offset + drift + spec.k_l * sigma_star + switching) / b;
    Instant { u, sigma, sigma_star, d_hat: d_hat.to_vec() }
}

impl<'a> Printed<'a> {
    /// Starts at t = 0 with zero estimates: p(0) = -l x(0).
    pub fn start(spec: &'a Spec, model: &'a dyn Fn(&[f64]) -> (f64, f64), x0: &[f64]) -> Self {
        let mut state = x0.to_vec();
        for (i, gains) in spec.observed() {
            state.extend(gains.l.iter().map(|l| -l * x0[i]));
        }
        let sigma_0 = (0..spec.order()).map(|i| spec.c[i] * x0[i]).sum();
        Self { spec, model, sigma_0, state, t_s: 0.0 }
    }

    /// Returns the plant's state.
    pub fn x(&self) -> &[f64] {
        &self.state[..self.spec.order()]
    }

    /// Returns the present control and sliding variable.
    pub fn now(&self) -> Instant {
        self.at(self.t_s, &self.state)
    }

    fn at(&self, t_s: f64, state: &[f64]) -> Instant {
        let n = self.spec.order();
        let (x, mut p) = state.split_at(n);
        let mut d_hat = vec![[0.0; 3]; n];
        for (i, gains) in self.spec.observed() {
            for (m, l) in gains.l.iter().enumerate() {
                d_hat[i][m] = p[m] + l * x[i];
            }
            p = &p[gains.l.len()..];
        }
        law(self.spec, (self.model)(x), x, &d_hat, self.sigma_0 * (-self.spec.alpha * t_s).exp())
    }

    /// Integrates plant and observers to `to_s` in `steps` steps.
    pub fn advance(&mut self, plant: &Rhs<'_>, to_s: f64, steps: usize) {
        let mut state = std::mem::take(&mut self.state);
        let n = self.spec.order();
        rk4(self.t_s, to_s, steps, &mut state, &mut |t_s, state, rate| {
            let instant = self.at(t_s, state);
            let x = &state[..n];
            plant(t_s, x, instant.u, &mut rate[..n]);
            let (a, b) = (self.model)(x);
            let mut at = n;
            for (i, gains) in self.spec.observed() {
                let driven_by = if i + 1 < n { x[i + 1] } else { a + b * instant.u };
                for (m, l) in gains.l.iter().enumerate() {
                    let next = if m + 1 < gains.l.len() { instant.d_hat[i][m + 1] } else { 0.0 };
                    rate[at + m] = -l * (driven_by + instant.d_hat[i][0]) + next;
                }
                at += gains.l.len();
            }
        });
        self.state = state;
        self.t_s = to_s;
    }
}

/// Returns a(x), b(x) of a model as the closure that [`Printed`] takes.
pub fn nominal(model: &Model) -> impl Fn(&[f64]) -> (f64, f64) + '_ {
    |x| (model.a(x), model.b(x))
}
