//! Drives that run by themselves: moves, retunes and reads without a jump under serial faults, and a bit-identical
//! replay of the trace buffer.
//!
//! The tests first run in this process, where every tick is visible. Then the images run on the emulated target, with
//! the commands of a user.

use controller_core::drive::{MotorDesign, MotorDrive, Position};
use controller_core::{Health, Limits};
use integration_tests::data::path;
use integration_tests::deep;
use integration_tests::live::{Bench, DESIGN, PERIOD_S, loadable};
use integration_tests::program::{CommandResult, Folder, host_sim};
use link::black_box::{Again, BlackBox};
use link::live::LiveDrive;
use link::transport::faulty::Rates;
use link::transport::{Faulty, Transport};
use loop_sim::port::PortError;
use pil_wire::{Disturbance, Order, halves};
use std::time::Duration;

const REPLY_WITHIN: Duration = Duration::from_millis(50);

fn connect<T: Transport>(wire: T) -> LiveDrive<T> {
    LiveDrive::connect(wire, REPLY_WITHIN).unwrap_or_else(|error| panic!("{error}"))
}

fn bad_wire(seed: u64) -> Faulty<Bench> {
    Faulty::new(Bench::new(), Rates::all(0.05), seed)
}

fn told<V: std::fmt::Debug>(result: Result<V, PortError>) -> String {
    match result {
        Err(PortError::Refused(why)) => why,
        other => panic!("not refused: {other:?}"),
    }
}

/// Waits until the plan is over.
fn arrive<T: Transport>(drive: &mut LiveDrive<T>) {
    while drive.observe().unwrap_or_else(|error| panic!("{error}")).moving {}
}

/// Runs moves, new moves in flight, and gain switches in flight. Returns the tick of each gain switch.
fn moved_and_tuned<T: Transport>(drive: &mut LiveDrive<T>) -> Vec<usize> {
    let mut swaps = Vec::new();
    let surface = DESIGN.bandwidths.surface_rad_s;
    for (angle, share) in [(1.0, 0.7), (-0.5, 1.2)] {
        let [start, ticks] = drive.move_to(angle, 600).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(ticks, 600);
        let swapped = drive.swap(&loadable(&DESIGN.with_surface(share * surface))).unwrap_or_else(|e| panic!("{e}"));
        assert!(swapped.tick > start && swapped.tick < start + ticks, "in flight: {swapped:?} of {start}");
        swaps.push(swapped.tick as usize);
    }
    arrive(drive);
    swaps
}

/// Checks that u changes by at most 0.05 A in the tick of each gain switch. The limit applies to the whole change,
/// including the regular change between two ticks.
fn assert_no_jump(u: &[f32], swaps: &[usize], label: &str) {
    for &tick in swaps {
        let jump = (u[tick] - u[tick - 1]).abs();
        assert!(jump <= 0.05, "{label}: u jumps by {jump} A in tick {tick}: {:?}", &u[tick - 3..tick + 3]);
    }
}

#[test]
fn a_bandwidth_and_a_goal_sent_in_flight_leave_no_jump_on_a_bad_wire_too() {
    let mut drive = connect(Bench::new());
    let swaps = moved_and_tuned(&mut drive);
    assert_no_jump(&drive.transport().chip.u, &swaps, "good wire");
    assert!((drive.transport().chip.angle_rad() + 0.5).abs() < 2e-3);
    for seed in 0..4 {
        let mut drive = connect(bad_wire(seed));
        let swaps = moved_and_tuned(&mut drive);
        let chip = &drive.transport().inner().chip;
        assert_no_jump(&chip.u, &swaps, &format!("seed {seed}"));
        assert!((chip.angle_rad() + 0.5).abs() < 2e-3, "seed {seed}: {}", chip.angle_rad());
        assert!(drive.traffic().repeated > 5, "seed {seed}: {:?}", drive.traffic());
    }
}

/// Trips a drive at a turning point, where only the monitors detect the fault.
fn tripped<T: Transport>(drive: &mut LiveDrive<T>) -> BlackBox {
    drive.move_to(0.4, 0).unwrap_or_else(|error| panic!("{error}"));
    arrive(drive);
    let stuck = Disturbance { stuck: [true, false], load_n_m: 0.02, ..Disturbance::default() };
    drive.disturb(stuck).unwrap_or_else(|error| panic!("{error}"));
    let began = drive.observe().unwrap_or_else(|error| panic!("{error}")).tick;
    loop {
        let seen = drive.observe().unwrap_or_else(|error| panic!("{error}"));
        if seen.health.contains(Health::STOPPED) {
            assert!(seen.frozen && seen.u == 0.0, "{seen:?}");
            break;
        }
        assert!(seen.tick < began + 3000, "no alarm: {seen:?}");
    }
    drive.black_box().unwrap_or_else(|error| panic!("{error}"))
}

