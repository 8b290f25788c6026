//! Drive of a motor or of a joint as a source file: C99 or assembly with a header from its operation traces, Rust from
//! its design, or the configuration from which the static library designs it (module `config`).
//!
//! In C every part of the tick is generated from an operation trace ([`tick_record::drive`]). This file adds types,
//! comments of the functions, and the calls between the functions. The functions `tick`, `tick_or_start` and `lost`
//! have no arithmetic.

use std::fmt::Write as _;

use controller_core::drive::{ALARMS, Bounds, Encoder, JointDesign, LowerGains, MotorDesign, Mounting};
use controller_core::drives;
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows, Form as DriveForm, Reaction, Thresholds, Typed, typed};
use scenario::Drive;
use tick_record::drive::{DriveFunctions, JET, QUEUED, joint, joint_tick, motor, motor_tick};
use tick_record::{Port, Record, Role, ValueKind, c};

use super::arm::{DriveAssembly, DriveLayout, Effort, drive_assembly};
use super::c99::{File, Meanings, filled};
use super::standalone::FUNCTIONS;
use super::{About, Error, Files, Form, assembly, config, plan, rust};

pub(super) fn text(drive: &Drive, about: &About<'_>, form: Form<'_>) -> Result<String, Error> {
    match form {
        Form::Standalone(prefix) => {
            let (exported, functions) = (Exported::of(drive, about)?, functions(drive)?);
            let file = File::new(prefix);
            Ok(C { exported: &exported, functions: &functions, file, assembly: None }.text())
        }
        Form::Means(prefix, function) => means_of_c(drive, &functions(drive)?, prefix, function),
        Form::MeansOfAssembly(prefix, function) => {
            supports_assembly(drive)?;
            means(drive, &functions(drive)?, prefix, function)
        }
        Form::Archive(prefix) => config::text(drive, about, prefix),
        Form::Rust => Ok(rust::drive(&Exported::of(drive, about)?)),
    }
}

/// Returns the functions as assembly with their header: the header of the C file, with declarations instead of
/// functions.
pub(super) fn files(drive: &Drive, about: &About<'_>, prefix: &str, effort: &Effort) -> Result<Files, Error> {
    supports_assembly(drive)?;
    let (exported, functions) = (Exported::of(drive, about)?, functions(drive)?);
    let assembly = drive_assembly(&functions, prefix, effort)?;
    let file = File::new(prefix);
    let header = C { exported: &exported, functions: &functions, file, assembly: Some(&assembly) }.text();
    Ok(Files { assembly: assembly::text(prefix, &about.origin(), &assembly.text), header })
}

/// Checks the delay: the register allocation of the assembly is verified for at most one tick.
fn supports_assembly(drive: &Drive) -> Result<(), Error> {
    let delay_ticks = drive.designed.form().delay_ticks;
    if delay_ticks > 1 { Err(Error::AssemblyDelay(delay_ticks)) } else { Ok(()) }
}

/// Further functions of the assembly.
const PARTS: [&str; 9] = ["tick_u", "begin", "observe", "law", "give_up", "refuse", "pass", "follow", "carry"];

/// Returns the specification of one assembly function for `cycle-bound --means`.
fn means(drive: &Drive, functions: &DriveFunctions, prefix: &str, function: &str) -> Result<String, Error> {
    let part = match function {
        "begin" => Some(&functions.begin),
        "observe" => Some(&functions.observe),
        "law" => Some(&functions.law),
        "give_up" => Some(&functions.give_up),
        "refuse" => Some(&functions.refuse),
        "pass" => Some(&functions.pass),
        "follow" => Some(&functions.follow),
        "carry" => Some(&functions.carry),
        _ => None,
    };
    let record = match (part, function) {
        (Some(part), _) => part.clone(),
        (None, "tick_u") => tick(drive)?,
        _ => recorded_function(drive, functions, function, &PARTS)?,
    };
    let layout = DriveLayout::of(functions);
    let place = |port: &Port| layout.means(function, port, &record.results);
    let symbol = format!("{prefix}_{function}");
    Ok(tick_record::text::text(&symbol, &record, &place, &|port| place(port).into_iter().collect(), ""))
}

/// Returns a function that C and assembly share; `more` lists further function names for the error message.
fn recorded_function(
    drive: &Drive,
    functions: &DriveFunctions,
    function: &str,
    more: &[&'static str],
) -> Result<Record, Error> {
    Ok(match function {
        "start" => functions.start.clone(),
        "tick" => tick(drive)?,
        "not_started" => functions.not_started.clone(),
        "report_applied" => functions.report_applied.clone(),
        "estimates" => functions.estimates.clone(),
        "reset" => functions.reset.clone(),
        _ => return Err(Error::Function { name: function.into(), functions: [&FUNCTIONS[..], more].concat() }),
    })
}

/// Returns the specification of one function of the C file. Places follow ARM's calling convention and the types of the
/// file: words, and flags of one byte each.
fn means_of_c(drive: &Drive, functions: &DriveFunctions, prefix: &str, function: &str) -> Result<String, Error> {
    let record = recorded_function(drive, functions, function, &[])?;
    // Registers with the addresses of the state, of the sample and of the output.
    let [state, sample, output] = match function {
        "start" => [0, 1, 4],
        "tick" => [0, 1, 2],
        "not_started" => [4, 4, 0],
        "estimates" => [0, 4, 1],
        _ => [0, 4, 4],
    };
    let shafts = functions.state.iter().filter(|word| word.name.starts_with("last")).count();
    let inputs = || functions.start.inputs.iter().chain(&functions.law.inputs);
    let of_sample = |name: &str| {
        let lost = || inputs().filter(|port| port.name.starts_with("lost"));
        if let Some(i) = lost().position(|port| port.name == name) {
            return Some(4 * shafts + i);
        }
        let (when, of) = name.split_once('_')?;
        let order: Vec<&str> = ["turn", "speed"].into_iter().chain(JET.into_iter().take(2 * shafts)).collect();
        let has =
            |one: &&str| inputs().any(|port| port.name == format!("end_{one}") || port.name == format!("begin_{one}"));
        let target: Vec<&str> = order.into_iter().filter(has).collect();
        let at = target.iter().position(|one| *one == of)? + if when == "end" { target.len() } else { 0 };
        Some(4 * shafts + 4 + 4 * at)
    };
    let place = |port: &Port| {
        Some(match port.role {
            Role::State => {
                let at = places(&functions.state).into_iter().find(|(name, _)| *name == port.name)?.1;
                format!("r{state}+{at}")
            }
            Role::Sample(i) => format!("r{sample}+{}", 4 * i),
            Role::Argument if port.name == "u" => "s0".into(),
            Role::Argument => format!("r{sample}+{}", of_sample(&port.name)?),
            Role::Output => {
                let all = record.results.iter().filter(|port| port.role == Role::Output);
                format!("r{output}+{}", 4 * all.map(|port| &port.name).position(|name| *name == port.name)?)
            }
            Role::Flag(bit) => format!("r0 bit {bit}"),
            Role::Answer => "r0".into(),
            Role::Between | Role::Estimate(..) => return None,
        })
    };
    let symbol = format!("{prefix}_{function}");
    Ok(tick_record::text::text(&symbol, &record, &place, &|port| place(port).into_iter().collect(), ""))
}

/// Returns the byte offsets of the members of a C type: words, and flags of one byte each.
fn places(members: &[Port]) -> Vec<(&str, usize)> {
    let mut end = 0_usize;
    let place = |port: &Port| {
        let size = if port.kind == ValueKind::Truth { 1 } else { 4 };
        let at = end.next_multiple_of(size);
        end = at + size;
        at
    };
    let at: Vec<usize> = members.iter().map(place).collect();
    members.iter().map(|port| port.name.as_str()).zip(at).collect()
}

pub(super) struct Exported<'a> {
    pub(super) drive: &'a Drive,
    pub(super) about: &'a About<'a>,
    bounds: Vec<f64>,
    thresholds: Thresholds,
}

