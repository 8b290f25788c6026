//! Heat map: one value over two axes, as SVG and PNG.
//!
//! The colour of a cell is its value on the scale viridis. The lightness of this scale grows evenly, so that it is
//! readable in grey and by colour-blind readers. Unstable cells and cells without a value have colours outside of the
//! scale. A dark line encloses the good cells, a dashed white frame the guaranteed tolerance. A ring marks the values
//! of the file.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use study::number::significant;

use super::axis::{Axis, drawable};
use super::picture::{Anchor, Drawing, Picture, text_width, wrapped};
use super::plot::{INK, LABEL_PX, MARGIN_PX, SOFT_INK, TICK_PX, TITLE_PX};

/// Nine colours of viridis, from the lowest value to the highest.
const SCALE: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 45.0, 123.0],
    [59.0, 82.0, 139.0],
    [44.0, 114.0, 142.0],
    [33.0, 145.0, 140.0],
    [40.0, 174.0, 128.0],
    [94.0, 201.0, 98.0],
    [173.0, 220.0, 48.0],
    [253.0, 231.0, 37.0],
];
/// Number of steps of the drawn scale; more are not distinguishable.
const STEPS: usize = 64;

const UNSTABLE: &str = "#f3c6ae";
const NOTHING: &str = "#e4e4e4";

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 520.0;
const BAR_PX: f64 = 18.0;

/// Content of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    /// Value on the scale.
    Value(f64),
    /// Unstable loop, which has no meaningful value.
    Unstable,
    /// No design.
    Nothing,
}

/// Values along an edge: words, or numbers that grow evenly or by a factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Quantity and unit.
    pub label: String,
    /// Text of each cell.
    pub texts: Vec<String>,
    /// Number of each cell; `None` for words.
    pub numbers: Option<Vec<f64>>,
    /// Whether the numbers grow by a factor.
    pub is_log: bool,
}

/// Heat map as data.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Title above the map.
    pub title: String,
    /// Quantity and unit of the scale.
    pub label: String,
    /// Columns from left to right.
    pub x: Edge,
    /// Rows from below.
    pub y: Edge,
    /// Cells row by row, from the lowest row.
    pub cells: Vec<Cell>,
    /// Good cells; a dark line encloses them.
    pub good: Vec<bool>,
    /// First and last column, first and last row of the frame. It runs through the centres of these cells.
    pub frame: Option<[usize; 4]>,
    /// Position of the ring along both edges, 0 to 1 ([`Edge::place`]).
    pub mark: Option<[f64; 2]>,
}

/// Area of the cells, px.
#[derive(Clone, Copy)]
struct Area {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    columns: usize,
    rows: usize,
}

impl Area {
    /// Returns the left edge of a column.
    fn x(&self, column: usize) -> f64 {
        self.left + self.width * column as f64 / self.columns as f64
    }

    /// Returns the lower edge of a row.
    fn y(&self, row: usize) -> f64 {
        self.top + self.height * (1.0 - row as f64 / self.rows as f64)
    }
}

impl HeatMap {
    /// Returns the SVG file.
    pub fn svg(&self) -> String {
        self.draw().svg().to_owned()
    }

