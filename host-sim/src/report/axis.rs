//! Scale of one axis: range, positions and texts of its ticks.
//!
//! Ticks are multiples of 1, 2 or 5 times a power of ten, with the decimals that their distance needs. Very large and
//! very small ranges have one factor 10^(3k), written once at the axis. A logarithmic axis has ticks at 1, 2 and 5
//! times every power of ten; a long one has ticks at the powers only.

use study::number::significant;

/// Largest magnitude that can be drawn; larger values are gaps, as NaN is.
const LARGEST: f64 = 1e100;
/// Smallest range; a smaller one counts as a single value.
const SMALLEST: f64 = 1e-100;

/// Returns whether the value can be drawn.
pub(super) fn drawable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// Range and ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// Lower end of the axis.
    pub(super) lo: f64,
    /// Upper end, above `lo`.
    pub(super) hi: f64,
    /// Value and text of every tick.
    pub(super) ticks: Vec<(f64, String)>,
    /// Common factor of all tick texts, as `×10⁻³`; empty for 1.
    pub(super) factor: String,
    is_log: bool,
}

impl Axis {
    /// Returns an axis with about `count` ticks over `range`. Without a valid range it covers all drawable `values`,
    /// with `margin` of their span at both ends.
    pub(super) fn new(
        range: Option<(f64, f64)>,
        values: impl IntoIterator<Item = f64>,
        margin: f64,
        count: usize,
    ) -> Self {
        let asked = range.filter(|&(lo, hi)| drawable(lo) && drawable(hi) && lo < hi);
        let (lo, hi) = asked.unwrap_or_else(|| {
            let (lo, hi) = values
                .into_iter()
                .filter(|&value| drawable(value))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
            let space = (hi - lo) * margin;
            if lo <= hi { (lo - space, hi + space) } else { (0.0, 1.0) }
        });
        let (lo, hi) = widened(lo, hi);
        let largest = lo.abs().max(hi.abs());
        let exponent = if (1e-2..1e5).contains(&largest) { 0 } else { 3 * exponent_of(largest).div_euclid(3) };
        let unit = libm::pow(10.0, f64::from(exponent));
        Self { lo, hi, ticks: ticks(lo / unit, hi / unit, unit, count), factor: factor(exponent), is_log: false }
    }

    /// Returns a logarithmic axis over the values above 0, with a margin at both ends.
    pub(super) fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        Self::logarithmic_over(values, 1.0)
    }

    /// Returns a logarithmic axis that contains at least two of 1, 2, 5, 10, .., so that a single point also has a
    /// scale.
    pub(super) fn logarithmic_with_scale(values: impl IntoIterator<Item = f64>) -> Self {
        Self::logarithmic_over(values, 6.3)
    }

    fn logarithmic_over(values: impl IntoIterator<Item = f64>, least_ratio: f64) -> Self {
        let (lo, hi) = values
            .into_iter()
            .filter(|&value| drawable(value) && value > SMALLEST)
            .fold((f64::INFINITY, 0.0_f64), |(lo, hi), value| (lo.min(value), hi.max(value)));
        let (lo, hi) = if lo <= hi { (0.8 * lo, 1.25 * hi) } else { (0.1, 1.0) };
        let wider = libm::sqrt((least_ratio * lo / hi).max(1.0));
        let (lo, hi) = (lo / wider, hi * wider);
        let multiples: &[u32] = if hi / lo > 300.0 { &[1] } else { &[1, 2, 5] };
        let decades = exponent_of(lo)..=exponent_of(hi);
        let ticks = decades.flat_map(|decade| {
            let unit = libm::pow(10.0, f64::from(decade));
            let text = move |multiple: &u32| {
                let text = match (decade, multiple) {
                    (-3..=3, _) => significant(f64::from(*multiple) * unit, 1),
                    (_, 1) => factor(decade)[2..].to_owned(),
                    _ => format!("{multiple}·{}", &factor(decade)[2..]),
                };
                (f64::from(*multiple) * unit, text)
            };
            multiples.iter().map(text).collect::<Vec<_>>()
        });
        let ticks = ticks.filter(|(value, _)| (lo..=hi).contains(value)).collect();
        Self { lo, hi, ticks, factor: String::new(), is_log: true }
    }

    /// Returns the position of a value: 0 at the lower end, 1 at the upper end.
    pub(super) fn place(&self, value: f64) -> f64 {
        if self.is_log {
            libm::log(value.max(SMALLEST) / self.lo) / libm::log(self.hi / self.lo)
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }
}

/// Returns a range that is wide enough for distinct ends.
fn widened(lo: f64, hi: f64) -> (f64, f64) {
    let size = lo.abs().max(hi.abs());
    // A range below a billionth of its size is rounding noise, and its tick labels would not fit.
    if hi - lo > SMALLEST.max(1e-9 * size) {
        return (lo, hi);
    }
    let half = if size > SMALLEST { 0.1 * size } else { 1.0 };
    (lo - half, hi + half)
}

