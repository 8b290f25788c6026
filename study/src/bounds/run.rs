//! Bounds of a scenario by part, compared with a run, and the gain changes that lower them.
//!
//! The external disturbance of the loop at rest is the part of the lumped disturbance that its matrices do not contain.
//! For a chain the signals of the file define it. For any other plant it is taken from a run, and its derivatives are
//! differences over the window.

use std::ops::ControlFlow;

use controller_core::Health;
use loop_sim::MAX_ORDER;
use loop_sim::linear::LawAtRest;
use loop_sim::metrics;
use loop_sim::port::in_process::Precision;
use loop_sim::trace::{Ending, Row, Trace};
use rayon::prelude::*;
use scenario::{AtRest, Experiment, Sensed};
use serde::Serialize;

use super::gain::Gain;
use super::{NoBounds, Quantity, SampledLoop, SignalBounds};
use crate::design::ultimates;
use crate::map::Subject;
use crate::margins::Loop;
use crate::number::significant;
use crate::{Error, Watch};

/// Relative change of a gain for its elasticity.
const NUDGE: f64 = 0.01;
/// Number of derivatives that are taken from a run; an observer has order 3 at most.
const DERIVATIVES: usize = 3;
/// Smallest relative decrease of a bound that is reported.
const LITTLE: f64 = 0.01;
/// Relative change of a gain that is tried.
const STEP: f64 = 0.1;
/// Effects outside of the loop matrices that the bounds contain.
const IN_BOUNDS: [&str; 2] = ["friction, cogging and load", "the switching of the gain sets"];

/// Contribution of one cause to the bounds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// Name of the cause.
    pub name: String,
    /// Contribution to the bound of each quantity.
    pub bounds: Vec<f64>,
    /// Disturbance only: the derivative that gives each bound.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub derivatives: Vec<usize>,
    /// Source of the data.
    pub known: String,
}

/// Effect of a gain: d ln(bound)/d ln(gain) of each quantity, and of the noise of u.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Knob {
    #[serde(skip)]
    gain: Gain,
    /// Name of the gain.
    pub name: String,
    /// Elasticity of the bound of each quantity.
    pub elasticities: Vec<f64>,
    /// Elasticity of the noise of u.
    pub noise_of_u: f64,
}

/// Result of [`bounds`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Name of the scenario.
    pub scenario: String,
    /// Window of the run, s.
    pub window_s: [f64; 2],
    /// Names of the quantities.
    #[serde(rename = "quantities")]
    pub names: Vec<String>,
    /// The quantities.
    #[serde(skip)]
    pub quantities: Vec<Quantity>,
    /// u at rest.
    #[serde(skip)]
    pub rest: f64,
    /// Contribution of each disturbance and sensor.
    pub parts: Vec<Part>,
    /// Bound of each quantity, the sum of all parts.
    pub bounds: Vec<f64>,
    /// Largest value of each quantity over the window of the run.
    pub simulated: Vec<f64>,
    /// Bounds of the continuous loop, `None` if there is none.
    pub continuous: Vec<Option<f64>>,
    /// Effect of each gain on the bounds.
    #[serde(rename = "gains")]
    pub knobs: Vec<Knob>,
    /// Advice that lowers the bound of each quantity, if there is any.
    pub advice: Vec<Option<Advice>>,
    /// Effects that the bounds do not cover.
    pub remarks: Vec<String>,
}

impl Bounds {
    /// Returns a quantity in a row of the run.
    pub fn value(&self, quantity: Quantity, trace: &Trace, row: &Row) -> f64 {
        value(quantity, self.rest, trace, row)
    }
}

/// Returns the loop of a scenario at rest, from disturbances and sensors to the quantities that are bounded.
///
/// # Errors
/// The scenario has no loop at rest, or the loop is unstable.
pub fn loop_of(experiment: &Experiment) -> Result<SampledLoop, Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    if experiment.plant.order() != at_rest.plant.order() {
        return Err(Error::input(
            "no bounds for a motor with play (motor.play_rad): they need a linear plant, and inside the play the motor \
             turns without its load. `motor.play_rad = 0` gives the bounds of a gear without play",
        ));
    }
    Ok(sampled(experiment, at_rest, at_rest.law.as_ref(), experiment.period_s)?)
}

