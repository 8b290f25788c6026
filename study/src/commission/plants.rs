//! Plants that a data sheet may stand for: of a joint the 32 corners of ±p in k_1, b_1, k_2, b_2, B_0, of a motor the 8
//! in J, K_t, B; and random ones between.
//!
//! With what no data sheet says, over the largest current I and in its torques: of a joint friction 1/20 I at rest and
//! 1/30 I in motion (Stribeck), cogging I/100 (24 in a turn), ripple 2 % (42), of a motor what its file has; a load of
//! ±5.6 %, on the link of a joint, and a current of (1 + sin 2t) I/30 that nobody knows of.

use std::ops::ControlFlow;

use controller_core::drive::{Joint, Motor};
use loop_sim::port::drive::DriveDesign;
use loop_sim::random::Random;
use loop_sim::signal::{Signal, Term};
use rayon::prelude::*;
use scenario::Source;

use super::{Plan, Report, Retuned, Rig, Stopped, commission, sheet_of};
use crate::identify::{Identified, Known, Sheet};
use crate::{Error, Watch};

/// Periods of the cogging in a turn.
pub const COGGING_PER_TURN: f64 = 24.0;

/// A plant, as arguments for a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// True over believed k_1, b_1, k_2, b_2, B_0 of a joint, J, K_t, B of a motor.
    pub factors: Vec<f64>,
    /// What is to be found, and its true value.
    pub truth: Vec<(&'static str, f64)>,
    /// `KEY=VALUE`.
    pub sets: Vec<String>,
}

/// What a scenario is told of a joint with these true over believed k_1, b_1, k_2, b_2, B_0: the link's inertia stays.
pub fn joint_error([k_1, b_1, k_2, b_2, b]: [f64; 5]) -> String {
    // K is off as k_1, J_m as K/k_2, the others as their quotients.
    let motor = k_1 / k_2;
    let keys = ["stiffness", "link_damping", "motor_inertia", "motor_damping", "torque"];
    let factors = [k_1, b_1, motor, motor * b_2, motor * b];
    let error: Vec<String> =
        keys.iter().zip(factors).map(|(key, factor)| format!("{key}_percent = {}", 100.0 * (factor - 1.0))).collect();
    format!("error={{{}}}", error.join(", "))
}

/// The corners of so many numbers, then so many random ones, within ±`share` of 1.
fn factors<const N: usize>(share: f64, random: usize, seed: u64) -> Vec<[f64; N]> {
    let at = |corner: u32, i: usize| if corner >> i & 1 == 1 { 1.0 + share } else { 1.0 - share };
    let corners = (0..1_u32 << N).map(|corner| std::array::from_fn(|i| at(corner, i)));
    let mut noise = Random::new(seed, 1);
    let between = (0..random).map(|_| std::array::from_fn(|_| 1.0 + share * (2.0 * noise.uniform() - 1.0)));
    corners.chain(between).collect()
}

/// A load that stays, now against positive motion and now along it.
fn constant_load(k: usize, largest_n_m: f64) -> String {
    let amplitude = if k.is_multiple_of(2) { 0.056 } else { -0.056 } * largest_n_m;
    format!("load=[{{kind = \"const\", amplitude = {amplitude}}}]")
}

