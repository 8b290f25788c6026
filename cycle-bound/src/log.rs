//! Log of a target: defmt frames, decoded with the messages of the firmware, or plain text.
//!
//! A separate thread reads and decodes the log. Neither a run nor a target waits for the output of the log.

use std::io::{ErrorKind, Read};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::Duration;

use defmt_decoder::{DecodeError, Table};

use crate::image_file;

/// Messages of a firmware, by number; empty for a plain-text log.
pub struct Messages(Option<Table>);

impl Messages {
    /// Reads the messages of a firmware.
    ///
    /// # Errors
    /// The file cannot be read, or holds no messages.
    pub fn of(image: &Path) -> Result<Self, String> {
        let found = Self::or_text(image)?;
        if found.is_text() {
            return Err(format!("log of image {}: it holds no defmt messages", image.display()));
        }
        Ok(found)
    }

    /// Reads the messages of a firmware, or selects plain text if it holds none.
    ///
    /// # Errors
    /// The file or its messages cannot be read.
    pub fn or_text(image: &Path) -> Result<Self, String> {
        let bytes = image_file::read(image)?;
        Table::parse(&bytes)
            .map(Self)
            .map_err(|error| format!("log of image {}: its defmt messages cannot be read: {error}", image.display()))
    }

    /// Returns whether the firmware logs plain text.
    pub fn is_text(&self) -> bool {
        self.0.is_none()
    }
}

/// Longest blocking read of a source; then the source reports a timeout.
pub const GLANCE: Duration = Duration::from_millis(100);

/// Lines of a log in the order of arrival. Dropping it ends the reader and closes the source.
pub struct Log {
    lines: Receiver<String>,
    unwanted: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Log {
    /// Starts to read a source whose reads block for at most [`GLANCE`].
    pub fn follow(source: impl Read + Send + 'static, messages: Messages) -> Self {
        let (sender, lines) = mpsc::channel();
        let unwanted = Arc::new(AtomicBool::new(false));
        let no_longer = Arc::clone(&unwanted);
        let reader = std::thread::spawn(move || match messages {
            Messages(Some(table)) => read(source, &table, &sender, &no_longer),
            Messages(None) => read_text(source, &sender, &no_longer),
        });
        Self { lines, unwanted, reader: Some(reader) }
    }

    /// Returns the next line, if one has arrived.
    pub fn next(&self) -> Option<String> {
        self.lines.try_recv().ok()
    }

    /// Waits for the next line.
    ///
    /// # Errors
    /// No line arrived in time, or the source has ended.
    pub fn wait(&self, within: Duration) -> Result<String, RecvTimeoutError> {
        self.lines.recv_timeout(within)
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        self.unwanted.store(true, Ordering::Relaxed);
        if let Some(reader) = self.reader.take() {
            // A panic of the thread has printed its own message.
            let _ = reader.join();
        }
    }
}

/// Returns whether the error kind is a read timeout of an operating system.
pub(crate) fn is_silence(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// Longest line, bytes; the rest becomes a new line.
const LONGEST_LINE: usize = 1000;

/// Passes the received bytes to `take`, until the source ends, `unwanted` is set or `take` breaks.
fn pump(mut source: impl Read, unwanted: &AtomicBool, mut take: impl FnMut(&[u8]) -> ControlFlow<()>) {
    let mut bytes = [0; 1024];
    while !unwanted.load(Ordering::Relaxed) {
        let count = match source.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if is_silence(error.kind()) => continue,
            Err(_) => return,
        };
        if take(&bytes[..count]).is_break() {
            return;
        }
    }
}

fn read_text(source: impl Read, lines: &Sender<String>, unwanted: &AtomicBool) {
    let mut line = Vec::new();
    pump(source, unwanted, |bytes| {
        for &byte in bytes {
            if byte != b'\n' && line.len() < LONGEST_LINE {
                line.push(byte);
                continue;
            }
            send(lines, shown(&line))?;
            line.clear();
            if byte != b'\n' {
                line.push(byte);
            }
        }
        ControlFlow::Continue(())
    });
    if !line.is_empty() {
        // A closed receiver does not need the line.
        let _ = lines.send(shown(&line));
    }
}

fn send(lines: &Sender<String>, line: String) -> ControlFlow<()> {
    if lines.send(line).is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
}

/// Returns a line with control characters replaced, safe for a terminal.
fn shown(line: &[u8]) -> String {
    String::from_utf8_lossy(line).trim_end().chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

fn read(source: impl Read, table: &Table, lines: &Sender<String>, unwanted: &AtomicBool) {
    let mut decoder = table.new_stream_decoder();
    let mut is_garbled = false;
    pump(source, unwanted, |bytes| {
        decoder.received(bytes);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => match frame.level() {
                    Some(level) => format!("{:<5} {}", level.as_str(), frame.display_message()),
                    None => frame.display_message().to_string(),
                },
                Err(DecodeError::UnexpectedEof) => return ControlFlow::Continue(()),
                Err(DecodeError::Malformed) if table.encoding().can_recover() => {
                    // Prints one message only, since the following bytes are garbled too.
                    if std::mem::replace(&mut is_garbled, true) {
                        continue;
                    }
                    "(data that is not a message of this image; does the target run this image?)".into()
                }
                Err(DecodeError::Malformed) => return ControlFlow::Break(()),
            };
            send(lines, line)?;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_text_comes_in_lines_that_a_terminal_may_show() {
        let long = "x".repeat(LONGEST_LINE + 1);
        let text = format!("one\r\n\n\u{1b}[2Jtwo\n{long}\nσ last");
        let log = Log::follow(std::io::Cursor::new(text), Messages(None));
        let lines: Vec<String> = std::iter::from_fn(|| log.wait(Duration::from_secs(30)).ok()).collect();
        assert_eq!(lines, ["one", "", "?[2Jtwo", &long[1..], "x", "σ last"]);
    }
}
