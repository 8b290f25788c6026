//! Tests with hand-written functions whose cycles follow from their code, and with functions that must be rejected. The
//! machine code is an assembler's output, with the assembly next to it.

mod classes;
pub(crate) mod elf;
mod files;

use super::*;
use crate::cycles::RETURNS;

const BASE: u32 = 0x0800_0000;

/// push {r4, lr}; vldr s0, [r0]; vldr s1, [r0, #4]; vadd.f32 s0, s0, s1; vstr s0, [r0]; pop {r4, pc}
const STRAIGHT: &[u16] = &[0xb510, 0xed90, 0x0a00, 0xedd0, 0x0a01, 0xee30, 0x0a20, 0xed80, 0x0a00, 0xbd10];
/// cmp r0, #0; beq 1f; vdiv.f32 s0, s0, s1; 1: bx lr
const FORK: &[u16] = &[0x2800, 0xd001, 0xee80, 0x0a20, 0x4770];
/// push {r4, lr}; bl leaf; bl leaf; pop {r4, pc} with leaf behind it
const CALLER: &[u16] = &[0xb510, 0xf000, 0xf803, 0xf000, 0xf801, 0xbd10];
/// sub sp, #8; add sp, #8; bx lr
const LEAF: &[u16] = &[0xb082, 0xb002, 0x4770];
/// movs r1, #0; 1: adds r1, #1; cmp r1, #4; bne 1b; bx lr
const LOOP: &[u16] = &[0x2100, 0x3101, 0x2904, 0xd1fc, 0x4770];
/// movs r1, #3; 1: movs r2, #2; 2: subs r2, #1; bne 2b; subs r1, #1; bne 1b; bx lr
const NESTED: &[u16] = &[0x2103, 0x2202, 0x3a01, 0xd1fd, 0x3901, 0xd1fa, 0x4770];
/// vcmp.f32 s0, s1; vmrs APSR_nzcv, fpscr; it gt; vmovgt.f32 s0, s1; bx lr
const IF_THEN: &[u16] = &[0xeeb4, 0x0a60, 0xeef1, 0xfa10, 0xbfc8, 0xeeb0, 0x0a60, 0x4770];
/// cmp r0, #1; bhi 9f; tbb [pc, r0]; .byte 1, 2; movs r0, #7; 9: bx lr
const TABLE: &[u16] = &[0x2801, 0xd803, 0xe8df, 0xf000, 0x0201, 0x2007, 0x4770];
/// cmp r0, #0; beq 1f; bx lr; 1: udf #0
const PANICS: &[u16] = &[0x2800, 0xd000, 0x4770, 0xde00];
/// blx r3; bx lr
const INDIRECT: &[u16] = &[0x4798, 0x4770];
/// bx lr
const RETURN: &[u16] = &[0x4770];

fn ask(functions: &[(&str, &[u16])], change: impl FnOnce(&mut Options), log: Option<&str>) -> Report {
    let mut options = question(functions[0].0);
    change(&mut options);
    let image = Image::of(functions);
    let mut answer = Answer::of(&image, &options).expect("good input");
    if let Some(log) = log {
        answer.price(&trace::addresses(log), options.lines.then_some(&image));
    }
    answer.report
}

fn question(symbol: &str) -> Options {
    Options { symbol: Some(symbol.to_owned()), ..Options::default() }
}

fn plain(functions: &[(&str, &[u16])]) -> Report {
    ask(functions, |_| {}, None)
}

/// Least and most cycles.
fn cycles(report: &Report) -> Option<(u64, u64)> {
    assert_eq!(report.declined, Vec::<String>::new());
    Some((report.shortest.as_ref()?.cycles?, report.longest.as_ref()?.cycles?))
}

/// The only reason of the rejection.
fn declined(report: &Report) -> &str {
    assert_eq!((report.bound(), report.declined.len()), (None, 1), "{:?}", report.declined);
    &report.declined[0]
}

