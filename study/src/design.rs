//! Closed loop of a scenario at rest, limits of its design, and a suggested design.
//!
//! The loop is linearised exactly at rest ([`margins`](crate::margins())); nothing is simulated. A suggested design is
//! checked in the same linear loop.

use std::fmt;

use controller_core::bounds::{DisturbanceBounds, ultimate};
use controller_core::drive::{
    JointBandwidths, JointDesign, JointRatios, MotorDesign, MotorMargin, Switching, bessel_poles,
};
use controller_core::error_dynamics::{error_poles, surface_roots};
use controller_core::{AnyConfig, ObserverGains, Pole, Surface};
use loop_sim::linear::LawAtRest;
use loop_sim::port::drive::{DriveAtRest, DriveDesign, DriveOf, Follows, Form};
use loop_sim::port::in_process::{self, ControllerSpec};
use scenario::{AtRest, CoupledBy, Experiment, Sensed};
use serde::Serialize;

use crate::Error;
use crate::gain_sets::{GainSet, MarginPrice, gain_sets, prices};
use crate::kind::{DriveKind, observer_limit};
use crate::map::is_zero;
use crate::margins::{
    LeastDamped, Loop, Margins, MarginsError, Root, UnstableCorner, decay_per_s, noise_of, offset_per_s, warnings,
};
use crate::number::significant;
use crate::range::{Covered, covered};

/// Largest current noise from encoder quantisation as a share of the current limit, rms.
const NOISE_SHARE: f64 = 0.01;
/// Smallest phase margin of a suggested design, degrees. Below it |S| exceeds 1/(2 sin 12.5°) = 2.3. With a current
/// loop of 0.2 ms the default set of a joint has 26.7. The set firm has 22.6 and does not tolerate a tick of delay.
pub const LEAST_PHASE_DEG: f64 = 25.0;

/// Divisors of the period that a suggestion tries.
const SHORTER: [u32; 4] = [1, 2, 4, 8];
/// Shortest period of a drive, s.
const SHORTEST_S: f64 = 2e-5;

/// Result of [`design`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Design {
    /// Name of the scenario.
    pub scenario: String,
    /// Sampling period, s.
    pub period_s: f64,
    /// Poles of the design.
    pub asked: Vec<AskedPoles>,
    /// Bandwidths of the observers, rad/s: of the motor, or of link and motor. Empty without a drive.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub observers_rad_s: Vec<f64>,
    /// Slowest design pole except the offset W, 1/s.
    pub decay_asked_per_s: f64,
    /// Resulting closed loop.
    #[serde(flatten)]
    pub got: ClosedLoop,
    /// Noise of u from each sensor.
    pub noise: Vec<Noise>,
    /// Guaranteed bounds.
    pub bounds: Vec<Bound>,
    /// Used share of each design limit, largest first.
    pub limits: Vec<Limit>,
    /// Suggested design, if there is one.
    pub suggested: Option<Suggested>,
    /// Gain sets of a drive, each analysed as if it were active all the time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gain_sets: Vec<GainSet>,
    /// Motor only: metrics of this design and of the design rules with other margins.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub prices: Vec<MarginPrice>,
    /// Motor with an inertia range only: the part of the range that is covered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia_range: Option<Covered>,
    /// Parts of the scenario that these results leave out.
    pub left_out: Vec<&'static str>,
}

/// Design poles of one part of the controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AskedPoles {
    /// Name of the part.
    pub name: String,
    /// Poles, rad/s.
    pub poles: Vec<Root>,
    /// Meaning of the poles.
    pub meaning: &'static str,
}

/// Closed loop of a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClosedLoop {
    /// Spectral radius: largest |z| of a pole; the loop is stable below 1.
    pub spectral_radius: f64,
    /// Decay rate of the slowest of the poles, 1/s; negative for an unstable loop.
    pub decay_per_s: f64,
    /// Continuous poles ln(z)/T, slowest first, without the pole of the offset.
    pub poles: Vec<Root>,
    /// Stability margins, if the loop is stable.
    pub margins: Option<Margins>,
    /// Number of corners of the declared uncertainty that were checked.
    #[serde(skip_serializing_if = "is_zero")]
    pub corners: usize,
    /// Unstable corners, worst first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unstable_corners: Vec<UnstableCorner>,
    /// Oscillatory pole with the least damping, over all corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_damped: Option<LeastDamped>,
    /// Rms of u per unit of white noise, for each sensor.
    #[serde(skip)]
    pub noise_gains: Vec<f64>,
}

/// Effect of a sensor on u.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Name of the sensor.
    pub sensor: String,
    /// Rms of u per unit of white noise on the sensor.
    pub gain: f64,
    /// Unit of the gain.
    pub unit: String,
    /// Rms noise of the sensor from quantisation and declared noise, in its unit.
    pub sensor_rms: f64,
    /// Resulting rms of u.
    pub u_rms: f64,
}

