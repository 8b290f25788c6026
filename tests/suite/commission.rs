//! Commissioning of a drive on a target. The recorded data must match inputs and outputs bit for bit under any loss on
//! the serial link. The new gains must be better, and the old gains must return where the new ones are wrong.
//!
//! The tests first run in this process, where every tick is visible. Then the image `drive` runs on the emulated target
//! with simulated joints; the data sheet is wrong for some of them. Moves and times are typical of a user.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use controller_core::Health;
use controller_core::drive::Joint;
use integration_tests::data::path;
use integration_tests::deep;
use integration_tests::live::{Bench, DESIGN, Shared, loadable};
use integration_tests::program::{Folder, host_sim};
use integration_tests::strategy::Rng;
use link::live::LiveDrive;
use link::transport::TransportError;
use link::transport::faulty::Rates;
use link::transport::{Emulator, Faulty, Transport};
use link::wired::Wired;
use loop_sim::port::PortError;
use loop_sim::port::drive::DriveDesign;
use pil_wire::{Disturbance, Order, Plant};
use scenario::Source;
use study::commission::{Leg, Outcome, Plan, Report, Retuned, Shake, Stand, Stopped, Verified, commission, sheet_of};
use study::identify::{Identified, MOST_RESIDUAL_STEPS, PlantData, Sheet};

fn good<V>(result: Result<V, PortError>) -> V {
    result.unwrap_or_else(|error| panic!("{error}"))
}

fn told<V: std::fmt::Debug>(result: Result<V, PortError>) -> String {
    match result {
        Err(PortError::Refused(why)) => why,
        other => panic!("not refused: {other:?}"),
    }
}

fn connect<T: Transport>(wire: T) -> LiveDrive<T> {
    good(LiveDrive::connect(wire, Duration::from_millis(50)))
}

fn bench(seed: Option<u64>) -> LiveDrive<Faulty<Bench>> {
    connect(Faulty::new(Bench::new(), Rates::all(if seed.is_some() { 0.05 } else { 0.0 }), seed.unwrap_or(0)))
}

/// Returns an excitation current that varies from row to row.
fn shake(rows: usize, peak_a: f32) -> Vec<f32> {
    (0..rows).map(|k| peak_a * ((k * 37 % 101) as f32 / 50.0 - 1.0)).collect()
}

/// Waits until the recording ends by itself.
fn ended<T: Transport>(drive: &mut LiveDrive<T>) {
    while good(drive.tracked()).goes_on {}
}

#[test]
fn a_record_is_what_went_in_and_out_to_the_bit_whatever_the_wire_loses() {
    for (seed, every, peak_a) in [(None, 1, 1.0), (None, 3, 2.0), (Some(3), 5, 1.5)] {
        let mut drive = bench(seed);
        let mut wave = shake(200, peak_a);
        // Together with the controller's current this exceeds the limit; the applied current stays within it.
        wave[100..102].copy_from_slice(&[10.0, -10.0]);
        good(drive.record(every, &wave));
        good(drive.move_to(1.0, 300));
        ended(&mut drive);
        let is = good(drive.tracked());
        let rows = good(drive.rows(|_| ()));
        assert!((is.rows, is.of, is.every) == (200, 200, every) && rows.len() == 200, "{is:?}");
        assert!(!is.lost && is.missed == 0, "{is:?}");
        let chip = &drive.transport().inner().chip;
        for (k, (counts, held)) in rows.iter().enumerate() {
            let first = (is.first as usize) + k * every as usize;
            assert_eq!(counts, &[chip.counts[first], 0], "row {k}");
            let sent = &chip.u[first..first + every as usize];
            let mean = sent.iter().fold(0.0_f32, |sum, u| sum + u) / every as f32;
            assert_eq!(held.to_bits(), mean.to_bits(), "row {k}: {sent:?}");
            assert!(sent.iter().all(|u| u.abs() <= 10.0), "row {k}: {sent:?}");
        }
        // The excitation is visible in the applied current; a drive at rest applies almost none.
        let largest = rows.iter().fold(0.0_f32, |most, (_, held)| most.max(held.abs()));
        assert!(largest > 3.0, "{largest} A");
    }
}

