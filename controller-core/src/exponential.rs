//! Three exponentials in `const fn`, without a library function.
//!
//! * $\varphi_j(z) = \sum_m z^m/(m+j)!$: the response of a chain of integrators behind a first-order lag in one tick;
//! * $\exp(A) - I$ of a matrix, with all digits of a slow mode;
//! * from it the discrete observer gains $\gamma$.
//!
//! A series alone fails for large arguments. Each series is summed for a small argument and then doubled up.

use crate::{MAX_N, MAX_R};

/// Returns period^exponent.
pub(crate) const fn raised(period: f64, exponent: usize) -> f64 {
    let mut product = 1.0;
    let mut k = 0;
    while k < exponent {
        product *= period;
        k += 1;
    }
    product
}

/// Number of functions φ_0..φ_8: a plant of order 6 with an observer of order 3 needs t_8.
pub(crate) const PHIS: usize = MAX_N + MAX_R;
pub(crate) const FACTORIAL: [f64; PHIS] = [1.0, 1.0, 2.0, 6.0, 24.0, 120.0, 720.0, 5040.0, 40320.0];

/// Returns φ_j(z) = Σ_m z^m/(m+j)!, j = 0..8, without an exponential.
///
/// The series alone is wrong by 1e19 at z = -48. So it is summed where |z| <= 1/2 and doubled up from there: φ_j(2z) =
/// [φ_0 φ_j + Σ_{k=1..j} φ_k/(j-k)!] / 2^j.
pub(crate) const fn phi_functions(z: f64) -> [f64; PHIS] {
    let mut z = z;
    let mut doublings = 0;
    while z.abs() > 0.5 && doublings < 1100 {
        z /= 2.0;
        doublings += 1;
    }
    let mut phi = [0.0; PHIS];
    let mut j = 0;
    while j < PHIS {
        // Horner from the smallest term: φ_j = (1/j!) (1 + z/(j+1) (1 + z/(j+2) (..))).
        let mut sum = 1.0;
        let mut m = 18;
        while m > 0 {
            sum = 1.0 + z / (m + j) as f64 * sum;
            m -= 1;
        }
        phi[j] = sum / FACTORIAL[j];
        j += 1;
    }
    while doublings > 0 {
        let old = phi;
        let mut scale = 1.0;
        let mut j = 0;
        while j < PHIS {
            let mut sum = old[0] * old[j];
            let mut k = 1;
            while k <= j {
                sum += old[k] / FACTORIAL[j - k];
                k += 1;
            }
            phi[j] = sum / scale;
            scale *= 2.0;
            j += 1;
        }
        doublings -= 1;
    }
    phi
}

/// Returns the coefficients γ_1..γ_r of det(wI - E) with E = exp(DT) - I, D the companion matrix of Eq. (53).
///
/// The function builds E itself, never exp(DT): a later subtraction of I would lose the digits of a slow pole.
pub(crate) const fn channel_gammas(l: [f64; MAX_R], order: usize, period: f64) -> [f64; MAX_R] {
    // D in per-step units: -l_j T^j in the first column, ones above the diagonal.
    let mut d = [[0.0; MAX_R]; MAX_R];
    let mut i = 0;
    // The second comparison lets an index do without a check that could panic.
    while i < order && i < MAX_R {
        d[i][0] = -l[i] * raised(period, i + 1);
        if i + 1 < order && i + 1 < MAX_R {
            d[i][i + 1] += 1.0;
        }
        i += 1;
    }
    let e = exp_minus_identity(d);
    let trace = e[0][0] + e[1][1] + e[2][2];
    let minors = e[0][0] * e[1][1] - e[0][1] * e[1][0] + e[0][0] * e[2][2] - e[0][2] * e[2][0] + e[1][1] * e[2][2]
        - e[1][2] * e[2][1];
    let determinant = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1])
        - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0])
        + e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    // A lower order leaves rows of zeros: its higher coefficients are exact zeros.
    [-trace, minors, -determinant]
}

/// Returns exp(A) - I: halves until the norm is at most 1/2, sums the series, then applies E <- 2E + E² as often.
pub(crate) const fn exp_minus_identity<const S: usize>(mut a: [[f64; S]; S]) -> [[f64; S]; S] {
    let mut doublings = 0;
    while row_norm(&a) > 0.5 && doublings < 1100 {
        a = scaled(&a, 0.5);
        doublings += 1;
    }
    let mut e = [[0.0; S]; S];
    let mut k = 16;
    while k > 0 {
        // E <- A (I + E)/k
        let mut i = 0;
        while i < S {
            e[i][i] += 1.0;
            i += 1;
        }
        e = scaled(&product(&a, &e), 1.0 / k as f64);
        k -= 1;
    }
    while doublings > 0 {
        let square = product(&e, &e);
        let mut i = 0;
        while i < S {
            let mut j = 0;
            while j < S {
                e[i][j] = 2.0 * e[i][j] + square[i][j];
                j += 1;
            }
            i += 1;
        }
        doublings -= 1;
    }
    e
}

