//! Bit-identity of the loop with the controller at the end of a serial link, good or faulty.
//!
//! The target is `pil_wire::Target` in this process, the code of the image; `emulator` runs it on the target.

use controller_core::drive::{Bounds, Encoder, Monitored, Motor, MotorDesign, MotorDrive, Position, Sample, Target};
use controller_core::{Health, Limits, RetuneError, Running};
use host_sim::figures::CATALOGUE;
use integration_tests::data::scenario_file;
use integration_tests::deep;
use integration_tests::drive::AtOnce as _;
use integration_tests::strategy::Rng;
use integration_tests::talk::{Host, crc32};
use link::remote::{LONGEST_WAIT, Loadable, Remote, for_target};
use link::transport::faulty::{Rates, Struck};
use link::transport::{Faulty, Loopback, Transport, TransportError};
use loop_sim::closed_loop::LoopError;
use loop_sim::port::{ControllerPort, PortError};
use loop_sim::port::{Difference, Field};
use loop_sim::trace::{Ending, Row, Trace};
use pil_wire::{
    CORE_VERSION, Counts, Identity, Instance, LAYOUT_ID, Model, Open, REPLY_LEN, RETUNE_ERRORS, Reason, Receiver,
    Reply, Request, halves,
};
use scenario::{Drive, Experiment, Source, load};
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Reply timeout; on a link without delay every wait ends at once.
const REPLY_WITHIN: Duration = Duration::from_millis(50);

fn shipped(file: &str, sets: &[&str]) -> Experiment {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    load(&scenario_file(file), &sets).unwrap_or_else(|error| panic!("{error}"))
}

fn connect<T: Transport>(transport: T, design: &Loadable) -> Result<Remote<T>, PortError> {
    Remote::connect(transport, REPLY_WITHIN, design.clone())
}

/// Runs an experiment with the target at the end of this link.
fn run_over<T: Transport>(experiment: &mut Experiment, transport: T) -> (Trace, Option<LoopError>, Remote<T>) {
    let download = for_target(experiment).expect("one for a target");
    let mut remote = connect(transport, &download).unwrap_or_else(|error| panic!("{error}"));
    let mut watch = |_: &Row| ControlFlow::Continue(());
    let (trace, error) = match &experiment.drive {
        Some(Drive { designed, motion, .. }) => {
            let mut drive = designed.port_to(&mut remote, motion);
            experiment.run_beside(Some(drive.as_mut()), &mut watch)
        }
        None => experiment.run_beside(Some(&mut remote), &mut watch),
    };
    (trace, error, remote)
}

/// Returns a drive template of `new` with changes.
fn drive(text: &str, sets: &[&str]) -> Experiment {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let source = Source { file: "drive.toml", text, sets: &sets };
    let mut drive = scenario::parse(&source, "drive").unwrap_or_else(|error| panic!("{error}"));
    drive.leave_rest_band();
    drive
}

/// Checks that all ticks agree on both sides of the link.
fn assert_same(label: &str, experiment: &mut Experiment) -> Trace {
    let (trace, error, remote) = run_over(experiment, Loopback::new());
    assert!(error.is_none(), "{label}: {error:?}");
    assert_eq!(trace.rows.len(), experiment.periods + 1, "{label}");
    assert_eq!(remote.transport().ticks() as usize, trace.rows.len(), "{label}");
    assert_eq!(remote.traffic().repeated, 0, "{label}");
    trace
}

#[test]
fn every_case_of_every_figure_has_the_same_bits_over_the_wire() {
    let mut compared = 0;
    for figure in CATALOGUE {
        for (label, mut experiment) in figure.experiments().expect("right files") {
            if let Err(told) = for_target(&experiment) {
                assert!(told.contains("proposed controller only"), "{told}");
                continue;
            }
            if deep() || compared % 9 == 0 {
                assert_same(&format!("{} {label}", figure.id), &mut experiment);
            }
            compared += 1;
        }
    }
    // Two of the cases use the baseline.
    let cases: usize = CATALOGUE.iter().map(|figure| figure.cases.len()).sum();
    assert!(compared == cases && cases > 15, "{compared} of {cases}");
}

