//! Contour mode: increments over 2^n samples, between which the controller goes straight.
//!
//! DMC-40x0 command reference, `CM`, `CD`, `DT`: a buffer of 511 segments, `_CM` is the number of free ones.

use palpate_drivers::galil::ErrorCode;
use std::collections::VecDeque;

/// Segments of the buffer.
pub const SEGMENTS: usize = 511;
/// `DT n`: 2^n samples, n up to 8.
const INTERVAL_MAX: f64 = 8.0;

#[derive(Clone, Debug, PartialEq)]
struct Segment {
    increments: Vec<f64>,
    /// 2^n samples, or 0: the end of the mode.
    samples: u32,
}

#[derive(Clone, Debug, Default)]
pub struct ContourMode {
    /// Axes in the mode; empty while it is off.
    pub axes: Vec<usize>,
    /// Of `DT`; 0 ends the mode with the next `CD`, -1 pauses.
    interval: f64,
    buffer: VecDeque<Segment>,
    /// The segment under way and samples of it that are over.
    current: Option<(Segment, u32)>,
    /// Segments done, `_CS`.
    pub done: u32,
}

/// Motion of the axes in one sample.
#[derive(Clone, Debug, PartialEq)]
pub enum ContourStep {
    Idle,
    /// Increments of this sample, in counts, in the order of the axes.
    By(Vec<f64>),
    End,
}

impl ContourMode {
    /// Whether the mode is on.
    pub fn is_on(&self) -> bool {
        !self.axes.is_empty()
    }

    /// Free segments: `_CM`.
    pub fn free(&self) -> usize {
        SEGMENTS - self.buffer.len()
    }

    /// `CM`.
    pub fn begin(&mut self, axes: Vec<usize>) {
        *self = Self { axes, interval: f64::NAN, ..Self::default() };
    }

    /// `DT`.
    pub fn set_interval(&mut self, n: f64) -> Result<(), ErrorCode> {
        if !(-1.0..=INTERVAL_MAX).contains(&n) || n.fract() != 0.0 {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        self.interval = n;
        Ok(())
    }

    /// `CD`, for this segment alone with a time of its own.
    pub fn push(&mut self, increments: Vec<f64>, time: Option<f64>) -> Result<(), ErrorCode> {
        let n = match time {
            Some(n) if !(0.0..=INTERVAL_MAX).contains(&n) => return Err(ErrorCode::OUT_OF_RANGE),
            Some(n) => n,
            None if self.interval.is_nan() || self.interval < 0.0 => {
                return Err(ErrorCode::NO_TIME);
            }
            None => self.interval,
        };
        if self.free() == 0 {
            return Err(ErrorCode::SEGMENTS_FULL);
        }
        // 2^15 counts in a segment is what a 16-bit increment holds.
        if increments.iter().any(|counts| counts.abs() > 32_767.0) {
            return Err(ErrorCode::CONTOUR_RANGE);
        }
        let samples = if n == 0.0 { 0 } else { 1 << n as u32 };
        self.buffer.push_back(Segment { increments, samples });
        Ok(())
    }

    /// Whether `WC` waits: until the segment before the newest has begun.
    pub fn is_behind(&self) -> bool {
        self.is_on() && self.buffer.len() > 1
    }

    pub fn sample(&mut self) -> ContourStep {
        if !self.is_on() {
            return ContourStep::Idle;
        }
        // `DT -1` holds what is under way where it is.
        if self.current.is_none() && self.interval < 0.0 {
            return ContourStep::Idle;
        }
        if self.current.is_none() {
            self.current = self.buffer.pop_front().map(|segment| (segment, 0));
        }
        let Some((segment, over)) = &mut self.current else {
            return ContourStep::Idle;
        };
        if segment.samples == 0 {
            *self = Self { done: self.done, ..Self::default() };
            return ContourStep::End;
        }
        let share = 1.0 / f64::from(segment.samples);
        let by = segment.increments.iter().map(|counts| counts * share).collect();
        *over += 1;
        if *over == segment.samples {
            self.current = None;
            self.done = self.done.wrapping_add(1);
        }
        ContourStep::By(by)
    }

    pub fn cancel(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_are_spread_over_their_samples() {
        let mut contour = ContourMode::default();
        contour.begin(vec![0]);
        assert_eq!(contour.push(vec![1.0], None), Err(ErrorCode::NO_TIME));
        contour.set_interval(2.0).unwrap();
        contour.push(vec![8.0], None).unwrap();
        contour.push(vec![-4.0], Some(1.0)).unwrap();
        contour.push(vec![0.0], Some(0.0)).unwrap();
        assert_eq!(contour.free(), SEGMENTS - 3);
        let steps: Vec<_> = (0..8).map(|_| contour.sample()).collect();
        let by = |counts: f64| ContourStep::By(vec![counts]);
        assert_eq!(
            steps,
            [
                by(2.0),
                by(2.0),
                by(2.0),
                by(2.0),
                by(-2.0),
                by(-2.0),
                ContourStep::End,
                ContourStep::Idle
            ]
        );
        assert!(!contour.is_on());
    }

    #[test]
    fn the_buffer_has_an_end() {
        let mut contour = ContourMode::default();
        contour.begin(vec![0]);
        contour.set_interval(1.0).unwrap();
        for _ in 0..SEGMENTS {
            contour.push(vec![1.0], None).unwrap();
        }
        assert_eq!(contour.push(vec![1.0], None), Err(ErrorCode::SEGMENTS_FULL));
        assert_eq!(contour.free(), 0);
    }
}
