//! Font of the figures: text widths from its advances and kerning, as in the PNG renderer.

use std::sync::LazyLock;

use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::opentype_layout::{LayoutTable, Script};
use ttf_parser::{Face, GlyphId, Tag};

/// DejaVu Sans, reduced to Latin, Greek and formula marks; see `assets/README.md`.
pub(super) static FONT: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");

static FACE: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(FONT, 0).ok());

/// Returns the width of a text, px.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let Some(face) = FACE.as_ref() else { return 0.0 };
    // White space collapses, as in SVG.
    let text = text.split(|c: char| c.is_control() || c == ' ').filter(|word| !word.is_empty());
    let text = text.collect::<Vec<_>>().join(" ");
    let kerning = Kerning::of(face, &text);
    let scale = size as f32 / f32::from(face.units_per_em());
    let (mut x, mut right) = (0.0_f32, 0.0_f32);
    let mut glyphs = text.chars().filter(|c| !is_mark(*c)).map(|c| face.glyph_index(c).unwrap_or_default()).peekable();
    while let Some(glyph) = glyphs.next() {
        let advance = i32::from(face.glyph_hor_advance(glyph).unwrap_or_default());
        let kern = glyphs.peek().map_or(0, |next| kerning.between(glyph, *next));
        let advance = (advance + kern) as f32 * scale;
        right = right.max(advance + x);
        x += advance;
    }
    f64::from(right)
}

/// Returns whether a character has no width: a combining mark or a control character.
const fn is_mark(c: char) -> bool {
    matches!(c, '\u{300}'..='\u{36f}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}')
}

/// Kerning of the script of a text.
struct Kerning<'a> {
    layout: Option<LayoutTable<'a>>,
    lookups: Vec<u16>,
}

impl<'a> Kerning<'a> {
    fn of(face: &Face<'a>, text: &str) -> Self {
        let layout = face.tables().gpos;
        let lookups = layout.and_then(|layout| Self::lookups(&layout, text));
        Self { layout, lookups: lookups.unwrap_or_default() }
    }

    /// Returns the kerning lookups of the script of the first letter.
    fn lookups(layout: &LayoutTable<'a>, text: &str) -> Option<Vec<u16>> {
        let is_greek = |c: &char| matches!(c, '\u{370}'..='\u{3ff}');
        let first = text.chars().find(|c| c.is_ascii_alphabetic() || is_greek(c) || ('\u{c0}'..='\u{17f}').contains(c));
        let tag: &[u8; 4] = match first {
            Some(c) if is_greek(&c) => b"grek",
            Some(_) => b"latn",
            None => b"DFLT",
        };
        let script = |tag: &[u8; 4]| layout.scripts.find(Tag::from_bytes(tag));
        let script: Script<'_> = script(tag).or_else(|| script(b"DFLT")).or_else(|| script(b"latn"))?;
        let features = script.default_language?.feature_indices.into_iter();
        let features = features.filter_map(|k| layout.features.get(k)).filter(|it| it.tag == Tag::from_bytes(b"kern"));
        let mut lookups: Vec<u16> = features.flat_map(|feature| feature.lookup_indices.into_iter()).collect();
        lookups.sort_unstable();
        Some(lookups)
    }

    /// Returns the kerning between two glyphs, units of the font.
    fn between(&self, left: GlyphId, right: GlyphId) -> i32 {
        let Some(layout) = &self.layout else { return 0 };
        let lookups = self.lookups.iter().filter_map(|k| layout.lookups.get(*k));
        let of_pair = |pair: PairAdjustment<'_>| match pair {
            PairAdjustment::Format1 { coverage, sets } => {
                sets.get(coverage.get(left)?)?.get(right).map(|(value, _)| value.x_advance)
            }
            PairAdjustment::Format2 { coverage, classes, matrix } => {
                coverage.get(left)?;
                let classes = (classes.0.get(left), classes.1.get(right));
                matrix.get(classes).map(|(value, _)| value.x_advance)
            }
        };
        let of_lookup = |lookup: ttf_parser::opentype_layout::Lookup<'_>| {
            lookup.subtables.into_iter::<PositioningSubtable<'_>>().find_map(|subtable| match subtable {
                PositioningSubtable::Pair(pair) => of_pair(pair),
                _ => None,
            })
        };
        lookups.filter_map(of_lookup).map(i32::from).sum()
    }
}
