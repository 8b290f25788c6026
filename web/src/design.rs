//! Facts, margins and poles of a design.

use scenario::Experiment;
use serde_json::{Value, json};
use study::Error;
use study::gain_sets::gain_sets;
use study::margins::Loop;

/// Returns facts about a valid scenario.
pub(crate) fn facts(experiment: &Experiment) -> Value {
    let drive = experiment.drive.as_ref();
    let shafts: Vec<Value> = drive
        .iter()
        .flat_map(|drive| &drive.shafts)
        .map(|it| json!({ "name": it.name, "channel": it.channel, "inertia_kg_m2": it.inertia_kg_m2 }))
        .collect();
    json!({
        "name": experiment.name,
        "title": experiment.title,
        "headline": experiment.headline(),
        "kind": drive.map_or("chain", |drive| drive.designed.name()),
        "is_coupled": drive.is_some_and(|drive| drive.designed.is_whole()),
        "period_s": experiment.period_s,
        "max_current_a": drive.map(|drive| drive.max_current_a),
        "torque_n_m_per_a": drive.map(|drive| drive.designed.torque_n_m_per_a()),
        "move_s": drive.map(|drive| f64::from(drive.motion.ticks) * experiment.period_s),
        "encoder_unit_rad": drive.and_then(|drive| drive.designed.encoders().first().map(|it| it.1.encoder.unit_rad())),
        "shafts": shafts,
        "warnings": experiment.warnings,
        "chosen": drive.map_or(&[][..], |drive| &drive.chosen),
        "design_hash": experiment.port.fingerprint().map(|hash| format!("{hash:08x}")),
    })
}

/// Returns the margins of each gain set without its corners, which take longer, the poles and the gains.
pub(crate) fn margins(experiment: &mut Experiment) -> Result<Value, Error> {
    let at_rest = experiment.at_rest.as_mut().map_err(|error| Error::from(&*error))?;
    at_rest.corners.clear();
    let it = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s)?;
    let values = it.eigenvalues()?;
    let in_z: Vec<[f64; 2]> = values.iter().map(|z| [z.re, z.im]).collect();
    let poles: Vec<[f64; 2]> = values.into_iter().map(|z| it.pole(z)).map(|pole| [pole.re, pole.im]).collect();
    let Some(drive) = &experiment.drive else {
        return Err(Error::input("the page is for a motor or a joint: the file has neither [motor] nor [joint]"));
    };
    let gains: serde_json::Map<String, Value> = study::tune::settings(&drive.designed)
        .into_iter()
        .map(|(key, numbers)| (key.into(), if let [number] = numbers[..] { json!(number) } else { json!(numbers) }))
        .collect();
    Ok(json!({
        "gain_sets": gain_sets(&drive.designed, at_rest)?,
        "poles_z": in_z,
        "poles": poles,
        "gains": gains,
        "left_out": at_rest.left_out,
    }))
}
