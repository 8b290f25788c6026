//! Maps: two keys of a scenario swept over a grid, at each point the loop judged, by its exact matrices.
//!
//! A point is the scenario with two values set. With `z` the eigenvalues of one tick of plant, law and delays at rest
//! ([`margins`]), the loop is stable where max |z| < 1, and decays with -ln|z|/T of the slowest pole but
//! the offset's own. With corners, a point is as good as its worst corner: every number of the plant that may be off is
//! off by so many percent, in all 2^p ways. What a user may promise is the largest rectangle of points that all are
//! good, around the point that the file has itself.
//!
//! [`grows`] asks the same of the plant as it is, not linear, and of the tick itself, by simulation: an independent
//! way, for whoever does not trust matrices. A loop near its boundary takes long to show which it is, so the two may
//! differ where |max |z| - 1| is below a thousandth, and nowhere else.
//!
//! Cost: about a millisecond per point and corner; the simulation of one takes a tenth of a second.

use std::collections::VecDeque;

use loop_sim::linear::Ticked;
use loop_sim::port::drive::DriveDesign;
use loop_sim::solver::{self, SolverError};
use rayon::prelude::*;
use scenario::{AtRest, Experiment, ScenarioError, Source};
use serde::Serialize;
use toml_edit::{DocumentMut, Item, TomlError};

use crate::figures::number_of;
use crate::margins::{self, Loop};
use crate::number::typed;
use crate::{Error, Watch};

mod answer;
mod asked;

pub use answer::{Map, Promise, Simulated, map};
pub use asked::{Asked, CORNERS, presets};

/// Points along an axis if none are asked for, and the most.
const POINTS: usize = 32;
const MOST_POINTS: usize = 400;
/// How an axis is written.
const FORM: &str = "expected KEY=FROM..TO, KEY=FROM..TO:log:40 or KEY=A,B,C";
/// Values between two ends have so many digits, so that they can be read and typed.
const DIGITS: usize = 5;

/// A key and what it is set to, one after the other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// The key, as in `--set`.
    pub key: String,
    /// The values, as in `--set`.
    pub values: Vec<String>,
    /// The same as numbers, growing; none of a list.
    #[serde(skip)]
    pub numbers: Option<Vec<f64>>,
    /// Do they grow by a factor instead of a difference?
    #[serde(skip)]
    pub is_log: bool,
    /// What is set for each value where that is not the key; the file itself is at 0 then.
    #[serde(skip)]
    settings: Option<Vec<Vec<String>>>,
}

