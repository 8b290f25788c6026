//! The ceilings of the counts, `counts.toml`, and the one compiler that they hold for.

use toml_edit::{DocumentMut, Item, value};

/// A ceiling is tight if the count is no more than this below it.
const SLACK_PERCENT: u64 = 5;

/// The file of ceilings, read.
pub(crate) struct Ceilings(DocumentMut);

impl Ceilings {
    /// Reads its text.
    ///
    /// # Errors
    /// What the parser says.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        text.parse().map(Self).map_err(|error: toml_edit::TomlError| error.to_string())
    }

    /// The compiler that they hold for.
    pub(crate) fn compiler(&self) -> &str {
        self.0.get("compiler").and_then(Item::as_str).unwrap_or("no compiler")
    }

    /// The most instructions that a call of this subject may take.
    pub(crate) fn of(&self, what: &str) -> Option<u64> {
        self.0.get("ceiling")?.get(what)?.as_integer()?.try_into().ok()
    }

    /// What is wrong with a count, if anything.
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

    /// Why counts of this compiler's code cannot be judged, if they cannot.
    pub(crate) fn refusal(&self, compiler: &str) -> Option<String> {
        (self.compiler() != compiler).then(|| {
            format!(
                "the ceilings hold for {} alone, this is {compiler}: not judged. Take that compiler, or write down \
                 counts of your own: cargo bench --workspace --profile dev --bench counts -- --record",
                self.compiler()
            )
        })
    }

    /// The text with these counts as ceilings of this compiler.
    ///
    /// # Errors
    /// It is their compiler already.
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