/// Guaranteed bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// Name of the quantity.
    pub name: String,
    /// Value of the bound.
    pub value: f64,
    /// Unit of the value.
    pub unit: String,
    /// Condition under which the bound holds.
    pub meaning: String,
}

/// Used share of a design limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// Name of the limit.
    pub what: &'static str,
    /// Used share, 1 at the limit.
    pub used: f64,
    /// Rule that sets the limit.
    pub meaning: String,
}

/// Suggested design and its closed loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Suggested {
    /// Pairs of a table and a line of it for the scenario file.
    pub lines: Vec<[String; 2]>,
    /// Reason why no faster design is suggested.
    pub why: String,
    /// Whether the suggestion equals the design of the file.
    pub is_same: bool,
    /// Resulting closed loop.
    #[serde(flatten)]
    pub got: ClosedLoop,
}

/// Defect of a design, in order of severity.
enum Flaw {
    /// Phase margin too small.
    Phase,
    /// Current noise too large, in A.
    Noise(f64),
    /// Unstable in some corners.
    Corners { unstable: usize, worst: String },
    /// Unstable with the nominal plant.
    Unstable,
}

impl Flaw {
    /// Returns the severity: larger is worse.
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
            Self::Noise(noise) => write!(f, "would cause {} A of current noise", number(*noise)),
            Self::Phase => write!(f, "would have less than {LEAST_PHASE_DEG} deg of phase margin"),
            Self::Corners { unstable, worst } => {
                write!(f, "would be unstable in {unstable} corners, most with {worst}")
            }
            Self::Unstable => f.write_str("would be unstable"),
        }
    }
}

impl ClosedLoop {
    /// Analyses the loop with this control law, whose offset decays with α.
    fn of(at_rest: &AtRest, law: &dyn LawAtRest, period_s: f64, alpha_per_s: f64) -> Result<Self, MarginsError> {
        let it = Loop::of(at_rest, law, period_s)?;
        let values = it.eigenvalues()?;
        let spectral_radius = values.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        let (margins, noise_gains) =
            if spectral_radius < 1.0 { (Some(it.margins()?), it.noise_gains()) } else { (None, Vec::new()) };
        let poles = it.poles_beside(values, alpha_per_s);
        let decay_per_s = decay_per_s(&poles);
        let (unstable_corners, of_corners) = crate::margins::corners(at_rest, law, period_s)?;
        let nominal = LeastDamped::of("", poles.iter().copied(), period_s);
        let least_damped = nominal.into_iter().chain(of_corners).reduce(LeastDamped::lesser);
        let corners = at_rest.corners.len();
        Ok(Self { spectral_radius, decay_per_s, poles, margins, corners, unstable_corners, least_damped, noise_gains })
    }

    /// Returns the noise of u; `None` if the loop is unstable.
    fn noise(&self, at_rest: &AtRest) -> Option<f64> {
        self.margins.is_some().then(|| noise_of(&self.noise_gains, at_rest))
    }

    /// Returns whether declared noise contributes more to u than quantisation.
    fn is_of_declared_noise(&self, at_rest: &AtRest) -> bool {
        let (mut declared, mut all) = (0.0, 0.0);
        for (gain, Sensed { rms, noise, .. }) in self.noise_gains.iter().zip(&at_rest.sensed) {
            declared += gain * gain * noise * noise;
            all += gain * gain * rms * rms;
        }
        declared > 0.5 * all
    }

    /// Returns whether the loop is stable with the nominal plant and in all corners.
    pub fn is_stable(&self) -> bool {
        self.margins.is_some() && self.unstable_corners.is_empty()
    }

    /// Returns the first defect of the loop for this noise limit; `None` if the design may be suggested.
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
}

/// Returns the closed loop of a scenario at rest, the limits of its design, and a suggested design.
///
/// # Errors
/// The scenario has no loop at rest, or the loop has no finite matrices.
pub fn design(experiment: &Experiment) -> Result<Design, Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    let asked = asked(experiment);
    let got = ClosedLoop::of(at_rest, at_rest.law.as_ref(), experiment.period_s, offset_per_s(experiment))?;
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
    let (sets, prices) = match &experiment.drive {
        Some(drive) => {
            let sets = gain_sets(&drive.designed, at_rest)?;
            let prices = prices(&drive.designed, &sets, drive.current_lag_s, at_rest)?;
            (sets, prices)
        }
        None => Default::default(),
    };
    let mut left_out = at_rest.left_out.clone();
    if experiment.drive.as_ref().is_some_and(|drive| drive.designed.form().gain_sets > sets.len()) {
        left_out.push("the high gains, which are no design of their own");
    }
    let is_of_offset = |asked: &&AskedPoles| asked.name != OFFSET;
    let rates = asked.iter().filter(is_of_offset).flat_map(|asked| &asked.poles).map(|pole| -pole.re);
    Ok(Design {
        scenario: experiment.name.clone(),
        period_s: experiment.period_s,
        observers_rad_s: experiment
            .drive
            .as_ref()
            .map_or_else(Vec::new, |drive| drive.designed.bandwidths().observers_rad_s),
        decay_asked_per_s: rates.fold(f64::INFINITY, f64::min),
        noise: noise.collect(),
        bounds: bounds(experiment),
        limits: limits(experiment, at_rest, &got),
        suggested: suggested(experiment, at_rest, &got)?,
        gain_sets: sets,
        prices,
        inertia_range: covered(at_rest, at_rest.law.as_ref(), experiment.period_s)?,
        left_out,
        asked,
        got,
    })
}