#[test]
fn every_other_shipped_scenario_has_the_same_bits_over_the_wire() {
    for file in ["default.toml", "chain.toml"] {
        assert_same(file, &mut shipped(file, &[]));
    }
}

/// Whole runs: references, loads, friction, missing, frozen and jumping counts, saturation, and every reaction.
#[test]
fn every_form_of_a_drive_has_the_same_bits_over_the_wire() {
    let faults = "fault=[{ kind='lost', at_s=0.5, for_s=0.02 }, { kind='jump', at_s=0.8, counts=900, for_s=0.004 }, \
                  { kind='stuck', at_s=1.2 }]";
    let mut seen = Vec::new();
    for (form, reaction) in [
        ("uncertain_percent=20", "fallback"),
        ("uncertain_percent=50", "tell"),
        ("delay_ticks=1", "joined_stop"),
        ("observer_states=4", "tell"),
    ] {
        let (form, reaction) = (format!("drive.{form}"), format!("monitor.reaction='{reaction}'"));
        let sets = [form.as_str(), &reaction, faults];
        let turning = [&sets[..], &["drive.mode='speed'", "reference={ kind='speed', speed_rad_s=20 }"]].concat();
        let joint = sets.map(|set| if set.contains("states") { "drive.lost_ticks=8" } else { set });
        let whole = joint.map(|set| if set.ends_with("=50") { "drive.margin='standard'" } else { set });
        let whole = [&whole[..], &["drive.tuning='coupled'"]].concat();
        let motors = [(scenario::MOTOR, &sets[..]), (scenario::MOTOR, &turning)];
        let joints = [(scenario::JOINT, &joint[..]), (scenario::JOINT, &whole)];
        for (text, sets) in motors.into_iter().chain(joints) {
            let trace = assert_same(&format!("{sets:?}"), &mut drive(text, sets));
            seen.extend(trace.rows.iter().map(|row| row.health));
        }
    }
    for flag in [Health::SATURATED, Health::SAMPLE_LOST, Health::STOPPED, Health::DISTURBANCE_OVER_BOUND] {
        assert!(seen.iter().any(|health| health.contains(flag)), "never {flag}");
    }
}

#[test]
fn samples_that_are_lost_and_controls_that_saturate_have_the_same_bits_over_the_wire() {
    let base = ["span_s=4", "window_s=[2, 4]", "sensor.dropout=0.2", "controller.limits={min=-20, max=20}"];
    for fallback in ["controller.fallback=\"hold\"", "controller.fallback=0.5"] {
        // The applied u differs from the demand, is reported late, or is not reported.
        for actuator in ["actuator.rate_per_s=5000", "actuator.delay_ticks=2", "actuator.report=false"] {
            let sets = [&base[..], &[actuator, fallback]].concat();
            let mut experiment = shipped("default.toml", &sets);
            let (trace, error, _) = run_over(&mut experiment, Loopback::new());
            assert!(error.is_none(), "{sets:?}: {error:?}");
            for flag in [Health::INPUT_REJECTED, Health::SATURATED] {
                assert!(trace.rows.iter().any(|row| row.health.contains(flag)), "{sets:?}: never {flag}");
            }
        }
    }
}

#[test]
fn five_percent_of_every_fault_in_both_directions_cost_no_tick_and_no_bit() {
    for seed in 0..8 {
        // 2000 ticks.
        let mut experiment = shipped("default.toml", &["span_s=1.999", "window_s=[1, 1.999]", "sensor.dropout=0.01"]);
        let wire = Faulty::new(Loopback::new(), Rates::all(0.05), seed);
        let (trace, error, remote) = run_over(&mut experiment, wire);
        assert!(error.is_none(), "seed {seed}: {error:?}");
        assert_eq!((trace.rows.len(), trace.ending), (2000, Ending::Finished), "seed {seed}");
        // The target's own count would show a lost or doubled tick.
        assert_eq!(remote.transport().inner().ticks(), 2000, "seed {seed}");
        for Struck { dropped, corrupted, truncated, duplicated, delayed } in remote.transport().struck() {
            for count in [dropped, corrupted, truncated, duplicated, delayed] {
                // 5 % of at least 2000 frames: 100 expected, standard deviation 10.
                assert!(count > 50, "seed {seed}: {:?}", remote.transport().struck());
            }
        }
        // About 15 % of requests and 17 % of replies do not arrive in time.
        assert!(remote.traffic().repeated > 200, "seed {seed}: {:?}", remote.traffic());
    }
}

