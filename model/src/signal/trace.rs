//! History for live plots in constant memory: every bucket of samples keeps its lowest and its
//! highest force, so no peak is lost however long the run. What is saved is never thinned.

use crate::units::{Depth, Newtons, Seconds};

/// One point to draw. Depth is NaN before contact is known; force NaN marks a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracePoint {
    /// Session time in s.
    pub t: f64,
    /// Depth in mm.
    pub depth: f64,
    pub force: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bucket {
    low: TracePoint,
    high: TracePoint,
    has_gap: bool,
}

impl Bucket {
    fn of(point: TracePoint) -> Self {
        Self { low: point, high: point, has_gap: !point.force.is_finite() }
    }

    fn join(self, other: Self) -> Self {
        let pick = |a: TracePoint, b: TracePoint, is_better: fn(f64, f64) -> bool| {
            // A gap never wins over a number.
            if !a.force.is_finite() || (b.force.is_finite() && is_better(b.force, a.force)) {
                b
            } else {
                a
            }
        };
        Self {
            low: pick(self.low, other.low, |new, old| new < old),
            high: pick(self.high, other.high, |new, old| new > old),
            has_gap: self.has_gap || other.has_gap,
        }
    }
}

/// Bounded history of force and depth over time.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveTrace {
    capacity: usize,
    per_bucket: u64,
    buckets: Vec<Bucket>,
    open: Option<(Bucket, u64)>,
}

impl LiveTrace {
    /// A history of at most `capacity` buckets, at least two.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { capacity: capacity.max(2), per_bucket: 1, buckets: Vec::new(), open: None }
    }

    pub fn push(&mut self, t: Seconds, depth: Depth, force: Newtons) {
        let point = Bucket::of(TracePoint { t: t.0, depth: depth.0, force: force.0 });
        let (bucket, count) = match self.open.take() {
            Some((bucket, count)) => (bucket.join(point), count + 1),
            None => (point, 1),
        };
        if count < self.per_bucket {
            self.open = Some((bucket, count));
            return;
        }
        self.buckets.push(bucket);
        if self.buckets.len() == self.capacity {
            let merged = self.buckets.chunks(2).map(|pair| match pair {
                [a, b] => a.join(*b),
                _ => pair[0],
            });
            self.buckets = merged.collect();
            self.per_bucket *= 2;
        }
    }

    /// Samples that share one drawn minimum and maximum; above 1 the plot is thinned.
    pub fn samples_per_bucket(&self) -> u64 {
        self.per_bucket
    }

    /// The points to draw, in order of time; a NaN force breaks the line.
    pub fn points(&self) -> Vec<TracePoint> {
        let mut points = Vec::with_capacity(2 * self.buckets.len() + 2);
        for bucket in self.buckets.iter().chain(self.open.iter().map(|(bucket, _)| bucket)) {
            let (first, second) = if bucket.low.t <= bucket.high.t {
                (bucket.low, bucket.high)
            } else {
                (bucket.high, bucket.low)
            };
            points.push(first);
            if second.t > first.t {
                points.push(second);
            }
            if bucket.has_gap && second.force.is_finite() {
                points.push(TracePoint { force: f64::NAN, ..second });
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace_of(values: impl Iterator<Item = f64>, capacity: usize) -> LiveTrace {
        let mut trace = LiveTrace::new(capacity);
        for (i, force) in values.enumerate() {
            trace.push(Seconds(i as f64), Depth(0.1 * i as f64), Newtons(force));
        }
        trace
    }

    #[test]
    fn keeps_every_extreme_in_constant_memory() {
        let spike = |i: i32| {
            if i == 54_321 { 9.0 } else { f64::from(i % 100) * 1e-3 }
        };
        let trace = trace_of((0..100_000).map(spike), 256);
        let points = trace.points();
        assert!(points.len() <= 2 * 256 + 2);
        assert!(trace.samples_per_bucket() > 1);
        let peak = points.iter().find(|point| point.force == 9.0).unwrap();
        assert_eq!((peak.t, peak.depth), (54_321.0, 5_432.1));
        assert!(points.windows(2).all(|pair| pair[0].t <= pair[1].t));
    }

    #[test]
    fn an_hour_and_a_half_holds_no_more_than_minutes_do() {
        // A thousand samples a second; a day is an example of its own.
        let force = |i: i32| f64::from(i % 977);
        let mut most = 0;
        let mut trace = LiveTrace::new(2048);
        for i in 0..5_400_000 {
            let t = f64::from(i) * 1e-3;
            trace.push(Seconds(t), Depth(1.0), Newtons(force(i)));
            if i % 60_000 == 0 {
                most = most.max(trace.buckets.capacity());
                let points = trace.points();
                assert!(points.len() <= 2 * 2048 + 2, "{}", points.len());
                // What is newest is there, however coarse the rest is.
                let newest = points[points.len() - 1].t;
                let bucket = trace.samples_per_bucket() as f64 * 1e-3;
                assert!(t - newest <= bucket, "{newest} at {t}");
            }
        }
        assert!(most <= 2 * 2048, "{most}");
    }

    #[test]
    fn short_histories_are_drawn_whole_and_gaps_break_the_line() {
        let trace = trace_of([1.0, 2.0, f64::NAN, 3.0].into_iter(), 64);
        let forces: Vec<f64> = trace.points().iter().map(|point| point.force).collect();
        assert_eq!((forces[0], forces[1], forces[3]), (1.0, 2.0, 3.0));
        assert!(forces[2].is_nan());
        let merged = trace_of((0..8).map(|i| if i == 3 { f64::NAN } else { 1.0 }), 4);
        assert!(merged.points().iter().any(|point| point.force.is_nan()));
    }
}
