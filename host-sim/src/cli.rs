//! The command line.
//!
//! ```text
//! host-sim                          the default scenario: Example 2 of the paper, for its figures
//! host-sim run FILE.toml            any scenario
//! host-sim pil [FILE.toml]          the same with the controller on the emulated chip, compared bit for bit
//! host-sim hil --port DEV [..]      the same with a board at a serial port
//! host-sim live [FILE.toml] [..]    a drive that runs by itself, emulated or on a board: seen, moved, tuned
//! host-sim replay BLACKBOX [..]     what its black box held, run again, or with another design
//! host-sim emulate --image FILE     any image in the emulator, with its log
//! host-sim design [FILE.toml]       poles, margins, noise of its loop, what limits it, what would be better
//! host-sim map [FILE.toml] ..        where it is stable and how good, over two keys or all corners
//! host-sim tune [FILE.toml] ..       bandwidths from what a drive shall do
//! host-sim report [FILE ..]         all of it as one page, of one scenario or of several side by side
//! host-sim bounds [FILE.toml]       how large sigma*, the errors and y can be, why, and which gain lowers it
//! host-sim monte-carlo [FILE.toml]  many runs with keys drawn anew: percentiles, failure rate, the worst
//! host-sim merge SHARD..            shards of such runs made one
//! host-sim identify DATA.csv [..]   what a joint or motor really is, from a record; the scenario with it
//! host-sim commission [FILE.toml]   a drive that records, identifies, is re-tuned and verified: simulated, or itself
//! host-sim compare [FILE.toml]      our drive beside its rivals, all tuned alike
//! host-sim figures                  the figures of the paper and its claims
//! host-sim budget                   an upper bound in cycles of a function of a firmware; ceilings of many
//! host-sim export [FILE.toml] ..    the designed controller as one source file, C or Rust
//! host-sim schema [--plant P]       JSON schema of a scenario file
//! host-sim new NAME [--plant P]     a commented scenario file to start from: paper, motor, joint, chain, own
//! host-sim completions SHELL        what a shell must know to complete these
//! ```
//!
//! Nothing waits for a target longer than 5 s, nor for the emulator to come up longer than 10 s.
//!
//! Results go to stdout, everything else to stderr. Exit status: 0 done (a run that diverged is a result), 1 the run or
//! the writing failed, a claim that held no longer does, a target differs or cannot be reached, 2 bad input (nothing is
//! written), 130 told to stop by Ctrl-C or SIGTERM (what was recorded is written).

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clap::{Args, CommandFactory, Parser, Subcommand};
use controller_core::Health;
use cycle_bound::log::Log;
use cycle_bound::table::Table;
use cycle_bound::{Reply, stop};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use loop_sim::closed_loop::LoopError;
use loop_sim::lanes::Judged;
use loop_sim::metrics::{FAR, Metrics, Noise, Tracking};
use loop_sim::port::{ControllerPort, PortError};
use loop_sim::trace::{Ending, Trace};
use scenario::{Drive, Experiment, Mu, ScenarioError, Source};
use serde::Serialize;
use whole_file::{Claim, Existing, Kind};

use crate::figures::{CATALOGUE, Case, ClaimRow, PaperFigure};
use crate::margins;
use crate::report::number::significant;
use crate::report::plot::Figure;
use crate::report::trace_figure::{self, Labels};
use crate::report::{csv, drive_figure, write_whole};

mod bounds;
mod compare;
mod design;
mod drive;
mod export;
mod identify;
mod live;
mod map;
mod monte_carlo;
mod report;
mod target;
mod tune;

use bounds::BoundsOptions;
use compare::CompareOptions;
use design::{Design, DesignOptions};
use drive::TorqueError;
use export::ExportOptions;
use identify::{CommissionOptions, IdentifyOptions};
use live::{LiveOptions, ReplayOptions};
use map::MapOptions;
use monte_carlo::{MergeOptions, MonteCarloOptions};
use report::ReportOptions;
use target::{EmulateOptions, HilOptions, Link, PilOptions};
use tune::TuneOptions;

/// The exit statuses of the program.
pub mod status {
    /// Everything was done.
    pub const DONE: u8 = 0;
    /// The run or the writing failed.
    pub const FAILED: u8 = 1;
    /// The input was bad, and nothing was done.
    pub const BAD_INPUT: u8 = 2;
    /// Stopped by Ctrl-C.
    pub const INTERRUPTED: u8 = cycle_bound::stop::STATUS;
}