    /// Writes STEM.svg into the folder, with the feature `png` also STEM.png.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path, stem: &str) -> io::Result<()> {
        self.draw().write(folder, stem)
    }

    /// Returns the scale of all values. It is logarithmic if all are above 0 and their ratio exceeds 100.
    fn scale(&self) -> Axis {
        let values =
            self.cells.iter().filter_map(|cell| if let Cell::Value(value) = cell { Some(*value) } else { None });
        let values: Vec<f64> = values.filter(|value| drawable(*value)).collect();
        let (least, most) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(*v), m.max(*v)));
        if least > 0.0 && most > 100.0 * least { Axis::logarithmic(values) } else { Axis::new(None, values, 0.0, 6) }
    }

    fn draw(&self) -> Drawing {
        let scale = self.scale();
        let title = wrapped(&self.title, TITLE_PX, WIDTH - 2.0 * MARGIN_PX, 4);
        let ticks = self.y.ticks();
        let widest =
            |texts: &mut dyn Iterator<Item = &String>| texts.map(|text| text_width(text, TICK_PX)).fold(0.0, f64::max);
        let left = MARGIN_PX + 2.1 * LABEL_PX + widest(&mut ticks.iter().map(|(_, text)| text));
        let of_scale = widest(&mut scale.ticks.iter().map(|(_, text)| text).chain([&scale.factor]));
        let right = MARGIN_PX + 2.1 * LABEL_PX + of_scale + BAR_PX + 34.0;
        let top = MARGIN_PX + 1.3 * TITLE_PX * title.len() as f64 + 34.0;
        let area = Area {
            left,
            top,
            width: WIDTH - left - right,
            height: HEIGHT,
            columns: self.x.texts.len(),
            rows: self.y.texts.len(),
        };
        let mut picture = Picture::new(WIDTH, top + HEIGHT + 58.0, &self.title);
        for (line, text) in title.iter().enumerate() {
            let base = MARGIN_PX + TITLE_PX * (1.0 + 1.3 * line as f64);
            picture.text((WIDTH / 2.0, base), TITLE_PX, INK, Anchor::Middle, 0.0, text);
        }
        self.draw_legend(&mut picture, &area);
        self.draw_cells(&mut picture, &area, &scale);
        self.draw_edges(&mut picture, &area, &ticks);
        draw_bar(&mut picture, &area, &scale, &self.label);
        picture.finish()
    }

    /// Draws the legend of the special colours and lines that the map contains.
    fn draw_legend(&self, picture: &mut Picture, area: &Area) {
        let filled = |fill: &str| format!("<rect width=\"22\" height=\"12\" fill=\"{fill}\"/>");
        let on_dark = |shape: &str| filled(&color(0.3)) + shape;
        let frame = on_dark("<path d=\"M1 6H21\" stroke=\"#ffffff\" stroke-width=\"2.5\" stroke-dasharray=\"6 3\"/>");
        let ring = on_dark("<circle cx=\"11\" cy=\"6\" r=\"4\" fill=\"none\" stroke=\"#ffffff\" stroke-width=\"2\"/>");
        let has = |cell: Cell| self.cells.contains(&cell);
        let entries = [
            (has(Cell::Unstable), filled(UNSTABLE), "unstable"),
            (has(Cell::Nothing), filled(NOTHING), "no design"),
            (self.frame.is_some(), frame, "guaranteed tolerance"),
            (self.mark.is_some(), ring, "values of the file"),
        ];
        let mut x = area.left;
        for (_, shape, text) in entries.into_iter().filter(|(is_there, ..)| *is_there) {
            let y = area.top - 12.0;
            picture.element(&format!("<g transform=\"translate({x:.2} {:.2})\">{shape}</g>", y - 10.0));
            picture.text((x + 28.0, y), TICK_PX, SOFT_INK, Anchor::Start, 0.0, text);
            x += 28.0 + text_width(text, TICK_PX) + 22.0;
        }
    }

    fn draw_cells(&self, picture: &mut Picture, area: &Area, scale: &Axis) {
        // One path per colour keeps the file of a large map small.
        let mut of_color: BTreeMap<String, String> = BTreeMap::new();
        for (k, cell) in self.cells.iter().enumerate() {
            let fill = match cell {
                Cell::Value(value) if drawable(*value) => color(scale.place(*value)),
                Cell::Unstable => UNSTABLE.into(),
                _ => NOTHING.into(),
            };
            let (column, row) = (k % area.columns, k / area.columns);
            // Writing to a String cannot fail.
            let _ = write!(
                of_color.entry(fill).or_default(),
                "M{:.2} {:.2}H{:.2}V{:.2}H{:.2}Z",
                area.x(column),
                area.y(row),
                area.x(column + 1),
                area.y(row + 1),
                area.x(column)
            );
        }
        for (fill, path) in of_color {
            // A thin stroke of this colour closes the seams that renderers leave between neighbours.
            picture.element(&format!("<path d=\"{path}\" fill=\"{fill}\" stroke=\"{fill}\" stroke-width=\"0.4\"/>"));
        }
        let is_good = |column: Option<usize>, row: Option<usize>| -> bool {
            let (Some(column), Some(row)) = (column, row) else { return false };
            column < area.columns && self.good.get(row * area.columns + column) == Some(&true)
        };
        let mut around = String::new();
        for row in 0..=area.rows {
            for column in 0..=area.columns {
                let [beside, below] = [column.checked_sub(1), row.checked_sub(1)];
                let here = is_good(Some(column), Some(row));
                if here != is_good(beside, Some(row)) && column > 0 && column < area.columns && row < area.rows {
                    let _ = write!(around, "M{:.2} {:.2}V{:.2}", area.x(column), area.y(row), area.y(row + 1));
                }
                if here != is_good(Some(column), below) && row > 0 && row < area.rows && column < area.columns {
                    let _ = write!(around, "M{:.2} {:.2}H{:.2}", area.x(column), area.y(row), area.x(column + 1));
                }
            }
        }
        if !around.is_empty() {
            picture.element(&format!(
                "<path d=\"{around}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"2\" stroke-linecap=\"square\"/>"
            ));
        }
        if let Some([first, last, low, high]) = self.frame {
            let [left, right] = [first, last].map(|column| f64::midpoint(area.x(column), area.x(column + 1)));
            let [top, bottom] = [high, low].map(|row| f64::midpoint(area.y(row), area.y(row + 1)));
            picture.element(&format!(
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"none\" \
                 stroke=\"#ffffff\" stroke-width=\"2.5\" stroke-dasharray=\"9 5\"/>",
                (right - left).max(1.0),
                (bottom - top).max(1.0)
            ));
        }
        if let Some([x, y]) = self.mark {
            let (x, y) = (area.left + area.width * x, area.top + area.height * (1.0 - y));
            for (stroke, width) in [(INK, 4.5), ("#ffffff", 2.5)] {
                picture.element(&format!(
                    "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"6\" fill=\"none\" stroke=\"{stroke}\" \
                     stroke-width=\"{width}\"/>"
                ));
            }
        }
    }

    fn draw_edges(&self, picture: &mut Picture, area: &Area, of_y: &[(f64, String)]) {
        let Area { left, top, width, height, .. } = *area;
        let (right, bottom) = (left + width, top + height);
        let mut marks = String::new();
        for (place, text) in self.x.ticks() {
            let x = left + width * place;
            let _ = write!(marks, "M{x:.2} {bottom:.2}v5");
            picture.text((x, bottom + 19.0), TICK_PX, SOFT_INK, Anchor::Middle, 0.0, &text);
        }
        for (place, text) in of_y {
            let y = bottom - height * place;
            let _ = write!(marks, "M{left:.2} {y:.2}h-5");
            picture.text((left - 8.0, y + 0.36 * TICK_PX), TICK_PX, SOFT_INK, Anchor::End, 0.0, text);
        }
        picture.element(&format!(
            "<path d=\"{marks}M{left:.2} {top:.2}H{right:.2}V{bottom:.2}H{left:.2}Z\" fill=\"none\" \
             stroke=\"{SOFT_INK}\" stroke-width=\"1\"/>"
        ));
        picture.text((left + 0.5 * width, bottom + 42.0), LABEL_PX, INK, Anchor::Middle, 0.0, &self.x.label);
        let at = (MARGIN_PX + 0.6 * LABEL_PX, top + 0.5 * height);
        picture.text(at, LABEL_PX, INK, Anchor::Middle, -90.0, &self.y.label);
    }
}

