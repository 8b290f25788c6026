//! Request of a map: axes, presets, corners.

use loop_sim::port::drive::DriveDesign;
use scenario::Experiment;

use super::{Axis, Deviation, MayBeOff, Question, Subject, Uncertain, corners};
use crate::Error;
use crate::figures::known_numbers;
use crate::number::typed;

/// Predefined axes.
struct Preset {
    name: &'static str,
    /// Axes without an encoder, for a motor, for a joint.
    axes: [[&'static str; 2]; 3],
    figure: Option<&'static str>,
}

/// Placeholder for k_l: a key with a fixed range without encoders, or the range of the design rules for a drive.
const K_L: &str = "k_l";

const PRESETS: [Preset; 5] = [
    Preset {
        name: "gain",
        axes: [
            ["plant.error.b=-0.9..5:48", K_L],
            ["error.torque_percent=-90..500:48", K_L],
            ["error.torque_percent=-90..500:48", K_L],
        ],
        figure: None,
    },
    Preset {
        name: "rate",
        axes: [
            ["controller.period_s=1e-4..2e-2:log:40", "controller.surface_bandwidth_rad_s=1..100:log:40"],
            ["drive.period_s=1e-4..1e-2:log:40", "drive.surface_rad_s=5..500:log:40"],
            ["drive.period_s=1e-4..4e-3:log:40", "drive.tuning=quiet,normal,firm"],
        ],
        figure: None,
    },
    Preset {
        name: "delay",
        axes: [
            ["actuator.delay_ticks=0,1,2,3,4,5,6,8,10,12,14,16,20", K_L],
            ["motor.current_lag_s=1e-4..1e-2:log:40", K_L],
            ["joint.current_lag_s=1e-4..1e-2:log:40", K_L],
        ],
        figure: None,
    },
    Preset {
        name: "jitter",
        axes: [["sensor.jitter=0..1:17", K_L], ["drive.jitter_s=0..1:17", K_L], ["drive.jitter_s=0..1:17", K_L]],
        figure: Some("metrics.u_total_variation_per_s"),
    },
    Preset {
        name: "plant",
        axes: [
            ["plant.error.b=-0.9..4:48", "plant.error.k1=-0.9..4:48"],
            ["error.inertia_percent=-80..500:48", "error.torque_percent=-80..500:48"],
            ["error.link_inertia_percent=-80..300:48", "error.stiffness_percent=-80..300:48"],
        ],
        figure: None,
    },
];
/// Preset without axes, and its default deviation, percent.
pub const CORNERS: &str = "corners";
const CORNERS_PERCENT: f64 = 50.0;

/// Returns the names of the presets that have axes.
pub fn presets() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|preset| preset.name)
}

/// Returns an error with the nearest name for an unknown preset.
fn known_preset(preset: &str) -> Result<(), Error> {
    let known: Vec<&str> = presets().chain([CORNERS]).collect();
    if known.contains(&preset) {
        return Ok(());
    }
    let distance = |name: &&&str| strsim::damerau_levenshtein(name, preset);
    let nearest = known.iter().min_by_key(distance).filter(|name| distance(name) < 3);
    let what = nearest
        .map_or_else(|| format!("expected one of {}", known.join(", ")), |nearest| format!("did you mean {nearest}?"));
    Err(Error::input(what).at(format!("--preset {preset}")))
}

/// Request of a map.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapRequest<'a> {
    /// First axis, parsed by [`Axis::parse`].
    pub x: Option<&'a str>,
    /// Second axis.
    pub y: Option<&'a str>,
    /// Name of a preset that replaces the axes.
    pub preset: Option<&'a str>,
    /// Deviation of every plant parameter in the corners, percent.
    pub corners: Option<f64>,
    /// Path of a number of run.json.
    pub figure: Option<&'a str>,
    /// Largest metric of a good point.
    pub at_most: Option<f64>,
    /// Smallest metric of a good point.
    pub at_least: Option<f64>,
    /// Whether every point is also simulated.
    pub simulate: bool,
}

/// Returns the range of k_l of a drive, 1/s: for a motor around its present value, at most one per tick; for a joint 2
/// to 8 times w_c, the limits of its design.
fn reaching_per_s(designed: &DriveDesign, period_s: f64) -> [f64; 2] {
    match designed {
        DriveDesign::Motor(_) => {
            let own = designed.bandwidths().reaching_per_s;
            [0.05 * own, (10.0 * own).min(1.0 / period_s).max(own)]
        }
        // With four digits the values stay within the limits.
        DriveDesign::Joint(_) => [2.001, 7.999].map(|times| times * designed.bandwidths().surface_rad_s),
    }
}

