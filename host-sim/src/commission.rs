//! A drive commissions itself: it records a move, is re-tuned from the record, and shows that it is better.
//!
//! ```text
//! record   planned moves to and fro; the current shaken by a multisine        gains of the data sheet
//! identify parameters from counts and current (module identify)               or a refusal, and nothing changes
//! swap     at rest, W := 0 (EncoderForm::at_rest)                             the design of what was found
//! verify   a move of 1 rad, as short as 70 % of the current allow             peak of y - r, residual of the link
//! keep it, or swap back; then home
//! ```
//!
//! Accepted is a move with abs(y - r) <= 1e-4 rad + 2.5 steps of the link's encoder whose record the link with the new
//! parameters explains (0.6 steps rms). The move alone does not see every wrong link, that residual does; neither sees
//! a
//! wrong motor, which does no harm in this move.
//!
//! The swap at rest drops the offset W. A loop with wrong parameters swings a little: the rule for swaps in motion
//! (u does not jump) would freeze the instant's difference of the demands into W, and that takes 1/α to go.
//!
//! Here plant and drive are those of a scenario. What the program sees of them are counts, current and health.

use std::fmt;
use std::ops::ControlFlow;

use controller_core::Health;
use controller_core::drive::ALARMS;
use loop_sim::actuator::Actuator;
use loop_sim::closed_loop::{Loop, LoopError, close_loop};
use loop_sim::plant::Plant;
use loop_sim::port::drive::{DriveDesign, Goal, LivePort, Motion};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::sensor::Sensor;
use loop_sim::sensor::encoder::Mounted;
use loop_sim::signal::Signal;
use loop_sim::solver;
use loop_sim::trace::{Ending, Row};
use scenario::Experiment;

use crate::identify::record::unwrapped;
use crate::identify::{Angle, Identified, Known, MOST_RESIDUAL_STEPS, Record, Refusal, Sheet, identify};

mod multisine;
pub mod plants;
mod retuned;

pub use multisine::multisine;
pub use retuned::{Retuned, sheet_of};

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
/// A plan that takes longer is none, s.
const LONGEST_S: f64 = 20.0;
/// Bar of the verification: rad, and steps of the link's encoder: two, and half a step by which a count is off itself.
const BAR: (f64, f64) = (1e-4, 2.5);

/// What is recorded, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Way of the recorded moves, rad.
    pub way_rad: f64,
    /// Time of each at least, s.
    pub move_s: f64,
    /// Peak of the multisine, A: at least five times the friction.
    pub peak_a: f64,
    /// Its seed.
    pub seed: u64,
    /// Way of the verification, rad.
    pub verify_rad: f64,
}

impl Plan {
    /// For a joint 0.6 rad in 2 s with 27 % of the current, for a motor 3 rad in 0.6 s with 90 %.
    pub fn of(designed: &DriveDesign) -> Self {
        let limit = limit_a(designed);
        match designed {
            DriveDesign::Joint { .. } => {
                Self { way_rad: 0.6, move_s: 2.0, peak_a: 0.27 * limit, seed: 1, verify_rad: 1.0 }
            }
            DriveDesign::Motor { .. } => {
                Self { way_rad: 3.0, move_s: 0.6, peak_a: 0.9 * limit, seed: 1, verify_rad: 1.0 }
            }
        }
    }
}

/// Largest current of either sign, A.
pub fn limit_a(designed: &DriveDesign) -> f64 {
    let limits = match designed {
        DriveDesign::Motor { design, .. } => design.limits,
        DriveDesign::Joint { design, .. } => design.limits,
    };
    limits.max.min(-limits.min)
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
    /// A monitor of the drive fired.
    Alarm(Health),
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
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => write!(f, "the record is refused: {refusal}"),
            Self::Lost { at_s } => write!(f, "the record is refused: a count was lost at {at_s:.3} s; repeat it"),
            Self::Alarm(health) => write!(
                f,
                "an alarm while the record was made ({health:?}): look for what pushes, or say more in [monitor]"
            ),
            Self::TooFar { way_rad } => {
                write!(f, "no move of {way_rad} rad stays within the current: take a shorter way")
            }
            Self::Design(why) => write!(f, "no drive can be made of what was found: {why}"),
            Self::Broken(why) => f.write_str(why),
            Self::Interrupted => f.write_str("stopped on request"),
        }
    }
}

