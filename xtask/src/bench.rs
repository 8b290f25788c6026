//! Cost of a tick on the chip next to other code, as a table for docs/reference/cycles.md. The tool `cycle-bound`
//! measures all functions of the image `yardsticks` in one run.
//!
//! Instructions are the exact executed instructions of the emulator. Cycles come from the table of
//! cycle-bound/README.md. Both belong to the most expensive tick of the run. "Pipelined" is the typical figure with
//! VLDR and VSTR treated as LDR and STR.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use object::{Object, ObjectSymbol};
use serde_json::Value;

use crate::compiler::{self, TARGET};
use crate::python::Environment;
use crate::setup::CROSS_C;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// Manifest of the image, a separate workspace.
const MANIFEST: &str = "benches/chip/Cargo.toml";
const RERUN: &str = "cargo xtask bench";
/// Alternatives for simulating many loops (BSD-3-Clause, BSD-2-Clause).
const RIVALS: Environment = Environment {
    folder: "target/rivals",
    packages: &["numba==0.68.1", "numpy==2.4.6", "scipy==1.17.1"],
    rerun: "cargo xtask bench lanes",
};

struct Yardstick {
    symbol: &'static str,
    what: &'static str,
    /// Shipped tick of the same order, the reference of the comparison.
    against: &'static str,
}

const fn row(symbol: &'static str, what: &'static str, against: &'static str) -> Yardstick {
    Yardstick { symbol, what, against }
}

const ORDER_2: &str = "shipped_tick_2";
const ORDER_3: &str = "shipped_tick_3";

const YARDSTICKS: [Yardstick; 16] = [
    row(ORDER_2, "**this tick, r = 2**", ORDER_2),
    row("joint_r2_tick_u", "the same bits as assembly (`export --asm`)", ORDER_2),
    row("tuned_guarded_tick_2", "by hand in C, guard included", ORDER_2),
    row("tuned_renamed_tick_2", "that with `-frename-registers`", ORDER_2),
    row("tuned_tick_2", "by hand in C without the guard", ORDER_2),
    row("naive_tick_2", "C as the equations stand, -O2", ORDER_2),
    row("naive_fast_tick_2", "the same, -O3 -ffast-math", ORDER_2),
    row(ORDER_3, "**this tick, r = 3**", ORDER_3),
    row("joint_r3_tick_u", "the same bits as assembly (`export --asm`)", ORDER_3),
    row("tuned_guarded_tick_3", "by hand in C, guard included", ORDER_3),
    row("tuned_renamed_tick_3", "that with `-frename-registers`", ORDER_3),
    row("tuned_tick_3", "by hand in C without the guard", ORDER_3),
    row("naive_tick_3", "C as the equations stand, -O2", ORDER_3),
    row("naive_fast_tick_3", "the same, -O3 -ffast-math", ORDER_3),
    row("pid_step", "`pid` 4.0: PID of one error; no observer", ORDER_2),
    row("idsp_biquad", "`idsp` 0.23: clamped biquad, a PID of one error; no observer", ORDER_2),
];

/// Functions that the measured functions call.
const CALLED: [&str; 1] = ["expf"];

/// Checks format and lints, as for the firmware.
pub(crate) fn lint(gate: &mut Gate) -> Outcome {
    gate.commands(
        "format and lints, image of the compared functions",
        &[
            Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"]),
            Invocation::cargo(&["clippy", "--release", "--manifest-path", MANIFEST, "--", "-D", "warnings"]),
        ],
    )
}

/// Compares the instruction counts of the host with their limits; fails if valgrind is missing.
pub(crate) fn count_on_host(gate: &mut Gate) -> Outcome {
    gate.step("instructions on the host, by callgrind", |gate| gate.built()?.bench("counts")?.run(gate))
}

/// Measures closed loops on the host: edo-smc, SciPy, numba and C.
pub(crate) fn lanes(gate: &mut Gate) -> Outcome {
    gate.step("SciPy and numba, for comparison", |gate| RIVALS.ready(gate))?;
    let bench = Invocation::cargo(&["bench", "-p", "benches", "--bench", "lanes", "--"]);
    // A bench runs in the folder of its package.
    let python = gate.root.join(RIVALS.program("python"));
    gate.commands("million ticks per second", &[bench.with(&["--python", &python.display().to_string()])])
}

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    if Invocation::new(CROSS_C, &["--version"]).answer().is_none() {
        return Err(Failure {
            reason: format!("no {CROSS_C}, for the C versions: `cargo xtask setup` installs it on Debian as root"),
            rerun: String::from(RERUN),
        });
    }
    let build = compiler::build(&gate.root, MANIFEST)?;
    gate.commands("image of the compared functions", &[build])?;
    gate.check("cost of a tick: Cortex-M4F, zero wait states", RERUN, |gate| {
        let image = gate.root.join("benches/chip/target").join(TARGET).join("release/yardsticks");
        let log = gate.root.join("target/yardsticks.log");
        trace(&image, &log)?;
        let verifier = gate.built().and_then(|built| built.path("cycle-bound")).map_err(|failure| failure.reason)?;
        let costs = YARDSTICKS.iter().map(|yardstick| cost(verifier, &image, &log, yardstick.symbol));
        let table = table(&costs.collect::<Result<Vec<Cost>, String>>()?);
        std::fs::remove_file(&log).map_err(|error| format!("{}: {error}", log.display()))?;
        table
    })
}

