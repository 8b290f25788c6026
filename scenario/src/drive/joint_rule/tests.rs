//! Tests of the rule on data sheets without tuning, with an independent simulation of its designs.

#![allow(clippy::disallowed_methods, reason = "expected values come from another implementation")]

use std::f64::consts::TAU;

use super::*;

/// Data sheet: gear; J_m, K_t, B_m of the motor shaft; J_l, K, B_l, weight behind the gear; lag, largest u,
/// bits of link and motor, period, ticks of delay.
struct Row(&'static str, f64, [f64; 3], [f64; 4], f64, f64, [u32; 2], f64, usize);

#[rustfmt::skip]
const ROWS: [Row; 16] = [
    Row("paper, soft", 1.0, [931e-6, 0.119, 0.07], [0.23, 9.0, 0.07, 0.23], 2e-4, 30.0, [20, 20], 1e-3, 0),
    Row("harmonic drive", 100.0, [1.2e-4, 0.08, 2e-4], [0.4, 8000.0, 0.5, 10.0], 2e-4, 8.0, [19, 14], 1e-3, 0),
    Row("two masses, 92 Hz", 1.0, [0.01, 1.2, 0.01], [0.08, 3000.0, 0.05, 0.0], 1e-4, 20.0, [20, 20], 2.5e-4, 0),
    Row("gripper", 64.0, [2e-7, 0.01, 4e-7], [1.5e-3, 60.0, 2e-3, 0.1], 1e-4, 1.5, [12, 12], 1e-3, 1),
    Row("wafer stage", 1.0, [2e-3, 0.6, 1e-3], [6e-3, 900.0, 4e-3, 0.0], 5e-5, 12.0, [24, 24], 1e-4, 0),
    Row("elbow", 120.0, [6e-5, 0.06, 1e-4], [0.15, 4500.0, 0.4, 4.0], 3e-4, 6.0, [17, 12], 1e-3, 1),
    Row("crane", 30.0, [0.02, 0.9, 0.02], [400.0, 9e4, 60.0, 150.0], 1e-3, 60.0, [12, 12], 4e-3, 0),
    Row("conveyor", 5.0, [3e-4, 0.2, 3e-4], [0.5, 700.0, 0.3, 0.0], 2.5e-4, 15.0, [14, 16], 5e-4, 0),
    Row("antenna", 90.0, [5e-4, 0.12, 1e-3], [18.0, 2.5e4, 8.0, 20.0], 2e-4, 10.0, [22, 18], 1e-3, 2),
    Row("light link", 1.0, [4e-3, 0.5, 4e-3], [2e-4, 40.0, 1e-3, 0.2], 1e-4, 5.0, [18, 18], 5e-4, 0),
    Row("coarse link", 20.0, [4e-5, 0.05, 8e-5], [0.02, 300.0, 0.02, 0.5], 2e-4, 4.0, [10, 16], 1e-3, 0),
    Row("fast drive", 1.0, [5e-5, 0.1, 1e-4], [2e-4, 90.0, 2e-4, 0.0], 5e-5, 20.0, [20, 22], 5e-5, 0),
    Row("pendulum", 10.0, [3e-5, 0.07, 6e-5], [0.06, 25.0, 0.02, 1.2], 0.0, 5.0, [15, 13], 2e-3, 0),
    Row("near the period", 1.0, [1e-3, 0.3, 2e-4], [3e-3, 2400.0, 1e-3, 0.0], 2e-4, 10.0, [18, 18], 1e-3, 1),
    Row("late bus", 50.0, [1e-4, 0.1, 2e-5], [0.8, 3000.0, 0.02, 5.0], 1e-3, 10.0, [18, 18], 4e-3, 3),
    Row("lag of a period", 1.0, [2e-2, 1.5, 5e-2], [2.0, 800.0, 0.5, 3.0], 4e-3, 15.0, [12, 12], 4e-3, 0),
];

impl Row {
    fn sheet(&self, peak: f64) -> JointSheet {
        let &Row(_, gear, [j_m, k_t, b_m], [j_l, k, b_l, weight], lag_s, most_a, bits, period_s, delay_ticks) = self;
        JointSheet {
            joint: Joint {
                link_inertia_kg_m2: j_l,
                link_damping_n_m_s: b_l,
                weight_n_m: weight,
                stiffness_n_m: k,
                motor_inertia_kg_m2: j_m * gear * gear,
                motor_damping_n_m_s: b_m * gear * gear,
                torque_n_m_per_a: k_t * gear,
            },
            steps_rad: [TAU / f64::from(1_u32 << bits[0]), TAU / f64::from(1_u32 << bits[1]) / gear],
            period_s,
            lag_s,
            delay_ticks,
            most_a,
            uncertain: 0.2,
            peak,
            noise_share: 1e-3,
        }
    }
}

/// Linear congruential generator of numbers from 0 to 1.
struct Draw(u64);

impl Draw {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }

    fn logarithmic(&mut self, from: f64, to: f64) -> f64 {
        from * (to / from).powf(self.number())
    }

    fn whole(&mut self, from: u32, to: u32) -> u32 {
        from + (self.number() * f64::from(to - from + 1)) as u32
    }

    /// Returns a joint with a motor of up to 2 rad/s and 10 to 3000 rad/s².
    fn sheet(&mut self) -> JointSheet {
        let link = self.logarithmic(1e-4, 10.0);
        let motor = link / self.logarithmic(0.05, 200.0);
        let period_s = self.logarithmic(5e-5, 4e-3);
        let resonance = self.logarithmic(0.005, 1.9) / period_s;
        let stiffness = resonance * resonance / (1.0 / link + 1.0 / motor);
        let most_a = self.logarithmic(0.5, 40.0);
        let torque = (link + motor) * self.logarithmic(10.0, 3000.0);
        let damping = |draw: &mut Self, inertia: f64| 2.0 * draw.logarithmic(0.001, 0.1) * resonance * inertia;
        let gear = if self.number() < 0.5 { 1.0 } else { self.logarithmic(2.0, 160.0) };
        let step = |bits: u32| TAU / f64::from(1_u32 << bits);
        let joint = Joint {
            link_inertia_kg_m2: link,
            link_damping_n_m_s: 0.1 * damping(self, link),
            weight_n_m: if self.number() < 0.3 { 0.0 } else { (0.5 * self.number() * torque).min(0.2 * stiffness) },
            stiffness_n_m: stiffness,
            motor_inertia_kg_m2: motor,
            motor_damping_n_m_s: damping(self, motor),
            torque_n_m_per_a: torque / most_a,
        };
        JointSheet {
            joint,
            steps_rad: [step(self.whole(10, 24)), step(self.whole(10, 24)) / gear],
            period_s,
            lag_s: if self.number() < 0.3 { 0.0 } else { self.number() * period_s },
            delay_ticks: if self.number() < 0.7 { 0 } else { self.whole(1, 3) as usize },
            most_a,
            uncertain: if self.number() < 0.7 { 0.2 } else { 0.1 },
            peak: if self.number() < 0.5 { 2.4 } else { 1.7 },
            noise_share: 1e-3,
        }
    }
}

