//! Traces of the planned moves of a drive: the sine, the polynomial of a transition, and its coefficients.
//!
//! Sine and polynomial are part of every tick, in the precision of the law. The coefficients are computed once per
//! plan, in f64. The choice of the half of a transition, and the check of its end, contain no operation on numbers.

use controller_core::drive::{jet_of_profile, jet_of_sine, jet_of_way, powers_of_join};
use controller_core::{Real, Sealed};

use crate::drive::JET;
use crate::record::{Record, Role};
use crate::recorder::{Recorder, Symbol, record};

/// A plan for r and its derivatives, `M` values in all.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanFunctions {
    /// `phase` (2^-32 revolutions), `amplitude`, `omega` -> trajectory point.
    pub sine: Record,
    /// `ticks` done or left, `per_tick`, `rate`, the `rest` of its position in 2^-32 revolutions, the lead `early` in
    /// 2^-32 ticks and in s (`instant_s`), `power_0`.. and the trajectory point of the goal, `goal_r`.. -> trajectory
    /// point.
    pub join: Record,
    /// `moved_0`.. (integer part and rest of the last M - 1 ticks), `behind_0`, `behind_1`, `rest`, `part_rad`, `per_s`
    /// -> trajectory point of a profile with M - 1 averages.
    pub profile: Record,
    /// `gap_0`.., `tau_s` -> `s_0`.. in powers of the part done, `left_0`.. of the part left. In f64.
    pub powers: Record,
}

/// Records a plan.
pub fn plan<const M: usize>() -> PlanFunctions {
    let number = |recorder: &Recorder, name: &str| recorder.number(name, Role::Argument);
    let put = |recorder: &Recorder, jet: [Symbol; M]| {
        JET.iter().zip(jet).for_each(|(name, number)| recorder.put(name, Role::Output, number));
    };
    PlanFunctions {
        sine: record(|recorder| {
            let phase = recorder.count("phase", Role::Argument);
            put(recorder, jet_of_sine(phase, number(recorder, "amplitude"), number(recorder, "omega")));
        }),
        join: record(|recorder| {
            let [ticks, rest, early] = ["ticks", "rest", "early"].map(|name| recorder.count(name, Role::Argument));
            let [per_tick, rate, instant_s] = ["per_tick", "rate", "instant_s"].map(|name| number(recorder, name));
            let powers: Vec<Symbol> = (0..2 * M).map(|k| number(recorder, &format!("power_{k}"))).collect();
            let (s, late_s) = (Symbol::from_count(ticks) * per_tick, Symbol::from_count(early) * instant_s);
            let jet: [Symbol; M] = jet_of_way(s, powers.into_iter(), rate, rest, late_s);
            let goal = |j| number(recorder, &format!("goal_{}", JET[j]));
            put(recorder, core::array::from_fn(|j| goal(j) + jet[j]));
        }),
        profile: record(|recorder| {
            let pair = |name, k| [2 * k, 2 * k + 1].map(|k| recorder.count(&format!("{name}_{k}"), Role::Argument));
            let mut moved = [pair("moved", 0); 3];
            (1..M - 1).for_each(|k| moved[k] = pair("moved", k));
            let behind = pair("behind", 0);
            let rest = recorder.count("rest", Role::Argument);
            let [part_rad, per_s] = ["part_rad", "per_s"].map(|name| number(recorder, name));
            let jet: [Symbol; 4] = jet_of_profile(M - 1, moved, behind, rest, part_rad, per_s);
            put(recorder, core::array::from_fn(|j| jet[j]));
        }),
        powers: record(|recorder| {
            let gap: [Symbol; M] = core::array::from_fn(|j| number(recorder, &format!("gap_{j}")));
            let powers = powers_of_join(gap, number(recorder, "tau_s"));
            for (of, halves) in ["s", "left"].into_iter().zip(powers) {
                for (k, power) in halves.into_iter().flatten().enumerate() {
                    recorder.put(&format!("{of}_{k}"), Role::Output, power);
                }
            }
        }),
    }
}

const _: () = assert!(Symbol::WORDS == 1, "sines are recorded as those of f32");
