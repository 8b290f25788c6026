//! The command line.
//!
//! ```text
//! host-sim                          run the default scenario: Example 2 of the paper, for its figures
//! host-sim run FILE.toml            simulate a scenario
//! host-sim pil [FILE.toml]          simulate with the controller on the emulated target, compared bit for bit
//! host-sim hil --port DEV [..]      simulate with the controller on a board, compared bit for bit
//! host-sim live [FILE.toml] [..]    monitor, move and tune a running drive, emulated or on a board
//! host-sim replay TRACE [..]        rerun the trace buffer of a drive, with its design or another
//! host-sim emulate --image FILE     run a firmware in the emulator and print its log
//! host-sim design [FILE.toml]       analyse the closed loop: poles, margins, noise, limits, suggestions
//! host-sim map [FILE.toml] ..       sweep two keys or all corners: stability and performance
//! host-sim tune [FILE.toml] ..      tune the bandwidths of a drive to a specification
//! host-sim report [FILE ..]         write an HTML report of one or more scenarios
//! host-sim bounds [FILE.toml]       compute guaranteed bounds on sigma*, the errors and u
//! host-sim monte-carlo [FILE.toml]  simulate many random variations: percentiles, failure rate, worst case
//! host-sim merge SHARD..            combine the shards of a Monte Carlo run
//! host-sim identify DATA.csv [..]   identify a motor or joint from a recording
//! host-sim commission [FILE.toml]   record, identify, switch the gains and verify: simulated, or on a board
//! host-sim compare [FILE.toml]      compare edo-smc with tuned baseline controllers
//! host-sim figures                  reproduce the figures of the paper
//! host-sim budget                   compute the WCET bound of a function, check the budgets of many
//! host-sim export [FILE.toml] ..    export the controller as one source file, C or Rust
//! host-sim view FILE                serve the live page, opened on a scenario or a trace
//! host-sim schema [--plant P]       print the JSON schema of scenario files
//! host-sim new NAME [--plant P]     write a commented scenario file: paper, motor, joint, chain, own
//! host-sim completions SHELL        print a completion script for a shell
//! ```
//!
//! A target must reply within 5 s, and the emulator must start within 10 s.
//!
//! Results go to stdout, everything else to stderr. Exit status:
//!
//! | status | meaning |
//! |---|---|
//! | 0 | finished, even if the simulated loop diverged |
//! | 1 | a run or a write failed, a limit was exceeded, a claim of the paper failed, a target differs or is missing |
//! | 2 | invalid input (nothing was computed), or an output path that cannot be written (results are printed) |
//! | 130 | stopped by Ctrl-C or SIGTERM (recorded data are written) |

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
use whole_file::{Claim, Existing, FileKind};

use crate::feature::Feature;
use crate::store;

mod bounds;
#[cfg_attr(not(feature = "chip"), path = "cli/no_budget.rs")]
mod budget;
mod compare;
mod design;
mod drive;
mod export;
mod fmu;
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
mod view;

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
use view::ViewOptions;

/// The exit statuses of the program.
pub mod status {
    /// The command finished.
    pub const DONE: u8 = 0;
    /// A run, a write or a check failed.
    pub const FAILED: u8 = 1;
    /// The input was invalid; nothing was computed.
    pub const BAD_INPUT: u8 = 2;
    /// Stopped by Ctrl-C.
    pub const INTERRUPTED: u8 = terminal::stop::STATUS;
}