/// Result of a simulation.
#[derive(Debug)]
struct Rest {
    /// Largest step of u, as a share of the largest u.
    step_share: f64,
    /// Largest error of the link, rad.
    error_rad: f64,
    /// Largest share of the high gains under the load.
    loaded_level: f64,
    /// Share of the high gains at the end.
    level: f64,
}

/// Returns the reference of degree nine and its first three derivatives: 1 rad in `span_s`.
fn move_at(t: f64, span_s: f64) -> [f64; 4] {
    let s = (t / span_s).clamp(0.0, 1.0);
    let p = [0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0];
    std::array::from_fn(|order| {
        let term = |k: usize| (0..order).map(|d| k as f64 - d as f64).product::<f64>() * s.powi((k - order) as i32);
        (order..10).map(|k| p[k] * term(k)).sum::<f64>() / span_s.powi(order as i32)
    })
}

/// Share of the high gains: by smoothed innovations, for a limited time, and not with u at its limit.
struct Switch {
    /// Bandwidth times period, W T.
    rate: f64,
    smooth: [f64; 2],
    level: f64,
    /// Ticks with high gains.
    stay: f64,
    /// Calm ticks until the high gains are available again.
    locked: f64,
}

impl Switch {
    const fn of(rate: f64) -> Self {
        Self { rate, smooth: [0.0; 2], level: 0.0, stay: 0.0, locked: 0.0 }
    }

