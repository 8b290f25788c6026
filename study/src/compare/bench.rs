//! Test runs of the controller comparison and the metrics that are computed from them.
//!
//! τ is twice the default duration of a 1 rad move. The default is the shortest move within 90 % of the current limit
//! for a plant with 20 % less torque constant and 20 % more inertia.
//!
//! | figure | run |
//! |---|---|
//! | S | sine of 0.5 rad and period 4τ, entered by a transition of τ: rms of y - r over the next τ |
//! | noise | the sine run: rms of u minus the u with finer encoders (see [`metrics::noise`]) |
//! | M | 1 rad in τ, degree 7: largest abs(y - r) up to τ/4 after the move |
//! | settle | from rest at 0.1 rad, the shortest planned recovery: time until abs(y) stays within a tenth of it |
//! | load | step of 0.14 of the largest torque at 0.3 τ: largest abs(y - r) |
//! | ultimate | the load run: largest abs(y - r) in the last τ/20, up to τ/2 after the step |
//! | shown | 1 rad in τ, load step at 1.4 τ, up to 2 τ, with friction: for plots only, not part of the cost |
//!
//! If the file declares encoder noise, the current noise is the larger value of a sine run of 3000 ticks and a run at
//! rest. A slow loop needs these longer runs because declared noise varies slowly behind it. All other metrics are
//! computed without declared noise. τ is longer in this case, so that slow loops settle.
//!
//! The first count of an encoder before a gear is unambiguous within half the span of its counter only. If 0.4 of this
//! angle is less than 0.1 rad, the recovery starts there.
//!
//! Corners of a joint: $k_1 = K/J_l$, $b_1$, $k_2 = K/J_m$, $b_2$, $b = K_t/J_m$ are each off by ±p, 32 corners.
//! Corners of a motor: J and K_t are off by ±p or 0, the 8 combinations without the nominal one. The cost uses four of
//! them. For a joint these are all +, all -, and K_t/J_m opposite to the others. For a motor both parameters are off.
//!
//! [`close_loop`] runs the loop. A plant without friction uses solver steps eight times as long; the effect is below
//! 1e-9 rad (test `a_longer_step_changes_nothing_that_is_told`).

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
use scenario::{AtRest, Experiment, ScenarioError, Sensed, Source};
use serde::Serialize;

use super::linear::Sampled;
use super::task::Task;
use super::{Design, Linear};
use crate::Error;
use crate::kind::DriveKind;

/// Value of a metric whose run failed, rad or s.
pub const LOST: f64 = 100.0;
/// Error beyond which a run counts as failed, rad.
const AWAY_RAD: f64 = 3.0;
/// Start of the recovery: largest angle, rad; largest share of the half span of a counter, since the weight of a link
/// moves the motor farther; settled band as a share of the start.
const START_RAD: f64 = 0.1;
const START_SHARE: f64 = 0.4;
const SETTLED: f64 = 0.1;
/// Load step as a share of the largest torque.
const LOAD: f64 = 0.14;
/// Coulomb friction, static friction and cogging of the plotted run as shares of the largest torque, used if the file
/// has no friction.
const SHOWN_FRICTION: [f64; 3] = [0.03, 0.03, 0.01];

/// Metrics of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Rms current noise from encoder quantisation, A.
    pub noise_a: f64,
    /// Metric S with the nominal plant, rad.
    pub sine_rad: f64,
    /// Metric M with the nominal plant, rad.
    pub move_rad: f64,
    /// Largest error under the load step, rad.
    pub load_rad: f64,
    /// Ultimate error after the load step, rad.
    pub ultimate_rad: f64,
    /// Settling time of the recovery, s.
    pub settle_s: f64,
    /// Metric M in the worst corner of ±20 %, rad.
    pub move_20_rad: f64,
    /// Load error in the worst corner of ±20 %, rad.
    pub load_20_rad: f64,
    /// Metric S in the worst corner of ±50 %, rad.
    pub sine_50_rad: f64,
    /// Load error in the worst corner of ±50 %, rad.
    pub load_50_rad: f64,
    /// Number of corners whose loop is not strictly stable: ±50 % with the controller at rest, and ±20 % with the high
    /// gains frozen, if there are any.
    pub unstable: usize,
}

/// Metrics of the runs with one plant.
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

/// Worst metrics of a controller over a set of plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Metric S, rad.
    pub sine_rad: f64,
    /// Metric M, rad.
    pub move_rad: f64,
    /// Largest error under a load step at rest, rad.
    pub load_rad: f64,
    /// Settling time of the recovery, s.
    pub settle_s: f64,
    /// Number of corners that were run.
    pub corners: usize,
    /// Number of corners whose loop is not strictly stable with any one of the gain sets.
    pub unstable: usize,
    /// Largest magnitude of an eigenvalue over all corners and gain sets.
    pub spectral_radius: f64,
}

