//! Predicted peak of the verification: this move simulated on the identified joint or motor with the identified
//! friction. Sampling alone leaves an error, which grows with the stiffness of the joint relative to the period. For a
//! motor friction and quantisation dominate.

use std::ops::ControlFlow;

use loop_sim::actuator::{Delayed, Ideal, Limited};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Friction, Imperfections, Plant};
use loop_sim::port::drive::{DriveDesign, Goal, Motion};
use loop_sim::sensor::encoder::Encoders;
use loop_sim::trace::{Ending, Row};

use super::{AFTER_S, SETTLE_S};
use crate::identify::Sheet;

/// Ratio of static to Coulomb friction. Static friction cannot be identified from motion, but acts at the start of a
/// move. Bearings and gears have 1.2 to 2; the threshold of a move uses the largest value.
const STICKS: f64 = 2.0;

/// Identified joint or motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    pub(super) sheet: Sheet,
    /// Damping of the spring of a joint, N m s/rad.
    pub(super) spring_damping_n_m_s: f64,
    pub(super) friction_a: f64,
    /// Cogging amplitude, A, and periods per turn. The phase has no effect on a move over several periods.
    pub(super) cogging: Option<[f64; 2]>,
    pub(super) lag_s: f64,
}

impl Found {
    /// Returns the plant and its state at rest at this angle.
    fn at_rest(&self, at_rad: f64) -> (Box<dyn Plant>, Vec<f64>) {
        let Self { sheet, spring_damping_n_m_s, friction_a, cogging, lag_s } = *self;
        let [cogging_a, cogging_per_turn] = cogging.unwrap_or_default();
        let imperfections = |torque_n_m_per_a: f64| {
            let torque = friction_a.max(0.0) * torque_n_m_per_a;
            let friction = Friction { static_n_m: STICKS * torque, coulomb_n_m: torque, ..Friction::default() };
            let cogging_n_m = cogging_a * torque_n_m_per_a;
            Imperfections { friction, lag_s, cogging_n_m, cogging_per_turn, ..Imperfections::default() }
        };
        let plant = sheet.plant(spring_damping_n_m_s, imperfections(sheet.torque_n_m_per_a()));
        let mut x = vec![0.0; plant.order()];
        x[0] = at_rad;
        if let Sheet::Joint(joint) = sheet {
            // The spring carries the weight.
            x[2] = at_rad + joint.weight_n_m * libm::sin(at_rad) / joint.stiffness_n_m;
        }
        (plant, x)
    }

    /// Returns the largest abs(y - r) of a move from rest with this drive, rad; `None` if the simulation fails.
    pub(super) fn peak_rad(&self, designed: &DriveDesign, [from_rad, to_rad]: [f64; 2], ticks: u32) -> Option<f64> {
        let period_s = designed.period_s();
        let [start, after] = [SETTLE_S, AFTER_S].map(|seconds| (seconds / period_s).round() as u32);
        let motion =
            Motion { goal: Goal::Rest { angle_rad: to_rad }, start, ticks, ..Motion::rest(from_rad, period_s) };
        let mut port = designed.port(&motion).ok()?;
        let ((plant, x0), limit, mounted) = (self.at_rest(from_rad), designed.max_current_a(), designed.encoders());
        let setup = Loop {
            plant: plant.as_ref(),
            sensor: &mut Encoders::new(mounted),
            port: port.as_mut(),
            actuator: &mut Limited::new(Delayed::new(Ideal, designed.form().delay_ticks), -limit, limit),
            report: true,
            missed: &[],
            x0: &x0,
            period_s,
            periods: (start + ticks + after) as usize,
        };
        let (from_s, mut peak) = (f64::from(start) * period_s, 0.0_f64);
        let mut see = |row: &Row| {
            let error = (row.x[0] - row.r).abs();
            if row.t_s >= from_s {
                peak = peak.max(error);
            }
            // A run that diverges is not a prediction.
            if error < 1.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let ended = close_loop(setup, &mut see).ok()?;
        (ended == Ending::Finished).then_some(peak)
    }
}
