//! Frames between host and target: correct content, and robustness against faults.

use controller_core::{
    AnyConfig, Config, Fallback, LAYOUT, Limits, MAX_R, Nominal, ObserverGains, Options, ReachingLaw, Surface,
};
use integration_tests::deep;
use integration_tests::paper::NOMINAL;
use integration_tests::strategy::Rng;
use integration_tests::talk::{Host, by_hand, crc32, joint};
use link::remote::Loadable;
use loop_sim::port::in_process::{ControllerSpec, Download, Model, Precision, build, padded};
use pil_wire::{
    CORE_VERSION, Instance, LAYOUT_ID, LOAD, MAX_N, Open, REPLY_LEN, REQUEST_LEN, Reason, Receiver, Refusal, Reply,
    Request, Target,
};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Returns the number of cases: all in the deep tier, a quarter in the fast one.
fn cases(cases: u32) -> ProptestConfig {
    let cases = if deep() { cases } else { cases / 4 };
    ProptestConfig { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(0x5AE5), ..ProptestConfig::default() }
}

#[test]
fn frames_are_those_of_the_page_byte_for_byte() {
    let request = Request::Tick { x: [1.0, -0.0, 2.5, f32::NAN], applied: -3.0 };
    let words = [0x3F80_0000, 0x8000_0000, 0x4020_0000, 0x7FC0_0000, 0xC040_0000, 0, 0, 0, 0];
    assert_eq!(request.to_frame(7).to_vec(), by_hand(0xE5, 5, 7, &words));

    let joint = joint();
    let Loadable { instance, words: numbers } = (&joint).into();
    let digested: Vec<u8> = std::iter::once(0x000A_0204)
        .chain(joint.numbers.iter().map(|number| number.to_bits()))
        .flat_map(u32::to_le_bytes)
        .collect();
    let words = [
        0x000A_0204,
        numbers.len() as u32,
        crc32(LAYOUT.as_bytes()) ^ crc32(controller_core::drive::LAYOUT.as_bytes()),
        CORE_VERSION,
        crc32(&digested),
        0,
        0,
        0,
        0,
    ];
    assert_eq!(Request::Open(Open::new(instance, &numbers)).to_frame(1).to_vec(), by_hand(0xE5, 2, 1, &words));

    let mut words = [0; 16];
    words[..3].copy_from_slice(&[LAYOUT_ID, CORE_VERSION, 0]);
    assert_eq!(Target::new().hello().to_vec(), by_hand(0xE6, 129, 0, &words));

    let version: Vec<u32> = controller_core::VERSION.split('.').map(|part| part.parse().expect("a number")).collect();
    assert_eq!(CORE_VERSION, version[0] << 16 | version[1] << 8 | version[2]);
}

#[test]
fn a_design_has_the_numbers_that_its_layout_names() {
    let Download { numbers, .. } = joint();
    let (n, r, o) = (4, 2, 2);
    let mut position = 2 * n;
    let mut at = |wanted: &str| {
        for name in LAYOUT.split_whitespace() {
            if name == wanted {
                break;
            }
            position += match name.split_once('[') {
                None => 1,
                Some((_, "N]")) => n,
                Some((_, "O][R]")) => o * r,
                Some(other) => panic!("{other:?}"),
            };
        }
        std::mem::replace(&mut position, 2 * n)
    };
    let c = at("c[N]");
    assert_eq!(numbers[c..c + n], [125.0, 75.0, 15.0, 1.0]);
    for (name, value) in [
        ("rate", 1000.0),
        ("decay", 1.0 - (-1e-3_f64).exp()),
        ("u_min", -300.0),
        ("u_max", 300.0),
        ("sigma_star_bound", 1e12),
        ("hold", 1.0),
        ("fallback", 0.0),
        ("period", 1e-3),
        ("input_gain", NOMINAL.input_gain),
    ] {
        assert_eq!(numbers[at(name)], value as f32, "{name}");
    }
    assert_eq!(at("nothing of this name"), numbers.len());
}

/// Sequence number, kind and words of a request and of a reply, and whether the words come from the known values.
type Frames = (u32, (u8, [u32; 9]), (u8, [u32; 16]), bool);