/// In motion a frozen count soon resembles an impossible load (14 ticks, as in the tests of the monitors). The drive
/// stops, and its trace buffer replays identically.
#[test]
fn a_count_that_sticks_in_motion_stops_the_drive_as_soon_as_its_monitors_do() {
    fn alarm_after_sticking<T: Transport>(drive: &mut LiveDrive<T>) -> u32 {
        drive.move_to(3.0, 1000).unwrap_or_else(|error| panic!("{error}"));
        let began = loop {
            let seen = drive.observe().unwrap_or_else(|error| panic!("{error}"));
            if seen.reference > 0.5 {
                break seen.tick;
            }
        };
        let stuck = Disturbance { stuck: [true, false], load_n_m: 0.0, ..Disturbance::default() };
        drive.disturb(stuck).unwrap_or_else(|error| panic!("{error}"));
        while !drive.observe().unwrap_or_else(|error| panic!("{error}")).frozen {}
        let remembered = drive.black_box().unwrap_or_else(|error| panic!("{error}"));
        let again = remembered.replay().unwrap_or_else(|error| panic!("{error}"));
        let last = again.last().expect("ticks");
        assert!(again.iter().all(Again::is_same), "{last:?}");
        assert!(last.then.health.contains(Health::STOPPED) && last.then.u == 0.0, "{last:?}");
        last.tick - began
    }
    // Two requests and replies of 7 ticks each lie between.
    let ticks = alarm_after_sticking(&mut connect(Bench::new()));
    assert!((2..=14 + 14).contains(&ticks), "{ticks}");
    for seed in 0..4 {
        // The arrival time of the request that freezes the count is unknown here.
        assert!(alarm_after_sticking(&mut connect(bad_wire(seed))) >= 2);
    }
}

#[test]
fn a_black_box_runs_again_to_the_bit_as_a_file_and_over_a_bad_wire_too() {
    let boxes = [tripped(&mut connect(Bench::new())), tripped(&mut connect(bad_wire(9)))];
    for black_box in boxes {
        assert!(black_box.len() >= 256);
        let back = BlackBox::from_text(&black_box.to_text()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back.to_text(), black_box.to_text());
        let again = back.replay().unwrap_or_else(|error| panic!("{error}"));
        assert!(again.len() == black_box.len() && again.iter().all(Again::is_same));
        assert!(again.last().expect("ticks").then.health.contains(Health::STOPPED));
        // Another design on the recorded counts starts without a jump, except for its observer's response to this
        // sample. Its later results differ.
        let other = loadable(&DESIGN.with_surface(0.6 * DESIGN.bandwidths.surface_rad_s));
        let other = back.replay_with(&other).unwrap_or_else(|error| panic!("{error}"));
        assert!((other[0].now.u - other[0].then.u).abs() < 0.05, "{:?}", other[0]);
        assert!(other.iter().any(|tick| (tick.now.u - tick.then.u).abs() > 0.05));
    }
}

#[test]
fn a_black_box_that_is_damaged_or_foreign_is_refused_with_the_line() {
    let text = tripped(&mut connect(Bench::new())).to_text();
    let refused = |text: &str| BlackBox::from_text(text).expect_err("a refusal");
    let lines: Vec<&str> = text.lines().collect();
    let frame = lines.iter().position(|line| line.starts_with("frame,")).expect("a frame");
    let without = |k: usize| [&lines[..k], &lines[k + 1..]].concat().join("\n");
    assert!(refused("a,b\n").starts_with("line 1: not a trace buffer"));
    assert!(refused(&lines[..frame].join("\n")).contains("incomplete"));
    assert!(refused(&without(frame + 3)).starts_with(&format!("line {}: tick ", frame + 4)));
    assert!(refused(&text.replacen("number,period_s,0.001", "number,period_s,0.002", 1)).contains("damaged"));
    assert!(refused(&text.replacen("core,", "core,9", 1)).starts_with("line 2: "));
    for k in 0..lines.len() {
        assert!(BlackBox::from_text(&without(k)).is_err(), "without line {}", k + 1);
    }
    // An edited file with a valid checksum: the reader still checks the rest.
    let sealed = |text: &str| {
        let body = &text[..text.rfind("sum,").expect("a sum")];
        format!("{body}sum,{:08x}\n", pil_wire::checksum(body.as_bytes()))
    };
    let second = lines.iter().rposition(|line| line.starts_with("ticks,")).expect("a half");
    let state = lines[second + 3];
    assert!(state.starts_with("state,") && second > frame, "two halves");
    let edits = [
        (lines[1].to_owned() + "\n", String::new(), "`core` or `layout` is missing"),
        (lines[1].to_owned(), format!("{0}\n{0}", lines[1]), "duplicate line"),
        ("number,period_s,".into(), "number,period,".into(), "where \"period_s\" should be"),
        (lines[3].to_owned(), lines[3].to_owned() + ",7", "too many fields"),
        (lines[second - 1].to_owned() + "\n", String::new(), "should be"),
    ];
    for (from, to, why) in edits {
        let told = refused(&sealed(&text.replacen(&from, &to, 1)));
        assert!(told.contains(why), "{told}");
    }
    let half = text.rfind(state).expect("the state");
    let other = sealed(&format!("{}state,3f800001{}", &text[..half], &text[half + state.len()..]));
    let other = BlackBox::from_text(&other).unwrap_or_else(|error| panic!("{error}"));
    assert!(other.replay().expect_err("a refusal").contains("is not the result of the ticks before it"));
    let slow = loadable(&MotorDesign { period_s: 2e-3, ..DESIGN });
    assert!(other.replay_with(&slow).expect_err("a refusal").contains("period"));
    // Tick numbers wrap.
    let mut wrapped = BlackBox::from_text(&text).unwrap_or_else(|error| panic!("{error}"));
    let shift = u32::MAX - wrapped.halves[0].first - 20;
    wrapped.halves.iter_mut().for_each(|half| half.first = half.first.wrapping_add(shift));
    let wrapped = BlackBox::from_text(&wrapped.to_text()).unwrap_or_else(|error| panic!("{error}"));
    assert!(wrapped.replay().is_ok_and(|again| again.iter().all(Again::is_same) && again[30].tick == 9));
}

