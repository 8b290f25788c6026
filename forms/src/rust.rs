//! Rust file: the whole [`Config`](controller_core::Config), from which the compiler computes the design in flash.
//!
//! The file contains no coefficients. The compiler's design has the same bits, is checked against the linked library,
//! and is readable in SI units. An f64 is printed with enough digits to restore it exactly.

use std::fmt::Write as _;

use controller_core::{Config, MAX_N, MAX_R, ObserverGains, Options, SampleLimits};
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows, Form as DriveForm, Reaction};
use loop_sim::port::in_process::Model;

use super::drive::Exported as Drive;
use super::{Error, Exported};

pub(super) fn text(exported: &Exported<'_>) -> Result<String, Error> {
    let Exported { spec, download, .. } = exported;
    let (n, r) = (usize::from(download.shape.n), download.shape.r);
    let channels = exported.channels();
    let Config { period_s, surface, observers, reaching, nominal, options } = spec.config.padded;
    let b = nominal.input_gain;
    let (model, value, import) = nominal_model(&spec.model, n, b)?;
    let (observers, calls, gated) = (observer_lines(&observers[..n]), calls(&options, n), is_gated(&options));
    let estimates = &download.numbers[..n];
    let version = controller_core::VERSION;

    let title = format!(
        "Sliding mode control with an extended disturbance observer: {}, f32, T = {period_s:?} s.",
        exported.shape()
    );
    let mut out = head(&title, &exported.about.origin());
    let mut imports =
        format!("{import}, Config, Fallback, Guessing, Limits, Nominal, Options, ReachingLaw, Running, Surface")
            .split(", ")
            .map(str::to_owned)
            .collect::<Vec<_>>();
    let observed = if channels.is_empty() {
        String::from("no observers")
    } else {
        imports.push("ObserverGains".into());
        format!("observers of order {r} in {channels:?}")
    };
    let mut designed = format!("controller!(f32, {model}, order {n}, {observed})");
    let mut parts = "Precision, nominal model, plant order, observers";
    if gated {
        imports.extend(["Gated".into(), "SampleLimits".into()]);
        designed = format!("Gated<{designed}, {n}>");
        parts = "Precision, nominal model, plant order, observers, and a gate that rejects implausible samples";
    }
    imports.sort();
    let _ = write!(
        out,
        "
use controller_core::{{
    {imports}, controller,
}};

/// {parts}.
pub type Designed = {designed};

/// Version of controller-core for which this file was exported.
pub const EXPORTED_FOR: &str = {version:?};
/// Fingerprint of the design, the first word of the state snapshot of `RUNNING`.
pub const DESIGN: u32 = {hash:#010x};

/// Numbers of the design, in SI units.
pub const CONFIG: Config<{n}, {r}> = Config {{
    period_s: {period_s:?},
    surface: Surface {{ c: {c}, alpha_per_s: {alpha:?} }},
    observers: [
{observers}    ],
    reaching: {reaching:?},
    nominal: Nominal {{ gradient: {gradient}, input_gain: {b:?} }},
    options: Options::NEUTRAL{calls},
}};

/// Controller, designed by the compiler: an invalid design is a compile error.
pub static CONTROLLER: Designed = Designed::design(&CONFIG, {value});

/// Controller that waits for its first sample. Use: `static mut LOOP: Running<Guessing<&Designed>> = RUNNING;`, then
/// `LOOP.tick(&x).u`.
pub const RUNNING: Running<Guessing<&Designed>> = Running::guessing(&CONTROLLER, {estimates:?});
",
        imports = imports.join(", "),
        hash = exported.about.design,
        c = of_order(&surface.c, n),
        alpha = surface.alpha_per_s,
        gradient = of_order(&nominal.gradient, n),
    );
    Ok(out)
}

/// Returns type and value of the nominal model, and its import.
fn nominal_model(model: &Model, n: usize, b: f64) -> Result<(String, String, &'static str), Error> {
    Ok(match model {
        Model::Linear(row) => {
            let nominal = format!("Nominal {{ gradient: {row:?}, input_gain: {b:?} }}");
            (format!("Linear<f32, {n}>"), format!("Linear::<f32, {n}>::new(&{nominal})"), "Linear")
        }
        Model::BenchmarkLibm => ("Benchmark<Libm>".into(), "Benchmark::new()".into(), "Benchmark, Libm"),
        Model::BenchmarkMicromath => ("Benchmark<Micromath>".into(), "Benchmark::new()".into(), "Benchmark, Micromath"),
        Model::Formulas { .. } => return Err(Error::Precision),
    })
}

/// Returns the head comment: title and origin.
fn head(title: &str, origin: &str) -> String {
    let version = controller_core::VERSION;
    let mut out = format!(
        "// {title}\n// Exported for controller-core {version}. Do not edit; export again.\n\
         // The tick assumes rounding to nearest and subnormal numbers. controller_core::modes_ok() checks this:\n\
         // call it once at start-up in the context of the tick.\n//\n",
        title = title.replace('\n', "\n// "),
    );
    for line in origin.lines() {
        out.push_str(format!("// {line}").trim_end());
        out.push('\n');
    }
    out
}

/// Returns the gains of each channel.
fn observer_lines(observers: &[Option<ObserverGains<MAX_R>>]) -> String {
    let line = |gains: &Option<ObserverGains<MAX_R>>| match gains {
        Some(gains) => {
            let l = gains.l();
            format!("        Some(ObserverGains::as_printed::<{}>({l:?})),\n", l.len())
        }
        None => "        None,\n".into(),
    };
    observers.iter().map(line).collect()
}

/// Returns whether the samples have limits.
fn is_gated(options: &Options<MAX_N>) -> bool {
    options.samples != SampleLimits::NONE
}

/// Returns the method calls that build these options from the defaults.
fn calls(options: &Options<MAX_N>, n: usize) -> String {
    let said = options.calls().filter(|(call, _)| is_gated(options) || *call != "with_samples").map(|(call, value)| {
        let value = match call {
            "with_samples" => {
                let SampleLimits { min, max, jump } = options.samples;
                let [min, max, jump] = [min, max, jump].map(|row| of_order(&row, n));
                format!("SampleLimits {{ min: {min}, max: {max}, jump: {jump} }}")
            }
            "with_initial_estimates" => of_order(&options.initial_estimates, n),
            "with_fallback" => format!("Fallback::{value:?}"),
            _ => format!("{value:?}"),
        };
        format!("\n        .{call}({value})")
    });
    said.collect()
}

/// Returns the first n numbers of a row.
fn of_order(row: &[f64; MAX_N], n: usize) -> String {
    format!("{:?}", &row[..n])
}

/// Returns the Rust file of a drive.
pub(super) fn drive(exported: &Drive<'_>) -> String {
    let DriveForm { follows, gain_sets, delay_ticks, observer_states } = exported.drive.designed.form();
    let (fast, late) = (u8::from(gain_sets > 1), delay_ticks);
    let aim = if follows == Follows::Position { "Position" } else { "Speed" };
    let (designed, design, encoders, mounting, more) = match &exported.drive.designed {
        DriveDesign::Motor(DriveOf { design, mounted, .. }) => (
            format!("MotorDrive<f32, {aim}, {fast}, {late}, {observer_states}>"),
            format!("MotorDesign = {design:#?}"),
            1,
            format!("{:?}", mounted.map(|mounted| mounted.mounting)),
            "Motor, MotorBandwidths, MotorDesign, MotorDrive",
        ),
        DriveDesign::Joint(DriveOf { design, mounted, .. }) => (
            match design.coupled {
                Some(_) => format!("CoupledDrive<f32, {aim}, {fast}, {late}>"),
                None => format!("JointDrive<f32, {aim}, {fast}, {late}>"),
            },
            format!("JointDesign = {design:#?}"),
            2,
            format!("{:?}", mounted.map(|mounted| mounted.mounting)),
            match design.coupled {
                Some(_) => "Coupled, CoupledDrive, Joint, JointBandwidths, JointDesign",
                None => "Joint, JointBandwidths, JointDesign, JointDrive",
            },
        ),
    };
    let design = design.replace("fallback: ", "fallback: Fallback::").replace(": inf,", ": f64::INFINITY,");
    let (stops, beyond, stop_ticks) = match exported.drive.designed.reaction() {
        Reaction::GoOn => ("", "", 0),
        Reaction::Brake => (".braking()", "", 0),
        Reaction::Fallback => (".stopping()", "", 0),
        Reaction::JoinedStop { ticks } => (".stopping_at(BEYOND_CONTROL)", "BEYOND_CONTROL, ", ticks),
    };
    let bounds = exported.bounds().replace(": inf,", ": f64::INFINITY,");
    let version = controller_core::VERSION;
    let limits_of = match exported.drive.designed {
        DriveDesign::Motor(DriveOf { monitors, .. }) => monitors.fence,
        DriveDesign::Joint(DriveOf { monitors, .. }) => monitors.fence,
    };
    let (limits, fence) = limits_of.map_or(("", "None".into()), |it| {
        let it = format!("{it:?}").replace("inf", "f64::INFINITY");
        ("FenceLimits, ", format!("Some(Fence::new(&{it}, CONFIG.slowing({late})))"))
    });
    let rest_band = match exported.drive.designed {
        DriveDesign::Motor(DriveOf { monitors, .. }) => monitors.rest_band,
        DriveDesign::Joint(_) => None,
    };
    let rest_band = rest_band.filter(|_| exported.drive.designed.rest_band().is_some());
    let (learning, rest_band) = rest_band.map_or(("", "None".into()), |learning| {
        ("RestLearning, ", format!("Some(CONFIG.rest_band(RestLearning::{learning:?}))"))
    });
    let mut out = head(&exported.title(), &exported.about.origin());
    let _ = write!(
        out,
        "
use controller_core::drive::{{
    {beyond}Bounds, Encoder, Fence, {limits}{more}, Monitored, Mounting, {aim}, RestBand, {learning}Switching,
}};
use controller_core::{{Fallback, Limits, Running}};

/// Type of the drive: precision, control mode, high gain sets, ticks of delay, observer states of a motor.
pub type Designed = {designed};

/// Version of controller-core for which this file was exported.
pub const EXPORTED_FOR: &str = {version:?};
/// Fingerprint of the drive: `drive::fingerprint(law, &MOUNTING, STOP_TICKS, fence().as_ref(), rest_band().as_ref())`
/// of the `law` `running().design().fingerprint()`.
pub const DESIGN: u32 = {hash:#010x};

/// Numbers of the design, in SI units.
pub const CONFIG: {design};

/// Duration in ticks of the stop to plan after an alarm; 0 for none.
pub const STOP_TICKS: u32 = {stop_ticks};

/// Sign and offset of each encoder: `MOUNTING[0].upright(register)` is the count of a sample.
pub const MOUNTING: [Mounting; {encoders}] = {mounting};

/// Drive, designed by the compiler: an invalid design is a compile error.
pub static DRIVE: Designed = Designed::design(&CONFIG);

/// Limits of the monitors: load and friction, errors of the data sheet, time at a limit.
pub const BOUNDS: Bounds<{encoders}> = {bounds};

/// Limits of position, speed and following error: call [`Fence::guard`] after every tick.
pub fn fence() -> Option<Fence> {{
    {fence}
}}

/// Rest band: call [`RestBand::place`] before every tick.
pub fn rest_band() -> Option<RestBand> {{
    {rest_band}
}}

/// Drive with monitors that waits for its first sample. Only the monitors detect an encoder that freezes at standstill.
pub fn running() -> Running<Monitored<&'static Designed, {encoders}>> {{
    Running::new(Monitored::new(&DRIVE, &BOUNDS){stops})
}}
",
        hash = exported.about.design,
    );
    out
}
