//! Translation validation of the shipped machine code with `cycle-bound --means`: the image, the static library, the
//! exported assembly, and GCC's code for the exported C files. The specifications come from the operation traces of
//! `tick-record`; bound and validation use one disassembly.

use std::collections::BTreeMap;
use std::path::Path;

use crate::compiler::TARGET;
use crate::setup::CROSS_C;
use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::{budget, capi, firmware};

/// Folder of specifications, C files and linked programs.
const FOLDER: &str = "target/means";
/// Functions of the exported C file of a controller or a drive.
const FUNCTIONS: [&str; 6] = ["tick", "start", "not_started", "report_applied", "estimates", "reset"];
/// Functions of the assembly: with a tick of u alone, and the parts of a drive's tick.
const ASSEMBLED: [&str; 7] = ["tick_u", "tick", "start", "not_started", "report_applied", "estimates", "reset"];
const ASSEMBLED_DRIVE: [&str; 15] = [
    "tick",
    "tick_u",
    "begin",
    "observe",
    "law",
    "give_up",
    "refuse",
    "pass",
    "follow",
    "carry",
    "start",
    "not_started",
    "report_applied",
    "estimates",
    "reset",
];
/// Optimisation levels of GCC.
const LEVELS: [&str; 4] = ["-O1", "-O2", "-O3", "-Os"];
const GCC: [&str; 8] = [
    "-std=c99",
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-ffp-contract=off",
    "-nostdlib",
    "-Wl,-Ttext=0x08000000,-e,0",
];

/// Assembly contained in the images.
struct Shipped {
    /// Prefix of its functions.
    prefix: &'static str,
    file: &'static str,
    /// Scenario of its export, with options.
    scenario: &'static [&'static str],
    functions: &'static [&'static str],
}

const SHIPPED: [Shipped; 4] = [
    Shipped {
        prefix: "joint_r2",
        file: "firmware/src/assembly/joint_r2.S",
        scenario: &["firmware/joint.toml"],
        functions: &ASSEMBLED,
    },
    Shipped {
        prefix: "joint_r3",
        file: "firmware/src/assembly/joint_r3.S",
        scenario: &["firmware/joint.toml", "--set", ORDER_3_AT_100],
        functions: &ASSEMBLED,
    },
    Shipped {
        prefix: "motor",
        file: "firmware/src/assembly/motor.S",
        scenario: &["firmware/motor.toml", PERIOD[0], PERIOD[1], SETS[0], SETS[1]],
        functions: &ASSEMBLED_DRIVE,
    },
    Shipped {
        prefix: "joint_drive",
        file: "firmware/src/assembly/joint_drive.S",
        scenario: &["firmware/drive.toml", PERIOD[0], PERIOD[1], SETS[0], SETS[1], APART[0], APART[1]],
        functions: &ASSEMBLED_DRIVE,
    },
];
const PERIOD: [&str; 2] = ["--set", "drive.period_s=1e-3"];
const SETS: [&str; 2] = ["--set", "drive.gain_sets=1"];
/// Option for one observer per encoder.
const APART: [&str; 2] = ["--set", "drive.tuning=\"normal\""];
const ORDER_3_AT_100: &str =
    "controller.observer=[{channel=2,bandwidth_rad_s=100,order=3},{channel=4,bandwidth_rad_s=100,order=3}]";

/// An export, and its validated functions.
struct Exported {
    name: &'static str,
    scenario: &'static [&'static str],
    in_c: &'static [&'static str],
    in_assembly: &'static [&'static str],
}

