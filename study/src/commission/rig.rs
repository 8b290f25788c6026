//! Simulated stand: plant and drive of a scenario, commissioned in this process.

use controller_core::Health;
use loop_sim::actuator::Actuator;
use loop_sim::closed_loop::{Loop, LoopError, close_loop};
use loop_sim::plant::{Plant, Regime};
use loop_sim::port::drive::{DriveDesign, Goal, LivePort, Motion};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::sensor::Sensor;
use loop_sim::sensor::encoder::Mounted;
use loop_sim::signal::Signal;
use loop_sim::solver;
use loop_sim::trace::{Ending, Row};
use scenario::Experiment;

use super::{Leg, OnTicks, Shake, Stand, Stopped, turned};
use crate::identify::Record;
use crate::identify::record::unwrapped;

/// Plant with a later time and an additional current that the drive does not see.
struct Later<'a> {
    plant: &'a dyn Plant,
    from_s: f64,
    more: &'a Signal,
    jumps_s: Vec<f64>,
}

impl Plant for Later<'_> {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let t_s = t_s + self.from_s;
        self.plant.rhs(t_s, x, u + self.more.value(t_s), dx);
    }
    fn regime(&self, t_s: f64, x: &[f64], u: f64) -> Regime {
        let t_s = t_s + self.from_s;
        self.plant.regime(t_s, x, u + self.more.value(t_s))
    }
    fn rhs_in(&self, regime: Regime, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let t_s = t_s + self.from_s;
        self.plant.rhs_in(regime, t_s, x, u + self.more.value(t_s), dx);
    }
    fn margin(&self, regime: Regime, t_s: f64, x: &[f64], u: f64) -> f64 {
        let t_s = t_s + self.from_s;
        self.plant.margin(regime, t_s, x, u + self.more.value(t_s))
    }
    /// The lumped disturbance is not used here.
    fn lumped(&self, _: f64, _: &[f64], _: f64, d: &mut [f64]) {
        d.fill(0.0);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.plant.fastest_rad_s(t_s + self.from_s, x, u).max(self.more.fastest_rad_s())
    }
    fn driven(&self, x: &[f64], u: f64) -> f64 {
        self.plant.driven(x, u)
    }
    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

/// Drive with its multisine, and its recorded inputs and outputs.
struct Shaken {
    drive: Box<dyn LivePort>,
    /// First tick and values of the multisine.
    wave: (usize, Vec<f64>),
    counts: [Vec<f64>; 2],
    reference: Vec<f64>,
    held: Vec<f64>,
    health: Health,
}

impl ControllerPort for Shaken {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let mut tick = self.drive.tick(sample)?;
        let k = self.reference.len();
        for (counts, count) in self.counts.iter_mut().zip(sample) {
            counts.push(*count);
        }
        self.reference.push(self.drive.reference());
        self.health |= tick.health;
        let (first, wave) = &self.wave;
        // A drive that stopped or rejected its input gets no excitation.
        if let Some(more) = k.checked_sub(*first).and_then(|k| wave.get(k))
            && !tick.health.intersects(Health::STOPPED | Health::INPUT_REJECTED)
        {
            tick.u += more;
        }
        Ok(tick)
    }
    fn report_applied(&mut self, u: f64) {
        self.held.push(u);
        self.drive.report_applied(u);
    }
    fn reset(&mut self) -> Result<(), PortError> {
        self.drive.reset()
    }
    fn observed(&self) -> &[usize] {
        self.drive.observed()
    }
    fn follows(&self) -> Option<usize> {
        self.drive.follows()
    }
    fn reference(&self) -> f64 {
        self.drive.reference()
    }
}

/// Plant and drive of a scenario.
pub struct Rig<'a> {
    plant: &'a dyn Plant,
    sensor: &'a mut dyn Sensor,
    actuator: &'a mut dyn Actuator,
    more: Signal,
    port: Shaken,
    designed: DriveDesign,
    mounted: Vec<Mounted>,
    x: Vec<f64>,
    true_error: Vec<f64>,
    period_s: f64,
    /// Present rest position, rad.
    at_rad: f64,
    /// First tick of the current recording.
    from: usize,
    watch: &'a mut OnTicks<'a>,
}

impl<'a> Rig<'a> {
    /// Builds the stand of a scenario, with an unknown current `more` in addition to the held current.
    ///
    /// # Errors
    /// The scenario has no position drive, or its design is invalid.
    pub fn new(experiment: &'a mut Experiment, more: Signal, watch: &'a mut OnTicks<'a>) -> Result<Self, Stopped> {
        let Some(drive) = experiment.drive.as_ref().filter(|_| experiment.port.follows() == Some(0)) else {
            return Err(Stopped::Design("commissioning needs a position drive: [joint] or [motor]".into()));
        };
        let designed = drive.designed;
        let (period_s, at_rad) = (experiment.period_s, drive.motion.from_rad);
        let still = Motion::rest(at_rad, period_s);
        let live = designed.live(&still).map_err(|error| Stopped::Design(error.to_string()))?;
        let port = Shaken {
            drive: live,
            wave: (0, Vec::new()),
            counts: [const { Vec::new() }; 2],
            reference: Vec::new(),
            held: Vec::new(),
            health: Health::OK,
        };
        let mounted = designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        Ok(Self {
            plant: experiment.plant.as_ref(),
            sensor: experiment.sensor.as_mut(),
            actuator: experiment.actuator.as_mut(),
            more,
            port,
            designed,
            mounted,
            x: experiment.x0.clone(),
            true_error: Vec::new(),
            period_s,
            at_rad,
            from: 0,
            watch,
        })
    }

    fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.period_s).round() as usize
    }

    /// Returns the number of ticks so far.
    fn now(&self) -> usize {
        self.port.reference.len()
    }

    fn run(&mut self, ticks: usize) -> Result<(), Stopped> {
        if ticks == 0 {
            return Ok(());
        }
        let from_s = self.now() as f64 * self.period_s;
        let jumps_s = self.plant.jumps_s().iter().map(|jump| jump - from_s).filter(|jump| *jump > 0.0).collect();
        let later = Later { plant: self.plant, from_s, more: &self.more, jumps_s };
        let (mut last, mut held) = (self.x.clone(), 0.0);
        let broken = |error: LoopError| Stopped::Broken(error.to_string());
        let (watch, true_error) = (&mut *self.watch, &mut self.true_error);
        let setup = Loop {
            plant: &later,
            sensor: &mut *self.sensor,
            port: &mut self.port,
            actuator: &mut *self.actuator,
            report: true,
            missed: &[],
            x0: &self.x,
            period_s: self.period_s,
            periods: ticks - 1,
        };
        let mut see = |row: &Row| {
            let states = last.len();
            last.copy_from_slice(&row.x[..states]);
            held = row.u_held;
            true_error.push(row.x[0] - row.r);
            watch(1)
        };
        match close_loop(setup, &mut see).map_err(broken)? {
            Ending::Finished => {}
            Ending::Interrupted { .. } => return Err(Stopped::Interrupted),
            ending => return Err(Stopped::Broken(format!("the run ended early: {ending:?}"))),
        }
        // Up to the start of the next tick.
        let [from, to] = [ticks - 1, ticks].map(|k| k as f64 * self.period_s);
        solver::advance(&later, from, to, held, &mut last).map_err(|error| Stopped::Broken(error.to_string()))?;
        self.x = last;
        Ok(())
    }

    /// Returns the recording since the start of the leg.
    fn record(&self) -> Result<Record, Stopped> {
        let angle = |i: usize| {
            let counts = &self.port.counts[i];
            if let Some(k) = counts.iter().position(|count| count.is_nan()) {
                return Err(Stopped::Lost { at_s: k as f64 * self.period_s });
            }
            let mut angle = unwrapped(counts.iter().copied(), &self.mounted[i]);
            angle.rad.drain(..self.from);
            Ok(angle)
        };
        let first = angle(0)?;
        let (link, motor) = if self.mounted.len() > 1 { (Some(first), angle(1)?) } else { (None, first) };
        Ok(Record { period_s: self.period_s, link, motor, held_a: self.port.held[self.from..].to_vec() })
    }
}

impl Stand for Rig<'_> {
    fn designed(&self) -> DriveDesign {
        self.designed
    }

    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn at_rad(&self) -> f64 {
        self.at_rad
    }

    fn begin(&mut self, shake: Option<&Shake>, most_s: f64) -> Result<(), Stopped> {
        self.from = self.now();
        let wave = shake.map(|shake| shake.wave(self.ticks(most_s), self.period_s));
        self.port.wave = (self.from, wave.unwrap_or_default());
        Ok(())
    }

    fn end(&mut self) -> Result<Leg, Stopped> {
        self.port.wave.1.clear();
        let r = self.port.reference[self.from..].to_vec();
        let counts = self.port.counts[0][self.from..].iter().zip(&r);
        Ok(Leg {
            from_s: self.from as f64 * self.period_s,
            y: counts.map(|(count, r)| turned(self.mounted[0].upright(*count), *r, &self.mounted[0])).collect(),
            r,
            held_a: self.port.held[self.from..].to_vec(),
            record: self.record(),
            period_s: self.period_s,
            true_error: Some(self.true_error[self.from..].to_vec()),
            health: self.port.health,
        })
    }

    fn rest(&mut self, seconds: f64) -> Result<(), Stopped> {
        self.run(self.ticks(seconds))
    }

    fn go(&mut self, to_rad: f64, ticks: u32) -> Result<(), Stopped> {
        let start = self.now() as u32 + 1;
        let motion =
            Motion { goal: Goal::Rest { angle_rad: to_rad }, start, ticks, ..Motion::rest(self.at_rad, self.period_s) };
        self.port.drive.play(&motion);
        self.at_rad = to_rad;
        self.run((start + ticks) as usize - self.now())
    }

    fn swap(&mut self, to: &DriveDesign, at_rest: bool) -> Result<f64, Stopped> {
        self.port.drive.retune(to, at_rest).map_err(|error| Stopped::Design(error.to_string()))?;
        let at = self.now();
        self.run(1)?;
        Ok((self.port.held[at] - self.port.held[at.saturating_sub(1)]).abs())
    }
}
