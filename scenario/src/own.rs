//! Plant by its equations: parses the formulas of a file, and reports each error with its place.

use std::collections::BTreeMap;

use loop_sim::expression::{Expression, ExpressionError, Fault, functions};
use loop_sim::port::in_process::Model;

use super::error::{nearest, shown};
use super::resolve::{NominalChannel, Problem, Problems, missing, of_length, problem};
use super::{DriftKey, GainKey, NominalTable, PlantTable};

/// Names of the states.
const STATES: [&str; 6] = ["x1", "x2", "x3", "x4", "x5", "x6"];

/// Formulas of the true plant and of the controller's model.
#[derive(Clone, Debug)]
pub(super) struct Formulas {
    /// Rates x_1' .. x_n' as functions of x_1 .. x_n, u, t.
    pub(super) rates: Vec<Expression>,
    /// Drift a as a function of x_1 .. x_n.
    pub(super) drift: Expression,
    /// Input gain b as a function of x_1 .. x_n.
    pub(super) gain: Expression,
}

/// Parses every formula and reports all errors.
pub(super) fn plant(
    plant: &PlantTable,
    nominal: &NominalTable,
    problems: &mut Problems,
) -> Option<(Formulas, NominalChannel)> {
    let rates = plant.rates.as_ref()?;
    let states = &STATES[..rates.len()];
    constants(plant, nominal, problems);
    let inputs: Vec<&str> = states.iter().copied().chain(["u", "t"]).collect();
    let each = rates
        .iter()
        .enumerate()
        .map(|(i, text)| read(text, &format!("plant.rates[{}]", i + 1), &inputs, &plant.constants, problems));
    let each: Vec<Option<Expression>> = each.collect();

    let mut believed = plant.constants.clone();
    believed.extend(nominal.constants.clone());
    let drift = match &nominal.a {
        Some(DriftKey::Row(row)) => {
            problems.take(of_length(row, rates.len(), "controller.nominal.a")).map(|()| Expression::linear(row))
        }
        Some(DriftKey::Formula(text)) => read(text, "controller.nominal.a", states, &believed, problems),
        None => problems.take(missing(
            "controller.nominal.a",
            "the controller's model of x_n' without u, a formula of x1 .. xn or the coefficients of a linear model",
        )),
    };
    let gain = match &nominal.b {
        Some(GainKey::Number(b)) => Some(Expression::number(*b)),
        Some(GainKey::Formula(text)) => read(text, "controller.nominal.b", states, &believed, problems),
        None => problems.take(missing("controller.nominal.b", "the controller's model of the input gain")),
    };
    let (rates, drift, gain) = (each.into_iter().collect::<Option<Vec<_>>>()?, drift?, gain?);
    let known = known(nominal, &drift, &gain, states.len(), problems);
    Some((Formulas { rates, drift, gain }, known))
}

/// Returns the model for the design: b and the slopes of a at rest at 0.
fn known(
    nominal: &NominalTable,
    drift: &Expression,
    gain: &Expression,
    n: usize,
    problems: &mut Problems,
) -> NominalChannel {
    let rest = vec![0.0; n];
    let input_gain = gain.value(&rest);
    if input_gain == 0.0 || !input_gain.is_finite() {
        let found = shown(input_gain);
        let why =
            format!("found {found} at rest, expected an input gain other than 0: the law divides by it (Eq. (51))");
        problems.take::<()>(problem("controller.nominal.b", why));
    }
    let gradient: Vec<f64> = (0..n).map(|j| drift.slope(&rest, j)).collect();
    let value = drift.value(&rest);
    if !value.is_finite() || gradient.iter().any(|slope| !slope.is_finite()) {
        let slopes: Vec<String> = gradient.iter().map(|slope| shown(*slope)).collect();
        let why = format!(
            "the value at rest is {} and its slopes are [{}]: the design needs finite numbers there",
            shown(value),
            slopes.join(", ")
        );
        problems.take::<()>(problem("controller.nominal.a", why));
    }
    let model = match (&nominal.a, gain.varies()) {
        (Some(DriftKey::Row(row)), false) => Model::Linear(row.clone()),
        _ => Model::Formulas { drift: drift.clone(), gain: gain.clone() },
    };
    NominalChannel { model, gradient, input_gain }
}

/// Checks the names of constants, and that each constant of the model exists in the plant.
fn constants(plant: &PlantTable, nominal: &NominalTable, problems: &mut Problems) {
    let taken = || STATES.into_iter().chain(["u", "t", "pi"]).chain(functions());
    for name in plant.constants.keys() {
        let letters = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        let why = if taken().any(|other| other == name) {
            "the name is reserved: rename the constant"
        } else if !letters || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            "a name must consist of letters, digits and `_`, and not begin with a digit"
        } else {
            continue;
        };
        problems.take::<()>(problem("plant.constants", format!("`{name}`: {why}")));
    }
    for name in nominal.constants.keys().filter(|name| !plant.constants.contains_key(*name)) {
        let hint = nearest(name, plant.constants.keys().map(String::as_str));
        let key = format!("controller.nominal.constants.{name}");
        problems.take::<()>(problem(key, format!("there is no such constant in plant.constants{hint}")));
    }
}

fn read(
    text: &str,
    key: &str,
    inputs: &[&str],
    constants: &BTreeMap<String, f64>,
    problems: &mut Problems,
) -> Option<Expression> {
    let told = |error: &ExpressionError| {
        let hint = match &error.fault {
            Fault::UnknownName(name) => {
                let names = inputs.iter().copied().chain(constants.keys().map(String::as_str)).chain(["pi"]);
                nearest(name, names)
            }
            Fault::UnknownFunction(name) => nearest(name, functions()),
            _ => String::new(),
        };
        Problem { key: key.into(), message: format!("{error}{hint}") }
    };
    Expression::parse(text, inputs, constants).map_err(|errors| problems.0.extend(errors.iter().map(told))).ok()
}

#[cfg(test)]
mod tests;
