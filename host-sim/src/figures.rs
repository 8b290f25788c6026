//! Figures of the paper, reproduced, and checks of its claims.
//!
//! A figure has a scenario file, the cases it compares (a label and the keys they set), its panels, and the claims of
//! the paper. [`CATALOGUE`] lists all ten. `host-sim figures` ends with status 1 if a claim that held before no longer
//! holds. Claims that do *not* hold are in the table, too.
//!
//! Some claims depend on values that the paper does not print: c_1 and alpha of Example 1, and the parameter errors "up
//! to 50 %" of Example 2. Further runs, which are not drawn, vary these values. The table contains the resulting range.
//! A claim that holds on a part of the range only is *open*.
//!
//! The paper's controller is continuous. Here its figures use the discrete controller at T = 0.2 ms (Example 2) and 0.1
//! ms (Example 1). There the ultimate σ* is within 1 % of the continuous one for observers of order 2. For order 3 it
//! is 6 to 9 % larger, because the exact placement of the printed fast pole, -1000 rad/s, costs low-frequency gain.

mod catalogue;

use loop_sim::metrics::{self, Metrics};
use loop_sim::trace::{Row, Trace};
use scenario::{Experiment, ScenarioError, Source};
use serde::Serialize;

use crate::report::plot::{Figure, Panel, Series, Style};

pub use catalogue::CATALOGUE;

/// Figure of the paper.
pub struct PaperFigure {
    /// Identifier, `fig01` .. `fig10`.
    pub id: &'static str,
    /// Scenario file: name and text.
    pub scenario: (&'static str, &'static str),
    /// Reading of the paper and period.
    pub reading: &'static str,
    /// Compared cases: label and `key=value` settings.
    pub cases: &'static [(&'static str, &'static [&'static str])],
    /// Last case with the controller of reference \[1\]: label, and its scenario file.
    pub baseline: Option<(&'static str, (&'static str, &'static str))>,
    /// Further runs, which are evaluated but not drawn: label, scenario file, settings.
    further: &'static [Further],
    panels: &'static [PanelSpec],
    claims: &'static [Claim],
}

/// Label, scenario file and settings of a run.
type Further = (&'static str, (&'static str, &'static str), &'static [&'static str]);

/// Function that reads a quantity from a row.
type Quantity = fn(&Row) -> f64;

/// Panel: one quantity of every case, or several quantities of a single case.
#[derive(Clone, Copy)]
struct PanelSpec {
    y_label: &'static str,
    /// Legend text (for several quantities) and value.
    quantities: &'static [(&'static str, Quantity)],
    /// Time range, s; `None` for the whole run.
    x_range: Option<(f64, f64)>,
}

/// Claim of the paper, and its check.
struct Claim {
    text: &'static str,
    /// Published value.
    published: &'static str,
    /// Figure of merit, from the cases in the order of the catalogue.
    reproduced: Merit,
    unit: &'static str,
    /// Criterion for the figure of merit.
    test: Test,
    /// Known verdict. The remark gives the reason for a claim that does not hold or is open.
    held: KnownVerdict,
    remark: &'static str,
}

/// Verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct KnownVerdict {
    /// Whether the claim holds for the drawn runs.
    pub as_drawn: bool,
    /// Whether the claim holds for all values that the paper leaves open; `None` (JSON null) if for a part of them.
    pub everywhere: Option<bool>,
}

/// Evaluation of a figure of merit.
#[derive(Clone, Copy)]
enum Merit {
    /// One value, from the drawn cases or from certain further ones.
    One(fn(&[Case]) -> f64),
    /// Value as drawn, then the values over the open parameters.
    Range(fn(&[Case]) -> Vec<f64>),
}

/// Criterion of a claim.
enum Test {
    /// Within a relative tolerance of a published value: value, tolerance.
    Near(f64, f64),
    /// At most this value.
    AtMost(f64),
}

