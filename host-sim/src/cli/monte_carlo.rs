//! `host-sim monte-carlo`: simulates many random variations of a scenario. `host-sim merge`: combines its shards.
//!
//! ```text
//! plan -> trials of a chunk on all cores -> FOLDER/trials.chunks/N.csv .. -> FOLDER/trials.csv -> report
//! ```
//!
//! A trial is one run of `host-sim run` with the metrics of its run.json. A trial that diverges or has no design is
//! also a result. Trials are saved in chunks, so that an interrupted run can continue.

use std::ffi::OsString;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::{ThreadPool, ThreadPoolBuilder};
use scenario::Experiment;
use serde::Serialize;
use study::Watch;
use study::map::Subject;
use study::monte_carlo::{Columns, ENDED, Plan, Trial, trial, trials, uncertain};
use terminal::stop;

use super::{
    Console, DEFAULT, Failure, RunOptions, ScenarioText, bad, claim_folder, failed, folder_of, hex_sha256, status,
};
use crate::feature::quoted;
use crate::store::{self, Chunk, EXTENSION, Header, Trials};

mod report;

pub(super) use report::{Written, section};

#[derive(Args, Debug)]
pub(super) struct MonteCarloOptions {
    /// Scenario file [default: built-in joint of the paper].
    file: Option<PathBuf>,
    /// Key and distribution; repeatable: KEY=uniform(LOW,HIGH), normal(MEAN,DEVIATION), corners(LOW,HIGH), list(A,B,..)
    /// or sobol(LOW,HIGH). A number with x is a multiple of the file's value: 0.5x is half of it.
    #[arg(long = "vary", value_name = "KEY=DISTRIBUTION")]
    vary: Vec<String>,
    /// Tolerance of all plant parameters of map --corners, percent. Example: 50, 50:corners or 50:sobol.
    #[arg(long, value_name = "PERCENT")]
    uncertain: Option<String>,
    /// Number of trials.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = count)]
    trials: u64,
    /// Master seed. The values of trial i depend only on the seed and i.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Trials per chunk. An interrupted run loses at most one chunk.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    chunk: u64,
    /// Compute shard I of N only, and write it to shard-I-of-N.csv, with the feature parquet to shard-I-of-N.parquet.
    /// host-sim merge combines the shards.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["replay", "worst", "at_most", "draw"])]
    shard: Option<String>,
    /// Continue an interrupted run with equal settings.
    #[arg(long)]
    resume: bool,
    /// Rerun one trial with figures and trace, as host-sim run.
    #[arg(long, value_name = "TRIAL", conflicts_with_all = ["resume", "worst", "at_most", "draw"])]
    replay: Option<u64>,
    /// Number of threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a key of the scenario for all trials; repeatable. Example: --set drive.period_s=5e-4 for a motor or
    /// joint, --set controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    report: ReportOptions,
}

#[derive(Args, Debug)]
pub(super) struct MergeOptions {
    /// Files of all shards of one run.
    #[arg(required = true, value_name = "SHARD")]
    shards: Vec<PathBuf>,
    #[command(flatten)]
    report: ReportOptions,
}

#[derive(Args, Debug)]
pub(super) struct ReportOptions {
    /// Metric of run.json that ranks the worst trials [default: metrics.error_ultimate or metrics.y_ultimate].
    #[arg(long, value_name = "METRIC")]
    worst: Option<String>,
    /// Limit of a metric; repeatable. A trial above it counts as failed, as a diverged trial does. A failed trial sets
    /// exit status 1.
    #[arg(long = "at-most", value_name = "METRIC=VALUE")]
    at_most: Vec<String>,
    /// Metric to plot as a histogram, or key to use as x axis of a scatter plot; repeatable [default: the first nine of
    /// each that vary].
    #[arg(long, value_name = "METRIC")]
    draw: Vec<String>,
    /// Output folder of the figures and trials.csv, with the feature parquet trials.parquet [default:
    /// out/SCENARIO-monte-carlo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the text.
    #[arg(long)]
    json: bool,
}

impl ReportOptions {
    fn folder(&self, scenario: &str) -> PathBuf {
        folder_of(self.out.as_ref(), scenario, "monte-carlo")
    }
}

/// File stem of all trials.
const TRIALS: &str = "trials";
/// Output of `--json` for a shard: its file, its first and its last trial.
#[derive(Serialize)]
struct ShardJson {
    file: String,
    trials: [u64; 2],
}

