//! Designs of drives in the memory layout of C: a motor with one encoder, a flexible joint with two.
//!
//! The configuration of a drive is a struct of doubles in C. Its order is
//! [`LAYOUT`](controller_core::drive::LAYOUT), followed by three further numbers. A design is opaque to C: the words of
//! a controller with its monitors, computed on the target, and a check over all words.
//!
//! A coupled joint has no rule here, because the search for its gains runs on the host (`scenario::drive::joint_rule`).
//! Its configuration comes from `host-sim export --lang c`.

use core::mem::MaybeUninit;

use controller_core::drive::{
    BRAKING, CoupledDrive, DriveError, DriveEstimates, DriveLaw, Fence, JointBandwidths, JointDesign, JointDrive,
    Monitored, MotorDesign, MotorDrive, Position, Sample, Slowing, Target,
};
use controller_core::{Health, Output};

use crate::VERSION;
use crate::instance::Instance;
use crate::status::{Status, overlap, place, sized_place};

/// Configuration of a drive: `edo_smc_config_motor_t`, `edo_smc_config_joint_t`, `edo_smc_config_coupled_t`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CConfig<const NUMBERS: usize> {
    numbers: [f64; NUMBERS],
    /// Motor: time constant of the current loop, s. Joint: largest sudden load on the link, N m.
    lag_or_load: f64,
    /// Tolerance of the data sheet, 0 to 0.9.
    uncertain: f64,
    /// Bits of the alarms that stop the drive, as a number.
    stops_at: f64,
}

/// Rejected number of a configuration, `edo_smc_refusal_t`.
#[repr(C)]
pub struct CRefusal {
    /// Name of the number in the configuration, padded with zeros.
    field: [u8; 32],
    given: f64,
    low: f64,
    high: f64,
}

