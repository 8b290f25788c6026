//! The whole gate, cheapest steps first, so that a slip is told in seconds; and the quick one for the daily loop, which
//! ends with what it left out.

use crate::step::{Gate, Invocation, Outcome};
use crate::{
    attack, bench, budget, capi, cluster, docs, evidence, firmware, fuzz, means, mutate, paper_map, prove, sbom, scan,
    setup, thumb, wasm,
};

/// Features of controller-core; every combination must build and be free of warnings.
const FEATURES: [&str; 3] = ["analysis", "defmt", "serde"];

/// A part of the gate.
struct Part {
    run: fn(&mut Gate) -> Outcome,
    quick: Quick,
}

/// What the quick run does with a part.
enum Quick {
    /// All of the part.
    Same,
    /// Less of it, and what is left out.
    Less(fn(&mut Gate) -> Outcome, &'static str),
    /// Nothing of it; in words.
    No(&'static str),
}

use Quick::{Less, No, Same};

const GATE: [Part; 23] = [
    Part { run: setup::run, quick: No("the look for tools") },
    Part { run: format, quick: Same },
    Part { run: scan, quick: Same },
    Part { run: paper_map::run, quick: Same },
    Part { run: lint, quick: Same },
    Part { run: lint_features, quick: No("lints of controller-core by feature set") },
    Part { run: lint_others, quick: No("format and lints of the firmware, the yardsticks and the C interface") },
    Part { run: docs::run, quick: No("the documentation and its formulas") },
    Part { run: pack, quick: No("the packages of the crates") },
    // The suite runs them in the emulator, and links the archive.
    Part { run: firmware::run, quick: No("the images for the chip") },
    Part { run: capi::run, quick: No("the archives for C and their examples") },
    Part { run: sbom::run, quick: No("bills of materials") },
    Part { run: evidence::run, quick: No("exported C before analysers and MISRA's addon") },
    Part { run: test, quick: Less(test_quickly, LEFT_OUT) },
    Part { run: cluster::run, quick: No("shards of a Monte Carlo run on two workers, one of them killed") },
    Part { run: prove::run, quick: No("the proofs for every input") },
    Part { run: mutate::run, quick: No("equations broken on purpose") },
    Part { run: attack::minute, quick: No("a minute of random campaigns") },
    Part { run: bench::count_on_host, quick: No("instructions on the host") },
    Part { run: test_without_features, quick: No("tests of controller-core without features") },
    Part { run: budget::judge, quick: No("the ceilings of the images") },
    Part { run: means::judge, quick: No("the meaning of the machine code") },
    Part {
        run: last,
        quick: No("fuzzing of the wire, controller-core for the chip by feature set, the loop in WebAssembly"),
    },
];

/// Tests of the suite by the beginning of their names; the gate proper runs them all.
const SKIPPED: [&str; 16] = [
    // Images, in the emulator.
    "emulator::",
    "budget::the_emulator",
    "budget::every_executed_cycle",
    "commission::the_emulated_chip",
    // Compilers as programs.
    "capi::",
    "capi_drive::",
    "compile::",
    "export::the_exported",
    "export::two_exported",
    "export_drive::",
    "export_motor::",
    "export_plan::",
    // Long campaigns.
    "wire::every_case_of_every_figure",
    "wire::a_target_that_says_nothing",
    "golden_bits::a_million",
    "robustness::random_chains",
];
const LEFT_OUT: &str = "examples in the documentation; of the suite the emulator, the C interface, exported files, \
                        what must not compile, the figures over the wire, a silent target, a million ticks of \
                        every shape, random chains";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    GATE.iter().try_for_each(|part| (part.run)(gate))
}

/// Format, lints and the tests that need no image and no other compiler.
pub(crate) fn quick(gate: &mut Gate) -> Outcome {
    GATE.iter().try_for_each(|part| match part.quick {
        Same => (part.run)(gate),
        Less(less, what) => {
            gate.leave_out(what);
            less(gate)
        }
        No(what) => {
            gate.leave_out(what);
            Ok(())
        }
    })
}

fn format(gate: &mut Gate) -> Outcome {
    gate.commands("format", &[Invocation::cargo(&["fmt", "--all", "--check"])])
}

fn scan(gate: &mut Gate) -> Outcome {
    gate.check("no test switched off, no code left unwritten", "cargo xtask test", |gate| scan::check(&gate.root))
}

/// A warning is an error.
const DENY: [&str; 3] = ["--", "-D", "warnings"];

fn lint(gate: &mut Gate) -> Outcome {
    let clippy = Invocation::cargo(&["clippy", "--workspace", "--all-targets"]).with(&DENY);
    gate.commands("lints, whole workspace", &[clippy])
}

fn lint_features(gate: &mut Gate) -> Outcome {
    let sets = feature_sets();
    let of_set = |features: &String| {
        Invocation::cargo(&["clippy", "-p", "controller-core", "--lib", "--no-default-features", "--features"])
            .with(&[features])
            .with(&DENY)
    };
    let core: Vec<Invocation> = sets.iter().map(of_set).collect();
    gate.commands(&format!("lints, controller-core, {} feature sets", core.len()), &core)
}

fn lint_others(gate: &mut Gate) -> Outcome {
    firmware::lint(gate)?;
    bench::lint(gate)?;
    capi::lint(gate)
}

/// Crates that users take must make packages; that one builds from its own is for `cargo package` without
/// `--no-verify`, which compiles all it depends on once more.
fn pack(gate: &mut Gate) -> Outcome {
    let own = ["integration-tests", "benches", "xtask", "loop-sim-wasm"];
    let without: Vec<&str> = own.iter().flat_map(|name| ["--exclude", name]).collect();
    let pack = Invocation::cargo(&["package", "--quiet", "--workspace", "--no-verify", "--allow-dirty"]).with(&without);
    gate.commands("packages of the crates that users take", &[pack])
}

fn test(gate: &mut Gate) -> Outcome {
    gate.commands("tests", &[Invocation::cargo(&["test", "--workspace"])])
}

fn test_quickly(gate: &mut Gate) -> Outcome {
    let skipped: Vec<&str> = SKIPPED.iter().flat_map(|name| ["--skip", name]).collect();
    let tests = Invocation::cargo(&["test", "--quiet", "--workspace", "--tests", "--"]).with(&skipped);
    gate.commands("tests that need no image and no other compiler", &[tests])
}

fn test_without_features(gate: &mut Gate) -> Outcome {
    let tests = Invocation::cargo(&["test", "-p", "controller-core", "--no-default-features"]);
    gate.commands("tests, controller-core without features", &[tests])
}

fn last(gate: &mut Gate) -> Outcome {
    fuzz::run(gate)?;
    thumb::run(gate, &feature_sets())?;
    wasm::run(gate)
}

/// All subsets of [`FEATURES`], as cargo reads them.
fn feature_sets() -> Vec<String> {
    (0..1_usize << FEATURES.len())
        .map(|subset| {
            let chosen: Vec<&str> =
                FEATURES.into_iter().enumerate().filter(|(k, _)| subset >> k & 1 == 1).map(|(_, name)| name).collect();
            chosen.join(",")
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{SKIPPED, feature_sets};

    #[test]
    fn what_the_quick_run_skips_is_there_to_be_skipped() {
        let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/suite");
        for name in SKIPPED {
            let (module, test) = name.split_once("::").expect("a module of the suite");
            let text = std::fs::read_to_string(suite.join(module).with_extension("rs")).expect(module);
            assert!(text.contains(&format!("#[test]\nfn {test}")), "{name}");
        }
    }

    #[test]
    fn the_feature_sets_are_all_eight_and_begin_with_none() {
        let sets = feature_sets();
        assert_eq!(sets.len(), 8);
        assert_eq!((sets[0].as_str(), sets[7].as_str()), ("", "analysis,defmt,serde"));
    }
}