#[test]
fn what_is_refused_leaves_the_drive_as_it_was() {
    let mut drive = connect(Bench::new());
    drive.move_to(0.2, 400).unwrap_or_else(|error| panic!("{error}"));
    let design = drive.design().clone();
    // Each with a word that its error message must contain.
    let slow = MotorDesign { period_s: 2e-3, ..DESIGN };
    let wild = MotorDesign { gate_steps: f64::NAN, ..DESIGN };
    let mut other_form = loadable(&DESIGN);
    other_form.instance.mask = 0;
    let one_way = MotorDesign { limits: Limits { min: 1.0, max: 10.0 }, ..DESIGN };
    // Bounds of the monitors, counted from the end: disturbance, sigma*; then the stopping alarms.
    let monitored = |from_end: usize, number: f64| {
        let mut design = loadable(&DESIGN);
        let at = design.words.len() - from_end;
        design.words[at..at + 2].copy_from_slice(&halves(number));
        (design, "the target rejects the numbers")
    };
    let swaps = [
        monitored(8, f64::NAN),
        monitored(8, -1.0),
        monitored(6, 0.0),
        monitored(2, -53.0),
        monitored(2, 0.5),
        monitored(2, f64::NAN),
        (loadable(&slow), "drive.period_s = 0.002: the firmware ticks every 0.001 s. Build firmware"),
        (loadable(&wild), "the target rejects the numbers"),
        (other_form, "has no motor's drive with 3 states in its observer (drive.observer_states), one gain set"),
    ];
    assert!(MotorDrive::<f32, Position>::try_design(&one_way).is_err());
    for (design, why) in swaps {
        let told = told(drive.swap(&design));
        assert!(told.contains(why), "{told}");
    }
    for (angle, ticks, why) in
        [(f64::NAN, 0, "not a number"), (1e6, 0, "10000 revolutions"), (2.0, 5, " s or more"), (2.0, 21, " s or more")]
    {
        let told = told(drive.move_to(angle, ticks));
        assert!(told.contains(why), "{angle} in {ticks}: {told}");
    }
    assert!(told(drive.order(Order::Reset)).contains("has not stopped"));
    assert!(told(drive.black_box()).contains("freeze it first"));
    assert_eq!(*drive.design(), design);
    arrive(&mut drive);
    assert!((drive.transport().chip.angle_rad() - 0.2).abs() < 2e-3, "{}", drive.transport().chip.angle_rad());

    // A move one tick shorter than the limit is rejected, and the suggested duration is accepted.
    let told = told(drive.move_to(2.0, 21));
    assert!(told.starts_with("0.021 s is too short"), "{told}");
    let words = told.strip_suffix(" s or more").expect("the shortest duration");
    let needed_s: f64 = words.rsplit(' ').next().and_then(|word| word.parse().ok()).expect("a number");
    assert!(drive.move_to(2.0, (needed_s / PERIOD_S).round() as u32).is_ok());
}

/// A drive that starts in motion brakes, and runs all revolutions of its braking back.
#[test]
fn a_reset_is_refused_while_the_shaft_turns_and_accepted_at_rest() {
    for wire in 0..3 {
        let mut drive = connect(Faulty::new(Bench::new(), Rates::all(if wire > 0 { 0.05 } else { 0.0 }), wire));
        tripped(&mut drive);
        drive.disturb(Disturbance::default()).unwrap_or_else(|error| panic!("{error}"));
        // The count jumps when it is released, and must not do so during the measurement.
        let released = drive.observe().unwrap_or_else(|error| panic!("{error}")).tick;
        while drive.observe().unwrap_or_else(|error| panic!("{error}")).tick == released {}
        // The drive ran away behind the frozen count. Friction takes seconds to brake it.
        let (mut refused, mut slowest) = (0, f64::INFINITY);
        loop {
            let fastest = drive.transport().inner().chip.speed_rad_s().abs();
            let ticks = drive.transport().inner().chip.u.len();
            match drive.order(Order::Reset) {
                Ok(()) => break,
                Err(PortError::Refused(why)) => {
                    let speed = why.strip_prefix("a shaft turns at ").and_then(|rest| rest.split(' ').next());
                    let speed: f64 = speed.and_then(|speed| speed.parse().ok()).unwrap_or_else(|| panic!("{why}"));
                    let slower = drive.transport().inner().chip.speed_rad_s().abs();
                    assert!((slower - 0.1..fastest + 0.1).contains(&speed), "{why}: {fastest} to {slower} rad/s");
                    assert!(why.contains(" r/min)") && why.contains("0.5 rad/s (4.8 r/min)"), "{why}");
                    assert!(why.ends_with("Wait until it is at rest, then `reset`"), "{why}");
                    (refused, slowest) = (refused + 1, speed.min(slowest));
                    // It stays stopped.
                    assert!(drive.transport().inner().chip.u[ticks..].iter().all(|u| *u == 0.0));
                }
                Err(error) => panic!("{error}"),
            }
        }
        // Refused down to a turn in 10 s, and from there on the drive stays where it is.
        assert!(refused > 5 && slowest < 2.0, "{refused}, {slowest}");
        let here = drive.transport().inner().chip.angle_rad();
        (0..100).for_each(|_| _ = drive.observe().unwrap_or_else(|error| panic!("{error}")));
        let there = drive.transport().inner().chip.angle_rad();
        assert!((there - here).abs() < 0.02, "from {here} to {there} rad");
    }
}

