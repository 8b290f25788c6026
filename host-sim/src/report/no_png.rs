//! The module `png` without the feature `png`: a drawing is its SVG alone.

use std::io;
use std::path::Path;

use super::write_whole;

/// Writes the SVG, whole or not at all. A PNG beside it is older, and shows another drawing.
pub(super) fn write(svg: &str, folder: &Path, stem: &str) -> io::Result<()> {
    write_whole(&folder.join(format!("{stem}.svg")), |out| out.write_all(svg.as_bytes()))
}
