use std::sync::atomic::AtomicBool;

use super::graph::Op;
use super::term::{EQUAL, GREATER, LESS, Path as Way, Signs, Terms, UNORDERED};
use super::*;
use crate::tests::elf::elf;

const SLEW: (&[u8], &str) = (include_bytes!("../../tests/slew.elf"), include_str!("../../tests/slew.means"));
/// Tick of a controller for a flexible joint with limits, exported as C and compiled by GCC 12 at -Os.
const JOINT: (&[u8], &str) = (include_bytes!("../../tests/joint.elf"), include_str!("../../tests/joint.means"));
/// The joint's tick from the C library: any design, the start, invalid states, the status.
const ARCHIVE: (&[u8], &str) = (include_bytes!("../../tests/archive.elf"), include_str!("../../tests/archive.means"));
/// The joint's tick for u alone as scheduled assembly: its constants are a table behind the code.
const SCHEDULED: (&[u8], &str) =
    (include_bytes!("../../tests/scheduled.elf"), include_str!("../../tests/scheduled.means"));

/// Start of a motor's drive in C, compiled by GCC 12 at -O1: counts, their bits, and the effects of their signs.
const MOTOR: (&[u8], &str) = (include_bytes!("../../tests/motor.elf"), include_str!("../../tests/motor.means"));

fn verdict(elf: &[u8], text: &str) -> Verdict {
    verdict_of(elf, text, Effort::USUAL)
}

fn verdict_of(elf: &[u8], text: &str, effort: Effort) -> Verdict {
    // The ELF reader needs aligned bytes.
    let aligned = elf.to_vec();
    let image = Image::read(&aligned).expect("an image");
    let expected = Expected::read(text).expect("a text");
    let function = image.find(&expected.function).expect("the function");
    held(&image, function, &expected, effort, &AtomicBool::new(false)).expect("not stopped").verdict
}

/// Returns the byte offset in the file of the only place with these halfwords.
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
    // Two equivalent forms: NaN takes neither branch in both.
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
        // The other faults are outside of any specification.
        let differs = ["vadd for vsub", "NaN takes the other way", "a lost store", "a register that is to be kept"]
            .contains(&what);
        assert_eq!(matches!(verdict, Verdict::Differs(_)), differs, "{what}: {verdict:?}");
    }
}

/// Faults without an effect on a result or on any numeric input.
#[test]
fn what_is_not_the_functions_own_is_left_alone() {
    let told = |code: &[u16]| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, "means 1\nfunction f\nin a count r0\nout b count r0\nbegin\nreturn a\n")
    };
    let declined = |code: &[u16], reason: &str| {
        let told = told(code);
        assert!(matches!(&told, Verdict::Declined(why) if why.contains(reason)), "{code:x?}: {told:?}");
    };
    // bx lr; with a preceding str r0, [sp], which belongs to the caller.
    assert_eq!(told(&[0x4770]), Verdict::Same);
    declined(&[0x9000, 0x4770], "writes sp+0, which is not a result");
    // sub sp, #8; str r0, [sp]; ldr r0, [sp]; add sp, #8; and with the store before it, below the stack.
    assert_eq!(told(&[0xb082, 0x9000, 0x9800, 0xb002, 0x4770]), Verdict::Same);
    assert!(matches!(told(&[0xf84d, 0x0c08, 0xb082, 0x9800, 0xb002, 0x4770]), Verdict::Differs(_)));
    // sub sp, #8; str r0, [sp]; strb r0, [sp, #4]; ldrd r0, r1, [sp]; add sp, #8: also loads a half-written word,
    // without an effect. The word is in the function's own stack.
    let both = |from: u16| [0xb082, 0x9000, 0xf88d, 0x0004, 0xe9dd, from, 0xb002, 0x4770];
    assert_eq!(told(&both(0x0100)), Verdict::Same);
    assert!(matches!(told(&both(0x1000)), Verdict::Differs(_)));
    declined(&both(0x0101), "reads sp+0, whose content is unknown");
    // movs r1, #0; cmn r0, r1; ite hs; mov r0, #1; mov r0, #0: the addition has no carry, while a - 0 has no borrow.
    declined(&[0x2100, 0x42c8, 0xbf2c, 0x2001, 0x2000, 0x4770], "unknown flags");
}

/// Loops with a known count, in several forms. Endless and long loops are rejected.
#[test]
fn a_loop_of_a_known_count_is_followed_turn_by_turn() {
    let told = |code: &[u16], result: &str| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        let text = "means 1\nfunction f\nin a count r0\nout b count r0\nbegin\nnone = count 0\ntwice = plus a a\n";
        verdict(&elf, &format!("{text}four = plus twice twice\nreturn {result}\n"))
    };
    // movs r1, #turns; movs r2, #0; adds r2, r2, r0; subs r1, #1; bne to the sum; mov r0, r2; bx lr.
    let sum = |turns: u16| [0x2100 | turns, 0x2200, 0x1812, 0x3901, 0xd1fc, 0x4610, 0x4770];
    assert_eq!(told(&sum(4), "four"), Verdict::Same);
    assert!(matches!(told(&sum(5), "four"), Verdict::Differs(_)));
    assert!(matches!(told(&sum(64), "four"), Verdict::Differs(_)));
    // sub sp, #16; mov r1, sp; add r2, sp, #to; movs r3, #0; str r3, [r1], #4; cmp r1, r2; blo to the store;
    // ldr r0, [sp, #at]; add sp, #16; bx lr.
    let clear = |to: u16, at: u16| {
        [0xb084, 0x4669, 0xaa00 | to, 0x2300, 0xf841, 0x3b04, 0x4291, 0xd3fb, 0x9800 | at, 0xb004, 0x4770]
    };
    assert_eq!(told(&clear(4, 2), "none"), Verdict::Same);
    assert_eq!(told(&clear(4, 3), "none"), Verdict::Same);
    assert!(matches!(told(&clear(3, 3), "none"), Verdict::Differs(_)));
    for (code, reason) in [
        (&sum(65)[..], "a loop with more than 64 iterations"),
        // movs r1, r0; subs r1, #1; bne: the input is the loop count.
        (&[0x0001, 0x3901, 0xd1fd, 0x4770], "a loop with more than 64 iterations at 0x08000002 (f+0x2), where a = "),
        (&[0xe7fe], "a loop with more than 64 iterations"),
        (&clear(5, 3), "writes sp+0, which is not a result"),
        // movs r2, #2; subs r2, #1; bne; subs r1, #1; bne: a loop within a loop.
        (&[0x2102, 0x2202, 0x3a01, 0xd1fd, 0x3901, 0xd1fa, 0x4770], "a loop within a loop"),
        // cbz r0 into the loop body: adds r0, #1; subs r1, #1; bne.
        (&[0x2102, 0xb100, 0x3001, 0x3901, 0xd1fc, 0x4770], "a loop with two entries"),
    ] {
        let told = told(code, "a");
        assert!(matches!(&told, Verdict::Declined(why) if why.contains(reason)), "{code:x?}: {told:?}");
    }
}

