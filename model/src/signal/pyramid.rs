//! Lowest, highest and mean of a recording at several coarsenesses, so that a plot of millions of samples finds the few
//! points it needs without looking at the rest. What is saved, fitted or exported is never thinned.
//!
//! The smallest bucket has 16 samples, as many as are looked through about as fast as a bucket is; each level is coarser
//! by a factor of four.
//!
//! Memory: 4 bytes a sample for its value, and 16 bytes a bucket, 1.3 bytes a sample over all levels.

/// Samples in a bucket of the finest level.
pub const BUCKET: usize = 16;
/// Buckets of a level in one of the next.
const FACTOR: usize = 4;

/// Most samples in one pyramid.
pub const SAMPLES_MAX: usize = 1 << 30;

/// What a column of samples has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnStatistics {
    pub low: f32,
    pub high: f32,
    /// Of its numbers.
    pub mean: f32,
    /// It has samples that are no numbers.
    pub has_gap: bool,
}

/// Of samples whose count is a power of two: without a number, low is above high and the mean no number.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bucket {
    low: f32,
    high: f32,
    mean: f32,
    /// Samples that are no numbers.
    gaps: u32,
}

/// Takes samples and buckets together.
struct Fold {
    low: f32,
    high: f32,
    sum: f64,
    numbers: u32,
    gaps: u32,
}

impl Fold {
    const EMPTY: Self =
        Self { low: f32::INFINITY, high: f32::NEG_INFINITY, sum: 0.0, numbers: 0, gaps: 0 };

    fn add_sample(&mut self, value: f32) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
            self.sum += f64::from(value);
            self.numbers += 1;
        } else {
            self.gaps += 1;
        }
    }

    fn add_bucket(&mut self, bucket: Bucket, samples: usize) {
        let numbers = samples as u32 - bucket.gaps;
        if numbers > 0 {
            self.low = self.low.min(bucket.low);
            self.high = self.high.max(bucket.high);
            self.sum += f64::from(bucket.mean) * f64::from(numbers);
        }
        self.numbers += numbers;
        self.gaps += bucket.gaps;
    }

    fn mean(&self) -> f32 {
        (self.sum / f64::from(self.numbers)) as f32
    }

    fn bucket(&self) -> Bucket {
        Bucket { low: self.low, high: self.high, mean: self.mean(), gaps: self.gaps }
    }

    fn statistics(&self) -> Option<ColumnStatistics> {
        (self.numbers > 0).then(|| ColumnStatistics {
            low: self.low,
            high: self.high,
            mean: self.mean(),
            has_gap: self.gaps > 0,
        })
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
        let mut size = BUCKET;
        for level in 0.. {
            let whole = self.values.len() / size;
            if whole == 0 {
                return;
            }
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            for index in self.levels[level].len()..whole {
                let mut fold = Fold::EMPTY;
                match level.checked_sub(1) {
                    None => self.fold_values(index * size, size, &mut fold),
                    Some(finer) => {
                        let own = &self.levels[finer][index * FACTOR..(index + 1) * FACTOR];
                        own.iter().for_each(|bucket| fold.add_bucket(*bucket, size / FACTOR));
                    }
                }
                self.levels[level].push(fold.bucket());
            }
            size *= FACTOR;
        }
    }

    fn fold_values(&self, from: usize, count: usize, fold: &mut Fold) {
        let to = (from + count).min(self.values.len());
        self.values[from.min(to)..to].iter().for_each(|value| fold.add_sample(*value));
    }

    /// Folds a stretch whose ends are multiples of `column`, a power of two.
    fn fold_column(&self, from: usize, column: usize, fold: &mut Fold) {
        let Some(level) = (column / BUCKET).checked_ilog2().map(|twos| twos / FACTOR.ilog2())
        else {
            return self.fold_values(from, column, fold);
        };
        let size = BUCKET * FACTOR.pow(level);
        for at in (from..(from + column).min(self.values.len())).step_by(size) {
            match self.levels.get(level as usize).and_then(|own| own.get(at / size)) {
                Some(bucket) => fold.add_bucket(*bucket, size),
                // Not whole yet: what there is of it stands in the finer ones.
                None if level == 0 => self.fold_values(at, size, fold),
                None => (0..FACTOR).for_each(|part| {
                    self.fold_column(at + part * size / FACTOR, size / FACTOR, fold);
                }),
            }
        }
    }

    /// Hands out the columns of a range, of `column` samples each, a power of two, by the place where each begins; `None`
    /// for one without a number. Columns begin at multiples of `column`, whatever the range, so that a picture that is
    /// moved does not flicker; those that the range touches are whole. A column of one is a sample.
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
            let mut fold = Fold::EMPTY;
            self.fold_column(index * column, column, &mut fold);
            take(index * column, fold.statistics());
        }
    }

    /// The lowest and the highest value of a range; `None` without a number in it.
    pub fn extremes(&self, from: usize, to: usize) -> Option<[f32; 2]> {
        let to = to.min(self.values.len());
        let mut fold = Fold::EMPTY;
        let mut at = from;
        while at < to {
            // The largest column that begins here and does not reach beyond.
            let room = to - at;
            let column = 1 << at.trailing_zeros().min(room.ilog2());
            self.fold_column(at, column, &mut fold);
            at += column;
        }
        fold.statistics().map(|found| [found.low, found.high])
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