/// Returns the axes of a preset, and its metric.
fn axes_of(
    preset: &str,
    subject: &Subject<'_>,
    experiment: &Experiment,
) -> Result<(Vec<Axis>, Option<&'static str>), Error> {
    let Some(Preset { name, axes, figure }) = PRESETS.iter().find(|it| it.name == preset) else {
        return Ok((Vec::new(), None));
    };
    let (kind, period_s) = (experiment.drive.as_ref().map_or(0, |drive| drive.shafts.len()), experiment.period_s);
    let points = if *name == "jitter" { 17 } else { 48 };
    let mut parsed = Vec::new();
    for axis in axes[kind] {
        // Chains and equations have no key for the error of b.
        if let Some(range) = axis.strip_prefix("plant.error.b=")
            && *name == "gain"
            && let Some(axis) = Axis::of_input_gain(subject, range)
        {
            parsed.push(axis);
            continue;
        }
        let text = match (axis, &experiment.drive) {
            (K_L, None) => format!("controller.k_l=5..{}:log:{points}", if points == 17 { 500 } else { 1000 }),
            (K_L, Some(drive)) => {
                let [least, most] = reaching_per_s(&drive.designed, period_s).map(|it| typed(it, 4));
                format!("drive.reaching_per_s={least}..{most}:log:{points}")
            }
            ("drive.jitter_s=0..1:17", _) => format!("drive.jitter_s=0..{}:17", typed(period_s, 4)),
            (axis, _) => axis.to_owned(),
        };
        parsed.push(Axis::parse(&text)?);
    }
    for axis in &parsed {
        if let Err(why) = subject.with(&axis.sets(axis.values.len() / 2)) {
            let why = why.to_string();
            let why = why.lines().next().unwrap_or_default();
            let what = format!("the preset sweeps {}, and {why}: {}", axis.key, instead(subject));
            return Err(Error::input(what).at(format!("--preset {preset}")));
        }
    }
    Ok((parsed, *figure))
}