/// Dispatches on the type of a drive: control mode, high gain sets, ticks of delay, and observer states of a motor.
macro_rules! of_its_type {
    ($drive:expr, $of_motor:ident, $of_joint:ident) => {{
        let types = $drive.designed.form().types();
        let made = match &$drive.designed {
            DriveDesign::Motor(DriveOf { design, mounted: [mounted], .. }) => {
                drives!(motor types => $of_motor!(design, mounted.mounting,))
            }
            DriveDesign::Joint(DriveOf { design, mounted, .. }) => {
                let mounting = mounted.map(|mounted| mounted.mounting);
                drives!(joint types => $of_joint!(design, mounting,))
            }
        };
        made.map_err(Error::Drive)
    }};
}

/// Returns the operation traces of the parts of a drive's tick.
pub(super) fn functions(drive: &Drive) -> Result<DriveFunctions, Error> {
    macro_rules! of_motor {
        ($design:expr, $mounting:expr, $aim:ty, $fast:literal, $late:literal, $states:literal) => {
            motor::<Typed<$aim>, $fast, { typed($late) }, $states>($design, $mounting)
        };
    }
    macro_rules! of_joint {
        ($design:expr, $mounting:expr, $aim:ty, $fast:literal, $late:literal) => {
            joint::<Typed<$aim>, $fast, { typed($late) }>($design, $mounting)
        };
    }
    of_its_type!(drive, of_motor, of_joint)
}

/// Returns the operation trace of one whole tick.
fn tick(drive: &Drive) -> Result<Record, Error> {
    macro_rules! of_motor {
        ($design:expr, $mounting:expr, $aim:ty, $fast:literal, $late:literal, $states:literal) => {
            motor_tick::<Typed<$aim>, $fast, { typed($late) }, $states>($design, $mounting)
        };
    }
    macro_rules! of_joint {
        ($design:expr, $mounting:expr, $aim:ty, $fast:literal, $late:literal) => {
            joint_tick::<Typed<$aim>, $fast, { typed($late) }>($design, $mounting)
        };
    }
    of_its_type!(drive, of_motor, of_joint)
}

impl<'a> Exported<'a> {
    fn of(drive: &'a Drive, about: &'a About<'a>) -> Result<Self, Error> {
        let (bounds, thresholds) = drive.designed.thresholds().map_err(Error::Drive)?;
        Ok(Self { drive, about, bounds, thresholds })
    }

    pub(super) fn period_s(&self) -> f64 {
        self.drive.designed.period_s()
    }

    /// Returns the title in two lines: plant, precision and period; then control mode, observer states, gain sets and
    /// delay.
    pub(super) fn title(&self) -> String {
        let DriveForm { follows, gain_sets, delay_ticks, observer_states } = self.drive.designed.form();
        // A coupled joint has position, speed and disturbance for each shaft.
        let observer_states = if self.drive.designed.is_whole() { 3 } else { observer_states };
        format!(
            "Drive of {}, f32, T = {:?} s.\n{}, {observer_states} observer states per encoder, {}, {}.",
            self.drive.designed.title(),
            self.period_s(),
            if follows == Follows::Position { "Position control" } else { "Speed control" },
            if gain_sets > 1 { "2 gain sets" } else { "1 gain set" },
            match delay_ticks {
                0 => "no delay".into(),
                late => format!("u held {} late", ticks_in_words(late)),
            },
        )
    }

    /// Returns the bounds of the monitors as Rust source.
    pub(super) fn bounds(&self) -> String {
        match self.thresholds.disturbance.len() {
            1 => format!("{:#?}", Bounds::<1>::from_numbers(self.bounds.iter().copied())),
            _ => format!("{:#?}", Bounds::<2>::from_numbers(self.bounds.iter().copied())),
        }
    }

    /// Returns the encoders with their suffixes in names.
    fn encoders(&self) -> Vec<(String, Encoder, Mounting)> {
        encoders(self.drive)
    }
}

/// Returns the encoders with their suffixes in names.
pub(super) fn encoders(drive: &Drive) -> Vec<(String, Encoder, Mounting)> {
    let Drive { shafts, designed, .. } = drive;
    let place = |name: &str| if shafts.len() > 1 { format!("_{name}") } else { String::new() };
    let encoders = shafts.iter().zip(designed.encoders());
    encoders.map(|(shaft, (_, mounted))| (place(shaft.name), mounted.encoder, mounted.mounting)).collect()
}

/// Returns a delay in words.
fn ticks_in_words(ticks: usize) -> String {
    match ticks {
        1 => "one tick".into(),
        2 => "two ticks".into(),
        3 => "three ticks".into(),
        _ => format!("{ticks} ticks"),
    }
}

