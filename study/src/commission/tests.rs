//! Self-commissioning on plants up to 50 % off, with friction, cogging, ripple, load and an unknown current. It must
//! succeed there and refuse unsuitable cases. The plants are the ones of `host-sim commission --within 50`.

use loop_sim::port::drive::DriveOf;
use loop_sim::signal::Signal;
use rayon::prelude::*;
use scenario::Source;

use super::plants::{PlantResult, Plants, Variant, made_wrong};
use super::*;
use crate::identify::{Angle, MOST_RESIDUAL_STEPS};
use crate::sized;

fn plants<'a>(text: &'a str, sets: &'a [String]) -> Plants<'a> {
    let experiment = scenario::parse(&Source { file: "x.toml", text, sets }, "x").expect("a file");
    let designed = experiment.drive.as_ref().expect("a drive").designed;
    let known = PlantData::with_lag(0.0);
    let plan = Plan::of(&designed);
    Plants { file: "x.toml", text, sets, share: 0.5, random: 30, plan, known, wrong: [1.0; 2] }
}

fn sets(of: &[&str]) -> Vec<String> {
    of.iter().map(ToString::to_string).collect()
}

/// Returns all items at full size (`DEEP=1`), every `n`th in the fast tier.
fn sampled<I: IntoIterator>(all: I, n: usize) -> std::iter::StepBy<I::IntoIter> {
    all.into_iter().step_by(sized(1, n))
}

/// Commissions the corners in k_1, b_1, k_2, b_2, B_0, one bit each, then random plants.
fn all(plants: &Plants<'_>) -> Vec<(usize, PlantResult)> {
    let variants = plants.variants().expect("a joint");
    let tried = |(k, it)| (k, plants.tried(it).unwrap_or_else(|why| panic!("plant {k}: {why}")));
    let chosen: Vec<(usize, &Variant)> = sampled(variants.iter().enumerate(), 19).collect();
    chosen.into_par_iter().map(tried).collect()
}

#[test]
fn joints_that_are_off_by_half_commission_themselves_at_20_bits() {
    let sets = sets(&["joint.current_lag_s=0"]);
    for (k, PlantResult { off, over_interval, report }) in all(&plants(scenario::JOINT, &sets)) {
        let Verified { peak_rad, true_peak_rad, residual_steps, .. } = report.verified;
        let true_peak_rad = true_peak_rad.expect("a simulation");
        println!("{k}: {off:?} {over_interval:.2} move {peak_rad:.1e} {true_peak_rad:.1e} left {residual_steps:?}");
        assert_eq!(report.outcome, Outcome::Accepted, "plant {k}");
        assert!(true_peak_rad <= 1e-4, "plant {k}: {true_peak_rad:e}");
        // The expected error of this joint is small, so its threshold is the smallest one.
        assert!(
            report.verified.expected_rad.expect("a joint") < 0.5 * LEAST_BAR_RAD,
            "plant {k}: {:?}",
            report.verified
        );
        assert!(over_interval <= 1.0, "plant {k}: {over_interval}");
        for ((_, off), bar) in off.iter().zip([5e-5, 1e-3, 0.1, 0.2, 0.1]) {
            assert!(*off <= bar, "plant {k}: {off}");
        }
    }
}

#[test]
fn joints_with_encoders_of_14_bits_commission_themselves() {
    let sets =
        sets(&["joint.current_lag_s=0", "encoder.link.bits=14", "encoder.motor.bits=14", "drive.tuning=\"normal\""]);
    for (k, PlantResult { off, report, .. }) in all(&plants(scenario::JOINT, &sets)) {
        let peak_rad = report.verified.true_peak_rad.expect("a simulation");
        println!("{k}: {off:?} move {peak_rad:.1e}");
        assert!(report.outcome == Outcome::Accepted && peak_rad <= 1e-3, "plant {k}");
        for ((_, off), bar) in off.iter().zip([3e-3, 2e-2, 0.15, 0.3, 0.15]) {
            assert!(*off <= bar, "plant {k}: {off}");
        }
    }
}

