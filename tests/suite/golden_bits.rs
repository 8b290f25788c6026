//! Bit-identity of every controller configuration across releases.
//!
//! The promise: a patch release never changes a bit of a tick or of a design. `tests/golden/bits.txt` has a hash
//! (FNV-1a, 64 bits) of a million ticks for each controller configuration and each form of a drive. The hash covers
//! every u, σ, σ* and health, and the estimates of every 16th tick. The ticks run in a loop with a simple plant, in f64
//! and with `+ - * /` alone, so the table is valid on every machine. Samples are noisy, and some are wrong or missing.
//! The applied u sometimes differs from the demand, and the state is sometimes reset. One different rounding makes the
//! loops diverge.
//!
//! The changelog contains the hash of the table, so a changed bit needs a line there.
//!
//! The fast tier runs the first 20 000 ticks of each row, against `tests/golden/bits-20000.txt`.

use controller_core::drive::{Encoder, Joint, JointDesign, Motor, MotorDesign};
use controller_core::{Health, Limits, shapes};
use integration_tests::data::path;
use integration_tests::deep;
use integration_tests::golden::compare;
use integration_tests::oracle::{Gains, Model, Spec};
use integration_tests::shape::{Precision, controller};
use integration_tests::strategy::{Rng, drift_row, surface};
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows, Form, Goal, Monitors, Motion, Reaction};
use loop_sim::sensor::encoder::Mounted;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

const TICKS: u32 = 1_000_000;
const FAST_TICKS: u32 = 20_000;
const PERIOD_S: f64 = 1e-3;

/// FNV-1a hash, 64 bits.
struct Hash(u64);

impl Hash {
    const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn number(&mut self, number: f64) {
        self.bytes(&number.to_bits().to_le_bytes());
    }
}

/// Result of the ticks of a row.
struct Seen {
    hash: Hash,
    rejected: u32,
    saturated: u32,
}

impl Seen {
    const NOTHING: Self = Self { hash: Hash::EMPTY, rejected: 0, saturated: 0 };

    fn tick(&mut self, [u, sigma, sigma_star]: [f64; 3], health: Health) {
        for number in [u, sigma, sigma_star] {
            self.hash.number(number);
        }
        let bits = health.bits();
        self.hash.bytes(&bits.to_le_bytes()[..=usize::from(bits > 255)]);
        self.rejected += u32::from(health.contains(Health::INPUT_REJECTED));
        self.saturated += u32::from(health.contains(Health::SATURATED));
    }
}

/// Invalid values of a sensor or a sum.
const WRONG: [f64; 8] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30, -1e13, 1e-40, -0.0, 1e3];

/// Event next to a tick.
enum Event {
    Nothing,
    /// The sample of a channel has this wrong value.
    Wrong(usize, f64),
    /// The actuator applies this share of u.
    Held(f64),
    /// The state is reset.
    Restart,
}

fn event(bits: u64) -> Event {
    match bits % 8192 {
        0 => Event::Restart,
        1..=64 => Event::Wrong((bits >> 16) as usize % 6, WRONG[(bits >> 20) as usize % WRONG.len()]),
        65..=192 => Event::Held((bits >> 16 & 15) as f64 / 16.0),
        _ => Event::Nothing,
    }
}

/// Returns a number from -1 to 1, in steps of 1/128.
fn fraction(bits: u64) -> f64 {
    f64::from((bits & 255) as u8 as i8) / 128.0
}

use Loop::{Bent, Straight};

/// Kind of model and plant.
#[derive(Clone, Copy)]
enum Loop {
    /// a(x) linear, b constant.
    Straight,
    /// a(x) with a part that the design omits, and b(x).
    Bent,
}

