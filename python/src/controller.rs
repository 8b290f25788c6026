//! The controller alone: samples or counts in, u out.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use controller_core::drive::{Sample, Target};
use loop_sim::port::drive::{AnyLaw, DriveDesign, Law, Ticked, target_at};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::sensor::encoder::Mounted;
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyList, PyTuple};

use crate::array::{self, Columns, Raw};
use crate::error::of_argument;
use crate::scenario::Text;

/// Ticks between two looks for a signal, some milliseconds.
const CHUNK: usize = 1 << 16;

/// Largest angle of a target, rad: its revolution is a number of 32 bits.
const MOST_RAD: f64 = std::f64::consts::TAU * 2_147_483_647.0;

/// Controller with `E` encoders and `N` numbers per target.
struct DriveTicks<const E: usize, const N: usize> {
    law: Box<dyn Law<E, N>>,
    mounted: [Mounted; E],
    /// Target at the begin of the coming tick; `None` before the first one.
    begin: Option<Target<f32, i32, N>>,
}

impl<const E: usize, const N: usize> DriveTicks<E, N> {
    fn of(law: Box<dyn Law<E, N>>, encoders: &[Mounted]) -> Option<Self> {
        Some(Self { law, mounted: encoders.try_into().ok()?, begin: None })
    }

    /// Runs a tick. The target belongs to its end; a tick begins where the last one ended.
    #[inline]
    fn tick(&mut self, counts: &[f64], jet: &[f64]) -> Result<Ticked<E>, PortError> {
        let end = target_at(jet);
        let begin = self.begin.replace(end).unwrap_or(end);
        let count = |i: usize| counts.get(i).and_then(|&count| self.mounted[i].upright(count));
        let counts = std::array::from_fn(count);
        self.law.tick(&Sample { counts, begin, end })
    }

    /// Sets the target at the begin of the coming tick.
    fn begin(&mut self, jet: &[f64]) {
        self.begin = Some(target_at(jet));
    }

    /// Returns the state of the controller, then the target: 1 if there is one, its revolution, its jet.
    fn state(&self) -> Vec<f64> {
        let mut state = self.law.state();
        let Target { turn, jet } = self.begin.unwrap_or(Target { turn: 0, jet: [0.0; N] });
        state.extend([f64::from(u8::from(self.begin.is_some())), f64::from(turn)]);
        state.extend(jet.map(f64::from));
        state
    }

    fn set_state(&mut self, state: &[f64]) -> bool {
        let Some((law, [has_target, turn, jet @ ..])) =
            state.len().checked_sub(2 + N).and_then(|at| state.split_at_checked(at))
        else {
            return false;
        };
        let begin = Target { turn: *turn as i32, jet: std::array::from_fn(|j| jet[j] as f32) };
        let is_ours = self.law.set_state(law);
        if is_ours {
            self.begin = (*has_target == 1.0).then_some(begin);
        }
        is_ours
    }
}

/// Returns the outputs of a drive in the form of any controller.
fn any<const E: usize>((output, disturbance): Ticked<E>) -> Tick {
    let mut estimates = <[[f64; 3]; 6]>::default();
    for (i, d) in disturbance.into_iter().enumerate() {
        estimates[2 * i + 1][0] = f64::from(d);
    }
    let [u, sigma, sigma_star] = [output.u, output.sigma, output.sigma_star].map(f64::from);
    Tick { u, sigma, sigma_star, estimates, health: output.health }
}

/// Controller of any kind.
enum Inner {
    Chain(Box<dyn ControllerPort>, usize),
    Motor(DriveTicks<1, 2>),
    Joint(DriveTicks<2, 4>),
}

/// Evaluates an expression for a drive of either kind, or another one for a chain.
macro_rules! each {
    ($inner:expr, $port:ident => $of_chain:expr, $drive:ident => $of_drive:expr) => {
        match $inner {
            Inner::Chain($port, _) => $of_chain,
            Inner::Motor($drive) => $of_drive,
            Inner::Joint($drive) => $of_drive,
        }
    };
}

