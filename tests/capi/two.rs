//! Program in Rust and C++ with the C library linked in, and two controllers of different order that tick in turn.

use std::ffi::c_void;

#[repr(C)]
struct Output {
    u: f32,
    sigma: f32,
    sigma_star: f32,
    health: u8,
}

unsafe extern "C" {
    fn cpp_start() -> *const c_void;
    fn cpp_tick(x: *const f32) -> f32;
    fn edo_smc_design_size_n4_r2_c24() -> usize;
    fn edo_smc_state_size_n4_r2_c24() -> usize;
    fn edo_smc_init_n4_r2_c24(design: *const c_void, size: usize, state: *mut u64, state_size: usize) -> i32;
    fn edo_smc_tick_n4_r2_c24(design: *const c_void, state: *mut u64, x: *const f32, output: *mut Output) -> i32;
}

fn main() {
    // SAFETY: as edo_smc.h declares them.
    unsafe {
        let design = cpp_start();
        let size = edo_smc_state_size_n4_r2_c24();
        let mut memory = vec![0_u64; size.div_ceil(8)];
        let state = memory.as_mut_ptr();
        assert_eq!(edo_smc_init_n4_r2_c24(design, edo_smc_design_size_n4_r2_c24(), state, size), 0);
        let mut seed = 1_u32;
        let mut noise = |size: f32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            size * ((seed >> 8) as f32 / 16_777_216.0 - 0.5)
        };
        for _ in 0..1000 {
            let x = [0.01, 0.1, 1.0, 10.0].map(&mut noise);
            let mut output = Output { u: 0.0, sigma: 0.0, sigma_star: 0.0, health: 0 };
            assert_eq!(edo_smc_tick_n4_r2_c24(design, state, x.as_ptr(), &mut output), 0);
            let second = cpp_tick(x.as_ptr());
            println!("{:08x} {:08x}", output.u.to_bits(), second.to_bits());
            assert!(output.sigma.is_finite() && output.sigma_star.is_finite() && output.health < 8);
        }
    }
}
