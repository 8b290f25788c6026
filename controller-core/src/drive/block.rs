//! Observer block of one encoder: a second-order system with a slow disturbance.
//!
//! $$ \ddot q = -\kappa q - \lambda \dot q + w + d, \qquad \dot d = d_1 \approx \mathrm{const} $$
//!
//! The coupling $w$ is known at the ticks. If the motor drives this block, $b u$ is added. A rigid shaft has
//! $\kappa = 0$ and no coupling. With $E = e^{A T} - I$ of $(q, \dot q, d, d_1)$ the model of one tick is exact for an
//! input that is constant (a held u) or linear (the mean of $w$ at both ends):
//!
//! $$ g_2 = \Phi_{12}, \quad g_1 = \Phi_{13}, \quad h_1 = \Phi_{14}, \quad \varphi = \Phi_{22}, \qquad
//!    m = \bar w + b u + d - \kappa q $$
//! $$ q \mathrel{+}= g_2 v + g_1 m + h_1 d_1, \qquad v = \varphi v + g_2 m + g_1 d_1, \qquad d \mathrel{+}= T d_1 $$
//!
//! # Gains
//! The observer corrects with the sample of its own instant, $x \mathrel{+}= L e$. Ackermann's formula places the poles
//! of $(I - L h) \Phi$ at $e^{\text{pole} \cdot T}$. The poles are the poles of a Bessel filter, scaled by the
//! bandwidth. The computation uses units of one tick (position, speed T, d T², d_1 T³) and $E$ rather than $\Phi$. So a
//! slow observer at a short period loses no digit. The poles agree to 1e-14 from 50 µs to 10 ms (test
//! `poles_lie_where_they_were_asked_for`). With three states the last one, $d_1$, is omitted.

use super::fields::fields;
use crate::exponential::{exp_minus_identity, product};
use crate::matrix;
use crate::observer::Pole;

/// Returns the Bessel poles of an observer with 3 or 4 states and a bandwidth of 1 rad/s, one of each pair.
pub const fn bessel_poles(states: usize) -> [Pole; 2] {
    if states == 3 {
        [Pole { re: -0.7456, im: 0.7114 }, Pole { re: -0.9416, im: 0.0 }]
    } else {
        [Pole { re: -0.6572, im: 0.8302 }, Pole { re: -0.9048, im: 0.2709 }]
    }
}

fields! {
    /// Model of one tick, and the gains of its observer with S states: position, speed, d, and, with four, d_1.
    pub(crate) struct Block<T, const S> {
        /// Damping λ, 1/s. The tick does not use it.
        lambda: T,
        phi: T,
        g2: T,
        g1: T,
        /// Coefficient h_1. Not read with three states.
        h1: T,
        /// Gains L_1 .. L_S.
        gains as "gain": [T; S],
    }
}

impl<const S: usize> Block<f64, S> {
    pub(crate) const fn design(kappa: f64, lambda: f64, period_s: f64, bandwidth_rad_s: f64) -> Self {
        let t = period_s;
        let e = moved(kappa, lambda, t);
        Self {
            lambda,
            phi: 1.0 + e[1][1],
            g2: e[0][1] * t,
            g1: e[0][2] * t * t,
            h1: e[0][3] * t * t * t,
            gains: gains(&e, t, bandwidth_rad_s),
        }
    }

    /// Returns the gains of the block for another bandwidth.
    pub(crate) const fn gains_at(kappa: f64, lambda: f64, period_s: f64, bandwidth_rad_s: f64) -> [f64; S] {
        gains(&moved(kappa, lambda, period_s), period_s, bandwidth_rad_s)
    }
}

/// Returns E = exp(AT) - I in units of one tick.
const fn moved(kappa: f64, lambda: f64, t: f64) -> [[f64; 4]; 4] {
    exp_minus_identity([
        [0.0, 1.0, 0.0, 0.0],
        [-kappa * t * t, -lambda * t, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 0.0],
    ])
}

