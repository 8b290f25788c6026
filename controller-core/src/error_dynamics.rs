//! Error dynamics of the extended disturbance observer: its decay rates and its input.
//!
//! With $\tilde d = d - \hat d$ (Eq. (8)-(9)) the errors of one channel are
//! $\tilde e_i = [\tilde d_i, \tilde d_i', \dots, \tilde d_i^{(r-1)}]^T$. They obey Eq. (52) (Eq. (15) for r = 2):
//!
//! $$ \tilde e_i' = D_i \tilde e_i + E_i d_i^{(r)}, \qquad
//!    D_i = \begin{bmatrix} -l_{i1} & 1 & & \cr -l_{i2} & & \ddots & \cr \vdots & & & 1 \cr -l_{ir} & & &
//!    \end{bmatrix}, \quad E_i = \begin{bmatrix} 0 \cr \vdots \cr 0 \cr 1 \end{bmatrix} \quad
//!    \text{(Eq. (53), (16))} $$
//!
//! So the r-th derivative of the disturbance is the only input of the error. The characteristic polynomial is
//! $\chi(s) = s^r + l_{i1}s^{r-1} + \dots + l_{ir}$. The real parts of its roots are the decay rates in 1/s, negative
//! if stable.
//!
//! # Deviation
//! * Eq. (52) is printed with $\tilde e_i$ up to derivative r. The vector has r entries, up to derivative r - 1.
//! * Example 2 calls (100, 20) and (1000, 300, 30) "pole at -10". Their poles are -99.8, -0.2 and -999.7, -0.15 ±
//!   0.087j (test `printed_gains_do_not_have_their_poles_at_minus_ten`). The gains stand in reverse order. Poles at -10
//!   need (20, 100) and (30, 300, 1000).

use crate::observer::{ObserverGains, Pole};
use crate::polynomial::{TERMS, spectral_radius};
use heapless::Vec;
use nalgebra::linalg::{Schur, balancing::balance_parlett_reinsch};
use nalgebra::{SMatrix, SVector};

/// Largest degree of the polynomials of this crate: the surface of a plant of order 6.
pub(crate) const MAX_DEGREE: usize = 5;

/// Maximum number of iterations for the eigenvalues. Five unknowns need about ten.
pub(crate) const MAX_ITERATIONS: usize = 1000;

/// Returns D and E of Eq. (53), `R` x `R` and `R` x 1.
///
/// An observer of an order below `R` fills the first `order` rows and columns of D. E has its 1 in row `order`, and the
/// rest is zero. Units: row k has s^-k in the first column.
///
/// ```
/// use controller_core::{ObserverGains, error_dynamics::error_matrices};
/// // Eq. (16)
/// let (d, e) = error_matrices(&ObserverGains::<2>::as_printed([100.0, 20.0]));
/// assert_eq!(d, nalgebra::matrix![-100.0, 1.0; -20.0, 0.0]);
/// assert_eq!(e, nalgebra::vector![0.0, 1.0]);
/// ```
pub fn error_matrices<const R: usize>(gains: &ObserverGains<R>) -> (SMatrix<f64, R, R>, SVector<f64, R>) {
    companion(active(gains))
}

/// Returns the eigenvalues of D in rad/s, the fastest (largest magnitude) first. Empty if a gain is not finite.
///
/// A complex pair has its positive imaginary part first.
///
/// # Accuracy
/// Separate poles: 1e-12 relative to each. A pole repeated r times is found to about $\varepsilon^{1/r}$, as from any
/// matrix in f64. The measured errors are 1.8e-8 (r = 2) and 1.4e-5 (r = 3). They form a tiny ring around the true pole
/// (test `poles_survive_the_round_trip_through_gains`).
///
/// ```
/// use controller_core::{ObserverGains, error_dynamics::error_poles};
/// let poles = error_poles(&ObserverGains::<2>::as_printed([100.0, 20.0]));
/// assert!((poles[0].re + 99.8).abs() < 0.001 && (poles[1].re + 0.2).abs() < 0.001);
/// ```
pub fn error_poles<const R: usize>(gains: &ObserverGains<R>) -> Vec<Pole, R> {
    roots(active(gains)).into_iter().flatten().collect()
}

/// Returns the roots of the sliding motion of c_1 .. c_n, Eq. (44), in rad/s, the fastest first.
///
/// The accuracy is the accuracy of [`error_poles`]. The result is empty if there are not 2 to 6 coefficients, or if one
/// is not finite. The last coefficient is taken as 1.
///
/// ```
/// use controller_core::error_dynamics::surface_roots;
/// let roots = surface_roots(&[50.0, 15.0, 1.0]);
/// assert!((roots[0].re + 10.0).abs() < 1e-9 && (roots[1].re + 5.0).abs() < 1e-9);
/// ```
pub fn surface_roots(c: &[f64]) -> Vec<Pole, 5> {
    let mut falling = Vec::<f64, 5>::new();
    if c.iter().rev().skip(1).any(|&c| falling.push(c).is_err()) || falling.is_empty() {
        return Vec::new();
    }
    roots(&falling).into_iter().flatten().collect()
}

