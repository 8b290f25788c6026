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
//! the writing failed, a bar is not held, a claim that held no longer does, a target differs or cannot be reached, 2
//! bad input (nothing is computed) or a place that nothing can be written to (what was computed is told), 130 told to
//! stop by Ctrl-C or SIGTERM (what was recorded is written).

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use scenario::{Experiment, ScenarioError, Source};
use sha2::{Digest, Sha256};
use study::map::Subject;
use study::number::significant;
use terminal::stop;
use whole_file::{Claim, Existing, Kind};

use crate::feature::Feature;
use crate::store;

mod bounds;
#[cfg_attr(not(feature = "chip"), path = "cli/no_budget.rs")]
mod budget;
mod compare;
mod design;
mod drive;
mod export;
mod identify;
mod live;
mod map;
mod monte_carlo;
mod paper_figures;
#[cfg_attr(not(feature = "proof"), path = "cli/no_proof.rs")]
mod proof;
mod report;
mod run;
mod target;
mod tune;

use bounds::BoundsOptions;
use budget::BudgetOptions;
use compare::CompareOptions;
use design::DesignOptions;
use export::ExportOptions;
use identify::{CommissionOptions, IdentifyOptions};
use live::{LiveOptions, ReplayOptions};
use map::MapOptions;
use monte_carlo::{MergeOptions, MonteCarloOptions};
use report::ReportOptions;
use target::{EmulateOptions, HilOptions, PilOptions};
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
    pub const INTERRUPTED: u8 = terminal::stop::STATUS;
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
    ///
    /// Exit status: 0 the run came to its end, or diverged: that is a result, told as NOT BOUNDED, in run.json as
    /// metrics.bounded and ending. 1 it could not go on or be written, 2 bad input, 130 stopped. To have a bound held,
    /// host-sim monte-carlo --at-most.
    Run {
        /// The scenario (host-sim new NAME writes one).
        file: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Run a scenario with the controller on the emulated chip, and compare every output of every tick bit for bit
    /// (feature chip).
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
    /// Run a scenario with the controller on a board, and compare all outputs of every tick bit for bit (feature chip).
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
    /// See, move and tune a drive that runs by itself: the image `drive` or `motor`, emulated or on a board
    /// (feature chip).
    ///
    /// Commands come from stdin, one a line; `help` lists them. A setting is designed here first, sent, designed on the
    /// chip while the drive goes on, and taken over between two ticks; what is refused leaves it as it was.
    Live(LiveOptions),
    /// Run again what the black box of a drive held: bit for bit, or with another design.
    ///
    /// Exit status: 0 the same bits, 1 others, 2 the file is none or damaged.
    Replay(ReplayOptions),
    /// Run an image in the emulator, one instruction a nanosecond, and print its log (feature chip).
    Emulate(EmulateOptions),
    /// Say what a design comes to in its loop: poles, margins, noise, what limits it, what would be better.
    ///
    /// Nothing is simulated: the loop is linearised where it stands still. A loop that is unstable is a result. Of a
    /// drive noise of u may be 1 % of the largest current.
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
    /// Rivals: LQG with disturbance states, LQI, ADRC with model, super-twisting, P-PI, and on a joint P-PI with a
    /// notch. docs/comparison.md says how.
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
    /// Compute an upper bound in cycles of a function from its machine code, and what else it costs (feature chip).
    ///
    /// Exit status: 0 the figures stand, 1 a check failed, 2 something could not be followed (it is named).
    Budget(BudgetOptions),
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

impl Command {
    /// What needs a feature, and which.
    const fn needs(&self) -> Option<(&'static str, Feature)> {
        match self {
            Self::Pil { .. } => Some(("pil", Feature::Chip)),
            Self::Hil { .. } => Some(("hil", Feature::Chip)),
            Self::Live(_) => Some(("live", Feature::Chip)),
            Self::Emulate(_) => Some(("emulate", Feature::Chip)),
            Self::Budget(_) => Some(("budget", Feature::Chip)),
            Self::Commission(options) => options.needs(),
            Self::Export(options) => options.needs(),
            _ => None,
        }
    }
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
    let cli = match command().try_get_matches_from(&args).and_then(|found| Cli::from_arg_matches(&found)) {
        Ok(cli) => cli,
        Err(usage) => {
            let text = usage.render();
            let to = if usage.use_stderr() { console.err } else { console.out };
            // Nobody is left to be told that this could not be printed.
            let _ = write!(to, "{text}");
            return if usage.use_stderr() { status::BAD_INPUT } else { status::DONE };
        }
    };
    let needs = cli.command.as_ref().and_then(Command::needs);
    if let Some((what, feature)) = needs.filter(|(_, feature)| !feature.is_built_in()) {
        console.note(&format!("error: {}", feature.missing(what, &args[1..])));
        return status::BAD_INPUT;
    }
    let done = match &cli.command {
        None => default_scenario(&cli.options.sets).and_then(|it| console.run(it, &cli.options, "", None)),
        Some(Command::Run { file, options }) => {
            scenario_of(Some(file), options).and_then(|it| console.run(it, options, "", None))
        }
        Some(Command::Pil { file, options, target }) => scenario_of(file.as_deref(), options).and_then(|mut it| {
            console.as_on_the_chip(&mut it);
            let link = console.emulated(&it, target)?;
            console.run(it, options, "-pil", Some(link))
        }),
        Some(Command::Hil { file, options, target }) => scenario_of(file.as_deref(), options).and_then(|mut it| {
            console.as_on_the_chip(&mut it);
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

/// The command line. A number below 0 is a value, of which its option says what it takes, and no unknown option.
fn command() -> clap::Command {
    fn numbers(command: clap::Command) -> clap::Command {
        command
            .mut_args(|arg| if arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg })
            .mut_subcommands(numbers)
    }
    numbers(Cli::command())
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

/// The text of a scenario that more is to be done with than to run it.
struct ScenarioText {
    /// What messages call its file.
    file: String,
    text: String,
    /// Its name if it gives none.
    stem: String,
}

/// Scenarios that are there without a file: what ends their names, and their texts.
const DEFAULT: (&str, &str) = ("default", scenario::DEFAULT);
const JOINT: (&str, &str) = ("joint", scenario::JOINT);

impl ScenarioText {
    /// Of a file; without one, one that is built in.
    fn read(file: Option<&Path>, (stem, text): (&str, &str)) -> Result<Self, Failure> {
        let Some(file) = file else {
            return Ok(Self { file: format!("built-in {stem}.toml"), text: text.into(), stem: stem.into() });
        };
        let stem = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        // What is no scenario at all is told as that, before its first line is.
        let other = match file.extension().and_then(OsStr::to_str) {
            Some("csv") => Some("a table, as `identify RECORD SCENARIO` takes for its record"),
            Some("parquet") => Some("trials, as `report SCENARIO --trials FOLDER` takes them"),
            _ => None,
        };
        if let Some(other) = other.filter(|_| file.exists()) {
            return Err(bad(format!("{}: expected a scenario, this is {other}", file.display())));
        }
        Ok(Self { file: file.display().to_string(), text: read_text(file, Kind::SETTINGS)?, stem })
    }

    fn source<'a>(&'a self, sets: &'a [String]) -> Source<'a> {
        Source { file: &self.file, text: &self.text, sets }
    }

    fn subject<'a>(&'a self, sets: &'a [String]) -> Subject<'a> {
        Subject { file: &self.file, text: &self.text, name: &self.stem, sets }
    }
}

fn read_text(file: &Path, kind: Kind) -> Result<String, Failure> {
    whole_file::read_text(file, kind).map_err(|why| bad(format!("{}: {why}", file.display())))
}

fn hex_sha256(data: impl AsRef<[u8]>) -> String {
    store::hex(&Sha256::digest(data))
}

/// Why a command ended early, a line for each thing that is wrong, and the exit status.
struct Failure {
    status: u8,
    message: String,
}

/// What the user can mend.
fn bad(message: impl Into<String>) -> Failure {
    Failure { status: status::BAD_INPUT, message: message.into() }
}

/// What went wrong on the way.
fn failed(message: impl Into<String>) -> Failure {
    Failure { status: status::FAILED, message: message.into() }
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        bad(error.to_string())
    }
}

impl From<study::Error> for Failure {
    fn from(error: study::Error) -> Self {
        if error.is_input { bad(error.to_string()) } else { failed(error.to_string()) }
    }
}

impl Failure {
    fn writing(what: impl fmt::Display, error: &io::Error) -> Self {
        use io::ErrorKind::{AlreadyExists, InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied};
        let is_of_the_path = matches!(
            error.kind(),
            AlreadyExists | InvalidInput | IsADirectory | NotADirectory | NotFound | PermissionDenied
        );
        let status = if is_of_the_path { status::BAD_INPUT } else { status::FAILED };
        Self { status, message: format!("{what} cannot be written: {error}") }
    }
}

/// A bar, how much of it, and how long it takes.
const LEFT: &str = "{bar:40} {percent:>3} %  {elapsed} / {eta} left";

impl Console<'_> {
    /// A progress bar of this look, if there is someone to watch it.
    fn bar(&self, length: u64, template: &str) -> ProgressBar {
        self.bar_from(0, length, template)
    }

    /// The same of which so much was done before: it says nothing of the `{rate}`, per second, and of what is `{left}`.
    fn bar_from(&self, done: u64, length: u64, template: &str) -> ProgressBar {
        let drawn = if self.terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(length), drawn).with_position(done);
        if let Ok(style) = ProgressStyle::with_template(template) {
            let rate =
                move |state: &ProgressState| state.pos().saturating_sub(done) as f64 / state.elapsed().as_secs_f64();
            let told = style
                .with_key("rate", move |state: &ProgressState, out: &mut dyn fmt::Write| {
                    let _ = write!(out, "{}", significant(rate(state), 3));
                })
                .with_key("left", move |state: &ProgressState, out: &mut dyn fmt::Write| {
                    let left_s = length.saturating_sub(state.pos()) as f64 / rate(state);
                    let left = Duration::try_from_secs_f64(left_s).ok().filter(|_| state.pos() > done);
                    let left = left.map_or_else(|| "?".to_owned(), |left| HumanDuration(left).to_string());
                    let _ = write!(out, "{left}");
                });
            bar.set_style(told);
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
}

/// What `--out` names, or the folder that a command makes for a scenario.
fn folder_of(out: Option<&PathBuf>, scenario: &str, what: &str) -> PathBuf {
    out.cloned().unwrap_or_else(|| Path::new("out").join(format!("{scenario}-{what}")))
}

/// Makes the folder, tries it and takes it, before anything is computed that could then not be kept.
fn claim_folder(folder: &Path) -> Result<Claim, Failure> {
    whole_file::claim(folder).map_err(|error| {
        let why = match error.kind() {
            io::ErrorKind::ResourceBusy => {
                "another run is writing there; wait for its end, or give this one another with --out".into()
            }
            _ if folder.is_file() => "that is a file: give a folder with --out".into(),
            _ => format!("cannot be written: {error}"),
        };
        bad(format!("output folder {}: {why}", folder.display()))
    })
}

/// A file that the user names is the user's: it is never lost by a slip, only `--force` overwrites it, and its folder
/// must be there. What stands under `out/` without being named is the program's, and is made anew.
fn write_file(path: &Path, text: &str, force: bool) -> Result<(), Failure> {
    let existing = if force { Existing::Replace } else { Existing::Keep };
    whole_file::write(path, existing, |out| out.write_all(text.as_bytes())).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => exists(path),
        _ => Failure::writing(path.display(), &error),
    })
}

/// Asked before minutes of work, not after.
fn free(path: &Path, force: bool) -> Result<(), Failure> {
    if path.exists() && !force {
        return Err(exists(path));
    }
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        return Err(bad(format!("{}: there is no folder {}", path.display(), folder.display())));
    }
    whole_file::may_be_made(path).map_err(|error| bad(format!("{}: cannot be written: {error}", path.display())))
}

/// The same for `--to`: what is found is written to a file of its own, and nothing is ever overwritten by it.
fn free_to(to: &Path) -> Result<(), Failure> {
    // A link to nothing is in the way too.
    if std::fs::symlink_metadata(to).is_ok() {
        return Err(bad(format!("{} exists already and is left as it is: give another with --to", to.display())));
    }
    free(to, false).map_err(|Failure { status, message }| Failure { status, message: format!("--to {message}") })
}

/// What goes to a place that was [free](free_to): should one have come there since, it stays.
fn write_new(to: &Path, text: &str) -> Result<(), Failure> {
    whole_file::write(to, Existing::Keep, |out| out.write_all(text.as_bytes()))
        .map_err(|error| Failure::writing(to.display(), &error))
}

fn exists(path: &Path) -> Failure {
    bad(format!("{} exists already and is left as it is; --force overwrites it", path.display()))
}

#[cfg(test)]
mod tests;
