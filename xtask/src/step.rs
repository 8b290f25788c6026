//! A step of a tier: a headline, commands or a check, a duration; the first failure ends the run.

use std::cell::OnceCell;
use std::fmt;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::built::Built;

/// Output of what runs beside something else.
const LOGS: &str = "target/xtask";

/// The last lines of an output.
pub(crate) fn end(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(60)..].join("\n")
}

/// Why a step failed, and what to run to see it again.
#[derive(Debug)]
pub(crate) struct Failure {
    /// What is wrong and what to do about it.
    pub(crate) reason: String,
    /// The command that repeats it.
    pub(crate) rerun: String,
}

/// Of a step or of all of them.
pub(crate) type Outcome = Result<(), Failure>;

/// The run so far.
pub(crate) struct Gate {
    /// The folder of the workspace.
    pub(crate) root: PathBuf,
    /// Headlines and durations of the steps that passed.
    passed: Vec<(String, Duration)>,
    /// Parts of the deep tier that this run leaves out.
    left_out: Vec<String>,
    /// The build of the host, once a step has asked for it.
    built: OnceCell<Built>,
    started: Instant,
}

impl Gate {
    pub(crate) fn new(root: PathBuf) -> Self {
        Self { root, passed: Vec::new(), left_out: Vec::new(), built: OnceCell::new(), started: Instant::now() }
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

    /// Lists at the end a part that this run leaves out.
    pub(crate) fn leave_out(&mut self, part: String) {
        self.left_out.push(part);
    }

    /// The files of the build of the host. The first call builds them.
    pub(crate) fn built(&self) -> Result<&Built, Failure> {
        if let Some(built) = self.built.get() {
            return Ok(built);
        }
        let built = Built::new(self)?;
        Ok(self.built.get_or_init(|| built))
    }

    /// Fails if anything of ours was compiled for the host since the build.
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

    /// A step that runs commands one after the other.
    pub(crate) fn commands(&mut self, headline: &str, commands: &[Invocation]) -> Outcome {
        self.step(headline, |gate| commands.iter().try_for_each(|command| command.run(gate)))
    }

    /// Runs another command of ours beside this work, which has the terminal: cargo waits for itself in one target
    /// folder, and the folders differ. Its output is in a log, and follows.
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

    /// Starts `cargo xtask` with these arguments as a process of its own; it, and the log of this name that it writes.
    pub(crate) fn start(&self, name: &str, arguments: &[&str]) -> std::io::Result<(Child, PathBuf)> {
        let path = self.log(name)?;
        let log = File::create(&path)?;
        let mut command = Command::new(std::env::current_exe()?);
        command.args(arguments).current_dir(&self.root).stdin(Stdio::null());
        Ok((command.stderr(log.try_clone()?).stdout(log).spawn()?, path))
    }

    /// Where a command that runs beside others writes.
    pub(crate) fn log(&self, command: &str) -> std::io::Result<PathBuf> {
        let folder = self.root.join(LOGS);
        fs::create_dir_all(&folder)?;
        Ok(folder.join(format!("{command}.log")))
    }

    /// A step that looks at something itself; `check` returns one line for the report, or what is wrong.
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

    /// The last lines of a run.
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

/// One command line; prints itself so that a person can repeat it.
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

    /// cargo, the one that runs us.
    pub(crate) fn cargo(arguments: &[&str]) -> Self {
        Self::new("cargo", arguments)
    }

    /// Without the packages that no user takes.
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
        // Set by `cargo run` for the libraries of one compiler; a second compiler must not see them.
        command.env_remove("LD_LIBRARY_PATH");
        command
    }

    /// Runs in the workspace with its output shown as it comes.
    pub(crate) fn run(&self, gate: &Gate) -> Outcome {
        println!("$ {self}");
        let failed = |reason: String| Failure { reason, rerun: self.to_string() };
        match self.command().current_dir(&gate.root).status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(failed(format!("the command ended with {status}"))),
            Err(error) => Err(failed(format!("the command could not be started: {error}"))),
        }
    }

    /// What it prints on both streams, however it ends.
    pub(crate) fn output(&self, gate: &Gate) -> std::io::Result<String> {
        let output = self.command().current_dir(&gate.root).output()?;
        Ok([output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat())
    }

    /// What it prints, if it can be started and succeeds.
    pub(crate) fn answer(&self) -> Option<String> {
        Self::said(self.command())
    }

    /// The same in the workspace.
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
