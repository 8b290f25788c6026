//! The controller for firmware in C: `libedo_smc.a`, to which [`edo_smc.h`](../include/edo_smc.h) is the way in.
//!
//! A tick is a type in Rust: plant order n, observer order r and the set of observed channels. For C each of them is a
//! handful of functions with that set in their names, `edo_smc_tick_n4_r2_c24`; so an absent channel costs nothing here
//! either. `controller_core::shapes!(archive)` is all there is: the orders (2,1), (2,2), (3,2), (4,2), (4,3), each with
//! every set of channels that holds the driven one and that Eq. (44) allows (channel i < n needs an order of n - i).
//! a(x) is linear, a row of the design; what it does not say, the observers estimate.
//!
//! The caller owns all storage. Nothing here allocates, locks, or has a variable of its own, so calls with different
//! states may interrupt each other. What a caller may get wrong and can be seen (NULL, misaligned, another size,
//! version, instance or design, numbers that are not finite, a state of another make) is answered with a status,
//! and then nothing has been written. What cannot be seen is his word: that pointers point to memory of their type.
//!
//! # Hiding
//! The build (`cargo xtask capi`) links this into one object and keeps nothing visible but `edo_smc_*`: its arithmetic
//! of 64 bits, `memcpy` and the panic handler, which nothing calls, cannot clash with those of the program.
#![no_std]

mod designing;
mod instance;
mod status;

use controller_core::Output;
use designing::CConfig;
use instance::{Design, Held};
use status::Status;

/// Version of header, archive and designs, a byte each of major, minor and patch.
const VERSION: u32 = controller_core::VERSION_NUMBER;

/// Nothing here can panic; the compiler asks all the same.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Version of the archive; compare it with `EDO_SMC_VERSION` of the header.
// SAFETY: the prefix is ours.
#[unsafe(no_mangle)]
pub extern "C" fn edo_smc_version() -> u32 {
    VERSION
}

/// One module of functions per instance: n, r, the channels as a mask, how many they are.
macro_rules! instances {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {$(
        #[doc = concat!("The functions `edo_smc_*_", stringify!($name), "`; edo_smc.h says what each does.")]
        pub mod $name {
            use super::{CConfig, Design, Held, Output, Status, designing, instance};

            type ThisDesign = Design<$n, $r, $mask, $o>;
            type ThisState = Held<$n, $r, $mask, $o>;
            type ThisConfig = CConfig<$n, $r, $o>;

            const _: () = {
                instance::assert_layout::<$n, $r, $mask, $o>();
                designing::assert_layout::<$n, $r, $o>();
            };

            /// Size of a design in bytes.
            // SAFETY: the prefix is ours, and so for every name below.
            #[unsafe(export_name = concat!("edo_smc_design_size_", stringify!($name)))]
            pub extern "C" fn design_size() -> usize {
                size_of::<ThisDesign>()
            }

            /// Size of a state in bytes.
            #[unsafe(export_name = concat!("edo_smc_state_size_", stringify!($name)))]
            pub extern "C" fn state_size() -> usize {
                size_of::<ThisState>()
            }

            /// Checks a design and makes a state that waits for its first good sample.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given beside it.
            #[unsafe(export_name = concat!("edo_smc_init_", stringify!($name)))]
            pub unsafe extern "C" fn init(
                design: *const ThisDesign,
                design_size: usize,
                state: *mut ThisState,
                state_size: usize,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::init(design, design_size, state, state_size) }
            }

            /// One tick: a sample in, u and health out.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_tick_", stringify!($name)))]
            pub unsafe extern "C" fn tick(
                design: *const ThisDesign,
                state: *mut ThisState,
                x: *const [f32; $n],
                output: *mut Output<f32>,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::tick(design, state, x, output) }
            }

            /// What the actuator really holds.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_report_applied_", stringify!($name)))]
            pub unsafe extern "C" fn report_applied(state: *mut ThisState, u: f32) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::report_applied::<$n, $r, $mask, $o>(state, u) }
            }

            /// Forgets all but the design: the next good sample starts again.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_reset_", stringify!($name)))]
            pub unsafe extern "C" fn reset(state: *mut ThisState) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::reset::<$n, $r, $mask, $o>(state) }
            }

            /// Designs a controller: the same numbers as on any other machine.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given beside it, `channel` to a word.
            #[unsafe(export_name = concat!("edo_smc_design_", stringify!($name)))]
            pub unsafe extern "C" fn design(
                config: *const ThisConfig,
                config_size: usize,
                design: *mut ThisDesign,
                design_size: usize,
                channel: *mut u32,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { designing::design(config, config_size, design, design_size, channel) }
            }
        }
    )*};
}

// Beside each other in edo_smc.h; the suite holds the two lists together.
controller_core::shapes!(archive => instances);
