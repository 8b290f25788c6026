//! A scenario with the data sheet that was found: what the drive is designed from, and the file that is kept.
//!
//! Numbers of the data sheet are those of the motor's own shaft, what was found is behind its gear: each goes over by
//! the ratio of the old ones. The bandwidths stay as the file has them, or as its rules make them.

use controller_core::drive::{Joint, Motor};
use loop_sim::port::drive::DriveDesign;
use scenario::Source;
use toml_edit::{DocumentMut, Item, Value};

use crate::identify::{Identified, Sheet};
use crate::report::number::significant;

/// A scenario as a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Retuned {
    /// Its text.
    pub text: String,
    /// The arguments that still go with it: those for the numbers that were found do not.
    pub sets: Vec<String>,
}

/// The data sheet of a drive, and its encoders in order.
pub const fn sheet_of(designed: &DriveDesign) -> Sheet {
    match designed {
        DriveDesign::Motor { design, .. } => Sheet::Motor(design.motor),
        DriveDesign::Joint { design, .. } => Sheet::Joint(design.joint),
    }
}

impl Retuned {
    /// The scenario with what was found in place of its numbers, and without `[error]`, which was about those.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn of(source: &Source<'_>, old: &Sheet, found: &Identified) -> Result<Self, String> {
        let number = |key: &str| -> Result<f64, String> {
            let found = scenario::number_at(source, key).map_err(|error| error.to_string())?;
            found.ok_or_else(|| format!("{}: {key} is no number", source.file))
        };
        let friction = found.parameter("f_c").filter(|it| it.value > it.interval).map(|it| it.value);
        let (table, mut keys) = match (old, &found.sheet) {
            (Sheet::Joint(old), Sheet::Joint(new)) => ("joint", joint_keys(old, new, number)?),
            (Sheet::Motor(old), Sheet::Motor(new)) => {
                let torque = number("motor.torque_n_m_per_a")?;
                ("motor", vec![("torque_n_m_per_a", torque * new.torque_n_m_per_a / old.torque_n_m_per_a)])
            }
            _ => return Err(format!("{}: the record is of another kind of drive", source.file)),
        };
        let mut document = source.text.parse::<DocumentMut>().map_err(|error| error.to_string())?;
        document.remove("error");
        let rounded = |value: f64| significant(value, 6).parse::<f64>().unwrap_or(value);
        let mut insert = |table: &str, key: &str, value: f64| -> Result<(), String> {
            let entry = document.entry(table).or_insert_with(toml_edit::table);
            let entry = entry.as_table_like_mut().ok_or_else(|| format!("{table} is no table"))?;
            // What is beside a key stays there.
            if let Some(there) = entry.get_mut(key).and_then(Item::as_value_mut) {
                let decor = there.decor().clone();
                *there = Value::from(rounded(value));
                *there.decor_mut() = decor;
            } else {
                entry.insert(key, toml_edit::value(rounded(value)));
            }
            Ok(())
        };
        for (key, value) in &keys {
            insert(table, key, *value)?;
        }
        if let Some(friction_a) = friction {
            let torque = match &found.sheet {
                Sheet::Joint(Joint { torque_n_m_per_a, .. }) | Sheet::Motor(Motor { torque_n_m_per_a, .. }) => {
                    *torque_n_m_per_a
                }
            };
            insert("friction", "coulomb_n_m", friction_a * torque)?;
            keys.push(("coulomb_n_m", friction_a));
        }
        let is_found = |set: &&String| {
            let key = set.split('=').next().unwrap_or_default().trim();
            keys.iter().any(|(name, _)| key.ends_with(name)) || key.starts_with("error") || key == table
        };
        let sets = source.sets.iter().filter(|set| !is_found(set)).cloned().collect();
        Ok(Self { text: document.to_string(), sets })
    }

    /// The drive of it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn designed(&self, file: &str) -> Result<DriveDesign, String> {
        let source = Source { file, text: &self.text, sets: &self.sets };
        let experiment = scenario::parse(&source, "retuned").map_err(|error| error.to_string())?;
        experiment.drive.map(|drive| drive.designed).ok_or_else(|| format!("{file}: there is no drive in it"))
    }
}

/// Keys of `[joint]`.
fn joint_keys(
    old: &Joint,
    new: &Joint,
    number: impl Fn(&str) -> Result<f64, String>,
) -> Result<Vec<(&'static str, f64)>, String> {
    let inertia = number("joint.motor_inertia_kg_m2")?;
    let own_inertia = inertia / old.motor_inertia_kg_m2;
    let torque = number("joint.torque_n_m_per_a")?;
    Ok(vec![
        ("stiffness_n_m", new.stiffness_n_m),
        ("link_damping_n_m_s", new.link_damping_n_m_s),
        ("weight_n_m", new.weight_n_m),
        ("motor_inertia_kg_m2", own_inertia * new.motor_inertia_kg_m2),
        ("motor_damping_n_m_s", own_inertia * new.motor_damping_n_m_s),
        ("torque_n_m_per_a", torque / old.torque_n_m_per_a * new.torque_n_m_per_a),
    ])
}
