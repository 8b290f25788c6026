//! Play behind a gear: a shaft that oscillates around a target at rest, and the lower gains that calm it.
//!
//! The plant is the suite's own: two inertias with flanks between them (stiff, hardly damped, they push and never
//! pull), stiction on the motor, a current loop, double precision and small steps. The encoder is on the load. Without
//! play the plant is a motor with a rigid load.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use controller_core::drive::{
    Encoder, LowerGains, Monitored, Motor, MotorDesign, MotorDrive, Position, RestBand, RestLearning, Resting, Sample,
    Target,
};
use controller_core::{Health, Limits, Running};
use integration_tests::strategy::Rng;
use integration_tests::{deep, golden};

/// True plant parameters, all at the shaft behind the gear.
#[derive(Clone, Copy, Debug)]
struct Sheet {
    motor_inertia: f64,
    load_inertia: f64,
    torque_per_a: f64,
    limit_a: f64,
    lag_s: f64,
    bits: u32,
    period_s: f64,
    /// Coulomb and static friction, N m.
    friction: [f64; 2],
    play_rad: f64,
    /// Stiffness of the flanks.
    stiffness: f64,
    damping: f64,
}

/// Hobby servo with 12 bits behind a gear of 288.
const GRIPPER: Sheet = Sheet {
    motor_inertia: 2e-8 * 288.0 * 288.0,
    load_inertia: 1e-4,
    torque_per_a: 0.0045 * 288.0,
    limit_a: 0.7,
    lag_s: 1e-3,
    bits: 12,
    period_s: 2e-3,
    friction: [0.0288, 0.0432],
    play_rad: 0.01,
    stiffness: 20.0,
    damping: 5e-3,
};

impl Sheet {
    /// Returns the design of its drive.
    fn design(&self) -> MotorDesign {
        let motor = Motor {
            inertia_kg_m2: self.motor_inertia + self.load_inertia,
            torque_n_m_per_a: self.torque_per_a,
            damping_n_m_s: 0.0,
        };
        let limits = Limits::symmetric(self.limit_a);
        MotorDesign::by_rule(self.period_s, motor, Encoder::absolute(self.bits), limits).with_lag(self.lag_s, 0)
    }

    /// Returns a plant with other inertias and another torque constant than in the design.
    fn off(mut self, inertia: f64, torque: f64) -> Self {
        self.motor_inertia *= inertia;
        self.load_inertia *= inertia;
        self.torque_per_a *= torque;
        self
    }
}

struct Plant {
    of: Sheet,
    /// Angle and speed of the motor, then of the load; current.
    motor: [f64; 2],
    load: [f64; 2],
    current: f64,
    /// External torque against the load, N m.
    external: f64,
}

/// Returns the speed after one step of a shaft with stiction.
fn slides(speed: f64, push: f64, [coulomb, holds]: [f64; 2], inertia: f64, h: f64) -> f64 {
    if speed == 0.0 && push.abs() <= holds {
        return 0.0;
    }
    let way = if speed == 0.0 { push.signum() } else { speed.signum() };
    let next = speed + h * (push - way * coulomb) / inertia;
    if speed != 0.0 && next * speed < 0.0 && push.abs() <= holds { 0.0 } else { next }
}

impl Plant {
    fn advance(&mut self, u: f64) {
        let of = self.of;
        let steps = if of.play_rad > 0.0 { 200 } else { 20 };
        let h = of.period_s / f64::from(steps);
        let follows = 1.0 - (-h / of.lag_s).exp();
        for _ in 0..steps {
            self.current += follows * (u - self.current);
            let torque = of.torque_per_a * self.current;
            if of.play_rad == 0.0 {
                let inertia = of.motor_inertia + of.load_inertia;
                self.motor[1] = slides(self.motor[1], torque - self.external, of.friction, inertia, h);
                self.motor[0] += h * self.motor[1];
                self.load = self.motor;
                continue;
            }
            let twist = self.motor[0] - self.load[0];
            let over = twist - twist.clamp(-0.5 * of.play_rad, 0.5 * of.play_rad);
            let pushed = of.stiffness * over + of.damping * (self.motor[1] - self.load[1]);
            let flank = if over * pushed > 0.0 { pushed } else { 0.0 };
            self.motor[1] = slides(self.motor[1], torque - flank, of.friction, of.motor_inertia, h);
            self.load[1] += h * (flank - self.external) / of.load_inertia;
            self.motor[0] += h * self.motor[1];
            self.load[0] += h * self.load[1];
        }
    }
}

