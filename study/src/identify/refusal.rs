//! Why nothing is to be designed from a record, and what to record instead.

use std::fmt;

use super::{
    LEAST_ALONE_S, LEAST_SHAKEN, LEAST_TRAVEL_STEPS, MOST_ALONE, MOST_CONDITION, MOST_PEAK, MOST_STEPS,
    MOST_UNEXPLAINED, MOST_UNEXPLAINED_ALONE, stands_out,
};

/// Why nothing is to be designed from a record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// A shaft hardly moves.
    Still {
        /// Which.
        shaft: &'static str,
        /// How far, steps.
        steps: f64,
    },
    /// The current is the same throughout.
    Steady {
        /// A.
        held_a: f64,
    },
    /// Without the link's count, and too short for that.
    Short {
        /// s.
        seconds: f64,
    },
    /// Without the link's count, and the link does not swing at its own frequency.
    Poor {
        /// Interval of k_1, as a share; infinite where nothing is seen of it.
        interval: f64,
        /// Frequency of the link with the motor held, Hz, by the data sheet.
        own_hz: f64,
    },
    /// Without the link's count, and no link explains the current.
    NotTheSpring {
        /// What is left of it, as a share (rms).
        unexplained: f64,
    },
    /// Two parameters look alike.
    Alike {
        /// Of link or motor.
        equation: &'static str,
        /// Condition.
        condition: f64,
    },
    /// Friction is not small beside what shakes the motor.
    Weak {
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
        /// f_c, A.
        friction_a: f64,
    },
    /// The link's equation is another.
    NotTheJoint {
        /// Rms of what is left, steps.
        residual_steps: f64,
        /// Largest that is taken.
        most: f64,
        /// What would explain it.
        cause: Option<&'static str>,
    },
    /// The motor's equation is another.
    NotTheMotor {
        /// Rms of what is left, steps.
        residual_steps: f64,
        /// Largest that is taken.
        most: f64,
        /// The same as a share of what the current makes of the motion.
        unexplained: f64,
        /// The largest of what is left, steps.
        peak_steps: f64,
        /// Its time from the beginning of the record, s.
        at_s: f64,
    },
    /// Least squares did not come to an end.
    Unsolved {
        /// Of link or motor.
        equation: &'static str,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
    /// No plant has such a parameter.
    NotPositive {
        /// Which.
        name: &'static str,
        /// Found.
        value: f64,
        /// What would explain it.
        cause: Option<&'static str>,
    },
    /// Farther from the data sheet than it can be.
    OutOfTolerance {
        /// Which.
        name: &'static str,
        /// Found over the data sheet, less 1.
        change: f64,
        /// Largest that is taken, as a share.
        tolerance: f64,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
    /// The data sheet was known better.
    Vague {
        /// Which.
        name: &'static str,
        /// Its interval, as a share.
        interval: f64,
        /// Largest that is taken, as a share.
        most: f64,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
}

/// What the motor alone says of the link, and what it lacks.
fn poor(interval: f64, own_hz: f64) -> String {
    let to =
        if interval.is_finite() { format!("to +-{:.0} % only", 100.0 * interval) } else { String::from("nothing") };
    format!(
        "of k_1 the motor alone says {to}, at most {:.0} % are of use: the link must swing at its own frequency, some \
         {own_hz:.1} Hz with the motor held. Record moves to and fro around it, ever shorter and quicker, with the \
         multisine on top, as `host-sim commission --motor-alone` does, or the link's count",
        100.0 * MOST_ALONE
    )
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let because = |cause: Option<&str>| cause.map_or_else(String::new, |cause| format!(": {cause}"));
        match self {
            Self::Still { shaft, steps } => write!(
                f,
                "the {shaft} moves by {steps:.0} steps of its encoder, at least {LEAST_TRAVEL_STEPS} are needed: \
                 record moves, or is it another column?"
            ),
            Self::Steady { held_a } => write!(
                f,
                "u_held_a is {held_a} A throughout: record the current that was held in each tick, with moves to and \
                 fro and the multisine of `host-sim commission` on top, or is it another column?"
            ),
            Self::Short { seconds } => write!(
                f,
                "{seconds} s without the link's count: the motor alone needs at least {LEAST_ALONE_S} s, record as \
                 `host-sim commission --motor-alone` does"
            ),
            Self::Poor { interval, own_hz } => f.write_str(&poor(*interval, *own_hz)),
            Self::NotTheSpring { unexplained } => write!(
                f,
                "what the spring does to the motor is not explained: {:.0} % of the current are left (rms), at most \
                 {:.0} %: an end stop, play or friction at the link, a load that varies, a current that is not the one \
                 that was held",
                100.0 * unexplained,
                100.0 * MOST_UNEXPLAINED_ALONE
            ),
            Self::Alike { equation: equation @ "link", condition } => write!(
                f,
                "parameters of the {equation} cannot be told apart (condition {condition:.0}, at most \
                 {MOST_CONDITION}): one move does not do, record moves to and fro"
            ),
            Self::Alike { equation, condition } => write!(
                f,
                "parameters of the {equation} cannot be told apart (condition {condition:.0}, at most \
                 {MOST_CONDITION}): a move alone does not do, add the multisine of `host-sim commission` to the current"
            ),
            Self::Weak { shaken_a, friction_a } => write!(
                f,
                "the current shakes the motor by {shaken_a:.2} A rms, and friction takes {friction_a:.2} A of it: at \
                 least {LEAST_SHAKEN} times the friction are needed: give the multisine a larger peak, or the drive a \
                 slower loop for the record (drive.surface_rad_s)"
            ),
            Self::NotTheJoint { residual_steps, most, cause: None } => write!(
                f,
                "what the link does is not explained: {residual_steps:.2} steps rms are left, at most {most:.2}: an \
                 end stop, slip, play or friction at the link, or a noisy encoder (--noise-steps)"
            ),
            Self::NotTheJoint { cause, .. } => {
                write!(f, "what the link does is not explained{}", because(*cause))
            }
            Self::NotTheMotor { residual_steps, most, unexplained, peak_steps, at_s } => {
                write!(f, "what the motor does is not explained: ")?;
                if stands_out(*peak_steps, *residual_steps) {
                    return write!(
                        f,
                        "one deviation of {peak_steps:.0} steps at {at_s:.3} s stands out of {residual_steps:.2} steps \
                         rms ({:.0} times, at most {MOST_PEAK}): a count that jumped or stuck, an end stop, a blow or \
                         a load that came. Cut the record before or after it if 2 s with moves to and fro remain, or \
                         record again",
                        peak_steps / residual_steps
                    );
                }
                write!(
                    f,
                    "{residual_steps:.2} steps rms are left, at most {most:.2}; that is {:.0} % of what the current \
                     makes of its motion, at most {:.0} % may be cogging, ripple and friction. The largest, \
                     {peak_steps:.0} steps, at {at_s:.3} s: a count that jumped, an end stop, a load that varies, a \
                     current that is not the one that was held or comes late, or strong cogging (--cogging N)",
                    100.0 * unexplained,
                    100.0 * MOST_UNEXPLAINED
                )
            }
            Self::Unsolved { equation, shaken_a } => write!(
                f,
                "least squares for the {equation} found no end in {MOST_STEPS} steps: no record of such a plant, or \
                 one that says too little: the current shakes it by {shaken_a:.2} A rms, and needs the multisine of \
                 `host-sim commission`, and encoders of about as many bits on both sides"
            ),
            Self::NotPositive { name, value, cause } => {
                write!(f, "{name} = {value:.4} is not above 0{}", because(*cause))
            }
            Self::OutOfTolerance { name, change, tolerance, shaken_a } => write!(
                f,
                "{name} is {:+.0} % from the data sheet, at most {:.0} % are declared: correct the file, declare more \
                 with --tolerance, or, if the current was not shaken by a multisine ({shaken_a:.2} A rms are quick in \
                 it), record again with one",
                100.0 * change,
                100.0 * tolerance
            ),
            Self::Vague { name, interval, most, shaken_a } => write!(
                f,
                "the record says {name} to +-{:.0} % only, at most {:.0} % are of use: the current shakes the motor by \
                 {shaken_a:.2} A rms, add the multisine of `host-sim commission`, give it a larger peak, let it move \
                 farther (--way), take a finer encoder, or keep the data sheet",
                100.0 * interval,
                100.0 * most
            ),
        }
    }
}

impl std::error::Error for Refusal {}