impl Design {
    /// Returns the design poles.
    pub fn asked_poles(&self) -> impl Iterator<Item = Root> {
        self.asked.iter().flat_map(|asked| asked.poles.iter().copied())
    }

    /// Returns the poles of the closed loop.
    pub fn poles(&self) -> impl Iterator<Item = Root> {
        self.got.poles.iter().copied()
    }

    /// Returns the rms current noise from encoder quantisation, A; `None` if the loop is unstable.
    pub fn noise(&self) -> Option<f64> {
        let sum: f64 = self.noise.iter().map(|noise| noise.u_rms * noise.u_rms).sum();
        self.got.margins.map(|_| sum.sqrt())
    }
}

/// Name of the offset among the design poles.
const OFFSET: &str = "offset decay alpha";

fn real(rate: f64) -> Vec<Root> {
    vec![Root { re: -rate, im: 0.0 }]
}

fn roots(poles: &[Pole]) -> Vec<Root> {
    poles.iter().map(|&Pole { re, im }| Root { re, im }).collect()
}

/// Returns the design poles of a scenario.
fn asked(experiment: &Experiment) -> Vec<AskedPoles> {
    let one = |name: &str, poles, meaning| AskedPoles { name: name.into(), poles, meaning };
    let bessel = |omega: f64, states: usize| -> Vec<Root> {
        let both = |Pole { re, im }| [im, -im].map(|im| Root { re: re * omega, im: im * omega });
        let all = bessel_poles(states).into_iter().flat_map(both);
        // A real root has no conjugate.
        all.take(states).collect()
    };
    let mut lines = match (&experiment.drive, &experiment.spec) {
        (Some(drive), _) => {
            let form = drive.designed.form();
            let (w, kind) = (drive.designed.bandwidths(), DriveKind::of(&drive.designed));
            let (count, meaning) = kind.error;
            if drive.designed.is_whole() {
                // The poles of the filter of both encoders cannot be assigned to one encoder.
                let rigid = "pole of the rigid shaft; the spring shifts it";
                let lines = [("position error w_c", w.surface_rad_s), ("reaching gain k_l", w.reaching_per_s)];
                let mut lines: Vec<_> = lines.into_iter().map(|(name, rate)| one(name, real(rate), rigid)).collect();
                if let DriveDesign::Joint(DriveOf { design, .. }) = &drive.designed
                    && let Some(z) = design.reaching_pole()
                {
                    lines.push(one(
                        "sigma*",
                        real(-libm::log(z) / design.period_s),
                        "decay of sigma*, -ln(z)/T of the joint with its spring",
                    ));
                }
                lines.push(one(OFFSET, real(offset_per_s(experiment)), "decay of the start-up offset W"));
                return lines;
            }
            let surface = one("position error w_c", vec![real(w.surface_rad_s)[0]; count], meaning);
            // A speed loop has no position error pole.
            let surface = (form.follows == Follows::Position).then_some(surface);
            let observer = |(name, w): (&&str, &f64)| {
                one(name, bessel(*w, form.observer_states), "estimation error, Bessel poles")
            };
            let observers = kind.observers.iter().zip(&w.observers_rad_s).map(observer);
            let reaching = one("reaching gain k_l", real(w.reaching_per_s), kind.reaching);
            surface.into_iter().chain(observers).chain([reaching]).collect()
        }
        (None, Some(ControllerSpec { config: AnyConfig { n, padded }, .. })) => {
            let mut lines =
                vec![one("surface", roots(&surface_roots(&padded.surface.c[..*n])), "error in sliding motion")];
            let observers = (1..).zip(&padded.observers).take(*n);
            lines.extend(observers.filter_map(|(channel, gains)| {
                Some(one(&format!("observer of d_{channel}"), roots(&error_poles(gains.as_ref()?)), "estimation error"))
            }));
            if padded.reaching.k_l > 0.0 {
                lines.push(one("reaching gain k_l", real(padded.reaching.k_l), "sigma* to zero"));
            }
            lines
        }
        (None, None) => return Vec::new(),
    };
    lines.push(one(OFFSET, real(offset_per_s(experiment)), "decay of the start-up offset W"));
    lines
}

