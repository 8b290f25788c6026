//! Line figures: panels over time or any other quantity, as SVG and PNG.
//!
//! A [`Figure`] is data. [`Figure::svg`] is a pure function and gives identical bytes on every machine.
//!
//! * Thinning keeps every peak.
//! * A value that is not finite is a gap.
//! * A value that is held between ticks is drawn in steps.
//! * If a range hides part of the data, the head of the panel shows the peak.
//! * A curve that lies on another one is dashed, so that both are visible.
//! * The legend is above the panel and never covers a curve.
//!
//! ```
//! use host_sim::report::plot::{Figure, Panel, Series};
//! let decay = (0..500).map(|k| f64::from(k) * 0.01).map(|t_s| (t_s, 0.1 * (-t_s).exp()));
//! let figure = Figure {
//!     title: "Free decay".into(),
//!     panels: vec![Panel {
//!         x_label: "t (s)".into(),
//!         y_label: "y (rad)".into(),
//!         series: vec![Series::solid("y = x₁", 0, decay)],
//!         ..Panel::default()
//!     }],
//!     columns: 1,
//! };
//! assert!(figure.svg().starts_with("<svg"));
//! ```
//!
//! # Why not a plotting crate
//! `plotters` rounds to whole pixels, cannot clip, and measures text with system fonts only. Slow curves become stairs,
//! and legends are misplaced. The SVG renderer is needed anyway, and axes and lines are a smaller part.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use study::number::significant;

use crate::report::axis::{Axis, drawable};
use crate::report::page::packed;
use crate::report::picture::{Anchor, Picture, text_width, wrapped};
use crate::report::polyline;

/// Colours of Okabe and Ito, distinguishable by colour-blind readers, without their yellow (invisible on white); then
/// grey.
pub(super) const PALETTE: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#808080"];
/// Index of black, for true values and references.
pub const BLACK: usize = 6;
/// Index of grey, for bounds and limits.
pub const GREY: usize = 7;

pub(super) const INK: &str = "#222222";
pub(super) const SOFT_INK: &str = "#555555";
const GRID: &str = "#e8e8e8";
const SHADE: &str = "#f8d2a6";

pub(super) const TITLE_PX: f64 = 17.0;
/// Largest number of lines of a title; a longer one ends in two dots.
const TITLE_LINES: usize = 4;
pub(super) const LABEL_PX: f64 = 13.0;
pub(super) const TICK_PX: f64 = 12.0;
/// Height of a line in the head of a panel, px.
const LINE_PX: f64 = 20.0;
/// Length of a line sample in the legend, px.
const SAMPLE_PX: f64 = 26.0;
pub(super) const MARGIN_PX: f64 = 14.0;

/// Line style.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Style {
    /// ─────
    #[default]
    Solid,
    /// ─ ─ ─
    Dashed,
    /// ·····
    Dotted,
}

/// Curve of a panel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Legend text; an empty text has no entry.
    pub label: String,
    /// Points (x, y), connected in their order. A value that is not finite or beyond 1e100 is a gap.
    #[serde(with = "packed")]
    pub points: Vec<(f64, f64)>,
    /// Line style.
    pub style: Style,
    /// Index into the palette of eight colours, cyclic; see [`BLACK`] and [`GREY`].
    pub color: usize,
    /// Whether a value holds until the next point; the line is then drawn in steps.
    pub is_held: bool,
    /// Whether every point has a dot, for curves with few points.
    pub has_dots: bool,
}

impl Series {
    /// Returns a solid line.
    pub fn solid(label: impl Into<String>, color: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), points: points.into_iter().collect(), color, ..Self::default() }
    }

    /// Returns the number of common x at which both curves are within `near` of each other, and the number of common x.
    fn on(&self, other: &Self, x: &Axis, near: f64) -> (usize, usize) {
        let same_x = |((x, _), (other, _)): (&(f64, f64), &(f64, f64))| x == other;
        if self.points.len() != other.points.len() || !self.points.iter().zip(&other.points).all(same_x) {
            return (0, 1);
        }
        let pairs = self.points.iter().zip(&other.points).filter(|((at, _), _)| (x.lo..=x.hi).contains(at));
        pairs.fold((0, 0), |(on, all), ((_, a), (_, b))| (on + usize::from((a - b).abs() <= near), all + 1))
    }

    /// Returns the sample for the legend; a curve of single points has no line.
    fn sample(&self) -> Sample {
        let is_seen = |(x, y): &(f64, f64)| drawable(*x) && drawable(*y);
        let is_line = self.points.windows(2).any(|pair| pair.iter().all(is_seen));
        let Self { style, color, has_dots, .. } = *self;
        Sample::Curve { line: (is_line || !has_dots).then_some(style), has_dots, color }
    }

    /// Returns the line in another style.
    #[must_use]
    pub fn styled(mut self, style: Style) -> Self {
        self.style = style;
        self
    }
}