/// The trace buffer replays bit for bit during an excitation, because the observers use the applied current.
#[test]
fn what_shakes_is_known_to_the_observers_to_the_bit() {
    let mut drive = bench(None);
    good(drive.record(2, &shake(1000, 3.0)));
    for _ in 0..60 {
        good(drive.observe());
    }
    good(drive.order(Order::Freeze));
    let again = good(drive.black_box()).replay().unwrap_or_else(|error| panic!("{error}"));
    assert!(again.len() > 256 && again.iter().all(link::black_box::Again::is_same));
    assert!(again.iter().any(|it| (it.then.counts.applied - it.then.u).abs() > 1.0), "nothing shook");
}

#[test]
fn a_record_ends_where_a_count_is_lost_and_so_does_what_shakes() {
    let mut drive = bench(None);
    good(drive.record(1, &shake(1000, 2.0)));
    for _ in 0..10 {
        good(drive.observe());
    }
    good(drive.disturb(Disturbance { lost: [true, false], ..Disturbance::default() }));
    ended(&mut drive);
    let is = good(drive.tracked());
    assert!(is.lost && is.rows > 50 && is.rows < 300, "{is:?}");
    good(drive.disturb(Disturbance::default()));
    assert_eq!(good(drive.rows(|_| ())).len(), is.rows as usize);
    // The drive works as before.
    good(drive.move_to(0.5, 0));
    while good(drive.observe()).moving {}
    assert!((drive.transport().inner().chip.angle_rad() - 0.5).abs() < 5e-3);
}

#[test]
fn what_no_record_can_be_is_refused_and_changes_nothing() {
    let mut drive = bench(None);
    assert!(
        told(drive.rows(|_| ()).and_then(|rows| if rows.is_empty() { drive.order(Order::Record) } else { Ok(()) }))
            .contains("no record")
    );
    // The last case lasts 61 s.
    for (every, rows) in [(0, 10), (1001, 10), (1, 0), (1, 1 << 20), (1000, 61)] {
        assert!(told(drive.record(every, &vec![0.0; rows])).contains("rows of a record"), "{every} {rows}");
    }
    for current in [f32::NAN, f32::INFINITY, -10.1] {
        assert!(told(drive.record(1, &[0.0, current])).contains("an excitation of"), "{current}");
    }
    good(drive.record(1, &shake(2000, 0.5)));
    assert!(told(drive.record(1, &[0.0])).contains("end it first"));
    assert!(told(drive.rows(|_| ())).contains("end it first"));
    assert!(told(drive.swap(&loadable(&DESIGN))).contains("end it first"));
    good(drive.order(Order::EndRecord));
    let is = good(drive.tracked());
    assert!(!is.goes_on && is.rows < 2000, "{is:?}");
    good(drive.move_to(1.0, 1000));
    assert!(told(drive.swap_at_rest(&loadable(&DESIGN))).contains("must be at rest"));
    while good(drive.observe()).moving {}
    good(drive.swap_at_rest(&loadable(&DESIGN.with_surface(0.8 * DESIGN.bandwidths.surface_rad_s))));
}

/// A rejected `Prepare` keeps the existing recording.
#[test]
fn a_record_that_nobody_has_read_stays_when_another_is_refused() {
    let mut drive = bench(None);
    good(drive.record(1, &shake(200, 1.0)));
    ended(&mut drive);
    let rows = good(drive.rows(|_| ()));
    assert!(told(drive.record(0, &[0.0; 10])).contains("rows of a record"));
    assert_eq!(good(drive.rows(|_| ())), rows);
    // Prepared, then another one is rejected: the first one begins.
    good(drive.record_while(2, &[1.0; 40], || false).map(|has_begun| assert!(!has_begun)));
    assert!(told(drive.record(1, &vec![0.0; 1 << 20])).contains("rows of a record"));
    good(drive.order(Order::Record));
    assert!(told(drive.order(Order::Record)).contains("end it first"));
    ended(&mut drive);
    let is = good(drive.tracked());
    assert_eq!((is.rows, is.every), (40, 2));
}

