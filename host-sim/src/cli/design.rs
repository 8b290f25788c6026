//! `design`: what a scenario's design comes to in its loop, and which other would be better.
//!
//! The loop is linearised where it stands still, exactly ([`margins`](study::margins)); nothing is simulated. What is
//! suggested is put into the same loop before it is said, with what comes of it.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use controller_core::bounds::{DisturbanceBounds, ultimate};
use controller_core::drive::{JointBandwidths, JointDesign, MotorDesign, bessel_poles};
use controller_core::error_dynamics::{error_poles, surface_roots};
use controller_core::{AnyConfig, ObserverGains, Pole, Surface};
use loop_sim::linear::LawAtRest;
use loop_sim::port::drive::DriveDesign;
use loop_sim::port::drive::{Follows, Form, joint_at_rest, motor_at_rest};
use loop_sim::port::in_process::{self, ControllerSpec};
use scenario::{AtRest, Experiment};
use serde::Serialize;
use study::map::is_zero;
use study::margins::{Loop, Margins, MarginsError, Root, UnstableCorner, decay_per_s, offset_per_s, unstable_corners};
use study::number::significant;
use terminal::table::Table;

use super::export::refuse_without_limits;
use super::run::note_changes;
use super::{Console, Failure, RunOptions, bad, failed, scenario_of, status};

#[derive(Args, Debug)]
pub(super) struct DesignOptions {
    /// The scenario; without one the default.
    file: Option<PathBuf>,
    /// Override a key, as in --set drive.surface_rad_s=100.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
    /// Look at a controller whose u has no limits.
    #[arg(long)]
    no_limits: bool,
}

/// Share of the current limit that the steps of encoders may cost as noise, rms.
const NOISE_SHARE: f64 = 0.01;
/// Phase margin below which nothing is suggested, degrees: with less |S| is above 1/(2 sin 12.5°) = 2.3. Behind a
/// current loop of 0.2 ms the default set of a joint has 26.7; firm has 22.6, and does not bear a tick of delay.
const LEAST_PHASE_DEG: f64 = 25.0;

/// Share of a limit above which another design is told of: a rule takes all of it, give or take.
const MUCH: f64 = 1.02;
/// How many times shorter a period may be that is suggested.
const SHORTER: [u32; 4] = [1, 2, 4, 8];
/// The shortest period of a drive, s.
const SHORTEST_S: f64 = 2e-5;

/// All that is said of a design.
#[derive(Serialize)]
pub(super) struct Design {
    scenario: String,
    period_s: f64,
    asked: Vec<Asked>,
    /// The slowest of what is asked for but the offset W, 1/s.
    decay_asked_per_s: f64,
    #[serde(flatten)]
    got: Got,
    noise: Vec<Noise>,
    bounds: Vec<Bound>,
    /// What is used up of what may be, the most first.
    limits: Vec<Limit>,
    suggested: Option<Suggested>,
    /// What of the scenario is not in these figures.
    left_out: Vec<&'static str>,
}

/// What the design asks for, as poles.
#[derive(Serialize)]
struct Asked {
    name: String,
    poles: Vec<Root>,
    meaning: &'static str,
}

/// What comes of it.
#[derive(Serialize)]
struct Got {
    /// Largest |z| of a pole: below 1 the loop is stable.
    spectral_radius: f64,
    /// Of the slowest of these poles, 1/s; negative for a loop that grows.
    decay_per_s: f64,
    /// ln(z)/T, the slowest first, without the offset's own.
    poles: Vec<Root>,
    /// Of a loop that is stable.
    margins: Option<Margins>,
    /// How many corners of what the file says of its data sheet were judged, and those that are not stable, the worst
    /// first.
    #[serde(skip_serializing_if = "is_zero")]
    corners: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unstable_corners: Vec<UnstableCorner>,
    /// Rms of u per unit of white noise on each sensor.
    #[serde(skip)]
    noise_gains: Vec<f64>,
}

/// What a sensor does to u.
#[derive(Serialize)]
struct Noise {
    sensor: String,
    /// Rms of u per unit of white noise on it.
    gain: f64,
    unit: String,
    /// Rms of what it adds by its steps and by the noise of the scenario, in its unit.
    sensor_rms: f64,
    /// Rms of u that this makes.
    u_rms: f64,
}

/// A number that is not passed.
#[derive(Serialize)]
struct Bound {
    name: String,
    value: f64,
    unit: String,
    meaning: String,
}

/// What is used of something that there is so much of.
#[derive(Serialize)]
struct Limit {
    what: &'static str,
    /// 1: all of it.
    used: f64,
    meaning: String,
}