/// Returns the bounds of a scenario, compares them with a run and searches gain changes that lower them. Returns `None`
/// if stopped. A step of the watch is a gain that is tried.
///
/// # Errors
/// The loop at rest has no bounds, or the run did not finish.
pub fn bounds(
    experiment: &Experiment,
    trace: &Trace,
    subject: &Subject<'_>,
    watch: Watch<'_>,
) -> Result<Option<Bounds>, Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    let sampled = loop_of(experiment)?;
    if trace.ending != Ending::Finished {
        return Err(Error::failed("the bounds need a run that finishes"));
    }
    let asked = BoundedRun { experiment, at_rest, trace };
    let (quantities, rest) = (sampled.quantities().to_vec(), sampled.rest());
    let known = asked.disturbances(&sampled);
    let knobs = asked.knobs(&known)?;
    let parts = asked.all_parts(&sampled, &known, subject)?;
    let mut found = Bounds {
        scenario: experiment.name.clone(),
        window_s: experiment.window_s,
        names: quantities.iter().map(|quantity| asked.name(*quantity, rest)).collect(),
        bounds: sums(&parts, quantities.len()),
        simulated: largest(&asked, &quantities, rest, asked.trace, None),
        continuous: asked.continuous(&quantities, &sampled),
        parts,
        knobs,
        advice: Vec::new(),
        remarks: Vec::new(),
        quantities,
        rest,
    };
    found.remarks = asked.remarks(&found);
    let Some(advice) = asked.advice(&found, subject, watch) else { return Ok(None) };
    found.advice = advice;
    Ok(Some(found))
}

/// Gain change that lowers a bound, verified by a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// Setting, as in `--set`.
    pub set: String,
    /// Name of the gain.
    pub gain: String,
    /// Relative change of the gain.
    pub change: f64,
    /// Relative change of the bound.
    pub bound: f64,
    /// Relative change of the noise of u.
    pub noise_of_u: f64,
}

/// Scenario and the run that the bounds are compared with.
struct BoundedRun<'a> {
    experiment: &'a Experiment,
    at_rest: &'a AtRest,
    trace: &'a Trace,
}

/// Builds the sampled loop of an experiment with this controller.
fn sampled(
    experiment: &Experiment,
    at_rest: &AtRest,
    law: &dyn LawAtRest,
    period_s: f64,
) -> Result<SampledLoop, NoBounds> {
    let port = experiment.port.as_ref();
    SampledLoop::of(at_rest, law, period_s, port.follows().unwrap_or(0), port.observed())
}