    fn level(&mut self, fast: &FastSet, innovation_steps: [f64; 2], at_limit: bool) -> f64 {
        let keep = (-self.rate / 0.16).exp();
        self.level *= (-self.rate / 1.1).exp();
        let mut most = 0.0_f64;
        for j in 0..2 {
            self.smooth[j] = keep * self.smooth[j] + (1.0 - keep) * innovation_steps[j];
            most = most.max(self.smooth[j].abs() / fast.calm_steps[j]);
        }
        self.level = self.level.max(((most - 1.0) / 1.67).clamp(0.0, 1.0));
        self.stay = if self.level > 0.05 { self.stay + 1.0 } else { 0.0 };
        if at_limit || self.stay * self.rate > 2.5 {
            self.locked = 10.0 / self.rate;
        }
        if self.locked > 0.0 {
            self.locked = if most < 1.0 { self.locked - 1.0 } else { 10.0 / self.rate };
            (self.level, self.stay) = (0.0, 0.0);
        }
        self.level
    }
}

/// Simulates a move of 1 rad, a load of 14 % of the largest torque for some time, then rest. The tick runs in f64 on
/// the joint `truth`, with a Runge-Kutta solver, the sine of gravity, quantised counts and limits. `None` if it takes
/// too long.
fn simulated(sheet: &JointSheet, rule: &JointRule, truth: &Joint) -> Option<Rest> {
    let (t, r) = (sheet.period_s, JointRatios::of(&sheet.joint, sheet.lag_s));
    let tick = JointTick::of(&r, t);
    let (phi, gamma) = tick.matrices(&r);
    let law = Regulator::of(&r, &tick, t, [rule.surface_rad_s, rule.reaching_per_s]).expect("a real pole");
    let quiet = [rule.link_rad_s, rule.motor_rad_s];
    let gains_of = |w| tick.observer_gains(&r, t, sheet.steps_rad, w);
    let by = rule.fast.map_or([1.0; 2], |fast| fast.ratios);
    let (quiet_gains, fast_gains) = (gains_of(quiet), gains_of([quiet[0] * by[0], quiet[1] * by[1]]));
    let (g, joint) = (sheet.joint.weight_n_m / sheet.joint.link_inertia_kg_m2, &sheet.joint);
    let inertia = joint.link_inertia_kg_m2 + joint.motor_inertia_kg_m2;
    let torque = sheet.most_a * joint.torque_n_m_per_a;
    // Corners may decay more slowly than the bandwidths suggest.
    let slowest = rule.surface_rad_s.min(rule.link_rad_s).min(8.0 * (1.0 - rule.radius) / t);
    let damping = joint.motor_damping_n_m_s + joint.link_damping_n_m_s;
    let span_s = (9.4 * inertia / (0.6 * torque - joint.weight_n_m)).sqrt().max(10.0 * damping / torque);
    let span_s = span_s.max(12.0 / r.k1.sqrt()).max(10.0 / slowest);
    // 14 % of the torque, limited to a twist of the spring by 3 degrees.
    let push = (0.14 * torque).min(0.05 * joint.stiffness_n_m);
    let loaded = [span_s + 25.0 / slowest, span_s + 50.0 / slowest];
    let ticks = ((loaded[1] + 60.0 / slowest) / t) as usize;
    if ticks > 60_000 {
        return None;
    }
    let watched = ((loaded[1] + 45.0 / slowest) / t) as usize;
    let reference = |time: f64| {
        let [q, v, a, j] = move_at(time, span_s);
        [q, v, q + (a + r.b1 * v + g * q.sin()) / r.k1, v + (j + r.b1 * a + g * q.cos() * v) / r.k1]
    };
    // x of the plant; estimates q, v, d of both shafts; both currents of the model.
    let (mut x, mut xi, mut i_model, mut i_r) = ([0.0_f64; 5], [0.0; 6], 0.0, 0.0);
    let mut queue = vec![0.0; sheet.delay_ticks];
    let (mut switch, mut level, mut last) = (Switch::of(rule.link_rad_s * t), 0.0_f64, 0.0_f64);
    let mut out = Rest { step_share: 0.0, error_rad: 0.0, loaded_level: 0.0, level: 0.0 };
    for k in 0..ticks {
        let now = k as f64 * t;
        let y = [0, 1].map(|e| (x[2 * e] / sheet.steps_rad[e]).round() * sheet.steps_rad[e]);
        let pull = -g * y[0].sin();
        let half = |xi: &mut [f64; 6]| {
            for shaft in 0..2 {
                xi[3 * shaft] += 0.5 * tick.g1[shaft][0] * pull;
                xi[3 * shaft + 1] += 0.5 * tick.g2[shaft][0] * pull;
            }
        };
        half(&mut xi);
        let e = [y[0] - xi[0], y[1] - xi[3]];
        if let Some(fast) = rule.fast {
            level = switch.level(&fast, [0, 1].map(|j| e[j] / sheet.steps_rad[j]), last.abs() >= sheet.most_a);
        }
        let blended = |shaft: usize, j: usize, s: usize| {
            quiet_gains[shaft][j][s] + level * (fast_gains[shaft][j][s] - quiet_gains[shaft][j][s])
        };
        for shaft in 0..2 {
            for s in 0..3 {
                xi[3 * shaft + s] += blended(shaft, 0, s) * e[0] + blended(shaft, 1, s) * e[1];
            }
        }
        let moved = |x: [f64; 5], u: f64, d: [f64; 2]| -> [f64; 5] {
            std::array::from_fn(|i| {
                let push = if i == 4 { [0.0; 2] } else { [tick.g1[i / 2], tick.g2[i / 2]][i % 2] };
                (0..5).map(|j| phi[i][j] * x[j]).sum::<f64>() + gamma[i] * u + push[0] * d[0] + push[1] * d[1]
            })
        };
        let state = [xi[0], xi[1], xi[3], xi[4], i_model];
        let ahead = queue.iter().fold(state, |x, &u| moved(x, u, [xi[2] + pull, xi[5]]));
        let late = sheet.delay_ticks as f64 * t;
        let ([q_0, v_0, m_0, w_0], [q_1, _, m_1, w_1]) = (reference(now + late), reference(now + late + t));
        let ff = ((w_1 - w_0) / t + 0.5 * (r.k2 * (m_0 - q_0 + m_1 - q_1) + r.b2 * (w_0 + w_1))) / r.b;
        let x_r = [q_0, v_0, m_0, w_0, i_r];
        let by_state: f64 = (0..5).map(|i| law.feedback[i] * (ahead[i] - x_r[i])).sum();
        let known = law.disturbance[0] * xi[2] + law.disturbance[1] * xi[5];
        let u = (ff + known - by_state).clamp(-sheet.most_a, sheet.most_a);
        i_r = ff + tick.keeps * (i_r - ff);
        queue.push(u);
        let applied = queue.remove(0);
        let next = moved(state, applied, [xi[2], xi[5]]);
        (xi, i_model) = ([next[0], next[1], xi[2], next[2], next[3], xi[5]], next[4]);
        half(&mut xi);
        let load = if now > loaded[0] && now < loaded[1] { push } else { 0.0 };
        if load > 0.0 {
            out.loaded_level = out.loaded_level.max(level);
        }
        x = integrated(truth, sheet.lag_s, t, x, applied, load);
        if k >= watched {
            out.step_share = out.step_share.max((u - last).abs() / sheet.most_a);
            out.error_rad = out.error_rad.max((x[0] - 1.0).abs());
        }
        last = u;
    }
    out.level = level;
    Some(out)
}