/// A drive serves the later of two programs. If both use the same sequence numbers, neither program takes the other's
/// acknowledgement for its own.
#[test]
fn a_drive_that_two_programs_talk_to_does_not_take_one_for_the_other() {
    let shared = Shared::default();
    let [mut one, mut other] = [(); 2].map(|()| connect(shared.clone()));
    let why = loop {
        match one.observe() {
            Err(PortError::Silent { .. }) => {}
            Err(error) => break error.to_string(),
            Ok(seen) => panic!("it was heard: {seen:?}"),
        }
    };
    assert!(why.contains("another program"), "{why}");
    good(one.order(Order::Freeze));
    assert!(told(other.order(Order::Release)).contains("another program"));
    assert!(good(one.observe()).frozen);
}

/// Random host requests in any order, repeated, with absurd numbers, over a serial link that loses, damages, doubles
/// and delays frames. u stays within its limits and the motor does not run away. At the end the drive can be recovered
/// with its old gains.
#[test]
fn no_order_of_requests_makes_a_drive_run_away_or_lose_its_gains() {
    let (mut fastest, mut trips, mut done, mut refused) = (0.0_f64, 0, [0; 8], 0);
    for seed in 0..40 {
        let shared = Shared::default();
        let mut rng = Rng::new(seed);
        let rates = Rates::all(if seed % 2 == 0 { 0.0 } else { 0.05 });
        let mut drive = connect(Faulty::new(shared.clone(), rates, seed));
        let other = loadable(&DESIGN.with_surface(0.8 * DESIGN.bandwidths.surface_rad_s));
        for _ in 0..60 {
            let kind = rng.integer(0, 7);
            let rows = *rng.one_of(&[0, 1, 7, 300, 2000, 4000, 4001, 1 << 20]);
            let asked = match kind {
                0 | 1 => {
                    let every = *rng.one_of(&[0, 1, 3, 20, 1000, 1001]) as u32;
                    // Waveforms: one sign at the limit, alternating every tick, or a typical amplitude.
                    let most = *rng.one_of(&[10.0_f32, -10.0, 2.0, 11.0, f32::NAN]);
                    let swings = rng.chance(0.5);
                    let count = rows.min(4001);
                    let wave: Vec<f32> = (0..count).map(|k| if swings && k % 2 == 0 { -most } else { most }).collect();
                    let most_of_it = rng.chance(0.8);
                    drive.record_while(every, &wave, || most_of_it).map(|_| ())
                }
                2 => drive.order(*rng.one_of(&[Order::Record, Order::EndRecord, Order::Freeze])),
                3 => drive.order(*rng.one_of(&[Order::Release, Order::Reset, Order::Record])),
                4 => drive.move_to(rng.within(-6.0, 6.0), *rng.one_of(&[0, 5, 300])).map(|_| ()),
                5 => drive.swap(rng.one_of(&[other.clone(), loadable(&DESIGN)])).map(|_| ()),
                6 => drive.swap_at_rest(&other).map(|_| ()),
                _ => drive.rows(|_| ()).map(|_| ()).or(drive.stop(0).map(|_| ())),
            };
            match asked {
                Ok(()) => done[kind] += 1,
                Err(PortError::Refused(_)) => refused += 1,
                Err(error) => panic!("seed {seed}: {error}"),
            }
            shared.with(|bench| {
                for _ in 0..rng.integer(0, 10) {
                    bench.chip.pass(20);
                    fastest = fastest.max(bench.chip.speed_rad_s().abs());
                }
                assert!(bench.chip.u.iter().all(|u| u.abs() <= 10.0), "seed {seed}");
                bench.chip.u.clear();
            });
        }
        // Recovery as an operator does it.
        good(drive.order(Order::EndRecord));
        if !good(drive.observe()).health.is_ok() {
            trips += 1;
            // Without current friction stops the motor.
            let coasted = shared.with(|bench| {
                (0..300)
                    .take_while(|_| {
                        bench.chip.pass(100);
                        bench.chip.speed_rad_s().abs() > 0.1
                    })
                    .count()
            });
            assert!(coasted < 300, "seed {seed}: it runs");
            if good(drive.observe()).health.contains(Health::STOPPED) {
                good(drive.order(Order::Reset));
            }
        }
        good(drive.stop(0));
        while good(drive.observe()).moving {}
        good(drive.order(Order::Release));
        good(drive.swap_at_rest(&loadable(&DESIGN)));
        drop(drive);
        assert_as_before(&shared, &format!("seed {seed}"));
    }
    println!("fastest {fastest:.0} rad/s, {trips} of 40 tripped; done {done:?}, refused {refused}");
    assert!(done.iter().all(|done| *done > 20) && refused > 100, "{done:?} {refused}");
}