/// What to take instead, and what it makes.
#[derive(Serialize)]
struct Suggested {
    /// For the scenario file: the table, and a line of it.
    lines: Vec<[String; 2]>,
    why: String,
    /// Is it what the file has?
    is_same: bool,
    #[serde(flatten)]
    got: Got,
}

/// What is wrong with a design, the least first.
enum Flaw {
    /// Too little phase margin.
    Phase,
    /// So many A of noise.
    Noise(f64),
    /// It is not stable in so many corners.
    Corners { unstable: usize, worst: String },
    /// It is not stable.
    Unstable,
}

impl Flaw {
    /// The larger, the worse.
    const fn weight(&self) -> usize {
        match self {
            Self::Phase => 1,
            Self::Noise(_) => 2,
            Self::Corners { unstable, .. } => 2 + *unstable,
            Self::Unstable => usize::MAX,
        }
    }
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Noise(noise) => write!(f, "would make {} A of noise", number(*noise)),
            Self::Phase => write!(f, "would have less than {LEAST_PHASE_DEG} deg of phase margin"),
            Self::Corners { unstable, worst } => {
                write!(f, "would be unstable in {unstable} corners, most with {worst}")
            }
            Self::Unstable => f.write_str("would be unstable"),
        }
    }
}

impl Got {
    /// Of a loop with this law, whose offset decays with α.
    fn of(at_rest: &AtRest, law: &dyn LawAtRest, period_s: f64, alpha_per_s: f64) -> Result<Self, MarginsError> {
        let it = Loop::of(at_rest, law, period_s)?;
        let values = it.eigenvalues()?;
        let spectral_radius = values.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        let (margins, noise_gains) =
            if spectral_radius < 1.0 { (Some(it.margins()?), it.noise_gains()) } else { (None, Vec::new()) };
        let poles = it.poles_beside(values, alpha_per_s);
        let decay_per_s = decay_per_s(&poles);
        let unstable_corners = unstable_corners(at_rest, law, period_s)?;
        let corners = at_rest.corners.len();
        Ok(Self { spectral_radius, decay_per_s, poles, margins, corners, unstable_corners, noise_gains })
    }

    /// Noise of u; none of a loop that is not stable.
    fn noise(&self, at_rest: &AtRest) -> Option<f64> {
        let parts = self.noise_gains.iter().zip(&at_rest.sensed).map(|(gain, sensed)| gain * sensed.rms);
        self.margins.is_some().then(|| parts.map(|part| part * part).sum::<f64>().sqrt())
    }

    /// Is it stable, in all corners?
    fn is_stable(&self) -> bool {
        self.margins.is_some() && self.unstable_corners.is_empty()
    }

    /// What is wrong with it at first, if noise may be up to this; nothing of one that may be suggested.
    fn flaw(&self, at_rest: &AtRest, most_noise: f64) -> Option<Flaw> {
        let Some(margins) = &self.margins else { return Some(Flaw::Unstable) };
        if let Some(worst) = self.unstable_corners.first() {
            return Some(Flaw::Corners { unstable: self.unstable_corners.len(), worst: worst.name.clone() });
        }
        if let Some(noise) = self.noise(at_rest).filter(|noise| *noise > most_noise) {
            return Some(Flaw::Noise(noise));
        }
        margins.phase_deg.is_some_and(|phase| phase < LEAST_PHASE_DEG).then_some(Flaw::Phase)
    }

    /// In one line.
    fn line(&self) -> String {
        let Some(margins) = &self.margins else {
            return format!("unstable: spectral radius {}, so no margins", radius(self.spectral_radius));
        };
        let Margins { phase_deg, delay_s, gain_up, gain_down, sensitivity_peak, .. } = *margins;
        let phase = phase_deg.map_or_else(|| "any phase".into(), |phase| format!("{} deg", number(phase)));
        let delay = delay_s.map_or_else(|| "any delay".into(), |delay| format!("{} ms", number(1e3 * delay)));
        let up = gain_up.map_or_else(|| "any".into(), number);
        format!(
            "decay {} 1/s; margins {phase}, {delay}, gain {} to {up}; |S| up to {}",
            number(self.decay_per_s),
            factor_down(gain_down),
            number(sensitivity_peak)
        )
    }
}

