//! What the suite measures with. Nothing here comes from the code under test: the tick is transcribed a second time
//! ([`oracle`]), the continuous law is taken from the print ([`printed`]), linear plants are exact
//! ([`truth`]). Only where the shipped loop itself is in question do the runs go through `loop-sim` ([`paper`]).
//!
//! | module | what |
//! |---|---|
//! | [`oracle`] | the discrete controller written for reading: unfolded, loops, f64 |
//! | [`printed`] | the continuous controller, Eq. (44)-(51), as printed |
//! | [`truth`] | linear plants, exact between ticks; a plain Runge-Kutta |
//! | [`shape`] | the shipped controller behind one trait, whatever its order, channels and precision |
//! | [`lanes`] | a controller in lanes beside the same one alone, of any shape |
//! | [`strategy`] | random designs and chains from a printed seed |
//! | [`recovery`] | the way back into the set M of a design: what is done to a controller, and the search for it |
//! | [`talk`] | the host's side of the wire by hand |
//! | [`close`] | comparing two signals |
//! | [`paper`] | the two examples of the paper, run through `loop-sim` |
//! | [`program`] | `host-sim` with its stdout, stderr and exit status |
//! | [`data`] | reading `tests/data` |
//! | [`golden`] | small tables a person can judge |

/// The page `docs/your-controller.md`, whose code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../docs/your-controller.md")]
pub struct YourController;

/// True if tests run at their full size: `DEEP=1`, which `cargo xtask test --deep shapes` sets. A long test has two
/// sizes and chooses by this.
pub fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

/// All of them in the deep tier, every `n`th in the fast one, the first among them.
pub fn sampled<I: IntoIterator>(all: I, n: usize) -> std::iter::StepBy<I::IntoIter> {
    all.into_iter().step_by(if deep() { 1 } else { n })
}

/// So many ticks in the deep tier, a twentieth in the fast one.
pub fn sized(ticks: usize) -> usize {
    if deep() { ticks } else { ticks / 20 }
}

pub mod close;
pub mod data;
pub mod drive;
pub mod golden;
pub mod lanes;
pub mod live;
pub mod oracle;
pub mod paper;
pub mod printed;
pub mod program;
pub mod recovery;
pub mod shape;
pub mod strategy;
pub mod talk;
pub mod truth;

/// The code of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
