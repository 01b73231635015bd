//! From measured times to the largest speed.
//!
//! An interlock judges a sample. Until then the axis has gone on for the time between two samples, the time that the
//! sample took to arrive, and a look of the link's thread; until the stop has its effect it goes on for as long as an
//! answer takes. Then it brakes. With the sum of the times `T`, the acceleration `a` and the speed `v` the way is
//!
//! ```text
//! s = v T + v^2 / (2 a)      so      v = a (sqrt(T^2 + 2 s / a) - T)
//! ```
//!
//! All times are the worst ones that were measured.

use super::Measured;
use crate::sidecar::description::{SidecarAxis, SidecarDescription};
use crate::sidecar::worst_case_mm;
use palpate_model::Nanos;
use palpate_model::units::{MmPerS, MmPerS2};
use serde::Serialize;

/// The thread that owns a link looks so often.
const LOOK: Nanos = Nanos(500_000);

/// The speed that a sidecar may be trusted with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedTrust {
    /// Way that the axis may go beyond an interlock.
    pub overtravel_mm: f64,
    /// From the moment at which a limit is crossed to the moment at which the axis begins to brake.
    pub reaction_s: f64,
    /// Parts of that: time between samples, longest way of a sample, longest answer.
    pub sample_period_s: f64,
    pub sample_delay_s: f64,
    pub answer_s: f64,
    pub acceleration_mm_s2: f64,
    /// Largest speed; at most that of the description, and 0 where a check on safety has failed.
    pub speed_max_mm_s: f64,
    /// Way of the axis at that speed after the link is lost.
    pub lost_link_mm: f64,
}

/// Largest speed at which the axis stands within `overtravel_mm` after a reaction time.
#[must_use]
pub fn speed_for_overtravel(overtravel_mm: f64, reaction_s: f64, acceleration: MmPerS2) -> MmPerS {
    let a = acceleration.0;
    // Written without the difference of two nearly equal numbers.
    let root = (reaction_s * reaction_s + 2.0 * overtravel_mm / a).sqrt();
    MmPerS(2.0 * overtravel_mm / (root + reaction_s))
}

pub(super) fn of(
    about: &SidecarDescription,
    axis: SidecarAxis,
    measured: &Measured,
    overtravel_mm: f64,
) -> SpeedTrust {
    let (period, delay) = (about.period(), measured.late_max + measured.way_min);
    let reaction = period + delay + measured.answer_max + LOOK;
    let acceleration = MmPerS2(axis.acceleration);
    let speed = speed_for_overtravel(overtravel_mm, reaction.seconds().0, acceleration);
    let speed = MmPerS(speed.0.min(axis.speed_max));
    SpeedTrust {
        overtravel_mm,
        reaction_s: reaction.seconds().0,
        sample_period_s: period.seconds().0,
        sample_delay_s: delay.seconds().0,
        answer_s: measured.answer_max.seconds().0,
        acceleration_mm_s2: axis.acceleration,
        speed_max_mm_s: speed.0,
        lost_link_mm: worst_case_mm(speed, acceleration, about.silence()),
    }
}

impl SpeedTrust {
    /// No speed at all where the axis must not move.
    #[must_use]
    pub(super) fn unless(self, is_forbidden: bool) -> Self {
        if !is_forbidden {
            return self;
        }
        Self { speed_max_mm_s: 0.0, lost_link_mm: 0.0, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_goes_exactly_the_overtravel_at_the_largest_speed() {
        for (overtravel, reaction, acceleration) in
            [(0.5, 0.02, 50.0), (0.1, 0.0, 10.0), (2.0, 0.3, 1_000.0), (1e-3, 0.5, 5.0)]
        {
            let v = speed_for_overtravel(overtravel, reaction, MmPerS2(acceleration)).0;
            let way = v * reaction + v * v / (2.0 * acceleration);
            assert!((way / overtravel - 1.0).abs() < 1e-12, "{way} {overtravel}");
        }
    }
}