/// Plan of a Monte Carlo run with its columns, the header of its files, and its threads.
struct Campaign<'a> {
    plan: Plan<'a>,
    columns: Columns,
    header: Header,
    pool: ThreadPool,
}

impl<'a> Campaign<'a> {
    /// Builds the campaign. `of_file` is the trial with the values of the file; its metrics define the columns.
    fn new(
        options: &MonteCarloOptions,
        plan: Plan<'a>,
        experiment: &Experiment,
        of_file: &Trial,
    ) -> Result<Self, Failure> {
        let columns = Columns::new(&plan, experiment, of_file);
        let header = Header {
            program: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
            scenario: experiment.name.clone(),
            scenario_sha256: hex_sha256(plan.subject.text),
            sets: plan.subject.sets.to_vec(),
            vary: plan.vary.iter().map(|vary| vary.text.clone()).collect(),
            seed: options.seed,
            trials: options.trials,
            chunk: options.chunk,
            columns: columns.names.clone(),
            units: columns.units.clone(),
            of_file: columns.of_file.iter().map(|(name, value)| (name.clone(), format!("{value:?}"))).collect(),
        };
        let pool = ThreadPoolBuilder::new().num_threads(options.threads.map_or(0, usize::from)).build();
        let pool = pool.map_err(|error| failed(format!("threads: {error}")))?;
        Ok(Self { plan, columns, header, pool })
    }

    /// Computes the trials `first..end`; `None` if interrupted.
    fn chunk(&self, [first, end]: [u64; 2], watch: Watch<'_>) -> Option<Chunk> {
        let rows = self.pool.install(|| trials(&self.plan, &self.columns, first..end, watch))?;
        let column = |k: usize| rows.iter().map(|(_, row)| row[k]).collect();
        Some(Chunk {
            first,
            outcomes: rows.iter().map(|(outcome, _)| *outcome).collect(),
            numbers: (0..self.header.columns.len()).map(column).collect(),
        })
    }
}

/// Parses a count, as 1000000 or 1e6.
fn count(text: &str) -> Result<u64, String> {
    const MOST: u64 = 1 << 40;
    let written_out = || text.parse::<f64>().ok().filter(|it| it.fract() == 0.0 && (0.0..=MOST as f64).contains(it));
    let count = text.parse().ok().or_else(|| written_out().map(|it| it as u64));
    count
        .filter(|count| (1..=MOST).contains(count))
        .ok_or_else(|| format!("expected a whole number from 1 to {MOST}, as 1000 or 1e6"))
}

/// Parses a shard, as `3/8`: the third of eight.
fn shard_of(text: &str, chunks: u64) -> Result<[u64; 2], String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some([i.trim().parse().ok()?, n.trim().parse::<u64>().ok()?]));
    match parts {
        Some([i, n]) if (1..=n).contains(&i) && n <= chunks => Ok([i, n]),
        Some([i, n]) if (1..=n).contains(&i) => Err(format!(
            "--shard {text}: at most {chunks} shards, one per chunk. Give a smaller N, or a smaller --chunk"
        )),
        _ => Err(format!("--shard {text}: expected I/N with I from 1 to N, as in 3/8")),
    }
}

/// Returns the stem of the output file and its chunks: the first, and the one after the last.
fn part_of(options: &MonteCarloOptions) -> Result<(String, [u64; 2]), Failure> {
    let chunks = options.trials.div_ceil(options.chunk);
    let Some(text) = &options.shard else { return Ok((TRIALS.to_owned(), [0, chunks])) };
    let [i, n] = shard_of(text, chunks).map_err(bad)?;
    // The product of two factors up to 2^40 needs 128 bits.
    let at = |i: u64| (u128::from(chunks) * u128::from(i) / u128::from(n)) as u64;
    Ok((format!("shard-{i}-of-{n}"), [at(i - 1), at(i)]))
}

/// Folder of the chunks of an unfinished run.
struct Parts(PathBuf);

impl Parts {
    fn path(&self, chunk: u64) -> PathBuf {
        self.0.join(format!("{chunk}.{EXTENSION}"))
    }

