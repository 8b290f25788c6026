//! Are the tools there?  What is missing is installed where that is possible without a choice of the user's; else the
//! error names what to install. The rustup toolchain is never changed.

use std::path::Path;

use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::thumb::{Compiler, DEBIAN_PACKAGES, TARGET};

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.check("tools: cargo fmt, cargo clippy", "cargo xtask setup", |_| {
        for tool in ["fmt", "clippy"] {
            if Invocation::cargo(&[tool, "--version"]).answer().is_none() {
                let component = if tool == "fmt" { "rustfmt" } else { tool };
                return Err(format!("`cargo {tool}` is missing: rustup component add {component}"));
            }
        }
        Ok(String::from("present"))
    })?;
    gate.step(&format!("compiler for {TARGET}"), |gate| {
        let compiler = match Compiler::find() {
            Some(found) => found,
            None => install(gate)?,
        };
        println!("{compiler}");
        Ok(())
    })
}

/// Debian's compiler with its library sources, if we are root on Debian.
fn install(gate: &Gate) -> Result<Compiler, Failure> {
    let by_hand = |reason: &str| Failure {
        reason: format!(
            "{reason}; install one of\n  rustup target add {TARGET}\n  apt-get install -y --no-install-recommends {}   \
             (Debian, as root)",
            DEBIAN_PACKAGES.join(" ")
        ),
        rerun: String::from("cargo xtask setup"),
    };
    let is_root = Invocation::new("id", &["-u"]).answer().as_deref() == Some("0");
    if !is_root || !Path::new("/etc/debian_version").exists() {
        return Err(by_hand(&format!("no compiler here has the core library for {TARGET}")));
    }
    Invocation::new("apt-get", &["update"]).run(gate)?;
    Invocation::new("apt-get", &["install", "-y", "--no-install-recommends"])
        .with(&DEBIAN_PACKAGES)
        .env("DEBIAN_FRONTEND", "noninteractive")
        .run(gate)?;
    Compiler::find().ok_or_else(|| by_hand("Debian's packages are installed, yet bring no core library"))
}
