//! FMU of a controller or of its plant: FMI 2.0 for Model Exchange and Co-Simulation, as C sources with their
//! description.
//!
//! A controller is the self-contained C99 file within one wrapper (`c/fmi2/wrapper.h`), which also runs plants. The
//! headers `fmi2*.h` are the official ones of the Modelica Association (2-clause BSD).

use std::fmt::Write as _;

use controller_core::drive::{Encoder, Mounting};
use loop_sim::plant::Parts;
use loop_sim::port::drive::Follows;
use scenario::{Drive, Experiment, Source};
use tick_record::drive::JET;

use self::description::{Description, Kind, Variable};
use super::c99::{File, filled};
use super::{About, Error, Form, drive, export, exported};

mod archive;
mod description;

const WRAPPER: &str = include_str!("c/fmi2/wrapper.h");
/// Begin of every main file: no operation is fused.
const HEAD: &str = include_str!("c/fmi2/head.c");
/// Official headers of FMI 2.0.
const HEADERS: [(&str, &str); 3] = [
    ("fmi2Functions.h", include_str!("c/fmi2/fmi2Functions.h")),
    ("fmi2FunctionTypes.h", include_str!("c/fmi2/fmi2FunctionTypes.h")),
    ("fmi2TypesPlatform.h", include_str!("c/fmi2/fmi2TypesPlatform.h")),
];
/// Speed below which friction that holds fades in an FMU, rad/s: an importer knows no events of a shaft that sticks.
const FADES_RAD_S: f64 = 0.005;

/// FMU without its binary.
pub struct Fmu {
    identifier: String,
    description: String,
    sources: Vec<(String, String)>,
}

impl Fmu {
    /// Returns the name of the only C file to compile and of the binary, without their endings.
    pub fn identifier(&self) -> &str {
        &self.identifier
    }

    /// Returns the files of the folder `sources` with their names.
    pub fn sources(&self) -> &[(String, String)] {
        &self.sources
    }

    /// Returns the description of the model, `modelDescription.xml`.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Returns the bytes of the FMU, with a binary at a path if there is one. Equal inputs give equal bytes.
    pub fn bytes(&self, binary: Option<(&str, &[u8])>) -> Vec<u8> {
        let sources: Vec<_> =
            self.sources.iter().map(|(name, text)| (format!("sources/{name}"), text.as_bytes())).collect();
        let mut entries = vec![("modelDescription.xml", self.description.as_bytes())];
        entries.extend(sources.iter().map(|(name, bytes)| (name.as_str(), *bytes)));
        entries.extend(binary);
        archive::zip(&entries)
    }

    fn new(description: &Description<'_>, variables: &[Variable], main: String, more: Option<String>) -> Self {
        let identifier = description.identifier;
        let mut sources = vec![(format!("{identifier}.c"), main)];
        sources.extend(more.map(|text| (format!("{identifier}.h"), text)));
        sources.push(("fmi2_wrapper.h".into(), WRAPPER.into()));
        sources.extend(HEADERS.map(|(name, text)| (name.into(), text.into())));
        Self { identifier: identifier.into(), description: description.xml(variables), sources }
    }
}

/// Returns the FMU of a controller. Names begin with `prefix`, which is also the identifier of the model.
///
/// # Errors
/// The controller cannot be exported as C; the message has the remedy.
pub fn fmu(experiment: &Experiment, source: &Source<'_>, prefix: &str) -> Result<Fmu, Error> {
    let header = export(experiment, source, Form::Standalone(prefix))?;
    let about = About::of(experiment, source);
    let guid = format!("{prefix}-{}-{:#010x}", controller_core::VERSION, about.design);
    let (template, variables, parts) = if let Some(drive) = &experiment.drive {
        let (variables, parts) = of_drive(drive);
        (include_str!("c/fmi2/drive.c"), variables, parts)
    } else {
        let exported = exported(experiment, source)?;
        let (variables, known) = of_chain(usize::from(exported.download.shape.n), &exported.channels());
        (include_str!("c/fmi2/chain.c"), variables, [String::new(), String::new(), known])
    };
    let [encoders_and_split, sample, known] = parts.map(|part| File::new(prefix).c(&part));
    let inputs = variables.iter().filter(|variable| variable.is_real_input()).count();
    let outputs = variables.iter().filter(|variable| variable.is_real_output()).count();
    let title = format!("Controller {}: {}", experiment.name, experiment.title);
    let main = filled(
        &File::new(prefix).c(template),
        &[
            ("head", &HEAD),
            ("version", &controller_core::VERSION),
            ("identifier", &prefix),
            ("guid", &guid),
            ("period", &format!("{:?}", experiment.period_s)),
            ("inputs", &inputs),
            ("outputs", &outputs),
            ("split", &encoders_and_split),
            ("sample", &sample),
            ("known", &known),
            // Last, so that nothing is inserted into it.
            ("title", &super::harmless(&title)),
        ],
    );
    let text = format!("{title}. Design {:#010x}, T = {:?} s", about.design, experiment.period_s);
    let description = Description {
        identifier: prefix,
        name: &experiment.name,
        text: &text,
        guid: &guid,
        span_s: experiment.span_s,
        step_s: experiment.period_s,
    };
    Ok(Fmu::new(&description, &variables, main, Some(header)))
}