    /// Returns the chunks of an interrupted run, each checked to be of this plan.
    fn there(&self, header: &Header, work: &Work<'_>) -> Result<Vec<u64>, Failure> {
        let [first, end] = work.chunks;
        let there = chunks_in(&self.0, first..end);
        if !there.is_empty() && !work.resume {
            let message = format!(
                "{} contains {} of {} chunks of an interrupted run. Give --resume to continue it, or another folder \
                 with --out",
                self.0.display(),
                there.len(),
                end - first
            );
            return Err(bad(message));
        }
        for chunk in &there {
            of_plan(&self.path(*chunk), header, header.range(*chunk)).map_err(|Failure { status, message }| {
                Failure { status, message: message + "; delete the file, and --resume computes the chunk again" }
            })?;
        }
        Ok(there)
    }

    /// Removes the chunks. A failure is ignored: leftover files do no harm.
    fn remove(&self, chunks: Range<u64>) {
        chunks.for_each(|chunk| _ = fs::remove_file(self.path(chunk)));
        _ = fs::remove_dir(&self.0);
    }
}

impl Console<'_> {
    pub(super) fn monte_carlo(&mut self, options: &MonteCarloOptions, args: &[OsString]) -> Result<u8, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        // The built-in scenario has no file name on a command line.
        let named =
            options.file.as_ref().map_or_else(String::new, |file| format!(" {}", quoted(&file.to_string_lossy())));
        let (mut sets, mut vary) = (options.sets.clone(), options.vary.clone());
        let bare = text.subject(&options.sets);
        let mut experiment = bare.with(&[])?;
        if let Some(uncertain) = &options.uncertain {
            let of_plant = uncertain::of_plant(&bare, uncertain)?;
            vary.splice(0..0, of_plant.vary);
            sets.extend(of_plant.sets);
        }
        let subject = Subject { sets: &sets, ..bare };
        let plan = Plan::new(subject, &vary, options.seed)?;
        if vary.is_empty() {
            return Err(bad("no parameter to vary: give --uncertain PERCENT or --vary KEY=DISTRIBUTION"));
        }
        if let Some(index) = options.replay {
            if index >= options.trials {
                let last = options.trials - 1;
                return Err(bad(format!("--replay {index}: expected 0 to {last} (--trials {})", options.trials)));
            }
            return self.replay_trial(&plan, (index, &named), &options.report);
        }
        let headline = experiment.headline();
        let Some(of_file) = trial(&mut experiment, Watch::new(self.stop, &|| ())) else {
            return Ok(status::INTERRUPTED);
        };
        let campaign = Campaign::new(options, plan, &experiment, &of_file)?;
        let question = report::Question::new(&campaign.header, &options.report).map_err(bad)?;
        let folder = options.report.folder(&experiment.name);
        let (stem, chunks) = part_of(options)?;
        if options.report.json {
            self.note(&headline);
        } else {
            self.say(&headline)?;
        }
        let work = Work { folder: &folder, stem: &stem, chunks, resume: options.resume };
        let Some(trials) = self.computed(&campaign, &work)? else {
            let program = args.first().map_or("host-sim".into(), |it| it.to_string_lossy());
            let words = args.iter().skip(1).map(|it| it.to_string_lossy()).filter(|word| word != "--resume");
            let words: String = words.map(|word| quoted(&word) + " ").collect();
            self.note(&format!(
                "stopped on request; all finished chunks are in {}; continue with: {program} {words}--resume",
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
            && let Err(error) = campaign.plan.experiment(first)
        {
            self.note(&format!("first trial without a design: trial {first}: {error}"));
        }
        Ok(if is_missed { status::FAILED } else { status::DONE })
    }

    /// Returns the file of all requested trials. Existing chunks are kept, the others are computed. `None` if
    /// interrupted.
    fn computed(&mut self, campaign: &Campaign<'_>, work: &Work<'_>) -> Result<Option<Trials>, Failure> {
        let Campaign { header, .. } = campaign;
        let [first, end] = work.chunks;
        let whole = work.folder.join(format!("{}.{EXTENSION}", work.stem));
        let range = [header.range(first)[0], header.range(end - 1)[1]];
        if fs::symlink_metadata(&whole).is_ok() {
            if !work.resume {
                let message = format!(
                    "{} already exists. Give --resume to use its trials, or another folder with --out",
                    whole.display()
                );
                return Err(bad(message));
            }
            return of_plan(&whole, header, range).map(Some);
        }
        let parts = Parts(work.folder.join(format!("{}.chunks", work.stem)));
        let claim = claim_folder(&parts.0)?;
        let there = parts.there(header, work)?;
        let guards = (stop::keeping(), stop::looking());
        if !self.compute(campaign, work.chunks, &parts, &there)? {
            return Ok(None);
        }
        // Read lazily: one chunk is in memory at a time.
        let all = (first..end).flat_map(|chunk| match Trials::open(&parts.path(chunk)) {
            Ok(trials) => trials.chunks().collect::<Vec<_>>(),
            Err(why) => vec![Err(std::io::Error::other(why))],
        });
        store::write(&whole, header, range, all).map_err(|error| Failure::writing(whole.display(), &error))?;
        let trials = of_plan(&whole, header, range)?;
        parts.remove(first..end);
        drop((guards, claim));
        Ok(Some(trials))
    }

    /// Computes the missing chunks, each into its own file. Returns `false` if interrupted.
    fn compute(
        &self,
        campaign: &Campaign<'_>,
        [first, end]: [u64; 2],
        parts: &Parts,
        there: &[u64],
    ) -> Result<bool, Failure> {
        let header = &campaign.header;
        let done: u64 = there.iter().map(|chunk| header.range(*chunk)).map(|[first, end]| end - first).sum();
        let bar = self.bar_from(
            done,
            header.range(end - 1)[1] - header.range(first)[0],
            "{bar:40} {percent:>3} %  {pos} of {len} trials  {rate} trials/s  {left} left",
        );
        for chunk in (first..end).filter(|chunk| there.binary_search(chunk).is_err()) {
            let trials = header.range(chunk);
            let Some(computed) = campaign.chunk(trials, Watch::new(self.stop, &|| bar.inc(1))) else {
                bar.finish_and_clear();
                return Ok(false);
            };
            let path = parts.path(chunk);
            store::write(&path, header, trials, [Ok(computed)]).map_err(|error| {
                let Failure { status, message } = Failure::writing(path.display(), &error);
                Failure { status, message: message + "; finished chunks are kept for --resume" }
            })?;
        }
        bar.finish_and_clear();
        Ok(true)
    }

    /// Runs one trial as `host-sim run` does.
    fn replay_trial(
        &mut self,
        plan: &Plan<'_>,
        (trial, file): (u64, &str),
        options: &ReportOptions,
    ) -> Result<u8, Failure> {
        let settings = plan.settings(trial);
        let experiment = plan.subject.with(&settings)?;
        let out = options.folder(&experiment.name).join(format!("trial-{trial}"));
        let sets: Vec<String> = plan.subject.sets.iter().cloned().chain(settings).collect();
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
        let Some(((of_first, _), _)) = shards.split_first() else { return Err(bad("no shards given")) };
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
                    "{}: its trials {first} to {} are also in another shard",
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
        // An interrupted merge may have written the file already.
        if fs::symlink_metadata(&whole).is_err() {
            let all = shards.iter().flat_map(|(trials, _)| trials.chunks());
            store::write(&whole, &header, [0, header.trials], all)
                .map_err(|error| Failure::writing(whole.display(), &error))?;
        }
        let trials = of_plan(&whole, &header, [0, header.trials])?;
        // A shard does not contain the path of its scenario.
        let (_, is_missed) = self.tell_trials(&trials, &question, &folder, " FILE", options.report.json)?;
        Ok(if is_missed { status::FAILED } else { status::DONE })
    }
}

/// Returns the existing chunks of a folder in order. It lists the folder: a large plan has few files there.
fn chunks_in(folder: &Path, chunks: Range<u64>) -> Vec<u64> {
    let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let number = |name: OsString| name.to_str()?.strip_suffix(EXTENSION)?.strip_suffix('.')?.parse::<u64>().ok();
    let mut there: Vec<u64> = names.filter_map(number).filter(|chunk| chunks.contains(chunk)).collect();
    there.sort_unstable();
    there
}

/// Part of a plan to compute, and its output.
struct Work<'a> {
    folder: &'a Path,
    stem: &'a str,
    /// First chunk, and the one after the last.
    chunks: [u64; 2],
    resume: bool,
}

/// Opens a file of trials and checks that it is of this plan and range.
fn of_plan(path: &Path, header: &Header, range: [u64; 2]) -> Result<Trials, Failure> {
    let trials = Trials::open(path).map_err(bad)?;
    if let Some(differs) = header.difference(&trials.header) {
        return Err(bad(format!("{}: trials of another plan: {differs}", path.display())));
    }
    if trials.range != range {
        return Err(bad(format!("{}: contains trials {:?}, expected {range:?}", path.display(), trials.range)));
    }
    Ok(trials)
}