impl Design {
    /// Of a scenario.
    pub(super) fn of(experiment: &Experiment) -> Result<Self, Failure> {
        let failed = |error: MarginsError| failed(error.to_string());
        let at_rest = experiment.at_rest.as_ref().map_err(|error| bad(error.to_string()))?;
        let asked = asked(experiment);
        let got =
            Got::of(at_rest, at_rest.law.as_ref(), experiment.period_s, offset_per_s(experiment)).map_err(failed)?;
        let per = |unit: &str| {
            let u = if experiment.control_unit.is_empty() { "u" } else { experiment.control_unit };
            if unit.is_empty() { u.to_owned() } else { format!("{u} per {unit}") }
        };
        let noise = got.noise_gains.iter().zip(&at_rest.sensed).map(|(&gain, sensed)| Noise {
            sensor: sensed.name.clone(),
            gain,
            unit: per(sensed.unit),
            sensor_rms: sensed.rms,
            u_rms: gain * sensed.rms,
        });
        let is_of_offset = |asked: &&Asked| asked.name != OFFSET;
        let rates = asked.iter().filter(is_of_offset).flat_map(|asked| &asked.poles).map(|pole| -pole.re);
        Ok(Self {
            scenario: experiment.name.clone(),
            period_s: experiment.period_s,
            decay_asked_per_s: rates.fold(f64::INFINITY, f64::min),
            noise: noise.collect(),
            bounds: bounds(experiment),
            limits: limits(experiment, at_rest, &got),
            suggested: suggested(experiment, at_rest, &got).map_err(failed)?,
            left_out: at_rest.left_out.clone(),
            asked,
            got,
        })
    }

    /// What `run` says of it.
    pub(super) fn short(&self) -> Vec<String> {
        let mut lines = vec![format!("loop at rest: {}", self.got.line())];
        if let (Some(_), Some(limit)) = (&self.got.margins, self.limits.first()) {
            lines.push(format!("limited by {}, {} % used; more by `host-sim design`", limit.what, percent(limit.used)));
        }
        // What was taken by a rule may be more than the loop bears.
        let is_too_much = !self.got.is_stable() || self.limits.first().is_some_and(|limit| limit.used > MUCH);
        if let Some(Suggested { lines: other, why, .. }) =
            self.suggested.as_ref().filter(|it| is_too_much && !it.is_same)
        {
            let keys: Vec<&str> = other.iter().map(|[_, line]| line.split("  #").next().unwrap_or(line)).collect();
            let table = other.first().map_or("", |[table, _]| table);
            lines.push(format!("suggested: {table} {}: {why}", keys.join(", ")));
        }
        lines
    }

    /// What is asked for, as poles.
    pub(super) fn asked_poles(&self) -> impl Iterator<Item = Root> {
        self.asked.iter().flat_map(|asked| asked.poles.iter().copied())
    }

    /// Those of the closed loop.
    pub(super) fn poles(&self) -> impl Iterator<Item = Root> {
        self.got.poles.iter().copied()
    }

    /// Noise of u by the steps of the encoders, A rms; none of a loop that is not stable.
    pub(super) fn noise(&self) -> Option<f64> {
        let sum: f64 = self.noise.iter().map(|noise| noise.u_rms * noise.u_rms).sum();
        self.got.margins.map(|_| sum.sqrt())
    }
}

impl Console<'_> {
    pub(super) fn design(&mut self, options: &DesignOptions) -> Result<u8, Failure> {
        let DesignOptions { file, sets, json, no_limits } = options;
        let of_run = RunOptions { sets: sets.clone(), ..RunOptions::default() };
        let mut experiment = scenario_of(file.as_deref(), &of_run)?;
        // The readings for the figures have none, as the paper.
        if !no_limits && experiment.figures_only.is_none() {
            let name =
                file.as_deref().map_or_else(|| "built-in default.toml".into(), |file| file.display().to_string());
            refuse_without_limits(&experiment, &name)?;
        }
        note_changes(&mut experiment.title, sets);
        let design = Design::of(&experiment)?;
        if *json {
            self.say_json(serde_json::to_string(&design))?;
        } else {
            self.say(text(&design, &experiment).trim_end())?;
        }
        Ok(status::DONE)
    }
}

/// What the offset is called among the things that are asked for.
const OFFSET: &str = "offset alpha";

fn real(rate: f64) -> Vec<Root> {
    vec![Root { re: -rate, im: 0.0 }]
}

fn roots(poles: &[Pole]) -> Vec<Root> {
    poles.iter().map(|&Pole { re, im }| Root { re, im }).collect()
}

