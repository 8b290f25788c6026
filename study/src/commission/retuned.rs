//! A scenario with the data sheet that was found: what the drive is designed from, and the file that is kept.
//!
//! Numbers of the data sheet are those of the motor's own shaft, what was found is behind its gear: each goes over by
//! the ratio of the old ones. The bandwidths stay as the file has them, or as its rules make them; those of a joint as
//! a whole for a tolerance of 20 %, if the data sheet's was larger.

use controller_core::drive::Joint;
use loop_sim::port::drive::DriveDesign;
use scenario::Source;

use crate::Error;
use crate::identify::{Identified, Sheet};
use crate::number::significant;

/// How far a joint may be from what was found: k_2 and B_0 are stated to 10 %, b_2 to 20.
const FOUND_PERCENT: f64 = 20.0;

/// A scenario as a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Retuned {
    /// Its text.
    pub text: String,
    /// The arguments that still go with it: those of the drive are in it, or were found anew.
    pub sets: Vec<String>,
}

/// The data sheet of a drive, and its encoders in order.
pub const fn sheet_of(designed: &DriveDesign) -> Sheet {
    match designed {
        DriveDesign::Motor(drive) => Sheet::Motor(drive.design.motor),
        DriveDesign::Joint(drive) => Sheet::Joint(drive.design.joint),
    }
}

/// Is a key of a table that goes into the file that is kept, if it is set? Without it what was found would be another
/// drive's there.
pub fn is_of_drive(key: &str) -> bool {
    let table = key.split(['.', '[']).next().unwrap_or_default().trim();
    ["motor", "joint", "encoder", "drive", "friction"].contains(&table)
}

impl Retuned {
    /// The scenario with what was found in place of its numbers, and without `[error]`, which was about those.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn of(source: &Source<'_>, old: &Sheet, found: &Identified) -> Result<Self, Error> {
        let number = |key: &str| -> Result<f64, Error> {
            let found = scenario::number_at(source, key)?;
            found.ok_or_else(|| Error::input(format!("{key} is no number")).at(source.file))
        };
        let friction = found.parameter("f_c").filter(|it| it.value > it.interval).map(|it| it.value);
        let mut keys = match (old, &found.sheet) {
            (Sheet::Joint(old), Sheet::Joint(new)) => joint_keys(old, new, number)?,
            (Sheet::Motor(old), Sheet::Motor(new)) => {
                let torque = number("motor.torque_n_m_per_a")?;
                vec![("motor.torque_n_m_per_a", torque * new.torque_n_m_per_a / old.torque_n_m_per_a)]
            }
            _ => return Err(Error::input("the record is of another kind of drive").at(source.file)),
        };
        // Friction at rest is no less than in motion: what the file says of it goes where more was found.
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
        // The drive does not know it; a simulation of the file does.
        let damped = significant(found.spring_damping_n_m_s, 6);
        let damped = (found.spring_damping_n_m_s > 0.0).then_some(damped.as_str());
        // Of a link that was seen and needs none, none.
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

    /// The same for the drive that is to take it over. Gains by rule of a joint as a whole are those for a tolerance:
    /// it is 20 % now, if it was larger. Whether it has a second gain set the rule decides too, and what was found may
    /// decide otherwise than the data sheet; the number of sets stays.
    ///
    /// # Errors
    /// When its drive is of another form for another reason, or what is wrong with it.
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
                "the joint as it was found is {found}, and would have a drive of another form: to commission it in the \
                 form that runs, type drive.tuning = \"{word}\""
            ))
            .at(file));
        }
        let sets = form.gain_sets.to_string();
        if is_whole && retuned.form().gain_sets != form.gain_sets {
            self.text = scenario::rewritten(&self.text, [("drive.gain_sets", Some(sets.as_str()))])?;
        }
        Ok(self)
    }

    /// The drive of it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn designed(&self, file: &str) -> Result<DriveDesign, Error> {
        let source = Source { file, text: &self.text, sets: &self.sets };
        let experiment = scenario::parse(&source, "retuned")?;
        let drive = experiment.drive.ok_or_else(|| Error::input("there is no drive in it").at(file))?;
        Ok(drive.designed)
    }
}

/// Keys of `[joint]`.
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
