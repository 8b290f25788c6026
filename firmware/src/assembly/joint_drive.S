@ The functions of joint_drive.h, exported by version 0.1.0.
@ Design 0x8b62323f (FNV-1a; `design_hash` in the run.json of a run).
@ Changed by --set drive.period_s=1e-3
@ Changed by --set drive.gain_sets=1
@ Changed by --set drive.tuning="normal"
@ Scenario drive.toml (CRC-32 0xdbb5865b):
@
@     # What the image `drive` is designed from: a joint with an encoder on each side, at 3.2 kHz.
@     #
@     #     cargo run --release -- live firmware/drive.toml
@     #
@     # The drive as assembly is that of 1 kHz with one gain set and one observer per encoder, as it is measured everywhere (src/bin/budget.rs):
@     #     host-sim export drive.toml --asm --prefix joint_drive -o src/assembly/joint_drive.S --force \
@     #         --set drive.period_s=1e-3 --set drive.gain_sets=1 --set 'drive.tuning="normal"'
@
@     title = "The joint of the image `drive`"
@
@     [joint]
@     link_inertia_kg_m2 = 0.23
@     motor_inertia_kg_m2 = 931e-6
@     stiffness_n_m = 9.0
@     torque_n_m_per_a = 0.119
@     max_current_a = 30.0
@     link_damping_n_m_s = 0.07
@     motor_damping_n_m_s = 0.07
@     weight_n_m = 0.23
@
@     [encoder.link]
@     bits = 20
@
@     [encoder.motor]
@     bits = 20
@
@     [drive]
@     period_s = 3.125e-4
@     tuning = "coupled"  # the type of its law, and so are
@     gain_sets = 2       # two sets, however little is known
@     sudden_load_n_m = 1.3
@     fallback = 0.0
@
@     [monitor]
@     reaction = "brake"

	.syntax unified
	.cpu cortex-m4
	.fpu fpv4-sp-d16
	.thumb

	.section .text.joint_drive_tick_u, "ax", %progbits
	.balign 8
	.global joint_drive_tick_u
	.type joint_drive_tick_u, %function
	.thumb_func
