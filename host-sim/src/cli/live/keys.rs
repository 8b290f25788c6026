//! Numbers of a design as keys of its scenario: on the side of the gear and in the unit that the user types.

use std::fmt;

use link::remote::Loadable;
use pil_wire::Model;
use scenario::{ScenarioError, Source};
use study::number::significant;

/// Number of a design with the key that sets it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Keyed {
    /// Key of the scenario.
    pub key: &'static str,
    /// Value on the side of the gear that the key refers to.
    pub value: f64,
    /// Plant, which decides the unit of sigma*.
    model: Model,
}

impl fmt::Display for Keyed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, model } = self;
        let unit = match (*key, model) {
            ("monitor.sigma_star", Model::Joint) => "rad/s^3",
            ("monitor.sigma_star", _) => "rad/s",
            _ => unit(key),
        };
        write!(f, "{}{}{unit}", shown(*value), if unit.is_empty() { "" } else { " " })
    }
}

/// Returns a number with up to six digits, in the shortest form.
fn shown(value: f64) -> String {
    let short = significant(value, 6).parse().unwrap_or(value);
    format!("{short:?}").trim_end_matches(".0").into()
}

/// Returns the unit that the end of a key names.
fn unit(key: &str) -> &'static str {
    let units = [
        ("_kg_m2", "kg m^2"),
        ("_n_m_per_a", "N m/A"),
        ("damping_n_m_s", "N m s/rad"),
        ("stiffness_n_m", "N m/rad"),
        ("_n_m", "N m"),
        ("_rad_s", "rad/s"),
        ("_per_s", "1/s"),
        ("_s", "s"),
        ("_a", "A"),
        (".fallback", "A"),
        ("_ticks", "ticks"),
        ("counts_per_turn", "counts"),
        (".states", "states"),
    ];
    units.into_iter().find(|(end, _)| key.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// Power of the gear ratio between a number of the motor and the design, which refers to the output of the gear.
type Power = i32;

/// Keys of the numbers of a motor's design, by their names in the layout.
const MOTOR: [(&str, &str, Power); 19] = [
    ("period_s", "drive.period_s", 0),
    ("motor.inertia_kg_m2", "motor.inertia_kg_m2", 2),
    ("motor.torque_n_m_per_a", "motor.torque_n_m_per_a", 1),
    ("motor.damping_n_m_s", "motor.damping_n_m_s", 2),
    ("encoder.bits", "encoder.bits", 0),
    ("encoder.counts_per_turn", "encoder.counts_per_turn", 0),
    ("encoder.gear_num", "motor.gear[1]", 0),
    ("encoder.gear_den", "motor.gear[2]", 0),
    ("encoder.states", "encoder.states", 0),
    ("limits.max", "motor.max_current_a", 0),
    ("bandwidths.surface_rad_s", "drive.surface_rad_s", 0),
    ("bandwidths.observer_rad_s", "drive.observer_rad_s", 0),
    ("bandwidths.reaching_per_s", "drive.reaching_per_s", 0),
    ("fast_ratio", "drive.fast_ratio", 0),
    ("lost_ticks", "drive.lost_ticks", 0),
    ("safe", "drive.fallback", 0),
    ("d", "monitor.load_n_m", 0),
    ("sigma*", "monitor.sigma_star", 0),
    ("stuck", "monitor.saturated_s", 0),
];

/// Keys of the numbers of a joint's design, by their names in the layout.
const JOINT: [(&str, &str, Power); 30] = [
    ("period_s", "drive.period_s", 0),
    ("joint.link_inertia_kg_m2", "joint.link_inertia_kg_m2", 0),
    ("joint.link_damping_n_m_s", "joint.link_damping_n_m_s", 0),
    ("joint.weight_n_m", "joint.weight_n_m", 0),
    ("joint.stiffness_n_m", "joint.stiffness_n_m", 0),
    ("joint.motor_inertia_kg_m2", "joint.motor_inertia_kg_m2", 2),
    ("joint.motor_damping_n_m_s", "joint.motor_damping_n_m_s", 2),
    ("joint.torque_n_m_per_a", "joint.torque_n_m_per_a", 1),
    ("encoders[0].bits", "encoder.link.bits", 0),
    ("encoders[0].counts_per_turn", "encoder.link.counts_per_turn", 0),
    ("encoders[0].states", "encoder.link.states", 0),
    ("encoders[1].bits", "encoder.motor.bits", 0),
    ("encoders[1].counts_per_turn", "encoder.motor.counts_per_turn", 0),
    ("encoders[1].gear_num", "joint.gear[1]", 0),
    ("encoders[1].gear_den", "joint.gear[2]", 0),
    ("encoders[1].states", "encoder.motor.states", 0),
    ("limits.max", "joint.max_current_a", 0),
    ("bandwidths.surface_rad_s", "drive.surface_rad_s", 0),
    ("bandwidths.link_rad_s", "drive.link_rad_s", 0),
    ("bandwidths.motor_rad_s", "drive.motor_rad_s", 0),
    ("bandwidths.reaching_per_s", "drive.reaching_per_s", 0),
    ("fast_ratios[0]", "drive.fast_ratios[1]", 0),
    ("fast_ratios[1]", "drive.fast_ratios[2]", 0),
    ("lost_ticks", "drive.lost_ticks", 0),
    ("safe", "drive.fallback", 0),
    ("lag_s", "joint.current_lag_s", 0),
    ("d_link", "monitor.load_n_m", 0),
    ("d_motor", "monitor.motor_n_m", 0),
    ("sigma*", "monitor.sigma_star", 0),
    ("stuck", "monitor.saturated_s", 0),
];

/// Returns the number of a design with this name.
pub(super) fn number_of(design: &Loadable, name: &str) -> Option<f64> {
    design.names().iter().position(|it| it == name).and_then(|k| design.numbers().nth(k))
}

/// Numbers of a scenario that lie between its keys and its design.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// Motor revolutions per output revolution.
    gear: f64,
    /// Inertia behind the gear of a motor, kg m². `None` for a range: the inertia of the rotor is then not one number.
    load_kg_m2: Option<f64>,
}

