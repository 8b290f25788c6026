//! Gain sets of a drive, each analysed as if it were active all the time, and the price of another margin.
//!
//! The high gains are scheduled in under a load disturbance and fade out after it, so the loop lies between both sets.
//! A sensitivity peak Ms guarantees a phase margin of 2 asin(1/(2 Ms)) and a gain factor up to Ms/(Ms - 1).

use controller_core::drive::{MotorDesign, MotorMargin};
use loop_sim::linear::LawAtRest;
use loop_sim::plant::Plant;
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
    /// Largest angle error under a load step of 10 % of the largest torque on the shaft, for a joint on the link, rad.
    /// `None` for a speed loop, and if the loop is unstable.
    pub deflection_rad: Option<f64>,
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
}

/// Load of [`GainSet::deflection_rad`] as a share of the largest torque.
const LOAD: f64 = 0.1;

/// Returns the gain sets of a drive, each in the loop at rest and in the corners of the file.
///
/// # Errors
/// A loop has no finite matrices.
pub fn gain_sets(designed: &DriveDesign, at_rest: &AtRest) -> Result<Vec<GainSet>, MarginsError> {
    let frozen = [("base", Some(*designed)), ("high", fast(designed))];
    let set = |(name, designed): (&'static str, Option<DriveDesign>)| {
        let designed = designed?;
        let law = designed.at_rest().ok()?.law;
        Some(gain_set(name, &designed, law.as_ref(), at_rest))
    };
    frozen.into_iter().filter_map(set).collect()
}

fn gain_set(
    name: &'static str,
    designed: &DriveDesign,
    law: &dyn LawAtRest,
    at_rest: &AtRest,
) -> Result<GainSet, MarginsError> {
    let stable = |plant: &dyn Plant| -> Result<Option<Loop>, MarginsError> {
        let it = Loop::with(at_rest, plant, law, designed.period_s())?;
        Ok((it.spectral_radius(1.0)? < 1.0).then_some(it))
    };
    let corner = |Corner { name, plant }: &Corner| -> Result<WorstCorner, MarginsError> {
        let margins = stable(plant.as_ref())?.map(|it| it.margins()).transpose()?;
        Ok(WorstCorner { name: name.clone(), sensitivity_peak: margins.map(|margins| margins.sensitivity_peak) })
    };
    let corners = at_rest.corners.iter().map(corner).collect::<Result<Vec<_>, _>>()?;
    let size = |corner: &WorstCorner| corner.sensitivity_peak.unwrap_or(f64::INFINITY);
    let worst = corners.into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));

    let nominal = stable(at_rest.plant.as_ref())?;
    let has_position = designed.form().follows == Follows::Position;
    let pushed = nominal.as_ref().filter(|_| has_position).map(|it| it.deflection(at_rest, law)).transpose()?;
    let load_n_m = LOAD * designed.limits().max * designed.torque_n_m_per_a();
    let load_rad_s2 = load_n_m / at_rest.loaded_inertia_kg_m2.unwrap_or(f64::NAN);
    Ok(GainSet {
        name,
        margins: nominal.map(|it| it.margins()).transpose()?,
        deflection_rad: pushed.map(|rad| load_rad_s2 * rad),
        worst,
    })
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
    let Ok(law) = designed.at_rest() else { return Ok(MarginPrice { margin, sets, noise_a: None }) };
    let it = Loop::of(at_rest, law.law.as_ref(), designed.period_s())?;
    let noise_a = if it.spectral_radius(1.0)? < 1.0 { Some(noise_of(&it.noise_gains(), at_rest)) } else { None };
    Ok(MarginPrice { margin, sets, noise_a })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use scenario::Source;

    use super::*;

    /// A step of 10 % of the largest torque, in the linear loop and in a run, also of a plant off its data sheet.
    #[test]
    fn a_load_moves_the_shaft_as_far_as_in_a_run() {
        let common = ["friction={}", "fault=[]", "reference={kind = \"rest\"}", "drive.gain_sets=1", "span_s=2"];
        let motor = ["drive.rest_band=\"off\"", "load=[{kind = \"step\", amplitude = 0.05, t0_s = 0.1}]"];
        let joint = ["load=[{kind = \"step\", amplitude = 0.357, t0_s = 0.1}]"];
        let off = ["error={}", "error={inertia_percent = 50}", "error={inertia_percent = -20, torque_percent = 20}"];
        let joint_off = ["error={}", "error={link_inertia_percent = 50}", "error={stiffness_percent = -20}"];
        let cases = off.iter().map(|error| (scenario::MOTOR, &motor[..], error));
        let cases = cases.chain(joint_off.iter().map(|error| (scenario::JOINT, &joint[..], error)));
        for (text, own, error) in cases {
            let sets: Vec<String> = common.iter().chain(own).chain([error]).map(ToString::to_string).collect();
            let source = Source { file: "test.toml", text, sets: &sets };
            let mut experiment = scenario::parse(&source, "test").expect("a scenario");
            let (trace, ended) = experiment.run(&mut |_| ControlFlow::Continue(()));
            assert!(ended.is_none());
            let ran = trace.rows.iter().map(|row| row.x[0].abs()).fold(0.0, f64::max);
            let designed = experiment.drive.as_ref().expect("a drive").designed;
            let sets = gain_sets(&designed, experiment.at_rest.as_ref().expect("a loop")).expect("margins");
            let linear = sets[0].deflection_rad.expect("a position loop");
            println!("{error}: {linear:.3e} rad, in a run {ran:.3e} rad");
            assert!((linear / ran - 1.0).abs() < 0.03, "{error}: {linear} {ran}");
        }
    }
}
