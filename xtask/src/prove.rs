//! Command `prove`: a solver proves the statements about the shipped ticks for every input, and must detect faults
//! inserted deliberately ([docs/verification.md](../../docs/verification.md)).

use crate::python::Environment;
use crate::step::{Failure, Gate, Outcome};

/// The solver, MIT: a wheel of some megabytes without dependencies.
const SOLVER: Environment =
    Environment { folder: "target/solvers", packages: &["bitwuzla==0.9.1"], rerun: "cargo xtask prove" };

/// Page with the table of proved statements.
const PAGE: &str = "docs/verification.md";
/// Scenarios whose exported C gets a certificate: the drives of both images, and the starter files. Their statements
/// equal the statements of the instances, so the deep tier creates the first certificate only.
const SCENARIOS: [&str; 5] = [
    "firmware/motor.toml",
    "firmware/drive.toml",
    "scenario/scenarios/chain.toml",
    "scenario/scenarios/joint.toml",
    "scenario/scenarios/motor.toml",
];
const CERTIFICATES: &str = "target/certificates";

/// Proves the required statements, checks the detection of faults, and creates one certificate: the part `proofs`.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    proofs(gate, "statements for every input proved; inserted faults detected", &[])?;
    certificates(gate, "certificate of a drive in an image", &SCENARIOS[..1])
}

/// Proves the statements of every shipped instance, and creates certificates of the starter files.
pub(crate) fn all(gate: &mut Gate) -> Outcome {
    gate.step("the solver for proofs", |gate| SOLVER.ready(gate))?;
    proofs(gate, "statements about every shipped instance, with their table", &["--all", "--page", PAGE])?;
    certificates(gate, "certificates of the drives in the images and of the starter files", &SCENARIOS)
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
