//! Result of a map: all points, which of them are good, and the guaranteed rectangle.

use serde::{Serialize, Serializer};

use super::{Axis, Judged, Point, Question, widest_rectangle};
use crate::figures::OF_DESIGN;
use crate::{Error, Watch};

/// Metric of a point if no other one is requested.
const DECAY: &str = "decay_per_s";

/// First and last value along each axis.
pub type Promise = [[String; 2]; 2];

/// Result of [`map`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Map {
    /// Name of the scenario.
    pub scenario: String,
    /// Settings `KEY=VALUE` of all points.
    pub sets: Vec<String>,
    /// The axes; none if each point is a corner.
    pub axes: Vec<Axis>,
    /// Name of the metric, or of the decay rate.
    pub figure: String,
    /// Points, row by row from the first; corners from the worst: unstable ones first, then by peak |S|. In JSON a
    /// point without a design is `refused`.
    #[serde(serialize_with = "points")]
    pub points: Vec<Judged>,
    /// Largest rectangle of good points around the values of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promise: Option<Promise>,
    /// Comparison of poles and simulation, if every point was simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulated: Option<Simulated>,
    /// Whether each point is good.
    #[serde(skip)]
    pub good: Vec<bool>,
    /// Guaranteed rectangle as first and last column and row.
    #[serde(skip)]
    pub frame: Option<[usize; 4]>,
    /// Point nearest to the values of the file.
    #[serde(skip)]
    pub home: [Option<usize>; 2],
    /// Values of the file, if they are numbers.
    #[serde(skip)]
    pub own: [Option<f64>; 2],
    /// Keys that change no pole, if no limit was requested; nothing is guaranteed then.
    #[serde(skip)]
    pub unseen: Vec<String>,
}

fn points<S: Serializer>(points: &[Judged], serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    #[serde(untagged)]
    enum PointOrError<'a> {
        Judged(&'a Point),
        Refused { refused: String },
    }
    serializer.collect_seq(points.iter().map(|point| match point {
        Ok(point) => PointOrError::Judged(point),
        Err(why) => PointOrError::Refused { refused: why.to_string() },
    }))
}

/// Comparison of poles and simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Simulated {
    /// Number of points where both agree.
    pub agree: usize,
    /// Number of points where they differ.
    pub differ: usize,
    /// Largest |1 - spectral radius| of the points where they differ.
    pub differ_within: f64,
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
}

/// Computes every point of a grid, or every corner alone if there are no axes; `None` if stopped. A step of the watch
/// is a point.
///
/// # Errors
/// No point has a design, or a corner has none.
pub fn map(question: &Question<'_>, watch: Watch<'_>) -> Result<Option<Map>, Error> {
    if question.axes.is_empty() { list(question, watch) } else { grid(question, watch) }
}

/// Computes each corner alone, worst first: unstable ones by |z|, then the others by their peak of |S|. The slowest
/// pole cannot rank them: a pole of an observer is equal in every corner.
fn list(question: &Question<'_>, watch: Watch<'_>) -> Result<Option<Map>, Error> {
    let Some(judged) = question.each_corner(watch) else { return Ok(None) };
    let mut found = Vec::new();
    for (corner, judged) in question.corners.iter().zip(judged) {
        let failed = |error: Error| Error {
            what: error.to_string(),
            key: corner.name.clone(),
            remedy: String::new(),
            is_input: true,
        };
        found.push(judged.map_err(failed)?);
    }
    let rank = |point: &Point| (point.sensitivity_peak.unwrap_or(f64::INFINITY), point.spectral_radius);
    found.sort_by(|a, b| {
        let ((peak_a, radius_a), (peak_b, radius_b)) = (rank(a), rank(b));
        peak_b.total_cmp(&peak_a).then(radius_b.total_cmp(&radius_a))
    });
    Ok(Some(Map::of(question, found.into_iter().map(Ok).collect())))
}

fn grid(question: &Question<'_>, watch: Watch<'_>) -> Result<Option<Map>, Error> {
    let Some(points) = question.answer(watch) else { return Ok(None) };
    if let (true, Some(Err(why))) = (points.iter().all(Result::is_err), points.first()) {
        let why = why.to_string();
        let why = why.lines().next().unwrap_or_default();
        return Err(Error::input(format!("no point of the map has a valid design; first point: {why}")));
    }
    let mut map = Map::of(question, points);
    map.good = map.points.iter().map(|point| point.as_ref().is_ok_and(|point| question.is_good(point))).collect();
    let [x, y] = [0, 1].map(|i| question.axes.get(i));
    map.own = [x, y].map(|axis| question.own_number(axis?));
    map.home = [x, y].map(|axis| question.home(axis?));
    map.unseen = question.unseen(&map.points);
    if map.unseen.is_empty() {
        map.frame = widest_rectangle(&map.good, question.size()[0], map.home);
    }
    let values = |axis: Option<&Axis>, k: usize| axis.map_or_else(String::new, |axis| axis.values[k].clone());
    map.promise = map
        .frame
        .map(|[first, last, low, high]| [[values(x, first), values(x, last)], [values(y, low), values(y, high)]]);
    Ok(Some(map))
}

impl Map {
    fn of(question: &Question<'_>, points: Vec<Judged>) -> Self {
        Self {
            scenario: question.scenario.clone(),
            sets: question.sets(),
            axes: question.axes.clone(),
            figure: question.figure.clone().unwrap_or_else(|| DECAY.into()),
            simulated: Simulated::of(&points),
            points,
            promise: None,
            good: Vec::new(),
            frame: None,
            home: [None; 2],
            own: [None; 2],
            unseen: Vec::new(),
        }
    }
}

impl Question<'_> {
    /// Returns whether a point is stable and within the limits of the metric.
    pub fn is_good(&self, point: &Point) -> bool {
        let value = point.figure.unwrap_or(f64::NAN);
        // A run that did not finish has no metric. A design may have none either, such as an unlimited margin.
        let is_run = self.figure.as_ref().is_some_and(|figure| !figure.starts_with(OF_DESIGN));
        point.is_stable()
            && !(is_run && value.is_nan())
            && self.at_most.is_none_or(|most| value <= most)
            && self.at_least.is_none_or(|least| value >= least)
    }

    /// Returns the keys that change no pole, if no limit was requested.
    fn unseen(&self, points: &[Judged]) -> Vec<String> {
        let is_asked = self.at_most.is_some() || self.at_least.is_some();
        let [columns, rows] = self.size();
        let poles = |column: usize, row: usize| {
            let point = points[row * columns + column].as_ref().ok()?;
            Some([point.spectral_radius, point.decay_per_s].map(f64::to_bits))
        };
        let moves = [
            (0..rows).any(|row| (1..columns).any(|column| poles(column, row) != poles(0, row))),
            (0..columns).any(|column| (1..rows).any(|row| poles(column, row) != poles(column, 0))),
        ];
        let axes = self.axes.iter().zip(moves);
        // A single value cannot show an effect.
        let unmoved = axes.filter(|(axis, moves)| !moves && axis.values.len() > 1 && !is_asked);
        unmoved.map(|(axis, _)| axis.key.clone()).collect()
    }
}
