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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8"))]
#[repr(transparent)]
pub struct Health(u8);

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

    const NAMES: [(Self, &'static str); 7] = [
        (Self::INPUT_REJECTED, "input rejected"),
        (Self::SATURATED, "saturated"),
        (Self::SIGMA_STAR_OVER_BOUND, "sigma* over bound"),
        (Self::SAMPLE_LOST, "sample lost"),
        (Self::DISTURBANCE_OVER_BOUND, "disturbance over bound"),
        (Self::STUCK_AT_LIMIT, "stuck at limit"),
        (Self::STOPPED, "stopped"),
    ];

    /// `flag` if `condition`, else nothing; without a branch.
    #[inline(always)]
    pub(crate) fn when(self, condition: bool) -> Self {
        Self(self.0 * u8::from(condition))
    }

    /// Both sets together.
    #[inline(always)]
    #[must_use]
    pub(crate) const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
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
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The flags of these bits; `None` if a bit has no meaning.
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits & 128 == 0 { Some(Self(bits)) } else { None }
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

/// A byte that is no [`Health`]: a bit in it has no meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownHealth(u8);

impl core::fmt::Display for UnknownHealth {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "health {} has a bit without a meaning: it is a sum of 1, 2, 4, 8, 16, 32 and 64", self.0)
    }
}

impl core::error::Error for UnknownHealth {}

impl TryFrom<u8> for Health {
    type Error = UnknownHealth;

    fn try_from(bits: u8) -> Result<Self, UnknownHealth> {
        Self::from_bits(bits).ok_or(UnknownHealth(bits))
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
        defmt::write!(f, "Health({=u8:b})", self.0);
    }
}
