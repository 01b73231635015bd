//! The script of a faulty stand-in: its faults and their times.

use palpate_model::{Nanos, Volts};

/// An end of the converter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rail {
    /// The highest count, or +10 V without a converter.
    High,
    /// The lowest count, or -10 V without a converter.
    Low,
}

/// One way to fail. Those about samples act on samples that arrive while the fault lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// Samples are lost; acknowledgements still arrive.
    Silent,
    /// Everything arrives later by this much, in order.
    Late(Nanos),
    NotANumber,
    /// The signal stays as it was when the fault began.
    Stuck,
    /// The signal is at an end of the converter's range.
    Saturated(Rail),
    /// White noise of this standard deviation is added to the signal.
    Noisy(Volts),
    /// This much is added to the signal, as when something strikes the cell.
    SignalJump(Volts),
    /// The reported position is off by this many pulses.
    LostSteps(i64),
    /// Every command is refused, and has no effect.
    RefuseCommands,
    /// The link ends: [`palpate_model::rig::Fault::LinkLost`], then nothing, and no command gets
    /// through. The rig goes on moving. It never ends.
    Disconnect,
    /// The controller restarts: the axis is halted where it is, samples cease for some
    /// milliseconds, then clock and pulse counter begin at zero with the motor off until it is
    /// enabled again. [`palpate_model::rig::Fault::ControllerReset`] says so at once.
    Reset,
    /// The same restart, visible in the readings only.
    UnannouncedReset,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptedFault {
    pub at: Nanos,
    /// How long it lasts; `None` for good.
    pub lasts: Option<Nanos>,
    pub kind: FaultKind,
}

impl ScriptedFault {
    /// A fault from `at` on, for good.
    #[must_use]
    pub fn from(at: Nanos, kind: FaultKind) -> Self {
        Self { at, lasts: None, kind }
    }

    /// A fault from `at` for as long as `lasts`.
    #[must_use]
    pub fn during(at: Nanos, lasts: Nanos, kind: FaultKind) -> Self {
        Self { at, lasts: Some(lasts), kind }
    }

    /// Whether the fault acts at `now`.
    #[must_use]
    pub fn is_active(&self, now: Nanos) -> bool {
        now >= self.at && self.lasts.is_none_or(|lasts| now < self.at + lasts)
    }
}
