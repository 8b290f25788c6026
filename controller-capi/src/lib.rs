//! The controller for firmware in C: `libedo_smc.a`, to which [`edo_smc.h`](../include/edo_smc.h) is the way in.
//!
//! A tick is a type in Rust: plant order n, observer order r and the set of observed channels. For C each of them is a
//! handful of functions with that set in their names, `edo_smc_tick_n4_r2_c24`; so an absent channel costs nothing here
//! either. `controller_core::shapes!(archive)` is all there is: the orders (2,1), (2,2), (3,2), (4,2), (4,3), each with
//! every set of channels that holds the driven one and that Eq. (44) allows (channel i < n needs an order of n - i).
//! a(x) is linear, a row of the design; what it does not say, the observers estimate.
//!
//! A drive is a type too: a motor with one encoder, a joint with two, or a joint as a whole, gain sets and delay in the
//! name, `edo_smc_tick_joint_fast_late`; what it remembers and what it multiplies with are opaque words of C. Where it
//! should be is a plan or a profile of set-points, within what limits a fence: opaque words too.
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

mod chain;
mod designing;
mod drive;
mod fence;
mod instance;
mod plan;
mod profile;
mod status;

use controller_core::drive::{ProfileLimits, Rest};
use controller_core::{ControlLaw, Output};
use drive::{CRefusal, CTarget};
use fence::{CFence, CLimits};
use instance::{CState, Instance};
use plan::{Plan, Span};
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

/// Are the floating-point modes here and now the assumed ones? 1, or 0.
// SAFETY: the prefix is ours.
#[unsafe(no_mangle)]
pub extern "C" fn edo_smc_modes_ok() -> u32 {
    controller_core::modes_ok().into()
}

/// The functions that chains and drives have alike, of this design, in a module of its name.
macro_rules! instance {
    ($name:ident: $design:ty, $config:ty, $refused:ty, $designing:path; $($more:tt)*) => {
        #[doc = concat!("The functions `edo_smc_*_", stringify!($name), "`; edo_smc.h says what each does.")]
        pub mod $name {
            use super::*;

            pub(super) type ThisDesign = $design;
            type ThisState = CState<ThisDesign>;
            type ThisSample = <ThisDesign as Instance>::Sample;
            type ThisKnown = <ThisDesign as Instance>::Estimates;
            pub(super) type ThisConfig = $config;

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
                sample: *const ThisSample,
                output: *mut Output<f32>,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::tick(design, state, sample, output) }
            }

            /// What the actuator really holds.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_report_applied_", stringify!($name)))]
            pub unsafe extern "C" fn report_applied(state: *mut ThisState, u: f32) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::of_the_stage(state, u, <ThisDesign as Instance>::Law::report_applied) }
            }

            /// What is known at the instant of the last tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_estimates_", stringify!($name)))]
            pub unsafe extern "C" fn estimates(
                design: *const ThisDesign,
                state: *const ThisState,
                known: *mut ThisKnown,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::estimates(design, state, known) }
            }

            /// Forgets all but the design: the next good sample starts again.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_reset_", stringify!($name)))]
            pub unsafe extern "C" fn reset(state: *mut ThisState) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::reset(state) }
            }

            /// Another design takes over before the coming tick, of which this is the sample.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type, `to` to memory of the size given.
            #[unsafe(export_name = concat!("edo_smc_retune_", stringify!($name)))]
            pub unsafe extern "C" fn retune(
                from: *const ThisDesign,
                to: *const ThisDesign,
                design_size: usize,
                state: *mut ThisState,
                sample: *const ThisSample,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::retune(from, to, design_size, state, sample) }
            }

            /// Designs: the same numbers as on any other machine.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given beside it, `refused` to memory of
            /// its type.
            #[unsafe(export_name = concat!("edo_smc_design_", stringify!($name)))]
            pub unsafe extern "C" fn design(
                config: *const ThisConfig,
                config_size: usize,
                design: *mut ThisDesign,
                design_size: usize,
                refused: *mut $refused,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { $designing(config, config_size, design, design_size, refused) }
            }

            $($more)*
        }
    };
}

