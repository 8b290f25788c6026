//! Plants of a comparison: corners of the data sheet numbers.

use crate::commission::plants::joint_error;

/// Name of a corner, its table `[error]`, and whether the cost uses it.
pub(crate) type Corner = (String, String, bool);

/// Uncertain ratios of a joint, which determine its motion.
pub(crate) static RATIOS: [&str; 5] = ["K/J_l", "B_l/J_l", "K/J_m", "B_m/J_m", "K_t/J_m"];
/// Uncertain numbers of a motor.
pub(crate) static OF_MOTOR: [&str; 2] = ["J", "K_t"];

/// Returns all sign combinations of ±p for `N` numbers.
fn signs<const N: usize>(p: f64) -> impl Iterator<Item = [f64; N]> {
    (0..1_u32 << N).map(move |corner| std::array::from_fn(|i| if corner >> i & 1 == 1 { p } else { -p }))
}

/// Returns a name such as `J -20 %, K_t +20 %`.
fn named(names: &[&str], off: &[f64]) -> String {
    let off = names.iter().zip(off).filter(|(_, off)| **off != 0.0);
    off.map(|(name, off)| format!("{name} {:+.0} %", 100.0 * off)).collect::<Vec<_>>().join(", ")
}

/// Returns the corners of a joint: each ratio ±p.
pub(crate) fn of_joint(p: f64) -> Vec<Corner> {
    let of = |off: [f64; 5]| {
        let [k_1, b_1, k_2, b_2, _] = off;
        let others_agree = [b_1, k_2, b_2].iter().all(|other| *other == k_1);
        (named(&RATIOS, &off), joint_error(off.map(|off| 1.0 + off)), others_agree)
    };
    signs::<5>(p).map(of).collect()
}

/// Returns the corners of a motor: each number ±p or nominal, without the data sheet itself.
pub(crate) fn of_motor(p: f64) -> Vec<Corner> {
    let of = |inertia: f64, torque: f64| {
        let error = format!("error={{inertia_percent = {}, torque_percent = {}}}", 100.0 * inertia, 100.0 * torque);
        (named(&OF_MOTOR, &[inertia, torque]), error, inertia != 0.0 && torque != 0.0)
    };
    let all = [-p, 0.0, p].into_iter().flat_map(|inertia| [-p, 0.0, p].map(|torque| (inertia, torque)));
    all.filter(|&(inertia, torque)| inertia != 0.0 || torque != 0.0)
        .map(|(inertia, torque)| of(inertia, torque))
        .collect()
}
