//! The runs that every controller makes, and what is read off them.
//!
//! With τ twice the time in which a file that says no other goes 1 rad (the shortest within 90 % of the limit for a
//! plant that is 20 % too weak and 20 % too heavy):
//!
//! | figure | run |
//! |---|---|
//! | S | a sine of 0.5 rad and period 4τ, joined in τ: rms of y - r over the next τ |
//! | noise | the same run: rms of u less the u that finer encoders make (see [`metrics::noise`]) |
//! | M | 1 rad in τ, degree 7: largest of abs(y - r) up to τ/4 after it |
//! | settle | from rest at 0.1 rad, the shortest planned recovery: after that abs(y) stays within a tenth of it |
//! | load | 0.14 of the largest torque as a step at 0.3 τ: largest of abs(y - r) |
//! | ultimate | the same over the last τ/20, up to τ/2 after the step |
//! | shown | 1 rad in τ, the load at 1.4 τ, up to 2 τ, with friction: for the eye, in no figure of merit |
//!
//! Where the file declares noise of an encoder, the noise of u is that of 3000 ticks of the sine, or at rest, the more:
//! what a declared noise makes through a slow loop varies slowly. All other figures are without it. τ is longer then,
//! as slow loops must settle in it.
//!
//! An encoder before a gear tells where the shaft is within half a span of its counter only: where 0.4 of that is less
//! than 0.1 rad, the recovery starts there.
//!
//! Corners: for a joint $k_1 = K/J_l$, $b_1$, $k_2 = K/J_m$, $b_2$, $b = K_t/J_m$ are each off by ±p, all 32 of them;
//! for a motor J and K_t by ±p or 0, the 8 but the nominal one. In the cost four of the former (all +, all -, K_t/J_m
//! against the others) and the four in which both are off stand for all.
//!
//! The loop is that of [`close_loop`]; a plant without friction is moved in steps eight times as long, which nobody
//! sees (test `a_longer_step_changes_nothing_that_is_told`).

use std::iter;
use std::ops::ControlFlow;
use std::path::Path;

use controller_core::drive::Encoder;
use loop_sim::actuator::{Delayed, Ideal, Limited};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::metrics;
use loop_sim::plant::{Plant, Regime};
use loop_sim::port::ControllerPort;
use loop_sim::port::drive::{DriveDesign, Follows, Form, Motion};
use loop_sim::port::finer::Finer;
use loop_sim::sensor::encoder::{Encoders, Mounted};
use loop_sim::sensor::{Sensing, Sensor};
use loop_sim::trace::{Recorder, Row, Trace};
use scenario::{Experiment, ScenarioError, Sensed, Source};
use serde::Serialize;

use super::linear::Sampled;
use super::task::Task;
use super::{Design, Linear};
use crate::Error;
use crate::kind::Kind;

/// What a run that came to nothing counts, rad or s.
pub const LOST: f64 = 100.0;
/// Beyond this error a run has come to nothing, rad.
const AWAY_RAD: f64 = 3.0;
/// From where the recovery starts at most, rad, and as a share of what a counter tells of either side of 0, where the
/// weight of a link draws the motor farther; and the share of it that is settled.
const START_RAD: f64 = 0.1;
const START_SHARE: f64 = 0.4;
const SETTLED: f64 = 0.1;
/// Load step over the largest torque.
const LOAD: f64 = 0.14;
/// Coulomb and static friction and cogging of the run that is shown, over the largest torque, where the file has no
/// friction.
const SHOWN_FRICTION: [f64; 3] = [0.03, 0.03, 0.01];

/// What a controller does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Rms of u that comes of the encoders' steps, A.
    pub noise_a: f64,
    /// S of the nominal plant, rad.
    pub sine_rad: f64,
    /// M, rad.
    pub move_rad: f64,
    /// Of the load step, rad.
    pub load_rad: f64,
    /// After it, rad.
    pub ultimate_rad: f64,
    /// Settling of the recovery, s.
    pub settle_s: f64,
    /// M, worst corner of ±20 %.
    pub move_20_rad: f64,
    /// Load, worst corner of ±20 %.
    pub load_20_rad: f64,
    /// S, worst corner of ±50 %.
    pub sine_50_rad: f64,
    /// Load, worst corner of ±50 %.
    pub load_50_rad: f64,
    /// Corners whose loop is not strictly stable: of ±50 % with the law at rest, and of ±20 % with the fast gain set,
    /// if it has one, frozen.
    pub unstable: usize,
}

/// Figures of the runs with one plant.
#[derive(Clone, Copy)]
struct Five {
    sine: f64,
    moved: f64,
    load: f64,
    ultimate: f64,
    settle: f64,
}

impl Five {
    fn mean_log(&self) -> f64 {
        let Self { sine, moved, load, ultimate, settle } = *self;
        [sine, moved, load, ultimate, settle].map(|x| libm::log10(x.max(1e-12))).iter().sum::<f64>() / 5.0
    }

    fn worse(self, other: Self) -> Self {
        Self {
            sine: self.sine.max(other.sine),
            moved: self.moved.max(other.moved),
            load: self.load.max(other.load),
            ultimate: self.ultimate.max(other.ultimate),
            settle: self.settle.max(other.settle),
        }
    }
}