/// Returns the true joint one tick later.
fn integrated(joint: &Joint, lag_s: f64, t: f64, mut x: [f64; 5], u: f64, load: f64) -> [f64; 5] {
    let (j_l, j_m) = (joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2);
    let fastest =
        (joint.stiffness_n_m * (1.0 / j_l + 1.0 / j_m)).sqrt().max(if lag_s > 0.0 { 1.0 / lag_s } else { 0.0 });
    let fastest = fastest.max(joint.motor_damping_n_m_s / j_m);
    let steps = (5.0 * fastest * t).ceil().max(3.0);
    let rate = |x: [f64; 5]| {
        let spring = joint.stiffness_n_m * (x[2] - x[0]);
        let current = if lag_s > 0.0 { x[4] } else { u };
        [
            x[1],
            (spring - joint.link_damping_n_m_s * x[1] - joint.weight_n_m * x[0].sin() + load) / j_l,
            x[3],
            (joint.torque_n_m_per_a * current - spring - joint.motor_damping_n_m_s * x[3]) / j_m,
            if lag_s > 0.0 { (u - x[4]) / lag_s } else { 0.0 },
        ]
    };
    let h = t / steps;
    for _ in 0..steps as usize {
        let add = |k: [f64; 5], by: f64| -> [f64; 5] { std::array::from_fn(|i| x[i] + by * k[i]) };
        let k1 = rate(x);
        let k2 = rate(add(k1, 0.5 * h));
        let k3 = rate(add(k2, 0.5 * h));
        let k4 = rate(add(k3, h));
        x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    x
}

/// Simulates a corner. `None` if it takes too long.
fn in_corner(sheet: &JointSheet, rule: &JointRule, corner: usize) -> Option<Rest> {
    simulated(sheet, rule, &with_parameters(&sheet.joint, corner, sheet.uncertain))
}

/// Returns true if a joint ended at rest at its target with the base gains.
fn rests(sheet: &JointSheet, end: &Rest) -> bool {
    let fine = end.step_share < 0.01
        && end.error_rad < 4.0 * sheet.steps_rad[0] + sheet.steps_rad[1] + 2e-4
        && end.level < 0.1;
    if !fine {
        println!("{end:?} of {sheet:?}");
    }
    fine
}

/// Returns true if the metrics of a rule meet its constraints.
fn within_limits(sheet: &JointSheet, rule: &JointRule) -> bool {
    let fast = rule.fast.is_none_or(|fast| {
        fast.peak <= FAST_PEAK
            && fast.radius < STABLE
            && fast.dip_ratio < 1.0
            && fast.calm_steps.iter().all(|&c| c >= 1.0)
    });
    rule.noise_share <= sheet.noise_share
        && rule.peak <= sheet.peak
        && rule.corner_peak <= CORNER_PEAK
        && rule.radius < STABLE
        && rule.surface_rad_s > 0.0
        && rule.reaching_per_s >= rule.surface_rad_s
        && fast
}

/// Runs `work` on every item, on two threads.
fn on_two_threads<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (first, second) = items.split_at(items.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| second.iter().map(&work).collect::<Vec<_>>());
        let mut all: Vec<R> = first.iter().map(&work).collect();
        all.extend(other.join().expect("the other half"));
        all
    })
}

