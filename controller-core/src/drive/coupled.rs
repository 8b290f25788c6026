//! Coupled design of a flexible joint: one exact tick, one observer of both encoders, one regulator.
//!
//! With $q_m - q_l = \tau$, all behind the gear, the joint is
//!
//! $$ \dot v_l = k_1 \tau - b_1 v_l + w + d_l, \qquad \dot v_m = -k_2 \tau - b_2 v_m + b\thinspace i + d_m, \qquad
//!    \dot i = (u - i)/\text{lag} $$
//!
//! $k_1 = K/J_l$, $k_2 = K/J_m$, $b_1 = B_l/J_l$, $b_2 = B_m/J_m$, $b = K_t/J_m$. The term $w = -g \sin q_l$ is the
//! acceleration from the weight. It is known at the counts and enters no gain. A separate observer of each encoder
//! assumes a constant coupling within a tick. On a stiff joint the error of this assumption is thousands of times the
//! encoder resolution. In this design the spring is part of the tick.
//!
//! # One tick
//! The motion of both shafts, $y = q - q(0)$, obeys $\ddot y = A y + B \dot y + m$. Here
//! $m = (k_1 \tau + w + d_l,\ -k_2 \tau + b u + d_m)$ is the acceleration at its start, without damping. So with
//! matrices of 2 × 2
//!
//! $$ y = g_2 v + g_1 m + h_q (i - u), \qquad v^+ = \varphi v + g_2 m + h_v (i - u), \qquad
//!    i^+ = u + \kappa (i - u) $$
//!
//! are exact while u is held. They contain no absolute angle, only the twist τ, so f32 suffices.
//!
//! # Observer
//! The observer is a Kalman filter of $(q, v, d)$ of both shafts, and i is known. In units of one count of each encoder
//! and of one tick, the variance of a count is 1/12. With $a = W_j T$ the variances of $q, v, d$ grow by
//! $(3 \beta_j a^2,\ 3 \beta_j a^4,\ a^6)/12$ in a tick. For one encoder alone, such an observer has the bandwidth
//! $W_j$.
//!
//! # Regulator
//! The regulator minimises $\sum q_l^2 + \theta^2 v_l^2 + \rho u^2$, over the joint with its current. For a rigid shaft
//! this places two poles, which are the parameters of the design. They are $w_c$ and $k_l$, with $w^2 = w_c k_l$,
//! $\rho = b_r^2/w^4$, $\theta^2 = (w_c^2 + k_l^2)/w^4$, $b_r = b k_1/(k_1 + k_2)$. A compliant spring shifts the poles
//! to values that it tolerates.
//!
//! # Relation to the law of the paper
//! Let z be a real eigenvalue of $A_c = \Phi - \Gamma K$ and $c^\top A_c = z c^\top$, scaled to $c^\top \Gamma = 1$.
//! With $\Pi, N$ the state and u in which the link rests under d, and $\tilde x = x - x_r - \Pi d$,
//!
//! $$ \sigma^* = c^\top \tilde x = c^\top e + g^\top d, \quad g = -\Pi^\top c, \qquad
//!    u = u_{eq} - (1 - z) \sigma^*, \quad u_{eq} = \text{ff} + N d - c^\top (\Phi - I) \tilde x $$
//!
//! equals $\text{ff} + N d - K \tilde x$, because $c^\top \Phi = z c^\top + K$. So $\sigma^{*+} = z \sigma^*$. This is
//! the reaching law with the rate $-\ln z/T$, and on $\sigma^* = 0$ the other four poles are the surface. For a chain
//! of integrators $\Pi = (0, -d_1, \dots)$, and σ* is Eq. (44) of the paper.

use super::joint::Joint;
use crate::exponential::exp_minus_identity;
use crate::matrix::{Matrix, identity, plus, riccati, solved, times, transposed};

/// Observer damping $\beta$ of link and motor: the share of a step of d that is attributed to a step of the speed.
pub(crate) const DAMPING: [f64; 2] = [0.3, 1.0];

/// Number of states of the joint for the regulator: q_l, v_l, q_m, v_m, i.
pub(crate) const STATES: usize = 5;

