//! `host-sim` as a user runs it, within this process.

use host_sim::cli::{self, Console};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Result of a command.
#[derive(Debug)]
pub struct CommandResult {
    /// Exit status.
    pub status: u8,
    /// Text on stdout.
    pub out: String,
    /// Text on stderr.
    pub err: String,
}

/// Runs a command to its end.
pub fn host_sim(args: &[&str]) -> CommandResult {
    host_sim_until(args, &AtomicBool::new(false))
}

/// Runs a command that `stop` interrupts, as Ctrl-C does.
///
/// # Panics
/// If the output is not UTF-8.
pub fn host_sim_until(args: &[&str], stop: &AtomicBool) -> CommandResult {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let console = Console { out: &mut out, err: &mut err, stop, terminal: false };
    let status = cli::run(["host-sim"].iter().chain(args).map(Into::into), console);
    let text = |bytes| String::from_utf8(bytes).expect("what it prints is UTF-8");
    CommandResult { status, out: text(out), err: text(err) }
}

/// Temporary folder of one test, removed when the test ends.
pub struct Folder(PathBuf);

impl Folder {
    /// Creates a folder. No other test may use the name.
    ///
    /// # Panics
    /// If the folder cannot be created.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("edo-smc-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    /// Returns a path in the folder.
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