/// Input bits of a word leave the bits above arbitrary; sign-extended low bits are two shifts.
#[test]
fn of_a_word_that_is_given_the_bits_that_are_named_are_known() {
    let told = |code: &[u16], inputs: &str, result: &str| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, &format!("means 1\nfunction f\n{inputs}out c count r0\nbegin\n{result}return v\n"))
    };
    let two = "in a truth r0 bit 0\nin b truth r0 bit 1\n";
    let sum =
        "none = count 0\none = count 1\ntwo = count 2\nx = select a one none\ny = select b two none\nv = plus x y\n";
    // bx lr; with a preceding and r0, r0, #3, and with #7. ubfx r0, r0, #1, #1 of 2 bits. and r0, r0, #2; lsrs r0, r0,
    // #1.
    assert_eq!(told(&[0xf000, 0x0003, 0x4770], two, sum), Verdict::Same);
    assert_ne!(told(&[0xf000, 0x0007, 0x4770], two, sum), Verdict::Same);
    assert!(matches!(told(&[0x4770], two, sum), Verdict::Differs(_)));
    let second = sum.replace("v = plus x y", "v = select b one none");
    assert_eq!(told(&[0xf3c0, 0x0040, 0x4770], two, &second), Verdict::Same);
    assert_eq!(told(&[0xf000, 0x0002, 0x0840, 0x4770], two, &second), Verdict::Same);
    assert_ne!(told(&[0xf3c0, 0x0041, 0x4770], two, &second), Verdict::Same);
    let first = sum.replace("v = plus x y", "v = select a one none");
    assert!(matches!(told(&[0xf3c0, 0x0040, 0x4770], two, &first), Verdict::Differs(_)));
    // lsls r0, r0, #18; asrs r0, r0, #18, and #17.
    let one = "in a count r0\n";
    assert_eq!(told(&[0x0480, 0x1480, 0x4770], one, "v = signed a 14\n"), Verdict::Same);
    assert!(matches!(told(&[0x0480, 0x1480, 0x4770], one, "v = signed a 15\n"), Verdict::Differs(_)));
    assert!(matches!(told(&[0x0480, 0x1440, 0x4770], one, "v = signed a 14\n"), Verdict::Differs(_)));
}

/// `bfi` inserts low bits, `orn` uses the complement of a register; the other bits stay.
#[test]
fn bits_are_put_into_a_word_where_the_instruction_says() {
    let told = |code: &[u16], result: &str| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        let text = "in a truth r0 bit 0\nin b truth r1 bit 0\nout v count r0\nbegin\nnone = count 0\none = count 1\n";
        verdict(&elf, &format!("means 1\nfunction f\n{text}{result}return v\n"))
    };
    let (at_3, at_1) = ([0xf361, 0x00c3], [0xf361, 0x0041]);
    let both =
        |high: &str| format!("x = select a one none\nhigh = count {high}\ny = select b high none\nv = plus x y\n");
    // and r0, r0, #1; and r1, r1, #1; bfi r0, r1, #3, #1, and #1, #1; bx lr.
    let code = |bfi: [u16; 2]| [&[0xf000, 0x0001, 0xf001, 0x0101][..], &bfi, &[0x4770]].concat();
    assert_eq!(told(&code(at_3), &both("8")), Verdict::Same);
    assert_eq!(told(&code(at_1), &both("2")), Verdict::Same);
    assert!(matches!(told(&code(at_1), &both("8")), Verdict::Differs(_)));
    assert!(matches!(told(&code(at_3), &both("9")), Verdict::Differs(_)));
    // and r0, r0, #1; and r1, r1, #1; orn r0, r0, r1, and r0, r1, r0; and r0, r0, #1; bx lr.
    let code = |orn: [u16; 2]| [&[0xf000, 0x0001, 0xf001, 0x0101][..], &orn, &[0xf000, 0x0001, 0x4770]].concat();
    let or_not = |a: &str, b: &str| format!("n = not {b}\no = or {a} n\nv = select o one none\n");
    assert_eq!(told(&code([0xea60, 0x0001]), &or_not("a", "b")), Verdict::Same);
    assert_eq!(told(&code([0xea61, 0x0000]), &or_not("b", "a")), Verdict::Same);
    assert!(matches!(told(&code([0xea60, 0x0001]), &or_not("b", "a")), Verdict::Differs(_)));
}

/// Truths at one place in memory are bits of a halfword: a byte store leaves the other byte unchanged.
#[test]
fn truths_of_one_place_in_memory_are_a_half_word() {
    let told = |code: &[u16]| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        let bits = "in a truth r1 bit 0\nout low truth r0+0 bit 0\nout high truth r0+0 bit 8\n";
        verdict(&elf, &format!("means 1\nfunction f\n{bits}begin\nreturn a true\n"))
    };
    // and r1, r1, #1; orr r1, r1, #0x100, and #0x200; strh r1, [r0], and strb; bx lr.
    assert_eq!(told(&[0xf001, 0x0101, 0xf441, 0x7180, 0x8001, 0x4770]), Verdict::Same);
    assert!(matches!(told(&[0xf001, 0x0101, 0xf441, 0x7100, 0x8001, 0x4770]), Verdict::Differs(_)));
    assert!(matches!(told(&[0xf001, 0x0101, 0xf441, 0x7180, 0x7001, 0x4770]), Verdict::Declined(_)));
}

/// `bx lr` with a bit that should be 0, `vstmia` of no register: a disassembler accepts both.
#[test]
fn what_the_architecture_leaves_open_is_declined() {
    let told = |code: &[u16]| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, "means 1\nfunction f\nin x number s10\nout y number r2+0\nbegin\nreturn x\n")
    };
    let open = |code: &[u16], of: &str| match told(code) {
        Verdict::Declined(reason) => assert!(reason.contains(of) && reason.contains("unpredictable"), "{reason}"),
        other => panic!("{other:?}"),
    };
    // vstr s10, [r2]; bx lr.
    assert_eq!(told(&[0xed82, 0x5a00, 0x4770]), Verdict::Same);
    open(&[0xed82, 0x5a00, 0x4771], "bx");
    open(&[0xec82, 0x5a00, 0x4770], "vstm");
}