/// What a controller does at its worst over some plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// S, rad.
    pub sine_rad: f64,
    /// M, rad.
    pub move_rad: f64,
    /// Of the load step at rest, rad.
    pub load_rad: f64,
    /// Settling of the recovery, s.
    pub settle_s: f64,
    /// Corners that were run.
    pub corners: usize,
    /// Those whose loop is not strictly stable, with any gain set of its own.
    pub unstable: usize,
    /// Largest magnitude of an eigenvalue over all corners and gain sets.
    pub spectral_radius: f64,
}

/// A run that comes to nothing in some corner.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Lost {
    /// Which.
    pub run: &'static str,
    /// In so many corners.
    pub corners: usize,
    /// The first of them.
    pub first: String,
}

/// A run but for its plant.
struct Run {
    task: Task,
    x0: Vec<f64>,
    periods: usize,
}

/// One plant: free of load, loaded, and near rest.
struct Corner {
    /// What of it is off.
    name: String,
    free: Box<dyn Plant>,
    loaded: Box<dyn Plant>,
    sampled: Sampled,
    /// Rates of the plant over those that its steps are made for.
    coarse: f64,
    /// Does it stand for the others in the cost?
    is_chosen: bool,
}

/// All runs of a scenario file.
pub struct Bench {
    /// Name of the scenario.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Our drive as the file has it.
    pub designed: DriveDesign,
    /// τ, s.
    pub tau_s: f64,
    sine: Run,
    moved: Run,
    recovery: Run,
    /// At rest while the load comes.
    pushed: Run,
    shown: (Run, Box<dyn Plant>),
    /// Where the recovery starts, rad.
    pub start_rad: f64,
    finer: Finer,
    noisy: Option<Noisy>,
    load_s: f64,
    rest: Task,
    nominal: Corner,
    at_20: Vec<Corner>,
    at_50: Vec<Corner>,
}

/// A plant that is moved in steps so many times as long.
struct Coarse<'a>(&'a dyn Plant, f64);

impl Plant for Coarse<'_> {
    fn order(&self) -> usize {
        self.0.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.0.rhs(t_s, x, u, dx);
    }
    fn regime(&self, t_s: f64, x: &[f64], u: f64) -> Regime {
        self.0.regime(t_s, x, u)
    }
    fn rhs_in(&self, regime: Regime, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.0.rhs_in(regime, t_s, x, u, dx);
    }
    fn margin(&self, regime: Regime, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.0.margin(regime, t_s, x, u)
    }
    /// Nobody asks for it here.
    fn lumped(&self, _: f64, _: &[f64], _: f64, d: &mut [f64]) {
        d.fill(0.0);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.0.fastest_rad_s(t_s, x, u) / self.1
    }
    fn jumps_s(&self) -> &[f64] {
        self.0.jumps_s()
    }
}

/// The scenario file with more keys set.
struct Base<'a> {
    file: &'a str,
    toml: &'a str,
    sets: &'a [String],
    designed: DriveDesign,
}

impl Base<'_> {
    fn with(&self, sets: &[&str]) -> Result<Experiment, ScenarioError> {
        // Friction that fades: where it holds, encoders of two steps let the shaft go at other instants, and the noise
        // of u is not told by their difference.
        let faded = [format!("friction.model={:?}", "faded")];
        let common = ["fault=[]", "error={}", "load=[]", "drive.uncertain_percent=20"];
        let more = common.iter().chain(sets).map(ToString::to_string);
        let sets: Vec<String> = faded.into_iter().chain(self.sets.iter().cloned()).chain(more).collect();
        scenario::parse(&Source { file: self.file, text: self.toml, sets: &sets }, "compare")
    }

    /// At rest at this angle before the reference begins.
    fn starting(&self, angle_rad: f64, sets: &[&str]) -> Result<Experiment, ScenarioError> {
        let plant = self.designed.name();
        self.with(&[&[format!("{plant}.start_rad={angle_rad}").as_str()], sets].concat())
    }

    fn run(&self, start_rad: f64, reference: &str, span_s: f64) -> Result<Run, Error> {
        let no_run = |error: ScenarioError| {
            Error::input(format!("no run can be made of it that laws are compared by: {error}")).at(self.file)
        };
        let found = self.starting(start_rad, &[reference, &format!("span_s={span_s}")]).map_err(no_run)?;
        let motion = found.drive.map(|drive| drive.motion).ok_or_else(|| Error::failed("no drive").at(self.file))?;
        let task = Task::new(self.designed, motion, found.periods);
        Ok(Run { task, x0: found.x0, periods: found.periods })
    }

    /// A plant by its name, what of it is off, and whether it stands for others.
    fn corner(&self, (name, error, is_chosen): (String, String, bool), load: &str) -> Result<Corner, Error> {
        let with = |sets: &[&str]| self.with(&[&[error.as_str()], sets].concat());
        let bare = with(&["friction={}"])?;
        let sampled = Sampled::new(bare.plant.as_ref(), bare.period_s).map_err(|error| error.to_string())?;
        let (free, loaded) = (with(&[])?.plant, with(&[load])?.plant);
        let at_rest = vec![0.0; free.order()];
        let is_smooth = free.fastest_rad_s(0.0, &at_rest, 0.0) <= bare.plant.fastest_rad_s(0.0, &at_rest, 0.0);
        let coarse = if is_smooth { 8.0 } else { 1.0 };
        Ok(Corner { name, free, loaded, sampled, coarse, is_chosen })
    }

    /// A share of the largest torque, N m.
    fn torque(&self, share: f64) -> f64 {
        share * self.designed.torque_n_m_per_a() * self.designed.max_current_a()
    }

    /// The key of a load.
    fn load(&self, t0_s: f64) -> String {
        format!("load=[{{kind = \"step\", amplitude = {}, t0_s = {t0_s}}}]", self.torque(LOAD))
    }
}

