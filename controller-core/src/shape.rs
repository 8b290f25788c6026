//! The shape of a controller, as types and as numbers: plant order n, capacity r for observer orders, observed channels.
//!
//! [`controller!`](crate::controller) spells the type of a controller once. [`shapes!`](crate::shapes) is the one list
//! of all shapes for whoever must carry many: a target, a host, the archive for C.

use crate::{MAX_N, MAX_R};

/// The type of a controller: precision, nominal model, plant order, observers.
///
/// ```
/// use controller_core::*;
/// type Joint = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);
/// type Motor = controller!(f64, Linear<f64, 2>, order 2, no observers);
/// ```
///
/// A wrong shape is an error at this line, with its numbers:
/// ```compile_fail
/// # use controller_core::*;
/// type Joint = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 5]);
/// # let _ = |joint: &Joint| joint.coefficients().numbers().count();
/// ```
#[macro_export]
macro_rules! controller {
    ($t:ty, $model:ty, order $n:literal, observers of order $r:literal in [$($channel:literal),+ $(,)?]) => {
        $crate::Controller<
            $t,
            $model,
            $n,
            $r,
            { $crate::channels::<{ <[usize]>::len(&[$($channel),+]) }>($n, $r, [$($channel),+]) },
            { <[usize]>::len(&[$($channel),+]) },
        >
    };
    ($t:ty, $model:ty, order $n:literal, no observers) => {
        $crate::Controller<$t, $model, $n, 1, { $crate::channels($n, 1, []) }, 0>
    };
}

/// `MASK` of a [`Controller`](crate::Controller) of plant order n with observers of order r in these channels, from 1.
///
/// # Panics
/// In a type, where it belongs, that is a compile error: on an order that there is not, on a channel that the plant does
/// not have or that is named twice, and on one that Eq. (44) does not allow with this order.
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
