//! How well the inertia of a motor with its load is known: a number that may be so much off, or a range.
//!
//! A loop is designed for one inertia and bears a factor either way. Of a range [J_1, J_2] that is the same factor to
//! both ends if the design is for the geometric mean √(J_1 J_2).

use controller_core::drive::MotorDesign;

use super::build::rounded;
use super::{MotorDriveTable, MotorTable, NumberOrRange};
use crate::error::shown;
use crate::resolve::{Problem, Problems, missing};

/// The most that `drive.uncertain_percent` may be.
pub(super) const MOST_PERCENT: f64 = 50.0;
/// How well a torque constant is known as a rule, percent.
const USUAL_PERCENT: f64 = 20.0;
/// The largest inertia of a range over its smallest: beyond it a monitor by rule would see nothing.
const WIDEST: f64 = 100.0;

/// Inertia of rotor and load, on the side of the gear where the angle is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia {
    /// What the design is for, kg m².
    pub(super) kg_m2: f64,
    /// The lightest and the heaviest that it may be, percent of that.
    pub(super) percent: [f64; 2],
    /// Does the file say a range?
    pub(super) is_range: bool,
}

impl Inertia {
    /// One that is as well known as all else.
    pub(super) fn known_to(kg_m2: f64, uncertain_percent: f64) -> Self {
        Self { kg_m2, percent: [100.0 - uncertain_percent, 100.0 + uncertain_percent], is_range: false }
    }

    /// What the file says.
    pub(super) fn of(sheet: &MotorTable, gear: f64, drive: &MotorDriveTable, problems: &mut Problems) -> Self {
        let rotor = sheet.inertia_kg_m2.map_or_else(|| missing(ROTOR, "the inertia of the rotor"), Ok);
        let given = problems.take(rotor).map(|it| (ends(it), ROTOR));
        let given = [given, Some((ends(sheet.load_inertia_kg_m2), LOAD))];
        let sorted = given.map(|it| it.map(|([low, high], _)| [low.min(high), low.max(high)]));
        let [rotor, load] = [sorted[0].unwrap_or([1.0; 2]), sorted[1].unwrap_or([0.0; 2])];
        let [low, high] = [0, 1].map(|i| load[i] + gear * gear * rotor[i]);
        if high > WIDEST * low {
            let message = format!(
                "{} to {} kg m^2 is more than a factor of {WIDEST}: no design is for all of it, make it two files",
                shown(rounded(low)),
                shown(rounded(high))
            );
            problems.0.push(Problem { key: if rotor[0] < rotor[1] { ROTOR } else { LOAD }.into(), message });
        } else {
            // A range that is too wide is so whatever its order.
            problems.0.extend(given.into_iter().flatten().filter_map(|(ends, key)| reversed(ends, key)));
        }
        if low == high {
            return Self::known_to(low, drive.uncertain_percent);
        }
        let kg_m2 = (low * high).sqrt();
        Self { kg_m2, percent: [low, high].map(|end| 100.0 * end / kg_m2), is_range: true }
    }

    /// The same on both sides of the data sheet, kg m².
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        self.is_range.then(|| self.percent.map(|percent| percent / 100.0 * self.kg_m2))
    }

    /// A design with a gate for the lightest motor of a range, which is as much faster under the same current and load.
    pub(super) fn with_gate(&self, design: MotorDesign) -> MotorDesign {
        if !self.is_range {
            return design;
        }
        MotorDesign { gate_steps: 1.0 + 100.0 / self.percent[0] * (design.gate_steps - 1.0), ..design }
    }

    /// How much lighter than what the design is for the lightest of a range is, percent; 0 without one. What a monitor
    /// may see goes with it, since an acceleration is off by p/(1 - p) under an inertia that is p too small.
    pub(super) fn lighter_percent(&self) -> f64 {
        if self.is_range { 100.0 - self.percent[0] } else { 0.0 }
    }
}

const ROTOR: &str = "motor.inertia_kg_m2";
const LOAD: &str = "motor.load_inertia_kg_m2";

/// The two ends, equal ones of a number.
fn ends(given: NumberOrRange) -> [f64; 2] {
    match given {
        NumberOrRange::Number(number) => [number; 2],
        NumberOrRange::Range(ends) => ends,
    }
}

/// A range with its largest number first.
fn reversed([low, high]: [f64; 2], key: &str) -> Option<Problem> {
    let message = format!("found [{0}, {1}], expected [{1}, {0}]: the smallest first", shown(low), shown(high));
    (low > high).then(|| Problem { key: key.into(), message })
}

/// A data sheet that is said to be less known than any corner that is looked at; of a motor with its inertia and gear.
pub(super) fn too_uncertain(percent: f64, motor: Option<(&Inertia, &MotorTable, f64)>) -> Option<Problem> {
    if percent <= MOST_PERCENT {
        return None;
    }
    let of_range = |(inertia, sheet, gear): (&Inertia, &MotorTable, f64)| {
        if inertia.is_range {
            return String::from(": the range of the inertia is in the data sheet already, this is for K_t");
        }
        if sheet.inertia_kg_m2.is_none() {
            return String::new();
        }
        // So many percent less, while that leaves a range that is taken; else the same factor either way.
        let more = 1.0 + percent / 100.0;
        let less = 1.0 - percent / 100.0;
        let times = if more < 0.99 * WIDEST * less {
            [less, more]
        } else {
            let factor = more.min(0.99 * WIDEST.sqrt());
            [1.0 / factor, factor]
        };
        let whole = times.map(|times| times * inertia.kg_m2);
        let NumberOrRange::Number(load) = sheet.load_inertia_kg_m2 else { return String::new() };
        let rotor = inertia.kg_m2 - load;
        let (key, range) = if load > 0.0 {
            (LOAD, whole.map(|end| (end - rotor).max(0.0)))
        } else {
            (ROTOR, whole.map(|end| end / (gear * gear)))
        };
        let [low, high] = range.map(|end| shown(rounded(end)));
        let side = if load > 0.0 || gear == 1.0 { "" } else { " of the rotor" };
        // What the design would be for: with a load, of both together.
        let of_rotor = if load > 0.0 { rotor } else { 0.0 };
        let mean = ((range[0] + of_rotor) * (range[1] + of_rotor)).sqrt();
        format!(
            ", for inertia and K_t alike: for an inertia between {low} and {high} kg m^2{side} say {key} = \
             [{low}, {high}] with drive.uncertain_percent = {USUAL_PERCENT}, of K_t alone (designed for the \
             geometric mean {})",
            shown(format!("{mean:.2e}").parse().unwrap_or(mean))
        )
    };
    let remedy = motor.map_or_else(String::new, of_range);
    let message =
        format!("found {}, expected a finite number at least 0 and at most {MOST_PERCENT}{remedy}", shown(percent));
    Some(Problem { key: "drive.uncertain_percent".into(), message })
}
