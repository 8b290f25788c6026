//! Static library `libedo_smc.a` for firmware in C. Its interface is [`edo_smc.h`](../include/edo_smc.h).
//!
//! In Rust a controller is a type: plant order n, observer order r and the set of observed channels. In C each type is
//! a group of functions with these numbers in their names, such as `edo_smc_tick_n4_r2_c24`. So a channel without an
//! observer costs nothing in C either. `controller_core::shapes!(archive)` lists the orders: (2,1), (2,2), (3,2),
//! (4,2), (4,3). Each has every channel set that contains the last channel and that Eq. (44) permits: channel i < n
//! needs an order of n - i. a(x) is linear, a row of the design. The observers estimate the rest of the dynamics.
//!
//! A drive is a type, too: a motor with one encoder, a joint with two, or a coupled joint. Gain sets and delay are in
//! the name, such as `edo_smc_tick_joint_fast_late`. State and design are opaque words in C. So are plans and profiles,
//! which give the target, and fences, which limit the motion.
//!
//! The caller owns all storage. No function allocates, locks, or has static variables, so calls with different states
//! may interrupt each other. A call checks its arguments: NULL, misaligned, another size, version, instance or design,
//! numbers that are not finite, a state without `init`. It then returns a status and writes nothing. The caller
//! guarantees that each pointer points to memory of its type, which no call can check.
//!
//! # Hidden symbols
//! The build (`cargo xtask capi`) links the library into one object in which only `edo_smc_*` stays visible. So its
//! 64-bit arithmetic, its `memcpy` and its panic handler, which is never called, cannot clash with symbols of the
//! program.
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

/// Version of header, archive and designs: one byte each for major, minor and patch.
const VERSION: u32 = controller_core::VERSION_NUMBER;

/// Panic handler, which the compiler requires. No function of the library can panic.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Returns the version of the archive, to compare with `EDO_SMC_VERSION` of the header.
// SAFETY: the prefix belongs to this library.
#[unsafe(no_mangle)]
pub extern "C" fn edo_smc_version() -> u32 {
    VERSION
}

/// Returns 1 if the floating-point modes of this context are the assumed ones, else 0.
// SAFETY: the prefix belongs to this library.
#[unsafe(no_mangle)]
pub extern "C" fn edo_smc_modes_ok() -> u32 {
    controller_core::modes_ok().into()
}

/// Defines the functions that chains and drives share, for one design, in a module with its name.
macro_rules! instance {
    ($name:ident: $design:ty, $config:ty, $refused:ty, $designing:path; $($more:tt)*) => {
        #[doc = concat!("The functions `edo_smc_*_", stringify!($name), "`; edo_smc.h describes each.")]
        pub mod $name {
            use super::*;

            pub(super) type ThisDesign = $design;
            type ThisState = CState<ThisDesign>;
            type ThisSample = <ThisDesign as Instance>::Sample;
            type ThisKnown = <ThisDesign as Instance>::Estimates;
            pub(super) type ThisConfig = $config;

            /// Returns the size of a design in bytes.
            // SAFETY: the prefix belongs to this library; so for every name below.
            #[unsafe(export_name = concat!("edo_smc_design_size_", stringify!($name)))]
            pub extern "C" fn design_size() -> usize {
                size_of::<ThisDesign>()
            }

            /// Returns the size of a state in bytes.
            #[unsafe(export_name = concat!("edo_smc_state_size_", stringify!($name)))]
            pub extern "C" fn state_size() -> usize {
                size_of::<ThisState>()
            }

            /// Checks a design and makes a state that waits for its first valid sample.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given with it.
            #[unsafe(export_name = concat!("edo_smc_init_", stringify!($name)))]
            pub unsafe extern "C" fn init(
                design: *const ThisDesign,
                design_size: usize,
                state: *mut ThisState,
                state_size: usize,
            ) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::init(design, design_size, state, state_size) }
            }

            /// Computes one tick: writes u and the status flags for a sample.
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
                // SAFETY: guaranteed by the caller.
                unsafe { instance::tick(design, state, sample, output) }
            }

            /// Reports the u that the actuator has held since the last tick.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_report_applied_", stringify!($name)))]
            pub unsafe extern "C" fn report_applied(state: *mut ThisState, u: f32) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::of_the_stage(state, u, <ThisDesign as Instance>::Law::report_applied) }
            }

            /// Writes the estimates at the instant of the last tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_estimates_", stringify!($name)))]
            pub unsafe extern "C" fn estimates(
                design: *const ThisDesign,
                state: *const ThisState,
                known: *mut ThisKnown,
            ) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::estimates(design, state, known) }
            }

            /// Clears everything except the design: consistent counts start the drive again.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_reset_", stringify!($name)))]
            pub unsafe extern "C" fn reset(state: *mut ThisState) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::reset(state) }
            }

            /// Switches to another design before the next tick; `sample` is the sample of that tick.
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
                // SAFETY: guaranteed by the caller.
                unsafe { instance::retune(from, to, design_size, state, sample) }
            }

            /// Computes a design, bit-identical on every machine.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given with it, `refused` to memory of
            /// its type.
            #[unsafe(export_name = concat!("edo_smc_design_", stringify!($name)))]
            pub unsafe extern "C" fn design(
                config: *const ThisConfig,
                config_size: usize,
                design: *mut ThisDesign,
                design_size: usize,
                refused: *mut $refused,
            ) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { $designing(config, config_size, design, design_size, refused) }
            }

            $($more)*
        }
    };
}

