//! Scenario with the identified data sheet: basis of the new design, and the file that is kept.
//!
//! Data sheet numbers refer to the motor shaft, but identified numbers refer to the output of the gear. Each number is
//! converted by the ratio of the old ones. The bandwidths stay as in the file, or follow from its rules. The rules of a
//! coupled joint use a tolerance of 20 % if the data sheet had a larger one.

use controller_core::drive::Joint;
use loop_sim::port::drive::DriveDesign;
use scenario::Source;

use crate::Error;
use crate::identify::{Identified, Sheet};
use crate::number::significant;

/// Tolerance of an identified joint, percent: the intervals are 10 % for k_2 and B_0, and 20 % for b_2.
const FOUND_PERCENT: f64 = 20.0;

/// Scenario file with the identified data sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Retuned {
    /// Text of the file.
    pub text: String,
    /// Settings that still apply. Settings of the drive are in the file or were identified.
    pub sets: Vec<String>,
}

/// Returns the data sheet of a drive.
pub const fn sheet_of(designed: &DriveDesign) -> Sheet {
    match designed {
        DriveDesign::Motor(drive) => Sheet::Motor(drive.design.motor),
        DriveDesign::Joint(drive) => Sheet::Joint(drive.design.joint),
    }
}

/// Returns whether a setting of this key must be written into the kept file, because the design depends on it.
pub fn is_of_drive(key: &str) -> bool {
    let table = key.split(['.', '[']).next().unwrap_or_default().trim();
    ["motor", "joint", "encoder", "drive", "friction"].contains(&table)
}

impl Retuned {
    /// Replaces the numbers of the scenario by the identified ones and removes `[error]`, which refers to the old
    /// numbers.
    ///
    /// # Errors
    /// The file is invalid.
    pub fn of(source: &Source<'_>, old: &Sheet, found: &Identified) -> Result<Self, Error> {
        let number = |key: &str| -> Result<f64, Error> {
            let found = scenario::number_at(source, key)?;
            found.ok_or_else(|| Error::input(format!("{key} is not a number")).at(source.file))
        };
        let friction = found.parameter("f_c").filter(|it| it.value > it.interval).map(|it| it.value);
        let mut keys = match (old, &found.sheet) {
            (Sheet::Joint(old), Sheet::Joint(new)) => joint_keys(old, new, number)?,
            (Sheet::Motor(old), Sheet::Motor(new)) => {
                let torque = number("motor.torque_n_m_per_a")?;
                vec![("motor.torque_n_m_per_a", torque * new.torque_n_m_per_a / old.torque_n_m_per_a)]
            }
            _ => return Err(Error::input("the recording is from another kind of drive").at(source.file)),
        };
        // Static friction is at least the friction in motion: a smaller number of the file is removed.
        let mut still_goes = false;
        if let Some(friction_a) = friction {
            let torque = found.sheet.torque_n_m_per_a();
            let still = scenario::number_at(source, "friction.static_n_m")?;
            still_goes = still.is_some_and(|it| it < friction_a * torque);
            keys.push(("friction.coulomb_n_m", friction_a * torque));
        }
        let keys: Vec<(&str, String)> = keys
            .into_iter()
            .map(|(key, value)| (key, format!("{:?}", significant(value, 6).parse().unwrap_or(value))))
            .collect();
        // The drive does not use it, but a simulation of the file does.
        let damped = significant(found.spring_damping_n_m_s, 6);
        let damped = (found.spring_damping_n_m_s > 0.0).then_some(damped.as_str());
        // A measured link that fits without damping gets none.
        let damped = found.link.is_some().then_some(("joint.spring_damping_n_m_s", damped));
        let changes = keys.iter().map(|(key, value)| (*key, Some(value.as_str())));
        let gone = [("error", None)].into_iter().chain(still_goes.then_some(("friction.static_n_m", None)));
        let of_drive = source.sets.iter().filter_map(|set| set.split_once('=')).filter(|(key, _)| is_of_drive(key));
        let text = scenario::rewritten(source.text, of_drive.map(|(key, value)| (key.trim(), Some(value))))?;
        let text = scenario::rewritten(&text, changes.chain(damped).chain(gone))?;
        let stays = |set: &&String| {
            let key = set.split('=').next().unwrap_or_default().trim();
            !is_of_drive(key) && !key.starts_with("error")
        };
        let sets = source.sets.iter().filter(stays).cloned().collect();
        Ok(Self { text, sets })
    }

    /// Adapts the scenario to the drive that takes it over. The rule of a coupled joint uses a tolerance of at most 20
    /// %. The rule also decides the number of gain sets and could decide differently for the identified numbers; the
    /// number of the running drive is kept.
    ///
    /// # Errors
    /// The design has another form for another reason, or the file is invalid.
    pub fn taken_over_by(mut self, running: &DriveDesign, file: &str) -> Result<Self, Error> {
        if running.is_whole() {
            let key = "drive.uncertain_percent";
            let source = Source { file, text: &self.text, sets: &self.sets };
            if scenario::number_at(&source, key)?.is_some_and(|percent| percent > FOUND_PERCENT) {
                self.text = scenario::rewritten(&self.text, [(key, Some(format!("{FOUND_PERCENT:?}").as_str()))])?;
            }
        }
        let (form, is_whole) = (running.form(), running.is_whole());
        let retuned = self.designed(file)?;
        if retuned.is_whole() != is_whole {
            let (found, word) = if is_whole { ("soft", "coupled") } else { ("stiff", "normal") };
            return Err(Error::input(format!(
                "the identified joint is {found}, which needs a drive of another form. To commission it in the running \
                 form, set drive.tuning = \"{word}\""
            ))
            .at(file));
        }
        let sets = form.gain_sets.to_string();
        if is_whole && retuned.form().gain_sets != form.gain_sets {
            self.text = scenario::rewritten(&self.text, [("drive.gain_sets", Some(sets.as_str()))])?;
        }
        Ok(self)
    }

    /// Returns the drive of the scenario.
    ///
    /// # Errors
    /// The file is invalid or has no drive.
    pub fn designed(&self, file: &str) -> Result<DriveDesign, Error> {
        let source = Source { file, text: &self.text, sets: &self.sets };
        let experiment = scenario::parse(&source, "retuned")?;
        let drive = experiment.drive.ok_or_else(|| Error::input("the file has no drive").at(file))?;
        Ok(drive.designed)
    }
}

/// Returns the keys of `[joint]` with their values.
fn joint_keys(
    old: &Joint,
    new: &Joint,
    number: impl Fn(&str) -> Result<f64, Error>,
) -> Result<Vec<(&'static str, f64)>, Error> {
    let inertia = number("joint.motor_inertia_kg_m2")?;
    let own_inertia = inertia / old.motor_inertia_kg_m2;
    let torque = number("joint.torque_n_m_per_a")?;
    Ok(vec![
        ("joint.stiffness_n_m", new.stiffness_n_m),
        ("joint.link_damping_n_m_s", new.link_damping_n_m_s),
        ("joint.weight_n_m", new.weight_n_m),
        ("joint.motor_inertia_kg_m2", own_inertia * new.motor_inertia_kg_m2),
        ("joint.motor_damping_n_m_s", own_inertia * new.motor_damping_n_m_s),
        ("joint.torque_n_m_per_a", torque / old.torque_n_m_per_a * new.torque_n_m_per_a),
    ])
}
