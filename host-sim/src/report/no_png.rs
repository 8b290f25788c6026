//! The module `png` without the feature `png`: writes a drawing as SVG only.

use std::io;
use std::path::Path;

use super::write_whole;

/// Writes the SVG, completely or not at all. An existing PNG of this name is older and not updated.
pub(super) fn write(svg: &str, folder: &Path, stem: &str) -> io::Result<()> {
    write_whole(&folder.join(format!("{stem}.svg")), |out| out.write_all(svg.as_bytes()))
}
