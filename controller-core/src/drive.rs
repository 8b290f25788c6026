//! Drives: a motor with one encoder or a flexible joint with two, from encoder counts to the current command.
//!
//! A drive is the controller of this crate with the inputs of a servo drive: encoder counts instead of a state, and a
//! reference. One observer per encoder runs on the counts (module `block`). The nominal model maps the estimates to one
//! chain of integrators ([`ChainModel`]). The law then works on the errors from the reference ([`EncoderForm`]).
//!
//! | you want | go to |
//! |---|---|
//! | a motor with a rigid load | [`Motor`], [`MotorDesign::by_rule`], [`MotorDrive`] |
//! | a flexible joint with an encoder on each side | [`Joint`], [`JointDesign`], [`JointDrive`] |
//! | to describe the encoders | [`Encoder`]; a lost sample is `None` in [`Sample`] |
//! | to set the reference | [`Position`], [`Speed`] or [`Hold`], and a [`Target`] for each end of a tick |
//! | to plan the reference | [`Joined`], [`Sine`], [`Streamed`], [`Player`], [`shortest`], [`stop`] |
//! | to follow set-points that come at any time | [`Profile`] |
//! | to come to rest in friction, to stay within limits | [`RestBand`], [`Fence`] |
//! | to detect errors | the innovation gate of a design, [`Monitored`], [`Health`](crate::Health) |
//! | to tune in motion, to store state | `retune`, `words` of [`Running`](crate::Running), [`EncoderForm::at_rest`] |
//! | another plant | [`ChainModel`] with an example, [`map_error`] |
//! | a plant with a fully measured state | [`FullState`] |
//!
//! Once per period: sample the counts, tick, hold u. If the drive holds another current (a current limit, a brake),
//! call [`report_applied`](crate::Running::report_applied) before the next tick. This is the only anti-windup, and it
//! suffices. If the power stage provides less current for a while, call [`limit`](crate::Running::limit). For the
//! current of a motor:
//!
//! ```
//! use controller_core::drive::*;
//! use controller_core::{Health, Limits, Running};
//!
//! const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
//! const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
//! type Drive = MotorDrive<f32, Position>;
//! static DRIVE: Drive = Drive::design(&DESIGN);
//!
//! let mut drive = Running::new(&DRIVE);
//! // No current before the counts have agreed with each other for 10 ms.
//! let here = Target { turn: 0, jet: [0.0; 2] };
//! while drive.tick(&Sample { counts: [Some(0)], begin: here, end: here }).health.contains(Health::WAITS) {}
//!
//! let goal = Rest { turn: 0, angle: 1.0 };
//! let mut plan: Player<f32, _, 2> = Player::new(Joined::new(goal, [-1.0, 0.0, 0.0], 0, 100, 1e-3), 0);
//! for count in [0, 0, 1] {
//!     let [begin, end] = plan.next_tick();
//!     let output = drive.tick(&Sample { counts: [Some(count)], begin, end });
//!     assert!(output.health.is_ok());
//! }
//! assert!(drive.estimates().expect("started").position[0] > 0.0);
//! ```
//!
//! # Limitations
//! A drive does not handle backlash, resonances beyond the one spring, or more than three ticks of delay. It has no
//! identification. With one gain set it is a linear controller, and a well tuned cascade performs alike. Its benefits
//! are gains by rule from a data sheet, and estimates of load torque and speed. Two gain sets give a smaller peak under
//! a load, and one code serves motor and joint.

mod axis;
mod block;
mod chain;
mod converted;
mod coupled;
mod encoder;
mod error;
mod fence;
mod fields;
mod full_state;
mod joint;
mod law;
mod lower;
mod monitor;
mod motor;
mod numbers;
mod profile;
mod reference;
mod rest;
mod state;
mod target;
mod trigonometry;
mod two_mass;

