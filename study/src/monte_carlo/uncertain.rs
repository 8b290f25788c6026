//! `--uncertain PERCENT`: every number of the plant off by up to so much, while the controller believes those of the
//! file ([`MayBeOff`]).

use crate::Error;
use crate::map::{MayBeOff, Subject, Told, Uncertain};
use crate::number::typed;

/// What varies, and what is set beside it.
pub struct OfPlant {
    /// `KEY=DISTRIBUTION` of each number, as in [`Vary::parse`](super::vary::Vary::parse).
    pub vary: Vec<String>,
    /// `KEY=VALUE` for all trials.
    pub sets: Vec<String>,
}

/// Reads `50`, `50:corners` or `50:sobol`.
///
/// # Errors
/// The text is something else, or the plant has no such numbers.
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
        let what = format!("{} has no number of a plant that is known to vary: give --vary", subject.file);
        return Err(Error::input(what).at("--uncertain"));
    }
    let vary = numbers.iter().map(|Uncertain { keys, told, .. }| {
        let (first, keys) = (keys.first(), keys.join(","));
        match told {
            Told::Error(unit) => {
                // On top of what the file, or who asks, says that it is off, as the corners of `map` are.
                let own = first.and_then(|key| subject.number_at(key)).unwrap_or(0.0) / unit;
                let off = percent * (1.0 + 0.01 * own);
                let [low, high] = [own - off, own + off].map(|end| typed(end * unit, 15));
                format!("{keys}={name}({low},{high})")
            }
            Told::Number(_) => {
                let [low, high] = [-percent, percent].map(|percent| typed(1.0 + 0.01 * percent, 15));
                format!("{keys}={name}({low}x,{high}x)")
            }
        }
    });
    Ok(OfPlant { vary: vary.collect(), sets: believed })
}
