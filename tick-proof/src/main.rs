//! `tick-proof`: proves statements about ticks for every input. The library page describes the statements.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use tick_proof::faults::{FAULTS, Fault};
use tick_proof::instances::ALL;
use tick_proof::page;
use tick_proof::run::{self, Job, Row};
use tick_proof::solver::{Solver, Which};
use whole_file::{Existing, FileKind};

/// Prove statements about the shipped ticks for every input, and check that injected faults are detected. For a
/// scenario of your own: host-sim export FILE.toml --standalone --certificate.
#[derive(Parser, Debug)]
struct Options {
    /// Try all shipped instances, not only those that must be proved.
    #[arg(long)]
    all: bool,
    /// Only the instance of this name, otherwise instances and faults whose name contains TEXT.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Write the table of instances into this page.
    #[arg(long, value_name = "FILE", requires = "all")]
    page: Option<PathBuf>,
    /// Computing time per query, s.
    #[arg(long, value_name = "S", default_value_t = 120)]
    budget: u64,
    /// Solver.
    #[arg(long, value_enum, default_value = "bitwuzla")]
    solver: Which,
    /// Python interpreter with the solver.
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
    let solver = &Solver::find(options.solver, options.python.as_deref())?;
    let budget = Duration::from_secs(options.budget);
    // An exact name, otherwise a part of a name.
    let is_one = |name: &&str| ALL.iter().any(|instance| instance.name == *name);
    let exact = options.only.as_deref().filter(is_one);
    let is_asked = |name: &str| match (exact, &options.only) {
        (Some(exact), _) => name == exact,
        (None, only) => only.as_ref().is_none_or(|only| name.contains(only.as_str())),
    };
    let (mut asked, mut must) = (Vec::new(), Vec::new());
    for instance in ALL.iter().filter(|instance| (options.all || instance.must) && is_asked(instance.name)) {
        for job in run::jobs(instance.name, &(instance.functions)()) {
            asked.push(job);
            must.push(instance.must);
        }
    }
    let proved = listed(&asked, solver, budget)?;
    if let Some(page) = &options.page {
        let told = |error: &dyn std::fmt::Display| format!("{}: {error}", page.display());
        let text = whole_file::read_text(page, FileKind::SETTINGS).map_err(|error| told(&error))?;
        let text = page::with_table(&text, &proved).map_err(|error| told(&error))?;
        whole_file::write(page, Existing::Replace, |to| to.write_all(text.as_bytes())).map_err(|error| told(&error))?;
        say(&format!("wrote the table of {}", page.display()))?;
    }
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

/// Runs the jobs and prints a line for each result.
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
        // A closed output is reported at the end.
        let _ = say(&lines.join("\n"));
    })
}

fn say(line: &str) -> Result<(), String> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).map_err(|error| format!("stdout cannot be written: {error}"))
}
