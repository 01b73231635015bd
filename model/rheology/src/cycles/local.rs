//! Small fits to a stretch of a record: means, polynomials, and the depth of a force.

use palpate_model::linalg::Triangle;

/// Value and standard error of a mean; `None` for fewer than two numbers.
pub(super) fn mean(values: impl Iterator<Item = f64> + Clone) -> Option<[f64; 2]> {
    let count = values.clone().count() as f64;
    if count < 2.0 {
        return None;
    }
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    Some([mean, (squares / (count - 1.0) / count).sqrt()])
}

/// Value and slope of a polynomial at a place, each with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LocalFit {
    pub value: [f64; 2],
    pub slope: [f64; 2],
}

/// Least squares of a parabola through points `(x, y)`, read at `at`; `None` for points that do not determine it
/// or leave no degree of freedom for the error.
pub(super) fn parabola(points: &[[f64; 2]], at: f64) -> Option<LocalFit> {
    fit(points, at, 2)
}

/// The same of a straight line.
pub(super) fn line(points: &[[f64; 2]], at: f64) -> Option<LocalFit> {
    fit(points, at, 1)
}

fn fit(points: &[[f64; 2]], at: f64, degree: usize) -> Option<LocalFit> {
    let columns = degree + 1;
    let reach = points.iter().fold(0.0f64, |reach, point| reach.max((point[0] - at).abs()));
    if points.len() <= columns || reach <= 0.0 {
        return None;
    }
    let mut triangle = Triangle::<4>::default();
    for [x, y] in points {
        // About the place asked for, so that value and slope there are coefficients.
        let u = (x - at) / reach;
        let square = if degree == 2 { u * u } else { 0.0 };
        triangle.push([1.0, u, square, *y]);
    }
    // A line leaves the third column empty.
    let found = triangle.solve(columns)?;
    let variance = triangle.residual_sum() / (points.len() - columns) as f64;
    let error = |index: usize| Some((variance * triangle.inverse_diagonal(index, columns)?).sqrt());
    Some(LocalFit { value: [found[0], error(0)?], slope: [found[1] / reach, error(1)? / reach] })
}

/// Most bins a way is cut into to find a force on it: straight lines between them then miss a curve by less than
/// 1e-5 of its height.
const BINS_MAX: usize = 200;
/// Samples that a bin has at least, on average.
const BIN_SAMPLES: usize = 4;

/// Means of `(x, y)` over equal stretches of x from the least to the greatest, empty ones left out, each with the
/// standard error of its y (that of the whole, where it has too few samples of its own).
pub(super) fn bins(points: &[[f64; 2]]) -> Vec<[f64; 3]> {
    let (low, high) =
        points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
            (low.min(point[0]), high.max(point[0]))
        });
    let count = (points.len() / BIN_SAMPLES).clamp(1, BINS_MAX);
    let mut sums = vec![[0.0; 4]; count];
    for [x, y] in points {
        let share = (x - low) / (high - low).max(f64::MIN_POSITIVE);
        let sum = &mut sums[((share * count as f64) as usize).min(count - 1)];
        for (total, term) in sum.iter_mut().zip([1.0, *x, *y, 0.0]) {
            *total += term;
        }
    }
    // Within a bin y changes by its own slope too, so the noise is estimated from neighbouring samples.
    let noise = noise_of(points);
    sums.iter()
        .filter(|sum| sum[0] > 0.0)
        .map(|sum| [sum[1] / sum[0], sum[2] / sum[0], noise / sum[0].sqrt()])
        .collect()
}

/// Standard deviation of the noise of y, from second differences, which know no slope: for white noise their
/// variance is six times its own.
fn noise_of(points: &[[f64; 2]]) -> f64 {
    let seconds = points.windows(3).map(|three| three[0][1] - 2.0 * three[1][1] + three[2][1]);
    let (count, sum) =
        seconds.fold((0.0f64, 0.0), |(count, sum), one| (count + 1.0, sum + one * one));
    if count > 0.0 { (sum / count / 6.0).sqrt() } else { 0.0 }
}

/// Where y rises through a level for the last time, and its standard error, from bins in order of x.
pub(super) fn last_rise(bins: &[[f64; 3]], level: f64) -> Option<[f64; 2]> {
    let pair = bins.windows(2).rev().find(|pair| pair[0][1] < level && pair[1][1] >= level)?;
    let ([x0, y0, _], [x1, y1, error]) = (pair[0], pair[1]);
    let slope = (y1 - y0) / (x1 - x0);
    Some([x0 + (level - y0) / slope, error / slope])
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    #[test]
    fn a_parabola_is_read_exactly_and_its_errors_are_those_of_the_textbook() {
        let curve = |x: f64| 2.0 + 3.0 * (x - 7.0) - 0.5 * (x - 7.0).powi(2);
        let points: Vec<[f64; 2]> =
            (0..50).map(|i| 6.0 + 0.04 * f64::from(i)).map(|x| [x, curve(x)]).collect();
        let found = parabola(&points, 7.0).unwrap();
        assert!((found.value[0] - 2.0).abs() < 1e-12 && (found.slope[0] - 3.0).abs() < 1e-12);
        assert!(found.value[1] < 1e-12);
        assert!(parabola(&points[..3], 7.0).is_none() && line(&points[..1], 7.0).is_none());
        // A line of n points, read at their mean: sigma / sqrt(n), and sigma / (spread of x) for the slope.
        let noisy: Vec<[f64; 2]> =
            (0..100).map(|i| [f64::from(i), if i % 2 == 0 { 0.1 } else { -0.1 }]).collect();
        let found = line(&noisy, 49.5).unwrap();
        assert!((found.value[1] / 0.01 - 1.0).abs() < 0.02);
        let spread = (100.0f64 * (100.0 * 100.0 - 1.0) / 12.0).sqrt();
        assert!((found.slope[1] / (0.1 / spread) - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_level_is_found_within_its_error() {
        let mut random = SplitMix::seeded(3);
        let mut misses = Vec::new();
        for _ in 0..200 {
            let points: Vec<[f64; 2]> = (0..4000)
                .map(|i| 0.0025 * f64::from(i))
                .map(|x| [x, 0.05 * x * x + 0.02 * random.normal()])
                .collect();
            let [x, error] = last_rise(&bins(&points), 1.0).unwrap();
            misses.push((x - 20f64.sqrt()) / error);
        }
        let rms = (misses.iter().map(|miss| miss * miss).sum::<f64>() / 200.0).sqrt();
        // Between two bins the error is at most that of one and at least 0.7 of it.
        assert!((0.6..1.15).contains(&rms), "{rms}");
        assert_eq!(last_rise(&[[0.0, 1.0, 0.1], [1.0, 2.0, 0.1]], 3.0), None);
    }
}