impl Edge {
    /// Returns the scale of the numbers; `None` for words and for a single cell.
    fn axis(&self) -> Option<Axis> {
        let [first, .., last] = self.numbers.as_deref()? else { return None };
        let (first, last) = (*first, *last);
        Some(if self.is_log { Axis::logarithmic([first, last]) } else { Axis::new(Some((first, last)), [], 0.0, 8) })
    }

    /// Returns the position of a number along the edge, 0 to 1; the number of a cell lies at its centre. `None`
    /// outside.
    pub fn place(&self, value: f64) -> Option<f64> {
        let [first, .., last] = self.numbers.as_deref()? else { return None };
        let (axis, count) = (self.axis()?, self.texts.len());
        let [begin, end] = [first, last].map(|value| axis.place(*value));
        let place = ((axis.place(value) - begin) / (end - begin) * (count - 1) as f64 + 0.5) / count as f64;
        (0.0..=1.0).contains(&place).then_some(place)
    }

    /// Returns the position of the centre of a cell.
    pub fn middle(&self, cell: usize) -> f64 {
        (cell as f64 + 0.5) / self.texts.len() as f64
    }

    /// Returns position and text of each tick.
    fn ticks(&self) -> Vec<(f64, String)> {
        let Some(axis) = self.axis() else {
            // Words: at most 12, for lack of space.
            let every = self.texts.len().div_ceil(12).max(1);
            return self
                .texts
                .iter()
                .enumerate()
                .step_by(every)
                .map(|(k, text)| (self.middle(k), text.clone()))
                .collect();
        };
        let plain = |(value, text): &(f64, String)| {
            // A separate factor at the axis is easily overlooked.
            let text = if axis.factor.is_empty() { text.clone() } else { significant(*value, 2) };
            Some((self.place(*value)?, text))
        };
        axis.ticks.iter().filter_map(plain).collect()
    }
}

