//! Coupled design of a joint by rule, from the keys of a file.
//!
//! The rule (module `joint_rule`) searches for at least a tenth of a second. Its results are cached per data sheet, so
//! that a tuning run or a sweep of other keys does not search again. A [`KnownRule`] carries a result to another
//! process.

use std::sync::{Mutex, MutexGuard, PoisonError};

use controller_core::drive::{Coupled, JointBandwidths, JointDesign};
use loop_sim::port::drive::Form;
use serde::{Deserialize, Serialize};

use super::JointDriveTable;
use super::build::high_gains;
use super::joint_rule::{JointRule, JointSheet, Refused, joint_rule};
use super::margin::{MarginKey, MarginRule};
use crate::resolve::Problem;

/// Limit of the current noise from the encoders, rms, as a share of the current limit.
const NOISE_SHARE: f64 = 1e-3;
/// Peak sensitivities of the two margins.
const PEAKS: [f64; 2] = [2.4, 1.7];
/// Deflection under a load of 14 % of the largest torque, rad, above which a warning is issued.
const WEAK_RAD: f64 = 0.05;
/// Number of cached data sheets.
const REMEMBERED: usize = 64;

/// Inputs of the rule besides the data sheet.
#[derive(Clone, Copy, Debug)]
pub struct CoupledBy {
    /// Time constant of the current loop, s.
    pub lag_s: f64,
    /// Standard deviation of the noise of both encoders, rad behind the gear.
    pub noise_rad: [f64; 2],
    /// Ticks from the computation of u until it is applied.
    pub delay_ticks: usize,
    /// Tolerance of the data sheet: 0.2 for 20 %.
    pub uncertain: f64,
    /// Largest nominal peak sensitivity.
    pub peak: f64,
    /// Largest load step, N m.
    pub load_n_m: f64,
}

/// Returns the peak sensitivity of a margin.
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

    /// Returns the coupled design for the joint, encoders, period and limits of `design`, and the result of the rule.
    ///
    /// # Errors
    /// Returns [`Refused`] with remedies if no gains meet all limits.
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

    /// Returns the design with the bandwidths of a rule.
    pub fn with(&self, design: &JointDesign, rule: &JointRule) -> JointDesign {
        let (fast_ratios, calm_steps) = fast_of(rule);
        self.with_bandwidths(&JointDesign { fast_ratios, ..*design }, bandwidths_of(rule), calm_steps)
    }

    /// Returns the design with these bandwidths.
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

/// Returns the ratios of the high gains, and the innovations in counts at which they are scheduled in.
fn fast_of(rule: &JointRule) -> ([f64; 2], [f64; 2]) {
    rule.fast.map_or(([1.0; 2], [1.5; 2]), |fast| (fast.ratios, fast.calm_steps))
}

/// Coupled design of a file, by rule except for the keys that the file sets.
pub(super) struct AsWhole {
    by: CoupledBy,
    /// Result of the rule. `None` if the file sets all bandwidths.
    pub(super) rule: Option<JointRule>,
    /// Bandwidths of the file: w_c, k_l, link, motor.
    given: [Option<f64>; 4],
    fast_ratios: Option<[f64; 2]>,
}