impl Axis {
    /// `KEY=FROM..TO`, then `:log` and `:POINTS` as wished; or `KEY=A,B,C`.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::input(what).at(format!("{text:?}"));
        let (key, range) = text.split_once('=').ok_or_else(|| wrong(FORM.into()))?;
        let (key, range) = (key.trim().to_owned(), range.trim());
        if key.is_empty() {
            return Err(wrong(FORM.into()));
        }
        let Some((from, rest)) = range.split_once("..") else {
            return Self::of_values(key, range).map_err(|error| Error { key: format!("{text:?}"), ..error });
        };
        let mut words = rest.split(':');
        let (mut is_log, mut points) = (false, POINTS);
        let number = |word: &str| {
            let number = word.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| wrong(format!("{word:?} is no finite number")).with_remedy(FORM))
        };
        let (from, to) = (number(from)?, number(words.next().unwrap_or_default())?);
        for word in words {
            match (word, word.parse::<usize>()) {
                ("log", _) => is_log = true,
                (_, Ok(count @ 2..=MOST_POINTS)) => points = count,
                (_, Ok(_)) => return Err(wrong(format!("an axis has 2 to {MOST_POINTS} points"))),
                _ => return Err(wrong(format!("{word:?} is neither `log` nor a number of points")).with_remedy(FORM)),
            }
        }
        if from >= to {
            return Err(wrong("the second end must be above the first".into()));
        }
        if !(to - from).is_finite() || (is_log && from > 0.0 && !(to / from).is_finite()) {
            return Err(wrong("the ends are too far apart for f64".into()));
        }
        if is_log && from <= 0.0 {
            return Err(wrong("a logarithmic axis begins above 0".into()));
        }
        let value = |k: usize| {
            let share = k as f64 / (points - 1) as f64;
            let exact = if is_log { from * libm::pow(to / from, share) } else { from + share * (to - from) };
            // An end is what was typed.
            if k == 0 {
                from
            } else if k + 1 == points {
                to
            } else {
                exact
            }
        };
        let values: Vec<String> = (0..points).map(|k| typed(value(k), DIGITS)).collect();
        let numbers: Vec<f64> = values.iter().filter_map(|value| value.parse().ok()).collect();
        if numbers.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(wrong(format!("{points} points are not told apart by {DIGITS} digits")));
        }
        Ok(Self { key, values, numbers: Some(numbers), is_log, settings: None })
    }

    /// `A,B,C`.
    fn of_values(key: String, range: &str) -> Result<Self, Error> {
        let values = listed(range);
        if let Some(twice) = (1..values.len()).find(|k| values[..*k].contains(&values[*k])) {
            return Err(Error::input(format!("{} is there twice", values[twice])));
        }
        match values.len() {
            0..=MOST_POINTS if values.iter().all(|value| !value.is_empty()) => {
                Ok(Self { key, values, numbers: None, is_log: false, settings: None })
            }
            0..=MOST_POINTS => Err(Error::input("a value is empty").with_remedy(FORM)),
            many => Err(Error::input(format!("{many} values; at most {MOST_POINTS}"))),
        }
    }

    /// The nearest point to a value; none beyond the ends.
    pub fn at(&self, value: f64) -> Option<usize> {
        let numbers = self.numbers.as_ref()?;
        let (first, last) = (numbers.first()?, numbers.last()?);
        let away = |k: &usize| (numbers[*k] - value).abs();
        (first..=last).contains(&&value).then(|| (0..numbers.len()).min_by(|i, j| away(i).total_cmp(&away(j))))?
    }

    /// `KEY=VALUE` of a point.
    pub fn sets(&self, k: usize) -> Vec<String> {
        let as_it_stands = || vec![format!("{}={}", self.key, self.values[k])];
        self.settings.as_ref().map_or_else(as_it_stands, |settings| settings[k].clone())
    }

    /// Is this key set by it?
    fn sweeps(&self, key: &str) -> bool {
        self.sets(0).iter().any(|set| set.split('=').next() == Some(key))
    }

    /// The number that the file itself has, by the file.
    pub fn own_number(&self, subject: &Subject<'_>) -> Option<f64> {
        if self.settings.is_some() { Some(0.0) } else { subject.number_at(&self.key) }
    }

    /// Of a chain or of equations the relative error of the input gain, b over what the controller believes of it less
    /// 1: a chain says its b; of equations what is believed is scaled. None of any other plant.
    pub fn of_input_gain(subject: &Subject<'_>, range: &str) -> Option<Self> {
        let mut axis = Self::parse(&format!("relative error of b={range}")).ok()?;
        let chain = subject.number_at("plant.b");
        let formula = subject.text_at("controller.nominal.b");
        let number = subject.number_at("controller.nominal.b");
        let set = |error: &f64| {
            let times = 1.0 + error;
            match (chain, &formula, number) {
                (Some(b), ..) => {
                    let truth = format!("plant.b={}", typed(b * times, 15));
                    Some(believed_gain(subject).into_iter().chain([truth]).collect())
                }
                (None, Some(formula), _) => Some(vec![format!("controller.nominal.b=\"({formula})/{times:?}\"")]),
                (None, None, Some(b)) => Some(vec![format!("controller.nominal.b={}", typed(b / times, 15))]),
                (None, None, None) => None,
            }
        };
        axis.settings = Some(axis.numbers.as_ref()?.iter().map(set).collect::<Option<_>>()?);
        Some(axis)
    }
}

/// At the commas that are not within brackets.
pub(crate) fn listed(text: &str) -> Vec<String> {
    let mut depth = 0_usize;
    let parts = text.split(|c: char| {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        c == ',' && depth == 0
    });
    parts.map(|part| part.trim().to_owned()).collect()
}