/// The switch at rest against no switch, and against the rule for switches in motion, which stores a momentary swing of
/// the old loop in W. The two corners are the worst ones of these two alternatives.
#[test]
fn a_swap_at_rest_is_better_than_none_and_than_that_of_a_drive_in_motion() {
    let sets = sets(&["joint.current_lag_s=0"]);
    let right = plants(scenario::JOINT, &sets);
    let variants = right.variants().expect("a joint");
    for k in sampled([18, 27], 2) {
        let [at_rest, in_motion, none] = [Swap::AtRest, Swap::InMotion, Swap::None].map(|swap| {
            let plants = Plants { plan: Plan { swap, ..right.plan }, ..right };
            let tried = plants.tried(&variants[k]).unwrap_or_else(|why| panic!("plant {k}: {why}"));
            tried.report.verified.true_peak_rad.expect("a simulation")
        });
        println!("{k}: at rest {at_rest:.1e}, in motion {in_motion:.1e}, none {none:.1e} rad");
        assert!(at_rest <= 1e-4 && none >= 10.0 * at_rest, "plant {k}: {none:e} without, {at_rest:e} with");
        assert!(k != 27 || in_motion >= 1e-3, "plant {k}: {in_motion:e}");
    }
}

/// Wrong link parameters before the switch, and their detection by the move and by the residual of its recording.
#[test]
fn a_wrong_link_is_seen_and_the_old_gains_are_back() {
    let sets = sets(&["joint.current_lag_s=0"]);
    let right = plants(scenario::JOINT, &sets);
    let variants = right.variants().expect("a joint");
    for (k, factor) in [(0, 1.5), (13, 0.7), (22, 1.2), (35, 1.2)] {
        let plants = Plants { wrong: [factor, 1.0], ..right };
        let PlantResult { report, .. } = plants.tried(&variants[k]).unwrap_or_else(|why| panic!("plant {k}: {why}"));
        let Verified { peak_rad, residual_steps, .. } = report.verified;
        println!(
            "{k}, k_1 times {factor}: {:?} {peak_rad:.1e} {residual_steps:?}; home {:.1e}",
            report.outcome, report.home_rad
        );
        assert_ne!(report.outcome, Outcome::Accepted, "plant {k}");
        assert!(residual_steps.expect("a link") > 10.0 * MOST_RESIDUAL_STEPS, "plant {k}: {residual_steps:?}");
        // On the way home the old gains have larger errors.
        assert!(report.home_rad < 2e-2, "plant {k}: {}", report.home_rad);
    }
}

fn stopped(sets: &[String], change: impl Fn(&mut Plan)) -> Stopped {
    let source = Source { file: "joint.toml", text: scenario::JOINT, sets };
    let mut experiment = scenario::parse(&source, "x").expect("a file");
    let designed = experiment.drive.as_ref().expect("a drive").designed;
    let mut plan = Plan::of(&designed);
    change(&mut plan);
    let mut on = |_| ControlFlow::Continue(());
    let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
    let done =
        commission(&mut rig, &plan, &PlantData::with_lag(0.0), |_| Err(Error::input("nothing is to be designed")));
    done.expect_err("a record that is refused")
}

/// Samples after a gap are not used.
#[test]
fn a_record_that_says_too_little_is_refused() {
    let lag = "joint.current_lag_s=0";
    let lost = "fault=[{kind=\"lost\",at_s=1.0,for_s=0.003}]";
    let refused = stopped(&sets(&[lag, "load=[]", lost]), |_| ());
    assert!(matches!(refused, Stopped::Lost { at_s } if (at_s - 1.0).abs() < 0.01), "{refused}");
    let refused = stopped(&sets(&[lag, "load=[]", "error.stiffness_percent=100"]), |_| ());
    println!("{refused}");
    assert!(matches!(refused, Stopped::Refused(Refusal::OutOfTolerance { name: "k_1", .. })), "{refused}");
    let refused = stopped(&sets(&[lag, "load=[]"]), |plan| plan.way_rad = 4000.0);
    assert!(matches!(refused, Stopped::TooFar { .. }), "{refused}");
    let refused = stopped(&sets(&[lag, "load=[]"]), |_| ());
    assert!(matches!(refused, Stopped::Design(_)), "{refused}");
}

