//! Resolves a scenario: fills in defaults and checks every rule that a schema cannot express.

use controller_core::{
    AnyConfig, Benchmark, Config, Fallback, JointChain, JointParameters, Limits, Nominal, ObserverGains, Options, Pole,
    ReachingLaw, Reading, SampleLimits, Surface,
};
use loop_sim::MAX_ORDER;
use loop_sim::port::baseline::BaselineSpec;
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, padded};
use loop_sim::signal::Term;

use super::error::shown;
use super::own::{self, Formulas};
use super::{
    ActuatorTable, ControllerKind, ControllerTable, DriftKey, ExpKey, FallbackKey, GainKey, NominalTable,
    ObserverTable, ParametersTable, PlantKind, PlantTable, PrecisionKey, ReadingKey, SamplesTable, Scenario,
    SensorTable, TermKind, TermTable,
};

/// Largest number of ticks of one run. A tick is kept to the end with some 200 bytes, and written as a line.
const MOST_TICKS: f64 = 2e6;

/// Broken rule: the key and the message.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) key: String,
    pub(super) message: String,
}

impl Problem {
    /// Returns true if the problem is a missing key.
    pub(super) fn is_missing(&self) -> bool {
        self.message.starts_with(MISSING)
    }
}

/// Prefix of the message for a missing key.
const MISSING: &str = "missing:";

/// Problems found so far. One problem does not end the search, so that all are reported in one pass.
#[derive(Debug, Default)]
pub(super) struct Problems(pub(super) Vec<Problem>);

impl Problems {
    pub(super) fn take<T>(&mut self, result: Result<T, Problem>) -> Option<T> {
        result.map_err(|problem| self.0.push(problem)).ok()
    }
}

pub(super) fn problem<T>(key: impl Into<String>, message: impl Into<String>) -> Result<T, Problem> {
    Err(Problem { key: key.into(), message: message.into() })
}

/// Scenario with all defaults filled in.
#[derive(Debug)]
pub(super) struct Resolved {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) span_s: f64,
    pub(super) periods: usize,
    pub(super) window_s: [f64; 2],
    pub(super) x0: Vec<f64>,
    pub(super) plant: PlantChoice,
    /// Terms of d_i per channel, length n.
    pub(super) disturbance: Vec<Vec<Term>>,
    pub(super) controller: ControllerChoice,
    /// Position of the observer of each channel in the list of the file, from 1; `None` for a default observer.
    pub(super) observer_position: Vec<Option<usize>>,
    /// Remaining keys, used as they are.
    pub(super) file: Scenario,
}

#[derive(Clone, Debug)]
pub(super) enum PlantChoice {
    FlexibleJoint { chain: JointChain, input_disturbance: Vec<Term> },
    Benchmark { state_dependent: bool },
    Chain { a: Vec<f64>, b: f64, nominal_a: Vec<f64>, nominal_b: f64 },
    Own(Formulas),
}

#[derive(Debug)]
pub(super) enum ControllerChoice {
    Proposed(Box<ControllerSpec>),
    Baseline(BaselineSpec),
}

/// Keys that are valid for some kinds only: (keys, selecting key, kinds).
const FOREIGN: [(&[&str], &str, &[&str]); 7] = [
    (
        &["plant.reading", "plant.parameters", "plant.error", "plant.input_disturbance"],
        "plant.kind",
        &["flexible_joint"],
    ),
    (&["plant.state_dependent", "controller.exp"], "plant.kind", &["benchmark"]),
    (&["plant.order", "plant.a", "plant.b"], "plant.kind", &["chain"]),
    (&["plant.rates", "plant.constants", "controller.nominal.constants"], "plant.kind", &["own"]),
    (&["controller.nominal"], "plant.kind", &["chain", "own"]),
    (&["controller.k"], "controller.kind", &["baseline"]),
    (
        &[
            "controller.precision",
            "controller.surface_bandwidth_rad_s",
            "controller.alpha_per_s",
            "controller.k_l",
            "controller.k_s",
            "controller.epsilon",
            "controller.use_slope",
            "controller.use_gradient",
            "controller.lambda_per_s",
            "controller.limits",
            "controller.fallback",
            "controller.samples",
            "controller.initial_estimates",
            "controller.sigma_star_bound",
            "controller.observer_pole_limit",
            "controller.exp",
        ],
        "controller.kind",
        &["proposed"],
    ),
];

impl PlantKind {
    const fn word(self) -> &'static str {
        match self {
            Self::FlexibleJoint => "flexible_joint",
            Self::Benchmark => "benchmark",
            Self::Chain => "chain",
            Self::Own => "own",
        }
    }
}

impl ControllerKind {
    const fn word(self) -> &'static str {
        match self {
            Self::Proposed => "proposed",
            Self::Baseline => "baseline",
        }
    }
}

