//! The first command: `cargo build --release` with the default features, as a newcomer has it.
//!
//! The tests run a build with every feature. This part runs the default one: the commands of the README's first screen
//! succeed, a left-out command prints one line with its feature and exits with status 2, and a program outside the
//! workspace calls `study`.

use crate::step::{Gate, Invocation, Outcome};

const RERUN: &str = "cargo xtask test --deep first";
/// Separate target folder, so that the build of the tests stays valid.
const TARGET_DIR: &str = "target/first";
/// Working folder, and the program's path relative to it.
const FOLDER: &str = "target/first-run";
const PROGRAM: &str = "../first/release/host-sim";

/// Commands of the default build, in an empty folder.
const COMMANDS: [&str; 10] = [
    "new mine --plant motor",
    "run mine.toml --out run",
    "design mine.toml",
    "tune mine.toml --load 0.01 --evaluations 40 --to tuned.toml --out tune",
    "map mine.toml --preset plant --out map",
    "export mine.toml --lang c --standalone -o drive.h",
    "export mine.toml --lang rust -o drive.rs",
    "monte-carlo mine.toml --uncertain 50 --trials 40 --chunk 20 --shard 1/2 --out shards",
    "monte-carlo mine.toml --uncertain 50 --trials 40 --chunk 20 --shard 2/2 --out shards",
    "merge shards/shard-1-of-2.csv shards/shard-2-of-2.csv --out both",
];

/// A program outside the workspace that calls `study`, and the scenario that it reads.
const EXAMPLE: &str = "examples/study/Cargo.toml";
const SCENARIO: &str = "target/first-run/mine.toml";

/// Left-out commands and the feature that each one names.
const LEFT_OUT: [(&str, &str); 7] = [
    ("pil mine.toml", "chip"),
    ("hil --port /dev/none", "chip"),
    ("emulate --image none", "chip"),
    ("live", "chip"),
    ("budget", "chip"),
    ("export mine.toml --asm -o tick.S", "asm"),
    ("export mine.toml --standalone -o proved.h --certificate proved.txt", "proof"),
];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let build = Invocation::cargo(&["build", "--release", "--target-dir", TARGET_DIR]);
    gate.commands("host-sim with the default features", &[build])?;
    gate.step("commands of the default build", |gate| {
        gate.empty_folder(FOLDER, RERUN)?;
        COMMANDS.iter().try_for_each(|words| invocation(words).run(gate))
    })?;
    let example = |command: &str, arguments: &[&str]| {
        let shared = [command, "--manifest-path", EXAMPLE, "--release", "--target-dir", TARGET_DIR, "--"];
        Invocation::cargo(&shared).with(arguments)
    };
    let example = [example("clippy", &["-D", "warnings"]), example("run", &[SCENARIO])];
    gate.commands("an external program that calls study", &example)?;
    gate.check("left-out commands name their feature", RERUN, |gate| {
        for (words, feature) in LEFT_OUT {
            left_out(gate, words, feature)?;
        }
        Ok(format!("{} commands", LEFT_OUT.len()))
    })
}

/// Returns the invocation of the program with these arguments in [`FOLDER`].
fn invocation(words: &str) -> Invocation {
    Invocation::new("env", &["-C", FOLDER, PROGRAM]).with(&words.split(' ').collect::<Vec<_>>())
}

/// Checks that a command prints one line with its feature and exits with status 2.
fn left_out(gate: &Gate, words: &str, feature: &str) -> Result<(), String> {
    let invocation = invocation(words);
    let mut command = invocation.command();
    let output = command.current_dir(&gate.root).output().map_err(|error| format!("{invocation}: {error}"))?;
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    let names_it = said.contains(&format!("cargo run --release --features {feature} -- "));
    if output.status.code() == Some(2) && names_it && said.trim().lines().count() == 1 {
        return Ok(());
    }
    Err(format!("{invocation}: expected one line that names the feature {feature} and status 2, found:\n{said}"))
}
