//! Builds the stages of the loop of a drive from its scenario file.

use std::ops::Range;

use controller_core::drive::{
    DriveError, Encoder, Joint, JointBandwidths, JointDesign, JointRatios, Motor, MotorBandwidths, MotorDesign,
    MotorMargin, Mounting, Profile, ProfileLimits,
};
use controller_core::{Fallback, Limits};
use loop_sim::actuator::{self, Actuator};
use loop_sim::linear::LawAtRest;
use loop_sim::plant::{self, Friction, Imperfections, JointBody, Plant, Shaft, Supply};
use loop_sim::port::drive::{DriveAtRest, DriveDesign, DriveOf, Follows, Form, Goal, Monitors, Motion, Reaction};
use loop_sim::port::finer::Finer;
use loop_sim::sensor::encoder::{Encoders, Fault, Faulty, Mounted};
use loop_sim::sensor::{OffCentre, Sensing, Sensor};
use loop_sim::signal::Signal;
use loop_sim::solver;

use super::coupled::{self, AsWhole, CoupledBy};
use super::gear::{Gear, Geared};
use super::inertia::{Inertia, too_uncertain};
use super::joint_rule::JointRule;
use super::margin::{self, MarginKey, MarginRule};
use super::planned::{PlanGoal, PlanLimits, Planned, ticks_s};
use super::play::{InPlay, Play};
use super::supply::{self, Keys};
use super::{
    EncoderKey, EncoderTable, FaultKind, FaultTable, FrictionModel, FrictionTable, JointDriveTable, JointErrorTable,
    JointScenario, JointTable, LimitsTable, ModeKey, MonitorTable, MotorDriveTable, MotorErrorTable, MotorScenario,
    MotorTable, NumberOrRange, ReactionKey, ReferenceKind, ReferenceTable, RestBandKey, TuningKey,
};
use crate::assemble::{AtRest, Corner, Drive, Experiment, InertiaRange, Sensed, ShaftOf, StateName, TopSpeed, Twin};
use crate::error::shown;
use crate::resolve::{self, Problem, Problems, missing, problem};
use crate::{FallbackKey, FallbackWord, TermTable};

const MOTOR_STATES: [StateName; 3] = [("angle", "rad"), ("speed", "rad/s"), ("current", "A")];
const LOOSE_STATES: [StateName; 5] = [
    ("load angle", "rad"),
    ("load speed", "rad/s"),
    ("motor angle", "rad"),
    ("motor speed", "rad/s"),
    ("current", "A"),
];
const JOINT_STATES: [StateName; 5] = [
    ("link angle", "rad"),
    ("link speed", "rad/s"),
    ("motor angle", "rad"),
    ("motor speed", "rad/s"),
    ("current", "A"),
];
/// Shortest transition onto a sine or points by rule, s.
const START_S: f64 = 0.25;
/// Largest number of ticks between two set-points.
const MOST_EVERY: u32 = 1 << 24;
/// Default averaging time of set-points, s.
const SMOOTH_S: f64 = 0.01;
/// Largest sudden load over the largest motor torque. Above it the innovation gates do not detect encoder faults.
const MOST_SUDDEN: f64 = 2.0;

/// Keys that motor and joint have in common.
struct Common<'a> {
    name: Option<&'a str>,
    title: Option<&'a str>,
    span_s: f64,
    window_s: Option<[f64; 2]>,
    settling_band: Option<f64>,
    reference: &'a ReferenceTable,
    load: &'a [TermTable],
    fault: &'a [FaultTable],
    monitor: MonitorTable,
    limits: LimitsTable,
    uncertain_percent: f64,
    accepts_unstable: bool,
    /// Deviation of the lightest motor of a range of inertia from the design, percent; 0 without a range.
    lighter_percent: f64,
    mode: ModeKey,
    period_s: f64,
    max_current_a: f64,
    start_rad: f64,
    lag_s: f64,
    delay_ticks: usize,
    observer_states: usize,
    rest_band: Option<RestBandKey>,
    /// Largest age of a count, s.
    jitter_s: f64,
    encoders: &'a [&'a EncoderTable],
    seed: u64,
    /// Name of the table of the data sheet.
    plant: &'static str,
}

/// Drive before the design of its law.
struct Resolved {
    name: String,
    title: String,
    periods: usize,
    load: Signal,
    faults: Vec<(Broken, Range<usize>)>,
    wanted: PlanGoal,
    reaction: Reaction,
}

/// Rounds a computed number to four digits.
pub(super) fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// Rounds up to four digits, for a lower limit.
pub(super) fn up(number: f64) -> f64 {
    let near = rounded(number);
    if near < number { rounded(1.001 * number) } else { near }
}

/// Rounds down to four digits, for an upper limit.
pub(super) fn down(number: f64) -> f64 {
    let near = rounded(number);
    if near > number { rounded(0.999 * number) } else { near }
}

/// Shortest and longest period of a drive, s.
const PERIODS_S: [f64; 2] = [2e-5, 1e-2];
/// Remedy for a longer period.
const SLOWER: &str = ": if the bus is slower, run this loop on the drive and send it set-points";

/// Returns the period. An invalid period is reported and replaced by the nearest valid one, to check the other keys.
fn period(given_s: f64, problems: &mut Problems) -> f64 {
    let [shortest, longest] = PERIODS_S;
    let period_s = given_s.clamp(shortest, longest);
    if period_s != given_s {
        let message = format!(
            "the period of a drive is 20 us to 10 ms (given {}, allowed {} to {}){}",
            shown(given_s),
            shown(shortest),
            shown(longest),
            if given_s > longest { SLOWER } else { "" }
        );
        problems.0.push(Problem { key: "drive.period_s".into(), message });
    }
    period_s
}

/// Returns the speed below which friction fades. `None` for friction that holds.
fn faded_below(table: &FrictionTable) -> Option<f64> {
    let by_rule = if table.smooth_rad_s.is_some() { FrictionModel::Faded } else { FrictionModel::default() };
    (table.model.unwrap_or(by_rule) == FrictionModel::Faded).then_some(table.smooth_rad_s.unwrap_or(0.005))
}

/// Returns a problem if a fading speed is given for friction that holds.
fn no_fading(table: &FrictionTable) -> Option<Problem> {
    (table.model == Some(FrictionModel::Holds) && table.smooth_rad_s.is_some()).then(|| Problem {
        key: "friction.smooth_rad_s".into(),
        message: "friction that holds has no fading speed: leave it out, or take friction.model = \"faded\"".into(),
    })
}

/// Returns a problem for friction above the largest motor torque that needs too many solver steps per tick.
fn too_steep(table: &FrictionTable, limit_a: f64, truth: &Shaft, period_s: f64) -> Option<Problem> {
    let motor_n_m = (limit_a * truth.torque_n_m_per_a).abs();
    let (key, largest) = largest_friction(table);
    let smooth_rad_s = faded_below(table)?;
    let rate = largest / smooth_rad_s / truth.inertia_kg_m2;
    let most = 0.49 * solver::MAX_STEPS as f64 / period_s;
    let message = format!(
        "found {}, more than the largest motor torque of {} N m, and so steep about rest that the solver needs more \
         than {} steps in a tick: expected at most {}, a larger friction.smooth_rad_s, or friction.model = \"holds\"",
        shown(largest),
        shown(rounded(motor_n_m)),
        solver::MAX_STEPS,
        shown(rounded(0.99 * largest * most / rate))
    );
    (rate > most && largest >= motor_n_m).then_some(Problem { key: key.into(), message })
}

fn largest_friction(table: &FrictionTable) -> (&'static str, f64) {
    match table.static_n_m {
        Some(static_n_m) if static_n_m > table.coulomb_n_m => ("friction.static_n_m", static_n_m),
        _ => ("friction.coulomb_n_m", table.coulomb_n_m),
    }
}

/// Returns warnings for friction above the largest motor torque, and for less friction at rest than in motion.
fn friction_warnings(table: &FrictionTable, limit_a: f64, truth: &Shaft) -> Vec<String> {
    // Swapped phases make the torque constant negative.
    let largest_n_m = (limit_a * truth.torque_n_m_per_a).abs();
    let mut warnings = Vec::new();
    let (key, friction) = largest_friction(table);
    if friction >= largest_n_m {
        warnings.push(format!(
            "{key} = {} is as much as the largest motor torque, {} N m, or more: the shaft cannot leave rest",
            shown(friction),
            shown(rounded(largest_n_m))
        ));
    }
    if let Some(static_n_m) = table.static_n_m.filter(|it| *it < table.coulomb_n_m) {
        let [at_rest, moving] = [static_n_m, table.coulomb_n_m].map(shown);
        warnings.push(format!(
            "friction.static_n_m = {at_rest} is below friction.coulomb_n_m = {moving}, and friction just above rest is \
             at least as large as in motion: take friction.static_n_m = {moving}, or leave it out"
        ));
    }
    warnings
}

/// Returns a warning about a motor that no maker sells: a number in another unit.
fn implausible(key: &str, inertia_kg_m2: Option<f64>, torque_n_m_per_a: f64, limit_a: f64) -> Option<String> {
    // Largest acceleration of the motor alone, rad/s²: of a large direct drive, and of an ironless micro motor.
    const USUAL: Range<f64> = 0.5..3e6;
    let largest = torque_n_m_per_a.abs() * limit_a / inertia_kg_m2?;
    (largest > 0.0 && !USUAL.contains(&largest)).then(|| {
        format!(
            "the motor alone accelerates at up to {} rad/s^2, which no motor has: check the units of {key}, \
             torque_n_m_per_a and max_current_a, for example 1 g cm^2 = 1e-7 kg m^2 and 1 mN m/A = 1e-3 N m/A",
            shown(rounded(largest)),
        )
    })
}

fn resolved(
    common: &Common<'_>,
    encoders: &[Mounted],
    default_name: &str,
    problems: &mut Problems,
) -> Option<Resolved> {
    let Common { span_s, period_s, reference, .. } = *common;
    let name = problems.take(resolve::name(common.name, default_name));
    let title = problems.take(resolve::title(common.title.or(name.as_deref())));
    let periods = problems.take(resolve::periods(span_s, period_s));
    if let (Some(_), Some(window_s)) = (periods, common.window_s) {
        problems.take(resolve::window(Some(window_s), span_s, period_s));
    }
    let load = resolve::terms(common.load, "load", problems);
    let faults: Vec<_> = common
        .fault
        .iter()
        .enumerate()
        .map(|(k, table)| problems.take(fault(table, &format!("fault[{}]", k + 1), encoders.len(), period_s)))
        .collect();
    let from_rad = encoders.first().and_then(|mounted| start(*mounted, common.start_rad));
    let wanted =
        problems.take(motion(reference, common.mode, from_rad.unwrap_or(0.0), [period_s, span_s], encoders.len()));
    let reaction = problems.take(reaction(&common.monitor, period_s));
    problems.0.extend(common.limits.problems(common.start_rad, common.plant));
    if let (ModeKey::Speed, Some(_)) = (common.mode, common.limits.following_error_rad) {
        let message = "drive.mode = \"speed\" follows a speed and not a position: leave it out";
        problems.0.push(Problem { key: "limits.following_error_rad".into(), message: message.into() });
    }
    if let (ModeKey::Speed, Some(RestBandKey::Learns | RestBandKey::Fixed)) = (common.mode, common.rest_band) {
        let message = "drive.mode = \"speed\" follows a speed and not a position: leave it out";
        problems.0.push(Problem { key: "drive.rest_band".into(), message: message.into() });
    }
    problems.0.extend(common.unsolved_lag());
    problems.0.extend(common.late_counts());
    problems.0.extend(common.beyond_a_small_program());
    if let (Some(_), 1) = (common.monitor.motor_n_m, encoders.len()) {
        let message = "only for a joint: a motor has load_n_m";
        problems.0.push(Problem { key: "monitor.motor_n_m".into(), message: message.into() });
    }
    Some(Resolved {
        name: name?,
        title: title?,
        periods: periods?,
        load: Signal::new(load?),
        faults: faults.into_iter().collect::<Option<_>>()?,
        wanted: wanted?,
        reaction: reaction?,
    })
}

