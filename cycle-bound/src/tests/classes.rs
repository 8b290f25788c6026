//! Tests of every class of instruction that may end or leave a path, as machine code, alone and behind an IT. The table
//! is in the module `instruction`.

use super::*;

/// Fewest and most instructions on a core without a cycle table, if no path is refused.
fn counted(functions: &[(&str, &[u16])]) -> Option<(u64, u64)> {
    let report = ask(functions, |options| options.core = Core::CortexM33, None);
    Some((report.shortest?.instructions, report.longest?.instructions))
}

/// The refusal, which both cores share.
fn refused(code: &[u16]) -> String {
    let all = [Core::CortexM4, Core::CortexM33].map(|core| {
        let report = ask(&[("f", code)], |options| options.core = core, None);
        assert!(report.longest.is_none() && !report.declined.is_empty(), "{code:x?}: {report}");
        report.declined.concat()
    });
    all.concat()
}

/// `cmp r0, #0; it eq`, these instructions, some nops and a return.
fn behind_it(one: &[u16], nops: usize) -> Vec<u16> {
    [&[0x2800, 0xbf08], one, &[0xbf00].repeat(nops), RETURN].concat()
}

/// bx lr; bxns lr; mov pc, lr; pop {pc}; pop.w {r4, pc}; ldr pc, [sp], #4; ldm sp, {r4, pc}.
const RETURNING: [&[u16]; 7] =
    [&[0x4770], &[0x4774], &[0x46f7], &[0xbd00], &[0xe8bd, 0x8010], &[0xf85d, 0xfb04], &[0xe89d, 0x8010]];

#[test]
fn a_return_ends_its_path_and_one_behind_an_it_may_go_on() {
    for one in RETURNING {
        assert_eq!(counted(&[("f", &[one, &[0xbf00; 2], RETURN].concat())]), Some((1, 1)), "{one:x?}");
        assert_eq!(counted(&[("f", &behind_it(one, 2))]), Some((3, 6)), "{one:x?}");
        // ite eq; the instruction; a nop for the false condition.
        let other = [&[0x2800, 0xbf0c, 0xbf00], one, &[0xbf00; 3], RETURN].concat();
        assert_eq!(counted(&[("f", &other)]), Some((4, 8)), "{one:x?}");
    }
}

#[test]
fn every_condition_may_fail() {
    for condition in 0..14_u16 {
        // An IT with each condition; a branch with each condition, in both widths, over two nops.
        let it = [0x2800, 0xbf08 | condition << 4, 0x4770, 0xbf00, 0x4770];
        assert_eq!(counted(&[("f", &it)]), Some((3, 5)), "{condition}");
        let short = [0x2800, 0xd001 | condition << 8, 0xbf00, 0xbf00, 0x4770];
        assert_eq!(counted(&[("f", &short)]), Some((3, 5)), "{condition}");
        let wide = [0x2800, 0xf000 | condition << 6, 0x8002, 0xbf00, 0xbf00, 0x4770];
        assert_eq!(counted(&[("f", &wide)]), Some((3, 5)), "{condition}");
    }
    // it al: no condition.
    assert_eq!(counted(&[("f", &[0xbfe8, 0x4770, 0xbf00, 0x4770])]), Some((2, 2)));
}

#[test]
fn a_jump_goes_to_its_target_and_one_with_a_condition_to_the_next_too() {
    // b; b.w, over two nops.
    for jump in [&[0xe001_u16][..], &[0xf000, 0xb802]] {
        assert_eq!(counted(&[("f", &[jump, &[0xbf00; 2], RETURN].concat())]), Some((2, 2)), "{jump:x?}");
        assert_eq!(counted(&[("f", &behind_it(jump, 2))]), Some((4, 6)), "{jump:x?}");
    }
    // cbz, cbnz r0.
    for jump in [0xb108, 0xb908] {
        assert_eq!(counted(&[("f", &[jump, 0xbf00, 0xbf00, 0x4770])]), Some((2, 4)), "{jump:x}");
    }
    // A jump to another function, a tail call; cbz r0, g; cmp, it eq, b g.
    let leaf: (&str, &[u16]) = ("g", RETURN);
    assert_eq!(counted(&[("f", &[0xe7ff]), leaf]), Some((2, 2)));
    assert_eq!(counted(&[("f", &[0xb108, 0xbf00, 0x4770]), leaf]), Some((2, 3)));
    assert_eq!(counted(&[("f", &[0x2800, 0xbf08, 0xe001, 0xbf00, 0x4770]), leaf]), Some((4, 5)));
}

