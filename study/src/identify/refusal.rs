//! Reasons why a recording cannot support a design, and remedies.

use std::fmt;

use crate::number::significant;

use super::{
    LEAST_ALONE_S, LEAST_SHAKEN, LEAST_TRAVEL_STEPS, MOST_ALONE, MOST_CONDITION, MOST_PEAK, MOST_STEPS,
    MOST_UNEXPLAINED, MOST_UNEXPLAINED_ALONE, stands_out,
};

/// Equation that is fitted to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equation {
    /// Equation of the link of a joint.
    Link,
    /// Equation of the motor of a joint.
    MotorOfJoint,
    /// Equation of a motor with a rigid load.
    Motor,
}

impl Equation {
    /// Returns the symbols of its parameters.
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

/// Reason why a recording cannot support a design.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// A shaft hardly moves.
    Still {
        /// Shaft.
        shaft: Equation,
        /// Travel of the shaft, counts.
        steps: f64,
    },
    /// The current is constant.
    Steady {
        /// Equation of the motor.
        equation: Equation,
        /// Held current, A.
        held_a: f64,
    },
    /// The recording lacks the link count and is too short for this case.
    Short {
        /// Duration, s.
        seconds: f64,
    },
    /// The recording lacks the link count, and the link does not swing at its own frequency.
    Poor {
        /// Interval of k_1 as a share; infinite if k_1 has no effect.
        interval: f64,
        /// Frequency of the link with the motor held, from the data sheet, Hz.
        own_hz: f64,
    },
    /// The recording lacks the link count, and no link explains the current.
    NotTheSpring {
        /// Residual of the current, relative rms.
        unexplained: f64,
    },
    /// Two parameters have nearly the same effect.
    Alike {
        /// Equation of link or motor.
        equation: Equation,
        /// Condition number.
        condition: f64,
    },
    /// Friction is not small compared with the excitation.
    Weak {
        /// Equation of the motor.
        equation: Equation,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
        /// Coulomb friction f_c, A.
        friction_a: f64,
    },
    /// The link equation does not fit.
    NotTheJoint {
        /// Residual, counts rms.
        residual_steps: f64,
        /// Largest accepted residual, counts rms.
        most: f64,
        /// Wiring error that explains the residual.
        cause: Option<&'static str>,
    },
    /// The motor equation does not fit.
    NotTheMotor {
        /// Residual, counts rms.
        residual_steps: f64,
        /// Largest accepted residual, counts rms.
        most: f64,
        /// Residual as a share of the motion due to the current.
        unexplained: f64,
        /// Largest residual, counts.
        peak_steps: f64,
        /// Time of the largest residual from the start of the recording, s.
        at_s: f64,
    },
    /// The fit did not converge.
    Unsolved {
        /// Equation of link or motor.
        equation: Equation,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
    /// A parameter is not positive.
    NotPositive {
        /// Symbol of the parameter.
        name: &'static str,
        /// Identified value.
        value: f64,
        /// Wiring error that explains the sign.
        cause: Option<&'static str>,
    },
    /// A parameter is outside of the declared tolerance.
    OutOfTolerance {
        /// Symbol of the parameter.
        name: &'static str,
        /// Relative deviation from the data sheet.
        change: f64,
        /// Declared tolerance, as a share.
        tolerance: f64,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
    /// Numbers of the data sheet refer to the output of the gear.
    Geared {
        /// Symbol of the identified parameter.
        name: &'static str,
        /// Ratio of the identified value to the data sheet.
        ratio: f64,
        /// Gear ratio, motor turns per output turn.
        gear: f64,
        /// Keys, their correct values if known, and the divisors that lead to these values.
        numbers: Vec<(&'static str, Option<f64>, f64)>,
    },
    /// The interval is wider than the data sheet is uncertain.
    Vague {
        /// Symbol of the parameter.
        name: &'static str,
        /// Interval of the parameter, as a share.
        interval: f64,
        /// Largest usable interval, as a share.
        most: f64,
        /// Rms of the current around its mean over 0.2 s, A.
        shaken_a: f64,
    },
}

/// Returns the message of [`Refusal::Poor`].
fn poor(interval: f64, own_hz: f64) -> String {
    let to = if interval.is_finite() { format!("+-{:.0} %", 100.0 * interval) } else { String::from("unlimited") };
    format!(
        "k_1 not identifiable without the link encoder: interval {to} (limit {:.0} %). Excite the link near \
         {own_hz:.1} Hz: record moves to and fro that become shorter and faster, with the multisine, as `host-sim \
         commission --motor-alone` does, or record the link count",
        100.0 * MOST_ALONE
    )
}

/// Returns the message of [`Refusal::NotTheMotor`]: rms and limit in counts, share of the motion, peak and its time.
fn unexplained_motor([rms, most]: [f64; 2], share: f64, [peak, at_s]: [f64; 2]) -> String {
    if stands_out(peak, rms) {
        return format!(
            "motor model does not fit: outlier of {peak:.0} counts at {at_s:.3} s, residual {rms:.2} counts rms (ratio \
             {:.0}, limit {MOST_PEAK}). Possible causes: a count that jumped or froze, an end stop, an impact, a load \
             step. Cut the recording before or after it if 2 s with moves to and fro remain, or record again",
            peak / rms
        );
    }
    format!(
        "motor model does not fit: residual {rms:.2} counts rms (limit {most:.2}), {:.0} % of the motion due to the \
         current (limit {:.0} % for cogging, ripple and friction). Largest residual {peak:.0} counts at {at_s:.3} s. \
         Possible causes: a count that jumped, an end stop, a varying load, a recorded current that is late or is not \
         the held one, strong cogging (--cogging N)",
        100.0 * share,
        100.0 * MOST_UNEXPLAINED
    )
}

/// Writes which keys refer to the output of the gear, and their correct values.
fn write_geared(
    f: &mut fmt::Formatter<'_>,
    (name, ratio, gear): (&str, f64, f64),
    numbers: &[(&str, Option<f64>, f64)],
) -> fmt::Result {
    let four = |value: f64| significant(value, 4);
    // Short numbers such as 9 or 20.25.
    let short = |value: f64| (1e4 * value).round() / 1e4;
    write!(f, "{name} is {} times the data sheet value, which a gear of {} explains: ", four(ratio), short(gear))?;
    for (k, (key, own, divisor)) in numbers.iter().enumerate() {
        let (and, by) = (if k > 0 { ", and " } else { "" }, short(*divisor));
        let set = own.map_or_else(String::new, |own| format!(": set {key} = {}", four(own)));
        write!(f, "{and}{key} refers to the output of the gear, {by} times the motor value{set}")?;
    }
    f.write_str(". These keys refer to the motor shaft; if every number refers to the output, remove the gear")
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let because = |cause: Option<&str>| cause.map_or_else(String::new, |cause| format!(": {cause}"));
        match self {
            Self::Still { shaft, steps } => write!(
                f,
                "{} not identifiable: the {shaft} moves by {steps:.0} counts (at least {LEAST_TRAVEL_STEPS}). Record \
                 longer moves (commission --way), or check the column",
                shaft.parameters()
            ),
            Self::Steady { equation, held_a } => write!(
                f,
                "{} not identifiable: u_held_a is {held_a} A in all rows. Record the held current of each tick during \
                 moves to and fro with the multisine of `host-sim commission`, or check the column",
                equation.parameters()
            ),
            Self::Short { seconds } => write!(
                f,
                "{seconds} s without link counts: at least {LEAST_ALONE_S} s are needed. Record as `host-sim \
                 commission --motor-alone` does"
            ),
            Self::Poor { interval, own_hz } => f.write_str(&poor(*interval, *own_hz)),
            Self::NotTheSpring { unexplained } => write!(
                f,
                "spring model does not fit: {:.0} % of the current remain (rms, limit {:.0} %). Possible causes: end \
                 stop, backlash or friction at the link, a varying load, a recorded current that is not the held one",
                100.0 * unexplained,
                100.0 * MOST_UNEXPLAINED_ALONE
            ),
            Self::Alike { equation: equation @ Equation::Link, condition } => write!(
                f,
                "{} not separable (condition {condition:.0}, limit {MOST_CONDITION}): one move is not enough, record \
                 moves to and fro; for a stiff joint increase the excitation (commission --peak)",
                equation.parameters()
            ),
            Self::Alike { equation, condition } => write!(
                f,
                "{} not separable (condition {condition:.0}, limit {MOST_CONDITION}): a move alone is not enough, add \
                 the multisine of `host-sim commission` to the current",
                equation.parameters()
            ),
            Self::Weak { equation, shaken_a, friction_a } => write!(
                f,
                "{} not identifiable: excitation {shaken_a:.2} A rms, friction {friction_a:.2} A; the excitation must \
                 be at least {LEAST_SHAKEN} times the friction. Increase the peak of the multisine, or lower \
                 drive.surface_rad_s for the recording",
                equation.parameters()
            ),
            Self::NotTheJoint { residual_steps, most, cause: None } => write!(
                f,
                "link model does not fit: residual {residual_steps:.2} counts rms (limit {most:.2}). Possible causes: \
                 end stop, slip, backlash or friction at the link, a noisy encoder (--noise-steps)"
            ),
            Self::NotTheJoint { cause, .. } => {
                write!(f, "link model does not fit{}", because(*cause))
            }
            Self::NotTheMotor { residual_steps, most, unexplained, peak_steps, at_s } => {
                f.write_str(&unexplained_motor([*residual_steps, *most], *unexplained, [*peak_steps, *at_s]))
            }
            Self::Unsolved { equation, shaken_a } => write!(
                f,
                "{} not identifiable: the {equation} fit did not converge in {MOST_STEPS} iterations. The excitation \
                 is {shaken_a:.2} A rms: add the multisine of `host-sim commission`, or increase it (--peak). The \
                 recording may also be from another plant{}",
                equation.parameters(),
                if *equation == Equation::Motor { "" } else { "; use encoders of similar resolution" }
            ),
            Self::NotPositive { name, value, cause } => {
                write!(f, "{name} = {value:.4}: must be above 0{}", because(*cause))
            }
            Self::OutOfTolerance { name, change, tolerance, shaken_a } => write!(
                f,
                "{name} is {:+.0} % from the data sheet (limit {:.0} %). Correct the file (K_t, inertia, or \
                 drive.period_s, which enters squared), raise --tolerance, or record again with a multisine if the \
                 recording has none ({shaken_a:.2} A rms)",
                100.0 * change,
                100.0 * tolerance
            ),
            Self::Geared { name, ratio, gear, numbers } => write_geared(f, (name, *ratio, *gear), numbers),
            Self::Vague { name, interval, most, shaken_a } => write!(
                f,
                "{name} identified to +-{:.0} % only (limit {:.0} %) with an excitation of {shaken_a:.2} A rms. Add \
                 the multisine of `host-sim commission`, increase its peak, travel farther (--way), use a finer \
                 encoder, or keep the data sheet",
                100.0 * interval,
                100.0 * most
            ),
        }
    }
}

impl std::error::Error for Refusal {}
