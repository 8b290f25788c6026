//! Static analysis of the C code that users get: MISRA C:2012 by cppcheck's addon, most warnings of two compilers,
//! their analysers, and clang-tidy. Only the findings that `docs/safety.md` lists are allowed.
//!
//! Files are analysed directly as C, not through an `#include`, because analysers skip functions of headers and would
//! report nothing. Each program also gets a planted fault and must report it.
//!
//! Frama-C's Eva is a separate command: its Debian package installs 862 MB, including GTK and an OCaml compiler, for a
//! minute of analysis. docs/safety.md lists the results and their limits.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::scan::section;
use crate::setup::CROSS_C;
use crate::step::{Failure, Gate, Invocation, Outcome};

const RERUN: &str = "cargo xtask evidence";
const DEVIATIONS: &str = "docs/safety.md";
/// Heading of the appendix of [`DEVIATIONS`]; its table is the list.
const APPENDIX: &str = "## Appendix: MISRA C:2012 deviations";
/// Working folder of the analysed files.
const FOLDER: &str = "target/evidence";

/// A C file: name in the folder, name in [`DEVIATIONS`], and its path or the scenario of its export.
const FILES: [(&str, &str, &str); 5] = [
    ("chain.h", "exported", "scenario/scenarios/chain.toml"),
    ("motor.h", "exported", "scenario/scenarios/motor.toml"),
    ("drive.h", "exported", "examples/c/drive_standalone.h"),
    ("design.h", "design", "examples/c/paper_design.h"),
    ("edo_smc.h", "header", "controller-capi/include/edo_smc.h"),
];

/// Planted fault: an uninitialised variable on one path, and a truncated number. Each program reports at least one.
const PLANTED: &str = "
static inline int planted(int x)
{
    float y;
    if (x > 0) {
        y = 1.5f;
    }
    return y;
}
";

/// Advisory rules of MISRA C:2012; only these rules may have deviations.
const ADVISORY: [&str; 30] = [
    "2.3", "2.4", "2.5", "2.6", "2.7", "4.2", "5.9", "8.7", "8.9", "8.11", "8.13", "10.5", "11.4", "11.5", "12.1",
    "12.3", "12.4", "13.3", "13.4", "15.1", "15.4", "15.5", "17.5", "17.8", "18.4", "18.5", "19.2", "20.1", "20.5",
    "20.10",
];

/// Prefix of the addon's findings.
const MISRA: &str = "misra-c2012-";

/// An analysis program; the file is its last argument.
struct Tool {
    program: &'static str,
    arguments: &'static str,
    /// Arguments after the file.
    then: &'static str,
}

/// The addon, and cppcheck's own findings. cppcheck has no system headers, so the contents of `float.h` are defined
/// here. With a macro defined, it checks one configuration only, which is C. The check for always-true conditions is
/// disabled: code from an operation trace may repeat a comparison that an earlier branch has decided.
const CPPCHECK: Tool = Tool {
    program: "cppcheck",
    arguments: "--language=c --std=c99 --platform=unix32 --addon=misra --enable=style,warning,portability,performance \
                -DFLT_EVAL_METHOD=0 --suppress=missingIncludeSystem --suppress=unusedStructMember \
                --suppress=knownConditionTrueFalse --quiet \
                --template={file}:{line}:warning:{id}",
    then: "",
};

/// Warnings outside `-Wall -Wextra`. These warnings are excluded:
///
/// * `-Wfloat-equal`: clamping of u is detected by an exact comparison.
/// * `-Wbad-function-cast`: the float conversion of an integer result is intended.
/// * `-Wunused-macros`, `-Wunused-const-variable`: names of a header are for the program.
/// * `-Wunsuffixed-float-constants`: plans are computed in double.
/// * `-Wpadded`, `-Winline`, `-Waggregate-return`, `-Wlong-long`, `-Wtraditional`: these findings are not faults.
const GCC: &str = "-x c -std=c99 -O2 -pedantic -Wall -Wextra -Wno-unused-const-variable -Wconversion -Wsign-conversion \
                   -Warith-conversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wcast-align=strict \
                   -Wstrict-prototypes -Wmissing-prototypes -Wmissing-declarations -Wold-style-definition \
                   -Wredundant-decls -Wnested-externs -Wnull-dereference -Wlogical-op -Wduplicated-cond \
                   -Wduplicated-branches -Wswitch-default -Wswitch-enum -Wwrite-strings -Wvla -Wjump-misses-init \
                   -Wstrict-overflow=2 -Wpointer-arith -Winit-self -fkeep-inline-functions -fanalyzer -S -o /dev/null";

/// Excluded in addition to [`GCC`]: `-Wdeclaration-after-statement` (allowed in C99), `-Wunused-function` (functions of
/// a header are for the program), `-Wunsafe-buffer-usage` (C has no other arrays).
const CLANG: &str = "-x c -std=c99 -Weverything -Wno-unknown-warning-option -Wno-float-equal -Wno-bad-function-cast \
                     -Wno-unused-macros -Wno-unused-const-variable -Wno-unused-function -Wno-padded \
                     -Wno-declaration-after-statement -Wno-unsafe-buffer-usage -O2 -S -o /dev/null";

