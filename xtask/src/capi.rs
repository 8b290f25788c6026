//! Static libraries and header for firmware in C, for the chip and for this machine, and the C examples.
//!
//! rustc's own static library contains 64-bit arithmetic, `memcpy` and a panic handler under their common names, which
//! a C program also defines. Everything that `edo_smc.h` declares is therefore linked with its dependencies into one
//! object. In this object only names with the prefix stay visible. Its functions keep separate sections, so a linker
//! with `--gc-sections` drops unused instances. Its bytes do not depend on the folder of the checkout.

use std::fs;
use std::path::{Path, PathBuf};

use crate::compiler::{self, Compiler};
use crate::step::{Failure, Gate, Invocation, Outcome};

/// Manifest of the C interface, a separate workspace.
pub(crate) const MANIFEST: &str = "controller-capi/Cargo.toml";
/// Build folder of the C interface.
const BUILT: &str = "controller-capi/target/build";
const ARCHIVES: &str = "controller-capi/target/archive";
const ARCHIVE: &str = "libedo_smc.a";
const HEADER: &str = "controller-capi/include/edo_smc.h";
const PREFIX: &str = "edo_smc_";
/// Macros whose lines declare functions in the header; their bodies contain the functions.
const DECLARING: [&str; 5] =
    ["EDO_SMC_INSTANCE(", "EDO_SMC_DRIVE(", "EDO_SMC_BY_RULE(", "EDO_SMC_PLANS(", "EDO_SMC_PROFILES("];

/// Checks format and lints of the C interface.
pub(crate) fn lint(gate: &mut Gate) -> Outcome {
    gate.commands("format, C interface", &[Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"])])?;
    let clippy = Invocation::cargo(&["clippy", "--release", "--manifest-path", MANIFEST, "--", "-D", "warnings"]);
    gate.commands("lints, C interface", &[clippy])
}

/// A static library: its folder, and its target.
struct Form {
    folder: &'static str,
    /// Compiler name of the core, and the variable of its linker for cargo; `None` for this machine.
    target: Option<(&'static str, &'static str)>,
}

const FORMS: [Form; 5] = [
    // Cortex-M4F and M7.
    Form { folder: "thumbv7em", target: Some(("thumbv7em-none-eabihf", "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER")) },
    // M33 with floats.
    Form {
        folder: "thumbv8m",
        target: Some(("thumbv8m.main-none-eabihf", "CARGO_TARGET_THUMBV8M_MAIN_NONE_EABIHF_LINKER")),
    },
    // M3, and larger cores that pass floats in integer registers.
    Form { folder: "thumbv7m", target: Some(("thumbv7m-none-eabi", "CARGO_TARGET_THUMBV7M_NONE_EABI_LINKER")) },
    // M0 and M0+.
    Form { folder: "thumbv6m", target: Some(("thumbv6m-none-eabi", "CARGO_TARGET_THUMBV6M_NONE_EABI_LINKER")) },
    Form { folder: "host", target: None },
];

/// Folder of the chip that the examples run on.
const CHIP: &str = "thumbv7em";
/// Folders of the libraries that the fast tier builds.
const EMULATED: [&str; 2] = [CHIP, "host"];

/// Returns the compiler names of the supported cores.
pub(crate) fn targets() -> impl Iterator<Item = &'static str> {
    FORMS.iter().filter_map(|form| Some(form.target?.0))
}

impl Form {
    fn build(&self) -> Result<Invocation, Failure> {
        match self.target {
            Some((target, linker)) => Ok(Compiler::required_for(target)?.cargo_for("build", target, "core", linker)),
            None => Ok(Invocation::cargo(&["build", "--release"])),
        }
    }

    /// Returns the path of cargo's output.
    fn built(&self) -> PathBuf {
        Path::new(BUILT).join(self.target.map_or("", |(target, _)| target)).join("release").join(ARCHIVE)
    }

    fn ar(&self) -> &'static str {
        if self.target.is_some() { "arm-none-eabi-ar" } else { "ar" }
    }

    /// Returns the sections to remove: a stack note is for hosted linkers only, and a chip's linker warns of objects
    /// without it.
    fn without(&self) -> &'static [&'static str] {
        if self.target.is_some() { &[".note.GNU-stack"] } else { &[] }
    }
}

/// Cores to build for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cores {
    /// Emulated chip and this machine: the fast tier.
    Emulated,
    /// Every core: the deep tier.
    All,
    /// One folder of [`FORMS`].
    One(&'static str),
}

impl Cores {
    fn forms(self) -> impl Iterator<Item = &'static Form> {
        FORMS.iter().filter(move |form| match self {
            Self::Emulated => EMULATED.contains(&form.folder),
            Self::All => true,
            Self::One(folder) => form.folder == folder,
        })
    }
}