#[test]
fn a_drive_that_has_stopped_starts_again_where_it_is() {
    let mut drive = connect(Bench::new());
    tripped(&mut drive);
    assert!(told(drive.move_to(0.0, 0)).contains("reset it first"));
    assert!(told(drive.swap(&loadable(&DESIGN))).contains("would erase it"));
    drive.disturb(Disturbance::default()).unwrap_or_else(|error| panic!("{error}"));
    // The drive ran away behind the frozen count; only friction brakes it.
    let still = (0..20_000).any(|_| {
        let before = drive.transport().chip.angle_rad();
        drive.observe().unwrap_or_else(|error| panic!("{error}"));
        (drive.transport().chip.angle_rad() - before).abs() < 1e-6
    });
    assert!(still, "{} rad", drive.transport().chip.angle_rad());
    drive.order(Order::Reset).unwrap_or_else(|error| panic!("{error}"));
    let here = drive.transport().chip.angle_rad();
    let ticks = drive.transport().chip.u.len();
    for _ in 0..50 {
        let seen = drive.observe().unwrap_or_else(|error| panic!("{error}"));
        assert!(!seen.health.contains(Health::STOPPED) && !seen.frozen, "{seen:?}");
    }
    let chip = &drive.transport().chip;
    let peak = chip.u[ticks..].iter().fold(0.0_f32, |peak, u| peak.max(u.abs()));
    assert!((chip.angle_rad() - here).abs() < 5e-3 && peak < 1.0, "from {here} to {}, {peak} A", chip.angle_rad());
    drive.move_to(0.0, 0).unwrap_or_else(|error| panic!("{error}"));
    arrive(&mut drive);
    // The drive lost the number of whole revolutions, so the angle is checked up to whole revolutions.
    let turns = drive.transport().chip.angle_rad() / std::f64::consts::TAU;
    assert!((turns - turns.round()).abs() < 3e-4, "{turns}");
}

/// Runs commands on an image of the firmware.
fn live(folder: &Folder, image: &str, script: &str, more: &[&str]) -> CommandResult {
    let at = |name: &str| path("../firmware/target/thumbv7em-none-eabihf/release").join(name).display().to_string();
    let (file, scenario) = (folder.path("script"), path("../firmware").join(image).with_extension("toml"));
    std::fs::write(&file, script).expect("a file");
    let (image, scenario) = (at(image), scenario.display().to_string());
    host_sim(&[&["live", scenario.as_str(), "--image", &image, "--script", &file], more].concat())
}

/// For a scenario of another form than the target's, the error message names the keys that select both forms.
#[test]
fn a_scenario_of_another_form_is_refused_with_the_keys_that_differ() {
    let folder = Folder::new("live-form");
    let text = std::fs::read_to_string(path("../firmware/drive.toml")).expect("the scenario");
    let file = folder.path("mine.toml");
    std::fs::write(&file, text.replace("tuning = \"coupled\"", "tuning = \"normal\"")).expect("room");
    let image = path("../firmware/target/thumbv7em-none-eabihf/release/drive").display().to_string();
    std::fs::write(folder.path("script"), "show\n").expect("room");
    let said = host_sim(&["live", &file, "--image", &image, "--script", &folder.path("script")]);
    let told = "drive.tuning = \"normal\", ..: one observer per encoder: the firmware has drive.tuning = \"coupled\". \
                Give the scenario of this firmware";
    assert!(said.status == 2 && said.err.contains(told), "{said:?}");
}