/// Seed of the declared noise: the same for every law.
const NOISE_SEED: u64 = 1;

/// Ticks over which declared noise is averaged at least: a slow loop lets it through slowly.
const NOISE_TICKS: f64 = 3000.0;

/// Encoders with noise that the file declares, and the longer runs that tell what it makes of u.
struct Noisy {
    /// Standard deviation in each state, rad.
    noise_rad: Vec<f64>,
    sine: Run,
    rest: Run,
}

impl Noisy {
    /// None without noise.
    fn of(found: &Experiment, base: &Base<'_>, sine: &str, tau_s: f64) -> Result<Option<Self>, Error> {
        let mut noise_rad = vec![0.0; found.plant.order()];
        for sensed in found.at_rest.iter().flat_map(|at_rest| &at_rest.sensed) {
            noise_rad[sensed.state] = sensed.noise;
        }
        if noise_rad.iter().all(|noise| *noise == 0.0) {
            return Ok(None);
        }
        let span_s = tau_s + tau_s.max(NOISE_TICKS * found.period_s);
        let rest = base.run(0.0, "reference={kind = \"rest\"}", span_s)?;
        Ok(Some(Self { noise_rad, sine: base.run(0.0, sine, span_s)?, rest }))
    }
}

/// How many times as long the runs take for declared noise: 1 without. The noise of u goes with about the 2.5th power
/// of w_c, so a loop that lets as little of it through as of the steps alone is so much slower, and must settle; a half
/// on top, since less noise may be asked for.
fn slower(found: &Experiment) -> f64 {
    let of = |sensed: &Sensed| {
        let steps = sensed.quantum / f64::sqrt(12.0);
        if sensed.noise > 0.0 { 1.5 * libm::pow(sensed.rms / steps, 0.4) } else { 1.0 }
    };
    found.at_rest.iter().flat_map(|at_rest| &at_rest.sensed).map(of).fold(1.0, f64::max)
}

/// Noise of the encoder that has the least of it, in its steps.
fn noise_steps(designed: &DriveDesign, noise_rad: &[f64]) -> f64 {
    let of =
        |(state, mounted): &(usize, Mounted)| noise_rad.get(*state).map_or(0.0, |it| it / mounted.encoder.unit_rad());
    designed.encoders().iter().map(of).fold(f64::INFINITY, f64::min)
}

/// The drive of a file, if laws can be compared with it, and the encoders that tell its noise.
fn compared(found: &Experiment) -> Result<(DriveDesign, Finer), &'static str> {
    let drive = found.drive.as_ref().ok_or("this is for drives, and the file has neither [joint] nor [motor]")?;
    if drive.designed.form().follows == Follows::Speed {
        return Err("drive.mode is \"speed\": only laws that follow a position are compared");
    }
    let finer = Finer::of(&drive.designed).ok_or(
        "encoder: noise of u is told by an encoder with at least twice as many counts, and with 2^24 in a turn, gear \
         included, a drive has no room for more: compare with one bit less",
    )?;
    // A load that is asked about may be more than its monitors allow.
    // Laws are compared and tuned; a band at rest hides the noise of any.
    Ok((drive.designed.telling().without_rest_band(), finer))
}

