//! Board on a serial port: 8 data bits, no parity, 1 stop bit, no flow control.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort};

use cycle_bound::log;

use super::super::{Transport, TransportError};
use super::is_silence;

/// Longest wait for the port to accept a frame.
const WRITE_WITHIN: Duration = Duration::from_secs(1);

/// Open serial port.
pub struct Serial {
    port: Box<dyn SerialPort>,
    name: String,
}

impl Serial {
    /// Opens a port for exclusive use.
    ///
    /// # Errors
    /// Fails if the port does not exist, another program has it open, or the user has no permission.
    pub fn open(device: &Path, baud: u32) -> Result<Self, TransportError> {
        let name = device.display().to_string();
        let told = |why: &dyn std::fmt::Display| TransportError(format!("{name}: {why}"));
        // A missing device is the most likely error, and the message of the port is least clear for it.
        if let Err(error) = std::fs::metadata(device)
            && cfg!(unix)
        {
            let remedy = "; is the board plugged in? Its port is one of /dev/ttyUSB* and /dev/ttyACM*";
            let remedy = if error.kind() == ErrorKind::NotFound { remedy } else { "" };
            return Err(told(&format!("{}{remedy}", plain(&error))));
        }
        let port = serialport::new(&*name, baud).timeout(WRITE_WITHIN).open().map_err(|error| match error.kind {
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                told(&"this user may not open it; join the group that owns it, often `dialout`")
            }
            serialport::ErrorKind::NoDevice => told(&format!("{error}; does another program have it open?")),
            _ => told(&format!("cannot be opened as a serial port: {error}")),
        })?;
        // Drop the bytes that the board sent before.
        port.clear(ClearBuffer::All).map_err(|error| told(&error))?;
        Ok(Self { port, name })
    }

    fn broken(&self, error: &io::Error) -> TransportError {
        TransportError(format!("{}: the line broke ({}); was the board unplugged?", self.name, plain(error)))
    }
}

/// Returns the message without the error number of the operating system.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}

impl Transport for Serial {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.port.set_timeout(WRITE_WITHIN).map_err(|error| self.broken(&error.into()))?;
        self.port.write_all(bytes).map_err(|error| self.broken(&error))
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        self.port.set_timeout(within).map_err(|error| self.broken(&error.into()))?;
        match self.port.read(into) {
            // A port that is ready without data is gone.
            Ok(0) => Err(self.broken(&ErrorKind::UnexpectedEof.into())),
            Ok(count) => Ok(count),
            Err(error) if is_silence(error.kind()) => Ok(0),
            Err(error) => Err(self.broken(&error)),
        }
    }
}

/// Reads the log of a board.
impl Read for Serial {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.port.set_timeout(log::GLANCE)?;
        self.port.read(into)
    }
}
