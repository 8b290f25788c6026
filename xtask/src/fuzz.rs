//! libFuzzer against the target's side of the serial protocol, and against a free-running drive. The inputs are scripts
//! of requests and garbage, evolved towards uncovered code. They start from nothing with a fixed seed, so a run in CI
//! equals a local run.
//!
//! Coverage needs no other compiler: stable Rust can enable the LLVM pass.

use crate::step::{Gate, Invocation, Outcome};

const MANIFEST: &str = "pil-wire/fuzz/Cargo.toml";
const TARGET_DIR: &str = "target/fuzz";
const INSTRUMENTED: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                            -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
                            -Cllvm-args=-sanitizer-coverage-pc-table";
/// Programs and their numbers of scripts; the scripts of a drive have thousands of ticks.
const TARGETS: [(&str, u32); 2] = [("target", 100_000), ("live", 10_000)];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let format = Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"]);
    // An explicit target keeps the flags away from build scripts.
    let host = Invocation::new("rustc", &["--print", "host-tuple"]).answer().unwrap_or_default();
    let build = Invocation::cargo(&["build", "--release", "--manifest-path", MANIFEST, "--target-dir", TARGET_DIR])
        .with(&["--target", &host])
        .env("RUSTFLAGS", INSTRUMENTED);
    // A script of more than 10 s counts as a hang.
    let options = ["-seed=1", "-max_len=600", "-timeout=10", "-verbosity=0", "-print_final_stats=1"];
    let runs = TARGETS.map(|(target, scripts)| {
        Invocation::new(&format!("{TARGET_DIR}/{host}/release/{target}"), &[&format!("-runs={scripts}")])
            .with(&options)
            .with(&["-artifact_prefix=target/fuzz/"])
    });
    let scripts = TARGETS.map(|(target, scripts)| format!("{scripts} against {target}")).join(", ");
    gate.commands(&format!("scripts of libFuzzer: {scripts}"), &[&[format, build][..], &runs].concat())
}