/// A number of a plant that may be off.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// What it is called.
    pub name: String,
    /// What is set for it, all alike.
    pub keys: Vec<String>,
    /// How the file tells that it is off.
    pub told: Told,
}

/// How a file tells that a number is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Told {
    /// By a key of its own; so much of it is one percent.
    Error(f64),
    /// By the number itself, which is this in the file.
    Number(f64),
}

/// What of a plant may be off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MayBeOff {
    /// Its numbers.
    pub numbers: Vec<Uncertain>,
    /// What is set beside them, so that the controller believes what it does in the file.
    pub believed: Vec<String>,
}

/// Names, keys and what one percent of each is.
type Errors = [(&'static str, &'static [&'static str], f64)];

/// Those of the kinds of scenario with a table of errors: the first whose keys a scenario takes is its own.
const ERRORS: [&Errors; 3] = [
    &[
        ("J_l", &["error.link_inertia_percent"], 1.0),
        ("J_m", &["error.motor_inertia_percent"], 1.0),
        ("K", &["error.stiffness_percent"], 1.0),
        ("K_t", &["error.torque_percent"], 1.0),
        ("weight", &["error.weight_percent"], 1.0),
    ],
    &[
        ("J", &["error.inertia_percent"], 1.0),
        ("K_t", &["error.torque_percent"], 1.0),
        ("damping", &["error.damping_percent"], 1.0),
    ],
    &[
        ("k_1", &["plant.error.k1", "plant.error.k1_x3"], 0.01),
        ("b_1", &["plant.error.b1"], 0.01),
        ("k_2", &["plant.error.k2_x1", "plant.error.k2_x3"], 0.01),
        ("b_2", &["plant.error.b2"], 0.01),
        ("b", &["plant.error.b"], 0.01),
    ],
];

impl MayBeOff {
    /// Of a drive and the paper's joint all that their tables of errors have; of a plant by its equations the
    /// constants, of a chain the coefficients, as far as they are not 0. Nothing of any other.
    ///
    /// # Errors
    /// The file is not TOML.
    pub fn of(subject: &Subject<'_>) -> Result<Self, Error> {
        let takes = |errors: &&&Errors| errors[0].1.iter().all(|key| subject.with(&[format!("{key}=0.01")]).is_ok());
        if let Some(errors) = ERRORS.iter().find(takes) {
            let numbers = errors.iter().map(|(name, keys, percent)| Uncertain {
                name: (*name).into(),
                keys: keys.iter().map(ToString::to_string).collect(),
                told: Told::Error(*percent),
            });
            return Ok(Self { numbers: numbers.collect(), believed: Vec::new() });
        }
        let mut of = Self::default();
        let mut add = |name: String, key: String| {
            if let Some(value) = subject.number_at(&key).filter(|value| *value != 0.0) {
                of.numbers.push(Uncertain { name, keys: vec![key], told: Told::Number(value) });
            }
        };
        // Read before: it is TOML.
        let file: DocumentMut =
            subject.text.parse().map_err(|error: TomlError| Error::input(error.to_string()).at(subject.file))?;
        let constants = file.get("plant").and_then(|plant| plant.get("constants")).and_then(Item::as_table_like);
        let names: Vec<String> = constants.into_iter().flat_map(|it| it.iter()).map(|(name, _)| name.into()).collect();
        for name in &names {
            add(name.clone(), format!("plant.constants.{name}"));
        }
        let row: Vec<String> = (1..=loop_sim::MAX_ORDER).map(|j| format!("plant.a[{j}]")).collect();
        for (j, key) in (1..).zip(&row) {
            add(format!("a_{j}"), key.clone());
        }
        add("b".into(), "plant.b".into());

        for name in &names {
            let believed = format!("controller.nominal.constants.{name}");
            let value = subject.number_at(&format!("plant.constants.{name}")).filter(|value| *value != 0.0);
            if let Some(value) = value.filter(|_| subject.number_at(&believed).is_none()) {
                of.believed.push(format!("{believed}={value:?}"));
            }
        }
        let row: Vec<f64> = row.iter().filter_map(|key| subject.number_at(key)).collect();
        if !row.is_empty() && subject.number_at("controller.nominal.a[1]").is_none() {
            of.believed.push(format!("controller.nominal.a={row:?}"));
        }
        of.believed.extend(believed_gain(subject));
        Ok(of)
    }
}

/// What holds the gain that the controller of a chain believes, where the file says nothing of it.
fn believed_gain(subject: &Subject<'_>) -> Option<String> {
    let b = subject.number_at("plant.b").filter(|b| *b != 0.0)?;
    subject.number_at("controller.nominal.b").is_none().then(|| format!("controller.nominal.b={b:?}"))
}

/// A way in which the plant may be off.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Corner {
    /// `J +50 %, K_t -50 %`.
    pub name: String,
    /// The settings that make it so.
    pub sets: Vec<String>,
}

/// More numbers make more corners than anyone waits for.
const MOST_UNCERTAIN: usize = 12;

/// The corners of a scenario with all that may be off so many percent off, but for what is swept anyway.
///
/// # Errors
/// The scenario's own mistakes; or none of its numbers can be said to be off, or too many.
pub fn corners(subject: &Subject<'_>, percent: f64, axes: &[Axis]) -> Result<Vec<Corner>, Error> {
    subject.with(&[])?;
    let MayBeOff { numbers, believed } = MayBeOff::of(subject)?;
    let is_swept = |keys: &[String]| keys.iter().any(|key| axes.iter().any(|axis| axis.sweeps(key)));
    let is_none = numbers.is_empty();
    let numbers: Vec<Uncertain> = numbers.into_iter().filter(|it| !is_swept(&it.keys)).collect();
    if is_none {
        let what = "no number of its plant is known to be off: corners are for scenarios with [joint], [motor], a \
                    flexible joint, a chain, or equations with constants as [plant]";
        return Err(Error::input(what).at(subject.file));
    }
    if numbers.len() > MOST_UNCERTAIN {
        let names: Vec<&str> = numbers.iter().map(|it| it.name.as_str()).collect();
        let (count, names) = (names.len(), names.join(", "));
        let what = format!(
            "{count} numbers of its plant may be off, {names}: that is 2^{count} corners, and 2^{MOST_UNCERTAIN} are \
             the most"
        );
        let remedy = format!("`host-sim monte-carlo --uncertain {percent}` draws from all of them");
        return Err(Error::input(what).at(subject.file).with_remedy(remedy));
    }
    let corner = |corner: usize| {
        let mut sets = believed.clone();
        let name = numbers.iter().enumerate().map(|(i, Uncertain { name, keys, told })| {
            let percent = if corner >> i & 1 == 1 { percent } else { -percent };
            let value = |key: &String| match told {
                // On top of what the file, or who asks, says that it is off.
                Told::Error(unit) => {
                    let own = subject.number_at(key).unwrap_or(0.0) / unit;
                    typed((own + percent * (1.0 + 0.01 * own)) * unit, DIGITS)
                }
                Told::Number(own) => typed(own * (1.0 + 0.01 * percent), 15),
            };
            sets.extend(keys.iter().map(|key| format!("{key}={}", value(key))));
            format!("{name} {percent:+} %")
        });
        let name = name.collect::<Vec<_>>().join(", ");
        Corner { name, sets }
    };
    Ok((0..1_usize << numbers.len()).map(corner).collect())
}

/// Up to how many whole percent, `most` at most, every number of the plant may be off with the loop stable in all
/// corners.
///
/// # Errors
/// Those of [`corners`]; or the loop has no matrices.
pub fn tolerance_percent(subject: &Subject<'_>, most: u32) -> Result<u32, Error> {
    for percent in 1..=most {
        for Corner { sets, .. } in corners(subject, f64::from(percent), &[])? {
            let experiment = subject.with(&sets)?;
            if poles(&experiment)?.0 >= 1.0 {
                return Ok(percent - 1);
            }
        }
    }
    Ok(most)
}

/// The scenario that is swept.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// What messages call its file.
    pub file: &'a str,
    /// The content of the file.
    pub text: &'a str,
    /// Its name if it gives none.
    pub name: &'a str,
    /// `KEY=VALUE`, before those of the point.
    pub sets: &'a [String],
}

impl Subject<'_> {
    /// With these settings on top.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn with(&self, more: &[String]) -> Result<Experiment, ScenarioError> {
        let sets = [self.sets, more].concat();
        scenario::parse_own(&Source { file: self.file, text: self.text, sets: &sets }, self.name)
    }

    /// The number at a key without more settings, if it is one.
    pub fn number_at(&self, key: &str) -> Option<f64> {
        scenario::number_at(&self.source(), key).ok()?
    }

    /// The text there, if it is one.
    fn text_at(&self, key: &str) -> Option<String> {
        scenario::text_at(&self.source(), key).ok()?
    }

    const fn source(&self) -> Source<'_> {
        Source { file: self.file, text: self.text, sets: self.sets }
    }
}

