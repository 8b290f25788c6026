//! Reader of the file of limits. Every error message has line, column and key.
//!
//! A *key* is the path to a value, for example `instance[2].ceiling.bound`; list positions count from 1.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value as Json;
use toml_edit::{Document, Item, TableLike, Value};

use super::Figure;
use crate::Check;

/// Longest quotation in a message, characters.
const LONGEST_QUOTE: usize = 60;

/// Content of the file of limits.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct File {
    pub(super) compiler: String,
    pub(super) instance: Vec<Instance>,
    pub(super) difference: Vec<Difference>,
}

/// `[[instance]]`: a function and its limits.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Instance {
    pub(super) name: String,
    pub(super) image: String,
    pub(super) symbol: String,
    pub(super) state: Option<String>,
    pub(super) coefficients: Option<String>,
    pub(super) barrier: Option<u64>,
    pub(super) loops: Vec<String>,
    pub(super) ceiling: BTreeMap<Figure, u64>,
    pub(super) floor: BTreeMap<Figure, u64>,
    /// Checks with an exception, and its reason.
    pub(super) allow: BTreeMap<Check, String>,
    pub(super) why: String,
}

/// `[[difference]]`: one instance minus another.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Difference {
    pub(super) name: String,
    pub(super) of: String,
    pub(super) without: String,
    pub(super) ceiling: BTreeMap<Figure, u64>,
    pub(super) exactly: BTreeMap<Figure, u64>,
    pub(super) why: String,
}

/// Type of the value of a key.
#[derive(Clone, Copy)]
enum ValueType {
    Text,
    Texts,
    Whole,
    Table,
    Tables,
}

impl ValueType {
    fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Texts => "a list of strings",
            Self::Whole => "a whole number >= 0",
            Self::Table => "a table",
            Self::Tables => "a list of tables",
        }
    }
}

/// Returns all keys without positions, as `instance.ceiling.bound`, with the type of each value.
fn layout() -> BTreeMap<String, ValueType> {
    let mut keys: BTreeMap<String, ValueType> = BTreeMap::new();
    let mut add = |kind: ValueType, table: &str, names: &[&str]| {
        keys.extend(names.iter().map(|name| (format!("{table}{name}"), kind)));
    };
    add(ValueType::Text, "", &["compiler"]);
    add(ValueType::Tables, "", &["instance", "difference"]);
    add(ValueType::Text, "instance.", &["name", "image", "symbol", "state", "coefficients", "why"]);
    add(ValueType::Whole, "instance.", &["barrier"]);
    add(ValueType::Texts, "instance.", &["loops"]);
    add(ValueType::Table, "instance.", &["ceiling", "floor", "allow"]);
    add(ValueType::Text, "instance.allow.", &Check::ALL.map(Check::name));
    add(ValueType::Text, "difference.", &["name", "of", "without", "why"]);
    add(ValueType::Table, "difference.", &["ceiling", "exactly"]);
    for table in ["instance.ceiling.", "difference.ceiling.", "difference.exactly."] {
        add(ValueType::Whole, table, &Figure::ALL.map(Figure::name));
    }
    // Theory gives a minimum for cycles and counts, not for bytes.
    let counted = Figure::ALL.into_iter().filter(|figure| figure.unit() != "B");
    add(ValueType::Whole, "instance.floor.", &counted.map(Figure::name).collect::<Vec<_>>());
    keys
}

/// A text with the position of each key.
pub(super) struct Located<'a> {
    file: &'a str,
    text: &'a str,
    /// Byte offset of each key.
    places: BTreeMap<String, usize>,
}

