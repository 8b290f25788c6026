//! What is shipped: scenarios whose records are proved, or at least tried.
//!
//! The chains are the designs of `firmware/budgets.toml` with a linear a(x), as the exported C file has them; the
//! drives are those of the files to start from.

use host_sim::export::{Functions, functions};
use scenario::{Experiment, Source};

/// A scenario with a name.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// What it is called in the list.
    pub name: &'static str,
    /// Where the text is from.
    pub file: &'static str,
    text: &'static str,
    /// Keys that are changed.
    sets: &'static [&'static str],
    /// Must everything be proved?
    pub must: bool,
}

const CHAIN_OF_TWO: &str = include_str!("../instances/chain2.toml");
const CHAIN_OF_SIX: &str = include_str!("../instances/chain6.toml");
const JOINT: &str = include_str!("../instances/joint.toml");

const fn must(name: &'static str, file: &'static str, text: &'static str, sets: &'static [&'static str]) -> Instance {
    Instance { name, file, text, sets, must: true }
}

const fn tried(name: &'static str, file: &'static str, text: &'static str, sets: &'static [&'static str]) -> Instance {
    Instance { name, file, text, sets, must: false }
}

const DRIVEN: &[&str] = &["controller.observer=[{ channel = 4, bandwidth_rad_s = 100.0, order = 2 }]"];
const R1: &[&str] = &["controller.observer=[{ channel = 4, bandwidth_rad_s = 100.0, order = 1 }]"];
const R3: &[&str] = &["controller.observer=[{ channel = 2, bandwidth_rad_s = 100.0, order = 3 }, \
                       { channel = 4, bandwidth_rad_s = 100.0, order = 3 }]"];
const EVERY: &[&str] = &["controller.observer=[{ channel = 1, bandwidth_rad_s = 100.0, order = 3 }, \
                          { channel = 2, bandwidth_rad_s = 100.0, order = 3 }, \
                          { channel = 3, bandwidth_rad_s = 100.0, order = 3 }, \
                          { channel = 4, bandwidth_rad_s = 100.0, order = 3 }]"];
const GATE: &[&str] = &["controller.samples={ min = [-12.0, -12.0, -12.0, -12.0], max = [12.0, 12.0, 12.0, 12.0], \
                         jump = [12.0, 12.0, 12.0, 12.0] }"];
const LATE: &[&str] = &["drive.delay_ticks=1"];

/// All of them, those that must be proved first.
pub const ALL: [Instance; 17] = [
    must("joint, r = 1", "joint.toml", JOINT, R1),
    must("joint, r = 2", "joint.toml", JOINT, &[]),
    must("joint, r = 3", "joint.toml", JOINT, R3),
    must("chain, n = 2", "chain2.toml", CHAIN_OF_TWO, &[]),
    must("chain, n = 6", "chain6.toml", CHAIN_OF_SIX, &[]),
    must("motor", "motor.toml", scenario::MOTOR, &[]),
    must("joint with two encoders", "joint.toml", scenario::JOINT, &[]),
    tried("joint, r = 2, channel 4 alone", "joint.toml", JOINT, DRIVEN),
    tried("joint, r = 3, all channels", "joint.toml", JOINT, EVERY),
    tried("joint, r = 2, gate", "joint.toml", JOINT, GATE),
    tried("chain, n = 3", "chain.toml", scenario::CHAIN, &[]),
    tried("paper's joint", "default.toml", scenario::DEFAULT, &[]),
    tried(
        "motor, speed",
        "motor.toml",
        scenario::MOTOR,
        &["drive.mode=\"speed\"", "reference={ kind = \"speed\", speed_rad_s = 20.0 }"],
    ),
    tried("motor, late", "motor.toml", scenario::MOTOR, LATE),
    tried("motor, four states", "motor.toml", scenario::MOTOR, &["drive.observer_states=4"]),
    tried("motor, one set", "motor.toml", scenario::MOTOR, &["drive.uncertain_percent=50"]),
    tried("joint with two encoders, late", "joint.toml", scenario::JOINT, LATE),
];

/// Whose records are broken on purpose.
pub const CHAIN_WITH_FAULTS: Instance = ALL[1];
/// The same of a drive.
pub const DRIVE_WITH_FAULTS: Instance = ALL[5];

impl Instance {
    /// Its scenario, read.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn experiment(&self) -> Result<Experiment, String> {
        let sets: Vec<String> = self.sets.iter().map(ToString::to_string).collect();
        let source = Source { file: self.file, text: self.text, sets: &sets };
        scenario::parse(&source, "instance").map_err(|error| error.to_string())
    }

    /// Its records.
    ///
    /// # Errors
    /// What cannot be recorded.
    pub fn functions(&self) -> Result<Functions, String> {
        functions(&self.experiment()?)
    }
}

#[cfg(test)]
mod tests {
    use super::ALL;

    #[test]
    fn every_instance_can_be_recorded() {
        for instance in ALL {
            instance.functions().unwrap_or_else(|why| panic!("{}: {why}", instance.name));
        }
    }
}