/// Serial link that rewrites or drops frames.
struct Rewritten<Q, P> {
    inner: Loopback,
    request: Q,
    reply: P,
    receiver: Receiver<REPLY_LEN>,
    passed: VecDeque<u8>,
}

impl<Q, P> Rewritten<Q, P>
where
    Q: FnMut(Request) -> Option<Request> + Send,
    P: FnMut(Reply) -> Option<Reply> + Send,
{
    fn new(request: Q, reply: P) -> Self {
        Self { inner: Loopback::new(), request, reply, receiver: Receiver::of_replies(), passed: VecDeque::new() }
    }
}

impl<Q, P> Transport for Rewritten<Q, P>
where
    Q: FnMut(Request) -> Option<Request> + Send,
    P: FnMut(Reply) -> Option<Reply> + Send,
{
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        let (sequence, request) = Request::from_frame(bytes.try_into().expect("one frame"));
        match (self.request)(request.expect("a request")) {
            Some(request) => self.inner.send(&request.to_frame(sequence)),
            None => Ok(()),
        }
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let mut bytes = [0; 1000];
        let count = self.inner.receive(&mut bytes, within)?;
        for &byte in &bytes[..count] {
            if let Some(frame) = self.receiver.push(byte) {
                let (sequence, reply) = Reply::from_frame(&frame);
                self.passed.extend((self.reply)(reply.expect("a reply")).iter().flat_map(|it| it.to_frame(sequence)));
            }
        }
        let count = into.len().min(self.passed.len());
        for (to, from) in into.iter_mut().zip(self.passed.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }
}

/// Returns the port's error for a target that differs from this program in one property.
fn refusal<T: Transport>(transport: T, change: impl Fn(&mut Loadable)) -> String {
    let mut download = for_target(&shipped("default.toml", &[])).expect("one for a target");
    change(&mut download);
    match connect(transport, &download) {
        Err(PortError::Refused(told)) => told,
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("it was not refused"),
    }
}

#[test]
fn host_and_target_of_different_make_refuse_each_other_and_say_which_differs() {
    let identity = |change: fn(&mut Identity)| {
        Rewritten::new(Some, move |mut reply| {
            if let Reply::Identity(identity) = &mut reply {
                change(identity);
            }
            Some(reply)
        })
    };
    let older = identity(|it| it.core_version = 0x0001_0203);
    let told = refusal(older, |_| {});
    let [_, major, minor, patch] = CORE_VERSION.to_be_bytes();
    let ours = format!("the target has controller version 1.2.3, this program {major}.{minor}.{patch}; ");
    assert!(told.starts_with(&ours) && told.contains("flash the firmware of this version"), "{told}");

    let told = refusal(identity(|it| it.layout ^= 1), |_| {});
    let ours = format!("layout {:08x}, this program {LAYOUT_ID:08x}; ", LAYOUT_ID ^ 1);
    assert!(told.contains(&ours), "{told}");

    let told = refusal(OtherVersion(Loopback::new()), |_| {});
    assert!(told.starts_with("the target has protocol version 9, this program 4; "), "{told}");
}

/// Target with another protocol version; it can still identify itself.
struct OtherVersion(Loopback);

impl Transport for OtherVersion {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.0.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let mut frame = [0; REPLY_LEN];
        let count = self.0.receive(&mut frame, within)?;
        frame[2] = 9;
        let (body, check) = frame.split_at_mut(REPLY_LEN - 4);
        check.copy_from_slice(&crc32(body).to_le_bytes());
        into[..count].copy_from_slice(&frame[..count]);
        Ok(count)
    }
}

