//! Lowest, highest and mean samples of a recording at several coarsenesses, so that a plot of millions of samples
//! finds the few it needs without looking at the rest. What is saved, fitted or exported is never thinned.
//!
//! A bucket of a level keeps its mean, the places of its lowest and its highest sample in order of time, and whether
//! samples that are no numbers stand before, between or behind them. The smallest bucket has 16 samples, as
//! many as are looked through about as fast as a bucket is; each level is coarser by a factor of four.
//!
//! Memory: 4 bytes a sample for its value, and 12 bytes a bucket, 1 byte a sample over all levels.

/// Samples in a bucket of the finest level.
pub const BUCKET: usize = 16;
/// Buckets of a level in one of the next.
const FACTOR: usize = 4;

/// Marks that stand in the places of a bucket. Places are below 2^30.
const BEFORE: u32 = 1 << 31;
const AFTER: u32 = 1 << 30;
const BETWEEN: u32 = 1 << 31;
const PLACE: u32 = AFTER - 1;
/// No sample at this place.
const NONE: u32 = PLACE;

/// Most samples in one pyramid.
pub const SAMPLES_MAX: usize = NONE as usize;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PyramidMark {
    /// A sample: its place and its value.
    Point(usize, f32),
    /// Samples that are no numbers: the line breaks.
    Gap,
}

/// What a column of samples has between its first and its last number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnStatistics {
    pub low: f32,
    pub high: f32,
    /// Of its numbers. Beside a gap, parts of 16 samples and more count alike, whatever numbers they have.
    pub mean: f32,
    /// It has samples that are no numbers.
    pub has_gap: bool,
}

/// A bucket: its mean, and its lowest and its highest sample in order of time, the marks of gaps in the highest bits.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bucket {
    first: u32,
    second: u32,
    /// Not a number where it has none.
    mean: f32,
}

/// A sample within a fold, and how many gaps came before it.
#[derive(Clone, Copy)]
struct FoldSample {
    index: u32,
    value: f32,
    gaps: u32,
}

/// Finds the mean, the lowest and the highest of what passes by, the first of equal ones.
#[derive(Default)]
struct Fold {
    low: Option<FoldSample>,
    high: Option<FoldSample>,
    gaps: u32,
    sum: f64,
    weight: f64,
}

impl Fold {
    fn gap(&mut self) {
        self.gaps += 1;
    }

    fn take(&mut self, index: u32, value: f32) {
        let place = FoldSample { index, value, gaps: self.gaps };
        if self.low.is_none_or(|low| value < low.value) {
            self.low = Some(place);
        }
        if self.high.is_none_or(|high| value > high.value) {
            self.high = Some(place);
        }
    }

    fn weigh(&mut self, mean: f32, samples: usize) {
        if mean.is_finite() {
            self.sum += f64::from(mean) * samples as f64;
            self.weight += samples as f64;
        }
    }

    /// Not a number without any.
    fn mean(&self) -> f32 {
        (self.sum / self.weight) as f32
    }

    /// The two in order of time, the second none where both are one.
    fn pair(&self) -> Option<(FoldSample, Option<FoldSample>)> {
        let (low, high) = (self.low?, self.high?);
        Some(match low.index.cmp(&high.index) {
            std::cmp::Ordering::Less => (low, Some(high)),
            std::cmp::Ordering::Equal => (low, None),
            std::cmp::Ordering::Greater => (high, Some(low)),
        })
    }

    fn bucket(&self) -> Bucket {
        let mark = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        let Some((first, second)) = self.pair() else {
            let first = NONE | mark(self.gaps > 0, BEFORE);
            return Bucket { first, second: NONE, mean: f32::NAN };
        };
        let last = second.unwrap_or(first);
        let marks = mark(first.gaps > 0, BEFORE) | mark(self.gaps > last.gaps, AFTER);
        Bucket {
            first: first.index | marks,
            second: second
                .map_or(NONE, |second| second.index | mark(second.gaps > first.gaps, BETWEEN)),
            mean: self.mean(),
        }
    }

    fn draw(&self, draw: &mut impl FnMut(PyramidMark)) {
        let Some((first, second)) = self.pair() else {
            if self.gaps > 0 {
                draw(PyramidMark::Gap);
            }
            return;
        };
        let mut gaps = 0;
        for place in [Some(first), second].into_iter().flatten() {
            if place.gaps > gaps {
                draw(PyramidMark::Gap);
            }
            gaps = place.gaps;
            draw(PyramidMark::Point(place.index as usize, place.value));
        }
        if self.gaps > gaps {
            draw(PyramidMark::Gap);
        }
    }
}

/// Samples and the levels above them. Samples are only ever added.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pyramid {
    values: Vec<f32>,
    levels: Vec<Vec<Bucket>>,
}

impl Pyramid {
    /// A pyramid with room for so many samples.
    #[must_use]
    pub fn with_capacity(samples: usize) -> Self {
        Self { values: Vec::with_capacity(samples), levels: Vec::new() }
    }