/// Builds what the command line asks for: every core, or `capi CORE`.
pub(crate) fn asked(gate: &mut Gate) -> Outcome {
    let Some(word) = std::env::args().nth(2) else { return run(gate, Cores::All) };
    let known = FORMS.iter().find(|form| form.folder == word).map(|form| form.folder);
    let cores: Vec<&str> = FORMS.iter().map(|form| form.folder).collect();
    let folder = known.ok_or_else(|| Failure {
        reason: format!("{word}: no such core; there are {}", cores.join(", ")),
        rerun: format!("cargo xtask capi {}", cores[0]),
    })?;
    run(gate, Cores::One(folder))
}

/// Builds the libraries into `controller-capi/target/archive`, a folder per core, then the examples of the chip.
pub(crate) fn run(gate: &mut Gate, cores: Cores) -> Outcome {
    let builds = builds(&gate.root.clone(), cores)?;
    gate.commands("C interface for chips and host", &builds)?;
    pack(gate, cores)?;
    if cores.forms().all(|form| form.folder != CHIP) {
        return Ok(());
    }
    // Builds from scratch: make does not detect a new library with an equal date.
    gate.commands("examples in C", &[Invocation::new("make", &["--no-print-directory", "-C", "examples/c", "-B"])])
}

/// Builds the libraries of the emulated chip and of this machine from a copy of the sources and from this folder, and
/// checks that the bytes are equal.
pub(crate) fn reproduce(gate: &mut Gate) -> Outcome {
    let elsewhere = gate.root.join(BUILT).join("elsewhere");
    copy(&gate.root, &elsewhere).map_err(failed)?;
    // The libraries of this folder are built last and stay.
    let mut packed = Vec::new();
    for (headline, root) in
        [("C interface, from a copy of the sources", elsewhere), ("C interface, from this folder", gate.root.clone())]
    {
        gate.commands(headline, &builds(&root, Cores::Emulated)?)?;
        packed.push(pack(gate, Cores::Emulated)?);
    }
    gate.check("C libraries: equal bytes from both folders", "cargo xtask test --deep cores", |_| {
        let differ = packed[0].iter().zip(&packed[1]).find(|(one, other)| one.1 != other.1);
        match differ {
            None => Ok(format!("{} bytes", packed[1].iter().map(|(_, bytes)| bytes.len()).sum::<usize>())),
            Some(((folder, _), _)) => Err(format!("the archive of {folder} depends on the folder that it is built in")),
        }
    })
}

/// Returns the commands that build the libraries from the sources in a folder.
fn builds(root: &Path, cores: Cores) -> Result<Vec<Invocation>, Failure> {
    let manifest = root.join(MANIFEST).display().to_string();
    let build = |form: &Form| {
        let build = form.build()?.with(&["--manifest-path", &manifest, "--target-dir", BUILT]);
        compiler::anywhere(build, root)
    };
    cores.forms().map(build).collect()
}

fn failed(reason: String) -> Failure {
    Failure { reason, rerun: String::from("cargo xtask capi") }
}

/// Copies the sources of the library to another folder. Unchanged files stay, so nothing is recompiled for them.
fn copy(from: &Path, to: &Path) -> Result<(), String> {
    let told = |path: &Path, error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let mut open: Vec<PathBuf> = ["Cargo.toml", "controller-core", "controller-capi"].map(PathBuf::from).into();
    while let Some(path) = open.pop() {
        let (source, copied) = (from.join(&path), to.join(&path));
        if source.is_dir() {
            fs::create_dir_all(&copied).map_err(|error| told(&copied, &error))?;
            for entry in fs::read_dir(&source).map_err(|error| told(&source, &error))?.flatten() {
                open.extend((entry.file_name() != "target").then(|| path.join(entry.file_name())));
            }
            // Removes deleted files there too: the compiler rejects two files for one module.
            for entry in fs::read_dir(&copied).map_err(|error| told(&copied, &error))?.flatten() {
                if !source.join(entry.file_name()).exists() {
                    let (gone, is_folder) = (entry.path(), entry.path().is_dir());
                    let removed = if is_folder { fs::remove_dir_all(&gone) } else { fs::remove_file(&gone) };
                    removed.map_err(|error| told(&gone, &error))?;
                }
            }
        } else {
            let bytes = fs::read(&source).map_err(|error| told(&source, &error))?;
            if fs::read(&copied).ok().as_deref() != Some(&*bytes) {
                fs::write(&copied, bytes).map_err(|error| told(&copied, &error))?;
            }
        }
    }
    Ok(())
}

