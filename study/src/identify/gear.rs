//! Numbers of a data sheet that were read off the other side of the gear.
//!
//! A torque constant of the gear's output is g times that of the motor, an inertia seen from there g² times. Typed as
//! that of the motor, each is taken over the gear once more: the law believes g K_t, or g² J too much. The record says
//! by how much b or B_0 (K_t/J) and k_2 (K/J) are off; where a power of g explains it, the keys are named.

use controller_core::drive::{Joint, Motor};

use super::{Known, Record, Refusal, Sheet, of_sheet};

/// A gear nearer to 1 than this cannot be told from a data sheet that is off.
const LEAST_GEAR: f64 = 1.6;
/// How far what was found may be from the data sheet of the other side.
const TOLERANCE: f64 = 0.35;

/// Which numbers were read off the output of the gear: torque constant, inertia of the motor.
const SIDES: [[bool; 2]; 3] = [[true, false], [false, true], [true, true]];

/// The refusal that names the numbers which the record fits once they are taken for those of the gear's output; `None`
/// if it fits none of them.
pub(super) fn other_side(record: &Record, sheet: &Sheet, known: &Known) -> Option<Refusal> {
    let gear = known.gear;
    if !known.names_gear() {
        return None;
    }
    let known = Known { tolerance: TOLERANCE, ..*known };
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

impl Known {
    /// Can numbers of the two sides of the gear be told apart?
    pub(crate) fn names_gear(&self) -> bool {
        self.gear.max(1.0 / self.gear) >= LEAST_GEAR
    }
}

impl Sheet {
    /// Keys of torque constant and inertia of the motor.
    pub(crate) const fn keys_of_motor(&self) -> [&'static str; 2] {
        match self {
            Self::Joint(_) => ["joint.torque_n_m_per_a", "joint.motor_inertia_kg_m2"],
            Self::Motor(_) => ["motor.torque_n_m_per_a", "motor.inertia_kg_m2"],
        }
    }
}

/// K_t over the inertia of the motor.
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

/// Keys, what they should be, and what to divide them by. Of a motor's inertia the share of the load is not known here.
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
