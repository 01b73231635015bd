//! The numbers beside the colours.

/// A number of a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendTick {
    /// Where it stands, from 0 at the least colour to 1 at the greatest.
    pub share: f64,
    pub text: String,
}

/// What colours stand for: a title with the unit, and round numbers at their places.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    pub title: String,
    pub ticks: Vec<LegendTick>,
}

/// The range of a legend: it grows with what is shown and never shrinks, so that colours do not change their meaning while
/// one looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowingRange {
    least: f64,
    greatest: f64,
}

impl GrowingRange {
    /// From zero to at least `greatest`.
    #[must_use]
    pub fn to(greatest: f64) -> Self {
        Self { least: 0.0, greatest }
    }

    /// Takes the least and the greatest value of a picture; what is not finite counts for nothing.
    pub fn take(&mut self, [least, greatest]: [f64; 2]) {
        if least.is_finite() {
            self.least = self.least.min(least);
        }
        if greatest.is_finite() {
            self.greatest = self.greatest.max(greatest);
        }
    }

    /// Zero and all that was taken are in it; its ends are zero or 1, 2 or 5 times a power of ten.
    #[must_use]
    pub fn range(self) -> [f64; 2] {
        let round = |length: f64| if length > 0.0 { round_step(length) } else { 0.0 };
        [-round(-self.least), round(self.greatest)]
    }
}

/// The most numbers beside a bar.
const TICKS: f64 = 6.0;

impl Legend {
    /// Of a range of values; no numbers for a range that is empty or not finite.
    #[must_use]
    pub fn new(title: impl Into<String>, [least, greatest]: [f64; 2]) -> Self {
        let length = greatest - least;
        let title = title.into();
        if !(length.is_finite() && length > 0.0) {
            return Self { title, ticks: Vec::new() };
        }
        let step = round_step(length / TICKS);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        // A millionth of a step for what rounding takes from the ends.
        let first = (least / step - 1e-6).ceil() as i64;
        let last = (greatest / step + 1e-6).floor() as i64;
        let ticks = (first..=last).map(|count| {
            let value = count as f64 * step;
            let share = ((value - least) / length).clamp(0.0, 1.0);
            LegendTick { share, text: format!("{value:.digits$}") }
        });
        Self { title, ticks: ticks.collect() }
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below a length.
fn round_step(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|step| step * power);
    steps.into_iter().find(|step| *step >= length * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(range: [f64; 2]) -> Vec<String> {
        Legend::new("", range).ticks.into_iter().map(|tick| tick.text).collect()
    }

    #[test]
    fn numbers_are_round_and_at_their_places() {
        assert_eq!(texts([0.0, 5.0]), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(texts([0.0, 0.12]), ["0.00", "0.02", "0.04", "0.06", "0.08", "0.10", "0.12"]);
        assert_eq!(texts([-1.0, 1.0]), ["-1.0", "-0.5", "0.0", "0.5", "1.0"]);
        let legend = Legend::new("depth (mm)", [1.0, 5.0]);
        assert_eq!(legend.ticks[1].text, "2");
        assert!((legend.ticks[1].share - 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_range_grows_by_round_steps_and_never_shrinks() {
        let mut range = GrowingRange::to(1.0);
        assert_eq!(range.range(), [0.0, 1.0]);
        range.take([0.2, 3.1]);
        range.take([f64::NAN, f64::INFINITY]);
        range.take([0.0, 0.5]);
        assert_eq!(range.range(), [0.0, 5.0]);
        range.take([-0.0035, 0.0]);
        assert_eq!(range.range(), [-0.005, 5.0]);
    }

    #[test]
    fn a_range_that_is_none_has_no_numbers() {
        for range in [[1.0, 1.0], [2.0, 1.0], [0.0, f64::NAN], [0.0, f64::INFINITY]] {
            assert!(texts(range).is_empty(), "{range:?}");
        }
    }
}
