//! Solvers as separate programs: SMT-LIB in, a verdict out, killed after their time limit.

use std::fmt;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Python program that runs the module of a solver. The limit is computing time, so that a busy machine proves as much
/// as an idle one. Where computing time cannot be limited, the clock is.
macro_rules! asking {
    ($($line:literal)*) => {
        concat!(
            "import sys, time\n\
             try:\n    \
                 import resource\n    \
                 resource.setrlimit(resource.RLIMIT_CPU, 2 * (int(sys.argv[1]),))\n\
             except ImportError:\n    \
                 pass\n",
            $($line, "\n",)*
            "sys.stdout.flush()\nprint(time.process_time(), file=sys.stderr)\n"
        )
    };
}

const BITWUZLA: &str = asking! {
    "import bitwuzla"
    "options = bitwuzla.Options()"
    "options.set(bitwuzla.Option.PRODUCE_MODELS, True)"
    "parser = bitwuzla.Parser(bitwuzla.TermManager(), options, base=2)"
    "parser.parse(sys.stdin.read(), parse_file=False)"
};

const CVC5: &str = asking! {
    "import cvc5"
    "solver = cvc5.Solver(cvc5.TermManager())"
    "parser = cvc5.InputParser(solver)"
    "parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, sys.stdin.read(), 'question')"
    "command = parser.nextCommand()"
    "while not command.isNull():"
    "    answer = command.invoke(solver, parser.getSymbolManager())"
    "    print(answer, end='')"
    "    if answer.strip() == 'unsat': break"
    "    command = parser.nextCommand()"
};

/// The solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Which {
    /// Solver for the proofs.
    Bitwuzla,
    /// Second solver for comparison; slower here.
    Cvc5,
}

/// Limit of the wall-clock time of a solver, as a multiple of its computing time.
const SHARED: u32 = 20;
/// Python interpreter that `cargo xtask prove` installs.
const INSTALLED: &str = "target/solvers/bin/python";

/// An installed solver.
#[derive(Clone, Debug)]
pub struct Solver {
    program: PathBuf,
    arguments: Vec<String>,
    name: String,
}

/// Result of a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The claim holds for every input.
    Proved,
    /// The claim fails for these values: names and SMT-LIB terms.
    Refuted(Vec<(String, String)>),
    /// There was no answer within the time limit, or none at all, with the reason.
    Undecided(String),
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Proved => "PROVED",
            Self::Refuted(_) => "refuted",
            Self::Undecided(_) => "undecided",
        })
    }
}

impl Solver {
    /// Returns the first interpreter that has the solver: the given one, the one that `cargo xtask prove` installs, or
    /// `python3`.
    ///
    /// # Errors
    /// If no interpreter has the solver; the message contains the remedy.
    pub fn find(which: Which, asked: Option<&Path>) -> Result<Self, String> {
        let (name, version, program) = match which {
            Which::Bitwuzla => ("Bitwuzla", "import bitwuzla; print(bitwuzla.version())", BITWUZLA),
            Which::Cvc5 => ("cvc5", "import cvc5; print(cvc5.__version__)", CVC5),
        };
        let tried: Vec<PathBuf> = match asked {
            Some(python) => vec![python.into()],
            None => vec![INSTALLED.into(), "python3".into()],
        };
        for python in &tried {
            let answer = Command::new(python).args(["-c", version]).stderr(Stdio::null()).output();
            if let Some(answer) = answer.ok().filter(|answer| answer.status.success()) {
                let version = String::from_utf8_lossy(&answer.stdout).trim().to_string();
                let arguments = vec!["-c".into(), program.into()];
                return Ok(Self { program: python.clone(), arguments, name: format!("{name} {version}") });
            }
        }
        let tried: Vec<String> = tried.iter().map(|python| python.display().to_string()).collect();
        Err(format!(
            "no Python here has the solver {name} (asked: {}): `pip install {}` into one and name it by --python PATH, \
             or let `cargo xtask prove` install Bitwuzla",
            tried.join(", "),
            name.to_lowercase(),
        ))
    }

