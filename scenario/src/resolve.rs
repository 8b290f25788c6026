//! From what a file says to what it means: defaults filled in, and every rule that a schema cannot state.

use controller_core::{
    AnyConfig, Benchmark, Config, Fallback, JointChain, JointParameters, Limits, Nominal, ObserverGains, Options, Pole,
    ReachingLaw, Reading, Surface,
};
use loop_sim::port::baseline::BaselineSpec;
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, padded};
use loop_sim::signal::Term;

use super::error::shown;
use super::{
    ControllerKind, ControllerTable, ExpKey, FallbackKey, ObserverTable, ParametersTable, PlantKind, PlantTable,
    PrecisionKey, ReadingKey, Scenario, SensorTable, TermKind, TermTable,
};

/// Most ticks of one run: each is kept until the end, some 200 bytes, and written as a line.
const MOST_TICKS: f64 = 2e6;

/// A rule that is broken: at this key, and why.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) key: String,
    pub(super) message: String,
}

pub(super) fn problem<T>(key: impl Into<String>, message: impl Into<String>) -> Result<T, Problem> {
    Err(Problem { key: key.into(), message: message.into() })
}

/// A scenario with nothing left open.
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
    /// Position (from 1) in the file's list of the observer of each channel; `None` where the default put it.
    pub(super) observer_position: Vec<Option<usize>>,
    /// The rest needs no resolving.
    pub(super) file: Scenario,
}

#[derive(Debug)]
pub(super) enum PlantChoice {
    FlexibleJoint { chain: JointChain, input_disturbance: Vec<Term> },
    Benchmark { state_dependent: bool },
    Chain { a: Vec<f64>, b: f64, nominal_a: Vec<f64>, nominal_b: f64 },
}

#[derive(Debug)]
pub(super) enum ControllerChoice {
    Proposed(Box<ControllerSpec>),
    Baseline(BaselineSpec),
}

/// Keys that mean something for one kind only: (keys, selecting key, the kind).
const FOREIGN: [(&[&str], &str, &str); 5] = [
    (&["plant.reading", "plant.parameters", "plant.error", "plant.input_disturbance"], "plant.kind", "flexible_joint"),
    (&["plant.state_dependent", "controller.exp"], "plant.kind", "benchmark"),
    (&["plant.order", "plant.a", "plant.b", "controller.nominal"], "plant.kind", "chain"),
    (&["controller.k"], "controller.kind", "baseline"),
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
            "controller.limits",
            "controller.fallback",
            "controller.initial_estimates",
            "controller.sigma_star_bound",
            "controller.observer_pole_limit",
            "controller.exp",
        ],
        "controller.kind",
        "proposed",
    ),
];