/// Returns a problem for each key that the selected kind does not use. `is_given`: the key is set; `by_set`: it is set
/// by `--set`. If `--set` selects another kind than the file, the problem refers to the argument.
pub(super) fn foreign_keys(
    scenario: &Scenario,
    is_given: &dyn Fn(&str) -> bool,
    by_set: &dyn Fn(&str) -> bool,
) -> Problems {
    let mut problems = Vec::new();
    for (keys, selector, wanted) in FOREIGN {
        let only = wanted.iter().map(|kind| format!("{kind:?}")).collect::<Vec<_>>().join(" or ");
        let chosen =
            if selector == "plant.kind" { scenario.plant.kind.word() } else { scenario.controller.kind.word() };
        let given = keys.iter().filter(|key| !wanted.contains(&chosen) && is_given(key));
        let (of_file, own): (Vec<&str>, Vec<&str>) = given.partition(|key| by_set(selector) && !by_set(key));
        problems.extend(own.into_iter().map(|key| Problem {
            key: key.into(),
            message: format!("only for {selector} = {only}, but {selector} is {chosen:?}"),
        }));
        if !of_file.is_empty() {
            let message = format!(
                "found {chosen:?}, but the file sets `{}`, only for {only}: start from a file without these keys",
                of_file.join("`, `")
            );
            problems.push(Problem { key: selector.into(), message });
        }
    }
    problems.extend(unread_parameters(scenario));
    Problems(problems)
}

/// Returns a problem for each parameter of the joint that the reading does not use.
fn unread_parameters(scenario: &Scenario) -> Vec<Problem> {
    let ParametersTable { kt, j11, j12, b11, b12, ks } = scenario.plant.parameters;
    let given = [("kt", kt), ("j11", j11), ("j12", j12), ("b11", b11), ("b12", b12), ("ks", ks)];
    let is_read = |name: &str, by: ReadingKey| {
        let mut other = JointParameters::TABLE_I;
        let JointParameters { kt, j11, j12, b11, b12, ks } = &mut other;
        *match name {
            "kt" => kt,
            "j11" => j11,
            "j12" => j12,
            "b11" => b11,
            "b12" => b12,
            _ => ks,
        } *= 2.0;
        other.chain(reading(by)) != JointParameters::TABLE_I.chain(reading(by))
    };
    let chosen = scenario.plant.reading;
    let unread = given.into_iter().filter(|(name, value)| value.is_some() && !is_read(name, chosen));
    let told = unread.map(|(name, _)| {
        let message = format!("the reading {:?} does not use it: leave it out", chosen.word());
        Problem { key: format!("plant.parameters.{name}"), message }
    });
    if scenario.plant.kind == PlantKind::FlexibleJoint { told.collect() } else { Vec::new() }
}

/// Returns the parameters of the joint. The readings for the paper's figures require Table I, because their input gain
/// is not physical.
fn joint_parameters(plant: &PlantTable, problems: &mut Problems) -> JointParameters {
    let (given, table) = (parameters(&plant.parameters), JointParameters::TABLE_I);
    let pairs = [
        ("kt", given.kt, table.kt),
        ("j11", given.j11, table.j11),
        ("j12", given.j12, table.j12),
        ("b11", given.b11, table.b11),
        ("b12", given.b12, table.b12),
        ("ks", given.ks, table.ks),
    ];
    // Parameters that the reading does not use are reported elsewhere.
    let is_used = |name: &str| name != "b11" || plant.reading != ReadingKey::Reconstructed;
    let others = pairs.into_iter().filter(|(name, given, table)| given != table && is_used(name));
    for (name, given, table) in others.filter(|_| plant.reading != ReadingKey::Physical) {
        let message = format!(
            "found {}, but the reading {:?} only reproduces the paper's figures, with the {} of Table I, and its input \
             gain is not physical: set plant.reading = \"physical\", or begin with `host-sim new NAME --plant joint`",
            shown(given),
            plant.reading.word(),
            shown(table),
        );
        problems.take::<()>(problem(format!("plant.parameters.{name}"), message));
    }
    given
}

/// Fills in the defaults and checks every rule.
pub(super) fn resolve(file: Scenario, default_name: &str, mut problems: Problems) -> Result<Resolved, Problems> {
    let Scenario { plant, controller, sensor, actuator, .. } = &file;
    let name = problems.take(name(file.name.as_deref(), default_name));
    let n = problems.take(order(plant)).unwrap_or_else(|| likely_order(plant, controller));
    let periods = problems.take(periods(file.span_s, controller.period_s));
    // The default window is valid if the span is.
    let window_s = match (periods, file.window_s) {
        (None, None) => None,
        _ => problems.take(window(file.window_s, file.span_s, controller.period_s)),
    };

    if let Some(x0) = &plant.x0 {
        problems.take(of_length(x0, n, "plant.x0"));
    }
    let x0 = plant.x0.clone().or(plant.kind.printed().map(|printed| printed.x0.to_vec()));
    let x0 = x0.unwrap_or_else(|| vec![0.0; n]);
    sensor_lengths(sensor, n, &mut problems);
    problems.take(actuator_limits(actuator));

    let disturbance = disturbance(plant, n, &mut problems);
    let choice = plant_choice(plant, controller, n, &mut problems);
    let (gains, observer_position) = observers(controller, plant.kind, n, &mut problems);
    let (choice, nominal) = choice.unzip();
    let controller = match controller.kind {
        ControllerKind::Proposed => proposed(controller, plant.kind, n, nominal, &gains, &mut problems)
            .map(|spec| ControllerChoice::Proposed(Box::new(spec))),
        ControllerKind::Baseline => {
            baseline(controller, plant.kind, &gains, &mut problems).map(ControllerChoice::Baseline)
        }
    };
    let title = problems.take(title(file.title.as_deref().or(name.as_deref())));
    match (name, title, periods, window_s, choice, controller) {
        (Some(name), Some(title), Some(periods), Some(window_s), Some(plant), Some(controller))
            if problems.0.is_empty() =>
        {
            Ok(Resolved {
                name,
                title,
                span_s: file.span_s,
                periods,
                window_s,
                x0,
                plant,
                disturbance,
                controller,
                observer_position,
                file,
            })
        }
        _ => Err(problems),
    }
}

