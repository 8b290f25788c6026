//! libFuzzer against the target's side of the wire: so many scripts of requests and garbage, grown towards code that
//! was not reached before. It starts from nothing, with a fixed seed, so that a run in CI is the run at the desk.
//!
//! Coverage needs no other compiler: the pass is in LLVM, and stable Rust can ask for it.

use crate::step::{Gate, Invocation, Outcome};

const MANIFEST: &str = "pil-wire/fuzz/Cargo.toml";
const TARGET_DIR: &str = "target/fuzz";
const INSTRUMENTED: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                            -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
                            -Cllvm-args=-sanitizer-coverage-pc-table";
const SCRIPTS: u32 = 100_000;

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let format = Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"]);
    // Named, so that the flags do not reach build scripts.
    let host = Invocation::new("rustc", &["--print", "host-tuple"]).answer().unwrap_or_default();
    let build = Invocation::cargo(&["build", "--release", "--manifest-path", MANIFEST, "--target-dir", TARGET_DIR])
        .with(&["--target", &host])
        .env("RUSTFLAGS", INSTRUMENTED);
    let program = format!("{TARGET_DIR}/{host}/release/target");
    let runs = format!("-runs={SCRIPTS}");
    // A script that takes longer than 10 s hangs.
    let options = ["-seed=1", "-max_len=600", "-timeout=10", "-verbosity=0", "-print_final_stats=1"];
    let fuzz = Invocation::new(&program, &[&runs]).with(&options).with(&["-artifact_prefix=target/fuzz/"]);
    gate.commands(&format!("{SCRIPTS} scripts of libFuzzer against the target of the wire"), &[format, build, fuzz])
}