/// Returns the status, the reset and the outputs of every controller.
fn common(sigma: &'static str, current: &'static str) -> [Variable; 3] {
    [
        Variable::new("u", current, "control to hold until the next tick, within its limits", Kind::Output),
        Variable::new("sigma", sigma, "sliding variable", Kind::Output),
        Variable::new("sigma_star", sigma, "sliding variable without its initial offset", Kind::Output),
    ]
}

/// Returns the integer output and the Boolean input.
fn health_and_reset() -> [Variable; 2] {
    [
        Variable::new("health", "", "status flags, a sum of powers of two; 0 is good", Kind::Health),
        Variable::new("reset", "", "true: clears the state before the tick, also after a stop", Kind::Reset),
    ]
}

fn applied(unit: &'static str) -> Variable {
    let text = "control that the actuator held since the last tick; NaN: u itself";
    Variable::new("applied", unit, text, Kind::Sampled(f64::NAN))
}

/// Returns the variables of a chain and the statements that write its estimates.
fn of_chain(order: usize, channels: &[usize]) -> (Vec<Variable>, String) {
    let state = |i: usize| Variable::new(format!("x[{i}]"), "", format!("state {i}"), Kind::Sampled(0.0));
    let estimate = |i: &usize| {
        Variable::new(format!("d_hat[{i}]"), "", format!("estimated disturbance of channel {i}"), Kind::Output)
    };
    let mut variables: Vec<Variable> = (1..=order).map(state).collect();
    variables.push(applied(""));
    variables.extend(common("", ""));
    variables.extend(channels.iter().map(estimate));
    variables.extend(health_and_reset());
    let write = |(k, i): (usize, &usize)| format!("    out[{k}] = (double)d_hat[{}][0];\n", i - 1);
    (variables, (3..).zip(channels).map(write).collect())
}

/// Returns the variables of a drive, and the three parts of its C file: encoders and targets, sample, estimates.
fn of_drive(of: &Drive) -> (Vec<Variable>, [String; 3]) {
    let encoders = drive::encoders(of);
    let follows_position = of.designed.form().follows == Follows::Position;
    let (mut variables, mut parts) = (Vec::new(), [String::new(), String::new(), String::new()]);
    let [top, sample, known] = &mut parts;
    let mut next = 0..;
    let mut at = || next.next().unwrap_or(0);
    for (shaft, encoder, mounting) in &encoders {
        let name = name_of(shaft, "angle");
        let text = "true angle, rounded to counts by the encoder of the scenario; NaN: lost count";
        variables.push(Variable::new(name, "rad", text, Kind::Sampled(0.0)));
        *top += &encoder_c(shaft, *encoder, *mounting);
        let _ = writeln!(
            sample,
            "    memory->sample.lost{shaft} = fmu_count(&fmu_encoder{shaft}, in[{}], &memory->sample.count{shaft});",
            at()
        );
    }
    *sample += "    memory->sample.begin = memory->sample.end;\n";
    let when = "at the end of the tick in which u is held";
    let units = ["rad", "rad/s", "rad/s2", "rad/s3"];
    let derivatives = if follows_position { 2 * encoders.len() } else { 1 };
    if follows_position {
        *top += include_str!("c/fmi2/split.c");
        for (j, unit) in units.iter().enumerate().take(derivatives) {
            let [name, what] = match j {
                0 => ["target".into(), "target".into()],
                _ => [JET[j].replacen('r', "target", 1), format!("derivative {j} of the target")],
            };
            variables.push(Variable::new(name, unit, format!("{what} {when}"), Kind::Sampled(0.0)));
            let _ = match j {
                0 => writeln!(sample, "    fmu_split(in[{}], &memory->sample.end);", at()),
                _ => writeln!(sample, "    memory->sample.end.{} = (float)in[{}];", JET[j], at()),
            };
        }
    } else {
        variables.push(Variable::new("target_speed", "rad/s", format!("speed {when}"), Kind::Sampled(0.0)));
        let _ = writeln!(sample, "    memory->sample.end = (float)in[{}];", at());
    }
    variables.push(applied("A"));
    let sigma = if follows_position { units[derivatives - 1] } else { "rad/s" };
    variables.extend(common(sigma, "A"));
    let mut outputs = 3..;
    for (shaft, ..) in &encoders {
        let position = format!("((double)known.turn * FMU_TAU) + (double)known.position{shaft}");
        let estimates = [
            ("angle_estimate", "rad", "estimated angle", position),
            ("speed_estimate", "rad/s", "estimated speed", format!("(double)known.speed{shaft}")),
            ("load_estimate", "N.m", "estimated torque against the shaft", format!("(double)known.load{shaft}")),
        ];
        for (name, unit, text, value) in estimates {
            variables.push(Variable::new(name_of(shaft, name), unit, text, Kind::Output));
            let _ = writeln!(known, "    out[{}] = {value};", outputs.next().unwrap_or(0));
        }
    }
    variables.extend(health_and_reset());
    let text = "true: a current flows from the first valid counts on, as in host-sim run; false: the drive first waits \
                for consistent counts, as in firmware";
    variables.push(Variable::new("start_at_once", "", text, Kind::Parameter));
    (variables, parts)
}