/// Returns the order for the check of list lengths if the plant gives none.
fn likely_order(plant: &PlantTable, controller: &ControllerTable) -> usize {
    let lists = [&plant.a, &plant.x0, &controller.c];
    lists.into_iter().flatten().next().map_or(MAX_ORDER, Vec::len)
}

fn actuator_limits(actuator: &ActuatorTable) -> Result<(), Problem> {
    let (min, max) = (actuator.min.unwrap_or(f64::NEG_INFINITY), actuator.max.unwrap_or(f64::INFINITY));
    if min <= max {
        return Ok(());
    }
    let message = format!("found {} above actuator.max = {}: the limits are reversed", shown(min), shown(max));
    problem("actuator.min", message)
}

/// Checks the name. It is also the name of the output folder, so it must not contain a path.
pub(super) fn name(given: Option<&str>, default_name: &str) -> Result<String, Problem> {
    match given {
        Some(name) if is_file_name(name) => Ok(name.into()),
        Some(name) => problem(
            "name",
            format!("found {name:?}, expected 1 to 64 letters, digits, `_`, `-` or `.`, not beginning with `.`"),
        ),
        None => {
            let mut name: String = default_name.chars().take(64).map(|c| if is_safe(c) { c } else { '_' }).collect();
            if !is_file_name(&name) {
                name = "scenario".into();
            }
            Ok(name)
        }
    }
}

/// Checks the title. It is printed to terminals and in figures.
pub(super) fn title(given: Option<&str>) -> Result<String, Problem> {
    let title = given.unwrap_or_default();
    if title.chars().any(char::is_control) || title.chars().count() > 200 {
        return problem("title", "expected one line of at most 200 characters, without control characters");
    }
    Ok(title.into())
}

const fn is_safe(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.')
}

/// Returns true for a valid name of a scenario.
pub(super) fn is_file_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && !name.starts_with('.') && name.chars().all(is_safe)
}

fn order(plant: &PlantTable) -> Result<usize, Problem> {
    match (plant.kind, plant.order) {
        (PlantKind::FlexibleJoint, _) => Ok(4),
        (PlantKind::Benchmark, _) => Ok(2),
        (PlantKind::Chain, Some(n)) => Ok(n),
        (PlantKind::Chain, None) => missing("plant.order", "the order n of the chain, 2 to 6"),
        (PlantKind::Own, _) => match &plant.rates {
            Some(rates) => Ok(rates.len()),
            None => missing("plant.rates", "x_1' .. x_n' of the plant, each a formula of x1 .. xn, u, t, constants"),
        },
    }
}

pub(super) fn missing<T>(key: &str, what: &str) -> Result<T, Problem> {
    problem(key, format!("{MISSING} {what}"))
}

pub(super) fn of_length(list: &[f64], n: usize, key: &str) -> Result<(), Problem> {
    if list.len() == n {
        return Ok(());
    }
    problem(key, format!("found a list of {}, expected {n} numbers, one per state of this plant", list.len()))
}

pub(super) fn periods(span_s: f64, period_s: f64) -> Result<usize, Problem> {
    let ticks = (span_s / period_s).round();
    let (span, period) = (shown(span_s), shown(period_s));
    if ticks < 1.0 {
        return problem("span_s", format!("found {span} s, shorter than one period of {period} s"));
    }
    if ticks > MOST_TICKS {
        let ticks = shown(ticks);
        let message =
            format!("found {span} s, that is {ticks} ticks of {period} s; expected at most {MOST_TICKS} ticks");
        return problem("span_s", message);
    }
    Ok(ticks as usize)
}

pub(super) fn window(given: Option<[f64; 2]>, span_s: f64, period_s: f64) -> Result<[f64; 2], Problem> {
    let [from, to] = given.unwrap_or([span_s / 2.0, span_s]);
    // Half a tick of slack, as in the metrics.
    let inside = from >= 0.0 && to <= span_s + 0.5 * period_s;
    let refused = |why: &str| problem("window_s", format!("found [{}, {}], {why}", shown(from), shown(to)));
    if from >= to {
        return refused("expected [from, to] with from before to");
    }
    if !inside {
        return refused(&format!("expected a part of the span [0, {}]", shown(span_s)));
    }
    if to - from < period_s {
        return refused(&format!("shorter than one period of {} s", shown(period_s)));
    }
    Ok([from, to])
}

