//! Self-contained C99 file: the functions of a controller, generated from its operation traces.
//!
//! This file contains no arithmetic. [`tick_record`] runs `Running` and `Controller` of `controller-core` with a scalar
//! type that records its operations, and translates the trace to C. This file adds the head, the types and the comments
//! of the functions.
//!
//! Names of channels and states count from 1; `a2, b2, c2` are A, B, C of channel 2, `p2` its P.

use std::fmt::Write as _;

use controller_core::SampleLimits;
use loop_sim::port::in_process::{ControllerSpec, Download, Model};
use tick_record::{Drift, Functions, Port, Record, Role, ValueKind, chain};

use super::c99::File;
use super::{Error, Exported};

pub(super) fn text(exported: &Exported<'_>, prefix: &str) -> Result<String, Error> {
    let file = Standalone::of(exported, prefix)?;
    let state: Vec<&Port> = [ValueKind::Number, ValueKind::Truth]
        .into_iter()
        .flat_map(|kind| file.functions.state.iter().filter(move |word| word.kind == kind))
        .collect();
    let defines = defines(exported, &file.file);
    let body = [
        file.file.demands(""),
        defines,
        types(&file.file, &state),
        file.functions(),
        file.file.modes(),
        file.file.tail(),
    ]
    .concat();
    Ok(file.head() + &file.file.guarded("STANDALONE", &body))
}

/// Returns the operation traces of the controller.
pub(super) fn functions(spec: &ControllerSpec, download: &Download) -> Result<Functions, Error> {
    if !matches!(spec.model, Model::Linear(_)) {
        return Err(Error::StandaloneModel);
    }
    recorded(spec, download, Drift::Linear)
}

/// Returns the operation traces of the controller, with a(x) from the given source.
pub(super) fn recorded(spec: &ControllerSpec, download: &Download, drift: Drift) -> Result<Functions, Error> {
    let shape = download.shape;
    let numbers: Vec<f64> = download.numbers.iter().copied().map(f64::from).collect();
    let (guess, rest) = numbers.split_at(usize::from(shape.n));
    let (row, coefficients) = rest.split_at(usize::from(shape.n));
    let samples = &spec.config.padded.options.samples;
    let samples = (*samples != SampleLimits::NONE).then_some(samples);
    chain(shape, coefficients, drift, row, guess, samples).ok_or(Error::Shape(shape))
}

/// Functions of a controller or drive.
pub(super) const FUNCTIONS: [&str; 6] = ["start", "tick", "not_started", "report_applied", "estimates", "reset"];

/// Returns the specification of one function of the file for `cycle-bound --means`.
pub(super) fn means(exported: &Exported<'_>, prefix: &str, function: &str) -> Result<String, Error> {
    let file = Standalone::of(exported, prefix)?;
    let words = file.functions.state.iter().filter(|word| word.kind == ValueKind::Number);
    let words: Vec<String> = words.map(|word| word.name.clone()).collect();
    means_of(exported, &file.functions, &words, &format!("{prefix}_{function}"), function)
}

/// Returns the specification of a function for a given order of the state. Places follow ARM's calling convention and
/// the types of the header.
pub(super) fn means_of(
    exported: &Exported<'_>,
    functions: &Functions,
    words: &[String],
    symbol: &str,
    function: &str,
) -> Result<String, Error> {
    let Functions { start, tick, not_started, report_applied, estimates, reset, .. } = functions;
    // Registers with the addresses of the state, of x, of the output and of the estimates.
    let (record, [state, x, output, d_hat]) = match function {
        "start" => (start, [0, 1, 4, 4]),
        "tick" => (tick, [0, 1, 2, 4]),
        "not_started" => (not_started, [4, 4, 0, 4]),
        "report_applied" => (report_applied, [0, 4, 4, 4]),
        "estimates" => (estimates, [0, 4, 4, 1]),
        "reset" => (reset, [0, 4, 4, 4]),
        _ => return Err(Error::Function { name: function.into(), functions: FUNCTIONS.into() }),
    };
    let u_alone = symbol.ends_with("_tick_u");
    let flags = functions.state.iter().filter(|word| word.kind == ValueKind::Truth);
    let flags: Vec<&str> = flags.map(|word| word.name.as_str()).collect();
    let place = |port: &Port| {
        let at = |register: usize, word: usize| format!("r{register}+{}", 4 * word);
        Some(match port.role {
            Role::State if port.kind == ValueKind::Number => {
                at(state, words.iter().position(|word| *word == port.name)?)
            }
            Role::State => {
                format!("r{state}+{}", 4 * words.len() + flags.iter().position(|word| *word == port.name)?)
            }
            Role::Sample(j) => at(x, j),
            Role::Output if u_alone => return (port.name == "u").then(|| "s0".into()),
            Role::Output => at(output, ["u", "sigma", "sigma_star"].iter().position(|name| *name == port.name)?),
            Role::Estimate(i, m) => at(d_hat, i * usize::from(exported.download.shape.r) + m),
            Role::Flag(_) if u_alone => return None,
            Role::Flag(bit) => format!("r0 bit {bit}"),
            Role::Answer => "r0".into(),
            Role::Argument => "s0".into(),
            Role::Between => return None,
        })
    };
    Ok(tick_record::text::text(symbol, record, &place, &|port| place(port).into_iter().collect(), ""))
}