/// Returns the angle of the shaft by the first count.
fn start(mounted: Mounted, angle_rad: f64) -> Option<f64> {
    let states = mounted.encoder.counter() as f64;
    let count = f64::from(mounted.upright(mounted.count(angle_rad))?);
    Some((count - states * (count / states + 0.5).floor()) * mounted.encoder.unit_rad())
}

fn reaction(table: &MonitorTable, period_s: f64) -> Result<Reaction, Problem> {
    match (table.reaction, table.stop_s) {
        (ReactionKey::Tell, None) => Ok(Reaction::GoOn),
        (ReactionKey::Brake, None) => Ok(Reaction::Brake),
        (ReactionKey::Fallback, None) => Ok(Reaction::Fallback),
        (ReactionKey::JoinedStop, stop_s) => {
            let ticks = ticks_of(stop_s.unwrap_or(START_S), period_s).max(1);
            Ok(Reaction::JoinedStop { ticks })
        }
        (_, Some(_)) => problem("monitor.stop_s", "only for reaction = \"joined_stop\""),
    }
}

fn ticks_of(time_s: f64, period_s: f64) -> u32 {
    (time_s / period_s).round().min(f64::from(1 << 24)) as u32
}

impl Common<'_> {
    /// Returns a problem for a lag so short that it only costs solver steps.
    fn unsolved_lag(&self) -> Option<Problem> {
        let Self { lag_s, period_s, plant, .. } = *self;
        let message = format!(
            "found {}, less than a thousandth of the period: the loop behaves as with 0, and the solver would need \
             thousands of steps in a tick; write 0 for no lag",
            shown(lag_s)
        );
        let key = format!("{plant}.current_lag_s");
        (lag_s > 0.0 && lag_s < 1e-3 * period_s).then_some(Problem { key, message })
    }

    /// Returns a problem for a jitter above the period.
    fn late_counts(&self) -> Option<Problem> {
        let Self { jitter_s, period_s, .. } = *self;
        let message = format!(
            "found {}, expected at most {}, the period: jitter is the age of a count within its tick",
            shown(jitter_s),
            shown(period_s)
        );
        (jitter_s > period_s).then(|| Problem { key: "drive.jitter_s".into(), message })
    }

    /// Returns the errors between states and encoders: jitter, eccentricity and noise, in angles of the states.
    fn sensing(&self, encoders: &[(usize, Mounted)], order: usize) -> Sensing {
        let (mut off_centre, mut noise) = (Vec::new(), vec![0.0; order]);
        for ((state, mounted), table) in encoders.iter().zip(self.encoders) {
            noise[*state] = noise_of_shaft(mounted, table.noise_rad);
            if table.eccentricity_rad > 0.0 {
                let Encoder { gear_num, gear_den, .. } = mounted.encoder;
                let turns = f64::from(gear_num) / f64::from(gear_den);
                off_centre.push(OffCentre { channel: *state, turns, rad: table.eccentricity_rad });
            }
        }
        if noise.iter().all(|sigma| *sigma == 0.0) {
            noise.clear();
        }
        let jitter = self.jitter_s / self.period_s;
        Sensing { jitter, off_centre, noise, ..Sensing::IDEAL }
    }

    /// Returns warnings for times after the end of the run, for incompatible choices, and for load monitors far above
    /// the largest torque of the motor.
    fn warnings(&self, strongest_n_m: f64) -> Vec<String> {
        let Self { span_s, uncertain_percent, plant, .. } = *self;
        let mut warnings = Vec::new();
        let mut late = |key: String, at_s: Option<f64>, what: &str| {
            if let Some(at_s) = at_s.filter(|at_s| *at_s >= span_s) {
                let (at, span) = (shown(at_s), shown(span_s));
                warnings.push(format!("{key} = {at} is not before the end of the run, span_s = {span}: {what}"));
            }
        };
        for (k, fault) in self.fault.iter().enumerate() {
            late(format!("fault[{}].at_s", k + 1), fault.at_s, "the fault never occurs");
        }
        for (k, term) in self.load.iter().enumerate() {
            late(format!("load[{}].t0_s", k + 1), term.t0_s, "the load step never occurs");
        }
        late("reference.start_s".into(), self.reference.start_s, "the reference never moves");
        let is_wide = self.is_wide();
        if is_wide && self.observer_states > 3 && plant == "motor" {
            let said = if uncertain_percent > 20.0 {
                format!("drive.uncertain_percent = {}", shown(uncertain_percent))
            } else {
                "the range of its inertia".into()
            };
            warnings.push(format!(
                "drive.observer_states = 4 is for a motor known to 20 %, but {said} says more: take \
                     drive.observer_states = 3"
            ));
        }
        if is_wide && self.delay_ticks > 0 && plant == "joint" {
            warnings.push(format!(
                "with drive.delay_ticks = {} a joint is stable within 20 %, but drive.uncertain_percent = {} says \
                 more: some corners may oscillate between the current limits",
                self.delay_ticks,
                shown(uncertain_percent)
            ));
        }
        warnings.extend(wide_monitors(&self.monitor, strongest_n_m));
        warnings
    }

    /// Returns the keys whose values a small program has no types for.
    fn beyond_a_small_program(&self) -> Vec<Problem> {
        let beyond = [
            (self.delay_ticks > 1, "drive.delay_ticks", "this program has 0 or 1: for more take host-sim"),
            (self.mode == ModeKey::Speed, "drive.mode", "this program follows positions: for a speed take host-sim"),
        ];
        let found = beyond.into_iter().filter(|(is_beyond, ..)| cfg!(feature = "drives-only") && *is_beyond);
        found.map(|(_, key, message)| Problem { key: key.into(), message: message.into() }).collect()
    }

    /// Returns true if the tolerance is too wide for the high gains and for four observer states.
    fn is_wide(&self) -> bool {
        self.uncertain_percent.max(self.lighter_percent) > 20.0
    }

    /// Returns true for a joint with more than one tick of delay, whose high gains are not stable within 20 %.
    fn is_late_joint(&self) -> bool {
        self.plant == "joint" && self.delay_ticks > 1
    }

    /// Returns the alarm thresholds of the file for shafts with these inertias.
    fn monitors<const E: usize>(
        &self,
        reaction: Reaction,
        inertia_kg_m2: [f64; E],
        sudden_load_n_m: f64,
    ) -> Monitors<E> {
        let MonitorTable { load_n_m, motor_n_m, sigma_star, saturated_s, .. } = self.monitor;
        let torques = [load_n_m, motor_n_m];
        Monitors {
            uncertain: self.uncertain_percent.max(self.lighter_percent) / 100.0,
            disturbance: std::array::from_fn(|i| torques[i].map(|torque| torque / inertia_kg_m2[i])),
            sigma_star,
            stuck_ticks: saturated_s.map(|time_s| ticks_of(time_s, self.period_s)),
            sudden_load_n_m,
            reaction,
            fence: self.limits.fence(),
            rest_band: self.rest_band.unwrap_or_default().learning(),
        }
    }

    /// Returns the form of the law. By rule it has two gain sets if the tolerance allows the high gains.
    fn form(&self, gain_sets: Option<usize>) -> Form {
        Form {
            follows: if self.mode == ModeKey::Speed { Follows::Speed } else { Follows::Position },
            gain_sets: gain_sets.unwrap_or(if self.is_wide() || self.is_late_joint() { 1 } else { 2 }),
            delay_ticks: self.delay_ticks,
            observer_states: self.observer_states,
        }
    }
}

/// Part that a fault affects.
enum Broken {
    /// Fault of these encoders.
    Encoders(Fault, Range<usize>),
    /// Power stage limited to this current, A.
    Stage(f64),
    /// Missed control interrupt.
    Interrupt,
}

fn fault(table: &FaultTable, key: &str, encoders: usize, period_s: f64) -> Result<(Broken, Range<usize>), Problem> {
    let Some(kind) = table.kind else { return missing(&format!("{key}.kind"), "stuck, jump, lost, derated or missed") };
    let Some(at_s) = table.at_s else { return missing(&format!("{key}.at_s"), "the start of the fault, s") };
    let first = (at_s / period_s).round() as usize;
    let ticks = table.for_s.map_or(usize::MAX, |for_s| ((for_s / period_s).round() as usize).max(1));
    let ticks = first..first.saturating_add(ticks);
    match (kind, table.current_a) {
        (FaultKind::Derated, None) => {
            return missing(&format!("{key}.current_a"), "the largest current of the derated stage, A");
        }
        (FaultKind::Derated, Some(_)) if table.encoder.is_some() => {
            return problem(format!("{key}.encoder"), "not used by kind = \"derated\": leave it out");
        }
        (FaultKind::Derated, Some(most)) if table.counts.is_none() => return Ok((Broken::Stage(most), ticks)),
        (FaultKind::Derated, Some(_)) | (_, None) => {}
        (_, Some(_)) => return problem(format!("{key}.current_a"), "only for kind = \"derated\""),
    }
    if kind == FaultKind::Missed && (table.encoder, table.counts) == (None, None) {
        return Ok((Broken::Interrupt, ticks));
    }
    let fault = match (kind, table.counts) {
        (FaultKind::Stuck, None) => Fault::Stuck,
        (FaultKind::Lost, None) => Fault::Lost,
        (FaultKind::Jump, Some(counts)) => Fault::Jump { counts: f64::from(counts) },
        (FaultKind::Missed, None) => return problem(format!("{key}.encoder"), "not used by kind = \"missed\""),
        (FaultKind::Jump, None) => return missing(&format!("{key}.counts"), "the offset of the count"),
        (_, _) => return problem(format!("{key}.counts"), "only for kind = \"jump\""),
    };
    let channels = match (table.encoder, encoders) {
        (None, _) => 0..encoders,
        (Some(_), 1) => return problem(format!("{key}.encoder"), "a motor has one encoder: leave it out"),
        (Some(EncoderKey::Link), _) => 0..1,
        (Some(EncoderKey::Motor), _) => 1..2,
    };
    Ok((Broken::Encoders(fault, channels), ticks))
}

impl ReferenceKind {
    const fn word(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Move => "move",
            Self::Sine => "sine",
            Self::Points => "points",
            Self::SetPoints => "set_points",
            Self::Speed => "speed",
        }
    }
}

/// Converts a time to a whole number of ticks, 1 to `most`.
fn whole_ticks(time_s: f64, period_s: f64, most: u32, key: &str) -> Result<u32, Problem> {
    let ticks = time_s / period_s;
    if (ticks - ticks.round()).abs() > 1e-6 || ticks.round() < 1.0 || ticks.round() > f64::from(most) {
        let near = ticks.round().clamp(1.0, f64::from(most)) as u32;
        let [found, near, most] = [rounded(ticks), ticks_s(near, period_s), ticks_s(most, period_s)].map(shown);
        let message = format!(
            "found {found} ticks, expected a whole number of ticks, at most {most} s: the nearest is {key} = {near}"
        );
        return problem(key, message);
    }
    Ok(ticks.round() as u32)
}

