//! Test tiers: `cargo xtask test` runs the fast tier, before each commit and in CI; `cargo xtask test --deep` runs the
//! deep tier.
//!
//! The program calls cargo by command line and links none of the workspace crates, so it can report errors when they do
//! not build. Each step has a number and a duration. The first failed step ends the run with the exact command to
//! repeat it.

mod attack;
mod bench;
mod book;
mod budget;
mod built;
mod capi;
mod cluster;
mod compiler;
mod dist;
mod docs;
mod evidence;
mod firmware;
mod first;
mod fmu;
mod fuzz;
mod links;
mod means;
mod mutate;
mod packages;
mod paper_map;
mod prose;
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
mod web;
mod wheel;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use step::{Gate, Outcome};

struct Action {
    name: &'static str,
    help: &'static str,
    run: fn(&mut Gate) -> Outcome,
}

const ACTIONS: [Action; 31] = [
    Action { name: "setup", help: "check the tools and install missing ones where possible", run: setup::run },
    Action {
        name: "test",
        help: "run the fast tier: lints, docs, build, images, tests, budgets, machine code",
        run: test::run,
    },
    Action {
        name: DEEP,
        help: "run the deep tier, in parallel parts; [PART ..]: shapes, machine, mutation, ..",
        run: test::deep,
    },
    Action { name: test::CHIP, help: "lint and build for the chip: images, C library", run: test::chip },
    Action {
        name: test::JUDGE,
        help: "check the built files: machine code, budgets, host instructions",
        run: test::judge,
    },
    Action { name: "assembly", help: "schedule the assembly of the images again (a minute)", run: means::search },
    Action { name: "firmware", help: "build the images for the chip and print their sizes", run: firmware::run },
    Action { name: "bench", help: "measure a tick on the chip and compare it with other code", run: bench::run },
    Action {
        name: "bench lanes",
        help: "measure closed loops on this machine against SciPy, numba and C",
        run: bench::lanes,
    },
    Action { name: "budget", help: "build the images and check the limits in firmware/budgets.toml", run: budget::run },
    Action {
        name: "means",
        help: "validate the machine code of images and exported C against the tick",
        run: means::run,
    },
    Action {
        name: CAPI,
        help: "build library, header and examples for firmware in C; [CORE]: one of thumbv7em, .., host",
        run: capi::asked,
    },
    Action { name: "docs", help: "build the documentation without warnings and check its formulas", run: docs::run },
    Action { name: "tables", help: "compute the tables and figures of docs again (a minute)", run: docs::tables },
    Action {
        name: "docs --offline",
        help: "build the documentation with a local KaTeX, for reading offline",
        run: docs::offline,
    },
    Action {
        name: ATTACK,
        help: "run random campaigns (minutes); [--seed N] [--seconds S] [--only CAMPAIGN]",
        run: attack::run,
    },
    Action { name: "fuzz", help: "fuzz both targets of the serial protocol with libFuzzer", run: fuzz::run },
    Action {
        name: "wasm",
        help: "compare the closed loop in WebAssembly with this machine, bit for bit",
        run: wasm::run,
    },
    Action { name: "web", help: "build the live page, target/web/page, and print its sizes", run: web::run },
    Action {
        name: "cluster",
        help: "test Monte Carlo shards on two Dask workers and pyarrow's reader",
        run: cluster::run,
    },
    Action {
        name: "prove",
        help: "prove statements about the shipped ticks and detect inserted faults",
        run: prove::run,
    },
    Action { name: "prove --all", help: "prove the statements for every shipped instance", run: prove::all },
    Action {
        name: "evidence",
        help: "analyse the C for users: MISRA addon, two compilers, analysers",
        run: evidence::run,
    },
    Action {
        name: "eva",
        help: "analyse the exported C with Frama-C's Eva (not installed by any tier)",
        run: evidence::eva,
    },
    Action { name: "paper-map", help: "check the equations of docs/paper.md against the sources", run: paper_map::run },
    Action { name: "book", help: "build the documentation as a book, target/book/docs/index.html", run: book::run },
    Action { name: "prose", help: "check pages and comments against the style sheet, and all links", run: prose::run },
    Action { name: "prose --lower", help: "lower the limits of the comments to the present counts", run: prose::lower },
    Action { name: "dist", help: "build the files of a release into target/dist, and use them", run: dist::run },
    Action { name: "sbom", help: "write bills of materials (SPDX) of the built images and libraries", run: sbom::run },
    Action {
        name: "mutate",
        help: "break symbols of the paper and check that the mapped tests fail",
        run: mutate::run,
    },
];

/// Commands with arguments, which they check themselves.
const ATTACK: &str = "attack";
const CAPI: &str = "capi";
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
        println!("  {:<14} print this list", "help");
        return ExitCode::SUCCESS;
    }
    let begins = |name: &str| asked.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '));
    let is_asked =
        |action: &&Action| action.name == asked || ([ATTACK, CAPI, DEEP].contains(&action.name) && begins(action.name));
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

/// Returns the folder of the workspace, the parent of xtask's folder.
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
