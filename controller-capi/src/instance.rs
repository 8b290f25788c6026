//! A design and a state as C holds them, and what can be done with the two.
//!
//! # What a tick trusts
//! `init` looks at the whole design once and keeps its *address* in the state, never to follow it, only to compare: a
//! tick with a design at that address needs not ask again whether it is NULL, aligned, of this version and instance,
//! finite. The state's tag says that `init` of this instance made it, and whether it has started. Every bit pattern of
//! both is a value of them, but for one byte of the state, which is looked at.

use core::mem::{MaybeUninit, offset_of};

use controller_core::{Coefficients, ControlLaw, Controller, Linear, Output, State, design};

use crate::VERSION;
use crate::status::{Status, answer, is_place, overlap, place, sized_place};

/// A design: `edo_smc_design_*_t`. Guess, numbers in the order of [`controller_core::LAYOUT`] up to its check, the row
/// of a(x)/b_0, the check over all of these.
#[repr(C)]
pub struct Design<const N: usize, const R: usize, const MASK: u8, const O: usize> {
    pub(crate) version: u32,
    /// n, r, channels.
    pub(crate) instance: u32,
    /// Guess of the disturbances to start with, in their physical units.
    pub(crate) d_hat: [f32; N],
    pub(crate) controller: Law<N, R, MASK, O>,
    pub(crate) check: f32,
}

/// A controller of the archive, and what it remembers.
type Law<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Controller<f32, Linear<f32, N>, N, R, MASK, O>;
type StateOf<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    State<f32, Linear<f32, N>, N, R, MASK, O>;

/// A state: `edo_smc_state_*_t`.
#[repr(C)]
pub struct Held<const N: usize, const R: usize, const MASK: u8, const O: usize> {
    /// Address of the design it belongs to.
    design: usize,
    tag: u32,
    state: MaybeUninit<StateOf<N, R, MASK, O>>,
}

/// n, r and channels as bytes.
pub(crate) const fn word(n: usize, r: usize, mask: u8) -> u32 {
    u32::from_le_bytes([n as u8, r as u8, mask, 0])
}

