//! Keeps a board at the host's pace. Grbl makes its steps by a clock of its own; that of an Arduino with a resonator is
//! off by half a percent, in a ramp of 80 s by 0.4 s: more than the jogs that are sent ahead last. So feeds are sent
//! that much higher or lower, according to the way in status reports.

use palpate_model::Nanos;

/// Answers that took longer say too little of when they were true.
const LATE_MAX: Nanos = Nanos::from_millis(40);
/// A report is true to so much of a second, by link and segments.
const GRAIN: f64 = 0.005;
/// Share of what a motion is ahead by that is made good in a second. Jogs are sent up to 0.4 s ahead: two seconds are
/// slow enough not to overshoot.
const GAIN: f64 = 0.5;
/// Share of a second's lead that is attributed to the clock: an eighth of the gain's square is smooth.
const DRIFT_GAIN: f64 = GAIN * GAIN / 8.0;
/// Resonators are right to half a percent (Murata Ceralock, CSTCE series); what seems more is something else.
const DRIFT_MAX: f64 = 0.01;
const CHANGE_MAX: f64 = 0.02;
/// Reports that are further apart come from a pause of the computer.
const APART_MAX: f64 = 0.5;

/// Rate and lead of the board's clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct FeedCorrection {
    drift: f64,
    /// Lead of the motion under way over its profile, in s.
    ahead: f64,
    last_report: Option<Nanos>,
}

impl FeedCorrection {
    pub fn begin(&mut self) {
        (self.ahead, self.last_report) = (0.0, None);
    }

    /// A report, asked for and answered at these times: the axis is ahead of its profile by so many s, as far as steps
    /// of so many s can show.
    pub fn update(&mut self, queried_at: Nanos, now: Nanos, ahead: f64, step: f64) {
        if now.since(queried_at) > LATE_MAX {
            return;
        }
        let passed = self
            .last_report
            .replace(queried_at)
            .map_or(0.0, |last| (queried_at.since(last).0 as f64 * 1e-9).min(APART_MAX));
        // The coarser the steps, the less the report counts: by the share of the variance that is not theirs.
        let trust = GRAIN * GRAIN / (GRAIN * GRAIN + step * step / 12.0);
        self.ahead = trust * ahead;
        let drift = self.drift + DRIFT_GAIN * self.ahead * passed;
        self.drift = drift.clamp(-DRIFT_MAX, DRIFT_MAX);
    }

    pub fn feed(&self) -> f64 {
        1.0 - (self.drift + GAIN * self.ahead).clamp(-CHANGE_MAX, CHANGE_MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    #[test]
    fn a_clock_that_is_off_is_found_within_one_ramp_and_kept() {
        for fast in [0.995, 1.0, 1.005] {
            let mut random = SplitMix::seeded(7);
            let mut pace = FeedCorrection::default();
            for (motion, worst) in [0.030, 0.008].into_iter().enumerate() {
                pace.begin();
                // The start is known to 20 ms; jogs take effect 0.4 s after they were sent.
                let mut ahead = 0.005;
                let mut sent = [pace.feed(); 4];
                for tenth in 0..800_u64 {
                    let queried_at = Nanos::from_millis(100 * (tenth + 1));
                    sent.rotate_left(1);
                    sent[3] = pace.feed();
                    ahead += (fast * sent[0] - 1.0) * 0.1;
                    assert!(
                        f64::abs(ahead) < worst,
                        "{fast}, motion {motion}: {ahead} s after {tenth}"
                    );
                    let noise = 0.002 * random.normal();
                    pace.update(
                        queried_at,
                        queried_at + Nanos::from_millis(6),
                        ahead + noise,
                        0.0033,
                    );
                }
                assert!(ahead.abs() < 0.004, "{fast}: {ahead}");
            }
            assert!((pace.drift - (1.0 - 1.0 / fast)).abs() < 3e-4, "{fast}: {}", pace.drift);
        }
    }

    #[test]
    fn late_answers_and_wild_reports_move_little() {
        let mut pace = FeedCorrection::default();
        pace.begin();
        let ms = Nanos::from_millis;
        pace.update(ms(100), ms(300), 0.1, 0.003);
        assert_eq!(pace.feed(), 1.0);
        for at in 1..100 {
            pace.update(ms(100 * at), ms(100 * at + 5), 1.0, 0.003);
        }
        assert!((pace.feed() - (1.0 - CHANGE_MAX)).abs() < 1e-12);
        pace.begin();
        assert!((pace.feed() - (1.0 - DRIFT_MAX)).abs() < 1e-12);
    }
}
