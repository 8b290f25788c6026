//! Cargo features of this crate: parts that the first commands do not need are built on request.
//!
//! A left-out command or option stays in `--help`. It then prints one line with its feature and the command to type.
//! Each feature has one module in two versions with equal signatures, for example `transport/board.rs` and
//! `transport/no_board.rs`; [`Feature::is_built_in`] is the one list of them.

use std::ffi::OsString;

/// Cargo feature of this crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Export of assembly.
    Asm,
    /// Emulated target, serial ports and machine code analysis.
    Chip,
    /// Monte Carlo trials as Parquet.
    Parquet,
    /// Figures as PNG.
    Png,
    /// Certificates of exported files.
    Proof,
}

impl Feature {
    /// All features.
    pub const ALL: [Self; 5] = [Self::Asm, Self::Chip, Self::Parquet, Self::Png, Self::Proof];

    /// Returns the name on the command line of cargo.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Asm => "asm",
            Self::Chip => "chip",
            Self::Parquet => "parquet",
            Self::Png => "png",
            Self::Proof => "proof",
        }
    }

    /// Returns whether this program has the feature.
    pub const fn is_built_in(self) -> bool {
        match self {
            Self::Asm => cfg!(feature = "asm"),
            Self::Chip => cfg!(feature = "chip"),
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Png => cfg!(feature = "png"),
            Self::Proof => cfg!(feature = "proof"),
        }
    }

    /// Returns the message for a command or option without its feature. `args` are the arguments of the program.
    pub fn missing(self, what: &str, args: &[OsString]) -> String {
        let name = self.name();
        let words: Vec<String> = args.iter().map(|word| quoted(&word.to_string_lossy())).collect();
        format!("{what} needs the feature {name}: cargo run --release --features {name} -- {}", words.join(" "))
    }
}

/// Quotes a word for a shell.
pub(crate) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./=,:+%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_left_out_command_names_its_feature_and_the_command_to_type() {
        let args = ["pil", "my file.toml", "--set", "controller.k_l=100"].map(OsString::from);
        assert_eq!(
            Feature::Chip.missing("pil", &args),
            "pil needs the feature chip: cargo run --release --features chip -- pil 'my file.toml' \
             --set controller.k_l=100"
        );
    }

    #[test]
    fn every_feature_is_one_of_the_manifest_and_full_has_all() {
        let manifest = include_str!("../Cargo.toml").parse::<toml_edit::DocumentMut>().expect("a manifest");
        let features = manifest["features"].as_table().expect("features");
        let mut names: Vec<&str> = features.iter().map(|(name, _)| name).filter(|name| *name != "full").collect();
        names.sort_unstable();
        assert_eq!(names, Feature::ALL.map(Feature::name));
        let full = features["full"].as_array().expect("a list");
        assert_eq!(full.iter().filter_map(|name| name.as_str()).collect::<Vec<_>>(), names);
    }
}