/// Sliding mode control with an extended disturbance observer, in closed loop with a simulated plant.
///
/// Without a command the default scenario runs: the paper's flexible joint as its figures have it, f32 controller at
/// 1 kHz. For a joint or motor of your own: host-sim new NAME --plant joint (or motor).
#[derive(Parser, Debug)]
#[command(name = "host-sim", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    options: RunOptions,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Run a scenario file.
    Run {
        /// The scenario (host-sim new NAME writes one).
        file: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Run a scenario with the controller on the emulated chip, and compare every output of every tick bit for bit.
    ///
    /// Waits at most 10 s for the emulator to come up, and 5 s for any answer of the target.
    Pil {
        /// The scenario; without one the default.
        file: Option<PathBuf>,
        #[command(flatten)]
        options: RunOptions,
        #[command(flatten)]
        target: PilOptions,
    },
    /// Run a scenario with the controller on a board, and compare every output of every tick bit for bit.
    ///
    /// The board runs the image `pil`. Waits at most 5 s for any answer of the target.
    Hil {
        /// The scenario; without one the default.
        file: Option<PathBuf>,
        #[command(flatten)]
        options: RunOptions,
        #[command(flatten)]
        target: HilOptions,
    },
    /// See, move and tune a drive that runs by itself: the image `drive` or `motor`, emulated or on a board.
    ///
    /// Commands come from stdin, one a line; `help` lists them. A setting is designed here first, sent, designed on the
    /// chip while the drive goes on, and taken over between two ticks; what is refused leaves it as it was.
    Live(LiveOptions),
    /// Run again what the black box of a drive held: bit for bit, or with another design.
    ///
    /// Exit status: 0 the same bits, 1 others, 2 the file is none or damaged.
    Replay(ReplayOptions),
    /// Run an image in the emulator, one instruction a nanosecond, and print its log.
    Emulate(EmulateOptions),
    /// Say what a design comes to in its loop: poles, margins, noise, what limits it, what would be better.
    ///
    /// Nothing is simulated: the loop is linearised where it stands still. A loop that is unstable is a result.
    Design(DesignOptions),
    /// Say how large sigma*, the errors of the estimates, y and u can be: by what, how tight, and which gain lowers it.
    ///
    /// Bounds of the sampled loop, held against a run of it: table and figure. Exit status 1 if the loop is not stable,
    /// which has no bound.
    Bounds(BoundsOptions),
    /// Sweep two keys, or all corners of the plant: where is the loop stable, how good, what may be promised? Table and
    /// figure.
    ///
    /// Of a drive: host-sim map mine.toml --x error.torque_percent=-90..300 --y drive.period_s=1e-4..5e-3:log.
    /// Stability is that of the exact matrices of the sampled loop at rest; --simulate asks the plant itself as well.
    Map(MapOptions),
    /// Run a scenario many times, its keys drawn anew each time: percentiles, failure rate, the worst. Table and
    /// figures.
    ///
    /// Of a motor: host-sim monte-carlo mine.toml --uncertain 50 --trials 10000. Trials are kept chunk by chunk; a run
    /// that was ended goes on with --resume. The same seed gives the same bytes on any threads, shards and machines.
    MonteCarlo(MonteCarloOptions),
    /// Make one of all shards of a Monte Carlo run, and report it.
    Merge(MergeOptions),
    /// Find the bandwidths of a drive from what it shall do: table, picture, and the scenario with them.
    ///
    /// Of a joint: host-sim tune mine.toml --noise 0.015 --load 5e-3 --uncertain 50. Each figure is that of the worst
    /// corner. Exit status 1 if something that is asked for was not reached.
    Tune(TuneOptions),
    /// From a record of counts and current to the data sheet of the plant: stiffness, damping, torque constant,
    /// friction.
    ///
    /// Prints each parameter with an interval and what changed, writes the scenario with it, and a figure of what is
    /// left. A record that says too little is refused with the reason (exit status 2). docs/commissioning.md is the
    /// way.
    Identify(IdentifyOptions),
    /// Let a drive commission itself: record, identify, swap the gains at rest, verify, keep or go back.
    ///
    /// In simulation, or with --port on a board, with --image on the emulated chip, whose image is `drive` or `motor`.
    /// Of a joint whose stiffness is 40 % off: host-sim commission mine.toml --set error.stiffness_percent=-40. Exit
    /// status 1 if the record was refused or the old gains are back.
    Commission(CommissionOptions),
    /// Write all that there is to say of a scenario as one page: design, run, map, cost; several stand side by side.
    ///
    /// The page needs no network, zooms, prints, and holds its numbers: given to report again, it stands beside a new
    /// run.
    Report(ReportOptions),
    /// Tune our drive and its rivals with the same effort, and show what each does: table and figure.
    ///
    /// Rivals: LQG with disturbance states, LQI, ADRC with model, super-twisting, P-PI. docs/comparison.md says how.
    Compare(CompareOptions),
    /// Reproduce the figures of the paper and hold its claims against what comes out.
    Figures {
        /// Only this figure (fig01 .. fig10); may be given several times.
        #[arg(long, value_name = "FIGURE")]
        only: Vec<String>,
        /// Folder for the figures.
        #[arg(long, value_name = "DIR", default_value = "out/figures")]
        out: PathBuf,
        /// Print a JSON array of claims instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Compute an upper bound in cycles of a function from its machine code, and what else it costs.
    ///
    /// Exit status: 0 the figures stand, 1 a check failed, 2 something could not be followed (it is named).
    Budget(cycle_bound::Options),
    /// Write the designed controller of a scenario as one source file, to stdout or with -o into a file.
    ///
    /// It gives the same bits as `host-sim run`. Its head says which scenario, design and version it is.
    Export(ExportOptions),
    /// Print the JSON schema of scenario files.
    Schema {
        /// Whose: a motor and a joint have their own, the others one together.
        #[arg(long, value_name = "PLANT", default_value = "paper", value_parser = starts())]
        plant: String,
    },
    /// Write a commented scenario file NAME.toml; an existing file is never overwritten.
    New {
        /// Name of the scenario and, with .toml, of the file.
        name: String,
        /// What is controlled: a flexible joint, a motor, a chain of integrators or any equations of your own; or the
        /// paper's joint as its figures have it.
        #[arg(long, value_name = "PLANT", default_value = "joint", value_parser = starts())]
        plant: String,
    },
    /// Print a script that completes commands and options: bash, zsh, fish, elvish or powershell.
    ///
    /// For bash: host-sim completions bash > ~/.local/share/bash-completion/completions/host-sim
    Completions {
        /// The shell to write completions for.
        shell: clap_complete::Shell,
    },
}

fn starts() -> clap::builder::PossibleValuesParser {
    scenario::STARTS.map(|(plant, _)| plant).into()
}

#[derive(Args, Debug, Default)]
struct RunOptions {
    /// Override a key, as in --set controller.k_l=100 or --set controller.observer[1].printed=[100,20].
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder for trace.csv and the figures [default: out/SCENARIO; with a target out/SCENARIO-pil, out/SCENARIO-hil].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the table; the folder has it as run.json either way.
    #[arg(long)]
    json: bool,
    /// Write nothing: no folder, no figures.
    #[arg(long, conflicts_with = "out")]
    no_files: bool,
    /// Every N-th tick in trace.csv, the first and the last always; the figures show all.
    #[arg(long, value_name = "N")]
    every: Option<NonZeroUsize>,
    /// A figure of every state too.
    #[arg(long)]
    states: bool,
}

/// Where a command speaks, and whether it has been told to stop.
pub struct Console<'a> {
    /// Where results go.
    pub out: &'a mut dyn Write,
    /// Where everything goes that is no result.
    pub err: &'a mut dyn Write,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
    /// Is there someone to watch a progress bar?
    pub terminal: bool,
}

