//! Exported FMUs against FMPy and `host-sim`: `fmu/check.py` has the checks.

use crate::python::Environment;
use crate::step::{Gate, Invocation, Outcome};

const RERUN: &str = "cargo xtask test --deep fmu";
/// FMPy, 2-clause BSD: reads, validates, builds and runs FMUs.
const ENVIRONMENT: Environment =
    Environment { folder: "target/fmu-env", packages: &["fmpy==0.3.32", "numpy==2.4.6"], rerun: RERUN };
const CHECKS: &str = "xtask/src/fmu/check.py";
/// Folder of all files; it is emptied first.
const FOLDER: &str = "target/fmu";
/// Variable with a `host-sim` to use in place of the built one.
const HOST_SIM: &str = "EDO_SMC_HOST_SIM";

/// Exports FMUs and runs the checks.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("FMPy, installed", |gate| ENVIRONMENT.ready(gate))?;
    let host_sim = match std::env::var(HOST_SIM) {
        Ok(path) => path,
        Err(_) => gate.built()?.path("host-sim")?.display().to_string(),
    };
    gate.commands(
        "FMUs of controllers and plants",
        &[Invocation::new(&ENVIRONMENT.program("python"), &[CHECKS, &host_sim, FOLDER])],
    )
}
