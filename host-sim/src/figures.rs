//! The figures of the paper, and its claims held against what comes out.
//!
//! A figure is a scenario file, the cases it compares (a label and the keys they set), the panels it draws and the
//! claims the paper makes about it. [`CATALOGUE`] lists all ten. A claim that holds today must hold tomorrow:
//! `host-sim figures` ends with status 1 if one no longer does. A claim that does *not* hold says so in the same table.
//!
//! The paper's controller is continuous; its figures are run with the discrete one at T = 0.2 ms (Example 2) and 0.1 ms
//! (Example 1), where the ultimate σ* is within 1 % of the continuous one.

mod catalogue;

use loop_sim::metrics::{self, Metrics};
use loop_sim::trace::{Row, Trace};
use scenario::{Experiment, ScenarioError, Source};
use serde::Serialize;

use crate::report::plot::{Figure, Panel, Series, Style};

pub use catalogue::CATALOGUE;

/// One figure of the paper.
pub struct PaperFigure {
    /// `fig01` .. `fig10`.
    pub id: &'static str,
    /// The scenario file: name and text.
    pub scenario: (&'static str, &'static str),
    /// Reading of the paper and period.
    pub reading: &'static str,
    /// What is compared: label and `key=value` settings on top of the file.
    pub cases: &'static [(&'static str, &'static [&'static str])],
    /// The controller of reference \[1\] as a last case: label, and its scenario file.
    pub baseline: Option<(&'static str, (&'static str, &'static str))>,
    panels: &'static [PanelSpec],
    claims: &'static [Claim],
}

/// Reads one quantity from a row.
type Quantity = fn(&Row) -> f64;

/// One panel: a quantity of every case, or several quantities of the only one.
#[derive(Clone, Copy)]
struct PanelSpec {
    y_label: &'static str,
    /// Legend text (with several quantities) and value.
    quantities: &'static [(&'static str, Quantity)],
    /// Time shown, s; the whole span if `None`.
    x_range: Option<(f64, f64)>,
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
        // An infinite ratio comes from a run that went wrong, whichever sign it has.
        value.is_finite()
            && match *self {
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
    pub reading: &'static str,
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
}

impl PaperFigure {
    /// The experiments of this figure with their labels, one per case.
    ///
    /// # Errors
    /// If its scenario is wrong (a fault of this program; a test builds them all).
    pub fn experiments(&self) -> Result<Vec<(&'static str, Experiment)>, ScenarioError> {
        let build = |label, (file, text), sets: &[&str]| {
            let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
            Ok((label, scenario::parse(&Source { file, text, sets: &sets }, self.id)?))
        };
        let cases = self.cases.iter().map(|&(label, sets)| build(label, self.scenario, sets));
        cases.chain(self.baseline.map(|(label, file)| build(label, file, &[]))).collect()
    }

    /// Draws and judges the runs of [`experiments`](Self::experiments), given in their order.
    pub fn judge(&self, title: &str, cases: &[Case]) -> Reproduction {
        let claims = self
            .claims
            .iter()
            .map(|claim| {
                let reproduced = (claim.reproduced)(cases);
                ClaimRow {
                    figure: self.id,
                    claim: claim.text,
                    published: claim.published,
                    reproduced,
                    unit: claim.unit,
                    criterion: claim.test.text(),
                    reading: self.reading,
                    holds: claim.test.passes(reproduced),
                    held_before: claim.holds,
                    remark: claim.remark,
                }
            })
            .collect();
        Reproduction { figure: self.draw(title, cases), claims }
    }

    fn draw(&self, title: &str, cases: &[Case]) -> Figure {
        let mut panels: Vec<Panel> = Vec::new();
        let mut letters = 'a'..;
        let mut letter = String::new();
        for panel in self.panels {
            // The paper's letters; a part of the panel before, magnified, has none of its own.
            let repeats = panels.last().is_some_and(|last| last.y_label == panel.y_label);
            if !repeats {
                letter = letters.next().map_or_else(String::new, |letter| format!("({letter})"));
            }
            let title = if repeats { format!("{letter}, magnified") } else { letter.clone() };
            panels.push(Panel { title, ..self.draw_panel(panel, cases) });
        }
        Figure { title: title.into(), columns: if panels.len() > 3 { 2 } else { 1 }, panels }
    }

    fn draw_panel(&self, panel: &PanelSpec, cases: &[Case]) -> Panel {
        let (from_s, to_s) = panel.x_range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let mut series = Vec::new();
        for (c, case) in cases.iter().enumerate() {
            for (q, &(name, quantity)) in panel.quantities.iter().enumerate() {
                let shown = case.trace.rows.iter().filter(|row| (from_s..=to_s).contains(&row.t_s));
                let label = if cases.len() > 1 { case.label } else { name };
                let line = Series {
                    // Of all that is drawn only the control is held from tick to tick.
                    is_held: panel.y_label.starts_with('u'),
                    ..Series::solid(label, c + q, shown.map(|row| (row.t_s, quantity(row))))
                };
                // An estimate lies on what it estimates: dashes show both.
                series.push(if q > 0 { line.styled(Style::Dashed) } else { line });
            }
        }
        if self.baseline.is_some() {
            // The chattering curve to the bottom, else nobody sees the other.
            series.reverse();
        }
        Panel {
            x_label: "t (s)".into(),
            y_label: panel.y_label.into(),
            series,
            x_range: panel.x_range,
            ..Panel::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_of_the_paper_is_here_and_its_scenarios_are_right() {
        let ids: Vec<&str> = CATALOGUE.iter().map(|figure| figure.id).collect();
        assert_eq!(ids, ["fig01", "fig02", "fig03", "fig04", "fig05", "fig06", "fig07", "fig08", "fig09", "fig10"]);
        for figure in CATALOGUE {
            let experiments = figure.experiments().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(experiments.len(), figure.cases.len() + usize::from(figure.baseline.is_some()));
        }
    }

    #[test]
    fn every_scenario_file_of_a_figure_loads_without_a_warning() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).expect("the folder of scenarios") {
            let path = entry.expect("an entry").path();
            let experiment = scenario::load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(experiment.warnings.is_empty(), "{}: {:?}", path.display(), experiment.warnings);
            count += 1;
        }
        assert!(count >= 12, "{count} scenarios");
    }

    #[test]
    fn a_claim_that_held_and_no_longer_does_is_a_regression() {
        let row = |holds, held_before| ClaimRow {
            figure: "fig01",
            claim: "",
            published: "",
            reproduced: 0.0,
            unit: "",
            criterion: String::new(),
            reading: "",
            holds,
            held_before,
            remark: "",
        };
        assert!(row(false, true).is_regression());
        assert!(!row(false, false).is_regression());
        assert!(!row(true, true).is_regression());
    }

    #[test]
    fn near_and_at_most_judge_as_they_say() {
        assert!(Test::Near(-10.0, 0.01).passes(-10.05));
        assert!(!Test::Near(-10.0, 0.01).passes(-99.8));
        assert!(Test::AtMost(0.01).passes(0.01));
        assert!(!Test::AtMost(0.01).passes(0.0101));
        assert!(!Test::AtMost(0.01).passes(f64::NAN) && !Test::AtMost(0.01).passes(f64::NEG_INFINITY));
    }
}
