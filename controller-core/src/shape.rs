//! Controller configuration (order, capacity, observed channels) as types and as numbers.
//!
//! The configuration of a controller is its plant order n, the capacity r for observer orders, and the observed
//! channels. [`controller!`](macro@crate::controller) builds the controller type from these numbers.
//! [`shapes!`](crate::shapes) is the single list of all configurations. A target, a host and the static library for C
//! instantiate their controllers from it.

use crate::{MAX_N, MAX_R};

/// Expands to a controller type: precision, nominal model, plant order, observers.
///
/// ```
/// use controller_core::*;
/// type Joint = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);
/// type Motor = controller!(f64, Linear<f64, 2>, order 2, no observers);
/// ```
///
/// An invalid configuration is a compile error with this line and its numbers, as soon as the type is used:
/// ```compile_fail
/// # use controller_core::*;
/// type Joint = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 5]);
/// # let _ = |joint: &Joint| joint.coefficients().numbers().count();
/// ```
#[macro_export]
macro_rules! controller {
    ($t:ty, $model:ty, order $n:literal, observers of order $r:literal in [$($channel:literal),+ $(,)?] $(,)?) => {
        $crate::Controller<
            $t,
            $model,
            $n,
            $r,
            { $crate::channels::<{ <[usize]>::len(&[$($channel),+]) }>($n, $r, [$($channel),+]) },
            { <[usize]>::len(&[$($channel),+]) },
        >
    };
    ($t:ty, $model:ty, order $n:literal, no observers $(,)?) => {
        $crate::Controller<$t, $model, $n, 1, { $crate::channels($n, 1, []) }, 0>
    };
}

/// Returns the `MASK` of a [`Controller`](crate::Controller) of plant order n with observers of order r.
///
/// `numbers` lists the observed channels, from 1.
///
/// # Panics
/// As part of a type, a panic is a compile error. The function panics on:
/// * an order out of range,
/// * a channel that the plant does not have,
/// * a channel that is listed twice,
/// * a channel that Eq. (44) does not allow with this order.
///
/// ```
/// assert_eq!(controller_core::channels(4, 2, [2, 4]), 0b1010);
/// ```
pub const fn channels<const O: usize>(n: usize, r: usize, numbers: [usize; O]) -> u8 {
    use crate::error::Text;
    if n < 2 || n > MAX_N {
        let text = Text::new().string("plant order ").number(n).string(": it must be 2..=6");
        panic!("{}", text.as_str());
    }
    if r < 1 || r > MAX_R {
        let text = Text::new().string("observer order ").number(r).string(": it must be 1..=3");
        panic!("{}", text.as_str());
    }
    let mut mask = 0;
    let mut k = 0;
    while k < O {
        let i = numbers[k];
        let text = Text::new().string("observer in channel ").number(i);
        if i < 1 || i > n {
            let text = text.string(": a plant of order ").number(n).string(" has channels 1..=").number(n);
            panic!("{}", text.as_str());
        }
        if i + r < n {
            let text = text.string(" of a plant of order ").number(n).string(": Eq. (44) needs observer order ");
            let text = text.number(n - i).string(" there, this is ").number(r);
            panic!("{}", text.as_str());
        }
        assert!(mask >> (i - 1) & 1 == 0, "{}", text.string(": named twice").as_str());
        mask |= 1 << (i - 1);
        k += 1;
    }
    mask
}

