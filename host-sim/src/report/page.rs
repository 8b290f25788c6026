//! A report as one HTML file that asks nobody for anything: text, tables, figures that zoom, and all of it as data.
//!
//! An [`Account`] is what is told of one scenario, section by section. A [`Page`] puts accounts side by side: of tables
//! that have a column `value` each account gets a column, of panels with the same title and axis each gets its curves.
//!
//! * On a screen a figure over time is drawn by uPlot from the numbers in the file: drag to zoom, all charts of a
//!   figure together, double click to go back. In print, and where no script runs, it is the drawing that
//!   [`Figure::svg`] makes.
//! * The file holds its accounts as JSON. [`accounts`] reads them back, so that a report can be laid beside a new run
//!   long after what made it is gone. Curves are kept in f32 (7 digits), times of ticks as they were.
//!
//! The same accounts give the same bytes on every machine: nothing here asks for date, host or user.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use terminal::table::Table;

use super::picture::escaped;
use super::plot::{Figure, PALETTE, Panel, Series, Shade, Style};

pub(super) mod packed;

const UPLOT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const SCRIPT: &str = include_str!("page/page.js");
const STYLE: &str = include_str!("page/page.css");

/// Where the accounts stand in the file.
const DATA_BEGINS: &str = "<script type=\"application/json\" id=\"accounts\">";
const DATA_ENDS: &str = "</script>";
/// The column of a table of which every account gets one.
const VALUE: &str = "value";

/// What is told of one scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Account {
    /// What it is called beside others.
    pub name: String,
    /// In the order of the page.
    pub sections: Vec<Section>,
}

/// A heading and what stands under it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// The heading.
    pub heading: String,
    /// A sentence a paragraph.
    pub says: Vec<String>,
    /// Under the sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<Table>,
    /// Under the tables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// SVG files that are no [`Figure`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drawings: Vec<String>,
    /// What a text is called, and the text.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<(String, String)>,
}

/// Accounts side by side.
pub struct Page<'a> {
    /// Stands above all.
    pub title: &'a str,
    /// At least one.
    pub accounts: &'a [Account],
}

/// A curve of a chart: where its numbers are, and how it is drawn.
#[derive(Serialize)]
struct Curve {
    /// Account, section, figure, panel, series, from 0.
    at: [usize; 5],
    label: String,
    color: &'static str,
    dash: &'static [u8],
    is_held: bool,
    has_dots: bool,
}

/// A panel on the screen.
#[derive(Serialize)]
struct Chart<'a> {
    title: &'a str,
    x_label: &'a str,
    y_label: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    shade: Option<&'a Shade>,
    x_range: Option<(f64, f64)>,
    y_range: Option<(f64, f64)>,
    is_log: bool,
    curves: Vec<Curve>,
}

/// A panel of the page: its own, and whose series it has.
struct Merged {
    panel: Panel,
    from: Vec<[usize; 5]>,
}

/// The accounts in a report that [`Page::html`] made; none if it is no such file.
pub fn accounts(html: &str) -> Option<Vec<Account>> {
    let (_, rest) = html.split_once(DATA_BEGINS)?;
    let (data, _) = rest.split_once(DATA_ENDS)?;
    serde_json::from_str(data).ok()
}

/// Is it an SVG of what this program draws, with nothing in it that could run or load? It came from a file.
fn is_still(svg: &str) -> bool {
    const DRAWN: [&str; 12] =
        ["svg", "title", "defs", "clipPath", "g", "path", "line", "polyline", "polygon", "rect", "circle", "text"];
    // As this program writes: a blank before each attribute, its value between double quotes, no < or > in one.
    let is_attribute = |name: &str| {
        name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-:B".contains(c))
            && !name.starts_with("on")
            && !name.contains("href")
            && name != "style"
    };
    let is_drawn = |tag: &str| {
        let tag = tag.trim_end_matches('/');
        let (name, rest) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut words = rest.split('"');
        let mut are_drawn = DRAWN.contains(&name.trim_start_matches('/'));
        while let (Some(before), Some(_value)) = (words.next(), words.next()) {
            are_drawn &= before.trim_start().strip_suffix('=').is_some_and(is_attribute);
        }
        are_drawn && rest.matches('"').count() % 2 == 0 && (rest.trim().is_empty() || rest.trim_end().ends_with('"'))
    };
    let mut parts = svg.split('<');
    let is_bare = parts.next().is_some_and(|before| before.trim().is_empty());
    is_bare && parts.all(|part| part.split_once('>').is_some_and(|(tag, text)| is_drawn(tag) && !text.contains('>')))
}

