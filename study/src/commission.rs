//! Self-commissioning: the drive records a move, is tuned from the recording, and verifies the new gains in a move.
//!
//! ```text
//! record   planned moves to and fro; multisine excitation of the current      gains of the data sheet
//! identify parameters from counts and current (module identify)               or a refusal, and nothing changes
//! switch   at rest, W := 0 (EncoderForm::at_rest)                             the design of the found parameters
//! verify   a move of 1 rad, as short as 70 % of the current allow             peak of y - r, residual of a link
//! keep the new gains, or switch back; then home
//! ```
//!
//! A move is accepted if abs(y - r) <= B + 2.5 counts of the feedback encoder. For a joint the new link parameters must
//! also explain the recording of this move within 0.6 counts rms. This check applies only if the identification used
//! the link count. B is 1e-4 rad or twice the simulated error of the move, whichever is more. The simulation uses the
//! identified joint or motor (module `predicted`). The threshold never exceeds the peak of the recorded moves by more
//! than one count.
//!
//! The move alone does not detect every wrong link; the residual does. Neither detects a wrong motor of a joint, which
//! does no harm in this move. A motor with a rigid load makes the shortest move that its current allows. In this move b
//! matters, and an error of 20 % in b is detected.
//!
//! The switch at rest drops the offset W. With wrong parameters the loop swings a little. The rule for switches in
//! motion (no step in u) would store this momentary difference of the demands in W, which decays with 1/α.
//!
//! The sequence is independent of the drive and runs on a [`Stand`]. A stand is the simulated plant and drive of a
//! scenario ([`Rig`]), or a drive on a serial port (in `host-sim`). It provides counts, current and status flags.

use std::fmt;
use std::ops::ControlFlow;

use controller_core::Health;
use controller_core::drive::ALARMS;
use loop_sim::port::PortError;
use loop_sim::port::drive::{DriveDesign, Goal, Motion};
use loop_sim::sensor::encoder::Mounted;

use crate::Error;
use crate::identify::{Identified, PlantData, Record, Refusal, Sheet, identify, most_residual_steps};
use crate::kind::DriveKind;

mod multisine;
pub mod plants;
mod predicted;
mod retuned;
mod rig;

use predicted::Found;

pub(crate) use multisine::highest_hz;
pub use multisine::multisine;
pub use retuned::{Retuned, is_of_drive, sheet_of};
pub use rig::Rig;

/// Rest before the first move and between moves, s.
const REST_S: f64 = 0.2;
/// Times from the end of the multisine to the switch, and from the switch to the verification, s.
const CALM_S: f64 = 0.45;
const SETTLE_S: f64 = 0.4;
/// Delay of the multisine after the start of the drive, s.
const SHAKE_AFTER_S: f64 = 0.1;
/// Observation time after a move, s.
const AFTER_S: f64 = 0.25;
/// Share of the current limit for the verification. The load current is subtracted from it, down to the second share.
const CURRENT: f64 = 0.7;
const LEAST_CURRENT: f64 = 0.3;
/// Safety factor on the current that lifts the weight of the data sheet, for errors of weight and torque constant.
const LIFTED: f64 = 1.5;
/// Travel of the moves without the link count, relative to the recorded travel. The moves become shorter and faster, so
/// that the link swings. Each move is as fast as `CHIRP_CURRENT` times the usual current allows. With all of the
/// current four of 32 corners of ±50 % stayed at the limit until an alarm, with half of it two.
const CHIRP: [f64; 8] = [0.36, 0.36, 0.24, 0.24, 0.15, 0.15, 0.09, 0.09];
const CHIRP_CURRENT: f64 = 0.36;
const LEAST_CHIRP_S: f64 = 0.3;
/// Longest plan, s.
const LONGEST_S: f64 = 20.0;
/// Smallest threshold of the verification, rad. The threshold is the larger of this and [`TIMES_EXPECTED`] times the
/// simulated error, plus [`BAR_STEPS`] counts. The simulation contains friction and the identified cogging, but neither
/// ripple nor load.
pub const LEAST_BAR_RAD: f64 = 1e-4;
/// Factor on the simulated error in the threshold, see [`LEAST_BAR_RAD`].
pub const TIMES_EXPECTED: f64 = 2.0;
/// Counts of the feedback encoder in the threshold: two, and half a count of rounding. See [`LEAST_BAR_RAD`].
pub const BAR_STEPS: f64 = 2.5;

