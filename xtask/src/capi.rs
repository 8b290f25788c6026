//! The archive and header for firmware in C, for the chip and for this machine, and the examples in C.
//!
//! rustc's own archive carries its arithmetic of 64 bits, `memcpy` and a panic handler under their common names, which a
//! program in C has too. So everything that `edo_smc.h` declares is linked, with what it needs, into one object in which
//! only names with our prefix stay visible. Its functions keep sections of their own: a linker with `--gc-sections`
//! drops the instances that a program does not call.

use std::fs;
use std::path::{Path, PathBuf};

use crate::compiler::{self, TARGET};
use crate::step::{Gate, Invocation, Outcome};

/// Its own workspace.
const MANIFEST: &str = "controller-capi/Cargo.toml";
const HEADER: &str = "controller-capi/include/edo_smc.h";
const PREFIX: &str = "edo_smc_";
/// What `EDO_SMC_INSTANCE(name, ..)` declares, each followed by `_name`.
const FUNCTIONS: [&str; 7] = ["design_size", "state_size", "init", "tick", "report_applied", "reset", "design"];

/// Format and lints.
pub(crate) fn lint(gate: &mut Gate) -> Outcome {
    gate.commands("format, C interface", &[Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"])])?;
    let clippy = Invocation::cargo(&["clippy", "--release", "--manifest-path", MANIFEST, "--", "-D", "warnings"]);
    gate.commands("lints, C interface", &[clippy])
}

/// Builds the archives into `controller-capi/target/archive/{thumbv7em,host}`, then the examples.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let chip = compiler::build(&gate.root, MANIFEST)?;
    let host = Invocation::cargo(&["build", "--release", "--manifest-path", MANIFEST]);
    gate.commands(&format!("C interface for {TARGET} and for this machine"), &[chip, host])?;
    gate.step("archives for C, only their own names visible", |gate| {
        let failed = |reason| crate::step::Failure { reason, rerun: String::from("cargo xtask capi") };
        let names = declared(&gate.root.join(HEADER)).map_err(failed)?;
        let tools = toolchain_tools().map_err(failed)?;
        // A note on the stack means something to a hosted linker only; that of the chip warns of objects without one.
        let chip = Form { folder: "thumbv7em", ar: "arm-none-eabi-ar", without: &[".note.GNU-stack"] };
        let host = Form { folder: "host", ar: "ar", without: &[] };
        for (from, form) in [(format!("{TARGET}/release"), chip), (String::from("release"), host)] {
            let target = gate.root.join("controller-capi/target");
            let folder = target.join("archive").join(form.folder);
            fs::create_dir_all(&folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
            let archive = target.join(from).join("libedo_smc.a");
            hide(gate, &names, &tools, &archive, &folder, &form)?;
        }
        Ok(())
    })?;
    // From nothing: make does not see a new archive of the same age.
    gate.commands("examples in C", &[Invocation::new("make", &["--no-print-directory", "-C", "examples/c", "-B"])])
}

/// What differs between the two archives.
struct Form {
    folder: &'static str,
    ar: &'static str,
    /// Sections that go.
    without: &'static [&'static str],
}

/// Links one archive into one object, hides all but our names, packs it again.
fn hide(gate: &Gate, names: &[String], tools: &Tools, archive: &Path, folder: &Path, form: &Form) -> Outcome {
    let text = |path: &Path| path.display().to_string();
    let (linked, object) = (text(&folder.join("linked.o")), text(&folder.join("edo_smc.o")));
    let roots: Vec<&str> = names.iter().flat_map(|name| ["-u", name]).collect();
    let link = Invocation::new(&text(&tools.linker), &["-flavor", "gnu", "-r", "-S", "--gc-sections"]).with(&roots);
    link.with(&["-o", &linked, &text(archive)]).run(gate)?;
    // Intermediate code for a linker of another version of LLVM goes too: GNU tools stumble over it.
    let keep = format!("--keep-global-symbol={PREFIX}*");
    let sections: Vec<String> =
        [".llvmbc", ".llvmcmd"].iter().chain(form.without).map(|name| format!("--remove-section={name}")).collect();
    let sections: Vec<&str> = sections.iter().map(String::as_str).collect();
    // It finds its library by this path only, which a command of ours does not inherit.
    let library = format!("LD_LIBRARY_PATH={}", tools.library.display());
    let objcopy = Invocation::new("env", &[&library, &text(&tools.objcopy), "--wildcard", &keep]);
    objcopy.with(&sections).with(&[&linked, &object]).run(gate)?;
    let packed = folder.join("libedo_smc.a");
    if packed.exists() {
        // `ar` adds to what is there.
        let rerun = String::from("cargo xtask capi");
        let failed = |error| crate::step::Failure { reason: format!("{}: {error}", packed.display()), rerun };
        fs::remove_file(&packed).map_err(failed)?;
    }
    Invocation::new(form.ar, &["rcsD", &text(&packed), &object]).run(gate)
}

/// Names of all functions that the header declares.
fn declared(header: &Path) -> Result<Vec<String>, String> {
    let text = fs::read_to_string(header).map_err(|error| format!("{}: {error}", header.display()))?;
    let instances: Vec<&str> = instances(&text).collect();
    if instances.is_empty() {
        return Err(format!("{}: no line `EDO_SMC_INSTANCE(name, ..)`", header.display()));
    }
    let of_instances =
        instances.iter().flat_map(|instance| FUNCTIONS.map(|function| format!("{PREFIX}{function}_{instance}")));
    Ok(of_instances.chain([format!("{PREFIX}version")]).collect())
}

fn instances(header: &str) -> impl Iterator<Item = &str> {
    header.lines().filter_map(|line| Some(line.strip_prefix("EDO_SMC_INSTANCE(")?.split_once(',')?.0))
}

/// What the toolchain in use brings beside its compiler.
struct Tools {
    linker: PathBuf,
    objcopy: PathBuf,
    library: PathBuf,
}

fn toolchain_tools() -> Result<Tools, String> {
    let sysroot = Invocation::new("rustc", &["--print", "sysroot"]).answer().ok_or("rustc does not answer")?;
    let libraries = Invocation::new("rustc", &["--print", "target-libdir"]).answer().ok_or("rustc does not answer")?;
    let tools = Path::new(&libraries).with_file_name("bin");
    let (linker, objcopy) = (tools.join("rust-lld"), tools.join("rust-objcopy"));
    for tool in [&linker, &objcopy] {
        if !tool.exists() {
            return Err(format!("{} is missing: a toolchain of rustup brings it", tool.display()));
        }
    }
    Ok(Tools { linker, objcopy, library: Path::new(&sysroot).join("lib") })
}

#[cfg(test)]
mod tests {
    use super::instances;

    #[test]
    fn instances_are_read_from_the_lines_that_declare_them() {
        let header = "#define EDO_SMC_INSTANCE(name, n) ..\nEDO_SMC_INSTANCE(n2_r1_c2, 2)\n EDO_SMC_INSTANCE(no, 1)\n";
        assert!(instances(header).eq(["n2_r1_c2"]));
    }
}
