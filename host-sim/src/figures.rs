//! The figures of the paper, and its claims held against what comes out.
//!
//! A figure is a scenario file, the cases it compares (a label and the keys they set), the panels it draws and the claims
//! the paper makes about it. [`CATALOGUE`] lists all ten; [`reproduce`] runs one. A claim that holds today must hold
//! tomorrow: `host-sim figures` ends with status 1 if one no longer does. A claim that does *not* hold says so in the same
//! table.
//!
//! The paper's controller is continuous; its figures are run with the discrete one at T = 0.2 ms (Example 2) and 0.1 ms
//! (Example 1), where the ultimate σ* is within 1 % of the continuous one.

mod catalogue;

use serde::Serialize;

use crate::metrics::{self, Metrics};
use crate::report::plot::{Figure, Panel, Series};
use crate::scenario::{self, Experiment, ScenarioError, Source};
use crate::trace::{Row, Trace};

pub use catalogue::CATALOGUE;

/// One figure of the paper.
pub struct PaperFigure {
    /// `fig01` .. `fig10`.
    pub id: &'static str,
    /// The scenario file.
    pub scenario: &'static str,
    /// What is compared: label and `key=value` settings on top of the file.
    pub cases: &'static [(&'static str, &'static [&'static str])],
    panels: &'static [PanelSpec],
    claims: &'static [Claim],
}

/// One panel: a quantity of every case, or several quantities of the only one.
struct PanelSpec {
    y_label: &'static str,
    /// Legend text (with several quantities) and value.
    quantities: &'static [(&'static str, fn(&Row) -> f64)],
    /// Time shown, s; the whole span if `None`.
    x_range: Option<(f64, f64)>,
    y_range: Option<(f64, f64)>,
}

/// What the paper says, and how to see whether it is so.
struct Claim {
    text: &'static str,
    /// As printed.
    published: &'static str,
    /// The figure of merit, from the cases in the order of the catalogue.
    reproduced: fn(&[Case]) -> f64,
    unit: &'static str,
    /// What the figure of merit must do for the claim to hold.
    test: Test,
    /// Does it hold today? Where it does not, the remark says why.
    holds: bool,
    remark: &'static str,
}

/// When a claim holds.
enum Test {
    /// Within this fraction of a published value.
    Near(f64, f64),
    /// At most this.
    AtMost(f64),
}

impl Test {
    fn passes(&self, value: f64) -> bool {
        match *self {
            Self::Near(published, fraction) => (value - published).abs() <= fraction * published.abs(),
            Self::AtMost(limit) => value <= limit,
        }
    }

    fn text(&self) -> String {
        match *self {
            Self::Near(_, fraction) => format!("within {} %", 100.0 * fraction),
            Self::AtMost(limit) => format!("at most {limit}"),
        }
    }
}

/// A case that was run.
pub struct Case {
    /// Its label in the legends.
    pub label: &'static str,
    /// Its trace.
    pub trace: Trace,
    /// Its figures of merit.
    pub metrics: Metrics,
}

impl Case {
    /// max |f| over rows from `from_s` on.
    fn peak(&self, from_s: f64, f: impl Fn(&Row) -> f64) -> f64 {
        metrics::ultimate(&self.trace, [from_s, f64::INFINITY], f)
    }

    /// Root mean square of f over the metric window.
    fn rms(&self, f: impl Fn(&Row) -> f64) -> f64 {
        metrics::rms(&self.trace, self.metrics.window_s, f)
    }
}

/// A row of the table of claims.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClaimRow {
    /// `fig01` .. `fig10`.
    pub figure: &'static str,
    /// What the paper says.
    pub claim: &'static str,
    /// The number or words printed.
    pub published: &'static str,
    /// What comes out here.
    pub reproduced: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What it takes for the claim to hold.
    pub criterion: String,
    /// Reading of the paper and period.
    pub reading: String,
    /// Does the claim hold?
    pub holds: bool,
    /// Did it hold when the catalogue was written? If so it must still.
    pub held_before: bool,
    /// Why not, or in what sense.
    pub remark: &'static str,
}

impl ClaimRow {
    /// A number that reproduced before no longer does.
    pub fn is_regression(&self) -> bool {
        self.held_before && !self.holds
    }
}

/// A figure, drawn and judged.
pub struct Reproduction {
    /// The drawing.
    pub figure: Figure,
    /// The claims.
    pub claims: Vec<ClaimRow>,
    /// The cases behind both.
    pub cases: Vec<Case>,
}

impl PaperFigure {
    /// The experiments of this figure, one per case.
    ///
    /// # Errors
    /// If its scenario is wrong (a fault of this program; a test builds them all).
    pub fn experiments(&self) -> Result<Vec<Experiment>, ScenarioError> {
        let file = format!("{}.toml", self.id);
        self.cases
            .iter()
            .map(|(_, sets)| {
                let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
                scenario::parse(&Source { file: &file, text: self.scenario, sets: &sets }, self.id)
            })
            .collect()
    }

    /// Draws and judges the traces of [`experiments`](Self::experiments), given in their order.
    pub fn judge(&self, title: &str, reading: &str, cases: Vec<Case>) -> Reproduction {
        let claims = self
            .claims
            .iter()
            .map(|claim| {
                let reproduced = (claim.reproduced)(&cases);
                ClaimRow {
                    figure: self.id,
                    claim: claim.text,
                    published: claim.published,
                    reproduced,
                    unit: claim.unit,
                    criterion: claim.test.text(),
                    reading: reading.into(),
                    holds: claim.test.passes(reproduced),
                    held_before: claim.holds,
                    remark: claim.remark,
                }
            })
            .collect();
        Reproduction { figure: self.draw(title, &cases), claims, cases }
    }

    fn draw(&self, title: &str, cases: &[Case]) -> Figure {
        let points = |case: &Case, f: fn(&Row) -> f64| -> Vec<(f64, f64)> {
            case.trace.rows.iter().map(|row| (row.t_s, f(row))).collect()
        };
        let panels = self.panels.iter().map(|panel| {
            let mut series = Vec::new();
            for case in cases {
                for &(name, quantity) in panel.quantities {
                    let label = if cases.len() > 1 { case.label } else { name };
                    series.push(Series::solid(label, series.len(), points(case, quantity)));
                }
            }
            Panel {
                x_label: "t (s)".into(),
                y_label: panel.y_label.into(),
                series,
                x_range: panel.x_range,
                y_range: panel.y_range,
                ..Panel::default()
            }
        });
        Figure { title: title.into(), panels: panels.collect(), columns: 1 }
    }
}
