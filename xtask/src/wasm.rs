//! Closed loop in WebAssembly: it builds, and its results are bit-identical to this machine.
//!
//! `loop-sim/wasm` turns a run into one number, a hash over every bit of every row. Node prints the numbers of the
//! module, and the native program prints the numbers of this machine. All numbers must be equal.

use crate::compiler::Compiler;
use crate::step::{Failure, Gate, Invocation, Outcome};

pub(crate) const TARGET: &str = "wasm32-unknown-unknown";
const PACKAGE: &str = "loop-sim-wasm";
/// Separate target folder, because the artifacts come from another compiler.
const TARGET_DIR: &str = "target/wasm";
const MODULE: &str = "target/wasm/wasm32-unknown-unknown/release/loop_sim_wasm.wasm";
/// The program that runs WebAssembly.
pub(crate) const NODE: &str = "node";
/// Script that calls `bits` for 0, 1, .. and prints a line for each; its arguments are the module and the count.
const SCRIPT: &str = "\
    const module = new WebAssembly.Module(require('fs').readFileSync(process.argv[1]));\
    const { bits } = new WebAssembly.Instance(module).exports;\
    for (let k = 0; k < Number(process.argv[2]); k++)\
        console.log(BigInt.asUintN(64, bits(k)).toString(16).padStart(16, '0'));";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let build = build()?.with(&["-p", PACKAGE, "--lib", "--target-dir", TARGET_DIR]);
    gate.commands(&format!("closed loop for {TARGET}"), &[build])?;
    gate.check("bits of the closed loop, WebAssembly against this machine", "cargo xtask wasm", |gate| {
        let said = |invocation: &Invocation| invocation.answer().ok_or_else(|| format!("no answer: {invocation}"));
        let program = gate.built().and_then(|built| built.program(PACKAGE)).map_err(|failure| failure.reason)?;
        let here = said(&program)?;
        let cases = here.lines().count().to_string();
        let module = gate.root.join(MODULE);
        let there = said(&Invocation::new(NODE, &["-e", SCRIPT, &module.to_string_lossy(), &cases]))?;
        same(&here, &there)
    })
}

/// Returns the compiler for WebAssembly.
pub(crate) fn compiler() -> Option<Compiler> {
    Compiler::find_for(TARGET, "std")
}

/// Returns the command of a build for WebAssembly.
pub(crate) fn build() -> Result<Invocation, Failure> {
    let compiler = compiler().ok_or_else(|| Failure {
        reason: format!("no compiler for {TARGET}: `cargo xtask setup` installs it, or says what to install"),
        rerun: String::from("cargo xtask setup"),
    })?;
    Ok(compiler.cargo_for("build", TARGET, "std,panic_abort", "CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER"))
}

/// Compares what this machine and WebAssembly print.
pub(crate) fn equal(here: &str, there: &str) -> Result<(), String> {
    if here == there {
        return Ok(());
    }
    Err(format!("the bits differ\nhere:\n{here}\nin WebAssembly:\n{there}"))
}

/// Compares the numbers, one per line. A 0 is an error: the run did not finish.
fn same(here: &str, there: &str) -> Result<String, String> {
    if here.lines().any(|number| number.chars().all(|digit| digit == '0')) || here.is_empty() {
        return Err(format!("a run did not go to its end: {here}"));
    }
    equal(here, there)?;
    Ok(format!("{} runs, 0 bits differ", here.lines().count()))
}

#[cfg(test)]
mod tests {
    use super::same;

    #[test]
    fn one_digit_fewer_runs_or_a_run_without_an_end_is_told() {
        assert!(same("12ab\n0f01", "12ab\n0f01").is_ok());
        for (here, there) in [("12ab\n0f01", "12ab\n0f03"), ("12ab\n0f01", "12ab"), ("0000", "0000"), ("", "")] {
            assert!(same(here, there).is_err(), "{here} {there}");
        }
    }
}