/// Set by the handler of Ctrl-C, the one thing that outlives a call.
static STOP: AtomicBool = AtomicBool::new(false);

/// The program, on the real console.
pub fn main() -> u8 {
    stop::on_request(&STOP);
    let terminal = io::stderr().is_terminal();
    let console = Console { out: &mut io::stdout(), err: &mut io::stderr(), stop: &STOP, terminal };
    run(std::env::args_os(), console)
}

/// The program on any console; `args` begin with its name. Returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>, mut console: Console<'_>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let program = args.first().map_or("host-sim".into(), |name| name.to_string_lossy().into_owned());
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(usage) => {
            let text = usage.render();
            let to = if usage.use_stderr() { console.err } else { console.out };
            // Nobody is left to be told that this could not be printed.
            let _ = write!(to, "{text}");
            return if usage.use_stderr() { status::BAD_INPUT } else { status::DONE };
        }
    };
    let done = match &cli.command {
        None => default_scenario(&cli.options.sets).and_then(|it| console.run(it, &cli.options, "", None)),
        Some(Command::Run { file, options }) => {
            scenario_of(Some(file), options).and_then(|it| console.run(it, options, "", None))
        }
        Some(Command::Pil { file, options, target }) => scenario_of(file.as_deref(), options).and_then(|it| {
            let link = console.emulated(&it, target)?;
            console.run(it, options, "-pil", Some(link))
        }),
        Some(Command::Hil { file, options, target }) => scenario_of(file.as_deref(), options).and_then(|it| {
            let link = console.wired(&it, target)?;
            console.run(it, options, "-hil", Some(link))
        }),
        Some(Command::Live(options)) => console.live(options),
        Some(Command::Replay(options)) => console.replay(options),
        Some(Command::Emulate(options)) => console.emulate(options),
        Some(Command::Design(options)) => console.design(options),
        Some(Command::Bounds(options)) => console.bounds(options),
        Some(Command::Map(options)) => console.map(options),
        Some(Command::MonteCarlo(options)) => console.monte_carlo(options, &args),
        Some(Command::Merge(options)) => console.merge(options),
        Some(Command::Tune(options)) => console.tune(options),
        Some(Command::Report(options)) => console.report(options),
        Some(Command::Identify(options)) => console.identify(options),
        Some(Command::Commission(options)) => console.commission(options),
        Some(Command::Compare(options)) => console.compare(options),
        Some(Command::Figures { only, out, json }) => console.figures(only, out, *json),
        Some(Command::Budget(options)) => console.budget(options),
        Some(Command::Export(options)) => console.export(options),
        Some(Command::Schema { plant }) => console.schema(plant),
        Some(Command::New { name, plant }) => console.new_scenario(name, plant, Path::new(""), &program),
        Some(Command::Completions { shell }) => console.completions(*shell),
    };
    match done {
        Ok(status) => status,
        Err(Failure { status, message }) => {
            for line in message.lines() {
                console.note(&format!("error: {line}"));
            }
            status
        }
    }
}

