//! Tests of the keys of drive scenarios and of their errors.

#![allow(clippy::disallowed_methods, reason = "expected values come from another implementation")]

use std::ops::ControlFlow;

use controller_core::Health;
use controller_core::drive::ALARMS;
use loop_sim::port::drive::{DriveDesign, DriveOf};
use loop_sim::trace::Trace;

use crate::{Experiment, JOINT, MOTOR, Source, parse};

mod play;
mod remedies;

fn build(text: &str, sets: &[&str]) -> Result<Experiment, String> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    parse(&Source { file: "a.toml", text, sets: &sets }, "a").map_err(|error| error.to_string())
}

fn ran(text: &str, sets: &[&str]) -> (Experiment, Trace) {
    let mut experiment = build(text, sets).unwrap_or_else(|error| panic!("{error}"));
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    (experiment, trace)
}

fn held(trace: &Trace) -> Vec<f64> {
    trace.rows.iter().map(|row| row.u_held).collect()
}

#[test]
fn each_mistake_is_told_at_its_place_with_what_would_be_right() {
    let cases: [(&str, &str, &str); 33] = [
        (MOTOR, "monitor.stop_s=1", "`monitor.stop_s`: only for reaction = \"joined_stop\""),
        (MOTOR, "monitor.motor_n_m=1", "`monitor.motor_n_m`: only for a joint: a motor has load_n_m"),
        (MOTOR, "motor.inertia=1", "unknown key `motor.inertia`; did you mean `inertia_kg_m2`?"),
        (MOTOR, "motor.max_current_a=0", "`motor.max_current_a`: found 0, expected a finite number above 0"),
        (MOTOR, "drive.jitter_s=2e-3", "`drive.jitter_s`: found 0.002, expected at most 0.001, the period"),
        (JOINT, "encoder.noise_rad=1e-4", "unknown key `encoder.noise_rad`"),
        (MOTOR, "reference.to_rad=1", "`reference.to_rad`: reference.kind = \"sine\" does not read it"),
        (MOTOR, "drive.mode=speed", "`reference.kind`: drive.mode = \"speed\" follows reference.kind = \"speed\" only"),
        (MOTOR, "reference.frequency_hz=500", "`reference.frequency_hz`: expected at most 79 at this period"),
        (
            MOTOR,
            "motor.start_rad=4",
            "`encoder`: the run starts at 4.0000 rad, but the counter of 16384 states covers only 3.1416 rad on each \
             side of 0",
        ),
        (MOTOR, "encoder.bits=30", "`encoder.counts_per_turn`: missing: required if the counter has over 24 bits"),
        (
            MOTOR,
            "drive.period_s=0.02",
            "`drive.period_s`: the period of a drive is 20 us to 10 ms (given 0.02, allowed 2e-5 to 0.01): if the bus \
             is slower, run this loop on the drive and send it set-points",
        ),
        (
            MOTOR,
            "drive.surface_rad_s=700",
            "`drive.surface_rad_s`: 700 rad/s, must be at most 500 rad/s at period_s = 0.001 (w_c times period is up \
             to 0.5): lower it, or take drive.period_s = ",
        ),
        (
            MOTOR,
            "reference={kind = \"points\", points_rad = [0, 1], every_s = 1e300}",
            "`reference.every_s`: found 1e303 ticks, expected a whole number of ticks, at most 134217.728 s",
        ),
        (MOTOR, "fault[1].kind=jump", "`fault[1].at_s`: missing: the start of the fault, s"),
        (MOTOR, "fault[1]={kind = \"jump\", at_s = 1}", "`fault[1].counts`: missing: the offset of the count"),
        (
            MOTOR,
            "fault[1]={kind = \"lost\", at_s = 1, encoder = \"link\"}",
            "`fault[1].encoder`: a motor has one encoder: leave it out",
        ),
        (MOTOR, "load[1].kind=step", "`load[1].amplitude`: missing: a \"step\" term needs it"),
        (MOTOR, "joint.gear=[1,1]", "a file has a table `motor` or a table `joint`, not both"),
        (MOTOR, "plant.order=2", "unknown key `plant`; expected one of drive, encoder, error, "),
        (
            JOINT,
            "encoder.link.behind_gear=true",
            "`encoder.link.behind_gear`: the encoder on the link is always behind the gear: leave it out",
        ),
        (JOINT, "motor.inertia_kg_m2=1", "--set motor.inertia_kg_m2=1: a file has a table `motor` or a table `joint`"),
        (
            JOINT,
            "joint.gear=[10,3]",
            "`joint.gear`: 1048576 counts in a turn of the encoder behind a gear of [10, 3] are 10485760/3 in a turn \
             of the link, but a joint needs a whole number, because the law uses the sine of the angle: the nearest \
             that fits is joint.gear = [3495253, 1048576], off by 5.99e-7 rad in a turn of the output, 0.333 counts \
             of the encoder",
        ),
        (JOINT, "drive.mode=speed", "unknown key `drive.mode`"),
        (
            JOINT,
            "joint.gear=[101,1]",
            "`encoder.motor.bits`: 1048576 counts in a turn of the encoder behind a gear of [101, 1] are 105906176 \
             before they meet again, but a drive counts at most 2^24 = 16777216: shift the lowest 3 bits of its counts \
             away and set encoder.motor.bits = 17",
        ),
        (
            MOTOR,
            "encoder.offset_counts=99999999999",
            "`encoder.offset_counts`: found 99999999999, expected a whole number at least -2147483648 and at most \
             2147483647",
        ),
        (MOTOR, "motor.gear=3", "`motor.gear`: found 3, expected a list of 2 whole numbers"),
        (MOTOR, "encoder.bits=14.0", "found 14.0, expected a whole number at least 2 and at most 32: write 14"),
        (
            MOTOR,
            "drive.lost_ticks=1e3",
            "found 1000.0, expected a whole number at least 1 and at most 1000000: write 1000",
        ),
        (
            MOTOR,
            "motor.inertia_kg_m2=1e-30",
            "`motor.inertia_kg_m2`: outside the supported range (given 1e-30, allowed 1e-12 to 1000000000)",
        ),
        // A field of the design that is not a key.
        (MOTOR, "motor.inertia_kg_m2=1e6", "`motor`: no design is possible for these numbers ("),
        (MOTOR, "motor.current_lag_s=1e-9", "`motor.current_lag_s`: found 1e-9, less than a thousandth of the period"),
        (
            MOTOR,
            "reference.kind=rest",
            "does not read it: leave it out, or replace the table: --set 'reference={kind = \"rest\"}'",
        ),
    ];
    for (text, set, expected) in cases {
        let told = build(text, &[set]).err().unwrap_or_else(|| panic!("{set} is taken"));
        assert!(told.contains(expected), "{set}: {told}");
        assert_eq!(told.lines().count(), 1, "{told}");
    }
}

#[test]
fn a_period_that_no_drive_has_and_a_friction_that_nobody_turns_are_told_with_what_there_is() {
    let cases = [
        (
            MOTOR,
            "encoder.states=10000",
            "`encoder.counts_per_turn`: missing: a counter of 10000 states does not wrap after 2^bits; set \
             encoder.counts_per_turn = 10000",
        ),
        (MOTOR, "drive.period_s=1", "`drive.period_s`: the period of a drive is 20 us to 10 ms (given 1, allowed"),
        (
            JOINT,
            "drive.period_s=5e-3",
            "`drive.period_s`: found 0.005, too long for the bandwidths of this design (the link's observer times \
             period is 3 w_c T to 0.25): take drive.period_s = 0.00266 or less",
        ),
        (
            MOTOR,
            "friction={coulomb_n_m = 5, model = \"faded\"}",
            "`friction.coulomb_n_m`: found 5, more than the largest motor torque of 0.5 N m, and so steep about rest",
        ),
        (
            MOTOR,
            "friction={static_n_m = 9, smooth_rad_s = 0.005}",
            "`friction.static_n_m`: found 9, more than the largest motor torque of 0.5 N m",
        ),
        (
            JOINT,
            "friction={coulomb_n_m = 0.1, model = \"holds\", smooth_rad_s = 0.005}",
            "`friction.smooth_rad_s`: friction that holds has no fading speed: leave it out, or take",
        ),
    ];
    for (text, set, expected) in cases {
        let told = build(text, &[set]).err().unwrap_or_else(|| panic!("{set} is taken"));
        assert!(told.contains(expected) && told.lines().count() == 1, "{set}: {told}");
    }
    assert!(build(JOINT, &["drive.period_s=0.00266"]).is_ok());
}

