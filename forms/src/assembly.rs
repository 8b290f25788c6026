//! Scheduled assembly: the functions of the self-contained C file as GNU assembler text, with their header.
//!
//! [`arm`](super::arm) generates them from the operation trace of the C file, so the results are bit-identical. A
//! program switches between the two by its include and one more file to link. The header lists the differences: the
//! order of the state, omitted products with 0, and `tick_u`, for a caller that needs only u.

use std::fmt::Write as _;

use controller_core::SampleLimits;
use loop_sim::port::in_process::Model;
use tick_record::{Drift, Functions, Port, Record, ValueKind};

use super::arm::{self, Assembly, Effort, Layout};
use super::c99::{File, MODES};
use super::{Error, Exported, standalone};

/// An assembler file and the header of its functions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Files {
    /// Text for the GNU assembler, or for `global_asm!` of Rust.
    pub assembly: String,
    /// Header in C99 and C++11.
    pub header: String,
}

pub(super) fn files(exported: &Exported<'_>, prefix: &str, effort: &Effort) -> Result<Files, Error> {
    let (functions, drift) = functions(exported)?;
    let shape = exported.download.shape;
    let assembly = arm::assembly(&functions, usize::from(shape.n), usize::from(shape.r), prefix, effort)?;
    let file = File::new(prefix);
    let state: Vec<&Port> = (assembly.layout.words.iter())
        .filter_map(|name| functions.state.iter().find(|word| word.name == *name))
        .chain(functions.state.iter().filter(|word| word.kind == ValueKind::Truth))
        .collect();
    let body = [
        file.demands("#include <stddef.h>\n"),
        standalone::defines(exported, &file),
        standalone::types(&file, &state),
        declarations(exported, &file, &functions, &assembly, drift),
        file.modes(),
        file.tail(),
    ]
    .concat();
    let header = head(exported, &file, &assembly, drift) + &file.guarded("ASSEMBLY", &body);
    Ok(Files { assembly: text(prefix, &exported.about.origin(), &assembly.text), header })
}

/// Returns the assembler file: its origin and its functions.
pub(super) fn text(prefix: &str, origin: &str, functions: &str) -> String {
    let mut text = format!("@ The functions of {prefix}.h, exported by version {}.\n", controller_core::VERSION);
    for line in origin.lines() {
        text.push_str(format!("@ {line}").trim_end());
        text.push('\n');
    }
    text + "\n" + functions
}

/// Returns the specification of one function for `cycle-bound --means`: a function of the C file, or `tick_u`.
pub(super) fn means(exported: &Exported<'_>, prefix: &str, function: &str) -> Result<String, Error> {
    let (functions, _) = functions(exported)?;
    let layout = Layout::of(&functions, usize::from(exported.download.shape.n));
    let recorded = if function == "tick_u" { "tick" } else { function };
    standalone::means_of(exported, &functions, &layout.words, &format!("{prefix}_{function}"), recorded)
}

/// Returns the operation traces of the controller without products with 0, and the source of its a(x).
fn functions(exported: &Exported<'_>) -> Result<(Functions, Drift), Error> {
    let drift = match &exported.spec.model {
        Model::Linear(_) => Drift::Sparse,
        Model::Formulas { gain, .. } if gain.varies() => Drift::ArgumentWithGain,
        Model::BenchmarkLibm | Model::BenchmarkMicromath | Model::Formulas { .. } => Drift::Argument,
    };
    if exported.spec.config.padded.options.samples != SampleLimits::NONE {
        return Err(Error::AssemblySamples);
    }
    Ok((standalone::recorded(exported.spec, exported.download, drift)?, drift))
}

fn head(exported: &Exported<'_>, file: &File<'_>, assembly: &Assembly, drift: Drift) -> String {
    let mut out = format!(
        "/* Sliding mode control with an extended disturbance observer: {}, f32, T = {:?} s.
 * Exported by version {} of the library. Do not edit; export again. The assembler file next to this one contains the
 * functions. C99 and C++11, for a Cortex-M4F with arguments in float registers (-mfloat-abi=hard).
",
        exported.shape(),
        exported.spec.config.padded.period_s,
        controller_core::VERSION,
    );
    let given = listed(drift, ", ");
    out += &file
        .c(" *
 *     static @_state state;                              once; zeros before the start
 *     @_output output;                                   in the timer interrupt, every T:
 *     unsigned health = @_tick_or_start(&state, x, &output#);
 *     write_pwm(output.u);
 *     @_report_applied(&state, held);                    only if the actuator holds another u
 *
")
        .replace('#', &given);
    let _ = write!(
        out,
        " * The results equal the Rust tick and the C file in every bit, for every sample, with one exception: products
 * with zero entries of a(x) are left out, which only changes the sign of a zero. The state has another word order. x,
 * state and output must not overlap.
 *
 * A valid sample takes {} cycles with tick_u and {} with tick, return included. The count follows ARM's table of a
 * Cortex-M4 (DDI 0439D); it is not measured on silicon. No order of these operations takes less than {} and {}: the
 * lower bound in docs/reference/cycles.md.
 *
",
        assembly.cycles, assembly.cycles_whole, assembly.floor, assembly.floor_whole,
    );
    out += &file.c(MODES);
    for line in exported.about.origin().lines() {
        out.push_str(format!(" * {line}").trim_end());
        out.push('\n');
    }
    out + " */\n"
}

/// Returns the description of the values that the caller computes and passes to a tick.
fn listed(drift: Drift, before: &str) -> String {
    let names: &[&str] = match drift {
        Drift::Linear | Drift::Sparse => &[],
        Drift::Argument => &["drift"],
        Drift::ArgumentWithGain => &["drift", "gain"],
    };
    names.iter().flat_map(|name| [before, name]).collect()
}

fn declarations(
    exported: &Exported<'_>,
    file: &File<'_>,
    functions: &Functions,
    assembly: &Assembly,
    drift: Drift,
) -> String {
    let numbers = assembly.layout.words.len();
    let what = match drift {
        Drift::Linear | Drift::Sparse => "",
        Drift::Argument => "drift is a(x)/b_0",
        Drift::ArgumentWithGain => "drift is a(x)/b_0 and gain b(x)/b_0",
    };
    let b_0 = exported.spec.config.padded.nominal.input_gain;
    let told = if what.is_empty() {
        String::new()
    } else {
        format!("{what}, of the nominal\n * model at this x, with b_0 = {b_0:?}: the caller computes it.\n * ")
    };
    let declared = listed(drift, ", float ");
    let tick_u = format!(
        "
/* Computes the same tick and returns u alone. */
float @_tick_u(@_state *state, const float x[@@_N]{declared});
"
    );
    let given = standalone::Given { declared, passed: listed(drift, ", "), told };
    let write = |meaning: &str, head: &str, _: &Record| file.declaration(meaning, head);
    let text = format!(
        "
/* Checks that the compiler gives the state the memory layout of the assembly. */
typedef char @_state_is_laid_out[
    sizeof(@_state) == 4 * {numbers} + 4 && offsetof(@_state, resuming) == 4 * {numbers}
    && offsetof(@_state, started) == 4 * {numbers} + 1 && sizeof(bool) == 1 && sizeof(@_output) == 12 ? 1 : -1];

#ifdef __cplusplus
extern \"C\" {{
#endif
"
    );
    let close = "
#ifdef __cplusplus
}
#endif
";
    let all = standalone::interface(file, functions, &given, &tick_u, &write);
    [&file.c(&text), &all, close].concat()
}
