//! Drive of a motor or of a joint as a source file: C99 or assembly with a header from its operation traces, Rust from
//! its design, or the configuration from which the static library designs it (module `config`).
//!
//! In C every part of the tick is generated from an operation trace ([`tick_record::drive`]). This file adds types,
//! comments of the functions, and the calls between the functions. The functions `tick`, `tick_or_start` and `lost`
//! have no arithmetic.

use std::fmt::Write as _;

use controller_core::drive::{ALARMS, Bounds, Encoder, LowerGains, MotorDesign, Mounting};
use controller_core::drives;
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows, Form as DriveForm, Reaction, Thresholds};
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
        ($design:expr, $mounting:expr, $($of:tt)*) => { motor::<$($of)*>($design, $mounting) };
    }
    macro_rules! of_joint {
        ($design:expr, $mounting:expr, $($of:tt)*) => { joint::<$($of)*>($design, $mounting) };
    }
    of_its_type!(drive, of_motor, of_joint)
}

/// Returns the operation trace of one whole tick.
fn tick(drive: &Drive) -> Result<Record, Error> {
    macro_rules! of_motor {
        ($design:expr, $mounting:expr, $($of:tt)*) => { motor_tick::<$($of)*>($design, $mounting) };
    }
    macro_rules! of_joint {
        ($design:expr, $mounting:expr, $($of:tt)*) => { joint_tick::<$($of)*>($design, $mounting) };
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

    /// Returns the title, for example `Drive of a motor with one encoder, position, 2 gain sets, f32, T = 0.001 s.`
    pub(super) fn title(&self) -> String {
        let DriveForm { follows, gain_sets, delay_ticks, observer_states } = self.drive.designed.form();
        format!(
            "Drive of {}, {}, {observer_states} states per encoder, {}, {}, f32, T = {:?} s.",
            self.drive.designed.title(),
            if follows == Follows::Position { "along a position" } else { "at a speed" },
            if gain_sets > 1 { "2 gain sets" } else { "1 gain set" },
            match delay_ticks {
                0 => "no delay".into(),
                late => format!("u held {} late", ticks_in_words(late)),
            },
            self.period_s()
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
        let Drive { shafts, designed, .. } = self.drive;
        let place = |name: &str| if shafts.len() > 1 { format!("_{name}") } else { String::new() };
        let encoders = shafts.iter().zip(designed.encoders());
        encoders.map(|(shaft, (_, mounted))| (place(shaft.name), mounted.encoder, mounted.mounting)).collect()
    }
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
    ("gravity", "weight of the link over its inertia, 1/s^2"),
    ("half_spring", "k1 k2/2"),
    ("b2", "damping of the motor, 1/s"),
    ("cross", "b1^2 - k1"),
    ("drag", "-B/J, 1/s"),
    ("base", ""),
    ("kappa", "stiffness of the block, 1/s^2"),
    ("phi", "the block's model of a tick"),
    ("g2", "the block's model of a tick"),
    ("g1", "the block's model of a tick"),
    ("h1", "the block's model of a tick"),
    ("k_link", "K/J_l, 1/s^2"),
    ("k_motor", "K/J_m, 1/s^2"),
    ("b_link", "damping of the link, 1/s"),
    ("b_motor", "damping of the motor, 1/s"),
    ("b_current", "K_t/J_m, rad/s^2 per A"),
    ("d_in_chain", "d of the motor in the chain, by what the law makes of it"),
    ("spring", "acceleration by a twist of one, 1/s^2"),
    ("twist_unit", "twist of one count in the common measure of both encoders, rad"),
    ("current_q", "of a current on its way into the position, rad/A"),
    ("current_v", "and into the speed, rad/(s A)"),
    ("keeps", "e^(-T/lag)"),
    ("link_across", "of the observer of the link, by the encoder of the motor"),
    ("motor_across", "of the observer of the motor, by the encoder of the link"),
    ("link_more", "the fast gain set less the quiet one"),
    ("motor_more", "the fast gain set less the quiet one"),
    ("k_current", "law, on the current less that of the reference"),
    ("ahead", "feed-forward, on the errors that are in the model's acceleration"),
    ("burst", "ticks for which the fast set may stay"),
    ("rest", "ticks of calm before it may come again"),
    ("gain", "of the observer"),
    ("more", "the fast gain set less the quiet one"),
    ("unit", "one count"),
    ("half_span", "half a counter"),
    ("edge", "9/16 of the base"),
    ("calm", "smoothed innovation at which the fast set begins to come in"),
    ("rate", "how fast it does"),
    ("smoothing", "1 - e^(-T/3 ms), by default"),
    ("keep", "e^(-T/20 ms), by default"),
    ("gate", "where the gate closes to"),
    ("closing", "and how fast, after a re-tune"),
    ("quarter", "of the counter or of the base, whichever is less"),
    ("lost_ticks", "samples in a row that may be missing"),
    ("step_price", "of a step of the position, beside 1 for any; 4 in 0.1 s are too much"),
    ("forgetting", "e^(-T/0.1 s), of these"),
    ("start_ticks", "for which counts must agree before a current flows"),
    ("inertia", "kg m^2"),
    ("far", "of e_1 no more counts"),
    ("agreement", "from tick to tick two counts of one motion agree to this"),
    ("c_d", "surface, on d"),
    ("c_growth", "surface, on d'"),
    ("c_", "surface"),
    ("k_d", "law, on d"),
    ("k_growth", "law, on d'"),
    ("k_last", "law, on d' in the last channel"),
    ("k_offset", "law, on W where us is on sigma"),
    ("kx_", "law, on the errors"),
    ("feed_", "feed-forward, on the reference's change in the tick"),
    ("kw", "law, on the offset W"),
    ("us", "law, on sigma*"),
    ("decay", "1 - e^(-alpha T)"),
    ("per_b", "1/b"),
    ("period", "T, s"),
    ("full_turn", "2 pi"),
    ("u_m", "limit, A"),
    ("plausible", "a demand beyond is looked at, A"),
    ("hold", "a rejected tick gives hold u + fallback"),
    ("fallback", "A"),
    ("input_limit", "nothing beyond is a number"),
];

/// Comments of the words of the state, by the beginning of their names.
const WORDS: [(&str, &str); 28] = [
    ("fresh", "no tick has passed since the start"),
    ("started", ""),
    ("last", "count of the last good sample"),
    ("at", "the same since the base"),
    ("turn", "turn of the base"),
    ("push", "half the coupling at the last tick"),
    ("push_current", "estimated current, A"),
    ("push_asked", "current of the reference, A"),
    ("burst", "ticks for which the fast gains have been in; below 0 those of calm until they may come again"),
    ("p", "estimated position less that of its count"),
    ("v", "estimated speed"),
    ("d_dot", "its rate"),
    ("d", "estimated disturbance, an acceleration"),
    ("smoothed", "smoothed innovation"),
    ("level", "how far the fast gains are in, 0 to 1"),
    ("reach", "a sample is believed that is so much further off than the gate"),
    ("missed", "counts that were not used, in a row"),
    ("off", "how far the last of them was from its prediction"),
    ("doubt", "steps of the position lately, by their price; while it is fresh, agreements that are wanted"),
    ("offset", "W = sigma(0) e^(-alpha t)"),
    ("held", "what the actuator held since the last tick, A"),
    ("limit", "what the power stage gives at most, A"),
    ("reported", "the last report that was clearly less than was put out, A; below 0 where the limit was set"),
    ("queued_3", "in two ticks, A"),
    ("queued_2", "in one tick, A"),
    ("queued", "what it holds now, A"),
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
        Reaction::GoOn => "is told and no more, as the scenario has it",
        Reaction::Brake => {
            "lets the drive brake on its estimated speed (@@_BRAKES), as long as its counts can be believed; then, \
             or at rest, the current is taken away (@@_STOPPED), as the scenario has it"
        }
        Reaction::Fallback => "stops the drive, as the scenario has it",
        Reaction::JoinedStop { .. } => {
            "is to be answered by a planned stop (@_plan_stop, @@_STOP_TICKS), as the scenario has it; the last \
             two stop the drive"
        }
    }
}

/// Returns the C statements for an external alarm.
const fn tripped(reaction: Reaction) -> &'static str {
    match reaction {
        Reaction::Brake => include_str!("c/trip_brakes.h"),
        Reaction::Fallback => "    monitor->stopped = true;\n",
        Reaction::GoOn | Reaction::JoinedStop { .. } => {
            "    (void)monitor; /* it is told, or answered by a planned stop */\n"
        }
    }
}