/// What is asked for.
fn asked(experiment: &Experiment) -> Vec<Asked> {
    let one = |name: &str, poles, meaning| Asked { name: name.into(), poles, meaning };
    let bessel = |omega: f64, states: usize| -> Vec<Root> {
        let both = |Pole { re, im }| [im, -im].map(|im| Root { re: re * omega, im: im * omega });
        let all = bessel_poles(states).into_iter().flat_map(both);
        // A real one has no other half.
        all.take(states).collect()
    };
    let mut lines = match (&experiment.drive, &experiment.spec) {
        (Some(drive), _) => {
            let form = drive.designed.form();
            let states = form.observer_states;
            match &drive.designed {
                DriveDesign::Motor { design: MotorDesign { bandwidths: w, .. }, .. } => {
                    let surface = one("error w_c", real(w.surface_rad_s), "the error obeys e' = -w_c e");
                    let rest = [
                        one("observer w_o", bessel(w.observer_rad_s, states), "its error, Bessel poles"),
                        one("reaching law k_l", real(w.reaching_per_s), "sigma*; of a speed loop its bandwidth"),
                    ];
                    let surface = (form.follows == Follows::Position).then_some(surface);
                    surface.into_iter().chain(rest).collect()
                }
                DriveDesign::Joint { design: JointDesign { bandwidths: w, .. }, .. } => {
                    vec![
                        one("error w_c", vec![real(w.surface_rad_s)[0]; 3], "the error, three equal poles"),
                        one("observer of the link", bessel(w.link_rad_s, 4), "its error, Bessel poles"),
                        one("observer of the motor", bessel(w.motor_rad_s, 4), "its error, Bessel poles"),
                        one("reaching law k_l", real(w.reaching_per_s), "sigma*"),
                    ]
                }
            }
        }
        (None, Some(ControllerSpec { config: AnyConfig { n, padded }, .. })) => {
            let mut lines =
                vec![one("surface", roots(&surface_roots(&padded.surface.c[..*n])), "roots of the sliding motion")];
            let observers = (1..).zip(&padded.observers).take(*n);
            lines.extend(observers.filter_map(|(channel, gains)| {
                Some(one(&format!("observer of d_{channel}"), roots(&error_poles(gains.as_ref()?)), "its error"))
            }));
            if padded.reaching.k_l > 0.0 {
                lines.push(one("reaching law k_l", real(padded.reaching.k_l), "sigma*"));
            }
            lines
        }
        (None, None) => return Vec::new(),
    };
    lines.push(one(OFFSET, real(offset_per_s(experiment)), "what is left of the start, by itself"));
    lines
}

/// λ_2, λ_3, and of each channel δ_i0, of a configuration under disturbances with these bounds μ_i^(k), if there are
/// any.
pub(super) fn ultimates(config: &AnyConfig, mu: &[Vec<f64>]) -> Option<(f64, f64, Vec<f64>)> {
    macro_rules! by_order {
        ($($n:literal $r:literal,)*) => {
            match (config.n, usize::from(config.shape().r)) {
                $(($n, $r) => {
                    let row = |i: usize| mu.get(i).map_or(&[][..], |mu| &mu[..]);
                    let mu = core::array::from_fn(|i| {
                        core::array::from_fn(|k| row(i).get(k).copied().unwrap_or(f64::INFINITY))
                    });
                    let found = ultimate(&config.fixed::<$n, $r>()?, &DisturbanceBounds::<$n, 4> { mu }).ok()?;
                    Some((found.sigma_star, found.y, found.delta.iter().map(|delta| delta[0]).collect()))
                })*
                _ => None,
            }
        };
    }
    if mu.is_empty() {
        return None;
    }
    by_order!(2 1, 2 2, 2 3, 3 1, 3 2, 3 3, 4 1, 4 2, 4 3, 5 1, 5 2, 5 3, 6 1, 6 2, 6 3,)
}

fn bounds(experiment: &Experiment) -> Vec<Bound> {
    let one = |name: &str, value, unit: &str, meaning: &str| Bound {
        name: name.into(),
        value,
        unit: unit.into(),
        meaning: meaning.into(),
    };
    if let Some(drive) = &experiment.drive {
        let (gates, unit): (Vec<f64>, _) = match &drive.designed {
            DriveDesign::Motor { design, .. } => (vec![design.gate_steps], "rad/s"),
            DriveDesign::Joint { design, .. } => (design.gate_steps.to_vec(), "rad/s^3"),
        };
        let gates = drive.shafts.iter().zip(gates).map(|(shaft, steps)| {
            one(
                &format!("gate of the {}", shaft.name),
                steps,
                "steps",
                "a count farther from the expected is not believed",
            )
        });
        let sigma = one("|sigma*|, lambda_2", drive.sigma_star_bound, unit, "for innovations of one step each at most");
        return gates.chain([sigma]).collect();
    }
    let mu: Vec<Vec<f64>> = experiment.mu.iter().map(|mu| mu.by_order.clone()).collect();
    let found = experiment.spec.as_ref().and_then(|spec| ultimates(&spec.config, &mu));
    let found = found.filter(|(sigma_star, y, _)| sigma_star.is_finite() && y.is_finite());
    found.map_or_else(Vec::new, |(sigma_star, y, _)| {
        let meaning = "in the end, by the file's disturbances; what a wrong model adds is not in it";
        vec![one("|sigma*|, lambda_2", sigma_star, "", meaning), one("|y|, lambda_3", y, "", meaning)]
    })
}

