//! Scenario as written: values with their places.
//!
//! The TOML text and the `--set` arguments become one tree of [`Node`]s. Every node has an [`Origin`], so that an error
//! is reported with file, line and column, or with its argument.
//!
//! A *key path* names a node: `controller.observer[2].printed`. Positions in lists count from 1.

use std::cell::RefCell;
use std::fmt;

use serde_json::Value as Json;
use toml_edit::{Document as Toml, Item, TableLike, Value};

use super::error::{Origin, ScenarioError, Source, shown};

/// Value with its origin.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) value: NodeValue,
    pub(super) origin: Origin,
}

/// Kinds of value in a scenario.
#[derive(Clone, Debug)]
pub(super) enum NodeValue {
    Bool(bool),
    Integer(i64),
    Float(f64),
    Text(String),
    /// Date or time, as written. No key of a scenario accepts one.
    Date(String),
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// Entry of a table.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) key_origin: Origin,
    pub(super) node: Node,
}

impl Node {
    /// Returns the value as error messages show it: `"chain"`, `7`, `a list of 3`, `a table`.
    pub(super) fn found(&self) -> String {
        match &self.value {
            NodeValue::Bool(value) => value.to_string(),
            NodeValue::Integer(value) => value.to_string(),
            // With its point, which may be the error.
            NodeValue::Float(value) if value.abs() < 1e15 && *value == value.trunc() => format!("{value:?}"),
            NodeValue::Float(value) => shown(*value),
            NodeValue::Text(value) => format!("{:?}", shortened(value)),
            NodeValue::Date(value) => format!("the date {value}"),
            NodeValue::List(list) => format!("a list of {}", list.len()),
            NodeValue::Table(_) => "a table".into(),
        }
    }

    /// Returns the value for `serde`, without origins.
    pub(super) fn json(&self) -> Json {
        match &self.value {
            NodeValue::Bool(value) => Json::from(*value),
            NodeValue::Integer(value) => Json::from(*value),
            NodeValue::Float(value) => Json::from(*value),
            NodeValue::Text(value) | NodeValue::Date(value) => Json::from(value.as_str()),
            NodeValue::List(list) => list.iter().map(Self::json).collect(),
            NodeValue::Table(entries) => entries.iter().map(|entry| (entry.key.clone(), entry.node.json())).collect(),
        }
    }

    /// Returns true if no argument changed the value.
    pub(super) fn is_of_text(&self) -> bool {
        let is_inside = match &self.value {
            NodeValue::List(list) => list.iter().all(Self::is_of_text),
            NodeValue::Table(entries) => entries.iter().all(|entry| entry.node.is_of_text()),
            _ => true,
        };
        is_inside && matches!(self.origin, Origin::Text { .. })
    }

    fn entry(&self, key: &str) -> Option<&Entry> {
        match &self.value {
            NodeValue::Table(entries) => entries.iter().find(|entry| entry.key == key),
            _ => None,
        }
    }

    /// Returns the node at a key path. `None` if the path is not set.
    pub(super) fn get(&self, path: &KeyPath) -> Option<&Self> {
        path.0.iter().try_fold(self, |node, step| node.child(step))
    }

    fn child(&self, step: &Step) -> Option<&Self> {
        match (step, &self.value) {
            (Step::Key(key), _) => self.entry(key).map(|entry| &entry.node),
            (Step::Position(k), NodeValue::List(list)) => list.get(k - 1),
            (Step::Position(_), _) => None,
        }
    }

    /// Returns the place for a key path: the value if set, else the nearest table around it.
    pub(super) fn origin_of(&self, path: &KeyPath) -> Origin {
        let mut node = self;
        for step in &path.0 {
            match node.child(step) {
                Some(child) => node = child,
                None => break,
            }
        }
        node.origin
    }

    /// Sets a value at a key path and creates missing tables.
    fn put(&mut self, steps: &[Step], node: Self) -> Result<(), SetError> {
        let Some((step, rest)) = steps.split_first() else {
            *self = node;
            return Ok(());
        };
        let origin = node.origin;
        let empty = || Self { value: NodeValue::Table(Vec::new()), origin };
        match (step, &mut self.value) {
            (Step::Key(key), NodeValue::Table(entries)) => {
                let at = entries.iter().position(|entry| entry.key == *key).unwrap_or_else(|| {
                    entries.push(Entry { key: key.clone(), key_origin: origin, node: empty() });
                    entries.len() - 1
                });
                entries[at].node.put(rest, node)
            }
            (Step::Position(k), NodeValue::List(list)) if *k <= list.len() => list[k - 1].put(rest, node),
            (Step::Position(k), NodeValue::List(list)) if *k == list.len() + 1 => {
                let mut fresh = empty();
                fresh.put(rest, node)?;
                list.push(fresh);
                Ok(())
            }
            (Step::Position(k), NodeValue::List(list)) => Err(SetError::Position { position: *k, length: list.len() }),
            (Step::Position(_), NodeValue::Table(entries)) if entries.is_empty() => {
                self.value = NodeValue::List(Vec::new());
                self.put(steps, node)
            }
            (Step::Key(key), _) => Err(SetError::Table { key: key.clone(), found: self.found() }),
            (Step::Position(k), _) => Err(SetError::List { position: *k, found: self.found() }),
        }
    }