#[test]
fn all_mistakes_of_a_file_are_told_at_once() {
    let text = "span_s = 1\n[motor]\ninertia_kg_m2 = 1e-4\n[reference]\nkind = \"move\"\n\
                [[fault]]\nat_s = 0.1\n[[load]]\nkind = \"ramp\"\namplitude = 1\n";
    let told = build(text, &[]).err().expect("much is missing");
    let expected = [
        "a.toml:2:1: `motor.max_current_a`: missing: the current limit",
        "a.toml:2:1: `motor.torque_n_m_per_a`: missing: the torque constant",
        "a.toml:4:1: `reference.to_rad`: missing: reference.kind = \"move\" needs it",
        "a.toml:6:1: `fault[1].kind`: missing: stuck, jump, lost, derated or missed",
        "a.toml:10:13: `load[1].amplitude`: a \"ramp\" term has no such key; it has slope",
    ];
    for line in expected {
        assert!(told.lines().any(|found| found == line), "{line}\n{told}");
    }
    assert!(told.contains("`encoder.bits`: missing: the bits of the counter"), "{told}");
    assert_eq!(told.lines().count(), 6, "{told}");
}

/// Invalid values are reported together with broken rules of other keys.
#[test]
fn a_wrong_value_hides_no_other_mistake() {
    let text = "settling_band = 0.0\n[motor]\ninertia_kg_m2 = -1\ntorque = 1\nmax_current_a = 10\n[encoder]\n\
                bits = 12\n[reference]\nkind = \"sine\"\nto_rad = 3\n[monitor]\nmotor_n_m = 1\n[[load]]\n\
                kind = \"step\"\n";
    let told = build(text, &[]).err().expect("much is wrong");
    let expected = [
        "a.toml:1:17: `settling_band`: found 0.0, expected a finite number above 0",
        "a.toml:3:17: `motor.inertia_kg_m2`: found -1, expected a finite number above 0",
        "a.toml:4:1: unknown key `motor.torque`; did you mean `torque_n_m_per_a`?",
        "a.toml:10:10: `reference.to_rad`: reference.kind = \"sine\" does not read it",
        "a.toml:12:13: `monitor.motor_n_m`: only for a joint: a motor has load_n_m",
        "a.toml:13:1: `load[1].amplitude`: missing: a \"step\" term needs it",
    ];
    assert_eq!(told.lines().collect::<Vec<_>>(), expected);
    // A wrong key that other rules depend on is reported alone.
    let told = build(MOTOR, &["reference.kind=sin", "reference.to_rad=1"]).err().expect("no such kind");
    assert!(told.lines().count() == 1 && told.contains("found \"sin\""), "{told}");
}

/// Keys without effect and incompatible keys give warnings.
#[test]
fn a_file_that_says_what_cannot_matter_is_warned_of() {
    let warned = |text: &str, sets: &[&str]| build(text, sets).unwrap_or_else(|error| panic!("{error}")).warnings;
    assert_eq!((warned(MOTOR, &[]), warned(JOINT, &[])), (vec![], vec![]));
    for (text, sets, expected) in [
        (MOTOR, &["fault=[{kind = \"stuck\", at_s = 1e9}]"][..], "fault[1].at_s = 1000000000 is not before the end"),
        (MOTOR, &["reference.start_s=2.0"], "reference.start_s = 2 is not before the end of the run, span_s = 2"),
        (
            JOINT,
            &["span_s=1.5"],
            "load[1].t0_s = 2 is not before the end of the run, span_s = 1.5: the load step never occurs",
        ),
        (MOTOR, &["drive.observer_states=4", "drive.uncertain_percent=50"], "is for a motor known to 20 %"),
        (JOINT, &["drive.delay_ticks=1", "drive.uncertain_percent=50"], "a joint is stable within 20 %"),
        (
            JOINT,
            &["drive.delay_ticks=3", "drive.uncertain_percent=50"],
            "with drive.delay_ticks = 3 a joint is stable within 20 %",
        ),
        (
            MOTOR,
            &["friction.coulomb_n_m=0.6", "friction.static_n_m=0.6"],
            "friction.coulomb_n_m = 0.6 is as much as the largest motor torque, 0.5 N m, or more",
        ),
        (MOTOR, &["friction.static_n_m=0.001"], "take friction.static_n_m = 0.005, or leave it out"),
        (JOINT, &["joint.max_current_a=3", "drive.sudden_load_n_m=0.3", "friction={}"], "the reference needs up to"),
        (
            JOINT,
            &["joint.max_current_a=2", "drive.sudden_load_n_m=0.2", "reference={kind = \"move\", to_rad = 1}"],
            "the reference starts with a step: no transition stays within 1.2 A",
        ),
        (JOINT, &["drive.sudden_load_n_m=1e9"], "times the largest motor torque: innovation gates this wide"),
        (MOTOR, &["monitor.load_n_m=5"], "monitor.load_n_m = 5 is 10 times the largest motor torque: a jam"),
        (JOINT, &["monitor.motor_n_m=500"], "monitor.motor_n_m = 500 is"),
        (JOINT, &["drive.margin=1.5"], "drive.margin has no effect on a joint with one observer per encoder"),
    ] {
        let warnings = warned(text, sets);
        assert!(warnings.len() == 1 && warnings[0].contains(expected), "{sets:?}: {warnings:?}");
    }
    for sets in [&["drive.observer_states=4"][..], &["drive.delay_ticks=1"], &["error.reversed=true"]] {
        assert_eq!(warned(MOTOR, sets), Vec::<String>::new());
    }
}

/// A joint with one encoder is rejected, for a spring of 9 N m/rad and for one behind a gear of 100.
#[test]
fn a_joint_with_one_encoder_is_told_what_nobody_sees_and_what_may_take_its_place() {
    let without = |key: &str| {
        let (begin, rest) = JOINT.split_once(&format!("[encoder.{key}]")).expect("the table");
        let end = rest.find("\n[").expect("another table");
        [begin, &rest[end..]].concat()
    };
    let geared = ["joint.gear=[100, 1]", "joint.motor_inertia_kg_m2=1.2e-4", "joint.stiffness_n_m=8000"];
    for (key, sets, told) in [
        ("link", &[][..], ["link on the spring, at 6 rad/s", "inertia_kg_m2 = 2.309e-1"]),
        ("motor", &[], ["motor on the spring, at 99 rad/s", "2.309e-1, its encoder with behind_gear = true"]),
        ("motor", &geared, ["motor on the spring, at 204 rad/s", "inertia_kg_m2 = 1.430e-4"]),
    ] {
        let error = build(&without(key), sets).err().expect(key);
        assert!(error.contains(&format!("`encoder.{key}`: missing: the drive of a joint needs")), "{error}");
        assert!(told.iter().all(|told| error.contains(told)), "{key}: {error}");
    }
}

/// With the finest encoder no finer one is possible for comparison, so there is no noise in motion.
#[test]
fn the_finest_encoder_has_noise_at_rest_only() {
    let noise = |bits: &str| {
        let (mut experiment, trace) = ran(MOTOR, &[bits, "reference={kind = \"move\", to_rad = 0.5}", "span_s=1.0"]);
        experiment.noise(&trace).expect("no faults")
    };
    let [coarse, fine, finest] = ["encoder.bits=22", "encoder.bits=23", "encoder.bits=24"].map(noise);
    assert!(coarse.moving > 0.0 && fine.moving > 0.0, "{coarse:?} {fine:?}");
    assert!(finest.moving.is_nan() && finest.at_rest.is_finite(), "{finest:?}");
}

/// A reduction of 8 with the encoder on the motor equals a motor with 64 times the inertia, 8 times the torque constant
/// and 8 times the counts. The factors are powers of two, so that no bit differs.
#[test]
fn a_gear_makes_another_motor_of_it() {
    let geared = ["motor.gear=[8, 1]", "motor.inertia_kg_m2=3.125e-6", "motor.torque_n_m_per_a=0.00625"];
    let geared = [&geared[..], &["motor.damping_n_m_s=0", "encoder.bits=11", "friction.cogging_n_m=0"]].concat();
    let direct =
        ["motor.damping_n_m_s=0", "encoder.counts_per_turn=16384", "encoder.bits=11", "friction.cogging_n_m=0"];
    let unreduced = [&["motor.gear=[24000, 3000]"], &geared[1..]].concat();
    let [geared, direct, unreduced] = [&geared[..], &direct, &unreduced].map(|sets| held(&ran(MOTOR, sets).1));
    assert_eq!(geared, direct);
    assert_eq!(geared, unreduced);
    // 7 cogging periods per motor revolution are 56 per output revolution.
    let [far, near] = [("motor.gear=[8, 1]", 7), ("motor.gear=[1, 1]", 56)].map(|(gear, periods)| {
        let periods = format!("friction.cogging_per_turn={periods}");
        let (experiment, _) = ran(MOTOR, &[gear, &periods, "encoder.behind_gear=true", "span_s=0.1"]);
        let (mut d, x) = ([0.0; 3], [0.1, 50.0, 0.0]);
        experiment.plant.lumped(0.0, &x, 0.0, &mut d);
        d[1] * experiment.drive.expect("a drive").shafts[0].inertia_kg_m2
    });
    assert!((far - near).abs() < 1e-12 && near.abs() > 1e-3, "{far} {near}");
}

