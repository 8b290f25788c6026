//! Identification of a flexible joint or a motor from one recording of its counts and its current.
//!
//! Link: $\ddot q = k_1 (q_m - q) - b_1 \dot q - g \sin q + c$. Motor:
//! $\ddot q_m = k_2 (q - q_m) - b_2 \dot q_m + B_0 (u - F) + d$. All inputs of both equations are *measured*, so each
//! equation is fitted alone. The link (module `link`) contains neither current nor friction, the motor (module `motor`)
//! contains no gravity. A motor with a rigid load is the motor equation without k_2.
//!
//! | parameter | unit | is | measured error (`commission`, 62 plants at ±50 %) |
//! |---|---|---|---|
//! | k_1, b_1, g | 1/s², 1/s, 1/s² | K/J_l, B_l/J_l, W/J_l | see docs/evidence/commissioning.md |
//! | k_2, b_2, B_0 | 1/s², 1/s, rad/(s² A) | K/J_m, B_m/J_m, K_t/J_m | |
//! | f_c | A | Coulomb friction over K_t | |
//!
//! Only ratios are identifiable, and the controller uses only ratios. The inertia of the link keeps its data sheet
//! value, and the other parameters follow from it. For a motor the total inertia is kept.
//!
//! *Intervals* are wider than in textbooks, because rounding is not white noise and unmodelled effects (Stribeck,
//! ripple) cause a bias. A link interval is ten standard deviations. A motor interval is at least the error from
//! friction and ripple in the measured plants: 10 % of k_2 and B_0, 20 % of b_2, 15 % of f_c.
//!
//! A joint recording without the link count is identified from the motor alone (module `alone`). k_1 and b_1 follow
//! from the swing of the link, which appears in the current. The other parameters are fitted as above with the computed
//! link angle. The weight keeps its data sheet value.
//!
//! A recording that cannot support a design is *refused* with a reason ([`Refusal`]). Swapped columns and reversed
//! signs are found by trial and named.

use std::f64::consts::FRAC_PI_2;

use controller_core::drive::{Joint, Motor};
use loop_sim::plant::{self, Imperfections, JointBody, Plant, Shaft};
use loop_sim::port::drive::{DriveDesign, Motion};
use loop_sim::sensor::encoder::Mounted;
use loop_sim::signal::Signal;
use scenario::{Drive, Source};
use serde::Serialize;

mod alone;
mod fit;
mod gear;
mod link;
mod motor;
pub mod record;
mod refusal;

use alone::Alone;
use fit::Fit;
use link::Correction;

pub use refusal::{Equation, Refusal};

/// Condition number above which two parameters cannot be separated.
pub const MOST_CONDITION: f64 = 30.0;
/// Largest residual of the link equation, counts rms. Rounding alone leaves 0.289.
pub const MOST_RESIDUAL_STEPS: f64 = 0.6;
/// Largest residual of the motor equation as a share of the motion due to the current, rms, beyond
/// [`MOST_RESIDUAL_STEPS`]. Cogging, ripple and friction cause it: 0.02 to 0.15 in valid recordings. At 0.3, with
/// cogging of 6 % of the largest torque, b was off by 13 %, outside its interval.
pub const MOST_UNEXPLAINED: f64 = 0.2;
/// Largest ratio of peak to rms residual. Valid recordings have 3 to 11, at friction reversals; recordings with a jump,
/// a frozen count or an outlier have 16 to 37.
const MOST_PEAK: f64 = 15.0;
/// Peak residual that is always accepted, counts.
const LEAST_PEAK_STEPS: f64 = 5.0;
/// Largest number of Gauss-Newton iterations; valid recordings need 2 to 5.
pub const MOST_STEPS: usize = 15;
/// Smallest ratio of the fast part of the current (rms) to friction. Below it k_2 and B_0 were up to 18 % off, b_2 32
/// %.
const LEAST_SHAKEN: f64 = 2.0;
/// Window of the mean that separates the move from the excitation, s.
const SLOW_S: f64 = 0.2;
/// Smallest usable travel of a shaft, counts.
const LEAST_TRAVEL_STEPS: f64 = 200.0;
/// Ratio of stated interval to computed standard deviation.
const WIDENED: f64 = 10.0;
/// Relative error of the motor parameters from friction and ripple: k_2 and B_0; b_2; f_c.
const BIAS: [f64; 3] = [0.1, 0.2, 0.15];
/// Largest usable interval as a share of the value. In valid recordings b has 10 %. Without a multisine b of a motor
/// has 26 % and more, and was off by 43 %.
const MOST_VAGUE: f64 = 0.2;
/// Without the link count: half of the window of the subtracted mean, and the shortest recording, s.
const SLOW_ALONE_S: f64 = 0.5;
const LEAST_ALONE_S: f64 = 3.0;
/// Largest residual of the current without the link count, relative rms; 0.01 to 0.04 in valid recordings.
const MOST_UNEXPLAINED_ALONE: f64 = 0.1;
/// Interval of k_1 without the link count in standard deviations, also compared with half the window, and its largest
/// usable share. Moves at the link frequency give 1 to 5 %, slower moves 4 to 32 %.
const WIDENED_ALONE: f64 = 5.0;
const MOST_ALONE: f64 = 0.1;
/// Assumed relative error of the data sheet weight without the link count.
const WEIGHT: f64 = 0.5;
/// Start-up time of the drive that is cut from a recording, s.
const SETTLED_S: f64 = 0.1;

