//! An instance of the archive: a law with the memory it has in C, and what can be done with the two.
//!
//! # What a tick trusts
//! `init` looks at the whole design once and keeps its *address* in the state, never to follow it, only to compare: a
//! tick with a design at that address needs not ask again whether it is NULL, aligned, of this version and instance,
//! finite. The state's tag says that `init` of this instance made it, and whether it has started. Every bit pattern of
//! both is a value of them, but for one or two bytes of the state, which are looked at.

use core::mem::MaybeUninit;

use controller_core::{ControlLaw, Health, Output};

use crate::VERSION;
use crate::status::{Status, answer, is_place, overlap, place, sized_place};

/// A design as C holds it; any bit pattern is one.
pub trait Instance {
    /// What it is the design of.
    type Law: ControlLaw<Scalar = f32, Output = Output<f32>>;
    /// What comes in once per tick, as C has it; any bit pattern is one.
    type Sample;
    /// What the law knows, as C has it.
    type Estimates;
    /// Tells the instance from the others.
    const WORD: u32;
    /// Where the bytes of a state lie that must be 0 or 1; all others may be anything.
    const FLAGS_AT: &'static [usize];

    /// Is it what a design call of this version and instance made?
    ///
    /// # Errors
    /// What it is instead.
    fn check(&self) -> Result<(), Status>;

    /// # Safety
    /// It has been checked, and is as it was then.
    unsafe fn law(&self) -> &Self::Law;

    /// # Safety
    /// The place is not NULL, aligned, and memory of its type.
    unsafe fn read(sample: *const Self::Sample) -> <Self::Law as ControlLaw>::Sample;

    /// The state before the first tick, if this sample is good enough to start with.
    ///
    /// # Safety
    /// It has been checked, and is as it was then.
    unsafe fn start(&self, sample: &<Self::Law as ControlLaw>::Sample) -> Option<<Self::Law as ControlLaw>::State>;

    /// What the law knows, for C.
    fn c_estimates(known: <Self::Law as ControlLaw>::Estimates) -> Self::Estimates;
}

/// A state: `edo_smc_state_*_t`.
#[repr(C)]
pub struct CState<D: Instance> {
    /// Address of the design it belongs to.
    design: usize,
    tag: u32,
    state: MaybeUninit<<D::Law as ControlLaw>::State>,
}

/// Words of a state, behind its address.
pub(crate) const fn words_of_state<D: Instance>() -> usize {
    let size = size_of::<<D::Law as ControlLaw>::State>();
    assert!(size.is_multiple_of(4) && align_of::<<D::Law as ControlLaw>::State>() == 4);
    let packed = size_of::<usize>() + 4 + size;
    assert!(size_of::<CState<D>>() == packed.next_multiple_of(size_of::<usize>()));
    assert!(align_of::<CState<D>>() == align_of::<usize>());
    assert!(size_of::<Output<f32>>() == 16 && core::mem::offset_of!(Output<f32>, health) == 12);
    size / 4
}

/// Tag of a state of this version and instance that waits for its first good sample; its complement, once it runs. A
/// hash (FNV-1a), so that no likely content of memory is one.
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

    /// Are the bytes 0 or 1 that must be?
    #[inline(always)]
    fn is_sound(&self) -> bool {
        // SAFETY: the bytes lie within the state.
        D::FLAGS_AT.iter().all(|&at| unsafe { self.state.as_ptr().cast::<u8>().add(at).read() <= 1 })
    }

    /// Has it started, and is it whole?
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

/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn tick<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: as the caller promises, and as `ticked` does.
    unsafe { ticked(design, state, sample, output, start) }
}

/// The same, but for a start.
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
    // SAFETY: as the caller promises, and as `ticked` does.
    unsafe { ticked(design, state, sample, output, wait) }
}

