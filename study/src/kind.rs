//! Differences between motor and joint in these studies, as one table for each kind of drive.

use controller_core::drive::{JointDesign, MotorDesign};
use loop_sim::port::drive::{DriveDesign, Form};

use crate::commission::{Plan, Swap};
use crate::compare::{Knob, corners};

/// Data of a kind of drive.
pub(crate) struct DriveKind {
    /// Number of poles of the error, and their description in the table of poles.
    pub(crate) error: (usize, &'static str),
    /// Names of the observers in the table of poles.
    pub(crate) observers: &'static [&'static str],
    /// Description of k_l in the table of poles.
    pub(crate) reaching: &'static str,
    /// Unit of σ*.
    pub(crate) sigma_unit: &'static str,
    /// Largest bandwidth times period of each observer, if the design has its own limit, and largest k_l times period.
    pub(crate) most: (&'static [Option<f64>], f64),
    /// Ratios that a search tunes after the surface bandwidth, and the ratios of the high gains.
    pub(crate) knobs: [&'static [Ratio]; 2],
    /// Initial bandwidths of the baseline controllers relative to the surface of the file: observers, cascade.
    pub(crate) rivals: [&'static [(&'static str, f64)]; 2],
    /// Uncertain parameters in the corners of a comparison, and these corners.
    pub(crate) uncertain: &'static [&'static str],
    pub(crate) corners: fn(f64) -> Vec<corners::Corner>,
    /// Limits of the current noise in a comparison, as shares of the largest current.
    pub(crate) noise_shares: [f64; 3],
    /// Commissioning plan, with its currents as shares of the largest current.
    pub(crate) plan: Plan,
    /// Name of the instance in the table of cycles.
    pub(crate) instance: &'static str,
}

/// Tuned ratio: name, low, high, guess.
type Ratio = (&'static str, f64, f64, f64);

impl DriveKind {
    /// Returns the kind of this drive.
    pub(crate) const fn of(designed: &DriveDesign) -> &'static Self {
        match designed {
            DriveDesign::Motor(_) => &MOTOR,
            DriveDesign::Joint(_) if designed.is_whole() => &WHOLE,
            DriveDesign::Joint(_) => &JOINT,
        }
    }
}

/// Returns the largest bandwidth times period of the observer of the driven shaft.
pub(crate) const fn observer_limit(designed: &DriveDesign) -> f64 {
    let Form { delay_ticks, observer_states, .. } = designed.form();
    match designed {
        DriveDesign::Motor(_) => MotorDesign::observer_limit(delay_ticks, observer_states),
        DriveDesign::Joint(_) => JointDesign::motor_observer_limit(delay_ticks),
    }
}

/// Returns a ratio as a tuning parameter.
pub(crate) const fn knob(&(name, low, high, guess): &Ratio) -> Knob {
    Knob { name, low, high, guess }
}

/// Motor. Sensor and load act on the same shaft, so its noise limit is ten times as high as for a joint. The loop
/// cancels most of the excitation, so a recording uses all of the current. The verification is the shortest move that
/// the current allows: in a move of 1 s friction dominates and b has no visible effect.
static MOTOR: DriveKind = DriveKind {
    error: (1, "e' = -w_c e"),
    observers: &["observer w_o"],
    reaching: "sigma* to zero; bandwidth of a speed loop",
    sigma_unit: "rad/s",
    most: (&[None], 1.0),
    knobs: [
        &[("observer/surface", 0.5, 12.0, 1.5), ("reaching/surface", 1.0, 30.0, 8.0)],
        &[("fast/quiet", 1.0, 4.0, 2.0)],
    ],
    rivals: [
        &[("observer (rad/s)", 1.5)],
        &[("kp (1/s)", 0.5), ("kv (1/s)", 1.5), ("ki (1/s)", 0.5), ("filter (rad/s)", 8.0)],
    ],
    uncertain: &corners::OF_MOTOR,
    corners: corners::of_motor,
    noise_shares: [3e-3, 1e-2, 3e-2],
    plan: Plan {
        way_rad: 3.0,
        move_s: 0.6,
        peak_a: 1.0,
        most_peak_a: 0.0,
        seed: 1,
        verify_rad: 1.0,
        verify_s: 0.05,
        swap: Swap::AtRest,
        motor_alone: false,
    },
    instance: "motor",
};

const OF_JOINT: DriveKind = DriveKind {
    error: (3, "three equal poles"),
    observers: &["observer of the link", "observer of the motor"],
    reaching: "sigma* to zero",
    sigma_unit: "rad/s^3",
    most: (&[Some(0.25), None], 0.3),
    knobs: [
        &[("link/surface", 3.0, 10.0, 4.0), ("motor/link", 3.5, 14.0, 6.25), ("reaching/surface", 2.0, 8.0, 5.0)],
        &[("link fast/quiet", 1.0, 4.0, 3.0), ("motor fast/quiet", 1.0, 4.0, 1.5)],
    ],
    rivals: [
        &[("link (rad/s)", 4.0), ("motor (rad/s)", 20.0)],
        &[("kp (1/s)", 0.15), ("kt (1/s)", 0.5), ("kv (1/s)", 10.0), ("ki (1/s)", 0.1), ("filter (rad/s)", 40.0)],
    ],
    uncertain: &corners::RATIOS,
    corners: corners::of_joint,
    noise_shares: [1.0 / 3000.0, 1e-3, 1.0 / 300.0],
    plan: Plan {
        way_rad: 0.6,
        move_s: 2.0,
        peak_a: 0.27,
        most_peak_a: 0.0,
        seed: 1,
        verify_rad: 1.0,
        verify_s: 1.0,
        swap: Swap::AtRest,
        motor_alone: false,
    },
    instance: "joint with two encoders",
};

static JOINT: DriveKind = OF_JOINT;

/// Coupled joint. A search starts at the numbers of the rule and has the range of any other controller to either side.
static WHOLE: DriveKind = DriveKind {
    most: (&[Some(2.0), Some(4.0)], 1.5),
    knobs: [
        &[("link/surface", 0.3, 60.0, 5.0), ("motor/link", 0.1, 50.0, 3.0), ("reaching/surface", 1.0, 100.0, 6.0)],
        &[("link fast/quiet", 0.5, 5.0, 2.0), ("motor fast/quiet", 0.5, 5.0, 1.5)],
    ],
    rivals: [
        OF_JOINT.rivals[0],
        &[("kp (1/s)", 0.15), ("kt (1/s)", 0.5), ("kv (1/s)", 3.0), ("ki (1/s)", 0.1), ("filter (rad/s)", 8.0)],
    ],
    // This loop cancels more of the excitation.
    plan: Plan { peak_a: 0.5, most_peak_a: 0.8, ..OF_JOINT.plan },
    instance: "joint as a whole",
    ..OF_JOINT
};