impl std::error::Error for Stopped {}

/// How the verification went.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Verified {
    /// Time of the move, s.
    pub move_s: f64,
    /// Largest abs(y - r) by the counts, rad.
    pub peak_rad: f64,
    /// The same of the true angle: a simulation knows it.
    pub true_peak_rad: f64,
    /// What it may be.
    pub bar_rad: f64,
    /// What the new link leaves of its record, steps rms; none of a motor.
    pub residual_steps: Option<f64>,
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
#[derive(Clone, Debug)]
pub struct Report {
    /// The record.
    pub record: Record,
    /// What it says.
    pub identified: Identified,
    /// The design that was tried.
    pub designed: DriveDesign,
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
    /// y, r (rad) and u (A) of every tick.
    pub ticks: Vec<[f64; 3]>,
    /// Ticks of swap, verification, way home.
    pub marks: [usize; 3],
}

/// A plant later than it thinks, with more current than it is told.
struct Later<'a> {
    plant: &'a dyn Plant,
    from_s: f64,
    more: &'a Signal,
    jumps_s: Vec<f64>,
}

impl Plant for Later<'_> {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let t_s = t_s + self.from_s;
        self.plant.rhs(t_s, x, u + self.more.value(t_s), dx);
    }
    /// Nobody asks for it here.
    fn lumped(&self, _: f64, _: &[f64], _: f64, d: &mut [f64]) {
        d.fill(0.0);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.plant.fastest_rad_s(t_s + self.from_s, x, u).max(self.more.fastest_rad_s())
    }
    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

/// The drive with its multisine, and what went in and out.
struct Shaken {
    drive: Box<dyn LivePort>,
    /// From this tick on.
    wave: (usize, Vec<f64>),
    counts: [Vec<f64>; 2],
    reference: Vec<f64>,
    held: Vec<f64>,
    health: Health,
}

impl ControllerPort for Shaken {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let mut tick = self.drive.tick(sample)?;
        let k = self.reference.len();
        for (counts, count) in self.counts.iter_mut().zip(sample) {
            counts.push(*count);
        }
        self.reference.push(self.drive.reference());
        self.health |= tick.health;
        let (first, wave) = &self.wave;
        // A drive that gives up is not shaken.
        if let Some(more) = k.checked_sub(*first).and_then(|k| wave.get(k))
            && !tick.health.intersects(Health::STOPPED | Health::INPUT_REJECTED)
        {
            tick.u += more;
        }
        Ok(tick)
    }
    fn report_applied(&mut self, u: f64) {
        self.held.push(u);
        self.drive.report_applied(u);
    }
    fn reset(&mut self) -> Result<(), PortError> {
        self.drive.reset()
    }
    fn observed(&self) -> &[usize] {
        self.drive.observed()
    }
    fn follows(&self) -> Option<usize> {
        self.drive.follows()
    }
    fn reference(&self) -> f64 {
        self.drive.reference()
    }
}

/// Plant and drive of a scenario, tick after tick.
pub struct Rig<'a> {
    plant: &'a dyn Plant,
    sensor: &'a mut dyn Sensor,
    actuator: &'a mut dyn Actuator,
    more: Signal,
    port: Shaken,
    designed: DriveDesign,
    mounted: Vec<Mounted>,
    x: Vec<f64>,
    true_error: Vec<f64>,
    period_s: f64,
    /// At rest there, rad.
    at_rad: f64,
    /// Is told of every tick, and may end all.
    watch: &'a mut dyn FnMut() -> ControlFlow<()>,
}