/// Joint parameters as accelerations: k_1, k_2, b_1, b_2, b of the module documentation, and the lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRatios {
    /// Link stiffness K/J_l, 1/s².
    pub k1: f64,
    /// Motor stiffness K/J_m, 1/s².
    pub k2: f64,
    /// Link damping B_l/J_l, 1/s.
    pub b1: f64,
    /// Motor damping B_m/J_m, 1/s.
    pub b2: f64,
    /// Input gain K_t/J_m, rad/s² per A.
    pub b: f64,
    /// Time constant of the current loop, s. 0 for a current without lag.
    pub lag_s: f64,
}

impl JointRatios {
    /// Returns the parameters from a data sheet.
    pub const fn of(joint: &Joint, lag_s: f64) -> Self {
        let (link, motor) = (joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2);
        Self {
            k1: joint.stiffness_n_m / link,
            k2: joint.stiffness_n_m / motor,
            b1: joint.link_damping_n_m_s / link,
            b2: joint.motor_damping_n_m_s / motor,
            b: joint.torque_n_m_per_a / motor,
            lag_s,
        }
    }

    /// Returns the input gain of both shafts as one rigid body, rad/s² per A.
    pub const fn rigid_gain(&self) -> f64 {
        self.b * self.k1 / (self.k1 + self.k2)
    }
}

/// Exact tick of a joint (see the module). Rows and columns count link, motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTick {
    /// Effect of speeds on speeds.
    pub phi: [[f64; 2]; 2],
    /// Effect of speeds on positions and of accelerations on speeds, s.
    pub g2: [[f64; 2]; 2],
    /// Effect of accelerations on positions, s².
    pub g1: [[f64; 2]; 2],
    /// Effect of the current error i - u on positions, rad/A.
    pub current_q: [f64; 2],
    /// Effect of the current error i - u on speeds, rad/(s A).
    pub current_v: [f64; 2],
    /// Share of i - u that remains after a tick.
    pub keeps: f64,
}

impl JointTick {
    /// Computes the tick by the exponential of (y, v, m, i - u), in units of one tick.
    pub const fn of(ratios: &JointRatios, period_s: f64) -> Self {
        let (r, t) = (ratios, period_s);
        let mut a = [[0.0; 7]; 7];
        (a[0][1], a[2][3]) = (1.0, 1.0);
        (a[1][0], a[1][1], a[1][2], a[1][4]) = (-r.k1 * t * t, -r.b1 * t, r.k1 * t * t, 1.0);
        (a[3][0], a[3][2], a[3][3], a[3][5]) = (r.k2 * t * t, -r.k2 * t * t, -r.b2 * t, 1.0);
        if r.lag_s > 0.0 {
            // i - u in units of the acceleration that it causes.
            (a[3][6], a[6][6]) = (1.0, -t / r.lag_s);
        }
        let e = exp_minus_identity(a);
        let (mut phi, mut g2, mut g1) = ([[0.0; 2]; 2], [[0.0; 2]; 2], [[0.0; 2]; 2]);
        let (mut current_q, mut current_v) = ([0.0; 2], [0.0; 2]);
        let mut i = 0;
        while i < 2 {
            let mut j = 0;
            while j < 2 {
                phi[i][j] = e[2 * i + 1][2 * j + 1];
                g2[i][j] = e[2 * i][2 * j + 1] * t;
                g1[i][j] = e[2 * i][4 + j] * t * t;
                j += 1;
            }
            phi[i][i] += 1.0;
            current_q[i] = e[2 * i][6] * t * t * r.b;
            current_v[i] = e[2 * i + 1][6] * t * r.b;
            i += 1;
        }
        let keeps = if r.lag_s > 0.0 { 1.0 + e[6][6] } else { 0.0 };
        Self { phi, g2, g1, current_q, current_v, keeps }
    }

