//! Functions that chains and drives share, on a controller in the memory layout of C.
//!
//! # Assumptions of a tick
//! `init` checks the whole design once and stores its *address* in the state. The address is only compared, never
//! dereferenced. A tick with a design at that address does not repeat the checks: not NULL, aligned, of this version
//! and instance, finite. The tag of the state shows that `init` of this instance made the state, and whether it has
//! started. Every bit pattern of design and state is a valid value, except for one or two bytes of the state. Every
//! call checks these bytes.

use core::mem::MaybeUninit;

use controller_core::{ControlLaw, Health, Output};

use crate::VERSION;
use crate::status::{Status, answer, is_place, overlap, place, sized_place};

/// Design in the memory layout of C; every bit pattern is valid.
pub trait Instance {
    /// Controller of this design.
    type Law: ControlLaw<Scalar = f32, Output = Output<f32>>;
    /// Input of a tick in the memory layout of C; every bit pattern is valid.
    type Sample;
    /// Estimates in the memory layout of C.
    type Estimates;
    /// Word that identifies the instance.
    const WORD: u32;
    /// Offsets of the bytes of a state that must be 0 or 1. All other bytes may have any value.
    const FLAGS_AT: &'static [usize];

    /// Checks that a design call of this version and instance made the design.
    ///
    /// # Errors
    /// The status of the first difference: version, instance, a number that is not finite, or changed coefficients.
    fn check(&self) -> Result<(), Status>;

    /// Returns the controller.
    ///
    /// # Safety
    /// The design has passed [`check`](Self::check) and has not changed since.
    unsafe fn law(&self) -> &Self::Law;

    /// Reads a sample.
    ///
    /// # Safety
    /// The pointer is not NULL, aligned, and points to memory of its type.
    unsafe fn read(sample: *const Self::Sample) -> <Self::Law as ControlLaw>::Sample;

    /// Returns the state before the first tick if the sample is valid for a start.
    ///
    /// # Safety
    /// The design has passed [`check`](Self::check) and has not changed since.
    unsafe fn start(&self, sample: &<Self::Law as ControlLaw>::Sample) -> Option<<Self::Law as ControlLaw>::State>;

    /// Converts estimates to their type in C.
    fn c_estimates(known: <Self::Law as ControlLaw>::Estimates) -> Self::Estimates;
}

/// State of a controller, `edo_smc_state_*_t`.
#[repr(C)]
pub struct CState<D: Instance> {
    /// Address of the design of this state.
    design: usize,
    tag: u32,
    state: MaybeUninit<<D::Law as ControlLaw>::State>,
}

/// Returns the number of words of a state, without address and tag.
pub(crate) const fn words_of_state<D: Instance>() -> usize {
    let size = size_of::<<D::Law as ControlLaw>::State>();
    assert!(size.is_multiple_of(4) && align_of::<<D::Law as ControlLaw>::State>() == 4);
    let packed = size_of::<usize>() + 4 + size;
    assert!(size_of::<CState<D>>() == packed.next_multiple_of(size_of::<usize>()));
    assert!(align_of::<CState<D>>() == align_of::<usize>());
    assert!(size_of::<Output<f32>>() == 16 && core::mem::offset_of!(Output<f32>, health) == 12);
    size / 4
}

/// Returns the tag of a state of this version and instance that waits for its first valid sample. A running state has
/// the complement. The tag is an FNV-1a hash, so arbitrary memory is unlikely to contain it.
pub(crate) const fn waiting(instance: u32) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    let bytes = [VERSION.to_le_bytes(), instance.to_le_bytes()];
    let mut i = 0;
    while i < 8 {
        hash = (hash ^ bytes[i / 4][i % 4] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}

impl<D: Instance> CState<D> {
    const WAITING: u32 = waiting(D::WORD);
    const RUNNING: u32 = !Self::WAITING;

    /// Returns whether the flag bytes are 0 or 1.
    #[inline(always)]
    fn is_sound(&self) -> bool {
        // SAFETY: the bytes lie within the state.
        D::FLAGS_AT.iter().all(|&at| unsafe { self.state.as_ptr().cast::<u8>().add(at).read() <= 1 })
    }

    /// Checks that the state has started and that its flags are valid.
    fn is_running(&self) -> Result<(), Status> {
        if self.tag == Self::WAITING {
            Err(Status::NOT_STARTED)
        } else if self.tag != Self::RUNNING {
            Err(Status::NOT_INITIALISED)
        } else if self.is_sound() {
            Ok(())
        } else {
            Err(Status::DAMAGED)
        }
    }
}

/// Checks a design and makes a state that waits for its first valid sample.
///
/// # Safety
/// Pointers that are not NULL point to memory of the sizes given.
pub(crate) unsafe fn init<D: Instance>(
    design: *const D,
    design_size: usize,
    state: *mut CState<D>,
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
    let tag = CState::<D>::WAITING;
    // SAFETY: not NULL, aligned, of the right size.
    unsafe { state.write(CState { design: design.addr(), tag, state: MaybeUninit::zeroed() }) };
    Status::OK
}

/// Computes one tick; the first valid sample starts the state.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn tick<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: guaranteed by the caller, and as `ticked` does.
    unsafe { ticked(design, state, sample, output, start) }
}