    /// Removes the value at a key path. Of a list all is removed.
    pub(super) fn take_out(&mut self, path: &KeyPath) {
        let lists = path.0.iter().rev().take_while(|step| matches!(step, Step::Position(_))).count();
        if let Some((Step::Key(key), table)) = path.0[..path.0.len() - lists].split_last() {
            self.remove(table, key);
        }
    }

    fn remove(&mut self, table: &[Step], key: &str) {
        match (table.split_first(), &mut self.value) {
            (None, NodeValue::Table(entries)) => entries.retain(|entry| entry.key != key),
            (Some((Step::Key(step), rest)), NodeValue::Table(entries)) => {
                if let Some(entry) = entries.iter_mut().find(|entry| entry.key == *step) {
                    entry.node.remove(rest, key);
                }
            }
            (Some((Step::Position(k), rest)), NodeValue::List(list)) => {
                if let Some(node) = list.get_mut(k - 1) {
                    node.remove(rest, key);
                }
            }
            _ => {}
        }
    }
}

/// Path of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct KeyPath(Vec<Step>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Step {
    Key(String),
    /// Position in a list, from 1.
    Position(usize),
}

impl KeyPath {
    pub(super) const fn root() -> Self {
        Self(Vec::new())
    }

    /// Parses `a.b[2].c`. Returns `None` for any other form.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut steps = Vec::new();
        for part in text.split('.') {
            let (key, positions) = part.split_at(part.find('[').unwrap_or(part.len()));
            let is_key = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if key.is_empty() || !key.chars().all(is_key) {
                return None;
            }
            steps.push(Step::Key(key.into()));
            for position in positions.split_inclusive(']') {
                let digits = position.strip_prefix('[')?.strip_suffix(']')?;
                match digits.parse() {
                    Ok(k) if k >= 1 => steps.push(Step::Position(k)),
                    _ => return None,
                }
            }
        }
        // A scenario is five levels deep; the limit bounds the recursion of `put`.
        (steps.len() <= 16).then_some(Self(steps))
    }

    #[must_use]
    pub(super) fn key(&self, key: &str) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Key(key.into()));
        Self(steps)
    }

    /// Returns the path of an entry of this list, from 1.
    #[must_use]
    pub(super) fn position(&self, k: usize) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Position(k));
        Self(steps)
    }
}

impl KeyPath {
    /// Returns the keys, or `None` if the path contains positions.
    pub(super) fn keys(&self) -> Option<Vec<&str>> {
        let keys = self.0.iter().map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Position(_) => None,
        });
        keys.collect()
    }

    /// Returns the path of the list, if the path ends with a position.
    pub(super) fn list(&self) -> Option<Self> {
        let (last, list) = self.0.split_last()?;
        matches!(last, Step::Position(_)).then(|| Self(list.to_vec()))
    }

    /// Returns the last key of the path.
    pub(super) fn last_key(&self) -> Option<&str> {
        self.0.iter().rev().find_map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Position(_) => None,
        })
    }

    /// Returns true if one path contains the other.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(a, b)| a == b)
    }

    /// Returns true if both keys belong to one table.
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        self.0.len() == other.0.len() && self.0.split_last().map(|(_, at)| at) == other.0.split_last().map(|(_, at)| at)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) if k == 0 => f.write_str(key)?,
                Step::Key(key) => write!(f, ".{key}")?,
                Step::Position(position) => write!(f, "[{position}]")?,
            }
        }
        Ok(())
    }
}

/// Mutually exclusive keys. `--set` of one removes the others from the table of the file.
const ALTERNATIVES: [(&str, &[&str]); 5] = [
    ("c", &["surface_bandwidth_rad_s"]),
    ("surface_bandwidth_rad_s", &["c"]),
    ("printed", &["poles", "bandwidth_rad_s", "order"]),
    ("poles", &["printed", "bandwidth_rad_s", "order"]),
    ("bandwidth_rad_s", &["printed", "poles"]),
];