/// Returns the goal of set-points that a profile follows.
fn set_points(table: &ReferenceTable, [period_s, span_s]: [f64; 2], encoders: usize) -> Result<Goal, Problem> {
    let angles_rad = table.points_rad.clone().unwrap_or_default();
    let every = match table.every_s {
        None if angles_rad.len() > 1 => {
            return missing("reference.every_s", "the time between two of points_rad, s");
        }
        every_s => whole_ticks(every_s.unwrap_or(period_s), period_s, MOST_EVERY, "reference.every_s")?,
    };
    let smooth_s = table.smooth_s.unwrap_or((SMOOTH_S / period_s).round().max(1.0) * period_s);
    let limits = ProfileLimits {
        speed_rad_s: table.max_speed_rad_s.unwrap_or(0.0),
        acceleration_rad_s2: table.max_acceleration_rad_s2.unwrap_or(0.0),
        window: whole_ticks(smooth_s, period_s, if encoders == 1 { 512 } else { 128 }, "reference.smooth_s")?,
    };
    if let Err(DriveError { field, given, low, high, why, .. }) = Profile::<f64, 2, 1024>::new(&limits, period_s) {
        let [given, low, high] = [given, up(low), down(high)].map(shown);
        return problem(format!("reference.max_{field}"), format!("found {given}, expected {low} to {high}: {why}"));
    }
    Ok(Goal::SetPoints { angles_rad, every, limits, until: ticks_of(span_s, period_s) })
}

fn motion(
    table: &ReferenceTable,
    mode: ModeKey,
    from_rad: f64,
    [period_s, span_s]: [f64; 2],
    encoders: usize,
) -> Result<PlanGoal, Problem> {
    let ReferenceTable { kind, to_rad, amplitude_rad, frequency_hz, ref points_rad, every_s, speed_rad_s, .. } = *table;
    let ReferenceTable { max_speed_rad_s, max_acceleration_rad_s2, .. } = *table;
    let needed: &[&str] = match kind {
        ReferenceKind::Rest => &[],
        ReferenceKind::Move => &["to_rad"],
        ReferenceKind::Sine => &["amplitude_rad", "frequency_hz"],
        ReferenceKind::Points => &["points_rad", "every_s"],
        ReferenceKind::SetPoints => &["points_rad", "max_speed_rad_s", "max_acceleration_rad_s2"],
        ReferenceKind::Speed => &["speed_rad_s"],
    };
    let given = [
        ("to_rad", to_rad.is_some()),
        ("amplitude_rad", amplitude_rad.is_some()),
        ("frequency_hz", frequency_hz.is_some()),
        ("points_rad", points_rad.is_some()),
        ("every_s", every_s.is_some()),
        ("speed_rad_s", speed_rad_s.is_some()),
        ("max_speed_rad_s", max_speed_rad_s.is_some()),
        ("max_acceleration_rad_s2", max_acceleration_rad_s2.is_some()),
        ("smooth_s", table.smooth_s.is_some()),
        ("start_s", table.start_s.is_some()),
        ("duration_s", table.duration_s.is_some()),
    ];
    for (name, is_given) in given {
        let key = format!("reference.{name}");
        let is_read = match name {
            "start_s" => kind != ReferenceKind::Rest,
            "duration_s" => !matches!(kind, ReferenceKind::Rest | ReferenceKind::SetPoints),
            "every_s" | "smooth_s" => kind == ReferenceKind::SetPoints,
            _ => false,
        };
        if is_given && !needed.contains(&name) && !is_read {
            let rest = "leave it out, or replace the table: --set 'reference={kind = \"rest\"}'";
            let remedy = if kind == ReferenceKind::Rest { format!(": {rest}") } else { String::new() };
            return problem(key, format!("reference.kind = {:?} does not read it{remedy}", kind.word()));
        }
        if !is_given && needed.contains(&name) {
            return missing(&key, &format!("reference.kind = {:?} needs it", kind.word()));
        }
    }
    if mode == ModeKey::Speed && kind != ReferenceKind::Speed {
        return problem(
            "reference.kind",
            "drive.mode = \"speed\" follows reference.kind = \"speed\" only: replace the table, as by --set \
             'reference={kind = \"speed\", speed_rad_s = 10.0}'",
        );
    }
    let ticks_of = |time_s: f64| ticks_of(time_s, period_s);
    let at_least = |time_s: f64| Some(ticks_of(time_s).max(1));
    let (goal, fewest) = match kind {
        ReferenceKind::Rest => (Goal::Rest { angle_rad: from_rad }, None),
        ReferenceKind::Move => (Goal::Rest { angle_rad: to_rad.unwrap_or(0.0) }, Some(1)),
        ReferenceKind::Sine => {
            let omega_rad_s = frequency_hz.unwrap_or(0.0) * std::f64::consts::TAU;
            if omega_rad_s * period_s > 0.5 {
                let most = shown((0.5 / std::f64::consts::TAU / period_s).floor());
                return problem("reference.frequency_hz", format!("expected at most {most} at this period"));
            }
            (Goal::Sine { amplitude_rad: amplitude_rad.unwrap_or(0.0), omega_rad_s }, at_least(START_S))
        }
        ReferenceKind::SetPoints => (set_points(table, [period_s, span_s], encoders)?, None),
        ReferenceKind::Points => {
            let angles_rad = points_rad.clone().unwrap_or_default();
            if angles_rad.len() < 2 {
                return problem("reference.points_rad", "expected at least 2 points; one point: kind = \"set_points\"");
            }
            // Six intervals follow the last point, after a start.
            let most = (1 << 30) / (angles_rad.len() as u32 + 6);
            let every = whole_ticks(every_s.unwrap_or(0.0), period_s, most, "reference.every_s")?;
            (Goal::Points { angles_rad, every }, at_least(START_S))
        }
        ReferenceKind::Speed => (Goal::Speed { speed_rad_s: speed_rad_s.unwrap_or(0.0) }, Some(1)),
    };
    let start = ticks_of(table.start_s.unwrap_or(0.0));
    let ticks = table.duration_s.map_or(1, |duration_s| ticks_of(duration_s).max(1));
    let fewest = fewest.filter(|_| table.duration_s.is_none());
    Ok(PlanGoal { motion: Motion { goal, start, ticks, ..Motion::rest(from_rad, period_s) }, fewest })
}

/// Returns a required number of the data sheet, and reports it if it is missing.
fn needed(value: Option<f64>, key: &str, what: &str, problems: &mut Problems) -> f64 {
    problems.take(value.map_or_else(|| missing(key, what), Ok)).unwrap_or(1.0)
}

/// Returns the bits of a counter, and its number of states unless that is a power of two, else 0.
fn counter(table: &EncoderTable, key: &str) -> Result<(u32, u32), Problem> {
    let problem = |name: &str, message: String| Err(Problem { key: format!("{key}.{name}"), message });
    let Some(states) = table.states else {
        let Some(bits) = table.bits else { return missing(&format!("{key}.bits"), "the bits of the counter") };
        let all = 1_u64 << bits;
        return match table.counts_per_turn {
            Some(counts) if is_ambiguous(counts, all) => problem(
                "states",
                format!(
                    "missing: does the counter wrap after {counts} counts (a timer with a reload of {}, an absolute \
                     encoder of {counts} positions) or after 2^{bits} = {all}? Set {key}.states = {counts} or \
                     {key}.states = {all}",
                    counts - 1
                ),
            ),
            _ => Ok((bits, 0)),
        };
    };
    let least = (2..32).find(|bits| 1_u64 << bits >= states).unwrap_or(32);
    let bits = table.bits.unwrap_or(least);
    if bits < least {
        return problem("states", format!("{states} states need a counter of {least} bits, but bits = {bits}"));
    }
    if states.is_power_of_two() {
        return Ok((least, 0));
    }
    match i32::try_from(states) {
        Ok(_) if table.counts_per_turn.is_none() => problem(
            "counts_per_turn",
            format!(
                "missing: a counter of {states} states does not wrap after 2^bits; set {key}.counts_per_turn = \
                 {states} if it wraps once per revolution"
            ),
        ),
        Ok(states) => Ok((bits, states as u32)),
        Err(_) => {
            problem("states", format!("found {states}: any number up to 2^31 is supported, and 2^32 = 4294967296"))
        }
    }
}

/// Returns true if the counter may also wrap after one revolution. A counter of 64 revolutions or more does not: a
/// timer with a reload counts encoder lines, and not some hundred Hall sensor steps.
fn is_ambiguous(counts_per_turn: u32, all: u64) -> bool {
    let turn = u64::from(counts_per_turn);
    turn < all && 64 * turn > all && !counts_per_turn.is_power_of_two()
}

/// Returns a warning if the number of states is not given, and a revolution has fewer counts than the counter.
fn asked_states(table: &EncoderTable, key: &str) -> Option<String> {
    let (bits, counts) = (table.bits?, table.counts_per_turn?);
    let all = 1_u64 << bits;
    (table.states.is_none() && u64::from(counts) < all).then(|| {
        format!(
            "{key}.states is not given: the counter is assumed to wrap after 2^{bits}; if it wraps after {counts} (a \
             reload of {}) set {key}.states = {counts}, else {key}.states = {all}",
            counts - 1
        )
    })
}