/// A word composed of bytes, with arbitrary bytes above the used ones.
#[test]
fn of_a_word_of_bytes_the_ones_above_are_not_looked_at() {
    let code: &[u16] = &[
        0xb082, // sub sp, #8
        0x2141, 0xf8ad, 0x1000, // movs r1, #0x41; strh.w r1, [sp]
        0x9900, 0x9101, // ldr r1, [sp]; str r1, [sp, #4]
        0xf8bd, 0x1004, // ldrh.w r1, [sp, #4]
        0x6001, // str r1, [r0]
        0xb002, 0x4770, // add sp, #8; bx lr
    ];
    let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
    let told =
        |is: &str| verdict(&elf, &format!("means 1\nfunction f\nout v count r0+0\nbegin\nv = count {is}\nreturn v\n"));
    assert_eq!(told("65"), Verdict::Same);
    assert!(matches!(told("66"), Verdict::Differs(_)));
}

#[test]
fn a_text_that_is_wrong_is_told_by_its_line() {
    for (from, to, told) in [
        ("means 1", "means 2", "line 1: the first line must be `means 1`"),
        ("in x number s0", "in x number s32", "line 4: `s32` is not a place"),
        ("in x number s0", "in x either s0 1", "line 4: `either` needs two numbers, for true and for false"),
        ("in y number r0+0", "in y float r0+0", "line 3: no kind `float`"),
        ("in x number s0", "in x truth s0 bit 1", "line 4: an input needs its own place; bits of a word start at 0"),
        ("in x number s0", "in x number r0+0", "line 4: an input needs its own place; bits of a word start at 0"),
        ("sub x y", "sub x z", "line 9: no value `z` before this line"),
        ("sub x y", "pow x y", "line 9: no operation `pow` of two values"),
        ("over =", "step =", "line 10: `step` is defined twice"),
        ("return next next", "return next", "line 13: a return needs 2 values, one for each result"),
        ("return next next", "return next next\nend", "line 14: text after the end"),
        ("return next next", "", "line 12: the text ends too early"),
    ] {
        let text = SLEW.1.replace(from, to);
        assert_eq!(Expected::read(&text).expect_err(to), told);
    }
}

#[test]
fn a_tick_of_a_compiler_is_the_recorded_one() {
    for (elf, text) in [JOINT, ARCHIVE, SCHEDULED, MOTOR] {
        assert_eq!(verdict(elf, text), Verdict::Same);
    }
}

#[test]
fn swept_or_case_by_case_it_is_the_same_as_followed_as_a_whole() {
    for (elf, text) in [SLEW, JOINT, ARCHIVE, SCHEDULED, MOTOR] {
        for effort in [SWEPT, PARTED] {
            assert_eq!(verdict_of(elf, text, effort), Verdict::Same);
        }
    }
}

/// One case, without a direct comparison of the whole.
const SWEPT: Effort = Effort { whole: 0, many: usize::MAX, cases: 1, ..Effort::USUAL };
/// Case distinction while any selection is left.
const PARTED: Effort = Effort { whole: 0, small: 4, many: 0, ..Effort::USUAL };

#[test]
fn what_a_call_is_given_is_part_of_the_text() {
    let (elf, text) = ARCHIVE;
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        verdict(elf, &text.replacen(from, to, 1))
    };
    // The output may overlap the state; the call is then rejected, without an output.
    assert_ne!(with("size r3 16\n", ""), Verdict::Same);
    // A state that neither waits nor runs is rejected, and so is a state of another design.
    assert_ne!(with("in started either r1+4 1173007166", "in started either r1+4 1"), Verdict::Same);
    assert_ne!(with("known r1+0 r0", "known r1+0 8"), Verdict::Same);
}

fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

#[test]
fn faults_in_a_tick_are_noticed_wherever_they_are() {
    let usual = Effort::USUAL;
    // Two faults have no effect: a comparison treats |a - 0| as |a + 0|, and the other sign ends in an absolute value.
    // The fast tier omits this test, the longest one.
    if deep() {
        assert_eq!(missed(JOINT, usual), ["vsub for vadd at 0x150", "the sign of a constant at 0x3da"]);
    }
    // These faults are on the path of an address that is NULL or unaligned, which the specification excludes.
    assert_eq!(missed(ARCHIVE, usual), ["the other branch at 0x8e", "the other branch at 0x94"]);
    // No effect either: an innovation of -1e-45 in place of -0 vanishes in its product, and a sign ends in an absolute
    // value.
    assert_eq!(missed(SCHEDULED, usual), ["a bit of a constant at 0x3f8", "the sign of a constant at 0x40a"]);
    // A sign-known number of 14 bits has at most 13 magnitude bits and no wrap; a count is not -0, added or subtracted.
    assert_eq!(missed(MOTOR, usual), ["another width at 0x1a", "vsub for vadd at 0x48", "shifted by another at 0xda"]);
}

/// Only one numeric input, so no value is separated by numbers: every equality has a proof.
#[test]
fn what_is_shown_case_by_case_or_swept_is_shown_without_numbers() {
    let all = [(PARTED, JOINT, 2), (PARTED, MOTOR, 3), (SWEPT, JOINT, 2), (SWEPT, MOTOR, 3)];
    // The fast tier runs the motor only.
    for (effort, of, harmless) in all.iter().skip(usize::from(!deep())).step_by(if deep() { 1 } else { 2 }) {
        assert_eq!(missed(*of, Effort { tried: 1, ..*effort }).len(), *harmless);
    }
}

/// Changes each instruction with these encodings, one at a time; returns the changes without an effect.
fn missed((elf, text): (&[u8], &str), effort: Effort) -> Vec<String> {
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
            "ubfx" => faults.push(("another width", at, vec![low, high ^ 1])),
            "lsrs" if size == 2 => faults.push(("shifted by another", at, vec![low ^ 0x40])),
            "str" if size == 2 => faults.push(("a lost store", at, vec![0xbf00])),
            "vstr" => faults.push(("a lost store", at, vec![0xbf00, 0xbf00])),
            // Only one store of a list is lost.
            "vstmdb" => faults.push(("a lost store", at, vec![low, high - 1])),
            "b" if !one.condition.is_empty() && size == 2 => faults.push(("the other branch", at, vec![low ^ 0x100])),
            "b" if !one.condition.is_empty() => faults.push(("the other branch", at, vec![low ^ 0x40, high])),
            _ => {}
        }
        at += size;
    }
    // Bits of the constants behind the code: the lowest bit of the fraction, and the sign.
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
        if verdict_of(&elf, text, effort) == Verdict::Same {
            missed.push(format!("{kind} at {at:#x}"));
        }
    }
    missed
}