#[test]
fn a_call_comes_back_if_its_callee_does() {
    // bl g; bx lr; and the call behind an IT.
    let called: &[u16] = &[0xf000, 0xf801, 0x4770];
    assert_eq!(counted(&[("f", called), ("g", RETURN)]), Some((3, 3)));
    assert_eq!(counted(&[("f", &[&[0x2800, 0xbf08], called].concat()), ("g", RETURN)]), Some((4, 5)));
    // A callee that never returns ends the path. Behind an IT, only the false condition continues.
    assert_eq!(counted(&[("f", called), ("g", &[0xde00])]), None);
    assert_eq!(counted(&[("f", &[&[0x2800, 0xbf08], called].concat()), ("g", &[0xde00])]), Some((4, 4)));
    // blx r3; blxns r3.
    for call in [0x4798, 0x479c] {
        assert!(refused(&[call, 0x4770]).contains("a call by a register"), "{call:x}");
        assert!(refused(&behind_it(&[call], 1)).contains("a call by a register"), "{call:x}");
    }
}

/// bx r3; bxns r3; mov pc, r0; add pc, r0; ldr pc, [r0]; ldr pc, [pc]; ldr pc, [sp, r0]; ldm r0, {r1, pc}; and movs pc,
/// #1 and ldrb pc, [r6, #1]!, which no core has.
const ANYWHERE: [&[u16]; 10] = [
    &[0x4718],
    &[0x471c],
    &[0x4687],
    &[0x4487],
    &[0xf8d0, 0xf000],
    &[0xf8df, 0xf000],
    &[0xf85d, 0xf000],
    &[0xe890, 0x8002],
    &[0xf05f, 0x0f01],
    &[0xf816, 0xff01],
];

#[test]
fn whatever_else_writes_the_program_counter_may_go_anywhere_and_return() {
    for one in ANYWHERE {
        assert!(refused(&[one, RETURN].concat()).contains("a jump by a register"), "{one:x?}");
        assert!(refused(&behind_it(one, 1)).contains("a jump by a register"), "{one:x?}");
        // cbz r0 to the return; else cmp; it eq; the instruction; udf: its path might return.
        let over = 0xb100 | (one.len() as u16 + 2) << 3;
        let code = [&[over, 0x2800, 0xbf08], one, &[0xde00, 0x4770]].concat();
        assert!(refused(&code).contains("a jump by a register"), "{one:x?}");
    }
    // Tables without a comparison: tbb, tbh, and one behind an IT with the comparison before the IT.
    for table in [[0xe8df, 0xf000], [0xe8df, 0xf010]] {
        assert!(refused(&[&[0xb118, 0x2800, 0xbf08], &table[..], &[0xde00, 0x4770]].concat()).contains("table"));
    }
    assert!(refused(&[0x2801, 0xd804, 0xbf18, 0xe8df, 0xf000, 0x0201, 0x2007, 0x4770]).contains("table"));
    // A tail call from another function back into f: cbz r0; it eq; b.w f; udf.
    let code: &[u16] = &[0xf000, 0xf801, 0x4770];
    let tail: &[u16] = &[0xb120, 0x2800, 0xbf08, 0xf7ff, 0xbff8, 0xde00, 0x4770];
    let told = plain(&[("f", code), ("g", tail)]);
    assert!(told.longest.is_none() && told.declined.concat().contains("recursion"), "{told}");
}

#[test]
fn what_is_undefined_never_returns_and_behind_an_it_may_not_be_executed() {
    // udf #0; udf #0xfe; udf.w #0.
    for trap in [&[0xde00_u16][..], &[0xdefe], &[0xf7f0, 0xa000]] {
        assert_eq!(counted(&[("f", &[trap, RETURN].concat())]), None, "{trap:x?}");
        // cbz r0 to the trap: that path is excluded.
        assert_eq!(counted(&[("f", &[&[0xb100, 0x4770], trap].concat())]), Some((2, 2)), "{trap:x?}");
        assert_eq!(counted(&[("f", &behind_it(trap, 1))]), Some((5, 5)), "{trap:x?}");
        let told = ask(&[("f", &behind_it(trap, 1))], |options| options.no_panic = true, None);
        assert!(told.failures.concat().contains("a panic is reached"), "{trap:x?}: {told}");
    }
}

