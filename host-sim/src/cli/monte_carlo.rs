//! `host-sim monte-carlo`: a scenario run many times with some of its keys drawn anew each time; `host-sim merge`:
//! shards of it made one.
//!
//! ```text
//! plan -> trials of a chunk on all cores -> FOLDER/trials.chunks/N.csv .. -> FOLDER/trials.csv -> report
//! ```
//!
//! A trial is what `host-sim run` does, with the same figures as in its run.json. One that runs away, or has no design,
//! is a result.

use std::ffi::OsString;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use loop_sim::lanes;
use loop_sim::metrics::Metrics;
use loop_sim::trace::{Ending, Recorder, Row, Trace};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use scenario::Experiment;
use serde::Serialize;
use serde_json::Value as Json;
use study::map::Subject;
use study::margins::growth;
use study::monte_carlo::{Outcome, Plan};
use terminal::stop;

use super::map::{collect, number_in};
use super::run::{Figures, unit_of};
use super::{
    Console, DEFAULT, Failure, RunOptions, ScenarioText, bad, claim_folder, failed, folder_of, hex_sha256, status,
};
use crate::feature::quoted;
use crate::store::{self, Chunk, EXTENSION, Header, Trials};

mod report;

pub(super) use report::{Written, section};

mod uncertain;

#[derive(Args, Debug)]
pub(super) struct MonteCarloOptions {
    /// The scenario; without one the default.
    file: Option<PathBuf>,
    /// A key and how it is drawn: KEY=uniform(LOW,HIGH), normal(MEAN,DEVIATION), corners(LOW,HIGH), list(A,B,..) or
    /// sobol(LOW,HIGH); 0.5x is half of what the file has. May be given several times.
    #[arg(long = "vary", value_name = "KEY=DISTRIBUTION")]
    vary: Vec<String>,
    /// Every number of the plant that `map --corners` has is off by up to so many percent: 50, or 50:corners, 50:sobol.
    #[arg(long, value_name = "PERCENT")]
    uncertain: Option<String>,
    /// How many trials.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = trials)]
    trials: u64,
    /// Master seed: what trial i draws depends on it and i alone.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Trials of a chunk: what is lost at most when the program is ended.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    chunk: u64,
    /// Only this part, into shard-I-of-N.csv of the folder, with the feature parquet into shard-I-of-N.parquet;
    /// `host-sim merge` makes one of all.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["replay", "worst", "at_most", "draw"])]
    shard: Option<String>,
    /// Go on where a run of the same was ended.
    #[arg(long)]
    resume: bool,
    /// Run one trial alone, with its figures, as `host-sim run` does.
    #[arg(long, value_name = "TRIAL", conflicts_with_all = ["resume", "worst", "at_most", "draw"])]
    replay: Option<u64>,
    /// Threads [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a key for all trials, as in --set drive.period_s=5e-4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    report: ReportOptions,
}

#[derive(Args, Debug)]
pub(super) struct MergeOptions {
    /// The shards, all of one plan.
    #[arg(required = true, value_name = "SHARD")]
    shards: Vec<PathBuf>,
    #[command(flatten)]
    report: ReportOptions,
}

#[derive(Args, Debug)]
pub(super) struct ReportOptions {
    /// The number of run.json by which trials are the worst [default: metrics.error_ultimate or metrics.y_ultimate].
    #[arg(long, value_name = "FIGURE")]
    worst: Option<String>,
    /// A trial whose figure is above this has failed, as one has that ran away; with a failure the exit status is 1.
    /// May be given several times.
    #[arg(long = "at-most", value_name = "FIGURE=VALUE")]
    at_most: Vec<String>,
    /// A figure whose histogram is drawn, or a key over which the dots are; may be given several times [default: the
    /// first nine of each that vary].
    #[arg(long, value_name = "FIGURE")]
    draw: Vec<String>,
    /// Folder for the figures and trials.csv, with the feature parquet trials.parquet [default:
    /// out/SCENARIO-monte-carlo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the text.
    #[arg(long)]
    json: bool,
}

impl ReportOptions {
    fn folder(&self, scenario: &str) -> PathBuf {
        folder_of(self.out.as_ref(), scenario, "monte-carlo")
    }
}

/// The stem of the file of all trials.
const TRIALS: &str = "trials";
/// Room for the traces of runs that go side by side, for each thread.
const MOST_TRACES_BYTES: usize = 128 << 20;
/// The column behind those that were drawn.
const ENDED: &str = "ended_at_s";

