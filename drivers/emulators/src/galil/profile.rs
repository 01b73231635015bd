//! The trapezoid of a stepper axis, one sample after the other.

/// A commanded place that moves, in counts and counts per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisProfile {
    pub place: f64,
    /// Commanded velocity.
    pub velocity: f64,
}

impl AxisProfile {
    /// One sample towards a target, arriving at rest. Returns whether it has arrived.
    ///
    /// The next speed is the largest from which the remaining distance suffices to stop, so that accelerating, slewing and
    /// decelerating follow without a precomputed plan, and speed, rates and target may change during the move. A target
    /// that is too near to stop at is passed at the deceleration given, and approached again.
    pub fn towards(&mut self, target: f64, speed: f64, ac: f64, dc: f64, dt: f64) -> bool {
        let distance = target - self.place;
        let side = if distance < 0.0 { -1.0 } else { 1.0 };
        let (remaining, v) = (distance.abs(), self.velocity * side);
        if v < 0.0 {
            // Under way in the other direction: to rest first.
            self.velocity = side * (v + dc * dt).min(0.0);
            self.place += side * 0.5 * (v + self.velocity * side) * dt;
            return false;
        }
        // (v + w) dt / 2 + w^2 / (2 dc) = remaining, for w.
        let room = remaining - 0.5 * v * dt;
        let half = 0.5 * dc * dt;
        let stoppable =
            if room > 0.0 { (half * half + 2.0 * dc * room).sqrt() - half } else { 0.0 };
        let slowest = v - dc * dt;
        // Within a thousandth of a sample's deceleration, which is rounding, the axis stops at the target.
        if slowest > stoppable + 1e-3 * dc * dt {
            self.place += side * 0.5 * (v + slowest) * dt;
            self.velocity = side * slowest;
            return false;
        }
        let w = (v + ac * dt).min(speed.max(v - dc * dt)).min(stoppable);
        let step = 0.5 * (v + w) * dt;
        // Less than this is rounding: places stay below 2^31 counts.
        if step >= remaining - 1e-6 || remaining < 1e-6 {
            *self = Self { place: target, velocity: 0.0 };
            return true;
        }
        self.place += side * step;
        self.velocity = side * w;
        false
    }

    /// One sample at a speed with a sign, reached at the rates given.
    pub fn jog(&mut self, speed: f64, ac: f64, dc: f64, dt: f64) {
        let v = self.velocity;
        let is_faster = speed * v >= 0.0 && speed.abs() > v.abs();
        let change = dt * if is_faster { ac } else { dc };
        self.velocity = v + (speed - v).clamp(-change, change);
        self.place += 0.5 * (v + self.velocity) * dt;
    }

    /// The whole count at which the axis can be at rest soonest.
    pub fn rest(&self, dc: f64) -> f64 {
        let end = self.place + self.velocity * self.velocity.abs() / (2.0 * dc);
        // A place within rounding of a count is that count.
        if (end - end.round()).abs() < 1e-6 {
            end.round()
        } else if self.velocity < 0.0 {
            end.floor()
        } else {
            end.ceil()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::rig;
    use palpate_model::{MmPerS, MmPerS2, Position, Seconds};

    const DT: f64 = 1.0 / 1024.0;

    /// The closed form, with 1 count for 1 mm.
    fn closed(to: f64, speed: f64, rate: f64) -> rig::MotionProfile {
        rig::MotionProfile::to_rest(Position(0.0), Position(to), MmPerS(speed), MmPerS2(rate))
    }

    #[test]
    fn it_follows_the_closed_form() {
        for (to, speed, rate) in [
            (2000.0, 50.0, 4096.0),
            (-6000.0, 1332.0, 4096.0),
            (30.0, 1332.0, 4096.0),
            (1.0, 50.0, 4096.0),
            (100_000.0, 25_000.0, 256_000.0),
        ] {
            let oracle = closed(to, speed, rate);
            let mut profile = AxisProfile::default();
            let mut samples = 0;
            loop {
                let is_there = profile.towards(to, speed, rate, rate, DT);
                samples += 1;
                let exact = oracle.position(Seconds(f64::from(samples) * DT)).0;
                // A corner of the trapezoid that falls within a sample costs at most that sample's change of
                // speed over the rest of the move, which is below rate dt^2.
                let bound = rate * DT * DT + 1e-6;
                assert!(
                    (profile.place - exact).abs() <= bound,
                    "{to}: {} not {exact}",
                    profile.place
                );
                if is_there {
                    break;
                }
            }
            assert_eq!(profile.place, to);
            let duration = oracle.duration().0;
            assert!((f64::from(samples) * DT - duration).abs() < 4.0 * DT);
        }
    }

    #[test]
    fn a_stop_ends_on_a_whole_count_at_most_one_further() {
        let mut profile = AxisProfile::default();
        for _ in 0..777 {
            profile.jog(-1332.0, 4096.0, 4096.0, DT);
        }
        assert_eq!(profile.velocity, -1332.0);
        let end = profile.place - 1332.0 * 1332.0 / 8192.0;
        let rest = profile.rest(4096.0);
        assert_eq!(rest, rest.trunc());
        assert!((end - rest) < 1.0 && end >= rest);
        for _ in 0..2000 {
            profile.towards(rest, 1332.0, 4096.0, 4096.0, DT);
        }
        assert_eq!((profile.place, profile.velocity), (rest, 0.0));
    }
}
