//! Output of a run for people: files, tables and figures. This module only formats values; it changes none.
//!
//! | output | module |
//! |---|---|
//! | all ticks as numbers | [`csv`] |
//! | standard figures of a run | [`trace_figure`]; with a reference [`drive_figure`] |
//! | your own figure | [`plot`] |
//! | a number with its significant digits | [`study::number`] |
//! | an HTML report of everything | [`page`] |
//! | an aligned table on the terminal | [`terminal::table`] |
//!
//! Every file is written completely or not at all, see [`write_whole`].

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use whole_file::Existing;

mod axis;
pub mod comparison;
pub mod csv;
pub mod drive_figure;
mod font;
pub mod heat;
pub mod page;
mod picture;
pub mod plot;
#[cfg_attr(not(feature = "png"), path = "report/no_png.rs")]
mod png;
mod polyline;
pub mod trace_figure;

/// File extension of the figures that messages name.
pub const FIGURE: &str = if cfg!(feature = "png") { "png" } else { "svg" };

/// Writes a file completely or not at all, and replaces an older one. Missing folders are created.
///
/// # Errors
/// If a folder cannot be created or the file cannot be written, see [`whole_file::write`].
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    whole_file::write(path, Existing::Replace, fill)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    /// Returns the path of a new folder for one test.
    pub(super) fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("host-sim-report-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }
}
