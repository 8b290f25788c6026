//! The true plants. They are written apart from the nominal models of `controller-core` on purpose: what the controller
//! believes and what is true meet nowhere but in the loop.

/// A chain of integrators with disturbances, Eq. (39), as it really is.
pub trait Plant {
    /// n, 2..=6.
    fn order(&self) -> usize;

    /// dx/dt at time `t_s` in state `x` under the held input `u`; `x` and `dx` have length n.
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]);

    /// The true lumped disturbances d_1..d_n of Eq. (39): what `rhs` differs by from the *nominal* chain.
    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]);

    /// An upper estimate of the fastest rate of the dynamics around `x`, rad/s: the solver's step follows it.
    fn fastest_rad_s(&self, x: &[f64]) -> f64;

    /// Instants at which the right-hand side jumps, ascending: no solver step straddles one.
    fn jumps_s(&self) -> &[f64];
}
