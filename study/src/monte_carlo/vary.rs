//! What differs from trial to trial: keys of a scenario, each with a distribution.
//!
//! ```text
//! KEY=uniform(LOW,HIGH)  KEY=normal(MEAN,DEVIATION)  KEY=corners(LOW,HIGH)  KEY=list(A,B,..)  KEY=sobol(LOW,HIGH)
//! ```
//!
//! A number with an `x` behind it is times what the scenario has itself: `uniform(0.5x,1.5x)` is ±50 %. A list may be
//! of words, or of anything else that `--set` takes: what is drawn then is a position in it, from 1. Several keys with
//! commas between share one draw. Every draw is independent of all others, but for those of `sobol`, which are the
//! coordinates of one sequence of points that fill their box evenly.

use loop_sim::philox;

use super::sobol::{DIMENSIONS, POINTS, Sobol};
use crate::Error;
use crate::map::{Subject, listed};

/// Keys that share a draw, and how they are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// As it was written.
    pub text: String,
    /// As in `--set`, with what each value is in units of.
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
    /// As `--set` takes them.
    Words(Vec<String>),
    Sobol {
        low: f64,
        high: f64,
        sequence: Sobol,
    },
}

const FORM: &str = "expected KEY=uniform(LOW,HIGH), KEY=normal(MEAN,DEVIATION), KEY=corners(LOW,HIGH), \
                    KEY=list(A,B,..) or KEY=sobol(LOW,HIGH); an x behind a number is times the file's own, and a list \
                    may be of words";
const NAMES: [&str; 5] = ["uniform", "normal", "corners", "list", "sobol"];

impl Vary {
    /// One of them; `dimension` is the next of the Sobol sequence, and goes on if this takes it.
    ///
    /// # Errors
    /// What is wrong with the text, or with a key of the scenario.
    pub fn parse(text: &str, subject: &Subject<'_>, dimension: &mut usize) -> Result<Self, Error> {
        let bad = |why: String| Error::input(why).at(format!("--vary {text:?}"));
        let (keys, rest) = text.split_once('=').ok_or_else(|| bad(FORM.into()))?;
        let call = rest.trim().strip_suffix(')').and_then(|rest| rest.split_once('('));
        let (name, arguments) = call.ok_or_else(|| bad(FORM.into()))?;
        if let Some(words) = words(text) {
            let keys = keys.split(',').map(|key| (key.trim().to_owned(), 1.0)).collect();
            let vary = Self { text: text.to_owned(), keys, distribution: Distribution::Words(words) };
            vary.known(subject).and_then(|()| vary.tried(subject)).map_err(bad)?;
            return Ok(vary);
        }
        let mut is_relative = None;
        let mut numbers = Vec::new();
        for word in arguments.split(',').map(str::trim) {
            let (number, relative) = word.strip_suffix('x').map_or((word, false), |number| (number.trim(), true));
            let number = number.parse::<f64>().ok().filter(|number| number.is_finite());
            numbers.push(number.ok_or_else(|| bad(format!("{word:?} is no finite number; {FORM}")))?);
            if *is_relative.get_or_insert(relative) != relative {
                return Err(bad("either all of its numbers are times the file's own (x), or none".into()));
            }
        }
        let pair = |what: &str| match numbers[..] {
            [a, b] => Ok([a, b]),
            _ => Err(bad(format!("{} has two numbers, {what}", name.trim()))),
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
                _ => return Err(bad("a standard deviation is above 0".into())),
            },
            "sobol" => {
                let [low, high] = range("LOW and HIGH")?;
                let sequence = Sobol::new(*dimension)
                    .ok_or_else(|| bad(format!("a Sobol sequence has at most {DIMENSIONS} dimensions here")))?;
                *dimension += 1;
                Distribution::Sobol { low, high, sequence }
            }
            other => {
                let nearest = NAMES.iter().min_by_key(|name| strsim::damerau_levenshtein(name, other));
                let nearest = nearest.copied().unwrap_or_default();
                return Err(bad(format!("there is no distribution {other:?}; did you mean {nearest}?")));
            }
        };
        let mut vary = Self { text: text.to_owned(), keys: Vec::new(), distribution };
        for key in keys.split(',').map(str::trim) {
            let unit = if is_relative == Some(true) {
                let own = subject.number_at(key);
                // A key that there is not is told with the nearest one.
                let unknown = || subject.with(&[format!("{key}=1")]).err().map(|error| error.to_string());
                let none = || format!("{} has no number at {key}: leave the x away", subject.file);
                own.ok_or_else(|| bad(unknown().unwrap_or_else(none)))?
            } else {
                1.0
            };
            vary.keys.push((key.to_owned(), unit));
        }
        vary.known(subject).and_then(|()| vary.tried(subject)).map_err(bad)?;
        Ok(vary)
    }

    /// A constant that no formula has would vary nothing.
    fn known(&self, subject: &Subject<'_>) -> Result<(), String> {
        const CONSTANTS: &str = "plant.constants.";
        let is_unknown = |key: &&str| key.starts_with(CONSTANTS) && subject.number_at(key).is_none();
        let unknown = self.keys().find(is_unknown);
        unknown.map_or(Ok(()), |key| Err(format!("{} has no {key} to vary", subject.file)))
    }

    /// Does the scenario take some value of it? What it refuses of the others is for the trials to tell.
    fn tried(&self, subject: &Subject<'_>) -> Result<(), String> {
        let some = match &self.distribution {
            Distribution::Uniform { low, high } | Distribution::Sobol { low, high, .. } => {
                // Some of a range may be sound, wherever.
                let between = (0..=16).map(|k| low + f64::from(k) / 16.0 * (high - low));
                vec![0.5 * (low + high), *low, *high].into_iter().chain(between).collect()
            }
            Distribution::Normal { mean, deviation } => vec![*mean, mean - deviation, mean + deviation],
            Distribution::OneOf(all) => all.clone(),
            // Each was meant as it was typed.
            Distribution::Words(words) => {
                return (1..=words.len()).try_for_each(|k| {
                    let sets: Vec<String> = self.settings(k as f64).collect();
                    subject.with(&sets).map(drop).map_err(|error| error.to_string())
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
        Err(format!("the scenario takes none of {tried} of its values that were tried; of one of them: {first}"))
    }

    /// The draw of a trial, for the parameter of this number.
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

    /// The first of its keys: the name of its column.
    pub fn name(&self) -> &str {
        self.keys.first().map_or("", |(key, _)| key)
    }

    /// All of its keys.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.keys.iter().map(|(key, _)| key.as_str())
    }

    /// What the first key is set to for a draw.
    pub fn value(&self, draw: f64) -> f64 {
        self.keys.first().map_or(draw, |(_, unit)| unit * draw)
    }

    /// `KEY=VALUE` of each of its keys for a draw, in as many digits as make the very number.
    pub fn settings(&self, draw: f64) -> impl Iterator<Item = String> {
        // What is chosen from a few may be for a key that takes whole numbers only.
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

/// Does it go through the points of a sequence, and not draw?
pub fn is_sobol(text: &str) -> bool {
    let name = text.split_once('=').and_then(|(_, call)| call.split_once('('));
    name.is_some_and(|(name, _)| name.trim() == "sobol")
}

/// The words of `KEY=list(A,B,..)`, if not all of them are numbers: what its column says is the position of one, from
/// 1.
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
