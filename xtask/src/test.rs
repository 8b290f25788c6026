//! The whole gate, cheapest steps first, so that a slip is told in seconds.

use crate::step::{Gate, Invocation, Outcome};
use crate::{bench, budget, capi, docs, firmware, fuzz, paper_map, scan, setup, thumb, wasm};

/// Features of controller-core; every combination must build and be free of warnings.
const FEATURES: [&str; 3] = ["analysis", "defmt", "serde"];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    setup::run(gate)?;
    gate.commands("format", &[Invocation::cargo(&["fmt", "--all", "--check"])])?;
    gate.check("no test switched off, no code left unwritten", "cargo xtask test", |gate| scan::check(&gate.root))?;
    paper_map::run(gate)?;

    let deny = ["--", "-D", "warnings"];
    let sets = feature_sets();
    let clippy = Invocation::cargo(&["clippy", "--workspace", "--all-targets"]).with(&deny);
    gate.commands("lints, whole workspace", &[clippy])?;
    let core: Vec<Invocation> = sets
        .iter()
        .map(|features| {
            Invocation::cargo(&["clippy", "-p", "controller-core", "--lib", "--no-default-features", "--features"])
                .with(&[features])
                .with(&deny)
        })
        .collect();
    gate.commands(&format!("lints, controller-core, {} feature sets", core.len()), &core)?;

    firmware::lint(gate)?;
    bench::lint(gate)?;
    capi::lint(gate)?;
    docs::run(gate)?;
    // The suite runs them in the emulator, and links the archive.
    firmware::run(gate)?;
    capi::run(gate)?;
    gate.commands("tests", &[Invocation::cargo(&["test", "--workspace"])])?;
    bench::count_on_host(gate)?;
    gate.commands(
        "tests, controller-core without features",
        &[Invocation::cargo(&["test", "-p", "controller-core", "--no-default-features"])],
    )?;
    budget::judge(gate)?;
    fuzz::run(gate)?;
    thumb::run(gate, &sets)?;
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
    use super::feature_sets;

    #[test]
    fn the_feature_sets_are_all_eight_and_begin_with_none() {
        let sets = feature_sets();
        assert_eq!(sets.len(), 8);
        assert_eq!((sets[0].as_str(), sets[7].as_str()), ("", "analysis,defmt,serde"));
    }
}
