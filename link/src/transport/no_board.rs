//! Substitute for the module `board` without the feature `chip`. Every function that opens a target returns an error.

use std::io::{self, Read};
use std::net::TcpStream;
use std::path::Path;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use super::{Transport, TransportError};

const LEFT_OUT: &str = "this program was built without the feature chip";

/// Firmware in the emulator.
pub struct Emulator(());

impl Emulator {
    /// # Errors
    /// Always fails.
    pub fn start(_: &Path, _: bool) -> Result<(Self, Option<TcpStream>), TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }

    /// # Errors
    /// Always fails.
    pub fn counting(_: &Path) -> Result<Self, TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }

    /// # Errors
    /// Always fails.
    pub fn paced(_: &Path) -> Result<Self, TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }
}

impl Transport for Emulator {
    fn send(&mut self, _: &[u8]) -> Result<(), TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }

    fn receive(&mut self, _: &mut [u8], _: Duration) -> Result<usize, TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }
}

/// Board on a serial port.
pub struct Serial(());

impl Serial {
    /// # Errors
    /// Always fails.
    pub fn open(_: &Path, _: u32) -> Result<Self, TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }
}

impl Transport for Serial {
    fn send(&mut self, _: &[u8]) -> Result<(), TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }

    fn receive(&mut self, _: &mut [u8], _: Duration) -> Result<usize, TransportError> {
        Err(TransportError(LEFT_OUT.into()))
    }
}

impl Read for Serial {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        Err(io::Error::other(LEFT_OUT))
    }
}

/// Log messages of a firmware.
pub struct Messages(());

impl Messages {
    /// # Errors
    /// Always fails.
    pub fn of(_: &Path) -> Result<Self, String> {
        Err(LEFT_OUT.into())
    }

    /// # Errors
    /// Always fails.
    pub fn or_text(_: &Path) -> Result<Self, String> {
        Err(LEFT_OUT.into())
    }

    /// Returns true if the log is plain text.
    pub fn is_text(&self) -> bool {
        true
    }
}

/// Log of a target.
pub struct Log(());

impl Log {
    /// Follows a stream.
    pub fn follow(_: impl Read + Send + 'static, _: Messages) -> Self {
        Self(())
    }

    /// Returns the next line.
    pub fn next(&self) -> Option<String> {
        None
    }

    /// # Errors
    /// Always fails.
    pub fn wait(&self, _: Duration) -> Result<String, RecvTimeoutError> {
        Err(RecvTimeoutError::Disconnected)
    }
}

/// Running emulator.
pub struct Process(());

impl Process {
    /// Returns the reason of its end.
    pub fn ended(&self, _: &str) -> String {
        LEFT_OUT.into()
    }
}

/// # Errors
/// Always fails.
pub fn logged(_: &Path) -> Result<(Process, TcpStream), String> {
    Err(LEFT_OUT.into())
}

/// Returns true if a line ends the log. There is no such line here.
pub fn is_last(_: &str) -> bool {
    true
}
