#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

use std::fs::{self, File, FileType, Metadata, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// Kind of a file, with its largest size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileKind {
    name: &'static str,
    longest_mib: u64,
}

impl FileKind {
    /// Settings that a person writes, at most 1 MiB.
    pub const SETTINGS: Self = Self { name: "a settings file", longest_mib: 1 };
    /// Linked firmware with debug information, at most 256 MiB.
    pub const IMAGE: Self = Self { name: "a firmware image", longest_mib: 256 };
    /// Instruction trace of an emulator, at most 256 MiB: some four million instructions.
    pub const TRACE: Self = Self { name: "a trace", longest_mib: 256 };
    /// Page with the data of its plots, at most 256 MiB.
    pub const REPORT: Self = Self { name: "a report", longest_mib: 256 };
}

/// Reads all bytes of a regular file.
///
/// # Errors
/// Fails if the file does not exist, is not a regular file, cannot be read, or is too long for its kind. The message
/// does not contain the name.
pub fn read(path: &Path, kind: FileKind) -> Result<Vec<u8>, String> {
    let file = open(path)?;
    let mut bytes = Vec::new();
    let longest = kind.longest_mib << 20;
    file.take(longest + 1).read_to_end(&mut bytes).map_err(|error| cannot_be_read(&error))?;
    if bytes.len() as u64 > longest {
        return Err(format!("longer than {} MiB: not {}", kind.longest_mib, kind.name));
    }
    Ok(bytes)
}

/// Reads a regular file as text.
///
/// # Errors
/// Fails like [`read`], and if the file is not UTF-8.
pub fn read_text(path: &Path, kind: FileKind) -> Result<String, String> {
    String::from_utf8(read(path, kind)?)
        .map_err(|error| format!("not UTF-8 text (byte {})", error.utf8_error().valid_up_to() + 1))
}

/// Opens a regular file for reading.
///
/// # Errors
/// Fails if the file does not exist, is not a regular file, or cannot be read. The message does not contain the name.
pub fn open(path: &Path) -> Result<File, String> {
    // Opening may block (a pipe) or have side effects (a device), so the type is checked first.
    let regular = |about: &Metadata| if about.is_file() { Ok(()) } else { Err(no_regular_file(about.file_type())) };
    regular(&fs::metadata(path).map_err(|error| cannot_be_read(&error))?)?;
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, rustix::fs::OFlags::NONBLOCK.bits() as i32);
    let file = options.read(true).open(path).map_err(|error| cannot_be_read(&error))?;
    // The file may have been replaced since the check.
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

/// Handling of a file that exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// The file stays, and the new file is not written.
    Keep,
    /// The file is replaced and keeps its permissions.
    Replace,
}

/// Writes a file whole or not at all: under a temporary name in the same folder, which is then renamed.
///
/// # Errors
/// Fails if the file cannot be written or `fill` fails. An existing file then stays unchanged. A file that is not
/// regular or is read-only is not replaced. With [`Existing::Keep`] no file is replaced ([`ErrorKind::AlreadyExists`]).
pub fn write(path: &Path, existing: Existing, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let refused = |why: String| io::Error::new(ErrorKind::InvalidInput, why);
    let mut target = path.to_owned();
    let mut permissions = None;
    if fs::symlink_metadata(path).is_ok() {
        if existing == Existing::Keep {
            return Err(ErrorKind::AlreadyExists.into());
        }
        // A symbolic link stays and points to the new file.
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
    // Some file systems report a full disk only here.
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

/// Checks before long work that [`write()`] can create this file. It tries the folder and the name.
///
/// # Errors
/// Returns the reason why the file cannot be written.
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

/// Exclusive claim of a folder, until this is dropped or the program dies.
#[derive(Debug)]
pub struct Claim {
    /// `None` on a file system without locks.
    _lock: Option<File>,
}

/// Creates the folder if it is missing, checks that it is writable, and claims it for this program.
///
/// # Errors
/// Fails with [`ErrorKind::ResourceBusy`] if another program has claimed the folder, or if it cannot be written.
pub fn claim(folder: &Path) -> io::Result<Claim> {
    fs::create_dir_all(folder)?;
    drop(temporary(folder)?);
    // Only on Unix a folder can be opened and locked like a file.
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

/// Creates an empty file in the temporary folder of the system. It is removed when dropped.
///
/// # Errors
/// Fails if the file cannot be created.
pub fn scratch() -> io::Result<NamedTempFile> {
    temporary(&std::env::temp_dir())
}

const PREFIX: &str = ".whole-file.";
const SUFFIX: &str = ".tmp";

/// Creates a locked file in this folder and removes the files of dead programs.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    sweep(folder);
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // The permissions are those of other files, not of a private file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        // The caller did not choose the name of the temporary file, and the original error contains it.
        let file = builder.tempfile_in(folder).map_err(|error| match error.kind() {
            ErrorKind::NotFound => {
                io::Error::new(ErrorKind::NotFound, format!("there is no folder {}", folder.display()))
            }
            kind => io::Error::new(kind, format!("in the folder {}: {kind}", folder.display())),
        })?;
        // Another program may have removed the file before the lock, as a leftover.
        if !matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock)) && file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes temporary files of programs that died while writing. Files that cannot be removed stay.
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