/// The motor of the bench as a scenario with a data sheet that is 25 % off.
const MOTOR: [&str; 6] = [
    "encoder.bits=20",
    "drive.gain_sets=2",
    "drive.uncertain_percent=50",
    "motor.current_lag_s=0",
    "motor.damping_n_m_s=1e-5",
    "motor.torque_n_m_per_a=0.0625",
];

/// Commissions the bench over this link; `watch` may interrupt it at any of its calls.
fn motor_commissioned<T: Transport>(wire: T, watch: &mut dyn FnMut() -> bool) -> Result<Report, Stopped> {
    let sets = MOTOR.map(str::to_owned);
    let source = Source { file: "motor.toml", text: scenario::MOTOR, sets: &sets };
    let experiment = scenario::parse(&source, "motor").unwrap_or_else(|error| panic!("{error}"));
    let designed = experiment.drive.expect("a drive").designed;
    let (plan, old) = (Plan::of(&designed), sheet_of(&designed));
    let mut watch = |_| if watch() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    let mut wired = Wired::new(connect(wire), designed, &mut watch)?;
    commission(&mut wired, &plan, &PlantData::with_lag(0.0), |found| {
        Retuned::of(&source, &old, found)?.designed("motor.toml")
    })
}

/// Checks the state after commissioning: a drive at rest, with the old gains, that moves on request.
fn assert_as_before(shared: &Shared, label: &str) {
    let mut drive = connect(shared.clone());
    assert_eq!(*drive.design(), loadable(&DESIGN), "{label}");
    assert!(!good(drive.tracked()).goes_on, "{label}");
    let seen = good(drive.observe());
    assert!(seen.health.is_ok() && !seen.moving, "{label}: {seen:?}");
    let still = shared.with(|bench| {
        let from = bench.chip.u.len();
        bench.chip.pass(400);
        bench.chip.u[from..].iter().fold(0.0_f32, |most, u| most.max(u.abs()))
    });
    assert!(still < 1.0, "{label}: it is still shaken, by {still} A");
    good(drive.move_to(0.5, 0));
    while good(drive.observe()).moving {}
    // The counter does not record whole revolutions; those made while coasting are lost.
    let off = shared.with(|bench| bench.chip.angle_rad() - 0.5);
    let off = off - std::f64::consts::TAU * (off / std::f64::consts::TAU).round();
    assert!(off.abs() < 5e-3, "{label}: {off} rad");
}

#[test]
fn a_motor_commissions_itself_over_a_wire_and_whoever_ends_that_early_has_the_old_gains_back() {
    let mut looks = 0_usize;
    let report = motor_commissioned(Shared::default(), &mut || {
        looks += 1;
        true
    });
    let report = report.unwrap_or_else(|why| panic!("{why}"));
    let b = report.identified.parameter("b").expect("a parameter");
    println!("{:?} {b:?} {:?}; {looks} looks", report.outcome, report.verified);
    assert_eq!(report.outcome, Outcome::Accepted);
    assert!((b.value / (0.05 / 2e-4) - 1.0).abs() < 0.05, "{b:?}");
    // Interruptions in every phase: upload, excitation, download, after the gain switch, verification, return.
    for part in 0..12 {
        let (end, mut seen) = (looks * part / 12 + 1, 0);
        let shared = Shared::default();
        let stopped = motor_commissioned(shared.clone(), &mut || {
            seen += 1;
            seen < end
        });
        let label = format!("look {end} of {looks}");
        assert!(matches!(stopped, Err(Stopped::Interrupted)), "{label}: {stopped:?}");
        assert_as_before(&shared, &label);
    }
}