/// Returns the encoder with its gear to the output shaft.
fn mounted(
    table: &EncoderTable,
    (gear, plant): (Gear, &'static str),
    start_rad: f64,
    key: &'static str,
    problems: &mut Problems,
) -> Mounted {
    let width = problems.take(counter(table, key));
    let (bits, states) = width.unwrap_or((14, 0));
    let counts = table.counts_per_turn.map_or_else(
        || match bits {
            ..=24 => Ok(1 << bits),
            _ => missing(&format!("{key}.counts_per_turn"), "required if the counter has over 24 bits"),
        },
        Ok,
    );
    let counts = problems.take(counts);
    let gear = if table.behind_gear { Gear::NONE } else { gear };
    let bare = Encoder::incremental(bits, counts.unwrap_or(4096)).wrapping_at(states);
    // A counter with errors is not checked further.
    let is_known = width.is_some() && counts.is_some();
    let geared = is_known.then(|| Geared { table, key, plant, gear, bare }.encoder());
    let encoder = geared.and_then(|geared| problems.take(geared)).unwrap_or(bare);
    let half_span = half_span_rad(&bare, gear.ratio());
    if is_known && start_rad.abs() >= half_span {
        let message = format!(
            "the run starts at {start_rad:.4} rad, but the counter of {} states covers only {half_span:.4} rad on each \
             side of 0, so the drive would start a whole counter range off: start nearer to 0",
            encoder.counter()
        );
        problems.0.push(Problem { key: key.into(), message });
    }
    Mounted { encoder, mounting: Mounting { is_reversed: table.reversed, offset_counts: table.offset_counts } }
}

/// Returns the angle behind the gear that a counter before it covers on each side of 0, rad.
fn half_span_rad(bare: &Encoder, ratio: f64) -> f64 {
    0.5 * bare.counter() as f64 * bare.unit_rad() / ratio
}

/// Returns a warning for a motor counter of a joint that covers less than a revolution of the link: at another angle
/// the two encoders contradict each other.
fn starts_near_zero(table: &EncoderTable, gear: Gear) -> Option<String> {
    let (bits, states) = counter(table, "encoder.motor").ok()?;
    let bare = Encoder::incremental(bits, table.counts_per_turn.unwrap_or(1 << bits.min(24))).wrapping_at(states);
    let ratio = if table.behind_gear { 1.0 } else { gear.ratio() };
    let half_span = half_span_rad(&bare, ratio);
    (half_span < 0.999 * std::f64::consts::PI).then(|| {
        let whole = (f64::from(bare.counts_per_turn) * ratio).ceil();
        let remedy = if whole <= u32::MAX.into() {
            format!(
                "Count the motor revolutions in firmware, and set encoder.motor.states = {whole} with \
                 encoder.motor.bits = {} with encoder.motor.counts_per_turn = {}",
                bits.max(libm::log2(whole).ceil() as u32),
                bare.counts_per_turn
            )
        } else {
            "Start there".into()
        };
        format!(
            "encoder.motor: {} states cover {half_span:.4} rad of the link on each side of 0. The drive starts and \
             restarts only there, elsewhere it waits without current. {remedy}",
            bare.counter()
        )
    })
}

fn imperfections(table: &FrictionTable, lag_s: f64, gear: f64, supply: Option<Supply>) -> Imperfections {
    Imperfections {
        friction: Friction {
            static_n_m: table.static_n_m.unwrap_or(table.coulomb_n_m),
            coulomb_n_m: table.coulomb_n_m,
            stribeck_rad_s: table.stribeck_rad_s,
            smooth_rad_s: faded_below(table).unwrap_or(0.0),
        },
        cogging_n_m: table.cogging_n_m,
        cogging_per_turn: table.cogging_per_turn * gear,
        ripple: table.ripple_percent / 100.0,
        ripple_per_turn: table.ripple_per_turn * gear,
        lag_s,
        supply,
    }
}

fn fallback(key: FallbackKey) -> Fallback {
    match key {
        FallbackKey::Word(FallbackWord::Hold) => Fallback::HoldLast,
        FallbackKey::Safe(u) => Fallback::Safe(u),
    }
}

/// Returns the longest period below this one with a valid design, s, in three digits.
fn longest_period(from_s: f64, has_design: impl Fn(f64) -> bool) -> Option<f64> {
    let shorter = (1..200).map(|k| from_s * 0.97_f64.powi(k));
    let mut good_s = shorter.take_while(|it| *it >= PERIODS_S[0]).find(|it| has_design(*it))?;
    let mut bad_s = good_s / 0.97;
    for _ in 0..20 {
        let middle_s = 0.5 * (good_s + bad_s);
        if has_design(middle_s) { good_s = middle_s } else { bad_s = middle_s }
    }
    // Rounded down: half a unit of the last digit less.
    let down = |period_s: f64| -> Option<f64> {
        let unit = libm::pow(10.0, libm::log10(period_s).floor() - 2.0);
        format!("{:.2e}", period_s - 0.499 * unit).parse().ok()
    };
    down(good_s).filter(|period_s| has_design(*period_s)).or(Some(good_s))
}

/// Translates an error of the design to a key of the file. `is_given`: the file sets a bandwidth. The second period is
/// the longest with a valid design.
fn design_problem(
    error: &DriveError,
    plant: &str,
    is_given: bool,
    (period_s, longest_s): (f64, Option<f64>),
) -> Problem {
    // The numbers may be products of typed ones, so six digits are enough.
    let short = |number: f64| shown(format!("{number:.5e}").parse().unwrap_or(number));
    let [given, low, high] = [error.given, error.low, error.high].map(short);
    let is_by_rule = plant == "motor" && !is_given;
    if error.field.starts_with("gate_steps") || (is_by_rule && error.field.starts_with("bandwidths.")) {
        let (of, remedy) = if is_given {
            ("with these bandwidths", "lower those of [drive], or leave them out, so that the rule sets them")
        } else {
            ("for these numbers", "check inertia, torque constant and current for a wrong power of ten")
        };
        return Problem { key: plant.into(), message: format!("no design is possible {of} ({}): {remedy}", error.why) };
    }
    let key = match error.field {
        "encoders[0]" => "encoder.link".into(),
        "encoders[1]" => "encoder.motor".into(),
        "encoder" => "encoder".into(),
        field if field.starts_with("motor.") || field.starts_with("joint.") => field.into(),
        "bandwidths.offset_per_s" if is_given => "drive.surface_rad_s".into(),
        field if field.starts_with("bandwidths.") && is_given => field.replace("bandwidths", "drive"),
        field if field.starts_with("bandwidths.") => "drive.period_s".into(),
        "fast_ratios[0]" | "fast_ratios[1]" => "drive.fast_ratios".into(),
        field if field.starts_with("limits") => format!("{plant}.max_current_a"),
        field => format!("drive.{}", field.split(['[', '.']).next().unwrap_or(field)),
    };
    let why = match error.why {
        why if why.ends_with("must be above 0") && error.given > 0.0 => "outside the supported range",
        why => why,
    };
    if error.field.starts_with("bandwidths.") {
        let message = bandwidth_problem(error, &key, (period_s, longest_s));
        return Problem { key, message };
    }
    // The number of a damping is its product with the period over the inertia.
    let found = if error.field.contains("damping") { "found a product of" } else { "given" };
    Problem { key, message: format!("{why} ({found} {given}, allowed {low} to {high})") }
}

/// Returns the message for a bandwidth that the period does not allow, with limits in the unit of the key. The design
/// itself checks products with the period.
fn bandwidth_problem(error: &DriveError, key: &str, (period_s, longest_s): (f64, Option<f64>)) -> String {
    let (why, is_too_high) = (error.why, error.given > error.high);
    let shorter = longest_s.map(|it| format!("drive.period_s = {} or less", shown(it)));
    if key == "drive.period_s" {
        let too = if is_too_high || error.low > error.high { "long" } else { "short" };
        let remedy = shorter.map_or_else(String::new, |it| format!(": take {it}"));
        return format!("found {}, too {too} for the bandwidths of this design ({why}){remedy}", shown(period_s));
    }
    // The decay rate of the offset follows from the bandwidth of the key.
    let (stated, remedy) = if error.field == "bandwidths.offset_per_s" {
        let too = if is_too_high { "high" } else { "low" };
        (format!("too {too} at period_s = {}", shown(period_s)), None)
    } else {
        let by = if why.contains("period") { period_s } else { 1.0 };
        let unit = if key.ends_with("_rad_s") { "rad/s" } else { "1/s" };
        let given = digits(6, error.given / by, f64::round);
        let [least, most] = [digits(5, error.low / by, f64::ceil), digits(5, error.high / by, f64::floor)];
        let limits = match () {
            () if error.low > error.high => format!("at least {least} and at most {most} {unit}, so no value fits"),
            () if is_too_high => format!("at most {most} {unit}"),
            () => format!("at least {least} {unit}"),
        };
        let stated = format!("{given} {unit}, must be {limits} at period_s = {}", shown(period_s));
        // Other bandwidths follow from this one, so its limit alone is not always a remedy.
        let is_alone = ["drive.observer_rad_s", "drive.motor_rad_s"].contains(&key);
        let is_possible = is_alone && is_too_high && error.high >= error.low;
        (stated, is_possible.then(|| format!("take {key} = {most}")))
    };
    let own = remedy.unwrap_or_else(|| if is_too_high { "lower it".into() } else { "raise it".into() });
    let own = Some(own).filter(|_| error.low <= error.high);
    let remedies: Vec<String> = own.into_iter().chain(shorter.map(|it| format!("take {it}"))).collect();
    let before = if remedies.is_empty() { "" } else { ": " };
    format!("{stated} ({why}){before}{}", remedies.join(", or "))
}

/// Returns the first digits of a positive number, rounded by `round`.
fn digits(count: i32, number: f64, round: fn(f64) -> f64) -> String {
    // Within these powers of ten the unit of the last digit is a normal number.
    if !(1e-290..1e290).contains(&number) {
        return shown(number);
    }
    let unit = 10_f64.powi(libm::log10(number).floor() as i32 + 1 - count);
    let whole = number / unit;
    // A quotient that is a whole number but for its rounding is one.
    let whole = if (whole - whole.round()).abs() < 1e-6 { whole.round() } else { round(whole) };
    shown(format!("{:.5e}", whole * unit).parse().unwrap_or(number))
}

/// Converts the noise of an encoder to the output side of the gear.
fn noise_of_shaft(Mounted { encoder, .. }: &Mounted, noise_rad: f64) -> f64 {
    noise_rad * f64::from(encoder.gear_den) / f64::from(encoder.gear_num)
}

/// Smallest innovation gate, in standard deviations of the encoder noise. Measured: with a gate of 4.3 deviations 700
/// of 16 000 counts were lost, with 8.6 none.
const NOISE_OF_GATE: f64 = 6.0;

fn true_to(nominal: f64, percent: f64) -> f64 {
    nominal * (1.0 + percent / 100.0)
}

/// Returns the torque constant, negative if two phases are swapped.
fn turned(torque_n_m_per_a: f64, is_reversed: bool) -> f64 {
    if is_reversed { -torque_n_m_per_a } else { torque_n_m_per_a }
}

/// Drive of one kind with everything that a run needs.
struct Parts<'a, D, const E: usize> {
    resolved: Resolved,
    form: Form,
    mounted: [Mounted; E],
    monitors: Monitors<E>,
    /// Returns the design for a period.
    design: &'a dyn Fn(f64) -> D,
    of_kind: fn(DriveOf<D, E>) -> DriveDesign,
    margin: MotorMargin,
    coupled: (Option<CoupledBy>, Option<JointRule>),
    /// True if the file sets a bandwidth.
    is_given: bool,
    top_speed: Option<TopSpeed>,
    is_slowed_by_play: bool,
    planned: Planned,
    warnings: Vec<String>,
    chosen: Vec<String>,
    shafts: Vec<ShaftOf>,
    states: &'static [StateName],
    x0: Vec<f64>,
    plant: Box<dyn Plant>,
    /// State that the encoder measures, if it is not the state of the controller's model.
    measured: Option<usize>,
    /// Plant without friction and load, and the true inertia of the shaft that a load acts on, kg m².
    smooth: (Box<dyn Plant>, f64),
    corners: Vec<Corner>,
    inertia_range: Option<InertiaRange>,
}

/// Returns the corners of the parameter box: each of these parameters deviates by +percent or -percent.
fn corners<const N: usize>(percent: f64, names: [&str; N], plant: impl Fn([f64; N]) -> Box<dyn Plant>) -> Vec<Corner> {
    let count = if percent > 0.0 { 1_u32 << N } else { 0 };
    let corner = |corner: u32| {
        let signs: [f64; N] = std::array::from_fn(|i| if corner >> i & 1 == 1 { percent } else { -percent });
        let words: Vec<String> =
            names.iter().zip(signs).map(|(name, percent)| format!("{name} {percent:+} %")).collect();
        Corner { name: words.join(", "), plant: plant(signs.map(|percent| 1.0 + percent / 100.0)) }
    };
    (0..count).map(corner).collect()
}

