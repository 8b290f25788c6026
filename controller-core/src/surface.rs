//! Sliding surface σ, and its version σ* that starts at zero.
//!
//! Eq. (44) (Eq. (18) for n = 2, Eq. (41)-(43) for n = 3), with $c_n = 1$:
//!
//! $$ \sigma = \sum_{i=1}^{n} c_i x_i + \sum_{i=1}^{n-1}\sum_{j=i}^{n-1} c_{j+1} \hat d_i^{(j-i)}, \qquad
//!    \sigma^* = \sigma - \sigma(0) e^{-\alpha t} \quad \text{(Eq. (17))} $$
//!
//! On $\sigma = 0$ the output obeys $y^{(n-1)} + c_{n-1} y^{(n-2)} + \dots + c_1 y = 0$. This holds for any mismatched
//! disturbance, to the accuracy of the estimates. The magnitude of its fastest root is the surface bandwidth, which is
//! the closed-loop position bandwidth.
//!
//! The offset makes $\sigma^*(0) = 0$ exactly, so a large $k_l$ costs no control at the start. The tick updates it as a
//! decrement, $W \mathrel{-}= (1 - e^{-\alpha T}) W$, which does not drift as a product does.
//!
//! A channel $i < n$ contributes derivatives up to order $n - 1 - i$. So Eq. (44) needs an observer of order
//! $r \ge n - i$ in every *observed* mismatched channel.

use crate::polynomial::{self, TERMS};
use crate::{MAX_N, assert_order};

/// Coefficients of the sliding surface, and the decay rate of its offset.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Surface<const N: usize> {
    /// Coefficients c_1 .. c_n of Eq. (44). Entry c_i is in s^-(n-i), and c_n = 1.
    pub c: [f64; N],
    /// Decay rate α of the offset, Eq. (17), 1/s.
    pub alpha_per_s: f64,
}

impl<const N: usize> Surface<N> {
    /// Returns the surface with all n - 1 roots of the sliding motion at -ω, rad/s.
    ///
    /// ```
    /// use controller_core::Surface;
    /// // Example 2 of the paper.
    /// assert_eq!(Surface::<4>::from_bandwidth(5.0, 1.0).c, [125.0, 75.0, 15.0, 1.0]);
    /// ```
    pub const fn from_bandwidth(omega_rad_s: f64, alpha_per_s: f64) -> Self {
        const { assert_order(N) };
        let mut c = [0.0; N];
        c[N - 1] = 1.0;
        // Multiplies by (p + ω) n - 1 times. Entry c[i] belongs to p^i.
        let mut done = 0;
        while done < N - 1 {
            let mut i = N - 1 - done - 1;
            // The product so far lies in c[i + 1..]. The multiplication shifts it down by one power.
            while i < N - 1 {
                c[i] += omega_rad_s * c[i + 1];
                i += 1;
            }
            done += 1;
        }
        Self { c, alpha_per_s }
    }
}

/// Returns the last of n coefficients, n <= 6, or NaN if n is out of range.
pub(crate) const fn lead(c: &[f64; MAX_N], n: usize) -> f64 {
    if n >= 1 && n <= MAX_N { c[n - 1] } else { f64::NAN }
}

/// Returns true if all roots of the sliding motion of n coefficients lie in the left half plane.
pub(crate) const fn is_hurwitz(c: &[f64; MAX_N], n: usize) -> bool {
    let (a, degree) = polynomial(c, n);
    polynomial::is_hurwitz(a, degree)
}

/// Returns the magnitude of the fastest root of the sliding motion, rad/s.
pub(crate) const fn bandwidth_rad_s(c: &[f64; MAX_N], n: usize) -> f64 {
    let (a, degree) = polynomial(c, n);
    polynomial::spectral_radius(a, degree)
}

const fn polynomial(c: &[f64; MAX_N], n: usize) -> ([f64; TERMS], usize) {
    let mut a = [0.0; TERMS];
    let mut i = 0;
    while i < TERMS && i < n && n <= MAX_N {
        a[i] = c[n - 1 - i];
        i += 1;
    }
    (a, n.saturating_sub(1))
}
