//! Gain sets of a drive, each analysed as if it were active all the time, and the price of another margin.
//!
//! The high gains are scheduled in under a load disturbance and fade out after it, so the loop lies between both sets.
//! A sensitivity peak Ms guarantees a phase margin of 2 asin(1/(2 Ms)) and a gain factor up to Ms/(Ms - 1).

use controller_core::drive::{MotorDesign, MotorMargin};
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows};
use scenario::{AtRest, Corner};
use serde::Serialize;

use crate::design::motor_by_rule;
use crate::margins::{Loop, Margins, MarginsError, noise_of};

/// Gain set of a drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GainSet {
    /// Name of the gain set, `base` or `high`.
    pub name: &'static str,
    /// Margins with the data sheet; `None` if the loop is unstable.
    pub margins: Option<Margins>,
    /// Corner of the data sheet with the largest peak of |S|; `None` without corners.
    pub worst: Option<WorstCorner>,
}

/// Corner and its sensitivity peak.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstCorner {
    /// Deviations of the corner.
    pub name: String,
    /// Largest |S|; `None` if the loop is unstable.
    pub sensitivity_peak: Option<f64>,
}

/// Margin setting of the motor rule, and its metrics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MarginPrice {
    /// Value of `drive.margin`; `None` for the design of the file.
    pub margin: Option<&'static str>,
    /// Gain sets of the design.
    pub sets: Vec<GainSet>,
    /// Rms of u from quantisation and noise of the encoder, A.
    pub noise_a: Option<f64>,
    /// Deflection under a sudden load of 10 % of the largest torque with the last gain set, rad; `None` for a speed
    /// loop.
    pub deflection_rad: Option<f64>,
}

/// Returns the gain sets of a drive, each in the loop at rest and in the corners of the file.
///
/// # Errors
/// A loop has no finite matrices.
pub fn gain_sets(designed: &DriveDesign, at_rest: &AtRest) -> Result<Vec<GainSet>, MarginsError> {
    let frozen = [("base", Some(*designed)), ("high", fast(designed))];
    let set = |(name, designed): (&'static str, Option<DriveDesign>)| {
        let designed = designed?;
        let law = designed.at_rest().ok()?.law;
        let period_s = designed.period_s();
        let margins = |plant| -> Result<Option<Margins>, MarginsError> {
            let it = Loop::with(at_rest, plant, law.as_ref(), period_s)?;
            if it.spectral_radius(1.0)? < 1.0 { it.margins().map(Some) } else { Ok(None) }
        };
        let corners = at_rest.corners.iter().map(|Corner { name, plant }| {
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

/// Returns the drive whose base gains are the high gains of this one; `None` for one gain set.
pub(crate) fn fast(designed: &DriveDesign) -> Option<DriveDesign> {
    let mut fast = *designed;
    let mut w = fast.bandwidths();
    for (observer_rad_s, ratio) in w.observers_rad_s.iter_mut().zip(fast.fast_ratios()) {
        *observer_rad_s *= *ratio;
    }
    fast.set_bandwidths(&w);
    (designed.form().gain_sets > 1).then_some(fast)
}

/// Returns the design of the file with its known gain sets, and the designs of both rules without the rule of the file.
/// A joint has none.
///
/// # Errors
/// A loop has no finite matrices.
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