/// Random bit patterns; every third one is a rare kind.
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
                // Uses the relation of x to one constant for another constant, and for the opposite signs of both.
                let mut terms = Terms::default();
                let script = [true];
                let mut path = Way::new(&mut terms, &script, Signs::Whole);
                let (input, first, second) =
                    (path.terms.input(0), path.terms.constant(known.to_bits()), path.terms.constant(to.to_bits()));
                assert!(path.stands(input, stands(x, known), first));
                let asked = path.answers().len();
                let set = stands(x, to);
                let (minus_input, minus_second) = (path.terms.neg(input), path.terms.neg(second));
                let turned = set & (EQUAL | UNORDERED) | (set & LESS) << 2 | (set & GREATER) >> 2;
                // A derived outcome must be true; otherwise the path decides, here with "yes".
                assert!(path.stands(minus_input, turned, minus_second), "{x:?} {known:?} {to:?}");
                assert!(path.answers().len() <= asked + 1);
            }
        }
    }
}

/// Random numbers, identical in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }

    fn of<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// Nested random operations and their values for some inputs: the simplified terms have the same bits.
#[test]
fn what_a_term_is_simplified_to_has_its_value() {
    let patterns = patterns();
    let mut random = Random(1);
    let masks = [1, 0x3f, 0x3fff, 0x1_ffff, !0x3f, !0x3fff, !0x3fc0, 0x8000_0000, 0x2000, 0x1_0000, u32::MAX];
    for _ in 0..2000 {
        let mut terms = Terms::default();
        let inputs: Vec<[u32; 4]> = (0..12).map(|_| std::array::from_fn(|_| random.of(&patterns))).collect();
        let values = |value: &dyn Fn(&[u32; 4]) -> u32| inputs.iter().map(value).collect::<Vec<u32>>();
        // Two counts, two floats.
        let mut counts: Vec<_> = (0..2).map(|k| (terms.input(k), values(&|inputs| inputs[k]))).collect();
        let mut floats: Vec<_> = (2..4).map(|k| (terms.input(k), values(&|inputs| inputs[k]))).collect();
        for _ in 0..12 {
            let (a, of_a) = counts[random.below(counts.len())].clone();
            let (b, of_b) = counts[random.below(counts.len())].clone();
            let zip = |f: &dyn Fn(u32, u32) -> u32| of_a.iter().zip(&of_b).map(|(a, b)| f(*a, *b)).collect::<Vec<_>>();
            let (with, by) = (random.of(&masks), random.below(32) as u32);
            let (mask, of_by) = (terms.constant(with), terms.constant(by));
            counts.push(match random.below(9) {
                0 => (terms.plus(a, b, 1), zip(&|a, b| a.wrapping_add(b))),
                1 => (terms.plus(a, b, u32::MAX), zip(&|a, b| a.wrapping_sub(b))),
                2 => (terms.plus(a, mask, 1), zip(&|a, _| a.wrapping_add(with))),
                3 => (terms.bitwise("and", a, mask), zip(&|a, _| a & with)),
                4 => (terms.bitwise("eor", a, mask), zip(&|a, _| a ^ with)),
                5 => (terms.bitwise("lsr", a, of_by), zip(&|a, _| a >> by)),
                6 => (terms.shifted_left(a, by), zip(&|a, _| a << by)),
                7 => (terms.low_bits(a, 32 - by), zip(&|a, _| ((a << by) as i32 >> by) as u32)),
                _ => (terms.bitwise("orr", a, mask), zip(&|a, _| a | with)),
            });
            let (a, of_a) = floats[random.below(floats.len())].clone();
            let (b, of_b) = floats[random.below(floats.len())].clone();
            let (count, of_count) = counts[random.below(counts.len())].clone();
            let zip = |f: &dyn Fn(f32, f32) -> f32| {
                let pairs = of_a.iter().zip(&of_b).map(|(a, b)| (f32::from_bits(*a), f32::from_bits(*b)));
                pairs.map(|(a, b)| f(a, b).to_bits()).collect::<Vec<_>>()
            };
            let (one, times) = (terms.constant(random.of(&patterns)), random.below(4));
            let factor = f32::from_bits(terms.bits(one).expect("a constant"));
            let zero = terms.constant(0);
            floats.push(match times + random.below(5) {
                0 => (terms.add(a, b), zip(&|a, b| a + b)),
                1 => (terms.sub(a, b), zip(&|a, b| a - b)),
                2 => (terms.mul(a, b), zip(&|a, b| a * b)),
                3 => (terms.mul(a, one), zip(&|a, _| a * factor)),
                4 => (terms.add(a, zero), zip(&|a, _| a + 0.0)),
                5 => (terms.neg(a), zip(&|a, _| -a)),
                _ => (terms.number_of(count), of_count.iter().map(|bits| (*bits as i32 as f32).to_bits()).collect()),
            });
        }
        for (inputs, at) in inputs.iter().zip(0..) {
            for (term, values) in &counts {
                assert_eq!(terms.value(*term, inputs), values[at], "{}", terms.shown(*term, &names(), 9));
            }
            for (term, values) in &floats {
                let (found, wanted) = (terms.value(*term, inputs), values[at]);
                let nan = |bits| f32::from_bits(bits).is_nan();
                assert!(found == wanted || nan(found) && nan(wanted), "{}", terms.shown(*term, &names(), 9));
            }
        }
    }
}

fn names() -> Vec<String> {
    (0..4).map(|k| format!("in{k}")).collect()
}

