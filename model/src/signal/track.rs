//! Several quantities of one recording over time, for drawing: columns of samples in segments that are shared
//! between the thread that reads and the one that draws.
//!
//! Memory: 8 bytes a sample for its time, and for each quantity 4 bytes for its value as an f32, which has the
//! digits of a 24-bit converter, and 1.3 bytes for its [`Pyramid`].

use super::pyramid::{ColumnStatistics, Pyramid, column_for};
use std::sync::Arc;

/// Samples in a segment: as many as the log has in its largest block.
pub const SEGMENT: usize = 1 << 16;

/// Samples that follow each other: their times, and a pyramid for each quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackSegment {
    times: Vec<f64>,
    columns: Vec<Pyramid>,
}

impl TrackSegment {
    /// A segment of times in s, not decreasing, with as many values of each quantity; what is not a finite
    /// number is a gap.
    ///
    /// # Panics
    /// If a quantity has not as many values as there are times.
    #[must_use]
    pub fn new(times: Vec<f64>, columns: &[Vec<f32>]) -> Self {
        let pyramid = |values: &Vec<f32>| {
            assert_eq!(values.len(), times.len(), "a value for every time");
            let mut pyramid = Pyramid::with_capacity(values.len());
            pyramid.extend(values.iter().copied());
            pyramid
        };
        let columns = columns.iter().map(pyramid).collect();
        Self { times, columns }
    }

    /// Times in s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The values of a quantity; empty where there is no such one.
    pub fn values(&self, quantity: usize) -> &[f32] {
        self.columns.get(quantity).map_or(&[], Pyramid::values)
    }

    fn bytes(&self) -> usize {
        let columns = self.columns.iter().map(Pyramid::bytes).sum::<usize>();
        size_of_val(self.times.as_slice()) + columns
    }
}

/// A place on a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPosition {
    pub index: usize,
    /// Its time in s.
    pub t: f64,
    segment: usize,
    within: usize,
}

/// A recording as segments in order of time.
#[derive(Clone, Debug, Default)]
pub struct SignalTrack {
    segments: Vec<Arc<TrackSegment>>,
    /// Samples before each segment.
    before: Vec<usize>,
    samples: usize,
}

impl SignalTrack {
    /// Adds what follows; a segment without samples is none.
    pub fn push(&mut self, segment: Arc<TrackSegment>) {
        if segment.times.is_empty() {
            return;
        }
        self.before.push(self.samples);
        self.samples += segment.times.len();
        self.segments.push(segment);
    }

    pub fn len(&self) -> usize {
        self.samples
    }

    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Bytes of all samples and their pyramids.
    pub fn bytes(&self) -> usize {
        self.segments.iter().map(|one| one.bytes()).sum()
    }

    /// The segments in order of time.
    pub fn segments(&self) -> &[Arc<TrackSegment>] {
        &self.segments
    }

    /// Times of the first and the last sample.
    pub fn span(&self) -> Option<[f64; 2]> {
        let first = self.segments.first()?.times.first()?;
        Some([*first, *self.segments.last()?.times.last()?])
    }

    /// Time of a sample; of the last one beyond the end.
    pub fn time_of(&self, index: usize) -> Option<f64> {
        let index = index.min(self.samples.checked_sub(1)?);
        let segment = self.before.partition_point(|before| *before <= index) - 1;
        Some(self.segments[segment].times[index - self.before[segment]])
    }

    /// The last sample not after a time; the first one before all.
    pub fn place(&self, t: f64) -> Option<TrackPosition> {
        let after = self.segments.partition_point(|one| one.times[0] <= t);
        let segment = after.saturating_sub(1);
        let times = &self.segments.get(segment)?.times;
        let within = times.partition_point(|one| *one <= t).saturating_sub(1);
        Some(TrackPosition {
            index: self.before[segment] + within,
            t: times[within],
            segment,
            within,
        })
    }

    /// A quantity at a place; `None` in a gap.
    pub fn value(&self, quantity: usize, place: TrackPosition) -> Option<f64> {
        let values = self.segments.get(place.segment)?.values(quantity);
        let value = f64::from(*values.get(place.within)?);
        value.is_finite().then_some(value)
    }

    /// The mean of a quantity over the column of so many samples, a power of two, that has a place; `None` without a
    /// number there.
    pub fn column_mean(&self, quantity: usize, place: TrackPosition, column: usize) -> Option<f64> {
        let pyramid = self.segments.get(place.segment)?.columns.get(quantity)?;
        let mut mean = None;
        pyramid.columns(place.within, place.within + 1, column, |_, found| {
            mean = found.map(|found| f64::from(found.mean));
        });
        mean
    }

