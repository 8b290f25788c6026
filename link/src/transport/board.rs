//! Targets outside of this process: an image in the emulator, a board at a serial port, and what they log.

use std::net::TcpStream;
use std::path::Path;

pub use cycle_bound::log::{Log, Messages};
pub use cycle_bound::qemu::{Process, is_last};

mod emulator;
mod serial;

pub use emulator::Emulator;
pub use serial::Serial;

/// Boots an image whose log is all that is wanted of it; one instruction takes 1 ns of its time.
///
/// # Errors
/// Those of [`Process::start`].
pub fn logged(image: &Path) -> Result<(Process, TcpStream), String> {
    use cycle_bound::qemu::Clock;
    let (process, [_, stream]) = Process::start(image, [false, true], Clock::Instructions, None)?;
    let stream = stream.ok_or_else(|| process.ended("no connection to the emulator"))?;
    Ok((process, stream))
}

/// Nothing came in time, as the operating systems say it.
fn is_silence(kind: std::io::ErrorKind) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, TimedOut | WouldBlock | Interrupted)
}
