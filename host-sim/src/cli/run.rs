//! `host-sim run`: simulates a scenario once and prints its metrics, and writes trace and figures. Other commands share
//! its table, figures and verdict.
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

use controller_core::Health;
use loop_sim::closed_loop::LoopError;
use loop_sim::metrics::{FAR, Metrics};
use loop_sim::port::{ControllerPort, PortError};
use loop_sim::trace::{Ending, Trace};
use scenario::{Drive, Experiment, Mu};
use serde::Serialize;
use study::design::Design;
use study::figures::{FLAGS, Figures, ticks_with};
use study::margins;
use study::number::{significant, typed};
use terminal::stop;
use terminal::table::Table;
use whole_file::Claim;

use super::design;
use super::drive;
use super::target::{self, Link};
use super::{Console, Failure, LEFT, RunOptions, bad, claim_folder, failed, status};
use crate::report::plot::Figure;
use crate::report::trace_figure::{self, Labels};
use crate::report::{csv, drive_figure, write_whole};
use link::transport::board::Log;

/// Output of `--json`, and content of run.json.
#[derive(Serialize)]
struct RunJson<'a> {
    scenario: &'a str,
    /// `KEY=VALUE` overrides of the file.
    sets: &'a [String],
    /// Fingerprint of the design, equal to `DESIGN` in its exported files; `None` for a law without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    design_hash: Option<String>,
    #[serde(flatten)]
    figures: Figures,
    ending: &'static str,
    /// Time of the last recorded tick, s.
    ended_at_s: f64,
    /// Reason why the run broke off, other than divergence or a request.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    warnings: &'a [String],
    /// Poles, margins and noise of the linearised loop at rest; `None` for a law that switches.
    #[serde(skip_serializing_if = "Option::is_none")]
    design: Option<&'a Design>,
    /// Bounds of the external disturbances, Eq. (40); chain plants only.
    #[serde(skip_serializing_if = "<[Mu]>::is_empty")]
    mu: &'a [Mu],
    /// Comparison with the target, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<&'a Comparison>,
}

/// Comparison of the controller on a target with the controller in this process.
#[derive(Serialize)]
struct Comparison {
    /// Number of compared ticks.
    ticks: u64,
    /// Number of different bits in the first different output.
    bits_differ: u32,
    round_trips_per_s: f64,
    /// Number of repeated requests.
    repeated: u64,
}

impl Comparison {
    fn line(&self) -> String {
        let Self { ticks, bits_differ, round_trips_per_s, repeated } = self;
        let repeated = match repeated {
            0 => String::new(),
            1 => ", 1 request repeated".into(),
            many => format!(", {many} requests repeated"),
        };
        format!("{ticks} ticks, {bits_differ} bits differ ({round_trips_per_s:.0} round trips/s{repeated})")
    }
}

