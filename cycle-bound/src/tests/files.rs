//! Tests with ELF files written byte by byte: overlapping sections, wrong symbols, long call chains, and corrupted
//! bytes.

use std::time::Instant;

use super::elf::{Symbol, elf};
use super::*;

fn read(sections: &[(u32, &[u16])], symbols: &[Symbol<'_>]) -> Image {
    Image::read(&elf(sections, symbols)).expect("well formed")
}

fn report(image: &Image, symbol: &str) -> Report {
    Answer::of(image, &question(symbol)).expect("good input").report
}

/// vdiv.f32 s0, s0, s1; bx lr
const DEAR: &[u16] = &[0xee80, 0x0a20, 0x4770];
const OVERLAY: u32 = 0x2000_0000;

#[test]
fn of_two_sections_at_one_address_a_functions_own_is_read() {
    let image = read(&[(OVERLAY, RETURN), (OVERLAY, DEAR)], &[("cheap", 1, 0, 2), ("dear", 2, 0, 6)]);
    assert_eq!(cycles(&report(&image, "cheap")).map(|(_, worst)| worst), Some(4));
    let dear = report(&image, "dear");
    assert_eq!(cycles(&dear).map(|(_, worst)| worst), Some(14 + 4));
    assert_eq!((dear.flash_bytes, dear.functions.as_slice()), (6, &["dear".to_owned()][..]));
    // Two sections that overlap partly.
    let shifted = read(&[(OVERLAY, &[0xbf00; 4]), (OVERLAY + 4, DEAR)], &[("cheap", 1, 0, 8), ("dear", 2, 0, 6)]);
    assert_eq!(cycles(&report(&shifted, "dear")).map(|(_, worst)| worst), Some(14 + 4));
}

#[test]
fn a_way_into_sections_at_one_address_is_declined_unless_it_begins_in_one() {
    // b.w to 0x2000_0000 from 0x2000_0010, and bl to a neighbour within the overlay.
    let jump: &[u16] = &[0xf7ff, 0xbff6];
    // bl leaf; bx lr; leaf: bx lr
    let within: &[u16] = &[0xf000, 0xf801, 0x4770, 0x4770];
    let image = read(
        &[(OVERLAY, RETURN), (OVERLAY, within), (OVERLAY + 0x10, jump)],
        &[("cheap", 1, 0, 2), ("within", 2, 0, 6), ("leaf", 2, 6, 2), ("outside", 3, 0, 4)],
    );
    let outside = report(&image, "outside");
    assert!(declined(&outside).contains("more than one section lies at 0x20000000"), "{:?}", outside.declined);
    assert_eq!(cycles(&report(&image, "within")).map(|(_, worst)| worst), Some(4 + 4 + 4));
    let mut traced = Answer::of(&image, &question("within")).expect("good input");
    traced.price(&[OVERLAY, OVERLAY + 6, OVERLAY + 4], None);
    assert!(declined_first(&traced.report).contains("more than one section lies at 0x20000000"));
}

fn declined_first(report: &Report) -> &str {
    report.declined.first().map_or("", String::as_str)
}

#[test]
fn a_size_or_an_address_that_cannot_be_is_told_and_nothing_wraps() {
    let huge = Image::read(&elf(&[(BASE, &[0xbf00, 0x4770])], &[("f", 1, 0, 0xee00_0000)])).expect_err("too long");
    assert!(huge.contains("`f` has 3992977408 bytes from 0x08000000 on, but its section ends at 0x08000004"), "{huge}");
    let behind = Image::read(&elf(&[(0xffff_fffe, &[0xbf00, 0x4770])], &[])).expect_err("behind all addresses");
    assert!(behind.contains("a section of 4 bytes at 0xfffffffe ends beyond the address space"), "{behind}");
    // Two symbols of the same bytes count the bytes once.
    let twice = read(&[(BASE, &[0xe7ff, 0x4770])], &[("f", 1, 0, 4), ("g", 1, 2, 2)]);
    assert_eq!(report(&twice, "f").flash_bytes, 4);
}

/// Any corrupted file gives a result or an error.
#[test]
fn no_spoiled_file_makes_it_panic() {
    let whole = elf(
        &[(BASE, &[CALLER, LEAF, TABLE, LOOP, STRAIGHT].concat()), (OVERLAY, DEAR), (OVERLAY, RETURN)],
        &[
            ("f", 1, 0, 12),
            ("leaf", 1, 12, 6),
            ("table", 1, 18, 14),
            ("loop", 1, 32, 10),
            ("straight", 1, 42, 20),
            ("dear", 2, 0, 6),
            ("cheap", 3, 0, 2),
        ],
    );
    let ask = |bytes: &[u8]| {
        let Ok(image) = Image::read(bytes) else { return 0 };
        let answers = ["f", "leaf", "table", "loop", "straight", "dear", "cheap"].map(|symbol| {
            let loops = if symbol == "loop" { vec!["loop+2=3".into()] } else { Vec::new() };
            Answer::of(&image, &Options { loops, ..question(symbol) }).is_ok()
        });
        answers.iter().filter(|answered| **answered).count()
    };
    assert_eq!(ask(&whole), 7);
    // The fast tier corrupts with two of the values.
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    let values = [0x80, 0xff, 0, 1, 2, 3, 0x7f, 0xfe];
    let values = &values[..if deep { values.len() } else { 2 }];
    for at in 0..whole.len() {
        ask(&whole[..at]);
        for &value in values {
            let mut spoiled = whole.clone();
            spoiled[at] = value;
            ask(&spoiled);
            // A whole word.
            for byte in spoiled.iter_mut().skip(at).take(4) {
                *byte = value;
            }
            ask(&spoiled);
        }
    }
    // Two words at once: two sizes, or an address and a size with an overflowing sum.
    let words = whole.len() / 4;
    for (first, second) in (0..words).flat_map(|first| (0..first).map(move |second| (first, second))) {
        let mut spoiled = whole.clone();
        for word in [first, second] {
            spoiled[4 * word..4 * word + 4].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
        }
        ask(&spoiled);
    }
    // Several random bytes at once, identical in every run.
    let mut random = 1_u32;
    let mut next = move || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as usize
    };
    for _ in 0..3000 {
        let mut spoiled = whole.clone();
        for _ in 0..=next() % 6 {
            let at = next() % spoiled.len();
            spoiled[at] = if next() % 2 == 0 { next() as u8 } else { values[next() % values.len()] };
        }
        ask(&spoiled);
    }
}