/// Quotients, masks and shifts of counts with a known sign.
#[test]
fn counts_whose_sign_is_known_have_their_values() {
    let mut random = Random(2);
    let patterns = patterns();
    // A count plus this number may wrap, and may be the least number.
    for (width, more) in [(32, 0), (14, 0), (20, 0), (5, 0), (9, 0x8000_0003), (9, 0x8000_0000), (9, 0x7fff_fff0)] {
        for by in [0, 4, 5, 13, 14, 20, 30] {
            for below in [false, true] {
                let (mut terms, script) = (Terms::default(), [below]);
                let mut path = Way::new(&mut terms, &script, Signs::Known);
                let (input, zero) = (path.terms.input(0), path.terms.constant(0));
                let (bits, more_of) = (path.terms.low_bits(input, width), path.terms.constant(more));
                let count = path.terms.plus(bits, more_of, 1);
                assert_eq!(path.ordered(term::Order::Less, count, zero), below);
                let of = |path: &mut Way<'_>, bits: u32| path.terms.constant(bits);
                let (divisor, shift) = (of(&mut path, 1 << by), of(&mut path, by));
                let (low, high) = (of(&mut path, (1 << by) - 1), of(&mut path, u32::MAX << by));
                let turned = path.terms.plus(zero, count, u32::MAX);
                let sized = if below { turned } else { count };
                let found = [
                    path.quotient(count, divisor),
                    path.bitwise("lsr", sized, shift),
                    path.bitwise("and", sized, low),
                    path.bitwise("and", sized, high),
                    path.bitwise("eor", sized, divisor),
                ];
                for _ in 0..200 {
                    let input = random.of(&patterns);
                    let count = ((input << (32 - width)) as i32 >> (32 - width)).wrapping_add(more as i32);
                    if (count < 0) != below {
                        continue;
                    }
                    let sized = count.unsigned_abs();
                    let wanted = [
                        count.wrapping_div(1 << by) as u32,
                        sized >> by,
                        sized & ((1 << by) - 1),
                        sized & u32::MAX << by,
                        sized ^ 1 << by,
                    ];
                    assert_eq!(found.map(|term| terms.value(term, &[input])), wanted, "{count}, {width} bits, {by}");
                }
            }
        }
    }
}

/// A random value: an operation, its operands and a number, each chosen from the existing values.
type Step = [usize; 5];

fn steps(random: &mut Random, many: usize) -> Vec<Step> {
    (0..many).map(|_| [0; 5].map(|_| random.below(1 << 30))).collect()
}

/// Random values of three kinds: floats, counts, truths.
#[derive(Clone)]
struct Made {
    floats: Vec<Node>,
    counts: Vec<Node>,
    truths: Vec<Node>,
}

impl Made {
    const FLOATS: [u32; 10] = [
        0,
        0x8000_0000,
        0x3f80_0000,
        0xbf80_0000,
        0x4000_0000,
        0x3f80_0001,
        0x7f80_0000,
        0xff80_0000,
        0x7fc0_0000,
        0x7f7f_ffff,
    ];
    const COUNTS: [u32; 9] = [0, 1, 2, 4, 7, 0x3fff, 0x8000_0000, 0x7fff_ffff, u32::MAX];

    /// Starts with three floats, two counts and three truths.
    fn new(graph: &mut Graph) -> Self {
        let mut made = Self {
            floats: (0..3).map(|at| graph.input(at)).collect(),
            counts: (3..5).map(|at| graph.input(at)).collect(),
            truths: (5..8).map(|at| graph.given(at)).collect(),
        };
        made.floats.extend(Self::FLOATS[..6].iter().map(|bits| graph.constant(*bits)));
        made.counts.extend(Self::COUNTS[..3].iter().map(|bits| graph.constant(*bits)));
        made
    }

    fn tried(random: &mut Random, patterns: &[u32]) -> inputs::Trial {
        let words = (0..5).map(|at| match (random.below(4), at) {
            (0, _) => random.of(patterns),
            (_, 0..3) => random.of(&Self::FLOATS),
            _ => random.of(&Self::COUNTS),
        });
        let words = words.zip(0..).map(|(bits, at)| match at {
            // All NaN are equal.
            0..3 if f32::from_bits(bits).is_nan() => 0x7fc0_0000,
            _ => bits,
        });
        let mut words: Vec<u32> = words.collect();
        words.extend((0..3).map(|_| random.below(2) as u32));
        (random.below(64) as u32, words)
    }

    /// Adds a value. With `threaded`, an operation on a selection may become a selection between operations.
    fn add(&mut self, graph: &mut Graph, [kind, i, j, k, with]: Step, threaded: bool) {
        let of = |values: &[Node], at: usize| match at % 3 {
            // Prefers the latest values.
            0 => values[values.len() - 1 - at / 3 % values.len().min(6)],
            _ => values[at / 3 % values.len()],
        };
        let (a, b) = (of(&self.floats, i), of(&self.floats, j));
        let (c, d) = (of(&self.counts, i), of(&self.counts, j));
        let (t, u, v) = (of(&self.truths, k), of(&self.truths, i), of(&self.truths, j));
        let float = Self::FLOATS[with % Self::FLOATS.len()];
        let float = graph.constant(float);
        let b = if with / 16 % 3 == 0 { float } else { b };
        let count = Self::COUNTS[with % Self::COUNTS.len()];
        let count = graph.constant(count);
        let d = if with / 16 % 3 == 0 { count } else { d };
        let by = 1 + with as u32 % 31;
        let set = 1 + (with / 64 % 14) as u8;
        let threaded = threaded && with / 1024 % 2 == 0;
        let made = |graph: &mut Graph, of: Node, value: &dyn Fn(&mut Graph, Node) -> Node| match graph.ops[of] {
            Op::Select(t, x, y) if threaded => {
                let (x, y) = (value(graph, x), value(graph, y));
                graph.select(t, x, y)
            }
            _ => value(graph, of),
        };
        match kind % 32 {
            0 => self.floats.push(made(graph, a, &|graph, a| graph.add(a, b))),
            1 => self.floats.push(made(graph, a, &|graph, a| graph.sub(a, b))),
            2 => self.floats.push(made(graph, a, &|graph, a| graph.mul(a, b))),
            3 => self.floats.push(made(graph, a, &|graph, a| graph.two("div", a, b))),
            4 => self.floats.push(made(graph, a, &|graph, a| graph.neg(a))),
            5 => self.floats.push(made(graph, a, &|graph, a| graph.one("abs", a))),
            6 => self.floats.push(made(graph, c, &|graph, c| graph.one("number_of", c))),
            7 => self.floats.push(made(graph, c, &|graph, c| graph.one("number_without_sign_of", c))),
            8..12 => self.floats.push(graph.select(t, a, b)),
            12 => self.counts.push(made(graph, c, &|graph, c| graph.plus(c, d, 1))),
            13 => self.counts.push(made(graph, c, &|graph, c| graph.plus(c, d, u32::MAX))),
            14 => self.counts.push(made(graph, c, &|graph, c| graph.low_bits(c, by))),
            15 => self.counts.push(made(graph, c, &|graph, c| graph.shifted_right(c, by))),
            16 => {
                let name = ["and", "orr", "eor", "times", "quotient"][with / 64 % 5];
                self.counts.push(made(graph, c, &|graph, c| graph.two(name, c, count)));
            }
            17..20 => self.counts.push(graph.select(t, c, d)),
            20..25 => self.truths.push(made(graph, a, &|graph, a| graph.stands(a, set, b))),
            25 => self.truths.push(made(graph, c, &|graph, c| graph.ordered(term::Order::Less, c, d))),
            26 => self.truths.push(made(graph, c, &|graph, c| graph.ordered(term::Order::Below, c, d))),
            27 => self.truths.push(made(graph, c, &|graph, c| graph.ordered(term::Order::Equal, c, d))),
            28 => self.truths.push(graph.and(t, u)),
            29 => self.truths.push(graph.not(t)),
            30 => {
                let yes = graph.truth(true);
                self.truths.push(graph.select(t, yes, u));
            }
            _ => self.truths.push(graph.select(t, u, v)),
        }
    }

