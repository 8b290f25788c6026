//! Alarm of a drive in words: the monitor, its value and its bound, each with the key of the bound.

use controller_core::Health;
use controller_core::drive::ALARMS;
use link::remote::Loadable;
use pil_wire::{MAX_E, Model};
use study::number::significant;

use super::keys::Side;
use super::shafts;

/// Values of a drive at or after an alarm, as far as they are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    /// Load estimate of each shaft, N m.
    pub loads_n_m: Option<[f32; MAX_E]>,
    /// Sliding variable σ*.
    pub sigma_star: Option<f32>,
    /// Current command u in the tick of the alarm, A.
    pub u: Option<f32>,
}

/// Returns the alarms of these flags.
pub(super) const fn alarms(health: Health) -> Health {
    Health::from_bits(health.bits() & ALARMS.bits())
}

/// Returns the flags of the first status that the second does not have.
pub(super) const fn without(health: Health, other: Health) -> Health {
    Health::from_bits(health.bits() & !other.bits())
}

/// Returns the causes of an alarm.
pub(super) fn causes(flags: Health, design: &Loadable, values: Values) -> String {
    let bound =
        |name: &str| Side::BEHIND_GEAR.keyed(design, name).map_or_else(String::new, |it| format!("{} = {it}", it.key));
    let number = |value: f32| significant(f64::from(value), 4);
    let loads = || loads(design, values.loads_n_m);
    let is_joint = design.instance.model == Model::Joint;
    let unit = if is_joint { "rad/s^3" } else { "rad/s" };
    let mut told = Vec::new();
    for flag in (0..16).map(|bit| Health::from_bits(1 << bit)).filter(|flag| flags.contains(*flag)) {
        let details = match flag {
            Health::DISTURBANCE_OVER_BOUND => loads(),
            Health::SIGMA_STAR_OVER_BOUND => {
                let value = values.sigma_star.map(|it| format!("{} {unit}", number(it)));
                value.into_iter().chain([bound("sigma*")]).collect::<Vec<_>>().join(", ")
            }
            Health::STUCK_AT_LIMIT => {
                let value = values.u.map(|it| format!("u = {} A", number(it)));
                value.into_iter().chain([bound("limits.max"), bound("stuck")]).collect::<Vec<_>>().join(", ")
            }
            Health::INPUT_REJECTED => format!("counts lost or impossible, {}, or no valid target", bound("lost_ticks")),
            Health::OSCILLATES => format!("disturbance over bound in both directions, {}", loads()),
            Health::WRONG_WAY => "reversed encoder or phase order".into(),
            _ => String::new(),
        };
        told.push(if details.is_empty() { flag.to_string() } else { format!("{flag}: {details}") });
    }
    told.join("; ")
}

/// Returns the load estimates with their bounds: of the shafts beyond their bounds, else of all.
fn loads(design: &Loadable, loads_n_m: Option<[f32; MAX_E]>) -> String {
    let names: &[&str] = if design.instance.model == Model::Joint { &["d_link", "d_motor"] } else { &["d"] };
    let bounds: Vec<_> = names.iter().map(|name| Side::BEHIND_GEAR.keyed(design, name)).collect();
    let is_over = |i: usize| {
        loads_n_m.zip(bounds[i].as_ref()).is_some_and(|(loads, bound)| f64::from(loads[i].abs()) > bound.value)
    };
    let is_any_over = (0..names.len()).any(is_over);
    let told = shafts(design).iter().enumerate().filter(|(i, _)| !is_any_over || is_over(*i)).map(|(i, shaft)| {
        let value = loads_n_m.map_or_else(String::new, |loads| format!(" {} N m", significant(f64::from(loads[i]), 4)));
        let below = if loads_n_m.is_some() && !is_over(i) { " by now, below" } else { "," };
        let bound = bounds[i].as_ref().map_or_else(String::new, |it| format!("{below} {} = {it}", it.key));
        format!("{shaft} load{value}{bound}")
    });
    told.collect::<Vec<_>>().join(", ")
}