/// Controller of the archive, with its monitors.
pub trait Form<const E: usize, const N: usize, const NUMBERS: usize>:
    DriveLaw<E, N, Sample = Sample<i32, Target<f32, i32, N>, E>> + Sized
{
    const WORD: u32;
    /// Offsets in bytes of the words that are narrower than a word. The byte at the first must be 0 or 1.
    const PARTS: [(usize, u32); 2];
    /// Offsets of the bytes of a state that must be 0 or 1.
    const FLAGS: &'static [usize];
    /// Name of `lag_or_load` in the configuration, and its maximum.
    const LAG_OR_LOAD: (&'static str, f64);

    /// Scales the bandwidths to another surface bandwidth, rad/s, and sets the innovation gates.
    fn tune(config: &mut CConfig<NUMBERS>, surface_rad_s: f64);
    /// Returns the controller of a configuration, with the monitors of the configuration.
    ///
    /// # Errors
    /// A number of the configuration is outside of its range.
    fn of(config: &CConfig<NUMBERS>, stops_at: Health) -> Result<Self, DriveError>;
    /// Returns the deceleration and the gain of the brake, for a fence.
    fn slowing(config: &CConfig<NUMBERS>) -> Slowing;
    /// Calls [`Fence::guard`] with the target at the beginning of the tick.
    fn guard(&self, fence: &Fence, state: &mut Self::State, output: &mut Output<f32>, begin: &Target<f32, i32, N>);
}

/// Controller whose gains follow from the data sheet by a rule, without a search.
pub trait Ruled<const E: usize, const N: usize, const NUMBERS: usize>: Form<E, N, NUMBERS> {
    /// Fills the values that are not on the data sheet.
    fn by_rule(config: &mut CConfig<NUMBERS>);
}

/// Default tolerance of a data sheet.
const UNCERTAIN: f64 = 0.2;

/// Kinds in the instance word: a drive, and a coupled joint. A chain has 0.
const DRIVE: u8 = 1;
const AS_A_WHOLE: u8 = 2;

/// Returns the instance word: encoders, high gain sets, ticks of delay, kind.
const fn word(encoders: u8, fast: usize, late: usize, kind: u8) -> u32 {
    u32::from_le_bytes([encoders, fast as u8, late as u8, kind])
}

type MotorLaw<const FAST: usize, const LATE: usize> = Monitored<MotorDrive<f32, Position, FAST, LATE>, 1>;
type JointLaw<const FAST: usize, const LATE: usize> = Monitored<JointDrive<f32, Position, FAST, LATE>, 2>;
type CoupledLaw<const FAST: usize, const LATE: usize> = Monitored<CoupledDrive<f32, Position, FAST, LATE>, 2>;

const MOTOR: usize = MotorDesign::NUMBERS;
const JOINT: usize = JointDesign::NUMBERS;
const COUPLED: usize = JointDesign::COUPLED_NUMBERS;

impl<const FAST: usize, const LATE: usize> Form<1, 2, MOTOR> for MotorLaw<FAST, LATE> {
    const WORD: u32 = word(1, FAST, LATE, DRIVE);
    const PARTS: [(usize, u32); 2] = Self::PARTS_AT;
    const FLAGS: &'static [usize] = &Self::FLAGS_AT;
    const LAG_OR_LOAD: (&'static str, f64) = ("lag_s", 1.0);

    fn tune(config: &mut CConfig<MOTOR>, surface_rad_s: f64) {
        config.numbers = MotorDesign::from_numbers(&config.numbers).with_surface(surface_rad_s).to_numbers();
    }

    fn of(config: &CConfig<MOTOR>, stops_at: Health) -> Result<Self, DriveError> {
        let design = MotorDesign::from_numbers(&config.numbers);
        let law = MotorDrive::<f32, Position, FAST, LATE>::try_design(&design)?;
        let bounds = design.bounds(&law, config.uncertain);
        Ok(Self::new(law, &bounds).stopping_at(stops_at))
    }

    fn slowing(config: &CConfig<MOTOR>) -> Slowing {
        MotorDesign::from_numbers(&config.numbers).slowing(LATE)
    }

    #[inline(always)]
    fn guard(&self, fence: &Fence, state: &mut Self::State, output: &mut Output<f32>, begin: &Target<f32, i32, 2>) {
        fence.guard_state(self, state, output, begin);
    }
}

impl<const FAST: usize, const LATE: usize> Ruled<1, 2, MOTOR> for MotorLaw<FAST, LATE> {
    fn by_rule(config: &mut CConfig<MOTOR>) {
        let MotorDesign { period_s, motor, encoder, limits, .. } = MotorDesign::from_numbers(&config.numbers);
        let design = MotorDesign::by_rule(period_s, motor, encoder, limits);
        config.numbers = design.with_lag(config.lag_or_load, LATE as u32).to_numbers();
    }
}

impl<const FAST: usize, const LATE: usize> Form<2, 4, JOINT> for JointLaw<FAST, LATE> {
    const WORD: u32 = word(2, FAST, LATE, DRIVE);
    const PARTS: [(usize, u32); 2] = Self::PARTS_AT;
    const FLAGS: &'static [usize] = &Self::FLAGS_AT;
    const LAG_OR_LOAD: (&'static str, f64) = ("load_n_m", 1e9);

    fn tune(config: &mut CConfig<JOINT>, surface_rad_s: f64) {
        let design = JointDesign::from_numbers(&config.numbers);
        let bandwidths = design.bandwidths.with_surface(surface_rad_s).within(design.period_s, LATE);
        config.numbers = design.with_bandwidths(bandwidths, config.lag_or_load).to_numbers();
    }

    fn of(config: &CConfig<JOINT>, stops_at: Health) -> Result<Self, DriveError> {
        let design = JointDesign::from_numbers(&config.numbers);
        let law = JointDrive::<f32, Position, FAST, LATE>::try_design(&design)?;
        let bounds = design.bounds(&law, config.lag_or_load, config.uncertain);
        Ok(Self::new(law, &bounds).stopping_at(stops_at))
    }

    fn slowing(config: &CConfig<JOINT>) -> Slowing {
        JointDesign::from_numbers(&config.numbers).slowing(LATE)
    }

    #[inline(always)]
    fn guard(&self, fence: &Fence, state: &mut Self::State, output: &mut Output<f32>, begin: &Target<f32, i32, 4>) {
        fence.guard_state(self, state, output, begin);
    }
}

impl<const FAST: usize, const LATE: usize> Ruled<2, 4, JOINT> for JointLaw<FAST, LATE> {
    fn by_rule(config: &mut CConfig<JOINT>) {
        let JointDesign { period_s, joint, encoders, limits, .. } = JointDesign::from_numbers(&config.numbers);
        let bandwidths = JointBandwidths::DEFAULT.within(period_s, LATE);
        let design = JointDesign::new(period_s, joint, encoders, limits, config.lag_or_load);
        config.numbers = design.with_bandwidths(bandwidths, config.lag_or_load).to_numbers();
    }
}

impl<const FAST: usize, const LATE: usize> Form<2, 4, COUPLED> for CoupledLaw<FAST, LATE> {
    const WORD: u32 = word(2, FAST, LATE, AS_A_WHOLE);
    const PARTS: [(usize, u32); 2] = Self::PARTS_AT;
    const FLAGS: &'static [usize] = &Self::FLAGS_AT;
    const LAG_OR_LOAD: (&'static str, f64) = ("load_n_m", 1e9);

    fn tune(config: &mut CConfig<COUPLED>, surface_rad_s: f64) {
        let design = JointDesign::from_coupled_numbers(&config.numbers);
        let tuned = design.with_bandwidths(design.bandwidths.with_surface(surface_rad_s), config.lag_or_load);
        if let Some(numbers) = tuned.to_coupled_numbers() {
            config.numbers = numbers;
        }
    }

    fn of(config: &CConfig<COUPLED>, stops_at: Health) -> Result<Self, DriveError> {
        let design = JointDesign::from_coupled_numbers(&config.numbers);
        let law = CoupledDrive::<f32, Position, FAST, LATE>::try_design(&design)?;
        let bounds = design.bounds(&law, config.lag_or_load, config.uncertain);
        Ok(Self::new(law, &bounds).stopping_at(stops_at))
    }

    fn slowing(config: &CConfig<COUPLED>) -> Slowing {
        JointDesign::from_coupled_numbers(&config.numbers).slowing(LATE)
    }

    #[inline(always)]
    fn guard(&self, fence: &Fence, state: &mut Self::State, output: &mut Output<f32>, begin: &Target<f32, i32, 4>) {
        fence.guard_state(self, state, output, begin);
    }
}

/// Design of a drive, `edo_smc_design_*_t`.
#[repr(C)]
pub struct Design<L, const E: usize, const N: usize, const NUMBERS: usize> {
    version: u32,
    instance: u32,
    law: MaybeUninit<L>,
    check: u32,
}

impl<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Design<L, E, N, NUMBERS> {
    /// Number of words of a controller. Each word is written, or a byte of it that [`Form::PARTS`] names.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<L>() == 4 && size_of::<Self>() == 12 + size_of::<L>());
        assert!(L::PARTS[0].0.is_multiple_of(4) && L::PARTS[1].0.is_multiple_of(4));
        size_of::<L>() / 4
    };

    /// Returns the FNV-1a hash over all words. A change of one word changes the hash.
    fn sum(&self) -> u32 {
        let law = self.law.as_ptr().cast::<u32>();
        let word = |i: usize| {
            let [(flag, _), (alarms, _)] = L::PARTS;
            // SAFETY: within the law and aligned; padding only follows the byte and the half-word, which are read
            // alone.
            unsafe {
                match 4 * i {
                    at if at == flag => law.add(i).cast::<u8>().read().into(),
                    at if at == alarms => law.add(i).cast::<u16>().read().into(),
                    _ => law.add(i).read(),
                }
            }
        };
        (0..Self::WORDS).fold(0x811c_9dc5, |sum, i| (sum ^ word(i)).wrapping_mul(0x0100_0193))
    }
}

impl<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Instance
    for Design<L, E, N, NUMBERS>
{
    type Law = L;
    type Sample = CSample<E, N>;
    type Estimates = CKnown<E>;
    const WORD: u32 = L::WORD;
    const FLAGS_AT: &'static [usize] = L::FLAGS;

    fn check(&self) -> Result<(), Status> {
        if self.version != VERSION {
            return Err(Status::VERSION);
        }
        if self.instance != L::WORD {
            return Err(Status::INSTANCE);
        }
        // SAFETY: within the law.
        let flag = unsafe { self.law.as_ptr().cast::<u8>().add(L::PARTS[0].0).read() };
        if flag <= 1 && self.sum() == self.check { Ok(()) } else { Err(Status::COEFFICIENTS) }
    }

    #[inline(always)]
    unsafe fn law(&self) -> &L {
        // SAFETY: guaranteed by the caller; every bit pattern with a flag of 0 or 1 is a law.
        unsafe { self.law.assume_init_ref() }
    }

    #[inline(always)]
    unsafe fn read(sample: *const CSample<E, N>) -> L::Sample {
        // SAFETY: guaranteed by the caller.
        let CSample { counts, lost, begin, end } = unsafe { sample.read() };
        let counts = core::array::from_fn(|i| (lost >> i & 1 == 0).then_some(counts[i]));
        Sample { counts, begin: begin.target(), end: end.target() }
    }

    #[inline(always)]
    unsafe fn start(&self, sample: &L::Sample) -> Option<L::State> {
        // SAFETY: guaranteed by the caller.
        unsafe { self.law() }.start(sample)
    }

    fn c_estimates(known: DriveEstimates<f32, i32, E>) -> CKnown<E> {
        let DriveEstimates { turn, position, speed, disturbance, load } = known;
        CKnown { turn, position, speed, disturbance, load }
    }
}

/// Target position and its derivatives, `edo_smc_target_*_t`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CTarget<const N: usize> {
    pub(crate) turn: i32,
    pub(crate) jet: [f32; N],
}

impl<const N: usize> CTarget<N> {
    #[inline(always)]
    pub(crate) fn target(self) -> Target<f32, i32, N> {
        Target { turn: self.turn, jet: self.jet }
    }
}

/// Input of a tick, `edo_smc_sample_*_t`.
#[repr(C)]
pub struct CSample<const E: usize, const N: usize> {
    counts: [i32; E],
    /// Missing counts: bit i for encoder i.
    lost: u32,
    pub(crate) begin: CTarget<N>,
    end: CTarget<N>,
}

/// Estimates of a drive, `edo_smc_estimates_*_t`.
#[repr(C)]
pub struct CKnown<const E: usize> {
    turn: i32,
    position: [f32; E],
    speed: [f32; E],
    disturbance: [f32; E],
    load: [f32; E],
}

impl<L: Ruled<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Design<L, E, N, NUMBERS> {
    /// Fills the configuration by rule, with the default tolerance and the reaction `BRAKING`.
    ///
    /// # Safety
    /// A pointer that is not NULL points to memory of the size given.
    pub(crate) unsafe fn by_rule(config: *mut CConfig<NUMBERS>, config_size: usize) -> Status {
        if let Err(status) = sized_place(config, config_size) {
            return status;
        }
        // SAFETY: not NULL, aligned, of the right size; any bit pattern is a configuration.
        let config = unsafe { &mut *config };
        L::by_rule(config);
        (config.uncertain, config.stops_at) = (UNCERTAIN, BRAKING.bits().into());
        Status::OK
    }
}

impl<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Design<L, E, N, NUMBERS> {
    /// Scales the bandwidths of the configuration to another surface bandwidth, rad/s.
    ///
    /// # Safety
    /// A pointer that is not NULL points to memory of the size given.
    pub(crate) unsafe fn tune(config: *mut CConfig<NUMBERS>, config_size: usize, surface_rad_s: f64) -> Status {
        if let Err(status) = sized_place(config, config_size) {
            return status;
        }
        // SAFETY: not NULL, aligned, of the right size; any bit pattern is a configuration.
        L::tune(unsafe { &mut *config }, surface_rad_s);
        Status::OK
    }
}

/// Computes the design of a configuration. `refusal` receives the rejected number.
///
/// # Safety
/// Pointers that are not NULL point to memory of the sizes given, `refusal` to memory of its type.
pub(crate) unsafe fn design<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize>(
    config: *const CConfig<NUMBERS>,
    config_size: usize,
    design: *mut Design<L, E, N, NUMBERS>,
    design_size: usize,
    refusal: *mut CRefusal,
) -> Status {
    let places = || {
        sized_place(config, config_size)?;
        sized_place(design, design_size)?;
        if !refusal.is_null() {
            place(refusal)?;
        }
        let shared = overlap(design, config) || overlap(refusal, design) || overlap(refusal, config);
        if shared { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, of the right size; any bit pattern is a configuration.
    let made = designed::<L, E, N, NUMBERS>(unsafe { &*config }).map(|law| {
        let mut made = Design { version: VERSION, instance: L::WORD, law: MaybeUninit::new(law), check: 0 };
        made.check = made.sum();
        // SAFETY: not NULL, aligned, of the right size.
        unsafe { design.write(made) };
    });
    // SAFETY: NULL, or aligned.
    unsafe { tell(refusal, made) }
}

/// Writes the rejected number, or an empty name, and returns the status.
///
/// # Safety
/// `refusal` is NULL, or aligned and memory of its type.
pub(crate) unsafe fn tell(refusal: *mut CRefusal, made: Result<(), impl Into<CRefusal>>) -> Status {
    let (status, said) = match made {
        Ok(()) => (Status::OK, CRefusal::NONE),
        Err(said) => (Status::OUT_OF_RANGE, said.into()),
    };
    if !refusal.is_null() {
        // SAFETY: guaranteed by the caller.
        unsafe { refusal.write(said) };
    }
    status
}

/// Returns the controller of a configuration, or the rejected number.
pub(crate) fn designed<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize>(
    config: &CConfig<NUMBERS>,
) -> Result<L, CRefusal> {
    let (name, most) = L::LAG_OR_LOAD;
    let every_alarm = f64::from(EVERY_ALARM);
    let ranges = [
        (name, config.lag_or_load, most),
        ("uncertain", config.uncertain, 0.9),
        ("stops_at", config.stops_at, every_alarm),
    ];
    for (field, given, most) in ranges {
        if !(given >= 0.0 && given <= most) {
            return Err(CRefusal::of(field, given, 0.0, most));
        }
    }
    let alarms = Health::from_bits(config.stops_at as u16 & EVERY_ALARM);
    L::of(config, alarms).map_err(CRefusal::from)
}

/// All bits of [`Health`] that this archive reports.
const EVERY_ALARM: u16 = Health::ALL & !Health::HUNTS.bits();

impl From<DriveError> for CRefusal {
    fn from(error: DriveError) -> Self {
        Self::of(error.field, error.given, error.low, error.high)
    }
}

impl CRefusal {
    /// Value for a configuration without a rejected number.
    pub(crate) const NONE: Self = Self { field: [0; 32], given: 0.0, low: 0.0, high: 0.0 };

    pub(crate) fn of(name: &str, given: f64, low: f64, high: f64) -> Self {
        let mut field = [0; 32];
        // At least one zero ends the name.
        for (to, from) in field.iter_mut().take(31).zip(name.bytes()) {
            *to = from;
        }
        Self { field, given, low, high }
    }
}

/// Drive of a motor, with high gain sets (0 or 1) and ticks of delay.
pub(crate) type Motor<const FAST: usize, const LATE: usize> = Design<MotorLaw<FAST, LATE>, 1, 2, MOTOR>;
/// Drive of a joint with one observer per encoder, with high gain sets (0 or 1) and ticks of delay.
pub(crate) type Joint<const FAST: usize, const LATE: usize> = Design<JointLaw<FAST, LATE>, 2, 4, JOINT>;
/// Drive of a coupled joint, with high gain sets (0 or 1) and ticks of delay.
pub(crate) type Coupled<const FAST: usize, const LATE: usize> = Design<CoupledLaw<FAST, LATE>, 2, 4, COUPLED>;
pub(crate) type MotorConfig = CConfig<MOTOR>;
pub(crate) type JointConfig = CConfig<JOINT>;
pub(crate) type CoupledConfig = CConfig<COUPLED>;
