//! The fast tier, `cargo xtask test`, runs before each commit and in CI; `cargo xtask test --deep` runs the deep tier.
//!
//! It drives cargo by command line and links none of our crates, so it can tell what is wrong when they do not build.
//! Each step is numbered and timed; the first that fails ends the run with the exact command to repeat it.

mod attack;
mod bench;
mod budget;
mod built;
mod capi;
mod cluster;
mod compiler;
mod docs;
mod evidence;
mod firmware;
mod first;
mod fuzz;
mod means;
mod mutate;
mod paper_map;
mod prove;
mod python;
mod sbom;
mod scan;
mod setup;
mod step;
mod test;
mod thumb;
mod traceability;
mod wasm;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use step::{Gate, Outcome};

struct Action {
    name: &'static str,
    help: &'static str,
    run: fn(&mut Gate) -> Outcome,
}

const ACTIONS: [Action; 26] = [
    Action { name: "setup", help: "check the tools; install what is missing where that is possible", run: setup::run },
    Action {
        name: "test",
        help: "the fast tier: lints, docs, one build, images, tests, ceilings, machine code of the image",
        run: test::run,
    },
    Action {
        name: DEEP,
        help: "the deep tier: full sizes, in parts side by side; [PART ..] of shapes, machine, mutation, ..",
        run: test::deep,
    },
    Action { name: test::CHIP, help: "lint and build what is for the chip: images, archive for C", run: test::chip },
    Action {
        name: test::JUDGE,
        help: "judge what was built: machine code, ceilings, instructions on the host",
        run: test::judge,
    },
    Action { name: "assembly", help: "search the assembly of the images anew, a minute", run: means::search },
    Action { name: "firmware", help: "build the images for the chip and say how large they are", run: firmware::run },
    Action { name: "bench", help: "what a tick costs on the chip beside other code, as a table", run: bench::run },
    Action {
        name: "bench lanes",
        help: "how fast many closed loops are on this machine, beside SciPy, numba and C, as a table",
        run: bench::lanes,
    },
    Action {
        name: "budget",
        help: "build the images and hold what each instance costs to firmware/budgets.toml",
        run: budget::run,
    },
    Action {
        name: "means",
        help: "hold the machine code of image and exported C to the record of the tick, path by path",
        run: means::run,
    },
    Action {
        name: "capi",
        help: "build archive, header and examples for firmware in C",
        run: |gate| capi::run(gate, capi::Cores::All),
    },
    Action { name: "docs", help: "build the documentation without a warning, and check its formulas", run: docs::run },
    Action { name: "tables", help: "compute the tables and figures of docs anew, a minute", run: docs::tables },
    Action {
        name: "docs --offline",
        help: "the same, with KaTeX beside the pages, so that formulas need no connection",
        run: docs::offline,
    },
    Action {
        name: ATTACK,
        help: "random campaigns with a seed of their own, minutes long; [--seed N] [--seconds S] [--only CAMPAIGN]",
        run: attack::run,
    },
    Action { name: "fuzz", help: "libFuzzer against both targets of the wire", run: fuzz::run },
    Action {
        name: "wasm",
        help: "the closed loop in WebAssembly: builds, and has the bits of this machine",
        run: wasm::run,
    },
    Action {
        name: "cluster",
        help: "shards of a Monte Carlo run on two Dask workers, one killed: the same bytes; and read by pyarrow",
        run: cluster::run,
    },
    Action {
        name: "prove",
        help: "statements about the shipped ticks for every input, proved; faults put in on purpose, noticed",
        run: prove::run,
    },
    Action { name: "prove --all", help: "the same, and every other shipped instance tried", run: prove::all },
    Action {
        name: "evidence",
        help: "the C that users get before MISRA's addon, two compilers and their analysers",
        run: evidence::run,
    },
    Action { name: "eva", help: "the same before Frama-C's Eva, which no tier installs", run: evidence::eva },
    Action { name: "paper-map", help: "check docs/paper-map.md against the sources", run: paper_map::run },
    Action { name: "sbom", help: "bills of materials (SPDX) of the built images and archives", run: sbom::run },
    Action { name: "mutate", help: "break symbols of the paper: do the tests of the map fail?", run: mutate::run },
];

/// The commands that take arguments, and check them themselves.
const ATTACK: &str = "attack";
const DEEP: &str = "test --deep";

fn main() -> ExitCode {
    if let Some(root) = std::env::var_os(compiler::ROOT) {
        return compiler::compile(&root);
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = arguments.join(" ");
    if ["", "help", "-h", "--help"].contains(&&*asked) {
        println!("cargo xtask COMMAND\n");
        for Action { name, help, .. } in ACTIONS {
            println!("  {name:<14} {help}");
        }
        println!("  {:<14} this list", "help");
        return ExitCode::SUCCESS;
    }
    let begins = |name: &str| asked.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '));
    let is_asked =
        |action: &&Action| action.name == asked || ([ATTACK, DEEP].contains(&action.name) && begins(action.name));
    let Some(Action { run, .. }) = ACTIONS.iter().find(is_asked) else {
        return misused(&format!("unknown command `{asked}`: did you mean `{}`?", nearest(&asked)));
    };
    let mut gate = Gate::new(root());
    let outcome = run(&mut gate);
    gate.conclude(&asked, &outcome);
    if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn misused(message: &str) -> ExitCode {
    eprintln!("{message}\n`cargo xtask help` lists the commands");
    ExitCode::from(2)
}

fn nearest(asked: &str) -> &'static str {
    let distance = |name: &str| strsim::damerau_levenshtein(asked, name);
    ACTIONS.iter().map(|action| action.name).chain(["help"]).min_by_key(|name| distance(name)).unwrap_or("help")
}

/// The workspace: xtask lies directly in it.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

#[cfg(test)]
mod tests {
    use super::{DEEP, nearest};

    #[test]
    fn a_slip_of_the_finger_finds_the_command_that_was_meant() {
        assert_eq!(nearest("tets"), "test");
        assert_eq!(nearest("test -deep"), DEEP);
        assert_eq!(nearest("papermap"), "paper-map");
        assert_eq!(nearest("stup"), "setup");
        assert_eq!(nearest("hlep"), "help");
    }
}
