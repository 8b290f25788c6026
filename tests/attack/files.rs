//! Mutated scenario files: every shipped file and the output of `new`, with changes to keys, numbers, lines, characters
//! and nesting, and equally mutated `--set` arguments. A rejection must name the line or the argument; an accepted file
//! must run. One file in twelve goes through `host-sim` as bytes of a file.

use controller_core::MAX_N;
use integration_tests::program::{Folder, host_sim};
use integration_tests::strategy::{Rng, Trial};
use scenario::{CHAIN, DEFAULT, Source, parse, template};
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Time limit to read and reject or design a file. The usual time is some milliseconds.
const READS: Duration = Duration::from_secs(5);
/// Ticks that an accepted file runs; each tick takes at most 10 000 solver steps.
const TICKS: usize = 50;
/// Maximum length of an error line after its place, bytes.
const LONGEST: usize = 1000;

/// Texts of all shipped files.
static TEXTS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let folders = ["../scenario/scenarios", "../host-sim/scenarios"];
    let files = folders.iter().flat_map(|folder| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let entries = fs::read_dir(folder).expect("the folder of shipped scenarios");
        entries.map(|entry| entry.expect("a file").path())
    });
    let mut files: Vec<_> = files.collect();
    // Sorted, so that a trial draws the same file on every machine.
    files.sort();
    let mut texts: Vec<String> = files.iter().map(|path| fs::read_to_string(path).expect("a scenario")).collect();
    texts.extend(scenario::STARTS.map(|(plant, _)| template("mine", plant).expect("a name and a plant")));
    texts.extend([DEFAULT.into(), CHAIN.into(), String::new()]);
    texts
});

/// Keys of the schema, as they appear in a table.
static KEYS: LazyLock<Vec<String>> = LazyLock::new(|| {
    fn collect(schema: &serde_json::Value, keys: &mut Vec<String>) {
        match schema {
            serde_json::Value::Object(object) => {
                if let Some(serde_json::Value::Object(properties)) = object.get("properties") {
                    keys.extend(properties.keys().cloned());
                }
                object.values().for_each(|value| collect(value, keys));
            }
            serde_json::Value::Array(list) => list.iter().for_each(|value| collect(value, keys)),
            _ => {}
        }
    }
    let mut keys = Vec::new();
    for (plant, _) in scenario::STARTS {
        collect(scenario::schema(plant), &mut keys);
    }
    keys
});

pub(super) fn run(_: u64, trial: &mut Trial) -> Result<(), String> {
    let rng = &mut trial.rng;
    let mut text = rng.one_of(&TEXTS).clone();
    // Comments are two thirds of a template.
    if rng.chance(0.7) {
        text = text.lines().filter(|line| !line.starts_with('#')).flat_map(|line| [line, "\n"]).collect();
    }
    for _ in 0..*rng.one_of(&[0, 1, 1, 1, 2, 2, 3, 5, 12]) {
        mutate(&mut text, rng);
    }
    let sets: Vec<String> =
        (0..*rng.one_of(&[0, 0, 0, 1, 2])).map(|_| format!("{}={}", set_key(rng), value(rng, 3))).collect();
    trial.tell(|| format!("--set {sets:?}, the file:\n{text}\n(its end)"));
    trial.done += 1;
    if trial.rng.chance(1.0 / 12.0) { through_the_program(&text, trial) } else { in_process(&text, &sets, trial) }
}

