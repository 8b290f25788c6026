//! The only build for the host. Every program and test that a step runs comes from it, by the path that cargo reports.
//! No step uses `cargo run -p` or `cargo test -p`, which would select other features and recompile the sources.
//!
//! [`Built::compiled`] checks this rule in both tiers: it lists workspace libraries and programs that are newer than
//! the build.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Instant, SystemTime};

use serde_json::Value;

use crate::step::{Failure, Gate, Invocation, Outcome};

/// Build command: programs, tests and benches of all crates, with the features of the whole workspace. A library
/// without tests of its own is compiled once (`test = false`), which `--all-targets` would ignore.
const BUILD: [&str; 6] =
    ["test", "--workspace", "--tests", "--benches", "--no-run", "--message-format=json-render-diagnostics"];

/// A test program, and the folder of its package, in which cargo would start it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TestProgram {
    /// Name as `package/target`, for example `integration-tests/suite`.
    pub(crate) name: String,
    program: PathBuf,
    folder: PathBuf,
}

/// Files of the build.
#[derive(Debug)]
pub(crate) struct Built {
    programs: BTreeMap<String, PathBuf>,
    benches: BTreeMap<String, PathBuf>,
    pub(crate) tests: Vec<TestProgram>,
    finished: SystemTime,
}

impl Built {
    /// Runs the build, or confirms that it is up to date.
    pub(crate) fn new(gate: &Gate) -> Result<Self, Failure> {
        let build = Invocation::cargo(&BUILD);
        println!("$ {build}");
        let failed = |reason: String| Failure { reason, rerun: Invocation::cargo(&BUILD[..5]).to_string() };
        let output = build.command().current_dir(&gate.root).stderr(Stdio::inherit()).output();
        let output = output.map_err(|error| failed(format!("cargo could not be started: {error}")))?;
        if !output.status.success() {
            return Err(failed(format!("the build ended with {}", output.status)));
        }
        let messages = String::from_utf8_lossy(&output.stdout);
        let mut built = Self {
            programs: BTreeMap::new(),
            benches: BTreeMap::new(),
            tests: Vec::new(),
            finished: SystemTime::now(),
        };
        for message in messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok()) {
            built.add(&message).ok_or_else(|| failed(format!("cargo reports a target in unknown form: {message}")))?;
        }
        // The largest program runs longest; the others share the second core.
        let size = |test: &TestProgram| fs::metadata(&test.program).map_or(0, |data| data.len());
        built.tests.sort_by_key(|test| Reverse(size(test)));
        Ok(built)
    }

    /// Adds one message of cargo; `None` if it has an unknown form.
    fn add(&mut self, message: &Value) -> Option<()> {
        let Some(executable) = message["executable"].as_str() else { return Some(()) };
        let name = message["target"]["name"].as_str()?.to_owned();
        let kind = message["target"]["kind"][0].as_str()?;
        let folder = Path::new(message["manifest_path"].as_str()?).parent()?.to_path_buf();
        let program = PathBuf::from(executable);
        if kind == "bench" {
            self.benches.insert(name, program);
        } else if message["profile"]["test"].as_bool()? {
            let package = folder.file_name()?.to_str()?;
            let kind = if kind == "test" { "" } else { kind };
            let name = [package, "/", kind, if kind.is_empty() { "" } else { " " }, &name].concat();
            self.tests.push(TestProgram { name, program, folder });
        } else {
            self.programs.insert(name, program);
        }
        Some(())
    }

    /// Returns the invocation of a workspace program.
    pub(crate) fn program(&self, name: &str) -> Result<Invocation, Failure> {
        Ok(Invocation::new(&self.path(name)?.display().to_string(), &[]))
    }

    /// Returns the path of a workspace program.
    pub(crate) fn path(&self, name: &str) -> Result<&Path, Failure> {
        of(&self.programs, name)
    }

    /// Returns the invocation of a bench, which needs the argument `--bench`.
    pub(crate) fn bench(&self, name: &str) -> Result<Invocation, Failure> {
        Ok(Invocation::new(&of(&self.benches, name)?.display().to_string(), &["--bench"]))
    }

    /// Returns the test program of a package and a target, for example `tests/suite`.
    pub(crate) fn test(&self, name: &str) -> Result<&TestProgram, Failure> {
        self.tests.iter().find(|test| test.name == name).ok_or_else(|| no_such(name))
    }

    /// Returns the workspace libraries and programs newer than the build: a later step compiled them again.
    pub(crate) fn compiled(&self, gate: &Gate) -> Result<Vec<String>, String> {
        let Some(target) = self.programs.values().next().and_then(|program| program.parent()?.parent()) else {
            return Err(String::from("the build made no program"));
        };
        let mut anew = Vec::new();
        for profile in ["debug", "release"] {
            let deps = target.join(profile).join("deps");
            if deps.is_dir() {
                anew.extend(newer(&deps, &members(&gate.root)?, self.finished)?);
            }
        }
        Ok(anew)
    }
}

fn of<'a>(files: &'a BTreeMap<String, PathBuf>, name: &str) -> Result<&'a Path, Failure> {
    files.get(name).map(PathBuf::as_path).ok_or_else(|| no_such(name))
}

fn no_such(name: &str) -> Failure {
    let reason = format!("the build made no `{name}`: is its target still in the workspace?");
    Failure { reason, rerun: Invocation::cargo(&BUILD[..4]).to_string() }
}

