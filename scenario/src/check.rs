//! Checks a scenario against its JSON schema: unknown keys, wrong types, numbers outside their range.
//!
//! The schema is derived from the structs of [`Scenario`](super::Scenario), so there is one list of keys, ranges and
//! choices. `host-sim schema` prints the same schema. The checker supports only the keywords of this schema; a test
//! ensures that the schema uses no others.

use serde_json::Value as Json;

use super::document::{Entry, KeyPath, Node, NodeValue};
use super::error::{Origin, nearest, shown};
use super::resolve::Problem;

/// Error with its place and key.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) origin: Origin,
    pub(super) path: KeyPath,
    pub(super) message: String,
    /// True for an unknown key.
    pub(super) is_unknown: bool,
}

impl Fault {
    /// Returns true if this fault causes the problem. A missing key may be the misspelt key next to it.
    pub(super) fn explains(&self, problem: &Problem) -> bool {
        let Some(path) = KeyPath::parse(&problem.key) else { return false };
        self.path.overlaps(&path) || (self.is_unknown && problem.is_missing() && self.path.is_beside(&path))
    }
}

/// Largest number of reported faults.
const MOST_FAULTS: usize = 20;

/// Checks the whole tree. Returns the first [`MOST_FAULTS`] faults.
pub(super) fn check(schema: &Json, tree: &Node) -> Vec<Fault> {
    faults_of(schema, tree, false)
}

/// Checks only the values from arguments, for a tree whose text is valid. A trial sets five keys of a hundred.
pub(super) fn check_set(schema: &Json, tree: &Node) -> Vec<Fault> {
    faults_of(schema, tree, true)
}

fn faults_of(schema: &Json, tree: &Node, is_text_sound: bool) -> Vec<Fault> {
    let mut faults = Vec::new();
    Checker { schema, is_text_sound }.node(schema, tree, &KeyPath::root(), &mut faults);
    faults
}

/// Returns all keys of the schema as paths without positions: `controller.observer.printed`.
pub(super) fn all_keys(schema: &Json) -> Vec<String> {
    let mut keys = Vec::new();
    Checker { schema, is_text_sound: false }.collect(schema, "", &mut keys);
    keys
}

/// Returns the default of a number.
pub(super) fn default_of(schema: &Json, path: &KeyPath) -> Option<f64> {
    let checker = Checker { schema, is_text_sound: false };
    let keys = path.keys()?;
    let (last, tables) = keys.split_last()?;
    let table = tables.iter().try_fold(schema, |part, key| {
        checker.choices(&part["properties"][key]).into_iter().find(|choice| choice["properties"].is_object())
    })?;
    table["properties"][last]["default"].as_f64()
}

struct Checker<'a> {
    schema: &'a Json,
    /// True if the text is valid, so that only values from arguments are checked.
    is_text_sound: bool,
}