/// Recorded angle of a shaft.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Angle {
    /// Angle in each tick on the link side of a gear, rad.
    pub rad: Vec<f64>,
    /// One count of the encoder, rad.
    pub step_rad: f64,
}

/// Recording: sample k of each angle, and the current that is held after this sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Sampling period, s.
    pub period_s: f64,
    /// Angle of the link; `None` for a motor with a rigid load.
    pub link: Option<Angle>,
    /// Angle of the motor.
    pub motor: Angle,
    /// Current, A.
    pub held_a: Vec<f64>,
}

/// Data sheet of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sheet {
    /// Data sheet of a flexible joint.
    Joint(Joint),
    /// Data sheet of a motor with a rigid load.
    Motor(Motor),
}

impl Sheet {
    /// Returns the torque constant K_t, N m per A.
    pub const fn torque_n_m_per_a(&self) -> f64 {
        let (Self::Joint(Joint { torque_n_m_per_a, .. }) | Self::Motor(Motor { torque_n_m_per_a, .. })) = self;
        *torque_n_m_per_a
    }

    /// Returns the largest current that holds the weight over a travel from the hanging position, A.
    pub(crate) fn lifts_a(&self, way_rad: f64) -> f64 {
        let Self::Joint(joint) = self else { return 0.0 };
        joint.weight_n_m * libm::sin(way_rad.abs().min(FRAC_PI_2)) / joint.torque_n_m_per_a
    }

    /// Returns the resonance of motor against link, rad/s; 0 for a motor with a rigid load.
    pub(crate) fn resonance_rad_s(&self) -> f64 {
        let Self::Joint(joint) = self else { return 0.0 };
        libm::sqrt(joint.stiffness_n_m / joint.motor_inertia_kg_m2 + joint.stiffness_n_m / joint.link_inertia_kg_m2)
    }

    /// Returns the shortest form of a motion within this current: see [`Motion::shortest`].
    pub(crate) fn shortest(&self, motion: &Motion, range: [u32; 2], u_max: f64) -> Option<Motion> {
        match self {
            Self::Joint(joint) => motion.shortest::<4, 5>(range, u_max, |jet| joint.feed_forward(jet)),
            Self::Motor(motor) => motion.shortest::<3, 3>(range, u_max, |jet| motor.feed_forward(jet)),
        }
    }

    /// Returns the plant of the data sheet, with imperfections that the data sheet omits.
    pub(crate) fn plant(&self, spring_damping_n_m_s: f64, more: Imperfections) -> Box<dyn Plant> {
        match self {
            Self::Joint(joint) => {
                let body = JointBody { spring_damping_n_m_s, ..JointBody::from(joint) };
                Box::new(plant::Joint::new(body, body, more, Signal::default()))
            }
            Self::Motor(motor) => {
                let shaft = Shaft::from(motor);
                Box::new(plant::Motor::new(shaft, shaft, more, Signal::default()))
            }
        }
    }
}

/// Further data of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantData {
    /// Time constant of the current loop, s.
    pub lag_s: f64,
    /// Cogging periods per turn behind the gear; `None` if unknown.
    pub cogging_per_turn: Option<f64>,
    /// Largest relative deviation of k_1, k_2 and B_0 from the data sheet.
    pub tolerance: f64,
    /// Noise of the encoders without quantisation, counts rms.
    pub noise_steps: f64,
    /// Gear ratio of the file, motor turns per output turn; 1 without a gear. The data sheet already refers to the
    /// output. The ratio serves to name numbers that refer to the other side of the gear.
    pub gear: f64,
}

impl PlantData {
    /// Returns a tolerance of 60 %, unknown cogging, no noise and no gear.
    pub const fn with_lag(lag_s: f64) -> Self {
        Self { lag_s, cogging_per_turn: None, tolerance: 0.6, noise_steps: 0.0, gear: 1.0 }
    }

