//! Drawing in pixels, and its SVG and PNG files.
//!
//! The SVG keeps text as text, so that it can be searched, copied and read aloud. It names the font of this crate
//! first, then fonts of equal width. With the feature `png`, `usvg` reads the SVG back with this font and renders the
//! PNG. A drawing gives identical bytes on every machine.

use std::fmt::Write;
use std::io;
use std::path::Path;

pub(super) use super::font::text_width;
use super::png;

pub(super) const FAMILY: &str = "DejaVu Sans";
/// Fonts for a machine without it; the first two are equally wide.
const FALLBACKS: &str = "Bitstream Vera Sans, Verdana, Noto Sans, Helvetica, Arial, sans-serif";

/// Point of a text that its position refers to.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Unfinished drawing; y points down.
pub(super) struct Picture {
    width: f64,
    height: f64,
    title: String,
    body: String,
}

impl Picture {
    /// Starts a drawing on white of this size, px. The title is for screen readers.
    pub(super) fn new(width: f64, height: f64, title: &str) -> Self {
        let body = format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n");
        Self { width, height, title: escaped(title), body }
    }

    /// Adds an SVG element. The caller ensures valid SVG.
    pub(super) fn element(&mut self, element: &str) {
        self.body += element;
        self.body.push('\n');
    }

    /// Adds a text on its base line, `size` px high, rotated by `turn_deg`.
    pub(super) fn text(&mut self, at: (f64, f64), size: f64, color: &str, anchor: Anchor, turn_deg: f64, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        // Smaller than a hundredth of a pixel is invisible.
        let [x, y] = [at.0, at.1].map(|px| (100.0 * px).round() / 100.0);
        let turn = if turn_deg == 0.0 { String::new() } else { format!(" transform=\"rotate({turn_deg} {x} {y})\"") };
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" fill=\"{color}\" text-anchor=\"{anchor}\"{turn}>{}</text>",
            escaped(text)
        );
    }

    /// Finishes the drawing.
    pub(super) fn finish(self) -> Drawing {
        let Self { width, height, title, body } = self;
        let head = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILY}, {FALLBACKS}\" \
             role=\"img\"><title>{title}</title>\n"
        );
        Drawing { source: format!("{head}{body}</svg>\n") }
    }
}

/// Finished drawing.
pub(super) struct Drawing {
    source: String,
}

impl Drawing {
    /// Returns the SVG file.
    pub(super) fn svg(&self) -> &str {
        &self.source
    }

    /// Writes `stem.svg` into the folder, with the feature `png` also `stem.png`, each completely or not at all.
    pub(super) fn write(&self, folder: &Path, stem: &str) -> io::Result<()> {
        png::write(&self.source, folder, stem)
    }

    /// Returns the PNG file.
    #[cfg(feature = "png")]
    pub(super) fn png(&self) -> io::Result<Vec<u8>> {
        png::drawn(&self.source)
    }
}

/// Wraps a text into at most `most` lines of at most `width` px, between words if possible. A longer text ends in `..`.
pub(super) fn wrapped(text: &str, size: f64, width: f64, most: usize) -> Vec<String> {
    let fits = |line: &str| text_width(line, size) <= width;
    let mut lines: Vec<String> = Vec::new();
    let mut words = text.split_whitespace();
    let mut rest = words.next().map(str::to_owned);
    while let Some(word) = rest.take() {
        let longer = lines.last().map(|line| format!("{line} {word}")).filter(|line| fits(line));
        if let (Some(longer), Some(last)) = (longer, lines.last_mut()) {
            *last = longer;
        } else if lines.len() == most {
            if let Some(last) = lines.last_mut() {
                while !fits(&format!("{last} ..")) && last.pop().is_some() {}
                last.push_str(" ..");
            }
            return lines;
        } else {
            // A word that is wider than a line continues in the next line.
            let mut end = word.len().min(4 * width as usize);
            while !word.is_char_boundary(end) {
                end -= 1;
            }
            let mut part = word[..end].to_owned();
            while !fits(&part) && part.pop().is_some() {}
            let left = word[part.len()..].to_owned();
            if part.is_empty() {
                return lines;
            }
            lines.push(part);
            if !left.is_empty() {
                rest = Some(left);
                continue;
            }
        }
        rest = words.next().map(str::to_owned);
    }
    lines
}

/// Escapes a text for XML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // Control characters and these two are not valid XML.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_our_labels_has_a_glyph() {
        let missing = text_width("\u{4e2d}", 100.0);
        for c in "σωελθΔ°²³₁₂₆ᵢⱼₖₗₙₛ⁰¹⁴⁻⁹×·−≤≥≈√∞∂‖µé".chars() {
            let width = text_width(&c.to_string(), 100.0);
            assert!(width > 0.0 && width != missing, "{c}: {width}");
        }
        assert_eq!(text_width("d\u{302}", 100.0), text_width("d", 100.0), "a hat stands above its letter");
    }

    /// Returns the width of a text in the PNG renderer, px.
    fn rendered_width(text: &str, size: f64) -> f64 {
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1\" height=\"1\">\
             <text font-size=\"{size}\">{}</text></svg>",
            escaped(text)
        );
        png::parse(&svg).map_or(0.0, |tree| f64::from(tree.root().bounding_box().width()))
    }

    #[test]
    fn widths_are_those_of_the_renderer() {
        let letters: Vec<char> = (' '..='~').chain("σωελθΔ°²³₁₂₆ᵢⱼₖₗₙₛ⁰¹⁴⁻⁹×·−≤≥≈√∞∂‖µéÄüß".chars()).collect();
        let mut texts: Vec<String> = letters.iter().map(char::to_string).collect();
        // The fast tier tests one pair in 37.
        let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
        let pairs = letters.iter().flat_map(|left| letters.iter().map(move |right| format!("{left}{right}")));
        texts.extend(pairs.step_by(if deep { 1 } else { 37 }));
        let labels =
            ["d\u{302}₂ − d₂ (rad/s²)", "AV. Tokyo, WAVE  Type: 1e-3", "σ* (rad/s)", " a  b ", "θ̂, ω̂ of VA", "Σ V A"];
        texts.extend(labels.map(str::to_owned));
        for text in &texts {
            for size in [11.0, 12.0, 13.5, 16.0] {
                assert_eq!(text_width(text, size), rendered_width(text, size), "{text:?} {size}");
            }
        }
    }

    #[test]
    fn any_text_makes_a_whole_picture() {
        for text in ["<a> & \"b\"", "\0\u{1b}[31m\u{fffe}", "中文 \u{202e}\u{1f600}", ""] {
            let mut picture = Picture::new(200.0, 50.0, text);
            picture.text((100.0, 25.0), 12.0, "#000000", Anchor::Middle, 0.0, text);
            let drawing = picture.finish();
            let svg = drawing.svg();
            // Text can be searched, copied and read aloud; other fonts are named as a fallback.
            assert!(svg.contains("<text ") && svg.contains("font-family=\"DejaVu Sans, "), "{svg}");
            assert!(svg.contains("sans-serif\"") && png::parse(svg).is_some(), "{svg}");
            assert!(drawing.png().is_ok());
        }
    }

    #[test]
    fn a_picture_beyond_memory_is_an_error() {
        assert!(Picture::new(1e9, 1e9, "").finish().png().is_err());
    }
}
