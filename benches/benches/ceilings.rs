//! Limits of the instruction counts, `counts.toml`, valid for one compiler.

use toml_edit::{DocumentMut, Item, value};

/// Largest distance of a count below its limit, in percent of the limit.
const SLACK_PERCENT: u64 = 5;

/// Content of the file of limits.
pub(crate) struct Ceilings(DocumentMut);

impl Ceilings {
    /// Parses the text of the file.
    ///
    /// # Errors
    /// The message of the parser.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        text.parse().map(Self).map_err(|error: toml_edit::TomlError| error.to_string())
    }

    /// Returns the compiler of the limits.
    pub(crate) fn compiler(&self) -> &str {
        self.0.get("compiler").and_then(Item::as_str).unwrap_or("no compiler")
    }

    /// Returns the largest number of instructions per call of a subject.
    pub(crate) fn of(&self, what: &str) -> Option<u64> {
        self.0.get("ceiling")?.get(what)?.as_integer()?.try_into().ok()
    }

    /// Returns the error of a count; empty without one.
    pub(crate) fn verdict(&self, what: &str, count: u64) -> &'static str {
        match self.of(what) {
            None => "has no ceiling",
            Some(ceiling) if count > ceiling => "above its ceiling",
            Some(ceiling) if count * 100 < ceiling * (100 - SLACK_PERCENT) => {
                "5 % below its ceiling: lower the ceiling"
            }
            Some(_) => "",
        }
    }

    /// Returns the reason if the limits do not hold for code of this compiler.
    pub(crate) fn refusal(&self, compiler: &str) -> Option<String> {
        (self.compiler() != compiler).then(|| {
            format!(
                "the ceilings hold for {} alone, this is {compiler}: not judged. Take that compiler, or write down \
                 counts of your own: cargo bench --workspace --profile dev --bench counts -- --record",
                self.compiler()
            )
        })
    }

    /// Returns the text with these counts as limits of this compiler.
    ///
    /// # Errors
    /// The limits belong to this compiler already.
    pub(crate) fn recorded(mut self, compiler: &str, counts: &[(&str, u64)]) -> Result<String, String> {
        if self.compiler() == compiler {
            return Err(format!("the ceilings are of {compiler} already: change them by hand"));
        }
        self.0["compiler"] = value(compiler);
        for &(what, count) in counts {
            self.0["ceiling"][what] = value(i64::try_from(count).unwrap_or(i64::MAX));
        }
        Ok(self.0.to_string())
    }
}
