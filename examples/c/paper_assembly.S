@ The functions of paper.h, exported by version 0.1.0.
@ Design 0x8afd7ad8 (FNV-1a; `design_hash` in the run.json of a run).
@ Scenario paper.toml (CRC-32 0x2bacc204):
@
@     # The paper's law on the state of a joint, the numbers of Table I as a joint has them: 10 kHz, all three roots of the
@     # surface at -10, both poles of each observer at -100.
@     #     host-sim export paper.toml --lang c --prefix paper -o paper_design.h --force
@     #     host-sim export paper.toml --standalone --prefix paper -o paper_standalone.h --force
@     #     host-sim export paper.toml --asm --prefix paper -o paper_assembly.S --force
@     name = "paper"
@
@     [plant]
@     kind = "flexible_joint"
@     reading = "physical"
@
@     [controller]
@     period_s = 1e-4
@     surface_bandwidth_rad_s = 10.0
@     alpha_per_s = 10.0
@     k_l = 50.0
@     limits = { min = -30.0, max = 30.0 }
@     fallback = 0.0
@     sigma_star_bound = 10.0
@
@     [[controller.observer]]
@     channel = 2
@     bandwidth_rad_s = 100.0
@     order = 2
@
@     [[controller.observer]]
@     channel = 4
@     bandwidth_rad_s = 100.0
@     order = 2

	.syntax unified
	.cpu cortex-m4
	.fpu fpv4-sp-d16
	.thumb

	.section .text.paper_tick_u, "ax", %progbits
	.balign 8
	.global paper_tick_u
	.type paper_tick_u, %function
	.thumb_func
