//! Each gain set of a drive by itself, as if it stayed, and what another margin would cost.
//!
//! The fast set comes in while a load pushes and fades after it, so the loop is between the two. A peak Ms of the
//! sensitivity function leaves at least 2 asin(1/(2 Ms)) of phase and bears Ms/(Ms - 1) times the plant's gain.

use controller_core::drive::{MotorDesign, MotorMargin};
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows};
use scenario::{AtRest, Corner};
use serde::Serialize;

use crate::design::motor_by_rule;
use crate::margins::{Loop, Margins, MarginsError, noise_of};

/// One gain set of a drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GainSet {
    /// `quiet` or `fast`.
    pub name: &'static str,
    /// By the data sheet; none of a loop that is not stable.
    pub margins: Option<Margins>,
    /// The corner of the data sheet in which |S| has its largest peak; none without corners.
    pub worst: Option<WorstCorner>,
}

/// A corner and its peak.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstCorner {
    /// What is off, and by how much.
    pub name: String,
    /// Largest |S|; none where the loop is not stable.
    pub sensitivity_peak: Option<f64>,
}

/// A margin that the rule for a motor has, and its figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MarginPrice {
    /// The value of `drive.margin`; none of the file's own numbers.
    pub margin: Option<&'static str>,
    /// Its gain sets.
    pub sets: Vec<GainSet>,
    /// Rms of u by the steps and the noise of the encoder, A.
    pub noise_a: Option<f64>,
    /// Way that a sudden load of 10 % of the largest torque makes with the last of its gain sets, rad; none of a speed
    /// loop.
    pub deflection_rad: Option<f64>,
}

/// The gain sets of this drive, each in the loop at rest and in the corners that the file names.
///
/// # Errors
/// When a loop has no finite matrices.
pub fn gain_sets(designed: &DriveDesign, at_rest: &AtRest) -> Result<Vec<GainSet>, MarginsError> {
    let frozen = [("quiet", Some(*designed)), ("fast", fast(designed))];
    let set = |(name, designed): (&'static str, Option<DriveDesign>)| {
        let designed = designed?;
        let law = designed.at_rest().ok()?.law;
        let period_s = designed.period_s();
        let margins = |plant| -> Result<Option<Margins>, MarginsError> {
            let it = Loop::with(at_rest, plant, law.as_ref(), period_s)?;
            if it.spectral_radius(1.0)? < 1.0 { it.margins().map(Some) } else { Ok(None) }
        };
        // Of a joint as a whole the rule holds it in corners of ratios; in these it would have to stay, and cannot.
        let is_bounded = designed.is_whole() && name == "fast";
        let corners = if is_bounded { &[][..] } else { &at_rest.corners[..] };
        let corners = corners.iter().map(|Corner { name, plant }| {
            let sensitivity_peak = margins(plant.as_ref())?.map(|margins| margins.sensitivity_peak);
            Ok(WorstCorner { name: name.clone(), sensitivity_peak })
        });
        let size = |corner: &WorstCorner| corner.sensitivity_peak.unwrap_or(f64::INFINITY);
        let worst = corners.collect::<Result<Vec<_>, MarginsError>>();
        let worst = worst.map(|all| all.into_iter().max_by(|a, b| size(a).total_cmp(&size(b))));
        Some(worst.and_then(|worst| Ok(GainSet { name, margins: margins(at_rest.plant.as_ref())?, worst })))
    };
    frozen.into_iter().filter_map(set).collect()
}

/// The drive whose quiet set is the fast one of this; none where there is one set.
pub(crate) fn fast(designed: &DriveDesign) -> Option<DriveDesign> {
    let mut fast = *designed;
    let mut w = fast.bandwidths();
    for (observer_rad_s, ratio) in w.observers_rad_s.iter_mut().zip(fast.fast_ratios()) {
        *observer_rad_s *= *ratio;
    }
    fast.set_bandwidths(&w);
    (designed.form().gain_sets > 1).then_some(fast)
}

/// The file's own numbers, whose gain sets are known, and those of both rules, without a rule that is the file's;
/// nothing of a joint.
///
/// # Errors
/// When a loop has no finite matrices.
pub fn prices(
    designed: &DriveDesign,
    sets: &[GainSet],
    lag_s: f64,
    at_rest: &AtRest,
) -> Result<Vec<MarginPrice>, MarginsError> {
    let DriveDesign::Motor(motor) = designed else { return Ok(Vec::new()) };
    let delay_ticks = motor.form.delay_ticks as u32;
    let by_rule = [("standard", MotorMargin::Standard), ("fast", MotorMargin::Fast)]
        .map(|(name, margin)| (name, motor_by_rule(&motor.design, (margin, lag_s, delay_ticks), at_rest)));
    let own = by_rule.iter().find(|(_, design)| is_near(design, &motor.design)).map(|(name, _)| *name);
    let others = by_rule.into_iter().filter(|(name, _)| Some(*name) != own);
    let others = others.map(|(name, design)| {
        let designed = DriveDesign::Motor(DriveOf { design, ..*motor });
        price(Some(name), &designed, gain_sets(&designed, at_rest)?, at_rest)
    });
    [price(own, designed, sets.to_vec(), at_rest)].into_iter().chain(others).collect()
}

fn is_near(rule: &MotorDesign, own: &MotorDesign) -> bool {
    let [a, b] = [rule, own].map(|design| design.bandwidths);
    let pairs = [
        (a.surface_rad_s, b.surface_rad_s),
        (a.observer_rad_s, b.observer_rad_s),
        (a.reaching_per_s, b.reaching_per_s),
    ];
    pairs.iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-3)
}

fn price(
    margin: Option<&'static str>,
    designed: &DriveDesign,
    sets: Vec<GainSet>,
    at_rest: &AtRest,
) -> Result<MarginPrice, MarginsError> {
    let of = |designed: &DriveDesign| -> Result<Option<Loop>, MarginsError> {
        let Ok(law) = designed.at_rest() else { return Ok(None) };
        let it = Loop::of(at_rest, law.law.as_ref(), designed.period_s())?;
        Ok((it.spectral_radius(1.0)? < 1.0).then_some(it))
    };
    let noise_a = of(designed)?.map(|quiet| noise_of(&quiet.noise_gains(), at_rest));
    let pushed =
        if designed.form().follows == Follows::Position { of(&fast(designed).unwrap_or(*designed))? } else { None };
    let load_a = 0.1 * designed.limits().max;
    Ok(MarginPrice { margin, sets, noise_a, deflection_rad: pushed.map(|it| load_a * it.deflection()) })
}