/// Settings of the recording and the verification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Travel of the recorded moves, rad.
    pub way_rad: f64,
    /// Shortest duration of a recorded move, s.
    pub move_s: f64,
    /// Peak of the multisine, A; at least five times the friction.
    pub peak_a: f64,
    /// Peak of a second recording if the first is too weak, A; 0 for none.
    pub most_peak_a: f64,
    /// Seed of the multisine.
    pub seed: u64,
    /// Travel of the verification move, rad.
    pub verify_rad: f64,
    /// Shortest duration of the verification move, s.
    pub verify_s: f64,
    /// Gain switching method.
    pub swap: Swap,
    /// Whether the recording of a joint omits the link count; the drive still uses it.
    pub motor_alone: bool,
}

/// Gain switching method: at rest, or one of two alternatives for comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Swap {
    /// Without the offset W: u has a small step.
    AtRest,
    /// Without a step in u, as in motion.
    InMotion,
    /// No switch: the verification move uses the old gains.
    None,
}

impl Plan {
    /// Returns the default plan. Joint: 0.6 rad in 2 s with 27 % of the current, for a coupled design with half of this
    /// peak. A second recording uses 80 %. Motor: 3 rad in 0.6 s with all of the current.
    pub fn of(designed: &DriveDesign) -> Self {
        let plan = DriveKind::of(designed).plan;
        let [peak_a, most_peak_a] = [plan.peak_a, plan.most_peak_a].map(|share| share * designed.max_current_a());
        Self { peak_a, most_peak_a, ..plan }
    }
}

/// Reason why the sequence stopped early.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Stopped {
    /// The recording was refused. The old gains are still active.
    Refused(Refusal),
    /// An encoder count was lost.
    Lost {
        /// Time of the lost count, s.
        at_s: f64,
    },
    /// Ticks came late.
    Late {
        /// Number of late ticks.
        ticks: u32,
    },
    /// A monitor of the drive raised an alarm.
    Alarm(Health),
    /// A monitor raised an alarm while a plant behind a gear was recorded.
    AlarmBehindGear {
        /// Alarm flags.
        health: Health,
        /// Gear ratio, motor turns per output turn.
        gear: f64,
        /// Keys of torque constant and inertia of the motor.
        keys: [&'static str; 2],
    },
    /// No move of this travel stays within the current.
    TooFar {
        /// Travel, rad.
        way_rad: f64,
    },
    /// The identified parameters have no valid design.
    Design(String),
    /// The plant or the drive failed.
    Broken(String),
    /// Stopped on request.
    Interrupted,
    /// The sequence stopped and the old gains could not be restored.
    Left {
        /// Reason of the stop.
        stopped: Box<Stopped>,
        /// Reason why the old gains are not restored.
        why: Box<Stopped>,
    },
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => write!(f, "recording refused: {refusal}"),
            Self::Lost { at_s } => write!(f, "recording refused: a count was lost at {at_s:.3} s; record again"),
            Self::Late { ticks } => write!(
                f,
                "recording refused: {ticks} ticks came late; record again. If it happens again, the interrupt of the \
                 drive takes too long"
            ),
            Self::Alarm(health) => write!(
                f,
                "alarm ({health:?}){}: remove the external load, or raise the limits in [monitor]",
                if health.contains(Health::STOPPED) { " stopped the drive, reset it with host-sim live" } else { "" }
            ),
            Self::AlarmBehindGear { health, gear, keys: [torque, inertia] } => write!(
                f,
                "{}; or the data sheet refers to the output of the gear of {gear}: {torque} and {inertia} belong to \
                 the motor shaft; the output values are {gear} times and {} times as large",
                Self::Alarm(*health),
                gear * gear
            ),
            Self::TooFar { way_rad } => {
                write!(f, "no move of {way_rad} rad stays within the current limit: reduce --way or --verify")
            }
            Self::Design(why) => write!(f, "the identified parameters have no valid design: {why}"),
            Self::Broken(why) => f.write_str(why),
            Self::Interrupted => f.write_str("stopped on request"),
            Self::Left { stopped, why } => {
                write!(f, "{stopped}; THE OLD GAINS ARE NOT RESTORED: {why}; check the design with host-sim live")
            }
        }
    }
}

impl std::error::Error for Stopped {}