/// Passes all configurations that Eq. (44) allows to a macro of the caller, as `name: n r mask o,`.
///
/// Code that must cover many configurations expands this single list.
///
/// | set | what is in it | shapes |
/// |---|---|---|
/// | `all` | n = 2..6 | 116 |
/// | `wire` | n = 2..4: what a target carries | 60 |
/// | `planar` | n = 2 | 12 |
/// | `archive` | what firmware in C links: the driven channel observed, an order r that n needs | 20 |
///
/// ```
/// macro_rules! count {
///     ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => { [$(stringify!($name)),*].len() };
/// }
/// assert_eq!(controller_core::shapes!(all => count), 116);
/// ```
#[macro_export]
#[rustfmt::skip]
macro_rules! shapes {
    (archive => $callback:ident) => { $crate::shapes! { @ $callback [@planar_archive @archive] } };
    (planar => $callback:ident) => { $crate::shapes! { @ $callback [@planar_archive @planar] } };
    (wire => $callback:ident) => { $crate::shapes! { @ $callback [@planar_archive @archive @planar @wire] } };
    (all => $callback:ident) => { $crate::shapes! { @ $callback [@planar_archive @archive @planar @wire @long] } };
    ($other:ident => $callback:ident) => {
        ::core::compile_error!("shapes! has the sets all, wire, planar and archive")
    };
    (@ $callback:ident [] $($shape:tt)*) => { $callback! { $($shape)* } };
    (@ $callback:ident [@planar_archive $($rest:tt)*] $($shape:tt)*) => {
        $crate::shapes! { @ $callback [$($rest)*] $($shape)*
            n2_r1_c2: 2 1 0b10 1, n2_r1_c12: 2 1 0b11 2,
            n2_r2_c2: 2 2 0b10 1, n2_r2_c12: 2 2 0b11 2,
        }
    };
    (@ $callback:ident [@archive $($rest:tt)*] $($shape:tt)*) => {
        $crate::shapes! { @ $callback [$($rest)*] $($shape)*
            n3_r2_c3: 3 2 0b100 1, n3_r2_c13: 3 2 0b101 2, n3_r2_c23: 3 2 0b110 2, n3_r2_c123: 3 2 0b111 3,
            n4_r2_c4: 4 2 0b1000 1, n4_r2_c24: 4 2 0b1010 2, n4_r2_c34: 4 2 0b1100 2, n4_r2_c234: 4 2 0b1110 3,
            n4_r3_c4: 4 3 0b1000 1, n4_r3_c14: 4 3 0b1001 2, n4_r3_c24: 4 3 0b1010 2, n4_r3_c124: 4 3 0b1011 3,
            n4_r3_c34: 4 3 0b1100 2, n4_r3_c134: 4 3 0b1101 3, n4_r3_c234: 4 3 0b1110 3,
            n4_r3_c1234: 4 3 0b1111 4,
        }
    };
    (@ $callback:ident [@planar $($rest:tt)*] $($shape:tt)*) => {
        $crate::shapes! { @ $callback [$($rest)*] $($shape)*
            n2_r1_c: 2 1 0b00 0, n2_r1_c1: 2 1 0b01 1,
            n2_r2_c: 2 2 0b00 0, n2_r2_c1: 2 2 0b01 1,
            n2_r3_c: 2 3 0b00 0, n2_r3_c1: 2 3 0b01 1, n2_r3_c2: 2 3 0b10 1, n2_r3_c12: 2 3 0b11 2,
        }
    };
    (@ $callback:ident [@wire $($rest:tt)*] $($shape:tt)*) => {
        $crate::shapes! { @ $callback [$($rest)*] $($shape)*
            n3_r1_c: 3 1 0b000 0, n3_r1_c2: 3 1 0b010 1, n3_r1_c3: 3 1 0b100 1, n3_r1_c23: 3 1 0b110 2,
            n3_r2_c: 3 2 0b000 0, n3_r2_c1: 3 2 0b001 1, n3_r2_c2: 3 2 0b010 1, n3_r2_c12: 3 2 0b011 2,
            n3_r3_c: 3 3 0b000 0, n3_r3_c1: 3 3 0b001 1, n3_r3_c2: 3 3 0b010 1, n3_r3_c12: 3 3 0b011 2,
            n3_r3_c3: 3 3 0b100 1, n3_r3_c13: 3 3 0b101 2, n3_r3_c23: 3 3 0b110 2, n3_r3_c123: 3 3 0b111 3,
            n4_r1_c: 4 1 0b0000 0, n4_r1_c3: 4 1 0b0100 1, n4_r1_c4: 4 1 0b1000 1, n4_r1_c34: 4 1 0b1100 2,
            n4_r2_c: 4 2 0b0000 0, n4_r2_c2: 4 2 0b0010 1, n4_r2_c3: 4 2 0b0100 1, n4_r2_c23: 4 2 0b0110 2,
            n4_r3_c: 4 3 0b0000 0, n4_r3_c1: 4 3 0b0001 1, n4_r3_c2: 4 3 0b0010 1, n4_r3_c12: 4 3 0b0011 2,
            n4_r3_c3: 4 3 0b0100 1, n4_r3_c13: 4 3 0b0101 2, n4_r3_c23: 4 3 0b0110 2, n4_r3_c123: 4 3 0b0111 3,
        }
    };
    (@ $callback:ident [@long $($rest:tt)*] $($shape:tt)*) => {
        $crate::shapes! { @ $callback [$($rest)*] $($shape)*
            n5_r1_c: 5 1 0b00000 0, n5_r1_c4: 5 1 0b01000 1, n5_r1_c5: 5 1 0b10000 1, n5_r1_c45: 5 1 0b11000 2,
            n5_r2_c: 5 2 0b00000 0, n5_r2_c3: 5 2 0b00100 1, n5_r2_c4: 5 2 0b01000 1, n5_r2_c34: 5 2 0b01100 2,
            n5_r2_c5: 5 2 0b10000 1, n5_r2_c35: 5 2 0b10100 2, n5_r2_c45: 5 2 0b11000 2,
            n5_r2_c345: 5 2 0b11100 3,
            n5_r3_c: 5 3 0b00000 0, n5_r3_c2: 5 3 0b00010 1, n5_r3_c3: 5 3 0b00100 1, n5_r3_c23: 5 3 0b00110 2,
            n5_r3_c4: 5 3 0b01000 1, n5_r3_c24: 5 3 0b01010 2, n5_r3_c34: 5 3 0b01100 2,
            n5_r3_c234: 5 3 0b01110 3, n5_r3_c5: 5 3 0b10000 1, n5_r3_c25: 5 3 0b10010 2,
            n5_r3_c35: 5 3 0b10100 2, n5_r3_c235: 5 3 0b10110 3, n5_r3_c45: 5 3 0b11000 2,
            n5_r3_c245: 5 3 0b11010 3, n5_r3_c345: 5 3 0b11100 3, n5_r3_c2345: 5 3 0b11110 4,
            n6_r1_c: 6 1 0b000000 0, n6_r1_c5: 6 1 0b010000 1, n6_r1_c6: 6 1 0b100000 1,
            n6_r1_c56: 6 1 0b110000 2,
            n6_r2_c: 6 2 0b000000 0, n6_r2_c4: 6 2 0b001000 1, n6_r2_c5: 6 2 0b010000 1,
            n6_r2_c45: 6 2 0b011000 2, n6_r2_c6: 6 2 0b100000 1, n6_r2_c46: 6 2 0b101000 2,
            n6_r2_c56: 6 2 0b110000 2, n6_r2_c456: 6 2 0b111000 3,
            n6_r3_c: 6 3 0b000000 0, n6_r3_c3: 6 3 0b000100 1, n6_r3_c4: 6 3 0b001000 1,
            n6_r3_c34: 6 3 0b001100 2, n6_r3_c5: 6 3 0b010000 1, n6_r3_c35: 6 3 0b010100 2,
            n6_r3_c45: 6 3 0b011000 2, n6_r3_c345: 6 3 0b011100 3, n6_r3_c6: 6 3 0b100000 1,
            n6_r3_c36: 6 3 0b100100 2, n6_r3_c46: 6 3 0b101000 2, n6_r3_c346: 6 3 0b101100 3,
            n6_r3_c56: 6 3 0b110000 2, n6_r3_c356: 6 3 0b110100 3, n6_r3_c456: 6 3 0b111000 3,
            n6_r3_c3456: 6 3 0b111100 4,
        }
    };
}
