//! Which compiler builds for the chip, and for WebAssembly.
//!
//! Two worlds of machine. Where the toolchain carries the target's core library it builds normally. Elsewhere Debian's
//! second compiler comes with the library's sources and builds core itself, with the linker of the toolchain in use; that
//! needs `RUSTC_BOOTSTRAP`, which touches only this one child process.

use std::fmt;
use std::path::{Path, PathBuf};

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
        /// It brings none.
        linker: PathBuf,
    },
}

impl Compiler {
    /// For the chip.
    pub(crate) fn find() -> Option<Self> {
        Self::find_for(TARGET, "core")
    }

    /// For a target with this library, `core` or `std`.
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

    /// The same, where it must be there.
    pub(crate) fn required() -> Result<Self, Failure> {
        Self::find().ok_or_else(|| Failure {
            reason: format!("no compiler for {TARGET}: `cargo xtask setup` installs it, or says what to install"),
            rerun: String::from("cargo xtask setup"),
        })
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
    let home = std::env::home_dir().unwrap_or_default().join(".cargo");
    let home = std::env::var_os("CARGO_HOME").map_or(home, PathBuf::from);
    let registries = std::fs::read_dir(home.join("registry/src")).into_iter().flatten().flatten();
    let crates = registries.map(|registry| format!("{}=crates", registry.path().display()));
    let remaps: Vec<String> = std::iter::once(format!("{}=.", root.display()))
        .chain(crates)
        .map(|remap| format!("'--remap-path-prefix={remap}'"))
        .collect();
    format!("target.{TARGET}.rustflags=[{}]", remaps.join(", "))
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