    /// Returns the data of a scenario with its drive: its gear and its current loop. Cogging has periods per turn of
    /// the motor; the tolerance is in percent, the noise in counts rms.
    pub fn of(
        source: &Source<'_>,
        drive: &Drive,
        cogging_per_turn: Option<f64>,
        [tolerance_percent, noise_steps]: [f64; 2],
    ) -> Self {
        Self {
            cogging_per_turn: cogging_per_turn.map(|per_turn| per_turn * gear_of_encoder(&drive.designed)),
            tolerance: tolerance_percent / 100.0,
            noise_steps,
            gear: scenario::gear_at(source, drive.designed.name()).unwrap_or(1.0),
            ..Self::with_lag(drive.current_lag_s)
        }
    }
}

/// Returns the revolutions of the motor per revolution behind the gear, as its encoder counts them.
fn gear_of_encoder(designed: &DriveDesign) -> f64 {
    let of = |mounted: &Mounted| f64::from(mounted.encoder.gear_num) / f64::from(mounted.encoder.gear_den);
    designed.encoders().last().map_or(1.0, |(_, motor)| of(motor))
}

/// Identified parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Symbol of the parameter.
    pub name: &'static str,
    /// Physical meaning.
    pub meaning: &'static str,
    /// Unit of the value.
    pub unit: &'static str,
    /// Identified value.
    pub value: f64,
    /// Half width of the interval that contains the true value, from measured plants.
    pub interval: f64,
    /// Value of the data sheet; `None` if the data sheet does not contain it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet: Option<f64>,
}

/// Quality of the fit of one equation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Condition number of the scaled Jacobian.
    pub condition: f64,
    /// Rms of the residual, counts.
    pub residual_steps: f64,
    /// Number of Gauss-Newton iterations.
    pub steps: usize,
}

/// Result of an identification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identified {
    /// Parameters with their intervals.
    pub parameters: Vec<Parameter>,
    /// Fit of the link equation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<Quality>,
    /// Fit of the motor equation.
    pub motor: Quality,
    /// Data sheet with the identified values.
    #[serde(skip)]
    pub sheet: Sheet,
    /// Residuals for a plot: time in s and counts, for the link (if there is one) and the motor.
    #[serde(skip)]
    pub residuals: Vec<Vec<(f64, f64)>>,
    /// Damping of the spring, N m s/rad; 0 if the fit does not need it.
    #[serde(skip)]
    pub spring_damping_n_m_s: f64,
    /// Cogging amplitude, A, and periods per turn behind the gear; `None` if the periods are unknown.
    #[serde(skip)]
    pub cogging: Option<[f64; 2]>,
    /// Constant torque of a load and offset of the encoders, c, rad/s².
    #[serde(skip)]
    constant: f64,
}

/// Identifies the parameters of a joint from a recording with a link, and otherwise of a motor.
///
/// # Errors
/// The recording cannot support a design; the [`Refusal`] contains the reason.
pub fn identify(record: &Record, sheet: &Sheet, known: &PlantData) -> Result<Identified, Refusal> {
    let travel = |angle: &Angle| {
        let (low, high) = angle
            .rad
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &rad| (rad.min(low), rad.max(high)));
        (high - low).max(0.0) / angle.step_rad
    };
    let of_motor = if matches!(sheet, Sheet::Joint(_)) { Equation::MotorOfJoint } else { Equation::Motor };
    let shafts = record.link.iter().map(|link| (Equation::Link, link)).chain([(of_motor, &record.motor)]);
    for (shaft, angle) in shafts {
        let steps = travel(angle);
        if steps < LEAST_TRAVEL_STEPS {
            return Err(Refusal::Still { shaft, steps });
        }
    }
    let (least, most) =
        record.held_a.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &u| (u.min(a), u.max(b)));
    if least >= most {
        return Err(Refusal::Steady { equation: of_motor, held_a: least });
    }
    let found = of_sheet(record, sheet, known);
    found.map_err(|refusal| gear::other_side(record, sheet, known).unwrap_or(refusal))
}

fn of_sheet(record: &Record, sheet: &Sheet, known: &PlantData) -> Result<Identified, Refusal> {
    match sheet {
        Sheet::Joint(joint) => of_joint(record, joint, known),
        Sheet::Motor(motor) => of_motor(record, motor, known),
    }
}

/// Accepts a fit that converged in time, with its quality.
fn judged(record: &Record, fit: Option<Fit>, equation: Equation, step_rad: f64) -> Result<(Fit, Quality), Refusal> {
    let fit = fit.filter(|fit| fit.steps <= MOST_STEPS);
    let fit = fit.ok_or_else(|| Refusal::Unsolved { equation, shaken_a: shaken_a(record) })?;
    let quality = Quality { condition: fit.condition(), residual_steps: fit.rms() / step_rad, steps: fit.steps };
    Ok((fit, quality))
}