#[test]
fn sign_and_offset_of_an_encoder_are_nobody_s_business() {
    let plain = held(&ran(MOTOR, &[]).1);
    let other = held(&ran(MOTOR, &["encoder.offset_counts=9000"]).1);
    assert_eq!(plain, other);
    let (_, reversed) = ran(MOTOR, &["encoder.reversed=true"]);
    assert_eq!(plain, held(&reversed));
}

#[test]
fn a_true_motor_that_is_not_its_data_sheet_is_another_run() {
    let peak = |set: &str| {
        let (experiment, trace) = ran(MOTOR, &[set]);
        experiment.metrics(&trace).y_ultimate
    };
    let [plain, weak, heavy] = ["span_s=2.0", "error.torque_percent=-20", "error.inertia_percent=20"].map(peak);
    assert!(weak != plain && heavy != plain && weak.max(heavy) < 2.0 * plain, "{plain} {weak} {heavy}");
    assert!(build(MOTOR, &["error.inertia_percent=-100"]).is_err());
}

#[test]
fn above_20_percent_there_is_one_gain_set() {
    let headline = |set: &str| build(MOTOR, &[set]).unwrap_or_else(|error| panic!("{error}")).headline();
    assert!(headline("drive.uncertain_percent=20").contains("2 gain sets"));
    assert!(headline("drive.uncertain_percent=20.1").contains("1 gain set,"));
}

/// With 0.9 times 10 A on 2e-4 kg m² the peak acceleration is 10/√3 D/τ². A tolerance of 20 % in both parameters gives
/// 0.8/1.2 of it. The damping B is negligible.
#[test]
fn a_move_is_as_short_as_the_limit_allows() {
    let sets = [
        "reference={kind = \"move\", to_rad = 1.0, start_s = 0.1}",
        "span_s=0.5",
        "friction={}",
        "settling_band=1e-3",
        "motor.current_lag_s=0",
    ];
    let (experiment, trace) = ran(MOTOR, &sets);
    let tau = (10.0 / 3.0_f64.sqrt() / (0.6 * 2500.0)).sqrt();
    let moves = trace.rows.windows(2).filter(|pair| pair[0].r != pair[1].r).count();
    assert!((moves as f64 * 1e-3 - tau).abs() < 3e-3, "{moves} ticks for {tau} s");
    let peak = experiment.metrics(&trace).u_peak;
    assert!((5.5..=6.5).contains(&peak), "{peak}");
    let arrived = experiment.tracking(&trace).and_then(|tracking| tracking.arrival_s).expect("it arrives");
    assert!((0.1 + 0.8 * tau..0.1 + 1.2 * tau).contains(&arrived), "{arrived}");
    assert_eq!(experiment.warnings, Vec::<String>::new());
}

#[test]
fn a_reference_beyond_the_limit_is_warned_of() {
    let told = |sets: &[&str]| build(MOTOR, sets).unwrap_or_else(|error| panic!("{error}")).warnings.join("\n");
    let fast = told(&["reference.frequency_hz=10"]);
    // 1 rad at 10 Hz: (2π 10)² / 250 A. The proposed current is enough.
    assert!(
        fast.contains("of up to 100 s needs 15.77 A: motor.max_current_a = 26.55 is enough, or reference.amp"),
        "{fast}"
    );
    assert_eq!(told(&["reference.frequency_hz=10", "motor.max_current_a=26.55"]), "");
    let jump = told(&["reference={kind = \"move\", to_rad = 1, duration_s = 0.02}"]);
    let told_longer = "the limit is 10 A: the drive will not follow it; reference.duration_s = 0.063 is";
    assert!(jump.contains(told_longer), "{jump}");
    assert_eq!(told(&["reference={kind = \"move\", to_rad = 1, duration_s = 0.063}"]), "");
    assert_eq!(told(&[]), "");
    let spinning =
        told(&["reference={kind = \"speed\", speed_rad_s = 4000, duration_s = 1}", "motor.max_current_a=100"]);
    assert!(spinning.contains("covers 6.283 rad, and the shaft moves 4.000 rad in a tick"), "{spinning}");
}

#[test]
fn a_speed_loop_follows_the_speed_and_a_position_loop_keeps_step() {
    let reference = "reference={kind = \"speed\", speed_rad_s = 20, start_s = 0.05}";
    let load = "load=[{kind = \"step\", amplitude = 0.1, t0_s = 1}]";
    let (speed, trace) = ran(MOTOR, &[reference, load, "drive.mode=speed"]);
    assert_eq!((trace.follows, speed.output_unit), (Some(1), "rad/s"));
    let last = trace.rows.last().expect("rows");
    assert!((last.x[1] - 20.0).abs() < 0.2 && last.r == 20.0 || (last.r - 20.0).abs() < 1e-5, "{last:?}");
    let (step, trace) = ran(MOTOR, &[reference, load]);
    assert_eq!((trace.follows, step.output_unit), (Some(0), "rad"));
    let last = trace.rows.last().expect("rows");
    assert!(last.r > 38.0 && (last.x[0] - last.r).abs() < 5e-3, "{last:?}");
}

/// At constant speed the random part of the angle is white: noise of 10 counts rms, or ages up to 0.1 ms at 20 rad/s,
/// 20e-4/sqrt(12) rad. The current noise grows by the same factor over quantisation alone, with jitter by more, because
/// the mean angle is late.
#[test]
fn noise_and_jitter_of_an_encoder_are_told_as_noise_of_u_beside_its_steps() {
    let turning = [
        "reference={kind = \"speed\", speed_rad_s = 20}",
        "drive.gain_sets=1",
        // The rule lowers the bandwidth for more noise.
        "drive.surface_rad_s=125",
        "friction={}",
        "span_s=3",
    ];
    let told = |more: &[&str]| {
        let (mut experiment, trace) = ran(MOTOR, &[&turning[..], more].concat());
        experiment.noise(&trace).expect("no faults").moving
    };
    let step = std::f64::consts::TAU / 16384.0;
    let noise = format!("encoder.noise_rad={:?}", 10.0 * step);
    for (set, times) in [
        (noise.as_str(), f64::sqrt(1.0 + 12.0 * 100.0)),
        ("drive.jitter_s=1e-4", f64::sqrt(1.0 + (20e-4 / step).powi(2))),
    ] {
        let found = told(&[set]) / told(&[]);
        // The quantisation at constant speed is not quite white.
        let most = if set == noise { 1.15 } else { 2.0 };
        assert!((0.85 * times..most * times).contains(&found), "{set}: {found} times, expected {times}");
    }
    // The loop at rest has the noise too, converted to the output side of the gear.
    let geared = build(MOTOR, &["motor.gear=[8, 1]", "encoder.noise_rad=0.8"]).expect("a motor");
    let rms = geared.at_rest.expect("a loop").sensed[0].rms;
    assert!((rms / 0.1 - 1.0).abs() < 1e-6, "{rms}");
}

/// With an innovation gate of 4.3 deviations of the noise a joint lost 700 counts of 16 000, with 8.6 none.
#[test]
fn noise_that_the_gate_of_an_encoder_takes_for_faults_is_told() {
    let warned = |deviations: f64| {
        let joint = build(JOINT, &[]).expect("a joint").drive.expect("a drive");
        let DriveDesign::Joint(DriveOf { design, .. }) = joint.designed else { panic!("a joint") };
        let step = std::f64::consts::TAU / f64::from(1 << 20);
        let noise = format!("encoder.motor.noise_rad={:?}", design.gate_steps[1] * step / deviations);
        build(JOINT, &[&noise]).expect("a joint").warnings.join("\n")
    };
    assert!(warned(4.3).contains("the noise of the motor's encoder is 93"), "{}", warned(4.3));
    assert_eq!(warned(8.6), "");
}

/// A first speed estimate that is mostly noise gives a warning with a longer period.
#[test]
fn a_start_in_noise_is_told_with_the_period_that_it_takes() {
    let sheet = "motor={inertia_kg_m2=5.5e-6, torque_n_m_per_a=0.00067, max_current_a=10.0, current_lag_s=3.3e-5}";
    let warned = |period_s: f64| {
        let period = format!("drive.period_s={period_s:?}");
        let noisy = ["encoder.bits=11", "encoder.noise_rad=0.012", "friction={}"];
        build(MOTOR, &[&[sheet, period.as_str()], &noisy[..]].concat()).expect("a motor").warnings.join("\n")
    };
    let told = warned(1e-4);
    assert!(told.contains("the first speed estimate may be 169.7 rad/s off"), "{told}");
    let named = told.split("drive.period_s above ").nth(1).and_then(|rest| rest.lines().next()?.parse::<f64>().ok());
    assert_eq!(warned(1.02 * named.expect("a period")), "");
}

