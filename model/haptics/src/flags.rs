//! What was special about a tick, as bits.

use serde::{Deserialize, Serialize};
use std::ops::{BitOr, BitOrAssign};

/// A set of facts about one tick; [`Flags::sentences`] has them in words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Flags(u32);

macro_rules! facts {
    ($($name:ident $bit:literal $says:literal;)*) => {
        impl Flags {
            $(#[doc = $says] pub const $name: Self = Self(1 << $bit);)*
            const ALL: &'static [(Self, &'static str)] = &[$((Self::$name, $says)),*];
        }
    };
}

facts! {
    DEPTH_NAN 0 "the depth is not a number; the model uses the last valid depth";
    DEPTH_RANGE 1 "the depth is beyond the end of the stroke; the model uses the end of the stroke";
    JUMP 2 "the depth changes faster than a hand can move; the model follows at the fastest speed allowed";
    PULL 3 "the model would pull the probe, but tissue does not adhere to a probe; the force is zero";
    NO_FORCE 4 "the model gives no finite force for this step; the force is zero";
    FORCE_MAX 5 "the force is held at its limit";
    SLEW 6 "the force changes at its largest allowed rate";
    SOFT_START 7 "the force rises slowly after the start";
    STALL 8 "the control loop has resumed after a gap; the force rises slowly from the value that the device held";
    CONTACT_RAMP 9 "the force rises slowly after contact";
    NO_CONTACT 10 "the load cell detects no contact; the force is zero";
    ABOVE_SURFACE 11 "the probe is above the surface; the force is zero";
    PASSIVITY 12 "the control loop generated energy; damping is added to dissipate it";
    DAMPING_LIMIT 13 "dissipating all generated energy at once needs more damping than the device's mass allows; the rest is dissipated later";
    BUZZ 14 "the control loop of the device oscillates by itself";
    PULSE_RATE 15 "the slave lags behind: the motion needs more pulses than the slave's drive may output";
    COUNT_RATE 16 "the encoder turns too fast for its counter; counts may be lost";
    SATURATED 17 "the drive is at its largest voltage; the torque is less than commanded";
    CONTINUOUS 18 "the torque is above the continuous torque of the motor";
    HOT 19 "the motor winding is hotter than its limit";
    CELL 20 "the load cell gives no valid number; the contact state does not change";
    MARGIN 21 "the device has less damping than stability needs at this depth";
    OFF 22 "the force is switched off";
}

impl Flags {
    /// Nothing special.
    pub const NONE: Self = Self(0);

    /// Whether all of `other` are among these.
    #[must_use]
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether any of `other` is among these.
    #[must_use]
    pub const fn has_any(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// These if `is_so`, else none.
    #[must_use]
    pub const fn when(self, is_so: bool) -> Self {
        if is_so { self } else { Self::NONE }
    }

    /// The bits, as records store them.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Each fact in words.
    pub fn sentences(self) -> impl Iterator<Item = &'static str> {
        let held = Self::ALL.iter().filter(move |(flag, _)| self.has(*flag));
        held.map(|(_, says)| *says)
    }

    /// Those that take force away: an answer to "why do I feel nothing".
    #[must_use]
    pub const fn less_force(self) -> Self {
        let causes = Self::PULL.0
            | Self::NO_FORCE.0
            | Self::SOFT_START.0
            | Self::STALL.0
            | Self::CONTACT_RAMP.0
            | Self::NO_CONTACT.0
            | Self::ABOVE_SURFACE.0
            | Self::SATURATED.0
            | Self::OFF.0;
        Self(self.0 & causes)
    }
}

impl BitOr for Flags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Flags {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fact_has_its_own_bit_and_words() {
        let all = Flags::ALL.iter().fold(Flags::NONE, |all, (flag, _)| all | *flag);
        assert_eq!(all.bits().count_ones() as usize, Flags::ALL.len());
        assert_eq!(all.sentences().count(), Flags::ALL.len());
        let some = Flags::PULL | Flags::SLEW;
        assert!(some.has(Flags::SLEW) && !some.has(Flags::SLEW | Flags::BUZZ));
        assert!(some.has_any(Flags::SLEW | Flags::BUZZ));
        assert_eq!(some.less_force(), Flags::PULL);
    }
}