/// Serial link that breaks after this many frames.
struct Unplugged<T>(T, usize);

impl<T: Transport> Transport for Unplugged<T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        let Some(left) = self.1.checked_sub(1) else { return Err(TransportError("unplugged".into())) };
        self.1 = left;
        self.0.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        if self.1 == 0 { Err(TransportError("unplugged".into())) } else { self.0.receive(into, within) }
    }
}

/// The link breaks at any point: the excitation ends by itself, the drive stays healthy, and the error message states
/// which gains run.
#[test]
fn a_drive_whose_wire_is_unplugged_comes_to_rest_by_itself() {
    for frames in [40, 300, 700, 1200, 1600] {
        let shared = Shared::default();
        let stopped = motor_commissioned(Unplugged(shared.clone(), frames), &mut || true);
        let told = match stopped {
            Err(stopped @ Stopped::Left { .. }) => stopped.to_string(),
            other => panic!("{frames} frames: {:?}", other.map(|report| report.outcome)),
        };
        assert!(told.contains("unplugged") && told.contains("NOT RESTORED"), "{told}");
        shared.with(|bench| bench.chip.pass(8000));
        let mut drive = connect(shared.clone());
        let seen = good(drive.observe());
        assert!(seen.health.is_ok() && !seen.moving && !good(drive.tracked()).goes_on, "{frames}: {seen:?}");
        good(drive.swap_at_rest(&loadable(&DESIGN)));
        assert_as_before(&shared, &format!("{frames} frames"));
    }
}

/// Starts an image of the firmware.
fn image(name: &str) -> LiveDrive<Emulator> {
    let file = path("../firmware/target/thumbv7em-none-eabihf/release").join(name);
    assert!(file.exists(), "{}: there is no such image: `cargo xtask firmware` builds it", file.display());
    connect(Emulator::paced(&file).unwrap_or_else(|error| panic!("{error}")))
}

/// Simulated joint.
#[derive(Clone, Copy)]
struct Case {
    /// True over nominal value of k_1, b_1, k_2, b_2, B_0.
    factors: [f64; 5],
    /// Friction as a share of the motor's torque at 30 A.
    friction: f64,
    cogging: f64,
    load_n_m: f32,
}

impl Case {
    fn plant(&self) -> Plant {
        let [k_1, b_1, k_2, b_2, b] = self.factors;
        let Joint { link_inertia_kg_m2: link, stiffness_n_m, .. } = Joint::TABLE_I;
        let motor = k_1 / k_2;
        let torque = Joint::TABLE_I.torque_n_m_per_a * motor * b;
        let most = 30.0 * torque;
        [
            link,
            Joint::TABLE_I.link_damping_n_m_s * b_1,
            Joint::TABLE_I.weight_n_m,
            stiffness_n_m * k_1,
            Joint::TABLE_I.motor_inertia_kg_m2 * motor,
            Joint::TABLE_I.motor_damping_n_m_s * motor * b_2,
            torque,
            self.friction * most,
            self.cogging * most,
        ]
        .map(|number| number as f32)
    }
}

const NOMINAL: Case = Case { factors: [1.0; 5], friction: 1.0 / 30.0, cogging: 0.0, load_n_m: 0.0 };
const CORNER: Case = Case { factors: [0.5, 1.5, 1.5, 0.5, 0.5], ..NOMINAL };

/// Factors drawn once within 50 %, with an unknown load and cogging.
const RANDOM: Case =
    Case { factors: [1.21, 0.68, 0.83, 1.34, 1.42], friction: 1.0 / 30.0, cogging: 0.01, load_n_m: 0.2 };

type Commissioned = (Result<Report, Stopped>, LiveDrive<Emulator>);

/// Drive whose link encoder misses counts for a moment on the way back.
struct Losing<'a>(Wired<'a, Emulator>, usize);