/// With friction a move alone does not identify the motor, and a multisine as large as the friction is too weak.
#[test]
fn without_enough_of_the_multisine_the_record_is_refused() {
    let sets = sets(&["joint.current_lag_s=0"]);
    let quiet = plants(scenario::JOINT, &sets);
    let variants = quiet.variants().expect("a joint");
    for (peak_a, some) in [(1e-6, [0, 1, 33]), (1.0, [0, 32, 35])] {
        let plants = Plants { plan: Plan { peak_a, ..quiet.plan }, ..quiet };
        for k in some {
            let refused = plants.tried(&variants[k]).expect_err("a record that says too little");
            println!("plant {k}, {peak_a} A: {refused}");
            assert!(matches!(refused, Stopped::Refused(_)), "{refused}");
        }
    }
}

/// Motor with a rigid load, friction and cogging in its file, J and K_t off by half. b and f_c lie in their intervals,
/// and the move is not worse than the recorded ones. At three times the design gain the loop cancels so much of the
/// multisine that a peak of nine tenths of the current is refused.
#[test]
fn motors_that_are_off_by_half_commission_themselves() {
    for (inertia, torque) in [(0.0, 0.0), (50.0, -50.0), (-50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)] {
        let error = format!("error={{inertia_percent = {inertia}, torque_percent = {torque}}}");
        let sets = sets(&[&error, "drive.uncertain_percent=50"]);
        let source = Source { file: "motor.toml", text: scenario::MOTOR, sets: &sets };
        let mut experiment = scenario::parse(&source, "x").expect("a file");
        let drive = experiment.drive.as_ref().expect("a drive");
        let known = PlantData { tolerance: 2.5, ..PlantData::with_lag(drive.current_lag_s) };
        let (plan, old) = (Plan::of(&drive.designed), sheet_of(&drive.designed));
        let mut on = |_| ControlFlow::Continue(());
        let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
        let design = |found: &mut Identified| Retuned::of(&source, &old, found)?.designed("x");
        let share = (1.0 + torque / 100.0) / (1.0 + inertia / 100.0);
        let report = commission(&mut rig, &plan, &known, design);
        let report = report.unwrap_or_else(|why| panic!("{error}: {why}"));
        // 0.005 N m of friction.
        let truth = [0.05 / 2e-4 * share, 0.1 / (1.0 + torque / 100.0)];
        for (name, truth) in ["b", "f_c"].into_iter().zip(truth) {
            let it = report.identified.parameter(name).expect("a parameter");
            println!("{error} {name}: {} for {truth}, +- {}", it.value, it.interval);
            assert!((it.value - truth).abs() <= it.interval, "{error}: {it:?} for {truth}");
        }
        assert_eq!(report.outcome, Outcome::Accepted, "{error}");
    }
}

/// Commissions the 8 corners and 30 random motors with b and f_c multiplied by these factors before the switch.
fn motors_tried(wrong: [f64; 2], bits: u32) -> Vec<(usize, PlantResult)> {
    let sets = sets(&[&format!("encoder.bits={bits}")]);
    all(&Plants { wrong, ..plants(scenario::MOTOR, &sets) })
}