/// Excluded: lengths of names, since formulas keep the paper's letters; digits in a formula as magic numbers; `f` for
/// `F`; function length, since the code is straight-line; swappable arguments; sizes that are asserted as products.
const TIDY: &str = "--quiet --checks=-*,clang-analyzer-*,bugprone-*,cert-*,misc-*,performance-*,portability-*,\
                    readability-*,-readability-identifier-length,-readability-magic-numbers,\
                    -readability-uppercase-literal-suffix,-readability-function-cognitive-complexity,\
                    -bugprone-easily-swappable-parameters,-bugprone-implicit-widening-of-multiplication-result";

const TOOLS: [Tool; 6] = [
    CPPCHECK,
    Tool { program: "gcc", arguments: GCC, then: "" },
    Tool { program: CROSS_C, arguments: GCC, then: "" },
    Tool { program: "clang", arguments: CLANG, then: "" },
    Tool { program: "clang", arguments: "--analyze -x c -std=c99 --analyzer-output text", then: "" },
    Tool { program: "clang-tidy", arguments: TIDY, then: "-- -x c -std=c99" },
];

/// Programs of the step, and their packages.
pub(crate) const PROGRAMS: [(&str, &[&str]); 4] =
    [("cppcheck", &["cppcheck"]), ("gcc", &["gcc"]), ("clang", &["clang"]), ("clang-tidy", &["clang-tidy"])];

impl Tool {
    /// Returns the findings in a file of [`FOLDER`]: one line each with file, place and message.
    fn findings(&self, gate: &Gate, file: &str) -> Result<Vec<String>, String> {
        let words = |text: &'static str| text.split(' ').filter(|word| !word.is_empty()).collect::<Vec<_>>();
        let path = format!("{FOLDER}/{file}");
        let look = Invocation::new(self.program, &words(self.arguments)).with(&[&path]).with(&words(self.then));
        let said = look.output(gate).map_err(|error| format!("{look}: {error}"))?;
        let is_finding = |line: &&str| line.contains("warning:") || line.contains("error:");
        Ok(said.lines().filter(is_finding).map(str::to_string).collect())
    }
}

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    exports(gate)?;
    gate.check("C analysed by cppcheck, its MISRA addon, gcc, clang and their analysers", RERUN, |gate| {
        let page = fs::read_to_string(gate.root.join(DEVIATIONS)).map_err(|error| format!("{DEVIATIONS}: {error}"))?;
        let appendix = section(&page, APPENDIX).ok_or_else(|| format!("{DEVIATIONS} has no section `{APPENDIX}`"))?;
        let listed = listed(&appendix)?;
        let (mut found, mut faults) = (BTreeSet::new(), Vec::new());
        for (file, like, _) in FILES {
            for tool in &TOOLS {
                for finding in tool.findings(gate, file)? {
                    // Findings in included files are reported for those files.
                    if !finding.contains(&format!("{FOLDER}/{file}:")) {
                        continue;
                    }
                    let rule = finding.rsplit_once(MISRA).map(|(_, rule)| (like.to_string(), rule.to_string()));
                    match rule {
                        Some(rule) if listed.contains(&rule) => _ = found.insert(rule),
                        _ => faults.push(format!("{}: {finding}", tool.program)),
                    }
                }
            }
        }
        faults.extend(
            listed
                .difference(&found)
                .map(|(like, rule)| format!("{DEVIATIONS}: {like}, rule {rule}: this is not found any more")),
        );
        if !faults.is_empty() {
            return Err(faults.join("\n"));
        }
        planted(gate)?;
        Ok(format!("nothing in {} files but {} advisory rules that {DEVIATIONS} lists", FILES.len(), found.len()))
    })
}

/// Checks that every program reports the planted fault; without it, a clean result would mean nothing.
fn planted(gate: &Gate) -> Result<(), String> {
    let folder = gate.root.join(FOLDER);
    let text = fs::read_to_string(folder.join("motor.h")).map_err(|error| format!("motor.h: {error}"))?;
    fs::write(folder.join("planted.h"), text + PLANTED).map_err(|error| format!("planted.h: {error}"))?;
    for tool in &TOOLS {
        let is_seen = |finding: &String| !finding.contains(MISRA) || finding.contains("10.3");
        if !tool.findings(gate, "planted.h")?.iter().any(is_seen) {
            return Err(format!("{} {}: finds nothing in a file with a fault", tool.program, tool.arguments));
        }
    }
    Ok(())
}