type Drive = Monitored<MotorDrive<f32, Position, 1>, 1>;

struct Rig {
    running: Running<Drive>,
    band: RestBand,
    resting: Resting,
    plant: Plant,
    tick: u32,
    /// Encoder noise, rad, and its random generator.
    noise: f64,
    rng: Rng,
    health: Health,
    u: f64,
}

impl Rig {
    /// Creates a drive for one data sheet on another plant.
    fn new(sheet: &Sheet, truth: Sheet, learning: RestLearning) -> Self {
        let design = sheet.design();
        let law = MotorDrive::<f32, Position, 1>::design(&design);
        let bounds = design.bounds(&law, 0.2);
        let plant = Plant { of: truth, motor: [0.0; 2], load: [0.0; 2], current: 0.0, external: 0.0 };
        Self {
            running: Running::new(Monitored::new(law, &bounds)),
            band: design.rest_band(learning),
            resting: Resting::START,
            plant,
            tick: 0,
            noise: 0.0,
            rng: Rng::new(1),
            health: Health::OK,
            u: 0.0,
        }
    }

    fn t_s(&self) -> f64 {
        f64::from(self.tick) * self.plant.of.period_s
    }

    /// Runs one period along a reference that returns angle and speed at a time.
    fn period(&mut self, reference: &dyn Fn(f64) -> [f64; 2]) {
        let (t, period_s) = (self.t_s(), self.plant.of.period_s);
        let target = |t: f64| {
            let [r, v] = reference(t);
            let turn = (r / TAU).round();
            Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v as f32] }
        };
        let [mut begin, mut end] = [t, t + period_s].map(target);
        let unit = TAU / f64::from(1_u32 << self.plant.of.bits);
        let noise = (0..12).map(|_| self.rng.within(-0.5, 0.5)).sum::<f64>();
        let count = ((self.plant.load[0] + self.noise * noise) / unit).round() as i32;
        let known = self.running.estimates();
        let hunts = self.band.place(&mut self.resting, known.as_ref(), &mut begin, &mut end);
        let mut output = self.running.tick(&Sample { counts: [Some(count)], begin, end });
        output.health |= hunts;
        self.band.calm(&mut self.resting, &mut self.running, &mut output);
        (self.health, self.u) = (output.health, f64::from(output.u));
        self.plant.advance(self.u);
        self.tick += 1;
    }

    fn error(&self, reference: &dyn Fn(f64) -> [f64; 2]) -> f64 {
        self.plant.load[0] - reference(self.t_s())[0]
    }

    /// Returns mean and standard deviation of u, and the largest error, over this many seconds.
    fn look(&mut self, seconds: f64, reference: &dyn Fn(f64) -> [f64; 2]) -> [f64; 3] {
        let (mut sums, mut worst, ticks) = ([0.0; 2], 0.0_f64, (seconds / self.plant.of.period_s) as u32);
        for _ in 0..ticks {
            self.period(reference);
            sums = [sums[0] + self.u, sums[1] + self.u * self.u];
            worst = worst.max(self.error(reference).abs());
        }
        let [mean, square] = sums.map(|sum| sum / f64::from(ticks));
        [mean, (square - mean * mean).max(0.0).sqrt(), worst]
    }
}

/// Returns a move from 0 to an angle between two times.
fn way(to: f64, from_s: f64, until_s: f64) -> impl Fn(f64) -> [f64; 2] {
    move |t| {
        let s = ((t - from_s) / (until_s - from_s)).clamp(0.0, 1.0);
        let speed = 30.0 * s * s * (1.0 - s) * (1.0 - s) / (until_s - from_s);
        [to * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), to * speed]
    }
}

/// Returns the time at which the drive first reports oscillation, and the statistics of the three seconds from two
/// seconds after it.
fn rests(sheet: &Sheet, truth: Sheet, learning: RestLearning) -> (Option<f64>, [f64; 3]) {
    let mut rig = Rig::new(sheet, truth, learning);
    let reference = way(0.5, 0.1, 0.4);
    let mut heard = None;
    while rig.t_s() < 2.4 {
        rig.period(&reference);
        if rig.t_s() > 0.4 && rig.health.contains(Health::HUNTS) && heard.is_none() {
            heard = Some(rig.t_s() - 0.4);
        }
    }
    (heard, rig.look(3.0, &reference))
}