/// One module of functions per chain: n, r, the channels as a mask, how many they are.
macro_rules! chains {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {$(
        instance! {
            $name: chain::Design<$n, $r, $mask, $o>, designing::CConfig<$n, $r, $o>, u32, designing::design;
            const _: () = {
                chain::assert_layout::<$n, $r, $mask, $o>();
                designing::assert_layout::<$n, $r, $o>();
            };
        }
    )*};
}

// Beside each other in edo_smc.h; the suite holds the two lists together.
controller_core::shapes!(archive => chains);

/// One module of functions per drive: its design and its configuration, how many words law and state have, and whether
/// its gains have a rule.
macro_rules! drives {
    ($($name:ident: $design:ty, $config:ty, $law_words:literal, $state_words:literal $(, $by_rule:ident)?;)*) => {$(
        instance! {
            $name: $design, $config, CRefusal, drive::design;
            // As edo_smc.h has them.
            const _: [(); $law_words] = [(); <$design>::WORDS];
            const _: [(); $state_words] = [(); instance::words_of_state::<$design>()];
            const _: [(); 9] = [(); fence::WORDS];

            /// Periods have passed without a tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_missed_", stringify!($name)))]
            pub unsafe extern "C" fn missed(
                design: *const ThisDesign,
                state: *mut ThisState,
                periods: u32,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::between(design, state, |law, state| ControlLaw::missed(law, state, periods)) }
            }

            /// What the power stage gives at most.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_limit_", stringify!($name)))]
            pub unsafe extern "C" fn limit(state: *mut ThisState, u: f32) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::of_the_stage(state, u, <ThisDesign as Instance>::Law::limit) }
            }

            /// What follows an alarm, from the next tick on.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_trip_", stringify!($name)))]
            pub unsafe extern "C" fn trip(design: *const ThisDesign, state: *mut ThisState) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::between(design, state, |law, state| law.trip(state)) }
            }

            /// Limits of position, speed and following error, for the drive of a configuration.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type, `config` and `fence` to memory of the sizes
            /// given.
            #[unsafe(export_name = concat!("edo_smc_fence_", stringify!($name)))]
            pub unsafe extern "C" fn fence(
                config: *const ThisConfig,
                config_size: usize,
                limits: *const CLimits,
                fence: *mut CFence,
                fence_size: usize,
                refusal: *mut CRefusal,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe {
                    fence::fence::<<ThisDesign as Instance>::Law, _, _, _>(
                        config,
                        config_size,
                        limits,
                        fence,
                        fence_size,
                        refusal,
                    )
                }
            }

            /// Looks at a tick that was made, and trips the drive where a limit is broken.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_guard_", stringify!($name)))]
            pub unsafe extern "C" fn guard(
                design: *const ThisDesign,
                state: *mut ThisState,
                fence: *const CFence,
                sample: *const ThisSample,
                output: *mut Output<f32>,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { fence::guard(design, state, fence, sample, output) }
            }

            /// A tick that does not start.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_go_on_", stringify!($name)))]
            pub unsafe extern "C" fn go_on(
                design: *const ThisDesign,
                state: *mut ThisState,
                sample: *const ThisSample,
                output: *mut Output<f32>,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { instance::go_on(design, state, sample, output) }
            }

            $(
                /// All that is not on the data sheet.
                ///
                /// # Safety
                /// A pointer that is not NULL points to memory of the size that is given beside it.
                #[unsafe(export_name = concat!("edo_smc_", stringify!($by_rule), "_", stringify!($name)))]
                pub unsafe extern "C" fn $by_rule(config: *mut ThisConfig, config_size: usize) -> Status {
                    // SAFETY: the caller's word.
                    unsafe { <$design>::$by_rule(config, config_size) }
                }
            )?

            /// Bandwidths in the same proportions for another surface, and the gates for them.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given beside it.
            #[unsafe(export_name = concat!("edo_smc_tune_", stringify!($name)))]
            pub unsafe extern "C" fn tune(config: *mut ThisConfig, config_size: usize, surface_rad_s: f64) -> Status {
                // SAFETY: the caller's word.
                unsafe { <$design>::tune(config, config_size, surface_rad_s) }
            }
        }
    )*};
}

