use std::sync::atomic::AtomicBool;

use super::term::{EQUAL, GREATER, LESS, UNORDERED};
use super::*;

const SLEW: (&[u8], &str) = (include_bytes!("../../tests/slew.elf"), include_str!("../../tests/slew.means"));
/// The tick of a controller for a flexible joint with limits, exported as C and compiled by GCC 12 at -Os.
const JOINT: (&[u8], &str) = (include_bytes!("../../tests/joint.elf"), include_str!("../../tests/joint.means"));
/// The same from the archive for C: any design, the start, what a state is not, the status.
const ARCHIVE: (&[u8], &str) = (include_bytes!("../../tests/archive.elf"), include_str!("../../tests/archive.means"));
/// The joint's tick of u alone as scheduled assembly: its constants are a table behind the code.
const SCHEDULED: (&[u8], &str) =
    (include_bytes!("../../tests/scheduled.elf"), include_str!("../../tests/scheduled.means"));

fn verdict(elf: &[u8], text: &str) -> Verdict {
    // Read where it is aligned.
    let aligned = elf.to_vec();
    let image = Image::read(&aligned).expect("an image");
    let expected = Expected::read(text).expect("a text");
    let function = image.find(&expected.function).expect("the function");
    held(&image, function, &expected, &AtomicBool::new(false)).expect("not stopped").verdict
}

/// Byte offset in the file of the one place where these halfwords stand.
fn place(elf: &[u8], halfwords: &[u16]) -> usize {
    let bytes: Vec<u8> = halfwords.iter().flat_map(|half| half.to_le_bytes()).collect();
    let found: Vec<usize> = (0..elf.len() - bytes.len()).filter(|&at| elf[at..].starts_with(&bytes)).collect();
    assert_eq!(found.len(), 1, "{halfwords:x?} stands {} times", found.len());
    found[0]
}

fn patched(elf: &[u8], from: &[u16], to: &[u16]) -> Vec<u8> {
    let (at, mut elf) = (place(elf, from), elf.to_vec());
    let bytes = to.iter().flat_map(|half| half.to_le_bytes());
    elf.splice(at..at + 2 * from.len(), bytes);
    elf
}

#[test]
fn a_function_is_what_its_text_says_and_nothing_else() {
    let (elf, text) = SLEW;
    assert_eq!(verdict(elf, text), Verdict::Same);
    for (from, to) in [
        ("sub x y", "sub y x"),
        ("greater step limit", "greater_equal step limit"),
        ("greater step limit", "not_equal step limit"),
        ("select over limit step", "select over step limit"),
        ("return next next", "return taken next"),
        ("add y taken", "add y step"),
    ] {
        let other = text.replace(from, to);
        assert!(matches!(verdict(elf, &other), Verdict::Differs(_)), "{to}");
    }
    // Two ways to say one thing: on neither side is NaN.
    let other = text.replace("= greater step limit", "= less limit step").replace("add y taken", "add taken y");
    assert_eq!(verdict(elf, &other), Verdict::Same);
}

#[test]
fn faults_in_a_linear_function_are_noticed() {
    let (elf, text) = SLEW;
    for (what, from, to) in [
        ("vadd for vsub", &[0xee30, 0x0a67][..], &[0xee30, 0x0a27][..]),
        ("NaN takes the other way", &[0xbfd8], &[0xbf98]),
        ("a lost store", &[0xed80, 0x0a00], &[0xbf00, 0xbf00]),
        ("another word of memory", &[0xed80, 0x0a00], &[0xed80, 0x0a01]),
        ("a register that is to be kept", &[0xed80, 0x0a00], &[0xeeb0, 0x8a40]),
        ("contracted", &[0xee37, 0x0aa0], &[0xeea7, 0x0aa0]),
        ("no return", &[0x4770], &[0xe7fe]),
    ] {
        let verdict = verdict(&patched(elf, from, to), text);
        assert_ne!(verdict, Verdict::Same, "{what}");
        // The others are nothing that a text could say.
        let differs = ["vadd for vsub", "NaN takes the other way", "a lost store"].contains(&what);
        assert_eq!(matches!(verdict, Verdict::Differs(_)), differs, "{what}: {verdict:?}");
    }
}