/// Joints around that of a drive. It has both gain sets (as a whole those of the rule), and its monitors know how
/// little is known.
fn joints(share: f64, random: usize, joint: &Joint, designed: &DriveDesign, seed: u64) -> Vec<Variant> {
    let limit_a = designed.max_current_a();
    let of = |(k, factors): (usize, [f64; 5])| {
        let [k_1, _, k_2, _, b] = factors;
        let largest = joint.torque_n_m_per_a * limit_a;
        let torque = largest * b * k_1 / k_2;
        let mut sets = vec![
            joint_error(factors),
            format!(
                "friction={{coulomb_n_m = {}, static_n_m = {}, stribeck_rad_s = 0.05, smooth_rad_s = 0.005, \
                 cogging_n_m = {}, cogging_per_turn = {COGGING_PER_TURN}, ripple_percent = 2.0, ripple_per_turn = 42}}",
                torque / 30.0,
                torque / 20.0,
                torque / 100.0
            ),
            constant_load(k, largest),
            format!("drive.uncertain_percent={}", (100.0 * share).round()),
        ];
        sets.extend((!designed.is_whole()).then(|| "drive.gain_sets=2".into()));
        let truth = std::iter::zip(["k_1", "b_1", "k_2", "b_2", "B_0"], std::iter::zip(ratios(joint), factors));
        let truth = truth.map(|(name, (believed, factor))| (name, believed * factor)).collect();
        Variant { factors: factors.to_vec(), truth, sets }
    };
    factors(share, random, seed).into_iter().enumerate().map(of).collect()
}

/// Motors around this one with this largest current and Coulomb friction.
fn motors(share: f64, random: usize, motor: &Motor, limit_a: f64, friction_n_m: f64, seed: u64) -> Vec<Variant> {
    let of = |(k, factors): (usize, [f64; 3])| {
        let [inertia, torque, damping] = factors;
        let percent = |factor: f64| 100.0 * (factor - 1.0);
        let sets = vec![
            format!(
                "error={{inertia_percent = {}, torque_percent = {}, damping_percent = {}}}",
                percent(inertia),
                percent(torque),
                percent(damping)
            ),
            constant_load(k, motor.torque_n_m_per_a * limit_a),
            format!("drive.uncertain_percent={}", (100.0 * share).round()),
        ];
        let torque = motor.torque_n_m_per_a * torque;
        let truth = vec![("b", torque / (motor.inertia_kg_m2 * inertia)), ("f_c", friction_n_m / torque)];
        Variant { factors: factors.to_vec(), truth, sets }
    };
    factors(share, random, seed).into_iter().enumerate().map(of).collect()
}

/// The current that nobody knows of.
pub fn unknown_current(limit_a: f64) -> Signal {
    let amplitude = limit_a / 30.0;
    Signal::new(vec![Term::Const { amplitude }, Term::Sin { amplitude, omega_rad_s: 2.0, phase_rad: 0.0 }])
}

/// All plants within what a data sheet may be off, each commissioned.
#[derive(Clone, Copy, Debug)]
pub struct Plants<'a> {
    /// What messages call the scenario.
    pub file: &'a str,
    /// The scenario.
    pub text: &'a str,
    /// `KEY=VALUE`.
    pub sets: &'a [String],
    /// p.
    pub share: f64,
    /// Random plants.
    pub random: usize,
    /// What is recorded; its seed is also that of the random plants.
    pub plan: Plan,
    /// What is known; the cogging of joints is that of these plants, and b of a motor may be off by J and K_t.
    pub known: Known,
    /// What k_1 and b_1, or b and f_c, are multiplied by once they are found: 1, or what the verification is to see.
    pub wrong: [f64; 2],
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Relative errors of what was found, as the truth is listed.
    pub off: Vec<(&'static str, f64)>,
    /// The largest error over what was stated.
    pub over_interval: f64,
    /// What happened.
    pub report: Report,
}

/// k_1, b_1, k_2, b_2, B_0.
pub fn ratios(joint: &Joint) -> [f64; 5] {
    let Joint { link_inertia_kg_m2: link, motor_inertia_kg_m2: motor, stiffness_n_m: spring, .. } = *joint;
    [
        spring / link,
        joint.link_damping_n_m_s / link,
        spring / motor,
        joint.motor_damping_n_m_s / motor,
        joint.torque_n_m_per_a / motor,
    ]
}

/// k_1 and b_1 of what was found times these, and k_2, b_2, B_0 stay; of a motor b and f_c.
pub fn made_wrong(found: &mut Identified, factors: [f64; 2]) {
    match &mut found.sheet {
        Sheet::Joint(joint) => {
            // K, and with it all of the motor.
            let Joint { stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a, .. } = joint;
            for number in [stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a] {
                *number *= factors[0];
            }
            joint.link_damping_n_m_s *= factors[1];
        }
        Sheet::Motor(motor) => {
            motor.torque_n_m_per_a *= factors[0];
            for (parameter, factor) in found.parameters.iter_mut().zip(factors) {
                parameter.value *= factor;
            }
        }
    }
}

