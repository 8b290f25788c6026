//! Identity numbers of a drive: every change in its behaviour changes the numbers that identify it.
//!
//! The test sets every key of every template to another value, one at a time, including the keys behind a `#`. Before
//! and after, it creates the outputs of the project in process. These are the Rust file, the C file for the static
//! library, the design for the serial protocol, and the head of a trace buffer. If the code of an output changes, its
//! numbers must change: include guard and `DESIGN`, hash of the serial protocol, fingerprint of the controller. A key
//! of the simulation alone ([`SIMULATED`]) changes none of them. Every other key either changes the fingerprint of the
//! running controller or is listed in [`WITHOUT_EFFECT`] with its reason. A key that cannot be changed alone is listed
//! in [`FIXED`].
//!
//! A self-contained C file takes up to a second to create. The test creates one where the fingerprint stays and the
//! inputs of the file change, and for the keys in [`RECORDED`].

use std::collections::{BTreeMap, BTreeSet};

use forms::{Form, PREFIX};
use integration_tests::program::{Folder, host_sim};
use link::black_box::BlackBox;
use link::remote::{Loadable, for_target};
use scenario::{Experiment, ScenarioError, Source};

/// Keys without any effect on controller, monitors, gates or encoders, by the beginning of their path.
const SIMULATED: [&str; 37] = [
    "motor.supply_v",
    "motor.resistance_ohm",
    "motor.no_load_rad_s",
    "joint.supply_v",
    "joint.resistance_ohm",
    "joint.no_load_rad_s",
    "name",
    "title",
    "span_s",
    "window_s",
    "settling_band",
    "seed",
    "plant.x0",
    "plant.input_disturbance",
    "plant.state_dependent",
    "plant.disturbance",
    "plant.error",
    "plant.rates",
    "sensor.",
    "actuator.",
    "reference.",
    "friction.",
    "load.",
    "fault.",
    "error.",
    "motor.start_rad",
    "joint.start_rad",
    "joint.spring_damping_n_m_s",
    "encoder.eccentricity_rad",
    "encoder.link.eccentricity_rad",
    "drive.jitter_s",
    // Keys of one file alone: its controller has separate nominal numbers or does not use these.
    "chain: plant.a",
    "chain: plant.b",
    "own: plant.constants.m",
    "own: plant.constants.c",
    "own: plant.constants.f",
    "paper: plant.rates",
];

/// Keys of a design without effect on its behaviour, with the reason.
const WITHOUT_EFFECT: [(&str, &str); 3] = [
    ("drive.accept_unstable", "says which designs are refused, and no more"),
    ("controller.observer_pole_limit", "says which designs are refused, and no more"),
    ("controller.k", "of the baseline, which is not exported and has no fingerprint"),
];

/// Keys that cannot be changed alone, with the reason.
const FIXED: [(&str, &str); 9] = [
    ("motor: reference.kind", "decides which other keys there are"),
    ("joint: reference.kind", "decides which other keys there are"),
    ("paper: controller.kind", "decides which other keys there are"),
    ("chain: plant.order", "the length of other keys"),
    ("paper: plant.kind", "decides which other keys there are"),
    ("paper: plant.order", "the length of other keys"),
    ("paper: plant.parameters.b11", "is read for the figures of the paper alone, with the value of Table I"),
    ("chain: plant.kind", "decides which other keys there are"),
    ("own: plant.kind", "decides which other keys there are"),
];

/// Keys whose self-contained C file is always created and compared.
const RECORDED: [&str; 7] = [
    "motor: monitor.load_n_m",
    "motor: monitor.reaction",
    "motor: monitor.stop_s",
    "motor: encoder.offset_counts",
    "motor: encoder.reversed",
    "motor: drive.lost_ticks",
    "paper: controller.samples.jump",
];