/// Returns the gains l_1 .. l_r.
pub(crate) fn active<const R: usize>(gains: &ObserverGains<R>) -> &[f64] {
    gains.l()
}

/// Returns the companion form of Eq. (53) in the first `l.len()` of `S` rows and columns, and its input vector.
pub(crate) fn companion<const S: usize>(l: &[f64]) -> (SMatrix<f64, S, S>, SVector<f64, S>) {
    let (mut d, mut e) = (SMatrix::zeros(), SVector::zeros());
    for (k, gain) in l.iter().enumerate() {
        d[(k, 0)] = -gain;
        if k + 1 < l.len() {
            d[(k, k + 1)] = 1.0;
        } else {
            e[k] = 1.0;
        }
    }
    (d, e)
}

/// Returns the roots of s^d + l_1 s^(d-1) + .. + l_d, the fastest first. `None` for a degree outside 1..=5 or a
/// coefficient that is not finite.
pub(crate) fn roots(l: &[f64]) -> Option<Vec<Pole, MAX_DEGREE>> {
    if !l.iter().all(|gain| gain.is_finite()) {
        return None;
    }
    // In units of the fastest root no entry can overflow when it is squared.
    let mut polynomial = [0.0; TERMS];
    polynomial[0] = 1.0;
    polynomial.get_mut(1..=l.len())?.copy_from_slice(l);
    let unit = spectral_radius(polynomial, l.len());
    let mut scaled = [0.0; MAX_DEGREE];
    for (k, gain) in l.iter().enumerate() {
        scaled[k] = (0..=k).fold(*gain, |value, _| value / unit);
    }
    let scaled = &scaled[..l.len()];
    // Gains of one design differ by decades. Without balancing, their slow poles would lose digits.
    macro_rules! eigenvalues {
        ($matrix:expr) => {{
            let mut matrix = $matrix;
            balance_parlett_reinsch(&mut matrix);
            let schur = Schur::try_new(matrix, f64::EPSILON, MAX_ITERATIONS)?;
            schur.complex_eigenvalues().iter().map(|s| Pole { re: s.re * unit, im: s.im * unit }).collect()
        }};
    }
    let mut roots: Vec<Pole, MAX_DEGREE> = match l.len() {
        1 => core::iter::once(Pole::real(-l[0])).collect(),
        2 => eigenvalues!(companion::<2>(scaled).0),
        3 => eigenvalues!(companion::<3>(scaled).0),
        4 => eigenvalues!(companion::<4>(scaled).0),
        5 => eigenvalues!(companion::<5>(scaled).0),
        _ => return None,
    };
    roots.sort_unstable_by(|a, b| magnitude(*b).total_cmp(&magnitude(*a)).then(b.im.total_cmp(&a.im)));
    Some(roots)
}

