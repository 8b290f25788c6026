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

#[test]
fn every_data_sheet_has_gains_or_a_remedy() {
    for row in &ROWS {
        for peak in [2.4, 1.7] {
            let start = std::time::Instant::now();
            let found = joint_rule(&row.sheet(peak));
            println!("{} {peak} {:.3} s: {found:#?}", row.0, start.elapsed().as_secs_f64());
            assert!(found.is_ok());
        }
    }
}
