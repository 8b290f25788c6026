//! Our drive as one of those that are compared: its bandwidths are what may be chosen.

use loop_sim::port::ControllerPort;
use loop_sim::port::drive::{Bandwidths, DriveDesign};
use loop_sim::port::finer::Finer;

use super::linear::Linear;
use super::task::Task;
use super::{Contender, Design, Knob};
use crate::kind::{Kind, knob, observer_limit};

/// The drive of the file with one gain set, or two.
pub(super) struct Ours {
    pub(super) designed: DriveDesign,
    pub(super) gain_sets: usize,
}

impl Ours {
    /// The drive with these knobs: the surface, each observer over what is slower than it, k_l over the surface, and
    /// how many times as fast the observers of the fast gain set are.
    pub(super) fn designed(&self, knobs: &[f64]) -> Option<DriveDesign> {
        let mut designed = self.designed;
        designed.form_mut().gain_sets = self.gain_sets;
        let (observers, fast) = (designed.encoders().len(), designed.fast_ratios().len());
        let &[surface_rad_s, ref ratios @ ..] = knobs else { return None };
        if ![observers + 1, observers + 1 + fast].contains(&ratios.len()) {
            return None;
        }
        let (own, most_reaching) = Kind::of(&designed).most;
        // Of a rigid shaft's two poles it is the faster one.
        let least_reaching = if designed.is_whole() { surface_rad_s } else { 0.0 };
        let (t, fastest) = (designed.period_s(), observer_limit(&designed));
        let mut slower_rad_s = surface_rad_s;
        let observer_rad_s = |(ratio, own): (&f64, &Option<f64>)| {
            slower_rad_s = (ratio * slower_rad_s).min(own.unwrap_or(fastest) / t);
            slower_rad_s
        };
        let bandwidths = Bandwidths {
            surface_rad_s,
            observers_rad_s: ratios.iter().zip(own).map(observer_rad_s).collect(),
            reaching_per_s: (ratios[observers] * surface_rad_s).min(most_reaching / t).max(least_reaching),
            offset_per_s: 0.0,
        }
        .with_offset();
        let load_n_m = designed.limits().max * designed.torque_n_m_per_a();
        // The gates are for them too.
        for (k, ratio) in designed.fast_ratios().iter_mut().enumerate() {
            *ratio = ratios.get(observers + 1 + k).copied().unwrap_or(1.0);
        }
        Some(designed.redesigned(&bandwidths, load_n_m))
    }
}

impl Contender for Ours {
    fn name(&self) -> &'static str {
        if self.gain_sets > 1 { "ours, two gain sets" } else { "ours, one gain set" }
    }

    /// Ratios, within what the design allows; of a joint as a whole about the rule's numbers, as far from them as those
    /// of a rival.
    fn knobs(&self) -> Vec<Knob> {
        let w = self.designed.bandwidths();
        let (slow, fastest) = (w.surface_rad_s, 0.5 / self.designed.period_s());
        // Beyond a half of the rate no design is taken: a drive near that is slowed down only.
        let high = if 2.0 * slow > fastest { fastest } else { 8.0 * slow };
        let surface = Knob { name: "surface (rad/s)", low: slow / 8.0, high, guess: slow };
        let [own, fast] = Kind::of(&self.designed).knobs;
        let fast = if self.gain_sets > 1 { fast } else { &[] };
        // The present ratios, each observer over what is slower than it.
        let slower = [slow].into_iter().chain(w.observers_rad_s.iter().copied());
        let present = w.observers_rad_s.iter().zip(slower).map(|(own, slower)| own / slower);
        let present: Vec<f64> = present.chain([w.reaching_per_s / slow]).collect();
        let mut own: Vec<Knob> = own.iter().map(knob).collect();
        let mut fast: Vec<Knob> = fast.iter().map(knob).collect();
        let is_whole = self.designed.is_whole();
        for (knob, present) in own.iter_mut().zip(present) {
            if is_whole {
                (knob.low, knob.high) = (present / 8.0, present * 8.0);
            }
            knob.low = if present < knob.low { 0.5 * present } else { knob.low };
            knob.guess = present.min(knob.high);
        }
        if is_whole && self.designed.form().gain_sets > 1 {
            let mut designed = self.designed;
            for (knob, present) in fast.iter_mut().zip(designed.fast_ratios()) {
                knob.guess = present.clamp(knob.low, knob.high);
            }
        }
        [surface].into_iter().chain(own).chain(fast).collect()
    }

    fn design(&self, knobs: &[f64]) -> Option<Box<dyn Design>> {
        Some(Box::new(Chosen::new(&self.designed(knobs)?)?))
    }
}

