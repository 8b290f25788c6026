//! A drive commissions itself: it records a move, is re-tuned from the record, and shows that it is better.
//!
//! ```text
//! record   planned moves to and fro; the current shaken by a multisine        gains of the data sheet
//! identify parameters from counts and current (module identify)               or a refusal, and nothing changes
//! swap     at rest, W := 0 (EncoderForm::at_rest)                             the design of what was found
//! verify   a move of 1 rad, as short as 70 % of the current allow             peak of y - r, residual of a link
//! keep it, or swap back; then home
//! ```
//!
//! Accepted is a move with abs(y - r) <= B + 2.5 steps of the encoder that is followed; of a joint the link with the
//! new parameters must explain the record of the move too (0.6 steps rms), if its count was in the record that they
//! are from. B is 1e-4 rad, or twice what the same move leaves when it is simulated on the joint or motor as it was
//! found (module `predicted`), whichever is more, and never more than a step above what the recorded moves left. The
//! move alone does not see every wrong link, that residual does; neither sees a wrong motor of a joint, which does no
//! harm in this move. A motor with a rigid load is asked for a move as short as its current allows: there b counts, and
//! b that is 20 % wrong is seen.
//!
//! The swap at rest drops the offset W. A loop with wrong parameters swings a little: the rule for swaps in motion
//! (u does not jump) would freeze the instant's difference of the demands into W, and that takes 1/α to go.
//!
//! The sequence stands once and knows no drive: what it needs of one is a [`Stand`]. That is plant and drive of a
//! scenario ([`Rig`]), or a drive at the end of a wire (in `host-sim`). It sees counts, current, health.

use std::fmt;
use std::ops::ControlFlow;

use controller_core::Health;
use controller_core::drive::ALARMS;
use loop_sim::port::PortError;
use loop_sim::port::drive::{DriveDesign, Goal, Motion};
use loop_sim::sensor::encoder::Mounted;

use crate::Error;
use crate::identify::{Identified, Known, Record, Refusal, Sheet, identify, most_residual_steps};
use crate::kind::Kind;

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
/// From the end of the multisine to the swap, and from there to the verification, s.
const CALM_S: f64 = 0.45;
const SETTLE_S: f64 = 0.4;
/// The multisine begins so long after the drive, s.
const SHAKE_AFTER_S: f64 = 0.1;
/// After a move it is looked at for so long, s.
const AFTER_S: f64 = 0.25;
/// Share of the current that a verification may ask for, the load's apart, and the least share that is left of it.
const CURRENT: f64 = 0.7;
const LEAST_CURRENT: f64 = 0.3;
/// The current that lifts the weight of the data sheet is this many times as large if weight and torque constant are
/// off.
const LIFTED: f64 = 1.5;
/// Without the link's count the link is seen by its own swinging: moves to and fro, ever shorter and quicker, over the
/// way of the recorded ones; each as quick as this share of the usual current allows (with all of it four of 32 corners
/// of ±50 % stayed at the limit until an alarm, with half of it two), but no quicker than that.
const CHIRP: [f64; 8] = [0.36, 0.36, 0.24, 0.24, 0.15, 0.15, 0.09, 0.09];
const CHIRP_CURRENT: f64 = 0.36;
const LEAST_CHIRP_S: f64 = 0.3;
/// A plan that takes longer is none, s.
const LONGEST_S: f64 = 20.0;
/// Bar of the verification, rad: at least so much, or so many times what is expected of the move on the joint or motor
/// as it was found (cogging, ripple and load are not in it), and steps of the encoder that is followed: two, and half a
/// step by which a count is off itself.
pub const LEAST_BAR_RAD: f64 = 1e-4;
/// See [`LEAST_BAR_RAD`].
pub const TIMES_EXPECTED: f64 = 2.0;
/// See [`LEAST_BAR_RAD`].
pub const BAR_STEPS: f64 = 2.5;

/// What is recorded, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Way of the recorded moves, rad.
    pub way_rad: f64,
    /// Time of each at least, s.
    pub move_s: f64,
    /// Peak of the multisine, A: at least five times the friction.
    pub peak_a: f64,
    /// The record is made again with this peak if it says too little, A; 0 for not.
    pub most_peak_a: f64,
    /// Its seed.
    pub seed: u64,
    /// Way of the verification, rad.
    pub verify_rad: f64,
    /// Time of it at least, s.
    pub verify_s: f64,
    /// How the new design takes over.
    pub swap: Swap,
    /// Is the link's count left out of the record? Of a joint; the drive has it all the same.
    pub motor_alone: bool,
}

