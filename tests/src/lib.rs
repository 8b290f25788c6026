//! Reference implementations and tools of the test suite. None of the references uses the code under test. The tick is
//! transcribed a second time ([`oracle`]), the continuous controller follows the print ([`printed`]), and linear plants
//! are exact ([`truth`]). Runs go through `loop-sim` ([`paper`]) only where the test is about the shipped loop.
//!
//! | module | content |
//! |---|---|
//! | [`oracle`] | the discrete controller written for reading: unfolded, loops, f64 |
//! | [`printed`] | the continuous controller, Eq. (44)-(51), as printed |
//! | [`truth`] | linear plants, exact between ticks; a plain Runge-Kutta |
//! | [`shape`] | the shipped controller behind one trait, for every order, channel set and precision |
//! | [`lanes`] | a vectorised batch compared with the single controller |
//! | [`strategy`] | random designs and chains from a printed seed |
//! | [`recovery`] | recovery into the set M of a design: attacks on a controller, and the search for them |
//! | [`talk`] | the host's side of the serial protocol, written by hand |
//! | [`close`] | comparison of two signals |
//! | [`paper`] | the two examples of the paper, run through `loop-sim` |
//! | [`program`] | `host-sim` with its stdout, stderr and exit status |
//! | [`data`] | reader of `tests/data` |
//! | [`golden`] | small tables for review by a person |

/// The page `docs/your-controller.md`, whose code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../docs/your-controller.md")]
pub struct YourController;

/// Returns true if tests run at full size: `DEEP=1`, which `cargo xtask test --deep shapes` sets. A long test has two
/// sizes and chooses by this flag.
pub fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

/// Returns all items in the deep tier and every `n`th in the fast tier, starting with the first.
pub fn sampled<I: IntoIterator>(all: I, n: usize) -> std::iter::StepBy<I::IntoIter> {
    all.into_iter().step_by(if deep() { 1 } else { n })
}

/// Returns `ticks` in the deep tier and a twentieth of it in the fast tier.
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

/// The code of `docs/own-plant.md` compiles.
#[cfg(doctest)]
#[doc = include_str!("../../docs/own-plant.md")]
struct OwnPlant;

/// The code of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