#[test]
fn every_data_sheet_has_gains_or_a_first_remedy_that_helps() {
    let all: Vec<(usize, f64)> = (0..ROWS.len()).flat_map(|k| [(k, 2.4), (k, 1.7)]).collect();
    // Both peaks for the first three sheets, then for every other one.
    let all: Vec<_> = all.into_iter().filter(|&(k, peak)| k < 3 || (k % 2 == 0) == (peak == 2.4)).collect();
    let refused = on_two_threads(&all, |&(number, peak)| {
        let (row, sheet) = (&ROWS[number], ROWS[number].sheet(peak));
        let start = std::time::Instant::now();
        let found = joint_rule(&sheet);
        let took = start.elapsed().as_secs_f64();
        match &found {
            Ok(rule) => {
                println!("{} {peak}, {took:.2} s: {rule:?}", row.0);
                assert!(within_limits(&sheet, rule), "{}: {rule:?}", row.0);
            }
            Err(why) => {
                println!("{} {peak}, {took:.2} s: {why}", row.0);
                // A joint that is driven as a motor has no changed sheet.
                if let Some(changed) = why.remedies[0].applied(&sheet) {
                    let rule = joint_rule(&changed).expect("the first remedy helps");
                    assert!(within_limits(&changed, &rule), "{}: {rule:?}", row.0);
                } else {
                    assert_eq!(row.0, "near the period");
                }
            }
        }
        found.is_err()
    });
    let refusals = refused.iter().filter(|&&refused| refused).count();
    assert!((1..=4).contains(&refusals), "{refusals} of {} refused", all.len());
    assert!(!refused[..6].contains(&true), "the paper's joint or one of its neighbours");
}

#[test]
fn joints_in_corners_come_to_rest() {
    let all = on_two_threads(&[0, 1, 2, 3, 9, 10, 11], |&number| {
        let sheet = ROWS[number].sheet(if number % 2 == 0 { 2.4 } else { 1.7 });
        let rule = joint_rule(&sheet).expect("gains");
        // Bits: weight, K_t, K, J_m, J_l.
        [0b00000, 0b00011, 0b00100, 0b01100, 0b10010, 0b11011, 0b11101, 0b11111].map(|corner| {
            let end = in_corner(&sheet, &rule, corner).expect("a short simulation");
            assert!(rests(&sheet, &end), "{} in {corner:05b}: {rule:?}", ROWS[number].0);
            end.loaded_level
        })
    });
    let most = all.iter().flatten().fold(0.0, |most: f64, &level| most.max(level));
    assert!(most > 0.5, "no load switches the high gains on: {most}");
}