/// Returns the correction of the predicted link state by a count, for this data sheet.
fn correction(joint: &Joint, steps: [f64; 2], record: &Record) -> Correction {
    let [k_1, b_1, _] = sheet_of_link(joint);
    Correction::of(k_1, b_1, steps, record.period_s, record.held_a.len() as f64 * record.period_s)
}

/// Fits the link alone: start, output or prediction error; angles and their steps in rad.
fn link_of([q, motor]: [&[f64]; 2], steps: [f64; 2], record: &Record, joint: &Joint, is_damped: bool) -> Option<Fit> {
    let start = link::start(q, motor, record.period_s, Sheet::Joint(*joint).resonance_rad_s())?;
    link::fit(q, motor, record.period_s, &start, correction(joint, steps, record), is_damped)
}

/// Returns the residual of the link relative to the rounding of its own count. It exceeds 1 if the motor encoder is
/// coarser.
fn shaken_by_input(record: &Record, link: &Angle, joint: &Joint) -> f64 {
    let by = correction(joint, [link.step_rad, record.motor.step_rad], record);
    if by.spread > 1.0 {
        return by.spread;
    }
    let seconds = record.held_a.len() as f64 * record.period_s;
    let share = link::noise_share(sheet_of_link(joint), record.period_s, seconds);
    let ratio = record.motor.step_rad / link.step_rad;
    // Factor 1.5: in a slow move rounding is not white. The threshold covers equal steps.
    libm::sqrt(1.0 + (1.5 * share).powi(2) * (ratio * ratio - 1.0).max(0.0))
}

/// Returns the largest acceptable residual of the link, counts rms.
pub fn most_residual_steps(record: &Record, sheet: &Sheet, known: &PlantData) -> f64 {
    let (Sheet::Joint(joint), Some(link)) = (sheet, &record.link) else { return MOST_RESIDUAL_STEPS };
    MOST_RESIDUAL_STEPS * shaken_by_input(record, link, joint) + known.noise_steps
}

/// Returns the angles without the start-up of the drive.
fn settled(record: &Record, angle: &Angle) -> Vec<f64> {
    let first = (SETTLED_S / record.period_s).round() as usize;
    angle.rad.get(first..).unwrap_or_default().to_vec()
}

/// Returns the most common wiring error that explains the link, if one does.
fn cause(record: &Record, link: &Angle, joint: &Joint, most: f64) -> Option<&'static str> {
    let (q, motor) = (settled(record, link), settled(record, &record.motor));
    let against: Vec<f64> = motor.iter().map(|angle| -angle).collect();
    let steps = [link.step_rad, record.motor.step_rad];
    let explains = |angles: [&[f64]; 2], steps: [f64; 2]| {
        link_of(angles, steps, record, joint, false)
            .is_some_and(|fit| fit.steps <= MOST_STEPS && fit.values[0] > 0.0 && fit.rms() <= most * steps[0])
    };
    if explains([&motor, &q], [steps[1], steps[0]]) {
        Some("the columns of link and motor are swapped")
    } else if explains([&q, &against], steps) {
        Some("one of the two encoders is reversed (encoder.link.reversed, encoder.motor.reversed)")
    } else {
        None
    }
}

const REVERSED_CURRENT: &str = "the sign of the current is reversed, or both encoders are reversed";

/// Link parameters before the fit of the motor.
struct Linked {
    /// k_1, b_1, g, c, d_1.
    values: [f64; 5],
    /// Parameters of the link that were fitted.
    parameters: Vec<Parameter>,
    /// Link angle, measured or computed from the motor, rad.
    rad: Vec<f64>,
    /// Fit of a measured link.
    quality: Option<Quality>,
    residuals: Vec<Vec<(f64, f64)>>,
}

/// Returns k_1, b_1 and g of a data sheet.
fn sheet_of_link(joint: &Joint) -> [f64; 3] {
    [joint.stiffness_n_m, joint.link_damping_n_m_s, joint.weight_n_m].map(|it| it / joint.link_inertia_kg_m2)
}

fn link_parameter(i: usize, value: f64, interval: f64, joint: &Joint) -> Parameter {
    let [k_1, b_1, g] = sheet_of_link(joint).map(Some);
    let (name, meaning, unit, sheet) = [
        ("k_1", "stiffness / link inertia", "1/s^2", k_1),
        ("b_1", "damping / link inertia", "1/s", b_1),
        ("g", "weight / link inertia", "1/s^2", g),
        ("c", "load / link inertia and encoder offset", "rad/s^2", None),
        ("d_1", "damping of the spring / link inertia, or k_1 times delay of the motor count", "1/s", None),
    ][i];
    Parameter { name, meaning, unit, value, interval, sheet }
}