/// Comments of constants, by the beginning of their names; a longer beginning comes first.
const MEANINGS: [(&str, &str); 27] = [
    ("d_hat_", "initial estimate, in the unit of x_i per second"),
    ("drift_", "a(x)/b_0 = drift . x"),
    ("x_min_", "a sample below it is rejected"),
    ("x_max_", "a sample above it is rejected"),
    ("x_jump_", "a sample with a larger step from the previous one is rejected"),
    ("rate_n", "1/(T b_0)"),
    ("rate", "1/T, 1/s"),
    ("theta_n", "mean of channel n's response over a tick"),
    ("mu2_n", "second moment of channel n's response"),
    ("gamma", "observer gain"),
    ("c_", "surface, Eq. (44)"),
    ("g", "sigma, on the estimates"),
    ("kx_", "law, Eq. (51), on the state; the law is in u / unit, so that implausible sums overflow"),
    ("kw", "law, on the offset W"),
    ("ko", "demand of the offset"),
    ("k", "law, on the estimates"),
    ("us", "law, on sigma*"),
    ("satk", "slope of the switching term"),
    ("lim", "limit of the switching term"),
    ("unit", "factor from the sums of the law to u"),
    ("decay", "1 - e^(-alpha T), Eq. (17)"),
    ("sigma_star_bound", "above it a status flag is set"),
    ("hold", "output for a rejected sample: hold u + fallback"),
    ("period", "T, s"),
    ("input_gain", "b_0"),
    ("input_limit", "largest number for a start or a held u"),
    ("plausible", "a demand above it is checked"),
];

/// Comments of the words of the state, by the beginning or end of their names.
const WORDS: [(&str, &str); 8] = [
    ("_prev", "x of the previous tick"),
    ("_seen", "last sample within its range"),
    ("offset", "W = sigma(0) e^(-alpha t), Eq. (17)"),
    ("held", "u that the actuator holds"),
    ("resuming", "1: there is no previous tick for the next sample"),
    ("started", ""),
    ("p", "prediction for the next innovation"),
    ("", "folded estimate"),
];

/// Returns the macros that identify a file: version, design, configuration, period.
pub(super) fn defines(exported: &Exported<'_>, file: &File<'_>) -> String {
    let shape = exported.download.shape;
    format!(
        "#define {c}_VERSION \"{version}\"\n#define {c}_DESIGN {hash:#010x}u /* identifies the design: log it */\n\
         #define {c}_N {n} /* plant order, length of x */\n#define {c}_R {r} /* highest order of an observer */\n\
         #define {c}_PERIOD_S {period:?}\n",
        c = file.capitals,
        version = controller_core::VERSION,
        hash = exported.about.design,
        n = shape.n,
        r = shape.r,
        period = exported.spec.config.padded.period_s,
    )
}