/// Returns |s|.
pub(crate) fn magnitude(s: Pole) -> f64 {
    libm::hypot(s.re, s.im)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Returns the largest distance of two pole lists, relative to the fastest pole. Both lists start with the fastest.
    fn distance(found: &[Pole], expected: &[Pole]) -> f64 {
        assert_eq!(found.len(), expected.len());
        let apart = |(a, b): (&Pole, &Pole)| magnitude(Pole { re: a.re - b.re, im: a.im - b.im });
        found.iter().zip(expected).map(apart).fold(0.0, f64::max) / magnitude(expected[0])
    }

    #[test]
    fn printed_gains_do_not_have_their_poles_at_minus_ten() {
        let second = error_poles(&ObserverGains::<2>::as_printed([100.0, 20.0]));
        let root = 2480.0_f64.sqrt();
        assert!(distance(&second, &[Pole::real(-50.0 - root), Pole::real(-50.0 + root)]) < 1e-14, "{second:?}");

        let third = error_poles(&ObserverGains::<3>::as_printed([1000.0, 300.0, 30.0]));
        assert!((third[0].re + 999.7).abs() < 0.001 && third[0].im == 0.0, "{third:?}");
        assert!((third[1].re + 0.15).abs() < 0.0005 && (third[1].im - 0.0866).abs() < 0.0005, "{third:?}");
        assert_eq!((third[1].re, third[1].im), (third[2].re, -third[2].im));
    }

    /// Checks the accuracy in the documentation of `error_poles`.
    #[test]
    fn poles_survive_the_round_trip_through_gains() {
        let pair = |re, im| [Pole { re, im }, Pole { re, im: -im }];
        let real = Pole::real;
        let one = error_poles(&ObserverGains::<3>::from_poles([real(-7.0)]));
        assert_eq!(one, [real(-7.0)]);
        let two = error_poles(&ObserverGains::<3>::from_poles(pair(-3.0, 4.0)));
        assert!(distance(&two, &pair(-3.0, 4.0)) < 1e-14);
        for slow in [-1.0, -0.01] {
            let poles = [real(-1000.0), Pole { re: slow, im: 2.0 }, Pole { re: slow, im: -2.0 }];
            let three = error_poles(&ObserverGains::<3>::from_poles(poles));
            // Relative to the fastest pole. The slow pair must keep its own digits too.
            assert!(distance(&three, &poles) < 1e-14, "{three:?}");
            assert!(distance(&three[1..], &poles[1..]) < 1e-12, "{three:?}");
        }
        // Nine decades: without balancing the slowest pole would be off by 3e-10.
        let poles = [real(-1e5), real(-1.0), real(-1e-4)];
        for (found, expected) in error_poles(&ObserverGains::<3>::from_poles(poles)).iter().zip(poles) {
            assert!((found.re / expected.re - 1.0).abs() < 1e-12 && found.im == 0.0, "{found:?}");
        }
        // Defective: the accuracy is the root of the rounding. The documentation gives the largest loss over the
        // bandwidths.
        let (mut double, mut triple) = (0.0_f64, 0.0_f64);
        for tenth in 1..=10_000 {
            let omega = f64::from(tenth) / 10.0;
            let two = error_poles(&ObserverGains::<2>::from_bandwidth::<2>(omega));
            double = double.max(distance(&two, &[Pole::real(-omega); 2]));
            let three = error_poles(&ObserverGains::<3>::from_bandwidth::<3>(omega));
            triple = triple.max(distance(&three, &[Pole::real(-omega); 3]));
        }
        assert!(double < 2e-8 && triple < 2e-5, "double {double:e}, triple {triple:e}");
    }

    #[test]
    fn an_order_below_the_capacity_leaves_the_rest_of_d_and_e_zero() {
        let (d, e) = error_matrices(&ObserverGains::<3>::as_printed([100.0, 20.0]));
        assert_eq!(d, nalgebra::matrix![-100.0, 1.0, 0.0; -20.0, 0.0, 0.0; 0.0, 0.0, 0.0]);
        assert_eq!(e, nalgebra::vector![0.0, 1.0, 0.0]);
    }

    #[test]
    fn poles_and_routh_agree_on_what_is_stable() {
        // A grid of all signs and three decades around the boundary l1 l2 = l3, which it never hits.
        let values = [-3.0, -0.3, 0.31, 2.9, 33.0];
        let (mut stable, mut unstable) = (0, 0);
        for l1 in values {
            for l2 in values {
                for l3 in values {
                    let all = [
                        ObserverGains::<3>::as_printed([l1]),
                        ObserverGains::as_printed([l1, l2]),
                        ObserverGains::as_printed([l1, l2, l3]),
                    ];
                    for gains in all {
                        let poles = error_poles(&gains);
                        assert_eq!(poles.len(), gains.order);
                        assert_eq!(poles.iter().all(|p| p.re < 0.0), gains.is_hurwitz(), "{gains:?} {poles:?}");
                        if gains.is_hurwitz() { stable += 1 } else { unstable += 1 }
                    }
                }
            }
        }
        assert!(stable > 50 && unstable > 50, "the grid must ask both questions: {stable} {unstable}");
    }

    #[test]
    fn the_fastest_pole_is_the_one_the_design_checks_against_the_period() {
        for gains in [
            ObserverGains::<3>::as_printed([100.0, 20.0]),
            ObserverGains::as_printed([1000.0, 300.0, 30.0]),
            ObserverGains::as_printed([0.5, 100.0]),
        ] {
            let fastest = magnitude(error_poles(&gains)[0]);
            // 1e-11: the bisection of `fastest_rad_s` stops at 1e-12.
            assert!((gains.fastest_rad_s() / fastest - 1.0).abs() < 1e-11, "{gains:?}");
        }
    }

    #[test]
    fn gains_without_meaning_have_no_poles() {
        let bad =
            [ObserverGains::<3>::as_printed([f64::NAN, 1.0]), ObserverGains::as_printed([f64::INFINITY, 1.0, 1.0])];
        assert!(bad.iter().all(|gains| error_poles(gains).is_empty()));
        // Zero, tiny and huge gains must return, with any result.
        let hard: Vec<_> = [[0.0; 3], [1e-300; 3], [1e100; 3], [1e300, 1.0, 1e-300], [f64::MAX; 3]]
            .into_iter()
            .map(|l| error_poles(&ObserverGains::<3>::as_printed(l)).len())
            .collect();
        assert_eq!(hard, [3; 5]);
    }
}