/// Reads the text and applies the `--set` arguments of `source`.
pub(super) fn read(source: &Source<'_>) -> Result<Node, ScenarioError> {
    let mut root = read_once(source)?;
    let each = source.sets.iter().enumerate();
    let wrong = each.filter_map(|(k, argument)| {
        let origin = Origin::Set(k);
        set(&mut root, argument, origin).err().map(|error| (origin, error.to_string()))
    });
    let wrong: Vec<(Origin, String)> = wrong.collect();
    if wrong.is_empty() { Ok(root) } else { Err(source.errors(wrong)) }
}

thread_local! {
    /// Last text and its tree. A campaign reads the same text in each trial.
    static LAST: RefCell<Option<(String, Node)>> = const { RefCell::new(None) };
}

pub(super) fn read_once(source: &Source<'_>) -> Result<Node, ScenarioError> {
    let known = LAST.with_borrow(|last| Some(last.as_ref().filter(|(text, _)| text == source.text)?.1.clone()));
    if let Some(root) = known {
        return Ok(root);
    }
    // Some editors begin a file with a byte order mark.
    let toml = Toml::parse(source.text).map_err(|error| {
        let offset = error.span().map_or(0, |span| span.start);
        let mut message = error.message().lines().collect::<Vec<_>>().join(", ");
        let (before, after) = source.text.split_at_checked(offset).unwrap_or_default();
        let is_in_number = before.ends_with(|last: char| last.is_ascii_digit() || last == ',')
            && after.trim_start_matches(',').starts_with(|first: char| first.is_ascii_digit());
        if is_in_number && (before.ends_with(',') || after.starts_with(',')) {
            message += "; a number has a decimal point, not a comma";
        }
        source.error(Origin::Text { offset }, format!("not TOML: {message}"))
    })?;
    let root = table(toml.as_table(), Origin::Text { offset: 0 });
    LAST.set(Some((source.text.into(), root.clone())));
    Ok(root)
}

/// Error of an argument of `--set`.
#[derive(Debug)]
enum SetError {
    Argument,
    Path(String),
    Value(String),
    NoList(KeyPath),
    Position { position: usize, length: usize },
    Table { key: String, found: String },
    List { position: usize, found: String },
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Argument => f.write_str("expected KEY=VALUE without blanks, as in span_s=2"),
            Self::Path(path) => {
                write!(f, "`{path}` is not a key path; expected one like controller.observer[1].printed")
            }
            Self::Value(text) if text.matches('"').count() % 2 == 1 => {
                write!(f, "the text {text} lacks a quotation mark: expected \"text\"")
            }
            Self::Value(text) => {
                write!(f, "{text:?} is not a TOML value (a number, true, \"text\", a [list] or a {{table}})")
            }
            Self::NoList(list) => {
                write!(f, "there is no list `{list}` with such a position: {}", whole_first(list))
            }
            Self::Position { position, length } => {
                write!(f, "there is no position {position} in a list of {length} (positions count from 1)")
            }
            Self::Table { key, found } => write!(f, "`{key}` cannot be set: {found} is not a table"),
            Self::List { position, found } => write!(f, "[{position}] cannot be set: {found} is not a list"),
        }
    }
}

fn set(root: &mut Node, argument: &str, origin: Origin) -> Result<(), SetError> {
    let (path, text) = argument.split_once('=').ok_or(SetError::Argument)?;
    let path = KeyPath::parse(path.trim()).ok_or_else(|| SetError::Path(path.trim().into()))?;
    let node = value_of_argument(text.trim(), origin)?;
    if let Some((Step::Key(last), table)) = path.0.split_last()
        && let Some((_, others)) = ALTERNATIVES.iter().find(|(key, _)| key == last)
    {
        others.iter().for_each(|other| root.remove(table, other));
    }
    if let Some(list) = path.list().filter(|list| root.get(list).is_none())
        && path.0.last() != Some(&Step::Position(1))
    {
        return Err(SetError::NoList(list));
    }
    root.put(&path.0, node)
}

/// Returns the remedy for a position in a list that does not exist.
pub(super) fn whole_first(list: &KeyPath) -> String {
    format!("set it with all its numbers first, as in --set '{list}=[0, 0]'")
}

