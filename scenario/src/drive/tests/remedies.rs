//! Tests the remedies of messages: the proposed values are accepted and have the stated effect.

use super::build;
use crate::{JOINT, MOTOR};

/// Texts after a number that a message only repeats.
const SAID: [&str; 12] = [
    " says more",
    " allows",
    " is not before",
    " is more than",
    " is as much",
    " is below",
    " follows",
    " needs it",
    " does not read",
    " is for a motor",
    ", and friction",
    " a joint is stable",
];

/// Returns the remedies of a message: each `TABLE.KEY = VALUE` in it, in groups that are joined by ` with `.
pub(super) fn remedies(message: &str) -> Vec<Vec<String>> {
    let mut groups: Vec<Vec<String>> = Vec::new();
    let mut last_end = 0;
    for (at, _) in message.match_indices(" = ") {
        let before = &message[..at];
        let start = before.rfind(|c: char| !(c.is_ascii_alphanumeric() || "_.[]".contains(c))).map_or(0, |it| it + 1);
        let end = at + 3 + value_length(&message[at + 3..]);
        let key = &before[start..];
        let is_number =
            message[end..].strip_prefix(" is ").is_some_and(|it| it.starts_with(|c: char| c.is_ascii_digit()));
        if !key.contains('.') || is_number || SAID.iter().any(|said| message[end..].starts_with(said)) {
            continue;
        }
        let set = format!("{key}={}", &message[at + 3..end]);
        let is_joined = start >= last_end && message[last_end..start] == *" with ";
        last_end = end;
        match groups.last_mut().filter(|_| is_joined) {
            Some(group) => group.push(set),
            None => groups.push(vec![set]),
        }
    }
    groups.extend(expected(message).map(|set| vec![set]));
    groups
}

/// Returns the upper end of an expected range, or the two expected numbers: ``KEY`: .., expected at most V`.
fn expected(message: &str) -> Option<String> {
    let key = message.split('`').nth(1)?;
    let text = message.split_once("expected ")?.1;
    let value = if let Some((_, value)) = text.split_once("at most ").filter(|(before, _)| !before.contains("ticks")) {
        value
    } else if let Some((_, value)) = text.split_once(" to ").filter(|(low, _)| low.parse::<f64>().is_ok()) {
        value
    } else if text.starts_with('[') {
        text
    } else {
        text.split_once("write ")?.1
    };
    Some(format!("{key}={}", &value[..value_length(value)]))
}

fn value_length(value: &str) -> usize {
    let length = match value.chars().next() {
        Some('[') => value.find(']').map_or(0, |it| it + 1),
        Some('"') => value[1..].find('"').map_or(0, |it| it + 2),
        _ => value.find(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c))).unwrap_or(value.len()),
    };
    value[..length].trim_end_matches('.').len()
}

/// Gear ratios of catalogues: planetary stages, products of stages, whole ratios, an increaser.
const GEARS: [[u64; 2]; 16] = [
    [20_000, 1],
    [30_000, 1],
    [10_301, 100],
    [4554, 325],
    [99_225, 1024],
    [3591, 187],
    [12_895_281, 34_969],
    [2401, 121],
    [2000, 2],
    [100_000, 1000],
    [3_000_000_000, 1_000_000_000],
    [160, 3],
    [1, 1],
    [1001, 1001],
    [1, 5000],
    [1_002_001, 1003],
];