/// A threshold that is too wide would accept them: a move as short as the current allows has 1.3 to 4 times the
/// threshold.
#[test]
fn a_wrong_b_is_seen_and_the_old_gains_are_back() {
    for bits in [12, 14, 20] {
        for factor in [0.8, 1.2] {
            for (k, PlantResult { report, .. }) in motors_tried([factor, 1.0], bits) {
                println!("{bits} bits, {k}, b times {factor}: {:?} {:?}", report.outcome, report.verified);
                assert_eq!(report.outcome, Outcome::BackForTheMove, "{bits} bits, motor {k}, b times {factor}");
                assert!(report.home_rad < 0.1, "{bits} bits, motor {k}: {}", report.home_rad);
            }
        }
    }
}

/// A threshold that is too tight would reject them. Cogging, stiction, load and an unknown current are missing in the
/// simulation; the moves reach at most 0.83 of the threshold (114 motors).
#[test]
fn a_right_b_is_not_sent_back() {
    for bits in [12, 14, 20] {
        for (k, PlantResult { off, over_interval, report }) in motors_tried([1.0; 2], bits) {
            let Verified { peak_rad, bar_rad, .. } = report.verified;
            println!("{bits} bits, {k}: {off:?}, {peak_rad:.1e} of {bar_rad:.1e}");
            assert_eq!(report.outcome, Outcome::Accepted, "{bits} bits, motor {k}: {:?}", report.verified);
            assert!(peak_rad < 0.9 * bar_rad && over_interval <= 1.0, "{bits} bits, motor {k}");
            // The threshold comes from the simulation, not from the recorded moves.
            assert!(bar_rad < 0.6 * report.recorded_peak_rad, "{bits} bits, motor {k}");
        }
    }
}

/// The identified values are in the file in numbers of its own shafts. Everything else stays, except the error table.
#[test]
fn the_file_has_what_was_found() {
    let sets = sets(&["joint.stiffness_n_m=8", "joint.gear=[2, 1]", "span_s=2.5"]);
    let text =
        scenario::JOINT.replace("# [error]", "[error]").replace("# link_inertia_percent", "link_inertia_percent");
    let source = Source { file: "joint.toml", text: &text, sets: &sets };
    let experiment = scenario::parse(&source, "x").expect("a file");
    let old = sheet_of(&experiment.drive.as_ref().expect("a drive").designed);
    let Sheet::Joint(mut joint) = old else { panic!("a joint") };
    joint.stiffness_n_m = 6.0;
    joint.motor_inertia_kg_m2 *= 1.25;
    joint.torque_n_m_per_a *= 0.75;
    joint.motor_damping_n_m_s = 0.0;
    let angle = Angle { rad: Vec::new(), step_rad: 1.0 };
    let record = Record { period_s: 1e-3, link: None, motor: angle, held_a: Vec::new() };
    assert!(identify(&record, &old, &PlantData::with_lag(0.0)).is_err());
    let found = Identified::for_test(Sheet::Joint(joint));
    let retuned = Retuned::of(&source, &old, &found).expect("a file");
    assert_eq!(retuned.sets, ["span_s=2.5"]);
    assert!(retuned.text.contains("gear = [2, 1]"), "what is set of the drive is in its file: {}", retuned.text);
    let Ok(DriveDesign::Joint(DriveOf { design, .. })) = retuned.designed("x") else {
        panic!("a drive: {}", retuned.text)
    };
    assert_eq!(design.joint.stiffness_n_m, 6.0);
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-5;
    assert!(near(design.joint.motor_inertia_kg_m2, joint.motor_inertia_kg_m2), "{:?}", design.joint);
    assert!(near(design.joint.torque_n_m_per_a, joint.torque_n_m_per_a));
    assert_eq!(design.joint.motor_damping_n_m_s, 0.0);
    assert!(!retuned.text.contains("[error]") && retuned.text.contains("motor_inertia_kg_m2 = 0.00116375"));
    // The comments of the file remain.
    assert!(retuned.text.contains("# at the motor shaft"), "{}", retuned.text);
}