/// A frame with a valid checksum reads back unchanged. Words with few valid values (model, fault, health, reason) have
/// one of them in half of the cases, so every kind occurs. Unused words are ignored and sent as 0.
#[test]
fn every_frame_with_a_right_checksum_reads_back_as_it_was() {
    let read = RefCell::new(BTreeMap::<u8, u32>::new());
    let count = |kind| *read.borrow_mut().entry(kind).or_default() += 1;
    let requests = (1_u8..=18, any::<[u32; 9]>());
    let replies = (129_u8..=137, any::<[u32; 16]>());
    let frames = (any::<u32>(), requests, replies, any::<bool>());
    let reads_back = |(sequence, (kind, mut words), (reply_kind, mut reply), known): Frames| {
        if known {
            match kind {
                2 => words[0] = words[0] & 0x00FF_FFFF | ((words[0] >> 24) % 5) << 24,
                6 => words[0] = 0xFA17_FA17,
                11 | 12 => words[0] %= 2,
                13 => words[0] %= 5,
                14 => words[0] %= 7,
                _ => {}
            }
            match reply_kind {
                131 | 133 => reply[3] %= 8,
                132 => reply[0] = 1 + reply[0] % 25,
                134 => reply[3] &= 0x77F,
                _ => {}
            }
        }
        let frame: [u8; REQUEST_LEN] = by_hand(0xE5, kind, sequence, &words).try_into().expect("its length");
        let (read, request) = Request::from_frame(&frame);
        prop_assert_eq!(read, sequence);
        if let Ok(request) = request {
            match (kind, words[0]) {
                (11 | 14, 0) | (14, 5) => words[1..3].fill(0),
                (14, 1 | 6) => words[1] = 0,
                (14, 2) => words[2] = 0,
                (15, _) => words[0] &= 15,
                _ => {}
            }
            if matches!(kind, 8 | 9) {
                // A missing count is sent as 0.
                words[0] &= 3;
                for i in 0..2 {
                    words[1 + i] *= u32::from(words[0] >> i & 1 == 0);
                }
            }
            words[[0, 5, 9, 0, 5, 1, 5, 9, 9, 0, 4, 1, 1, 3, 3, 2, 9, 9][usize::from(kind) - 1]..].fill(0);
            prop_assert_eq!(request.to_frame(sequence).to_vec(), by_hand(0xE5, kind, sequence, &words));
            count(kind);
        }
        let frame: [u8; REPLY_LEN] = by_hand(0xE6, reply_kind, sequence, &reply).try_into().expect("its length");
        let (read, answer) = Reply::from_frame(&frame);
        prop_assert_eq!(read, sequence);
        if let Some(answer) = answer {
            reply[[3, 0, 16, 3, 13, 16, 2, 6, 16][usize::from(reply_kind) - 129]..].fill(0);
            prop_assert_eq!(answer.to_frame(sequence).to_vec(), by_hand(0xE6, reply_kind, sequence, &reply));
            count(reply_kind);
        }
        Ok(())
    };
    TestRunner::new(cases(4000)).run(&frames, reads_back).unwrap_or_else(|fault| panic!("{fault}"));
    // Lower limit for the rarest kind, which occurs in a thirtieth of the cases.
    let least = if deep() { 80 } else { 12 };
    for kind in (1..=18).chain(129..=137) {
        let times = read.borrow().get(&kind).copied().unwrap_or(0);
        assert!(times >= least, "kind {kind} was read {times} times");
    }
}

