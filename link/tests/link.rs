//! Tests of a target that sends too much, of a link with faults, and of an interrupted wait.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use link::remote::{LONGEST_WAIT, Remote, for_target};
use link::transport::faulty::{Rates, Struck};
use link::transport::{Faulty, Loopback, Stoppable, Transport, TransportError};
use loop_sim::port::PortError;
use pil_wire::REPLY_LEN;

/// Target that sends its identity unasked, several times before each answer.
struct Talkative {
    inner: Loopback,
    hello: Vec<u8>,
    times: usize,
}

impl Talkative {
    fn new(times: usize) -> Self {
        let mut inner = Loopback::new();
        let mut hello = vec![0; REPLY_LEN];
        assert_eq!(inner.receive(&mut hello, Duration::ZERO), Ok(REPLY_LEN));
        Self { inner, hello, times }
    }
}

impl Transport for Talkative {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        if self.times == 0 {
            return self.inner.receive(into, within);
        }
        self.times -= 1;
        into[..REPLY_LEN].copy_from_slice(&self.hello);
        Ok(REPLY_LEN)
    }
}

fn connected(wire: Talkative) -> Result<Remote<Talkative>, PortError> {
    let source = scenario::Source { file: "default.toml", text: scenario::DEFAULT, sets: &[] };
    let experiment = scenario::parse(&source, "default").expect("the default scenario");
    Remote::connect(wire, Duration::from_millis(50), for_target(&experiment).expect("one for a target"))
}

#[test]
fn unasked_words_of_a_target_do_not_use_up_the_time_that_it_has_to_answer() {
    assert!(connected(Talkative::new(1000)).is_ok());
}

#[test]
fn a_target_that_never_stops_talking_is_given_up_in_time() {
    let began = Instant::now();
    let error = connected(Talkative::new(usize::MAX)).err().expect("no answer");
    assert!(matches!(error, PortError::Silent { .. }), "{error}");
    // The wait lasts as long as the documented limit and no longer. The upper limit is generous for a busy machine.
    assert!((LONGEST_WAIT..10 * LONGEST_WAIT).contains(&began.elapsed()), "{:?}", began.elapsed());
}

/// Link that keeps the sent frames and never answers.
#[derive(Default)]
struct Silent(Vec<Vec<u8>>);

impl Transport for Silent {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.0.push(bytes.to_vec());
        Ok(())
    }

    fn receive(&mut self, _: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        std::thread::sleep(within);
        Ok(0)
    }
}

#[test]
fn a_long_silence_ends_soon_after_the_wish_to_stop_and_a_short_one_in_time() {
    let stop = AtomicBool::new(false);
    let mut wire = Stoppable::new(Silent::default(), &stop);
    assert_eq!(wire.receive(&mut [0; 8], Duration::from_millis(1)), Ok(0));
    stop.store(true, Ordering::Relaxed);
    let began = Instant::now();
    assert!(wire.receive(&mut [0; 8], Duration::from_secs(50)).is_err());
    assert!(began.elapsed() < Duration::from_secs(10));
}

const NONE: Rates = Rates::all(0.0);

/// Returns the rest of `frames` frames of 32 equal bytes after a link with these faults.
fn passed(rates: Rates, frames: u8) -> Vec<Vec<u8>> {
    let mut wire = Faulty::new(Silent::default(), rates, 7);
    for k in 0..frames {
        wire.send(&[k; 32]).expect("a wire that takes all");
    }
    wire.inner().0.clone()
}

#[test]
fn without_faults_every_frame_passes_once_and_in_order() {
    assert_eq!(passed(NONE, 5), (0..5).map(|k| vec![k; 32]).collect::<Vec<_>>());
}

#[test]
fn each_fault_does_what_its_name_says() {
    assert_eq!(passed(Rates { drop: 1.0, ..NONE }, 9), Vec::<Vec<u8>>::new());
    assert_eq!(passed(Rates { duplicate: 1.0, ..NONE }, 2), [0, 0, 1, 1].map(|k| vec![k; 32]));
    for (k, frame) in passed(Rates { corrupt: 1.0, ..NONE }, 50).iter().enumerate() {
        let changed: u32 = frame.iter().map(|byte| (byte ^ k as u8).count_ones()).sum();
        assert_eq!((frame.len(), changed), (32, 1));
    }
    assert!(passed(Rates { truncate: 1.0, ..NONE }, 50).iter().all(|frame| frame.len() < 32));
    let late: Vec<u8> = passed(Rates { delay: 1.0, ..NONE }, 50).iter().map(|frame| frame[0]).collect();
    assert!(late.len() >= 46, "at most the last four are still under way: {late:?}");
    assert!(!late.is_sorted(), "some overtake others");
}

#[test]
fn a_rate_is_a_rate() {
    let mut wire = Faulty::new(Silent::default(), Rates::all(0.05), 1);
    for _ in 0..20_000 {
        wire.send(&[0; 32]).expect("a wire that takes all");
    }
    let [Struck { dropped, corrupted, truncated, duplicated, delayed }, _] = wire.struck();
    // 1000 expected, standard deviation 31. The limit is six standard deviations.
    for count in [dropped, corrupted, truncated, duplicated, delayed] {
        assert!((815..1185).contains(&count), "{:?}", wire.struck());
    }
}