impl Stand for Losing<'_> {
    fn designed(&self) -> DriveDesign {
        self.0.designed()
    }
    fn period_s(&self) -> f64 {
        self.0.period_s()
    }
    fn at_rad(&self) -> f64 {
        self.0.at_rad()
    }
    fn begin(&mut self, shake: Option<&Shake>, most_s: f64) -> Result<(), Stopped> {
        self.0.begin(shake, most_s)
    }
    fn end(&mut self) -> Result<Leg, Stopped> {
        self.0.end()
    }
    fn rest(&mut self, seconds: f64) -> Result<(), Stopped> {
        self.0.rest(seconds)
    }
    fn go(&mut self, to_rad: f64, ticks: u32) -> Result<(), Stopped> {
        self.1 += 1;
        if self.1 == 2 {
            good(self.0.drive_mut().disturb(Disturbance { lost: [true, false], ..Disturbance::default() }));
            good(self.0.drive_mut().disturb(Disturbance::default()));
        }
        self.0.go(to_rad, ticks)
    }
    fn swap(&mut self, to: &DriveDesign, at_rest: bool) -> Result<f64, Stopped> {
        self.0.swap(to, at_rest)
    }
    fn give_up(&mut self) -> Result<(), Stopped> {
        self.0.give_up()
    }
}

/// Commissions the image `drive` with this joint from firmware/drive.toml; `change` alters the identified parameters.
fn commissioned(case: Case, change: impl Fn(&mut Identified), is_losing: bool) -> Commissioned {
    let text = std::fs::read_to_string(Path::new(&path("../firmware/drive.toml"))).expect("the scenario");
    // On a busy machine two requests may be far apart; missing counts in between must not stop the drive.
    let lost_ticks = if is_losing { "drive.lost_ticks=20000" } else { "drive.lost_ticks=50" };
    let sets = ["drive.uncertain_percent=50", "drive.gain_sets=2", "joint.current_lag_s=0", lost_ticks];
    let sets = sets.map(str::to_owned);
    let source = Source { file: "drive.toml", text: &text, sets: &sets };
    let experiment = scenario::parse(&source, "drive").unwrap_or_else(|error| panic!("{error}"));
    let designed = experiment.drive.expect("a drive").designed;
    let (plan, old) = (Plan::of(&designed), sheet_of(&designed));
    let known = PlantData { cogging_per_turn: (case.cogging > 0.0).then_some(24.0), ..PlantData::with_lag(0.0) };
    let mut drive = image("drive");
    good(drive.replace(case.plant()));
    good(drive.disturb(Disturbance { load_n_m: case.load_n_m, ..Disturbance::default() }));
    let mut on = |_| ControlFlow::Continue(());
    let wired = Wired::new(drive, designed, &mut on).unwrap_or_else(|error| panic!("{error}"));
    let design = |found: &mut Identified| {
        change(found);
        Retuned::of(&source, &old, found)?.taken_over_by(&designed, "drive.toml")?.designed("drive.toml")
    };
    if is_losing {
        let mut losing = Losing(wired, 0);
        return (commission(&mut losing, &plan, &known, design), losing.0.into_drive());
    }
    let mut wired = wired;
    (commission(&mut wired, &plan, &known, design), wired.into_drive())
}

/// Returns the relative errors of k_1, b_1, k_2, b_2, B_0.
fn off(case: &Case, found: &Identified) -> [f64; 5] {
    let believed = study::commission::plants::ratios(&Joint::TABLE_I);
    let names = ["k_1", "b_1", "k_2", "b_2", "B_0"];
    std::array::from_fn(|i| found.parameter(names[i]).expect(names[i]).value / (believed[i] * case.factors[i]) - 1.0)
}

/// Checks that the last ticks replay bit for bit with the design that stayed.
fn assert_same_bits(drive: &mut LiveDrive<Emulator>, stays: &DriveDesign) {
    assert_eq!(*drive.design(), link::remote::Loadable::try_from(stays).expect("a design"));
    good(drive.order(Order::Freeze));
    let again = good(drive.black_box()).replay().unwrap_or_else(|error| panic!("{error}"));
    assert!(again.len() >= 256 && again.iter().all(link::black_box::Again::is_same));
}