/// Returns the ultimate bounds λ_2, λ_3 and, for each channel, δ_i0 of a configuration for disturbances with bounds
/// μ_i^(k). Returns `None` if no such bounds exist.
pub fn ultimates(config: &AnyConfig, mu: &[Vec<f64>]) -> Option<(f64, f64, Vec<f64>)> {
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
        let (gates, unit) = (drive.designed.gate_steps(), DriveKind::of(&drive.designed).sigma_unit);
        let spring = match drive.designed {
            DriveDesign::Joint(DriveOf { design: JointDesign { joint, .. }, .. }) => {
                let JointRatios { k1, k2, .. } = JointRatios::of(&joint, 0.0);
                let (anti, both) = (k1.sqrt(), (k1 + k2).sqrt());
                let per_tick =
                    format!("motor against link on the spring; {} rad per tick", number(both * experiment.period_s));
                vec![
                    one("anti-resonance", anti, "rad/s", "link on the spring, motor held"),
                    one("resonance", both, "rad/s", &per_tick),
                ]
            }
            DriveDesign::Motor(_) => Vec::new(),
        };
        let gates = drive.shafts.iter().zip(gates).map(|(shaft, steps)| {
            one(
                &format!("innovation gate, {}", shaft.name),
                steps,
                "counts",
                "a count farther from its prediction is rejected",
            )
        });
        let sigma = one("|sigma*|, lambda_2", drive.sigma_star_bound, unit, "for innovations of at most one count");
        let speeds = drive.top_speed.map(|it| {
            let at_full = format!("up to which {} A flow, behind the gear", number(drive.max_current_a));
            [
                one("top speed", it.no_load_rad_s, "rad/s", "supply limit without load or friction, behind the gear"),
                one("speed at full current", it.full_current_rad_s, "rad/s", &at_full),
            ]
        });
        return spring.into_iter().chain(gates).chain([sigma]).chain(speeds.into_iter().flatten()).collect();
    }
    let mu: Vec<Vec<f64>> = experiment.mu.iter().map(|mu| mu.by_order.clone()).collect();
    let found = experiment.spec.as_ref().and_then(|spec| ultimates(&spec.config, &mu));
    let found = found.filter(|(sigma_star, y, _)| sigma_star.is_finite() && y.is_finite());
    found.map_or_else(Vec::new, |(sigma_star, y, _)| {
        let meaning = "ultimate bound for the disturbances of the file, without model errors";
        vec![one("|sigma*|, lambda_2", sigma_star, "", meaning), one("|y|, lambda_3", y, "", meaning)]
    })
}

fn limits(experiment: &Experiment, at_rest: &AtRest, got: &ClosedLoop) -> Vec<Limit> {
    let period_s = experiment.period_s;
    let mut found = Vec::new();
    let mut limit = |what, used: f64, meaning: String| {
        if used.is_finite() {
            found.push(Limit { what, used, meaning });
        }
    };
    if let Some(phase) = got.margins.and_then(|margins| margins.phase_deg) {
        limit("phase margin", LEAST_PHASE_DEG / phase, format!("at least {LEAST_PHASE_DEG} deg"));
    }
    if let Some(drive) = &experiment.drive {
        let most = NOISE_SHARE * drive.max_current_a;
        if let Some(noise) = got.noise(at_rest) {
            let is_noisy = at_rest.sensed.iter().any(|sensed| sensed.noise > 0.0);
            let source = if is_noisy { "quantisation and noise" } else { "quantisation" };
            let meaning = format!("encoder {source} may cause {} A, 1 % of max_current_a", number(most));
            limit("current noise", noise / most, meaning);
        }
        let form = drive.designed.form();
        let most = observer_limit(&drive.designed);
        match &drive.designed {
            DriveDesign::Motor(DriveOf { design, .. }) => {
                let (lag_s, delay_ticks) = (drive.current_lag_s, form.delay_ticks as u32);
                let [_, most_rad_s] = design.limits_by_rule(drive.margin, lag_s, delay_ticks);
                let [hold, lag, delay] =
                    design.lost_time_s(drive.margin, lag_s, delay_ticks).map(|lost_s| number(1e3 * lost_s));
                let w = design.bandwidths;
                // A speed loop has no w_c; its k_l follows the w_c of the rule.
                let (whose, own_rad_s) = match (drive.margin, form.follows) {
                    (MotorMargin::Standard, _) => ("w_o", w.observer_rad_s),
                    (MotorMargin::Fast, Follows::Position) => ("w_c", w.surface_rad_s),
                    (MotorMargin::Fast, Follows::Speed) => ("w_c of the rule", w.surface_rad_s),
                };
                let what = if drive.margin == MotorMargin::Fast { "sampling" } else { "sampling and control law" };
                let meaning = format!(
                    "{whose} <= {} rad/s for {hold} ms of {what} + {lag} ms of current loop + {delay} ms of \
                     computation",
                    number(most_rad_s)
                );
                limit("loop delay", own_rad_s / most_rad_s, meaning);
                limit("observer", w.observer_rad_s * period_s / most, format!("w_o period_s <= {most}"));
                limit("reaching gain", w.reaching_per_s * period_s, "k_l period_s <= 1".into());
            }
            DriveDesign::Joint(DriveOf { design: JointDesign { coupled: Some(_), .. }, .. }) => {}
            DriveDesign::Joint(DriveOf { design: JointDesign { bandwidths: w, .. }, .. }) => {
                limit("motor observer", w.motor_rad_s * period_s / most, format!("bandwidth times period_s <= {most}"));
                limit("reaching gain", w.reaching_per_s * period_s / 0.3, "k_l period_s <= 0.3".into());
                limit("link observer", 3.0 * w.surface_rad_s / w.link_rad_s, "w_c <= a third of its bandwidth".into());
            }
        }
    } else if let Some(ControllerSpec { config, .. }) = &experiment.spec {
        let poles = config.padded.observers.iter().take(config.n).flatten().flat_map(error_poles);
        let fastest = poles.map(|pole| libm::hypot(pole.re, pole.im)).fold(0.0, f64::max);
        limit("observer", fastest * period_s / 0.3, "fastest pole times period_s <= 0.3".into());
        limit("reaching gain", config.padded.reaching.k_l * period_s / 0.5, "k_l period_s <= 0.5".into());
    }
    found.sort_by(|a, b| b.used.total_cmp(&a.used));
    found
}