#[test]
fn every_gear_is_taken_or_refused_with_the_nearest_and_its_cost() {
    let (mut taken, mut mended) = (0, 0);
    let encoders = [("MOTOR", "encoder"), ("JOINT", "encoder.motor")];
    for (plant, key) in encoders {
        let (text, table) = if plant == "MOTOR" { (MOTOR, "motor") } else { (JOINT, "joint") };
        for [a, b] in GEARS {
            // A data sheet with the output of the template, within whole numbers of the gear.
            let ratio = a as f64 / b as f64;
            let inertia = if plant == "MOTOR" { "inertia_kg_m2" } else { "motor_inertia_kg_m2" };
            let (inertia_0, torque_0) = if plant == "MOTOR" { (2e-4, 0.05) } else { (0.0628, 1.0) };
            let gear = format!("{table}.gear=[{a}, {b}]");
            let sheet = [
                format!("{table}.{inertia}={:e}", inertia_0 / ratio / ratio),
                format!("{table}.torque_n_m_per_a={:e}", torque_0 / ratio),
                format!("{table}.damping_n_m_s=0"),
            ];
            let sheet: Vec<&str> =
                sheet.iter().map(String::as_str).take(if plant == "MOTOR" { 3 } else { 2 }).collect();
            let counted = [
                vec!["bits=10".to_owned()],
                vec!["bits=14".to_owned()],
                vec!["bits=17".to_owned()],
                vec!["bits=20".to_owned()],
                vec!["bits=16".to_owned(), "counts_per_turn=4000".into(), "states=65536".into()],
                vec!["counts_per_turn=10000".to_owned(), "states=10000".into(), "bits=14".into()],
                vec!["counts_per_turn=16777215".to_owned(), "bits=32".into(), "offset_counts=-8".into()],
            ];
            for encoder in counted {
                let encoder: Vec<String> = encoder.iter().map(|it| format!("{key}.{it}")).collect();
                let mut sets = sheet.clone();
                sets.push(&gear);
                sets.extend(encoder.iter().map(String::as_str));
                let Err(messages) = build(text, &sets) else {
                    taken += 1;
                    continue;
                };
                // The drive may be rejected for another reason.
                let Some(message) = messages.lines().find(|line| line.contains("behind a gear of")) else { continue };
                let remedies = remedies(message);
                assert!(!remedies.is_empty() || message.contains("behind the gear"), "{sets:?}: {message}");
                if let Some((_, counts)) = message.split_once("take an encoder of ") {
                    let counts = counts.split_whitespace().next().expect("a number");
                    let counts = [format!("{key}.counts_per_turn={counts}"), format!("{key}.bits=32")];
                    let other: Vec<&str> = sets.iter().copied().chain(counts.iter().map(String::as_str)).collect();
                    let after = build(text, &other).err();
                    assert!(after.as_ref().is_none_or(|error| !error.contains("gear")), "{message}: {after:?}");
                    mended += 1;
                }
                for remedy in remedies {
                    let mended_sets: Vec<&str> =
                        sets.iter().copied().chain(remedy.iter().map(String::as_str)).collect();
                    let after = build(text, &mended_sets);
                    assert!(
                        after.as_ref().err().is_none_or(|error| !error.contains("gear")),
                        "{remedy:?} of {message}: {:?}",
                        after.err()
                    );
                    mended += 1;
                }
                // Behind the gear any ratio is accepted.
                let behind = format!("{key}.behind_gear=true");
                sets.push(&behind);
                assert!(build(text, &sets).err().is_none_or(|error| !error.contains("gear of")), "{sets:?}");
            }
        }
    }
    assert!(taken > 40 && mended > 40, "{taken} {mended}");
}

