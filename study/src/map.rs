//! Maps: two keys of a scenario are swept over a grid, and the exact matrices decide the stability of each point.
//!
//! A point is the scenario with two values set. `z` are the eigenvalues of one tick of plant, controller and delays at
//! rest ([`margins`]). The loop is stable if max |z| < 1. Its decay rate is -ln|z|/T of the slowest pole except the
//! pole of the offset. With corners a point is as good as its worst corner. The corners are all 2^p sign combinations
//! of a deviation, in percent, of every uncertain plant parameter. The guaranteed tolerance is the largest rectangle of
//! good points around the values of the file.
//!
//! [`grows`] decides stability by simulation of the nonlinear plant and the controller code, independently of the
//! matrices. A loop near its stability limit needs a long simulation. The two methods may therefore differ, but only
//! where max |z| is within a thousandth of 1.
//!
//! Cost: about a millisecond per point and corner; a simulation takes a tenth of a second.

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
mod request;

pub use answer::{Map, Promise, Simulated, map};
pub use request::{CORNERS, MapRequest, presets};

/// Default and largest number of points along an axis.
const POINTS: usize = 32;
const MOST_POINTS: usize = 400;
/// Syntax of an axis.
const FORM: &str = "expected KEY=FROM..TO, KEY=FROM..TO:log:40 or KEY=A,B,C";
/// Digits of the values between two ends, few enough to read and type.
const DIGITS: usize = 5;

/// Axis of a map: a key and its values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// Key, as in `--set`.
    pub key: String,
    /// Values, as in `--set`.
    pub values: Vec<String>,
    /// Values as increasing numbers; `None` for a list of other values.
    #[serde(skip)]
    pub numbers: Option<Vec<f64>>,
    /// Whether the numbers have a constant ratio instead of a constant difference.
    #[serde(skip)]
    pub is_log: bool,
    /// Settings of each value, if they are not `KEY=VALUE`; 0 is then the file itself.
    #[serde(skip)]
    settings: Option<Vec<Vec<String>>>,
}

impl Axis {
    /// Parses `KEY=FROM..TO`, optionally with `:log` and `:POINTS`, or `KEY=A,B,C`.
    ///
    /// # Errors
    /// The text is not an axis.
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
            number.ok_or_else(|| wrong(format!("{word:?} is not a finite number")).with_remedy(FORM))
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
            // The ends are exactly as typed.
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
            return Err(wrong(format!("{points} points differ by less than {DIGITS} digits: take fewer points")));
        }
        Ok(Self { key, values, numbers: Some(numbers), is_log, settings: None })
    }

    /// Parses the values `A,B,C`.
    fn of_values(key: String, range: &str) -> Result<Self, Error> {
        let values = listed(range);
        if let Some(twice) = (1..values.len()).find(|k| values[..*k].contains(&values[*k])) {
            return Err(Error::input(format!("duplicate value {}", values[twice])));
        }
        match values.len() {
            0..=MOST_POINTS if values.iter().all(|value| !value.is_empty()) => {
                Ok(Self { key, values, numbers: None, is_log: false, settings: None })
            }
            0..=MOST_POINTS => Err(Error::input("a value is empty").with_remedy(FORM)),
            many => Err(Error::input(format!("{many} values; at most {MOST_POINTS}"))),
        }
    }

    /// Returns the nearest point to a value; `None` beyond the ends.
    pub fn at(&self, value: f64) -> Option<usize> {
        let numbers = self.numbers.as_ref()?;
        let (first, last) = (numbers.first()?, numbers.last()?);
        let away = |k: &usize| (numbers[*k] - value).abs();
        (first..=last).contains(&&value).then(|| (0..numbers.len()).min_by(|i, j| away(i).total_cmp(&away(j))))?
    }

    /// Returns the settings `KEY=VALUE` of a point.
    pub fn sets(&self, k: usize) -> Vec<String> {
        let as_it_stands = || vec![format!("{}={}", self.key, self.values[k])];
        self.settings.as_ref().map_or_else(as_it_stands, |settings| settings[k].clone())
    }

    /// Returns whether the axis sets this key.
    fn sweeps(&self, key: &str) -> bool {
        self.sets(0).iter().any(|set| set.split('=').next() == Some(key))
    }

    /// Returns the value of the file on this axis.
    pub fn own_number(&self, subject: &Subject<'_>) -> Option<f64> {
        if self.settings.is_some() { Some(0.0) } else { subject.number_at(&self.key) }
    }

    /// Returns an axis of the relative error of the input gain: b over the b of the controller, less 1. It exists for
    /// chains, which state b, and for equations, where the b of the controller is scaled. Returns `None` for any other
    /// plant.
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

