//! Unpredictable encodings: bit patterns whose behaviour the architecture leaves open.
//!
//! A disassembler identifies an instruction by some of its bits. The manual (ARMv7-M, DDI 0403E) marks other bits as
//! `(0)` or `(1)`. A different value, or an empty register list, is unpredictable. The disassembled text does not show
//! such code, so this module finds it in the bits, and the analysis rejects it.

/// An instruction form: its identifying bits, and the bits that must be 0 or 1.
struct Form {
    mask: u32,
    is: u32,
    zeros: u32,
    ones: u32,
}

const fn form(mask: u32, is: u32, zeros: u32, ones: u32) -> Form {
    Form { mask, is, zeros, ones }
}

/// Forms of 32 bits, first halfword in the upper half.
const LONG: [Form; 10] = [
    // Data processing with a shifted register.
    form(0xfe00_0000, 0xea00_0000, 0x0000_8000, 0),
    // SBFX, BFI and BFC, UBFX.
    form(0xfbf0_8000, 0xf340_0000, 0x0400_0020, 0),
    form(0xfbf0_8000, 0xf360_0000, 0x0400_0020, 0),
    form(0xfbf0_8000, 0xf3c0_0000, 0x0400_0020, 0),
    // SDIV, UDIV.
    form(0xffd0_00f0, 0xfb90_00f0, 0, 0x0000_f000),
    // SXTB .. UXTAH.
    form(0xff80_f080, 0xfa00_f080, 0x0000_0040, 0),
    // VMOV between a core register and an FPU register.
    form(0xffe0_0f10, 0xee00_0a10, 0x0000_006f, 0),
    // VMRS, VMSR.
    form(0xffe0_0f10, 0xeee0_0a10, 0x0000_00ef, 0),
    // VCMP with 0.
    form(0xffbf_0e50, 0xeeb5_0a40, 0x0000_002f, 0),
    // LDM, STM and variants: the list must not contain the stack pointer.
    form(0xfe40_0000, 0xe800_0000, 0x0000_2000, 0),
];
/// Forms of 16 bits: BX, BLX.
const SHORT: [Form; 1] = [form(0xff00, 0x4700, 0x0007, 0)];

/// Returns the reason if the instruction is unpredictable. `second` is the second halfword of a 32-bit instruction.
pub(crate) fn open(first: u16, second: Option<u16>) -> Option<&'static str> {
    let (word, forms): (u32, &[Form]) = match second {
        Some(second) => (u32::from(first) << 16 | u32::from(second), &LONG),
        None => (first.into(), &SHORT),
    };
    let is_off = |form: &Form| word & form.mask == form.is && (word & form.zeros != 0 || !word & form.ones != 0);
    if forms.iter().any(is_off) {
        return Some("unpredictable: a should-be-zero or should-be-one bit is wrong");
    }
    let listed = |mask: u32| (word & mask).count_ones();
    let is_short_list = match second {
        // LDM, STM; PUSH, POP.
        None if word & 0xf000 == 0xc000 => listed(0xff) == 0,
        None => word & 0xf600 == 0xb400 && listed(0x1ff) == 0,
        Some(_) if word & 0xfe40_0000 == 0xe800_0000 => listed(0xffff) < 2,
        // VLDM, VSTM, except VLDR, VSTR and moves of two registers.
        Some(_) if word & 0xfe00_0e00 == 0xec00_0a00 => {
            let [before, up, back] = [24, 23, 21].map(|bit| word >> bit & 1 == 1);
            let is_list = !before && up || before && !up && back;
            let registers = word & 0xff;
            let from = (word >> 11 & 0x1e) | (word >> 22 & 1);
            let is_single = word & 0x100 == 0;
            is_list && (registers == 0 || is_single && from + registers > 32)
        }
        Some(_) => false,
    };
    is_short_list.then_some("unpredictable: a register list that is too short or too long")
}

/// Condition names, indexed by the four condition bits; 14 is "always".
const CONDITIONS: [&str; 14] = ["eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];

/// Returns the conditions of the instructions behind an IT (`None`: "always"); empty if `it` is not an IT.
pub(crate) fn conditions(it: u16) -> Vec<Option<&'static str>> {
    let (first, mask) = (usize::from(it >> 4 & 0xf), it & 0xf);
    if it & 0xff00 != 0xbf00 || mask == 0 {
        return Vec::new();
    }
    let others = (0..3 - mask.trailing_zeros()).map(|k| first & !1 | usize::from(mask >> (3 - k) & 1));
    [first].into_iter().chain(others).map(|condition| CONDITIONS.get(condition).copied()).collect()
}

/// Returns the reason if an IT is unpredictable: it has no condition, or the opposite of "always".
pub(crate) fn open_it(it: u16) -> Option<&'static str> {
    let (first, mask) = (it >> 4 & 0xf, it & 0xf);
    (first == 15 || first == 14 && !mask.is_power_of_two()).then_some("unpredictable: an IT without a valid condition")
}

