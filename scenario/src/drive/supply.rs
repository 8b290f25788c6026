//! Supply of a drive: keys of its data sheet, and the speeds that they allow.
//!
//! A current i needs R i + K_e ω volt at speed ω, with K_e = K_t in SI units ([`loop_sim::plant::Supply`]). Behind a
//! gear K_t is multiplied by the ratio and ω divided by it, so the back-EMF does not change.

use std::f64::consts::FRAC_PI_2;

use controller_core::drive::Joint;
use loop_sim::plant::Supply;

use super::build::rounded;
use crate::assemble::TopSpeed;
use crate::error::shown;
use crate::resolve::{Problem, missing, problem};

/// Keys of the supply in the table of a plant. Speeds refer to the motor shaft.
pub(super) struct Keys {
    pub(super) plant: &'static str,
    pub(super) volt: Option<f64>,
    pub(super) ohm: Option<f64>,
    pub(super) no_load: Option<f64>,
}

impl Keys {
    /// Returns the supply for a motor with this K_t at its shaft. `None` without a voltage or a speed.
    pub(super) fn supply(&self, torque_n_m_per_a: f64, max_current_a: f64) -> Result<Option<Supply>, Problem> {
        let Self { plant, volt, ohm, no_load } = *self;
        let no_load_of = |volt: f64| shown(rounded(volt / torque_n_m_per_a));
        match (volt, ohm, no_load) {
            (None, None, None) => Ok(None),
            (None, Some(_), None) => {
                let message = "the winding resistance alone sets no limit: give the supply voltage, or no_load_rad_s";
                missing(&format!("{plant}.supply_v"), message)
            }
            (Some(volt), None, None) => missing(
                &format!("{plant}.resistance_ohm"),
                &format!(
                    "the winding resistance; if it is unknown set {plant}.no_load_rad_s = {} instead of supply_v",
                    no_load_of(volt)
                ),
            ),
            (Some(volt), _, Some(_)) => problem(
                format!("{plant}.no_load_rad_s"),
                format!(
                    "supply_v / torque_n_m_per_a gives it already, {} rad/s: leave one of the two out",
                    no_load_of(volt)
                ),
            ),
            (Some(volt), Some(ohm), None) => Ok(Some(Supply { volt, ohm })),
            (None, ohm, Some(no_load)) => {
                let volt = no_load * torque_n_m_per_a;
                Ok(Some(Supply { volt, ohm: ohm.unwrap_or(volt / max_current_a) }))
            }
        }
    }
}

/// Returns a warning for a current limit that the supply does not reach at rest.
pub(super) fn too_weak(keys: &Keys, supply: Option<Supply>, max_current_a: f64) -> Option<String> {
    let Supply { volt, ohm } = supply?;
    // A resistance that was computed from the current gives the current back, except for rounding.
    (volt / ohm < 0.999 * max_current_a).then(|| {
        let plant = keys.plant;
        format!(
            "{plant}.max_current_a = {} is more than the supply drives through the winding at rest, {} A: take \
             {plant}.max_current_a = {}",
            shown(max_current_a),
            shown(rounded(volt / ohm)),
            shown(rounded(0.999 * volt / ohm))
        )
    })
}

/// Returns the speed limits behind the gear, for a motor with this K_t there.
pub(super) fn top_speed(supply: Option<Supply>, torque_n_m_per_a: f64, max_current_a: f64) -> Option<TopSpeed> {
    let Supply { volt, ohm } = supply?;
    Some(TopSpeed {
        no_load_rad_s: volt / torque_n_m_per_a,
        full_current_rad_s: (volt - ohm * max_current_a).max(0.0) / torque_n_m_per_a,
    })
}

/// Returns the motor speed of a joint for this trajectory point of the link, on the output side: the derivative of
/// q + (J_l q'' + B_l q' + W sin q)/K.
pub(super) fn motor_speed(joint: &Joint, [q, q_1, q_2, q_3, _]: &[f64; 5]) -> f64 {
    let Joint { link_inertia_kg_m2, link_damping_n_m_s, weight_n_m, stiffness_n_m, .. } = *joint;
    let twisting =
        link_inertia_kg_m2 * q_3 + link_damping_n_m_s * q_2 + weight_n_m * loop_sim::sine::sin(q + FRAC_PI_2) * q_1;
    q_1 + twisting / stiffness_n_m
}
