//! Extended disturbance observer of one channel.
//!
//! The observer estimates the lumped disturbance of its channel and r - 1 derivatives of it. In continuous time (Eq.
//! (3)-(6) for r = 2, Eq. (45)-(50) in general) channel $i$ has
//!
//! $$ \hat d_i^{(j-1)} = p_{ij} + l_{ij} x_i, \qquad
//!    \dot p_{ij} = -l_{ij}(x_{i+1} + \hat d_i) + \hat d_i^{(j)}, \quad \hat d_i^{(r)} := 0 $$
//!
//! (for $i = n$ read $a(x) + b(x)u$ for $x_{i+1}$). The error obeys Eq. (53), whose characteristic polynomial is
//! $s^r + l_{i1} s^{r-1} + \dots + l_{ir}$. So the poles of the error determine the gains.
//!
//! # The discrete observer
//! Per tick the state is a Taylor polynomial of the disturbance in units of one tick, folded into
//!
//! * $A$: the mean of $\hat d$ over the *coming* tick, which acts on the sampled plant,
//! * $B$: the growth of $A$ per tick, $C$: the growth of $B$ per tick.
//!
//! The innovation $e$ is the measured motion of $x_i$ minus the motion predicted from the model and $A$. Then
//!
//! $$ A \mathrel{+}= B + \gamma_1 e, \qquad B \mathrel{+}= C + \gamma_2 e, \qquad C \mathrel{+}= \gamma_3 e $$
//!
//! (old $B$, $C$ on the right). With $\gamma$ the coefficients of $\det(wI - (e^{DT} - I))$ the discrete error has its
//! poles exactly at $e^{\text{pole}\cdot T}$. A long period cannot make the observer unstable, as it does with forward
//! Euler. The observer is of second order in T. A disturbance that is a polynomial of degree < r leaves no steady
//! error.
//!
//! # Deviation
//! The printed $p$-form subtracts two large numbers, $p$ and $l x$. In `f32` at an offset of 100 rad, poles at -50, its
//! estimate is off by 4e-3. The form of this crate takes differences of measurements first and is off by 3e-7 (test
//! `precision::difference_form_keeps_at_100_rad_what_the_p_form_loses`). The estimates start at $\hat d(0) = 0$. A
//! start with $p(0) = 0$ would set them to $l \thinspace x(0)$.

use crate::MAX_R;
use crate::config::resized;
use crate::error::Cause;
use crate::exponential::channel_gammas;
use crate::polynomial::{TERMS, is_hurwitz, spectral_radius};
use crate::real::Real;

/// Pole of the error dynamics in rad/s. Stable poles have `re < 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pole {
    /// Real part, rad/s.
    pub re: f64,
    /// Imaginary part, rad/s.
    pub im: f64,
}

impl Pole {
    /// Returns a pole on the real axis.
    pub(crate) const fn real(re: f64) -> Self {
        Self { re, im: 0.0 }
    }
}

/// Gains l_i1 .. l_ir of one channel, l_ij in s⁻ʲ. The order r is at most the capacity `R`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ObserverGains<const R: usize> {
    /// Observer order, 1..=R.
    pub(crate) order: usize,
    /// Gains l_1 .. l_r. Further entries are not read.
    pub(crate) l: [f64; R],
}

impl<const R: usize> ObserverGains<R> {
    /// Returns the first `order` of these gains, for an order that is known only at run time.
    ///
    /// # Errors
    /// [`Cause::ObserverOrder`] if the order is not 1..=R.
    ///
    /// ```
    /// use controller_core::{Cause, ObserverGains};
    /// let gains = ObserverGains::<2>::new(1, [50.0, 0.0]).expect("one of two");
    /// assert_eq!((gains.order(), gains.l()), (1, &[50.0][..]));
    /// assert_eq!(ObserverGains::<2>::new(9, [50.0, 1.0]), Err(Cause::ObserverOrder { order: 9, capacity: 2 }));
    /// ```
    pub const fn new(order: usize, l: [f64; R]) -> Result<Self, Cause> {
        const { assert!(R >= 1 && R <= MAX_R, "the observer capacity R must be 1..=3") };
        if order == 0 || order > R {
            return Err(Cause::ObserverOrder { order, capacity: R });
        }
        Ok(Self { order, l })
    }