/// Our drive with its knobs set.
pub(super) struct Chosen {
    designed: DriveDesign,
    quiet: Linear,
}

impl Chosen {
    /// None for a design that is refused.
    pub(super) fn new(designed: &DriveDesign) -> Option<Self> {
        Some(Self { quiet: Linear::of_ours(designed)?, designed: *designed })
    }
}

impl Design for Chosen {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        let designed = if task.is_fine { Finer::of(&self.designed)?.designed } else { self.designed };
        designed.port(&task.motion).ok()
    }

    /// The quiet set for any error up to 50 %; the fast one, frozen, up to the 20 % for which there are two.
    fn linear(&self) -> Vec<(Linear, f64)> {
        let quiet = (self.quiet.clone(), 0.5);
        if self.designed.form().gain_sets < 2 {
            return vec![quiet];
        }
        let mut fast = self.designed;
        let mut bandwidths = fast.bandwidths();
        for (bandwidth, ratio) in bandwidths.observers_rad_s.iter_mut().zip(fast.fast_ratios()) {
            *bandwidth *= *ratio;
        }
        fast.set_bandwidths(&bandwidths);
        // A set beyond what a design of its own may be is not left out: it counts as that which may.
        vec![quiet].into_iter().chain(Linear::of_ours(&fast).map(|fast| (fast, 0.2))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Bench;
    use super::*;

    /// The template with a spring so stiff that it is designed as a whole.
    fn stiff() -> DriveDesign {
        let sets = ["joint.stiffness_n_m=300".to_owned()];
        Bench::new("joint.toml", scenario::JOINT, &sets).expect("a joint").designed
    }

    /// A search begins with what the rule says, however it has shaped it, goes as far to either side as with a rival,
    /// and none of its ends leaves what a design may be.
    #[test]
    fn the_guess_of_a_joint_as_a_whole_is_the_drive_by_rule() {
        let designed = stiff();
        assert!(designed.is_whole());
        for gain_sets in [1, 2] {
            let ours = Ours { designed, gain_sets };
            let knobs = ours.knobs();
            for Knob { name, low, high, guess } in &knobs[..4] {
                let spans = [guess / low, high / guess].map(|span| (span / 8.0 - 1.0).abs());
                assert!(spans.iter().all(|off| *off < 1e-12), "{name}: {low} to {high} about {guess}");
            }
            let of = |of: fn(&Knob) -> f64| ours.designed(&knobs.iter().map(of).collect::<Vec<_>>()).expect("a drive");
            let (guessed, by_rule) = (of(|knob| knob.guess).bandwidths(), designed.bandwidths());
            let rates = |w: &Bandwidths| [&[w.surface_rad_s, w.reaching_per_s], &w.observers_rad_s[..]].concat();
            for (guessed, by_rule) in rates(&guessed).iter().zip(rates(&by_rule)) {
                assert!((guessed / by_rule - 1.0).abs() < 1e-12, "{guessed} of {by_rule}");
            }
            if gain_sets == designed.form().gain_sets {
                assert_eq!(of(|knob| knob.guess).fast_ratios(), { designed }.fast_ratios());
            }
            for end in [of(|knob| knob.low), of(|knob| knob.high)] {
                assert!(Linear::of_ours(&end).is_some(), "{:?}", end.bandwidths());
            }
        }
    }
}