/// Every message is in keys and units that the user types, and its remedy helps: no `reset` changes an encoder.
#[test]
fn a_message_of_live_names_keys_and_units_as_they_are_typed() {
    let folder = Folder::new("live-messages");
    let fixed = "are fixed in the firmware (";
    for (line, told) in [
        (
            "set encoder.bits=12",
            &["encoder.bits = 12: ", fixed, "(encoder.bits = 14). Build firmware from a scenario"][..],
        ),
        // The rule for the bandwidths also rejects so few bits, but no margin helps.
        ("set encoder.bits=8", &["encoder.bits = 8: ", fixed, "(encoder.bits = 14). Build firmware from a scenario"]),
        ("set motor.gear=[2,1]", &["motor.gear[1] = 2: ", fixed, "(motor.gear[1] = 1). Build firmware"]),
        (
            "set drive.period_s=1e-3",
            &["drive.period_s = 0.001: ", fixed, "(drive.period_s = 0.0002 s). Build firmware"],
        ),
        ("set drive.gain_sets=1", &["set: drive.gain_sets = 1: the firmware has drive.gain_sets = 2. Build firmware"]),
        (
            "set drive.mode='speed'",
            &["drive.mode = \"speed\": the firmware has drive.mode = \"position\". ", "Simulate a speed drive"],
        ),
        // Its own range comes first: no firmware has it.
        (
            "set encoder.bits=40",
            &["set: encoder.bits=40: `encoder.bits`: found 40, expected a whole number at least 2"],
        ),
        ("set drive.lost_ticks=50", &["set: drive.lost_ticks=50: no change: the drive runs with this value"]),
        ("set span_s=2", &["set: span_s=2: no change"]),
        ("set drive.surface_rad_s=2000", &["set: drive.surface_rad_s=2000: ", "lower those of [drive], or leave"]),
        ("load 1e9", &["load: 1e9 N m: expected -50.0 to 50.0 N m (100 times the torque at the current limit)"]),
        ("trace /", &["/ is a folder: give the path of a file"]),
        ("set monitor.reaction='joined_stop'", &["joined_stop", "plans no stop", "Set monitor.reaction='brake'"]),
        ("set limits.max_speed_rad_s=5", &["set: ", "limits: the firmware has no limits", "Remove the table [limits]"]),
        (
            "set friction.coulomb_n_m=0.01",
            &["set: friction.coulomb_n_m=0.01: no effect", "Give another value, or a key"],
        ),
        ("set seed=3", &["set: seed=3: no effect"]),
        ("set span_s=3", &["set: span_s=3: no effect"]),
        ("set error.inertia_percent=3", &["set: error.inertia_percent=3: no effect"]),
        ("set encoder.reversed=true", &["set: encoder.reversed=true: no effect"]),
        ("set drive.rest_band='off'", &["set: drive.rest_band='off': no effect"]),
        ("set drive.margin=1.6 drive.rest_band='off'", &["set: drive.rest_band='off': no effect"]),
        ("stick link", &["stick: link: this motor has one encoder, motor. Use `stick motor`"]),
        ("move 1e6", &["move: 1e6 rad: expected -62831 to 62831 rad (10000 revolutions)"]),
        ("trace nowhere/trip", &["nowhere/trip: the folder nowhere does not exist"]),
        ("plot nowhere", &["the folder nowhere does not exist"]),
        ("move 5 0.001", &["move: 0.001 s is too short for 90 % of the current limit", " s or more"]),
        ("reset", &["reset: the drive has not stopped"]),
        ("trace", &["trace: expected `trace FILE [--force]`"]),
        ("blackbox", &["expected `trace FILE [--force]`"]),
    ] {
        let said = live(&folder, "motor", line, &[]);
        assert!(said.status == 2 && told.iter().all(|told| said.err.contains(told)), "{line}: {said:?}");
        assert!(line == "reset" || !said.err.contains("reset"), "{line}: {}", said.err);
    }
    // The motor of the image, with its numbers before a gear of 8, and another torque constant.
    let text = std::fs::read_to_string(path("../firmware/motor.toml")).expect("a scenario");
    let geared = text
        .replace("inertia_kg_m2 = 2e-4", "gear = [8, 1]\ninertia_kg_m2 = 3.125e-6")
        .replace("torque_n_m_per_a = 0.05", "torque_n_m_per_a = 0.007")
        .replace("damping_n_m_s = 1e-5", "damping_n_m_s = 1.5625e-7")
        .replace("bits = 14", "bits = 14\nbehind_gear = true");
    let (file, script) = (folder.path("geared.toml"), folder.path("script"));
    std::fs::write(&file, geared).expect("room");
    std::fs::write(&script, "quit\n").expect("room");
    let image = path("../firmware/target/thumbv7em-none-eabihf/release/motor").display().to_string();
    let said = host_sim(&["live", &file, "--image", &image, "--script", &script]);
    let note = format!("note: motor.torque_n_m_per_a = 0.00625 N m/A on the drive, 0.007 N m/A in {file}\n");
    assert!(said.status == 0 && said.err.contains(&note), "{said:?}");
    assert!(!said.err.contains("inertia_kg_m2") && !said.err.contains("damping"), "{}", said.err);
}

/// Without a scenario and with another image the message names the remedy.
#[test]
fn a_session_without_a_scenario_and_an_image_of_another_kind_are_refused_with_the_remedy() {
    let folder = Folder::new("live-kinds");
    let at = |name: &str| path("../firmware/target/thumbv7em-none-eabihf/release").join(name).display().to_string();
    let scenario = path("../firmware/motor.toml").display().to_string();
    let (script, [motor, pil]) = (folder.path("script"), ["motor", "pil"].map(at));
    std::fs::write(&script, "set drive.margin=1.6\n").expect("room");
    for (arguments, told) in [
        (
            &["live", "--image", &motor, "--script", &script][..],
            "set: drive.margin=1.6: this session has no scenario. Start",
        ),
        (&["live", &scenario, "--image", &pil, "--script", &script], "pil is the firmware `drive` or `motor` of this"),
        (&["pil", &scenario, "--image", &motor], "motor is the firmware `pil` of this version"),
    ] {
        let said = host_sim(arguments);
        assert!(said.status != 0 && said.err.contains(told), "{arguments:?}: {said:?}");
    }
}