    /// Returns the order r of this channel's observer, 1..=R.
    pub const fn order(&self) -> usize {
        self.order
    }

    /// Returns the gains l_1 .. l_r.
    pub const fn l(&self) -> &[f64] {
        self.l.split_at(self.degree()).0
    }

    /// Returns the gains as a paper prints them, for any order up to R.
    ///
    /// Their poles may differ from the printed ones. The gains (100, 20) of Example 2, "poles at -10", have poles at
    /// -99.8 and -0.2. See `error_dynamics::error_poles`.
    pub const fn as_printed<const ORDER: usize>(l: [f64; ORDER]) -> Self {
        const { assert!(ORDER >= 1 && ORDER <= R && R <= MAX_R, "an observer's order must be 1..=R, and R 1..=3") };
        let mut gains = [0.0; R];
        let mut j = 0;
        while j < ORDER {
            gains[j] = l[j];
            j += 1;
        }
        Self { order: ORDER, l: gains }
    }

    /// Computes gains as [`try_from_poles`](Self::try_from_poles), in a `const`: unpaired complex poles are a compile
    /// error.
    ///
    /// # Panics
    /// If complex poles do not come in conjugate pairs, or a pole is not finite. Outside a `const` use
    /// [`try_from_poles`](Self::try_from_poles).
    ///
    /// ```
    /// use controller_core::{ObserverGains, Pole};
    /// // s² + 20 s + 125
    /// const PAIR: [Pole; 2] = [Pole { re: -10.0, im: 5.0 }, Pole { re: -10.0, im: -5.0 }];
    /// const GAINS: ObserverGains<2> = ObserverGains::from_poles(PAIR);
    /// assert_eq!(GAINS.l(), [20.0, 125.0]);
    /// ```
    pub const fn from_poles<const ORDER: usize>(poles: [Pole; ORDER]) -> Self {
        match Self::try_from_poles(poles) {
            Ok(gains) => gains,
            Err(_) => panic!("poles must be finite, and complex ones come in conjugate pairs (Eq. (53))"),
        }
    }

    /// Returns the gains that give the error these poles.
    ///
    /// # Errors
    /// [`Cause::ObserverNotFinite`] if complex poles do not come in conjugate pairs, or a pole or a gain is not finite.
    pub const fn try_from_poles<const ORDER: usize>(poles: [Pole; ORDER]) -> Result<Self, Cause> {
        let (gains, paired) = Self::multiplied(poles);
        if paired && gains.is_finite() { Ok(gains) } else { Err(Cause::ObserverNotFinite) }
    }

    /// Returns (s - p_1)(s - p_2).., and true if its imaginary part vanishes.
    const fn multiplied<const ORDER: usize>(poles: [Pole; ORDER]) -> (Self, bool) {
        const { assert!(ORDER >= 1 && ORDER <= R && R <= MAX_R, "an observer's order must be 1..=R, and R 1..=3") };
        // re[k], im[k] belong to s^(order - k).
        let mut re = [0.0; TERMS];
        let mut im = [0.0; TERMS];
        re[0] = 1.0;
        let mut largest = 0.0;
        let mut q = 0;
        while q < ORDER {
            let pole = poles[q];
            if pole.im.abs() > largest {
                largest = pole.im.abs();
            }
            let mut k = q + 1;
            while k > 0 {
                let (r, i) = (re[k - 1], im[k - 1]);
                re[k] -= pole.re * r - pole.im * i;
                im[k] -= pole.re * i + pole.im * r;
                k -= 1;
            }
            q += 1;
        }
        let mut l = [0.0; R];
        let mut paired = true;
        let mut j = 0;
        while j < ORDER {
            // A pair cancels exactly up to rounding. An unpaired pole leaves an imaginary part of its own size.
            paired = paired && im[j + 1].abs() <= 1e-9 * (re[j + 1].abs() + largest);
            l[j] = re[j + 1];
            j += 1;
        }
        (Self { order: ORDER, l }, paired)
    }

