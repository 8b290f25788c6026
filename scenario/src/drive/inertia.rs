//! How well the inertia of a motor with its load is known: a number that may be so much off, or a range.
//!
//! A loop is designed for one inertia and bears a factor either way. Of a range [J_1, J_2] that is the same factor to
//! both ends if the design is for the geometric mean √(J_1 J_2).

use controller_core::drive::MotorDesign;

use super::build::rounded;
use super::{MotorDriveTable, MotorTable, NumberOrRange};
use crate::error::shown;
use crate::resolve::{Problem, Problems, missing, problem};

/// The most that `drive.uncertain_percent` may be.
pub(super) const MOST_PERCENT: f64 = 50.0;
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
        let rotor = problems.take(rotor.and_then(|it| ends(it, ROTOR))).unwrap_or([1.0; 2]);
        let load = problems.take(ends(sheet.load_inertia_kg_m2, LOAD)).unwrap_or([0.0; 2]);
        let [low, high] = [0, 1].map(|i| load[i] + gear * gear * rotor[i]);
        if high > WIDEST * low {
            let message = format!(
                "{} to {} kg m^2 is more than a factor of {WIDEST}: no design is for all of it, make it two files",
                shown(rounded(low)),
                shown(rounded(high))
            );
            problems.0.push(Problem { key: if rotor[0] < rotor[1] { ROTOR } else { LOAD }.into(), message });
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
fn ends(given: NumberOrRange, key: &str) -> Result<[f64; 2], Problem> {
    let ends = match given {
        NumberOrRange::Number(number) => [number; 2],
        NumberOrRange::Range(ends) => ends,
    };
    let [low, high] = ends;
    if low > high {
        return problem(
            key,
            format!("found [{0}, {1}], expected [{1}, {0}]: the smallest first", shown(low), shown(high)),
        );
    }
    Ok(ends)
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
        // Below an inertia of 0 there is nothing to be meant: it may be so much more.
        let low = if percent < 100.0 { 1.0 - percent / 100.0 } else { 1.0 };
        let whole = [low, 1.0 + percent / 100.0].map(|times| times * inertia.kg_m2);
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
             [{low}, {high}] (designed for the geometric mean {})",
            shown(format!("{mean:.2e}").parse().unwrap_or(mean))
        )
    };
    let remedy = motor.map_or_else(String::new, of_range);
    let message =
        format!("found {}, expected a finite number at least 0 and at most {MOST_PERCENT}{remedy}", shown(percent));
    Some(Problem { key: "drive.uncertain_percent".into(), message })
}
