//! Right-hand sides of a motor and of a joint as arithmetic on coefficients.
//!
//! A plant alone and a batch (module `lanes`) call the same functions, so their results are bit-identical. Divisors are
//! stored as their inverses, computed once instead of in each evaluation. Elementary functions have no branches
//! ([`sine`](crate::sine), [`exponential`](crate::exponential)).

use super::motor::{Imperfections, Shaft};
use crate::exponential::{expm1_of_negative, tanh};

/// Coefficients by row. The motor has the shaft 1/J, K_t, B, 1/τ (0 without a lag), the waves c, n_c, r, n_r, and the
/// friction F_c, F_s - F_c, 1/ω_s, 1/ω_t. A joint adds link and spring 1/J_l, B_l, W, K, and the damping D of the
/// spring.
pub(crate) type Numbers<const G: usize> = [[f64; 4]; G];

/// Returns the coefficients of a motor.
pub(super) fn of_motor(shaft: &Shaft, imperfections: &Imperfections) -> Numbers<3> {
    let Shaft { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s } = *shaft;
    let Imperfections { cogging_n_m, cogging_per_turn, ripple, ripple_per_turn, lag_s, friction, .. } = *imperfections;
    let per_lag = if lag_s > 0.0 { 1.0 / lag_s } else { 0.0 };
    [
        [1.0 / inertia_kg_m2, torque_n_m_per_a, damping_n_m_s, per_lag],
        [cogging_n_m, cogging_per_turn, ripple, ripple_per_turn],
        friction.numbers(),
    ]
}

/// Returns F(ω) from its row.
#[inline(always)]
pub(crate) fn friction([coulomb, beyond, per_stribeck, per_smooth]: [f64; 4], speed: f64) -> f64 {
    let bell = speed * per_stribeck;
    let size = coulomb + beyond * (1.0 + expm1_of_negative(-(bell * bell)));
    size * tanh(speed * per_smooth)
}

/// Returns F(ω) of friction that holds, from its row, for a shaft that slides in this direction.
#[inline(always)]
pub(crate) fn sliding([coulomb, beyond, per_stribeck, _]: [f64; 4], sign: f64, speed: f64) -> f64 {
    let bell = speed * per_stribeck;
    (coulomb + beyond * (1.0 + expm1_of_negative(-(bell * bell)))) * sign
}

/// Returns c sin n_c θ and r sin n_r θ from their row.
#[inline(always)]
pub(crate) fn waves([c, n_c, r, n_r]: [f64; 4], angle: f64, sin: impl Fn(f64) -> f64) -> [f64; 2] {
    // An amplitude of 0 gives 0 at any angle.
    let wave = |size: f64, per_turn: f64| if size == 0.0 { 0.0 } else { size * sin(per_turn * angle) };
    [wave(c, n_c), wave(r, n_r)]
}

/// Returns the indices of angle and speed of the motor in a state of this order. The link comes first.
#[inline(always)]
pub(crate) const fn motor_at(order: usize) -> [usize; 2] {
    if order > 3 { [2, 3] } else { [0, 1] }
}

/// Computes dx/dt of a motor (order 2, with a lag 3) or a joint (4, with a lag 5). `sin_link` is the sine of the angle
/// of the link.
#[inline(always)]
pub(crate) fn rates<const N: usize, const G: usize>(
    numbers: &Numbers<G>,
    x: &[f64; N],
    u: f64,
    load: f64,
    friction: f64,
    [cogging, ripple]: [f64; 2],
    sin_link: f64,
) -> [f64; N] {
    let [per_inertia, torque_per_a, damping, per_lag] = numbers[0];
    let has_lag = N % 2 == 1;
    let current = if has_lag { x[N - 1] } else { u };
    let torque = torque_per_a * current * (1.0 + ripple) + cogging - friction;
    let mut dx = [0.0; N];
    if N > 3 {
        let [per_link, link_damping, weight, stiffness] = numbers[G - 2];
        let spring = stiffness * (x[2] - x[0]) + numbers[G - 1][0] * (x[3] - x[1]);
        dx[0] = x[1];
        dx[1] = (spring - link_damping * x[1] - weight * sin_link - load) * per_link;
        dx[2] = x[3];
        dx[3] = (torque - spring - damping * x[3]) * per_inertia;
    } else {
        dx[0] = x[1];
        dx[1] = (torque - damping * x[1] - load) * per_inertia;
    }
    if has_lag {
        dx[N - 1] = (u - current) * per_lag;
    }
    dx
}