/// Every command confirms its effect with label, value and unit, and no file is overwritten without `--force`.
#[test]
fn a_session_confirms_its_commands_and_keeps_files() {
    let folder = Folder::new("live-confirms");
    let (trip, plot) = (folder.path("my trip"), folder.path(""));
    let script = format!(
        "help\nstick motor\nstick\nload '0.01'\nload 0\nrelease\nset 'drive.margin=\"standard\"'\nset \
         drive.margin='fast'\ntrace '{trip}'\nplot {plot}\nplot {plot} --force\ntrace --force '{trip}'\n"
    );
    let said = live(&folder, "motor", &script, &[]);
    assert_eq!(said.status, 0, "{said:?}");
    for told in [
        "  quit                    leave the drive as it is\n",
        "stick: frozen encoders: motor\nstick: frozen encoders: none\nload: 0.01 N m\nload: 0 N m\n",
        "release: the trace buffer is empty and records\nset drive.margin=\"standard\": active from t = ",
        "my trip: the last ",
        "live.png: ",
        " observations, t = ",
    ] {
        assert!(said.out.contains(told), "{told}: {}", said.out);
    }
    for (line, file) in [(format!("trace '{trip}'"), "my trip"), (format!("plot {plot}"), "live.png")] {
        let said = live(&folder, "motor", &line, &[]);
        let kept = format!("{file} already exists and was not changed; --force overwrites it");
        assert!(said.status == 2 && said.err.contains(&kept), "{said:?}");
    }
    for option in ["--record", "--page"] {
        let said = live(&folder, "motor", "quit", &[option, &trip]);
        assert!(said.status == 2 && said.err.contains("already exists"), "{option}: {said:?}");
        let said = live(&folder, "motor", "quit", &[option, &trip, "--force"]);
        assert_eq!(said.status, 0, "{option}: {said:?}");
    }
    // Other designs of a replay follow the rules of `set`.
    let (trace, script) = (folder.path("trace"), format!("wait 0.1\ntrace {}\n", folder.path("trace")));
    assert_eq!(live(&folder, "motor", &script, &[]).status, 0);
    for (set, told) in [
        ("drive.gain_sets=1", "--set: drive.gain_sets = 1: the recorded drive has drive.gain_sets = 2. Use"),
        ("encoder.bits=12", "--set: encoder.bits = 12: period, encoder and gear are fixed in the recorded drive"),
        ("friction.coulomb_n_m=0.1", "--set: friction.coulomb_n_m=0.1: no effect"),
    ] {
        let said = host_sim(&["replay", &trace, "--set", set]);
        assert!(said.status == 2 && said.err.contains(told), "{set}: {said:?}");
    }
}

/// An alarm has one line with its first tick and its cause under every reaction. Its trace buffer is not lost silently.
#[test]
fn an_alarm_is_reported_once_with_its_cause_under_every_reaction() {
    let folder = Folder::new("live-alarms");
    let bound = ": disturbance over bound: motor load 0.";
    for (reaction, then) in [("tell", "goes on"), ("brake", "brakes"), ("fallback", "has stopped")] {
        let file = folder.path(reaction);
        let set = if reaction == "brake" { String::new() } else { format!("set monitor.reaction='{reaction}'\n") };
        let script = format!("{set}load 0.25 0.5\nwait 1.5\ntrace {file}\nrelease\nwait 0.1\n");
        let said = live(&folder, "motor", &script, &[]);
        // A stopped drive would freeze the buffer again at once.
        let is_stopped = said.err.contains("release: the drive is stopped, and its trace buffer would freeze at once");
        assert_eq!((said.status == 2, is_stopped), (reaction != "tell", reaction != "tell"), "{reaction}: {said:?}");
        let alarms: Vec<&str> = said.err.lines().filter(|line| line.starts_with("alarm at t = ")).collect();
        assert_eq!(alarms.len(), 1, "{reaction}: {}", said.err);
        assert!(
            alarms[0].contains(bound) && alarms[0].contains(" N m, monitor.load_n_m = 0.20625 N m"),
            "{}",
            alarms[0]
        );
        // Braking may have ended before the observation.
        assert!(alarms[0].contains(then) || reaction == "brake", "{reaction}: {}", alarms[0]);
        // The saved buffer ends with the tick of the alarm.
        let saved =
            said.out.lines().find(|line| line.starts_with("alarm at t = ")).unwrap_or_else(|| panic!("{said:?}"));
        let tick = |line: &str| line.split_once(')').map(|(begin, _)| begin.to_owned());
        assert!(saved.contains(bound) && tick(saved) == tick(alarms[0]), "{saved}, {}", alarms[0]);
    }
    let trip = "wait 0.1\nload 0.6 0.05\nwait 6\n";
    let said = live(&folder, "motor", &format!("{trip}release\n"), &[]);
    assert!(said.status == 2 && said.err.contains("release: the trace buffer holds the alarm at t = "), "{said:?}");
    assert!(said.err.contains("Save it with `trace FILE`, then `reset`"), "{said:?}");
    let said = live(&folder, "motor", &format!("{trip}reset\n"), &[]);
    assert!(
        said.status == 0 && said.out.contains("discarded the unsaved trace buffer of the alarm at t = "),
        "{said:?}"
    );
}