impl Inner {
    /// Returns the number of inputs, and the largest number of entries of a target.
    const fn sizes(&self) -> (usize, usize) {
        match self {
            Self::Chain(_, order) => (*order, 0),
            Self::Motor(_) => (1, 2),
            Self::Joint(_) => (2, 4),
        }
    }

    fn tick(&mut self, sample: &[f64], target: &[f64]) -> Result<Tick, PortError> {
        each!(self, port => port.tick(sample), drive => drive.tick(sample, target).map(any))
    }

    fn begin(&mut self, target: &[f64]) {
        each!(self, _port => (), drive => drive.begin(target));
    }

    /// Returns a count that is not a whole number of 32 bits, or a target that no drive takes.
    fn unfit(&self, sample: &[f64], target: &[f64]) -> Option<(&'static str, f64)> {
        if matches!(self, Self::Chain(..)) {
            return None;
        }
        let is_count = |count: &f64| count.is_nan() || (count.fract() == 0.0 && count.abs() < 4_294_967_296.0);
        let count = sample.iter().find(|count| !is_count(count)).map(|count| ("sample", *count));
        // The target has its revolution as an i32 and its rates as f32.
        let is_target = |(j, it): &(usize, &f64)| it.abs() < if *j == 0 { MOST_RAD } else { f64::from(f32::MAX) };
        count.or_else(|| target.iter().enumerate().find(|it| !is_target(it)).map(|(_, it)| ("target", *it)))
    }

    fn state(&self) -> Vec<f64> {
        each!(self, port => port.state(), drive => drive.state())
    }

    fn set_state(&mut self, state: &[f64]) -> bool {
        each!(self, port => port.set_state(state), drive => drive.set_state(state))
    }
}

/// The controller alone: the tick that runs on the chip, with the bits of the chip.
///
/// A chain takes its state x, n numbers. A motor takes a count, a joint the counts of link and motor; `None` or NaN is
/// a lost count. A drive also takes a target: the angle (in speed control the speed) at the end of the tick, or the
/// angle and its derivatives, rad and s. A target without derivatives is a step of them: give the speed in motion. A
/// tick begins at the target of the tick before it, the first one at the target of `begin`, else at its own.
///
/// The tick of a drive has monitors, as `edo_smc_watched_tick` in C: after an alarm it brakes or stops until `reset`.
///
/// The first valid sample starts the controller at once, as in a simulation.
#[pyclass(frozen, module = "edo_smc")]
pub(crate) struct Controller {
    text: Arc<Text>,
    encoders: Vec<Mounted>,
    period_s: f64,
    is_speed: bool,
    initial: Vec<f64>,
    inner: Mutex<(Inner, Option<Tick>)>,
}

/// Refuses a count or a target that no drive takes.
fn refuse_unfit(unfit: Option<(&str, f64)>) -> PyResult<()> {
    let Some((name, value)) = unfit else { return Ok(()) };
    let expected = if name == "sample" {
        "expected a count, a whole number of up to 32 bits; None is a lost count"
    } else {
        "expected a finite number; an angle has at most 2^31 - 1 revolutions"
    };
    Err(of_argument(name, &format!("found {value}"), expected))
}

fn broken(error: &PortError) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Numbers of one tick, without allocation.
#[derive(Clone, Copy)]
struct Few {
    numbers: [f64; 6],
    count: usize,
}

impl Few {
    const NONE: Self = Self { numbers: [0.0; 6], count: 0 };

    fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let is_plain = is_number(value) || value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
        if !is_plain && let Some(tolist) = value.getattr_opt(intern!(value.py(), "tolist"))? {
            // The numbers of an array as a list, or the number of a scalar: faster than one by one.
            return Self::of_plain(&tolist.call0()?);
        }
        Self::of_plain(value)
    }

    fn of_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut few = Self::NONE;
        if is_number(value) || value.is_none() {
            few.push(value)?;
        } else if let Ok(list) = value.cast::<PyList>() {
            list.iter().try_for_each(|item| few.push(&item))?;
        } else if let Ok(tuple) = value.cast::<PyTuple>() {
            tuple.iter_borrowed().try_for_each(|item| few.push(&item))?;
        } else {
            value.try_iter()?.try_for_each(|item| few.push(&item?))?;
        }
        Ok(few)
    }

    /// Adds a number; `None` is NaN.
    fn push(&mut self, item: &Bound<'_, PyAny>) -> PyResult<()> {
        let place = self.numbers.get_mut(self.count);
        *place.ok_or_else(|| PyValueError::new_err("more than 6 numbers for one tick"))? =
            if item.is_none() { f64::NAN } else { item.extract()? };
        self.count += 1;
        Ok(())
    }

    /// Reads the numbers of one tick out of an array.
    fn read(raw: &[Raw]) -> Self {
        let mut few = Self { count: raw.len(), ..Self::NONE };
        few.numbers.iter_mut().zip(raw).for_each(|(to, raw)| *to = f64::from_ne_bytes(*raw));
        few
    }

    fn numbers(&self) -> &[f64] {
        &self.numbers[..self.count]
    }
}

