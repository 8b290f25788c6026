//! Plants that a data sheet may stand for: the 32 corners of ±p in k_1, b_1, k_2, b_2, B_0, and random ones between.
//!
//! With what no data sheet says, over the largest current I and in its torques: friction 1/20 I at rest and 1/30 I in
//! motion (Stribeck), cogging I/100 (24 in a turn), ripple 2 % (42), a load of ±5.6 % on the link, and a current of
//! (1 + sin 2t) I/30 that nobody knows of.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use controller_core::drive::Joint;
use loop_sim::port::drive::DriveDesign;
use loop_sim::random::Random;
use loop_sim::signal::{Signal, Term};
use scenario::Source;

use super::{Plan, Report, Retuned, Rig, Stopped, commission, limit_a, sheet_of};
use crate::identify::{Identified, Known, Sheet};

/// Periods of the cogging in a turn.
pub const COGGING_PER_TURN: f64 = 24.0;

/// A plant, as arguments for a scenario of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// True over believed k_1, b_1, k_2, b_2, B_0.
    pub factors: [f64; 5],
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

/// The corners, then so many random plants, within ±`share` of a joint with this torque constant and largest current.
/// The drive has both gain sets, and its monitors know how little is known.
pub fn within(share: f64, random: usize, torque_n_m_per_a: f64, limit_a: f64, seed: u64) -> Vec<Variant> {
    let corners =
        (0..32_u32).map(|corner| std::array::from_fn(|i| if corner >> i & 1 == 1 { 1.0 + share } else { 1.0 - share }));
    let mut noise = Random::new(seed, 1);
    let between: Vec<[f64; 5]> =
        (0..random).map(|_| std::array::from_fn(|_| 1.0 + share * (2.0 * noise.uniform() - 1.0))).collect();
    let of = |(k, factors): (usize, [f64; 5])| {
        let [k_1, _, k_2, _, b] = factors;
        let torque = torque_n_m_per_a * b * k_1 / k_2 * limit_a;
        let load = torque_n_m_per_a * limit_a * 0.056 * if k % 2 == 0 { 1.0 } else { -1.0 };
        let sets = vec![
            joint_error(factors),
            format!(
                "friction={{coulomb_n_m = {}, static_n_m = {}, stribeck_rad_s = 0.05, smooth_rad_s = 0.005, \
                 cogging_n_m = {}, cogging_per_turn = {COGGING_PER_TURN}, ripple_percent = 2.0, ripple_per_turn = 42}}",
                torque / 30.0,
                torque / 20.0,
                torque / 100.0
            ),
            format!("load=[{{kind = \"const\", amplitude = {load}}}]"),
            format!("drive.uncertain_percent={}", (100.0 * share).round()),
            "drive.gain_sets=2".into(),
        ];
        Variant { factors, sets }
    };
    corners.chain(between).enumerate().map(of).collect()
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
    /// What is known; the cogging is that of these plants.
    pub known: Known,
    /// What k_1 and b_1 are multiplied by once they are found: 1, or what the verification is to see.
    pub wrong: [f64; 2],
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Relative errors of k_1, b_1, k_2, b_2, B_0.
    pub off: [f64; 5],
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

/// k_1 and b_1 of what was found times these; k_2, b_2 and B_0 stay.
pub fn made_wrong(found: &mut Identified, [k_1, b_1]: [f64; 2]) {
    if let Sheet::Joint(joint) = &mut found.sheet {
        // K, and with it all of the motor.
        let Joint { stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a, .. } = joint;
        for number in [stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a] {
            *number *= k_1;
        }
        joint.link_damping_n_m_s *= b_1;
    }
}

impl Plants<'_> {
    /// The plants.
    ///
    /// # Errors
    /// When the scenario is of no joint.
    pub fn variants(&self) -> Result<Vec<Variant>, String> {
        let source = Source { file: self.file, text: self.text, sets: self.sets };
        let experiment = scenario::parse(&source, "commission").map_err(|error| error.to_string())?;
        let Some(DriveDesign::Joint { design, .. }) = experiment.drive.map(|drive| drive.designed) else {
            return Err(format!("{}: plants around a data sheet are those of a [joint]", self.file));
        };
        let [torque, limit] = [design.joint.torque_n_m_per_a, design.limits.max];
        Ok(within(self.share, self.random, torque, limit, self.plan.seed))
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
        let known = Known { cogging_per_turn: Some(COGGING_PER_TURN), lag_s: drive.current_lag_s, ..self.known };
        let (more, mut on) = (unknown_current(limit_a(&designed)), |_| ControlFlow::Continue(()));
        let mut rig = Rig::new(&mut experiment, more, &mut on)?;
        let mut found = None;
        let report = commission(&mut rig, &self.plan, &known, |identified| {
            found = Some(identified.clone());
            made_wrong(identified, self.wrong);
            Retuned::of(&source, &old, identified)?.designed(self.file)
        })?;
        let (mut off, mut over_interval) = ([f64::NAN; 5], 0.0_f64);
        if let (Sheet::Joint(joint), Some(found)) = (&old, found) {
            let (believed, names) = (ratios(joint), ["k_1", "b_1", "k_2", "b_2", "B_0"]);
            for i in 0..5 {
                let truth = believed[i] * variant.factors[i];
                let Some(parameter) = found.parameter(names[i]) else { continue };
                off[i] = (parameter.value / truth - 1.0).abs();
                over_interval = over_interval.max((parameter.value - truth).abs() / parameter.interval);
            }
        }
        Ok(Tried { off, over_interval, report })
    }
}

/// All of them, on all threads; `step` is told of each. None when it was told to stop.
///
/// # Errors
/// When the scenario is of no joint.
pub fn try_all(
    plants: &Plants<'_>,
    stop: &AtomicBool,
    step: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Result<Tried, Stopped>>>, String> {
    let variants = plants.variants()?;
    let (next, done) = (AtomicUsize::new(0), Mutex::new(vec![None; variants.len()]));
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let k = next.fetch_add(1, Ordering::SeqCst)
                    && let Some(variant) = variants.get(k)
                    && !stop.load(Ordering::Relaxed)
                {
                    let tried = plants.tried(variant);
                    step();
                    if let Ok(mut done) = done.lock() {
                        done[k] = Some(tried);
                    }
                }
            });
        }
    });
    Ok(done.into_inner().unwrap_or_default().into_iter().collect())
}