/// Tinted intervals of x, as the time in saturation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shade {
    /// Legend text.
    pub label: String,
    /// Intervals (from, to).
    pub intervals: Vec<(f64, f64)>,
}

impl Shade {
    /// Returns the intervals that are visible on the axis.
    fn seen<'a>(&'a self, axis: &'a Axis) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.intervals.iter().copied().filter(|&(from, to)| from <= to && to >= axis.lo && from <= axis.hi)
    }
}

/// Panel: a pair of axes with its curves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Title above the panel; may be empty.
    pub title: String,
    /// Quantity and unit of x, as `t (s)`. Written once under stacked panels with equal label and range.
    pub x_label: String,
    /// Quantity and unit of y.
    pub y_label: String,
    /// Curves, the last one on top.
    pub series: Vec<Series>,
    /// Tinted intervals behind the lines.
    pub shade: Option<Shade>,
    /// Range of x; `None` for all data.
    pub x_range: Option<(f64, f64)>,
    /// Range of y; `None` for all data within the range of x. Data beyond the range are cut off, and the head shows
    /// their peak.
    pub y_range: Option<(f64, f64)>,
    /// Whether both axes are logarithmic, over all data above 0. Other data are gaps, and the ranges are ignored.
    pub is_log: bool,
}

/// Figure: panels in rows of `columns`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Title above all panels; may be empty.
    pub title: String,
    /// Panels row by row.
    pub panels: Vec<Panel>,
    /// Number of panels per row; 0 counts as 1.
    pub columns: usize,
}

impl Figure {
    /// Returns the figure as an SVG file. Text stays text, in the font of this crate or a fallback.
    #[must_use]
    pub fn svg(&self) -> String {
        self.draw().finish().svg().to_owned()
    }

    /// Returns the figure as a PNG file with two dots per pixel of the SVG.
    ///
    /// # Errors
    /// If the figure is too large for the memory.
    #[cfg(feature = "png")]
    pub fn png(&self) -> io::Result<Vec<u8>> {
        self.draw().finish().png()
    }

    /// Writes `stem.svg` into the folder, with the feature `png` also `stem.png`, each completely or not at all.
    ///
    /// # Errors
    /// If a file cannot be written, or if the figure is too large for the memory.
    pub fn write(&self, folder: &Path, stem: &str) -> io::Result<()> {
        self.draw().finish().write(folder, stem)
    }

    fn plot_height(&self) -> f64 {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        [360.0, 360.0, 230.0, 180.0][self.panels.len().div_ceil(columns).min(3)]
    }

    /// Returns the panels. A curve that lies on another one for at least half of its points gets another style. If it
    /// does so everywhere, the legend names the other curve.
    fn told_apart(&self) -> Vec<Panel> {
        let mut panels = self.panels.clone();
        for panel in &mut panels {
            if panel.is_log {
                // A value without a logarithm is a gap.
                for (x, y) in panel.series.iter_mut().flat_map(|series| &mut series.points) {
                    (*x, *y) = if *x > 0.0 && *y > 0.0 { (*x, *y) } else { (f64::NAN, f64::NAN) };
                }
                continue;
            }
            let Scales { x, y, .. } = Scales::new(panel);
            let pixel = (y.hi - y.lo) / self.plot_height();
            for k in 1..panel.series.len() {
                let (below, above) = panel.series.split_at_mut(k);
                let curve = &mut above[0];
                let (mut taken, mut same) = (Vec::new(), None);
                for other in below.iter() {
                    let (on, all) = curve.on(other, &x, pixel);
                    if all > 0 && 2 * on >= all {
                        taken.push(other.style);
                    }
                    if all > 0 && on == all {
                        same = same.or(Some(&other.label));
                    }
                }
                if let Some(label) = same.filter(|label| !label.is_empty() && !curve.label.is_empty()) {
                    curve.label = format!("{} (on {label})", curve.label);
                }
                // A solid line hides lines under it, and dashes hide equal dashes.
                let hides = |style: Style| taken.contains(&style) || (style == Style::Solid && !taken.is_empty());
                if hides(curve.style) {
                    // With more than three coinciding curves some stay hidden; the legend names them.
                    curve.style =
                        if hides(Style::Dashed) && !hides(Style::Dotted) { Style::Dotted } else { Style::Dashed };
                }
            }
        }
        panels
    }

