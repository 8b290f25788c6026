//! What a tick has to say about itself. The tick always returns; trouble is told here.
//!
//! ```
//! use controller_core::Health;
//! let mut seen = Health::OK;
//! seen |= Health::SATURATED;
//! assert!(!seen.is_ok() && seen.contains(Health::SATURATED));
//! assert_eq!(seen.to_string(), "saturated");
//! ```

/// A set of flags, one per kind of trouble; [`OK`](Self::OK) is the empty set.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u16"))]
#[repr(transparent)]
pub struct Health(u16);

impl Health {
    /// No flag set: no trouble.
    pub const OK: Self = Self(0);
    /// The law asked for what is not finite or beyond [`INPUT_LIMIT`](crate::INPUT_LIMIT), because of the sample or of
    /// what the model made of it: the configured [`Fallback`](crate::Fallback) went out, the estimates wait, and the
    /// next good sample resumes. If it asks for too much twice in a row, the estimates are what is spoilt: they start
    /// anew.
    pub const INPUT_REJECTED: Self = Self(1);
    /// The law asked for more than the limits allow.
    pub const SATURATED: Self = Self(2);
    /// |σ*| is over the configured bound: the plant does not do what the design supposes.
    pub const SIGMA_STAR_OVER_BOUND: Self = Self(4);

    /// A count was not there, or moved as no shaft can: it was not used, the observers predict. Drives only.
    pub const SAMPLE_LOST: Self = Self(8);
    /// The estimate of a disturbance is over the declared bound. Drives only.
    pub const DISTURBANCE_OVER_BOUND: Self = Self(16);
    /// u has been at a limit for too long while the error grew. Drives only.
    pub const STUCK_AT_LIMIT: Self = Self(32);
    /// A monitor has stopped the drive: the fallback goes out until it starts anew. Drives only.
    pub const STOPPED: Self = Self(64);
    /// The counts have settled at another place than those before them foretold: a missed tick, a slip. The position
    /// was taken from them, speed and disturbance stayed. Drives only.
    pub const POSITION_STEPPED: Self = Self(128);

    /// The counts do not agree with each other yet, at a start or where they were not believed for too long: no current
    /// until they do. Drives only.
    pub const WAITS: Self = Self(256);
    /// The shaft speeds up against its current, or the spring of a joint would drive its two shafts apart: an encoder
    /// or the phase order is reversed. It stops a drive whatever is chosen. Drives only.
    pub const WRONG_WAY: Self = Self(512);
    /// The estimate of a disturbance went over its bound in one direction and in the other, again and again: a limit
    /// cycle. It stops a drive whatever is chosen. Drives only.
    pub const OSCILLATES: Self = Self(1024);
    /// After an alarm: the current opposes the speed, and no target is followed until the drive starts anew. Drives
    /// only.
    pub const BRAKES: Self = Self(2048);

    /// It turns faster than its [`Fence`](crate::drive::Fence) allows. Drives only.
    pub const OVERSPEED: Self = Self(4096);
    /// It is further from its target than its [`Fence`](crate::drive::Fence) allows. Drives only.
    pub const FOLLOWING_ERROR: Self = Self(8192);
    /// It is beyond an end of its range, or must brake now to stay within it. Drives only.
    pub const END_OF_RANGE: Self = Self(16_384);

    /// At rest the shaft slips from one side of its target to the other, in friction, or swings around it, in play: a
    /// wider [`RestBand`](crate::drive::RestBand) lets it be, or lower gains hold it. Drives only.
    pub const HUNTS: Self = Self(32_768);

    /// Every bit that has a meaning.
    pub const ALL: u16 = u16::MAX;
    const NAMES: [(Self, &'static str); 16] = [
        (Self::INPUT_REJECTED, "input rejected"),
        (Self::SATURATED, "saturated"),
        (Self::SIGMA_STAR_OVER_BOUND, "sigma* over bound"),
        (Self::SAMPLE_LOST, "sample lost"),
        (Self::DISTURBANCE_OVER_BOUND, "disturbance over bound"),
        (Self::STUCK_AT_LIMIT, "stuck at limit"),
        (Self::STOPPED, "stopped"),
        (Self::POSITION_STEPPED, "position stepped"),
        (Self::WAITS, "waits for counts"),
        (Self::WRONG_WAY, "wrong way"),
        (Self::OSCILLATES, "oscillates"),
        (Self::BRAKES, "brakes"),
        (Self::OVERSPEED, "overspeed"),
        (Self::FOLLOWING_ERROR, "following error"),
        (Self::END_OF_RANGE, "end of range"),
        (Self::HUNTS, "hunts"),
    ];

    /// `flag` if `condition`, else nothing; without a branch.
    #[inline(always)]
    pub(crate) fn when(self, condition: bool) -> Self {
        Self(self.0 * u16::from(condition))
    }

    /// Both sets together.
    #[inline(always)]
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The flags that `other` has not.
    #[inline(always)]
    #[must_use]
    pub(crate) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// No trouble at all?
    #[inline(always)]
    pub const fn is_ok(self) -> bool {
        self.0 == 0
    }

    /// Are all flags of `other` set? [`OK`](Self::OK) has none, so every set contains it: ask [`is_ok`](Self::is_ok).
    #[inline(always)]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Is any flag of `other` set?
    #[inline(always)]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The flags as bits, for logs and frames.
    #[inline]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The flags of these bits, of which each has a meaning.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }
}

/// Both sets together.
impl core::ops::BitOr for Health {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

/// Adds the flags of the other set: what was seen since somebody looked.
impl core::ops::BitOrAssign for Health {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Self) {
        *self = self.union(other);
    }
}

impl From<u16> for Health {
    fn from(bits: u16) -> Self {
        Self::from_bits(bits)
    }
}

impl core::fmt::Display for Health {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.is_ok() {
            return f.write_str("ok");
        }
        let mut separator = "";
        for (flag, name) in Self::NAMES {
            if self.contains(flag) {
                write!(f, "{separator}{name}")?;
                separator = ", ";
            }
        }
        Ok(())
    }
}

impl core::fmt::Debug for Health {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Health({self})")
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Health {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Health({=u16:b})", self.0);
    }
}
