//! Rest under stiction: the hunting of a motor around its target, and the cost of its rest band.
//!
//! The tests run five motors of four sizes. The true friction is half, once and one and a half times the nominal one,
//! and there are two targets. Each motor comes to rest in four ways: after a move, after a load, after a slow move, and
//! under a constant load. From a second after the last event on nothing changes, so a stuck shaft needs no change of
//! the current.

use controller_core::drive::{DriveEstimates, Encoder, Motor, MotorDesign, RestLearning, Resting, Target};
use controller_core::{Health, Limits};
use integration_tests::strategy::Rng;
use integration_tests::{deep, golden};
use loop_sim::trace::{Row, Trace};

use super::margin::run;

/// Motor: J, K_t, limit, bits, period; Coulomb and static friction as a share of the torque.
struct Sheet {
    name: &'static str,
    numbers: [f64; 3],
    bits: u32,
    period_s: f64,
    friction: [f64; 2],
}

impl Sheet {
    const fn new(name: &'static str, numbers: [f64; 3], bits: u32, period_s: f64, friction: [f64; 2]) -> Self {
        Self { name, numbers, bits, period_s, friction }
    }
}

const SHEETS: [Sheet; 5] = [
    Sheet::new("template, 14 bits", [2e-4, 0.05, 10.0], 14, 1e-3, [0.01, 0.016]),
    Sheet::new("the same, friction 4 and 6 % of its torque", [2e-4, 0.05, 10.0], 14, 1e-3, [0.04, 0.06]),
    Sheet::new("the same, 20 bits", [2e-4, 0.05, 10.0], 20, 1e-3, [0.04, 0.06]),
    Sheet::new("gimbal, 2e-6 kg m², 14 bits", [2e-6, 0.03, 1.0], 14, 1e-3, [0.02, 0.03]),
    Sheet::new("direct drive, 5e-3 kg m², 12 bits", [5e-3, 0.5, 6.0], 12, 1e-3, [0.02, 0.03]),
];
/// The period is an eighth of the others, so the run takes eight times as long.
const SERVO: Sheet = Sheet::new("servo, 1e-2 kg m², 20 bits, 8 kHz", [1e-2, 1.0, 15.0], 20, 1.25e-4, [0.02, 0.03]);

const WAYS: [&str; 4] = ["move", "load gone", "slow move", "constant load"];
/// Time of the last event, s, then the observation time.
const LAST_S: f64 = 2.0;
const REST_S: f64 = 1.0;
const LOOK_S: f64 = 3.0;

struct Found {
    /// Reversals of the shaft's direction per second, then the standard deviation of u over its limit.
    reversals_per_s: f64,
    ripple: f64,
    /// Final error, counts, then the largest error under a load, rad.
    end_counts: f64,
    dip_rad: f64,
}

impl Found {
    fn is_quiet(&self) -> bool {
        self.reversals_per_s <= 0.5 && self.ripple <= 1e-3
    }
}

/// Runs one case; `off` is the deviation of J and K_t, %.
fn found(sheet: &Sheet, way: usize, target: f64, true_friction: f64, off: [f64; 2], more: &[&str]) -> Found {
    let Sheet { numbers: [inertia, torque, limit], bits, period_s, friction, .. } = *sheet;
    let most = torque * limit;
    let [coulomb, holds] = friction.map(|share| share * most * true_friction);
    let step = |amplitude: f64, t0_s: f64| format!("{{kind = \"step\", amplitude = {amplitude}, t0_s = {t0_s}}}");
    let (moves_s, load) = match WAYS[way] {
        "load gone" => (0.5, format!("load=[{}, {}]", step(0.14 * most, 1.2), step(-0.14 * most, LAST_S))),
        "constant load" => (0.5, format!("load=[{}]", step(0.05 * most, 0.0))),
        "slow move" => (LAST_S, "load=[]".into()),
        _ => (0.5, "load=[]".into()),
    };
    let target = if WAYS[way] == "slow move" { 0.1 * target } else { target };
    let mut sets = vec![
        format!("motor={{inertia_kg_m2={inertia}, torque_n_m_per_a={torque}, max_current_a={limit}}}"),
        format!("encoder.bits={bits}"),
        format!("drive.period_s={period_s}"),
        format!("span_s={}", LAST_S + REST_S + LOOK_S),
        format!(
            "friction={{coulomb_n_m={coulomb}, static_n_m={holds}, cogging_n_m={}, model=\"holds\"}}",
            0.006 * most
        ),
        format!("reference={{kind=\"move\", to_rad={target}, duration_s={moves_s}}}"),
        format!("error={{inertia_percent={}, torque_percent={}}}", off[0], off[1]),
        load,
        "monitor.reaction=\"tell\"".into(),
    ];
    sets.extend(more.iter().map(ToString::to_string));
    let (_, trace) = run(&sets);
    let look = |from: f64| trace.rows.iter().filter(move |row| row.t_s >= from);
    let mut way = 0.0;
    let mut reversals = 0;
    let from = LAST_S + REST_S;
    for row in look(from) {
        if row.x[1] != 0.0 {
            reversals += u32::from(way * row.x[1] < 0.0);
            way = row.x[1].signum();
        }
    }
    let mean = |of: &dyn Fn(&Row) -> f64| look(from).map(of).sum::<f64>() / look(from).count() as f64;
    let u = mean(&|row| row.u);
    let ripple = mean(&|row| (row.u - u).powi(2)).sqrt() / limit;
    let last = trace.rows.last().expect("rows");
    let dip = look(1.0).filter(|row| row.t_s < LAST_S + REST_S).map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
    Found {
        reversals_per_s: f64::from(reversals) / LOOK_S,
        ripple,
        end_counts: (last.x[0] - last.r).abs() / (std::f64::consts::TAU / f64::from(1_u32 << bits)),
        dip_rad: dip,
    }
}

