//! Tells the program of what it was made: the commit of its sources, if git is there to say, and the compiler. A report
//! says both.
//!
//! The commit is that of the folder when a source of the program last changed, with a word if that change was in no
//! commit then. A commit alone changes no program, and builds none anew.

use std::env;
use std::path::Path;
use std::process::Command;

/// What of the project the program is made of, from this crate.
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
    // A copy without its history may lie in the folder of another project's.
    let described =
        ["describe", "--always", "--exclude=*", "--abbrev=40", "--dirty= and changes that are in no commit"];
    let commit = git(&["ls-files", "--error-unmatch", "build.rs"]).and_then(|_| git(&described));
    let compiler = said(Command::new(env::var("RUSTC").unwrap_or_else(|_| "rustc".into())).arg("--version"));
    for (name, value) in [("HOST_SIM_COMMIT", commit), ("HOST_SIM_COMPILER", compiler)] {
        let value = value.unwrap_or_else(|| "not known to this build".into());
        println!("cargo::rustc-env={name}={value}");
    }
}

/// The one line that a program says, if it is there and content.
fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    let line = String::from_utf8(output.stdout).ok()?.lines().next()?.trim().to_owned();
    Some(line).filter(|line| !line.is_empty())
}
