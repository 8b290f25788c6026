//! Bytes to a target and back, over a wire of any kind.
//!
//! | wire | to |
//! |---|---|
//! | [`Loopback`] | the target's side of the talk in this process: no time passes |
//! | [`Emulator`] | an image in QEMU, over TCP to its USART1 |
//! | [`Serial`] | a board, over a serial port |
//! | [`Faulty`] | any of them, with frames lost, damaged, doubled and late |
//! | [`Stoppable`] | any of them, with an end to waiting on Ctrl-C |

use std::fmt;
use std::time::Duration;

#[cfg_attr(not(feature = "chip"), path = "transport/no_board.rs")]
pub mod board;
pub mod faulty;
pub mod loopback;
pub mod stoppable;

pub use board::{Emulator, Serial};
pub use faulty::Faulty;
pub use loopback::Loopback;
pub use stoppable::Stoppable;

/// Speed of the images that come with this project, bits per second.
pub const BAUD: u32 = 115_200;

/// A wire that is broken for good, in words. What a repetition may heal is no error: then nothing is received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransportError(pub String);

impl fmt::Display for TransportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for TransportError {}

/// A wire. It knows bytes and time, no frames.
pub trait Transport: Send {
    /// Hands the bytes of one frame to the wire.
    ///
    /// # Errors
    /// When the wire is broken.
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Waits for bytes at most `within`, and returns how many there are now: some of a frame, or of several. 0 means
    /// that nothing came in time.
    ///
    /// # Errors
    /// When the wire is broken.
    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError>;
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        (**self).send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        (**self).receive(into, within)
    }
}

/// Moves what fits from a queue; returns how much that is.
fn take(queue: &mut std::collections::VecDeque<u8>, into: &mut [u8]) -> usize {
    let len = into.len().min(queue.len());
    for (to, from) in into.iter_mut().zip(queue.drain(..len)) {
        *to = from;
    }
    len
}
