//! `host-sim map`: where a loop is stable, and how good, over two keys of its scenario or all corners of its plant.

use std::iter;
use std::path::{Path, PathBuf};

use clap::Args;
use scenario::Experiment;
use study::map::{self, Asked, Axis, Judged, Map, Point, Question, Simulated};
use study::number::significant;
use study::{Error, Watch};
use terminal::table::Table;

use super::run::note_changes;
use super::{Console, DEFAULT, Failure, ScenarioText, claim_folder, folder_of, status};
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

fn presets() -> clap::builder::PossibleValuesParser {
    presets_or(map::CORNERS)
}

/// Those with axes, or this word.
pub(super) fn presets_or(word: &'static str) -> clap::builder::PossibleValuesParser {
    map::presets().chain([word]).collect::<Vec<_>>().into()
}

impl MapOptions {
    /// One of the presets.
    pub(super) fn of_preset(file: Option<&Path>, preset: &str, sets: &[String]) -> Self {
        Self { file: file.map(Path::to_path_buf), preset: Some(preset.into()), sets: sets.to_vec(), ..Self::default() }
    }
}

/// How poles and simulation agree.
fn agreement(simulated: Simulated) -> String {
    let Simulated { agree, differ, differ_within } = simulated;
    let told = format!("simulation agrees at {agree} of {} points", agree + differ);
    if differ == 0 { told } else { format!("{told}; at the others |1 - radius| <= {differ_within:.1e}") }
}

impl MapOptions {
    fn asked(&self) -> Asked<'_> {
        Asked {
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

    /// What the options ask for, ready to be answered.
    pub(super) fn with_view<T>(
        &mut self,
        options: &MapOptions,
        then: impl FnOnce(&mut Self, &View<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        let subject = text.subject(&options.sets);
        let question = Question::new(subject, &options.asked())?;
        let mut experiment = subject.with(&[])?;
        note_changes(&mut experiment.title, &question.sets());
        then(self, &View { question: &question, experiment: &experiment })
    }

    /// Each corner by itself, the worst first; none if it was told to stop.
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
        let mut table =
            Table::new(["corner", "slowest |z|", "its decay (1/s)"].into_iter().chain(question.figure.as_deref()));
        for point in map.points.iter().flatten() {
            let corner = point.worst.clone().unwrap_or_default();
            let figure = point.figure.iter().map(|value| number(*value));
            // Of that pole, and not of the offset W, whose own may be slower and is the same in every corner.
            let radius = format!("{:.6}", libm::exp(-point.decay_per_s * experiment.period_s));
            let cells: Vec<String> = [corner, radius, number(point.decay_per_s)].into_iter().chain(figure).collect();
            table.row(cells.iter().map(String::as_str));
        }
        self.say(&table.to_string())?;
        map.simulated.map_or(Ok(()), |simulated| self.say(&agreement(simulated)))?;
        Ok(status::DONE)
    }

    /// Every point of the map; none if it was told to stop.
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
            for line in lines(&map) {
                self.say(&line)?;
            }
        }
        let csv = view.csv(&map);
        write_whole(&folder.join("map.csv"), |out| out.write_all(csv.as_bytes())).map_err(failed)?;
        view.drawn(&map).write(&folder, "map").map_err(failed)?;
        drop(claim);
        if !options.json {
            self.say(&format!("written to {}", folder.display()))?;
        }
        Ok(status::DONE)
    }
}

/// What is coloured if nothing else is asked for.
const DECAY_LABEL: &str = "decay of the slowest pole (1/s)";

/// A question and the scenario that it is of, with its changes in the title.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    question: &'a Question<'a>,
    experiment: &'a Experiment,
}

impl View<'_> {
    /// How many corners are unstable.
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
            format!(", the worst of {} corners at {percent} %", self.question.corners.len())
        });
        let bar = match (self.question.at_most, self.question.at_least) {
            (Some(most), _) => format!(", good up to {most}"),
            (_, Some(least)) => format!(", good from {least}"),
            _ => String::new(),
        };
        format!(
            "{}: {}{worst}{bar}",
            self.experiment.title,
            self.question.figure.as_deref().unwrap_or("decay of the slowest pole")
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

/// What is said of a map.
pub(super) fn lines(map: &Map) -> Vec<String> {
    let lines = [census(&map.points, &map.good), promise(map)];
    lines.into_iter().chain(map.simulated.map(agreement)).collect()
}

fn promise(map: &Map) -> String {
    if !map.unseen.is_empty() {
        return format!(
            "nothing is promised: no pole of the loop at rest moves with {}; judge it by --figure with a bar",
            map.unseen.join(" or ")
        );
    }
    let (axes, own, home) = ([0, 1].map(|i| &map.axes[i]), map.own, map.home);
    let Some(ends) = &map.promise else {
        if !map.good.contains(&true) {
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

/// How many points are what.
fn census(points: &[Judged], good: &[bool]) -> String {
    let unstable = points.iter().flatten().filter(|point| !point.is_stable()).count();
    let good = good.iter().filter(|good| **good).count();
    let refused: Vec<&Error> = points.iter().filter_map(|point| point.as_ref().err()).collect();
    let beyond = points.len() - good - unstable - refused.len();
    let beyond =
        if beyond > 0 { format!(", {beyond} stable but beyond the bar or without a figure") } else { String::new() };
    let refused = refused.first().map_or_else(String::new, |why| {
        let why = why.to_string();
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
