//! Which compiler builds for the chip, and for WebAssembly.
//!
//! Two worlds of machine. Where the toolchain carries the target's core library it builds normally. Elsewhere Debian's
//! second compiler comes with the library's sources and builds core itself, with the linker of the toolchain in use;
//! that needs `RUSTC_BOOTSTRAP`, which touches only this one child process.

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::step::{Failure, Invocation};

/// Cortex-M4F with hardware floats of 32 bits.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// The second compiler and its library sources.
pub(crate) const DEBIAN_PACKAGES: [&str; 2] = ["rustc-web", "rust-web-src"];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// Who can build for the target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Compiler {
    /// The toolchain in use has the target's core library.
    Toolchain,
    /// Debian's, which builds core from source.
    Debian {
        /// That of the toolchain in use: Debian brings none.
        linker: PathBuf,
    },
}

impl Compiler {
    /// Who builds here for a target with this library, `core` or `std`, if anybody.
    pub(crate) fn find_for(target: &str, library: &str) -> Option<Self> {
        let libraries = Invocation::new("rustc", &["--print", "target-libdir", "--target", target]).answer();
        if libraries.is_some_and(|directory| holds(Path::new(&directory), library)) {
            return Some(Self::Toolchain);
        }
        let sysroot = Invocation::new(DEBIAN_RUSTC, &["--print", "sysroot"]).answer()?;
        let sources = Path::new(&sysroot).join("lib/rustlib/src/rust/library").join(library).join("Cargo.toml");
        // Beside the libraries of the host, `lib/rustlib/HOST/lib`, stand its tools.
        let host_libraries = Invocation::new("rustc", &["--print", "target-libdir"]).answer()?;
        let linker = Path::new(&host_libraries).with_file_name("bin").join("rust-lld");
        (sources.exists() && linker.exists()).then_some(Self::Debian { linker })
    }

    /// Who builds for the chip, where it must be there.
    pub(crate) fn required() -> Result<Self, Failure> {
        Self::required_for(TARGET)
    }

    /// The same for another core.
    pub(crate) fn required_for(target: &str) -> Result<Self, Failure> {
        Self::find_for(target, "core").ok_or_else(|| Failure {
            reason: format!(
                "no compiler for {target}: `cargo xtask setup` installs it, or says what to install (or: rustup \
                 target add {target})"
            ),
            rerun: String::from("cargo xtask setup"),
        })
    }

    /// Its name and version.
    pub(crate) fn version(&self) -> String {
        let program = if *self == Self::Toolchain { "rustc" } else { DEBIAN_RUSTC };
        Invocation::new(program, &["--version"]).answer().unwrap_or_default()
    }

    /// `cargo VERB` for the chip in release mode.
    pub(crate) fn cargo(&self, verb: &str) -> Invocation {
        self.cargo_for(verb, TARGET, "core", "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER")
    }

    /// The same for a target with these libraries; `linker_variable` is the one in which cargo looks for its linker.
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

/// Builds a workspace of its own for the chip. The one way: paths in it would change not only messages but, through the
/// hashes in symbols, the order of instructions.
pub(crate) fn build(root: &Path, manifest: &str) -> Result<Invocation, Failure> {
    let build = Compiler::required()?.cargo("build").with(&["--manifest-path", manifest]);
    Ok(build.with(&["--config", &without_paths(root)]))
}

/// A setting of cargo, on top of those in the files: a panic tells its place relative to this workspace or to the crate
/// it is in, so that an image is the same, and as large, wherever it was built.
fn without_paths(root: &Path) -> String {
    let remaps: Vec<String> = remaps(root).into_iter().map(|remap| format!("'{remap}'")).collect();
    format!("target.{TARGET}.rustflags=[{}]", remaps.join(", "))
}

/// Tells the compiler other names for the folders of this workspace and of the crates.
fn remaps(root: &Path) -> Vec<String> {
    let home = std::env::home_dir().unwrap_or_default().join(".cargo");
    let home = std::env::var_os("CARGO_HOME").map_or(home, PathBuf::from);
    let registries = std::fs::read_dir(home.join("registry/src")).into_iter().flatten().flatten();
    let crates = registries.map(|registry| format!("{}=crates", registry.path().display()));
    let all = std::iter::once(format!("{}=.", root.display())).chain(crates);
    all.map(|remap| format!("--remap-path-prefix={remap}")).collect()
}

/// Where this program, which cargo runs as its compiler, finds the folder whose name is to be in no file.
pub(crate) const ROOT: &str = "XTASK_COMPILES_IN";

/// The same, and the name of the folder is in no byte of what comes out.
///
/// Cargo numbers a package by its folder, the compiler makes hashes in symbols of that, and its linker an order of
/// functions. Nothing in a manifest changes it. So cargo is given this program for a compiler.
pub(crate) fn anywhere(cargo: Invocation, root: &Path) -> Result<Invocation, Failure> {
    let this = std::env::current_exe()
        .map_err(|error| Failure { reason: format!("this program has no path: {error}"), rerun: String::new() })?;
    let wrapped = cargo.env("RUSTC_WRAPPER", &this.to_string_lossy());
    Ok(wrapped.env(ROOT, &root.to_string_lossy()))
}

/// Compiles as cargo asks, but for [`anywhere`].
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

/// A package of ours by its name and version instead of cargo's number.
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