fn in_process(text: &str, sets: &[String], trial: &mut Trial) -> Result<(), String> {
    let began = Instant::now();
    let read = parse(&Source { file: "a.toml", text, sets }, "a");
    if began.elapsed() > READS {
        return Err(format!("it took {:?} to read", began.elapsed()));
    }
    let mut experiment = match read {
        Ok(experiment) => experiment,
        Err(error) => {
            trial.tell(|| format!("refused:\n{error}"));
            return error.to_string().split('\n').try_for_each(|line| has_a_place(line, sets));
        }
    };
    // The full time span would only take long.
    experiment.periods = experiment.periods.min(TICKS);
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    trial.tell(|| format!("accepted, {} ticks, {error:?}", trace.rows.len()));
    experiment.metrics(&trace);
    if let Some(error) = error {
        return if error.to_string().is_empty() { Err("a run that ends without a word".into()) } else { Ok(()) };
    }
    let limits = experiment.spec.as_ref().map(|spec| spec.config.padded.options.limits);
    for row in &trace.rows {
        // Limits are rounded to f32.
        let is_within = limits.is_none_or(|limits| {
            let room = 1e-6 * limits.min.abs().max(limits.max.abs());
            limits.min - room <= row.u && row.u <= limits.max + room
        });
        if !(is_within && row.u.is_finite() && row.x[..MAX_N].iter().all(|x| x.is_finite())) {
            return Err(format!("limits {limits:?}, but {row:?}"));
        }
    }
    Ok(())
}

/// Checks that an error line begins with its place: `a.toml:3:1: ..`, or `--set seed=x: ..` with the argument in full.
fn has_a_place(line: &str, sets: &[String]) -> Result<(), String> {
    let of_file = || {
        let (number, what) = line.strip_prefix("a.toml:")?.split_once(':')?;
        number.parse::<usize>().ok().map(|_| what)
    };
    let of_argument = || {
        let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
        let place = |set: &String| format!("--set {}: ", set.chars().map(escaped).collect::<String>());
        sets.iter().find_map(|set| line.strip_prefix(&place(set)))
    };
    match of_file().or_else(of_argument) {
        Some(what) if what.len() < LONGEST => Ok(()),
        _ => Err(format!("a refusal without a place, or longer than {LONGEST} bytes: {line}")),
    }
}

/// Runs `host-sim` on the bytes of a file, which may be invalid UTF-8.
fn through_the_program(text: &str, trial: &mut Trial) -> Result<(), String> {
    let rng = &mut trial.rng;
    let mut bytes = text.as_bytes().to_vec();
    if rng.chance(0.3) && !bytes.is_empty() {
        let at = rng.integer(0, bytes.len() - 1);
        bytes[at] = rng.bits() as u8;
    }
    let folder = Folder::new(&format!("attack-{:x}", rng.bits()));
    let (file, out) = (folder.path("a.toml"), folder.path("out"));
    fs::write(&file, &bytes).map_err(|error| error.to_string())?;
    let short = ["--set", "span_s=0.01", "--set", "window_s=[0, 0.01]", "--out", &out, "--json"];
    let spoken = match rng.integer(0, 9) {
        0..=2 => host_sim(&[&["run", file.as_str()][..], &short].concat()),
        3 => host_sim(&["export", &file, "--paper", "--lang", "rust"]),
        4 => host_sim(&["export", &file, "--paper", "--lang", "c"]),
        _ => host_sim(&["export", &file, "--paper", "--standalone"]),
    };
    trial.tell(|| format!("{spoken:?}"));
    let is_told = spoken.err.lines().any(|line| line.starts_with("error: "));
    match spoken.status {
        0 if !is_told => Ok(()),
        1 if is_told => Ok(()),
        2 if is_told && spoken.out.is_empty() && !Path::new(&out).exists() => Ok(()),
        _ => Err(format!("{spoken:?}")),
    }
}

