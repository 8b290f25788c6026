//! Numbers for people, with a suitable number of digits.

/// Formats `value` with this number of significant digits: plain from 1e-4 up to 1e6, scientific notation beyond.
///
/// ```
/// use study::number::significant;
/// assert_eq!(significant(0.048_613, 4), "0.04861");
/// assert_eq!(significant(279.0, 4), "279.0");
/// assert_eq!(significant(7.2948e-5, 4), "7.295e-5");
/// ```
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        // Adding 0 turns -0 into 0.
        return (value + 0.0).to_string();
    }
    // Rounding comes first: 9.9996 has the exponent of 10.00.
    let after_first = digits.max(1) - 1;
    let rounded = format!("{value:.after_first$e}");
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    match rounded.parse::<f64>() {
        Ok(number) if (-4..6).contains(&exponent) => {
            let shift = exponent.unsigned_abs() as usize;
            let decimals = if exponent < 0 { after_first + shift } else { after_first.saturating_sub(shift) };
            format!("{number:.decimals$}")
        }
        _ => rounded,
    }
}

/// Formats a number as typed: up to this number of significant digits, without trailing zeros.
///
/// ```
/// use study::number::typed;
/// assert_eq!([typed(10.0, 6), typed(26.227_958_898_465_907, 6)], ["10", "26.228"]);
/// ```
#[must_use]
pub fn typed(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    // TOML does not accept a whole number with more digits than an i64.
    text.parse::<f64>().map_or(text, |it| if it.abs() < 1e15 { it.to_string() } else { format!("{it:e}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_survive_rounding_up_to_the_next_power() {
        let cases = [
            (9.9996, "10.00"),
            (-0.000_123_456, "-0.0001235"),
            (0.000_099_999, "9.9999e-5"),
            (44_123.4, "44120"),
            (999_999.9, "1.000e6"),
            (0.0, "0"),
            (-0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::MIN_POSITIVE, "2.225e-308"),
        ];
        for (value, expected) in cases {
            let digits = if expected == "9.9999e-5" { 5 } else { 4 };
            assert_eq!(significant(value, digits), expected);
        }
        assert_eq!(significant(0.000_099_999, 4), "0.0001000");
        assert_eq!(significant(3.7, 0), "4");
    }
}