#[test]
fn a_design_that_does_not_fit_is_refused_with_the_reason() {
    let told = refusal(Loopback::new(), |it| it.instance.n = 5);
    let instance =
        "the target's firmware has no controller with n = 5, r = 2, observed channels 2, 4 and a linear model";
    assert_eq!(told, instance);

    let count = for_target(&shipped("default.toml", &[])).expect("one for a target").words.len();
    let told = refusal(Loopback::new(), |it| it.words.truncate(count - 1));
    let counts = format!("a design of this kind has {count} words on the target, {} here; ", count - 1);
    assert!(told.starts_with(&counts), "{told}");

    let told = refusal(Loopback::new(), |it| *it.words.last_mut().expect("words") = f32::NAN.to_bits());
    assert!(told.starts_with("the target rejects the numbers of the design: "), "{told}");

    let tampering = |request| {
        Some(match request {
            Request::Load { offset: 8, mut words } => {
                words[1] ^= 1 << 31;
                Request::Load { offset: 8, words }
            }
            other => other,
        })
    };
    let told = refusal(Rewritten::new(tampering, Some), |_| {});
    assert!(told.starts_with("the design was changed in transit: its hash is "), "{told}");
}

#[test]
fn a_scenario_that_no_target_carries_is_refused_with_what_to_change() {
    let told = |file, sets: &[&str]| for_target(&shipped(file, sets)).expect_err("not for a target");
    assert!(told("default.toml", &["controller.precision=f64"]).ends_with("set controller.precision=f32"));
    assert!(told("fig01_baseline.toml", &[]).ends_with("set controller.kind=proposed"));
    for (text, late) in [(scenario::MOTOR, "2"), (scenario::JOINT, "3")] {
        let experiment = drive(text, &[&format!("drive.delay_ticks={late}")]);
        let told = for_target(&experiment).expect_err("too late for a target");
        assert!(told.contains("takes a delay of 0 or 1 tick") && told.contains("export it as C or Rust"), "{told}");
        let designed = &experiment.drive.as_ref().expect("a drive").designed;
        assert!(Loadable::try_from(designed).is_err());
    }
    let fifth = [
        "plant.order=5",
        "plant.a=[0,0,0,0,0]",
        "plant.x0=[0,0,0,0,0]",
        "plant.disturbance=[]",
        "controller.nominal.a=[0,0,0,0,0]",
        "controller.observer=[{channel=5, bandwidth_rad_s=10.0, order=1}]",
    ];
    assert!(told("chain.toml", &fifth).contains("plants up to order 4, this plant has order 5"));
}

#[test]
fn a_lost_reply_is_sent_again_from_memory_and_never_ticked_twice() {
    let mut seen = 0_u32;
    let first_is_lost = move |reply| {
        seen += u32::from(matches!(reply, Reply::Ticked(_)));
        (seen.is_multiple_of(2) || !matches!(reply, Reply::Ticked(_))).then_some(reply)
    };
    let mut experiment = shipped("default.toml", &["span_s=0.5", "window_s=[0.1, 0.5]"]);
    let (trace, error, remote) = run_over(&mut experiment, Rewritten::new(Some, first_is_lost));
    assert!(error.is_none(), "{error:?}");
    assert_eq!((trace.rows.len(), remote.transport().inner.ticks(), remote.traffic().repeated), (501, 501, 501));
}

#[test]
fn one_flipped_bit_ends_the_run_and_is_named_and_the_ticks_before_it_are_kept() {
    let mut ticks = 0;
    let flip = move |mut reply| {
        if let Reply::Ticked(ticked) = &mut reply {
            ticks += 1;
            if ticks == 18 {
                ticked.estimates[1][1] = f32::from_bits(ticked.estimates[1][1].to_bits() ^ 1);
            }
        }
        Some(reply)
    };
    let mut experiment = shipped("default.toml", &["span_s=0.5", "window_s=[0.1, 0.5]"]);
    let (trace, error, _) = run_over(&mut experiment, Rewritten::new(Some, flip));
    let Some(LoopError::Port(PortError::Differs(Difference { tick, field, there, here }))) = error else {
        panic!("{error:?}")
    };
    assert_eq!((tick, field, there ^ here), (17, Field::Estimate { channel: 2, derivative: 1 }, 1));
    assert_eq!((trace.rows.len(), trace.ending), (17, Ending::BrokenOff { t_s: 0.017 }));
}

#[test]
fn a_target_that_restarts_is_told_with_the_tick() {
    let download = for_target(&shipped("default.toml", &[])).expect("one for a target");
    let mut remote = connect(Loopback::new(), &download).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..10 {
        remote.tick(&[0.1, 0.0, 0.0, 0.0]).unwrap_or_else(|error| panic!("{error}"));
    }
    remote.transport_mut().restart();
    let told = remote.tick(&[0.1, 0.0, 0.0, 0.0]).expect_err("the design is gone");
    assert_eq!(told.to_string(), "the target restarted at tick 10 and lost its design");
}