/// A grid to be judged, point by point; [`Question::new`] makes one of what is [`Asked`].
pub struct Question<'a> {
    /// The scenario.
    pub subject: Subject<'a>,
    /// `KEY=VALUE` that a preset sets at every point.
    pub held: Vec<String>,
    /// Along the first axis, then the second; one axis for a line, none for the corners one by one.
    pub axes: Vec<Axis>,
    /// A point is as good as the worst of these; none: only as the scenario says.
    pub corners: Vec<Corner>,
    /// How far off the corners are, percent.
    pub percent: Option<f64>,
    /// Path of a number of run.json beside decay and radius.
    pub figure: Option<String>,
    /// A point is good only where the figure is at most this.
    pub at_most: Option<f64>,
    /// A point is good only where the figure is at least this; the least over the corners is the worst then.
    pub at_least: Option<f64>,
    /// Is every point simulated too?
    pub simulate: bool,
    /// Name of the scenario.
    scenario: String,
    /// The drive of the file, if it is one.
    designed: Option<DriveDesign>,
}

/// A point of the grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Largest |z|, of the worst corner: below 1 is stable.
    pub spectral_radius: f64,
    /// -ln|z|/T of the slowest pole but the offset's own, 1/s; negative for a loop that grows.
    pub decay_per_s: f64,
    /// The figure that was asked for, at its worst over the corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<f64>,
    /// The corner of the largest |z|.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<String>,
    /// How many corners are unstable.
    #[serde(skip_serializing_if = "is_zero")]
    pub unstable_corners: usize,
    /// Did it grow when it was simulated, in the worst corner?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grew: Option<bool>,
}

