//! Compares the trace of the monitors with the monitors, and checks that numbers are written as they are read.

use controller_core::drive::{
    ALARMS, BRAKING, Encoder, FENCED, Monitored, Motor, MotorDesign, MotorDrive, Mounting, Position, Sample, Target,
};
use controller_core::{ControlLaw as _, Health, Limits, Words as _};
use tick_record::joined::Joined;
use tick_record::monitor::{monitor, state, ticks, watched};
use tick_record::{Id, Port, Role, ValueKind, Word, drive};

/// Compares the trace with the monitors themselves, around a law with given outputs.
#[test]
fn the_record_is_the_monitors() {
    let record = monitor::<1>(ALARMS);
    let numbers = |given: &[(&str, f32)]| {
        let inputs: Vec<Word<f32>> = record
            .inputs
            .iter()
            .map(|port| match given.iter().find(|(name, _)| *name == port.name) {
                Some((_, truth)) if port.kind == ValueKind::Truth => Word::Truth(*truth != 0.0),
                None if port.kind == ValueKind::Truth => Word::Truth(false),
                Some((_, number)) => Word::Number(*number),
                None => Word::Number(0.0),
            })
            .collect();
        record.run(&inputs)
    };
    let at = |name: &str| record.results.iter().position(|port| port.name == name).expect(name);
    // 5 A, and 2 rad/s² where 1 is allowed: the drive stops at 0.5 A.
    let beyond = [("law_u", 5.0), ("fallback", 0.5), ("d1", -2.0), ("d1_bound", 1.0), ("patience_ticks", 4.0)];
    let over = numbers(&[&beyond[..], &[("over", 4.0)]].concat());
    assert_eq!((over[at("u")].number(), over[at("stopped")].truth()), (0.5, true));
    // One tick of it is not enough.
    let once = numbers(&[&beyond[..], &[("over", 3.0)]].concat());
    assert_eq!((once[at("u")].number(), once[at("over")].number()), (5.0, 4.0));
    assert!(!once[at("disturbance_over_bound")].truth() && !once[at("stopped")].truth());
    assert!(over[at("disturbance_over_bound")].truth() && over[at("stopped_now")].truth());
    // Within the bound nothing happens.
    let calm = numbers(&[("law_u", 5.0), ("fallback", 0.5), ("d1", -0.5), ("d1_bound", 1.0)]);
    assert_eq!((calm[at("u")].number(), calm[at("stopped")].truth()), (5.0, false));
    // The third tick at a limit, where two are allowed.
    let stuck = [("law_saturated", 1.0), ("stuck", 2.0), ("stuck_ticks", 2.0), ("law_sigma", 1.0)];
    assert!(numbers(&stuck)[at("stuck_at_limit")].truth());
    assert_eq!(numbers(&stuck)[at("stuck")].number(), 3.0);
    // The third change of sign of d within 100 ticks of the first; each counts for 100.
    let swings = [("d1", 2.0), ("side1", -2.0), ("d1_bound", 1.0), ("stuck_ticks", 100.0), ("swings", 101.0)];
    let swung = numbers(&swings);
    assert!(swung[at("oscillates")].truth() && !swung[at("wrong_way")].truth());
    assert_eq!((swung[at("swings")].number(), swung[at("side1")].number()), (200.0, 2.0));
    // At the limit, and the shaft speeds up in the opposite direction by the effect of u.
    let speeding = |last| {
        let law = [("law_u", 1.0), ("law_saturated", 1.0), ("gain", 5.0), ("v", -2.0), ("last_speed", last)];
        numbers(&[&law[..], &[("d1", -10.0), ("d1_bound", 1.0), ("against", 6.0), ("wrong_way_ticks", 6.0)]].concat())
    };
    let reversed = speeding(1.0);
    assert!(reversed[at("wrong_way")].truth() && !reversed[at("oscillates")].truth());
    assert_eq!((reversed[at("against")].number(), reversed[at("last_speed")].number()), (7.0, 2.0));
    // It slows down again: a bounce.
    let bounced = speeding(3.0);
    assert_eq!((bounced[at("against")].number(), bounced[at("wrong_way")].truth()), (0.0, false));
}

/// Random ticks with any inputs, for a motor with low thresholds: every alarm and its reaction.
#[test]
fn a_joined_tick_is_that_of_the_drive_with_its_monitors() {
    let all = [BRAKING, ALARMS, Health::OK];
    let seen = all.map(the_joined_tick_is_that_of_the_drive).into_iter().fold(0, |all, seen| all | seen);
    // Its surroundings handle a fence and the rest band.
    assert_eq!(seen | FENCED.bits() | Health::HUNTS.bits(), Health::ALL, "every alarm was raised");
}

fn of_kind(port: &Port, bits: u32) -> Word<f32> {
    match port.kind {
        ValueKind::Number => Word::Number(f32::from_bits(bits)),
        ValueKind::Count => Word::Count(bits as i32),
        ValueKind::Truth => Word::Truth(bits == 1),
    }
}