/// Splits at commas outside of brackets.
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

/// Uncertain parameter of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// Name of the parameter.
    pub name: String,
    /// Keys that are set to the same deviation.
    pub keys: Vec<String>,
    /// How the file states the deviation.
    pub deviation: Deviation,
}

/// How a scenario file states a deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deviation {
    /// By an error key; the value is one percent in the unit of the key.
    Error(f64),
    /// By the parameter itself; the value is its number in the file.
    Number(f64),
}

/// Uncertain parameters of a plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MayBeOff {
    /// The parameters.
    pub numbers: Vec<Uncertain>,
    /// Additional settings that keep the model of the controller unchanged.
    pub believed: Vec<String>,
}

/// Names, keys, and one percent in the unit of the key.
type Errors = [(&'static str, &'static [&'static str], f64)];

/// Error tables of the kinds of scenario. A scenario uses the first table whose keys it accepts.
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

/// Numbers of a data sheet that may be 0, and their keys.
const ZEROS: [(&str, &str); 2] = [("weight", "joint.weight_n_m"), ("damping", "motor.damping_n_m_s")];

impl MayBeOff {
    /// Returns the uncertain parameters of a scenario: the error keys of a drive, except of a number that is 0, or of
    /// the paper's joint, the constants of equations, the nonzero coefficients of a chain. Any other plant has none.
    ///
    /// # Errors
    /// The file is not TOML.
    pub fn of(subject: &Subject<'_>) -> Result<Self, Error> {
        let takes = |errors: &&&Errors| errors[0].1.iter().all(|key| subject.with(&[format!("{key}=0.01")]).is_ok());
        if let Some(errors) = ERRORS.iter().find(takes) {
            // A number of the data sheet that is 0 stays 0.
            let is_zero = |name: &str| {
                let sheet = ZEROS.iter().find(|(zero, _)| *zero == name).map(|(_, key)| subject.number_at(key));
                sheet.is_some_and(|value| value.unwrap_or(0.0) == 0.0)
            };
            let errors = errors.iter().filter(|(name, ..)| !is_zero(name));
            let numbers = errors.map(|(name, keys, percent)| Uncertain {
                name: (*name).into(),
                keys: keys.iter().map(ToString::to_string).collect(),
                deviation: Deviation::Error(*percent),
            });
            return Ok(Self { numbers: numbers.collect(), believed: Vec::new() });
        }
        let mut of = Self::default();
        let mut add = |name: String, key: String| {
            if let Some(value) = subject.number_at(&key).filter(|value| *value != 0.0) {
                of.numbers.push(Uncertain { name, keys: vec![key], deviation: Deviation::Number(value) });
            }
        };
        // Never fails: the file was parsed before.
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

/// Returns the setting that keeps the input gain of a chain controller, if the file does not state it.
fn believed_gain(subject: &Subject<'_>) -> Option<String> {
    let b = subject.number_at("plant.b").filter(|b| *b != 0.0)?;
    subject.number_at("controller.nominal.b").is_none().then(|| format!("controller.nominal.b={b:?}"))
}

/// Corner of the uncertain parameters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Corner {
    /// Name, such as `J +50 %, K_t -50 %`.
    pub name: String,
    /// Settings of the corner.
    pub sets: Vec<String>,
}

/// Largest number of uncertain parameters; 2^12 corners are computed in reasonable time.
const MOST_UNCERTAIN: usize = 12;

/// Returns the corners of a scenario: every uncertain parameter that is not swept deviates by ±`percent`.
///
/// # Errors
/// The scenario is invalid, or it has no uncertain parameters or too many.
pub fn corners(subject: &Subject<'_>, percent: f64, axes: &[Axis]) -> Result<Vec<Corner>, Error> {
    subject.with(&[])?;
    let MayBeOff { numbers, believed } = MayBeOff::of(subject)?;
    let is_swept = |keys: &[String]| keys.iter().any(|key| axes.iter().any(|axis| axis.sweeps(key)));
    let is_none = numbers.is_empty();
    let numbers: Vec<Uncertain> = numbers.into_iter().filter(|it| !is_swept(&it.keys)).collect();
    if is_none {
        let what = "no uncertain parameters: corners need a scenario with [joint], [motor], a flexible joint, a chain, \
                    or equations with constants as [plant]";
        return Err(Error::input(what).at(subject.file));
    }
    if numbers.len() > MOST_UNCERTAIN {
        let names: Vec<&str> = numbers.iter().map(|it| it.name.as_str()).collect();
        let (count, names) = (names.len(), names.join(", "));
        let what = format!(
            "{count} uncertain parameters, {names}, make 2^{count} corners: at most 2^{MOST_UNCERTAIN} are allowed"
        );
        let remedy = format!("`host-sim monte-carlo --uncertain {percent}` samples all of them");
        return Err(Error::input(what).at(subject.file).with_remedy(remedy));
    }
    let corner = |corner: usize| {
        let mut sets = believed.clone();
        let name = numbers.iter().enumerate().map(|(i, Uncertain { name, keys, deviation })| {
            let percent = if corner >> i & 1 == 1 { percent } else { -percent };
            let value = |key: &String| match deviation {
                // In addition to the error of the file or of `--set`.
                Deviation::Error(unit) => {
                    let own = subject.number_at(key).unwrap_or(0.0) / unit;
                    typed((own + percent * (1.0 + 0.01 * own)) * unit, DIGITS)
                }
                Deviation::Number(own) => typed(own * (1.0 + 0.01 * percent), 15),
            };
            sets.extend(keys.iter().map(|key| format!("{key}={}", value(key))));
            format!("{name} {percent:+} %")
        });
        let name = name.collect::<Vec<_>>().join(", ");
        Corner { name, sets }
    };
    Ok((0..1_usize << numbers.len()).map(corner).collect())
}

/// Returns the largest deviation in whole percent, up to `most`, at which the loop is stable in all corners.
///
/// # Errors
/// The errors of [`corners`], or the loop has no matrices.
pub fn tolerance_percent(subject: &Subject<'_>, most: u32) -> Result<u32, Error> {
    for percent in 1..=most {
        for Corner { sets, .. } in corners(subject, f64::from(percent), &[])? {
            let experiment = subject.with(&sets)?;
            if poles(&experiment)?.1 >= 1.0 {
                return Ok(percent - 1);
            }
        }
    }
    Ok(most)
}

/// Scenario that is swept.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// File name for messages.
    pub file: &'a str,
    /// Content of the file.
    pub text: &'a str,
    /// Default name of the scenario.
    pub name: &'a str,
    /// Settings `KEY=VALUE` that precede the settings of a point.
    pub sets: &'a [String],
}

impl Subject<'_> {
    /// Parses the scenario with additional settings.
    ///
    /// # Errors
    /// All errors of the scenario.
    pub fn with(&self, more: &[String]) -> Result<Experiment, ScenarioError> {
        let sets = [self.sets, more].concat();
        scenario::parse_own(&Source { file: self.file, text: self.text, sets: &sets }, self.name)
    }

    /// Returns the number at a key of the file, if there is one.
    pub fn number_at(&self, key: &str) -> Option<f64> {
        scenario::number_at(&self.source(), key).ok()?
    }

    /// Returns the text at a key of the file, if there is one.
    fn text_at(&self, key: &str) -> Option<String> {
        scenario::text_at(&self.source(), key).ok()?
    }

    const fn source(&self) -> Source<'_> {
        Source { file: self.file, text: self.text, sets: self.sets }
    }
}

/// Grid to be computed; [`Question::new`] builds it from [`MapRequest`].
pub struct Question<'a> {
    /// Scenario.
    pub subject: Subject<'a>,
    /// Settings `KEY=VALUE` of a preset at every point.
    pub held: Vec<String>,
    /// First axis (columns) and second axis (rows). One axis makes a line; without axes the corners are computed one by
    /// one.
    pub axes: Vec<Axis>,
    /// Corners; a point is as good as the worst one. Without corners the scenario is computed as it is.
    pub corners: Vec<Corner>,
    /// Deviation in the corners, percent.
    pub percent: Option<f64>,
    /// Path of an additional metric in run.json.
    pub figure: Option<String>,
    /// Upper limit of the metric at a good point.
    pub at_most: Option<f64>,
    /// Lower limit of the metric at a good point; the worst corner is then the smallest value.
    pub at_least: Option<f64>,
    /// Whether every point is also simulated.
    pub simulate: bool,
    /// Name of the scenario.
    scenario: String,
    /// Drive of the file, if there is one.
    designed: Option<DriveDesign>,
}