proptest! {
    #![proptest_config(cases(2000))]

    #[test]
    fn no_byte_string_makes_a_target_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut host = Host::new();
        host.start(&(&joint()).into());
        host.send(&bytes);
        // The target still works.
        host.send(&[0; REQUEST_LEN]);
        host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
    }

    #[test]
    fn no_order_of_requests_makes_a_target_panic(
        script in prop::collection::vec((1_u8..=10, -2_i32..=3, prop::array::uniform9(any::<u32>()), 0_u8..4), 0..60),
    ) {
        let mut host = Host::new();
        let joint = Loadable::from(&joint());
        let open = Open::new(joint.instance, &joint.words);
        for (kind, step, words, real) in script {
            host.sequence = host.sequence.wrapping_add_signed(step);
            let bytes = match real {
                0 => by_hand(0xE5, kind, host.sequence, &words),
                1 => Request::Open(open).to_frame(host.sequence).to_vec(),
                2 => Request::Start.to_frame(host.sequence).to_vec(),
                _ => Request::Tick { x: [0.0; 4], applied: 0.0 }.to_frame(host.sequence).to_vec(),
            };
            prop_assert!(host.send(&bytes).len() <= 1);
        }
    }

    #[test]
    fn every_whole_frame_is_found_between_garbage_and_damaged_ones(
        pieces in prop::collection::vec((0_u8..5, any::<u16>(), prop::collection::vec(any::<u8>(), 0..40)), 1..30),
    ) {
        let mut stream = Vec::new();
        let mut sent = Vec::new();
        for (sequence, (piece, number, garbage)) in (0..).zip(pieces) {
            let mut frame = Request::Tick { x: [f32::from(number); 4], applied: 0.0 }.to_frame(sequence);
            let at = usize::from(number) % REQUEST_LEN;
            match piece {
                0 => stream.extend(garbage),
                // Cut before its checksum; with fewer missing bytes the next frame might supply the right ones.
                1 => stream.extend(&frame[..at.min(REQUEST_LEN - 4)]),
                2 => {
                    frame[at] ^= 1 << (number >> 8 & 7);
                    stream.extend(frame);
                }
                // An invalid mark.
                3 => stream.extend([0x5A, 0xE5, 0x5A]),
                _ => {
                    stream.extend(frame);
                    sent.push(frame);
                }
            }
        }
        // These bytes flush the last frame through the receiver.
        stream.extend([0; REQUEST_LEN]);
        let mut receiver = Receiver::of_requests();
        let found: Vec<_> = stream.into_iter().filter_map(|byte| receiver.push(byte)).collect();
        prop_assert_eq!(found, sent);
    }
}

#[test]
fn a_request_repeated_after_a_lost_reply_is_answered_and_not_ticked_again() {
    let mut host = Host::new();
    host.start(&(&joint()).into());
    let first = host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
    let repeat = Request::Tick { x: [0.1, 0.0, 0.0, 0.0], applied: f32::NAN }.to_frame(host.sequence);
    for _ in 0..3 {
        let replies = host.send(&repeat);
        let (sequence, reply) = Reply::from_frame(&replies[0]);
        assert_eq!(sequence, host.sequence);
        assert!(matches!(reply, Some(Reply::Ticked(again)) if again.u.to_bits() == first.u.to_bits()), "{reply:?}");
    }
    assert_eq!(host.target.black_box().oldest_first().count(), 1);

    // Another request with the same number belongs to another program; it gets no acknowledgement.
    let replies = host.send(&Request::Tick { x: [0.7, 0.0, 0.0, 0.0], applied: 5.0 }.to_frame(host.sequence));
    let refusal = Refusal { reason: Reason::OutOfStep, target: host.sequence, request: host.sequence };
    assert!(matches!(Reply::from_frame(&replies[0]), (_, Some(Reply::Refused(told))) if told == refusal));
    // A late request is dropped, a leap is rejected, and neither counts.
    assert!(host.send(&Request::Start.to_frame(host.sequence - 1)).is_empty());
    let replies = host.send(&Request::Start.to_frame(host.sequence + 2));
    let refusal = Refusal { reason: Reason::OutOfStep, target: host.sequence, request: host.sequence + 2 };
    assert!(matches!(Reply::from_frame(&replies[0]), (_, Some(Reply::Refused(told))) if told == refusal));
    host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
    assert_eq!(host.target.black_box().oldest_first().count(), 2);
}