pub use axis::{Axis, Frame, Stretch, replay};
pub use block::bessel_poles;
pub use chain::{ChainModel, map_error};
#[doc(hidden)]
pub use converted::NumberName;
pub use coupled::{JointRatios, JointTick, Regulator};
pub use encoder::{Encoder, Mounting, fingerprint};
pub use error::DriveError;
pub use fence::{FENCED, Fence, FenceLimits, Slowing};
pub use full_state::{FullState, FullStateMemory, Measured};
pub use joint::{Coupled, Joint, JointBandwidths, JointDesign, JointDrive, JointModel};
#[doc(hidden)]
pub use law::ANY_STAGE;
pub use law::{DriveEstimates, DriveLaw, EncoderForm, MOST_DELAY_TICKS, Sample};
pub use lower::LowerGains;
pub use monitor::{
    ALARMS, ANSWERED, BEYOND_CONTROL, BRAKING, Bounds, Monitored, MonitoredState, RUNAWAY, WatchTicks, Watched,
};
pub use motor::{DEFAULT_LAG_S, Motor, MotorBandwidths, MotorDesign, MotorDrive, MotorMargin, MotorModel, Switching};
pub use numbers::LAYOUT;
#[doc(hidden)]
pub use profile::{PROFILE_UNITS, jet_of_profile};
pub use profile::{Profile, ProfileLimits};
pub use reference::{FARTHEST_RAD, Joined, Player, Reference, Rest, Sine, Streamed, gap, shortest, stop};
#[doc(hidden)]
pub use reference::{jet_of_sine, jet_of_way, powers_of_join};
pub use rest::{RestBand, RestLearning, Resting};
pub use state::EncoderState;
pub use target::{Aim, Hold, Position, Speed, Target};
pub use trigonometry::sin_cos;
pub use two_mass::{CoupledDrive, TwoMass};
#[doc(hidden)]
pub use two_mass::{JointPush, Whole};

