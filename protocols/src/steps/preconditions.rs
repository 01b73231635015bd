//! Preconditions of steps, and which of them hold at a step of a plan.

use crate::engine::{NOT_HOMED, NOT_TARED};

/// In the order of the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Need {
    Motor,
    Home,
    /// The load cell is tared.
    Tare,
    Contact,
    Inside,
    Specimen,
    Outside,
}

/// Requirements of every way that counts from the surface.
pub(crate) const FROM_SURFACE: &[Need] = &[Need::Motor, Need::Home, Need::Contact];

impl Need {
    /// Why a rig refuses a step without it; none where that is the author's business only.
    pub fn refusal(self) -> Option<&'static str> {
        match self {
            Self::Home => Some(NOT_HOMED),
            Self::Tare => Some(NOT_TARED),
            Self::Contact => {
                Some("the contact point is not known at this step; put find-contact before it")
            }
            Self::Motor | Self::Inside | Self::Specimen | Self::Outside => None,
        }
    }

    /// The message to the author of a protocol.
    pub fn message(self) -> &'static str {
        match self {
            Self::Motor => {
                "moves the axis, but the motor is not on yet; put { do = \"self-test\" } before it"
            }
            Self::Home => {
                "needs a homed axis; put { do = \"home\" } before it (no motion if the axis is homed already)"
            }
            Self::Tare => {
                "compares forces, but the load cell is not tared yet; put { do = \"tare\" } before it"
            }
            Self::Contact => {
                "measures depth from the surface, but the surface is not known yet; put { do = \"find-contact\" } before it"
            }
            Self::Inside => {
                "keeps the force of the probe on the tissue, but the probe does not press yet; put { do = \"load\", to = \"1 N\", ... } before it"
            }
            Self::Specimen => {
                "would run into the base, because no specimen is mounted; put { do = \"prompt\", message = \"...\", mount = 1 } before it to have a specimen mounted, or use { do = \"find-base\" } to find the base"
            }
            Self::Outside => {
                "needs the probe outside the tissue; put { do = \"retract\" } before it"
            }
        }
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Preconditions {
    pub motor: bool,
    pub home: bool,
    pub tare: bool,
    pub contact: bool,
    pub is_inside: bool,
    /// Whether the specimen was taken out and no other clipped in.
    pub is_bare: bool,
}

impl Preconditions {
    pub fn has(&self, need: Need) -> bool {
        match need {
            Need::Motor => self.motor,
            Need::Home => self.home,
            Need::Tare => self.tare,
            Need::Contact => self.contact,
            Need::Inside => self.is_inside,
            Need::Specimen => !self.is_bare,
            Need::Outside => !self.is_inside,
        }
    }

    /// Sets a precondition: a step has met it, or its absence was reported once.
    pub fn assume(&mut self, need: Need) {
        match need {
            Need::Motor => self.motor = true,
            Need::Home => self.home = true,
            Need::Tare => self.tare = true,
            Need::Contact => self.contact = true,
            Need::Inside => self.is_inside = true,
            Need::Specimen => self.is_bare = false,
            Need::Outside => self.is_inside = false,
        }
    }
}
