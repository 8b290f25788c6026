//! The control law.
//!
//! Eq. (51) (Eq. (20) for n = 2), with the argument of sat written out:
//!
//! $$ u = -\frac{1}{b}\Big[ a + \hat d_n + \alpha\sigma(0)e^{-\alpha t} + \sum_{i<n} c_i (x_{i+1} + \hat d_i)
//!        + k_l\sigma^* + k_s \thinspace \mathrm{sat}(\sigma^*/\epsilon) \Big] $$
//!
//! The first four terms are the *equivalent control*, the rest is the *reaching law* held here. Held over one tick, u
//! must cancel what the chain does *during* the tick, so the discrete law weighs the same terms with rows that are
//! computed once (module `design`), and the switching term is the implicit (backward Euler) sign: a clamp that makes no
//! numerical chatter for any $k_s$, $\epsilon$, $T$. The price is that inside the layer it is softer than the printed
//! one, by $(k_l + k_s/\epsilon)/(k_l + (1 - k_l T) k_s/(\epsilon + k_s T))$, and the bound on $\sigma^*$ larger by
//! that (test `random_chains_with_switching_stay_bounded_and_as_close_as_the_implicit_saturation_allows`).
//!
//! # Deviation
//! The paper prints sat σ* in Eq. (51) and defines it by ε; the argument is σ*/ε.

/// Gains of the reaching law, Eq. (20) and (51).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReachingLaw {
    /// Linear gain k_l >= 0, 1/s. `k_l T` is clipped at 1 (deadbeat); keep it <= 0.5 if b or the slope is uncertain.
    pub k_l: f64,
    /// Switching gain k_s >= 0, in units of σ per second. 0 leaves the switching term out.
    pub k_s: f64,
    /// Boundary layer ε >= 0, in units of σ. Not read if k_s = 0; 0 is the ideal sign, implicit in T.
    pub epsilon: f64,
}

/// What the actuator can do: u is clamped to [min, max], in the plant's input unit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Smallest u that goes out.
    pub min: f64,
    /// Largest u that goes out.
    pub max: f64,
}

impl Limits {
    /// No limit that any actuator would notice: +-1e12, so that u stays finite whatever happens.
    pub const NONE: Self = Self::symmetric(1e12);

    /// |u| <= max.
    pub const fn symmetric(max: f64) -> Self {
        Self { min: -max, max }
    }

    /// What u can do both ways; 0 where it can do something one way alone.
    pub(crate) const fn weaker(&self) -> f64 {
        let least = if self.max < -self.min { self.max } else { -self.min };
        if least > 0.0 { least } else { 0.0 }
    }

    /// The largest |u|.
    pub(crate) const fn stronger(&self) -> f64 {
        if self.max > -self.min { self.max } else { -self.min }
    }
}
