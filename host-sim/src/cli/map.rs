//! `host-sim map`: stability and performance of a loop over two keys of its scenario, or in all corners of its plant.
//!
//! A corner is a vertex of the parameter box: every parameter at its lower or upper end.

use std::iter;
use std::path::{Path, PathBuf};

use clap::Args;
use scenario::Experiment;
use study::map::{self, Axis, Judged, Map, MapRequest, Point, Question, Simulated};
use study::number::significant;
use study::{Error, Watch};
use terminal::table::Table;

use super::run::note_changes;
use super::{Console, DEFAULT, Failure, ScenarioText, claim_folder, folder_of, status};
use crate::report::heat::{Cell, Edge, HeatMap};
use crate::report::write_whole;

#[derive(Args, Debug, Default)]
pub(super) struct MapOptions {
    /// Scenario file [default: built-in joint of the paper].
    file: Option<PathBuf>,
    /// Horizontal axis: KEY=FROM..TO, optionally followed by :log and :POINTS, or KEY=A,B,C.
    #[arg(long, value_name = "AXIS", requires = "y", conflicts_with = "preset")]
    x: Option<String>,
    /// Vertical axis, in the format of --x.
    #[arg(long, value_name = "AXIS", requires = "x")]
    y: Option<String>,
    /// Common axes. gain: input gain; rate: period and bandwidth; delay; jitter; plant: inertia against stiffness;
    /// corners: table of all corners at --corners 50.
    #[arg(long, value_name = "NAME", value_parser = presets())]
    preset: Option<String>,
    /// Vary all parameters that are not swept by ±PERCENT. Each point shows the worst of the 2^p corners.
    #[arg(long, value_name = "PERCENT")]
    corners: Option<f64>,
    /// Key of run.json to plot, as metrics.u_peak or design.margins.phase_deg [default: decay rate of the slowest
    /// pole]. All keys except design.* simulate every point.
    #[arg(long, value_name = "KEY")]
    figure: Option<String>,
    /// Count a point as good only if the metric of --figure is <= VALUE.
    #[arg(long, value_name = "VALUE", requires = "figure", conflicts_with = "at_least")]
    at_most: Option<f64>,
    /// Count a point as good only if the metric of --figure is >= VALUE.
    #[arg(long, value_name = "VALUE", requires = "figure")]
    at_least: Option<f64>,
    /// Also simulate every point and count the disagreements with the poles.
    #[arg(long)]
    simulate: bool,
    /// Override a key of the scenario; repeatable. Example: --set drive.period_s=5e-4 for a motor or joint, --set
    /// controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Output folder of map.svg and map.csv, with the feature png also map.png [default: out/SCENARIO-map].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the text.
    #[arg(long)]
    json: bool,
}

fn presets() -> clap::builder::PossibleValuesParser {
    presets_or(map::CORNERS)
}

/// Returns the parser of the presets with axes, and of one word more.
pub(super) fn presets_or(word: &'static str) -> clap::builder::PossibleValuesParser {
    map::presets().chain([word]).collect::<Vec<_>>().into()
}

impl MapOptions {
    /// Returns the options of a preset.
    pub(super) fn of_preset(file: Option<&Path>, preset: &str, sets: &[String]) -> Self {
        Self { file: file.map(Path::to_path_buf), preset: Some(preset.into()), sets: sets.to_vec(), ..Self::default() }
    }
}

/// Formats the agreement of poles and simulation.
fn agreement(simulated: Simulated) -> String {
    let Simulated { agree, differ, differ_within } = simulated;
    let told = format!("simulation agrees at {agree} of {} points", agree + differ);
    if differ == 0 { told } else { format!("{told}; elsewhere |1 - spectral radius| <= {differ_within:.1e}") }
}

