//! A joint designed as a whole: from the keys of a file to its design, by rule.
//!
//! The rule (module `joint_rule`) searches for a tenth of a second and more. What it found for a data sheet is
//! remembered, so that a file that is read a second time, in a tune or a sweep of other keys, does not wait for it.

use std::sync::Mutex;

use controller_core::drive::{Coupled, JointBandwidths, JointDesign};
use loop_sim::port::drive::Form;

use super::JointDriveTable;
use super::joint_rule::{JointRule, JointSheet, Refused, joint_rule};
use super::margin::{MarginKey, MarginRule};
use crate::resolve::Problem;

/// Most current noise by the encoders, rms, as a share of the largest current.
const NOISE_SHARE: f64 = 1e-3;
/// Peaks of |S| of the two margins.
const PEAKS: [f64; 2] = [2.4, 1.7];
/// A joint that a load of 14 % of its torque moves by so much is told, rad.
const WEAK_RAD: f64 = 0.05;
/// Sheets that are remembered.
const REMEMBERED: usize = 64;

/// What the rule is told besides the data sheet.
#[derive(Clone, Copy, Debug)]
pub struct CoupledBy {
    /// Time constant of the current loop, s.
    pub lag_s: f64,
    /// Standard deviation of the noise of both encoders, rad behind the gear.
    pub noise_rad: [f64; 2],
    /// Ticks until u is held.
    pub delay_ticks: usize,
    /// Tolerance of the data sheet: 0.2 for 20 %.
    pub uncertain: f64,
    /// Largest peak of |S| by the data sheet.
    pub peak: f64,
    /// The largest load that comes at once, N m.
    pub load_n_m: f64,
}

/// The peak of a margin.
pub(super) const fn peak_of(margin: Option<MarginKey>) -> f64 {
    match margin {
        None | Some(MarginKey::Rule(MarginRule::Fast)) => PEAKS[0],
        Some(MarginKey::Rule(MarginRule::Standard)) => PEAKS[1],
        Some(MarginKey::Peak(peak)) => peak,
    }
}

impl CoupledBy {
    fn resolution_rad(&self, design: &JointDesign) -> [f64; 2] {
        let steps = design.encoders.map(|encoder| encoder.unit_rad());
        std::array::from_fn(|i| (steps[i] * steps[i] + 18.0 * self.noise_rad[i] * self.noise_rad[i]).sqrt())
    }

    /// The design as a whole of what `design` says of joint, encoders, period and limits, and the rule's figures.
    ///
    /// # Errors
    /// What no gains meet, and what would help.
    pub fn by_rule(&self, design: &JointDesign) -> Result<(JointDesign, JointRule), Refused> {
        let sheet = JointSheet {
            joint: design.joint,
            steps_rad: self.resolution_rad(design),
            period_s: design.period_s,
            lag_s: self.lag_s,
            delay_ticks: self.delay_ticks,
            most_a: design.limits.max.max(-design.limits.min),
            uncertain: self.uncertain,
            peak: self.peak,
            noise_share: NOISE_SHARE,
        };
        let rule = remembered(&sheet)?;
        Ok((self.with(design, &rule), rule))
    }

    /// The design with the bandwidths of a rule.
    pub fn with(&self, design: &JointDesign, rule: &JointRule) -> JointDesign {
        let (fast_ratios, calm_steps) = fast_of(rule);
        self.with_bandwidths(&JointDesign { fast_ratios, ..*design }, bandwidths_of(rule), calm_steps)
    }

    /// The design with these bandwidths.
    pub fn with_bandwidths(
        &self,
        design: &JointDesign,
        bandwidths: JointBandwidths,
        calm_steps: [f64; 2],
    ) -> JointDesign {
        let resolution_rad = self.resolution_rad(design);
        let steps = |i: usize| calm_steps[i] * resolution_rad[i] / design.encoders[i].unit_rad();
        let coupled = Coupled { lag_s: self.lag_s, resolution_rad, calm_steps: [steps(0), steps(1)] };
        design.coupled_by(coupled, bandwidths, self.load_n_m)
    }
}

fn bandwidths_of(rule: &JointRule) -> JointBandwidths {
    let JointRule { surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, .. } = *rule;
    JointBandwidths { surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, offset_per_s: 0.5 * surface_rad_s }
}

/// Ratios of the fast gain set, and the steps of innovation at which it comes in.
fn fast_of(rule: &JointRule) -> ([f64; 2], [f64; 2]) {
    rule.fast.map_or(([1.0; 2], [1.5; 2]), |fast| (fast.ratios, fast.calm_steps))
}

/// The design of a file as a whole, by rule and by what the file says instead.
pub(super) struct AsWhole {
    by: CoupledBy,
    /// None where the file has all bandwidths.
    pub(super) rule: Option<JointRule>,
    /// w_c, k_l, link, motor.
    given: [Option<f64>; 4],
    fast_ratios: Option<[f64; 2]>,
}