/// Delay that the phase of a motor's loop pays for, s: half a period of hold, the current loop, the delay.
fn late_s(design: &MotorDesign, lag_s: f64, form: Form) -> [f64; 3] {
    [design.period_s / 2.0, 1.5 * lag_s, form.delay_ticks as f64 * design.period_s]
}

fn limits(experiment: &Experiment, at_rest: &AtRest, got: &Got) -> Vec<Limit> {
    let period_s = experiment.period_s;
    let mut found = Vec::new();
    let mut limit = |what, used: f64, meaning: String| {
        if used.is_finite() {
            found.push(Limit { what, used, meaning });
        }
    };
    if let Some(phase) = got.margins.and_then(|margins| margins.phase_deg) {
        limit("phase", LEAST_PHASE_DEG / phase, format!("{LEAST_PHASE_DEG} deg of phase margin shall be left"));
    }
    if let Some(drive) = &experiment.drive {
        let most = NOISE_SHARE * drive.max_current_a;
        if let Some(noise) = got.noise(at_rest) {
            let meaning = format!("the encoder's steps may make {} A, 1 % of the limit, in u", number(most));
            limit("noise", noise / most, meaning);
        }
        let form = drive.designed.form();
        let most = if form.delay_ticks == 0 { 0.8 } else { 0.5 };
        match &drive.designed {
            DriveDesign::Motor { design, .. } => {
                let [hold, lag, delay] = late_s(design, drive.current_lag_s, form).map(|late_s| 1e3 * late_s);
                let w = design.bandwidths;
                // A speed loop has no w_c; its k_l goes with that of the rule.
                let whose = if form.follows == Follows::Position { "w_c" } else { "w_c of the rule" };
                let meaning = format!(
                    "{whose} may be 0.1/({} ms of hold + {} of current loop + {} of delay)",
                    number(hold),
                    number(lag),
                    number(delay)
                );
                limit("lost time", w.surface_rad_s * (hold + lag + delay) * 1e-3 / 0.1, meaning);
                limit("observer", w.observer_rad_s * period_s / most, format!("w_o times the period may be {most}"));
                limit("reaching law", w.reaching_per_s * period_s, "k_l times the period may be 1".into());
            }
            DriveDesign::Joint { design: JointDesign { bandwidths: w, .. }, .. } => {
                limit(
                    "motor's observer",
                    w.motor_rad_s * period_s / most,
                    format!("its bandwidth times the period may be {most}"),
                );
                limit("reaching law", w.reaching_per_s * period_s / 0.3, "k_l times the period may be 0.3".into());
                limit(
                    "link's observer",
                    3.0 * w.surface_rad_s / w.link_rad_s,
                    "w_c may be a third of its bandwidth".into(),
                );
            }
        }
    } else if let Some(ControllerSpec { config, .. }) = &experiment.spec {
        let poles = config.padded.observers.iter().take(config.n).flatten().flat_map(error_poles);
        let fastest = poles.map(|pole| libm::hypot(pole.re, pole.im)).fold(0.0, f64::max);
        limit("observer", fastest * period_s / 0.3, "its fastest pole times the period may be 0.3".into());
        limit("reaching law", config.padded.reaching.k_l * period_s / 0.5, "k_l times the period may be 0.5".into());
    }
    found.sort_by(|a, b| b.used.total_cmp(&a.used));
    found
}

/// A design that is tried for a drive.
struct Tried {
    /// What it is called.
    word: String,
    /// Its line in the file.
    line: String,
    /// Is it what the file has?
    is_same: bool,
    /// What limits it, if that is known.
    why: Option<String>,
    /// What comes of it, or why its design is refused.
    got: Result<Got, &'static str>,
}

