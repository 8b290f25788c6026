#![doc = include_str!("../README.md")]

pub mod bounds;
pub mod chip;
pub mod commission;
pub mod compare;
pub mod design;
mod error;
pub mod figures;
pub mod gain_sets;
pub mod identify;
mod kind;
pub mod map;
pub mod margins;
pub mod monte_carlo;
pub mod number;
pub mod range;
pub mod tune;
mod watch;

pub use bounds::bounds;
pub use design::design;
pub use error::Error;
pub use identify::identify;
pub use map::map;
pub use margins::margins;
pub use monte_carlo::trials;
pub use tune::tune;
pub use watch::Watch;

/// Returns the size of a test: `full` for `DEEP=1`, which the part `shapes` of the deep tier sets, otherwise `fast`.
#[cfg(test)]
fn sized(full: usize, fast: usize) -> usize {
    if std::env::var_os("DEEP").is_some_and(|value| value == "1") { full } else { fast }
}