fn is_number(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>()
}

/// Returns the number of rows of an array (rows, K), or of a row alone, and its columns.
fn columns<'py>(
    array: &Bound<'py, PyAny>,
    name: &str,
    rows: std::ops::RangeInclusive<usize>,
) -> PyResult<(usize, Columns<'py>)> {
    let shaped = |found: String| {
        let (least, most) = (rows.start(), rows.end());
        let wanted = if least == most { format!("({most}, K)") } else { format!("({least} to {most}, K)") };
        of_argument(name, &format!("found shape {found}"), &format!("expected {wanted}, time last"))
    };
    let columns = Columns::of(array)?;
    let count = match columns.shape[..] {
        [_] => 1,
        [count, _] => count,
        _ => 0,
    };
    if rows.contains(&count) { Ok((count, columns)) } else { Err(shaped(format!("{:?}", columns.shape))) }
}

impl Controller {
    /// Designs the controller of a scenario.
    pub(crate) fn of(text: Arc<Text>) -> PyResult<Self> {
        let experiment = text.experiment().map_err(|error| text.told(&error))?;
        let designed = experiment.drive.as_ref().map(|drive| drive.designed);
        let encoders: Vec<Mounted> =
            designed.iter().flat_map(DriveDesign::encoders).map(|(_, mounted)| mounted).collect();
        let order = experiment.plant.order();
        let inner = match &designed {
            None => Some(Inner::Chain(experiment.port, order)),
            Some(designed) => match designed.law().map_err(|error| PyValueError::new_err(error.to_string()))? {
                AnyLaw::Motor(law) => DriveTicks::of(law, &encoders).map(Inner::Motor),
                AnyLaw::Joint(law) => DriveTicks::of(law, &encoders).map(Inner::Joint),
            },
        };
        let inner = inner.ok_or_else(|| PyRuntimeError::new_err("a drive has as many encoders as its law"))?;
        let is_speed = designed.is_some_and(|it| it.form().follows == loop_sim::port::drive::Follows::Speed);
        let (period_s, initial) = (experiment.period_s, inner.state());
        Ok(Self { text, encoders, period_s, is_speed, initial, inner: Mutex::new((inner, None)) })
    }

    fn lock(&self) -> MutexGuard<'_, (Inner, Option<Tick>)> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the jet of a target: in speed control a number alone is the speed.
    fn jet(&self, target: Few) -> Few {
        if self.is_speed && target.count == 1 { of_speed(target) } else { target }
    }

    fn encoder(&self, index: usize) -> PyResult<&Mounted> {
        let remedy = format!("expected a number below {}, the number of encoders", self.encoders.len());
        self.encoders.get(index).ok_or_else(|| of_argument("encoder", &index.to_string(), &remedy))
    }
}

/// Outputs of many ticks: u, and on request all of them.
struct Outputs {
    u: Vec<f64>,
    all: Option<Rows>,
}

/// Outputs of many ticks as rows over time.
struct Rows {
    sigma: Vec<f64>,
    sigma_star: Vec<f64>,
    health: Vec<u32>,
    d_hat: Vec<Vec<f64>>,
    last: Option<Tick>,
}

impl Rows {
    fn of(channels: usize) -> Self {
        let [sigma, sigma_star] = [Vec::new(), Vec::new()];
        Self { sigma, sigma_star, health: Vec::new(), d_hat: vec![Vec::new(); channels], last: None }
    }

