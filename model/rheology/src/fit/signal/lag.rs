//! Which side of its hysteresis loop a load cell is on.

use palpate_model::calibration::HysteresisLoop;

/// Change of the force over which a load cell goes from one side of its loop to the other, as a share of its range. Assumed:
/// weight steps are far larger than it, so no calibration tells it, and the simulated cell has the same. The uncertainty
/// of the loop's width allows for another.
const TURN_SHARE: f64 = 0.02;

/// The side that a load cell is on while its force changes.
pub(super) struct LaggingCell<'a> {
    hysteresis: Option<&'a HysteresisLoop>,
    /// -1 while the force falls to 1 while it rises.
    side: f64,
    force: f64,
}

impl<'a> LaggingCell<'a> {
    /// A cell without load, where both sides meet.
    pub fn new(hysteresis: Option<&'a HysteresisLoop>) -> Self {
        Self { hysteresis, side: 0.0, force: 0.0 }
    }

    /// Goes on to a force in N; what the cell lags behind it there, over half the distance in the middle of its range.
    pub fn lag(&mut self, force: f64) -> f64 {
        let Some(known) = self.hysteresis else { return 0.0 };
        let turn = TURN_SHARE * (known.range.1 - known.range.0);
        self.side = (self.side + 2.0 * (force - self.force) / turn).clamp(-1.0, 1.0);
        self.force = force;
        self.side * known.share_at(force)
    }

    /// Half that distance in N.
    pub fn half(&self) -> f64 {
        self.hysteresis.map_or(0.0, |known| known.half.0)
    }
}
