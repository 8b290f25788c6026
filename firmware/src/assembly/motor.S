@ The functions of motor.h, exported by version 0.1.0.
@ Design 0x177f7306 (FNV-1a; `design_hash` in the run.json of a run).
@ Changed by --set drive.period_s=1e-3
@ Changed by --set drive.gain_sets=1
@ Scenario motor.toml (CRC-32 0xd1774fd8):
@
@     # What the image `motor` is designed from: a motor with one encoder, at 5 kHz.
@     #
@     #     cargo run --release -- live firmware/motor.toml --image firmware/target/thumbv7em-none-eabihf/release/motor
@     #
@     # The drive as assembly is that of 1 kHz with one gain set, as it is measured everywhere (src/bin/budget.rs):
@     #     host-sim export motor.toml --asm --prefix motor -o src/assembly/motor.S --force \
@     #         --set drive.period_s=1e-3 --set drive.gain_sets=1
@
@     title = "The motor of the image `motor`"
@
@     [motor]
@     inertia_kg_m2 = 2e-4
@     torque_n_m_per_a = 0.05
@     max_current_a = 10.0
@     damping_n_m_s = 1e-5
@
@     [encoder]
@     bits = 14
@
@     [drive]
@     period_s = 2e-4
@     fallback = 0.0
@
@     [monitor]
@     reaction = "brake"

	.syntax unified
	.cpu cortex-m4
	.fpu fpv4-sp-d16
	.thumb

	.section .text.motor_tick_u, "ax", %progbits
	.balign 8
	.global motor_tick_u
	.type motor_tick_u, %function
	.thumb_func