/// Comments of constants, by the beginning of their names; a longer beginning comes first.
const CONSTANTS: [(&str, &str); 71] = [
    ("k1", "K_s/J_l, 1/s^2; x_3 is k1 times the motor's angle"),
    ("b1", "damping of the link, 1/s"),
    ("gravity", "weight of the link divided by its inertia, 1/s^2"),
    ("half_spring", "k1 k2/2"),
    ("b2", "damping of the motor, 1/s"),
    ("cross", "b1^2 - k1"),
    ("drag", "-B/J, 1/s"),
    ("base", ""),
    ("kappa", "stiffness of the coupled model, 1/s^2"),
    ("phi", "coupled model of a tick"),
    ("g2", "coupled model of a tick"),
    ("g1", "coupled model of a tick"),
    ("h1", "coupled model of a tick"),
    ("k_link", "K/J_l, 1/s^2"),
    ("k_motor", "K/J_m, 1/s^2"),
    ("b_link", "damping of the link, 1/s"),
    ("b_motor", "damping of the motor, 1/s"),
    ("b_current", "K_t/J_m, rad/s^2 per A"),
    ("d_in_chain", "disturbance of the motor in chain coordinates, for the law"),
    ("spring", "acceleration per twist, 1/s^2"),
    ("twist_unit", "twist of one common count of both encoders, rad"),
    ("current_q", "position per lagging current, rad/A"),
    ("current_v", "speed per lagging current, rad/(s A)"),
    ("keeps", "e^(-T/lag), current loop"),
    ("link_across", "observer gain, motor encoder to link"),
    ("motor_across", "observer gain, link encoder to motor"),
    ("link_more", "observer gain, high minus base"),
    ("motor_more", "observer gain, high minus base"),
    ("k_current", "law, on the current minus the reference current"),
    ("ahead", "feed-forward, on the errors in the model's acceleration"),
    ("burst", "largest duration of the high gains, ticks"),
    ("rest", "calm ticks before the high gains may return"),
    ("gain", "observer gain"),
    ("more", "observer gain, high minus base"),
    ("unit", "one count"),
    ("half_span", "half a counter"),
    ("edge", "9/16 of the base count range"),
    ("calm", "smoothed innovation at which the high gains begin"),
    ("rate", "slope of the high gains over the innovation"),
    ("smoothing", "1 - e^(-T/3 ms), by default"),
    ("keep", "e^(-T/20 ms), by default"),
    ("gate", "innovation gate"),
    ("closing", "closing rate of the innovation gate after a re-tune"),
    ("quarter", "quarter of the counter or of the base, the smaller"),
    ("lost_ticks", "largest number of consecutive missing samples"),
    ("step_price", "cost of a position step, plus 1 each; 4 in 0.1 s are too many"),
    ("forgetting", "e^(-T/0.1 s), for the cost of position steps"),
    ("start_ticks", "ticks of consistent counts before a current flows"),
    ("inertia", "inertia, kg m^2"),
    ("far", "limit of e_1"),
    ("agreement", "tolerance of consistent counts per tick"),
    ("c_d", "surface, on d"),
    ("c_growth", "surface, on d'"),
    ("c_", "surface"),
    ("k_d", "law, on d"),
    ("k_growth", "law, on d'"),
    ("k_last", "law, on d' in the last channel"),
    ("k_offset", "law, on W if us acts on sigma"),
    ("kx_", "law, on the errors"),
    ("feed_", "feed-forward, on the change of the reference in the tick"),
    ("kw", "law, on the offset W"),
    ("us", "law, on sigma*"),
    ("decay", "1 - e^(-alpha T)"),
    ("per_b", "1/b"),
    ("period", "T, s"),
    ("full_turn", "2 pi"),
    ("u_m", "limit, A"),
    ("plausible", "a demand above it is checked, A"),
    ("hold", "output of a rejected tick: hold u + fallback"),
    ("fallback", "fallback, A"),
    ("input_limit", "largest valid number"),
];

/// Comments of the words of the state, by the beginning of their names.
const WORDS: [(&str, &str); 28] = [
    ("fresh", "no tick has passed since the start"),
    ("started", ""),
    ("last", "last valid count"),
    ("at", "last valid count, relative to the base"),
    ("turn", "revolution of the base"),
    ("push", "half of the spring coupling at the last tick"),
    ("push_current", "estimated current, A"),
    ("push_asked", "reference current, A"),
    ("burst", "ticks with high gains; below 0: calm ticks until they may return"),
    ("p", "estimated position minus the position of its count"),
    ("v", "estimated speed"),
    ("d_dot", "rate of the estimated disturbance"),
    ("d", "estimated disturbance, an acceleration"),
    ("smoothed", "smoothed innovation"),
    ("level", "share of the high gains, 0 to 1"),
    ("reach", "temporary widening of the innovation gate"),
    ("missed", "consecutive counts that were not used"),
    ("off", "innovation of the last unused count"),
    ("doubt", "cost of recent position steps; while fresh: consistent counts still needed"),
    ("offset", "W = sigma(0) e^(-alpha t)"),
    ("held", "current that the actuator held since the last tick, A"),
    ("limit", "largest current of the power stage, A"),
    ("reported", "last report well below the output, A; below 0: the limit was set"),
    ("queued_3", "current in two ticks, A"),
    ("queued_2", "current in one tick, A"),
    ("queued", "present current, A"),
    ("g_", "g sin, g cos of the link"),
    ("", ""),
];

fn said(of: &Meanings, name: &str) -> &'static str {
    let of = of.iter().filter(|(beginning, _)| name.starts_with(beginning));
    of.max_by_key(|(beginning, _)| beginning.len()).map_or("", |(_, meaning)| meaning)
}

/// Returns the text on the reaction to an alarm.
const fn followed(reaction: Reaction) -> &'static str {
    match reaction {
        Reaction::GoOn => "is only reported, as in the scenario",
        Reaction::Brake => {
            "lets the drive brake on its estimated speed while its counts are valid (@@_BRAKES).\n * After that, \
             or at rest, the safe current is the output (@@_STOPPED), as in the scenario"
        }
        Reaction::Fallback => "stops the drive, as in the scenario",
        Reaction::JoinedStop { .. } => {
            "requires a stop that you plan (@_plan_stop, @@_STOP_TICKS), as in the scenario.\n * The last two \
             stop the drive"
        }
    }
}

/// Returns the C statements for an external alarm.
const fn tripped(reaction: Reaction) -> &'static str {
    match reaction {
        Reaction::Brake => include_str!("c/trip_brakes.h"),
        Reaction::Fallback => "    monitor->stopped = true;\n",
        Reaction::GoOn | Reaction::JoinedStop { .. } => {
            "    (void)monitor; /* the alarm is only reported, or you plan a stop */\n"
        }
    }
}

/// Returns the comment on the assembly: calling convention, cycles and lower bound.
fn told(assembly: &DriveAssembly) -> String {
    format!(
        " *
 * The assembler file next to this one contains the functions, for a Cortex-M4F with arguments in float registers
 * (-mfloat-abi=hard). The results equal the Rust tick and the C file in every bit; the state has another word order.
 * State, sample and output must not overlap. A typical tick, with all counts accepted, takes {} cycles with
 * @_tick_u and {} with @_tick, return included. The count follows ARM's table of a Cortex-M4 (DDI 0439D); it is
 * not measured on silicon. No order of these operations takes less than {} and {}: the lower bound in
 * docs/reference/cycles.md.
",
        assembly.cycles, assembly.cycles_whole, assembly.floor, assembly.floor_whole,
    )
}

struct C<'a> {
    exported: &'a Exported<'a>,
    functions: &'a DriveFunctions,
    file: File<'a>,
    /// The assembly, if this file is its header.
    assembly: Option<&'a DriveAssembly>,
}

