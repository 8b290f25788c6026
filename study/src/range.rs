//! Stability of a loop over a range of motor inertia.
//!
//! Every inertia is checked with the nominal torque constant, and with `drive.uncertain_percent` less and more. The
//! search goes from the design inertia outwards in steps and refines the first unstable step. For an end that is not
//! covered it returns the last stable inertia.

use scenario::{AtRest, Corner, InertiaRange};
use serde::Serialize;

use crate::margins::{Loop, Margins, MarginsError};
use loop_sim::linear::LawAtRest;

/// Steps from the design inertia to an end.
const STEPS: u32 = 12;
/// Halvings of the first unstable step.
const HALVINGS: u32 = 8;

/// Range of inertia, and the part of it that the loop covers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Covered {
    /// Design inertia, kg m²: the geometric mean of the range.
    pub designed_for_kg_m2: f64,
    /// Smallest and largest inertia.
    pub ends: [End; 2],
}

/// End of a range of inertia.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct End {
    /// Inertia at the end, kg m².
    pub inertia_kg_m2: f64,
    /// Last inertia with a stable loop from the design outwards, kg m²; equal to the end if all of it is covered.
    pub stable_to_kg_m2: f64,
    /// Margins at the end with the nominal torque constant; `None` if unstable.
    pub margins: Option<Margins>,
}

impl End {
    /// Returns whether the loop is stable up to this end.
    pub fn is_covered(&self) -> bool {
        self.stable_to_kg_m2 == self.inertia_kg_m2
    }
}

/// Returns the covered range of a scenario; `None` if its file has no range.
pub(crate) fn covered(at_rest: &AtRest, law: &dyn LawAtRest, period_s: f64) -> Result<Option<Covered>, MarginsError> {
    let Some(InertiaRange { ends_kg_m2, designed_for_kg_m2, plants }) = &at_rest.inertia_range else { return Ok(None) };
    let is_stable = |inertia_kg_m2: f64| {
        for Corner { plant, .. } in plants(inertia_kg_m2) {
            if Loop::with(at_rest, plant.as_ref(), law, period_s)?.spectral_radius(1.0)? >= 1.0 {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let end = |inertia_kg_m2: f64| {
        let margins = match plants(inertia_kg_m2).into_iter().next() {
            Some(Corner { plant, .. }) => {
                let it = Loop::with(at_rest, plant.as_ref(), law, period_s)?;
                if it.spectral_radius(1.0)? < 1.0 { Some(it.margins()?) } else { None }
            }
            None => None,
        };
        let stable_to_kg_m2 = stable_to(*designed_for_kg_m2, inertia_kg_m2, is_stable)?;
        Ok(End { inertia_kg_m2, stable_to_kg_m2, margins })
    };
    let [low, high] = *ends_kg_m2;
    Ok(Some(Covered { designed_for_kg_m2: *designed_for_kg_m2, ends: [end(low)?, end(high)?] }))
}

/// Returns the last inertia from the design towards this end before the first unstable one.
fn stable_to<E>(from: f64, to: f64, is_stable: impl Fn(f64) -> Result<bool, E>) -> Result<f64, E> {
    let at = |share: f64| if share >= 1.0 { to } else { from * libm::pow(to / from, share) };
    let mut good = 0.0;
    for step in 1..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        if is_stable(at(share))? {
            good = share;
            continue;
        }
        let mut bad = share;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if is_stable(at(middle))? { good = middle } else { bad = middle }
        }
        return Ok(at(good));
    }
    Ok(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_of_what_is_stable_is_found_to_a_thousandth_of_the_way() {
        let found = |to: f64, edge: f64| {
            let is_stable = |it: f64| Ok::<bool, ()>(if to > 1.0 { it <= edge } else { it >= edge });
            stable_to(1.0, to, is_stable).expect("no error")
        };
        for (to, edge) in [(10.0, 4.0), (10.0, 1.01), (0.1, 0.3), (0.1, 0.9)] {
            let found = found(to, edge);
            assert!((found / edge).ln().abs() < 2e-3 && (to > 1.0) == (found <= edge), "{to} {edge}: {found}");
        }
        assert_eq!((found(10.0, 10.0), found(0.1, 0.01)), (10.0, 0.1));
    }

    fn motor(sets: &[&str]) -> scenario::Experiment {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let source = scenario::Source { file: "a.toml", text: scenario::MOTOR, sets: &sets };
        scenario::parse(&source, "a").unwrap_or_else(|error| panic!("{error}"))
    }

    /// Just within the covered range a true motor is stable with every torque constant, and just beyond it is not. The
    /// test uses the loop of `[error]`, independent of the corners.
    #[test]
    fn what_is_not_covered_is_where_the_true_motor_is_unstable() {
        let range = "motor.inertia_kg_m2=[1e-4, 1e-2]";
        let found = crate::design(&motor(&[range])).expect("a loop").inertia_range.expect("a range");
        assert!((found.designed_for_kg_m2 - 1e-3).abs() < 1e-12, "{found:?}");
        let grows = |inertia: f64| {
            [-20.0, 0.0, 20.0].into_iter().any(|torque| {
                let inertia = format!("error.inertia_percent={}", 100.0 * (inertia / 1e-3 - 1.0));
                let experiment = motor(&[range, &inertia, &format!("error.torque_percent={torque}")]);
                crate::margins::growth(&experiment).is_some()
            })
        };
        for (end, outwards) in found.ends.iter().zip([0.98, 1.02]) {
            assert!(!end.is_covered() && end.margins.is_none(), "{end:?}");
            let edge = end.stable_to_kg_m2;
            assert!(!grows(edge / outwards) && grows(edge * outwards), "{end:?}");
        }
        let narrow = crate::design(&motor(&["motor.inertia_kg_m2=[1e-4, 4e-4]"])).expect("a loop");
        let covered = narrow.inertia_range.expect("a range");
        assert!(covered.ends.iter().all(|end| end.is_covered() && end.margins.is_some()), "{covered:?}");
        assert!(narrow.got.corners == 6 && narrow.got.is_stable());
        assert_eq!(crate::design(&motor(&[])).expect("a loop").inertia_range, None);
    }

    /// A gap between two stable ends limits the range.
    #[test]
    fn a_gap_before_the_end_ends_it() {
        let is_stable = |it: f64| Ok::<bool, ()>(!(2.0..4.0).contains(&it));
        let found = stable_to(1.0, 10.0, is_stable).expect("no error");
        assert!(found < 2.0 && found > 1.99, "{found}");
    }
}