fn default_scenario(sets: &[String]) -> Result<Experiment, Failure> {
    let source = Source { file: "built-in default.toml", text: scenario::DEFAULT, sets };
    Ok(scenario::parse(&source, "default")?)
}

fn scenario_of(file: Option<&Path>, options: &RunOptions) -> Result<Experiment, Failure> {
    match file {
        Some(file) => Ok(scenario::load(file, &options.sets)?),
        None => default_scenario(&options.sets),
    }
}

/// What messages call a scenario, and its text; without a file one that is built in.
fn text_of(file: Option<&Path>, (built_in, text): (&str, &str)) -> Result<(String, String), Failure> {
    let Some(file) = file else { return Ok((format!("built-in {built_in}"), text.to_owned())) };
    let name = file.display().to_string();
    match whole_file::read_text(file, Kind::SETTINGS) {
        Ok(text) => Ok((name, text)),
        Err(why) => Err(Failure { status: status::BAD_INPUT, message: format!("{name}: {why}") }),
    }
}

/// Why a command ended early, a line for each thing that is wrong, and the exit status.
struct Failure {
    status: u8,
    message: String,
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        Self { status: status::BAD_INPUT, message: error.to_string() }
    }
}

impl Failure {
    fn writing(what: impl std::fmt::Display, error: &io::Error) -> Self {
        use io::ErrorKind::{AlreadyExists, InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied};
        let is_of_the_path = matches!(
            error.kind(),
            AlreadyExists | InvalidInput | IsADirectory | NotADirectory | NotFound | PermissionDenied
        );
        let status = if is_of_the_path { status::BAD_INPUT } else { status::FAILED };
        Self { status, message: format!("{what} cannot be written: {error}") }
    }
}

/// What a run came to, in numbers.
#[derive(Serialize)]
struct Figures {
    metrics: serde_json::Value,
    /// How far the estimates of the torques on the shafts of a drive are off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    torque_errors: Vec<TorqueError>,
    /// How the reference was followed, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    tracking: Option<Tracking>,
    /// Noise of u by the steps of the encoders of a drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<Noise>,
    /// Ticks in which the controller told of this trouble.
    ticks_with: BTreeMap<&'static str, usize>,
}

impl Figures {
    fn of(experiment: &mut Experiment, trace: &Trace, metrics: &Metrics) -> Self {
        let of_shafts = experiment.drive.as_ref().map(|drive| drive::torque_errors(drive, metrics, trace));
        Self {
            metrics: told(metrics, experiment),
            torque_errors: of_shafts.unwrap_or_default(),
            tracking: experiment.tracking(trace),
            noise: experiment.noise(trace),
            ticks_with: TROUBLES.map(|(flag, name)| (name, ticks_with(trace, flag))).into(),
        }
    }
}