/// How trials went, and their numbers.
type Rows = Vec<(Outcome, Vec<f64>)>;

/// What one trial came to: how it went, when it ended, and the numbers of its run.json.
struct Trial {
    outcome: Outcome,
    ended_at_s: f64,
    told: Json,
}

/// The trial of an experiment; none if it was told to stop.
fn trial(experiment: &mut Experiment, stop: &AtomicBool) -> Option<Trial> {
    let (trace, _) = experiment.run(&mut |_| going_on(stop));
    judged(experiment, &trace)
}

fn going_on(stop: &AtomicBool) -> ControlFlow<()> {
    if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Keeps all rows, until it is told to stop.
struct Stoppable<'a> {
    trace: Trace,
    stop: &'a AtomicBool,
}

impl Recorder for Stoppable<'_> {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        _ = self.trace.record(row);
        going_on(self.stop)
    }

    fn end(&mut self, ending: Ending) {
        self.trace.end(ending);
    }
}

/// What a trace comes to; none of a run that was told to stop.
fn judged(experiment: &mut Experiment, trace: &Trace) -> Option<Trial> {
    let metrics = experiment.metrics(trace);
    let outcome = match trace.ending {
        Ending::Interrupted { .. } => return None,
        Ending::Diverged { .. } => Outcome::Diverged,
        Ending::BrokenOff { .. } => Outcome::BrokenOff,
        Ending::Finished => outcome_of(experiment, &metrics),
    };
    let ended_at_s = trace.rows.last().map_or(0.0, |row| row.t_s);
    let told = serde_json::to_value(Figures::of(experiment, trace, &metrics)).unwrap_or_default();
    Some(Trial { outcome, ended_at_s, told })
}

/// Of a run that came to its end. Where u is limited, what grows at rest comes back from afar and looks bounded; where
/// it is not, what grows has not settled.
fn outcome_of(experiment: &Experiment, metrics: &Metrics) -> Outcome {
    let limits = experiment.spec.as_ref().map(|spec| spec.config.padded.options.limits);
    let is_limited = limits.is_none_or(|limits| limits.max.is_finite() || limits.min.is_finite());
    if !metrics.bounded {
        Outcome::Unbounded
    } else if (is_limited || metrics.settling_time_s.is_none()) && growth(experiment).is_some() {
        Outcome::Unstable
    } else {
        Outcome::Finished
    }
}

/// Of trials that fit each other what they come to, side by side ([`lanes`]): the bits of each alone. None for one that
/// is to be run alone.
fn side_by_side(experiments: &[Option<Experiment>]) -> Vec<Option<Trial>> {
    let mut found: Vec<Option<Trial>> = experiments.iter().map(|_| None).collect();
    let of = |experiment: &Option<Experiment>| experiment.as_ref().and_then(|it| it.beside().map(|(of, _)| of.kind()));
    let Some(first) = experiments.iter().find_map(of) else { return found };
    let fit: Vec<usize> = (0..experiments.len()).filter(|k| of(&experiments[*k]).as_ref() == Some(&first)).collect();
    for group in fit.chunks(lanes::LANES) {
        let members: Vec<_> =
            group.iter().filter_map(|k| experiments[*k].as_ref().and_then(Experiment::beside)).collect();
        let Some((campaign, _)) = members.first() else { continue };
        let trials: Vec<_> = members.iter().map(|(_, trial)| *trial).collect();
        let judged = lanes::close_loops(campaign, &trials);
        for (k, judged) in group.iter().zip(judged) {
            let (Some(judged), Some(experiment)) = (judged, experiments[*k].as_ref()) else { continue };
            let told = serde_json::to_value(Figures::of_lane(experiment, &judged)).unwrap_or_default();
            let outcome = outcome_of(experiment, &judged.metrics);
            let ended_at_s = experiment.periods as f64 * experiment.period_s;
            found[*k] = Some(Trial { outcome, ended_at_s, told });
        }
    }
    found
}