/// Half a degree of play: detected within half a second; after that the current is at most 3 %, for any friction and
/// for ±20 % in inertia and torque. Without lower gains the oscillation never ends.
#[test]
fn a_shaft_in_play_is_heard_and_calmed() {
    let mut table = vec![String::from(
        "| play, rad | J and K_t as on the sheet: without, with | J -20 %, K_t +20 % | J +20 %, K_t -20 % \
         | heard after, s (where 0.1 A and more) |\n|---|---|---|---|---|\n",
    )];
    for play_rad in [0.005, 0.01, 0.02] {
        let (mut cells, mut times) = (Vec::new(), Vec::new());
        for (inertia, torque) in [(1.0, 1.0), (0.8, 1.2), (1.2, 0.8)] {
            let mut worst = [0.0; 2];
            for friction in [[0.0; 2], GRIPPER.friction] {
                let truth = Sheet { friction, play_rad, ..GRIPPER }.off(inertia, torque);
                let (heard, [_, deviation, _]) = rests(&GRIPPER, truth, RestLearning::On);
                let (_, [_, without, _]) = rests(&GRIPPER, truth, RestLearning::Off);
                worst = [f64::max(worst[0], without), f64::max(worst[1], deviation)];
                if without > 0.1 {
                    times.extend(heard);
                    assert!(heard.is_some_and(|after| after <= 0.5), "{play_rad}: {heard:?}");
                }
                assert!(deviation <= 0.02, "{play_rad}, {inertia}, {torque}, {friction:?}: {deviation} A");
            }
            cells.push(format!("{:.3}, {:.3}", worst[0], worst[1]));
        }
        let [least, most] = [f64::min, f64::max].map(|of| times.iter().copied().reduce(of).unwrap_or(f64::NAN));
        table.push(format!("| {play_rad} | {} | {least:.2} to {most:.2} |\n", cells.join(" | ")));
    }
    golden::in_docs("evidence/tuning.md", "play", &table.concat()).unwrap_or_else(|differs| panic!("{differs}"));
}

/// A moving target switches to the drive's own gains at once, for any active gain set and any data sheet error. The
/// motion equals the motion of a drive that was never calmed, up to the start position. The shaft then rests again.
#[test]
fn a_calmed_shaft_moves_with_its_own_gains() {
    let (there, on) = (way(0.5, 0.1, 0.4), way(0.5, 2.4, 2.7));
    let reference = |t: f64| std::array::from_fn(|i| there(t)[i] + on(t)[i]);
    let mut lowered = 0;
    for play_rad in [0.005, 0.01] {
        for (inertia, torque) in [(1.0, 1.0), (0.8, 1.2), (1.2, 0.8), (0.8, 1.0), (1.5, 0.8)] {
            let truth = Sheet { play_rad, ..GRIPPER }.off(inertia, torque);
            let [(calmed, deviation), (never, _)] = [RestLearning::On, RestLearning::Off].map(|learning| {
                let mut rig = Rig::new(&GRIPPER, truth, learning);
                while rig.t_s() < 2.4 {
                    rig.period(&reference);
                }
                lowered += u32::from(rig.resting.is_lowered());
                let [.., worst] = rig.look(0.35, &reference);
                rig.look(0.5, &reference);
                let [_, deviation, _] = rig.look(1.5, &reference);
                assert!(!rig.health.contains(Health::STOPPED), "{truth:?}");
                (worst, deviation)
            });
            println!("{play_rad} {inertia} {torque}: {calmed:.4} rad on the way, {never:.4} never calmed");
            assert!(calmed <= never + 0.015 && deviation <= 0.02, "{truth:?}: {calmed}, {never} rad, {deviation} A");
        }
    }
    assert!(lowered >= 8, "{lowered} runs had lower gains");
}

