//! Stability tests for the polynomials of a design, in `const fn` and without computing roots.
//!
//! A design rests on two polynomials: the error dynamics $s^r + l_1 s^{r-1} + \dots + l_r$ (Eq. (53)) and the surface
//! $p^{n-1} + c_{n-1} p^{n-2} + \dots + c_1$ (Eq. (44)). Both must be Hurwitz, and their fastest root must be slow
//! compared with the period. Routh's scheme decides the first condition. The Schur-Cohn test inside a bisection decides
//! the second. Neither needs a square root, so an invalid design can be a compile error.
//!
//! A polynomial is `[1, a_1, .., a_d]`, highest power first. A degree that does not fit counts as unstable. The code
//! checks the degree first, so that no index needs a check that could panic.

/// Length of the longest polynomial: the surface of a plant of order 6 has degree 5.
pub(crate) const TERMS: usize = 6;

/// Returns true if all roots lie in the open left half plane (Routh). For r = 3: `l1, l3 > 0` and `l1 l2 > l3`.
pub(crate) const fn is_hurwitz(mut a: [f64; TERMS], degree: usize) -> bool {
    if degree >= TERMS {
        return false;
    }
    let mut k = 0;
    while k < degree {
        if a[k + 1].is_nan() || a[k + 1] <= 0.0 {
            return false;
        }
        let ratio = a[k] / a[k + 1];
        let mut i = k + 2;
        while i <= degree {
            let next = if i < degree { a[i + 1] } else { 0.0 };
            a[i] -= ratio * next;
            i += 2;
        }
        k += 1;
    }
    true
}

/// Returns true if all roots lie inside |s| < radius (Schur-Cohn).
const fn roots_inside(mut a: [f64; TERMS], degree: usize, radius: f64) -> bool {
    if degree >= TERMS {
        return false;
    }
    let mut scale = 1.0;
    let mut i = 1;
    while i <= degree {
        scale *= radius;
        a[i] /= scale;
        i += 1;
    }
    let mut d = degree;
    while d > 0 {
        let reflection = a[d];
        if reflection.is_nan() || reflection.abs() >= 1.0 {
            return false;
        }
        // Reduces the degree by one and makes the leading coefficient 1 again.
        let lead = 1.0 - reflection * reflection;
        let old = a;
        let mut i = 1;
        while i < d {
            a[i] = (old[i] - reflection * old[d - i]) / lead;
            i += 1;
        }
        d -= 1;
    }
    true
}

/// Returns the largest |root| by bisection, to 1e-11 relative.
///
/// Coinciding roots are ill-conditioned. The result is then too large by up to 4e-6 (double), 1.3e-4 (triple), 2.4e-3
/// (fivefold root). The coefficients must be finite.
pub(crate) const fn spectral_radius(a: [f64; TERMS], degree: usize) -> f64 {
    let mut high = 1.0;
    while !roots_inside(a, degree, high) && high < 1e300 {
        high *= 2.0;
    }
    while high > 1e-300 && roots_inside(a, degree, high / 2.0) {
        high /= 2.0;
    }
    let mut low = high / 2.0;
    let mut steps = 0;
    while steps < 40 {
        let middle = f64::midpoint(low, high);
        if roots_inside(a, degree, middle) {
            high = middle;
        } else {
            low = middle;
        }
        steps += 1;
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn routh_refuses_a_cubic_whose_coefficients_are_all_positive_but_whose_product_is_too_small() {
        assert!(is_hurwitz([1.0, 2.0, 3.0, 5.0, 0.0, 0.0], 3));
        assert!(!is_hurwitz([1.0, 2.0, 3.0, 7.0, 0.0, 0.0], 3));
        assert!(!is_hurwitz([1.0, f64::NAN, 3.0, 7.0, 0.0, 0.0], 3));
    }

    #[test]
    fn routh_accepts_the_paper_s_surface_and_refuses_a_sign_change() {
        assert!(is_hurwitz([1.0, 15.0, 75.0, 125.0, 0.0, 0.0], 3));
        assert!(!is_hurwitz([1.0, 15.0, 75.0, -125.0, 0.0, 0.0], 3));
        // This is (p + 1)^5.
        assert!(is_hurwitz([1.0, 5.0, 10.0, 10.0, 5.0, 1.0], 5));
    }

    #[test]
    fn spectral_radius_finds_known_roots() {
        // These are (s + 3)(s + 40) and the printed gains (100, 20), whose poles are -50 +- sqrt(2480).
        let two = spectral_radius([1.0, 43.0, 120.0, 0.0, 0.0, 0.0], 2);
        assert!((two / 40.0 - 1.0).abs() < 1e-11, "{two}");
        let printed = spectral_radius([1.0, 100.0, 20.0, 0.0, 0.0, 0.0], 2);
        assert!((printed / (50.0 + 2480.0_f64.sqrt()) - 1.0).abs() < 1e-11, "{printed}");
        // All five roots at -1 are the worst case of the documentation.
        let fivefold = spectral_radius([1.0, 5.0, 10.0, 10.0, 5.0, 1.0], 5);
        assert!((1.0..1.003).contains(&fivefold), "{fivefold}");
        // A complex pair: s^2 + 2 s + 100 has |s| = 10.
        let pair = spectral_radius([1.0, 2.0, 100.0, 0.0, 0.0, 0.0], 2);
        assert!((pair / 10.0 - 1.0).abs() < 1e-11, "{pair}");
    }
}