/// edo-smc: motor and joint control with load and friction estimation. Simulate, design, export.
///
/// Start with your own motor: host-sim new mine --plant motor, edit mine.toml, host-sim run mine.toml. Use --plant
/// joint for a joint with two encoders. Without a command host-sim runs the flexible joint of the paper in f32 at 1
/// kHz.
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
    /// Simulate a scenario: metrics, figures and a trace.
    ///
    /// Example: host-sim run mine.toml --set motor.inertia_kg_m2=3e-4
    ///
    /// Exit status: 0 the run finished, even if the loop diverged (last line `result: DIVERGED`; run.json:
    /// metrics.bounded, ending); 1 the run broke off or could not be written; 2 invalid input; 130 stopped. To fail on
    /// a metric use host-sim monte-carlo --at-most.
    Run {
        /// Scenario file; host-sim new NAME writes one.
        file: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Simulate with the controller on the emulated target, compared bit for bit (feature chip).
    ///
    /// Example: host-sim pil mine.toml
    ///
    /// The emulator must start within 10 s, and the target must reply within 5 s. Exit status 1 if a bit differs.
    Pil {
        /// Scenario file [default: built-in joint of the paper].
        file: Option<PathBuf>,
        #[command(flatten)]
        options: RunOptions,
        #[command(flatten)]
        target: PilOptions,
    },
    /// Simulate with the controller on a board, compared bit for bit (feature chip).
    ///
    /// Example: host-sim hil mine.toml --port /dev/ttyACM0
    ///
    /// The board runs the firmware `pil` and must reply within 5 s. Exit status 1 if a bit differs.
    Hil {
        /// Scenario file [default: built-in joint of the paper].
        file: Option<PathBuf>,
        #[command(flatten)]
        options: RunOptions,
        #[command(flatten)]
        target: HilOptions,
    },
    /// Monitor, move and tune a running drive (feature chip).
    ///
    /// The drive is the firmware `drive` or `motor`, emulated or on a board. It reads one command per line from stdin;
    /// `help` lists them. The host checks a new setting first. The target then designs it in the background and
    /// switches between two ticks. A rejected setting changes nothing.
    Live(LiveOptions),
    /// Rerun the trace buffer of a drive.
    ///
    /// With the recorded design the replay is bit-identical; with --set it shows another design on the same counts.
    /// Exit status: 0 identical bits, 1 different bits, 2 the file is damaged or is not a trace buffer.
    Replay(ReplayOptions),
    /// Run a firmware in the emulator and print its log (feature chip).
    ///
    /// One instruction takes one nanosecond of emulated time.
    Emulate(EmulateOptions),
    /// Analyse the closed loop: poles, margins, noise, limits.
    ///
    /// Example: host-sim design mine.toml --set drive.margin=standard
    ///
    /// The loop is linearised at standstill; nothing is simulated. The table ends with the limits that bind and a
    /// suggestion. For a drive, encoder noise in the current command is limited to 1 % of max_current_a. Exit status 0
    /// also for an unstable loop.
    Design(DesignOptions),
    /// Compute guaranteed bounds on sigma*, the errors and u.
    ///
    /// For each bound: its cause, its ratio to a simulated run, and the gain that lowers it, as table and figure. Exit
    /// status 1 if the loop is unstable: an unstable loop has no bound.
    Bounds(BoundsOptions),
    /// Sweep two keys or all parameter corners; plot stability and tolerance.
    ///
    /// Example: host-sim map mine.toml --x error.torque_percent=-90..300 --y drive.period_s=1e-4..5e-3:log
    ///
    /// Stability follows from the exact matrices of the sampled loop at standstill. --simulate also runs the nonlinear
    /// plant at each point.
    Map(MapOptions),
    /// Simulate many random parameter variations: percentiles, failure rate, worst case.
    ///
    /// Example: host-sim monte-carlo mine.toml --uncertain 50 --trials 10000
    ///
    /// Trials are saved in chunks; --resume continues an interrupted run. One seed gives identical bytes on any number
    /// of threads, shards and machines.
    MonteCarlo(MonteCarloOptions),
    /// Combine the shards of a Monte Carlo run and report the result.
    Merge(MergeOptions),
    /// Tune the bandwidths of a drive to a specification.
    ///
    /// Example: host-sim tune mine.toml --noise 0.015 --load 5e-3 --uncertain 50
    ///
    /// Each metric is taken in the worst corner. Metrics without a limit are minimised. Writes a table, a figure and
    /// the tuned scenario. Exit status 1 if a limit is not met.
    Tune(TuneOptions),
    /// Identify a motor or joint from a recording of counts and current.
    ///
    /// Example: host-sim identify record.csv mine.toml
    ///
    /// Prints inertia, stiffness, damping, torque constant and friction with intervals. Writes the updated scenario and
    /// a figure of the residual. A recording with too little excitation is rejected with the reason (exit status 2).
    /// Procedure: docs/commissioning.md.
    Identify(IdentifyOptions),
    /// Commission a drive: record, identify, switch gains, verify.
    ///
    /// Example (stiffness 40 % off): host-sim commission mine.toml --set error.stiffness_percent=-40
    ///
    /// Runs in simulation, on a board (--port), or on the emulated target (--image with the firmware `drive` or
    /// `motor`). Keeps the new gains if a test move verifies them, else restores the old gains. Exit status 1 if the
    /// recording was rejected or the old gains were restored.
    Commission(CommissionOptions),
    /// Write an HTML report of one or more scenarios.
    ///
    /// The page shows design, run, map and cycle cost; several scenarios stand side by side. It works without a network
    /// and contains its data: pass an old report as an input to compare it with a new run.
    Report(ReportOptions),
    /// Compare edo-smc with equally tuned baseline controllers.
    ///
    /// Baselines: LQG with disturbance states, LQI, ADRC with model, super-twisting, P-PI, and for a joint P-PI with a
    /// notch filter. Protocol: docs/comparison.md.
    Compare(CompareOptions),
    /// Reproduce the figures of the paper and check its claims.
    Figures {
        /// Figure to draw, fig01 to fig10; repeatable [default: all].
        #[arg(long, value_name = "FIGURE")]
        only: Vec<String>,
        /// Output folder.
        #[arg(long, value_name = "DIR", default_value = "out/figures")]
        out: PathBuf,
        /// Print a JSON array of claims instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Compute the WCET bound of a function from its machine code (feature chip).
    ///
    /// Example: host-sim budget --elf my.elf --symbol my_tick
    ///
    /// Also prints stack, code size and instruction counts. Exit status: 0 all bounds hold, 1 a check failed, 2 the
    /// code cannot be analysed (with address and reason).
    Budget(BudgetOptions),
    /// Export the designed controller as source code or FMU.
    ///
    /// Example: host-sim export mine.toml --lang c --standalone -o drive.h
    ///
    /// --lang c --standalone writes the whole controller as one C99 file. --lang c alone writes only a configuration
    /// for the static library libedo_smc.a. --lang rust writes a `static` for the crate controller-core. --fmu writes
    /// an FMU for Simulink and other simulators. The file computes the bits of `host-sim run`. Its head names scenario,
    /// design and version.
    Export(ExportOptions),
    /// Serve the live page, opened on a file.
    ///
    /// Example: host-sim view mine.toml
    ///
    /// Prints the address of the page. FILE is a scenario, or trace.csv of host-sim run. `cargo xtask web` builds the
    /// page. Only this machine can read it; Ctrl-C ends the server (exit status 130).
    View(ViewOptions),
    /// Print the JSON schema of scenario files.
    Schema {
        /// Plant type of the schema; `paper`, `chain` and `own` share one.
        #[arg(long, value_name = "PLANT", default_value = "paper", value_parser = starts())]
        plant: String,
    },
    /// Write a commented scenario file NAME.toml.
    ///
    /// Example: host-sim new mine --plant motor
    ///
    /// An existing file is never overwritten.
    New {
        /// Name of the scenario; the file is NAME.toml.
        name: String,
        /// Plant type: flexible joint, motor, chain of integrators, your own equations, or the joint of the paper.
        #[arg(long, value_name = "PLANT", default_value = "joint", value_parser = starts())]
        plant: String,
    },
    /// Print a shell completion script.
    ///
    /// Example: host-sim completions bash > ~/.local/share/bash-completion/completions/host-sim
    Completions {
        /// Shell of the script.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages of all commands.
    ///
    /// Example: host-sim man ~/.local/share/man/man1
    Man {
        /// Existing folder of the pages.
        folder: PathBuf,
    },
}

fn starts() -> clap::builder::PossibleValuesParser {
    scenario::STARTS.map(|(plant, _)| plant).into()
}

impl Command {
    /// Returns the command's name and the cargo feature that it needs.
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
    /// Override a key of the scenario; repeatable. Example: --set drive.margin=standard for a motor or joint, --set
    /// controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Output folder of trace.csv and figures [default: out/SCENARIO, on a target out/SCENARIO-pil or -hil].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the table (run.json is written in both cases).
    #[arg(long)]
    json: bool,
    /// Do not write files.
    #[arg(long, conflicts_with = "out")]
    no_files: bool,
    /// Write every N-th tick to trace.csv, and the first and last tick [default: 1].
    #[arg(long, value_name = "N")]
    every: Option<NonZeroUsize>,
    /// Also plot every state.
    #[arg(long)]
    states: bool,
}

/// Output streams of a command, and the request to stop.
pub struct Console<'a> {
    /// Stream of results.
    pub out: &'a mut dyn Write,
    /// Stream of errors, notes and progress.
    pub err: &'a mut dyn Write,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
    /// Whether to draw progress bars.
    pub terminal: bool,
}

/// Stop request, set by the handler of Ctrl-C. It is global because a signal handler takes no argument.
static STOP: AtomicBool = AtomicBool::new(false);

/// Runs the program on the real console.
pub fn main() -> u8 {
    stop::on_request(&STOP);
    let terminal = io::stderr().is_terminal();
    let console = Console { out: &mut io::stdout(), err: &mut io::stderr(), stop: &STOP, terminal };
    run(std::env::args_os(), console)
}

/// Runs the program on any console and returns the exit status. `args[0]` is the program's name.
pub fn run(args: impl IntoIterator<Item = OsString>, mut console: Console<'_>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let program = args.first().map_or("host-sim".into(), |name| name.to_string_lossy().into_owned());
    let cli = match parsed(&args) {
        Ok(cli) => cli,
        Err(usage) => {
            let text = usage.render();
            let to = if usage.use_stderr() { console.err } else { console.out };
            // A failed print has no other place to be reported.
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
        Some(Command::View(options)) => console.view(options),
        Some(Command::Schema { plant }) => console.schema(plant),
        Some(Command::New { name, plant }) => console.new_scenario(name, plant, Path::new(""), &program),
        Some(Command::Completions { shell }) => console.completions(*shell),
        Some(Command::Man { folder }) => console.manual(folder),
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

/// Checks the syntax of a command line without running it; `args[0]` is the program's name.
///
/// # Errors
/// The message that the program would print.
pub fn check_syntax(args: impl IntoIterator<Item = OsString>) -> Result<(), String> {
    parsed(args).map(|_| ()).map_err(|usage| usage.to_string())
}

fn parsed<A: Into<OsString> + Clone>(args: impl IntoIterator<Item = A>) -> clap::error::Result<Cli> {
    command().try_get_matches_from(args).and_then(|found| Cli::from_arg_matches(&found))
}

/// Returns the command line parser. A negative number is parsed as a value, not as an unknown option.
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

/// Text of a scenario, for commands that change or repeat it.
struct ScenarioText {
    /// Name of the file in messages.
    file: String,
    text: String,
    /// Name of the scenario if the file has no key `name`.
    stem: String,
}

/// Built-in scenarios: name and text.
const DEFAULT: (&str, &str) = ("default", scenario::DEFAULT);
const JOINT: (&str, &str) = ("joint", scenario::JOINT);

impl ScenarioText {
    /// Reads a file, or returns the built-in scenario if there is none.
    fn read(file: Option<&Path>, (stem, text): (&str, &str)) -> Result<Self, Failure> {
        let Some(file) = file else {
            return Ok(Self { file: format!("built-in {stem}.toml"), text: text.into(), stem: stem.into() });
        };
        let stem = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        // A recording passed as a scenario gets its own message: a TOML error in its first line would mislead.
        let other = match file.extension().and_then(OsStr::to_str) {
            Some("csv") => Some("a recording, the first argument of `identify RECORDING SCENARIO`"),
            Some("parquet") => Some("a file of trials, for `report SCENARIO --trials FOLDER`"),
            _ => None,
        };
        if let Some(other) = other.filter(|_| file.exists()) {
            return Err(bad(format!("{}: expected a scenario, this is {other}", file.display())));
        }
        Ok(Self { file: file.display().to_string(), text: read_text(file, FileKind::SETTINGS)?, stem })
    }

    fn source<'a>(&'a self, sets: &'a [String]) -> Source<'a> {
        Source { file: &self.file, text: &self.text, sets }
    }

    fn subject<'a>(&'a self, sets: &'a [String]) -> Subject<'a> {
        Subject { file: &self.file, text: &self.text, name: &self.stem, sets }
    }
}

fn read_text(file: &Path, kind: FileKind) -> Result<String, Failure> {
    whole_file::read_text(file, kind).map_err(|why| bad(format!("{}: {why}", file.display())))
}

fn hex_sha256(data: impl AsRef<[u8]>) -> String {
    store::hex(&Sha256::digest(data))
}

/// Early end of a command: exit status and one line per problem.
struct Failure {
    status: u8,
    message: String,
}

/// Returns a failure that the user can correct.
fn bad(message: impl Into<String>) -> Failure {
    Failure { status: status::BAD_INPUT, message: message.into() }
}

/// Returns a failure during the work.
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

/// Template of a progress bar: bar, share, elapsed and remaining time.
const LEFT: &str = "{bar:40} {percent:>3} %  {elapsed} / {eta} left";

impl Console<'_> {
    /// Returns a progress bar; it is hidden without a terminal.
    fn bar(&self, length: u64, template: &str) -> ProgressBar {
        self.bar_from(0, length, template)
    }

    /// Returns a progress bar that starts at `done`. Template keys: `{rate}` per second, `{left}` remaining time.
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

    /// Prints a line to stdout. A closed pipe (`| head`) is not an error.
    fn say(&mut self, text: &str) -> Result<(), Failure> {
        match writeln!(self.out, "{text}").and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::writing("stdout", &error)),
            _ => Ok(()),
        }
    }

    /// Prints JSON to stdout.
    fn say_json(&mut self, json: serde_json::Result<String>) -> Result<(), Failure> {
        self.say(&json.map_err(|error| Failure::writing("the JSON output", &error.into()))?)
    }

    /// Prints a line to stderr. A failure is ignored: it has no other place to be reported.
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

    fn manual(&mut self, folder: &Path) -> Result<u8, Failure> {
        clap_mangen::generate_to(Cli::command(), folder).map_err(|error| Failure::writing(folder.display(), &error))?;
        self.say(&format!("wrote the manual pages into {}", folder.display()))?;
        Ok(status::DONE)
    }

    /// Writes a template. `program` is the path by which the user called the program.
    fn new_scenario(&mut self, name: &str, plant: &str, folder: &Path, program: &str) -> Result<u8, Failure> {
        let name = name.strip_suffix(".toml").unwrap_or(name);
        let text = scenario::template(name, plant).ok_or_else(|| {
            bad(format!(
                "{name:?} is not a valid name: use 1 to 64 letters, digits, `_`, `-`, `.`. The file \
                     is written into the present folder"
            ))
        })?;
        let path = folder.join(format!("{name}.toml"));
        let written = whole_file::write(&path, Existing::Keep, |out| out.write_all(text.as_bytes()));
        written.map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => bad(format!("{} already exists and was not changed", path.display())),
            _ => Failure::writing(path.display(), &error),
        })?;
        self.say(&format!("wrote {0}; run it with: {program} run {0}", path.display()))?;
        Ok(status::DONE)
    }
}

