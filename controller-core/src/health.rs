//! Status flags of a tick. The tick always returns and reports errors as bits in [`Health`].
//!
//! ```
//! use controller_core::Health;
//! let mut seen = Health::OK;
//! seen |= Health::SATURATED;
//! assert!(!seen.is_ok() && seen.contains(Health::SATURATED));
//! assert_eq!(seen.to_string(), "saturated");
//! ```

/// Set of status flags, one per kind of fault. [`OK`](Self::OK) is the empty set.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u16"))]
#[repr(transparent)]
pub struct Health(u16);

impl Health {
    /// No flag is set: no fault.
    pub const OK: Self = Self(0);
    /// The input was rejected: the demanded u was not finite or beyond [`INPUT_LIMIT`](crate::INPUT_LIMIT). The sample,
    /// or the model's result for it, is the cause. A stopped drive reports it too: it uses no input.
    ///
    /// The tick returned the configured [`Fallback`](crate::Fallback). The estimates are kept, and the next valid
    /// sample resumes. If the demand is too large twice in a row, the estimates are the cause, and they restart.
    pub const INPUT_REJECTED: Self = Self(1);
    /// The demanded u exceeds the limits.
    pub const SATURATED: Self = Self(2);
    /// |σ*| exceeds the configured bound: the plant does not behave as the design assumes.
    pub const SIGMA_STAR_OVER_BOUND: Self = Self(4);

    /// A count was missing or physically impossible. The count was not used, and the observers predict. Drives only.
    pub const SAMPLE_LOST: Self = Self(8);
    /// The estimate of a disturbance exceeds the declared bound. Drives only.
    pub const DISTURBANCE_OVER_BOUND: Self = Self(16);
    /// The output u has been at a limit for too long, in ticks in which |σ| did not fall. Drives only.
    pub const STUCK_AT_LIMIT: Self = Self(32);
    /// A monitor has stopped the drive: the output is 0, or the number of the fallback, until it restarts. Drives only.
    pub const STOPPED: Self = Self(64);
    /// The counts have settled at another position than predicted: a missed tick, a slip. The position was taken from
    /// the counts. The estimates of speed and disturbance were kept. Drives only.
    pub const POSITION_STEPPED: Self = Self(128);

    /// The counts are not consistent yet, at a start or after a long rejection. The current is zero until they are
    /// consistent. Drives only.
    pub const WAITS: Self = Self(256);
    /// The shaft accelerates against its current, or the spring of a joint would drive its two shafts apart. The cause
    /// is a reversed encoder or phase order, or the rebound from a hard end stop. It stops a drive under every reaction
    /// setting. Drives only.
    pub const WRONG_WAY: Self = Self(512);
    /// The estimate of a disturbance exceeded its bound in both directions repeatedly: a limit cycle. It stops a drive
    /// under every reaction setting. Drives only.
    pub const OSCILLATES: Self = Self(1024);
    /// The drive brakes after an alarm: the current opposes the speed. No target is followed until the drive restarts.
    /// Drives only.
    pub const BRAKES: Self = Self(2048);

    /// The speed exceeds the limit of the [`Fence`](crate::drive::Fence). Drives only.
    pub const OVERSPEED: Self = Self(4096);
    /// The position error exceeds the limit of the [`Fence`](crate::drive::Fence). Drives only.
    pub const FOLLOWING_ERROR: Self = Self(8192);
    /// The shaft is beyond an end of its range, or must brake now to stay within the range. Drives only.
    pub const END_OF_RANGE: Self = Self(16_384);

    /// The shaft hunts at rest. With friction it slips from one side of its target to the other. With backlash it
    /// swings around its target. A wider [`RestBand`](crate::drive::RestBand) permits this motion, and lower gains
    /// prevent it. Drives only.
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

    /// Returns the flags if `condition` is true, else the empty set. There is no branch.
    #[inline(always)]
    pub(crate) fn when(self, condition: bool) -> Self {
        Self(self.0 * u16::from(condition))
    }

    /// Returns the union of both sets.
    #[inline(always)]
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns the flags that are not in `other`.
    #[inline(always)]
    #[must_use]
    pub(crate) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Returns true if no flag is set.
    #[inline(always)]
    pub const fn is_ok(self) -> bool {
        self.0 == 0
    }

    /// Returns true if all flags of `other` are set. Every set contains the empty set [`OK`](Self::OK), so use
    /// [`is_ok`](Self::is_ok) to check for it.
    #[inline(always)]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns true if any flag of `other` is set.
    #[inline(always)]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Returns the flags as bits, for logs and frames.
    #[inline]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Returns the flags with these bits. Every bit has a meaning.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }
}

/// Union of both sets.
impl core::ops::BitOr for Health {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

/// Adds the flags of the other set, to collect the flags of many ticks.
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