/// Identifies the link from its own count.
fn measured_link(record: &Record, link: &Angle, joint: &Joint, known: &PlantData) -> Result<Linked, Refusal> {
    let unsolved = |equation| Refusal::Unsolved { equation, shaken_a: shaken_a(record) };
    let (q, motor) = (settled(record, link), settled(record, &record.motor));
    let most = most_residual_steps(record, &Sheet::Joint(*joint), known);
    let not_the_joint =
        |residual_steps: f64| Refusal::NotTheJoint { residual_steps, most, cause: cause(record, link, joint, most) };
    let found = |is_damped: bool| {
        let fit = link_of([&q, &motor], [link.step_rad, record.motor.step_rad], record, joint, is_damped);
        judged(record, fit, Equation::Link, link.step_rad)
    };
    let (mut fit, mut quality) = found(false).map_err(|refusal| match cause(record, link, joint, most) {
        Some(_) => not_the_joint(f64::INFINITY),
        None => refusal,
    })?;
    // Rounding of the motor count is an input error that the residual only partly contains.
    let widened = WIDENED * shaken_by_input(record, link, joint);
    let lags = link::lags(record.period_s);
    // An insignificant damping of the spring would widen the other intervals.
    let is_told = |(fit, damped): &(Fit, Quality)| {
        let needs_it = quality.residual_steps > most && fit.values[6] > 0.0;
        (needs_it || fit.values[6] > WIDENED * fit.deviations(lags)[6])
            && damped.residual_steps <= most
            && damped.condition <= MOST_CONDITION
    };
    if let Some(damped) = found(true).ok().filter(is_told) {
        (fit, quality) = damped;
    } else if quality.residual_steps > most {
        return Err(not_the_joint(quality.residual_steps));
    }
    let &[k_1, b_1, g, c, ..] = fit.values.as_slice() else { return Err(unsolved(Equation::Link)) };
    if quality.condition > MOST_CONDITION {
        return Err(Refusal::Alike { equation: Equation::Link, condition: quality.condition });
    }
    let deviations = fit.deviations(lags);
    let spring_damping = fit.values.get(6).copied().unwrap_or(0.0);
    let values = [k_1, b_1, g, c, spring_damping];
    // A delayed motor count is indistinguishable from damping of the spring and lowers b_1 equally. For a stiff link
    // the integration causes both effects as well.
    let integrated = link::integrated(k_1, record.period_s);
    let [twist, pull] = link::centre(&q, &motor).map(f64::abs);
    let of_centre = widened * (twist * deviations[0] + pull * deviations[2]);
    let off = [integrated[0], integrated[1] + spring_damping, 0.0, of_centre, spring_damping];
    let parameter =
        |i: usize| link_parameter(i, values[i], widened * deviations[if i < 4 { i } else { 6 }] + off[i], joint);
    let vague = widened * deviations[0] / k_1.abs();
    if vague > MOST_ALONE {
        return Err(Refusal::Vague { name: "k_1", interval: vague, most: MOST_ALONE, shaken_a: shaken_a(record) });
    }
    let residuals = vec![timed(&fit, record, link.rad.len(), link.step_rad, link::STRIDE)];
    let parameters = (0..if spring_damping > 0.0 { 5 } else { 4 }).map(parameter).collect();
    Ok(Linked { values, parameters, rad: link.rad.clone(), quality: Some(quality), residuals })
}

/// Identifies the link without its count.
fn link_alone(record: &Record, current: &[f64], joint: &Joint, known: &PlantData) -> Result<Linked, Refusal> {
    let [sheet_1, damping, g] = sheet_of_link(joint);
    let seconds = record.held_a.len() as f64 * record.period_s;
    if seconds < LEAST_ALONE_S {
        return Err(Refusal::Short { seconds });
    }
    let own_hz = libm::sqrt(sheet_1 + g) / std::f64::consts::TAU;
    let seen = |slow_s: f64| {
        let alone = Alone::of(&record.motor.rad, current, record.period_s, known.cogging_per_turn, g, slow_s);
        let seen = alone.and_then(|it| it.fit([sheet_1, damping], known.tolerance));
        seen.filter(|it| it.fit.steps <= MOST_STEPS).ok_or(Refusal::Poor { interval: f64::INFINITY, own_hz })
    };
    let (seen, again) = (seen(SLOW_ALONE_S)?, seen(0.5 * SLOW_ALONE_S)?);
    let unexplained = seen.fit.rms() / seen.current_a;
    if unexplained > MOST_UNEXPLAINED_ALONE {
        return Err(Refusal::NotTheSpring { unexplained });
    }
    if seen.fit.condition() > MOST_CONDITION {
        return Err(Refusal::Poor { interval: f64::INFINITY, own_hz });
    }
    let [k_1, b_1] = [seen.fit.values[0], seen.fit.values[1]];
    let apart = (again.fit.values[0] - k_1).abs();
    let of_k_1 = WIDENED_ALONE * seen.deviations[0].max(apart);
    if of_k_1 > MOST_ALONE * k_1.abs() {
        return Err(Refusal::Poor { interval: of_k_1 / k_1.abs(), own_hz });
    }
    // While the motor is held, weight looks like stiffness.
    let intervals = [of_k_1 + WEIGHT * g.abs(), WIDENED_ALONE * seen.deviations[1]];
    let values = [k_1, b_1, g, 0.0, 0.0];
    let parameters = (0..2).map(|i| link_parameter(i, values[i], intervals[i], joint)).collect();
    Ok(Linked { values, parameters, rad: seen.link, quality: None, residuals: Vec::new() })
}

