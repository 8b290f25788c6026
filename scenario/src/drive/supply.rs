//! The supply of a drive: the keys of its data sheet, and the speeds that they allow.
//!
//! A current i takes R i + K_e ω volt at speed ω, with K_e = K_t in SI units ([`loop_sim::plant::Supply`]). On the far
//! side of a gear K_t is multiplied by its ratio and ω divided by it: the back-EMF is the same.

use std::f64::consts::FRAC_PI_2;

use controller_core::drive::Joint;
use loop_sim::plant::Supply;

use super::build::rounded;
use crate::assemble::TopSpeed;
use crate::error::shown;
use crate::resolve::{Problem, missing, problem};

/// The keys in the table of this plant; speeds are those of the motor's own shaft.
pub(super) struct Keys {
    pub(super) plant: &'static str,
    pub(super) volt: Option<f64>,
    pub(super) ohm: Option<f64>,
    pub(super) no_load: Option<f64>,
}

impl Keys {
    /// What they say of a motor with this K_t at its own shaft; none without a voltage or a speed.
    pub(super) fn supply(&self, torque_n_m_per_a: f64, max_current_a: f64) -> Result<Option<Supply>, Problem> {
        let Self { plant, volt, ohm, no_load } = *self;
        let no_load_of = |volt: f64| shown(rounded(volt / torque_n_m_per_a));
        match (volt, ohm, no_load) {
            (None, None, None) => Ok(None),
            (None, Some(_), None) => {
                let message = "the winding resistance alone is no limit: give the supply voltage, or no_load_rad_s";
                missing(&format!("{plant}.supply_v"), message)
            }
            (Some(volt), None, None) => missing(
                &format!("{plant}.resistance_ohm"),
                &format!(
                    "the winding resistance; where it is not known say {plant}.no_load_rad_s = {} instead of supply_v",
                    no_load_of(volt)
                ),
            ),
            (Some(volt), _, Some(_)) => problem(
                format!("{plant}.no_load_rad_s"),
                format!(
                    "supply_v / torque_n_m_per_a says it already, {} rad/s: leave one of the two out",
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

/// A warning of a current that is not even driven at rest.
pub(super) fn too_weak(keys: &Keys, supply: Option<Supply>, max_current_a: f64) -> Option<String> {
    let Supply { volt, ohm } = supply?;
    // Of a resistance that follows from the current, the current follows but for rounding.
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

/// Speeds behind the gear, of a motor with this K_t there.
pub(super) fn top_speed(supply: Option<Supply>, torque_n_m_per_a: f64, max_current_a: f64) -> Option<TopSpeed> {
    let Supply { volt, ohm } = supply?;
    Some(TopSpeed {
        no_load_rad_s: volt / torque_n_m_per_a,
        full_current_rad_s: (volt - ohm * max_current_a).max(0.0) / torque_n_m_per_a,
    })
}

/// Speed of the motor of a joint whose link moves by this jet, on the link's side: the derivative of
/// q + (J_l q'' + B_l q' + W sin q)/K.
pub(super) fn motor_speed(joint: &Joint, [q, q_1, q_2, q_3, _]: &[f64; 5]) -> f64 {
    let Joint { link_inertia_kg_m2, link_damping_n_m_s, weight_n_m, stiffness_n_m, .. } = *joint;
    let twisting =
        link_inertia_kg_m2 * q_3 + link_damping_n_m_s * q_2 + weight_n_m * loop_sim::sine::sin(q + FRAC_PI_2) * q_1;
    q_1 + twisting / stiffness_n_m
}
