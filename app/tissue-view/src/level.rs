//! Levels of detail, and the choice of one from measured frame times.

use std::fmt;

/// What a picture costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetailLevel {
    /// A pixel of the picture for so many of the screen along each side.
    pub divisor: u32,
    /// Samples per pixel at edges; 1 where the adapter allows no more.
    pub samples: u32,
    /// One of so many nodes along each side is drawn.
    pub every: u32,
    pub shading: Shading,
}

/// How a fragment is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shading {
    /// Lobes of highlights, reflections of the probe, exact occlusion.
    Full,
    /// One highlight, approximate occlusion.
    Simple,
}

/// From the best picture to the cheapest.
pub const LEVELS: [DetailLevel; 6] = [
    DetailLevel { divisor: 1, samples: 4, every: 1, shading: Shading::Full },
    DetailLevel { divisor: 1, samples: 1, every: 1, shading: Shading::Full },
    DetailLevel { divisor: 1, samples: 1, every: 2, shading: Shading::Simple },
    DetailLevel { divisor: 2, samples: 1, every: 2, shading: Shading::Simple },
    DetailLevel { divisor: 2, samples: 1, every: 3, shading: Shading::Simple },
    DetailLevel { divisor: 3, samples: 1, every: 4, shading: Shading::Simple },
];

impl fmt::Display for DetailLevel {
    /// For the user, below the picture: what is left out.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.divisor == 1 {
            write!(f, "full resolution")?;
        } else {
            write!(f, "1/{} resolution", self.divisor)?;
        }
        if self.samples > 1 {
            write!(f, ", {} samples", self.samples)?;
        }
        if self.every > 1 {
            write!(f, ", one of every {} nodes along each side", self.every)?;
        }
        if self.shading == Shading::Simple {
            write!(f, ", simple shading")?;
        }
        Ok(())
    }
}

/// Frames whose median decides: one slow frame, as when a window is resized, decides nothing.
const FRAMES: usize = 9;
/// A median above this in ms is too slow: 25 frames/s are 40 ms, less a margin of a fifth.
const SLOW_MS: f64 = 32.0;
/// Two frames in a row above this in ms need no median: nine of them would take a second and more.
const FAR_TOO_SLOW_MS: f64 = 120.0;
/// A median below this in ms allows a try of the next better level. A display at 60 Hz never shows frames below 16.7 ms,
/// so the limit is above.
const FAST_MS: f64 = 20.0;
/// Frames between fast frames and the first try of a better level: two seconds at 60 Hz. Doubled by every try that fails.
const WAIT: u32 = 120;
/// The longest wait: half an hour at 60 Hz.
const WAIT_MAX: u32 = WAIT << 10;

/// Chooses a level from frame times. The same times give the same levels.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelChooser {
    level: usize,
    recent: Vec<f64>,
    /// Frames in a row whose median was fast.
    fast: u32,
    /// Frames that must be fast before a better level is tried.
    wait: u32,
    /// Frames since a better level was tried; `None` once it has proved good.
    trial: Option<u32>,
}

impl Default for LevelChooser {
    /// Begins with the best.
    fn default() -> Self {
        Self { level: 0, recent: Vec::with_capacity(FRAMES), fast: 0, wait: WAIT, trial: None }
    }
}

impl LevelChooser {
    /// Begins with a level that was good at another time, counted in [`LEVELS`].
    #[must_use]
    pub fn starting_at(level: usize) -> Self {
        Self { level: level.min(LEVELS.len() - 1), ..Self::default() }
    }

    #[must_use]
    pub fn level(&self) -> DetailLevel {
        LEVELS[self.level]
    }

    /// Of the level in [`LEVELS`].
    #[must_use]
    pub fn index(&self) -> usize {
        self.level
    }

    /// Takes the time of a frame in ms that was drawn at the present level, and says at which level the next one is.
    /// Times that are not finite or negative count for nothing.
    pub fn record(&mut self, frame_ms: f64) -> DetailLevel {
        if !(frame_ms.is_finite() && frame_ms >= 0.0) {
            return self.level();
        }
        self.recent.push(frame_ms);
        if let [.., before, now] = self.recent[..]
            && before.min(now) > FAR_TOO_SLOW_MS
            && self.level + 1 < LEVELS.len()
        {
            self.step_down(before.min(now));
            return self.level();
        }
        if self.recent.len() < FRAMES {
            return self.level();
        }
        let median = median(&self.recent);
        self.recent.remove(0);
        if median > SLOW_MS {
            self.step_down(median);
        } else {
            self.stay(median);
        }
        self.level()
    }