fn sensor_lengths(sensor: &SensorTable, n: usize, problems: &mut Problems) {
    for (list, key) in [(&sensor.noise, "sensor.noise"), (&sensor.quantum, "sensor.quantum")] {
        if let Some(list) = list {
            problems.take(of_length(list, n, key));
        }
    }
}

fn disturbance(plant: &PlantTable, n: usize, problems: &mut Problems) -> Vec<Vec<Term>> {
    let mut channels = vec![Vec::new(); n];
    for (k, table) in plant.disturbance.iter().enumerate() {
        let key = format!("plant.disturbance[{}]", k + 1);
        let at = format!("{key}.terms");
        let terms = if table.terms.is_empty() {
            problems.take(missing(&at, "the terms of the disturbance"))
        } else {
            terms(&table.terms, &at, problems)
        };
        let Some(channel) = problems.take(channel(table.channel, n, &key)) else { continue };
        if channels[channel - 1].is_empty() {
            channels[channel - 1] = terms.unwrap_or_default();
        } else {
            problems.take::<()>(problem(
                format!("{key}.channel"),
                format!("channel {channel} has a disturbance already: put all its terms into one table"),
            ));
        }
    }
    channels
}

fn channel(given: Option<usize>, n: usize, key: &str) -> Result<usize, Problem> {
    match given {
        Some(channel) if channel <= n => Ok(channel),
        Some(channel) => {
            problem(format!("{key}.channel"), format!("found {channel}, expected a channel of this plant, 1 to {n}"))
        }
        None => missing(&format!("{key}.channel"), &format!("the channel, 1 to {n}")),
    }
}

/// Returns all terms, or `None` if one is wrong.
pub(super) fn terms(list: &[TermTable], key: &str, problems: &mut Problems) -> Option<Vec<Term>> {
    let each = list.iter().enumerate().map(|(k, table)| problems.take(term(table, &format!("{key}[{}]", k + 1))));
    // Collected first, so that all wrong terms are reported.
    each.collect::<Vec<_>>().into_iter().collect()
}

fn term(table: &TermTable, key: &str) -> Result<Term, Problem> {
    let Some(kind) = table.kind else {
        return missing(&format!("{key}.kind"), "const, ramp, sin, cos or step");
    };
    let (word, needed, optional): (_, &[&str], &[&str]) = match kind {
        TermKind::Const => ("const", &["amplitude"], &[]),
        TermKind::Ramp => ("ramp", &["slope"], &[]),
        TermKind::Sin => ("sin", &["amplitude", "omega_rad_s"], &["phase_rad"]),
        TermKind::Cos => ("cos", &["amplitude", "omega_rad_s"], &["phase_rad"]),
        TermKind::Step => ("step", &["amplitude", "t0_s"], &[]),
    };
    let given = [
        ("amplitude", table.amplitude),
        ("slope", table.slope),
        ("omega_rad_s", table.omega_rad_s),
        ("phase_rad", table.phase_rad),
        ("t0_s", table.t0_s),
    ];
    for (name, value) in given {
        if value.is_some() && !needed.contains(&name) && !optional.contains(&name) {
            let known = [needed, optional].concat().join(", ");
            return problem(format!("{key}.{name}"), format!("a {word:?} term has no such key; it has {known}"));
        }
        if value.is_none() && needed.contains(&name) {
            return problem(format!("{key}.{name}"), format!("{MISSING} a {word:?} term needs it"));
        }
    }
    // Required values are present from here on.
    let amplitude = table.amplitude.unwrap_or(0.0);
    let omega_rad_s = table.omega_rad_s.unwrap_or(0.0);
    let phase_rad = table.phase_rad.unwrap_or(0.0);
    Ok(match kind {
        TermKind::Const => Term::Const { amplitude },
        TermKind::Ramp => Term::Ramp { slope: table.slope.unwrap_or(0.0) },
        TermKind::Sin => Term::Sin { amplitude, omega_rad_s, phase_rad },
        TermKind::Cos => Term::Cos { amplitude, omega_rad_s, phase_rad },
        TermKind::Step => Term::Step { amplitude, t0_s: table.t0_s.unwrap_or(0.0) },
    })
}

/// The controller's model of channel n.
pub(super) struct NominalChannel {
    pub(super) model: Model,
    pub(super) gradient: Vec<f64>,
    pub(super) input_gain: f64,
}

fn plant_choice(
    plant: &PlantTable,
    controller: &ControllerTable,
    n: usize,
    problems: &mut Problems,
) -> Option<(PlantChoice, NominalChannel)> {
    match plant.kind {
        PlantKind::FlexibleJoint => joint(plant, problems),
        PlantKind::Benchmark => {
            let model = match controller.exp {
                ExpKey::Libm => Model::BenchmarkLibm,
                ExpKey::Micromath if controller.precision == PrecisionKey::F64 => {
                    let why = "micromath computes in f32 only: take libm, or precision = \"f32\"";
                    return problems.take(problem("controller.exp", why));
                }
                ExpKey::Micromath => Model::BenchmarkMicromath,
            };
            let nominal = Benchmark::<controller_core::Libm>::nominal();
            let known = NominalChannel { model, gradient: nominal.gradient.to_vec(), input_gain: nominal.input_gain };
            Some((PlantChoice::Benchmark { state_dependent: plant.state_dependent }, known))
        }
        PlantKind::Chain => chain(plant, &controller.nominal, n, problems),
        PlantKind::Own => {
            let (formulas, known) = own::plant(plant, &controller.nominal, problems)?;
            Some((PlantChoice::Own(formulas), known))
        }
    }
}