/// How a new design takes over: at rest, or as what that is better than.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Swap {
    /// Without an offset W: u jumps a little.
    AtRest,
    /// Without a jump of u, as in motion.
    InMotion,
    /// Not at all: the move that verifies is that of the old gains.
    None,
}

impl Plan {
    /// For a joint 0.6 rad in 2 s with 27 % of the current, as a whole with half of it, and 80 % if that says too
    /// little; for a motor 3 rad in 0.6 s with all of it.
    pub fn of(designed: &DriveDesign) -> Self {
        let plan = Kind::of(designed).plan;
        let [peak_a, most_peak_a] = [plan.peak_a, plan.most_peak_a].map(|share| share * designed.max_current_a());
        Self { peak_a, most_peak_a, ..plan }
    }
}

/// Why it came to no end.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Stopped {
    /// The record says too little, or something else. The old gains are still there.
    Refused(Refusal),
    /// An encoder gave no count.
    Lost {
        /// s.
        at_s: f64,
    },
    /// Ticks came late.
    Late {
        /// So many.
        ticks: u32,
    },
    /// A monitor of the drive fired.
    Alarm(Health),
    /// The same during the record, of a plant behind a gear.
    AlarmBehindGear {
        /// The alarms.
        health: Health,
        /// Turns of the motor in one behind its gear.
        gear: f64,
        /// Keys of torque constant and inertia of the motor.
        keys: [&'static str; 2],
    },
    /// No move of this way is within the current.
    TooFar {
        /// rad.
        way_rad: f64,
    },
    /// No drive can be made of what was found.
    Design(String),
    /// Plant or drive broke.
    Broken(String),
    /// On request.
    Interrupted,
    /// Any of these, and the drive could not be given back what it had.
    Left {
        /// Why it came to no end.
        stopped: Box<Stopped>,
        /// Why what was there before is not back.
        why: Box<Stopped>,
    },
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => write!(f, "the record is refused: {refusal}"),
            Self::Lost { at_s } => write!(f, "the record is refused: a count was lost at {at_s:.3} s; repeat it"),
            Self::Late { ticks } => write!(
                f,
                "the record is refused: {ticks} ticks came late; repeat it, and if it stays so, the interrupt of the \
                 drive takes too long"
            ),
            Self::Alarm(health) => write!(
                f,
                "an alarm ({health:?}){}: look for what pushes, or say more in [monitor]",
                if health.contains(Health::STOPPED) { " has stopped the drive, reset it (host-sim live)" } else { "" }
            ),
            Self::AlarmBehindGear { health, gear, keys: [torque, inertia] } => write!(
                f,
                "{}; or a number of the data sheet is that of the output of the gear of {gear}: {torque} and {inertia} \
                 are of the motor's own shaft, the output's are {gear} times and {} times as large",
                Self::Alarm(*health),
                gear * gear
            ),
            Self::TooFar { way_rad } => {
                write!(f, "no move of {way_rad} rad stays within the current: take a shorter way (--way, --verify)")
            }
            Self::Design(why) => write!(f, "no drive can be made of what was found: {why}"),
            Self::Broken(why) => f.write_str(why),
            Self::Interrupted => f.write_str("stopped on request"),
            Self::Left { stopped, why } => {
                write!(f, "{stopped}; AND THE GAINS OF BEFORE ARE NOT BACK: {why}; see what runs there (host-sim live)")
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

/// How the verification went.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Verified {
    /// Time of the move, s.
    pub move_s: f64,
    /// Largest abs(y - r) by the counts, rad.
    pub peak_rad: f64,
    /// The same of the true angle: a simulation knows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_peak_rad: Option<f64>,
    /// What it may be.
    pub bar_rad: f64,
    /// The same move simulated on the joint or motor as it was found; none where that comes to no end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_rad: Option<f64>,
    /// What the new link leaves of its record, steps rms; none of a motor.
    pub residual_steps: Option<f64>,
    /// What it may leave; none of a motor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_residual_steps: Option<f64>,
}

/// What follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The new gains stay.
    Accepted,
    /// The old ones are back: the move was not good enough.
    BackForTheMove,
    /// The old ones are back: the link is not as it was found.
    BackForTheLink,
}

