//! Drives for the suite: recorded counts fed to a law, tick by tick.

use controller_core::drive::{Aim, ChainModel, EncoderForm, Sample, Speed, Target};
use controller_core::{Output, Real, Running, Sealed};

/// A scalar whose counts are plain numbers: `f32` and `f64`.
pub trait Plain: Real + Sealed<Count = i32> {}
impl<T: Real + Sealed<Count = i32>> Plain for T {}

/// What is told of a jet (r, r', ..) for an instant.
pub trait Told<T: Plain, const N: usize>: Aim<T, N> {
    /// The target at this jet.
    fn target(jet: [f64; N]) -> Self::Target;
}

impl<T: Plain, const N: usize> Told<T, N> for controller_core::drive::Position {
    /// The angle within a turn of 0, as whoever plans in f64 splits it.
    fn target(jet: [f64; N]) -> Target<T, i32, N> {
        let turn = (jet[0] / std::f64::consts::TAU).round();
        let mut jet = jet;
        jet[0] -= turn * std::f64::consts::TAU;
        Target { turn: turn as i32, jet: jet.map(T::from_f64) }
    }
}

impl<T: Plain> Told<T, 2> for Speed {
    fn target(jet: [f64; 2]) -> T {
        T::from_f64(jet[1])
    }
}

/// One row of a record.
#[derive(Clone, Copy, Debug)]
pub struct Row<const E: usize, const N: usize> {
    /// Counts, where they were there.
    pub counts: [Option<i32>; E],
    /// What the oracle asked for.
    pub u_demand: f64,
    /// What was held.
    pub u_applied: f64,
    /// The oracle's σ*.
    pub sigma_star: f64,
    /// r, r', .. at the beginning of the tick in which u is held.
    pub jet: [f64; N],
}

/// Feeds a record to a law without limits; the largest differences of u and σ* from it.
pub fn replay<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    law: &EncoderForm<T, M, A, E, N, S, FAST, LATE>,
    rows: &[Row<E, N>],
    mut before: impl FnMut(usize, &mut Running<EncoderForm<T, M, A, E, N, S, FAST, LATE>>, &Sample<i32, A::Target, E>),
) -> [f64; 2]
where
    T: Plain,
    M: ChainModel<T, E, N>,
    A: Told<T, N>,
    EncoderForm<T, M, A, E, N, S, FAST, LATE>: Copy,
{
    let mut running = Running::new(*law);
    let mut worst = [0.0_f64; 2];
    for (k, pair) in rows.windows(2).enumerate() {
        let sample = Sample { counts: pair[0].counts, begin: A::target(pair[0].jet), end: A::target(pair[1].jet) };
        before(k, &mut running, &sample);
        let Output { u, sigma_star, .. } = running.tick(&sample);
        running.report_applied(T::from_f64(pair[0].u_applied));
        let off = [u.to_f64() - pair[0].u_demand, sigma_star.to_f64() - pair[0].sigma_star];
        for (worst, off) in worst.iter_mut().zip(off) {
            *worst = worst.max(off.abs());
        }
    }
    worst
}