/// Further settings that give a key a meaning; every context of every file is tried.
const CONTEXTS: [(&str, &[&[&str]]); 5] = [
    (
        "motor",
        &[
            &[],
            // A number of states needs the counts of a revolution.
            &["encoder.counts_per_turn=4096"],
            &["monitor.reaction=\"joined_stop\"", "drive.fallback=0"],
            &["drive.gain_sets=1", "motor.gear=[9, 1]", "motor.load_inertia_kg_m2=0.01"],
            &[
                "motor={inertia_kg_m2=2e-8, torque_n_m_per_a=0.0045, max_current_a=0.7, gear=[288, 1], \
                 load_inertia_kg_m2=1e-4, current_lag_s=1e-3, play_rad=0.01}",
                "encoder={bits=12, behind_gear=true}",
                "drive.period_s=2e-3",
                "reference.frequency_hz=0.2",
            ],
            &["reference={ kind=\"move\", to_rad=1, start_s=0.1, duration_s=0.25 }"],
            &["reference={ kind=\"points\", points_rad=[0.0, 0.1, 0.3, 0.6], every_s=0.01 }"],
            &["reference={ kind=\"set_points\", points_rad=[0.0, 0.1, 0.3, 0.6], every_s=0.01, max_speed_rad_s=3.0, \
                 max_acceleration_rad_s2=8.0 }"],
            &["reference={ kind=\"speed\", speed_rad_s=20 }"],
            &["drive.mode=\"speed\"", "reference={ kind=\"speed\", speed_rad_s=20 }"],
            &["motor.supply_v=24", "motor.resistance_ohm=0.5", "reference={ kind=\"move\", to_rad=20 }"],
            &["motor.no_load_rad_s=480", "reference={ kind=\"move\", to_rad=20 }"],
            &["load=[{ kind=\"sin\", amplitude=0.02, omega_rad_s=30, phase_rad=0.1 }]"],
            &["load=[{ kind=\"step\", amplitude=0.02, t0_s=0.3 }]"],
            &["load=[{ kind=\"ramp\", slope=0.01 }]"],
            &["fault=[{ kind=\"jump\", at_s=1, counts=1000 }]"],
            &["fault=[{ kind=\"lost\", at_s=1, for_s=0.02 }]"],
            &["fault=[{ kind=\"derated\", at_s=1, current_a=2.0 }]"],
            &["fault=[{ kind=\"missed\", at_s=1, for_s=0.01 }]"],
        ],
    ),
    (
        "joint",
        &[
            &[],
            &["encoder.link.counts_per_turn=4096", "encoder.motor.counts_per_turn=4096"],
            &["monitor.reaction=\"joined_stop\"", "drive.fallback=0", "joint.gear=[9, 1]"],
            &["drive.gain_sets=1"],
            // Lag, noise and margin belong to a design as a whole.
            &["drive.tuning=\"coupled\""],
            &["reference={ kind=\"sine\", amplitude_rad=0.5, frequency_hz=0.2 }"],
            &["reference={ kind=\"points\", points_rad=[0.0, 0.1, 0.3, 0.6], every_s=0.01 }"],
            &["reference={ kind=\"set_points\", points_rad=[0.0, 0.1, 0.3, 0.6], every_s=0.01, max_speed_rad_s=3.0, \
                 max_acceleration_rad_s2=8.0 }"],
            &["reference={ kind=\"speed\", speed_rad_s=2 }"],
            &["joint.supply_v=24", "joint.resistance_ohm=0.5", "reference={ kind=\"move\", to_rad=2 }"],
            &["joint.no_load_rad_s=200", "reference={ kind=\"move\", to_rad=2 }"],
            &["load=[{ kind=\"sin\", amplitude=0.02, omega_rad_s=30, phase_rad=0.1 }]"],
            &["load=[{ kind=\"step\", amplitude=0.02, t0_s=0.3 }]"],
            &["load=[{ kind=\"ramp\", slope=0.01 }]"],
            &["fault=[{ kind=\"jump\", encoder=\"link\", at_s=1, counts=1000 }]"],
            &["fault=[{ kind=\"lost\", at_s=1, for_s=0.02 }]"],
            &["fault=[{ kind=\"derated\", at_s=1, current_a=2.0 }]"],
        ],
    ),
    (
        "paper",
        &[
            &[],
            &["plant.reading=\"physical\"", "controller.limits={ min=-30, max=30 }"],
            &["plant.reading=\"literal\""],
            &[
                "controller.k_s=1",
                "controller.samples={ min=[-7, -50, -7, -50], max=[7, 50, 7, 50], jump=[0.1, 5, 0.1, 5] }",
            ],
            &["plant.disturbance=[{ channel=1, terms=[{ kind=\"const\", amplitude=0.1 }, { kind=\"ramp\", \
                slope=0.01 }, \
               { kind=\"sin\", amplitude=0.2, omega_rad_s=3, phase_rad=0.5 }, \
               { kind=\"cos\", amplitude=0.2, omega_rad_s=1 }, { kind=\"step\", amplitude=0.5, t0_s=5 }] }]"],
            &["controller.observer=[{ channel=4, poles=[[-10.0, 5.0], [-10.0, -5.0]] }]"],
            &["controller.observer=[{ channel=4, bandwidth_rad_s=10, order=2 }]"],
            &["plant={ kind=\"benchmark\" }", "controller={ c=[5, 1], observer=[] }"],
            &[
                "plant={ kind=\"benchmark\" }",
                "controller={ kind=\"baseline\", c=[5, 1], k=4, observer=[{ channel=1, printed=[10] }] }",
            ],
            &[
                "plant={ kind=\"chain\", order=3, a=[-6, -11, -6], b=2, x0=[0, 0, 0] }",
                "controller={ surface_bandwidth_rad_s=4, observer=[], nominal={ a=[-6, -11, -5], b=2 } }",
            ],
            &[
                "plant={ kind=\"chain\", order=3, a=[-6, -11, -6], b=2, x0=[0, 0, 0] }",
                "controller={ surface_bandwidth_rad_s=4, observer=[] }",
            ],
            &[
                "plant={ kind=\"own\", x0=[0.1, 0], rates=[\"x2\", \"-g/l*sin(x1) + u\"], constants={ g=9.81, l=0.5 \
                } }",
                "controller={ surface_bandwidth_rad_s=4, observer=[], nominal={ a=\"-g/l*sin(x1)\", b=1.0 } }",
            ],
        ],
    ),
    ("chain", &[&[], &["actuator.delay_ticks=1"]]),
    (
        "own",
        &[
            &[],
            &["controller.nominal={ a=[19.62, 0.0], b=7, constants={} }"],
            &["plant.disturbance=[{ channel=2, terms=[{ kind=\"sin\", amplitude=1, omega_rad_s=3 }] }]"],
        ],
    ),
];