/// Returns the name of a quantity of a shaft, whose suffix in C is `_link`, `_motor` or empty.
fn name_of(shaft: &str, quantity: &str) -> String {
    match shaft.strip_prefix('_') {
        Some(shaft) => format!("{shaft}_{quantity}"),
        None => quantity.into(),
    }
}

/// Returns an encoder as a C constant.
fn encoder_c(shaft: &str, encoder: Encoder, mounting: Mounting) -> String {
    let Encoder { counts_per_turn, gear_num, gear_den, .. } = encoder;
    let [counts, num, den] = [counts_per_turn, gear_num, gear_den].map(f64::from);
    let (states, offset) = (encoder.counter() as f64, f64::from(mounting.offset_counts));
    let reversed = mounting.is_reversed;
    format!(
        "\nstatic const fmu_encoder_type fmu_encoder{shaft} = {{ {counts:?}, {num:?}, {den:?}, {states:?}, {offset:?}, \
         {reversed} }};\n"
    )
}

/// Returns the FMU of the simulated motor or joint, with the load as an input. The identifier of the model is `prefix`
/// and `_plant`. Friction that holds fades below 0.005 rad/s.
///
/// # Errors
/// The plant is not a motor or joint, or has play or a supply.
pub fn plant_fmu(experiment: &Experiment, prefix: &str) -> Result<Fmu, Error> {
    let drive = experiment.drive.as_ref().ok_or(Error::FmuPlant("another plant"))?;
    let Some(Parts::Shafts { numbers, .. }) = experiment.plant.parts() else {
        return Err(Error::FmuPlant("play or a supply"));
    };
    let order = experiment.plant.order();
    let states = &drive.states[..order];
    let mut variables = vec![
        Variable::new("u", "A", "current command", Kind::Continuous(0.0)),
        Variable::new("load", "N.m", "torque against positive motion; on the link of a joint", Kind::Continuous(0.0)),
    ];
    let name = |name: &str| name.replace(' ', "_");
    let start = |i: usize| experiment.x0.get(i).copied().unwrap_or(0.0);
    for (i, (state, unit)) in states.iter().enumerate() {
        variables.push(Variable::new(name(state), unit, *state, Kind::State(start(i))));
    }
    for (i, (state, _)) in states.iter().enumerate() {
        let text = format!("derivative of the {state}");
        variables.push(Variable::new(format!("der({})", name(state)), "", text, Kind::Derivative(i + 3)));
    }
    let line = |i: usize| format!("    x[{i}] = {:?};\n", start(i));
    let starts: String = (0..order).map(line).collect();
    let (torque, rates) = rates(numbers, order);
    let step_s = (0.1 * experiment.period_s).min(0.1 / fastest_rad_s(numbers, order));
    let identifier = format!("{prefix}_plant");
    let title = format!("Plant {}: {}", experiment.name, experiment.title);
    let current = if order % 2 == 1 { format!("x[{}]", order - 1) } else { "in[0]".into() };
    let main = |guid: &str| {
        filled(
            include_str!("c/fmi2/plant.c"),
            &[
                ("head", &HEAD),
                ("version", &controller_core::VERSION),
                ("guid", &guid),
                ("step", &format!("{step_s:?}")),
                ("states", &order),
                ("start", &starts),
                ("current", &current),
                ("torque", &torque),
                ("rates", &rates),
                ("title", &super::harmless(&title)),
            ],
        )
    };
    // The identity of a plant is its right-hand side and its start.
    let guid = format!("{identifier}-{}-{:#010x}", controller_core::VERSION, pil_wire::checksum(main("").as_bytes()));
    let description = Description {
        identifier: &identifier,
        name: &format!("{} plant", experiment.name),
        text: &title,
        guid: &guid,
        span_s: experiment.span_s,
        step_s: experiment.period_s,
    };
    Ok(Fmu::new(&description, &variables, main(&guid), None))
}