/// Leaves a count of 0 out of the JSON.
pub const fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Point {
    /// Do all poles decay?
    pub const fn is_stable(&self) -> bool {
        self.spectral_radius < 1.0
    }
}

/// A point, or why there is none: no design with these values.
pub type Judged = Result<Point, Error>;

impl Question<'_> {
    /// Points along both axes.
    pub fn size(&self) -> [usize; 2] {
        [0, 1].map(|i| self.axes.get(i).map_or(1, |axis| axis.values.len()))
    }

    /// The scenario with what a preset sets, and these on top.
    fn experiment(&self, more: &[String]) -> Result<Experiment, ScenarioError> {
        let sets: Vec<String> = self.held.iter().chain(more).cloned().collect();
        self.subject.with(&sets)
    }

    /// The point in this column and row, at its worst over these corners.
    fn judged(&self, place: [usize; 2], corners: &[Corner]) -> Judged {
        let here: Vec<String> = self.axes.iter().zip(place).flat_map(|(axis, k)| axis.sets(k)).collect();
        let as_it_is = [Corner { name: String::new(), sets: Vec::new() }];
        let is_plain = corners.is_empty();
        let corners = if is_plain { &as_it_is[..] } else { corners };
        let mut worst: Option<(Point, &Corner)> = None;
        let (mut figure, mut unstable) = (None::<f64>, 0);
        for corner in corners {
            let mut experiment = self.experiment(&[&here[..], &corner.sets].concat())?;
            let (spectral_radius, decay_per_s) = poles(&experiment)?;
            unstable += usize::from(spectral_radius >= 1.0);
            if let Some(path) = &self.figure {
                let value = number_of(path, &mut experiment)?;
                let is_worse = |known: f64| if self.at_least.is_some() { value < known } else { value > known };
                figure = figure.filter(|known| known.is_nan() || !(value.is_nan() || is_worse(*known))).or(Some(value));
            }
            if worst.as_ref().is_none_or(|(worst, _)| spectral_radius > worst.spectral_radius) {
                let point =
                    Point { spectral_radius, decay_per_s, figure: None, worst: None, unstable_corners: 0, grew: None };
                worst = Some((point, corner));
            }
        }
        let (mut point, corner) = worst.ok_or_else(|| Error::input("no corner"))?;
        point.figure = figure;
        if !is_plain {
            (point.worst, point.unstable_corners) = (Some(corner.name.clone()), unstable);
        }
        if self.simulate {
            let experiment = self.experiment(&[&here[..], &corner.sets].concat())?;
            let grew = grows(experiment.at_rest.as_ref()?, experiment.period_s);
            point.grew = Some(grew.map_err(|error| Error::failed(error.to_string()))?);
        }
        Ok(point)
    }

    /// Judges each corner by itself; `None` if it was stopped. A step of the watch is a corner.
    fn each_corner(&self, watch: Watch<'_>) -> Option<Vec<Judged>> {
        let judged = |corner: &Corner| {
            if watch.is_stopped() {
                return None;
            }
            let judged = self.judged([0, 0], std::slice::from_ref(corner));
            watch.done();
            Some(judged)
        };
        self.corners.par_iter().map(judged).collect()
    }

    /// Judges all points, row by row from the first; `None` if it was stopped. A step of the watch is a point.
    pub fn answer(&self, watch: Watch<'_>) -> Option<Vec<Judged>> {
        let [columns, rows] = self.size();
        let judged = |k: usize| {
            if watch.is_stopped() {
                return None;
            }
            let judged = self.judged([k % columns, k / columns], &self.corners);
            watch.done();
            Some(judged)
        };
        (0..columns * rows).into_par_iter().map(judged).collect()
    }
}