    fn of(graph: &mut Graph, steps: &[Step], threaded: bool) -> Self {
        let mut made = Self::new(graph);
        for step in steps {
            made.add(graph, *step, threaded);
        }
        made
    }

    fn all(&self) -> Vec<Node> {
        [&self.floats[..], &self.counts, &self.truths].concat()
    }
}

/// A specification with these inputs only.
fn text_of_inputs() -> Expected {
    let text = "means 1\nfunction f\nin a number s0\nin b number s1\nin c number s2\nin d count r0\nin e count r1\n\
                in t truth r2\nin u truth r3\nin v truth r4\nout y count r9\nbegin\nreturn d\n";
    Expected::read(text).expect("a text")
}

/// Random nested values in nested cases, with some values joined before: the bits stay equal for all inputs of the
/// case.
#[test]
fn in_a_case_every_value_is_what_it_was() {
    let mut random = Random(3);
    let patterns = patterns();
    let (expected, stop) = (text_of_inputs(), AtomicBool::new(false));
    let (mut of_a_case, mut joined) = ([0; 4], 0);
    for _ in 0..600 {
        let mut graph = Graph::default();
        let made = Made::of(&mut graph, &steps(&mut random, 50), false);
        let mut roots = made.all();
        let truths: Vec<Node> = made.truths;
        let begin = roots.len() - truths.len();
        let all: Vec<inputs::Trial> = (0..60).map(|_| Made::tried(&mut random, &patterns)).collect();
        // The inputs of the case, and the values of the roots for them.
        let of = |graph: &Graph, roots: &[Node], tried: &inputs::Trial| {
            let mut values = vec![0; graph.ops.len()];
            inputs::compute(graph, tried, &mut values);
            roots.iter().map(|root| values[*root]).collect::<Vec<u32>>()
        };
        let mut so: Vec<(inputs::Trial, Vec<u32>)> =
            all.iter().map(|tried| (tried.clone(), of(&graph, &roots, tried))).collect();
        for level in 0..4 {
            for (tried, values) in &so {
                of_a_case[level] += 1;
                assert_eq!(&of(&graph, &roots, tried), values, "level {level}");
            }
            if random.below(2) == 0 {
                let pairs: Vec<(Node, Node)> = (0..4).map(|_| (random.of(&roots), random.of(&roots))).collect();
                let blind: Vec<inputs::Trial> =
                    so.iter().take(random.below(6)).map(|(tried, _)| tried.clone()).collect();
                let mut sweep = sweep::Sweep::new(&mut graph, &expected, &pairs);
                let left = sweep.unequal(&pairs, &blind, &stop).expect("not stopped");
                let nodes: Vec<Node> = (0..graph.ops.len()).collect();
                for (tried, _) in &so {
                    let values = of(&graph, &nodes, tried);
                    for node in 0..nodes.len() {
                        let (with, turned) = graph.found(node);
                        joined += usize::from(with != node);
                        assert_eq!(values[node], if turned { 1 - values[with] } else { values[with] });
                    }
                    for (at, (a, b)) in pairs.iter().enumerate() {
                        assert!(left.contains(&at) || values[*a] == values[*b]);
                    }
                }
            }
            let at = begin + random.below(truths.len());
            let truth = random.below(2) == 0;
            let (case, of_case) = graph.case(roots[at], truth, &roots);
            (graph, roots) = (case, of_case);
            so.retain(|(_, values)| values[at] == u32::from(truth));
        }
    }
    assert!(of_a_case[3] > 1000 && joined > 1000, "{of_a_case:?} {joined}");
}

/// Two values that differ for an input are never proved equal, by cases or by the sweep, with any inputs.
#[test]
fn what_differs_is_never_shown_to_be_equal() {
    let mut random = Random(4);
    let patterns = patterns();
    let (expected, stop) = (text_of_inputs(), AtomicBool::new(false));
    let (mut shown, mut different) = (0, 0);
    for round in 0..2000 {
        let mut graph = Graph::default();
        let mut steps = steps(&mut random, 20 + round % 50);
        // Prefers selections and comparisons of few numbers.
        for step in steps.iter_mut().filter(|_| round % 2 == 0) {
            step[0] = [0, 4, 8, 9, 10, 12, 17, 18, 20, 21, 22, 25, 27, 28, 29, 30, 31][step[0] % 17];
        }
        let mut changed = steps.clone();
        for _ in 0..random.below(3) {
            let at = random.below(steps.len());
            // Keeps the kind of the value.
            changed[at][1 + random.below(4)] = random.below(1 << 30);
        }
        let one = Made::of(&mut graph, &steps, false).all();
        let other = Made::of(&mut graph, &changed, true).all();
        let pairs: Vec<(Node, Node)> = one.into_iter().zip(other).filter(|(a, b)| a != b).collect();
        // A few of the latest pairs, of all kinds.
        let pairs: Vec<(Node, Node)> = (0..pairs.len().min(1 + round % 12)).map(|_| random.of(&pairs)).collect();
        let mut differs = vec![false; pairs.len()];
        let mut all = Vec::new();
        let mut values = vec![0; graph.ops.len()];
        for _ in 0..400 {
            let tried = Made::tried(&mut random, &patterns);
            inputs::compute(&graph, &tried, &mut values);
            let mut is_told = false;
            for (differs, (a, b)) in differs.iter_mut().zip(&pairs) {
                is_told |= values[*a] != values[*b];
                *differs |= values[*a] != values[*b];
            }
            if !is_told {
                all.push(tried);
            }
        }
        all.truncate(random.below(4) * random.below(4));
        // With and without cases, with values joined early or only without remaining selections.
        let effort = Effort {
            tried: 0,
            whole: random.of(&[0, 0, 3, 64]),
            small: random.of(&[0, 0, 1, 4, 16]),
            many: random.of(&[0, 1, 2, 4, 8, usize::MAX]),
            cases: random.of(&[1, 4, 16, 64]),
        };
        let mut cases = Cases::new(&expected, effort, &stop);
        let left = cases.unequal(&mut graph, &pairs, &all).expect("not stopped");
        let same: Vec<(Node, Node)> = (0..pairs.len()).filter(|at| !left.contains(at)).map(|at| pairs[at]).collect();
        let told = inputs::difference(&graph, &expected, &[], &same, 200);
        assert!(told.is_ok(), "round {round}: {told:?}");
        for (at, differs) in differs.iter().enumerate() {
            different += usize::from(*differs);
            shown += usize::from(!left.contains(&at));
            assert!(!differs || left.contains(&at), "round {round}, {at}");
        }
    }
    assert!(shown > 1000 && different > 1000, "{shown} {different}");
}