/// Key in a file, with its value and whether it stands behind a `#`.
#[derive(Clone, Debug)]
struct Key {
    /// Path of the key: `plant.disturbance[1].channel`.
    path: String,
    value: String,
    /// Alternative values in its comment.
    others: Vec<String>,
}

/// Returns the path without list positions.
fn plain(path: &str) -> String {
    let mut out = String::new();
    let mut within = false;
    for c in path.chars() {
        within = (within || c == '[') && c != ']';
        if !within && c != ']' {
            out.push(c);
        }
    }
    out
}

/// Returns all keys of a file, including keys behind a `#` and keys of inline tables.
fn keys(text: &str) -> Vec<Key> {
    let (mut table, mut keys) = (String::new(), Vec::new());
    // Number of active tables per list; those behind a `#` are like the first.
    let mut live = BTreeMap::<&str, usize>::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let code = line.strip_prefix("# ").unwrap_or(line).trim_start();
        if let Some((name, _)) = code.strip_prefix("[[").and_then(|rest| rest.split_once("]]")) {
            let count = live.entry(name).or_default();
            *count += usize::from(line.starts_with('['));
            table = format!("{name}[{}].", if line.starts_with('[') { *count } else { 1 });
        } else if let Some(name) = code.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            table = format!("{}.", name.0);
        }
        let Some((name, rest)) = code.split_once(" = ") else { continue };
        if !name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_') {
            continue;
        }
        let (value, comment) = rest.split_once(" # ").unwrap_or((rest, ""));
        let mut value = value.to_owned();
        while depth(&value) > 0 {
            let line = lines.next().expect("the end of a list").trim_start_matches("# ");
            value.push_str(line.split(" # ").next().unwrap_or_default());
        }
        let others = comment.split('"').skip(1).step_by(2).map(|word| format!("\"{word}\"")).collect();
        add(&mut keys, &format!("{table}{name}"), value.trim(), others);
    }
    keys
}