/// Summary of a motor over all ways to come to rest.
#[derive(Default)]
struct Tally {
    loud: usize,
    reversing: usize,
    of: usize,
    worst_counts: f64,
    dips: Vec<f64>,
}

/// Runs a motor with this band, for `corners` of J and K_t in percent, and these shares of its friction.
fn tally(sheet: &Sheet, way: usize, (corners, frictions): (&[[f64; 2]], &[f64]), band: &str) -> Tally {
    let mut tally = Tally::default();
    let targets = if deep() { &[1.0, 0.7321][..] } else { &[1.0] };
    let band = format!("drive.rest_band=\"{band}\"");
    for &friction in frictions {
        for (&target, &off) in targets.iter().flat_map(|target| corners.iter().map(move |off| (target, off))) {
            let found = found(sheet, way, target, friction, off, &[&band]);
            tally.loud += usize::from(!found.is_quiet());
            tally.reversing += usize::from(found.reversals_per_s > 0.5);
            tally.of += 1;
            tally.worst_counts = tally.worst_counts.max(found.end_counts);
            tally.dips.push(found.dip_rad);
        }
    }
    tally
}

/// Returns all motors and ways with each of the three bands.
fn table(corners: &[[f64; 2]], frictions: &[f64]) -> Vec<(&'static str, usize, [Tally; 3])> {
    let servo = if deep() { &[SERVO][..] } else { &[] };
    let mut rows = Vec::new();
    for sheet in SHEETS.iter().chain(servo) {
        for way in 0..WAYS.len() {
            let bands = ["off", "fixed", "learns"].map(|band| tally(sheet, way, (corners, frictions), band));
            println!("{}, {}: {:?} of {} hunt", sheet.name, WAYS[way], bands.each_ref().map(|it| it.loud), bands[0].of);
            rows.push((sheet.name, way, bands));
        }
    }
    rows
}

/// Returns the table of docs/evidence/tuning.md.
fn in_docs(rows: &[(&str, usize, [Tally; 3])]) -> String {
    let mut table = vec![format!(
        "| motor | hunts after a {}, a {}, a {}, under a {} (of {} each) | with `\"fixed\"` | with `\"learns\"` | \
         error at the end, counts: off, learns | dip |\n|---|---|---|---|---|---|\n",
        WAYS[0], WAYS[1], WAYS[2], WAYS[3], rows[0].2[0].of
    )];
    for ways in rows.chunks(WAYS.len()) {
        let loud = |band: usize| ways.iter().map(|(.., of)| of[band].loud.to_string()).collect::<Vec<_>>().join(", ");
        let worst = |band: usize| ways.iter().map(|(.., of)| of[band].worst_counts).fold(0.0, f64::max);
        let [mid, most] = dips(&ways[1].2);
        let (name, ..) = ways[0];
        let cells = [
            name.to_owned(),
            loud(0),
            loud(1),
            loud(2),
            format!("{:.1}, {:.1}", worst(0), worst(2)),
            format!("{mid:.3}, {most:.3}"),
        ];
        table.push(format!("| {} |\n", cells.join(" | ")));
    }
    let [off, fixed, learns, of] = [
        sum(rows, |bands| bands[0].loud),
        sum(rows, |bands| bands[1].loud),
        sum(rows, |bands| bands[2].loud),
        sum(rows, |bands| bands[0].of),
    ];
    table.push(format!("| all | {off} of {of} | {fixed} | {learns} | | |\n"));
    table.concat()
}

/// Returns the median and the maximum of the load errors with a learning band, relative to the errors without a band.
fn dips([off, _, learns]: &[Tally; 3]) -> [f64; 2] {
    let mut ratio: Vec<f64> = learns.dips.iter().zip(&off.dips).map(|(new, old)| new / old).collect();
    ratio.sort_by(f64::total_cmp);
    [ratio[ratio.len() / 2], ratio[ratio.len() - 1]]
}