impl MapOptions {
    fn request(&self) -> MapRequest<'_> {
        MapRequest {
            x: self.x.as_deref(),
            y: self.y.as_deref(),
            preset: self.preset.as_deref(),
            corners: self.corners,
            figure: self.figure.as_deref(),
            at_most: self.at_most,
            at_least: self.at_least,
            simulate: self.simulate,
        }
    }
}

impl Console<'_> {
    pub(super) fn map(&mut self, options: &MapOptions) -> Result<u8, Failure> {
        self.with_view(options, |console, view| {
            if view.question.axes.is_empty() {
                console.list_corners(view, options.json)
            } else {
                console.draw_map(view, options)
            }
        })
    }

    /// Builds the question of the options and passes it to `then`.
    pub(super) fn with_view<T>(
        &mut self,
        options: &MapOptions,
        then: impl FnOnce(&mut Self, &View<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        let subject = text.subject(&options.sets);
        let question = Question::new(subject, &options.request())?;
        let mut experiment = subject.with(&[])?;
        note_changes(&mut experiment.title, &question.sets());
        then(self, &View { question: &question, experiment: &experiment })
    }

    /// Analyses each corner, worst first; `None` if interrupted.
    pub(super) fn judged_corners(&mut self, view: &View<'_>) -> Result<Option<Map>, Failure> {
        Ok(study::map(view.question, Watch::new(self.stop, &|| ()))?)
    }

    fn list_corners(&mut self, view: &View<'_>, json: bool) -> Result<u8, Failure> {
        let View { question, experiment } = *view;
        let Some(map) = self.judged_corners(view)? else { return Ok(status::INTERRUPTED) };
        if json {
            self.say_json(serde_json::to_string(&map))?;
            return Ok(status::DONE);
        }
        self.say(&format!("{}\n{}", experiment.headline(), view.count(&map)))?;
        let mut table = Table::new(
            ["corner", "peak |S|", "slowest |z|", "decay rate (1/s)"].into_iter().chain(question.figure.as_deref()),
        );
        for point in map.points.iter().flatten() {
            let corner = point.worst.clone().unwrap_or_default();
            let figure = point.figure.iter().map(|value| number(*value));
            // The pole of the offset W is left out: it may be slower, and it is equal in every corner.
            let radius = format!("{:.6}", libm::exp(-point.decay_per_s * experiment.period_s));
            let peak = point.sensitivity_peak.map_or_else(|| "UNSTABLE".into(), |peak| significant(peak, 3));
            let cells: Vec<String> =
                [corner, peak, radius, number(point.decay_per_s)].into_iter().chain(figure).collect();
            table.row(cells.iter().map(String::as_str));
        }
        self.say(&table.to_string())?;
        map.simulated.map_or(Ok(()), |simulated| self.say(&agreement(simulated)))?;
        self.say(&format!("result: {}", view.count(&map)))?;
        Ok(status::DONE)
    }

    /// Analyses every point of the map; `None` if interrupted.
    pub(super) fn answered(&mut self, view: &View<'_>) -> Result<Option<Map>, Failure> {
        let [columns, rows] = view.question.size();
        let bar =
            self.bar((columns * rows) as u64, "{bar:40} {percent:>3} %  {rate} points/s  {elapsed} / {left} left");
        let found = study::map(view.question, Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        Ok(found?)
    }

    fn draw_map(&mut self, view: &View<'_>, options: &MapOptions) -> Result<u8, Failure> {
        let experiment = view.experiment;
        let folder = folder_of(options.out.as_ref(), &experiment.name, "map");
        let claim = claim_folder(&folder)?;
        let Some(map) = self.answered(view)? else { return Ok(status::INTERRUPTED) };
        let failed = |error| Failure::writing(folder.join("map").display(), &error);
        if options.json {
            self.say_json(serde_json::to_string(&map))?;
        } else {
            self.say(&experiment.headline())?;
            self.say(&census(&map.points, &map.good))?;
            map.simulated.map_or(Ok(()), |simulated| self.say(&agreement(simulated)))?;
        }
        let csv = view.csv(&map);
        write_whole(&folder.join("map.csv"), |out| out.write_all(csv.as_bytes())).map_err(failed)?;
        view.drawn(&map).write(&folder, "map").map_err(failed)?;
        drop(claim);
        if !options.json {
            self.say(&format!("files: {}", folder.display()))?;
            self.say(&format!("result: {}", promise(&map)))?;
        }
        Ok(status::DONE)
    }
}

/// Label of the colour scale without `--figure`.
const DECAY_LABEL: &str = "decay rate of the slowest pole (1/s)";

/// A question with its scenario, whose title contains the changes.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    question: &'a Question<'a>,
    experiment: &'a Experiment,
}

