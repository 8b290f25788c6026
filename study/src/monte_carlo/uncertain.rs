//! Option `--uncertain PERCENT`: every plant parameter deviates by up to this percentage, while the model of the
//! controller stays as in the file ([`MayBeOff`]).

use crate::Error;
use crate::map::{Deviation, MayBeOff, Subject, Uncertain};
use crate::number::typed;

/// Parameters that vary, and additional settings.
pub struct OfPlant {
    /// Distribution `KEY=DISTRIBUTION` of each parameter, as in [`Vary::parse`](super::vary::Vary::parse).
    pub vary: Vec<String>,
    /// Settings `KEY=VALUE` of all trials.
    pub sets: Vec<String>,
}

/// Parses `50`, `50:corners` or `50:sobol`.
///
/// # Errors
/// The text is invalid, or the plant has no uncertain parameters.
pub fn of_plant(subject: &Subject<'_>, text: &str) -> Result<OfPlant, Error> {
    let wrong = |what: &str| Error::input(what).at(format!("--uncertain {text}"));
    let (percent, name) = text.split_once(':').unwrap_or((text, "uniform"));
    let percent = percent.trim().parse().ok().filter(|percent: &f64| *percent > 0.0 && *percent < 100.0);
    let percent = percent.ok_or_else(|| wrong("expected a number above 0 and below 100"))?;
    if !["uniform", "corners", "sobol"].contains(&name) {
        return Err(wrong("expected PERCENT, PERCENT:corners or PERCENT:sobol"));
    }
    let MayBeOff { numbers, believed } = MayBeOff::of(subject)?;
    if numbers.is_empty() {
        let what = format!("{} has no uncertain parameters: give --vary", subject.file);
        return Err(Error::input(what).at("--uncertain"));
    }
    let vary = numbers.iter().map(|Uncertain { keys, deviation, .. }| {
        let (first, keys) = (keys.first(), keys.join(","));
        match deviation {
            Deviation::Error(unit) => {
                // In addition to the error of the file or of `--set`, as in the corners of `map`.
                let own = first.and_then(|key| subject.number_at(key)).unwrap_or(0.0) / unit;
                let off = percent * (1.0 + 0.01 * own);
                let [low, high] = [own - off, own + off].map(|end| typed(end * unit, 15));
                format!("{keys}={name}({low},{high})")
            }
            Deviation::Number(_) => {
                let [low, high] = [-percent, percent].map(|percent| typed(1.0 + 0.01 * percent, 15));
                format!("{keys}={name}({low}x,{high}x)")
            }
        }
    });
    Ok(OfPlant { vary: vary.collect(), sets: believed })
}
