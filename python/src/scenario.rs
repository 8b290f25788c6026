//! Text of a scenario with its settings, and the computations on it.

use std::sync::Arc;

use controller_core::error_dynamics::error_poles;
use loop_sim::trace::Ending;
use pyo3::prelude::*;
use scenario::{Experiment, Source};
use serde::Serialize;
use study::design::Design;
use study::figures::Figures;
use study::margins::{Loop, Matrices};

use crate::array;
use crate::controller::Controller;
use crate::error::{for_python, of_argument, of_scenario, of_study};
use crate::task;
use crate::trace::Run;

/// Text of a scenario and `KEY=VALUE` settings on top of it.
#[derive(Clone)]
pub(crate) struct Text {
    pub(crate) toml: String,
    /// Name of the file in messages and in exported files.
    pub(crate) file: String,
    /// Name of a scenario without the key `name`.
    pub(crate) name: String,
    pub(crate) sets: Vec<String>,
    /// True if lines and columns of the text mean something to the user.
    pub(crate) has_places: bool,
}

impl Text {
    pub(crate) fn source(&self) -> Source<'_> {
        Source { file: &self.file, text: &self.toml, sets: &self.sets }
    }

    pub(crate) fn experiment(&self) -> Result<Experiment, scenario::ScenarioError> {
        scenario::parse_own(&self.source(), &self.name)
    }

    pub(crate) fn told(&self, error: &scenario::ScenarioError) -> PyErr {
        of_scenario(error, self.has_places)
    }
}

/// Facts about a valid scenario.
#[derive(Serialize)]
struct Facts {
    name: String,
    title: String,
    headline: String,
    kind: &'static str,
    period_s: f64,
    span_s: f64,
    order: usize,
    design_hash: Option<String>,
}

impl Facts {
    fn of(experiment: &Experiment) -> Self {
        Self {
            name: experiment.name.clone(),
            title: experiment.title.clone(),
            headline: experiment.headline(),
            kind: experiment.drive.as_ref().map_or("chain", |drive| drive.designed.name()),
            period_s: experiment.period_s,
            span_s: experiment.span_s,
            order: experiment.plant.order(),
            design_hash: experiment.port.fingerprint().map(|hash| format!("{hash:08x}")),
        }
    }
}

/// Result of a design.
#[derive(Serialize)]
struct DesignJson {
    facts: Facts,
    design: Design,
    /// Keys of the scenario with the gains.
    gains: serde_json::Value,
    /// Bandwidths and their limiting factor, one line each.
    chosen: Vec<String>,
    /// Open and closed loop.
    matrices: [Matrices; 2],
    control_unit: &'static str,
    warnings: Vec<String>,
}

/// Returns the gains of a scenario by their keys.
fn gains(experiment: &Experiment) -> serde_json::Value {
    if let Some(drive) = &experiment.drive {
        return study::tune::settings(&drive.designed).into_iter().collect();
    }
    let Some(spec) = &experiment.spec else { return serde_json::Value::Null };
    let (n, config) = (spec.config.n, &spec.config.padded);
    let observers = (1..).zip(config.observers.iter().take(n)).filter_map(|(channel, gains)| {
        let poles: Vec<[f64; 2]> = error_poles(gains.as_ref()?).iter().map(|pole| [pole.re, pole.im]).collect();
        Some(serde_json::json!({ "channel": channel, "poles": poles }))
    });
    serde_json::json!({
        "c": config.surface.c[..n].to_vec(),
        "k_l": config.reaching.k_l,
        "k_s": config.reaching.k_s,
        "observer": observers.collect::<Vec<_>>(),
    })
}

/// Returns messages of the crates in terms of this package.
fn texts(texts: &[String]) -> Vec<String> {
    texts.iter().map(|text| for_python(text)).collect()
}

fn design_of(experiment: &Experiment) -> Result<String, study::Error> {
    let design = study::design(experiment)?;
    let at_rest = experiment.at_rest.as_ref()?;
    let json = DesignJson {
        facts: Facts::of(experiment),
        design,
        gains: gains(experiment),
        chosen: texts(experiment.drive.as_ref().map_or(&[][..], |drive| &drive.chosen)),
        matrices: Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s)?.matrices(),
        control_unit: experiment.control_unit,
        warnings: texts(&forms::warnings(experiment)),
    };
    json_of(&json)
}

/// Returns a struct as JSON.
pub(crate) fn json_of(value: &impl Serialize) -> Result<String, study::Error> {
    serde_json::to_string(value).map_err(|error| study::Error::failed(error.to_string()))
}

/// Either error of a computation on a scenario.
pub(crate) enum Failure {
    Scenario(scenario::ScenarioError),
    Study(study::Error),
}

impl From<scenario::ScenarioError> for Failure {
    fn from(error: scenario::ScenarioError) -> Self {
        Self::Scenario(error)
    }
}

impl From<study::Error> for Failure {
    fn from(error: study::Error) -> Self {
        Self::Study(error)
    }
}

/// A scenario: its text, its name, its settings.
#[pyclass(frozen, module = "edo_smc._edo_smc")]
pub(crate) struct Core {
    pub(crate) text: Arc<Text>,
    facts: String,
}

impl Core {
    /// Runs a computation on this scenario in a thread.
    pub(crate) fn computed<T: Send + 'static>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&Text, &task::Shared) -> Result<T, Failure> + Send + 'static,
    ) -> PyResult<T> {
        let text = self.text.clone();
        task::run(py, progress, move |shared| work(&text, shared))?.map_err(|failure| match failure {
            Failure::Scenario(error) => self.text.told(&error),
            Failure::Study(error) => of_study(&error),
        })
    }
}