/// The message gives the speed, and waiting is the remedy.
#[test]
fn a_reset_in_the_emulator_is_refused_with_the_speed_and_accepted_at_rest() {
    let folder = Folder::new("live-brakes");
    // 0.6 N m is more than the current limit holds: the load turns the shaft, the drive brakes in vain and stops.
    let trip = |s: &str| format!("wait 0.1\nload 0.6 {s}\nwait {s}\n");
    let said = live(&folder, "motor", &format!("{}reset\n", trip("0.25")), &[]);
    assert!(said.status == 2 && said.err.contains("reset: ") && said.err.contains(" r/min)"), "{said:?}");
    assert!(said.err.contains("Wait until ") && said.err.contains(", then `reset`"), "{said:?}");
    // Without the load friction brings the shaft to rest, and the drive starts again there.
    let script = format!("{}wait 6\nreset\nwait 0.1\nshow\nquit\n", trip("0.05"));
    let said = live(&folder, "motor", &script, &[]);
    let shown = said.out.lines().find(|line| line.starts_with("t = ")).unwrap_or_else(|| panic!("{said:?}"));
    assert!(said.status == 0 && said.err.contains("alarm at t = ") && !shown.contains("stopped"), "{said:?}");
}

/// An alarm during a design download: the trace buffer keeps the ticks before the alarm, and the design is rejected.
#[test]
fn an_alarm_in_the_midst_of_a_swap_keeps_its_black_box() {
    let mut kept = 0;
    for early in 0..60 {
        let mut bench = Bench::new();
        bench.chip.ticks_between = 20;
        let mut drive = connect(bench);
        drive.move_to(0.4, 0).unwrap_or_else(|error| panic!("{error}"));
        arrive(&mut drive);
        let stuck = Disturbance { stuck: [true, false], load_n_m: 0.02, ..Disturbance::default() };
        drive.disturb(stuck).unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..early {
            drive.observe().unwrap_or_else(|error| panic!("{error}"));
        }
        let swapped = drive.swap(&loadable(&DESIGN.with_surface(0.8 * DESIGN.bandwidths.surface_rad_s)));
        while !drive.observe().unwrap_or_else(|error| panic!("{error}")).frozen {}
        let black_box = drive.black_box().unwrap_or_else(|error| panic!("{error}"));
        let again = black_box.replay().unwrap_or_else(|error| panic!("{error}"));
        let first = again[0].tick;
        assert!(
            again.iter().all(Again::is_same) && again.last().is_some_and(|it| it.then.health.contains(Health::STOPPED))
        );
        match swapped {
            Ok(swapped) => assert!(first >= swapped.tick, "{first} of {swapped:?}"),
            Err(PortError::Refused(_)) => kept += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(kept > 0);
}

/// The trace buffer freezes again as soon as it is released, because the alarm lasts. The protection of the old ticks
/// must not block the design that ends the alarm.
#[test]
fn an_alarm_that_lasts_and_stops_nothing_does_not_keep_out_a_better_design() {
    let good = loadable(&DESIGN);
    let mut anxious = good.clone();
    let count = anxious.words.len();
    // Bounds of the monitors on a disturbance and on sigma*; the stopping alarms.
    let numbers = [(16, 1e-6), (14, 1e-9), (2, 0.0)];
    for (from_end, number) in numbers {
        anxious.words[count - from_end..][..2].copy_from_slice(&halves(number));
    }
    let mut drive = connect(Bench::new());
    drive.move_to(0.5, 0).unwrap_or_else(|error| panic!("{error}"));
    drive
        .disturb(Disturbance { stuck: [false; 2], load_n_m: 0.02, ..Disturbance::default() })
        .unwrap_or_else(|error| panic!("{error}"));
    drive.swap(&anxious).unwrap_or_else(|error| panic!("{error}"));
    let seen = loop {
        let seen = drive.observe().unwrap_or_else(|error| panic!("{error}"));
        if seen.frozen {
            break seen;
        }
    };
    assert!(!seen.health.contains(Health::STOPPED), "{seen:?}");
    assert!(told(drive.swap(&good)).contains("trace buffer"));
    drive.order(Order::Release).unwrap_or_else(|error| panic!("{error}"));
    assert!(drive.observe().unwrap_or_else(|error| panic!("{error}")).frozen, "the alarm does not last");
    drive.swap(&good).unwrap_or_else(|error| panic!("{error}"));
    assert!(!drive.observe().unwrap_or_else(|error| panic!("{error}")).frozen);
}

/// Returns the change of u in the output line of a `set`.
fn jump(spoken: &CommandResult) -> f64 {
    let line = spoken.out.lines().find(|line| line.starts_with("set ")).unwrap_or_else(|| panic!("{spoken:?}"));
    let (_, numbers) = line.split_once(" ticks, u ").expect("both");
    let numbers = numbers.split_once(" A after; phase margin ").expect("an end").0.split(" A before, ");
    let numbers: Vec<f64> = numbers.map(|u| u.parse().expect("u")).collect();
    (numbers[1] - numbers[0]).abs()
}

#[test]
fn the_images_are_moved_and_tuned_in_flight_and_trip_and_their_black_boxes_run_again_to_the_bit() {
    let cases = [
        // By rule the encoder quantisation of both encoders moves u by 0.03 A rms.
        ("drive", "stick link motor", "set drive.margin='standard'", "drive.margin=1.6", 0.15),
        // 14 bits alone move u by this much per tick: the current noise by rule is 0.1 A rms.
        ("motor", "stick motor", "set drive.surface_rad_s=120", "drive.surface_rad_s=100", 0.2),
    ];
    // The fast tier runs the motor on a good link.
    let fast = usize::from(!deep());
    for (image, stick, set, other, most_a) in cases.into_iter().skip(fast) {
        let wires = [&[][..], &["--faults", "0.05", "--seed", "4"]];
        for wire in &wires[..2 - fast] {
            let label = format!("{image} {wire:?}");
            let folder = Folder::new(&format!("live-{image}-{}", wire.len()));
            let file = folder.path("trip");
            let trace = if image == "motor" { "trace" } else { "blackbox" };
            let (record, page) = (folder.path("seen.csv"), folder.path("page.html"));
            // The last move comes before any freeze, because a stopped drive rejects moves.
            let script = format!(
                "move 1.0 2.0\n{set}\nwait 2.1\nmove 0.5 2.0\nwait 2.1\nshow\nmove 0.8 1.0\n{stick}\nload 0.02\n\
                 wait 4\nshow\n{trace} {file}\n"
            );
            let options = [&["--record", &record, "--page", &page], *wire].concat();
            let (spoken, moved) = std::thread::scope(|scope| {
                let spoken = scope.spawn(|| live(&folder, image, &script, &options));
                let mut moved = false;
                while !spoken.is_finished() {
                    moved |= std::fs::read_to_string(&page).is_ok_and(|page| page.contains("http-equiv=\"refresh\""));
                    std::thread::sleep(Duration::from_millis(20));
                }
                (spoken.join().expect("no panic"), moved)
            });
            assert_eq!(spoken.status, 0, "{label}: {spoken:?}");
            // The target matches its scenario: no note reports a different number.
            assert!(!spoken.err.contains("note:"), "{label}: {}", spoken.err);
            assert!(jump(&spoken) <= most_a, "{label}: {}", spoken.out);
            let shown: Vec<&str> = spoken.out.lines().filter(|line| line.starts_with("t = ")).collect();
            assert!(shown[0].contains("r = 0.500000 rad"), "{label}: {}", shown[0]);
            assert!(shown[1].contains("stopped"), "{label}: {}", shown[1]);
            // Every number has a unit, and the estimates of a stopped drive are not shown as present ones.
            assert!(spoken.out.contains(" instructions in ") && shown[1].contains(" instructions, "), "{}", spoken.out);
            assert!(shown[0].contains("; motor ") && !shown[1].contains("; motor "), "{label}: {shown:?}");
            let old: Vec<&str> =
                spoken.out.lines().filter(|line| line.starts_with("estimates of the tick of")).collect();
            assert!(old.len() == 1 && old[0].contains("motor "), "{label}: {}", spoken.out);
            assert!(std::fs::read_to_string(&record).expect("a record").lines().any(|line| line.contains(",,,")));
            let rows = std::fs::read_to_string(&record).expect("a record").lines().count();
            assert!(rows > 10 && std::path::Path::new(&folder.path("seen.svg")).exists(), "{label}: {rows}");
            // The page refreshes in the browser while the drive is observed; the last page is static.
            let last = std::fs::read_to_string(&page).expect("a page");
            assert!(moved && last.contains("<svg") && !last.contains("http-equiv"), "{label}");

            let again = host_sim(&["replay", &file, "--set", other, "--out", &folder.path("replay")]);
            assert_eq!(again.status, 0, "{label}: {again:?}");
            // One verdict, in the last line, that agrees with the table.
            let verdict = again.out.lines().last().unwrap_or_default();
            assert!(verdict.starts_with("result: identical bits in ") && verdict.ends_with("with the other design"));
            let off = verdict.split("; ").nth(1).and_then(|off| off.split(' ').next()).expect("a number");
            assert!(off.parse::<u32>().is_ok_and(|off| off > 0), "{label}: {}", again.out);
            assert!(again.out.contains("first alarm") && !again.out.contains("0 differ"), "{label}: {}", again.out);
            let again = host_sim(&["replay", &file]);
            assert!(
                again.status == 0
                    && again.out.lines().last().is_some_and(|line| {
                        line.starts_with("result: identical bits in ") && line.ends_with(" ticks")
                    }),
                "{label}: {again:?}"
            );
        }
    }
}
