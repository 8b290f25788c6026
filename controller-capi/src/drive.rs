//! A motor with one encoder, a flexible joint with two, as C holds their designs.
//!
//! What a drive is designed from is a struct of doubles in C, in the order of
//! [`LAYOUT`](controller_core::drive::LAYOUT), three more behind it. A design is opaque: words of a law with its
//! monitors, made where it runs, with a check over all of them.
//!
//! A joint as a whole has no rule here: the search for its gains takes a host (`scenario::drive::joint_rule`). It is
//! designed from a configuration that `host-sim export --lang c` writes.

use core::mem::MaybeUninit;

use controller_core::drive::{
    BRAKING, CoupledDrive, DriveError, DriveEstimates, DriveLaw, Fence, JointBandwidths, JointDesign, JointDrive,
    Monitored, MotorDesign, MotorDrive, Position, Sample, Slowing, Target,
};
use controller_core::{Health, Output};

use crate::VERSION;
use crate::instance::Instance;
use crate::status::{Status, overlap, place, sized_place};

/// A configuration: `edo_smc_config_motor_t`, `edo_smc_config_joint_t`, `edo_smc_config_coupled_t`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CConfig<const NUMBERS: usize> {
    numbers: [f64; NUMBERS],
    /// Lag of the current loop of a motor, s; largest sudden load on a joint's link, N m.
    lag_or_load: f64,
    /// Share to which the data sheet is known.
    uncertain: f64,
    /// Bits of the alarms that stop the drive.
    stops_at: f64,
}

/// A refused number: `edo_smc_refusal_t`.
#[repr(C)]
pub struct CRefusal {
    /// Its name in the configuration, with zeros behind it.
    field: [u8; 32],
    given: f64,
    low: f64,
    high: f64,
}