    /// Returns the name and version.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Runs a query with a limit of computing time. Returns the verdict and the computing time, s.
    ///
    /// # Errors
    /// If the solver cannot be started.
    pub fn ask(&self, question: &str, budget: Duration) -> Result<(Verdict, f64), String> {
        let cannot = |error: std::io::Error| format!("{}: {error}", self.program.display());
        let mut child = Command::new(&self.program)
            .args(&self.arguments)
            // The solver also ends by itself if this program is killed first.
            .arg(budget.as_secs().to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(cannot)?;
        let (input, output, trouble) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let ended = thread::scope(|scope| {
            scope.spawn(move || {
                // A solver that has ended stops reading; its answer gives the reason.
                if let Some(mut input) = input {
                    let _ = input.write_all(question.as_bytes());
                }
            });
            let text = scope.spawn(move || read(output));
            let trouble = scope.spawn(move || read(trouble));
            let in_time = wait(&mut child, SHARED * budget);
            (in_time, text.join().unwrap_or_default(), trouble.join().unwrap_or_default())
        });
        let (in_time, text, trouble) = ended;
        let late = || Verdict::Undecided(format!("no answer within {} s", budget.as_secs()));
        // The last line is the time. A killed solver prints none and used the whole budget.
        let took = trouble.lines().next_back().map_or(Ok(budget.as_secs_f64()), str::parse).unwrap_or(0.0);
        let verdict = match text.lines().next().map(str::trim) {
            _ if !in_time => late(),
            Some("unsat") => Verdict::Proved,
            Some("sat") => Verdict::Refuted(values(text.split_once('\n').map_or("", |(_, rest)| rest))),
            Some("unknown") => late(),
            // The time limit ended the solver without output.
            None if trouble.is_empty() => late(),
            _ => Verdict::Undecided(format!("the solver said: {}", [text, trouble].concat().trim())),
        };
        Ok((verdict, took))
    }
}

fn read(from: Option<impl Read>) -> String {
    let mut text = String::new();
    if let Some(mut from) = from {
        let _ = from.read_to_string(&mut text);
    }
    text
}

/// Returns whether the child ended in time, and kills it otherwise.
fn wait(child: &mut Child, budget: Duration) -> bool {
    let end = Instant::now() + budget;
    loop {
        match child.try_wait() {
            Ok(Some(_)) => return true,
            Ok(None) if Instant::now() < end => thread::sleep(Duration::from_millis(5)),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return false;
            }
        }
    }
}

/// Returns the names and terms of an answer to `get-value`.
fn values(text: &str) -> Vec<(String, String)> {
    let (mut found, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, c) in text.char_indices() {
        match c {
            '(' => {
                depth += 1;
                if depth == 2 {
                    start = at + 1;
                }
            }
            ')' => {
                if depth == 2
                    && let Some((name, term)) = text[start..at].trim().split_once(char::is_whitespace)
                {
                    found.push((name.into(), plain(term.trim())));
                }
                depth -= 1;
            }
            _ => {}
        }
    }
    found
}

/// Returns a value in plain notation.
fn plain(term: &str) -> String {
    let words: Vec<&str> =
        term.split(|c: char| c.is_whitespace() || c == '(' || c == ')').filter(|w| !w.is_empty()).collect();
    match words.as_slice() {
        ["fp", sign, exponent, significand] => {
            let bits: String = [sign, exponent, significand].iter().map(|part| part.trim_start_matches("#b")).collect();
            u32::from_str_radix(&bits, 2).map_or_else(|_| term.into(), |bits| format!("{:e}", f32::from_bits(bits)))
        }
        ["_", "NaN", ..] => "NaN".into(),
        ["_", "+oo", ..] => "inf".into(),
        ["_", "-oo", ..] => "-inf".into(),
        ["_", "+zero", ..] => "0".into(),
        ["_", "-zero", ..] => "-0".into(),
        [bits] if bits.starts_with("#b") => {
            u32::from_str_radix(&bits[2..], 2).map_or_else(|_| term.into(), |bits| (bits as i32).to_string())
        }
        _ => term.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_example_is_read_as_plain_numbers() {
        let text = "((x1 (fp #b1 #b01111111 #b10000000000000000000000))\n (on true)\n\
                    (n #b11111111111111111111111111111110)\n (y (_ NaN 8 24)))\n";
        let pairs = values(text);
        let expected = [("x1", "-1.5e0"), ("on", "true"), ("n", "-2"), ("y", "NaN")];
        assert_eq!(pairs, expected.map(|(name, value)| (name.to_string(), value.to_string())));
    }
}