/// Friction that is identified above the static friction of the file replaces it.
#[test]
fn friction_at_rest_is_not_left_below_what_was_found() {
    let (record, sheet, known) = recorded(&[]);
    for (still, stays) in [("friction.static_n_m=0.02", true), ("friction.static_n_m=0.001", false)] {
        let sets = sets(&[still]);
        let source = Source { file: "motor.toml", text: scenario::MOTOR, sets: &sets };
        let found = identify(&record, &sheet, &known).expect("a good record");
        let retuned = Retuned::of(&source, &sheet, &found).expect("a file");
        assert!(retuned.sets.is_empty(), "{:?}", retuned.sets);
        assert_eq!(retuned.text.contains("\nstatic_n_m = 0.02"), stays, "{}", retuned.text);
        let source = Source { text: &retuned.text, sets: &retuned.sets, ..source };
        assert_eq!(scenario::parse(&source, "x").expect("a file").warnings, Vec::<String>::new());
    }
}

/// Records moves without a multisine with the drive of a scenario.
fn moved_only(text: &str, ways: &[f64], least_s: f64) -> (Record, Sheet, PlantData) {
    let sets = sets(&["load=[]", "friction={coulomb_n_m=0.005}"]);
    let source = Source { file: "x.toml", text, sets: &sets };
    let mut experiment = scenario::parse(&source, "x").expect("a file");
    let drive = experiment.drive.as_ref().expect("a drive");
    let (known, old, limit) =
        (PlantData::with_lag(drive.current_lag_s), sheet_of(&drive.designed), drive.designed.max_current_a());
    let mut on = |_| ControlFlow::Continue(());
    let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
    rig.begin(None, 10.0).expect("a record");
    for &to_rad in ways {
        let ticks = fewest(&rig, &old, to_rad - rig.at_rad(), least_s, 0.5 * limit).expect("a way");
        rig.go(to_rad, ticks).expect("a move");
    }
    rig.rest(0.5).expect("a rest");
    let leg = rig.end().expect("a record");
    (leg.record.expect("no lost count"), old, known)
}

/// The refusal names the missing excitation and the remedy: one move, moves without a multisine, another column for the
/// current.
#[test]
fn a_record_without_a_multisine_is_told_what_it_lacks() {
    for (text, ways, least_s, expected) in [
        (scenario::JOINT, &[1.0][..], 1.0, "one move is not enough, record moves to and fro"),
        (scenario::JOINT, &[0.6, 0.0], 2.0, "Increase the peak of the multisine"),
        (scenario::MOTOR, &[1.0], 1.0, "the multisine of `host-sim commission`"),
        (scenario::MOTOR, &[3.0, 0.0], 0.6, "the multisine of `host-sim commission`"),
        // Without the limit of the interval this recording gave b 43 % off.
        (scenario::MOTOR, &[0.6, 0.0, 0.6, 0.0], 0.3, "the multisine of `host-sim commission`"),
    ] {
        let (mut record, sheet, known) = moved_only(text, ways, least_s);
        let told = identify(&record, &sheet, &known).expect_err("a poor record").to_string();
        println!("{ways:?}: {told}");
        assert!(told.contains(expected), "{ways:?}: {told}");
        record.held_a.fill(0.3);
        let told = identify(&record, &sheet, &known).expect_err("a current that stays").to_string();
        assert!(told.contains("u_held_a is 0.3 A in all rows") && told.contains("multisine"), "{told}");
    }
}

