//! C file for a program that links the static library `libedo_smc.a`: the design alone, as a constant of `edo_smc.h`.
//!
//! Each f32 is printed with enough digits that every C compiler reads back the identical value.

use std::fmt::Write as _;

use controller_core::{LAYOUT, SampleLimits, VERSION, VERSION_NUMBER, design, shapes};
use loop_sim::port::in_process::Model;

use super::c99::File;
use super::{Error, Exported, named};

/// Names of the configurations that the library contains.
const CARRIED: &[&str] = {
    macro_rules! names {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => { &[$(stringify!($name)),*] };
    }
    shapes!(archive => names)
};

/// Returns the text of the C file.
///
/// # Errors
/// The configuration is missing in the library; the message names a form that supports it.
pub(super) fn text(exported: &Exported<'_>, prefix: &str) -> Result<String, Error> {
    let shape = exported.download.shape;
    let (n, r, channels) = (usize::from(shape.n), usize::from(shape.r), exported.channels());
    let Model::Linear(_) = exported.spec.model else {
        return Err(Error::ArchiveModel);
    };
    if exported.spec.config.padded.options.samples != SampleLimits::NONE {
        return Err(Error::ArchiveSamples);
    }
    let digits: String = channels.iter().map(usize::to_string).collect();
    let name = format!("n{n}_r{r}_c{digits}");
    if !CARRIED.contains(&name.as_str()) {
        return Err(Error::ArchiveShape { name, shape, library: CARRIED });
    }
    let body = members(exported, &channels);
    let mut out = format!(
        "/* Design of a sliding mode controller with an extended disturbance observer: {}, T = {:?} s.\n \
         * Exported for version {VERSION} of the archive. Do not edit; export again.\n *\n",
        exported.shape(),
        exported.spec.config.padded.period_s
    );
    for line in exported.about.origin().lines() {
        out.push_str(format!(" * {line}").trim_end());
        out.push('\n');
    }
    let body = format!(
        "
#include \"edo_smc.h\"

static const edo_smc_design_{name}_t {prefix}_design = {{
    {VERSION_NUMBER:#08x}u, EDO_SMC_ID({n}, {r}, {:#x}),
{body}}};

",
        shape.mask,
    );
    Ok(out + " */\n" + &File::new(prefix).guarded("DESIGN_H", &body))
}

/// Returns the named members of the design.
fn members(exported: &Exported<'_>, channels: &[usize]) -> String {
    let (n, r) = (usize::from(exported.download.shape.n), usize::from(exported.download.shape.r));
    let mut numbers = named(n, r, channels.len(), &exported.download.numbers);
    let row = |values: &[f32]| {
        let values: Vec<String> = values.iter().map(|value| format!("{value:?}f")).collect();
        format!("{{{}}}", values.join(", "))
    };
    let mut body = String::new();
    // Order of the header: LAYOUT, preceded by the start estimates. The row of a(x)/b_0 precedes the check, which
    // covers all members.
    let coefficients = LAYOUT.split_whitespace().filter(|field| *field != "check");
    let fields = || ["d_hat[N]"].into_iter().chain(coefficients.clone()).chain(["drift[N]"]);
    let before = fields().flat_map(|field| numbers[field.split('[').next().unwrap_or(field)].clone());
    let check = design::check(before.collect::<Vec<f32>>());
    numbers.insert("check", vec![check]);
    for field in fields().chain(["check"]) {
        let (name, shape) = field.split_once('[').unwrap_or((field, ""));
        let values = &numbers[name];
        let value = match shape {
            "N]" => row(values),
            "O][R]" => format!("{{{}}}", values.chunks(r).map(row).collect::<Vec<_>>().join(", ")),
            _ => format!("{:?}f", values[0]),
        };
        let shown = if name == "drift" { "a_row" } else { name };
        let _ = writeln!(body, "    {value}, /* {shown} */");
    }
    body
}