/// Returns the settings that a preset keeps constant. In the preset `delay` the current lag is an error of the plant;
/// otherwise the rule of a motor would change the drive with it.
fn held(preset: Option<&str>, experiment: &Experiment) -> Vec<String> {
    match (preset, experiment.drive.as_ref().map(|drive| drive.designed)) {
        (Some("delay"), Some(designed)) if designed.name() == "motor" => {
            let w = designed.bandwidths();
            let keys = ["surface_rad_s", "observer_rad_s", "reaching_per_s"];
            let values = [w.surface_rad_s, w.observers_rad_s[0], w.reaching_per_s];
            keys.iter().zip(values).map(|(key, value)| format!("drive.{key}={value:?}")).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns the remedy if a preset has no axes for a plant: two of its own parameters, if they are known.
fn instead(subject: &Subject<'_>) -> String {
    let numbers = MayBeOff::of(subject).map(|it| it.numbers).unwrap_or_default();
    let axis = |number: &Uncertain| match number.deviation {
        Deviation::Number(value) => {
            let [one, other] = [0.5 * value, 2.0 * value];
            Some(format!("{}={}..{}", number.keys[0], typed(one.min(other), 4), typed(one.max(other), 4)))
        }
        Deviation::Error(_) => None,
    };
    let axes: Vec<String> = numbers.iter().filter_map(axis).collect();
    match &axes[..] {
        [x, .., y] => format!("give two keys, as in --x {x} --y {y}"),
        _ => "give --x and --y".into(),
    }
}

impl<'a> Question<'a> {
    /// Returns the question for the poles of the unchanged scenario.
    pub fn of(subject: Subject<'a>, experiment: &Experiment) -> Self {
        Self {
            subject,
            held: Vec::new(),
            axes: Vec::new(),
            corners: Vec::new(),
            percent: None,
            figure: None,
            at_most: None,
            at_least: None,
            simulate: false,
            scenario: experiment.name.clone(),
            designed: experiment.drive.as_ref().map(|drive| drive.designed),
        }
    }

    /// Reads the request for a scenario.
    ///
    /// # Errors
    /// The scenario is invalid, it lacks a requested axis, percentage or metric, or the preset is unknown.
    pub fn new(subject: Subject<'a>, request: &MapRequest<'_>) -> Result<Self, Error> {
        if let Some(preset) = request.preset {
            known_preset(preset)?;
        }
        let mut experiment = subject.with(&[])?;
        let held = held(request.preset, &experiment);
        let sets: Vec<String> = subject.sets.iter().chain(&held).cloned().collect();
        let with_held = Subject { sets: &sets, ..subject };
        let (axes, of_preset) = match (request.preset, request.x, request.y) {
            (Some(preset), ..) => axes_of(preset, &with_held, &experiment)?,
            (None, Some(x), Some(y)) => (vec![Axis::parse(x)?, Axis::parse(y)?], None),
            _ if request.corners.is_some() => (Vec::new(), None),
            _ => {
                return Err(Error::input("nothing to sweep: give --x and --y, --preset NAME, or --corners PERCENT"));
            }
        };
        if let [x, y] = &axes[..]
            && x.key == y.key
        {
            return Err(Error::input(format!("--x and --y both sweep {}", x.key)));
        }
        let percent = match request.corners {
            Some(percent) if !(percent > 0.0 && percent < 100.0) => {
                let what = "expected a number above 0 and below 100";
                return Err(Error::input(what).at(format!("--corners {percent}")));
            }
            None if axes.is_empty() => Some(CORNERS_PERCENT),
            percent => percent,
        };
        let corners = percent.map_or(Ok(Vec::new()), |percent| corners(&with_held, percent, &axes))?;
        request.check(&axes, &mut experiment)?;
        let MapRequest { at_most, at_least, simulate, .. } = *request;
        let figure = request.figure.or(of_preset).map(ToOwned::to_owned);
        let plain = Self::of(subject, &experiment);
        Ok(Self { held, axes, corners, percent, figure, at_most, at_least, simulate, ..plain })
    }

    /// Returns the settings `KEY=VALUE` of all points.
    pub fn sets(&self) -> Vec<String> {
        self.subject.sets.iter().chain(&self.held).cloned().collect()
    }

    /// Returns the number of the file at a key, or the number from the design rules.
    pub fn own_number(&self, axis: &Axis) -> Option<f64> {
        let key = axis.key.as_str();
        let by_rule = || {
            let designed = self.designed.as_ref()?;
            let w = designed.bandwidths();
            match key.strip_prefix("drive.")? {
                "surface_rad_s" => Some(w.surface_rad_s),
                "reaching_per_s" => Some(w.reaching_per_s),
                key => {
                    let i = designed.observer_keys().iter().position(|own| *own == key)?;
                    Some(w.observers_rad_s[i])
                }
            }
        };
        let sets = self.sets();
        axis.own_number(&Subject { sets: &sets, ..self.subject }).or_else(by_rule)
    }

    /// Returns the index of the word that the file has on this axis.
    fn own_word(&self, axis: &Axis) -> Option<usize> {
        let designed = self.designed.as_ref()?;
        (0..axis.values.len()).find(|k| {
            let with = self.experiment(&axis.sets(*k));
            with.is_ok_and(|it| it.drive.is_some_and(|other| other.designed == *designed))
        })
    }

    /// Returns the position of the file on an axis; `None` beyond its ends.
    pub(super) fn home(&self, axis: &Axis) -> Option<usize> {
        match &axis.numbers {
            Some(_) => axis.at(self.own_number(axis)?),
            None => self.own_word(axis),
        }
    }
}

impl MapRequest<'_> {
    /// Checks the limits and the metric.
    fn check(&self, axes: &[Axis], experiment: &mut Experiment) -> Result<(), Error> {
        for (name, bar) in [("--at-most", self.at_most), ("--at-least", self.at_least)] {
            if let Some(bar) = bar.filter(|bar| !bar.is_finite()) {
                return Err(Error::input("expected a finite number").at(format!("{name} {bar}")));
            }
            if bar.is_some() && axes.is_empty() {
                return Err(Error::input(format!("{name} needs a map: a list of corners has no limit")));
            }
        }
        let Some(figure) = self.figure else { return Ok(()) };
        let known = known_numbers(experiment).map_err(|error| Error { is_input: true, ..error })?;
        if known.iter().any(|known| known == figure) {
            return Ok(());
        }
        let nearest = known.iter().min_by_key(|known| strsim::damerau_levenshtein(known, figure));
        let nearest = nearest.map_or("", String::as_str);
        let what = format!("run.json has no such number; did you mean {nearest}?");
        Err(Error::input(what).at(format!("--figure {figure}")))
    }
}
