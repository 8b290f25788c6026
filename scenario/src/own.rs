//! A plant by its equations: formulas of a file to formulas that can be computed, each mistake with its place.

use std::collections::BTreeMap;

use loop_sim::expression::{Expression, ExpressionError, Fault, functions};
use loop_sim::port::in_process::Model;

use super::error::{nearest, shown};
use super::resolve::{NominalChannel, Problem, Problems, missing, of_length, problem};
use super::{DriftKey, GainKey, NominalTable, PlantTable};

/// The states by their names.
const STATES: [&str; 6] = ["x1", "x2", "x3", "x4", "x5", "x6"];

/// What is true, and what the controller believes.
#[derive(Clone, Debug)]
pub(super) struct Formulas {
    /// x_1' .. x_n' of x_1 .. x_n, u, t.
    pub(super) rates: Vec<Expression>,
    /// a of x_1 .. x_n.
    pub(super) drift: Expression,
    /// b of x_1 .. x_n.
    pub(super) gain: Expression,
}

/// Reads every formula, to the last one.
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
            "what the controller believes of x_n' without u, a formula of x1 .. xn or the coefficients of a linear one",
        )),
    };
    let gain = match &nominal.b {
        Some(GainKey::Number(b)) => Some(Expression::number(*b)),
        Some(GainKey::Formula(text)) => read(text, "controller.nominal.b", states, &believed, problems),
        None => problems.take(missing("controller.nominal.b", "what the controller believes of the input gain")),
    };
    let (rates, drift, gain) = (each.into_iter().collect::<Option<Vec<_>>>()?, drift?, gain?);
    let known = known(nominal, &drift, &gain, states.len(), problems);
    Some((Formulas { rates, drift, gain }, known))
}

/// What the design knows: b and the slopes of a where the controller is to hold the plant, at rest at 0.
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
            "it is {} at rest, its slopes [{}]: the design needs finite ones there",
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

/// Names that a formula could not tell from others, and beliefs about what there is not.
fn constants(plant: &PlantTable, nominal: &NominalTable, problems: &mut Problems) {
    let taken = || STATES.into_iter().chain(["u", "t", "pi"]).chain(functions());
    for name in plant.constants.keys() {
        let letters = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        let why = if taken().any(|other| other == name) {
            "the name is taken: give the constant another"
        } else if !letters || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            "a name in a formula is made of letters, digits and `_`, a letter first"
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