impl View<'_> {
    /// Returns the number of unstable corners as text.
    pub(super) fn count(&self, map: &Map) -> String {
        let unstable = map.points.iter().flatten().filter(|point| !point.is_stable()).count();
        let percent = self.question.percent.unwrap_or_default();
        format!("{unstable} of {} corners at {percent} % are unstable", map.points.len())
    }

    pub(super) fn drawn(&self, map: &Map) -> HeatMap {
        let [x, y] = [0, 1].map(|i| edge(&map.axes[i]));
        let place = |edge: &Edge, i: usize| Some(edge.place(map.own[i]?).unwrap_or(edge.middle(map.home[i]?)));
        let mark = place(&x, 0).zip(place(&y, 1)).map(<[f64; 2]>::from);
        HeatMap {
            title: self.title(),
            label: self.question.figure.clone().unwrap_or_else(|| DECAY_LABEL.into()),
            x,
            y,
            cells: map.points.iter().map(cell).collect(),
            good: map.good.clone(),
            frame: map.frame,
            mark,
        }
    }

    fn title(&self) -> String {
        let worst = self.question.percent.map_or_else(String::new, |percent| {
            format!(", worst of {} corners at ±{percent} %", self.question.corners.len())
        });
        let bar = match (self.question.at_most, self.question.at_least) {
            (Some(most), _) => format!(", good if <= {most}"),
            (_, Some(least)) => format!(", good if >= {least}"),
            _ => String::new(),
        };
        format!(
            "{}: {}{worst}{bar}",
            self.experiment.title,
            self.question.figure.as_deref().unwrap_or("decay rate of the slowest pole")
        )
    }

    fn csv(&self, map: &Map) -> String {
        let [x, y] = [0, 1].map(|i| &map.axes[i]);
        let head = format!(
            "{},{},spectral_radius,decay_per_s,{},unstable_corners,grew,refused",
            x.key,
            y.key,
            self.question.figure.as_deref().unwrap_or("figure")
        );
        let places = y.values.iter().flat_map(|y| x.values.iter().map(move |x| format!("{},{}", quoted(x), quoted(y))));
        let rows = places.zip(&map.points).map(|(place, point)| match point {
            Ok(Point { spectral_radius, decay_per_s, figure, unstable_corners, grew, .. }) => {
                let figure = figure.map_or_else(String::new, |value| format!("{value:?}"));
                let grew = grew.map_or_else(String::new, |grew| grew.to_string());
                format!("{place},{spectral_radius:?},{decay_per_s:?},{figure},{unstable_corners},{grew},")
            }
            Err(why) => format!("{place},,,,,,{}", quoted(&why.to_string())),
        });
        iter::once(head).chain(rows).map(|row| row + "\n").collect()
    }
}

/// Returns the lines of a map: numbers of points, guaranteed tolerance, agreement with the simulation.
pub(super) fn lines(map: &Map) -> Vec<String> {
    let lines = [census(&map.points, &map.good), promise(map)];
    lines.into_iter().chain(map.simulated.map(agreement)).collect()
}