impl Plants<'_> {
    /// The plants.
    ///
    /// # Errors
    /// When the scenario is of no drive.
    pub fn variants(&self) -> Result<Vec<Variant>, Error> {
        let Self { share, random, plan: Plan { seed, .. }, .. } = *self;
        let source = Source { file: self.file, text: self.text, sets: self.sets };
        let drive = scenario::parse(&source, "commission")?.drive;
        let drive = drive.ok_or_else(|| Error::input("there is neither [joint] nor [motor] in it").at(self.file))?;
        let designed = drive.designed;
        match sheet_of(&designed) {
            Sheet::Joint(joint) => Ok(joints(share, random, &joint, &designed, seed)),
            Sheet::Motor(motor) => {
                let friction = scenario::number_at(&source, "friction.coulomb_n_m")?;
                Ok(motors(share, random, &motor, designed.max_current_a(), friction.unwrap_or(0.0), seed))
            }
        }
    }

    /// What is known of one of them.
    fn known(&self, designed: &DriveDesign, lag_s: f64) -> Known {
        let known = Known { lag_s, ..self.known };
        match designed {
            DriveDesign::Joint(_) => Known { cogging_per_turn: Some(COGGING_PER_TURN), ..known },
            // Both of J and K_t are off.
            DriveDesign::Motor(_) => {
                let most = (1.0 + self.share) / (1.0 - self.share) - 1.0;
                Known { tolerance: known.tolerance.max(1.25 * most), ..known }
            }
        }
    }

    /// One of them commissioned.
    ///
    /// # Errors
    /// Why that came to no end.
    pub fn tried(&self, variant: &Variant) -> Result<Tried, Stopped> {
        let sets: Vec<String> = self.sets.iter().chain(&variant.sets).cloned().collect();
        let source = Source { file: self.file, text: self.text, sets: &sets };
        let mut experiment =
            scenario::parse(&source, "commission").map_err(|error| Stopped::Design(error.to_string()))?;
        let Some(drive) = &experiment.drive else { return Err(Stopped::Design("there is no drive".into())) };
        let designed = drive.designed;
        let old = sheet_of(&designed);
        let known = self.known(&designed, drive.current_lag_s);
        let (more, mut on) = (unknown_current(designed.max_current_a()), |_| ControlFlow::Continue(()));
        let mut rig = Rig::new(&mut experiment, more, &mut on)?;
        let mut found = None;
        let report = commission(&mut rig, &self.plan, &known, |identified| {
            found = Some(identified.clone());
            made_wrong(identified, self.wrong);
            Retuned::of(&source, &old, identified)?.taken_over_by(&designed, self.file)?.designed(self.file)
        })?;
        let (mut off, mut over_interval) = (Vec::new(), 0.0_f64);
        for &(name, truth) in &variant.truth {
            let Some(parameter) = found.iter().find_map(|found| found.parameter(name)) else { continue };
            off.push((name, (parameter.value / truth - 1.0).abs()));
            over_interval = over_interval.max((parameter.value - truth).abs() / parameter.interval);
        }
        Ok(Tried { off, over_interval, report })
    }
}

/// Tries all of them; `None` if it was stopped. A step of the watch is a plant.
///
/// # Errors
/// When the scenario is of no drive.
pub fn try_all(plants: &Plants<'_>, watch: Watch<'_>) -> Result<Option<Vec<Result<Tried, Stopped>>>, Error> {
    let variants = plants.variants()?;
    let of_variant = |variant| {
        if watch.is_stopped() {
            return None;
        }
        let tried = plants.tried(variant);
        watch.done();
        Some(tried)
    };
    Ok(variants.par_iter().map(of_variant).collect())
}