/// Returns the reason why a drive must not be exported: it is unstable, or unstable within its declared uncertainty.
/// The text includes a stable design and the key that accepts the design anyway. Returns `None` for a scenario without
/// a drive.
pub fn refused_as_unstable(experiment: &Experiment) -> Option<String> {
    let drive = experiment.drive.as_ref().filter(|drive| !drive.accepts_unstable)?;
    // Its tuning is the suggested one already.
    let is_by_rule = matches!(&drive.designed, DriveDesign::Joint(joint) if joint.design.coupled.is_some());
    let why = warnings(experiment).into_iter().next()?;
    let is_stable = |got: &ClosedLoop| got.margins.is_some() && got.unstable_corners.is_empty();
    let remedy = match design(experiment) {
        // Only the high gains are unstable; the warning contains the remedy.
        Ok(design) if is_stable(&design.got) => String::new(),
        Ok(Design { suggested: Some(suggested), .. }) if is_stable(&suggested.got) && is_by_rule => {
            "leave out the bandwidths of [drive], so that the rule sets them; ".into()
        }
        Ok(Design { suggested: Some(suggested), .. }) if is_stable(&suggested.got) => {
            let key = |[_, line]: &[String; 2]| format!("drive.{}", line.split("  #").next().unwrap_or(line));
            format!("set {}; ", suggested.lines.iter().map(key).collect::<Vec<_>>().join(" and "))
        }
        _ => "no gains by rule are stable in every corner: lower drive.uncertain_percent if the data sheet allows it; "
            .into(),
    };
    Some(format!("{why}; {remedy}drive.accept_unstable = true exports it anyway"))
}

/// Candidate design of a drive.
struct Candidate {
    /// Name of the candidate.
    word: String,
    /// Lines of the candidate in the scenario file.
    lines: Vec<String>,
    /// Whether it equals the design of the file.
    is_same: bool,
    /// Limiting factor, if it is known.
    why: Option<String>,
    /// Closed loop of the candidate, or the reason why the design is invalid.
    got: Result<ClosedLoop, &'static str>,
}

