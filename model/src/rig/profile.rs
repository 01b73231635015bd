//! Trapezoidal motion: the path a controller commands, as a function of time.

use crate::units::{MmPerS, MmPerS2, Position, Seconds};
use serde::{Deserialize, Serialize};

/// A point-to-point move with symmetric acceleration, or the deceleration that cuts it short.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionProfile {
    from: f64,
    sign: f64,
    /// Speed at time zero, along `sign`.
    speed_start: f64,
    accel: f64,
    /// Duration of acceleration, cruise and deceleration.
    accel_secs: f64,
    cruise_secs: f64,
    decel_secs: f64,
    cruise_speed: f64,
}

impl MotionProfile {
    /// A move from rest to rest.
    ///
    /// A move too short to reach `speed` peaks below it.
    #[must_use]
    pub fn to_rest(from: Position, to: Position, speed: MmPerS, acceleration: MmPerS2) -> Self {
        let distance = to.distance_from(from);
        let length = distance.abs();
        let accel = acceleration.0;
        let cruise_speed = speed.0.min((length * accel).sqrt());
        let ramp_secs = cruise_speed / accel;
        let cruise_secs = if cruise_speed > 0.0 {
            ((length - cruise_speed * ramp_secs) / cruise_speed).max(0.0)
        } else {
            0.0
        };
        Self {
            from: from.0,
            sign: if distance < 0.0 { -1.0 } else { 1.0 },
            speed_start: 0.0,
            accel,
            accel_secs: ramp_secs,
            cruise_secs,
            decel_secs: ramp_secs,
            cruise_speed,
        }
    }

    /// The deceleration to rest of this move when it is stopped at `at`.
    pub fn stopped_at(&self, at: Seconds) -> Self {
        Self::braking(self.position(at), self.velocity(at), MmPerS2(self.accel))
    }

    /// The deceleration to rest of an axis that moves through `from` with a signed velocity.
    #[must_use]
    pub fn braking(from: Position, velocity: MmPerS, acceleration: MmPerS2) -> Self {
        let speed = velocity.0.abs();
        Self {
            from: from.0,
            sign: if velocity.0 < 0.0 { -1.0 } else { 1.0 },
            speed_start: speed,
            accel: acceleration.0,
            accel_secs: 0.0,
            cruise_secs: 0.0,
            decel_secs: speed / acceleration.0,
            cruise_speed: speed,
        }
    }

    /// Time from start to rest.
    pub fn duration(&self) -> Seconds {
        Seconds(self.accel_secs + self.cruise_secs + self.decel_secs)
    }

    pub fn end(&self) -> Position {
        self.position(self.duration())
    }

    /// Commanded position at a time since the start; before and after, the ends.
    pub fn position(&self, at: Seconds) -> Position {
        let t = at.0.clamp(0.0, self.duration().0);
        let accel_distance = |s: f64| self.speed_start * s + 0.5 * self.accel * s * s;
        let along = if t < self.accel_secs {
            accel_distance(t)
        } else if t < self.accel_secs + self.cruise_secs {
            accel_distance(self.accel_secs) + self.cruise_speed * (t - self.accel_secs)
        } else {
            let s = t - self.accel_secs - self.cruise_secs;
            accel_distance(self.accel_secs)
                + self.cruise_speed * self.cruise_secs
                + (self.cruise_speed - 0.5 * self.accel * s) * s
        };
        Position(self.from + self.sign * along)
    }

    /// Commanded velocity at a time since the start, signed.
    pub fn velocity(&self, at: Seconds) -> MmPerS {
        let t = at.0;
        let speed = if t < 0.0 || t >= self.duration().0 {
            0.0
        } else if t < self.accel_secs {
            self.speed_start + self.accel * t
        } else if t < self.accel_secs + self.cruise_secs {
            self.cruise_speed
        } else {
            self.cruise_speed - self.accel * (t - self.accel_secs - self.cruise_secs)
        };
        MmPerS(self.sign * speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thesis_ramp() -> MotionProfile {
        MotionProfile::to_rest(Position(41.0), Position(71.0), MmPerS(0.75), MmPerS2(15.36))
    }

    #[test]
    fn ends_exactly_where_it_was_sent() {
        let ramp = thesis_ramp();
        assert!((ramp.end().0 - 71.0).abs() < 1e-12);
        // Trapezoid: distance / speed + speed / acceleration.
        assert!((ramp.duration().0 - (40.0 + 0.75 / 15.36)).abs() < 1e-12);
    }

    #[test]
    fn velocity_is_the_derivative_of_position() {
        let ramp = thesis_ramp();
        for i in 1..4000 {
            let (t, h) = (f64::from(i) * 0.01, 1e-6);
            let slope =
                (ramp.position(Seconds(t + h)).0 - ramp.position(Seconds(t - h)).0) / (2.0 * h);
            // Central difference of a piecewise quadratic: exact but at the corners, where it
            // is off by at most accel * h, plus cancellation of 71 mm at 1e-16 over 2e-6 s.
            assert!((slope - ramp.velocity(Seconds(t)).0).abs() < 1e-4, "t = {t}");
        }
    }

    #[test]
    fn a_short_move_is_a_triangle() {
        let short =
            MotionProfile::to_rest(Position(0.0), Position(-0.01), MmPerS(5.0), MmPerS2(15.36));
        assert!((short.end().0 + 0.01).abs() < 1e-15);
        let peak = short.velocity(Seconds(0.5 * short.duration().0)).0;
        assert!((peak + (0.01f64 * 15.36).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_stop_is_continuous_and_short() {
        let ramp = thesis_ramp();
        let stop = ramp.stopped_at(Seconds(20.0));
        assert_eq!(stop.position(Seconds(0.0)), ramp.position(Seconds(20.0)));
        // v^2 / 2a
        let braking = stop.end().distance_from(ramp.position(Seconds(20.0)));
        assert!((braking - 0.75 * 0.75 / (2.0 * 15.36)).abs() < 1e-12);
    }
}
