//! What a drive is expected to make of the verification: the same move on the joint or motor as it was found, with the
//! friction that was found. Ticks alone leave an error, the larger the stiffer a joint is beside its period; of a motor
//! friction and counts leave most.

use std::ops::ControlFlow;

use loop_sim::actuator::{Delayed, Ideal, Limited};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Friction, Imperfections, Plant};
use loop_sim::port::drive::{DriveDesign, Goal, Motion};
use loop_sim::sensor::encoder::Encoders;
use loop_sim::trace::{Ending, Row};

use super::{AFTER_S, SETTLE_S};
use crate::identify::Sheet;

/// Friction at rest over that in motion: no record of a motion tells it, and it is what a move begins against. 1.2 to 2
/// of bearings and gears, and the bar of a move is for the worst of them.
const STICKS: f64 = 2.0;

/// A joint or motor as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    pub(super) sheet: Sheet,
    /// Of a joint.
    pub(super) spring_damping_n_m_s: f64,
    pub(super) friction_a: f64,
    /// Amplitude, A, and periods in a turn. Where its waves stand a move over some of them does not see.
    pub(super) cogging: Option<[f64; 2]>,
    pub(super) lag_s: f64,
}

impl Found {
    /// The plant, and its state at rest there.
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

    /// Largest abs(y - r) of a move from rest with this drive, rad; none where it comes to no end.
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
            // What runs away is no expectation.
            if error < 1.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let ended = close_loop(setup, &mut see).ok()?;
        (ended == Ending::Finished).then_some(peak)
    }
}