/// b.w to the address `by` bytes ahead.
fn jump(by: u32) -> [u16; 2] {
    let offset = by - 4;
    [0xf000 | (offset >> 12) as u16, 0xb800 | ((offset >> 1) & 0x7ff) as u16]
}

/// Runs in a thread with the stack size of a test: long call chains must not need more stack.
#[test]
fn a_chain_of_jumps_or_calls_may_be_long() {
    const JUMPS: u32 = 5000;
    const CALLS: u32 = 20_000;
    let names: Vec<String> = (0..=CALLS).map(|k| format!("f{k}")).collect();
    let mut code: Vec<u16> = (0..JUMPS).flat_map(|_| jump(4)).collect();
    code.extend(RETURN);
    let symbols: Vec<Symbol<'_>> = (0..=JUMPS).map(|k| (&*names[k as usize], 1, 4 * k, 2)).collect();
    let chain = report(&read(&[(BASE, &code)], &symbols), "f0");
    assert_eq!(cycles(&chain).map(|(_, worst)| worst), Some(4 * u64::from(JUMPS) + 4));
    assert_eq!(chain.functions.len(), JUMPS as usize + 1);
    // push {r4, lr}; bl +6, to behind the pop; pop {r4, pc}
    let mut code: Vec<u16> = (0..CALLS).flat_map(|_| [0xb510, 0xf000, 0xf801, 0xbd10]).collect();
    code.extend(RETURN);
    let symbols: Vec<Symbol<'_>> = (0..=CALLS).map(|k| (&*names[k as usize], 1, 8 * k, 2)).collect();
    let chain = report(&read(&[(BASE, &code)], &symbols), "f0");
    assert_eq!(cycles(&chain).map(|(_, worst)| worst), Some((3 + 4 + 7) * u64::from(CALLS) + 4));
    assert_eq!(chain.stack_bytes, Some(8 * CALLS));
}

/// Least time to analyse a function, s.
fn seconds(code: &[u16], loops: &[String]) -> f64 {
    let image = read(&[(BASE, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
    let options = Options { loops: loops.to_vec(), ..question("f") };
    let once = || {
        let started = Instant::now();
        let answer = Answer::of(&image, &options).expect("good input");
        assert!(answer.report.bound().is_some(), "{:?}", answer.report.declined);
        started.elapsed().as_secs_f64()
    };
    (0..3).map(|_| once()).fold(f64::INFINITY, f64::min)
}

/// Requires less than 24-fold time for an eightfold input in one of five rounds. A busy machine lengthens a round, not
/// all of them; quadratic work would be 64-fold in each.
fn assert_less_than_the_square(what: &str, time_s: impl Fn(u32) -> f64, [long, short]: [u32; 2]) {
    let mut ratios = Vec::new();
    let is_less = (0..5).any(|_| {
        let ratio = time_s(long) / time_s(short);
        ratios.push(ratio);
        ratio < 24.0
    });
    assert!(is_less, "{what}: {ratios:?}");
}

/// An eightfold loop body takes about eightfold time, not 64-fold.
#[test]
fn the_work_for_a_loop_grows_as_its_length_and_not_as_its_square() {
    // 1: adds r1, #1, repeated; subs r0, #1; bne.w 1b; bx lr
    let body = |length: u32| {
        let back = (2 * length + 2 + 4).wrapping_neg();
        let bne = [0xf440 | ((back >> 12) & 0x3f) as u16, 0xa800 | ((back >> 1) & 0x7ff) as u16];
        let code: Vec<u16> = (0..length).map(|_| 0x3101).chain([0x3801]).chain(bne).chain([0x4770]).collect();
        seconds(&code, &["f=3".to_owned()])
    };
    assert_less_than_the_square("one loop", body, [16_000, 2000]);
    // Several loops one behind the other: 1: subs r0, #1; bne 1b
    let many = |number: u32| {
        let code: Vec<u16> = (0..number).flat_map(|_| [0x3801, 0xd1fd]).chain([0x4770]).collect();
        seconds(&code, &(0..number).map(|k| format!("f+{}=2", 4 * k)).collect::<Vec<_>>())
    };
    assert_less_than_the_square("many loops", many, [4000, 500]);
}