/// The first design that has no flaw, with the period of the file or else a shorter one; else that with the least flaw,
/// if it is better than what the file has.
fn suggested(experiment: &Experiment, at_rest: &AtRest, present: &Got) -> Result<Option<Suggested>, MarginsError> {
    let Some(drive) = &experiment.drive else {
        let Some(spec) = &experiment.spec else { return Ok(None) };
        return for_surface(spec, at_rest, experiment.period_s);
    };
    let form = drive.designed.form();
    // A motor's rule has all the noise that there may be.
    let is_joint = matches!(drive.designed, DriveDesign::Joint { .. });
    let most_noise = if is_joint { NOISE_SHARE * drive.max_current_a } else { f64::INFINITY };
    let mut least = present.flaw(at_rest, most_noise).map_or(0, |flaw| flaw.weight());
    let mut nearest = None;
    let mut at_this_period = String::new();
    for times in SHORTER {
        let period_s = experiment.period_s / f64::from(times);
        if times > 1 && period_s < SHORTEST_S {
            break;
        }
        let tried = match drive.designed {
            DriveDesign::Motor { design, .. } => {
                vec![for_motor(&design, period_s, drive.current_lag_s, form, at_rest)?]
            }
            DriveDesign::Joint { design, .. } => for_joint(&design, period_s, form, at_rest)?,
        };
        // What the next faster one was refused for.
        let mut refused = String::from("the fastest set that is measured");
        for Tried { word, line, is_same, why, got } in tried {
            let got = match got {
                Ok(got) => got,
                Err(why) => {
                    refused = format!("{word} is refused: {why}");
                    continue;
                }
            };
            let period = (times > 1).then(|| format!("period_s = {}", as_toml(period_s)));
            let lines = period.into_iter().chain([line]).map(|line| ["[drive]".into(), line]).collect();
            let Some(flaw) = got.flaw(at_rest, most_noise) else {
                let why = match why.unwrap_or(refused) {
                    why if is_same => format!("as it is; {why}"),
                    _ if times > 1 => format!(
                        "a shorter period; with that of the file {at_this_period}, and `host-sim tune` looks for more \
                         than these sets"
                    ),
                    why => why,
                };
                return Ok(Some(Suggested { lines, why, is_same, got }));
            };
            refused = format!("{word} {flaw}");
            if flaw.weight() < least {
                least = flaw.weight();
                let why = format!("nothing is without flaw, but this is better than what the file has; {refused}");
                nearest = Some(Suggested { lines, why, is_same, got });
            }
        }
        if times == 1 {
            at_this_period = refused;
        }
    }
    Ok(nearest)
}

fn for_motor(
    design: &MotorDesign,
    period_s: f64,
    lag_s: f64,
    form: Form,
    at_rest: &AtRest,
) -> Result<Tried, MarginsError> {
    let by_rule = MotorDesign { period_s, ..*design }.with_lag(lag_s, form.delay_ticks as u32);
    let w = by_rule.bandwidths;
    let got = match motor_at_rest(&by_rule, form) {
        Ok(law) => Ok(Got::of(at_rest, law.law.as_ref(), period_s, w.offset_per_s)?),
        Err(error) => Err(error.why),
    };
    let late = late_s(&by_rule, lag_s, form);
    let (lost_s, longest) = (late.iter().sum::<f64>(), late.iter().fold(0.0, |a: f64, b| a.max(*b)));
    let by_phase = 0.1 / lost_s;
    let why = if w.surface_rad_s < 0.999 * by_phase {
        let two_bits = by_phase.min(w.surface_rad_s * libm::pow(4.0, 0.4));
        format!("noise binds; two more bits would allow {} rad/s", number(two_bits))
    } else {
        let remedy = match late.iter().position(|part| *part == longest) {
            Some(0) => "a shorter period",
            Some(1) => "a faster current loop",
            _ => "no tick of delay",
        };
        format!("lost time binds ({} ms); {remedy} would allow more", number(1e3 * lost_s))
    };
    let line = format!(
        "surface_rad_s = {}  # then w_o = {}, k_l = {}, alpha = {}",
        number(w.surface_rad_s),
        number(w.observer_rad_s),
        number(w.reaching_per_s),
        number(w.offset_per_s)
    );
    let is_same = period_s == design.period_s && (design.bandwidths.surface_rad_s / w.surface_rad_s - 1.0).abs() < 1e-3;
    Ok(Tried { word: "the rule".into(), line, is_same, why: Some(why), got })
}

/// The measured sets, the fastest first.
fn for_joint(design: &JointDesign, period_s: f64, form: Form, at_rest: &AtRest) -> Result<Vec<Tried>, MarginsError> {
    let sets =
        [("firm", JointBandwidths::FIRM), ("normal", JointBandwidths::DEFAULT), ("quiet", JointBandwidths::QUIET)];
    let tried = sets.map(|(word, set)| {
        let w = set.within(period_s, form.delay_ticks);
        let got = match joint_at_rest(&JointDesign { period_s, bandwidths: w, ..*design }, form) {
            Ok(law) => Ok(Got::of(at_rest, law.law.as_ref(), period_s, w.offset_per_s)?),
            Err(error) => Err(error.why),
        };
        let line = format!(
            "tuning = {word:?}  # w_c = {}, observers {} and {}, k_l = {}, alpha = {}",
            number(w.surface_rad_s),
            number(w.link_rad_s),
            number(w.motor_rad_s),
            number(w.reaching_per_s),
            number(w.offset_per_s)
        );
        let is_same = period_s == design.period_s && w == design.bandwidths;
        Ok(Tried { word: format!("{word:?}"), line, is_same, why: None, got })
    });
    tried.into_iter().collect()
}

