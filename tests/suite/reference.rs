//! The generated pages of `docs/reference`: keys of scenario files, commands, status flags. `GOLDEN=write` writes them.

use std::fmt::Write as _;

use controller_core::Health;
use controller_core::drive::{ALARMS, FENCED};
use host_sim::cli;
use integration_tests::data::path;
use integration_tests::golden;
use integration_tests::program::host_sim;
use serde_json::Value;

/// Sources of the status flags: each constant of `Health` has a doc comment.
const HEALTH: &str = include_str!("../../controller-core/src/health.rs");

#[test]
fn the_page_of_keys_is_the_schema() {
    let mut page = String::from(
        "# Keys of scenario files\n\nFor everyone who writes a scenario file. You get every key with its range, \
         default and meaning. You need a file from\n`host-sim new NAME --plant PLANT`. This page is generated from \
         `host-sim schema`.\n\nAll units are SI, and the unit is the suffix of the key. A key without a default is \
         optional unless its meaning says\notherwise.\n\n[Motor](#motor) · [Joint](#joint) · \
         [Chain, own equations, paper](#chain-own-equations-paper)\n",
    );
    for (title, plant) in [("Motor", "motor"), ("Joint", "joint"), ("Chain, own equations, paper", "paper")] {
        let schema: Value = serde_json::from_str(&host_sim(&["schema", "--plant", plant]).out).expect("a schema");
        let _ = write!(page, "\n## {title}\n");
        tables(&schema, &schema, "", &mut page);
    }
    page += "\nNext: [Commands](cli.md)\n";
    golden::whole("reference/keys.md", &page).unwrap_or_else(|differs| panic!("{differs}"));
}

/// Writes the table of an object, then the tables of the objects in it.
fn tables(schema: &Value, object: &Value, name: &str, page: &mut String) {
    let Some(properties) = object["properties"].as_object() else { return };
    let (inner, keys): (Vec<_>, Vec<_>) = properties.iter().partition(|(_, value)| table_of(schema, value).is_some());
    if !keys.is_empty() {
        let head = if name.is_empty() { "top of the file".into() } else { format!("`[{name}]`") };
        let _ = write!(page, "\n### {head}\n\n| key | value | default | meaning |\n|---|---|---|---|\n");
    }
    for (key, value) in keys {
        let default = match &value["default"] {
            Value::Null => "-".into(),
            default => format!("`{default}`"),
        };
        let kind = kind(schema, value);
        let _ = writeln!(page, "| `{key}` | {kind} | {default} | {} |", meaning(value));
    }
    for (key, value) in inner {
        let dotted = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
        let table = table_of(schema, value).expect("it has just been found");
        let is_list = value["items"].is_object();
        tables(schema, table, &if is_list { format!("[{dotted}]") } else { dotted }, page);
    }
}

/// Returns the definition of a table or of the tables of a list.
fn table_of<'a>(schema: &'a Value, value: &'a Value) -> Option<&'a Value> {
    let found = resolved(schema, value);
    let found = if found["items"].is_object() { resolved(schema, &found["items"]) } else { found };
    found["properties"].is_object().then_some(found)
}

/// Follows `$ref`, and `anyOf` with null.
fn resolved<'a>(schema: &'a Value, value: &'a Value) -> &'a Value {
    let options = value["anyOf"].as_array().map_or(&[][..], |all| all);
    let others: Vec<&Value> = options.iter().filter(|it| it["type"] != "null").collect();
    match (value["$ref"].as_str(), &others[..]) {
        (Some(name), _) => resolved(schema, &schema["$defs"][name.trim_start_matches("#/$defs/")]),
        (None, [only]) => resolved(schema, only),
        _ => value,
    }
}

/// Returns type and range of a value in words.
fn kind(schema: &Value, value: &Value) -> String {
    let value = resolved(schema, value);
    for list in ["oneOf", "anyOf"] {
        if let Some(options) = value[list].as_array() {
            let words: Vec<String> = options.iter().map(|it| kind(schema, it)).filter(|it| it != "null").collect();
            return words.join(", ");
        }
    }
    if let Some(word) = value["const"].as_str() {
        return format!("`\"{word}\"`");
    }
    if let Some(words) = value["enum"].as_array() {
        return words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
    }
    let types = match &value["type"] {
        Value::Array(all) => all.iter().filter_map(Value::as_str).filter(|it| *it != "null").collect(),
        one => one.as_str().into_iter().collect::<Vec<_>>(),
    };
    let of_items = || format!("list: {}", kind(schema, &value["items"]));
    let word = match types.first().copied() {
        Some("string") => "text".into(),
        Some("boolean") => "`true`, `false`".into(),
        Some("array") => of_items(),
        Some(word) => word.into(),
        None => "any".into(),
    };
    let bound = |key: &str, sign: &str| value[key].is_number().then(|| format!("{sign} {}", value[key]));
    let bounds = [("exclusiveMinimum", ">"), ("minimum", ">="), ("exclusiveMaximum", "<"), ("maximum", "<=")];
    [Some(word)].into_iter().chain(bounds.map(|(key, sign)| bound(key, sign))).flatten().collect::<Vec<_>>().join(" ")
}

/// Returns a description as a cell of a table.
fn meaning(value: &Value) -> String {
    value["description"]
        .as_str()
        .unwrap_or_default()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace('|', "\\|")
}