/// Writes all files into [`FOLDER`].
fn exports(gate: &mut Gate) -> Outcome {
    gate.step("exported C files", |gate| {
        let failed = |reason: String| Failure { reason, rerun: RERUN.into() };
        fs::create_dir_all(gate.root.join(FOLDER)).map_err(|error| failed(format!("{FOLDER}: {error}")))?;
        for (file, _, source) in FILES {
            let to = format!("{FOLDER}/{file}");
            if Path::new(source).extension().is_some_and(|extension| extension == "toml") {
                let prefix = file.trim_end_matches(".h");
                let export = gate.built()?.program("host-sim")?.with(&["export", source, "--standalone", "--force"]);
                export.with(&["--prefix", prefix, "-o", &to]).run(gate)?;
            } else {
                fs::copy(gate.root.join(source), gate.root.join(to)).map_err(|e| failed(format!("{source}: {e}")))?;
            }
        }
        Ok(())
    })
}

/// Rows `| file | rule | why |` of the appendix.
fn listed(page: &str) -> Result<BTreeSet<(String, String)>, String> {
    let mut rows = BTreeSet::new();
    for line in page.lines().filter(|line| line.starts_with('|')).skip(2) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        let [like, rule, why] = cells[..] else { return Err(format!("{DEVIATIONS}: `{line}` has not three cells")) };
        if !ADVISORY.contains(&rule) {
            return Err(format!("{DEVIATIONS}: rule {rule} is not advisory: mend the code"));
        }
        if why.len() < 20 || !rows.insert((like.to_string(), rule.to_string())) {
            return Err(format!("{DEVIATIONS}: {like}, rule {rule}: one row, with its reason"));
        }
    }
    Ok(rows)
}

/// C program that calls the functions of a chain, or of a drive; `@` is the prefix, `@@` the prefix of macros.
const CHAIN: &str = include_str!("evidence/chain.c");
const DRIVE: &str = include_str!("evidence/drive.c");

/// Prefix in [`FILES`], calling program, and name suffixes of the encoders.
const PROGRAMS_OF_EVA: [(&str, &str, &[&str]); 3] =
    [("chain", CHAIN, &[]), ("motor", DRIVE, &[""]), ("drive", DRIVE, &["_link", "_motor"])];

/// Runs Eva on the exported files: undefined behaviour for every input and every order of calls.
pub(crate) fn eva(gate: &mut Gate) -> Outcome {
    exports(gate)?;
    gate.check("exported C analysed by Frama-C's Eva", "cargo xtask eva", |gate| {
        let mut told = Vec::new();
        for (prefix, calls, shafts) in PROGRAMS_OF_EVA {
            let any = |shaft: &&str| format!("sample.count{shaft} = any; sample.lost{shaft} = any != 0u;");
            let counts: Vec<String> = shafts.iter().map(any).collect();
            let program = calls.replace("COUNTS", &counts.join(" ")).replace("@@", &prefix.to_uppercase());
            let program = program.replace('@', prefix);
            told.push(format!("{prefix}: 0 alarms. {}", free_of_alarms(gate, &program)?));
            let start = "int main(void)\n{";
            let faulty = program.replace(start, &format!("{PLANTED}\n{start}\n    (void)planted((int)number);"));
            if free_of_alarms(gate, &faulty).is_ok() {
                return Err(format!("{prefix}: no alarm in a program with a fault"));
            }
        }
        Ok(told.join("\n"))
    })
}

/// Returns the coverage of the analysis, or Eva's message. An analysis that ends early reports no alarms either.
fn free_of_alarms(gate: &Gate, program: &str) -> Result<String, String> {
    let file = format!("{FOLDER}/eva.c");
    fs::write(gate.root.join(&file), program).map_err(|error| format!("{file}: {error}"))?;
    let look = "-eva -eva-precision 2 -warn-special-float none -machdep gcc_x86_32";
    let eva = Invocation::new("frama-c", &look.split(' ').collect::<Vec<_>>()).with(&[&file]);
    let said = eva.output(gate).map_err(|error| {
        format!(
            "{eva}: {error}\nno tier installs it (862 MB); on Debian, as root:\n  apt-get install \
             --no-install-recommends frama-c-base"
        )
    })?;
    let reached = said.lines().find_map(|line| line.split_once("statements reached")?.1.split_once("): "));
    let percent = reached.and_then(|(_, rest)| rest.split_once('%')?.0.parse::<u32>().ok());
    let line = said.lines().find(|line| line.contains("statements reached")).unwrap_or_default().trim();
    if said.contains("  0 alarms generated") && percent.is_some_and(|percent| percent >= 95) {
        Ok(line.into())
    } else {
        Err(said)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_an_advisory_rule_once_and_with_a_reason() {
        let page = |rows: &str| format!("| file | rule | why |\n|---|---|---|\n{rows}");
        let good = "| exported | 15.5 | the guard leaves at once, before anything is kept |\n";
        assert_eq!(listed(&page(good)), Ok(BTreeSet::from([("exported".into(), "15.5".into())])));
        for (rows, told) in [
            ("| exported | 10.8 | because it is so in this file |".to_string(), "not advisory"),
            ("| exported | 15.5 | so |".to_string(), "with its reason"),
            ([good, good].concat(), "one row"),
            ("| exported | 15.5 |".to_string(), "three cells"),
        ] {
            assert!(listed(&page(&rows)).expect_err("a bad row").contains(told), "{rows}");
        }
    }
}
