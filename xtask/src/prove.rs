//! `prove`: what is claimed of the shipped ticks for every input is proved by a solver, and faults put in on purpose
//! are noticed ([docs/proofs.md](../../docs/proofs.md)).

use std::path::Path;

use crate::step::{Failure, Gate, Invocation, Outcome};

/// Where the solver lies: an environment of Python that nothing else uses.
const ENVIRONMENT: &str = "target/solvers";
const PYTHON: &str = "target/solvers/bin/python";
/// The solver, MIT: a wheel of some megabytes with nothing behind it.
const SOLVER: &str = "bitwuzla==0.9.1";

/// The table of what was tried stands in it.
const PAGE: &str = "docs/proofs.md";
/// Files to start from whose exported C is proved as well, with their certificates.
const FILES: [&str; 3] = ["chain", "joint", "motor"];
const CERTIFICATES: &str = "target/certificates";

/// What must be proved, and the faults: the part of the gate.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", solver)?;
    gate.commands("statements about every input, proved; faults put in on purpose, noticed", &[asked(&[])])
}

/// Every shipped instance, and certificates of the files to start from.
pub(crate) fn all(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", solver)?;
    gate.commands("statements about every shipped instance, into their table", &[asked(&["--all", "--page", PAGE])])?;
    let folder = gate.root.join(CERTIFICATES);
    std::fs::create_dir_all(&folder).map_err(|error| Failure {
        reason: format!("{}: {error}", folder.display()),
        rerun: "cargo xtask prove --all".into(),
    })?;
    gate.commands("certificates of the files to start from", &FILES.map(certified))
}

fn asked(arguments: &[&str]) -> Invocation {
    Invocation::cargo(&["run", "--quiet", "-p", "tick-proof", "--", "--python", PYTHON]).with(arguments)
}

fn certified(name: &str) -> Invocation {
    let [scenario, c, certificate] = [
        format!("scenario/scenarios/{name}.toml"),
        format!("{CERTIFICATES}/{name}.h"),
        format!("{CERTIFICATES}/{name}.txt"),
    ];
    Invocation::cargo(&["run", "--quiet", "-p", "host-sim", "--", "export", &scenario, "--standalone", "--force"])
        .with(&["-o", &c, "--certificate", &certificate, "--python", PYTHON])
}

/// Is it there? If not it is installed.
fn solver(gate: &Gate) -> Outcome {
    let present = Invocation::new(PYTHON, &["-c", "import bitwuzla; print('Bitwuzla', bitwuzla.version())"]);
    if let Some(version) = present.answer().filter(|_| Path::new(&gate.root).join(PYTHON).exists()) {
        println!("{version}");
        return Ok(());
    }
    let install = [
        Invocation::new("python3", &["-m", "venv", ENVIRONMENT]),
        Invocation::new(PYTHON, &["-m", "pip", "install", "--quiet", SOLVER]),
        present,
    ];
    install.iter().try_for_each(|command| command.run(gate)).map_err(|failure| Failure {
        reason: format!(
            "{}\nthe solver is missing; it needs Python 3.9 or later with its module venv (on Debian: apt-get install \
             python3-venv) and a way to its package",
            failure.reason
        ),
        ..failure
    })
}