fn of_joint(record: &Record, joint: &Joint, known: &PlantData) -> Result<Identified, Refusal> {
    let unsolved = |equation| Refusal::Unsolved { equation, shaken_a: shaken_a(record) };
    let period_s = record.period_s;
    let linked = match &record.link {
        Some(link) => measured_link(record, link, joint, known)?,
        None => link_alone(record, &motor::behind_lag(&record.held_a, period_s, known.lag_s), joint, known)?,
    };
    let [k1, b1, g, c, d1] = linked.values;
    let [sheet_1, sheet_2] = [joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2].map(|it| joint.stiffness_n_m / it);
    let damping = joint.motor_damping_n_m_s / joint.motor_inertia_kg_m2;
    let gain = joint.torque_n_m_per_a / joint.motor_inertia_kg_m2;
    let recorded = motor::Recorded {
        damped: d1 / k1,
        link: Some(&linked.rad),
        motor: &record.motor.rad,
        held: &record.held_a,
        lag_s: known.lag_s,
        period_s,
        cogging_per_turn: known.cogging_per_turn,
    };
    let (motor_fit, of_motor) =
        judged(record, recorded.fit([sheet_2, damping, gain]), Equation::MotorOfJoint, record.motor.step_rad)?;
    let &[k2, b2_of_all, b0, friction, ..] = motor_fit.values.as_slice() else {
        return Err(unsolved(Equation::MotorOfJoint));
    };
    // Damping of the spring slows the motor like b_2.
    let b2 = b2_of_all - d1 * k2 / k1;
    let deviations = motor_fit.deviations(recorded.lags());
    // A wrong sign is reported before any other refusal.
    positive(record, "k_1", k1, 0.0, None)?;
    positive(record, "k_2", k2, deviations[0], None)?;
    positive(record, "B_0", b0, deviations[2], Some(REVERSED_CURRENT))?;
    if of_motor.condition > MOST_CONDITION {
        return Err(Refusal::Alike { equation: Equation::MotorOfJoint, condition: of_motor.condition });
    }
    shaken(record, Equation::MotorOfJoint, friction)?;
    explained(record, &recorded, &motor_fit, sheet_2, known)?;
    for (name, value, sheet) in [("k_1", k1, sheet_1), ("k_2", k2, sheet_2), ("B_0", b0, gain)] {
        within(record, name, value, sheet, known)?;
    }

    let of_motor_10: Vec<f64> = deviations.iter().map(|it| WIDENED * it).collect();
    let inertia = joint.link_inertia_kg_m2;
    let vaguer = motor::vaguer(k2, period_s);
    // A current lag at half or twice the value of the file looks like this much damping.
    let late = known.lag_s * (k1 + k2);
    let biased = |share: usize, value: f64, deviation: f64| (vaguer * BIAS[share] * value.abs()).max(deviation);
    let parameter =
        |name, meaning, unit, value, interval, sheet| Parameter { name, meaning, unit, value, interval, sheet };
    let mut parameters = linked.parameters;
    parameters.extend([
        parameter("k_2", "stiffness / motor inertia", "1/s^2", k2, biased(0, k2, of_motor_10[0]), Some(sheet_2)),
        parameter(
            "b_2",
            "damping / motor inertia",
            "1/s",
            b2,
            biased(1, b2_of_all, of_motor_10[1]) + late,
            Some(damping),
        ),
        parameter("B_0", "torque constant / motor inertia", "rad/s^2/A", b0, biased(0, b0, of_motor_10[2]), Some(gain)),
        parameter("f_c", "Coulomb friction", "A", friction, biased(2, friction, of_motor_10[3]), None),
    ]);
    let sheet = Sheet::Joint(sheet_of(inertia, [k1, b1, g], [k2, b2, b0]));
    let mut residuals = linked.residuals;
    residuals.push(timed(&motor_fit, record, record.motor.rad.len(), record.motor.step_rad, 1));
    Ok(Identified {
        parameters,
        link: linked.quality,
        motor: of_motor,
        sheet,
        residuals,
        constant: c,
        spring_damping_n_m_s: d1 * inertia,
        cogging: cogging(&motor_fit.values[4..], known),
    })
}

