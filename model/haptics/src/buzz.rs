//! A limit cycle of the loop, distinguished from the motion of a hand: it is fast, wide enough to be felt, and the force feeds it.

use super::Period;
use serde::{Deserialize, Serialize};

/// Thresholds of a limit cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BuzzSettings {
    /// Slowest buzz in Hz: above what a hand does.
    pub frequency_hz: f64,
    /// Least way between two turns, in mm.
    pub swing_mm: f64,
}

impl BuzzSettings {
    /// Above 8 Hz, as a hand moves itself up to 5; two counts, since one alone comes and goes by itself at an edge of the
    /// encoder. Soft bodies on heavy devices buzz no faster than a hand trembles, so that frequency alone does not
    /// tell: the energy does.
    #[must_use]
    pub fn of(count_mm: f64) -> Self {
        Self { frequency_hz: 8.0, swing_mm: 2.0 * count_mm }
    }
}

/// Turns that make a buzz: three whole cycles and the turn before them.
const TURNS: usize = 7;

/// A limit cycle as it was detected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Buzz {
    /// Its frequency in Hz.
    pub frequency_hz: f64,
    /// Half of its last swing, in mm.
    pub amplitude_mm: f64,
}

/// Counts changes of the direction of motion: the velocity changes its sign for good where the device
/// came back by the least swing.
#[derive(Clone, Copy, Debug)]
pub struct BuzzDetector {
    swing: f64,
    /// Longest time of the turns, in ticks.
    span_max: f64,
    hz: f64,
    tick: u64,
    /// Furthest place since the last turn, when it was reached, and the energy absorbed then.
    extreme: (f64, u64, f64),
    turn: f64,
    inward: bool,
    /// Ticks of the last turns and the energy absorbed at them, as a ring.
    turns: [(u64, f64); TURNS],
    count: u64,
    last_swing: f64,
}

impl BuzzDetector {
    /// No limit cycle yet, with the device at `at` mm.
    #[must_use]
    pub fn new(settings: &BuzzSettings, period: Period, at: f64) -> Self {
        let cycles = 0.5 * (TURNS - 1) as f64;
        Self {
            swing: settings.swing_mm.max(f64::MIN_POSITIVE),
            span_max: cycles * period.hz() / settings.frequency_hz.max(f64::MIN_POSITIVE),
            hz: period.hz(),
            tick: 0,
            extreme: (at, 0, 0.0),
            turn: at,
            inward: true,
            turns: [(0, 0.0); TURNS],
            count: 0,
            last_swing: 0.0,
        }
    }

    /// The device is at `at` mm, `elapsed` ticks later; the force has absorbed `energy` N mm so far.
    pub fn tick(&mut self, at: f64, elapsed: u64, energy: f64) -> Option<Buzz> {
        self.tick = self.tick.saturating_add(elapsed);
        if !at.is_finite() {
            return self.buzz();
        }
        let way = if self.inward { at - self.extreme.0 } else { self.extreme.0 - at };
        if way > 0.0 {
            self.extreme = (at, self.tick, energy);
        } else if -way >= self.swing {
            self.turns[(self.count % TURNS as u64) as usize] = (self.extreme.1, self.extreme.2);
            self.count += 1;
            self.last_swing = (self.extreme.0 - self.turn).abs();
            self.turn = self.extreme.0;
            self.inward = !self.inward;
            self.extreme = (at, self.tick, energy);
        }
        self.buzz()
    }

    fn buzz(&self) -> Option<Buzz> {
        if self.count < TURNS as u64 {
            return None;
        }
        // The oldest of the ring is where the next turn goes.
        let (oldest, feeding) = self.turns[(self.count % TURNS as u64) as usize];
        let (newest, fed) = self.turns[((self.count - 1) % TURNS as u64) as usize];
        // Over as soon as the next turn is late.
        let age = self.tick.saturating_sub(newest) as f64;
        let half = self.span_max / (TURNS - 1) as f64;
        let span = (newest - oldest) as f64;
        // Three whole cycles apart both turns are at the same end, where a spring holds the same energy.
        let is_fed = fed < feeding;
        (is_fed && span <= self.span_max && age <= 1.5 * half).then(|| Buzz {
            frequency_hz: 0.5 * (TURNS - 1) as f64 * self.hz / span.max(1.0),
            amplitude_mm: 0.5 * self.last_swing,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const COUNT: f64 = 0.015_34;

    /// Last buzz of a motion in mm, counted and sampled at 1 kHz, that takes `watts` N mm/s from the force.
    fn heard(seconds: f64, watts: f64, at: impl Fn(f64) -> f64) -> Option<Buzz> {
        let mut detector =
            BuzzDetector::new(&BuzzSettings::of(COUNT), Period::MILLISECOND, at(0.0));
        let ticks = (seconds * 1e3) as u32;
        (0..ticks)
            .filter_map(|i| {
                let t = f64::from(i) * 1e-3;
                detector.tick((at(t) / COUNT).round() * COUNT, 1, -watts * t)
            })
            .last()
    }

    #[test]
    fn a_buzz_is_heard_with_its_frequency_and_amplitude() {
        for hz in [12.0, 40.0, 100.0] {
            for amplitude in [0.05, 0.2, 3.0] {
                let buzz = heard(2.0, 1.0, |t| 5.0 + t + amplitude * (TAU * hz * t).sin());
                let buzz = buzz.unwrap();
                // Turns are seen to a tick or two in three cycles, and to a count either way.
                assert!((buzz.frequency_hz / hz - 1.0).abs() < 0.1, "{buzz:?} {hz}");
                let miss = (buzz.amplitude_mm - amplitude).abs();
                assert!(miss < COUNT + 0.1 * amplitude, "{buzz:?} {amplitude}");
            }
        }
    }

    #[test]
    fn a_hand_is_no_buzz() {
        // 5 Hz as wide as the stroke, even where the force feeds it; a tremor of 10 Hz that the force takes energy
        // from; flicker of one count.
        for amplitude in [0.1, 1.0, 15.0] {
            assert_eq!(heard(5.0, 1.0, |t| amplitude * (TAU * 5.0 * t).sin()), None);
        }
        let tremor = |t: f64| 10.0 * (TAU * 0.5 * t).sin() + 0.5 * (TAU * 10.0 * t).sin();
        assert_eq!(heard(5.0, -1.0, tremor), None);
        assert!(heard(5.0, 1.0, tremor).is_some());
        let flicker = |t: f64| COUNT * (0.5 + 0.1 * (TAU * 330.0 * t).sin());
        assert_eq!(heard(5.0, 1.0, flicker), None);
    }

    #[test]
    fn a_buzz_that_ends_is_over() {
        let mut detector = BuzzDetector::new(&BuzzSettings::of(COUNT), Period::MILLISECOND, 0.0);
        let mut last = None;
        for i in 0..1000 {
            let t = f64::from(i) * 1e-3;
            last = detector.tick((TAU * 50.0 * t).sin(), 1, -t);
        }
        assert!(last.is_some());
        for _ in 0..100 {
            last = detector.tick(0.0, 1, -1.0);
        }
        assert_eq!(last, None);
        assert_eq!(detector.tick(f64::NAN, u64::MAX, f64::NAN), None);
    }
}
