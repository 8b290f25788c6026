//! Remedies of messages, tried: what a message says to write is accepted, and does what the message says.

use super::build;
use crate::{JOINT, MOTOR};

/// What a message says to write: each `TABLE.KEY = VALUE` in it, in groups that are joined by ` with `.
fn remedies(message: &str) -> Vec<Vec<String>> {
    let mut groups: Vec<Vec<String>> = Vec::new();
    let mut last_end = 0;
    for (at, _) in message.match_indices(" = ") {
        let before = &message[..at];
        let start = before.rfind(|c: char| !(c.is_ascii_alphanumeric() || "_.[]".contains(c))).map_or(0, |it| it + 1);
        let value = &message[at + 3..];
        let end = match value.chars().next() {
            Some('[') => value.find(']').map_or(0, |it| it + 1),
            Some('"') => value[1..].find('"').map_or(0, |it| it + 2),
            _ => value.find(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c))).unwrap_or(value.len()),
        };
        let set = format!("{}={}", &before[start..], value[..end].trim_end_matches('.'));
        let is_joined = start >= last_end && message[last_end..start] == *" with ";
        last_end = at + 3 + end;
        match groups.last_mut().filter(|_| is_joined) {
            Some(group) => group.push(set),
            None => groups.push(vec![set]),
        }
    }
    groups
}

/// Gear boxes of catalogues: planetary stages, products of stages, whole ratios, an increaser.
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
            // A data sheet whose output is that of the plain file, as far as whole numbers of the gear go.
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
                let Err(message) = build(text, &sets) else {
                    taken += 1;
                    continue;
                };
                let is_of_gear = message.contains("behind a gear of");
                if !is_of_gear {
                    // The drive is refused for another reason: what a gear makes of counter or design.
                    continue;
                }
                let remedies = remedies(message.rsplit_once(": ").expect("a remedy").1);
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
                // Behind the gear any ratio is taken.
                let behind = format!("{key}.behind_gear=true");
                sets.push(&behind);
                assert!(build(text, &sets).err().is_none_or(|error| !error.contains("gear of")), "{sets:?}");
            }
        }
    }
    assert!(taken > 40 && mended > 40, "{taken} {mended}");
}

/// The cost in the message is the angle that the drive gains in a turn.
#[test]
fn the_nearest_gear_is_off_by_as_much_as_the_message_says() {
    let sets = ["motor.inertia_kg_m2=1e-8", "motor.torque_n_m_per_a=5e-4", "motor.gear=[10301, 100]"];
    let error = build(MOTOR, &sets).err().expect("14 bits do not fit");
    assert!(
        error.contains(
            "the nearest that fits is motor.gear = [10126295, 98304], off by 2.48e-8 rad in a turn of the output, \
             0.00667 counts of the encoder; or shift the lowest 2 bits of its counts away and say encoder.bits = 12"
        ),
        "{error}"
    );
    // All keys of the counter follow its bits, and only where whole numbers are left of them.
    let sets = ["encoder={states = 10000, counts_per_turn = 10000, offset_counts = -48}", "motor.gear=[20000, 1]"];
    let error = build(MOTOR, &sets).err().expect("2e8 counts");
    let said = "shift the lowest 4 bits of its counts away and say encoder.states = 625 with encoder.counts_per_turn = \
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
    // A turn of the true gear, in counts, and the angle that the drive makes of them.
    let angle_rad = 16_384.0 * 103.01 * mounted.encoder.unit_rad();
    let off_rad = (angle_rad - std::f64::consts::TAU).abs();
    assert!((off_rad / 2.48e-8 - 1.0).abs() < 0.01, "{off_rad}");
    assert!((off_rad / mounted.encoder.unit_rad() / 0.00667 - 1.0).abs() < 0.01, "{off_rad}");
}
