//! Inertia of a motor with its load: a number with a tolerance, or a range.
//!
//! A loop is designed for one inertia and tolerates a factor in either direction. For a range [J_1, J_2] the design is
//! for the geometric mean √(J_1 J_2), which has equal factors to both ends.

use controller_core::drive::MotorDesign;

use super::build::rounded;
use super::{MotorDriveTable, MotorTable, NumberOrRange};
use crate::error::shown;
use crate::resolve::{Problem, Problems, missing};

/// Largest `drive.uncertain_percent`.
pub(super) const MOST_PERCENT: f64 = 50.0;
/// Usual tolerance of a torque constant, percent.
const USUAL_PERCENT: f64 = 20.0;
/// Largest ratio of the ends of a range. Beyond it the monitor thresholds by rule would detect nothing.
const WIDEST: f64 = 100.0;
/// Largest ratio of the ends of a range that is proposed. At a ratio of 9 the default design is almost undamped at one
/// end.
const USEFUL: f64 = 5.0;

/// Inertia of rotor and load, on the output side of the gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia {
    /// Inertia of the design, kg m².
    pub(super) kg_m2: f64,
    /// Smallest and largest inertia, percent of the design value.
    pub(super) percent: [f64; 2],
    /// True if the file gives a range.
    pub(super) is_range: bool,
}

impl Inertia {
    /// Returns an inertia with the common tolerance.
    pub(super) fn known_to(kg_m2: f64, uncertain_percent: f64) -> Self {
        Self { kg_m2, percent: [100.0 - uncertain_percent, 100.0 + uncertain_percent], is_range: false }
    }

    /// Returns the inertia of a file, and reports invalid ranges.
    pub(super) fn of(sheet: &MotorTable, gear: f64, drive: &MotorDriveTable, problems: &mut Problems) -> Self {
        let rotor = sheet.inertia_kg_m2.map_or_else(|| missing(ROTOR, "the inertia of the rotor"), Ok);
        let given = problems.take(rotor).map(|it| (ends(it), ROTOR));
        let given = [given, Some((ends(sheet.load_inertia_kg_m2), LOAD))];
        let sorted = given.map(|it| it.map(|([low, high], _)| [low.min(high), low.max(high)]));
        let [rotor, load] = [sorted[0].unwrap_or([1.0; 2]), sorted[1].unwrap_or([0.0; 2])];
        let [low, high] = [0, 1].map(|i| load[i] + gear * gear * rotor[i]);
        if high > WIDEST * low {
            let message = format!(
                "{} to {} kg m^2 is more than a factor of {WIDEST}: no single design covers it, use two files",
                shown(rounded(low)),
                shown(rounded(high))
            );
            problems.0.push(Problem { key: if rotor[0] < rotor[1] { ROTOR } else { LOAD }.into(), message });
        } else {
            // A range that is too wide is reported without its order.
            problems.0.extend(given.into_iter().flatten().filter_map(|(ends, key)| reversed(ends, key)));
        }
        if low == high {
            return Self::known_to(low, drive.uncertain_percent);
        }
        let kg_m2 = (low * high).sqrt();
        Self { kg_m2, percent: [low, high].map(|end| 100.0 * end / kg_m2), is_range: true }
    }

    /// Returns the ends of the range, kg m². `None` without a range.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        self.is_range.then(|| self.percent.map(|percent| percent / 100.0 * self.kg_m2))
    }

    /// Returns the design with an innovation gate for the lightest motor of the range, which accelerates most.
    pub(super) fn with_gate(&self, design: MotorDesign) -> MotorDesign {
        if !self.is_range {
            return design;
        }
        MotorDesign { gate_steps: 1.0 + 100.0 / self.percent[0] * (design.gate_steps - 1.0), ..design }
    }

    /// Returns the deviation of the smallest inertia from the design, percent; 0 without a range. The monitor
    /// thresholds depend on it: with an inertia that is p too small, the acceleration deviates by p/(1 - p).
    pub(super) fn lighter_percent(&self) -> f64 {
        if self.is_range { 100.0 - self.percent[0] } else { 0.0 }
    }
}

const ROTOR: &str = "motor.inertia_kg_m2";
const LOAD: &str = "motor.load_inertia_kg_m2";

/// Returns both ends, equal for a number.
fn ends(given: NumberOrRange) -> [f64; 2] {
    match given {
        NumberOrRange::Number(number) => [number; 2],
        NumberOrRange::Range(ends) => ends,
    }
}

/// Returns a problem for a range with its largest number first.
fn reversed([low, high]: [f64; 2], key: &str) -> Option<Problem> {
    let message = format!("found [{0}, {1}], expected [{1}, {0}]: the smallest first", shown(low), shown(high));
    (low > high).then(|| Problem { key: key.into(), message })
}

/// Returns a problem for a tolerance above the limit. For a motor it proposes a range of inertia instead.
pub(super) fn too_uncertain(percent: f64, motor: Option<(&Inertia, &MotorTable, f64)>) -> Option<Problem> {
    if percent <= MOST_PERCENT {
        return None;
    }
    let of_range = |(inertia, sheet, gear): (&Inertia, &MotorTable, f64)| {
        if inertia.is_range {
            return String::from(": the range of the inertia is in the data sheet already, this key is for K_t");
        }
        if sheet.inertia_kg_m2.is_none() {
            return String::new();
        }
        let more = 1.0 + percent / 100.0;
        let less = 1.0 - percent / 100.0;
        if more > USEFUL * less {
            return ". One design covers no such range: measure the inertia (docs/commissioning.md)".into();
        }
        let whole = [less, more].map(|times| times * inertia.kg_m2);
        let NumberOrRange::Number(load) = sheet.load_inertia_kg_m2 else { return String::new() };
        let rotor = inertia.kg_m2 - load;
        let (key, range) = if load > 0.0 {
            (LOAD, whole.map(|end| (end - rotor).max(0.0)))
        } else {
            (ROTOR, whole.map(|end| end / (gear * gear)))
        };
        let [low, high] = range.map(|end| shown(rounded(end)));
        let side = if load > 0.0 || gear == 1.0 { "" } else { " of the rotor" };
        // The design is for the geometric mean of rotor and load together.
        let of_rotor = if load > 0.0 { rotor } else { 0.0 };
        let mean = ((range[0] + of_rotor) * (range[1] + of_rotor)).sqrt();
        format!(
            ", for inertia and K_t alike: for an inertia between {low} and {high} kg m^2{side} set {key} = \
             [{low}, {high}] with drive.uncertain_percent = {USUAL_PERCENT}, for K_t alone (designed for the \
             geometric mean {})",
            shown(format!("{mean:.2e}").parse().unwrap_or(mean))
        )
    };
    let remedy = motor.map_or_else(String::new, of_range);
    let message =
        format!("found {}, expected a finite number at least 0 and at most {MOST_PERCENT}{remedy}", shown(percent));
    Some(Problem { key: "drive.uncertain_percent".into(), message })
}
