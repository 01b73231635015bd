//! Sinusoidal motion: a slider that goes in and out by itself, with a frequency known to the tick.

use super::command::Oscillation;
use super::profile::MotionProfile;
use crate::units::{MmPerS, MmPerS2, Position, Seconds};
use std::f64::consts::TAU;

/// Whole cycles of `x(t) = from + a (1 - cos(2 pi t / T))`, from rest to rest at the same place.
///
/// It starts at a turning point because there the speed is zero: started at the mean, an axis would need its
/// top speed at once. What jumps at both ends is the acceleration, as it does in a trapezoidal move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinePath {
    from: f64,
    /// Half the way between the turning points, in mm; its sign is the first direction.
    amplitude: f64,
    period_secs: f64,
    duration_secs: f64,
    /// Deceleration of a stop, in mm/s^2.
    accel: f64,
}

impl SinePath {
    /// The path of a command given to an axis that rests at `from`.
    #[must_use]
    pub fn new(from: Position, command: &Oscillation, mm_per_pulse: f64, tick: Seconds) -> Self {
        let period_secs = f64::from(command.period_ticks) * tick.0;
        Self {
            from: from.0,
            amplitude: command.amplitude_pulses as f64 * mm_per_pulse,
            period_secs,
            duration_secs: f64::from(command.cycles) * period_secs,
            accel: command.acceleration.0,
        }
    }

    /// Highest speed on the way: `2 pi |a| / T`.
    pub fn speed_max(&self) -> MmPerS {
        MmPerS(TAU * self.amplitude.abs() / self.period_secs)
    }

    /// Highest acceleration on the way, at the turning points: `4 pi^2 |a| / T^2`.
    pub fn acceleration_max(&self) -> MmPerS2 {
        MmPerS2((TAU / self.period_secs).powi(2) * self.amplitude.abs())
    }

    /// Whether an axis with these limits can follow, and if not, why and what to do.
    pub fn check(&self, speed_max: MmPerS, acceleration: MmPerS2) -> Result<(), String> {
        // Speed and acceleration of a zero period are not numbers.
        if !(self.amplitude != 0.0 && self.duration_secs > 0.0) {
            return Err(
                "a sine needs an amplitude, a period and at least one cycle; none may be zero"
                    .into(),
            );
        }
        let what = format!(
            "a sine of {:.3} mm amplitude at {:.4} Hz",
            self.amplitude.abs(),
            1.0 / self.period_secs
        );
        let advice = "choose a smaller amplitude or a longer period";
        let (speed, accel) = (self.speed_max(), self.acceleration_max());
        // 1e-9 forgives the rounding of limits that are meant to be met exactly.
        if speed.0 > speed_max.0 * (1.0 + 1e-9) {
            return Err(format!(
                "{what} needs a speed of {speed:.2}, but the axis allows {speed_max:.2}; {advice}"
            ));
        }
        if accel.0 > acceleration.0 * (1.0 + 1e-9) {
            return Err(format!(
                "{what} needs an acceleration of {accel:.2}, but the axis allows {acceleration:.2}; {advice}"
            ));
        }
        Ok(())
    }

    /// The deceleration to rest when it is stopped at `at`.
    pub fn stopped_at(&self, at: Seconds) -> MotionProfile {
        MotionProfile::braking(self.position(at), self.velocity(at), MmPerS2(self.accel))
    }

    /// Time from start to rest.
    pub fn duration(&self) -> Seconds {
        Seconds(self.duration_secs)
    }

    /// Commanded position at a time since the start; before and after, where it starts and ends.
    pub fn position(&self, at: Seconds) -> Position {
        if at.0 <= 0.0 || at.0 >= self.duration_secs {
            return Position(self.from);
        }
        // 2 sin^2(x/2) is 1 - cos(x) without its cancellation.
        let half = (0.5 * self.angle(at)).sin();
        Position(self.from + 2.0 * self.amplitude * half * half)
    }

    /// Commanded velocity at a time since the start, signed.
    pub fn velocity(&self, at: Seconds) -> MmPerS {
        if at.0 <= 0.0 || at.0 >= self.duration_secs {
            return MmPerS(0.0);
        }
        MmPerS(TAU / self.period_secs * self.amplitude * self.angle(at).sin())
    }