paper_tick_u:
	adr.w r3, .Lpaper_tick_u_table
	ldrb.w ip, [r0, #40]
	vldmia r0!, {s11-s15}
	vldmia r1, {s1-s4}
	vsub.f32 s15, s4, s15
	vmov.f32 s0, #0.5
	vmul.f32 s10, s0, s3
	vldmia r3!, {s5-s9}
	vmul.f32 s5, s5, s1
	vmul.f32 s6, s6, s3
	vsub.f32 s13, s2, s13
	vadd.f32 s11, s12, s11
	vmul.f32 s12, s7, s1
	vadd.f32 s6, s5, s6
	vmul.f32 s8, s8, s4
	vmul.f32 s0, s0, s3
	vadd.f32 s1, s6, s8
	vmul.f32 s13, s13, s9
	vldmia r3!, {s5-s9}
	vmul.f32 s5, s5, s1
	vsub.f32 s10, s13, s10
	vmul.f32 s6, s15, s6
	vsub.f32 s14, s10, s14
	vsub.f32 s10, s6, s5
	vmul.f32 s13, s7, s2
	vsub.f32 s10, s10, s11
	cmp.w ip, #0
	bne.w .Lpaper_tick_u_resume
.Lpaper_tick_u_observed:
	vmul.f32 s11, s8, s10
	vmul.f32 s15, s8, s14
	vmul.f32 s14, s9, s14
	vmul.f32 s10, s9, s10
	vldmia r0!, {s5-s8}
	vadd.f32 s15, s6, s15
	vadd.f32 s13, s12, s13
	vadd.f32 s5, s5, s15
	vadd.f32 s11, s8, s11
	vadd.f32 s12, s3, s5
	vmov.f32 s15, #30.0
	vmul.f32 s15, s15, s12
	vadd.f32 s7, s7, s11
	vadd.f32 s11, s13, s15
	vadd.f32 s6, s6, s14
	vldmia r3!, {s13-s15}
	vmul.f32 s13, s13, s6
	vldmia r0!, {s9}
	vadd.f32 s13, s11, s13
	vadd.f32 s8, s8, s10
	vadd.f32 s13, s13, s4
	vmul.f32 s14, s14, s12
	vsub.f32 s10, s13, s9
	vmul.f32 s15, s15, s9
	vsub.f32 s3, s12, s0
	vldmia r3!, {s11-s13}
	vmul.f32 s11, s11, s10
	vmul.f32 s10, s12, s10
	vadd.f32 s0, s1, s7
	vcmp.f32 s10, s12
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s10, s12
	vcmp.f32 s10, s13
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s10, s13
	vadd.f32 s13, s11, s10
	vldmia r3!, {s10-s12}
	vmul.f32 s10, s10, s2
	vadd.f32 s15, s13, s15
	vmul.f32 s11, s11, s9
	vadd.f32 s15, s15, s10
	vmul.f32 s10, s12, s4
	vadd.f32 s15, s15, s14
	vldmia r3!, {s12-s14}
	vmul.f32 s12, s12, s8
	vadd.f32 s15, s15, s10
	vmul.f32 s13, s13, s6
	vadd.f32 s15, s15, s12
	vmul.f32 s10, s14, s1
	vadd.f32 s15, s15, s13
	vldmia r3!, {s13-s14}
	vmul.f32 s15, s15, s13
	vsub.f32 s1, s0, s10
	vsub.f32 s0, s15, s0
	vsub.f32 s9, s9, s11
	vabs.f32 s10, s0
	vcmp.f32 s10, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Lpaper_tick_u_beyond
.Lpaper_tick_u_plausible:
	vmov.f32 s15, #30.0
	vmov.f32 s14, #-30.0
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s15
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s14
	vstmdb r0!, {s0-s9}
	bx lr
.Lpaper_tick_u_resume:
	vldr s10, [r3, #56]
	vldr s14, [r3, #56]
	mov.w ip, #0
	strb.w ip, [r0, #20]
	mov.w ip, #1
	b.w .Lpaper_tick_u_observed
.Lpaper_tick_u_beyond:
	push.w {r4-r5}
	vpush {s16-s19}
	vabs.f32 s16, s0
	vldr s17, [r3, #4]
	vldr s18, [r0, #-4]
	vmul.f32 s17, s17, s18
	vabs.f32 s18, s17
	vcmp.f32 s16, s18
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r4, #1
	movpl.w r4, #0
	vsub.f32 s17, s0, s17
	vabs.f32 s17, s17
	vldr s18, [r3, #-4]
	vcmp.f32 s17, s18
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	and.w r4, r4, r5
	vldr s17, [r3, #-4]
	vcmp.f32 s16, s17
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	orr.w r4, r4, r5
	cmp.w r4, #0
	vpop {s16-s19}
	pop.w {r4-r5}
	bne.w .Lpaper_tick_u_plausible
	push.w {r4-r5}
	vldr s1, [r3, #8]
	vldr s2, [r3, #12]
	vldr s3, [r3, #-40]
	vldr s4, [r0, #-40]
	vldr s5, [r3, #-40]
	vldr s6, [r0, #-40]
	vabs.f32 s6, s6
	vldr s7, [r3, #16]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s3, s3, s5
	vldr s4, [r3, #-40]
	vadd.f32 s3, s3, s4
	vldr s4, [r3, #12]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s3
	it mi
	vmovmi.f32 s4, s2
	vldr s2, [r3, #8]
	vcmp.f32 s3, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s4
	it gt
	vmovgt.f32 s2, s1
	vmov.f32 s0, s2
	vldr s1, [r1, #12]
	vldr s3, [r3, #8]
	vldr s4, [r1, #8]
	vmul.f32 s3, s3, s4
	vadd.f32 s1, s1, s3
	vldr s3, [r3, #-68]
	vldr s4, [r1, #4]
	vmul.f32 s3, s3, s4
	vadd.f32 s1, s1, s3
	vldr s3, [r3, #-88]
	vldr s4, [r1, #0]
	vmul.f32 s3, s3, s4
	vadd.f32 s1, s1, s3
	vldr s3, [r0, #-4]
	vabs.f32 s4, s1
	vldr s5, [r3, #16]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s4, [r3, #20]
	vldr s5, [r3, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s5, s1
	vldr s6, [r0, #-28]
	vsub.f32 s6, s5, s6
	vmul.f32 s4, s4, s6
	vabs.f32 s4, s4
	vldr s6, [r3, #-4]
	vcmp.f32 s4, s6
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	and.w r4, r4, ip
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vldr s1, [r3, #-28]
	vmul.f32 s1, s1, s3
	vsub.f32 s1, s3, s1
	vstr s1, [r0, #-4]
	vldr s1, [r3, #-40]
	vldr s3, [r0, #-8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-8]
	vldr s1, [r3, #-40]
	vldr s3, [r0, #-12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-12]
	vldr s1, [r3, #-40]
	vldr s3, [r0, #-16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-16]
	vldr s1, [r3, #-40]
	vldr s3, [r0, #-20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-20]
	vstr s5, [r0, #-28]
	vstr s2, [r0, #-40]
	mov.w r4, #1
	strb.w r4, [r0, #0]
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_tick_u_table:
	.word 0x429742b0 @ 75.63025
	.word 0xbff7651c @ -1.9327731
	.word 0x447a0000 @ 1000.0
	.word 0xbc764ba1 @ -0.01503268
	.word 0x461c4000 @ 10000.0
	.word 0x3f002910 @ 0.50062656
	.word 0x3fffea95 @ 1.9993464
	.word 0x43960000 @ 300.0
	.word 0x3ca30606 @ 0.019900333
	.word 0x38cfa157 @ 9.900581e-5
	.word 0x461c0400 @ 9985.0
	.word 0xf0f6468b @ -6.0974875e29
	.word 0xee83426a @ -2.0311413e28
	.word 0xefa42806 @ -1.0160785e29
	.word 0x00000000 @ 0.0
	.word 0x80000000 @ -0.0
	.word 0xf1d11293 @ -2.0705543e30
	.word 0x3a8301a9 @ 0.0009995002
	.word 0xef41ea5e @ -6.001394e28
	.word 0x6d036f00 @ 2.5422954e27
	.word 0x696020cd @ 1.6934643e25
	.word 0x3f002910 @ 0.50062656
	.word 0x0c000000 @ 9.8607613e-32
	.word 0x46700000 @ 15360.0
	.word 0x80000000 @ -0.0
	.word 0x3c03576b @ 0.008016448
	.word 0x41f00000 @ 30.0
	.word 0xc1f00000 @ -30.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xbc44f8a0 @ -0.012022167
	.word 0x7e967699 @ 1e38
	.size paper_tick_u, .-paper_tick_u

	.section .text.paper_tick, "ax", %progbits
	.balign 8
	.global paper_tick
	.type paper_tick, %function
	.thumb_func
paper_tick:
	adr.w r3, .Lpaper_tick_table
	ldrb.w ip, [r0, #40]
	vldmia r0!, {s11-s15}
	vadd.f32 s11, s12, s11
	vldmia r1, {s1-s4}
	vldmia r3!, {s5-s10}
	vmul.f32 s12, s5, s1
	vsub.f32 s15, s4, s15
	vmul.f32 s0, s6, s3
	vsub.f32 s13, s2, s13
	vadd.f32 s0, s12, s0
	vmul.f32 s7, s7, s4
	vmul.f32 s12, s8, s1
	vadd.f32 s0, s0, s7
	vmul.f32 s15, s15, s9
	vmov.f32 s1, #0.5
	vmul.f32 s1, s1, s3
	vmul.f32 s10, s10, s0
	vldmia r3!, {s5-s9}
	vmul.f32 s5, s13, s5
	vsub.f32 s15, s15, s10
	vsub.f32 s13, s5, s1
	vsub.f32 s11, s15, s11
	vmul.f32 s15, s6, s2
	vsub.f32 s13, s13, s14
	cmp.w ip, #0
	bne.w .Lpaper_tick_resume
.Lpaper_tick_observed:
	vmul.f32 s14, s7, s13
	vmul.f32 s13, s8, s13
	vldmia r0!, {s5-s6}
	vadd.f32 s14, s6, s14
	vadd.f32 s12, s12, s15
	vadd.f32 s5, s5, s14
	vadd.f32 s6, s6, s13
	vadd.f32 s15, s3, s5
	vmov.f32 s3, #30.0
	vmul.f32 s13, s3, s15
	vsub.f32 s3, s15, s1
	vmul.f32 s14, s8, s11
	vadd.f32 s13, s12, s13
	vmul.f32 s12, s9, s6
	vmul.f32 s11, s7, s11
	vadd.f32 s12, s13, s12
	vldmia r0!, {s7-s9}
	vadd.f32 s13, s8, s11
	vadd.f32 s12, s12, s4
	vadd.f32 s8, s8, s14
	vstr s12, [r2, #4]
	vadd.f32 s7, s7, s13
	vsub.f32 s11, s12, s9
	vldmia r3!, {s12-s14}
	vmul.f32 s1, s12, s11
	vmul.f32 s13, s13, s11
	vcmp.f32 s1, s12
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s1, s12
	vcmp.f32 s1, s14
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s1, s14
	vadd.f32 s1, s13, s1
	vldmia r3!, {s12-s14}
	vmul.f32 s12, s12, s9
	vmul.f32 s13, s13, s2
	vadd.f32 s1, s1, s12
	vadd.f32 s0, s0, s7
	vmul.f32 s12, s14, s15
	vadd.f32 s15, s1, s13
	vsub.f32 s1, s0, s10
	vadd.f32 s12, s15, s12
	vstr s11, [r2, #8]
	vldmia r3!, {s13-s15}
	vmul.f32 s13, s13, s4
	vmul.f32 s14, s14, s8
	vadd.f32 s13, s12, s13
	vmul.f32 s15, s15, s6
	vadd.f32 s13, s13, s14
	vabs.f32 s11, s11
	vadd.f32 s10, s13, s15
	vldmia r3!, {s12-s15}
	vmul.f32 s12, s10, s12
	vmul.f32 s10, s13, s9
	vsub.f32 s12, s12, s0
	vsub.f32 s9, s9, s10
	vabs.f32 s10, s12
	vcmp.f32 s10, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Lpaper_tick_beyond
.Lpaper_tick_plausible:
	mov.w r1, #0
	vmov.f32 s10, #30.0
	vmov.f32 s0, s12
	vcmp.f32 s0, s10
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s10
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s15
	vcmp.f32 s0, s12
	vmrs APSR_nzcv, fpscr
	it ne
	addne r1, #2
	vmov.f32 s10, #10.0
	vcmp.f32 s11, s10
	vmrs APSR_nzcv, fpscr
	it gt
	addgt r1, #4
	vstr s0, [r2, #0]
	vstmdb r0!, {s0-s9}
	mov.w r0, r1
	bx lr
.Lpaper_tick_resume:
	vldr s11, [r3, #52]
	vldr s13, [r3, #52]
	mov.w ip, #0
	strb.w ip, [r0, #20]
	mov.w ip, #1
	b.w .Lpaper_tick_observed
.Lpaper_tick_beyond:
	push.w {r4-r5}
	vpush {s16-s19}
	vabs.f32 s16, s12
	vldr s17, [r3, #4]
	vldr s18, [r0, #-4]
	vmul.f32 s17, s17, s18
	vabs.f32 s18, s17
	vcmp.f32 s16, s18
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r4, #1
	movpl.w r4, #0
	vsub.f32 s17, s12, s17
	vabs.f32 s17, s17
	vldr s18, [r3, #-8]
	vcmp.f32 s17, s18
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	and.w r4, r4, r5
	vldr s17, [r3, #-8]
	vcmp.f32 s16, s17
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	orr.w r4, r4, r5
	cmp.w r4, #0
	vpop {s16-s19}
	pop.w {r4-r5}
	bne.w .Lpaper_tick_plausible
	push.w {r4-r5}
	vldr s0, [r1, #12]
	vldr s1, [r3, #8]
	vldr s2, [r1, #8]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #-68]
	vldr s2, [r1, #4]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #-84]
	vldr s2, [r1, #0]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r0, #-4]
	vabs.f32 s2, s0
	vldr s3, [r3, #12]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s2, [r3, #16]
	vldr s3, [r3, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s0
	vldr s4, [r0, #-28]
	vsub.f32 s4, s3, s4
	vmul.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [r3, #-8]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	and.w r4, r4, ip
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vldr s0, [r3, #-12]
	vmul.f32 s0, s0, s1
	vsub.f32 s0, s1, s0
	vstr s0, [r2, #4]
	vldr s1, [r3, #8]
	vldr s2, [r3, #-4]
	vldr s4, [r3, #-52]
	vldr s5, [r0, #-40]
	vldr s6, [r3, #-52]
	vldr s7, [r0, #-40]
	vabs.f32 s7, s7
	vldr s8, [r3, #12]
	vcmp.f32 s7, s8
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s6, s5
	vmul.f32 s4, s4, s6
	vldr s5, [r3, #-52]
	vadd.f32 s4, s4, s5
	vldr s5, [r3, #-4]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it mi
	vmovmi.f32 s5, s2
	vldr s2, [r3, #8]
	vcmp.f32 s4, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s5
	it gt
	vmovgt.f32 s2, s1
	vstr s2, [r2, #0]
	vldr s1, [r3, #-52]
	vstr s1, [r2, #8]
	vstr s0, [r0, #-4]
	vldr s0, [r3, #-52]
	vldr s1, [r0, #-8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-8]
	vldr s0, [r3, #-52]
	vldr s1, [r0, #-12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-12]
	vldr s0, [r3, #-52]
	vldr s1, [r0, #-16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-16]
	vldr s0, [r3, #-52]
	vldr s1, [r0, #-20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-20]
	vstr s3, [r0, #-28]
	vstr s2, [r0, #-40]
	mov.w r4, #1
	strb.w r4, [r0, #0]
	mov.w r0, #1
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_tick_table:
	.word 0x429742b0 @ 75.63025
	.word 0xbff7651c @ -1.9327731
	.word 0xbc764ba1 @ -0.01503268
	.word 0x447a0000 @ 1000.0
	.word 0x3fffea95 @ 1.9993464
	.word 0x3f002910 @ 0.50062656
	.word 0x461c4000 @ 10000.0
	.word 0x43960000 @ 300.0
	.word 0x3ca30606 @ 0.019900333
	.word 0x38cfa157 @ 9.900581e-5
	.word 0x461c0400 @ 9985.0
	.word 0x00000000 @ 0.0
	.word 0xefa42806 @ -1.0160785e29
	.word 0x80000000 @ -0.0
	.word 0xee83426a @ -2.0311413e28
	.word 0xf1d11293 @ -2.0705543e30
	.word 0xf0f6468b @ -6.0974875e29
	.word 0xef41ea5e @ -6.001394e28
	.word 0x6d036f00 @ 2.5422954e27
	.word 0x696020cd @ 1.6934643e25
	.word 0x0c000000 @ 9.8607613e-32
	.word 0x3a8301a9 @ 0.0009995002
	.word 0x46700000 @ 15360.0
	.word 0xc1f00000 @ -30.0
	.word 0x80000000 @ -0.0
	.word 0x3c03576b @ 0.008016448
	.word 0x41f00000 @ 30.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xbc44f8a0 @ -0.012022167
	.word 0x7e967699 @ 1e38
	.size paper_tick, .-paper_tick

	.section .text.paper_start, "ax", %progbits
	.balign 8
	.global paper_start
	.type paper_start, %function
	.thumb_func
paper_start:
	push.w {r4-r5}
	movw r3, #:lower16:.Lpaper_start_table
	movt r3, #:upper16:.Lpaper_start_table
	vldr s0, [r1, #12]
	vabs.f32 s0, s0
	vldr s1, [r3, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s0, [r3, #4]
	vldr s1, [r1, #0]
	vmul.f32 s0, s0, s1
	vldr s1, [r3, #8]
	vldr s2, [r1, #4]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #12]
	vldr s2, [r1, #8]
	vldr s3, [r3, #16]
	vadd.f32 s2, s2, s3
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #16]
	vadd.f32 s0, s0, s1
	vldr s1, [r1, #12]
	vadd.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [r3, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s1, [r1, #8]
	vabs.f32 s1, s1
	vldr s2, [r3, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s1, [r1, #4]
	vabs.f32 s1, s1
	vldr s2, [r3, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s1, [r1, #0]
	vabs.f32 s1, s1
	vldr s2, [r3, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	ldrb.w r5, [r0, #41]
	orr.w r5, r4, r5
	strb.w r5, [r0, #41]
	vldr s1, [r3, #16]
	vldr s2, [r0, #0]
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #0]
	vldr s1, [r0, #36]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #36]
	vldr s0, [r3, #16]
	vldr s1, [r0, #16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #16]
	vldr s0, [r3, #16]
	vldr s1, [r0, #8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	vldr s0, [r3, #16]
	vldr s1, [r0, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	vldr s0, [r3, #16]
	vldr s1, [r0, #12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	vldr s0, [r3, #16]
	vldr s1, [r0, #32]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #32]
	vldr s0, [r3, #16]
	vldr s1, [r0, #28]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #28]
	vldr s0, [r3, #16]
	vldr s1, [r0, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #24]
	vldr s0, [r3, #16]
	vldr s1, [r0, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	ldrb.w r5, [r0, #40]
	orr.w r5, r4, r5
	strb.w r5, [r0, #40]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_start_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x447a0000 @ 1000.0
	.word 0x43960000 @ 300.0
	.word 0x41f00000 @ 30.0
	.word 0x00000000 @ 0.0
	.size paper_start, .-paper_start

	.section .text.paper_not_started, "ax", %progbits
	.balign 8
	.global paper_not_started
	.type paper_not_started, %function
	.thumb_func
paper_not_started:
	movw r3, #:lower16:.Lpaper_not_started_table
	movt r3, #:upper16:.Lpaper_not_started_table
	vldr s0, [r3, #0]
	vstr s0, [r0, #8]
	vldr s0, [r3, #0]
	vstr s0, [r0, #4]
	vldr s0, [r3, #0]
	vstr s0, [r0, #0]
	mov.w r0, #1
	bx lr
	.balign 4
.Lpaper_not_started_table:
	.word 0x00000000 @ 0.0
	.size paper_not_started, .-paper_not_started

	.section .text.paper_report_applied, "ax", %progbits
	.balign 8
	.global paper_report_applied
	.type paper_report_applied, %function
	.thumb_func
paper_report_applied:
	push.w {r4-r5}
	movw r3, #:lower16:.Lpaper_report_applied_table
	movt r3, #:upper16:.Lpaper_report_applied_table
	ldrb.w r4, [r0, #41]
	vabs.f32 s1, s0
	vldr s2, [r3, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s1, [r0, #0]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_report_applied_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.size paper_report_applied, .-paper_report_applied

	.section .text.paper_estimates, "ax", %progbits
	.balign 8
	.global paper_estimates
	.type paper_estimates, %function
	.thumb_func
paper_estimates:
	push.w {r4-r5}
	movw r3, #:lower16:.Lpaper_estimates_table
	movt r3, #:upper16:.Lpaper_estimates_table
	ldrb.w r4, [r0, #41]
	cmp.w r4, #0
	beq.w .Lpaper_estimates_1
	vldr s0, [r0, #28]
	vldr s1, [r3, #0]
	vldr s2, [r0, #32]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vldr s1, [r3, #4]
	vmul.f32 s0, s0, s1
	vstr s0, [r1, #24]
	vldr s0, [r0, #20]
	vldr s1, [r3, #8]
	vldr s2, [r0, #24]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vldr s1, [r3, #12]
	vmul.f32 s0, s0, s1
	vstr s0, [r1, #8]
	vldr s0, [r0, #32]
	vldr s1, [r3, #4]
	vmul.f32 s0, s0, s1
	vldr s1, [r3, #16]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #28]
	vldr s0, [r0, #24]
	vldr s1, [r3, #12]
	vmul.f32 s0, s0, s1
	vldr s1, [r3, #16]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #12]
	vldr s0, [r3, #20]
	vstr s0, [r1, #20]
	vldr s0, [r3, #20]
	vstr s0, [r1, #16]
	vldr s0, [r3, #20]
	vstr s0, [r1, #4]
	vldr s0, [r3, #20]
	vstr s0, [r1, #0]
	mov.w r0, #1
	pop.w {r4-r5}
	bx lr
.Lpaper_estimates_1:
	vldr s0, [r3, #20]
	vstr s0, [r1, #28]
	vldr s0, [r3, #20]
	vstr s0, [r1, #24]
	vldr s0, [r3, #20]
	vstr s0, [r1, #20]
	vldr s0, [r3, #20]
	vstr s0, [r1, #16]
	vldr s0, [r3, #20]
	vstr s0, [r1, #12]
	vldr s0, [r3, #20]
	vstr s0, [r1, #8]
	vldr s0, [r3, #20]
	vstr s0, [r1, #4]
	vldr s0, [r3, #20]
	vstr s0, [r1, #0]
	mov.w r0, #0
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_estimates_table:
	.word 0x3f002910 @ 0.50062656
	.word 0x459c4d13 @ 5001.6343
	.word 0x3f000000 @ 0.5
	.word 0x3f800000 @ 1.0
	.word 0x38d1b717 @ 0.0001
	.word 0x00000000 @ 0.0
	.size paper_estimates, .-paper_estimates

	.section .text.paper_reset, "ax", %progbits
	.balign 8
	.global paper_reset
	.type paper_reset, %function
	.thumb_func
paper_reset:
	push.w {r4-r5}
	movw r3, #:lower16:.Lpaper_reset_table
	movt r3, #:upper16:.Lpaper_reset_table
	vldr s0, [r3, #0]
	vldr s1, [r0, #0]
	ldrb.w r4, [r0, #41]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	vldr s0, [r3, #0]
	vldr s1, [r0, #36]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #36]
	vldr s0, [r3, #0]
	vldr s1, [r0, #16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #16]
	vldr s0, [r3, #0]
	vldr s1, [r0, #8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	vldr s0, [r3, #0]
	vldr s1, [r0, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	vldr s0, [r3, #0]
	vldr s1, [r0, #12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	vldr s0, [r3, #0]
	vldr s1, [r0, #32]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #32]
	vldr s0, [r3, #0]
	vldr s1, [r0, #28]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #28]
	vldr s0, [r3, #0]
	vldr s1, [r0, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #24]
	vldr s0, [r3, #0]
	vldr s1, [r0, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	eor.w r4, r4, #1
	ldrb.w r5, [r0, #40]
	and.w r4, r4, r5
	strb.w r4, [r0, #40]
	mov.w r4, #0
	strb.w r4, [r0, #41]
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lpaper_reset_table:
	.word 0x00000000 @ 0.0
	.size paper_reset, .-paper_reset