impl Figures {
    /// Of a run that was made beside others.
    fn of_lane(experiment: &Experiment, judged: &Judged) -> Self {
        Self {
            metrics: told(&judged.metrics, experiment),
            torque_errors: Vec::new(),
            tracking: None,
            noise: None,
            ticks_with: TROUBLES.map(|(flag, name)| (name, judged.ticks_with(flag))).into(),
        }
    }
}

/// What `--json` prints of a run.
#[derive(Serialize)]
struct RunJson<'a> {
    scenario: &'a str,
    /// What was set besides the file.
    sets: &'a [String],
    /// Hash of the design that ran, as `Running::fingerprint` tells it; none of a law that has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    design_hash: Option<String>,
    #[serde(flatten)]
    figures: Figures,
    ending: &'static str,
    /// Time of the last recorded tick, s.
    ended_at_s: f64,
    /// Why the run broke off, if not by divergence or on request.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    warnings: &'a [String],
    /// Poles, margins and noise of the loop at rest; none for a law that switches.
    #[serde(skip_serializing_if = "Option::is_none")]
    design: Option<&'a Design>,
    /// Bounds of the external disturbances, Eq. (40); chain plants only.
    #[serde(skip_serializing_if = "<[Mu]>::is_empty")]
    mu: &'a [Mu],
    /// How the target did, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<&'a Comparison>,
}

/// Figures of merit as JSON: of a run along a reference |y - r| is no y, and a number has its unit.
fn told(metrics: &Metrics, experiment: &Experiment) -> serde_json::Value {
    let mut told = serde_json::to_value(metrics).unwrap_or_default();
    if let (Some(_), Some(error)) = (&experiment.drive, told.get("y_ultimate").cloned()) {
        told["error_ultimate"] = error;
        told.as_object_mut().and_then(|told| told.remove("y_ultimate"));
    }
    for error in told["estimation_error_ultimate"].as_array_mut().into_iter().flatten() {
        // A drive's are those of its shafts; the paper's of a chain in which each state is the slope of the one before.
        let order = if experiment.drive.is_some() { 2 } else { error["channel"].as_u64().unwrap_or_default() };
        match (experiment.output_unit, order) {
            ("", _) => {}
            (_, 1) => error["unit"] = "rad/s".into(),
            (_, order) => error["unit"] = format!("rad/s^{order}").into(),
        }
    }
    told
}

/// The controller on a target against the one here.
#[derive(Serialize)]
struct Comparison {
    /// How many ticks were compared.
    ticks: u64,
    /// Bits that differ in the first output that does.
    bits_differ: u32,
    round_trips_per_s: f64,
    /// Requests that had to be sent again.
    repeated: u64,
}

impl Comparison {
    fn line(&self) -> String {
        let Self { ticks, bits_differ, round_trips_per_s, repeated } = self;
        let repeated = match repeated {
            0 => String::new(),
            1 => ", 1 request sent again".into(),
            many => format!(", {many} requests sent again"),
        };
        format!("{ticks} ticks, {bits_differ} bits differ ({round_trips_per_s:.0} round trips/s{repeated})")
    }
}

/// A bar, how much of it, and how long it takes.
const LEFT: &str = "{bar:40} {percent:>3} %  {elapsed} / {eta} left";