/// Returns L = q(E) x (Ackermann). q is the wanted polynomial in z - 1. x solves (row 1 of Φ) E^i x = (i = S - 1).
const fn gains<const S: usize>(all: &[[f64; 4]; 4], t: f64, bandwidth_rad_s: f64) -> [f64; S] {
    const { assert!(S == 3 || S == 4, "an observer of an encoder has 3 or 4 states") };
    let mut e = [[0.0; S]; S];
    let mut i = 0;
    while i < S {
        let mut j = 0;
        while j < S {
            e[i][j] = all[i][j];
            j += 1;
        }
        i += 1;
    }
    let mut rows = [[0.0; S]; S];
    rows[0] = e[0];
    rows[0][0] += 1.0;
    let mut i = 1;
    while i < S {
        let mut j = 0;
        while j < S {
            let mut k = 0;
            while k < S {
                rows[i][j] += rows[i - 1][k] * e[k][j];
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    let mut last = [[0.0]; S];
    last[S - 1] = [1.0];
    let solved = matrix::solved(rows, last);
    let (mut l, mut i) = ([0.0; S], 0);
    while i < S {
        l[i] = solved[i][0];
        i += 1;
    }
    let poles = bessel_poles(S);
    let mut k = 0;
    while k < poles.len() {
        let scale = bandwidth_rad_s * t;
        let (a, b) = (poles[k].re * scale, poles[k].im * scale);
        let [[re, _], [im, _]] = exp_minus_identity([[a, -b], [b, a]]);
        l = if poles[k].im == 0.0 {
            // (E - r) l
            plus(&times(&e, &l), &l, -re)
        } else {
            // (E² - 2 Re E + |.|²) l
            plus(&plus(&times(&product(&e, &e), &l), &times(&e, &l), -2.0 * re), &l, re * re + im * im)
        };
        k += 1;
    }
    let (mut i, mut unit) = (0, 1.0);
    while i < S {
        l[i] /= unit;
        unit *= t;
        i += 1;
    }
    l
}

const fn times<const S: usize>(a: &[[f64; S]; S], x: &[f64; S]) -> [f64; S] {
    let mut out = [0.0; S];
    let mut i = 0;
    while i < S {
        let mut j = 0;
        while j < S {
            out[i] += a[i][j] * x[j];
            j += 1;
        }
        i += 1;
    }
    out
}

/// Returns a + factor b.
const fn plus<const S: usize>(a: &[f64; S], b: &[f64; S], factor: f64) -> [f64; S] {
    let mut out = *a;
    let mut i = 0;
    while i < S {
        out[i] += factor * b[i];
        i += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    type Complex = (f64, f64);

    fn mul(a: Complex, b: Complex) -> Complex {
        (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
    }

    fn over(a: Complex, b: Complex) -> Complex {
        let size = b.0 * b.0 + b.1 * b.1;
        let (re, im) = mul(a, (b.0, -b.1));
        (re / size, im / size)
    }

    /// Returns |det|, by elimination.
    fn determinant(mut a: Vec<Vec<Complex>>) -> f64 {
        let mut det = 1.0;
        for k in 0..a.len() {
            let best = (k..a.len()).max_by(|&i, &j| a[i][k].0.hypot(a[i][k].1).total_cmp(&a[j][k].0.hypot(a[j][k].1)));
            a.swap(k, best.expect("a row"));
            det *= a[k][k].0.hypot(a[k][k].1);
            for i in k + 1..a.len() {
                let factor = over(a[i][k], a[k][k]);
                for j in k..a.len() {
                    let less = mul(factor, a[k][j]);
                    a[i][j] = (a[i][j].0 - less.0, a[i][j].1 - less.1);
                }
            }
        }
        det
    }

    /// Returns exp(AT) by its series in SI units, independent of the module.
    fn phi<const S: usize>(kappa: f64, lambda: f64, t: f64) -> [[f64; S]; S] {
        let a: [[f64; S]; S] = core::array::from_fn(|i| {
            core::array::from_fn(|j| match (i, j) {
                (0, 1) | (1, 2) | (2, 3) => 1.0,
                (1, 0) => -kappa,
                (1, 1) => -lambda,
                _ => 0.0,
            })
        });
        let mut term: [[f64; S]; S] = core::array::from_fn(|i| core::array::from_fn(|j| f64::from(u8::from(i == j))));
        let mut sum = term;
        for k in 1..30 {
            let before = term;
            for i in 0..S {
                for j in 0..S {
                    term[i][j] = (0..S).map(|m| before[i][m] * a[m][j]).sum::<f64>() * t / f64::from(k);
                    sum[i][j] += term[i][j];
                }
            }
        }
        sum
    }

    /// Returns the distance of the poles of (I - L h) Φ from the wanted ones: |p(z)|/|p'(z)| at each of them.
    fn off_by<const S: usize>(block: &Block<f64, S>, kappa: f64, lambda: f64, t: f64, bandwidth: f64) -> f64 {
        let p = phi::<S>(kappa, lambda, t);
        let bessel: &[Complex] = if S == 3 {
            &[(-0.7456, 0.7114), (-0.7456, -0.7114), (-0.9416, 0.0)]
        } else {
            &[(-0.6572, 0.8302), (-0.6572, -0.8302), (-0.9048, 0.2709), (-0.9048, -0.2709)]
        };
        let z: Vec<Complex> = bessel
            .iter()
            .map(|&(re, im)| (re * bandwidth * t, im * bandwidth * t))
            .map(|(a, b)| (a.exp() * b.cos(), a.exp() * b.sin()))
            .collect();
        let errors = z.iter().enumerate().map(|(k, &(re, im))| {
            let unit = |i: usize| t.powi(i32::try_from(i).expect("small"));
            let matrix = (0..S).map(|i| {
                let entry = |j: usize| {
                    let f = (p[i][j] - block.gains[i] * p[0][j]) * unit(i) / unit(j);
                    if i == j { (re - f, im) } else { (-f, 0.0) }
                };
                (0..S).map(entry).collect()
            });
            let others = z.iter().enumerate().filter(|&(j, _)| j != k);
            determinant(matrix.collect()) / others.map(|(_, o)| (re - o.0).hypot(im - o.1)).product::<f64>()
        });
        errors.fold(0.0, f64::max)
    }

    /// Checks the poles with limits of ten times the measured errors.
    #[test]
    fn poles_lie_where_they_were_asked_for() {
        let mut worst = [0.0_f64; 2];
        for t in [5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2] {
            for bandwidth in [40.0, 80.0, 187.5, 500.0, 2000.0] {
                // Shaft, link and motor of the paper's joint.
                for (kappa, lambda) in [(0.0, 0.05), (0.0, 5.0), (40.13, 0.304), (9667.0, 75.2)] {
                    if bandwidth * t > 0.8 {
                        continue;
                    }
                    let three = Block::<f64, 3>::design(kappa, lambda, t, bandwidth);
                    let four = Block::<f64, 4>::design(kappa, lambda, t, bandwidth);
                    worst[0] = worst[0].max(off_by(&three, kappa, lambda, t, bandwidth));
                    worst[1] = worst[1].max(off_by(&four, kappa, lambda, t, bandwidth));
                }
            }
        }
        std::println!("poles off by {:.1e} (three states), {:.1e} (four)", worst[0], worst[1]);
        assert!(worst[0] <= 1e-14 && worst[1] <= 4e-14, "{worst:?}");
    }

    #[test]
    fn the_model_of_a_tick_is_the_matrix_exponential() {
        for (kappa, lambda, t) in [(0.0, 0.05, 1e-3), (40.13, 0.304, 1e-2), (9667.0, 75.2, 1e-3)] {
            let (block, p) = (Block::<f64, 4>::design(kappa, lambda, t, 50.0), phi::<4>(kappa, lambda, t));
            let pairs = [(block.g2, p[0][1]), (block.g1, p[0][2]), (block.h1, p[0][3]), (block.phi, p[1][1])];
            for (found, expected) in pairs {
                assert!((found / expected - 1.0).abs() <= 1e-13, "{found} for {expected}");
            }
        }
    }
}