/// Returns a random value; lists and tables may nest.
fn value(rng: &mut Rng, depth: usize) -> String {
    const WORDS: &str = r#"nan inf -inf -0.0 1e300 -1e300 1e-320 9223372036854775807 9223372036854775808 true 0xff
        "" "chain" "benchmark" "flexible_joint" "baseline" "f64" "hold" [] {} ''' 1979-05-27T07:32:00Z"#;
    match rng.integer(0, 9) {
        0..=2 => (*rng.one_of(&WORDS.split_whitespace().collect::<Vec<_>>())).into(),
        3 | 4 => rng.integer(0, 8).to_string(),
        5 => (rng.sign() * rng.spread(1e-6, 1e6)).to_string(),
        6 => format!("{:e}", f64::from_bits(rng.bits())),
        7 if depth > 0 => {
            let list: Vec<_> = (0..rng.integer(0, 7)).map(|_| value(rng, depth - 1)).collect();
            format!("[{}]", list.join(", "))
        }
        8 if depth > 0 => {
            let list: Vec<_> =
                (0..rng.integer(0, 3)).map(|_| format!("{} = {}", key(rng), value(rng, depth - 1))).collect();
            format!("{{{}}}", list.join(", "))
        }
        _ => quoted(rng),
    }
}

fn key(rng: &mut Rng) -> String {
    if rng.chance(0.9) { rng.one_of(&KEYS).clone() } else { quoted(rng) }
}

/// Returns a random key path, with positions in lists.
fn set_key(rng: &mut Rng) -> String {
    let parts: Vec<String> = (0..rng.integer(1, 4))
        .map(|_| if rng.chance(0.3) { format!("{}[{}]", key(rng), rng.integer(0, 4)) } else { key(rng) })
        .collect();
    parts.join(".")
}

/// Returns random characters: every UTF-8 length, changes of the text direction, and invisible characters.
fn strange(rng: &mut Rng) -> String {
    let all: Vec<char> = "aσ\u{1f600}\u{301}\u{202e}\u{feff}\u{7f}\0\r\n\"\\=[#.".chars().collect();
    let length = *rng.one_of(&[0, 1, 2, 5, 100]);
    (0..length).map(|_| *rng.one_of(&all)).collect()
}

/// Returns a random text in the notation of TOML.
fn quoted(rng: &mut Rng) -> String {
    serde_json::Value::from(strange(rng)).to_string()
}

/// Applies one random change to a text.
fn mutate(text: &mut String, rng: &mut Rng) {
    let mut lines: Vec<String> = text.lines().map(Into::into).collect();
    lines.push(String::new());
    let at = rng.integer(0, lines.len() - 1);
    let with = rng.integer(0, lines.len() - 1);
    match rng.integer(0, 13) {
        0 => drop(lines.remove(at)),
        1 => lines.insert(with, lines[at].clone()),
        2 => lines.swap(at, with),
        // Replaces the value or the key of a line.
        3..=5 => {
            if let Some((key, _)) = lines[at].split_once('=') {
                lines[at] = format!("{key}= {}", value(rng, 4));
            }
        }
        6 => {
            if let Some((_, value)) = lines[at].split_once('=') {
                lines[at] = format!("{} ={value}", key(rng));
            }
        }
        7 => lines.insert(at, format!("{} = {}", key(rng), value(rng, 4))),
        // Changes a number slightly or by orders of magnitude.
        8 | 9 => {
            let digits: Vec<usize> = lines[at].match_indices(|c: char| c.is_ascii_digit()).map(|(k, _)| k).collect();
            if !digits.is_empty() {
                let k = *rng.one_of(&digits);
                let other = *rng.one_of(&["0", "9", "1e9", "-", "0.", "e-9", "99999999999999999999", "_"]);
                lines[at].replace_range(k..=k, other);
            }
        }
        10 => {
            let places: Vec<usize> = (0..=lines[at].len()).filter(|&k| lines[at].is_char_boundary(k)).collect();
            let k = *rng.one_of(&places);
            lines[at].insert_str(k, &strange(rng));
        }
        11 => lines.truncate(at + 1),
        12 => {
            let name = key(rng);
            lines.insert(
                at,
                rng.one_of(&[format!("[{name}]"), format!("[[{name}]]"), format!("[plant.{name}]")]).clone(),
            );
        }
        // Adds deep nesting (lists, tables, dotted keys) or a long list.
        _ => {
            let count = *rng.one_of(&[3, 30, 300, 3000, 30_000]);
            let name = key(rng);
            lines.insert(
                at,
                match rng.integer(0, 4) {
                    0 => format!("{name} = {}", "[".repeat(count)),
                    1 => format!("{name} = {}{}", "[".repeat(count), "]".repeat(count)),
                    2 => format!("{name} = {}1{}", "{a = ".repeat(count), "}".repeat(count)),
                    3 => format!("{}a = 1", "a.".repeat(count)),
                    _ => format!("{name} = [{}]", "1.0, ".repeat(count)),
                },
            );
        }
    }
    *text = lines.join("\n");
}