/// A soft spring with a fast regulator: stable when linear, with a limit cycle between the limits after one load.
#[test]
fn a_load_that_takes_u_to_its_limit_leaves_no_swinging() {
    let joint = Joint {
        link_inertia_kg_m2: 1.1076,
        link_damping_n_m_s: 4.19e-3,
        weight_n_m: 0.0,
        stiffness_n_m: 86.0,
        motor_inertia_kg_m2: 0.434,
        motor_damping_n_m_s: 1.309,
        torque_n_m_per_a: 0.661,
    };
    let sheet = JointSheet {
        joint,
        steps_rad: [7.49e-7, 3.19e-7],
        period_s: 3.517e-4,
        lag_s: 1.7e-5,
        delay_ticks: 0,
        most_a: 29.24,
        uncertain: 0.1,
        peak: 2.4,
        noise_share: 1e-3,
    };
    let rule = joint_rule(&sheet).expect("gains");
    let end = in_corner(&sheet, &rule, 0b10101).expect("a short simulation");
    assert!(rests(&sheet, &end), "{rule:?}");
}

/// `DEEP=1` for 3000 of them, `DEEP=n` for n.
#[test]
fn random_data_sheets_have_gains_that_hold_or_are_refused() {
    let count = std::env::var("DEEP").map_or(30, |deep| deep.parse().map_or(3000, |n| if n == 1 { 3000 } else { n }));
    let mut draw = Draw(1);
    let sheets: Vec<(usize, JointSheet)> = (0..count).map(|k| (k, draw.sheet())).collect();
    let verdicts = on_two_threads(&sheets, |(number, sheet)| {
        let Some(mut search) = Search::of(sheet) else { return "failure" };
        let Some(rule) = search.best() else {
            // They take longest, so only a few are tested.
            if count < 100 && *number >= 12 {
                return "refusal";
            }
            let remedies = remedies(sheet);
            let Some(changed) = remedies[0].applied(sheet) else {
                println!("{number}: {remedies:?} for {sheet:?}");
                return "behind_gear";
            };
            if Search::of(&changed).and_then(|mut search| search.best()).is_none() {
                println!("{number}: {:?} does not help {sheet:?}", remedies[0]);
                return "failure";
            }
            return "refusal";
        };
        let rested = in_corner(sheet, &rule, (7 * number) % 32).map(|end| rests(sheet, &end));
        let fine = within_limits(sheet, &rule) && rested != Some(false);
        if !fine {
            println!("{number}: {rule:?} of {sheet:?}");
        }
        match (fine, rested) {
            (true, Some(_)) => "design",
            (true, None) => "too slow to simulate",
            _ => "failure",
        }
    });
    let count = |verdict: &str| verdicts.iter().filter(|&&one| one == verdict).count();
    let [designs, slow, refusals, behind, failures] =
        ["design", "too slow to simulate", "refusal", "behind_gear", "failure"].map(count);
    println!(
        "{designs} rest, {slow} not simulated, {refusals} refusals, {behind} with behind_gear only, {failures} failures"
    );
    assert_eq!(failures, 0);
    assert!(4 * (designs + slow) > 3 * sheets.len() && 2 * designs > sheets.len(), "{designs} + {slow} designs");
}

/// Another thread takes the gains as text, and must design the same drive to the bit.
#[test]
fn gains_as_text_keep_their_bits() {
    let rules = on_two_threads(&ROWS[..3], |row| joint_rule(&row.sheet(2.4)).expect("gains"));
    let single = rules.iter().map(|rule| JointRule { fast: None, ..*rule });
    for rule in rules.iter().copied().chain(single) {
        assert_eq!(JointRule::from_text(&rule.to_text()), Some(rule));
    }
    for wrong in ["", "1.0", &format!("{} 1.0", rules[0].to_text()), &rules[0].to_text().replacen('.', "x", 1)] {
        assert_eq!(JointRule::from_text(wrong), None, "{wrong}");
    }
}
