//! Plants within the tolerance of a data sheet. For a joint: the 32 corners of ±p in k_1, b_1, k_2, b_2, B_0. For a
//! motor: the 8 corners in J, K_t, B. Random plants between the corners follow.
//!
//! Effects that a data sheet omits are added, relative to the largest current I and its torque. A joint has friction of
//! 1/20 I at rest and 1/30 I in motion (Stribeck), cogging I/100 (24 per turn) and ripple 2 % (42). A motor has the
//! friction and cogging of its file. Both have a load of ±5.6 %, on the link of a joint, and an unknown current of (1 +
//! sin 2t) I/30.

use std::ops::ControlFlow;

use controller_core::drive::{Joint, Motor};
use loop_sim::port::drive::DriveDesign;
use loop_sim::random::Random;
use loop_sim::signal::{Signal, Term};
use rayon::prelude::*;
use scenario::Source;

use super::{Plan, Report, Retuned, Rig, Stopped, commission, sheet_of};
use crate::identify::{Identified, PlantData, Sheet};
use crate::{Error, Watch};

/// Cogging periods per turn.
pub const COGGING_PER_TURN: f64 = 24.0;

/// Plant as settings of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Ratio of true to nominal values: k_1, b_1, k_2, b_2, B_0 of a joint; J, K_t, B of a motor.
    pub factors: Vec<f64>,
    /// Parameters to identify, and their true values.
    pub truth: Vec<(&'static str, f64)>,
    /// Settings `KEY=VALUE`.
    pub sets: Vec<String>,
}

/// Returns the error table of a joint with these ratios of true to nominal k_1, b_1, k_2, b_2, B_0; the link inertia
/// stays.
pub fn joint_error([k_1, b_1, k_2, b_2, b]: [f64; 5]) -> String {
    // K changes like k_1, J_m like K/k_2, the others like their quotients.
    let motor = k_1 / k_2;
    let keys = ["stiffness", "link_damping", "motor_inertia", "motor_damping", "torque"];
    let factors = [k_1, b_1, motor, motor * b_2, motor * b];
    let error: Vec<String> =
        keys.iter().zip(factors).map(|(key, factor)| format!("{key}_percent = {}", 100.0 * (factor - 1.0))).collect();
    format!("error={{{}}}", error.join(", "))
}

/// Returns the corners of `N` numbers within ±`share` of 1, then `random` random points.
fn factors<const N: usize>(share: f64, random: usize, seed: u64) -> Vec<[f64; N]> {
    let at = |corner: u32, i: usize| if corner >> i & 1 == 1 { 1.0 + share } else { 1.0 - share };
    let corners = (0..1_u32 << N).map(|corner| std::array::from_fn(|i| at(corner, i)));
    let mut noise = Random::new(seed, 1);
    let between = (0..random).map(|_| std::array::from_fn(|_| 1.0 + share * (2.0 * noise.uniform() - 1.0)));
    corners.chain(between).collect()
}

/// Returns a constant load, alternately against and along positive motion.
fn constant_load(k: usize, largest_n_m: f64) -> String {
    let amplitude = if k.is_multiple_of(2) { 0.056 } else { -0.056 } * largest_n_m;
    format!("load=[{{kind = \"const\", amplitude = {amplitude}}}]")
}

/// Returns joints around a drive. The drive has both gain sets (a coupled design the number of its rule), and its
/// monitors use the declared tolerance.
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

/// Returns motors around this one with this current limit and Coulomb friction.
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

/// Returns the unknown current.
pub fn unknown_current(limit_a: f64) -> Signal {
    let amplitude = limit_a / 30.0;
    Signal::new(vec![Term::Const { amplitude }, Term::Sin { amplitude, omega_rad_s: 2.0, phase_rad: 0.0 }])
}