impl From<PortError> for Stopped {
    fn from(error: PortError) -> Self {
        Self::Broken(error.to_string())
    }
}

/// Result of the verification.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Verified {
    /// Duration of the move, s.
    pub move_s: f64,
    /// Largest abs(y - r) from the counts, rad.
    pub peak_rad: f64,
    /// Largest abs(y - r) of the true angle, rad; simulation only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_peak_rad: Option<f64>,
    /// Acceptance threshold of the peak, rad.
    pub bar_rad: f64,
    /// Simulated peak of this move on the identified joint or motor, rad; `None` if the simulation fails.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_rad: Option<f64>,
    /// Residual of the new link parameters in this move, counts rms; `None` for a motor.
    pub residual_steps: Option<f64>,
    /// Acceptance threshold of the residual, counts rms; `None` for a motor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_residual_steps: Option<f64>,
}

/// Outcome of the verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The new gains stay.
    Accepted,
    /// The old gains are restored because the move exceeded its threshold.
    BackForTheMove,
    /// The old gains are restored because the residual of the link exceeded its threshold.
    BackForTheLink,
}

/// Report of a commissioning sequence.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// Recording of the moves.
    #[serde(skip)]
    pub record: Record,
    /// Identified parameters.
    #[serde(skip)]
    pub identified: Identified,
    /// Design that was tried.
    #[serde(skip)]
    pub designed: DriveDesign,
    /// Peak of the multisine, A.
    pub peak_a: f64,
    /// Largest abs(y - r) of the recorded moves, from the counts, rad.
    pub recorded_peak_rad: f64,
    /// Step in u at the switch, A.
    pub jump_a: f64,
    /// Largest abs(y - r) between switch and verification, rad.
    pub settling_rad: f64,
    /// Result of the verification.
    pub verified: Verified,
    /// Outcome: accepted or switched back.
    pub outcome: Outcome,
    /// Largest abs(y - r) on the way home, with the final gains, rad.
    pub home_rad: f64,
    /// t (s), y, r (rad) and u (A) of all recorded ticks.
    #[serde(skip)]
    pub ticks: Vec<[f64; 4]>,
    /// Times of switch, verification and way home, s.
    #[serde(skip)]
    pub marks: [f64; 3],
}

/// Callback every few ticks with the tick number; it can end the sequence.
pub type OnTicks<'a> = dyn FnMut(u64) -> ControlFlow<()> + 'a;

/// Excitation: a [`multisine`] with a start time and a duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shake {
    /// Start time, s.
    pub from_s: f64,
    /// Duration, s.
    pub for_s: f64,
    /// Peak, A.
    pub peak_a: f64,
    /// Resonance of the joint, rad/s; 0 for a motor.
    pub resonance_rad_s: f64,
    /// Seed of the phases.
    pub seed: u64,
}

impl Shake {
    /// Returns the current of each of `rows` ticks, A.
    pub fn wave(&self, rows: usize, period_s: f64) -> Vec<f64> {
        let [from, count] = [self.from_s, self.for_s].map(|seconds| (seconds / period_s).round() as usize);
        let wave = multisine(self.peak_a, count, period_s, self.resonance_rad_s, self.seed);
        std::iter::repeat_n(0.0, from).chain(wave).chain(std::iter::repeat(0.0)).take(rows).collect()
    }
}

/// Recording between two rests.
#[derive(Clone, Debug)]
pub struct Leg {
    /// Time of the first row, s.
    pub from_s: f64,
    /// Time between rows, s.
    pub period_s: f64,
    /// Angle of the first encoder in the turn of the reference, rad; NaN for a lost count.
    pub y: Vec<f64>,
    /// Reference, rad.
    pub r: Vec<f64>,
    /// Held current, A.
    pub held_a: Vec<f64>,
    /// The recording for identification, or the reason why there is none.
    pub record: Result<Record, Stopped>,
    /// True y - r, rad, if it is known.
    pub true_error: Option<Vec<f64>>,
    /// Status flags of all ticks.
    pub health: Health,
}

impl Leg {
    /// Returns the largest abs(y - r), rad.
    fn peak_rad(&self) -> f64 {
        largest(self.y.iter().zip(&self.r).map(|(y, r)| y - r))
    }

    fn seconds(&self) -> f64 {
        self.r.len() as f64 * self.period_s
    }

