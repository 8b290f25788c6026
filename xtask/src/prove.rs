//! `prove`: what is claimed of the shipped ticks for every input is proved by a solver, and faults put in on purpose
//! are noticed ([docs/proofs.md](../../docs/proofs.md)).

use crate::python::Environment;
use crate::step::{Failure, Gate, Outcome};

/// The solver, MIT: a wheel of some megabytes with nothing behind it.
const SOLVER: Environment =
    Environment { folder: "target/solvers", packages: &["bitwuzla==0.9.1"], rerun: "cargo xtask prove" };

/// The table of what was tried stands in it.
const PAGE: &str = "docs/proofs.md";
/// Scenarios whose exported C gets a certificate: a drive of an image, the other one, and the files to start from.
/// Their statements are those of the instances, so the deep tier makes the first certificate only.
const SCENARIOS: [&str; 5] = [
    "firmware/motor.toml",
    "firmware/drive.toml",
    "scenario/scenarios/chain.toml",
    "scenario/scenarios/joint.toml",
    "scenario/scenarios/motor.toml",
];
const CERTIFICATES: &str = "target/certificates";

/// Proves the required statements, checks that faults are noticed, makes one certificate: the part `proofs`.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    proofs(gate, "statements about every input, proved; faults put in on purpose, noticed", &[])?;
    certificates(gate, "certificate of a drive in an image", &SCENARIOS[..1])
}

/// Every shipped instance, and certificates of the files to start from.
pub(crate) fn all(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    proofs(gate, "statements about every shipped instance, into their table", &["--all", "--page", PAGE])?;
    certificates(gate, "certificates of the drives in the images and of the files to start from", &SCENARIOS)
}

fn proofs(gate: &mut Gate, headline: &str, arguments: &[&str]) -> Outcome {
    gate.step(headline, |gate| {
        let prove = gate.built()?.program("tick-proof")?.with(&["--python", &SOLVER.program("python")]);
        prove.with(arguments).run(gate)
    })
}

fn certificates(gate: &mut Gate, headline: &str, scenarios: &[&str]) -> Outcome {
    gate.step(headline, |gate| {
        let failed = |error| Failure { reason: format!("{CERTIFICATES}: {error}"), rerun: "cargo xtask prove".into() };
        std::fs::create_dir_all(gate.root.join(CERTIFICATES)).map_err(failed)?;
        for scenario in scenarios {
            let name = format!("{CERTIFICATES}/{}", scenario.trim_end_matches(".toml").replace('/', "-"));
            let export = gate.built()?.program("host-sim")?.with(&["export", scenario, "--standalone", "--force"]);
            let export = export.with(&["-o", &format!("{name}.h"), "--certificate", &format!("{name}.txt")]);
            export.with(&["--python", &SOLVER.program("python")]).run(gate)?;
        }
        Ok(())
    })
}