    fn draw(&self) -> Picture {
        Self { panels: self.told_apart(), ..self.clone() }.drawn()
    }

    fn drawn(&self) -> Picture {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns);
        let cell_width = if columns == 1 { 900.0 } else { 600.0 };
        let plot_height = self.plot_height();
        let width = cell_width * columns as f64;

        let scales: Vec<Scales> = self.panels.iter().map(Scales::new).collect();
        // One left edge per column and one top and bottom edge per row align comparable axes.
        let lefts: Vec<f64> = (0..columns)
            .map(|column| scales.iter().skip(column).step_by(columns).map(Scales::left).fold(0.0, f64::max))
            .collect();
        let boxes: Vec<PlotBox> = (0..self.panels.len())
            .map(|k| {
                let (left, column) = (lefts[k % columns], (k % columns) as f64);
                PlotBox {
                    label_x: column * cell_width + MARGIN_PX + 0.6 * LABEL_PX,
                    x: column * cell_width + left,
                    y: 0.0,
                    width: cell_width - left - 1.5 * MARGIN_PX,
                    height: plot_height,
                }
            })
            .collect();
        let heads: Vec<Head> =
            (0..boxes.len()).map(|k| Head::new(&self.panels[k], &scales[k], boxes[k].width)).collect();
        // A panel labels its x axis unless the panel below labels it for both.
        let names_x = |k: usize| {
            let below = k + columns;
            below >= boxes.len()
                || self.panels[below].x_label != self.panels[k].x_label
                || (scales[below].x.lo, scales[below].x.hi) != (scales[k].x.lo, scales[k].x.hi)
        };

        let title = wrapped(&self.title, TITLE_PX, width - 2.0 * MARGIN_PX, TITLE_LINES);
        let title_height = 1.3 * TITLE_PX * title.len() as f64;
        let mut y = if title.is_empty() { MARGIN_PX } else { MARGIN_PX + title_height + 0.5 * TITLE_PX };
        let mut tops = Vec::new();
        for row in 0..rows {
            let panels = row * columns..((row + 1) * columns).min(boxes.len());
            y += panels.clone().map(|k| heads[k].height()).fold(0.0, f64::max);
            tops.push(y);
            y += plot_height + if panels.clone().any(names_x) { 44.0 } else { 26.0 };
        }
        let mut picture = Picture::new(width, (y + 0.5 * MARGIN_PX).ceil(), &self.title);
        for (line, text) in title.iter().enumerate() {
            let base = MARGIN_PX + TITLE_PX * (1.0 + 1.3 * line as f64);
            picture.text((width / 2.0, base), TITLE_PX, INK, Anchor::Middle, 0.0, text);
        }
        for (k, panel) in self.panels.iter().enumerate() {
            let area = PlotBox { y: tops[k / columns], ..boxes[k] };
            heads[k].draw(&mut picture, &area);
            draw_panel(&mut picture, &area, panel, &scales[k], k, names_x(k));
        }
        picture
    }
}

/// Area of the curves, px.
#[derive(Clone, Copy)]
struct PlotBox {
    /// Base line of the y label, left of the area, px.
    label_x: f64,
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

/// Both axes of a panel.
struct Scales {
    x: Axis,
    y: Axis,
    /// Value of largest magnitude beyond the range of y.
    off_scale: Option<f64>,
    /// Whether data lie beyond one of the ranges.
    hides: bool,
}

impl Scales {
    fn new(panel: &Panel) -> Self {
        let all = || panel.series.iter().flat_map(|series| series.points.iter().copied());
        let drawn = || all().filter(|&(x, y)| drawable(x) && drawable(y));
        if panel.is_log {
            let [x, y] = [drawn().map(|(x, _)| x).collect::<Vec<_>>(), drawn().map(|(_, y)| y).collect()];
            let [x, y] = [x, y].map(Axis::logarithmic_with_scale);
            return Self { x, y, off_scale: None, hides: false };
        }
        let x = Axis::new(panel.x_range, drawn().map(|(x, _)| x), 0.0, 10);
        let visible = || drawn().filter(|(value, _)| (x.lo..=x.hi).contains(value)).map(|(_, y)| y);
        let y = Axis::new(panel.y_range, visible(), 0.06, 6);
        let off_scale =
            visible().filter(|value| !(y.lo..=y.hi).contains(value)).max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let hides = off_scale.is_some() || drawn().any(|(value, _)| !(x.lo..=x.hi).contains(&value));
        Self { x, y, off_scale, hides }
    }