/// Point of the grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Spectral radius of the worst corner: largest |z|; stable below 1.
    pub spectral_radius: f64,
    /// Decay rate -ln|z|/T of the slowest pole except the pole of the offset, 1/s; negative if unstable.
    pub decay_per_s: f64,
    /// Metric of the worst corner.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<f64>,
    /// Peak of |S| at the plant input, in a list of corners; `None` if unstable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity_peak: Option<f64>,
    /// Name of the corner with the largest |z|.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<String>,
    /// Number of unstable corners.
    #[serde(skip_serializing_if = "is_zero")]
    pub unstable_corners: usize,
    /// Whether the simulation of the worst corner grew.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grew: Option<bool>,
}

/// Returns whether the count is 0 and can be left out of the JSON.
pub const fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Point {
    /// Returns whether all poles decay.
    pub const fn is_stable(&self) -> bool {
        self.spectral_radius < 1.0
    }
}

/// A point, or the error of a design that is impossible with these values.
pub type Judged = Result<Point, Error>;

impl Question<'_> {
    /// Returns the number of columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [0, 1].map(|i| self.axes.get(i).map_or(1, |axis| axis.values.len()))
    }

    /// Parses the scenario with the settings of the preset and these.
    fn experiment(&self, more: &[String]) -> Result<Experiment, ScenarioError> {
        let sets: Vec<String> = self.held.iter().chain(more).cloned().collect();
        self.subject.with(&sets)
    }

    /// Computes the point in this column and row with its worst corner.
    fn judged(&self, place: [usize; 2], corners: &[Corner]) -> Judged {
        let here: Vec<String> = self.axes.iter().zip(place).flat_map(|(axis, k)| axis.sets(k)).collect();
        let as_it_is = [Corner { name: String::new(), sets: Vec::new() }];
        let is_plain = corners.is_empty();
        let corners = if is_plain { &as_it_is[..] } else { corners };
        let mut worst: Option<(Point, &Corner)> = None;
        let (mut figure, mut unstable) = (None::<f64>, 0);
        for corner in corners {
            let mut experiment = self.experiment(&[&here[..], &corner.sets].concat())?;
            let (it, spectral_radius, decay_per_s) = poles(&experiment)?;
            unstable += usize::from(spectral_radius >= 1.0);
            if let Some(path) = &self.figure {
                let value = number_of(path, &mut experiment)?;
                let is_worse = |known: f64| if self.at_least.is_some() { value < known } else { value > known };
                figure = figure.filter(|known| known.is_nan() || !(value.is_nan() || is_worse(*known))).or(Some(value));
            }
            if worst.as_ref().is_none_or(|(worst, _)| spectral_radius > worst.spectral_radius) {
                // A list of corners is ranked by it.
                let is_ranked = self.axes.is_empty() && spectral_radius < 1.0;
                let sensitivity_peak = if is_ranked { Some(it.margins()?.sensitivity_peak) } else { None };
                let point = Point {
                    spectral_radius,
                    decay_per_s,
                    figure: None,
                    sensitivity_peak,
                    worst: None,
                    unstable_corners: 0,
                    grew: None,
                };
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

    /// Computes each corner alone; `None` if stopped. A step of the watch is a corner.
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

    /// Computes all points, row by row from the first; `None` if stopped. A step of the watch is a point.
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

/// Returns the loop, its largest |z| and its slowest decay rate.
fn poles(experiment: &Experiment) -> Result<(Loop, f64, f64), Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    let found = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s).and_then(|it| {
        let alpha_per_s = margins::offset_per_s(experiment);
        let values = it.eigenvalues()?;
        let radius = values.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        let decay_per_s = margins::decay_per_s(&it.poles_beside(values, alpha_per_s));
        Ok((it, radius, decay_per_s))
    });
    Ok(found?)
}

/// Start of a simulation, rad or unit of the first state; the start in counts, if that is more; and the factor at which
/// the loop has left its neighbourhood.
const START: f64 = 1e-6;
const START_STEPS: f64 = 10.0;
/// Amplitude in counts within which a stable loop may have a limit cycle.
const GRAIN_STEPS: f64 = 10.0;
const AWAY: f64 = 1e4;
/// Ticks of a third of the simulation.
const THIRD: usize = 10_000;

/// Returns whether a small disturbance of the loop at rest grows. The simulation uses the nonlinear plant and the
/// controller code in f64 for 30 000 ticks. A second, undisturbed loop is subtracted, so that only the difference
/// counts. The loop is stable if the rms of the last third is below one of three values: the rms of the second third, a
/// hundredth of the rms of the first third, or the grain of the counts. The rms is used because the peaks of a limit
/// cycle at the current limit vary.
///
/// # Errors
/// The plant cannot be integrated.
pub fn grows(at_rest: &AtRest, period_s: f64) -> Result<bool, SolverError> {
    let step = at_rest.law.steps().into_iter().fold(0.0, f64::max);
    let grain = GRAIN_STEPS * at_rest.sensed.iter().map(|sensed| sensed.quantum).fold(step, f64::max);
    let start = START.max(START_STEPS * step);
    let first = at_rest.sensed.first().map_or(0, |sensed| sensed.state);
    // All angles are compared, because the motor of a joint can oscillate while its link hardly moves. Measured states
    // have different units.
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
                // A loop that does not move in one tick never moves.
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

/// Running simulation of a loop at rest.
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

/// Returns the rectangle of good points around `home` with the farthest sides. The nearest side counts first, where a
/// side on the rim of the grid is no limit; then the number of points. The result is the first and last column and row.
/// Without a home the rectangle with the most points is returned. `None` if home is not good, or no point is.
pub fn widest_rectangle(good: &[bool], columns: usize, home: [Option<usize>; 2]) -> Option<[usize; 4]> {
    let rows = good.len() / columns.max(1);
    // Distance from home to the nearer end of a range that is not on the rim.
    let room = |home: Option<usize>, first: usize, last: usize, count: usize| {
        let below = home.filter(|_| first > 0).map(|home| home - first);
        let above = home.filter(|_| last + 1 < count).map(|home| last - home);
        below.into_iter().chain(above).min().unwrap_or(usize::MAX)
    };
    let mut best = None;
    for top in 0..rows {
        // For each column: whether it is good from the top row to this row.
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
