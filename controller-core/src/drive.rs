//! Drives: a motor with one encoder, a flexible joint with two, from counts to current.

mod block;
mod chain;
mod encoder;
mod error;
mod joint;
mod law;
mod monitor;
mod motor;
mod reference;
mod state;
mod target;
mod trigonometry;

pub use chain::{ChainModel, map_error};
pub use encoder::Encoder;
pub use error::DriveError;
pub use joint::{Joint, JointBandwidths, JointDesign, JointDrive, JointModel};
pub use law::{DriveEstimates, EncoderForm, Sample};
pub use monitor::{Bounds, GoOn, Monitored, MonitoredState, Reaction, Stop, Watched};
pub use motor::{DEFAULT_LAG_S, Motor, MotorBandwidths, MotorDesign, MotorDrive, MotorModel, Switching};
pub use reference::{Joined, Player, Reference, Rest, Sine, Streamed, gap, shortest, stop};
pub use state::EncoderState;
pub use target::{Aim, Hold, Position, Speed, Target};