/// Returns 1/ω_t of the friction of an FMU.
fn per_smooth(friction: [f64; 4]) -> f64 {
    if friction[3].is_finite() { friction[3] } else { 1.0 / FADES_RAD_S }
}

/// Returns the C statements of the torque on the motor, and of the derivatives.
fn rates(numbers: &[[f64; 4]], order: usize) -> (String, String) {
    let [per_inertia, torque_per_a, damping, per_lag] = numbers[0];
    let [cogging, cogging_per_turn, ripple, ripple_per_turn] = numbers[1];
    let friction @ [coulomb, beyond, per_stribeck, _] = numbers[2];
    let (angle, speed) = if order > 3 { (2, 3) } else { (0, 1) };
    let mut torque = format!("{torque_per_a:?} * current");
    if ripple != 0.0 {
        torque = format!("{torque} * (1.0 + ({ripple:?} * sin({ripple_per_turn:?} * x[{angle}])))");
    }
    let mut torque = format!("    double torque = {torque}; /* on the motor, N m */\n");
    if cogging != 0.0 {
        let _ = writeln!(torque, "    torque += {cogging:?} * sin({cogging_per_turn:?} * x[{angle}]);");
    }
    if coulomb != 0.0 || beyond != 0.0 {
        let smooth = per_smooth(friction);
        let _ = writeln!(torque, "    const double bell = x[{speed}] * {per_stribeck:?};");
        let _ = writeln!(
            torque,
            "    torque -= ({coulomb:?} + ({beyond:?} * exp(-(bell * bell)))) * tanh(x[{speed}] * {smooth:?});"
        );
    }
    let mut rates = String::from("    dx[0] = x[1];\n");
    if let [_, _, _, [per_link, link_damping, weight, stiffness], [spring_damping, ..]] = numbers {
        let _ = writeln!(
            torque,
            "    const double spring = ({stiffness:?} * (x[2] - x[0])) + ({spring_damping:?} * (x[3] - x[1]));"
        );
        let _ = write!(
            rates,
            "    dx[1] = (spring - ({link_damping:?} * x[1]) - ({weight:?} * sin(x[0])) - in[1]) * {per_link:?};\n    \
             dx[2] = x[3];\n    dx[3] = (torque - spring - ({damping:?} * x[3])) * {per_inertia:?};\n"
        );
    } else {
        let _ = writeln!(rates, "    dx[1] = (torque - ({damping:?} * x[1]) - in[1]) * {per_inertia:?};");
    }
    if order % 2 == 1 {
        let _ = writeln!(rates, "    dx[{at}] = (in[0] - x[{at}]) * {per_lag:?};", at = order - 1);
    }
    (torque, rates)
}

/// Returns an upper estimate of the fastest rate of a plant, rad/s.
fn fastest_rad_s(numbers: &[[f64; 4]], order: usize) -> f64 {
    let [per_inertia, _, damping, per_lag] = numbers[0];
    let [cogging, cogging_per_turn, ..] = numbers[1];
    let friction @ [coulomb, beyond, ..] = numbers[2];
    let steepest =
        if coulomb == 0.0 && beyond == 0.0 { 0.0 } else { coulomb.max(coulomb + beyond) * per_smooth(friction) };
    let mut rate = (damping + steepest) * per_inertia + (cogging.abs() * cogging_per_turn * per_inertia).sqrt();
    if let [_, _, _, [per_link, link_damping, weight, stiffness], [spring_damping, ..]] = numbers {
        rate += (stiffness * (per_link + per_inertia) + weight.abs() * per_link).sqrt();
        rate += link_damping * per_link + spring_damping * (per_link + per_inertia);
    }
    if order % 2 == 1 { rate.max(per_lag) } else { rate }.max(f64::MIN_POSITIVE)
}