/// The error in the message is the angle error of the drive per revolution.
#[test]
fn the_nearest_gear_is_off_by_as_much_as_the_message_says() {
    let sets = ["motor.inertia_kg_m2=1e-8", "motor.torque_n_m_per_a=5e-4", "motor.gear=[10301, 100]"];
    let error = build(MOTOR, &sets).err().expect("14 bits do not fit");
    assert!(
        error.contains(
            "the nearest that fits is motor.gear = [10126295, 98304], off by 2.48e-8 rad in a turn of the output, \
             0.00667 counts of the encoder; or shift the lowest 2 bits of its counts away and set encoder.bits = 12"
        ),
        "{error}"
    );
    // All keys of the counter change with its bits, and only if they stay whole numbers.
    let sets = ["encoder={states = 10000, counts_per_turn = 10000, offset_counts = -48}", "motor.gear=[20000, 1]"];
    let error = build(MOTOR, &sets).err().expect("2e8 counts");
    let said = "shift the lowest 4 bits of its counts away and set encoder.states = 625 with encoder.counts_per_turn = \
                625 with encoder.offset_counts = -3";
    assert!(error.contains(said), "{error}");
    for (set, said) in [
        ("encoder.offset_counts=-4", "take an encoder of 838 counts in a turn, or one behind the gear"),
        ("motor.gear=[30000, 1]", "take an encoder of 559 counts in a turn, or one behind the gear"),
        ("motor.gear=[9000000, 1]", "take an encoder behind the gear"),
    ] {
        let error = build(MOTOR, &[&sets[..], &[set]].concat()).err().expect("too many counts");
        assert!(error.contains(said), "{error}");
    }
    for (text, set, said) in [
        (MOTOR, "motor.gear=[4.4, 1]", "expected a list of 2 whole numbers: write [22, 5]"),
        (JOINT, "joint.gear=[0.25, 1.5]", "expected a list of 2 whole numbers: write [1, 6]"),
    ] {
        let error = build(text, &[set]).err().expect("no whole numbers");
        assert!(error.contains(said), "{error}");
    }
    let sets = ["motor.inertia_kg_m2=1e-8", "motor.torque_n_m_per_a=5e-4"];
    let nearest = ["motor.gear=[10126295, 98304]"];
    let experiment = build(MOTOR, &[&sets[..], &nearest].concat()).expect("fits");
    let mounted = experiment.drive.expect("a drive").designed.encoders()[0].1;
    // A revolution of the true gear in counts, and the angle that the drive computes from them.
    let angle_rad = 16_384.0 * 103.01 * mounted.encoder.unit_rad();
    let off_rad = (angle_rad - std::f64::consts::TAU).abs();
    assert!((off_rad / 2.48e-8 - 1.0).abs() < 0.01, "{off_rad}");
    assert!((off_rad / mounted.encoder.unit_rad() / 0.00667 - 1.0).abs() < 0.01, "{off_rad}");
}

/// Returns the errors or the warnings of a file.
fn said(text: &str, sets: &[String]) -> Vec<String> {
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    match build(text, &sets) {
        Ok(experiment) => experiment.warnings,
        Err(error) => error.lines().map(|line| line[line.find('`').unwrap_or(0)..].to_owned()).collect(),
    }
}

/// Linear congruential generator.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    /// Returns a number with a uniform logarithm, in three digits.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        let share = self.below(1 << 30) as f64 / f64::from(1 << 30);
        format!("{:.2e}", low * (high / low).powf(share)).parse().expect("a number")
    }
}