impl AsWhole {
    /// Designs a joint by the keys of a file, for the period of the file.
    ///
    /// # Errors
    /// Returns a problem with remedies if no gains fit the joint.
    pub(super) fn of(by: CoupledBy, drive: &JointDriveTable, bare: &JointDesign) -> Result<Self, Problem> {
        let given = [drive.surface_rad_s, drive.reaching_per_s, drive.link_rad_s, drive.motor_rad_s];
        let fast_ratios = drive.fast_ratios.as_deref().and_then(|ratios| ratios.try_into().ok());
        // The design itself reports invalid numbers.
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

    /// Returns the design for a period, with the bandwidths found for the period of the file.
    pub(super) fn design(&self, bare: &JointDesign) -> JointDesign {
        let w = self.rule.as_ref().map_or(bare.bandwidths, bandwidths_of);
        // Without high gains by rule or file both gain sets are equal.
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

    /// Returns a warning for a valid design whose limits leave almost no bandwidth.
    pub(super) fn weak(&self, torque_n_m: f64) -> Option<String> {
        let rule = self.rule.as_ref()?;
        let dip_rad = rule.dips_rad_per_n_m[0] * 0.14 * torque_n_m;
        (dip_rad > WEAK_RAD).then(|| {
            format!(
                "a load of 14 % of the largest torque moves the link by {dip_rad:.2} rad: the bandwidth is limited by \
                 {} (poles of the rigid shaft {:.2} and {:.2} 1/s); a smaller drive.uncertain_percent, finer encoders \
                 or a stiffer spring help",
                rule.binding, rule.surface_rad_s, rule.reaching_per_s
            )
        })
    }

    /// Returns true if the rule or the file has high gains.
    fn has_fast(&self) -> bool {
        self.fast_ratios.is_some() || self.rule.is_some_and(|rule| rule.fast.is_some())
    }

    /// Returns the form, with two gain sets if the rule or the file has high gains.
    pub(super) fn form(&self, form: Form, asked: Option<usize>) -> Form {
        Form { gain_sets: asked.unwrap_or(if self.has_fast() { form.gain_sets } else { 1 }), ..form }
    }

    /// Returns a warning if two gain sets are set but equal.
    pub(super) fn idle_set(&self, asked: Option<usize>) -> Option<String> {
        (asked == Some(2) && !self.has_fast()).then(|| {
            "drive.gain_sets = 2: the rule finds no high gains that help this joint, so both gain sets are equal; \
             drive.gain_sets = 1 saves cycles, drive.fast_ratios sets the high gains"
                .into()
        })
    }

    /// Returns the bandwidths and their limiting factor, in words, for this number of gain sets.
    pub(super) fn in_words(&self, design: &JointDesign, gain_sets: usize) -> Vec<String> {
        let (w, [link_steps, motor_steps]) = (design.bandwidths, design.gate_steps);
        let mut lines = Vec::new();
        if let Some(rule) = &self.rule {
            let fast = rule.fast.filter(|_| gain_sets > 1).map_or(String::new(), |fast| {
                format!(" (high gains {:.2}, and {:.2} in the corners of the ratios)", fast.peak, fast.corner_peak)
            });
            lines.push(format!(
                "coupled design by rule, limited by {}: peak sensitivity {:.2} nominal, {:.2} in the worst \
                 corner of the rule{fast}; current noise {} % of the current limit",
                rule.binding,
                rule.peak,
                rule.corner_peak,
                percent(rule.noise_share)
            ));
        } else {
            lines.push("coupled design, bandwidths set by the file".into());
        }
        lines.push(format!(
            "poles of the rigid shaft {:.0} and {:.0} 1/s, observer bandwidths {:.0} (link) and {:.0} rad/s (motor){}, \
             innovation gates {link_steps:.0} and {motor_steps:.0} counts",
            w.surface_rad_s,
            w.reaching_per_s,
            w.link_rad_s,
            w.motor_rad_s,
            high_gains(design, gain_sets)
        ));
        lines
    }
}

/// Returns a share in percent; a small one keeps its digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.095 { format!("{percent:.1e}") } else { format!("{percent:.2}") }
}

/// Gains by rule with the data sheet to which they belong, for another process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KnownRule {
    /// Every number of the [`JointSheet`], as text.
    sheet: String,
    rule: String,
}

impl KnownRule {
    /// Returns the gains by rule that were used last. `None` if the rule was not used, or found no gains.
    pub fn last() -> Option<Self> {
        let (sheet, found) = cache().last().cloned()?;
        found.ok().map(|rule| Self { sheet, rule: rule.to_text() })
    }

    /// Adds the gains to the cache. A scenario with their data sheet then needs no search.
    pub fn remember(self) {
        let Some(rule) = JointRule::from_text(&self.rule) else { return };
        let mut all = cache();
        all.retain(|(sheet, _)| *sheet != self.sheet);
        add(&mut all, self.sheet, Ok(rule));
    }
}

/// Results of the rule by data sheet, the last used one at the end.
type Cache = Vec<(String, Result<JointRule, Refused>)>;

fn cache() -> MutexGuard<'static, Cache> {
    static FOUND: Mutex<Cache> = Mutex::new(Vec::new());
    FOUND.lock().unwrap_or_else(PoisonError::into_inner)
}

fn add(all: &mut Cache, sheet: String, found: Result<JointRule, Refused>) {
    if all.len() == REMEMBERED {
        drop(all.remove(0));
    }
    all.push((sheet, found));
}

/// Returns the result of the rule for a data sheet, from the cache if possible.
fn remembered(sheet: &JointSheet) -> Result<JointRule, Refused> {
    // The text of a number is unique.
    let name = format!("{sheet:?}");
    {
        let mut all = cache();
        if let Some(at) = all.iter().position(|(known, _)| *known == name) {
            let known = all.remove(at);
            all.push(known.clone());
            return known.1;
        }
    }
    let found = joint_rule(sheet);
    add(&mut cache(), name, found.clone());
    found
}