const fn row_norm<const S: usize>(a: &[[f64; S]; S]) -> f64 {
    let mut norm = 0.0;
    let mut i = 0;
    while i < S {
        let mut sum = 0.0;
        let mut j = 0;
        while j < S {
            sum += a[i][j].abs();
            j += 1;
        }
        if sum > norm {
            norm = sum;
        }
        i += 1;
    }
    norm
}

const fn scaled<const S: usize>(a: &[[f64; S]; S], factor: f64) -> [[f64; S]; S] {
    let mut out = *a;
    let mut i = 0;
    while i < S {
        let mut j = 0;
        while j < S {
            out[i][j] *= factor;
            j += 1;
        }
        i += 1;
    }
    out
}

pub(crate) const fn product<const S: usize>(a: &[[f64; S]; S], b: &[[f64; S]; S]) -> [[f64; S]; S] {
    let mut out = [[0.0; S]; S];
    let mut i = 0;
    while i < S {
        let mut j = 0;
        while j < S {
            let mut k = 0;
            while k < S {
                out[i][j] += a[i][k] * b[k][j];
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::{ObserverGains, Pole};

    fn off_by(found: f64, expected: f64) -> f64 {
        (found / expected - 1.0).abs()
    }

    /// Checks det(wI - (e^{DT} - I)) = prod (w - (e^{pole T} - 1)). 1e-14 is about 50 ulp: the gains carry one rounding
    /// each, the squarings a few more.
    #[test]
    fn gammas_equal_their_closed_forms_for_periods_from_1e_2_to_1e_5() {
        for period in [1e-2, 1e-3, 1e-4, 1e-5] {
            for omega in [0.2, 10.0, 50.0, 200.0] {
                let q = -libm::expm1(-omega * period);
                let one = ObserverGains::<1>::from_bandwidth::<1>(omega).gammas(period);
                let two = ObserverGains::<2>::from_bandwidth::<2>(omega).gammas(period);
                let three = ObserverGains::<3>::from_bandwidth::<3>(omega).gammas(period);
                let found = [one[0], two[0], two[1], three[0], three[1], three[2]];
                let expected = [q, 2.0 * q, q * q, 3.0 * q, 3.0 * q * q, q * q * q];
                for (found, expected) in found.into_iter().zip(expected) {
                    let off = off_by(found, expected);
                    assert!(off <= 1e-14, "T = {period}, pole {omega}: {found:e} for {expected:e}, off by {off:e}");
                }
            }
        }
    }

    /// Checks a real pole and a pair, with e^{a + ib} - 1 by expm1, sin and cos.
    #[test]
    fn gammas_equal_their_closed_forms_for_complex_poles() {
        for period in [1e-2, 1e-3, 1e-4, 1e-5] {
            let (re, im, real) = (-40.0, 30.0, -70.0);
            let gains = ObserverGains::<3>::from_poles([Pole { re, im }, Pole { re, im: -im }, Pole::real(real)]);
            let (a, b) = (re * period, im * period);
            let half_chord = libm::sin(b / 2.0);
            let qr = libm::expm1(a) * libm::cos(b) - 2.0 * half_chord * half_chord;
            let qi = libm::exp(a) * libm::sin(b);
            let q = libm::expm1(real * period);
            let size = qr * qr + qi * qi;
            let expected = [-(2.0 * qr + q), size + 2.0 * qr * q, -size * q];
            for (found, expected) in gains.gammas(period).into_iter().zip(expected) {
                let off = off_by(found, expected);
                assert!(off <= 1e-14, "T = {period}: {found:e} for {expected:e}, off by {off:e}");
            }
        }
    }

    /// Checks φ_1 = expm1(z)/z down to z = -48, where the series alone is wrong by 1e19.
    #[test]
    fn phi_functions_hold_far_from_zero() {
        for z in [-48.0, -10.0, -2.0, -0.5, -1e-3, 1e-3, 0.4, 3.0, 10.0] {
            let phi = phi_functions(z);
            assert!(off_by(phi[0], libm::exp(z)) <= 1e-13, "φ_0({z})");
            // φ_{j+1} = (φ_j - 1/j!)/z: true for all z, and well conditioned where |z| is large.
            assert!(off_by(phi[1], libm::expm1(z) / z) <= 1e-14, "φ_1({z})");
            if libm::fabs(z) >= 10.0 {
                for j in 1..PHIS - 1 {
                    let expected = (phi[j] - 1.0 / FACTORIAL[j]) / z;
                    assert!(off_by(phi[j + 1], expected) <= 1e-11, "φ_{}({z})", j + 1);
                }
            }
        }
    }
}
