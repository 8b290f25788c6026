//! Properties that users depend on. A run without a recorder allocates nothing. Every stage can move to another thread.
//! A reset port equals a new one. A recorder gets every row.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::ControlFlow;
use std::thread;

use controller_core::{
    Config, Health, JointParameters, Limits, Nominal, ObserverGains, Options, ReachingLaw, Reading, Surface,
};
use loop_sim::actuator::{self, Actuator};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Benchmark, Chain, FlexibleJoint, LastChannel, Plant};
use loop_sim::port::baseline::{Baseline, BaselineSpec};
use loop_sim::port::compared::Compared;
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, build};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::sensor::{self, Sensor};
use loop_sim::signal::{Signal, Term};
use loop_sim::trace::{Ending, Recorder, Row, Trace};

/// System allocator that counts the allocations of each thread.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

#[global_allocator]
static MEMORY: Counting = Counting;

// SAFETY: every call is passed to the system allocator unchanged. A `Cell` without a destructor needs no memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller upholds the contract of the allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller upholds the contract of the allocator.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller upholds the contract of the allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

const fn moves<T: Send + ?Sized>() {}

/// Compiles only if all stages are `Send`.
const _: () = {
    moves::<dyn Plant>();
    moves::<dyn Sensor>();
    moves::<dyn Actuator>();
    moves::<dyn ControllerPort>();
    moves::<Loop<'_>>();
};

/// Owned stages of one loop.
struct Stages {
    plant: Box<dyn Plant>,
    sensor: Box<dyn Sensor>,
    port: Box<dyn ControllerPort>,
    actuator: Box<dyn Actuator>,
    x0: Vec<f64>,
}

impl Stages {
    /// Builds the stages with every kind of fault.
    fn of(plant: impl Plant + 'static, port: Box<dyn ControllerPort>) -> Self {
        let n = plant.order();
        let sensor = sensor::Noise::new(sensor::Ideal, &vec![1e-4; n], 3);
        let sensor = sensor::Quantised::new(sensor, vec![1e-5; n]);
        let sensor = sensor::Dropout::new(sensor::Delayed::new(sensor, 2), 0.1, 3);
        let actuator = actuator::Limited::new(actuator::RateLimited::new(actuator::Ideal, 1e6, 1e-3), -100.0, 100.0);
        let actuator = actuator::SlowBus::new(actuator::Delayed::new(actuator, 3), 2);
        let mut x0 = vec![0.0; n];
        x0[0] = 0.1;
        Self { plant: Box::new(plant), sensor: Box::new(sensor), port, actuator: Box::new(actuator), x0 }
    }

    fn setup(&mut self) -> Loop<'_> {
        Loop {
            plant: self.plant.as_ref(),
            sensor: self.sensor.as_mut(),
            port: self.port.as_mut(),
            actuator: self.actuator.as_mut(),
            report: true,
            missed: &[],
            x0: &self.x0,
            period_s: 1e-3,
            periods: 500,
        }
    }

    fn trace(&mut self) -> Trace {
        let setup = self.setup();
        let mut trace = setup.trace();
        let ending = close_loop(setup, &mut trace).expect("a run to its end");
        assert_eq!((ending, trace.ending, trace.rows.len()), (Ending::Finished, Ending::Finished, 501));
        trace
    }
}

/// Returns every bit of a trace as text, in which NaN equals NaN.
fn bits(trace: &Trace) -> String {
    format!("{trace:?}")
}

/// Returns a controller with this nominal model and an observer of order 2 in these channels.
fn controller<const N: usize>(
    nominal: Nominal<N>,
    observed: &[usize],
    precision: Precision,
) -> Box<dyn ControllerPort> {
    let gains = ObserverGains::as_printed([40.0, 400.0]);
    let config = Config::<N, 2> {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: std::array::from_fn(|i| observed.contains(&(i + 1)).then_some(gains)),
        reaching: ReachingLaw { k_l: 10.0, k_s: 0.0, epsilon: 0.01 },
        nominal,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(200.0)),
    };
    let model = Model::Linear(nominal.gradient.to_vec());
    let designed = build(&ControllerSpec { precision, model, config: config.into() });
    designed.unwrap_or_else(|error| panic!("{error}")).port
}