drives! {
    motor: drive::Motor<0, 0>, drive::MotorConfig, 63, 26, by_rule;
    motor_fast: drive::Motor<1, 0>, drive::MotorConfig, 70, 28, by_rule;
    motor_late: drive::Motor<0, 1>, drive::MotorConfig, 63, 27, by_rule;
    motor_fast_late: drive::Motor<1, 1>, drive::MotorConfig, 70, 29, by_rule;
    joint: drive::Joint<0, 0>, drive::JointConfig, 105, 38, by_rule;
    joint_fast: drive::Joint<1, 0>, drive::JointConfig, 121, 42, by_rule;
    joint_late: drive::Joint<0, 1>, drive::JointConfig, 105, 39, by_rule;
    joint_fast_late: drive::Joint<1, 1>, drive::JointConfig, 121, 43, by_rule;
    coupled: drive::Coupled<0, 0>, drive::CoupledConfig, 137, 37;
    coupled_fast: drive::Coupled<1, 0>, drive::CoupledConfig, 151, 41;
    coupled_late: drive::Coupled<0, 1>, drive::CoupledConfig, 137, 38;
    coupled_fast_late: drive::Coupled<1, 1>, drive::CoupledConfig, 151, 42;
}

/// Plans of a plant: derivatives that a plan takes over, r included, and those of a target.
macro_rules! plans {
    ($($module:ident $name:ident: $m:literal, $n:literal;)*) => {$(
        #[doc = concat!("Plans of a ", stringify!($name), ", `edo_smc_plan_*_", stringify!($name), "`.")]
        pub mod $module {
            use super::*;

            // As edo_smc.h has them: goal, end, ticks, three rates and their share of a tick, two halves twice.
            const _: [(); 13 + 12 * $m] = [(); Plan::<$m>::WORDS];

            /// Rest at this angle, always.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a plan.
            #[unsafe(export_name = concat!("edo_smc_plan_rest_", stringify!($name)))]
            pub unsafe extern "C" fn rest(plan: *mut Plan<$m>, turn: i32, angle: f32) -> Status {
                // SAFETY: the caller's word.
                unsafe { plan::rest(plan, Rest { turn, angle }) }
            }

            /// From another plan to rest at this angle.
            ///
            /// # Safety
            /// Pointers that are not NULL point to plans.
            #[unsafe(export_name = concat!("edo_smc_plan_move_", stringify!($name)))]
            pub unsafe extern "C" fn move_to(
                plan: *mut Plan<$m>,
                from: *const Plan<$m>,
                start: u32,
                ticks: u32,
                period_s: f64,
                turn: i32,
                angle: f32,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { plan::to_rest(plan, from, Span { start, ticks, period_s }, Rest { turn, angle }) }
            }

            /// From another plan to rest, in so many ticks or fewer, and never back.
            ///
            /// # Safety
            /// Pointers that are not NULL point to plans.
            #[unsafe(export_name = concat!("edo_smc_plan_stop_", stringify!($name)))]
            pub unsafe extern "C" fn stop(
                plan: *mut Plan<$m>,
                from: *const Plan<$m>,
                start: u32,
                ticks: u32,
                period_s: f64,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { plan::to_stop(plan, from, Span { start, ticks, period_s }) }
            }

            /// From another plan onto a sine about angle 0.
            ///
            /// # Safety
            /// Pointers that are not NULL point to plans.
            #[unsafe(export_name = concat!("edo_smc_plan_sine_", stringify!($name)))]
            pub unsafe extern "C" fn sine(
                plan: *mut Plan<$m>,
                from: *const Plan<$m>,
                start: u32,
                ticks: u32,
                period_s: f64,
                amplitude_rad: f64,
                omega_rad_s: f64,
            ) -> Status {
                let span = Span { start, ticks, period_s };
                // SAFETY: the caller's word.
                unsafe { plan::to_sine(plan, from, span, amplitude_rad, omega_rad_s) }
            }

            /// The target at a tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_plan_at_", stringify!($name)))]
            pub unsafe extern "C" fn at(plan: *const Plan<$m>, tick: u32, target: *mut CTarget<$n>) -> Status {
                // SAFETY: the caller's word.
                unsafe { plan::at(plan, tick, target) }
            }

            /// The same of a plan that is gone along.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_plan_play_", stringify!($name)))]
            pub unsafe extern "C" fn play(plan: *mut Plan<$m>, tick: u32, target: *mut CTarget<$n>) -> Status {
                // SAFETY: the caller's word.
                unsafe { plan::play(plan, tick, target) }
            }
        }
    )*};
}

