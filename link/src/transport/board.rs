//! Targets outside of this process: firmware in the emulator, a board on a serial port, and their logs.

use std::net::TcpStream;
use std::path::Path;

pub use cycle_bound::log::{Log, Messages};
pub use cycle_bound::qemu::{Process, is_last};

mod emulator;
mod serial;

pub use emulator::Emulator;
pub use serial::Serial;

/// Boots a firmware for its log only. One instruction takes 1 ns of emulated time.
///
/// # Errors
/// Fails like [`Process::start`].
pub fn logged(image: &Path) -> Result<(Process, TcpStream), String> {
    use cycle_bound::qemu::Clock;
    let (process, [_, stream]) = Process::start(image, [false, true], Clock::Instructions, None)?;
    let stream = stream.ok_or_else(|| process.ended("no connection to the emulator"))?;
    Ok((process, stream))
}

/// Returns true for the errors by which operating systems report a timeout.
fn is_silence(kind: std::io::ErrorKind) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, TimedOut | WouldBlock | Interrupted)
}