const EXPORTED: [Exported; 5] = [
    Exported { name: "joint", scenario: &["--set", LIMITS], in_c: &FUNCTIONS, in_assembly: &ASSEMBLED },
    Exported {
        name: "joint_r3",
        scenario: &["--set", LIMITS, "--set", ORDER_3],
        in_c: &FUNCTIONS,
        in_assembly: &ASSEMBLED,
    },
    Exported { name: "chain", scenario: &["scenario/scenarios/chain.toml"], in_c: &FUNCTIONS, in_assembly: &ASSEMBLED },
    Exported {
        name: "motor",
        scenario: &["scenario/scenarios/motor.toml"],
        in_c: &FUNCTIONS,
        in_assembly: &ASSEMBLED_DRIVE,
    },
    Exported { name: "joint_drive", scenario: &["examples/c/drive.toml"], in_c: &FUNCTIONS, in_assembly: &[] },
];
const LIMITS: &str = "controller.limits={ min = -300, max = 300 }";
const ORDER_3: &str = "controller.observer=[{ channel = 2, bandwidth_rad_s = 10, order = 3 }, \
                       { channel = 4, bandwidth_rad_s = 10, order = 3 }]";

/// Instances with a cycle budget and without a specification, with the reason. An instance in neither list fails.
const WITHOUT: [(&str, &str); 6] = [
    ("budget::joint_whole::tick", WAYS),
    ("budget::joint_whole_two_sets::tick", WAYS),
    ("budget::joint_whole_late::tick", WAYS),
    ("budget::benchmark_libm::tick", EXPONENTIAL),
    ("budget::benchmark_micromath::tick", EXPONENTIAL),
    ("budget::sine::tick", "no tick: the sine of a drive's map alone"),
];
const WAYS: &str = "as one record it has more ways than the recorder takes";
/// Functions of the static library without validation, by a part of their names, with the reason.
const WITHOUT_IN_THE_ARCHIVE: [(&str, &str); 17] = [
    ("edo_smc_version", SIZE),
    ("edo_smc_modes_ok", "asks for the modes of the machine"),
    ("edo_smc_design_size_", SIZE),
    ("edo_smc_state_size_", SIZE),
    ("edo_smc_init_", "compares a design with its check"),
    ("edo_smc_design_", "designs, in f64"),
    ("edo_smc_by_rule_", "designs, in f64"),
    ("edo_smc_tune_", "designs, in f64"),
    ("edo_smc_retune_", "takes a new design over, which is not recorded"),
    ("edo_smc_plan_", "a planned way, of which parts are recorded"),
    ("edo_smc_profile_", "set-points, in whole numbers, of which the target alone is recorded"),
    ("edo_smc_missed_", "ticks without a sample in a loop, of which one is recorded"),
    ("edo_smc_trip_", "four words of the monitors"),
    ("edo_smc_limit_", "two words of the law"),
    ("edo_smc_fence_", "designs, in f64"),
    ("edo_smc_guard_", "compares estimates with limits, which is not recorded"),
    ("_coupled", WAYS),
];
/// Instances of image and library that the fast tier validates: chains and a motor. The paths of a joint take minutes.
const QUICK: [&str; 9] = [
    "joint_r1",
    "joint_r2",
    "joint_r3",
    "joint_r2_output",
    "joint_r2_gated",
    "benchmark_without_exponential",
    "motor",
    "motor_speed",
    "n4_r2_c24",
];
/// Functions of the library's motor that the fast tier omits: with the brake, a monitored tick takes minutes.
const SLOW: [&str; 2] = ["edo_smc_tick_motor", "edo_smc_go_on_motor"];
const SIZE: &str = "a constant";
const EXPONENTIAL: &str = "an exponential of a library, which is not recorded";
/// Control interrupt: it contains more than a tick, since it accesses the peripherals.
const INTERRUPT: &str = "TIM3";

/// Returns the reason if a function of the budgets has no validation.
pub(crate) fn why_not(symbol: &str) -> Option<&'static str> {
    let of_the_archive =
        WITHOUT_IN_THE_ARCHIVE.iter().filter(|(part, _)| symbol.contains("edo_smc") && symbol.contains(part));
    let interrupt = symbol.contains(INTERRUPT).then_some("an interrupt is more than its tick: it talks to the chip");
    WITHOUT.iter().filter(|(name, _)| *name == symbol).chain(of_the_archive).map(|(_, why)| *why).next().or(interrupt)
}

