//! edo-smc as a contender: its bandwidths are the tuning parameters.

use loop_sim::port::ControllerPort;
use loop_sim::port::drive::{Bandwidths, DriveDesign};
use loop_sim::port::finer::Finer;

use super::linear::Linear;
use super::task::Task;
use super::{Contender, Design, Knob};
use crate::kind::{DriveKind, knob, observer_limit};

/// Drive of the file with one gain set or two.
pub(super) struct Ours {
    pub(super) designed: DriveDesign,
    pub(super) gain_sets: usize,
}

impl Ours {
    /// Returns the drive with these parameters: the surface bandwidth, the ratio of each observer to the next slower
    /// bandwidth, the ratio of k_l to the surface, and the ratios of the high gains.
    pub(super) fn designed(&self, knobs: &[f64]) -> Option<DriveDesign> {
        let mut designed = self.designed;
        designed.form_mut().gain_sets = self.gain_sets;
        let (observers, fast) = (designed.encoders().len(), designed.fast_ratios().len());
        let &[surface_rad_s, ref ratios @ ..] = knobs else { return None };
        if ![observers + 1, observers + 1 + fast].contains(&ratios.len()) {
            return None;
        }
        let (own, most_reaching) = DriveKind::of(&designed).most;
        // k_l is the faster one of the two poles of a rigid shaft.
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
        // The innovation gates also use the high gains.
        for (k, ratio) in designed.fast_ratios().iter_mut().enumerate() {
            *ratio = ratios.get(observers + 1 + k).copied().unwrap_or(1.0);
        }
        Some(designed.redesigned(&bandwidths, load_n_m))
    }
}

impl Contender for Ours {
    fn name(&self) -> &'static str {
        if self.gain_sets > 1 { "edo-smc, two gain sets" } else { "edo-smc, one gain set" }
    }

    /// Returns ratios within the limits of a design. For a coupled joint they surround the numbers of the rule with the
    /// range of a baseline controller.
    fn knobs(&self) -> Vec<Knob> {
        let w = self.designed.bandwidths();
        let (slow, fastest) = (w.surface_rad_s, 0.5 / self.designed.period_s());
        // A design is limited to half of the rate: a drive near this limit can only become slower.
        let high = if 2.0 * slow > fastest { fastest } else { 8.0 * slow };
        let surface = Knob { name: "surface (rad/s)", low: slow / 8.0, high, guess: slow };
        let [own, fast] = DriveKind::of(&self.designed).knobs;
        let fast = if self.gain_sets > 1 { fast } else { &[] };
        // Present ratios of each observer to the next slower bandwidth.
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

/// edo-smc drive with fixed parameters.
pub(super) struct Chosen {
    designed: DriveDesign,
    quiet: Linear,
}

impl Chosen {
    /// Builds the design; `None` for an invalid drive.
    pub(super) fn new(designed: &DriveDesign) -> Option<Self> {
        Some(Self { quiet: Linear::of_ours(designed)?, designed: *designed })
    }
}

impl Design for Chosen {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        let designed = if task.is_fine { Finer::of(&self.designed)?.designed } else { self.designed };
        designed.port(&task.motion).ok()
    }

    /// Base gains for errors up to 50 %; frozen high gains for errors up to 20 %.
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
        // A gain set beyond the limits of a stand-alone design counts as stable.
        vec![quiet].into_iter().chain(Linear::of_ours(&fast).map(|fast| (fast, 0.2))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Bench;
    use super::*;

    /// Template with a spring stiff enough for a coupled design.
    fn stiff() -> DriveDesign {
        let sets = ["joint.stiffness_n_m=300".to_owned()];
        Bench::new("joint.toml", scenario::JOINT, &sets).expect("a joint").designed
    }

    /// A search starts at the numbers of the rule, has the range of a baseline controller to either side, and stays
    /// within the limits of a design.
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
