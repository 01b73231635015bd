//! The times at which a load cell took its samples, on the host's clock.
//!
//! A device stamps its samples with a clock of its own, which runs at a rate of its own, and they arrive late by what
//! the link takes, never early. The line under all arrivals is the clock: the shortest delays are the true ones (V.
//! Paxson, On calibrating measurements of packet transit times, SIGMETRICS 1998, section 4; S. Moon, P. Skelly, D.
//! Towsley, Estimation and removal of clock skew from network delay measurements, INFOCOM 1999).

use palpate_model::Nanos;
use std::collections::VecDeque;

/// Arrivals are looked at over this time; over it a crystal or a resonator keeps its rate well.
const BUCKETS: usize = 40;
/// Of each such span the sample with the shortest delay is kept.
const BUCKET: Nanos = Nanos::from_millis(500);
/// Before so much is known, the device's clock counts as exact.
const SPAN_MIN: f64 = 3e9;
/// A resonator is off by half a percent at most; what seems more is the link.
const RATE_MAX: f64 = 0.01;

/// One device's clock against the host's. Times in ns from the first sample.
#[derive(Clone, Debug, Default)]
pub struct CellClock {
    origin: Option<(Nanos, Nanos)>,
    /// Device time and arrival of each bucket's promptest sample.
    prompt: VecDeque<(f64, f64)>,
    bucket_ends: f64,
    rate: f64,
    offset: f64,
}

impl CellClock {
    /// The host's time at which a sample was taken, or rather by which its shortest way would have brought it here.
    pub fn map(&mut self, device: Nanos, arrival: Nanos) -> Nanos {
        let (first_device, first_arrival) = *self.origin.get_or_insert((device, arrival));
        let d = device.0 as f64 - first_device.0 as f64;
        let a = arrival.0 as f64 - first_arrival.0 as f64;
        self.note(d, a);
        let estimate = (d * (1.0 + self.rate) + self.offset).min(a);
        Nanos(first_arrival.0.saturating_add_signed(estimate as i64))
    }

    /// Median distance of recent arrivals from the line.
    pub fn spread(&self) -> Nanos {
        let mut late: Vec<f64> =
            self.prompt.iter().map(|(d, a)| a - (d * (1.0 + self.rate) + self.offset)).collect();
        late.sort_by(f64::total_cmp);
        Nanos(late.get(late.len() / 2).map_or(0, |late| late.max(0.0) as u64))
    }

    fn note(&mut self, d: f64, a: f64) {
        let delay = |(d, a): (f64, f64), rate: f64| a - d * (1.0 + rate);
        match self.prompt.back_mut() {
            Some(last) if d < self.bucket_ends => {
                if delay((d, a), self.rate) < delay(*last, self.rate) {
                    *last = (d, a);
                }
            }
            _ => {
                if self.prompt.len() >= BUCKETS {
                    self.prompt.pop_front();
                }
                self.prompt.push_back((d, a));
                self.bucket_ends = d + BUCKET.0 as f64;
            }
        }
        self.fit();
    }

    /// The line under all points that has the least sum of their delays: the edge of their lower hull over their mean.
    fn fit(&mut self) {
        let (Some(first), Some(last)) = (self.prompt.front(), self.prompt.back()) else {
            return;
        };
        if last.0 - first.0 < SPAN_MIN {
            self.rate = 0.0;
            self.offset = self.least_offset();
            return;
        }
        let mut hull: Vec<(f64, f64)> = Vec::new();
        for point in &self.prompt {
            while let [.., p, q] = hull[..] {
                let is_above = (q.0 - p.0) * (point.1 - p.1) <= (q.1 - p.1) * (point.0 - p.0);
                if !is_above {
                    break;
                }
                hull.pop();
            }
            hull.push(*point);
        }
        let mean = self.prompt.iter().map(|(d, _)| d).sum::<f64>() / self.prompt.len() as f64;
        let edge = hull.windows(2).find(|edge| edge[1].0 >= mean);
        if let Some([p, q]) = edge {
            self.rate = ((q.1 - p.1) / (q.0 - p.0) - 1.0).clamp(-RATE_MAX, RATE_MAX);
        }
        self.offset = self.least_offset();
    }

    fn least_offset(&self) -> f64 {
        let offsets = self.prompt.iter().map(|(d, a)| a - d * (1.0 + self.rate));
        offsets.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    #[test]
    fn a_drifting_clock_behind_a_jittery_link_is_found() {
        for ppm in [-4_000.0, 0.0, 80.0, 4_000.0] {
            let mut random = SplitMix::seeded(3);
            let mut clock = CellClock::default();
            let (mut worst, mut newest) = (0.0_f64, Nanos::ZERO);
            for sample in 0..4_800_u64 {
                // 80 a second for a minute, on the host's clock.
                let taken = 5e9 + sample as f64 * 12.5e6;
                let device = Nanos((taken / (1.0 + ppm * 1e-6)) as u64);
                // 1 ms at least, mostly less than 5, now and then 40.
                let late =
                    random.below(4_000_000) as f64 + if random.below(20) == 0 { 35e6 } else { 0.0 };
                let mapped = clock.map(device, Nanos((taken + 1e6 + late) as u64));
                if sample > 400 {
                    worst = worst.max((mapped.0 as f64 - taken - 1e6).abs());
                    assert!(mapped > newest, "time never goes back");
                }
                newest = mapped;
            }
            assert!(worst < 0.6e6, "{ppm}: {worst}");
            assert!(clock.spread() < Nanos::from_millis(1));
        }
    }

    #[test]
    fn the_first_samples_are_at_most_as_late_as_they_came() {
        let mut clock = CellClock::default();
        let ms = Nanos::from_millis;
        assert_eq!(clock.map(ms(100), ms(1_000)), ms(1_000));
        assert_eq!(clock.map(ms(110), ms(1_030)), ms(1_010));
        // A shorter way is the truth from then on.
        assert_eq!(clock.map(ms(120), ms(1_015)), ms(1_015));
        assert_eq!(clock.map(ms(130), ms(1_060)), ms(1_025));
    }
}