/// Returns the plants of a range of inertia, each with the nominal K_t and with both ends of its tolerance.
fn inertia_range(inertia: &Inertia, percent: f64, believed: Shaft, lag: Imperfections) -> Option<InertiaRange> {
    let torques = if percent > 0.0 { vec![0.0, -percent, percent] } else { vec![0.0] };
    let plants = move |inertia_kg_m2: f64| {
        let plant = |percent: &f64| {
            let torque_n_m_per_a = (1.0 + percent / 100.0) * believed.torque_n_m_per_a;
            let shaft = Shaft { inertia_kg_m2, torque_n_m_per_a, ..believed };
            let off = if *percent == 0.0 { String::new() } else { format!(", K_t {percent:+} %") };
            let name = format!("J {} kg m^2{off}", shown(rounded(inertia_kg_m2)));
            Corner { name, plant: Box::new(plant::Motor::new(shaft, believed, lag, Signal::default())) }
        };
        torques.iter().map(plant).collect()
    };
    let ends_kg_m2 = inertia.range()?;
    Some(InertiaRange { ends_kg_m2, designed_for_kg_m2: inertia.kg_m2, plants: Box::new(plants) })
}

/// Returns the quantisation and noise of each encoder.
fn sensed(mounted: &[(usize, Mounted)], shafts: &[ShaftOf], sensing: &Sensing) -> Vec<Sensed> {
    let each = mounted.iter().zip(shafts).map(|((state, mounted), shaft)| {
        let quantum = mounted.encoder.unit_rad();
        let (step, noise) = (quantum / f64::sqrt(12.0), sensing.noise.get(*state).copied().unwrap_or(0.0));
        let rms = if noise > 0.0 { (step * step + noise * noise).sqrt() } else { step };
        Sensed { state: *state, name: shaft.name.into(), unit: "rad", rms, noise, quantum }
    });
    each.collect()
}

/// Returns warnings for encoders whose noise exceeds the innovation gate.
fn beyond_gates(designed: &DriveDesign, shafts: &[ShaftOf], sensing: &Sensing) -> Vec<String> {
    let gates = designed.gate_steps();
    let each =
        designed.encoders().into_iter().zip(gates.into_iter().zip(shafts)).filter_map(|(encoder, (gate, shaft))| {
            let (state, mounted) = encoder;
            let steps = sensing.noise.get(state).copied().unwrap_or(0.0) / mounted.encoder.unit_rad();
            (NOISE_OF_GATE * steps > gate).then(|| {
                format!(
                    "the noise of the {}'s encoder is {} counts rms, and the innovation gate rejects counts {} from \
                 the prediction: valid counts will be lost",
                    shaft.name,
                    shown(steps),
                    shown(gate)
                )
            })
        });
    each.chain(noisy_start(designed, sensing)).collect()
}

/// Returns a warning if noise can spoil the first speed estimate of a motor. The estimate comes from the first counts.
/// The limit is the speed that the current can cancel in a time constant of the observer.
fn noisy_start(designed: &DriveDesign, sensing: &Sensing) -> Option<String> {
    let DriveDesign::Motor(DriveOf { design, .. }) = designed else { return None };
    let noise_rad = sensing.noise.first().copied().unwrap_or(0.0);
    let seen_rad_s = f64::sqrt(2.0) * noise_rad / design.period_s;
    let taken_back_rad_s = design.limits.max * design.motor.input_gain().abs() / design.bandwidths.observer_rad_s;
    (seen_rad_s > taken_back_rad_s).then(|| {
        format!(
            "encoder noise of {} rad: the first speed estimate may be {} rad/s off, which saturates the current; \
             reduce the noise, or take drive.period_s above {}",
            shown(rounded(noise_rad)),
            shown(rounded(seen_rad_s)),
            shown(rounded(design.period_s * seen_rad_s / taken_back_rad_s))
        )
    })
}

/// Returns a problem if the link encoder is declared as behind the gear.
fn on_link(table: &EncoderTable) -> Option<Problem> {
    let message = "the encoder on the link is always behind the gear: leave it out";
    table.behind_gear.then(|| Problem { key: "encoder.link.behind_gear".into(), message: message.into() })
}

/// Returns warnings for shafts that move too far per tick for their counter.
fn beyond_counters(mounted: &[(usize, Mounted)], moved_rad: f64) -> impl Iterator<Item = String> {
    mounted.iter().filter_map(move |(_, Mounted { encoder, .. })| {
        let counter_rad = encoder.counter() as f64 * encoder.unit_rad();
        (moved_rad > 0.4 * counter_rad).then(|| {
            format!(
                "a counter of {} states covers {counter_rad:.3} rad, and the shaft moves {moved_rad:.3} rad in a tick: \
                 the direction is ambiguous",
                encoder.counter()
            )
        })
    })
}

/// Returns the linearised loop at rest.
fn at_rest(
    law: Box<dyn LawAtRest>,
    (plant, loaded_inertia_kg_m2): (Box<dyn Plant>, f64),
    (corners, inertia_range): (Vec<Corner>, Option<InertiaRange>),
    sensed: Vec<Sensed>,
    form: Form,
    sensing: &Sensing,
) -> AtRest {
    let parts = [
        ("friction, cogging and load", true),
        ("the switching of the gain sets", form.gain_sets > 1),
        ("angles other than 0", sensed.len() > 1),
        ("jitter", sensing.jitter > 0.0),
    ];
    AtRest {
        plant,
        loaded_inertia_kg_m2: Some(loaded_inertia_kg_m2),
        law,
        sensed,
        sensor_delay_ticks: 0,
        actuator_delay_ticks: form.delay_ticks,
        report: true,
        left_out: parts.into_iter().filter(|(_, is_left_out)| *is_left_out).map(|(part, _)| part).collect(),
        corners,
        inertia_range,
    }
}

/// Returns a warning if the rest band can exceed the following error.
fn within_the_band(designed: &DriveDesign, following_error_rad: Option<f64>) -> Option<String> {
    let [_, _, most, ..] = designed.rest_band()?.thresholds();
    let following_rad = following_error_rad?;
    (following_rad < f64::from(most)).then(|| {
        format!(
            "limits.following_error_rad = {} is less than the {} rad that the rest band may widen to, so a motor that \
             hunts in friction raises this alarm: take a larger value, or drive.rest_band = \"fixed\"",
            shown(following_rad),
            shown(rounded(most.into()))
        )
    })
}

/// Returns the drive with finer encoders, for the current noise. `None` if an encoder has a fault.
fn twin(
    designed: &DriveDesign,
    motion: &Motion,
    sensing: &Sensing,
    sensed: &[Sensed],
    has_faults: bool,
    measured: Option<usize>,
) -> Option<Twin> {
    let noise_steps = |sensed: &Sensed| sensing.noise.get(sensed.state).map_or(0.0, |noise| noise / sensed.quantum);
    let noise_steps = sensed.iter().map(noise_steps).fold(f64::INFINITY, f64::min);
    // Without a rest band, which depends on the resolution.
    let designed = designed.without_rest_band();
    let finer = Finer::of(&designed);
    let other = finer.map_or(designed, |finer| finer.designed);
    // With the same eccentricity.
    let magnets = Sensing { off_centre: sensing.off_centre.clone(), ..Sensing::IDEAL };
    // With play the encoder reads another shaft than the law controls.
    let encoders = other.encoders().into_iter().map(|(state, it)| (measured.unwrap_or(state), it)).collect();
    other.port(motion).ok().filter(|_| !has_faults).map(|port| Twin {
        sensor: Box::new(Encoders::over(magnets.sensor(0), encoders)),
        port,
        share: finer.map(|finer| finer.share(noise_steps)),
    })
}

/// Window and band of the metrics.
struct Judged {
    begins_s: f64,
    window_s: [f64; 2],
    settling_band: f64,
    output_unit: &'static str,
}

/// Returns window and band of the file, or by rule: from the end of the transition, for a move from its start.
fn judged(common: &Common<'_>, motion: &Motion, follows: Follows) -> Judged {
    let Common { span_s, period_s, .. } = *common;
    let [begins_s, reached_s] = [motion.start, motion.start + motion.ticks].map(|tick| f64::from(tick) * period_s);
    let from = if matches!(motion.goal, Goal::Rest { .. }) { begins_s } else { reached_s };
    let (output_unit, band) = match (follows, &motion.goal) {
        (Follows::Speed, Goal::Speed { speed_rad_s }) => ("rad/s", (0.02 * speed_rad_s.abs()).max(1e-6)),
        _ => ("rad", 0.005),
    };
    Judged {
        begins_s,
        window_s: common.window_s.unwrap_or(if from < span_s { [from, span_s] } else { [0.0, span_s] }),
        settling_band: common.settling_band.unwrap_or(band),
        output_unit,
    }
}

/// Builds the experiment of a drive.
///
/// # Errors
/// Returns the error of the design.
fn experiment<D: Copy, const E: usize>(
    common: &Common<'_>,
    parts: Parts<'_, D, E>,
) -> Result<Experiment, Vec<Problem>> {
    let Parts { resolved, form, mounted, monitors, planned, mut warnings, shafts, plant, mut x0, .. } = parts;
    let Planned { motion, speed_rad_s } = planned;
    let Common { span_s, period_s, max_current_a, .. } = *common;
    let drive = |period_s| (parts.of_kind)(DriveOf { design: (parts.design)(period_s), form, mounted, monitors });
    let refused = |error: DriveError| {
        let longest_s = longest_period(period_s, |period_s| drive(period_s).at_rest().is_ok());
        vec![design_problem(&error, common.plant, parts.is_given, (period_s, longest_s))]
    };
    let designed = drive(period_s);
    let port = designed.port(&motion).map_err(refused)?;
    let DriveAtRest { law, sigma_star_bound } = designed.at_rest().map_err(refused)?;

    let Resolved { name, title, periods, faults, .. } = resolved;
    let mounted = designed.encoders();
    x0.resize(plant.order(), 0.0);
    warnings.extend(beyond_counters(&mounted, period_s * speed_rad_s));
    let has_faults = !faults.is_empty();
    let sensing = common.sensing(&mounted, plant.order());
    warnings.extend(beyond_gates(&designed, &shafts, &sensing));
    warnings.extend(within_the_band(&designed, common.limits.following_error_rad));
    let sensed = sensed(&mounted, &shafts, &sensing);
    let twin = twin(&designed, &motion, &sensing, &sensed, has_faults, parts.measured);
    let at_rest = at_rest(law, parts.smooth, (parts.corners, parts.inertia_range), sensed, form, &sensing);
    let measured: Vec<_> = mounted.iter().map(|(state, it)| (parts.measured.unwrap_or(*state), *it)).collect();
    let on_the_plant = common.sensing(&measured, plant.order());
    let sensor: Box<dyn Sensor> = Box::new(Encoders::over(on_the_plant.sensor(common.seed), measured));
    let stage: Box<dyn Actuator> = Box::new(actuator::Ideal);
    let mut missed = Vec::new();
    let (sensor, stage) = faults.into_iter().fold((sensor, stage), |(sensor, stage), (broken, ticks)| match broken {
        Broken::Encoders(fault, channels) => (Box::new(Faulty::new(sensor, fault, channels, ticks)) as Box<_>, stage),
        Broken::Stage(most) => (sensor, Box::new(actuator::Derated::new(stage, most, ticks)) as Box<_>),
        Broken::Interrupt => {
            missed.push(ticks);
            (sensor, stage)
        }
    });
    let held = actuator::Delayed::new(stage, form.delay_ticks);
    let Judged { begins_s, window_s, settling_band, output_unit } = judged(common, &motion, form.follows);
    let drive = Drive {
        chosen: parts.chosen,
        max_current_a,
        shafts,
        states: parts.states,
        begins_s,
        designed,
        motion,
        current_lag_s: common.lag_s,
        margin: parts.margin,
        coupled: parts.coupled.0,
        joint_rule: parts.coupled.1,
        top_speed: parts.top_speed,
        is_slowed_by_play: parts.is_slowed_by_play,
        accepts_unstable: common.accepts_unstable,
        sigma_star_bound,
        twin,
    };
    Ok(Experiment {
        name,
        title,
        span_s,
        period_s,
        periods,
        window_s,
        settling_band,
        output_unit,
        control_unit: "A",
        x0,
        plant,
        sensor,
        actuator: Box::new(actuator::Limited::new(held, -max_current_a, max_current_a)),
        port,
        spec: None,
        download: None,
        figures_only: None,
        report: true,
        missed,
        warnings,
        mu: Vec::new(),
        drive: Some(drive),
        at_rest: Ok(at_rest),
        controller: format!("drive in f32, {}", ["1 gain set", "2 gain sets"][usize::from(form.gain_sets > 1)]),
        sensing: None,
    })
}