/// The recording lacks the link count, but the drive uses it: the move after the switch is as good as with it.
#[test]
fn joints_commission_themselves_from_the_motor_alone() {
    let coarse = ["encoder.link.bits=14", "encoder.motor.bits=14", "drive.tuning=\"normal\""];
    for (more, most_rad) in sampled([(&[][..], 1e-4), (&coarse, 1e-3)], 2) {
        let sets = sets(&[&["joint.current_lag_s=0"], more].concat());
        let right = plants(scenario::JOINT, &sets);
        let plants = Plants { plan: Plan { motor_alone: true, ..right.plan }, ..right };
        for (k, PlantResult { off, over_interval, report }) in all(&plants) {
            let true_peak_rad = report.verified.true_peak_rad.expect("a simulation");
            println!("{more:?} {k}: {off:?} {over_interval:.2} move {true_peak_rad:.1e}");
            assert_eq!(report.outcome, Outcome::Accepted, "plant {k}");
            assert!(true_peak_rad <= most_rad && over_interval <= 1.0, "plant {k}: {true_peak_rad:e} {over_interval}");
            assert!(off[0].1 <= 1e-2 && report.identified.link.is_none(), "plant {k}: {off:?}");
            assert_eq!(report.verified.residual_steps, None);
        }
    }
}

#[test]
fn corners_are_off_as_they_say() {
    let sets = sets(&[]);
    let variants = plants(scenario::JOINT, &sets).variants().expect("a joint");
    assert_eq!(variants.len(), 62);
    let distinct: Vec<&Variant> =
        variants.iter().take(32).filter(|it| it.factors.iter().all(|it| (it - 1.0).abs() == 0.5)).collect();
    assert_eq!(distinct.len(), 32);
    assert!(variants[32..].iter().flat_map(|it| &it.factors).all(|it| (0.5..=1.5).contains(it)));
}

/// Commissions the drive of a scenario with the identified values multiplied by these factors.
fn commissioned(text: &str, sets: &[String], wrong: [f64; 2]) -> Report {
    let source = Source { file: "x.toml", text, sets };
    let mut experiment = scenario::parse(&source, "x").expect("a file");
    let drive = experiment.drive.as_ref().expect("a drive");
    let (known, plan) = (PlantData::with_lag(drive.current_lag_s), Plan::of(&drive.designed));
    let old = sheet_of(&drive.designed);
    let mut on = |_| ControlFlow::Continue(());
    let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
    let design = |found: &mut Identified| {
        made_wrong(found, wrong);
        Retuned::of(&source, &old, found)?.designed("x")
    };
    commission(&mut rig, &plan, &known, design).unwrap_or_else(|why| panic!("{sets:?}: {why}"))
}

/// A joint ten or twenty times as stiff as the joint of the paper has a sampling error above 1e-4 rad. The simulation
/// predicts this error, and a wrong link still exceeds the threshold.
#[test]
fn a_stiff_drive_is_held_to_what_is_expected_of_it() {
    for stiffness in [90, 200] {
        // With one observer per encoder, which causes this error.
        let stiff = format!("joint.stiffness_n_m={stiffness}");
        let sets = sets(&[&stiff, "drive.tuning=\"normal\"", "load=[]"]);
        let Report { outcome, verified, .. } = commissioned(scenario::JOINT, &sets, [1.0; 2]);
        println!("{stiffness}: {verified:?}");
        assert_eq!(outcome, Outcome::Accepted, "{stiffness}");
        let expected = verified.expected_rad.expect("a joint");
        assert!(verified.peak_rad > LEAST_BAR_RAD && (verified.peak_rad / expected - 1.0).abs() < 0.1, "{verified:?}");
        for factor in [0.98, 1.02] {
            let Report { outcome, verified, .. } = commissioned(scenario::JOINT, &sets, [factor, 1.0]);
            println!("    k_1 times {factor}: {outcome:?} {verified:?}");
            assert_ne!(outcome, Outcome::Accepted, "{stiffness}, {factor}");
        }
    }
}