/// Expands to the drive types that match a form known only at run time.
///
/// It calls `$made!(args, aim, fast gain sets, ticks of delay, states)`. The form has three flags and the ticks of
/// delay. The flags are: follows a speed, has two gain sets, has observers with four states. More than three ticks of
/// delay count as three, because [`MotorDesign::validate`] rejects them.
///
/// A joint always follows a position with four states, and its type does not name these parameters. `quiet` selects one
/// gain set only.
///
/// ```
/// use controller_core::drive::{Encoder, Motor, MotorDesign, MotorDrive};
/// use controller_core::{Limits, drives};
///
/// const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
/// const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
/// macro_rules! size {
///     ($($types:tt)*) => { size_of::<MotorDrive<f32, $($types)*>>() };
/// }
/// let size = |flags: [bool; 3], delay_ticks: usize| drives!(motor (flags, delay_ticks) => size!());
/// assert!(size([false, true, false], 0) > size([false; 3], 0));
/// ```
#[macro_export]
macro_rules! drives {
    (motor $form:expr => $made:ident!($($given:tt)*)) => {
        match $form {
            ([false, false, false], 0) => $made!($($given)* $crate::drive::Position, 0, 0, 3),
            ([false, false, false], 1) => $made!($($given)* $crate::drive::Position, 0, 1, 3),
            ([false, false, false], 2) => $made!($($given)* $crate::drive::Position, 0, 2, 3),
            ([false, false, false], _) => $made!($($given)* $crate::drive::Position, 0, 3, 3),
            ([false, false, true], 0) => $made!($($given)* $crate::drive::Position, 0, 0, 4),
            ([false, false, true], 1) => $made!($($given)* $crate::drive::Position, 0, 1, 4),
            ([false, false, true], 2) => $made!($($given)* $crate::drive::Position, 0, 2, 4),
            ([false, false, true], _) => $made!($($given)* $crate::drive::Position, 0, 3, 4),
            ([false, true, false], 0) => $made!($($given)* $crate::drive::Position, 1, 0, 3),
            ([false, true, false], 1) => $made!($($given)* $crate::drive::Position, 1, 1, 3),
            ([false, true, false], 2) => $made!($($given)* $crate::drive::Position, 1, 2, 3),
            ([false, true, false], _) => $made!($($given)* $crate::drive::Position, 1, 3, 3),
            ([false, true, true], 0) => $made!($($given)* $crate::drive::Position, 1, 0, 4),
            ([false, true, true], 1) => $made!($($given)* $crate::drive::Position, 1, 1, 4),
            ([false, true, true], 2) => $made!($($given)* $crate::drive::Position, 1, 2, 4),
            ([false, true, true], _) => $made!($($given)* $crate::drive::Position, 1, 3, 4),
            ([true, false, false], 0) => $made!($($given)* $crate::drive::Speed, 0, 0, 3),
            ([true, false, false], 1) => $made!($($given)* $crate::drive::Speed, 0, 1, 3),
            ([true, false, false], 2) => $made!($($given)* $crate::drive::Speed, 0, 2, 3),
            ([true, false, false], _) => $made!($($given)* $crate::drive::Speed, 0, 3, 3),
            ([true, false, true], 0) => $made!($($given)* $crate::drive::Speed, 0, 0, 4),
            ([true, false, true], 1) => $made!($($given)* $crate::drive::Speed, 0, 1, 4),
            ([true, false, true], 2) => $made!($($given)* $crate::drive::Speed, 0, 2, 4),
            ([true, false, true], _) => $made!($($given)* $crate::drive::Speed, 0, 3, 4),
            ([true, true, false], 0) => $made!($($given)* $crate::drive::Speed, 1, 0, 3),
            ([true, true, false], 1) => $made!($($given)* $crate::drive::Speed, 1, 1, 3),
            ([true, true, false], 2) => $made!($($given)* $crate::drive::Speed, 1, 2, 3),
            ([true, true, false], _) => $made!($($given)* $crate::drive::Speed, 1, 3, 3),
            ([true, true, true], 0) => $made!($($given)* $crate::drive::Speed, 1, 0, 4),
            ([true, true, true], 1) => $made!($($given)* $crate::drive::Speed, 1, 1, 4),
            ([true, true, true], 2) => $made!($($given)* $crate::drive::Speed, 1, 2, 4),
            ([true, true, true], _) => $made!($($given)* $crate::drive::Speed, 1, 3, 4),
        }
    };
    (joint $form:expr => $made:ident!($($given:tt)*)) => {
        match $form {
            ([_, false, _], 0) => $made!($($given)* $crate::drive::Position, 0, 0),
            ([_, false, _], 1) => $made!($($given)* $crate::drive::Position, 0, 1),
            ([_, false, _], 2) => $made!($($given)* $crate::drive::Position, 0, 2),
            ([_, false, _], _) => $made!($($given)* $crate::drive::Position, 0, 3),
            ([_, true, _], 0) => $made!($($given)* $crate::drive::Position, 1, 0),
            ([_, true, _], 1) => $made!($($given)* $crate::drive::Position, 1, 1),
            ([_, true, _], 2) => $made!($($given)* $crate::drive::Position, 1, 2),
            ([_, true, _], _) => $made!($($given)* $crate::drive::Position, 1, 3),
        }
    };
    (quiet motor $form:expr => $made:ident!($($given:tt)*)) => {
        match $form {
            ([false, _, false], 0) => $made!($($given)* $crate::drive::Position, 0, 0, 3),
            ([false, _, false], 1) => $made!($($given)* $crate::drive::Position, 0, 1, 3),
            ([false, _, false], 2) => $made!($($given)* $crate::drive::Position, 0, 2, 3),
            ([false, _, false], _) => $made!($($given)* $crate::drive::Position, 0, 3, 3),
            ([false, _, true], 0) => $made!($($given)* $crate::drive::Position, 0, 0, 4),
            ([false, _, true], 1) => $made!($($given)* $crate::drive::Position, 0, 1, 4),
            ([false, _, true], 2) => $made!($($given)* $crate::drive::Position, 0, 2, 4),
            ([false, _, true], _) => $made!($($given)* $crate::drive::Position, 0, 3, 4),
            ([true, _, false], 0) => $made!($($given)* $crate::drive::Speed, 0, 0, 3),
            ([true, _, false], 1) => $made!($($given)* $crate::drive::Speed, 0, 1, 3),
            ([true, _, false], 2) => $made!($($given)* $crate::drive::Speed, 0, 2, 3),
            ([true, _, false], _) => $made!($($given)* $crate::drive::Speed, 0, 3, 3),
            ([true, _, true], 0) => $made!($($given)* $crate::drive::Speed, 0, 0, 4),
            ([true, _, true], 1) => $made!($($given)* $crate::drive::Speed, 0, 1, 4),
            ([true, _, true], 2) => $made!($($given)* $crate::drive::Speed, 0, 2, 4),
            ([true, _, true], _) => $made!($($given)* $crate::drive::Speed, 0, 3, 4),
        }
    };
    (quiet joint $form:expr => $made:ident!($($given:tt)*)) => {
        match $form {
            ([_, _, _], 0) => $made!($($given)* $crate::drive::Position, 0, 0),
            ([_, _, _], 1) => $made!($($given)* $crate::drive::Position, 0, 1),
            ([_, _, _], 2) => $made!($($given)* $crate::drive::Position, 0, 2),
            ([_, _, _], _) => $made!($($given)* $crate::drive::Position, 0, 3),
        }
    };
}