impl Test {
    fn passes(&self, value: f64) -> bool {
        // An infinite ratio of either sign comes from a failed run.
        value.is_finite()
            && match *self {
                Self::Near(published, fraction) => (value - published).abs() <= fraction * published.abs(),
                Self::AtMost(limit) => value <= limit,
            }
    }

    /// Returns whether all values pass or none does; `None` if some do.
    fn verdict(&self, values: &[f64]) -> Option<bool> {
        let passed = values.iter().filter(|value| self.passes(**value)).count();
        if passed == 0 { Some(false) } else { (passed == values.len()).then_some(true) }
    }

    fn text(&self) -> String {
        match *self {
            Self::Near(_, fraction) => format!("within {} %", 100.0 * fraction),
            Self::AtMost(limit) => format!("at most {limit}"),
        }
    }
}

/// Case with its run.
pub struct Case {
    /// Label in the legends.
    pub label: &'static str,
    /// Trace of the run.
    pub trace: Trace,
    /// Metrics of the run.
    pub metrics: Metrics,
}

impl Case {
    /// Returns max |f| over the rows from `from_s` on.
    fn peak(&self, from_s: f64, f: impl Fn(&Row) -> f64) -> f64 {
        metrics::ultimate(&self.trace, [from_s, f64::INFINITY], f)
    }

    /// Returns the root mean square of f over the metric window.
    fn rms(&self, f: impl Fn(&Row) -> f64) -> f64 {
        metrics::rms(&self.trace, self.metrics.window_s, f)
    }
}

/// Row of the table of claims.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClaimRow {
    /// Identifier, `fig01` .. `fig10`.
    pub figure: &'static str,
    /// Claim of the paper.
    pub claim: &'static str,
    /// Published number or words.
    pub published: &'static str,
    /// Reproduced value.
    pub reproduced: f64,
    /// Smallest and largest value over the open parameters, if the claim depends on them.
    pub range: Option<[f64; 2]>,
    /// Unit of the value.
    pub unit: &'static str,
    /// Criterion of the claim.
    pub criterion: String,
    /// Reading of the paper and period.
    pub reading: &'static str,
    /// Whether the claim holds; `None` (JSON null) if on a part of the range only.
    pub holds: Option<bool>,
    /// Whether the claim holds for the drawn runs.
    pub holds_as_drawn: bool,
    /// Verdict in the catalogue.
    pub held_before: KnownVerdict,
    /// Reason for the verdict, or restriction of the claim.
    pub remark: &'static str,
}

impl ClaimRow {
    /// Returns whether a claim that held before no longer holds.
    pub fn is_regression(&self) -> bool {
        let KnownVerdict { as_drawn, everywhere } = self.held_before;
        (everywhere == Some(true) && self.holds != Some(true)) || (as_drawn && !self.holds_as_drawn)
    }
}

/// Reproduced figure with its claims.
pub struct Reproduction {
    /// Drawn figure.
    pub figure: Figure,
    /// Checked claims.
    pub claims: Vec<ClaimRow>,
}

impl PaperFigure {
    /// Returns the experiments of this figure with their labels, one per curve.
    ///
    /// # Errors
    /// If the scenario is invalid, which is a fault of this program; a test builds all of them.
    pub fn experiments(&self) -> Result<Vec<(&'static str, Experiment)>, ScenarioError> {
        let cases = self.cases.iter().map(|&(label, sets)| self.build(label, self.scenario, sets));
        cases.chain(self.baseline.map(|(label, file)| self.build(label, file, &[]))).collect()
    }

    /// Returns the experiments that are evaluated but not drawn.
    ///
    /// # Errors
    /// If a scenario is invalid, see [`experiments`](Self::experiments).
    pub fn further_experiments(&self) -> Result<Vec<(&'static str, Experiment)>, ScenarioError> {
        self.further.iter().map(|&(label, file, sets)| self.build(label, file, sets)).collect()
    }