    /// Returns the width of the label and the ticks of y, px.
    fn left(&self) -> f64 {
        let texts = self.y.ticks.iter().map(|(_, text)| text).chain([&self.y.factor]);
        MARGIN_PX + 2.1 * LABEL_PX + texts.map(|text| text_width(text, TICK_PX)).fold(0.0, f64::max)
    }
}

/// Head of a panel: title and legend, on one line if they fit, otherwise on several.
struct Head {
    title: String,
    entries: Vec<(Sample, String)>,
    /// Lines of entries, each with its left edge, px.
    lines: Vec<Vec<(f64, usize)>>,
}

/// Sample before the text of a legend entry.
#[derive(Clone, Copy)]
enum Sample {
    /// Line, dots, or both.
    Curve {
        line: Option<Style>,
        has_dots: bool,
        color: usize,
    },
    Shade,
    None,
}

impl Head {
    fn new(panel: &Panel, scales: &Scales, width: f64) -> Self {
        let lines = panel.series.iter().filter(|series| !series.label.is_empty());
        let mut entries: Vec<(Sample, String)> = lines.map(|series| (series.sample(), series.label.clone())).collect();
        let shades = panel.shade.iter().filter(|shade| shade.seen(&scales.x).next().is_some());
        entries.extend(shades.map(|shade| (Sample::Shade, shade.label.clone())));
        entries.extend(scales.off_scale.map(|value| {
            (Sample::None, format!("(peak {} off scale)", significant(value, 3).replace('-', "\u{2212}")))
        }));

        let widths: Vec<f64> = entries
            .iter()
            .map(|(sample, text)| {
                text_width(text, TICK_PX) + if matches!(sample, Sample::None) { 0.0 } else { SAMPLE_PX + 6.0 }
            })
            .collect();
        let gap = 18.0;
        let title_width = if panel.title.is_empty() { 0.0 } else { text_width(&panel.title, LABEL_PX) + gap };
        let total = widths.iter().map(|width| width + gap).sum::<f64>() - gap;
        let mut lines = vec![Vec::new()];
        if title_width + total <= width {
            let mut x = width - total;
            for (k, entry_width) in widths.iter().enumerate() {
                lines[0].push((x, k));
                x += entry_width + gap;
            }
        } else {
            let mut x = f64::INFINITY;
            for (k, entry_width) in widths.iter().enumerate() {
                if x + entry_width > width {
                    lines.push(Vec::new());
                    x = 0.0;
                }
                if let Some(line) = lines.last_mut() {
                    line.push((x, k));
                }
                x += entry_width + gap;
            }
            if panel.title.is_empty() {
                lines.remove(0);
            }
        }
        Self { title: panel.title.clone(), entries, lines }
    }

    fn height(&self) -> f64 {
        LINE_PX * self.lines.len() as f64 + 4.0
    }

    fn draw(&self, picture: &mut Picture, area: &PlotBox) {
        let base = |line: usize| area.y - 8.0 - LINE_PX * (self.lines.len() - 1 - line) as f64;
        picture.text((area.x, base(0)), LABEL_PX, INK, Anchor::Start, 0.0, &self.title);
        for (line, entries) in self.lines.iter().enumerate() {
            for &(offset, k) in entries {
                let (sample, text) = &self.entries[k];
                let (x, y) = (area.x + offset, base(line));
                let middle = y - 0.35 * TICK_PX;
                let end = x + SAMPLE_PX;
                match *sample {
                    Sample::Curve { line, has_dots, color } => {
                        if let Some(style) = line {
                            picture.element(&stroke(&format!("M{x:.2} {middle:.2}H{end:.2}"), style, color, 2.0));
                        }
                        if has_dots {
                            picture.element(&dot((0.5 * (x + end), middle), color));
                        }
                    }
                    Sample::Shade => picture.element(&format!(
                        "<rect x=\"{x:.2}\" y=\"{:.2}\" width=\"{SAMPLE_PX}\" height=\"11\" fill=\"{SHADE}\"/>",
                        middle - 5.5
                    )),
                    Sample::None => {}
                }
                let start = if matches!(sample, Sample::None) { x } else { end + 6.0 };
                picture.text((start, y), TICK_PX, SOFT_INK, Anchor::Start, 0.0, text);
            }
        }
    }
}

fn dot((x, y): (f64, f64), color: usize) -> String {
    format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"4\" fill=\"{}\"/>", PALETTE[color % PALETTE.len()])
}

