//! Design of a chain on the target, bit-identical to the design on the host.
//!
//! It uses 64-bit arithmetic, in software on a Cortex-M4F. So it belongs to the start-up, not to an interrupt.

use controller_core::{
    Config, Controller, Fallback, Field, Limits, Linear, MAX_N, Nominal, ObserverGains, Options, ReachingLaw, Surface,
};

use crate::VERSION;
use crate::chain::Design;
use crate::instance::Instance as _;
use crate::status::{Status, overlap, place, sized_place};

/// Configuration of a chain, `edo_smc_config_*_t`. The fields are those in [`Config`]. Observer gains exist only for
/// the observed channels.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CConfig<const N: usize, const R: usize, const O: usize> {
    period_s: f64,
    c: [f64; N],
    alpha_per_s: f64,
    gains: [[f64; R]; O],
    k_l: f64,
    k_s: f64,
    epsilon: f64,
    gradient: [f64; N],
    input_gain: f64,
    u_min: f64,
    u_max: f64,
    safe_u: f64,
    sigma_star_bound: f64,
    observer_pole_limit: f64,
    d_hat: [f64; N],
    order: [u32; O],
    fallback: u32,
}

const HOLD_LAST: u32 = 0;
const SAFE_U: u32 = 1;

/// Asserts the layout that `edo_smc.h` also declares and asserts.
pub(crate) const fn assert_layout<const N: usize, const R: usize, const O: usize>() {
    let doubles = 11 + 3 * N + O * R;
    assert!(core::mem::offset_of!(CConfig<N, R, O>, order) == 8 * doubles);
    assert!(size_of::<CConfig<N, R, O>>() == (8 * doubles + 4 * (O + 1)).next_multiple_of(8));
    assert!(align_of::<CConfig<N, R, O>>() == 8);
}

/// Computes the design. If a rule rejects the configuration, `channel` receives the number of its channel, 0 for none.
///
/// # Safety
/// Pointers that are not NULL point to memory of the sizes given, `channel` to a word.
pub(crate) unsafe fn design<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    config: *const CConfig<N, R, O>,
    config_size: usize,
    design: *mut Design<N, R, MASK, O>,
    design_size: usize,
    channel: *mut u32,
) -> Status {
    let places = || {
        sized_place(config, config_size)?;
        sized_place(design, design_size)?;
        if !channel.is_null() {
            place(channel)?;
        }
        let shared = overlap(design, config) || overlap(channel, design) || overlap(channel, config);
        if shared { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, of the right size; any bit pattern is a configuration.
    let (status, at) = match designed(unsafe { &*config }) {
        Ok(designed) => {
            // SAFETY: not NULL, aligned, of the right size.
            unsafe { design.write(designed) };
            (Status::OK, 0)
        }
        Err(refused) => refused,
    };
    if !channel.is_null() {
        // SAFETY: not NULL, aligned.
        unsafe { channel.write(at) };
    }
    status
}

/// Returns the design, or the status with the number of the channel that caused it (from 1; 0 for none).
fn designed<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    from: &CConfig<N, R, O>,
) -> Result<Design<N, R, MASK, O>, (Status, u32)> {
    let fallback = match from.fallback {
        HOLD_LAST => Fallback::HoldLast,
        SAFE_U => Fallback::Safe(from.safe_u),
        _ => return Err((Status::FALLBACK, 0)),
    };
    let mut observers = [None; N];
    let mut observed = from.gains.iter().zip(&from.order);
    for (i, observer) in observers.iter_mut().enumerate().take(MAX_N) {
        if MASK >> i & 1 == 1
            && let Some((l, order)) = observed.next()
        {
            let gains = ObserverGains::new(*order as usize, *l);
            *observer = Some(gains.map_err(|cause| (Status::of(&cause), i as u32 + 1))?);
        }
    }
    let config = Config {
        period_s: from.period_s,
        surface: Surface { c: from.c, alpha_per_s: from.alpha_per_s },
        observers,
        reaching: ReachingLaw { k_l: from.k_l, k_s: from.k_s, epsilon: from.epsilon },
        nominal: Nominal { gradient: from.gradient, input_gain: from.input_gain },
        options: Options::NEUTRAL
            .with_limits(Limits { min: from.u_min, max: from.u_max })
            .with_fallback(fallback)
            .with_sigma_star_bound(from.sigma_star_bound)
            .with_observer_pole_limit(from.observer_pole_limit),
    };
    let controller =
        Controller::<f32, Linear<f32, N>, N, R, MASK, O>::try_linear(&config).map_err(|error| match error.field {
            Field::Observer { channel } => (Status::of(&error.cause), channel as u32),
            _ => (Status::of(&error.cause), 0),
        })?;
    let d_hat = from.d_hat.map(|d_hat| d_hat as f32);
    if !d_hat.iter().chain(controller.model().row()).all(|number| number.is_finite()) {
        return Err((Status::NOT_FINITE, 0));
    }
    let instance = Design::<N, R, MASK, O>::WORD;
    let mut design = Design { version: VERSION, instance, d_hat, controller, check: 0.0 };
    design.check = design.check_of_numbers();
    Ok(design)
}