/// Returns a key with a value that may be wrong.
fn bad_set(random: &mut Random, plant: &str) -> String {
    let encoder = if plant == "motor" { "encoder" } else { ["encoder.link", "encoder.motor"][random.below(2)] };
    let mut number = |low: f64, high: f64| random.between(low, high);
    let [a, b, c, d] = [number(0.01, 1e4), number(0.1, 1e3), number(1e-4, 1.0), number(1.0, 1e5)];
    let of_reference = [
        format!("{{kind = \"move\", to_rad = {a:?}}}"),
        format!("{{kind = \"move\", to_rad = {a:?}, duration_s = {c:?}}}"),
        format!("{{kind = \"sine\", amplitude_rad = {b:?}, frequency_hz = {:?}}}", number(0.1, 100.0)),
        format!(
            "{{kind = \"sine\", amplitude_rad = {b:?}, frequency_hz = {:?}, duration_s = {c:?}}}",
            number(0.1, 100.0)
        ),
        format!("{{kind = \"points\", points_rad = [0.0, {b:?}, 1.0, -{b:?}], every_s = {c:?}}}"),
        format!("{{kind = \"points\", points_rad = [0.0, {b:?}], every_s = {:?}}}", (c / 1e-3).ceil() * 1e-3),
        format!("{{kind = \"speed\", speed_rad_s = {d:?}}}"),
        format!("{{kind = \"speed\", speed_rad_s = {d:?}, duration_s = {c:?}}}"),
        format!(
            "{{kind = \"set_points\", points_rad = [{b:?}], max_speed_rad_s = {d:?}, max_acceleration_rad_s2 = {:?}}}",
            number(1.0, 1e9)
        ),
        format!(
            "{{kind = \"set_points\", points_rad = [{b:?}, 0.0], max_speed_rad_s = {d:?}, max_acceleration_rad_s2 = \
            {:?}, every_s = {c:?}, smooth_s = {:?}}}",
            number(1.0, 1e5),
            number(1e-3, 1.0)
        ),
    ];
    let of_both = [
        format!("drive.uncertain_percent={:?}", number(15.0, 3000.0)),
        format!("{plant}.supply_v={:?}", number(1.0, 100.0)),
        format!("{plant}.resistance_ohm={:?}", number(0.05, 20.0)),
        format!("{plant}.no_load_rad_s={:?}", number(10.0, 5000.0)),
        format!("{plant}.max_current_a={:?}", number(0.05, 50.0)),
        format!("drive.period_s={:?}", number(1e-5, 2e-2)),
        format!("{plant}.gear=[{}, {}]", 1 + number(1.0, 1e5) as u64, number(1.0, 2e3) as u64),
        format!("{encoder}.bits={}", number(2.0, 33.0) as u32),
        format!("{encoder}.states={}", number(4.0, 3e9) as u64),
        format!("{encoder}.counts_per_turn={}", number(4.0, 1.7e7) as u32),
        format!("friction.static_n_m={:?}", number(1e-3, 100.0)),
        format!("friction.coulomb_n_m={:?}", number(1e-3, 100.0)),
        format!("friction.smooth_rad_s={:?}", number(1e-5, 0.1)),
        format!("drive.jitter_s={c:?}"),
        format!("drive.surface_rad_s={d:?}"),
        format!("drive.reaching_per_s={d:?}"),
        format!("{plant}.start_rad={:?}", number(0.01, 10.0)),
        format!("{plant}.current_lag_s={:?}", number(1e-9, 0.1)),
        format!("drive.delay_ticks={}", number(1.0, 4.0) as u32),
        format!("drive.lost_ticks={:?}", number(1.0, 1e7)),
    ];
    let of_motor = [
        format!("motor.inertia_kg_m2={:?}", number(1e-7, 1.0)),
        format!("motor.inertia_kg_m2=[{:?}, {:?}]", number(1e-6, 1e-2), number(1e-6, 1e-2)),
        format!("motor.load_inertia_kg_m2={:?}", number(1e-7, 1.0)),
        "drive.observer_states=4".into(),
        format!("drive.observer_rad_s={d:?}"),
    ];
    match random.below(3) {
        0 => format!("reference={}", of_reference[random.below(of_reference.len())]),
        1 if plant == "motor" => of_motor[random.below(of_motor.len())].clone(),
        _ => of_both[random.below(of_both.len())].clone(),
    }
}

/// Files with one to three wrong values at random: after each remedy its message does not occur again.
#[test]
fn a_remedy_that_names_a_key_and_a_value_is_one() {
    let trials = if std::env::var("DEEP").is_ok() { 30_000 } else { 1500 };
    let mut tried = std::collections::BTreeMap::<String, u32>::new();
    let mut wrong = Vec::new();
    for seed in 0..trials {
        let mut random = Random(seed);
        random.below(1);
        let (text, plant) = if seed % 2 == 0 { (MOTOR, "motor") } else { (JOINT, "joint") };
        let sets: Vec<String> = (0..=random.below(3)).map(|_| bad_set(&mut random, plant)).collect();
        let before = said(text, &sets);
        for message in &before {
            for remedy in remedies(message) {
                // "instead of supply_v" replaces that key.
                let is_kept = |set: &&String| !(set.contains("supply_v") && message.contains("instead of supply_v"));
                let kept: Vec<String> = sets.iter().filter(is_kept).cloned().collect();
                let after = said(text, &[&kept[..], &remedy].concat());
                let keys: Vec<&str> = remedy.iter().filter_map(|set| set.split('=').next()).collect();
                let head = &message[..message.find(|c: char| c.is_ascii_digit()).unwrap_or(message.len())];
                let is_of_key =
                    |it: &&String| keys.iter().any(|key| it.starts_with(&format!("`{key}`"))) || it.starts_with(head);
                *tried.entry(head.to_owned()).or_default() += 1;
                if let Some(again) = after.iter().find(is_of_key) {
                    wrong.push(format!("seed {seed}, {sets:?}: {message}\n    {remedy:?}: {again}"));
                }
            }
        }
    }
    for (head, times) in &tried {
        println!("{times:5} {head}");
    }
    wrong.sort_by_key(|it| it.split("]: ").nth(1).map(str::to_owned));
    assert!(wrong.is_empty(), "{} of {tried:?}:\n{}", wrong.len(), wrong[..wrong.len().min(40)].join("\n"));
    assert!(tried.len() > 10, "{tried:?}");
}