/// Extent of the validation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Instances listed in [`QUICK`].
    Image,
    /// The whole library, exported C at every level of GCC, and assembly.
    All,
}

/// Builds the image and validates everything.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    firmware::run(gate)?;
    capi::run(gate, capi::Cores::Emulated)?;
    judge(gate, Extent::All)
}

fn failed(reason: String) -> Failure {
    Failure { reason, rerun: "cargo xtask means".into() }
}

/// Validates the machine code against the operation traces.
pub(crate) fn judge(gate: &mut Gate, extent: Extent) -> Outcome {
    gate.step("machine code equals the tick", |gate| {
        let folder = gate.root.join(FOLDER);
        std::fs::create_dir_all(&folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
        of_the_image_and_the_archive(gate, &folder.join("recorded"), extent)?;
        if extent == Extent::All {
            for exported in &EXPORTED {
                of_the_files(gate, &folder.join(exported.name), exported)?;
            }
        }
        // Each specification needs a run of `export`, so the fast tier validates one file.
        let all = if extent == Extent::All { &SHIPPED[..] } else { &SHIPPED[..1] };
        for shipped in all {
            of_the_assembly(gate, &folder.join("shipped"), shipped)?;
        }
        println!("\nheld to no record:");
        for (names, why) in WITHOUT.iter().chain(&WITHOUT_IN_THE_ARCHIVE) {
            println!("  {names:<36} {why}");
        }
        Ok(())
    })
}

/// Validates the ticks of the Rust image and the functions of the library.
fn of_the_image_and_the_archive(gate: &Gate, folder: &Path, extent: Extent) -> Outcome {
    let wrong = |error: std::io::Error| failed(format!("{}: {error}", folder.display()));
    // Removes specifications of an earlier run.
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(wrong)?;
    }
    let instances = if extent == Extent::All { &[][..] } else { &QUICK };
    let record = gate.built()?.program("tick-record")?.with(&[&folder.display().to_string()]);
    record.with(instances).run(gate)?;
    let (mut of_image, mut of_archive) = (texts(&folder.join("image"))?, texts(&folder.join("archive"))?);
    if extent != Extent::All {
        of_archive.retain(|name, _| !SLOW.contains(&name.as_str()));
    }
    let ceilings = std::fs::read_to_string(gate.root.join(budget::CEILINGS)).map_err(wrong)?;
    let declared = capi::functions(&gate.root).map_err(failed)?;
    let without = |name: &str| WITHOUT_IN_THE_ARCHIVE.iter().any(|(part, _)| name.contains(part));
    let missing: Vec<&str> = symbols(&ceilings)
        .filter(|symbol| WITHOUT.iter().all(|(name, _)| name != symbol))
        .filter(|symbol| !is_shipped_assembly(symbol))
        .chain(declared.iter().map(String::as_str).filter(|name| !without(name)))
        .filter(|name| !of_image.contains_key(*name) && !of_archive.contains_key(*name))
        .collect();
    if extent == Extent::All && !missing.is_empty() {
        return Err(failed(format!("held to no record, and for no reason: {}", missing.join(", "))));
    }
    of_image.retain(|symbol, _| WITHOUT.iter().all(|(name, _)| name != symbol));
    of_archive.retain(|name, _| !without(name));
    held(gate, &format!("firmware/target/{TARGET}/release/budget"), of_image.values())?;
    let linked = folder.join("archive.elf").display().to_string();
    let roots: Vec<String> = of_archive.keys().map(|name| format!("-Wl,-u,{name}")).collect();
    let roots: Vec<&str> = roots.iter().map(String::as_str).collect();
    Invocation::new(CROSS_C, &GCC).with(&roots).with(&[capi::FOR_THE_CHIP, "-o", &linked]).run(gate)?;
    held(gate, &linked, of_archive.values())
}

