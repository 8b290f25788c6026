//! An image as a file: is it there, and is it one? Asked once, in one way, by whoever boots it or reads it.

use std::io::{ErrorKind, Read};
use std::path::Path;

/// Is there an image, and is it one?
///
/// # Errors
/// When not; says what to do.
pub(crate) fn check(image: &Path) -> Result<(), String> {
    let told = |why: String| format!("image {}: {why}", image.display());
    // Opening what is no file, a pipe say, may wait for ever.
    if std::fs::metadata(image).is_ok_and(|about| !about.is_file()) {
        return Err(told("this is no file".into()));
    }
    let mut head = [0; 4];
    match std::fs::File::open(image).and_then(|mut file| file.read_exact(&mut head)) {
        Ok(()) if head == *b"\x7fELF" => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(told("there is no such file".into())),
        Err(error) if error.kind() != ErrorKind::UnexpectedEof => Err(told(format!("cannot be read: {error}"))),
        _ => Err(told("this is no ELF file".into())),
    }
}

/// All of it.
///
/// # Errors
/// Those of [`check`].
pub(crate) fn read(image: &Path) -> Result<Vec<u8>, String> {
    check(image)?;
    std::fs::read(image).map_err(|error| format!("image {}: cannot be read: {error}", image.display()))
}
