//! Compiler for the chip and for WebAssembly.
//!
//! Two kinds of machine are supported. If the toolchain contains the target's core library, it builds normally.
//! Otherwise Debian's second compiler, which includes the library sources, builds core itself, with the linker of the
//! active toolchain. This needs `RUSTC_BOOTSTRAP`, which is set for that child process only.

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::step::{Failure, Invocation};

/// Cortex-M4F with a 32-bit FPU.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian packages of the second compiler and of its library sources.
pub(crate) const DEBIAN_PACKAGES: [&str; 2] = ["rustc-web", "rust-web-src"];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// Compiler for a target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Compiler {
    /// Active toolchain, which has the target's core library.
    Toolchain,
    /// Debian's compiler, which builds core from source.
    Debian {
        /// Linker of the active toolchain, since Debian has none.
        linker: PathBuf,
    },
}

impl Compiler {
    /// Returns the compiler that can build for a target with this library (`core` or `std`), if any.
    pub(crate) fn find_for(target: &str, library: &str) -> Option<Self> {
        let libraries = Invocation::new("rustc", &["--print", "target-libdir", "--target", target]).answer();
        if libraries.is_some_and(|directory| holds(Path::new(&directory), library)) {
            return Some(Self::Toolchain);
        }
        let sysroot = Invocation::new(DEBIAN_RUSTC, &["--print", "sysroot"]).answer()?;
        let sources = Path::new(&sysroot).join("lib/rustlib/src/rust/library").join(library).join("Cargo.toml");
        // The tools are next to the host libraries in `lib/rustlib/HOST/lib`.
        let host_libraries = Invocation::new("rustc", &["--print", "target-libdir"]).answer()?;
        let linker = Path::new(&host_libraries).with_file_name("bin").join("rust-lld");
        (sources.exists() && linker.exists()).then_some(Self::Debian { linker })
    }

    /// Returns the compiler for the chip, or the error that it is missing.
    pub(crate) fn required() -> Result<Self, Failure> {
        Self::required_for(TARGET)
    }

    /// Returns the compiler for another core, or the error that it is missing.
    pub(crate) fn required_for(target: &str) -> Result<Self, Failure> {
        Self::find_for(target, "core").ok_or_else(|| Failure {
            reason: format!(
                "no compiler for {target}: `cargo xtask setup` installs it, or says what to install (or: rustup \
                 target add {target})"
            ),
            rerun: String::from("cargo xtask setup"),
        })
    }

    /// Returns name and version of the compiler.
    pub(crate) fn version(&self) -> String {
        let program = if *self == Self::Toolchain { "rustc" } else { DEBIAN_RUSTC };
        Invocation::new(program, &["--version"]).answer().unwrap_or_default()
    }

    /// Returns `cargo VERB` for the chip in release mode.
    pub(crate) fn cargo(&self, verb: &str) -> Invocation {
        self.cargo_for(verb, TARGET, "core", "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER")
    }

    /// Returns `cargo VERB` for a target with these libraries; `linker_variable` names cargo's variable for its linker.
    pub(crate) fn cargo_for(
        &self,
        verb: &str,
        target: &str,
        libraries: &str,
        linker_variable: &'static str,
    ) -> Invocation {
        let common = Invocation::cargo(&[verb, "--release", "--target", target]);
        match self {
            Self::Toolchain => common,
            Self::Debian { linker } => common
                .with(&[&format!("-Zbuild-std={libraries}")])
                .env("RUSTC", DEBIAN_RUSTC)
                .env("RUSTC_BOOTSTRAP", "1")
                .env(linker_variable, &linker.to_string_lossy()),
        }
    }
}

/// Returns the build of a separate workspace for the chip. All builds use this function: different paths would change
/// messages and, through the hashes in symbols, the order of instructions.
pub(crate) fn build(root: &Path, manifest: &str) -> Result<Invocation, Failure> {
    let build = Compiler::required()?.cargo("build").with(&["--manifest-path", manifest]);
    Ok(build.with(&["--config", &without_paths(root)]))
}