impl<'a> Checker<'a> {
    fn resolve(&self, part: &'a Json) -> &'a Json {
        let name = part["$ref"].as_str().and_then(|reference| reference.strip_prefix("#/$defs/"));
        name.map_or(part, |name| self.resolve(&self.schema["$defs"][name]))
    }

    /// Returns the alternatives of a value. `null` is not a TOML value and only marks an optional key.
    fn choices(&self, part: &'a Json) -> Vec<&'a Json> {
        let part = self.resolve(part);
        match part["anyOf"].as_array().or_else(|| part["oneOf"].as_array()) {
            Some(list) => list.iter().filter(|one| one["type"] != "null").flat_map(|one| self.choices(one)).collect(),
            None => vec![part],
        }
    }

    fn node(&self, part: &'a Json, node: &Node, path: &KeyPath, faults: &mut Vec<Fault>) {
        if faults.len() >= MOST_FAULTS || self.is_text_sound && node.is_of_text() {
            return;
        }
        let choices = self.choices(part);
        let matching = choices.iter().find(|choice| is_of_type(choice, node) && may_be_word(choice, node));
        let Some(choice) = matching else {
            let hint = near_word(&choices, node) + &as_integer(&choices, node);
            faults.push(fault(node.origin, path, node, &expected(&choices), &hint));
            return;
        };
        match &node.value {
            NodeValue::Table(entries) => {
                let properties = choice["properties"].as_object();
                for entry in entries {
                    let below = path.key(&entry.key);
                    match properties.and_then(|properties| properties.get(&entry.key)) {
                        Some(part) => self.node(part, &entry.node, &below, faults),
                        // Names chosen by the user.
                        None if choice["additionalProperties"].is_object() => {
                            self.node(&choice["additionalProperties"], &entry.node, &below, faults);
                        }
                        None if faults.len() >= MOST_FAULTS => return,
                        None => faults.push(self.unknown_key(choice, &below, entry)),
                    }
                }
            }
            NodeValue::List(list) => {
                let too_few = choice["minItems"].as_u64().is_some_and(|least| (list.len() as u64) < least);
                let too_many = choice["maxItems"].as_u64().is_some_and(|most| list.len() as u64 > most);
                if too_few || too_many {
                    faults.push(fault(node.origin, path, node, &expected(&[choice]), ""));
                    return;
                }
                if let Some(hint) = as_ratio(choice, list, path) {
                    faults.push(fault(node.origin, path, node, &expected(&[choice]), &hint));
                    return;
                }
                for (k, child) in list.iter().enumerate() {
                    self.node(&choice["items"], child, &path.position(k + 1), faults);
                }
            }
            NodeValue::Integer(number) => faults.extend(out_of_range(choice, *number as f64, node, path)),
            NodeValue::Float(number) => faults.extend(out_of_range(choice, *number, node, path)),
            NodeValue::Bool(_) | NodeValue::Text(_) | NodeValue::Date(_) => {}
        }
    }

    fn unknown_key(&self, table: &Json, path: &KeyPath, entry: &Entry) -> Fault {
        let key = entry.key.as_str();
        // A key in the wrong table is the most common error in a nested file.
        let elsewhere: Vec<_> =
            all_keys(self.schema).into_iter().filter(|known| known.rsplit('.').next() == Some(key)).collect();
        let names = table["properties"].as_object().into_iter().flatten().map(|(name, _)| name.as_str());
        let hint = match elsewhere.as_slice() {
            [] => in_si(key, &entry.node, names.clone()).unwrap_or_else(|| nearest(key, names)),
            places => format!("; it belongs to {}", places.join(" or ")),
        };
        let message = format!("unknown key `{path}`{hint}");
        Fault { origin: entry.key_origin, path: path.clone(), message, is_unknown: true }
    }

    fn collect(&self, part: &'a Json, prefix: &str, keys: &mut Vec<String>) {
        for choice in self.choices(part) {
            for (name, inner) in choice["properties"].as_object().into_iter().flatten() {
                let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
                self.collect(inner, &key, keys);
                keys.push(key);
            }
            if choice["items"].is_object() {
                self.collect(&choice["items"], prefix, keys);
            }
        }
    }
}

/// Units of data sheets: ending of a key, ending of the key in SI units, and the factor between them.
const UNITS: [(&str, &str, f64); 20] = [
    ("_kg_cm2", "_kg_m2", 1e-4),
    ("_kg_mm2", "_kg_m2", 1e-6),
    ("_g_cm2", "_kg_m2", 1e-7),
    ("_g_mm2", "_kg_m2", 1e-9),
    ("_n_cm", "_n_m", 1e-2),
    ("_mn_m", "_n_m", 1e-3),
    ("_mnm", "_n_m", 1e-3),
    ("_nm", "_n_m", 1.0),
    ("_mn_m_per_a", "_n_m_per_a", 1e-3),
    ("_mnm_per_a", "_n_m_per_a", 1e-3),
    ("_nm_per_a", "_n_m_per_a", 1.0),
    ("_ma", "_a", 1e-3),
    ("_rpm", "_rad_s", std::f64::consts::PI / 30.0),
    ("_hz", "_rad_s", 2.0 * std::f64::consts::PI),
    ("_deg_s", "_rad_s", std::f64::consts::PI / 180.0),
    ("_deg", "_rad", std::f64::consts::PI / 180.0),
    ("_ms", "_s", 1e-3),
    ("_us", "_s", 1e-6),
    ("_mv", "_v", 1e-3),
    ("_mh", "_h", 1e-3),
];

/// Returns the known key and its value if an unknown key differs only in its unit.
fn in_si<'a>(key: &str, node: &Node, mut names: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let key = key.to_lowercase();
    let value = match node.value {
        NodeValue::Integer(number) => number as f64,
        NodeValue::Float(number) => number,
        _ => return None,
    };
    UNITS.iter().find_map(|(unit, si, factor)| {
        let known = format!("{}{si}", key.strip_suffix(unit)?);
        let known = names.find(|name| *name == known)?;
        let value: f64 = format!("{:.9e}", value * factor).parse().ok()?;
        Some(format!("; did you mean `{known}`? In its unit: {known} = {}", shown(value)))
    })
}

fn fault(origin: Origin, path: &KeyPath, node: &Node, expected: &str, hint: &str) -> Fault {
    let message = format!("`{path}`: found {}, expected {expected}{hint}", node.found());
    Fault { origin, path: path.clone(), message, is_unknown: false }
}

fn has_type(choice: &Json, name: &str) -> bool {
    match &choice["type"] {
        Json::String(only) => only == name,
        Json::Array(several) => several.iter().any(|one| one == name),
        _ => false,
    }
}

fn is_of_type(choice: &Json, node: &Node) -> bool {
    match node.value {
        NodeValue::Bool(_) => has_type(choice, "boolean"),
        NodeValue::Integer(_) => has_type(choice, "integer") || has_type(choice, "number"),
        NodeValue::Float(_) => has_type(choice, "number"),
        NodeValue::Text(_) => has_type(choice, "string"),
        NodeValue::Date(_) => false,
        NodeValue::List(_) => has_type(choice, "array"),
        NodeValue::Table(_) => has_type(choice, "object"),
    }
}

fn words(choice: &Json) -> Option<Vec<&str>> {
    match (&choice["const"], &choice["enum"]) {
        (Json::String(only), _) => Some(vec![only]),
        (_, Json::Array(several)) => Some(several.iter().filter_map(Json::as_str).collect()),
        _ => None,
    }
}

fn may_be_word(choice: &Json, node: &Node) -> bool {
    match (&node.value, words(choice)) {
        (NodeValue::Text(text), Some(words)) => words.contains(&text.as_str()),
        _ => true,
    }
}

fn near_word(choices: &[&Json], node: &Node) -> String {
    let words: Vec<&str> = choices.iter().filter_map(|choice| words(choice)).flatten().collect();
    match &node.value {
        NodeValue::Text(text) if !words.is_empty() => {
            let hint = nearest(text, words.into_iter());
            // The message already contains all words.
            if hint.starts_with("; did") { hint } else { String::new() }
        }
        _ => String::new(),
    }
}

/// Returns the hint for a whole number that was written with a point or an exponent.
fn as_integer(choices: &[&Json], node: &Node) -> String {
    match node.value {
        NodeValue::Float(value)
            if value == value.trunc()
                && choices.iter().any(|choice| has_type(choice, "integer") && holds(choice, value)) =>
        {
            format!(": write {value:.0}")
        }
        _ => String::new(),
    }
}

/// Returns the hint for a gear ratio with decimals: `[4.4, 1]` is `[22, 5]`.
fn as_ratio(choice: &Json, list: &[Node], path: &KeyPath) -> Option<String> {
    let is_gear = path.keys().and_then(|keys| keys.last().map(|key| *key == "gear")) == Some(true);
    let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
    let numbers = numbers.filter(|numbers| is_gear && numbers.iter().any(|it| *it != it.trunc()))?;
    let parts: Option<Vec<[u128; 2]>> = numbers.into_iter().map(fraction).collect();
    let [[a, b], [c, d]] = parts?.try_into().ok()?;
    let [num, den] = lowest([a * d, b * c]);
    let is_taken = [num, den].iter().all(|it| i64::try_from(*it).is_ok() && holds(&choice["items"], *it as f64));
    is_taken.then(|| format!(": write [{num}, {den}]"))
}

fn number(node: &Node) -> Option<f64> {
    match node.value {
        NodeValue::Integer(number) => Some(number as f64),
        NodeValue::Float(number) => Some(number),
        _ => None,
    }
}

/// Returns a decimal number above 0 of at most 17 digits as a fraction.
fn fraction(number: f64) -> Option<[u128; 2]> {
    let text = number.to_string();
    let (whole, decimals) = text.split_once('.').unwrap_or((&text, ""));
    let is_short = number > 0.0 && text.len() <= 18;
    Some([format!("{whole}{decimals}").parse().ok().filter(|_| is_short)?, 10_u128.pow(decimals.len() as u32)])
}

/// Divides both by their greatest common divisor.
pub(super) fn lowest([num, den]: [u128; 2]) -> [u128; 2] {
    let (mut a, mut b) = (num, den);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    [num / a.max(1), den / a.max(1)]
}

/// Returns a bound such as `minimum` of a choice, or the bound of its integer type.
fn bound(choice: &Json, name: &str) -> Option<f64> {
    let of_type = match (choice["format"].as_str(), name) {
        (Some("int32"), "minimum") => Some(i32::MIN.into()),
        (Some("int32"), "maximum") => Some(i32::MAX.into()),
        (Some("uint32"), "maximum") => Some(u32::MAX.into()),
        _ => None,
    };
    choice[name].as_f64().or(of_type)
}

fn holds(choice: &Json, number: f64) -> bool {
    let bound = |name: &str| bound(choice, name);
    number.is_finite()
        && bound("minimum").is_none_or(|least| number >= least)
        && bound("exclusiveMinimum").is_none_or(|least| number > least)
        && bound("maximum").is_none_or(|most| number <= most)
}

fn out_of_range(choice: &Json, number: f64, node: &Node, path: &KeyPath) -> Option<Fault> {
    (!holds(choice, number)).then(|| {
        let hint = as_delay(choice, number, path).unwrap_or_default();
        fault(node.origin, path, node, &expected(&[choice]), &hint)
    })
}

/// Returns the hint for a delay of a drive that is too long.
fn as_delay(choice: &Json, number: f64, path: &KeyPath) -> Option<String> {
    let is_of_drive = path.keys().is_some_and(|keys| keys.ends_with(&["drive", "delay_ticks"]));
    let most = bound(choice, "maximum").filter(|most| is_of_drive && number > *most)?;
    Some(format!(": take drive.delay_ticks = {most}, or a longer period, in which the delay has fewer ticks"))
}

/// Returns the expected values in words: `a number above 0`, `"sin", "cos" or a list of 2 numbers`.
fn expected(choices: &[&Json]) -> String {
    let words: Vec<String> =
        choices.iter().filter_map(|choice| words(choice)).flatten().map(|w| format!("{w:?}")).collect();
    let others = choices.iter().filter(|choice| self::words(choice).is_none()).map(|choice| kind(choice));
    let all: Vec<String> = words.into_iter().chain(others).collect();
    match all.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => all.concat(),
    }
}