impl BoundedRun<'_> {
    fn name(&self, quantity: Quantity, rest: f64) -> String {
        match quantity {
            Quantity::SigmaStar => "sigma*".into(),
            Quantity::Output if self.trace.follows.is_some() => "y - r".into(),
            Quantity::Output => "y".into(),
            Quantity::Control if rest == 0.0 => "u".into(),
            Quantity::Control => format!("u - ({})", significant(rest, 3)),
            Quantity::EstimationError(i) => format!("d_{0} - d_hat_{0}", i + 1),
        }
    }

    /// Returns the bounds of a signal in the run: its largest differences per T^k over the window between the jumps of
    /// the plant, and the sum of the differences at the jumps.
    fn seen_in_run(&self, of: impl Fn(&Row) -> f64) -> SignalBounds {
        let Self { experiment, trace, .. } = *self;
        let ([from, to], slack) = (experiment.window_s, 0.5 * trace.period_s);
        let jumps_s = experiment.plant.jumps_s();
        let mut known = SignalBounds { mu: vec![0.0; DERIVATIVES + 1], jumps: 0.0 };
        let pieces: Vec<&[Row]> =
            trace.rows.chunk_by(|row, next| !jumps_s.iter().any(|at| row.t_s < *at && *at <= next.t_s)).collect();
        for pair in pieces.windows(2) {
            if let (Some(before), Some(after)) = (pair[0].last(), pair[1].first()) {
                known.jumps += (of(after) - of(before)).abs();
            }
        }
        for piece in pieces {
            let within = piece.iter().filter(|row| row.t_s >= from - slack && row.t_s <= to + slack);
            let mut values: Vec<f64> = within.map(&of).collect();
            for mu in &mut known.mu {
                *mu = values.iter().fold(*mu, |largest, value| largest.max(value.abs()));
                values = values.windows(2).map(|pair| (pair[1] - pair[0]) / trace.period_s).collect();
            }
        }
        known
    }

    /// Returns the external disturbances by channel, and the source of their bounds.
    fn disturbances(&self, sampled: &SampledLoop) -> Vec<(usize, SignalBounds, &'static str)> {
        if !self.experiment.mu.is_empty() {
            let of_file = self.experiment.mu.iter().filter(|mu| mu.mu > 0.0 || mu.jumps > 0.0);
            let known = of_file.map(|mu| {
                (
                    mu.channel - 1,
                    SignalBounds { mu: mu.by_order.clone(), jumps: mu.jumps },
                    "from the terms of the file",
                )
            });
            return known.collect();
        }
        let channels = (0..self.trace.order).map(|i| {
            let outside = |row: &Row| sampled.outside(i, row.d[i], &row.x[..self.trace.order], row.u_held);
            (i, self.seen_in_run(outside), "taken from the run")
        });
        channels.filter(|(_, known, _)| known.mu[0] > 0.0).collect()
    }

    /// Returns the bounds of every quantity by part.
    fn parts(
        &self,
        sampled: &SampledLoop,
        known: &[(usize, SignalBounds, &'static str)],
    ) -> Result<Vec<Part>, NoBounds> {
        let mut parts = Vec::new();
        for (channel, known, by) in known {
            let bounds = sampled.of_disturbance(*channel, known, self.experiment.window_s[0])?;
            let mu: Vec<String> = known.mu.iter().map(|mu| significant(*mu, 3)).collect();
            let jumps = significant(known.jumps, 3);
            let jumps = if known.jumps > 0.0 { format!(", jumps {jumps}") } else { String::new() };
            parts.push(Part {
                name: format!("d_{}", channel + 1),
                bounds: bounds.iter().map(|bound| bound.value).collect(),
                derivatives: bounds.iter().map(|bound| bound.derivative).collect(),
                known: format!("{by}: |d|, |d'|, .. up to {}{jumps}", mu.join(", ")),
            });
        }
        for (i, sensed) in self.at_rest.sensed.iter().enumerate().filter(|(_, sensed)| sensed.quantum > 0.0) {
            parts.push(Part {
                name: format!("steps of {}", sensed.name),
                bounds: sampled.of_sensor(i, 0.5 * sensed.quantum),
                derivatives: Vec::new(),
                known: format!("half of {} {} in each tick, of any sign", significant(sensed.quantum, 3), sensed.unit),
            });
        }
        Ok(parts)
    }

    /// Returns all parts, including the measured ones of this run.
    fn all_parts(
        &self,
        sampled: &SampledLoop,
        known: &[(usize, SignalBounds, &'static str)],
        subject: &Subject<'_>,
    ) -> Result<Vec<Part>, NoBounds> {
        let mut parts = self.parts(sampled, known)?;
        parts.extend(measured(self, sampled.quantities(), sampled.rest(), subject, sampled));
        Ok(parts)
    }

    fn continuous(&self, quantities: &[Quantity], sampled: &SampledLoop) -> Vec<Option<f64>> {
        let none = || vec![None; quantities.len()];
        let Some(spec) = &self.experiment.spec else { return none() };
        let mu: Vec<Vec<f64>> = (0..spec.config.n)
            .map(|i| match self.experiment.mu.get(i) {
                Some(mu) if sampled.is_outside(i) => mu.by_order.clone(),
                _ => self.seen_in_run(|row| row.d[i]).mu,
            })
            .collect();
        let Some((sigma_star, y, delta)) = ultimates(&spec.config, &mu) else { return none() };
        let of = |quantity: &Quantity| match *quantity {
            Quantity::SigmaStar => Some(sigma_star),
            Quantity::Output => Some(y),
            Quantity::Control => None,
            Quantity::EstimationError(i) => delta.get(i).copied(),
        };
        quantities.iter().map(|quantity| of(quantity).filter(|value| value.is_finite())).collect()
    }

    /// Returns the noise gain from each sensor to u.
    fn noise_gains(&self) -> Option<Vec<f64>> {
        Some(Loop::of(self.at_rest, self.at_rest.law.as_ref(), self.experiment.period_s).ok()?.noise_gains())
    }

    /// Returns the noise of each sensor. If no sensor has noise in this file, all of them count equally at u.
    fn weights(&self, noise: &[f64]) -> Vec<f64> {
        let is_quiet = self.at_rest.sensed.iter().all(|sensed| sensed.rms == 0.0);
        let of = |(gain, sensed): (&f64, &Sensed)| if is_quiet && *gain > 0.0 { 1.0 / gain } else { sensed.rms };
        noise.iter().zip(&self.at_rest.sensed).map(of).collect()
    }

    /// Returns the effect of the gains on the sums of all parts.
    fn knobs(&self, known: &[(usize, SignalBounds, &'static str)]) -> Result<Vec<Knob>, NoBounds> {
        let of = |law: &dyn LawAtRest, period_s: f64| -> Result<(Vec<f64>, Vec<f64>), NoBounds> {
            let sampled = sampled(self.experiment, self.at_rest, law, period_s)?;
            let noise = Loop::of(self.at_rest, law, period_s).map_err(NoBounds::Loop)?.noise_gains();
            Ok((sums(&self.parts(&sampled, known)?, sampled.quantities().len()), noise))
        };
        let (bounds, noise) = of(self.at_rest.law.as_ref(), self.experiment.period_s)?;
        let rms = |gains: &[f64]| rms(gains, &self.weights(&noise));
        let base = (bounds, noise.clone());
        let mut knobs = Vec::new();
        for gain in Gain::all(self.experiment) {
            // At the limit of a design only one side exists.
            let at = |by: f64| {
                let (law, period_s) = gain.law(self.experiment, by)?;
                of(law.as_ref(), period_s).ok()
            };
            let (low, high) = (at(1.0 - NUDGE), at(1.0 + NUDGE));
            let sides = f64::from(u8::from(low.is_some()) + u8::from(high.is_some()));
            let ((low, low_noise), (high, high_noise)) =
                (low.as_ref().unwrap_or(&base), high.as_ref().unwrap_or(&base));
            let slope = |low: f64, high: f64| libm::log(high / low) / (sides * NUDGE);
            if sides > 0.0 {
                knobs.push(Knob {
                    gain,
                    name: gain.name(self.experiment),
                    elasticities: low.iter().zip(high).map(|(low, high)| slope(*low, *high)).collect(),
                    noise_of_u: slope(rms(low_noise), rms(high_noise)),
                });
            }
        }
        Ok(knobs)
    }

    /// Returns for each quantity the gain change of a tenth that lowers its bound most. Every change is tried in a run,
    /// because another loop has other disturbances and a file may refuse the change.
    fn advice(&self, found: &Bounds, subject: &Subject<'_>, watch: Watch<'_>) -> Option<Vec<Option<Advice>>> {
        let steps = found.knobs.iter().flat_map(|knob| [-STEP, STEP].map(|change| (knob, change)));
        let steps = steps
            .filter_map(|(knob, change)| Some((knob, change, knob.gain.set(self.experiment, subject, 1.0 + change)?)));
        let steps: Vec<(&Knob, f64, String)> = steps.collect();
        let tried: Vec<_> = steps
            .par_iter()
            .map(|(.., set)| {
                let tried = if watch.is_stopped() { None } else { anew(subject, set) };
                watch.done();
                tried
            })
            .collect();
        if watch.is_stopped() {
            return None;
        }
        let own = self.noise_gains().unwrap_or_default();
        let weights = self.weights(&own);
        let of_quantity = |i: usize| {
            let tried = steps.iter().zip(&tried).filter_map(|(step, tried)| {
                let (bounds, noise) = tried.as_ref()?;
                Some((step, bounds.get(i)? / found.bounds[i] - 1.0, noise))
            });
            let ((knob, change, set), bound, noise) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
            (bound <= -LITTLE).then(|| Advice {
                set: set.clone(),
                gain: knob.name.clone(),
                change: *change,
                bound,
                noise_of_u: rms(noise, &weights) / rms(&own, &weights) - 1.0,
            })
        };
        Some((0..found.bounds.len()).map(of_quantity).collect())
    }

    /// Returns the effects that the bounds do not cover.
    fn remarks(&self, found: &Bounds) -> Vec<String> {
        let BoundedRun { experiment, at_rest, trace } = *self;
        let mut remarks = Vec::new();
        let [from, to] = experiment.window_s;
        let within = trace.rows.iter().filter(|row| row.t_s >= from && row.t_s <= to);
        let limited = within.filter(|row| row.health.contains(Health::SATURATED)).count();
        if limited > 0 {
            remarks.push(format!("u was at its limit in {limited} ticks of the window; the bounds assume no limit"));
        }
        if let Some(spec) = &experiment.spec {
            let reaching = spec.config.padded.reaching;
            let t = experiment.period_s;
            let layer = (reaching.epsilon + reaching.k_s * t) / (1.0 - (reaching.k_l * t).min(1.0));
            if reaching.k_s > 0.0 && found.bounds.first().is_some_and(|bound| *bound > layer) {
                remarks.push(format!(
                    "sigma* may leave the boundary layer of k_s, {}: the bounds hold inside only",
                    significant(layer, 3)
                ));
            }
        }
        if at_rest.sensed.iter().any(|it| it.rms > it.quantum / f64::sqrt(12.0) * 1.001) {
            remarks.push("white noise is unbounded and not included; its rms in u: host-sim design".into());
        }
        let left_out: Vec<&str> = at_rest.left_out.iter().copied().filter(|what| !IN_BOUNDS.contains(what)).collect();
        if !left_out.is_empty() {
            remarks.push(format!("not included: {}", left_out.join(", ")));
        }
        for (i, name) in found.names.iter().enumerate().filter(|(i, _)| found.simulated[*i] > found.bounds[*i]) {
            remarks.push(format!(
                "EXCEEDED: |{name}| reached {}, above the bound of {}, due to effects that are not included",
                significant(found.simulated[i], 4),
                significant(found.bounds[i], 4)
            ));
        }
        remarks
    }
}

/// Returns a quantity in a row of a run.
fn value(quantity: Quantity, rest: f64, trace: &Trace, row: &Row) -> f64 {
    match quantity {
        Quantity::SigmaStar => row.sigma_star,
        Quantity::Output => trace.error(row),
        Quantity::Control => row.u - rest,
        Quantity::EstimationError(i) => row.d[i] - row.d_hat[i],
    }
}

/// Returns the rms of u from sensors with this noise.
fn rms(gains: &[f64], weights: &[f64]) -> f64 {
    gains.iter().zip(weights).map(|(gain, by)| (gain * by).powi(2)).sum::<f64>().sqrt()
}

/// Returns the sum of all parts for each quantity.
fn sums(parts: &[Part], quantities: usize) -> Vec<f64> {
    (0..quantities).map(|i| parts.iter().map(|part| part.bounds[i]).sum()).collect()
}

/// Returns the largest value of each quantity over the window of `run`, or of its difference from another run.
fn largest(asked: &BoundedRun<'_>, quantities: &[Quantity], rest: f64, run: &Trace, other: Option<&Trace>) -> Vec<f64> {
    let value = |quantity: Quantity, trace: &Trace, row: &Row| value(quantity, rest, trace, row);
    let of = |quantity: &Quantity| {
        metrics::ultimate(run, asked.experiment.window_s, |row| {
            let k = (row.t_s / run.period_s).round() as usize;
            let other = other.map_or(Some(0.0), |other| Some(value(*quantity, other, other.rows.get(k)?)));
            value(*quantity, run, row) - other.unwrap_or(f64::NAN)
        })
    };
    quantities.iter().map(of).collect()
}

/// Returns the setting that makes the high gains equal to the base gains, if the drive has both.
fn quiet_alone(experiment: &Experiment) -> Option<&'static str> {
    let designed = &experiment.drive.as_ref()?.designed;
    let sets = match designed.encoders().len() {
        1 => "drive.fast_ratio=1",
        _ => "drive.fast_ratios=[1, 1]",
    };
    (designed.form().gain_sets > 1).then_some(sets)
}

/// Returns the effect of rounding to f32 on a drive with one gain set. Two separate runs would differ in some counts,
/// which the bounds of the encoders already contain. Therefore the drive in f64 receives the counts and the held
/// currents of the run. The difference of both u is the rounding of one tick including the memory. The run equals the
/// f64 loop with this difference added to u. Returns `None` if a monitor stopped the run.
fn rounded(quiet: &Trace, mut twin: Experiment, sampled: &SampledLoop) -> Option<Part> {
    let drive = twin.drive.as_ref()?;
    let mut port = drive.designed.in_f64(&drive.motion).ok()?;
    let (mut of_u, mut of_sigma_star, mut of_d_hat) = (0.0_f64, 0.0_f64, [0.0_f64; MAX_ORDER]);
    for row in &quiet.rows {
        if row.health.contains(Health::STOPPED) {
            return None;
        }
        let mut sample = [0.0; MAX_ORDER];
        twin.sensor.measure(&row.x[..quiet.order], &mut sample[..quiet.order]);
        let tick = port.tick(&sample[..quiet.order]).ok()?;
        port.report_applied(row.u_held);
        of_u = of_u.max((row.u - tick.u).abs());
        of_sigma_star = of_sigma_star.max((row.sigma_star - tick.sigma_star).abs());
        for (most, (a, b)) in of_d_hat.iter_mut().zip(row.d_hat.iter().zip(tick.d_hat())) {
            *most = most.max((a - b).abs());
        }
    }
    let told = |quantity: &Quantity| match *quantity {
        Quantity::SigmaStar => of_sigma_star,
        Quantity::EstimationError(i) => of_d_hat[i],
        Quantity::Output | Quantity::Control => 0.0,
    };
    let of_loop = sampled.of_asked(of_u);
    Some(Part {
        name: "rounding to f32".into(),
        bounds: of_loop.iter().zip(sampled.quantities()).map(|(of_loop, it)| of_loop + told(it)).collect(),
        derivatives: Vec::new(),
        known: format!("from the run: for equal counts u in f32 and f64 differ by up to {} A", significant(of_u, 3)),
    })
}

/// Returns the parts that are measured instead of bounded. Start and reference: a run without disturbances. High gains:
/// the difference from a run with the base gains alone, for which the bounds hold. Rounding to f32: the difference from
/// a run in f64, both without quantisation. The encoders of a drive are unchanged.
fn measured(
    asked: &BoundedRun<'_>,
    quantities: &[Quantity],
    rest: f64,
    subject: &Subject<'_>,
    sampled: &SampledLoop,
) -> Vec<Part> {
    let BoundedRun { experiment, at_rest, .. } = *asked;
    let (spec, quiet) = (experiment.spec.as_ref(), quiet_alone(experiment));
    let exact = |precision: &str| {
        let mut sets: Vec<String> = quiet.map(String::from).into_iter().collect();
        if let Some(spec) = spec {
            sets.push(format!("controller.precision=\"{precision}\""));
            if at_rest.sensed.iter().any(|sensed| sensed.quantum > 0.0) {
                sets.push(format!("sensor.quantum={:?}", vec![0.0; spec.config.n]));
            }
        }
        subject.with(&sets).ok()
    };
    let run = |mut experiment: Experiment, is_undisturbed: bool| {
        if is_undisturbed {
            std::mem::swap(&mut experiment.plant, &mut experiment.at_rest.as_mut().ok()?.plant);
        }
        let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
        (error.is_none() && trace.ending == Ending::Finished).then_some(trace)
    };
    let mut parts = Vec::new();
    let mut part = |name: &str, bounds, known: &str| {
        parts.push(Part { name: name.into(), bounds, derivatives: Vec::new(), known: known.into() });
    };
    if let Some(alone) = exact("f64").and_then(|it| run(it, true)) {
        let name = if asked.trace.follows.is_some() { "start and reference" } else { "start" };
        part(name, largest(asked, quantities, rest, &alone, None), "measured: the run without disturbances");
    }
    let of_quiet = quiet.and_then(|quiet| run(subject.with(&[quiet.into()]).ok()?, false));
    if let Some(quiet) = &of_quiet {
        let apart = largest(asked, quantities, rest, asked.trace, Some(quiet));
        part("high gains", apart, "measured: the run against a run with base gains alone");
    }
    if spec.is_some_and(|spec| spec.precision == Precision::F32)
        && let (Some(f32), Some(f64)) =
            (exact("f32").and_then(|it| run(it, false)), exact("f64").and_then(|it| run(it, false)))
    {
        let apart = largest(asked, quantities, rest, &f32, Some(&f64));
        part("rounding to f32", apart, "measured: the run in f32 against a run in f64");
    }
    let of_drive = if quiet.is_some() { of_quiet.as_ref() } else { Some(asked.trace) };
    if let (Some(of_drive), true) = (of_drive, experiment.drive.is_some()) {
        parts.extend(exact("f64").and_then(|twin| rounded(of_drive, twin, sampled)));
    }
    parts
}

/// Returns the bounds of a scenario with one more setting and its own run, and the noise gain from each sensor to u.
/// Returns `None` if the file refuses the setting or has no bounds.
fn anew(subject: &Subject<'_>, set: &str) -> Option<(Vec<f64>, Vec<f64>)> {
    let sets: Vec<String> = subject.sets.iter().cloned().chain([set.to_owned()]).collect();
    let subject = Subject { sets: &sets, ..*subject };
    let mut experiment = subject.with(&[]).ok()?;
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    if error.is_some() || trace.ending != Ending::Finished {
        return None;
    }
    let at_rest = experiment.at_rest.as_ref().ok()?;
    let sampled = sampled(&experiment, at_rest, at_rest.law.as_ref(), experiment.period_s).ok()?;
    let asked = BoundedRun { experiment: &experiment, at_rest, trace: &trace };
    let parts = asked.all_parts(&sampled, &asked.disturbances(&sampled), &subject).ok()?;
    Some((sums(&parts, sampled.quantities().len()), asked.noise_gains()?))
}