/// Tag of a state of this version and instance that waits for its first good sample; its complement, once it runs. A
/// hash (FNV-1a), so that no likely content of memory is one.
const fn waiting(instance: u32) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    let bytes = [VERSION.to_le_bytes(), instance.to_le_bytes()];
    let mut i = 0;
    while i < 8 {
        hash = (hash ^ bytes[i / 4][i % 4] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}

/// The layout that `edo_smc.h` declares and asserts too.
pub(crate) const fn assert_layout<const N: usize, const R: usize, const MASK: u8, const O: usize>() {
    let coefficients = size_of::<Coefficients<f32, N, R, O>>();
    assert!(coefficients == 4 * (19 + 2 * N + 3 * O * R));
    assert!(coefficients == 4 * (Coefficients::<f32, N, R, O>::NUMBERS - 1));
    assert!(offset_of!(Design<N, R, MASK, O>, d_hat) == 8);
    assert!(offset_of!(Design<N, R, MASK, O>, controller) == 8 + 4 * N);
    assert!(size_of::<Design<N, R, MASK, O>>() == 8 + 4 * N + coefficients + 4 * N + 4);
    assert!(align_of::<Design<N, R, MASK, O>>() == 4);
    let words = O * R + 2 * O + 4;
    assert!(size_of::<StateOf<N, R, MASK, O>>() == 4 * words);
    let packed = size_of::<usize>() + 4 + 4 * words;
    assert!(size_of::<Held<N, R, MASK, O>>() == packed.next_multiple_of(size_of::<usize>()));
    assert!(align_of::<Held<N, R, MASK, O>>() == align_of::<usize>());
    assert!(size_of::<Output<f32>>() == 16 && offset_of!(Output<f32>, health) == 12);
}

impl<const N: usize, const R: usize, const MASK: u8, const O: usize> Design<N, R, MASK, O> {
    pub(crate) const INSTANCE: u32 = word(N, R, MASK);
    const WAITING: u32 = waiting(Self::INSTANCE);
    const RUNNING: u32 = !Self::WAITING;

    /// The check over every number before it.
    pub(crate) fn check_of_numbers(&self) -> f32 {
        let coefficients = self.controller.coefficients().unchecked();
        design::check(self.d_hat.into_iter().chain(coefficients).chain(*self.controller.model().row()))
    }

    fn check(&self) -> Result<(), Status> {
        if self.version != VERSION {
            return Err(Status::VERSION);
        }
        if self.instance != Self::INSTANCE {
            return Err(Status::INSTANCE);
        }
        let coefficients = self.controller.coefficients();
        let row = self.controller.model().row();
        if !coefficients.unchecked().chain(self.d_hat).chain(*row).all(f32::is_finite) {
            return Err(Status::NOT_FINITE);
        }
        let is_design = self.check_of_numbers() == self.check && coefficients.can_be_designed();
        if is_design { Ok(()) } else { Err(Status::COEFFICIENTS) }
    }
}

/// # Safety
/// Pointers that are not NULL point to memory of the sizes given.
pub(crate) unsafe fn init<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    design: *const Design<N, R, MASK, O>,
    design_size: usize,
    state: *mut Held<N, R, MASK, O>,
    state_size: usize,
) -> Status {
    let places = || {
        sized_place(design, design_size)?;
        sized_place(state, state_size)?;
        if overlap(state, design) { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, of the right size; any bit pattern is a design.
    if let Err(status) = unsafe { &*design }.check() {
        return status;
    }
    let tag = Design::<N, R, MASK, O>::WAITING;
    // SAFETY: not NULL, aligned, of the right size.
    unsafe { state.write(Held { design: design.addr(), tag, state: MaybeUninit::zeroed() }) };
    Status::OK
}

/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn tick<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    design: *const Design<N, R, MASK, O>,
    state: *mut Held<N, R, MASK, O>,
    x: *const [f32; N],
    output: *mut Output<f32>,
) -> Status {
    if !(is_place(state) && is_place(x) && is_place(output)) {
        return answer(place(state).and_then(|()| place(x)).and_then(|()| place(output)));
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `Held`.
    if unsafe { (*state).tag } != Design::<N, R, MASK, O>::RUNNING {
        // SAFETY: not NULL, aligned, and as the caller promises.
        let status = unsafe { start(design, state, x, output) };
        if status != Status::OK {
            return status;
        }
    }
    // Number by number, which go to registers of the FPU; before the state is borrowed, for they may lie anywhere.
    // SAFETY: not NULL, aligned.
    let x = core::array::from_fn(|i| unsafe { x.cast::<f32>().add(i).read() });
    // SAFETY: as above.
    let held = unsafe { &mut *state };
    if held.design != design.addr() {
        return Status::OTHER_DESIGN;
    }
    if !flag_is_sound(held) {
        return Status::DAMAGED;
    }
    // SAFETY: `init` has looked at the design of this address, which does not overlap with the state.
    let controller = unsafe { &(*design).controller };
    // SAFETY: any bit pattern is a state whose flag is 0 or 1.
    let answer = controller.tick(unsafe { held.state.assume_init_mut() }, &x);
    // SAFETY: not NULL, aligned.
    unsafe { output.write(answer) };
    if answer.health.contains(controller_core::Health::INPUT_REJECTED) { Status::REJECTED } else { Status::OK }
}

/// The byte of a state that must be 0 or 1.
#[inline(always)]
fn flag_is_sound<const N: usize, const R: usize, const MASK: u8, const O: usize>(held: &Held<N, R, MASK, O>) -> bool {
    // SAFETY: the byte lies within the state.
    unsafe { held.state.as_ptr().cast::<u8>().add(StateOf::<N, R, MASK, O>::FLAG_AT).read() <= 1 }
}

/// The first good sample starts a state; until then the fallback goes out. Apart, so that a tick keeps its registers.
///
/// # Safety
/// `state`, `x` and `output` are not NULL, aligned and of their type; the design is one, if its address is the state's.
#[cold]
#[inline(never)]
unsafe fn start<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    design: *const Design<N, R, MASK, O>,
    state: *mut Held<N, R, MASK, O>,
    x: *const [f32; N],
    output: *mut Output<f32>,
) -> Status {
    // Here and not in every tick: what is static stays as it is, and every tick would pay 8 instructions for the rest.
    if overlap(output, state) || overlap(output, design) {
        return Status::OVERLAP;
    }
    // SAFETY: as the caller promises; taken out before the state is borrowed.
    let x = unsafe { x.read() };
    // SAFETY: as the caller promises; any bit pattern is a `Held`.
    let held = unsafe { &mut *state };
    if held.tag != Design::<N, R, MASK, O>::WAITING {
        return Status::NOT_INITIALISED;
    }
    if held.design != design.addr() {
        return if design.is_null() { Status::NULL } else { Status::OTHER_DESIGN };
    }
    // SAFETY: `init` has looked at the design of this address.
    let Design { controller, d_hat, .. } = unsafe { &*design };
    if let Some(started) = controller.start_from(&x, d_hat) {
        held.state.write(started);
        held.tag = Design::<N, R, MASK, O>::RUNNING;
        return Status::OK;
    }
    // SAFETY: as the caller promises.
    unsafe { output.write(controller.not_started()) };
    Status::REJECTED
}

/// # Safety
/// A pointer that is not NULL points to memory of a state.
pub(crate) unsafe fn report_applied<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    state: *mut Held<N, R, MASK, O>,
    u: f32,
) -> Status {
    if let Err(status) = place(state) {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `Held`.
    let held = unsafe { &mut *state };
    if held.tag == Design::<N, R, MASK, O>::WAITING {
        return Status::NOT_STARTED;
    }
    if held.tag != Design::<N, R, MASK, O>::RUNNING {
        return Status::NOT_INITIALISED;
    }
    if !flag_is_sound(held) {
        return Status::DAMAGED;
    }
    // SAFETY: any bit pattern is a state whose flag is 0 or 1.
    let sound = Law::<N, R, MASK, O>::report_applied(unsafe { held.state.assume_init_mut() }, u);
    if sound { Status::OK } else { Status::NOT_FINITE }
}

/// # Safety
/// A pointer that is not NULL points to memory of a state.
pub(crate) unsafe fn reset<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    state: *mut Held<N, R, MASK, O>,
) -> Status {
    if let Err(status) = place(state) {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `Held`.
    let held = unsafe { &mut *state };
    let (waiting, running) = (Design::<N, R, MASK, O>::WAITING, Design::<N, R, MASK, O>::RUNNING);
    if held.tag != waiting && held.tag != running {
        return Status::NOT_INITIALISED;
    }
    held.tag = waiting;
    Status::OK
}
