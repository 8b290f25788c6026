//! Why the design of a drive is refused: the field, what it was given, and what it may be.

use core::fmt;

use crate::error::{Short, Text};

/// A design that must not run. Every refusal is a number that lies outside of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DriveError {
    /// Path of the field in the design.
    pub field: &'static str,
    /// The number given, or what it makes, in the unit of `low` and `high`.
    pub given: f64,
    /// The smallest number allowed.
    pub low: f64,
    /// The largest number allowed.
    pub high: f64,
    /// The rule.
    pub why: &'static str,
}

impl DriveError {
    pub(crate) const fn new(field: &'static str, given: f64, low: f64, high: f64, why: &'static str) -> Self {
        Self { field, given, low, high, why }
    }

    /// `Ok` for a number within its range; a NaN is not.
    pub(crate) const fn within(
        field: &'static str,
        given: f64,
        low: f64,
        high: f64,
        why: &'static str,
    ) -> Result<(), Self> {
        if given >= low && given <= high { Ok(()) } else { Err(Self::new(field, given, low, high, why)) }
    }

    /// [`within`](Self::within) of each: field, number, least, most, rule.
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

    /// The allowed number that is nearest to the given one.
    pub const fn nearest(&self) -> f64 {
        if self.given > self.high { self.high } else { self.low }
    }

    /// As a compile error says it.
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