/// Formats the guaranteed tolerance: the largest rectangle of good points around the values of the file.
fn promise(map: &Map) -> String {
    if !map.unseen.is_empty() {
        return format!(
            "no guaranteed tolerance: {} moves no linearised pole; use --figure with --at-most or --at-least",
            map.unseen.join(" or ")
        );
    }
    let (axes, own, home) = ([0, 1].map(|i| &map.axes[i]), map.own, map.home);
    let Some(ends) = &map.promise else {
        if !map.good.contains(&true) {
            return String::from("no guaranteed tolerance: no point is good");
        }
        let at = |i: usize| Some(format!("{} = {}", axes[i].key, axes[i].values[home[i]?]));
        let place: Vec<String> = (0..2).filter_map(at).collect();
        return format!(
            "no guaranteed tolerance around the values of the file: no point at {} is good",
            place.join(", ")
        );
    };
    let is_within = |k: usize| {
        // A list was evaluated at its entries only.
        axes[k].numbers.as_ref()?;
        let number = |text: &str| text.parse::<f64>().ok();
        Some((number(&ends[k][0])?..=number(&ends[k][1])?).contains(&own[k]?))
    };
    let outside: Vec<String> = (0..2)
        .filter(|k| is_within(*k) == Some(false))
        .map(|k| format!("{} = {}", axes[k].key, number(own[k].unwrap_or(f64::NAN))))
        .collect();
    let is_around = |k: usize| is_within(k).unwrap_or(axes[k].numbers.is_none() && home[k].is_some());
    let place = if is_around(0) && is_around(1) { " around the values of the file" } else { "" };
    let range = |k: usize| match &ends[k] {
        [only, same] if only == same => format!("{} = {only} only", axes[k].key),
        // Words have only the order in which they were given.
        _ if axes[k].numbers.is_none() => {
            let at = |text: &str| axes[k].values.iter().position(|value| value == text).unwrap_or(0);
            format!("{} any of {}", axes[k].key, axes[k].values[at(&ends[k][0])..=at(&ends[k][1])].join(", "))
        }
        [from, to] => format!("{} from {from} to {to}", axes[k].key),
    };
    let told = format!("guaranteed tolerance{place}: {} with {}", range(0), range(1));
    if outside.is_empty() { told } else { format!("{told}; the file has {}, outside this range", outside.join(", ")) }
}

/// Formats the numbers of good, unstable and other points.
fn census(points: &[Judged], good: &[bool]) -> String {
    let unstable = points.iter().flatten().filter(|point| !point.is_stable()).count();
    let good = good.iter().filter(|good| **good).count();
    let refused: Vec<&Error> = points.iter().filter_map(|point| point.as_ref().err()).collect();
    let beyond = points.len() - good - unstable - refused.len();
    let beyond =
        if beyond > 0 { format!(", {beyond} stable but outside the limit or without a value") } else { String::new() };
    let refused = refused.first().map_or_else(String::new, |why| {
        let why = why.to_string();
        let why = why.lines().next().unwrap_or_default();
        format!(", {} without a design (first: {why})", refused.len())
    });
    format!("{} points: {good} good, {unstable} unstable{beyond}{refused}", points.len())
}

/// Formats a field of a CSV file on one line.
fn quoted(text: &str) -> String {
    let line = text.trim_end().replace('\n', "; ");
    if line.contains([',', '"']) { format!("\"{}\"", line.replace('"', "\"\"")) } else { line }
}

fn cell(point: &Judged) -> Cell {
    match point {
        Err(_) => Cell::Nothing,
        Ok(point) if !point.is_stable() => Cell::Unstable,
        Ok(point) => Cell::Value(point.figure.unwrap_or(point.decay_per_s)),
    }
}

/// Formats a metric with four digits; `-` without a value.
pub(super) fn number(value: f64) -> String {
    if value.is_nan() { "-".into() } else { significant(value, 4) }
}

fn edge(axis: &Axis) -> Edge {
    Edge { label: axis.key.clone(), texts: axis.values.clone(), numbers: axis.numbers.clone(), is_log: axis.is_log }
}