/// Returns the first design without a defect, with the period of the file or a shorter one. Without one, returns the
/// design with the mildest defect if it is better than the file.
fn suggested(
    experiment: &Experiment,
    at_rest: &AtRest,
    present: &ClosedLoop,
) -> Result<Option<Suggested>, MarginsError> {
    let Some(drive) = &experiment.drive else {
        let Some(spec) = &experiment.spec else { return Ok(None) };
        return for_surface(spec, at_rest, experiment.period_s);
    };
    if drive.is_slowed_by_play {
        return Ok(None);
    }
    let is_noisy = present.is_of_declared_noise(at_rest);
    let share_a = NOISE_SHARE * drive.max_current_a;
    // The rule of a motor already limits the noise from quantisation, but not other noise.
    let most_noise = match drive.designed {
        DriveDesign::Motor(_) if !is_noisy => f64::INFINITY,
        _ => share_a,
    };
    let declared = is_noisy.then_some(share_a);
    let mut least = present.flaw(at_rest, most_noise).map_or(0, |flaw| flaw.weight());
    let mut nearest = None;
    let mut at_this_period = String::new();
    for times in SHORTER {
        let period_s = experiment.period_s / f64::from(times);
        if times > 1 && period_s < SHORTEST_S {
            break;
        }
        let tried = match &drive.designed {
            DriveDesign::Motor(motor) => {
                vec![for_motor(motor, (drive.margin, drive.current_lag_s), period_s, at_rest, declared)?]
            }
            DriveDesign::Joint(joint) => for_joint(joint, drive.coupled, period_s, at_rest, declared)?,
        };
        // Defect of the next faster design.
        let mut refused = String::from("the fastest of the measured sets");
        for Candidate { word, lines, is_same, why, got } in tried {
            let got = match got {
                Ok(got) => got,
                Err(why) => {
                    refused = format!("{word} is refused: {why}");
                    continue;
                }
            };
            let period = (times > 1).then(|| format!("period_s = {}", as_toml(period_s)));
            let lines = period.into_iter().chain(lines).map(|line| ["[drive]".into(), line]).collect();
            let Some(flaw) = got.flaw(at_rest, most_noise) else {
                let why = match why.unwrap_or(refused) {
                    why if is_same => format!("keep this design; {why}"),
                    _ if times > 1 => format!(
                        "a shorter period: at the period of the file {at_this_period}. `host-sim tune` searches beyond \
                         these sets"
                    ),
                    why => why,
                };
                return Ok(Some(Suggested { lines, why, is_same, got }));
            };
            refused = format!("{word} {flaw}");
            if flaw.weight() < least {
                least = flaw.weight();
                let why = format!("better than this file, but not within all limits; {refused}");
                nearest = Some(Suggested { lines, why, is_same, got });
            }
        }
        if times == 1 {
            at_this_period = refused;
        }
    }
    Ok(nearest)
}

/// Returns the closed loop of a drive design at rest, or the reason why the design is invalid.
fn closed(designed: &DriveDesign, at_rest: &AtRest) -> Result<Result<ClosedLoop, &'static str>, MarginsError> {
    let offset_per_s = designed.bandwidths().offset_per_s;
    let closed = |law: DriveAtRest| ClosedLoop::of(at_rest, law.law.as_ref(), designed.period_s(), offset_per_s);
    designed.at_rest().map_or_else(|error| Ok(Err(error.why)), |law| closed(law).map(Ok))
}

/// Designs a motor by rule, with the declared noise.
pub(crate) fn motor_by_rule(
    design: &MotorDesign,
    (margin, lag_s, delay_ticks): (MotorMargin, f64, u32),
    at_rest: &AtRest,
) -> MotorDesign {
    let noise_rad = at_rest.sensed.first().map_or(0.0, |sensed| sensed.noise);
    design.with_margin(margin, lag_s, delay_ticks).with_noise(margin, noise_rad)
}

fn for_motor(
    motor: &DriveOf<MotorDesign, 1>,
    (margin, lag_s): (MotorMargin, f64),
    period_s: f64,
    at_rest: &AtRest,
    declared: Option<f64>,
) -> Result<Candidate, MarginsError> {
    let (design, form) = (motor.design, motor.form);
    let delay_ticks = form.delay_ticks as u32;
    let by_rule = motor_by_rule(&MotorDesign { period_s, ..design }, (margin, lag_s, delay_ticks), at_rest);
    let with = |surface_rad_s| {
        DriveDesign::Motor(DriveOf { design: by_rule.with_surface_by(margin, surface_rad_s), ..*motor })
    };
    let quiet = declared.map(|most| quiet_enough(by_rule.bandwidths.surface_rad_s, most, at_rest, with)).transpose()?;
    let quiet = quiet.flatten();
    let by_rule = quiet.map_or(by_rule, |surface_rad_s| by_rule.with_surface_by(margin, surface_rad_s));
    let w = by_rule.bandwidths;
    let got = closed(&DriveDesign::Motor(DriveOf { design: by_rule, ..*motor }), at_rest)?;
    let late = by_rule.lost_time_s(margin, lag_s, delay_ticks);
    let (lost_s, longest) = (late.iter().sum::<f64>(), late.iter().fold(0.0, |a: f64, b| a.max(*b)));
    let [by_noise, by_phase] = by_rule.limits_by_rule(margin, lag_s, delay_ticks);
    let (whose, own) = match margin {
        MotorMargin::Standard => ("w_o = ", w.observer_rad_s),
        MotorMargin::Fast => ("", w.surface_rad_s),
    };
    let why = if quiet.is_some() {
        declared_in_words(at_rest)
    } else if own < 0.999 * by_noise.min(by_phase) {
        let half = by_noise.min(by_phase).min(own * libm::pow(2.0, 0.4));
        format!("{}; half of this noise allows {whose}{} rad/s", declared_in_words(at_rest), number(half))
    } else if by_noise < 0.999 * by_phase {
        let two_bits = by_phase.min(by_noise * libm::pow(4.0, 0.4));
        format!("encoder quantisation limits the bandwidth; two more bits allow {whose}{} rad/s", number(two_bits))
    } else {
        let remedy = match late.iter().position(|part| *part == longest) {
            Some(0) => "a shorter period",
            Some(1) => "a faster current loop",
            _ if form.delay_ticks > 1 => "fewer ticks of delay",
            _ => "drive.delay_ticks = 0",
        };
        format!("loop delay ({} ms) limits the bandwidth; {remedy} allows more", number(1e3 * lost_s))
    };
    let line = format!(
        "surface_rad_s = {}  # then w_o = {}, k_l = {}, alpha = {}",
        within(w.surface_rad_s, 0.5 / period_s),
        number(w.observer_rad_s),
        number(w.reaching_per_s),
        number(w.offset_per_s)
    );
    let one_set = quiet.and_then(|_| one_set(form, &design.switching, period_s, at_rest));
    let now = design.bandwidths;
    let is_near = [(now.surface_rad_s, w.surface_rad_s), (now.observer_rad_s, w.observer_rad_s)]
        .iter()
        .all(|(now, rule)| (now / rule - 1.0).abs() < 1e-3);
    let is_same = period_s == design.period_s && is_near && one_set.is_none();
    let lines = [line].into_iter().chain(one_set).collect();
    Ok(Candidate { word: "the rule".into(), lines, is_same, why: Some(why), got })
}