#[test]
fn a_text_that_is_wrong_is_told_by_its_line() {
    for (from, to, told) in [
        ("means 1", "means 2", "line 1: a text of this format begins with `means 1`"),
        ("in x number s0", "in x number s32", "line 4: `s32` is no place"),
        ("in x number s0", "in x either s0 1", "line 4: of `either` there are two: where it is true, where it is not"),
        ("in y number r0+0", "in y float r0+0", "line 3: no kind `float`"),
        ("sub x y", "sub x z", "line 9: no value `z` before this line"),
        ("sub x y", "pow x y", "line 9: no operation `pow` of two values"),
        ("over =", "step =", "line 10: `step` is two things"),
        ("return next next", "return next", "line 13: a return has a value for each of 2 results"),
        ("return next next", "return next next\nend", "line 14: more text behind the end"),
        ("return next next", "", "line 12: the text ends too early"),
    ] {
        let text = SLEW.1.replace(from, to);
        assert_eq!(Expected::read(&text).expect_err(to), told);
    }
}

#[test]
fn a_tick_of_a_compiler_is_the_recorded_one() {
    for (elf, text) in [JOINT, ARCHIVE, SCHEDULED] {
        assert_eq!(verdict(elf, text), Verdict::Same);
    }
}

#[test]
fn what_a_call_is_given_is_part_of_the_text() {
    let (elf, text) = ARCHIVE;
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        verdict(elf, &text.replacen(from, to, 1))
    };
    // An output of any size may lie in the state, and then the call is refused, without an output.
    assert_ne!(with("size r3 16\n", ""), Verdict::Same);
    // A state that neither waits nor runs is refused, and so is one of another design.
    assert_ne!(with("in started either r1+4 1173007166", "in started either r1+4 1"), Verdict::Same);
    assert_ne!(with("known r1+0 r0", "known r1+0 8"), Verdict::Same);
}

#[test]
fn faults_in_a_tick_are_noticed_wherever_they_are() {
    // Two change nothing: |a - 0| is |a + 0| where it is compared, and the other's sign goes into an absolute value.
    assert_eq!(missed(JOINT), ["vsub for vadd at 0x150", "the sign of a constant at 0x3da"]);
    // Nor these, on the way of an address that is NULL or not a multiple of 4, which the text has not.
    assert_eq!(missed(ARCHIVE), ["the other branch at 0x8e", "the other branch at 0x94"]);
    // Here too: an innovation of -1e-45 in place of -0 is lost in its product, and a sign goes into an absolute value.
    assert_eq!(missed(SCHEDULED), ["a bit of a constant at 0x3f8", "the sign of a constant at 0x40a"]);
}

/// Each instruction of these encodings, changed one at a time: what nobody notices.
fn missed((elf, text): (&[u8], &str)) -> Vec<String> {
    let elf = elf.to_vec();
    let image = Image::read(&elf).expect("an image");
    let expected = Expected::read(text).expect("a text");
    let tick = image.find(&expected.function).expect("the tick").clone();
    let code = image.bytes(tick.start).expect("its code")[..(tick.end - tick.start) as usize].to_vec();
    let begin = (0..elf.len()).find(|&at| elf[at..].starts_with(&code)).expect("it stands in the file");
    let half = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
    let decoder = Decoder::new(false).expect("a decoder");
    let mut faults: Vec<(&str, usize, Vec<u16>)> = Vec::new();
    let mut at = 0;
    while at < code.len() && !image.is_data(tick.start + at as u32) {
        let one = decoder.decode(&code[at..], tick.start + at as u32).swap_remove(0);
        let (low, size) = (half(at), one.size as usize);
        let high = if size == 4 { half(at + 2) } else { 0 };
        match one.stem() {
            "vadd" => faults.push(("vsub for vadd", at, vec![low, high | 0x40])),
            "vsub" => faults.push(("vadd for vsub", at, vec![low, high & !0x40])),
            "vmla" => faults.push(("contracted", at, vec![low | 0xa0, high])),
            "vstr" => faults.push(("a lost store", at, vec![0xbf00, 0xbf00])),
            // Of many, one is left out.
            "vstmdb" => faults.push(("a lost store", at, vec![low, high - 1])),
            "b" if !one.condition.is_empty() && size == 2 => faults.push(("the other branch", at, vec![low ^ 0x100])),
            "b" if !one.condition.is_empty() => faults.push(("the other branch", at, vec![low ^ 0x40, high])),
            _ => {}
        }
        at += size;
    }
    // Bits of the constants behind the code: the last of the fraction, the sign.
    for word in (at..code.len()).step_by(4) {
        faults.push(("a bit of a constant", word, vec![half(word) ^ 1]));
        faults.push(("the sign of a constant", word + 2, vec![half(word + 2) ^ 0x8000]));
    }
    let kinds: std::collections::BTreeSet<&str> = faults.iter().map(|(kind, ..)| *kind).collect();
    assert!(kinds.len() >= 5, "{kinds:?}");
    let mut missed = Vec::new();
    for (kind, at, halfwords) in &faults {
        let mut elf = elf.clone();
        let bytes: Vec<u8> = halfwords.iter().flat_map(|half| half.to_le_bytes()).collect();
        elf[begin + at..begin + at + bytes.len()].copy_from_slice(&bytes);
        if verdict(&elf, text) == Verdict::Same {
            missed.push(format!("{kind} at {at:#x}"));
        }
    }
    missed
}

