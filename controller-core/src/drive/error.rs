//! Error of a drive design: the field, its given number, and its range.

use core::fmt;

use crate::error::{Short, Text};

/// Error that rejects a design. Every error is a number outside of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DriveError {
    /// Path of the field in the design.
    pub field: &'static str,
    /// Given number, or the product that the rule limits, in the unit of `low` and `high`.
    pub given: f64,
    /// Smallest allowed number.
    pub low: f64,
    /// Largest allowed number.
    pub high: f64,
    /// Rule that the number breaks.
    pub why: &'static str,
}

impl DriveError {
    pub(crate) const fn new(field: &'static str, given: f64, low: f64, high: f64, why: &'static str) -> Self {
        Self { field, given, low, high, why }
    }

    /// Returns `Ok` for a number within its range. A NaN is an error.
    pub(crate) const fn within(
        field: &'static str,
        given: f64,
        low: f64,
        high: f64,
        why: &'static str,
    ) -> Result<(), Self> {
        if given >= low && given <= high { Ok(()) } else { Err(Self::new(field, given, low, high, why)) }
    }

    /// Checks [`within`](Self::within) for each entry: field, number, smallest, largest, rule.
    pub(crate) const fn within_all(rules: &[(&'static str, f64, f64, f64, &'static str)]) -> Result<(), Self> {
        let mut k = 0;
        while k < rules.len() {
            let (field, given, low, high, why) = rules[k];
            if let Err(error) = Self::within(field, given, low, high, why) {
                return Err(error);
            }
            k += 1;
        }
        Ok(())
    }

    /// Returns the allowed number that is nearest to the given one.
    pub const fn nearest(&self) -> f64 {
        if self.given > self.high { self.high } else { self.low }
    }

    /// Returns the text of a compile error.
    pub(crate) const fn text(&self) -> Text {
        Text::new().string(self.field).string(": ").string(self.why)
    }
}

impl fmt::Display for DriveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { field, why, .. } = self;
        let [given, low, high, nearest] = [self.given, self.low, self.high, self.nearest()].map(Short);
        write!(f, "{field}: {why} (given {given:.6}, allowed {low:.6} to {high:.6}: take {nearest:.6})")
    }
}

impl core::error::Error for DriveError {}
