//! Why nothing is to be designed from a record, and what to record instead.

use std::fmt;

use crate::number::significant;

use super::{
    LEAST_ALONE_S, LEAST_SHAKEN, LEAST_TRAVEL_STEPS, MOST_ALONE, MOST_CONDITION, MOST_PEAK, MOST_STEPS,
    MOST_UNEXPLAINED, MOST_UNEXPLAINED_ALONE, stands_out,
};

/// What is fitted to a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equation {
    /// The link of a joint.
    Link,
    /// Its motor.
    MotorOfJoint,
    /// A motor with a rigid load.
    Motor,
}

impl Equation {
    /// Letters of the parameters that it gives.
    pub const fn parameters(self) -> &'static str {
        match self {
            Self::Link => "k_1, b_1 and g",
            Self::MotorOfJoint => "k_2, b_2, B_0 and f_c",
            Self::Motor => "b and f_c",
        }
    }
}

impl fmt::Display for Equation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Link { "link" } else { "motor" })
    }
}

/// Why nothing is to be designed from a record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// A shaft hardly moves.
    Still {
        /// Which.
        shaft: Equation,
        /// How far, steps.
        steps: f64,
    },
    /// The current is the same throughout.
    Steady {
        /// Of the motor.
        equation: Equation,
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
        equation: Equation,
        /// Condition.
        condition: f64,
    },
    /// Friction is not small beside what shakes the motor.
    Weak {
        /// Of the motor.
        equation: Equation,
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
        equation: Equation,
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
    /// Numbers of the data sheet were read off the output of the gear.
    Geared {
        /// What the record says.
        name: &'static str,
        /// Found over that of the data sheet.
        ratio: f64,
        /// Turns of the motor in one behind its gear.
        gear: f64,
        /// Keys, what they should be if that is known, and what to divide them by.
        numbers: Vec<(&'static str, Option<f64>, f64)>,
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

/// What the motor does that its equation does not: rms and bar in steps, share of what the current does, peak and time.
fn unexplained_motor([rms, most]: [f64; 2], share: f64, [peak, at_s]: [f64; 2]) -> String {
    if stands_out(peak, rms) {
        return format!(
            "what the motor does is not explained: one deviation of {peak:.0} steps at {at_s:.3} s stands out of \
             {rms:.2} steps rms ({:.0} times, at most {MOST_PEAK}): a count that jumped or stuck, an end stop, a blow \
             or a load that came. Cut the record before or after it if 2 s with moves to and fro remain, or record \
             again",
            peak / rms
        );
    }
    format!(
        "what the motor does is not explained: {rms:.2} steps rms are left, at most {most:.2}; that is {:.0} % of what \
         the current makes of its motion, at most {:.0} % may be cogging, ripple and friction. The largest, {peak:.0} \
         steps, at {at_s:.3} s: a count that jumped, an end stop, a load that varies, a current that is not the one \
         that was held or comes late, or strong cogging (--cogging N)",
        100.0 * share,
        100.0 * MOST_UNEXPLAINED
    )
}

/// Which numbers are to be changed, and to what.
fn write_geared(
    f: &mut fmt::Formatter<'_>,
    (name, ratio, gear): (&str, f64, f64),
    numbers: &[(&str, Option<f64>, f64)],
) -> fmt::Result {
    let four = |value: f64| significant(value, 4);
    // As a person writes it: 9, 20.25.
    let short = |value: f64| (1e4 * value).round() / 1e4;
    write!(f, "{name} is {} times that of the data sheet, which a gear of {} explains: ", four(ratio), short(gear))?;
    for (k, (key, own, divisor)) in numbers.iter().enumerate() {
        let (and, by) = (if k > 0 { ", and " } else { "" }, short(*divisor));
        let set = own.map_or_else(String::new, |own| format!(": set {key} = {}", four(own)));
        write!(f, "{and}{key} is that of the output of the gear, {by} times that of the motor{set}")?;
    }
    f.write_str(". These keys are of the motor's own shaft; or leave the gear out, if every number is of the output")
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let because = |cause: Option<&str>| cause.map_or_else(String::new, |cause| format!(": {cause}"));
        match self {
            Self::Still { shaft, steps } => write!(
                f,
                "{} cannot be told: the {shaft} moves by {steps:.0} steps of its encoder, at least \
                {LEAST_TRAVEL_STEPS} \
                 are needed: record longer moves (commission --way), or is it another column?",
                shaft.parameters()
            ),
            Self::Steady { equation, held_a } => write!(
                f,
                "{} cannot be told: u_held_a is {held_a} A throughout: record the current that was held in each \
                tick, with moves to and \
                 fro and the multisine of `host-sim commission` on top, or is it another column?",
                equation.parameters()
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
            Self::Alike { equation: equation @ Equation::Link, condition } => write!(
                f,
                "{} cannot be told apart (condition {condition:.0}, at most {MOST_CONDITION}): one move does not do, \
                 record moves to and fro, and shake a stiff joint harder (commission --peak)",
                equation.parameters()
            ),
            Self::Alike { equation, condition } => write!(
                f,
                "{} cannot be told apart (condition {condition:.0}, at most {MOST_CONDITION}): a move alone does not \
                 do, add the multisine of `host-sim commission` to the current",
                equation.parameters()
            ),
            Self::Weak { equation, shaken_a, friction_a } => write!(
                f,
                "{} cannot be told: the current shakes the motor by {shaken_a:.2} A rms, and friction takes \
                {friction_a:.2} A of it: at \
                 least {LEAST_SHAKEN} times the friction are needed: give the multisine a larger peak, or the drive a \
                 slower loop for the record (drive.surface_rad_s)",
                equation.parameters()
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
                f.write_str(&unexplained_motor([*residual_steps, *most], *unexplained, [*peak_steps, *at_s]))
            }
            Self::Unsolved { equation, shaken_a } => write!(
                f,
                "{} cannot be told: least squares for the {equation} found no end in {MOST_STEPS} steps: no record of \
                 such a plant, or one that says too little: the current shakes it by {shaken_a:.2} A rms, and needs \
                 the multisine of \
                 `host-sim commission`, or a larger one (--peak){}",
                equation.parameters(),
                if *equation == Equation::Motor { "" } else { ", and encoders of about as many bits on both sides" }
            ),
            Self::NotPositive { name, value, cause } => {
                write!(f, "{name} = {value:.4} is not above 0{}", because(*cause))
            }
            Self::OutOfTolerance { name, change, tolerance, shaken_a } => write!(
                f,
                "{name} is {:+.0} % from the data sheet, at most {:.0} % are declared: correct the file (K_t and \
                inertia; \
                 or drive.period_s, whose square is in it, if the record has another), declare more with \
                 --tolerance, or, if the current was not shaken by a multisine ({shaken_a:.2} A rms are quick in \
                 it), record again with one",
                100.0 * change,
                100.0 * tolerance
            ),
            Self::Geared { name, ratio, gear, numbers } => write_geared(f, (name, *ratio, *gear), numbers),
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
