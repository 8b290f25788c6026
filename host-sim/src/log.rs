//! What a target logs: defmt frames, decoded with the image they come from.
//!
//! A thread of its own reads and decodes, so that neither a run nor a target ever waits for a log to be printed.

use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Weak};
use std::time::Duration;

use defmt_decoder::{DecodeError, Table};

/// The messages of an image, by number.
pub struct Messages(Table);

impl Messages {
    /// Reads them from the image.
    ///
    /// # Errors
    /// When it cannot be read, or holds no messages; in words.
    pub fn of(image: &Path) -> Result<Self, String> {
        let told = |why: &dyn std::fmt::Display| format!("log of image {}: {why}", image.display());
        let bytes = std::fs::read(image).map_err(|error| told(&error))?;
        match Table::parse(&bytes) {
            Ok(Some(table)) => Ok(Self(table)),
            Ok(None) => Err(told(&"it holds no defmt messages")),
            Err(error) => Err(told(&format!("its defmt messages cannot be read: {error}"))),
        }
    }
}

/// The lines of a log as they come in. Reading ends when this is dropped, or the source ends.
pub struct Log {
    lines: Receiver<String>,
    _wanted: Arc<()>,
}

impl Log {
    /// Follows a source; a read of it should end by itself from time to time.
    pub fn follow(source: impl Read + Send + 'static, messages: Messages) -> Self {
        let (sender, lines) = mpsc::channel();
        let wanted = Arc::new(());
        let still_wanted = Arc::downgrade(&wanted);
        std::thread::spawn(move || read(source, &messages, &sender, &still_wanted));
        Self { lines, _wanted: wanted }
    }

    /// The next line, if there is one.
    pub fn next(&self) -> Option<String> {
        self.lines.try_recv().ok()
    }

    /// Waits for the next line.
    ///
    /// # Errors
    /// When none comes in time, or the source has ended.
    pub fn wait(&self, within: Duration) -> Result<String, RecvTimeoutError> {
        self.lines.recv_timeout(within)
    }
}

fn read(mut source: impl Read, Messages(table): &Messages, lines: &Sender<String>, wanted: &Weak<()>) {
    let mut decoder = table.new_stream_decoder();
    let mut bytes = [0; 1024];
    while wanted.strong_count() > 0 {
        let count = match source.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
            {
                continue;
            }
            Err(_) => return,
        };
        decoder.received(&bytes[..count]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => match frame.level() {
                    Some(level) => format!("{:<5} {}", level.as_str(), frame.display_message()),
                    None => frame.display_message().to_string(),
                },
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) if table.encoding().can_recover() => "(not a message of this image)".into(),
                Err(DecodeError::Malformed) => return,
            };
            if lines.send(line).is_err() {
                return;
            }
        }
    }
}
