//! The two tiers of tests.
//!
//! `cargo xtask test` is the fast tier: checks for everyday changes, in CI and before a commit.
//! `cargo xtask test --deep` runs the full sizes, in parts that run two at a time. A long test selects its size from
//! the variable [`DEEP`].

use std::fs;
use std::process::Child;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::step::{Failure, Gate, Invocation, Outcome, end};
use crate::{
    attack, bench, budget, capi, cluster, docs, evidence, firmware, first, fmu, fuzz, means, mutate, packages,
    paper_map, prose, prove, sbom, scan, setup, thumb, wasm, web, wheel,
};

/// Variable that makes a test run at its full size.
const DEEP: &str = "DEEP";

/// Features of controller-core: none, and all.
const FEATURES: [&str; 2] = ["", "analysis,defmt,serde"];

/// A part of the deep tier.
struct Part {
    name: &'static str,
    holds: &'static str,
    run: fn(&mut Gate) -> Outcome,
}

/// Parts of the deep tier, longest first, so that the last ones fill both cores.
const PARTS: [Part; 13] = [
    Part { name: "shapes", holds: "every test at full size, lanes of every configuration", run: shapes },
    Part { name: "machine", holds: "machine code of library, exported C and assembly against the tick", run: machine },
    Part { name: "mutation", holds: "symbols of the paper broken deliberately", run: mutate::run },
    Part { name: "first", holds: "the default features: first commands, left-out commands", run: first::run },
    Part { name: "python", holds: "the wheel in a fresh environment, against host-sim; notebooks", run: wheel::run },
    Part { name: "web", holds: "the live page: bits, C file, size, clicks in a browser", run: web::test },
    Part { name: "wasm", holds: "the loop in WebAssembly, bit for bit", run: wasm::run },
    Part { name: "random", holds: "a minute of random campaigns, libFuzzer on the serial protocol", run: random },
    Part { name: "proofs", holds: "statements about every input, a certificate", run: prove::run },
    Part {
        name: "cores",
        holds: "controller-core by features, linted and for the chip, C libraries from two folders",
        run: cores,
    },
    Part {
        name: "papers",
        holds: "MISRA and analysers on exported C, bills of materials, a cluster, Parquet",
        run: papers,
    },
    Part { name: "packages", holds: "CMake, pkg-config, Conan, Arduino, strict C++, an RTOS task", run: packages::run },
    Part { name: "fmu", holds: "FMUs of controllers and plants in FMPy, against host-sim", run: fmu::run },
];

/// File with the commit at which each part last passed completely, for information only.
const RECORD: &str = "tests/deep.toml";
const RECORD_HEAD: &str = "# The commit at which each part of the deep tier last passed whole.\n\
                           # `cargo xtask test --deep [PART]` writes this file; CONTRIBUTING.md says when to run it.\n";
/// Argument of parts started by the whole run: the images and libraries are built already.
const PREPARED: &str = "--prepared";

/// Runs the fast tier, cheapest steps first. The chip builds have separate target folders and run in parallel with the
/// host build. The checks of built files run in parallel with the tests.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let all = |gate: &mut Gate, steps: &[fn(&mut Gate) -> Outcome]| steps.iter().try_for_each(|step| step(gate));
    all(gate, &[setup::run, format, scan, paper_map::run, prose::run])?;
    gate.beside(CHIP, |gate| all(gate, &[pack, lint, docs::run, build]))?;
    gate.beside(JUDGE, |gate| {
        tests(gate, "tests", &[])?;
        examples(gate)
    })?;
    for part in &PARTS {
        gate.leave_out(format!("{:<9} {}", part.name, part.holds));
    }
    Ok(())
}

/// Command that lints and builds for the chip.
pub(crate) const CHIP: &str = "chip";

pub(crate) fn chip(gate: &mut Gate) -> Outcome {
    firmware::lint(gate)?;
    firmware::without_assembly(gate)?;
    capi::lint(gate)?;
    capi::run(gate, capi::Cores::Emulated)
}

/// Command that checks the built files.
pub(crate) const JUDGE: &str = "judge";

pub(crate) fn judge(gate: &mut Gate) -> Outcome {
    means::judge(gate, means::Extent::Image)?;
    budget::judge(gate)?;
    bench::count_on_host(gate)
}

/// Runs the deep tier: the parts named on the command line, or all.
pub(crate) fn deep(gate: &mut Gate) -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(3).collect();
    let is_prepared = arguments.iter().any(|argument| argument == PREPARED);
    let names: Vec<&str> = arguments.iter().map(String::as_str).filter(|name| *name != PREPARED).collect();
    let parts = chosen(&names)?;
    if !is_prepared {
        setup::run(gate)?;
        build(gate)?;
        firmware::run(gate)?;
        capi::run(gate, capi::Cores::All)?;
    }
    if let [part] = parts[..] {
        let started = Instant::now();
        (part.run)(gate)?;
        return if is_prepared { Ok(()) } else { record(gate, part, started.elapsed()) };
    }
    side_by_side(gate, &parts)
}