    /// Returns Φ and Γ of x = (q_l, v_l, q_m, v_m, i).
    pub const fn matrices(&self, ratios: &JointRatios) -> ([[f64; STATES]; STATES], [f64; STATES]) {
        let (JointTick { phi, g2, g1, current_q, current_v, keeps }, r) = (self, ratios);
        let mut f = identity::<STATES>();
        let mut gamma = [0.0; STATES];
        // Acceleration m per unit of twist.
        let pull = [r.k1, -r.k2];
        let mut i = 0;
        while i < 2 {
            let (by_twist, of_speed) =
                (g1[i][0] * pull[0] + g1[i][1] * pull[1], g2[i][0] * pull[0] + g2[i][1] * pull[1]);
            (f[2 * i][0], f[2 * i][2]) = (f[2 * i][0] - by_twist, f[2 * i][2] + by_twist);
            (f[2 * i + 1][0], f[2 * i + 1][2]) = (-of_speed, of_speed);
            (f[2 * i][1], f[2 * i][3]) = (g2[i][0], g2[i][1]);
            (f[2 * i + 1][1], f[2 * i + 1][3]) = (phi[i][0], phi[i][1]);
            (f[2 * i][4], f[2 * i + 1][4]) = (current_q[i], current_v[i]);
            gamma[2 * i] = g1[i][1] * r.b - current_q[i];
            gamma[2 * i + 1] = g2[i][1] * r.b - current_v[i];
            i += 1;
        }
        f[4][4] = *keeps;
        gamma[4] = 1.0 - *keeps;
        (f, gamma)
    }

    /// Returns the observer gains: `gains[shaft][encoder]` corrects position, speed and d of a shaft.
    ///
    /// Each gain is per unit of the innovation of the encoder and per tick. `steps_rad` is one count of each encoder,
    /// or a larger number that represents its noise. `bandwidths` is W_j, rad/s.
    pub const fn observer_gains(
        &self,
        ratios: &JointRatios,
        period_s: f64,
        steps_rad: [f64; 2],
        bandwidths: [f64; 2],
    ) -> [[[f64; 3]; 2]; 2] {
        let t = period_s;
        let (phi, _) = self.matrices(ratios);
        // (q, v, d) of the link, then of the motor, each in counts and ticks.
        let mut f = identity::<6>();
        let mut q = [[0.0; 6]; 6];
        let mut i = 0;
        while i < 2 {
            let mut j = 0;
            while j < 2 {
                let of_unit = steps_rad[j] / steps_rad[i];
                (f[3 * i][3 * j], f[3 * i][3 * j + 1]) =
                    (phi[2 * i][2 * j] * of_unit, phi[2 * i][2 * j + 1] / t * of_unit);
                f[3 * i + 1][3 * j] = phi[2 * i + 1][2 * j] * t * of_unit;
                f[3 * i + 1][3 * j + 1] = phi[2 * i + 1][2 * j + 1] * of_unit;
                f[3 * i][3 * j + 2] = self.g1[i][j] / (t * t) * of_unit;
                f[3 * i + 1][3 * j + 2] = self.g2[i][j] / t * of_unit;
                j += 1;
            }
            let a = bandwidths[i] * t;
            let (a2, beta) = (a * a, DAMPING[i]);
            q[3 * i][3 * i] = 3.0 * beta * a2 / 12.0;
            q[3 * i + 1][3 * i + 1] = 3.0 * beta * a2 * a2 / 12.0;
            q[3 * i + 2][3 * i + 2] = a2 * a2 * a2 / 12.0;
            i += 1;
        }
        let mut information = [[0.0; 6]; 6];
        (information[0][0], information[3][3]) = (12.0, 12.0);
        let p = riccati(transposed(&f), information, q);
        // L' = (C P C' + R)^-1 C P.
        let innovation = [[p[0][0] + 1.0 / 12.0, p[0][3]], [p[3][0], p[3][3] + 1.0 / 12.0]];
        let l = solved(innovation, [p[0], p[3]]);
        let mut gains = [[[0.0; 3]; 2]; 2];
        let mut shaft = 0;
        while shaft < 2 {
            let mut encoder = 0;
            while encoder < 2 {
                let (mut s, mut unit) = (0, steps_rad[shaft] / steps_rad[encoder]);
                while s < 3 {
                    gains[shaft][encoder][s] = l[encoder][3 * shaft + s] * unit;
                    unit /= t;
                    s += 1;
                }
                encoder += 1;
            }
            shaft += 1;
        }
        gains
    }
}