/// Formats a value with three digits, rounded to stay within a limit.
fn within(value: f64, most: f64) -> String {
    let text = number(value);
    if text.parse::<f64>().is_ok_and(|rounded| rounded <= most) { text } else { number(0.995 * value) }
}

/// Returns the measured sets, fastest first.
fn for_joint(
    joint: &DriveOf<JointDesign, 2>,
    coupled: Option<CoupledBy>,
    period_s: f64,
    at_rest: &AtRest,
    declared: Option<f64>,
) -> Result<Vec<Candidate>, MarginsError> {
    let (design, form) = (joint.design, joint.form);
    let as_whole = || coupled.map_or(Ok(None), |by| joint_as_whole(joint, by, period_s, at_rest));
    if design.coupled.is_some() {
        return Ok(as_whole()?.into_iter().collect());
    }
    let sets =
        [("firm", JointBandwidths::FIRM), ("normal", JointBandwidths::DEFAULT), ("quiet", JointBandwidths::QUIET)];
    let tried = sets.map(|(word, set)| {
        let w = set.slowed_for(period_s, form.delay_ticks).within(period_s, form.delay_ticks);
        let design_with = JointDesign { period_s, bandwidths: w, ..design };
        let got = closed(&DriveDesign::Joint(DriveOf { design: design_with, ..*joint }), at_rest)?;
        let line = format!(
            "tuning = {word:?}  # w_c = {}, observers {} and {}, k_l = {}, alpha = {}",
            number(w.surface_rad_s),
            number(w.link_rad_s),
            number(w.motor_rad_s),
            number(w.reaching_per_s),
            number(w.offset_per_s)
        );
        let is_same = period_s == design.period_s && w == design.bandwidths;
        Ok(Candidate { word: format!("{word:?}"), lines: vec![line], is_same, why: None, got })
    });
    let slower = declared.map(|most| slower_joint(joint, period_s, at_rest, most)).transpose()?.flatten();
    let mut tried = tried.into_iter().chain(slower.map(Ok)).collect::<Result<Vec<_>, _>>()?;
    // The search takes longer than all measured sets, so it runs only if none of them is stable.
    if tried.iter().all(|tried| tried.got.as_ref().map_or(true, |got| !got.unstable_corners.is_empty())) {
        tried.extend(as_whole()?);
    }
    Ok(tried)
}

/// Designs the coupled joint by rule; `None` if the rule finds no design.
fn joint_as_whole(
    joint: &DriveOf<JointDesign, 2>,
    by: CoupledBy,
    period_s: f64,
    at_rest: &AtRest,
) -> Result<Option<Candidate>, MarginsError> {
    let Ok((design, rule)) = by.by_rule(&JointDesign { period_s, ..joint.design }) else { return Ok(None) };
    let w = design.bandwidths;
    let line = format!(
        "tuning = \"coupled\"  # poles of the rigid shaft {} and {}, observers {} and {}",
        number(w.surface_rad_s),
        number(w.reaching_per_s),
        number(w.link_rad_s),
        number(w.motor_rad_s)
    );
    let got = closed(&DriveDesign::Joint(DriveOf { design, ..*joint }), at_rest)?;
    let is_same =
        design.coupled == joint.design.coupled && w == joint.design.bandwidths && period_s == joint.design.period_s;
    let why = Some(format!("coupled design, limited by {}", rule.binding));
    Ok(Some(Candidate { word: "\"coupled\"".into(), lines: vec![line], is_same, why, got }))
}