/// Packs the built libraries; returns their folders and bytes.
fn pack(gate: &mut Gate, cores: Cores) -> Result<Vec<(&'static str, Vec<u8>)>, Failure> {
    let mut packed = Vec::new();
    gate.step("C libraries, only their own names visible", |gate| {
        let names = declared(&gate.root.join(HEADER)).map_err(failed)?;
        let tools = toolchain_tools().map_err(failed)?;
        for form in cores.forms() {
            let folder = gate.root.join(ARCHIVES).join(form.folder);
            fs::create_dir_all(&folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
            hide(gate, &names, &tools, &gate.root.join(form.built()), &folder, form)?;
            let archive = folder.join(ARCHIVE);
            let bytes = fs::read(&archive).map_err(|error| failed(format!("{}: {error}", archive.display())))?;
            packed.push((form.folder, bytes));
        }
        Ok(())
    })?;
    Ok(packed)
}

/// Links one library into one object, hides all names without the prefix, and packs it again.
fn hide(gate: &Gate, names: &[String], tools: &Tools, archive: &Path, folder: &Path, form: &Form) -> Outcome {
    let text = |path: &Path| path.display().to_string();
    let (linked, object) = (text(&folder.join("linked.o")), text(&folder.join("edo_smc.o")));
    let roots: Vec<&str> = names.iter().flat_map(|name| ["-u", name]).collect();
    let link = Invocation::new(&text(&tools.linker), &["-flavor", "gnu", "-r", "-S", "--gc-sections"]).with(&roots);
    link.with(&["-o", &linked, &text(archive)]).run(gate)?;
    // Removes the LLVM intermediate code too: GNU tools fail on it.
    let keep = format!("--keep-global-symbol={PREFIX}*");
    let sections: Vec<String> =
        [".llvmbc", ".llvmcmd"].iter().chain(form.without()).map(|name| format!("--remove-section={name}")).collect();
    let sections: Vec<&str> = sections.iter().map(String::as_str).collect();
    // The tool finds its library only by this path, which the command does not inherit.
    let library = format!("LD_LIBRARY_PATH={}", tools.library.display());
    let objcopy = Invocation::new("env", &[&library, &text(&tools.objcopy), "--wildcard", &keep]);
    objcopy.with(&sections).with(&[&linked, &object]).run(gate)?;
    let packed = folder.join(ARCHIVE);
    if packed.exists() {
        // `ar` adds to an existing file.
        fs::remove_file(&packed).map_err(|error| failed(format!("{}: {error}", packed.display())))?;
    }
    Invocation::new(form.ar(), &["rcsD", &text(&packed), &object]).run(gate)
}

/// Library for the emulated chip.
pub(crate) const FOR_THE_CHIP: &str = "controller-capi/target/archive/thumbv7em/libedo_smc.a";

/// Returns the names of all functions that the header declares.
pub(crate) fn functions(root: &Path) -> Result<Vec<String>, String> {
    declared(&root.join(HEADER))
}

/// Returns the paths of the libraries.
pub(crate) fn files() -> Vec<String> {
    FORMS.iter().map(|form| format!("{ARCHIVES}/{}/{ARCHIVE}", form.folder)).collect()
}

/// Returns the names of all functions that a header declares.
fn declared(header: &Path) -> Result<Vec<String>, String> {
    let text = fs::read_to_string(header).map_err(|error| format!("{}: {error}", header.display()))?;
    let mut names = vec![format!("{PREFIX}version"), format!("{PREFIX}modes_ok")];
    for declaring in DECLARING {
        let functions = functions_of(&text, declaring);
        let lines: Vec<&str> = declared_by(&text, declaring).collect();
        if lines.is_empty() || functions.is_empty() {
            return Err(format!("{}: no line `{declaring}name, ..)`, or no function in its macro", header.display()));
        }
        names.extend(
            lines.iter().flat_map(|of| functions.iter().map(move |function| format!("{PREFIX}{function}_{of}"))),
        );
    }
    Ok(names)
}

/// Returns the functions in the body of a header macro: `PREFIXfunction_##name(`.
fn functions_of<'a>(header: &'a str, declaring: &str) -> Vec<&'a str> {
    let body = header.split_once(&format!("#define {declaring}")).map_or("", |(_, behind)| behind);
    // The body continues while its lines end with a backslash.
    let lines = body.split_inclusive('\n').scan(true, |goes_on, line| {
        let is_in = *goes_on;
        *goes_on = line.trim_end().ends_with('\\');
        is_in.then_some(line)
    });
    let functions = lines.flat_map(|line| line.split(PREFIX)).filter_map(|part| part.split_once("_##name("));
    functions.map(|(function, _)| function).collect()
}

fn declared_by<'a>(header: &'a str, declaring: &str) -> impl Iterator<Item = &'a str> {
    header.lines().filter_map(move |line| Some(line.strip_prefix(declaring)?.split_once(',')?.0))
}

/// Additional tools of the active toolchain.
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
    use super::declared_by;

    #[test]
    fn instances_are_read_from_the_lines_that_declare_them() {
        let header = "#define EDO_SMC_INSTANCE(name, n) ..\nEDO_SMC_INSTANCE(n2_r1_c2, 2)\n EDO_SMC_INSTANCE(no, 1)\n";
        assert!(declared_by(header, "EDO_SMC_INSTANCE(").eq(["n2_r1_c2"]));
    }
}