/// Returns the largest innovation of each encoder, rad, after a step of d of link or motor.
///
/// The entries are by shaft and encoder, per rad/s² of the step.
pub(crate) const fn innovations(
    ratios: &JointRatios,
    tick: &JointTick,
    gains: &[[[f64; 3]; 2]; 2],
    ticks: usize,
) -> [[f64; 2]; 2] {
    let (phi, _) = tick.matrices(ratios);
    let mut peaks = [[0.0; 2]; 2];
    let mut shaft = 0;
    while shaft < 2 {
        // Errors of q, v, d of both shafts. d of one shaft is wrong from the start.
        let (mut x, mut d) = ([0.0; 4], [0.0; 2]);
        d[shaft] = 1.0;
        let mut passed = 0;
        while passed < ticks {
            let mut next = [0.0; 4];
            let mut i = 0;
            while i < 4 {
                let push = if i % 2 == 0 { tick.g1[i / 2] } else { tick.g2[i / 2] };
                next[i] = push[0] * d[0] + push[1] * d[1];
                let mut j = 0;
                while j < 4 {
                    next[i] += phi[i][j] * x[j];
                    j += 1;
                }
                i += 1;
            }
            let e = [next[0], next[2]];
            let mut encoder = 0;
            while encoder < 2 {
                if e[encoder].abs() > peaks[shaft][encoder] {
                    peaks[shaft][encoder] = e[encoder].abs();
                }
                let mut i = 0;
                while i < 2 {
                    let gain = &gains[i][encoder];
                    next[2 * i] -= gain[0] * e[encoder];
                    next[2 * i + 1] -= gain[1] * e[encoder];
                    d[i] -= gain[2] * e[encoder];
                    i += 1;
                }
                encoder += 1;
            }
            x = next;
            passed += 1;
        }
        shaft += 1;
    }
    peaks
}

/// Regulator and its σ*, as functions of x = (q_l, v_l, q_m, v_m, i) and d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regulator {
    /// Feedback gain K.
    pub feedback: [f64; STATES],
    /// Gain N from d to the u that balances d at rest. The total gain from d is N + K Π (`disturbance`).
    pub rest: [f64; 2],
    /// Total gain N + K Π from d to u.
    pub disturbance: [f64; 2],
    /// Pole z of the reaching law.
    pub reaching: f64,
    /// Weights c of σ* on x, with c'Γ = 1.
    pub surface: [f64; STATES],
    /// Weights g of σ* on d.
    pub known: [f64; 2],
}

impl Regulator {
    /// Computes the regulator for the poles w_c and k_l of a rigid shaft, 1/s. `None` if no real pole remains for the
    /// reaching law.
    pub const fn of(ratios: &JointRatios, tick: &JointTick, period_s: f64, [w_c, k_l]: [f64; 2]) -> Option<Self> {
        let (r, t) = (ratios, period_s);
        let (phi, gamma) = tick.matrices(r);
        let w2 = w_c * k_l;
        let theta2 = (w_c * w_c + k_l * k_l) / (w2 * w2);
        // In ticks, with u in units of its effect on a rigid shaft in one tick: all entries have similar magnitudes.
        let unit = r.rigid_gain() * t * t;
        let scale = [1.0, t, 1.0, t, unit];
        let mut a = [[0.0; STATES]; STATES];
        let (mut column, mut i) = ([[0.0; 1]; STATES], 0);
        while i < STATES {
            let mut j = 0;
            while j < STATES {
                a[i][j] = phi[i][j] * scale[i] / scale[j];
                j += 1;
            }
            column[i][0] = gamma[i] * scale[i] / unit;
            i += 1;
        }
        let rho = 1.0 / (w2 * w2 * t * t * t * t);
        let mut g = times(&column, &transposed(&column));
        let mut weights = [[0.0; STATES]; STATES];
        (weights[0][0], weights[1][1]) = (1.0, theta2 / (t * t));
        let mut i = 0;
        while i < STATES {
            let mut j = 0;
            while j < STATES {
                g[i][j] /= rho;
                j += 1;
            }
            i += 1;
        }
        let p = riccati(a, g, weights);
        let by_gamma = times(&transposed(&column), &p);
        let most = times(&by_gamma, &column)[0][0] + rho;
        let k = times(&by_gamma, &a);
        let mut closed = a;
        let mut feedback = [0.0; STATES];
        let mut i = 0;
        while i < STATES {
            let mut j = 0;
            while j < STATES {
                closed[i][j] -= column[i][0] * k[0][j] / most;
                j += 1;
            }
            feedback[i] = k[0][i] / most * scale[i] / unit;
            i += 1;
        }
        let Some(reaching) = fastest_real_pole(&closed, tick.keeps) else { return None };
        // c' (A_c - z) = 0 and c' Γ = 1: the one solution of (A_c' - z + Γ Γ') c = Γ.
        let singular = plus(&transposed(&closed), &identity(), -reaching);
        let c = solved(plus(&singular, &times(&column, &transposed(&column)), 1.0), column);
        let mut surface = [0.0; STATES];
        let mut i = 0;
        while i < STATES {
            surface[i] = c[i][0] * scale[i] / unit;
            i += 1;
        }
        // The link rests at 0: the spring balances d_l, and u balances the spring and d_m.
        let pi = [[-1.0 / r.k1, -r.k2 / (r.k1 * r.b)], [0.0, -1.0 / r.b]];
        let (mut rest, mut disturbance, mut known) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let mut i = 0;
        while i < 2 {
            let [twist, current] = pi[i];
            rest[i] = current;
            disturbance[i] = current + feedback[2] * twist + feedback[4] * current;
            known[i] = -(surface[2] * twist + surface[4] * current);
            i += 1;
        }
        Some(Self { feedback, rest, disturbance, reaching, surface, known })
    }
}

