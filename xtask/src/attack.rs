//! Random campaigns: ticks, scenario files, bytes on the wire, ELF files, bad boards, drawn anew each time. What they
//! are stands in the head of `tests/attack/main.rs`; the profile is that of the tests, so that nothing is compiled
//! twice and every overflow is a panic.
//!
//! All other steps are the same in every run. This one is not, on purpose: a fixed seed finds nothing after its first
//! run, and a campaign that runs every night sees other input each time. So it may fail with a change
//! that is innocent: the fault was there before, and the command that it prints repeats it.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::step::{Gate, Outcome};

/// Of the campaigns together, in the deep tier.
const SECONDS: &str = "60";

/// Runs the campaigns with the arguments behind the command; without any, to the full amounts.
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
