#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod c;
pub mod drive;
pub mod joined;
mod law;
mod merge;
pub mod monitor;
pub mod plan;
pub mod record;
mod recorder;
pub mod text;

#[doc(inline)]
pub use law::{Drift, Functions, Recorded, Whole, chain, coefficients, controller, functions, linear, tick, whole};
#[doc(inline)]
pub use record::{Block, End, Id, Op, Port, Record, Role, Step, Test, Value, ValueKind, Word};
#[doc(inline)]
pub use recorder::{CountSymbol, Recorder, Symbol, record};
