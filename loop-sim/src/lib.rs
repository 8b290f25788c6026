#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod actuator;
pub mod closed_loop;
pub mod exact;
pub mod exponential;
pub mod expression;
#[cfg(feature = "lanes")]
pub mod lanes;
pub mod linear;
pub mod metrics;
pub mod philox;
pub mod plant;
pub mod port;
pub mod random;
pub mod sensor;
pub mod signal;
pub mod sine;
pub mod solver;
pub mod trace;

/// Highest order of a plant.
pub const MAX_ORDER: usize = 6;
