//! Our drive as one of those that are compared: its bandwidths are what may be chosen.

use controller_core::drive::{JointBandwidths, MotorBandwidths};
use loop_sim::port::ControllerPort;
use loop_sim::port::drive::{DriveDesign, Form};
use loop_sim::port::finer::Finer;

use super::linear::Linear;
use super::task::Task;
use super::{Contender, Design, Knob};

/// The drive of the file with one gain set, or two.
pub(super) struct Ours {
    pub(super) designed: DriveDesign,
    pub(super) gain_sets: usize,
}

const fn knob(name: &'static str, low: f64, high: f64, guess: f64) -> Knob {
    Knob { name, low, high, guess }
}

impl Ours {
    /// The drive with these knobs.
    pub(super) fn designed(&self, knobs: &[f64]) -> Option<DriveDesign> {
        let gain_sets = self.gain_sets;
        Some(match self.designed {
            DriveDesign::Joint { design, form, mounted, monitors, sudden_load_n_m } => {
                let &[w, link, motor, reaching, ref fast @ ..] = knobs else { return None };
                let t = design.period_s;
                let most = if form.delay_ticks == 0 { 0.8 } else { 0.5 } / t;
                let link_rad_s = (link * w).min(0.25 / t);
                let bandwidths = JointBandwidths {
                    surface_rad_s: w,
                    link_rad_s,
                    motor_rad_s: (motor * link_rad_s).min(most),
                    reaching_per_s: (reaching * w).min(0.3 / t),
                    offset_per_s: 0.5 * w,
                };
                let load_n_m = design.limits.max * design.joint.torque_n_m_per_a;
                let mut design = design.with_bandwidths(bandwidths, load_n_m);
                if let &[link, motor] = fast {
                    design.fast_ratios = [link, motor];
                }
                DriveDesign::Joint { design, form: Form { gain_sets, ..form }, mounted, monitors, sudden_load_n_m }
            }
            DriveDesign::Motor { design, form, mounted, monitors } => {
                let &[w, observer, reaching, ref fast @ ..] = knobs else { return None };
                let t = design.period_s;
                let most = if form.delay_ticks == 0 { 0.8 } else { 0.5 } / t;
                let observer_rad_s = (observer * w).min(most);
                let mut design = design.with_bandwidths(MotorBandwidths {
                    surface_rad_s: w,
                    observer_rad_s,
                    reaching_per_s: (reaching * w).min(1.0 / t),
                    offset_per_s: 0.5 * w,
                });
                if let &[ratio] = fast {
                    design.fast_ratio = ratio;
                }
                DriveDesign::Motor { design, form: Form { gain_sets, ..form }, mounted, monitors }
            }
        })
    }
}

impl Contender for Ours {
    fn name(&self) -> &'static str {
        if self.gain_sets > 1 { "ours, two gain sets" } else { "ours, one gain set" }
    }

    /// Ratios, within what the design allows.
    fn knobs(&self) -> Vec<Knob> {
        let (mut knobs, fast): (_, &[Knob]) = match &self.designed {
            DriveDesign::Joint { design, .. } => {
                let slow = design.bandwidths.surface_rad_s;
                let own = vec![
                    knob("surface (rad/s)", slow / 8.0, slow * 8.0, slow),
                    knob("link/surface", 3.0, 10.0, 4.0),
                    knob("motor/link", 3.5, 14.0, 6.25),
                    knob("reaching/surface", 2.0, 8.0, 5.0),
                ];
                (own, &[knob("link fast/quiet", 1.0, 4.0, 3.0), knob("motor fast/quiet", 1.0, 4.0, 1.5)])
            }
            DriveDesign::Motor { design, .. } => {
                let slow = design.bandwidths.surface_rad_s;
                let own = vec![
                    knob("surface (rad/s)", slow / 8.0, slow * 8.0, slow),
                    knob("observer/surface", 0.5, 12.0, 1.5),
                    knob("reaching/surface", 1.0, 30.0, 8.0),
                ];
                (own, &[knob("fast/quiet", 1.0, 4.0, 2.0)])
            }
        };
        if self.gain_sets > 1 {
            knobs.extend(fast);
        }
        knobs
    }

    fn design(&self, knobs: &[f64]) -> Option<Box<dyn Design>> {
        Some(Box::new(Chosen::new(&self.designed(knobs)?)?))
    }
}

/// Our drive with its knobs set.
pub(super) struct Chosen {
    designed: DriveDesign,
    quiet: Linear,
}

impl Chosen {
    /// None for a design that is refused.
    pub(super) fn new(designed: &DriveDesign) -> Option<Self> {
        Some(Self { quiet: Linear::of_ours(designed)?, designed: *designed })
    }
}

impl Design for Chosen {
    fn port(&self, task: &Task) -> Option<Box<dyn ControllerPort>> {
        let designed = if task.is_fine { Finer::of(&self.designed)?.designed } else { self.designed };
        designed.port(&task.motion).ok()
    }

    /// The quiet set for any error up to 50 %; the fast one, frozen, up to the 20 % for which there are two.
    fn linear(&self) -> Vec<(Linear, f64)> {
        let quiet = (self.quiet.clone(), 0.5);
        let fast = match self.designed {
            DriveDesign::Joint { mut design, form, mounted, monitors, sudden_load_n_m } if form.gain_sets > 1 => {
                let [link, motor] = design.fast_ratios;
                design.bandwidths.link_rad_s *= link;
                design.bandwidths.motor_rad_s *= motor;
                DriveDesign::Joint { design, form, mounted, monitors, sudden_load_n_m }
            }
            DriveDesign::Motor { mut design, form, mounted, monitors } if form.gain_sets > 1 => {
                design.bandwidths.observer_rad_s *= design.fast_ratio;
                DriveDesign::Motor { design, form, mounted, monitors }
            }
            _ => return vec![quiet],
        };
        // A set beyond what a design of its own may be is not left out: it counts as that which may.
        vec![quiet].into_iter().chain(Linear::of_ours(&fast).map(|fast| (fast, 0.2))).collect()
    }
}