impl Bench {
    /// Of a scenario file of a motor or a joint.
    ///
    /// # Errors
    /// What is wrong with the file, or that nothing of it can be compared.
    pub fn new(file: &str, text: &str, sets: &[String]) -> Result<Self, Error> {
        let stem = Path::new(file).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let as_it_is = scenario::parse(&Source { file, text, sets }, &stem)?;
        let (designed, finer) = compared(&as_it_is).map_err(|what| Error::input(what).at(file))?;
        let base = Base { file, toml: text, sets, designed };
        let move_to = |to: f64, more: &str| format!("reference={{kind = \"move\", to_rad = {to}{more}}}");

        let shortest = base.starting(0.0, &[&move_to(1.0, "")])?;
        let t = shortest.period_s;
        let ticks = 2 * shortest.drive.as_ref().map_or(1, |drive| drive.motion.ticks);
        let ticks = (f64::from(ticks) * slower(&as_it_is)).round();
        let tau_s = ticks * t;
        let sine = format!(
            "reference={{kind = \"sine\", amplitude_rad = 0.5, frequency_hz = {}, duration_s = {tau_s}}}",
            0.25 / tau_s
        );
        let noisy = Noisy::of(&as_it_is, &base, &sine, tau_s)?;
        let sine = base.run(0.0, &sine, 2.0 * tau_s)?;
        let one_rad = move_to(1.0, &format!(", duration_s = {tau_s}"));
        let moved = base.run(0.0, &one_rad, 1.25 * tau_s)?;
        let load_s = f64::from(((0.3 * tau_s) / t).round() as u32) * t;
        let encoders = designed.encoders();
        let told_rad = encoders.iter().map(|(_, mounted)| START_SHARE * half_span_rad(mounted.encoder));
        let start_rad = told_rad.fold(START_RAD, f64::min);
        let recovery = base.run(start_rad, &move_to(0.0, ""), load_s + 0.5 * tau_s)?;
        let pushed = base.run(0.0, "reference={kind = \"rest\"}", load_s + 0.5 * tau_s)?;
        let rest = Motion::rest(0.0, t);

        let load = base.load(load_s);
        let nominal = base.corner(("the data sheet as it is".into(), "error={}".into(), true), &load)?;
        let late = base.load(1.4 * tau_s);
        let [coulomb, still, cogging] = SHOWN_FRICTION.map(|share| base.torque(share));
        let friction = format!(
            "friction={{coulomb_n_m = {coulomb}, static_n_m = {still}, cogging_n_m = {cogging}, model = \"faded\"}}"
        );
        let rough = (nominal.coarse > 1.0).then_some(friction.as_str());
        let rubbing = base.with(&[late.as_str()].into_iter().chain(rough).collect::<Vec<_>>())?.plant;
        let shown = base.run(0.0, &one_rad, 2.0 * tau_s)?;
        let all = |p: f64| {
            (Kind::of(&designed).corners)(p)
                .into_iter()
                .map(|off| base.corner(off, &load))
                .collect::<Result<_, Error>>()
        };
        Ok(Self {
            noisy,
            finer,
            start_rad,
            name: as_it_is.name,
            title: as_it_is.title,
            designed,
            tau_s,
            sine,
            moved,
            recovery,
            pushed,
            shown: (shown, rubbing),
            load_s,
            rest: Task::new(designed, rest, 1),
            nominal,
            at_20: all(0.2)?,
            at_50: all(0.5)?,
        })
    }

    /// What a controller is given that holds rest at angle 0.
    pub fn task(&self) -> &Task {
        &self.rest
    }

    /// Number of corners of ±20 % and ±50 % each.
    pub fn corners(&self) -> usize {
        self.at_50.len()
    }