/// A run that fails in at least one corner.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Lost {
    /// Name of the run.
    pub run: &'static str,
    /// Number of corners in which it fails.
    pub corners: usize,
    /// Name of the first of these corners.
    pub first: String,
}

/// Run without its plant.
struct Run {
    task: Task,
    x0: Vec<f64>,
    periods: usize,
}

/// One plant in three forms: without load, loaded, and near rest.
struct Corner {
    /// Deviation from the data sheet.
    name: String,
    free: Box<dyn Plant>,
    loaded: Box<dyn Plant>,
    sampled: Sampled,
    /// Ratio of its rates to the rates for which the solver steps are chosen.
    coarse: f64,
    /// Whether the cost uses this corner.
    is_chosen: bool,
}

/// All runs of a scenario file.
pub struct Bench {
    /// Name of the scenario.
    pub name: String,
    /// Title of the scenario.
    pub title: String,
    /// edo-smc drive of the file.
    pub designed: DriveDesign,
    /// τ, s.
    pub tau_s: f64,
    sine: Run,
    moved: Run,
    recovery: Run,
    /// Rest, with the load step.
    pushed: Run,
    shown: (Run, Box<dyn Plant>),
    /// Start angle of the recovery, rad.
    pub start_rad: f64,
    finer: Finer,
    noisy: Option<Noisy>,
    load_s: f64,
    rest: Task,
    /// Linear loop at rest, with the corners of the tolerance of the file.
    pub(crate) at_rest: Result<AtRest, ScenarioError>,
    nominal: Corner,
    at_20: Vec<Corner>,
    at_50: Vec<Corner>,
}

/// Plant with solver steps longer by this factor.
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
    /// The lumped disturbance is not used here.
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

/// Scenario file with more keys set.
struct Base<'a> {
    file: &'a str,
    toml: &'a str,
    sets: &'a [String],
    designed: DriveDesign,
}

impl Base<'_> {
    fn with(&self, sets: &[&str]) -> Result<Experiment, ScenarioError> {
        // Faded friction: with stiction, two runs with different quantisation break away at different times. Their
        // difference is then not the noise.
        let faded = [format!("friction.model={:?}", "faded")];
        let common = ["fault=[]", "error={}", "load=[]", "drive.uncertain_percent=20"];
        let more = common.iter().chain(sets).map(ToString::to_string);
        let sets: Vec<String> = faded.into_iter().chain(self.sets.iter().cloned()).chain(more).collect();
        scenario::parse(&Source { file: self.file, text: self.toml, sets: &sets }, "compare")
    }

    /// Parses the scenario with a start at rest at this angle.
    fn starting(&self, angle_rad: f64, sets: &[&str]) -> Result<Experiment, ScenarioError> {
        let plant = self.designed.name();
        self.with(&[&[format!("{plant}.start_rad={angle_rad}").as_str()], sets].concat())
    }

    fn run(&self, start_rad: f64, reference: &str, span_s: f64) -> Result<Run, Error> {
        let no_run = |error: ScenarioError| {
            Error::input(format!("no comparison run can be built from this scenario: {error}")).at(self.file)
        };
        let found = self.starting(start_rad, &[reference, &format!("span_s={span_s}")]).map_err(no_run)?;
        let motion = found.drive.map(|drive| drive.motion).ok_or_else(|| Error::failed("no drive").at(self.file))?;
        let task = Task::new(self.designed, motion, found.periods);
        Ok(Run { task, x0: found.x0, periods: found.periods })
    }

    /// Returns a plant from its name, its deviation and whether the cost uses it.
    fn corner(&self, (name, error, is_chosen): (String, String, bool), load: &str) -> Result<Corner, Error> {
        let with = |sets: &[&str]| self.with(&[&[error.as_str()], sets].concat());
        let bare = with(&["friction={}"])?;
        let sampled =
            Sampled::new(bare.plant.as_ref(), bare.period_s).map_err(|error| Error::input(error.to_string()))?;
        let (free, loaded) = (with(&[])?.plant, with(&[load])?.plant);
        let at_rest = vec![0.0; free.order()];
        let is_smooth = free.fastest_rad_s(0.0, &at_rest, 0.0) <= bare.plant.fastest_rad_s(0.0, &at_rest, 0.0);
        let coarse = if is_smooth { 8.0 } else { 1.0 };
        Ok(Corner { name, free, loaded, sampled, coarse, is_chosen })
    }

    /// Converts a share of the largest torque to N m.
    fn torque(&self, share: f64) -> f64 {
        share * self.designed.torque_n_m_per_a() * self.designed.max_current_a()
    }

    /// Returns the TOML line of the load step.
    fn load(&self, t0_s: f64) -> String {
        format!("load=[{{kind = \"step\", amplitude = {}, t0_s = {t0_s}}}]", self.torque(LOAD))
    }
}