/// The fast tier covers the wrong link only, which includes the whole way and back.
#[test]
fn the_emulated_chip_commissions_itself_on_three_joints_and_sees_a_wrong_link() {
    let one = |name: &str, case: Case| {
        let (report, mut drive) = commissioned(case, |_| (), false);
        let report = report.unwrap_or_else(|why| panic!("{name}: {why}"));
        let Verified { peak_rad, residual_steps, move_s, .. } = report.verified;
        let off = off(&case, &report.identified);
        println!(
            "{name}: off {:?}; residuals {:.2} {residual_steps:.2?}; u jumps {:.2} A; record {:.1e}, settling {:.1e}, \
             move in {move_s:.2} s {peak_rad:.1e}, home {:.1e} rad; {:?}",
            off.map(|off| format!("{off:.1e}")),
            report.identified.link.expect("a link").residual_steps,
            report.jump_a,
            report.recorded_peak_rad,
            report.settling_rad,
            report.home_rad,
            drive.traffic()
        );
        assert_eq!(report.outcome, Outcome::Accepted, "{name}");
        for (off, bar) in off.iter().zip([5e-5, 1e-3, 0.1, 0.2, 0.1]) {
            assert!(off.abs() <= bar, "{name}: {off:e} of {bar:e}");
        }
        assert!(peak_rad <= 1e-4, "{name}: {peak_rad:e}");
        assert_same_bits(&mut drive, &report.designed);
    };
    // In parallel; an emulator ends with the thread that started it.
    let joints = [("nominal", NOMINAL), ("corner", CORNER), ("random", RANDOM)];
    std::thread::scope(|scope| {
        for (name, case) in joints.into_iter().filter(|_| deep()) {
            scope.spawn(move || one(name, case));
        }
    });
    the_old_gains_are_back_from_a_wrong_link();
}

/// Checks that a spring softer than the new gains assume brings the old gains back.
fn the_old_gains_are_back_from_a_wrong_link() {
    let wrong = |found: &mut Identified| {
        let Sheet::Joint(joint) = &mut found.sheet else { panic!("a joint") };
        let Joint { stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a, .. } = joint;
        for number in [stiffness_n_m, motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a] {
            *number *= 1.5;
        }
    };
    let (report, mut drive) = commissioned(NOMINAL, wrong, false);
    let report = report.unwrap_or_else(|why| panic!("{why}"));
    let Verified { peak_rad, residual_steps, .. } = report.verified;
    println!("{:?}: {peak_rad:.1e} rad, {residual_steps:?} steps; home {:.1e} rad", report.outcome, report.home_rad);
    assert_ne!(report.outcome, Outcome::Accepted);
    assert!(residual_steps.expect("a link") > 10.0 * MOST_RESIDUAL_STEPS, "{residual_steps:?}");
    assert!(report.home_rad < 2e-2, "{}", report.home_rad);
    let text = std::fs::read_to_string(Path::new(&path("../firmware/drive.toml"))).expect("the scenario");
    let sets = ["drive.uncertain_percent=50", "drive.gain_sets=2", "joint.current_lag_s=0"].map(str::to_owned);
    let source = Source { file: "drive.toml", text: &text, sets: &sets };
    let old = scenario::parse(&source, "drive").unwrap_or_else(|error| panic!("{error}")).drive.expect("a drive");
    assert_same_bits(&mut drive, &old.designed);
}

#[test]
fn the_emulated_chip_refuses_a_record_with_a_lost_stretch_and_is_as_before() {
    let (report, mut drive) = commissioned(NOMINAL, |_| panic!("nothing is to be found"), true);
    let why = report.expect_err("a refusal");
    println!("{why}");
    assert!(matches!(why, Stopped::Lost { .. }), "{why}");
    let seen = good(drive.observe());
    assert!(seen.health.is_ok() && !seen.moving && !good(drive.tracked()).goes_on, "{seen:?}");
}