/// Returns the reason if the instruction is unpredictable behind an IT. A branch is allowed as the last one only.
pub(crate) fn open_in_it(first: u16, second: Option<u16>, goes_on: bool, is_last: bool) -> Option<&'static str> {
    let has_own_condition = match second {
        None => first & 0xf000 == 0xd000 && first & 0xfe00 != 0xde00,
        Some(second) => first & 0xf800 == 0xf000 && second & 0xd000 == 0x8000 && first & 0x0380 != 0x0380,
    };
    // CBZ and CBNZ, IT, CPS.
    let is_barred = second.is_none()
        && (first & 0xf500 == 0xb100 || first & 0xff00 == 0xbf00 && first & 0xf != 0 || first & 0xffe0 == 0xb660);
    if has_own_condition || is_barred {
        Some("unpredictable: not allowed behind an IT")
    } else if !goes_on && !is_last {
        Some("unpredictable: a branch inside an IT block, before its last instruction")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::{conditions, open, open_in_it, open_it};

    #[test]
    fn an_it_has_the_conditions_of_its_name() {
        // it eq; itt ne; ite hi; ittee le; itete gt; it al.
        assert_eq!(conditions(0xbf08), [Some("eq")]);
        assert_eq!(conditions(0xbf1c), [Some("ne"); 2]);
        assert_eq!(conditions(0xbf8c), [Some("hi"), Some("ls")]);
        assert_eq!(conditions(0xbfd9), [Some("le"), Some("le"), Some("gt"), Some("gt")]);
        assert_eq!(conditions(0xbfcb), [Some("gt"), Some("le"), Some("gt"), Some("le")]);
        assert_eq!(conditions(0xbfe8), [None]);
        assert!(conditions(0xbf00).is_empty() && conditions(0xbf30).is_empty());
        assert_eq!([0xbf08, 0xbfe8].map(open_it), [None; 2]);
        assert!([0xbff8, 0xbfec].map(open_it).iter().all(Option::is_some));
    }

    #[test]
    fn what_may_not_stand_behind_an_it_is_asked_of_its_bits() {
        // cbz, cbnz, it, cpsid, beq, beq.w.
        for (first, second) in
            [(0xb100, None), (0xb900, None), (0xbf08, None), (0xb672, None), (0xd000, None), (0xf000, Some(0x8000))]
        {
            assert!(open_in_it(first, second, true, true).is_some(), "{first:#x}");
        }
        // nop, udf, svc, b, b.w, bl, push, rev, msr primask, dsb.
        for (first, second) in [
            (0xbf00, None),
            (0xde00, None),
            (0xdf00, None),
            (0xe000, None),
            (0xf000, Some(0xb800)),
            (0xf000, Some(0xf800)),
            (0xb410, None),
            (0xba00, None),
            (0xf380, Some(0x8810)),
            (0xf3bf, Some(0x8f4f)),
        ] {
            assert_eq!(open_in_it(first, second, true, true), None, "{first:#x}");
        }
        // bx lr: allowed as the last one only.
        assert!(open_in_it(0x4770, None, false, false).is_some());
        assert_eq!(open_in_it(0x4770, None, false, true), None);
    }

    fn of(word: u32) -> Option<&'static str> {
        if word > 0xffff { open((word >> 16) as u16, Some(word as u16)) } else { open(word as u16, None) }
    }

    /// Encodings of the GNU assembler, and each with one bit changed.
    #[test]
    fn what_should_be_is_asked_of_each_form() {
        for (good, bad) in [
            (0x4770, 0x4771),
            (0x4798, 0x479c),
            // orr.w r0, r1, r2; movs.w r0, r1, lsl #3.
            (0xea41_0002, 0xea41_8002),
            (0xea5f_00c1, 0xea5f_80c1),
            // sbfx r0, r1, #3, #5; bfi r0, r1, #3, #1; ubfx r0, r1, #3, #5.
            (0xf341_00c4, 0xf741_00c4),
            (0xf361_00c3, 0xf361_00e3),
            (0xf3c1_00c4, 0xf3c1_00e4),
            // sdiv r0, r1, r2; udiv r0, r1, r2.
            (0xfb91_f0f2, 0xfb91_70f2),
            (0xfbb1_f0f2, 0xfbb1_e0f2),
            // uxtb.w r8, r9.
            (0xfa5f_f889, 0xfa5f_f8c9),
            // vmov s0, r1; vmov r1, s0; vmrs APSR_nzcv, fpscr; vcmp.f32 s0, #0.
            (0xee00_1a10, 0xee00_1a11),
            (0xee10_1a10, 0xee10_1a50),
            (0xeef1_fa10, 0xeef1_fa18),
            (0xeeb5_0a40, 0xeeb5_0a41),
            // ldmia.w r0, {r1, r8}; stmdb sp!, {r4, lr}: changed to one register, and to a list with the stack pointer.
            (0xe890_0102, 0xe890_0100),
            (0xe92d_4010, 0xe92d_6010),
            // vstmia r2, {s10}; vpush {d8}; vldmia r0, {s31}: the last changed to two registers.
            (0xec82_5a01, 0xec82_5a00),
            (0xed2d_8b02, 0xed2d_8b00),
            (0xecd0_fa01, 0xecd0_fa02),
            // push {r4}; pop {r4}; ldmia r0!, {r1}.
            (0xb410, 0xb400),
            (0xbc10, 0xbc00),
            (0xc802, 0xc800),
        ] {
            assert_eq!(of(good), None, "{good:#x}");
            assert!(of(bad).is_some_and(|why| why.starts_with("unpredictable")), "{bad:#x}");
        }
        // vldr s10, [r2]; vmov s0, s1, r0, r1; ldrd r0, r1, [r2]; tbb [pc, r0]; b.w; a loop's branch.
        for good in [0xed92_5a00, 0xec41_0a10, 0xe9d2_0100, 0xe8df_f000, 0xf000_b800, 0xd1fe] {
            assert_eq!(of(good), None, "{good:#x}");
        }
    }
}
