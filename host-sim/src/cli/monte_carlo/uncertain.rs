//! `--uncertain PERCENT`: every number of the plant off by up to so much, while the controller believes those of the
//! file.
//!
//! A drive and the paper's joint have a table of errors for that. Of a plant by its equations the constants are drawn,
//! of a chain its coefficients, and what the controller believes of them is held where the file has it.

use toml_edit::{DocumentMut, Item};

use crate::map::{Subject, uncertain};
use crate::report::number::typed;

/// What varies, and what is set beside it.
pub(super) struct OfPlant {
    pub(super) vary: Vec<String>,
    pub(super) sets: Vec<String>,
}

/// Of `50`, `50:corners` or `50:sobol`.
pub(super) fn of_plant(subject: &Subject<'_>, text: &str) -> Result<OfPlant, String> {
    let (percent, name) = text.split_once(':').unwrap_or((text, "uniform"));
    let percent = percent.trim().parse().ok().filter(|percent: &f64| *percent > 0.0 && *percent < 100.0);
    let percent = percent.ok_or_else(|| format!("--uncertain {text}: expected a number above 0 and below 100"))?;
    if !["uniform", "corners", "sobol"].contains(&name) {
        return Err(format!("--uncertain {text}: expected PERCENT, PERCENT:corners or PERCENT:sobol"));
    }
    if let Some(table) = uncertain(subject) {
        let vary = table.iter().map(|(_, keys, unit)| {
            let off = typed(percent * unit, 15);
            format!("{}={name}(-{off},{off})", keys.join(","))
        });
        return Ok(OfPlant { vary: vary.collect(), sets: Vec::new() });
    }
    let relative =
        |key: &str| format!("{key}={name}({}x,{}x)", typed(1.0 - 0.01 * percent, 15), typed(1.0 + 0.01 * percent, 15));
    // Read before: it is TOML.
    let file: DocumentMut = subject.text.parse().map_err(|error| format!("{}: {error}", subject.file))?;
    let number = |key: &str| subject.number_at(key).filter(|value| *value != 0.0);
    let mut of = OfPlant { vary: Vec::new(), sets: Vec::new() };
    let constants = file.get("plant").and_then(|plant| plant.get("constants")).and_then(Item::as_table_like);
    for (name, _) in constants.into_iter().flat_map(|table| table.iter()) {
        let (key, believed) = (format!("plant.constants.{name}"), format!("controller.nominal.constants.{name}"));
        let Some(value) = number(&key) else { continue };
        of.vary.push(relative(&key));
        if subject.number_at(&believed).is_none() {
            of.sets.push(format!("{believed}={value:?}"));
        }
    }
    let row: Vec<String> = (1..=loop_sim::MAX_ORDER).map(|j| format!("plant.a[{j}]")).collect();
    let row: Vec<&String> = row.iter().filter(|key| subject.number_at(key).is_some()).collect();
    if !row.is_empty() {
        of.vary.extend(row.iter().filter(|key| number(key).is_some()).map(|key| relative(key)));
        if subject.number_at("controller.nominal.a[1]").is_none() {
            let values: Vec<String> =
                row.iter().map(|key| format!("{:?}", subject.number_at(key).unwrap_or_default())).collect();
            of.sets.push(format!("controller.nominal.a=[{}]", values.join(", ")));
        }
    }
    if let Some(b) = number("plant.b") {
        of.vary.push(relative("plant.b"));
        if subject.number_at("controller.nominal.b").is_none() {
            of.sets.push(format!("controller.nominal.b={b:?}"));
        }
    }
    if of.vary.is_empty() {
        return Err(format!(
            "--uncertain: {} has no number of a plant that is known to vary: give --vary",
            subject.file
        ));
    }
    Ok(of)
}