/// Returns the folder of `--out`, or the default folder of a command and scenario.
fn folder_of(out: Option<&PathBuf>, scenario: &str, what: &str) -> PathBuf {
    out.cloned().unwrap_or_else(|| Path::new("out").join(format!("{scenario}-{what}")))
}

/// Creates, tests and locks an output folder. It runs before the computation, so that results are never lost.
fn claim_folder(folder: &Path) -> Result<Claim, Failure> {
    whole_file::claim(folder).map_err(|error| {
        let why = match error.kind() {
            io::ErrorKind::ResourceBusy => {
                "another run is writing there; wait until it ends, or give another folder with --out".into()
            }
            _ if folder.is_file() => "this is a file: give a folder with --out".into(),
            _ => format!("cannot be written: {error}"),
        };
        bad(format!("output folder {}: {why}", folder.display()))
    })
}

/// Writes a file that the user named. Only `--force` overwrites an existing one, and its folder must exist. Unnamed
/// files under `out/` belong to the program and are replaced.
fn write_file(path: &Path, text: &str, force: bool) -> Result<(), Failure> {
    write_bytes(path, text.as_bytes(), force)
}

fn write_bytes(path: &Path, bytes: &[u8], force: bool) -> Result<(), Failure> {
    let existing = if force { Existing::Replace } else { Existing::Keep };
    whole_file::write(path, existing, |out| out.write_all(bytes)).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => exists(path),
        _ => Failure::writing(path.display(), &error),
    })
}