/// Slows the set "quiet" until the declared noise meets the limit.
fn slower_joint(
    joint: &DriveOf<JointDesign, 2>,
    period_s: f64,
    at_rest: &AtRest,
    most_a: f64,
) -> Result<Option<Candidate>, MarginsError> {
    let (design, form, quiet) = (joint.design, joint.form, JointBandwidths::QUIET);
    let with = |surface_rad_s| {
        let bandwidths = quiet.with_surface(surface_rad_s).within(period_s, form.delay_ticks);
        DriveDesign::Joint(DriveOf { design: JointDesign { period_s, bandwidths, ..design }, ..*joint })
    };
    let Some(surface_rad_s) = quiet_enough(quiet.surface_rad_s, most_a, at_rest, with)? else { return Ok(None) };
    let designed = with(surface_rad_s);
    let lines = ["tuning = \"quiet\"".to_owned(), format!("surface_rad_s = {}", number(surface_rad_s))];
    let lines = lines.into_iter().chain(one_set(form, &design.switching, period_s, at_rest)).collect();
    Ok(Some(Candidate {
        word: "a slower one".into(),
        lines,
        is_same: false,
        why: Some(declared_in_words(at_rest)),
        got: closed(&designed, at_rest)?,
    }))
}

/// Returns the fastest bandwidth below this one whose current noise meets the limit, to three digits. Returns `None` if
/// this bandwidth already meets it or the slowest one does not.
fn quiet_enough(
    fastest_rad_s: f64,
    most_a: f64,
    at_rest: &AtRest,
    with: impl Fn(f64) -> DriveDesign,
) -> Result<Option<f64>, MarginsError> {
    let is_quiet = |surface_rad_s: f64| -> Result<bool, MarginsError> {
        let got = closed(&with(surface_rad_s), at_rest)?.ok();
        Ok(got.and_then(|got| got.noise(at_rest)).is_some_and(|noise| noise <= most_a))
    };
    if is_quiet(fastest_rad_s)? {
        return Ok(None);
    }
    // Small steps: a joint that is far too slow is unstable, and its noise is then infinite.
    let (mut low, mut high) = (fastest_rad_s, fastest_rad_s);
    while !is_quiet(low)? {
        (low, high) = (0.8 * low, low);
        if low < 1e-3 * fastest_rad_s {
            return Ok(None);
        }
    }
    for _ in 0..10 {
        let middle = (low * high).sqrt();
        if is_quiet(middle)? { low = middle } else { high = middle }
    }
    // Rounded down: a lower bandwidth is quieter.
    Ok(significant(0.995 * low, 3).parse().ok())
}

/// Returns the line that drops the high gains if noise alone schedules them in. They act while the smoothed innovation
/// exceeds calm; noise reaches three deviations now and then.
fn one_set(form: Form, switching: &Switching, period_s: f64, at_rest: &AtRest) -> Option<String> {
    let smoothed = 3.0 * (0.5 * period_s / switching.smoothing_s).sqrt();
    let calls = |sensed: &Sensed| smoothed * sensed.noise > switching.calm_steps * sensed.quantum;
    (form.gain_sets > 1 && at_rest.sensed.iter().any(calls))
        .then(|| "gain_sets = 1  # noise of this size switches the high gains on again and again".to_owned())
}

/// Explains in words that declared noise limits the bandwidth.
fn declared_in_words(at_rest: &AtRest) -> String {
    let each =
        at_rest.sensed.iter().filter(|sensed| sensed.noise > 0.0).map(|Sensed { name, noise, quantum, .. }| {
            format!(
                "{} rad rms of the {name}'s encoder, its steps make {}",
                number(*noise),
                number(quantum / f64::sqrt(12.0))
            )
        });
    let is_finer = at_rest.sensed.iter().all(|sensed| sensed.noise * f64::sqrt(12.0) > sensed.quantum);
    let bits = if is_finer { ": no more bits help" } else { "" };
    format!("the declared noise binds ({}){bits}", each.collect::<Vec<_>>().join("; "))
}

/// Suggests α, k_l and observers for the sliding motion of the file. α is half its slowest root, k_l five times and the
/// observers four times this root. The observer of the driven channel is six times as fast as the others. All of them
/// stay within the limits of the period. k_l and the observers are slowed until the loop is acceptable.
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
        let got = ClosedLoop::of(at_rest, designed.at_rest.as_ref(), period_s, alpha)?;
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

/// Formats a period as in a scenario file.
fn as_toml(period_s: f64) -> String {
    format!("{:?}", significant(period_s, 6).parse().unwrap_or(period_s))
}

fn round_to_two(value: f64) -> f64 {
    significant(value, 2).parse().unwrap_or(value)
}

fn number(value: f64) -> String {
    significant(value, 3)
}