    pub fn len(&self) -> usize {
        self.values.len()
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The values, gaps as they came.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Bytes of values and levels.
    pub fn bytes(&self) -> usize {
        let levels = self.levels.iter().map(Vec::len).sum::<usize>();
        self.values.len() * size_of::<f32>() + levels * size_of::<Bucket>()
    }

    /// Adds samples; those that are not finite are gaps. More than [`SAMPLES_MAX`] are left out.
    pub fn extend(&mut self, values: impl IntoIterator<Item = f32>) {
        let room = SAMPLES_MAX - self.values.len().min(SAMPLES_MAX);
        self.values.extend(values.into_iter().take(room));
        let mut below = self.values.len() / BUCKET;
        let mut level = 0;
        while below > 0 {
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            for index in self.levels[level].len()..below {
                let mut fold = Fold::default();
                match level.checked_sub(1) {
                    None => self.fold_values(index * BUCKET, (index + 1) * BUCKET, &mut fold),
                    Some(finer) => (index * FACTOR..(index + 1) * FACTOR)
                        .for_each(|child| self.fold_bucket(finer, child, &mut fold)),
                }
                self.levels[level].push(fold.bucket());
            }
            below /= FACTOR;
            level += 1;
        }
    }

    fn fold_values(&self, from: usize, to: usize, fold: &mut Fold) {
        let to = to.min(self.values.len());
        let from = from.min(to);
        for (value, index) in self.values[from..to].iter().zip(from as u32..) {
            if value.is_finite() {
                fold.take(index, *value);
                fold.weigh(*value, 1);
            } else {
                fold.gap();
            }
        }
    }

    fn fold_bucket(&self, level: usize, index: usize, fold: &mut Fold) {
        let Some(bucket) = self.levels.get(level).and_then(|own| own.get(index)) else {
            // Not whole yet: what there is of it stands in the finer ones.
            match level.checked_sub(1) {
                None => self.fold_values(index * BUCKET, (index + 1) * BUCKET, fold),
                Some(finer) => (index * FACTOR..(index + 1) * FACTOR)
                    .for_each(|child| self.fold_bucket(finer, child, fold)),
            }
            return;
        };
        fold.weigh(bucket.mean, BUCKET * FACTOR.pow(level as u32));
        if bucket.first & BEFORE != 0 {
            fold.gap();
        }
        for (place, gap) in [(bucket.first, 0), (bucket.second, BETWEEN)] {
            if place & PLACE == NONE {
                continue;
            }
            if place & gap != 0 {
                fold.gap();
            }
            let index = place & PLACE;
            fold.take(index, self.values[index as usize]);
        }
        if bucket.first & AFTER != 0 {
            fold.gap();
        }
    }

    /// Folds a stretch whose ends are multiples of `column`, a power of two.
    fn fold_column(&self, from: usize, column: usize, fold: &mut Fold) {
        if column < BUCKET {
            return self.fold_values(from, from + column, fold);
        }
        let (mut level, mut size) = (0, BUCKET);
        while size * FACTOR <= column {
            (level, size) = (level + 1, size * FACTOR);
        }
        for index in from / size..(from + column) / size {
            if index * size < self.values.len() {
                self.fold_bucket(level, index, fold);
            }
        }
    }

    /// Draws the samples of a range: of every `column` samples, a power of two, the lowest and the highest in
    /// order of time. Columns begin at multiples of `column`, whatever the range, so that a picture that is
    /// moved does not flicker; those that the range touches are drawn whole. A column of one draws every sample.
    pub fn draw(&self, from: usize, to: usize, column: usize, mut draw: impl FnMut(PyramidMark)) {
        let column = column.max(1).next_power_of_two();
        let to = to.min(self.values.len());
        if from >= to {
            return;
        }
        if column == 1 {
            for (value, index) in self.values[from..to].iter().zip(from..) {
                draw(if value.is_finite() {
                    PyramidMark::Point(index, *value)
                } else {
                    PyramidMark::Gap
                });
            }
            return;
        }
        for index in from / column..to.div_ceil(column) {
            let mut fold = Fold::default();
            self.fold_column(index * column, column, &mut fold);
            fold.draw(&mut draw);
        }
    }

    /// Hands out the columns that [`Self::draw`] draws of a range, each by the place where it begins; `None` for one
    /// without a number.
    pub fn columns(
        &self,
        from: usize,
        to: usize,
        column: usize,
        mut take: impl FnMut(usize, Option<ColumnStatistics>),
    ) {
        let column = column.max(1).next_power_of_two();
        let to = to.min(self.values.len());
        for index in from / column..to.div_ceil(column) {
            let mut fold = Fold::default();
            self.fold_column(index * column, column, &mut fold);
            let found = fold.low.zip(fold.high).map(|(low, high)| ColumnStatistics {
                low: low.value,
                high: high.value,
                mean: fold.mean(),
                has_gap: fold.gaps > 0,
            });
            take(index * column, found);
        }
    }

    /// Places and values of the lowest and the highest sample of a range; `None` without a number in it.
    pub fn extremes(&self, from: usize, to: usize) -> Option<[(usize, f32); 2]> {
        let to = to.min(self.values.len());
        let mut fold = Fold::default();
        let mut at = from;
        while at < to {
            // The largest column that begins here and does not reach beyond.
            let room = to - at;
            let column = 1 << at.trailing_zeros().min(room.ilog2());
            match column {
                1 => self.fold_values(at, at + 1, &mut fold),
                _ => self.fold_column(at, column, &mut fold),
            }
            at += column;
        }
        let found = |place: FoldSample| (place.index as usize, place.value);
        Some([found(fold.low?), found(fold.high?)])
    }
}

/// Samples in a column where so many are drawn on so many pixels: a power of two, with at most two points a pixel.
#[must_use]
pub fn column_for(samples: usize, pixels: f64) -> usize {
    let pixels = pixels.max(1.0);
    if samples as f64 <= 2.0 * pixels {
        return 1;
    }
    ((samples as f64 / pixels).ceil() as usize).next_power_of_two()
}

#[cfg(test)]
#[path = "pyramid_tests.rs"]
mod tests;
