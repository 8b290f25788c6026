//! What a person gets to see of a run: files and tables. Values in, text and pictures out; nothing here changes a
//! number.
//!
//! | you want | go to |
//! |---|---|
//! | every tick as numbers | [`csv`] |
//! | the standard figures of a run | [`trace_figure`]; where a reference is followed [`drive_figure`] |
//! | a figure of your own | [`plot`] |
//! | a number with as many digits as say something | [`study::number`] |
//! | all of it in one page for a browser | [`page`] |
//! | an aligned table on the terminal | [`terminal::table`] |
//!
//! Every file appears whole or not at all, see [`write_whole`].

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

/// What the name of a figure ends in that messages point to.
pub const FIGURE: &str = if cfg!(feature = "png") { "png" } else { "svg" };

/// Writes a file whole or not at all, over an older one. Missing folders are made.
///
/// # Errors
/// Those of [`whole_file::write`], or when a folder cannot be made.
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

    /// A fresh folder of this test alone.
    pub(super) fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("host-sim-report-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }
}
