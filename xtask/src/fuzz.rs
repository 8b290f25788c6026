//! libFuzzer against the target's side of the wire, and against a drive that runs by itself: so many scripts of
//! requests and garbage, grown towards code that was not reached before. They start from nothing, with a fixed seed, so
//! that a run in CI is the run at the desk.
//!
//! Coverage needs no other compiler: the pass is in LLVM, and stable Rust can ask for it.

use crate::step::{Gate, Invocation, Outcome};

const MANIFEST: &str = "pil-wire/fuzz/Cargo.toml";
const TARGET_DIR: &str = "target/fuzz";
const INSTRUMENTED: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                            -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
                            -Cllvm-args=-sanitizer-coverage-pc-table";
/// Programs, and scripts of each: those of a drive have thousands of ticks.
const TARGETS: [(&str, u32); 2] = [("target", 100_000), ("live", 10_000)];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let format = Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"]);
    // Named, so that the flags do not reach build scripts.
    let host = Invocation::new("rustc", &["--print", "host-tuple"]).answer().unwrap_or_default();
    let build = Invocation::cargo(&["build", "--release", "--manifest-path", MANIFEST, "--target-dir", TARGET_DIR])
        .with(&["--target", &host])
        .env("RUSTFLAGS", INSTRUMENTED);
    // A script that takes longer than 10 s hangs.
    let options = ["-seed=1", "-max_len=600", "-timeout=10", "-verbosity=0", "-print_final_stats=1"];
    let runs = TARGETS.map(|(target, scripts)| {
        Invocation::new(&format!("{TARGET_DIR}/{host}/release/{target}"), &[&format!("-runs={scripts}")])
            .with(&options)
            .with(&["-artifact_prefix=target/fuzz/"])
    });
    let scripts = TARGETS.map(|(target, scripts)| format!("{scripts} against {target}")).join(", ");
    gate.commands(&format!("scripts of libFuzzer: {scripts}"), &[&[format, build][..], &runs].concat())
}