/// Returns a path in the style of a series.
fn stroke(path: &str, style: Style, color: usize, width: f64) -> String {
    let dashes = match style {
        Style::Solid => "",
        Style::Dashed => " stroke-dasharray=\"7 4\"",
        Style::Dotted => " stroke-dasharray=\"1.6 3\"",
    };
    // A round cap would close the gaps of a dashed line.
    let cap = if style == Style::Solid { "round" } else { "butt" };
    format!(
        "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\" \
         stroke-linecap=\"{cap}\"{dashes}/>",
        PALETTE[color % PALETTE.len()]
    )
}

fn draw_panel(picture: &mut Picture, area: &PlotBox, panel: &Panel, scales: &Scales, number: usize, names_x: bool) {
    let PlotBox { x: left, y: top, width, height, .. } = *area;
    let (right, bottom) = (left + width, top + height);
    // Lines leave the panel by at most this distance: they are cut off there, and coordinates stay small.
    let beyond = 1e5;
    let to_x = |x: f64| (left + width * scales.x.place(x)).clamp(left - beyond, right + beyond);
    let to_y = |y: f64| (bottom - height * scales.y.place(y)).clamp(top - beyond, bottom + beyond);

    if let Some(shade) = &panel.shade {
        let inside = |x: f64| to_x(x).clamp(left, right);
        let path = shade_path(shade.seen(&scales.x).map(|(from, to)| (inside(from), inside(to))), top, bottom);
        if !path.is_empty() {
            picture.element(&format!("<path fill=\"{SHADE}\" d=\"{path}\"/>"));
        }
    }
    let mut grid = String::new();
    for (value, text) in &scales.x.ticks {
        // Writing to a String cannot fail.
        let _ = write!(grid, "M{:.2} {top:.2}V{bottom:.2}", to_x(*value));
        picture.text((to_x(*value), bottom + 17.0), TICK_PX, SOFT_INK, Anchor::Middle, 0.0, text);
    }
    for (value, text) in &scales.y.ticks {
        let _ = write!(grid, "M{left:.2} {:.2}H{right:.2}", to_y(*value));
        picture.text((left - 7.0, to_y(*value) + 0.36 * TICK_PX), TICK_PX, SOFT_INK, Anchor::End, 0.0, text);
    }
    picture.element(&format!("<path d=\"{grid}\" fill=\"none\" stroke=\"{GRID}\" stroke-width=\"1\"/>"));
    if !panel.series.iter().flat_map(|series| &series.points).any(|&(x, y)| drawable(x) && drawable(y)) {
        let middle = (left + width / 2.0, top + height / 2.0);
        picture.text(middle, LABEL_PX, SOFT_INK, Anchor::Middle, 0.0, "no data");
    }
    let mut lines = String::new();
    for series in &panel.series {
        let points = series.points.iter().map(|&(x, y)| (drawable(x) && drawable(y)).then(|| (to_x(x), to_y(y))));
        let pieces = if series.is_held {
            let next = series.points.iter().skip(1).map(|&(x, _)| drawable(x).then(|| to_x(x)));
            let held = points.zip(next.chain([None])).flat_map(|(point, next)| {
                let end = point.zip(next).map(|((_, y), x)| (x, y));
                // A piece without a point has no end.
                [Some(point), end.map(Some)].into_iter().flatten()
            });
            polyline::pieces(held)
        } else {
            polyline::pieces(points)
        };
        let path = polyline::path_data(&pieces);
        if !path.is_empty() {
            lines += &stroke(&path, series.style, series.color, 1.6);
        }
        let dots = series.points.iter().filter(|(x, y)| series.has_dots && drawable(*x) && drawable(*y));
        for (x, y) in dots {
            lines += &dot((to_x(*x), to_y(*y)), series.color);
        }
    }
    if scales.hides {
        // Clipped only if needed: the renderer draws a clip in a second picture.
        lines = format!(
            "<clipPath id=\"panel{number}\"><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" \
             height=\"{height:.2}\"/></clipPath><g clip-path=\"url(#panel{number})\">{lines}</g>"
        );
    }
    picture.element(&lines);
    picture.element(&format!(
        "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"none\" \
         stroke=\"{SOFT_INK}\" stroke-width=\"1\"/>"
    ));
    picture.text((left - 7.0, top - 8.0), TICK_PX, SOFT_INK, Anchor::End, 0.0, &scales.y.factor);
    let middle = top + height / 2.0;
    let room = (height + LINE_PX) / text_width(&panel.y_label, LABEL_PX).max(1.0);
    picture.text((area.label_x, middle), LABEL_PX * room.min(1.0), INK, Anchor::Middle, -90.0, &panel.y_label);
    if names_x {
        let label = format!("{} {}", panel.x_label, scales.x.factor);
        picture.text((left + width / 2.0, bottom + 37.0), LABEL_PX, INK, Anchor::Middle, 0.0, label.trim());
    }
}

