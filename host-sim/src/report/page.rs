//! HTML report: one file without network access, with text, tables, zoomable figures and their data.
//!
//! An [`Account`] contains the sections of one scenario. A [`Page`] shows accounts side by side. Tables with a column
//! `value` get a column per account. Panels with equal title and axis get the curves of all accounts.
//!
//! * On a screen, uPlot draws the figures over time from the numbers in the file. Drag to zoom all charts of a figure,
//!   double click to reset. In print, and without scripts, the figure is the drawing of [`Figure::svg`].
//! * The file contains its accounts as JSON. [`accounts`] reads them back, so that an old report can be compared with a
//!   new run. Curves are kept in f32 (7 digits), times of ticks exactly.
//!
//! Equal accounts give identical bytes on every machine: date, host and user are not part of the page.

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

/// Begin of the accounts in the file.
const DATA_BEGINS: &str = "<script type=\"application/json\" id=\"accounts\">";
const DATA_ENDS: &str = "</script>";
/// Header of the table column that is repeated per account.
const VALUE: &str = "value";

/// Report of one scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Account {
    /// Name on the page.
    pub name: String,
    /// Sections in the order of the page.
    pub sections: Vec<Section>,
}

/// Section of an account: heading and content.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Heading, equal for all accounts that have the section.
    pub heading: String,
    /// Sentences, each a paragraph.
    pub says: Vec<String>,
    /// Tables below the sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<Table>,
    /// Figures below the tables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// SVG drawings other than a [`Figure`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drawings: Vec<String>,
    /// Attached files: name and text.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<(String, String)>,
}

/// Report page: accounts side by side.
pub struct Page<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// Accounts, at least one.
    pub accounts: &'a [Account],
}

/// Curve of a chart: place of its numbers, and its style.
#[derive(Serialize)]
struct Curve {
    /// Indices of account, section, figure, panel and series, from 0.
    at: [usize; 5],
    label: String,
    color: &'static str,
    dash: &'static [u8],
    is_held: bool,
    has_dots: bool,
}

/// Panel on the screen.
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

/// Panel of the page with the accounts of its series.
struct Merged {
    panel: Panel,
    from: Vec<[usize; 5]>,
}

/// Reads the accounts of a report of [`Page::html`]; `None` if the file is not such a report.
pub fn accounts(html: &str) -> Option<Vec<Account>> {
    let (_, rest) = html.split_once(DATA_BEGINS)?;
    let (data, _) = rest.split_once(DATA_ENDS)?;
    serde_json::from_str(data).ok()
}

/// Returns whether an SVG from a file has only elements that this program draws, and nothing that could run or load.
fn is_still(svg: &str) -> bool {
    const DRAWN: [&str; 12] =
        ["svg", "title", "defs", "clipPath", "g", "path", "line", "polyline", "polygon", "rect", "circle", "text"];
    // The form that this program writes: a blank before each attribute, double quotes, no < or > in a value.
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
    /// Returns the HTML file.
    ///
    /// # Errors
    /// If the JSON writer fails, for which no case is known.
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
        // `<` could begin or end a script also inside a string.
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

    /// Returns the headings of the first account, then those that only other accounts have.
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
        // Index of the account, and its section.
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

    /// Returns the panels of figure `f` of these sections. Equal panels get the curves of all accounts.
    fn merged(&self, parts: &[(usize, usize, &Section)], f: usize) -> Vec<Merged> {
        let mut merged: Vec<Merged> = Vec::new();
        let is_alone = self.accounts.len() < 2;
        for (a, s, section) in parts {
            for (p, panel) in section.figures.get(f).iter().flat_map(|figure| figure.panels.iter().enumerate()) {
                let name = &self.accounts[*a].name;
                let curves = panel.series.iter().enumerate().map(|(k, series)| {
                    let mut series = series.clone();
                    if !is_alone {
                        // A curve without a label gets the name of its account.
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
                        // A tint would not show which account saturates, and a range belongs to one account.
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

/// Returns whether x grows from point to point, so that the chart can zoom.
fn is_over_time(series: &Series) -> bool {
    series.points.iter().all(|(x, _)| x.is_finite()) && series.points.is_sorted_by(|(a, _), (b, _)| a < b)
}

/// Makes the names of clips in a drawing unique, because a file contains several drawings.
fn alone(svg: &str, name: &str) -> String {
    svg.replace("\"panel", &format!("\"{name}-panel")).replace("#panel", &format!("#{name}-panel"))
}

/// Merges tables with equal header: rows by their first cell, a value column per table, for two tables also the
/// quotient.
fn beside(tables: &[&Table], names: &[&str], value: usize) -> Table {
    let header = tables[0].header();
    let others = |rows: &[&[String]]| -> Vec<String> {
        let all = |k: usize| {
            let texts: Vec<&str> = rows.iter().filter_map(|row| row.get(k)).map(String::as_str).collect();
            // In the order of the scenarios; once if all are equal.
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
