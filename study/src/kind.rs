//! What differs between a motor and a joint in these studies, as data: one table for each kind of drive.

use controller_core::drive::{JointDesign, MotorDesign};
use loop_sim::port::drive::{DriveDesign, Form};

use crate::commission::{Plan, Swap};
use crate::compare::{Knob, corners};

/// What is known of a kind of drive.
pub(crate) struct Kind {
    /// Number of poles of the error, and what the line of the design says of them.
    pub(crate) error: (usize, &'static str),
    /// Names of its observers in the table of poles.
    pub(crate) observers: &'static [&'static str],
    /// What k_l is for, in that table.
    pub(crate) reaching: &'static str,
    /// Unit of σ*.
    pub(crate) sigma_unit: &'static str,
    /// Most of each observer's bandwidth times the period, if the design has a limit of its own, and of k_l.
    pub(crate) most: (&'static [Option<f64>], f64),
    /// Ratios that a search chooses after the bandwidth of the surface, and those of the fast gain set.
    pub(crate) knobs: [&'static [Ratio]; 2],
    /// Bandwidths of the textbook laws, over that of the file's surface: observers, cascade.
    pub(crate) rivals: [&'static [(&'static str, f64)]; 2],
    /// What is off in the corners that laws are compared in, and these corners.
    pub(crate) uncertain: &'static [&'static str],
    pub(crate) corners: fn(f64) -> Vec<corners::Corner>,
    /// Limits of the noise of u in a comparison, as shares of the largest current.
    pub(crate) noise_shares: [f64; 3],
    /// How it is commissioned, its current a share of the largest.
    pub(crate) plan: Plan,
    /// Its instance in the table of cycles.
    pub(crate) instance: &'static str,
}

/// A ratio that is chosen: name, low, high, guess.
type Ratio = (&'static str, f64, f64, f64);

impl Kind {
    /// The kind of this drive.
    pub(crate) const fn of(designed: &DriveDesign) -> &'static Self {
        match designed {
            DriveDesign::Motor(_) => &MOTOR,
            DriveDesign::Joint(_) if designed.is_whole() => &WHOLE,
            DriveDesign::Joint(_) => &JOINT,
        }
    }
}

/// The largest bandwidth of the observer of the driven shaft, times the period, that a design may have.
pub(crate) const fn observer_limit(designed: &DriveDesign) -> f64 {
    let Form { delay_ticks, observer_states, .. } = designed.form();
    match designed {
        DriveDesign::Motor(_) => MotorDesign::observer_limit(delay_ticks, observer_states),
        DriveDesign::Joint(_) => JointDesign::motor_observer_limit(delay_ticks),
    }
}

/// A ratio as a knob.
pub(crate) const fn knob(&(name, low, high, guess): &Ratio) -> Knob {
    Knob { name, low, high, guess }
}

/// It is measured and pushed in one place: its noise may be ten times a joint's. Its loop takes most of what shakes it
/// back, so a record takes all of the current. It is verified by a move as short as its current allows: in one of 1 s
/// friction is all, and nothing is seen of b.
static MOTOR: Kind = Kind {
    error: (1, "the error obeys e' = -w_c e"),
    observers: &["observer w_o"],
    reaching: "sigma*; of a speed loop its bandwidth",
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

const OF_JOINT: Kind = Kind {
    error: (3, "the error, three equal poles"),
    observers: &["observer of the link", "observer of the motor"],
    reaching: "sigma*",
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

static JOINT: Kind = OF_JOINT;

/// A joint that is designed as a whole. Its numbers come of a rule that knows the joint: a search begins with them, and
/// goes as far to either side as with any other law.
static WHOLE: Kind = Kind {
    most: (&[Some(2.0), Some(4.0)], 1.5),
    knobs: [
        &[("link/surface", 0.3, 60.0, 5.0), ("motor/link", 0.1, 50.0, 3.0), ("reaching/surface", 1.0, 100.0, 6.0)],
        &[("link fast/quiet", 0.5, 5.0, 2.0), ("motor fast/quiet", 0.5, 5.0, 1.5)],
    ],
    rivals: [
        OF_JOINT.rivals[0],
        &[("kp (1/s)", 0.15), ("kt (1/s)", 0.5), ("kv (1/s)", 3.0), ("ki (1/s)", 0.1), ("filter (rad/s)", 8.0)],
    ],
    // Its loop takes more back of what shakes it.
    plan: Plan { peak_a: 0.5, most_peak_a: 0.8, ..OF_JOINT.plan },
    instance: "joint as a whole",
    ..OF_JOINT
};