/// All plants within the tolerance of a data sheet, each of which is commissioned.
#[derive(Clone, Copy, Debug)]
pub struct Plants<'a> {
    /// Name of the scenario in messages.
    pub file: &'a str,
    /// Content of the scenario.
    pub text: &'a str,
    /// Settings `KEY=VALUE`.
    pub sets: &'a [String],
    /// Tolerance p, as a share.
    pub share: f64,
    /// Number of random plants.
    pub random: usize,
    /// Plan of the recording; its seed is also used for the random plants.
    pub plan: Plan,
    /// Further data of the plant. For joints the cogging periods of these plants are used. The tolerance of b of a
    /// motor covers J and K_t.
    pub known: PlantData,
    /// Factors on the identified k_1 and b_1, or b and f_c: 1, or an error that the verification must detect.
    pub wrong: [f64; 2],
}

/// Result for one plant.
#[derive(Clone, Debug)]
pub struct PlantResult {
    /// Relative errors of the identified parameters, in the order of the true values.
    pub off: Vec<(&'static str, f64)>,
    /// Largest ratio of error to interval.
    pub over_interval: f64,
    /// Report of the sequence.
    pub report: Report,
}

/// Returns k_1, b_1, k_2, b_2, B_0.
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

/// Multiplies k_1 and b_1 of the result, with k_2, b_2, B_0 constant; for a motor b and f_c.
pub fn made_wrong(found: &mut Identified, factors: [f64; 2]) {
    match &mut found.sheet {
        Sheet::Joint(joint) => {
            // K, and with it all motor parameters.
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
    /// Returns the plants.
    ///
    /// # Errors
    /// The scenario has no drive.
    pub fn variants(&self) -> Result<Vec<Variant>, Error> {
        let Self { share, random, plan: Plan { seed, .. }, .. } = *self;
        let source = Source { file: self.file, text: self.text, sets: self.sets };
        let drive = scenario::parse(&source, "commission")?.drive;
        let drive = drive.ok_or_else(|| Error::input("the file has neither [joint] nor [motor]").at(self.file))?;
        let designed = drive.designed;
        match sheet_of(&designed) {
            Sheet::Joint(joint) => Ok(joints(share, random, &joint, &designed, seed)),
            Sheet::Motor(motor) => {
                let friction = scenario::number_at(&source, "friction.coulomb_n_m")?;
                Ok(motors(share, random, &motor, designed.max_current_a(), friction.unwrap_or(0.0), seed))
            }
        }
    }

    /// Returns the further data for one plant.
    fn known(&self, designed: &DriveDesign, lag_s: f64) -> PlantData {
        let known = PlantData { lag_s, ..self.known };
        match designed {
            DriveDesign::Joint(_) => PlantData { cogging_per_turn: Some(COGGING_PER_TURN), ..known },
            // J and K_t are both off.
            DriveDesign::Motor(_) => {
                let most = (1.0 + self.share) / (1.0 - self.share) - 1.0;
                PlantData { tolerance: known.tolerance.max(1.25 * most), ..known }
            }
        }
    }

    /// Commissions one plant.
    ///
    /// # Errors
    /// The reason of an early stop.
    pub fn tried(&self, variant: &Variant) -> Result<PlantResult, Stopped> {
        let sets: Vec<String> = self.sets.iter().chain(&variant.sets).cloned().collect();
        let source = Source { file: self.file, text: self.text, sets: &sets };
        let mut experiment =
            scenario::parse(&source, "commission").map_err(|error| Stopped::Design(error.to_string()))?;
        let Some(drive) = &experiment.drive else { return Err(Stopped::Design("the scenario has no drive".into())) };
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
        Ok(PlantResult { off, over_interval, report })
    }
}

/// Commissions all plants; `None` if stopped. A step of the watch is a plant.
///
/// # Errors
/// The scenario has no drive.
pub fn try_all(plants: &Plants<'_>, watch: Watch<'_>) -> Result<Option<Vec<Result<PlantResult, Stopped>>>, Error> {
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
