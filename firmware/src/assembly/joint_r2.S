@ The functions of joint_r2.h, exported by version 0.1.0.
@ Design 0xdb203b35 (FNV-1a; `design_hash` in the run.json of a run).
@ Scenario joint.toml (CRC-32 0xadf7d260):
@
@     # The joint whose tick is measured everywhere (src/bin/budget.rs): 10 kHz, all poles of the observers at -100, switching
@     # term and limits in use. Order 2 here, order 3 by `--set`; --paper, since the reading is the paper's.
@     #     host-sim export joint.toml --paper --asm --prefix joint_r2 -o src/assembly/joint_r2.S --force
@     #     host-sim export joint.toml --paper --asm --prefix joint_r3 -o src/assembly/joint_r3.S --force \
@     #         --set 'controller.observer=[{channel=2,bandwidth_rad_s=100,order=3},{channel=4,bandwidth_rad_s=100,order=3}]'
@     name = "joint"
@
@     [plant]
@     kind = "flexible_joint"
@     reading = "reconstructed"
@
@     [controller]
@     period_s = 1e-4
@     surface_bandwidth_rad_s = 10.0
@     alpha_per_s = 10.0
@     k_l = 50.0
@     k_s = 0.5
@     epsilon = 0.01
@     limits = { min = -300.0, max = 300.0 }
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

	.section .text.joint_r2_tick_u, "ax", %progbits
	.balign 8
	.global joint_r2_tick_u
	.type joint_r2_tick_u, %function
	.thumb_func
