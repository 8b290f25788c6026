//! The file of ceilings: what may stand in it, read so that every mistake is told with line, column and key.
//!
//! A *key* is the way to a value, `instance[2].ceiling.bound`; positions in lists count from 1.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value as Json;
use toml_edit::{Document, Item, TableLike, Value};

use super::Figure;
use crate::Check;

/// A message quotes so many characters of what was found.
const LONGEST_QUOTE: usize = 60;

/// The whole file of ceilings.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct File {
    pub(super) compiler: String,
    pub(super) instance: Vec<Instance>,
    pub(super) difference: Vec<Difference>,
}

/// `[[instance]]`: a function and its ceilings.
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
    /// Checks that are not asked for, each with its reason.
    pub(super) allow: BTreeMap<Check, String>,
    pub(super) why: String,
}

/// One instance less another.
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

/// What a key holds.
#[derive(Clone, Copy)]
enum Kind {
    Text,
    Texts,
    Whole,
    Table,
    Tables,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Texts => "a list of texts",
            Self::Whole => "a whole number at least 0",
            Self::Table => "a table",
            Self::Tables => "a list of tables",
        }
    }
}

/// All keys without positions, `instance.ceiling.bound`, with what each holds.
fn layout() -> BTreeMap<String, Kind> {
    let mut keys: BTreeMap<String, Kind> = BTreeMap::new();
    let mut add = |kind: Kind, table: &str, names: &[&str]| {
        keys.extend(names.iter().map(|name| (format!("{table}{name}"), kind)));
    };
    add(Kind::Text, "", &["compiler"]);
    add(Kind::Tables, "", &["instance", "difference"]);
    add(Kind::Text, "instance.", &["name", "image", "symbol", "state", "coefficients", "why"]);
    add(Kind::Whole, "instance.", &["barrier"]);
    add(Kind::Texts, "instance.", &["loops"]);
    add(Kind::Table, "instance.", &["ceiling", "floor", "allow"]);
    add(Kind::Text, "instance.allow.", &Check::ALL.map(Check::name));
    add(Kind::Text, "difference.", &["name", "of", "without", "why"]);
    add(Kind::Table, "difference.", &["ceiling", "exactly"]);
    for table in ["instance.ceiling.", "difference.ceiling.", "difference.exactly."] {
        add(Kind::Whole, table, &Figure::ALL.map(Figure::name));
    }
    // Theory says of cycles and counts what the least is; of bytes it says nothing.
    let counted = Figure::ALL.into_iter().filter(|figure| figure.unit() != "B");
    add(Kind::Whole, "instance.floor.", &counted.map(Figure::name).collect::<Vec<_>>());
    keys
}

/// A text, and where each key stands in it.
pub(super) struct Located<'a> {
    file: &'a str,
    text: &'a str,
    /// Bytes from the beginning.
    places: BTreeMap<String, usize>,
}

impl<'a> Located<'a> {
    /// Reads a text; messages call it `file`.
    ///
    /// # Errors
    /// The first thing that is wrong, in one line with its place.
    pub(super) fn read(file: &'a str, text: &'a str) -> Result<(File, Self), String> {
        let mut located = Self { file, text, places: BTreeMap::new() };
        let toml = Document::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            located.told(offset, &format!("not TOML: {message}"))
        })?;
        let json = located.table(toml.as_table(), &layout(), "", "", 0)?;
        // What the layout lets through is read. Should it ever not be, say so.
        let read = serde_json::from_value(json).map_err(|error| located.told(0, &error.to_string()))?;
        Ok((read, located))
    }

    /// What is wrong with a key, told with its place: its own if it was written, else that of the table around it.
    pub(super) fn error(&self, key: &str, message: &str) -> String {
        let around = std::iter::successors(Some(key), |key| Some(key.rsplit_once(['.', '['])?.0));
        let place = around.into_iter().find_map(|key| self.places.get(key));
        self.told(place.copied().unwrap_or(0), &format!("`{key}`: {message}"))
    }

    fn told(&self, offset: usize, message: &str) -> String {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let (line, column) = (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1);
        // A key or a file name may hold line breaks and worse; what is printed holds `\n`.
        let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
        format!("{}:{line}:{column}: {message}", self.file).chars().map(escaped).collect()
    }

    /// The values of a table; `shape` is its key without positions.
    fn table(
        &mut self,
        table: &dyn TableLike,
        layout: &BTreeMap<String, Kind>,
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

    /// One value. The parser gives no place for `[a]` when only `[a.b]` is written: then `around` is it.
    fn value(
        &mut self,
        item: &Item,
        kind: Kind,
        layout: &BTreeMap<String, Kind>,
        key: &str,
        shape: &str,
        around: usize,
    ) -> Result<Json, String> {
        let at = item.span().map_or(around, |span| span.start);
        self.places.insert(key.into(), at);
        let value = match kind {
            Kind::Text => item.as_str().map(Json::from),
            Kind::Whole => item.as_integer().filter(|number| *number >= 0).map(Json::from),
            Kind::Table => match item.as_table_like() {
                Some(table) => Some(self.table(table, layout, key, shape, at)?),
                None => None,
            },
            Kind::Texts | Kind::Tables => {
                let items: Option<Vec<Item>> = match item {
                    Item::ArrayOfTables(list) => Some(list.iter().cloned().map(Item::Table).collect()),
                    Item::Value(Value::Array(list)) => Some(list.iter().cloned().map(Item::Value).collect()),
                    _ => None,
                };
                let one = if matches!(kind, Kind::Texts) { Kind::Text } else { Kind::Table };
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

    /// A value as it is written; of a list or a table only what it is.
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

/// What may have been meant by a key that is none.
fn meant(shape: &str, layout: &BTreeMap<String, Kind>) -> String {
    let (table, name) = shape.rsplit_once('.').unwrap_or(("", shape));
    let parts =
        |key: &'_ String| key.rsplit_once('.').map_or((String::new(), key.clone()), |(a, b)| (a.into(), b.into()));
    // A key that exists, only elsewhere, is the commonest slip in a nested file.
    let elsewhere: Vec<&str> = layout.keys().filter(|key| parts(key).1 == name).map(String::as_str).collect();
    if !elsewhere.is_empty() {
        return format!("; it belongs to {}", elsewhere.join(" or "));
    }
    let names: Vec<String> =
        layout.keys().map(parts).filter(|(above, _)| above == table).map(|(_, name)| name).collect();
    nearest(name, names.iter().map(String::as_str))
}

/// `; did you mean `NAME`?` for the nearest of `names`, or the whole list if none is near.
pub(super) fn nearest<'a>(found: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    match names.clone().map(|name| (strsim::damerau_levenshtein(found, name), name)).min() {
        Some((far, name)) if far <= 1 + found.chars().count().min(30) / 3 => format!("; did you mean `{name}`?"),
        _ => format!("; expected one of {}", names.collect::<Vec<_>>().join(", ")),
    }
}