#[test]
fn a_second_program_takes_over_where_the_first_one_stopped() {
    let download = for_target(&shipped("default.toml", &[])).expect("one for a target");
    let mut used = Loopback::new();
    for _ in 0..3 {
        let mut remote = connect(used, &download).unwrap_or_else(|error| panic!("{error}"));
        remote.tick(&[0.1, 0.0, 0.0, 0.0]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(remote.transport().ticks(), 1);
        used = std::mem::take(remote.transport_mut());
    }
}

#[test]
fn a_reset_starts_the_same_design_anew_on_the_target() {
    let download = for_target(&shipped("default.toml", &[])).expect("one for a target");
    let mut remote = connect(Loopback::new(), &download).unwrap_or_else(|error| panic!("{error}"));
    let ticks = |remote: &mut Remote<Loopback>| -> Vec<_> {
        [0.1, 0.2, 0.3].map(|x| remote.tick(&[x, 0.0, 0.0, 0.0]).unwrap_or_else(|error| panic!("{error}"))).into()
    };
    let first = ticks(&mut remote);
    assert_ne!(ticks(&mut remote), first, "it goes on where it stood");
    // Reported before the reset, so it must not count after it.
    remote.report_applied(7.0);
    remote.reset().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(ticks(&mut remote), first);
    assert_eq!(remote.transport().ticks(), 3);
}

/// Noisy serial link: other bytes before every frame.
struct Humming {
    inner: Loopback,
    rng: Rng,
}

impl Transport for Humming {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        // Half of them marks or half marks; some noise is longer than a frame.
        let hum = self.rng.integer(1, 2 * REPLY_LEN);
        for byte in &mut into[..hum] {
            let any = self.rng.integer(0, 255) as u8;
            *byte = [0x5A, 0xE6, any, any][self.rng.integer(0, 3)];
        }
        let count = self.inner.receive(&mut into[hum..], within)?;
        Ok(if count == 0 { 0 } else { hum + count })
    }
}

#[test]
fn garbage_before_every_reply_is_skipped() {
    let mut experiment = shipped("default.toml", &["span_s=1.999", "window_s=[1, 1.999]"]);
    let (trace, error, remote) = run_over(&mut experiment, Humming { inner: Loopback::new(), rng: Rng::new(5) });
    assert!(error.is_none(), "{error:?}");
    assert_eq!((trace.rows.len(), remote.transport().inner.ticks()), (2000, 2000));
}