/// Returns a cargo setting that makes panic locations relative to the workspace or to the crate. An image is then
/// identical, and of equal size, on every machine.
fn without_paths(root: &Path) -> String {
    let remaps: Vec<String> = remaps(root).into_iter().map(|remap| format!("'{remap}'")).collect();
    format!("target.{TARGET}.rustflags=[{}]", remaps.join(", "))
}

/// Returns the compiler options that rename the folders of this workspace and of the crates.
fn remaps(root: &Path) -> Vec<String> {
    let home = std::env::home_dir().unwrap_or_default().join(".cargo");
    let home = std::env::var_os("CARGO_HOME").map_or(home, PathBuf::from);
    let registries = std::fs::read_dir(home.join("registry/src")).into_iter().flatten().flatten();
    let crates = registries.map(|registry| format!("{}=crates", registry.path().display()));
    let all = std::iter::once(format!("{}=.", root.display())).chain(crates);
    all.map(|remap| format!("--remap-path-prefix={remap}")).collect()
}

/// Variable with the folder whose name must not appear in any file, for this program as cargo's compiler.
pub(crate) const ROOT: &str = "XTASK_COMPILES_IN";

/// Returns a cargo invocation whose output does not contain the name of the folder in any byte.
///
/// Cargo numbers a package by its folder. The compiler derives hashes in symbols from the number, and its linker
/// derives the order of functions. No manifest setting changes this, so cargo uses this program as its compiler.
pub(crate) fn anywhere(cargo: Invocation, root: &Path) -> Result<Invocation, Failure> {
    let this = std::env::current_exe()
        .map_err(|error| Failure { reason: format!("this program has no path: {error}"), rerun: String::new() })?;
    let wrapped = cargo.env("RUSTC_WRAPPER", &this.to_string_lossy());
    Ok(wrapped.env(ROOT, &root.to_string_lossy()))
}

/// Compiles for cargo with the replacements of [`anywhere`].
pub(crate) fn compile(root: &OsStr) -> ExitCode {
    let mut asked = std::env::args_os().skip(1);
    let Some(compiler) = asked.next() else { return ExitCode::FAILURE };
    let set = |name: &str| std::env::var(name).unwrap_or_default();
    let package = format!("{}-{}", set("CARGO_PKG_NAME"), set("CARGO_PKG_VERSION"));
    let is_ours = Path::new(&set("CARGO_MANIFEST_DIR")).starts_with(root);
    let mut command = Command::new(compiler);
    command.args(numbered(asked, is_ours.then_some(&*package))).args(remaps(Path::new(root)));
    match command.status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("the compiler could not be started: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns the arguments with a package number from name and version instead of cargo's number.
fn numbered(asked: impl Iterator<Item = OsString>, package: Option<&str>) -> Vec<OsString> {
    let number = |argument: OsString| match package {
        Some(package) if argument.to_string_lossy().starts_with("metadata=") => format!("metadata={package}").into(),
        _ => argument,
    };
    asked.map(number).collect()
}

impl fmt::Display for Compiler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Toolchain => write!(f, "the toolchain in use has {TARGET}"),
            Self::Debian { linker } => {
                write!(f, "{DEBIAN_RUSTC} with its library sources, linker {}", linker.display())
            }
        }
    }
}

fn holds(directory: &Path, library: &str) -> bool {
    let Ok(entries) = std::fs::read_dir(directory) else { return false };
    let name = format!("lib{library}-");
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_of_ours_has_its_name_for_a_number_and_no_other_has() {
        let asked = || ["--crate-name", "x", "-C", "metadata=abc", "-C", "opt-level=3"].map(OsString::from).into_iter();
        assert_eq!(numbered(asked(), None), asked().collect::<Vec<_>>());
        let ours = numbered(asked(), Some("x-1.0.0"));
        assert_eq!((ours.len(), ours[3].to_str()), (6, Some("metadata=x-1.0.0")));
    }
}