fn joint(precision: Precision) -> Stages {
    let chain = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    Stages::of(FlexibleJoint::of_the_paper(chain), controller(chain.nominal(), &[2, 4], precision))
}

fn chain() -> Stages {
    let nominal = Nominal { gradient: [-1.0, -3.0, -3.0], input_gain: 2.0 };
    let last = || LastChannel { a: nominal.gradient.to_vec(), b: nominal.input_gain };
    let jump = Signal::new(vec![Term::Step { amplitude: 0.5, t0_s: 0.1234 }]);
    let disturbances = vec![Signal::default(), jump, Signal::default()];
    let chain = Chain::new(last(), last(), disturbances).expect("a chain");
    Stages::of(chain, controller(nominal, &[2], Precision::F32))
}

fn baseline() -> Stages {
    let port = Baseline::new(BaselineSpec { period_s: 1e-3, c1: 5.0, l: 10.0, k: 3.0 });
    Stages::of(Benchmark::part_2(), Box::new(port))
}

const ALL: [fn() -> Stages; 4] = [|| joint(Precision::F32), || joint(Precision::F64), chain, baseline];

fn allocations(run: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    run();
    ALLOCATIONS.get() - before
}

#[test]
fn a_run_without_a_record_allocates_nothing() {
    for stages in ALL {
        let mut stages = stages();
        let setup = stages.setup();
        assert_eq!(allocations(|| assert_eq!(close_loop(setup, &mut ()), Ok(Ending::Finished))), 0);

        let mut largest = 0.0_f64;
        let mut watch = |row: &Row| {
            largest = largest.max(row.x[0].abs());
            ControlFlow::Continue(())
        };
        let setup = stages.setup();
        assert_eq!(allocations(|| assert_eq!(close_loop(setup, &mut watch), Ok(Ending::Finished))), 0);
        assert!(largest > 0.0);

        // A trace reserves all rows before the first tick.
        let setup = stages.setup();
        let mut trace = setup.trace();
        assert_eq!(allocations(|| assert_eq!(close_loop(setup, &mut trace), Ok(Ending::Finished))), 0);

        // The counter itself must count.
        let mut rows = Vec::new();
        let mut keep = |row: &Row| {
            rows.push(*row);
            ControlFlow::Continue(())
        };
        let setup = stages.setup();
        assert!(allocations(|| assert_eq!(close_loop(setup, &mut keep), Ok(Ending::Finished))) > 1);
    }
}

#[test]
fn a_loop_gives_the_same_bits_in_another_thread() {
    for stages in ALL {
        let mut moved = stages();
        let there = thread::spawn(move || bits(&moved.trace())).join().expect("it does not panic");
        assert_eq!(there, bits(&stages().trace()));
    }
}

#[test]
fn a_reset_port_gives_the_bits_of_a_new_one() {
    for stages in ALL {
        // New noise and a new delay line each time, with the same port.
        let mut used = stages();
        let first = used.trace();
        let mut continued = Stages { port: used.port, ..stages() };
        assert_ne!(bits(&continued.trace()), bits(&first), "it goes on where it stood");
        continued.port.reset().expect("in this process");
        let mut anew = Stages { port: continued.port, ..stages() };
        assert_eq!(bits(&anew.trace()), bits(&first));
    }
}