#[test]
fn identify_changes_nothing_and_tells_where_the_talk_stands() {
    let mut host = Host::new();
    host.start(&(&joint()).into());
    let replies = host.send(&Request::Identify.to_frame(12345));
    let (sequence, reply) = Reply::from_frame(&replies[0]);
    assert_eq!(sequence, 12345);
    let Some(Reply::Identity(identity)) = reply else { panic!("{reply:?}") };
    assert_eq!((identity.version, identity.layout), (4, LAYOUT_ID));
    assert_eq!((identity.core_version, identity.last_sequence), (CORE_VERSION, host.sequence));
    host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
}

#[test]
fn a_design_that_is_not_the_hosts_is_refused_with_what_differs() {
    let good = Loadable::from(&joint());
    let instance = good.instance;
    let open = Open::new(instance, &good.words);
    let mut host = Host::new();

    let layout = host.refused(&Request::Open(Open { layout: 1, ..open }));
    assert_eq!(layout, Refusal { reason: Reason::Layout, target: LAYOUT_ID, request: 1 });
    let version = host.refused(&Request::Open(Open { core_version: 2, ..open }));
    assert_eq!(version, Refusal { reason: Reason::CoreVersion, target: CORE_VERSION, request: 2 });
    let many = host.refused(&Request::Open(Open { count: 1000, ..open }));
    assert_eq!((many.reason, many.request), (Reason::Count, 1000));
    // After a rejection no download is open.
    assert_eq!(host.refused(&Request::Start).reason, Reason::NotOpen);
    assert_eq!(host.refused(&Request::Load { offset: 0, words: [0; LOAD] }).reason, Reason::NotOpen);
    assert_eq!(host.refused(&Request::Tick { x: [0.0; 4], applied: 0.0 }).reason, Reason::NotOpen);

    // One number with a wrong last bit.
    host.done(&Request::Open(open));
    let mut other = good.words.clone();
    other[20] ^= 1;
    host.load(&other);
    let hash = pil_wire::design_hash(instance, &other);
    let refusal = Refusal { reason: Reason::Design, target: hash, request: open.design };
    assert_eq!(host.refused(&Request::Start), refusal);

    // Numbers with a valid hash that no design has.
    for (position, value) in [(10, f32::NAN), (good.words.len() - 3, 0.0), (good.words.len() - 5, 7.0)] {
        let mut words = good.words.clone();
        words[position] = f32::to_bits(value);
        host.done(&Request::Open(Open::new(instance, &words)));
        host.load(&words);
        assert_eq!(host.refused(&Request::Start).reason, Reason::Coefficients, "{position}");
    }

    // An instance that the image does not contain, and one with another count of numbers.
    for (other, reason) in [
        (Instance { n: 5, ..instance }, Reason::Instance),
        (Instance { r: 4, ..instance }, Reason::Instance),
        (Instance { mask: 0b1_0000, ..instance }, Reason::Instance),
        (Instance { model: pil_wire::Model::BenchmarkLibm, ..instance }, Reason::Instance),
        (Instance { r: 3, ..instance }, Reason::Count),
    ] {
        host.done(&Request::Open(Open::new(other, &good.words)));
        host.load(&good.words);
        assert_eq!(host.refused(&Request::Start).reason, reason, "{other:?}");
    }

    // A request of another version, with a valid checksum.
    host.sequence += 1;
    let mut bytes = by_hand(0xE5, 4, host.sequence, &[0; 9]);
    bytes[2] = 9;
    let body = bytes.len() - 4;
    let checksum = crc32(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&checksum);
    let replies = host.send(&bytes);
    let refusal = Refusal { reason: Reason::Version, target: 4, request: 9 };
    assert!(matches!(Reply::from_frame(&replies[0]), (_, Some(Reply::Refused(told))) if told == refusal));

    host.start(&good);
    host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
}