/// Defaults from Example 2: start, observer gains, surface.
struct Printed {
    x0: [f64; 4],
    observers: [Option<[f64; 2]>; 4],
    c: [f64; 4],
}

impl PlantKind {
    const fn printed(self) -> Option<Printed> {
        const OBSERVER: Option<[f64; 2]> = Some([100.0, 20.0]);
        let (x0, observers) = ([0.1, 0.0, 0.0, 0.0], [None, OBSERVER, None, OBSERVER]);
        match self {
            Self::FlexibleJoint => Some(Printed { x0, observers, c: [125.0, 75.0, 15.0, 1.0] }),
            Self::Benchmark | Self::Chain | Self::Own => None,
        }
    }
}

fn joint(plant: &PlantTable, problems: &mut Problems) -> Option<(PlantChoice, NominalChannel)> {
    let chain = joint_parameters(plant, problems).chain(reading(plant.reading));
    let Nominal { gradient, input_gain } = chain.nominal();
    let input_disturbance = match &plant.input_disturbance {
        Some(list) => terms(list, "plant.input_disturbance", problems)?,
        // v = 1 + sin 2t is for the paper's figures only.
        None if plant.reading == ReadingKey::Physical => Vec::new(),
        None => vec![Term::Const { amplitude: 1.0 }, Term::Sin { amplitude: 1.0, omega_rad_s: 2.0, phase_rad: 0.0 }],
    };
    if !gradient.iter().chain([&input_gain]).all(|value| value.is_finite()) {
        let why = "a coefficient of the joint overflows: check the units";
        return problems.take(problem("plant.parameters", why));
    }
    Some((PlantChoice::FlexibleJoint { chain, input_disturbance }, linear(gradient.to_vec(), input_gain)))
}

fn linear(gradient: Vec<f64>, input_gain: f64) -> NominalChannel {
    NominalChannel { model: Model::Linear(gradient.clone()), gradient, input_gain }
}

fn chain(
    plant: &PlantTable,
    nominal: &NominalTable,
    n: usize,
    problems: &mut Problems,
) -> Option<(PlantChoice, NominalChannel)> {
    let a = match &plant.a {
        Some(a) => problems.take(of_length(a, n, "plant.a")).map(|()| a.clone()),
        None => problems.take(missing("plant.a", "the coefficients a_1 .. a_n of the true a(x)")),
    };
    let formula = "found a formula: only for plant.kind = \"own\"; a chain is linear";
    let nominal_a = match &nominal.a {
        Some(DriftKey::Row(a)) => problems.take(of_length(a, n, "controller.nominal.a")).map(|()| a.clone()),
        Some(DriftKey::Formula(_)) => problems.take(problem("controller.nominal.a", formula)),
        None => a.clone(),
    };
    let b = match plant.b {
        Some(b) => Some(b),
        None => problems.take(missing("plant.b", "the true input gain")),
    };
    let nominal_b = match nominal.b {
        Some(GainKey::Number(b)) => Some(b),
        Some(GainKey::Formula(_)) => problems.take(problem("controller.nominal.b", formula)),
        None => b,
    };
    if nominal_b == Some(0.0) {
        let key = if nominal.b.is_some() { "controller.nominal.b" } else { "plant.b" };
        let why = "found 0, expected an input gain other than 0: the law divides by it (Eq. (51))";
        return problems.take(problem(key, why));
    }
    let (a, b, nominal_a, nominal_b) = (a?, b?, nominal_a?, nominal_b?);
    let known = linear(nominal_a.clone(), nominal_b);
    Some((PlantChoice::Chain { a, b, nominal_a, nominal_b }, known))
}

fn parameters(table: &ParametersTable) -> JointParameters {
    let JointParameters { kt, j11, j12, b11, b12, ks } = JointParameters::TABLE_I;
    JointParameters {
        kt: table.kt.unwrap_or(kt),
        j11: table.j11.unwrap_or(j11),
        j12: table.j12.unwrap_or(j12),
        b11: table.b11.unwrap_or(b11),
        b12: table.b12.unwrap_or(b12),
        ks: table.ks.unwrap_or(ks),
    }
}

impl ReadingKey {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Literal => "literal",
            Self::Reconstructed => "reconstructed",
            Self::Stiff => "stiff",
            Self::Physical => "physical",
        }
    }
}

const fn reading(key: ReadingKey) -> Reading {
    match key {
        ReadingKey::Literal => Reading::Literal,
        ReadingKey::Reconstructed => Reading::Reconstructed,
        ReadingKey::Stiff => Reading::Stiff,
        ReadingKey::Physical => Reading::Physical,
    }
}

type Gains = Vec<Option<Vec<f64>>>;

