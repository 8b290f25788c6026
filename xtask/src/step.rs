//! Step of a tier: a headline, commands or a check, a duration; the first failure ends the run.

use std::cell::OnceCell;
use std::fmt;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::built::Built;

/// Folder for the output of parallel commands.
const LOGS: &str = "target/xtask";

/// Returns the last lines of an output.
pub(crate) fn end(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(60)..].join("\n")
}

/// Reason of a failed step, and the command to repeat it.
#[derive(Debug)]
pub(crate) struct Failure {
    /// Error and remedy.
    pub(crate) reason: String,
    /// Command that repeats the step.
    pub(crate) rerun: String,
}

/// Outcome of a step or of a tier.
pub(crate) type Outcome = Result<(), Failure>;

/// State of a run.
pub(crate) struct Gate {
    /// Folder of the workspace.
    pub(crate) root: PathBuf,
    /// Headlines and durations of the passed steps.
    passed: Vec<(String, Duration)>,
    /// Omitted parts of the deep tier.
    left_out: Vec<String>,
    /// Build for the host, once a step has requested it.
    built: OnceCell<Built>,
    started: Instant,
}

impl Gate {
    pub(crate) fn new(root: PathBuf) -> Self {
        Self { root, passed: Vec::new(), left_out: Vec::new(), built: OnceCell::new(), started: Instant::now() }
    }

    /// Makes an empty folder of this name below the root.
    pub(crate) fn empty_folder(&self, folder: &str, rerun: &str) -> Outcome {
        let path = self.root.join(folder);
        let removed = if path.exists() { fs::remove_dir_all(&path) } else { Ok(()) };
        let made = removed.and_then(|()| fs::create_dir_all(&path));
        made.map_err(|error| Failure { reason: format!("{folder}: {error}"), rerun: rerun.into() })
    }

    /// Runs one step under its number and headline. A step after the build must not compile for the host again.
    pub(crate) fn step(&mut self, headline: &str, work: impl FnOnce(&Self) -> Outcome) -> Outcome {
        let number = self.passed.len() + 1;
        println!("\n[{number}] {headline}");
        let started = Instant::now();
        let is_built = self.built.get().is_some();
        work(self)?;
        if is_built {
            self.nothing_compiled()?;
        }
        let duration = started.elapsed();
        println!("[{number}] {headline}: passed in {:.1} s", duration.as_secs_f64());
        self.passed.push((headline.to_string(), duration));
        Ok(())
    }

    /// Adds an omitted part to the list at the end of the run.
    pub(crate) fn leave_out(&mut self, part: String) {
        self.left_out.push(part);
    }

    /// Returns the files of the host build. The first call builds them.
    pub(crate) fn built(&self) -> Result<&Built, Failure> {
        if let Some(built) = self.built.get() {
            return Ok(built);
        }
        let built = Built::new(self)?;
        Ok(self.built.get_or_init(|| built))
    }

    /// Fails if a workspace crate was compiled for the host since the build.
    fn nothing_compiled(&self) -> Outcome {
        let failed = |reason: String| Failure { reason, rerun: String::from("cargo xtask test") };
        let anew = self.built()?.compiled(self).map_err(failed)?;
        if anew.is_empty() {
            return Ok(());
        }
        let files = anew.join(", ");
        Err(failed(format!(
            "compiled again after the build, {} units: {files}\nrun the files of `Gate::built` instead of cargo",
            anew.len()
        )))
    }

    /// Runs commands one after the other as a step.
    pub(crate) fn commands(&mut self, headline: &str, commands: &[Invocation]) -> Outcome {
        self.step(headline, |gate| commands.iter().try_for_each(|command| command.run(gate)))
    }

    /// Runs another command of this program in parallel with `work`, which uses the terminal. The target folders
    /// differ, because cargo locks a target folder. The output goes to a log and is printed at the end.
    pub(crate) fn beside(&mut self, command: &'static str, work: impl FnOnce(&mut Self) -> Outcome) -> Outcome {
        let rerun = || format!("cargo xtask {command}");
        let failed = |error: std::io::Error| Failure { reason: format!("{command}: {error}"), rerun: rerun() };
        let started = Instant::now();
        let (mut other, path) = self.start(command, &[command]).map_err(failed)?;
        println!("\n{command} runs beside the next steps: {}", path.display());
        if let Err(failure) = work(self) {
            _ = other.kill();
            _ = other.wait();
            return Err(failure);
        }
        let status = other.wait().map_err(failed)?;
        let text = fs::read_to_string(&path).map_err(failed)?;
        println!("{text}");
        if !status.success() {
            return Err(Failure { reason: format!("{}\n{command} ended with {status}", end(&text)), rerun: rerun() });
        }
        self.passed.push((format!("{command}, beside the steps above"), started.elapsed()));
        Ok(())
    }

    /// Starts `cargo xtask` with these arguments as a process; returns it with the log of this name.
    pub(crate) fn start(&self, name: &str, arguments: &[&str]) -> std::io::Result<(Child, PathBuf)> {
        let path = self.log(name)?;
        let log = File::create(&path)?;
        let mut command = Command::new(std::env::current_exe()?);
        command.args(arguments).current_dir(&self.root).stdin(Stdio::null());
        Ok((command.stderr(log.try_clone()?).stdout(log).spawn()?, path))
    }

    /// Returns the log file of a parallel command.
    pub(crate) fn log(&self, command: &str) -> std::io::Result<PathBuf> {
        let folder = self.root.join(LOGS);
        fs::create_dir_all(&folder)?;
        Ok(folder.join(format!("{command}.log")))
    }

