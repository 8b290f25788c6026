//! Detection of data sheet numbers that refer to the wrong side of the gear.
//!
//! A torque constant at the output of the gear is g times the motor value, and an inertia seen from the output g²
//! times. If such a number is entered for the motor, the gear is applied twice. The torque constant in the model is
//! then g times too large, or the inertia g² times. The recording gives the error of b or B_0 (K_t/J) and k_2 (K/J). If
//! a power of g explains it, the refusal names the keys.

use controller_core::drive::{Joint, Motor};

use super::{PlantData, Record, Refusal, Sheet, of_sheet};

/// Gear ratio below which a wrong side cannot be distinguished from an inaccurate data sheet.
const LEAST_GEAR: f64 = 1.6;
/// Largest relative deviation from the corrected data sheet.
const TOLERANCE: f64 = 0.35;

/// Combinations of numbers that may refer to the output: torque constant, inertia of the motor.
const SIDES: [[bool; 2]; 3] = [[true, false], [false, true], [true, true]];

/// Returns the refusal that names the numbers of the wrong side; `None` if no combination explains the recording.
pub(super) fn other_side(record: &Record, sheet: &Sheet, known: &PlantData) -> Option<Refusal> {
    let gear = known.gear;
    if !known.names_gear() {
        return None;
    }
    let known = PlantData { tolerance: TOLERANCE, ..*known };
    let tried = SIDES.into_iter().filter_map(|[torque, inertia]| {
        let by = |is: bool, power: f64| if is { power } else { 1.0 };
        let found = of_sheet(record, &with(sheet, by(torque, 1.0 / gear), by(inertia, 1.0 / (gear * gear))), &known);
        let found = found.ok()?;
        let names = ["b", "B_0", "k_2"];
        let changes = found.parameters.iter().filter(|it| names.contains(&it.name));
        let off = changes.filter_map(|it| Some(libm::log(it.value / it.sheet?).abs())).fold(0.0, f64::max);
        let name = if matches!(sheet, Sheet::Joint(_)) { "B_0" } else { "b" };
        let ratio = found.parameter(name)?.value / believed(sheet);
        Some((off, Refusal::Geared { name, ratio, gear, numbers: numbers(sheet, gear, [torque, inertia]) }))
    });
    tried.min_by(|(one, _), (other, _)| one.total_cmp(other)).map(|(_, refusal)| refusal)
}

impl PlantData {
    /// Returns whether numbers of the two sides of the gear can be distinguished.
    pub(crate) fn names_gear(&self) -> bool {
        self.gear.max(1.0 / self.gear) >= LEAST_GEAR
    }
}

impl Sheet {
    /// Returns the keys of torque constant and inertia of the motor.
    pub(crate) const fn keys_of_motor(&self) -> [&'static str; 2] {
        match self {
            Self::Joint(_) => ["joint.torque_n_m_per_a", "joint.motor_inertia_kg_m2"],
            Self::Motor(_) => ["motor.torque_n_m_per_a", "motor.inertia_kg_m2"],
        }
    }
}

/// Returns K_t over the inertia of the motor.
const fn believed(sheet: &Sheet) -> f64 {
    match sheet {
        Sheet::Joint(joint) => joint.torque_n_m_per_a / joint.motor_inertia_kg_m2,
        Sheet::Motor(motor) => motor.torque_n_m_per_a / motor.inertia_kg_m2,
    }
}

fn with(sheet: &Sheet, torque: f64, inertia: f64) -> Sheet {
    match *sheet {
        Sheet::Joint(joint) => Sheet::Joint(Joint {
            torque_n_m_per_a: torque * joint.torque_n_m_per_a,
            motor_inertia_kg_m2: inertia * joint.motor_inertia_kg_m2,
            ..joint
        }),
        Sheet::Motor(motor) => Sheet::Motor(Motor {
            torque_n_m_per_a: torque * motor.torque_n_m_per_a,
            inertia_kg_m2: inertia * motor.inertia_kg_m2,
            ..motor
        }),
    }
}

/// Returns keys, correct values and divisors. The correct inertia of a motor is unknown here, because it contains the
/// load.
fn numbers(sheet: &Sheet, gear: f64, is_of_output: [bool; 2]) -> Vec<(&'static str, Option<f64>, f64)> {
    let (squared, keys) = (gear * gear, sheet.keys_of_motor());
    let [torque, inertia] = match sheet {
        Sheet::Joint(Joint { torque_n_m_per_a, motor_inertia_kg_m2, .. }) => {
            [Some(torque_n_m_per_a / squared), Some(motor_inertia_kg_m2 / (squared * squared))]
        }
        Sheet::Motor(Motor { torque_n_m_per_a, .. }) => [Some(torque_n_m_per_a / squared), None],
    };
    let numbers = [(keys[0], torque, gear), (keys[1], inertia, squared)];
    numbers.into_iter().zip(is_of_output).filter_map(|(number, is)| is.then_some(number)).collect()
}