/// Returns z = 1 + w for the largest real -w of det(w - E), E = A - I, in (0, 1), without the pole of the current loop.
const fn fastest_real_pole(closed: &Matrix<STATES, STATES>, keeps: f64) -> Option<f64> {
    let e = plus(closed, &identity(), -1.0);
    // Faddeev and LeVerrier: det(w - E) = w^5 + p_1 w^4 + .. + p_5.
    let (mut m, mut p, mut k) = (identity::<STATES>(), [1.0; STATES + 1], 1);
    while k <= STATES {
        let em = times(&e, &m);
        let (mut trace, mut i) = (0.0, 0);
        while i < STATES {
            trace += em[i][i];
            i += 1;
        }
        p[k] = -trace / k as f64;
        m = plus(&em, &identity(), p[k]);
        k += 1;
    }
    // From the fastest pole on: 1 - z falls by 2 % per point.
    let current = current_poles(keeps);
    let (mut high, mut steps) = (0.9999, 0);
    while steps < 600 {
        let low = 0.98 * high;
        if (at(&p, -high) < 0.0) != (at(&p, -low) < 0.0) {
            let (mut a, mut b, mut halvings) = (low, high, 0);
            while halvings < 60 {
                let middle = 0.5 * (a + b);
                if (at(&p, -middle) < 0.0) == (at(&p, -a) < 0.0) {
                    a = middle;
                } else {
                    b = middle;
                }
                halvings += 1;
            }
            let found = 0.5 * (a + b);
            if !(current[0] < found && found < current[1]) {
                return Some(1.0 - found);
            }
        }
        high = low;
        steps += 1;
    }
    None
}

/// Returns the range of 1 - z for a pole within 15 % of the current loop: e^(-T/lag) to the power of 0.85 and 1.15.
const fn current_poles(keeps: f64) -> [f64; 2] {
    // The current error vanishes within a tick, below rounding.
    if keeps < 1e-9 {
        return [2.0, 2.0];
    }
    let log = natural_logarithm(keeps);
    let mut out = [0.0; 2];
    let mut k = 0;
    while k < 2 {
        let x = log * if k == 0 { 0.85 } else { 1.15 };
        out[k] = 1.0 - crate::exponential::phi_functions(x)[0];
        k += 1;
    }
    out
}

/// Returns ln x, by Newton's method on the exponential.
const fn natural_logarithm(x: f64) -> f64 {
    let (mut y, mut round) = (0.0, 0);
    while round < 60 {
        let step = x / crate::exponential::phi_functions(y)[0] - 1.0;
        y += step;
        // The next correction would be its square.
        if step.abs() < 1e-9 {
            return y;
        }
        round += 1;
    }
    y
}

