//! Firmware in the emulator as a [`Transport`], over its USART1.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use cycle_bound::qemu::{Clock, Process};

use super::super::{Transport, TransportError};
use super::is_silence;

/// Connection to a firmware in the emulator.
pub struct Emulator {
    line: TcpStream,
    process: Process,
}

impl Emulator {
    /// Boots a firmware and connects to its USART1. With `log` its USART2 is the returned stream.
    ///
    /// # Errors
    /// Fails like [`Process::start`].
    pub fn start(image: &Path, log: bool) -> Result<(Self, Option<TcpStream>), TransportError> {
        Self::boot(image, log, Clock::Host)
    }

    /// Boots a firmware with exact timers: emulated time counts instructions, independent of the load of this machine.
    ///
    /// # Errors
    /// Fails like [`Process::start`].
    pub fn counting(image: &Path) -> Result<Self, TransportError> {
        Self::boot(image, false, Clock::Instructions).map(|(emulator, _)| emulator)
    }

    /// Boots a firmware whose time does not run ahead of this program while the chip waits.
    ///
    /// # Errors
    /// Fails like [`Process::start`].
    pub fn paced(image: &Path) -> Result<Self, TransportError> {
        Self::boot(image, false, Clock::Paced).map(|(emulator, _)| emulator)
    }

    fn boot(image: &Path, log: bool, clock: Clock) -> Result<(Self, Option<TcpStream>), TransportError> {
        match Process::start(image, [true, log], clock, None).map_err(TransportError)? {
            (process, [Some(line), log]) => Ok((Self { line, process }, log)),
            (process, [None, _]) => Err(TransportError(process.ended("no connection to the emulator"))),
        }
    }
}

impl Emulator {
    fn gone(&self, why: &str) -> TransportError {
        TransportError(self.process.ended(&format!("the emulator is gone{why}")))
    }
}

impl Transport for Emulator {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.line.write_all(bytes).map_err(|error| self.gone(&format!(" ({error})")))
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        // A socket rejects a timeout of 0.
        let within = within.max(Duration::from_micros(1));
        match self.line.set_read_timeout(Some(within)).and_then(|()| self.line.read(into)) {
            Ok(0) => Err(self.gone("")),
            Ok(count) => Ok(count),
            Err(error) if is_silence(error.kind()) => Ok(0),
            Err(error) => Err(self.gone(&format!(" ({error})"))),
        }
    }
}