/// Those that are left, each with its own law, sensors and figures, and their plants side by side as far as they fit;
/// none if told to stop.
fn each_alone(
    experiments: &mut [Option<Experiment>],
    found: &mut [Option<Trial>],
    stop: &AtomicBool,
    done: &(dyn Fn() + Sync),
) -> Option<()> {
    let mut left: Vec<_> = experiments
        .iter_mut()
        .zip(found)
        .filter_map(|(experiment, found)| experiment.as_mut().filter(|_| found.is_none()).map(|it| (it, found)))
        .collect();
    let ticks = left.first().map_or(1, |(experiment, _)| experiment.periods + 1);
    let together = (MOST_TRACES_BYTES / (ticks * size_of::<Row>())).clamp(1, lanes::LANES);
    for group in left.chunks_mut(together) {
        let setups: Vec<_> = group.iter_mut().map(|(experiment, _)| experiment.setup()).collect();
        let mut kept: Vec<_> = setups.iter().map(|setup| Stoppable { trace: setup.trace(), stop }).collect();
        let recorders = kept.iter_mut().map(|recorder| recorder as &mut dyn Recorder);
        lanes::close_each(setups.into_iter().zip(recorders).collect());
        for ((experiment, found), Stoppable { trace, .. }) in group.iter_mut().zip(kept) {
            **found = Some(judged(experiment, &trace)?);
            done();
        }
    }
    Some(())
}

/// What `--json` prints of a shard: its first and its last trial.
#[derive(Serialize)]
struct ShardJson {
    file: String,
    trials: [u64; 2],
}

/// A plan, what it is of, and its columns.
struct Campaign<'a> {
    subject: Subject<'a>,
    plan: Plan,
    header: Header,
    /// The columns that are numbers of run.json.
    figures: Vec<String>,
    pool: ThreadPool,
}

impl<'a> Campaign<'a> {
    /// `of_file` is the scenario with nothing drawn: what it has are the columns.
    fn new(
        options: &MonteCarloOptions,
        subject: Subject<'a>,
        plan: Plan,
        experiment: &Experiment,
        of_file: &Trial,
    ) -> Result<Self, Failure> {
        let mut figures = Vec::new();
        collect(&of_file.told, "", &mut figures);
        // What says over what a figure is taken, and of which channel.
        figures.retain(|path| !path.starts_with("metrics.window_s") && !path.ends_with(".channel"));
        let names = plan.vary.iter().map(|vary| vary.name().to_owned());
        let columns = names.chain([ENDED.into()]).chain(figures.iter().cloned()).collect();
        let known = figures.iter().map(|path| (path.clone(), number_in(&of_file.told, path)));
        let drawn = plan.vary.iter().filter_map(|vary| Some((vary.name().to_owned(), subject.number_at(vary.name())?)));
        let units = figures.iter().map(String::as_str).chain([ENDED]).filter_map(|path| {
            // An error of an estimate tells its own, which depends on its channel.
            let own = path.strip_suffix(".error").map(|of| format!("/{}/unit", of.replace('.', "/")));
            let own = own.and_then(|at| of_file.told.pointer(&at)?.as_str()).map(ToOwned::to_owned);
            let unit = own.unwrap_or_else(|| unit_of(path, experiment));
            (!unit.is_empty()).then(|| (path.to_owned(), unit))
        });
        let units = units.collect();
        let of_file = known.chain(drawn).filter(|(_, value)| value.is_finite());
        let header = Header {
            program: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
            scenario: experiment.name.clone(),
            scenario_sha256: hex_sha256(subject.text),
            sets: subject.sets.to_vec(),
            vary: plan.vary.iter().map(|vary| vary.text.clone()).collect(),
            seed: options.seed,
            trials: options.trials,
            chunk: options.chunk,
            columns,
            units,
            of_file: of_file.map(|(name, value)| (name, format!("{value:?}"))).collect(),
        };
        let pool = ThreadPoolBuilder::new().num_threads(options.threads.map_or(0, usize::from)).build();
        let pool = pool.map_err(|error| failed(format!("threads: {error}")))?;
        Ok(Self { subject, plan, header, figures, pool })
    }

