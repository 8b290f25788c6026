//! The rule on data sheets that nobody tuned for.

use super::*;

/// N, J_m, K_t, B_m of the motor's own shaft; J_l, K, B_l, weight behind the gear; lag, limit, bits, period.
struct Row(&'static str, f64, [f64; 3], [f64; 4], f64, f64, [u32; 2], f64, usize);

const ROWS: [Row; 3] = [
    Row("jt", 1.0, [931e-6, 0.119, 0.07], [0.23, 9.0, 0.07, 0.23], 2e-4, 30.0, [20, 20], 1e-3, 0),
    Row("ja", 100.0, [1.2e-4, 0.08, 2e-4], [0.4, 8000.0, 0.5, 10.0], 2e-4, 8.0, [19, 14], 1e-3, 0),
    Row("jc", 1.0, [0.01, 1.2, 0.01], [0.08, 3000.0, 0.05, 0.0], 1e-4, 20.0, [20, 20], 2.5e-4, 0),
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
            steps_rad: [
                std::f64::consts::TAU / f64::from(1_u32 << bits[0]),
                std::f64::consts::TAU / f64::from(1_u32 << bits[1]) / gear,
            ],
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

/// Numbers from 0 to 1 by a linear congruence.
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

    /// A joint whose motor turns at up to 2 rad/s with 10 to 3000 rad/s² in reach.
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
        let step = |bits: u32| std::f64::consts::TAU / f64::from(1_u32 << bits);
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

#[test]
fn random_data_sheets() {
    let count = std::env::var("DEEP").map_or(60, |n| n.parse().unwrap());
    let mut draw = Draw(1);
    let (mut designs, mut refused, mut fast) = (0, 0, 0);
    for number in 0..count {
        let sheet = draw.sheet();
        let start = std::time::Instant::now();
        let found = joint_rule(&sheet);
        let took = start.elapsed().as_secs_f64();
        let r = JointRatios::of(&sheet.joint, sheet.lag_s);
        let wt = (r.k1 + r.k2).sqrt() * sheet.period_s;
        let head = format!(
            "{number} J {:.2} wrT {wt:.3} T {:.0}us lag {:.2} d{} bits {:?} w {:.2} p {} peak {} {took:.2}s",
            sheet.joint.link_inertia_kg_m2 / sheet.joint.motor_inertia_kg_m2,
            sheet.period_s * 1e6,
            sheet.lag_s / sheet.period_s,
            sheet.delay_ticks,
            sheet.steps_rad.map(|s| (std::f64::consts::TAU / s).log2().round()),
            sheet.joint.weight_n_m / sheet.joint.torque_n_m_per_a / sheet.most_a,
            sheet.uncertain,
            sheet.peak
        );
        match found {
            Ok(rule) => {
                designs += 1;
                fast += usize::from(rule.fast.is_some());
                println!(
                    "{head} OK wc {:.1} Wl T {:.4} by {:?} noise {:.2} fast {:?} dip*J {:.2e}",
                    rule.surface_rad_s,
                    rule.link_rad_s * sheet.period_s,
                    rule.binding,
                    rule.noise_share * 1e3,
                    rule.fast.map(|f| f.dip_ratio),
                    rule.dips_rad_per_n_m[0]
                );
            }
            Err(why) => {
                refused += 1;
                println!("{head} REFUSED {why}");
            }
        }
    }
    println!("{designs} designs ({fast} with a fast set), {refused} refusals");
}

#[test]
fn every_data_sheet_has_gains_or_a_remedy() {
    for row in &ROWS {
        for peak in [2.4, 1.7] {
            let start = std::time::Instant::now();
            let found = joint_rule(&row.sheet(peak));
            println!("{} {peak} {:.3} s: {found:#?}", row.0, start.elapsed().as_secs_f64());
        }
    }
}