/// The sliding motion stays as asked for; α, k_l and the observers follow it: half of it, five and four times it, the
/// observer of the driven channel six times as fast as the others, all within what the period allows. As long as the
/// loop is not well with them, k_l and the observers are made slower.
fn for_surface(spec: &ControllerSpec, at_rest: &AtRest, period_s: f64) -> Result<Option<Suggested>, MarginsError> {
    let AnyConfig { n, padded } = spec.config;
    let slowest = surface_roots(&padded.surface.c[..n]).iter().map(|root| -root.re).fold(f64::INFINITY, f64::min);
    if !(slowest > 0.0 && slowest.is_finite()) {
        return Ok(None);
    }
    let mut other = spec.clone();
    let alpha = round_to_two(0.5 * slowest);
    other.config.padded.surface = Surface { alpha_per_s: alpha, ..padded.surface };
    for slower in 0..6 {
        let share = libm::pow(0.6, f64::from(slower));
        let k_l = round_to_two((5.0 * share * slowest).min(0.5 / period_s));
        other.config.padded.reaching.k_l = k_l;
        let mut observers = Vec::new();
        for (i, gains) in other.config.padded.observers.iter_mut().take(n).enumerate() {
            let Some(gains) = gains else { continue };
            let order = gains.order();
            let times = if i + 1 == n { 24.0 } else { 4.0 };
            let bandwidth = round_to_two((times * share * slowest).min(0.3 / period_s));
            *gains = match order {
                1 => ObserverGains::from_bandwidth::<1>(bandwidth),
                2 => ObserverGains::from_bandwidth::<2>(bandwidth),
                _ => ObserverGains::from_bandwidth::<3>(bandwidth),
            };
            observers.push(format!("{{ channel = {}, order = {order}, bandwidth_rad_s = {bandwidth} }}", i + 1));
        }
        let Ok(designed) = in_process::build(&other) else { continue };
        let got = Got::of(at_rest, designed.at_rest.as_ref(), period_s, alpha)?;
        if got.flaw(at_rest, f64::INFINITY).is_none() {
            let lines = [
                format!("alpha_per_s = {alpha}"),
                format!("k_l = {k_l}"),
                format!("observer = [{}]", observers.join(", ")),
            ];
            let lines = lines.map(|line| ["[controller]".to_owned(), line]).into();
            let why = format!("for the sliding motion that is asked for, slowest root {} 1/s", number(slowest));
            return Ok(Some(Suggested { lines, why, is_same: false, got }));
        }
    }
    Ok(None)
}

/// A period as a file would have it.
fn as_toml(period_s: f64) -> String {
    format!("{:?}", significant(period_s, 6).parse().unwrap_or(period_s))
}

fn round_to_two(value: f64) -> f64 {
    significant(value, 2).parse().unwrap_or(value)
}

fn number(value: f64) -> String {
    significant(value, 3)
}

fn percent(share: f64) -> String {
    significant(100.0 * share, 2)
}

/// Six digits beyond those in which it is 1.
fn radius(value: f64) -> String {
    if (value - 1.0).abs() < 0.01 { format!("{value:.6}") } else { significant(value, 4) }
}

fn factor_down(factor: f64) -> String {
    if factor < 1e-6 { "0".into() } else { number(factor) }
}

/// The slowest poles, `-5.00 (3 times), -0.200 +- 3.10 i`. Poles that are equal come out of f64 as a small ring.
fn listed(poles: &[Root], most: usize) -> String {
    let mut groups: Vec<(Root, usize)> = Vec::new();
    for pole in poles.iter().filter(|pole| pole.im >= 0.0) {
        let size = libm::hypot(pole.re, pole.im);
        let is_near = |known: &Root| libm::hypot(known.re - pole.re, known.im - pole.im) < 0.02 * size;
        let flat = Root { im: if pole.im < 0.02 * size { 0.0 } else { pole.im }, ..*pole };
        let weight = if flat.im == 0.0 && pole.im > 0.0 { 2 } else { 1 };
        match groups.iter_mut().find(|(known, _)| is_near(known)) {
            Some((_, times)) => *times += weight,
            None => groups.push((flat, weight)),
        }
    }
    let shown = groups.iter().take(most).map(|(Root { re, im }, times)| {
        let pole = if *im > 0.0 { format!("{} +- {} i", number(*re), number(*im)) } else { number(*re) };
        if *times > 1 { format!("{pole} ({times} times)") } else { pole }
    });
    shown.collect::<Vec<_>>().join(", ")
}

/// Those that are not over within a tick.
fn slow(poles: &[Root], period_s: f64) -> String {
    let slow: Vec<Root> = poles.iter().copied().filter(|pole| pole.re * period_s > -3.0).collect();
    listed(&slow, 3)
}

fn text(design: &Design, experiment: &Experiment) -> String {
    let head = format!("{}: {}\n{}", experiment.name, experiment.title, table(design, experiment));
    remarks(design, experiment).into_iter().fold(head, |text, line| text + &line + "\n")
}

