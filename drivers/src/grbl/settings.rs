//! How a Grbl board and its slide are wired, as the rig file says.

use palpate_model::units::{MmPerS, MmPerS2, Position};

/// Where the home switch is wired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomeSwitch {
    /// On the limit pin of the axis, with the far limit or alone. Hard limits must be off, or it would lock the board.
    Limit,
    /// On the probe pin, the limit switches on the limit pin with hard limits on.
    Probe,
}

/// Everything about the board that only its owner can know.
#[derive(Clone, Debug, PartialEq)]
pub struct GrblSettings {
    pub name: String,
    /// `X`, `Y` or `Z`.
    pub axis: char,
    pub mm_per_pulse: f64,
    /// Positive machine coordinates lead away from the tissue.
    pub is_reversed: bool,
    /// End of the travel; home is 0.
    pub travel: Position,
    pub speed_max: MmPerS,
    pub acceleration: MmPerS2,
    /// Longest way of the probe without a sample.
    pub unseen: Position,
    /// Its home switch.
    pub home: HomeSwitch,
    /// A closed limit pin is home when the rig is opened: nothing else can have closed it.
    pub is_closed_home: bool,
    /// The text of `$I=`, which identifies a board.
    pub build_info: Option<String>,
    /// Unlock a board that is locked when it is opened (`$X`).
    pub is_unlocking: bool,
}

impl GrblSettings {
    /// 1, or -1 where positive coordinates lead away from the tissue.
    pub const fn sign(&self) -> i64 {
        if self.is_reversed { -1 } else { 1 }
    }

    /// 0 for `X`, 1 for `Y`, 2 for `Z`.
    pub fn index(&self) -> usize {
        "XYZ".find(self.axis).unwrap_or(0)
    }
}

/// Values read from the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardParameters {
    /// `$100` to `$102`.
    pub steps_per_mm: f64,
    /// Where the axis rests, in steps of the board.
    pub steps: i64,
    /// Shortest time from a line to its `ok`, in ns.
    pub round_trip: palpate_model::Nanos,
}