#[test]
fn a_reset_of_two_compared_ports_resets_both_and_counts_from_0() {
    let (mut there, mut here, mut other) =
        (joint(Precision::F32).port, joint(Precision::F32).port, joint(Precision::F64).port);
    let x = [0.1, 0.0, 0.0, 0.0];
    let mut compared = Compared::new(there.as_mut(), here.as_mut());
    let first = compared.tick(&x).expect("the same");
    assert_ne!(compared.tick(&x).expect("the same"), first);
    compared.reset().expect("in this process");
    assert_eq!(compared.tick(&x).expect("the same"), first);

    let mut compared = Compared::new(there.as_mut(), other.as_mut());
    compared.reset().expect("in this process");
    // At rest all outputs are exactly 0 in both precisions. After that f32 differs from f64.
    let run = |compared: &mut Compared<'_>| {
        [[0.0; 4], [0.0; 4], x, x].iter().find_map(|sample| compared.tick(sample).err()).expect("f32 is not f64")
    };
    let PortError::Differs(first) = run(&mut compared) else { panic!("not a difference") };
    assert_eq!(first.tick, 2);
    compared.reset().expect("in this process");
    assert_eq!(run(&mut compared), PortError::Differs(first), "counted anew");
}

#[test]
fn both_recorders_of_a_pair_see_every_row_and_either_ends_the_run() {
    let whole = joint(Precision::F32).trace();
    for breaks_first in [true, false] {
        let mut stages = joint(Precision::F32);
        let setup = stages.setup();
        let mut trace = setup.trace();
        let mut seen = 0;
        let mut watch = |row: &Row| {
            seen += 1;
            if row.t_s >= 0.1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let ending = if breaks_first {
            close_loop(setup, &mut (&mut watch, &mut trace))
        } else {
            close_loop(setup, &mut (&mut trace, &mut watch))
        };
        let Ok(Ending::Interrupted { t_s }) = ending else { panic!("{ending:?}") };
        assert_eq!((t_s, trace.ending, trace.rows.len(), seen), (0.1, Ending::Interrupted { t_s }, 101, 101));
        assert_eq!(format!("{:?}", trace.rows), format!("{:?}", &whole.rows[..101]));
    }
}

/// Port that answers a few ticks and then fails.
struct Mute(u32);

impl ControllerPort for Mute {
    fn tick(&mut self, _sample: &[f64]) -> Result<Tick, PortError> {
        self.0 = self.0.checked_sub(1).ok_or_else(|| PortError::Broken("the line broke".into()))?;
        let (estimates, health) = ([[0.0; _]; _], Health::OK);
        Ok(Tick { u: 0.0, sigma: 0.0, sigma_star: 0.0, estimates, health })
    }

    fn report_applied(&mut self, _u: f64) {}

    fn reset(&mut self) -> Result<(), PortError> {
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &[]
    }
}

#[test]
fn an_error_is_returned_in_words_and_the_recorder_is_told_when_it_broke_off() {
    let mut stages = Stages { port: Box::new(Mute(7)), ..chain() };
    let setup = stages.setup();
    let mut trace = setup.trace();
    let error = close_loop(setup, &mut trace).expect_err("it broke");
    assert_eq!((error.to_string().as_str(), trace.rows.len()), ("the line broke", 7));
    assert!(matches!(trace.ending, Ending::BrokenOff { t_s } if (t_s - 7e-3).abs() < 1e-12));
    let _: Box<dyn std::error::Error + Send + Sync> = error.into();
}

/// Custom recorder type.
#[derive(Default)]
struct Largest(f64, Option<Ending>);

impl Recorder for Largest {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        self.0 = self.0.max(row.u_held.abs());
        ControlFlow::Continue(())
    }

    fn end(&mut self, ending: Ending) {
        self.1 = Some(ending);
    }
}

#[test]
fn a_recorder_of_ones_own_is_told_the_end() {
    let mut largest = Largest::default();
    close_loop(joint(Precision::F32).setup(), &mut largest).expect("a run to its end");
    assert_eq!(largest.1, Some(Ending::Finished));
    let trace = joint(Precision::F32).trace();
    assert_eq!(trace.rows.iter().fold(0.0_f64, |largest, row| largest.max(row.u_held.abs())), largest.0);
}
