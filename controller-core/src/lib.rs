#![doc = include_str!("../README.md")]
//!
//! # The plant
//! The plant is a chain of n integrators. Every channel has a disturbance, and only the last channel has an input (Eq.
//! (39)):
//!
//! $$ \dot x_i = x_{i+1} + d_i(x,t)\ (i < n), \qquad \dot x_n = a(x) + b(x)u + d_n(x,u,t), \qquad y = x_1 $$
//!
//! Equation numbers refer to *Sliding Mode Control for Mismatched Uncertain Systems Using an Extended Disturbance
//! Observer*. A `# Deviation` paragraph marks every place where this crate differs from it. Channels count from 1 in
//! text and messages, and from 0 in arrays.
//!
//! # Features
//! Features never change a numerical result.
//! * `analysis` adds the modules that need matrices (nalgebra).
//! * `defmt` makes every public value loggable: the design ([`Config`] and its fields), the errors and warnings,
//!   [`Output`], [`Health`] and [`Record`]. [`Controller`], [`State`] and [`History`] are left out. Their numbers are
//!   in units of the tick, and a ring is logged record by record.
//! * `serde` reads and writes the types that hold no array of generic length: [`Output`], [`Health`], [`Fallback`],
//!   [`ReachingLaw`], [`Limits`], [`Pole`], [`JointParameters`], [`JointChain`], [`Reading`]. It only writes
//!   [`ConfigError`], [`Warning`] and [`Warnings`]. serde cannot derive for `[T; N]` with a generic N. So [`Config`],
//!   [`Surface`], [`ObserverGains`], [`Nominal`] and [`Record`] have no impl. Keep their numbers in a type of your own
//!   (as a scenario file does) and build them from it.
#![no_std]
#![forbid(unsafe_code)]

pub mod config;
pub mod controller;
pub mod design;
pub mod drive;
pub mod elementary;
pub mod error;
mod exponential;
pub mod gate;
pub mod health;
pub mod history;
pub mod law;
mod matrix;
pub mod model;
pub mod models;
pub mod modes;
pub mod observer;
mod polynomial;
pub mod real;
pub mod running;
pub mod shape;
pub mod state;
pub mod surface;

#[cfg(feature = "analysis")]
pub mod bounds;
#[cfg(feature = "analysis")]
pub mod error_dynamics;

#[doc(inline)]
pub use config::{AnyConfig, Config, Fallback, INPUT_LIMIT, Options, Shape};
#[doc(inline)]
pub use controller::{Controller, Output};
#[doc(inline)]
pub use design::{Coefficients, LAYOUT};
#[doc(inline)]
pub use elementary::{Exp, Libm, Micromath};
#[doc(inline)]
pub use error::{Cause, ConfigError, Field, Remedy, Warning, Warnings};
#[doc(inline)]
pub use gate::{Gate, Gated, GatedState, SampleLimits};
#[doc(inline)]
pub use health::Health;
#[doc(inline)]
pub use history::{History, Record};
#[doc(inline)]
pub use law::{Limits, ReachingLaw};
#[doc(inline)]
pub use model::{Linear, Nominal, NominalModel};
#[doc(inline)]
pub use models::{Benchmark, FlexibleJoint, JointChain, JointParameters, Reading};
#[doc(inline)]
pub use modes::modes_ok;
#[doc(inline)]
pub use observer::{ObserverGains, Pole};
#[doc(inline)]
pub use real::Real;
#[doc(hidden)]
pub use real::{Count, Sealed};
#[doc(inline)]
pub use running::{ControlLaw, Guessing, RetuneError, Running, Words, WordsError, fingerprint_with};
#[doc(inline)]
pub use shape::channels;
#[doc(inline)]
pub use state::{Lanes, State};
#[doc(inline)]
pub use surface::Surface;

/// Version of this crate. A design is valid only under the version that made it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Version of this crate as a number, one byte each for major, minor and patch. A pre-release has the number of its
/// release.
pub const VERSION_NUMBER: u32 = version(VERSION);
/// Largest plant order n. Plant orders are 2..=`MAX_N`.
pub const MAX_N: usize = 6;
/// Largest observer order r. Observer orders are 1..=`MAX_R`.
pub const MAX_R: usize = 3;

const fn version(text: &str) -> u32 {
    let bytes = text.as_bytes();
    let (mut packed, mut part, mut i) = (0, 0, 0);
    while i < bytes.len() && bytes[i] != b'-' && bytes[i] != b'+' {
        if bytes[i] == b'.' {
            packed = packed << 8 | part;
            part = 0;
        } else {
            assert!(bytes[i].is_ascii_digit(), "a version is three numbers");
            part = part * 10 + (bytes[i] - b'0') as u32;
        }
        i += 1;
    }
    packed << 8 | part
}

const fn assert_order(n: usize) {
    assert!(n >= 2 && n <= MAX_N, "the plant order N must be 2..=6");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pre_release_has_the_number_of_the_release_that_it_is_for() {
        for text in ["0.2.10", "0.2.10-rc.1", "0.2.10-alpha", "0.2.10+build.7", "0.2.10-rc.1+7"] {
            assert_eq!(version(text), 0x0000_020a, "{text}");
        }
    }
}