/// Returns a design for an instance: every pole at -20 rad/s, every observer of the highest order, T = 1 ms.
fn spec(n: usize, r: usize, mask: u8, model: Model) -> ControllerSpec {
    let gains = match r {
        1 => ObserverGains::<MAX_R>::from_bandwidth::<1>(20.0),
        2 => ObserverGains::<MAX_R>::from_bandwidth::<2>(20.0),
        _ => ObserverGains::<MAX_R>::from_bandwidth::<3>(20.0),
    };
    // (s + 5)^(n-1)
    let c = [&[5.0, 1.0][..], &[25.0, 10.0, 1.0], &[125.0, 75.0, 15.0, 1.0]][n - 2];
    let slope = std::array::from_fn(|i| if i + 1 == n { -1.0 } else { 0.0 });
    let config = Config {
        period_s: 1e-3,
        surface: Surface { c: padded(c), alpha_per_s: 1.0 },
        observers: std::array::from_fn(|i| (mask >> i & 1 == 1).then_some(gains)),
        reaching: ReachingLaw { k_l: 30.0, k_s: 0.5, epsilon: 0.01 },
        nominal: Nominal { gradient: slope, input_gain: 2.0 },
        options: Options::NEUTRAL
            .with_initial_estimates([0.5; 6])
            .with_limits(Limits::symmetric(50.0))
            .with_fallback(Fallback::Safe(0.25))
            .with_sigma_star_bound(3.0),
    };
    ControllerSpec { precision: Precision::F32, model, config: AnyConfig { n, padded: config } }
}

/// Every instance of the serial protocol matches the tick of this process: order, channels, model, start, fallback.
/// Some samples are not numbers or exceed every limit.
#[test]
fn every_instance_of_the_target_gives_the_bits_of_the_tick_in_process() {
    let mut carried = 0;
    let linear = Model::Linear(vec![-1.0, -2.0, -3.0, -1.0]);
    for model in [linear, Model::BenchmarkLibm, Model::BenchmarkMicromath] {
        let orders = if matches!(model, Model::Linear(_)) { 2..=4 } else { 2..=2 };
        for (n, r, mask) in orders.flat_map(|n| (1..=3).flat_map(move |r| (0..1_u8 << n).map(move |mask| (n, r, mask))))
        {
            let model = match &model {
                Model::Linear(row) => Model::Linear(row[4 - n..].to_vec()),
                other => other.clone(),
            };
            // Eq. (44) needs a higher order in this channel, so the design does not exist.
            let Ok(mut designed) = build(&spec(n, r, mask, model)) else { continue };
            let download = designed.download.expect("a design in f32");
            carried += 1;
            let mut host = Host::new();
            host.start(&(&download).into());
            let mut rng = Rng::new(u64::from(mask) << 8 | (n << 4 | r) as u64);
            let mut applied = f32::NAN;
            for k in 0..60 {
                let mut x = [0.0; MAX_N];
                for value in &mut x[..n] {
                    *value = match rng.integer(0, 39) {
                        0 => f32::NAN,
                        1 => f32::INFINITY,
                        2 => 1e30,
                        3 => -0.0,
                        _ => rng.within(-0.5, 0.5) as f32,
                    };
                }
                let here = designed.port.tick(&x[..n].iter().map(|value| f64::from(*value)).collect::<Vec<_>>());
                let here = here.expect("a controller in process always answers");
                let there = host.tick(x, applied);
                let place = format!("n = {n}, r = {r}, mask = {mask:04b}, tick {k}");
                assert_eq!((here.u as f32).to_bits(), there.u.to_bits(), "u, {place}");
                assert_eq!((here.sigma as f32).to_bits(), there.sigma.to_bits(), "sigma, {place}");
                assert_eq!((here.sigma_star as f32).to_bits(), there.sigma_star.to_bits(), "sigma*, {place}");
                assert_eq!(here.health, there.health, "{place}");
                for (here, there) in here.estimates.as_flattened().iter().zip(there.estimates.as_flattened()) {
                    assert_eq!((*here as f32).to_bits(), there.to_bits(), "estimates, {place}");
                }
                applied = if rng.chance(0.5) { there.u * 0.5 } else { f32::NAN };
                if applied.is_finite() {
                    designed.port.report_applied(f64::from(applied));
                }
            }
        }
    }
    // Eq. (44) requires order n - i in channel i < n. n = 2: 4 sets of channels, 3 orders, 3 models. n = 3 and n = 4:
    // without the channels that need more than r.
    assert_eq!(carried, 4 * 3 * 3 + (4 + 8 + 8) + (4 + 8 + 16));
}
