//! `host-sim` as its user meets it, run in this process.

use host_sim::cli::{self, Console};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// What a command left behind.
#[derive(Debug)]
pub struct Spoken {
    /// Exit status.
    pub status: u8,
    /// stdout.
    pub out: String,
    /// stderr.
    pub err: String,
}

/// Runs a command to its end.
pub fn host_sim(args: &[&str]) -> Spoken {
    host_sim_until(args, &AtomicBool::new(false))
}

/// Runs a command that is told to stop as Ctrl-C does.
///
/// # Panics
/// When it prints what is not UTF-8.
pub fn host_sim_until(args: &[&str], stop: &AtomicBool) -> Spoken {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let console = Console { out: &mut out, err: &mut err, stop, terminal: false };
    let status = cli::run(["host-sim"].iter().chain(args).map(Into::into), console);
    let text = |bytes| String::from_utf8(bytes).expect("what it prints is UTF-8");
    Spoken { status, out: text(out), err: text(err) }
}

/// A folder of one test, gone when the test is over.
pub struct Folder(PathBuf);

impl Folder {
    /// Of a name that no other test has.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("edo-smc-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    /// A path in it.
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