fn observers(
    controller: &ControllerTable,
    kind: PlantKind,
    n: usize,
    problems: &mut Problems,
) -> (Gains, Vec<Option<usize>>) {
    let mut gains = vec![None; n];
    let mut positions = vec![None; n];
    let Some(list) = &controller.observer else {
        let printed = kind.printed().map(|printed| printed.observers.map(|l| l.map(Vec::from)));
        return (printed.map_or(gains, Vec::from), positions);
    };
    for (k, table) in list.iter().enumerate() {
        let key = format!("controller.observer[{}]", k + 1);
        let of_table = problems.take(observer_gains(table, &key));
        let Some(channel) = problems.take(channel(table.channel, n, &key)) else { continue };
        if positions[channel - 1].is_some() {
            let why = format!("channel {channel} has an observer already");
            problems.take::<()>(problem(format!("{key}.channel"), why));
        } else {
            (gains[channel - 1], positions[channel - 1]) = (of_table, Some(k + 1));
        }
    }
    (gains, positions)
}

fn observer_gains(table: &ObserverTable, key: &str) -> Result<Vec<f64>, Problem> {
    let order_key = format!("{key}.order");
    let (at, gains) = match (&table.printed, &table.poles, table.bandwidth_rad_s) {
        (Some(l), None, None) => ("printed", Some(l.clone())),
        (None, Some(poles), None) => ("poles", from_poles(poles)),
        (None, None, Some(omega_rad_s)) => {
            let Some(order) = table.order else {
                return missing(&order_key, "the order r, 1 to 3, that goes with bandwidth_rad_s");
            };
            ("bandwidth_rad_s", from_poles(&vec![[-omega_rad_s, 0.0]; order]))
        }
        (None, None, None) => return problem(key, "missing: give one of printed, poles, bandwidth_rad_s"),
        _ => return problem(key, "found several of printed, poles, bandwidth_rad_s: give exactly one"),
    };
    if table.order.is_some() && table.bandwidth_rad_s.is_none() {
        return problem(order_key, "only with bandwidth_rad_s: the length of the list is the order");
    }
    match gains {
        Some(gains) if gains.iter().all(|l| l.is_finite()) => Ok(gains),
        _ => {
            let remedy = if at == "poles" { "complex poles must come in conjugate pairs" } else { "too fast" };
            problem(format!("{key}.{at}"), format!("the gains are not finite: {remedy}"))
        }
    }
}

/// Returns the gains for these poles. `None` if complex poles are not in conjugate pairs, or too fast.
fn from_poles(poles: &[[f64; 2]]) -> Option<Vec<f64>> {
    let pole = |k: usize| Pole { re: poles[k][0], im: poles[k][1] };
    let gains = match poles.len() {
        1 => ObserverGains::<3>::try_from_poles([pole(0)]),
        2 => ObserverGains::try_from_poles([pole(0), pole(1)]),
        _ => ObserverGains::try_from_poles([pole(0), pole(1), pole(2)]),
    };
    Some(gains.ok()?.l().to_vec())
}

fn surface(controller: &ControllerTable, kind: PlantKind, n: usize) -> Result<Vec<f64>, Problem> {
    match (&controller.c, controller.surface_bandwidth_rad_s) {
        (Some(_), Some(_)) => problem("controller.c", "found together with surface_bandwidth_rad_s: give one of them"),
        (Some(c), None) => of_length(c, n, "controller.c").map(|()| c.clone()),
        (None, Some(omega_rad_s)) => {
            let c = match n {
                2 => Surface::<2>::from_bandwidth(omega_rad_s, 1.0).c.to_vec(),
                3 => Surface::<3>::from_bandwidth(omega_rad_s, 1.0).c.to_vec(),
                4 => Surface::<4>::from_bandwidth(omega_rad_s, 1.0).c.to_vec(),
                5 => Surface::<5>::from_bandwidth(omega_rad_s, 1.0).c.to_vec(),
                _ => Surface::<6>::from_bandwidth(omega_rad_s, 1.0).c.to_vec(),
            };
            if c.iter().all(|value| value.is_finite()) {
                Ok(c)
            } else {
                problem("controller.surface_bandwidth_rad_s", "the coefficients are not finite: too fast")
            }
        }
        (None, None) => match kind.printed() {
            Some(printed) => Ok(printed.c.to_vec()),
            None => missing("controller.c", "the surface, as c (Eq. (44)) or surface_bandwidth_rad_s"),
        },
    }
}