/// Returns a recording of a motor behind a gear of 9, integrated in steps of 10 us along a sine by its own loop, with
/// an excitation of ten sines. K_t is 0.29 N m/A, the rotor 1e-3 kg m^2. Friction is 0.2 N m behind the gear; the motor
/// encoder has 14 bits.
fn record_of_a_geared_motor() -> String {
    let [gear, inertia, torque] = [9.0, 81.0 * 1e-3, 9.0 * 0.29];
    let step_rad = std::f64::consts::TAU / 16384.0 / gear;
    let (mut q, mut v, mut text) = (0.0_f64, 0.0_f64, String::from("tick,count_motor,u_held_a\n"));
    for k in 0..6000 {
        let t_s = 1e-3 * f64::from(k);
        let sines = (1..=10).map(|n| f64::from(7 * n)).map(|hz| (std::f64::consts::TAU * hz * t_s + hz * hz).sin());
        let by_loop = inertia / torque * (900.0 * (1.0 - (2.0 * t_s).cos() - q) - 45.0 * v);
        let u = (by_loop + 0.8 * sines.sum::<f64>()).clamp(-20.0, 20.0);
        writeln!(text, "{k},{},{u:?}", (q / step_rad).round()).expect("a text takes all");
        for _ in 0..100 {
            v += 1e-5 * (torque * u - 0.2 * (v / 1e-3).tanh()) / inertia;
            q += 1e-5 * v;
        }
    }
    text
}

/// `identify` (recording from a file) and `commission` (recording by the drive) both name the wrong key.
#[test]
fn a_torque_constant_of_the_gears_output_is_named_by_identify_and_by_commission() {
    let folder = Folder::new("commission-gear");
    let [data, file, to, out] = ["data.csv", "mine.toml", "found.toml", "out"].map(|name| folder.path(name));
    std::fs::write(&data, record_of_a_geared_motor()).expect("room");
    let typed = |torque: &str| {
        scenario::MOTOR
            .replace("inertia_kg_m2 = 2e-4", "inertia_kg_m2 = 1e-3\ngear = [9, 1]")
            .replace("torque_n_m_per_a = 0.05", &format!("torque_n_m_per_a = {torque}"))
            .replace("max_current_a = 10.0", "max_current_a = 20.0")
    };
    let named = "which a gear of 9 explains: motor.torque_n_m_per_a refers to the output of the gear, 9 times the \
                 motor value: set motor.torque_n_m_per_a = 0.2889";
    std::fs::write(&file, typed("2.6")).expect("room");
    let said = host_sim(&["identify", &data, &file, "-o", &to, "--out", &out]);
    assert!(said.status == 2 && said.err.contains(named), "{said:?}");
    // The plant has a ninth of the torque constant in the file.
    let commission = ["commission", &file, "-o", &to, "--out", &out];
    let said = host_sim(&[&commission[..], &["--set", "error.torque_percent=-88.85"]].concat());
    let told = "or the data sheet refers to the output of the gear of 9: motor.torque_n_m_per_a and \
                motor.inertia_kg_m2 belong to the motor shaft";
    assert!(said.status == 1 && said.err.contains("alarm (") && said.err.contains(told), "{said:?}");
    // With a gear of 2 the loop is stable, so the recording completes.
    let sets =
        ["motor.gear=[2, 1]", "motor.torque_n_m_per_a=0.1", "error.torque_percent=-50", "drive.uncertain_percent=50"];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let said = host_sim(&[&commission[..], &sets, &["--tolerance", "40"]].concat());
    let named = "which a gear of 2 explains: motor.torque_n_m_per_a refers to the output of the gear, 2 times the \
                 motor value: set motor.torque_n_m_per_a = 0.05";
    assert!(said.status == 1 && said.err.contains(named), "{said:?}");
    // The requested value is the remedy.
    std::fs::write(&file, typed("0.2889")).expect("room");
    let said = host_sim(&["identify", &data, &file, "-o", &to, "--out", &out]);
    assert_eq!(said.status, 0, "{said:?}");
}