/// Checks that a file can be written, before minutes of work.
fn free(path: &Path, force: bool) -> Result<(), Failure> {
    if path.is_dir() || (path.exists() && !force) {
        return Err(exists(path));
    }
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        let (path, folder, why) =
            (path.display(), folder.display(), if folder.exists() { "is no folder" } else { "does not exist" });
        return Err(bad(format!("{path}: the folder {folder} {why}")));
    }
    whole_file::may_be_made(path).map_err(|error| bad(format!("{}: cannot be written: {error}", path.display())))
}

/// Checks the path of `--to`, which never overwrites a file.
fn free_to(to: &Path) -> Result<(), Failure> {
    // A dangling symbolic link also blocks the path.
    if std::fs::symlink_metadata(to).is_ok() {
        return Err(bad(format!("{} already exists and was not changed: give another path with --to", to.display())));
    }
    free(to, false).map_err(|Failure { status, message }| Failure { status, message: format!("--to {message}") })
}

/// Writes a scenario to a path checked by [`free_to`]. A file created in the meantime stays. A scenario with a name is
/// renamed after its file: by its old name it would overwrite the results of the old file.
fn write_new(to: &Path, text: &str) -> Result<(), Failure> {
    let name = to.file_stem().map(|stem| format!("{:?}", stem.to_string_lossy()));
    let source = Source { file: "", text, sets: &[] };
    let is_named = scenario::text_at(&source, "name").is_ok_and(|name| name.is_some());
    let renamed = is_named.then(|| scenario::rewritten(text, [("name", name.as_deref())]).ok()).flatten();
    let text = renamed.as_deref().unwrap_or(text);
    whole_file::write(to, Existing::Keep, |out| out.write_all(text.as_bytes()))
        .map_err(|error| Failure::writing(to.display(), &error))
}

fn exists(path: &Path) -> Failure {
    if path.is_dir() {
        return bad(format!("{} is a folder: give the path of a file", path.display()));
    }
    bad(format!("{} already exists and was not changed; --force overwrites it", path.display()))
}

#[cfg(test)]
mod tests;
