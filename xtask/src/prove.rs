//! `prove`: what is claimed of the shipped ticks for every input is proved by a solver, and faults put in on purpose
//! are noticed ([docs/proofs.md](../../docs/proofs.md)).

use crate::python::Environment;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// The solver, MIT: a wheel of some megabytes with nothing behind it.
const SOLVER: Environment =
    Environment { folder: "target/solvers", packages: &["bitwuzla==0.9.1"], rerun: "cargo xtask prove" };

/// The table of what was tried stands in it.
const PAGE: &str = "docs/proofs.md";
/// Scenarios whose exported C is proved as well, with its certificate: those of the images, in the gate, and the files
/// to start from.
const SHIPPED: [&str; 2] = ["firmware/drive.toml", "firmware/motor.toml"];
const TO_START_FROM: [&str; 3] =
    ["scenario/scenarios/chain.toml", "scenario/scenarios/joint.toml", "scenario/scenarios/motor.toml"];
const CERTIFICATES: &str = "target/certificates";

/// What must be proved, the faults, and the drives of the images: the part of the gate.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    gate.commands("statements about every input, proved; faults put in on purpose, noticed", &[asked(&[])])?;
    certificates(gate, "certificates of the drives in the images", &SHIPPED)
}

/// Every shipped instance, and certificates of the files to start from.
pub(crate) fn all(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    gate.commands("statements about every shipped instance, into their table", &[asked(&["--all", "--page", PAGE])])?;
    certificates(gate, "certificates of the files to start from", &TO_START_FROM)
}

fn asked(arguments: &[&str]) -> Invocation {
    Invocation::cargo(&["run", "--quiet", "-p", "tick-proof", "--", "--python", &SOLVER.program("python")])
        .with(arguments)
}

fn certificates(gate: &mut Gate, headline: &str, scenarios: &[&str]) -> Outcome {
    std::fs::create_dir_all(gate.root.join(CERTIFICATES))
        .map_err(|error| Failure { reason: format!("{CERTIFICATES}: {error}"), rerun: "cargo xtask prove".into() })?;
    let commands: Vec<Invocation> = scenarios.iter().map(|scenario| certified(scenario)).collect();
    gate.commands(headline, &commands)
}

fn certified(scenario: &str) -> Invocation {
    let name = format!("{CERTIFICATES}/{}", scenario.trim_end_matches(".toml").replace('/', "-"));
    Invocation::cargo(&["run", "--quiet", "-p", "host-sim", "--", "export", scenario, "--standalone", "--force"])
        .with(&["-o", &format!("{name}.h"), "--certificate", &format!("{name}.txt")])
        .with(&["--python", &SOLVER.program("python")])
}