    fn push(&mut self, tick: Tick) {
        self.sigma.push(tick.sigma);
        self.sigma_star.push(tick.sigma_star);
        self.health.push(u32::from(tick.health.bits()));
        self.d_hat.iter_mut().zip(&tick.estimates).for_each(|(row, d_hat)| row.push(d_hat[0]));
        self.last = Some(tick);
    }
}

/// Samples and targets of many ticks.
struct Series<'a> {
    samples: &'a [Raw],
    targets: &'a [Raw],
    /// Numbers of one tick.
    per_sample: usize,
    per_target: usize,
    /// True if the targets are speeds alone.
    are_speeds: bool,
}

impl Series<'_> {
    /// Returns sample and target of a tick.
    fn at(&self, k: usize) -> [Few; 2] {
        let Self { samples, targets, per_sample, per_target, are_speeds } = *self;
        let sample = Few::read(&samples[k * per_sample..][..per_sample]);
        let target = Few::read(&targets[k * per_target..][..per_target]);
        [sample, if are_speeds { of_speed(target) } else { target }]
    }

    /// Runs some ticks. `u` and `any` convert the output of a tick.
    fn run<T: Copy>(
        &self,
        ticks: Range<usize>,
        out: &mut Outputs,
        mut tick: impl FnMut(&[f64], &[f64]) -> Result<T, PortError>,
        u: impl Fn(&T) -> f64,
        any: impl Fn(T) -> Tick,
    ) -> Result<(), PortError> {
        for k in ticks {
            let [sample, target] = self.at(k);
            let ticked = tick(sample.numbers(), target.numbers())?;
            out.u.push(u(&ticked));
            if let Some(all) = &mut out.all {
                all.push(any(ticked));
            }
        }
        Ok(())
    }
}