    /// Angle within the present cycle, so that a long oscillation is as exact as a short one.
    fn angle(&self, at: Seconds) -> f64 {
        TAU * (at.0 / self.period_secs).fract()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.75 mm in 2000 ticks of a millisecond.
    fn sine(cycles: u32) -> SinePath {
        let command = Oscillation {
            amplitude_pulses: 50,
            period_ticks: 2000,
            cycles,
            acceleration: MmPerS2(61.44),
        };
        SinePath::new(Position(45.0), &command, 0.015, Seconds(1e-3))
    }

    #[test]
    fn turns_where_it_should_and_ends_where_it_began() {
        let path = sine(1000);
        for (t, x) in [(0.0, 45.0), (0.5, 45.75), (1.0, 46.5), (1.5, 45.75)] {
            for cycle in [0.0, 1.0, 998.0] {
                let at = Seconds(t + 2.0 * cycle);
                assert!((path.position(at).0 - x).abs() < 1e-11, "{at}");
            }
        }
        assert_eq!(path.duration(), Seconds(2000.0));
        assert_eq!(path.position(path.duration()), Position(45.0));
        assert_eq!(path.velocity(path.duration()), MmPerS(0.0));
    }

    #[test]
    fn velocity_is_the_derivative_and_its_peak_is_the_limit_that_is_checked() {
        let (path, h) = (sine(2), 1e-5);
        let (mut fastest, mut hardest): (f64, f64) = (0.0, 0.0);
        for i in 1..3999 {
            let t = f64::from(i) * 1e-3;
            let (before, after) = (Seconds(t - h), Seconds(t + h));
            let slope = (path.position(after).0 - path.position(before).0) / (2.0 * h);
            let velocity = path.velocity(Seconds(t)).0;
            // Third derivative a w^3 = 23 mm/s^3 times h^2 / 6, and rounding of 46 mm over 2e-5 s.
            assert!((slope - velocity).abs() < 2e-9, "{t}");
            fastest = fastest.max(velocity.abs());
            let bend = (path.velocity(after).0 - path.velocity(before).0) / (2.0 * h);
            hardest = hardest.max(bend.abs());
        }
        // Sampled a millisecond apart, a peak is missed by a millionth at most.
        assert!((fastest / path.speed_max().0 - 1.0).abs() < 2e-6);
        assert!((hardest / path.acceleration_max().0 - 1.0).abs() < 2e-6);
    }

    #[test]
    fn refusals_name_the_limit() {
        let path = sine(1);
        let (speed, accel) = (path.speed_max().0, path.acceleration_max().0);
        assert_eq!(path.check(MmPerS(speed), MmPerS2(accel)), Ok(()));
        let err = path.check(MmPerS(0.99 * speed), MmPerS2(accel));
        let err = err.unwrap_err();
        for fact in ["0.750 mm", "0.5000 Hz", "2.36 mm/s", "2.33 mm/s"] {
            assert!(err.contains(fact), "{fact}: {err}");
        }
        let err = path.check(MmPerS(speed), MmPerS2(0.9 * accel)).unwrap_err();
        assert!(err.contains("7.40 mm/s2") && err.contains("6.66 mm/s2"), "{err}");
        for (amplitude, period, cycles) in [(0, 2000, 1), (50, 0, 1), (50, 2000, 0), (0, 0, 0)] {
            let command = Oscillation {
                amplitude_pulses: amplitude,
                period_ticks: period,
                cycles,
                acceleration: MmPerS2(61.44),
            };
            let path = SinePath::new(Position(45.0), &command, 0.015, Seconds(1e-3));
            let err = path.check(MmPerS(20.0), MmPerS2(61.44)).unwrap_err();
            assert!(err.contains("zero"), "{err}");
        }
    }

    #[test]
    fn a_stop_goes_on_with_the_speed_of_the_moment() {
        let path = sine(3);
        for t in [0.1, 0.5, 1.3, 4.9] {
            let stop = path.stopped_at(Seconds(t));
            assert_eq!(stop.position(Seconds(0.0)), path.position(Seconds(t)));
            let speed = path.velocity(Seconds(t)).0;
            let way = stop.end().distance_from(path.position(Seconds(t)));
            assert!((way - speed * speed.abs() / (2.0 * 61.44)).abs() < 1e-12);
        }
    }
}