impl Console<'_> {
    /// Runs a scenario in this process, and with `link` also on a target. `place` is the suffix of the output folder.
    pub(super) fn run(
        &mut self,
        mut experiment: Experiment,
        options: &RunOptions,
        place: &str,
        mut link: Option<Link<'_>>,
    ) -> Result<u8, Failure> {
        note_changes(&mut experiment.title, &options.sets);
        let unstable = margins::warnings(&experiment);
        experiment.warnings.extend(unstable);
        let folder = options.out.clone().unwrap_or_else(|| target::folder(&experiment, place));
        let claim = if options.no_files { None } else { Some(prepare_folder(&folder, &experiment.name)?) };
        let design_hash = experiment.port.fingerprint().map(|hash| format!("{hash:08x}"));
        let head = experiment.headline();
        if options.json {
            self.note(&head);
        } else {
            self.say(&head)?;
        }

        let kept = stop::keeping();
        let started = Instant::now();
        let (mut trace, mut error) = self.watched(&mut experiment, &mut link);
        if let Ending::BrokenOff { t_s } = trace.ending
            && self.stop.load(Ordering::Relaxed)
        {
            // The request to stop ended the wait for a silent target: this is not an error of the connection.
            (trace.ending, error) = (Ending::Interrupted { t_s }, None);
        }
        let comparison = link.map(|link| compared(&trace, error.as_ref(), &link, started));
        let metrics = experiment.metrics(&trace);
        let figures = Figures::of(&mut experiment, &trace, &metrics);
        let error = error.map(|error| error.to_string());
        let design = study::design(&experiment).ok();
        let json = RunJson {
            scenario: &experiment.name,
            sets: &options.sets,
            design_hash,
            figures,
            ending: trace.ending.word(),
            ended_at_s: trace.rows.last().map_or(0.0, |row| row.t_s),
            error: error.clone(),
            warnings: &experiment.warnings,
            design: design.as_ref(),
            mu: &experiment.mu,
            target: comparison.as_ref(),
        };
        let told = serde_json::to_string(&json);
        if claim.is_some() {
            write_results(&folder, &experiment, &trace, options)?;
            write_json(&folder, told.as_deref().unwrap_or_default())?;
        }
        drop((kept, claim));

        if options.json {
            self.say_json(told)?;
        } else {
            self.tell_run(&experiment, &trace, &metrics, &json)?;
            if !options.no_files {
                self.say(&format!("files: {}", folder.display()))?;
            }
            self.say(&format!("result: {}", verdict(&experiment, &trace, &metrics, &json)))?;
        }
        match error {
            Some(message) => Err(failed(message)),
            None if matches!(trace.ending, Ending::Interrupted { .. }) => {
                let kept = if options.no_files { "are lost".into() } else { format!("are in {}", folder.display()) };
                self.note(&format!("stopped on request; the recorded data {kept}"));
                Ok(status::INTERRUPTED)
            }
            None => Ok(status::DONE),
        }
    }

    /// Prints a run as text.
    fn tell_run(
        &mut self,
        experiment: &Experiment,
        trace: &Trace,
        metrics: &Metrics,
        json: &RunJson<'_>,
    ) -> Result<(), Failure> {
        for line in experiment.drive.iter().flat_map(|drive| &drive.chosen) {
            self.say(line)?;
        }
        self.say(&table(experiment, metrics, &json.figures, json.design, trace).to_string())?;
        for line in json.design.into_iter().flat_map(design::short) {
            self.say(&line)?;
        }
        for warning in json.warnings {
            self.say(&format!("warning: {warning}"))?;
        }
        Ok(())
    }

    /// Runs the loop with a progress bar until its end or Ctrl-C, and prints the log of the target.
    pub(super) fn watched(
        &mut self,
        experiment: &mut Experiment,
        link: &mut Option<Link>,
    ) -> (Trace, Option<LoopError>) {
        let periods = experiment.periods as u64;
        let bar = self.bar(periods, LEFT);
        let _looking = stop::looking();
        // 200 updates of the bar: drawing is slower than a tick.
        let stride = (periods / 200).max(1);
        let mut ticks = 0;
        let mut drive;
        let (remote, log) = match link {
            Some(Link { remote, log }) => {
                let port: &mut dyn ControllerPort = match &experiment.drive {
                    Some(Drive { designed, motion, .. }) => {
                        drive = designed.port_to(remote, motion);
                        drive.as_mut()
                    }
                    None => remote,
                };
                (Some(port), log.as_ref())
            }
            None => (None, None),
        };
        let result = experiment.run_beside(remote, &mut |_| {
            ticks += 1;
            if ticks % stride == 0 {
                bar.set_position(ticks);
            }
            while let Some(line) = log.and_then(Log::next) {
                bar.suspend(|| self.note(&format!("log: {line}")));
            }
            if self.stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        bar.finish_and_clear();
        if let Some(log) = log {
            self.rest_of(log);
        }
        result
    }
}

/// Returns the comparison with the target after a run that began at `started`.
fn compared(trace: &Trace, error: Option<&LoopError>, link: &Link, started: Instant) -> Comparison {
    let traffic = link.remote.traffic();
    let bits_differ = match error {
        Some(LoopError::Port(PortError::Differs(difference))) => difference.bits(),
        _ => 0,
    };
    Comparison {
        ticks: trace.rows.len() as u64 + u64::from(bits_differ > 0),
        bits_differ,
        round_trips_per_s: trace.rows.len() as f64 / started.elapsed().as_secs_f64(),
        repeated: traffic.repeated,
    }
}

/// Appends the changes of `--set` to a title, on one line: the title itself describes the unchanged file.
pub(super) fn note_changes(title: &mut String, sets: &[String]) {
    let is_label = |set: &String| matches!(set.split('=').next().map(str::trim), Some("title" | "name"));
    let on_a_line = |set: &String| {
        let words: Vec<&str> = set.split(|c: char| c.is_whitespace() || c.is_control()).collect();
        words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
    };
    let changes: Vec<String> = sets.iter().filter(|set| !is_label(set)).map(on_a_line).collect();
    if !changes.is_empty() {
        title.push_str("; set ");
        title.push_str(&changes.join(", "));
    }
}

/// File name of the results as JSON.
const RUN_JSON: &str = "run.json";

/// Claims the output folder of a scenario with [`claim_folder`].
///
/// # Errors
/// If the folder contains results of another scenario.
fn prepare_folder(folder: &Path, name: &str) -> Result<Claim, Failure> {
    let left = std::fs::read_to_string(folder.join(RUN_JSON)).unwrap_or_default();
    let left = serde_json::from_str::<serde_json::Value>(&left).unwrap_or_default();
    match left["scenario"].as_str() {
        Some(other) if other != name => {
            let message = format!(
                "output folder {} holds the results of scenario {other:?}: give {name:?} another folder with --out, or \
                 remove this one",
                folder.display()
            );
            Err(bad(message))
        }
        _ => claim_folder(folder),
    }
}

fn write_json(folder: &Path, text: &str) -> Result<(), Failure> {
    let path = folder.join(RUN_JSON);
    write_whole(&path, |out| writeln!(out, "{text}")).map_err(|error| Failure::writing(path.display(), &error))
}

fn write_results(folder: &Path, experiment: &Experiment, trace: &Trace, options: &RunOptions) -> Result<(), Failure> {
    let path = folder.join("trace.csv");
    let states = experiment.drive.as_ref().map_or(&[][..], |drive| drive.states);
    csv::write(trace, states, options.every.unwrap_or(NonZeroUsize::MIN), &path)
        .map_err(|error| Failure::writing(path.display(), &error))?;
    let states = options.states.then(|| (String::from("states"), trace_figure::states(trace, &labels(experiment))));
    let figures = figures_of(experiment, trace).into_iter().chain(states);
    for (stem, figure) in figures {
        let told = |error| Failure::writing(folder.join(&stem).display(), &error);
        figure.write(folder, &stem).map_err(told)?;
    }
    Ok(())
}

pub(super) fn labels(experiment: &Experiment) -> Labels<'_> {
    let states = experiment.drive.as_ref().map_or(&[][..], |drive| drive.states);
    let Experiment { title, output_unit, control_unit, .. } = experiment;
    Labels { title, output_unit, control_unit, states }
}