/// Runs a chain of order n with poles at -1, Euler steps of one period, disturbed in every channel.
fn chain((n, r, mask): (usize, usize, u8), precision: Precision, kind: Loop, ticks: u32) -> Seen {
    let row = drift_row(&vec![(-1.0, 0.0); n]);
    let mut model = Model::linear(&row, 2.0);
    if matches!(kind, Bent) {
        (model.bend, model.swing) = (3.0, 0.3);
    }
    let gains = |i: usize| {
        let least = (n - 1 - i).max(1);
        let order = least + i % (r - least + 1);
        Gains::from_bandwidth(40.0 + 5.0 * i as f64, order)
    };
    let spec = Spec {
        period_s: PERIOD_S,
        c: surface(&vec![(-4.0, 0.0); n - 1]),
        alpha: 1.0,
        k_l: 10.0,
        k_s: 0.5,
        epsilon: 0.01,
        gradient: row,
        input_gain: model.input_gain,
        observers: (0..n).map(|i| (mask >> i & 1 == 1).then(|| gains(i))).collect(),
        limit: 1000.0,
    };
    let mut law = controller(&spec, &model, r, precision).expect("a good design");
    let mut rng = Rng::new(u64::from(mask) << 16 | (n << 8 | r) as u64);
    let (mut x, mut push, mut seen) = (vec![0.5; n], vec![0.0; n], Seen::NOTHING);
    assert!(law.start(&x), "a good sample");
    for k in 0..ticks {
        let bits = rng.bits();
        if k % 512 == 0 {
            push = (0..n).map(|i| 0.1 * fraction(bits >> (8 * i))).collect();
        }
        let mut sample: Vec<f64> = (0..n).map(|i| x[i] + 1e-6 * fraction(bits >> (16 + 8 * i))).collect();
        let event = event(rng.bits());
        if let Event::Wrong(i, value) = event {
            sample[i % n] = value;
        }
        if matches!(event, Event::Restart) {
            let d_hat: Vec<f64> = (0..n).map(|i| fraction(bits >> (8 * i))).collect();
            assert!(law.start_from(&sample, &d_hat), "a good sample");
        }
        let told = law.tick(&sample);
        seen.tick([told.u, told.sigma, told.sigma_star], told.health);
        if k % 16 == 0 {
            for number in law.estimates().as_flattened() {
                seen.hash.number(*number);
            }
        }
        let mut u = told.u;
        if let Event::Held(share) = event {
            u *= share;
            law.report_applied(u);
        }
        let last = model.a(&x) + model.b(&x) * u;
        for i in 0..n {
            let rate = if i + 1 < n { x[i + 1] } else { last };
            x[i] += PERIOD_S * (rate + push[i]);
        }
    }
    seen
}

/// Runs a drive on the counts of a plant without friction, along a sine or at a speed.
fn drive(design: &DriveDesign, ticks: u32) -> Seen {
    let speed = Goal::Speed { speed_rad_s: 7.0 };
    let sine = Goal::Sine { amplitude_rad: 4.0, omega_rad_s: 1.5 };
    let goal = if design.form().follows == Follows::Speed { speed } else { sine };
    let motion = Motion { goal, start: 100, ticks: 1000, ..Motion::rest(0.0, PERIOD_S) };
    let mut port = design.port(&motion).expect("a good design");
    let mut rng = Rng::new(7);
    // Angle and speed of the motor, then of the link.
    let (mut x, mut push, mut queued, mut lost_ticks, mut seen) = ([0.0; 4], 0.0, 0.0, 0, Seen::NOTHING);
    let mut stopped = false;
    for k in 0..ticks {
        let bits = rng.bits();
        if k % 512 == 0 {
            push = fraction(bits);
        }
        let event = event(rng.bits());
        let encoders = design.encoders();
        let angles = if encoders.len() == 1 { [x[0]; 2] } else { [x[2], x[0]] };
        let mut sample: Vec<f64> =
            encoders.iter().zip(angles).map(|((_, mounted), angle)| mounted.count(angle)).collect();
        if let Event::Wrong(i, value) = event {
            let at = i % sample.len();
            match value {
                // No shaft moves this far in a tick.
                1e3 => sample[at] += 1e3,
                // Longer than a drive bridges.
                1e30 => lost_ticks = 80,
                _ => sample[at] = f64::NAN,
            }
        }
        if lost_ticks > 0 {
            lost_ticks -= 1;
            sample.fill(f64::NAN);
        }
        if matches!(event, Event::Restart) || stopped {
            port.reset().expect("in this process");
        }
        let told = port.tick(&sample).expect("in this process");
        seen.tick([told.u, told.sigma, told.sigma_star], told.health);
        stopped = told.health.contains(Health::STOPPED);
        if k % 16 == 0 {
            for number in told.estimates.as_flattened() {
                seen.hash.number(*number);
            }
        }
        let mut u = told.u;
        if let Event::Held(share) = event {
            u *= share;
            port.report_applied(u);
        }
        if design.form().delay_ticks == 1 {
            std::mem::swap(&mut u, &mut queued);
        }
        match design {
            DriveDesign::Motor(DriveOf { design, .. }) => {
                let motor = design.motor;
                let torque = motor.torque_n_m_per_a * (u + push) - motor.damping_n_m_s * x[1];
                x[1] += PERIOD_S * torque / motor.inertia_kg_m2;
            }
            DriveDesign::Joint(DriveOf { design, .. }) => {
                let joint = design.joint;
                let spring = joint.stiffness_n_m * (x[0] - x[2]);
                let torque = joint.torque_n_m_per_a * (u + push) - spring - joint.motor_damping_n_m_s * x[1];
                x[1] += PERIOD_S * torque / joint.motor_inertia_kg_m2;
                x[3] += PERIOD_S * (spring - joint.link_damping_n_m_s * x[3]) / joint.link_inertia_kg_m2;
                x[2] += PERIOD_S * x[3];
            }
        }
        x[0] += PERIOD_S * x[1];
    }
    seen
}

/// Name, plant order, capacity of the observers, observed channels.
const SHAPES: &[(&str, (usize, usize, u8))] = {
    macro_rules! named {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            &[$((stringify!($name), ($n, $r, $mask))),*]
        };
    }
    shapes!(all => named)
};