#[pymethods]
impl Core {
    #[new]
    fn new(
        py: Python<'_>,
        text: String,
        file: String,
        name: String,
        sets: Vec<String>,
        has_places: bool,
    ) -> PyResult<Self> {
        let text = Arc::new(Text { toml: text, file, name, sets, has_places });
        let theirs = text.clone();
        let facts = task::run(py, None, move |_| theirs.experiment().map(|it| Facts::of(&it)))?;
        let facts = facts.map_err(|error| text.told(&error))?;
        Ok(Self { text, facts: json_of(&facts).map_err(|error| of_study(&error))? })
    }

    fn parts(&self) -> (String, String, String, Vec<String>, bool) {
        let Text { toml: text, file, name, sets, has_places } = self.text.as_ref().clone();
        (text, file, name, sets, has_places)
    }

    fn facts(&self) -> &str {
        &self.facts
    }

    /// Returns the warnings before a controller drives hardware.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.computed(py, None, |text, _| Ok(texts(&forms::warnings(&text.experiment()?))))
    }

    fn design(&self, py: Python<'_>) -> PyResult<String> {
        self.computed(py, None, |text, _| Ok(design_of(&text.experiment()?)?))
    }

    fn controller(&self, py: Python<'_>) -> PyResult<Controller> {
        let text = self.text.clone();
        task::run(py, None, move |_| Controller::of(text))?
    }

    fn simulate(&self, py: Python<'_>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<Run> {
        self.computed(py, progress, |text, shared| {
            let mut experiment = text.experiment()?;
            let (trace, error) = experiment.run(&mut |_| {
                shared.done();
                if shared.is_stopped() { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) }
            });
            let metrics = experiment.metrics(&trace);
            // A run that was stopped has no reader.
            let is_whole = !matches!(trace.ending, Ending::Interrupted { .. });
            let mut warnings = texts(&experiment.warnings);
            if is_whole {
                warnings.extend(texts(&study::margins::warnings(&experiment)));
            }
            let figures = is_whole.then(|| Figures::of(&mut experiment, &trace, &metrics));
            Ok(Run {
                states: experiment.drive.as_ref().map_or(&[][..], |drive| drive.states),
                units: [experiment.output_unit, experiment.control_unit],
                figures: json_of(&figures)?,
                error: error.map(|error| error.to_string()),
                title: experiment.title.clone(),
                warnings,
                window_s: experiment.window_s,
                trace,
            })
        })
    }

    /// Returns r, r', .. of the reference at the begin of every tick, shape (J, K).
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let jets = self.computed(py, None, |text, _| {
            let experiment = text.experiment()?;
            let drive = experiment.drive.as_ref().ok_or_else(|| study::Error::input("only a drive has a reference"))?;
            Ok(drive.designed.targets(&drive.motion, experiment.periods + 1))
        })?;
        let rows = jets.first().map_or(0, Vec::len);
        let jets = &jets;
        array::floats(py, (0..rows).flat_map(|j| jets.iter().map(move |jet| jet[j])), &[rows, jets.len()])
    }

    /// Returns the self-contained C file and the warnings of the design.
    fn c_text(&self, py: Python<'_>, prefix: String, paper: bool, no_limits: bool) -> PyResult<(String, Vec<String>)> {
        self.computed(py, None, move |text, _| {
            let experiment = text.experiment()?;
            may_be_exported(&experiment, paper, no_limits)?;
            let form = forms::Form::Standalone(&prefix);
            let file = forms::export(&experiment, &text.source(), form);
            Ok((file.map_err(|error| study::Error::input(error.to_string()))?, texts(&forms::warnings(&experiment))))
        })
    }
}

/// Refuses an unstable drive, a controller without limits of u, and a reading that is for the paper's figures only.
fn may_be_exported(experiment: &Experiment, paper: bool, no_limits: bool) -> Result<(), study::Error> {
    if let (Some(reading), false) = (experiment.figures_only, paper) {
        let cause = format!("{reading:?} only reproduces the paper's figures, its input gain is not physical");
        return Err(study::Error::input(cause).at("plant.reading").with_remedy("set plant.reading, or paper=True"));
    }
    if let Some(why) = study::design::refused_as_unstable(experiment) {
        return Err(study::Error::input(why));
    }
    match forms::without_limits(experiment).filter(|_| !(paper || no_limits)) {
        Some(why) => Err(study::Error::input(why).with_remedy("or give no_limits=True")),
        None => Ok(()),
    }
}

/// Returns a scenario text with these values, each in TOML. `None` removes a key.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "a list of Python arrives as a value")]
pub(crate) fn rewritten(text: &str, changes: Vec<(String, Option<String>)>) -> PyResult<String> {
    let all = changes.iter().map(|(key, value)| (key.as_str(), value.as_deref()));
    scenario::rewritten(text, all).map_err(|error| of_scenario(&error, true))
}

/// Returns the template of a plant with this name.
#[pyfunction]
pub(crate) fn template(name: &str, plant: &str) -> PyResult<String> {
    let plants: Vec<&str> = scenario::STARTS.iter().map(|(plant, _)| *plant).collect();
    let remedy = format!("the plants are {}; a name has letters, digits, `_`, `-`, `.`", plants.join(", "));
    scenario::template(name, plant).ok_or_else(|| of_argument("plant", &format!("{plant:?}, name {name:?}"), &remedy))
}

/// Returns the JSON schema of the scenarios of a plant.
#[pyfunction]
pub(crate) fn schema(plant: &str) -> String {
    scenario::schema(plant).to_string()
}