    /// Some trials, one after the other; none if told to stop.
    fn chunk(&self, [first, end]: [u64; 2], stop: &AtomicBool, done: &(dyn Fn() + Sync)) -> Option<Chunk> {
        let row = |i: u64, found: Option<Trial>| {
            let mut row = self.plan.drawn(i);
            let outcome = if let Some(Trial { outcome, ended_at_s, told }) = found {
                row.push(ended_at_s);
                row.extend(self.figures.iter().map(|path| number_in(&told, path)));
                outcome
            } else {
                row.resize(self.header.columns.len(), f64::NAN);
                Outcome::Refused
            };
            (outcome, row)
        };
        let group = |start: u64| -> Option<Rows> {
            let trials = start..end.min(start + lanes::LANES as u64);
            let mut experiments = Vec::new();
            for i in trials.clone() {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                experiments.push(self.of_trial(i).ok());
            }
            let mut found = side_by_side(&experiments);
            // Of the others each is told of as it comes.
            (0..experiments.len()).filter(|k| found[*k].is_some() || experiments[*k].is_none()).for_each(|_| done());
            each_alone(&mut experiments, &mut found, stop, done)?;
            Some(trials.zip(found).map(|(i, found)| row(i, found)).collect())
        };
        let starts: Vec<u64> = (first..end).step_by(lanes::LANES).collect();
        let rows: Option<Vec<Rows>> = self.pool.install(|| starts.into_par_iter().map(group).collect());
        let rows = rows.map(|groups| groups.concat());
        let rows = rows?;
        let column = |k: usize| rows.iter().map(|(_, row)| row[k]).collect();
        Some(Chunk {
            first,
            outcomes: rows.iter().map(|(outcome, _)| *outcome).collect(),
            numbers: (0..self.header.columns.len()).map(column).collect(),
        })
    }

    fn of_trial(&self, trial: u64) -> Result<Experiment, scenario::ScenarioError> {
        self.subject.with(&self.plan.settings(trial))
    }
}

/// How many, as a person writes it: 1000000 or 1e6.
fn trials(text: &str) -> Result<u64, String> {
    const MOST: u64 = 1 << 40;
    let written_out = || text.parse::<f64>().ok().filter(|it| it.fract() == 0.0 && (0.0..=MOST as f64).contains(it));
    let count = text.parse().ok().or_else(|| written_out().map(|it| it as u64));
    count
        .filter(|count| (1..=MOST).contains(count))
        .ok_or_else(|| format!("expected a whole number from 1 to {MOST}, as 1000 or 1e6"))
}

/// `3/8`: the third of eight.
fn shard_of(text: &str, chunks: u64) -> Result<[u64; 2], String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some([i.trim().parse().ok()?, n.trim().parse::<u64>().ok()?]));
    match parts {
        Some([i, n]) if (1..=n).contains(&i) && n <= chunks => Ok([i, n]),
        Some([i, n]) if (1..=n).contains(&i) => Err(format!(
            "--shard {text}: the plan has {chunks} chunks, and a shard at least one: {chunks} shards at most (or a \
             smaller --chunk)"
        )),
        _ => Err(format!("--shard {text}: expected I/N with I from 1 to N, as in 3/8")),
    }
}