/// Returns the data sheet of a link with this inertia and these parameters of link and motor.
fn sheet_of(link_inertia_kg_m2: f64, [k1, b1, g]: [f64; 3], [k2, b2, b0]: [f64; 3]) -> Joint {
    let inertia = link_inertia_kg_m2;
    let motor_inertia_kg_m2 = k1 * inertia / k2;
    Joint {
        link_inertia_kg_m2,
        // A parameter that is zero may be estimated slightly below zero.
        link_damping_n_m_s: b1.max(0.0) * inertia,
        weight_n_m: g.max(0.0) * inertia,
        stiffness_n_m: k1 * inertia,
        motor_inertia_kg_m2,
        motor_damping_n_m_s: b2.max(0.0) * motor_inertia_kg_m2,
        torque_n_m_per_a: b0 * motor_inertia_kg_m2,
    }
}

/// Returns the cogging amplitude, A, and the periods per turn, if they are known.
fn cogging(amplitudes: &[f64], known: &PlantData) -> Option<[f64; 2]> {
    let &[sine, cosine] = amplitudes else { return None };
    Some([libm::hypot(sine, cosine), known.cogging_per_turn?])
}

fn of_motor(record: &Record, motor: &Motor, known: &PlantData) -> Result<Identified, Refusal> {
    let unsolved = |equation| Refusal::Unsolved { equation, shaken_a: shaken_a(record) };
    let [damping, gain] = [motor.damping_n_m_s, motor.torque_n_m_per_a].map(|it| it / motor.inertia_kg_m2);
    let recorded = motor::Recorded {
        damped: 0.0,
        link: None,
        motor: &record.motor.rad,
        held: &record.held_a,
        lag_s: known.lag_s,
        period_s: record.period_s,
        cogging_per_turn: known.cogging_per_turn,
    };
    let (fit, quality) = judged(record, recorded.fit([0.0, damping, gain]), Equation::Motor, record.motor.step_rad)?;
    let &[_, b, friction, ..] = fit.values.as_slice() else { return Err(unsolved(Equation::Motor)) };
    let deviations = fit.deviations(recorded.lags());
    positive(record, "b", b, deviations[1], Some(REVERSED_CURRENT))?;
    if quality.condition > MOST_CONDITION {
        return Err(Refusal::Alike { equation: Equation::Motor, condition: quality.condition });
    }
    shaken(record, Equation::Motor, friction)?;
    explained(record, &recorded, &fit, 0.0, known)?;
    within(record, "b", b, gain, known)?;
    let stated = |share: usize, value: f64, j: usize| (BIAS[share] * value.abs()).max(WIDENED * deviations[j]);
    let parameters = vec![
        Parameter {
            name: "b",
            meaning: "torque constant / inertia",
            unit: "rad/s^2/A",
            value: b,
            interval: stated(0, b, 1),
            sheet: Some(gain),
        },
        Parameter {
            name: "f_c",
            meaning: "Coulomb friction",
            unit: "A",
            value: friction,
            interval: stated(2, friction, 2),
            sheet: None,
        },
    ];
    let interval = parameters[0].interval / b;
    let most = MOST_VAGUE.min(known.tolerance);
    if interval > most {
        return Err(Refusal::Vague { name: "b", interval, most, shaken_a: shaken_a(record) });
    }
    let sheet = Sheet::Motor(Motor { torque_n_m_per_a: b * motor.inertia_kg_m2, ..*motor });
    let residuals = vec![timed(&fit, record, record.motor.rad.len(), record.motor.step_rad, 1)];
    Ok(Identified {
        parameters,
        link: None,
        motor: quality,
        sheet,
        residuals,
        constant: 0.0,
        spring_damping_n_m_s: 0.0,
        cogging: cogging(&fit.values[3..], known),
    })
}

/// Returns the rms of the current around its mean over 0.2 s, A.
fn shaken_a(record: &Record) -> f64 {
    let half = ((0.5 * SLOW_S / record.period_s).round() as usize).max(1);
    let held = &record.held_a;
    let mut sums = vec![0.0];
    for u in held {
        sums.push(sums[sums.len() - 1] + u);
    }
    let fast = (half..held.len().saturating_sub(half)).map(|k| {
        let slow = (sums[k + half] - sums[k - half]) / (2 * half) as f64;
        (held[k] - slow) * (held[k] - slow)
    });
    let count = held.len().saturating_sub(2 * half).max(1);
    libm::sqrt(fast.sum::<f64>() / count as f64)
}

/// Checks that the excitation is large enough compared with friction.
fn shaken(record: &Record, equation: Equation, friction_a: f64) -> Result<(), Refusal> {
    let shaken_a = shaken_a(record);
    if shaken_a >= LEAST_SHAKEN * friction_a {
        return Ok(());
    }
    Err(Refusal::Weak { equation, shaken_a, friction_a })
}

