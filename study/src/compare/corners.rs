//! The plants in which laws are compared: corners of the numbers of the data sheet.

use crate::commission::plants::joint_error;

/// What a corner is called, the table `[error]` that makes it, and whether tuning looks at it.
pub(crate) type Corner = (String, String, bool);

/// What the corners of a joint are off in: nothing else moves it.
pub(crate) static RATIOS: [&str; 5] = ["K/J_l", "B_l/J_l", "K/J_m", "B_m/J_m", "K_t/J_m"];
/// And those of a motor.
pub(crate) static OF_MOTOR: [&str; 2] = ["J", "K_t"];

/// Which of ±p each of `N` numbers is off by.
fn signs<const N: usize>(p: f64) -> impl Iterator<Item = [f64; N]> {
    (0..1_u32 << N).map(move |corner| std::array::from_fn(|i| if corner >> i & 1 == 1 { p } else { -p }))
}

/// `J -20 %, K_t +20 %`: what of these is off.
fn named(names: &[&str], off: &[f64]) -> String {
    let off = names.iter().zip(off).filter(|(_, off)| **off != 0.0);
    off.map(|(name, off)| format!("{name} {:+.0} %", 100.0 * off)).collect::<Vec<_>>().join(", ")
}

/// Each ratio ±p.
pub(crate) fn of_joint(p: f64) -> Vec<Corner> {
    let of = |off: [f64; 5]| {
        let [k_1, b_1, k_2, b_2, _] = off;
        let others_agree = [b_1, k_2, b_2].iter().all(|other| *other == k_1);
        (named(&RATIOS, &off), joint_error(off.map(|off| 1.0 + off)), others_agree)
    };
    signs::<5>(p).map(of).collect()
}

/// Each number ±p or as it is, but for the data sheet itself.
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