/// Seed of the declared noise, equal for every controller.
const NOISE_SEED: u64 = 1;

/// Smallest number of ticks for the average of declared noise; a slow loop passes it slowly.
const NOISE_TICKS: f64 = 3000.0;

/// Declared encoder noise and the longer runs that measure its effect on u.
struct Noisy {
    /// Standard deviation in each state, rad.
    noise_rad: Vec<f64>,
    sine: Run,
    rest: Run,
}

impl Noisy {
    /// Returns `None` without declared noise.
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

/// Returns the factor by which declared noise lengthens the runs, 1 without noise. The current noise goes with about
/// the 2.5th power of w_c. A loop with the noise of quantisation alone is slower by this factor and must settle. The
/// factor includes another 1.5, since a user may request less noise.
fn slower(found: &Experiment) -> f64 {
    let of = |sensed: &Sensed| {
        let steps = sensed.quantum / f64::sqrt(12.0);
        if sensed.noise > 0.0 { 1.5 * libm::pow(sensed.rms / steps, 0.4) } else { 1.0 }
    };
    found.at_rest.iter().flat_map(|at_rest| &at_rest.sensed).map(of).fold(1.0, f64::max)
}

/// Returns the smallest noise of an encoder, in counts.
fn noise_steps(designed: &DriveDesign, noise_rad: &[f64]) -> f64 {
    let of =
        |(state, mounted): &(usize, Mounted)| noise_rad.get(*state).map_or(0.0, |it| it / mounted.encoder.unit_rad());
    designed.encoders().iter().map(of).fold(f64::INFINITY, f64::min)
}

/// Returns the drive of a file and the finer encoders, or the reason why the file cannot be compared.
fn compared(found: &Experiment) -> Result<(DriveDesign, Finer), &'static str> {
    let drive = found.drive.as_ref().ok_or("a comparison needs a drive: the file has neither [joint] nor [motor]")?;
    if drive.designed.form().follows == Follows::Speed {
        return Err("drive.mode = \"speed\": a comparison needs \"position\"");
    }
    let finer = Finer::of(&drive.designed).ok_or(
        "encoder: the noise is measured against an encoder with one more bit, and a drive reads at most 2^24 \
         counts per turn, gear included: compare with one bit less",
    )?;
    // The monitors may not stop the drive under the load, and a rest band hides the noise of every controller.
    Ok((drive.designed.telling().without_rest_band(), finer))
}