/// Returns the standard figures of a run with the stems of their files.
pub(super) fn figures_of(experiment: &Experiment, trace: &Trace) -> Vec<(String, Figure)> {
    match &experiment.drive {
        Some(drive) => drive_figure::drive_figures(trace, drive, &labels(experiment)),
        None => trace_figure::run_figures(trace, &labels(experiment)),
    }
}

/// Returns the ending of a run as a phrase.
pub(super) fn ending(trace: &Trace, metrics: &Metrics) -> String {
    let is_off = trace.rows.last().is_some_and(|row| row.health.contains(Health::STOPPED));
    let far = format!("|y| exceeded {FAR} times its start and the settling band");
    let at = |word: &str| format!("{word} at t = {} s", significant(trace.ending.at_s().unwrap_or_default(), 4));
    match trace.ending {
        Ending::Finished if metrics.bounded => "finished, state bounded".into(),
        Ending::Finished if is_off => format!("finished, STOPPED after an alarm, {far}"),
        Ending::Finished => format!("NOT BOUNDED: {far}"),
        Ending::Diverged { .. } => at("DIVERGED"),
        Ending::BrokenOff { .. } => at("BROKEN OFF"),
        Ending::Interrupted { .. } => at("STOPPED"),
    }
}

/// Returns the verdict of a run. It never contradicts the warnings above it.
fn verdict(experiment: &Experiment, trace: &Trace, metrics: &Metrics, json: &RunJson<'_>) -> String {
    let ending = ending(trace, metrics);
    // A chain has no monitors.
    let alarm = experiment.drive.as_ref().and_then(|_| drive::first_alarm(trace));
    let alarmed =
        alarm.map_or_else(String::new, |(_, t_s, alarms)| format!("; ALARM at t = {} s: {alarms}", typed(t_s, 6)));
    let is_held_by_limits = metrics.bounded && json.warnings.iter().any(|warning| warning.starts_with("UNSTABLE"));
    let warned = match json.warnings.len() {
        _ if is_held_by_limits => "; the linearised loop is UNSTABLE".into(),
        0 => String::new(),
        1 => "; 1 warning above".into(),
        count => format!("; {count} warnings above"),
    };
    let compared = json.target.map_or_else(String::new, |comparison| format!("; {}", comparison.line()));
    format!("{ending}{alarmed}{warned}{compared}")
}