plans! {
    plan_motor motor: 3, 2;
    plan_joint joint: 4, 4;
}

/// Profiles of a plant: averages, steps that they remember, derivatives of a target.
macro_rules! profiles {
    ($($module:ident $name:ident: $m:literal, $n:literal;)*) => {$(
        #[doc = concat!("Profiles of a ", stringify!($name), ", `edo_smc_profile_*_", stringify!($name), "`.")]
        pub mod $module {
            use super::*;

            type ThisProfile = profile::CProfile<$m, { $m * profile::WINDOW }>;

            // As edo_smc.h has them: 26 words, and two and a window of each average.
            const _: [(); 26 + (2 + profile::WINDOW) * $m] = [(); ThisProfile::WORDS];

            /// At rest at angle 0, with limits.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type, `profile` to memory of the size given.
            #[unsafe(export_name = concat!("edo_smc_profile_new_", stringify!($name)))]
            pub unsafe extern "C" fn new(
                profile: *mut ThisProfile,
                profile_size: usize,
                period_s: f64,
                speed_rad_s: f64,
                acceleration_rad_s2: f64,
                window: u32,
                refusal: *mut CRefusal,
            ) -> Status {
                let limits = ProfileLimits { speed_rad_s, acceleration_rad_s2, window };
                // SAFETY: the caller's word.
                unsafe { profile::new(profile, profile_size, &limits, period_s, refusal) }
            }

            /// Other limits of speed and acceleration, in motion too.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_profile_limit_", stringify!($name)))]
            pub unsafe extern "C" fn limit(
                profile: *mut ThisProfile,
                speed_rad_s: f64,
                acceleration_rad_s2: f64,
                refusal: *mut CRefusal,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::limit(profile, [speed_rad_s, acceleration_rad_s2], refusal) }
            }

            /// Goals are taken between these two angles.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_keep_within_", stringify!($name)))]
            pub unsafe extern "C" fn keep_within(
                profile: *mut ThisProfile,
                low_turn: i32,
                low_rad: f64,
                high_turn: i32,
                high_rad: f64,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::keep_within(profile, (low_turn, low_rad), (high_turn, high_rad)) }
            }

            /// To this angle, from where it is.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_go_to_", stringify!($name)))]
            pub unsafe extern "C" fn go_to(profile: *mut ThisProfile, turn: i32, rad: f64) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::go_to(profile, turn, rad) }
            }

            /// To rest as soon as it may.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_stop_", stringify!($name)))]
            pub unsafe extern "C" fn stop(profile: *mut ThisProfile) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::stop(profile) }
            }

            /// Anew at this angle with a speed, and to rest from there.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_start_", stringify!($name)))]
            pub unsafe extern "C" fn start(
                profile: *mut ThisProfile,
                turn: i32,
                rad: f64,
                speed_rad_s: f64,
            ) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::start(profile, turn, rad, speed_rad_s) }
            }

            /// Is it at rest at its goal? 1, or 0.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_has_arrived_", stringify!($name)))]
            pub unsafe extern "C" fn has_arrived(profile: *const ThisProfile) -> u32 {
                // SAFETY: the caller's word.
                unsafe { profile::has_arrived(profile) }.into()
            }

            /// The target at the end of the next tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_profile_next_", stringify!($name)))]
            pub unsafe extern "C" fn next(profile: *mut ThisProfile, target: *mut CTarget<$n>) -> Status {
                // SAFETY: the caller's word.
                unsafe { profile::next(profile, target) }
            }
        }
    )*};
}

profiles! {
    profile_motor motor: 2, 2;
    profile_joint joint: 3, 4;
}
