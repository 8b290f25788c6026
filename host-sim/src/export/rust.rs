//! The Rust file: the whole [`Config`](controller_core::Config) as it stands, designed by the compiler into flash.
//!
//! Not the coefficients: the compiler's design has the same bits, is checked against the library that it is linked
//! with, and can be read in SI units. An f64 is printed with as many digits as bring it back.

use std::fmt::Write as _;

use controller_core::Fallback;
use loop_sim::port::in_process::Model;

use super::Exported;

pub(super) fn text(exported: &Exported<'_>) -> String {
    let Exported { spec, download, .. } = exported;
    let shape = download.shape;
    let (n, r) = (shape.n, shape.r);
    let channels = exported.channels();
    let (model, model_value, import) = match &spec.model {
        Model::Linear(row) => {
            let nominal = format!("Nominal {{ gradient: {row:?}, input_gain: {:?} }}", spec.input_gain);
            (format!("Linear<f32, {n}>"), format!("Linear::<f32, {n}>::new(&{nominal})"), "Linear")
        }
        Model::BenchmarkLibm => ("Benchmark<Libm>".into(), "Benchmark::new()".into(), "Benchmark, Libm"),
        Model::BenchmarkMicromath => ("Benchmark<Micromath>".into(), "Benchmark::new()".into(), "Benchmark, Micromath"),
    };
    let fallback = match spec.fallback {
        Fallback::HoldLast => "Fallback::HoldLast".into(),
        Fallback::Safe(u) => format!("Fallback::Safe({u:?})"),
    };
    let observers: Vec<String> = (spec.observers.iter())
        .map(|gains| match gains {
            Some(l) => format!("            Some(ObserverGains::as_printed::<{}>({l:?})),\n", l.len()),
            None => "            None,\n".into(),
        })
        .collect();
    let estimates: Vec<f32> = download.numbers.iter().copied().take(usize::from(n)).collect();
    let version = controller_core::VERSION;

    let mut out = format!(
        "// Sliding mode control with an extended disturbance observer: {}, f32, T = {:?} s.\n\
         // Exported for controller-core {version}; do not edit, export it again.\n",
        exported.shape(),
        spec.period_s
    );
    for line in exported.origin().lines() {
        out.push_str(format!("// {line}").trim_end());
        out.push('\n');
    }
    let mut imports = format!("{import}, Config, Controller, Fallback, Limits, Nominal, ReachingLaw, State, Surface")
        .split(", ")
        .map(str::to_owned)
        .collect::<Vec<_>>();
    if !channels.is_empty() {
        imports.push("ObserverGains".into());
    }
    imports.sort();
    let reaching = spec.reaching;
    let _ = write!(
        out,
        "
use controller_core::{{
    {imports}, channels,
}};

/// Precision, nominal model, plant order, largest observer order, observed channels and their number.
pub type Designed = Controller<f32, {model}, {n}, {r}, {{ channels({channels:?}) }}, {o}>;
/// What it remembers between two ticks.
pub type Memory = Option<State<f32, {r}, {o}>>;

/// The version of controller-core that this was exported for.
pub const EXPORTED_FOR: &str = {version:?};
/// Hash of the design, as a target reports it.
pub const DESIGN: u32 = {hash:#010x};
/// Estimates of d_1..d_n at the start: `CONTROLLER.tick_or_start(&mut memory, &INITIAL_ESTIMATES, &x)`.
pub const INITIAL_ESTIMATES: [f32; {n}] = {estimates:?};

/// Designed by the compiler: a bad design is a compile error.
pub static CONTROLLER: Designed = Designed::designed(
    &Config {{
        period_s: {period:?},
        surface: Surface::from_coefficients({c:?}, {alpha:?}),
        observers: [
{observers}        ],
        reaching: ReachingLaw {{ k_l: {k_l:?}, k_s: {k_s:?}, epsilon: {epsilon:?} }},
        nominal: Nominal {{ gradient: {gradient:?}, input_gain: {b:?} }},
        limits: Limits {{ min: {min:?}, max: {max:?} }},
        fallback: {fallback},
        sigma_star_bound: {bound:?},
        observer_pole_limit: {pole_limit:?},
    }},
    {model_value},
);
",
        imports = imports.join(", "),
        hash = exported.design_hash(),
        o = channels.len(),
        period = spec.period_s,
        c = spec.surface_c,
        alpha = spec.alpha_per_s,
        observers = observers.concat(),
        k_l = reaching.k_l,
        k_s = reaching.k_s,
        epsilon = reaching.epsilon,
        gradient = spec.gradient,
        b = spec.input_gain,
        min = spec.limits.min,
        max = spec.limits.max,
        bound = spec.sigma_star_bound,
        pole_limit = spec.observer_pole_limit,
    );
    out
}