    /// Runs a check as a step; `check` returns one line for the report, or the error.
    pub(crate) fn check(
        &mut self,
        headline: &str,
        rerun: &str,
        check: impl FnOnce(&Self) -> Result<String, String>,
    ) -> Outcome {
        self.step(headline, |gate| match check(gate) {
            Ok(line) => {
                println!("{line}");
                Ok(())
            }
            Err(reason) => Err(Failure { reason, rerun: rerun.to_string() }),
        })
    }

    /// Prints the last lines of a run.
    pub(crate) fn conclude(&self, command: &str, outcome: &Outcome) {
        let total_s = self.started.elapsed().as_secs_f64();
        println!("\ncargo xtask {command}");
        for (number, (headline, duration)) in self.passed.iter().enumerate() {
            println!("  [{}] {headline:<66} {:>6.1} s", number + 1, duration.as_secs_f64());
        }
        match outcome {
            Ok(()) if self.left_out.is_empty() => {
                println!("  all {} steps passed in {total_s:.1} s", self.passed.len());
            }
            Ok(()) => {
                println!("  {} steps passed in {total_s:.1} s; left to `cargo xtask test --deep`:", self.passed.len());
                self.left_out.iter().for_each(|part| println!("  - {part}"));
            }
            Err(Failure { reason, rerun }) => {
                println!("  [{}] FAILED after {total_s:.1} s", self.passed.len() + 1);
                println!("{reason}\nto run it again:\n  {rerun}");
            }
        }
    }
}

/// A command line, printed so that it can be repeated by hand.
#[derive(Clone, Debug)]
pub(crate) struct Invocation {
    program: String,
    arguments: Vec<String>,
    environment: Vec<(&'static str, String)>,
}

impl Invocation {
    pub(crate) fn new(program: &str, arguments: &[&str]) -> Self {
        let arguments = arguments.iter().map(ToString::to_string).collect();
        Self { program: program.to_string(), arguments, environment: Vec::new() }
    }

    /// Returns an invocation of the cargo that started this program.
    pub(crate) fn cargo(arguments: &[&str]) -> Self {
        Self::new("cargo", arguments)
    }

    /// Excludes the packages that are internal to the workspace.
    pub(crate) fn without_own(self) -> Self {
        let own = ["integration-tests", "benches", "xtask", "loop-sim-wasm"];
        own.into_iter().fold(self, |invocation, name| invocation.with(&["--exclude", name]))
    }

    pub(crate) fn with(mut self, arguments: &[&str]) -> Self {
        self.arguments.extend(arguments.iter().map(ToString::to_string));
        self
    }

    pub(crate) fn env(mut self, name: &'static str, value: &str) -> Self {
        self.environment.push((name, value.to_string()));
        self
    }

    pub(crate) fn command(&self) -> Command {
        let running_cargo = std::env::var_os("CARGO").filter(|_| self.program == "cargo");
        let mut command = Command::new(running_cargo.unwrap_or_else(|| self.program.clone().into()));
        command.args(&self.arguments).envs(self.environment.iter().map(|(name, value)| (name, value)));
        // `cargo run` sets this variable for one compiler's libraries; a second compiler must not use it.
        command.env_remove("LD_LIBRARY_PATH");
        command
    }

    /// Runs the command in the workspace and shows its output as it arrives.
    pub(crate) fn run(&self, gate: &Gate) -> Outcome {
        println!("$ {self}");
        let failed = |reason: String| Failure { reason, rerun: self.to_string() };
        match self.command().current_dir(&gate.root).status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(failed(format!("the command ended with {status}"))),
            Err(error) => Err(failed(format!("the command could not be started: {error}"))),
        }
    }

    /// Returns the output on both streams, whatever the exit status.
    pub(crate) fn output(&self, gate: &Gate) -> std::io::Result<String> {
        let output = self.command().current_dir(&gate.root).output()?;
        Ok([output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat())
    }

    /// Returns the output, if the command starts and succeeds.
    pub(crate) fn answer(&self) -> Option<String> {
        Self::said(self.command())
    }

    /// Returns the output in the workspace, if the command starts and succeeds.
    pub(crate) fn answer_in(&self, gate: &Gate) -> Option<String> {
        let mut command = self.command();
        command.current_dir(&gate.root);
        Self::said(command)
    }

    fn said(mut command: Command) -> Option<String> {
        let output = command.output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_string())
    }
}

impl fmt::Display for Invocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in &self.environment {
            write!(f, "{name}={} ", quoted(value))?;
        }
        write!(f, "{}", self.program)?;
        self.arguments.iter().try_for_each(|argument| write!(f, " {}", quoted(argument)))
    }
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.to_string() } else { format!("'{word}'") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invocation_prints_as_a_line_that_a_shell_repeats() {
        let line = Invocation::cargo(&["doc", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings").with(&["-p", "x"]);
        assert_eq!(line.to_string(), "RUSTDOCFLAGS='-D warnings' cargo doc --no-deps -p x");
    }

    #[test]
    fn a_failed_step_ends_the_run_and_is_not_counted_as_passed() {
        let mut gate = Gate::new(PathBuf::from("."));
        assert!(gate.check("good", "again", |_| Ok(String::from("fine"))).is_ok());
        let failure = gate.check("bad", "again", |_| Err(String::from("broken"))).expect_err("the check failed");
        assert_eq!((failure.reason.as_str(), failure.rerun.as_str()), ("broken", "again"));
        assert_eq!(gate.passed.len(), 1);
    }
}