impl Console<'_> {
    pub(super) fn monte_carlo(&mut self, options: &MonteCarloOptions, args: &[OsString]) -> Result<u8, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        // The default has no name on a command line.
        let named =
            options.file.as_ref().map_or_else(String::new, |file| format!(" {}", quoted(&file.to_string_lossy())));
        let (mut sets, mut vary) = (options.sets.clone(), options.vary.clone());
        let bare = text.subject(&options.sets);
        let mut experiment = bare.with(&[])?;
        if let Some(uncertain) = &options.uncertain {
            let of_plant = uncertain::of_plant(&bare, uncertain).map_err(bad)?;
            vary.splice(0..0, of_plant.vary);
            sets.extend(of_plant.sets);
        }
        let subject = Subject { sets: &sets, ..bare };
        let plan = Plan::new(&subject, &vary, options.seed).map_err(bad)?;
        if vary.is_empty() {
            return Err(bad("what is to vary? Give --uncertain 50, or --vary KEY=uniform(LOW,HIGH)"));
        }
        if let Some(index) = options.replay {
            if index >= options.trials {
                let last = options.trials - 1;
                return Err(bad(format!("--replay {index}: the trials are 0 to {last}; --trials says how many")));
            }
            return self.replay_trial(&subject, &plan, (index, &named), &options.report);
        }
        let headline = experiment.headline();
        let Some(of_file) = trial(&mut experiment, self.stop) else { return Ok(status::INTERRUPTED) };
        let campaign = Campaign::new(options, subject, plan, &experiment, &of_file)?;
        let question = report::Question::new(&campaign.header, &options.report).map_err(bad)?;
        let folder = options.report.folder(&experiment.name);
        let chunks = options.trials.div_ceil(options.chunk);
        let (stem, [first, end]) = match &options.shard {
            None => ("trials".to_owned(), [0, chunks]),
            Some(text) => {
                let [i, n] = shard_of(text, chunks).map_err(bad)?;
                // A product of two that may be 2^40 each.
                let at = |i: u64| (u128::from(chunks) * u128::from(i) / u128::from(n)) as u64;
                (format!("shard-{i}-of-{n}"), [at(i - 1), at(i)])
            }
        };
        if options.report.json {
            self.note(&headline);
        } else {
            self.say(&headline)?;
        }
        let work = Work { folder: &folder, stem: &stem, chunks: [first, end], resume: options.resume };
        let Some(trials) = self.computed(&campaign, &work)? else {
            let program = args.first().map_or("host-sim".into(), |it| it.to_string_lossy());
            let words = args.iter().skip(1).map(|it| it.to_string_lossy()).filter(|word| word != "--resume");
            let words: String = words.map(|word| quoted(&word) + " ").collect();
            self.note(&format!(
                "stopped on request; all chunks that were done are in {}; go on with: {program} {words}--resume",
                folder.display()
            ));
            return Ok(status::INTERRUPTED);
        };
        if options.shard.is_some() {
            let [first, end] = trials.range;
            let file = folder.join(format!("{stem}.{EXTENSION}")).display().to_string();
            if options.report.json {
                self.say_json(serde_json::to_string(&ShardJson { file, trials: [first, end - 1] }))?;
            } else {
                self.say(&format!("trials {first} to {} are in {file}", end - 1))?;
            }
            return Ok(status::DONE);
        }
        let (refused, is_missed) = self.tell_trials(&trials, &question, &folder, &named, options.report.json)?;
        if let Some(first) = refused
            && let Err(error) = campaign.of_trial(first)
        {
            self.note(&format!("no design, the first: trial {first}: {error}"));
        }
        Ok(if is_missed { status::FAILED } else { status::DONE })
    }

    /// The file of all trials that are asked for: what is there already stays, the rest is computed. None if told to
    /// stop.
    fn computed(&mut self, campaign: &Campaign<'_>, work: &Work<'_>) -> Result<Option<Trials>, Failure> {
        let Work { folder, stem, chunks: [first, end], resume } = *work;
        let Campaign { header, .. } = campaign;
        let whole = folder.join(format!("{stem}.{EXTENSION}"));
        let range = [header.range(first)[0], header.range(end - 1)[1]];
        if fs::symlink_metadata(&whole).is_ok() {
            if !resume {
                let message = format!(
                    "{} is there already: --resume takes what it has, --out gives this run another folder",
                    whole.display()
                );
                return Err(bad(message));
            }
            let trials = of_plan(&whole, header, range)?;
            return Ok(Some(trials));
        }
        let parts = folder.join(format!("{stem}.chunks"));
        let claim = claim_folder(&parts)?;
        let path = |chunk: u64| parts.join(format!("{chunk}.{EXTENSION}"));
        // Looked up in the folder: of a large plan few are there.
        let names = fs::read_dir(&parts).into_iter().flatten().flatten().map(|entry| entry.file_name());
        let number = |name: OsString| name.to_str()?.strip_suffix(EXTENSION)?.strip_suffix('.')?.parse::<u64>().ok();
        let mut there: Vec<u64> = names.filter_map(number).filter(|chunk| (first..end).contains(chunk)).collect();
        there.sort_unstable();
        if !there.is_empty() && !resume {
            let message = format!(
                "{} holds {} of {} chunks of a run that was ended: --resume goes on, --out gives this one another \
                 folder",
                parts.display(),
                there.len(),
                end - first
            );
            return Err(bad(message));
        }
        for chunk in &there {
            of_plan(&path(*chunk), header, header.range(*chunk)).map_err(|Failure { status, message }| Failure {
                status,
                message: message + "; without it --resume computes this chunk again",
            })?;
        }
        let done: u64 = there.iter().map(|chunk| header.range(*chunk)).map(|[first, end]| end - first).sum();
        let bar = self.bar_from(
            done,
            range[1] - range[0],
            "{bar:40} {percent:>3} %  {pos} of {len} trials  {rate} trials/s  {left} left",
        );
        let guards = (stop::keeping(), stop::looking());
        for chunk in first..end {
            let trials = header.range(chunk);
            if there.binary_search(&chunk).is_ok() {
                continue;
            }
            let Some(computed) = campaign.chunk(trials, self.stop, &|| bar.inc(1)) else {
                bar.finish_and_clear();
                return Ok(None);
            };
            store::write(&path(chunk), header, trials, [Ok(computed)]).map_err(|error| {
                let Failure { status, message } = Failure::writing(path(chunk).display(), &error);
                Failure { status, message: message + "; what was done before is kept for --resume" }
            })?;
        }
        bar.finish_and_clear();
        // One chunk in memory at a time.
        let all = (first..end).flat_map(|chunk| match Trials::open(&path(chunk)) {
            Ok(trials) => trials.chunks().collect::<Vec<_>>(),
            Err(why) => vec![Err(std::io::Error::other(why))],
        });
        store::write(&whole, header, range, all).map_err(|error| Failure::writing(whole.display(), &error))?;
        let trials = of_plan(&whole, header, range)?;
        for chunk in first..end {
            // What cannot be removed is only in the way.
            let _ = fs::remove_file(path(chunk));
        }
        let _ = fs::remove_dir(&parts);
        drop((guards, claim));
        Ok(Some(trials))
    }

    /// One trial as `host-sim run` does it.
    fn replay_trial(
        &mut self,
        subject: &Subject<'_>,
        plan: &Plan,
        (trial, file): (u64, &str),
        options: &ReportOptions,
    ) -> Result<u8, Failure> {
        let settings = plan.settings(trial);
        let experiment = subject.with(&settings)?;
        let out = options.folder(&experiment.name).join(format!("trial-{trial}"));
        let sets: Vec<String> = subject.sets.iter().cloned().chain(settings).collect();
        let words = sets.iter().map(|set| format!(" --set {}", quoted(set))).collect::<Vec<_>>().concat();
        let run = if file.is_empty() { "" } else { " run" };
        self.note(&format!("trial {trial} is: host-sim{run}{file}{words}"));
        let options = RunOptions { sets, out: Some(out), json: options.json, ..RunOptions::default() };
        self.run(experiment, &options, "", None)
    }

    pub(super) fn merge(&mut self, options: &MergeOptions) -> Result<u8, Failure> {
        let mut shards = Vec::new();
        for path in &options.shards {
            shards.push((Trials::open(path).map_err(bad)?, path));
        }
        shards.sort_by_key(|(trials, _)| trials.range);
        let Some(((of_first, _), _)) = shards.split_first() else { return Err(bad("no shards")) };
        let header = of_first.header.clone();
        if let Some((differs, path)) =
            shards.iter().find_map(|(trials, path)| Some((header.difference(&trials.header)?, path)))
        {
            return Err(bad(format!("{}: a shard of another plan: {differs}", path.display())));
        }
        let mut next = 0;
        for (trials, path) in &shards {
            let [first, end] = trials.range;
            if first > next {
                return Err(bad(format!("trials {next} to {} are in no shard", first - 1)));
            }
            if first < next {
                return Err(bad(format!(
                    "{}: its trials {first} to {} are in another too",
                    path.display(),
                    end.min(next) - 1
                )));
            }
            next = end;
        }
        if next < header.trials {
            return Err(bad(format!("trials {next} to {} are in no shard", header.trials - 1)));
        }
        let question = report::Question::new(&header, &options.report).map_err(bad)?;
        let folder = options.report.folder(&header.scenario);
        let _claim = claim_folder(&folder)?;
        let whole = folder.join(format!("{TRIALS}.{EXTENSION}"));
        // A merge that was ended after this has it already.
        if fs::symlink_metadata(&whole).is_err() {
            let all = shards.iter().flat_map(|(trials, _)| trials.chunks());
            store::write(&whole, &header, [0, header.trials], all)
                .map_err(|error| Failure::writing(whole.display(), &error))?;
        }
        let trials = of_plan(&whole, &header, [0, header.trials])?;
        // No shard knows what its file was called.
        let (_, is_missed) = self.tell_trials(&trials, &question, &folder, " FILE", options.report.json)?;
        Ok(if is_missed { status::FAILED } else { status::DONE })
    }
}

/// What of a plan is computed, and where.
struct Work<'a> {
    folder: &'a Path,
    stem: &'a str,
    /// The first chunk, and the one after the last.
    chunks: [u64; 2],
    resume: bool,
}

/// A file of this plan and no other.
fn of_plan(path: &Path, header: &Header, range: [u64; 2]) -> Result<Trials, Failure> {
    let trials = Trials::open(path).map_err(bad)?;
    if let Some(differs) = header.difference(&trials.header) {
        return Err(bad(format!("{}: trials of another plan: {differs}", path.display())));
    }
    if trials.range != range {
        return Err(bad(format!("{}: it has trials {:?}, expected {range:?}", path.display(), trials.range)));
    }
    Ok(trials)
}