fn draw_bar(picture: &mut Picture, area: &Area, scale: &Axis, label: &str) {
    let (left, bottom) = (area.left + area.width + 24.0, area.top + area.height);
    for step in 0..STEPS {
        let height = area.height / STEPS as f64;
        let fill = color((step as f64 + 0.5) / STEPS as f64);
        picture.element(&format!(
            "<rect x=\"{left:.2}\" y=\"{:.2}\" width=\"{BAR_PX}\" height=\"{:.2}\" fill=\"{fill}\"/>",
            bottom - height * (step + 1) as f64,
            height + 0.4
        ));
    }
    let mut marks = String::new();
    let right = left + BAR_PX;
    for (value, text) in &scale.ticks {
        let y = bottom - area.height * scale.place(*value);
        let _ = write!(marks, "M{right:.2} {y:.2}h4");
        picture.text((right + 7.0, y + 0.36 * TICK_PX), TICK_PX, SOFT_INK, Anchor::Start, 0.0, text);
    }
    picture.element(&format!("<path d=\"{marks}\" fill=\"none\" stroke=\"{SOFT_INK}\" stroke-width=\"1\"/>"));
    picture.text((left, area.top - 8.0), TICK_PX, SOFT_INK, Anchor::Start, 0.0, &scale.factor);
    let at = (WIDTH - MARGIN_PX, area.top + 0.5 * area.height);
    picture.text(at, LABEL_PX, INK, Anchor::Middle, -90.0, label);
}