/// Returns the types of health, state (with its words in this order) and output.
pub(super) fn types(file: &File<'_>, state: &[&Port]) -> String {
    let mut out = String::from(
        "
/* Status flags of a tick. */
enum {
    @@_OK = 0,
    @@_INPUT_REJECTED = 1, /* x or a result of it is not finite or too large: output is the fallback */
    @@_SATURATED = 2, /* the demanded u exceeds the limits */
    @@_SIGMA_STAR_OVER_BOUND = 4 /* the plant differs from the design */
};

/* State between two ticks; zeros before the start. Channel 2 has a2, b2, c2, p2. */
typedef struct {
",
    );
    for word in state {
        let t = if word.kind == ValueKind::Number { "float" } else { "bool" };
        let fits = |(part, _): &&(&str, &str)| word.name.starts_with(part) || word.name.ends_with(part);
        let meaning = WORDS.iter().find(fits).map_or("", |(_, meaning)| meaning);
        let comment = if meaning.is_empty() { String::new() } else { format!(" /* {meaning} */") };
        let _ = writeln!(out, "    {t} {};{comment}", word.name);
    }
    out.push_str(
        "} @_state;

typedef struct {
    float u; /* hold until the next tick; within the limits */
    float sigma; /* sliding variable, Eq. (44), unit of x_n */
    float sigma_star; /* sliding variable without its initial offset, Eq. (17), unit of x_n */
} @_output;
",
    );
    file.c(&out)
}

/// Values that the caller computes and passes to a tick.
#[derive(Default)]
pub(super) struct Given {
    /// Further arguments of a tick, in its declaration and in its calls.
    pub(super) declared: String,
    pub(super) passed: String,
    /// Comment on the values.
    pub(super) told: String,
}

/// Returns every function of a controller, written by `write` from its comment, head and trace; `more` follows the
/// tick.
pub(super) fn interface(
    file: &File<'_>,
    functions: &Functions,
    given: &Given,
    more: &str,
    write: &dyn Fn(&str, &str, &Record) -> String,
) -> String {
    let Functions { start, tick, not_started, report_applied, estimates, reset, .. } = functions;
    let Given { declared, passed, told } = given;
    let functions = [
        write(
            "Starts the state with a sample; pass the same sample to the first tick. Returns false and leaves the state
 * unchanged if the sample is invalid: try the next one.",
            "bool @_start(@_state *state, const float x[@@_N])",
            start,
        ),
        write(
            "Writes the output before the first valid sample: the fallback.",
            "unsigned @_not_started(@_output *output)",
            not_started,
        ),
        write(
            &format!(
                "Computes one tick: observers, sigma*, law, limits. Call it once per period with the newest sample x, in
 * chain coordinates. {told}Returns the status flags. output->u is valid for every x: an invalid x or sum appears in
 * the demand of the law, which one comparison checks."
            ),
            &format!("unsigned @_tick(@_state *state, const float x[@@_N], @_output *output{declared})"),
            tick,
        ),
        file.c(more),
        file.c(&format!(
            "
/* Computes one tick and starts the controller with its first valid sample. Until then the output is the fallback. Pass
 * a state of zeros at first. */
static inline unsigned @_tick_or_start(@_state *state, const float x[@@_N], @_output *output{declared})
{{
    unsigned health;
    if (state->started || @_start(state, x)) {{
        health = @_tick(state, x, output{passed});
    }} else {{
        health = @_not_started(output);
    }}
    return health;
}}
"
        )),
        write(
            "Reports the u that the actuator has held since the last tick, if it is not output->u. This is the only
 * anti-windup. Call it before the next tick. Returns false and changes nothing before the start, and for a value
 * that is not finite or above 1e12.",
            "bool @_report_applied(@_state *state, float u)",
            report_applied,
        ),
        write(
            "Writes the estimates at the instant of the last tick. d_hat[i][m] is the m-th derivative of the estimate in
 * channel i + 1, in the unit of x_(i+1) per second and per second^m. It is 0 without an observer, or above the order of
 * the observer. Returns false and writes zeros before the start.",
            "bool @_estimates(const @_state *state, float d_hat[@@_N][@@_R])",
            estimates,
        ),
        write(
            "Clears everything except the design: the next valid sample starts again. Use it after a fault.",
            "void @_reset(@_state *state)",
            reset,
        ),
    ];
    functions.concat()
}

struct Standalone<'a> {
    exported: &'a Exported<'a>,
    file: File<'a>,
    functions: Functions,
}

impl<'a> Standalone<'a> {
    fn of(exported: &'a Exported<'a>, prefix: &'a str) -> Result<Self, Error> {
        let functions = functions(exported.spec, exported.download)?;
        Ok(Self { exported, file: File::new(prefix), functions })
    }

    fn head(&self) -> String {
        let Exported { spec, .. } = self.exported;
        let title = format!(
            "Sliding mode control with an extended disturbance observer: {}, f32, T = {:?} s.",
            self.exported.shape(),
            spec.config.padded.period_s
        );
        let usage = " *
 *     #include \"this file\"
 *     static @_state state;                              once; zeros before the start
 *     @_output output;                                   in the timer interrupt, every T:
 *     unsigned health = @_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     @_report_applied(&state, held);                    only if the actuator holds another u
";
        self.file.head(&title, usage, &self.exported.about.origin())
    }

    fn functions(&self) -> String {
        let write = |meaning: &str, head: &str, record: &Record| self.function(meaning, head, record);
        interface(&self.file, &self.functions, &Given::default(), "", &write)
    }

    fn function(&self, meaning: &str, head: &str, record: &Record) -> String {
        let place = |port: &Port| match port.role {
            Role::Sample(j) => format!("x[{j}]"),
            Role::State => format!("state->{}", port.name),
            Role::Output => format!("output->{}", port.name),
            Role::Estimate(i, m) => format!("d_hat[{i}][{m}]"),
            Role::Flag(_) => format!("{}_{}", self.file.capitals, port.name.to_uppercase()),
            Role::Argument | Role::Between | Role::Answer => port.name.clone(),
        };
        self.file.function(meaning, head, record, &place, &MEANINGS)
    }
}