impl Bench {
    /// Builds the runs of a motor or joint scenario.
    ///
    /// # Errors
    /// The file is invalid, or it cannot be compared.
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
            (DriveKind::of(&designed).corners)(p)
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
            at_rest: as_it_is.at_rest,
            nominal,
            at_20: all(0.2)?,
            at_50: all(0.5)?,
        })
    }

    /// Returns the task of holding angle 0 at rest.
    pub fn task(&self) -> &Task {
        &self.rest
    }

    /// Returns the number of corners, equal for ±20 % and ±50 %.
    pub fn corners(&self) -> usize {
        self.at_50.len()
    }

    /// Returns the names of the uncertain parameters; for a joint the ratios that determine its motion.
    pub fn uncertain(&self) -> &'static [&'static str] {
        DriveKind::of(&self.designed).uncertain
    }

    /// Returns whether the file declares more than 20 % uncertainty of the plant.
    pub fn is_uncertain(&self) -> bool {
        let share = match &self.designed {
            DriveDesign::Motor(motor) => motor.monitors.uncertain,
            DriveDesign::Joint(joint) => joint.monitors.uncertain,
        };
        share > 0.2
    }

    /// Returns the current limit, A.
    pub fn max_current_a(&self) -> f64 {
        self.designed.max_current_a()
    }

    /// Returns the default limits of the current noise, A: for a joint 1/3000, 1/1000 and 1/300 of the largest current.
    /// For a motor the limits are 3/1000, 1/100 and 3/100, because sensor and load act on the same shaft.
    pub fn noise_limits_a(&self) -> [f64; 3] {
        DriveKind::of(&self.designed).noise_shares.map(|share| share * self.max_current_a())
    }

    /// Returns the cost that the tuner minimises. It is the sum of: half the mean of log10 of S, M, load, ultimate
    /// error and settling of the nominal plant; half this mean for the worst of four corners of ±20 %; 0.3 log10 of the
    /// worst S of four corners at ±50 %; 10 log10 of noise over limit, if above 1; 0.2 per corner that is not strictly
    /// stable.
    pub fn cost(&self, design: &dyn Design, limit_a: f64) -> f64 {
        let noise = self.noise(design);
        let nominal = self.five(design, &self.nominal);
        // Five metrics of LOST and 32 corners: a failed run costs more than any finished one.
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

    /// Returns all metrics over all corners.
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

    /// Returns the worst metrics over the nominal plant and the corners of ±20 %, or ±50 % if `is_wide`. The runs use
    /// every corner or only the four of the cost; stability is checked in every corner.
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

    /// Returns the runs that fail in at least one plant of [`worst`](Self::worst).
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

    /// Returns the metrics of the nominal plant alone.
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

    /// Returns the rms current noise from encoder quantisation, A; infinite if the run fails.
    pub fn noise_a(&self, design: &dyn Design) -> f64 {
        self.noise(design)
    }

    /// Returns a move and a load step with the nominal plant, tick by tick: time (s), y - r (rad), u (A). It ends where
    /// the run ends.
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

    /// Returns the largest error under a load step at rest.
    fn pushed_of(&self, design: &dyn Design, corner: &Corner) -> f64 {
        let mut peak = 0.0_f64;
        let plant = Coarse(corner.loaded.as_ref(), corner.coarse);
        let ended = self.run(&self.pushed, design, &plant, &mut |_: &Row, error: f64| peak = peak.max(error.abs()));
        if ended { peak } else { LOST }
    }

    /// Returns load error, ultimate error and settling time. A recovery that has not settled when the load comes counts
    /// as failed. So does a load error that grows by a tenth in the last fifth of its time.
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

    /// Runs once and passes every row and y - r to `see`. Returns whether the run finished.
    fn run(&self, run: &Run, design: &dyn Design, plant: &dyn Plant, see: &mut dyn FnMut(&Row, f64)) -> bool {
        let Some(mut port) = design.port(&run.task) else { return false };
        let mut is_near = true;
        let mut tick = 0;
        let mut record = |row: &Row| {
            // The error is measured against the task, not against the reference that the port reports.
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

    /// Returns the noise of the nominal plant on the sine; infinite if the run fails. With declared noise it is the
    /// larger value of a longer sine and a run at rest; both include quantisation.
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

    /// Returns the rms of u of a drive at rest under noise alone.
    fn noise_at_rest(&self, design: &dyn Design, run: &Run, noise_rad: &[f64]) -> f64 {
        let Some(trace) = self.noisy_run(design, run, noise_rad) else { return f64::INFINITY };
        let late = &trace.rows[trace.rows.len() / 10..];
        (late.iter().map(|row| row.u * row.u).sum::<f64>() / late.len() as f64).sqrt()
    }

    /// Runs the nominal plant behind encoders with this noise; `None` if the run fails.
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

    /// Returns whether a nonlinear controller returns the linear plant from 1 mrad to rest, within the encoder
    /// resolution.
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

/// Returns the largest angle that the first count of an encoder resolves unambiguously, rad.
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

    /// The feed-forward alone moves the nominal joint and motor to 1 rad and along a sine. With wrong gravity or one
    /// tick of delay it fails.
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
                // Sampling leaves T²/12 r'', which is 1.2e-4 rad for a motor at 1500 rad/s².
                assert!(
                    alone < 1.2e-4 && late > 10.0 * alone && heavier > 100.0 * alone,
                    "{alone:e} {late:e} {heavier:e}"
                );
            }
        }
    }

    /// A 12-bit counter before a gear of 50 overflows after 0.063 rad of the shaft: the recovery starts within this
    /// angle.
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

    /// Half the step makes half the noise within 15 %, since rounding is not quite white. At the finest encoder that a
    /// drive reads, the error contains the remedy.
    #[test]
    fn noise_is_told_of_fine_encoders_too() {
        let bench = |bits: u32| Bench::new("motor.toml", scenario::MOTOR, &[format!("encoder.bits={bits}")]);
        let noise = |bits: u32| {
            let bench = bench(bits).expect("a drive that can be compared");
            let all = contenders(&bench);
            // Equal gains for every encoder.
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
            // The super-twisting controller and the cascade are far from tuned.
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
        // A thousandth of the smallest error in the results of a joint.
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
