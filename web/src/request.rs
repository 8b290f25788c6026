//! Requests of the page, the text of a scenario, and errors.

use scenario::{Experiment, KnownRule, ScenarioError, Source};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::run::{Ran, RunRequest};
use crate::{bits, design, rivals, run};

/// Text of a scenario and `KEY=VALUE` settings on top of it.
#[derive(Clone, Deserialize)]
pub(crate) struct Text {
    pub(crate) toml: String,
    /// Name of the scenario and, with `.toml`, of its file in messages and exported files.
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) sets: Vec<String>,
    /// Gains of a joint that another thread has found for this scenario.
    #[serde(default)]
    pub(crate) rule: Option<KnownRule>,
}

impl Text {
    pub(crate) fn file(&self) -> String {
        format!("{}.toml", self.name)
    }

    /// Parses the scenario with additional settings.
    pub(crate) fn with(&self, more: &[String]) -> Result<Experiment, ScenarioError> {
        if let Some(rule) = &self.rule {
            rule.clone().remember();
        }
        let sets = [&self.sets[..], more].concat();
        scenario::parse_own(&Source { file: &self.file(), text: &self.toml, sets: &sets }, &self.name)
    }

    pub(crate) fn experiment(&self) -> Result<Experiment, ScenarioError> {
        self.with(&[])
    }
}

/// Request of the page.
#[derive(Deserialize)]
#[serde(tag = "call", rename_all = "snake_case")]
enum Request {
    /// Templates and the schemas of motor and joint.
    Start,
    /// Numbers at keys, with the defaults of the schema.
    Numbers { scenario: Text, keys: Vec<String> },
    /// Margins, poles and gains of the design.
    Margins { scenario: Text },
    /// A run.
    Run { scenario: Text, run: RunRequest },
    /// Whole design: limits, noise, suggestion.
    Design { scenario: Text },
    /// Text with other values.
    Rewritten { text: String, changes: Vec<(String, Option<String>)> },
    /// Self-contained C file.
    ExportC { scenario: Text },
    /// Tuned controllers on equal runs.
    Rivals { scenario: Text, evaluations: usize },
    /// Hashes over every bit of the results of some scenarios.
    Bits,
}

/// Error as the page shows it.
#[derive(Serialize)]
struct Told {
    key: String,
    cause: String,
    remedy: String,
    text: String,
}

/// Errors of a request without a result.
#[derive(Serialize)]
pub(crate) struct Failure {
    error: Vec<Told>,
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        let told = |parts: scenario::ErrorParts<'_>| Told {
            key: parts.key.into(),
            cause: parts.cause.into(),
            remedy: parts.remedy.into(),
            text: parts.message.into(),
        };
        Self { error: error.parts().map(told).collect() }
    }
}

impl From<study::Error> for Failure {
    fn from(error: study::Error) -> Self {
        let text = error.to_string();
        Self { error: vec![Told { key: error.key, cause: error.what, remedy: error.remedy, text }] }
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Self {
        study::Error::failed(error.to_string()).into()
    }
}

/// Answers a request in JSON.
pub(crate) fn answer(request: &str) -> String {
    let answered = serde_json::from_str(request).map_err(Failure::from).and_then(|request| of(&request));
    // Strings, numbers and maps with text keys have a JSON form.
    answered.unwrap_or_else(|failure| serde_json::to_string(&failure).unwrap_or_default())
}

#[derive(Serialize)]
struct OfRun {
    run: Ran,
}

fn of(request: &Request) -> Result<String, Failure> {
    let answer: Result<Value, Failure> = match request {
        Request::Start => Ok(start()),
        Request::Numbers { scenario, keys } => numbers(scenario, keys),
        Request::Margins { scenario } => {
            let mut experiment = scenario.experiment()?;
            let design = design::margins(&mut experiment)?;
            let is_by_rule = experiment.drive.as_ref().is_some_and(|drive| drive.joint_rule.is_some());
            let rule = is_by_rule.then(KnownRule::last);
            Ok(json!({ "facts": design::facts(&experiment), "design": design, "rule": rule }))
        }
        // Thousands of numbers: they become text without a tree of values between.
        Request::Run { scenario, run } => {
            return Ok(serde_json::to_string(&OfRun { run: run::run(scenario, run)? })?);
        }
        Request::Design { scenario } => {
            let experiment = scenario.experiment()?;
            Ok(json!({ "design": study::design(&experiment)?, "warnings": forms::warnings(&experiment) }))
        }
        Request::Rewritten { text, changes } => {
            let all = changes.iter().map(|(key, value)| (key.as_str(), value.as_deref()));
            Ok(json!({ "text": scenario::rewritten(text, all)? }))
        }
        Request::ExportC { scenario } => {
            let (text, warnings) = c_file(scenario)?;
            Ok(json!({ "text": text, "warnings": warnings }))
        }
        Request::Rivals { scenario, evaluations } => rivals::rivals(scenario, *evaluations),
        Request::Bits => Ok(json!({ "bits": bits::hashes() })),
    };
    Ok(answer?.to_string())
}

fn start() -> Value {
    let templates = scenario::STARTS.iter().filter(|(plant, _)| ["motor", "joint"].contains(plant));
    let templates: Vec<Value> = templates
        .map(|(plant, text)| json!({ "plant": plant, "text": text, "schema": scenario::schema(plant) }))
        .collect();
    json!({ "templates": templates, "version": env!("CARGO_PKG_VERSION") })
}

fn numbers(text: &Text, keys: &[String]) -> Result<Value, Failure> {
    let file = text.file();
    let source = Source { file: &file, text: &text.toml, sets: &text.sets };
    let number = |key: &String| Ok((key.clone(), json!(scenario::number_at(&source, key)?)));
    Ok(Value::Object(keys.iter().map(number).collect::<Result<_, Failure>>()?))
}

/// Returns the self-contained C file as `host-sim export --standalone` writes it, and the warnings of the design.
pub(crate) fn c_file(text: &Text) -> Result<(String, Vec<String>), Failure> {
    let experiment = text.experiment()?;
    if let Some(why) = study::design::refused_as_unstable(&experiment) {
        return Err(study::Error::input(why).into());
    }
    if let Some(why) = forms::without_limits(&experiment) {
        return Err(study::Error::input(why).into());
    }
    let file = text.file();
    let source = Source { file: &file, text: &text.toml, sets: &text.sets };
    let exported = forms::export(&experiment, &source, forms::Form::Standalone(forms::PREFIX));
    Ok((exported.map_err(|why| study::Error::input(why.to_string()))?, forms::warnings(&experiment)))
}
