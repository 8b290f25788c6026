//! `tick-proof`: is it true for every input? The page of the library says what is asked.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use host_sim::export::{self, Form, Functions};
use scenario::{Experiment, Source};
use tick_proof::faults::{FAULTS, Fault};
use tick_proof::instances::ALL;
use tick_proof::run::{self, Job, Row};
use tick_proof::solver::Solver;
use tick_proof::{certificate, statements};
use whole_file::{Existing, Kind};

/// Proves statements about a controller or a drive for every input. Without a scenario: what must be proved of the
/// instances that are shipped, and that faults put in on purpose are noticed.
#[derive(Parser, Debug)]
struct Options {
    /// A scenario of your own: what its exported C file computes.
    scenario: Option<PathBuf>,
    /// Override a key, as in --set controller.k_l=100.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scenario")]
    sets: Vec<String>,
    /// Write what was proved of the file that `host-sim export --standalone` makes of the scenario, with its SHA-256.
    #[arg(long, value_name = "FILE", requires = "scenario")]
    certificate: Option<PathBuf>,
    /// What the names in that file begin with.
    #[arg(long, value_name = "NAME", default_value = export::PREFIX, requires = "certificate")]
    prefix: String,
    /// Try all shipped instances, not only those that must be proved.
    #[arg(long, conflicts_with = "scenario")]
    all: bool,
    /// Only instances and faults whose name has this in it.
    #[arg(long, value_name = "TEXT", conflicts_with = "scenario")]
    only: Option<String>,
    /// Seconds for one question to the solver.
    #[arg(long, value_name = "S", default_value_t = 120)]
    budget: u64,
    /// The Python that has the solver Bitwuzla.
    #[arg(long, value_name = "PATH")]
    python: Option<PathBuf>,
}

fn main() -> ExitCode {
    match prove(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

fn prove(options: &Options) -> Result<bool, String> {
    let solver = Solver::bitwuzla(options.python.as_deref())?;
    let budget = Duration::from_secs(options.budget);
    match &options.scenario {
        Some(path) => of_scenario(path, options, &solver, budget),
        None => of_shipped(options, &solver, budget),
    }
}

/// Jobs about one instance.
fn jobs(name: &str, functions: &Functions) -> Vec<Job> {
    let of = |statement| Job { instance: name.into(), statement };
    statements(functions).into_iter().map(of).collect()
}

fn of_shipped(options: &Options, solver: &Solver, budget: Duration) -> Result<bool, String> {
    let is_asked = |name: &str| options.only.as_ref().is_none_or(|only| name.contains(only.as_str()));
    let (mut asked, mut must) = (Vec::new(), Vec::new());
    for instance in ALL.iter().filter(|instance| (options.all || instance.must) && is_asked(instance.name)) {
        for job in jobs(instance.name, &instance.functions()?) {
            asked.push(job);
            must.push(instance.must);
        }
    }
    let proved = listed(&asked, solver, budget)?;
    let unproved = proved.iter().zip(&must).filter(|(row, must)| **must && !row.is_proved()).count();
    let faults: Vec<_> = FAULTS.iter().filter(|fault| is_asked(fault.name)).collect();
    let broken = |at_rest: bool, faults: &[&Fault]| -> Result<Vec<Job>, String> {
        let job = |fault: &&Fault| Ok(Job { instance: fault.name.into(), statement: fault.statement(at_rest)? });
        faults.iter().map(job).collect()
    };
    say("\nFaults put in on purpose: none may be proved. Of a state of zeros first, where a refutation is one too.")?;
    let at_rest = listed(&broken(true, &faults)?, solver, budget)?;
    let open: Vec<&Fault> =
        faults.iter().zip(&at_rest).filter(|(_, row)| row.is_proved()).map(|(fault, _)| *fault).collect();
    let missed = if open.is_empty() {
        0
    } else {
        say("\nOf any state:")?;
        listed(&broken(false, &open)?, solver, budget)?.iter().filter(|row| row.is_proved()).count()
    };
    let questions: usize = proved.iter().map(|row| row.asked).sum();
    say(&format!(
        "\n{} of {} statements proved by {} in {questions} questions; {} of {} faults noticed",
        proved.iter().filter(|row| row.is_proved()).count(),
        proved.len(),
        solver.name(),
        faults.len() - missed,
        faults.len(),
    ))?;
    if unproved > 0 {
        say(&format!("{unproved} of the statements that must be proved are not"))?;
    }
    Ok(unproved == 0 && missed == 0)
}

fn of_scenario(path: &Path, options: &Options, solver: &Solver, budget: Duration) -> Result<bool, String> {
    let file = path.display().to_string();
    let text = whole_file::read_text(path, Kind::SETTINGS).map_err(|message| format!("{file}: {message}"))?;
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let source = Source { file: &file, text: &text, sets: &options.sets };
    let experiment: Experiment = scenario::parse_own(&source, &stem).map_err(|error| error.to_string())?;
    let functions = export::functions(&experiment).map_err(|why| format!("{file}: {why}"))?;
    let rows = listed(&jobs(&experiment.name, &functions), solver, budget)?;
    let all = rows.iter().all(Row::is_proved);
    if let Some(certificate) = &options.certificate {
        // As `export` has it: the path of a file is of this machine only.
        let name = path.file_name().map(|name| name.to_string_lossy());
        let source = Source { file: name.as_deref().unwrap_or(&file), ..source };
        let exported = export::text(&experiment, &source, Form::Standalone(&options.prefix))?;
        let text = certificate::text(&exported, &experiment.title, &rows, solver.name());
        whole_file::write(certificate, Existing::Replace, |to| to.write_all(text.as_bytes()))
            .map_err(|error| format!("{}: {error}", certificate.display()))?;
        say(&format!("wrote {}", certificate.display()))?;
    }
    Ok(all)
}

/// Asks, and shows a line for each as it comes.
fn listed(jobs: &[Job], solver: &Solver, budget: Duration) -> Result<Vec<Row>, String> {
    let wide = |of: &dyn Fn(&Job) -> usize, name: &str| jobs.iter().map(of).max().unwrap_or(0).max(name.len());
    let instance = wide(&|job| job.instance.chars().count(), "instance");
    let statement = wide(&|job| job.statement.name.chars().count(), "statement");
    say(&format!(
        "{:instance$}  {:statement$}  {:9}  {:>9}  {:>7}",
        "instance", "statement", "verdict", "questions", "seconds"
    ))?;
    run::all(jobs, solver, budget, &|row| {
        let Row { instance: name, statement: claim, verdict, asked, seconds, .. } = row;
        let line = format!("{name:instance$}  {claim:statement$}  {verdict:9}  {asked:>9}  {seconds:>7.1}");
        let lines: Vec<String> =
            [line].into_iter().chain(row.details().iter().map(|detail| format!("    {detail}"))).collect();
        // A reader that has gone away is told at the end.
        let _ = say(&lines.join("\n"));
    })
}

fn say(line: &str) -> Result<(), String> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).map_err(|error| format!("stdout cannot be written: {error}"))
}