/// Returns whether [`of_the_assembly`] validates the function.
fn is_shipped_assembly(symbol: &str) -> bool {
    let of = |shipped: &Shipped| {
        let name = symbol.strip_prefix(shipped.prefix).and_then(|rest| rest.strip_prefix('_'));
        name.is_some_and(|name| shipped.functions.contains(&name))
    };
    SHIPPED.iter().any(of)
}

/// Returns the command that exports a scenario in a form, with these names.
fn export(gate: &Gate, form: &str, prefix: &str, scenario: &[&str]) -> Result<Invocation, Failure> {
    let export = gate.built()?.program("host-sim")?.with(&["export", "--paper", form]);
    Ok(export.with(&["--prefix", prefix, "--force"]).with(scenario))
}

/// Writes the specification of each function.
fn write(gate: &Gate, export: &Invocation, functions: &[&str], texts: &[String]) -> Outcome {
    let mut each = functions.iter().zip(texts);
    each.try_for_each(|(function, text)| export.clone().with(&["--means", function, "-o", text]).run(gate))
}

/// Searches the assembly of the images again, after a change of the tick.
pub(crate) fn search(gate: &mut Gate) -> Outcome {
    gate.step("assembly of the images, scheduled again", |gate| {
        let folder = gate.root.join("target/assembly");
        std::fs::create_dir_all(&folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
        for Shipped { prefix, file, scenario, .. } in SHIPPED {
            let made = folder.join(prefix).with_extension("S");
            export(gate, "--asm", prefix, scenario)?.with(&["-o", &made.display().to_string()]).run(gate)?;
            std::fs::copy(&made, gate.root.join(file)).map_err(|error| failed(format!("{file}: {error}")))?;
        }
        Ok(())
    })
}

/// Validates all functions of an assembly file in the sources.
fn of_the_assembly(gate: &Gate, folder: &Path, shipped: &Shipped) -> Outcome {
    let &Shipped { prefix, file, scenario, functions } = shipped;
    std::fs::create_dir_all(folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
    let path = |name: &str| folder.join(format!("{prefix}{name}")).display().to_string();
    let texts: Vec<String> = functions.iter().map(|function| path(&format!("_{function}.means"))).collect();
    let elf = path(".elf");
    let roots: Vec<String> = functions.iter().map(|function| format!("-Wl,-u,{prefix}_{function}")).collect();
    let roots: Vec<&str> = roots.iter().map(String::as_str).collect();
    write(gate, &export(gate, "--asm", prefix, scenario)?, functions, &texts)?;
    Invocation::new(CROSS_C, &GCC).with(&roots).with(&[file, "-o", &elf]).run(gate)?;
    held(gate, &elf, &texts)
}

/// Returns the specifications in a folder: function and file.
fn texts(folder: &Path) -> Result<BTreeMap<String, String>, Failure> {
    let wrong = |error: std::io::Error| failed(format!("{}: {error}", folder.display()));
    let mut texts = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let file = entry.map_err(wrong)?.path().display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|error| failed(format!("{file}: {error}")))?;
        let function = text.lines().find_map(|line| line.strip_prefix("function "));
        let function = function.ok_or_else(|| failed(format!("{file}: the text names no function")))?;
        texts.insert(function.to_owned(), file);
    }
    Ok(texts)
}

/// Returns the functions with a cycle budget.
fn symbols(ceilings: &str) -> impl Iterator<Item = &str> {
    let names = ceilings.lines().filter_map(|line| line.strip_prefix("symbol = \"")?.strip_suffix('"'));
    names.filter(|name| !name.starts_with(INTERRUPT))
}

