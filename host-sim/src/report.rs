//! What a person gets to see of a run: files and tables. Values in, text and pictures out; nothing here changes a
//! number.
//!
//! | you want | go to |
//! |---|---|
//! | every tick as numbers | [`csv`] |
//! | the standard figures of a run | [`trace_figure`] |
//! | a figure of your own | [`plot`] |
//! | a number with as many digits as say something | [`number`] |
//! | an aligned table on the terminal | [`cycle_bound::table`] |
//!
//! Every file appears whole or not at all, see [`write_whole`].

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

mod axis;
pub mod csv;
pub mod number;
mod picture;
pub mod plot;
mod polyline;
pub mod trace_figure;

/// Writes a file whole or not at all: into a temporary name in the same folder, then renamed. Missing folders are made.
///
/// # Errors
/// When the folder or the file cannot be written, or `fill` fails; an older file of that name then stays as it was.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    // The process number keeps two runs into the same folder from sharing a temporary file.
    let temporary = path.with_file_name(format!(".{}.{}.tmp", name.to_string_lossy(), std::process::id()));
    let write = || {
        let mut file = BufWriter::new(File::create(&temporary)?);
        fill(&mut file)?;
        file.flush()?;
        fs::rename(&temporary, path)
    };
    write().inspect_err(|_| {
        // Best effort: the error worth telling is the first one.
        let _ = fs::remove_file(&temporary);
    })
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

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = folder("whole");
        let path = folder.join("a.txt");
        write_whole(&path, |out| out.write_all(b"old")).unwrap();
        let failed = write_whole(&path, |out| {
            out.write_all(b"half of the new")?;
            Err(io::Error::other("disk full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "disk full");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_path_without_a_file_name_is_an_error() {
        assert!(write_whole(Path::new("/"), |_| Ok(())).is_err());
    }
}
