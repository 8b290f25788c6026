//! Varied parameters: keys of a scenario, each with a distribution.
//!
//! ```text
//! KEY=uniform(LOW,HIGH)  KEY=normal(MEAN,DEVIATION)  KEY=corners(LOW,HIGH)  KEY=list(A,B,..)  KEY=sobol(LOW,HIGH)
//! ```
//!
//! The suffix `x` multiplies a number by the value of the scenario: `uniform(0.5x,1.5x)` is ±50 %. A list may contain
//! words, or anything else that `--set` accepts; the draw is then a position in the list, from 1. Several keys,
//! separated by commas, share one draw. All draws are independent, except `sobol`, whose draws are the coordinates of
//! one evenly distributed sequence of points.

use loop_sim::philox;

use super::sobol::{DIMENSIONS, POINTS, Sobol};
use crate::Error;
use crate::map::{Subject, listed};

/// Keys that share a draw, and their distribution.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// Text of the option.
    pub text: String,
    /// Keys as in `--set`, with the unit of their values.
    keys: Vec<(String, f64)>,
    distribution: Distribution,
}

#[derive(Clone, Debug, PartialEq)]
enum Distribution {
    Uniform {
        low: f64,
        high: f64,
    },
    Normal {
        mean: f64,
        deviation: f64,
    },
    OneOf(Vec<f64>),
    /// Values as in `--set`.
    Words(Vec<String>),
    Sobol {
        low: f64,
        high: f64,
        sequence: Sobol,
    },
}

const FORM: &str = "expected KEY=uniform(LOW,HIGH), KEY=normal(MEAN,DEVIATION), KEY=corners(LOW,HIGH), \
                    KEY=list(A,B,..) or KEY=sobol(LOW,HIGH); the suffix x multiplies by the value of the file, and a \
                    list may contain words";
const NAMES: [&str; 5] = ["uniform", "normal", "corners", "list", "sobol"];

impl Vary {
    /// Parses a parameter. `dimension` is the next dimension of the Sobol sequence and is incremented if it is used.
    ///
    /// # Errors
    /// The text or a key of the scenario is invalid.
    pub fn parse(text: &str, subject: &Subject<'_>, dimension: &mut usize) -> Result<Self, Error> {
        let at = |error: Error| error.at(format!("--vary {text:?}"));
        let bad = |why: String| at(Error::input(why));
        let (keys, rest) = text.split_once('=').ok_or_else(|| bad(FORM.into()))?;
        let call = rest.trim().strip_suffix(')').and_then(|rest| rest.split_once('('));
        let (name, arguments) = call.ok_or_else(|| bad(FORM.into()))?;
        if let Some(words) = words(text) {
            let keys = keys.split(',').map(|key| (key.trim().to_owned(), 1.0)).collect();
            let vary = Self { text: text.to_owned(), keys, distribution: Distribution::Words(words) };
            vary.known(subject).and_then(|()| vary.tried(subject)).map_err(at)?;
            return Ok(vary);
        }
        let mut is_relative = None;
        let mut numbers = Vec::new();
        for word in arguments.split(',').map(str::trim) {
            let (number, relative) = word.strip_suffix('x').map_or((word, false), |number| (number.trim(), true));
            let number = number.parse::<f64>().ok().filter(|number| number.is_finite());
            numbers.push(number.ok_or_else(|| bad(format!("{word:?} is not a finite number; {FORM}")))?);
            if *is_relative.get_or_insert(relative) != relative {
                return Err(bad("the suffix x must be on all numbers or on none".into()));
            }
        }
        let pair = |what: &str| match numbers[..] {
            [a, b] => Ok([a, b]),
            _ => Err(bad(format!("{} takes two numbers, {what}", name.trim()))),
        };
        let range = |what: &str| {
            let [low, high] = pair(what)?;
            let is_range = low < high && (high - low).is_finite();
            if is_range { Ok([low, high]) } else { Err(bad("the second number must be above the first".into())) }
        };
        let distribution = match name.trim() {
            "uniform" => range("LOW and HIGH").map(|[low, high]| Distribution::Uniform { low, high })?,
            "corners" => range("LOW and HIGH").map(|ends| Distribution::OneOf(ends.into()))?,
            "list" => Distribution::OneOf(numbers.clone()),
            "normal" => match pair("MEAN and DEVIATION")? {
                [mean, deviation] if deviation > 0.0 => Distribution::Normal { mean, deviation },
                _ => return Err(bad("a standard deviation must be above 0".into())),
            },
            "sobol" => {
                let [low, high] = range("LOW and HIGH")?;
                let sequence = Sobol::new(*dimension)
                    .ok_or_else(|| bad(format!("at most {DIMENSIONS} parameters can use sobol")))?;
                *dimension += 1;
                Distribution::Sobol { low, high, sequence }
            }
            other => {
                let nearest = NAMES.iter().min_by_key(|name| strsim::damerau_levenshtein(name, other));
                let nearest = nearest.copied().unwrap_or_default();
                return Err(bad(format!("unknown distribution {other:?}; did you mean {nearest}?")));
            }
        };
        let mut vary = Self { text: text.to_owned(), keys: Vec::new(), distribution };
        for key in keys.split(',').map(str::trim) {
            let unit = if is_relative == Some(true) {
                let own = subject.number_at(key);
                // For an unknown key the error names the nearest one.
                let unknown = || subject.with(&[format!("{key}=1")]).err().map(|error| error.to_string());
                let none = || format!("{} has no number at {key}: omit the x", subject.file);
                own.ok_or_else(|| bad(unknown().unwrap_or_else(none)))?
            } else {
                1.0
            };
            vary.keys.push((key.to_owned(), unit));
        }
        vary.known(subject).and_then(|()| vary.tried(subject)).map_err(at)?;
        Ok(vary)
    }

