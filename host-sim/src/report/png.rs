//! Drawing as PNG, with the feature `png`.

use std::io;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

use super::font::FONT;
use super::picture::FAMILY;
use super::write_whole;

/// Dots of the PNG per pixel of the drawing, sharp on a dense screen and in print.
const DOTS_PER_PIXEL: f32 = 2.0;

static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_data(FONT.to_vec());
    Arc::new(fonts)
});

/// Parses an SVG drawing; `None` if the renderer cannot.
pub(super) fn parse(svg: &str) -> Option<Tree> {
    let options = Options { fontdb: FONTS.clone(), font_family: FAMILY.to_owned(), ..Options::default() };
    Tree::from_str(svg, &options).ok()
}

/// Renders a drawing as PNG.
pub(super) fn drawn(svg: &str) -> io::Result<Vec<u8>> {
    let failed = || io::Error::other("the figure is too large to be drawn");
    let tree = parse(svg).ok_or_else(failed)?;
    let size = tree.size().to_int_size().scale_by(DOTS_PER_PIXEL).ok_or_else(failed)?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or_else(failed)?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(DOTS_PER_PIXEL, DOTS_PER_PIXEL), &mut pixels.as_mut());
    pixels.encode_png().map_err(io::Error::other)
}

/// Writes the SVG and the PNG of a drawing, each completely or not at all.
pub(super) fn write(svg: &str, folder: &Path, stem: &str) -> io::Result<()> {
    let png = drawn(svg)?;
    write_whole(&folder.join(format!("{stem}.svg")), |out| out.write_all(svg.as_bytes()))?;
    write_whole(&folder.join(format!("{stem}.png")), |out| out.write_all(&png))
}
