//! What every self-contained C99 file has: head, guards, and functions that are written from a record.
//!
//! In the texts `@` stands for the prefix and `@@` for that of macros. All functions are `static inline`: the file is
//! included where the interrupt is, and the tick becomes part of it.

use std::fmt;

use tick_record::{Port, Record, c};

/// A template of C, which is a file in `c`, with `$name$` filled in.
pub(super) fn filled(template: &str, values: &[(&str, &dyn fmt::Display)]) -> String {
    values
        .iter()
        .fold(template.to_owned(), |text, (name, value)| text.replace(&format!("${name}$"), &value.to_string()))
}

/// What is said of a constant, by how its name begins; of a longer beginning first.
pub(super) type Meanings = [(&'static str, &'static str)];

/// The modes of the machine that a tick assumes, and their check, for the head of a file.
pub(super) const MODES: &str = " * FLOATING-POINT MODES assumed wherever the tick runs, be it main, an interrupt or \
    a host program: rounding to nearest,
 * subnormal numbers kept, float computed as float. Of a Cortex-M: FPSCR with RMode = 00 and FZ = 0. An interrupt begins
 * with FPDSCR, not with the FPSCR of main, and needs FPCCR.ASPEN = 1 (all as after reset). Of x86: MXCSR without \
 FTZ and
 * DAZ, which linking with -ffast-math sets. Call @_modes_ok once at start-up, where the tick runs. Under other modes u
 * still stays within its limits and is a number; its bits are others.
 *
";

/// The file that begins every name with a prefix.
pub(super) struct File<'a> {
    prefix: &'a str,
    /// The prefix of macros.
    pub(super) capitals: String,
}

impl<'a> File<'a> {
    pub(super) fn new(prefix: &'a str) -> Self {
        Self { prefix, capitals: prefix.to_ascii_uppercase() }
    }

    /// A text of C with the prefix in it.
    pub(super) fn c(&self, text: &str) -> String {
        text.replace("@@", &self.capitals).replace('@', self.prefix)
    }

    /// Which file it is, what compilers must not do, and where the file comes from: a comment.
    pub(super) fn head(&self, title: &str, usage: &str, origin: &str) -> String {
        let version = controller_core::VERSION;
        let mut out = format!(
            "/* {title}\n * Exported by version {version} of the library; do not edit, export it again. C99 and C++11, \
             no library.\n"
        );
        out += &self.c(usage);
        out += &self.c(" *
 * The same bits as the Rust tick need every operation rounded on its own. A fused multiply-add rounds a * b + c once,
 * which is another number (and takes longer on a Cortex-M4F): compile with -ffp-contract=off. This file asks for it by
 * itself where it can; with GCC that keeps @_tick from being inlined unless the option is given too. Reordering
 * (-ffast-math and its parts) and more digits than f32 (x87) change bits as well.
 * Where the compiler says that it may do so this file does not compile. clang says it of -ffast-math and
 * -ffinite-math-only alone: there the file forbids reordering by itself, and nothing can see -fno-signed-zeros (part of
 * -funsafe-math-optimizations too), -fno-honor-nans and -fno-honor-infinities. Do not give them.
 *
");
        out += &self.c(MODES);
        for line in origin.lines() {
            out.push_str(format!(" * {line}").trim_end());
            out.push('\n');
        }
        out + " */\n"
    }

    /// What the functions need of the compiler, after the head.
    pub(super) fn demands(&self, includes: &str) -> String {
        [
            "
#include <float.h>
#include <stdbool.h>
",
            includes,
            &self.c("
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \\
    || defined(__NO_SIGNED_ZEROS__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error \"compile without -ffast-math and its parts: they change numbers and remove the guard against NaN\"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error \"float must be computed as float: on a 32-bit x86 give -msse2 -mfpmath=sse\"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize(\"fp-contract=off\")
#define @@_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define @@_AS_WRITTEN _Pragma(\"clang fp contract(off) reassociate(off) reciprocal(off)\")
#elif defined(__clang__) && __clang_major__ >= 14
#define @@_AS_WRITTEN _Pragma(\"clang fp contract(off) reassociate(off)\")
#else
#define @@_AS_WRITTEN _Pragma(\"STDC FP_CONTRACT OFF\")
#endif

"),
        ]
        .concat()
    }

    /// All behind the head of a C file within its include guard, `form` behind the prefix. It carries a checksum of all
    /// of that: the same file twice is one, two files of one prefix that differ in a character of code are an error,
    /// after which the compiler shows where the other one comes from.
    pub(super) fn guarded(&self, form: &str, body: &str) -> String {
        let (guard, prefix) = (format!("{}_{form}", self.capitals), self.prefix);
        let sum = format!("{:#010x}u", pil_wire::checksum(body.as_bytes()));
        format!(
            "#ifdef {guard}
#if {guard} != {sum}
#error \"two designs with the prefix {prefix}, {sum} here and {guard} before: export one with another --prefix\"
#define {guard} {sum}
#endif
#else
#define {guard} {sum}
{body}#endif
"
        )
    }

    /// The check of the floating-point modes.
    pub(super) fn modes(&self) -> String {
        self.c(include_str!("c/modes.h"))
    }

    /// A function that is elsewhere.
    pub(super) fn declaration(&self, meaning: &str, head: &str) -> String {
        self.c(&format!("\n/* {meaning} */\n{head};\n"))
    }

    /// A function in float that does what was recorded.
    pub(super) fn function(
        &self,
        meaning: &str,
        head: &str,
        record: &Record,
        place: &dyn Fn(&Port) -> String,
        meanings: &Meanings,
    ) -> String {
        self.function_in(false, meaning, head, record, place, meanings)
    }

    /// The same in double, if that is said.
    pub(super) fn function_in(
        &self,
        double: bool,
        meaning: &str,
        head: &str,
        record: &Record,
        place: &dyn Fn(&Port) -> String,
        meanings: &Meanings,
    ) -> String {
        let meaning_of = |name: &str| {
            let found = meanings.iter().find(|(beginning, _)| name.starts_with(beginning));
            found.map_or(String::new(), |(_, meaning)| (*meaning).into())
        };
        let signed = self.signed();
        let body = c::Function { record, place, meaning: &meaning_of, double, signed: &signed }.body();
        self.c(&format!("\n/* {meaning} */\nstatic inline {head}\n{{\n    @@_AS_WRITTEN\n")) + &body + "}\n"
    }

    /// Name of the function that makes a number with a sign of a count; a file with counts has [`c::signed`].
    pub(super) fn signed(&self) -> String {
        format!("{}_signed", self.prefix)
    }

    pub(super) fn tail(&self) -> String {
        self.c("
#undef @@_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
")
    }
}