/// Largest |z| and the slowest decay of a scenario's loop.
fn poles(experiment: &Experiment) -> Result<(f64, f64), Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    let found = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s).and_then(|it| {
        let alpha_per_s = margins::offset_per_s(experiment);
        let values = it.eigenvalues()?;
        let radius = values.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        Ok((radius, margins::decay_per_s(&it.poles_beside(values, alpha_per_s))))
    });
    Ok(found?)
}

/// How far from rest a simulation begins, rad or unit of the first state, or how many steps of its encoders if that is
/// more; and how many times as far nobody would call near.
const START: f64 = 1e-6;
const START_STEPS: f64 = 10.0;
/// Within so many steps of its encoders a loop that is stable may swing for ever.
const GRAIN_STEPS: f64 = 10.0;
const AWAY: f64 = 1e4;
/// Ticks of a third of it.
const THIRD: usize = 10_000;

/// Does the loop at rest, once disturbed a little, go on growing? The plant is the one of the scenario, not linear, and
/// the law the very tick in f64, over 30 000 ticks, beside another such loop that was not disturbed: what moves both is
/// no growth. Stable is what in the last third is smaller than in the second, or a hundred times smaller than in the
/// first, or the grain of the counts. The size of a third is its root mean square: a loop that its limited current
/// keeps from growing swings without end, and its peaks are now larger and now smaller.
///
/// # Errors
/// When the plant could not be integrated.
pub fn grows(at_rest: &AtRest, period_s: f64) -> Result<bool, SolverError> {
    let step = at_rest.law.steps().into_iter().fold(0.0, f64::max);
    let grain = GRAIN_STEPS * at_rest.sensed.iter().map(|sensed| sensed.quantum).fold(step, f64::max);
    let start = START.max(START_STEPS * step);
    let first = at_rest.sensed.first().map_or(0, |sensed| sensed.state);
    // Of a joint the motor may shake while its link hardly moves: all angles. Measured states are of many units.
    let angles = at_rest.sensed.iter().filter(|sensed| sensed.quantum > 0.0).map(|sensed| sensed.state);
    let watched: Vec<usize> = angles.filter(|state| *state != first).chain([first]).collect();
    let (mut moved, mut still) = (Run::new(at_rest), Run::new(at_rest));
    moved.x[first] = start;
    let (mut sizes, mut is_still) = ([0.0_f64; 3], false);
    for squares in &mut sizes {
        for _ in 0..THIRD {
            moved.tick(at_rest, period_s)?;
            if !is_still {
                still.tick(at_rest, period_s)?;
                // A loop that was not moved by one tick is moved by none.
                is_still = still == Run::new(at_rest);
            }
            let square: f64 = watched.iter().map(|state| (moved.x[*state] - still.x[*state]).powi(2)).sum();
            if square.is_nan() || square > (AWAY * start).powi(2) {
                return Ok(true);
            }
            *squares += square;
        }
    }
    let [begin, middle, end] = sizes.map(|sum| (sum / THIRD as f64).sqrt());
    Ok(end > 0.9 * middle && end > (0.01 * begin).max(grain))
}

