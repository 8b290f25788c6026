//! `host-sim map`: where a loop is stable, and how good, over two keys of its scenario or all corners of its plant.

use std::iter;
use std::path::{Path, PathBuf};
use std::thread;

use clap::Args;
use controller_core::drive::{JointDesign, MotorDesign};
use loop_sim::port::drive::DriveDesign;
use scenario::Experiment;
use serde::Serialize;
use study::figures::{OF_DESIGN, known_numbers, number_of};
use study::map::{Axis, Judged, MayBeOff, Point, Question, Subject, Told, Uncertain, corners, widest_rectangle};
use study::number::{significant, typed};
use terminal::table::Table;

use super::run::note_changes;
use super::{Console, DEFAULT, Failure, ScenarioText, bad, claim_folder, folder_of, status};
use crate::report::heat::{Cell, Edge, HeatMap};
use crate::report::write_whole;

#[derive(Args, Debug, Default)]
pub(super) struct MapOptions {
    /// The scenario; without one the default.
    file: Option<PathBuf>,
    /// What to sweep from left to right: KEY=FROM..TO, with :log and :POINTS after it as wished, or KEY=A,B,C.
    #[arg(long, value_name = "AXIS", requires = "y", conflicts_with = "preset")]
    x: Option<String>,
    /// What to sweep upwards, likewise.
    #[arg(long, value_name = "AXIS", requires = "x")]
    y: Option<String>,
    /// Axes that many ask for: input gain, rate (period and bandwidth), delay, jitter, plant (what it weighs and how
    /// stiff it is), corners (all of --corners 50, one by one).
    #[arg(long, value_name = "NAME", value_parser = presets())]
    preset: Option<String>,
    /// Every number of the plant that is not swept may be so many percent off: a point is as good as the worst of all
    /// 2^p corners.
    #[arg(long, value_name = "PERCENT")]
    corners: Option<f64>,
    /// Colour this number of run.json, as in metrics.u_peak or design.margins.phase_deg [default: the decay of the
    /// slowest pole]; all but design is simulated.
    #[arg(long, value_name = "KEY")]
    figure: Option<String>,
    /// Good is only where the figure is at most this.
    #[arg(long, value_name = "VALUE", requires = "figure", conflicts_with = "at_least")]
    at_most: Option<f64>,
    /// Good is only where the figure is at least this.
    #[arg(long, value_name = "VALUE", requires = "figure")]
    at_least: Option<f64>,
    /// Simulate every point too, and say where that differs from the poles.
    #[arg(long)]
    simulate: bool,
    /// Override a key, as in --set drive.period_s=5e-4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder for map.svg, map.csv, with the feature png also map.png [default: out/SCENARIO-map].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the text.
    #[arg(long)]
    json: bool,
}