/// Returns the target of a speed alone.
const fn of_speed(target: Few) -> Few {
    let mut jet = Few { count: 2, ..Few::NONE };
    jet.numbers[1] = target.numbers[0];
    jet
}

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (text, file, name, sets, has_places, state = None))]
    fn new(
        text: String,
        file: String,
        name: String,
        sets: Vec<String>,
        has_places: bool,
        state: Option<Vec<f64>>,
    ) -> PyResult<Self> {
        let it = Self::of(Arc::new(Text { toml: text, file, name, sets, has_places }))?;
        if let Some(state) = state
            && !it.lock().0.set_state(&state)
        {
            return Err(PyValueError::new_err("the state does not belong to this controller"));
        }
        Ok(it)
    }

    /// Sampling period, s.
    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Runs one tick and returns u. `target` is for a drive only.
    #[pyo3(signature = (sample, target = None))]
    fn tick(&self, sample: &Bound<'_, PyAny>, target: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        let sample = Few::of(sample)?;
        let jet = target.map_or(Ok(Few::NONE), Few::of).map(|target| self.jet(target))?;
        let mut inner = self.lock();
        let (inputs, jets) = inner.0.sizes();
        if sample.count != inputs {
            let cause = format!("found {} numbers", sample.count);
            return Err(of_argument("sample", &cause, &format!("expected {inputs}")));
        }
        if jet.count > jets || (jets > 0 && jet.count == 0) {
            let remedy = if jets == 0 { "a chain has no target".into() } else { format!("expected 1 to {jets}") };
            return Err(of_argument("target", &format!("found {} numbers", jet.count), &remedy));
        }
        refuse_unfit(inner.0.unfit(sample.numbers(), jet.numbers()))?;
        let tick = inner.0.tick(sample.numbers(), jet.numbers()).map_err(|error| broken(&error))?;
        inner.1 = Some(tick);
        Ok(tick.u)
    }

    /// Runs K ticks and returns u, shape (K,).
    ///
    /// `samples` has the shape (n, K) for a chain, (K,) for a motor and (2, K) for a joint. `targets` has the shape
    /// (K,) or (J, K) with the angle and up to 1 (motor) or 3 (joint) derivatives. With `full=True` the result is a
    /// dictionary of `u`, `sigma`, `sigma_star`, `health` and `d_hat`, shape (n, K).
    #[pyo3(signature = (samples, targets = None, *, full = false))]
    fn ticks<'py>(
        &self,
        py: Python<'py>,
        samples: &Bound<'py, PyAny>,
        targets: Option<&Bound<'py, PyAny>>,
        full: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (inputs, jets) = self.lock().0.sizes();
        let (_, samples) = columns(samples, "samples", inputs..=inputs)?;
        let ticks = samples.raw().len() / inputs;
        let (rows, targets) = match targets {
            Some(targets) if jets > 0 => columns(targets, "targets", 1..=jets).map(|(rows, it)| (rows, Some(it)))?,
            None if jets == 0 => (0, None),
            _ => return Err(PyTypeError::new_err("a drive needs targets, a chain has none")),
        };
        let targets = targets.as_ref().map_or(&[][..], Columns::raw);
        if targets.len() != rows * ticks {
            let cause = format!("found {} ticks", targets.len() / rows);
            return Err(of_argument("targets", &cause, &format!("expected {ticks}, as many as samples")));
        }
        let are_speeds = self.is_speed && rows == 1;
        let given = Series { samples: samples.raw(), targets, per_sample: inputs, per_target: rows, are_speeds };
        let unfit = {
            let inner = self.lock();
            (0..ticks).map(|k| given.at(k)).find_map(|[sample, jet]| inner.0.unfit(sample.numbers(), jet.numbers()))
        };
        refuse_unfit(unfit)?;
        let channels = if jets > 0 { 2 * inputs } else { inputs };
        let mut out = Outputs { u: Vec::with_capacity(ticks), all: full.then(|| Rows::of(channels)) };
        for from in (0..ticks).step_by(CHUNK) {
            let chunk = from..ticks.min(from + CHUNK);
            let done = py.detach(|| {
                let out = &mut out;
                each!(&mut self.lock().0,
                    port => given.run(chunk, out, |sample, _| port.tick(sample), |it| it.u, |it| it),
                    drive => given.run(chunk, out, |x, r| drive.tick(x, r), |it| f64::from(it.0.u), any))
            });
            done.map_err(|error| broken(&error))?;
            py.check_signals()?;
        }
        let u = array::floats(py, out.u, &[ticks])?;
        let Some(Rows { sigma, sigma_star, health, d_hat, last }) = out.all else { return Ok(u) };
        self.lock().1 = last;
        let result = PyDict::new(py);
        result.set_item("u", u)?;
        result.set_item("sigma", array::floats(py, sigma, &[ticks])?)?;
        result.set_item("sigma_star", array::floats(py, sigma_star, &[ticks])?)?;
        result.set_item("health", array::flags(py, health.into_iter())?)?;
        result.set_item("d_hat", array::floats(py, d_hat.into_iter().flatten(), &[channels, ticks])?)?;
        Ok(result.into_any())
    }

    /// Outputs of the last tick: `u`, `sigma`, `sigma_star`, `health`, `d_hat`; `None` before the first tick.
    #[getter]
    fn output<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let (tick, (inputs, jets)) = {
            let inner = self.lock();
            (inner.1, inner.0.sizes())
        };
        let Some(Tick { u, sigma, sigma_star, estimates, health }) = tick else { return Ok(None) };
        let output = PyDict::new(py);
        for (name, value) in [("u", u), ("sigma", sigma), ("sigma_star", sigma_star)] {
            output.set_item(name, value)?;
        }
        output.set_item("health", health.bits())?;
        let channels = if jets > 0 { 2 * inputs } else { inputs };
        output.set_item("d_hat", array::floats(py, estimates.iter().take(channels).map(|row| row[0]), &[channels])?)?;
        Ok(Some(output))
    }

    /// Sets the target at the begin of the first tick, for a drive: `begin(scenario.reference()[:, 0])`.
    fn begin(&self, target: &Bound<'_, PyAny>) -> PyResult<()> {
        let jet = self.jet(Few::of(target)?);
        let mut inner = self.lock();
        let (_, jets) = inner.0.sizes();
        if jet.count == 0 || jet.count > jets {
            let remedy = if jets == 0 { "a chain has no target".into() } else { format!("expected 1 to {jets}") };
            return Err(of_argument("target", &format!("found {} numbers", jet.count), &remedy));
        }
        refuse_unfit(inner.0.unfit(&[], jet.numbers()))?;
        inner.0.begin(jet.numbers());
        Ok(())
    }

    /// Reports the u that the actuator holds since the last tick, if it differs from the output of the tick.
    fn applied(&self, u: f64) {
        each!(&mut self.lock().0, port => port.report_applied(u), drive => drive.law.report_applied(u as f32));
    }

    /// Reports, before the next tick, that `periods` periods have passed without a tick while u was held.
    fn missed(&self, periods: i64) -> PyResult<()> {
        let periods = u32::try_from(periods)
            .map_err(|_| of_argument("periods", &format!("found {periods}"), "expected a number from 0"))?;
        each!(&mut self.lock().0, port => port.missed(periods), drive => drive.law.missed(periods));
        Ok(())
    }

    /// Erases the state. The next valid sample starts the controller.
    fn reset(&self) {
        let mut inner = self.lock();
        inner.0.set_state(&self.initial);
        inner.1 = None;
    }

    /// State of the controller, shape (S,), exact to the bit. The first number is 1 after the start, else 0. Then
    /// follow the numbers of the tick, of the rest band, and of the last target.
    #[getter]
    fn get_state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array::floats(py, self.lock().0.state(), &[self.initial.len()])
    }

    #[setter]
    fn set_state(&self, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state: Vec<f64> = Columns::of(state)?.numbers().collect();
        let mut inner = self.lock();
        if inner.0.set_state(&state) {
            inner.1 = None;
            return Ok(());
        }
        let remedy = format!("expected the {} numbers that `state` of this controller returns", self.initial.len());
        let cause = match state.iter().position(|it| !it.is_finite()) {
            _ if state.len() != self.initial.len() => format!("found {} numbers", state.len()),
            Some(k) => format!("found {} at index {k}", state[k]),
            None => "found numbers that no state of this controller has".into(),
        };
        Err(of_argument("state", &cause, &remedy))
    }

    /// Returns the count of an encoder at this angle, rad, with its sign and offset: a whole number. It wraps as the
    /// counter of the encoder.
    #[pyo3(signature = (angle_rad, encoder = 0))]
    fn count(&self, angle_rad: f64, encoder: usize) -> PyResult<i64> {
        if !angle_rad.is_finite() {
            let remedy = "expected a finite angle; a lost count is None or NaN, in place of a count";
            return Err(of_argument("angle_rad", &format!("found {angle_rad}"), remedy));
        }
        Ok(self.encoder(encoder)?.count(angle_rad) as i64)
    }

    /// Returns the counts of an encoder at these angles, shape (K,). An angle of NaN gives NaN, a lost count for
    /// `ticks`.
    #[pyo3(signature = (angles_rad, encoder = 0))]
    fn counts<'py>(
        &self,
        py: Python<'py>,
        angles_rad: &Bound<'py, PyAny>,
        encoder: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mounted = self.encoder(encoder)?;
        let angles = Columns::of(angles_rad)?;
        if let Some(infinite) = angles.numbers().find(|angle| angle.is_infinite()) {
            let remedy = "expected finite angles; NaN is a lost count";
            return Err(of_argument("angles_rad", &format!("found {infinite}"), remedy));
        }
        array::floats(py, angles.numbers().map(|angle| mounted.count(angle)), &[angles.raw().len()])
    }

    fn __copy__(&self) -> PyResult<Self> {
        let it = Self::of(self.text.clone())?;
        it.lock().0.set_state(&self.lock().0.state());
        Ok(it)
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.__copy__()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let Text { toml: text, file, name, sets, has_places } = slf.get().text.as_ref().clone();
        let state = slf.get().lock().0.state();
        let arguments = (text, file, name, sets, has_places, state).into_pyobject(slf.py())?;
        Ok((slf.get_type().into_any(), arguments))
    }

    fn __repr__(&self) -> String {
        let (inputs, jets) = self.lock().0.sizes();
        let counts = if inputs == 1 { "a count" } else { "counts of link and motor" };
        let takes = if jets > 0 { format!("{counts} and a target") } else { format!("x of {inputs} numbers") };
        format!("Controller({takes}, period_s={})", self.period_s)
    }
}