#[test]
fn noise_and_jitter_of_a_drive_are_those_of_its_seed() {
    for (text, sets) in [
        (MOTOR, &["encoder.noise_rad=1e-4", "drive.jitter_s=1e-4"][..]),
        (JOINT, &["encoder.link.noise_rad=1e-6", "drive.jitter_s=1e-4"]),
        (JOINT, &["encoder.motor.noise_rad=1e-6"]),
    ] {
        let with = |more: &'static str| held(&ran(text, &[sets, &["span_s=0.2", more]].concat()).1);
        assert_eq!(with("seed=7"), with("seed=7"));
        assert_ne!(with("seed=7"), with("seed=8"), "{sets:?}");
        // Without noise and jitter, the default, a seed has no effect.
        let plain = |more: &'static str| held(&ran(text, &["span_s=0.2", more]).1);
        assert_eq!(plain("seed=7"), plain("seed=8"));
        assert_ne!(plain("seed=7"), with("seed=7"), "{sets:?}");
    }
}

/// A missed interrupt keeps u and the reference, and the reference is late from then on.
#[test]
fn a_missed_interrupt_leaves_u_and_makes_the_reference_late() {
    let turning = "reference={kind = \"speed\", speed_rad_s = 60, duration_s = 0.3}";
    let (_, whole) = ran(MOTOR, &[turning]);
    for missed in [1_u32, 4] {
        let fault = format!("fault=[{{kind = \"missed\", at_s = 1.0, for_s = {}}}]", 1e-3 * f64::from(missed));
        let (_, trace) = ran(MOTOR, &[turning, &fault]);
        let rows = &trace.rows;
        let missed = missed as usize;
        assert!(rows[..1000].iter().zip(&whole.rows).all(|(row, whole)| row == whole));
        assert!(rows[1000..1000 + missed].iter().all(|row| (row.u, row.r) == (rows[999].u, rows[999].r)));
        assert!(rows[1000 + missed..].iter().zip(&whole.rows[1000..]).all(|(row, whole)| row.r == whole.r));
        // The shaft is ahead of the late reference and then follows it.
        let error = |k: usize| rows[k].x[0] - rows[k].r;
        let last = rows.len() - 1;
        assert!(error(1000 + missed) > 0.05 && error(last).abs() < 1e-3, "{} {}", error(1000 + missed), error(last));
        assert!(!rows[last].health.intersects(ALARMS), "{:?}", rows[last].health);
    }
}

/// At low speed the drive follows its encoder, so the shaft has the error of the magnet. At high speed there is no
/// alarm.
#[test]
fn a_magnet_off_its_centre_turns_the_shaft_unevenly() {
    for (gear, shaft_rad) in [("[1, 1]", 0.01), ("[2, 1]", 0.005)] {
        let sets = [
            "reference={kind = \"speed\", speed_rad_s = 2, duration_s = 0.3}",
            "encoder.eccentricity_rad=0.01",
            "span_s=4",
            "friction={}",
            &format!("motor.gear={gear}"),
        ];
        let (_, trace) = ran(MOTOR, &sets);
        for row in trace.rows.iter().filter(|row| row.t_s > 1.0) {
            let turns = 0.01 / shaft_rad;
            let expected = -shaft_rad * (turns * row.x[0]).sin();
            assert!((row.x[0] - row.r - expected).abs() < 0.08 * shaft_rad, "{gear}, {} s", row.t_s);
        }
    }
    let fast = "reference={kind = \"speed\", speed_rad_s = 150, duration_s = 0.5}";
    let (_, trace) = ran(MOTOR, &[fast, "encoder.bits=12", "encoder.eccentricity_rad=0.0087"]);
    assert!(trace.rows.iter().all(|row| !row.health.intersects(ALARMS) && (row.x[0] - row.r).abs() < 0.026));
}

#[test]
fn a_fault_is_where_and_when_the_file_says() {
    let lost = "fault=[{kind = \"lost\", at_s = 1.0, for_s = 0.02}]";
    let (mut experiment, trace) = ran(MOTOR, &[lost]);
    let ticks: Vec<usize> =
        (0..trace.rows.len()).filter(|&k| trace.rows[k].health.contains(Health::SAMPLE_LOST)).collect();
    assert_eq!(ticks, (1000..1020).collect::<Vec<_>>());
    // With a fault there is no comparison for the noise.
    assert_eq!(experiment.noise(&trace), None);
    // The innovation gate rejects one outlier.
    let wild = "fault=[{kind = \"jump\", counts = 1000, at_s = 1.0, for_s = 0.001}]";
    let (_, trace) = ran(MOTOR, &[wild]);
    let ticks = trace.rows.iter().filter(|row| row.health.contains(Health::SAMPLE_LOST)).count();
    assert_eq!(ticks, 1);
    // A frozen motor encoder of a joint at rest.
    let stuck = "fault=[{kind = \"stuck\", encoder = \"motor\", at_s = 0.3}]";
    let (experiment, trace) = ran(JOINT, &[stuck, "span_s=0.8"]);
    let plain = ran(JOINT, &["span_s=0.8"]).1;
    assert_eq!(held(&trace)[..300], held(&plain)[..300]);
    assert!(held(&trace)[300..] != held(&plain)[300..], "{}", experiment.headline());
}

/// A reference that is one tick late would cause an error of 6 and 2 mrad, at 6.3 and 2.2 rad/s.
#[test]
fn ticks_of_delay_are_known_to_the_law_and_to_its_reference() {
    let motor = ["friction={}", "motor.current_lag_s=0", "encoder.bits=20"];
    for (text, more, allowed) in [(MOTOR, &motor[..], 1e-3), (JOINT, &["load=[]"], 1e-4)] {
        for late in 1..=3 {
            let (experiment, trace) = ran(text, &[&[&*format!("drive.delay_ticks={late}")], more].concat());
            let told = experiment.headline();
            assert!(trace.rows.windows(late + 1).all(|rows| rows[late].u_held == rows[0].u), "{told}");
            let found = experiment.metrics(&trace);
            assert!(found.y_ultimate < allowed, "{late} late: {found:?}");
        }
    }
}

/// A bandwidth that the period does not allow: the limit in the unit of the key, and the longest period for the value.
#[test]
fn a_bandwidth_above_its_limit_names_the_limit_and_a_period_that_is_accepted() {
    for (text, key, value, limit) in [
        (MOTOR, "drive.surface_rad_s", 9000.0, "9000 rad/s, must be at most 500 rad/s at period_s = 0.001"),
        (MOTOR, "drive.reaching_per_s", 5000.0, "5000 1/s, must be at most 1000 1/s at period_s = 0.001"),
        (JOINT, "drive.surface_rad_s", 200.0, "200 rad/s, must be at most 100 rad/s at period_s = 0.001"),
    ] {
        let set = format!("{key}={value:?}");
        let told = build(text, &[&set]).err().unwrap_or_else(|| panic!("{set} is accepted"));
        assert!(told.contains(&format!("`{key}`: {limit} (")) && told.contains("): lower it"), "{told}");
        for remedy in remedies::remedies(&told) {
            let sets: Vec<&str> = [set.as_str()].into_iter().chain(remedy.iter().map(String::as_str)).collect();
            build(text, &sets).unwrap_or_else(|error| panic!("{sets:?}: {error}"));
        }
    }
    let told = build(MOTOR, &["drive.surface_rad_s=600"]).err().expect("too fast");
    assert!(told.contains(", or take drive.period_s = "), "{told}");
}

/// Valid and invalid delays of a file.
#[test]
fn a_delay_is_0_to_3_ticks() {
    let error = |text, value: &str| build(text, &[&format!("drive.delay_ticks={value}")]).err().expect("no such delay");
    for text in [MOTOR, JOINT] {
        let told = error(text, "4");
        assert!(
            told.contains(
                "`drive.delay_ticks`: found 4, expected a whole number at least 0 and at most 3: take \
                 drive.delay_ticks = 3, or a longer period"
            ),
            "{told}"
        );
        assert!(error(text, "-1").ends_with("expected a whole number at least 0 and at most 3"));
        for late in 0..=3 {
            let sets = [format!("drive.delay_ticks={late}")];
            let experiment = build(text, &sets.each_ref().map(String::as_str)).expect("a drive");
            assert_eq!(experiment.drive.expect("a drive").designed.form().delay_ticks, late);
        }
    }
}