/// A drive without play is never classified as oscillating. The test covers random data sheets, plants off by 20 %,
/// friction, steps and alternating loads, and flickering counts.
#[test]
fn a_healthy_drive_keeps_its_gains() {
    let runs = if deep() { 10_000 } else { 100 };
    let mut rng = Rng::new(3838);
    for run in 0..runs {
        let inertia = rng.spread(1e-6, 1e-1);
        let period_s = rng.spread(2e-4, 4e-3);
        // A move from 0 to a radian in 20 to 200 ticks of full torque.
        let ticks = rng.spread(20.0, 200.0);
        let torque = 2.0 * inertia / (ticks * period_s).powi(2);
        let friction = rng.within(0.0, 0.08) * torque;
        let sheet = Sheet {
            motor_inertia: inertia,
            load_inertia: 0.0,
            torque_per_a: torque,
            limit_a: 1.0,
            lag_s: rng.within(0.05, 1.5) * period_s,
            bits: rng.integer(11, 20) as u32,
            period_s,
            friction: [friction, friction * rng.within(1.0, 1.6)],
            play_rad: 0.0,
            stiffness: 0.0,
            damping: 0.0,
        };
        let truth = sheet.off(rng.within(0.8, 1.2), rng.within(0.8, 1.2));
        let mut rig = Rig::new(&sheet, truth, RestLearning::On);
        rig.noise = rng.within(0.0, 0.3) * TAU / f64::from(1_u32 << sheet.bits);
        let (step, wave) = (rng.within(-0.4, 0.4) * torque, rng.within(0.0, 0.2) * torque);
        let rate = rng.spread(0.01, 1.0) * sheet.design().bandwidths.observer_rad_s;
        let duration = 5.0 * ticks * period_s;
        let reference = way(1.0, 0.1 * duration, duration);
        for tick in 0..(20.0 * ticks) as u32 {
            let t = f64::from(tick) * period_s;
            let of_step = if (8.0..14.0).contains(&(t / duration * 4.0)) { step } else { 0.0 };
            let of_wave = if t > 3.2 * duration { wave * (rate * t).sin() } else { 0.0 };
            rig.plant.external = of_step + of_wave;
            rig.period(&reference);
            assert!(!rig.resting.is_lowered(), "run {run}, tick {tick} of {:.0}: {sheet:?}", 20.0 * ticks);
        }
        assert!((rig.plant.load[0] - 1.0).abs() < 0.5, "run {run}: it has not arrived, {}", rig.plant.load[0]);
    }
}

/// Lower gain set, written from the module's head, on a rigid motor with a current loop; double precision.
struct Loop {
    t: f64,
    b: f64,
    /// b of the plant over b of the design.
    off: f64,
    lag_s: f64,
    gains: [f64; 5],
    /// Angle, speed, current; q, v, d; u.
    x: [f64; 7],
}

impl Loop {
    /// Runs a tick with this pulse added to u; returns the plant input.
    fn tick(&mut self, pulse: f64) -> f64 {
        let Self { t, b, off, lag_s, gains: [l1, l2, l3, k1, k2], x: [p, w, i, q, v, d, u] } = *self;
        let acceleration = b * u + d;
        let foreseen = q + t * v + 0.5 * t * t * acceleration;
        let e = p - foreseen;
        let (q, v, d) = (foreseen + l1 * e, v + t * acceleration + l2 * e, d + l3 * e);
        let u = -(k1 * q + k2 * v + d) / b;
        let (given, gone) = (u + pulse, (-t / lag_s).exp());
        let left = i - given;
        self.x = [
            p + w * t + off * b * (given * t * t / 2.0 + left * (lag_s * t - lag_s * lag_s * (1.0 - gone))),
            w + off * b * (given * t + left * lag_s * (1.0 - gone)),
            given + left * gone,
            q,
            v,
            d,
            u,
        ];
        given
    }

    /// Returns the largest |S|, and the remainder of a pulse after this many ticks.
    fn peak(mut self, ticks: usize) -> (f64, f64) {
        let response: Vec<f64> = (0..ticks).map(|k| self.tick(if k == 0 { 1.0 } else { 0.0 })).collect();
        let most = (0..200).map(|j| {
            let turn = std::f64::consts::PI * 10_f64.powf(-4.0 * f64::from(j) / 200.0);
            let part = |k: usize, value: f64| ((turn * k as f64).cos() * value, (turn * k as f64).sin() * value);
            let sum = response.iter().enumerate().map(|(k, &value)| part(k, value));
            let (re, im) = sum.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
            f64::hypot(re, im)
        });
        (most.fold(0.0, f64::max), response[ticks - ticks / 10..].iter().fold(0.0, |most, u| most.max(u.abs())))
    }
}