/// A coupling has damping of 0.05 to 5 % of the critical damping of the motor on its spring, and the motor encoder may
/// be coarser than the link encoder. Neither counts as a wrong link, and a wrong link is still detected.
#[test]
fn a_damped_spring_and_a_coarse_encoder_of_the_motor_are_no_wrong_link() {
    for (more, damping) in [
        ("joint.spring_damping_n_m_s=1e-4", 1e-4),
        ("joint.spring_damping_n_m_s=1e-3", 1e-3),
        ("joint.spring_damping_n_m_s=9e-3", 9e-3),
        ("encoder.motor.bits=16", 0.0),
        ("encoder.motor.bits=14", 0.0),
    ] {
        let sets = sets(&["joint.current_lag_s=0", "load=[]", more]);
        let Report { outcome, verified, identified, .. } = commissioned(scenario::JOINT, &sets, [1.0; 2]);
        println!("{more}: {outcome:?} {verified:?} {:?}", identified.parameters);
        assert_eq!(outcome, Outcome::Accepted, "{more}");
        for (name, truth) in [("k_1", 9.0), ("b_1", 0.07), ("d_1", damping)] {
            let Some(it) = identified.parameter(name) else { continue };
            assert!((it.value - truth / 0.23).abs() <= it.interval, "{more}: {it:?}");
        }
        assert_eq!(identified.parameter("d_1").is_some(), damping > 0.0, "{more}");
        let Report { outcome, verified, .. } = commissioned(scenario::JOINT, &sets, [1.02, 1.0]);
        println!("    k_1 2 % wrong: {outcome:?} {verified:?}");
        assert_ne!(outcome, Outcome::Accepted, "{more}");
    }
}

/// Cogging with known periods is part of the simulation, so it does not cause a switch back.
#[test]
fn a_motor_that_cogs_is_held_to_what_is_expected_of_it() {
    // From an independent set: cogging of 2 % of the largest torque.
    let text = "[motor]\ninertia_kg_m2 = 2.6e-3\ntorque_n_m_per_a = 1.96\nmax_current_a = 5.9\ncurrent_lag_s = 0.0\n\
                [encoder]\nbits = 20\n[drive]\nperiod_s = 1e-3\nuncertain_percent = 50.0\n\
                [reference]\nkind = \"move\"\nto_rad = 0.5\n\
                [friction]\ncoulomb_n_m = 3.2e-3\nstatic_n_m = 5.2e-3\ncogging_n_m = 0.23\nsmooth_rad_s = 0.05\n\
                [error]\ninertia_percent = 17.0\ntorque_percent = -22.0\n";
    let source = Source { file: "motor.toml", text, sets: &[] };
    for (is_named, expected) in [(false, Outcome::BackForTheMove), (true, Outcome::Accepted)] {
        let mut experiment = scenario::parse(&source, "x").expect("a file");
        let drive = experiment.drive.as_ref().expect("a drive");
        let cogging_per_turn = is_named.then_some(7.0);
        let known = PlantData { cogging_per_turn, ..PlantData::with_lag(drive.current_lag_s) };
        let (plan, old) = (Plan::of(&drive.designed), sheet_of(&drive.designed));
        let mut on = |_| ControlFlow::Continue(());
        let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
        let design = |found: &mut Identified| Retuned::of(&source, &old, found)?.designed("x");
        let report = commission(&mut rig, &plan, &known, design).unwrap_or_else(|why| panic!("{why}"));
        println!("named {is_named}: {:?} {:?} {:?}", report.outcome, report.verified, report.identified.cogging);
        assert_eq!(report.outcome, expected, "named: {is_named}");
    }
}

/// Returns the recording of a motor, its data sheet and further data.
fn recorded(more: &[&str]) -> (Record, Sheet, PlantData) {
    let sets = sets(&[more, &["drive.uncertain_percent=50"]].concat());
    let source = Source { file: "motor.toml", text: scenario::MOTOR, sets: &sets };
    let mut experiment = scenario::parse(&source, "x").expect("a file");
    let drive = experiment.drive.as_ref().expect("a drive");
    let (known, plan) = (PlantData::with_lag(drive.current_lag_s), Plan::of(&drive.designed));
    let (old, limit) = (sheet_of(&drive.designed), drive.designed.max_current_a());
    let mut on = |_| ControlFlow::Continue(());
    let mut rig = Rig::new(&mut experiment, Signal::default(), &mut on).expect("a drive");
    let (leg, _) = make_record(&mut rig, &plan, &old, limit / 30.0).expect("a record");
    (leg.record.expect("no lost count"), old, known)
}