/// 24 V drive 6 A through 4 ohm: no larger current is proposed, and the drive follows the proposed reference.
#[test]
fn a_supply_is_asked_for_no_more_current_than_it_drives() {
    let sine = "reference={kind = \"sine\", amplitude_rad = 8.0, frequency_hz = 20.0}";
    let supply = ["motor.supply_v=24", "motor.resistance_ohm=4", "motor.max_current_a=5"];
    let [told] = &said(MOTOR, &[&[sine][..], &supply].concat().map_owned())[..] else { panic!("one warning") };
    assert!(told.contains("of up to 100 s needs ") && told.contains(" of the 24 V of the supply: "), "{told}");
    let remedies = remedies(told);
    let [[remedy]] = &remedies.iter().map(Vec::as_slice).collect::<Vec<_>>()[..] else { panic!("{told}") };
    assert!(remedy.starts_with("reference.amplitude_rad="), "{told}");
    assert_eq!(said(MOTOR, &[&[sine][..], &supply, &[remedy]].concat().map_owned()), Vec::<String>::new());
    // The supply drives 26.46 A and 26.55 A are necessary, so the current is not a remedy. Nor is 1000 times the
    // current.
    let driven = ["reference.frequency_hz=10", "motor.supply_v=1000", "motor.resistance_ohm=37.8"];
    let far = ["reference={kind = \"sine\", amplitude_rad = 90.0, frequency_hz = 79.0}"];
    for (text, sets) in [(MOTOR, &driven[..]), (JOINT, &far)] {
        let told = said(text, &sets.to_vec().map_owned());
        let is_jump = told[0].starts_with("the reference starts with a step");
        let has_least = told[0].contains("of up to 100 s needs ");
        assert!(is_jump && !told[0].contains("max_current_a = ") && has_least, "{told:?}");
    }
    // Without a resistance, its default follows from the current limit, so a larger limit is a remedy.
    let no_load = ["motor.no_load_rad_s=20000", "motor.max_current_a=5"];
    let sine = "reference={kind = \"sine\", amplitude_rad = 0.5, frequency_hz = 20.0}";
    let [told] = &said(MOTOR, &[&[sine][..], &no_load].concat().map_owned())[..] else { panic!("one warning") };
    assert!(told.contains("motor.max_current_a = ") && told.contains("reference.amplitude_rad = "), "{told}");
}

/// For set-points only the limit that is too high is lowered.
#[test]
fn set_points_are_slowed_where_they_are_too_fast() {
    let with = |keys: &str, supply: &[&str]| {
        let reference = format!("reference={{kind = \"set_points\", points_rad = [200.0], {keys}}}");
        let sets: Vec<String> = supply.iter().map(ToString::to_string).chain([reference]).collect();
        let told = said(MOTOR, &sets);
        let [warning] = &told[..] else { panic!("{keys}: {told:?}") };
        let [remedy] = &remedies(warning)[..] else { panic!("{warning}") };
        assert_eq!(said(MOTOR, &[&sets[..], remedy].concat()), Vec::<String>::new(), "{remedy:?}");
        let keys: Vec<String> = remedy.iter().map(|set| set.split('=').next().unwrap_or("").to_owned()).collect();
        keys.join(" ")
    };
    let (acceleration, speed) = ("reference.max_acceleration_rad_s2", "reference.max_speed_rad_s");
    let supply = ["motor.no_load_rad_s=400"];
    assert_eq!(with("max_speed_rad_s = 100, max_acceleration_rad_s2 = 1e4", &[]), acceleration);
    assert_eq!(with("max_speed_rad_s = 450, max_acceleration_rad_s2 = 1000", &supply), speed);
    assert_eq!(
        with("max_speed_rad_s = 1500, max_acceleration_rad_s2 = 1e5", &supply),
        format!("{acceleration} {speed}")
    );
}