fn proposed(
    controller: &ControllerTable,
    kind: PlantKind,
    n: usize,
    nominal: Option<NominalChannel>,
    observers: &Gains,
    problems: &mut Problems,
) -> Option<ControllerSpec> {
    let surface_c = problems.take(surface(controller, kind, n));
    let initial_estimates = controller.initial_estimates.clone().unwrap_or_else(|| vec![0.0; n]);
    problems.take(of_length(&initial_estimates, n, "controller.initial_estimates"));
    let given = controller.limits.unwrap_or_default();
    let limits = Limits { min: given.min.unwrap_or(Limits::NONE.min), max: given.max.unwrap_or(Limits::NONE.max) };
    let fallback = match controller.fallback {
        FallbackKey::Word(_) => Fallback::HoldLast,
        FallbackKey::Safe(u) if u >= limits.min && u <= limits.max => Fallback::Safe(u),
        FallbackKey::Safe(u) => {
            let [u, min, max] = [u, limits.min, limits.max].map(shown);
            let message = format!("found {u}, expected a u within the limits [{min}, {max}]");
            problems.take(problem("controller.fallback", message))?
        }
    };
    let samples = samples(controller.samples.as_ref(), n, problems);
    let surface_c = surface_c?;
    let NominalChannel { model, mut gradient, input_gain } = nominal?;
    for (j, entry) in gradient.iter_mut().enumerate() {
        let used = if j + 1 == n { controller.use_slope } else { controller.use_gradient };
        if !used {
            *entry = 0.0;
        }
    }
    if let Some(lambda) = controller.lambda_per_s {
        if !controller.use_slope {
            let message = "not used with use_slope = false: leave it out";
            problems.take(problem::<()>("controller.lambda_per_s", message))?;
        }
        gradient[n - 1] = -lambda;
    }
    let gains = |l: &Vec<f64>| ObserverGains::new(l.len(), padded(l)).ok();
    Some(ControllerSpec {
        precision: match controller.precision {
            PrecisionKey::F32 => Precision::F32,
            PrecisionKey::F64 => Precision::F64,
        },
        model,
        config: AnyConfig {
            n,
            padded: Config {
                period_s: controller.period_s,
                surface: Surface { c: padded(&surface_c), alpha_per_s: controller.alpha_per_s },
                observers: std::array::from_fn(|i| observers.get(i)?.as_ref().and_then(gains)),
                reaching: ReachingLaw { k_l: controller.k_l, k_s: controller.k_s, epsilon: controller.epsilon },
                nominal: Nominal { gradient: padded(&gradient), input_gain },
                options: Options::NEUTRAL
                    .with_initial_estimates(padded(&initial_estimates))
                    .with_limits(limits)
                    .with_fallback(fallback)
                    .with_samples(samples)
                    .with_sigma_star_bound(controller.sigma_star_bound)
                    .with_observer_pole_limit(controller.observer_pole_limit),
            },
        },
    })
}

fn samples(given: Option<&SamplesTable>, n: usize, problems: &mut Problems) -> SampleLimits<MAX_ORDER> {
    let mut samples = SampleLimits::NONE;
    let SampleLimits { min, max, jump } = &mut samples;
    let Some(table) = given else { return samples };
    for (row, list, key) in [(min, &table.min, "min"), (max, &table.max, "max"), (jump, &table.jump, "jump")] {
        if let Some(list) = list
            && problems.take(of_length(list, n, &format!("controller.samples.{key}"))).is_some()
        {
            *row = padded(list);
        }
    }
    samples
}

fn baseline(
    controller: &ControllerTable,
    kind: PlantKind,
    gains: &Gains,
    problems: &mut Problems,
) -> Option<BaselineSpec> {
    let k = match controller.k {
        Some(k) => Some(k),
        None => problems.take(missing("controller.k", "the switching gain of the baseline")),
    };
    if kind != PlantKind::Benchmark {
        // Surface and observer are checked for a plant of two states.
        let message = format!("the baseline controls plant.kind = \"benchmark\" only, but it is {:?}", kind.word());
        return problems.take(problem("controller.kind", message));
    }
    let c1 = surface(controller, kind, 2).and_then(|c| match c[..] {
        [c1, 1.0] if c1 > 0.0 => Ok(c1),
        _ => problem("controller.c", "expected [c_1, 1] with c_1 above 0"),
    });
    let l = match gains.as_slice() {
        [Some(l), None] if l.len() == 1 && l[0] > 0.0 => Ok(l[0]),
        _ => problem("controller.observer", "the baseline has one observer: channel 1, order 1, a gain above 0"),
    };
    let (c1, l) = (problems.take(c1), problems.take(l));
    Some(BaselineSpec { period_s: controller.period_s, c1: c1?, l: l?, k: k? })
}

#[cfg(test)]
mod tests {
    use super::super::document;
    use super::super::error::Source;
    use super::*;