/// An assumption contains a selection that it decides itself; it must prove this selection and nothing else.
#[test]
fn what_is_supposed_of_a_choice_that_it_decides_is_still_shown_and_no_more() {
    let (expected, stop) = (text_of_inputs(), AtomicBool::new(false));
    for cases in 1..8 {
        for many in [0, 1, 2, 8] {
            let mut graph = Graph::default();
            let w = graph.input(0);
            let [one, two, three, four, five, ten] =
                [1.0_f32, 2.0, 3.0, 4.0, 5.0, 10.0].map(|number| graph.constant(number.to_bits()));
            // The value is w above 10, else 3: it is at most 5 exactly where w is not above 10.
            let q = graph.stands(w, GREATER, ten);
            let x = graph.select(q, w, three);
            let p = graph.stands(x, LESS | EQUAL, five);
            let (at_most, above) = (graph.select(q, one, two), graph.select(q, three, four));
            let found = graph.select(p, at_most, above);
            let pairs =
                [(two, three), (two, four), (one, three), (one, four)].map(|(a, b)| (found, graph.select(p, a, b)));
            let effort = Effort { whole: 0, small: 0, many, cases, ..Effort::USUAL };
            let left = Cases::new(&expected, effort, &stop).unequal(&mut graph, &pairs, &[]).expect("not stopped");
            assert!(left.ends_with(&[1, 2, 3]), "{left:?}");
        }
    }
}

/// A false `p and q` decides neither operand, but no path of that case has both true. The specification may decide them
/// one after the other where the machine code has both already.
#[test]
fn what_is_supposed_of_two_truths_together_is_known_on_every_path() {
    let (expected, stop) = (text_of_inputs(), AtomicBool::new(false));
    let mut graph = Graph::default();
    let [x, y, bound] = [0, 1, 2].map(|at| graph.input(at));
    let (p, q) = (graph.stands(x, GREATER, bound), graph.stands(y, GREATER, bound));
    let both = graph.and(p, q);
    let inner = graph.select(q, x, y);
    let (machine, text) = (graph.select(both, x, y), graph.select(p, inner, y));
    for truth in [true, false] {
        let (mut case, roots) = graph.case(both, truth, &[machine, text, x, y]);
        let [machine, text, x, y] = roots[..] else { panic!("four roots") };
        assert_eq!(machine, if truth { x } else { y });
        for (other, is_same) in [(if truth { x } else { y }, true), (if truth { y } else { x }, false)] {
            let mut sweep = sweep::Sweep::new(&mut case, &expected, &[(other, text)]);
            assert_eq!(sweep.is_followed(&[(other, text)], 8), is_same);
            let left = Cases::new(&expected, SWEPT, &stop).unequal(&mut case, &[(other, text)], &[]);
            assert_eq!(left, Ok(if is_same { vec![] } else { vec![0] }));
        }
    }
}

/// A condition that is not a truth would never hold on a path, and always for a number.
#[test]
fn a_condition_that_is_no_truth_is_no_text() {
    // movs r0, #0; bx lr
    let code = [0x2000, 0x4770];
    let elf = elf(&[(0x0800_0000, &code)], &[("f", 1, 0, 4)]);
    let head = "means 1\nfunction f\nin a count r0\nin d number s0\nout o count r0\nbegin\n";
    // 1.1111 is the only number with this square.
    let squared = "sq = mul d d\nt = equal sq k\nb = select t one zero\n";
    let constants = format!("k = number {}\none = count 1\nzero = count 0\n", (1.1111_f32 * 1.1111).to_bits());
    for body in ["x = select a b zero\nreturn x\n", "if a\nreturn b\nelse\nreturn zero\nend\n"] {
        let text = format!("{head}{constants}{squared}{body}");
        match Expected::read(&text) {
            Err(told) => assert!(told.contains("is not a truth"), "{told}"),
            Ok(_) => panic!("{:?}", verdict(&elf, &text)),
        }
    }
}

/// A word is not a case: a selection by a word is not proved by a case without any path.
#[test]
fn a_word_is_no_case() {
    let (expected, stop) = (text_of_inputs(), AtomicBool::new(false));
    let mut graph = Graph::default();
    let [x, y, word] = [0, 1, 3].map(|at| graph.input(at));
    let pairs = [(graph.select(word, x, y), graph.select(word, y, x))];
    for effort in [PARTED, SWEPT] {
        assert_eq!(Cases::new(&expected, effort, &stop).unequal(&mut graph, &pairs, &[]), Ok(vec![0]));
    }
}