fn sum(rows: &[(&str, usize, [Tally; 3])], of: impl Fn(&[Tally; 3]) -> usize) -> usize {
    rows.iter().map(|(.., bands)| of(bands)).sum()
}

/// Without a band nearly all motors hunt. With a band nearly all stand; 1 of 144 does not.
#[test]
fn motors_of_four_sizes_come_to_rest_in_friction_that_holds() {
    let frictions = if deep() { &[0.5, 1.0, 1.5][..] } else { &[1.0] };
    let rows = table(&[[0.0, 0.0]], frictions);
    let runs = sum(&rows, |[off, ..]| off.of);
    let [without, with] = [sum(&rows, |[off, ..]| off.loud), sum(&rows, |[.., learns]| learns.loud)];
    if deep() {
        golden::in_docs("evidence/tuning.md", "rest", &in_docs(&rows)).unwrap_or_else(|differs| panic!("{differs}"));
    }
    assert!(4 * without >= 3 * runs, "{without} of {runs} hunt without a band");
    assert!(48 * with <= runs, "{with} of {runs} are loud with one");
    let reversing = sum(&rows, |[.., learns]| learns.reversing);
    assert!(48 * reversing <= runs, "{reversing} of {runs} reverse with one");
    for (name, way, bands) in &rows {
        if name.starts_with("template") || name.starts_with("direct drive") {
            assert!(bands[2].worst_counts <= 2.0, "{name}, {}: {} counts", WAYS[*way], bands[2].worst_counts);
            let [mid, most] = if WAYS[*way] == "load gone" { dips(bands) } else { [1.0; 2] };
            assert!(mid <= 1.05 && most <= 1.06, "{name}: dips {mid} and {most} of those without a band");
        }
    }
}

/// J and K_t off by half in both directions. The fast tier takes two corners of the motor that hunts most.
#[test]
fn corners_of_fifty_percent_come_to_rest_too() {
    let corners = [[50.0, 50.0], [50.0, -50.0], [-50.0, 50.0], [-50.0, -50.0]];
    if !deep() {
        let of = |band| tally(&SHEETS[3], 0, (&corners[1..3], &[1.0]), band).loud;
        assert_eq!([of("off"), of("learns")], [2, 0]);
        return;
    }
    let rows = table(&corners, &[0.5, 1.0, 1.5]);
    for (after, is_load) in [("moves", false), ("loads", true)] {
        let of = |bands: &[Tally; 3]| [bands[0].loud, bands[2].loud, bands[0].of];
        let mut all = [0; 3];
        for (_, _, bands) in rows.iter().filter(|(_, way, _)| (WAYS[*way] == "load gone") == is_load) {
            all.iter_mut().zip(of(bands)).for_each(|(all, one)| *all += one);
        }
        println!("{after}: {} without, {} with a band, of {}", all[0], all[1], all[2]);
        assert!(8 * all[1] <= all[2] && 2 * all[0] >= all[2], "{after}: {all:?}");
    }
}

fn ran(sets: &[&str]) -> Trace {
    run(&sets.iter().map(ToString::to_string).collect::<Vec<_>>()).1
}

#[test]
fn a_target_that_moves_gets_the_currents_that_it_had() {
    for reference in ["kind=\"sine\", amplitude_rad=1, frequency_hz=1", "kind=\"move\", to_rad=3, duration_s=2"] {
        let reference = format!("reference={{{reference}}}");
        let [with, without] =
            ["learns", "off"].map(|band| ran(&[&reference, &format!("drive.rest_band=\"{band}\""), "span_s=1.9"]));
        assert!(with.rows.iter().zip(&without.rows).all(|(a, b)| a.u.to_bits() == b.u.to_bits()), "{reference}");
    }
}

/// Without friction nothing holds the shaft in the band: it wanders there, and the current does not oscillate.
#[test]
fn without_friction_the_shaft_wanders_within_the_band() {
    for bits in [12, 14, 20] {
        let look = |band: &str| {
            let sets = ["friction={}", "reference={kind=\"rest\"}", "motor.start_rad=0.3", "span_s=5"];
            let more = [format!("encoder.bits={bits}"), format!("drive.rest_band=\"{band}\"")];
            let trace = ran(&[&sets[..], &[more[0].as_str(), more[1].as_str()]].concat());
            let rows = || trace.rows.iter().filter(|row| row.t_s >= 2.0);
            let error = rows().map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
            let u = (rows().map(|row| row.u * row.u).sum::<f64>() / rows().count() as f64).sqrt();
            (error * f64::from(1_u32 << bits) / std::f64::consts::TAU, u)
        };
        let [(_, u_without), (counts, u)] = ["off", "learns"].map(look);
        println!("{bits} bits: {counts:.2} counts, {u:.4} A (without a band {u_without:.4})");
        let least = MotorDesign::by_rule(1e-3, TEMPLATE, Encoder::absolute(bits), Limits::symmetric(10.0))
            .rest_band(RestLearning::Off)
            .thresholds()[1];
        let band = f64::from(least) * f64::from(1_u32 << bits) / std::f64::consts::TAU;
        assert!(counts <= band + 1.0 && u <= u_without + 1e-6, "{counts} counts of {band}, {u} A of {u_without}");
    }
}