/// Returns the flags seen for a drive that these alarms stop, besides the flags that always stop it.
fn the_joined_tick_is_that_of_the_drive(stops_at: Health) -> u16 {
    const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
    let stopping = stops_at == ALARMS;
    let (tick, functions) = (
        drive::motor_tick::<Position, 0, 0, 3>(&DESIGN, Mounting::UPRIGHT).expect("a design"),
        drive::motor::<Position, 0, 0, 3>(&DESIGN, Mounting::UPRIGHT).expect("a design"),
    );
    let of_drive = tick.inputs.iter().filter(|port| port.role == Role::State).cloned();
    let words: Vec<Port> = state(1).into_iter().chain(of_drive).collect();
    let mut joined = Joined::default();
    let before: Vec<(Port, Id)> =
        words.iter().map(|port| (port.clone(), joined.input(&port.name, port.role, port.kind))).collect();
    let results = watched(
        &mut joined,
        [&tick, &functions.not_started, &functions.limits, &monitor::<1>(stops_at)],
        &before,
        &[""],
    );
    let record = joined.record(results);

    let gain = MOTOR.input_gain() as f32;
    let thresholds = [
        ("d1_bound", if stopping { 4000.0 } else { 100.0 }),
        ("sigma_star_bound", 5.0),
        ("stuck_ticks", if stopping { 3.0 } else { 30.0 }),
        ("wrong_way_ticks", if stops_at.is_ok() { 4.0 } else { 0.5 }),
        ("patience_ticks", 1.0),
        ("brake_ticks", 2.0),
        ("brake", 0.3),
        ("gain", gain),
        ("per_gain", (1.0 / MOTOR.input_gain()) as f32),
        ("u_min", -10.0),
        ("u_max", 10.0),
        ("nominal_min", -10.0),
        ("nominal_max", 10.0),
    ];
    let threshold = |name: &str| thresholds.iter().find(|(known, _)| *known == name).expect("a threshold").1;
    let law = MotorDrive::<f32, Position>::design(&DESIGN);
    let (d, star, brake) = (threshold("d1_bound"), threshold("sigma_star_bound"), threshold("brake"));
    let law = Monitored::from_parts(law, [d], star, ticks(threshold), brake).stopping_at(stops_at);
    let mut random = 1_u32;
    let mut below = |end: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) % end
    };
    let (mut held, mut seen, mut stopped) = (None, 0, 0);
    let mut count = 0_i32;
    for _ in 0..20_000 {
        let step = [3, 40, 400, 16_384][below(20).saturating_sub(16) as usize];
        count = count.wrapping_add(below(2 * step + 1) as i32 - step as i32);
        let far = [1e-3, 1.0, 1e4, f32::NAN][below(40).saturating_sub(36) as usize];
        let target = |turn: u32, share: u32| Target { turn: turn as i32, jet: [far * share as f32 / 100.0, far] };
        let (begin, end) = (target(below(2), below(100)), target(below(2), below(100)));
        let sample = Sample { counts: [(below(8) > 0).then_some(count)], begin, end };
        let Some(state) = &mut held else {
            held = law.start(&sample);
            continue;
        };
        let inputs: Vec<u32> = state.words().collect();
        let word = |name: &str| words.iter().position(|port| port.name == name);
        let given = |port: &Port| match (port.role, port.name.as_str()) {
            (Role::State, name) => of_kind(port, inputs[word(name).expect("a word")]),
            (Role::Sample(_), _) => Word::Count(sample.counts[0].unwrap_or(7)),
            (_, "lost") => Word::Truth(sample.counts[0].is_none()),
            (_, "begin_turn") => Word::Count(begin.turn),
            (_, "end_turn") => Word::Count(end.turn),
            (_, "begin_r") => Word::Number(begin.jet[0]),
            (_, "begin_r_dot") => Word::Number(begin.jet[1]),
            (_, "end_r") => Word::Number(end.jet[0]),
            (_, "end_r_dot") => Word::Number(end.jet[1]),
            (_, name) => Word::Number(threshold(name)),
        };
        let found = record.run(&record.inputs.iter().map(given).collect::<Vec<_>>());
        let output = law.tick(state, &sample);
        let after: Vec<u32> = state.words().collect();
        for (port, found) in record.results.iter().zip(found) {
            let wanted = match port.role {
                Role::State => of_kind(port, after[word(&port.name).expect("a word")]),
                Role::Flag(bit) => Word::Truth(output.health.bits() >> bit & 1 == 1),
                _ if port.name == "u" => Word::Number(output.u),
                _ if port.name == "sigma" => Word::Number(output.sigma),
                _ => Word::Number(output.sigma_star),
            };
            let bits = |word: Word<f32>| match word {
                Word::Number(number) if number.is_nan() => f32::NAN.to_bits(),
                Word::Number(number) => number.to_bits(),
                Word::Count(count) => count as u32,
                Word::Truth(truth) => truth.into(),
            };
            assert_eq!(bits(found), bits(wanted), "{}", port.name);
        }
        seen |= output.health.bits();
        stopped += u32::from(output.health.contains(Health::STOPPED));
        if stopped % 4 == 3 {
            (held, stopped) = (None, 0);
        }
    }
    seen
}

#[test]
fn decimals_have_nine_digits_unless_fewer_are_exact() {
    for (number, text) in [
        (1.0, "1.0f"),
        (-0.1, "-1.00000001e-1f"),
        (0.0, "0.0f"),
        (-0.0, "-0.0f"),
        (1e12, "9.99999996e11f"),
        (f64::from(f32::MIN_POSITIVE), "1.17549435e-38f"),
        (f64::from(f32::from_bits(1)), "1.40129846e-45f"),
    ] {
        assert_eq!(tick_record::c::decimal(number, false), text);
    }
    assert_eq!(tick_record::c::decimal(0.1, true), "0.1");
}