/// A function that returns its argument, with one more instruction before the return, alone and behind an IT. The
/// result must differ wherever this instruction could do anything else.
#[test]
fn what_ends_or_leaves_a_path_is_seen_and_its_condition_too() {
    let told = |code: &[u16]| {
        let elf = elf(&[(0x0800_0000, code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, "means 1\nfunction f\nin a count r0\nout b count r0\nbegin\nreturn a\n")
    };
    // Behind push {r4, lr}, for the returns that pop.
    let returning: [(&[u16], bool); 4] =
        [(&[0x4770], false), (&[0x46f7], false), (&[0xbd10], true), (&[0xe8bd, 0x8010], true)];
    for (one, is_popped) in returning {
        let push: &[u16] = if is_popped { &[0xb510] } else { &[] };
        let end: &[u16] = if is_popped { &[0xbd10] } else { &[0x4770] };
        assert_eq!(told(&[push, one].concat()), Verdict::Same, "{one:x?}");
        assert_eq!(told(&[push, &[0x2800, 0xbf08], one, end].concat()), Verdict::Same, "{one:x?}");
        // movs r0, #1 with a false condition; adds r0, #0 has no effect with a true one.
        let fails = |change: u16| told(&[push, &[0x2800, 0xbf08], one, &[change], end].concat());
        assert!(matches!(fails(0x2001), Verdict::Differs(_)), "{one:x?}");
        assert_eq!(fails(0x3000), Verdict::Same, "{one:x?}");
        // Code behind a return is never executed.
        assert_eq!(told(&[push, one, &[0x2001], end].concat()), Verdict::Same, "{one:x?}");
    }
    // b, beq, cbz, b behind an IT, over movs r0, #1: only the first never executes it.
    assert_eq!(told(&[0xe000, 0x2001, 0x4770]), Verdict::Same);
    for code in [
        &[0x2800_u16, 0xd000, 0x2001, 0x4770][..],
        &[0xb100, 0x2001, 0x4770],
        &[0x2800, 0xbf08, 0xe000, 0x2001, 0x4770],
    ] {
        assert!(matches!(told(code), Verdict::Differs(_)), "{code:x?}");
    }
    // push {r4, lr}; bl g; pop {r4, pc}; g: bx lr, or movs r0, #1 before it; the call behind an IT is rejected.
    let called = |front: &[u16], leaf: &[u16]| told(&[&[0xb510], front, &[0xf000, 0xf801, 0xbd10], leaf].concat());
    assert_eq!(called(&[], &[0x4770]), Verdict::Same);
    assert!(matches!(called(&[], &[0x2001, 0x4770]), Verdict::Differs(_)));
    assert_ne!(called(&[0x2800, 0xbf08], &[0x2001, 0x4770]), Verdict::Same);
    // bx r3; blx r3; mov pc, r0; add pc, r0; ldr pc, [r0]; ldr pc, [pc]; ldm r0, {r1, pc}; tbb [pc, r0];
    // udf; udf #0xfe; udf.w; svc; bkpt; wfi; wfe; cpsid i; msr primask, r0; msr msp, r0; msr control, r0.
    for one in [
        &[0x4718_u16][..],
        &[0x4798],
        &[0x4687],
        &[0x4487],
        &[0xf8d0, 0xf000],
        &[0xf8df, 0xf000],
        &[0xe890, 0x8002],
        &[0xe8df, 0xf000],
        &[0xde00],
        &[0xdefe],
        &[0xf7f0, 0xa000],
        &[0xdf01],
        &[0xbe00],
        &[0xbf30],
        &[0xbf20],
        &[0xb672],
        &[0xf380, 0x8810],
        &[0xf380, 0x8808],
        &[0xf380, 0x8814],
    ] {
        assert_ne!(told(&[one, &[0x4770]].concat()), Verdict::Same, "{one:x?}");
        assert_ne!(told(&[&[0x2800, 0xbf08], one, &[0x4770]].concat()), Verdict::Same, "{one:x?}");
    }
    // Barriers and hints have no effect on the results.
    for one in [&[0xbf00_u16][..], &[0xf3bf, 0x8f5f], &[0xf3bf, 0x8f4f], &[0xf3bf, 0x8f6f]] {
        assert_eq!(told(&[&[0x2800, 0xbf08], one, &[0x4770]].concat()), Verdict::Same, "{one:x?}");
    }
    // cbz r0 to the instruction behind an IT, and a jump back to it; bx lr before the end of a block: unpredictable.
    for code in [
        &[0xb108_u16, 0x2800, 0xbf08, 0x4770, 0xbf00, 0x4770][..],
        &[0x2800, 0xbf08, 0x4770, 0xbf00, 0xd0fc, 0x4770],
        &[0x2800, 0xbf04, 0x4770, 0xbf00, 0x4770],
    ] {
        assert!(matches!(told(code), Verdict::Declined(_)), "{code:x?}");
    }
}

/// An unaligned access of several words or of a float faults; an unaligned access of one word does not.
#[test]
fn an_access_that_faults_is_declined() {
    let told = |code: &[u16]| {
        let code = [&[0xb084, 0x2100, 0x9100, 0x9101, 0x9102, 0x9103], code, &[0xb004, 0x4770]].concat();
        let elf = elf(&[(0x0800_0000, &code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, "means 1\nfunction f\nin a count r0\nout b count r0\nbegin\nreturn a\n")
    };
    // ldr r1, [sp, #2]; the str has no fault either.
    assert_eq!(told(&[0xf8dd, 0x1002]), Verdict::Same);
    assert_eq!(told(&[0xf8cd, 0x1002]), Verdict::Same);
    // add r3, sp, #4; adds r3, #2 or #4, then ldrd r1, r2, [r3]; strd; ldm r3, {r1, r2}; stm; vldr s0, [r3]; vstr.
    for one in
        [[0xe9d3, 0x1200], [0xe9c3, 0x1100], [0xe893, 0x0006], [0xe883, 0x0006], [0xed93, 0x0a00], [0xed83, 0x0a00]]
    {
        assert_eq!(told(&[&[0xab01, 0x3304], &one[..]].concat()), Verdict::Same, "{one:x?}");
        let off = told(&[&[0xab01, 0x3302], &one[..]].concat());
        assert!(matches!(&off, Verdict::Declined(why) if why.contains("not a multiple of 4")), "{one:x?}: {off:?}");
    }
}

/// A compiler merges two stores at the ends of two paths: the address is one of two places.
#[test]
fn a_store_to_one_of_two_places_is_followed() {
    let text = "means 1\nfunction f\nin a count r0\nin d number s0\nout b count r0\nbegin\nzero = count 0\n\
                k = number 0x0\nt = equal d k\nb = select t zero a\nreturn b\n";
    let told = |read: u16| {
        // sub sp, #16 and four zeros; vcmp s0, #0; vmrs; beq; movs r2, #4 or #8; add r2, sp; str r0, [r2]; ldr r0, ..
        let code = [
            &[0xb084, 0x2100, 0x9100, 0x9101, 0x9102, 0x9103, 0xeeb5, 0x0a40, 0xeef1, 0xfa10][..],
            &[0xd001, 0x2204, 0xe000, 0x2208, 0x446a, 0x6010, read, 0xb004, 0x4770],
        ]
        .concat();
        let elf = elf(&[(0x0800_0000, &code)], &[("f", 1, 0, 2 * code.len() as u32)]);
        verdict(&elf, text)
    };
    // With d = 0 the value is at sp + 8, otherwise at sp + 4; the other place keeps its 0.
    assert_eq!(told(0x9801), Verdict::Same);
    assert!(matches!(told(0x9802), Verdict::Differs(_)));
}