impl Page<'_> {
    /// The file.
    ///
    /// # Errors
    /// None that is known of: those of the writer of JSON.
    pub fn html(&self) -> serde_json::Result<String> {
        let mut charts = Vec::new();
        let mut body = String::new();
        let headings = self.headings();
        for (k, heading) in headings.iter().enumerate() {
            let _ = writeln!(body, "<section id=\"s{k}\"><h2>{}</h2>", escaped(heading));
            self.section(heading, &mut body, &mut charts)?;
            body += "</section>\n";
        }
        let link = |(k, heading): (usize, &&str)| format!("<a href=\"#s{k}\">{}</a>\n", escaped(heading));
        let links = headings.iter().enumerate().map(link).collect::<Vec<_>>().concat();
        // What begins or ends a script does so inside of a string too.
        let in_script = |json: String| json.replace('<', "\\u003c");
        let data = in_script(serde_json::to_string(self.accounts)?);
        let charts = in_script(serde_json::to_string(&charts)?);
        let title = escaped(self.title);
        Ok(format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n\
             <style>\n{UPLOT_STYLE}\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<nav>\n{links}</nav>\n{body}\
             {DATA_BEGINS}{data}{DATA_ENDS}\n\
             <script type=\"application/json\" id=\"charts\">{charts}</script>\n\
             <script>\n{UPLOT}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n"
        ))
    }

    /// Those of the first account, then what only others have.
    fn headings(&self) -> Vec<&str> {
        let mut headings: Vec<&str> = Vec::new();
        for section in self.accounts.iter().flat_map(|account| &account.sections) {
            if !headings.contains(&section.heading.as_str()) {
                headings.push(&section.heading);
            }
        }
        headings
    }

    fn section(&self, heading: &str, body: &mut String, charts: &mut Vec<serde_json::Value>) -> serde_json::Result<()> {
        // Whose it is, and which of its sections.
        let parts: Vec<(usize, usize, &Section)> = self
            .accounts
            .iter()
            .enumerate()
            .filter_map(|(a, account)| {
                let s = account.sections.iter().position(|section| section.heading == heading)?;
                Some((a, s, &account.sections[s]))
            })
            .collect();
        let whose = |a: usize| {
            if self.accounts.len() < 2 {
                String::new()
            } else {
                format!("<b class=\"w{}\">{}</b> ", a % PALETTE.len(), escaped(&self.accounts[a].name))
            }
        };
        for (a, _, section) in &parts {
            for words in &section.says {
                let _ = writeln!(body, "<p>{}{}</p>", whose(*a), escaped(words));
            }
        }
        self.tables(&parts, &whose, body);
        self.figures(&parts, body, charts)?;
        for (a, _, section) in &parts {
            for (k, svg) in section.drawings.iter().enumerate() {
                let svg = if is_still(svg) {
                    alone(svg, &format!("d{a}-{k}-{}", charts.len()))
                } else {
                    "<p>A drawing is left out: it has more in it than lines and text.</p>".into()
                };
                let _ = writeln!(body, "<figure>{}{svg}</figure>", whose(*a));
            }
            for (name, text) in &section.files {
                let lines: Vec<String> = text.lines().map(escaped).collect();
                let (whose, name, text) = (whose(*a), escaped(name), lines.join("\n"));
                let _ = writeln!(body, "<details><summary>{whose}{name}</summary><pre>{text}</pre></details>");
            }
        }
        Ok(())
    }

    fn tables(&self, parts: &[(usize, usize, &Section)], whose: &dyn Fn(usize) -> String, body: &mut String) {
        let most = parts.iter().map(|(.., section)| section.tables.len()).max().unwrap_or(0);
        for k in 0..most {
            let of_all: Vec<(usize, &Table)> =
                parts.iter().filter_map(|(a, _, section)| Some((*a, section.tables.get(k)?))).collect();
            let header = of_all.first().map_or(&[][..], |(_, table)| table.header());
            let is_one = of_all.iter().all(|(_, table)| table.header() == header);
            match header.iter().position(|name| name == VALUE) {
                Some(value) if of_all.len() > 1 && is_one => {
                    let names: Vec<&str> = of_all.iter().map(|(a, _)| self.accounts[*a].name.as_str()).collect();
                    let tables: Vec<&Table> = of_all.iter().map(|(_, table)| *table).collect();
                    html_table(&beside(&tables, &names, value), body);
                }
                _ => {
                    for (a, table) in of_all {
                        let whose = whose(a);
                        if !whose.is_empty() {
                            let _ = writeln!(body, "<p>{whose}</p>");
                        }
                        html_table(table, body);
                    }
                }
            }
        }
    }

    fn figures(
        &self,
        parts: &[(usize, usize, &Section)],
        body: &mut String,
        charts: &mut Vec<serde_json::Value>,
    ) -> serde_json::Result<()> {
        let most = parts.iter().map(|(.., section)| section.figures.len()).max().unwrap_or(0);
        for f in 0..most {
            let merged = self.merged(parts, f);
            let first = parts.iter().find_map(|(.., section)| section.figures.get(f));
            let is_alone = self.accounts.len() < 2;
            let figure = Figure {
                title: first.filter(|_| is_alone).map_or_else(String::new, |figure| figure.title.clone()),
                panels: merged.iter().map(|merged| merged.panel.clone()).collect(),
                columns: first.map_or(1, |figure| figure.columns),
            };
            let still = alone(&figure.svg(), &format!("c{}-{f}", charts.len()));
            let zooms = merged.iter().all(|merged| merged.panel.series.iter().all(is_over_time));
            if !zooms {
                let _ = writeln!(body, "<figure>{still}</figure>");
                continue;
            }
            let _ = writeln!(body, "<figure class=\"still\">{still}</figure>");
            let columns = figure.columns.clamp(1, 3);
            let _ = writeln!(body, "<div class=\"charts columns{columns}\">");
            for Merged { panel, from } in &merged {
                let _ = writeln!(body, "<div class=\"chart\" data-chart=\"{}\"></div>", charts.len());
                charts.push(serde_json::to_value(Chart::of(panel, from))?);
            }
            body.push_str("</div>\n");
        }
        Ok(())
    }

    /// The panels of the f-th figure of these sections, with the curves of all accounts in which a panel is the same.
    fn merged(&self, parts: &[(usize, usize, &Section)], f: usize) -> Vec<Merged> {
        let mut merged: Vec<Merged> = Vec::new();
        let is_alone = self.accounts.len() < 2;
        for (a, s, section) in parts {
            for (p, panel) in section.figures.get(f).iter().flat_map(|figure| figure.panels.iter().enumerate()) {
                let name = &self.accounts[*a].name;
                let curves = panel.series.iter().enumerate().map(|(k, series)| {
                    let mut series = series.clone();
                    if !is_alone {
                        // A curve without a name has that of its account; the second of such is no other.
                        let of_panel = if series.label.is_empty() { "" } else { ", " };
                        series.label = format!("{name}{of_panel}{}", series.label);
                        series.color = (*a + self.accounts.len() * k) % PALETTE.len();
                    }
                    (series, [*a, *s, f, p, k])
                });
                let (series, from): (Vec<Series>, Vec<[usize; 5]>) = curves.unzip();
                let same = merged.iter_mut().find(|other| {
                    let other = &other.panel;
                    (&other.title, &other.y_label, &other.x_label) == (&panel.title, &panel.y_label, &panel.x_label)
                });
                match same {
                    Some(other) => {
                        other.panel.series.extend(series);
                        other.from.extend(from);
                        // Which of them is saturated would not be seen; and a range is that of one.
                        other.panel.shade = None;
                        if (other.panel.x_range, other.panel.y_range) != (panel.x_range, panel.y_range) {
                            (other.panel.x_range, other.panel.y_range) = (None, None);
                        }
                    }
                    None => merged.push(Merged { panel: Panel { series, ..panel.clone() }, from }),
                }
            }
        }
        merged
    }
}