/// A set-point that is typed again every 0.2 s, with equal begin and end, is followed as without a band.
#[test]
fn a_set_point_that_steps_while_it_rests_is_followed() {
    let law = MotorDesign::by_rule(1e-3, TEMPLATE, Encoder::absolute(14), Limits::symmetric(10.0));
    let band = law.rest_band(RestLearning::On);
    let mut resting = Resting::START;
    let known = DriveEstimates { turn: 0, position: [0.0], speed: [0.0], disturbance: [0.0], load: [0.0] };
    let mut moved = |angle: f32, ticks: usize| {
        let placed = (0..ticks).map(|_| {
            let (mut begin, mut end) = (Target { turn: 0, jet: [angle, 0.0] }, Target { turn: 0, jet: [angle, 0.0] });
            band.place(&mut resting, Some(&known), &mut begin, &mut end);
            begin.jet[0] - angle
        });
        placed.collect::<Vec<f32>>()
    };
    let first = moved(3e-4, 200);
    assert!((first[199] + 3e-4).abs() < 1e-8, "the target comes to the shaft: {}", first[199]);
    let [stepped, then] = [moved(-3e-4, 1)[0], moved(-3e-4, 1)[0]];
    assert!(stepped == 0.0 && then > 0.0 && then < 1e-4, "{stepped} {then}");
}

/// A slow motion under a load without friction is not a slip: the band keeps its width.
#[test]
fn a_slow_load_without_friction_does_not_widen_the_band() {
    for (amplitude, omega) in [(0.01, 2.0), (0.01, 6.0), (0.002, 12.6)] {
        let load = format!("load=[{{kind = \"sin\", amplitude = {amplitude}, omega_rad_s = {omega}}}]");
        let sets = ["encoder.bits=20", "friction={}", "reference={kind=\"rest\"}", "span_s=8", load.as_str()];
        let trace = ran(&sets);
        assert!(trace.rows.iter().all(|row| !row.health.contains(Health::HUNTS)), "{load}");
    }
}

const TEMPLATE: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };

/// For any estimates, including NaN, the target moves by at most the widest band. The band grows to at most this width,
/// in at most ten steps between two loads. A moving target is never changed.
#[test]
fn no_estimate_moves_a_target_by_more_than_the_widest_band() {
    let design = MotorDesign::by_rule(1e-3, TEMPLATE, Encoder::absolute(14), Limits::symmetric(10.0));
    let band = design.rest_band(RestLearning::On);
    let [count, least, most, .., load, _] = band.thresholds();
    assert!(count <= least && least < most && most < load);
    let mut rng = Rng::new(7);
    let (mut resting, mut grown) = (Resting::START, 0);
    for k in 0..if deep() { 10_000_000 } else { 300_000 } {
        let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, 0.0, -0.0];
        let mut number = |size: f64| {
            if rng.chance(0.02) { *rng.one_of(&wild) } else { rng.within(-size, size) as f32 }
        };
        let size = [1e-4, 1e-3, 5e-3, 1.0][k / 1000 % 4];
        let (position, speed) = (number(size), number(0.1));
        let known = DriveEstimates { turn: 0, position: [position], speed: [speed], disturbance: [0.0], load: [0.0] };
        let target = Target { turn: 0, jet: [0.0, 0.0] };
        let (mut begin, mut end) = (target, target);
        let before = band.width(&resting);
        let health = band.place(&mut resting, Some(&known), &mut begin, &mut end);
        let width = band.width(&resting);
        assert!(begin.jet[0].abs() <= most && begin == end, "{k}: {known:?} {begin:?}");
        assert!((least..=most).contains(&width) && health.contains(Health::HUNTS) == (width > least), "{k}");
        grown = if width < before { 0 } else { grown + u32::from(width > before) };
        assert!(grown <= 10, "{k}");
        if k % 5000 == 4999 {
            let (mut begin, mut end) = (target, Target { turn: 0, jet: [1e-6, 0.0] });
            let health = band.place(&mut resting, Some(&known), &mut begin, &mut end);
            assert_eq!((begin, end.jet[0], health, resting.share()), (target, 1e-6, Health::OK, 0.0));
        }
    }
}
