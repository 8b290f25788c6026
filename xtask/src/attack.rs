//! Random campaigns with ticks, scenario files, bytes on the serial line, ELF files and bad boards. The head of
//! `tests/attack/main.rs` describes them. The profile is the profile of the tests, so nothing is compiled twice and
//! every overflow panics.
//!
//! All other steps are identical in every run. This step uses a new seed in each run, because a fixed seed finds
//! nothing after its first run. The step can therefore fail with an unrelated change, if the fault existed before. The
//! command that it prints repeats the failure.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::step::{Gate, Outcome};

/// Duration of all campaigns together in the deep tier, s.
const SECONDS: &str = "60";

/// Runs the campaigns with the arguments behind the command; without arguments, with the full amounts.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    gate.step("attack", |gate| gate.built()?.program("attack")?.with(&arguments).run(gate))
}

/// Runs the campaigns for a minute, with a new seed.
pub(crate) fn minute(gate: &mut Gate) -> Outcome {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let seed = now.to_string();
    gate.step(&format!("attack, one minute, seed {seed}"), |gate| {
        gate.built()?.program("attack")?.with(&["--seed", &seed, "--seconds", SECONDS]).run(gate)
    })
}