/// Defines one module of functions per chain: name, n, r, mask and number of the observed channels.
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

// edo_smc.h lists the same names; the test suite compares the two lists.
controller_core::shapes!(archive => chains);

/// Defines one module of functions per drive: design, configuration, words of law and state, and `by_rule` if its gains
/// have a rule.
macro_rules! drives {
    ($($name:ident: $design:ty, $config:ty, $law_words:literal, $state_words:literal $(, $by_rule:ident)?;)*) => {$(
        instance! {
            $name: $design, $config, CRefusal, drive::design;
            // Numbers of words in edo_smc.h.
            const _: [(); $law_words] = [(); <$design>::WORDS];
            const _: [(); $state_words] = [(); instance::words_of_state::<$design>()];
            const _: [(); 9] = [(); fence::WORDS];

            /// Reports the number of periods that passed without a tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_missed_", stringify!($name)))]
            pub unsafe extern "C" fn missed(
                design: *const ThisDesign,
                state: *mut ThisState,
                periods: u32,
            ) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::between(design, state, |law, state| ControlLaw::missed(law, state, periods)) }
            }

            /// Sets the largest current, A, that the power stage can hold.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a state.
            #[unsafe(export_name = concat!("edo_smc_limit_", stringify!($name)))]
            pub unsafe extern "C" fn limit(state: *mut ThisState, u: f32) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::of_the_stage(state, u, <ThisDesign as Instance>::Law::limit) }
            }

            /// Starts the reaction to an alarm at the next tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_trip_", stringify!($name)))]
            pub unsafe extern "C" fn trip(design: *const ThisDesign, state: *mut ThisState) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { instance::between(design, state, |law, state| law.trip(state)) }
            }

            /// Makes the limits of position, speed and following error for the drive of a configuration.
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
                // SAFETY: guaranteed by the caller.
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

            /// Checks the fence after a tick and trips the drive if a limit is violated.
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
                // SAFETY: guaranteed by the caller.
                unsafe { fence::guard(design, state, fence, sample, output) }
            }

            /// Computes one tick but never starts the state.
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
                // SAFETY: guaranteed by the caller.
                unsafe { instance::go_on(design, state, sample, output) }
            }

            $(
                /// Fills the values of a configuration that are not on the data sheet.
                ///
                /// # Safety
                /// A pointer that is not NULL points to memory of the size that is given with it.
                #[unsafe(export_name = concat!("edo_smc_", stringify!($by_rule), "_", stringify!($name)))]
                pub unsafe extern "C" fn $by_rule(config: *mut ThisConfig, config_size: usize) -> Status {
                    // SAFETY: guaranteed by the caller.
                    unsafe { <$design>::$by_rule(config, config_size) }
                }
            )?

            /// Scales all bandwidths to another surface bandwidth, rad/s, and sets the innovation gates.
            ///
            /// # Safety
            /// A pointer that is not NULL points to memory of the size that is given with it.
            #[unsafe(export_name = concat!("edo_smc_tune_", stringify!($name)))]
            pub unsafe extern "C" fn tune(config: *mut ThisConfig, config_size: usize, surface_rad_s: f64) -> Status {
                // SAFETY: guaranteed by the caller.
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

/// Defines the plans of a plant: number of derivatives, r included, that a plan continues, and of a target.
macro_rules! plans {
    ($($module:ident $name:ident: $m:literal, $n:literal;)*) => {$(
        #[doc = concat!("Plans of a ", stringify!($name), ", `edo_smc_plan_*_", stringify!($name), "`.")]
        pub mod $module {
            use super::*;

            // Words in edo_smc.h: goal, end, ticks, three rates and their share of a tick, two halves twice.
            const _: [(); 13 + 12 * $m] = [(); Plan::<$m>::WORDS];

            /// Makes a permanent rest at an angle.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a plan.
            #[unsafe(export_name = concat!("edo_smc_plan_rest_", stringify!($name)))]
            pub unsafe extern "C" fn rest(plan: *mut Plan<$m>, turn: i32, angle: f32) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { plan::rest(plan, Rest { turn, angle }) }
            }

            /// Makes a move from another plan to rest at an angle.
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
                // SAFETY: guaranteed by the caller.
                unsafe { plan::to_rest(plan, from, Span { start, ticks, period_s }, Rest { turn, angle }) }
            }

            /// Makes a stop from another plan, in at most `ticks` ticks, that never moves back.
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
                // SAFETY: guaranteed by the caller.
                unsafe { plan::to_stop(plan, from, Span { start, ticks, period_s }) }
            }

            /// Makes a transition from another plan to a sine about angle 0.
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
                // SAFETY: guaranteed by the caller.
                unsafe { plan::to_sine(plan, from, span, amplitude_rad, omega_rad_s) }
            }

            /// Writes the target at a tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_plan_at_", stringify!($name)))]
            pub unsafe extern "C" fn at(plan: *const Plan<$m>, tick: u32, target: *mut CTarget<$n>) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { plan::at(plan, tick, target) }
            }

            /// Writes the target at a tick and marks a completed plan.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_plan_play_", stringify!($name)))]
            pub unsafe extern "C" fn play(plan: *mut Plan<$m>, tick: u32, target: *mut CTarget<$n>) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { plan::play(plan, tick, target) }
            }
        }
    )*};
}