    /// The lowest and the highest value of a quantity between two samples, the second excluded; `None` without a number
    /// there.
    pub fn extremes(&self, quantity: usize, from: usize, to: usize) -> Option<[f64; 2]> {
        let own = self.segments.iter().zip(&self.before).filter_map(|(segment, before)| {
            let (from, to) = (from.saturating_sub(*before), to.saturating_sub(*before));
            segment.columns.get(quantity)?.extremes(from, to)
        });
        let joined = own.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        joined.map(|ends| ends.map(f64::from))
    }

    /// The first sample between two, the second excluded, at which a quantity has a value exactly.
    pub fn first_with(
        &self,
        quantity: usize,
        value: f64,
        [from, to]: [usize; 2],
    ) -> Option<TrackPosition> {
        let mut segments = self.segments.iter().zip(&self.before).enumerate();
        segments.find_map(|(number, (segment, before))| {
            let values = segment.values(quantity);
            let [from, to] = [from, to].map(|at| at.saturating_sub(*before).min(values.len()));
            let found =
                values[from..to.max(from)].iter().position(|one| f64::from(*one) == value)?;
            let within = from + found;
            Some(TrackPosition {
                index: before + within,
                t: segment.times[within],
                segment: number,
                within,
            })
        })
    }

    /// The most samples in one of the [columns](Self::columns); 1 where every sample is one.
    pub fn samples_per_column(&self, quantity: usize, window: [f64; 2], pixels: f64) -> usize {
        let parts = self.parts(quantity, window, pixels);
        parts.map(|part| part.size.min(part.column.len())).fold(1, usize::max)
    }

    /// Hands out a quantity between two times in at most two columns a pixel, each with the times of its first and its
    /// last sample; `None` for one without a number. One sample before and one behind are included, so that a line
    /// reaches the edges.
    ///
    /// How wide a column is follows from each segment's own share of the pixels, so that a slow part of a
    /// recording is not thinned for the sake of a fast one.
    pub fn columns(
        &self,
        quantity: usize,
        window: [f64; 2],
        pixels: f64,
        mut take: impl FnMut([f64; 2], Option<ColumnStatistics>),
    ) {
        for SegmentPart { number, column, samples: [start, end], size } in
            self.parts(quantity, window, pixels)
        {
            let times = &self.segments[number].times;
            column.columns(start, end, size, |at, found| {
                take([times[at], times[(at + size).min(times.len()) - 1]], found);
            });
        }
    }

    /// The parts of segments that are seen between two times on so many pixels.
    fn parts(
        &self,
        quantity: usize,
        [from, to]: [f64; 2],
        pixels: f64,
    ) -> impl Iterator<Item = SegmentPart<'_>> {
        let per_second = pixels / (to - from);
        let first = match per_second.is_finite() && per_second > 0.0 {
            true => self.place(from).map_or(0, |place| place.segment),
            false => self.segments.len(),
        };
        let shown = self.segments.iter().enumerate().skip(first);
        // One sample behind the end is seen too.
        let shown = shown
            .take_while(move |(number, _)| *number == first || self.time_before(*number) <= to);
        shown.map_while(move |(number, segment)| {
            let times = &segment.times;
            let column = segment.columns.get(quantity)?;
            let count = times.len();
            let start = times.partition_point(|t| *t < from).saturating_sub(1);
            let end = (times.partition_point(|t| *t <= to) + 1).min(count);
            // To the next segment, or this one would be narrower than it is.
            let next = self.segments.get(number + 1);
            let until = next.map_or(times[count - 1], |next| next.times[0]);
            let size = column_for(count, (until - times[0]) * per_second);
            Some(SegmentPart { number, column, samples: [start, end], size })
        })
    }

    /// Time of the last sample before a segment.
    fn time_before(&self, number: usize) -> f64 {
        let before = number.checked_sub(1).and_then(|before| self.segments[before].times.last());
        before.copied().unwrap_or(f64::NEG_INFINITY)
    }
}