/// Parses a TOML value. A bare word is text, so that `plant.kind=chain` needs no quotes in a shell.
fn value_of_argument(text: &str, origin: Origin) -> Result<Node, SetError> {
    if let Some(value) = plain_number(text) {
        return Ok(Node { value, origin });
    }
    if let Ok(value) = text.parse::<Value>() {
        return Ok(value_node(&value, origin));
    }
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | ' ' | '/');
    if !text.is_empty() && text.chars().all(is_word) {
        return Ok(Node { value: NodeValue::Text(text.into()), origin });
    }
    Err(SetError::Value(shortened(text)))
}

/// Parses a number of digits, sign, point and exponent, as TOML does. A campaign sets some in each of a million trials,
/// and the TOML parser takes ten times as long. `None` for any other text.
fn plain_number(text: &str) -> Option<NodeValue> {
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (mantissa, exponent) = digits.split_once(['e', 'E']).map_or((digits, None), |(m, e)| (m, Some(e)));
    let (whole, fraction) = mantissa.split_once('.').map_or((mantissa, None), |(w, f)| (w, Some(f)));
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_exponent = |text: &str| is_digits(text.strip_prefix(['+', '-']).unwrap_or(text));
    // In TOML a whole part does not begin with 0 unless it is 0.
    let is_plain = is_digits(whole)
        && (whole == "0" || !whole.starts_with('0'))
        && fraction.is_none_or(is_digits)
        && exponent.is_none_or(is_exponent);
    if !is_plain {
        return None;
    }
    if fraction.is_none() && exponent.is_none() {
        return text.parse().ok().map(NodeValue::Integer);
    }
    text.parse().ok().filter(|number: &f64| number.is_finite()).map(NodeValue::Float)
}

/// Returns the origin of a span. Spans inside an argument refer to the whole argument.
fn at(span: Option<std::ops::Range<usize>>, around: Origin) -> Origin {
    match (around, span) {
        (Origin::Text { .. }, Some(span)) => Origin::Text { offset: span.start },
        _ => around,
    }
}

fn table(table: &dyn TableLike, origin: Origin) -> Node {
    let entries = table.iter().map(|(key, item)| {
        let key_origin = at(table.key(key).and_then(toml_edit::Key::span), origin);
        Entry { key: key.into(), key_origin, node: item_node(item, key_origin) }
    });
    Node { value: NodeValue::Table(entries.collect()), origin }
}

/// Converts an item. `around` is its place if the parser gives none, as for `[a]` when only `[a.b]` is written.
fn item_node(item: &Item, around: Origin) -> Node {
    let origin = at(item.span(), around);
    match item {
        Item::None => Node { value: NodeValue::Table(Vec::new()), origin },
        Item::Value(value) => value_node(value, origin),
        Item::Table(inner) => table(inner, origin),
        Item::ArrayOfTables(list) => {
            let nodes = list.iter().map(|inner| table(inner, at(inner.span(), origin)));
            Node { value: NodeValue::List(nodes.collect()), origin }
        }
    }
}

fn value_node(value: &Value, around: Origin) -> Node {
    let origin = at(value.span(), around);
    let value = match value {
        Value::String(text) => NodeValue::Text(text.value().clone()),
        Value::Integer(number) => NodeValue::Integer(*number.value()),
        Value::Float(number) => NodeValue::Float(*number.value()),
        Value::Boolean(truth) => NodeValue::Bool(*truth.value()),
        Value::Datetime(date) => NodeValue::Date(date.value().to_string()),
        Value::Array(list) => NodeValue::List(list.iter().map(|inner| value_node(inner, origin)).collect()),
        Value::InlineTable(inner) => return table(inner, origin),
    };
    Node { value, origin }
}

