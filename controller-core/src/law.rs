//! Control law: the input u from the sample, the disturbance estimates and σ*.
//!
//! Eq. (51) (Eq. (20) for n = 2), with the argument of sat written out:
//!
//! $$ u = -\frac{1}{b}\Big[ a + \hat d_n + \alpha\sigma(0)e^{-\alpha t} + \sum_{i<n} c_i (x_{i+1} + \hat d_i)
//!        + k_l\sigma^* + k_s \thinspace \mathrm{sat}(\sigma^*/\epsilon) \Big] $$
//!
//! The first four terms are the *equivalent control*. The rest is the *reaching law*, whose gains this module holds.
//! The actuator holds u over one tick, so u must cancel the motion of the chain *during* the tick. The discrete law
//! therefore weights the same terms with rows that the design computes once (module `design`).
//!
//! The switching term is the implicit (backward Euler) sign. This clamp causes no numerical chatter for any $k_s$,
//! $\epsilon$, $T$. The price is a softer law inside the boundary layer, by the factor
//! $(k_l + k_s/\epsilon)/(k_l + (1 - k_l T) k_s/(\epsilon + k_s T))$. The bound on $\sigma^*$ grows by the same factor
//! (test `random_chains_with_switching_stay_bounded_and_as_close_as_the_implicit_saturation_allows`).
//!
//! # Deviation
//! The paper prints sat σ* in Eq. (51) and defines it by ε. The argument is σ*/ε.

/// Gains of the reaching law, Eq. (20) and (51).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReachingLaw {
    /// Linear reaching gain k_l >= 0, 1/s. `k_l T` is clipped at 1 (deadbeat). Keep it <= 0.5 if b or the slope is
    /// uncertain.
    pub k_l: f64,
    /// Switching gain k_s >= 0, in units of σ per second. 0 removes the switching term.
    pub k_s: f64,
    /// Boundary layer ε >= 0, in units of σ. Not read if k_s = 0. The value 0 is the ideal sign, implicit in T.
    pub epsilon: f64,
}

/// Actuator limits: u is clamped to [min, max], in the plant's input unit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Smallest u that the tick returns.
    pub min: f64,
    /// Largest u that the tick returns.
    pub max: f64,
}

impl Limits {
    /// Limits of ±1e12, which no actuator reaches. They keep u finite in every case.
    pub const NONE: Self = Self::symmetric(1e12);

    /// Returns the limits |u| <= max.
    pub const fn symmetric(max: f64) -> Self {
        Self { min: -max, max }
    }

    /// Returns the largest |u| available in both directions, or 0 if u can act in one direction only.
    pub(crate) const fn weaker(&self) -> f64 {
        let least = if self.max < -self.min { self.max } else { -self.min };
        if least > 0.0 { least } else { 0.0 }
    }

    /// Returns the largest |u| within the limits.
    pub(crate) const fn stronger(&self) -> f64 {
        if self.max > -self.min { self.max } else { -self.min }
    }
}