impl<'a> Chart<'a> {
    fn of(panel: &'a Panel, from: &[[usize; 5]]) -> Self {
        let curves = panel.series.iter().zip(from).map(|(series, at)| Curve {
            at: *at,
            label: series.label.clone(),
            color: PALETTE[series.color % PALETTE.len()],
            dash: match series.style {
                Style::Solid => &[],
                Style::Dashed => &[8, 5],
                Style::Dotted => &[2, 4],
            },
            is_held: series.is_held,
            has_dots: series.has_dots,
        });
        Self {
            title: &panel.title,
            x_label: &panel.x_label,
            y_label: &panel.y_label,
            shade: panel.shade.as_ref(),
            x_range: panel.x_range,
            y_range: panel.y_range,
            is_log: panel.is_log,
            curves: curves.collect(),
        }
    }
}

/// From left to right, so that one can zoom into it.
fn is_over_time(series: &Series) -> bool {
    series.points.iter().all(|(x, _)| x.is_finite()) && series.points.is_sorted_by(|(a, _), (b, _)| a < b)
}

/// A drawing beside others: two in one file may not name two clips alike.
fn alone(svg: &str, name: &str) -> String {
    svg.replace("\"panel", &format!("\"{name}-panel")).replace("#panel", &format!("#{name}-panel"))
}