/// Returns the metrics table of a run.
pub(super) fn table(
    experiment: &Experiment,
    metrics: &Metrics,
    figures: &Figures,
    design: Option<&Design>,
    trace: &Trace,
) -> Table {
    if let (Some(drive), Some(tracking)) = (&experiment.drive, &figures.tracking) {
        let of_loop_a = design.and_then(Design::noise);
        return drive::table(experiment, drive, metrics, tracking, figures.noise.as_ref(), of_loop_a, trace);
    }
    let [from, to] = metrics.window_s.map(|t_s| typed(t_s, 6));
    // A run that ended before the window has no metric of it.
    let spoken = !metrics.sigma_star_ultimate.is_nan();
    let window = if spoken { format!("largest over [{from}, {to}] s") } else { format!("the run ended before {to} s") };
    let mut table = Table::new(["metric", "value", "meaning"]);
    let mut row = |name: &str, value: String, meaning: &str| table.row([name, &value, meaning]);
    let number = |value: f64| if value.is_nan() { "-".into() } else { significant(value, 4) };
    let unit = |unit: &str, per: &str| if unit.is_empty() { String::new() } else { format!(" ({unit}{per})") };
    let Experiment { output_unit, control_unit, .. } = experiment;
    let rate = |order: usize| if order > 1 { format!("/s^{order}") } else { "/s".into() };
    let sigma_unit = unit(output_unit, &rate(trace.order - 1));
    row(&format!("|sigma*| ultimate{sigma_unit}"), number(metrics.sigma_star_ultimate), &window);
    row(&format!("|y| ultimate{}", unit(output_unit, "")), number(metrics.y_ultimate), &window);
    for error in &metrics.estimation_error_ultimate {
        let unit = unit(output_unit, &rate(error.channel));
        row(&format!("|d_{0} - d_hat_{0}| ultimate{unit}", error.channel), number(error.error), &window);
    }
    row(&format!("|u| peak{}", unit(control_unit, "")), number(metrics.u_peak), "over the whole run");
    let period = format!("total variation per s, T = {} s", experiment.period_s);
    row(&format!("u variation{}", unit(control_unit, "/s")), number(metrics.u_total_variation_per_s), &period);
    let unsettled = if trace.ending == Ending::Finished { "never" } else { "-" };
    let settled = metrics.settling_time_s.map_or_else(|| unsettled.into(), number);
    row("settling time (s)", settled, &format!("|y| within {} from then on", experiment.settling_band));
    how_it_went(experiment, metrics, trace, &mut row);
    for mu in experiment.mu.iter().filter(|mu| mu.mu > 0.0) {
        let by_order: Vec<String> = mu.by_order.iter().map(|bound| number(*bound)).collect();
        let meaning = format!("bounds of d_{}, its derivatives: {}", mu.channel, by_order.join(", "));
        row(&format!("mu_{} of Eq. (40)", mu.channel), number(mu.mu), &meaning);
    }
    table
}

/// Adds the rows that every run has: bounded, and ticks with each status flag.
pub(super) fn how_it_went(
    experiment: &Experiment,
    metrics: &Metrics,
    trace: &Trace,
    row: &mut impl FnMut(&str, String, &str),
) {
    let ticks = format!("{} of {} ticks", trace.rows.len(), experiment.periods + 1);
    // A run that broke off gives no information on boundedness.
    let bounded = match trace.ending {
        Ending::BrokenOff { .. } => "-",
        _ if metrics.bounded => "yes",
        _ => "NO",
    };
    row("bounded", bounded.into(), &ticks);
    for (flag, _) in FLAGS {
        let count = ticks_with(trace, flag);
        if count > 0 {
            row(&format!("ticks with {flag}"), count.to_string(), "reported by the controller");
        }
    }
}