/// Computes one tick of a started state; otherwise the fallback is the output.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn go_on<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: guaranteed by the caller, and as `ticked` does.
    unsafe { ticked(design, state, sample, output, wait) }
}

/// Computes one tick. A state that has not started is passed to `begin`; the tick continues only if it returns `OK`.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type. `begin` gets pointers that are not NULL and aligned,
/// except for the design. The design is valid if its address is the address in the state.
#[inline(always)]
unsafe fn ticked<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
    begin: unsafe fn(*const D, *mut CState<D>, *const D::Sample, *mut Output<f32>) -> Status,
) -> Status {
    if !(is_place(state) && is_place(sample) && is_place(output)) {
        return answer(place(state).and_then(|()| place(sample)).and_then(|()| place(output)));
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    if unsafe { (*state).tag } != CState::<D>::RUNNING {
        // SAFETY: not NULL, aligned, and as the caller promises.
        let status = unsafe { begin(design, state, sample, output) };
        if status != Status::OK {
            return status;
        }
    }
    // Read before the state is borrowed: the two may share memory.
    // SAFETY: not NULL, aligned.
    let sample = unsafe { D::read(sample) };
    // SAFETY: as above.
    let held = unsafe { &mut *state };
    if held.design != design.addr() {
        return Status::OTHER_DESIGN;
    }
    if !held.is_sound() {
        return Status::DAMAGED;
    }
    // SAFETY: `init` has checked the design at this address; design and state do not overlap.
    let law = unsafe { (*design).law() };
    // SAFETY: any bit pattern is a state whose flags are 0 or 1.
    let answer = law.tick(unsafe { held.state.assume_init_mut() }, &sample);
    // SAFETY: not NULL, aligned.
    unsafe { output.write(answer) };
    if answer.health.contains(Health::INPUT_REJECTED) { Status::REJECTED } else { Status::OK }
}

/// Starts a state with its first valid sample; until then the fallback is the output. A separate function, so that a
/// tick keeps its registers.
///
/// # Safety
/// `state`, `sample` and `output` are not NULL, aligned and of their type. The design is valid if its address is the
/// address in the state.
#[cold]
#[inline(never)]
unsafe fn start<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: guaranteed by the caller.
    if let Err(status) = unsafe { is_waiting(design, state, output) } {
        return status;
    }
    // SAFETY: guaranteed by the caller; read before the state is borrowed.
    let sample = unsafe { D::read(sample) };
    // SAFETY: guaranteed by the caller; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    // SAFETY: `init` has checked the design at this address.
    if let Some(mut started) = unsafe { (*design).start(&sample) } {
        // SAFETY: as above.
        unsafe { (*design).law().wait(&mut started) };
        held.state.write(started);
        held.tag = CState::<D>::RUNNING;
        return Status::OK;
    }
    // SAFETY: guaranteed by the caller, and as above.
    unsafe { output.write((*design).law().not_started()) };
    Status::REJECTED
}

/// Leaves a state that has not started unchanged; the fallback is the output.
///
/// # Safety
/// The conditions of `start`.
#[cold]
#[inline(never)]
unsafe fn wait<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    _: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: guaranteed by the caller.
    if let Err(status) = unsafe { is_waiting(design, state, output) } {
        return status;
    }
    // SAFETY: guaranteed by the caller; `init` has looked at the design of this address.
    unsafe { output.write((*design).law().not_started()) };
    Status::NOT_STARTED
}