/// Returns the largest e with 10^e <= value.
fn exponent_of(value: f64) -> i32 {
    // The exponent of the printed number is exact; a logarithm may round to the next one.
    format!("{value:e}").split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

fn ticks(lo: f64, hi: f64, unit: f64, count: usize) -> Vec<(f64, String)> {
    // A third more ticks than requested is better than half of them.
    let wish = 0.75 * (hi - lo) / count.max(1) as f64;
    let exponent = exponent_of(wish);
    let decade = libm::pow(10.0, f64::from(exponent));
    // 9.99 rounds up to the next decade, the last entry of the list.
    let multiple = [1.0, 2.0, 5.0].into_iter().find(|m| m * decade >= wish).unwrap_or(10.0);
    let decimals = (if multiple == 10.0 { -exponent - 1 } else { -exponent }).max(0) as usize;
    let step = multiple * decade;
    // The tolerance keeps the last tick of a range that ends at a multiple of the step.
    let (first, last) = ((lo / step - 1e-9).ceil(), (hi / step + 1e-9).floor());
    (0..(last - first + 1.0).max(0.0) as u32)
        .map(|k| first + f64::from(k))
        .map(|k| (k * step * unit, format!("{:.decimals$}", k * step + 0.0).replace('-', "\u{2212}")))
        .collect()
}

fn factor(exponent: i32) -> String {
    if exponent == 0 {
        return String::new();
    }
    let superscript = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    };
    format!("×10{}", exponent.to_string().chars().map(superscript).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|(_, text)| text.as_str()).collect()
    }

    #[test]
    fn ticks_stand_at_round_numbers_with_no_more_digits_than_needed() {
        let time = Axis::new(None, [0.0, 20.0], 0.0, 10);
        assert_eq!(texts(&time), ["0", "2", "4", "6", "8", "10", "12", "14", "16", "18", "20"]);
        let bound = Axis::new(None, [-0.172, 0.172], 0.06, 6);
        assert_eq!(texts(&bound), ["−0.15", "−0.10", "−0.05", "0.00", "0.05", "0.10", "0.15"]);
        let peak = Axis::new(None, [-31.0, 279.0], 0.06, 3);
        assert_eq!((texts(&peak), peak.factor.as_str()), (vec!["0", "100", "200"], ""));
    }

    #[test]
    fn a_logarithmic_axis_has_decades_of_equal_length() {
        let axis = Axis::logarithmic([0.01, 0.1, -3.0, 0.0, f64::NAN]);
        assert_eq!(texts(&axis), ["0.01", "0.02", "0.05", "0.1"]);
        let [low, middle, high] = [0.01, 0.02, 0.04].map(|value| axis.place(value));
        assert!((high - middle - (middle - low)).abs() < 1e-12 && low > 0.0 && axis.place(0.1) < 1.0);
        assert_eq!(texts(&Axis::logarithmic([2e-6, 9e-3])), ["10⁻⁵", "10⁻⁴", "0.001", "0.01"]);

        assert_eq!(texts(&Axis::logarithmic([])), ["0.1", "0.2", "0.5", "1"]);
        for k in 0..40 {
            let one = Axis::logarithmic_with_scale([1e-3 * 1.2_f64.powi(k)]);
            assert!(one.ticks.len() >= 2 && one.place(1e-3 * 1.2_f64.powi(k)) > 0.4, "{one:?}");
        }
    }

    #[test]
    fn extreme_ranges_share_a_factor() {
        let small = Axis::new(None, [0.0, 9.94e-4], 0.0, 2);
        assert_eq!((texts(&small), small.factor.as_str()), (vec!["0", "500"], "×10⁻⁶"));
        let large = Axis::new(None, [0.0, 2.7e6], 0.0, 3);
        assert_eq!((texts(&large), large.factor.as_str()), (vec!["0", "1", "2"], "×10⁶"));
        assert_eq!(small.ticks[1].0, 500.0 * libm::pow(10.0, -6.0));
    }

    #[test]
    fn no_data_makes_an_axis_panic_or_endless() {
        let nasty = [0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, 1e-99, 1.0 + 1e-15, 1e15, 1e100, -1e100, f64::MAX, f64::NAN];
        for a in nasty {
            for b in nasty {
                for range in [None, Some((a, b))] {
                    let axis = Axis::new(range, [a, b], 0.06, 5);
                    assert!(axis.lo < axis.hi, "{a:e} {b:e}: {axis:?}");
                    // Ten digits for a range of a billionth of its size, sign and point.
                    assert!(axis.ticks.iter().all(|(_, text)| text.chars().count() <= 12), "{axis:?}");
                    assert!((1..=12).contains(&axis.ticks.len()), "{a:e} {b:e}: {axis:?}");
                    assert!(
                        axis.ticks.iter().all(|(value, _)| (-0.01..1.01).contains(&axis.place(*value))),
                        "{axis:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_constant_stands_in_the_middle() {
        assert_eq!(Axis::new(None, [5.0; 3], 0.06, 4).place(5.0), 0.5);
        assert_eq!(Axis::new(None, [0.0], 0.06, 4).place(0.0), 0.5);
    }

    #[test]
    fn a_reversed_or_infinite_range_gives_way_to_the_data() {
        let automatic = Axis::new(None, [1.0, 2.0], 0.0, 4);
        assert_eq!(Axis::new(Some((3.0, -3.0)), [1.0, 2.0], 0.0, 4), automatic);
        assert_eq!(Axis::new(Some((f64::NAN, 3.0)), [1.0, 2.0], 0.0, 4), automatic);
    }
}