/// Bit patterns at random, every third of them of a kind that is rare.
fn patterns() -> Vec<u32> {
    let rare = [0, 0x8000_0000, 1, 0x8000_0001, 0x3f80_0000, 0x7f80_0000, 0xff80_0000, 0x7fc0_0000, 0x7f7f_ffff];
    let mut seed = 1_u32;
    let random = (0..300).map(|_| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed ^ seed >> 15
    });
    rare.into_iter().chain(random).collect()
}

#[test]
fn the_identities_hold_for_all_bit_patterns() {
    let same = |a: f32, b: f32| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    let minus_zero = f32::from_bits(term::MINUS_ZERO);
    for a in patterns().into_iter().map(f32::from_bits) {
        assert!(same(a + minus_zero, a) && same(1.0 * a, a) && same(2.0 * a, a + a) && same(a / 1.0, a), "{a:?}");
        assert!(same(a.abs(), if a < 0.0 { -a } else { a + 0.0 }), "{a:?}");
        for b in patterns().into_iter().map(f32::from_bits) {
            assert!(same(a - b, a + -b) && same(a + b, b + a) && same(a * b, b * a), "{a:?} {b:?}");
            assert!(same(-a * b, -(a * b)) && same(a / -b, -(a / b)), "{a:?} {b:?}");
        }
    }
}

#[test]
fn what_follows_from_a_comparison_is_so() {
    let stands = |a: f32, b: f32| match a.partial_cmp(&b) {
        Some(std::cmp::Ordering::Less) => LESS,
        Some(std::cmp::Ordering::Equal) => EQUAL,
        Some(std::cmp::Ordering::Greater) => GREATER,
        None => UNORDERED,
    };
    let numbers = [f32::NEG_INFINITY, -2.0, -0.0, 0.0, 1.0, 2.0, f32::INFINITY, f32::NAN];
    for x in numbers {
        for known in numbers {
            for to in numbers {
                // What is learnt of x and one constant is asked of another one, and of the other sign of both.
                let mut terms = Terms::default();
                let script = [true];
                let mut path = Way::new(&mut terms, &script, false);
                let (input, first, second) =
                    (path.terms.input(0), path.terms.constant(known.to_bits()), path.terms.constant(to.to_bits()));
                assert!(path.stands(input, stands(x, known), first));
                let asked = path.answers().len();
                let set = stands(x, to);
                let (minus_input, minus_second) = (path.terms.neg(input), path.terms.neg(second));
                let turned = set & (EQUAL | UNORDERED) | (set & LESS) << 2 | (set & GREATER) >> 2;
                // Where the answer follows it is the true one; where it does not, the path asks, and is told "yes".
                assert!(path.stands(minus_input, turned, minus_second), "{x:?} {known:?} {to:?}");
                assert!(path.answers().len() <= asked + 1);
            }
        }
    }
}