/// What is said under the table, a line each.
pub(super) fn remarks(design: &Design, experiment: &Experiment) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = |words: String| lines.push(words);
    if !design.left_out.is_empty() {
        line(format!("not in these figures: {}", design.left_out.join(", ")));
    }
    for (k, Limit { what, used, meaning }) in design.limits.iter().enumerate() {
        let head = if k == 0 { "limited by " } else { "      then " };
        line(format!("{head}{what}, {} % used: {meaning}", percent(*used)));
    }
    corners(&design.got, &mut line);
    for warning in &experiment.warnings {
        line(format!("warning: {warning}"));
    }
    match &design.suggested {
        None if experiment.drive.is_none() => {
            line(format!(
                "nothing is suggested: by its rules no loop here keeps {LEAST_PHASE_DEG} deg of phase margin"
            ));
        }
        None => line(
            "nothing is suggested: by its rules nothing is better, with this period or an eighth of it; `host-sim \
             tune` looks beyond them, and what is unstable in a corner needs a data sheet that is known better"
                .into(),
        ),
        Some(Suggested { lines, why, got, .. }) => {
            line(format!("suggested: {why}"));
            let mut last = "";
            for [table, entry] in lines {
                if last != table {
                    line(table.clone());
                }
                last = table;
                line(entry.clone());
            }
            line(format!("# makes: {}", got.line()));
        }
    }
    lines
}

/// How many unstable corners are told by name.
const MOST_NAMED: usize = 4;

fn corners(got: &Got, line: &mut impl FnMut(String)) {
    let Got { corners, unstable_corners: unstable, .. } = got;
    if *corners > 0 {
        let words = match unstable.len() {
            0 => "all stable".into(),
            count => format!("{count} UNSTABLE, the worst first:"),
        };
        line(format!("{corners} corners of drive.uncertain_percent: {words}"));
    }
    for UnstableCorner { name, spectral_radius } in unstable.iter().take(MOST_NAMED) {
        line(format!("    {name}: spectral radius {}", radius(*spectral_radius)));
    }
}

pub(super) fn table(design: &Design, experiment: &Experiment) -> Table {
    let mut table = Table::new(["of the loop", "value", "unit", "meaning"]);
    let mut row = |name: &str, value: String, unit: &str, meaning: &str| table.row([name, &value, unit, meaning]);
    for Asked { name, poles, meaning } in &design.asked {
        row(&format!("asked: {name}"), listed(poles, 4), "rad/s", meaning);
    }
    let Got { spectral_radius, decay_per_s, poles, margins, .. } = &design.got;
    row("decay asked", number(design.decay_asked_per_s), "1/s", "the slowest of these, the offset apart");
    row("decay got", number(*decay_per_s), "1/s", "of the slowest pole of the closed loop");
    row("poles", slow(poles, design.period_s), "rad/s", "the slowest three of the closed loop, ln(z)/T");
    let Some(margins) = margins else {
        row("unstable", radius(*spectral_radius), "", "spectral radius, so no margins");
        return table;
    };
    let or = |value: Option<f64>, none: &str| value.map_or_else(|| none.to_owned(), number);
    let Margins { crossover_rad_s, phase_deg, delay_s, gain_up, gain_down, sensitivity_peak, peak_rad_s } = *margins;
    row("crossover", or(crossover_rad_s, "none"), "rad/s", "loop gain 1, broken at the plant's input");
    row("phase margin", or(phase_deg, "any"), "deg", "phase that may be lost there");
    let ticks = delay_s.map_or_else(String::new, |delay| format!(", {} ticks", number(delay / design.period_s)));
    row(
        "delay margin",
        or(delay_s.map(|delay| 1e3 * delay), "any"),
        "ms",
        &format!("delay that may come on top{ticks}"),
    );
    row("gain margin up", or(gain_up, "any"), "", "factor by which the plant's input gain may grow");
    row("gain margin down", factor_down(gain_down), "", "factor to which it may fall");
    let at = format!("max |S|, at {} rad/s", number(peak_rad_s));
    row("sensitivity peak", number(sensitivity_peak), "", &at);
    for Noise { sensor, gain, unit, sensor_rms, u_rms } in &design.noise {
        row(&format!("noise gain, {sensor}"), number(*gain), unit, "rms of u per rms of white noise there");
        if *sensor_rms > 0.0 {
            let u = if experiment.control_unit.is_empty() { "u" } else { experiment.control_unit };
            row(&format!("noise of u, {sensor}"), number(*u_rms), u, "rms, of the sensor's steps and noise");
        }
    }
    for Bound { name, value, unit, meaning } in &design.bounds {
        row(name, number(*value), unit, meaning);
    }
    table
}
