//! Whatever motion is under way: the one path that a slider makes and a host follows.

use super::oscillation::SinePath;
use super::profile::MotionProfile;
use crate::units::{MmPerS, Position, Seconds};

/// Position and velocity as functions of the time since the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// A move from point to point, or the deceleration that cut a motion short.
    Move(MotionProfile),
    /// In and out again.
    Sine(SinePath),
}

impl Course {
    /// The deceleration to rest when it is stopped at `at`.
    pub fn stopped_at(&self, at: Seconds) -> Self {
        Self::Move(match self {
            Self::Move(profile) => profile.stopped_at(at),
            Self::Sine(sine) => sine.stopped_at(at),
        })
    }

    /// Time from start to rest.
    pub fn duration(&self) -> Seconds {
        match self {
            Self::Move(profile) => profile.duration(),
            Self::Sine(sine) => sine.duration(),
        }
    }

    pub fn end(&self) -> Position {
        self.position(self.duration())
    }

    /// Commanded position at a time since the start; before and after, the ends.
    pub fn position(&self, at: Seconds) -> Position {
        match self {
            Self::Move(profile) => profile.position(at),
            Self::Sine(sine) => sine.position(at),
        }
    }

    /// Commanded velocity at a time since the start, signed.
    pub fn velocity(&self, at: Seconds) -> MmPerS {
        match self {
            Self::Move(profile) => profile.velocity(at),
            Self::Sine(sine) => sine.velocity(at),
        }
    }
}