/// Returns the polynomial with these coefficients, highest power first.
const fn at(p: &[f64; STATES + 1], w: f64) -> f64 {
    let (mut sum, mut k) = (0.0, 0);
    while k <= STATES {
        sum = sum * w + p[k];
        k += 1;
    }
    sum
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// Data sheets without prior tuning: the paper's, a harmonic drive, two masses at 92 Hz, w_r T = 1.9, an elevator.
    const JOINTS: [(JointRatios, f64, [f64; 2]); 5] = [
        (JointRatios::of(&Joint::TABLE_I, 2e-4), 1e-3, [27.0, 390.0]),
        (ratios([0.4, 0.5, 8000.0, 1.2, 2.0, 8.0], 2e-4), 1e-3, [40.0, 90.0]),
        (ratios([0.08, 0.05, 3000.0, 0.01, 0.01, 1.2], 1e-4), 2.5e-4, [60.0, 120.0]),
        (ratios([0.002, 0.001, 200.0, 6e-5, 1e-4, 0.05], 0.0), 1e-3, [30.0, 90.0]),
        (ratios([20.0, 2.0, 3e4, 4.0, 1.0, 30.0], 1e-3), 2e-3, [5.0, 30.0]),
    ];

    const fn ratios([j_l, b_l, k, j_m, b_m, k_t]: [f64; 6], lag_s: f64) -> JointRatios {
        JointRatios { k1: k / j_l, k2: k / j_m, b1: b_l / j_l, b2: b_m / j_m, b: k_t / j_m, lag_s }
    }

    fn noise() -> impl FnMut() -> f64 {
        let mut seed = 1_u64;
        move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        }
    }

    /// Integrates the equations of the module documentation by the Runge-Kutta rule with 2000 steps, in SI units only.
    fn moved(r: &JointRatios, t: f64, x: [f64; STATES], u: f64, d: [f64; 2]) -> [f64; STATES] {
        let rate = |x: [f64; STATES]| {
            let (twist, i) = (x[2] - x[0], if r.lag_s > 0.0 { x[4] } else { u });
            let current = if r.lag_s > 0.0 { (u - x[4]) / r.lag_s } else { 0.0 };
            let link = r.k1 * twist - r.b1 * x[1] + d[0];
            [x[1], link, x[3], -r.k2 * twist - r.b2 * x[3] + r.b * i + d[1], current]
        };
        let (mut x, h) = (x, t / 2000.0);
        for _ in 0..2000 {
            let add = |k: [f64; STATES], by: f64| core::array::from_fn(|i| x[i] + by * k[i]);
            let k1 = rate(x);
            let k2 = rate(add(k1, 0.5 * h));
            let k3 = rate(add(k2, 0.5 * h));
            let k4 = rate(add(k3, h));
            x = core::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        if r.lag_s == 0.0 {
            x[4] = u;
        }
        x
    }

    #[test]
    fn a_tick_is_the_motion_of_the_joint() {
        let (mut noise, mut worst) = (noise(), 0.0_f64);
        for (r, t, _) in JOINTS {
            let tick = JointTick::of(&r, t);
            let (phi, gamma) = tick.matrices(&r);
            for _ in 0..20 {
                let x = [noise(), noise(), noise(), noise(), noise()];
                let (u, d) = (noise(), [noise() / t, noise() / t]);
                let expected = moved(&r, t, x, u, d);
                for i in 0..4 {
                    let by_d = if i % 2 == 0 { tick.g1[i / 2] } else { tick.g2[i / 2] };
                    let found = (0..STATES).map(|j| phi[i][j] * x[j]).sum::<f64>()
                        + gamma[i] * u
                        + by_d[0] * d[0]
                        + by_d[1] * d[1];
                    let size = if i % 2 == 0 { 1.0 } else { 1.0 / t };
                    worst = worst.max((found - expected[i]).abs() / size);
                }
                worst = worst.max((phi[4][4] * x[4] + gamma[4] * u - expected[4]).abs());
            }
        }
        std::println!("a tick is off by {worst:.1e}");
        assert!(worst < 1e-12, "{worst:e}");
    }

    /// Checks that u of the surface equals u of the regulator, and that the next σ* is z σ*, for any state.
    #[test]
    fn the_regulator_is_the_law_of_the_paper() {
        let (mut noise, mut worst) = (noise(), [0.0_f64; 2]);
        for (r, t, poles) in JOINTS {
            let tick = JointTick::of(&r, t);
            let (phi, gamma) = tick.matrices(&r);
            let law = Regulator::of(&r, &tick, t, poles).expect("a real pole");
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            assert!((dot(&law.surface, &gamma) - 1.0).abs() < 1e-12);
            for _ in 0..50 {
                let x: [f64; STATES] = [noise(), noise() / t, noise(), noise() / t, noise()];
                let d = [noise() / t, noise() / t];
                let u = law.disturbance[0] * d[0] + law.disturbance[1] * d[1] - dot(&law.feedback, &x);
                let sigma = dot(&law.surface, &x) + dot(&law.known, &d);
                let at_rest = |d: [f64; 2]| [0.0, 0.0, -d[0] / r.k1, 0.0, -(r.k2 / r.k1 * d[0] + d[1]) / r.b];
                let pi = at_rest(d);
                let away: [f64; STATES] = core::array::from_fn(|i| x[i] - pi[i]);
                let drift: f64 = (0..STATES).map(|i| law.surface[i] * (dot(&phi[i], &away) - away[i])).sum();
                let by_surface = pi[4] - drift - (1.0 - law.reaching) * sigma;
                let scale = u.abs().max(by_surface.abs()).max(sigma.abs());
                worst[0] = worst[0].max((u - by_surface).abs() / scale);
                let next: [f64; STATES] = core::array::from_fn(|i| {
                    let by_d = match i {
                        4 => [0.0; 2],
                        i if i % 2 == 0 => tick.g1[i / 2],
                        i => tick.g2[i / 2],
                    };
                    dot(&phi[i], &x) + gamma[i] * u + dot(&by_d, &d)
                });
                let later = dot(&law.surface, &next) + dot(&law.known, &d);
                worst[1] = worst[1].max((later - law.reaching * sigma).abs() / scale);
            }
        }
        std::println!("u off by {:.1e}, sigma* by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-11 && worst[1] < 1e-11, "{worst:?}");
    }

    /// Checks a very stiff spring: the two poles are at their design values.
    #[test]
    fn of_a_rigid_shaft_both_poles_are_met() {
        let rigid = ratios([0.01, 0.0, 1e6, 0.01, 0.0, 0.05], 0.0);
        let (t, [w_c, k_l]) = (1e-4, [20.0, 90.0]);
        let law = Regulator::of(&rigid, &JointTick::of(&rigid, t), t, [w_c, k_l]).expect("a real pole");
        assert!((law.reaching - libm::exp(-k_l * t)).abs() < 1e-4, "{} for {}", law.reaching, libm::exp(-k_l * t));
    }

    /// Checks the filter against the recursion without noise: an error of every state decays.
    #[test]
    fn an_error_of_the_observer_dies_out() {
        for (r, t, _) in JOINTS {
            let tick = JointTick::of(&r, t);
            let (phi, _) = tick.matrices(&r);
            let gains = tick.observer_gains(&r, t, [6e-6, 1e-5], [0.06 / t, 0.3 / t]);
            let mut x = [1e-3, 0.1, 5.0, -1e-3, 0.3, -8.0];
            let mut size = [0.0_f64; 2];
            for tick_number in 0..2000 {
                let old = x;
                for shaft in 0..2 {
                    let row =
                        |i: usize| [0, 1].map(|j| phi[i][2 * j] * old[3 * j] + phi[i][2 * j + 1] * old[3 * j + 1]);
                    let push = |g: &[[f64; 2]; 2]| g[shaft][0] * old[2] + g[shaft][1] * old[5];
                    x[3 * shaft] = row(2 * shaft).iter().sum::<f64>() + push(&tick.g1);
                    x[3 * shaft + 1] = row(2 * shaft + 1).iter().sum::<f64>() + push(&tick.g2);
                }
                let e = [x[0], x[3]];
                for shaft in 0..2 {
                    for s in 0..3 {
                        x[3 * shaft + s] -= gains[shaft][0][s] * e[0] + gains[shaft][1][s] * e[1];
                    }
                }
                size[usize::from(tick_number > 1000)] =
                    size[usize::from(tick_number > 1000)].max(e[0].abs().max(e[1].abs()));
            }
            assert!(size[1] < 1e-2 * size[0], "{size:?}");
        }
    }
}
