//! Passes the commit of the sources and the compiler version to the program, which prints both in a report.
//!
//! The commit is the one of the folder when a source of the program last changed. Uncommitted changes are marked. A new
//! commit alone does not rebuild the program.

use std::env;
use std::path::Path;
use std::process::Command;

/// Source paths of the program, relative to this crate.
const SOURCES: [&str; 19] = [
    "Cargo.toml",
    "assets",
    "build.rs",
    "scenarios",
    "src",
    "../Cargo.lock",
    "../controller-core/src",
    "../cycle-bound/src",
    "../forms/src",
    "../link/src",
    "../loop-sim/src",
    "../pil-wire/src",
    "../scenario",
    "../study/src",
    "../terminal/src",
    "../tick-assembly/src",
    "../tick-proof/src",
    "../tick-record/src",
    "../whole-file/src",
];

fn main() {
    for source in SOURCES.into_iter().filter(|source| Path::new(source).exists()) {
        println!("cargo::rerun-if-changed={source}");
    }
    let git = |args: &[&str]| said(Command::new("git").arg("--no-optional-locks").args(args));
    // A copy without history may lie inside the repository of another project.
    let described = ["describe", "--always", "--exclude=*", "--abbrev=40", "--dirty= with uncommitted changes"];
    let commit = git(&["ls-files", "--error-unmatch", "build.rs"]).and_then(|_| git(&described));
    let compiler = said(Command::new(env::var("RUSTC").unwrap_or_else(|_| "rustc".into())).arg("--version"));
    for (name, value) in [("HOST_SIM_COMMIT", commit), ("HOST_SIM_COMPILER", compiler)] {
        let value = value.unwrap_or_else(|| "unknown".into());
        println!("cargo::rustc-env={name}={value}");
    }
}

/// Returns the first line of the output of a program, if the program exists and succeeds.
fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    let line = String::from_utf8(output.stdout).ok()?.lines().next()?.trim().to_owned();
    Some(line).filter(|line| !line.is_empty())
}