/// Collects the keys that motor and joint have in common.
macro_rules! common {
    ($file:ident, $sheet:ident, $drive:ident, $problems:ident, $limit:ident, $($own:tt)*) => {
        Common {
            name: $file.name.as_deref(),
            title: $file.title.as_deref(),
            span_s: $file.span_s,
            window_s: $file.window_s,
            settling_band: $file.settling_band,
            reference: &$file.reference,
            load: &$file.load,
            fault: &$file.fault,
            monitor: $file.monitor,
            limits: $file.limits,
            uncertain_percent: $drive.uncertain_percent,
            accepts_unstable: $drive.accept_unstable,
            period_s: period($drive.period_s, &mut $problems),
            max_current_a: $limit,
            start_rad: $sheet.start_rad,
            lag_s: $sheet.current_lag_s,
            delay_ticks: $drive.delay_ticks,
            jitter_s: $drive.jitter_s,
            seed: $file.seed,
            $($own)*
        }
    };
}

/// Builds the experiment of a motor. For an incomplete file only the rules are checked, without a design.
///
/// # Errors
/// Returns all broken rules, or the error of the design.
pub(crate) fn motor(file: &MotorScenario, default_name: &str, is_whole: bool) -> Result<Experiment, Vec<Problem>> {
    let mut problems = Problems::default();
    let (sheet, drive) = (&file.motor, &file.drive);
    let (turns, gear) = (Gear::of(sheet.gear), Gear::of(sheet.gear).ratio());
    let inertia = Inertia::of(sheet, gear, drive, &mut problems);
    problems.0.extend(too_uncertain(drive.uncertain_percent, Some((&inertia, sheet, gear))));
    let play = Play::of(sheet, (gear, drive.period_s), file.encoder.behind_gear, &mut problems);
    let torque = needed(sheet.torque_n_m_per_a, "motor.torque_n_m_per_a", "the torque constant", &mut problems);
    let limit = needed(sheet.max_current_a, "motor.max_current_a", "the current limit", &mut problems);
    let keys = Keys { plant: "motor", volt: sheet.supply_v, ohm: sheet.resistance_ohm, no_load: sheet.no_load_rad_s };
    let supply = problems.take(keys.supply(torque, limit)).flatten();
    let mounted = mounted(&file.encoder, (turns, "motor"), sheet.start_rad, "encoder", &mut problems);
    let common = common! {
        file, sheet, drive, problems, limit,
        mode: drive.mode,
        lighter_percent: inertia.lighter_percent(),
        observer_states: drive.observer_states,
        rest_band: drive.rest_band,
        encoders: &[&file.encoder],
        plant: "motor",
    };
    let nominal = motor_sheet(sheet, gear, inertia.kg_m2, torque);
    let (believed, truth) = shafts(&nominal, &file.error);
    problems.0.extend(no_fading(&file.friction));
    problems.0.extend(too_steep(&file.friction, limit, &truth, common.period_s));
    let resolved = resolved(&common, &[mounted], default_name, &mut problems);
    let Some(mut resolved) = resolved.filter(|_| is_whole && problems.0.is_empty()) else { return Err(problems.0) };

    let form = common.form(drive.gain_sets.or_else(|| Play::gain_sets(play.as_ref())));
    let lag = Imperfections { lag_s: sheet.current_lag_s, ..Imperfections::default() };
    let monitors = common.monitors(resolved.reaction, [nominal.inertia_kg_m2], 0.0);
    let drive_of =
        &|design: &MotorDesign| DriveDesign::Motor(DriveOf { design: *design, form, mounted: [mounted], monitors });
    let peak = |design: &MotorDesign| margin::motor_peak(&drive_of(design), believed, lag);
    let is_given = [drive.surface_rad_s, drive.observer_rad_s, drive.reaching_per_s].iter().any(Option::is_some);
    let with = |drive: &MotorDriveTable, gain_sets: usize| {
        motor_design(drive, sheet, nominal, (mounted, file.encoder.noise_rad, limit), gain_sets, &peak)
    };
    let by_rule = |period_s: f64| with(&MotorDriveTable { period_s, ..drive.clone() }, form.gain_sets);
    let others = &play.iter().flat_map(|_| calmer(drive, form.gain_sets, &with)).collect::<Vec<_>>();
    let play = play.as_ref();
    let in_play = InPlay { play, follows: form.follows, is_given, drive_of, shaft: believed, lag, others };
    let design = |period_s: f64| inertia.with_gate(in_play.slowed(by_rule(period_s)));
    let present = by_rule(common.period_s);
    let mut warnings = common.warnings(limit * nominal.torque_n_m_per_a);
    warnings.extend(in_play.warning(&present));
    warnings.extend(asked_states(&file.encoder, "encoder"));
    let rotor = sheet.inertia_kg_m2.map(NumberOrRange::middle);
    warnings.extend(implausible("motor.inertia_kg_m2", rotor, torque, limit));
    warnings.extend(friction_warnings(&file.friction, limit, &truth));
    let (periods, uncertain_percent) = (resolved.periods, drive.uncertain_percent);
    let asked = PlanLimits {
        plant: "motor",
        max_current_a: limit,
        uncertain_percent,
        inertia,
        supply,
        supply_of: &|max_current_a| keys.supply(torque, max_current_a).ok().flatten(),
        torque_n_m_per_a: nominal.torque_n_m_per_a,
        gear,
        feed_forward: &|jet| nominal.feed_forward(jet),
        speed: &|[_, speed, _]| *speed,
        max_speed_rad_s: common.limits.max_speed_rad_s,
    };
    let planned = resolved.wanted.planned::<3, 3>(&asked, periods, &mut warnings);
    problems.0.extend(common.limits.beyond::<3>(&planned.motion, periods));
    if !problems.0.is_empty() {
        return Err(problems.0);
    }
    warnings.extend(supply::too_weak(&keys, supply, limit));
    let load = std::mem::take(&mut resolved.load);
    let imperfections = imperfections(&file.friction, sheet.current_lag_s, gear, supply);
    let is_slowed = in_play.allowed(&present).is_none_or(|share| share < 1.0);
    let chosen = motor_in_words(&inertia.with_gate(in_play.slowed(present)), drive, (common.lag_s, form, is_slowed));
    let (states, x0, plant) = motor_plant(play, &common, [truth, believed], imperfections, load);
    experiment(
        &common,
        Parts {
            form,
            mounted: [mounted],
            monitors,
            resolved,
            design: &design,
            of_kind: DriveDesign::Motor,
            margin: drive.margin.unwrap_or_default().rule(),
            coupled: (None, None),
            is_given,
            top_speed: supply::top_speed(supply, nominal.torque_n_m_per_a, limit),
            is_slowed_by_play: is_slowed,
            planned,
            warnings,
            chosen,
            shafts: vec![ShaftOf { channel: 1, name: "shaft", inertia_kg_m2: nominal.inertia_kg_m2 }],
            states,
            x0,
            measured: play.map(Play::encoder_state),
            plant,
            smooth: (Box::new(plant::Motor::new(truth, believed, lag, Signal::default())), truth.inertia_kg_m2),
            corners: motor_corners(&inertia, uncertain_percent, believed, lag),
            inertia_range: inertia_range(&inertia, uncertain_percent, believed, lag),
        },
    )
}

