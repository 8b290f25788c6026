//! Common parts of every self-contained C99 file: head, guards, and functions generated from an operation trace.
//!
//! In the texts, `@` stands for the prefix and `@@` for the prefix of macros. All functions are `static inline`: the
//! interrupt's source includes the file, and the tick is inlined into the interrupt.

use std::fmt;

use tick_record::{Port, Record, c};

/// Returns a C template of the folder `c` with each `$name$` replaced.
pub(super) fn filled(template: &str, values: &[(&str, &dyn fmt::Display)]) -> String {
    values
        .iter()
        .fold(template.to_owned(), |text, (name, value)| text.replace(&format!("${name}$"), &value.to_string()))
}

/// Comments of constants, by the beginning of their names; a longer beginning comes first.
pub(super) type Meanings = [(&'static str, &'static str)];

/// Comment on the floating-point modes that a tick assumes, and on their check, for the head of a file.
pub(super) const MODES: &str = " * FLOATING-POINT MODES. The tick assumes rounding to nearest, \
    subnormal numbers, and float computed as float. They must
 * hold wherever it runs: in main, in an interrupt or in a host program. On a Cortex-M, FPSCR has RMode = 00 and FZ = 0.
 * An interrupt starts with FPDSCR instead of the FPSCR of main, and it needs FPCCR.ASPEN = 1. All three are correct
 * after reset. On x86, MXCSR has neither FTZ nor DAZ; linking with -ffast-math sets them. Call @_modes_ok once
 * at start-up in the context of the tick. Under other modes u is still a number within its limits; its bits differ.
 *
";

/// A C file whose names all begin with one prefix.
pub(super) struct File<'a> {
    prefix: &'a str,
    /// Prefix of macros.
    pub(super) capitals: String,
}

impl<'a> File<'a> {
    pub(super) fn new(prefix: &'a str) -> Self {
        Self { prefix, capitals: prefix.to_ascii_uppercase() }
    }

    /// Returns a C text with the prefix inserted.
    pub(super) fn c(&self, text: &str) -> String {
        text.replace("@@", &self.capitals).replace('@', self.prefix)
    }

    /// Returns indented lines of a comment: code with the prefix inserted, then its note in a column of its own. A line
    /// without a note may be longer than the column.
    pub(super) fn listed(&self, lines: &[(String, String)]) -> String {
        let lines: Vec<_> = lines.iter().map(|(code, note)| (self.c(code), note)).collect();
        let column = lines.iter().filter(|(_, note)| !note.is_empty()).map(|(code, _)| code.len()).max().unwrap_or(0);
        let line =
            |(code, note): &(String, &String)| format!(" *     {code:<column$}  {note}").trim_end().to_owned() + "\n";
        lines.iter().map(line).collect()
    }

    /// Returns the head comment: title, rules for the compiler, and origin of the file.
    pub(super) fn head(&self, title: &str, usage: &str, origin: &str) -> String {
        let version = controller_core::VERSION;
        let mut out = format!(
            "/* {title}\n * Exported by version {version} of the library. Do not edit; export again. C99 and C++11, no \
             library needed.\n",
            title = title.replace('\n', "\n * "),
        );
        out += &self.c(usage);
        out += &self.c(" *
 * COMPILER OPTIONS. The bits equal the bits of the Rust tick only if every operation is rounded on its own. A fused
 * multiply-add rounds a * b + c once, which is another number and takes longer on a Cortex-M4F. So compile with
 * -ffp-contract=off. This file also switches fusing off by itself where the compiler permits it. GCC then inlines
 * @_tick only if the option is given, too. Reordering (-ffast-math and its parts) and the precision of x87 change
 * bits as well: if the compiler reports them, this file does not compile. clang reports only -ffast-math and
 * -ffinite-math-only; with clang the file switches reordering off. No check detects -fno-signed-zeros (also part of
 * -funsafe-math-optimizations), -fno-honor-nans and -fno-honor-infinities: never use them.
 *
");
        out += &self.c(MODES);
        for line in origin.lines() {
            out.push_str(format!(" * {line}").trim_end());
            out.push('\n');
        }
        out + " */\n"
    }

    /// Returns the requirements on the compiler, which follow the head.
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

    /// Returns everything behind the head within its include guard; `form` follows the prefix in the name of the guard.
    /// The guard holds a checksum of the body. Including one file twice is allowed. Two files with one prefix and
    /// different bodies are an error, after which the compiler shows the origin of the other file.
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

    /// Returns the check of the floating-point modes.
    pub(super) fn modes(&self) -> String {
        self.c(include_str!("c/modes.h"))
    }

    /// Returns the declaration of a function defined in another file.
    pub(super) fn declaration(&self, meaning: &str, head: &str) -> String {
        self.c(&format!("\n/* {meaning} */\n{head};\n"))
    }

    /// Returns a float function that performs a recorded operation trace.
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

    /// Returns a function that performs a recorded operation trace, in float or double.
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

    /// Returns the name of the function that converts a count to a signed number; a file with counts contains
    /// [`c::signed`].
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
