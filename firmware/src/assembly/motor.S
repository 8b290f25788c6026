@ The functions of motor.h, exported by version 0.1.0.
@ Design 0x08a0e86d (FNV-1a, with which its words in Rust begin).
@ Changed by --set drive.period_s=1e-3
@ Changed by --set drive.gain_sets=1
@ Scenario motor.toml (CRC-32 0xe1ca76bf):
@
@     # What the image `motor` is designed from: a motor with one encoder, at 10 kHz.
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
@     period_s = 1e-4
@     fallback = 0.0
@
@     [monitor]
@     reaction = "fallback"

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
	ldrb.w ip, [r0, #40]
	ldrb.w r3, [r1, #4]
	orrs.w ip, ip, r3
	bne.w .Lmotor_tick_u_rest
	ldr.w ip, [r1, #8]
	ldr.w r3, [r0, #32]
	sub.w ip, ip, r3
	vmov s13, ip
	ldr.w ip, [r1, #0]
	ldr.w r3, [r0, #24]
	ldr.w r2, [r0, #28]
	sub.w r3, ip, r3
	sbfx r3, r3, #0, #14
	add.w r2, r2, r3
	vmov s14, s15, r3, r2
	add.w r1, r1, #12
	adr.w r3, .Lmotor_tick_u_table
	vldmia r3!, {s12}
	vldmia r0!, {s6-s11}
	vmul.f32 s6, s12, s6
	vcvt.f32.s32 s15, s15
	vldmia r3!, {s0-s5}
	vmul.f32 s0, s0, s11
	vadd.f32 s6, s9, s6
	vadd.f32 s12, s1, s10
	vmul.f32 s15, s2, s15
	vmul.f32 s1, s3, s8
	vcvt.f32.s32 s14, s14
	vmul.f32 s4, s4, s6
	vmul.f32 s6, s3, s6
	vadd.f32 s4, s1, s4
	vmul.f32 s8, s5, s8
	vadd.f32 s4, s7, s4
	vadd.f32 s8, s8, s6
	vmul.f32 s14, s2, s14
	vcvt.f32.s32 s13, s13
	vsub.f32 s14, s4, s14
	vldmia r3!, {s2-s7}
	vmul.f32 s1, s2, s11
	vmul.f32 s13, s3, s13
	vmul.f32 s4, s10, s4
	vmul.f32 s10, s5, s14
	vsub.f32 s5, s11, s1
	vmul.f32 s6, s6, s14
	vmul.f32 s7, s7, s14
	vabs.f32 s11, s14
	vsub.f32 s3, s9, s7
	vsub.f32 s1, s14, s10
	vsub.f32 s2, s8, s6
	vldmia r1!, {s6-s10}
	vsub.f32 s14, s10, s7
	vldmia r3!, {s8-s10}
	vmul.f32 s8, s8, s14
	vmul.f32 s14, s9, s2
	vadd.f32 s9, s15, s1
	vadd.f32 s14, s14, s3
	vadd.f32 s13, s13, s6
	vmul.f32 s6, s10, s14
	vsub.f32 s14, s9, s13
	vsub.f32 s7, s2, s7
	vcmp.f32 s11, s12
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_24_32
	vldmia r3!, {s9-s13}
	vmul.f32 s9, s9, s7
	vneg.f32 s6, s6
	vadd.f32 s9, s6, s9
	vmul.f32 s10, s10, s14
	vadd.f32 s9, s9, s8
	vadd.f32 s6, s7, s10
	vadd.f32 s0, s9, s0
	vmul.f32 s6, s11, s6
	vabs.f32 s15, s15
	vadd.f32 s0, s0, s6
	vcmp.f32 s15, s12
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_24_32
	vabs.f32 s6, s0
	vmov.f32 s15, #10.0
	vmov.f32 s14, #-10.0
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s15
	vcmp.f32 s0, s14
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s14
	vcmp.f32 s6, s13
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_u_away_24_32
	vstmdb r0!, {s0-s5}
	str.w ip, [r0, #24]
	str.w r2, [r0, #28]
	mov.w ip, #0
	str.w ip, [r0, #36]
	bx lr
.Lmotor_tick_u_away_24_32:
	sub.w r0, r0, #24
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
	.word 0x4062594d @ 3.5367005
	.word 0x3d145f16 @ 0.036223494
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3a831198 @ 0.000999975
	.word 0x3506372a @ 4.9999164e-7
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x3d782a02 @ 0.060586937
	.word 0x40c90fdb @ 6.2831855
	.word 0x3f7693e9 @ 0.96319443
	.word 0x3ebb850f @ 0.36624953
	.word 0x428a9a62 @ 69.30153
	.word 0x45a4393b @ 5255.154
	.word 0x408000d2 @ 4.0001
	.word 0xbd4ccccd @ -0.05
	.word 0x3b83126f @ 0.004
	.word 0xbef0f274 @ -0.47059977
	.word 0x42fa0000 @ 125.0
	.word 0xc070f274 @ -3.7647982
	.word 0x406231d6 @ 3.5342917
	.word 0x45a00000 @ 5120.0
	.size motor_tick_u, .-motor_tick_u

	.section .text.motor_tick, "ax", %progbits
	.balign 8
	.global motor_tick
	.type motor_tick, %function
	.thumb_func
motor_tick:
	ldrb.w ip, [r0, #40]
	ldrb.w r3, [r1, #4]
	orrs.w ip, ip, r3
	bne.w .Lmotor_tick_rest
	push.w {r4-r5}
	ldr.w ip, [r1, #8]
	ldr.w r3, [r0, #32]
	sub.w ip, ip, r3
	vmov s13, ip
	ldr.w ip, [r1, #0]
	ldr.w r3, [r0, #24]
	ldr.w r4, [r0, #28]
	sub.w r3, ip, r3
	sbfx r3, r3, #0, #14
	add.w r4, r4, r3
	vmov s14, s15, r3, r4
	add.w r1, r1, #12
	adr.w r3, .Lmotor_tick_table
	mov.w r5, #0
	vcvt.f32.s32 s14, s14
	vcvt.f32.s32 s6, s15
	vldmia r3!, {s7-s12}
	vldmia r0!, {s0-s5}
	vmul.f32 s0, s7, s0
	vmul.f32 s15, s8, s6
	vadd.f32 s6, s3, s0
	vmul.f32 s9, s9, s2
	vmul.f32 s14, s8, s14
	vmul.f32 s10, s10, s6
	vabs.f32 s8, s15
	vcvt.f32.s32 s13, s13
	vmul.f32 s7, s11, s2
	vmul.f32 s6, s11, s6
	vadd.f32 s11, s7, s10
	vcmp.f32 s8, s12
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_24_12
	vadd.f32 s7, s1, s11
	vadd.f32 s6, s9, s6
	vsub.f32 s14, s7, s14
	vldmia r3!, {s7-s12}
	vmul.f32 s7, s7, s14
	vmul.f32 s8, s8, s14
	vsub.f32 s3, s3, s7
	vmul.f32 s9, s9, s14
	vmul.f32 s13, s10, s13
	vsub.f32 s2, s6, s8
	vsub.f32 s1, s14, s9
	vldmia r1!, {s6-s10}
	vadd.f32 s15, s15, s1
	vmul.f32 s8, s11, s2
	vadd.f32 s6, s13, s6
	vsub.f32 s13, s2, s7
	vsub.f32 s6, s15, s6
	vadd.f32 s8, s8, s3
	vsub.f32 s7, s10, s7
	vmul.f32 s15, s12, s5
	vldmia r3!, {s9-s12}
	vmul.f32 s9, s9, s6
	vmul.f32 s10, s10, s13
	vmul.f32 s11, s11, s8
	vadd.f32 s6, s13, s9
	vabs.f32 s8, s14
	vstr s6, [r2, #4]
	vneg.f32 s9, s11
	vadd.f32 s9, s9, s10
	vmul.f32 s7, s12, s7
	vldmia r3!, {s10-s14}
	vadd.f32 s10, s10, s4
	vsub.f32 s0, s6, s5
	vadd.f32 s7, s9, s7
	vstr s0, [r2, #8]
	vmul.f32 s6, s11, s6
	vadd.f32 s15, s7, s15
	vmul.f32 s4, s4, s12
	vadd.f32 s6, s15, s6
	vmov.f32 s15, #10.0
	vmov.f32 s9, #-10.0
	vmov.f32 s0, s6
	vcmp.f32 s0, s15
	vmrs APSR_nzcv, fpscr
	it gt
	vmovgt.f32 s0, s15
	vcmp.f32 s0, s9
	vmrs APSR_nzcv, fpscr
	it mi
	vmovmi.f32 s0, s9
	vmul.f32 s13, s13, s5
	vabs.f32 s7, s6
	vsub.f32 s5, s5, s13
	vcmp.f32 s0, s6
	vmrs APSR_nzcv, fpscr
	it ne
	addne r5, #2
	vstr s0, [r2, #0]
	vcmp.f32 s7, s14
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_24_32
	vcmp.f32 s8, s10
	vmrs APSR_nzcv, fpscr
	bhi.w .Lmotor_tick_away_24_32
	vstmdb r0!, {s0-s5}
	str.w ip, [r0, #24]
	str.w r4, [r0, #28]
	mov.w ip, #0
	str.w ip, [r0, #36]
	mov.w r0, r5
	pop.w {r4-r5}
	bx lr
.Lmotor_tick_away_24_12:
	sub.w r0, r0, #24
	sub.w r1, r1, #12
	b.w .Lmotor_tick_leave
.Lmotor_tick_away_24_32:
	sub.w r0, r0, #24
	sub.w r1, r1, #32
	b.w .Lmotor_tick_leave
.Lmotor_tick_leave:
	pop.w {r4-r5}
.Lmotor_tick_rest:
	b.w motor_rest
	.balign 4
.Lmotor_tick_table:
	.word 0x437a0000 @ 250.0
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x3506372a @ 4.9999164e-7
	.word 0x3a831198 @ 0.000999975
	.word 0x406231d6 @ 3.5342917
	.word 0x45a4393b @ 5255.154
	.word 0x428a9a62 @ 69.30153
	.word 0x3ebb850f @ 0.36624953
	.word 0x40c90fdb @ 6.2831855
	.word 0xbd4ccccd @ -0.05
	.word 0x4062594d @ 3.5367005
	.word 0x42fa0000 @ 125.0
	.word 0xbef0f274 @ -0.47059977
	.word 0x3b83126f @ 0.004
	.word 0x408000d2 @ 4.0001
	.word 0x3d145f16 @ 0.036223494
	.word 0xc070f274 @ -3.7647982
	.word 0x3f7693e9 @ 0.96319443
	.word 0x3d782a02 @ 0.060586937
	.word 0x45a00000 @ 5120.0
	.size motor_tick, .-motor_tick

	.section .text.motor_rest, "ax", %progbits
	.balign 8
	.global motor_rest
	.type motor_rest, %function
	.thumb_func
motor_rest:
	push.w {r4-r6, lr}
	sub.w sp, sp, #8
	mov r4, r0
	mov r5, r1
	mov r6, r2
	mov r2, sp
	ldrb.w ip, [r0, #40]
	cmp.w ip, #0
	beq.w .Lmotor_goes_on
	bl motor_begin
	b.w .Lmotor_known
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
	b.w .Lmotor_done
.Lmotor_unknown:
	mov r0, r4
	mov r1, r5
	mov r2, r6
	bl motor_give_up
.Lmotor_done:
	add.w sp, sp, #8
	pop.w {r4-r6, pc}
	.size motor_rest, .-motor_rest

	.section .text.motor_begin, "ax", %progbits
	.balign 8
	.global motor_begin
	.type motor_begin, %function
	.thumb_func
motor_begin:
	push.w {r4-r11}
	adr.w ip, .Lmotor_begin_table
	mov.w r4, #0
	strb.w r4, [r0, #40]
	strb.w r4, [r2, #0]
	ldr.w r4, [r0, #32]
	ldr.w r5, [r0, #28]
	ldr.w r6, [r1, #0]
	ldr.w r7, [r0, #24]
	sub.w r8, r6, r7
	sbfx r8, r8, #0, #14
	add.w r8, r5, r8
	ldrb.w r10, [r1, #4]
	cmp.w r10, #0
	mov.w r9, r8
	it ne
	movne.w r9, r5
	ldr.w r8, [ip, #0]
	sdiv r5, r9, r8
	add.w r4, r4, r5
	str.w r4, [r0, #32]
	ldr.w r5, [ip, #0]
	sdiv r4, r9, r5
	ldr.w r5, [ip, #0]
	mul r4, r4, r5
	sub.w r4, r9, r4
	sbfx r4, r4, #0, #17
	str.w r4, [r0, #28]
	cmp.w r10, #0
	mov.w r4, r6
	it ne
	movne.w r4, r7
	str.w r4, [r0, #24]
	pop.w {r4-r11}
	bx lr
	.balign 4
.Lmotor_begin_table:
	.word 0x00004000 @ 2.2959e-41
	.size motor_begin, .-motor_begin

	.section .text.motor_observe, "ax", %progbits
	.balign 8
	.global motor_observe
	.type motor_observe, %function
	.thumb_func
motor_observe:
	push.w {r4-r11}
	adr.w ip, .Lmotor_observe_table
	vldr s0, [r0, #36]
	vldr s1, [ip, #0]
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #0]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ge
	movge.w r4, #1
	movlt.w r4, #0
	vldr s1, [ip, #4]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	and.w r4, r4, r5
	vldr s1, [r0, #4]
	vldr s2, [ip, #8]
	vldr s3, [r0, #8]
	vmul.f32 s2, s2, s3
	vldr s3, [ip, #12]
	vldr s4, [r0, #12]
	vldr s5, [ip, #16]
	vldr s6, [r0, #0]
	vmul.f32 s5, s5, s6
	vadd.f32 s4, s4, s5
	vmul.f32 s3, s3, s4
	vadd.f32 s2, s2, s3
	vadd.f32 s1, s1, s2
	vldr s2, [ip, #20]
	ldr.w r5, [r1, #0]
	ldr.w r6, [r0, #24]
	sub.w r7, r5, r6
	sbfx r7, r7, #0, #14
	vmov s3, r7
	vcvt.f32.s32 s3, s3
	vmul.f32 s2, s2, s3
	vsub.f32 s2, s1, s2
	vabs.f32 s3, s2
	vldr s5, [ip, #24]
	vldr s6, [r0, #16]
	vadd.f32 s5, s5, s6
	vcmp.f32 s3, s5
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	orr.w r9, r4, r8
	ldrb.w r11, [r1, #4]
	cmp.w r11, #0
	mov.w r10, r9
	it ne
	movne.w r10, r4
	eor.w r4, r8, #1
	orr.w r4, r11, r4
	strb.w r4, [r2, #0]
	vldr s3, [ip, #28]
	eor.w r4, r11, #1
	and.w r4, r4, r8
	cmp.w r4, #0
	vmov.f32 s5, s0
	it ne
	vmovne.f32 s5, s3
	vstr s5, [r0, #36]
	ldr.w r8, [r0, #28]
	add.w r7, r8, r7
	cmp.w r4, #0
	mov.w r9, r8
	it ne
	movne.w r9, r7
	str.w r9, [r0, #28]
	vldr s0, [r0, #12]
	vldr s3, [ip, #32]
	vmul.f32 s3, s3, s2
	vsub.f32 s0, s0, s3
	vldr s3, [r0, #12]
	cmp.w r4, #0
	it ne
	vmovne.f32 s3, s0
	vldr s0, [ip, #36]
	vldr s5, [r0, #8]
	vmul.f32 s0, s0, s5
	vldr s5, [ip, #8]
	vmul.f32 s4, s5, s4
	vadd.f32 s0, s0, s4
	vldr s4, [ip, #40]
	vmul.f32 s4, s4, s2
	vsub.f32 s4, s0, s4
	cmp.w r4, #0
	vmov.f32 s5, s0
	it ne
	vmovne.f32 s5, s4
	vldr s0, [ip, #44]
	vmul.f32 s0, s0, s2
	vsub.f32 s0, s2, s0
	cmp.w r4, #0
	vmov.f32 s2, s1
	it ne
	vmovne.f32 s2, s0
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #24]
	vstr s2, [r0, #4]
	vstr s5, [r0, #8]
	vstr s3, [r0, #12]
	vldr s0, [r0, #16]
	vldr s1, [ip, #48]
	vmul.f32 s0, s0, s1
	vstr s0, [r0, #16]
	mov.w r0, #0
	cmp.w r10, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r11}
	bx lr
	.balign 4
.Lmotor_observe_table:
	.word 0x3f800000 @ 1.0
	.word 0x42480000 @ 50.0
	.word 0x3a831198 @ 0.000999975
	.word 0x3506372a @ 4.9999164e-7
	.word 0x437a0000 @ 250.0
	.word 0x39c90fdb @ 0.0003834952
	.word 0x3d145f16 @ 0.036223494
	.word 0x00000000 @ 0.0
	.word 0x45a4393b @ 5255.154
	.word 0x3f7ffcb9 @ 0.99995
	.word 0x428a9a62 @ 69.30153
	.word 0x3ebb850f @ 0.36624953
	.word 0x3f7693e9 @ 0.96319443
	.size motor_observe, .-motor_observe

	.section .text.motor_law, "ax", %progbits
	.balign 8
	.global motor_law
	.type motor_law, %function
	.thumb_func
motor_law:
	push.w {r4-r11}
	adr.w ip, .Lmotor_law_table
	vldr s0, [ip, #0]
	vldr s1, [ip, #4]
	vldr s2, [r0, #8]
	vmul.f32 s1, s1, s2
	vldr s2, [r0, #12]
	vadd.f32 s1, s1, s2
	vmul.f32 s0, s0, s1
	vneg.f32 s0, s0
	vldr s1, [ip, #8]
	vldr s2, [r0, #8]
	vldr s3, [r1, #16]
	vsub.f32 s2, s2, s3
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #12]
	vldr s3, [r1, #28]
	vldr s4, [r1, #16]
	vsub.f32 s3, s3, s4
	vmul.f32 s1, s1, s3
	vadd.f32 s0, s0, s1
	vldr s1, [ip, #16]
	vldr s3, [r0, #20]
	vmul.f32 s1, s1, s3
	vadd.f32 s1, s0, s1
	vldr s3, [ip, #20]
	vldr s4, [ip, #24]
	vldr s5, [ip, #28]
	ldr.w r4, [r0, #28]
	vmov s6, r4
	vcvt.f32.s32 s6, s6
	vmul.f32 s5, s5, s6
	vldr s6, [r0, #4]
	vadd.f32 s6, s5, s6
	vldr s7, [ip, #32]
	ldr.w r5, [r1, #8]
	ldr.w r6, [r0, #32]
	sub.w r5, r5, r6
	vmov s8, r5
	vcvt.f32.s32 s8, s8
	vmul.f32 s7, s7, s8
	vldr s8, [r1, #12]
	vadd.f32 s7, s7, s8
	vsub.f32 s6, s6, s7
	vmul.f32 s4, s4, s6
	vadd.f32 s2, s2, s4
	vmul.f32 s3, s3, s2
	vadd.f32 s1, s1, s3
	vabs.f32 s3, s1
	vldr s4, [ip, #36]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r5, #1
	movhi.w r5, #0
	cmp.w r5, #0
	beq.w .Lmotor_law_1
	vabs.f32 s3, s5
	vldr s4, [ip, #40]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_2
	vldr s3, [ip, #44]
	vldr s4, [ip, #48]
	vldr s5, [ip, #52]
	vmul.f32 s5, s5, s2
	vadd.f32 s0, s0, s5
	vldr s5, [ip, #56]
	vldr s6, [r0, #0]
	vldr s7, [ip, #56]
	vldr s8, [r0, #0]
	vabs.f32 s8, s8
	vldr s9, [ip, #60]
	vcmp.f32 s8, s9
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s7, s6
	vmul.f32 s5, s5, s7
	vldr s6, [ip, #56]
	vadd.f32 s5, s5, s6
	vabs.f32 s6, s0
	vldr s7, [ip, #60]
	vcmp.f32 s6, s7
	vmrs APSR_nzcv, fpscr
	vmov.f32 s6, s5
	it ls
	vmovls.f32 s6, s0
	cmp.w r5, #0
	vmov.f32 s0, s6
	it ne
	vmovne.f32 s0, s1
	vldr s5, [ip, #48]
	vcmp.f32 s0, s5
	vmrs APSR_nzcv, fpscr
	vmov.f32 s5, s1
	it mi
	vmovmi.f32 s5, s4
	vldr s4, [ip, #44]
	vcmp.f32 s0, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s5
	it gt
	vmovgt.f32 s0, s3
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	ldrb.w r5, [r2, #0]
	vstr s0, [r3, #0]
	vldr s1, [r0, #20]
	vsub.f32 s1, s2, s1
	vstr s1, [r3, #8]
	vstr s2, [r3, #4]
	vstr s0, [r0, #0]
	vldr s0, [r0, #20]
	vldr s1, [ip, #64]
	vldr s2, [r0, #20]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #20]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
.Lmotor_law_2:
	vldr s3, [ip, #44]
	vldr s4, [ip, #48]
	vldr s6, [ip, #52]
	vmul.f32 s6, s6, s2
	vadd.f32 s0, s0, s6
	vldr s6, [ip, #56]
	vldr s7, [r0, #0]
	vldr s8, [ip, #56]
	vldr s9, [r0, #0]
	vabs.f32 s9, s9
	vldr s10, [ip, #60]
	vcmp.f32 s9, s10
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s8, s7
	vmul.f32 s6, s6, s8
	vldr s7, [ip, #56]
	vadd.f32 s6, s6, s7
	vabs.f32 s7, s0
	vldr s8, [ip, #60]
	vcmp.f32 s7, s8
	vmrs APSR_nzcv, fpscr
	vmov.f32 s7, s6
	it ls
	vmovls.f32 s7, s0
	cmp.w r5, #0
	vmov.f32 s0, s7
	it ne
	vmovne.f32 s0, s1
	vldr s6, [ip, #48]
	vcmp.f32 s0, s6
	vmrs APSR_nzcv, fpscr
	vmov.f32 s6, s1
	it mi
	vmovmi.f32 s6, s4
	vldr s4, [ip, #44]
	vcmp.f32 s0, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s6
	it gt
	vmovgt.f32 s0, s3
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r5, #1
	moveq.w r5, #0
	ldrb.w r7, [r2, #0]
	vstr s0, [r3, #0]
	vldr s1, [r0, #20]
	vsub.f32 s1, s2, s1
	vstr s1, [r3, #8]
	vstr s2, [r3, #4]
	vstr s0, [r0, #0]
	ldr.w r8, [ip, #68]
	add.w r9, r6, r8
	sub.w r6, r6, r8
	vldr s0, [ip, #56]
	vcmp.f32 s5, s0
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	cmp.w r10, #0
	mov.w r8, r6
	it ne
	movne.w r8, r9
	str.w r8, [r0, #32]
	vldr s0, [r0, #20]
	vldr s1, [ip, #64]
	vldr s2, [r0, #20]
	vmul.f32 s1, s1, s2
	vsub.f32 s0, s0, s1
	vstr s0, [r0, #20]
	ldr.w r6, [ip, #72]
	sub.w r8, r4, r6
	add.w r4, r4, r6
	cmp.w r10, #0
	mov.w r6, r4
	it ne
	movne.w r6, r8
	sbfx r4, r6, #0, #17
	str.w r4, [r0, #28]
	mov.w r0, #0
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #2
	cmp.w r7, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
.Lmotor_law_1:
	vldr s3, [ip, #52]
	vmul.f32 s3, s3, s2
	vadd.f32 s0, s0, s3
	vabs.f32 s3, s0
	vldr s4, [ip, #60]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	cmp.w r7, #0
	beq.w .Lmotor_law_3
	vabs.f32 s3, s5
	vldr s4, [ip, #40]
	vcmp.f32 s3, s4
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Lmotor_law_4
	vldr s3, [ip, #44]
	vldr s4, [ip, #48]
	vldr s5, [ip, #56]
	vldr s6, [r0, #0]
	vldr s7, [ip, #56]
	vldr s8, [r0, #0]
	vabs.f32 s8, s8
	vldr s9, [ip, #60]
	vcmp.f32 s8, s9
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s7, s6
	vmul.f32 s5, s5, s7
	vldr s6, [ip, #56]
	vadd.f32 s5, s5, s6
	cmp.w r7, #0
	vmov.f32 s6, s5
	it ne
	vmovne.f32 s6, s0
	cmp.w r5, #0
	vmov.f32 s5, s6
	it ne
	vmovne.f32 s5, s1
	vldr s1, [ip, #48]
	vcmp.f32 s5, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s0
	it mi
	vmovmi.f32 s1, s4
	vldr s4, [ip, #44]
	vcmp.f32 s5, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s1
	it gt
	vmovgt.f32 s4, s3
	vcmp.f32 s4, s0
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r4, #1
	moveq.w r4, #0
	ldrb.w r5, [r2, #0]
	vstr s4, [r3, #0]
	vstr s2, [r3, #4]
	vldr s0, [ip, #56]
	vstr s0, [r3, #8]
	vstr s4, [r0, #0]
	vldr s0, [ip, #64]
	vmul.f32 s0, s0, s2
	vsub.f32 s0, s2, s0
	vstr s0, [r0, #20]
	mov.w r0, #0
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #2
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
.Lmotor_law_4:
	vldr s3, [ip, #44]
	vldr s4, [ip, #48]
	vldr s6, [ip, #56]
	vldr s7, [r0, #0]
	vldr s8, [ip, #56]
	vldr s9, [r0, #0]
	vabs.f32 s9, s9
	vldr s10, [ip, #60]
	vcmp.f32 s9, s10
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s8, s7
	vmul.f32 s6, s6, s8
	vldr s7, [ip, #56]
	vadd.f32 s6, s6, s7
	cmp.w r7, #0
	vmov.f32 s7, s6
	it ne
	vmovne.f32 s7, s0
	cmp.w r5, #0
	vmov.f32 s6, s7
	it ne
	vmovne.f32 s6, s1
	vldr s1, [ip, #48]
	vcmp.f32 s6, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s0
	it mi
	vmovmi.f32 s1, s4
	vldr s4, [ip, #44]
	vcmp.f32 s6, s4
	vmrs APSR_nzcv, fpscr
	vmov.f32 s4, s1
	it gt
	vmovgt.f32 s4, s3
	vcmp.f32 s4, s0
	vmrs APSR_nzcv, fpscr
	ite ne
	movne.w r5, #1
	moveq.w r5, #0
	ldrb.w r7, [r2, #0]
	vstr s4, [r3, #0]
	vstr s2, [r3, #4]
	vldr s0, [ip, #56]
	vstr s0, [r3, #8]
	vstr s4, [r0, #0]
	vldr s0, [ip, #64]
	vmul.f32 s0, s0, s2
	vsub.f32 s0, s2, s0
	vstr s0, [r0, #20]
	ldr.w r8, [ip, #68]
	add.w r9, r6, r8
	sub.w r6, r6, r8
	vldr s0, [ip, #56]
	vcmp.f32 s5, s0
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r10, #1
	movle.w r10, #0
	cmp.w r10, #0
	mov.w r8, r6
	it ne
	movne.w r8, r9
	str.w r8, [r0, #32]
	ldr.w r6, [ip, #72]
	sub.w r8, r4, r6
	add.w r4, r4, r6
	cmp.w r10, #0
	mov.w r6, r4
	it ne
	movne.w r6, r8
	sbfx r4, r6, #0, #17
	str.w r4, [r0, #28]
	mov.w r0, #0
	cmp.w r5, #0
	it ne
	orrne.w r0, r0, #2
	cmp.w r7, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
.Lmotor_law_3:
	vabs.f32 s2, s5
	vldr s3, [ip, #40]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r8, #1
	movhi.w r8, #0
	cmp.w r8, #0
	beq.w .Lmotor_law_5
	ldrb.w r4, [r2, #0]
	vldr s2, [ip, #44]
	vldr s3, [ip, #48]
	vldr s4, [ip, #56]
	vldr s5, [r0, #0]
	vldr s6, [ip, #56]
	vldr s7, [r0, #0]
	vabs.f32 s7, s7
	vldr s8, [ip, #60]
	vcmp.f32 s7, s8
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s6, s5
	vmul.f32 s4, s4, s6
	vldr s5, [ip, #56]
	vadd.f32 s4, s4, s5
	cmp.w r7, #0
	vmov.f32 s5, s4
	it ne
	vmovne.f32 s5, s0
	cmp.w r5, #0
	vmov.f32 s0, s5
	it ne
	vmovne.f32 s0, s1
	vldr s1, [ip, #48]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s4
	it mi
	vmovmi.f32 s1, s3
	vldr s3, [ip, #44]
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s1
	it gt
	vmovgt.f32 s0, s2
	vstr s0, [r3, #0]
	vldr s1, [ip, #56]
	vstr s1, [r3, #8]
	vldr s1, [ip, #56]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	mov.w r0, #1
	cmp.w r4, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
.Lmotor_law_5:
	ldrb.w r8, [r2, #0]
	vldr s2, [ip, #44]
	vldr s3, [ip, #48]
	vldr s4, [ip, #56]
	vldr s6, [r0, #0]
	vldr s7, [ip, #56]
	vldr s8, [r0, #0]
	vabs.f32 s8, s8
	vldr s9, [ip, #60]
	vcmp.f32 s8, s9
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s7, s6
	vmul.f32 s4, s4, s7
	vldr s6, [ip, #56]
	vadd.f32 s4, s4, s6
	cmp.w r7, #0
	vmov.f32 s6, s4
	it ne
	vmovne.f32 s6, s0
	cmp.w r5, #0
	vmov.f32 s0, s6
	it ne
	vmovne.f32 s0, s1
	vldr s1, [ip, #48]
	vcmp.f32 s0, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s4
	it mi
	vmovmi.f32 s1, s3
	vldr s3, [ip, #44]
	vcmp.f32 s0, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s0, s1
	it gt
	vmovgt.f32 s0, s2
	vstr s0, [r3, #0]
	vldr s1, [ip, #56]
	vstr s1, [r3, #8]
	vldr s1, [ip, #56]
	vstr s1, [r3, #4]
	vstr s0, [r0, #0]
	ldr.w r5, [ip, #68]
	add.w r7, r6, r5
	sub.w r5, r6, r5
	vldr s0, [ip, #56]
	vcmp.f32 s5, s0
	vmrs APSR_nzcv, fpscr
	ite gt
	movgt.w r9, #1
	movle.w r9, #0
	cmp.w r9, #0
	mov.w r6, r5
	it ne
	movne.w r6, r7
	str.w r6, [r0, #32]
	ldr.w r5, [ip, #72]
	sub.w r6, r4, r5
	add.w r4, r4, r5
	cmp.w r9, #0
	mov.w r5, r4
	it ne
	movne.w r5, r6
	sbfx r4, r5, #0, #17
	str.w r4, [r0, #28]
	mov.w r0, #1
	cmp.w r8, #0
	it ne
	orrne.w r0, r0, #8
	pop.w {r4-r11}
	bx lr
	.balign 4
.Lmotor_law_table:
	.word 0x3b83126f @ 0.004
	.word 0xbd4ccccd @ -0.05
	.word 0xbef0f274 @ -0.47059977
	.word 0x408000d2 @ 4.0001
	.word 0x4062594d @ 3.5367005
	.word 0xc070f274 @ -3.7647982
	.word 0x42fa0000 @ 125.0
	.word 0x39c90fdb @ 0.0003834952
	.word 0x40c90fdb @ 6.2831855
	.word 0x45a00000 @ 5120.0
	.word 0x406231d6 @ 3.5342917
	.word 0x41200000 @ 10.0
	.word 0xc1200000 @ -10.0
	.word 0xbe69926a @ -0.22809759
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x3d782a02 @ 0.060586937
	.word 0x00000001 @ 1e-45
	.word 0x00004000 @ 2.2959e-41
	.size motor_law, .-motor_law

	.section .text.motor_give_up, "ax", %progbits
	.balign 8
	.global motor_give_up
	.type motor_give_up, %function
	.thumb_func
motor_give_up:
	push.w {r4-r9}
	adr.w ip, .Lmotor_give_up_table
	ldrb.w r4, [r1, #4]
	cmp.w r4, #0
	beq.w .Lmotor_give_up_1
	vldr s0, [ip, #0]
	vldr s1, [ip, #4]
	vldr s2, [ip, #8]
	vldr s3, [r0, #0]
	vldr s4, [ip, #8]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #12]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #8]
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #4]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it mi
	vmovmi.f32 s3, s1
	vldr s1, [ip, #0]
	vcmp.f32 s2, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s3
	it gt
	vmovgt.f32 s1, s0
	vstr s1, [r2, #0]
	vldr s0, [ip, #16]
	vstr s0, [r0, #16]
	vldr s0, [ip, #8]
	vstr s0, [r2, #8]
	vldr s0, [ip, #8]
	vstr s0, [r2, #4]
	ldr.w r5, [r0, #32]
	ldr.w r6, [r0, #28]
	ldr.w r7, [r1, #0]
	ldr.w r8, [r0, #24]
	sub.w r7, r7, r8
	sbfx r7, r7, #0, #14
	add.w r7, r6, r7
	cmp.w r4, #0
	mov.w r8, r7
	it ne
	movne.w r8, r6
	ldr.w r6, [ip, #20]
	sdiv r4, r8, r6
	add.w r4, r5, r4
	str.w r4, [r0, #32]
	ldr.w r5, [ip, #20]
	sdiv r4, r8, r5
	ldr.w r5, [ip, #20]
	mul r4, r4, r5
	sub.w r4, r8, r4
	sbfx r4, r4, #0, #17
	str.w r4, [r0, #28]
	vstr s1, [r0, #0]
	mov.w r0, #9
	pop.w {r4-r9}
	bx lr
.Lmotor_give_up_1:
	vldr s0, [ip, #0]
	vldr s1, [ip, #4]
	vldr s2, [ip, #8]
	vldr s3, [r0, #0]
	vldr s4, [ip, #8]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #12]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #8]
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #4]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it mi
	vmovmi.f32 s3, s1
	vldr s1, [ip, #0]
	vcmp.f32 s2, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s3
	it gt
	vmovgt.f32 s1, s0
	vstr s1, [r2, #0]
	vldr s0, [ip, #24]
	vstr s0, [r0, #16]
	vldr s0, [ip, #8]
	vstr s0, [r2, #8]
	vldr s0, [ip, #8]
	vstr s0, [r2, #4]
	ldr.w r5, [r0, #32]
	ldr.w r6, [r0, #28]
	ldr.w r7, [r1, #0]
	ldr.w r8, [r0, #24]
	sub.w r8, r7, r8
	sbfx r8, r8, #0, #14
	add.w r8, r6, r8
	cmp.w r4, #0
	mov.w r9, r8
	it ne
	movne.w r9, r6
	ldr.w r6, [ip, #20]
	sdiv r4, r9, r6
	add.w r4, r5, r4
	str.w r4, [r0, #32]
	ldr.w r5, [ip, #20]
	sdiv r4, r9, r5
	ldr.w r5, [ip, #20]
	mul r4, r4, r5
	sub.w r4, r9, r4
	sbfx r4, r4, #0, #17
	str.w r4, [r0, #28]
	vstr s1, [r0, #0]
	str.w r7, [r0, #24]
	vldr s0, [ip, #8]
	vstr s0, [r0, #20]
	vldr s0, [ip, #8]
	vstr s0, [r0, #36]
	vldr s0, [ip, #8]
	vstr s0, [r0, #12]
	vldr s0, [ip, #8]
	vstr s0, [r0, #8]
	vldr s0, [ip, #8]
	vstr s0, [r0, #4]
	mov.w r4, #1
	strb.w r4, [r0, #40]
	mov.w r0, #9
	pop.w {r4-r9}
	bx lr
	.balign 4
.Lmotor_give_up_table:
	.word 0x41200000 @ 10.0
	.word 0xc1200000 @ -10.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0xc0c90fdb @ -6.2831855
	.word 0x00004000 @ 2.2959e-41
	.word 0x40490fdb @ 3.1415927
	.size motor_give_up, .-motor_give_up

	.section .text.motor_refuse, "ax", %progbits
	.balign 8
	.global motor_refuse
	.type motor_refuse, %function
	.thumb_func
motor_refuse:
	adr.w ip, .Lmotor_refuse_table
	vldr s0, [ip, #0]
	vldr s1, [ip, #4]
	vldr s2, [ip, #8]
	vldr s3, [r0, #0]
	vldr s4, [ip, #8]
	vldr s5, [r0, #0]
	vabs.f32 s5, s5
	vldr s6, [ip, #12]
	vcmp.f32 s5, s6
	vmrs APSR_nzcv, fpscr
	it ls
	vmovls.f32 s4, s3
	vmul.f32 s2, s2, s4
	vldr s3, [ip, #8]
	vadd.f32 s2, s2, s3
	vldr s3, [ip, #4]
	vcmp.f32 s2, s3
	vmrs APSR_nzcv, fpscr
	vmov.f32 s3, s2
	it mi
	vmovmi.f32 s3, s1
	vldr s1, [ip, #0]
	vcmp.f32 s2, s1
	vmrs APSR_nzcv, fpscr
	vmov.f32 s1, s3
	it gt
	vmovgt.f32 s1, s0
	vstr s1, [r1, #0]
	vldr s0, [ip, #8]
	vstr s0, [r1, #8]
	vldr s0, [ip, #8]
	vstr s0, [r1, #4]
	vstr s1, [r0, #0]
	mov.w r0, #9
	bx lr
	.balign 4
.Lmotor_refuse_table:
	.word 0x41200000 @ 10.0
	.word 0xc1200000 @ -10.0
	.word 0x00000000 @ 0.0
	.word 0x5368d4a5 @ 1000000000000.0
	.size motor_refuse, .-motor_refuse

	.section .text.motor_start, "ax", %progbits
	.balign 8
	.global motor_start
	.type motor_start, %function
	.thumb_func
motor_start:
	push.w {r4-r9}
	adr.w ip, .Lmotor_start_table
	ldrb.w r4, [r1, #4]
	cmp.w r4, #0
	beq.w .Lmotor_start_1
	mov.w r0, #0
	pop.w {r4-r9}
	bx lr
.Lmotor_start_1:
	vldr s0, [ip, #0]
	vldr s1, [r1, #16]
	vsub.f32 s0, s0, s1
	vldr s1, [ip, #4]
	vldr s2, [ip, #8]
	ldr.w r4, [r1, #0]
	sbfx r5, r4, #0, #14
	ldr.w r7, [ip, #12]
	sdiv r6, r5, r7
	ldr.w r7, [ip, #12]
	mul r6, r6, r7
	sub.w r6, r5, r6
	sbfx r6, r6, #0, #17
	vmov s3, r6
	vcvt.f32.s32 s3, s3
	vmul.f32 s2, s2, s3
	vldr s3, [ip, #16]
	ldr.w r7, [r1, #8]
	ldr.w r8, [ip, #0]
	ldr.w r9, [ip, #12]
	sdiv r5, r5, r9
	add.w r5, r8, r5
	sub.w r7, r7, r5
	vmov s4, r7
	vcvt.f32.s32 s4, s4
	vmul.f32 s3, s3, s4
	vldr s4, [r1, #12]
	vadd.f32 s3, s3, s4
	vsub.f32 s2, s2, s3
	vmul.f32 s1, s1, s2
	vadd.f32 s0, s0, s1
	vabs.f32 s1, s0
	vldr s2, [ip, #20]
	vcmp.f32 s1, s2
	vmrs APSR_nzcv, fpscr
	ite ls
	movls.w r7, #1
	movhi.w r7, #0
	ldrb.w r8, [r0, #41]
	orr.w r8, r8, r7
	strb.w r8, [r0, #41]
	vldr s1, [ip, #0]
	vldr s2, [r0, #0]
	cmp.w r7, #0
	it ne
	vmovne.f32 s2, s1
	vstr s2, [r0, #0]
	vldr s1, [r0, #20]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [ip, #0]
	vldr s1, [r0, #36]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #36]
	vldr s0, [ip, #24]
	vldr s1, [r0, #16]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #16]
	vldr s0, [ip, #0]
	vldr s1, [r0, #12]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #12]
	vldr s0, [ip, #0]
	vldr s1, [r0, #8]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #8]
	vldr s0, [ip, #0]
	vldr s1, [r0, #4]
	cmp.w r7, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #4]
	ldr.w r8, [r0, #32]
	cmp.w r7, #0
	mov.w r9, r8
	it ne
	movne.w r9, r5
	str.w r9, [r0, #32]
	ldr.w r5, [r0, #28]
	cmp.w r7, #0
	mov.w r8, r5
	it ne
	movne.w r8, r6
	str.w r8, [r0, #28]
	ldr.w r5, [r0, #24]
	cmp.w r7, #0
	mov.w r6, r5
	it ne
	movne.w r6, r4
	str.w r6, [r0, #24]
	ldrb.w r4, [r0, #40]
	orr.w r4, r4, r7
	strb.w r4, [r0, #40]
	mov.w r0, #0
	cmp.w r7, #0
	it ne
	orrne.w r0, r0, #1
	pop.w {r4-r9}
	bx lr
	.balign 4
.Lmotor_start_table:
	.word 0x00000000 @ 0.0
	.word 0x42fa0000 @ 125.0
	.word 0x39c90fdb @ 0.0003834952
	.word 0x00004000 @ 2.2959e-41
	.word 0x40c90fdb @ 6.2831855
	.word 0x5368d4a5 @ 1000000000000.0
	.word 0x40490fdb @ 3.1415927
	.size motor_start, .-motor_start

	.section .text.motor_not_started, "ax", %progbits
	.balign 8
	.global motor_not_started
	.type motor_not_started, %function
	.thumb_func
motor_not_started:
	adr.w ip, .Lmotor_not_started_table
	vldr s0, [ip, #0]
	vstr s0, [r0, #8]
	vldr s0, [ip, #0]
	vstr s0, [r0, #4]
	vldr s0, [ip, #0]
	vstr s0, [r0, #0]
	mov.w r0, #1
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
	push.w {r4-r5}
	adr.w ip, .Lmotor_report_applied_table
	ldrb.w r4, [r0, #41]
	vabs.f32 s1, s0
	vldr s2, [ip, #0]
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
.Lmotor_report_applied_table:
	.word 0x5368d4a5 @ 1000000000000.0
	.size motor_report_applied, .-motor_report_applied

	.section .text.motor_estimates, "ax", %progbits
	.balign 8
	.global motor_estimates
	.type motor_estimates, %function
	.thumb_func
motor_estimates:
	push.w {r4-r5}
	adr.w ip, .Lmotor_estimates_table
	ldrb.w r4, [r0, #41]
	cmp.w r4, #0
	beq.w .Lmotor_estimates_1
	vldr s0, [ip, #0]
	ldr.w r4, [r0, #28]
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
	ldr.w r4, [r0, #32]
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
	adr.w ip, .Lmotor_reset_table
	vldr s0, [ip, #0]
	vldr s1, [r0, #0]
	ldrb.w r4, [r0, #41]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #0]
	vldr s0, [ip, #0]
	vldr s1, [r0, #20]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #20]
	vldr s0, [ip, #0]
	vldr s1, [r0, #36]
	cmp.w r4, #0
	it ne
	vmovne.f32 s1, s0
	vstr s1, [r0, #36]
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
	ldr.w r6, [r0, #32]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #32]
	ldr.w r6, [r0, #28]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #28]
	ldr.w r6, [r0, #24]
	cmp.w r4, #0
	mov.w r7, r6
	it ne
	movne.w r7, r5
	str.w r7, [r0, #24]
	eor.w r4, r4, #1
	ldrb.w r5, [r0, #40]
	and.w r4, r4, r5
	strb.w r4, [r0, #40]
	mov.w r4, #0
	strb.w r4, [r0, #41]
	pop.w {r4-r7}
	bx lr
	.balign 4
.Lmotor_reset_table:
	.word 0x00000000 @ 0.0
	.size motor_reset, .-motor_reset