    fn rows(&self) -> impl Iterator<Item = [f64; 4]> {
        let [y, r, held] = [&self.y, &self.r, &self.held_a];
        (0..r.len()).map(move |k| [self.from_s + k as f64 * self.period_s, y[k], r[k], held[k]])
    }
}

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |most, error| most.max(error.abs()))
}

/// Returns the angle of an upright count in the turn of a reference, rad; NaN for a lost count.
pub fn turned(count: Option<i32>, r: f64, mounted: &Mounted) -> f64 {
    let Some(count) = count else { return f64::NAN };
    let span = (1_u64 << mounted.encoder.bits) as f64 * mounted.encoder.unit_rad();
    let angle = f64::from(count) * mounted.encoder.unit_rad();
    angle + span * ((r - angle) / span).round()
}

/// Drive under commissioning, simulated or real.
pub trait Stand {
    /// Returns the initial design.
    fn designed(&self) -> DriveDesign;

    /// Returns the sampling period, s.
    fn period_s(&self) -> f64;

    /// Returns the present rest position, rad.
    fn at_rad(&self) -> f64;

    /// Starts a recording of at most `most_s` seconds, with an optional excitation.
    ///
    /// # Errors
    /// The drive cannot be reached.
    fn begin(&mut self, shake: Option<&Shake>, most_s: f64) -> Result<(), Stopped>;

    /// Ends the recording and returns it.
    ///
    /// # Errors
    /// The drive cannot be reached, or the sequence was stopped.
    fn end(&mut self) -> Result<Leg, Stopped>;

    /// Waits at rest.
    ///
    /// # Errors
    /// The drive cannot be reached, or the sequence was stopped.
    fn rest(&mut self, seconds: f64) -> Result<(), Stopped>;

    /// Moves from rest to rest in this number of ticks.
    ///
    /// # Errors
    /// The drive cannot be reached or refuses the move, or the sequence was stopped.
    fn go(&mut self, to_rad: f64, ticks: u32) -> Result<(), Stopped>;

    /// Switches to another design of the same form and returns the step in u, A. The switch sets W = 0 (`at_rest`) or
    /// avoids a step in u.
    ///
    /// # Errors
    /// The drive cannot be reached or refuses the design, or the sequence was stopped.
    fn swap(&mut self, to: &DriveDesign, at_rest: bool) -> Result<f64, Stopped>;

    /// Cleans up after an early stop: ends the excitation and restores the old design.
    ///
    /// # Errors
    /// The old design could not be restored.
    fn give_up(&mut self) -> Result<(), Stopped> {
        Ok(())
    }
}

/// Returns the fewest ticks of a motion from rest within this current, at least `least_s` long.
fn fewest(stand: &dyn Stand, sheet: &Sheet, way_rad: f64, least_s: f64, u_max: f64) -> Result<u32, Stopped> {
    let (at_rad, period_s) = (stand.at_rad(), stand.period_s());
    let wanted = Motion { goal: Goal::Rest { angle_rad: at_rad + way_rad }, ..Motion::rest(at_rad, period_s) };
    let range = [least_s, LONGEST_S].map(|seconds| (seconds / period_s).round() as u32);
    sheet.shortest(&wanted, range, u_max).map(|motion| motion.ticks).ok_or(Stopped::TooFar { way_rad })
}