/// A law of the archive, with its monitors.
pub trait Form<const E: usize, const N: usize, const NUMBERS: usize>:
    DriveLaw<E, N, Sample = Sample<i32, Target<f32, i32, N>, E>> + Sized
{
    const WORD: u32;
    /// Where its words begin that are one byte; the first must be 0 or 1.
    const PARTS: [(usize, u32); 2];
    /// Where in a state the bytes lie that must be 0 or 1.
    const FLAGS: &'static [usize];
    /// Name of `lag_or_load`, and the most it may be.
    const LAG_OR_LOAD: (&'static str, f64);

    /// Bandwidths in the same proportions for another surface, and the gates for them.
    fn tune(config: &mut CConfig<NUMBERS>, surface_rad_s: f64);
    /// What this configuration makes, with the monitors that belong to it.
    fn of(config: &CConfig<NUMBERS>, stops_at: Health) -> Result<Self, DriveError>;
    /// How it slows down, for its limits.
    fn slowing(config: &CConfig<NUMBERS>) -> Slowing;
    /// [`Fence::guard`], with the target of the tick's beginning.
    fn guard(&self, fence: &Fence, state: &mut Self::State, output: &mut Output<f32>, begin: &Target<f32, i32, N>);
}

/// A law whose gains follow from its data sheet without a search.
pub trait Ruled<const E: usize, const N: usize, const NUMBERS: usize>: Form<E, N, NUMBERS> {
    /// All that is not on the data sheet.
    fn by_rule(config: &mut CConfig<NUMBERS>);
}

/// Share to which a data sheet is known, where nobody says another.
const UNCERTAIN: f64 = 0.2;

/// What tells a drive from a chain, and a joint as a whole from both.
const DRIVE: u8 = 1;
const AS_A_WHOLE: u8 = 2;

/// Encoders, gain sets beside the quiet one, ticks of delay, which kind.
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

/// A design: `edo_smc_design_*_t`.
#[repr(C)]
pub struct Design<L, const E: usize, const N: usize, const NUMBERS: usize> {
    version: u32,
    instance: u32,
    law: MaybeUninit<L>,
    check: u32,
}

impl<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Design<L, E, N, NUMBERS> {
    /// Words of a law; every one is written, or a byte of it that the law names.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<L>() == 4 && size_of::<Self>() == 12 + size_of::<L>());
        assert!(L::PARTS[0].0.is_multiple_of(4) && L::PARTS[1].0.is_multiple_of(4));
        size_of::<L>() / 4
    };

    /// FNV-1a, a word at a time: another word anywhere gives another sum.
    fn sum(&self) -> u32 {
        let law = self.law.as_ptr().cast::<u32>();
        let word = |i: usize| {
            let [(flag, _), (alarms, _)] = L::PARTS;
            // SAFETY: within the law, aligned as it is; padding is only behind byte and half that are read alone.
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
        // SAFETY: as the caller promises; any bit pattern is a law whose flag is 0 or 1.
        unsafe { self.law.assume_init_ref() }
    }

    #[inline(always)]
    unsafe fn read(sample: *const CSample<E, N>) -> L::Sample {
        // SAFETY: as the caller promises.
        let CSample { counts, lost, begin, end } = unsafe { sample.read() };
        let counts = core::array::from_fn(|i| (lost >> i & 1 == 0).then_some(counts[i]));
        Sample { counts, begin: begin.target(), end: end.target() }
    }

    #[inline(always)]
    unsafe fn start(&self, sample: &L::Sample) -> Option<L::State> {
        // SAFETY: as the caller promises.
        unsafe { self.law() }.start(sample)
    }

    fn c_estimates(known: DriveEstimates<f32, i32, E>) -> CKnown<E> {
        let DriveEstimates { turn, position, speed, disturbance, load } = known;
        CKnown { turn, position, speed, disturbance, load }
    }
}

/// Where the shaft should be: `edo_smc_target_*_t`.
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

/// What a tick is given: `edo_smc_sample_*_t`.
#[repr(C)]
pub struct CSample<const E: usize, const N: usize> {
    counts: [i32; E],
    /// Bit i for the count of encoder i.
    lost: u32,
    pub(crate) begin: CTarget<N>,
    end: CTarget<N>,
}

/// What a drive knows: `edo_smc_estimates_*_t`.
#[repr(C)]
pub struct CKnown<const E: usize> {
    turn: i32,
    position: [f32; E],
    speed: [f32; E],
    disturbance: [f32; E],
    load: [f32; E],
}

impl<L: Ruled<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize> Design<L, E, N, NUMBERS> {
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

/// Writes which number was refused, or that none was.
///
/// # Safety
/// The place is NULL, or aligned and memory of its type.
pub(crate) unsafe fn tell(refusal: *mut CRefusal, made: Result<(), impl Into<CRefusal>>) -> Status {
    let (status, said) = match made {
        Ok(()) => (Status::OK, CRefusal::NONE),
        Err(said) => (Status::OUT_OF_RANGE, said.into()),
    };
    if !refusal.is_null() {
        // SAFETY: as the caller promises.
        unsafe { refusal.write(said) };
    }
    status
}

/// The law of a configuration, or the number that is refused.
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

/// Every bit of [`Health`] that this archive tells.
const EVERY_ALARM: u16 = Health::ALL & !Health::HUNTS.bits();

impl From<DriveError> for CRefusal {
    fn from(error: DriveError) -> Self {
        Self::of(error.field, error.given, error.low, error.high)
    }
}

impl CRefusal {
    /// Nothing was refused.
    pub(crate) const NONE: Self = Self { field: [0; 32], given: 0.0, low: 0.0, high: 0.0 };

    pub(crate) fn of(name: &str, given: f64, low: f64, high: f64) -> Self {
        let mut field = [0; 32];
        // One zero at least stays behind it.
        for (to, from) in field.iter_mut().take(31).zip(name.bytes()) {
            *to = from;
        }
        Self { field, given, low, high }
    }
}

/// The laws of the archive by encoders; gain sets beside the quiet one, ticks of delay.
pub(crate) type Motor<const FAST: usize, const LATE: usize> = Design<MotorLaw<FAST, LATE>, 1, 2, MOTOR>;
pub(crate) type Joint<const FAST: usize, const LATE: usize> = Design<JointLaw<FAST, LATE>, 2, 4, JOINT>;
pub(crate) type Coupled<const FAST: usize, const LATE: usize> = Design<CoupledLaw<FAST, LATE>, 2, 4, COUPLED>;
pub(crate) type MotorConfig = CConfig<MOTOR>;
pub(crate) type JointConfig = CConfig<JOINT>;
pub(crate) type CoupledConfig = CConfig<COUPLED>;