impl Console<'_> {
    /// A progress bar of this look, if there is someone to watch it.
    fn bar(&self, length: u64, template: &str) -> ProgressBar {
        let drawn = if self.terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(length), drawn);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar
    }

    /// To stdout. A reader that has gone away (`| head`) is no error.
    fn say(&mut self, text: &str) -> Result<(), Failure> {
        match writeln!(self.out, "{text}").and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::writing("stdout", &error)),
            _ => Ok(()),
        }
    }

    /// JSON to stdout, or why there is none.
    fn say_json(&mut self, json: serde_json::Result<String>) -> Result<(), Failure> {
        self.say(&json.map_err(|error| Failure::writing("the answer as JSON", &error.into()))?)
    }

    /// To stderr; there is nowhere to complain if that fails.
    fn note(&mut self, text: &str) {
        let _ = writeln!(self.err, "{text}");
    }

    fn budget(&mut self, options: &cycle_bound::Options) -> Result<u8, Failure> {
        let bad = |message| Failure { status: status::BAD_INPUT, message };
        options.elf.as_deref().map_or(Ok(()), |elf| target::present(elf, "--elf")).map_err(bad)?;
        let Reply { text, remarks, status } = cycle_bound::run(options, self.stop).map_err(bad)?;
        self.say(&text)?;
        for line in &remarks {
            self.note(line);
        }
        Ok(status)
    }

    fn schema(&mut self, plant: &str) -> Result<u8, Failure> {
        self.say(&format!("{:#}", scenario::schema(plant)))?;
        Ok(status::DONE)
    }

    fn completions(&mut self, shell: clap_complete::Shell) -> Result<u8, Failure> {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "host-sim", &mut script);
        self.say(String::from_utf8_lossy(&script).trim_end())?;
        Ok(status::DONE)
    }

    /// `program` is what the user called.
    fn new_scenario(&mut self, name: &str, plant: &str, folder: &Path, program: &str) -> Result<u8, Failure> {
        let name = name.strip_suffix(".toml").unwrap_or(name);
        let bad = |message: String| Failure { status: status::BAD_INPUT, message };
        let text = scenario::template(name, plant).ok_or_else(|| {
            bad(format!("{name:?} cannot name a scenario: use 1 to 64 letters, digits, `_`, `-`, `.`"))
        })?;
        let path = folder.join(format!("{name}.toml"));
        let written = whole_file::write(&path, Existing::Keep, |out| out.write_all(text.as_bytes()));
        written.map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => bad(format!("{} exists already and is left as it is", path.display())),
            _ => Failure::writing(path.display(), &error),
        })?;
        self.say(&format!("wrote {0}; run it with: {program} run {0}", path.display()))?;
        Ok(status::DONE)
    }

    /// One run, in this process or on a target too; `place` ends the name of its folder.
    fn run(
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
            // A target that says nothing was waited for no longer.
            (trace.ending, error) = (Ending::Interrupted { t_s }, None);
        }
        let comparison = link.map(|link| compared(&trace, error.as_ref(), &link, started));
        let metrics = experiment.metrics(&trace);
        let figures = Figures::of(&mut experiment, &trace, &metrics);
        let (tracking, noise) = (figures.tracking, figures.noise);
        let error = error.map(|error| error.to_string());
        let design = Design::of(&experiment).ok();
        let json = RunJson {
            scenario: &experiment.name,
            sets: &options.sets,
            design_hash,
            figures,
            ending: ending(&trace, &metrics).0,
            ended_at_s: trace.rows.last().map_or(0.0, |row| row.t_s),
            error: error.clone(),
            warnings: &experiment.warnings,
            design: design.as_ref(),
            mu: &experiment.mu,
            target: comparison.as_ref(),
        };
        let json = serde_json::to_string(&json);
        if claim.is_some() {
            write_results(&folder, &experiment, &trace, options)?;
            let text = json.as_deref().unwrap_or_default();
            let path = folder.join(RUN_JSON);
            write_whole(&path, |out| writeln!(out, "{text}"))
                .map_err(|error| Failure::writing(path.display(), &error))?;
        }
        drop((kept, claim));

        if options.json {
            self.say_json(json)?;
        } else {
            for line in experiment.drive.iter().flat_map(|drive| &drive.chosen) {
                self.say(line)?;
            }
            let table = match (&experiment.drive, tracking) {
                (Some(drive), Some(tracking)) => {
                    let of_loop_a = design.as_ref().and_then(Design::noise);
                    drive::table(&experiment, drive, &metrics, &tracking, noise.as_ref(), of_loop_a, &trace)
                }
                _ => table(&experiment, &metrics, &trace),
            };
            self.say(&table.to_string())?;
            for line in design.iter().flat_map(Design::short) {
                self.say(&line)?;
            }
            for warning in &experiment.warnings {
                self.say(&format!("warning: {warning}"))?;
            }
            self.say(ending(&trace, &metrics).1.as_str())?;
            if let Some(comparison) = comparison {
                self.say(&comparison.line())?;
            }
            if !options.no_files {
                self.say(&format!("written to {}", folder.display()))?;
            }
        }
        match error {
            Some(message) => Err(Failure { status: status::FAILED, message }),
            None if matches!(trace.ending, Ending::Interrupted { .. }) => {
                let kept = if options.no_files { "is not kept".into() } else { format!("is in {}", folder.display()) };
                self.note(&format!("stopped on request; what was recorded {kept}"));
                Ok(status::INTERRUPTED)
            }
            None => Ok(status::DONE),
        }
    }

    fn figures(&mut self, only: &[String], folder: &Path, json: bool) -> Result<u8, Failure> {
        let chosen = chosen_figures(only)?;
        let _claim = claim_folder(folder)?;
        // Between two looks there is the writing of one figure.
        let guards = (stop::keeping(), stop::looking());
        let mut claims = Vec::new();
        for figure in chosen {
            let mut cases = Vec::new();
            let mut title = String::new();
            for (label, mut experiment) in figure.experiments()?.into_iter().chain(figure.further_experiments()?) {
                self.note(&format!("{}: {label}", figure.id));
                let (trace, error) = self.watched(&mut experiment, &mut None);
                if let Some(error) = error {
                    return Err(Failure { status: status::FAILED, message: format!("{}: {error}", figure.id) });
                }
                if matches!(trace.ending, Ending::Interrupted { .. }) {
                    self.note(&format!(
                        "stopped on request; the figures before {} are in {}",
                        figure.id,
                        folder.display()
                    ));
                    return Ok(status::INTERRUPTED);
                }
                if title.is_empty() {
                    title.clone_from(&experiment.title);
                }
                cases.push(Case { label, metrics: experiment.metrics(&trace), trace });
            }
            let reproduction = figure.judge(&title, &cases);
            let told = |error| Failure::writing(folder.join(figure.id).display(), &error);
            reproduction.figure.write(folder, figure.id).map_err(told)?;
            claims.extend(reproduction.claims);
        }
        drop(guards);
        if json {
            self.say_json(serde_json::to_string_pretty(&claims))?;
        } else {
            self.say(&claim_table(&claims).to_string())?;
            for claim in claims.iter().filter(|claim| !claim.remark.is_empty()) {
                self.say(&format!("{}, {}: {}", claim.figure, claim.claim, claim.remark))?;
            }
            self.say(&format!("written to {}", folder.display()))?;
        }
        let lost: Vec<&str> = claims.iter().filter(|claim| claim.is_regression()).map(|claim| claim.claim).collect();
        if lost.is_empty() {
            return Ok(status::DONE);
        }
        Err(Failure {
            status: status::FAILED,
            message: format!("reproduced before, no longer does: {}", lost.join("; ")),
        })
    }

    /// Runs the loop under a progress bar and Ctrl-C, with what the target logs shown as it comes.
    fn watched(&mut self, experiment: &mut Experiment, link: &mut Option<Link>) -> (Trace, Option<LoopError>) {
        let periods = experiment.periods as u64;
        let bar = self.bar(periods, LEFT);
        let _looking = stop::looking();
        // Drawing is slower than a tick.
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

/// How a target did in a run that took this long.
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

/// A title speaks of its file: what `--set` changed is told beside it, here and in the figures, on the same line.
fn note_changes(title: &mut String, sets: &[String]) {
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

fn chosen_figures(only: &[String]) -> Result<Vec<&'static PaperFigure>, Failure> {
    if only.is_empty() {
        return Ok(CATALOGUE.iter().collect());
    }
    let find = |name: &String| {
        CATALOGUE.iter().find(|figure| figure.id == name).ok_or_else(|| {
            let distance = |figure: &&PaperFigure| strsim::damerau_levenshtein(figure.id, name);
            let nearest = CATALOGUE.iter().min_by_key(distance).map_or("", |figure| figure.id);
            let message =
                format!("--only {name}: there is no such figure; expected fig01 .. fig10, nearest is {nearest}");
            Failure { status: status::BAD_INPUT, message }
        })
    };
    only.iter().map(find).collect()
}

fn claim_table(claims: &[ClaimRow]) -> Table {
    let mut table = Table::new(["figure", "claim", "published", "reproduced", "unit", "reading", "verdict"]);
    for claim in claims {
        let verdict = match claim.holds {
            _ if claim.is_regression() => "NO LONGER HOLDS",
            Some(true) => "holds",
            Some(false) => "does not hold",
            None if claim.holds_as_drawn => "open; holds as drawn",
            None => "open; does not hold as drawn",
        };
        let verdict = format!("{verdict} ({})", claim.criterion);
        let range = claim.range.map_or_else(String::new, |[least, most]| {
            format!(" ({} .. {})", significant(least, 3), significant(most, 3))
        });
        let reproduced = significant(claim.reproduced, 4) + &range;
        table.row([claim.figure, claim.claim, claim.published, &reproduced, claim.unit, claim.reading, &verdict]);
    }
    table
}

/// What a run leaves in its folder beside trace and figures.
const RUN_JSON: &str = "run.json";

/// [`claim_folder`], unless the results of another scenario are there.
fn prepare_folder(folder: &Path, name: &str) -> Result<Claim, Failure> {
    let left = std::fs::read_to_string(folder.join(RUN_JSON)).unwrap_or_default();
    let left = serde_json::from_str::<serde_json::Value>(&left).unwrap_or_default();
    match left["scenario"].as_str() {
        Some(other) if other != name => {
            let message = format!(
                "output folder {} holds the results of scenario {other:?}: give those of {name:?} another with --out, \
                 or remove it",
                folder.display()
            );
            Err(Failure { status: status::BAD_INPUT, message })
        }
        _ => claim_folder(folder),
    }
}

/// Makes the folder, tries it and takes it, before anything is computed that could then not be kept.
fn claim_folder(folder: &Path) -> Result<Claim, Failure> {
    whole_file::claim(folder).map_err(|error| {
        let why = match error.kind() {
            io::ErrorKind::ResourceBusy => {
                "another run is writing there; wait for its end, or give this one another with --out".into()
            }
            _ => format!("cannot be written: {error}"),
        };
        Failure { status: status::BAD_INPUT, message: format!("output folder {}: {why}", folder.display()) }
    })
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

fn labels(experiment: &Experiment) -> Labels<'_> {
    let states = experiment.drive.as_ref().map_or(&[][..], |drive| drive.states);
    let Experiment { title, output_unit, control_unit, .. } = experiment;
    Labels { title, output_unit, control_unit, states }
}

/// The standard figures of its run, with the stems of their files.
fn figures_of(experiment: &Experiment, trace: &Trace) -> Vec<(String, Figure)> {
    match &experiment.drive {
        Some(drive) => drive_figure::drive_figures(trace, drive, &labels(experiment)),
        None => trace_figure::run_figures(trace, &labels(experiment)),
    }
}

/// As a word for programs, and as a sentence for people.
fn ending(trace: &Trace, metrics: &Metrics) -> (&'static str, String) {
    match trace.ending {
        Ending::Finished if !metrics.bounded => {
            ("finished", format!("NOT BOUNDED: |y| went beyond {FAR} times where it began and the settling band"))
        }
        Ending::Finished => ("finished", "the state stayed bounded to the end".into()),
        Ending::Diverged { t_s } => (
            "diverged",
            format!("NOT BOUNDED: the state ran away at t = {} s and the run ended there", significant(t_s, 4)),
        ),
        Ending::BrokenOff { t_s } => {
            ("broken off", format!("BROKEN OFF: the run could not go on at t = {} s", significant(t_s, 4)))
        }
        Ending::Interrupted { t_s } => {
            ("interrupted", format!("INCOMPLETE: the run ended at t = {} s", significant(t_s, 4)))
        }
    }
}

/// What a controller can tell, and its name in JSON.
const TROUBLES: [(Health, &str); 7] = [
    (Health::INPUT_REJECTED, "input_rejected"),
    (Health::SATURATED, "saturated"),
    (Health::SIGMA_STAR_OVER_BOUND, "sigma_star_over_bound"),
    (Health::SAMPLE_LOST, "sample_lost"),
    (Health::DISTURBANCE_OVER_BOUND, "disturbance_over_bound"),
    (Health::STUCK_AT_LIMIT, "stuck_at_limit"),
    (Health::STOPPED, "stopped"),
];

fn ticks_with(trace: &Trace, flag: Health) -> usize {
    trace.rows.iter().filter(|row| row.health.contains(flag)).count()
}

fn table(experiment: &Experiment, metrics: &Metrics, trace: &Trace) -> Table {
    let [from, to] = metrics.window_s;
    // Nothing is said of a window that the run did not go through.
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

/// The rows that every run has.
fn how_it_went(experiment: &Experiment, metrics: &Metrics, trace: &Trace, row: &mut impl FnMut(&str, String, &str)) {
    let ticks = format!("{} of {} ticks", trace.rows.len(), experiment.periods + 1);
    // A run that could not go on says nothing of it.
    let bounded = match trace.ending {
        Ending::BrokenOff { .. } => "-",
        _ if metrics.bounded => "yes",
        _ => "NO",
    };
    row("bounded", bounded.into(), &ticks);
    for (flag, _) in TROUBLES {
        let count = ticks_with(trace, flag);
        if count > 0 {
            row(&format!("ticks with {flag}"), count.to_string(), "told by the controller");
        }
    }
}

#[cfg(test)]
mod tests;
