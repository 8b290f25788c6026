//! Where a drive should be: targets at an instant, and what the law makes of them.

use crate::real::{Count as _, Real};

/// A position and its derivatives at an instant: r = 2π `turn` + `jet[0]`, r', r'', .. up to the order n - 1 of the
/// chain, in rad and s. Give the angle within a turn or two: the turn keeps the digits of a drive that has gone far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Target<T, C, const N: usize> {
    /// Whole turns of the shaft (`i32`; it may wrap).
    pub turn: C,
    /// r, r', r'', ..
    pub jet: [T; N],
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Position {}
    impl Sealed for super::Speed {}
    impl Sealed for super::Hold {}
}

/// What a drive is told to do: [`Position`], [`Speed`] or [`Hold`].
pub trait Aim<T: Real, const N: usize>: sealed::Sealed + Copy + 'static {
    /// What it is told for one instant.
    type Target: Copy + core::fmt::Debug;
    /// Is the position to be held? If not, w_c = 0, and e_1 is in no sum.
    const POSITION: bool;

    /// What of a position and its derivatives it is told.
    fn told(target: &Target<T, T::Count, N>) -> Self::Target;

    /// z - (r, r', ..), with the turn of the base and 2π.
    fn errors(z: &[T; N], turn: T::Count, full: T, target: &Self::Target) -> [T; N];

    /// Δ(r, r', ..); `None` without a reference.
    fn moved(begin: &Self::Target, end: &Self::Target, full: T) -> Option<[T; N]>;
}

/// Follow a position, with as many derivatives as the chain has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position;

/// Follow a speed: the target is r' alone. The position is nobody's business, and the disturbance estimate takes the
/// place of an integrator. A shaft that must keep step follows a [`Position`] that is the integral of the speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Speed;

/// Hold angle 0 of turn 0: no reference, and no instruction for one.
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
            // Hardly ever. Without the fence the compiler makes a selection of it, and converts in every tick.
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