    /// Checks that a constant occurs in a formula; otherwise it has no effect.
    fn known(&self, subject: &Subject<'_>) -> Result<(), Error> {
        const CONSTANTS: &str = "plant.constants.";
        let is_unknown = |key: &&str| key.starts_with(CONSTANTS) && subject.number_at(key).is_none();
        let unknown = self.keys().find(is_unknown);
        unknown.map_or(Ok(()), |key| Err(Error::input(format!("{} has no {key} to vary", subject.file))))
    }

    /// Checks that the scenario accepts at least one value. Other refused values become outcomes of trials.
    fn tried(&self, subject: &Subject<'_>) -> Result<(), Error> {
        let some = match &self.distribution {
            Distribution::Uniform { low, high } | Distribution::Sobol { low, high, .. } => {
                // A part of the range may be valid, so several values are tried.
                let between = (0..=16).map(|k| low + f64::from(k) / 16.0 * (high - low));
                vec![0.5 * (low + high), *low, *high].into_iter().chain(between).collect()
            }
            Distribution::Normal { mean, deviation } => vec![*mean, mean - deviation, mean + deviation],
            Distribution::OneOf(all) => all.clone(),
            // Every word of a list must be valid.
            Distribution::Words(words) => {
                return (1..=words.len()).try_for_each(|k| {
                    let sets: Vec<String> = self.settings(k as f64).collect();
                    subject.with(&sets).map(drop).map_err(Error::from)
                });
            }
        };
        let (mut first, tried) = (None, some.len());
        for value in some {
            let sets: Vec<String> = self.settings(value).collect();
            match subject.with(&sets) {
                Ok(_) => return Ok(()),
                Err(error) => _ = first.get_or_insert(error.to_string()),
            }
        }
        let first = first.unwrap_or_default();
        Err(Error::input(format!("the scenario refused all {tried} values that were tried; one of them: {first}")))
    }

    /// Returns the draw of a trial for the parameter with this number.
    pub fn draw(&self, seed: u64, trial: u64, parameter: u32) -> f64 {
        let words = philox::draw(seed, trial, parameter);
        match &self.distribution {
            Distribution::Uniform { low, high } => low + (high - low) * philox::uniform(words[0]),
            Distribution::Normal { mean, deviation } => mean + deviation * philox::gaussians(words)[0],
            Distribution::OneOf(all) => all[(philox::uniform(words[0]) * all.len() as f64) as usize],
            Distribution::Words(all) => 1.0 + (philox::uniform(words[0]) * all.len() as f64).floor(),
            Distribution::Sobol { low, high, sequence } => low + (high - low) * sequence.at(trial % POINTS),
        }
    }

    /// Returns the first key, the name of the column.
    pub fn name(&self) -> &str {
        self.keys.first().map_or("", |(key, _)| key)
    }

    /// Returns all keys.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.keys.iter().map(|(key, _)| key.as_str())
    }

    /// Returns the value of the first key for a draw.
    pub fn value(&self, draw: f64) -> f64 {
        self.keys.first().map_or(draw, |(_, unit)| unit * draw)
    }

    /// Returns the settings `KEY=VALUE` of all keys for a draw, with enough digits to be exact.
    pub fn settings(&self, draw: f64) -> impl Iterator<Item = String> {
        // A value from a list may belong to an integer key.
        let may_be_whole = matches!(self.distribution, Distribution::OneOf(_));
        self.keys.iter().map(move |(key, unit)| {
            let value = unit * draw;
            if let Distribution::Words(words) = &self.distribution {
                return format!("{key}={}", words[value as usize - 1]);
            }
            let is_whole = may_be_whole && value == value.trunc() && value.abs() < 1e15;
            if is_whole { format!("{key}={value:.0}") } else { format!("{key}={value:?}") }
        })
    }
}

/// Returns whether the parameter follows a sequence instead of random draws.
pub fn is_sobol(text: &str) -> bool {
    let name = text.split_once('=').and_then(|(_, call)| call.split_once('('));
    name.is_some_and(|(name, _)| name.trim() == "sobol")
}

/// Returns the words of `KEY=list(A,B,..)` if not all of them are numbers. The column then contains the position of a
/// word, from 1.
pub fn words(text: &str) -> Option<Vec<String>> {
    let (_, call) = text.split_once('=')?;
    let (name, rest) = call.trim().split_once('(')?;
    let words = listed(rest.strip_suffix(')')?);
    let is_number = |word: &String| word.strip_suffix('x').unwrap_or(word).trim().parse::<f64>().is_ok();
    let is_of_words =
        name.trim() == "list" && words.iter().all(|word| !word.is_empty()) && !words.iter().all(is_number);
    is_of_words.then_some(words)
}

#[cfg(test)]
mod tests {
    #[test]
    fn points_of_a_sequence_are_told_from_words_about_them() {
        let of = ["k=sobol(1,2)", " k , l = sobol (1,2) ", "k=uniform(1,2)", "title=list(\"sobol(a\",b)", "k"];
        assert_eq!(of.map(super::is_sobol), [true, true, false, false, false]);
    }
}