    /// Resolves a text. Places of problems are tested elsewhere.
    fn resolved(text: &str, sets: &[&str]) -> Result<Resolved, Problems> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let tree = document::read(&Source { file: "a.toml", text, sets: &sets }).expect("TOML");
        resolve(serde_json::from_value(tree.json()).expect("keys of a scenario"), "a", Problems::default())
    }

    fn config(text: &str, sets: &[&str]) -> Config<6, 3> {
        spec(text, sets).config.padded
    }

    fn spec(text: &str, sets: &[&str]) -> ControllerSpec {
        match resolved(text, sets).expect("a scenario").controller {
            ControllerChoice::Proposed(spec) => *spec,
            ControllerChoice::Baseline(_) => panic!("not the proposed controller"),
        }
    }

    #[test]
    fn the_default_design_is_example_2_as_printed() {
        let spec = spec("", &[]).config.fixed::<4, 2>().expect("the joint");
        assert_eq!((spec.surface.c, spec.surface.alpha_per_s), ([125.0, 75.0, 15.0, 1.0], 1.0));
        let printed = Some(ObserverGains::as_printed([100.0, 20.0]));
        assert_eq!(spec.observers, [None, printed, None, printed]);
        assert_eq!((spec.period_s, spec.reaching.k_l), (1e-3, 50.0));
        // Table I in the reconstructed reading: K_s/J_11, -K_s/J_11, -B_12/J_11 and K_t/J_11.
        let expected = [9.0 / 931e-6, 0.0, -9.0 / 931e-6, -0.07 / 931e-6, 0.119 / 931e-6];
        for (found, expected) in spec.nominal.gradient.iter().chain([&spec.nominal.input_gain]).zip(expected) {
            // Quotients of the same literals: one rounding each.
            assert!((found - expected).abs() <= 1e-15 * expected.abs(), "{found} {expected}");
        }
    }

    #[test]
    fn poles_bandwidth_and_printed_gains_are_three_ways_to_say_one_thing() {
        let gains = |rest: &str| config(&format!("[[controller.observer]]\nchannel = 2\n{rest}"), &[]).observers[1];
        let printed = Some(ObserverGains::as_printed([20.0, 100.0]));
        assert_eq!(gains("printed = [20, 100]"), printed);
        assert_eq!(gains("poles = [[-10, 0], [-10, 0]]"), printed);
        assert_eq!(gains("bandwidth_rad_s = 10\norder = 2"), printed);
        // (s + 1)^2 + 4
        assert_eq!(gains("poles = [[-1, 2], [-1, -2]]"), Some(ObserverGains::as_printed([2.0, 5.0])));
    }

    #[test]
    fn bandwidth_of_the_surface_gives_that_of_example_2() {
        let c = config("", &["controller.surface_bandwidth_rad_s=5"]).surface.c;
        assert_eq!(c, [125.0, 75.0, 15.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn slope_and_gradient_are_left_out_of_the_design_apart_and_stay_in_the_model() {
        let full = spec("", &[]);
        let [no_slope, no_gradient] =
            ["use_slope", "use_gradient"].map(|key| spec("", &[&format!("controller.{key}=false")]));
        let gradient = |spec: &ControllerSpec| spec.config.padded.nominal.gradient[..4].to_vec();
        let [a1, a2, a3, a4] = gradient(&full)[..] else { panic!("four entries") };
        assert_eq!((gradient(&no_slope), gradient(&no_gradient)), (vec![a1, a2, a3, 0.0], vec![0.0, 0.0, 0.0, a4]));
        assert_eq!((&no_slope.model, &no_gradient.model), (&full.model, &full.model));
    }

    #[test]
    fn lambda_of_the_design_is_apart_from_the_model_and_needs_the_slope() {
        let (full, other) = (spec("", &[]), spec("", &["controller.lambda_per_s=40"]));
        let [before, after] = [&full, &other].map(|spec| spec.config.padded.nominal.gradient);
        assert_eq!((after[..3].to_vec(), after[3]), (before[..3].to_vec(), -40.0));
        assert_eq!(full.model, other.model);
        let both = ["controller.lambda_per_s=40", "controller.use_slope=false"];
        assert!(resolved("", &both).is_err());
    }

    #[test]
    fn a_parameter_of_table_1_moves_plant_and_controller_but_an_error_the_plant_alone() {
        let joint = "[plant]\nreading = \"physical\"";
        let gain = |sets: &[&str]| config(joint, sets).nominal.input_gain;
        let (before, after) = (spec(joint, &[]), gain(&["plant.parameters.kt=0.238"]));
        assert_eq!(after, 2.0 * gain(&[]));
        let plant = |sets: &[&str]| match resolved(joint, sets).expect("a scenario").plant {
            PlantChoice::FlexibleJoint { chain, .. } => chain.b,
            other => panic!("{other:?}"),
        };
        assert_eq!(plant(&["plant.parameters.kt=0.238"]), after);
        assert_eq!(spec(joint, &["plant.error.b=0.5", "plant.error.k2_x3=-0.5"]), before);
    }

    #[test]
    fn what_the_controller_believes_of_a_chain_is_the_truth_unless_it_is_said() {
        let text = "[plant]\nkind = \"chain\"\norder = 2\na = [1, 2]\nb = 3\n[controller]\nc = [5, 1]";
        let told = spec(text, &[]);
        let row = [1.0, 2.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(told.model, Model::Linear(vec![1.0, 2.0]));
        assert_eq!(told.config.padded.nominal, Nominal { gradient: row, input_gain: 3.0 });
        let other = config(text, &["controller.nominal.b=4"]);
        assert_eq!(other.nominal, Nominal { gradient: row, input_gain: 4.0 });
    }

    #[test]
    fn a_title_that_would_upset_a_terminal_is_refused() {
        let problems = resolved("title = \"a\\u001b[31m\"", &[]).expect_err("refused");
        assert_eq!(problems.0[0].key, "title");
        assert!(resolved(&format!("title = {:?}", "x".repeat(200)), &[]).is_ok());
        assert!(resolved(&format!("title = {:?}", "x".repeat(201)), &[]).is_err());
    }
}