plans! {
    plan_motor motor: 3, 2;
    plan_joint joint: 4, 4;
}

/// Defines the profiles of a plant: number of averages, and of derivatives of a target, r included.
macro_rules! profiles {
    ($($module:ident $name:ident: $m:literal, $n:literal;)*) => {$(
        #[doc = concat!("Profiles of a ", stringify!($name), ", `edo_smc_profile_*_", stringify!($name), "`.")]
        pub mod $module {
            use super::*;

            type ThisProfile = profile::CProfile<$m, { $m * profile::WINDOW }>;

            // Words in edo_smc.h: 26, and two and a window for each average.
            const _: [(); 26 + (2 + profile::WINDOW) * $m] = [(); ThisProfile::WORDS];

            /// Makes a profile with limits, at rest at angle 0.
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
                // SAFETY: guaranteed by the caller.
                unsafe { profile::new(profile, profile_size, &limits, period_s, refusal) }
            }

            /// Sets the limits of speed and acceleration, also in motion.
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
                // SAFETY: guaranteed by the caller.
                unsafe { profile::limit(profile, [speed_rad_s, acceleration_rad_s2], refusal) }
            }

            /// Limits all goals to the range between two angles.
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
                // SAFETY: guaranteed by the caller.
                unsafe { profile::keep_within(profile, (low_turn, low_rad), (high_turn, high_rad)) }
            }

            /// Sets the goal.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_go_to_", stringify!($name)))]
            pub unsafe extern "C" fn go_to(profile: *mut ThisProfile, turn: i32, rad: f64) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { profile::go_to(profile, turn, rad) }
            }

            /// Stops as soon as the acceleration permits.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_stop_", stringify!($name)))]
            pub unsafe extern "C" fn stop(profile: *mut ThisProfile) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { profile::stop(profile) }
            }

            /// Restarts at an angle with a speed, and brakes to rest.
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
                // SAFETY: guaranteed by the caller.
                unsafe { profile::start(profile, turn, rad, speed_rad_s) }
            }

            /// Returns 1 if the path rests at its goal, else 0.
            ///
            /// # Safety
            /// A pointer that is not NULL points to a profile.
            #[unsafe(export_name = concat!("edo_smc_profile_has_arrived_", stringify!($name)))]
            pub unsafe extern "C" fn has_arrived(profile: *const ThisProfile) -> u32 {
                // SAFETY: guaranteed by the caller.
                unsafe { profile::has_arrived(profile) }.into()
            }

            /// Writes the target at the end of the next tick.
            ///
            /// # Safety
            /// Pointers that are not NULL point to memory of their type.
            #[unsafe(export_name = concat!("edo_smc_profile_next_", stringify!($name)))]
            pub unsafe extern "C" fn next(profile: *mut ThisProfile, target: *mut CTarget<$n>) -> Status {
                // SAFETY: guaranteed by the caller.
                unsafe { profile::next(profile, target) }
            }
        }
    )*};
}

profiles! {
    profile_motor motor: 2, 2;
    profile_joint joint: 3, 4;
}
