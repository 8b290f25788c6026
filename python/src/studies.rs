//! Studies of a scenario that take seconds: comparison, tuning, maps, trials, identification.

use loop_sim::port::drive::Follows;
use loop_sim::sensor::encoder::Mounted;
use pyo3::prelude::*;
use serde_json::json;
use study::Error;
use study::commission::{Retuned, sheet_of};
use study::compare::{Bench, Settings, contenders};
use study::identify::{PlantData, record};
use study::map::{MapRequest, Question, Subject};
use study::monte_carlo::{Columns, Outcome, Plan, trial, trials, uncertain};
use study::tune::{Effort, Limits, Specification};

use crate::array;
use crate::scenario::{Core, Failure, Text, json_of};

/// Error of a computation that was stopped. It has no reader.
fn stopped() -> Failure {
    Failure::Study(Error::failed("stopped on request"))
}

impl Text {
    fn subject<'a>(&'a self, sets: &'a [String]) -> Subject<'a> {
        Subject { file: &self.file, text: &self.toml, name: &self.name, sets }
    }

    fn bench(&self) -> Result<Bench, Failure> {
        // An error of the scenario itself has its key.
        self.experiment()?;
        Ok(Bench::new(&self.file, &self.toml, &self.sets)?)
    }
}

/// Names of the columns, outcome of each trial, numbers (columns, trials), and facts as JSON.
type Trials<'py> = (Vec<String>, Vec<&'static str>, Bound<'py, PyAny>, String);

#[pyfunction]
pub(crate) fn compare(
    core: &Bound<'_, Core>,
    evaluations: usize,
    seed: u64,
    noise_a: Vec<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    core.get().computed(core.py(), progress, move |text, shared| {
        if let Some(limit) = noise_a.iter().find(|limit| !(**limit > 0.0 && limit.is_finite())) {
            return Err(Error::input(format!("{limit}: expected a number above 0")).at("noise_a").into());
        }
        let bench = text.bench()?;
        let noise_a = if noise_a.is_empty() { bench.noise_limits_a().to_vec() } else { noise_a };
        let settings = Settings { evaluations, seed, noise_a };
        let contenders = contenders(&bench);
        let found = shared.watched(|watch| study::compare::compare(&bench, &contenders, &settings, watch));
        Ok(json_of(&found.ok_or_else(stopped)?)?)
    })
}

/// Returns the number of controllers and of noise limits of a comparison.
#[pyfunction]
pub(crate) fn compared(core: &Bound<'_, Core>) -> PyResult<(usize, usize)> {
    core.get().computed(core.py(), None, |text, _| {
        let bench = text.bench()?;
        Ok((contenders(&bench).len(), bench.noise_limits_a().len()))
    })
}

/// Returns the answer as JSON, and the tuned scenario.
#[pyfunction]
pub(crate) fn tune(
    core: &Bound<'_, Core>,
    limits: [Option<f64>; 6],
    is_wide: Option<bool>,
    effort: (usize, u64, Option<u32>),
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String)> {
    core.get().computed(core.py(), progress, move |text, shared| {
        let bench = text.bench()?;
        let [noise_a, settle_s, move_rad, load_rad, phase_deg, sensitivity_peak] = limits;
        let limits = Limits { noise_a, settle_s, move_rad, load_rad, phase_deg, sensitivity_peak, is_wide };
        let specification = Specification::new(&bench, &limits)?;
        let (evaluations, seed, most_cycles) = effort;
        let effort = Effort { evaluations, seed, most_cycles };
        let subject = text.subject(&text.sets);
        let found = shared.watched(|watch| study::tune(&bench, &subject, &specification, effort, watch));
        let answer = found?.ok_or_else(stopped)?;
        Ok((json_of(&answer)?, answer.text))
    })
}

/// Returns the map as JSON, with what its JSON leaves out.
#[pyfunction]
pub(crate) fn map(
    core: &Bound<'_, Core>,
    words: [Option<String>; 4],
    numbers: [Option<f64>; 3],
    simulate: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    core.get().computed(core.py(), progress, move |text, shared| {
        let [x, y, preset, figure] = words.each_ref().map(Option::as_deref);
        let [corners, at_most, at_least] = numbers;
        let request = MapRequest { x, y, preset, corners, figure, at_most, at_least, simulate };
        let question = Question::new(text.subject(&text.sets), &request)?;
        let found = shared.watched(|watch| study::map(&question, watch));
        let map = found?.ok_or_else(stopped)?;
        let beside = json!({ "map": map, "good": map.good, "frame": map.frame, "own": map.own });
        Ok(beside.to_string())
    })
}