#[test]
fn the_page_of_commands_is_their_help() {
    let help = host_sim(&["--help"]).out;
    let mut page = String::from(
        "# Commands of host-sim\n\nFor everyone who runs `host-sim`. You get the help of every command with examples \
         and exit status. You need a build:\n`cargo run --release -- COMMAND`. This page is generated from `--help`.\n",
    );
    let section = |title: &str, help: &str| format!("\n## {title}\n\n```text\n{}\n```\n", help.trim());
    page += &section("host-sim", &help);
    let (_, commands) = help.split_once("Commands:\n").expect("a list of commands");
    let is_command = |line: &&str| line.starts_with("  ") && !line.starts_with("   ") && !line.starts_with("  -");
    let names = commands.lines().take_while(|line| !line.is_empty()).filter(is_command);
    for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        page += &section(name, &host_sim(&[name, "--help"]).out);
    }
    page += "\nNext: [Status flags](status.md)\n";
    golden::whole("reference/cli.md", &page).unwrap_or_else(|differs| panic!("{differs}"));
}

#[test]
fn the_page_of_status_flags_is_the_source() {
    let mut page = String::from(
        "# Status flags\n\nFor everyone who reads `health` in a trace, in `Health` or in `edo_smc_output_t`. You get \
         every bit with its meaning. You\nneed nothing else. This page is generated from \
         `controller-core/src/health.rs`.\n\nAn *alarm* is answered by `monitor.reaction` and freezes the trace buffer \
         (`drive::ALARMS`, C: `EDO_SMC_ALARMS`). *limit*: an alarm\nof `[limits]` (`drive::FENCED`). The other flags \
         are only reported.\n\n\
         | bit | flag | alarm | meaning |\n|---:|---|---|---|\n",
    );
    let mut comment = String::new();
    let mut flags = 0;
    for line in HEALTH.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("/// ") {
            comment = comment + text + " ";
            continue;
        }
        let constant = line.strip_prefix("pub const ").and_then(|rest| rest.split_once(": Self = Self("));
        if let Some((name, bits)) = constant {
            let bits: u16 = bits.trim_end_matches(");").replace('_', "").parse().expect("the bits of a flag");
            if bits.is_power_of_two() {
                let plain = without_links(&comment).replace('|', "\\|");
                let flag = Health::from_bits(bits);
                let alarm = match (ALARMS.contains(flag), FENCED.contains(flag)) {
                    (true, _) => "alarm",
                    (_, true) => "limit",
                    _ => "",
                };
                let _ = writeln!(page, "| {} | `{name}` | {alarm} | {} |", bits.trailing_zeros(), plain.trim());
                flags += 1;
            }
        }
        comment.clear();
    }
    assert_eq!(flags, 16, "every bit is a flag");
    page += "\nNext: [Glossary](../glossary.md)\n";
    golden::whole("reference/status.md", &page).unwrap_or_else(|differs| panic!("{differs}"));
}

/// Returns a doc comment without the targets of its links.
fn without_links(comment: &str) -> String {
    let mut parts = comment.split("](");
    let first = parts.next().unwrap_or_default().to_owned();
    let text = parts.fold(first, |text, part| text + part.split_once(')').map_or(part, |(_, rest)| rest));
    text.replace(['[', ']'], "")
}

/// Every page of docs is in the index.
#[test]
fn the_index_names_every_page() {
    let docs = path("../docs");
    let index = std::fs::read_to_string(docs.join("README.md")).expect("the index");
    for folder in ["", "reference/", "evidence/"] {
        for entry in std::fs::read_dir(docs.join(folder)).expect("a folder") {
            let file = entry.expect("an entry").path();
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let is_page =
                file.extension().is_some_and(|it| it == "md") && !["README.md", "SUMMARY.md"].contains(&&*name);
            assert!(!is_page || index.contains(&format!("]({folder}{name})")), "docs/README.md lacks {folder}{name}");
        }
    }
}

/// Every `host-sim` command in a page is accepted. The crate `host-sim` compares the outputs of README and tutorial
/// (test `program`) and the examples of tuning (test `design`).
#[test]
fn every_command_in_the_pages_is_accepted() {
    let (mut count, mut wrong) = (0, Vec::new());
    for page in pages(&path("..")) {
        let text = std::fs::read_to_string(&page).expect("a page");
        // A command goes on behind a backslash.
        for line in text.replace("\\\n", " ").lines() {
            let line = line.trim().trim_start_matches("$ ");
            let after = ["cargo run --release -- ", "cargo run --release --features chip -- ", "host-sim "];
            let Some(words) = after.iter().find_map(|begin| line.strip_prefix(begin)) else { continue };
            let words = words.split(" #").next().unwrap_or(words);
            // A pattern such as `[--set KEY=VALUE]` is not a command.
            if words.contains("[-") || words.contains(" ..") || words.contains(['`', '<', '|']) {
                continue;
            }
            let args = ["host-sim".into()].into_iter().chain(split(words).into_iter().map(Into::into));
            count += 1;
            if let Err(message) = cli::check_syntax(args) {
                wrong.push(format!("{}: {line}: {message}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 50, "{count} commands");
}

/// Returns the pages of the repository: the root, `docs` and the crates.
fn pages(root: &std::path::Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(root).expect("a folder").map(|entry| entry.expect("an entry").path());
    let skipped = |path: &std::path::Path| ["target", "out", ".git"].iter().any(|name| path.ends_with(name));
    entries
        .filter(|path| !skipped(path))
        .flat_map(|path| match path.is_dir() {
            true => pages(&path),
            false if path.extension().is_some_and(|it| it == "md") => vec![path],
            false => Vec::new(),
        })
        .collect()
}

/// Splits a command line at blanks as a shell does; quotes join words.
fn split(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.trim().chars() {
        match (c, quote) {
            ('\'' | '"', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            (' ', None) => words.push(String::new()),
            (c, _) => words.last_mut().expect("never empty").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}