/// Shortens a quoted text for a message.
fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST { text.into() } else { text.chars().take(LONGEST).chain("..".chars()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_number_is_what_toml_reads() {
        let plain = [
            "0",
            "-0",
            "+7",
            "12",
            "-12",
            "9223372036854775807",
            "0.5",
            "-0.0",
            "1.50",
            "1e3",
            "-1E-3",
            "+2.5e+07",
            "0e0",
            "4.9e-324",
            "1.7976931348623157e308",
            "0.1",
            "-0.30000000000000004",
        ];
        let other = [
            "",
            "-",
            "01",
            "-00.5",
            "1.",
            ".5",
            "1e",
            "1e+",
            "1.e3",
            "1_000",
            "0x10",
            "inf",
            "nan",
            "1e999",
            "1 2",
            "- 1",
            "9223372036854775808",
            "1.2.3",
            "1e2e3",
            "\u{0661}",
        ];
        for text in plain.iter().chain(&other) {
            let toml = text.parse::<Value>().ok().map(|value| value_node(&value, Origin::Set(0)).value);
            match (plain_number(text), toml) {
                (Some(NodeValue::Integer(found)), Some(NodeValue::Integer(toml))) => {
                    assert_eq!(found, toml, "{text:?}");
                }
                (Some(NodeValue::Float(found)), Some(NodeValue::Float(toml))) => {
                    assert_eq!(found.to_bits(), toml.to_bits(), "{text:?}");
                }
                (Some(found), toml) => panic!("{text:?}: {found:?} {toml:?}"),
                (None, _) => assert!(other.contains(text), "{text:?}"),
            }
            assert!(plain.contains(text) || plain_number(text).is_none(), "{text:?}");
        }
    }

    fn tree(text: &str, sets: &[&str]) -> Result<Node, String> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        read(&Source { file: "a.toml", text, sets: &sets }).map_err(|error| error.to_string())
    }

    fn json(text: &str, sets: &[&str]) -> String {
        tree(text, sets).map_or_else(|error| error, |node| node.json().to_string())
    }

    #[test]
    fn key_paths_count_positions_from_one_and_survive_a_round_trip() {
        let path = KeyPath::parse("plant.disturbance[2].terms[1].kind").expect("a key path");
        assert_eq!(path.to_string(), "plant.disturbance[2].terms[1].kind");
        for wrong in ["", ".", "a.", "a[0]", "a[", "a]", "a[x]", "a[1]b", "a b", "a[-1]", "a[99999999999999999999]"] {
            assert_eq!(KeyPath::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn set_takes_toml_values_and_bare_words() {
        assert_eq!(json("", &["a=\"b"]), "--set a=\"b: the text \"b lacks a quotation mark: expected \"text\"");
        let sets = ["a=1", "b.c=chain", "b.d=[1, 2.5]", "e={f = true}", "g=", "a=1e-3"];
        assert_eq!(json("", &sets[..4]), r#"{"a":1,"b":{"c":"chain","d":[1,2.5]},"e":{"f":true}}"#);
        assert_eq!(
            json("", &sets[4..5]),
            r#"--set g=: "" is not a TOML value (a number, true, "text", a [list] or a {table})"#
        );
        assert_eq!(json("a = 7", &sets[5..]), r#"{"a":0.001}"#);
    }

    #[test]
    fn set_reaches_into_lists_and_appends_one_but_leaves_no_gap() {
        let text = "[[o]]\nchannel = 2\n[[o]]\nchannel = 4\n";
        assert_eq!(json(text, &["o[2].channel=3"]), r#"{"o":[{"channel":2},{"channel":3}]}"#);
        assert_eq!(json(text, &["o[3].channel=1"]), r#"{"o":[{"channel":2},{"channel":4},{"channel":1}]}"#);
        assert_eq!(json("", &["p.q[1]=5"]), r#"{"p":{"q":[5]}}"#);
        assert_eq!(
            json(text, &["o[4].channel=1"]),
            "--set o[4].channel=1: there is no position 4 in a list of 2 (positions count from 1)"
        );
        assert_eq!(json("a = 1", &["a.b=1"]), "--set a.b=1: `b` cannot be set: 1 is not a table");
    }

    #[test]
    fn set_of_one_way_to_give_gains_takes_the_others_out() {
        let text = "[[o]]\nchannel = 2\nprinted = [100, 20]\n";
        assert_eq!(
            json(text, &["o[1].bandwidth_rad_s=50", "o[1].order=2"]),
            r#"{"o":[{"bandwidth_rad_s":50,"channel":2,"order":2}]}"#
        );
        assert_eq!(json(text, &["o[1].poles=[[-1,0]]"]), r#"{"o":[{"channel":2,"poles":[[-1,0]]}]}"#);
    }

    #[test]
    fn a_syntax_error_names_line_and_column() {
        assert_eq!(json("a = 1\nb = = 2\n", &[]).split(": not TOML").next(), Some("a.toml:2:5"));
        assert!(
            json("a = 1\na = 2\n", &[]).starts_with("a.toml:2:1: not TOML: duplicate key"),
            "{}",
            json("a=1\na=2", &[])
        );
    }

    #[test]
    fn deep_nesting_is_refused_and_not_a_stack_overflow() {
        let deep = "[".repeat(100_000);
        assert!(json(&format!("a = {deep}"), &[]).contains("not TOML"));
        assert!(tree("", &[&format!("a={deep}")]).is_err());
        assert!(json(&format!("[{}]", vec!["a"; 100_000].join(".")), &[]).contains("not TOML"));
        assert!(tree("", &[&format!("{}=1", vec!["a"; 100_000].join("."))]).is_err());
    }
}