impl AsWhole {
    /// Of the keys of a file, for a design with its period.
    ///
    /// # Errors
    /// A joint that no gains fit, with what would help.
    pub(super) fn of(by: CoupledBy, drive: &JointDriveTable, bare: &JointDesign) -> Result<Self, Problem> {
        let given = [drive.surface_rad_s, drive.reaching_per_s, drive.link_rad_s, drive.motor_rad_s];
        let fast_ratios = drive.fast_ratios.as_deref().and_then(|ratios| ratios.try_into().ok());
        // What no drive is made of has its own message from the design.
        let slow = 1e-2 / bare.period_s;
        let [surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, offset_per_s] = [slow; 5];
        let any = JointBandwidths { surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, offset_per_s };
        let is_drive = by.with_bandwidths(bare, any, [1.5; 2]).validate(by.delay_ticks).is_ok();
        let rule = if given.iter().all(Option::is_some) || !is_drive {
            None
        } else {
            let found = by.by_rule(bare);
            Some(found.map_err(|refused| Problem { key: "drive.tuning".into(), message: refused.to_string() })?.1)
        };
        Ok(Self { by, rule, given, fast_ratios })
    }

    /// For another period too: with the bandwidths of the file's.
    pub(super) fn design(&self, bare: &JointDesign) -> JointDesign {
        let w = self.rule.as_ref().map_or(bare.bandwidths, bandwidths_of);
        // Without a second set by rule or file it is the first.
        let (by_rule, calm_steps) = self.rule.as_ref().map_or(([1.0; 2], [1.5; 2]), fast_of);
        let [surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s] = self.given;
        let surface = surface_rad_s.unwrap_or(w.surface_rad_s);
        let bandwidths = JointBandwidths {
            surface_rad_s: surface,
            reaching_per_s: reaching_per_s.unwrap_or(w.reaching_per_s),
            link_rad_s: link_rad_s.unwrap_or(w.link_rad_s),
            motor_rad_s: motor_rad_s.unwrap_or(w.motor_rad_s),
            offset_per_s: 0.5 * surface,
        };
        let fast_ratios = self.fast_ratios.unwrap_or(by_rule);
        self.by.with_bandwidths(&JointDesign { fast_ratios, ..*bare }, bandwidths, calm_steps)
    }

    /// What is taken, and is hardly a drive: the limits leave next to no bandwidth.
    pub(super) fn weak(&self, torque_n_m: f64) -> Option<String> {
        let rule = self.rule.as_ref()?;
        let dip_rad = rule.dips_rad_per_n_m[0] * 0.14 * torque_n_m;
        (dip_rad > WEAK_RAD).then(|| {
            format!(
                "a load of 14 % of the torque moves the link by {dip_rad:.2} rad: {} leaves no more bandwidth (poles \
                 of a rigid shaft {:.2} and {:.2} 1/s); a smaller drive.uncertain_percent, finer encoders or a stiffer \
                 spring do",
                rule.binding, rule.surface_rad_s, rule.reaching_per_s
            )
        })
    }

    /// Has rule or file a second gain set?
    fn has_fast(&self) -> bool {
        self.fast_ratios.is_some() || self.rule.is_some_and(|rule| rule.fast.is_some())
    }

    /// Two gain sets where the rule or the file has a second one.
    pub(super) fn form(&self, form: Form, asked: Option<usize>) -> Form {
        Form { gain_sets: asked.unwrap_or(if self.has_fast() { form.gain_sets } else { 1 }), ..form }
    }

    /// A second gain set that is asked for and does nothing.
    pub(super) fn idle_set(&self, asked: Option<usize>) -> Option<String> {
        (asked == Some(2) && !self.has_fast()).then(|| {
            "drive.gain_sets = 2: no second gain set by rule helps this joint, so both are the same; \
             drive.gain_sets = 1 saves its cycles, drive.fast_ratios makes another"
                .into()
        })
    }

    /// Bandwidths and why.
    pub(super) fn in_words(&self, design: &JointDesign) -> Vec<String> {
        let (w, [link_steps, motor_steps]) = (design.bandwidths, design.gate_steps);
        let mut lines = Vec::new();
        if let Some(rule) = &self.rule {
            let fast = rule.fast.map_or(String::new(), |fast| {
                format!(", with the fast set {:.2} and {:.2}", fast.peak, fast.corner_peak)
            });
            lines.push(format!(
                "the joint as a whole, by rule: limited by {}; |S| up to {:.2}, in the worst corner {:.2}{fast}; steps \
                 of the encoders make {:.2} % of the current limit",
                rule.binding,
                rule.peak,
                rule.corner_peak,
                100.0 * rule.noise_share
            ));
        } else {
            lines.push("the joint as a whole, as given".into());
        }
        lines.push(format!(
            "poles of a rigid shaft {:.0} and {:.0} 1/s, observers {:.0} (link) and {:.0} rad/s (motor), gates \
             {link_steps:.0} and {motor_steps:.0} steps",
            w.surface_rad_s, w.reaching_per_s, w.link_rad_s, w.motor_rad_s
        ));
        lines
    }
}

/// What the rule says of a sheet, the last ones without another search.
fn remembered(sheet: &JointSheet) -> Result<JointRule, Refused> {
    static FOUND: Mutex<Vec<(JointSheet, Result<JointRule, Refused>)>> = Mutex::new(Vec::new());
    let lock = || FOUND.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((_, found)) = lock().iter().find(|(known, _)| known == sheet) {
        return found.clone();
    }
    let found = joint_rule(sheet);
    let mut all = lock();
    if all.len() == REMEMBERED {
        drop(all.swap_remove(0));
    }
    all.push((*sheet, found.clone()));
    found
}