joint_r2_tick_u:
	adr.w r3, .Ljoint_r2_tick_u_table
	ldrb.w ip, [r0, #40]
	vldmia r0!, {s11-s15}
	vadd.f32 s11, s12, s11
	vldmia r1, {s1-s4}
	vsub.f32 s15, s4, s15
	vldmia r3!, {s5-s10}
	vmul.f32 s12, s5, s1
	vmul.f32 s6, s6, s3
	vmul.f32 s7, s7, s1
	vsub.f32 s13, s2, s13
	vadd.f32 s7, s7, s6
	vmul.f32 s15, s15, s8
	vmul.f32 s9, s9, s4
	vmul.f32 s10, s10, s3
	vadd.f32 s0, s7, s9
	vldmia r3!, {s5-s9}
	vmul.f32 s13, s13, s5
	vmul.f32 s1, s6, s0
	vsub.f32 s13, s13, s10
	vsub.f32 s15, s15, s1
	vsub.f32 s13, s13, s14
	vsub.f32 s15, s15, s11
	vmul.f32 s14, s7, s2
	cmp.w ip, #0
	bne.w .Ljoint_r2_tick_u_resume
.Ljoint_r2_tick_u_observed:
	vmul.f32 s11, s8, s15
	vmul.f32 s15, s9, s15
	vadd.f32 s12, s12, s14
	vmul.f32 s14, s9, s13
	vmul.f32 s13, s8, s13
	vldmia r0!, {s5-s9}
	vadd.f32 s13, s6, s13
	vadd.f32 s6, s6, s14
	vadd.f32 s5, s5, s13
	vadd.f32 s11, s8, s11
	vadd.f32 s3, s3, s5
	vldmia r3!, {s13-s14}
	vmul.f32 s13, s13, s3
	vmul.f32 s14, s14, s6
	vadd.f32 s12, s12, s13
	vadd.f32 s7, s7, s11
	vadd.f32 s11, s12, s14
	vadd.f32 s0, s0, s7
	vadd.f32 s11, s11, s4
	vadd.f32 s8, s8, s15
	vsub.f32 s11, s11, s9
	vldmia r3!, {s12-s15}
	vmul.f32 s12, s12, s11
	vmul.f32 s13, s13, s11
	vcmp.f32 s12, s14
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s12, s14
	vcmp.f32 s12, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s12, s15
	vadd.f32 s15, s13, s12
	vldmia r3!, {s11-s14}
	vmul.f32 s11, s11, s9
	vmul.f32 s12, s12, s2
	vadd.f32 s11, s15, s11
	vmul.f32 s13, s13, s3
	vadd.f32 s12, s11, s12
	vmul.f32 s14, s14, s4
	vadd.f32 s15, s12, s13
	vldmia r3!, {s11-s13}
	vmul.f32 s11, s11, s8
	vadd.f32 s14, s15, s14
	vmul.f32 s12, s12, s6
	vmul.f32 s13, s13, s9
	vadd.f32 s11, s14, s11
	vsub.f32 s9, s9, s13
	vadd.f32 s11, s11, s12
	vldmia r3!, {s12-s15}
	vmul.f32 s11, s11, s12
	vsub.f32 s1, s0, s1
	vsub.f32 s0, s11, s0
	vsub.f32 s3, s3, s10
	vabs.f32 s12, s0
	vcmp.f32 s12, s13
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_r2_tick_u_beyond
.Ljoint_r2_tick_u_plausible:
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s14
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s15
	vstmdb r0!, {s0-s9}
	bx lr
.Ljoint_r2_tick_u_resume:
	vldr s15, [r3, #68]
	vldr s13, [r3, #68]
	mov.w ip, #0
	strb.w ip, [r0, #20]
	mov.w ip, #1
	b.w .Ljoint_r2_tick_u_observed
.Ljoint_r2_tick_u_beyond:
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
	vldr s18, [r3, #-12]
	vcmp.f32 s17, s18
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	and.w r4, r4, r5
	vldr s17, [r3, #-12]
	vcmp.f32 s16, s17
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	orr.w r4, r4, r5
	cmp.w r4, #0
	vpop {s16-s19}
	pop.w {r4-r5}
	bne.w .Ljoint_r2_tick_u_plausible
	push.w {r4-r5}
	vldr s1, [r3, #-80]
	vldr s2, [r3, #-4]
	vldr s3, [r3, #8]
	vldr s4, [r0, #-40]
	vldr s5, [r3, #12]
	vldr s6, [r0, #-40]
	vabs.f32 s6, s6
	vldr s7, [r3, #16]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s3, s3, s5
	vldr s4, [r3, #12]
	vadd.f32 s3, s3, s4
	vldr s4, [r3, #-4]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s3
	it mi
	vmovmi.f32 s4, s2
	vldr s2, [r3, #-80]
	vcmp.f32 s3, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s4
	it gt
	vmovgt.f32 s2, s1
	vmov.f32 s0, s2
	vldr s1, [r1, #12]
	vldr s3, [r3, #-68]
	vldr s4, [r1, #8]
	vmul.f32 s3, s3, s4
	vadd.f32 s1, s1, s3
	vldr s3, [r3, #-80]
	vldr s4, [r1, #4]
	vmul.f32 s3, s3, s4
	vadd.f32 s1, s1, s3
	vldr s3, [r3, #-112]
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
	vldr s6, [r3, #-12]
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
	vldr s1, [r3, #-20]
	vmul.f32 s1, s1, s3
	vsub.f32 s1, s3, s1
	vstr s1, [r0, #-4]
	vldr s1, [r3, #12]
	vldr s3, [r0, #-8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-8]
	vldr s1, [r3, #12]
	vldr s3, [r0, #-12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-12]
	vldr s1, [r3, #12]
	vldr s3, [r0, #-16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s1
	vstr s3, [r0, #-16]
	vldr s1, [r3, #12]
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
.Ljoint_r2_tick_u_table:
	.word 0x447a0000 @ 1000.0
	.word 0xc29742b0 @ -75.63025
	.word 0x429742b0 @ 75.63025
	.word 0x429c7878 @ 78.23529
	.word 0xbf169697 @ -0.5882353
	.word 0x3f000000 @ 0.5
	.word 0x461c4000 @ 10000.0
	.word 0x3f002910 @ 0.50062656
	.word 0x43960000 @ 300.0
	.word 0x3ca30606 @ 0.019900333
	.word 0x38cfa157 @ 9.900581e-5
	.word 0x41f00000 @ 30.0
	.word 0x461c0400 @ 9985.0
	.word 0xf046bcc0 @ -2.4602487e29
	.word 0xf048bc13 @ -2.4849748e29
	.word 0x6d00785e @ 2.4849748e27
	.word 0xed00785e @ -2.4849748e27
	.word 0xef2081e9 @ -4.9674653e28
	.word 0xf27b0a1c @ -4.9723494e30
	.word 0xf196937a @ -1.4912333e30
	.word 0xefed1ffb @ -1.4677322e29
	.word 0x6b036f00 @ 1.5889347e26
	.word 0x6a0908ed @ 4.1416247e25
	.word 0x3a8301a9 @ 0.0009995002
	.word 0x0e000000 @ 1.5777218e-30
	.word 0x48160000 @ 153600.0
	.word 0x43960000 @ 300.0
	.word 0xc3960000 @ -300.0
	.word 0x80000000 @ -0.0
	.word 0x3ea09b98 @ 0.3136871
	.word 0x3f800000 @ 1.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xbef0dc8d @ -0.47043267
	.word 0x7e967699 @ 1e38
	.size joint_r2_tick_u, .-joint_r2_tick_u

	.section .text.joint_r2_tick, "ax", %progbits
	.balign 8
	.global joint_r2_tick
	.type joint_r2_tick, %function
	.thumb_func
joint_r2_tick:
	adr.w r3, .Ljoint_r2_tick_table
	ldrb.w ip, [r0, #40]
	vldmia r1, {s1-s4}
	vldmia r0!, {s11-s15}
	vldmia r3!, {s6-s10}
	vmul.f32 s6, s6, s1
	vsub.f32 s15, s4, s15
	vmul.f32 s7, s7, s3
	vsub.f32 s13, s2, s13
	vadd.f32 s11, s12, s11
	vmov.f32 s12, #0.5
	vmul.f32 s12, s12, s3
	vmul.f32 s13, s13, s8
	vadd.f32 s0, s6, s7
	vmul.f32 s5, s9, s4
	vmul.f32 s10, s10, s1
	vadd.f32 s0, s0, s5
	vldmia r3!, {s5-s9}
	vmul.f32 s1, s5, s0
	vmul.f32 s5, s6, s2
	vmul.f32 s15, s15, s7
	vsub.f32 s13, s13, s12
	vsub.f32 s15, s15, s1
	vsub.f32 s13, s13, s14
	vadd.f32 s14, s10, s5
	vsub.f32 s15, s15, s11
	cmp.w ip, #0
	bne.w .Ljoint_r2_tick_resume
.Ljoint_r2_tick_observed:
	vmul.f32 s10, s8, s15
	vmul.f32 s11, s8, s13
	vldmia r0!, {s5-s8}
	vmul.f32 s13, s9, s13
	vmul.f32 s15, s9, s15
	vadd.f32 s13, s6, s13
	vadd.f32 s6, s6, s11
	vadd.f32 s5, s5, s13
	vldmia r3!, {s13}
	vmul.f32 s13, s13, s6
	vadd.f32 s11, s3, s5
	vmov.f32 s9, #30.0
	vmul.f32 s3, s9, s11
	vadd.f32 s15, s8, s15
	vadd.f32 s14, s14, s3
	vadd.f32 s8, s8, s10
	vadd.f32 s14, s14, s13
	vldmia r0!, {s9}
	vadd.f32 s14, s14, s4
	vadd.f32 s7, s7, s15
	vsub.f32 s10, s14, s9
	vsub.f32 s3, s11, s12
	vstr s14, [r2, #4]
	vldmia r3!, {s12-s15}
	vmul.f32 s12, s12, s10
	vmul.f32 s13, s13, s10
	vcmp.f32 s12, s14
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s12, s14
	vcmp.f32 s12, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s12, s15
	vadd.f32 s12, s13, s12
	vldmia r3!, {s13-s15}
	vmul.f32 s13, s13, s9
	vadd.f32 s0, s0, s7
	vadd.f32 s13, s12, s13
	vmul.f32 s12, s14, s2
	vmul.f32 s15, s15, s11
	vadd.f32 s14, s13, s12
	vstr s10, [r2, #8]
	vadd.f32 s11, s14, s15
	vldmia r3!, {s12-s15}
	vmul.f32 s12, s12, s4
	vmul.f32 s13, s13, s8
	vadd.f32 s11, s11, s12
	vmul.f32 s14, s14, s6
	vadd.f32 s13, s11, s13
	vsub.f32 s1, s0, s1
	vadd.f32 s13, s13, s14
	vabs.f32 s10, s10
	vmul.f32 s11, s13, s15
	vldmia r3!, {s12-s15}
	vmul.f32 s12, s12, s9
	vsub.f32 s11, s11, s0
	vsub.f32 s9, s9, s12
	vabs.f32 s12, s11
	vcmp.f32 s12, s13
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_r2_tick_beyond
.Ljoint_r2_tick_plausible:
	mov.w r1, #0
	vmov.f32 s0, #10.0
	vcmp.f32 s10, s0
	vmrs APSR_nzcv, fpscr
	it gt
	addgt r1, #4
	vmov.f32 s0, s11
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s14
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s15
	vcmp.f32 s0, s11
	vmrs APSR_nzcv, fpscr
	it ne
	addne r1, #2
	vstr s0, [r2, #0]
	vstmdb r0!, {s0-s9}
	mov.w r0, r1
	bx lr
.Ljoint_r2_tick_resume:
	vldr s15, [r3, #64]
	vldr s13, [r3, #64]
	mov.w ip, #0
	strb.w ip, [r0, #20]
	mov.w ip, #1
	b.w .Ljoint_r2_tick_observed
.Ljoint_r2_tick_beyond:
	push.w {r4-r5}
	vpush {s16-s19}
	vabs.f32 s16, s11
	vldr s17, [r3, #4]
	vldr s18, [r0, #-4]
	vmul.f32 s17, s17, s18
	vabs.f32 s18, s17
	vcmp.f32 s16, s18
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r4, #1
	movpl.w r4, #0
	vsub.f32 s17, s11, s17
	vabs.f32 s17, s17
	vldr s18, [r3, #-12]
	vcmp.f32 s17, s18
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	and.w r4, r4, r5
	vldr s17, [r3, #-12]
	vcmp.f32 s16, s17
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	orr.w r4, r4, r5
	cmp.w r4, #0
	vpop {s16-s19}
	pop.w {r4-r5}
	bne.w .Ljoint_r2_tick_plausible
	push.w {r4-r5}
	vldr s0, [r1, #12]
	vldr s1, [r3, #8]
	vldr s2, [r1, #8]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #-80]
	vldr s2, [r1, #4]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [r3, #-88]
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
	vldr s4, [r3, #-12]
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
	vldr s0, [r3, #-16]
	vmul.f32 s0, s0, s1
	vsub.f32 s0, s1, s0
	vstr s0, [r2, #4]
	vldr s1, [r3, #-80]
	vldr s2, [r3, #-4]
	vldr s4, [r3, #24]
	vldr s5, [r0, #-40]
	vldr s6, [r3, #28]
	vldr s7, [r0, #-40]
	vabs.f32 s7, s7
	vldr s8, [r3, #12]
	vcmp.f32 s7, s8
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s6, s5
	vmul.f32 s4, s4, s6
	vldr s5, [r3, #28]
	vadd.f32 s4, s4, s5
	vldr s5, [r3, #-4]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it mi
	vmovmi.f32 s5, s2
	vldr s2, [r3, #-80]
	vcmp.f32 s4, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s5
	it gt
	vmovgt.f32 s2, s1
	vstr s2, [r2, #0]
	vldr s1, [r3, #28]
	vstr s1, [r2, #8]
	vstr s0, [r0, #-4]
	vldr s0, [r3, #28]
	vldr s1, [r0, #-8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-8]
	vldr s0, [r3, #28]
	vldr s1, [r0, #-12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-12]
	vldr s0, [r3, #28]
	vldr s1, [r0, #-16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #-16]
	vldr s0, [r3, #28]
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
.Ljoint_r2_tick_table:
	.word 0x429742b0 @ 75.63025
	.word 0xc29742b0 @ -75.63025
	.word 0x461c4000 @ 10000.0
	.word 0xbf169697 @ -0.5882353
	.word 0x447a0000 @ 1000.0
	.word 0x3f002910 @ 0.50062656
	.word 0x43960000 @ 300.0
	.word 0x429c7878 @ 78.23529
	.word 0x38cfa157 @ 9.900581e-5
	.word 0x3ca30606 @ 0.019900333
	.word 0x461c0400 @ 9985.0
	.word 0xf046bcc0 @ -2.4602487e29
	.word 0xf048bc13 @ -2.4849748e29
	.word 0x6d00785e @ 2.4849748e27
	.word 0xed00785e @ -2.4849748e27
	.word 0xef2081e9 @ -4.9674653e28
	.word 0xf27b0a1c @ -4.9723494e30
	.word 0xf196937a @ -1.4912333e30
	.word 0xefed1ffb @ -1.4677322e29
	.word 0x6b036f00 @ 1.5889347e26
	.word 0x6a0908ed @ 4.1416247e25
	.word 0x0e000000 @ 1.5777218e-30
	.word 0x3a8301a9 @ 0.0009995002
	.word 0x48160000 @ 153600.0
	.word 0x43960000 @ 300.0
	.word 0xc3960000 @ -300.0
	.word 0x80000000 @ -0.0
	.word 0x3ea09b98 @ 0.3136871
	.word 0x41f00000 @ 30.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xbef0dc8d @ -0.47043267
	.word 0x7e967699 @ 1e38
	.word 0x3f800000 @ 1.0
	.word 0x00000000 @ 0.0
	.size joint_r2_tick, .-joint_r2_tick

	.section .text.joint_r2_start, "ax", %progbits
	.balign 8
	.global joint_r2_start
	.type joint_r2_start, %function
	.thumb_func
joint_r2_start:
	push.w {r4-r5}
	movw r3, #:lower16:.Ljoint_r2_start_table
	movt r3, #:upper16:.Ljoint_r2_start_table
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
.Ljoint_r2_start_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x447a0000 @ 1000.0
	.word 0x43960000 @ 300.0
	.word 0x41f00000 @ 30.0
	.word 0x00000000 @ 0.0
	.size joint_r2_start, .-joint_r2_start

	.section .text.joint_r2_not_started, "ax", %progbits
	.balign 8
	.global joint_r2_not_started
	.type joint_r2_not_started, %function
	.thumb_func
joint_r2_not_started:
	movw r3, #:lower16:.Ljoint_r2_not_started_table
	movt r3, #:upper16:.Ljoint_r2_not_started_table
	vldr s0, [r3, #0]
	vstr s0, [r0, #8]
	vldr s0, [r3, #0]
	vstr s0, [r0, #4]
	vldr s0, [r3, #0]
	vstr s0, [r0, #0]
	mov.w r0, #1
	bx lr
	.balign 4
.Ljoint_r2_not_started_table:
	.word 0x00000000 @ 0.0
	.size joint_r2_not_started, .-joint_r2_not_started

	.section .text.joint_r2_report_applied, "ax", %progbits
	.balign 8
	.global joint_r2_report_applied
	.type joint_r2_report_applied, %function
	.thumb_func
joint_r2_report_applied:
	push.w {r4-r5}
	movw r3, #:lower16:.Ljoint_r2_report_applied_table
	movt r3, #:upper16:.Ljoint_r2_report_applied_table
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
.Ljoint_r2_report_applied_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.size joint_r2_report_applied, .-joint_r2_report_applied

	.section .text.joint_r2_estimates, "ax", %progbits
	.balign 8
	.global joint_r2_estimates
	.type joint_r2_estimates, %function
	.thumb_func
joint_r2_estimates:
	push.w {r4-r5}
	movw r3, #:lower16:.Ljoint_r2_estimates_table
	movt r3, #:upper16:.Ljoint_r2_estimates_table
	ldrb.w r4, [r0, #41]
	cmp.w r4, #0
	beq.w .Ljoint_r2_estimates_1
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
.Ljoint_r2_estimates_1:
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
.Ljoint_r2_estimates_table:
	.word 0x3f002910 @ 0.50062656
	.word 0x42ffa39c @ 127.81955
	.word 0x3f000000 @ 0.5
	.word 0x3f800000 @ 1.0
	.word 0x38d1b717 @ 0.0001
	.word 0x00000000 @ 0.0
	.size joint_r2_estimates, .-joint_r2_estimates

	.section .text.joint_r2_reset, "ax", %progbits
	.balign 8
	.global joint_r2_reset
	.type joint_r2_reset, %function
	.thumb_func
joint_r2_reset:
	push.w {r4-r5}
	movw r3, #:lower16:.Ljoint_r2_reset_table
	movt r3, #:upper16:.Ljoint_r2_reset_table
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
.Ljoint_r2_reset_table:
	.word 0x00000000 @ 0.0
	.size joint_r2_reset, .-joint_r2_reset