/// With a period of five digits, a time of four digits is not a whole number of ticks.
#[test]
fn points_are_slowed_to_whole_ticks() {
    let reference = "reference={kind = \"points\", points_rad = [0.0, 400.0, 0.0, 300.0], every_s = 0.12345}";
    let sets = [reference, "drive.period_s=1.2345e-4", "motor.no_load_rad_s=300"].to_vec().map_owned();
    let [warning] = &said(MOTOR, &sets)[..] else { panic!("one warning") };
    let [remedy] = &remedies(warning)[..] else { panic!("{warning}") };
    assert_eq!(said(MOTOR, &[&sets[..], remedy].concat()), Vec::<String>::new(), "{remedy:?}");
}

/// For every percentage the error proposes a valid range that contains the inertia of the data sheet.
#[test]
fn an_uncertainty_above_the_limit_is_answered_with_a_range_about_the_inertia() {
    for percent in [66.7, 80.0, 99.0, 100.0, 400.0, 1e6] {
        let told = said(MOTOR, &[format!("drive.uncertain_percent={percent:?}")]);
        assert!(told[0].ends_with("no such range: measure the inertia (docs/commissioning.md)"), "{told:?}");
    }
    for percent in [50.01, 55.0, 60.0, 66.6] {
        for more in [&[][..], &["motor.load_inertia_kg_m2=1e-3"], &["motor.gear=[7, 3]"]] {
            let percent = format!("drive.uncertain_percent={percent:?}");
            let sets = [&[percent.as_str()][..], more].concat().map_owned();
            let told = said(MOTOR, &sets);
            let remedies = remedies(&told.concat());
            let remedy = remedies.iter().find(|it| it.len() == 2).unwrap_or_else(|| panic!("{told:?}"));
            let [low, high]: [f64; 2] = {
                let (_, range) = remedy[0].split_once('[').expect("a range");
                let ends: Vec<f64> = range.trim_end_matches(']').split(", ").filter_map(|it| it.parse().ok()).collect();
                ends.try_into().expect("two ends")
            };
            let nominal = if more.iter().any(|it| it.contains("load")) { 1e-3 } else { 2e-4 };
            assert!(low < 0.7 * nominal && high > 1.4 * nominal, "{told:?}");
            let after = build(MOTOR, &[&sets[..], remedy].concat().iter().map(String::as_str).collect::<Vec<_>>());
            assert!(after.is_ok(), "{remedy:?}: {:?}", after.err());
        }
    }
    // Without an inertia no range is proposed.
    let unknown = MOTOR.replace("inertia_kg_m2 = ", "# inertia_kg_m2 = ");
    let told = said(&unknown, &["drive.uncertain_percent=80".to_owned()]);
    assert!(told.len() == 2 && told.iter().all(|it| !it.contains("for an inertia between")), "{told:?}");
}

/// Points and set-points give the same message for times that are not whole ticks.
#[test]
fn times_of_a_reference_are_whole_ticks_for_every_kind() {
    let limits = "max_speed_rad_s = 9.0, max_acceleration_rad_s2 = 90.0";
    for (period, every, nearest) in
        [("1e-3", "0.0104", "0.01"), ("3.7e-4", "0.01", "0.00999"), ("1e-3", "1e-5", "0.001")]
    {
        let period = format!("drive.period_s={period}");
        let said = |keys: &str| {
            let reference = format!("reference={{{keys}, points_rad = [0.0, 0.1], every_s = {every}}}");
            said(MOTOR, &[period.clone(), reference])
        };
        let points = said("kind = \"points\"");
        assert!(points[0].contains(&format!("the nearest is reference.every_s = {nearest}")), "{points:?}");
        let set_points = said(&format!("kind = \"set_points\", {limits}"));
        let cut = |told: &[String]| told[0].split(", at most").next().map(str::to_owned);
        assert_eq!(cut(&points), cut(&set_points));
    }
}

trait MapOwned {
    fn map_owned(self) -> Vec<String>;
}

impl MapOwned for Vec<&str> {
    fn map_owned(self) -> Vec<String> {
        self.into_iter().map(str::to_owned).collect()
    }
}
