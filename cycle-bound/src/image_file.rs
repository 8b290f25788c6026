//! An image as a file: is it there, and is it one? Asked once, in one way, by whoever boots it or reads it.

use std::io::Read;
use std::path::Path;

use whole_file::Kind;

const ELF: &[u8] = b"\x7fELF";

fn told(image: &Path, why: &str) -> String {
    format!("image {}: {why}", image.display())
}

fn is_elf(image: &Path, head: &[u8]) -> Result<(), String> {
    if head.starts_with(ELF) { Ok(()) } else { Err(told(image, "this is no ELF file")) }
}

/// Is there an image, and is it one?
///
/// # Errors
/// When not; says what to do.
pub(crate) fn check(image: &Path) -> Result<(), String> {
    let file = whole_file::open(image).map_err(|why| told(image, &why))?;
    let mut head = Vec::new();
    file.take(ELF.len() as u64)
        .read_to_end(&mut head)
        .map_err(|error| told(image, &format!("cannot be read: {error}")))?;
    is_elf(image, &head)
}

/// All of it.
///
/// # Errors
/// Those of [`check`], and an image that is too long.
pub(crate) fn read(image: &Path) -> Result<Vec<u8>, String> {
    let bytes = whole_file::read(image, Kind::IMAGE).map_err(|why| told(image, &why))?;
    is_elf(image, &bytes)?;
    Ok(bytes)
}