    /// To a cheaper level; by two where frames take more than twice what they may.
    fn step_down(&mut self, median: f64) {
        if self.trial.is_some() {
            self.wait = (self.wait * 2).min(WAIT_MAX);
        }
        let steps = if median > 2.0 * SLOW_MS { 2 } else { 1 };
        self.go_to((self.level + steps).min(LEVELS.len() - 1));
        self.trial = None;
    }

    fn stay(&mut self, median: f64) {
        self.trial = self.trial.map(|frames| frames + 1).filter(|&frames| frames < WAIT);
        self.fast = if median < FAST_MS { self.fast + 1 } else { 0 };
        if self.fast >= self.wait && self.level > 0 {
            self.go_to(self.level - 1);
            self.trial = Some(0);
        }
    }

    fn go_to(&mut self, level: usize) {
        self.level = level;
        self.fast = 0;
        // Times of another level say nothing about this one.
        self.recent.clear();
    }
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels over frames of an adapter that takes these times for them, in ms.
    fn levels_of(cost: [f64; 6], frames: usize) -> Vec<usize> {
        let mut chooser = LevelChooser::default();
        (0..frames)
            .map(|_| {
                chooser.record(cost[chooser.index()]);
                chooser.index()
            })
            .collect()
    }

    #[test]
    fn a_fast_adapter_stays_at_the_best_level() {
        assert!(levels_of([16.7; 6], 5000).iter().all(|&level| level == 0));
    }

    #[test]
    fn a_slow_adapter_comes_to_the_best_level_that_is_fast_enough() {
        let levels = levels_of([160.0, 90.0, 50.0, 25.0, 17.0, 9.0], 400);
        assert_eq!(levels[1], 2, "two frames that take far too long are enough");
        assert_eq!(levels[10..], [3; 390], "25 ms are neither slow nor fast");
    }

    #[test]
    fn a_level_between_fast_and_slow_neighbours_does_not_swing() {
        // Level 3 is too slow, level 4 is so fast that level 3 is tried again and again.
        let levels = levels_of([99.0, 99.0, 99.0, 40.0, 10.0, 5.0], 60_000);
        let changes = levels.windows(2).filter(|pair| pair[0] != pair[1]).count();
        // Waits double: 120 * (1 + 2 + ... + 256) is 61 320 frames, two changes for each try.
        assert!((10..=22).contains(&changes), "{changes}");
        let last = &levels[levels.len() - 10_000..];
        let slow = last.iter().filter(|&&level| level == 3).count();
        assert!(slow <= FRAMES, "{slow} of the last 10 000 frames were slow");
    }

    #[test]
    fn one_slow_frame_and_no_number_change_nothing() {
        let mut chooser = LevelChooser::starting_at(1);
        for frame in 0..500 {
            let time = if frame % 20 == 0 { 400.0 } else { 25.0 };
            chooser.record(time);
            chooser.record(f64::NAN);
            chooser.record(-1.0);
        }
        assert_eq!(chooser.index(), 1);
    }

    #[test]
    fn an_adapter_that_becomes_free_gets_its_better_levels_back() {
        let mut chooser = LevelChooser::default();
        for _ in 0..200 {
            chooser.record(80.0);
        }
        assert_eq!(chooser.index(), LEVELS.len() - 1);
        for _ in 0..5000 {
            chooser.record(16.7);
        }
        assert_eq!(chooser.index(), 0);
    }

    #[test]
    fn equal_times_give_equal_levels() {
        let times = |seed: u64| {
            let mut state = seed;
            move || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                10.0 + (state >> 33) as f64 / f64::from(u32::MAX) * 80.0
            }
        };
        let (mut one, mut other) = (LevelChooser::default(), LevelChooser::default());
        let (mut first, mut second) = (times(7), times(7));
        for _ in 0..3000 {
            assert_eq!(one.record(first()), other.record(second()));
        }
        assert_eq!(one, other);
    }

    #[test]
    fn levels_say_what_they_leave_out() {
        assert_eq!(LEVELS[0].to_string(), "full resolution, 4 samples");
        assert_eq!(
            LEVELS[5].to_string(),
            "1/3 resolution, one of every 4 nodes along each side, simple shading"
        );
    }
}