motor_tick_u:
	ldrb.w ip, [r0, #56]
	ldrb.w r3, [r1, #4]
	orrs.w ip, ip, r3
	bne.w .Lmotor_tick_u_rest
	ldr.w ip, [r1, #8]
	ldr.w r3, [r0, #44]
	sub.w ip, ip, r3
	vmov s13, ip
	ldr.w ip, [r1, #0]
	ldr.w r3, [r0, #36]
	ldr.w r2, [r0, #40]
	sub.w r3, ip, r3
	sbfx r3, r3, #0, #14
	add.w r2, r2, r3
	vmov s14, s15, r3, r2
	add.w r1, r1, #12
	adr.w r3, .Lmotor_tick_u_table
	vldmia r0!, {s5-s12}
	vldmia r3!, {s0-s4}
	vmul.f32 s0, s0, s5
	vcvt.f32.s32 s14, s14
	vadd.f32 s0, s8, s0
	vcvt.f32.s32 s15, s15
	vmul.f32 s5, s1, s7
	vmul.f32 s15, s2, s15
	vmul.f32 s7, s3, s7
	vmul.f32 s4, s4, s0
	vmul.f32 s3, s1, s0
	vadd.f32 s4, s5, s4
	vmul.f32 s14, s2, s14
	vadd.f32 s0, s6, s4
	vcvt.f32.s32 s13, s13
	vadd.f32 s7, s7, s3
	vsub.f32 s14, s0, s14
	vldmia r3!, {s2-s6}
	vmul.f32 s2, s2, s14
	vmul.f32 s3, s3, s14
	vabs.f32 s0, s14
	vsub.f32 s1, s14, s3
	vadd.f32 s3, s4, s9
	vmul.f32 s5, s5, s14
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_32_12
	vmul.f32 s13, s6, s13
	vsub.f32 s2, s7, s2
	vadd.f32 s14, s15, s1
	vldmia r1!, {s6-s7}
	vsub.f32 s3, s8, s5
	vsub.f32 s0, s2, s7
	vadd.f32 s13, s13, s6
	vldmia r1!, {s4-s6}
	vsub.f32 s14, s14, s13
	vabs.f32 s13, s15
	vsub.f32 s15, s6, s7
	vldmia r3!, {s4-s8}
	vmul.f32 s4, s4, s2
	vmul.f32 s15, s5, s15
	vadd.f32 s4, s4, s3
	vcmp.f32 s13, s6
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_32_32
	vmul.f32 s7, s7, s14
	vldmia r0!, {s13}
	vmul.f32 s8, s8, s4
	vldmia r3!, {s4-s6}
	vmul.f32 s4, s4, s0
	vneg.f32 s8, s8
	vadd.f32 s8, s8, s4
	vabs.f32 s14, s14
	vmul.f32 s5, s10, s5
	vadd.f32 s15, s8, s15
	vadd.f32 s0, s0, s7
	vmul.f32 s4, s9, s6
	vldmia r3!, {s6-s10}
	vmul.f32 s6, s6, s13
	vmul.f32 s0, s7, s0
	vadd.f32 s15, s15, s6
	vcmp.f32 s14, s8
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_36_32
	vmul.f32 s9, s9, s13
	vabs.f32 s14, s11
	vsub.f32 s8, s13, s9
	vadd.f32 s0, s15, s0
	vmov.f32 s6, s11
	vabs.f32 s9, s0
	vmov.f32 s15, #10.0
	vcmp.f32 s15, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_36_32
	vcmp.f32 s9, s10
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_36_32
	vmov.f32 s7, #-10.0
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s15
	vcmp.f32 s0, s7
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s7
	vmov.f32 s7, s12
	vstmdb r0!, {s0-s8}
	str.w ip, [r0, #36]
	str.w r2, [r0, #40]
	mov.w ip, #0
	str.w ip, [r0, #48]
	bx lr
.Lmotor_tick_u_away_32_12:
	sub.w r0, r0, #32
	sub.w r1, r1, #12
	b.w .Lmotor_tick_u_leave
.Lmotor_tick_u_away_32_32:
	sub.w r0, r0, #32
	sub.w r1, r1, #32
	b.w .Lmotor_tick_u_leave
.Lmotor_tick_u_away_36_32:
	sub.w r0, r0, #36
	sub.w r1, r1, #32
	b.w .Lmotor_tick_u_leave
.Lmotor_tick_u_leave:
.Lmotor_tick_u_rest:
	push {r4, lr}
	sub.w sp, sp, #16
	mov r2, sp
	bl motor_rest
	vldr s0, [sp]
	add.w sp, sp, #16
	pop {r4, pc}
	.balign 4
.Lmotor_tick_u_table:
	.word 0x437a0000 @ 250.0
	.word 0x3a831198 @ 0.000999975
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x3506372a @ 4.9999164e-7
	.word 0x428a9a62 @ 69.30153
	.word 0x3ebb850f @ 0.36624953
	.word 0x3d939607 @ 0.0720635
	.word 0x45a4393b @ 5255.154
	.word 0x40c90fdb @ 6.2831855
	.word 0xbd4ccccd @ -0.05
	.word 0x408000d2 @ 4.0001
	.word 0x406231d6 @ 3.5342917
	.word 0x42fa0000 @ 125.0
	.word 0x3b83126f @ 0.004
	.word 0xbef0f274 @ -0.47059977
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x3f7693e9 @ 0.96319443
	.word 0x4062594d @ 3.5367005
	.word 0xc070f274 @ -3.7647982
	.word 0x3dc49ba6 @ 0.096
	.word 0x3d782a02 @ 0.060586937
	.word 0x45a00000 @ 5120.0
	.size motor_tick_u, .-motor_tick_u

	.section .text.motor_tick, "ax", %progbits
	.balign 8
	.global motor_tick
	.type motor_tick, %function
	.thumb_func
motor_tick:
	ldrb.w ip, [r0, #56]
	ldrb.w r3, [r1, #4]
	orrs.w ip, ip, r3
	bne.w .Lmotor_tick_rest
	push.w {r4-r5}
	ldr.w ip, [r1, #8]
	ldr.w r3, [r0, #44]
	sub.w ip, ip, r3
	vmov s13, ip
	ldr.w ip, [r1, #0]
	ldr.w r3, [r0, #36]
	ldr.w r4, [r0, #40]
	sub.w r3, ip, r3
	sbfx r3, r3, #0, #14
	add.w r4, r4, r3
	vmov s14, s15, r3, r4
	add.w r1, r1, #12
	adr.w r3, .Lmotor_tick_table
	mov.w r5, #0
	vldmia r3!, {s5-s12}
	vldmia r0!, {s0-s4}
	vmul.f32 s0, s5, s0
	vcvt.f32.s32 s13, s13
	vadd.f32 s5, s3, s0
	vcvt.f32.s32 s15, s15
	vmul.f32 s0, s6, s2
	vmul.f32 s15, s7, s15
	vmul.f32 s8, s8, s5
	vmul.f32 s9, s9, s13
	vadd.f32 s0, s0, s8
	vcvt.f32.s32 s14, s14
	vadd.f32 s0, s1, s0
	vmul.f32 s7, s7, s14
	vldmia r1!, {s13-s14}
	vsub.f32 s0, s0, s7
	vmul.f32 s8, s6, s5
	vabs.f32 s1, s15
	vadd.f32 s13, s9, s13
	vabs.f32 s9, s0
	vmul.f32 s10, s10, s0
	vmul.f32 s11, s11, s0
	vmul.f32 s12, s12, s2
	vldmia r3!, {s5-s7}
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_20_20
	vadd.f32 s6, s6, s4
	vsub.f32 s1, s0, s10
	vmul.f32 s10, s7, s0
	vadd.f32 s12, s12, s8
	vcmp.f32 s9, s6
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_20_20
	vadd.f32 s9, s15, s1
	vsub.f32 s2, s12, s11
	vsub.f32 s15, s9, s13
	vsub.f32 s3, s3, s10
	vldmia r1!, {s11-s13}
	vldmia r3!, {s6-s12}
	vmul.f32 s0, s6, s2
	vabs.f32 s5, s15
	vmul.f32 s15, s7, s15
	vadd.f32 s0, s0, s3
	vcmp.f32 s5, s8
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_20_32
	vmul.f32 s0, s9, s0
	vmul.f32 s4, s4, s10
	vsub.f32 s9, s2, s14
	vneg.f32 s10, s0
	vmul.f32 s11, s11, s9
	vldmia r0!, {s5-s8}
	vabs.f32 s0, s6
	vsub.f32 s14, s13, s14
	vadd.f32 s11, s10, s11
	vmul.f32 s14, s12, s14
	vadd.f32 s15, s9, s15
	vadd.f32 s9, s11, s14
	vldmia r3!, {s10-s14}
	vmul.f32 s10, s10, s15
	vmul.f32 s11, s11, s8
	vmul.f32 s12, s12, s8
	vmov.f32 s7, s7
	vadd.f32 s9, s9, s12
	vmul.f32 s5, s5, s13
	vadd.f32 s9, s9, s10
	vsub.f32 s10, s15, s8
	vmov.f32 s13, #10.0
	vcmp.f32 s13, s0
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_36_32
	vmov.f32 s6, s6
	vsub.f32 s8, s8, s11
	vabs.f32 s11, s9
	vcmp.f32 s11, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_36_32
	vmov.f32 s14, #-10.0
	vmov.f32 s0, s9
	vcmp.f32 s0, s13
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s13
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s14
	vcmp.f32 s0, s9
	vmrs APSR_nzcv, fpscr
	it ne
	addne r5, #2
	vstr s10, [r2, #8]
	vstr s0, [r2, #0]
	vstr s15, [r2, #4]
	vstmdb r0!, {s0-s8}
	str.w ip, [r0, #36]
	str.w r4, [r0, #40]
	mov.w ip, #0
	str.w ip, [r0, #48]
	mov.w r0, r5
	pop.w {r4-r5}
	bx lr
.Lmotor_tick_away_20_20:
	sub.w r0, r0, #20
	sub.w r1, r1, #20
	b.w .Lmotor_tick_leave
.Lmotor_tick_away_20_32:
	sub.w r0, r0, #20
	sub.w r1, r1, #32
	b.w .Lmotor_tick_leave
.Lmotor_tick_away_36_32:
	sub.w r0, r0, #36
	sub.w r1, r1, #32
	b.w .Lmotor_tick_leave
.Lmotor_tick_leave:
	pop.w {r4-r5}
.Lmotor_tick_rest:
	b.w motor_rest
	.balign 4
.Lmotor_tick_table:
	.word 0x437a0000 @ 250.0
	.word 0x3a831198 @ 0.000999975
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3506372a @ 4.9999164e-7
	.word 0x40c90fdb @ 6.2831855
	.word 0x3ebb850f @ 0.36624953
	.word 0x428a9a62 @ 69.30153
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x406231d6 @ 3.5342917
	.word 0x3d939607 @ 0.0720635
	.word 0x45a4393b @ 5255.154
	.word 0xbd4ccccd @ -0.05
	.word 0x42fa0000 @ 125.0
	.word 0x3dc49ba6 @ 0.096
	.word 0x3b83126f @ 0.004
	.word 0x3f7693e9 @ 0.96319443
	.word 0xbef0f274 @ -0.47059977
	.word 0x408000d2 @ 4.0001
	.word 0xc070f274 @ -3.7647982
	.word 0x3d782a02 @ 0.060586937
	.word 0x4062594d @ 3.5367005
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x45a00000 @ 5120.0
	.size motor_tick, .-motor_tick

	.section .text.motor_rest, "ax", %progbits
	.balign 8
	.global motor_rest
	.type motor_rest, %function
	.thumb_func
motor_rest:
	push.w {r4-r6, lr}
	sub.w sp, sp, #16
	mov r4, r0
	mov r5, r1
	mov r6, r2
	mov r2, sp
	ldrb.w ip, [r0, #56]
	cmp.w ip, #0
	beq.w .Lmotor_goes_on
	bl motor_begin
	cmp.w r0, #0
	bne.w .Lmotor_known
	mov r0, r6
	bl motor_not_started
	b.w .Lmotor_done
.Lmotor_goes_on:
	bl motor_observe
	cmp.w r0, #0
	beq.w .Lmotor_unknown
.Lmotor_known:
	mov r0, r4
	mov r1, r5
	mov r2, sp
	mov r3, r6
	bl motor_law
	ldrb.w ip, [sp, #8]
	orr.w r5, r0, ip, lsl #7
	ldrb.w r6, [sp, #4]
	orr.w r5, r5, r6, lsl #3
	mov r0, r4
	bl motor_follow
	cmp.w r6, #0
	beq.w .Lmotor_told
	b.w .Lmotor_carry
.Lmotor_unknown:
	mov r0, r4
	mov r1, r5
	mov r2, r6
	bl motor_give_up
	mov r5, r0
	mov r0, r4
	bl motor_follow
.Lmotor_carry:
	mov r0, r4
	bl motor_carry
.Lmotor_told:
	mov r0, r5
.Lmotor_done:
	add.w sp, sp, #16
	pop.w {r4-r6, pc}
	.size motor_rest, .-motor_rest

	.section .text.motor_begin, "ax", %progbits
	.balign 8
	.global motor_begin
	.type motor_begin, %function
	.thumb_func
motor_begin:
	push.w {r4-r11}
	sub.w sp, sp, #56
	movw ip, #:lower16:.Lmotor_begin_table
	movt ip, #:upper16:.Lmotor_begin_table
	vldr s0, [r0, #20]
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	eor.w r5, r4, #1
	vldr s0, [r0, #20]
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r6, #1
	movhi.w r6, #0
	vldr s0, [r0, #20]
	vldr s1, [ip, #8]
	vldr s2, [ip, #12]
	vldr s3, [ip, #16]
	vldr s4, [ip, #20]
	vldr s5, [r0, #8]
	vldr s6, [ip, #24]
	ldr.w r7, [r0, #36]
	ldr.w r8, [r1, #0]
	sub.w r9, r8, r7
	ldrb.w r11, [r1, #4]
	cmp.w r11, #0
	mov.w r10, r9
	it ne
	movne.w r10, r7
	sbfx r9, r10, #0, #14
	vmov s7, r9
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
	it gt
	vmovgt.f32 s2, s1
	vsub.f32 s0, s0, s2
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r10, #1
	movhi.w r10, #0
	str.w r4, [sp, #0]
	and.w r4, r6, r10
	vldr s1, [ip, #16]
	vldr s2, [r0, #8]
	vmul.f32 s1, s1, s2
	vsub.f32 s1, s6, s1
	vabs.f32 s1, s1
	vldr s2, [ip, #28]
	str.w r6, [sp, #4]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r6, #1
	movhi.w r6, #0
	and.w r4, r4, r6
	str.w r8, [sp, #8]
	orr.w r8, r4, r5
	str.w r7, [sp, #12]
	cmp.w r11, #0
	mov.w r7, r8
	it ne
	movne.w r7, r5
	ldr.w r5, [sp, #0]
	ldr.w r8, [sp, #4]
	eor.w r8, r8, #1
	eor.w r10, r10, #1
	orr.w r10, r8, r10
	str.w r9, [sp, #4]
	eor.w r9, r6, #1
	orr.w r10, r10, r9
	and.w r10, r10, r5
	str.w r4, [sp, #16]
	cmp.w r11, #0
	mov.w r4, r10
	it ne
	movne.w r4, r5
	strb.w r4, [r0, #56]
	strb.w r5, [r2, #0]
	mov.w r4, #0
	strb.w r4, [r2, #8]
	strb.w r4, [r2, #4]
	ldr.w r4, [ip, #0]
	ldr.w r10, [r0, #44]
	str.w r7, [sp, #20]
	cmp.w r11, #0
	mov.w r7, r10
	it ne
	movne.w r7, r4
	str.w r8, [sp, #24]
	ldr.w r8, [sp, #4]
	str.w r6, [sp, #28]
	ldr.w r6, [r0, #40]
	str.w r9, [sp, #32]
	add.w r9, r6, r8
	cmp.w r11, #0
	mov.w r5, r9
	it ne
	movne.w r5, r8
	ldr.w r9, [ip, #32]
	sdiv r8, r5, r9
	add.w r7, r7, r8
	ldr.w r9, [ip, #32]
	sdiv r8, r6, r9
	add.w r8, r10, r8
	ldr.w r10, [sp, #0]
	vldr s1, [r0, #16]
	vldr s2, [ip, #0]
	str.w r4, [sp, #4]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	str.w r5, [sp, #36]
	and.w r5, r10, r4
	cmp.w r5, #0
	mov.w r9, r8
	it ne
	movne.w r9, r7
	ldr.w r8, [sp, #4]
	str.w r11, [sp, #40]
	ldr.w r11, [sp, #8]
	str.w r7, [sp, #44]
	sbfx r7, r11, #0, #14
	str.w r6, [sp, #48]
	ldr.w r10, [ip, #32]
	sdiv r6, r7, r10
	add.w r6, r8, r6
	ldr.w r8, [sp, #44]
	str.w r4, [sp, #4]
	ldr.w r4, [sp, #32]
	str.w r5, [sp, #52]
	ldr.w r5, [sp, #4]
	and.w r5, r4, r5
	ldr.w r11, [sp, #0]
	and.w r5, r5, r11
	cmp.w r5, #0
	mov.w r10, r8
	it ne
	movne.w r10, r6
	ldr.w r8, [sp, #40]
	cmp.w r8, #0
	mov.w r6, r10
	it ne
	movne.w r6, r9
	str.w r6, [r0, #44]
	ldr.w r6, [sp, #36]
	ldr.w r10, [ip, #32]
	sdiv r9, r6, r10
	ldr.w r10, [ip, #32]
	mul r9, r9, r10
	sub.w r6, r6, r9
	sbfx r6, r6, #0, #17
	ldr.w r9, [sp, #48]
	str.w r7, [sp, #4]
	ldr.w r7, [ip, #32]
	sdiv r10, r9, r7
	ldr.w r7, [ip, #32]
	mul r10, r10, r7
	sub.w r7, r9, r10
	sbfx r7, r7, #0, #17
	ldr.w r10, [sp, #52]
	cmp.w r10, #0
	mov.w r9, r7
	it ne
	movne.w r9, r6
	ldr.w r7, [sp, #4]
	ldr.w r4, [ip, #32]
	sdiv r10, r7, r4
	ldr.w r4, [ip, #32]
	mul r10, r10, r4
	sub.w r4, r7, r10
	sbfx r4, r4, #0, #17
	cmp.w r5, #0
	mov.w r7, r6
	it ne
	movne.w r7, r4
	cmp.w r8, #0
	mov.w r4, r7
	it ne
	movne.w r4, r9
	str.w r4, [r0, #40]
	vldr s1, [ip, #0]
	vldr s2, [r0, #16]
	ldr.w r4, [sp, #16]
	and.w r4, r4, r11
	eor.w r5, r8, #1
	and.w r4, r4, r5
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #16]
	vldr s1, [ip, #4]
	vldr s2, [ip, #0]
	vldr s3, [ip, #0]
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s0
	it mi
	vmovmi.f32 s3, s2
	ldr.w r4, [sp, #24]
	vldr s2, [ip, #4]
	vcmp.f32 s0, s2
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r5, #1
	movle.w r5, #0
	orr.w r4, r4, r5
	ldr.w r5, [sp, #32]
	orr.w r4, r4, r5
	orr.w r4, r4, r8
	cmp.w r4, #0
	vmov.f32 s0, s3
	it ne
	vmovne.f32 s0, s1
	vldr s1, [r0, #20]
	cmp.w r11, #0
	it ne
	vmovne.f32 s1, s0
	vldr s0, [ip, #0]
	ldr.w r4, [sp, #28]
	cmp.w r4, #0
	vmov.f32 s2, s7
	it ne
	vmovne.f32 s2, s4
	cmp.w r8, #0
	vmov.f32 s3, s2
	it ne
	vmovne.f32 s3, s0
	vldr s0, [r0, #8]
	cmp.w r11, #0
	it ne
	vmovne.f32 s0, s3
	vstr s0, [r0, #8]
	ldr.w r4, [sp, #12]
	ldr.w r5, [sp, #8]
	cmp.w r8, #0
	mov.w r6, r5
	it ne
	movne.w r6, r4
	str.w r6, [r0, #36]
	vldr s0, [ip, #0]
	vldr s2, [r0, #0]
	cmp.w r11, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #0]
	vldr s0, [ip, #0]
	vldr s2, [r0, #32]
	cmp.w r11, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #32]
	vldr s0, [ip, #0]
	vldr s2, [r0, #52]
	cmp.w r11, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #52]
	vldr s0, [ip, #0]
	vldr s2, [r0, #48]
	cmp.w r11, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #48]
	vldr s0, [ip, #0]
	vldr s2, [r0, #4]
	cmp.w r11, #0
	it ne
	vmovne.f32 s2, s0
	vstr s2, [r0, #4]
	vstr s1, [r0, #20]
	mov.w r0, #0
	ldr.w r4, [sp, #20]
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	add.w sp, sp, #56
	pop.w {r4-r11}
	bx lr
	.balign 4
.Lmotor_begin_table:
	.word 0x00000000 @ 0.0
	.word 0x41200000 @ 10.0
	.word 0x40a00000 @ 5.0
	.word 0x3f800000 @ 1.0
	.word 0x3a83126f @ 0.001
	.word 0x3f000000 @ 0.5
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3c939607 @ 0.018015875
	.word 0x00004000 @ 2.2959e-41
	.size motor_begin, .-motor_begin

	.section .text.motor_observe, "ax", %progbits
	.balign 8
	.global motor_observe
	.type motor_observe, %function
	.thumb_func
motor_observe:
	push.w {r4-r11}
	sub.w sp, sp, #24
	movw ip, #:lower16:.Lmotor_observe_table
	movt ip, #:upper16:.Lmotor_observe_table
	vldr s0, [r0, #48]
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
	vldr s2, [r0, #48]
	vmul.f32 s1, s1, s2
	vldr s2, [ip, #12]
	vadd.f32 s2, s1, s2
	vldr s3, [ip, #12]
	vsub.f32 s1, s1, s3
	vabs.f32 s1, s1
	vsub.f32 s1, s2, s1
	vldr s2, [r0, #4]
	vldr s3, [ip, #16]
	vldr s4, [r0, #8]
	vmul.f32 s3, s3, s4
	vldr s4, [ip, #20]
	vldr s5, [r0, #12]
	vldr s6, [ip, #24]
	vldr s7, [r0, #0]
	vmul.f32 s6, s6, s7
	vadd.f32 s5, s5, s6
	vmul.f32 s4, s4, s5
	vadd.f32 s3, s3, s4
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #28]
	ldr.w r5, [r1, #0]
	ldr.w r6, [r0, #36]
	sub.w r7, r5, r6
	sbfx r7, r7, #0, #14
	vmov s4, r7
	vcvt.f32.s32 s4, s4
	vmul.f32 s3, s3, s4
	vsub.f32 s3, s2, s3
	vldr s4, [r0, #52]
	vsub.f32 s4, s3, s4
	vabs.f32 s4, s4
	vadd.f32 s4, s4, s4
	vsub.f32 s1, s1, s4
	vldr s4, [ip, #12]
	vldr s6, [r0, #48]
	vldr s7, [ip, #0]
	vadd.f32 s6, s6, s7
	vmul.f32 s6, s6, s6
	vmul.f32 s4, s4, s6
	vabs.f32 s6, s3
	vsub.f32 s4, s4, s6
	vadd.f32 s7, s1, s4
	vsub.f32 s1, s1, s4
	vabs.f32 s1, s1
	vsub.f32 s1, s7, s1
	vldr s4, [ip, #32]
	vldr s7, [r0, #20]
	vldr s8, [ip, #36]
	vmul.f32 s8, s8, s6
	vldr s9, [ip, #0]
	vadd.f32 s8, s8, s9
	vadd.f32 s7, s7, s8
	vsub.f32 s4, s4, s7
	vldr s8, [ip, #0]
	vldr s9, [r0, #48]
	vldr s10, [ip, #40]
	vsub.f32 s9, s9, s10
	vldr s10, [ip, #44]
	vldr s11, [r0, #8]
	vabs.f32 s11, s11
	vmul.f32 s10, s10, s11
	vldr s11, [ip, #48]
	vcmp.f32 s10, s11
	vmrs APSR_nzcv, fpscr
	vmov.f32 s10, s9
	it gt
	vmovgt.f32 s10, s8
	vadd.f32 s8, s4, s10
	vsub.f32 s4, s4, s10
	vabs.f32 s4, s4
	vsub.f32 s4, s8, s4
	vadd.f32 s8, s1, s4
	vsub.f32 s1, s1, s4
	vabs.f32 s1, s1
	vsub.f32 s1, s8, s1
	vldr s4, [ip, #52]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	ite ge
	movge.w r8, #1
	movlt.w r8, #0
	orr.w r9, r8, r4
	vldr s1, [ip, #12]
	vldr s4, [r0, #16]
	vadd.f32 s1, s1, s4
	vcmp.f32 s6, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r10, #1
	movhi.w r10, #0
	orr.w r9, r9, r10
	str.w r5, [sp, #0]
	ldrb.w r5, [r1, #4]
	cmp.w r5, #0
	mov.w r11, r9
	it ne
	movne.w r11, r4
	eor.w r4, r10, #1
	and.w r9, r4, r8
	str.w r6, [sp, #4]
	eor.w r6, r5, #1
	and.w r9, r9, r6
	strb.w r9, [r2, #8]
	str.w r7, [sp, #8]
	eor.w r7, r8, #1
	and.w r4, r4, r7
	orr.w r4, r4, r5
	strb.w r4, [r2, #4]
	mov.w r4, #0
	strb.w r4, [r2, #0]
	ldr.w r4, [r0, #40]
	ldr.w r7, [sp, #8]
	add.w r7, r4, r7
	str.w r11, [sp, #8]
	str.w r6, [sp, #12]
	orr.w r6, r10, r8
	str.w r9, [sp, #16]
	ldr.w r9, [sp, #12]
	str.w r5, [sp, #20]
	and.w r5, r6, r9
	cmp.w r5, #0
	mov.w r11, r4
	it ne
	movne.w r11, r7
	str.w r11, [r0, #40]
	vldr s1, [r0, #20]
	ldr.w r4, [sp, #16]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s7
	vldr s4, [ip, #56]
	vmul.f32 s1, s1, s4
	vldr s4, [ip, #60]
	vldr s6, [r0, #52]
	cmp.w r6, #0
	vmov.f32 s7, s3
	it ne
	vmovne.f32 s7, s6
	ldr.w r4, [sp, #20]
	cmp.w r4, #0
	vmov.f32 s6, s7
	it ne
	vmovne.f32 s6, s4
	vldr s4, [ip, #52]
	cmp.w r5, #0
	vmov.f32 s7, s0
	it ne
	vmovne.f32 s7, s4
	vldr s0, [ip, #64]
	vmul.f32 s0, s0, s3
	vsub.f32 s0, s3, s0
	vldr s4, [ip, #52]
	cmp.w r8, #0
	vmov.f32 s8, s2
	it ne
	vmovne.f32 s8, s4
	cmp.w r10, #0
	vmov.f32 s4, s8
	it ne
	vmovne.f32 s4, s0
	cmp.w r4, #0
	vmov.f32 s0, s4
	it ne
	vmovne.f32 s0, s2
	ldr.w r4, [sp, #0]
	ldr.w r6, [sp, #4]
	cmp.w r5, #0
	mov.w r7, r6
	it ne
	movne.w r7, r4
	vstr s7, [r0, #48]
	vstr s6, [r0, #52]
	vstr s1, [r0, #20]
	vldr s1, [r0, #12]
	vldr s2, [ip, #68]
	vmul.f32 s2, s2, s3
	vsub.f32 s1, s1, s2
	vldr s2, [r0, #12]
	and.w r4, r9, r10
	cmp.w r4, #0
	it ne
	vmovne.f32 s2, s1
	vldr s1, [ip, #72]
	vldr s4, [r0, #8]
	vmul.f32 s1, s1, s4
	vldr s4, [ip, #16]
	vmul.f32 s4, s4, s5
	vadd.f32 s1, s1, s4
	vldr s4, [ip, #76]
	vmul.f32 s3, s4, s3
	vsub.f32 s3, s1, s3
	cmp.w r4, #0
	vmov.f32 s4, s1
	it ne
	vmovne.f32 s4, s3
	vstr s4, [r0, #8]
	str.w r7, [r0, #36]
	vstr s0, [r0, #4]
	vstr s2, [r0, #12]
	vldr s0, [r0, #16]
	vldr s1, [ip, #80]
	vmul.f32 s0, s0, s1
	vstr s0, [r0, #16]
	mov.w r0, #0
	ldr.w r4, [sp, #8]
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	add.w sp, sp, #24
	pop.w {r4-r11}
	bx lr
	.balign 4
.Lmotor_observe_table:
	.word 0x3f800000 @ 1.0
	.word 0x42480000 @ 50.0
	.word 0x3c139607 @ 0.009007937
	.word 0x3d939607 @ 0.0720635
	.word 0x3a831198 @ 0.000999975
	.word 0x3506372a @ 4.9999164e-7
	.word 0x437a0000 @ 250.0
	.word 0x39c90fdb @ 0.0003834952
	.word 0x40800000 @ 4.0
	.word 0x3ff47645 @ 1.9098593
	.word 0x41000000 @ 8.0
	.word 0x3a83126f @ 0.001
	.word 0x3c939607 @ 0.018015875
	.word 0x00000000 @ 0.0
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x41490fdb @ 12.566371
	.word 0x3ebb850f @ 0.36624953
	.word 0x45a4393b @ 5255.154
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x428a9a62 @ 69.30153
	.word 0x3f7693e9 @ 0.96319443
	.size motor_observe, .-motor_observe

	.section .text.motor_law, "ax", %progbits
	.balign 8
	.global motor_law
	.type motor_law, %function
	.thumb_func
motor_law:
	push.w {r4-r9}
	vpush {s16-s17}
	movw ip, #:lower16:.Lmotor_law_table
	movt ip, #:upper16:.Lmotor_law_table
	ldrb.w r4, [r2, #0]
	cmp.w r4, #0
	beq.w .Lmotor_law_1
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #40]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #4]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	ldr.w r5, [r1, #8]
	ldr.w r6, [r0, #44]
	sub.w r5, r5, r6
	vmov s2, r5
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [r1, #12]
	vadd.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [ip, #8]
	vldr s3, [r0, #24]
	vabs.f32 s3, s3
	vmul.f32 s2, s2, s3
	vldr s4, [ip, #12]
	vldr s5, [ip, #16]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r5, #1
	movpl.w r5, #0
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_2
	vldr s2, [ip, #20]
	vldr s5, [ip, #24]
	vldr s6, [r0, #8]
	vmul.f32 s5, s5, s6
	vldr s6, [r0, #12]
	vadd.f32 s5, s5, s6
	vmul.f32 s2, s2, s5
	vneg.f32 s2, s2
	vldr s5, [ip, #28]
	vldr s6, [r0, #8]
	vldr s7, [r1, #16]
	vsub.f32 s6, s6, s7
	vmul.f32 s5, s5, s6
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #32]
	vldr s7, [r1, #28]
	vldr s8, [r1, #16]
	vsub.f32 s7, s7, s8
	vmul.f32 s5, s5, s7
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #36]
	vldr s7, [ip, #40]
	vldr s8, [ip, #44]
	vldr s9, [ip, #48]
	vsub.f32 s10, s1, s4
	vldr s11, [ip, #52]
	vmul.f32 s11, s11, s4
	vadd.f32 s12, s10, s11
	vsub.f32 s13, s10, s11
	vabs.f32 s13, s13
	vsub.f32 s12, s12, s13
	vmul.f32 s9, s9, s12
	vmul.f32 s8, s8, s9
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #56]
	vldr s12, [ip, #48]
	vsub.f32 s9, s10, s9
	vldr s10, [ip, #60]
	vmul.f32 s10, s10, s11
	vadd.f32 s11, s9, s10
	vsub.f32 s13, s9, s10
	vabs.f32 s13, s13
	vsub.f32 s11, s11, s13
	vmul.f32 s11, s12, s11
	vmul.f32 s8, s8, s11
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #64]
	vldr s12, [ip, #48]
	vsub.f32 s9, s9, s11
	vldr s11, [ip, #60]
	vmul.f32 s10, s11, s10
	vadd.f32 s11, s9, s10
	vsub.f32 s13, s9, s10
	vabs.f32 s13, s13
	vsub.f32 s11, s11, s13
	vmul.f32 s11, s12, s11
	vmul.f32 s8, s8, s11
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #68]
	vldr s12, [ip, #48]
	vsub.f32 s9, s9, s11
	vldr s11, [ip, #60]
	vmul.f32 s10, s11, s10
	vadd.f32 s11, s9, s10
	vsub.f32 s9, s9, s10
	vabs.f32 s9, s9
	vsub.f32 s9, s11, s9
	vmul.f32 s9, s12, s9
	vmul.f32 s8, s8, s9
	vadd.f32 s4, s4, s8
	vneg.f32 s8, s4
	vldr s9, [ip, #72]
	vcmp.f32 s0, s9
	vmrs APSR_nzcv, fpscr
	vmov.f32 s9, s8
	it gt
	vmovgt.f32 s9, s4
	cmp.w r7, #0
	vmov.f32 s4, s9
	it ne
	vmovne.f32 s4, s0
	vmul.f32 s0, s7, s4
	vadd.f32 s0, s6, s0
	vmul.f32 s4, s5, s0
	vadd.f32 s2, s2, s4
	vldr s4, [r0, #0]
	vldr s5, [ip, #76]
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	orr.w r7, r7, r8
	cmp.w r7, #0
	it ne
	vmovne.f32 s4, s2
	vabs.f32 s1, s4
	vldr s4, [ip, #76]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_3
	vldr s1, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s1, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s1
	vneg.f32 s1, s1
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s1
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s2
	it mi
	vmovmi.f32 s1, s5
	vcmp.f32 s4, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s1
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s2
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #84]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_3:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s3
	vneg.f32 s1, s0
	vldr s2, [ip, #72]
	vldr s4, [r0, #0]
	vldr s5, [ip, #72]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #76]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s2, s2, s5
	vldr s4, [ip, #72]
	vadd.f32 s2, s2, s4
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s0
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s4
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #88]
	vldr s4, [r0, #28]
	vldr s5, [ip, #88]
	vadd.f32 s4, s4, s5
	vabs.f32 s4, s4
	vldr s5, [ip, #88]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #92]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s3, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #24]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_2:
	vldr s2, [ip, #76]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Lmotor_law_4
	vldr s2, [ip, #20]
	vldr s5, [ip, #24]
	vldr s6, [r0, #8]
	vmul.f32 s5, s5, s6
	vldr s6, [r0, #12]
	vadd.f32 s5, s5, s6
	vmul.f32 s2, s2, s5
	vneg.f32 s2, s2
	vldr s5, [ip, #28]
	vldr s6, [r0, #8]
	vldr s7, [r1, #16]
	vsub.f32 s6, s6, s7
	vmul.f32 s5, s5, s6
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #32]
	vldr s7, [r1, #28]
	vldr s8, [r1, #16]
	vsub.f32 s7, s7, s8
	vmul.f32 s5, s5, s7
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #36]
	vldr s7, [ip, #40]
	vldr s8, [ip, #44]
	vldr s9, [ip, #48]
	vsub.f32 s1, s1, s4
	vldr s10, [ip, #52]
	vmul.f32 s10, s10, s4
	vadd.f32 s11, s1, s10
	vsub.f32 s12, s1, s10
	vabs.f32 s12, s12
	vsub.f32 s11, s11, s12
	vmul.f32 s9, s9, s11
	vmul.f32 s8, s8, s9
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #56]
	vldr s11, [ip, #48]
	vsub.f32 s1, s1, s9
	vldr s9, [ip, #60]
	vmul.f32 s9, s9, s10
	vadd.f32 s10, s1, s9
	vsub.f32 s12, s1, s9
	vabs.f32 s12, s12
	vsub.f32 s10, s10, s12
	vmul.f32 s10, s11, s10
	vmul.f32 s8, s8, s10
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #64]
	vldr s11, [ip, #48]
	vsub.f32 s1, s1, s10
	vldr s10, [ip, #60]
	vmul.f32 s9, s10, s9
	vadd.f32 s10, s1, s9
	vsub.f32 s12, s1, s9
	vabs.f32 s12, s12
	vsub.f32 s10, s10, s12
	vmul.f32 s10, s11, s10
	vmul.f32 s8, s8, s10
	vadd.f32 s4, s4, s8
	vldr s8, [ip, #68]
	vldr s11, [ip, #48]
	vsub.f32 s1, s1, s10
	vldr s10, [ip, #60]
	vmul.f32 s9, s10, s9
	vadd.f32 s10, s1, s9
	vsub.f32 s1, s1, s9
	vabs.f32 s1, s1
	vsub.f32 s1, s10, s1
	vmul.f32 s1, s11, s1
	vmul.f32 s1, s8, s1
	vadd.f32 s1, s4, s1
	vneg.f32 s4, s1
	vldr s8, [ip, #72]
	vcmp.f32 s0, s8
	vmrs APSR_nzcv, fpscr
	vmov.f32 s8, s4
	it gt
	vmovgt.f32 s8, s1
	cmp.w r7, #0
	vmov.f32 s1, s8
	it ne
	vmovne.f32 s1, s0
	vmul.f32 s0, s7, s1
	vadd.f32 s0, s6, s0
	vmul.f32 s1, s5, s0
	vadd.f32 s1, s2, s1
	vldr s2, [r0, #0]
	orr.w r7, r7, r8
	cmp.w r7, #0
	it ne
	vmovne.f32 s2, s1
	vabs.f32 s2, s2
	vldr s4, [ip, #76]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_5
	vldr s2, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #84]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_5:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s3
	vneg.f32 s1, s0
	vldr s2, [ip, #72]
	vldr s4, [r0, #0]
	vldr s5, [ip, #72]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #76]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s2, s2, s5
	vldr s4, [ip, #72]
	vadd.f32 s2, s2, s4
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s0
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s4
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #88]
	vldr s4, [r0, #28]
	vldr s5, [ip, #88]
	vadd.f32 s4, s4, s5
	vabs.f32 s4, s4
	vldr s5, [ip, #88]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #92]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s3, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #24]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_4:
	vldr s2, [ip, #16]
	vldr s5, [ip, #16]
	vcmp.f32 s5, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s3
	vneg.f32 s3, s2
	vldr s5, [ip, #72]
	vldr s6, [r0, #0]
	vldr s7, [ip, #72]
	vldr s8, [ip, #20]
	vldr s9, [ip, #24]
	vldr s10, [r0, #8]
	vmul.f32 s9, s9, s10
	vldr s10, [r0, #12]
	vadd.f32 s9, s9, s10
	vmul.f32 s8, s8, s9
	vneg.f32 s8, s8
	vldr s9, [ip, #28]
	vldr s10, [r0, #8]
	vldr s11, [r1, #16]
	vsub.f32 s10, s10, s11
	vmul.f32 s9, s9, s10
	vadd.f32 s8, s8, s9
	vldr s9, [ip, #32]
	vldr s11, [r1, #28]
	vldr s12, [r1, #16]
	vsub.f32 s11, s11, s12
	vmul.f32 s9, s9, s11
	vadd.f32 s8, s8, s9
	vldr s9, [ip, #36]
	vldr s11, [ip, #40]
	vldr s12, [ip, #44]
	vldr s13, [ip, #48]
	vsub.f32 s1, s1, s4
	vldr s14, [ip, #52]
	vmul.f32 s14, s14, s4
	vadd.f32 s15, s1, s14
	vsub.f32 s16, s1, s14
	vabs.f32 s16, s16
	vsub.f32 s15, s15, s16
	vmul.f32 s13, s13, s15
	vmul.f32 s12, s12, s13
	vadd.f32 s4, s4, s12
	vldr s12, [ip, #56]
	vldr s15, [ip, #48]
	vsub.f32 s1, s1, s13
	vldr s13, [ip, #60]
	vmul.f32 s13, s13, s14
	vadd.f32 s14, s1, s13
	vsub.f32 s16, s1, s13
	vabs.f32 s16, s16
	vsub.f32 s14, s14, s16
	vmul.f32 s14, s15, s14
	vmul.f32 s12, s12, s14
	vadd.f32 s4, s4, s12
	vldr s12, [ip, #64]
	vldr s15, [ip, #48]
	vsub.f32 s1, s1, s14
	vldr s14, [ip, #60]
	vmul.f32 s13, s14, s13
	vadd.f32 s14, s1, s13
	vsub.f32 s16, s1, s13
	vabs.f32 s16, s16
	vsub.f32 s14, s14, s16
	vmul.f32 s14, s15, s14
	vmul.f32 s12, s12, s14
	vadd.f32 s4, s4, s12
	vldr s12, [ip, #68]
	vldr s15, [ip, #48]
	vsub.f32 s1, s1, s14
	vldr s14, [ip, #60]
	vmul.f32 s13, s14, s13
	vadd.f32 s14, s1, s13
	vsub.f32 s1, s1, s13
	vabs.f32 s1, s1
	vsub.f32 s1, s14, s1
	vmul.f32 s1, s15, s1
	vmul.f32 s1, s12, s1
	vadd.f32 s1, s4, s1
	vneg.f32 s4, s1
	vldr s12, [ip, #72]
	vcmp.f32 s0, s12
	vmrs APSR_nzcv, fpscr
	vmov.f32 s12, s4
	it gt
	vmovgt.f32 s12, s1
	cmp.w r7, #0
	vmov.f32 s1, s12
	it ne
	vmovne.f32 s1, s0
	vmul.f32 s0, s11, s1
	vadd.f32 s0, s10, s0
	vmul.f32 s0, s9, s0
	vadd.f32 s0, s8, s0
	vldr s1, [r0, #0]
	orr.w r4, r7, r8
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vabs.f32 s0, s1
	vldr s1, [ip, #76]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s7, s6
	vmul.f32 s0, s5, s7
	vldr s1, [ip, #72]
	vadd.f32 s0, s0, s1
	vcmp.f32 s0, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s0
	it gt
	vmovgt.f32 s1, s2
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s1
	it mi
	vmovmi.f32 s0, s3
	vstr s0, [r3, #0]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_1:
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #40]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #4]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	ldr.w r5, [r1, #8]
	ldr.w r6, [r0, #44]
	sub.w r5, r5, r6
	vmov s2, r5
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [r1, #12]
	vadd.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [ip, #8]
	vldr s3, [r0, #24]
	vabs.f32 s3, s3
	vmul.f32 s2, s2, s3
	vldr s4, [ip, #12]
	vldr s5, [ip, #16]
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	ite mi
	movmi.w r5, #1
	movpl.w r5, #0
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_6
	vldr s1, [ip, #20]
	vldr s2, [ip, #24]
	vldr s4, [r0, #8]
	vmul.f32 s2, s2, s4
	vldr s4, [r0, #12]
	vadd.f32 s2, s2, s4
	vmul.f32 s1, s1, s2
	vneg.f32 s1, s1
	vldr s2, [ip, #28]
	vldr s4, [r0, #8]
	vldr s5, [r1, #16]
	vsub.f32 s4, s4, s5
	vmul.f32 s2, s2, s4
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #32]
	vldr s5, [r1, #28]
	vldr s6, [r1, #16]
	vsub.f32 s5, s5, s6
	vmul.f32 s2, s2, s5
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #96]
	vldr s5, [r0, #32]
	vmul.f32 s2, s2, s5
	vadd.f32 s2, s1, s2
	vldr s5, [ip, #100]
	vldr s6, [ip, #40]
	vmul.f32 s0, s6, s0
	vadd.f32 s0, s4, s0
	vmul.f32 s4, s5, s0
	vadd.f32 s2, s2, s4
	vabs.f32 s4, s2
	vldr s5, [ip, #104]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_7
	vldr s1, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s1, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s1
	vneg.f32 s1, s1
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s1
	vcmp.f32 s2, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s2
	it mi
	vmovmi.f32 s1, s5
	vcmp.f32 s4, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s1
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s2
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vldr s1, [r0, #32]
	vsub.f32 s1, s0, s1
	vstr s1, [r3, #8]
	vstr s0, [r3, #4]
	vstr s5, [r0, #0]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	vldr s0, [r0, #32]
	vldr s1, [ip, #84]
	vldr s2, [r0, #32]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_7:
	vldr s2, [ip, #36]
	vmul.f32 s2, s2, s0
	vadd.f32 s1, s1, s2
	vabs.f32 s2, s1
	vldr s4, [ip, #76]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_8
	vldr s2, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #84]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_8:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s3
	vneg.f32 s1, s0
	vldr s2, [ip, #72]
	vldr s4, [r0, #0]
	vldr s5, [ip, #72]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #76]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s2, s2, s5
	vldr s4, [ip, #72]
	vadd.f32 s2, s2, s4
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s0
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s4
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #88]
	vldr s4, [r0, #28]
	vldr s5, [ip, #88]
	vadd.f32 s4, s4, s5
	vabs.f32 s4, s4
	vldr s5, [ip, #88]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #92]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s3, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #24]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_6:
	vldr s2, [ip, #76]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_9
	vldr s2, [ip, #20]
	vldr s5, [ip, #24]
	vldr s6, [r0, #8]
	vmul.f32 s5, s5, s6
	vldr s6, [r0, #12]
	vadd.f32 s5, s5, s6
	vmul.f32 s2, s2, s5
	vneg.f32 s2, s2
	vldr s5, [ip, #28]
	vldr s6, [r0, #8]
	vldr s7, [r1, #16]
	vsub.f32 s6, s6, s7
	vmul.f32 s5, s5, s6
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #32]
	vldr s7, [r1, #28]
	vldr s8, [r1, #16]
	vsub.f32 s7, s7, s8
	vmul.f32 s5, s5, s7
	vadd.f32 s2, s2, s5
	vldr s5, [ip, #96]
	vldr s7, [r0, #32]
	vmul.f32 s5, s5, s7
	vadd.f32 s5, s2, s5
	vldr s7, [ip, #100]
	vldr s8, [ip, #40]
	vldr s9, [ip, #44]
	vldr s10, [ip, #48]
	vsub.f32 s1, s1, s4
	vldr s11, [ip, #52]
	vmul.f32 s11, s11, s4
	vadd.f32 s12, s1, s11
	vsub.f32 s13, s1, s11
	vabs.f32 s13, s13
	vsub.f32 s12, s12, s13
	vmul.f32 s10, s10, s12
	vmul.f32 s9, s9, s10
	vadd.f32 s4, s4, s9
	vldr s9, [ip, #56]
	vldr s12, [ip, #48]
	vsub.f32 s1, s1, s10
	vldr s10, [ip, #60]
	vmul.f32 s10, s10, s11
	vadd.f32 s11, s1, s10
	vsub.f32 s13, s1, s10
	vabs.f32 s13, s13
	vsub.f32 s11, s11, s13
	vmul.f32 s11, s12, s11
	vmul.f32 s9, s9, s11
	vadd.f32 s4, s4, s9
	vldr s9, [ip, #64]
	vldr s12, [ip, #48]
	vsub.f32 s1, s1, s11
	vldr s11, [ip, #60]
	vmul.f32 s10, s11, s10
	vadd.f32 s11, s1, s10
	vsub.f32 s13, s1, s10
	vabs.f32 s13, s13
	vsub.f32 s11, s11, s13
	vmul.f32 s11, s12, s11
	vmul.f32 s9, s9, s11
	vadd.f32 s4, s4, s9
	vldr s9, [ip, #68]
	vldr s12, [ip, #48]
	vsub.f32 s1, s1, s11
	vldr s11, [ip, #60]
	vmul.f32 s10, s11, s10
	vadd.f32 s11, s1, s10
	vsub.f32 s1, s1, s10
	vabs.f32 s1, s1
	vsub.f32 s1, s11, s1
	vmul.f32 s1, s12, s1
	vmul.f32 s1, s9, s1
	vadd.f32 s1, s4, s1
	vneg.f32 s4, s1
	vldr s9, [ip, #72]
	vcmp.f32 s0, s9
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s4
	it gt
	vmovgt.f32 s0, s1
	vmul.f32 s0, s8, s0
	vadd.f32 s0, s6, s0
	vmul.f32 s1, s7, s0
	vadd.f32 s1, s5, s1
	vabs.f32 s4, s1
	vldr s5, [ip, #104]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_10
	vldr s2, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s0, [ip, #72]
	vstr s0, [r3, #8]
	vstr s5, [r0, #0]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	vldr s0, [r0, #32]
	vldr s1, [ip, #84]
	vldr s2, [r0, #32]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_10:
	vldr s1, [ip, #36]
	vmul.f32 s1, s1, s0
	vadd.f32 s1, s2, s1
	vabs.f32 s2, s1
	vldr s4, [ip, #76]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_11
	vldr s2, [ip, #16]
	vldr s4, [ip, #16]
	vcmp.f32 s4, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s2, s3
	vldr s4, [ip, #16]
	cmp.w r5, #0
	it ne
	vmovne.f32 s4, s2
	vneg.f32 s2, s2
	vldr s5, [ip, #80]
	cmp.w r5, #0
	it ne
	vmovne.f32 s5, s2
	vcmp.f32 s1, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it mi
	vmovmi.f32 s2, s5
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s2
	it mi
	vmovmi.f32 s5, s4
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	vstr s5, [r3, #0]
	vstr s0, [r3, #4]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vstr s5, [r0, #0]
	vldr s1, [ip, #84]
	vmul.f32 s1, s1, s0
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #32]
	vldr s0, [ip, #16]
	vldr s1, [ip, #88]
	vldr s2, [r0, #28]
	vldr s4, [ip, #88]
	vadd.f32 s2, s2, s4
	vabs.f32 s2, s2
	vldr s4, [ip, #88]
	vcmp.f32 s2, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s1
	vldr s1, [ip, #92]
	vmul.f32 s1, s4, s1
	vadd.f32 s1, s3, s1
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	vmov.f32 s2, s1
	it gt
	vmovgt.f32 s2, s0
	vldr s0, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s0, s2
	vstr s0, [r0, #24]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_11:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s3
	vneg.f32 s1, s0
	vldr s2, [ip, #72]
	vldr s4, [r0, #0]
	vldr s5, [ip, #72]
	vldr s6, [r0, #0]
	vabs.f32 s6, s6
	vldr s7, [ip, #76]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s5, s4
	vmul.f32 s2, s2, s5
	vldr s4, [ip, #72]
	vadd.f32 s2, s2, s4
	vcmp.f32 s2, s0
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s2
	it gt
	vmovgt.f32 s4, s0
	vcmp.f32 s4, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s4
	it mi
	vmovmi.f32 s0, s1
	vstr s0, [r3, #0]
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vldr s1, [ip, #16]
	vldr s2, [ip, #88]
	vldr s4, [r0, #28]
	vldr s5, [ip, #88]
	vadd.f32 s4, s4, s5
	vabs.f32 s4, s4
	vldr s5, [ip, #88]
	vcmp.f32 s4, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s4
	it gt
	vmovgt.f32 s5, s2
	vldr s2, [ip, #92]
	vmul.f32 s2, s5, s2
	vadd.f32 s2, s3, s2
	vldr s3, [ip, #16]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it gt
	vmovgt.f32 s3, s1
	vldr s1, [r0, #24]
	cmp.w r5, #0
	it ne
	vmovne.f32 s1, s3
	vstr s0, [r0, #0]
	vstr s1, [r0, #24]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
.Lmotor_law_9:
	vldr s0, [ip, #16]
	vldr s1, [ip, #16]
	vcmp.f32 s1, s3
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s3
	vneg.f32 s1, s0
	vldr s2, [ip, #72]
	vldr s3, [r0, #0]
	vldr s4, [ip, #72]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #76]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #72]
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
	vldr s1, [ip, #72]
	vstr s1, [r3, #8]
	vldr s1, [ip, #72]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	mov.w r0, #1
	vpop {s16-s17}
	pop.w {r4-r9}
	bx lr
	.balign 4
.Lmotor_law_table:
	.word 0x39c90fdb @ 0.0003834952
	.word 0x40c90fdb @ 6.2831855
	.word 0x3c1d4952 @ 0.0096
	.word 0x3dc49ba6 @ 0.096
	.word 0x41200000 @ 10.0
	.word 0x3b83126f @ 0.004
	.word 0xbd4ccccd @ -0.05
	.word 0xbef0f274 @ -0.47059977
	.word 0x408000d2 @ 4.0001
	.word 0xbe69926a @ -0.22809759
	.word 0x42fa0000 @ 125.0
	.word 0x3eaaaaab @ 0.33333334
	.word 0x3f000000 @ 0.5
	.word 0x40400000 @ 3.0
	.word 0x3e2aaaab @ 0.16666667
	.word 0x40800000 @ 4.0
	.word 0x3daaaaab @ 0.083333336
	.word 0x3d2aaaab @ 0.041666668
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xc1200000 @ -10.0
	.word 0x3d782a02 @ 0.060586937
	.word 0x3f800000 @ 1.0
	.word 0x3e200000 @ 0.15625
	.word 0x4062594d @ 3.5367005
	.word 0xc070f274 @ -3.7647982
	.word 0x45a00000 @ 5120.0
	.size motor_law, .-motor_law

	.section .text.motor_give_up, "ax", %progbits
	.balign 8
	.global motor_give_up
	.type motor_give_up, %function
	.thumb_func
motor_give_up:
	push.w {r4-r5}
	movw ip, #:lower16:.Lmotor_give_up_table
	movt ip, #:upper16:.Lmotor_give_up_table
	ldrb.w r4, [r1, #4]
	eor.w r5, r4, #1
	vldr s0, [r0, #24]
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
	vstr s0, [r0, #16]
	vldr s0, [ip, #4]
	vstr s0, [r2, #8]
	vldr s0, [ip, #4]
	vstr s0, [r2, #4]
	vstr s1, [r0, #0]
	vldr s0, [r0, #20]
	vldr s1, [ip, #0]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [r0, #12]
	vldr s1, [ip, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	ldrb.w r4, [r0, #56]
	orr.w r4, r4, r5
	strb.w r4, [r0, #56]
	mov.w r0, #9
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #256
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lmotor_give_up_table:
	.word 0x41200000 @ 10.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.size motor_give_up, .-motor_give_up

	.section .text.motor_refuse, "ax", %progbits
	.balign 8
	.global motor_refuse
	.type motor_refuse, %function
	.thumb_func
motor_refuse:
	movw ip, #:lower16:.Lmotor_refuse_table
	movt ip, #:upper16:.Lmotor_refuse_table
	vldr s0, [r0, #24]
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
.Lmotor_refuse_table:
	.word 0x41200000 @ 10.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.size motor_refuse, .-motor_refuse

	.section .text.motor_pass, "ax", %progbits
	.balign 8
	.global motor_pass
	.type motor_pass, %function
	.thumb_func
motor_pass:
	push.w {r4-r5}
	movw ip, #:lower16:.Lmotor_pass_table
	movt ip, #:upper16:.Lmotor_pass_table
	vldr s0, [r0, #48]
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
	vstr s1, [r0, #52]
	vldr s1, [r0, #4]
	vldr s2, [ip, #12]
	vldr s3, [r0, #8]
	vmul.f32 s2, s2, s3
	vldr s3, [ip, #16]
	vldr s4, [r0, #12]
	vldr s5, [ip, #20]
	vldr s6, [r0, #0]
	vmul.f32 s5, s5, s6
	vadd.f32 s4, s4, s5
	vmul.f32 s3, s3, s4
	vadd.f32 s2, s2, s3
	vadd.f32 s1, s1, s2
	vstr s1, [r0, #4]
	vldr s1, [ip, #24]
	vldr s2, [r0, #8]
	vmul.f32 s1, s1, s2
	vldr s2, [ip, #12]
	vmul.f32 s2, s2, s4
	vadd.f32 s1, s1, s2
	vstr s1, [r0, #8]
	vldr s1, [r0, #32]
	vldr s2, [ip, #28]
	vldr s3, [r0, #32]
	vmul.f32 s2, s2, s3
	vsub.f32 s1, s1, s2
	vstr s1, [r0, #32]
	vldr s1, [r0, #20]
	vldr s2, [ip, #32]
	vmul.f32 s1, s1, s2
	vstr s1, [r0, #20]
	vstr s0, [r0, #48]
	vldr s0, [r0, #16]
	vldr s1, [ip, #36]
	vmul.f32 s0, s0, s1
	vstr s0, [r0, #16]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lmotor_pass_table:
	.word 0x3f800000 @ 1.0
	.word 0x42480000 @ 50.0
	.word 0x41490fdb @ 12.566371
	.word 0x3a831198 @ 0.000999975
	.word 0x3506372a @ 4.9999164e-7
	.word 0x437a0000 @ 250.0
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x3d782a02 @ 0.060586937
	.word 0x3f7d73e8 @ 0.99004984
	.word 0x3f7693e9 @ 0.96319443
	.size motor_pass, .-motor_pass

	.section .text.motor_follow, "ax", %progbits
	.balign 8
	.global motor_follow
	.type motor_follow, %function
	.thumb_func
motor_follow:
	push.w {r4-r9}
	movw ip, #:lower16:.Lmotor_follow_table
	movt ip, #:upper16:.Lmotor_follow_table
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #40]
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
	beq.w .Lmotor_follow_1
	pop.w {r4-r9}
	bx lr
.Lmotor_follow_1:
	ldr.w r5, [r0, #44]
	ldr.w r6, [ip, #8]
	add.w r7, r5, r6
	sub.w r5, r5, r6
	vldr s1, [ip, #12]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r8, #1
	movle.w r8, #0
	cmp.w r8, #0
	mov.w r6, r5
	it ne
	movne.w r6, r7
	str.w r6, [r0, #44]
	ldr.w r5, [ip, #16]
	sub.w r6, r4, r5
	add.w r4, r4, r5
	cmp.w r8, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	sbfx r4, r5, #0, #17
	str.w r4, [r0, #40]
	pop.w {r4-r9}
	bx lr
	.balign 4
.Lmotor_follow_table:
	.word 0x39c90fdb @ 0.0003834952
	.word 0x406231d6 @ 3.5342917
	.word 0x00000001 @ 1e-45
	.word 0x00000000 @ 0.0
	.word 0x00004000 @ 2.2959e-41
	.size motor_follow, .-motor_follow

	.section .text.motor_carry, "ax", %progbits
	.balign 8
	.global motor_carry
	.type motor_carry, %function
	.thumb_func
motor_carry:
	push.w {r4-r5}
	movw ip, #:lower16:.Lmotor_carry_table
	movt ip, #:upper16:.Lmotor_carry_table
	vldr s0, [r0, #4]
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
	beq.w .Lmotor_carry_1
	pop.w {r4-r5}
	bx lr
.Lmotor_carry_1:
	vldr s0, [r0, #4]
	vldr s1, [ip, #8]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r4, #1
	movle.w r4, #0
	cmp.w r4, #0
	beq.w .Lmotor_carry_2
	vldr s0, [r0, #4]
	vldr s1, [ip, #0]
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #4]
	ldr.w r4, [r0, #40]
	ldr.w r5, [ip, #12]
	add.w r4, r4, r5
	str.w r4, [r0, #40]
	ldr.w r4, [r0, #36]
	add.w r4, r4, r5
	str.w r4, [r0, #36]
	pop.w {r4-r5}
	bx lr
.Lmotor_carry_2:
	vldr s0, [r0, #4]
	vldr s1, [ip, #0]
	vadd.f32 s0, s0, s1
	vstr s0, [r0, #4]
	ldr.w r4, [r0, #40]
	ldr.w r5, [ip, #12]
	sub.w r4, r4, r5
	str.w r4, [r0, #40]
	ldr.w r4, [r0, #36]
	sub.w r4, r4, r5
	str.w r4, [r0, #36]
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lmotor_carry_table:
	.word 0x3fc90fdb @ 1.5707964
	.word 0x40490fdb @ 3.1415927
	.word 0x00000000 @ 0.0
	.word 0x00001000 @ 5.74e-42
	.size motor_carry, .-motor_carry

	.section .text.motor_start, "ax", %progbits
	.balign 8
	.global motor_start
	.type motor_start, %function
	.thumb_func
motor_start:
	push.w {r4-r9}
	movw ip, #:lower16:.Lmotor_start_table
	movt ip, #:upper16:.Lmotor_start_table
	ldrb.w r4, [r1, #4]
	cmp.w r4, #0
	beq.w .Lmotor_start_1
	mov.w r0, #0
	pop.w {r4-r9}
	bx lr
.Lmotor_start_1:
	vldr s0, [ip, #0]
	ldr.w r4, [r1, #0]
	sbfx r5, r4, #0, #14
	ldr.w r7, [ip, #4]
	sdiv r6, r5, r7
	ldr.w r7, [ip, #4]
	mul r6, r6, r7
	sub.w r6, r5, r6
	sbfx r6, r6, #0, #17
	vmov s1, r6
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [ip, #8]
	ldr.w r7, [r1, #8]
	ldr.w r8, [ip, #12]
	ldr.w r9, [ip, #4]
	sdiv r5, r5, r9
	add.w r5, r8, r5
	sub.w r7, r7, r5
	vmov s2, r7
	vcvt.f32.s32 s2, s2
	vmul.f32 s1, s1, s2
	vldr s2, [r1, #12]
	vadd.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	vldr s2, [ip, #12]
	vldr s3, [r1, #16]
	vsub.f32 s2, s2, s3
	vabs.f32 s3, s2
	vldr s4, [ip, #16]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	and.w r7, r7, r8
	cmp.w r7, #0
	beq.w .Lmotor_start_2
	vldr s3, [ip, #20]
	vldr s4, [ip, #24]
	vldr s5, [ip, #28]
	vldr s6, [ip, #32]
	vldr s7, [ip, #24]
	vsub.f32 s7, s1, s7
	vldr s8, [ip, #36]
	vadd.f32 s8, s7, s8
	vldr s9, [ip, #36]
	vsub.f32 s9, s7, s9
	vabs.f32 s9, s9
	vsub.f32 s8, s8, s9
	vmul.f32 s6, s6, s8
	vmul.f32 s5, s5, s6
	vadd.f32 s4, s4, s5
	vldr s5, [ip, #40]
	vldr s8, [ip, #32]
	vsub.f32 s6, s7, s6
	vldr s7, [ip, #44]
	vadd.f32 s7, s6, s7
	vldr s9, [ip, #44]
	vsub.f32 s9, s6, s9
	vabs.f32 s9, s9
	vsub.f32 s7, s7, s9
	vmul.f32 s7, s8, s7
	vmul.f32 s5, s5, s7
	vadd.f32 s4, s4, s5
	vldr s5, [ip, #48]
	vldr s8, [ip, #32]
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #52]
	vadd.f32 s7, s6, s7
	vldr s9, [ip, #52]
	vsub.f32 s9, s6, s9
	vabs.f32 s9, s9
	vsub.f32 s7, s7, s9
	vmul.f32 s7, s8, s7
	vmul.f32 s5, s5, s7
	vadd.f32 s4, s4, s5
	vldr s5, [ip, #56]
	vldr s8, [ip, #32]
	vsub.f32 s6, s6, s7
	vldr s7, [ip, #60]
	vadd.f32 s7, s6, s7
	vldr s9, [ip, #60]
	vsub.f32 s6, s6, s9
	vabs.f32 s6, s6
	vsub.f32 s6, s7, s6
	vmul.f32 s6, s8, s6
	vmul.f32 s5, s5, s6
	vadd.f32 s4, s4, s5
	vneg.f32 s5, s4
	vldr s6, [ip, #12]
	vcmp.f32 s0, s6
	vmrs APSR_nzcv, fpscr
	vmov.f32 s6, s5
	it gt
	vmovgt.f32 s6, s4
	vldr s4, [ip, #24]
	vcmp.f32 s1, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s6
	it ls
	vmovls.f32 s1, s0
	vmul.f32 s0, s3, s1
	vadd.f32 s0, s2, s0
	vabs.f32 s1, s0
	vldr s2, [ip, #16]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	ldrb.w r8, [r0, #57]
	orr.w r8, r8, r7
	strb.w r8, [r0, #57]
	vldr s1, [ip, #64]
	vldr s2, [r0, #28]
	cmp.w r7, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #28]
	vldr s1, [ip, #68]
	vldr s2, [r0, #24]
	cmp.w r7, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #24]
	vldr s1, [ip, #12]
	vldr s2, [r0, #0]
	cmp.w r7, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #0]
	vldr s1, [r0, #32]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #32]
	vldr s0, [ip, #12]
	vldr s1, [r0, #20]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [ip, #12]
	vldr s1, [r0, #52]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #52]
	vldr s0, [ip, #12]
	vldr s1, [r0, #48]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #48]
	vldr s0, [ip, #72]
	vldr s1, [r0, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #16]
	vldr s0, [ip, #12]
	vldr s1, [r0, #12]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	vldr s0, [ip, #12]
	vldr s1, [r0, #8]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	vldr s0, [ip, #12]
	vldr s1, [r0, #4]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	ldr.w r8, [r0, #44]
	cmp.w r7, #0
	mov.w r9, r8
	it ne
	movne.w r9, r5
	str.w r9, [r0, #44]
	ldr.w r5, [r0, #40]
	cmp.w r7, #0
	mov.w r8, r5
	it ne
	movne.w r8, r6
	str.w r8, [r0, #40]
	ldr.w r5, [r0, #36]
	cmp.w r7, #0
	mov.w r6, r5
	it ne
	movne.w r6, r4
	str.w r6, [r0, #36]
	ldrb.w r4, [r0, #56]
	orr.w r4, r4, r7
	strb.w r4, [r0, #56]
	mov.w r0, #0
	cmp.w r7, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r9}
	bx lr
.Lmotor_start_2:
	mov.w r0, #0
	pop.w {r4-r9}
	bx lr
	.balign 4
.Lmotor_start_table:
	.word 0x39c90fdb @ 0.0003834952
	.word 0x00004000 @ 2.2959e-41
	.word 0x40c90fdb @ 6.2831855
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x42fa0000 @ 125.0
	.word 0x3dc49ba6 @ 0.096
	.word 0x3eaaaaab @ 0.33333334
	.word 0x3f000000 @ 0.5
	.word 0x3e9374bc @ 0.288
	.word 0x3e2aaaab @ 0.16666667
	.word 0x3f9374bc @ 1.152
	.word 0x3daaaaab @ 0.083333336
	.word 0x409374bc @ 4.608
	.word 0x3d2aaaab @ 0.041666668
	.word 0x419374bc @ 18.432
	.word 0x7149f2ca @ 1e30
	.word 0x41200000 @ 10.0
	.word 0x40490fdb @ 3.1415927
	.size motor_start, .-motor_start

	.section .text.motor_not_started, "ax", %progbits
	.balign 8
	.global motor_not_started
	.type motor_not_started, %function
	.thumb_func
motor_not_started:
	movw ip, #:lower16:.Lmotor_not_started_table
	movt ip, #:upper16:.Lmotor_not_started_table
	vldr s0, [ip, #0]
	vstr s0, [r0, #8]
	vldr s0, [ip, #0]
	vstr s0, [r0, #4]
	vldr s0, [ip, #0]
	vstr s0, [r0, #0]
	movw r0, #257
	bx lr
	.balign 4
.Lmotor_not_started_table:
	.word 0x00000000 @ 0.0
	.size motor_not_started, .-motor_not_started

	.section .text.motor_report_applied, "ax", %progbits
	.balign 8
	.global motor_report_applied
	.type motor_report_applied, %function
	.thumb_func
motor_report_applied:
	push.w {r4-r11}
	movw ip, #:lower16:.Lmotor_report_applied_table
	movt ip, #:upper16:.Lmotor_report_applied_table
	ldrb.w r4, [r0, #57]
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
	vldr s5, [r0, #24]
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
	vldr s3, [r0, #28]
	vldr s4, [r0, #28]
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
	vldr s2, [r0, #24]
	vldr s4, [r0, #28]
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
	vstr s2, [r0, #24]
	vstr s3, [r0, #28]
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
.Lmotor_report_applied_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x7149f2ca @ 1e30
	.word 0x3d000000 @ 0.03125
	.word 0x3e800000 @ 0.25
	.word 0x00000000 @ 0.0
	.size motor_report_applied, .-motor_report_applied

	.section .text.motor_estimates, "ax", %progbits
	.balign 8
	.global motor_estimates
	.type motor_estimates, %function
	.thumb_func
motor_estimates:
	push.w {r4-r5}
	movw ip, #:lower16:.Lmotor_estimates_table
	movt ip, #:upper16:.Lmotor_estimates_table
	ldrb.w r4, [r0, #57]
	cmp.w r4, #0
	beq.w .Lmotor_estimates_1
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #40]
	vmov s1, r4
	vcvt.f32.s32 s1, s1
	vmul.f32 s0, s0, s1
	vldr s1, [r0, #4]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #4]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #4]
	vldr s0, [ip, #8]
	vldr s1, [r0, #12]
	vldr s2, [ip, #4]
	vdiv.f32 s1, s1, s2
	vmul.f32 s0, s0, s1
	vstr s0, [r1, #16]
	vstr s1, [r1, #12]
	vldr s0, [r0, #8]
	vldr s1, [ip, #4]
	vdiv.f32 s0, s0, s1
	vstr s0, [r1, #8]
	ldr.w r4, [r0, #44]
	str.w r4, [r1, #0]
	mov.w r0, #1
	pop.w {r4-r5}
	bx lr
.Lmotor_estimates_1:
	vldr s0, [ip, #12]
	vstr s0, [r1, #16]
	vldr s0, [ip, #12]
	vstr s0, [r1, #12]
	vldr s0, [ip, #12]
	vstr s0, [r1, #8]
	vldr s0, [ip, #12]
	vstr s0, [r1, #4]
	ldr.w r4, [ip, #12]
	str.w r4, [r1, #0]
	mov.w r0, #0
	pop.w {r4-r5}
	bx lr
	.balign 4
.Lmotor_estimates_table:
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3f800000 @ 1.0
	.word 0xb951b717 @ -0.0002
	.word 0x00000000 @ 0.0
	.size motor_estimates, .-motor_estimates

	.section .text.motor_reset, "ax", %progbits
	.balign 8
	.global motor_reset
	.type motor_reset, %function
	.thumb_func
motor_reset:
	push.w {r4-r7}
	movw ip, #:lower16:.Lmotor_reset_table
	movt ip, #:upper16:.Lmotor_reset_table
	vldr s0, [ip, #0]
	vldr s1, [r0, #28]
	ldrb.w r4, [r0, #57]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #28]
	vldr s0, [ip, #0]
	vldr s1, [r0, #24]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #24]
	vldr s0, [ip, #0]
	vldr s1, [r0, #0]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	vldr s0, [ip, #0]
	vldr s1, [r0, #32]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #32]
	vldr s0, [ip, #0]
	vldr s1, [r0, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [ip, #0]
	vldr s1, [r0, #52]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #52]
	vldr s0, [ip, #0]
	vldr s1, [r0, #48]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #48]
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
	vldr s1, [r0, #8]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	vldr s0, [ip, #0]
	vldr s1, [r0, #4]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	ldr.w r5, [ip, #0]
	ldr.w r6, [r0, #44]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #44]
	ldr.w r6, [r0, #40]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #40]
	ldr.w r6, [r0, #36]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #36]
	eor.w r4, r4, #1
	ldrb.w r5, [r0, #56]
	and.w r4, r4, r5
	strb.w r4, [r0, #56]
	mov.w r4, #0
	strb.w r4, [r0, #57]
	pop.w {r4-r7}
	bx lr
	.balign 4
.Lmotor_reset_table:
	.word 0x00000000 @ 0.0
	.size motor_reset, .-motor_reset