/// Returns the names of the crates and targets of the workspace in rustc's spelling, without tests that are built only
/// by name.
fn members(root: &Path) -> Result<Vec<String>, String> {
    let metadata = Invocation::cargo(&["metadata", "--format-version", "1", "--no-deps", "--offline"]);
    let mut command = metadata.command();
    let output = command.current_dir(root).output().map_err(|error| format!("{metadata}: {error}"))?;
    let metadata: Value = serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata: {error}"))?;
    let all = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let targets = all(&metadata["packages"]).into_iter().flat_map(|package| all(&package["targets"]));
    let is_built = |target: &Value| target["kind"][0] != "test" || target["test"] != false;
    Ok(targets.filter(is_built).filter_map(|target| Some(target["name"].as_str()?.replace('-', "_"))).collect())
}

/// Returns the libraries and programs of these crates in `deps` that are newer than a moment. Checks produce only
/// metadata.
fn newer(deps: &Path, crates: &[String], moment: SystemTime) -> Result<Vec<String>, String> {
    let wrong = |error: std::io::Error| format!("{}: {error}", deps.display());
    let mut found = Vec::new();
    for entry in fs::read_dir(deps).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let file = entry.file_name().to_string_lossy().into_owned();
        let stem = file.strip_suffix(".rlib").or_else(|| (!file.contains('.')).then_some(&file));
        let Some((name, _)) = stem.and_then(|stem| stem.rsplit_once('-')) else { continue };
        let name = if file.contains('.') { name.strip_prefix("lib").unwrap_or(name) } else { name };
        let is_ours = crates.iter().any(|member| member == name);
        if is_ours && entry.metadata().and_then(|data| data.modified()).map_err(wrong)? > moment {
            found.push(file);
        }
    }
    Ok(found)
}

impl TestProgram {
    /// Returns the command in the folder of its package, with cargo's environment variables.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.current_dir(&self.folder).env_remove("LD_LIBRARY_PATH");
        command
    }

    /// Runs the tests, then prints their output.
    pub(crate) fn run(&self, environment: &[(&str, &str)]) -> Outcome {
        let mut command = self.command();
        let started = Instant::now();
        command.envs(environment.iter().copied());
        let rerun = || {
            let set: Vec<String> = environment.iter().map(|(name, value)| format!("{name}={value}")).collect();
            format!("cd {} && {} {}", self.folder.display(), set.join(" "), self.program.display())
        };
        let failed = |reason: String| Err(Failure { reason: format!("{}: {reason}", self.name), rerun: rerun() });
        let output = match command.output() {
            Ok(output) => output,
            Err(error) => return failed(error.to_string()),
        };
        let text = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes)).concat();
        println!("\n     {}, {:.1} s\n{}", self.name, started.elapsed().as_secs_f64(), text.trim());
        if output.status.success() { Ok(()) } else { failed(output.status.to_string()) }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use serde_json::json;

    use super::*;

    fn built() -> Built {
        let mut built = Built {
            programs: BTreeMap::new(),
            benches: BTreeMap::new(),
            tests: Vec::new(),
            finished: SystemTime::now(),
        };
        let message = |name: &str, kind: &str, test: bool| {
            json!({
                "reason": "compiler-artifact", "executable": format!("/w/target/debug/{name}"),
                "manifest_path": "/w/tests/Cargo.toml", "profile": {"test": test},
                "target": {"name": name, "kind": [kind]},
            })
        };
        let messages = [
            message("host-sim", "bin", false),
            message("suite", "test", true),
            message("counts", "bench", true),
            message("attack", "bin", true),
            json!({"reason": "build-finished", "success": true}),
        ];
        assert!(messages.iter().all(|message| built.add(message).is_some()));
        built
    }

    #[test]
    fn programs_tests_and_benches_are_told_apart() {
        let built = built();
        assert!(built.program("host-sim").is_ok() && built.program("suite").is_err());
        assert!(built.test("tests/suite").is_ok() && built.test("tests/bin attack").is_ok());
        assert_eq!(built.bench("counts").expect("a bench").to_string(), "/w/target/debug/counts --bench");
        let failure = built.program("host-simm").expect_err("no such program");
        assert!(failure.reason.contains("made no `host-simm`"), "{}", failure.reason);
    }

    #[test]
    fn a_target_in_another_form_is_reported() {
        assert!(built().add(&json!({"executable": "x", "target": {"name": "x"}})).is_none());
    }

    #[test]
    fn a_library_of_ours_that_is_newer_than_the_build_is_found() {
        let folder = std::env::temp_dir().join(format!("xtask-built-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let files = ["libloop_sim-0a.rlib", "loop_sim-0b", "libloop_sim-0c.rmeta", "libserde-0d.rlib", "loop_sim-0b.d"];
        for file in files {
            fs::write(folder.join(file), "").expect("a file");
        }
        let crates = [String::from("loop_sim")];
        let before = SystemTime::now() - Duration::from_mins(1);
        let mut found = newer(&folder, &crates, before).expect("a readable folder");
        found.sort();
        assert_eq!(found, ["libloop_sim-0a.rlib", "loop_sim-0b"]);
        let after = SystemTime::now() + Duration::from_mins(1);
        assert_eq!(newer(&folder, &crates, after), Ok(Vec::new()));
        fs::remove_dir_all(&folder).expect("our own folder");
    }
}