joint_drive_tick_u:
	ldrb.w ip, [r0, #100]
	ldrh.w r3, [r1, #8]
	orrs.w ip, ip, r3
	bne.w .Ljoint_drive_tick_u_rest
	push.w {r4-r5}
	vpush {s16-s31}
	ldr.w ip, [r0, #72]
	ldr.w r3, [r0, #76]
	ldr.w r2, [r1, #12]
	ldr.w r4, [r0, #80]
	ldr.w r5, [r1, #32]
	cmp.w r5, r2
	bne.w .Ljoint_drive_tick_u_away_0_0
	sub.w r2, r2, r4
	vmov s25, s26, ip, r3
	vmov s27, r2
	ldr.w r2, [r1, #0]
	ldr.w r4, [r0, #64]
	sub.w r4, r2, r4
	sbfx r4, r4, #0, #20
	add.w ip, ip, r4
	vmov s28, s29, r4, ip
	ldr.w r4, [r1, #4]
	ldr.w r5, [r0, #68]
	sub.w r5, r4, r5
	sbfx r5, r5, #0, #20
	add.w r3, r3, r5
	vmov s30, s31, r5, r3
	add.w r1, r1, #16
	adr.w r5, .Ljoint_drive_tick_u_table
	vcvt.f32.s32 s29, s29
	vldmia r0!, {s23-s24}
	vldmia r0!, {s18-s22}
	vldmia r0!, {s9-s17}
	vadd.f32 s8, s18, s18
	vldmia r5!, {s6-s7}
	vmul.f32 s6, s6, s23
	vcvt.f32.s32 s25, s25
	vmul.f32 s23, s7, s13
	vcvt.f32.s32 s26, s26
	vldmia r5!, {s0-s5}
	vmul.f32 s25, s0, s25
	vcvt.f32.s32 s28, s28
	vadd.f32 s25, s25, s19
	vmul.f32 s26, s1, s26
	vmul.f32 s29, s0, s29
	vmul.f32 s28, s0, s28
	vadd.f32 s26, s26, s10
	vadd.f32 s0, s9, s9
	vadd.f32 s8, s8, s21
	vabs.f32 s7, s29
	vmul.f32 s25, s2, s25
	vmul.f32 s26, s3, s26
	vmul.f32 s1, s4, s11
	vmul.f32 s2, s5, s22
	vsub.f32 s8, s8, s25
	vldmia r5!, {s3-s4}
	vmul.f32 s25, s3, s8
	vadd.f32 s0, s0, s12
	vmul.f32 s4, s4, s20
	vsub.f32 s0, s0, s26
	vadd.f32 s26, s21, s2
	vadd.f32 s25, s4, s25
	vmul.f32 s5, s5, s13
	vldmia r5!, {s2-s4}
	vcmp.f32 s7, s2
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_away_64_16
	vmov.f32 s21, s29
	vcmp.f32 s7, s3
	vmrs APSR_nzcv, fpscr
	bgt.w .Ljoint_drive_tick_u_mirrored
.Ljoint_drive_tick_u_turned:
	vadd.f32 s25, s19, s25
	vcvt.f32.s32 s19, s30
	vadd.f32 s0, s0, s6
	vmul.f32 s30, s21, s21
	vldmia r5!, {s6-s7}
	vmul.f32 s6, s6, s0
	vmul.f32 s2, s7, s30
	vadd.f32 s1, s1, s6
	vldmia r5!, {s6-s7}
	vmul.f32 s6, s6, s19
	vcvt.f32.s32 s27, s27
	vadd.f32 s19, s2, s7
	vadd.f32 s5, s12, s5
	vmul.f32 s19, s19, s30
	vldmia r5!, {s2-s3}
	vadd.f32 s2, s19, s2
	vmul.f32 s3, s3, s20
	vldmia r5!, {s19-s20}
	vmul.f32 s19, s19, s11
	vmul.f32 s2, s2, s30
	vadd.f32 s10, s10, s1
	vmul.f32 s7, s20, s29
	vldmia r5!, {s11-s12}
	vmul.f32 s11, s11, s22
	vadd.f32 s20, s2, s12
	vadd.f32 s11, s25, s11
	vldmia r5!, {s1-s2}
	vmul.f32 s25, s1, s30
	vsub.f32 s28, s11, s28
	vmul.f32 s20, s30, s20
	vadd.f32 s25, s25, s2
	vmul.f32 s20, s21, s20
	vldmia r5!, {s11-s12}
	vmul.f32 s11, s11, s13
	vcvt.f32.s32 s31, s31
	vadd.f32 s21, s21, s20
	vabs.f32 s20, s28
	vsub.f32 s2, s29, s21
	vmul.f32 s25, s25, s30
	vadd.f32 s1, s10, s11
	vmul.f32 s31, s12, s31
	vldmia r5!, {s10-s12}
	vadd.f32 s10, s10, s14
	vadd.f32 s25, s25, s11
	vadd.f32 s2, s31, s2
	vmov.f32 s11, #0.5
	vmul.f32 s2, s11, s2
	vcmp.f32 s20, s10
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_away_64_16
	vmul.f32 s27, s12, s27
	vsub.f32 s18, s2, s18
	vsub.f32 s9, s7, s9
	vadd.f32 s8, s8, s18
	vldmia r5!, {s10-s12}
	vmul.f32 s20, s10, s8
	vmul.f32 s18, s11, s18
	vadd.f32 s0, s0, s9
	vmul.f32 s25, s25, s30
	vmul.f32 s0, s12, s0
	vldmia r5!, {s10-s12}
	vadd.f32 s10, s25, s10
	vadd.f32 s18, s28, s18
	vmul.f32 s28, s11, s9
	vsub.f32 s1, s1, s6
	vmul.f32 s25, s12, s18
	vmul.f32 s30, s30, s10
	vadd.f32 s19, s19, s0
	vadd.f32 s28, s1, s28
	vabs.f32 s1, s1
	vabs.f32 s0, s16
	vadd.f32 s20, s3, s20
	vmul.f32 s30, s4, s30
	vldmia r5!, {s8-s12}
	vmul.f32 s8, s8, s18
	vmul.f32 s9, s9, s18
	vsub.f32 s6, s22, s25
	vsub.f32 s3, s18, s9
	vadd.f32 s30, s4, s30
	vmul.f32 s25, s3, s21
	vmov.f32 s9, #0.5
	vmul.f32 s9, s9, s25
	vadd.f32 s10, s10, s14
	vsub.f32 s25, s30, s25
	vmul.f32 s18, s11, s18
	vsub.f32 s30, s30, s9
	vadd.f32 s19, s19, s23
	vcmp.f32 s1, s10
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_away_64_16
	vmul.f32 s22, s12, s22
	vldmia r5!, {s9-s12}
	vmul.f32 s23, s9, s28
	vadd.f32 s20, s20, s22
	vadd.f32 s29, s29, s3
	vmul.f32 s22, s10, s28
	vmul.f32 s11, s11, s28
	vsub.f32 s4, s20, s8
	vmul.f32 s20, s12, s28
	vsub.f32 s8, s28, s23
	vmul.f32 s30, s3, s30
	vsub.f32 s9, s19, s20
	vadd.f32 s31, s31, s8
	vldmia r5!, {s19-s20}
	vmul.f32 s23, s19, s29
	vadd.f32 s30, s21, s30
	vsub.f32 s31, s31, s23
	vmul.f32 s20, s20, s4
	vsub.f32 s11, s13, s11
	vsub.f32 s10, s5, s22
	vldmia r5!, {s21-s23}
	vmul.f32 s12, s14, s21
	vmov.f32 s14, s16
	vmul.f32 s13, s15, s22
	vmul.f32 s23, s23, s31
	vmul.f32 s16, s30, s4
	vadd.f32 s19, s19, s25
	vsub.f32 s5, s26, s18
	vmul.f32 s28, s16, s4
	vldmia r5!, {s21-s22}
	vcmp.f32 s21, s0
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_away_64_16
	vmul.f32 s26, s22, s9
	vsub.f32 s28, s28, s23
	vsub.f32 s31, s31, s20
	vldmia r1!, {s20-s23}
	vmov.f32 s15, s17
	vstmdb r0!, {s7-s15}
	vldmia r1!, {s14-s18}
	vsub.f32 s31, s31, s30
	vsub.f32 s16, s16, s21
	vldmia r5!, {s12-s14}
	vsub.f32 s12, s12, s25
	vsub.f32 s26, s28, s26
	vmul.f32 s28, s12, s5
	vneg.f32 s19, s19
	vmul.f32 s12, s12, s6
	vmul.f32 s0, s19, s31
	vmul.f32 s13, s13, s31
	vadd.f32 s0, s26, s0
	vmul.f32 s26, s14, s24
	vmul.f32 s19, s19, s4
	vadd.f32 s28, s10, s28
	vadd.f32 s19, s9, s19
	vsub.f32 s18, s18, s23
	vsub.f32 s21, s4, s21
	vadd.f32 s1, s11, s12
	vsub.f32 s19, s19, s13
	vldmia r5!, {s7-s14}
	vmul.f32 s7, s7, s19
	vmul.f32 s8, s8, s16
	vadd.f32 s27, s27, s20
	vsub.f32 s7, s0, s7
	vmul.f32 s9, s9, s21
	vsub.f32 s20, s15, s20
	vmul.f32 s16, s10, s5
	vsub.f32 s31, s31, s22
	vadd.f32 s7, s7, s28
	vmul.f32 s18, s11, s18
	vmul.f32 s28, s12, s31
	vsub.f32 s27, s29, s27
	vmul.f32 s29, s13, s20
	vsub.f32 s19, s19, s23
	vadd.f32 s29, s18, s29
	vmul.f32 s18, s14, s7
	vldmia r5!, {s10-s15}
	vmul.f32 s10, s10, s27
	vmul.f32 s23, s11, s1
	vneg.f32 s18, s18
	vabs.f32 s27, s27
	vadd.f32 s9, s18, s9
	vmul.f32 s12, s12, s19
	vadd.f32 s20, s19, s10
	vadd.f32 s18, s9, s28
	vsub.f32 s17, s17, s22
	vmul.f32 s28, s13, s21
	vmul.f32 s31, s14, s31
	vmul.f32 s22, s15, s5
	vadd.f32 s18, s18, s12
	vadd.f32 s8, s29, s8
	vldmia r5!, {s9-s15}
	vmul.f32 s29, s9, s17
	vadd.f32 s28, s20, s28
	vmul.f32 s21, s10, s6
	vadd.f32 s29, s8, s29
	vadd.f32 s17, s28, s31
	vsub.f32 s1, s24, s26
	vadd.f32 s18, s18, s22
	vadd.f32 s31, s17, s16
	vadd.f32 s21, s18, s21
	vadd.f32 s16, s31, s6
	vadd.f32 s31, s21, s23
	vmul.f32 s11, s11, s24
	vadd.f32 s29, s31, s29
	vmul.f32 s31, s12, s16
	vadd.f32 s29, s29, s11
	vstmdb r0!, {s2-s6}
	str.w r2, [r0, #56]
	str.w r4, [r0, #60]
	str.w ip, [r0, #64]
	str.w r3, [r0, #68]
	mov.w r2, #0
	str.w r2, [r0, #76]
	str.w r2, [r0, #80]
	vadd.f32 s0, s29, s31
	vcmp.f32 s27, s13
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_law
	vabs.f32 s16, s0
	vmov.f32 s31, #-30.0
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s14
	vcmp.f32 s0, s31
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s31
	vcmp.f32 s16, s15
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_u_law
	vstmdb r0!, {s0-s1}
	vpop {s16-s31}
	pop.w {r4-r5}
	bx lr
.Ljoint_drive_tick_u_mirrored:
	vcmp.f32 s29, #0.0
	vmrs APSR_nzcv, fpscr
	vpush {s0}
	vldr s0, [r5, #252]
	vsub.f32 s21, s0, s7
	vldr s0, [r5, #256]
	vadd.f32 s21, s21, s0
	it mi
	vnegmi.f32 s21, s21
	vneg.f32 s4, s4
	vpop {s0}
	b.w .Ljoint_drive_tick_u_turned
.Ljoint_drive_tick_u_law:
	sub.w r0, r0, #8
	sub.w r1, r1, #52
	push.w {r4, lr}
	sub.w sp, sp, #40
	vstr s30, [sp, #4]
	vstr s25, [sp, #8]
	mov.w ip, #0
	strb.w ip, [sp, #0]
	strb.w ip, [sp, #12]
	strb.w ip, [sp, #16]
	add.w r3, sp, #24
	mov r2, sp
	bl joint_drive_law
	vldr s0, [sp, #24]
	add.w sp, sp, #40
	pop.w {r4, lr}
	vpop {s16-s31}
	pop.w {r4-r5}
	bx lr
.Ljoint_drive_tick_u_away_0_0:
	b.w .Ljoint_drive_tick_u_leave
.Ljoint_drive_tick_u_away_64_16:
	sub.w r0, r0, #64
	sub.w r1, r1, #16
	b.w .Ljoint_drive_tick_u_leave
.Ljoint_drive_tick_u_leave:
	vpop {s16-s31}
	pop.w {r4-r5}
.Ljoint_drive_tick_u_rest:
	push {r4, lr}
	sub.w sp, sp, #16
	mov r2, sp
	bl joint_drive_rest
	vldr s0, [sp]
	add.w sp, sp, #16
	pop {r4, pc}
	.balign 4
.Ljoint_drive_tick_u_table:
	.word 0x459c4d13 @ 5001.6343
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x3975dd20 @ 0.00023447396
	.word 0x42208591 @ 40.130436
	.word 0x46170c19 @ 9667.024
	.word 0x3a7c1fef @ 0.00096177956
	.word 0x3a83126f @ 0.001
	.word 0x35063423 @ 4.999476e-7
	.word 0x3a830d1a @ 0.0009998411
	.word 0x406231d6 @ 3.5342917
	.word 0x3fc90fdb @ 1.5707964
	.word 0x3f800000 @ 1.0
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x362e7949 @ 2.5998618e-6
	.word 0x3975dd20 @ 0.00023447396
	.word 0xb94fafbf @ -0.00019806529
	.word 0x3c088734 @ 0.008333016
	.word 0x3f7feabe @ 0.99967563
	.word 0x3f6c4815 @ 0.9229749
	.word 0x4838b45c @ 189137.44
	.word 0x2f373cd5 @ 1.6665365e-10
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x37c28d4e @ 2.3192402e-5
	.word 0xbab59c80 @ -0.0013855845
	.word 0x2f33c5ab @ 1.6350181e-10
	.word 0x3975dd20 @ 0.00023447396
	.word 0x38ff312a @ 0.00012168505
	.word 0x3d2aa7d9 @ 0.04166398
	.word 0x40c90fdb @ 6.2831855
	.word 0x3a830d1a @ 0.0009998411
	.word 0x35063423 @ 4.999476e-7
	.word 0x3a7c1fef @ 0.00096177956
	.word 0xbeffffe9 @ -0.4999993
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x470d47c1 @ 36167.754
	.word 0x41c5f1a4 @ 24.742989
	.word 0x3e623391 @ 0.22089984
	.word 0x3dc1b5f1 @ 0.09458531
	.word 0x44b4fcb2 @ 1447.8967
	.word 0x35063423 @ 4.999476e-7
	.word 0x3f461ed1 @ 0.7739077
	.word 0x483f7812 @ 196064.28
	.word 0x4be536cc @ 30043544.0
	.word 0x43f408fd @ 488.07022
	.word 0x421c8591 @ 39.130436
	.word 0x3e9bd37a @ 0.3043478
	.word 0x3f7befc5 @ 0.98412734
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x46170c19 @ 9667.024
	.word 0x41f00000 @ 30.0
	.word 0x4296603e @ 75.18797
	.word 0xc21c26b7 @ -39.037807
	.word 0x3e9bd37a @ 0.3043478
	.word 0x3c230606 @ 0.009950167
	.word 0x3e9bd37a @ 0.3043478
	.word 0x3f1a6e60 @ 0.6032467
	.word 0xbfce201e @ -1.6103551
	.word 0x426ec859 @ 59.695652
	.word 0x3e548ee5 @ 0.20757635
	.word 0xbe77b548 @ -0.24190247
	.word 0x3f7a81e5 @ 0.97854453
	.word 0x3951a58c @ 0.00019993464
	.word 0x45fa0000 @ 8000.0
	.word 0xb3d731df @ -1.0020789e-7
	.word 0xbc37d91e @ -0.011221198
	.word 0x44960000 @ 1200.0
	.word 0x42700000 @ 60.0
	.word 0xbe743606 @ -0.23848733
	.word 0x3f7c23eb @ 0.98492306
	.word 0xb8fa1f22 @ -0.00011926728
	.word 0x3c94952f @ 0.018137543
	.word 0xbca50026 @ -0.020141672
	.word 0x3e764a8d @ 0.24051876
	.word 0x41f00000 @ 30.0
	.word 0x46700000 @ 15360.0
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.size joint_drive_tick_u, .-joint_drive_tick_u

	.section .text.joint_drive_tick, "ax", %progbits
	.balign 8
	.global joint_drive_tick
	.type joint_drive_tick, %function
	.thumb_func
joint_drive_tick:
	ldrb.w ip, [r0, #100]
	ldrh.w r3, [r1, #8]
	orrs.w ip, ip, r3
	bne.w .Ljoint_drive_tick_rest
	push.w {r4-r7}
	vpush {s16-s27}
	ldr.w ip, [r0, #72]
	ldr.w r3, [r0, #76]
	ldr.w r4, [r1, #12]
	ldr.w r5, [r0, #80]
	ldr.w r6, [r1, #32]
	cmp.w r6, r4
	bne.w .Ljoint_drive_tick_away_0_0
	sub.w r4, r4, r5
	vmov s21, s22, ip, r3
	vmov s23, r4
	ldr.w r4, [r1, #0]
	ldr.w r5, [r0, #64]
	sub.w r5, r4, r5
	sbfx r5, r5, #0, #20
	add.w ip, ip, r5
	vmov s24, s25, r5, ip
	ldr.w r5, [r1, #4]
	ldr.w r6, [r0, #68]
	sub.w r6, r5, r6
	sbfx r6, r6, #0, #20
	add.w r3, r3, r6
	vmov s26, s27, r6, r3
	add.w r1, r1, #16
	adr.w r6, .Ljoint_drive_tick_table
	mov.w r7, #0
	vldmia r0!, {s19-s20}
	vcvt.f32.s32 s21, s21
	vldmia r0!, {s14-s18}
	vldmia r0!, {s5-s13}
	vcvt.f32.s32 s25, s25
	vldmia r6!, {s0-s4}
	vmul.f32 s0, s0, s19
	vadd.f32 s19, s14, s14
	vcvt.f32.s32 s24, s24
	vmul.f32 s21, s1, s21
	vmul.f32 s24, s1, s24
	vadd.f32 s21, s21, s15
	vcvt.f32.s32 s22, s22
	vadd.f32 s19, s19, s17
	vmul.f32 s21, s2, s21
	vmul.f32 s22, s3, s22
	vsub.f32 s19, s19, s21
	vmul.f32 s21, s4, s16
	vadd.f32 s22, s22, s6
	vldmia r6!, {s2-s4}
	vmul.f32 s22, s2, s22
	vmul.f32 s3, s3, s19
	vadd.f32 s2, s5, s5
	vmul.f32 s25, s1, s25
	vcvt.f32.s32 s26, s26
	vadd.f32 s2, s2, s8
	vadd.f32 s21, s21, s3
	vmul.f32 s26, s4, s26
	vadd.f32 s21, s15, s21
	vsub.f32 s22, s2, s22
	vldmia r6!, {s1-s4}
	vmul.f32 s15, s1, s7
	vmul.f32 s16, s2, s16
	vmul.f32 s1, s3, s18
	vadd.f32 s22, s22, s0
	vmul.f32 s0, s4, s7
	vabs.f32 s7, s25
	vadd.f32 s21, s21, s1
	vldmia r6!, {s1-s4}
	vmul.f32 s1, s1, s22
	vcvt.f32.s32 s23, s23
	vadd.f32 s1, s15, s1
	vsub.f32 s21, s21, s24
	vcvt.f32.s32 s27, s27
	vadd.f32 s24, s6, s1
	vmul.f32 s2, s2, s9
	vmov.f32 s15, #1.0
	vmov.f32 s6, s25
	vcmp.f32 s7, s3
	vmrs APSR_nzcv, fpscr
	bgt.w .Ljoint_drive_tick_mirrored
.Ljoint_drive_tick_turned:
	vmul.f32 s1, s6, s6
	vcmp.f32 s7, s4
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_away_64_16
	vadd.f32 s24, s24, s2
	vldmia r6!, {s2-s4}
	vmul.f32 s7, s2, s1
	vmul.f32 s3, s3, s1
	vsub.f32 s24, s24, s26
	vadd.f32 s26, s3, s4
	vldmia r6!, {s2-s4}
	vadd.f32 s7, s7, s2
	vmul.f32 s26, s26, s1
	vmul.f32 s27, s3, s27
	vadd.f32 s26, s26, s4
	vmul.f32 s7, s7, s1
	vmul.f32 s26, s26, s1
	vldmia r6!, {s2-s4}
	vadd.f32 s26, s26, s2
	vadd.f32 s2, s7, s3
	vmul.f32 s26, s1, s26
	vmul.f32 s7, s4, s25
	vmul.f32 s2, s2, s1
	vmul.f32 s26, s6, s26
	vsub.f32 s5, s7, s5
	vldmia r6!, {s3-s4}
	vadd.f32 s3, s2, s3
	vmul.f32 s4, s4, s5
	vabs.f32 s2, s12
	vadd.f32 s26, s6, s26
	vabs.f32 s6, s24
	vadd.f32 s22, s22, s5
	vadd.f32 s24, s24, s4
	vmul.f32 s1, s1, s3
	vldmia r6!, {s3-s5}
	vadd.f32 s3, s3, s10
	vmul.f32 s22, s4, s22
	vcmp.f32 s6, s3
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_away_64_16
	vsub.f32 s3, s25, s26
	vadd.f32 s5, s5, s10
	vabs.f32 s4, s21
	vadd.f32 s3, s27, s3
	vmul.f32 s1, s15, s1
	vadd.f32 s22, s0, s22
	vadd.f32 s0, s15, s1
	vmov.f32 s15, #30.0
	vcmp.f32 s15, s2
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_away_64_16
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_away_64_16
	vmov.f32 s15, #0.5
	vmul.f32 s2, s15, s3
	vmov.f32 s15, s13
	vsub.f32 s1, s2, s14
	vmov.f32 s14, s12
	vadd.f32 s19, s19, s1
	vldmia r6!, {s3-s6}
	vmul.f32 s12, s3, s9
	vmul.f32 s19, s4, s19
	vmul.f32 s3, s3, s18
	vmul.f32 s1, s5, s1
	vadd.f32 s19, s16, s19
	vadd.f32 s21, s21, s1
	vadd.f32 s17, s17, s3
	vmul.f32 s16, s6, s24
	vadd.f32 s8, s8, s12
	vldmia r6!, {s3-s6}
	vmul.f32 s1, s3, s24
	vmul.f32 s12, s10, s4
	vmul.f32 s13, s11, s5
	vmul.f32 s6, s6, s24
	vsub.f32 s10, s8, s1
	vsub.f32 s8, s24, s16
	vsub.f32 s11, s9, s6
	vldmia r6!, {s3-s6}
	vmul.f32 s24, s3, s24
	vmul.f32 s16, s4, s21
	vmul.f32 s9, s5, s9
	vsub.f32 s3, s21, s16
	vmul.f32 s16, s6, s21
	vldmia r6!, {s4-s6}
	vmul.f32 s1, s4, s18
	vadd.f32 s25, s25, s3
	vadd.f32 s1, s19, s1
	vmul.f32 s19, s3, s26
	vmul.f32 s5, s5, s21
	vsub.f32 s4, s1, s16
	vsub.f32 s5, s17, s5
	vadd.f32 s16, s22, s9
	vmul.f32 s17, s6, s21
	vldmia r6!, {s21-s22}
	vmul.f32 s1, s21, s25
	vsub.f32 s6, s18, s17
	vsub.f32 s17, s0, s19
	vadd.f32 s27, s27, s8
	vmov.f32 s18, #0.5
	vmul.f32 s19, s18, s19
	vsub.f32 s9, s16, s24
	vsub.f32 s0, s0, s19
	vsub.f32 s1, s27, s1
	vmul.f32 s16, s22, s23
	vadd.f32 s18, s21, s17
	vmul.f32 s0, s3, s0
	vneg.f32 s18, s18
	vldmia r6!, {s21-s24}
	vsub.f32 s19, s21, s17
	vmul.f32 s21, s22, s4
	vmul.f32 s27, s23, s1
	vsub.f32 s1, s1, s21
	vadd.f32 s26, s26, s0
	vstmdb r0!, {s7-s15}
	vmul.f32 s21, s19, s5
	vsub.f32 s1, s1, s26
	vmul.f32 s23, s18, s4
	vmul.f32 s0, s26, s4
	vmul.f32 s18, s18, s1
	vmul.f32 s19, s19, s6
	vmul.f32 s15, s0, s4
	vadd.f32 s23, s9, s23
	vsub.f32 s27, s15, s27
	vadd.f32 s19, s11, s19
	vadd.f32 s21, s10, s21
	vstmdb r0!, {s2-s6}
	str.w r4, [r0, #56]
	str.w r5, [r0, #60]
	str.w ip, [r0, #64]
	str.w r3, [r0, #68]
	mov.w r4, #0
	str.w r4, [r0, #76]
	str.w r4, [r0, #80]
	vmul.f32 s0, s22, s1
	vmul.f32 s24, s24, s9
	vsub.f32 s23, s23, s0
	vldmia r1!, {s7-s15}
	vsub.f32 s0, s15, s10
	vmul.f32 s22, s22, s23
	vsub.f32 s27, s27, s24
	vsub.f32 s24, s12, s7
	vsub.f32 s14, s14, s9
	vadd.f32 s27, s27, s18
	vsub.f32 s4, s4, s8
	vadd.f32 s18, s16, s7
	vsub.f32 s16, s1, s9
	vsub.f32 s13, s13, s8
	vsub.f32 s23, s23, s10
	vldmia r6!, {s7-s12}
	vmul.f32 s19, s7, s19
	vsub.f32 s18, s25, s18
	vmul.f32 s8, s8, s4
	vmul.f32 s25, s9, s0
	vsub.f32 s22, s27, s22
	vmul.f32 s27, s10, s24
	vmul.f32 s24, s11, s13
	vadd.f32 s22, s22, s21
	vmul.f32 s21, s12, s14
	vldmia r6!, {s9-s15}
	vmul.f32 s9, s9, s4
	vmul.f32 s10, s10, s16
	vmul.f32 s22, s11, s22
	vmul.f32 s12, s12, s18
	vmul.f32 s0, s13, s20
	vadd.f32 s1, s23, s12
	vneg.f32 s22, s22
	vadd.f32 s1, s1, s8
	vmul.f32 s23, s14, s23
	vadd.f32 s22, s22, s9
	vmul.f32 s15, s15, s16
	vadd.f32 s22, s22, s10
	vldmia r6!, {s8-s14}
	vmul.f32 s8, s8, s5
	vadd.f32 s25, s25, s27
	vabs.f32 s18, s18
	vmul.f32 s9, s9, s6
	vmul.f32 s27, s10, s5
	vadd.f32 s16, s25, s24
	vadd.f32 s24, s1, s15
	vadd.f32 s25, s22, s23
	vadd.f32 s24, s24, s27
	vadd.f32 s25, s25, s8
	vadd.f32 s6, s24, s6
	vadd.f32 s9, s25, s9
	vadd.f32 s27, s16, s21
	vmul.f32 s25, s11, s6
	vadd.f32 s24, s9, s19
	vmul.f32 s16, s12, s20
	vstr s6, [r2, #4]
	vadd.f32 s24, s24, s27
	vsub.f32 s19, s6, s20
	vadd.f32 s16, s24, s16
	vstr s19, [r2, #8]
	vadd.f32 s25, s16, s25
	vsub.f32 s1, s20, s0
	vabs.f32 s16, s25
	vmov.f32 s27, #30.0
	vmov.f32 s15, #-30.0
	vmov.f32 s0, s25
	vcmp.f32 s0, s27
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s27
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s15
	vcmp.f32 s18, s13
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_law
	vcmp.f32 s0, s25
	vmrs APSR_nzcv, fpscr
	it ne
	addne r7, #2
	vcmp.f32 s16, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Ljoint_drive_tick_law
	vstr s0, [r2, #0]
	vstmdb r0!, {s0-s1}
	mov.w r0, r7
	vpop {s16-s27}
	pop.w {r4-r7}
	bx lr
.Ljoint_drive_tick_mirrored:
	vcmp.f32 s25, #0.0
	vmrs APSR_nzcv, fpscr
	vpush {s0}
	vldr s0, [r6, #220]
	vsub.f32 s6, s0, s7
	vldr s0, [r6, #224]
	vadd.f32 s6, s6, s0
	it mi
	vnegmi.f32 s6, s6
	vneg.f32 s15, s15
	vpop {s0}
	b.w .Ljoint_drive_tick_turned
.Ljoint_drive_tick_law:
	sub.w r0, r0, #8
	sub.w r1, r1, #52
	push.w {r4, lr}
	sub.w sp, sp, #40
	vstr s26, [sp, #4]
	vstr s17, [sp, #8]
	mov.w ip, #0
	strb.w ip, [sp, #0]
	strb.w ip, [sp, #12]
	strb.w ip, [sp, #16]
	mov r3, r2
	mov r2, sp
	bl joint_drive_law
	add.w sp, sp, #40
	pop.w {r4, lr}
	vpop {s16-s27}
	pop.w {r4-r7}
	bx lr
.Ljoint_drive_tick_away_0_0:
	b.w .Ljoint_drive_tick_leave
.Ljoint_drive_tick_away_64_16:
	sub.w r0, r0, #64
	sub.w r1, r1, #16
	b.w .Ljoint_drive_tick_leave
.Ljoint_drive_tick_leave:
	vpop {s16-s27}
	pop.w {r4-r7}
.Ljoint_drive_tick_rest:
	b.w joint_drive_rest
	.balign 4
.Ljoint_drive_tick_table:
	.word 0x459c4d13 @ 5001.6343
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x42208591 @ 40.130436
	.word 0x3975dd20 @ 0.00023447396
	.word 0x3a830d1a @ 0.0009998411
	.word 0x46170c19 @ 9667.024
	.word 0x35063423 @ 4.999476e-7
	.word 0x3975dd20 @ 0.00023447396
	.word 0x3a7c1fef @ 0.00096177956
	.word 0x3f7feabe @ 0.99967563
	.word 0x2f373cd5 @ 1.6665365e-10
	.word 0x3f6c4815 @ 0.9229749
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x2f33c5ab @ 1.6350181e-10
	.word 0x3fc90fdb @ 1.5707964
	.word 0x406231d6 @ 3.5342917
	.word 0x37c28d4e @ 2.3192402e-5
	.word 0x362e7949 @ 2.5998618e-6
	.word 0xb94fafbf @ -0.00019806529
	.word 0xbab59c80 @ -0.0013855845
	.word 0x3975dd20 @ 0.00023447396
	.word 0x3c088734 @ 0.008333016
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x3d2aa7d9 @ 0.04166398
	.word 0x4838b45c @ 189137.44
	.word 0xbeffffe9 @ -0.4999993
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x3dc1b5f1 @ 0.09458531
	.word 0x3a7c1fef @ 0.00096177956
	.word 0x38ff312a @ 0.00012168505
	.word 0x3a83126f @ 0.001
	.word 0x3a830d1a @ 0.0009998411
	.word 0x35063423 @ 4.999476e-7
	.word 0x3f461ed1 @ 0.7739077
	.word 0x483f7812 @ 196064.28
	.word 0x3f7befc5 @ 0.98412734
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x4be536cc @ 30043544.0
	.word 0x43f408fd @ 488.07022
	.word 0x3e623391 @ 0.22089984
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x41c5f1a4 @ 24.742989
	.word 0x35063423 @ 4.999476e-7
	.word 0x44b4fcb2 @ 1447.8967
	.word 0x470d47c1 @ 36167.754
	.word 0x421c8591 @ 39.130436
	.word 0x40c90fdb @ 6.2831855
	.word 0xc21c26b7 @ -39.037807
	.word 0x3e9bd37a @ 0.3043478
	.word 0x46170c19 @ 9667.024
	.word 0x4296603e @ 75.18797
	.word 0xb3d731df @ -1.0020789e-7
	.word 0x44960000 @ 1200.0
	.word 0x3e548ee5 @ 0.20757635
	.word 0x3f7a81e5 @ 0.97854453
	.word 0x3f1a6e60 @ 0.6032467
	.word 0x3f7c23eb @ 0.98492306
	.word 0xbfce201e @ -1.6103551
	.word 0xbe77b548 @ -0.24190247
	.word 0x3951a58c @ 0.00019993464
	.word 0x45fa0000 @ 8000.0
	.word 0x3c230606 @ 0.009950167
	.word 0xbc37d91e @ -0.011221198
	.word 0x42700000 @ 60.0
	.word 0xbe743606 @ -0.23848733
	.word 0xb8fa1f22 @ -0.00011926728
	.word 0x426ec859 @ 59.695652
	.word 0xbca50026 @ -0.020141672
	.word 0x3c94952f @ 0.018137543
	.word 0x3e764a8d @ 0.24051876
	.word 0x46700000 @ 15360.0
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.size joint_drive_tick, .-joint_drive_tick

	.section .text.joint_drive_rest, "ax", %progbits
	.balign 8
	.global joint_drive_rest
	.type joint_drive_rest, %function
	.thumb_func
joint_drive_rest:
	push.w {r4-r6, lr}
	sub.w sp, sp, #24
	mov r4, r0
	mov r5, r1
	mov r6, r2
	mov r2, sp
	ldrb.w ip, [r0, #100]
	cmp.w ip, #0
	beq.w .Ljoint_drive_goes_on
	bl joint_drive_begin
	cmp.w r0, #0
	bne.w .Ljoint_drive_known
	mov r0, r6
	bl joint_drive_not_started
	b.w .Ljoint_drive_done
.Ljoint_drive_goes_on:
	bl joint_drive_observe
	cmp.w r0, #0
	beq.w .Ljoint_drive_unknown
.Ljoint_drive_known:
	mov r0, r4
	mov r1, r5
	mov r2, sp
	mov r3, r6
	bl joint_drive_law
	ldrb.w ip, [sp, #16]
	orr.w r5, r0, ip, lsl #7
	ldrb.w r6, [sp, #12]
	orr.w r5, r5, r6, lsl #3
	mov r0, r4
	bl joint_drive_follow
	cmp.w r6, #0
	beq.w .Ljoint_drive_told
	b.w .Ljoint_drive_carry
.Ljoint_drive_unknown:
	mov r0, r4
	mov r1, r5
	mov r2, r6
	bl joint_drive_give_up
	mov r5, r0
	mov r0, r4
	bl joint_drive_follow
.Ljoint_drive_carry:
	mov r0, r4
	bl joint_drive_carry
.Ljoint_drive_told:
	mov r0, r5
.Ljoint_drive_done:
	add.w sp, sp, #24
	pop.w {r4-r6, pc}
	.size joint_drive_rest, .-joint_drive_rest

	.section .text.joint_drive_begin, "ax", %progbits
	.balign 8
	.global joint_drive_begin
	.type joint_drive_begin, %function
	.thumb_func
joint_drive_begin:
	push.w {r4-r11}
	sub.w sp, sp, #112
	movw ip, #:lower16:.Ljoint_drive_begin_table
	movt ip, #:upper16:.Ljoint_drive_begin_table
	vldr s0, [r0, #52]
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	cmp.w r4, #0
	beq.w .Ljoint_drive_begin_1
	vldr s0, [r0, #52]
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	vldr s0, [r0, #52]
	vldr s1, [ip, #8]
	vldr s2, [ip, #12]
	vldr s3, [ip, #16]
	vldr s4, [ip, #20]
	vldr s5, [r0, #16]
	vldr s6, [ip, #24]
	ldr.w r6, [r1, #0]
	ldr.w r7, [r0, #64]
	sub.w r8, r6, r7
	sbfx r8, r8, #0, #20
	vmov s7, r8
	vcvt.f32.s32 s7, s7
	vmul.f32 s6, s6, s7
	vldr s7, [ip, #16]
	vdiv.f32 s7, s6, s7
	vadd.f32 s5, s5, s7
	vmul.f32 s4, s4, s5
	vabs.f32 s5, s4
	vmul.f32 s3, s3, s5
	vldr s5, [ip, #28]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	vldr s3, [ip, #16]
	vldr s5, [ip, #20]
	vldr s8, [r0, #36]
	vldr s9, [ip, #32]
	ldrb.w r11, [r1, #8]
	cmp.w r11, #0
	mov.w r10, r6
	it ne
	movne.w r10, r7
	ldr.w r6, [r1, #4]
	ldr.w r7, [r0, #68]
	str.w r4, [sp, #0]
	sub.w r4, r6, r7
	str.w r8, [sp, #4]
	str.w r11, [sp, #8]
	ldrb.w r11, [r1, #9]
	cmp.w r11, #0
	mov.w r8, r4
	it ne
	movne.w r8, r10
	sbfx r8, r8, #0, #20
	vmov s10, r8
	vcvt.f32.s32 s10, s10
	vmul.f32 s9, s9, s10
	vldr s10, [ip, #16]
	vdiv.f32 s10, s9, s10
	vadd.f32 s8, s8, s10
	vmul.f32 s5, s5, s8
	vabs.f32 s8, s5
	vmul.f32 s3, s3, s8
	vldr s8, [ip, #36]
	str.w r10, [sp, #12]
	vcmp.f32 s3, s8
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	and.w r9, r9, r10
	cmp.w r9, #0
	it ne
	vmovne.f32 s2, s1
	vsub.f32 s0, s0, s2
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r9, #1
	movhi.w r9, #0
	and.w r10, r5, r9
	vldr s1, [ip, #16]
	vldr s2, [r0, #36]
	vmul.f32 s1, s1, s2
	vsub.f32 s1, s9, s1
	vabs.f32 s1, s1
	vldr s2, [ip, #36]
	str.w r5, [sp, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r10, r10, r5
	vldr s1, [ip, #16]
	vldr s2, [r0, #16]
	vmul.f32 s1, s1, s2
	vsub.f32 s1, s6, s1
	vabs.f32 s1, s1
	vldr s2, [ip, #28]
	str.w r6, [sp, #20]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r6, #1
	movhi.w r6, #0
	and.w r10, r10, r6
	str.w r7, [sp, #24]
	eor.w r7, r11, #1
	and.w r7, r10, r7
	ldr.w r10, [sp, #8]
	str.w r4, [sp, #28]
	eor.w r4, r10, #1
	and.w r4, r7, r4
	vldr s1, [ip, #40]
	vldr s2, [ip, #12]
	vldr s3, [ip, #24]
	ldr.w r7, [r0, #72]
	str.w r9, [sp, #32]
	ldr.w r9, [sp, #4]
	add.w r9, r7, r9
	str.w r5, [sp, #4]
	cmp.w r10, #0
	mov.w r5, r9
	it ne
	movne.w r5, r7
	cmp.w r11, #0
	mov.w r7, r5
	it ne
	movne.w r7, r8
	ldr.w r9, [ip, #44]
	sdiv r8, r7, r9
	ldr.w r9, [ip, #44]
	mul r8, r8, r9
	sub.w r9, r7, r8
	sbfx r9, r9, #0, #23
	str.w r6, [sp, #36]
	ldr.w r6, [sp, #12]
	str.w r4, [sp, #40]
	sbfx r4, r6, #0, #20
	str.w r5, [sp, #44]
	ldr.w r10, [ip, #44]
	sdiv r5, r4, r10
	ldr.w r10, [ip, #44]
	mul r5, r5, r10
	sub.w r10, r4, r5
	sbfx r10, r10, #0, #23
	str.w r11, [sp, #48]
	str.w r7, [sp, #52]
	ldr.w r7, [sp, #48]
	cmp.w r7, #0
	mov.w r11, r10
	it ne
	movne.w r11, r9
	str.w r8, [sp, #56]
	ldr.w r8, [sp, #44]
	str.w r9, [sp, #60]
	ldr.w r6, [ip, #44]
	sdiv r9, r8, r6
	ldr.w r6, [ip, #44]
	mul r9, r9, r6
	sub.w r6, r8, r9
	sbfx r6, r6, #0, #23
	str.w r4, [sp, #64]
	ldr.w r4, [sp, #60]
	str.w r5, [sp, #68]
	cmp.w r7, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	str.w r10, [sp, #72]
	ldr.w r8, [sp, #0]
	vldr s6, [r0, #48]
	vldr s8, [ip, #0]
	str.w r9, [sp, #76]
	vcmp.f32 s6, s8
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	str.w r6, [sp, #80]
	and.w r6, r8, r9
	cmp.w r6, #0
	mov.w r10, r5
	it ne
	movne.w r10, r11
	str.w r11, [sp, #84]
	ldr.w r11, [sp, #80]
	str.w r5, [sp, #88]
	cmp.w r6, #0
	mov.w r5, r11
	it ne
	movne.w r5, r4
	ldr.w r7, [sp, #72]
	str.w r9, [sp, #92]
	ldr.w r9, [sp, #4]
	eor.w r11, r9, #1
	str.w r6, [sp, #96]
	ldr.w r6, [sp, #92]
	and.w r9, r11, r6
	cmp.w r9, #0
	mov.w r8, r4
	it ne
	movne.w r8, r7
	str.w r11, [sp, #100]
	cmp.w r6, #0
	mov.w r11, r4
	it ne
	movne.w r11, r7
	str.w r9, [sp, #72]
	ldr.w r9, [sp, #36]
	cmp.w r9, #0
	mov.w r7, r11
	it ne
	movne.w r7, r8
	ldr.w r11, [sp, #0]
	cmp.w r11, #0
	mov.w r8, r4
	it ne
	movne.w r8, r7
	str.w r7, [sp, #104]
	ldr.w r7, [sp, #48]
	cmp.w r7, #0
	mov.w r6, r8
	it ne
	movne.w r6, r5
	ldr.w r8, [sp, #8]
	cmp.w r8, #0
	mov.w r5, r6
	it ne
	movne.w r5, r10
	vmov s6, r5
	vcvt.f32.s32 s6, s6
	vmul.f32 s3, s3, s6
	vabs.f32 s6, s3
	vldr s8, [ip, #48]
	vcmp.f32 s6, s8
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	cmp.w r5, #0
	it ne
	vmovne.f32 s2, s1
	vldr s1, [ip, #52]
	vsub.f32 s1, s1, s6
	vldr s6, [ip, #56]
	vadd.f32 s1, s1, s6
	vneg.f32 s6, s1
	vldr s8, [ip, #0]
	vcmp.f32 s3, s8
	vmrs APSR_nzcv, fpscr
	vmov.f32 s8, s1
	it mi
	vmovmi.f32 s8, s6
	cmp.w r5, #0
	vmov.f32 s1, s3
	it ne
	vmovne.f32 s1, s8
	vmul.f32 s6, s1, s1
	vldr s8, [ip, #60]
	vmul.f32 s8, s8, s6
	vldr s9, [ip, #64]
	vadd.f32 s8, s8, s9
	vmul.f32 s8, s8, s6
	vldr s9, [ip, #68]
	vadd.f32 s8, s8, s9
	vmul.f32 s8, s8, s6
	vldr s9, [ip, #72]
	vadd.f32 s8, s8, s9
	vmul.f32 s8, s6, s8
	vmul.f32 s8, s2, s8
	vadd.f32 s2, s2, s8
	vstr s2, [r2, #8]
	vldr s2, [ip, #12]
	vmul.f32 s1, s2, s1
	vldr s2, [ip, #76]
	vmul.f32 s2, s2, s6
	vldr s8, [ip, #80]
	vadd.f32 s2, s2, s8
	vmul.f32 s2, s2, s6
	vldr s8, [ip, #84]
	vadd.f32 s2, s2, s8
	vmul.f32 s2, s2, s6
	vldr s8, [ip, #88]
	vadd.f32 s2, s2, s8
	vmul.f32 s2, s6, s2
	vmul.f32 s2, s1, s2
	vadd.f32 s1, s1, s2
	vstr s1, [r2, #4]
	ldr.w r5, [sp, #16]
	eor.w r5, r5, #1
	ldr.w r6, [sp, #32]
	eor.w r6, r6, #1
	orr.w r6, r5, r6
	ldr.w r10, [sp, #100]
	orr.w r6, r6, r10
	eor.w r4, r9, #1
	orr.w r6, r6, r4
	orr.w r6, r6, r7
	orr.w r6, r6, r8
	strb.w r6, [r0, #100]
	mov.w r6, #1
	strb.w r6, [r2, #0]
	mov.w r6, #0
	strb.w r6, [r2, #16]
	strb.w r6, [r2, #12]
	vldr s1, [ip, #20]
	vldr s2, [ip, #32]
	ldr.w r6, [sp, #24]
	ldr.w r11, [sp, #28]
	str.w r5, [sp, #16]
	cmp.w r7, #0
	mov.w r5, r11
	it ne
	movne.w r5, r6
	sbfx r5, r5, #0, #20
	ldr.w r11, [r0, #76]
	add.w r10, r11, r5
	cmp.w r7, #0
	mov.w r9, r10
	it ne
	movne.w r9, r5
	ldr.w r5, [sp, #56]
	sub.w r5, r9, r5
	sbfx r5, r5, #0, #23
	ldr.w r9, [sp, #20]
	sbfx r10, r9, #0, #20
	str.w r4, [sp, #28]
	ldr.w r4, [sp, #68]
	sub.w r4, r10, r4
	sbfx r4, r4, #0, #23
	cmp.w r7, #0
	mov.w r10, r4
	it ne
	movne.w r10, r5
	ldr.w r8, [sp, #76]
	sub.w r8, r11, r8
	sbfx r8, r8, #0, #23
	cmp.w r7, #0
	mov.w r11, r5
	it ne
	movne.w r11, r8
	ldr.w r9, [sp, #96]
	cmp.w r9, #0
	mov.w r6, r11
	it ne
	movne.w r6, r10
	str.w r4, [sp, #32]
	cmp.w r9, #0
	mov.w r4, r8
	it ne
	movne.w r4, r5
	ldr.w r9, [sp, #32]
	str.w r10, [sp, #56]
	str.w r11, [sp, #68]
	ldr.w r11, [sp, #72]
	cmp.w r11, #0
	mov.w r10, r5
	it ne
	movne.w r10, r9
	str.w r8, [sp, #76]
	ldr.w r8, [sp, #92]
	cmp.w r8, #0
	mov.w r7, r5
	it ne
	movne.w r7, r9
	ldr.w r11, [sp, #36]
	cmp.w r11, #0
	mov.w r9, r7
	it ne
	movne.w r9, r10
	ldr.w r10, [sp, #0]
	cmp.w r10, #0
	mov.w r7, r5
	it ne
	movne.w r7, r9
	str.w r9, [sp, #32]
	ldr.w r9, [sp, #48]
	cmp.w r9, #0
	mov.w r8, r7
	it ne
	movne.w r8, r4
	ldr.w r7, [sp, #8]
	cmp.w r7, #0
	mov.w r4, r8
	it ne
	movne.w r4, r6
	vmov s6, r4
	vcvt.f32.s32 s6, s6
	vmul.f32 s2, s2, s6
	vldr s6, [ip, #12]
	vmul.f32 s6, s6, s3
	vldr s8, [ip, #12]
	vldr s9, [ip, #52]
	vldr s11, [r0, #12]
	vadd.f32 s11, s3, s11
	cmp.w r10, #0
	vmov.f32 s12, s11
	it ne
	vmovne.f32 s12, s3
	vabs.f32 s11, s12
	vsub.f32 s9, s9, s11
	vldr s13, [ip, #56]
	vadd.f32 s9, s9, s13
	vneg.f32 s13, s9
	vldr s14, [ip, #0]
	vcmp.f32 s12, s14
	vmrs APSR_nzcv, fpscr
	vmov.f32 s14, s9
	it mi
	vmovmi.f32 s14, s13
	vldr s9, [ip, #48]
	vcmp.f32 s11, s9
	vmrs APSR_nzcv, fpscr
	vmov.f32 s9, s12
	it gt
	vmovgt.f32 s9, s14
	vmul.f32 s8, s8, s9
	vmul.f32 s9, s9, s9
	vldr s11, [ip, #76]
	vmul.f32 s11, s11, s9
	vldr s12, [ip, #80]
	vadd.f32 s11, s11, s12
	vmul.f32 s11, s11, s9
	vldr s12, [ip, #84]
	vadd.f32 s11, s11, s12
	vmul.f32 s11, s11, s9
	vldr s12, [ip, #88]
	vadd.f32 s11, s11, s12
	vmul.f32 s9, s9, s11
	vmul.f32 s9, s8, s9
	vadd.f32 s8, s8, s9
	vsub.f32 s6, s6, s8
	vadd.f32 s2, s2, s6
	vmul.f32 s1, s1, s2
	vstr s1, [r0, #8]
	vldr s1, [ip, #92]
	vmul.f32 s1, s1, s3
	vstr s1, [r0, #28]
	ldr.w r4, [ip, #0]
	ldr.w r6, [r0, #80]
	cmp.w r9, #0
	mov.w r8, r6
	it ne
	movne.w r8, r4
	ldr.w r10, [sp, #52]
	ldr.w r11, [ip, #44]
	sdiv r10, r10, r11
	add.w r8, r8, r10
	ldr.w r10, [sp, #64]
	ldr.w r11, [ip, #44]
	sdiv r10, r10, r11
	add.w r4, r4, r10
	cmp.w r9, #0
	mov.w r10, r4
	it ne
	movne.w r10, r8
	ldr.w r11, [sp, #44]
	str.w r5, [sp, #0]
	ldr.w r5, [ip, #44]
	sdiv r11, r11, r5
	add.w r5, r6, r11
	cmp.w r9, #0
	mov.w r6, r8
	it ne
	movne.w r6, r5
	ldr.w r7, [sp, #92]
	cmp.w r7, #0
	mov.w r11, r6
	it ne
	movne.w r11, r10
	cmp.w r7, #0
	mov.w r6, r5
	it ne
	movne.w r6, r8
	ldr.w r10, [sp, #72]
	cmp.w r10, #0
	mov.w r5, r8
	it ne
	movne.w r5, r4
	cmp.w r7, #0
	mov.w r10, r8
	it ne
	movne.w r10, r4
	ldr.w r8, [sp, #36]
	cmp.w r8, #0
	mov.w r4, r10
	it ne
	movne.w r4, r5
	cmp.w r9, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	ldr.w r6, [sp, #8]
	cmp.w r6, #0
	mov.w r4, r5
	it ne
	movne.w r4, r11
	str.w r4, [r0, #80]
	ldr.w r4, [sp, #56]
	ldr.w r5, [sp, #68]
	cmp.w r7, #0
	mov.w r10, r5
	it ne
	movne.w r10, r4
	ldr.w r4, [sp, #0]
	ldr.w r5, [sp, #76]
	cmp.w r7, #0
	mov.w r11, r5
	it ne
	movne.w r11, r4
	ldr.w r4, [sp, #32]
	cmp.w r9, #0
	mov.w r5, r4
	it ne
	movne.w r5, r11
	cmp.w r6, #0
	mov.w r4, r5
	it ne
	movne.w r4, r10
	str.w r4, [r0, #76]
	vldr s1, [ip, #0]
	vldr s2, [r0, #48]
	ldr.w r4, [sp, #40]
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s1
	ldr.w r5, [sp, #84]
	ldr.w r10, [sp, #88]
	cmp.w r7, #0
	mov.w r11, r10
	it ne
	movne.w r11, r5
	ldr.w r5, [sp, #60]
	ldr.w r10, [sp, #80]
	cmp.w r7, #0
	mov.w r8, r10
	it ne
	movne.w r8, r5
	ldr.w r5, [sp, #104]
	cmp.w r9, #0
	mov.w r7, r5
	it ne
	movne.w r7, r8
	cmp.w r6, #0
	mov.w r5, r7
	it ne
	movne.w r5, r11
	str.w r5, [r0, #72]
	vstr s2, [r0, #48]
	vldr s1, [ip, #4]
	vldr s2, [ip, #0]
	vldr s3, [ip, #0]
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s0
	it mi
	vmovmi.f32 s3, s2
	ldr.w r5, [sp, #16]
	vldr s2, [ip, #4]
	vcmp.f32 s0, s2
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r7, #1
	movle.w r7, #0
	orr.w r5, r5, r7
	ldr.w r7, [sp, #100]
	orr.w r5, r5, r7
	ldr.w r7, [sp, #28]
	orr.w r5, r5, r7
	orr.w r5, r5, r9
	orr.w r5, r5, r6
	cmp.w r5, #0
	vmov.f32 s0, s3
	it ne
	vmovne.f32 s0, s1
	vstr s0, [r0, #52]
	vldr s0, [ip, #0]
	ldr.w r5, [sp, #4]
	cmp.w r5, #0
	vmov.f32 s1, s10
	it ne
	vmovne.f32 s1, s5
	cmp.w r9, #0
	vmov.f32 s2, s1
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #36]
	vldr s0, [ip, #0]
	ldr.w r5, [sp, #36]
	cmp.w r5, #0
	vmov.f32 s1, s7
	it ne
	vmovne.f32 s1, s4
	cmp.w r6, #0
	vmov.f32 s2, s1
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #16]
	ldr.w r5, [sp, #24]
	ldr.w r6, [sp, #20]
	cmp.w r9, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #68]
	ldr.w r5, [sp, #12]
	str.w r5, [r0, #64]
	vldr s0, [ip, #0]
	vstr s0, [r0, #0]
	vldr s0, [ip, #0]
	vstr s0, [r0, #4]
	vldr s0, [ip, #0]
	vstr s0, [r0, #96]
	vldr s0, [ip, #0]
	vstr s0, [r0, #92]
	vldr s0, [ip, #0]
	vstr s0, [r0, #88]
	vldr s0, [ip, #0]
	vstr s0, [r0, #84]
	vldr s0, [ip, #0]
	vstr s0, [r0, #44]
	vldr s0, [ip, #0]
	vstr s0, [r0, #32]
	vldr s0, [ip, #0]
	vstr s0, [r0, #24]
	vldr s0, [ip, #0]
	vstr s0, [r0, #12]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	add.w sp, sp, #112
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_begin_1:
	vldr s0, [ip, #40]
	vldr s1, [ip, #12]
	vldr s2, [ip, #24]
	ldr.w r5, [r0, #64]
	ldr.w r6, [r1, #0]
	ldrb.w r8, [r1, #8]
	cmp.w r8, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	ldr.w r9, [r1, #4]
	ldr.w r10, [r0, #68]
	sub.w r11, r9, r10
	str.w r4, [sp, #0]
	str.w r5, [sp, #4]
	ldrb.w r5, [r1, #9]
	cmp.w r5, #0
	mov.w r4, r11
	it ne
	movne.w r4, r7
	sbfx r4, r4, #0, #20
	str.w r6, [sp, #8]
	ldr.w r6, [r0, #72]
	str.w r7, [sp, #12]
	ldr.w r7, [sp, #8]
	str.w r8, [sp, #16]
	ldr.w r8, [sp, #4]
	sub.w r7, r7, r8
	sbfx r7, r7, #0, #20
	add.w r8, r6, r7
	str.w r9, [sp, #4]
	str.w r10, [sp, #8]
	ldr.w r10, [sp, #16]
	cmp.w r10, #0
	mov.w r9, r8
	it ne
	movne.w r9, r6
	cmp.w r5, #0
	mov.w r6, r9
	it ne
	movne.w r6, r4
	str.w r11, [sp, #20]
	ldr.w r11, [ip, #44]
	sdiv r8, r6, r11
	ldr.w r11, [ip, #44]
	mul r8, r8, r11
	sub.w r11, r6, r8
	sbfx r11, r11, #0, #23
	str.w r4, [sp, #24]
	ldr.w r4, [sp, #12]
	str.w r7, [sp, #28]
	sbfx r7, r4, #0, #20
	str.w r9, [sp, #32]
	ldr.w r10, [ip, #44]
	sdiv r9, r7, r10
	ldr.w r10, [ip, #44]
	mul r9, r9, r10
	sub.w r7, r7, r9
	sbfx r7, r7, #0, #23
	cmp.w r5, #0
	mov.w r9, r7
	it ne
	movne.w r9, r11
	ldr.w r10, [sp, #32]
	str.w r6, [sp, #36]
	str.w r8, [sp, #40]
	ldr.w r8, [ip, #44]
	sdiv r6, r10, r8
	ldr.w r8, [ip, #44]
	mul r6, r6, r8
	sub.w r8, r10, r6
	sbfx r8, r8, #0, #23
	cmp.w r5, #0
	mov.w r4, r11
	it ne
	movne.w r4, r8
	str.w r7, [sp, #44]
	ldr.w r10, [sp, #0]
	vldr s3, [r0, #48]
	vldr s4, [ip, #0]
	str.w r6, [sp, #48]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r6, #1
	movle.w r6, #0
	str.w r8, [sp, #52]
	and.w r8, r10, r6
	cmp.w r8, #0
	mov.w r7, r4
	it ne
	movne.w r7, r9
	ldr.w r9, [sp, #52]
	str.w r4, [sp, #56]
	cmp.w r8, #0
	mov.w r4, r9
	it ne
	movne.w r4, r11
	ldr.w r8, [sp, #44]
	vldr s3, [ip, #32]
	str.w r5, [sp, #52]
	ldr.w r5, [sp, #24]
	vmov s4, r5
	vcvt.f32.s32 s4, s4
	vmul.f32 s3, s3, s4
	vldr s4, [ip, #16]
	vldr s5, [r0, #36]
	vmul.f32 s4, s4, s5
	vsub.f32 s3, s3, s4
	vabs.f32 s3, s3
	vldr s4, [ip, #36]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	eor.w r5, r5, #1
	and.w r5, r5, r6
	cmp.w r5, #0
	mov.w r9, r11
	it ne
	movne.w r9, r8
	cmp.w r6, #0
	mov.w r5, r11
	it ne
	movne.w r5, r8
	vldr s3, [ip, #24]
	ldr.w r8, [sp, #28]
	vmov s4, r8
	vcvt.f32.s32 s4, s4
	vmul.f32 s3, s3, s4
	vldr s4, [ip, #16]
	vldr s5, [r0, #16]
	vmul.f32 s4, s4, s5
	vsub.f32 s3, s3, s4
	vabs.f32 s3, s3
	vldr s4, [ip, #28]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	mov.w r6, r5
	it ls
	movls.w r6, r9
	cmp.w r10, #0
	mov.w r5, r11
	it ne
	movne.w r5, r6
	ldr.w r8, [sp, #52]
	cmp.w r8, #0
	mov.w r6, r5
	it ne
	movne.w r6, r4
	ldr.w r5, [sp, #16]
	cmp.w r5, #0
	mov.w r4, r6
	it ne
	movne.w r4, r7
	vmov s3, r4
	vcvt.f32.s32 s3, s3
	vmul.f32 s2, s2, s3
	vldr s3, [r0, #12]
	vadd.f32 s3, s2, s3
	cmp.w r10, #0
	vmov.f32 s4, s3
	it ne
	vmovne.f32 s4, s2
	vabs.f32 s2, s4
	vldr s3, [ip, #48]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vldr s0, [ip, #52]
	vsub.f32 s0, s0, s2
	vldr s2, [ip, #56]
	vadd.f32 s0, s0, s2
	vneg.f32 s2, s0
	vldr s3, [ip, #0]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s0
	it mi
	vmovmi.f32 s3, s2
	cmp.w r4, #0
	vmov.f32 s0, s4
	it ne
	vmovne.f32 s0, s3
	vmul.f32 s2, s0, s0
	vldr s3, [ip, #60]
	vmul.f32 s3, s3, s2
	vldr s4, [ip, #64]
	vadd.f32 s3, s3, s4
	vmul.f32 s3, s3, s2
	vldr s4, [ip, #68]
	vadd.f32 s3, s3, s4
	vmul.f32 s3, s3, s2
	vldr s4, [ip, #72]
	vadd.f32 s3, s3, s4
	vmul.f32 s3, s2, s3
	vmul.f32 s3, s1, s3
	vadd.f32 s1, s1, s3
	vstr s1, [r2, #8]
	vldr s1, [ip, #12]
	vmul.f32 s0, s1, s0
	vldr s1, [ip, #76]
	vmul.f32 s1, s1, s2
	vldr s3, [ip, #80]
	vadd.f32 s1, s1, s3
	vmul.f32 s1, s1, s2
	vldr s3, [ip, #84]
	vadd.f32 s1, s1, s3
	vmul.f32 s1, s1, s2
	vldr s3, [ip, #88]
	vadd.f32 s1, s1, s3
	vmul.f32 s1, s2, s1
	vmul.f32 s1, s0, s1
	vadd.f32 s0, s0, s1
	vstr s0, [r2, #4]
	mov.w r4, #0
	strb.w r4, [r0, #100]
	strb.w r4, [r2, #0]
	strb.w r4, [r2, #16]
	strb.w r4, [r2, #12]
	ldr.w r4, [r0, #80]
	ldr.w r5, [sp, #32]
	ldr.w r6, [ip, #44]
	sdiv r5, r5, r6
	add.w r5, r4, r5
	ldr.w r6, [ip, #0]
	cmp.w r8, #0
	mov.w r7, r4
	it ne
	movne.w r7, r6
	ldr.w r4, [sp, #36]
	ldr.w r6, [ip, #44]
	sdiv r4, r4, r6
	add.w r4, r7, r4
	cmp.w r8, #0
	mov.w r6, r4
	it ne
	movne.w r6, r5
	str.w r6, [r0, #80]
	ldr.w r4, [r0, #76]
	ldr.w r5, [sp, #48]
	sub.w r5, r4, r5
	sbfx r5, r5, #0, #23
	ldr.w r6, [sp, #8]
	ldr.w r7, [sp, #20]
	cmp.w r8, #0
	mov.w r9, r7
	it ne
	movne.w r9, r6
	sbfx r7, r9, #0, #20
	add.w r4, r4, r7
	cmp.w r8, #0
	mov.w r9, r4
	it ne
	movne.w r9, r7
	ldr.w r4, [sp, #40]
	sub.w r4, r9, r4
	sbfx r4, r4, #0, #23
	cmp.w r8, #0
	mov.w r7, r4
	it ne
	movne.w r7, r5
	str.w r7, [r0, #76]
	ldr.w r4, [sp, #56]
	str.w r4, [r0, #72]
	ldr.w r4, [sp, #4]
	cmp.w r8, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	str.w r5, [r0, #68]
	ldr.w r4, [sp, #12]
	str.w r4, [r0, #64]
	mov.w r0, #1
	add.w sp, sp, #112
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_begin_table:
	.word 0x00000000 @ 0.0
	.word 0x41200000 @ 10.0
	.word 0x40a00000 @ 5.0
	.word 0x3f800000 @ 1.0
	.word 0x3a83126f @ 0.001
	.word 0x3f000000 @ 0.5
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x37ff312a @ 3.0421263e-5
	.word 0x3975dd20 @ 0.00023447396
	.word 0x3cc1b5f1 @ 0.023646327
	.word 0xbf800000 @ -1.0
	.word 0x00100000 @ 1.469368e-39
	.word 0x3fc90fdb @ 1.5707964
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.word 0x37c28d4e @ 2.3192402e-5
	.word 0xbab59c80 @ -0.0013855845
	.word 0x3d2aa7d9 @ 0.04166398
	.word 0xbeffffe9 @ -0.4999993
	.word 0x362e7949 @ 2.5998618e-6
	.word 0xb94fafbf @ -0.00019806529
	.word 0x3c088734 @ 0.008333016
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x4838b45c @ 189137.44
	.size joint_drive_begin, .-joint_drive_begin

	.section .text.joint_drive_observe, "ax", %progbits
	.balign 8
	.global joint_drive_observe
	.type joint_drive_observe, %function
	.thumb_func
joint_drive_observe:
	push.w {r4-r11}
	vpush {s16-s29}
	sub.w sp, sp, #80
	movw ip, #:lower16:.Ljoint_drive_observe_table
	movt ip, #:upper16:.Ljoint_drive_observe_table
	vldr s0, [r0, #88]
	vabs.f32 s0, s0
	vldr s1, [ip, #0]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s1, [ip, #8]
	vldr s2, [r0, #88]
	vmul.f32 s1, s1, s2
	vldr s2, [ip, #12]
	vadd.f32 s2, s1, s2
	vldr s3, [ip, #12]
	vsub.f32 s1, s1, s3
	vabs.f32 s1, s1
	vsub.f32 s1, s2, s1
	vldr s2, [r0, #32]
	vldr s3, [ip, #16]
	vldr s4, [r0, #36]
	vmul.f32 s3, s3, s4
	vldr s4, [ip, #20]
	vldr s5, [r0, #28]
	vldr s6, [r0, #28]
	vadd.f32 s5, s5, s6
	vldr s6, [r0, #40]
	vadd.f32 s5, s5, s6
	vldr s6, [ip, #24]
	vldr s7, [ip, #28]
	ldr.w r5, [r0, #76]
	vmov s8, r5
	vcvt.f32.s32 s8, s8
	vmul.f32 s7, s7, s8
	vldr s8, [r0, #32]
	vadd.f32 s7, s7, s8
	vmul.f32 s6, s6, s7
	vsub.f32 s6, s5, s6
	vldr s7, [ip, #32]
	vldr s8, [r0, #0]
	vmul.f32 s7, s7, s8
	vadd.f32 s6, s6, s7
	vmul.f32 s4, s4, s6
	vadd.f32 s4, s3, s4
	vadd.f32 s2, s2, s4
	vldr s4, [ip, #36]
	vldr s8, [r0, #44]
	vmul.f32 s4, s4, s8
	vadd.f32 s2, s2, s4
	vldr s8, [ip, #28]
	ldr.w r6, [r1, #4]
	ldr.w r7, [r0, #68]
	sub.w r8, r6, r7
	sbfx r8, r8, #0, #20
	vmov s9, r8
	vcvt.f32.s32 s9, s9
	vmul.f32 s8, s8, s9
	vsub.f32 s9, s2, s8
	vldr s10, [r0, #96]
	vsub.f32 s10, s9, s10
	vabs.f32 s10, s10
	vadd.f32 s10, s10, s10
	vsub.f32 s1, s1, s10
	vldr s10, [ip, #12]
	vldr s11, [r0, #88]
	vldr s12, [ip, #0]
	vadd.f32 s11, s11, s12
	vmul.f32 s11, s11, s11
	vmul.f32 s10, s10, s11
	vabs.f32 s11, s9
	vsub.f32 s10, s10, s11
	vadd.f32 s12, s1, s10
	vsub.f32 s1, s1, s10
	vabs.f32 s1, s1
	vsub.f32 s1, s12, s1
	vldr s10, [ip, #40]
	vldr s12, [r0, #52]
	vldr s13, [ip, #44]
	vldr s14, [r0, #12]
	vldr s15, [ip, #48]
	vldr s16, [r0, #16]
	vmul.f32 s15, s15, s16
	vldr s16, [ip, #52]
	vldr s17, [r0, #8]
	vldr s18, [r0, #8]
	vadd.f32 s17, s17, s18
	vldr s18, [r0, #20]
	vadd.f32 s17, s17, s18
	vldr s18, [ip, #56]
	vldr s19, [ip, #60]
	ldr.w r9, [r0, #72]
	vmov s20, r9
	vcvt.f32.s32 s20, s20
	vmul.f32 s19, s19, s20
	vldr s20, [r0, #12]
	vadd.f32 s19, s19, s20
	vmul.f32 s18, s18, s19
	vsub.f32 s18, s17, s18
	vmul.f32 s16, s16, s18
	vadd.f32 s16, s15, s16
	vadd.f32 s14, s14, s16
	vldr s16, [ip, #64]
	vldr s19, [r0, #24]
	vmul.f32 s16, s16, s19
	vadd.f32 s14, s14, s16
	vldr s19, [ip, #60]
	ldr.w r10, [r1, #0]
	ldr.w r11, [r0, #64]
	str.w r5, [sp, #0]
	sub.w r5, r10, r11
	sbfx r5, r5, #0, #20
	vmov s20, r5
	vcvt.f32.s32 s20, s20
	vmul.f32 s19, s19, s20
	vsub.f32 s20, s14, s19
	vabs.f32 s21, s20
	vmul.f32 s13, s13, s21
	vldr s22, [ip, #0]
	vadd.f32 s13, s13, s22
	vadd.f32 s12, s12, s13
	vldr s13, [r0, #52]
	vldr s22, [ip, #68]
	vldr s23, [r0, #48]
	vadd.f32 s22, s22, s23
	str.w r6, [sp, #4]
	vcmp.f32 s21, s22
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r6, #1
	movhi.w r6, #0
	str.w r7, [sp, #8]
	eor.w r7, r6, #1
	vldr s22, [ip, #72]
	vldr s23, [r0, #84]
	vmul.f32 s22, s22, s23
	vldr s23, [ip, #68]
	vadd.f32 s23, s22, s23
	vldr s24, [ip, #68]
	vsub.f32 s22, s22, s24
	vabs.f32 s22, s22
	vsub.f32 s22, s23, s22
	vldr s23, [r0, #92]
	vsub.f32 s23, s20, s23
	vabs.f32 s23, s23
	vadd.f32 s23, s23, s23
	vsub.f32 s22, s22, s23
	vldr s23, [ip, #68]
	vldr s24, [r0, #84]
	vldr s25, [ip, #0]
	vadd.f32 s24, s24, s25
	vmul.f32 s24, s24, s24
	vmul.f32 s23, s23, s24
	vsub.f32 s21, s23, s21
	vadd.f32 s23, s22, s21
	vsub.f32 s21, s22, s21
	vabs.f32 s21, s21
	vsub.f32 s21, s23, s21
	vldr s22, [ip, #40]
	vsub.f32 s22, s22, s12
	vldr s23, [ip, #0]
	vldr s24, [r0, #84]
	vldr s25, [ip, #76]
	vsub.f32 s24, s24, s25
	vldr s25, [ip, #80]
	vldr s26, [r0, #16]
	vabs.f32 s26, s26
	vmul.f32 s25, s25, s26
	vldr s26, [ip, #84]
	vcmp.f32 s25, s26
	vmrs APSR_nzcv, fpscr
	vmov.f32 s25, s24
	it gt
	vmovgt.f32 s25, s23
	vadd.f32 s23, s22, s25
	vsub.f32 s22, s22, s25
	vabs.f32 s22, s22
	vsub.f32 s22, s23, s22
	vadd.f32 s23, s21, s22
	vsub.f32 s21, s21, s22
	vabs.f32 s21, s21
	vsub.f32 s21, s23, s21
	vldr s22, [ip, #88]
	str.w r8, [sp, #12]
	vcmp.f32 s21, s22
	vmrs APSR_nzcv, fpscr
	ite ge
	movge.w r8, #1
	movlt.w r8, #0
	and.w r7, r7, r8
	str.w r9, [sp, #16]
	ldrb.w r9, [r1, #8]
	str.w r10, [sp, #20]
	eor.w r10, r9, #1
	str.w r11, [sp, #24]
	and.w r11, r7, r10
	cmp.w r11, #0
	it ne
	vmovne.f32 s13, s12
	vldr s12, [ip, #92]
	vmul.f32 s12, s12, s11
	vldr s21, [ip, #0]
	vadd.f32 s12, s12, s21
	vadd.f32 s12, s13, s12
	vsub.f32 s10, s10, s12
	vldr s21, [ip, #0]
	vldr s22, [r0, #88]
	vldr s23, [ip, #76]
	vsub.f32 s22, s22, s23
	vldr s23, [ip, #80]
	vldr s24, [r0, #36]
	vabs.f32 s24, s24
	vmul.f32 s23, s23, s24
	vldr s24, [ip, #96]
	vcmp.f32 s23, s24
	vmrs APSR_nzcv, fpscr
	vmov.f32 s23, s22
	it gt
	vmovgt.f32 s23, s21
	vadd.f32 s21, s10, s23
	vsub.f32 s10, s10, s23
	vabs.f32 s10, s10
	vsub.f32 s10, s21, s10
	vadd.f32 s21, s1, s10
	vsub.f32 s1, s1, s10
	vabs.f32 s1, s1
	vsub.f32 s1, s21, s1
	vldr s10, [ip, #88]
	vcmp.f32 s1, s10
	vmrs APSR_nzcv, fpscr
	ite ge
	movge.w r11, #1
	movlt.w r11, #0
	str.w r5, [sp, #28]
	orr.w r5, r11, r4
	vldr s1, [ip, #12]
	vldr s10, [r0, #48]
	vadd.f32 s1, s1, s10
	str.w r6, [sp, #32]
	vcmp.f32 s11, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r6, #1
	movhi.w r6, #0
	orr.w r5, r5, r6
	str.w r8, [sp, #36]
	str.w r7, [sp, #40]
	ldrb.w r7, [r1, #9]
	cmp.w r7, #0
	mov.w r8, r5
	it ne
	movne.w r8, r4
	vldr s1, [r0, #84]
	vabs.f32 s1, s1
	vldr s10, [ip, #0]
	vadd.f32 s1, s1, s10
	vldr s10, [ip, #4]
	str.w r9, [sp, #44]
	vcmp.f32 s1, s10
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r9, #1
	movhi.w r9, #0
	and.w r4, r9, r4
	and.w r5, r5, r9
	cmp.w r7, #0
	mov.w r9, r5
	it ne
	movne.w r9, r4
	ldr.w r5, [sp, #32]
	str.w r10, [sp, #48]
	ldr.w r10, [sp, #36]
	str.w r11, [sp, #52]
	orr.w r11, r5, r10
	str.w r6, [sp, #56]
	ldr.w r6, [sp, #48]
	str.w r7, [sp, #60]
	and.w r7, r11, r6
	cmp.w r7, #0
	mov.w r4, r9
	it ne
	movne.w r4, r8
	ldr.w r8, [sp, #56]
	eor.w r9, r8, #1
	str.w r4, [sp, #64]
	ldr.w r4, [sp, #52]
	and.w r5, r9, r4
	ldr.w r10, [sp, #60]
	str.w r11, [sp, #68]
	eor.w r11, r10, #1
	and.w r6, r5, r11
	str.w r7, [sp, #72]
	ldr.w r7, [sp, #40]
	ldr.w r8, [sp, #36]
	str.w r9, [sp, #76]
	orr.w r9, r5, r8
	ldr.w r10, [sp, #32]
	cmp.w r10, #0
	mov.w r4, r9
	it ne
	movne.w r4, r5
	ldr.w r9, [sp, #60]
	cmp.w r9, #0
	mov.w r5, r4
	it ne
	movne.w r5, r7
	ldr.w r7, [sp, #44]
	cmp.w r7, #0
	mov.w r4, r5
	it ne
	movne.w r4, r6
	strb.w r4, [r2, #16]
	ldr.w r4, [sp, #76]
	ldr.w r5, [sp, #52]
	str.w r11, [sp, #40]
	eor.w r11, r5, #1
	and.w r4, r4, r11
	eor.w r11, r8, #1
	orr.w r11, r4, r11
	str.w r6, [sp, #76]
	cmp.w r10, #0
	mov.w r6, r11
	it ne
	movne.w r6, r4
	orr.w r4, r9, r6
	orr.w r4, r4, r7
	strb.w r4, [r2, #12]
	vldr s10, [ip, #100]
	vldr s11, [ip, #0]
	vldr s21, [ip, #60]
	ldr.w r4, [sp, #16]
	ldr.w r6, [sp, #28]
	add.w r6, r4, r6
	ldr.w r9, [sp, #72]
	cmp.w r9, #0
	mov.w r11, r4
	it ne
	movne.w r11, r6
	vmov s22, r11
	vcvt.f32.s32 s22, s22
	vmul.f32 s21, s21, s22
	vldr s22, [ip, #88]
	vldr s23, [r0, #12]
	vadd.f32 s23, s23, s15
	cmp.w r9, #0
	vmov.f32 s24, s23
	it ne
	vmovne.f32 s24, s22
	vadd.f32 s22, s21, s24
	vabs.f32 s23, s22
	vldr s25, [ip, #104]
	vcmp.f32 s23, s25
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	cmp.w r4, #0
	it ne
	vmovne.f32 s11, s10
	vldr s10, [ip, #108]
	vsub.f32 s10, s10, s23
	vldr s23, [ip, #112]
	vadd.f32 s10, s10, s23
	vneg.f32 s23, s10
	vldr s25, [ip, #88]
	vcmp.f32 s22, s25
	vmrs APSR_nzcv, fpscr
	vmov.f32 s25, s10
	it mi
	vmovmi.f32 s25, s23
	cmp.w r4, #0
	vmov.f32 s10, s22
	it ne
	vmovne.f32 s10, s25
	vmul.f32 s23, s10, s10
	vldr s25, [ip, #116]
	vmul.f32 s25, s25, s23
	vldr s26, [ip, #120]
	vadd.f32 s25, s25, s26
	vmul.f32 s25, s25, s23
	vldr s26, [ip, #124]
	vadd.f32 s25, s25, s26
	vmul.f32 s25, s25, s23
	vldr s26, [ip, #128]
	vadd.f32 s25, s25, s26
	vmul.f32 s25, s23, s25
	vmul.f32 s25, s11, s25
	vadd.f32 s11, s11, s25
	vldr s25, [ip, #88]
	vldr s26, [r0, #12]
	vldr s27, [ip, #52]
	vldr s28, [ip, #56]
	vldr s29, [r0, #12]
	vadd.f32 s21, s21, s29
	vmul.f32 s21, s28, s21
	vsub.f32 s17, s17, s21
	vmul.f32 s21, s27, s17
	vadd.f32 s15, s15, s21
	vadd.f32 s15, s26, s15
	vadd.f32 s15, s15, s16
	cmp.w r8, #0
	vmov.f32 s16, s15
	it ne
	vmovne.f32 s16, s25
	cmp.w r10, #0
	vmov.f32 s21, s16
	it ne
	vmovne.f32 s21, s20
	cmp.w r7, #0
	vmov.f32 s16, s21
	it ne
	vmovne.f32 s16, s14
	vldr s14, [ip, #52]
	vldr s20, [ip, #132]
	vldr s21, [ip, #28]
	ldr.w r4, [sp, #0]
	ldr.w r6, [sp, #12]
	add.w r6, r4, r6
	ldr.w r5, [sp, #56]
	str.w r11, [sp, #12]
	ldr.w r11, [sp, #52]
	orr.w r9, r5, r11
	ldr.w r10, [sp, #40]
	and.w r7, r9, r10
	cmp.w r7, #0
	mov.w r8, r4
	it ne
	movne.w r8, r6
	vmov s25, r8
	vcvt.f32.s32 s25, s25
	vmul.f32 s21, s21, s25
	vldr s25, [ip, #88]
	vldr s26, [r0, #32]
	vadd.f32 s26, s26, s3
	cmp.w r7, #0
	vmov.f32 s27, s26
	it ne
	vmovne.f32 s27, s25
	vadd.f32 s25, s21, s27
	vldr s26, [ip, #0]
	vmul.f32 s26, s26, s22
	vldr s27, [ip, #0]
	vmul.f32 s10, s27, s10
	vldr s27, [ip, #136]
	vmul.f32 s27, s27, s23
	vldr s28, [ip, #140]
	vadd.f32 s27, s27, s28
	vmul.f32 s27, s27, s23
	vldr s28, [ip, #144]
	vadd.f32 s27, s27, s28
	vmul.f32 s27, s27, s23
	vldr s28, [ip, #148]
	vadd.f32 s27, s27, s28
	vmul.f32 s23, s23, s27
	vmul.f32 s23, s10, s23
	vadd.f32 s10, s10, s23
	vsub.f32 s23, s26, s10
	vadd.f32 s23, s25, s23
	vmul.f32 s20, s20, s23
	vldr s23, [r0, #8]
	vsub.f32 s23, s20, s23
	vmul.f32 s14, s14, s23
	vadd.f32 s14, s16, s14
	vldr s16, [ip, #152]
	vmul.f32 s16, s16, s14
	vsub.f32 s16, s14, s16
	ldr.w r4, [sp, #48]
	ldr.w r6, [sp, #32]
	and.w r4, r4, r6
	cmp.w r4, #0
	vmov.f32 s25, s14
	it ne
	vmovne.f32 s25, s16
	vsub.f32 s16, s25, s24
	vmul.f32 s24, s16, s10
	vsub.f32 s26, s11, s24
	vstr s26, [r2, #8]
	vldr s26, [ip, #132]
	vmul.f32 s24, s26, s24
	vsub.f32 s11, s11, s24
	vmul.f32 s11, s16, s11
	vadd.f32 s10, s10, s11
	vstr s10, [r2, #4]
	mov.w r6, #0
	strb.w r6, [r2, #0]
	ldr.w r6, [sp, #76]
	cmp.w r6, #0
	vmov.f32 s10, s13
	it ne
	vmovne.f32 s10, s12
	vldr s11, [ip, #156]
	vmul.f32 s10, s10, s11
	vldr s11, [ip, #160]
	vldr s12, [r0, #96]
	vldr s13, [r0, #32]
	vldr s16, [ip, #20]
	vldr s24, [ip, #24]
	vldr s26, [r0, #32]
	vadd.f32 s21, s21, s26
	vmul.f32 s21, s24, s21
	vsub.f32 s5, s5, s21
	vadd.f32 s5, s5, s7
	vmul.f32 s7, s16, s5
	vadd.f32 s3, s3, s7
	vadd.f32 s3, s13, s3
	vadd.f32 s3, s3, s4
	vsub.f32 s4, s3, s8
	cmp.w r9, #0
	vmov.f32 s7, s4
	it ne
	vmovne.f32 s7, s12
	ldr.w r6, [sp, #60]
	cmp.w r6, #0
	vmov.f32 s4, s7
	it ne
	vmovne.f32 s4, s11
	vldr s7, [ip, #88]
	cmp.w r7, #0
	vmov.f32 s8, s0
	it ne
	vmovne.f32 s8, s7
	vldr s0, [r0, #44]
	vldr s7, [ip, #164]
	vldr s11, [ip, #88]
	cmp.w r11, #0
	vmov.f32 s12, s3
	it ne
	vmovne.f32 s12, s11
	cmp.w r5, #0
	vmov.f32 s3, s12
	it ne
	vmovne.f32 s3, s9
	cmp.w r6, #0
	vmov.f32 s9, s3
	it ne
	vmovne.f32 s9, s2
	vldr s2, [ip, #20]
	vldr s3, [ip, #168]
	vmul.f32 s3, s3, s22
	vldr s11, [r0, #28]
	vsub.f32 s11, s3, s11
	vmul.f32 s2, s2, s11
	vadd.f32 s2, s9, s2
	vmul.f32 s7, s7, s2
	vsub.f32 s0, s0, s7
	vldr s7, [r0, #44]
	and.w r5, r10, r5
	cmp.w r5, #0
	it ne
	vmovne.f32 s7, s0
	vldr s0, [r0, #40]
	vldr s9, [ip, #80]
	vldr s12, [r0, #44]
	vmul.f32 s9, s9, s12
	vadd.f32 s0, s0, s9
	vldr s9, [ip, #172]
	vmul.f32 s9, s9, s2
	vsub.f32 s9, s0, s9
	cmp.w r5, #0
	vmov.f32 s12, s0
	it ne
	vmovne.f32 s12, s9
	vldr s0, [ip, #176]
	vldr s9, [r0, #36]
	vmul.f32 s0, s0, s9
	vldr s9, [ip, #16]
	orr.w r6, r9, r6
	cmp.w r6, #0
	vmov.f32 s13, s5
	it ne
	vmovne.f32 s13, s6
	vadd.f32 s5, s13, s11
	vmul.f32 s5, s9, s5
	vadd.f32 s0, s0, s5
	vldr s5, [ip, #20]
	vldr s6, [r0, #44]
	vmul.f32 s5, s5, s6
	vadd.f32 s0, s0, s5
	vldr s5, [ip, #180]
	vmul.f32 s5, s5, s2
	vsub.f32 s5, s0, s5
	cmp.w r5, #0
	vmov.f32 s6, s0
	it ne
	vmovne.f32 s6, s5
	vldr s0, [ip, #184]
	vmul.f32 s0, s0, s2
	vsub.f32 s0, s2, s0
	cmp.w r5, #0
	vmov.f32 s5, s2
	it ne
	vmovne.f32 s5, s0
	vldr s0, [r0, #24]
	vldr s2, [ip, #188]
	vmul.f32 s2, s2, s14
	vsub.f32 s0, s0, s2
	vldr s2, [r0, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s0
	vldr s0, [r0, #20]
	vldr s9, [ip, #80]
	vldr s11, [r0, #24]
	vmul.f32 s9, s9, s11
	vadd.f32 s0, s0, s9
	vldr s9, [ip, #192]
	vmul.f32 s9, s9, s14
	vsub.f32 s9, s0, s9
	cmp.w r4, #0
	vmov.f32 s11, s0
	it ne
	vmovne.f32 s11, s9
	vldr s0, [ip, #196]
	vldr s9, [r0, #16]
	vmul.f32 s0, s0, s9
	vldr s9, [ip, #48]
	ldr.w r5, [sp, #68]
	ldr.w r6, [sp, #44]
	orr.w r9, r5, r6
	cmp.w r9, #0
	vmov.f32 s13, s17
	it ne
	vmovne.f32 s13, s18
	vadd.f32 s13, s13, s23
	vmul.f32 s9, s9, s13
	vadd.f32 s0, s0, s9
	vldr s9, [ip, #52]
	vldr s13, [r0, #24]
	vmul.f32 s9, s9, s13
	vadd.f32 s0, s0, s9
	vldr s9, [ip, #200]
	vmul.f32 s9, s9, s14
	vsub.f32 s9, s0, s9
	cmp.w r4, #0
	vmov.f32 s13, s0
	it ne
	vmovne.f32 s13, s9
	ldr.w r4, [sp, #4]
	ldr.w r9, [sp, #8]
	cmp.w r7, #0
	mov.w r10, r9
	it ne
	movne.w r10, r4
	str.w r10, [r0, #68]
	str.w r8, [r0, #76]
	vstr s5, [r0, #32]
	vstr s6, [r0, #36]
	vstr s12, [r0, #40]
	vstr s7, [r0, #44]
	vstr s8, [r0, #88]
	vstr s4, [r0, #96]
	vldr s0, [ip, #160]
	vldr s4, [r0, #92]
	vsub.f32 s5, s15, s19
	cmp.w r5, #0
	vmov.f32 s6, s5
	it ne
	vmovne.f32 s6, s4
	cmp.w r6, #0
	vmov.f32 s4, s6
	it ne
	vmovne.f32 s4, s0
	vldr s0, [ip, #88]
	ldr.w r4, [sp, #72]
	cmp.w r4, #0
	vmov.f32 s5, s1
	it ne
	vmovne.f32 s5, s0
	vstr s3, [r0, #28]
	ldr.w r5, [sp, #12]
	ldr.w r6, [sp, #20]
	ldr.w r7, [sp, #24]
	cmp.w r4, #0
	mov.w r8, r7
	it ne
	movne.w r8, r6
	str.w r8, [r0, #64]
	str.w r5, [r0, #72]
	vstr s20, [r0, #8]
	vstr s25, [r0, #12]
	vstr s13, [r0, #16]
	vstr s11, [r0, #20]
	vstr s2, [r0, #24]
	vstr s5, [r0, #84]
	vstr s4, [r0, #92]
	vstr s10, [r0, #52]
	vldr s0, [r0, #48]
	vldr s1, [ip, #204]
	vmul.f32 s0, s0, s1
	vstr s0, [r0, #48]
	mov.w r0, #0
	ldr.w r4, [sp, #64]
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	add.w sp, sp, #80
	vpop {s16-s29}
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_observe_table:
	.word 0x3f800000 @ 1.0
	.word 0x42480000 @ 50.0
	.word 0x3c41b5f1 @ 0.011823163
	.word 0x3dc1b5f1 @ 0.09458531
	.word 0x3a7c1fef @ 0.00096177956
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x46170c19 @ 9667.024
	.word 0x3975dd20 @ 0.00023447396
	.word 0x459c4d13 @ 5001.6343
	.word 0x2f33c5ab @ 1.6350181e-10
	.word 0x40800000 @ 4.0
	.word 0x3ff47645 @ 1.9098593
	.word 0x3a830d1a @ 0.0009998411
	.word 0x35063423 @ 4.999476e-7
	.word 0x42208591 @ 40.130436
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x2f373cd5 @ 1.6665365e-10
	.word 0x38ff312a @ 0.00012168505
	.word 0x377f312a @ 1.5210631e-5
	.word 0x41000000 @ 8.0
	.word 0x3a83126f @ 0.001
	.word 0x37ff312a @ 3.0421263e-5
	.word 0x00000000 @ 0.0
	.word 0x3d47ea64 @ 0.048807517
	.word 0x3cc1b5f1 @ 0.023646327
	.word 0xbf800000 @ -1.0
	.word 0x3fc90fdb @ 1.5707964
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.word 0x37c28d4e @ 2.3192402e-5
	.word 0xbab59c80 @ -0.0013855845
	.word 0x3d2aa7d9 @ 0.04166398
	.word 0xbeffffe9 @ -0.4999993
	.word 0x3f000000 @ 0.5
	.word 0x362e7949 @ 2.5998618e-6
	.word 0xb94fafbf @ -0.00019806529
	.word 0x3c088734 @ 0.008333016
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x3e623391 @ 0.22089984
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x43f5dd20 @ 491.72754
	.word 0x4be536cc @ 30043544.0
	.word 0x4838b45c @ 189137.44
	.word 0x483f7812 @ 196064.28
	.word 0x3f6c4815 @ 0.9229749
	.word 0x43f408fd @ 488.07022
	.word 0x3f461ed1 @ 0.7739077
	.word 0x470d47c1 @ 36167.754
	.word 0x44b4fcb2 @ 1447.8967
	.word 0x3f7feabe @ 0.99967563
	.word 0x41c5f1a4 @ 24.742989
	.word 0x3f7befc5 @ 0.98412734
	.size joint_drive_observe, .-joint_drive_observe

	.section .text.joint_drive_law, "ax", %progbits
	.balign 8
	.global joint_drive_law
	.type joint_drive_law, %function
	.thumb_func
joint_drive_law:
	push.w {r4-r11}
	vpush {s16-s19}
	movw ip, #:lower16:.Ljoint_drive_law_table
	movt ip, #:upper16:.Ljoint_drive_law_table
	ldrb.w r4, [r2, #0]
	cmp.w r4, #0
	beq.w .Ljoint_drive_law_1
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #72]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #12]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	ldr.w r5, [r1, #12]
	ldr.w r6, [r0, #80]
	sub.w r7, r5, r6
	vmov s2, r7
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [r1, #16]
	vadd.f32 s1, s1, s2
	vsub.f32 s1, s0, s1
	vabs.f32 s2, s1
	vldr s3, [ip, #8]
	vldr s4, [r0, #56]
	vabs.f32 s4, s4
	vmul.f32 s3, s3, s4
	vldr s5, [ip, #12]
	vldr s6, [ip, #16]
	vcmp.f32 s4, s6
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r7, #1
	movpl.w r7, #0
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s3
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Ljoint_drive_law_2
	vldr s3, [ip, #20]
	vldr s6, [r2, #4]
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [ip, #24]
	vldr s8, [ip, #28]
	ldr.w r9, [r0, #76]
	vmov s9, r9
	vcvt.f32.s32 s9, s9
	vmul.f32 s8, s8, s9
	vldr s9, [r0, #32]
	vadd.f32 s8, s8, s9
	vldr s9, [ip, #32]
	vmul.f32 s0, s9, s0
	vsub.f32 s0, s8, s0
	vmul.f32 s7, s7, s0
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #36]
	vldr s8, [r0, #36]
	vmul.f32 s7, s7, s8
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #32]
	vldr s8, [r2, #8]
	vadd.f32 s7, s7, s8
	vneg.f32 s7, s7
	vldr s8, [ip, #40]
	vldr s9, [r0, #16]
	vmul.f32 s8, s8, s9
	vsub.f32 s0, s0, s8
	vldr s8, [r2, #4]
	vsub.f32 s0, s0, s8
	vmul.f32 s8, s7, s0
	vadd.f32 s6, s6, s8
	vldr s8, [ip, #40]
	vldr s9, [r0, #36]
	vldr s10, [r0, #16]
	vmul.f32 s7, s7, s10
	vadd.f32 s7, s9, s7
	vldr s9, [ip, #40]
	vmul.f32 s9, s9, s0
	vsub.f32 s7, s7, s9
	vmul.f32 s8, s8, s7
	vsub.f32 s6, s6, s8
	vldr s8, [r0, #40]
	vldr s9, [ip, #44]
	vldr s10, [r2, #8]
	vsub.f32 s9, s9, s10
	vldr s10, [r0, #20]
	vmul.f32 s10, s9, s10
	vadd.f32 s8, s8, s10
	vadd.f32 s6, s6, s8
	vmul.f32 s3, s3, s6
	vneg.f32 s3, s3
	vldr s6, [ip, #48]
	vldr s8, [r0, #16]
	vldr s10, [r1, #20]
	vsub.f32 s8, s8, s10
	vmul.f32 s6, s6, s8
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #52]
	vldr s10, [r1, #24]
	vsub.f32 s0, s0, s10
	vmul.f32 s6, s6, s0
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #56]
	vldr s10, [r1, #28]
	vsub.f32 s7, s7, s10
	vmul.f32 s6, s6, s7
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #60]
	vldr s10, [r0, #20]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #64]
	vldr s10, [r0, #24]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #68]
	vldr s10, [r0, #44]
	vldr s11, [r0, #24]
	vmul.f32 s9, s9, s11
	vadd.f32 s9, s10, s9
	vmul.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #72]
	vldr s9, [r1, #48]
	vldr s10, [r1, #28]
	vsub.f32 s9, s9, s10
	vmul.f32 s6, s6, s9
	vldr s9, [ip, #76]
	vldr s10, [r1, #36]
	vldr s11, [r1, #16]
	vsub.f32 s10, s10, s11
	vldr s11, [ip, #4]
	ldr.w r10, [r1, #32]
	sub.w r5, r10, r5
	vmov s12, r5
	vcvt.f32.s32 s12, s12
	vmul.f32 s11, s11, s12
	vadd.f32 s11, s10, s11
	vldr s13, [ip, #80]
	vcmp.f32 s12, s13
	vmrs APSR_nzcv, fpscr
	vmov.f32 s12, s10
	it ne
	vmovne.f32 s12, s11
	vmul.f32 s9, s9, s12
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #84]
	vldr s10, [r1, #40]
	vldr s11, [r1, #20]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #88]
	vldr s10, [r1, #44]
	vldr s11, [r1, #24]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #92]
	vldr s9, [ip, #96]
	vldr s10, [ip, #100]
	vldr s11, [ip, #104]
	vsub.f32 s12, s2, s5
	vldr s13, [ip, #108]
	vmul.f32 s13, s13, s5
	vadd.f32 s14, s12, s13
	vsub.f32 s15, s12, s13
	vabs.f32 s15, s15
	vsub.f32 s14, s14, s15
	vmul.f32 s11, s11, s14
	vmul.f32 s10, s10, s11
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #112]
	vldr s14, [ip, #104]
	vsub.f32 s11, s12, s11
	vldr s12, [ip, #116]
	vmul.f32 s12, s12, s13
	vadd.f32 s13, s11, s12
	vsub.f32 s15, s11, s12
	vabs.f32 s15, s15
	vsub.f32 s13, s13, s15
	vmul.f32 s13, s14, s13
	vmul.f32 s10, s10, s13
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #120]
	vldr s14, [ip, #104]
	vsub.f32 s11, s11, s13
	vldr s13, [ip, #116]
	vmul.f32 s12, s13, s12
	vadd.f32 s13, s11, s12
	vsub.f32 s15, s11, s12
	vabs.f32 s15, s15
	vsub.f32 s13, s13, s15
	vmul.f32 s13, s14, s13
	vmul.f32 s10, s10, s13
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #124]
	vldr s14, [ip, #104]
	vsub.f32 s11, s11, s13
	vldr s13, [ip, #116]
	vmul.f32 s12, s13, s12
	vadd.f32 s13, s11, s12
	vsub.f32 s11, s11, s12
	vabs.f32 s11, s11
	vsub.f32 s11, s13, s11
	vmul.f32 s11, s14, s11
	vmul.f32 s10, s10, s11
	vadd.f32 s5, s5, s10
	vneg.f32 s10, s5
	vldr s11, [ip, #80]
	vcmp.f32 s1, s11
	vmrs APSR_nzcv, fpscr
	vmov.f32 s11, s10
	it gt
	vmovgt.f32 s11, s5
	cmp.w r8, #0
	vmov.f32 s5, s11
	it ne
	vmovne.f32 s5, s1
	vmul.f32 s1, s9, s5
	vadd.f32 s1, s7, s1
	vldr s5, [ip, #128]
	vmul.f32 s5, s5, s8
	vadd.f32 s1, s1, s5
	vldr s5, [ip, #132]
	vmul.f32 s0, s5, s0
	vadd.f32 s0, s1, s0
	vldr s1, [ip, #136]
	vldr s5, [r0, #20]
	vmul.f32 s1, s1, s5
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #140]
	vldr s5, [r0, #24]
	vmul.f32 s1, s1, s5
	vadd.f32 s0, s0, s1
	vmul.f32 s1, s6, s0
	vadd.f32 s1, s3, s1
	vldr s3, [r0, #0]
	vldr s5, [ip, #144]
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	orr.w r5, r8, r5
	cmp.w r5, #0
	it ne
	vmovne.f32 s3, s1
	vabs.f32 s2, s3
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_3
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #152]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_3:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s4
	vneg.f32 s1, s0
	vldr s2, [ip, #80]
	vldr s3, [r0, #0]
	vldr s5, [ip, #80]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #144]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s3
	vmul.f32 s2, s2, s5
	vldr s3, [ip, #80]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s0
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s3
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #140]
	vldr s3, [r0, #60]
	vldr s5, [ip, #140]
	vadd.f32 s3, s3, s5
	vabs.f32 s3, s3
	vldr s5, [ip, #140]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s3
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #156]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s4, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #56]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_2:
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r9, #1
	movhi.w r9, #0
	cmp.w r9, #0
	beq.w .Ljoint_drive_law_4
	vldr s3, [ip, #20]
	vldr s6, [r2, #4]
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [ip, #24]
	vldr s8, [ip, #28]
	ldr.w r10, [r0, #76]
	vmov s9, r10
	vcvt.f32.s32 s9, s9
	vmul.f32 s8, s8, s9
	vldr s9, [r0, #32]
	vadd.f32 s8, s8, s9
	vldr s9, [ip, #32]
	vmul.f32 s0, s9, s0
	vsub.f32 s0, s8, s0
	vmul.f32 s7, s7, s0
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #36]
	vldr s8, [r0, #36]
	vmul.f32 s7, s7, s8
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #32]
	vldr s8, [r2, #8]
	vadd.f32 s7, s7, s8
	vneg.f32 s7, s7
	vldr s8, [ip, #40]
	vldr s9, [r0, #16]
	vmul.f32 s8, s8, s9
	vsub.f32 s0, s0, s8
	vldr s8, [r2, #4]
	vsub.f32 s0, s0, s8
	vmul.f32 s8, s7, s0
	vadd.f32 s6, s6, s8
	vldr s8, [ip, #40]
	vldr s9, [r0, #36]
	vldr s10, [r0, #16]
	vmul.f32 s7, s7, s10
	vadd.f32 s7, s9, s7
	vldr s9, [ip, #40]
	vmul.f32 s9, s9, s0
	vsub.f32 s7, s7, s9
	vmul.f32 s8, s8, s7
	vsub.f32 s6, s6, s8
	vldr s8, [r0, #40]
	vldr s9, [ip, #44]
	vldr s10, [r2, #8]
	vsub.f32 s9, s9, s10
	vldr s10, [r0, #20]
	vmul.f32 s10, s9, s10
	vadd.f32 s8, s8, s10
	vadd.f32 s6, s6, s8
	vmul.f32 s3, s3, s6
	vneg.f32 s3, s3
	vldr s6, [ip, #48]
	vldr s8, [r0, #16]
	vldr s10, [r1, #20]
	vsub.f32 s8, s8, s10
	vmul.f32 s6, s6, s8
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #52]
	vldr s10, [r1, #24]
	vsub.f32 s0, s0, s10
	vmul.f32 s6, s6, s0
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #56]
	vldr s10, [r1, #28]
	vsub.f32 s7, s7, s10
	vmul.f32 s6, s6, s7
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #60]
	vldr s10, [r0, #20]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #64]
	vldr s10, [r0, #24]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #68]
	vldr s10, [r0, #44]
	vldr s11, [r0, #24]
	vmul.f32 s9, s9, s11
	vadd.f32 s9, s10, s9
	vmul.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #72]
	vldr s9, [r1, #48]
	vldr s10, [r1, #28]
	vsub.f32 s9, s9, s10
	vmul.f32 s6, s6, s9
	vldr s9, [ip, #76]
	vldr s10, [r1, #36]
	vldr s11, [r1, #16]
	vsub.f32 s10, s10, s11
	vldr s11, [ip, #4]
	ldr.w r11, [r1, #32]
	sub.w r5, r11, r5
	vmov s12, r5
	vcvt.f32.s32 s12, s12
	vmul.f32 s11, s11, s12
	vadd.f32 s11, s10, s11
	vldr s13, [ip, #80]
	vcmp.f32 s12, s13
	vmrs APSR_nzcv, fpscr
	vmov.f32 s12, s10
	it ne
	vmovne.f32 s12, s11
	vmul.f32 s9, s9, s12
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #84]
	vldr s10, [r1, #40]
	vldr s11, [r1, #20]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #88]
	vldr s10, [r1, #44]
	vldr s11, [r1, #24]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #92]
	vldr s9, [ip, #96]
	vldr s10, [ip, #100]
	vldr s11, [ip, #104]
	vsub.f32 s2, s2, s5
	vldr s12, [ip, #108]
	vmul.f32 s12, s12, s5
	vadd.f32 s13, s2, s12
	vsub.f32 s14, s2, s12
	vabs.f32 s14, s14
	vsub.f32 s13, s13, s14
	vmul.f32 s11, s11, s13
	vmul.f32 s10, s10, s11
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #112]
	vldr s13, [ip, #104]
	vsub.f32 s2, s2, s11
	vldr s11, [ip, #116]
	vmul.f32 s11, s11, s12
	vadd.f32 s12, s2, s11
	vsub.f32 s14, s2, s11
	vabs.f32 s14, s14
	vsub.f32 s12, s12, s14
	vmul.f32 s12, s13, s12
	vmul.f32 s10, s10, s12
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #120]
	vldr s13, [ip, #104]
	vsub.f32 s2, s2, s12
	vldr s12, [ip, #116]
	vmul.f32 s11, s12, s11
	vadd.f32 s12, s2, s11
	vsub.f32 s14, s2, s11
	vabs.f32 s14, s14
	vsub.f32 s12, s12, s14
	vmul.f32 s12, s13, s12
	vmul.f32 s10, s10, s12
	vadd.f32 s5, s5, s10
	vldr s10, [ip, #124]
	vldr s13, [ip, #104]
	vsub.f32 s2, s2, s12
	vldr s12, [ip, #116]
	vmul.f32 s11, s12, s11
	vadd.f32 s12, s2, s11
	vsub.f32 s2, s2, s11
	vabs.f32 s2, s2
	vsub.f32 s2, s12, s2
	vmul.f32 s2, s13, s2
	vmul.f32 s2, s10, s2
	vadd.f32 s2, s5, s2
	vneg.f32 s5, s2
	vldr s10, [ip, #80]
	vcmp.f32 s1, s10
	vmrs APSR_nzcv, fpscr
	vmov.f32 s10, s5
	it gt
	vmovgt.f32 s10, s2
	cmp.w r8, #0
	vmov.f32 s2, s10
	it ne
	vmovne.f32 s2, s1
	vmul.f32 s1, s9, s2
	vadd.f32 s1, s7, s1
	vldr s2, [ip, #128]
	vmul.f32 s2, s2, s8
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #132]
	vmul.f32 s0, s2, s0
	vadd.f32 s0, s1, s0
	vldr s1, [ip, #136]
	vldr s2, [r0, #20]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #140]
	vldr s2, [r0, #24]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vmul.f32 s1, s6, s0
	vadd.f32 s1, s3, s1
	vldr s2, [r0, #0]
	orr.w r5, r8, r9
	cmp.w r5, #0
	it ne
	vmovne.f32 s2, s1
	vabs.f32 s2, s2
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_5
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #152]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_5:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s4
	vneg.f32 s1, s0
	vldr s2, [ip, #80]
	vldr s3, [r0, #0]
	vldr s5, [ip, #80]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #144]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s3
	vmul.f32 s2, s2, s5
	vldr s3, [ip, #80]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s0
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s3
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #140]
	vldr s3, [r0, #60]
	vldr s5, [ip, #140]
	vadd.f32 s3, s3, s5
	vabs.f32 s3, s3
	vldr s5, [ip, #140]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s3
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #156]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s4, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #56]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_4:
	vldr s3, [ip, #16]
	vldr s6, [ip, #16]
	vcmp.f32 s6, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s3, s4
	vneg.f32 s4, s3
	vldr s6, [ip, #80]
	vldr s7, [r0, #0]
	vldr s8, [ip, #80]
	vldr s9, [ip, #20]
	vldr s10, [r2, #4]
	vldr s11, [r0, #16]
	vmul.f32 s10, s10, s11
	vldr s11, [r0, #16]
	vmul.f32 s10, s10, s11
	vldr s11, [ip, #24]
	vldr s12, [ip, #28]
	ldr.w r4, [r0, #76]
	vmov s13, r4
	vcvt.f32.s32 s13, s13
	vmul.f32 s12, s12, s13
	vldr s13, [r0, #32]
	vadd.f32 s12, s12, s13
	vldr s13, [ip, #32]
	vmul.f32 s0, s13, s0
	vsub.f32 s0, s12, s0
	vmul.f32 s11, s11, s0
	vsub.f32 s10, s10, s11
	vldr s11, [ip, #36]
	vldr s12, [r0, #36]
	vmul.f32 s11, s11, s12
	vsub.f32 s10, s10, s11
	vldr s11, [ip, #32]
	vldr s12, [r2, #8]
	vadd.f32 s11, s11, s12
	vneg.f32 s11, s11
	vldr s12, [ip, #40]
	vldr s13, [r0, #16]
	vmul.f32 s12, s12, s13
	vsub.f32 s0, s0, s12
	vldr s12, [r2, #4]
	vsub.f32 s0, s0, s12
	vmul.f32 s12, s11, s0
	vadd.f32 s10, s10, s12
	vldr s12, [ip, #40]
	vldr s13, [r0, #36]
	vldr s14, [r0, #16]
	vmul.f32 s11, s11, s14
	vadd.f32 s11, s13, s11
	vldr s13, [ip, #40]
	vmul.f32 s13, s13, s0
	vsub.f32 s11, s11, s13
	vmul.f32 s12, s12, s11
	vsub.f32 s10, s10, s12
	vldr s12, [r0, #40]
	vldr s13, [ip, #44]
	vldr s14, [r2, #8]
	vsub.f32 s13, s13, s14
	vldr s14, [r0, #20]
	vmul.f32 s14, s13, s14
	vadd.f32 s12, s12, s14
	vadd.f32 s10, s10, s12
	vmul.f32 s9, s9, s10
	vneg.f32 s9, s9
	vldr s10, [ip, #48]
	vldr s12, [r0, #16]
	vldr s14, [r1, #20]
	vsub.f32 s12, s12, s14
	vmul.f32 s10, s10, s12
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #52]
	vldr s14, [r1, #24]
	vsub.f32 s0, s0, s14
	vmul.f32 s10, s10, s0
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #56]
	vldr s14, [r1, #28]
	vsub.f32 s11, s11, s14
	vmul.f32 s10, s10, s11
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #60]
	vldr s14, [r0, #20]
	vmul.f32 s10, s10, s14
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #64]
	vldr s14, [r0, #24]
	vmul.f32 s10, s10, s14
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #68]
	vldr s14, [r0, #44]
	vldr s15, [r0, #24]
	vmul.f32 s13, s13, s15
	vadd.f32 s13, s14, s13
	vmul.f32 s10, s10, s13
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #72]
	vldr s13, [r1, #48]
	vldr s14, [r1, #28]
	vsub.f32 s13, s13, s14
	vmul.f32 s10, s10, s13
	vldr s13, [ip, #76]
	vldr s14, [r1, #36]
	vldr s15, [r1, #16]
	vsub.f32 s14, s14, s15
	vldr s15, [ip, #4]
	ldr.w r4, [r1, #32]
	sub.w r4, r4, r5
	vmov s16, r4
	vcvt.f32.s32 s16, s16
	vmul.f32 s15, s15, s16
	vadd.f32 s15, s14, s15
	vldr s17, [ip, #80]
	vcmp.f32 s16, s17
	vmrs APSR_nzcv, fpscr
	vmov.f32 s16, s14
	it ne
	vmovne.f32 s16, s15
	vmul.f32 s13, s13, s16
	vadd.f32 s10, s10, s13
	vldr s13, [ip, #84]
	vldr s14, [r1, #40]
	vldr s15, [r1, #20]
	vsub.f32 s14, s14, s15
	vmul.f32 s13, s13, s14
	vadd.f32 s10, s10, s13
	vldr s13, [ip, #88]
	vldr s14, [r1, #44]
	vldr s15, [r1, #24]
	vsub.f32 s14, s14, s15
	vmul.f32 s13, s13, s14
	vadd.f32 s10, s10, s13
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #92]
	vldr s13, [ip, #96]
	vldr s14, [ip, #100]
	vldr s15, [ip, #104]
	vsub.f32 s2, s2, s5
	vldr s16, [ip, #108]
	vmul.f32 s16, s16, s5
	vadd.f32 s17, s2, s16
	vsub.f32 s18, s2, s16
	vabs.f32 s18, s18
	vsub.f32 s17, s17, s18
	vmul.f32 s15, s15, s17
	vmul.f32 s14, s14, s15
	vadd.f32 s5, s5, s14
	vldr s14, [ip, #112]
	vldr s17, [ip, #104]
	vsub.f32 s2, s2, s15
	vldr s15, [ip, #116]
	vmul.f32 s15, s15, s16
	vadd.f32 s16, s2, s15
	vsub.f32 s18, s2, s15
	vabs.f32 s18, s18
	vsub.f32 s16, s16, s18
	vmul.f32 s16, s17, s16
	vmul.f32 s14, s14, s16
	vadd.f32 s5, s5, s14
	vldr s14, [ip, #120]
	vldr s17, [ip, #104]
	vsub.f32 s2, s2, s16
	vldr s16, [ip, #116]
	vmul.f32 s15, s16, s15
	vadd.f32 s16, s2, s15
	vsub.f32 s18, s2, s15
	vabs.f32 s18, s18
	vsub.f32 s16, s16, s18
	vmul.f32 s16, s17, s16
	vmul.f32 s14, s14, s16
	vadd.f32 s5, s5, s14
	vldr s14, [ip, #124]
	vldr s17, [ip, #104]
	vsub.f32 s2, s2, s16
	vldr s16, [ip, #116]
	vmul.f32 s15, s16, s15
	vadd.f32 s16, s2, s15
	vsub.f32 s2, s2, s15
	vabs.f32 s2, s2
	vsub.f32 s2, s16, s2
	vmul.f32 s2, s17, s2
	vmul.f32 s2, s14, s2
	vadd.f32 s2, s5, s2
	vneg.f32 s5, s2
	vldr s14, [ip, #80]
	vcmp.f32 s1, s14
	vmrs APSR_nzcv, fpscr
	vmov.f32 s14, s5
	it gt
	vmovgt.f32 s14, s2
	cmp.w r8, #0
	vmov.f32 s2, s14
	it ne
	vmovne.f32 s2, s1
	vmul.f32 s1, s13, s2
	vadd.f32 s1, s11, s1
	vldr s2, [ip, #128]
	vmul.f32 s2, s2, s12
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #132]
	vmul.f32 s0, s2, s0
	vadd.f32 s0, s1, s0
	vldr s1, [ip, #136]
	vldr s2, [r0, #20]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #140]
	vldr s2, [r0, #24]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vmul.f32 s0, s10, s0
	vadd.f32 s0, s9, s0
	vldr s1, [r0, #0]
	orr.w r4, r8, r9
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vabs.f32 s0, s1
	vldr s1, [ip, #144]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s8, s7
	vmul.f32 s0, s6, s8
	vldr s1, [ip, #80]
	vadd.f32 s0, s0, s1
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s0
	it gt
	vmovgt.f32 s1, s3
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s1
	it mi
	vmovmi.f32 s0, s4
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_1:
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #72]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #12]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	ldr.w r5, [r1, #12]
	ldr.w r6, [r0, #80]
	sub.w r7, r5, r6
	vmov s2, r7
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [r1, #16]
	vadd.f32 s1, s1, s2
	vsub.f32 s1, s0, s1
	vabs.f32 s2, s1
	vldr s3, [ip, #8]
	vldr s4, [r0, #56]
	vabs.f32 s4, s4
	vmul.f32 s3, s3, s4
	vldr s5, [ip, #12]
	vldr s6, [ip, #16]
	vcmp.f32 s4, s6
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r7, #1
	movpl.w r7, #0
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s3
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Ljoint_drive_law_6
	vldr s2, [ip, #20]
	vldr s3, [r2, #4]
	vldr s5, [r0, #16]
	vmul.f32 s3, s3, s5
	vldr s5, [r0, #16]
	vmul.f32 s3, s3, s5
	vldr s5, [ip, #24]
	vldr s6, [ip, #28]
	ldr.w r8, [r0, #76]
	vmov s7, r8
	vcvt.f32.s32 s7, s7
	vmul.f32 s6, s6, s7
	vldr s7, [r0, #32]
	vadd.f32 s6, s6, s7
	vldr s7, [ip, #32]
	vmul.f32 s0, s7, s0
	vsub.f32 s0, s6, s0
	vmul.f32 s5, s5, s0
	vsub.f32 s3, s3, s5
	vldr s5, [ip, #36]
	vldr s6, [r0, #36]
	vmul.f32 s5, s5, s6
	vsub.f32 s3, s3, s5
	vldr s5, [ip, #32]
	vldr s6, [r2, #8]
	vadd.f32 s5, s5, s6
	vneg.f32 s5, s5
	vldr s6, [ip, #40]
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vsub.f32 s0, s0, s6
	vldr s6, [r2, #4]
	vsub.f32 s0, s0, s6
	vmul.f32 s6, s5, s0
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #40]
	vldr s7, [r0, #36]
	vldr s8, [r0, #16]
	vmul.f32 s5, s5, s8
	vadd.f32 s5, s7, s5
	vldr s7, [ip, #40]
	vmul.f32 s7, s7, s0
	vsub.f32 s5, s5, s7
	vmul.f32 s6, s6, s5
	vsub.f32 s3, s3, s6
	vldr s6, [r0, #40]
	vldr s7, [ip, #44]
	vldr s8, [r2, #8]
	vsub.f32 s7, s7, s8
	vldr s8, [r0, #20]
	vmul.f32 s8, s7, s8
	vadd.f32 s6, s6, s8
	vadd.f32 s3, s3, s6
	vmul.f32 s2, s2, s3
	vneg.f32 s2, s2
	vldr s3, [ip, #48]
	vldr s6, [r0, #16]
	vldr s8, [r1, #20]
	vsub.f32 s6, s6, s8
	vmul.f32 s3, s3, s6
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #52]
	vldr s8, [r1, #24]
	vsub.f32 s0, s0, s8
	vmul.f32 s3, s3, s0
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #56]
	vldr s8, [r1, #28]
	vsub.f32 s5, s5, s8
	vmul.f32 s3, s3, s5
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #60]
	vldr s8, [r0, #20]
	vmul.f32 s3, s3, s8
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #64]
	vldr s8, [r0, #24]
	vmul.f32 s3, s3, s8
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #68]
	vldr s8, [r0, #44]
	vldr s9, [r0, #24]
	vmul.f32 s7, s7, s9
	vadd.f32 s7, s8, s7
	vmul.f32 s3, s3, s7
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #72]
	vldr s7, [r1, #48]
	vldr s8, [r1, #28]
	vsub.f32 s7, s7, s8
	vmul.f32 s3, s3, s7
	vldr s7, [ip, #76]
	vldr s8, [r1, #36]
	vldr s9, [r1, #16]
	vsub.f32 s8, s8, s9
	vldr s9, [ip, #4]
	ldr.w r9, [r1, #32]
	sub.w r5, r9, r5
	vmov s10, r5
	vcvt.f32.s32 s10, s10
	vmul.f32 s9, s9, s10
	vadd.f32 s9, s8, s9
	vldr s11, [ip, #80]
	vcmp.f32 s10, s11
	vmrs APSR_nzcv, fpscr
	vmov.f32 s10, s8
	it ne
	vmovne.f32 s10, s9
	vmul.f32 s7, s7, s10
	vadd.f32 s3, s3, s7
	vldr s7, [ip, #84]
	vldr s8, [r1, #40]
	vldr s9, [r1, #20]
	vsub.f32 s8, s8, s9
	vmul.f32 s7, s7, s8
	vadd.f32 s3, s3, s7
	vldr s7, [ip, #88]
	vldr s8, [r1, #44]
	vldr s9, [r1, #24]
	vsub.f32 s8, s8, s9
	vmul.f32 s7, s7, s8
	vadd.f32 s3, s3, s7
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #160]
	vldr s7, [r0, #4]
	vmul.f32 s3, s3, s7
	vadd.f32 s3, s2, s3
	vldr s7, [ip, #164]
	vldr s8, [ip, #96]
	vmul.f32 s1, s8, s1
	vadd.f32 s1, s5, s1
	vldr s5, [ip, #128]
	vmul.f32 s5, s5, s6
	vadd.f32 s1, s1, s5
	vldr s5, [ip, #132]
	vmul.f32 s0, s5, s0
	vadd.f32 s0, s1, s0
	vldr s1, [ip, #136]
	vldr s5, [r0, #20]
	vmul.f32 s1, s1, s5
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #140]
	vldr s5, [r0, #24]
	vmul.f32 s1, s1, s5
	vadd.f32 s0, s0, s1
	vmul.f32 s1, s7, s0
	vadd.f32 s1, s3, s1
	vabs.f32 s3, s1
	vldr s5, [ip, #168]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_7
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vldr s1, [r0, #4]
	vsub.f32 s1, s0, s1
	vstr s1, [r3, #8]
	vstr s0, [r3, #4]
	vstr s5, [r0, #0]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	vldr s0, [r0, #4]
	vldr s1, [ip, #152]
	vldr s2, [r0, #4]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_7:
	vldr s1, [ip, #92]
	vmul.f32 s1, s1, s0
	vadd.f32 s1, s2, s1
	vabs.f32 s2, s1
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_8
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #152]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_8:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s4
	vneg.f32 s1, s0
	vldr s2, [ip, #80]
	vldr s3, [r0, #0]
	vldr s5, [ip, #80]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #144]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s3
	vmul.f32 s2, s2, s5
	vldr s3, [ip, #80]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s0
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s3
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #140]
	vldr s3, [r0, #60]
	vldr s5, [ip, #140]
	vadd.f32 s3, s3, s5
	vabs.f32 s3, s3
	vldr s5, [ip, #140]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s3
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #156]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s4, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #56]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_6:
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Ljoint_drive_law_9
	vldr s3, [ip, #20]
	vldr s6, [r2, #4]
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [r0, #16]
	vmul.f32 s6, s6, s7
	vldr s7, [ip, #24]
	vldr s8, [ip, #28]
	ldr.w r8, [r0, #76]
	vmov s9, r8
	vcvt.f32.s32 s9, s9
	vmul.f32 s8, s8, s9
	vldr s9, [r0, #32]
	vadd.f32 s8, s8, s9
	vldr s9, [ip, #32]
	vmul.f32 s0, s9, s0
	vsub.f32 s0, s8, s0
	vmul.f32 s7, s7, s0
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #36]
	vldr s8, [r0, #36]
	vmul.f32 s7, s7, s8
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #32]
	vldr s8, [r2, #8]
	vadd.f32 s7, s7, s8
	vneg.f32 s7, s7
	vldr s8, [ip, #40]
	vldr s9, [r0, #16]
	vmul.f32 s8, s8, s9
	vsub.f32 s0, s0, s8
	vldr s8, [r2, #4]
	vsub.f32 s0, s0, s8
	vmul.f32 s8, s7, s0
	vadd.f32 s6, s6, s8
	vldr s8, [ip, #40]
	vldr s9, [r0, #36]
	vldr s10, [r0, #16]
	vmul.f32 s7, s7, s10
	vadd.f32 s7, s9, s7
	vldr s9, [ip, #40]
	vmul.f32 s9, s9, s0
	vsub.f32 s7, s7, s9
	vmul.f32 s8, s8, s7
	vsub.f32 s6, s6, s8
	vldr s8, [r0, #40]
	vldr s9, [ip, #44]
	vldr s10, [r2, #8]
	vsub.f32 s9, s9, s10
	vldr s10, [r0, #20]
	vmul.f32 s10, s9, s10
	vadd.f32 s8, s8, s10
	vadd.f32 s6, s6, s8
	vmul.f32 s3, s3, s6
	vneg.f32 s3, s3
	vldr s6, [ip, #48]
	vldr s8, [r0, #16]
	vldr s10, [r1, #20]
	vsub.f32 s8, s8, s10
	vmul.f32 s6, s6, s8
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #52]
	vldr s10, [r1, #24]
	vsub.f32 s0, s0, s10
	vmul.f32 s6, s6, s0
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #56]
	vldr s10, [r1, #28]
	vsub.f32 s7, s7, s10
	vmul.f32 s6, s6, s7
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #60]
	vldr s10, [r0, #20]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #64]
	vldr s10, [r0, #24]
	vmul.f32 s6, s6, s10
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #68]
	vldr s10, [r0, #44]
	vldr s11, [r0, #24]
	vmul.f32 s9, s9, s11
	vadd.f32 s9, s10, s9
	vmul.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #72]
	vldr s9, [r1, #48]
	vldr s10, [r1, #28]
	vsub.f32 s9, s9, s10
	vmul.f32 s6, s6, s9
	vldr s9, [ip, #76]
	vldr s10, [r1, #36]
	vldr s11, [r1, #16]
	vsub.f32 s10, s10, s11
	vldr s11, [ip, #4]
	ldr.w r9, [r1, #32]
	sub.w r5, r9, r5
	vmov s12, r5
	vcvt.f32.s32 s12, s12
	vmul.f32 s11, s11, s12
	vadd.f32 s11, s10, s11
	vldr s13, [ip, #80]
	vcmp.f32 s12, s13
	vmrs APSR_nzcv, fpscr
	vmov.f32 s12, s10
	it ne
	vmovne.f32 s12, s11
	vmul.f32 s9, s9, s12
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #84]
	vldr s10, [r1, #40]
	vldr s11, [r1, #20]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vldr s9, [ip, #88]
	vldr s10, [r1, #44]
	vldr s11, [r1, #24]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s6, s6, s9
	vadd.f32 s3, s3, s6
	vldr s6, [ip, #160]
	vldr s9, [r0, #4]
	vmul.f32 s6, s6, s9
	vadd.f32 s6, s3, s6
	vldr s9, [ip, #164]
	vldr s10, [ip, #96]
	vldr s11, [ip, #100]
	vldr s12, [ip, #104]
	vsub.f32 s2, s2, s5
	vldr s13, [ip, #108]
	vmul.f32 s13, s13, s5
	vadd.f32 s14, s2, s13
	vsub.f32 s15, s2, s13
	vabs.f32 s15, s15
	vsub.f32 s14, s14, s15
	vmul.f32 s12, s12, s14
	vmul.f32 s11, s11, s12
	vadd.f32 s5, s5, s11
	vldr s11, [ip, #112]
	vldr s14, [ip, #104]
	vsub.f32 s2, s2, s12
	vldr s12, [ip, #116]
	vmul.f32 s12, s12, s13
	vadd.f32 s13, s2, s12
	vsub.f32 s15, s2, s12
	vabs.f32 s15, s15
	vsub.f32 s13, s13, s15
	vmul.f32 s13, s14, s13
	vmul.f32 s11, s11, s13
	vadd.f32 s5, s5, s11
	vldr s11, [ip, #120]
	vldr s14, [ip, #104]
	vsub.f32 s2, s2, s13
	vldr s13, [ip, #116]
	vmul.f32 s12, s13, s12
	vadd.f32 s13, s2, s12
	vsub.f32 s15, s2, s12
	vabs.f32 s15, s15
	vsub.f32 s13, s13, s15
	vmul.f32 s13, s14, s13
	vmul.f32 s11, s11, s13
	vadd.f32 s5, s5, s11
	vldr s11, [ip, #124]
	vldr s14, [ip, #104]
	vsub.f32 s2, s2, s13
	vldr s13, [ip, #116]
	vmul.f32 s12, s13, s12
	vadd.f32 s13, s2, s12
	vsub.f32 s2, s2, s12
	vabs.f32 s2, s2
	vsub.f32 s2, s13, s2
	vmul.f32 s2, s14, s2
	vmul.f32 s2, s11, s2
	vadd.f32 s2, s5, s2
	vneg.f32 s5, s2
	vldr s11, [ip, #80]
	vcmp.f32 s1, s11
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s5
	it gt
	vmovgt.f32 s1, s2
	vmul.f32 s1, s10, s1
	vadd.f32 s1, s7, s1
	vldr s2, [ip, #128]
	vmul.f32 s2, s2, s8
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #132]
	vmul.f32 s0, s2, s0
	vadd.f32 s0, s1, s0
	vldr s1, [ip, #136]
	vldr s2, [r0, #20]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #140]
	vldr s2, [r0, #24]
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vmul.f32 s1, s9, s0
	vadd.f32 s1, s6, s1
	vabs.f32 s2, s1
	vldr s5, [ip, #168]
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_10
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s0, [ip, #80]
	vstr s0, [r3, #8]
	vstr s5, [r0, #0]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	vldr s0, [r0, #4]
	vldr s1, [ip, #152]
	vldr s2, [r0, #4]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_10:
	vldr s1, [ip, #92]
	vmul.f32 s1, s1, s0
	vadd.f32 s1, s3, s1
	vabs.f32 s2, s1
	vldr s3, [ip, #144]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_law_11
	vldr s2, [ip, #16]
	vldr s3, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s4
	vldr s3, [ip, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s3, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #148]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s3
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #152]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	vldr s0, [ip, #16]
	vldr s1, [ip, #140]
	vldr s2, [r0, #60]
	vldr s3, [ip, #140]
	vadd.f32 s2, s2, s3
	vabs.f32 s2, s2
	vldr s3, [ip, #140]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [ip, #156]
	vmul.f32 s1, s3, s1
	vadd.f32 s1, s4, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #56]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_11:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s4
	vneg.f32 s1, s0
	vldr s2, [ip, #80]
	vldr s3, [r0, #0]
	vldr s5, [ip, #80]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #144]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s3
	vmul.f32 s2, s2, s5
	vldr s3, [ip, #80]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s0
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s3
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #140]
	vldr s3, [r0, #60]
	vldr s5, [ip, #140]
	vadd.f32 s3, s3, s5
	vabs.f32 s3, s3
	vldr s5, [ip, #140]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s3
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #156]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s4, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #56]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_law_9:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s4
	vneg.f32 s1, s0
	vldr s2, [ip, #80]
	vldr s3, [r0, #0]
	vldr s4, [ip, #80]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #144]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #80]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s0
	vcmp.f32 s3, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s3
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #80]
	vstr s1, [r3, #8]
	vldr s1, [ip, #80]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	mov.w r0, #1
	vpop {s16-s19}
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_law_table:
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x40c90fdb @ 6.2831855
	.word 0x3c035af6 @ 0.008017292
	.word 0x3e764a8d @ 0.24051876
	.word 0x41f00000 @ 30.0
	.word 0x3951a58c @ 0.00019993464
	.word 0x46170c19 @ 9667.024
	.word 0x3975dd20 @ 0.00023447396
	.word 0x421c8591 @ 39.130436
	.word 0x4296603e @ 75.18797
	.word 0x3e9bd37a @ 0.3043478
	.word 0xc21c26b7 @ -39.037807
	.word 0xbfce201e @ -1.6103551
	.word 0xbe77b548 @ -0.24190247
	.word 0xbc37d91e @ -0.011221198
	.word 0xbe743606 @ -0.23848733
	.word 0xb8fa1f22 @ -0.00011926728
	.word 0xb3d731df @ -1.0020789e-7
	.word 0x3e548ee5 @ 0.20757635
	.word 0x3f7a81e5 @ 0.97854453
	.word 0x00000000 @ 0.0
	.word 0x3f1a6e60 @ 0.6032467
	.word 0x3f7c23eb @ 0.98492306
	.word 0xbb0357b8 @ -0.0020041298
	.word 0x45fa0000 @ 8000.0
	.word 0x3eaaaaab @ 0.33333334
	.word 0x3f000000 @ 0.5
	.word 0x40400000 @ 3.0
	.word 0x3e2aaaab @ 0.16666667
	.word 0x40800000 @ 4.0
	.word 0x3daaaaab @ 0.083333336
	.word 0x3d2aaaab @ 0.041666668
	.word 0x44960000 @ 1200.0
	.word 0x42700000 @ 60.0
	.word 0x426ec859 @ 59.695652
	.word 0x3f800000 @ 1.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xc1f00000 @ -30.0
	.word 0x3c230606 @ 0.009950167
	.word 0x3ef00000 @ 0.46875
	.word 0x3c94952f @ 0.018137543
	.word 0xbca50026 @ -0.020141672
	.word 0x46700000 @ 15360.0
	.size joint_drive_law, .-joint_drive_law

	.section .text.joint_drive_give_up, "ax", %progbits
	.balign 8
	.global joint_drive_give_up
	.type joint_drive_give_up, %function
	.thumb_func
joint_drive_give_up:
	push.w {r4-r7}
	movw ip, #:lower16:.Ljoint_drive_give_up_table
	movt ip, #:upper16:.Ljoint_drive_give_up_table
	ldrb.w r4, [r1, #8]
	eor.w r5, r4, #1
	ldrb.w r6, [r1, #9]
	eor.w r7, r6, #1
	and.w r5, r5, r7
	vldr s0, [r0, #56]
	vabs.f32 s0, s0
	vldr s1, [ip, #0]
	vldr s2, [ip, #0]
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s1, s0
	vneg.f32 s0, s1
	vldr s2, [ip, #4]
	vldr s3, [r0, #0]
	vldr s4, [ip, #4]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #8]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #4]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vcmp.f32 s3, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s3
	it mi
	vmovmi.f32 s1, s0
	vstr s1, [r2, #0]
	vldr s0, [ip, #4]
	vstr s0, [r0, #48]
	vldr s0, [ip, #4]
	vstr s0, [r2, #8]
	vldr s0, [ip, #4]
	vstr s0, [r2, #4]
	vldr s0, [r0, #52]
	vldr s2, [ip, #12]
	orr.w r4, r4, r6
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #52]
	vldr s0, [r0, #40]
	vldr s2, [ip, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #40]
	vldr s0, [r0, #20]
	vldr s2, [ip, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #20]
	ldrb.w r4, [r0, #100]
	orr.w r4, r5, r4
	strb.w r4, [r0, #100]
	vstr s1, [r0, #0]
	mov.w r0, #9
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #256
	pop.w {r4-r7}
	bx lr
	.balign 4
.Ljoint_drive_give_up_table:
	.word 0x41f00000 @ 30.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x41200000 @ 10.0
	.size joint_drive_give_up, .-joint_drive_give_up

	.section .text.joint_drive_refuse, "ax", %progbits
	.balign 8
	.global joint_drive_refuse
	.type joint_drive_refuse, %function
	.thumb_func
joint_drive_refuse:
	movw ip, #:lower16:.Ljoint_drive_refuse_table
	movt ip, #:upper16:.Ljoint_drive_refuse_table
	vldr s0, [r0, #56]
	vabs.f32 s0, s0
	vldr s1, [ip, #0]
	vldr s2, [ip, #0]
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s1, s0
	vneg.f32 s0, s1
	vldr s2, [ip, #4]
	vldr s3, [r0, #0]
	vldr s4, [ip, #4]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #8]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #4]
	vadd.f32 s2, s2, s3
	vcmp.f32 s2, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vcmp.f32 s3, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s3
	it mi
	vmovmi.f32 s1, s0
	vstr s1, [r1, #0]
	vldr s0, [ip, #4]
	vstr s0, [r1, #8]
	vldr s0, [ip, #4]
	vstr s0, [r1, #4]
	vstr s1, [r0, #0]
	mov.w r0, #9
	bx lr
	.balign 4
.Ljoint_drive_refuse_table:
	.word 0x41f00000 @ 30.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.size joint_drive_refuse, .-joint_drive_refuse

	.section .text.joint_drive_pass, "ax", %progbits
	.balign 8
	.global joint_drive_pass
	.type joint_drive_pass, %function
	.thumb_func
joint_drive_pass:
	push.w {r4-r5}
	vpush {s16-s17}
	movw ip, #:lower16:.Ljoint_drive_pass_table
	movt ip, #:upper16:.Ljoint_drive_pass_table
	vldr s0, [r0, #84]
	vabs.f32 s0, s0
	vldr s1, [ip, #0]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s1, [r0, #88]
	vabs.f32 s1, s1
	vldr s2, [ip, #0]
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #4]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s2, [ip, #8]
	vstr s2, [r0, #96]
	vldr s2, [ip, #8]
	vstr s2, [r0, #92]
	vldr s2, [ip, #12]
	vldr s3, [r0, #36]
	vmul.f32 s2, s2, s3
	vldr s3, [ip, #16]
	vldr s4, [r0, #28]
	vldr s5, [r0, #28]
	vadd.f32 s4, s4, s5
	vldr s5, [r0, #40]
	vadd.f32 s4, s4, s5
	vldr s5, [ip, #20]
	vldr s6, [ip, #24]
	ldr.w r5, [r0, #76]
	vmov s7, r5
	vcvt.f32.s32 s7, s7
	vmul.f32 s6, s6, s7
	vldr s7, [r0, #32]
	vadd.f32 s7, s6, s7
	vmul.f32 s5, s5, s7
	vsub.f32 s4, s4, s5
	vldr s5, [ip, #28]
	vldr s7, [r0, #0]
	vmul.f32 s5, s5, s7
	vadd.f32 s4, s4, s5
	vldr s5, [ip, #32]
	vldr s7, [ip, #36]
	ldr.w r5, [r0, #72]
	vmov s8, r5
	vcvt.f32.s32 s8, s8
	vmul.f32 s7, s7, s8
	vldr s8, [r0, #12]
	vldr s9, [ip, #40]
	vldr s10, [r0, #16]
	vmul.f32 s9, s9, s10
	vadd.f32 s8, s8, s9
	vadd.f32 s8, s7, s8
	vmul.f32 s5, s5, s8
	vldr s10, [r0, #28]
	vsub.f32 s10, s5, s10
	vadd.f32 s11, s4, s10
	vmul.f32 s3, s3, s11
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #44]
	vldr s11, [r0, #44]
	vmul.f32 s3, s3, s11
	vadd.f32 s2, s2, s3
	vldr s3, [r0, #32]
	vldr s11, [ip, #16]
	vldr s12, [r0, #36]
	vmul.f32 s11, s11, s12
	vldr s12, [ip, #44]
	vmul.f32 s4, s12, s4
	vadd.f32 s4, s11, s4
	vadd.f32 s3, s3, s4
	vldr s4, [ip, #48]
	vldr s12, [r0, #44]
	vmul.f32 s4, s4, s12
	vadd.f32 s3, s3, s4
	vldr s4, [ip, #44]
	vmul.f32 s4, s4, s10
	vadd.f32 s3, s3, s4
	vldr s4, [ip, #52]
	vldr s10, [r0, #16]
	vmul.f32 s4, s4, s10
	vldr s10, [ip, #40]
	vldr s12, [r0, #8]
	vldr s13, [r0, #8]
	vadd.f32 s12, s12, s13
	vldr s13, [r0, #20]
	vadd.f32 s12, s12, s13
	vldr s13, [ip, #56]
	vldr s14, [r0, #12]
	vadd.f32 s7, s7, s14
	vmul.f32 s7, s13, s7
	vsub.f32 s7, s12, s7
	vldr s12, [ip, #60]
	vldr s13, [r0, #32]
	vadd.f32 s11, s13, s11
	vadd.f32 s6, s6, s11
	vldr s11, [ip, #0]
	vmul.f32 s11, s11, s8
	vldr s13, [ip, #0]
	vldr s14, [ip, #64]
	vabs.f32 s15, s8
	vsub.f32 s14, s14, s15
	vldr s16, [ip, #68]
	vadd.f32 s14, s14, s16
	vneg.f32 s16, s14
	vldr s17, [ip, #72]
	vcmp.f32 s8, s17
	vmrs APSR_nzcv, fpscr
	vmov.f32 s17, s14
	it mi
	vmovmi.f32 s17, s16
	vldr s14, [ip, #76]
	vcmp.f32 s15, s14
	vmrs APSR_nzcv, fpscr
	vmov.f32 s14, s8
	it gt
	vmovgt.f32 s14, s17
	vmul.f32 s8, s13, s14
	vmul.f32 s13, s14, s14
	vldr s14, [ip, #80]
	vmul.f32 s14, s14, s13
	vldr s15, [ip, #84]
	vadd.f32 s14, s14, s15
	vmul.f32 s14, s14, s13
	vldr s15, [ip, #88]
	vadd.f32 s14, s14, s15
	vmul.f32 s14, s14, s13
	vldr s15, [ip, #92]
	vadd.f32 s14, s14, s15
	vmul.f32 s13, s13, s14
	vmul.f32 s13, s8, s13
	vadd.f32 s8, s8, s13
	vsub.f32 s8, s11, s8
	vadd.f32 s6, s6, s8
	vmul.f32 s6, s12, s6
	vldr s8, [r0, #8]
	vsub.f32 s8, s6, s8
	vadd.f32 s11, s7, s8
	vmul.f32 s10, s10, s11
	vadd.f32 s4, s4, s10
	vldr s10, [ip, #96]
	vldr s11, [r0, #24]
	vmul.f32 s10, s10, s11
	vadd.f32 s4, s4, s10
	vldr s10, [r0, #12]
	vldr s11, [ip, #96]
	vmul.f32 s7, s11, s7
	vadd.f32 s7, s9, s7
	vadd.f32 s7, s10, s7
	vldr s9, [ip, #100]
	vldr s10, [r0, #24]
	vmul.f32 s9, s9, s10
	vadd.f32 s7, s7, s9
	vldr s9, [ip, #96]
	vmul.f32 s8, s9, s8
	vadd.f32 s7, s7, s8
	vstr s6, [r0, #8]
	vstr s3, [r0, #32]
	vstr s2, [r0, #36]
	vstr s5, [r0, #28]
	vstr s7, [r0, #12]
	vstr s4, [r0, #16]
	vldr s2, [r0, #40]
	vldr s3, [ip, #104]
	vldr s4, [r0, #44]
	vmul.f32 s3, s3, s4
	vadd.f32 s2, s2, s3
	vstr s2, [r0, #40]
	vldr s2, [r0, #20]
	vldr s3, [ip, #104]
	vldr s4, [r0, #24]
	vmul.f32 s3, s3, s4
	vadd.f32 s2, s2, s3
	vstr s2, [r0, #20]
	vldr s2, [r0, #4]
	vldr s3, [ip, #108]
	vldr s4, [r0, #4]
	vmul.f32 s3, s3, s4
	vsub.f32 s2, s2, s3
	vstr s2, [r0, #4]
	vldr s2, [r0, #52]
	vldr s3, [ip, #112]
	vmul.f32 s2, s2, s3
	vstr s2, [r0, #52]
	vstr s1, [r0, #88]
	vstr s0, [r0, #84]
	vldr s0, [r0, #48]
	vldr s1, [ip, #116]
	vmul.f32 s0, s0, s1
	vstr s0, [r0, #48]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	vpop {s16-s17}
	pop.w {r4-r5}
	bx lr
	.balign 4
.Ljoint_drive_pass_table:
	.word 0x3f800000 @ 1.0
	.word 0x42480000 @ 50.0
	.word 0x43f5dd20 @ 491.72754
	.word 0x3f6c4815 @ 0.9229749
	.word 0x3a7c1fef @ 0.00096177956
	.word 0x46170c19 @ 9667.024
	.word 0x3975dd20 @ 0.00023447396
	.word 0x459c4d13 @ 5001.6343
	.word 0x4838b45c @ 189137.44
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x3a830d1a @ 0.0009998411
	.word 0x3502cfaf @ 4.8730993e-7
	.word 0x2f33c5ab @ 1.6350181e-10
	.word 0x3f7feabe @ 0.99967563
	.word 0x42208591 @ 40.130436
	.word 0x3f000000 @ 0.5
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.word 0x00000000 @ 0.0
	.word 0x3fc90fdb @ 1.5707964
	.word 0x362e7949 @ 2.5998618e-6
	.word 0xb94fafbf @ -0.00019806529
	.word 0x3c088734 @ 0.008333016
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x35063423 @ 4.999476e-7
	.word 0x2f373cd5 @ 1.6665365e-10
	.word 0x3a83126f @ 0.001
	.word 0x3c230606 @ 0.009950167
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x3f7befc5 @ 0.98412734
	.size joint_drive_pass, .-joint_drive_pass

	.section .text.joint_drive_follow, "ax", %progbits
	.balign 8
	.global joint_drive_follow
	.type joint_drive_follow, %function
	.thumb_func
joint_drive_follow:
	push.w {r4-r11}
	movw ip, #:lower16:.Ljoint_drive_follow_table
	movt ip, #:upper16:.Ljoint_drive_follow_table
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #72]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [ip, #4]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Ljoint_drive_follow_1
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_follow_1:
	vldr s1, [r0, #28]
	vldr s2, [ip, #8]
	vldr s3, [ip, #12]
	ldr.w r5, [r0, #76]
	ldr.w r6, [ip, #16]
	sub.w r7, r5, r6
	add.w r8, r5, r6
	vldr s4, [ip, #20]
	vcmp.f32 s0, s4
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	cmp.w r10, #0
	mov.w r9, r8
	it ne
	movne.w r9, r7
	sbfx r7, r9, #0, #23
	sub.w r5, r7, r5
	vmov s0, r5
	vcvt.f32.s32 s0, s0
	vmul.f32 s0, s3, s0
	vmul.f32 s0, s2, s0
	vadd.f32 s0, s1, s0
	vstr s0, [r0, #28]
	vldr s0, [r0, #8]
	vldr s1, [ip, #24]
	vldr s2, [ip, #0]
	sub.w r5, r4, r6
	add.w r6, r4, r6
	cmp.w r10, #0
	mov.w r8, r6
	it ne
	movne.w r8, r5
	sbfx r5, r8, #0, #23
	sub.w r4, r5, r4
	vmov s3, r4
	vcvt.f32.s32 s3, s3
	vmul.f32 s2, s2, s3
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vstr s0, [r0, #8]
	ldr.w r4, [r0, #80]
	ldr.w r6, [ip, #28]
	add.w r8, r4, r6
	sub.w r4, r4, r6
	cmp.w r10, #0
	mov.w r6, r4
	it ne
	movne.w r6, r8
	str.w r6, [r0, #80]
	str.w r7, [r0, #76]
	str.w r5, [r0, #72]
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_follow_table:
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x406231d6 @ 3.5342917
	.word 0x45970c19 @ 4833.512
	.word 0x3975dd20 @ 0.00023447396
	.word 0x00100000 @ 1.469368e-39
	.word 0x00000000 @ 0.0
	.word 0x41a08591 @ 20.065218
	.word 0x00000001 @ 1e-45
	.size joint_drive_follow, .-joint_drive_follow

	.section .text.joint_drive_carry, "ax", %progbits
	.balign 8
	.global joint_drive_carry
	.type joint_drive_carry, %function
	.thumb_func
joint_drive_carry:
	push.w {r4-r11}
	movw ip, #:lower16:.Ljoint_drive_carry_table
	movt ip, #:upper16:.Ljoint_drive_carry_table
	vldr s0, [r0, #32]
	vabs.f32 s0, s0
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r4, #1
	movhi.w r4, #0
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	orr.w r4, r4, r5
	cmp.w r4, #0
	beq.w .Ljoint_drive_carry_1
	ldr.w r4, [r0, #72]
	ldr.w r5, [ip, #8]
	add.w r6, r4, r5
	sub.w r7, r4, r5
	vldr s0, [r0, #12]
	vldr s1, [ip, #12]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	cmp.w r9, #0
	mov.w r8, r7
	it ne
	movne.w r8, r6
	vldr s0, [r0, #12]
	vabs.f32 s0, s0
	vldr s1, [ip, #16]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	vldr s1, [ip, #20]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	orr.w r7, r7, r10
	cmp.w r7, #0
	mov.w r6, r8
	it ne
	movne.w r6, r4
	str.w r6, [r0, #72]
	ldr.w r4, [r0, #64]
	add.w r6, r4, r5
	sub.w r5, r4, r5
	cmp.w r9, #0
	mov.w r8, r5
	it ne
	movne.w r8, r6
	cmp.w r7, #0
	mov.w r5, r8
	it ne
	movne.w r5, r4
	str.w r5, [r0, #64]
	vldr s0, [r0, #12]
	vldr s1, [r0, #12]
	vldr s2, [ip, #16]
	vsub.f32 s1, s1, s2
	vldr s2, [r0, #12]
	vldr s3, [ip, #16]
	vadd.f32 s2, s2, s3
	cmp.w r9, #0
	vmov.f32 s3, s2
	it ne
	vmovne.f32 s3, s1
	cmp.w r7, #0
	vmov.f32 s1, s3
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_carry_1:
	vldr s0, [r0, #32]
	vldr s1, [ip, #12]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	cmp.w r4, #0
	beq.w .Ljoint_drive_carry_2
	ldr.w r4, [r0, #72]
	ldr.w r5, [ip, #8]
	add.w r6, r4, r5
	sub.w r7, r4, r5
	vldr s0, [r0, #12]
	vldr s1, [ip, #12]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	cmp.w r9, #0
	mov.w r8, r7
	it ne
	movne.w r8, r6
	vldr s0, [r0, #12]
	vabs.f32 s0, s0
	vldr s1, [ip, #16]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	vldr s1, [ip, #20]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	orr.w r7, r7, r10
	cmp.w r7, #0
	mov.w r6, r8
	it ne
	movne.w r6, r4
	str.w r6, [r0, #72]
	ldr.w r4, [r0, #64]
	add.w r6, r4, r5
	sub.w r8, r4, r5
	cmp.w r9, #0
	mov.w r10, r8
	it ne
	movne.w r10, r6
	cmp.w r7, #0
	mov.w r6, r10
	it ne
	movne.w r6, r4
	str.w r6, [r0, #64]
	vldr s0, [r0, #32]
	vldr s1, [ip, #0]
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [r0, #12]
	vldr s1, [r0, #12]
	vldr s2, [ip, #16]
	vsub.f32 s1, s1, s2
	vldr s2, [r0, #12]
	vldr s3, [ip, #16]
	vadd.f32 s2, s2, s3
	cmp.w r9, #0
	vmov.f32 s3, s2
	it ne
	vmovne.f32 s3, s1
	cmp.w r7, #0
	vmov.f32 s1, s3
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	ldr.w r4, [r0, #76]
	add.w r4, r4, r5
	str.w r4, [r0, #76]
	ldr.w r4, [r0, #68]
	add.w r4, r4, r5
	str.w r4, [r0, #68]
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_carry_2:
	ldr.w r4, [r0, #72]
	ldr.w r5, [ip, #8]
	add.w r6, r4, r5
	sub.w r7, r4, r5
	vldr s0, [r0, #12]
	vldr s1, [ip, #12]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	cmp.w r9, #0
	mov.w r8, r7
	it ne
	movne.w r8, r6
	vldr s0, [r0, #12]
	vabs.f32 s0, s0
	vldr s1, [ip, #16]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	vldr s1, [ip, #20]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	orr.w r7, r7, r10
	cmp.w r7, #0
	mov.w r6, r8
	it ne
	movne.w r6, r4
	str.w r6, [r0, #72]
	ldr.w r4, [r0, #64]
	add.w r6, r4, r5
	sub.w r8, r4, r5
	cmp.w r9, #0
	mov.w r10, r8
	it ne
	movne.w r10, r6
	cmp.w r7, #0
	mov.w r6, r10
	it ne
	movne.w r6, r4
	str.w r6, [r0, #64]
	vldr s0, [r0, #32]
	vldr s1, [ip, #0]
	vadd.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [r0, #12]
	vldr s1, [r0, #12]
	vldr s2, [ip, #16]
	vsub.f32 s1, s1, s2
	vldr s2, [r0, #12]
	vldr s3, [ip, #16]
	vadd.f32 s2, s2, s3
	cmp.w r9, #0
	vmov.f32 s3, s2
	it ne
	vmovne.f32 s3, s1
	cmp.w r7, #0
	vmov.f32 s1, s3
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	ldr.w r4, [r0, #76]
	sub.w r4, r4, r5
	str.w r4, [r0, #76]
	ldr.w r4, [r0, #68]
	sub.w r4, r4, r5
	str.w r4, [r0, #68]
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_carry_table:
	.word 0x4275dd20 @ 61.465942
	.word 0x42f5dd20 @ 122.931885
	.word 0x00040000 @ 3.67342e-40
	.word 0x00000000 @ 0.0
	.word 0x3fc90fdb @ 1.5707964
	.word 0x40490fdb @ 3.1415927
	.size joint_drive_carry, .-joint_drive_carry

	.section .text.joint_drive_start, "ax", %progbits
	.balign 8
	.global joint_drive_start
	.type joint_drive_start, %function
	.thumb_func
joint_drive_start:
	push.w {r4-r11}
	sub.w sp, sp, #8
	movw ip, #:lower16:.Ljoint_drive_start_table
	movt ip, #:upper16:.Ljoint_drive_start_table
	ldrb.w r4, [r1, #8]
	ldrb.w r5, [r1, #9]
	orr.w r4, r4, r5
	cmp.w r4, #0
	beq.w .Ljoint_drive_start_1
	mov.w r0, #0
	add.w sp, sp, #8
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_start_1:
	vldr s0, [ip, #0]
	vldr s1, [ip, #4]
	ldr.w r4, [r1, #4]
	sbfx r5, r4, #0, #20
	ldr.w r6, [r1, #0]
	sbfx r7, r6, #0, #20
	ldr.w r9, [ip, #8]
	sdiv r8, r7, r9
	ldr.w r9, [ip, #8]
	mul r8, r8, r9
	sub.w r5, r5, r8
	sbfx r5, r5, #0, #23
	vmov s2, r5
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [ip, #12]
	vldr s3, [ip, #16]
	sub.w r8, r7, r8
	sbfx r8, r8, #0, #23
	vmov s4, r8
	vcvt.f32.s32 s4, s4
	vmul.f32 s3, s3, s4
	vmul.f32 s2, s2, s3
	vsub.f32 s2, s1, s2
	vmul.f32 s0, s0, s2
	vabs.f32 s0, s0
	vldr s4, [ip, #20]
	vcmp.f32 s0, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r9, #1
	movhi.w r9, #0
	cmp.w r9, #0
	beq.w .Ljoint_drive_start_2
	vldr s0, [ip, #24]
	vldr s4, [ip, #28]
	vabs.f32 s5, s3
	vsub.f32 s4, s4, s5
	vldr s6, [ip, #32]
	vadd.f32 s4, s4, s6
	vneg.f32 s6, s4
	vldr s7, [ip, #36]
	vcmp.f32 s3, s7
	vmrs APSR_nzcv, fpscr
	vmov.f32 s7, s4
	it mi
	vmovmi.f32 s7, s6
	vldr s4, [ip, #40]
	vcmp.f32 s5, s4
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	cmp.w r9, #0
	vmov.f32 s4, s3
	it ne
	vmovne.f32 s4, s7
	vmul.f32 s0, s0, s4
	vmul.f32 s4, s4, s4
	vldr s5, [ip, #44]
	vmul.f32 s5, s5, s4
	vldr s6, [ip, #48]
	vadd.f32 s5, s5, s6
	vmul.f32 s5, s5, s4
	vldr s6, [ip, #52]
	vadd.f32 s5, s5, s6
	vmul.f32 s5, s5, s4
	vldr s6, [ip, #56]
	vadd.f32 s5, s5, s6
	vmul.f32 s5, s4, s5
	vmul.f32 s5, s0, s5
	vadd.f32 s0, s0, s5
	vsub.f32 s2, s2, s0
	vldr s5, [r1, #24]
	vsub.f32 s5, s2, s5
	vabs.f32 s6, s5
	vldr s7, [ip, #60]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r10, #1
	movhi.w r10, #0
	vldr s6, [ip, #36]
	vldr s7, [ip, #12]
	vldr s8, [ip, #64]
	vldr s9, [ip, #24]
	cmp.w r9, #0
	it ne
	vmovne.f32 s9, s8
	vldr s8, [ip, #68]
	vmul.f32 s8, s8, s4
	vldr s10, [ip, #72]
	vadd.f32 s8, s8, s10
	vmul.f32 s8, s8, s4
	vldr s10, [ip, #76]
	vadd.f32 s8, s8, s10
	vmul.f32 s8, s8, s4
	vldr s10, [ip, #80]
	vadd.f32 s8, s8, s10
	vmul.f32 s4, s4, s8
	vmul.f32 s4, s9, s4
	vadd.f32 s4, s9, s4
	vadd.f32 s4, s7, s4
	vneg.f32 s4, s4
	vldr s7, [ip, #36]
	vmul.f32 s4, s4, s7
	vadd.f32 s4, s6, s4
	vldr s6, [ip, #84]
	vmul.f32 s2, s6, s2
	vsub.f32 s2, s4, s2
	vldr s4, [r1, #28]
	vsub.f32 s2, s2, s4
	vabs.f32 s4, s2
	vldr s6, [ip, #60]
	vcmp.f32 s4, s6
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r9, #1
	movhi.w r9, #0
	and.w r9, r10, r9
	vldr s4, [ip, #36]
	vldr s6, [r1, #20]
	vsub.f32 s4, s4, s6
	vabs.f32 s6, s4
	vldr s7, [ip, #60]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r10, #1
	movhi.w r10, #0
	and.w r9, r9, r10
	vldr s6, [ip, #88]
	ldr.w r10, [r1, #12]
	ldr.w r11, [ip, #36]
	str.w r4, [sp, #0]
	ldr.w r4, [ip, #8]
	sdiv r7, r7, r4
	add.w r4, r11, r7
	sub.w r7, r10, r4
	vmov s7, r7
	vcvt.f32.s32 s7, s7
	vmul.f32 s6, s6, s7
	vldr s7, [r1, #16]
	vadd.f32 s6, s6, s7
	vsub.f32 s6, s3, s6
	vabs.f32 s7, s6
	vldr s8, [ip, #60]
	vcmp.f32 s7, s8
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	and.w r7, r9, r7
	cmp.w r7, #0
	beq.w .Ljoint_drive_start_3
	vldr s8, [ip, #92]
	vldr s9, [ip, #96]
	vldr s10, [ip, #100]
	vldr s11, [ip, #104]
	vldr s12, [ip, #96]
	vsub.f32 s12, s7, s12
	vldr s13, [ip, #108]
	vadd.f32 s13, s12, s13
	vldr s14, [ip, #108]
	vsub.f32 s14, s12, s14
	vabs.f32 s14, s14
	vsub.f32 s13, s13, s14
	vmul.f32 s11, s11, s13
	vmul.f32 s10, s10, s11
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #112]
	vldr s13, [ip, #104]
	vsub.f32 s11, s12, s11
	vldr s12, [ip, #116]
	vadd.f32 s12, s11, s12
	vldr s14, [ip, #116]
	vsub.f32 s14, s11, s14
	vabs.f32 s14, s14
	vsub.f32 s12, s12, s14
	vmul.f32 s12, s13, s12
	vmul.f32 s10, s10, s12
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #120]
	vldr s13, [ip, #104]
	vsub.f32 s11, s11, s12
	vldr s12, [ip, #124]
	vadd.f32 s12, s11, s12
	vldr s14, [ip, #124]
	vsub.f32 s14, s11, s14
	vabs.f32 s14, s14
	vsub.f32 s12, s12, s14
	vmul.f32 s12, s13, s12
	vmul.f32 s10, s10, s12
	vadd.f32 s9, s9, s10
	vldr s10, [ip, #128]
	vldr s13, [ip, #104]
	vsub.f32 s11, s11, s12
	vldr s12, [ip, #132]
	vadd.f32 s12, s11, s12
	vldr s14, [ip, #132]
	vsub.f32 s11, s11, s14
	vabs.f32 s11, s11
	vsub.f32 s11, s12, s11
	vmul.f32 s11, s13, s11
	vmul.f32 s10, s10, s11
	vadd.f32 s9, s9, s10
	vneg.f32 s10, s9
	vldr s11, [ip, #36]
	vcmp.f32 s6, s11
	vmrs APSR_nzcv, fpscr
	vmov.f32 s11, s10
	it gt
	vmovgt.f32 s11, s9
	vldr s9, [ip, #96]
	vcmp.f32 s7, s9
	vmrs APSR_nzcv, fpscr
	vmov.f32 s7, s11
	it ls
	vmovls.f32 s7, s6
	vmul.f32 s6, s8, s7
	vadd.f32 s2, s2, s6
	vldr s6, [ip, #136]
	vmul.f32 s4, s6, s4
	vadd.f32 s2, s2, s4
	vldr s4, [ip, #140]
	vmul.f32 s4, s4, s5
	vadd.f32 s2, s2, s4
	vldr s4, [ip, #36]
	vadd.f32 s2, s2, s4
	vldr s4, [ip, #36]
	vadd.f32 s2, s2, s4
	vabs.f32 s4, s2
	vldr s5, [ip, #60]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	ldrb.w r9, [r0, #101]
	orr.w r9, r9, r7
	strb.w r9, [r0, #101]
	vldr s4, [ip, #144]
	vldr s5, [r0, #60]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s4
	vstr s5, [r0, #60]
	vldr s4, [ip, #148]
	vldr s5, [r0, #56]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s4
	vstr s5, [r0, #56]
	vldr s4, [ip, #36]
	vldr s5, [r0, #0]
	cmp.w r7, #0
	it ne
	vmovne.f32 s5, s4
	vstr s5, [r0, #0]
	vldr s4, [r0, #4]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #4]
	vldr s2, [ip, #36]
	vldr s4, [r0, #52]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #52]
	vldr s2, [ip, #36]
	vldr s4, [r0, #96]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #96]
	vldr s2, [ip, #36]
	vldr s4, [r0, #92]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #92]
	vldr s2, [ip, #36]
	vldr s4, [r0, #88]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #88]
	vldr s2, [ip, #36]
	vldr s4, [r0, #84]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #84]
	vldr s2, [ip, #152]
	vldr s4, [r0, #48]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #48]
	vldr s2, [ip, #36]
	vldr s4, [r0, #44]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #44]
	vldr s2, [ip, #36]
	vldr s4, [r0, #40]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #40]
	vldr s2, [ip, #36]
	vldr s4, [r0, #36]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #36]
	vldr s2, [ip, #36]
	vldr s4, [r0, #32]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #32]
	vldr s2, [ip, #36]
	vldr s4, [r0, #24]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #24]
	vldr s2, [ip, #36]
	vldr s4, [r0, #20]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #20]
	vldr s2, [ip, #36]
	vldr s4, [r0, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #16]
	vldr s2, [ip, #36]
	vldr s4, [r0, #12]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #12]
	vldr s2, [ip, #156]
	vmul.f32 s2, s2, s3
	vldr s4, [r0, #28]
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vstr s4, [r0, #28]
	vldr s2, [ip, #104]
	vldr s4, [ip, #24]
	vmul.f32 s3, s4, s3
	vsub.f32 s0, s3, s0
	vadd.f32 s0, s1, s0
	vmul.f32 s0, s2, s0
	vldr s1, [r0, #8]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	ldr.w r9, [r0, #80]
	cmp.w r7, #0
	mov.w r10, r9
	it ne
	movne.w r10, r4
	str.w r10, [r0, #80]
	ldr.w r4, [r0, #76]
	cmp.w r7, #0
	mov.w r9, r4
	it ne
	movne.w r9, r5
	str.w r9, [r0, #76]
	ldr.w r4, [r0, #72]
	cmp.w r7, #0
	mov.w r5, r4
	it ne
	movne.w r5, r8
	str.w r5, [r0, #72]
	ldr.w r4, [sp, #0]
	ldr.w r5, [r0, #68]
	cmp.w r7, #0
	mov.w r8, r5
	it ne
	movne.w r8, r4
	str.w r8, [r0, #68]
	ldr.w r4, [r0, #64]
	cmp.w r7, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	str.w r5, [r0, #64]
	ldrb.w r4, [r0, #100]
	orr.w r4, r4, r7
	strb.w r4, [r0, #100]
	mov.w r0, #0
	cmp.w r7, #0
	it ne
	orrne.w r0, r0, #1
	add.w sp, sp, #8
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_start_3:
	mov.w r0, #0
	add.w sp, sp, #8
	pop.w {r4-r11}
	bx lr
.Ljoint_drive_start_2:
	mov.w r0, #0
	add.w sp, sp, #8
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_start_table:
	.word 0x46170c19 @ 9667.024
	.word 0x3975dd20 @ 0.00023447396
	.word 0x00100000 @ 1.469368e-39
	.word 0x421c8591 @ 39.130436
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x48928842 @ 300098.06
	.word 0x3f800000 @ 1.0
	.word 0x40490fdb @ 3.1415927
	.word 0xb3bbbd2e @ -8.742278e-8
	.word 0x00000000 @ 0.0
	.word 0x3fc90fdb @ 1.5707964
	.word 0x362e7949 @ 2.5998618e-6
	.word 0xb94fafbf @ -0.00019806529
	.word 0x3c088734 @ 0.008333016
	.word 0xbe2aaaa4 @ -0.16666657
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xbf800000 @ -1.0
	.word 0x37c28d4e @ 2.3192402e-5
	.word 0xbab59c80 @ -0.0013855845
	.word 0x3d2aa7d9 @ 0.04166398
	.word 0xbeffffe9 @ -0.4999993
	.word 0x3e9bd37a @ 0.3043478
	.word 0x40c90fdb @ 6.2831855
	.word 0x45fa0000 @ 8000.0
	.word 0x3e764a8d @ 0.24051876
	.word 0x3eaaaaab @ 0.33333334
	.word 0x3f000000 @ 0.5
	.word 0x3f38b7ea @ 0.7215563
	.word 0x3e2aaaab @ 0.16666667
	.word 0x4038b7ea @ 2.8862252
	.word 0x3daaaaab @ 0.083333336
	.word 0x4138b7ea @ 11.544901
	.word 0x3d2aaaab @ 0.041666668
	.word 0x4238b7ea @ 46.179604
	.word 0x44960000 @ 1200.0
	.word 0x42700000 @ 60.0
	.word 0x7149f2ca @ 1e30
	.word 0x41f00000 @ 30.0
	.word 0x42f5dd20 @ 122.931885
	.word 0x4838b45c @ 189137.44
	.size joint_drive_start, .-joint_drive_start

	.section .text.joint_drive_not_started, "ax", %progbits
	.balign 8
	.global joint_drive_not_started
	.type joint_drive_not_started, %function
	.thumb_func
joint_drive_not_started:
	movw ip, #:lower16:.Ljoint_drive_not_started_table
	movt ip, #:upper16:.Ljoint_drive_not_started_table
	vldr s0, [ip, #0]
	vstr s0, [r0, #8]
	vldr s0, [ip, #0]
	vstr s0, [r0, #4]
	vldr s0, [ip, #0]
	vstr s0, [r0, #0]
	movw r0, #257
	bx lr
	.balign 4
.Ljoint_drive_not_started_table:
	.word 0x00000000 @ 0.0
	.size joint_drive_not_started, .-joint_drive_not_started

	.section .text.joint_drive_report_applied, "ax", %progbits
	.balign 8
	.global joint_drive_report_applied
	.type joint_drive_report_applied, %function
	.thumb_func
joint_drive_report_applied:
	push.w {r4-r11}
	movw ip, #:lower16:.Ljoint_drive_report_applied_table
	movt ip, #:upper16:.Ljoint_drive_report_applied_table
	ldrb.w r4, [r0, #101]
	vabs.f32 s1, s0
	vldr s2, [ip, #0]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r6, r4, r5
	vldr s2, [ip, #4]
	vldr s3, [r0, #0]
	vabs.f32 s3, s3
	vsub.f32 s3, s3, s1
	vldr s4, [ip, #8]
	vldr s5, [r0, #56]
	vmul.f32 s4, s4, s5
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r7, #1
	movle.w r7, #0
	vldr s4, [ip, #12]
	vmul.f32 s4, s4, s1
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r8, #1
	movle.w r8, #0
	and.w r9, r7, r8
	cmp.w r9, #0
	it ne
	vmovne.f32 s2, s1
	vldr s3, [r0, #60]
	vldr s4, [r0, #60]
	vldr s5, [ip, #16]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	ite ge
	movge.w r9, #1
	movlt.w r9, #0
	and.w r10, r5, r9
	and.w r10, r10, r4
	cmp.w r10, #0
	it ne
	vmovne.f32 s3, s2
	vldr s2, [r0, #56]
	vldr s4, [r0, #60]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	ite eq
	moveq.w r10, #1
	movne.w r10, #0
	and.w r8, r8, r10
	and.w r7, r8, r7
	and.w r7, r7, r9
	and.w r5, r7, r5
	and.w r4, r5, r4
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #56]
	vstr s3, [r0, #60]
	vldr s1, [r0, #0]
	cmp.w r6, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	mov.w r0, #0
	cmp.w r6, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r11}
	bx lr
	.balign 4
.Ljoint_drive_report_applied_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x7149f2ca @ 1e30
	.word 0x3d000000 @ 0.03125
	.word 0x3e800000 @ 0.25
	.word 0x00000000 @ 0.0
	.size joint_drive_report_applied, .-joint_drive_report_applied

	.section .text.joint_drive_estimates, "ax", %progbits
	.balign 8
	.global joint_drive_estimates
	.type joint_drive_estimates, %function
	.thumb_func
joint_drive_estimates:
	push.w {r4-r5}
	movw ip, #:lower16:.Ljoint_drive_estimates_table
	movt ip, #:upper16:.Ljoint_drive_estimates_table
	ldrb.w r4, [r0, #101]
	cmp.w r4, #0
	beq.w .Ljoint_drive_estimates_1
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #76]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #32]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #20]
	vldr s0, [ip, #8]
	ldr.w r4, [r0, #72]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #12]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #12]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #4]
	vldr s0, [ip, #16]
	vldr s1, [r0, #40]
	vldr s2, [ip, #4]
	vdiv.f32 s1, s1, s2
	vmul.f32 s0, s0, s1
	vstr s0, [r1, #32]
	vstr s1, [r1, #28]
	vldr s0, [r0, #36]
	vldr s1, [ip, #4]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #24]
	vldr s0, [ip, #20]
	vldr s1, [r0, #20]
	vldr s2, [ip, #12]
	vdiv.f32 s1, s1, s2
	vmul.f32 s0, s0, s1
	vstr s0, [r1, #16]
	vstr s1, [r1, #12]
	vldr s0, [r0, #16]
	vldr s1, [ip, #12]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #8]
	ldr.w r4, [r0, #80]
	str.w r4, [r1, #0]
	mov.w r0, #1
	pop.w {r4-r5}
	bx lr
.Ljoint_drive_estimates_1:
	vldr s0, [ip, #24]
	vstr s0, [r1, #32]
	vldr s0, [ip, #24]
	vstr s0, [r1, #28]
	vldr s0, [ip, #24]
	vstr s0, [r1, #24]
	vldr s0, [ip, #24]
	vstr s0, [r1, #20]
	vldr s0, [ip, #24]
	vstr s0, [r1, #16]
	vldr s0, [ip, #24]
	vstr s0, [r1, #12]
	vldr s0, [ip, #24]
	vstr s0, [r1, #8]
	vldr s0, [ip, #24]
	vstr s0, [r1, #4]
	ldr.w r4, [ip, #24]
	str.w r4, [r1, #0]
	mov.w r0, #0
	pop.w {r4-r5}
	bx lr
	.balign 4
.Ljoint_drive_estimates_table:
	.word 0x3975dd20 @ 0.00023447396
	.word 0x421c8591 @ 39.130436
	.word 0x36c90fdb @ 5.9921126e-6
	.word 0x3f800000 @ 1.0
	.word 0xba740e5a @ -0.000931
	.word 0xbe6b851f @ -0.23
	.word 0x00000000 @ 0.0
	.size joint_drive_estimates, .-joint_drive_estimates

	.section .text.joint_drive_reset, "ax", %progbits
	.balign 8
	.global joint_drive_reset
	.type joint_drive_reset, %function
	.thumb_func
joint_drive_reset:
	push.w {r4-r7}
	movw ip, #:lower16:.Ljoint_drive_reset_table
	movt ip, #:upper16:.Ljoint_drive_reset_table
	vldr s0, [ip, #0]
	vldr s1, [r0, #60]
	ldrb.w r4, [r0, #101]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #60]
	vldr s0, [ip, #0]
	vldr s1, [r0, #56]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #56]
	vldr s0, [ip, #0]
	vldr s1, [r0, #0]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	vldr s0, [ip, #0]
	vldr s1, [r0, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	vldr s0, [ip, #0]
	vldr s1, [r0, #52]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #52]
	vldr s0, [ip, #0]
	vldr s1, [r0, #96]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #96]
	vldr s0, [ip, #0]
	vldr s1, [r0, #92]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #92]
	vldr s0, [ip, #0]
	vldr s1, [r0, #88]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #88]
	vldr s0, [ip, #0]
	vldr s1, [r0, #84]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #84]
	vldr s0, [ip, #0]
	vldr s1, [r0, #48]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #48]
	vldr s0, [ip, #0]
	vldr s1, [r0, #44]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #44]
	vldr s0, [ip, #0]
	vldr s1, [r0, #40]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #40]
	vldr s0, [ip, #0]
	vldr s1, [r0, #36]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #36]
	vldr s0, [ip, #0]
	vldr s1, [r0, #32]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #32]
	vldr s0, [ip, #0]
	vldr s1, [r0, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #24]
	vldr s0, [ip, #0]
	vldr s1, [r0, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [ip, #0]
	vldr s1, [r0, #16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #16]
	vldr s0, [ip, #0]
	vldr s1, [r0, #12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	vldr s0, [ip, #0]
	vldr s1, [r0, #28]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #28]
	vldr s0, [ip, #0]
	vldr s1, [r0, #8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	ldr.w r5, [ip, #0]
	ldr.w r6, [r0, #80]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #80]
	ldr.w r6, [r0, #76]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #76]
	ldr.w r6, [r0, #72]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #72]
	ldr.w r6, [r0, #68]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #68]
	ldr.w r6, [r0, #64]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #64]
	eor.w r4, r4, #1
	ldrb.w r5, [r0, #100]
	and.w r4, r4, r5
	strb.w r4, [r0, #100]
	mov.w r4, #0
	strb.w r4, [r0, #101]
	pop.w {r4-r7}
	bx lr
	.balign 4
.Ljoint_drive_reset_table:
	.word 0x00000000 @ 0.0
	.size joint_drive_reset, .-joint_drive_reset