/// Records moves to and fro under the multisine, then waits until the switch. Returns the recording and the current
/// that is held at the end.
fn make_record(stand: &mut dyn Stand, plan: &Plan, sheet: &Sheet, share: f64) -> Result<(Leg, f64), Stopped> {
    let resonance_rad_s = sheet.resonance_rad_s();
    // The durations of all moves are computed first, because the multisine starts before them.
    let mut moves = Vec::new();
    let (ways, least_s, share, rest_s) = if plan.motor_alone {
        (&CHIRP[..], LEAST_CHIRP_S, CHIRP_CURRENT * share, 0.0)
    } else {
        (&[1.0][..], plan.move_s, share, REST_S)
    };
    for way in ways {
        let way_rad = way * plan.way_rad;
        let ticks = fewest(stand, sheet, way_rad, least_s, share)?;
        moves.extend([(way_rad, ticks), (-way_rad, ticks)]);
    }
    let ticks: u32 = moves.iter().map(|(_, ticks)| ticks).sum();
    let moves_s = f64::from(ticks) * stand.period_s() + rest_s * moves.len() as f64;
    let shake = Shake {
        from_s: SHAKE_AFTER_S,
        for_s: moves_s - SHAKE_AFTER_S,
        peak_a: plan.peak_a,
        resonance_rad_s,
        seed: plan.seed,
    };
    stand.begin(Some(&shake), moves_s + REST_S)?;
    stand.rest(REST_S)?;
    for (way_rad, ticks) in moves {
        let to_rad = stand.at_rad() + way_rad;
        stand.go(to_rad, ticks)?;
        stand.rest(rest_s)?;
    }
    let leg = stand.end()?;
    // A drive that rejected its counts held a different current.
    if leg.record.is_ok() && leg.health.intersects(ALARMS | Health::INPUT_REJECTED) {
        return Err(Stopped::Alarm(leg.health));
    }
    let calm_s = shake.from_s + shake.for_s + CALM_S - leg.seconds();
    stand.rest((calm_s - SETTLE_S / 2.0).max(0.0))?;
    stand.begin(None, SETTLE_S / 2.0)?;
    stand.rest(SETTLE_S / 2.0)?;
    let held = stand.end()?.held_a;
    Ok((leg, (held.iter().sum::<f64>() / held.len().max(1) as f64).abs()))
}

/// Switches to another design and records the settling.
fn swapped(stand: &mut dyn Stand, to: &DriveDesign, how: Swap) -> Result<(f64, Leg), Stopped> {
    let jump_a = if how == Swap::None { 0.0 } else { stand.swap(to, how == Swap::AtRest)? };
    stand.begin(None, SETTLE_S)?;
    stand.rest(SETTLE_S)?;
    Ok((jump_a, stand.end()?))
}

/// Makes a move and records it until shortly after its end.
fn moved(stand: &mut dyn Stand, to_rad: f64, ticks: u32) -> Result<Leg, Stopped> {
    stand.begin(None, f64::from(ticks) * stand.period_s() + AFTER_S)?;
    stand.go(to_rad, ticks)?;
    stand.rest(AFTER_S)?;
    stand.end()
}

/// Runs the whole sequence. `design` computes a drive of the same form from the identified parameters.
///
/// # Errors
/// The reason of an early stop. The drive then has its old gains, unless the error is [`Stopped::Left`].
pub fn commission(
    stand: &mut dyn Stand,
    plan: &Plan,
    known: &PlantData,
    design: impl FnOnce(&mut Identified) -> Result<DriveDesign, Error>,
) -> Result<Report, Stopped> {
    sequence(stand, plan, known, design).map_err(|stopped| match stand.give_up() {
        Ok(()) => stopped,
        Err(why) => Stopped::Left { stopped: Box::new(stopped), why: Box::new(why) },
    })
}

/// Recording and identification.
struct Recorded {
    /// Plan that was used, and the current for its moves, A.
    plan: Plan,
    share: f64,
    leg: Leg,
    /// Current that is held at the end, A.
    load: f64,
    identified: Result<Identified, Refusal>,
}

fn identified_by(stand: &mut dyn Stand, plan: &Plan, sheet: &Sheet, known: &PlantData) -> Result<Recorded, Stopped> {
    let limit = stand.designed().max_current_a();
    // A data sheet that is 50 % off in every number underestimates the current by a factor of three.
    let mut share = (limit - plan.peak_a).max(0.1 * limit) / 3.0;
    let mut plan = *plan;
    // The weight needs additional current; the rest is left for the excitation.
    let lifted = LIFTED * sheet.lifts_a(plan.way_rad);
    if lifted > 0.0 {
        share = share.max(lifted + 0.1 * limit).min(CURRENT * limit);
        plan.peak_a = plan.peak_a.min(limit - share);
    }
    let (leg, load) = make_record(stand, &plan, sheet, share).map_err(|stopped| match stopped {
        Stopped::Alarm(health) if known.names_gear() => {
            Stopped::AlarmBehindGear { health, gear: known.gear, keys: sheet.keys_of_motor() }
        }
        other => other,
    })?;
    let record = leg.record.clone()?;
    let told = if plan.motor_alone { Record { link: None, ..record } } else { record };
    let identified = identify(&told, sheet, known);
    Ok(Recorded { plan, share, leg, load, identified })
}