fn kind(choice: &Json) -> String {
    let number = |name: &str| {
        let above = bound(choice, "exclusiveMinimum").map(|least| format!("above {}", shown(least)));
        let least = bound(choice, "minimum").map(|least| format!("at least {}", shown(least)));
        let most = bound(choice, "maximum").map(|most| format!("at most {}", shown(most)));
        let range: Vec<String> = [above, least, most].into_iter().flatten().collect();
        format!("{name} {}", range.join(" and ")).trim_end().to_owned()
    };
    if has_type(choice, "array") {
        let several = plural(&choice["items"]);
        return match (choice["minItems"].as_u64(), choice["maxItems"].as_u64()) {
            (Some(least), Some(most)) if least == most => format!("a list of {least} {several}"),
            (Some(least), Some(most)) => format!("a list of {least} to {most} {several}"),
            (Some(least), None) => format!("a list of at least {least} {several}"),
            (None, Some(most)) => format!("a list of at most {most} {several}"),
            (None, None) => format!("a list of {several}"),
        };
    }
    match () {
        () if has_type(choice, "integer") => number("a whole number"),
        () if has_type(choice, "number") => number("a finite number"),
        () if has_type(choice, "boolean") => "true or false".into(),
        () if has_type(choice, "string") => "text".into(),
        () => "a table".into(),
    }
}

fn plural(items: &Json) -> &'static str {
    match () {
        () if has_type(items, "number") => "numbers",
        () if has_type(items, "integer") => "whole numbers",
        () if has_type(items, "array") => "lists",
        () if has_type(items, "string") => "texts",
        () => "tables",
    }
}