/// A loop at rest that is run.
#[derive(PartialEq)]
struct Run {
    x: Vec<f64>,
    memory: Vec<f64>,
    samples: VecDeque<Vec<f64>>,
    demands: VecDeque<f64>,
}

impl Run {
    fn new(at_rest: &AtRest) -> Self {
        let (memory, rest) = at_rest.law.rest();
        let x = vec![0.0; at_rest.plant.order()];
        let samples = VecDeque::from(vec![seen(at_rest, &x); at_rest.sensor_delay_ticks]);
        Self { samples, x, memory, demands: VecDeque::from(vec![rest; at_rest.actuator_delay_ticks]) }
    }

    fn tick(&mut self, at_rest: &AtRest, period_s: f64) -> Result<(), SolverError> {
        self.samples.push_back(seen(at_rest, &self.x));
        let sample = self.samples.pop_front().unwrap_or_default();
        let Ticked { memory: mut next, u: asked, .. } = at_rest.law.tick(&self.memory, &sample, None);
        self.demands.push_back(asked);
        let held = self.demands.pop_front().unwrap_or(asked);
        if at_rest.report {
            next = at_rest.law.tick(&self.memory, &sample, Some(held)).memory;
        }
        self.memory = next;
        solver::advance(at_rest.plant.as_ref(), 0.0, period_s, held, &mut self.x)
    }
}

fn seen(at_rest: &AtRest, x: &[f64]) -> Vec<f64> {
    at_rest.sensed.iter().map(|sensed| x[sensed.state]).collect()
}

/// The rectangle of good points around `home` whose sides are furthest from it: the nearest side first, where a side
/// on the rim of the grid is no limit, then by how many points it has. As its first and last column and row; without a
/// home the one of most points. None if home is not good, or nothing is.
pub fn widest_rectangle(good: &[bool], columns: usize, home: [Option<usize>; 2]) -> Option<[usize; 4]> {
    let rows = good.len() / columns.max(1);
    // From home to the nearer end of a range that is not on the rim.
    let room = |home: Option<usize>, first: usize, last: usize, count: usize| {
        let below = home.filter(|_| first > 0).map(|home| home - first);
        let above = home.filter(|_| last + 1 < count).map(|home| last - home);
        below.into_iter().chain(above).min().unwrap_or(usize::MAX)
    };
    let mut best = None;
    for top in 0..rows {
        // Of each column, is it good from the top row to this one?
        let mut all = vec![true; columns];
        for bottom in top..rows {
            all.iter_mut().zip(&good[bottom * columns..]).for_each(|(all, good)| *all &= good);
            if home[1].is_some_and(|row| !(top..=bottom).contains(&row)) {
                continue;
            }
            let mut left = 0;
            for column in 0..=columns {
                if all.get(column) == Some(&true) {
                    continue;
                }
                if left < column && home[0].is_none_or(|home| (left..column).contains(&home)) {
                    let nearest = room(home[0], left, column - 1, columns).min(room(home[1], top, bottom, rows));
                    let worth = (nearest, (column - left) * (bottom + 1 - top));
                    if best.is_none_or(|(known, _)| worth > known) {
                        best = Some((worth, [left, column - 1, top, bottom]));
                    }
                }
                left = column + 1;
            }
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

#[cfg(test)]
mod tests;