/// Returns designs with less gain for the motor alone, each with the keys that select it. `with` returns the design of
/// a table and a number of gain sets.
fn calmer(
    drive: &MotorDriveTable,
    gain_sets: usize,
    with: &dyn Fn(&MotorDriveTable, usize) -> MotorDesign,
) -> [(&'static str, MotorDesign); 3] {
    let standard = MotorDriveTable { margin: Some(MarginKey::Rule(MarginRule::Standard)), ..drive.clone() };
    [
        ("drive.gain_sets = 1", with(drive, 1)),
        ("drive.margin = \"standard\"", with(&standard, gain_sets)),
        ("drive.margin = \"standard\" and drive.gain_sets = 1", with(&standard, 1)),
    ]
}

/// Returns the data sheet, converted to the output side of the gear.
fn motor_sheet(sheet: &MotorTable, gear: f64, inertia_kg_m2: f64, torque_n_m_per_a: f64) -> Motor {
    Motor { inertia_kg_m2, torque_n_m_per_a: gear * torque_n_m_per_a, damping_n_m_s: gear * gear * sheet.damping_n_m_s }
}

/// Returns the state names, the initial state and the plant with the parameters [true, nominal].
fn motor_plant(
    play: Option<&Play>,
    common: &Common<'_>,
    [truth, believed]: [Shaft; 2],
    imperfections: Imperfections,
    load: Signal,
) -> (&'static [StateName], Vec<f64>, Box<dyn Plant>) {
    let start = common.start_rad;
    if let Some(play) = play {
        let plant = play.plant(truth, believed, imperfections, load);
        return (&LOOSE_STATES, vec![start, 0.0, start], Box::new(plant));
    }
    let plant = plant::Motor::new(truth, believed, imperfections, load).sampled(common.period_s);
    (&MOTOR_STATES, vec![start], Box::new(plant))
}

/// Returns the nominal and the true shaft.
fn shafts(nominal: &Motor, error: &MotorErrorTable) -> (Shaft, Shaft) {
    let believed = Shaft::from(nominal);
    let truth = Shaft {
        inertia_kg_m2: true_to(believed.inertia_kg_m2, error.inertia_percent),
        torque_n_m_per_a: turned(true_to(believed.torque_n_m_per_a, error.torque_percent), error.reversed),
        damping_n_m_s: true_to(believed.damping_n_m_s, error.damping_percent),
    };
    (believed, truth)
}

/// Returns the design of a motor by its keys and rules.
fn motor_design(
    drive: &MotorDriveTable,
    sheet: &MotorTable,
    nominal: Motor,
    (mounted, noise_rad, limit): (Mounted, f64, f64),
    gain_sets: usize,
    peak: &dyn Fn(&MotorDesign) -> Option<f64>,
) -> MotorDesign {
    let by_rule = MotorDesign::by_rule(drive.period_s, nominal, mounted.encoder, Limits::symmetric(limit));
    let late = (sheet.current_lag_s, drive.delay_ticks as u32);
    let by_rule =
        margin::with_margin(by_rule, drive.margin.unwrap_or_default(), late, noise_of_shaft(&mounted, noise_rad), peak);
    let fast_ratio = if gain_sets == 1 { 1.0 } else { drive.fast_ratio.unwrap_or(by_rule.fast_ratio) };
    let design = MotorDesign { fast_ratio, ..by_rule }.with_bandwidths(motor_bandwidths(drive, &by_rule));
    MotorDesign { lost_ticks: drive.lost_ticks, fallback: fallback(drive.fallback), ..design }
}

/// Returns the bandwidths of the file, and by rule the others.
fn motor_bandwidths(drive: &MotorDriveTable, by_rule: &MotorDesign) -> MotorBandwidths {
    let rule = drive.margin.unwrap_or_default().rule();
    let scaled = drive.surface_rad_s.map_or(*by_rule, |w_c| by_rule.with_surface_by(rule, w_c));
    let w = scaled.bandwidths;
    let observer_rad_s = drive.observer_rad_s.unwrap_or(w.observer_rad_s);
    MotorBandwidths {
        observer_rad_s,
        reaching_per_s: drive.reaching_per_s.unwrap_or(w.reaching_per_s),
        offset_per_s: 0.5 * w.surface_rad_s.min(observer_rad_s),
        ..w
    }
}

/// Returns the bandwidths and their limiting factor, in words.
fn motor_in_words(
    design: &MotorDesign,
    drive: &MotorDriveTable,
    (lag_s, form, is_slowed_by_play): (f64, Form, bool),
) -> Vec<String> {
    let MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, .. } = design.bandwidths;
    let delay_ticks = form.delay_ticks as u32;
    let rule = drive.margin.unwrap_or_default().rule();
    let [noise, phase] = design.limits_by_rule(rule, lag_s, delay_ticks);
    let lost_s: f64 = design.lost_time_s(rule, lag_s, delay_ticks).iter().sum();
    let own = if rule == MotorMargin::Fast { surface_rad_s } else { observer_rad_s };
    let why = if [drive.surface_rad_s, drive.observer_rad_s, drive.reaching_per_s].iter().any(Option::is_some) {
        "set by the file".to_owned()
    } else if is_slowed_by_play {
        "limited by the play behind the gear (a higher bandwidth limit-cycles at rest)".into()
    } else if let Some(MarginKey::Peak(peak)) = drive.margin {
        format!("for a sensitivity peak of {peak}")
    } else if own < 0.999 * noise.min(phase) {
        "limited by the declared encoder noise (1 % of the current limit)".into()
    } else if noise < 0.999 * phase {
        "limited by encoder quantisation (current noise 1 % of the current limit)".into()
    } else {
        format!("limited by {:.2} ms of loop delay (sampling, current loop, computation)", 1e3 * lost_s)
    };
    let reaching = format!("reaching gain {reaching_per_s:.0} 1/s, innovation gate {:.0} counts", design.gate_steps);
    let high = (form.gain_sets > 1).then(|| format!(" (high gains {:.0})", observer_rad_s * design.fast_ratio));
    let observer = format!("observer bandwidth {observer_rad_s:.0} rad/s{}", high.unwrap_or_default());
    match (rule, form.follows) {
        (MotorMargin::Fast, Follows::Position) => {
            vec![format!("position bandwidth {surface_rad_s:.0} rad/s, {why}"), format!("{observer}, {reaching}")]
        }
        (MotorMargin::Standard, Follows::Position) => {
            vec![format!("{observer}, {why}"), format!("position bandwidth {surface_rad_s:.0} rad/s, {reaching}")]
        }
        (_, Follows::Speed) => vec![
            format!(
                "speed bandwidth {reaching_per_s:.0} rad/s, from a rule bandwidth of {surface_rad_s:.0} rad/s, {why}"
            ),
            format!("{observer}, {reaching}"),
        ],
    }
}

/// Returns the data sheet, converted to the output side of the gear, and the current limit.
fn joint_sheet(sheet: &JointTable, problems: &mut Problems) -> (Joint, f64) {
    let mut of = |value, key: &str, what: &str| needed(value, &format!("joint.{key}"), what, problems);
    let gear = Gear::of(sheet.gear).ratio();
    let nominal = Joint {
        link_inertia_kg_m2: of(sheet.link_inertia_kg_m2, "link_inertia_kg_m2", "the inertia of the link"),
        link_damping_n_m_s: sheet.link_damping_n_m_s,
        weight_n_m: sheet.weight_n_m,
        stiffness_n_m: of(sheet.stiffness_n_m, "stiffness_n_m", "the stiffness of the spring"),
        motor_inertia_kg_m2: gear
            * gear
            * of(sheet.motor_inertia_kg_m2, "motor_inertia_kg_m2", "the inertia of the motor"),
        motor_damping_n_m_s: gear * gear * sheet.motor_damping_n_m_s,
        torque_n_m_per_a: gear * of(sheet.torque_n_m_per_a, "torque_n_m_per_a", "the torque constant"),
    };
    (nominal, of(sheet.max_current_a, "max_current_a", "the current limit"))
}

/// Returns the nominal and the true joint.
fn bodies(nominal: &Joint, spring_damping_n_m_s: f64, error: &JointErrorTable) -> (JointBody, JointBody) {
    let believed = JointBody::from(nominal);
    let truth = JointBody {
        link_inertia_kg_m2: true_to(believed.link_inertia_kg_m2, error.link_inertia_percent),
        link_damping_n_m_s: true_to(believed.link_damping_n_m_s, error.link_damping_percent),
        weight_n_m: true_to(believed.weight_n_m, error.weight_percent),
        stiffness_n_m: true_to(believed.stiffness_n_m, error.stiffness_percent),
        spring_damping_n_m_s,
        motor: Shaft {
            inertia_kg_m2: true_to(believed.motor.inertia_kg_m2, error.motor_inertia_percent),
            torque_n_m_per_a: turned(true_to(believed.motor.torque_n_m_per_a, error.torque_percent), error.reversed),
            damping_n_m_s: true_to(believed.motor.damping_n_m_s, error.motor_damping_percent),
        },
    };
    (believed, truth)
}

fn motor_corners(inertia: &Inertia, percent: f64, believed: Shaft, lag: Imperfections) -> Vec<Corner> {
    if let Some(InertiaRange { ends_kg_m2, plants, .. }) = inertia_range(inertia, percent, believed, lag) {
        return ends_kg_m2.into_iter().flat_map(plants).collect();
    }
    corners(percent, ["J", "K_t"], |[inertia, torque]| {
        let shaft = Shaft {
            inertia_kg_m2: inertia * believed.inertia_kg_m2,
            torque_n_m_per_a: torque * believed.torque_n_m_per_a,
            ..believed
        };
        Box::new(plant::Motor::new(shaft, believed, lag, Signal::default()))
    })
}

fn joint_corners(percent: f64, believed: &JointBody, spring_damping_n_m_s: f64, lag: Imperfections) -> Vec<Corner> {
    corners(percent, ["J_l", "J_m", "K", "K_t"], |[link, motor, spring, torque]| {
        let body = JointBody {
            link_inertia_kg_m2: link * believed.link_inertia_kg_m2,
            stiffness_n_m: spring * believed.stiffness_n_m,
            spring_damping_n_m_s,
            motor: Shaft {
                inertia_kg_m2: motor * believed.motor.inertia_kg_m2,
                torque_n_m_per_a: torque * believed.motor.torque_n_m_per_a,
                ..believed.motor
            },
            ..*believed
        };
        Box::new(plant::Joint::new(body, *believed, lag, Signal::default()))
    })
}

/// Returns the problem of a joint with one encoder, and the motor that can replace a joint with a stiff spring.
fn one_encoder(is_on_link: bool, joint: &Joint, gear: Gear) -> Problem {
    let JointRatios { k1, k2, .. } = JointRatios::of(joint, 0.0);
    let turns = gear.ratio();
    let inertia_kg_m2 = (joint.link_inertia_kg_m2 + joint.motor_inertia_kg_m2) / (turns * turns);
    let (key, unseen, swings_rad_s, more) = if is_on_link {
        ("encoder.motor", "motor", (k1 + k2).sqrt(), ", its encoder with behind_gear = true")
    } else {
        ("encoder.link", "link", k1.sqrt(), "")
    };
    let message = format!(
        "missing: the drive of a joint needs an encoder on each side. Without this one the oscillation of the \
         {unseen} on the spring, at {swings_rad_s:.0} rad/s and above, is not measured. A loop ten times slower may \
         treat both shafts as one: host-sim new FILE.toml --plant motor, with inertia_kg_m2 = \
         {inertia_kg_m2:.3e}{more}"
    );
    Problem { key: key.into(), message }
}

/// Returns a warning for a sudden load so large that the innovation gates accept encoder faults.
fn wide_gates(load_n_m: f64, strongest_n_m: f64) -> Option<String> {
    let times = load_n_m / strongest_n_m;
    (times > MOST_SUDDEN).then(|| {
        format!(
            "drive.sudden_load_n_m = {} is {times:.3} times the largest motor torque: innovation gates this wide \
             accept a broken encoder",
            shown(load_n_m)
        )
    })
}

/// Returns warnings for bounds of the load monitors that no load reaches while the motor holds it.
fn wide_monitors(table: &MonitorTable, strongest_n_m: f64) -> Vec<String> {
    let bounds = [("monitor.load_n_m", table.load_n_m), ("monitor.motor_n_m", table.motor_n_m)];
    let wide = |(key, bound): (&str, Option<f64>)| {
        let bound_n_m = bound.filter(|bound| *bound > MOST_SUDDEN * strongest_n_m)?;
        Some(format!(
            "{key} = {} is {} times the largest motor torque: a jam or a broken encoder may raise no alarm",
            shown(bound_n_m),
            shown(rounded(bound_n_m / strongest_n_m))
        ))
    };
    bounds.into_iter().filter_map(wide).collect()
}

/// Returns the bandwidths and their origin, in words.
fn joint_in_words(design: &JointDesign, tuning: TuningKey, drive: &JointDriveTable, gain_sets: usize) -> Vec<String> {
    let (w, [link_steps, motor_steps]) = (design.bandwidths, design.gate_steps);
    let word = match tuning {
        TuningKey::Quiet => "quiet",
        TuningKey::Normal => "normal",
        TuningKey::Firm => "firm",
        TuningKey::Coupled => "coupled",
    };
    let why = match (drive.surface_rad_s, drive.tuning) {
        (Some(_), _) => "set by the file".into(),
        (None, Some(_)) => format!("tuning {word:?}, set by the file"),
        (None, None) => format!("tuning {word:?}, chosen by the encoder resolution"),
    };
    vec![
        format!("position bandwidth {:.0} rad/s, {why}", w.surface_rad_s),
        format!(
            "observer bandwidths {:.0} (link) and {:.0} rad/s (motor){}, reaching gain {:.0} 1/s, innovation gates \
             {link_steps:.0} and {motor_steps:.0} counts",
            w.link_rad_s,
            w.motor_rad_s,
            high_gains(design, gain_sets),
            w.reaching_per_s
        ),
    ]
}

/// Returns the observer bandwidths of the high gains, in words; empty with one gain set.
pub(super) fn high_gains(design: &JointDesign, gain_sets: usize) -> String {
    let [link, motor] = design.fast_ratios;
    let w = design.bandwidths;
    if gain_sets == 1 {
        return String::new();
    }
    format!(", high gains {:.0} and {:.0} rad/s", link * w.link_rad_s, motor * w.motor_rad_s)
}