/// One table of several with the same header: rows by their first cell, a value of each; of two the quotient too.
fn beside(tables: &[&Table], names: &[&str], value: usize) -> Table {
    let header = tables[0].header();
    let others = |rows: &[&[String]]| -> Vec<String> {
        let all = |k: usize| {
            let texts: Vec<&str> = rows.iter().filter_map(|row| row.get(k)).map(String::as_str).collect();
            // In the order of the scenarios, once where all say the same.
            if texts.windows(2).all(|pair| pair[0] == pair[1]) {
                texts[..texts.len().min(1)].concat()
            } else {
                texts.join(" | ")
            }
        };
        (1..header.len()).filter(|k| *k != value).map(all).collect()
    };
    let quotient = (names.len() == 2).then(|| format!("{} / {}", names[1], names[0]));
    let head = header.iter().take(1).cloned().chain(names.iter().map(|name| (*name).to_owned()));
    let mut merged = Table::new(head.chain(quotient).chain(others(&[header])));
    let mut keys: Vec<&String> = Vec::new();
    for key in tables.iter().flat_map(|table| table.rows()).filter_map(|row| row.first()) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    for key in keys {
        let rows: Vec<Option<&Vec<String>>> =
            tables.iter().map(|table| table.rows().iter().find(|row| row.first() == Some(key))).collect();
        let values: Vec<String> =
            rows.iter().map(|row| row.and_then(|row| row.get(value)).cloned().unwrap_or_else(|| "-".into())).collect();
        let numbers: Vec<Option<f64>> = values.iter().map(|value| value.parse().ok()).collect();
        let quotient = (names.len() == 2).then(|| match numbers[..] {
            [Some(a), Some(b)] if a != 0.0 => study::number::significant(b / a, 3),
            _ => String::new(),
        });
        let known: Vec<&[String]> = rows.iter().flatten().map(|row| row.as_slice()).collect();
        let rest = others(&known);
        merged.row([key.clone()].into_iter().chain(values).chain(quotient).chain(rest));
    }
    merged
}

fn html_table(table: &Table, body: &mut String) {
    let line = |cells: &[String], tag: &str| -> String {
        cells.iter().map(|text| format!("<{tag}>{}</{tag}>", escaped(text))).collect::<Vec<_>>().concat()
    };
    let _ = writeln!(body, "<table>\n<thead><tr>{}</tr></thead>\n<tbody>", line(table.header(), "th"));
    for row in table.rows() {
        let _ = writeln!(body, "<tr>{}</tr>", line(row, "td"));
    }
    body.push_str("</tbody>\n</table>\n");
}

#[cfg(test)]
mod tests;