/// A part of a segment that is seen.
struct SegmentPart<'a> {
    number: usize,
    column: &'a Pyramid,
    /// The first, and the one behind the last.
    samples: [usize; 2],
    /// Samples in a column.
    size: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    /// Segments of any length at a rate that changes, with gaps; with the raw samples.
    fn track(random: &mut SplitMix, segments: usize) -> (SignalTrack, Vec<(f64, f32)>) {
        let (mut track, mut raw, mut t) = (SignalTrack::default(), Vec::new(), 0.0);
        for _ in 0..segments {
            let count = 1 + random.below(3000);
            let step = [1e-3, 0.05, 1.0][random.below(3)];
            let mut times = Vec::new();
            let mut values = Vec::new();
            for _ in 0..count {
                times.push(t);
                values.push(match random.below(200) {
                    0 => f32::NAN,
                    _ => random.normal() as f32,
                });
                t += step;
            }
            raw.extend(times.iter().copied().zip(values.iter().copied()));
            track.push(Arc::new(TrackSegment::new(times, &[values])));
        }
        (track, raw)
    }

    #[test]
    fn a_window_shows_the_extremes_of_what_is_in_it() {
        let mut random = SplitMix::seeded(21);
        for _ in 0..60 {
            let count = 1 + random.below(8);
            let (track, raw) = track(&mut random, count);
            let [start, end] = track.span().unwrap();
            assert_eq!((start, track.len()), (raw[0].0, raw.len()));
            let share = |random: &mut SplitMix| random.below(1000) as f64 / 999.0;
            let (a, b) = (share(&mut random), share(&mut random));
            let window = [a.min(b), a.max(b) + 0.01].map(|one| start + one * (end - start + 1e-3));
            let most = track.samples_per_column(0, window, 500.0);
            let mut ends: Option<[f32; 2]> = None;
            let (mut last, mut columns) = (f64::NEG_INFINITY, 0);
            track.columns(0, window, 500.0, |times, found| {
                assert!(last <= times[0] && times[0] <= times[1]);
                (last, columns) = (times[1], columns + 1);
                let Some(found) = found else { return };
                let samples = raw.iter().filter(|one| (times[0]..=times[1]).contains(&one.0));
                assert!(samples.count() <= most);
                let [low, high] = ends.unwrap_or([found.low, found.high]);
                ends = Some([low.min(found.low), high.max(found.high)]);
            });
            // Segments that are narrower than a pixel have a column each.
            assert!(columns <= 2 * 500 + 3 * count, "{columns}");
            let is_in = |t: f64| (window[0]..=window[1]).contains(&t);
            let inside = raw.iter().filter(|one| is_in(one.0) && one.1.is_finite());
            let inside = inside.map(|one| [one.1; 2]);
            // Columns at the edges may reach beyond: what is shown is at least what is there.
            if let Some([low, high]) = inside.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) {
                let shown = ends.unwrap();
                assert!(shown[0] <= low && shown[1] >= high);
            }
        }
    }

    #[test]
    fn places_and_extremes_are_those_of_the_samples() {
        let mut random = SplitMix::seeded(22);
        let (track, raw) = track(&mut random, 7);
        let end = track.span().unwrap()[1];
        for _ in 0..500 {
            let t = end * (random.below(1200) as f64 / 1000.0 - 0.1);
            let expected = raw.partition_point(|one| one.0 <= t).saturating_sub(1);
            let place = track.place(t).unwrap();
            assert_eq!((place.index, place.t), (expected, raw[expected].0));
            assert_eq!(track.time_of(expected), Some(raw[expected].0));
            let value = track.value(0, place);
            let known = Some(f64::from(raw[expected].1)).filter(|one| one.is_finite());
            assert_eq!(value, known);
            assert_eq!(track.column_mean(0, place, 1), known);
            let (a, b) = (random.below(raw.len()), random.below(raw.len()));
            let (from, to) = (a.min(b), a.max(b));
            let own = raw[from..to].iter().filter(|one| one.1.is_finite());
            let high = own.map(|one| f64::from(one.1)).reduce(f64::max);
            assert_eq!(track.extremes(0, from, to).map(|ends| ends[1]), high);
            if let Some(high) = high {
                let first =
                    from + raw[from..to].iter().position(|one| f64::from(one.1) == high).unwrap();
                let found = track.first_with(0, high, [from, to]).unwrap();
                assert_eq!((found.index, found.t), (first, raw[first].0));
                assert_eq!(track.value(0, found), Some(high));
            }
        }
        assert_eq!(SignalTrack::default().place(1.0), None);
        assert_eq!(track.time_of(usize::MAX), Some(end));
        assert_eq!(track.extremes(3, 0, 10), None);
    }

    #[test]
    fn memory_is_as_stated() {
        let count = 1 << 16;
        let times = (0..count).map(f64::from).collect();
        let mut track = SignalTrack::default();
        let values = vec![1.0f32; count as usize];
        track.push(Arc::new(TrackSegment::new(times, &vec![values; 4])));
        let per_sample = track.bytes() as f64 / f64::from(count);
        assert!((29.2..29.4).contains(&per_sample), "{per_sample}");
    }
}