    fn build(
        &self,
        label: &'static str,
        (file, text): (&'static str, &'static str),
        sets: &[&str],
    ) -> Result<(&'static str, Experiment), ScenarioError> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        Ok((label, scenario::parse(&Source { file, text, sets: &sets }, self.id)?))
    }

    /// Draws the figure and checks its claims. `cases` are the runs of [`experiments`](Self::experiments), then the
    /// runs of [`further_experiments`](Self::further_experiments), in order.
    pub fn judge(&self, title: &str, cases: &[Case]) -> Reproduction {
        let claims = self.claims.iter().map(|claim| self.judge_claim(claim, cases)).collect();
        let drawn = self.cases.len() + usize::from(self.baseline.is_some());
        Reproduction { figure: self.draw(title, &cases[..drawn.min(cases.len())]), claims }
    }

    fn judge_claim(&self, claim: &Claim, cases: &[Case]) -> ClaimRow {
        let values = match claim.reproduced {
            Merit::One(merit) => vec![merit(cases)],
            Merit::Range(merit) => merit(cases),
        };
        let range = matches!(claim.reproduced, Merit::Range(_)).then(|| {
            [values.iter().copied().fold(f64::NAN, f64::min), values.iter().copied().fold(f64::NAN, f64::max)]
        });
        ClaimRow {
            figure: self.id,
            claim: claim.text,
            published: claim.published,
            reproduced: values.first().copied().unwrap_or(f64::NAN),
            range,
            unit: claim.unit,
            criterion: claim.test.text(),
            reading: self.reading,
            holds: claim.test.verdict(&values),
            holds_as_drawn: values.first().is_some_and(|value| claim.test.passes(*value)),
            held_before: claim.held,
            remark: claim.remark,
        }
    }

    fn draw(&self, title: &str, cases: &[Case]) -> Figure {
        let mut panels: Vec<Panel> = Vec::new();
        let mut letters = 'a'..;
        let mut letter = String::new();
        for panel in self.panels {
            // Letters of the paper; a magnified part of the previous panel has its letter.
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
                    // Only the control is held from tick to tick.
                    is_held: panel.y_label.starts_with('u'),
                    ..Series::solid(label, c + q, shown.map(|row| (row.t_s, quantity(row))))
                };
                // An estimate lies on the estimated quantity: dashes keep both visible.
                series.push(if q > 0 { line.styled(Style::Dashed) } else { line });
            }
        }
        if self.baseline.is_some() {
            // The chattering curve is drawn first: on top it would hide the other curve.
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
            let further = figure.further_experiments().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(further.len(), figure.further.len());
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
        let row = |(holds_as_drawn, holds), (as_drawn, everywhere)| ClaimRow {
            figure: "fig01",
            claim: "",
            published: "",
            reproduced: 0.0,
            range: None,
            unit: "",
            criterion: String::new(),
            reading: "",
            holds,
            holds_as_drawn,
            held_before: KnownVerdict { as_drawn, everywhere },
            remark: "",
        };
        let [yes, no, open, open_not_drawn] = [(true, Some(true)), (false, Some(false)), (true, None), (false, None)];
        assert!(row(no, yes).is_regression() && row(open, yes).is_regression());
        assert!(row(open_not_drawn, open).is_regression() && !row(open, open).is_regression());
        assert!(!row(no, no).is_regression() && !row(no, open_not_drawn).is_regression());
        assert!(!row(yes, yes).is_regression());
    }

    #[test]
    fn a_claim_that_holds_on_a_part_of_the_range_only_is_open() {
        assert_eq!(Test::AtMost(1.0).verdict(&[0.5, 0.9]), Some(true));
        assert_eq!(Test::AtMost(1.0).verdict(&[0.5, 1.1]), None);
        assert_eq!(Test::AtMost(1.0).verdict(&[1.2, f64::NAN]), Some(false));
        assert_eq!(Test::AtMost(1.0).verdict(&[]), Some(false));
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