/// A bandwidth that is too high for period and delay is rejected with the nearest valid value.
#[test]
fn a_bandwidth_that_a_delay_does_not_bear_is_refused_with_the_nearest_one() {
    for (text, key, delay, over, nearest) in [
        (MOTOR, "drive.observer_rad_s", "drive.delay_ticks=2", 310.0, 300.0),
        (MOTOR, "drive.observer_rad_s", "drive.delay_ticks=3", 210.0, 200.0),
        (JOINT, "drive.motor_rad_s", "drive.delay_ticks=2", 510.0, 500.0),
        (JOINT, "drive.motor_rad_s", "drive.delay_ticks=3", 410.0, 400.0),
    ] {
        let with = |value: f64| build(text, &[delay, &format!("{key}={value:?}")]);
        let told = with(over).err().expect("too fast");
        assert!(told.contains(&format!("): take {key} = {nearest}")), "{told}");
        with(nearest).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Without a plan weight and spring are in balance, and the joint stays at rest.
#[test]
fn a_joint_begins_in_balance() {
    let sets = ["reference={kind = \"rest\"}", "joint.start_rad=0.5", "load=[]", "span_s=1"];
    let (_, trace) = ran(JOINT, &sets);
    // The law estimates the gravity torque of 0.11 N m on the motor within some ticks.
    let off = trace.rows.iter().map(|row| trace.error(row).abs()).fold(0.0, f64::max);
    assert!(off < 1e-4, "{off}");
    // Quantisation keeps u moving, so its mean is checked.
    let last: Vec<f64> = trace.rows[500..].iter().map(|row| row.u_held).collect();
    let u = last.iter().sum::<f64>() / last.len() as f64;
    assert!((u - 0.23 * 0.5_f64.sin() / 0.119).abs() < 0.01, "{u}");
}

/// Motor and joint follow points with a delay of 3.5 intervals.
#[test]
fn points_are_met_late_by_three_and_a_half() {
    let points = "reference={kind = \"points\", points_rad = [0, 0.1, 0.3, 0.6, 0.8, 0.9, 0.9], every_s = 0.1}";
    for text in [MOTOR, JOINT] {
        let (experiment, trace) = ran(text, &[points, "load=[]", "span_s=2"]);
        assert!(experiment.warnings.is_empty(), "{:?}", experiment.warnings);
        let last = trace.rows.last().expect("rows");
        assert!((last.r - 0.9).abs() < 1e-8 && trace.error(last).abs() < 2e-3, "{last:?}");
        // The fourth point, at 0.3 s, is reached at 0.65 s, within the error of a coarse curve.
        assert!((trace.rows[650].r - 0.6).abs() < 0.01, "{}", trace.rows[650].r);
    }
}

const ALARMED: [Health; 3] = [Health::DISTURBANCE_OVER_BOUND, Health::SIGMA_STAR_OVER_BOUND, Health::STUCK_AT_LIMIT];

fn first_alarm(trace: &Trace) -> Option<usize> {
    trace.rows.iter().position(|row| ALARMED.iter().any(|alarm| row.health.contains(*alarm)))
}

/// Both templates, nominally and at the ends of their tolerance.
#[test]
fn monitors_by_rule_are_silent_over_healthy_drives() {
    for percent in ["20", "-20"] {
        let inertia = |percent: &str| format!("error.inertia_percent={percent}");
        let torque = format!("error.torque_percent={percent}");
        for sets in [vec![], vec![torque.as_str()], vec![torque.as_str(), inertia("-20").leak()]] {
            assert_eq!(first_alarm(&ran(MOTOR, &sets).1), None, "motor, {sets:?}");
        }
        let stiffness = format!("error.stiffness_percent={percent}");
        for sets in [vec![], vec![torque.as_str()], vec![stiffness.as_str(), "error.motor_inertia_percent=20"]] {
            assert_eq!(first_alarm(&ran(JOINT, &sets).1), None, "joint, {sets:?}");
        }
    }
    let wide = ["drive.uncertain_percent=50", "error.inertia_percent=50", "error.torque_percent=-50"];
    assert_eq!(first_alarm(&ran(MOTOR, &wide).1), None, "motor, {wide:?}");
    for error in ["error.stiffness_percent=-50", "error.link_inertia_percent=50", "error.torque_percent=-50"] {
        let wide = ["drive.uncertain_percent=50", error];
        assert_eq!(first_alarm(&ran(JOINT, &wide).1), None, "joint, {wide:?}");
    }
}

/// At the turning point a frozen count looks like a shaft at rest, which no innovation gate detects.
#[test]
fn a_count_that_sticks_at_the_turning_point_ends_in_the_reaction_that_the_file_chose() {
    let stuck = ["fault[1]={kind = \"stuck\", at_s = 0.75}", "span_s=1.5"];
    let with = |reaction: &'static str| ran(MOTOR, &[&stuck[..], &[reaction]].concat()).1;
    let (told, stopped) = (with("monitor.reaction=tell"), with("monitor.reaction=fallback"));
    let first = first_alarm(&told).expect("an alarm");
    assert_eq!(first_alarm(&stopped), Some(first));
    assert!((750..=820).contains(&first), "tick {first}");
    assert!(!told.rows.iter().any(|row| row.health.contains(Health::STOPPED)));
    assert!(stopped.rows[first..].iter().all(|row| row.health.contains(Health::STOPPED) && row.u == 0.0));
    let farthest = |trace: &Trace| trace.rows.iter().map(|row| row.x[0].abs()).fold(0.0, f64::max);
    assert!(farthest(&told) > 20.0, "unwatched it runs away: {}", farthest(&told));
    let on: Vec<_> = stopped.rows[first..].iter().map(|row| row.x[1].abs()).collect();
    // Friction alone decelerates the shaft, by 25 rad/s².
    assert!((on[1] - on[501] - 0.5 * 25.0).abs() < 3.0, "{} to {} rad/s", on[1], on[501]);
    // Braking on an unknown speed is coasting.
    let braked = with("monitor.reaction=brake");
    assert_eq!(first_alarm(&braked), Some(first));
    assert!(farthest(&braked) < 1.2 * farthest(&stopped), "{} for {}", farthest(&braked), farthest(&stopped));
}

/// With two phases swapped the current is off 50 ms after half of it flowed and within 0.5 rad, for any reaction.
#[test]
fn a_motor_that_turns_the_wrong_way_is_stopped_whatever_the_reaction_is() {
    let reactions = ["tell", "brake", "fallback", "joined_stop"].map(|it| format!("monitor.reaction={it}"));
    let of_move = "reference={kind = \"move\", to_rad = 1.0, start_s = 0.2, duration_s = 0.3}";
    // Drives with two gain sets and with one.
    let motors: [&[&str]; 5] = [
        &[],
        &["drive.gain_sets=1"],
        &["drive.uncertain_percent=21", of_move],
        &["drive.uncertain_percent=50"],
        &["motor.inertia_kg_m2=[1e-4, 8e-4]", of_move],
    ];
    let joints: [&[&str]; 2] = [&[], &["drive.gain_sets=1"]];
    let drives = motors.map(|sets| (MOTOR, 10.0, sets)).into_iter().chain(joints.map(|sets| (JOINT, 30.0, sets)));
    for (text, limit_a, more) in drives {
        for reaction in &reactions {
            let reaction = reaction.as_str();
            let sets: &[&str] =
                if reaction.ends_with("stop") { &[reaction, "monitor.stop_s=0.2"] } else { &[reaction] };
            let (_, trace) = ran(text, &[&["error.reversed=true", "span_s=1.0"], sets, more].concat());
            let half = trace.rows.iter().position(|row| row.u.abs() > 0.5 * limit_a).expect("it runs away");
            let stopped = trace.rows.iter().position(|row| row.health.contains(Health::STOPPED)).expect("a stop");
            let (way, told) = (trace.error(&trace.rows[stopped]).abs(), trace.rows[stopped - 1].health);
            println!(
                "{more:?}, {reaction}: {} ticks at more than half of the current, {way:.3} rad, {told}",
                stopped - half
            );
            // With one gain set the detection is later.
            let most = if more.is_empty() { 0.5 } else { 0.8 };
            assert!(stopped < half + 50 && way < most, "{more:?}, {reaction}: {stopped}, {half}, {way}");
            assert!(trace.rows[stopped..].iter().all(|row| row.u == 0.0), "{reaction}");
            assert!(told.contains(Health::WRONG_WAY) || reaction.ends_with("fallback"), "{told}");
        }
    }
}

/// Inertia of five and ten times the nominal value, and a torque constant of a ninth, under a load: a limit cycle ends
/// within 0.2 s of the first alarm, also if alarms are only reported.
#[test]
fn a_loop_that_swings_from_limit_to_limit_is_stopped_whatever_the_reaction_is() {
    let push =
        "load=[{kind = \"step\", amplitude = 0.05, t0_s = 0.2}, {kind = \"step\", amplitude = -0.05, t0_s = 0.25}]";
    let errors = ["error.inertia_percent=400", "error.inertia_percent=900", "error.torque_percent=-89"];
    for (error, reaction) in errors.into_iter().flat_map(|error| [(error, "tell"), (error, "brake")]) {
        let reaction = format!("monitor.reaction={reaction}");
        let rest = "reference={kind = \"rest\"}";
        let (_, trace) = ran(MOTOR, &[push, error, &reaction, rest, "friction={}", "fault=[]", "span_s=2.0"]);
        let first = first_alarm(&trace).expect("an alarm");
        let stopped = trace.rows.iter().position(|row| row.health.contains(Health::STOPPED)).expect("a stop");
        let told = trace.rows[stopped - 1].health;
        println!("{error}, {reaction}: an alarm at tick {first}, stopped at {stopped}: {told}");
        assert!(told.intersects(Health::OSCILLATES | Health::BRAKES), "{error}: {told}");
        // A brake with a ninth of the torque takes longer and does not oscillate.
        let gentle = trace.rows[(first + 100).min(stopped)..stopped].iter().all(|row| row.u.abs() < 2.0);
        assert!(stopped < first + 200 || gentle, "{error}: {first}, {stopped}");
        assert!(trace.rows[stopped..].iter().all(|row| row.u == 0.0), "{error}");
    }
}

/// The sine needs 2.5 A and the derated stage delivers 2 A: the shaft stays in about its range, and follows again after
/// the derating.
#[test]
fn a_shaft_on_a_derated_stage_follows_as_far_as_its_current_goes() {
    let sine = "reference={kind = \"sine\", amplitude_rad = 1.0, frequency_hz = 4.0}";
    let derated = "fault=[{kind = \"derated\", at_s = 0.5, for_s = 1.5, current_a = 2.0}]";
    let tell = "monitor.reaction=tell";
    let run = |fault| ran(MOTOR, &[sine, fault, tell, "span_s=3.0", "load=[]"]).1;
    let (trace, healthy) = (run(derated), run("fault=[]"));
    let far = |from: usize, trace: &Trace| trace.rows[from..].iter().map(|row| row.x[0].abs()).fold(0.0, f64::max);
    let off = |trace: &Trace| trace.rows[2700..].iter().map(|row| trace.error(row).abs()).fold(0.0, f64::max);
    let held = trace.rows[500..2000].iter().map(|row| row.u_held.abs()).fold(0.0, f64::max);
    println!(
        "|y| up to {:.3} rad; {:.5} rad off in the end, {:.5} without",
        far(0, &trace),
        off(&trace),
        off(&healthy)
    );
    assert!(held == 2.0 && far(0, &trace) < 1.5 && off(&trace) < 1.1 * off(&healthy));
    let (_, plain) = ran(MOTOR, &["fault=[{kind = \"derated\", at_s = 0.5, current_a = 10.0}]"]);
    assert!(plain.rows.iter().zip(&ran(MOTOR, &[]).1.rows).all(|(a, b)| a.u == b.u && a.x == b.x));
}

/// A load of twice the threshold: the shaft comes to rest at the end of a smooth stop, and is held there.
#[test]
fn a_joined_stop_brings_the_reference_to_rest_without_a_jump() {
    for (text, load, band) in [
        (MOTOR, "load[1]={kind = \"step\", amplitude = 0.3, t0_s = 1.0}", 0.15),
        (JOINT, "load[1]={kind = \"step\", amplitude = 2.6, t0_s = 0.5}", 0.02),
    ] {
        let bound = if text == MOTOR { "monitor.load_n_m=0.15" } else { "monitor.load_n_m=1.3" };
        let sets = [load, bound, "monitor.reaction=joined_stop", "monitor.stop_s=0.2", "span_s=2.0"];
        let (_, trace) = ran(text, &sets);
        let first = first_alarm(&trace).expect("an alarm");
        let r: Vec<_> = trace.rows.iter().map(|row| row.r).collect();
        let speed = (r[first + 1] - r[first]) / 1e-3;
        let acceleration = (r[first + 1] - 2.0 * r[first] + r[first - 1]) / 1e-6;
        // Half of the travel at constant speed, plus the part of the acceleration.
        let of_acceleration = if text == MOTOR { 1.0 / 12.0 } else { 1.0 / 10.0 };
        let expected = r[first + 1] + 0.5 * 0.2 * speed + of_acceleration * 0.2 * 0.2 * acceleration;
        assert!((r[first + 202] - expected).abs() < 2e-3 * speed.abs(), "{} for {expected}", r[first + 202]);
        assert!(r[first + 202..].windows(2).all(|r| r[0] == r[1]));
        let bend = r.windows(3).skip(first).map(|r| (r[2] - 2.0 * r[1] + r[0]).abs()).fold(0.0, f64::max);
        // The largest r'' of such a stop is about 2 v/τ for a motor and 3 v/τ for a joint, plus the r'' of the sine.
        assert!(bend / 1e-6 < 4.0 * speed.abs() / 0.2 + 40.0, "{bend:e}");
        let after: Vec<_> = trace.rows[first + 500..].iter().map(|row| (row.x[0] - row.r).abs()).collect();
        assert!(after.iter().all(|error| *error < band), "{:e}", after.iter().fold(0.0, |a: f64, b| a.max(*b)));
    }
}

/// Plants without friction have an exact step from tick to tick.
#[test]
fn a_plant_without_friction_goes_from_tick_to_tick() {
    let built = |text, sets: &[&str]| build(text, sets).unwrap_or_else(|told| panic!("{told}"));
    assert!(built(JOINT, &[]).plant.exact().is_some());
    let smooth = ["friction.static_n_m=0", "friction.coulomb_n_m=0", "friction.cogging_n_m=0"];
    assert!(built(MOTOR, &smooth).plant.exact().is_some());
    assert!(built(MOTOR, &smooth[..2]).plant.exact().is_none() && built(MOTOR, &smooth[1..]).plant.exact().is_none());
    assert!(built(JOINT, &["friction.cogging_n_m=0.01"]).plant.exact().is_none());
    assert!(built(JOINT, &["friction.ripple_percent=1"]).plant.exact().is_none());
}

/// Geared motor that is limited by its voltage: 36:1, 0.12 N m/A, 24 V, 5.56 rad/s at the output.
const SLOW: [&str; 9] = [
    "motor.inertia_kg_m2=1e-4",
    "motor.torque_n_m_per_a=0.12",
    "motor.damping_n_m_s=0",
    "motor.gear=[36, 1]",
    "motor.load_inertia_kg_m2=0.05",
    "friction={}",
    "span_s=3.0",
    "encoder.bits=14",
    "reference={kind = \"move\", to_rad = 3.0, start_s = 0.1}",
];

fn slow(sets: &[&str]) -> Experiment {
    build(MOTOR, &[&SLOW[..], sets].concat()).unwrap_or_else(|error| panic!("{error}"))
}

fn duration_s(experiment: &Experiment) -> f64 {
    let motion = &experiment.drive.as_ref().expect("a drive").motion;
    f64::from(motion.ticks) * motion.period_s
}

/// With a negligible resistance only the speed matters. The peak speed 1.875 D/τ of a move of degree 5 needs 90 % of
/// 24 V with a back-EMF 20 % above the data sheet.
#[test]
fn a_move_is_as_short_as_the_supply_allows() {
    let tau = 1.875 * 3.0 * 36.0 * 0.12 * 1.2 / (0.9 * 24.0);
    for supply in [
        &["motor.supply_v=24", "motor.resistance_ohm=1e-4"][..],
        &["motor.no_load_rad_s=200", "motor.resistance_ohm=1e-4"],
    ] {
        let found = duration_s(&slow(supply));
        assert!((found - tau).abs() < 3e-3, "{found} s for {tau} s");
    }
    // More resistance takes longer, and the current alone limits neither move.
    let durations = ["1e-4", "1", "3"].map(|ohm| {
        let resistance = format!("motor.resistance_ohm={ohm}");
        duration_s(&slow(&["motor.supply_v=24", "motor.max_current_a=7.9", &resistance]))
    });
    assert!(durations.is_sorted() && durations[2] > 1.002 * durations[0], "{durations:?}");
    assert!(duration_s(&slow(&[])) < 0.3 * tau);
}

/// Every motor within the tolerance follows, and its voltage never reaches the supply.
#[test]
fn a_move_that_was_planned_is_followed_by_the_worst_motor() {
    for error in ["error={torque_percent = 20.0, inertia_percent = 20.0}", "error={torque_percent = -20.0}", "error={}"]
    {
        let torque = if error.contains("-20") {
            0.8
        } else if error.contains("20") {
            1.2
        } else {
            1.0
        };
        let sets = ["motor.supply_v=24", "motor.resistance_ohm=1.2", error];
        let (experiment, trace) = ran(MOTOR, &[&SLOW[..], &sets].concat());
        assert_eq!(experiment.warnings, Vec::<String>::new());
        let volt = |row: &loop_sim::trace::Row| (1.2 * row.u_held + torque * 0.12 * 36.0 * row.x[1]).abs();
        let peak = trace.rows.iter().map(volt).fold(0.0, f64::max);
        assert!(peak < 24.0 && peak > 12.0, "{error}: {peak} V");
        let worst = trace.rows.iter().map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-3, "{error}: {worst} rad");
        let all = trace.rows.iter().fold(Health::OK, |all, row| all | row.health);
        assert!(!all.intersects(Health::SATURATED | Health::DISTURBANCE_OVER_BOUND), "{error}: {all}");
    }
}

/// 3 rad in 0.4 s needs 14 rad/s, and the supply allows 5.6: the drive does not follow, and stays below that speed.
#[test]
fn a_move_beyond_the_supply_is_warned_of_and_not_followed() {
    let supply = ["motor.supply_v=24", "motor.resistance_ohm=0.3"];
    let fast = "reference={kind = \"move\", to_rad = 3.0, start_s = 0.1, duration_s = 0.4}";
    let (experiment, trace) = ran(MOTOR, &[&SLOW[..], &supply, &[fast]].concat());
    let [warning] = &experiment.warnings[..] else { panic!("{:?}", experiment.warnings) };
    let too_slow = "the supply has 24 V (no-load speed 200 rad/s): the drive will not follow it;";
    assert!(warning.contains(too_slow), "{warning}");
    let speed = trace.rows.iter().map(|row| row.x[1].abs()).fold(0.0, f64::max);
    let worst = trace.rows.iter().map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
    assert!(speed > 5.5 && speed < 24.0 / 0.12 / 36.0 && worst > 1.0, "{speed} rad/s, {worst} rad");
    // The remedy works.
    let (_, remedy) = warning.split_once("; reference.").expect("a remedy");
    let key = format!("reference.{}", remedy.trim_end_matches(" is long enough").replace(' ', ""));
    let longer = slow(&[&supply[..], &[fast, &key]].concat());
    assert_eq!(longer.warnings, Vec::<String>::new(), "{key}");
}

/// Each warning has a remedy that works.
#[test]
fn other_goals_beyond_the_supply_are_told_what_is_within_it() {
    let supply = ["motor.supply_v=24", "motor.resistance_ohm=0.3"];
    for (reference, key) in [
        ("reference={kind = \"speed\", speed_rad_s = 7.0, duration_s = 1.0}", "reference.speed_rad_s"),
        ("reference={kind = \"speed\", speed_rad_s = 7.0}", "reference.speed_rad_s"),
        ("reference={kind = \"sine\", amplitude_rad = 3.0, frequency_hz = 0.5}", "reference.amplitude_rad"),
        ("reference={kind = \"points\", points_rad = [0.0, 0.5, 1.0, 1.5, 2.0], every_s = 0.05}", "reference.every_s"),
    ] {
        let told = slow(&[&supply[..], &[reference]].concat()).warnings;
        let [warning] = &told[..] else { panic!("{reference}: {told:?}") };
        let at = warning.find(key).unwrap_or_else(|| panic!("{reference}: {warning}"));
        let set = warning[at..].trim_end_matches(" is within the limits").replace(' ', "");
        let slower = slow(&[&supply[..], &[reference, &set]].concat()).warnings;
        assert_eq!(slower, Vec::<String>::new(), "{set}");
    }
}

/// A speed by rule gives one warning. A speed set by the file, or one below any supply, gives none.
#[test]
fn a_move_by_the_current_alone_asks_for_the_supply() {
    let [told] = &slow(&[]).warnings[..] else { panic!("one line") };
    assert!(told.starts_with("motor.supply_v is not given: ") && told.contains("V of back-EMF"), "{told}");
    for given in ["reference.duration_s=0.4", "reference.to_rad=0.005", "motor.no_load_rad_s=2000"] {
        assert_eq!(slow(&[given]).warnings, Vec::<String>::new(), "{given}");
    }
    let joint = build(
        JOINT,
        &[
            "reference={kind = \"move\", to_rad = 400.0}",
            "span_s=20",
            "joint.link_damping_n_m_s=0",
            "joint.motor_damping_n_m_s=0",
        ],
    )
    .expect("a joint");
    assert!(joint.warnings.iter().any(|it| it.starts_with("joint.supply_v is not given: ")), "{:?}", joint.warnings);
}

/// The motor of a joint is faster than the link while the spring twists. The planned voltage equals the simulated one.
#[test]
fn the_supply_of_a_joint_is_that_of_its_motor() {
    let sets = ["joint.resistance_ohm=0.2", "load=[]", "joint.current_lag_s=0"];
    let told = |volt: &str| build(JOINT, &[&sets[..], &[volt]].concat()).unwrap_or_else(|error| panic!("{error}"));
    let (_, trace) = ran(JOINT, &[&sets[..], &["joint.supply_v=200"]].concat());
    let volts = |row: &loop_sim::trace::Row| (0.2 * row.u_held + 0.119 * row.x[3]).abs();
    let peak = trace.rows.iter().map(volts).fold(0.0, f64::max);
    let [enough, less] = [1.02, 0.98].map(|times| format!("joint.supply_v={}", times * peak));
    let beyond = |it: &Experiment| it.warnings.iter().any(|it| it.contains("the drive will not follow it"));
    assert!(!beyond(&told(&enough)) && beyond(&told(&less)), "{peak} V: {:?}", told(&less).warnings);
}

#[test]
fn keys_of_the_supply_that_do_not_fit_say_what_does() {
    let refused = |sets: &[&str]| build(MOTOR, sets).err().expect("refused");
    for (sets, words) in [
        (
            &["motor.supply_v=24"][..],
            "`motor.resistance_ohm`: missing: the winding resistance; if it is unknown \
             set motor.no_load_rad_s = 480",
        ),
        (&["motor.resistance_ohm=1"], "`motor.supply_v`: missing: the winding resistance alone sets no limit"),
        (
            &["motor.supply_v=24", "motor.resistance_ohm=1", "motor.no_load_rad_s=3"],
            "`motor.no_load_rad_s`: supply_v / torque_n_m_per_a gives it already, 480 rad/s",
        ),
        (
            &["motor.supply_v=0", "motor.resistance_ohm=1"],
            "`motor.supply_v`: found 0, expected a finite number above 0",
        ),
    ] {
        let told = refused(sets);
        assert!(told.contains(words), "{told}");
    }
    let weak = ["motor.supply_v=24", "motor.resistance_ohm=4"];
    let told = build(MOTOR, &weak).expect("a motor").warnings;
    assert!(
        told.len() == 1 && told[0].contains("through the winding at rest, 6 A: take motor.max_current_a = 5.994"),
        "{told:?}"
    );
    let less = build(MOTOR, &[&weak[..], &["motor.max_current_a=5.994"]].concat()).expect("a motor");
    assert_eq!(less.warnings, Vec::<String>::new());
    // The line from the current limit at rest to the no-load speed.
    let speeds = build(MOTOR, &["motor.no_load_rad_s=480"]).expect("a motor").drive.and_then(|it| it.top_speed);
    let found = speeds.map(|it| [it.no_load_rad_s, it.full_current_rad_s]).expect("a supply");
    assert!((found[0] - 480.0).abs() < 1e-9 && found[1].abs() < 1e-9, "{found:?}");
}

/// The design is for √(J_1 J_2). Only gate and monitors differ from a file with that inertia.
#[test]
fn a_range_of_inertia_is_designed_for_its_geometric_mean() {
    let designed = |sets: &[&str]| {
        let drive = build(MOTOR, sets).unwrap_or_else(|error| panic!("{error}")).drive.expect("a drive").designed;
        let DriveDesign::Motor(DriveOf { design, form, monitors, .. }) = drive else { panic!("a motor") };
        (design, form, monitors)
    };
    let (mean, ..) = designed(&["motor.inertia_kg_m2=4e-4", "drive.gain_sets=1"]);
    let (design, form, monitors) = designed(&["motor.inertia_kg_m2=[1e-4, 1.6e-3]"]);
    assert!((design.motor.inertia_kg_m2 / 4e-4 - 1.0).abs() < 1e-12 && form.gain_sets == 1);
    assert!((design.bandwidths.surface_rad_s / mean.bandwidths.surface_rad_s - 1.0).abs() < 1e-9);
    // The lightest motor accelerates four times as fast: its acceleration deviates by three times the nominal value.
    assert!((monitors.uncertain / (1.0 - monitors.uncertain) - 3.0).abs() < 1e-9, "{monitors:?}");
    assert!(((design.gate_steps - 1.0) / (mean.gate_steps - 1.0) - 4.0).abs() < 1e-9);
    // Behind a gear of 10: 0.01 and 0.02 + 0.09 and 0.02.
    let (geared, ..) =
        designed(&["motor.gear=[10, 1]", "motor.inertia_kg_m2=[1e-4, 2e-4]", "motor.load_inertia_kg_m2=[0.0, 0.07]"]);
    assert!((geared.motor.inertia_kg_m2 - 0.03).abs() < 1e-12, "{}", geared.motor.inertia_kg_m2);
    // A range with equal ends is a number.
    assert_eq!(designed(&["motor.inertia_kg_m2=[4e-4, 4e-4]"]), designed(&["motor.inertia_kg_m2=4e-4"]));
}

/// At both ends of 2e-4 to 2e-3 kg m² moves, sines and sudden loads cause no alarm.
#[test]
fn a_motor_at_either_end_of_its_range_runs_without_an_alarm() {
    let alarms = ALARMS;
    let mut largest = 0.0_f64;
    for (inertia, torque) in [(216.2, 20.0), (216.2, -15.0), (0.0, 0.0), (-68.3, 20.0), (-68.3, -20.0)] {
        for (more, bar) in [
            ("reference={kind = \"move\", to_rad = 3.0, start_s = 0.1}", 0.03),
            ("reference={kind = \"sine\", amplitude_rad = 1.0, frequency_hz = 1.0}", 0.03),
            ("load=[{kind = \"step\", amplitude = 0.12, t0_s = 0.5}]", 0.03),
        ] {
            let [inertia, torque] =
                [("inertia", inertia), ("torque", torque)].map(|(of, it)| format!("error.{of}_percent={it}"));
            let (experiment, trace) =
                ran(MOTOR, &["motor.inertia_kg_m2=[2e-4, 2e-3]", "friction.cogging_n_m=0", &inertia, &torque, more]);
            let rows = trace.rows.iter().filter(|row| row.t_s >= experiment.window_s[0]);
            let all = rows.clone().fold(Health::OK, |all, row| all | row.health);
            let worst = rows.map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
            assert!(!all.intersects(alarms) && worst < bar, "{inertia} {torque} {more}: {all}, {worst} rad");
            largest = trace.rows.iter().map(|row| row.d_hat[1].abs()).fold(largest, f64::max);
        }
    }
    // The estimate exceeds the threshold for a tolerance of 20 %, which would have raised an alarm.
    let by_20_percent = (0.25 + 0.65 * 0.25) * 10.0 * 0.05 / 6.32e-4;
    assert!(largest > by_20_percent, "{largest} rad/s^2");
}

#[test]
fn what_is_not_known_to_50_percent_is_told_of_a_range() {
    let refused = |text: &str, sets: &[&str]| build(text, sets).err().expect("refused");
    let inertia = "motor.inertia_kg_m2=2e-4";
    for (percent, sets, words) in [
        (
            65,
            &[inertia][..],
            "motor.inertia_kg_m2 = [7e-5, 0.00033] with drive.uncertain_percent = 20, \
             for K_t alone (designed for the geometric mean 0.000152)",
        ),
        (75, &[inertia], "One design covers no such range: measure the inertia (docs/commissioning.md)"),
        (
            60,
            &[inertia, "motor.gear=[10, 1]", "motor.load_inertia_kg_m2=0.02"],
            "motor.load_inertia_kg_m2 = [0, 0.044] with drive.uncertain_percent = 20, \
             for K_t alone (designed for the geometric mean 0.0358)",
        ),
        (60, &[inertia, "motor.gear=[10, 1]"], "kg m^2 of the rotor set motor.inertia_kg_m2 = [8e-5, 0.00032]"),
        (
            80,
            &["motor.inertia_kg_m2=[2e-4, 2e-3]"],
            "at most 50: the range of the inertia is in the data sheet already",
        ),
    ] {
        let percent = format!("drive.uncertain_percent={percent}");
        let told = refused(MOTOR, &[sets, &[&percent]].concat());
        assert!(told.contains(words) && told.contains("expected a finite number at least 0 and at most 50"), "{told}");
        // The proposed values are accepted.
        for remedy in remedies::remedies(&told) {
            let remedy: Vec<&str> = remedy.iter().map(String::as_str).collect();
            build(MOTOR, &[sets, &[&percent], &remedy].concat()).unwrap_or_else(|error| panic!("{remedy:?}: {error}"));
        }
    }
    assert!(
        refused(JOINT, &["drive.uncertain_percent=60"]).contains("found 60, expected a finite number at least 0 and")
    );
    for (set, words) in [
        ("motor.inertia_kg_m2=[2e-3, 2e-4]", "found [0.002, 0.0002], expected [0.0002, 0.002]: the smallest first"),
        ("motor.inertia_kg_m2=[1e-5, 1e-2]", "is more than a factor of 100"),
        ("motor.inertia_kg_m2=[0.0, 1e-2]", "found 0.0, expected a finite number above 0"),
        ("motor.inertia_kg_m2=[1e-3]", "found a list of 1, expected a list of 2 numbers"),
        ("motor.inertia_kg_m2=[1e-3, 1e-3, 1e-3]", "expected a list of 2 numbers"),
    ] {
        let told = refused(MOTOR, &[set]);
        assert!(told.contains(words), "{told}");
    }
}

/// Single set-points and frames of a bus at 100 Hz: the trajectory does not overshoot, the shaft by less than 0.2 %,
/// and the current is never at its limit. Without a profile 20 rad and such frames need 10 A.
#[test]
fn set_points_become_a_path_within_limits() {
    let limits = "max_speed_rad_s=200, max_acceleration_rad_s2=1200";
    for goal in [1.0, 3.1, 20.0, -500.0] {
        let reference = format!("reference={{kind=\"set_points\", points_rad=[{goal:?}], {limits}}}");
        let (experiment, trace) = ran(MOTOR, &[&reference, "span_s=6.0"]);
        assert!(experiment.warnings.is_empty(), "{:?}", experiment.warnings);
        let furthest = trace.rows.iter().map(|row| row.x[0] / goal).fold(0.0, f64::max);
        let speed = trace.rows.iter().map(|row| row.x[1].abs()).fold(0.0, f64::max);
        let last = trace.rows.last().expect("rows");
        println!("{goal} rad: up to {furthest:.5} of it, {speed:.1} rad/s, at last {:.1e} rad off", last.x[0] - goal);
        assert!(furthest < 1.002 && speed < 202.0 && (last.x[0] - goal).abs() < 1e-3, "{goal}: {furthest} {speed}");
        assert!(trace.rows.iter().all(|row| !row.health.contains(Health::SATURATED)), "{goal}");
    }
    let sine: Vec<f64> = (0..200).map(|k| 0.5 * (0.01 * std::f64::consts::TAU * f64::from(k)).sin()).collect();
    let reference = format!("reference={{kind=\"set_points\", points_rad={sine:?}, every_s=0.01, {limits}}}");
    let (_, trace) = ran(MOTOR, &[&reference]);
    let moving = &trace.rows[500..2000];
    let step = moving.windows(2).map(|pair| (pair[1].u - pair[0].u).powi(2)).sum::<f64>() / moving.len() as f64;
    println!("frames of 100 Hz: u steps by {:.3} A rms", step.sqrt());
    assert!(step.sqrt() < 0.5 && moving.iter().all(|row| row.u.abs() < 2.0), "{}", step.sqrt());
    // The joint has three averages over the period of its resonance.
    let reference = "reference={kind=\"set_points\", points_rad=[1.0], max_speed_rad_s=3, max_acceleration_rad_s2=8, \
                     smooth_s=0.06}";
    let (_, trace) = ran(JOINT, &[reference, "load=[]"]);
    let furthest = trace.rows.iter().map(|row| row.x[0]).fold(0.0, f64::max);
    assert!(furthest < 1.002, "{furthest}");
    assert!((trace.rows.last().expect("rows").x[0] - 1.0).abs() < 1e-3);
}

#[test]
fn set_points_that_no_profile_takes_are_refused_with_what_it_takes() {
    let with = |keys: &str| build(MOTOR, &[&format!("reference={{kind=\"set_points\", points_rad=[1.0], {keys}}}")]);
    for (keys, expected) in [
        ("max_speed_rad_s=10", "`reference.max_acceleration_rad_s2`: missing"),
        ("max_speed_rad_s=1e5, max_acceleration_rad_s2=10", "`reference.max_speed_rad_s`: found 100000"),
        ("max_speed_rad_s=10, max_acceleration_rad_s2=1e9", "`reference.max_acceleration_rad_s2`: found 1"),
        ("max_speed_rad_s=10, max_acceleration_rad_s2=10, smooth_s=0.6", "`reference.smooth_s`: found 600 ticks"),
        ("max_speed_rad_s=10, max_acceleration_rad_s2=10, duration_s=0.6", "`reference.duration_s`"),
    ] {
        let error = with(keys).err().unwrap_or_default();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

/// Inertia in g cm², torque constant in mN m/A: the drive has a design, but no motor has its acceleration.
#[test]
fn a_number_in_another_unit_is_told() {
    for (text, set) in [
        (MOTOR, "motor.inertia_kg_m2=120.0"),
        (MOTOR, "motor.torque_n_m_per_a=66.0"),
        (JOINT, "joint.motor_inertia_kg_m2=500.0"),
    ] {
        let told = |sets: &[String]| {
            let source = Source { file: "drive.toml", text, sets };
            let warnings = crate::parse_own(&source, "drive").expect("a drive").warnings;
            warnings.iter().any(|warning| warning.contains("check the units"))
        };
        assert_eq!((told(&[]), told(&[set.into()])), (false, true), "{set}");
    }
}