/// Runs the image and logs the executed instructions of the measured functions.
fn trace(image: &Path, log: &Path) -> Result<(), String> {
    let elf = std::fs::read(image).map_err(|error| format!("{}: {error}", image.display()))?;
    let elf = object::File::parse(&*elf).map_err(|error| format!("{}: {error}", image.display()))?;
    let mut ranges = Vec::new();
    for name in YARDSTICKS.iter().map(|yardstick| yardstick.symbol).chain(CALLED) {
        let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
        let symbol = symbol.ok_or_else(|| format!("{}: there is no function `{name}`", image.display()))?;
        // The lowest bit of a function address marks Thumb code.
        ranges.push(format!("{:#x}+{:#x}", symbol.address() & !1, symbol.size()));
    }
    let emulator = Command::new("qemu-system-arm")
        .args(["-M", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-icount", "shift=0,sleep=off"])
        .args(["-singlestep", "-d", "exec,nochain", "-dfilter", &ranges.join(",")])
        .arg("-D")
        .arg(log)
        .arg("-kernel")
        .arg(image)
        .status();
    match emulator {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("the image ended with {status}: did it panic?")),
        Err(error) => Err(format!("qemu-system-arm could not be started: {error}")),
    }
}

/// Cost of one function.
struct Cost {
    symbol: &'static str,
    instructions: u64,
    cycles: u64,
    pipelined: u64,
    /// Upper bound; `None` with loops of unknown length.
    bound: Option<u64>,
    flash_bytes: u64,
}

fn cost(verifier: &Path, image: &Path, log: &Path, symbol: &'static str) -> Result<Cost, String> {
    let output = Command::new(verifier)
        .args(["--json", "--symbol", symbol, "--elf"])
        .arg(image)
        .arg("--trace")
        .arg(log)
        .output()
        .map_err(|error| format!("cycle-bound could not be started: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let report: Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| format!("{symbol}: the verifier's answer is no JSON ({error}): {}", said.trim()))?;
    let number = |pointer: &str| {
        let value = report.pointer(pointer).and_then(Value::as_u64);
        value.ok_or_else(|| format!("{symbol}: no {pointer} in the verifier's answer: {}", said.trim()))
    };
    let bound = report.pointer("/longest/cycles").and_then(Value::as_u64);
    let loops = report.pointer("/declined/0").and_then(Value::as_str).is_some_and(|why| why.contains("a loop"));
    if bound.is_none() && !loops {
        return Err(format!("{symbol}: no bound: {}", report["declined"]));
    }
    Ok(Cost {
        symbol,
        instructions: number("/typical/instructions/max")?,
        cycles: number("/typical/cycles/max")?,
        pipelined: number("/typical/pipelined/max")?,
        bound,
        flash_bytes: number("/flash_bytes")?,
    })
}

/// Returns the table as Markdown, in the order of [`YARDSTICKS`].
fn table(costs: &[Cost]) -> Result<String, String> {
    let mut text = String::from(
        "| | instructions | cycles, typical | pipelined | bound | flash, bytes | typical over ours |\n\
         |---|---|---|---|---|---|---|",
    );
    for (Yardstick { what, against, .. }, cost) in YARDSTICKS.iter().zip(costs) {
        let reference = costs.iter().find(|cost| cost.symbol == *against);
        let reference = reference.ok_or_else(|| format!("`{against}` was not measured"))?;
        let ratio = cost.cycles as f64 / reference.cycles as f64;
        let bound = cost.bound.map_or_else(|| String::from("none: loops"), |bound| bound.to_string());
        let Cost { instructions, cycles, pipelined, flash_bytes, .. } = cost;
        write!(text, "\n| {what} | {instructions} | {cycles} | {pipelined} | {bound} | {flash_bytes} | {ratio:.2} |")
            .map_err(|error| error.to_string())?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_to_the_shipped_tick_of_the_same_order_and_a_loop_has_no_bound() {
        let costs: Vec<Cost> = YARDSTICKS
            .iter()
            .map(|Yardstick { symbol, .. }| match *symbol {
                ORDER_2 => {
                    Cost { symbol, instructions: 140, cycles: 200, pipelined: 180, bound: Some(220), flash_bytes: 600 }
                }
                ORDER_3 => {
                    Cost { symbol, instructions: 160, cycles: 250, pipelined: 220, bound: Some(270), flash_bytes: 700 }
                }
                symbol => {
                    Cost { symbol, instructions: 400, cycles: 500, pipelined: 400, bound: None, flash_bytes: 900 }
                }
            })
            .collect();
        let table = table(&costs).expect("both shipped ticks are there");
        let row = |what: &str| table.lines().find(|line| line.contains(what)).expect("a row of the table").to_owned();
        assert!(row("this tick, r = 3").ends_with("| 160 | 250 | 220 | 270 | 700 | 1.00 |"), "{table}");
        assert_eq!(table.matches("| 400 | 500 | 400 | none: loops | 900 | 2.00 |").count(), 6, "{table}");
        assert_eq!(table.matches("| 400 | 500 | 400 | none: loops | 900 | 2.50 |").count(), 8, "{table}");
    }
}