/// Returns the parts with these names, or all parts without a name.
fn chosen(names: &[&str]) -> Result<Vec<&'static Part>, Failure> {
    let part = |name: &&str| {
        PARTS.iter().find(|part| part.name == *name).ok_or_else(|| {
            let nearest = PARTS.iter().map(|part| part.name).min_by_key(|part| strsim::damerau_levenshtein(name, part));
            let all: Vec<&str> = PARTS.iter().map(|part| part.name).collect();
            let reason = format!("unknown part `{name}` of the deep tier; the parts are {}", all.join(", "));
            Failure { reason, rerun: format!("cargo xtask test --deep {}", nearest.unwrap_or_default()) }
        })
    };
    if names.is_empty() { Ok(PARTS.iter().collect()) } else { names.iter().map(part).collect() }
}

/// A part that runs as a process.
struct Running {
    part: &'static Part,
    process: Child,
    started: Instant,
}

/// Runs parts two at a time, each into its own log; the first failure ends the others.
fn side_by_side(gate: &mut Gate, parts: &[&'static Part]) -> Outcome {
    gate.step("parts of the deep tier, two at a time", |gate| {
        let (mut waiting, mut running) = (parts.iter(), Vec::new());
        let mut outcome = Ok(());
        loop {
            while outcome.is_ok() && running.len() < 2 {
                let Some(part) = waiting.next() else { break };
                running.push(start(gate, part)?);
            }
            if running.is_empty() {
                return outcome;
            }
            thread::sleep(Duration::from_millis(200));
            let mut k = 0;
            while k < running.len() {
                match finished(gate, &mut running[k]) {
                    None => k += 1,
                    Some(ended) => {
                        running.swap_remove(k);
                        if ended.is_err() && outcome.is_ok() {
                            for other in &mut running {
                                _ = other.process.kill();
                            }
                            outcome = ended;
                        }
                    }
                }
            }
        }
    })
}

fn start(gate: &Gate, part: &'static Part) -> Result<Running, Failure> {
    let failed = |error: std::io::Error| Failure { reason: format!("{}: {error}", part.name), rerun: rerun(part) };
    let started = Instant::now();
    let (process, path) = gate.start(part.name, &["test", "--deep", part.name, PREPARED]).map_err(failed)?;
    println!("{:<9} started: {}", part.name, path.display());
    Ok(Running { part, process, started })
}

/// Returns the outcome of a part, or `None` while it runs.
fn finished(gate: &Gate, running: &mut Running) -> Option<Outcome> {
    let Running { part, process, started } = running;
    let failed = |reason: String| Some(Err(Failure { reason, rerun: rerun(part) }));
    match process.try_wait() {
        Ok(None) => None,
        Ok(Some(status)) if status.success() => {
            println!("{:<9} passed in {:.0} s", part.name, started.elapsed().as_secs_f64());
            Some(record(gate, part, started.elapsed()))
        }
        Ok(Some(status)) => {
            let text = gate.log(part.name).and_then(fs::read_to_string).unwrap_or_default();
            failed(format!("{}\n{} ended with {status}", end(&text), part.name))
        }
        Err(error) => failed(format!("{}: {error}", part.name)),
    }
}

fn rerun(part: &Part) -> String {
    format!("cargo xtask test --deep {}", part.name)
}

/// Writes the commit at which a part passed into [`RECORD`].
fn record(gate: &Gate, part: &Part, took: Duration) -> Outcome {
    let failed = |reason: String| Failure { reason, rerun: rerun(part) };
    let git = |arguments: &[&str]| Invocation::new("git", arguments).answer_in(gate);
    let commit = git(&["rev-parse", "--short=10", "HEAD"]).unwrap_or_else(|| "no commit".into());
    // Changes of the record itself do not count.
    let changes = git(&["status", "--porcelain", "--untracked-files=no", "--", ".", &format!(":!{RECORD}")]);
    let state = if changes.is_some_and(|changes| changes.is_empty()) { "" } else { " with changes" };
    let path = gate.root.join(RECORD);
    let before = fs::read_to_string(&path).unwrap_or_default();
    let line = format!("{} = {{ commit = \"{commit}{state}\", seconds = {:.0} }}", part.name, took.as_secs_f64());
    fs::write(&path, with(&before, part.name, &line)).map_err(|error| failed(format!("{RECORD}: {error}")))
}

/// Returns the record with a new line for a part, in the order of [`PARTS`].
fn with(before: &str, name: &str, line: &str) -> String {
    let lines: Vec<&str> = PARTS
        .iter()
        .filter_map(|part| {
            let old = || before.lines().find(|line| line.split(" = ").next() == Some(part.name));
            if part.name == name { Some(line) } else { old() }
        })
        .collect();
    format!("{RECORD_HEAD}{}\n", lines.join("\n"))
}

fn format(gate: &mut Gate) -> Outcome {
    gate.commands("format", &[Invocation::cargo(&["fmt", "--all", "--check"])])
}

fn scan(gate: &mut Gate) -> Outcome {
    gate.check("no disabled test, no unfinished code", "cargo xtask test", |gate| scan::check(&gate.root))
}

/// Option that turns warnings into errors.
const DENY: [&str; 3] = ["--", "-D", "warnings"];

fn lint(gate: &mut Gate) -> Outcome {
    let clippy = Invocation::cargo(&["clippy", "--workspace", "--lib", "--bins", "--tests", "--benches"]).with(&DENY);
    gate.commands("lints, whole workspace", &[clippy])
}

/// Lints every other feature set of the core, and the image that measures other code.
fn lint_rest(gate: &mut Gate) -> Outcome {
    let of_set = |features: &&str| {
        Invocation::cargo(&["clippy", "-p", "controller-core", "--lib", "--no-default-features", "--features"])
            .with(&[features])
            .with(&DENY)
    };
    let core: Vec<Invocation> = FEATURES.iter().map(of_set).collect();
    gate.commands("lints, controller-core, no feature and all features", &core)?;
    bench::lint(gate)
}

/// Packs the crates for users. Building each package from its sources needs `cargo package` without `--no-verify`,
/// which compiles all dependencies again.
fn pack(gate: &mut Gate) -> Outcome {
    let pack = Invocation::cargo(&["package", "--quiet", "--workspace", "--no-verify", "--allow-dirty"]).without_own();
    gate.commands("packages of the crates for users", &[pack])
}

fn build(gate: &mut Gate) -> Outcome {
    gate.step("programs and tests, built once", |gate| {
        println!("{} test programs", gate.built()?.tests.len());
        Ok(())
    })
}

/// Runs every test program, two at a time, since some wait for others; lists all failures together.
fn tests(gate: &mut Gate, headline: &str, environment: &[(&str, &str)]) -> Outcome {
    gate.step(headline, |gate| {
        let tests = &gate.built()?.tests;
        let (next, failures) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || {
            while let Some(test) = tests.get(next.fetch_add(1, Ordering::Relaxed)) {
                let failure = test.run(environment).err();
                failures.lock().unwrap_or_else(PoisonError::into_inner).extend(failure);
            }
        };
        thread::scope(|scope| (0..2).for_each(|_| drop(scope.spawn(work))));
        let failures = failures.into_inner().unwrap_or_else(PoisonError::into_inner);
        let reasons: Vec<&str> = failures.iter().map(|failure| failure.reason.as_str()).collect();
        let reason = reasons.join("\n");
        failures.into_iter().next().map_or(Ok(()), |first| Err(Failure { reason, rerun: first.rerun }))
    })
}

fn shapes(gate: &mut Gate) -> Outcome {
    tests(gate, "tests at full size", &[(DEEP, "1")])?;
    let lanes = Invocation::cargo(&["clippy", "--workspace", "--test", "every_lane"]).with(&DENY);
    gate.commands("lints, lanes of every configuration", &[lanes])?;
    gate.commands(
        "lanes of every configuration",
        &[Invocation::cargo(&["test", "--workspace", "--test", "every_lane"])],
    )
}

/// Runs the code blocks of the documentation, with the libraries of the build, as `gate` checks.
fn examples(gate: &mut Gate) -> Outcome {
    gate.commands("examples in the documentation", &[Invocation::cargo(&["test", "--workspace", "--doc"])])
}

fn machine(gate: &mut Gate) -> Outcome {
    means::judge(gate, means::Extent::All)
}

fn cores(gate: &mut Gate) -> Outcome {
    lint_rest(gate)?;
    thumb::run(gate, &FEATURES)?;
    capi::reproduce(gate)
}

fn random(gate: &mut Gate) -> Outcome {
    attack::minute(gate)?;
    fuzz::run(gate)
}

fn papers(gate: &mut Gate) -> Outcome {
    evidence::run(gate)?;
    sbom::run(gate)?;
    cluster::run(gate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_part_is_answered_with_all_parts_and_the_nearest_one() {
        assert_eq!(chosen(&[]).map(|parts| parts.len()).ok(), Some(PARTS.len()));
        assert_eq!(chosen(&["wasm"]).map(|parts| parts[0].name).ok(), Some("wasm"));
        let Err(failure) = chosen(&["prooofs"]) else { panic!("there is no such part") };
        assert!(failure.reason.contains("unknown part `prooofs`") && failure.reason.contains("shapes, machine"));
        assert_eq!(failure.rerun, "cargo xtask test --deep proofs");
    }

    #[test]
    fn a_part_that_passed_replaces_its_own_line_of_the_record() {
        let one = with("", "wasm", "wasm = { commit = \"a\", seconds = 1 }");
        let two = with(&one, "shapes", "shapes = { commit = \"a\", seconds = 2 }");
        let three = with(&two, "wasm", "wasm = { commit = \"b\", seconds = 3 }");
        let lines: Vec<&str> = three.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(
            lines,
            ["shapes = { commit = \"a\", seconds = 2 }", "wasm = { commit = \"b\", seconds = 3 }"],
            "{three}"
        );
    }
}