impl<'a> Rig<'a> {
    /// Of a scenario that has just been read, with a current `more` that nobody knows of on top of what is held.
    ///
    /// # Errors
    /// When it is of no drive that follows a position, or its design is refused.
    pub fn new(
        experiment: &'a mut Experiment,
        more: Signal,
        watch: &'a mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Self, Stopped> {
        let Some(drive) = experiment.drive.as_ref().filter(|_| experiment.port.follows() == Some(0)) else {
            return Err(Stopped::Design("a drive is commissioned that follows a position: [joint], or [motor]".into()));
        };
        let designed = drive.designed;
        let (period_s, at_rad) = (experiment.period_s, drive.motion.from_rad);
        let still = rest(at_rad, period_s);
        let live = designed.live(&still).map_err(|error| Stopped::Design(error.to_string()))?;
        let port = Shaken {
            drive: live,
            wave: (0, Vec::new()),
            counts: [const { Vec::new() }; 2],
            reference: Vec::new(),
            held: Vec::new(),
            health: Health::OK,
        };
        let mounted = designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        Ok(Self {
            plant: experiment.plant.as_ref(),
            sensor: experiment.sensor.as_mut(),
            actuator: experiment.actuator.as_mut(),
            more,
            port,
            designed,
            mounted,
            x: experiment.x0.clone(),
            true_error: Vec::new(),
            period_s,
            at_rad,
            watch,
        })
    }

    fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.period_s).round() as usize
    }

    /// Ticks that were made.
    fn now(&self) -> usize {
        self.port.reference.len()
    }

    fn run(&mut self, ticks: usize) -> Result<(), Stopped> {
        if ticks == 0 {
            return Ok(());
        }
        let from_s = self.now() as f64 * self.period_s;
        let jumps_s = self.plant.jumps_s().iter().map(|jump| jump - from_s).filter(|jump| *jump > 0.0).collect();
        let later = Later { plant: self.plant, from_s, more: &self.more, jumps_s };
        let (mut last, mut held) = (self.x.clone(), 0.0);
        let broken = |error: LoopError| Stopped::Broken(error.to_string());
        let (watch, true_error) = (&mut *self.watch, &mut self.true_error);
        let setup = Loop {
            plant: &later,
            sensor: &mut *self.sensor,
            port: &mut self.port,
            actuator: &mut *self.actuator,
            report: true,
            x0: &self.x,
            period_s: self.period_s,
            periods: ticks - 1,
        };
        let mut see = |row: &Row| {
            let states = last.len();
            last.copy_from_slice(&row.x[..states]);
            held = row.u_held;
            true_error.push(row.x[0] - row.r);
            watch()
        };
        match close_loop(setup, &mut see).map_err(broken)? {
            Ending::Finished => {}
            Ending::Interrupted { .. } => return Err(Stopped::Interrupted),
            ending => return Err(Stopped::Broken(format!("the run ended early: {ending:?}"))),
        }
        // To the beginning of the next tick.
        let [from, to] = [ticks - 1, ticks].map(|k| k as f64 * self.period_s);
        solver::advance(&later, from, to, held, &mut last).map_err(|error| Stopped::Broken(error.to_string()))?;
        self.x = last;
        Ok(())
    }

    /// A motion within this current from rest, from the next tick on.
    fn motion(&self, sheet: &Sheet, way_rad: f64, least_s: f64, u_max: f64) -> Result<Motion, Stopped> {
        let start = self.now() as u32 + 1;
        let wanted =
            Motion { goal: Goal::Rest { angle_rad: self.at_rad + way_rad }, start, ..rest(self.at_rad, self.period_s) };
        let range = [least_s, LONGEST_S].map(|seconds| self.ticks(seconds) as u32);
        let found = match sheet {
            Sheet::Joint(joint) => wanted.shortest::<4, 5>(range, u_max, |jet| joint.feed_forward(jet)),
            Sheet::Motor(motor) => wanted.shortest::<3, 3>(range, u_max, |jet| motor.feed_forward(jet)),
        };
        found.ok_or(Stopped::TooFar { way_rad })
    }

    /// Along a motion, and so long at its end.
    fn go(&mut self, motion: &Motion, after_s: f64) -> Result<(), Stopped> {
        self.port.drive.play(motion);
        if let Goal::Rest { angle_rad } = motion.goal {
            self.at_rad = angle_rad;
        }
        let end = motion.start as usize + motion.ticks as usize + self.ticks(after_s);
        self.run(end.saturating_sub(self.now()))
    }

    /// The record of these ticks.
    fn record(&self, from: usize, to: usize) -> Result<Record, Stopped> {
        let angle = |i: usize| -> Result<Angle, Stopped> {
            let counts = &self.port.counts[i][..to];
            if let Some(k) = counts.iter().position(|count| count.is_nan()) {
                return Err(Stopped::Lost { at_s: k as f64 * self.period_s });
            }
            let mut angle = unwrapped(counts.iter().copied(), &self.mounted[i]);
            angle.rad.drain(..from);
            Ok(angle)
        };
        let first = angle(0)?;
        let (link, motor) = if self.mounted.len() > 1 { (Some(first), angle(1)?) } else { (None, first) };
        Ok(Record { period_s: self.period_s, link, motor, held_a: self.port.held[from..to].to_vec() })
    }

    /// y by the counts of the first encoder, rad, in the turn of the reference; NaN where one was lost.
    fn angles(&self) -> Vec<f64> {
        let mounted = &self.mounted[0];
        let span = (1_u64 << mounted.encoder.bits) as f64 * mounted.encoder.unit_rad();
        let of = |(count, r): (&f64, &f64)| {
            let Some(count) = mounted.upright(*count) else { return f64::NAN };
            let angle = f64::from(count) * mounted.encoder.unit_rad();
            angle + span * ((r - angle) / span).round()
        };
        self.port.counts[0].iter().zip(&self.port.reference).map(of).collect()
    }

    /// Largest abs(y - r) of these ticks by the counts, and truly.
    fn peaks(&self, from: usize, to: usize) -> [f64; 2] {
        let largest = |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0_f64, |most, error| most.max(error.abs()));
        let angles = self.angles();
        let mut by_counts = (from..to).map(|k| angles[k] - self.port.reference[k]);
        [largest(&mut by_counts), largest(&mut self.true_error[from..to].iter().copied())]
    }

    /// Another design of the same form, at rest; how u jumps, and how far y goes off in the time after.
    fn swap(&mut self, to: &DriveDesign) -> Result<[f64; 2], Stopped> {
        self.port.drive.retune(to, true).map_err(|error| Stopped::Design(error.to_string()))?;
        let at = self.now();
        self.run(self.ticks(SETTLE_S))?;
        let jump = self.port.held[at] - self.port.held[at.saturating_sub(1)];
        Ok([jump.abs(), self.peaks(at, self.now())[0]])
    }

    /// Moves to and fro under the multisine, up to when the swap may be.
    fn make_record(&mut self, plan: &Plan, sheet: &Sheet, share: f64) -> Result<Record, Stopped> {
        let resonance = match sheet {
            Sheet::Joint(joint) => libm::sqrt(
                joint.stiffness_n_m / joint.motor_inertia_kg_m2 + joint.stiffness_n_m / joint.link_inertia_kg_m2,
            ),
            Sheet::Motor(_) => 0.0,
        };
        // How long a way takes is known before it begins, and the multisine begins before.
        let move_ticks = self.motion(sheet, plan.way_rad, plan.move_s, share)?.ticks as usize;
        let [from, rest] = [SHAKE_AFTER_S, 2.0 * REST_S - SHAKE_AFTER_S].map(|seconds| self.ticks(seconds));
        let ticks = rest + 2 * move_ticks;
        self.port.wave = (from, multisine(plan.peak_a, ticks, self.period_s, resonance, plan.seed));
        self.run(self.ticks(REST_S))?;
        let there = self.motion(sheet, plan.way_rad, plan.move_s, share)?;
        self.go(&there, REST_S)?;
        let back = self.motion(sheet, -plan.way_rad, plan.move_s, share)?;
        self.go(&back, REST_S)?;
        let record = self.record(0, self.now())?;
        // A drive that refused its counts held something else.
        if self.port.health.intersects(ALARMS | Health::INPUT_REJECTED) {
            return Err(Stopped::Alarm(self.port.health));
        }
        self.run((from + ticks + self.ticks(CALM_S)).saturating_sub(self.now()))?;
        Ok(record)
    }

    /// The move that verifies, planned with what was found.
    fn verify(&mut self, plan: &Plan, identified: &Identified, u_max: f64, bar_rad: f64) -> Result<Verified, Stopped> {
        let from = self.now();
        let motion = self.motion(&identified.sheet, plan.verify_rad, 1.0, u_max)?;
        self.go(&motion, AFTER_S)?;
        let [peak_rad, true_peak_rad] = self.peaks(from, self.now());
        // Where a count was lost nothing is explained.
        let record = self.record(from, self.now());
        let residual_steps = record.map_or(Some(f64::INFINITY), |record| identified.left_over(&record));
        let move_s = f64::from(motion.ticks) * self.period_s;
        Ok(Verified { move_s, peak_rad, true_peak_rad, bar_rad, residual_steps })
    }

    /// The whole sequence. `design` makes a drive of what was found; the form must stay.
    ///
    /// # Errors
    /// Why it ended early.
    pub fn commission(
        mut self,
        plan: &Plan,
        known: &Known,
        design: impl FnOnce(&mut Identified) -> Result<DriveDesign, String>,
    ) -> Result<Report, Stopped> {
        let (old, limit) = (self.designed, limit_a(&self.designed));
        let (sheet, home_rad) = (sheet_of(&old), self.at_rad);
        // A data sheet that is off by half in each number asks for a third of what is needed.
        let share = (limit - plan.peak_a).max(0.1 * limit) / 3.0;
        let record = self.make_record(plan, &sheet, share)?;
        let recorded_peak_rad = self.peaks(0, record.held_a.len())[0];
        let mut identified = identify(&record, &sheet, known).map_err(Stopped::Refused)?;
        let designed = design(&mut identified).map_err(Stopped::Design)?;

        let resting = &self.port.held[self.now() - self.ticks(SETTLE_S / 2.0).min(self.now())..];
        let load = (resting.iter().sum::<f64>() / resting.len() as f64).abs();
        let swapped = self.now();
        let [jump_a, settling_rad] = self.swap(&designed)?;

        let verify_from = self.now();
        let u_max = (CURRENT * limit - load).max(LEAST_CURRENT * limit);
        let bar_rad = match &record.link {
            Some(link) => BAR.0 + BAR.1 * link.step_rad,
            None => recorded_peak_rad,
        };
        let verified = self.verify(plan, &identified, u_max, bar_rad)?;
        let most = MOST_RESIDUAL_STEPS + known.noise_steps;
        let explains = verified.residual_steps.is_none_or(|steps| steps <= most);
        let is_good = verified.peak_rad <= bar_rad.min(recorded_peak_rad);
        // With the old gains as carefully as the record was made.
        let (outcome, of_home, least_s, current) = if is_good && explains {
            (Outcome::Accepted, identified.sheet, 1.0, u_max)
        } else {
            self.swap(&old)?;
            let outcome = if is_good { Outcome::BackForTheLink } else { Outcome::BackForTheMove };
            (outcome, sheet, plan.move_s, share)
        };
        let home_from = self.now();
        let home = self.motion(&of_home, home_rad - self.at_rad, least_s, current)?;
        self.go(&home, AFTER_S)?;
        let home_peak_rad = self.peaks(home_from, self.now())[0];
        let angles = self.angles();
        let ticks = (0..self.now()).map(|k| [angles[k], self.port.reference[k], self.port.held[k]]).collect();
        Ok(Report {
            record,
            identified,
            designed,
            recorded_peak_rad,
            jump_a,
            settling_rad,
            verified,
            outcome,
            home_rad: home_peak_rad,
            ticks,
            marks: [swapped, verify_from, home_from],
        })
    }
}

/// At rest for ever.
fn rest(at_rad: f64, period_s: f64) -> Motion {
    Motion { goal: Goal::Rest { angle_rad: at_rad }, from_rad: at_rad, start: 0, ticks: 1, period_s }
}

#[cfg(test)]
mod tests;