/// Quantisation, friction, cogging of 2 % of the largest torque, ripple of 10 %, a load: these recordings are accepted,
/// and b lies within its interval.
#[test]
fn what_no_data_sheet_says_of_a_motor_is_left_and_taken() {
    for more in [
        &["encoder.bits=10"][..],
        &["encoder.bits=12"],
        &["encoder.bits=14"],
        &["encoder.bits=20"],
        &["encoder.bits=20", "friction={}"],
        &["encoder.bits=20", "friction.cogging_n_m=0"],
        &["friction.cogging_n_m=0.01"],
        &["encoder.bits=20", "friction.cogging_n_m=0.01"],
        &["encoder.bits=20", "friction.ripple_percent=10"],
        &["drive.period_s=5e-4"],
        &["load=[{kind=\"const\", amplitude=0.1}]"],
    ] {
        let (record, sheet, known) = recorded(more);
        let found = identify(&record, &sheet, &known).unwrap_or_else(|why| panic!("{more:?}: {why}"));
        let b = found.parameter("b").expect("a motor");
        assert!((b.value - 250.0).abs() <= b.interval, "{more:?}: {b:?}");
    }
}

/// Name, fault and expected message of a spoiled recording.
type Case<'a> = (&'a str, &'a dyn Fn(&mut Record), &'a str);

#[test]
fn a_motor_that_is_not_explained_is_refused_with_the_time_of_the_worst() {
    let (good, sheet, known) = recorded(&[]);
    let (half, step) = (good.motor.rad.len() / 2, good.motor.step_rad);
    let spoiled = |change: &dyn Fn(&mut Record)| {
        let mut record = good.clone();
        change(&mut record);
        identify(&record, &sheet, &known).map(|found| found.motor).expect_err("a spoiled record").to_string()
    };
    let jump =
        |steps: f64| move |record: &mut Record| record.motor.rad[half..].iter_mut().for_each(|q| *q += steps * step);
    let cases: [Case<'_>; 6] = [
        ("a jump of 300 steps", &jump(300.0), "298 counts at 0.901 s, residual 12.20 counts rms (ratio 24, limit 15)"),
        ("a jump of 30 steps", &jump(30.0), "29 counts at 0.901 s, residual 1.31 counts rms (ratio 22, limit 15)"),
        ("one wild count", &|record| record.motor.rad[half] += 300.0 * step, "at 0.901 s"),
        (
            "a count that sticks",
            &|record| (1..50).for_each(|k| record.motor.rad[half + k] = record.motor.rad[half]),
            "outlier of 41 counts at 0.951 s",
        ),
        ("an end stop", &|record| record.motor.rad.iter_mut().for_each(|q| *q = q.min(1.5)), "counts rms (limit"),
        ("a current that comes late", &|record| record.held_a.rotate_right(5), "current that is late"),
    ];
    for (what, change, expected) in cases {
        let told = spoiled(change);
        println!("{what}: {told}");
        assert!(told.starts_with("motor model does not fit: ") && told.contains(expected), "{what}: {told}");
    }
    // Strong cogging is named as a cause; with `--cogging` the recording is accepted.
    let strong = |cogging| {
        let (record, sheet, known) = recorded(&["friction.cogging_n_m=0.03"]);
        identify(&record, &sheet, &PlantData { cogging_per_turn: cogging, ..known })
    };
    let told = strong(None).expect_err("13 % off").to_string();
    assert!(told.contains("strong cogging (--cogging N)"), "{told}");
    let b = strong(Some(7.0)).expect("a good record").parameter("b").expect("a motor").value;
    assert!((b / 250.0 - 1.0).abs() < 0.05, "{b}");
}