/// Axes that many ask for.
struct Preset {
    name: &'static str,
    /// Of what has no encoder, of a motor, of a joint.
    axes: [[&'static str; 2]; 3],
    figure: Option<&'static str>,
}

/// k_l: of what has no encoder a key with a range that serves all; of a drive what its own rules leave.
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
/// The preset that has no axes, and what it takes if nothing is said.
pub(super) const CORNERS: &str = "corners";
const CORNERS_PERCENT: f64 = 50.0;

fn presets() -> clap::builder::PossibleValuesParser {
    presets_or(CORNERS)
}

/// Those with axes, or this word.
pub(super) fn presets_or(word: &'static str) -> clap::builder::PossibleValuesParser {
    PRESETS.iter().map(|preset| preset.name).chain([word]).collect::<Vec<_>>().into()
}

impl MapOptions {
    /// One of the presets.
    pub(super) fn of_preset(file: Option<&Path>, preset: &str, sets: &[String]) -> Self {
        Self { file: file.map(Path::to_path_buf), preset: Some(preset.into()), sets: sets.to_vec(), ..Self::default() }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct MapJson<'a> {
    scenario: &'a str,
    sets: &'a [String],
    axes: &'a [Axis],
    figure: &'a str,
    /// Row by row; `refused` where there is no design.
    points: Vec<PointJson<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    promise: Option<Promise>,
    #[serde(skip_serializing_if = "Option::is_none")]
    simulated: Option<Simulated>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum PointJson<'a> {
    Judged(&'a Point),
    Refused { refused: &'a str },
}

/// Poles against simulation.
#[derive(Clone, Copy, Serialize)]
struct Simulated {
    agree: usize,
    differ: usize,
    /// Largest |1 - spectral radius| of the points where they differ.
    differ_within: f64,
}

impl Simulated {
    fn of(points: &[Judged]) -> Option<Self> {
        let both = points.iter().flatten().filter_map(|point| Some((point, point.grew?)));
        let (mut agree, mut away) = (0, Vec::new());
        for (point, grew) in both {
            if grew == point.is_stable() { away.push((point.spectral_radius - 1.0).abs()) } else { agree += 1 }
        }
        let differ_within = away.iter().copied().fold(0.0, f64::max);
        (agree + away.len() > 0).then_some(Self { agree, differ: away.len(), differ_within })
    }

    fn line(self) -> String {
        let Self { agree, differ, differ_within } = self;
        let told = format!("simulation agrees at {agree} of {} points", agree + differ);
        if differ == 0 { told } else { format!("{told}; at the others |1 - radius| <= {differ_within:.1e}") }
    }
}

/// What k_l of a drive may be, 1/s: of a motor around its own, one per tick at most; of a joint 2 to 8 times its w_c,
/// which is what its design takes.
fn reaching_per_s(designed: &DriveDesign, period_s: f64) -> [f64; 2] {
    match designed {
        DriveDesign::Motor { design, .. } => {
            let own = design.bandwidths.reaching_per_s;
            [0.05 * own, (10.0 * own).min(1.0 / period_s).max(own)]
        }
        // Four digits of it are still within.
        DriveDesign::Joint { design, .. } => [2.001, 7.999].map(|times| times * design.bandwidths.surface_rad_s),
    }
}

/// The axes of a preset, and its figure.
fn axes_of(
    preset: &str,
    subject: &Subject<'_>,
    experiment: &Experiment,
) -> Result<(Vec<Axis>, Option<&'static str>), Failure> {
    let Some(Preset { name, axes, figure }) = PRESETS.iter().find(|it| it.name == preset) else {
        return Ok((Vec::new(), None));
    };
    let (kind, period_s) = (experiment.drive.as_ref().map_or(0, |drive| drive.shafts.len()), experiment.period_s);
    let points = if *name == "jitter" { 17 } else { 48 };
    let mut parsed = Vec::new();
    for axis in axes[kind] {
        // Of a chain and of equations no key tells how far b is off.
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
        parsed.push(Axis::parse(&text).map_err(bad)?);
    }
    for axis in &parsed {
        if let Err(why) = subject.with(&axis.sets(axis.values.len() / 2)) {
            let why = why.to_string();
            let why = why.lines().next().unwrap_or_default();
            return Err(bad(format!("--preset {preset}: it sweeps {}, and {why}: {}", axis.key, instead(subject))));
        }
    }
    Ok((parsed, *figure))
}

/// What a preset holds as the file has it: the lag of the current is off, and not known to be another, for which the
/// rule of a motor would make another drive.
fn held(options: &MapOptions, experiment: &Experiment) -> Option<String> {
    match (options.preset.as_deref()?, experiment.drive.as_ref()?.designed) {
        ("delay", DriveDesign::Motor { design, .. }) => {
            Some(format!("drive.surface_rad_s={:?}", design.bandwidths.surface_rad_s))
        }
        _ => None,
    }
}

/// What to do where a preset has no axes for a plant: two of its own numbers, if they are known.
fn instead(subject: &Subject<'_>) -> String {
    let numbers = MayBeOff::of(subject).map(|it| it.numbers).unwrap_or_default();
    let axis = |number: &Uncertain| match number.told {
        Told::Number(value) => {
            let [one, other] = [0.5 * value, 2.0 * value];
            Some(format!("{}={}..{}", number.keys[0], typed(one.min(other), 4), typed(one.max(other), 4)))
        }
        Told::Error(_) => None,
    };
    let axes: Vec<String> = numbers.iter().filter_map(axis).collect();
    match &axes[..] {
        [x, .., y] => format!("give two keys, as in --x {x} --y {y}"),
        _ => "give --x and --y".into(),
    }
}

impl Console<'_> {
    pub(super) fn map(&mut self, options: &MapOptions) -> Result<u8, Failure> {
        self.with_view(options, |console, view| {
            if view.question.axes.is_empty() { console.list_corners(view) } else { console.draw_map(view) }
        })
    }

    /// What the options ask for, ready to be answered.
    pub(super) fn with_view<T>(
        &mut self,
        options: &MapOptions,
        then: impl FnOnce(&mut Self, &View<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        let mut experiment = text.subject(&options.sets).with(&[])?;
        let sets: Vec<String> = options.sets.iter().cloned().chain(held(options, &experiment)).collect();
        let subject = text.subject(&sets);
        let (axes, of_preset) = match (&options.preset, &options.x, &options.y) {
            (Some(preset), ..) => axes_of(preset, &subject, &experiment)?,
            (None, Some(x), Some(y)) => (vec![Axis::parse(x).map_err(bad)?, Axis::parse(y).map_err(bad)?], None),
            _ if options.corners.is_some() => (Vec::new(), None),
            _ => return Err(bad("what is to be swept? Give --x and --y, --preset NAME, or --corners PERCENT")),
        };
        if let [x, y] = &axes[..]
            && x.key == y.key
        {
            return Err(bad(format!("--x and --y both sweep {}", x.key)));
        }
        let percent = match options.corners {
            Some(percent) if !(percent > 0.0 && percent < 100.0) => {
                return Err(bad(format!("--corners {percent}: expected a number above 0 and below 100")));
            }
            None if axes.is_empty() => Some(CORNERS_PERCENT),
            percent => percent,
        };
        let corners = percent.map_or(Ok(Vec::new()), |percent| corners(&subject, percent, &axes)).map_err(bad)?;
        let figure = options.figure.as_deref().or(of_preset);
        for (name, bar) in [("--at-most", options.at_most), ("--at-least", options.at_least)] {
            if let Some(bar) = bar.filter(|bar| !bar.is_finite()) {
                return Err(bad(format!("{name} {bar}: expected a finite number")));
            }
            if bar.is_some() && axes.is_empty() {
                return Err(bad(format!("{name} is for a map: corners are listed as they are")));
            }
        }
        if let Some(figure) = &options.figure {
            let known = known_numbers(&mut experiment).map_err(|error| bad(error.to_string()))?;
            if !known.contains(figure) {
                let nearest = known.iter().min_by_key(|known| strsim::damerau_levenshtein(known, figure));
                let nearest = nearest.map_or("", String::as_str);
                return Err(bad(format!("--figure {figure}: run.json has no such number; nearest is {nearest}")));
            }
        }
        let of_point = |experiment: &mut Experiment| {
            number_of(figure.unwrap_or_default(), experiment).map_err(|error| error.to_string())
        };
        let question = Question {
            subject,
            axes,
            corners,
            figure: figure.is_some().then_some(&of_point),
            less_is_worse: options.at_least.is_some(),
            simulate: options.simulate,
        };
        note_changes(&mut experiment.title, &sets);
        then(self, &View { options, question: &question, figure, percent, experiment: &experiment })
    }

    /// Each corner by itself, the worst first; none if it was told to stop.
    pub(super) fn judged_corners(&mut self, view: &View<'_>) -> Result<Option<Vec<(String, Point)>>, Failure> {
        let question = view.question;
        let mut found = Vec::new();
        for corner in &question.corners {
            let alone =
                Question { corners: vec![corner.clone()], axes: Vec::new(), figure: question.figure, ..*question };
            let Some(points) = alone.answer(1, self.stop, &mut || ()) else { return Ok(None) };
            for point in points {
                let point = point.map_err(|message| bad(format!("{}: {message}", corner.name)))?;
                found.push((corner.name.clone(), point));
            }
        }
        found.sort_by(|(_, a), (_, b)| a.decay_per_s.total_cmp(&b.decay_per_s));
        Ok(Some(found))
    }

    fn list_corners(&mut self, view: &View<'_>) -> Result<u8, Failure> {
        let View { figure, experiment, options, .. } = *view;
        let Some(found) = self.judged_corners(view)? else { return Ok(status::INTERRUPTED) };
        let points: Vec<Judged> = found.iter().map(|(_, point)| Ok(point.clone())).collect();
        let simulated = Simulated::of(&points);
        if options.json {
            self.say_json(serde_json::to_string(&view.json(&points, None)))?;
            return Ok(status::DONE);
        }
        self.say(&format!("{}\n{}", experiment.headline(), view.count(&found)))?;
        let of_figure = figure.iter().copied();
        let mut table = Table::new(["corner", "slowest |z|", "its decay (1/s)"].into_iter().chain(of_figure));
        for (corner, point) in &found {
            let figure = point.figure.iter().map(|value| number(*value));
            // Of that pole, and not of the offset W, whose own may be slower and is the same in every corner.
            let radius = format!("{:.6}", libm::exp(-point.decay_per_s * experiment.period_s));
            let cells: Vec<String> =
                [corner.clone(), radius, number(point.decay_per_s)].into_iter().chain(figure).collect();
            table.row(cells.iter().map(String::as_str));
        }
        self.say(&table.to_string())?;
        simulated.map_or(Ok(()), |simulated| self.say(&simulated.line()))?;
        Ok(status::DONE)
    }

    /// Every point of the map; none if it was told to stop.
    pub(super) fn answered(&mut self, view: &View<'_>) -> Result<Option<Answered>, Failure> {
        let View { question, figure, .. } = *view;
        let [columns, rows] = question.size();
        let bar =
            self.bar((columns * rows) as u64, "{bar:40} {percent:>3} %  {rate} points/s  {elapsed} / {left} left");
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let points = question.answer(threads, self.stop, &mut || bar.inc(1));
        bar.finish_and_clear();
        let Some(points) = points else { return Ok(None) };
        if let (true, Some(Err(why))) = (points.iter().all(Result::is_err), points.first()) {
            let why = why.lines().next().unwrap_or_default();
            return Err(bad(format!("no point of the map has a design; of the first: {why}")));
        }
        let good: Vec<bool> =
            points.iter().map(|point| point.as_ref().is_ok_and(|point| view.is_good(point))).collect();
        let own = [0, 1].map(|i| view.own_number(&question.axes[i]));
        let home = [0, 1].map(|i| view.home(&question.axes[i]));
        let frame = widest_rectangle(&good, columns, home);
        let [x, y] = [0, 1].map(|i| edge(&question.axes[i]));
        let place = |edge: &Edge, i: usize| Some(edge.place(own[i]?).unwrap_or(edge.middle(home[i]?)));
        let mark = place(&x, 0).zip(place(&y, 1)).map(<[f64; 2]>::from);
        let map = HeatMap {
            title: view.title(),
            label: figure.map_or_else(|| DECAY_LABEL.into(), ToOwned::to_owned),
            x,
            y,
            cells: points.iter().map(cell).collect(),
            good,
            frame,
            mark,
        };
        let promise = frame.map(|[first, last, low, high]| {
            let ends = |i: usize, from: usize, to: usize| {
                let values = &question.axes[i].values;
                [values[from].clone(), values[to].clone()]
            };
            [ends(0, first, last), ends(1, low, high)]
        });
        let simulated = Simulated::of(&points);
        let unseen = view.unseen(&points);
        let promised = match &unseen[..] {
            [] => view.promise(promise.as_ref(), &points, home),
            keys => format!(
                "nothing is promised: no pole of the loop at rest moves with {}; judge it by --figure with a bar",
                keys.join(" or ")
            ),
        };
        let (promise, frame) = if unseen.is_empty() { (promise, map.frame) } else { (None, None) };
        let map = HeatMap { frame, ..map };
        let lines = [census(&points, &map.good), promised];
        let lines = lines.into_iter().chain(simulated.map(Simulated::line)).collect();
        Ok(Some(Answered { points, map, promise, lines }))
    }

    fn draw_map(&mut self, view: &View<'_>) -> Result<u8, Failure> {
        let View { experiment, options, .. } = *view;
        let folder = folder_of(options.out.as_ref(), &experiment.name, "map");
        let claim = claim_folder(&folder)?;
        let Some(Answered { points, map, promise, lines }) = self.answered(view)? else {
            return Ok(status::INTERRUPTED);
        };
        let failed = |error| Failure::writing(folder.join("map").display(), &error);
        if options.json {
            self.say_json(serde_json::to_string(&view.json(&points, promise)))?;
        } else {
            self.say(&experiment.headline())?;
            for line in &lines {
                self.say(line)?;
            }
        }
        let csv = view.csv(&points);
        write_whole(&folder.join("map.csv"), |out| out.write_all(csv.as_bytes())).map_err(failed)?;
        map.write(&folder, "map").map_err(failed)?;
        drop(claim);
        if !options.json {
            self.say(&format!("written to {}", folder.display()))?;
        }
        Ok(status::DONE)
    }
}

/// A map that is drawn.
pub(super) struct Answered {
    points: Vec<Judged>,
    pub(super) map: HeatMap,
    promise: Option<Promise>,
    /// What is said of it.
    pub(super) lines: Vec<String>,
}

/// Both ends of both axes.
type Promise = [[String; 2]; 2];

/// What is coloured if nothing else is asked for.
const DECAY: &str = "decay_per_s";
const DECAY_LABEL: &str = "decay of the slowest pole (1/s)";

/// A question and how its answer is told.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    options: &'a MapOptions,
    question: &'a Question<'a>,
    figure: Option<&'a str>,
    percent: Option<f64>,
    experiment: &'a Experiment,
}

impl View<'_> {
    fn json<'a>(&'a self, points: &'a [Judged], promise: Option<Promise>) -> MapJson<'a> {
        MapJson {
            scenario: &self.experiment.name,
            sets: self.question.subject.sets,
            axes: &self.question.axes,
            figure: self.figure.unwrap_or(DECAY),
            points: points.iter().map(PointJson::of).collect(),
            promise,
            simulated: Simulated::of(points),
        }
    }

    /// How many corners are unstable.
    pub(super) fn count(&self, found: &[(String, Point)]) -> String {
        let unstable = found.iter().filter(|(_, point)| !point.is_stable()).count();
        let percent = self.percent.unwrap_or_default();
        format!("{unstable} of {} corners at {percent} % are unstable", found.len())
    }

    /// Stable, and within what was asked of the figure.
    fn is_good(&self, point: &Point) -> bool {
        let value = point.figure.unwrap_or(f64::NAN);
        // A run that did not come to its end has no figure; of a design there may be none, as a margin without a limit.
        let is_run = self.figure.is_some_and(|figure| !figure.starts_with(OF_DESIGN));
        point.is_stable()
            && !(is_run && value.is_nan())
            && self.options.at_most.is_none_or(|most| value <= most)
            && self.options.at_least.is_none_or(|least| value >= least)
    }

    fn title(&self) -> String {
        let worst = self.percent.map_or_else(String::new, |percent| {
            format!(", the worst of {} corners at {percent} %", self.question.corners.len())
        });
        let bar = match (self.options.at_most, self.options.at_least) {
            (Some(most), _) => format!(", good up to {most}"),
            (_, Some(least)) => format!(", good from {least}"),
            _ => String::new(),
        };
        format!("{}: {}{worst}{bar}", self.experiment.title, self.figure.unwrap_or("decay of the slowest pole"))
    }

    /// The keys along which no pole moves and nothing else is asked that might.
    fn unseen(&self, points: &[Judged]) -> Vec<&str> {
        let is_asked = self.options.at_most.is_some() || self.options.at_least.is_some();
        let [columns, rows] = self.question.size();
        let poles = |column: usize, row: usize| {
            let point = points[row * columns + column].as_ref().ok()?;
            Some([point.spectral_radius, point.decay_per_s].map(f64::to_bits))
        };
        let moves = [
            (0..rows).any(|row| (1..columns).any(|column| poles(column, row) != poles(0, row))),
            (0..columns).any(|column| (1..rows).any(|row| poles(column, row) != poles(column, 0))),
        ];
        let axes = self.question.axes.iter().zip(moves);
        // Of one value nothing can be said.
        let unmoved = axes.filter(|(axis, moves)| !moves && axis.values.len() > 1 && !is_asked);
        unmoved.map(|(axis, _)| axis.key.as_str()).collect()
    }

    /// The number that the file has at a key, or the design for it by its rules.
    fn own_number(&self, axis: &Axis) -> Option<f64> {
        let key = axis.key.as_str();
        let by_rule = || match &self.experiment.drive.as_ref()?.designed {
            DriveDesign::Motor { design: MotorDesign { bandwidths: w, .. }, .. } => match key {
                "drive.surface_rad_s" => Some(w.surface_rad_s),
                "drive.observer_rad_s" => Some(w.observer_rad_s),
                "drive.reaching_per_s" => Some(w.reaching_per_s),
                _ => None,
            },
            DriveDesign::Joint { design: JointDesign { bandwidths: w, .. }, .. } => match key {
                "drive.surface_rad_s" => Some(w.surface_rad_s),
                "drive.link_rad_s" => Some(w.link_rad_s),
                "drive.motor_rad_s" => Some(w.motor_rad_s),
                "drive.reaching_per_s" => Some(w.reaching_per_s),
                _ => None,
            },
        };
        axis.own_number(&self.question.subject).or_else(by_rule)
    }

    /// The word that it has there: the value of the axis with which the scenario is what it is.
    fn own_word(&self, axis: &Axis) -> Option<usize> {
        let drive = self.experiment.drive.as_ref()?;
        (0..axis.values.len()).find(|k| {
            let with = self.question.subject.with(&axis.sets(*k));
            with.is_ok_and(|it| it.drive.is_some_and(|other| other.designed == drive.designed))
        })
    }

    /// Where on an axis the file itself is; none beyond its ends.
    fn home(&self, axis: &Axis) -> Option<usize> {
        match &axis.numbers {
            Some(_) => axis.at(self.own_number(axis)?),
            None => self.own_word(axis),
        }
    }

    fn promise(&self, promise: Option<&Promise>, points: &[Judged], home: [Option<usize>; 2]) -> String {
        let axes = [0, 1].map(|i| &self.question.axes[i]);
        let own = axes.map(|axis| self.own_number(axis));
        let Some(ends) = promise else {
            if !points.iter().flatten().any(|point| self.is_good(point)) {
                return String::from("nothing may be promised: no point is good");
            }
            let at = |i: usize| Some(format!("{} = {}", axes[i].key, axes[i].values[home[i]?]));
            let place: Vec<String> = (0..2).filter_map(at).collect();
            return format!(
                "nothing may be promised around the file's own values: no point at {} is good",
                place.join(", ")
            );
        };
        let is_within = |k: usize| {
            // Of a list only what is in it was tried.
            axes[k].numbers.as_ref()?;
            let number = |text: &str| text.parse::<f64>().ok();
            Some((number(&ends[k][0])?..=number(&ends[k][1])?).contains(&own[k]?))
        };
        let outside: Vec<String> = (0..2)
            .filter(|k| is_within(*k) == Some(false))
            .map(|k| format!("{} = {}", axes[k].key, number(own[k].unwrap_or(f64::NAN))))
            .collect();
        let is_around = |k: usize| is_within(k).unwrap_or(axes[k].numbers.is_none() && home[k].is_some());
        let place = if is_around(0) && is_around(1) { " around the file's own values" } else { "" };
        let range = |k: usize| match &ends[k] {
            [only, same] if only == same => format!("{} = {only} alone", axes[k].key),
            // Words have no order but that in which they were given.
            _ if axes[k].numbers.is_none() => {
                let at = |text: &str| axes[k].values.iter().position(|value| value == text).unwrap_or(0);
                format!("{} any of {}", axes[k].key, axes[k].values[at(&ends[k][0])..=at(&ends[k][1])].join(", "))
            }
            [from, to] => format!("{} from {from} to {to}", axes[k].key),
        };
        let told = format!("may be promised{place}: {} with {}", range(0), range(1));
        if outside.is_empty() { told } else { format!("{told}; the file's own {} is not in it", outside.join(", ")) }
    }

    fn csv(&self, points: &[Judged]) -> String {
        let [x, y] = [0, 1].map(|i| &self.question.axes[i]);
        let head = format!(
            "{},{},spectral_radius,decay_per_s,{},unstable_corners,grew,refused",
            x.key,
            y.key,
            self.figure.unwrap_or("figure")
        );
        let places = y.values.iter().flat_map(|y| x.values.iter().map(move |x| format!("{},{}", quoted(x), quoted(y))));
        let rows = places.zip(points).map(|(place, point)| match point {
            Ok(Point { spectral_radius, decay_per_s, figure, unstable_corners, grew, .. }) => {
                let figure = figure.map_or_else(String::new, |value| format!("{value:?}"));
                let grew = grew.map_or_else(String::new, |grew| grew.to_string());
                format!("{place},{spectral_radius:?},{decay_per_s:?},{figure},{unstable_corners},{grew},")
            }
            Err(why) => format!("{place},,,,,,{}", quoted(why)),
        });
        iter::once(head).chain(rows).map(|row| row + "\n").collect()
    }
}

/// How many points are what.
fn census(points: &[Judged], good: &[bool]) -> String {
    let unstable = points.iter().flatten().filter(|point| !point.is_stable()).count();
    let good = good.iter().filter(|good| **good).count();
    let refused: Vec<&String> = points.iter().filter_map(|point| point.as_ref().err()).collect();
    let beyond = points.len() - good - unstable - refused.len();
    let beyond =
        if beyond > 0 { format!(", {beyond} stable but beyond the bar or without a figure") } else { String::new() };
    let refused = refused.first().map_or_else(String::new, |why| {
        let why = why.lines().next().unwrap_or_default();
        format!(", {} without a design (the first: {why})", refused.len())
    });
    format!("{} points: {good} good, {unstable} unstable{beyond}{refused}", points.len())
}

/// A field of a CSV file, on one line.
fn quoted(text: &str) -> String {
    let line = text.trim_end().replace('\n', "; ");
    if line.contains([',', '"']) { format!("\"{}\"", line.replace('"', "\"\"")) } else { line }
}

impl<'a> PointJson<'a> {
    fn of(point: &'a Judged) -> Self {
        match point {
            Ok(point) => Self::Judged(point),
            Err(refused) => Self::Refused { refused },
        }
    }
}

fn cell(point: &Judged) -> Cell {
    match point {
        Err(_) => Cell::Nothing,
        Ok(point) if !point.is_stable() => Cell::Unstable,
        Ok(point) => Cell::Value(point.figure.unwrap_or(point.decay_per_s)),
    }
}

/// Of a figure that there may be none of.
pub(super) fn number(value: f64) -> String {
    if value.is_nan() { "-".into() } else { significant(value, 4) }
}

fn edge(axis: &Axis) -> Edge {
    Edge { label: axis.key.clone(), texts: axis.values.clone(), numbers: axis.numbers.clone(), is_log: axis.is_log }
}
