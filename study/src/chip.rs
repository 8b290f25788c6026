//! Cost of a tick on a Cortex-M4F from `firmware/budgets.toml`, the cycle budgets that CI enforces.
//!
//! Cycles are a bound for every input and a typical value, with flash and memory without wait states (`cycle-bound`).
//! The cost depends on the controller configuration, not on its numbers.

use std::sync::OnceLock;

use controller_core::Shape;
use loop_sim::port::drive::{DriveDesign, Follows, Form};
use loop_sim::port::in_process::{Model, Precision};
use scenario::Experiment;
use toml_edit::{ArrayOfTables, Table};

use crate::kind::DriveKind;

/// Cost of a shipped instance of the tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Name in `firmware/budgets.toml`.
    pub instance: String,
    /// Cycles of a typical tick.
    pub typical: u32,
    /// WCET bound, cycles.
    pub bound: u32,
    /// Code size, bytes.
    pub flash: u32,
    /// State size, bytes.
    pub state: u32,
    /// Size of the design, bytes.
    pub coefficients: u32,
}

/// Returns all instances with complete figures, read from the budget file itself. The link beside the manifest takes
/// the file into the package of this crate.
fn costs() -> &'static [Cost] {
    static COSTS: OnceLock<Vec<Cost>> = OnceLock::new();
    COSTS.get_or_init(|| {
        let file: toml_edit::DocumentMut = include_str!("../budgets.toml").parse().expect("ceilings that CI has read");
        let instances = file["instance"].as_array_of_tables().into_iter().flat_map(ArrayOfTables::iter);
        instances.filter_map(measured).collect()
    })
}

/// Returns the cost of an instance; `None` for a part of a tick, which has no state.
fn measured(instance: &Table) -> Option<Cost> {
    let of = |figure: &str| u32::try_from(instance["ceiling"].get(figure)?.as_integer()?).ok();
    Some(Cost {
        instance: instance["name"].as_str()?.to_owned(),
        typical: of("typical")?,
        bound: of("bound")?,
        flash: of("flash")?,
        state: of("state")?,
        coefficients: of("coefficients")?,
    })
}

/// Returns the cost of an instance by its name in `firmware/budgets.toml`.
pub fn cost(instance: &str) -> Option<&'static Cost> {
    costs().iter().find(|cost| cost.instance == instance)
}

/// Returns the cost of the tick of a scenario, if its configuration is in the table.
pub fn cost_of(experiment: &Experiment) -> Option<&'static Cost> {
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
    cost(name)
}

fn of_drive(designed: &DriveDesign) -> Option<&'static str> {
    let Form { follows, gain_sets, delay_ticks, observer_states } = designed.form();
    Some(match (DriveKind::of(designed).instance, follows, gain_sets, delay_ticks, observer_states) {
        ("motor", Follows::Position, 1, 0, 3) => "motor",
        ("motor", Follows::Position, 2, 0, 3) => "motor, two sets",
        ("motor", Follows::Position, 1, 1, 3) => "motor, late",
        ("motor", Follows::Speed, 1, 0, 3) => "motor, speed",
        ("joint with two encoders", Follows::Position, 1, 0, _) => "joint with two encoders",
        ("joint with two encoders", Follows::Position, 2, 0, _) => "joint with two encoders, two sets",
        ("joint with two encoders", Follows::Position, 1, 1, _) => "joint with two encoders, late",
        ("joint as a whole", Follows::Position, 1, 0, _) => "joint as a whole",
        ("joint as a whole", Follows::Position, 2, 0, _) => "joint as a whole, two sets",
        ("joint as a whole", Follows::Position, 1, 1, _) => "joint as a whole, late",
        _ => return None,
    })
}

/// Returns the WCET bound of a tick of a position drive, cycles. Forms that are not in the table get the sum of the
/// costs of two gain sets and of each tick of delay.
pub fn cycles(designed: &DriveDesign) -> u32 {
    let Form { gain_sets, delay_ticks, .. } = designed.form();
    let bound = |name: &str| cost(name).map_or(0, |cost| cost.bound);
    let kind = DriveKind::of(designed).instance;
    let more = |what: &str| bound(&format!("{kind}, {what}")) - bound(kind);
    bound(kind) + if gain_sets > 1 { more("two sets") } else { 0 } + delay_ticks as u32 * more("late")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instance_that_a_drive_or_a_chain_can_have_is_measured() {
        let chains = ["joint, r = 1", "joint, r = 2", "joint, r = 3", "joint, r = 2, channel 4 alone"];
        let others = ["joint, r = 3, all channels", "motor", "motor, two sets", "motor, late", "motor, speed"];
        let of = |joint: &str| ["", ", two sets", ", late"].map(|more| format!("{joint}{more}"));
        let joints = ["joint with two encoders", "joint as a whole"].map(of).concat();
        for name in chains.into_iter().chain(others).chain(joints.iter().map(String::as_str)) {
            let found = cost(name).expect(name);
            assert!(found.typical > 100 && found.typical < found.bound, "{found:?}");
            assert!(found.state > 0 && found.coefficients > found.state, "{found:?}");
        }
    }

    #[test]
    fn a_form_that_is_measured_is_found_and_others_are_added_up() {
        for (text, kind, tuning) in [
            (scenario::MOTOR, "motor", None),
            (scenario::JOINT, "joint with two encoders", Some("drive.tuning=normal")),
            (scenario::JOINT, "joint as a whole", Some("drive.tuning=coupled")),
        ] {
            let with = |sets: &[&str]| {
                let sets: Vec<String> = sets.iter().copied().chain(tuning).map(str::to_owned).collect();
                let source = scenario::Source { file: "test.toml", text, sets: &sets };
                scenario::parse(&source, "test").expect("a scenario")
            };
            let one = with(&["drive.gain_sets=1"]);
            assert_eq!(cost_of(&one).map(|cost| &*cost.instance), Some(kind));
            let sets = with(&["drive.gain_sets=2"]);
            assert_eq!(cost_of(&sets).map(|cost| cost.instance.clone()), Some(format!("{kind}, two sets")));
            let bound = |experiment: &Experiment| cycles(&experiment.drive.as_ref().expect("a drive").designed);
            assert_eq!(Some(bound(&one)), cost_of(&one).map(|cost| cost.bound));
            assert_eq!(Some(bound(&sets)), cost_of(&sets).map(|cost| cost.bound));
            let both = with(&["drive.gain_sets=2", "drive.delay_ticks=1"]);
            assert_eq!(cost_of(&both), None);
            assert!(bound(&both) > bound(&sets));
        }
    }
}