fn sequence(
    stand: &mut dyn Stand,
    plan: &Plan,
    known: &PlantData,
    design: impl FnOnce(&mut Identified) -> Result<DriveDesign, Error>,
) -> Result<Report, Stopped> {
    let (old, home_rad) = (stand.designed(), stand.at_rad());
    let (sheet, limit) = (sheet_of(&old), old.max_current_a());
    let mut made = identified_by(stand, plan, &sheet, known)?;
    let is_weak = |refusal: &Refusal| matches!(refusal, Refusal::Weak { .. } | Refusal::Alike { .. });
    if made.identified.as_ref().is_err_and(is_weak) && plan.most_peak_a > plan.peak_a {
        made = identified_by(stand, &Plan { peak_a: plan.most_peak_a, ..*plan }, &sheet, known)?;
    }
    let Recorded { plan, share, leg: recorded, load, identified } = made;
    let (record, recorded_peak_rad) = (recorded.record.clone()?, recorded.peak_rad());
    let mut identified = identified.map_err(Stopped::Refused)?;
    let designed = design(&mut identified).map_err(|error| Stopped::Design(error.to_string()))?;
    let (jump_a, settled) = swapped(stand, &designed, plan.swap)?;

    let u_max = (CURRENT * limit - load).max(LEAST_CURRENT * limit);
    let ticks = fewest(stand, &identified.sheet, plan.verify_rad, plan.verify_s, u_max)?;
    let to_rad = stand.at_rad() + plan.verify_rad;
    let friction_a = identified.parameter("f_c").map_or(0.0, |it| it.value);
    let found = Found {
        sheet: identified.sheet,
        spring_damping_n_m_s: identified.spring_damping_n_m_s,
        friction_a,
        cogging: identified.cogging,
        lag_s: known.lag_s,
    };
    let expected_rad = found.peak_rad(&designed, [stand.at_rad(), to_rad], ticks);
    let followed = record.link.as_ref().unwrap_or(&record.motor);
    let bar_rad = LEAST_BAR_RAD.max(TIMES_EXPECTED * expected_rad.unwrap_or(0.0)) + BAR_STEPS * followed.step_rad;
    // Not worse than the recorded moves; each peak is a count with half a count of rounding.
    let bar_rad = bar_rad.min(recorded_peak_rad + followed.step_rad);
    let verify = moved(stand, to_rad, ticks)?;
    let of_verification = verify.record.as_ref().unwrap_or(&record);
    let most_residual_steps = identified.link.map(|_| most_residual_steps(of_verification, &identified.sheet, known));
    let verified = Verified {
        move_s: f64::from(ticks) * stand.period_s(),
        peak_rad: verify.peak_rad(),
        true_peak_rad: verify.true_error.as_ref().map(|errors| largest(errors.iter().copied())),
        bar_rad,
        expected_rad,
        // Without a count no residual can be computed.
        residual_steps: verify.record.as_ref().map_or(Some(f64::INFINITY), |record| identified.left_over(record)),
        most_residual_steps,
    };
    let explains = verified.residual_steps.is_none_or(|steps| most_residual_steps.is_some_and(|most| steps <= most));
    let is_good = verified.peak_rad <= bar_rad;
    // The old gains move home with the limits of the recording.
    let (outcome, of_home, least_s, current) = if is_good && explains {
        (Outcome::Accepted, identified.sheet, 1.0, u_max)
    } else {
        swapped(stand, &old, plan.swap)?;
        let outcome = if is_good { Outcome::BackForTheLink } else { Outcome::BackForTheMove };
        (outcome, sheet, plan.move_s, share)
    };
    let way_rad = home_rad - stand.at_rad();
    // Lifting the weight may need more current than the recording.
    let ticks = fewest(stand, &of_home, way_rad, least_s, current)
        .or_else(|_| fewest(stand, &of_home, way_rad, least_s, u_max))?;
    let home = moved(stand, home_rad, ticks)?;
    Ok(Report {
        record,
        identified,
        designed,
        peak_a: plan.peak_a,
        recorded_peak_rad,
        jump_a,
        settling_rad: settled.peak_rad(),
        verified,
        outcome,
        home_rad: home.peak_rad(),
        marks: [settled.from_s, verify.from_s, home.from_s],
        ticks: [recorded, settled, verify, home].iter().flat_map(Leg::rows).collect(),
    })
}

#[cfg(test)]
mod tests;