/// Validates the functions of an exported C file, compiled by GCC, and of its assembly.
fn of_the_files(gate: &Gate, folder: &Path, exported: &Exported) -> Outcome {
    let &Exported { name, scenario, in_c, in_assembly } = exported;
    std::fs::create_dir_all(folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
    for (form, functions) in [("--standalone", in_c), ("--asm", in_assembly)] {
        if functions.is_empty() {
            continue;
        }
        let file = |name: &str| folder.join(format!("{}{name}", &form[2..])).display().to_string();
        let export = export(gate, form, name, scenario)?;
        let kept: Vec<String> = functions.iter().map(|function| format!("{name}_{function}")).collect();
        let main = format!(
            "#include \"{}.h\"\n__attribute__((used)) void *const kept[] = {{{}}};\n",
            &form[2..],
            kept.join(", ")
        );
        std::fs::write(file(".c"), main).map_err(|error| failed(format!("{}: {error}", file(".c"))))?;
        let texts: Vec<String> = functions.iter().map(|function| file(&format!("_{function}.means"))).collect();
        write(gate, &export, functions, &texts)?;
        let assembled = form == "--asm";
        export.with(&["-o", &file(if assembled { ".S" } else { ".h" })]).run(gate)?;
        for level in if assembled { &LEVELS[..1] } else { &LEVELS[..] } {
            let elf = file(&format!("{level}.elf"));
            let mut link = Invocation::new(CROSS_C, &GCC).with(&[level, &file(".c"), "-o", &elf]);
            if assembled {
                link = link.with(&[&file(".S")]);
            }
            link.run(gate)?;
            held(gate, &elf, &texts)?;
        }
    }
    Ok(())
}

fn held<'a>(gate: &Gate, elf: &str, texts: impl IntoIterator<Item = &'a String>) -> Outcome {
    let texts: Vec<&str> = texts.into_iter().map(String::as_str).collect();
    gate.built()?.program("cycle-bound")?.with(&["--elf", elf, "--means"]).with(&texts).run(gate)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_instance_with_a_ceiling_is_found() {
        let text = "symbol = \"a::tick\"\nstate = \"a::STATE\"\nsymbol = \"TIM3\"\nsymbol = \"TIM3_IRQHandler\"\n\
                    symbol = \"b::tick\"\n";
        assert_eq!(symbols(text).collect::<Vec<_>>(), ["a::tick", "b::tick"]);
    }

    #[test]
    fn what_is_held_to_no_record_is_in_the_archive() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
        let declared = capi::functions(root).expect("a header");
        for (part, _) in WITHOUT_IN_THE_ARCHIVE {
            assert!(declared.iter().any(|name| name.contains(part)), "{part}");
        }
        // Excludes nothing that a chain or a drive executes at run time.
        let begins: Vec<String> = ["tick", "go_on", "report_applied", "estimates", "reset"]
            .iter()
            .flat_map(|what| ["n", "motor", "joint"].map(|of| format!("edo_smc_{what}_{of}")))
            .collect();
        let is_at_run_time = |name: &&String| begins.iter().any(|begin| name.starts_with(begin));
        let at_run_time: Vec<&String> = declared.iter().filter(is_at_run_time).collect();
        assert_eq!(at_run_time.len(), 4 * 20 + 2 * 4 * 5);
        for name in at_run_time {
            assert!(!WITHOUT_IN_THE_ARCHIVE.iter().any(|(part, _)| name.contains(part)), "{name}");
        }
    }

    #[test]
    fn all_assembly_of_the_firmware_is_held() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
        let held: BTreeSet<String> = SHIPPED.iter().map(|shipped| shipped.file.to_owned()).collect();
        let entries = std::fs::read_dir(root.join("firmware/src/assembly")).expect("a folder");
        let files =
            entries.map(|entry| format!("firmware/src/assembly/{}", entry.expect("a file").file_name().display()));
        assert_eq!(files.collect::<BTreeSet<_>>(), held);
    }

    #[test]
    fn what_is_held_to_no_record_has_a_ceiling() {
        let ceilings = include_str!("../../firmware/budgets.toml");
        let symbols: BTreeSet<&str> = symbols(ceilings).collect();
        for (name, _) in WITHOUT {
            assert!(symbols.contains(name), "{name}");
        }
    }
}