impl PlantKind {
    const fn word(self) -> &'static str {
        match self {
            Self::FlexibleJoint => "flexible_joint",
            Self::Benchmark => "benchmark",
            Self::Chain => "chain",
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

/// Refuses a key that the chosen kind would silently ignore.
pub(super) fn foreign_keys(scenario: &Scenario, is_given: &dyn Fn(&str) -> bool) -> Result<(), Problem> {
    for (keys, selector, wanted) in FOREIGN {
        let chosen =
            if selector == "plant.kind" { scenario.plant.kind.word() } else { scenario.controller.kind.word() };
        if chosen != wanted
            && let Some(key) = keys.iter().find(|key| is_given(key))
        {
            return problem(*key, format!("only for {selector} = {wanted:?}, but {selector} is {chosen:?}"));
        }
    }
    Ok(())
}

pub(super) fn resolve(file: Scenario, default_name: &str) -> Result<Resolved, Problem> {
    let name = name(file.name.as_deref(), default_name)?;
    let n = order(&file.plant)?;
    let Scenario { plant, controller, sensor, actuator, .. } = &file;
    let periods = periods(file.span_s, controller.period_s)?;
    let window_s = window(file.window_s, file.span_s, controller.period_s)?;

    if let Some(x0) = &plant.x0 {
        of_length(x0, n, "plant.x0")?;
    }
    let x0 = plant.x0.clone().unwrap_or_else(|| match plant.kind {
        PlantKind::FlexibleJoint => vec![0.1, 0.0, 0.0, 0.0],
        PlantKind::Benchmark | PlantKind::Chain => vec![0.0; n],
    });
    sensor_lengths(sensor, n)?;
    let (min, max) = (actuator.min.unwrap_or(f64::NEG_INFINITY), actuator.max.unwrap_or(f64::INFINITY));
    if min > max {
        let message = format!("found {} above actuator.max = {}: the limits are reversed", shown(min), shown(max));
        return problem("actuator.min", message);
    }

    let disturbance = disturbance(plant, n)?;
    let (choice, nominal) = plant_choice(plant, controller, n)?;
    let (gains, observer_position) = observers(controller, plant.kind, n)?;
    let controller = match controller.kind {
        ControllerKind::Proposed => {
            ControllerChoice::Proposed(Box::new(proposed(controller, plant.kind, n, nominal, &gains)?))
        }
        ControllerKind::Baseline => ControllerChoice::Baseline(baseline(controller, plant.kind, &gains)?),
    };
    let title = file.title.clone().unwrap_or_else(|| name.clone());
    // It goes to terminals and into drawings.
    if title.chars().any(char::is_control) || title.chars().count() > 200 {
        return problem("title", "expected one line of at most 200 characters, without control characters");
    }
    Ok(Resolved {
        name,
        title,
        span_s: file.span_s,
        periods,
        window_s,
        x0,
        plant: choice,
        disturbance,
        controller,
        observer_position,
        file,
    })
}

/// The name is a folder's name as well: it must not lead elsewhere.
fn name(given: Option<&str>, default_name: &str) -> Result<String, Problem> {
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

const fn is_safe(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.')
}

/// Can this be the name of a scenario?
pub(super) fn is_file_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && !name.starts_with('.') && name.chars().all(is_safe)
}

fn order(plant: &PlantTable) -> Result<usize, Problem> {
    match (plant.kind, plant.order) {
        (PlantKind::FlexibleJoint, _) => Ok(4),
        (PlantKind::Benchmark, _) => Ok(2),
        (PlantKind::Chain, Some(n)) => Ok(n),
        (PlantKind::Chain, None) => missing("plant.order", "the order n of the chain, 2 to 6"),
    }
}

fn missing<T>(key: &str, what: &str) -> Result<T, Problem> {
    problem(key, format!("missing: {what}"))
}

fn of_length(list: &[f64], n: usize, key: &str) -> Result<(), Problem> {
    if list.len() == n {
        return Ok(());
    }
    problem(key, format!("found a list of {}, expected {n} numbers, one per state of this plant", list.len()))
}

fn periods(span_s: f64, period_s: f64) -> Result<usize, Problem> {
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

fn window(given: Option<[f64; 2]>, span_s: f64, period_s: f64) -> Result<[f64; 2], Problem> {
    let [from, to] = given.unwrap_or([span_s / 2.0, span_s]);
    // Half a tick of slack, as the metrics have.
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

fn sensor_lengths(sensor: &SensorTable, n: usize) -> Result<(), Problem> {
    for (list, key) in [(&sensor.noise, "sensor.noise"), (&sensor.quantum, "sensor.quantum")] {
        if let Some(list) = list {
            of_length(list, n, key)?;
        }
    }
    Ok(())
}

fn disturbance(plant: &PlantTable, n: usize) -> Result<Vec<Vec<Term>>, Problem> {
    let mut channels = vec![Vec::new(); n];
    for (k, table) in plant.disturbance.iter().enumerate() {
        let key = format!("plant.disturbance[{}]", k + 1);
        let channel = channel(table.channel, n, &key)?;
        if !channels[channel - 1].is_empty() {
            return problem(
                format!("{key}.channel"),
                format!("channel {channel} has a disturbance already: put all its terms into one table"),
            );
        }
        if table.terms.is_empty() {
            return missing(&format!("{key}.terms"), "the terms of the disturbance");
        }
        channels[channel - 1] = terms(&table.terms, &format!("{key}.terms"))?;
    }
    Ok(channels)
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

fn terms(list: &[TermTable], key: &str) -> Result<Vec<Term>, Problem> {
    list.iter().enumerate().map(|(k, table)| term(table, &format!("{key}[{}]", k + 1))).collect()
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
            return problem(format!("{key}.{name}"), format!("missing: a {word:?} term needs it"));
        }
    }
    // What is needed is there by now.
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

/// What the controller knows of channel n.
struct NominalChannel {
    model: Model,
    gradient: Vec<f64>,
    input_gain: f64,
}

fn plant_choice(
    plant: &PlantTable,
    controller: &ControllerTable,
    n: usize,
) -> Result<(PlantChoice, NominalChannel), Problem> {
    match plant.kind {
        PlantKind::FlexibleJoint => {
            let chain = parameters(&plant.parameters).chain(reading(plant.reading));
            let nominal = chain.nominal();
            let input_disturbance = match &plant.input_disturbance {
                Some(list) => terms(list, "plant.input_disturbance")?,
                // v = 1 + sin 2t
                None => {
                    vec![Term::Const { amplitude: 1.0 }, Term::Sin { amplitude: 1.0, omega_rad_s: 2.0, phase_rad: 0.0 }]
                }
            };
            let gradient = nominal.gradient.to_vec();
            if !gradient.iter().chain([&nominal.input_gain]).all(|value| value.is_finite()) {
                return problem("plant.parameters", "a coefficient of the joint overflows: check the units");
            }
            let known =
                NominalChannel { model: Model::Linear(gradient.clone()), gradient, input_gain: nominal.input_gain };
            Ok((PlantChoice::FlexibleJoint { chain, input_disturbance }, known))
        }
        PlantKind::Benchmark => {
            let model = match controller.exp {
                ExpKey::Libm => Model::BenchmarkLibm,
                ExpKey::Micromath if controller.precision == PrecisionKey::F64 => {
                    return problem(
                        "controller.exp",
                        "micromath computes in f32 only: take libm, or precision = \"f32\"",
                    );
                }
                ExpKey::Micromath => Model::BenchmarkMicromath,
            };
            let nominal = Benchmark::<controller_core::Libm>::nominal();
            let known = NominalChannel { model, gradient: nominal.gradient.to_vec(), input_gain: nominal.input_gain };
            Ok((PlantChoice::Benchmark { state_dependent: plant.state_dependent }, known))
        }
        PlantKind::Chain => {
            let Some(a) = plant.a.clone() else {
                return missing("plant.a", &format!("the {n} coefficients of the true a(x)"));
            };
            of_length(&a, n, "plant.a")?;
            let Some(b) = plant.b else {
                return missing("plant.b", "the true input gain");
            };
            let nominal_a = controller.nominal.a.clone().unwrap_or_else(|| a.clone());
            of_length(&nominal_a, n, "controller.nominal.a")?;
            let nominal_b = controller.nominal.b.unwrap_or(b);
            if nominal_b == 0.0 {
                let key = if controller.nominal.b.is_some() { "controller.nominal.b" } else { "plant.b" };
                return problem(key, "found 0, expected an input gain other than 0: the law divides by it (Eq. (51))");
            }
            let known = NominalChannel {
                model: Model::Linear(nominal_a.clone()),
                gradient: nominal_a.clone(),
                input_gain: nominal_b,
            };
            Ok((PlantChoice::Chain { a, b, nominal_a, nominal_b }, known))
        }
    }
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

const fn reading(key: ReadingKey) -> Reading {
    match key {
        ReadingKey::Literal => Reading::Literal,
        ReadingKey::Reconstructed => Reading::Reconstructed,
        ReadingKey::Stiff => Reading::Stiff,
        ReadingKey::Physical => Reading::Physical,
    }
}

type Gains = Vec<Option<Vec<f64>>>;

fn observers(controller: &ControllerTable, kind: PlantKind, n: usize) -> Result<(Gains, Vec<Option<usize>>), Problem> {
    let mut gains = vec![None; n];
    let mut positions = vec![None; n];
    let Some(list) = &controller.observer else {
        if kind == PlantKind::FlexibleJoint {
            // As printed in Example 2.
            gains[1] = Some(vec![100.0, 20.0]);
            gains[3] = Some(vec![100.0, 20.0]);
        }
        return Ok((gains, positions));
    };
    for (k, table) in list.iter().enumerate() {
        let key = format!("controller.observer[{}]", k + 1);
        let channel = channel(table.channel, n, &key)?;
        if gains[channel - 1].is_some() {
            return problem(format!("{key}.channel"), format!("channel {channel} has an observer already"));
        }
        gains[channel - 1] = Some(observer_gains(table, &key)?);
        positions[channel - 1] = Some(k + 1);
    }
    Ok((gains, positions))
}

fn observer_gains(table: &ObserverTable, key: &str) -> Result<Vec<f64>, Problem> {
    let order_key = format!("{key}.order");
    let (at, gains) = match (&table.printed, &table.poles, table.bandwidth_rad_s) {
        (Some(l), None, None) => ("printed", l.clone()),
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
    if !gains.iter().all(|l| l.is_finite()) {
        let remedy = if at == "poles" { "complex poles must come in conjugate pairs" } else { "it is too fast" };
        return problem(format!("{key}.{at}"), format!("no finite gains come of it: {remedy}"));
    }
    Ok(gains)
}

/// Gains by poles; NaN where complex poles are not paired.
fn from_poles(poles: &[[f64; 2]]) -> Vec<f64> {
    let pole = |k: usize| Pole { re: poles[k][0], im: poles[k][1] };
    match poles.len() {
        1 => ObserverGains::<1>::from_poles([pole(0)]).l.to_vec(),
        2 => ObserverGains::<2>::from_poles([pole(0), pole(1)]).l.to_vec(),
        _ => ObserverGains::<3>::from_poles([pole(0), pole(1), pole(2)]).l.to_vec(),
    }
}

fn surface(controller: &ControllerTable, kind: PlantKind, n: usize) -> Result<Vec<f64>, Problem> {
    match (&controller.c, controller.surface_bandwidth_rad_s) {
        (Some(_), Some(_)) => problem("controller.c", "found beside surface_bandwidth_rad_s: give one of them"),
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
                problem("controller.surface_bandwidth_rad_s", "no finite coefficients come of it: too fast")
            }
        }
        // Example 2.
        (None, None) if kind == PlantKind::FlexibleJoint => Ok(vec![125.0, 75.0, 15.0, 1.0]),
        (None, None) => missing("controller.c", "the surface, as c (Eq. (44)) or surface_bandwidth_rad_s"),
    }
}

fn proposed(
    controller: &ControllerTable,
    kind: PlantKind,
    n: usize,
    nominal: NominalChannel,
    observers: &Gains,
) -> Result<ControllerSpec, Problem> {
    let surface_c = surface(controller, kind, n)?;
    let NominalChannel { model, mut gradient, input_gain } = nominal;
    for (j, entry) in gradient.iter_mut().enumerate() {
        let used = if j + 1 == n { controller.use_slope } else { controller.use_gradient };
        if !used {
            *entry = 0.0;
        }
    }
    let initial_estimates = controller.initial_estimates.clone().unwrap_or_else(|| vec![0.0; n]);
    of_length(&initial_estimates, n, "controller.initial_estimates")?;
    let given = controller.limits.unwrap_or_default();
    let limits = Limits { min: given.min.unwrap_or(Limits::NONE.min), max: given.max.unwrap_or(Limits::NONE.max) };
    let fallback = match controller.fallback {
        FallbackKey::Word(_) => Fallback::HoldLast,
        FallbackKey::Safe(u) if u >= limits.min && u <= limits.max => Fallback::Safe(u),
        FallbackKey::Safe(u) => {
            let [u, min, max] = [u, limits.min, limits.max].map(shown);
            let message = format!("found {u}, expected a u within the limits [{min}, {max}]");
            return problem("controller.fallback", message);
        }
    };
    let gains = |l: &Vec<f64>| ObserverGains { order: l.len(), l: padded(l) };
    Ok(ControllerSpec {
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
                observers: std::array::from_fn(|i| observers.get(i)?.as_ref().map(gains)),
                reaching: ReachingLaw { k_l: controller.k_l, k_s: controller.k_s, epsilon: controller.epsilon },
                nominal: Nominal { gradient: padded(&gradient), input_gain },
                options: Options::NEUTRAL
                    .with_initial_estimates(padded(&initial_estimates))
                    .with_limits(limits)
                    .with_fallback(fallback)
                    .with_sigma_star_bound(controller.sigma_star_bound)
                    .with_observer_pole_limit(controller.observer_pole_limit),
            },
        },
    })
}

fn baseline(controller: &ControllerTable, kind: PlantKind, gains: &Gains) -> Result<BaselineSpec, Problem> {
    if kind != PlantKind::Benchmark {
        let message = format!("the baseline controls plant.kind = \"benchmark\" only, but it is {:?}", kind.word());
        return problem("controller.kind", message);
    }
    let c1 = match surface(controller, kind, 2)?[..] {
        [c1, 1.0] if c1 > 0.0 => c1,
        _ => return problem("controller.c", "expected [c_1, 1] with c_1 above 0"),
    };
    let l = match gains.as_slice() {
        [Some(l), None] if l.len() == 1 && l[0] > 0.0 => l[0],
        _ => {
            return problem("controller.observer", "the baseline has one observer: channel 1, order 1, a gain above 0");
        }
    };
    let Some(k) = controller.k else {
        return missing("controller.k", "the switching gain of the baseline");
    };
    Ok(BaselineSpec { period_s: controller.period_s, c1, l, k })
}

#[cfg(test)]
mod tests {
    use super::super::document;
    use super::super::error::Source;
    use super::*;

    /// What a text comes to; the place of a problem is the business of other tests.
    fn resolved(text: &str, sets: &[&str]) -> Result<Resolved, Problem> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let tree = document::read(&Source { file: "a.toml", text, sets: &sets }).expect("TOML");
        resolve(serde_json::from_value(tree.json()).expect("keys of a scenario"), "a")
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
    fn a_parameter_of_table_1_moves_plant_and_controller_but_an_error_the_plant_alone() {
        let gain = |sets: &[&str]| config("", sets).nominal.input_gain;
        let (before, after) = (spec("", &[]), gain(&["plant.parameters.kt=0.238"]));
        assert_eq!(after, 2.0 * gain(&[]));
        let plant = |sets: &[&str]| match resolved("", sets).expect("a scenario").plant {
            PlantChoice::FlexibleJoint { chain, .. } => chain.b,
            other => panic!("{other:?}"),
        };
        assert_eq!(plant(&["plant.parameters.kt=0.238"]), after);
        assert_eq!(spec("", &["plant.error.b=0.5", "plant.error.k2_x3=-0.5"]), before);
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
        let problem = resolved("title = \"a\\u001b[31m\"", &[]).expect_err("refused");
        assert_eq!(problem.key, "title");
        assert!(resolved(&format!("title = {:?}", "x".repeat(200)), &[]).is_ok());
        assert!(resolved(&format!("title = {:?}", "x".repeat(201)), &[]).is_err());
    }
}