    /// What is off in them, each by itself: of a joint the ratios of its numbers, since nothing else moves it.
    pub fn uncertain(&self) -> &'static [&'static str] {
        Kind::of(&self.designed).uncertain
    }

    /// Is the plant less known than 20 %, by what the file says of it?
    pub fn is_uncertain(&self) -> bool {
        let share = match &self.designed {
            DriveDesign::Motor(motor) => motor.monitors.uncertain,
            DriveDesign::Joint(joint) => joint.monitors.uncertain,
        };
        share > 0.2
    }

    /// Largest current of either sign, A.
    pub fn max_current_a(&self) -> f64 {
        self.designed.max_current_a()
    }

    /// Limits of the noise of u, A, that a comparison takes where nobody says others: for a joint 1/3000, 1/1000 and
    /// 1/300 of the largest current, for a motor, which is measured and pushed in one place, 3/1000, 1/100 and 3/100.
    pub fn noise_limits_a(&self) -> [f64; 3] {
        Kind::of(&self.designed).noise_shares.map(|share| share * self.max_current_a())
    }

    /// The cost that tuning makes small: half the mean of log10 of S, M, load, ultimate error and settling of the
    /// nominal plant, half that of the worst of four corners of ±20 %; 0.3 log10 of the worst S of four at ±50 %; 10
    /// log10 of the noise over its limit, where it is above; 0.2 for each corner that is not strictly stable.
    pub fn cost(&self, design: &dyn Design, limit_a: f64) -> f64 {
        let noise = self.noise(design);
        let nominal = self.five(design, &self.nominal);
        // 5 figures of LOST, 32 corners: a law that cannot even do this costs more than any other.
        if nominal.sine >= LOST || nominal.moved >= LOST || nominal.load >= LOST || noise.is_infinite() {
            return 20.0 + nominal.mean_log();
        }
        let over = if noise > limit_a { 10.0 * libm::log10(noise / limit_a) } else { 0.0 };
        let chosen = |corners: &[Corner], f: &dyn Fn(&Corner) -> Five| {
            corners.iter().filter(|corner| corner.is_chosen).map(f).reduce(Five::worse).unwrap_or(nominal)
        };
        let worst = chosen(&self.at_20, &|corner| self.five(design, corner));
        let wide = chosen(&self.at_50, &|corner| Five { sine: self.sine_of(design, corner), ..nominal });
        0.5 * (nominal.mean_log() + worst.mean_log())
            + 0.3 * libm::log10(wide.sine.max(1e-12))
            + over
            + 0.2 * self.unstable(design) as f64
    }

    /// All figures, over all corners.
    pub fn figures(&self, design: &dyn Design) -> Figures {
        let nominal = self.five(design, &self.nominal);
        let worst = |corners: &[Corner], f: &dyn Fn(&Corner) -> f64| corners.iter().map(f).fold(0.0, f64::max);
        let load = |corner: &Corner| self.load_of(design, corner).0;
        Figures {
            noise_a: self.noise(design),
            sine_rad: nominal.sine,
            move_rad: nominal.moved,
            load_rad: nominal.load,
            ultimate_rad: nominal.ultimate,
            settle_s: nominal.settle,
            move_20_rad: worst(&self.at_20, &|corner| self.move_of(design, corner)),
            load_20_rad: worst(&self.at_20, &load),
            sine_50_rad: worst(&self.at_50, &|corner| self.sine_of(design, corner)),
            load_50_rad: worst(&self.at_50, &load),
            unstable: self.unstable(design),
        }
    }

    /// At its worst over the nominal plant and the corners of ±20 %, or of ±50 %: over all of them, or over those that
    /// stand for all. Whether it is stable is asked of all.
    pub fn worst(&self, design: &dyn Design, is_wide: bool, all: bool) -> Worst {
        let corners = if is_wide { &self.at_50 } else { &self.at_20 };
        let run = corners.iter().filter(|corner| all || corner.is_chosen);
        let of = |corner: &Corner| Five { load: self.pushed_of(design, corner), ..self.five(design, corner) };
        let five = run.clone().map(of).fold(of(&self.nominal), Five::worse);
        let laws = design.linear();
        let radii =
            corners.iter().map(|corner| laws.iter().map(|(law, _)| law.radius(&corner.sampled)).fold(0.0, f64::max));
        let radii: Vec<f64> = radii.collect();
        Worst {
            sine_rad: five.sine,
            move_rad: five.moved,
            load_rad: five.load,
            settle_s: five.settle,
            corners: run.count(),
            unstable: radii.iter().filter(|radius| **radius >= 1.0 - 1e-9).count(),
            spectral_radius: radii.into_iter().fold(0.0, f64::max),
        }
    }

    /// The runs that come to nothing in one of the plants of [`worst`](Self::worst).
    pub fn lost(&self, design: &dyn Design, is_wide: bool) -> Vec<Lost> {
        type Of = fn(&Bench, &dyn Design, &Corner) -> f64;
        let runs: [(&str, Of); 4] = [
            ("settling", |it, design, corner| it.load_of(design, corner).2),
            ("move", Self::move_of),
            ("load", Self::pushed_of),
            ("sine", Self::sine_of),
        ];
        let corners = || iter::once(&self.nominal).chain(if is_wide { &self.at_50 } else { &self.at_20 });
        let lost = |(run, of): (&'static str, Of)| {
            let mut lost = corners().filter(|corner| of(self, design, corner) >= LOST);
            let first = lost.next()?.name.clone();
            Some(Lost { run, corners: 1 + lost.count(), first })
        };
        runs.into_iter().filter_map(lost).collect()
    }

    /// The same with the nominal plant alone.
    pub fn nominal(&self, design: &dyn Design) -> Worst {
        let five = Five { load: self.pushed_of(design, &self.nominal), ..self.five(design, &self.nominal) };
        let of = |(law, _): &(Linear, f64)| law.radius(&self.nominal.sampled);
        let spectral_radius = design.linear().iter().map(of).fold(0.0, f64::max);
        Worst {
            sine_rad: five.sine,
            move_rad: five.moved,
            load_rad: five.load,
            settle_s: five.settle,
            corners: 0,
            unstable: usize::from(spectral_radius >= 1.0 - 1e-9),
            spectral_radius,
        }
    }

    /// Rms of u that comes of the encoders' steps, A; infinite if the run comes to nothing.
    pub fn noise_a(&self, design: &dyn Design) -> f64 {
        self.noise(design)
    }

    /// A move and a load step with the nominal plant, tick by tick: time (s), y - r (rad), u (A); to where it came.
    pub fn shown(&self, design: &dyn Design) -> Vec<[f64; 3]> {
        let (run, plant) = &self.shown;
        let mut ticks = Vec::with_capacity(run.periods + 1);
        let mut see = |row: &Row, error: f64| ticks.push([row.t_s, error, row.u]);
        self.run(run, design, plant.as_ref(), &mut see);
        ticks
    }

    fn five(&self, design: &dyn Design, corner: &Corner) -> Five {
        let (load, ultimate, settle) = self.load_of(design, corner);
        let sine = self.sine_of(design, corner);
        Five { sine, moved: self.move_of(design, corner), load, ultimate, settle }
    }

    fn sine_of(&self, design: &dyn Design, corner: &Corner) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        let ended =
            self.run(&self.sine, design, &Coarse(corner.free.as_ref(), corner.coarse), &mut |row: &Row, error: f64| {
                if row.t_s >= self.tau_s {
                    (sum, count) = (sum + error * error, count + 1.0);
                }
            });
        if ended { libm::sqrt(sum / count) } else { LOST }
    }

    fn move_of(&self, design: &dyn Design, corner: &Corner) -> f64 {
        let mut peak = 0.0_f64;
        let ended =
            self.run(&self.moved, design, &Coarse(corner.free.as_ref(), corner.coarse), &mut |_: &Row, error: f64| {
                peak = peak.max(error.abs());
            });
        if ended { peak } else { LOST }
    }

    /// The largest error when the load comes at rest.
    fn pushed_of(&self, design: &dyn Design, corner: &Corner) -> f64 {
        let mut peak = 0.0_f64;
        let plant = Coarse(corner.loaded.as_ref(), corner.coarse);
        let ended = self.run(&self.pushed, design, &plant, &mut |_: &Row, error: f64| peak = peak.max(error.abs()));
        if ended { peak } else { LOST }
    }

    /// Load, ultimate error, settling. What has not settled when the load comes has not settled; a load whose error
    /// still grows by a tenth in the last fifth of its time has not shown its worst.
    fn load_of(&self, design: &dyn Design, corner: &Corner) -> (f64, f64, f64) {
        let (mut load, mut ultimate, mut settle) = (0.0_f64, 0.0_f64, 0.0);
        let (mut before, late_s) = (0.0_f64, self.load_s + 0.4 * self.tau_s);
        let last_s = self.load_s + 0.45 * self.tau_s;
        let ended = self.run(
            &self.recovery,
            design,
            &Coarse(corner.loaded.as_ref(), corner.coarse),
            &mut |row: &Row, error: f64| {
                if row.t_s > self.load_s {
                    load = load.max(error.abs());
                    if row.t_s <= late_s {
                        before = load;
                    }
                } else if row.x[0].abs() > SETTLED * self.start_rad {
                    settle = row.t_s + self.rest.model.period_s;
                }
                if row.t_s >= last_s {
                    ultimate = ultimate.max(error.abs());
                }
            },
        );
        if !ended {
            return (LOST, LOST, LOST);
        }
        let is_settled = settle < self.load_s - 0.5 * self.rest.model.period_s;
        let is_over = load <= 1.1 * before;
        (if is_over { load } else { LOST }, ultimate, if is_settled { settle } else { LOST })
    }

    /// One run, of which `see` is shown every row and y - r; did it come to its end?
    fn run(&self, run: &Run, design: &dyn Design, plant: &dyn Plant, see: &mut dyn FnMut(&Row, f64)) -> bool {
        let Some(mut port) = design.port(&run.task) else { return false };
        let mut is_near = true;
        let mut tick = 0;
        let mut record = |row: &Row| {
            // What the port says of its reference is not asked.
            let error = row.x[0] - run.task.aim(tick).jet[0];
            tick += 1;
            is_near = error.abs() <= AWAY_RAD;
            see(row, error);
            if is_near { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let ended = self.closed(run, port.as_mut(), plant, &mut record);
        ended && is_near
    }

    fn closed(&self, run: &Run, port: &mut dyn ControllerPort, plant: &dyn Plant, record: &mut dyn Recorder) -> bool {
        self.closed_on(run, &mut Encoders::new(run.task.designed.encoders()), port, plant, record)
    }

    fn closed_on(
        &self,
        run: &Run,
        sensor: &mut dyn Sensor,
        port: &mut dyn ControllerPort,
        plant: &dyn Plant,
        record: &mut dyn Recorder,
    ) -> bool {
        let limit = self.max_current_a();
        let Form { delay_ticks, .. } = self.designed.form();
        let setup = Loop {
            plant,
            sensor,
            port,
            actuator: &mut Limited::new(Delayed::new(Ideal, delay_ticks), -limit, limit),
            report: true,
            missed: &[],
            x0: &run.x0,
            period_s: self.rest.model.period_s,
            periods: run.periods,
        };
        close_loop(setup, record).is_ok()
    }

    /// Of the nominal plant on the sine; infinite if the run comes to nothing. Of encoders with declared noise the more
    /// of that on a longer sine and at rest: what the steps make there is in both.
    fn noise(&self, design: &dyn Design) -> f64 {
        let Some(Noisy { noise_rad, sine, rest }) = &self.noisy else {
            return self.noise_on(design, &self.sine, &[]);
        };
        self.noise_on(design, sine, noise_rad).max(self.noise_at_rest(design, rest, noise_rad))
    }

    fn noise_on(&self, design: &dyn Design, run: &Run, noise_rad: &[f64]) -> f64 {
        let fine = run.task.behind(&self.finer);
        let (Some(mut other), Some(trace)) = (design.port(&fine), self.noisy_run(design, run, noise_rad)) else {
            return f64::INFINITY;
        };
        let window_s = [self.tau_s, run.periods as f64 * fine.model.period_s];
        let mut sensor = Encoders::new(fine.designed.encoders());
        let told = metrics::noise(&trace, window_s, &[], &mut sensor, other.as_mut()).moving;
        let steps = noise_steps(&run.task.designed, noise_rad);
        let found = self.finer.share(steps) * told;
        if found.is_nan() { f64::INFINITY } else { found }
    }

    /// Rms of u of a drive that stands still under nothing but the noise.
    fn noise_at_rest(&self, design: &dyn Design, run: &Run, noise_rad: &[f64]) -> f64 {
        let Some(trace) = self.noisy_run(design, run, noise_rad) else { return f64::INFINITY };
        let late = &trace.rows[trace.rows.len() / 10..];
        (late.iter().map(|row| row.u * row.u).sum::<f64>() / late.len() as f64).sqrt()
    }

    /// A run of the nominal plant behind encoders with this noise; none if it comes to nothing.
    fn noisy_run(&self, design: &dyn Design, run: &Run, noise_rad: &[f64]) -> Option<Trace> {
        let mut port = design.port(&run.task)?;
        let mut trace = Trace {
            order: run.x0.len(),
            observed: Vec::new(),
            follows: Some(0),
            period_s: run.task.model.period_s,
            rows: Vec::with_capacity(run.periods + 1),
            ending: loop_sim::trace::Ending::Finished,
        };
        let plant = Coarse(self.nominal.free.as_ref(), self.nominal.coarse);
        let mut record = |row: &Row| {
            let r = run.task.aim(trace.rows.len()).jet[0];
            trace.rows.push(Row { r, ..*row });
            ControlFlow::Continue(())
        };
        let noise = Sensing { noise: noise_rad.to_vec(), ..Sensing::IDEAL };
        let mut sensor = Encoders::over(noise.sensor(NOISE_SEED), run.task.designed.encoders());
        self.closed_on(run, &mut sensor, port.as_mut(), &plant, &mut record).then_some(trace)
    }

    fn unstable(&self, design: &dyn Design) -> usize {
        let linear = design.linear();
        if linear.is_empty() {
            return self.at_50.iter().filter(|corner| !self.settles(design, &corner.sampled)).count();
        }
        let of = |(law, percent): &(Linear, f64)| {
            let corners = if *percent > 0.3 { &self.at_50 } else { &self.at_20 };
            corners.iter().filter(|corner| law.radius(&corner.sampled) >= 1.0 - 1e-9).count()
        };
        linear.iter().map(of).sum()
    }

    /// Of a law that is not linear: does the linear plant come back from 1 mrad, as far as encoders tell?
    fn settles(&self, design: &dyn Design, plant: &Sampled) -> bool {
        let Some(mut port) = design.port(&self.rest) else { return false };
        let limit = self.max_current_a();
        let mounted = self.rest.designed.encoders();
        let mut actuator = Limited::new(Delayed::new(Ideal, self.designed.form().delay_ticks), -limit, limit);
        let mut x = vec![0.0; plant.phi.nrows()];
        let mut sample = vec![0.0; x.len()];
        let steps: f64 = mounted.iter().map(|(_, mounted)| mounted.encoder.unit_rad()).fold(0.0, f64::max);
        let start = 1e-3_f64.max(10.0 * steps);
        for (state, _) in &mounted {
            x[*state] = start;
        }
        let ticks = (3.0 * self.tau_s / self.rest.model.period_s) as usize;
        let mut last = 0.0_f64;
        for k in 0..ticks {
            for (value, (state, mounted)) in sample.iter_mut().zip(&mounted) {
                *value = mounted.count(x[*state]);
            }
            let Ok(tick) = port.tick(&sample) else { return false };
            let u = loop_sim::actuator::Actuator::drive(&mut actuator, tick.u);
            port.report_applied(u);
            x = plant.next(&x, u);
            if x[0].abs() > AWAY_RAD || x[0].is_nan() {
                return false;
            }
            if 5 * k > 4 * ticks {
                last = last.max(x[0].abs());
            }
        }
        last <= 0.05 * start + 3.0 * steps
    }
}

/// The angle up to which the first count of an encoder tells where the shaft is, rad.
fn half_span_rad(encoder: Encoder) -> f64 {
    0.5 * (1_u64 << encoder.bits) as f64 * encoder.unit_rad()
}

#[cfg(test)]
mod tests {
    use super::super::{Contender, contenders, corners};
    use super::*;

    fn guessed(contender: &dyn Contender) -> Box<dyn Design> {
        let guesses: Vec<f64> = contender.knobs().iter().map(|knob| knob.guess).collect();
        contender.design(&guesses).expect("a design")
    }

    /// Nothing but the feed-forward leads the joint and the motor of the data sheet to 1 rad and round a sine; without
    /// gravity in it, or a tick late, it does not.
    #[test]
    fn the_feed_forward_alone_follows_on_the_plant_of_the_data_sheet() {
        for (text, lag) in [(scenario::JOINT, "joint.current_lag_s=0"), (scenario::MOTOR, "motor.current_lag_s=0")] {
            let sets = [lag.to_owned(), "friction={}".to_owned()];
            let bench = Bench::new("test.toml", text, &sets).expect("a file");
            let plant = bench.nominal.free.as_ref();
            for run in [&bench.sine, &bench.moved] {
                let peak = |late: usize, gravity: f64| {
                    let mut x = run.x0.clone();
                    let (mut peak, t) = (0.0_f64, run.task.model.period_s);
                    for k in 0..run.periods {
                        let aim = run.task.aim(k);
                        peak = peak.max((x[0] - aim.jet[0]).abs());
                        let late = run.task.aim(k.saturating_sub(late));
                        let u = late.feed + gravity * late.jet[0].sin();
                        let [from, to] = [k, k + 1].map(|k| k as f64 * t);
                        loop_sim::solver::advance(plant, from, to, u, &mut x).expect("a slow plant");
                    }
                    peak
                };
                let (alone, late, heavier) = (peak(0, 0.0), peak(1, 0.0), peak(0, 0.1));
                println!("{alone:.1e}, a tick late {late:.1e}, wrong gravity {heavier:.1e}");
                // Nothing corrects what the ticks cut: T²/12 r'' of a motor is 1.2e-4 rad at 1500 rad/s².
                assert!(
                    alone < 1.2e-4 && late > 10.0 * alone && heavier > 100.0 * alone,
                    "{alone:e} {late:e} {heavier:e}"
                );
            }
        }
    }

    /// A counter of 12 bits before a gear of 50 is over in 0.063 rad of the shaft: the recovery starts within that.
    #[test]
    fn a_gear_before_an_encoder_only_shortens_the_recovery() {
        let sets = ["motor.gear=[50, 1]", "encoder.bits=12"].map(String::from);
        let bench = Bench::new("motor.toml", scenario::MOTOR, &sets).expect("a drive that can be compared");
        assert!((bench.start_rad - 0.4 * std::f64::consts::PI / 50.0).abs() < 1e-12, "{}", bench.start_rad);
        assert_eq!(Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file").start_rad, START_RAD);
        let all = contenders(&bench);
        let five = bench.five(guessed(all[0].as_ref()).as_ref(), &bench.nominal);
        assert!(five.settle > 0.0 && five.settle < 0.2, "{}", five.settle);
    }

    /// Half the step makes half the noise (within 15 %: rounding is not quite white), down to where a drive reads no
    /// finer one; there the remedy is told.
    #[test]
    fn noise_is_told_of_fine_encoders_too() {
        let bench = |bits: u32| Bench::new("motor.toml", scenario::MOTOR, &[format!("encoder.bits={bits}")]);
        let noise = |bits: u32| {
            let bench = bench(bits).expect("a drive that can be compared");
            let all = contenders(&bench);
            // The same gains whatever the encoder.
            let knobs = [60.0; 8];
            let of = all.iter().find(|law| law.name().starts_with("P-PI")).expect("the cascade");
            let knobs = &knobs[..of.knobs().len()];
            bench.noise(of.design(knobs).expect("a design").as_ref())
        };
        let [coarse, fine, finest] = [18, 22, 23].map(noise);
        println!("{coarse:e} {fine:e} {finest:e}");
        assert!((coarse / fine / 16.0 - 1.0).abs() < 0.15 && (fine / finest / 2.0 - 1.0).abs() < 0.15);
        let refused = bench(24).err().expect("no finer encoder");
        assert!(refused.what.contains("compare with one bit less"), "{refused}");
    }

    #[test]
    fn every_law_follows_and_settles_on_the_plant_of_the_data_sheet() {
        let bench = Bench::new("joint.toml", scenario::JOINT, &[]).expect("a file");
        for contender in contenders(&bench) {
            let found = bench.five(guessed(contender.as_ref()).as_ref(), &bench.nominal);
            println!("{}: {:.1e} {:.1e} {:.3}", contender.name(), found.sine, found.moved, found.settle);
            // The super-twisting and the cascade are far from tuned.
            assert!(found.sine < 3e-4 && found.moved < 1e-3 && found.settle < 0.25, "{}", contender.name());
        }
    }

    #[test]
    fn a_longer_step_changes_nothing_that_is_told() {
        let bench = Bench::new("joint.toml", scenario::JOINT, &[]).expect("a file");
        let run = &bench.moved;
        let angles = |coarse: f64| -> Vec<f64> {
            let plant = Coarse(bench.nominal.free.as_ref(), coarse);
            let mut x = run.x0.clone();
            let ticks = (0..run.periods).map(|k| {
                let [from, to] = [k, k + 1].map(|k| k as f64 * 1e-3);
                loop_sim::solver::advance(&plant, from, to, run.task.aim(k).feed, &mut x).expect("a slow plant");
                x[0]
            });
            ticks.collect()
        };
        assert_eq!(bench.nominal.coarse, 8.0);
        let off = angles(1.0).iter().zip(angles(8.0)).map(|(exact, longer)| (exact - longer).abs()).fold(0.0, f64::max);
        println!("{off:.1e} rad");
        // A thousandth of the least error that is told of a joint.
        assert!(off < 1e-9 && off > 0.0, "{off:e}");
        // Friction is not smooth.
        assert_eq!(Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file").nominal.coarse, 1.0);
    }

    #[test]
    fn corners_are_all_there_and_those_that_stand_for_them_are_four() {
        for corners in [corners::of_joint(0.5), corners::of_joint(0.2), corners::of_motor(0.2)] {
            assert_eq!(corners.iter().filter(|(.., is_chosen)| *is_chosen).count(), 4);
            let mut texts: Vec<&String> = corners.iter().map(|(_, text, _)| text).collect();
            texts.dedup();
            assert_eq!(texts.len(), corners.len());
        }
        assert_eq!((corners::of_joint(0.5).len(), corners::of_motor(0.5).len()), (32, 8));
    }
}
