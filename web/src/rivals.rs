//! Other controllers on equal runs, each tuned with equal effort.

use serde_json::{Value, json};
use study::Watch;
use study::compare::{Bench, Contender, Entry, Settings, compare, contenders, of_ours};

use crate::request::{Failure, Text};

/// Beginnings of the names of the controllers that the page shows.
const SHOWN: [&str; 2] = ["P-PI", "LQG"];

/// Tunes the other controllers at the current noise of this design, and returns the figures and the course of a move
/// with a load step for each of them and for this design.
pub(crate) fn rivals(text: &Text, evaluations: usize) -> Result<Value, Failure> {
    // An error of the scenario itself has its key.
    text.experiment()?;
    let bench = Bench::new(&text.file(), &text.toml, &text.sets)?;
    let ours = of_ours(&bench.designed).ok_or_else(|| study::Error::failed("the design is not valid"))?;
    let limit_a = bench.noise_a(&ours);
    if !(limit_a > 0.0 && limit_a.is_finite()) {
        return Err(study::Error::failed("the sine run of this design fails: there is no noise to compare at").into());
    }
    let shown: Vec<Box<dyn Contender>> =
        contenders(&bench).into_iter().filter(|it| SHOWN.iter().any(|name| it.name().starts_with(name))).collect();
    let settings = Settings { evaluations, seed: 0, noise_a: vec![limit_a] };
    let found = compare(&bench, &shown, &settings, Watch::none());
    let entries = found.map_or_else(Vec::new, |found| found.entries);
    let mut laws = vec![json!({
        "law": "edo-smc, this page",
        "figures": bench.figures(&ours),
        "course": course(&bench.shown(&ours)),
    })];
    for entry in &entries {
        laws.extend(of_entry(&bench, &shown, entry));
    }
    Ok(json!({
        "limit_a": limit_a, "tau_s": bench.tau_s, "corners": bench.corners(), "start_rad": bench.start_rad,
        "evaluations": evaluations, "laws": laws,
    }))
}

/// Returns a tuned controller; `None` if it has no design.
fn of_entry(bench: &Bench, shown: &[Box<dyn Contender>], entry: &Entry) -> Option<Value> {
    let contender = shown.iter().find(|it| it.name() == entry.law)?;
    let knobs: Vec<f64> = entry.knobs.iter().map(|(_, value)| *value).collect();
    let design = contender.design(&knobs)?;
    Some(json!({
        "law": entry.law,
        "figures": entry.figures,
        "is_too_noisy": entry.breaks_limit(),
        "knobs": entry.knobs,
        "course": course(&bench.shown(design.as_ref())),
    }))
}

/// Returns time, error and current as three columns in f32.
fn course(ticks: &[[f64; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|j| ticks.iter().map(|tick| tick[j] as f32).collect())
}