/// All that happened.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// The record.
    #[serde(skip)]
    pub record: Record,
    /// What it says.
    #[serde(skip)]
    pub identified: Identified,
    /// The design that was tried.
    #[serde(skip)]
    pub designed: DriveDesign,
    /// Peak of the multisine, A.
    pub peak_a: f64,
    /// Largest abs(y - r) of the recorded moves, by the counts, rad.
    pub recorded_peak_rad: f64,
    /// Jump of u at the swap, A.
    pub jump_a: f64,
    /// Largest abs(y - r) from there to the verification, rad.
    pub settling_rad: f64,
    /// The verification.
    pub verified: Verified,
    /// Accepted, or swapped back.
    pub outcome: Outcome,
    /// Largest abs(y - r) on the way home, with the gains that stay, rad.
    pub home_rad: f64,
    /// t (s), y, r (rad) and u (A) of all that was recorded.
    #[serde(skip)]
    pub ticks: Vec<[f64; 4]>,
    /// Times of swap, verification, way home, s.
    #[serde(skip)]
    pub marks: [f64; 3],
}

/// Is called every few ticks with their number, and may end the sequence.
pub type OnTicks<'a> = dyn FnMut(u64) -> ControlFlow<()> + 'a;

/// What shakes: a [`multisine`] from a time on, for so long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shake {
    /// It begins here, s.
    pub from_s: f64,
    /// It lasts so long, s.
    pub for_s: f64,
    /// Its peak, A.
    pub peak_a: f64,
    /// Resonance of the joint, rad/s; 0 for a motor.
    pub resonance_rad_s: f64,
    /// Seed of its phases.
    pub seed: u64,
}

impl Shake {
    /// A current for each of so many rows.
    pub fn wave(&self, rows: usize, period_s: f64) -> Vec<f64> {
        let [from, count] = [self.from_s, self.for_s].map(|seconds| (seconds / period_s).round() as usize);
        let wave = multisine(self.peak_a, count, period_s, self.resonance_rad_s, self.seed);
        std::iter::repeat_n(0.0, from).chain(wave).chain(std::iter::repeat(0.0)).take(rows).collect()
    }
}

/// What was recorded between two rests.
#[derive(Clone, Debug)]
pub struct Leg {
    /// Time of the first row, s.
    pub from_s: f64,
    /// Time of a row, s.
    pub period_s: f64,
    /// Angle of the first encoder in the turn of the reference, rad; NaN where the count was lost.
    pub y: Vec<f64>,
    /// Reference, rad.
    pub r: Vec<f64>,
    /// Current that was held, A.
    pub held_a: Vec<f64>,
    /// The same as a record; why there is none.
    pub record: Result<Record, Stopped>,
    /// True y - r, where it is known.
    pub true_error: Option<Vec<f64>>,
    /// Status flags of all its ticks.
    pub health: Health,
}

impl Leg {
    /// Largest abs(y - r), rad.
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

/// The angle of an upright count in the turn of a reference, rad; NaN of one that was lost.
pub fn turned(count: Option<i32>, r: f64, mounted: &Mounted) -> f64 {
    let Some(count) = count else { return f64::NAN };
    let span = (1_u64 << mounted.encoder.bits) as f64 * mounted.encoder.unit_rad();
    let angle = f64::from(count) * mounted.encoder.unit_rad();
    angle + span * ((r - angle) / span).round()
}

/// Where a drive is commissioned.
pub trait Stand {
    /// What it begins with.
    fn designed(&self) -> DriveDesign;

    /// Period of its ticks, s.
    fn period_s(&self) -> f64;

    /// At rest there, rad.
    fn at_rad(&self) -> f64;

    /// From now on, and at most so long, it is recorded; meanwhile it may be shaken.
    ///
    /// # Errors
    /// When it cannot be reached.
    fn begin(&mut self, shake: Option<&Shake>, most_s: f64) -> Result<(), Stopped>;

    /// What was recorded.
    ///
    /// # Errors
    /// When it cannot be reached, or is asked to stop.
    fn end(&mut self) -> Result<Leg, Stopped>;

    /// Nothing happens for so long.
    ///
    /// # Errors
    /// As above.
    fn rest(&mut self, seconds: f64) -> Result<(), Stopped>;

    /// From rest to rest in so many ticks.
    ///
    /// # Errors
    /// As above, or when the drive refuses it.
    fn go(&mut self, to_rad: f64, ticks: u32) -> Result<(), Stopped>;

    /// Another design of the same form takes over, with W = 0 (`at_rest`) or without a jump of u; by how much it jumps,
    /// A.
    ///
    /// # Errors
    /// As above, or when the drive refuses it.
    fn swap(&mut self, to: &DriveDesign, at_rest: bool) -> Result<f64, Stopped>;