/// A log of executed instructions, given as offsets.
fn log(offsets: &[u32]) -> String {
    let line = |offset: &u32| format!("Trace 0: 0x7f00 [00800400/{:08x}/0110/ff00] f", BASE + offset);
    offsets.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_straight_function_is_the_sum_of_its_instructions_and_one_stall() {
    let report = plain(&[("f", STRAIGHT)]);
    // push 3, vldr 2, vldr 2, vadd 1 and 1 for the store that reads it, vstr 2, pop 3 + P; the bound: 2 + N. The least:
    // 1 for each float access.
    assert_eq!(cycles(&report), Some((3 + 1 + 1 + 2 + 1 + 3 + 1, 3 + 2 + 2 + 2 + 2 + 4 + 3)));
    assert_eq!(report.longest.as_ref().map(|path| path.instructions), Some(6));
    assert_eq!((report.stack_bytes, report.flash_bytes), (Some(8), 20));
    assert!(report.histogram.contains(&("float load", 2)), "{:?}", report.histogram);
}

#[test]
fn an_image_that_does_not_say_which_line_an_instruction_serves_has_cycles_and_no_lines() {
    let lines = |options: &mut Options| options.lines = true;
    let report = ask(&[("f", STRAIGHT)], lines, Some(&log(&[0, 2, 6, 10, 14, 18])));
    assert!(report.typical.is_some() && report.lines.is_none());
    assert!(report.declined[0].starts_with("--lines: "), "{:?}", report.declined);
}

#[test]
fn of_two_ways_the_bound_takes_the_dear_one_and_least_the_cheap_one() {
    let report = plain(&[("f", FORK)]);
    // cmp 1, beq not taken 1, vdiv 14, bx 1 + 3; cmp 1, beq taken 1 + 1, bx 1 + 1.
    assert_eq!(cycles(&report), Some((5, 20)));
}

#[test]
fn the_way_of_most_instructions_may_be_another_than_the_dearest() {
    // cbz r0, 1f; nop; nop; nop; bx lr; 1: vdiv.f32 s0, s0, s1; bx lr
    let code = [0xb118, 0xbf00, 0xbf00, 0xbf00, 0x4770, 0xee80, 0x0a20, 0x4770];
    let report = plain(&[("f", &code)]);
    assert_eq!(cycles(&report).map(|(_, worst)| worst), Some(4 + 14 + 4));
    assert_eq!(report.longest.as_ref().map(|path| path.instructions), Some(3));
    assert_eq!(report.most_instructions, Some(5));
}

#[test]
fn a_call_costs_the_branch_the_callee_and_its_stack() {
    let report = plain(&[("f", CALLER), ("leaf", LEAF)]);
    // push 3, twice (bl 4, sub 1, add 1, bx 4), pop 4 + 3.
    assert_eq!(cycles(&report), Some((3 + 2 * (2 + 2 + 2) + 4, 3 + 2 * 10 + 7)));
    assert_eq!((report.stack_bytes, report.flash_bytes), (Some(16), 18));
    assert_eq!(report.functions, ["f", "leaf"]);
    // b.w leaf: a tail call, the callee returns for f.
    let tail = plain(&[("leaf", LEAF), ("f", &[0xf7ff, 0xbffb])]);
    assert_eq!(cycles(&tail).map(|(_, worst)| worst), Some(6));
    let tail = ask(&[("leaf", LEAF), ("f", &[0xf7ff, 0xbffb])], |options| options.symbol = Some("f".into()), None);
    assert_eq!(cycles(&tail), Some((2 + 4, 4 + 6)));
}

#[test]
fn a_loop_is_declined_until_its_rounds_are_given() {
    let report = plain(&[("f", LOOP)]);
    assert!(declined(&report).contains("--loop 0x08000002=N"), "{:?}", report.declined);
    let rounds = |places: &[&str], code| {
        ask(&[("f", code)], |options| options.loops = places.iter().map(|&it| it.to_owned()).collect(), None)
    };
    // movs 1, three iterations of adds, cmp, bne taken, one with bne not taken, bx.
    assert_eq!(cycles(&rounds(&["f+0x2=4"], LOOP)), Some((1 + 3 + 2, 1 + 3 * 6 + 3 + 4)));
    assert_eq!(cycles(&rounds(&["0x08000002=1"], LOOP)).map(|(_, worst)| worst), Some(1 + 3 + 4));
    // An inner iteration 5, the last 2. An outer iteration 1 + 5 + 2 + 5, the last with its bne not taken.
    let nested = rounds(&["f+2=3", "f+4=2"], NESTED);
    assert_eq!(cycles(&nested).map(|(_, worst)| worst), Some(1 + 2 * 13 + 10 + 4));
    assert!(nested.assumptions.iter().any(|line| line.contains("3 times at most")));
    assert!(!rounds(&["f+2=3"], NESTED).declined.is_empty());
}

#[test]
fn a_loop_that_is_not_there_is_bad_input() {
    for (place, reason) in [
        ("f+0x6=4", "no path"),
        ("g=4", "no function"),
        ("f", "PLACE=N"),
        ("f=0", "at least once"),
        ("f=many", "not a number"),
        ("f+0x40=4", "does not reach this place"),
    ] {
        let options = Options { loops: vec![place.into()], ..question("f") };
        match Answer::of(&Image::of(&[("f", LOOP)]), &options) {
            Err(message) => assert!(message.contains(reason), "{message}"),
            // A place that is not a loop header limits no loop.
            Ok(answer) => assert!(declined(&answer.report).contains("a loop begins here"), "{place}"),
        }
    }
}

#[test]
fn a_condition_that_may_fail_is_counted_as_if_it_held() {
    // vcmp 1, vmrs 1 and 1 in the bound, it 1, vmov 1, bx 1 + 3. The least: folded, P = 1, condition false.
    assert_eq!(cycles(&plain(&[("f", IF_THEN)])), Some((1 + 1 + 1 + 2, 1 + 2 + 1 + 1 + 4)));
}

#[test]
fn least_is_below_every_call_whatever_its_conditions_are() {
    // cmp r0, #0; it eq; ldmeq r0!, {r1, r2, r3, r4}; bx lr. Condition false: 1, 0, 1, 2. Condition true: 1, 1, 6, 4.
    assert_eq!(cycles(&plain(&[("f", &[0x2800, 0xbf08, 0xc81e, 0x4770])])), Some((4, 12)));
    // cmp r0, #0; it eq; vaddeq.f32 s0, s0, s1; vadd.f32 s0, s0, s1; bx lr: no stall without the first sum.
    let code = [0x2800, 0xbf08, 0xee30, 0x0a20, 0xee30, 0x0a20, 0x4770];
    assert_eq!(cycles(&plain(&[("f", &code)])), Some((1 + 1 + 1 + 2, 1 + 1 + 2 + 1 + 4)));
    // Five float loads, which pipeline in the reading "pipelined" only.
    let loads = [[0xed90, 0x0a00]; 5].concat();
    let way: Vec<u32> = (0..6).map(|k| 4 * k).collect();
    let report = ask(&[("f", &[&loads[..], RETURN].concat())], |_| {}, Some(&log(&way)));
    let pipelined = report.typical.expect("a call").pipelined.min;
    assert!(cycles(&report).is_some_and(|(least, _)| least <= pipelined), "{report}");
}

#[test]
fn what_the_figures_rest_on_is_printed_with_them() {
    let report = plain(&[("f", STRAIGHT)]);
    for assumed in ["17 words", "lazy", "`bx lr`", "treated as returns"] {
        assert!(report.assumptions.iter().any(|line| line.contains(assumed)), "{assumed}: {report}");
        assert!(report.to_string().contains(assumed), "{assumed}: {report}");
    }
    assert!(report.to_string().contains("\nleast "), "{report}");
}

#[test]
fn a_table_branch_is_followed_only_behind_its_comparison() {
    // cmp 1, bhi 1, tbb 3 + 3, movs 1, bx 4.
    assert_eq!(cycles(&plain(&[("f", TABLE)])), Some((5, 13)));
    let bare = plain(&[("f", &TABLE[2..])]);
    assert!(declined(&bare).contains("table"), "{:?}", bare.declined);
    // cbz r1 to the tbb: bypasses the comparison.
    let around: Vec<u16> = [0xb109].iter().chain(TABLE).copied().collect();
    let around = plain(&[("f", &around)]);
    assert!(declined(&around).contains("around its comparison"), "{:?}", around.declined);
    // cbz r1 to the bhi: the flags come from another comparison.
    let flags: Vec<u16> = [0xb101].iter().chain(TABLE).copied().collect();
    assert!(declined(&plain(&[("f", &flags)])).contains("around its comparison"));
    // cmp r0, #1; it hi; cmphi r0, #200; bhi: a conditional comparison limits nothing.
    let conditional = [&[0x2801, 0xbf88, 0x28c8][..], &TABLE[1..]].concat();
    let conditional = plain(&[("f", &conditional)]);
    assert!(declined(&conditional).contains("comparison is itself conditional"), "{:?}", conditional.declined);
    // bhi to the tbb itself: both successors reach it.
    let to_itself: Vec<u16> = [TABLE[0], 0xd8ff].iter().chain(&TABLE[2..]).copied().collect();
    assert!(declined(&plain(&[("f", &to_itself)])).contains("table"));
    // it eq; beq.w with bits similar to a bhi.w: b.w with imm10 = 0x200.
    let other: Vec<u16> = [0x2801, 0xbf08, 0xf200, 0xb800].iter().chain(&TABLE[2..]).copied().collect();
    assert!(plain(&[("f", &other)]).declined.iter().any(|line| line.contains("table")));
    // cmp r1 instead of r0: another register.
    let other: Vec<u16> = [0x2901].iter().chain(&TABLE[1..]).copied().collect();
    assert!(declined(&plain(&[("f", &other)])).contains("table"));
}

#[test]
fn a_way_that_never_returns_is_left_out_and_told() {
    // cmp 1, beq not taken 1, bx 4.
    let report = plain(&[("f", PANICS)]);
    assert_eq!(cycles(&report).map(|(_, worst)| worst), Some(6));
    let failed = ask(&[("f", PANICS)], |options| options.no_panic = true, None);
    assert!(failed.failures[0].contains("a panic is reached: `udf #0` at 0x08000006"), "{:?}", failed.failures);
    // The same function with a call of `b .`; code behind the call does not belong to the function.
    let calls: &[u16] = &[0x2800, 0xd000, 0x4770, 0xf000, 0xf800];
    let functions = [("f", calls), ("endless", &[0xe7fe][..])];
    assert_eq!(cycles(&plain(&functions)).map(|(_, worst)| worst), Some(6));
    let failed = ask(&functions, |options| options.no_panic = true, None);
    assert!(failed.failures[0].contains("never returns"), "{:?}", failed.failures);
    assert!(ask(&[("f", FORK)], |options| options.no_panic = true, None).failures.is_empty());
    assert!(declined(&plain(&[("endless", &[0xe7fe])])).contains("no path returns"));
}

#[test]
fn what_cannot_be_followed_is_declined_with_its_place_and_reason() {
    let of = |functions: &[(&str, &[u16])]| declined(&plain(functions)).to_owned();
    for (reason, text) in [
        (of(&[("f", INDIRECT)]), "0x08000000 (f+0x0) `blx r3`: a call by a register"),
        (of(&[("f", &[0x4718])]), "`bx r3`: a jump by a register"),
        (of(&[("f", &[0xffff, 0xffff])]), "not a known instruction"),
        // bl f; bx lr
        (of(&[("f", &[0xf7ff, 0xfffe, 0x4770])]), "recursion: f calls itself"),
        // f: bl g; bx lr. g: bl f; bx lr
        (of(&[("f", &[0xf000, 0xf801, 0x4770]), ("g", &[0xf7ff, 0xfffb, 0x4770])]), "recursion: f calls itself via"),
        // nop, and then g begins
        (of(&[("f", &[0xbf00]), ("g", RETURN)]), "runs on into the next function"),
        // bl to somewhere
        (of(&[("f", &[0xf000, 0xf832, 0x4770])]), "no function of the file begins"),
        (of(&[("f", &[0xbf30, 0x4770])]), "`wfi`: no maximum number"),
        (of(&[("f", &[0xf3bf, 0x8f4f, 0x4770])]), "`dsb sy`: no maximum number"),
        (of(&[("f", &[0xdf01, 0x4770])]), "`svc #1`: an exception: its handler"),
        // cbz r0, 2f; 1: subs r1, #1; 2: subs r2, #1; bne 1b; bx lr
        (of(&[("f", &[0xb100, 0x3901, 0x3a01, 0xd1fc, 0x4770])]), "two entries"),
    ] {
        assert!(reason.contains(text), "{reason}: {text}");
    }
    // movs r0, #0, and then a word of data.
    let data = Image::of(&[("f", &[0x2000, 0x4770])]).with_data(BASE + 2);
    let report = Answer::of(&data, &question("f")).expect("good input").report;
    assert!(declined(&report).contains("data instead of code"));
}

#[test]
fn a_barrier_has_the_bound_that_is_vouched_for() {
    let report = ask(&[("f", &[0xf3bf, 0x8f4f, 0x4770])], |options| options.barrier = Some(10), None);
    assert_eq!(cycles(&report).map(|(_, worst)| worst), Some(11 + 4));
    assert!(report.assumptions.iter().any(|line| line.contains("a barrier waits 10 cycles")));
    let endless = ask(&[("f", &[0xf3bf, 0x8f4f, 0x4770])], |options| options.barrier = Some(u64::MAX), None);
    assert_eq!(endless.bound(), Some(u64::MAX));
}

#[test]
fn a_stack_pointer_that_moves_by_an_unknown_amount_is_declined_alone() {
    // mov r4, sp; mov sp, r4; bx lr
    let report = plain(&[("f", &[0x466c, 0x46a5, 0x4770])]);
    assert_eq!((report.bound(), report.stack_bytes), (Some(6), None));
    assert!(report.declined[0].contains("stack: 0x08000002"), "{:?}", report.declined);
    // sub.w sp, sp, #0x40000000 until the depth is 4 GiB, and back again.
    let deep: Vec<u16> = [[0xf1ad, 0x4d80]; 4].concat().into_iter().chain([[0xf10d, 0x4d80]; 4].concat()).collect();
    let report = plain(&[("f", &[&deep[..], RETURN].concat())]);
    assert!(report.stack_bytes.is_none() && report.declined[0].contains("more than the address space"), "{report:?}");
    // push {r4, lr}; bx lr
    assert!(plain(&[("f", &[0xb510, 0x4770])]).declined[0].contains("a changed stack pointer"));
}

/// Code as GCC generates it at -O0.
#[test]
fn a_frame_pointer_brings_the_stack_pointer_back() {
    // push {r7}; sub sp, #28; add r7, sp, #0; adds r7, #28; mov sp, r7; pop {r7}; bx lr
    let framed = [0xb480, 0xb087, 0xaf00, 0x371c, 0x46bd, 0xbc80, 0x4770];
    let report = plain(&[("f", &framed)]);
    assert_eq!((report.stack_bytes, report.declined.len()), (Some(32), 0), "{:?}", report.declined);
    // Wrong by a word, or another number in r7: adds r7, #24; movs r7, #1.
    for (at, other, told) in [(3, 0x3718, "a changed stack pointer"), (3, 0x2701, "stack pointer moves by")] {
        let mut code = framed;
        code[at] = other;
        assert!(plain(&[("f", &code)]).declined[0].contains(told), "{other:#x}");
    }
    // push {r7}; mov r7, sp; cbz r0, over; movs r7, #1; over: mov sp, r7; pop {r7}; bx lr
    let report = plain(&[("f", &[0xb480, 0x466f, 0xb100, 0x2701, 0x46bd, 0xbc80, 0x4770])]);
    assert!(report.declined[0].contains("stack pointer moves by"), "{:?}", report.declined);
}

/// Two source files with a static function of one name.
#[test]
fn functions_of_one_name_are_told_apart_by_their_address() {
    let code = [0xbf00, 0x4770, 0x4770];
    let file = elf::elf(&[(0x0800_0000, &code)], &[("tick", 1, 0, 4), ("tick", 1, 4, 2)]);
    let image = Image::read(&file).expect("an image");
    let told = image.find("tick").expect_err("one of two");
    assert!(told.contains("2 functions are called \"tick\"") && told.contains("0x08000000, 0x08000004"), "{told}");
    for (name, start) in [("0x08000004", 0x0800_0004), ("0x08000001", 0x0800_0000)] {
        assert_eq!(image.find(name).expect("one").start, start);
    }
    let told = image.find("0x08000002").expect_err("within one");
    assert!(told.contains("no function begins at 0x08000002 (tick+0x2)"), "{told}");
}

#[test]
fn every_check_finds_what_it_is_for_and_nothing_else() {
    let all = |options: &mut Options| {
        (options.no_panic, options.no_double, options.no_division) = (true, true, true);
        (options.no_call, options.no_backward_branch) = (true, true);
    };
    let failures = |functions: &[(&str, &[u16])]| ask(functions, all, None).failures;
    assert_eq!(failures(&[("f", STRAIGHT)]), Vec::<String>::new());
    for (code, word) in [(FORK, "a division"), (PANICS, "a panic"), (INDIRECT, "a call"), (LOOP, "a backward jump")] {
        let found = failures(&[("f", code)]);
        assert!(found.len() == 1 && found[0].starts_with(word), "{word}: {found:?}");
    }
    for helper in ["__aeabi_dadd", "__aeabi_f2d", "__adddf3", "__floatsidf", "compiler_builtins::float::mul::__muldf3"]
    {
        let found = failures(&[("f", CALLER), (helper, LEAF)]);
        assert!(found.iter().any(|line| line.starts_with("64-bit")), "{helper}: {found:?}");
        assert!(!found.iter().any(|line| line.starts_with("a division")), "{helper}: {found:?}");
    }
    for helper in ["__aeabi_uidivmod", "__aeabi_ldivmod", "__divsf3", "__udivsi3", "sqrtf"] {
        let found = failures(&[("f", CALLER), (helper, LEAF)]);
        assert!(found.iter().any(|line| line.starts_with("a division")), "{helper}: {found:?}");
        assert!(!found.iter().any(|line| line.starts_with("64-bit")), "{helper}: {found:?}");
    }
    for helper in ["core::panicking::panic_fmt", "_RNvNtCs1234_4core9panicking5panic"] {
        let found = failures(&[("f", CALLER), (helper, LEAF)]);
        assert!(found.iter().any(|line| line.starts_with("a panic")), "{helper}: {found:?}");
    }
    for other in ["memcpy", "__aeabi_fadd", "__aeabi_memcpy", "wide_of_f32"] {
        assert_eq!(failures(&[("f", CALLER), (other, LEAF)]).len(), 1, "{other}: only the call itself");
    }
}

#[test]
fn a_bound_above_the_ceiling_fails_and_one_at_it_does_not() {
    let with = |most| ask(&[("f", FORK)], |options| options.max_cycles = Some(most), None).failures;
    assert_eq!(with(20), Vec::<String>::new());
    assert_eq!(with(19), ["bound of 20 cycles, more than 19"]);
}

#[test]
fn a_core_without_a_table_counts_instructions_and_has_no_bound() {
    let report = ask(&[("f", FORK)], |options| options.core = Core::CortexM7, None);
    assert_eq!(report.longest, Some(report::PathJson { cycles: None, instructions: 4 }));
    assert_eq!(report.shortest, Some(report::PathJson { cycles: None, instructions: 3 }));
    assert_eq!((report.declined.as_slice(), report.assumptions.as_slice()), (&[][..], &[RETURNS.to_owned()][..]));
    let asked = ask(&[("f", FORK)], |options| (options.core, options.max_cycles) = (Core::CortexM33, Some(1000)), None);
    assert!(asked.declined[0].contains("no cycle table for the cortex-m33"), "{:?}", asked.declined);
}

#[test]
fn a_trace_is_priced_call_by_call() {
    // One call bypasses the division, one executes it.
    let both = log(&[0, 2, 8, 0, 2, 4, 8]);
    let report = ask(&[("f", FORK)], |_| {}, Some(&both));
    let typical = report.typical.expect("two calls");
    // cmp 1, beq taken 3, bx 3; cmp 1, beq 1, vdiv 14, bx 3.
    assert_eq!((typical.calls, typical.cycles.min, typical.cycles.max), (2, 7, 19));
    assert_eq!((typical.instructions.min, typical.instructions.max, typical.instructions.mean), (3, 4, 3.5));
    // An instruction that the emulator restarted counts once.
    let again = ask(&[("f", FORK)], |_| {}, Some(&log(&[0, 2, 8, 0, 2, 4, 4, 8])));
    assert_eq!(again.typical, Some(typical));
    // Into the callee and back, twice: push 3, bl 3, sub 1, add 1, bx 3, .., pop 3 + 2.
    let calls = log(&[0, 2, 12, 14, 16, 6, 12, 14, 16, 10]);
    let typical = ask(&[("f", CALLER), ("leaf", LEAF)], |_| {}, Some(&calls)).typical.expect("a call");
    assert_eq!((typical.instructions.max, typical.cycles.max), (10, 3 + 2 * 8 + 5));
}

#[test]
fn a_trace_that_the_function_cannot_have_made_is_declined() {
    let of = |offsets: &[u32]| ask(&[("f", CALLER), ("leaf", LEAF)], |_| {}, Some(&log(offsets))).declined;
    for (offsets, reason) in [
        (&[0, 10][..], "does not go there"),
        (&[0, 2, 6], "does not go there"),
        (&[0, 2, 12, 14, 16, 10], "does not go there"),
        (&[0, 0x40], "an interrupt?"),
        (&[0, 2], "not executed to its end"),
        (&[], "not executed to its end"),
    ] {
        let declined = of(offsets);
        assert!(declined.len() == 1 && declined[0].contains(reason), "{offsets:?}: {declined:?}");
    }
    // Three iterations where two are declared. The readings differ by less than P per iteration, so only many
    // iterations exceed the bound.
    let rounds: Vec<u32> = [0].into_iter().chain([2, 4, 6].repeat(9)).chain([8]).collect();
    let report = ask(&[("f", LOOP)], |options| options.loops = vec!["f+2=2".into()], Some(&log(&rounds)));
    assert!(report.declined[0].contains("is a --loop too small?"), "{:?}", report.declined);
}

#[test]
fn the_bound_is_above_what_any_trace_of_the_function_takes() {
    for (code, way) in [
        (STRAIGHT, &[0, 2, 6, 10, 14, 18][..]),
        (FORK, &[0, 2, 4, 8]),
        (FORK, &[0, 2, 8]),
        (IF_THEN, &[0, 4, 8, 10, 14]),
        (TABLE, &[0, 2, 4, 10, 12]),
        (PANICS, &[0, 2, 4]),
    ] {
        let report = ask(&[("f", code)], |_| {}, Some(&log(way)));
        let (least, worst) = cycles(&report).expect("bounded");
        let typical = report.typical.expect("a call").cycles.max;
        assert!(least <= typical && typical <= worst, "{least} {typical} {worst}: {way:?}");
    }
}

#[test]
fn an_answer_that_is_no_json_is_told_and_not_an_empty_line() {
    // JSON cannot represent a map whose keys are lists.
    #[derive(serde::Serialize)]
    struct Odd(BTreeMap<Vec<u8>, u8>);
    impl std::fmt::Display for Odd {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a table")
        }
    }
    let odd = Odd(BTreeMap::from([(vec![1], 2)]));
    let error = Reply::of(&odd, true, [&[]; 3]).expect_err("no JSON");
    assert!(error.starts_with("the answer cannot be written as JSON: "), "{error}");
    assert_eq!(Reply::of(&odd, false, [&[]; 3]).expect("a table").text, "a table");
}