impl<'a> Located<'a> {
    /// Parses a text; messages name it `file`.
    ///
    /// # Errors
    /// The first error, in one line with its position.
    pub(super) fn read(file: &'a str, text: &'a str) -> Result<(File, Self), String> {
        let mut located = Self { file, text, places: BTreeMap::new() };
        let toml = Document::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            located.told(offset, &format!("not TOML: {message}"))
        })?;
        let json = located.table(toml.as_table(), &layout(), "", "", 0)?;
        // The layout check accepts only readable values; an exception would still be reported here.
        let read = serde_json::from_value(json).map_err(|error| located.told(0, &error.to_string()))?;
        Ok((read, located))
    }

    /// Returns the message with the position of the key, or of the table around a missing key.
    pub(super) fn error(&self, key: &str, message: &str) -> String {
        let around = std::iter::successors(Some(key), |key| Some(key.rsplit_once(['.', '['])?.0));
        let place = around.into_iter().find_map(|key| self.places.get(key));
        self.told(place.copied().unwrap_or(0), &format!("`{key}`: {message}"))
    }

    fn told(&self, offset: usize, message: &str) -> String {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let (line, column) = (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1);
        // A key or a file name may hold control characters; the message escapes them.
        let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
        format!("{}:{line}:{column}: {message}", self.file).chars().map(escaped).collect()
    }

    /// Reads the values of a table; `shape` is its key without positions.
    fn table(
        &mut self,
        table: &dyn TableLike,
        layout: &BTreeMap<String, ValueType>,
        key: &str,
        shape: &str,
        at: usize,
    ) -> Result<Json, String> {
        let below = |above: &str, name: &str| if above.is_empty() { name.into() } else { format!("{above}.{name}") };
        let mut values = serde_json::Map::new();
        for (name, item) in table.iter() {
            let (key, shape) = (below(key, name), below(shape, name));
            let at_name = table.key(name).and_then(toml_edit::Key::span).map_or(at, |span| span.start);
            let Some(kind) = layout.get(&shape) else {
                return Err(self.told(at_name, &format!("unknown key `{key}`{}", meant(&shape, layout))));
            };
            let value = self.value(item, *kind, layout, &key, &shape, at_name)?;
            values.insert(name.into(), value);
        }
        Ok(values.into())
    }

    /// Reads one value. The parser has no position for `[a]` if the file holds only `[a.b]`; `around` replaces it.
    fn value(
        &mut self,
        item: &Item,
        kind: ValueType,
        layout: &BTreeMap<String, ValueType>,
        key: &str,
        shape: &str,
        around: usize,
    ) -> Result<Json, String> {
        let at = item.span().map_or(around, |span| span.start);
        self.places.insert(key.into(), at);
        let value = match kind {
            ValueType::Text => item.as_str().map(Json::from),
            ValueType::Whole => item.as_integer().filter(|number| *number >= 0).map(Json::from),
            ValueType::Table => match item.as_table_like() {
                Some(table) => Some(self.table(table, layout, key, shape, at)?),
                None => None,
            },
            ValueType::Texts | ValueType::Tables => {
                let items: Option<Vec<Item>> = match item {
                    Item::ArrayOfTables(list) => Some(list.iter().cloned().map(Item::Table).collect()),
                    Item::Value(Value::Array(list)) => Some(list.iter().cloned().map(Item::Value).collect()),
                    _ => None,
                };
                let one = if matches!(kind, ValueType::Texts) { ValueType::Text } else { ValueType::Table };
                let values = items.map(|items| {
                    let each = items.iter().enumerate();
                    each.map(|(k, item)| self.value(item, one, layout, &format!("{key}[{}]", k + 1), shape, at))
                        .collect::<Result<Vec<Json>, String>>()
                });
                values.transpose()?.map(Json::from)
            }
        };
        value.ok_or_else(|| self.error(key, &format!("found {}, expected {}", self.found(item), kind.name())))
    }

    /// Returns the text of a value; for a list or a table, its type only.
    fn found(&self, item: &Item) -> String {
        match item {
            Item::ArrayOfTables(list) => format!("a list of {}", list.len()),
            Item::Value(Value::Array(list)) => format!("a list of {}", list.len()),
            Item::Table(_) | Item::Value(Value::InlineTable(_)) | Item::None => "a table".into(),
            Item::Value(value) => {
                let written = value.span().and_then(|span| self.text.get(span)).unwrap_or_default();
                let quoted: String = written.chars().take(LONGEST_QUOTE).collect();
                if quoted == written { quoted } else { quoted + ".." }
            }
        }
    }
}

/// Returns a suggestion for an unknown key.
fn meant(shape: &str, layout: &BTreeMap<String, ValueType>) -> String {
    let (table, name) = shape.rsplit_once('.').unwrap_or(("", shape));
    let parts =
        |key: &'_ String| key.rsplit_once('.').map_or((String::new(), key.clone()), |(a, b)| (a.into(), b.into()));
    // A valid key in the wrong table is the most common mistake in a nested file.
    let elsewhere: Vec<&str> = layout.keys().filter(|key| parts(key).1 == name).map(String::as_str).collect();
    if !elsewhere.is_empty() {
        return format!("; it belongs to {}", elsewhere.join(" or "));
    }
    let names: Vec<String> =
        layout.keys().map(parts).filter(|(above, _)| above == table).map(|(_, name)| name).collect();
    nearest(name, names.iter().map(String::as_str))
}

/// Returns `; did you mean `NAME`?` for the nearest of `names`, or the whole list if none is near.
pub(super) fn nearest<'a>(found: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    match names.clone().map(|name| (strsim::damerau_levenshtein(found, name), name)).min() {
        Some((far, name)) if far <= 1 + found.chars().count().min(30) / 3 => format!("; did you mean `{name}`?"),
        _ => format!("; expected one of {}", names.collect::<Vec<_>>().join(", ")),
    }
}