    /// After a sequence that came to no end: nothing shakes, and what was there before is back.
    ///
    /// # Errors
    /// Why it is not.
    fn give_up(&mut self) -> Result<(), Stopped> {
        Ok(())
    }
}

/// The fewest ticks of a motion from rest within this current, and no fewer than of `least_s`.
fn fewest(stand: &dyn Stand, sheet: &Sheet, way_rad: f64, least_s: f64, u_max: f64) -> Result<u32, Stopped> {
    let (at_rad, period_s) = (stand.at_rad(), stand.period_s());
    let wanted = Motion { goal: Goal::Rest { angle_rad: at_rad + way_rad }, ..Motion::rest(at_rad, period_s) };
    let range = [least_s, LONGEST_S].map(|seconds| (seconds / period_s).round() as u32);
    sheet.shortest(&wanted, range, u_max).map(|motion| motion.ticks).ok_or(Stopped::TooFar { way_rad })
}

/// Moves to and fro under the multisine, up to when the swap may be; what was recorded on the way, and how much is
/// held at the end.
fn make_record(stand: &mut dyn Stand, plan: &Plan, sheet: &Sheet, share: f64) -> Result<(Leg, f64), Stopped> {
    let resonance_rad_s = sheet.resonance_rad_s();
    // How long a way takes is known before it begins, and the multisine begins before.
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
    // A drive that refused its counts held something else.
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

/// Another design, and what follows.
fn swapped(stand: &mut dyn Stand, to: &DriveDesign, how: Swap) -> Result<(f64, Leg), Stopped> {
    let jump_a = if how == Swap::None { 0.0 } else { stand.swap(to, how == Swap::AtRest)? };
    stand.begin(None, SETTLE_S)?;
    stand.rest(SETTLE_S)?;
    Ok((jump_a, stand.end()?))
}

/// A move, and a look at its end.
fn moved(stand: &mut dyn Stand, to_rad: f64, ticks: u32) -> Result<Leg, Stopped> {
    stand.begin(None, f64::from(ticks) * stand.period_s() + AFTER_S)?;
    stand.go(to_rad, ticks)?;
    stand.rest(AFTER_S)?;
    stand.end()
}

/// The whole sequence. `design` makes a drive of what was found; the form must stay.
///
/// # Errors
/// Why it ended early; the drive has the gains of before then, or it is [said](Stopped::Left) why not.
pub fn commission(
    stand: &mut dyn Stand,
    plan: &Plan,
    known: &Known,
    design: impl FnOnce(&mut Identified) -> Result<DriveDesign, Error>,
) -> Result<Report, Stopped> {
    sequence(stand, plan, known, design).map_err(|stopped| match stand.give_up() {
        Ok(()) => stopped,
        Err(why) => Stopped::Left { stopped: Box::new(stopped), why: Box::new(why) },
    })
}

/// A record, and what it says.
struct Recorded {
    /// As it was made, and the share of the current that its moves may ask for, A.
    plan: Plan,
    share: f64,
    leg: Leg,
    /// What is held at its end, A.
    load: f64,
    identified: Result<Identified, Refusal>,
}

fn identified_by(stand: &mut dyn Stand, plan: &Plan, sheet: &Sheet, known: &Known) -> Result<Recorded, Stopped> {
    let limit = stand.designed().max_current_a();
    // A data sheet that is off by half in each number asks for a third of what is needed.
    let mut share = (limit - plan.peak_a).max(0.1 * limit) / 3.0;
    let mut plan = *plan;
    // A weight has to be lifted besides, and is shaken by what is left.
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
    known: &Known,
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
    // In no case worse than before; each of both is a count, and may be off by half a step.
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
        // Where a count was lost nothing is explained.
        residual_steps: verify.record.as_ref().map_or(Some(f64::INFINITY), |record| identified.left_over(record)),
        most_residual_steps,
    };
    let explains = verified.residual_steps.is_none_or(|steps| most_residual_steps.is_some_and(|most| steps <= most));
    let is_good = verified.peak_rad <= bar_rad;
    // With the old gains as carefully as the record was made.
    let (outcome, of_home, least_s, current) = if is_good && explains {
        (Outcome::Accepted, identified.sheet, 1.0, u_max)
    } else {
        swapped(stand, &old, plan.swap)?;
        let outcome = if is_good { Outcome::BackForTheLink } else { Outcome::BackForTheMove };
        (outcome, sheet, plan.move_s, share)
    };
    let way_rad = home_rad - stand.at_rad();
    // A weight that was lifted may need more than the record did.
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