/// Returns whether the peak residual is an outlier.
const fn stands_out(peak_steps: f64, rms_steps: f64) -> bool {
    peak_steps > LEAST_PEAK_STEPS.max(MOST_PEAK * rms_steps)
}

/// Checks that the residual of the motor equation fits quantisation and the usual unmodelled effects.
fn explained(
    record: &Record,
    recorded: &motor::Recorded<'_>,
    fit: &Fit,
    sheet_k2: f64,
    known: &PlantData,
) -> Result<(), Refusal> {
    let step_rad = record.motor.step_rad;
    let (residual_steps, by_current) = (fit.rms() / step_rad, recorded.by_current(sheet_k2, &fit.values) / step_rad);
    let most = MOST_RESIDUAL_STEPS + known.noise_steps + MOST_UNEXPLAINED * by_current;
    let left = timed(fit, record, record.motor.rad.len(), step_rad, 1);
    let (at_s, peak_steps) = left
        .iter()
        .fold((0.0, 0.0_f64), |known, &(t_s, steps)| if steps.abs() > known.1 { (t_s, steps.abs()) } else { known });
    if residual_steps <= most && !stands_out(peak_steps, residual_steps) {
        return Ok(());
    }
    let unexplained = residual_steps / by_current;
    Err(Refusal::NotTheMotor { residual_steps, most, unexplained, peak_steps, at_s })
}

/// Checks that a parameter is positive, or negative by no more than its interval.
fn positive(
    record: &Record,
    name: &'static str,
    value: f64,
    deviation: f64,
    cause: Option<&'static str>,
) -> Result<(), Refusal> {
    if value > 0.0 {
        return Ok(());
    }
    let interval = WIDENED * deviation / value.abs();
    if interval > 1.0 {
        return Err(Refusal::Vague { name, interval, most: MOST_VAGUE, shaken_a: shaken_a(record) });
    }
    Err(Refusal::NotPositive { name, value, cause })
}

fn within(record: &Record, name: &'static str, value: f64, sheet: f64, known: &PlantData) -> Result<(), Refusal> {
    let change = value / sheet - 1.0;
    if change.abs() <= known.tolerance {
        return Ok(());
    }
    Err(Refusal::OutOfTolerance { name, change, tolerance: known.tolerance, shaken_a: shaken_a(record) })
}

/// Returns the residuals as time in s and counts. The last residual belongs to the last sample.
fn timed(fit: &Fit, record: &Record, samples: usize, step_rad: f64, stride: usize) -> Vec<(f64, f64)> {
    let first = samples.saturating_sub(fit.residuals.len() * stride);
    let at = |k: usize| (first + k * stride) as f64 * record.period_s;
    fit.residuals.iter().enumerate().map(|(k, residual)| (at(k), residual / step_rad)).collect()
}

impl Identified {
    /// Returns the parameter with this symbol.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Returns the residual of the link equation for another recording with these parameters, counts rms. Only load and
    /// encoder offset are fitted again. Returns `None` for a motor and for a link that was identified from the motor
    /// alone.
    pub fn left_over(&self, record: &Record) -> Option<f64> {
        let (Sheet::Joint(joint), Some(link), Some(_)) = (&self.sheet, &record.link, &self.link) else { return None };
        left_over(record, link, joint, [self.constant, self.spring_damping_n_m_s])
    }
}

#[cfg(test)]
impl Identified {
    /// Builds an identification with this data sheet for tests.
    pub(crate) fn for_test(sheet: Sheet) -> Self {
        let motor = Quality { condition: 1.0, residual_steps: 0.3, steps: 3 };
        Self {
            parameters: Vec::new(),
            link: None,
            motor,
            sheet,
            residuals: Vec::new(),
            constant: 0.0,
            spring_damping_n_m_s: 0.0,
            cogging: None,
        }
    }
}

/// Returns the residual of the link of a data sheet, counts rms.
fn left_over(record: &Record, link: &Angle, joint: &Joint, [constant, spring_damping_n_m_s]: [f64; 2]) -> Option<f64> {
    let inertia = joint.link_inertia_kg_m2;
    let of = [joint.stiffness_n_m, joint.link_damping_n_m_s, joint.weight_n_m].map(|it| it / inertia);
    let (q, motor) = (settled(record, link), settled(record, &record.motor));
    let of = [of[0], of[1], of[2], constant];
    let by = correction(joint, [link.step_rad, record.motor.step_rad], record);
    let left = link::left_over(&q, &motor, record.period_s, &of, by, spring_damping_n_m_s / inertia);
    left.map(|rad| rad / link.step_rad)
}

#[cfg(test)]
mod tests;