/// A tick; what does not run is first given to `begin`, and goes no further unless that is `OK`.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type. For `begin` they are not NULL and aligned, but for the
/// design, which is one if its address is the state's.
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
    // Before the state is borrowed, for it may lie anywhere.
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
    // SAFETY: `init` has looked at the design of this address, which does not overlap with the state.
    let law = unsafe { (*design).law() };
    // SAFETY: any bit pattern is a state whose flags are 0 or 1.
    let answer = law.tick(unsafe { held.state.assume_init_mut() }, &sample);
    // SAFETY: not NULL, aligned.
    unsafe { output.write(answer) };
    if answer.health.contains(Health::INPUT_REJECTED) { Status::REJECTED } else { Status::OK }
}

/// The first good sample starts a state; until then the fallback goes out. Apart, so that a tick keeps its registers.
///
/// # Safety
/// `state`, `sample` and `output` are not NULL, aligned and of their type; the design is one, if its address is the
/// state's.
#[cold]
#[inline(never)]
unsafe fn start<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    sample: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: as the caller promises.
    if let Err(status) = unsafe { is_waiting(design, state, output) } {
        return status;
    }
    // SAFETY: as the caller promises; taken out before the state is borrowed.
    let sample = unsafe { D::read(sample) };
    // SAFETY: as the caller promises; any bit pattern is a `CState`.
    let held = unsafe { &mut *state };
    // SAFETY: `init` has looked at the design of this address.
    if let Some(mut started) = unsafe { (*design).start(&sample) } {
        // SAFETY: as above.
        unsafe { (*design).law().wait(&mut started) };
        held.state.write(started);
        held.tag = CState::<D>::RUNNING;
        return Status::OK;
    }
    // SAFETY: as the caller promises, and as above.
    unsafe { output.write((*design).law().not_started()) };
    Status::REJECTED
}

/// What does not run stays as it is, and the fallback goes out.
///
/// # Safety
/// As of `start`.
#[cold]
#[inline(never)]
unsafe fn wait<D: Instance>(
    design: *const D,
    state: *mut CState<D>,
    _: *const D::Sample,
    output: *mut Output<f32>,
) -> Status {
    // SAFETY: as the caller promises.
    if let Err(status) = unsafe { is_waiting(design, state, output) } {
        return status;
    }
    // SAFETY: as the caller promises; `init` has looked at the design of this address.
    unsafe { output.write((*design).law().not_started()) };
    Status::NOT_STARTED
}

/// Is it what `init` of this instance and design has made, and apart from where the answer goes?
///
/// # Safety
/// As of `start`.
unsafe fn is_waiting<D: Instance>(
    design: *const D,
    state: *const CState<D>,
    output: *mut Output<f32>,
) -> Result<(), Status> {
    // Here and not in every tick: what is static stays as it is, and every tick would pay 8 instructions for the rest.
    if overlap(output, state) || overlap(output, design) {
        return Err(Status::OVERLAP);
    }
    // SAFETY: as the caller promises; any bit pattern is a `CState`.
    let held = unsafe { &*state };
    if held.tag != CState::<D>::WAITING {
        return Err(Status::NOT_INITIALISED);
    }
    if held.design != design.addr() {
        return Err(if design.is_null() { Status::NULL } else { Status::OTHER_DESIGN });
    }
    Ok(())
}

/// What the power stage holds or gives, for a running state.
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

/// What happens between two ticks.
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
    // SAFETY: `init` has looked at the design of this address; any bit pattern is a state whose flags are 0 or 1.
    unsafe { happens((*design).law(), held.state.assume_init_mut()) };
    Status::OK
}

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
    // SAFETY: `init` has looked at the design of this address; the flags of the state are 0 or 1.
    let estimates = unsafe { (*design).law().estimates(held.state.assume_init_ref()) };
    // SAFETY: not NULL, aligned.
    unsafe { known.write(D::c_estimates(estimates)) };
    Status::OK
}

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
    // SAFETY: not NULL, aligned; taken out before the state is borrowed.
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
        // SAFETY: both designs have been looked at; the flags of the state are 0 or 1.
        match unsafe { other.law().take_over((*from).law(), held.state.assume_init_ref(), &sample) } {
            Ok(state) => held.state.write(state),
            Err(error) => return Status::of_retune(error),
        };
    }
    held.design = to.addr();
    Status::OK
}