    /// Returns the gains with all `ORDER` poles at -ω, rad/s.
    ///
    /// The error settles within about 3/ω (r = 1), 5/ω (r = 2), 7/ω (r = 3). The design rejects an ω that is not
    /// finite.
    pub const fn from_bandwidth<const ORDER: usize>(omega_rad_s: f64) -> Self {
        Self::multiplied([Pole::real(-omega_rad_s); ORDER]).0
    }

    /// Returns the gains in another capacity.
    pub(crate) const fn resized<const TO: usize>(&self) -> ObserverGains<TO> {
        ObserverGains { order: if self.order < TO { self.order } else { TO }, l: resized(&self.l) }
    }

    /// Returns the order, bounded so that the compiler needs no check that could panic.
    const fn degree(&self) -> usize {
        const { assert!(R >= 1 && R <= MAX_R, "the observer capacity R must be 1..=3") };
        if self.order < R { self.order } else { R }
    }

    const fn polynomial(&self) -> ([f64; TERMS], usize) {
        let mut a = [0.0; TERMS];
        a[0] = 1.0;
        let mut j = 0;
        while j < self.degree() {
            a[j + 1] = self.l[j];
            j += 1;
        }
        (a, self.degree())
    }

    pub(crate) const fn is_finite(&self) -> bool {
        let mut j = 0;
        while j < self.degree() {
            if !self.l[j].is_finite() {
                return false;
            }
            j += 1;
        }
        true
    }

    /// Returns true if D of Eq. (53) is Hurwitz.
    ///
    /// # Deviation
    /// The paper requires positive gains, which suffices only for r = 2. For r = 3, l1 l2 > l3 is needed too.
    pub(crate) const fn is_hurwitz(&self) -> bool {
        let (a, degree) = self.polynomial();
        is_hurwitz(a, degree)
    }

    /// Returns the magnitude of the fastest pole, rad/s.
    pub(crate) const fn fastest_rad_s(&self) -> f64 {
        let (a, degree) = self.polynomial();
        spectral_radius(a, degree)
    }

    /// Returns the discrete gains γ_1..γ_r for a period, with zeros beyond the order.
    pub(crate) const fn gammas(&self, period_s: f64) -> [f64; R] {
        let mut l = [0.0; 3];
        let mut j = 0;
        while j < self.degree() {
            l[j] = self.l[j];
            j += 1;
        }
        let gamma = channel_gammas(l, self.degree(), period_s);
        let mut out = [0.0; R];
        let mut j = 0;
        while j < self.degree() {
            out[j] = gamma[j];
            j += 1;
        }
        out
    }
}

/// Advances one channel by one tick: A += B + γ1 e, B += C + γ2 e, C += γ3 e. For R < 3 the absent entries do not
/// exist.
#[inline(always)]
pub(crate) fn advance<T: Real, const R: usize>(z: [T; R], gamma: &[T; R], e: T) -> [T; R] {
    let mut next = z;
    for m in 0..R {
        let growth = gamma[m] * e;
        next[m] += if m + 1 < R { z[m + 1] + growth } else { growth };
    }
    next
}

/// Advances one channel by one tick without a sample: A += B, B += C.
#[inline(always)]
pub(crate) fn coasted<T: Real, const R: usize>(z: [T; R]) -> [T; R] {
    let mut next = z;
    for m in 1..R {
        next[m - 1] += z[m];
    }
    next
}

/// Returns the state from which [`coasted`] computes z.
pub(crate) fn rewound<T: Real, const R: usize>(z: [T; R]) -> [T; R] {
    let mut before = z;
    for m in (1..R).rev() {
        before[m - 1] -= before[m];
    }
    before
}