/// Margins of the lower gain sets, as given in the module's head, for data sheets of any size.
#[test]
fn the_lower_sets_have_their_margins_on_any_data_sheet() {
    let mut rng = Rng::new(83);
    let mut worst = [0.0_f64; 3];
    for _ in 0..if deep() { 200 } else { 12 } {
        let period_s = rng.spread(5e-5, 4e-3);
        let inertia = rng.spread(1e-7, 0.1);
        let ticks = rng.spread(20.0, 1000.0);
        let torque = 2.0 * inertia / (ticks * period_s).powi(2);
        let motor = Motor { inertia_kg_m2: inertia, torque_n_m_per_a: torque, damping_n_m_s: 0.0 };
        let encoder = Encoder::absolute(rng.integer(10, 24) as u32);
        let lag_s = rng.within(0.01, 2.0) * period_s;
        let design = MotorDesign::by_rule(period_s, motor, encoder, Limits::symmetric(1.0)).with_lag(lag_s, 0);
        let band = design.rest_band(RestLearning::On);
        let (numbers, sets) = LowerGains::numbers(band.lower_gains().expect("lower gains"));
        let omega = design.bandwidths.observer_rad_s;
        for (set, share) in sets.iter().zip([0.25, 0.125]) {
            let ticks = (60.0 / (share * omega * period_s)) as usize;
            for (off, which) in [(1.0, 0), (0.5, 1), (1.5, 1), (1.0 / 3.0, 2), (3.0, 2)] {
                let gains = set.map(f64::from);
                let of = Loop { t: period_s, b: f64::from(numbers[1]), off, lag_s, gains, x: [0.0; 7] };
                let (peak, left) = of.peak(ticks);
                assert!(left < 1e-3, "{design:?}, b x {off}: {left} is left of a pulse");
                worst[which] = worst[which].max(peak);
            }
        }
    }
    println!("|S| up to {:.3}, {:.3} with b off by a half, {:.3} by a factor of three", worst[0], worst[1], worst[2]);
    assert!(worst[0] <= 1.55 && worst[1] <= 1.8, "{worst:?}");
}

/// With the encoder on the motor, the motor turns without its load between the flanks: the loop gain grows.
#[test]
fn a_motor_that_is_unstable_without_its_load_is_told_and_the_remedy_moves() {
    const WORDS: &str = "between the flanks of the play";
    // (load inertia with a rotor of 2e-4 kg m^2, remedy named by the warning)
    let cases: [(f64, Option<&[&str]>); 4] = [
        (2e-4, None),
        (6e-4, Some(&["drive.gain_sets=1"])),
        (1e-3, Some(&["drive.margin=\"standard\"", "drive.gain_sets=1"])),
        (3e-3, Some(&["encoder.behind_gear=true"])),
    ];
    for (load, remedy) in cases {
        let play = [format!("motor.load_inertia_kg_m2={load}"), "motor.play_rad=0.003".into()];
        let moved = |remedy: &[&str]| {
            let sets: Vec<String> = play.iter().cloned().chain(remedy.iter().map(|&set| set.into())).collect();
            let source = scenario::Source { file: "motor.toml", text: scenario::MOTOR, sets: &sets };
            let mut experiment = scenario::parse_own(&source, "motor").unwrap();
            let warning = experiment.warnings.iter().find(|text| text.contains(WORDS)).cloned();
            let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
            assert_eq!(error, None);
            (warning, trace.rows.iter().any(|row| row.health.contains(Health::STOPPED)))
        };
        let (warning, stopped) = moved(&[]);
        assert_eq!((warning.is_some(), stopped), (remedy.is_some(), remedy.is_some()), "{load}: {warning:?}");
        let (Some(remedy), Some(warning)) = (remedy, warning) else { continue };
        for set in remedy {
            assert!(warning.contains(&set.replace('=', " = ")), "{load}: {warning}");
        }
        assert_eq!(moved(remedy), (None, false), "{load}");
    }
}