/// Row of the table: its name and its run.
type Row = (String, Box<dyn Fn(u32) -> Seen + Send + Sync>);

fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for &(name, shape) in SHAPES {
        for (kind, precision, of) in [
            (Straight, Precision::Single, "f32"),
            (Bent, Precision::Single, "f32, b(x)"),
            (Straight, Precision::Double, "f64"),
        ] {
            rows.push((format!("{name} {of}"), Box::new(move |ticks| chain(shape, precision, kind, ticks))));
        }
    }
    for form in forms() {
        let Form { follows, gain_sets, delay_ticks, observer_states } = form;
        let of = format!("{gain_sets} gain sets, {delay_ticks} late, {observer_states} states");
        let follows = if follows == Follows::Position { "position" } else { "speed" };
        rows.push((format!("motor {follows}, {of}"), Box::new(move |ticks| drive(&motor(form), ticks))));
        if follows == "position" && observer_states == 4 {
            rows.push((format!("joint {follows}, {of}"), Box::new(move |ticks| drive(&joint(form), ticks))));
        }
    }
    rows
}

fn forms() -> Vec<Form> {
    let mut forms = Vec::new();
    for follows in [Follows::Position, Follows::Speed] {
        for gain_sets in [1, 2] {
            for delay_ticks in [0, 1] {
                let form = |observer_states| Form { follows, gain_sets, delay_ticks, observer_states };
                forms.extend([3, 4].map(form));
            }
        }
    }
    forms
}

/// Returns the monitors of a drive by rule; an alarm is reported without a reaction.
fn monitors<const E: usize>() -> Monitors<E> {
    let disturbance = [None; E];
    Monitors {
        uncertain: 0.2,
        disturbance,
        sigma_star: None,
        stuck_ticks: None,
        sudden_load_n_m: 1.3,
        reaction: Reaction::GoOn,
        fence: None,
        rest_band: None,
    }
}

fn motor(form: Form) -> DriveDesign {
    let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    let encoder = Encoder::absolute(14);
    let design = MotorDesign::by_rule(PERIOD_S, motor, encoder, Limits::symmetric(10.0));
    DriveDesign::Motor(DriveOf { design, form, mounted: [Mounted::new(encoder)], monitors: monitors() })
}

fn joint(form: Form) -> DriveDesign {
    let encoders = [Encoder::absolute(20); 2];
    let design = JointDesign::new(PERIOD_S, Joint::TABLE_I, encoders, Limits::symmetric(30.0), 1.3);
    DriveDesign::Joint(DriveOf { design, form, mounted: encoders.map(Mounted::new), monitors: monitors() })
}

/// Runs all rows with this many ticks each, on all cores.
fn table(ticks: u32) -> String {
    let rows = rows();
    let (next, lines) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some((name, run)) = rows.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Seen { hash, rejected, saturated } = run(ticks);
            // Most ticks must be accepted and some rejected. A short run may not saturate.
            let is_mixed = (ticks / 1_000..ticks / 10).contains(&rejected)
                && (ticks / 100_000..ticks / 10 * 9).contains(&saturated);
            assert!(is_mixed, "{name}: {rejected} ticks rejected, {saturated} at a limit");
            lines.lock().expect("no row failed").push(format!("{name:44} {:016x}\n", hash.0));
        }
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    let mut lines = lines.into_inner().expect("no row failed");
    lines.sort();
    lines.concat()
}

#[test]
fn a_million_ticks_of_every_shape_are_those_of_the_golden_table_to_the_bit() {
    compare("bits-20000.txt", &table(FAST_TICKS)).unwrap_or_else(|difference| panic!("{difference}"));
    if deep() {
        compare("bits.txt", &table(TICKS)).unwrap_or_else(|difference| panic!("{difference}"));
    }
}

#[test]
fn whoever_changes_a_bit_says_so_in_the_changelog() {
    let table = std::fs::read(path("golden/bits.txt")).expect("the table");
    let mut hash = Hash::EMPTY;
    hash.bytes(&table);
    let changelog = std::fs::read_to_string(path("../CHANGELOG.md")).expect("the changelog");
    let newest = changelog.lines().find_map(|line| line.strip_prefix("* Bits ")?.split_once(':'));
    let (newest, why) = newest.expect("a line `* Bits HASH: what changed`");
    let now = format!("{:016x}", hash.0);
    assert!(
        newest == now && why.len() > 20,
        "the table of bits is another one: the newest section of CHANGELOG.md needs a line `* Bits {now}: ` with what \
         changed a number and why; that is no patch release"
    );
}

#[test]
fn the_hash_is_the_published_one() {
    // draft-eastlake-fnv, appendix C.
    for (text, hash) in [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)] {
        let mut of = Hash::EMPTY;
        of.bytes(text.as_bytes());
        assert_eq!(of.0, hash, "{text}");
    }
}