impl C<'_> {
    fn text(&self) -> String {
        let [open, close] = match self.assembly {
            Some(_) => ["\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n", "\n#ifdef __cplusplus\n}\n#endif\n"],
            None => [""; 2],
        };
        let (includes, form) = match self.assembly {
            Some(_) => ("#include <stddef.h>\n#include <stdint.h>\n", "ASSEMBLY"),
            None => ("#include <stdint.h>\n", "STANDALONE"),
        };
        let [demands, defines, types] = [self.file.demands(includes), self.defines(), self.types()];
        let functions = [open.into(), self.parts(), self.functions(), close.into()].concat();
        let body =
            [demands, defines, types, functions, self.monitors(), self.plans(), self.file.modes(), self.file.tail()]
                .concat();
        let head = self.file.head(&self.exported.title(), &self.usage(), &self.exported.about.origin());
        head + &self.file.guarded(form, &body)
    }

    fn follows_position(&self) -> bool {
        self.exported.drive.designed.form().follows == Follows::Position
    }

    /// Returns the name suffixes of the encoders.
    fn shafts(&self) -> Vec<String> {
        self.exported.encoders().into_iter().map(|(shaft, ..)| shaft).collect()
    }

    /// Returns the comment on the use of the functions: an interrupt, then every call.
    fn usage(&self) -> String {
        let exported = self.exported;
        let mut interrupt = vec![
            ("static @_state state;".into(), "once; zeros before the start".into()),
            ("static @_monitor monitor;".into(), String::new()),
            ("static @_sample sample;".into(), String::new()),
            ("@_output output;".into(), "in the timer interrupt, every T".into()),
        ];
        for (shaft, encoder, _) in exported.encoders() {
            let register = match encoder.counter() {
                states if !states.is_power_of_two() => format!("0 to {}, all bits", states - 1),
                states if states == 1 << 32 => "all 32 bits".into(),
                states => format!("the low {} bits", states.trailing_zeros()),
            };
            let note = format!("{register} are read; or sample.lost{shaft} = true;");
            interrupt.push((format!("sample.count{shaft} = encoder{shaft}();"), note));
        }
        let of = if self.follows_position() { "target" } else { "speed, rad/s," };
        let when = match exported.drive.designed.form().delay_ticks {
            0 => "at the end of this tick".into(),
            late => format!("at the end of the tick in which u is held: {} from now", ticks_in_words(late)),
        };
        interrupt.push(("sample.begin = sample.end;".into(), "a tick begins where the last one ended".into()));
        interrupt.push(("sample.end = next;".into(), format!("{of} {when}")));
        interrupt.extend(
            [
                ("unsigned health = @_watched_tick(&monitor, &state, &sample, &output);", ""),
                ("set_current(output.u);", "A"),
                ("@_report_applied(&state, held);", "only if the stage holds another current"),
            ]
            .map(|(code, note)| (code.into(), note.into())),
        );
        let mut calls = vec![
            ("@_watched_tick, @_watched_lost", "a tick with monitors; without a sample"),
            ("@_watched_reset, @_watched_trip", "restart after a stop; stop for your own reason"),
            ("@_estimates", "angle, speed and load of each shaft"),
            ("@_report_applied, @_limit", "held current; largest current of a derated stage"),
            ("@_missed", "missed timer interrupts, before the next tick"),
            ("@_tick_or_start, @_lost, @_reset", "the same without monitors: no alarm"),
            ("@_start, @_tick", "their parts: start at a sample; tick of a started drive"),
        ];
        if self.follows_position() {
            calls.extend([
                ("@_plan_rest, _move, _stop, _sine", "make a plan, in the main loop"),
                ("@_plan_play", "the target of a tick, in the interrupt"),
                ("@_plan_at, @_plan_jet", "the target at any tick; start of the next plan"),
                ("@_profile_new, _start, _limit", "set-points that keep limits of speed and acceleration"),
                ("@_profile_go_to, _stop, _keep_within", "their goal; their range"),
                ("@_profile_next, _has_arrived", "the target of a tick, in the interrupt"),
            ]);
        }
        calls.push(("@_modes_ok", "checks the floating-point modes, once at start-up"));
        let calls: Vec<_> = calls.into_iter().map(|(code, note)| (code.into(), note.into())).collect();
        let usage = [
            " *\n *     #include \"this file\"\n".into(),
            self.file.listed(&interrupt),
            " *\n * CALLS. Everything else is internal.\n *\n".into(),
            self.file.listed(&calls),
        ];
        usage.concat() + &self.assembly.map_or_else(String::new, told)
    }

    /// Returns the macros with the numbers of the drive.
    fn defines(&self) -> String {
        let exported = self.exported;
        let mut out = String::new();
        let capitals = &self.file.capitals;
        let limit = exported.drive.max_current_a;
        let _ = write!(
            out,
            "#define {capitals}_VERSION \"{}\"\n\
             #define {capitals}_DESIGN {:#010x}u /* identifies the design: log it */\n\
             #define {capitals}_PERIOD_S {:?}\n#define {capitals}_MAX_CURRENT_A {limit:?} /* of either sign */\n\
             #define {capitals}_DELAY_TICKS {} /* from the computation of a current to its output */\n\
             #define {capitals}_CURRENT_LAG_S {:?} /* time constant of the current loop */\n",
            controller_core::VERSION,
            exported.about.design,
            exported.period_s(),
            exported.drive.designed.form().delay_ticks,
            exported.drive.current_lag_s,
        );
        if let Reaction::JoinedStop { ticks } = exported.drive.designed.reaction() {
            let _ = writeln!(out, "#define {capitals}_STOP_TICKS {ticks}u /* duration of the stop after an alarm */");
        }
        let plant: &[(&str, f64, &str)] = match exported.drive.designed {
            DriveDesign::Motor(DriveOf { design: MotorDesign { motor, .. }, .. }) => &[
                ("INERTIA_KG_M2", motor.inertia_kg_m2, " /* at the controlled shaft, behind the gear */"),
                ("TORQUE_N_M_PER_A", motor.torque_n_m_per_a, ""),
                ("DAMPING_N_M_S", motor.damping_n_m_s, ""),
            ],
            DriveDesign::Joint(DriveOf { design: JointDesign { joint, .. }, .. }) => &[
                ("LINK_INERTIA_KG_M2", joint.link_inertia_kg_m2, ""),
                ("LINK_DAMPING_N_M_S", joint.link_damping_n_m_s, ""),
                ("WEIGHT_N_M", joint.weight_n_m, " /* torque of the weight in the level position */"),
                ("STIFFNESS_N_M", joint.stiffness_n_m, " /* per rad */"),
                ("MOTOR_INERTIA_KG_M2", joint.motor_inertia_kg_m2, " /* of the motor, all behind the gear */"),
                ("MOTOR_DAMPING_N_M_S", joint.motor_damping_n_m_s, ""),
                ("TORQUE_N_M_PER_A", joint.torque_n_m_per_a, ""),
            ],
        };
        for (name, value, note) in plant {
            let _ = writeln!(out, "#define {capitals}_{name} {value:?}{note}");
        }
        for (shaft, encoder, mounting) in exported.encoders() {
            let name = format!("{capitals}_ENCODER{}", shaft.to_ascii_uppercase());
            let Encoder { bits, counts_per_turn, gear_num, gear_den, .. } = encoder;
            let Mounting { is_reversed, offset_counts } = mounting;
            let gear = if gear_num == gear_den {
                "on the shaft itself".into()
            } else {
                format!("gear {gear_num} : {gear_den} (encoder : shaft)")
            };
            let way = if is_reversed { "down" } else { "up" };
            let _ = writeln!(
                out,
                "#define {name}_BITS {bits} /* {gear}; counts {way} with the angle, {offset_counts} at \
                 angle 0 */\n#define {name}_STATES {}u /* number of counts before it wraps; 0 for 2^32 */\n\
                 #define {name}_COUNTS_PER_TURN {counts_per_turn}\n\
                 #define {name}_UNIT_RAD {:?} /* angle of the shaft per count */\n\
                 #define {name}_REVERSED {}\n#define {name}_OFFSET_COUNTS {offset_counts}",
                encoder.counter() as u32,
                encoder.unit_rad(),
                u8::from(is_reversed),
            );
        }
        out
    }

    fn types(&self) -> String {
        let word = |word: &Port| Self::member(word);
        let between = &self.functions.between;
        let layout = self.assembly.map_or_else(String::new, |assembly| {
            let fresh = 4 * assembly.layout.words().count();
            filled(include_str!("c/layout.h"), &[("size", &(fresh + 4)), ("fresh", &fresh), ("started", &(fresh + 1))])
        });
        let parts = [
            include_str!("c/health.h").into(),
            self.target(),
            self.sample(),
            include_str!("c/output.h").into(),
            self.known(),
            "} @_estimates_of;\n\n/* State between two ticks; zeros before the start. */\n".into(),
            "typedef struct {\n".into(),
            self.state().into_iter().map(word).collect(),
            "} @_state;\n\n/* Values that one part of a tick passes to the next. */\ntypedef struct {\n".into(),
            // The assembly uses one word per member.
            between.iter().map(|port| if self.assembly.is_some() { Self::as_word(port) } else { word(port) }).collect(),
            "} @_between;\n".into(),
            layout,
        ];
        self.file.c(&parts.concat())
    }

    /// Returns the type of the target, empty for a speed, which is a number.
    fn target(&self) -> String {
        if !self.follows_position() {
            return String::new();
        }
        let derivatives = JET.iter().enumerate().take(2 * self.shafts().len()).skip(1).map(|(j, name)| {
            let power = if j == 1 { String::new() } else { format!("^{j}") };
            format!("    float {name}; /* rad/s{power} */\n")
        });
        filled(include_str!("c/target.h"), &[("derivatives", &derivatives.collect::<String>())])
    }

    /// Returns the type of a sample.
    fn sample(&self) -> String {
        let (target, unit) = if self.follows_position() { ("@_target", "") } else { ("float", ", rad/s") };
        let shafts = self.shafts();
        let count = |shaft: &String| format!("    uint32_t count{shaft}; /* register of the counter */\n");
        let lost = |shaft: &String| format!("    bool lost{shaft}; /* true: no count in this tick */\n");
        let counts: String = shafts.iter().map(count).chain(shafts.iter().map(lost)).collect();
        filled(include_str!("c/sample.h"), &[("counts", &counts), ("target", &target), ("unit", &unit)])
    }

    /// Returns the members with the estimates of each shaft.
    fn known(&self) -> String {
        let quantities = [
            ("position", "rad"),
            ("speed", "rad/s"),
            ("disturbance", "rad/s^2, acceleration that the model does not explain"),
            ("load", "N m, torque against the shaft: load and friction"),
        ];
        let of =
            |shaft: String| quantities.map(|(name, unit)| format!("    float {name}{shaft}; /* {unit} */\n")).concat();
        self.shafts().into_iter().map(of).collect()
    }

    /// Returns the words of the state in memory order.
    fn state(&self) -> Vec<&Port> {
        let words = &self.functions.state;
        let Some(assembly) = self.assembly else { return words.iter().collect() };
        let placed = assembly.layout.words().filter_map(|name| words.iter().find(|word| word.name == *name));
        placed.chain(words.iter().filter(|word| word.kind == ValueKind::Truth)).collect()
    }

    /// Returns a member that holds any word.
    fn as_word(port: &Port) -> String {
        let kind = if port.kind == ValueKind::Truth { ValueKind::Count } else { port.kind };
        Self::member(&Port { kind, ..port.clone() })
    }

    fn member(word: &Port) -> String {
        let t = match word.kind {
            ValueKind::Number => "float",
            ValueKind::Truth => "bool",
            ValueKind::Count => "uint32_t",
        };
        let meaning = said(&WORDS, &word.name);
        let comment = if meaning.is_empty() { String::new() } else { format!(" /* {meaning} */") };
        format!("    {t} {};{comment}\n", word.name)
    }

    fn function(&self, meaning: &str, head: &str, record: &Record, result: &str) -> String {
        if self.assembly.is_some() {
            return self.file.declaration(meaning, head);
        }
        let place = |port: &Port| {
            let name = &port.name;
            match (port.role, name.split_once('_')) {
                (Role::State, _) => format!("state->{name}"),
                (Role::Flag(_), _) => format!("{}_{}", self.file.capitals, name.to_uppercase()),
                (Role::Between, _) => format!("between->{name}"),
                (Role::Output, _) => format!("{result}->{name}"),
                (_, Some((end @ ("begin" | "end"), "turn"))) => format!("(uint32_t)sample->{end}.turn"),
                (_, Some((end @ ("begin" | "end"), "speed"))) => format!("sample->{end}"),
                (_, Some((end @ ("begin" | "end"), name))) => format!("sample->{end}.{name}"),
                _ if name.starts_with("lost") || name.starts_with("count") => format!("sample->{name}"),
                _ => name.clone(),
            }
        };
        self.file.function(meaning, head, record, &place, &CONSTANTS)
    }

    fn parts(&self) -> String {
        let DriveFunctions { begin, observe, law, give_up, refuse, pass, follow, carry, .. } = self.functions;
        let functions = [
            "\n/* Converts a count to a signed number; the result of a cast would depend on the compiler. */\n".into(),
            c::signed(&self.file.signed()),
            self.function(
                "First part of the first tick after a start, whose estimates are from its sample. Returns false while
 * the drive waits for consistent counts.",
                "bool @_begin(@_state *state, const @_sample *sample, @_between *between)",
                begin,
                "output",
            ),
            self.function(
                "Part of a tick: predicts the counts, accepts or rejects them, and updates the observers. Returns
 * false if more consecutive samples are missing than the observers can bridge.",
                "bool @_observe(@_state *state, const @_sample *sample, @_between *between)",
                observe,
                "output",
            ),
            self.function(
                "Part of a tick: the control law and the update of the state.",
                "unsigned @_law(@_state *state, const @_sample *sample, const @_between *between,
    @_output *output)",
                law,
                "output",
            ),
            self.function(
                "Part of a tick without valid estimates: the output is the fallback, and the observers restart at the
 * counts.",
                "unsigned @_give_up(@_state *state, const @_sample *sample, @_output *output)",
                give_up,
                "output",
            ),
            self.function(
                "Part of a tick without a target: the output is the fallback.",
                "unsigned @_refuse(@_state *state, @_output *output)",
                refuse,
                "output",
            ),
            self.function(
                "Predicts over a period without a tick. Returns false if more periods are missing than the model can
 * predict.",
                "bool @_pass(@_state *state)",
                pass,
                "output",
            ),
            self.function(
                "Part of a tick: moves the base by whole revolutions of the shaft.",
                "void @_follow(@_state *state)",
                follow,
                "output",
            ),
            self.function(
                "Part of a tick with a missing count: moves the last counts with the prediction, by quarters of the
 * counter.",
                "void @_carry(@_state *state)",
                carry,
                "output",
            ),
        ];
        functions.concat()
    }

    /// Returns the monitors that run after a tick. They are comparisons and counters, written by hand; the test
    /// `export_drive` checks that they equal `controller_core::drive::Monitored` bit by bit.
    fn monitors(&self) -> String {
        let Thresholds { disturbance, sigma_star, ticks, gain, .. } = &self.exported.thresholds;
        let reaction = self.exported.drive.designed.reaction();
        let does_brake = reaction == Reaction::Brake;
        let shafts = self.shafts();
        let sides = shafts
            .iter()
            .map(|shaft| format!("    float side{shaft}; /* last disturbance of the shaft over its bound */\n"));
        let zeros = shafts.iter().map(|shaft| format!("    monitor->side{shaft} = 0.0f;\n"));
        let looks = shafts.iter().zip(disturbance).map(|(shaft, bound)| {
            let over = format!("@_watch_side(state->d{shaft}, {bound:?}f, &monitor->side{shaft}, &has_changed)");
            format!("    const bool over{shaft} =\n        {over};\n")
        });
        let driven = shafts.last().map_or("", String::as_str);
        let others = shafts.iter().take(shafts.len() - 1).map(|shaft| {
            format!(
                "    /* Or the disturbances of the two shafts contradict the spring. */\n    wrong_way = wrong_way \
                 ||\n                (over{shaft} && ((state->d{shaft} * state->d{driven}) < 0.0f) && (found > \
                 @_magnitude(wanted)));\n"
            )
        });
        let follows = followed(reaction);
        let stops_at = reaction.stops_at();
        let bits = stops_at.bits() & ALARMS.bits();
        let looks = looks.collect::<String>();
        let over: Vec<String> = shafts.iter().map(|shaft| format!("over{shaft}")).collect();
        let [params, overs] = [", bool ", ", "].map(|before| format!("{before}{}", over.join(before)));
        let [stuck_ticks, patience_ticks] = [ticks.stuck, ticks.patience].map(|number| format!("{number:?}"));
        let then =
            if does_brake { include_str!("c/brakes.h") } else { "        health |= @_watch_stop(monitor, output);\n" };
        let [stop, gave_up, stops] = if stops_at.is_ok() {
            [String::new(), String::new(), String::new()]
        } else {
            let gave_up = "        if (is_lost) { /* the estimates are no longer valid */\n            \
                           return told | @_watch_stop(monitor, output);\n        }\n";
            let stops = filled(include_str!("c/stops.h"), &[("bits", &bits), ("then", &then)]);
            [include_str!("c/stop.h").into(), gave_up.into(), stops]
        };
        let [brake_text, brakes, braking, braking_zero] =
            if does_brake { self.brake(&looks, &overs) } else { Default::default() };
        let (fence, fenced) = self.fence();
        let [rest, resting, leave_rest, placing, sample, hunting] = self.rest_band();
        self.file.c(&filled(
            include_str!("c/monitors.h"),
            &[
                ("follows", &follows),
                ("sides", &sides.collect::<String>()),
                ("zeros", &(braking_zero + &leave_rest + &zeros.collect::<String>())),
                ("looks", &looks),
                ("params", &params),
                ("overs", &overs),
                ("brake", &brake_text),
                ("brakes", &brakes),
                ("apart", &others.collect::<String>()),
                ("shaft", &driven),
                ("gain", &format!("{gain:?}")),
                ("sigma_star", &format!("{sigma_star:?}")),
                ("stuck_ticks", &stuck_ticks),
                ("twice", &format!("{:?}", ticks.stuck + ticks.stuck)),
                ("wrong_way_ticks", &format!("{:?}", ticks.wrong_way)),
                ("patience_ticks", &patience_ticks),
                ("any_over", &over.join(" || ")),
                ("braking", &braking),
                ("gave_up", &gave_up),
                ("trip", &tripped(reaction)),
                ("fence", &fence),
                ("fenced", &fenced),
                ("rest", &rest),
                ("resting", &resting),
                ("placing", &placing),
                ("sample", &sample),
                ("hunting", &hunting),
                ("stop_and_brake", &stop),
                ("stops", &stops),
            ],
        ))
    }

    /// Returns the brake function, the call in a tick, its members and their zeros; `looks` and `overs` come from
    /// [`monitors`](Self::monitors).
    fn brake(&self, looks: &str, overs: &str) -> [String; 4] {
        let Thresholds { disturbance, ticks, brake, limits: [u_min, u_max], per_gain, .. } = &self.exported.thresholds;
        let shafts = self.shafts();
        let driven = shafts.last().map_or("", String::as_str);
        let held = self.put_out();
        let [stuck_ticks, patience_ticks] = [ticks.stuck, ticks.patience].map(|number| format!("{number:?}"));
        let [slope, u_min, u_max, brake_ticks] =
            [*brake, *u_min, *u_max, ticks.brake].map(|number| format!("{number:?}"));
        // The spring of a joint damps the link, so the brake does not hold the load of a joint.
        let (and_load, load, may_hold, holds) = match &disturbance[..] {
            [bound] => (
                " and the load within its bound",
                format!(
                    "    const float load = (monitor->most > 0.0f) ? state->d{driven} : 0.0f;\n    opposed -= \
                     {per_gain:?}f * load;\n"
                ),
                format!("(@_magnitude(state->d{driven}) <= {:?}f) ? most : ", 1.5 * bound),
                format!(
                    "    if (!(@_magnitude(state->d{driven}) <= {:?}f)) {{\n        monitor->most = \
                     -@_magnitude(monitor->most);\n    }}\n",
                    1.5 * bound
                ),
            ),
            _ => ("", String::new(), String::new(), String::new()),
        };
        let text = filled(
            include_str!("c/brake.h"),
            &[
                ("and_load", &and_load),
                ("load", &load),
                ("may_hold", &may_hold),
                ("holds", &holds),
                ("slope", &slope),
                ("u_min", &u_min),
                ("u_max", &u_max),
                ("brake_ticks", &brake_ticks),
                ("stuck_ticks", &stuck_ticks),
                ("patience_ticks", &patience_ticks),
                ("looks", &looks),
                ("overs", &overs),
                ("held", &held),
                ("shaft", &driven),
            ],
        );
        let brakes = "    if (monitor->braking > 0.0f) {\n        return @_brake(monitor, state, told, \
                      output);\n    }\n";
        let member = "    float braking; /* while braking: 1 plus the ticks within the limits without \
                      deceleration */\n\
                      \x20   float most; /* largest demand of the brake; 0 before its first tick, below 0 if \
                      it holds no load */\n";
        let zeros = "    monitor->braking = 0.0f;\n    monitor->most = 0.0f;\n";
        [text, brakes.into(), member.into(), zeros.into()]
    }

    /// Returns the limits of position, speed and error, and their use in a tick; empty without limits.
    fn fence(&self) -> (String, String) {
        let Some(fence) = self.exported.drive.designed.fence() else { return (String::new(), String::new()) };
        let ([low, high], [max_speed, following, constant, per_square, slack]) = fence.thresholds();
        let number = |number: f32| format!("{number:?}f");
        let shaft = &self.shafts()[0];
        // A speed target has no position, so the position error is 0.
        let target = if self.follows_position() {
            filled(include_str!("c/following.h"), &[("shaft", shaft)])
        } else {
            "    const float error = 0.0f;\n    const float r_dot = sample->begin;\n".into()
        };
        let [constant, per_square, slack] = [constant, per_square, slack].map(|number| format!("{number:?}"));
        let fence = filled(
            include_str!("c/fence.h"),
            &[
                ("shaft", shaft),
                ("constant", &constant),
                ("per_square", &per_square),
                ("slack", &slack),
                ("low_turn", &(low.0 as u32)),
                ("high_turn", &(high.0 as u32)),
                ("low", &number(low.1)),
                ("high", &number(high.1)),
                ("max_speed", &number(max_speed)),
                ("following", &number(following)),
                ("target", &target),
            ],
        );
        (fence, include_str!("c/fenced.h").into())
    }

    /// Returns the band at rest: functions, members of the monitor and their zeros, statements before a tick, the name
    /// of the sample passed to the tick, and statements after it.
    fn rest_band(&self) -> [String; 6] {
        let Some(band) = self.exported.drive.designed.rest_band() else {
            return ["", "", "", "", "sample", ""].map(String::from);
        };
        let [count, least, most, rise, slow, stands, load, half] = band.thresholds();
        let number = |number: f32| format!("{number:?}");
        let calm = band.lower_gains().map(|lower| self.calm(lower));
        let [calm, members, leave_calm, lowered, calming] = calm.unwrap_or_default();
        let rest = filled(
            include_str!("c/rest.h"),
            &[
                ("count", &number(count)),
                ("least", &number(least)),
                ("most", &number(most)),
                ("rise", &number(rise)),
                ("slow", &number(slow)),
                ("stands", &number(stands)),
                ("load", &number(load)),
                ("half", &number(half)),
                ("calm", &calm),
                ("leave_calm", &leave_calm),
                ("lowered", &lowered),
            ],
        );
        let member = "    float rest_share; /* active share of the rest band, 0 to 1 */\n\
                      \x20   float rest_width; /* rad to either side; 0: the minimum */\n\
                      \x20   float rest_side; /* side of the target on which the shaft last stood outside the band */\n\
                      \x20   float rest_ticks; /* ticks at standstill */\n\
                      \x20   float rest_error; /* error at the last standstill, rad */\n\
                      \x20   float rest_slipped; /* 1: moved since the last standstill outside the band */\n\
                      \x20   int32_t rest_turn; /* revolution of the target */\n\
                      \x20   float rest_angle;\n";
        let placing = "    @_sample placed;\n    const @_sample *taken = sample;\n    unsigned hunts = 0u;\n    \
                       if (@_rests(monitor, state, sample)) {\n        placed = *sample;\n        hunts = \
                       @_rest(monitor, state, &placed);\n        taken = &placed;\n    }\n";
        let hunting = "    health |= ((health & ((unsigned)@@_STOPPED | (unsigned)@@_BRAKES)) == 0u) ? hunts : 0u;\n";
        [
            rest,
            member.to_owned() + &members,
            "    @_rest_leave(monitor);\n".into(),
            placing.into(),
            "taken".into(),
            hunting.to_owned() + &calming,
        ]
    }

    /// Returns the lower gains at rest: functions, members of the monitor, the exit, the target during their use, and
    /// statements after a tick.
    fn calm(&self, lower: &LowerGains) -> [String; 5] {
        let ([period, gain, per_gain, band, load, settled, loud, averaging, forgetting], sets) = lower.numbers();
        let Thresholds { limits: [u_min, u_max], .. } = &self.exported.thresholds;
        let number = |number: f32| format!("{number:?}");
        let [first, second] = sets.map(|set| set.map(|gain| format!("{gain:?}f")).join(", "));
        let functions = filled(
            include_str!("c/calm.h"),
            &[
                ("period", &number(period)),
                ("half_period", &number(0.5 * period)),
                ("gain", &number(gain)),
                ("per_gain", &number(per_gain)),
                ("band", &number(band)),
                ("load", &number(load)),
                ("settled", &number(settled)),
                ("loud", &number(loud)),
                ("averaging", &number(averaging)),
                ("forgetting", &number(forgetting)),
                ("slow_forgetting", &number(0.25 * forgetting)),
                ("first", &first),
                ("second", &second),
                ("u_min", &number(*u_min)),
                ("u_max", &number(*u_max)),
                ("held", &self.put_out()),
            ],
        );
        let members = "    float calm_mean; /* mean of the current, A */\n\
                       \x20   float calm_side; /* last side of the current, relative to its mean */\n\
                       \x20   float calm_reversals; /* recent reversals of the current */\n\
                       \x20   uint32_t calm_set; /* lower gain set in use; 0 for none */\n\
                       \x20   float calm_ticks; /* ticks with this gain set */\n\
                       \x20   uint32_t calm_returns; /* loads that have ended the use of lower gains */\n\
                       \x20   float calm_q; /* estimates with lower gains: error in rad, speed, disturbance */\n\
                       \x20   float calm_v;\n    float calm_d;\n    float calm_u; /* output of the lower gains, A */\n";
        let leave = "    @_calm_leave(monitor);\n";
        let lowered = "    if (monitor->calm_set > 0u) { /* the main law sees no error */\n        sample->begin.r += \
                       error;\n        sample->begin.r_dot = known.speed;\n        sample->end = \
                       sample->begin;\n        return (unsigned)@@_HUNTS;\n    }\n";
        let calming = "    health = @_calm(monitor, state, health, output);\n";
        [functions, members.into(), leave.into(), lowered.into(), calming.into()]
    }

    /// Returns the member of the state with the output of the latest tick.
    fn put_out(&self) -> &'static str {
        match self.exported.drive.designed.form().delay_ticks {
            0 => "held",
            late => QUEUED[late - 1],
        }
    }

    /// Returns the planning functions; empty for a speed, whose ramp needs no plan.
    fn plans(&self) -> String {
        if self.follows_position() {
            plan::functions(&self.file, 2 * self.shafts().len(), self.exported.period_s())
        } else {
            String::new()
        }
    }

    /// Returns the functions besides the tick: the start, a tick without a sample, missed ticks.
    fn beside_a_tick(&self, start_ticks: f32, nothing: &str) -> String {
        let half = 0.5 * self.functions.pass.constant("lost_ticks").unwrap_or(0.0);
        let shafts = self.shafts();
        let at_most = shafts.iter().map(|shaft| {
            let missed = format!("state->missed{shaft}");
            format!("    {missed} = ({missed} > {half:?}f) ? {half:?}f : {missed};\n")
        });
        let functions = [
            self.file.c(&format!(
                "
/* Computes one tick and starts the drive after {start_ticks} ticks with valid and consistent samples. Until then the
 * output is the fallback. Pass a state of zeros at first. */
static inline unsigned @_tick_or_start(@_state *state, const @_sample *sample, @_output *output)
{{
    if (!state->started) {{
        if (!@_start(state, sample)) {{
            return @_not_started(output);
        }}
        state->doubt = {start_ticks:?}f;
    }}
    return @_tick(state, sample, output);
}}
"
            )),
            self.file.c(&format!(
                "
/* Computes one tick without counts and targets: the observers predict, and the output is the fallback. */
static inline unsigned @_lost(@_state *state, @_output *output)
{{
    if (!state->started) {{
        return @_not_started(output);
    }}
    static const @_sample nothing = {{{nothing}}};
    @_between between;
    unsigned health;
    if (state->fresh && (state->doubt > 0.0f)) {{
        (void)@_begin(state, &nothing, &between);
        return @_not_started(output);
    }}
    if (!state->fresh && !@_observe(state, &nothing, &between)) {{
        health = @_give_up(state, &nothing, output);
    }} else {{
        health = @_refuse(state, output);
    }}
    @_follow(state);
    @_carry(state);
    return health;
}}
"
            )),
            self.file.c(&filled(
                "
/* Reports the number of periods that passed without a tick while the current was held. A time stamp of a free-running
 * timer counts them; an update flag is one bit. Call it before the next tick. Missed periods use at most half of the
 * permitted missing samples. */
static inline void @_missed(@_state *state, uint32_t periods)
{
    uint32_t left = periods;
    while ((left > 0u) && state->started && !state->fresh && @_pass(state)) {
        @_follow(state);
        @_carry(state);
        left--;
    }
$at_most$}
",
                &[("at_most", &at_most.collect::<String>())],
            )),
            self.file.c("
/* Sets the largest current of either sign that the power stage can hold from now on, A: for a hot stage, a low supply,
 * a full brake resistor. u stays within it. A start clears it: call it before each tick. Returns false before the
 * start, for NaN and for a number below 0. */
static inline bool @_limit(@_state *state, float current)
{
    const bool is_taken = state->started && (current >= 0.0f);
    if (is_taken) {
        state->limit = current;
        state->reported = -1.0f;
    }
    return is_taken;
}
"),
        ];
        functions.concat()
    }

    fn functions(&self) -> String {
        let DriveFunctions { start, not_started, begin, report_applied, estimates, reset, .. } = self.functions;
        let start_ticks = begin.constant("start_ticks").unwrap_or(0.0);
        // Counts, lost flags, targets: in declaration order, which C++ requires.
        let shafts = self.shafts().len();
        let jet = format!("{{0{}}}", ", 0.0f".repeat(2 * shafts));
        let target = if self.follows_position() { &*jet } else { "0.0f" };
        let nothing = [vec!["0u"; shafts], vec!["true"; shafts], vec![target; 2]].concat().join(", ");
        let functions = [
            self.function(
                "Starts the state with a sample that has all counts; pass the same sample to the first tick. Its angle
 * is then within half a counter of 0. Returns false and leaves the state unchanged if the sample is invalid: try the
 * next one.",
                "bool @_start(@_state *state, const @_sample *sample)",
                start,
                "output",
            ),
            self.function(
                "Writes the output before the first valid sample: the fallback.",
                "unsigned @_not_started(@_output *output)",
                not_started,
                "output",
            ),
            self.file.c("
/* Computes one tick: counts and targets in, current out. Call it once per period, with the counts read at its begin.
 * Returns the status flags. output->u is valid for every sample. */
"),
            self.file.c(if self.assembly.is_some() {
                "unsigned @_tick(@_state *state, const @_sample *sample, @_output *output);

/* Computes the same tick and returns u alone. */
float @_tick_u(@_state *state, const @_sample *sample);
"
            } else {
                "static inline unsigned @_tick(@_state *state, const @_sample *sample, @_output *output)
{
    @_between between;
    unsigned health;
    if (state->fresh) {
        if (!@_begin(state, sample, &between)) {
            return @_not_started(output);
        }
    } else {
        if (!@_observe(state, sample, &between)) {
            health = @_give_up(state, sample, output);
            @_follow(state);
            @_carry(state);
            return health;
        }
    }
    health = @_law(state, sample, &between, output);
    @_follow(state);
    health |= between.stepped ? (unsigned)@@_POSITION_STEPPED : 0u;
    if (between.missing) {
        @_carry(state);
        health |= (unsigned)@@_SAMPLE_LOST;
    }
    return health;
}
"
            }),
            self.beside_a_tick(start_ticks, &nothing),
            self.function(
                "Reports the current that the power stage has held since the last tick, A, if it is not output->u. This
 * is the only anti-windup. Call it before the next tick. Two equal reports well below the output are taken as the
 * limit of the stage for some ticks. Returns false and changes nothing before the start, and for a value that is not
 * finite or above 1e12.",
                "bool @_report_applied(@_state *state, float u)",
                report_applied,
                "output",
            ),
            self.function(
                "Writes the estimates at the instant of the last tick. Returns false and writes zeros before the
 * start. A stopped drive keeps those of its stop: measure its speed from the counts.",
                "bool @_estimates(const @_state *state, @_estimates_of *estimates)",
                estimates,
                "estimates",
            ),
            self.function(
                "Clears everything except the design: consistent counts start the drive again. Use it after a fault.",
                "void @_reset(@_state *state)",
                reset,
                "output",
            ),
        ];
        functions.concat()
    }
}