#[test]
fn an_exception_on_purpose_is_declined_unless_what_is_behind_it_never_returns() {
    // svc #1; bkpt #0; hvc #0; smc #0.
    for one in [&[0xdf01_u16][..], &[0xbe00], &[0xf7e0, 0x8000], &[0xf7f0, 0x8000]] {
        assert!(refused(&[one, RETURN].concat()).contains("an exception: its handler"), "{one:x?}");
        assert!(refused(&behind_it(one, 1)).contains("an exception: its handler"), "{one:x?}");
        assert!(refused(&[one, &[0xde00]].concat()).contains("no path returns"), "{one:x?}");
        // cbz r0 over the instruction and a `b .`, to the return.
        let over = 0xb100 | (one.len() as u16) << 3;
        assert_eq!(counted(&[("f", &[&[over], one, &[0xe7fe, 0x4770]].concat())]), Some((2, 2)), "{one:x?}");
    }
    // A Cortex-M has no HLT and DCPS1; where they are decoded, they do not continue.
    for one in [&[0xba80_u16][..], &[0xf78f, 0x8001], &[0xf3de, 0x8f00]] {
        refused(&[one, RETURN].concat());
    }
    // The loop instructions of ARMv8.1-M are unsupported: dls lr, r0; wls lr, r0, +4; le lr, -4.
    for one in [[0xf040, 0xe001], [0xf040, 0xc003], [0xf00f, 0xc003]] {
        assert!(refused(&[&one[..], RETURN].concat()).contains("not a known instruction"), "{one:x?}");
    }
}

#[test]
fn what_waits_or_sets_the_machine_goes_on() {
    // wfi, wfe; dmb, dsb, isb: one instruction without a number of cycles.
    for one in [&[0xbf30_u16][..], &[0xbf20], &[0xf3bf, 0x8f5f], &[0xf3bf, 0x8f4f], &[0xf3bf, 0x8f6f]] {
        assert!(declined(&plain(&[("f", &[one, RETURN].concat())])).contains("no maximum number"), "{one:x?}");
        assert_eq!(counted(&[("f", &[one, RETURN].concat())]), Some((2, 2)), "{one:x?}");
    }
    // cpsid i; cpsie f; msr primask, r0; msr basepri, r0; mrs r0, primask; nop; sev; sdiv; ldrex; clrex.
    for one in [
        &[0xb672_u16][..],
        &[0xb661],
        &[0xf380, 0x8810],
        &[0xf380, 0x8811],
        &[0xf3ef, 0x8010],
        &[0xbf00],
        &[0xbf40],
        &[0xfb90, 0xf0f1],
        &[0xe850, 0x0f00],
        &[0xf3bf, 0x8f2f],
    ] {
        let report = plain(&[("f", &[one, RETURN].concat())]);
        assert_eq!(report.longest.as_ref().map(|path| path.instructions), Some(2), "{one:x?}: {report}");
        assert_eq!((report.declined.len(), report.stack_bytes), (0, Some(0)), "{one:x?}: {report}");
    }
    // msr msp, r0; msr psp, r0; msr control, r0: switch to another stack.
    for register in [0x8808, 0x8809, 0x8814] {
        let report = plain(&[("f", &[0xf380, register, 0x4770])]);
        assert!(report.stack_bytes.is_none() && report.declined.concat().contains("stack"), "{register:x}: {report}");
    }
}

#[test]
fn what_may_not_stand_behind_an_it_is_declined() {
    // cbz r0; cpsid i; it ne; beq; beq.w: as the last of a block.
    for one in [&[0xb100_u16][..], &[0xb672], &[0xbf18], &[0xd000], &[0xf000, 0x8000]] {
        assert!(refused(&behind_it(one, 3)).contains("unpredictable"), "{one:x?}");
    }
    // itt eq; bx lr; nop: a branch that is not the last. An IT with condition 15; ite al.
    assert!(refused(&[0x2800, 0xbf04, 0x4770, 0xbf00, 0x4770]).contains("a branch inside an IT block"));
    for it in [0xbff8, 0xbfec] {
        assert!(refused(&[it, 0xbf00, 0xbf00, 0xbf00, 0x4770]).contains("an IT without a valid condition"), "{it:x}");
    }
    // bx lr with a bit that should be 0; also on a path that otherwise never returns, since it may do anything.
    assert!(refused(&[0x4771]).contains("should-be-zero"));
    assert!(refused(&[0xb100, 0x4770, 0xbff8, 0xbf00, 0xde00]).contains("an IT without a valid condition"));
    // cbz r0 into a block, forwards and backwards.
    let into = [0xb108, 0x2800, 0xbf08, 0x4770, 0xbf00, 0x4770];
    assert!(refused(&into).contains("a jump target behind an IT"));
    let back = [0x2800, 0xbf08, 0x4770, 0xbf00, 0xd0fc, 0x4770];
    assert!(refused(&back).contains("a jump target behind an IT"));
}