/// Returns rectangles over whole pixel columns. Intervals closer than a pixel are joined, so that the file stays small.
fn shade_path(intervals: impl Iterator<Item = (f64, f64)>, top: f64, bottom: f64) -> String {
    let mut merged: Vec<(f64, f64)> = Vec::new();
    for (from, to) in intervals {
        // A single tick would be too thin to see.
        let to = to.max(from + 3.0);
        match merged.last_mut() {
            Some(last) if from >= last.0 && from <= last.1 + 1.0 => last.1 = last.1.max(to),
            _ => merged.push((from, to)),
        }
    }
    let mut path = String::new();
    for (from, to) in merged {
        let _ = write!(path, "M{from:.2} {top:.2}H{to:.2}V{bottom:.2}H{from:.2}Z");
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Damped oscillation that ends in a small sine, as of a controlled flexible joint: 20 s at 1 ms.
    fn joint() -> Vec<(f64, f64)> {
        let times = (0..=20_000).map(|k| f64::from(k) * 1e-3);
        times.map(|t| (t, 279.0 * libm::exp(-9.0 * t) * libm::cos(25.0 * t) + 4.0 * libm::sin(2.0 * t))).collect()
    }

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        Panel {
            title: "Control".into(),
            x_label: "t (s)".into(),
            y_label: "u (A)".into(),
            series: vec![Series::solid("u", 0, points)],
            ..Panel::default()
        }
    }

    fn figure(panels: Vec<Panel>) -> Figure {
        Figure { title: "A joint & its <control>".into(), panels, columns: 1 }
    }

    #[test]
    fn the_same_figure_is_the_same_bytes() {
        let figure = figure(vec![panel(joint()); 4]);
        assert_eq!(figure.svg(), figure.svg());
        assert_eq!(figure.png().unwrap(), figure.png().unwrap());
    }

    #[test]
    fn a_long_run_stays_small() {
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8);
        let chatter = (0..=20_000).map(|k| (f64::from(k) * 1e-3, noise(k)));
        let smooth = figure(vec![panel(joint()); 4]).svg().len();
        assert!(smooth < 100_000, "{smooth} bytes");
        let rough = figure(vec![panel(chatter.collect()); 4]).svg().len();
        assert!(rough < 400_000, "{rough} bytes");
    }

    #[test]
    fn gaps_empty_and_extreme_data_still_draw() {
        let nasty = vec![
            vec![],
            vec![(0.0, f64::NAN), (1.0, 2.0), (2.0, f64::INFINITY), (f64::NAN, 1.0)],
            vec![(0.0, 5.0), (1.0, 5.0)],
            vec![(3.0, 0.0)],
            vec![(0.0, f64::MAX), (1.0, -f64::MAX)],
            vec![(0.0, 1e99), (1.0, -1e99), (1e99, 1e-320)],
            vec![(0.0, 1e-320), (1.0, 2e-320)],
        ];
        for points in nasty {
            for range in [None, Some((0.0, 1e-3)), Some((1.0, -1.0)), Some((f64::NAN, 0.0))] {
                let mut panel = panel(points.clone());
                (panel.x_range, panel.y_range) = (range, range);
                panel.shade = Some(Shade { label: "saturated".into(), intervals: points.clone() });
                let svg = figure(vec![panel]).svg();
                assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"), "{points:?}");
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}: {svg}");
            }
        }
        for columns in [0, 1, 7] {
            assert!(Figure { title: String::new(), panels: vec![], columns }.png().is_ok());
        }
    }

    /// Returns the path data of the curves of a panel.
    fn curves(panel: &Panel) -> Vec<String> {
        let svg = figure(vec![panel.clone()]).svg();
        let curves = svg.lines().filter(|line| line.contains("stroke-width=\"1.6\""));
        curves.map(|line| line.split('"').nth(1).unwrap().to_owned()).collect()
    }

    #[test]
    fn a_held_value_is_drawn_in_steps() {
        let points = vec![(0.0, 0.0), (1.0, 3.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 1.5), (5.0, 0.5)];
        let ramps = panel(points);
        let mut steps = ramps.clone();
        steps.series[0].is_held = true;
        let corners = |path: &str| -> Vec<(f64, f64)> {
            let pairs = path.split(['M', 'L']).filter(|pair| !pair.is_empty());
            pairs
                .map(|pair| pair.split_once(' ').unwrap())
                .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
                .collect()
        };
        let slopes = |panel: &Panel| {
            let path = curves(panel).concat();
            let pieces = path.split('M').map(corners);
            pieces.map(|piece| piece.windows(2).filter(|p| p[0].0 != p[1].0 && p[0].1 != p[1].1).count()).sum::<usize>()
        };
        assert_eq!((slopes(&ramps), slopes(&steps)), (3, 0));
        // The value before a gap is held up to the gap.
        let corners: Vec<_> = curves(&steps).concat().split('M').map(|piece| corners(piece).len()).collect();
        assert_eq!(corners, [0, 4, 5]);
    }

    #[test]
    fn of_curves_that_hide_each_other_all_are_seen_and_the_legend_says_so() {
        let mut panel = panel(joint());
        let also = |label: &str, color: usize, gap: f64| {
            Series::solid(label, color, joint().into_iter().map(|(t, y)| (t, y + gap)))
        };
        panel.series.extend([also("same", 1, 1e-3), also("same again", 2, 0.0), also("apart", 3, 60.0)]);
        let late = joint().into_iter().map(|(t, y)| (t, if t < 4.0 { y + 60.0 } else { y }));
        panel.series.push(Series::solid("later the same", 4, late));
        let shown = figure(vec![panel]).told_apart();
        let styles: Vec<Style> = shown[0].series.iter().map(|series| series.style).collect();
        assert_eq!(styles, [Style::Solid, Style::Dashed, Style::Dotted, Style::Solid, Style::Dashed]);
        let labels: Vec<&str> = shown[0].series.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["u", "same (on u)", "same again (on u)", "apart", "later the same"]);
        // A solid line also hides a dashed one under it.
        let dashed = Series::solid("under", 1, joint()).styled(Style::Dashed);
        let two = Panel { series: vec![dashed, Series::solid("over", 2, joint())], ..Panel::default() };
        assert_eq!(figure(vec![two]).told_apart()[0].series[1].style, Style::Dotted);
    }

    #[test]
    fn a_long_title_is_broken_into_lines_that_fit() {
        let widths = |title: &str| {
            let svg = Figure { title: title.into(), ..figure(vec![panel(joint())]) }.svg();
            let size = format!("font-size=\"{TITLE_PX}\"");
            let lines: Vec<&str> = svg.lines().filter(|line| line.contains(&size)).collect();
            let text = |line: &str| line.split(['<', '>']).nth(2).unwrap().to_owned();
            lines.into_iter().map(text).map(|line| text_width(&line, TITLE_PX)).collect::<Vec<_>>()
        };
        assert_eq!(widths("Short").len(), 1);
        let words = "set controller.observer[1].bandwidth_rad_s=100, ".repeat(6);
        for (title, lines) in [(words.as_str(), 3), (&"x".repeat(300), 4), (&"so on ".repeat(2000), 4)] {
            let widths = widths(title);
            assert_eq!(widths.len(), lines, "{title}");
            assert!(widths.iter().all(|width| *width <= 900.0 - 2.0 * MARGIN_PX), "{widths:?}");
        }
    }

    #[test]
    fn the_legend_shows_a_dot_for_what_is_drawn_as_dots_alone() {
        let strokes = |points: &[(f64, f64)], has_dots: bool| {
            let mut panel = panel(points.to_vec());
            panel.series[0].has_dots = has_dots;
            let svg = figure(vec![panel]).svg();
            ["stroke-width=\"2\"", "<circle"].map(|word| svg.matches(word).count())
        };
        let alone = [(0.0, 1.0), (f64::NAN, f64::NAN), (1.0, 2.0)];
        // A line in the sample or none; dots of the curve, and one of the sample.
        assert_eq!(strokes(&alone, true), [0, 3]);
        assert_eq!(strokes(&[(0.0, 1.0), (1.0, 2.0)], true), [1, 3]);
        assert_eq!(strokes(&alone, false), [1, 0]);
    }

    #[test]
    fn a_power_law_is_a_straight_line_on_logarithmic_axes() {
        let mut panel = panel([1.0, 10.0, 100.0, -1.0, 0.0].map(|x| (x, 1e-3 / (x * x))).to_vec());
        (panel.is_log, panel.series[0].has_dots) = (true, true);
        // The dot in the legend is not part of the curve.
        panel.series[0].label.clear();
        let svg = figure(vec![panel]).svg();
        let number = |text: &str, name: &str| -> f64 {
            text.split(&format!("{name}=\"")).nth(1).and_then(|rest| rest.split('"').next()).unwrap().parse().unwrap()
        };
        let dots: Vec<(f64, f64)> =
            svg.split("<circle").skip(1).map(|dot| (number(dot, "cx"), number(dot, "cy"))).collect();
        assert_eq!(dots.len(), 3, "two of them have no logarithm");
        let steps = [0, 1].map(|k| (dots[k + 1].0 - dots[k].0, dots[k + 1].1 - dots[k].1));
        assert!((steps[0].0 - steps[1].0).abs() < 0.02 && (steps[0].1 - steps[1].1).abs() < 0.02, "{steps:?}");
        assert!(steps[0].0 > 100.0 && steps[0].1 > 50.0, "to the right and down");
    }

    #[test]
    fn a_value_that_is_not_finite_is_a_gap() {
        let strokes = |middle: f64| {
            let points = vec![(0.0, 0.0), (1.0, 1.0), (2.0, middle), (3.0, 1.0), (4.0, 5.0)];
            let svg = figure(vec![panel(points)]).svg();
            let line = svg.lines().find(|line| line.contains("stroke-width=\"1.6\"")).unwrap().to_owned();
            line.matches('M').count()
        };
        assert_eq!(strokes(2.0), 1);
        for missing in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(strokes(missing), 2);
        }
    }

    #[test]
    fn what_the_range_hides_is_cut_off_and_said() {
        let mut panel = panel(joint());
        assert_eq!(Scales::new(&panel).off_scale, None);
        let clipped = |panel: &Panel| figure(vec![panel.clone()]).svg().contains("clipPath");
        assert!(!clipped(&panel));
        panel.y_range = Some((-5.0, 5.0));
        assert_eq!(Scales::new(&panel).off_scale, Some(279.0));
        let texts = |panel: &Panel| {
            let head = Head::new(panel, &Scales::new(panel), 800.0);
            head.entries.into_iter().map(|(_, text)| text).collect::<Vec<_>>()
        };
        assert_eq!(texts(&panel), ["u", "(peak 279 off scale)"]);
        assert!(clipped(&panel));
        panel.x_range = Some((10.0, 20.0));
        assert_eq!(texts(&panel), ["u"]);
        assert!(clipped(&panel));
    }

    #[test]
    fn a_legend_that_does_not_fit_takes_more_lines_and_stays_in_the_panel() {
        let mut panel = panel(joint());
        let head = Head::new(&panel, &Scales::new(&panel), 500.0);
        assert_eq!(head.lines.len(), 1);
        panel.series = (0..9).map(|k| Series::solid(format!("a rather long label {k}"), k, [])).collect();
        let head = Head::new(&panel, &Scales::new(&panel), 500.0);
        assert_eq!(head.lines.iter().map(Vec::len).collect::<Vec<_>>(), [0, 3, 3, 3]);
        for &(x, k) in head.lines.iter().flatten() {
            assert!(x + SAMPLE_PX + 6.0 + text_width(&head.entries[k].1, TICK_PX) <= 500.0);
        }
    }

    #[test]
    fn short_saturations_merge_but_stay_visible() {
        let chatter = (0..10_000).map(|k| f64::from(k) * 0.08).map(|x| (x, x));
        assert_eq!(shade_path(chatter, 0.0, 9.0), "M0.00 0.00H802.92V9.00H0.00Z");
        assert_eq!(shade_path([(5.0, 5.0), (9.5, 9.6)].into_iter(), 0.0, 1.0).matches('M').count(), 2);
    }

    #[test]
    fn intervals_out_of_sight_leave_no_tint_and_no_entry() {
        let intervals = vec![(5.0, f64::NAN), (3.0, 2.0), (0.0, 0.5), (0.9, 1.1), (4.0, f64::INFINITY), (6.0, 7.0)];
        let mut panel = panel(joint());
        panel.shade = Some(Shade { label: "saturated".into(), intervals });
        let seen = |panel: &Panel| panel.shade.as_ref().unwrap().seen(&Scales::new(panel).x).collect::<Vec<_>>();
        panel.x_range = Some((1.0, 5.0));
        assert_eq!(seen(&panel), [(0.9, 1.1), (4.0, f64::INFINITY)]);
        let tinted = |panel: &Panel| figure(vec![panel.clone()]).svg().matches(SHADE).count();
        assert_eq!(tinted(&panel), 2, "one sample in the legend, one path of all intervals");
        panel.x_range = Some((2.0, 3.5));
        assert_eq!((seen(&panel).len(), tinted(&panel)), (0, 0));
    }

    #[test]
    fn both_files_are_written_and_nothing_else() {
        let folder = crate::report::tests::folder("figure");
        figure(vec![panel(joint())]).write(&folder, "control").unwrap();
        let mut names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["control.png", "control.svg"]);
        assert!(std::fs::read(folder.join("control.png")).unwrap().starts_with(b"\x89PNG"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