/// Returns the comment on the assembly: calling convention, cycles and lower bound.
fn told(assembly: &DriveAssembly) -> String {
    format!(
        " *
 * The functions are in the file for the assembler beside this one, for a Cortex-M4F with arguments in float registers
 * (-mfloat-abi=hard). Their bits are those of the Rust tick and of the C file; the state has an order of its own.
 * State, sample and output must not overlap. An ordinary tick, every count there and believed, takes {} cycles with
 * @_tick_u and {} with @_tick, return included: counted from ARM's table of a Cortex-M4 (DDI 0439D), on no chip. No
 * order of these operations takes less than {} and {}: the lower bound in
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

    /// Returns the comment on the use of the functions.
    fn usage(&self) -> String {
        let exported = self.exported;
        let counts: Vec<String> = exported
            .encoders()
            .into_iter()
            .map(|(shaft, encoder, _)| {
                let read = format!("sample.count{shaft} = encoder{shaft}();");
                let register = match encoder.counter() {
                    states if !states.is_power_of_two() => format!("0 to {}, all bits", states - 1),
                    states if states == 1 << 32 => "all 32 bits".into(),
                    states => format!("the low {} bits", states.trailing_zeros()),
                };
                format!(" *     {read:<49} {register} are read; or sample.lost{shaft} = true;\n")
            })
            .collect();
        let counts = counts.concat();
        let target = if self.follows_position() {
            " *     sample.begin = where;  sample.end = where_next;    where it should be at both ends of the tick\n"
        } else {
            " *     sample.begin = speed;  sample.end = speed_next;    rad/s at both ends of the tick\n"
        };
        let late = match exported.drive.designed.form().delay_ticks {
            0 => String::new(),
            late => format!("{:57} in which u is held: {} from now\n", " *", ticks_in_words(late)),
        };
        let usage = format!(
            " *
 *     #include \"this file\"
 *     static @_state state;                              once; zeros are right
 *     @_sample sample = {{0}};                             in the timer interrupt, every T:
 *     @_output output;
{counts}{target}{late} *     unsigned health = @_tick_or_start(&state, &sample, &output);
 *     set_current(output.u);                             A
 *     @_report_applied(&state, held);                    only if it holds another current, not a late one
 *     @_limit(&state, most);                             only if the stage gives less than the design supposes
"
        );
        usage + &self.assembly.map_or_else(String::new, told)
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
             #define {capitals}_DESIGN {:#010x}u /* log it: it tells designs apart */\n\
             #define {capitals}_PERIOD_S {:?}\n#define {capitals}_MAX_CURRENT_A {limit:?} /* of either sign */\n\
             #define {capitals}_DELAY_TICKS {} /* from the tick that computes a current to the one that holds it */\n",
            controller_core::VERSION,
            exported.about.design,
            exported.period_s(),
            exported.drive.designed.form().delay_ticks,
        );
        if let Reaction::JoinedStop { ticks } = exported.drive.designed.reaction() {
            let _ = writeln!(out, "#define {capitals}_STOP_TICKS {ticks}u /* of the stop after an alarm */");
        }
        if let DriveDesign::Motor(DriveOf { design: MotorDesign { motor, .. }, .. }) = exported.drive.designed {
            let _ = write!(
                out,
                "#define {capitals}_INERTIA_KG_M2 {:?} /* behind the gear, as all of the shaft */\n\
                 #define {capitals}_TORQUE_N_M_PER_A {:?}\n#define {capitals}_DAMPING_N_M_S {:?}\n",
                motor.inertia_kg_m2, motor.torque_n_m_per_a, motor.damping_n_m_s,
            );
        }
        for (shaft, encoder, mounting) in exported.encoders() {
            let name = format!("{capitals}_ENCODER{}", shaft.to_ascii_uppercase());
            let Encoder { bits, counts_per_turn, gear_num, gear_den, .. } = encoder;
            let Mounting { is_reversed, offset_counts } = mounting;
            let gear = if gear_num == gear_den {
                "on the shaft itself".into()
            } else {
                format!("{gear_num} turns of it are {gear_den} of the shaft")
            };
            let way = if is_reversed { "down" } else { "up" };
            let _ = writeln!(
                out,
                "#define {name}_BITS {bits} /* {gear}; counts {way} while the angle grows, {offset_counts} at \
                 angle 0 */\n#define {name}_STATES {}u /* of the counter; 0 for 2^32 */\n\
                 #define {name}_COUNTS_PER_TURN {counts_per_turn}\n\
                 #define {name}_UNIT_RAD {:?} /* of the shaft, one count */\n\
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
            "} @_estimates_of;\n\n/* What the drive remembers between two ticks. Zeros before the start. */\n".into(),
            "typedef struct {\n".into(),
            self.state().into_iter().map(word).collect(),
            "} @_state;\n\n/* What one part of a tick tells the next. */\ntypedef struct {\n".into(),
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
        let count = |shaft: &String| format!("    uint32_t count{shaft}; /* as the counter's register has it */\n");
        let lost = |shaft: &String| format!("    bool lost{shaft}; /* there is no count this time */\n");
        let counts: String = shafts.iter().map(count).chain(shafts.iter().map(lost)).collect();
        filled(include_str!("c/sample.h"), &[("counts", &counts), ("target", &target), ("unit", &unit)])
    }

    /// Returns the members with the estimates of each shaft.
    fn known(&self) -> String {
        let quantities = [
            ("position", "rad"),
            ("speed", "rad/s"),
            ("disturbance", "rad/s^2, what the model does not explain"),
            ("load", "N m against the shaft: the same as a torque"),
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
            "\n/* A count as the number with a sign that it is; a conversion would be for the compiler to define. */\n"
                .into(),
            c::signed(&self.file.signed()),
            self.function(
                "Part of the first tick after a start: the estimates are those of the sample already. False as long as
 * the drive waits for counts that agree with each other.",
                "bool @_begin(@_state *state, const @_sample *sample, @_between *between)",
                begin,
                "output",
            ),
            self.function(
                "Part of a tick: what the counts should have moved, which of them are believed, and the observers. False
 * where more samples are missing in a row than can be bridged.",
                "bool @_observe(@_state *state, const @_sample *sample, @_between *between)",
                observe,
                "output",
            ),
            self.function(
                "Part of a tick: the law, and the memory.",
                "unsigned @_law(@_state *state, const @_sample *sample, const @_between *between,
    @_output *output)",
                law,
                "output",
            ),
            self.function(
                "Part of a tick, where nothing is known any more: the fallback goes out, and the observers start again
 * where the counts are.",
                "unsigned @_give_up(@_state *state, const @_sample *sample, @_output *output)",
                give_up,
                "output",
            ),
            self.function(
                "Part of a tick, where nobody says what to do: the fallback goes out.",
                "unsigned @_refuse(@_state *state, @_output *output)",
                refuse,
                "output",
            ),
            self.function(
                "A period that passed without a tick. False where more is missing than can be foreseen.",
                "bool @_pass(@_state *state)",
                pass,
                "output",
            ),
            self.function(
                "Part of a tick: the base follows the shaft by whole turns.",
                "void @_follow(@_state *state)",
                follow,
                "output",
            ),
            self.function(
                "Part of a tick in which a count was missing: counts go along with the prediction, by quarters of the
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
        let sides = shafts.iter().map(|shaft| {
            format!("    float side{shaft}; /* disturbance of the shaft when it was last over its bound */\n")
        });
        let zeros = shafts.iter().map(|shaft| format!("    monitor->side{shaft} = 0.0f;\n"));
        let looks = shafts.iter().zip(disturbance).map(|(shaft, bound)| {
            let over = format!("@_watch_side(state->d{shaft}, {bound:?}f, &monitor->side{shaft}, &has_changed)");
            format!("    const bool over{shaft} =\n        {over};\n")
        });
        let driven = shafts.last().map_or("", String::as_str);
        let others = shafts.iter().take(shafts.len() - 1).map(|shaft| {
            format!(
                "    /* Or do the shafts disagree about the spring between them? */\n    wrong_way = wrong_way \
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
            let gave_up = "        if (is_lost) { /* what was believed is given up */\n            \
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
                ", and the load within its bound",
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
        let member = "    float braking; /* 1 and the ticks of braking within the limits without becoming \
                      slower */\n\
                      \x20   float most; /* the most that a brake asks for; 0 before its first tick, below 0 \
                      where it holds no load */\n";
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
        let member = "    float rest_share; /* how much of the band at rest is in use, 0 to 1 */\n\
                      \x20   float rest_width; /* rad to either side; 0 is the least */\n\
                      \x20   float rest_side; /* on which side of its target it last stood outside the band */\n\
                      \x20   float rest_ticks; /* for which it has stood */\n\
                      \x20   float rest_error; /* its error where it last stood, rad */\n\
                      \x20   float rest_slipped; /* 1 where it has moved since it last stood outside the band */\n\
                      \x20   int32_t rest_turn; /* where the target was */\n\
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
        let members = "    float calm_mean; /* of the current, A */\n\
                       \x20   float calm_side; /* on which side of it the current was last */\n\
                       \x20   float calm_reversals; /* that are not forgotten */\n\
                       \x20   uint32_t calm_set; /* 0, or which of the lower gain sets is in use */\n\
                       \x20   float calm_ticks; /* for which it is */\n\
                       \x20   uint32_t calm_returns; /* loads that have ended such a use */\n\
                       \x20   float calm_q; /* of its observer: error, rad, speed, disturbance */\n\
                       \x20   float calm_v;\n    float calm_d;\n    float calm_u; /* A, what it put out */\n";
        let leave = "    @_calm_leave(monitor);\n";
        let lowered = "    if (monitor->calm_set > 0u) { /* the law is at its target */\n        sample->begin.r += \
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
/* The tick of a drive that need not have started: good samples that agree with each other for {start_ticks:?} ticks
 * start it; until then the fallback goes out. Needs a state of zeros the first time. */
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
/* The tick of a period in which there are neither counts nor targets: the observers predict, the fallback goes out. */
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
/* So many periods have passed without a tick, the current held all the while: a missed timer interrupt that its
 * overflow flag or a time stamp tells of. Call it before the coming tick. They count as half of the samples that may
 * be missing at most. */
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
/* From now on the power stage gives at most this current of either sign: it is hot, its supply is low, its brake
 * resistor is full. The law keeps to it. A start forgets it: call it before each tick. False for a number below 0 or
 * none, and before the start. */
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
                "The state before the first tick, from the sample that the first tick gets too: every count must be
 * there. Its angle is then within half a counter of 0. False, and the state as it was, if the sample is not good
 * enough: try the next one.",
                "bool @_start(@_state *state, const @_sample *sample)",
                start,
                "output",
            ),
            self.function(
                "What goes out as long as there has been no good sample.",
                "unsigned @_not_started(@_output *output)",
                not_started,
                "output",
            ),
            self.file.c("
/* One tick: counts and targets in, current out. Call it once per period, with the counts read at its beginning. Returns
 * the health; output->u is good whatever the sample was. */
"),
            self.file.c(if self.assembly.is_some() {
                "unsigned @_tick(@_state *state, const @_sample *sample, @_output *output);

/* The same tick, for a caller that reads u alone: returns it. */
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
                "Tells what current the actuator really holds since the last tick, where that is not the u of the tick:
 * the only anti-windup, and needed. Call it before the next tick. Twice the same and clearly less than was put out is
 * taken for the limit of the stage, until some ticks have passed. A value that is not finite or beyond 1e12 is not
 * taken, nor any before the start, and the answer is false.",
                "bool @_report_applied(@_state *state, float u)",
                report_applied,
                "output",
            ),
            self.function(
                "Estimates at the instant of the last tick. False, and zeros, before the start.",
                "bool @_estimates(const @_state *state, @_estimates_of *estimates)",
                estimates,
                "estimates",
            ),
            self.function(
                "Forgets all but the design: the next good sample starts again. For the end of a fault.",
                "void @_reset(@_state *state)",
                reset,
                "output",
            ),
        ];
        functions.concat()
    }
}
