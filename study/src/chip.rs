//! What the tick of a scenario's law costs on a Cortex-M4F: the figures of `firmware/budgets.toml` for the instances
//! that are measured there, which a test of the suite holds together.
//!
//! Cycles are a bound for every input, and what an ordinary tick takes, flash and memory without wait states
//! (`cycle-bound`). The cost is one of the shape, not of the numbers in it.

use controller_core::Shape;
use loop_sim::port::drive::{DriveDesign, Follows, Form};
use loop_sim::port::in_process::{Model, Precision};
use scenario::Experiment;

use crate::kind::Kind;

/// An instance of the tick as it is shipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Its name in `firmware/budgets.toml`.
    pub instance: &'static str,
    /// Cycles of an ordinary tick.
    pub typical: u32,
    /// Cycles of any tick.
    pub bound: u32,
    /// Bytes of code.
    pub flash: u32,
    /// Bytes that change.
    pub state: u32,
    /// Bytes of its design.
    pub coefficients: u32,
}

const fn cost(instance: &'static str, [typical, bound, flash, state, coefficients]: [u32; 5]) -> Cost {
    Cost { instance, typical, bound, flash, state, coefficients }
}

/// All that are known.
pub const COSTS: [Cost; 12] = [
    cost("joint, r = 1", [150, 288, 748, 28, 132]),
    cost("joint, r = 2", [205, 336, 936, 48, 168]),
    cost("joint, r = 3", [258, 377, 1052, 56, 192]),
    cost("joint, r = 2, channel 4 alone", [161, 298, 792, 32, 144]),
    cost("joint, r = 3, all channels", [402, 517, 1448, 96, 264]),
    cost("motor", [226, 849, 7540, 60, 220]),
    cost("motor, two sets", [283, 855, 7838, 68, 248]),
    cost("motor, late", [248, 876, 7952, 64, 220]),
    cost("motor, speed", [192, 706, 4852, 60, 220]),
    cost("joint with two encoders", [619, 1744, 13448, 104, 384]),
    cost("joint with two encoders, two sets", [762, 1870, 14152, 120, 448]),
    cost("joint with two encoders, late", [708, 1883, 15552, 108, 384]),
];

/// Of the tick of a scenario, if its shape is one of those.
pub fn cost_of(experiment: &Experiment) -> Option<Cost> {
    let name = match (&experiment.drive, &experiment.spec) {
        (Some(drive), _) => of_drive(&drive.designed)?,
        (None, Some(spec)) if spec.precision == Precision::F32 && matches!(spec.model, Model::Linear(_)) => {
            match spec.config.shape() {
                Shape { n: 4, r: 1, mask: 0b1000 } => "joint, r = 1",
                Shape { n: 4, r: 2, mask: 0b1010 } => "joint, r = 2",
                Shape { n: 4, r: 3, mask: 0b1010 } => "joint, r = 3",
                Shape { n: 4, r: 2, mask: 0b1000 } => "joint, r = 2, channel 4 alone",
                Shape { n: 4, r: 3, mask: 0b1111 } => "joint, r = 3, all channels",
                _ => return None,
            }
        }
        _ => return None,
    };
    COSTS.iter().find(|cost| cost.instance == name).copied()
}

fn of_drive(designed: &DriveDesign) -> Option<&'static str> {
    let Form { follows, gain_sets, delay_ticks, observer_states } = designed.form();
    Some(match (designed.name(), follows, gain_sets, delay_ticks, observer_states) {
        ("motor", Follows::Position, 1, 0, 3) => "motor",
        ("motor", Follows::Position, 2, 0, 3) => "motor, two sets",
        ("motor", Follows::Position, 1, 1, 3) => "motor, late",
        ("motor", Follows::Speed, 1, 0, 3) => "motor, speed",
        ("joint", Follows::Position, 1, 0, _) => "joint with two encoders",
        ("joint", Follows::Position, 2, 0, _) => "joint with two encoders, two sets",
        ("joint", Follows::Position, 1, 1, _) => "joint with two encoders, late",
        _ => return None,
    })
}

/// Bound in cycles of a tick of a drive that follows a position, also of the forms that are not measured: what two gain
/// sets and each tick of delay cost, added up.
pub fn cycles(designed: &DriveDesign) -> u32 {
    let Form { gain_sets, delay_ticks, .. } = designed.form();
    let bound = |name: &str| COSTS.iter().find(|cost| cost.instance == name).map_or(0, |cost| cost.bound);
    let kind = Kind::of(designed).instance;
    let more = |what: &str| bound(&format!("{kind}, {what}")) - bound(kind);
    bound(kind) + if gain_sets > 1 { more("two sets") } else { 0 } + delay_ticks as u32 * more("late")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As CI counts them.
    #[test]
    fn costs_are_those_of_the_budgets() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/budgets.toml");
        let budgets: toml_edit::DocumentMut =
            std::fs::read_to_string(path).expect("the ceilings").parse().expect("a table");
        let instances = budgets["instance"].as_array_of_tables().expect("instances");
        for Cost { instance, typical, bound, flash, state, coefficients } in COSTS {
            let found = instances.iter().find(|it| it["name"].as_str() == Some(instance)).expect(instance);
            let of = |figure: &str| found["ceiling"][figure].as_integer().map(|value| value as u32);
            let ceilings = ["typical", "bound", "flash", "state", "coefficients"].map(of);
            assert_eq!(ceilings, [typical, bound, flash, state, coefficients].map(Some), "{instance}");
        }
    }

    #[test]
    fn a_form_that_is_measured_is_found_and_others_are_added_up() {
        for (text, kind) in [(scenario::MOTOR, "motor"), (scenario::JOINT, "joint with two encoders")] {
            let with = |sets: &[&str]| {
                let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
                let source = scenario::Source { file: "test.toml", text, sets: &sets };
                scenario::parse(&source, "test").expect("a scenario")
            };
            let one = with(&["drive.gain_sets=1"]);
            assert_eq!(cost_of(&one).map(|cost| cost.instance), Some(kind));
            let sets = with(&["drive.gain_sets=2"]);
            assert_eq!(cost_of(&sets).map(|cost| cost.instance.to_owned()), Some(format!("{kind}, two sets")));
            let bound = |experiment: &Experiment| cycles(&experiment.drive.as_ref().expect("a drive").designed);
            assert_eq!(Some(bound(&one)), cost_of(&one).map(|cost| cost.bound));
            assert_eq!(Some(bound(&sets)), cost_of(&sets).map(|cost| cost.bound));
            let both = with(&["drive.gain_sets=2", "drive.delay_ticks=1"]);
            assert_eq!(cost_of(&both), None);
            assert!(bound(&both) > bound(&sets));
        }
    }
}