/// Returns the names of the columns, the outcome of each trial, the numbers (columns, trials), and facts as JSON.
#[pyfunction]
pub(crate) fn monte_carlo<'py>(
    core: &Bound<'py, Core>,
    mut vary: Vec<String>,
    uncertain_percent: Option<String>,
    number: u64,
    seed: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Trials<'py>> {
    let (columns, rows) = core.get().computed(core.py(), progress, move |text, shared| {
        let bare = text.subject(&text.sets);
        let mut experiment = text.experiment()?;
        let mut sets = text.sets.clone();
        if let Some(percent) = &uncertain_percent {
            let of_plant = uncertain::of_plant(&bare, percent)?;
            vary.splice(0..0, of_plant.vary);
            sets.extend(of_plant.sets);
        }
        let plan = Plan::new(Subject { sets: &sets, ..bare }, &vary, seed)?;
        if vary.is_empty() {
            return Err(Error::input("no parameter to vary: give uncertain_percent or vary").into());
        }
        let of_file = shared.watched(|watch| trial(&mut experiment, watch)).ok_or_else(stopped)?;
        let columns = Columns::new(&plan, &experiment, &of_file);
        let rows = shared.watched(|watch| trials(&plan, &columns, 0..number, watch)).ok_or_else(stopped)?;
        Ok((columns, rows))
    })?;
    let shape = [columns.names.len(), rows.len()];
    let found = &rows;
    let numbers = (0..shape[0]).flat_map(|j| found.iter().map(move |(_, row)| row[j]));
    let numbers = array::floats(core.py(), numbers, &shape)?;
    let outcomes = rows.iter().map(|(outcome, _)| Outcome::word(*outcome)).collect();
    let facts = json!({ "units": columns.units, "of_file": columns.of_file }).to_string();
    Ok((columns.names, outcomes, numbers, facts))
}

/// Returns the identified parameters as JSON, and the scenario with them.
#[pyfunction]
pub(crate) fn identify(
    core: &Bound<'_, Core>,
    csv: String,
    file: String,
    cogging_per_turn: Option<f64>,
    limits: [f64; 2],
    motor_alone: bool,
) -> PyResult<(String, String)> {
    core.get().computed(core.py(), None, move |text, _| {
        let experiment = text.experiment()?;
        let drive = experiment.drive.as_ref().ok_or_else(|| Error::input("only a drive can be identified"))?;
        let designed = drive.designed;
        if designed.form().follows == Follows::Speed {
            return Err(Error::input("identification needs drive.mode = \"position\"").at("drive.mode").into());
        }
        let mut mounted: Vec<Mounted> = designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        let kind = match (mounted.len(), motor_alone) {
            (1, false) => record::RecordingKind::Motor,
            (1, true) => return Err(Error::input("is for a joint: a motor has one encoder").at("motor_alone").into()),
            (_, true) => record::RecordingKind::JointAlone,
            (_, false) => record::RecordingKind::Joint,
        };
        let known = PlantData::of(&text.source(), drive, cogging_per_turn, limits);
        if motor_alone {
            mounted.remove(0);
        }
        let misread = |it: record::Misread| {
            Failure::Study(Error::input(it.message).at(format!("{file}:{}:{}", it.line, it.column)))
        };
        let record = record::read(&csv, experiment.period_s, kind, &mounted).map_err(misread)?;
        let old = sheet_of(&designed);
        let found =
            study::identify(&record, &old, &known).map_err(|refusal| Error::failed(format!("{file}: {refusal}")))?;
        let retuned = Retuned::of(&text.source(), &old, &found)
            .and_then(|it| it.taken_over_by(&designed, &text.file))
            .map_err(|error| Error::failed(error.to_string()))?;
        Ok((json_of(&found)?, retuned.text))
    })
}
