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