/// Serial link that stays silent or repeats the same bytes without end.
struct Babbling(&'static [u8]);

impl Transport for Babbling {
    fn send(&mut self, _bytes: &[u8]) -> Result<(), TransportError> {
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration) -> Result<usize, TransportError> {
        into[..self.0.len()].copy_from_slice(self.0);
        Ok(self.0.len())
    }
}

#[test]
fn a_target_that_says_nothing_or_nonsense_is_given_up_in_the_time_that_the_page_names() {
    let download = for_target(&shipped("default.toml", &[])).expect("one for a target");
    let told = connect(Babbling(&[]), &download).err().map(|error| error.to_string());
    assert_eq!(told.as_deref(), Some("no answer to the first request within 5 s"));

    let began = Instant::now();
    // Endless marks without a frame.
    let told = connect(Babbling(&[0x5A, 0xE6, 0x5A]), &download).err().map(|error| error.to_string());
    let told = told.expect("nobody is there");
    assert!(told.starts_with("no answer to the first request within 5 s, but "), "{told}");
    // A loaded machine may be late by a time slice per wait.
    assert!(began.elapsed() < LONGEST_WAIT + Duration::from_secs(2), "{:?}", began.elapsed());
}

/// A drive on the target switches to other bandwidths in motion, like a drive in this process. An incompatible design
/// is rejected without any change.
#[test]
fn a_drive_is_tuned_anew_in_motion_with_the_same_bits() {
    type Law = MotorDrive<f32, Position, 1>;
    let designs = [60.0, 90.0, 75.0].map(|surface| {
        let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
        MotorDesign::by_rule(1e-3, motor, Encoder::absolute(14), Limits::symmetric(10.0)).with_surface(surface)
    });
    let bounds = Bounds {
        disturbance: [1e4],
        sigma_star: 1e6,
        stuck_ticks: 200,
        wrong_way_ticks: 6,
        patience_ticks: 8,
        brake_per_s: 60.0,
        brake_ticks: 130,
    };
    let loadable = |design: &MotorDesign| Loadable {
        instance: Instance { n: 2, r: 3, mask: Instance::TWO_SETS, model: Model::Motor },
        words: design.to_numbers().into_iter().chain(bounds.to_numbers()).chain([0.0]).flat_map(halves).collect(),
    };
    let law = |design: &MotorDesign| Monitored::new(Law::try_design(design).expect("good"), &bounds);
    let opened = |host: &mut Host, design: &Loadable| {
        host.done(&Request::Open(Open::new(design.instance, &design.words)));
        host.load(&design.words);
    };

    let mut host = Host::new();
    host.start(&loadable(&designs[0]));
    let mut here = Running::new(law(&designs[0]));
    let mut begin = Target { turn: 0, jet: [0.0; 4] };
    for tick in 0..3000_u32 {
        let angle = 1e-3 * f64::from(tick);
        let end = Target { turn: 0, jet: [angle as f32, 1.0, 0.0, 0.0] };
        let count = Some((angle / std::f64::consts::TAU * 16384.0) as i32 + i32::from(tick % 7 == 0));
        let counts = Counts { counts: [count, None], end, applied: f32::NAN };
        let of = |target: Target<f32, i32, 4>| Target { turn: target.turn, jet: [target.jet[0], target.jet[1]] };
        let sample = Sample { counts: [count], begin: of(begin), end: of(end) };
        let mut request = Request::Drive(counts);
        if tick % 1000 == 500 {
            let next = &designs[(tick / 1000 + 1) as usize % 3];
            // Another gear, another form, a flipped bit, no numbers: all rejected.
            let geared = MotorDesign { encoder: next.encoder.geared(3, 1), ..*next };
            opened(&mut host, &loadable(&geared));
            let told = host.refused(&Request::Retune(counts));
            assert_eq!((told.reason, RETUNE_ERRORS[told.target as usize]), (Reason::Retune, RetuneError::OtherEncoder));
            let mut other = loadable(next);
            other.instance.mask = 0;
            opened(&mut host, &other);
            assert_eq!(host.refused(&Request::Retune(counts)).reason, Reason::Instance);
            other = loadable(next);
            other.words[0] ^= 1;
            host.done(&Request::Open(Open::new(other.instance, &loadable(next).words)));
            host.load(&other.words);
            assert_eq!(host.refused(&Request::Retune(counts)).reason, Reason::Design);
            opened(&mut host, &loadable(&MotorDesign { period_s: f64::NAN, ..*next }));
            assert_eq!(host.refused(&Request::Retune(counts)).reason, Reason::Coefficients);
            opened(&mut host, &loadable(next));
            request = Request::Retune(counts);
            here.retune(law(next), &sample).expect("a design that is near");
        }
        let output = here.tick_at_once(&sample);
        begin = end;
        let Reply::Driven(driven) = host.ask(&request) else { panic!("tick {tick}: not ticked") };
        let known = here.estimates().expect("started");
        let there = [driven.u, driven.sigma, driven.sigma_star].into_iter().chain(driven.estimates[0]);
        let numbers = [output.u, output.sigma, output.sigma_star].into_iter();
        let numbers = numbers.chain([known.position[0], known.speed[0], known.disturbance[0], known.load[0]]);
        assert!(numbers.map(f32::to_bits).eq(there.map(f32::to_bits)), "tick {tick}: {driven:?}, {output:?}");
        assert_eq!((driven.health, driven.turn), (output.health, known.turn), "tick {tick}");
    }
    // A loaded design without a start changes nothing; a start switches to it.
    opened(&mut host, &loadable(&designs[1]));
    let Reply::Driven(_) = host.ask(&Request::Drive(Counts { counts: [None; 2], end: begin, applied: f32::NAN }))
    else {
        panic!("the design that runs is gone");
    };
    host.done(&Request::Start);
}
