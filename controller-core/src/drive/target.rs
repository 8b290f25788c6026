//! Reference of a drive: trajectory points at an instant, and the control modes that use them.

use crate::real::{Count as _, Real};

/// Trajectory point: a position and its derivatives at an instant.
///
/// r = 2π `turn` + `jet[0]`, then r', r'', .. up to the order n - 1 of the chain, in rad and s. Keep the angle within a
/// revolution or two: the separate revolutions keep the digits of a drive that has moved far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Target<T, C, const N: usize> {
    /// Whole revolutions of the shaft (`i32`, may wrap).
    pub turn: C,
    /// Angle r within the revolution and its derivatives r', r'', .., in rad and s.
    pub jet: [T; N],
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Position {}
    impl Sealed for super::Speed {}
    impl Sealed for super::Hold {}
}

/// Control mode of a drive: [`Position`], [`Speed`] or [`Hold`].
pub trait Aim<T: Real, const N: usize>: sealed::Sealed + Copy + 'static {
    /// Reference for one instant.
    type Target: Copy + core::fmt::Debug;
    /// True if the drive holds a position. Otherwise w_c = 0, and e_1 is in no sum.
    const POSITION: bool;

    /// Returns the part of a trajectory point that this control mode uses.
    fn told(target: &Target<T, T::Count, N>) -> Self::Target;

    /// Returns the errors z - (r, r', ..), given the revolution of the base and 2π.
    fn errors(z: &[T; N], turn: T::Count, full: T, target: &Self::Target) -> [T; N];

    /// Returns the change Δ(r, r', ..) within a tick, or `None` without a reference.
    fn moved(begin: &Self::Target, end: &Self::Target, full: T) -> Option<[T; N]>;
}

/// Control mode that follows a position, with as many derivatives as the chain has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position;

/// Control mode that follows a speed: the reference is r' alone.
///
/// The position is not controlled, and the disturbance estimate replaces an integrator. For a shaft that must stay
/// synchronous, follow a [`Position`] that is the integral of the speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Speed;

/// Control mode that holds angle 0 of revolution 0, without a reference and without an instruction for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hold;

impl<T: Real, const N: usize> Aim<T, N> for Position {
    type Target = Target<T, T::Count, N>;
    const POSITION: bool = true;

    #[inline(always)]
    fn told(target: &Target<T, T::Count, N>) -> Self::Target {
        *target
    }

    #[inline(always)]
    fn errors(z: &[T; N], turn: T::Count, full: T, target: &Self::Target) -> [T; N] {
        let mut e = *z;
        e[0] -= full * T::from_count(target.turn.since(turn)) + target.jet[0];
        for j in 1..N {
            e[j] -= target.jet[j];
        }
        e
    }

    #[inline(always)]
    fn moved(begin: &Self::Target, end: &Self::Target, full: T) -> Option<[T; N]> {
        let mut moved = end.jet;
        for j in 0..N {
            moved[j] -= begin.jet[j];
        }
        if end.turn != begin.turn {
            // This branch is rare. Without the fence the compiler makes it a select and converts in every tick.
            core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
            moved[0] += full * T::from_count(end.turn.since(begin.turn));
        }
        Some(moved)
    }
}

impl<T: Real> Aim<T, 2> for Speed {
    type Target = T;
    const POSITION: bool = false;

    #[inline(always)]
    fn told(target: &Target<T, T::Count, 2>) -> T {
        target.jet[1]
    }

    #[inline(always)]
    fn errors(z: &[T; 2], _: T::Count, _: T, target: &T) -> [T; 2] {
        [T::ZERO, z[1] - *target]
    }

    #[inline(always)]
    fn moved(begin: &T, end: &T, _: T) -> Option<[T; 2]> {
        Some([T::ZERO, *end - *begin])
    }
}

impl<T: Real, const N: usize> Aim<T, N> for Hold {
    type Target = ();
    const POSITION: bool = true;

    #[inline(always)]
    fn told(_: &Target<T, T::Count, N>) {}

    #[inline(always)]
    fn errors(z: &[T; N], turn: T::Count, full: T, (): &()) -> [T; N] {
        let mut e = *z;
        e[0] += full * T::from_count(turn);
        e
    }

    #[inline(always)]
    fn moved((): &(), (): &(), _: T) -> Option<[T; N]> {
        None
    }
}
