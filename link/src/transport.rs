//! Byte transport to a target, over any kind of link.
//!
//! | link | target |
//! |---|---|
//! | [`Loopback`] | the target side of the protocol in this process, without delay |
//! | [`Emulator`] | firmware in QEMU, over TCP to its USART1 |
//! | [`Serial`] | a board, over a serial port |
//! | [`Faulty`] | any link, with lost, damaged, doubled and delayed frames |
//! | [`Stoppable`] | any link, with Ctrl-C ending the wait |

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

/// Baud rate of the firmware of this project, bit/s.
pub const BAUD: u32 = 115_200;

/// Permanent failure of a link, as a message. A fault that a repetition may repair is not an error: nothing is
/// received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransportError(pub String);

impl fmt::Display for TransportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for TransportError {}

/// Link that transports bytes, without frames.
pub trait Transport: Send {
    /// Sends the bytes of one frame.
    ///
    /// # Errors
    /// Fails if the link is broken.
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Waits for bytes for at most `within` and returns their number. They may be a part of a frame or several frames.
    /// 0 means that nothing arrived in time.
    ///
    /// # Errors
    /// Fails if the link is broken.
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

/// Moves as many bytes as fit from a queue. Returns their number.
fn take(queue: &mut std::collections::VecDeque<u8>, into: &mut [u8]) -> usize {
    let len = into.len().min(queue.len());
    for (to, from) in into.iter_mut().zip(queue.drain(..len)) {
        *to = from;
    }
    len
}
