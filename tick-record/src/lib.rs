//! The tick of `controller-core` as a list of operations: recorded, not written.
//!
//! A control law is generic over its scalar. Run with [`Symbol`] it computes nothing and writes down what it would
//! compute; from all ways through it comes one [`Record`]. So other forms of the tick, C first, need no second text of
//! it: who changes the tick changes them.
//!
//! ```text
//! ControlLaw over Symbol --record--> Record --run--> the bits of the tick, here
//!                                       |---c::Function--> C99
//!                                       `---> what else reads operations: a scheduler, a prover
//! ```
//!
//! | you want | go to |
//! |---|---|
//! | the functions of a controller | [`linear`], [`controller`], [`Functions`] |
//! | those of another law | [`functions`], [`Recorded`] |
//! | to know what an operation means | [`Record`] and its page |
//! | C | [`c`] |
//!
//! ```
//! use tick_record::{Role, Word, record};
//!
//! let clamped = record(|recorder| {
//!     let x = recorder.number("x", Role::Argument);
//!     let one = recorder.constant("one", 1.0);
//!     let y = if x > one { one } else { x + x };
//!     recorder.put("y", Role::Output, y);
//! });
//! // One addition, one comparison, one select: no branch is left.
//! assert_eq!(clamped.body.steps.len(), 3);
//! assert_eq!(clamped.run(&[Word::Number(0.25_f32)]), [Word::Number(0.5)]);
//! ```
//!
//! # What can be recorded
//! Whatever computes with `+ - * /`, comparisons, `abs`, and counts that wrap, in loops whose length does not depend on a
//! number. A function that converts a symbol to f64 gets NaN.
#![forbid(unsafe_code)]

pub mod c;
mod law;
mod merge;
pub mod record;
mod recorder;

#[doc(inline)]
pub use law::{Functions, Recorded, controller, functions, linear};
#[doc(inline)]
pub use record::{Block, End, Id, Kind, Op, Port, Record, Role, Step, Test, Value, Word};
#[doc(inline)]
pub use recorder::{CountSymbol, Recorder, Symbol, record};