/// Designs of a joint for several periods.
struct JointDesigns<'a> {
    drive: &'a JointDriveTable,
    /// Design with the period of the file, before the bandwidths.
    bare: JointDesign,
    tuning: TuningKey,
    by: CoupledBy,
    as_whole: Option<AsWhole>,
    form: Form,
}

impl<'a> JointDesigns<'a> {
    /// # Errors
    /// Returns the problem of a joint without gains by rule.
    fn of(
        file: &'a JointScenario,
        (nominal, limit): (&Joint, f64),
        [link, motor]: [&Mounted; 2],
        form: Form,
    ) -> Result<Self, Vec<Problem>> {
        let (drive, encoders) = (&file.drive, [link.encoder, motor.encoder]);
        let load_n_m = drive.sudden_load_n_m.unwrap_or(limit * nominal.torque_n_m_per_a);
        let noise = [(link, &file.encoder.link), (motor, &file.encoder.motor)];
        let by = CoupledBy {
            lag_s: file.joint.current_lag_s,
            noise_rad: noise.map(|(mounted, table)| noise_of_shaft(mounted, table.noise_rad)),
            delay_ticks: form.delay_ticks,
            uncertain: drive.uncertain_percent / 100.0,
            peak: coupled::peak_of(drive.margin),
            load_n_m,
        };
        let bare = JointDesign {
            lost_ticks: drive.lost_ticks,
            fallback: fallback(drive.fallback),
            ..JointDesign::new(drive.period_s, *nominal, encoders, Limits::symmetric(limit), load_n_m)
        };
        let tuning = drive.tuning.unwrap_or_else(|| tuning_for(nominal, encoders));
        let as_whole = (tuning == TuningKey::Coupled).then(|| AsWhole::of(by, drive, &bare)).transpose();
        let as_whole = as_whole.map_err(|problem| vec![problem])?;
        let form = as_whole.as_ref().map_or(form, |it| it.form(form, drive.gain_sets));
        Ok(Self { drive, bare, tuning, by, as_whole, form })
    }

    fn design(&self, period_s: f64) -> JointDesign {
        let bare = JointDesign { period_s, ..self.bare };
        if let Some(as_whole) = &self.as_whole {
            return as_whole.design(&bare);
        }
        let table = JointDriveTable { period_s, ..self.drive.clone() };
        let design = bare.with_bandwidths(joint_bandwidths(&table, self.tuning), self.by.load_n_m);
        let fast_ratios = self.drive.fast_ratios.as_deref().and_then(|ratios| ratios.try_into().ok());
        JointDesign { fast_ratios: fast_ratios.unwrap_or(design.fast_ratios), ..design }
    }

    /// Returns the bandwidths and their limiting factor, in words.
    fn in_words(&self, period_s: f64) -> Vec<String> {
        let design = self.design(period_s);
        match &self.as_whole {
            Some(as_whole) => as_whole.in_words(&design, self.form.gain_sets),
            None => joint_in_words(&design, self.tuning, self.drive, self.form.gain_sets),
        }
    }
}

/// Builds the experiment of a joint. For an incomplete file only the rules are checked, without a design.
///
/// # Errors
/// Returns all broken rules, or the error of the design.
pub(crate) fn joint(file: &JointScenario, default_name: &str, is_whole: bool) -> Result<Experiment, Vec<Problem>> {
    let mut problems = Problems::default();
    let (sheet, drive) = (&file.joint, &file.drive);
    let (nominal, limit) = joint_sheet(sheet, &mut problems);
    problems.0.extend(too_uncertain(drive.uncertain_percent, None));
    let keys = Keys { plant: "joint", volt: sheet.supply_v, ohm: sheet.resistance_ohm, no_load: sheet.no_load_rad_s };
    let turns = Gear::of(sheet.gear);
    let gear = turns.ratio();
    let supply = problems.take(keys.supply(nominal.torque_n_m_per_a / gear, limit)).flatten();
    let (believed, truth) = bodies(&nominal, sheet.spring_damping_n_m_s, &file.error);
    // The spring carries the gravity torque.
    let motor_rad = sheet.start_rad + truth.weight_n_m * libm::sin(sheet.start_rad) / truth.stiffness_n_m;
    problems.0.extend(on_link(&file.encoder.link));
    let alone = [&file.encoder.link, &file.encoder.motor].map(|table| *table == EncoderTable::default());
    if problems.0.is_empty() && alone[0] != alone[1] {
        return Err(vec![one_encoder(alone[1], &nominal, turns)]);
    }
    let link = mounted(&file.encoder.link, (Gear::NONE, "joint"), sheet.start_rad, "encoder.link", &mut problems);
    let motor = mounted(&file.encoder.motor, (turns, "joint"), motor_rad, "encoder.motor", &mut problems);
    let common = common! {
        file, sheet, drive, problems, limit,
        mode: ModeKey::Position,
        lighter_percent: 0.0,
        observer_states: 4,
        rest_band: Some(RestBandKey::Off),
        encoders: &[&file.encoder.link, &file.encoder.motor],
        plant: "joint",
    };
    problems.0.extend(no_fading(&file.friction));
    problems.0.extend(too_steep(&file.friction, limit, &truth.motor, common.period_s));
    let resolved = resolved(&common, &[link, motor], default_name, &mut problems);
    let Some(mut resolved) = resolved.filter(|_| is_whole && problems.0.is_empty()) else { return Err(problems.0) };

    let designs = JointDesigns::of(file, (&nominal, limit), [&link, &motor], common.form(drive.gain_sets))?;
    let (load_n_m, strongest_n_m) = (designs.by.load_n_m, limit * nominal.torque_n_m_per_a);
    let design = |period_s: f64| designs.design(period_s);
    let mut warnings = common.warnings(strongest_n_m);
    warnings.extend(starts_near_zero(&file.encoder.motor, turns));
    warnings.extend(asked_states(&file.encoder.link, "encoder.link"));
    warnings.extend(asked_states(&file.encoder.motor, "encoder.motor"));
    warnings.extend(wide_gates(load_n_m, strongest_n_m));
    warnings.extend(designs.as_whole.as_ref().and_then(|it| it.weak(strongest_n_m)));
    warnings.extend(designs.as_whole.as_ref().and_then(|it| it.idle_set(drive.gain_sets)));
    warnings.extend((drive.margin.is_some() && designs.as_whole.is_none()).then(|| {
        "drive.margin has no effect on a joint with one observer per encoder: set drive.tuning = \"coupled\"".into()
    }));
    let torque = nominal.torque_n_m_per_a / gear;
    warnings.extend(implausible("joint.motor_inertia_kg_m2", sheet.motor_inertia_kg_m2, torque, limit));
    warnings.extend(friction_warnings(&file.friction, limit, &truth.motor));
    let (periods, uncertain_percent) = (resolved.periods, drive.uncertain_percent);
    let asked = PlanLimits {
        plant: "joint",
        max_current_a: limit,
        uncertain_percent,
        inertia: Inertia::known_to(nominal.link_inertia_kg_m2, uncertain_percent),
        supply,
        supply_of: &|max_current_a| keys.supply(nominal.torque_n_m_per_a / gear, max_current_a).ok().flatten(),
        torque_n_m_per_a: nominal.torque_n_m_per_a,
        gear,
        feed_forward: &|jet| nominal.feed_forward(jet),
        speed: &|jet| supply::motor_speed(&nominal, jet),
        max_speed_rad_s: common.limits.max_speed_rad_s,
    };
    let planned = resolved.wanted.planned::<4, 5>(&asked, periods, &mut warnings);
    problems.0.extend(common.limits.beyond::<4>(&planned.motion, periods));
    if !problems.0.is_empty() {
        return Err(problems.0);
    }
    warnings.extend(supply::too_weak(&keys, supply, limit));
    let load = std::mem::take(&mut resolved.load);
    let imperfections = imperfections(&file.friction, sheet.current_lag_s, gear, supply);
    let lag = Imperfections { lag_s: sheet.current_lag_s, ..Imperfections::default() };
    let given = [drive.surface_rad_s, drive.link_rad_s, drive.motor_rad_s, drive.reaching_per_s];
    let inertia = [nominal.link_inertia_kg_m2, nominal.motor_inertia_kg_m2];
    let shaft = |channel, name, inertia_kg_m2| ShaftOf { channel, name, inertia_kg_m2 };
    experiment(
        &common,
        Parts {
            form: designs.form,
            mounted: [link, motor],
            monitors: common.monitors(resolved.reaction, inertia, load_n_m),
            resolved,
            design: &design,
            of_kind: DriveDesign::Joint,
            margin: MotorMargin::default(),
            coupled: (Some(designs.by), designs.as_whole.as_ref().and_then(|it| it.rule)),
            is_given: given.iter().any(Option::is_some),
            top_speed: supply::top_speed(supply, nominal.torque_n_m_per_a, limit),
            planned,
            warnings,
            chosen: designs.in_words(common.period_s),
            shafts: vec![shaft(1, "link", inertia[0]), shaft(3, "motor", inertia[1])],
            states: &JOINT_STATES,
            x0: vec![sheet.start_rad, 0.0, motor_rad],
            plant: Box::new(plant::Joint::new(truth, believed, imperfections, load).sampled(common.period_s)),
            measured: None,
            is_slowed_by_play: false,
            smooth: (Box::new(plant::Joint::new(truth, believed, lag, Signal::default())), truth.link_inertia_kg_m2),
            inertia_range: None,
            corners: joint_corners(uncertain_percent, &believed, truth.spring_damping_n_m_s, lag),
        },
    )
}

/// Returns the default tuning. For a stiff spring, with K/J_l above the square of the position bandwidth, it is the
/// coupled design, because the sets of bandwidths are not stable there. Otherwise it depends on the encoder resolution.
fn tuning_for(joint: &Joint, encoders: [Encoder; 2]) -> TuningKey {
    let is_fine = encoders.iter().all(|encoder| encoder.unit_rad() < 1.5 * Encoder::absolute(16).unit_rad());
    let by_bits = if is_fine { TuningKey::Normal } else { TuningKey::Quiet };
    let held = joint.stiffness_n_m / joint.link_inertia_kg_m2;
    if held > bandwidths_of(by_bits).surface_rad_s.powi(2) { TuningKey::Coupled } else { by_bits }
}

/// Returns the bandwidths of a tuning, within the limits of the period, or the bandwidths of the file.
fn joint_bandwidths(drive: &JointDriveTable, tuning: TuningKey) -> JointBandwidths {
    let of_tuning = bandwidths_of(tuning);
    let all = match drive.surface_rad_s {
        Some(surface_rad_s) => of_tuning.with_surface(surface_rad_s),
        None => of_tuning.slowed_for(drive.period_s, drive.delay_ticks),
    };
    let own = JointBandwidths { link_rad_s: drive.link_rad_s.unwrap_or(all.link_rad_s), ..all };
    let slowed = own.within(drive.period_s, drive.delay_ticks);
    JointBandwidths {
        motor_rad_s: drive.motor_rad_s.unwrap_or(slowed.motor_rad_s),
        reaching_per_s: drive.reaching_per_s.unwrap_or(slowed.reaching_per_s),
        ..slowed
    }
}

fn bandwidths_of(tuning: TuningKey) -> JointBandwidths {
    match tuning {
        TuningKey::Quiet => JointBandwidths::QUIET,
        TuningKey::Firm => JointBandwidths::FIRM,
        // The coupled design computes its own bandwidths and does not use these.
        TuningKey::Normal | TuningKey::Coupled => JointBandwidths::DEFAULT,
    }
}