/// Returns the number of brackets and braces still open at the end.
fn depth(text: &str) -> i32 {
    text.chars().map(|c| i32::from("[{".contains(c)) - i32::from("]}".contains(c))).sum()
}

/// Splits a list at the commas outside brackets.
fn parts(list: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    for c in list.chars() {
        let last = parts.last_mut().expect("one");
        if c == ',' && depth(last) == 0 {
            parts.push(String::new());
        } else {
            last.push(c);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

fn add(keys: &mut Vec<Key>, path: &str, value: &str, others: Vec<String>) {
    if let Some(inner) = value.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')) {
        for part in parts(inner) {
            let (name, value) = part.split_once('=').expect("a key of a table in a line");
            add(keys, &format!("{path}.{}", name.trim()), value.trim(), Vec::new());
        }
        return;
    }
    if let Some(inner) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'))
        && inner.trim_start().starts_with('{')
    {
        for (k, part) in parts(inner).iter().enumerate() {
            add(keys, &format!("{path}[{}]", k + 1), part, Vec::new());
        }
        return;
    }
    keys.push(Key { path: path.into(), value: value.into(), others });
}

/// Returns other values that may be valid.
fn values(key: &Key) -> Vec<String> {
    let value = key.value.as_str();
    let mut values = key.others.clone();
    let words: &[&str] = match plain(&key.path).rsplit('.').next().unwrap_or_default() {
        // Comments list the kinds, the readings and most other words.
        "rates" => &[
            "[\"x2\", \"1.1*u - g/l*sin(x1)\"]",
            "[\"x2\", \"g/l*sin(x1) + (u - c*x2 - f*tanh(x2/0.01) + 0.3*sin(3*t))/(m*l^2)\"]",
        ],
        // A model that differs only for x1 > 2, where the fingerprint of a controller does not evaluate it.
        "a" if value.starts_with('"') => &["\"g/l*sin(x1) + 5*max(x1 - 2, 0)\""],
        "b" if value.starts_with('"') => &["\"2/(m*l^2)\""],
        "name" | "title" => &["\"other\""],
        "fallback" => &["0.5"],
        "kind" if key.path.contains("terms") || key.path.contains("load") => &["\"cos\"", "\"const\"", "\"sin\""],
        "kind" if key.path.contains("input_disturbance") => &["\"cos\"", "\"const\""],
        "c" => &["[120.0, 74.0, 15.0, 1.0]"],
        "poles" => &["[[-11.0, 5.0], [-11.0, -5.0]]"],
        "constants" => &["{ l = 0.45 }"],
        "window_s" => &["[0.3, 1.5]", "[11.0, 19.0]"],
        "gear" => &["[2, 1]", "[10, 1]"],
        "channel" => &["1", "3"],
        "play_rad" => &["0.02"],
        "gear_stiffness_n_m" => &["2.0", "100.0"],
        "encoder" => &["\"motor\"", "\"link\""],
        _ => &[],
    };
    values.extend(words.iter().map(|&word| word.to_owned()));
    values.extend(match value {
        "true" => vec!["false".into()],
        "false" => vec!["true".into()],
        _ => number_like(value),
    });
    if values.is_empty() {
        return values;
    }
    values.retain(|other| other != value);
    values
}

/// Returns a slightly changed number or list of numbers.
fn number_like(value: &str) -> Vec<String> {
    if let Some(inner) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        let rows = [1.1, 0.9].map(|times: f64| {
            let number = |part: String| part.parse::<f64>().map(|it| format!("{:?}", it * times + 1e-3));
            parts(inner)
                .into_iter()
                .map(number)
                .collect::<Result<Vec<_>, _>>()
                .map(|row| format!("[{}]", row.join(", ")))
        });
        return rows.into_iter().flatten().collect();
    }
    if let Ok(whole) = value.parse::<i64>() {
        return [whole + 1, whole - 1, 2 * whole].map(|it| it.to_string()).into();
    }
    match value.parse::<f64>() {
        Ok(0.0) => vec!["0.05".into(), "1e-5".into()],
        Ok(number) => [1.1, 0.9].map(|times| format!("{:?}", number * times)).into(),
        Err(_) => Vec::new(),
    }
}

/// Outputs of a scenario, each with its code and its identity numbers.
struct Made {
    /// Fingerprint of the controller in `run`.
    fingerprint: Option<u32>,
    /// All inputs of a self-contained C file.
    recorded_from: String,
    sets: Vec<String>,
    /// Output name, code without identity numbers, identity numbers.
    artefacts: BTreeMap<&'static str, (String, Vec<String>)>,
}

/// Extracts every number that follows one of these words; returns the text without them, and the numbers.
fn without(code: &str, words: &[&str]) -> (String, Vec<String>) {
    let (mut numbers, mut rest) = (Vec::new(), String::new());
    for line in code.lines() {
        if words.iter().any(|word| line.contains(word)) {
            numbers.push(line.to_owned());
        } else {
            rest.push_str(line);
            rest.push('\n');
        }
    }
    (rest, numbers)
}

fn made(text: &str, sets: &[String]) -> Result<Made, ScenarioError> {
    let source = Source { file: "it.toml", text, sets };
    let mut experiment = scenario::parse(&source, "it")?;
    let mut artefacts = BTreeMap::new();
    for (name, form) in [("C on the archive", Form::Archive(PREFIX)), ("Rust", Form::Rust)] {
        let Ok(file) = forms::export(&experiment, &source, form) else { continue };
        artefacts.insert(name, code_of(form, &file));
    }
    let fingerprint = experiment.port.fingerprint();
    let whole = experiment.drive.as_ref().map(|drive| drive.designed);
    // Images have no rest band.
    experiment.leave_rest_band();
    if let Ok(Loadable { instance, words }) = for_target(&experiment) {
        let hash = pil_wire::design_hash(instance, &words);
        artefacts.insert("wire", (format!("{instance:?} {words:?}"), vec![format!("{hash:08x}")]));
        if experiment.drive.is_some() {
            let design = Loadable { instance, words };
            // The words form a controller as on a target; the error message contains its fingerprint.
            let none = BlackBox { design, fingerprint: 0, scenario: Vec::new(), sets: Vec::new(), halves: Vec::new() };
            if let Some((_, now)) = none.replay().expect_err("no drive is 0").split_once("and is ") {
                let head = BlackBox { fingerprint: 0, ..none }.to_text();
                let head = without(&head, &["fingerprint,", "sum,"]).0;
                artefacts.insert("trace buffer", (head, vec![now[..8].to_owned()]));
            }
        }
    }
    let Experiment { spec, download, drive, .. } = &experiment;
    let of_drive = drive.as_ref().map(|drive| format!("{whole:?} {:?} {}", drive.shafts, drive.max_current_a));
    Ok(Made {
        fingerprint,
        recorded_from: format!("{spec:?} {download:?} {of_drive:?}"),
        sets: sets.to_vec(),
        artefacts,
    })
}

/// Returns the code of a file without its head, split into code and identity numbers.
fn code_of(form: Form<'_>, file: &str) -> (String, Vec<String>) {
    let is_comment = |line: &&str| line.starts_with("//") && !line.starts_with("///");
    let code = match form {
        Form::Rust => file.lines().skip_while(is_comment).collect::<Vec<_>>().join("\n"),
        _ => file.split_once(" */\n").expect("a head").1.into(),
    };
    let code: Vec<&str> =
        code.lines().filter(|line| !["#if", "#error"].iter().any(|it| line.starts_with(it))).collect();
    let numbers = ["STANDALONE", "DESIGN_H", "CONFIG_H", "DESIGN 0x"].map(|it| format!("#define EDO_SMC_{it}"));
    let numbers: Vec<&str> = numbers.iter().map(String::as_str).chain(["pub const DESIGN: u32"]).collect();
    without(&code.join("\n"), &numbers)
}

/// Returns the self-contained C file.
fn recorded(text: &str, sets: &[String]) -> Option<(String, Vec<String>)> {
    let source = Source { file: "it.toml", text, sets };
    let experiment = scenario::parse(&source, "it").ok()?;
    let form = Form::Standalone(PREFIX);
    Some(code_of(form, &forms::export(&experiment, &source, form).ok()?))
}

/// Results for one key.
#[derive(Default)]
struct Found {
    is_changed: bool,
    changes_what_runs: bool,
}

/// Returns true if a key already has this value.
fn is_there(text: &str, sets: &[String], path: &str, value: &str) -> bool {
    let source = Source { file: "it.toml", text, sets };
    let number = scenario::number_at(&source, path).ok().flatten().map(|it| Ok(it) == value.parse());
    let word = scenario::text_at(&source, path).ok().flatten().map(|it| it == value.trim_matches('"'));
    number.or(word).unwrap_or(false)
}

/// Compares the outputs before and after a change of a key; returns the faults.
fn compare((plant, text): (&str, &str), key: &str, before: &Made, after: &Made) -> Vec<String> {
    let mut faults = Vec::new();
    let is_same = before.fingerprint == after.fingerprint;
    if (is_simulated(plant, key) || is_inert(key)) && !is_same {
        faults.push("the fingerprint of what runs is another".into());
    }
    for (name, code) in &before.artefacts {
        // The Rust file contains the design inputs, which may differ for an equal design; the C file below covers that
        // case.
        if !(is_same && *name == "Rust") {
            faults.extend(after.artefacts.get(name).and_then(|other| difference(name, [code, other])));
        }
    }
    let is_recorded = RECORDED.contains(&&*format!("{plant}: {key}"));
    if (is_recorded || (is_same && before.recorded_from != after.recorded_from))
        && let (Some(code), Some(other)) = (recorded(text, &before.sets), recorded(text, &after.sets))
    {
        faults.extend(difference("C", [&code, &other]));
        if is_recorded && code.0 == other.0 {
            faults.push("C: the code is the same".into());
        }
    }
    faults
}

/// Returns the fault in the identity numbers of two codes.
fn difference(name: &str, [code, other]: [&(String, Vec<String>); 2]) -> Option<String> {
    assert!(!code.1.is_empty(), "{name} has no number");
    let is_same = code.0 == other.0;
    let mut pairs = code.1.iter().zip(&other.1);
    let wrong = pairs.find(|(one, other)| (one == other) != is_same)?;
    Some(format!("{name}: the code is {}, and of {wrong:?} that cannot be told", if is_same { "one" } else { "two" }))
}

fn is_simulated(plant: &str, key: &str) -> bool {
    SIMULATED.iter().any(|begins| is_of(begins, plant, key))
}

/// Returns true if a key equals a list entry or lies below it. An entry may name its file.
fn is_of(begins: &str, plant: &str, key: &str) -> bool {
    let (of, begins) = begins.split_once(": ").unwrap_or((plant, begins));
    let below = |rest: &str| rest.is_empty() || rest.starts_with('.') || begins.ends_with('.');
    of == plant && key.strip_prefix(begins).is_some_and(below)
}

fn is_inert(key: &str) -> bool {
    WITHOUT_EFFECT.iter().any(|(name, _)| *name == key)
}

/// Tries every key of a file by itself in every context until an effect appears.
fn tried(plant: &'static str, text: &str) -> (BTreeMap<String, Found>, BTreeSet<String>) {
    let (mut found, mut faults) = (BTreeMap::<String, Found>::new(), BTreeSet::new());
    let contexts = CONTEXTS.iter().find(|(name, _)| *name == plant).expect("contexts of every file").1;
    let keys = keys(text);
    for context in contexts {
        let context: Vec<String> = context.iter().map(ToString::to_string).collect();
        let bare = made(text, &context).unwrap_or_else(|error| panic!("{plant}: {context:?}: {error}"));
        for key in &keys {
            let name = plain(&key.path);
            let entry = found.entry(name.clone()).or_default();
            let seen =
                if is_simulated(plant, &name) || is_inert(&name) { entry.is_changed } else { entry.changes_what_runs };
            if seen {
                continue;
            }
            for value in values(key).iter().filter(|value| !is_there(text, &context, &key.path, value)) {
                let Ok(after) = made(text, &[&context[..], &[format!("{}={value}", key.path)]].concat()) else {
                    continue;
                };
                entry.is_changed = true;
                entry.changes_what_runs |= after.fingerprint != bare.fingerprint;
                let wrong = compare((plant, text), &name, &bare, &after);
                faults.extend(wrong.iter().map(|what| format!("{plant}: {name}={value}: {what}")));
                break;
            }
        }
    }
    (found, faults)
}

#[test]
fn every_key_that_changes_what_is_exported_changes_what_it_is_known_by() {
    let (mut faults, mut keys) = (BTreeSet::new(), Vec::new());
    std::thread::scope(|scope| {
        let files = scenario::STARTS.map(|(plant, text)| (plant, scope.spawn(move || tried(plant, text))));
        for (plant, file) in files {
            let (found, wrong) = file.join().expect("no key of this file panics");
            keys.extend(found.keys().map(|key| (plant, key.clone())));
            faults.extend(wrong.into_iter().chain(judged(plant, &found)));
        }
    });
    assert!(faults.is_empty(), "{}", faults.into_iter().collect::<Vec<_>>().join("\n"));
    assert!(keys.len() > 200, "{} keys", keys.len());
    // Every list entry must be in use.
    for begins in SIMULATED {
        assert!(keys.iter().any(|(plant, key)| is_of(begins, plant, key)), "SIMULATED: {begins}");
    }
    for (name, _) in WITHOUT_EFFECT {
        assert!(keys.iter().any(|(_, key)| key == name), "WITHOUT_EFFECT: {name}");
    }
}

/// `--resume` accepts trials only with an equal text, equal settings and equal draws.
#[test]
fn trials_of_another_file_or_setting_are_not_taken_for_those_of_a_folder() {
    let folder = Folder::new("identity-trials");
    let (file, out) = (folder.path("mine.toml"), folder.path("trials"));
    let run = |more: &[&str]| {
        let trials = ["monte-carlo", &file, "--vary", "plant.b=uniform(1.8,2.2)", "--trials", "2", "--chunk", "1"];
        host_sim(&[&trials[..], &["--set", "span_s=0.2", "--set", "window_s=[0, 0.2]", "--out", &out], more].concat())
    };
    std::fs::write(&file, scenario::CHAIN).expect("room for a scenario");
    let said = run(&[]);
    assert_eq!(said.status, 0, "{said:?}");
    let said = run(&["--resume"]);
    assert_eq!(said.status, 0, "{said:?}");
    let said = run(&["--resume", "--set", "controller.k_l=21"]);
    assert!(said.status == 2 && said.err.contains("trials of another plan: its sets"), "{said:?}");
    let said = run(&["--resume", "--vary", "plant.x0[1]=uniform(0.1,0.2)"]);
    assert!(said.status == 2 && said.err.contains("trials of another plan: its vary"), "{said:?}");
    std::fs::write(&file, scenario::CHAIN.replace("k_l = 20.0", "k_l = 21.0")).expect("room for a scenario");
    let said = run(&["--resume"]);
    assert!(said.status == 2 && said.err.contains("the text of its scenario file differs"), "{said:?}");
}

/// Checks that every key belongs to one of the kinds, and that every list entry is in use.
fn judged(plant: &str, found: &BTreeMap<String, Found>) -> Vec<String> {
    let mut faults = Vec::new();
    for (key, Found { is_changed, changes_what_runs }) in found {
        let is_fixed = FIXED.iter().any(|(name, _)| *name == format!("{plant}: {key}"));
        if *is_changed == is_fixed {
            let what = if is_fixed { "can be changed alone: take it off FIXED" } else { "no value changes it alone" };
            faults.push(format!("{plant}: {key}: {what}"));
        }
        if *is_changed && !is_simulated(plant, key) && !is_inert(key) && !changes_what_runs {
            faults.push(format!("{plant}: {key}: changes nothing that runs"));
        }
    }
    let known = |name: &&str| found.contains_key(*name);
    let of_file = FIXED.iter().filter_map(|(name, _)| name.strip_prefix(plant)?.strip_prefix(": "));
    faults.extend(of_file.filter(|name| !known(name)).map(|name| format!("{plant}: {name}: there is no such key")));
    faults
}