/// Checks that `init` of this instance and design made the state, and that the output overlaps with neither.
///
/// # Errors
/// Overlap, a state without `init`, or another design.
///
/// # Safety
/// The conditions of `start`.
unsafe fn is_waiting<D: Instance>(
    design: *const D,
    state: *const CState<D>,
    output: *mut Output<f32>,
) -> Result<(), Status> {
    // Only before the start: static memory does not move, and the check would cost 8 instructions in every tick.
    if overlap(output, state) || overlap(output, design) {
        return Err(Status::OVERLAP);
    }
    // SAFETY: guaranteed by the caller; any bit pattern is a `CState`.
    let held = unsafe { &*state };
    if held.tag != CState::<D>::WAITING {
        return Err(Status::NOT_INITIALISED);
    }
    if held.design != design.addr() {
        return Err(if design.is_null() { Status::NULL } else { Status::OTHER_DESIGN });
    }
    Ok(())
}

/// Passes a number of the power stage, its held u or its limit, to a running state.
///
/// # Safety
/// A pointer that is not NULL points to memory of a state.
pub(crate) unsafe fn of_the_stage<D: Instance>(
    state: *mut CState<D>,
    u: f32,
    takes: impl FnOnce(&mut <D::Law as ControlLaw>::State, f32) -> bool,
) -> Status {
    if let Err(status) = place(state) {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    if let Err(status) = held.is_running() {
        return status;
    }
    // SAFETY: any bit pattern is a state whose flags are 0 or 1.
    let taken = takes(unsafe { held.state.assume_init_mut() }, u);
    if taken { Status::OK } else { Status::NOT_FINITE }
}

/// Applies an operation between two ticks to a running state.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn between<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    happens: impl FnOnce(&D::Law, &mut <D::Law as ControlLaw>::State),
) -> Status {
    if let Err(status) = place(state) {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    if let Err(status) = held.is_running() {
        return status;
    }
    if held.design != design.addr() {
        return if design.is_null() { Status::NULL } else { Status::OTHER_DESIGN };
    }
    // SAFETY: `init` has checked the design at this address; any bit pattern is a state whose flags are 0 or 1.
    unsafe { happens((*design).law(), held.state.assume_init_mut()) };
    Status::OK
}

/// Returns a state to waiting for its first valid sample.
///
/// # Safety
/// A pointer that is not NULL points to memory of a state.
pub(crate) unsafe fn reset<D: Instance>(state: *mut CState<D>) -> Status {
    if let Err(status) = place(state) {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    if held.tag != CState::<D>::WAITING && held.tag != CState::<D>::RUNNING {
        return Status::NOT_INITIALISED;
    }
    held.tag = CState::<D>::WAITING;
    Status::OK
}

/// Writes the estimates at the instant of the last tick.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn estimates<D: Instance>(
    design: *const D,
    state: *const CState<D>,
    known: *mut D::Estimates,
) -> Status {
    let places = || {
        place(state)?;
        place(known)?;
        if overlap(known, state) || overlap(known, design) { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    let held = unsafe { &*state };
    if let Err(status) = held.is_running() {
        return status;
    }
    if held.design != design.addr() {
        return Status::OTHER_DESIGN;
    }
    // SAFETY: `init` has checked the design at this address; the flags of the state are 0 or 1.
    let estimates = unsafe { (*design).law().estimates(held.state.assume_init_ref()) };
    // SAFETY: not NULL, aligned.
    unsafe { known.write(D::c_estimates(estimates)) };
    Status::OK
}

/// Checks another design and switches to it before the next tick; a waiting state changes only its design.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type, `to` to memory of the size given.
pub(crate) unsafe fn retune<D: Instance>(
    from: *const D,
    to: *const D,
    design_size: usize,
    state: *mut CState<D>,
    sample: *const D::Sample,
) -> Status {
    let places = || {
        sized_place(to, design_size)?;
        place(state)?;
        place(sample)?;
        if overlap(state, to) { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, of the right size; any bit pattern is a design.
    let other = unsafe { &*to };
    if let Err(status) = other.check() {
        return status;
    }
    // SAFETY: not NULL, aligned; read before the state is borrowed.
    let sample = unsafe { D::read(sample) };
    // SAFETY: not NULL, aligned; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    let running = match held.is_running() {
        Ok(()) => true,
        Err(Status::NOT_STARTED) => false,
        Err(status) => return status,
    };
    if held.design != from.addr() {
        return Status::OTHER_DESIGN;
    }
    if running {
        // SAFETY: both designs have been checked; the flags of the state are 0 or 1.
        match unsafe { other.law().take_over((*from).law(), held.state.assume_init_ref(), &sample) } {
            Ok(state) => held.state.write(state),
            Err(error) => return Status::of_retune(error),
        };
    }
    held.design = to.addr();
    Status::OK
}
