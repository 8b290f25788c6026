//! Access to a firmware file, with one check and one wording of its errors for the emulator and the analysis.

use std::io::Read;
use std::path::Path;

use whole_file::FileKind;

const ELF: &[u8] = b"\x7fELF";

fn told(image: &Path, why: &str) -> String {
    format!("image {}: {why}", image.display())
}

fn is_elf(image: &Path, head: &[u8]) -> Result<(), String> {
    if head.starts_with(ELF) { Ok(()) } else { Err(told(image, "not an ELF file")) }
}

/// Checks that the file exists and is an ELF file.
///
/// # Errors
/// The file is missing, unreadable or not an ELF file; the message has the remedy.
pub(crate) fn check(image: &Path) -> Result<(), String> {
    let file = whole_file::open(image).map_err(|why| told(image, &why))?;
    let mut head = Vec::new();
    file.take(ELF.len() as u64)
        .read_to_end(&mut head)
        .map_err(|error| told(image, &format!("cannot be read: {error}")))?;
    is_elf(image, &head)
}

/// Reads the whole file.
///
/// # Errors
/// Errors of [`check`], and a file that is too long.
pub(crate) fn read(image: &Path) -> Result<Vec<u8>, String> {
    let bytes = whole_file::read(image, FileKind::IMAGE).map_err(|why| told(image, &why))?;
    is_elf(image, &bytes)?;
    Ok(bytes)
}