impl Side {
    /// Numbers behind the gear, for keys that refer to the output.
    pub(super) const BEHIND_GEAR: Self = Self { gear: 1.0, load_kg_m2: None };

    /// Reads the gear and the inertia of the load.
    ///
    /// # Errors
    /// Fails if the scenario is not TOML.
    pub(super) fn of(source: &Source<'_>, model: Model) -> Result<Self, ScenarioError> {
        let plant = if model == Model::Joint { "joint" } else { "motor" };
        let rotor = scenario::number_at(source, "motor.inertia_kg_m2")?;
        let load = scenario::number_at(source, "motor.load_inertia_kg_m2")?;
        Ok(Self { gear: scenario::gear_at(source, plant)?, load_kg_m2: rotor.and(load) })
    }

    /// Returns the number with this name as a key of the scenario. `None` if no key sets it.
    pub(super) fn keyed(&self, design: &Loadable, name: &str) -> Option<Keyed> {
        let number = |name: &str| number_of(design, name);
        let of: &[(&str, &'static str, Power)] = if design.instance.model == Model::Joint { &JOINT } else { &MOTOR };
        let (name, key, power) = *of.iter().find(|(it, ..)| *it == name)?;
        let mut value = number(name)?;
        match name {
            "motor.inertia_kg_m2" => value -= self.load_kg_m2?,
            "d" => value *= number("motor.inertia_kg_m2")?,
            "d_link" => value *= number("joint.link_inertia_kg_m2")?,
            "d_motor" => value *= number("joint.motor_inertia_kg_m2")?,
            "stuck" => value *= number("period_s")?,
            _ => {}
        }
        Some(Keyed { key, value: value / self.gear.powi(power), model: design.instance.model })
    }

    /// Returns the keyed numbers in which two designs differ, the other design second, and the names of the numbers
    /// without a key.
    ///
    /// Behind the gear if the gear or the load of the file cannot be those of the drive.
    pub(super) fn differences(&self, one: &Loadable, other: &Loadable) -> (Vec<[Keyed; 2]>, Vec<String>) {
        let (mut keyed, mut rest) = (Vec::new(), Vec::new());
        let is_alike = ["encoder.gear_num", "encoder.gear_den", "encoders[1].gear_num", "encoders[1].gear_den"]
            .iter()
            .all(|name| number_of(one, name) == number_of(other, name));
        let is_heavier = self.keyed(one, "motor.inertia_kg_m2").is_none_or(|inertia| inertia.value > 0.0);
        let side = if is_alike && is_heavier { *self } else { Self::BEHIND_GEAR };
        for ((name, here), there) in one.names().into_iter().zip(one.numbers()).zip(other.numbers()) {
            if here.to_bits() == there.to_bits() {
                continue;
            }
            match (side.keyed(one, &name), side.keyed(other, &name)) {
                (Some(here), Some(there)) if here.to_string() != there.to_string() => keyed.push([here, there]),
                (Some(_), Some(_)) => {}
                _ => rest.push(name),
            }
        }
        (keyed, rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::live::designed;

    /// Every number comes back as it was typed, with the gear between motor and design.
    #[test]
    fn a_number_of_a_design_is_named_and_counted_as_its_key_was_typed() {
        let motor = "[motor]\ninertia_kg_m2 = 3e-6\ntorque_n_m_per_a = 0.007\nmax_current_a = 8.0\n\
                     damping_n_m_s = 2e-6\ngear = [8, 1]\nload_inertia_kg_m2 = 1e-4\n[encoder]\nbits = 11\n\
                     [drive]\nperiod_s = 5e-4\nsurface_rad_s = 60.0\nobserver_rad_s = 400.0\nreaching_per_s = 150.0\n\
                     fast_ratio = 1.5\nlost_ticks = 20\nfallback = 0.5\n[monitor]\nload_n_m = 0.2\n";
        let joint = "[joint]\nlink_inertia_kg_m2 = 0.23\nmotor_inertia_kg_m2 = 9e-6\nstiffness_n_m = 9.0\n\
                     torque_n_m_per_a = 0.0119\nmax_current_a = 30.0\nlink_damping_n_m_s = 0.07\n\
                     motor_damping_n_m_s = 7e-4\nweight_n_m = 0.23\ngear = [10, 1]\n\
                     [encoder.link]\nbits = 20\n[encoder.motor]\nbits = 16\n[drive]\ntuning = \"normal\"\n\
                     [monitor]\nload_n_m = 2.5\nmotor_n_m = 1.5\nsaturated_s = 0.3\n";
        for (text, least) in [(motor, 14), (joint, 13)] {
            let source = Source { file: "it", text, sets: &[] };
            let design = designed("it", text, &[]).unwrap_or_else(|failure| panic!("{}", failure.message));
            let side = Side::of(&source, design.instance.model).expect("a scenario");
            let mut found = 0;
            for keyed in design.names().iter().filter_map(|name| side.keyed(&design, name)) {
                let typed = scenario::number_at(&source, keyed.key).expect("a scenario");
                if let Some(typed) = typed.filter(|it| *it != 0.0) {
                    assert!((keyed.value / typed - 1.0).abs() < 1e-9, "{keyed:?}: typed {typed}");
                    found += 1;
                }
            }
            assert!(found >= least, "{found} keys of {text}");
        }
    }

    #[test]
    fn a_number_has_the_unit_of_its_key() {
        let said = |key, value| Keyed { key, value, model: Model::Joint }.to_string();
        assert_eq!(said("motor.inertia_kg_m2", 2e-4), "0.0002 kg m^2");
        assert_eq!(said("drive.surface_rad_s", 120.0), "120 rad/s");
        assert_eq!(said("drive.reaching_per_s", 150.5), "150.5 1/s");
        assert_eq!(said("encoder.bits", 14.0), "14");
        assert_eq!(said("drive.period_s", 2e-4), "0.0002 s");
        assert_eq!(said("monitor.sigma_star", 2.5), "2.5 rad/s^3");
    }
}