/// Returns the colour at a position of the scale, 0 to 1.
fn color(place: f64) -> String {
    let step = (place.clamp(0.0, 1.0) * STEPS as f64).floor().min((STEPS - 1) as f64) / (STEPS - 1) as f64;
    let at = step * (SCALE.len() - 1) as f64;
    let below = (at.floor() as usize).min(SCALE.len() - 2);
    let share = at - below as f64;
    let [red, green, blue]: [u8; 3] = std::array::from_fn(|i| {
        let [from, to] = [SCALE[below][i], SCALE[below + 1][i]];
        (from + share * (to - from)).round() as u8
    });
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(count: usize) -> Edge {
        let numbers: Vec<f64> = (0..count).map(|k| k as f64).collect();
        let texts = numbers.iter().map(ToString::to_string).collect();
        Edge { label: "key".into(), texts, numbers: Some(numbers), is_log: false }
    }

    fn map() -> HeatMap {
        let cells: Vec<Cell> =
            (0..12).map(|k| if k == 3 { Cell::Unstable } else { Cell::Value(f64::from(k)) }).collect();
        let good = cells.iter().map(|cell| *cell != Cell::Unstable).collect();
        HeatMap {
            title: "Title".into(),
            label: "value".into(),
            x: edge(4),
            y: edge(3),
            cells,
            good,
            frame: Some([0, 2, 0, 2]),
            mark: Some([0.5, 0.5]),
        }
    }

    #[test]
    fn the_scale_ends_in_the_ends_of_viridis_and_grows_lighter() {
        assert_eq!([color(-1.0), color(0.0), color(1.0), color(9.0)], ["#440154", "#440154", "#fde725", "#fde725"]);
        let light = |place: f64| {
            let text = color(place);
            let part = |at: usize| f64::from(u8::from_str_radix(&text[at..at + 2], 16).expect("hex"));
            0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
        };
        assert!((0..STEPS - 1).all(|k| light(k as f64 / 63.0) < light((k + 1) as f64 / 63.0)));
    }

    #[test]
    fn a_tick_stands_in_the_middle_of_the_cell_of_its_value() {
        for (place, text) in edge(5).ticks() {
            let value: f64 = text.parse().expect("a number");
            assert!((place - (value + 0.5) / 5.0).abs() < 1e-12, "{place} {text}");
        }
        let log = Edge { numbers: Some(vec![1.0, 10.0, 100.0]), is_log: true, ..edge(3) };
        let at = log.ticks().into_iter().find(|(_, text)| text == "10").expect("a tick at 10").0;
        assert!((at - 0.5).abs() < 1e-12);
    }

    #[test]
    fn words_stand_under_their_cells() {
        let words = Edge { numbers: None, texts: ["quiet", "normal"].map(String::from).into(), ..edge(2) };
        assert_eq!(words.ticks(), [(0.25, "quiet".into()), (0.75, "normal".into())]);
    }

    #[test]
    fn the_legend_has_what_is_there_and_no_more() {
        let all = map().svg();
        let entries = ["unstable", "guaranteed tolerance", "values of the file"];
        assert!(entries.iter().all(|text| all.contains(&format!(">{text}<"))));
        assert!(!all.contains(">no design<"));
        let bare = HeatMap { frame: None, mark: None, cells: vec![Cell::Nothing; 12], good: vec![false; 12], ..map() };
        let bare = bare.svg();
        assert!(bare.contains(">no design<"));
        assert!(entries[1..].iter().all(|text| !bare.contains(&format!(">{text}<"))));
    }

    #[test]
    fn a_frame_runs_through_the_values_of_its_ends_and_a_ring_stands_at_a_value_between_two() {
        assert_eq!(edge(4).place(1.5), Some(0.5));
        assert_eq!(edge(4).place(3.6), None);
        let svg = HeatMap { mark: edge(4).place(0.25).map(|x| [x, 0.5]), ..map() }.svg();
        let number = |shape: &str, name: &str| -> f64 {
            let shape = svg.lines().find(|line| line.contains(shape)).expect("a shape");
            let text = shape.split(&format!(" {name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
            text.and_then(|text| text.parse().ok()).expect("a number")
        };
        // The frame covers three of four columns, from the centre of the first to the centre of the last.
        let (left, width) = (number("dasharray=\"9 5\"", "x"), number("dasharray=\"9 5\"", "width"));
        assert!((number("r=\"6\"", "cx") - (left + 0.125 * width)).abs() < 0.02, "{svg}");
    }

    #[test]
    fn a_line_runs_between_good_and_bad_cells_and_not_along_the_rim() {
        let svg = map().svg();
        // Cell 3 is the last one of the lowest row: its left and upper edge.
        let around = svg.lines().find(|line| line.contains("stroke-linecap=\"square\"")).expect("a line");
        assert_eq!(around.matches('M').count(), 2, "{around}");
        let all_good = HeatMap { good: vec![true; 12], ..map() };
        assert!(!all_good.svg().contains("stroke-linecap=\"square\""));
    }

    #[test]
    fn values_that_are_none_and_maps_of_one_cell_still_draw() {
        let cells = vec![Cell::Value(f64::NAN), Cell::Value(f64::INFINITY), Cell::Value(-1e300)];
        let odd = HeatMap { x: edge(3), y: edge(1), good: vec![true; 3], cells, frame: None, mark: None, ..map() };
        assert!(!odd.svg().contains("NaN") && !odd.svg().contains("inf"));
        let one = HeatMap {
            x: edge(1),
            y: edge(1),
            cells: vec![Cell::Value(1.0)],
            good: vec![true],
            frame: None,
            mark: None,
            ..map()
        };
        assert!(one.draw().png().is_ok());
    }
}
