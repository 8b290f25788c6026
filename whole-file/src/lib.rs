#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

use std::fs::{self, File, FileType, Metadata, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// What a file is for, and how long one of that kind may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    name: &'static str,
    longest_mib: u64,
}

impl Kind {
    /// What a person writes: a page of text, 1 MiB at most.
    pub const SETTINGS: Self = Self { name: "a file of settings", longest_mib: 1 };
    /// A linked firmware with all that a debugger wants, 256 MiB at most.
    pub const IMAGE: Self = Self { name: "an image", longest_mib: 256 };
    /// What an emulator executed, 256 MiB at most: some four million instructions.
    pub const TRACE: Self = Self { name: "a trace", longest_mib: 256 };
    /// A page with all numbers of its figures, 256 MiB at most.
    pub const REPORT: Self = Self { name: "a report", longest_mib: 256 };
}

/// All bytes of a regular file.
///
/// # Errors
/// When there is none, it is no regular file, cannot be read, or is too long for its kind: in words, without its name.
pub fn read(path: &Path, kind: Kind) -> Result<Vec<u8>, String> {
    let file = open(path)?;
    let mut bytes = Vec::new();
    let longest = kind.longest_mib << 20;
    file.take(longest + 1).read_to_end(&mut bytes).map_err(|error| cannot_be_read(&error))?;
    if bytes.len() as u64 > longest {
        return Err(format!("longer than {} MiB: not {}", kind.longest_mib, kind.name));
    }
    Ok(bytes)
}

/// All of a file as text.
///
/// # Errors
/// Those of [`read`], and a file that is not UTF-8.
pub fn read_text(path: &Path, kind: Kind) -> Result<String, String> {
    String::from_utf8(read(path, kind)?)
        .map_err(|error| format!("not UTF-8 text (byte {})", error.utf8_error().valid_up_to() + 1))
}

/// Opens a regular file to read it.
///
/// # Errors
/// When there is none, it is no regular file, or it may not be read: in words, without its name.
pub fn open(path: &Path) -> Result<File, String> {
    // Opening may wait for ever (a pipe) or do something (a device): so look first.
    let regular = |about: &Metadata| if about.is_file() { Ok(()) } else { Err(no_regular_file(about.file_type())) };
    regular(&fs::metadata(path).map_err(|error| cannot_be_read(&error))?)?;
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, rustix::fs::OFlags::NONBLOCK.bits() as i32);
    let file = options.read(true).open(path).map_err(|error| cannot_be_read(&error))?;
    // It may have become another one since.
    regular(&file.metadata().map_err(|error| cannot_be_read(&error))?)?;
    Ok(file)
}

fn cannot_be_read(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        _ => format!("cannot be read: {error}"),
    }
}

fn no_regular_file(found: FileType) -> String {
    let mut name = if found.is_dir() { "a directory" } else { "no file" };
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if found.is_fifo() {
            name = "a pipe";
        } else if found.is_char_device() || found.is_block_device() {
            name = "a device";
        } else if found.is_socket() {
            name = "a socket";
        }
    }
    format!("this is {name}, expected a regular file")
}

/// What becomes of a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// It stays, and the new one is not written.
    Keep,
    /// It is replaced, and keeps its permissions.
    Replace,
}

/// Writes a file whole or not at all: under another name in the same folder, which then becomes its own.
///
/// # Errors
/// When the file cannot be written or `fill` fails: what was there before is there still. What is no regular file, or
/// is read-only, is not replaced; with [`Existing::Keep`] nothing is ([`ErrorKind::AlreadyExists`]).
pub fn write(path: &Path, existing: Existing, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let refused = |why: String| io::Error::new(ErrorKind::InvalidInput, why);
    let mut target = path.to_owned();
    let mut permissions = None;
    if fs::symlink_metadata(path).is_ok() {
        if existing == Existing::Keep {
            return Err(ErrorKind::AlreadyExists.into());
        }
        // A link stays, and leads to the new file.
        target = fs::canonicalize(path).map_err(|error| refused(format!("a link that cannot be followed: {error}")))?;
        let about = fs::metadata(&target)?;
        if !about.is_file() {
            return Err(refused(no_regular_file(about.file_type())));
        }
        if about.permissions().readonly() {
            return Err(io::Error::new(ErrorKind::PermissionDenied, "the file there is read-only"));
        }
        permissions = Some(about.permissions());
    }
    if target.file_name().is_none() {
        return Err(refused("not a file name".into()));
    }
    let mut file = temporary(&folder_of(&target))?;
    let mut buffered = BufWriter::new(file.as_file_mut());
    fill(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    // Some file systems tell only now that they are full.
    file.as_file().sync_all()?;
    if let Some(permissions) = permissions {
        file.as_file().set_permissions(permissions)?;
    }
    let persisted = match existing {
        Existing::Keep => file.persist_noclobber(target),
        Existing::Replace => file.persist(target),
    };
    persisted.map(drop).map_err(|error| error.error)
}

/// Would [`write()`] find a place for this file? Asked before minutes of work: its folder is tried, and its name.
///
/// # Errors
/// Why it would not.
pub fn may_be_made(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        Ok(about) if about.is_dir() => Err(ErrorKind::IsADirectory.into()),
        _ => temporary(&folder_of(path)).map(drop),
    }
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.into(),
        _ => ".".into(),
    }
}

/// A folder that is one program's; until this is dropped or the program dies.
#[derive(Debug)]
pub struct Claim {
    /// None where the file system knows no locks.
    _lock: Option<File>,
}

/// Makes the folder if there is none, tries that it can be written, and takes it for this program.
///
/// # Errors
/// [`ErrorKind::ResourceBusy`] when another program has it; else why it cannot be written.
pub fn claim(folder: &Path) -> io::Result<Claim> {
    fs::create_dir_all(folder)?;
    drop(temporary(folder)?);
    // Only on Unix is a folder a file that can be locked.
    if !cfg!(unix) {
        return Ok(Claim { _lock: None });
    }
    let lock = File::open(folder)?;
    match lock.try_lock() {
        Ok(()) => Ok(Claim { _lock: Some(lock) }),
        Err(TryLockError::WouldBlock) => Err(ErrorKind::ResourceBusy.into()),
        Err(TryLockError::Error(_)) => Ok(Claim { _lock: None }),
    }
}

/// An empty file in the system's folder for such, gone when dropped.
///
/// # Errors
/// When it cannot be made.
pub fn scratch() -> io::Result<NamedTempFile> {
    temporary(&std::env::temp_dir())
}

const PREFIX: &str = ".whole-file.";
const SUFFIX: &str = ".tmp";

/// A fresh file in this folder, locked; those of dead programs are removed.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    sweep(folder);
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // As any other file, not for this user alone.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        // Nobody asked for the name of the fresh file, and its error tells it.
        let file = builder.tempfile_in(folder).map_err(|error| match error.kind() {
            ErrorKind::NotFound => {
                io::Error::new(ErrorKind::NotFound, format!("there is no folder {}", folder.display()))
            }
            kind => io::Error::new(kind, format!("in the folder {}: {kind}", folder.display())),
        })?;
        // Another program may have seen it before it was locked, and taken it for one that was left behind.
        if !matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock)) && file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes what programs that died while writing left behind; what cannot be removed stays.
fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        if ours
            && let Ok(file) = open(&entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests;
